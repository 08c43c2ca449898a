//! The error estimate of a step:  e = (gamma/h C + G)^-1 ( -F(x0) + 1/h sum_i d_i D_i ), measured on what stands under d/dt; filtered
//! once more where it is of something stiff, whatever the step; and told from rounding.
//!
//! At the end of a step in which a diode turned, another one beside it. Of the corner that the diode makes in Q that estimate
//! is a difference over the step, which vanishes for some places of the corner, while dQ/dt at the end is wrong by as much
//! as it bends. What follows at once there has  C x'' + G x' + F_t = 0,  M = gamma/h C + G, and with the slope x_p' of the
//! collocation polynomial, and its Q_p'' from the stages' F, is wrong by
//!
//!   e = M^-1 C (x' - x_p'),   x' - x_p' = M^-1 ( -d/dt F(x_p, t) - Q_p'' ),
//!
//! which is O(h^(s+1)) where nothing bends. It is the error itself and held to the tolerance, not to a share of it.
use super::super::root;
use super::stages::STALLED;
use super::tables::{Scheme, MOST};
use super::Radau;
use crate::newton::Tolerances;
use crate::system::{System, Work};

/// What the filter leaves of an estimate that is of nothing stiff. (At 0.3 the corners of a diode clipper passed for
/// rounding, and its error stayed at 1e-5 of the range from a tolerance of 1e-5 to one of 1e-9.)
const NOT_STIFF: f64 = 0.6;
/// An estimate that is still there at this share of the step does not fall with it.
const STAYS: f64 = 0.1;

/// At most so far is the tolerance relaxed where rounding forbids it.
const MOST_RELAXED: f64 = 200.0;
/// More than this share of a signal is not believed to be rounding. (Where constraints are nearly dependent, at change points of
/// a mechanism, it is 1e-8 and more.) A diode that turns off under a coil's current looks like it at first: steps collapse, and
/// the estimate does not fall with them.
const ROUNDING: f64 = 1e-6;

/// Over so much of the step is F differentiated along the polynomial.
const ALONG: f64 = 1e-4;

/// Error estimate that a step may have, in units of the asked tolerance. The estimate is O(h^(s+1)), what the user sees
/// at least O(h^(s+2)): the tighter the tolerance, the more it overrates. The power and the share at 1e-3 keep the global
/// error of the exact problems below ten times the tolerance, of most below the tolerance, at every order.
pub fn share(reltol: f64) -> f64 {
    const AT_1E3: f64 = 0.05; // measured, see above
    AT_1E3 / root((reltol / 1e-3).min(1.0), 4)
}

/// What may be rounding, in units of the tolerance.
pub fn believed(tol: &Tolerances) -> f64 {
    (ROUNDING / tol.reltol).min(MOST_RELAXED)
}

/// Largest |e_i| in units of the tolerance, over what stands under d/dt.
pub(super) fn norm(e: &[f64], x0: &[f64], x1: &[f64], tol: &Tolerances) -> f64 {
    tol.largest_alone(e, x0, x1).max(tol.largest_tied(|i| e[i], x1, x0))
}

/// The same where the unknowns' rounding adds to the tolerance.
fn above(e: &[f64], x0: &[f64], x1: &[f64], tol: &Tolerances, rounding: impl Fn(usize) -> f64) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..e.len() {
        if let Some(share) = tol.share(i) {
            let r = share * e[i].abs() / (tol.weight(i, x0[i], x1[i]) + rounding(i));
            worst = if r.is_finite() { worst.max(r) } else { f64::INFINITY };
        }
    }
    worst.max(tol.largest_tied(|i| e[i], x1, x0))
}

impl Radau {
    /// Where steps have become a thirtieth of what they were, a step of a quarter is tried: an estimate that does not
    /// fall with it, and is not of something stiff, is rounding, and the tolerance gives way to it. True: try the quarter.
    pub(super) fn rounding(&mut self, h: f64, estimate: f64, error: f64, tol: &Tolerances) -> bool {
        let whole = self.estimate.unfiltered;
        if let Some((before, larger)) = self.estimate.probe.take() {
            let stiff = estimate < NOT_STIFF * whole;
            if h < 0.3 * before && whole > 0.3 * larger && !stiff && error.is_finite() {
                self.estimate.relax = (10.0 * error).max(2.0 * self.estimate.relax).min(believed(tol)).max(1.0);
            }
            self.longest = 4.0 * before;
            return false;
        }
        let probe = error > 0.02 && error.is_finite() && h < 0.03 * self.longest;
        if probe {
            self.estimate.probe = Some((h, whole));
        }
        probe
    }

    /// What rounding does to the unknowns over a step of h, by the real matrix.
    pub(super) fn round(&mut self, sys: &System, w: &mut Work, h: f64) {
        self.estimate
            .noises
            .find(sys, (w, self.scheme.gamma / h), [&self.start.x, &self.start.q], |b| self.matrices.real.solve(b));
        w.counters.solves += 2;
    }

