//! What is constant and what time alone decides, by themselves: row by row, or as a program without a loop once it recurs. All of Q and
//! F by such a program, expressions included.
use super::{System, Work};
use crate::graph::Graph;
use crate::sparse::Recurring;
use crate::tape::{Inputs, Leaf, Signed, Tape, Value, Written};

/// The programs, and how often their values were asked for.
#[derive(Default)]
pub struct Linear {
    evaluations: u64,
    program: Recurring,
    values: Vec<f64>, // F, then Q
    rows: u64,
    whole: Recurring,
}

impl System {
    /// The linear part and the waves: w.q, w.f are set, everything else adds to them.
    #[inline]
    pub(super) fn eval_linear(&self, w: &mut Work, x: &[f64]) {
        let Linear { evaluations, program, values, .. } = &mut w.linear;
        *evaluations += 1;
        if let Some(program) = program.shared(*evaluations, &self.made.linear_program, || self.written_linear()) {
            values.resize(2 * self.n, 0.0);
            program.run(&Inputs { x, t: 0.0, waves: &w.waves, flags: &[] }, values);
            let (f, q) = values.split_at(self.n);
            w.f.copy_from_slice(f);
            w.q.copy_from_slice(q);
            return;
        }
        self.constant.g_rows.times(&self.constant.g_rows.value, x, |row, v| w.f[row] = v);
        self.constant.c_rows.times(&self.constant.c_rows.value, x, |row, v| w.q[row] = v);
        for &(row, k, coefficient) in &self.constant.f_wave {
            w.f[row] += coefficient * w.waves[k];
        }
    }

    /// F and Q at (x, t), one behind the other in `rows`: what `eval` finds, without limiting. `waves`: the sources' at t.
    #[inline]
    pub fn eval_rows(&self, w: &mut Work, x: &[f64], t: f64, waves: &[f64], rows: &mut [f64]) {
        assert!(x.len() == self.n && rows.len() == 2 * self.n);
        if w.linear.whole.program.is_none() {
            self.ask_for_whole(w);
        }
        let program = w.linear.whole.program.as_mut().filter(|_| w.free.is_empty());
        let Some(program) = program else {
            self.recall_waves(w, t, waves);
            self.eval(w, x, t);
            rows[..self.n].copy_from_slice(&w.f);
            rows[self.n..].copy_from_slice(&w.q);
            return;
        };
        w.counters.evaluations += 1;
        program.run(&Inputs { x, t, waves, flags: &w.flags }, rows);
        let (f, q) = rows.split_at_mut(self.n);
        self.devices.add_values(x, w.gmin, f, q);
    }

    /// Asks once more for a program of all of Q and F, which is written where it pays.
    fn ask_for_whole(&self, w: &mut Work) {
        let Linear { rows: count, whole, .. } = &mut w.linear;
        *count += 1;
        // to write that takes as long as so many times what others take
        whole.shared(*count / 4, &self.made.whole_program, || self.written(&self.expressions.values));
    }

    /// What `eval_linear` does row by row, operation by operation the same.
    fn written_linear(&self) -> Option<Tape> {
        self.written(&Tape::new(&Graph::new(), &[]))
    }

    /// The same, and `values` added to the rows of expressions.
    fn written(&self, values: &Tape) -> Option<Tape> {
        let parts = [&self.constant.g_rows, &self.constant.c_rows].map(|rows| rows.terms().collect::<Vec<_>>());
        // longer code, by entries of both matrices or operations of expressions, would not stay in the processor's
        // cache
        if parts.iter().map(Vec::len).sum::<usize>() > 1500 || values.len() > 3000 {
            return None;
        }
        let constants = parts.iter().flatten().map(|term| term.2).chain(self.constant.f_wave.iter().map(|f| f.2));
        let constants: Vec<f64> = std::iter::once(0.0).chain(constants).collect();
        let (mut program, constants, outputs) = Written::after(values, &constants);
        let p = &mut program;
        let (zero, mut factors) = (constants[0], constants[1..].iter());
        let x: Vec<Value> = (0..self.n).map(|i| p.leaf(Leaf::X(i))).collect();
        let mut sums: Vec<Option<Signed>> = vec![None; 2 * self.n];
        let mut add = |p: &mut Written, at: usize, factor: f64, value: Signed| {
            let by = factors.next().copied().unwrap_or(zero);
            let product = match factor {
                1.0 => value,
                -1.0 => -value,
                _ => p.times(by, value),
            };
            sums[at] = Some(p.more(sums[at], product));
        };
        for (part, terms) in parts.iter().enumerate() {
            for &(row, col, factor, from) in terms {
                let value = p.difference(x[col], from.map(|from| x[from]));
                add(p, part * self.n + row, factor, value);
            }
        }
        for &(row, k, factor) in &self.constant.f_wave {
            let wave = p.leaf(Leaf::Wave(k));
            add(p, row, factor, wave.into());
        }
        let mut results: Vec<Value> = sums.iter().map(|sum| sum.map_or(zero, |sum| p.plain(sum))).collect();
        let rows =
            self.expressions.f_rows.iter().copied().chain(self.expressions.q_rows.iter().map(|row| self.n + row));
        for (row, value) in rows.zip(outputs) {
            results[row] = p.add(results[row], value);
        }
        program.native(&results)
    }

    #[inline]
    pub fn subtract_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.constant.f_wave {
            out[row] -= coefficient * w.waves[k];
        }
    }

    /// sizes <- sum of |terms| of F + a Q at x, before they cancel: of what is linear, and of expressions. `q` is Q, which devices
    /// have a part in.
    pub fn sizes(&self, w: &Work, a: f64, [x, q]: [&[f64]; 2], sizes: &mut [f64]) {
        self.terms(x, sizes);
        let mut stored = vec![0.0; self.n];
        self.constant.c_rows.sizes(x, |row, size| stored[row] = size);
        let t = if w.wave_time.is_finite() { w.wave_time } else { 0.0 };
        let found = self.expressions.values.sizes(&Inputs { x, t, waves: &w.waves, flags: &w.flags });
        let (of_f, of_q) = found.split_at(self.expressions.f_rows.len());
        self.expressions.f_rows.iter().zip(of_f).for_each(|(&row, size)| sizes[row] += size);
        self.expressions.q_rows.iter().zip(of_q).for_each(|(&row, size)| stored[row] += size);
        for (size, (stored, q)) in sizes.iter_mut().zip(stored.iter().zip(q)) {
            *size += a.abs() * stored.max(q.abs());
        }
    }

    #[inline]
    pub fn add_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.constant.f_wave {
            out[row] += coefficient * w.waves[k];
        }
    }

    /// q = C x of the constant part of C: all of Q where the equations are linear.
    #[inline]
    pub fn charges_of(&self, x: &[f64], q: &mut [f64]) {
        assert!(q.len() == self.n);
        self.constant.c_rows.times(&self.constant.c_rows.value, x, |row, v| q[row] = v);
    }
}
