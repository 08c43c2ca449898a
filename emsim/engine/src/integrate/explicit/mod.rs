//! Explicit Runge-Kutta on the state y = Q of the differential rows (see `reduced`): dy/dt = f(y, t), what is algebraic being
//! solved in every stage. One core for every tableau.
//!
//!   k_i = f(y0 + h sum_j a_ij k_j, t0 + c_i h),   y1 = y0 + h sum b_i k_i,   the slope at y1 serves as the next k_0
//!
//! Error: h sum e_i k_i, mapped to the unknowns (momenta to speeds, charges to voltages) and measured in the tolerances;
//! where there is a second estimate of lower order, e5^2 / sqrt(e5^2 + 0.01 e3^2). PI control as in dopri5.f and dop853.f.
//! Dense output in the nested form of both codes, theta = (t - t0)/h, dy = y1 - y0:
//!
//!   y = y0 + th (r1 + (1-th) (r2 + th (r3 + (1-th) (r4 + ...)))),   r1 = dy,  r2 = h k_0 - dy,  r3 = 2 dy - h (k_0 + k_new),
//!   r4... = h sum d_i k_i;  the unknowns at theta are then solved for, so algebraic ones are as exact as the state.
//!
//! Closed loops: multipliers come from the acceleration constraint, which only keeps what it is given; after every accepted
//! step the state is therefore projected back onto positions and velocities, by the least change in the metric of the masses.
//! `.options projection=0` leaves that out (the drift then grows).
//!
//! Stiffness (Hairer and Wanner, Solving ODEs II, section IV.2): the last two evaluations are at one time and nearly one place,
//! so |f(y1) - f(y_s)| / |y1 - y_s| estimates the fastest eigenvalue, in the norm of the tolerances.
mod dop853;
mod rk45;
mod tableau;

pub use dop853::DOP853;
pub use rk45::RK45;

use super::{response, Attempt, Method};
use crate::newton::{Failure, Options, Tolerances};
use crate::reduced::{Point, Reduced, Trouble};
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};
use std::cell::RefCell;
use tableau::{add, combine, Tableau};

/// The local tolerance against the asked one keeps the global error of ordinary problems near what was asked. The long
/// steps that order 8 takes at loose tolerances are judged worse than they know.
const LOCAL: f64 = 0.1;

fn local(method: &Tableau, reltol: f64) -> f64 {
    match method.order {
        8 => LOCAL * (1e-5 / reltol).sqrt().clamp(0.1, 1.0),
        _ => LOCAL,
    }
}
/// Steps are chosen so much shorter than the estimate says.
const SAFE: f64 = 0.7;
/// Corrections of one projection. The first leaves the square of the drift.
const PROJECTIONS: usize = 4;
/// Constraints so near to a loss of rank (a change point, where links lie on one line) magnify what a stage is off them:
/// there stages are projected too. That is the method applied to f(P(y)), so its order stays.
const SINGULAR: f64 = 0.1;

/// h |lambda| over the bound of stability from which the inside of a step is looked at.
const SHARP: f64 = 0.1;

pub struct Explicit<'a> {
    sys: &'a System,
    reduced: &'a Reduced,
    method: &'static Tableau,
    fixed: bool,
    projects: bool,
    point: Point,
    // the step: from (t0, y0, x0) to (t0 + h, y1, x1); slopes by stages, at y1, extra ones
    t0: f64,
    h: f64,
    y0: Vec<f64>,
    y1: Vec<f64>,
    x0: Vec<f64>,
    x1: Vec<f64>,
    k: Vec<f64>,
    last_stage: Vec<f64>,
    started: bool,
    careful: bool,         // every stage is taken onto the constraints
    weakest: f64,          // how near to a loss of rank its stages came
    accepted: Option<f64>, // the driver's time of the new point
    // scratch
    e: Vec<f64>,
    ex: Vec<f64>,
    difference: Vec<f64>,
    // control
    error_old: f64,
    rejected: bool,
    stiffness: f64,
    inside: RefCell<Inside>,
}