    /// Was the last update of the stages no more than that, where it is more than the tolerance? No iteration gets nearer. The
    /// derivatives at hand are the last stage's.
    pub(super) fn within_rounding(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> bool {
        self.matrices.keep(sys, w);
        if self.matrices.factor(sys, w, h, &self.scheme.eigenvalues()).is_err() {
            return false;
        }
        self.round(sys, w, h);
        let end = &self.points.x[self.scheme.s - 1];
        let within = |i: usize| {
            self.newton.moved[i] <= STALLED * tol.weight(i, self.start.x[i], end[i]) + self.estimate.noises.of[i]
        };
        (0..sys.n).all(|i| !tol.in_norm[i] || within(i))
    }

    /// The error estimate in units of the tolerance.
    pub(super) fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let s = self.scheme.s;
        self.points.b.fill(0.0);
        for (weight, d) in self.scheme.d.iter().zip(&self.points.d) {
            for (b, d) in self.points.b.iter_mut().zip(d) {
                *b += weight / h * d;
            }
        }
        for i in 0..sys.n {
            self.estimate.e[i] = if sys.has_q[i] { self.points.b[i] - self.start.f[i] } else { 0.0 };
        }
        self.matrices.real.solve(&mut self.estimate.e);
        w.counters.solves += 1;
        let mut error = norm(&self.estimate.e, &self.start.x, &self.points.x[s - 1], tol);
        self.estimate.unfiltered = error;
        // an estimate of the corner that a diode makes falls as the step leaves it out: it is not filtered at once
        let devices = sys.devices() > 0;
        let stays = |(first_h, first): (f64, f64)| !sys.turns() || (h < STAYS * first_h && error > 0.5 * first);
        let large = error >= share(tol.reltol) && (self.first || self.estimate.at_first.is_some_and(stays));
        let twice = (large || (devices && self.estimate.probe.is_some())) && error.is_finite();
        if twice {
            // filtered once more: right after a start the estimate of a stiff component is far too large
            for i in 0..sys.n {
                self.scratch[i] = self.start.x[i] + self.estimate.e[i];
            }
            sys.eval(w, &self.scratch, self.start.t);
            for i in 0..sys.n {
                self.scratch[i] = if sys.has_q[i] { self.points.b[i] - w.f[i] } else { 0.0 };
            }
            self.matrices.real.solve(&mut self.scratch);
            error = norm(&self.scratch, &self.start.x, &self.points.x[s - 1], tol);
        }
        if sys.turns() && error >= share(tol.reltol) && error.is_finite() {
            // what rounding is, a shorter step has more of: steps of a diode that turns off are femtoseconds
            self.round(sys, w, h);
            let rounding = |i: usize| self.estimate.noises.of[i] / share(tol.reltol);
            let e = if twice { &self.scratch } else { &self.estimate.e };
            error = above(e, &self.start.x, &self.points.x[s - 1], tol, rounding);
        }
        if !devices {
            self.estimate.unfiltered = error;
        }
        error
    }

    /// Error at the end of a step in which a diode turned, in units of the tolerance; the derivatives are those of the end.
    pub(super) fn end_error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let Scheme { s, c, inverse_a, .. } = *self.scheme;
        let last = s - 1;
        let slopes = &inverse_a[last * s..];
        // slope at 1 of the polynomial through the stages alone
        let nodal = |j: usize| (0..s).filter(|&k| k != j).map(|k| c[j] - c[k]).product::<f64>();
        let weights: [f64; MOST] = std::array::from_fn(|j| match j < last {
            true => nodal(last) / nodal(j) / (1.0 - c[j]),
            false => 0.0,
        });
        let at_end = |of: &[Vec<f64>], i: usize| {
            of.iter().zip(&weights[..last]).map(|(v, weight)| weight * (v[i] - of[last][i])).sum::<f64>()
        };
        for i in 0..sys.n {
            let moved = slopes.iter().zip(&self.points.x).map(|(a, x)| a * (x[i] - self.start.x[i])).sum::<f64>();
            self.scratch[i] = self.points.x[last][i] + ALONG * moved;
        }
        sys.eval(w, &self.scratch, self.start.t + h + ALONG * h);
        for i in 0..sys.n {
            self.scratch[i] = (at_end(&self.points.f[..s], i) - (w.f[i] - self.points.f[last][i]) / ALONG) / h;
        }
        self.matrices.real.solve(&mut self.scratch);
        sys.c_times(w, &self.scratch, &mut self.points.b);
        self.matrices.real.solve(&mut self.points.b);
        w.counters.solves += 2;
        norm(&self.points.b, &self.start.x, &self.points.x[last], tol)
    }

    /// What the estimate of the next lower order would have been, with m = s - 2 stages. The derivative at 0 of a polynomial through the
    /// right values at 0, c_1 .. c_m, read off this order's, misses c_1 .. c_m y^(m+1) h^m / (m+1)!; that of the collocation polynomial,
    /// whose slopes are right at c_1 .. c_m, misses m + 1 times as much.
    pub(super) fn lower_error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let (weights, scale) = self.orders.lower(self.scheme);
        self.scratch.fill(0.0);
        for (weight, d) in weights.iter().zip(&self.points.d) {
            for (e, d) in self.scratch.iter_mut().zip(d) {
                *e += scale * weight / h * d;
            }
        }
        for i in 0..sys.n {
            self.scratch[i] = if sys.has_q[i] { self.scratch[i] - scale * self.start.f[i] } else { 0.0 };
        }
        self.matrices.real.solve(&mut self.scratch);
        w.counters.solves += 1;
        let s = self.scheme.s;
        (s - 1) as f64 * norm(&self.scratch, &self.start.x, &self.points.x[s - 1], tol)
    }
}
