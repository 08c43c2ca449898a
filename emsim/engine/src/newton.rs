//! Newton's method on one implicit stage:   F(x, t) + a Q(x, t) + r = 0.
//!
//! Backward Euler, trapezoid, BDF and SDIRK stages, the consistent start and the operating point (a = 0) are all of this
//! form, so one loop serves them. Rows without d/dt have a Q = 0 and r = 0: they read F = 0.
//!
//! Convergence is judged on the update, |dx_i| <= reltol |x_i| + abstol_i. Since the residual of an accepted iterate is
//! J dx, a small update bounds the residual of every row by sum_j |J_ij| tol_j; the operating point, where steps can be
//! long, evaluates the residual itself once more. Multipliers, derivative unknowns and currents of voltage sources enter
//! linearly and converge with the rest: they are outside the norm, because the rounding noise of such a force, or of the
//! current of a capacitor across a source, grows as 1/h.
use crate::sparse::{Lu, Singular, Symbolic};
use crate::system::{Kind, System, Work};

#[derive(Clone, Debug)]
pub struct Options {
    pub reltol: f64,
    pub abstol: f64,
    pub vntol: f64,
    pub trtol: f64,
    pub gmin: f64,
    pub itl1: usize,
    pub itl4: usize,
    pub maxord: usize,
    pub method: String,
    pub fixed_step: Option<f64>,
    pub hold_mechanics: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            reltol: 1e-3,
            abstol: f64::NAN, // not given: follows reltol
            vntol: f64::NAN,
            trtol: f64::NAN,
            gmin: 1e-12,
            itl1: 100,
            itl4: 30,
            maxord: 2,
            method: "trap".into(),
            fixed_step: None,
            hold_mechanics: true,
        }
    }
}

/// Relative and absolute tolerances, and the largest value that each unknown has had (a signal that crosses zero is
/// not asked for relative accuracy of zero).
#[derive(Clone)]
pub struct Tolerances {
    pub reltol: f64,
    pub atol: Vec<f64>,
    pub peak: Vec<f64>,
    /// in Newton's norm; multipliers, derivative unknowns and algebraic currents are not
    pub in_norm: Vec<bool>,
    /// in the local error norm: what stands under d/dt
    pub in_error: Vec<bool>,
}

/// Share of a signal's largest value so far below which relative accuracy is no longer asked for.
const PEAK_SHARE: f64 = 0.02;

impl Tolerances {
    pub fn new(sys: &System, o: &Options) -> Tolerances {
        // SPICE's defaults belong to reltol 1e-3: asking for more asks for more everywhere
        let tighter = (o.reltol / 1e-3).min(1.0);
        let or = |given: f64, default: f64| if given.is_finite() { given } else { default * tighter };
        let atol = sys.unknowns.iter().map(|u| match u.kind {
            Kind::Node => or(o.vntol, 1e-6),
            Kind::Branch => or(o.abstol, 1e-12),
            Kind::Coordinate if u.unit == "m" => 1e-11 * tighter,
            Kind::Coordinate => 1e-8 * tighter,
            Kind::Speed if u.unit == "m/s" => 1e-8 * tighter,
            Kind::Speed => 1e-6 * tighter,
            Kind::Lambda | Kind::Mu | Kind::Derivative => 1e-9,
        });
        let linear_kind = |k: Kind| matches!(k, Kind::Lambda | Kind::Mu | Kind::Derivative);
        let in_norm: Vec<bool> = sys
            .unknowns
            .iter()
            .zip(&sys.differential)
            .map(|(u, &d)| !linear_kind(u.kind) && (d || u.kind != Kind::Branch))
            .collect();
        let in_error = in_norm.iter().zip(&sys.differential).map(|(&a, &b)| a && b).collect();
        Tolerances { reltol: o.reltol, atol: atol.collect(), peak: vec![0.0; sys.n], in_norm, in_error }
    }

    #[inline]
    pub fn weight(&self, i: usize, a: f64, b: f64) -> f64 {
        self.reltol * a.abs().max(b.abs()).max(PEAK_SHARE * self.peak[i]) + self.atol[i]
    }

    pub fn observe(&mut self, x: &[f64]) {
        for (p, v) in self.peak.iter_mut().zip(x) {
            *p = p.max(v.abs());
        }
    }
}

#[derive(Clone, Debug)]
pub enum Failure {
    Singular(Singular),
    /// worst unknown, and the row of the largest residual
    Diverged {
        unknown: usize,
        row: usize,
    },
    NotFinite {
        unknown: usize,
    },
}

