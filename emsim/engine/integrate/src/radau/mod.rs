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
mod tables;

use self::estimate::share;
use self::full::FullNewton;
use self::order::{contracting, Orders, Taken, CONTRACTION};
use self::tables::Scheme;
use super::control::{Controller, Tried};
use super::rows::Lags;
use super::{Attempt, Character, Method, Response};
use crate::ledger::Stages;
use crate::newton::{Failure, Noise, Options, Tolerances};
use crate::sparse::{Complex, Lu};
use crate::system::{Kind, System, Work};

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

/// Where the rounding of an algebraic unknown comes from: what is stored in the rows that it stands in, over h.
#[derive(Clone, Copy)]
enum Stored {
    Charge,
    Momentum,
}

pub struct Radau {
    scheme: &'static Scheme,
    next_scheme: &'static Scheme,
    orders: Orders,
    real: Lu<f64>,
    complex: Vec<Lu<Complex>>, // one for each pair of eigenvalues, made when first needed
    real_matrix: Vec<f64>,
    complex_matrix: Vec<Complex>,
    factored: Option<(f64, usize)>, // step and number of stages
    jacobian_at: f64,
    foresee: bool, // the Jacobian is, or may be, that of a predicted state
    gv: Vec<f64>,
    cv: Vec<f64>,
    slopes: Vec<(f64, f64)>, // of the diodes in these
    t0: f64,
    h: f64,
    x0: Vec<f64>,
    q0: Vec<f64>,
    f0: Vec<f64>,
    still: Vec<f64>, // f0 without the sources, of linear equations
    started: bool,   // f0, q0, still hold
    stage: Vec<Vec<f64>>,
    waves: Vec<Vec<f64>>, // of sources, at the times of the stages
    d: Vec<Vec<f64>>,
    f: Vec<Vec<f64>>, // F of the stages, and Q behind it
    e: Vec<f64>,
    b: Vec<f64>,
    z: Vec<Vec<Complex>>,
    scratch: Vec<f64>,
    moved: Vec<f64>, // largest part of the last update, of each unknown
    // the accepted step, for prediction and dense output after acceptance
    last: Option<(f64, f64, &'static Scheme)>,
    last_stage: Vec<Vec<f64>>,
    last_x0: Vec<f64>,
    last_e: Vec<f64>,
    accepted: bool,
    theta: f64,       // of the last iteration: is the Jacobian still good?
    contraction: f64, // of the last two: is the order too high?
    control: Controller,
    at_first: Option<(f64, f64)>, // length and error estimate of the first attempt from here that was refused
    unfiltered: f64,              // the last error estimate before it was filtered
    stuck: u32,
    proposed: f64,
    proposed_next: f64,
    first: bool,
    fixed: bool,
    pure_linear: bool,
    bent: bool,                    // all is linear, and the sources bend at t0
    last_bent: bool,               // at the start of the last step
    estimate: f64,                 // of this step's error, in units of the tolerance
    corrected: Vec<bool>,          // by the error estimate, in dense output
    given: Vec<bool>,              // unknowns that have what a source has
    full: Option<Box<FullNewton>>, // made when first needed
    full_steps: u32,               // so many steps more begin with it
    relax: f64,                    // the error is divided by this where rounding keeps the tolerance out of reach
    noise: f64,                    // what rounding left of the last update of the full Newton method
    noises: Noise,                 // what rounding does to every unknown, where it was asked for
    linear: Vec<(usize, Stored)>,  // unknowns in no norm that have a scale: what their rounding comes from
    stored: [f64; 2],              // largest charge and momentum at x0
    behind: f64,                   // largest last update of such an unknown, in units of its scale
    grown: f64,                    // the last update in units of what was there before it
    level: f64,                    // where rounding has lately stopped the iteration
    longest: f64,                  // recent step length
    smooth: Vec<bool>,             // what is on one curve with the start, of a step that begins anew
    last_anew: bool,               // the last step began so
    characters: [Character; 3],    // by the number of stages
    probe: Option<(f64, f64)>,     // step and error that a step of a quarter is compared with
}

impl Radau {
    /// `name`: radau, radau5, radau9 or radau13.
    pub fn new(sys: &System, o: &Options, name: &str) -> Result<Radau, Failure> {
        let nnz = sys.pattern.rowidx.len();
        let real = Lu::new(sys.symbolic().map_err(Failure::from)?);
        let orders = Orders::new(name, o.fixed_step.is_some(), o.reltol, sys);
        let most = orders.most().s;
        let v = || vec![0.0; sys.n];
        let stages = || vec![vec![0.0; sys.n]; most];
        // the estimate means nothing for an algebraic unknown (linearised where the curve may bend sharply)
        let corrected: Vec<bool> = (sys.unknowns.iter().zip(&sys.differential))
            .map(|(u, &moves)| moves && !u.kind.enters_linearly())
            .collect();
        let smooth = corrected.clone();
        let characters = character(sys.pure_linear, o.fixed_step.is_some());
        let linear = (sys.unknowns.iter().zip(&sys.differential).enumerate())
            .filter_map(|(i, (u, &moves))| match u.kind {
                Kind::Lambda => Some((i, Stored::Momentum)),
                Kind::Branch if !moves => Some((i, Stored::Charge)),
                _ => None,
            })
            .collect();
        Ok(Radau {
            scheme: orders.first(),
            next_scheme: orders.first(),
            orders,
            real,
            complex: Vec::new(),
            real_matrix: vec![0.0; nnz],
            complex_matrix: vec![Complex::from(0.0); nnz],
            factored: None,
            jacobian_at: f64::NAN,
            foresee: true,
            gv: vec![0.0; nnz],
            cv: vec![0.0; nnz],
            slopes: Vec::new(),
            t0: 0.0,
            h: 0.0,
            x0: v(),
            q0: v(),
            f0: v(),
            still: v(),
            started: false,
            stage: stages(),
            waves: vec![Vec::new(); most],
            d: stages(),
            f: vec![vec![0.0; 2 * sys.n]; most],
            e: v(),
            b: v(),
            z: vec![vec![Complex::from(0.0); sys.n]; (most - 1) / 2],
            scratch: v(),
            moved: v(),
            last: None,
            last_stage: stages(),
            last_x0: v(),
            last_e: v(),
            accepted: false,
            theta: 1.0,
            contraction: 1.0,
            control: Controller::new(true),
            at_first: None,
            unfiltered: 0.0,
            stuck: 0,
            proposed: 0.0,
            proposed_next: 0.0,
            first: true,
            fixed: o.fixed_step.is_some(),
            pure_linear: sys.pure_linear,
            bent: false,
            last_bent: false,
            estimate: 0.0,
            corrected,
            given: sys.alone(),
            full: None,
            full_steps: 0,
            relax: 1.0,
            noise: 0.0,
            noises: Noise::new(sys.n),
            linear,
            stored: [0.0; 2],
            behind: 0.0,
            grown: 0.0,
            level: 0.0,
            longest: 0.0,
            smooth,
            last_anew: false,
            characters,
            probe: None,
        })
    }

