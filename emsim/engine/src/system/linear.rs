//! What is constant and what time alone decides, by themselves: row by row, or as a program without a loop once it recurs.
use super::{System, Work};
use crate::sparse::Recurring;
use crate::tape::{Inputs, Leaf, Tape, Value, Written};

/// Entries of both matrices above which a program is not written: its code would not stay in the processor's cache.
const LARGEST: usize = 1500;

/// The program, and how often its values were asked for.
#[derive(Default)]
pub struct Linear {
    evaluations: u64,
    program: Recurring,
    values: Vec<f64>, // F, then Q
}

impl System {
    /// The linear part and the waves: w.q, w.f are set, everything else adds to them.
    #[inline]
    pub(super) fn eval_linear(&self, w: &mut Work, x: &[f64]) {
        let Linear { evaluations, program, values } = &mut w.linear;
        *evaluations += 1;
        if let Some(program) = program.shared(*evaluations, &self.linear_program, || self.written_linear()) {
            values.resize(2 * self.n, 0.0);
            program.run(&Inputs { x, t: 0.0, waves: &w.waves, flags: &[] }, values);
            let (f, q) = values.split_at(self.n);
            w.f.copy_from_slice(f);
            w.q.copy_from_slice(q);
            return;
        }
        self.g_rows.times(&self.g_rows.value, x, |row, v| w.f[row] = v);
        self.c_rows.times(&self.c_rows.value, x, |row, v| w.q[row] = v);
        for &(row, k, coefficient) in &self.f_wave {
            w.f[row] += coefficient * w.waves[k];
        }
    }

    /// What `eval_linear` does row by row, operation by operation the same.
    fn written_linear(&self) -> Option<Tape> {
        let parts = [&self.g_rows, &self.c_rows].map(|rows| rows.terms().collect::<Vec<_>>());
        if parts.iter().map(Vec::len).sum::<usize>() > LARGEST {
            return None;
        }
        let constants = parts.iter().flatten().map(|term| term.2).chain(self.f_wave.iter().map(|f| f.2));
        let (mut program, values) = Written::new(&std::iter::once(0.0).chain(constants).collect::<Vec<_>>());
        let p = &mut program;
        let (zero, mut factors) = (values[0], values[1..].iter());
        let x: Vec<Value> = (0..self.n).map(|i| p.leaf(Leaf::X(i))).collect();
        let mut results = vec![zero; 2 * self.n];
        let mut add = |p: &mut Written, at: usize, factor: f64, value: Value| {
            let by = factors.next().copied().unwrap_or(zero);
            let own = results[at];
            results[at] = if factor == -1.0 {
                p.sub(own, value)
            } else {
                let product = if factor == 1.0 { value } else { p.mul(by, value) };
                if own == zero {
                    product
                } else {
                    p.add(own, product)
                }
            };
        };
        for (part, terms) in parts.iter().enumerate() {
            for &(row, col, factor, from) in terms {
                let value = from.map_or(x[col], |from| p.sub(x[col], x[from]));
                add(p, part * self.n + row, factor, value);
            }
        }
        for &(row, k, factor) in &self.f_wave {
            let wave = p.leaf(Leaf::Wave(k));
            add(p, row, factor, wave);
        }
        program.native(&results)
    }

    #[inline]
    pub fn subtract_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.f_wave {
            out[row] -= coefficient * w.waves[k];
        }
    }

    #[inline]
    pub fn add_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.f_wave {
            out[row] += coefficient * w.waves[k];
        }
    }

    /// q = C x of the constant part of C: all of Q where the equations are linear.
    #[inline]
    pub fn charges_of(&self, x: &[f64], q: &mut [f64]) {
        assert!(q.len() == self.n);
        self.c_rows.times(&self.c_rows.value, x, |row, v| q[row] = v);
    }
}
