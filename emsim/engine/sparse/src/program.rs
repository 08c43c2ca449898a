//! Factors and solutions of a small matrix as straight-line code: the operations of lu.rs in the same order and with the same
//! rounding, without the lists that say where they take place. A circuit of four diodes is factored and solved in a quarter of
//! the instructions. What matrix and right-hand side are made of may stand before them in the same program (`Equations`).
use super::lu::Arrangement;
use super::pivots::Pivots;
use super::scalar::{Scalar, Term};
use super::Symbolic;
use emsim_expr::tape::{Code, Inputs, Leaf, Tape, Value, Written};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What has recurred so often with the same pivots is written as a program: writing it costs about as much as so many runs save.
const WORTH: u64 = 150;
/// Cranelift takes so many times as long to write it. (Unit tests of this crate do not wait for it.)
const CRANELIFT: u64 = if cfg!(test) { 1 } else { 100 };
/// Multiply-subtract operations of a refactorisation above which a program would not stay in the processor's cache.
pub const LARGEST: usize = 1000;

/// The layout of a factorisation and the order of its operations.
pub(super) struct Layout<'a> {
    pub symbolic: &'a Symbolic,
    pub arranged: &'a Arrangement,
}

/// Linear equations that a program begins with: the matrix on its pattern and the right-hand side.
pub struct Equations {
    pub program: Written,
    pub zero: Value,
    pub one: Value,
    pub matrix: Vec<Value>,
    pub b: Vec<Value>,
}

/// A program and its scratch.
pub struct Program {
    tape: Arc<Tape>,
    slots: Vec<f64>,
}

/// Where factors of these equations lie, and what has been written for them, by their pivots: the next factors that choose them,
/// of another method in the run or in another run, begin with it. Pivots that are chosen time and again recur too, however short
/// the runs. Not for those that nobody chooses again.
#[derive(Default)]
pub(super) struct Shelf {
    programs: Mutex<Vec<Kept>>,
    arrangements: Mutex<Vec<Arc<Arrangement>>>,
}

struct Kept {
    key: Key,
    pivots: Vec<u32>,
    chosen: u32,
    tape: Option<Arc<Tape>>,
}

/// What a program is for, and of how many parts its numbers are.
pub type Key = (Purpose, usize);

#[derive(Clone, Copy, PartialEq)]
pub enum Purpose {
    FactorAndSolve,
    SolveAnew,
    Factor,
    Solve,
}

/// What is known of a program before it is written.
pub enum Known {
    Written(Program),
    Often, // it has been asked for by so many that it pays
    Not,
}

pub(super) const KEPT: usize = 64; // layouts and programs that a process keeps; the oldest goes
/// Layouts of more operations are not kept: what it takes to find their pivots is many times what they take.
const LARGE: usize = 20_000;
const OFTEN: u32 = 4;

impl Shelf {
    /// The layout of factors for these pivots, if it has been made before, or a new one.
    pub fn arranged(&self, pivots: &Pivots, make: impl FnOnce() -> Arrangement) -> Arc<Arrangement> {
        let mut kept = self.arrangements.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept.iter().find(|a| a.pivot_rows == pivots.row) {
            return known.clone();
        }
        let new = Arc::new(make());
        if new.operations <= LARGE {
            if kept.len() == KEPT {
                kept.remove(0);
            }
            kept.push(new.clone());
        }
        new
    }

    pub fn find(&self, key: Key, pivots: &[u32]) -> Known {
        let mut kept = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(k) = kept.iter_mut().find(|k| k.key == key && k.pivots == pivots) else {
            if kept.len() == KEPT {
                kept.remove(0);
            }
            kept.push(Kept { key, pivots: pivots.to_vec(), chosen: 1, tape: None });
            return Known::Not;
        };
        k.chosen = k.chosen.saturating_add(1);
        match &k.tape {
            Some(tape) => Known::Written(Program::again(tape.clone())),
            None if k.chosen >= OFTEN => Known::Often,
            None => Known::Not,
        }
    }

    pub fn keep(&self, key: Key, pivots: &[u32], program: &Program) {
        let mut kept = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(k) = kept.iter_mut().find(|k| k.key == key && k.pivots == pivots) {
            k.tape = Some(program.tape.clone());
        }
    }
}