    /// Derivatives for a step of h from here: at its middle as the last step's polynomial foresees it, since the stages
    /// lie on both sides of that; at x0 where there is no such foresight.
    fn jacobian(&mut self, sys: &System, w: &mut Work, h: f64) {
        if self.jacobian_at == self.t0 || (sys.linear && !self.jacobian_at.is_nan()) {
            return;
        }
        let (mut t, mut x) = (self.t0, &self.x0);
        match self.last {
            Some((start, last_h, last)) if h < FORESIGHT * last_h && !sys.linear && self.foresee => {
                t = self.t0 + 0.5 * h;
                let theta = (t - start) / last_h;
                let moves = &sys.differential;
                dense::extrapolate(last, theta, &self.last_x0, &self.last_stage, moves, &mut self.scratch);
                // far up an exponential everything looks solved: the update is next to nothing whatever is missing
                if sys.within_reach(&self.x0, &self.scratch) {
                    x = &self.scratch;
                } else {
                    t = self.t0;
                }
            }
            _ => self.foresee = false,
        }
        sys.eval_jacobian(w, x, t, false);
        self.keep_derivatives(sys, w);
        self.jacobian_at = self.t0;
    }

    fn keep_derivatives(&mut self, sys: &System, w: &Work) {
        self.gv.copy_from_slice(&w.gv);
        self.cv.copy_from_slice(&w.cv);
        self.slopes.clear();
        self.slopes.extend(sys.slopes(w));
        self.factored = None;
    }

