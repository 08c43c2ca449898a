//! Radau IIA, three stages, order 5: L-stable, stiffly accurate (Hairer and Wanner 1996, section IV.8; RADAU5).
//!
//! In charge form, with D_i = Q(X_i) - Q(x0) on differential rows,
//!
//!   1/h sum_j (A^-1)_ij D_j + F(X_i, t_i) = 0,          F(X_i, t_i) = 0 on algebraic rows.
//!
//! T^-1 A^-1 T = diag(gamma, [[alpha, -beta], [beta, alpha]]) splits the simplified Newton step into one real and one
//! complex system of the size of x:   (gamma/h C + G) w1 = -r1,   ((alpha + i beta)/h C + G)(w2 + i w3) = -(r2 + i r3).
//!
//! Error estimate:  e = (gamma/h C + G)^-1 ( -F(x0) + 1/h sum_i d_i D_i ), order 3; measured on what stands under d/dt.
//! Dense output: the collocation polynomial of degree 3 through x0, X1, X2, X3, plus  -10 gamma e phi(theta),
//! phi' = (theta - c1)(theta - c2)(theta - 1), which takes the slope at t0 to that of the solution (order 4).
mod full;

use self::full::FullNewton;
use super::{Attempt, Method};
use crate::newton::{Failure, Options, Tolerances};
use crate::sparse::{Complex, Lu, Symbolic};
use crate::system::{System, Work};