impl Program {
    /// The equations to their factors if those are `kept`, and the solution behind them. None where there is no machine code.
    pub(super) fn factor_and_solve(layout: &Layout, equations: Equations, kept: bool) -> Option<Program> {
        let Equations { program: mut p, zero, one, matrix, b } = equations;
        let mut lu = vec![zero; layout.arranged.rows.len()];
        for (&place, value) in layout.arranged.place.iter().zip(matrix) {
            lu[place as usize] = value;
        }
        layout.factor(&mut p, one, &mut lu);
        let x = layout.solution(&mut p, &lu, &b);
        if !kept {
            return Program::of(p, &x);
        }
        lu.extend(x);
        Program::of(p, &lu)
    }

    /// Values of the matrix (x) to its factors.
    pub(super) fn factor<T: Scalar>(layout: &Layout) -> Option<Program> {
        let (mut p, constants) = Written::new(&[0.0, 1.0]);
        let zero = T::Term::of(|_| constants[0]);
        let mut lu = vec![zero; layout.arranged.rows.len()];
        for (k, &place) in layout.arranged.place.iter().enumerate() {
            lu[place as usize] = leaf::<T>(&mut p, Leaf::X, k);
        }
        layout.factor(&mut p, constants[1], &mut lu);
        Program::of(p, &lu)
    }

    /// Factors (x) and right hand side (flags) to the solution.
    pub(super) fn solve<T: Scalar>(layout: &Layout) -> Option<Program> {
        let (mut p, _) = Written::new(&[]);
        let lu: Vec<_> = (0..layout.arranged.rows.len()).map(|k| leaf::<T>(&mut p, Leaf::X, k)).collect();
        let b: Vec<_> = (0..layout.symbolic.cols.len()).map(|k| leaf::<T>(&mut p, Leaf::Flag, k)).collect();
        let x = layout.solution(&mut p, &lu, &b);
        Program::of(p, &x)
    }

    fn of(p: Written, results: &[impl Term]) -> Option<Program> {
        let parts: Vec<Value> = results.iter().flat_map(|v| v.parts().iter().copied()).collect();
        p.native(&parts).map(|tape| Program::again(Arc::new(tape)))
    }

    /// With scratch of its own.
    pub fn again(tape: Arc<Tape>) -> Program {
        let slots = tape.workspace();
        Program { tape, slots }
    }

    #[inline(always)]
    pub fn run(&mut self, inputs: &Inputs, out: &mut [f64]) {
        self.tape.run_into(0, inputs, &mut self.slots, out);
    }
}

/// Number k of a row of them.
fn leaf<T: Scalar>(p: &mut Written, of: fn(usize) -> Leaf, k: usize) -> T::Term {
    T::Term::of(|part| p.leaf(of(T::Term::PARTS * k + part)))
}

impl Layout<'_> {
    /// The matrix to its factors, in place.
    fn factor<N: Term>(&self, p: &mut Written, one: Value, lu: &mut [N]) {
        let (mut group, mut target) = (0, 0);
        for c in &self.arranged.columns {
            for g in &self.arranged.groups[group..c.group_end as usize] {
                for k in 0..g.len as usize {
                    let product = lu[g.l as usize + k].mul(lu[g.u as usize], p);
                    let entry = &mut lu[self.arranged.targets[target + k] as usize];
                    *entry = entry.sub(product, p);
                }
                target += g.len as usize;
            }
            group = c.group_end as usize;
            let inverse = lu[c.diagonal as usize].recip(one, p);
            lu[c.diagonal as usize] = inverse;
            for l in &mut lu[c.diagonal as usize + 1..c.end as usize] {
                *l = l.mul(inverse, p);
            }
        }
    }

    /// The solution for the right-hand side b, in the caller's order.
    fn solution<N: Term>(&self, p: &mut Written, lu: &[N], b: &[N]) -> Vec<N> {
        let mut w: Vec<N> = self.arranged.input_rows.iter().map(|&row| b[row as usize]).collect();
        for block in self.symbolic.blocks.windows(2).rev() {
            let own = block[0] as usize..block[1] as usize;
            for k in own.clone() {
                let c = &self.arranged.columns[k];
                self.subtract(p, lu, &mut w, k, c.diagonal as usize + 1..c.end as usize);
            }
            for k in own.rev() {
                let c = &self.arranged.columns[k];
                w[k] = w[k].mul(lu[c.diagonal as usize], p);
                self.subtract(p, lu, &mut w, k, c.first as usize..c.diagonal as usize);
            }
        }
        let mut x = w.clone();
        for (&col, value) in self.symbolic.cols.iter().zip(w) {
            x[col as usize] = value;
        }
        x
    }

    fn subtract<N: Term>(&self, p: &mut Written, lu: &[N], w: &mut [N], k: usize, entries: std::ops::Range<usize>) {
        for e in entries {
            let product = lu[e].mul(w[k], p);
            let at = &mut w[self.arranged.rows[e] as usize];
            *at = at.sub(product, p);
        }
    }
}

