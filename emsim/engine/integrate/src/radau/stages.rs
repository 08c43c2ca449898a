//! The stages of one step by simplified Newton: one real and (s - 1)/2 complex systems of the size of x, after T^-1.
//!
//! Convergence is judged on the update in units of the asked tolerance. What is asked for is a small share of it, so
//! that the iteration's error stays below that of the method at every tolerance: the error must go on falling with the
//! tolerance. Multipliers and algebraic currents follow linearly from the rest and are in no norm: they are held to their own
//! scale, above the rounding of momenta and charges over h, and ask for one more iteration at most.
use super::super::root;
use super::order::CONTRACTION;
use super::state::Points;
use super::{blend, dense, Radau, MOST_ITERATIONS};
use crate::newton::Tolerances;
use crate::rounding::SUMMED;
use crate::system::{System, Work};

/// What the last update may leave behind at reltol 1e-3, in units of the tolerance; it falls with the fourth root of reltol. It is one-sided, step after step, and a tighter run has more steps: with 1e-4 throughout, a slider-crank
/// of 25 turns missed a tolerance of 1e-10 by a factor of 18 at order 5; with this by 10, for a fifth more evaluations.
const LEFT: f64 = 1e-4;
/// An iteration that no longer contracts has met rounding; it counts as converged below this share of the tolerance.
pub const STALLED: f64 = 0.02;
/// The same where rounding has stopped the steps before: chain20 has 0.03 to 0.15 at a tolerance of 1e-10. Not more, or the
/// steps creep up on a change point, ever shorter.
const MOST_STALLED: f64 = 0.3;

/// What diodes may leave of the stages' error, in units of the tolerance.
const BELIEVED: f64 = 0.02;

/// Which unknown moved too far at last, and whether the iterate is finite.
pub type Stuck = (usize, bool);

/// Rounding in units of the tolerance, and what the last update may be.
pub fn target(tol: &Tolerances, fixed: bool) -> (f64, f64) {
    let floor = 4e-16 / tol.reltol;
    let left = if fixed { 1e-11 } else { LEFT * root((tol.reltol / 1e-3).min(1.0), 4) };
    (floor, floor.max(left))
}

/// D of one stage.
pub fn moved(q: &[f64], q0: &[f64], d: &mut [f64]) {
    for ((d, q), q0) in d.iter_mut().zip(q).zip(q0) {
        *d = q - q0;
    }
}

impl Radau {
    /// First guess of the stages: the last step's polynomial, extrapolated.
    pub(super) fn predict(&mut self, sys: &System, h: f64) {
        match self.last.step {
            Some((t, last_h, last)) if h < 4.0 * last_h => {
                let mut theta = [0.0; dense::WIDTH];
                for (theta, c) in theta.iter_mut().zip(self.scheme.c) {
                    *theta = (self.start.t + c * h - t) / last_h;
                }
                let moves = if self.last.anew { &self.estimate.smooth } else { &sys.differential };
                let stage = &mut self.points.x[..self.scheme.s];
                dense::extrapolate_each(last, &theta, &self.last.x0, &self.last.stage, moves, stage);
            }
            _ => {
                for stage in &mut self.points.x {
                    stage.copy_from_slice(&self.start.x);
                }
            }
        }
    }

    /// F and charges of all stages as they are now; `again` in the same step, where sources are what they were.
    pub(super) fn evaluate(&mut self, sys: &System, w: &mut Work, h: f64, again: bool) {
        for (k, c) in self.scheme.c.iter().enumerate() {
            let t = self.start.t + c * h;
            if !again {
                sys.set_time(w, t);
                self.points.waves[k].clone_from(&w.waves);
            }
            sys.eval_rows(w, &self.points.x[k], t, &self.points.waves[k], &mut self.points.f[k]);
        }
    }

    /// What the charges have moved by, where no right-hand side is made of it.
    pub(super) fn move_charges(&mut self, sys: &System) {
        for (d, rows) in self.points.d.iter_mut().zip(&self.points.f).take(self.scheme.s) {
            moved(&rows[sys.n..], &self.start.q, d);
        }
    }