const S6: f64 = 2.449_489_742_783_178;
const C1: f64 = (4.0 - S6) / 10.0;
const C2: f64 = (4.0 + S6) / 10.0;
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752;
const BETA: f64 = 3.050_430_199_247_411;
#[rustfmt::skip]
const T: [[f64; 3]; 3] = [
    [0.091_232_394_870_892_95, -0.141_255_295_020_954_2, -0.030_029_194_105_147_424],
    [0.241_717_932_707_107, 0.204_129_352_293_799_94, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
#[rustfmt::skip]
const TI: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_84, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_37, 0.476_623_554_500_550_44],
    [-0.502_872_634_945_786_8, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
const D: [f64; 3] = [-(13.0 + 7.0 * S6) / 3.0, (-13.0 + 7.0 * S6) / 3.0, -1.0 / 3.0];
/// The local tolerance against the asked one: keeps the global error of ordinary problems near what was asked.
const LOCAL: f64 = 0.02;
const MOST_ITERATIONS: usize = 10;
/// Least share of the local tolerance that Newton's method is asked for: a small voltage that is the derivative of a
/// large charge (the sense node of a comb drive) has rounding noise of eps Q/h, and asking for less than it never ends.
const NEWTON: f64 = 3e-3;
/// An iteration that no longer contracts has met rounding; it counts as converged below this share.
const STALLED: f64 = 1.0;
/// At most so far is the tolerance relaxed where rounding forbids it: twenty times what was asked.
const MOST_RELAXED: f64 = 20.0 / LOCAL;
/// After a step that needed the full Newton method, so many more begin with it.
const FULL_STEPS: u32 = 4;

pub struct Radau {
    real: Lu<f64>,
    complex: Lu<Complex>,
    real_matrix: Vec<f64>,
    complex_matrix: Vec<Complex>,
    factored_h: f64,
    jacobian_at: f64,
    gv: Vec<f64>,
    cv: Vec<f64>,
    t0: f64,
    h: f64,
    x0: Vec<f64>,
    q0: Vec<f64>,
    f0: Vec<f64>,
    started: bool, // f0, q0 hold
    stage: [Vec<f64>; 3],
    d: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    e: Vec<f64>,
    b: Vec<f64>,
    z: Vec<Complex>,
    scratch: Vec<f64>,
    // the accepted step, for prediction and dense output after acceptance
    last: Option<(f64, f64)>,
    last_stage: [Vec<f64>; 3],
    last_x0: Vec<f64>,
    last_e: Vec<f64>,
    accepted: bool,
    theta: f64,
    error_old: f64,
    h_old: f64,
    rejected: bool,
    first: bool,
    fixed: bool,
    uncorrected: Vec<bool>,        // by the error estimate, in dense output
    full: Option<Box<FullNewton>>, // made when first needed
    full_steps: u32,               // so many steps more begin with it
    relax: f64,                    // the error is divided by this where rounding keeps the tolerance out of reach
    longest: f64,                  // recent step length
    probe: Option<(f64, f64)>,     // step and error that a step of a quarter is compared with
}

impl Radau {
    pub fn new(sys: &System, o: &Options) -> Result<Radau, Failure> {
        let symbolic = Symbolic::analyse(&sys.pattern).map_err(Failure::Singular)?;
        let nnz = sys.pattern.rowidx.len();
        let v = || vec![0.0; sys.n];
        let v3 = || [vec![0.0; sys.n], vec![0.0; sys.n], vec![0.0; sys.n]];
        // the estimate means nothing for an algebraic unknown (linearised where the curve may bend sharply)
        let uncorrected = (sys.unknowns.iter().zip(&sys.differential))
            .map(|(u, &moves)| !moves || u.kind.enters_linearly())
            .collect();
        Ok(Radau {
            real: Lu::new(&sys.pattern, &symbolic),
            complex: Lu::new(&sys.pattern, &symbolic),
            real_matrix: vec![0.0; nnz],
            complex_matrix: vec![Complex::from(0.0); nnz],
            factored_h: f64::NAN,
            jacobian_at: f64::NAN,
            gv: vec![0.0; nnz],
            cv: vec![0.0; nnz],
            t0: 0.0,
            h: 0.0,
            x0: v(),
            q0: v(),
            f0: v(),
            started: false,
            stage: v3(),
            d: v3(),
            f: v3(),
            e: v(),
            b: v(),
            z: vec![Complex::from(0.0); sys.n],
            scratch: v(),
            last: None,
            last_stage: v3(),
            last_x0: v(),
            last_e: v(),
            accepted: false,
            theta: 1.0,
            error_old: 1e-2,
            h_old: 0.0,
            rejected: false,
            first: true,
            fixed: o.fixed_step.is_some(),
            uncorrected,
            full: None,
            full_steps: 0,
            relax: 1.0,
            longest: 0.0,
            probe: None,
        })
    }

    fn jacobian(&mut self, sys: &System, w: &mut Work) {
        if self.jacobian_at == self.t0 || (sys.linear && !self.jacobian_at.is_nan()) {
            return;
        }
        sys.eval_jacobian(w, &self.x0, self.t0, false);
        self.gv.copy_from_slice(&w.gv);
        self.cv.copy_from_slice(&w.cv);
        self.jacobian_at = self.t0;
        self.factored_h = f64::NAN;
    }

    fn factor(&mut self, w: &mut Work, h: f64) -> Result<(), Failure> {
        if self.factored_h == h {
            return Ok(());
        }
        let (a, z) = (GAMMA / h, Complex::new(ALPHA / h, BETA / h));
        for k in 0..self.gv.len() {
            self.real_matrix[k] = self.gv[k] + a * self.cv[k];
            self.complex_matrix[k] = Complex::new(self.gv[k] + z.re * self.cv[k], z.im * self.cv[k]);
        }
        self.real.factor_or_refactor(&self.real_matrix).map_err(Failure::Singular)?;
        self.complex.factor_or_refactor(&self.complex_matrix).map_err(Failure::Singular)?;
        w.counters.factorisations += 2;
        self.factored_h = h;
        Ok(())
    }

    /// First guess of the stages: the last step's polynomial, extrapolated.
    fn predict(&mut self, h: f64) {
        match self.last {
            Some((t, last_h)) if h < 4.0 * last_h => {
                for (k, c) in [C1, C2, 1.0].into_iter().enumerate() {
                    let theta = (self.t0 + c * h - t) / last_h;
                    let s = &mut self.stage[k];
                    polynomial(theta, &self.last_x0, &self.last_stage, s);
                }
            }
            _ => {
                for s in &mut self.stage {
                    s.copy_from_slice(&self.x0);
                }
            }
        }
    }

    /// Simplified Newton. Ok(iterations) or Err(worst unknown, finite).
    fn stages(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<usize, (usize, bool)> {
        let n = sys.n;
        // Newton's tolerance is a share of the local one, never below rounding
        let reltol = tol.reltol * LOCAL;
        let floor = 2e-14 / reltol;
        let target = floor.max(if self.fixed { 1e-9 } else { reltol.sqrt().clamp(NEWTON, 0.03) });
        let most = if self.fixed { 5 * MOST_ITERATIONS } else { MOST_ITERATIONS };
        let (mut theta, mut eta) = (self.theta, 0.0_f64);
        let mut old = 0.0_f64;
        let mut worst = 0;
        for iteration in 1..=most {
            for (k, c) in [C1, C2, 1.0].into_iter().enumerate() {
                sys.eval(w, &self.stage[k], self.t0 + c * h);
                for i in 0..n {
                    self.d[k][i] = w.q[i] - self.q0[i];
                }
                self.f[k].copy_from_slice(&w.f);
            }
            w.counters.iterations += 1;
            for i in 0..n {
                let (f, d) = ([self.f[0][i], self.f[1][i], self.f[2][i]], [self.d[0][i], self.d[1][i], self.d[2][i]]);
                let tf = |r: usize| TI[r][0] * f[0] + TI[r][1] * f[1] + TI[r][2] * f[2];
                let (mut r1, mut r2, mut r3) = (tf(0), tf(1), tf(2));
                if sys.has_q[i] {
                    let td = |r: usize| (TI[r][0] * d[0] + TI[r][1] * d[1] + TI[r][2] * d[2]) / h;
                    let (d1, d2, d3) = (td(0), td(1), td(2));
                    r1 += GAMMA * d1;
                    r2 += ALPHA * d2 - BETA * d3;
                    r3 += ALPHA * d3 + BETA * d2;
                }
                self.b[i] = -r1;
                self.z[i] = Complex::new(-r2, -r3);
            }
            self.real.solve(&mut self.b);
            self.complex.solve(&mut self.z);
            w.counters.solves += 2;
            let mut norm = 0.0_f64;
            for i in 0..n {
                let (w1, w2, w3) = (self.b[i], self.z[i].re, self.z[i].im);
                let weight = tol.weight(i, self.x0[i], self.stage[2][i]) * LOCAL * self.relax;
                let mut largest = 0.0_f64;
                for k in 0..3 {
                    let dx = T[k][0] * w1 + T[k][1] * w2 + T[k][2] * w3;
                    self.stage[k][i] += dx;
                    largest = largest.max(dx.abs());
                    if !dx.is_finite() {
                        return Err((i, false));
                    }
                }
                if tol.in_norm[i] && largest / weight > norm {
                    norm = largest / weight;
                    worst = i;
                }
            }
            if sys.linear || norm == 0.0 {
                // one correction is exact: the error estimate needs the charges after it, not those of the guess
                for (k, c) in [C1, C2, 1.0].into_iter().enumerate() {
                    sys.eval(w, &self.stage[k], self.t0 + c * h);
                    for i in 0..n {
                        self.d[k][i] = w.q[i] - self.q0[i];
                    }
                    self.f[k].copy_from_slice(&w.f);
                }
                self.theta = 1e-4;
                return Ok(iteration);
            }
            if iteration > 1 {
                theta = norm / old;
                // at the level of rounding no contraction can be seen any more
                if theta >= 0.5 && norm <= (100.0 * floor).max(if self.fixed { 0.0 } else { STALLED }) && iteration > 2
                {
                    self.theta = 0.1;
                    return Ok(iteration);
                }
                if theta >= 0.99 && norm > target {
                    return Err((worst, true));
                }
                eta = theta / (1.0 - theta).max(1e-3);
                let left = (most - iteration) as i32;
                if norm * theta.powi(left) / (1.0 - theta).max(1e-3) > target.max(floor) * 10.0 && norm > 100.0 * floor
                {
                    return Err((worst, true));
                }
            } else {
                eta = if eta > 0.0 { eta } else { (self.theta / (1.0 - self.theta).max(1e-3)).clamp(0.0, 1.0) };
            }
            if eta * norm <= target && (iteration > 1 || norm <= target) {
                self.theta = if iteration > 1 { theta } else { 1e-3 };
                return Ok(iteration);
            }
            old = norm.max(1e-300);
        }
        Err((worst, true))
    }

    /// Where steps have become a thirtieth of what they were, a step of a quarter is tried: an estimate that does not
    /// fall with it is rounding, and the tolerance gives way to it. True: try the quarter.
    fn rounding(&mut self, h: f64, error: f64) -> bool {
        if let Some((before, larger)) = self.probe.take() {
            if h < 0.3 * before && error > 0.3 * larger && error.is_finite() {
                self.relax = (10.0 * error).max(2.0 * self.relax).min(MOST_RELAXED);
            }
            self.longest = 4.0 * before;
            return false;
        }
        let probe = error > 0.02 && error.is_finite() && h < 0.03 * self.longest;
        if probe {
            self.probe = Some((h, error));
        }
        probe
    }

    /// Newton's method on the stages together: 3n unknowns, blocks (A^-1)_ij/h C(X_j) + delta_ij G(X_i), junction
    /// voltages limited stage by stage.
    fn full_newton(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<usize, (usize, bool)> {
        let n = sys.n;
        let mut full = match self.full.take() {
            Some(f) => f,
            None => Box::new(FullNewton::new(sys).ok_or((0, true))?),
        };
        let result = full.solve(self, sys, w, h, tol);
        self.full = Some(full);
        if result.is_ok() {
            // the error estimate reads the charges of the stages as they are now
            for (k, c) in [C1, C2, 1.0].into_iter().enumerate() {
                sys.eval(w, &self.stage[k], self.t0 + c * h);
                for i in 0..n {
                    self.d[k][i] = w.q[i] - self.q0[i];
                }
                self.f[k].copy_from_slice(&w.f);
            }
        }
        result
    }

    fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        for i in 0..sys.n {
            self.b[i] =
                if sys.has_q[i] { (D[0] * self.d[0][i] + D[1] * self.d[1][i] + D[2] * self.d[2][i]) / h } else { 0.0 };
            self.e[i] = if sys.has_q[i] { self.b[i] - self.f0[i] } else { 0.0 };
        }
        self.real.solve(&mut self.e);
        w.counters.solves += 1;
        let norm = |e: &[f64], x0: &[f64], x1: &[f64]| {
            let mut worst = 0.0_f64;
            for i in 0..e.len() {
                if tol.in_error[i] {
                    let r = e[i].abs() / (LOCAL * tol.weight(i, x0[i], x1[i]));
                    worst = if r.is_finite() { worst.max(r) } else { f64::INFINITY };
                }
            }
            worst
        };
        let mut error = norm(&self.e, &self.x0, &self.stage[2]);
        if error >= 1.0 && (self.first || self.rejected) && error.is_finite() {
            // filtered once more: the estimate of a stiff component right after a start is far too large
            for i in 0..sys.n {
                self.scratch[i] = self.x0[i] + self.e[i];
            }
            sys.eval(w, &self.scratch, self.t0);
            for i in 0..sys.n {
                self.scratch[i] = if sys.has_q[i] { self.b[i] - w.f[i] } else { 0.0 };
            }
            self.real.solve(&mut self.scratch);
            error = norm(&self.scratch, &self.x0, &self.stage[2]);
        }
        error
    }
}

/// The collocation polynomial through (0, x0), (c1, X1), (c2, X2), (1, X3) at theta.
fn polynomial(theta: f64, x0: &[f64], stage: &[Vec<f64>; 3], out: &mut [f64]) {
    let nodes = [0.0, C1, C2, 1.0];
    let mut l = [0.0; 4];
    for j in 0..4 {
        let mut p = 1.0;
        for m in 0..4 {
            if m != j {
                p *= (theta - nodes[m]) / (nodes[j] - nodes[m]);
            }
        }
        l[j] = p;
    }
    for (i, o) in out.iter_mut().enumerate() {
        *o = l[0] * x0[i] + l[1] * stage[0][i] + l[2] * stage[1][i] + l[3] * stage[2][i];
    }
}

impl Method for Radau {
    fn restart(&mut self, _sys: &System, _w: &mut Work, t: f64, x: &[f64]) {
        self.t0 = t;
        self.x0.copy_from_slice(x);
        self.started = false;
        self.jacobian_at = f64::NAN;
        self.factored_h = f64::NAN;
        self.last = None;
        self.first = true;
        self.rejected = false;
        self.theta = 1.0;
        self.accepted = false;
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if !self.started {
            sys.eval(w, &self.x0, self.t0);
            self.q0.copy_from_slice(&w.q);
            self.f0.copy_from_slice(&w.f);
            self.started = true;
        }
        self.accepted = false;
        self.h = h;
        // an old Jacobian serves while the iteration contracts fast
        if self.theta >= 1e-3 || self.jacobian_at.is_nan() {
            self.jacobian(sys, w);
        }
        loop {
            if let Err(why) = self.factor(w, h) {
                return Attempt::Stuck { next: h / 4.0, why };
            }
            self.predict(h);
            let mut solved = Err((0, true));
            if self.full_steps == 0 {
                solved = self.stages(sys, w, h, tol);
            }
            // frozen derivatives cannot follow an exponential: the three stages together, each with its own
            let stale = self.jacobian_at != self.t0;
            if matches!(solved, Err((_, true))) && (self.full_steps > 0 || !stale) && !sys.linear {
                self.predict(h);
                solved = self.full_newton(sys, w, h, tol);
                if solved.is_ok() {
                    self.full_steps = if self.full_steps > 0 { self.full_steps - 1 } else { FULL_STEPS };
                    self.theta = 1.0;
                } else {
                    self.full_steps = 0;
                }
            }
            match solved {
                Ok(iterations) => {
                    let raw = self.error(sys, w, h, tol).max(1e-10);
                    if self.fixed {
                        return Attempt::Good { next: h };
                    }
                    if self.rounding(h, raw) {
                        return Attempt::TooLarge { next: 0.25 * h };
                    }
                    let error = raw / self.relax;
                    let most = 2.0 * MOST_ITERATIONS as f64 + 1.0;
                    let safe = 0.9 * most / (2.0 * MOST_ITERATIONS as f64 + iterations as f64);
                    let mut factor = (safe * error.powf(-0.25)).clamp(0.125, 8.0);
                    if error <= 1.0 {
                        self.longest = h.max(0.98 * self.longest);
                        self.relax = (0.999 * self.relax).max(1.0);
                        if !self.first {
                            // predictive controller (Gustafsson)
                            let g = 0.9 * (h / self.h_old) * (self.error_old / (error * error)).powf(0.25);
                            factor = factor.min(g.clamp(0.125, 8.0));
                        }
                        self.error_old = error.max(1e-2);
                        self.h_old = h;
                        // keep step and factorisation while that costs little
                        let keep = self.theta < 1e-3 || sys.linear;
                        let next = if keep && (1.0..1.2).contains(&factor) { h } else { factor * h };
                        return Attempt::Good { next };
                    }
                    self.rejected = true;
                    self.jacobian(sys, w);
                    let factor = if self.first { 0.1 } else { factor.min(0.9) };
                    return Attempt::TooLarge { next: factor * h };
                }
                Err((unknown, finite)) => {
                    let fresh = self.jacobian_at == self.t0;
                    self.theta = 1.0;
                    if !fresh && finite {
                        self.jacobian_at = f64::NAN;
                        self.jacobian(sys, w);
                        continue;
                    }
                    self.last = None; // a bad prediction is not tried twice
                    let why = if finite {
                        let row =
                            (0..sys.n).max_by(|&i, &j| self.f[2][i].abs().total_cmp(&self.f[2][j].abs())).unwrap_or(0);
                        Failure::Diverged { unknown, row }
                    } else {
                        Failure::NotFinite { unknown }
                    };
                    return Attempt::Stuck { next: h / 4.0, why };
                }
            }
        }
    }

    fn accept(&mut self, t1: f64) {
        self.last = Some((self.t0, self.h));
        self.last_x0.copy_from_slice(&self.x0);
        self.last_e.copy_from_slice(&self.e);
        for k in 0..3 {
            self.last_stage[k].copy_from_slice(&self.stage[k]);
        }
        self.t0 = t1;
        self.x0.copy_from_slice(&self.stage[2]);
        self.started = false;
        self.first = false;
        self.rejected = false;
        self.accepted = true;
    }

    fn candidate(&self) -> &[f64] {
        &self.stage[2]
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let (t0, h, x0, stage, e) = match self.last {
            Some((t0, h)) if self.accepted => (t0, h, &self.last_x0, &self.last_stage, &self.last_e),
            _ => (self.t0, self.h, &self.x0, &self.stage, &self.e),
        };
        let s = (t - t0) / h;
        polynomial(s, x0, stage, out);
        // phi(s) = integral of (s - c1)(s - c2)(s - 1);  c1 + c2 = 4/5, c1 c2 = 1/10
        let phi = s * s * (s * s / 4.0 - 0.6 * s + 0.45) - 0.1 * s;
        for (i, o) in out.iter_mut().enumerate() {
            if !self.uncorrected[i] {
                *o -= 10.0 * GAMMA * phi * e[i];
            }
        }
    }

    fn wants_dense_record(&self) -> bool {
        true
    }

    fn restarts_at_corners(&self) -> bool {
        false
    }
}
