//! Factors and solution by a program (program.rs) that begins with the equations themselves.

use super::super::program::{Equations, Program, Purpose, LARGEST};
use super::{Lu, Scalar};
use crate::tape::Inputs;
use crate::twice::twice;

impl Lu<f64> {
    /// Factors and solves `equations` as one program, with the pivots of the last `factor`: b <- A^-1 b of what its leaves read.
    /// False, and b as it was, where no program is due yet, or the pivots do not serve.
    pub fn factor_and_solve_by_program(
        &mut self,
        equations: impl FnOnce() -> Equations,
        inputs: &Inputs,
        b: &mut [f64],
    ) -> bool {
        if self.operations > LARGEST {
            return false;
        }
        let (shelf, pivots, purpose) = (&self.symbolic.shelf, &self.pivot_rows, Purpose::FactorAndSolve);
        if self.factor_and_solve.is_due(self.counters.refactors, || shelf.find(purpose, pivots)) {
            self.factor_and_solve.program = Program::factor_and_solve(&self.layout(), equations());
            self.shelve(purpose, self.factor_and_solve.program.as_ref());
        }
        let Some(program) = &mut self.factor_and_solve.program else { return false };
        program.run(inputs, &mut self.lu);
        let (lu, x) = self.lu.split_at(self.rows.len());
        self.ready = outside(lu, &self.limits, &self.least) == 0;
        if self.ready {
            b.copy_from_slice(x);
            self.counters.refactors += 1;
            self.counters.solves += 1;
        }
        self.ready
    }
}

impl<T: Scalar> Lu<T> {
    pub(super) fn shelve(&self, purpose: Purpose, program: Option<&Program>) {
        if let Some(program) = program {
            self.symbolic.shelf.keep(purpose, &self.pivot_rows, program);
        }
    }
}

twice! {
    /// How many values are larger in size than their limits, no larger than their least, or no numbers?
    fn outside(values: &[f64], limits: &[f64], least: &[f64]) -> u64 {
        let each = values.iter().zip(limits.iter().zip(least));
        each.map(|(v, (limit, least))| u64::from(!(v.abs() <= *limit && v.abs() > *least))).sum()
    }
}
