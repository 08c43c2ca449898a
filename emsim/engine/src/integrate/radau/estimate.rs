//! The error estimate of a step:  e = (gamma/h C + G)^-1 ( -F(x0) + 1/h sum_i d_i D_i ), measured on what stands under d/dt; filtered
//! once more where it is of something stiff, whatever the step; and told from rounding.
use super::{Radau, MOST_RELAXED};
use crate::newton::Tolerances;
use crate::system::{System, Work};

/// What the filter leaves of an estimate that is of nothing stiff. (At 0.3 the corners of a diode clipper passed for
/// rounding, and its error stayed at 1e-5 of the range from a tolerance of 1e-5 to one of 1e-9.)
const NOT_STIFF: f64 = 0.6;
/// An estimate that is still there at this share of the step does not fall with it.
const STAYS: f64 = 0.1;

/// Error estimate that a step may have, in units of the asked tolerance. The estimate is O(h^(s+1)), what the user sees
/// at least O(h^(s+2)): the tighter the tolerance, the more it overrates. The power and the share at 1e-3 keep the global
/// error of the exact problems below ten times the tolerance, of most below the tolerance, at every order.
pub fn share(reltol: f64) -> f64 {
    const AT_1E3: f64 = 0.05;
    AT_1E3 * (reltol / 1e-3).min(1.0).powf(-0.25)
}

/// Largest |e_i| in units of the tolerance, over what stands under d/dt.
fn norm(e: &[f64], x0: &[f64], x1: &[f64], tol: &Tolerances) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..e.len() {
        if tol.in_error[i] {
            let r = e[i].abs() / tol.weight(i, x0[i], x1[i]);
            worst = if r.is_finite() { worst.max(r) } else { f64::INFINITY };
        }
    }
    worst
}

impl Radau {
    /// Where steps have become a thirtieth of what they were, a step of a quarter is tried: an estimate that does not
    /// fall with it, and is not of something stiff, is rounding, and the tolerance gives way to it. True: try the quarter.
    pub(super) fn rounding(&mut self, h: f64, estimate: f64, error: f64) -> bool {
        let whole = self.unfiltered;
        if let Some((before, larger)) = self.probe.take() {
            let stiff = estimate < NOT_STIFF * whole;
            if h < 0.3 * before && whole > 0.3 * larger && !stiff && error.is_finite() {
                self.relax = (10.0 * error).max(2.0 * self.relax).min(MOST_RELAXED);
            }
            self.longest = 4.0 * before;
            return false;
        }
        let probe = error > 0.02 && error.is_finite() && h < 0.03 * self.longest;
        if probe {
            self.probe = Some((h, whole));
        }
        probe
    }

    /// The error estimate in units of the tolerance.
    pub(super) fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let s = self.scheme.s;
        self.b.fill(0.0);
        for (weight, d) in self.scheme.d.iter().zip(&self.d) {
            for (b, d) in self.b.iter_mut().zip(d) {
                *b += weight / h * d;
            }
        }
        for i in 0..sys.n {
            self.e[i] = if sys.has_q[i] { self.b[i] - self.f0[i] } else { 0.0 };
        }
        self.real.solve(&mut self.e);
        w.counters.solves += 1;
        let mut error = norm(&self.e, &self.x0, &self.stage[s - 1], tol);
        self.unfiltered = error;
        // an estimate of the corner that a diode makes falls as the step leaves it out: it is not filtered at once
        let diodes = sys.diodes() > 0;
        let stays = |(first_h, first): (f64, f64)| !diodes || (h < STAYS * first_h && error > 0.5 * first);
        let large = error >= share(tol.reltol) && (self.first || self.at_first.is_some_and(stays));
        if (large || (diodes && self.probe.is_some())) && error.is_finite() {
            // filtered once more: right after a start the estimate of a stiff component is far too large
            for i in 0..sys.n {
                self.scratch[i] = self.x0[i] + self.e[i];
            }
            sys.eval(w, &self.scratch, self.t0);
            for i in 0..sys.n {
                self.scratch[i] = if sys.has_q[i] { self.b[i] - w.f[i] } else { 0.0 };
            }
            self.real.solve(&mut self.scratch);
            error = norm(&self.scratch, &self.x0, &self.stage[s - 1], tol);
        }
        if !diodes {
            self.unfiltered = error;
        }
        error
    }

    /// What the estimate of the next lower order would have been.
    pub(super) fn lower_error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let (weights, scale) = self.orders.lower(self.scheme);
        self.scratch.fill(0.0);
        for (weight, d) in weights.iter().zip(&self.d) {
            for (e, d) in self.scratch.iter_mut().zip(d) {
                *e += scale * weight / h * d;
            }
        }
        for i in 0..sys.n {
            self.scratch[i] = if sys.has_q[i] { self.scratch[i] - scale * self.f0[i] } else { 0.0 };
        }
        self.real.solve(&mut self.scratch);
        w.counters.solves += 1;
        norm(&self.scratch, &self.x0, &self.stage[self.scheme.s - 1], tol)
    }
}