/// Dense output: made when first asked for.
struct Inside {
    point: Point,
    r: Vec<Vec<f64>>,
    k: Vec<f64>,
    ready: bool,
}

impl<'a> Explicit<'a> {
    pub fn new(sys: &'a System, o: &Options, method: &'static Tableau) -> Result<Explicit<'a>, Failure> {
        let reduced = sys.reduced().map_err(|why| Failure::Unfit { why: why.to_string() })?;
        let m = reduced.states.len();
        let floor = Tolerances::new(sys, o).atol;
        let flags: Vec<f64> = sys.flags.iter().map(|f| f64::from(f.initial.max(0))).collect();
        let point = || reduced.point(&flags, o.gmin, floor.clone());
        let rows = method.stages + 1;
        Ok(Explicit {
            sys,
            reduced,
            method,
            fixed: o.fixed_step.is_some(),
            projects: o.projection && reduced.has_constraints(),
            point: point(),
            t0: 0.0,
            h: 0.0,
            y0: vec![0.0; m],
            y1: vec![0.0; m],
            x0: vec![0.0; sys.n],
            x1: vec![0.0; sys.n],
            k: vec![0.0; rows * m],
            last_stage: vec![0.0; m],
            started: false,
            careful: false,
            weakest: 1.0,
            accepted: None,
            e: vec![0.0; m],
            ex: vec![0.0; sys.n],
            difference: vec![0.0; sys.n],
            error_old: 1e-4,
            rejected: false,
            stiffness: 0.0,
            inside: RefCell::new(Inside {
                point: point(),
                r: vec![vec![0.0; m]; 3 + method.dense.len()],
                k: vec![0.0; (rows + method.extra.len()) * m],
                ready: false,
            }),
        })
    }

    /// The stages, y1, its slope and its unknowns.
    fn stages(&mut self, h: f64) -> Result<(), Trouble> {
        let (m, method) = (self.y0.len(), self.method);
        for i in 1..method.stages {
            let y = self.reduced.y(&mut self.point);
            combine(y, &self.y0, h, method.a[i], &self.k);
            if i + 1 == method.stages {
                self.last_stage.copy_from_slice(y);
            }
            let c = method.c[i];
            if self.careful {
                self.settle(self.t0 + c * h, c == 1.0)?;
            }
            let (_, k) = self.k.split_at_mut(i * m);
            self.reduced.stage(&mut self.point, &self.sys.waves, self.t0 + c * h, c == 1.0, &mut k[..m])?;
            if self.projects {
                self.weakest = self.weakest.min(self.reduced.weakest(&self.point));
            }
        }
        combine(&mut self.y1, &self.y0, h, method.b, &self.k);
        if self.careful {
            self.reduced.y(&mut self.point).copy_from_slice(&self.y1);
            self.settle(self.t0 + h, true)?;
            self.y1.copy_from_slice(&self.e);
        } else if self.projects {
            // positions first: they need the factors of the last stage alone, which lies next to the new point
            let rounding = self.rounding();
            self.reduced.close(&mut self.point, &mut self.y1, rounding);
        }
        self.arrive(h)
    }

    /// The stage itself is taken onto the constraints, with factors of its own.
    fn settle(&mut self, t: f64, before: bool) -> Result<(), Trouble> {
        let rounding = self.rounding();
        let waves = &self.sys.waves;
        self.e.copy_from_slice(self.reduced.y(&mut self.point));
        self.reduced.solve(&mut self.point, waves, t, before)?;
        self.reduced.close(&mut self.point, &mut self.e, rounding);
        self.reduced.y(&mut self.point).copy_from_slice(&self.e);
        self.reduced.solve(&mut self.point, waves, t, before)?;
        self.reduced.calm(&mut self.point, &mut self.e);
        self.reduced.y(&mut self.point).copy_from_slice(&self.e);
        Ok(())
    }

    /// Slope and unknowns at y1.
    fn arrive(&mut self, h: f64) -> Result<(), Trouble> {
        let m = self.y0.len();
        self.reduced.y(&mut self.point).copy_from_slice(&self.y1);
        let new = &mut self.k[self.method.stages * m..];
        self.reduced.rates(&mut self.point, &self.sys.waves, self.t0 + h, true, new)?;
        self.reduced.unknowns(&mut self.point, &mut self.x1)
    }

    /// Error in units of the tolerance.
    fn error(&mut self, h: f64, tol: &Tolerances) -> f64 {
        let mut of = |row: &[(usize, f64)]| {
            self.e.fill(0.0);
            add(&mut self.e, h, row, &self.k);
            self.reduced.changes(&mut self.point, &self.e, &mut self.ex);
            tol.largest_error(&self.ex, &self.x1, &self.x0) / local(self.method, tol.reltol)
        };
        let fine = of(self.method.error);
        if self.method.coarse.is_empty() {
            return fine;
        }
        let coarse = of(self.method.coarse);
        let both = (fine * fine + 0.01 * coarse * coarse).sqrt();
        if both > 0.0 {
            fine * fine / both
        } else {
            fine
        }
    }

    /// h |lambda| over the bound of stability.
    fn estimate_stiffness(&mut self, h: f64, tol: &Tolerances) {
        let (m, s) = (self.y0.len(), self.method.stages);
        for i in 0..m {
            self.e[i] = self.y1[i] - self.last_stage[i];
        }
        self.reduced.changes(&mut self.point, &self.e, &mut self.difference);
        let last = (s - 1) * m;
        for i in 0..m {
            self.e[i] = self.k[s * m + i] - self.k[last + i];
        }
        self.reduced.changes(&mut self.point, &self.e, &mut self.ex);
        let (mut slopes, mut places, mut rounding) = (0.0, 0.0, 0.0);
        for i in 0..self.x1.len() {
            if tol.in_error[i] {
                let weight = tol.weight(i, self.x0[i], self.x1[i]);
                slopes += (self.ex[i] / weight).powi(2);
                places += (self.difference[i] / weight).powi(2);
                rounding += (1e-14 * self.x1[i] / weight).powi(2);
            }
        }
        let now = if places > rounding { h * (slopes / places).sqrt() / self.method.stable } else { 0.0 };
        let before = if self.stiffness.is_nan() { now } else { self.stiffness };
        self.stiffness = 0.5 * (before + now).min(2e6);
    }

    /// Size of positions, half of whose rounding is the least gap that can be asked for. (Left at four times as much, the
    /// gaps of a motor with a slider-crank added up to 1.5e-10 in 200 turns.)
    fn rounding(&self) -> f64 {
        let moving = self.x0.iter().zip(&self.sys.unknowns).filter(|(_, u)| u.kind == Kind::Coordinate);
        1e-16 * moving.fold(1.0_f64, |m, (x, _)| m.max(x.abs()))
    }

    /// Back onto the constraints of speeds, and once more on those of positions where the last stage was not near enough.
    fn project(&mut self, h: f64) -> Result<(), Trouble> {
        let rounding = self.rounding();
        let mut before = f64::INFINITY;
        for _ in 0..PROJECTIONS {
            let gap = self.reduced.calm(&mut self.point, &mut self.y1);
            self.arrive(h)?;
            let open = self.reduced.close(&mut self.point, &mut self.y1, rounding);
            if open <= 64.0 * rounding || open > 0.25 * before {
                return Ok(());
            }
            before = open.max(gap * f64::EPSILON);
            self.arrive(h)?;
        }
        Ok(())
    }

    fn trouble(&self, t: Trouble) -> Failure {
        let row = |k: usize| if k < self.sys.n { k } else { k % self.sys.n };
        match t {
            Trouble::Singular { unknown } => {
                let unknown = row(unknown);
                Failure::Unfit {
                    why: format!(
                        "charges, fluxes or momenta do not determine `{}` at t = {:.6e} s",
                        self.sys.unknowns[unknown].name, self.t0
                    ),
                }
            }
            Trouble::Diverged { unknown } => Failure::Diverged { unknown: row(unknown), row: row(unknown) },
            Trouble::NotFinite { unknown } => Failure::NotFinite { unknown: row(unknown) },
        }
    }

    /// (t0, h) of the step that dense output is asked about.
    fn prepare_dense(&self, inside: &mut Inside) -> Result<(), Trouble> {
        let (m, s, h, method) = (self.y0.len(), self.method.stages, self.h, self.method);
        inside.point.flags.copy_from_slice(&self.point.flags);
        inside.point.gmin = self.point.gmin;
        inside.k[..(s + 1) * m].copy_from_slice(&self.k);
        for (i, row) in method.extra.iter().enumerate() {
            let y = self.reduced.y(&mut inside.point);
            combine(y, &self.y0, h, row, &inside.k);
            let at = (s + 1 + i) * m;
            let c = method.c[s + 1 + i];
            let (_, k) = inside.k.split_at_mut(at);
            self.reduced.stage(&mut inside.point, &self.sys.waves, self.t0 + c * h, false, &mut k[..m])?;
        }
        for i in 0..m {
            let dy = self.y1[i] - self.y0[i];
            let (f0, f1) = (inside.k[i], inside.k[s * m + i]);
            inside.r[0][i] = dy;
            inside.r[1][i] = h * f0 - dy;
            inside.r[2][i] = 2.0 * dy - h * (f0 + f1);
        }
        for (row, r) in method.dense.iter().zip(&mut inside.r[3..]) {
            r.fill(0.0);
            add(r, h, row, &inside.k);
        }
        inside.ready = true;
        Ok(())
    }

    fn inside(&self, t: f64, out: &mut [f64]) -> Result<(), Trouble> {
        let mut inside = self.inside.borrow_mut();
        let inside = &mut *inside;
        if !inside.ready {
            self.reduced.start_from(&mut inside.point, &self.x1);
            self.prepare_dense(inside)?;
        }
        let theta = (t - self.t0) / self.h;
        let y = self.reduced.y(&mut inside.point);
        for (i, y) in y.iter_mut().enumerate() {
            let mut sum = 0.0;
            for (k, r) in inside.r.iter().enumerate().rev() {
                sum = (sum + r[i]) * if k % 2 == 0 { theta } else { 1.0 - theta };
            }
            *y = self.y0[i] + sum;
        }
        self.reduced.solve(&mut inside.point, &self.sys.waves, t, false)?;
        self.reduced.unknowns(&mut inside.point, out)
    }
}

