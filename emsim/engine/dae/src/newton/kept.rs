//! Factors that linear circuits come back to, and those that serve a solution beside their own.
use super::{not_finite, Failure, Newton, STALLS};
use crate::rounding::SUMMED;
use crate::system::{System, Work};
use crate::tolerances::Tolerances;

impl Newton {
    /// `a` of a step of length h that ends at t; that of factors which are kept, where it differs by no more than h is rounded, as the
    /// difference of two times. Not where fewer than half of the digits of h are left.
    pub fn recurring(&self, a: f64, t: f64, h: f64) -> f64 {
        let rounded = SUMMED * t.abs() / h;
        let same = |kept: &f64| (kept - a).abs() <= rounded * a;
        self.lu.kept().find(same).filter(|_| rounded < f64::EPSILON.sqrt()).unwrap_or(a)
    }

    /// One more iteration with the factors of the last one, which is nearly as good from a solution or beside one. What exponentials
    /// bend is solved anew.
    pub fn again(
        &mut self,
        sys: &System,
        w: &mut Work,
        (a, r): (f64, &[f64]),
        x: &mut [f64],
        t: f64,
        tol: &Tolerances,
    ) -> Result<(), Failure> {
        if sys.exponentials() > 0 || !self.lu.is_ready() {
            return self.solve(sys, w, a, r, x, t, tol, STALLS).map(|_| ());
        }
        sys.eval(w, x, t);
        let step = &mut self.step[..self.n];
        for (i, step) in step.iter_mut().enumerate() {
            *step = -(w.f[i] + a * w.q[i] + r[i]);
        }
        self.lu.solve(step);
        w.counters.solves += 1;
        x.iter_mut().zip(&*step).for_each(|(x, step)| *x += step);
        if x.iter().all(|v| v.is_finite()) {
            Ok(())
        } else {
            Err(not_finite(x))
        }
    }
}
