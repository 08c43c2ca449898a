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
//!
//! In a passive network of diodes (passive.rs) an iterate may be accepted without that: what the straight lines of the
//! diodes have missed at the new point is measured there, and bounds the next update of every junction's voltage.
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
    pub maxord: Option<usize>,
    pub method: String,
    pub fixed_step: Option<f64>,
    /// explicit methods take closed loops back onto their constraints after every step
    pub projection: bool,
    /// a run that would need more steps is refused
    pub maxsteps: f64,
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
            maxord: None,
            method: "trap".into(),
            fixed_step: None,
            projection: true,
            maxsteps: 1e8,
        }
    }
}

/// Relative and absolute tolerances, and the largest value that each unknown has had (a signal that crosses zero is
/// not asked for relative accuracy of zero).
#[derive(Clone)]
pub struct Tolerances {
    pub reltol: f64,
    pub vntol: f64, // of a junction's voltage
    pub atol: Vec<f64>,
    pub peak: Vec<f64>,
    /// absolute floor of each weight: `atol`, and the rounding that larger neighbours of the same unit bring
    floor: Vec<f64>,
    group: Vec<usize>, // unknowns of one kind and unit
    observed: u32,
    /// in Newton's norm; multipliers, derivative unknowns and algebraic currents are not
    pub in_norm: Vec<bool>,
    /// in the local error norm: what stands under d/dt
    pub in_error: Vec<bool>,
    norm_mask: Vec<f64>, // the same as 1 or 0
    pub error_mask: Vec<f64>,
}

/// Share of a signal's largest value so far below which relative accuracy is no longer asked for.
const PEAK_SHARE: f64 = 0.02;

/// What rounding leaves of an unknown beside neighbours of size 1: a coordinate near zero of a chain of metre-long links
/// is known to some 1e-14 m, however small its own tolerance. Asking for less made tight runs stop.
const NEIGHBOURS: f64 = 1e-12;

impl Tolerances {
    pub fn new(sys: &System, o: &Options) -> Tolerances {
        // SPICE's defaults belong to reltol 1e-3: asking for more asks for more everywhere
        let tighter = (o.reltol / 1e-3).min(1.0);
        let or = |given: f64, default: f64| {
            if given.is_finite() {
                given
            } else {
                default * tighter
            }
        };
        // ... down to where lengths and angles of ordinary size have their rounding
        let least = tighter.max(1e-4);
        let atol = sys.unknowns.iter().map(|u| match u.kind {
            Kind::Node => or(o.vntol, 1e-6),
            Kind::Branch => or(o.abstol, 1e-12),
            Kind::Coordinate if u.unit == "m" => 1e-11 * least,
            Kind::Coordinate => 1e-8 * least,
            Kind::Speed if u.unit == "m/s" => 1e-8 * least,
            Kind::Speed => 1e-6 * least,
            Kind::Lambda | Kind::Mu | Kind::Derivative => 1e-9,
        });
        let in_norm: Vec<bool> = sys
            .unknowns
            .iter()
            .zip(&sys.differential)
            .map(|(u, &d)| !u.kind.enters_linearly() && (d || u.kind != Kind::Branch))
            .collect();
        let in_error: Vec<bool> = in_norm.iter().zip(&sys.differential).map(|(&a, &b)| a && b).collect();
        let mask = |of: &[bool]| of.iter().map(|&b| f64::from(b)).collect();
        let (norm_mask, error_mask) = (mask(&in_norm), mask(&in_error));
        let vntol = or(o.vntol, 1e-6);
        let (atol, peak): (Vec<f64>, Vec<f64>) = (atol.collect(), vec![0.0; sys.n]);
        let mut kinds: Vec<(Kind, &str)> = Vec::new();
        let group = (sys.unknowns.iter())
            .map(|u| {
                let key = (u.kind, u.unit.as_str());
                kinds.iter().position(|&k| k == key).unwrap_or_else(|| {
                    kinds.push(key);
                    kinds.len() - 1
                })
            })
            .collect();
        let floor = atol.clone();
        Tolerances {
            reltol: o.reltol,
            vntol,
            atol,
            peak,
            floor,
            group,
            observed: 0,
            in_norm,
            in_error,
            norm_mask,
            error_mask,
        }
    }

    /// The same tolerances, wider where reltol is tighter than `reltol`.
    pub fn at_least(&self, reltol: f64) -> Tolerances {
        let factor = (reltol / self.reltol).max(1.0);
        let mut t = self.clone();
        t.reltol *= factor;
        t.vntol *= factor;
        t.atol.iter_mut().chain(&mut t.floor).for_each(|a| *a *= factor);
        t
    }

