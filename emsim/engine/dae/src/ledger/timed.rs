//! What time alone decides of the powers: the inertia, the weight and the damping of what a DRIVE moves. No unknown follows it, so no
//! step control does: it is integrated by itself, over as many parts as it asks for, and its terms are taken out of the others.
use super::{Sum, GAUSS};
use crate::graph::{Graph, Id, Node};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};

/// A summand of a power: sign, factors, divisors.
#[derive(Clone, Default)]
struct Term {
    negative: bool,
    factors: Vec<Id>,
    divisors: Vec<Id>,
}

pub struct Timed {
    tape: Tape,
    scratch: Vec<f64>,
    terms: Vec<(usize, Term)>, // of which power; factors and divisors are outputs of the tape
    now: Vec<f64>,             // of every power, at the time last looked at [W]
    until: f64,
    pub sums: Vec<Sum>,
    pub moved: Vec<f64>,
}

impl Timed {
    pub fn new(g: &Graph, powers: &[Id]) -> Timed {
        let reached = g.reachable(powers);
        let mut timed = vec![false; reached.last().map_or(0, |&id| id as usize + 1)];
        for &id in &reached {
            let node = g.node(id);
            timed[id as usize] = !matches!(node, Node::Unknown(_)) && node.operands().all(|k| timed[k as usize]);
        }
        let (mut terms, mut outputs) = (Vec::new(), Vec::new());
        for (k, &power) in powers.iter().enumerate() {
            let mut found = Vec::new();
            // terms of a power that sums are multiplied out to
            collect(g, &timed, power, Term::default(), &mut found, &mut { 200 });
            for mut term in found {
                for id in term.factors.iter_mut().chain(&mut term.divisors) {
                    outputs.push(*id);
                    *id = outputs.len() as Id - 1;
                }
                terms.push((k, term));
            }
        }
        let tape = Tape::new(g, &outputs);
        Timed {
            scratch: tape.workspace(),
            tape,
            terms,
            now: vec![0.0; powers.len()],
            until: 0.0,
            sums: vec![Sum::default(); powers.len()],
            moved: vec![0.0; powers.len()],
        }
    }

    /// The run goes on from t.
    pub fn jump(&mut self, t: f64) {
        self.until = t;
    }

    /// Their share in every power at `at` [W].
    pub fn at(&mut self, at: &Inputs) -> &[f64] {
        if !self.terms.is_empty() {
            self.now.fill(0.0);
            self.tape.run(at, &mut self.scratch);
            let value = |&k: &Id| self.tape.output(&self.scratch, k as usize);
            for (k, term) in &self.terms {
                let size =
                    term.factors.iter().map(value).product::<f64>() / term.divisors.iter().map(value).product::<f64>();
                self.now[*k] += if term.negative { -size } else { size };
            }
        }
        &self.now
    }

    /// Integrates up to t; nothing of x matters.
    pub fn advance(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        let start = std::mem::replace(&mut self.until, t);
        if t > start && !self.terms.is_empty() {
            let whole = self.over(sys, w, (start, t), x);
            // a twelfth halving is the last
            self.halve(sys, w, (start, t), x, whole, 12);
        }
    }

    fn halve(&mut self, sys: &System, w: &mut Work, (start, end): (f64, f64), x: &[f64], whole: Vec<f64>, left: u32) {
        let middle = 0.5 * (start + end);
        let (first, second) = (self.over(sys, w, (start, middle), x), self.over(sys, w, (middle, end), x));
        let agree = |k: usize| {
            let moved = self.moved[k].max(first[k].abs() + second[k].abs());
            // halved until the halves agree with the whole to so much of what has moved
            (first[k] + second[k] - whole[k]).abs() <= 1e-9 * moved
        };
        if left > 0 && !(0..whole.len()).all(agree) {
            self.halve(sys, w, (start, middle), x, first, left - 1);
            self.halve(sys, w, (middle, end), x, second, left - 1);
            return;
        }
        for (k, energy) in first.into_iter().enumerate().chain(second.into_iter().enumerate()) {
            self.sums[k].add(energy);
            self.moved[k] += energy.abs();
        }
    }

    fn over(&mut self, sys: &System, w: &mut Work, (start, end): (f64, f64), x: &[f64]) -> Vec<f64> {
        let mut found = vec![0.0; self.sums.len()];
        for (c, weight) in GAUSS {
            let t = start + c * (end - start);
            sys.set_time(w, t);
            let now = self.at(&Inputs { x, t, waves: &w.waves, flags: &w.flags });
            for (energy, power) in found.iter_mut().zip(now) {
                *energy += weight * (end - start) * power;
            }
        }
        found
    }
}

/// The summands of `id` that depend on no unknown, sums multiplied out where a factor depends on none.
fn collect(g: &Graph, timed: &[bool], id: Id, mut so_far: Term, found: &mut Vec<Term>, left: &mut usize) {
    if *left == 0 {
        return;
    }
    *left -= 1;
    if timed[id as usize] {
        so_far.factors.push(id);
        found.push(so_far);
        return;
    }
    let negated = |t: &Term| Term { negative: !t.negative, ..t.clone() };
    match g.node(id) {
        Node::Neg(a) => collect(g, timed, a, negated(&so_far), found, left),
        Node::Add(a, b) => {
            collect(g, timed, a, so_far.clone(), found, left);
            collect(g, timed, b, so_far, found, left);
        }
        Node::Sub(a, b) => {
            collect(g, timed, a, so_far.clone(), found, left);
            collect(g, timed, b, negated(&so_far), found, left);
        }
        Node::Mul(a, b) if timed[a as usize] || timed[b as usize] => {
            let (factor, rest) = if timed[a as usize] { (a, b) } else { (b, a) };
            so_far.factors.push(factor);
            collect(g, timed, rest, so_far, found, left);
        }
        Node::Div(a, b) if timed[b as usize] => {
            so_far.divisors.push(b);
            collect(g, timed, a, so_far, found, left);
        }
        _ => {}
    }
}
