//! Filters of samples: zi_nd and kin. x is taken every period, the output is held (LRM 4.5.12).
//!
//! y = b0 x + w1, w_i = b_i x - a_i y + w_(i+1): the transposed direct form, whose values are kept from sample to sample.
use super::ast::E;
use super::elaborate::{Answer, Elaborator, Num};
use super::folded::Mode;
use super::source::Place;
use emsim_expr::graph::Id;

impl Elaborator<'_> {
    /// zi_xx(x, numerator, denominator, period, edge, start). At operating points its gain is that at 0 Hz, or b0 where a pole is there.
    pub fn sampled(&mut self, name: &str, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let form = &name[3..];
        let row = |run: &mut Self, e: E, roots: bool| -> Answer<Option<Vec<f64>>> {
            let list = run.row_of_numbers(e)?;
            Ok(if roots { delayed_polynomial(&list) } else { Some(list) })
        };
        let top = row(self, arguments[1], form.starts_with('z'))?;
        let bottom = row(self, arguments[2], form.ends_with('p'))?;
        let (Some(top), Some(bottom)) = (top, bottom) else {
            return self.stop(at, "complex roots come in pairs", "'{real, imaginary, real, -imaginary}");
        };
        let mut times = [0.0; 3];
        for (k, time) in times.iter_mut().enumerate() {
            if let Some(&e) = arguments.get(k + 3) {
                *time = self.known(e, "a time of this filter")?;
            }
        }
        let [period, edge, start] = times;
        if !(period > 0.0 && edge >= 0.0 && [period, edge, start].iter().all(|t| t.is_finite())) {
            let what = format!("{name} with a period of {period} s and edges of {edge} s");
            return self.stop(at, what, "a period is positive, an edge 0 or positive");
        }
        let order = top.len().max(bottom.len()).saturating_sub(1);
        let Some(&first) = bottom.first().filter(|&&d| d != 0.0) else {
            return self.stop(
                at,
                "the denominator begins with 0",
                "1 + d1/z + d2/z^2: the output would come before its input",
            );
        };
        // each order is two histories
        if order > 200 {
            return self.stop(at, format!("{name} of order {order}"), "200 is the most");
        }
        if self.frame.at_event {
            return self.stop(at, format!("{name} at an event"), "write it outside of the event");
        }
        let of = |list: &[f64]| (0..=order).map(|k| list.get(k).unwrap_or(&0.0) / first).collect::<Vec<f64>>();
        let (b, a) = (of(&top), of(&bottom));
        self.leave_out(&format!("{name} in .ac and .noise"), "there its gain is that at 0 Hz");
        let y = self.held_samples(x.id, &b, &a, (start, period));
        let y = if edge > 0.0 && self.value_of(&x).is_none() { self.ramped(y, [edge, edge]) } else { y };
        Ok(self.real(y))
    }

    fn held_samples(&mut self, x: Id, b: &[f64], a: &[f64], (start, period): (f64, f64)) -> Id {
        let order = b.len() - 1;
        let (over, under): (f64, f64) = (b.iter().sum(), a.iter().sum());
        // at rest; with a pole at 0 Hz one sample behind nothing
        let rests = under != 0.0;
        let gain = if rests { over / under } else { b[0] };
        let mut w = vec![0.0; order + 2];
        for i in (1..=order).rev() {
            w[i] = b[i] - a[i] * gain + if rests { w[i + 1] } else { 0.0 };
        }
        let (_, fires) = self.instants(start, period);
        let begun = self.begun();
        let symbols: Vec<Id> = (0..=order).map(|_| self.g.symbol()).collect();
        let sample = self.mode(Mode::Kept(x));
        let scaled = |run: &mut Self, factor: f64, of: Id| {
            let factor = run.g.constant(factor);
            run.g.mul(factor, of)
        };
        let before: Vec<Id> = symbols.iter().map(|&s| self.mode(Mode::Kept(s))).collect();
        let mut new = scaled(self, b[0], sample);
        if order > 0 {
            new = self.g.add(new, before[1]);
        }
        let output = new;
        for i in 0..=order {
            let state = if i == 0 {
                output
            } else {
                let (from_x, from_y) = (scaled(self, b[i], sample), scaled(self, -a[i], output));
                let sum = self.g.add(from_x, from_y);
                match before.get(i + 1) {
                    Some(&next) => self.g.add(sum, next),
                    None => sum,
                }
            };
            let rest = scaled(self, if i == 0 { gain } else { w[i] }, x);
            let held = self.g.select(fires, state, before[i]);
            let runs = self.in_transients(begun);
            let held = self.g.select(runs, held, rest);
            self.finals.push((symbols[i], held));
        }
        symbols[0]
    }
}

/// The product of (1 - r/z) over roots r (pairs of real and imaginary parts), by powers of 1/z.
fn delayed_polynomial(roots: &[f64]) -> Option<Vec<f64>> {
    if roots.len() % 2 != 0 {
        return None;
    }
    let mut p: Vec<(f64, f64)> = vec![(1.0, 0.0)];
    for root in roots.chunks(2) {
        let mut next = p.clone();
        next.push((0.0, 0.0));
        for (k, &(re, im)) in p.iter().enumerate() {
            next[k + 1].0 -= re * root[0] - im * root[1];
            next[k + 1].1 -= re * root[1] + im * root[0];
        }
        p = next;
    }
    let size = p.iter().map(|c| c.0.abs()).fold(0.0, f64::max);
    p.iter().all(|c| c.1.abs() <= 1e-9 * size).then(|| p.iter().map(|c| c.0).collect())
}
