//! $random and $rdist_*: values of a generator whose state is the seed, a variable of the module.
//!
//! The seed goes on by the linear congruence of IEEE 1364 (17.9.3: 69069 seed + 1 modulo 2^32), which doubles hold exactly, so it
//! can be kept by an event like any other value. Distributions are made of it by the inverse of theirs, or by Box and Muller.
use super::ast::{Expression, E};
use super::elaborate::{Answer, Elaborator, Num, Val};
use super::source::Place;
use emsim_expr::graph::{Fun, Id};
use std::f64::consts::PI;

/// Does a function of that name draw, and set its seed?
pub fn draws(name: &str) -> bool {
    name == "$random" || name.starts_with("$rdist_") || name.starts_with("$dist_")
}

impl Elaborator<'_> {
    /// The seed where it is, goes on; a constant is a seed of its own. A number between 0 and 1, neither of them.
    fn uniform(&mut self, seed: &mut Id) -> Id {
        // IEEE 1364, 17.9.3: the factor, and what a seed of 0 stands for
        let [one, half, factor, modulus, instead] =
            [1.0, 0.5, 69069.0, 2f64.powi(32), 259_341_593.0].map(|v| self.g.constant(v));
        let from = self.g.select(*seed, *seed, instead);
        let next = self.g.mul(factor, from);
        let next = self.g.add(next, one);
        let turns = self.g.div(next, modulus);
        let turns = self.g.call(Fun::Floor, turns);
        let turns = self.g.mul(turns, modulus);
        let next = self.g.sub(next, turns);
        *seed = next;
        let middle = self.g.add(next, half);
        self.g.div(middle, modulus)
    }

    fn exponential(&mut self, seed: &mut Id) -> Id {
        let u = self.uniform(seed);
        let log = self.g.call(Fun::Log, u);
        self.g.neg(log)
    }

    fn normal(&mut self, seed: &mut Id) -> Id {
        let (e, u) = (self.exponential(seed), self.uniform(seed));
        let [two, turn] = [2.0, 2.0 * PI].map(|v| self.g.constant(v));
        let square = self.g.mul(two, e);
        let radius = self.g.call(Fun::Sqrt, square);
        let angle = self.g.mul(turn, u);
        let cosine = self.g.call(Fun::Cos, angle);
        self.g.mul(radius, cosine)
    }

    /// The sum of squares of so many normal numbers: pairs of them are exponential.
    fn chi_square(&mut self, seed: &mut Id, degrees: f64) -> Id {
        let mut sum = self.g.constant(0.0);
        let two = self.g.constant(2.0);
        for _ in 0..(degrees / 2.0) as usize {
            let e = self.exponential(seed);
            let pair = self.g.mul(two, e);
            sum = self.g.add(sum, pair);
        }
        if degrees % 2.0 == 1.0 {
            let n = self.normal(seed);
            let square = self.g.mul(n, n);
            sum = self.g.add(sum, square);
        }
        sum
    }

    /// How many steps of the distribution lie below a number between 0 and 1.
    fn poisson(&mut self, seed: &mut Id, mean: f64) -> Id {
        let u = self.uniform(seed);
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let (mut sum, mut term, mut below) = (zero, (-mean).exp(), 0.0);
        // as far as doubles tell the rest from 0
        for k in 1..=(mean + 10.0 * mean.sqrt() + 30.0) as usize {
            below += term;
            let edge = self.g.constant(below);
            let above = self.g.not_less(u, edge);
            let step = self.g.select(above, one, zero);
            sum = self.g.add(sum, step);
            term *= mean / k as f64;
        }
        sum
    }

    pub fn random(&mut self, name: &str, arguments: &[E], at: Place) -> Answer<Num> {
        let Some(&place) = arguments.first() else {
            let hint = "a seed is a variable that an event keeps: seed = 1, then $random(seed)";
            return self.stop(at, format!("{name} without a seed is not supported"), hint);
        };
        let whole = name == "$random" || name.starts_with("$dist");
        let given = self.plain_number(place)?.id;
        // a negative seed stands for what is 2^32 above it
        let [zero, modulus] = [0.0, 2f64.powi(32)].map(|v| self.g.constant(v));
        let above = self.g.not_less(given, zero);
        let lift = self.g.add(given, modulus);
        let mut seed = self.g.select(above, given, lift);
        let mut of = Vec::new();
        let kind = name.rsplit('_').next().unwrap_or(name);
        let counted = matches!(kind, "square" | "t" | "erlang" | "poisson");
        for (k, &e) in arguments.iter().enumerate().skip(1) {
            // "global" or "instance": both are of the instance
            if matches!(self.library.expressions[e as usize], Expression::Text(_)) {
                continue;
            }
            of.push(if counted && k == 1 { self.known_count(e, kind)? } else { self.plain_number(e)?.id });
        }
        let x = self.drawn(kind, &mut seed, &of, whole);
        // seeds and integers are kept with a sign, as those of 32 bits
        let limit = self.g.constant(2f64.powi(31));
        let signed = |run: &mut Self, v: Id| {
            let beyond = run.g.not_less(v, limit);
            let less = run.g.sub(v, modulus);
            run.g.select(beyond, less, v)
        };
        let kept = signed(self, seed);
        let kept = Val::Num(Num { whole: true, ..self.real(kept) });
        match self.library.expressions[place as usize] {
            Expression::Variable(k) => self.assign(k, None, kept, at)?,
            Expression::Element(k, index) => self.assign(k, Some(index), kept, at)?,
            _ => {}
        }
        let x = if kind == "$random" { signed(self, x) } else { x };
        let n = self.real(x);
        Ok(if whole { self.rounded(&n) } else { n })
    }

    /// A number of a distribution with the parameters `of` it.
    fn drawn(&mut self, kind: &str, seed: &mut Id, of: &[Id], whole: bool) -> Id {
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let number = |run: &Self, k: usize| run.g.value(of[k]).unwrap_or(0.0);
        match kind {
            "$random" => {
                self.uniform(seed);
                *seed
            }
            "uniform" => {
                let u = self.uniform(seed);
                let more = if whole { one } else { zero };
                let width = self.g.sub(of[1], of[0]);
                let width = self.g.add(width, more);
                let way = self.g.mul(width, u);
                let x = self.g.add(of[0], way);
                if whole {
                    self.g.call(Fun::Floor, x)
                } else {
                    x
                }
            }
            "normal" => {
                let n = self.normal(seed);
                let way = self.g.mul(n, of[1]);
                self.g.add(of[0], way)
            }
            "exponential" => {
                let e = self.exponential(seed);
                self.g.mul(of[0], e)
            }
            "poisson" => {
                let mean = number(self, 0);
                self.poisson(seed, mean)
            }
            "square" => {
                let degrees = number(self, 0);
                self.chi_square(seed, degrees)
            }
            "t" => {
                let degrees = number(self, 0);
                let (n, chi) = (self.normal(seed), self.chi_square(seed, degrees));
                let mean = self.g.div(chi, of[0]);
                let root = self.g.call(Fun::Sqrt, mean);
                self.g.div(n, root)
            }
            _ => {
                // a sum of stages, whose mean is given
                let degrees = number(self, 0);
                let chi = self.chi_square(seed, 2.0 * degrees);
                let stages = self.g.constant(2.0 * degrees);
                let stage = self.g.div(chi, stages);
                self.g.mul(stage, of[1])
            }
        }
    }

    /// Degrees of freedom, stages, or the mean of Poisson's distribution.
    fn known_count(&mut self, e: E, kind: &str) -> Answer<Id> {
        let v = self.known(e, "this number of a distribution")?;
        let fits = if kind == "poisson" { v > 0.0 } else { v >= 1.0 && v == v.round() };
        // each degree of freedom and each stage is a value of its own
        let most = 100.0;
        if !fits || v > most {
            let what = format!("{v} is no number that this distribution takes");
            return self.stop(
                self.place(e),
                what,
                format!("it is a positive number up to {most}, whole but for a mean"),
            );
        }
        Ok(self.g.constant(v))
    }
}