impl Method for Explicit<'_> {
    fn restart(&mut self, _sys: &System, _w: &mut Work, t: f64, x: &[f64]) {
        self.t0 = t;
        self.x0.copy_from_slice(x);
        self.started = false;
        self.accepted = None;
        self.error_old = 1e-4;
        self.rejected = false;
        self.stiffness = f64::NAN;
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        let before = self.point.evaluations;
        let m = self.y0.len();
        if let Some(t1) = self.accepted.take() {
            self.t0 = t1;
            std::mem::swap(&mut self.y0, &mut self.y1);
            std::mem::swap(&mut self.x0, &mut self.x1);
            self.k.copy_within(self.method.stages * m.., 0);
        }
        self.inside.get_mut().ready = false;
        self.h = h;
        let mut done = Ok(());
        if !self.started {
            sys.eval(w, &self.x0, self.t0);
            self.point.flags.copy_from_slice(&w.flags);
            self.point.gmin = w.gmin;
            self.reduced.start(&mut self.point, &w.q, &self.x0);
            self.y0.copy_from_slice(self.reduced.y(&mut self.point));
            done = self.reduced.rates(&mut self.point, &sys.waves, self.t0, false, &mut self.k[..m]);
            self.started = done.is_ok();
        }
        self.weakest = 1.0;
        let mut result = done.and_then(|()| self.stages(h));
        if self.weakest < SINGULAR && !self.careful {
            self.careful = true;
            self.weakest = 1.0;
            result = result.and_then(|()| self.stages(h));
        } else if self.weakest > 2.0 * SINGULAR {
            self.careful = false;
        }
        w.counters.evaluations += self.point.evaluations - before;
        if let Err(t) = result {
            self.rejected = true;
            return Attempt::Stuck { next: h / 4.0, why: self.trouble(t) };
        }
        let mut error = if self.fixed { 0.0 } else { self.error(h, tol).max(1e-10) };
        if self.careful {
            // rounding is magnified twice, in positions and in what they do to accelerations: a shorter step, which
            // would creep into the singular position, does not help against it
            let noise = self.rounding() / self.weakest.powi(2).max(1e-12);
            error /= 1.0 + h * noise / (LOCAL * tol.reltol);
        }
        if !error.is_finite() {
            self.rejected = true;
            return Attempt::TooLarge { next: 0.2 * h };
        }
        let exponent = 1.0 / f64::from(self.method.order) - 0.75 * self.method.beta;
        if error > 1.0 {
            self.rejected = true;
            return Attempt::TooLarge { next: h * (SAFE * error.powf(-exponent)).max(0.2) };
        }
        if !self.fixed {
            self.estimate_stiffness(h, tol);
        }
        if self.projects {
            let before = self.point.evaluations;
            let projected = self.project(h);
            w.counters.evaluations += self.point.evaluations - before;
            if let Err(t) = projected {
                self.rejected = true;
                return Attempt::Stuck { next: h / 4.0, why: self.trouble(t) };
            }
        }
        if self.fixed {
            return Attempt::Good { next: h };
        }
        let mut factor = SAFE * error.powf(-exponent) * self.error_old.powf(self.method.beta);
        factor = factor.clamp(0.2, self.method.growth);
        if std::mem::take(&mut self.rejected) {
            factor = factor.min(1.0);
        }
        self.error_old = error.max(1e-4);
        Attempt::Good { next: h * factor }
    }

    fn accept(&mut self, t1: f64) {
        self.accepted = Some(t1);
    }

    fn candidate(&self) -> &[f64] {
        &self.x1
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        if self.inside(t, out).is_err() {
            // nothing inside the step could be solved: the chord
            let theta = (t - self.t0) / self.h;
            for (i, o) in out.iter_mut().enumerate() {
                *o = self.x0[i] + theta * (self.x1[i] - self.x0[i]);
            }
        }
    }

    /// Where stability limits the step, a fast component crosses it by an exponential that the polynomial does not follow,
    /// though both ends are right: a motor's current was off by 60 tolerances between them. The polynomial's last term
    /// shows that. (Elsewhere the terms fall fast and the ends tell enough.)
    fn interior(&self, _sys: &System, tol: &Tolerances) -> f64 {
        if self.stiffness.max(0.0) < SHARP {
            return 0.0;
        }
        let mut inside = self.inside.borrow_mut();
        let inside = &mut *inside;
        if !inside.ready {
            self.reduced.start_from(&mut inside.point, &self.x1);
            if self.prepare_dense(inside).is_err() {
                return f64::INFINITY;
            }
        }
        let Some(last) = inside.r.last() else { return 0.0 };
        // largest where theta = 1/2
        let most = 0.5_f64.powi(inside.r.len() as i32);
        let e: Vec<f64> = last.iter().map(|r| most * r).collect();
        let mut change = vec![0.0; self.x1.len()];
        self.reduced.changes(&mut inside.point, &e, &mut change);
        tol.largest_error(&change, &self.x1, &self.x0)
    }

    fn wants_dense_record(&self) -> bool {
        true
    }

    fn restarts_at_corners(&self) -> bool {
        false
    }

    fn response(&self, _formula: usize, y: f64) -> Option<Complex> {
        let rows = self.method.a.iter().chain(std::iter::once(&self.method.b));
        Some(response::stages(rows.map(|row| row.iter().copied()), y))
    }

    fn stiffness(&self) -> f64 {
        self.stiffness.max(0.0) // NaN: nothing is known after a restart
    }
}
