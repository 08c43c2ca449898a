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
mod begin;
mod dense;
mod dop853;
mod rk45;
mod tableau;

pub(super) use begin::place;
pub use dop853::DOP853;
pub use rk45::RK45;

use super::{response, Attempt, Character, Limit, Method, Response};
use crate::interrupt;
use crate::newton::{Failure, Options, Tolerances};
use crate::reduced::{Point, Reduced, Trouble, NEAR};
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};
use crate::tape::Sequence;
use dense::Inside;
use std::cell::{OnceCell, RefCell};
use tableau::{combine, scaled, Tableau};

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

/// h |lambda| over the bound of stability from which the inside of a step is looked at.
const SHARP: f64 = 0.1;

/// Steps without a new estimate of it, which costs up to a twelfth of a step; below this it is taken to grow as the step does.
const UNSEEN: u32 = 3;
const CLEAR: f64 = 0.4;

/// Steps of high order that need no watching: thirty periods at most.
const FAITHFUL: u64 = 100;

pub struct Explicit<'a> {
    character: Character,
    sys: &'a System,
    reduced: &'a Reduced,
    method: &'static Tableau,
    fixed: bool,
    projects: bool,
    point: Point,
    m: usize,     // states
    width: usize, // of rows of states: whole vectors of four, zeros behind the states
    // the step: from (t0, y0, x0) to (t0 + h, y1, x1); slopes by stages, at y1, extra ones
    t0: f64,
    h: f64,
    y0: Vec<f64>,
    y1: Vec<f64>,
    x0: Vec<f64>,
    x1: Vec<f64>,
    k: Vec<f64>, // the table of the tableau, whose first rows these are
    sequence: Option<&'a Sequence>,
    summed: bool, // it has summed what the stages say of the error, too
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
    stiffness: f64,   // of the last step, by the last estimate
    seen: (f64, u32), // length of the step that it is of; steps since that estimate
    inside: OnceCell<RefCell<Inside<'a>>>,
}