    #[inline]
    pub fn weight(&self, i: usize, a: f64, b: f64) -> f64 {
        self.reltol * a.abs().max(b.abs()).max(PEAK_SHARE * self.peak[i]) + self.floor[i]
    }

    /// Largest |e_i| over the weight of x1_i, x0_i, in the local error norm.
    pub fn largest_error(&self, e: &[f64], x1: &[f64], x0: &[f64]) -> f64 {
        let n = self.atol.len();
        let (e, x1, x0) = (&e[..n], &x1[..n], &x0[..n]);
        let (peak, mask) = (&self.peak[..n], &self.error_mask[..n]);
        // four maxima side by side, so that the divisions run in parallel
        let mut worst = [0.0_f64; 4];
        let ratio = |i: usize| mask[i] * e[i].abs() / self.weight_with(peak[i], self.floor[i], x1[i], x0[i]);
        let whole = n - n % 4;
        for i in (0..whole).step_by(4) {
            for (k, worst) in worst.iter_mut().enumerate() {
                let v = ratio(i + k);
                *worst = if v > *worst { v } else { *worst };
            }
        }
        (whole..n).map(ratio).chain(worst).fold(0.0, f64::max)
    }

    #[inline(always)]
    fn weight_with(&self, peak: f64, atol: f64, a: f64, b: f64) -> f64 {
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        self.reltol * larger(larger(a.abs(), b.abs()), PEAK_SHARE * peak) + atol
    }

    pub fn observe(&mut self, x: &[f64]) {
        for (p, v) in self.peak.iter_mut().zip(x) {
            let v = v.abs();
            *p = if v > *p { v } else { *p };
        }
        // floors move slowly: now and then is enough
        if self.observed % 16 == 0 {
            let mut largest = [0.0_f64; 16];
            for (&g, &p) in self.group.iter().zip(&self.peak) {
                let l = &mut largest[g.min(15)];
                *l = l.max(p);
            }
            for ((f, &a), &g) in self.floor.iter_mut().zip(&self.atol).zip(&self.group) {
                *f = a + NEIGHBOURS * largest[g.min(15)];
            }
        }
        self.observed = self.observed.wrapping_add(1);
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
    /// the method cannot do equations of this kind, whatever the step
    Unfit {
        why: String,
    },
    /// the rest would take too many steps: their number, the time of all, and who asks for them (unknown, period, steps a
    /// period)
    TooLong {
        steps: f64,
        seconds: f64,
        mode: Option<(usize, f64, f64)>,
    },
}

impl Failure {
    /// The same in a system of which this was a part; `of`: where its unknowns are there.
    pub fn renumbered(self, of: &[usize]) -> Failure {
        let at = |k: usize| of.get(k).copied().unwrap_or(k);
        match self {
            Failure::Singular(mut s) => {
                (s.row, s.col) = (s.row.map(at), s.col.map(at));
                Failure::Singular(s)
            }
            Failure::Diverged { unknown, row } => Failure::Diverged { unknown: at(unknown), row: at(row) },
            Failure::NotFinite { unknown } => Failure::NotFinite { unknown: at(unknown) },
            unfit => unfit,
        }
    }
}

pub struct Newton {
    lu: Lu<f64>,
    key: f64, // the `a` of a factorisation that is still valid (linear systems only)
    a: f64,   // the `a` of `rows` and of the base in `lu`
    rows: Vec<f64>,
    base: Vec<f64>,
    sources: Vec<f64>,
    step: Vec<f64>,
    /// Q at the solution, and F as the stage equation gives it
    pub q: Vec<f64>,
    pub f: Vec<f64>,
}

impl Newton {
    pub fn new(sys: &System) -> Result<Newton, Failure> {
        let symbolic = Symbolic::analyse(&sys.pattern).map_err(Failure::Singular)?;
        let mut lu = Lu::new(&sys.pattern, &symbolic);
        lu.set_stamps(sys.stamps());
        Ok(Newton {
            lu,
            key: f64::NAN,
            a: f64::NAN,
            rows: Vec::new(),
            base: Vec::new(),
            sources: Vec::new(),
            step: vec![0.0; sys.n],
            q: vec![0.0; sys.n],
            f: vec![0.0; sys.n],
        })
    }

    /// The held factorisation no longer fits (a flag changed, say).
    pub fn forget(&mut self) {
        self.key = f64::NAN;
    }

