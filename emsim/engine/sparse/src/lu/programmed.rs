//! Factors and solutions by programs (program.rs), and both by one that begins with the equations themselves.

use super::super::program::{Equations, Key, Layout, Program, Purpose, Recurring, LARGEST};
use super::super::scalar::Term;
use super::{Lu, Scalar};
use emsim_expr::tape::Inputs;

impl Lu<f64> {
    /// Factors and solves `equations` as one program, with the pivots of the last `factor`: b <- A^-1 b of what its leaves read.
    /// False, and b as it was, where no program is due yet, or the pivots do not serve.
    #[inline(always)]
    pub fn factor_and_solve_by_program(
        &mut self,
        equations: impl FnOnce() -> Equations,
        inputs: &Inputs,
        b: &mut [f64],
    ) -> bool {
        let (count, bare) = (self.counters.refactors, self.bare && self.certain);
        let purpose = if bare { Purpose::SolveAnew } else { Purpose::FactorAndSolve };
        let write = |layout: &Layout| Program::factor_and_solve(layout, equations(), !bare);
        if !self.is_written(purpose, |lu| &mut lu.factor_and_solve, count, write) {
            return false;
        }
        let Some(program) = &mut self.factor_and_solve.program else { return false };
        let serves = if bare {
            self.ready = false;
            program.run(inputs, b);
            true
        } else {
            program.run(inputs, &mut self.lu);
            let (lu, x) = self.lu.split_at(self.arranged.rows.len());
            self.ready = self.certain || f64::outside(lu, &self.limits, &self.least) == 0;
            if self.ready {
                b.copy_from_slice(x);
            }
            self.ready
        };
        self.counters.refactors += u64::from(serves);
        self.counters.solves += u64::from(serves);
        serves
    }
}

impl<T: Scalar> Lu<T> {
    /// The same factors by a program. False where none is due yet, or the pivots do not serve.
    pub(super) fn refactor_by_program(&mut self, values: &[T]) -> bool {
        let count = self.counters.refactors;
        if self.factor_alone.program.is_none()
            && !self.is_written(Purpose::Factor, |lu| &mut lu.factor_alone, count, Program::factor::<T>)
        {
            return false;
        }
        let Some(program) = &mut self.factor_alone.program else { return false };
        let lu = &mut self.lu[..self.arranged.rows.len()];
        program.run(&Inputs { x: T::parts(values), t: 0.0, waves: &[], flags: &[] }, T::parts_mut(lu));
        T::outside(lu, &self.limits, &self.least) == 0
    }

    /// b <- A^-1 b by a program. False, and b as it was, where none is due yet.
    pub(super) fn solve_by_program(&mut self, b: &mut [T]) -> bool {
        let count = self.counters.solves;
        if self.solve_alone.program.is_none()
            && !self.is_written(Purpose::Solve, |lu| &mut lu.solve_alone, count, Program::solve::<T>)
        {
            return false;
        }
        let Some(program) = &mut self.solve_alone.program else { return false };
        let lu = T::parts(&self.lu[..self.arranged.rows.len()]);
        program.run(&Inputs { x: lu, t: 0.0, waves: &[], flags: T::parts(b) }, T::parts_mut(&mut self.work));
        b.copy_from_slice(&self.work);
        true
    }

    /// Is there a program, now that it has been asked for?
    #[cold]
    #[inline(never)]
    fn is_written(
        &mut self,
        purpose: Purpose,
        mut which: impl FnMut(&mut Self) -> &mut Recurring,
        count: u64,
        write: impl FnOnce(&Layout) -> Option<Program>,
    ) -> bool {
        if self.whole.is_loose()
            || self.arranged.columns.is_empty()
            || self.arranged.operations * T::Term::PARTS * T::Term::PARTS > LARGEST
        {
            return false;
        }
        let key: Key = (purpose, T::Term::PARTS);
        let mut recurring = std::mem::take(which(self));
        let (shelf, pivots) = (&self.symbolic.shelf, &self.arranged.pivot_rows);
        if recurring.is_due(count, || shelf.find(key, pivots)) {
            recurring.program = write(&self.layout());
            if let Some(program) = &recurring.program {
                shelf.keep(key, pivots, program);
            }
        }
        let written = recurring.program.is_some();
        *which(self) = recurring;
        written
    }
}