impl<'a> Explicit<'a> {
    pub fn new(sys: &'a System, o: &Options, method: &'static Tableau) -> Result<Explicit<'a>, Failure> {
        let reduced = sys.reduced().map_err(|why| Failure::Unfit { why: why.to_string() })?;
        let (m, width) = (reduced.states.len(), reduced.width());
        let floor = Tolerances::new(sys, o).atol;
        let flags: Vec<f64> = sys.flags.iter().map(|f| f64::from(f.initial.max(0))).collect();
        let long = !method.extra.is_empty();
        Ok(Explicit {
            // the twelve stages of a step see as much of a run in five as others in ten; a lossless tank under dop853, by as few steps
            // as stability lets it take, 3.5 a period, loses 4e-5 of its amplitude a period
            character: Character {
                fewest_steps: if long { 5.0 } else { 10.0 },
                shown: 1 + usize::from(long),
                restarts_at_corners: false,
                faithful: if method.order >= 8 { FAITHFUL } else { 0 },
                ..Character::DENSE
            },
            sys,
            reduced,
            method,
            fixed: o.fixed_step.is_some(),
            projects: o.projection && reduced.has_constraints(),
            point: reduced.point(&flags, o.gmin, floor),
            m,
            width,
            t0: 0.0,
            h: 0.0,
            y0: vec![0.0; width],
            y1: vec![0.0; width],
            x0: vec![0.0; sys.n],
            x1: vec![0.0; sys.n],
            k: vec![0.0; method.size(width)],
            sequence: method.step(reduced),
            summed: false,
            last_stage: vec![0.0; width],
            started: false,
            careful: false,
            weakest: 1.0,
            accepted: None,
            e: vec![0.0; width],
            ex: vec![0.0; sys.n],
            difference: vec![0.0; sys.n],
            error_old: 1e-4,
            rejected: false,
            stiffness: 0.0,
            seen: (0.0, 0),
            inside: OnceCell::new(),
        })
    }

    /// The stages, y1, its slope and its unknowns.
    fn stages(&mut self, h: f64) -> Result<(), Trouble> {
        self.summed = self.at_once(h)?;
        if !self.summed {
            self.slopes(h)?;
            if self.careless() {
                return Ok(());
            }
            combine(&mut self.y1, &self.y0, h, self.method.b, &self.k);
        }
        if self.careful {
            self.reduced.y(&mut self.point).copy_from_slice(&self.y1[..self.m]);
            self.settle(self.t0 + h, true)?;
            self.y1.copy_from_slice(&self.e);
        } else if self.projects {
            // positions first: they need the factors of the last stage alone, which lies next to the new point
            let rounding = self.rounding();
            self.reduced.close(&mut self.point, &mut self.y1[..self.m], rounding);
        }
        self.arrive(h)
    }

    /// Stages, y1 and the errors by one program; false where there is none.
    fn at_once(&mut self, h: f64) -> Result<bool, Trouble> {
        let (width, method) = (self.width, self.method);
        let Some(sequence) = self.sequence else { return Ok(false) };
        let Some(mut stages) = self.reduced.stages(&mut self.point, method.stages - 1) else { return Ok(false) };
        let row = |r: usize| r * width..(r + 1) * width;
        self.k[row(method.y0())].copy_from_slice(&self.y0);
        let from = method.h(width);
        self.k[from] = h;
        for (t, c) in self.k[from + 1..].iter_mut().zip(&method.c[1..method.stages]) {
            *t = self.t0 + c * h;
        }
        stages.run_sequence(sequence, &mut self.k);
        self.y1.copy_from_slice(&self.k[row(method.y0() + Tableau::Y1)]);
        self.last_stage.copy_from_slice(&self.k[row(method.y0() + Tableau::LAST)]);
        self.reduced.finite(&self.k[..method.stages * width])?;
        Ok(true)
    }

    fn slopes(&mut self, h: f64) -> Result<(), Trouble> {
        let (m, width, method) = (self.m, self.width, self.method);
        if let Some(mut stages) = self.reduced.stages(&mut self.point, method.stages - 1) {
            for i in 1..method.stages {
                let (done, k) = self.k.split_at_mut(i * width);
                combine(stages.y(), &self.y0, h, method.a[i], done);
                stages.run(self.t0 + method.c[i] * h, k);
            }
            self.last_stage.copy_from_slice(stages.y());
            return self.reduced.finite(&self.k[..method.stages * width]);
        }
        for i in 1..method.stages {
            combine(&mut self.last_stage, &self.y0, h, method.a[i], &self.k);
            self.reduced.y(&mut self.point).copy_from_slice(&self.last_stage[..m]);
            let c = method.c[i];
            if self.careful {
                self.settle(self.t0 + c * h, c == 1.0)?;
            }
            let k = &mut self.k[i * width..][..m];
            self.reduced.rates(&mut self.point, &self.sys.waves, self.t0 + c * h, c == 1.0, k)?;
            if self.projects {
                self.weakest = self.weakest.min(self.reduced.weakest(&self.point));
                if self.careless() {
                    return Ok(()); // the step will be thrown away
                }
            }
        }
        Ok(())
    }

    /// Has a step without care come near to a loss of rank?
    fn careless(&self) -> bool {
        self.weakest < NEAR && !self.careful
    }

    /// The stage itself is taken onto the constraints, with factors of its own.
    fn settle(&mut self, t: f64, before: bool) -> Result<(), Trouble> {
        let rounding = self.rounding();
        let waves = &self.sys.waves;
        let e = &mut self.e[..self.m];
        e.copy_from_slice(self.reduced.y(&mut self.point));
        self.reduced.solve(&mut self.point, waves, t, before)?;
        self.reduced.close(&mut self.point, e, rounding);
        self.reduced.y(&mut self.point).copy_from_slice(e);
        self.reduced.solve(&mut self.point, waves, t, before)?;
        self.reduced.calm(&mut self.point, e);
        self.reduced.y(&mut self.point).copy_from_slice(e);
        Ok(())
    }

    /// Slope and unknowns at y1.
    fn arrive(&mut self, h: f64) -> Result<(), Trouble> {
        self.reduced.y(&mut self.point).copy_from_slice(&self.y1[..self.m]);
        let new = &mut self.k[self.method.stages * self.width..][..self.m];
        self.reduced.arrive(&mut self.point, &self.sys.waves, self.t0 + h, true, Some(new), &mut self.x1)
    }

    /// Error in units of the tolerance.
    fn error(&mut self, h: f64, tol: &Tolerances) -> f64 {
        let (method, mut errors) = (self.method, [0.0; 2]);
        let rows = [(method.error, Tableau::FINE), (method.coarse, Tableau::COARSE)];
        for ((row, place), error) in rows.into_iter().zip(&mut errors) {
            if row.is_empty() {
                continue;
            }
            let e = if self.summed && method.known(row) {
                &self.k[(method.y0() + place) * self.width..]
            } else {
                scaled(&mut self.e, h, row, &self.k);
                &self.e
            };
            self.reduced.changes(&mut self.point, &e[..self.m], &mut self.ex);
            *error = tol.largest_error(&self.ex, &self.x1, &self.x0) / local(method, tol.reltol);
        }
        let [fine, coarse] = errors;
        let both = (fine * fine + 0.01 * coarse * coarse).sqrt();
        if both > 0.0 {
            fine * fine / both
        } else {
            fine
        }
    }

    /// Stiffness of the accepted step of length h, taken from the one before it where nothing is near.
    fn follow_stiffness(&mut self, h: f64, tol: &Tolerances) {
        self.stiffness *= h / self.seen.0;
        self.seen.0 = h;
        if self.stiffness < CLEAR && self.seen.1 < UNSEEN {
            self.seen.1 += 1;
        } else {
            self.estimate_stiffness(h, tol);
        }
    }

    /// h |lambda| over the bound of stability.
    fn estimate_stiffness(&mut self, h: f64, tol: &Tolerances) {
        let unseen = std::mem::take(&mut self.seen.1);
        let (m, last) = (self.m, (self.method.stages - 1) * self.width);
        for i in 0..m {
            self.e[i] = self.y1[i] - self.last_stage[i];
        }
        self.reduced.changes(&mut self.point, &self.e[..m], &mut self.difference);
        for i in 0..m {
            self.e[i] = self.k[last + self.width + i] - self.k[last + i];
        }
        self.reduced.changes(&mut self.point, &self.e[..m], &mut self.ex);
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
        let before = if self.stiffness.is_nan() || unseen > 0 { now } else { self.stiffness };
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
            let gap = self.reduced.calm(&mut self.point, &mut self.y1[..self.m]);
            self.arrive(h)?;
            let open = self.reduced.close(&mut self.point, &mut self.y1[..self.m], rounding);
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
}