/// A program of the equations as they are, once it has been written: for all runs.
#[derive(Default)]
pub struct Once {
    tape: OnceLock<Option<Arc<Tape>>>,
    asked: AtomicU32,
}

impl Once {
    fn find(&self) -> Known {
        match self.tape.get() {
            Some(Some(tape)) => Known::Written(Program::again(tape.clone())),
            Some(None) => Known::Not,
            None if self.asked.fetch_add(1, Relaxed) + 1 >= OFTEN => Known::Often,
            None => Known::Not,
        }
    }
}

/// A program, and when it pays.
pub struct Recurring {
    from: u64, // count at which the present pivots were chosen
    worth: u64,
    asked: bool, // whether it has been written before
    pub program: Option<Program>,
}

impl Default for Recurring {
    fn default() -> Recurring {
        Recurring { from: 0, worth: worth(), asked: false, program: None }
    }
}

/// So often a thing recurs before it is written as a program.
pub fn worth() -> u64 {
    if Code::chosen() == Ok(Code::Cranelift) {
        CRANELIFT * WORTH
    } else {
        WORTH
    }
}

impl Recurring {
    pub fn start(&mut self, count: u64) {
        (self.from, self.asked, self.program) = (count, false, None);
    }

    /// Is the program to be written now? One that was `known` before serves from the start; of new ones the next has to be worth
    /// twice as much: pivots that change often are not followed.
    #[cold]
    #[inline(never)]
    pub fn is_due(&mut self, count: u64, known: impl FnOnce() -> Known) -> bool {
        if self.program.is_none() && !std::mem::replace(&mut self.asked, true) {
            match known() {
                Known::Written(program) => self.program = Some(program),
                Known::Often => return true,
                Known::Not => {}
            }
        }
        let due = self.program.is_none() && count - self.from >= self.worth;
        if due {
            self.worth *= 2;
        }
        due
    }

    /// The program that `once` holds, or is to hold.
    #[inline(always)]
    pub fn shared(&mut self, count: u64, once: &Once, write: impl FnOnce() -> Option<Tape>) -> Option<&mut Program> {
        if self.program.is_none() && self.is_due(count, || once.find()) {
            let tape = once.tape.get_or_init(|| write().map(Arc::new));
            self.program = tape.clone().map(Program::again);
        }
        self.program.as_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Complex, Lu, Pattern, Scalar, Symbolic};
    use super::Equations;
    use emsim_expr::tape::{Code, Inputs, Leaf, Written};

    /// What has recurred often enough gives what the lists give, to the bit.
    #[test]
    fn every_bit_is_kept() {
        recurs(false, false);
        recurs(true, false);
        recurs(true, true);
    }

