//! Operators of time, noise and transfer functions: what an expression has beyond the values of its point.
use super::ast::{Expression, E};
use super::elaborate::{Answer, Elaborator, Num, Source};
use super::folded::{Mode, NoiseTable};
use super::source::Place;
use emsim_expr::graph::Id;
use std::rc::Rc;

impl Elaborator<'_> {
    /// idt(x, start, reset): while the reset is not 0 it is the start, from which it goes on.
    pub(super) fn integral(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let name = format!("idt#{}", self.unknowns.len());
        let (k, s) = self.unknown(name);
        let i = self.g.neg(x.id);
        let mut start = None;
        if let Some(&initial) = arguments.get(1) {
            let value = self.plain_number(initial)?.id;
            let Some(known) = self.g.value(value) else {
                return self.stop(at, "the initial value of idt hangs on voltages", "it is a number of parameters");
            };
            self.starts.push((k, known));
            start = Some(value);
        }
        self.row(k, i, s);
        let (Some(start), Some(&reset)) = (start, arguments.get(2)) else { return Ok(self.real(s)) };
        let reset = self.plain_number(reset)?;
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let on = match self.condition(reset.id) {
            (c, false) => self.g.select(c, one, zero),
            (c, true) => self.g.select(c, zero, one),
        };
        // the integral where the reset ended
        let ended = self.g.symbol();
        let (was, begun) = (self.mode(Mode::Kept(on)), self.begun());
        let [there, before] = [s, ended].map(|e| self.mode(Mode::Kept(e)));
        let held = self.g.select(was, there, before);
        let held = self.g.select(begun, held, start);
        self.finals.push((ended, held));
        let way = self.g.sub(s, ended);
        let id = self.g.add(start, way);
        let id = self.g.select(on, start, id);
        Ok(self.real(id))
    }

    /// ac_stim(analysis, magnitude, phase [rad]): a source of small signals in .ac, 0 elsewhere.
    pub(super) fn stimulus(&mut self, arguments: &[E]) -> Answer<Num> {
        let kind = arguments.first().map_or(Ok("ac".into()), |&e| self.text(e))?;
        let mut of = |k: usize, usual: f64| arguments.get(k).map_or(Ok(usual), |&e| self.known(e, "ac_stim"));
        let (size, phase) = (of(1, 1.0)?, of(2, 0.0)?);
        if kind != "ac" {
            return Ok(self.constant(0.0));
        }
        self.stimuli.push((size * phase.cos(), size * phase.sin()));
        let id = self.g.wave(self.stimuli.len() as u32 - 1);
        Ok(self.real(id))
    }

    /// absdelay(x, seconds): x as it was so long ago; at an operating point x itself.
    pub(super) fn late(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let by = self.known(arguments[1], "a delay")?;
        if !(by >= 0.0 && by.is_finite()) {
            return self.stop(at, format!("a delay of {by} s"), "what will be is not known");
        }
        if by == 0.0 || self.value_of(&x).is_some() {
            return Ok(x);
        }
        let id = self.mode(Mode::Late(x.id, by));
        Ok(self.real(id))
    }

    /// idtmod(x, start, modulus, offset): the integral, less as many moduli as lead to offset .. offset + modulus.
    pub(super) fn integral_within(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let s = self.integral(&arguments[..arguments.len().min(2)], at)?;
        if let (1, Some(start)) = (arguments.len(), self.unknowns.len().checked_sub(1)) {
            self.starts.push((start, 0.0));
        }
        let Some(&modulus) = arguments.get(2) else { return Ok(s) };
        let modulus = self.known(modulus, "the modulus of idtmod")?;
        let offset = arguments.get(3).map_or(Ok(0.0), |&e| self.known(e, "the offset of idtmod"))?;
        if !(modulus > 0.0 && modulus.is_finite()) {
            return self.stop(at, format!("idtmod with a modulus of {modulus}"), "it must be positive");
        }
        let (m, low) = (self.g.constant(modulus), self.g.constant(offset));
        let beyond = self.g.sub(s.id, low);
        let turns = self.g.div(beyond, m);
        let whole = self.mode(Mode::Floor(turns));
        let whole = self.g.mul(m, whole);
        let id = self.g.sub(s.id, whole);
        Ok(self.real(id))
    }

    pub(super) fn noise(&mut self, name: &str, arguments: &[E]) -> Answer<Num> {
        let power = self.plain_number(arguments[0])?.id;
        let flicker = name == "flicker_noise";
        let exponent = if flicker { Some(self.plain_number(arguments[1])?.id) } else { None };
        let label = match arguments.get(if flicker { 2 } else { 1 }) {
            Some(&e) => self.text(e)?,
            None => name.to_string(),
        };
        Ok(self.new_noise(label, power, exponent))
    }

    pub(super) fn new_noise(&mut self, label: String, power: Id, exponent: Option<Id>) -> Num {
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let name = format!("{}{label}", self.scope.prefix);
        self.sources.push(Source { name, power, exponent, uses: Vec::new(), unknown: None });
        let noise = Some(Rc::new(vec![(self.sources.len() - 1, one)]));
        Num { id: zero, whole: false, q: None, noise }
    }

    /// noise_table(pairs or file, name): between the pairs straight lines, of logarithms in noise_table_log; beyond them as at the last.
    pub(super) fn noise_of_table(&mut self, name: &str, arguments: &[E], at: Place) -> Answer<Num> {
        let list = match &self.library.expressions[arguments[0] as usize] {
            Expression::Text(file) => self.points_of_file(&file.clone(), arguments[0])?.concat(),
            _ => self.row_of_numbers(arguments[0])?,
        };
        let mut points: Vec<(f64, f64)> = list.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let logarithmic = name.ends_with("log");
        let fits = |v: f64| v.is_finite() && (v > 0.0 || v == 0.0 && !logarithmic);
        let ascends = points.windows(2).all(|w| w[0].0 < w[1].0);
        if list.len() % 2 != 0 || points.is_empty() || !ascends || !points.iter().all(|p| fits(p.0) && fits(p.1)) {
            let hint = "'{frequency, power, frequency, power, ..}: each frequency once, none of them negative";
            return self.stop(at, format!("this is no table of {name}"), hint);
        }
        let label = arguments.get(1).map_or(Ok(name.to_string()), |&e| self.text(e))?;
        let taken = |label: &String| self.sources.iter().any(|s| s.name == format!("{}{label}", self.scope.prefix));
        let label = match taken(&label) {
            true => format!("{label}#{}", self.sources.len()),
            false => label,
        };
        let one = self.g.constant(1.0);
        let n = self.new_noise(label, one, None);
        let name = self.sources[self.sources.len() - 1].name.clone();
        self.noise_tables.push(NoiseTable { name, points, logarithmic });
        Ok(n)
    }

    /// y = N(s)/D(s) x, by the chain of derivatives of x/D(s).
    pub(super) fn laplace(&mut self, name: &str, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let (top, bottom) = (self.row_of_numbers(arguments[1])?, self.row_of_numbers(arguments[2])?);
        let form = &name[8..];
        let roots = |list: &[f64], are: bool| if are { polynomial(list) } else { Some(list.to_vec()) };
        let (Some(mut n), Some(mut d)) = (roots(&top, form.starts_with('z')), roots(&bottom, form.ends_with('p')))
        else {
            return self.stop(at, "complex roots come in pairs", "'{real, imaginary, real, -imaginary}");
        };
        let trim = |p: &mut Vec<f64>| {
            while p.last() == Some(&0.0) {
                p.pop();
            }
        };
        trim(&mut n);
        trim(&mut d);
        if d.is_empty() {
            return self.stop(at, "the denominator is 0", "");
        }
        if n.len() > d.len() || d.len() > 30 {
            return self.stop(at, "the numerator is of a higher order than the denominator", "");
        }
        let order = d.len() - 1;
        let mut w = Vec::new();
        for k in 0..order {
            let label = format!("{name}#{}.{k}", self.unknowns.len());
            w.push(self.unknown(label));
        }
        // the highest derivative: d_m w_m = x - sum of d_k w_k
        let mut rest = x.id;
        for k in 0..order {
            let c = self.g.constant(d[k]);
            let term = self.g.mul(c, w[k].1);
            rest = self.g.sub(rest, term);
        }
        for k in 0..order {
            let (i, q) = if k + 1 < order {
                (self.g.neg(w[k + 1].1), w[k].1)
            } else {
                let c = self.g.constant(d[order]);
                (self.g.neg(rest), self.g.mul(c, w[k].1))
            };
            self.row(w[k].0, i, q);
        }
        let mut y = self.g.constant(0.0);
        for (k, &c) in n.iter().enumerate() {
            let value = if k < order {
                w[k].1
            } else {
                let c = self.g.constant(d[order]);
                self.g.div(rest, c)
            };
            let c = self.g.constant(c);
            let term = self.g.mul(c, value);
            y = self.g.add(y, term);
        }
        Ok(self.real(y))
    }
}

/// The polynomial with these roots (pairs of real and imaginary parts), 1 at s = 0 but for roots at 0.
fn polynomial(roots: &[f64]) -> Option<Vec<f64>> {
    if roots.len() % 2 != 0 {
        return None;
    }
    let mut p: Vec<(f64, f64)> = vec![(1.0, 0.0)];
    for root in roots.chunks(2) {
        let (re, im) = (root[0], root[1]);
        let size = re * re + im * im;
        // times (1 - s/r), or s
        let (c0, c1) = if size == 0.0 { ((0.0, 0.0), (1.0, 0.0)) } else { ((1.0, 0.0), (-re / size, im / size)) };
        let mut next = vec![(0.0, 0.0); p.len() + 1];
        for (k, &(a, b)) in p.iter().enumerate() {
            next[k].0 += a * c0.0 - b * c0.1;
            next[k].1 += a * c0.1 + b * c0.0;
            next[k + 1].0 += a * c1.0 - b * c1.1;
            next[k + 1].1 += a * c1.1 + b * c1.0;
        }
        p = next;
    }
    let real = p.iter().all(|c| c.1.abs() <= 1e-9 * c.0.abs().max(1e-300));
    real.then(|| p.iter().map(|c| c.0).collect())
}