impl Response for Explicit<'_> {
    fn response(&self, _formula: usize, y: f64) -> Option<Complex> {
        let rows = self.method.a.iter().chain(std::iter::once(&self.method.b));
        Some(response::stages(rows.map(|row| row.iter().copied()), y))
    }
}

impl Method for Explicit<'_> {
    fn character(&self) -> &Character {
        &self.character
    }

    fn restart(&mut self, _sys: &System, _w: &mut Work, t: f64, x: &[f64]) {
        self.t0 = t;
        self.x0.copy_from_slice(x);
        self.started = false;
        self.accepted = None;
        self.error_old = 1e-4;
        self.rejected = false;
        self.stiffness = f64::NAN;
    }

    fn begin(&mut self, sys: &System, w: &mut Work, first: f64, tol: &Tolerances) -> f64 {
        let before = self.point.evaluations;
        let found = self.start(sys, w).and_then(|()| self.first_length(first, tol));
        w.counters.evaluations += self.point.evaluations - before;
        found.unwrap_or(first)
    }

    fn settle(&mut self, sys: &System, w: &mut Work, t: f64, h: f64, x: &mut [f64]) -> bool {
        let before = self.point.evaluations;
        let mut done = self.step_over_jump(sys, w, t, h, x).unwrap_or(false);
        // (where constraints lose rank a start takes what an implicit step finds)
        done = done && (h > 0.0 || !self.projects || self.reduced.weakest(&self.point) >= NEAR);
        w.counters.evaluations += self.point.evaluations - before;
        if done {
            x.copy_from_slice(&self.ex);
        }
        done
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        let before = self.point.evaluations;
        let width = self.width;
        interrupt::spent(self.method.stages * (sys.operations().0 + 10 * width) + 100);
        if let Some(t1) = self.accepted.take() {
            self.t0 = t1;
            std::mem::swap(&mut self.y0, &mut self.y1);
            std::mem::swap(&mut self.x0, &mut self.x1);
            self.k.copy_within(self.method.stages * width..(self.method.stages + 1) * width, 0);
        }
        self.outdate();
        self.h = h;
        let done = if self.started { Ok(()) } else { self.start(sys, w) };
        self.weakest = 1.0;
        let result = done.and_then(|()| self.stages(h));
        let careless = self.careless();
        self.careful = self.careful && self.weakest <= 2.0 * NEAR || careless;
        w.counters.evaluations += self.point.evaluations - before;
        if let Err(t) = result {
            self.rejected = true;
            return Attempt::Stuck { next: h / 4.0, why: self.trouble(t).into() };
        }
        if careless {
            // once more, with care; or by a method that needs none
            return Attempt::TooLarge { next: h };
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
        if error > 1.0 {
            self.rejected = true;
            return Attempt::TooLarge { next: h * (SAFE * self.method.allows(error, 1.0)).max(0.2) };
        }
        if !self.fixed {
            self.follow_stiffness(h, tol);
        }
        if self.projects {
            let before = self.point.evaluations;
            let projected = self.project(h);
            w.counters.evaluations += self.point.evaluations - before;
            if let Err(t) = projected {
                self.rejected = true;
                return Attempt::Stuck { next: h / 4.0, why: self.trouble(t).into() };
            }
        }
        if self.fixed {
            return Attempt::Good { next: h };
        }
        let mut factor = (SAFE * self.method.allows(error, self.error_old)).clamp(0.2, self.method.growth);
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
    fn interior(&mut self, _sys: &System, tol: &Tolerances) -> f64 {
        if self.seen.1 > 0 {
            self.estimate_stiffness(self.h, tol);
        }
        if self.stiffness.max(0.0) < SHARP {
            return 0.0;
        }
        self.last_term(tol)
    }

    fn limit(&self) -> Limit {
        match self.careful {
            // (where drives leave no freedom the stages are solutions of the constraints, and keep the branch that implicit
            // steps lose: their matrix is singular at a change point)
            true if self.reduced.moves_freely() => Limit::Rank,
            true => Limit::None,
            false if self.stiffness > 0.0 => Limit::Stability(self.stiffness),
            false => Limit::None, // NaN: nothing is known after a restart
        }
    }
}
