//! One stage  F + a Q + r = 0  of an implicit method: what its Newton iteration asks of the equations, evaluated row by row or
//! written as programs without a loop (newton.rs says when).
use super::devices::{ends, signed, Current, Slope};
use super::{System, Work};
use crate::devices::{Met, Near};
use crate::multiversion::whole;
use crate::sparse::{Equations, Stamp};
use crate::tape::{Inputs, Leaf, Signed, Value, Written};

/// One stage as its programs read it: the iterate x, r, and the sources. x and r fill whole blocks of four, with anything behind them.
#[derive(Default)]
pub struct Stage {
    numbers: Vec<f64>,
    n: usize,
}

impl Stage {
    pub fn new(sys: &System) -> Stage {
        Stage { numbers: vec![0.0; 2 * whole(sys.n) + sys.waves.len()], n: sys.n }
    }

    pub fn x(&self) -> &[f64] {
        &self.numbers[..self.n]
    }

    pub fn r(&self) -> &[f64] {
        &self.numbers[whole(self.n)..][..self.n]
    }

    pub fn x_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[..self.n]
    }

    /// x and r.
    pub fn parts_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        let n = self.n;
        let (x, r) = self.blocks_mut();
        (&mut x[..n], &mut r[..n])
    }

    /// x and r in whole blocks.
    pub fn blocks_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        let block = whole(self.n);
        let (x, rest) = self.numbers.split_at_mut(block);
        (x, &mut rest[..block])
    }

    pub fn x_blocks(&self) -> &[f64] {
        &self.numbers[..whole(self.n)]
    }

    pub fn set_sources(&mut self, w: &Work) {
        let block = whole(self.n);
        for (own, wave) in self.numbers[2 * block..].iter_mut().zip(&w.waves) {
            *own = *wave;
        }
    }

    /// What the programs of a stage read besides what was expanded.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }
}

/// A number of the straight lines in a program.
fn number(p: &mut Written, place: usize) -> Value {
    p.leaf(Leaf::Flag(place))
}

impl System {
    /// Evaluates what is not linear, for one stage  F + a Q + r = 0  at the iterate x.
    #[inline]
    pub fn stage_expand(&self, w: &mut Work, x: &[f64], t: f64, a: f64) {
        self.stage_met(w, x, t, a, None);
    }

    #[inline]
    fn stage_met(&self, w: &mut Work, x: &[f64], t: f64, a: f64, near: Option<Near>) -> Met {
        w.counters.evaluations += 1;
        w.counters.jacobians += 1;
        self.expand(w, x, t, a, true, near)
    }

    /// The same at the next iterate; true when every device met the straight line that led there so well, that what was
    /// missed of its current is worth less than the tolerance of its voltage (in passive networks only).
    pub fn stage_expand_and_judge(&self, w: &mut Work, x: &[f64], t: f64, a: f64, (reltol, vntol): (f64, f64)) -> bool {
        if !self.passive {
            self.stage_expand(w, x, t, a);
            return false;
        }
        self.stage_expand_near(w, x, t, a, Near { reltol, vntol, share: 0.0, least: 0.0 })
    }

    /// The same at the next iterate; true when no voltage was limited and all currents are so near to those of the straight lines
    /// that led there.
    #[inline]
    pub(super) fn stage_expand_near(&self, w: &mut Work, x: &[f64], t: f64, a: f64, near: Near) -> bool {
        let met = self.stage_met(w, x, t, a, Some(near));
        !met.moved && !met.apart
    }

    /// Constant parts of a stage: of its residual in `rows`, of its matrix on the pattern in `base`.
    pub fn stage_constants(&self, a: f64, rows: &mut Vec<f64>, base: &mut Vec<f64>) {
        rows.clear();
        rows.extend(self.constant.stage_g.value.iter().zip(&self.constant.stage_c.value).map(|(g, c)| g + a * c));
        base.clear();
        base.extend(self.constant.g.iter().zip(&self.constant.c).map(|(g, c)| g + a * c));
    }

    /// out = -(F + a Q + r) at x, with `rows` of `stage_constants` and what was expanded at x.
    pub fn stage_residual(&self, w: &Work, a: f64, rows: &[f64], r: &[f64], x: &[f64], out: &mut [f64]) {
        assert!(out.len() == self.n && r.len() == self.n);
        self.constant.stage_g.times(rows, x, |row, v| out[row] = -(v + r[row]));
        self.subtract_waves(w, out);
        let nf = self.expressions.f_rows.len();
        for (k, &row) in self.expressions.f_rows.iter().enumerate() {
            out[row] -= self.expressions.jacobian.output(&w.programs.jacobian, k);
        }
        for (k, &row) in self.expressions.q_rows.iter().enumerate() {
            out[row] -= a * self.expressions.jacobian.output(&w.programs.jacobian, nf + k);
        }
        self.subtract_currents(w, out);
    }

