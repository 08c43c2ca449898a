//! Radau IIA with s = 3, 5, 7 stages, orders 2s - 1 = 5, 9, 13: L-stable, stiffly accurate (Hairer and Wanner 1996,
//! section IV.8; J. Comput. Appl. Math. 111 (1999) 93: RADAU).
//!
//! In charge form, with D_i = Q(X_i) - Q(x0) on differential rows,
//!
//!   1/h sum_j (A^-1)_ij D_j + F(X_i, t_i) = 0,          F(X_i, t_i) = 0 on algebraic rows.
//!
//! T^-1 A^-1 T = diag(gamma, [[alpha, -beta], [beta, alpha]], ...) splits the simplified Newton step into one real and
//! (s - 1)/2 complex systems of the size of x (stages.rs; numbers in tables.rs):
//!
//!   (gamma/h C + G) w1 = -r1,   ((alpha + i beta)/h C + G)(w2 + i w3) = -(r2 + i r3), ...
//!
//! Error estimate:  e = (gamma/h C + G)^-1 ( -F(x0) + 1/h sum_i d_i D_i ), O(h^(s+1)); measured on what stands under
//! d/dt. The solution at the end of the step is far better than that, O(h^2s), its interior (dense.rs) somewhat. So the
//! estimate may exceed the asked tolerance where the tolerance is tight: see `share`.
mod blend;
mod dense;
mod estimate;
mod full;
mod order;
mod stages;
mod state;
mod tables;

