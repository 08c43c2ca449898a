//! Gauss-Legendre collocation, two or three stages, order 4 or 6: symmetric, symplectic, no damping at all. For long runs of
//! what conserves its energy; its steps are therefore of one length.
//!
//! Since Q holds charges, fluxes, coordinates and momenta, the stages of equation (1) are the symplectic method itself:
//!
//!   1/h sum_j (A^-1)_ij (Q(X_j) - Q0) + F(X_i, t_i) = 0,   Q1 = Q0 - h sum_j b_j F(X_j, t_j)
//!
//! and F(X_i, t_i) = 0 in algebraic rows. A^-1 is split as in radau: one complex system, and a real one with three stages.
//! Iterated until rounding stops it, Q1 summed with compensation: what rounding does to the energy is a random walk
//! (Hairer, McLachlan and Razakarivony 2008). The state between steps is Q1, not x1: the unknowns at the end solve
//!
//!   Q(x1) - Q1 + eps h (F(x1) - F*) = 0,   F(x1) = 0 in algebraic rows,   F* = F of the stages extrapolated,  eps = 1e-8,
//!
//! where eps serves what has no charge of its own (a node between two capacitors); nothing of it enters the next step.
//!
//! Closed loops (index 2, multipliers lambda and mu): the same end point is then a projection onto positions and velocities,
//! eps h times the multipliers being the impulses. One-sided projection would make the energy drift; the symmetric one
//! (Hairer 2000; Hairer, Lubich and Wanner 2006, section V.4.1) gives the same impulses nu before and after the step,
//!
//!   Q0~ = Q0 + G(q0)^T nu,   Q1 = Q1~ + G(q1)^T nu,
//!
//! found by nu <- nu + (needed - nu)/2. Two stages only: with three R(infinity) = -1 and the two impulses cancel. Multipliers
//! shown are the stages' extrapolated.
//!
//! Length of the step: it grows while the largest of Gauss's own quadrature errors (see `table`) over WINDOW steps leaves room;
//! afterwards a step only shrinks, where the estimate or Newton's method asks for it, and stays so until a source has a corner.
//! Dense output: dense.rs.
mod dense;
mod fit;
mod table;

use super::control::{Controller, Tried};
use super::rows::Lags;
use super::split::Split;
use super::{interpolate, Attempt, Character, History, Method, Response};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};
use table::{difference, first_difference, Table, THREE, TWO};

/// The local tolerance against the asked one.
const LOCAL: f64 = 0.02;
const EPS: f64 = 1e-8;
/// Iterations of a step's stages, and of the impulses.
const MOST: usize = 50;
const IMPULSES: usize = 12;
/// An update below this part of the unknown that no longer falls is rounding; below the second, if it rises.
const ROUNDING: f64 = 1e-11;
const COARSE: f64 = 1e-7;
/// Growth of the step that is no longer worth it: the length is found.
const ENOUGH: f64 = 1.25;
/// Room for growth this large is taken at once.
const FAR: f64 = 3.0;
/// Steps over which an error is seen from all sides of an oscillation, and refusals that end the search.
const WINDOW: usize = 60;
const REFUSALS: usize = 8;

/// For the length of all steps.
struct Search {
    length: f64, // of every step, once found
    growing: bool,
    seen: usize, // steps of this length, and the largest of their errors
    worst: f64,
    refused: usize,
    longest: f64,   // step that was tried
    crawled: usize, // attempts in a row that were nothing against it
}

impl Search {
    fn new(crawled: usize) -> Search {
        Search { length: 0.0, growing: true, seen: 0, worst: 0.0, refused: 0, longest: 0.0, crawled }
    }
}

pub struct Gauss {
    k: &'static Table,
    newton: Newton,
    matrices: Split,
    t0: f64,
    t1: f64,
    h: f64,
    search: Search,
    q0: Vec<f64>,
    low: Vec<f64>, // what rounding has taken from q0
    q1: Vec<f64>,
    low1: Vec<f64>,
    x0: Vec<f64>,
    f0: Vec<f64>,
    started: bool, // f0 holds
    x1: Vec<f64>,
    stage: Vec<Vec<f64>>,
    d: Vec<Vec<f64>>,
    f: Vec<Vec<f64>>,
    before: Option<(f64, Vec<Vec<f64>>, Vec<Vec<f64>>)>, // the last step: length, stages, F
    past: History,
    extra: Vec<(f64, Vec<f64>)>, // points inside a first step, newest first
    b: Vec<f64>,
    z: Vec<Complex>,
    e: Vec<f64>,
    r: Vec<f64>,
    nu: Vec<f64>,
    needed: Vec<f64>,
    multipliers: Vec<usize>,
    extrapolated: Vec<usize>,
    control: Controller,
    fixed: bool,
    checked: bool,
}