    /// Sources of the stamps (see `stamps`) of what was expanded.
    pub fn stage_sources(&self, w: &Work, a: f64, sources: &mut Vec<f64>) {
        sources.clear();
        sources.extend(self.devices.slopes.iter().map(|s| w.lines[s.stage]));
        let first = self.expressions.f_rows.len() + self.expressions.q_rows.len();
        let (ng, nc) = (self.expressions.g_slots.len(), self.expressions.c_slots.len());
        sources.extend((first..first + ng).map(|k| self.expressions.jacobian.output(&w.programs.jacobian, k)));
        sources.extend(
            (first + ng..first + ng + nc).map(|k| a * self.expressions.jacobian.output(&w.programs.jacobian, k)),
        );
    }

    /// Which entries of the matrix of a stage change from iterate to iterate.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// Q(x) to first order about the point x - step that was expanded; about x itself where `step` is None.
    pub fn stage_charges(&self, w: &Work, x: &[f64], step: Option<&[f64]>, q: &mut [f64]) {
        self.charges_of(x, q);
        let first = self.expressions.f_rows.len();
        for (k, &row) in self.expressions.q_rows.iter().enumerate() {
            q[row] += self.expressions.jacobian.output(&w.programs.jacobian, first + k);
        }
        if let Some(step) = step {
            self.add_expression_c(w, step, q);
        }
        self.add_charges(w, x, q);
    }

    /// What the programs of a stage read: `numbers` and the factor a as the caller has them, and what was expanded.
    pub fn stage_inputs<'a>(&self, w: &'a Work, numbers: &'a [f64], a: f64) -> Inputs<'a> {
        Inputs { x: numbers, t: a, waves: &w.programs.jacobian, flags: &w.lines }
    }

    /// The linear equations of a Newton update, matrix and right-hand side of  (G + a C) dx = -(F + a Q + r): operation by operation
    /// what `stage_constants`, `stage_residual` and the stamps come to.
    pub fn stage_equations(&self) -> Equations {
        let (n, block) = (self.n, whole(self.n));
        let coefficients = self.constant.f_wave.iter().map(|f| &f.2);
        let parts = [&self.constant.g, &self.constant.c, &self.constant.stage_g.value, &self.constant.stage_c.value];
        let constants = [0.0, 1.0].iter().chain(parts.into_iter().flatten()).chain(coefficients);
        let (mut program, values) = Written::new(&constants.copied().collect::<Vec<_>>());
        let p = &mut program;
        let ([zero, one], mut values) = ([values[0], values[1]], &values[2..]);
        let mut next = |count: usize| {
            let (these, rest) = values.split_at(count);
            values = rest;
            these
        };
        let [g, c, own_g, own_c] = parts.map(|part| next(part.len()));
        let coefficients = next(self.constant.f_wave.len());
        let a = p.leaf(Leaf::Time);
        let x: Vec<Value> = (0..n).map(|i| p.leaf(Leaf::X(i))).collect();
        // g + a c, where it is not zero
        let sum = |p: &mut Written, (g, g_size): (Value, f64), (c, c_size): (Value, f64)| {
            if c_size == 0.0 {
                return (g_size != 0.0).then_some(g);
            }
            let stored = p.mul(a, c);
            Some(if g_size == 0.0 { stored } else { p.add(g, stored) })
        };
        // constant derivatives of expressions are in the matrix alone
        let (mut matrix, mut sums) = (vec![None; g.len()], vec![None; n]);
        for (k, (row, col, g_size, from)) in self.constant.stage_g.terms().enumerate() {
            let (c_size, place) =
                (self.constant.stage_c.value[k], self.pattern.position(row, col).expect("part of the pattern"));
            let Some(entry) = sum(p, (own_g[k], g_size), (own_c[k], c_size)) else { continue };
            if (g_size, c_size) == (self.constant.g[place], self.constant.c[place]) {
                matrix[place] = Some(entry);
            }
            let factor = p.difference(x[col], from.map(|from| x[from]));
            let product = p.times(entry, factor);
            sums[row] = Some(p.more(sums[row], product));
        }
        let mut matrix: Vec<Value> = (matrix.iter().enumerate())
            .map(|(k, entry)| {
                let (g, c) = ((g[k], self.constant.g[k]), (c[k], self.constant.c[k]));
                entry.or_else(|| sum(p, g, c)).unwrap_or(zero)
            })
            .collect();
        let mut b: Vec<Value> = (sums.iter().enumerate())
            .map(|(row, sum)| {
                let r = p.leaf(Leaf::X(block + row)).into();
                let sum = sum.map_or(r, |sum| p.more(Some(sum), r));
                p.less(zero, sum)
            })
            .collect();
        for (&(row, wave, _), &coefficient) in self.constant.f_wave.iter().zip(coefficients) {
            let value = p.leaf(Leaf::X(2 * block + wave));
            let product = p.mul(coefficient, value);
            b[row] = p.sub(b[row], product);
        }
        self.add_expanded(p, [zero, a], &mut matrix, &mut b);
        Equations { program, zero, one, matrix, b }
    }