pub struct Newton {
    lu: Lu<f64>,
    key: f64, // the `a` of a factorisation that is still valid (linear systems only)
    matrix: Vec<f64>,
    step: Vec<f64>,
    /// Q at the solution, and F as the stage equation gives it
    pub q: Vec<f64>,
    pub f: Vec<f64>,
}

impl Newton {
    pub fn new(sys: &System) -> Result<Newton, Failure> {
        let symbolic = Symbolic::analyse(&sys.pattern).map_err(Failure::Singular)?;
        Ok(Newton {
            lu: Lu::new(&sys.pattern, &symbolic),
            key: f64::NAN,
            matrix: vec![0.0; sys.pattern.rowidx.len()],
            step: vec![0.0; sys.n],
            q: vec![0.0; sys.n],
            f: vec![0.0; sys.n],
        })
    }

    /// The held factorisation no longer fits (a flag changed, say).
    pub fn forget(&mut self) {
        self.key = f64::NAN;
    }

    /// Solves the stage from the guess in `x`; leaves Q and F of the solution in self.q, self.f.
    #[allow(clippy::too_many_arguments)]
    pub fn solve(
        &mut self,
        sys: &System,
        w: &mut Work,
        a: f64,
        r: &[f64],
        x: &mut [f64],
        t: f64,
        tol: &Tolerances,
        max_iterations: usize,
    ) -> Result<usize, Failure> {
        for iteration in 1..=max_iterations {
            sys.eval_jacobian(w, x, t, true);
            w.counters.iterations += 1;
            if !(sys.linear && self.key == a) {
                for (m, (g, c)) in self.matrix.iter_mut().zip(w.gv.iter().zip(&w.cv)) {
                    *m = g + a * c;
                }
                self.lu.factor_or_refactor(&self.matrix).map_err(Failure::Singular)?;
                w.counters.factorisations += 1;
                self.key = if sys.linear { a } else { f64::NAN };
            }
            for i in 0..sys.n {
                self.step[i] = -(w.f[i] + if sys.has_q[i] { a * w.q[i] + r[i] } else { 0.0 });
            }
            self.lu.solve(&mut self.step);
            w.counters.solves += 1;
            // the update against the tolerance; dividing is left for the failure's report
            let mut converged = true;
            let mut sum = 0.0;
            for i in 0..sys.n {
                let (d, new) = (self.step[i], x[i] + self.step[i]);
                sum += new;
                if tol.in_norm[i] && !(d.abs() <= tol.weight(i, x[i], new)) {
                    converged = false;
                }
                x[i] = new;
            }
            // one value that is not finite makes the sum so
            if !sum.is_finite() {
                if let Some(unknown) = x.iter().position(|v| !v.is_finite()) {
                    return Err(Failure::NotFinite { unknown });
                }
            }
            if sys.linear || (converged && !w.limited) {
                self.finish(sys, w, a, r, x);
                return Ok(iteration);
            }
        }
        let ratio = |i: usize| if tol.in_norm[i] { self.step[i].abs() / tol.weight(i, x[i], x[i]) } else { 0.0 };
        let unknown = (0..sys.n).max_by(|&i, &j| ratio(i).total_cmp(&ratio(j))).unwrap_or(0);
        let row = (0..sys.n).max_by(|&i, &j| w.f[i].abs().total_cmp(&w.f[j].abs())).unwrap_or(0);
        Err(Failure::Diverged { unknown, row })
    }

    /// e <- (G + a C)^-1 a C e with the last factorisation: what remains of an error where it is not damped at once.
    pub fn filter(&mut self, sys: &System, w: &mut Work, a: f64, e: &mut [f64]) {
        self.step.fill(0.0);
        sys.add_c_times(w, e, &mut self.step);
        for v in self.step.iter_mut() {
            *v *= a;
        }
        self.lu.solve(&mut self.step);
        w.counters.solves += 1;
        e.copy_from_slice(&self.step);
    }

    /// Q at the solution, to first order in the last update; F from the stage equation, so that charge is conserved.
    fn finish(&mut self, sys: &System, w: &mut Work, a: f64, r: &[f64], x: &[f64]) {
        if sys.pure_linear {
            sys.charges_of_linear(x, &mut self.q);
        } else {
            self.q.copy_from_slice(&w.q);
            sys.add_c_times(w, &self.step, &mut self.q);
        }
        for i in 0..sys.n {
            self.f[i] = if sys.has_q[i] { -(a * self.q[i] + r[i]) } else { 0.0 };
        }
    }
}