impl Gauss {
    pub fn new(sys: &System, o: &Options) -> Result<Gauss, Failure> {
        let of = |kinds: &[Kind]| (0..sys.n).filter(|&i| kinds.contains(&sys.unknowns[i].kind)).collect::<Vec<_>>();
        if sys.has_laws() {
            return Err(Failure::Unfit {
                why: "friction and rigid stops have modes, and gauss takes no step that ends where one ends".into(),
            });
        }
        let multipliers = of(&[Kind::Lambda, Kind::Mu]);
        let k = match (o.method.as_str(), multipliers.is_empty()) {
            ("gauss4", _) | ("gauss", false) => &TWO,
            ("gauss6", false) => {
                let why = "closed loops need two stages: with three, the projections before and after a step cancel";
                return Err(Failure::Unfit { why: format!("{why}; try method=gauss4") });
            }
            _ => &THREE,
        };
        let v = || vec![0.0; sys.n];
        let stages = || vec![vec![0.0; sys.n]; k.s];
        Ok(Gauss {
            k,
            newton: Newton::new(sys)?,
            matrices: Split::new(sys)?,
            t0: 0.0,
            t1: 0.0,
            h: 0.0,
            search: Search::new(0),
            q0: v(),
            low: v(),
            q1: v(),
            low1: v(),
            x0: v(),
            f0: v(),
            started: false,
            x1: v(),
            stage: stages(),
            d: stages(),
            f: stages(),
            before: None,
            past: History::new(sys.n, 2 * k.s),
            extra: Vec::new(),
            b: v(),
            z: vec![Complex::from(0.0); sys.n],
            e: v(),
            r: v(),
            nu: v(),
            needed: v(),
            multipliers,
            extrapolated: of(&[Kind::Lambda, Kind::Mu, Kind::Derivative]),
            fixed: o.fixed_step.is_some(),
            control: Controller::new(true),
            checked: false,
        })
    }

    fn factor(&mut self, sys: &System, w: &mut Work, h: f64) -> Result<(), Failure> {
        if self.matrices.at.is_nan() {
            sys.eval_jacobian(w, &self.x0, self.t0, false);
            self.matrices.keep(sys, w);
            self.matrices.at = self.t0;
        }
        self.matrices.factor(sys, w, h, &self.k.eigenvalues())
    }

    /// First guess of the stages: the last step's, carried on.
    fn predict(&mut self, h: f64) {
        let k = self.k;
        let Some((last, stages, _)) = &self.before else {
            for s in &mut self.stage {
                s.copy_from_slice(&self.x0);
            }
            return;
        };
        // through the last stages and the point between the steps
        let mut nodes = [0.0; 4];
        let mut xs: [&[f64]; 4] = [&self.x0; 4];
        for j in 0..k.s {
            nodes[j] = (k.c[j] - 1.0) * last;
            xs[j] = &stages[j];
        }
        for (s, c) in self.stage.iter_mut().zip(k.c) {
            interpolate(&nodes[..=k.s], &xs[..=k.s], c * h, s);
        }
    }