    /// What was expanded comes into matrix and right-hand side: expressions and devices. With the values of 0 and a.
    fn add_expanded(&self, p: &mut Written, [zero, a]: [Value; 2], matrix: &mut [Value], b: &mut [Value]) {
        // outputs of the expressions: F rows, Q rows, then entries of G and of C
        let mut outputs = self.expressions.jacobian.part_places(0).iter();
        let mut output = |p: &mut Written, stored: bool| {
            let value = outputs.next().map_or(zero, |&slot| p.leaf(Leaf::Wave(slot as usize)));
            if stored {
                p.mul(a, value)
            } else {
                value
            }
        };
        for (&row, stored) in with(&self.expressions.f_rows, false).chain(with(&self.expressions.q_rows, true)) {
            let value = output(p, stored);
            b[row] = p.sub(b[row], value);
        }
        for c in &self.devices.currents {
            let current = number(p, c.stage);
            for (row, sign) in signed(c.rows) {
                b[row] = if sign > 0.0 { p.sub(b[row], current) } else { p.add(b[row], current) };
            }
        }
        for s in &self.devices.slopes {
            let conductance = number(p, s.stage);
            for (k, sign) in s.stamps() {
                matrix[k] = if sign > 0.0 { p.add(matrix[k], conductance) } else { p.sub(matrix[k], conductance) };
            }
        }
        for (&k, stored) in with(&self.expressions.g_slots, false).chain(with(&self.expressions.c_slots, true)) {
            let value = output(p, stored);
            matrix[k] = p.add(matrix[k], value);
        }
    }

    /// Q at x as `stage_charges` has it; None where expressions store charge.
    pub fn stage_closing(&self) -> Option<(Written, Vec<Value>)> {
        let charge = |p: &mut Written, c: &Current| c.charge.map(|place| number(p, place));
        let (mut program, [zero, _], q) = self.written_charges(charge, |p, c, v, s| {
            let at = number(p, s.at);
            let beyond = p.sub(v, at);
            p.mul(c, beyond)
        })?;
        let results = q.iter().map(|q| q.map_or(zero, |q| program.plain(q))).collect();
        Some((program, results))
    }

    /// a C x with the C of what was expanded last; None where expressions store charge.
    pub fn stage_stored(&self) -> Option<(Written, Vec<Value>)> {
        let (mut program, [zero, a], q) = self.written_charges(|_, _| None, |p, c, v, _| p.mul(c, v))?;
        let p = &mut program;
        let results = q.iter().map(|q| {
            q.map_or(zero, |q| {
                let by_a = p.times(a, q);
                p.plain(by_a)
            })
        });
        let results = results.collect();
        Some((program, results))
    }

    /// The sums of what is stored in each row: of constant entries at x, of each current of a device what `held` says, and of each
    /// slope with its capacitance and the port voltage at x what `more` makes of it. With the values of 0 and a.
    fn written_charges(
        &self,
        held: impl Fn(&mut Written, &Current) -> Option<Value>,
        more: impl Fn(&mut Written, Value, Value, &Slope) -> Value,
    ) -> Option<(Written, [Value; 2], Vec<Option<Signed>>)> {
        if !self.expressions.q_rows.is_empty() || !self.expressions.constant_c.is_empty() {
            return None;
        }
        let entries: Vec<_> = self.constant.c_rows.terms().collect();
        let constants: Vec<f64> = std::iter::once(0.0).chain(entries.iter().map(|e| e.2)).collect();
        let (mut program, values) = Written::new(&constants);
        let p = &mut program;
        let (zero, c) = (values[0], &values[1..]);
        let a = p.leaf(Leaf::Time);
        let x: Vec<Value> = (0..self.n).map(|i| p.leaf(Leaf::X(i))).collect();
        let mut q: Vec<Option<Signed>> = vec![None; self.n];
        for (&(row, col, _, from), &c) in entries.iter().zip(c) {
            let factor = p.difference(x[col], from.map(|from| x[from]));
            let product = p.times(c, factor);
            q[row] = Some(p.more(q[row], product));
        }
        let mut put = |p: &mut Written, rows: [i32; 4], charge: Value| {
            let charge = Signed::from(charge);
            for (row, sign) in signed(rows) {
                q[row] = Some(p.more(q[row], if sign > 0.0 { charge } else { -charge }));
            }
        };
        for c in &self.devices.currents {
            if let Some(charge) = held(p, c) {
                put(p, c.rows, charge);
            }
        }
        for s in &self.devices.slopes {
            let Some(capacitance) = s.capacitance else { continue };
            let capacitance = number(p, capacitance);
            let v = ends(s.ports).fold(None, |v: Option<Value>, (k, sign)| {
                Some(match (v, sign > 0.0) {
                    (None, true) => x[k],
                    (Some(v), true) => p.add(v, x[k]),
                    (v, false) => p.sub(v.unwrap_or(zero), x[k]),
                })
            });
            let charge = more(p, capacitance, v.unwrap_or(zero), s);
            put(p, s.rows, charge);
        }
        Some((program, [zero, a], q))
    }
}

/// Places, each with a word about it.
fn with(places: &[usize], stored: bool) -> impl Iterator<Item = (&usize, bool)> {
    places.iter().map(move |place| (place, stored))
}