    /// Simplified Newton from the guess in `stage`: the number of iterations.
    pub(super) fn stages(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<usize, Stuck> {
        let (floor, target) = target(tol, self.fixed);
        let most = if self.fixed { 5 * MOST_ITERATIONS } else { MOST_ITERATIONS + self.scheme.s - 3 };
        let stalled = if self.fixed { 0.0 } else { STALLED.max((3.0 * self.newton.level).min(MOST_STALLED)) };
        let mut theta = self.newton.theta;
        self.newton.contraction = 0.0;
        let mut eta;
        let mut first = f64::NAN;
        let mut old = 0.0_f64;
        let mut waited = false; // for multipliers
        for iteration in 1..=most {
            self.evaluate(sys, w, h, iteration > 1);
            w.counters.iterations += 1;
            blend::split(
                self.scheme,
                h,
                (&self.points.f, &self.start.q),
                &mut self.points.d,
                &mut self.points.b,
                &mut self.points.z,
            );
            let Points { b, z, .. } = &mut self.points;
            self.matrices.solve(b, &mut z[..self.scheme.alpha.len()], w);
            let norm = self.correct(tol);
            if !norm.is_finite() {
                return Err((self.newton.moved.iter().position(|v| !v.is_finite()).unwrap_or(0), false));
            }
            if sys.linear || norm == 0.0 {
                // one correction is exact: the error estimate needs the charges after it, not those of the guess
                self.evaluate(sys, w, h, true);
                self.move_charges(sys);
                self.newton.theta = 1e-4;
                return Ok(iteration);
            }
            if iteration > 1 {
                theta = norm / old;
                // at the level of rounding no contraction can be seen any more
                if theta >= 0.5 && norm <= (100.0 * floor).max(stalled) && iteration > 2 {
                    if self.turns_away(sys, w, h, norm) {
                        return Err((self.farthest(tol), true));
                    }
                    self.newton.theta = 0.1;
                    self.newton.level = self.newton.level.max(norm);
                    return Ok(iteration);
                }
                let seen = norm > (1e3 * floor).max(3.0 * self.newton.level);
                let rate = match iteration {
                    2 => norm / first,
                    3 => (norm / first).sqrt(),
                    _ => (norm / first).powf(1.0 / (iteration - 1) as f64),
                };
                if seen || (iteration == 2 && rate < CONTRACTION) {
                    self.newton.contraction = rate;
                }
                // the first correction may have gone into the multipliers: the second shows nothing yet unless it explodes
                let patience = if iteration == 2 { 4.0 } else { 0.99 };
                let away = theta >= patience && norm > target;
                eta = theta / (1.0 - theta).max(1e-3);
                let left = (most - iteration) as i32;
                let slow = norm * theta.powi(left) / (1.0 - theta).max(1e-3) > 10.0 * target;
                if away || slow && (iteration > 2 || theta < 0.2) && norm > 100.0 * floor {
                    return Err((self.farthest(tol), true));
                }
            } else {
                first = norm;
                eta = (self.newton.theta / (1.0 - self.newton.theta).max(1e-3)).clamp(0.0, 1.0);
            }
            let behind = !waited && eta * self.newton.behind > 1.0;
            let converged = eta * norm.max(self.newton.grown) <= target && (iteration > 1 || norm <= target);
            if converged && behind {
                waited = true;
            } else if converged && !self.turns_away(sys, w, h, norm) {
                self.newton.theta = if iteration > 1 { theta } else { 1e-3 };
                return Ok(iteration);
            }
            old = norm.max(1e-300);
        }
        Err((0, true))
    }

    /// The stages of linear equations: with x0 for a guess, the charges' differences are none, F there differs by the sources
    /// alone, and one correction is exact. (A guess by extrapolation, F of every stage before and after took 1.5 times as long.)
    pub(super) fn linear_stages(&mut self, sys: &System, w: &mut Work, h: f64) -> Result<usize, Stuck> {
        w.counters.iterations += 1;
        w.counters.evaluations += self.scheme.s as u64;
        for (f, c) in self.points.f.iter_mut().zip(self.scheme.c) {
            sys.set_time(w, self.start.t + c * h);
            let f = &mut f[..sys.n];
            f.copy_from_slice(&self.start.still);
            sys.add_waves(w, f);
        }
        blend::split_still(self.scheme, &self.points.f, &mut self.points.b, &mut self.points.z);
        let Points { b, z, .. } = &mut self.points;
        self.matrices.solve(b, &mut z[..self.scheme.alpha.len()], w);
        self.newton.theta = 1e-4;
        self.newton.contraction = 0.0;
        let s = self.scheme.s;
        for k in 0..s {
            let step = &mut self.scratch;
            blend::movement(self.scheme, k, &self.points.b, &self.points.z, step);
            for ((x, x0), v) in self.points.x[k].iter_mut().zip(&self.start.x).zip(&*step) {
                *x = x0 + v;
            }
            sys.charges_of(step, &mut self.points.d[k]);
        }
        match self.points.x[s - 1].iter().position(|v| !v.is_finite()) {
            Some(unknown) => Err((unknown, false)),
            None => Ok(1),
        }
    }

    /// What diodes that have turned since the Jacobian was made leave of the last update, in units of it. A contraction that
    /// was seen while everything else settled says nothing of them.
    fn left_behind(&self, sys: &System, w: &mut Work, h: f64) -> f64 {
        let (a, s) = (self.scheme.gamma / h, self.scheme.s);
        let mut worst = 0.0_f64;
        if sys.devices() > 0 {
            let of = |x: &Vec<f64>| sys.left_behind(w, &self.matrices.slopes, a, &self.matrices.real_matrix, x);
            worst = self.points.x.iter().take(s).map(of).fold(0.0, f64::max);
        }
        if sys.yields() {
            // what has turned off has done so before the step or within it
            for k in [0, s - 1] {
                let t = self.start.t + self.scheme.c[k] * h;
                worst = worst.max(sys.bent_behind(w, (&self.matrices.gv, &self.matrices.cv), a, &self.points.x[k], t));
            }
        }
        worst
    }

    /// Is what diodes leave of the last update worth a share of the tolerance, or of what a junction is bent on?
    fn turns_away(&self, sys: &System, w: &mut Work, h: f64, norm: f64) -> bool {
        let left = self.left_behind(sys, w, h);
        left * norm > BELIEVED || self.leaves_lines(sys, w, left)
    }

    /// Has the last update moved a junction off the straight lines that it was solved by, or does so what is left, in
    /// units of it? Whatever of the tolerance that is.
    pub(super) fn leaves_lines(&self, sys: &System, w: &Work, left: f64) -> bool {
        let states = self.points.x.iter().take(self.scheme.s);
        sys.leaves_any(w, &self.matrices.slopes, &self.newton.moved, left.max(1.0), states)
    }

    /// Adds the solutions to the stages: the largest update in units of the tolerance. `grown` is the same in units of what was
    /// there before: an iterate that explodes is large itself, and its updates are small beside it.
    fn correct(&mut self, tol: &Tolerances) -> f64 {
        let last = self.scheme.s - 1;
        self.scratch.copy_from_slice(&self.points.x[last]);
        blend::join(self.scheme, &self.points.b, &self.points.z, &mut self.points.x, &mut self.newton.moved);
        if !self.newton.moved.iter().all(|v| v.is_finite()) {
            return f64::INFINITY;
        }
        let relax = 1.0 / self.estimate.relax;
        self.newton.grown = relax * tol.largest_move(&self.newton.moved, &self.start.x, &self.scratch);
        let rounding = SUMMED * self.scheme.gamma / self.h;
        self.newton.behind = 0.0;
        for &(i, stored) in &self.newton.linear {
            let noise = rounding * self.start.stored[stored as usize];
            let scale = tol.own_scale(i, self.points.x[last][i]) + noise;
            self.newton.behind = self.newton.behind.max(relax * self.newton.moved[i] / scale);
        }
        relax * tol.largest_move(&self.newton.moved, &self.start.x, &self.points.x[last])
    }

    /// The unknown of the largest update.
    pub(super) fn farthest(&self, tol: &Tolerances) -> usize {
        let end = &self.points.x[self.scheme.s - 1];
        let of = |i: &usize| self.newton.moved[*i] / tol.weight(*i, self.start.x[*i], end[*i]);
        (0..end.len()).filter(|&i| tol.in_norm[i]).max_by(|i, j| of(i).total_cmp(&of(j))).unwrap_or(0)
    }
}