    fn factor(&mut self, sys: &System, w: &mut Work, h: f64) -> Result<(), Failure> {
        let scheme = self.scheme;
        if self.factored == Some((h, scheme.s)) {
            return Ok(());
        }
        self.factored = None;
        let a = scheme.gamma / h;
        for ((m, g), c) in self.real_matrix.iter_mut().zip(&self.gv).zip(&self.cv) {
            *m = g + a * c;
        }
        self.real.factor_or_refactor(&self.real_matrix).map_err(Failure::from)?;
        for (k, (alpha, beta)) in scheme.alpha.iter().zip(scheme.beta).enumerate() {
            if self.complex.len() == k {
                let symbolic = sys.symbolic().map_err(Failure::from)?;
                self.complex.push(Lu::new(symbolic));
            }
            let z = Complex::new(alpha / h, beta / h);
            for ((m, g), c) in self.complex_matrix.iter_mut().zip(&self.gv).zip(&self.cv) {
                *m = Complex::new(g + z.re * c, z.im * c);
            }
            self.complex[k].factor_or_refactor(&self.complex_matrix).map_err(Failure::from)?;
        }
        w.counters.factorisations += 1 + scheme.alpha.len() as u64;
        self.factored = Some((h, scheme.s));
        Ok(())
    }

    /// What a step that begins anew has on one curve with its start, to the tolerance: a transient, and what algebraic unknowns were,
    /// is not; the node of a source is, however far its curve bends within the step. Steps of one length keep to
    /// no tolerance: there the start is to lie as near to the curve through the stages as the one through all but the first of them does.
    fn find_smooth(&mut self, tol: &Tolerances) {
        let (back, fewer, s) = (dense::back(self.scheme), dense::back_without_first(self.scheme), self.scheme.s);
        let at_start = |weights: &[f64], stages: &[Vec<f64>], i: usize| {
            weights.iter().zip(stages).map(|(l, x)| l * x[i]).sum::<f64>()
        };
        for i in 0..self.x0.len() {
            let start = at_start(back, &self.stage, i);
            let off = (self.x0[i] - start).abs();
            let allowed = tol.weight(i, self.x0[i], self.stage[s - 1][i]);
            self.smooth[i] = if self.fixed {
                off <= allowed.max((start - at_start(fewer, &self.stage[1..], i)).abs())
            } else {
                self.corrected[i] && (self.given[i] || off <= allowed)
            };
        }
    }

