//! Factors and solutions of a small matrix as straight-line code: the operations of lu.rs in the same order and with the same
//! rounding, without the lists that say where they take place. A circuit of four diodes is factored and solved in a quarter of
//! the instructions.
use super::lu::{Column, Group};
use crate::tape::{Inputs, Leaf, Tape, Value, Written};

/// What has recurred so often with the same pivots is written as a program: that takes some 25 us, half of them the system's to
/// make it executable, and spares 0.07 us of every step of four diodes.
const WORTH: u64 = 150;
/// Multiply-subtract operations of a refactorisation above which a program would not stay in the processor's cache.
pub const LARGEST: usize = 1000;

/// The layout of a factorisation (lu.rs) and the order of its operations.
pub(super) struct Layout<'a> {
    pub columns: &'a [Column],
    pub rows: &'a [u32],
    pub groups: &'a [Group],
    pub targets: &'a [u32],
    pub blocks: &'a [u32],
    pub input_rows: &'a [u32],
    pub cols: &'a [u32],
    /// in the layout, source, sign
    pub stamps: &'a [(u32, u32, f64)],
    /// places of the layout where the matrix has an entry
    pub filled: &'a [bool],
}

/// A program and its scratch.
pub struct Program {
    tape: Tape,
    slots: Vec<f64>,
}

impl Program {
    /// Base (x), sources (waves) and right hand side (flags) to the factors, and the solution behind them. None where there is
    /// no machine code.
    pub(super) fn factor_and_solve(layout: &Layout) -> Option<Program> {
        let (mut p, constants) = Written::new(&[0.0, 1.0]);
        let (zero, one) = (constants[0], constants[1]);
        let leaf = |p: &mut Written, (k, &filled): (usize, &bool)| if filled { p.leaf(Leaf::X(k)) } else { zero };
        let mut lu: Vec<Value> = layout.filled.iter().enumerate().map(|entry| leaf(&mut p, entry)).collect();
        for &(place, source, sign) in layout.stamps {
            let (entry, source) = (&mut lu[place as usize], p.leaf(Leaf::Wave(source as usize)));
            *entry = if sign > 0.0 { p.add(*entry, source) } else { p.sub(*entry, source) };
        }
        let (mut group, mut target) = (0, 0);
        for c in layout.columns {
            for g in &layout.groups[group..c.group_end as usize] {
                for k in 0..g.len as usize {
                    let product = p.mul(lu[g.l as usize + k], lu[g.u as usize]);
                    let entry = &mut lu[layout.targets[target + k] as usize];
                    *entry = p.sub(*entry, product);
                }
                target += g.len as usize;
            }
            group = c.group_end as usize;
            let inverse = p.div(one, lu[c.diagonal as usize]);
            lu[c.diagonal as usize] = inverse;
            for l in &mut lu[c.diagonal as usize + 1..c.end as usize] {
                *l = p.mul(*l, inverse);
            }
        }
        let x = layout.solution(&mut p, &lu);
        lu.extend(x);
        Program::of(p, &lu)
    }

    /// Factors (x) and right hand side (flags) to the solution.
    pub(super) fn solve(layout: &Layout) -> Option<Program> {
        let (mut p, _) = Written::new(&[]);
        let lu: Vec<Value> = (0..layout.rows.len()).map(|k| p.leaf(Leaf::X(k))).collect();
        let x = layout.solution(&mut p, &lu);
        Program::of(p, &x)
    }

    fn of(p: Written, results: &[Value]) -> Option<Program> {
        let tape = p.native(results)?;
        let slots = tape.workspace();
        Some(Program { tape, slots })
    }

    pub fn run(&mut self, x: &[f64], sources: &[f64], b: &[f64], out: &mut [f64]) {
        self.tape.run_into(0, &Inputs { x, t: 0.0, waves: sources, flags: b }, &mut self.slots, out);
    }
}

impl Layout<'_> {
    /// The solution for the right hand side in the flags, in the caller's order.
    fn solution(&self, p: &mut Written, lu: &[Value]) -> Vec<Value> {
        let mut w: Vec<Value> = self.input_rows.iter().map(|&row| p.leaf(Leaf::Flag(row as usize))).collect();
        for block in self.blocks.windows(2).rev() {
            let own = block[0] as usize..block[1] as usize;
            for k in own.clone() {
                let c = &self.columns[k];
                self.subtract(p, lu, &mut w, k, c.diagonal as usize + 1..c.end as usize);
            }
            for k in own.rev() {
                let c = &self.columns[k];
                w[k] = p.mul(w[k], lu[c.diagonal as usize]);
                self.subtract(p, lu, &mut w, k, c.first as usize..c.diagonal as usize);
            }
        }
        let mut x = w.clone();
        for (&col, value) in self.cols.iter().zip(w) {
            x[col as usize] = value;
        }
        x
    }

    fn subtract(&self, p: &mut Written, lu: &[Value], w: &mut [Value], k: usize, entries: std::ops::Range<usize>) {
        for e in entries {
            let product = p.mul(lu[e], w[k]);
            let at = &mut w[self.rows[e] as usize];
            *at = p.sub(*at, product);
        }
    }
}

/// A program, and when it pays.
pub struct Recurring {
    from: u64, // count at which the present pivots were chosen
    worth: u64,
    pub program: Option<Program>,
}

impl Default for Recurring {
    fn default() -> Recurring {
        Recurring { from: 0, worth: WORTH, program: None }
    }
}

impl Recurring {
    pub fn start(&mut self, count: u64) {
        (self.from, self.program) = (count, None);
    }

    /// Is the program to be written now? The next one has to be worth twice as much: pivots that change often are not followed.
    pub fn is_due(&mut self, count: u64) -> bool {
        let due = self.program.is_none() && count - self.from >= self.worth;
        if due {
            self.worth *= 2;
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Lu, Pattern, Stamp, Symbolic};

    /// What has recurred often enough gives what the lists gave before, to the bit.
    #[test]
    fn every_bit_is_kept() {
        let number = |k: usize| ((k * 37 + 11) % 19) as f64 / 19.0 - 0.4;
        for n in [2, 5, 9, 17] {
            let entries = (0..n).flat_map(|i| [(i, i), (i, (3 * i + 1) % n), ((5 * i + 2) % n, i)]);
            let pattern = Pattern::from_entries(n, &entries.collect::<Vec<_>>());
            let mut lu: Lu<f64> = Lu::new(&pattern, &Symbolic::analyse(&pattern).unwrap());
            let at = |i: usize| pattern.position(i, i).unwrap();
            let stamp = |(i, source, sign)| Stamp { slot: at(i) as u32, source, sign };
            lu.set_stamps(&[(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0)].map(stamp));
            let mut base: Vec<f64> = (0..pattern.nnz()).map(number).collect();
            (0..n).for_each(|i| base[at(i)] = 8.0 + number(i)); // the pivots stay
            lu.set_base(&base);
            let b: Vec<f64> = (0..n).map(|i| number(7 * i + 3)).collect();
            let mut first = Vec::new();
            for round in 0..1000 {
                let (mut x, mut y) = (b.clone(), b.clone());
                lu.factor_and_solve(&[number(round % 10), number(round % 10 + 20)], &mut x).unwrap();
                lu.solve(&mut y);
                if round < 10 {
                    first.push(x.clone());
                }
                assert_eq!((&x, &y), (&first[round % 10], &first[round % 10]), "n {n}, round {round}");
            }
            assert_eq!(lu.counters().factors, 1);
            assert!(cfg!(not(target_arch = "x86_64")) || lu.has_programs());
        }
    }
}