    /// Simplified Newton, until rounding ends it.
    fn stages(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<usize, Failure> {
        let (n, k) = (sys.n, self.k);
        let (s, first) = (k.s, usize::from(k.gamma.is_some()));
        let mut old = f64::INFINITY;
        let mut unknown = 0;
        for iteration in 1..=MOST {
            self.evaluate(sys, w, h);
            w.counters.iterations += 1;
            for i in 0..n {
                let mut r = [0.0; 3];
                for (l, r) in r.iter_mut().enumerate().take(s) {
                    *r = self.f[l][i];
                    if sys.has_q[i] {
                        *r += (0..s).map(|j| k.inverse[l][j] * self.d[j][i]).sum::<f64>() / h;
                    }
                }
                let t = |l: usize| -(0..s).map(|j| k.ti[l][j] * r[j]).sum::<f64>();
                self.b[i] = t(0);
                self.z[i] = Complex::new(t(first), t(first + 1));
            }
            if first == 1 {
                self.matrices.real.solve(&mut self.b);
            }
            self.matrices.complex[0].solve(&mut self.z);
            w.counters.solves += 1 + first as u64;
            let mut norm = 0.0_f64;
            for i in 0..n {
                let y = if first == 1 {
                    [self.b[i], self.z[i].re, self.z[i].im]
                } else {
                    [self.z[i].re, self.z[i].im, 0.0]
                };
                let mut largest = 0.0_f64;
                for l in 0..s {
                    let dx = (0..s).map(|j| k.t[l][j] * y[j]).sum::<f64>();
                    self.stage[l][i] += dx;
                    largest = largest.max(dx.abs());
                    if !dx.is_finite() {
                        return Err(Failure::NotFinite { unknown: i });
                    }
                }
                let size = tol.weight(i, self.x0[i], self.stage[0][i]) / tol.reltol;
                if tol.in_norm[i] && largest / size > norm {
                    (norm, unknown) = (largest / size, i);
                }
            }
            let stands = (norm < ROUNDING && norm > 0.3 * old) || (norm < COARSE && norm > old);
            if norm == 0.0 || stands || (sys.linear && iteration >= 2) {
                self.evaluate(sys, w, h);
                return Ok(iteration);
            }
            if iteration > 3 && norm > old {
                break;
            }
            old = norm;
        }
        let row = (0..n).max_by(|&a, &b| self.f[0][a].abs().total_cmp(&self.f[0][b].abs())).unwrap_or(0);
        Err(Failure::Diverged { unknown, row })
    }

    /// Q - Q0 and F of the stages.
    fn evaluate(&mut self, sys: &System, w: &mut Work, h: f64) {
        for l in 0..self.k.s {
            sys.eval(w, &self.stage[l], self.t0 + self.k.c[l] * h);
            for (d, (q, (q0, low))) in self.d[l].iter_mut().zip(w.q.iter().zip(self.q0.iter().zip(&self.low))) {
                *d = (q - q0) - low;
            }
            self.f[l].copy_from_slice(&w.f);
        }
    }

    /// Q1 and the unknowns that belong to it.
    fn finish(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<(), Failure> {
        let k = self.k;
        let mut nodes = [0.0; 4];
        nodes[1..=k.s].copy_from_slice(&k.c[..k.s]);
        let mut xs: [&[f64]; 4] = [&self.x0; 4];
        for (x, stage) in xs[1..].iter_mut().zip(&self.stage) {
            *x = stage;
        }
        interpolate(&nodes[..=k.s], &xs[..=k.s], 1.0, &mut self.x1);
        let a = 1.0 / (EPS * h);
        // F of the stages extrapolated to the end
        let fs: Vec<&[f64]> = self.f.iter().map(Vec::as_slice).collect();
        interpolate(&k.c[..k.s], &fs, 1.0, &mut self.r);
        for i in 0..sys.n {
            if !sys.has_q[i] {
                self.r[i] = 0.0;
                continue;
            }
            let sum: f64 = (0..k.s).map(|j| k.b[j] * self.f[j][i]).sum();
            let change = self.low[i] - h * sum;
            self.q1[i] = self.q0[i] + change;
            self.low1[i] = change - (self.q1[i] - self.q0[i]);
            self.r[i] = -(a * self.q1[i] + self.r[i]);
        }
        self.newton.forget();
        self.newton.solve(sys, w, a, &self.r, &mut self.x1, self.t1, tol, MOST)?;
        if !sys.linear {
            // Newton's method stops at the tolerance: once more, to rounding
            let kept = self.x1.clone();
            if self.newton.solve(sys, w, a, &self.r, &mut self.x1, self.t1, tol, MOST).is_err() {
                self.x1 = kept;
            }
        }
        Ok(())
    }

    /// G(q)^T nu at x, added to `to`: F is linear in the multipliers.
    fn push(&mut self, sys: &System, w: &mut Work, x: &[f64], t: f64, sign: f64) -> Vec<f64> {
        let mut y = x.to_vec();
        for &m in &self.multipliers {
            y[m] = 0.0;
        }
        sys.eval(w, &y, t);
        let without = w.f.clone();
        for &m in &self.multipliers {
            y[m] = self.nu[m];
        }
        sys.eval(w, &y, t);
        (0..sys.n).map(|i| if sys.has_q[i] { sign * (w.f[i] - without[i]) } else { 0.0 }).collect()
    }

    /// A step with the same impulses before and after it.
    fn symmetric(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<usize, Failure> {
        let (q0, low) = (self.q0.clone(), self.low.clone());
        let x0 = self.x0.clone();
        let mut iterations = 0;
        let mut old = f64::INFINITY;
        let mut result = Ok(());
        for _ in 0..IMPULSES {
            let push = self.push(sys, w, &x0, self.t0, 1.0);
            for i in 0..sys.n {
                (self.q0[i], self.low[i]) = (q0[i], low[i] + push[i]);
            }
            result = self.stages(sys, w, h, tol).and_then(|n| {
                iterations = iterations.max(n);
                self.finish(sys, w, h, tol)
            });
            if result.is_err() {
                break;
            }
            // Q(x1) = Q1 - eps h G^T lambda: the impulse that the constraints at the end ask for
            let mut largest = 0.0_f64;
            let mut size = 0.0_f64;
            for &m in &self.multipliers {
                self.needed[m] = -EPS * h * self.x1[m];
                let change = 0.5 * (self.needed[m] - self.nu[m]);
                self.nu[m] += change;
                largest = largest.max(change.abs());
                size = size.max(self.nu[m].abs());
            }
            if largest == 0.0 || largest >= 0.5 * old {
                break;
            }
            old = largest;
        }
        (self.q0, self.low) = (q0, low);
        result?;
        sys.eval(w, &self.x1, self.t1);
        for i in 0..sys.n {
            if sys.has_q[i] {
                (self.q1[i], self.low1[i]) = (w.q[i], 0.0);
            }
        }
        Ok(iterations)
    }

    /// One step from (t0, Q0) to t1, with a fresh Jacobian where the held one does not serve.
    fn step(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<(), Failure> {
        let mut solved = Err(Failure::Diverged { unknown: 0, row: 0 });
        for _ in 0..2 {
            self.factor(sys, w, h)?;
            self.predict(h);
            solved = if self.multipliers.is_empty() {
                self.stages(sys, w, h, tol).and_then(|n| self.finish(sys, w, h, tol).map(|()| n))
            } else {
                self.symmetric(sys, w, h, tol)
            };
            if solved.is_ok() || sys.linear {
                break;
            }
            self.matrices.forget();
        }
        let iterations = solved?;
        // the Jacobian serves on while it contracts fast
        if !sys.linear && iterations > 6 {
            self.matrices.forget();
        }
        // what the end point does not settle: multipliers, d/dt of something
        let xs: Vec<&[f64]> = self.stage.iter().map(Vec::as_slice).collect();
        interpolate(&self.k.c[..self.k.s], &xs, 1.0, &mut self.e);
        for &i in &self.extrapolated {
            self.x1[i] = self.e[i];
        }
        Ok(())
    }

    fn grows_anew(&mut self) {
        self.search = Search::new(self.search.crawled);
        self.control.restart();
    }

    /// The length of the next steps, after one of length h that was good.
    fn grow(&mut self, tried: Tried) {
        let h = tried.h;
        if self.before.is_none() || self.control.allows(tried) > FAR * h {
            self.search.length = self.search.length.max(FAR * h);
            (self.search.seen, self.search.worst) = (0, 0.0);
            return;
        }
        self.search.length = self.search.length.max(h);
        self.search.seen += 1;
        self.search.worst = self.search.worst.max(tried.error);
        if self.search.seen >= WINDOW {
            let room = self.control.allows(Tried { error: self.search.worst, ..tried });
            self.search.growing = room > ENOUGH * h;
            if self.search.growing {
                self.search.length *= room / h;
            }
            (self.search.seen, self.search.worst) = (0, 0.0);
        }
    }

    /// Largest local error over tolerance. Of a first step, whose estimate falls as h^(s+1) and not as the error's h^(2s+1),
    /// the corresponding power.
    fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        let k = self.k;
        let (weights, f) = match &self.before {
            Some((last, _, f)) => (difference(k, last / h), f),
            None => (first_difference(k), &self.f),
        };
        let z = Complex::new(k.alpha / h, k.beta / h);
        for i in 0..sys.n {
            let mut e = weights[2 * k.s] * self.f0[i];
            for j in 0..k.s {
                e += weights[j] * f[j][i] + weights[k.s + j] * self.f[j][i];
            }
            self.z[i] = if sys.has_q[i] { z.scale(-h * e) } else { Complex::from(0.0) };
        }
        self.matrices.complex[0].solve(&mut self.z);
        w.counters.solves += 1;
        for (e, z) in self.e.iter_mut().zip(&self.z) {
            *e = z.re;
        }
        let mut worst = tol.largest_error(&self.e, &self.x1, &self.x0);
        if self.before.is_none() {
            worst = (worst * tol.reltol).powf((2 * k.s + 1) as f64 / (k.s + 1) as f64) / tol.reltol;
        }
        if worst.is_finite() {
            (worst / LOCAL).max(1e-12)
        } else {
            f64::INFINITY
        }
    }
}

/// All steps are as long as the first that serves: a run that begins at rest must not begin with too long a one.
const CHARACTER: Character =
    Character { fewest_steps: 50.0, lags: Lags::Index, restarts_at_corners: false, ..Character::DENSE };

impl Response for Gauss {
    fn response(&self, _formula: usize, y: f64) -> Option<Complex> {
        Some(super::response::pade(self.k.s, self.k.s, y))
    }
}

impl Method for Gauss {
    fn character(&self) -> &Character {
        &CHARACTER
    }

    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.x0.copy_from_slice(x);
        self.x1.copy_from_slice(x);
        sys.eval(w, x, t);
        self.q0.copy_from_slice(&w.q);
        self.started = false;
        self.low.fill(0.0);
        self.nu.fill(0.0);
        self.past.clear();
        self.past.push(t, x);
        self.before = None;
        self.matrices.forget();
        self.extra.clear();
        self.grows_anew();
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        self.search.longest = self.search.longest.max(h);
        let crawls = h < fit::CRAWLS * self.search.longest;
        self.search.crawled = if crawls { self.search.crawled + 1 } else { self.search.crawled.saturating_sub(1) };
        if self.search.crawled > fit::PATIENCE && !self.fixed {
            return Attempt::Stuck { next: 0.0, why: fit::stiff().into() };
        }
        if !self.started {
            sys.eval(w, &self.x0, self.t0);
            self.f0.copy_from_slice(&w.f);
            self.started = true;
        }
        self.h = h;
        self.t1 = self.t0 + h;
        if !self.checked {
            if let Err(why) = self.check(sys, w, h) {
                return Attempt::Stuck { next: 0.0, why: why.into() };
            }
            self.checked = true;
        }
        self.extra.clear();
        if self.fixed && self.past.len == 1 {
            // points for the dense output of the first step
            let parts = 2 * self.k.s - 1;
            for j in 1..parts {
                let part = h * j as f64 / parts as f64;
                self.t1 = self.t0 + part;
                if let Err(why) = self.step(sys, w, part, tol) {
                    return self.control.stuck(h, why);
                }
                self.extra.insert(0, (self.t1, self.x1.clone()));
            }
            self.t1 = self.t0 + h;
        }
        if let Err(why) = self.step(sys, w, h, tol) {
            self.search.growing = false;
            let stuck = self.control.stuck(h, why);
            self.search.length = stuck.next();
            return stuck;
        }
        if self.fixed {
            return Attempt::Good { next: h };
        }
        let tried = Tried { h, error: self.error(sys, w, h, tol), power: 2 * self.k.s + 1 };
        if !(tried.error <= 1.0) {
            self.search.refused += 1;
            self.search.growing &= self.search.refused < REFUSALS;
            (self.search.seen, self.search.worst) = (0, 0.0);
            let refused = self.control.refuse(tried);
            self.search.length = refused.next();
            return refused;
        }
        if self.search.growing {
            self.grow(tried);
        }
        Attempt::Good { next: self.search.length }
    }

    fn accept(&mut self, t1: f64) {
        (self.t0, self.t1) = (t1, t1);
        self.control.accept();
        self.started = false;
        std::mem::swap(&mut self.q0, &mut self.q1);
        std::mem::swap(&mut self.low, &mut self.low1);
        self.x0.copy_from_slice(&self.x1);
        for (t, x) in self.extra.drain(..).rev() {
            self.past.push(t, &x);
        }
        self.past.push(t1, &self.x1);
        let zero = || vec![vec![0.0; self.x0.len()]; self.k.s];
        let (_, mut stages, mut f) = self.before.take().unwrap_or_else(|| (0.0, zero(), zero()));
        std::mem::swap(&mut stages, &mut self.stage);
        std::mem::swap(&mut f, &mut self.f);
        self.before = Some((self.h, stages, f));
    }

    fn candidate(&self) -> &[f64] {
        &self.x1
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        self.polynomial(t, out);
    }

    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        self.lacking(sys, tol)
    }

    /// No polynomial goes through points on both sides of a corner; steps grow anew, for what was short was an edge.
    fn corner(&mut self) {
        self.past.len = 1;
        self.before = None;
        self.grows_anew();
    }
}
