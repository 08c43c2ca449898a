//! Factors that linear circuits come back to.
use super::Newton;
use crate::rounding::SUMMED;

impl Newton {
    /// `a` of a step of length h that ends at t; that of factors which are kept, where it differs by no more than h is rounded, as the
    /// difference of two times. Not where fewer than half of the digits of h are left.
    pub fn recurring(&self, a: f64, t: f64, h: f64) -> f64 {
        let rounded = SUMMED * t.abs() / h;
        let same = |kept: &f64| (kept - a).abs() <= rounded * a;
        self.lu.kept().find(same).filter(|_| rounded < f64::EPSILON.sqrt()).unwrap_or(a)
    }
}