    /// With pivots that need no look, and with solutions that leave no factors.
    fn recurs(dominant: bool, bare: bool) {
        let number = |k: usize| ((k * 37 + 11) % 19) as f64 / 19.0 - 0.4;
        for n in [2, 5, 9, 17] {
            let entries = (0..n).flat_map(|i| [(i, i), (i, (3 * i + 1) % n), ((5 * i + 2) % n, i)]);
            let pattern = Pattern::from_entries(n, &entries.collect::<Vec<_>>());
            let symbolic = Symbolic::analyse(&pattern).unwrap();
            let make = || {
                let mut lu: Lu<f64> = Lu::new(&symbolic);
                if dominant {
                    lu.set_dominant(vec![true; n]);
                }
                if bare {
                    lu.set_bare();
                }
                lu
            };
            let mut lu = make();
            let nnz = pattern.nnz();
            let mut values: Vec<f64> = (0..nnz).map(number).collect();
            let own: Vec<usize> = (0..n).map(|i| pattern.position(i, i).unwrap()).collect();
            own.iter().for_each(|&k| values[k] = 8.0 + number(k)); // the pivots stay
            let b: Vec<f64> = (0..n).map(|i| number(7 * i + 3)).collect();
            let equations = || {
                let (mut program, constants) = Written::new(&[0.0, 1.0]);
                let matrix = (0..nnz).map(|k| program.leaf(Leaf::X(k))).collect();
                let b = (0..n).map(|k| program.leaf(Leaf::Flag(k))).collect();
                Equations { program, zero: constants[0], one: constants[1], matrix, b }
            };
            let mut runs = 0;
            for round in 0..1000 {
                own.iter().for_each(|&k| values[k] = 8.0 + number(k + round));
                let (mut x, mut y, mut z) = (b.clone(), b.clone(), b.clone());
                let inputs = Inputs { x: &values, t: 0.0, waves: &[], flags: &b };
                let run = lu.factor_and_solve_by_program(equations, &inputs, &mut x);
                runs += u32::from(run);
                assert!(!run || lu.is_ready() != bare);
                if run && !bare {
                    lu.solve(&mut z);
                }
                lu.factor_or_refactor(&values).unwrap();
                lu.solve(&mut y);
                assert!(!run || (x == y && (bare || z == y)), "n {n}, round {round}");
            }
            assert_eq!(lu.counters().factors, 1);
            // the next factors of the same pattern and pivots begin with the program
            let mut next = make();
            next.factor_or_refactor(&values).unwrap();
            let (mut x, mut y) = (b.clone(), b.clone());
            let run = next.factor_and_solve_by_program(
                equations,
                &Inputs { x: &values, t: 0.0, waves: &[], flags: &b },
                &mut x,
            );
            next.factor_or_refactor(&values).unwrap();
            next.solve(&mut y);
            assert!(run == lu.has_program() && (!run || x == y), "n {n}");
            assert!(Code::chosen() == Ok(Code::Interpreted) || (runs > 500 && lu.has_program()));
        }
    }

    /// ... and factors and solutions by themselves, of numbers of any kind.
    fn keeps_every_bit<T: Scalar>(number: impl Fn(usize) -> T) {
        for n in [3, 9, 17] {
            let entries = (0..n).flat_map(|i| [(i, i), (i, (3 * i + 1) % n), ((5 * i + 2) % n, i)]);
            let pattern = Pattern::from_entries(n, &entries.collect::<Vec<_>>());
            let (symbolic, fresh) = (Symbolic::analyse(&pattern).unwrap(), Symbolic::analyse(&pattern).unwrap());
            let own: Vec<usize> = (0..n).map(|i| pattern.position(i, i).unwrap()).collect();
            let b: Vec<T> = (0..n).map(|i| number(7 * i + 3)).collect();
            let mut values: Vec<T> = (0..pattern.nnz()).map(&number).collect();
            let run = |symbolic: &Symbolic, values: &[&Vec<T>]| {
                let mut lu: Lu<T> = Lu::new(symbolic);
                let each = values.iter().map(|v| {
                    lu.factor_or_refactor(v).unwrap();
                    let mut x = b.clone();
                    lu.solve(&mut x);
                    x
                });
                let solutions: Vec<Vec<T>> = each.collect();
                (solutions, lu.factor_alone_has_program(), lu.counters().factors)
            };
            own.iter().for_each(|&k| values[k] = T::from_real(8.0) * (T::ONE + number(k)));
            let mut other = values.clone();
            own.iter().for_each(|&k| other[k] += number(k + 5));
            let recurring: Vec<&Vec<T>> = (0..400).map(|k| if k % 2 == 0 { &values } else { &other }).collect();
            let (known, written, chosen) = run(&symbolic, &recurring);
            assert!(written && chosen == 1 && known.iter().skip(2).zip(&known).all(|(x, y)| x == y));
            // short runs come to it too
            let short = &recurring[..2];
            let runs: Vec<_> = (0..6).map(|_| run(&fresh, short)).collect();
            assert!(!runs[0].1 && runs[5].1 && runs.iter().all(|r| r.0[..] == known[..2]));
        }
    }

    #[test]
    fn factors_and_solutions_by_themselves() {
        if Code::chosen() != Ok(Code::Interpreted) {
            let real = |k: usize| ((k * 37 + 11) % 19) as f64 / 19.0 - 0.4;
            keeps_every_bit(real);
            keeps_every_bit(|k| Complex::new(real(k), 0.7 * real(k + 3)));
            keeps_every_bit(|k| Complex::new(0.3 * real(k), real(k + 3)));
            keeps_every_bit(|k| Complex::new(0.0, real(k + 3) - 1.0));
        }
    }
}