    /// Solves the stage from the guess in `x`; leaves Q and F of the solution in self.q, self.f. `r` is 0 in rows
    /// without d/dt.
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
        assert!(x.len() == sys.n && r.len() == sys.n);
        sys.set_time(w, t);
        if self.a != a {
            sys.stage_constants(a, &mut self.rows, &mut self.base);
            self.lu.set_base(&self.base);
            self.a = a;
        }
        if sys.pure_linear {
            return self.solve_linear(sys, w, a, r, x);
        }
        sys.stage_expand(w, x, t);
        for iteration in 1..=max_iterations {
            w.counters.iterations += 1;
            sys.stage_residual(w, a, &self.rows, r, x, &mut self.step);
            if !(sys.linear && self.key == a) {
                self.factor(sys, w, a)?;
            }
            self.lu.solve(&mut self.step);
            w.counters.solves += 1;
            let converged = self.advance(x, tol)?;
            if sys.linear || (converged && !w.limited) {
                sys.stage_charges(w, x, Some(&self.step), &mut self.q);
                self.finish(sys, a, r);
                return Ok(iteration);
            }
            if sys.stage_expand_and_judge(w, x, t, a, (tol.reltol, tol.vntol)) {
                sys.stage_charges(w, x, None, &mut self.q);
                self.finish(sys, a, r);
                return Ok(iteration);
            }
        }
        let ratio = |i: usize| {
            if tol.in_norm[i] {
                self.step[i].abs() / tol.weight(i, x[i], x[i])
            } else {
                0.0
            }
        };
        let unknown = (0..sys.n).max_by(|&i, &j| ratio(i).total_cmp(&ratio(j))).unwrap_or(0);
        sys.eval(w, x, t);
        let row = (0..sys.n).max_by(|&i, &j| w.f[i].abs().total_cmp(&w.f[j].abs())).unwrap_or(0);
        Err(Failure::Diverged { unknown, row })
    }

    fn factor(&mut self, sys: &System, w: &mut Work, a: f64) -> Result<(), Failure> {
        sys.stage_sources(w, a, &mut self.sources);
        self.lu.factor_stamped(&self.sources).map_err(Failure::Singular)?;
        w.counters.factorisations += 1;
        self.key = if sys.linear { a } else { f64::NAN };
        Ok(())
    }

    /// One solution is all: F = G x + waves, Q = C x, whatever the guess.
    fn solve_linear(&mut self, sys: &System, w: &mut Work, a: f64, r: &[f64], x: &mut [f64]) -> Result<usize, Failure> {
        w.counters.evaluations += 1;
        w.counters.iterations += 1;
        if self.key != a {
            self.factor(sys, w, a)?;
        }
        for (b, r) in x.iter_mut().zip(r) {
            *b = -r;
        }
        sys.subtract_waves(w, x);
        self.lu.solve(x);
        w.counters.solves += 1;
        if x.iter().fold(false, |bad, v| bad | !v.is_finite()) {
            return Err(not_finite(x));
        }
        sys.stage_charges(w, x, None, &mut self.q);
        self.finish(sys, a, r);
        Ok(1)
    }

    /// x <- x + step; true when the step was within the tolerance. Dividing is left for the failure's report.
    fn advance(&self, x: &mut [f64], tol: &Tolerances) -> Result<bool, Failure> {
        let n = x.len();
        let (step, mask) = (&self.step[..n], &tol.norm_mask[..n]);
        let (peak, atol) = (&tol.peak[..n], &tol.floor[..n]);
        let (mut large, mut bad) = (false, false);
        for i in 0..n {
            let (old, new) = (x[i], x[i] + step[i]);
            large |= mask[i] * step[i].abs() > tol.weight_with(peak[i], atol[i], old, new);
            bad |= !new.is_finite();
            x[i] = new;
        }
        if bad {
            return Err(not_finite(x));
        }
        Ok(!large)
    }

    /// e <- (G + a C)^-1 a C e with the last factorisation: what remains of an error where it is not damped at once.
    pub fn filter(&mut self, sys: &System, w: &mut Work, a: f64, e: &mut [f64]) {
        sys.c_times(w, e, &mut self.step);
        for v in self.step.iter_mut() {
            *v *= a;
        }
        self.lu.solve(&mut self.step);
        w.counters.solves += 1;
        e.copy_from_slice(&self.step);
    }

    /// b <- (G + a C)^-1 b with the last factorisation.
    pub fn solve_held(&mut self, w: &mut Work, b: &mut [f64]) {
        self.lu.solve(b);
        w.counters.solves += 1;
    }

    /// F from the stage equation, so that charge is conserved.
    fn finish(&mut self, sys: &System, a: f64, r: &[f64]) {
        for ((f, q), (r, has_q)) in self.f.iter_mut().zip(&self.q).zip(r.iter().zip(&sys.has_q)) {
            *f = if *has_q { -(a * q + r) } else { 0.0 };
        }
    }
}

fn not_finite(x: &[f64]) -> Failure {
    Failure::NotFinite { unknown: x.iter().position(|v| !v.is_finite()).unwrap_or(0) }
}