    /// Judges a step whose stages are solved; the full Newton method leaves the derivatives of its end where there are diodes.
    fn judge(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances, iterations: usize) -> Attempt {
        let turned = sys.turns() && self.jacobian_at.is_nan();
        let mut estimate = self.error(sys, w, h, tol);
        if turned {
            estimate = estimate.max(share(tol.reltol) * self.end_error(sys, w, h, tol));
        }
        self.estimate = estimate;
        if self.first || self.bent {
            self.find_smooth(tol);
        }
        let raw = (estimate / share(tol.reltol)).max(1e-10);
        self.next_scheme = self.scheme;
        if self.fixed {
            return Attempt::Good { next: h };
        }
        if self.rounding(h, estimate, raw, tol) {
            return Attempt::TooLarge { next: 0.25 * h };
        }
        let error = raw / self.relax.max(10.0 * std::mem::take(&mut self.noise));
        let tried = Tried { h, error, power: self.scheme.s + 1 };
        if error <= 1.0 {
            self.longest = h.max(0.98 * self.longest);
            self.relax = (0.999 * self.relax).max(1.0);
            let seen = self.contraction > 0.0 && self.full_steps == 0;
            let contracts = if seen { contracting(self.contraction) } else { f64::INFINITY };
            // what took many iterations lies far from where it was looked for (Hairer and Wanner, equation (IV.8.22))
            let most = 2.0 * MOST_ITERATIONS as f64 + 1.0;
            let found = most / (most - 1.0 + iterations as f64);
            let factor = (found * self.control.judge(tried, false).next() / h).min(contracts);
            if self.full_steps == 0 && self.orders.due(self.scheme) {
                let taken = Taken {
                    h,
                    iterations,
                    contraction: self.contraction,
                    contracts,
                    error: estimate,
                    lower: self.lower_error(sys, w, h, tol),
                    longest: if h < 0.9 * self.proposed { h } else { f64::INFINITY },
                    linear: sys.linear,
                };
                let (scheme, step) = self.orders.next(self.scheme, &taken, tol.reltol, &self.real);
                self.next_scheme = scheme;
                if let Some(step) = step {
                    self.proposed_next = step;
                    return Attempt::Good { next: step };
                }
            }
            // keep step and factorisation while that costs little
            let keep = self.theta < REUSE || sys.linear;
            let next = if keep && (1.0..1.2).contains(&factor) { h } else { factor * h };
            self.proposed_next = next;
            return Attempt::Good { next };
        }
        let refused = match self.at_first {
            _ if !self.first => self.control.refuse(tried),
            Some(_) if !sys.turns() => Attempt::TooLarge { next: LOST * h },
            _ => self.control.refuse(Tried { error: f64::INFINITY, ..tried }),
        };
        self.at_first = self.at_first.or(Some((h, estimate)));
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
        self.last.map_or(self.scheme, |(_, _, scheme)| scheme).s
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
        self.t0 = t;
        self.x0.copy_from_slice(x);
        self.scheme = self.orders.anew();
        self.started = false;
        self.jacobian_at = f64::NAN;
        self.factored = None;
        self.last = None;
        self.first = true;
        self.last_anew = false;
        self.at_first = None;
        self.theta = 1.0;
        self.accepted = false;
        self.foresee = true;
        self.stuck = 0;
        self.proposed = 0.0;
        self.control.restart();
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if !self.started {
            sys.eval(w, &self.x0, self.t0);
            self.q0.copy_from_slice(&w.q);
            self.f0.copy_from_slice(&w.f);
            if sys.pure_linear {
                self.still.copy_from_slice(&w.f);
                sys.subtract_waves(w, &mut self.still);
            }
            self.started = true;
            let largest = |of: fn(Kind) -> bool| {
                let q = self.q0.iter().zip(&sys.unknowns).filter(|(_, u)| of(u.kind));
                q.fold(0.0, |m: f64, (q, _)| m.max(q.abs()))
            };
            self.stored = [largest(|k| k == Kind::Node), largest(|k| k == Kind::Speed)];
        }
        self.accepted = false;
        self.h = h;
        // an old Jacobian serves while the iteration contracts fast
        // (updates at the level of rounding say nothing of the Jacobian; if those before contracted too little to go on with this length, it
        // is renewed: with one of another time they contract no better in shorter steps, down to none)
        if self.theta >= REUSE || self.contraction > CONTRACTION || self.jacobian_at.is_nan() {
            self.jacobian(sys, w, h);
        }
        loop {
            if let Err(why) = self.factor(sys, w, h) {
                return Attempt::Stuck { next: h / 4.0, why: why.into() };
            }
            let mut solved = Err((0, true));
            if self.full_steps == 0 {
                solved = if sys.pure_linear {
                    self.linear_stages(sys, w, h)
                } else {
                    self.predict(sys, h);
                    self.stages(sys, w, h, tol)
                };
            }
            let lowest = self.scheme.s == 3;
            // frozen derivatives cannot follow an exponential: the stages together, each with its own
            let stale = self.jacobian_at != self.t0 || (self.foresee && lowest);
            if matches!(solved, Err((_, true))) && (self.full_steps > 0 || !stale) && !sys.linear && lowest {
                self.predict(sys, h);
                solved = self.full_newton(sys, w, h, tol);
                if solved.is_ok() {
                    self.full_steps = match self.full_steps {
                        0 if sys.turns() => FULL_STEPS,
                        more => more.saturating_sub(1),
                    };
                    (self.theta, self.contraction) = (1.0, 0.0);
                } else {
                    self.full_steps = 0;
                }
            }
            let (unknown, finite) = match solved {
                Ok(iterations) => return self.judge(sys, w, h, tol, iterations),
                Err(stuck) => stuck,
            };
            self.theta = 1.0;
            let failed = self.jacobian_at;
            self.jacobian_at = f64::NAN;
            if stale && finite {
                // once more with the derivatives of this step; at the last order with those of its start
                self.foresee &= failed != self.t0;
                self.jacobian(sys, w, h);
                continue;
            }
            let s = self.scheme.s;
            self.foresee = true;
            self.stuck += 1;
            if finite && !lowest && self.stuck > 1 {
                self.scheme = self.orders.fall();
                self.jacobian(sys, w, h);
                continue;
            }
            if lowest {
                self.last = None; // a bad prediction is not tried twice
            }
            let why = if finite {
                let f = &self.f[s - 1];
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
        self.last = Some((self.t0, self.h, self.scheme));
        std::mem::swap(&mut self.last_x0, &mut self.x0);
        std::mem::swap(&mut self.last_e, &mut self.e);
        std::mem::swap(&mut self.last_stage, &mut self.stage);
        self.t0 = t1;
        self.last_bent = std::mem::take(&mut self.bent);
        self.x0.copy_from_slice(&self.last_stage[self.scheme.s - 1]);
        self.scheme = self.next_scheme;
        self.proposed = self.proposed_next;
        self.control.accept();
        self.started = false;
        self.level *= FORGET;
        self.last_anew = std::mem::take(&mut self.first);
        self.at_first = None;
        self.accepted = true;
        self.foresee = true;
        self.stuck = 0;
    }

    fn candidate(&self) -> &[f64] {
        if self.accepted {
            &self.x0
        } else {
            &self.stage[self.scheme.s - 1]
        }
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let (t0, h, scheme, x0, stage, e, bent, anew) = match self.last {
            Some((t0, h, scheme)) if self.accepted => {
                (t0, h, scheme, &self.last_x0, &self.last_stage, &self.last_e, self.last_bent, self.last_anew)
            }
            _ => (self.t0, self.h, self.scheme, &self.x0, &self.stage, &self.e, self.bent, self.first),
        };
        let theta = (t - t0) / h;
        if bent || anew {
            // what is algebraic at the start of this step, or is over long before its end, belongs to the curve before the corner
            dense::extrapolate(scheme, theta, x0, stage, &self.smooth, out);
        } else {
            dense::polynomial(scheme, theta, x0, stage, out);
        }
        let correction = scheme.gamma * dense::correction(scheme, theta);
        let smooth = |i: usize| !(bent || anew) || self.smooth[i];
        for (i, (o, e)) in out.iter_mut().zip(e).enumerate() {
            if self.corrected[i] && smooth(i) {
                *o += correction * e;
            }
        }
    }

    /// The divided difference over one point more, the start of the last step, tells what the polynomial lacks. What is
    /// stiff or algebraic is not seen by the error estimate: its stages are right, but the curve between them may be a
    /// corner that no polynomial follows, and of the corner of a diode that measure tells a tenth. Behind a corner of the sources
    /// that point is of another curve; where all is linear, the error estimate, of the polynomial's order, says it as well.
    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        let Some((start, ..)) = self.last.filter(|_| !self.accepted) else { return f64::INFINITY };
        if self.bent {
            return self.estimate;
        }
        let scheme = self.scheme;
        let before = (start - self.t0) / self.h;
        let l = dense::weights(scheme, before);
        let theta = dense::weakest(scheme);
        let corner = if sys.turns() { CORNER } else { 1.0 };
        let lacking = corner * dense::nodal(scheme, theta) / dense::nodal(scheme, before);
        let correction = scheme.gamma * dense::correction(scheme, theta);
        let mut there = std::mem::take(&mut self.scratch);
        blend::through(scheme, &l, &self.x0, &self.stage, &mut there);
        let end = &self.stage[scheme.s - 1];
        let mut worst = 0.0_f64;
        for i in sys.interpolated() {
            let mut error = lacking * (self.last_x0[i] - there[i]);
            if self.corrected[i] {
                error -= correction * self.e[i];
            }
            worst = worst.max(error.abs() / tol.weight(i, self.x0[i], end[i]));
        }
        self.scratch = there;
        worst
    }

    fn stages(&self) -> Stages<'_> {
        let Some((t, h, scheme)) = self.last else { return Stages::default() };
        let nodes = scheme.c.iter().zip(&self.last_stage).map(|(c, x)| (t + c * h, x.as_slice()));
        Stages { at: nodes.collect(), weights: dense::quarters(scheme) }
    }

    /// What the step control knows of the error's growth was of the other side.
    fn corner(&mut self) {
        self.control.restart();
        self.bent = self.pure_linear;
        self.started = false;
    }
}