use self::estimate::share;
use self::order::{contracting, Orders, Taken, CONTRACTION};
use self::state::{Estimate, Iteration, Last, Points, Start};
use self::tables::Scheme;
use super::control::{Controller, Tried};
use super::rows::Lags;
use super::split::Split;
use super::{Attempt, Character, Method, Response};
use crate::ledger::Stages;
use crate::newton::{Failure, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{System, Work};

const MOST_ITERATIONS: usize = 10; // 7 in RADAU5, three more for two digits more (`LEFT`) at a contraction of 0.15
/// Steps of a run that are taken at least: with their many stages they see as much in these as others in ten.
const FEWEST: f64 = 6.0;
/// After a step that needed the full Newton method, so many more begin with it where exponentials turn; elsewhere each is by itself.
const FULL_STEPS: u32 = 4;
/// A first step that is refused again and again is too long by orders of magnitude: what its estimate says means nothing.
/// (Robertson's equations, whose rows are 2e9 s apart and whose first step is 1 s: 4.5 million instructions at 1e-3, 3.3 with this.)
const LOST: f64 = 0.01;
/// A step of at most so many times the last one is predicted well enough for the Jacobian of its middle.
const FORESIGHT: f64 = 2.0;
/// What rounding has done to one step is expected of the next, by so much less.
const FORGET: f64 = 0.98;
/// The Jacobian is kept while the iteration contracts better than this.
const REUSE: f64 = 1e-3;

/// How much more than a smooth curve one with a corner lacks inside a step, for what it parts by before it: 7, 12, 17 in the
/// median over the corner's place, with 3, 5, 7 stages.
const CORNER: f64 = 10.0;

pub struct Radau {
    scheme: &'static Scheme,
    next_scheme: &'static Scheme,
    orders: Orders,
    characters: [Character; 3], // by the number of stages
    control: Controller,
    start: Start,
    h: f64,
    points: Points,
    matrices: Split,
    newton: Iteration,
    estimate: Estimate,
    last: Last,
    accepted: bool,
    first: bool,
    fixed: bool,
    pure_linear: bool,
    stuck: u32,
    proposed: f64,
    proposed_next: f64,
    longest: f64, // recent step length
    scratch: Vec<f64>,
}

impl Radau {
    /// `name`: radau, radau5, radau9 or radau13.
    pub fn new(sys: &System, o: &Options, name: &str) -> Result<Radau, Failure> {
        let orders = Orders::new(name, o.fixed_step.is_some(), o.reltol, sys);
        let (n, most) = (sys.n, orders.most().s);
        let v = || vec![0.0; n];
        Ok(Radau {
            scheme: orders.first(),
            next_scheme: orders.first(),
            orders,
            characters: character(sys.pure_linear, o.fixed_step.is_some()),
            control: Controller::new(true),
            start: Start { x: v(), q: v(), f: v(), still: v(), ..Start::default() },
            h: 0.0,
            points: Points::new(n, most),
            matrices: Split::new(sys)?,
            newton: Iteration::new(sys),
            estimate: Estimate::new(sys),
            last: Last { step: None, stage: vec![v(); most], x0: v(), e: v(), bent: false, anew: false },
            accepted: false,
            first: true,
            fixed: o.fixed_step.is_some(),
            pure_linear: sys.pure_linear,
            stuck: 0,
            proposed: 0.0,
            proposed_next: 0.0,
            longest: 0.0,
            scratch: v(),
        })
    }

    /// Derivatives for a step of h from here: at its middle as the last step's polynomial foresees it, since the stages
    /// lie on both sides of that; at x0 where there is no such foresight.
    fn jacobian(&mut self, sys: &System, w: &mut Work, h: f64) {
        if self.matrices.at == self.start.t || (sys.linear && !self.matrices.at.is_nan()) {
            return;
        }
        let (mut t, mut x) = (self.start.t, &self.start.x);
        match self.last.step {
            Some((start, last_h, last)) if h < FORESIGHT * last_h && !sys.linear && self.newton.foresee => {
                t = self.start.t + 0.5 * h;
                let theta = (t - start) / last_h;
                let moves = &sys.differential;
                dense::extrapolate(last, theta, &self.last.x0, &self.last.stage, moves, &mut self.scratch);
                // far up an exponential everything looks solved: the update is next to nothing whatever is missing
                if sys.within_reach(&self.start.x, &self.scratch) {
                    x = &self.scratch;
                } else {
                    t = self.start.t;
                }
            }
            _ => self.newton.foresee = false,
        }
        sys.eval_jacobian(w, x, t, false);
        self.matrices.keep(sys, w);
        self.matrices.at = self.start.t;
    }

    /// What a step that begins anew has on one curve with its start: to the tolerance, or as near to the curve through the stages as the one
    /// through all but the first is, for it may bend within the step. Parts of a machine bend together: which does so by next to nothing is
    /// chance. A transient, and what algebraic unknowns were, is not; the node of a source is.
    fn find_smooth(&mut self, sys: &System, tol: &Tolerances) {
        let (back, fewer, s) = (dense::back(self.scheme), dense::back_without_first(self.scheme), self.scheme.s);
        let (x0, x) = (&self.start.x, &self.points.x);
        let at_start = |weights: &[f64], stages: &[Vec<f64>], i: usize| {
            weights.iter().zip(stages).map(|(l, x)| l * x[i]).sum::<f64>()
        };
        let parts = |i: usize, by: f64| by.abs() / tol.weight(i, x0[i], x[s - 1][i]);
        let off = |i: usize| parts(i, x0[i] - at_start(back, x, i));
        let bends = |i: usize| parts(i, at_start(back, x, i) - at_start(fewer, &x[1..], i));
        let moves = |i: &usize| sys.differential[*i] && sys.unknowns[*i].kind.mechanical();
        let machine = (0..sys.n).filter(moves).map(bends).fold(1.0, f64::max);
        for i in 0..sys.n {
            let near = off(i) <= if moves(&i) { machine } else { bends(i).max(1.0) };
            self.estimate.smooth[i] =
                if self.fixed { near } else { self.estimate.corrected[i] && (self.estimate.given[i] || near) };
        }
    }

    /// Judges a step whose stages are solved; the full Newton method leaves the derivatives of its end where there are diodes.
    fn judge(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances, iterations: usize) -> Attempt {
        let turned = sys.turns() && self.matrices.at.is_nan();
        let mut estimate = self.error(sys, w, h, tol);
        if turned {
            estimate = estimate.max(share(tol.reltol) * self.end_error(sys, w, h, tol));
        }
        self.estimate.of_step = estimate;
        if self.first || self.start.bent {
            self.find_smooth(sys, tol);
        }
        let raw = (estimate / share(tol.reltol)).max(1e-10);
        self.next_scheme = self.scheme;
        if self.fixed {
            return Attempt::Good { next: h };
        }
        if self.rounding(h, estimate, raw, tol) {
            return Attempt::TooLarge { next: 0.25 * h };
        }
        let error = raw / self.estimate.relax.max(10.0 * std::mem::take(&mut self.estimate.noise));
        let tried = Tried { h, error, power: self.scheme.s + 1 };
        if error <= 1.0 {
            self.longest = h.max(0.98 * self.longest);
            self.estimate.relax = (0.999 * self.estimate.relax).max(1.0);
            let seen = self.newton.contraction > 0.0 && self.newton.full_steps == 0;
            let contracts = if seen { contracting(self.newton.contraction) } else { f64::INFINITY };
            // what took many iterations lies far from where it was looked for (Hairer and Wanner, equation (IV.8.22))
            let most = 2.0 * MOST_ITERATIONS as f64 + 1.0;
            let found = most / (most - 1.0 + iterations as f64);
            let factor = (found * self.control.judge(tried, false).next() / h).min(contracts);
            if self.newton.full_steps == 0 && self.orders.due(self.scheme) {
                let taken = Taken {
                    h,
                    iterations,
                    contraction: self.newton.contraction,
                    contracts,
                    error: estimate,
                    lower: self.lower_error(sys, w, h, tol),
                    longest: if h < 0.9 * self.proposed { h } else { f64::INFINITY },
                    linear: sys.linear,
                };
                let (scheme, step) = self.orders.next(self.scheme, &taken, tol.reltol, &self.matrices.real);
                self.next_scheme = scheme;
                if let Some(step) = step {
                    self.proposed_next = step;
                    return Attempt::Good { next: step };
                }
            }
            // keep step and factorisation while that costs little
            let keep = self.newton.theta < REUSE || sys.linear;
            let next = if keep && (1.0..1.2).contains(&factor) { h } else { factor * h };
            self.proposed_next = next;
            return Attempt::Good { next };
        }
        let refused = match self.estimate.at_first {
            _ if !self.first => self.control.refuse(tried),
            Some(_) if !sys.turns() => Attempt::TooLarge { next: LOST * h },
            _ => self.control.refuse(Tried { error: f64::INFINITY, ..tried }),
        };
        self.estimate.at_first = self.estimate.at_first.or(Some((h, estimate)));
        self.orders.refused();
        self.jacobian(sys, w, h);
        refused
    }
}

/// Of methods with 3, 5 and 7 stages.
fn character(pure_linear: bool, fixed: bool) -> [Character; 3] {
    // order 13 takes 4e-5 of an oscillation in a step of 5 radians, order 9 2e-4 in one of half a period
    [(3, 0), (5, 24), (7, 100)].map(|(stages, faithful)| Character {
        fewest_steps: FEWEST,
        full_length: pure_linear,
        restarts_at_corners: false,
        // order 13 takes two steps in a period
        pieces: usize::div_ceil(stages, 2),
        shown: stages,
        lags: Lags::unless(fixed, Lags::Index),
        faithful,
        ..Character::DENSE
    })
}

impl Response for Radau {
    fn formula(&self) -> usize {
        self.last.step.map_or(self.scheme, |(_, _, scheme)| scheme).s
    }

    fn response(&self, stages: usize, y: f64) -> Option<Complex> {
        Some(super::response::pade(stages - 1, stages, y))
    }
}

impl Method for Radau {
    fn character(&self) -> &Character {
        &self.characters[self.scheme.rank()]
    }

    fn restart(&mut self, _sys: &System, _w: &mut Work, t: f64, x: &[f64]) {
        self.start.t = t;
        self.start.x.copy_from_slice(x);
        self.scheme = self.orders.anew();
        self.start.known = false;
        self.matrices.forget();
        self.newton.foresee = true;
        self.last.step = None;
        self.first = true;
        self.last.anew = false;
        self.estimate.at_first = None;
        self.newton.theta = 1.0;
        self.accepted = false;
        self.stuck = 0;
        self.proposed = 0.0;
        self.control.restart();
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if !self.start.known {
            self.start.evaluate(sys, w);
        }
        self.accepted = false;
        self.h = h;
        // an old Jacobian serves while the iteration contracts fast
        // (updates at the level of rounding say nothing of the Jacobian; if those before contracted too little to go on with this length, it
        // is renewed: with one of another time they contract no better in shorter steps, down to none)
        if self.newton.theta >= REUSE || self.newton.contraction > CONTRACTION || self.matrices.at.is_nan() {
            self.jacobian(sys, w, h);
        }
        loop {
            if let Err(why) = self.matrices.factor(sys, w, h, &self.scheme.eigenvalues()) {
                return Attempt::Stuck { next: h / 4.0, why: why.into() };
            }
            let mut solved = Err((0, true));
            if self.newton.full_steps == 0 {
                solved = if sys.pure_linear {
                    self.linear_stages(sys, w, h)
                } else {
                    self.predict(sys, h);
                    self.stages(sys, w, h, tol)
                };
            }
            let lowest = self.scheme.s == 3;
            // frozen derivatives cannot follow an exponential: the stages together, each with its own
            let stale = self.matrices.at != self.start.t || (self.newton.foresee && lowest);
            if matches!(solved, Err((_, true))) && (self.newton.full_steps > 0 || !stale) && !sys.linear && lowest {
                self.predict(sys, h);
                solved = self.full_newton(sys, w, h, tol);
                if solved.is_ok() {
                    self.newton.full_steps = match self.newton.full_steps {
                        0 if sys.turns() => FULL_STEPS,
                        more => more.saturating_sub(1),
                    };
                    (self.newton.theta, self.newton.contraction) = (1.0, 0.0);
                } else {
                    self.newton.full_steps = 0;
                }
            }
            let (unknown, finite) = match solved {
                Ok(iterations) => return self.judge(sys, w, h, tol, iterations),
                Err(stuck) => stuck,
            };
            self.newton.theta = 1.0;
            let failed = self.matrices.at;
            self.matrices.at = f64::NAN;
            if stale && finite {
                // once more with the derivatives of this step; at the last order with those of its start
                self.newton.foresee &= failed != self.start.t;
                self.jacobian(sys, w, h);
                continue;
            }
            let s = self.scheme.s;
            self.newton.foresee = true;
            self.stuck += 1;
            if finite && !lowest && self.stuck > 1 {
                self.scheme = self.orders.fall();
                self.jacobian(sys, w, h);
                continue;
            }
            if lowest {
                self.last.step = None; // a bad prediction is not tried twice
            }
            let why = if finite {
                let f = &self.points.f[s - 1];
                let row = (0..sys.n).max_by(|&i, &j| f[i].abs().total_cmp(&f[j].abs())).unwrap_or(0);
                Failure::Diverged { unknown, row }
            } else {
                Failure::NotFinite { unknown }
            };
            let next = match lowest {
                true if self.first && self.stuck > 2 && !sys.turns() => LOST * h,
                true => h / 4.0,
                false => h / 2.0,
            };
            return Attempt::Stuck { next, why: why.into() };
        }
    }

    fn accept(&mut self, t1: f64) {
        self.last.step = Some((self.start.t, self.h, self.scheme));
        std::mem::swap(&mut self.last.x0, &mut self.start.x);
        std::mem::swap(&mut self.last.e, &mut self.estimate.e);
        std::mem::swap(&mut self.last.stage, &mut self.points.x);
        self.start.t = t1;
        self.last.bent = std::mem::take(&mut self.start.bent);
        self.start.x.copy_from_slice(&self.last.stage[self.scheme.s - 1]);
        self.scheme = self.next_scheme;
        self.proposed = self.proposed_next;
        self.control.accept();
        self.start.known = false;
        self.newton.level *= FORGET;
        self.last.anew = std::mem::take(&mut self.first);
        self.estimate.at_first = None;
        self.accepted = true;
        self.newton.foresee = true;
        self.stuck = 0;
    }

    fn candidate(&self) -> &[f64] {
        if self.accepted {
            &self.start.x
        } else {
            &self.points.x[self.scheme.s - 1]
        }
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let (t0, h, scheme, x0, stage, e, bent, anew) = match self.last.step {
            Some((t0, h, scheme)) if self.accepted => {
                (t0, h, scheme, &self.last.x0, &self.last.stage, &self.last.e, self.last.bent, self.last.anew)
            }
            _ => (
                self.start.t,
                self.h,
                self.scheme,
                &self.start.x,
                &self.points.x,
                &self.estimate.e,
                self.start.bent,
                self.first,
            ),
        };
        let theta = (t - t0) / h;
        if bent || anew {
            // what is algebraic at the start of this step, or is over long before its end, belongs to the curve before the corner
            dense::extrapolate(scheme, theta, x0, stage, &self.estimate.smooth, out);
        } else {
            dense::polynomial(scheme, theta, x0, stage, out);
        }
        let correction = scheme.gamma * dense::correction(scheme, theta);
        let smooth = |i: usize| !(bent || anew) || self.estimate.smooth[i];
        for (i, (o, e)) in out.iter_mut().zip(e).enumerate() {
            if self.estimate.corrected[i] && smooth(i) {
                *o += correction * e;
            }
        }
    }

    /// The divided difference over one point more, the start of the last step, tells what the polynomial lacks. What is
    /// stiff or algebraic is not seen by the error estimate: its stages are right, but the curve between them may be a
    /// corner that no polynomial follows, and of the corner of a diode that measure tells a tenth. Behind a corner of the sources
    /// that point is of another curve; where all is linear, the error estimate, of the polynomial's order, says it as well.
    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        let Some((start, ..)) = self.last.step.filter(|_| !self.accepted) else { return f64::INFINITY };
        if self.start.bent {
            return self.estimate.of_step;
        }
        let scheme = self.scheme;
        let before = (start - self.start.t) / self.h;
        let l = dense::weights(scheme, before);
        let theta = dense::weakest(scheme);
        let corner = if sys.turns() { CORNER } else { 1.0 };
        let lacking = corner * dense::nodal(scheme, theta) / dense::nodal(scheme, before);
        let correction = scheme.gamma * dense::correction(scheme, theta);
        let mut there = std::mem::take(&mut self.scratch);
        blend::through(scheme, &l, &self.start.x, &self.points.x, &mut there);
        let end = &self.points.x[scheme.s - 1];
        let mut worst = 0.0_f64;
        for i in sys.interpolated() {
            let mut error = lacking * (self.last.x0[i] - there[i]);
            if self.estimate.corrected[i] {
                error -= correction * self.estimate.e[i];
            }
            worst = worst.max(error.abs() / tol.weight(i, self.start.x[i], end[i]));
        }
        self.scratch = there;
        worst
    }

    fn stages(&self) -> Stages<'_> {
        let Some((t, h, scheme)) = self.last.step else { return Stages::default() };
        let nodes = scheme.c.iter().zip(&self.last.stage).map(|(c, x)| (t + c * h, x.as_slice()));
        Stages { at: nodes.collect(), weights: dense::quarters(scheme) }
    }

    /// What the step control knows of the error's growth was of the other side.
    fn corner(&mut self) {
        self.control.restart();
        self.start.bent = self.pure_linear;
        self.start.known = false;
    }
}
