//! Diagonally implicit Runge-Kutta methods with an explicit first stage, on equation (1); one file of coefficients each.
//!
//! Stage i of a step from (t0, x0), with F_1 = F(x0, t0) known and a_ii = gamma in every other stage:
//!
//!   Q(X_i) = Q(x0) - h sum_{j<=i} a_ij F_j        rows with d/dt
//!   F(X_i, t0 + c_i h) = 0                        rows without
//!
//! which is  F + a Q + r = 0  with  a = 1/(gamma h): one real factorisation serves all stages, and Newton's method leaves F_i
//! = -(a Q_i + r_i) as the stage equation gives it, so that charge is kept to rounding and nothing is differentiated.
//! The methods here are stiffly accurate (the last stage is the new point: algebraic rows hold there, and its F is the next
//! step's first) and L-stable: what is wrong with F_1 in a row whose F holds an index-2 unknown (a multiplier, the
//! current of a capacitor across a source) reaches neither the new point nor its F, since R(infinity) = 0.
//!
//! Error: the charges that the embedded formula gives are h sum_j d_j F_j away, d = b - b^; as unknowns, with what is damped
//! at once taken out,  e = (G + a C)^-1 a h sum_j d_j F_j  (Hosea and Shampine 1996, section 4), one solution. The voltage that a source
//! gives has no error, but the current of a capacitor there does, and rows that do not compute it anew show it: its charges are held
//! to what they would be worth as voltages.
//!
//! A step that begins with a jump is one of a method without an explicit stage, of the same order and gamma (`sdirk`): a switch has
//! opened, and what stands at the start, 24 V across a junction that the coil's current turns round within a nanosecond, would be
//! in the sums of the step with the weight b_1, and with changing sign in every stage. Without it all stages are behind the
//! transient, and the step may be as long as what follows allows; what the others lose by it is estimated, see `leap`.
//!
//! Accounts of energy are sums over the stages with the weights b. A step with an explicit stage that begins with a transient too
//! fast to be followed has it there and, with changing sign, in the stages after it; only its end is free of it. One
//! implicit Euler step to h/3 and the end make up a rule of order 3 then. (Where no stage stands at the start the weights are right: by
//! that rule 5e-4 of a buck converter's energy was unaccounted at 1e-5, 7e-5 by theirs.)
//!
//! The right root: a nonlinear stage may have several solutions. The one that begins at the step's start, h = 0, is lost where
//! G + a C turns singular on the way: an eigenvalue of growth, lambda > a, whose step is far too long, or a root on the other
//! side of such a place. One that passes it alone changes the sign of the determinant (Robertson's kinetics, where a
//! concentration below the tolerance came out negative, and ran away). Such a step is tried again, shorter, and from then on every
//! stage is solved once more: roots that lie within the tolerance of each other want more than the tolerance.
//!
//! Dense output: sum_j w_j(theta) X_j, weights that are polynomials in theta = (t - t0)/h with the method's own order.
//! In stage values rather than slopes it serves every unknown, algebraic ones too.
mod esdirk;
mod formula;
mod sdirk;
#[cfg(test)]
mod tests;
mod transient_skip;
mod trbdf2;

use super::control::{Controller, Tried};
use super::rows::Lags;
use super::{response, weighted_sum, Attempt, Character, Method, Response};
use crate::ledger::Stages;
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};
use formula::{Formula, Tableau};

/// How far the polynomial is carried back to be compared, in steps.
const BACK: f64 = 0.2;
/// Longest step that is tried to get over a fast mode, in units of the one refused.
const LEAP: f64 = 8.0;

/// An estimate that stays as it is at this share of the step does not fall with it.
const STAYS: f64 = 0.02;
/// An error beside a junction moves the instant at which it turns, and with it all that follows: so much of it is allowed.
const JUNCTIONS: f64 = 0.7;

/// A step that has changed the determinant's sign is shortened so often, by four; then the sign counts as that of the equations:
/// what they give without d/dt may have several solutions of its own.
const TURNS: u32 = 3;

pub fn trbdf2(sys: &System, o: &Options) -> Result<Dirk, Failure> {
    let mut next = trbdf2::tableau();
    if sys.linear && sys.has_coils() {
        next.local *= ADDED_UP * (o.reltol / ORDINARY).min(1.0).sqrt();
    }
    Dirk::new(sys, o, next, sdirk::order2())
}

pub fn esdirk(sys: &System, o: &Options) -> Result<Dirk, Failure> {
    Dirk::new(sys, o, esdirk::tableau(), sdirk::order4())
}

/// Beside diodes: the stages see a crest that takes two or three of these steps (zener_regulator under trbdf2 at 1e-5: 1e-4 of the
/// range without, 3e-6 with them).
const IN_A_PERIOD: f64 = 24.0;

/// What rings adds up the errors of all steps, and the tighter the tolerance the more steps there are: of a method of order 2 each is
/// held to less by the root of reltol, and by this at what is ordinary.
const ADDED_UP: f64 = 0.7;
const ORDINARY: f64 = 1e-3;

/// A step that follows another, a step that begins with a jump.
const NEXT: usize = 0;
const FIRST: usize = 1;

/// A step's start, length and stage values.
struct Step {
    t: f64,
    h: f64,
    x: Vec<Vec<f64>>,
    by: usize, // which formula
}

impl Step {
    /// Is unknown i at a stage farther from the start than the tolerance?
    fn moves(&self, i: usize, stage: usize, tol: &Tolerances) -> bool {
        let (x1, x0) = (self.x[stage][i], self.x[0][i]);
        (x1 - x0).abs() > tol.weight(i, x1, x0)
    }
}

pub struct Dirk {
    character: Character,
    k: [Formula; 2], // of steps that follow another, of steps that begin with a jump
    newton: Newton,
    q0: Vec<f64>,
    f: Vec<Vec<f64>>, // of every stage
    begun: bool,
    jumped: bool,  // something may have, where `now` begins
    started: bool, // q0 and f[0] hold
    now: Step,
    last: Step,
    solved: bool,                 // `now` holds stage values of a step from its t
    follows: bool,                // `last` ends where `now` begins, with nothing in between
    accepted: bool,               // `last` is the step that dense output is asked of
    refused: Option<(f64, f64)>,  // length and error of the last attempt from here
    at_first: Option<(f64, f64)>, // ... of the first one
    leapt: bool,
    control: Controller,
    guess: Vec<Vec<f64>>,
    r: Vec<f64>,
    e: Vec<f64>,
    given: Vec<(usize, f64)>, // nodes that have what a source has, and their capacitance
    most: usize,
    fixed: bool,
    t1: f64,
    accounts: bool,
    turns: Turns,
    skip: transient_skip::Skip,
    renewed: bool, // x0 is not what f[0] was computed at
}

/// Does the determinant of the stages change its sign? Then they may have more than one solution.
#[derive(Default)]
struct Turns {
    negative: Option<bool>, // since the last restart
    count: u32,             // steps from here that changed it
    several: bool,          // such a step was met
}

/// Are derivatives and multipliers of a lower order than the state?
fn lags(k: &Tableau) -> bool {
    k.falls > 3
}

fn given(sys: &System) -> Vec<(usize, f64)> {
    let alone = sys.alone().into_iter().enumerate().filter(|&(_, alone)| alone);
    alone
        .map(|(i, _)| (i, sys.own_capacitance(i)))
        .filter(|&(i, c)| c > 0.0 && sys.unknowns[i].kind == Kind::Node)
        .collect()
}

impl Dirk {
    fn new(sys: &System, o: &Options, next: Tableau, first: Tableau) -> Result<Dirk, Failure> {
        let v = || vec![0.0; sys.n];
        let s = next.c.len();
        let lags = if lags(&next) { Lags::Index } else { Lags::Forces };
        let step = || Step { t: 0.0, h: 0.0, x: vec![v(); s], by: NEXT };
        Ok(Dirk {
            character: Character {
                steps_a_period: Some(IN_A_PERIOD),
                full_length: true,
                begins_with_slopes: true,
                restarts_at_corners: false,
                lags: Lags::unless(o.fixed_step.is_some(), lags),
                leaps: true,
                ..Character::DENSE
            },
            newton: Newton::new(sys)?,
            q0: v(),
            f: vec![v(); s],
            begun: false,
            jumped: false,
            started: false,
            now: step(),
            last: step(),
            solved: false,
            follows: false,
            accepted: false,
            refused: None,
            at_first: None,
            leapt: false,
            control: Controller::new(sys.turns()),
            guess: vec![v(); s],
            r: v(),
            e: v(),
            given: if lags == Lags::Index { Vec::new() } else { given(sys) },
            most: o.itl4,
            fixed: o.fixed_step.is_some(),
            t1: 0.0,
            accounts: o.accounts,
            turns: Turns::default(),
            skip: transient_skip::Skip::new(sys.n),
            renewed: false,
            k: [Formula::new(next), Formula::new(first)],
        })
    }

    /// Coefficients of the attempted step.
    fn tableau(&self) -> &Tableau {
        &self.k[self.now.by].k
    }

    /// sum_j w_j(theta) X_j
    fn polynomial(&self, of: &Step, theta: f64, out: &mut [f64]) {
        let weights = || self.k[of.by].k.weights_at(theta);
        weighted_sum(weights().zip(&of.x).map(|(w, x)| (w, x.as_slice())), out);
        if of.by == FIRST {
            self.unspread(weights(), out);
        }
    }

    /// First guess of stage i: the line or parabola through the stages found so far in this step, that follows a jump at
    /// its start; for the first one, the last step's dense output extrapolated, where there is such a step. (Newton's
    /// iterations on a buck, a boost converter and a diode bridge at 1e-3: 10800, 9100, 1900 with the last step's
    /// polynomial or the start for every stage, 7300, 6200, 1300 so.)
    fn predict(&self, i: usize, h: f64, guess: &mut [f64]) {
        if i == 1 {
            if self.follows {
                self.polynomial(&self.last, 1.0 + self.tableau().c[1] * h / self.last.h, guess);
            } else {
                guess.copy_from_slice(&self.now.x[0]);
            }
            return;
        }
        weighted_sum(self.k[self.now.by].ahead[i].iter().map(|&(j, l)| (l, self.now.x[j].as_slice())), guess);
    }

    fn stages(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<(), Failure> {
        // the same step, shorter (an event lies inside, or the error was too large): its stages lie on the one just tried
        let mut guess = std::mem::take(&mut self.guess);
        let known = self.solved && h < self.now.h && !sys.pure_linear;
        if !known && !self.follows {
            self.now.by = if self.jumped { FIRST } else { NEXT };
        }
        let a = self.newton.recurring(1.0 / (self.tableau().a[0][1] * h), self.t1, h);
        if known {
            for (c, g) in self.tableau().c.iter().zip(&mut guess).skip(1) {
                self.polynomial(&self.now, c * h / self.now.h, g);
            }
        }
        self.now.h = h;
        self.solved = false;
        let mut result = Ok(());
        let (mut i, mut predicted) = (1, known || sys.pure_linear);
        while i < guess.len() {
            let (g, k) = (&mut guess[i], &self.k[self.now.by].k);
            let row = &k.a[i - 1];
            // rows without d/dt have neither Q nor F here
            weighted_sum(row[..i].iter().zip(&self.f).map(|(&a, f)| (a, f.as_slice())), &mut self.r);
            for (r, q0) in self.r.iter_mut().zip(&self.q0) {
                *r = -a * (q0 - h * *r);
            }
            let t = if i + 1 == k.c.len() { self.t1 } else { self.now.t + k.c[i] * h };
            if !predicted {
                self.predict(i, h, g);
            }
            std::mem::swap(&mut self.now.x[i], g);
            result = self.newton.solve(sys, w, a, &self.r, &mut self.now.x[i], t, tol, self.most).map(|_| ());
            if result.is_err() {
                // a jump carried further than an exponential bears: from the stage before it, once more
                let (before, now) = self.now.x.split_at_mut(i);
                now[0].copy_from_slice(&before[i - 1]);
                result = self.newton.solve(sys, w, a, &self.r, &mut now[0], t, tol, self.most).map(|_| ());
            }
            if result.is_ok() && self.turns.several {
                result = self.newton.solve(sys, w, a, &self.r, &mut self.now.x[i], t, tol, self.most).map(|_| ());
            }
            if result.is_ok() && !sys.linear && self.turns() {
                let unknown = self.farthest(i, tol);
                result = Err(Failure::Diverged { unknown, row: unknown });
            }
            if result.is_err() {
                break;
            }
            if i == 1 && self.now.by == FIRST && !self.leaps_over(h, tol) {
                // nothing jumps here
                self.now.by = NEXT;
                self.continue_to_first_stage(&mut guess[1]);
                predicted = true;
                continue;
            }
            predicted = known || sys.pure_linear;
            self.f[i].copy_from_slice(self.newton.f());
            i += 1;
        }
        self.guess = guess;
        self.solved = result.is_ok();
        result
    }

    /// Has the determinant another sign than in the steps before? After `TURNS` such steps it is taken for the equations' own.
    fn turns(&mut self) -> bool {
        let negative = self.newton.negative();
        let turns = self.turns.negative.is_some_and(|before| before != negative) && self.turns.count < TURNS;
        if turns {
            self.turns.count += 1;
            self.turns.several = true;
        } else {
            self.turns.negative = Some(negative);
        }
        turns
    }

    /// What has gone farthest from the step's start to stage i.
    fn farthest(&self, i: usize, tol: &Tolerances) -> usize {
        let (x, x0) = (&self.now.x[i], &self.now.x[0]);
        let way = |k: usize| tol.norm_mask[k] * (x[k] - x0[k]).abs() / tol.weight(k, x[k], x0[k]);
        (0..x.len()).max_by(|&k, &l| way(k).total_cmp(&way(l))).unwrap_or(0)
    }

    /// The states that accounts of a step with a transient go by; Q of the candidate stays where it is.
    fn calm(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) {
        let third = h / 3.0;
        for (r, q) in self.r.iter_mut().zip(&self.q0) {
            *r = -q / third;
        }
        let end = &self.now.x[self.now.x.len() - 1];
        let (early, late) = self.skip.calm.split_at_mut(1);
        late[0].0 = self.t1;
        late[0].1.copy_from_slice(end);
        early[0].0 = self.now.t + third;
        early[0].1.copy_from_slice(end);
        let q = self.newton.q().to_vec();
        let t = early[0].0;
        if self.newton.solve(sys, w, 1.0 / third, &self.r, &mut early[0].1, t, tol, self.most).is_err() {
            early[0].1.copy_from_slice(end);
        }
        self.newton.put_q(&q);
    }

    /// Largest local error over tolerance. An estimate that does not fall with the step is no error of the step: after a
    /// restart F_1 may not quite fit where charges float between nodes. Multiplied by C it is gone. So is, in a first step
    /// after a jump, what the method damps: of a mode with h lambda = z the estimate is a constant, the filtered one falls
    /// as 1/z, like R(z), which is the error.
    fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> f64 {
        // a h = 1/gamma
        let k = &self.k[self.now.by].k;
        let junctions = if sys.exponentials() > 0 { JUNCTIONS } else { 1.0 };
        let (scale, local) = (1.0 / k.a[0][1], junctions * k.local);
        weighted_sum(k.d.iter().zip(&self.f).map(|(&d, f)| (d, f.as_slice())), &mut self.e);
        self.skip.fast.copy_from_slice(&self.e);
        let of_charge = |&(i, c): &(usize, f64)| {
            let allowed = local * tol.weight(i, self.now.x[0][i], self.candidate()[i]);
            h * self.e[i].abs() / (c * allowed)
        };
        let given = if self.follows { self.given.iter().map(of_charge).fold(0.0, f64::max) } else { 0.0 };
        self.e.iter_mut().for_each(|e| *e *= scale);
        self.newton.solve_held(w, &mut self.e);
        let mut worst = tol.largest_error(&self.e, self.candidate(), &self.now.x[0]) / local;
        let stays = |(first_h, first)| h < STAYS * first_h && worst > 0.5 * first;
        if worst > 1.0 && (!self.follows || self.at_first.is_some_and(stays)) {
            self.newton.filter(sys, w, scale / h, &mut self.e);
            worst = tol.largest_error(&self.e, self.candidate(), &self.now.x[0]) / local;
        }
        if worst > 1.0 && worst.is_finite() {
            let points = (self.now.x[self.now.x.len() - 1].as_slice(), self.now.x[0].as_slice());
            worst = self.newton.above_noise(sys, w, scale / h, |i| self.e[i], points, tol, local);
        }
        self.skip.shift.fill(0.0);
        self.skip.brief = if worst <= 1.0 { self.skipped_transient(sys, w, h, tol) } else { None };
        if worst.is_finite() {
            worst.max(given).max(1e-10)
        } else {
            f64::INFINITY
        }
    }
}

impl Response for Dirk {
    fn response(&self, _formula: usize, y: f64) -> Option<Complex> {
        let rows = std::iter::once(&[][..]).chain(self.k[NEXT].k.a.iter().map(Vec::as_slice));
        Some(response::stages(rows.map(|row| row.iter().copied().enumerate()), y))
    }
}

impl Method for Dirk {
    fn character(&self) -> &Character {
        &self.character
    }

    fn restart(&mut self, _sys: &System, _w: &mut Work, t: f64, x: &[f64]) {
        self.now.t = t;
        self.now.x[0].copy_from_slice(x);
        // a run begins in balance
        self.jumped = std::mem::replace(&mut self.begun, true);
        self.started = false;
        self.turns.negative = None;
        self.turns.count = 0;
        self.solved = false;
        self.follows = false;
        self.accepted = false;
        self.refused = None;
        self.at_first = None;
        self.leapt = false;
        self.control.restart();
        self.newton.forget();
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if !self.started || self.renewed {
            sys.eval(w, &self.now.x[0], self.now.t);
            for ((f, wf), has_q) in self.f[0].iter_mut().zip(&w.f).zip(&sys.has_q) {
                *f = if *has_q { *wf } else { 0.0 };
            }
            if self.started {
                self.settle(sys, w, tol);
            } else {
                self.q0.copy_from_slice(&w.q);
            }
            (self.started, self.renewed) = (true, false);
        }
        self.accepted = false;
        self.skip.taken = false;
        self.t1 = self.now.t + h;
        if let Err(why) = self.stages(sys, w, h, tol) {
            return self.control.stuck(h, why);
        }
        if self.fixed {
            return Attempt::Good { next: h };
        }
        let error = self.error(sys, w, h, tol);
        if let Some(brief) = self.skip.brief {
            self.leapt = true;
            return Attempt::TooLarge { next: brief.min(0.5 * h) };
        }
        let tried = Tried { h, error, power: self.tableau().falls };
        if error > 1.0 {
            let rises = |(old_h, old): (f64, f64)| h < old_h && error > old * (old_h / h).sqrt();
            if let Some((old_h, old)) = self.refused.filter(|&r| !self.follows && !self.leapt && rises(r)) {
                // a fast mode after a jump: a longer step has it damped, shorter ones would follow it
                self.leapt = true;
                return Attempt::TooLarge { next: (1.5 * old).min(LEAP) * old_h };
            }
            self.refused = Some((h, error));
            self.at_first = self.at_first.or(self.refused);
            return self.control.refuse(tried);
        }
        if self.accounts && !self.follows && self.now.by == NEXT && (0..sys.n).any(|i| self.is_over(i, h)) {
            self.skip.taken = true;
            self.calm(sys, w, h, tol);
        }
        self.control.judge(tried, sys.linear)
    }

    fn accept(&mut self, t1: f64) {
        let s = self.now.x.len();
        std::mem::swap(&mut self.now, &mut self.last);
        let mut x0 = std::mem::take(&mut self.now.x[0]);
        x0.copy_from_slice(&self.last.x[s - 1]);
        self.renewed = self.last.by == FIRST;
        if self.renewed {
            self.unspread((0..s).map(|j| f64::from(u8::from(j == s - 1))), &mut x0);
        }
        self.now.x[0] = x0;
        self.now.t = t1;
        (self.now.by, self.jumped) = (NEXT, false);
        self.f.swap(0, s - 1);
        self.q0.copy_from_slice(self.newton.q());
        self.solved = false;
        self.control.accept();
        if self.renewed {
            // the estimate of the next step is made otherwise than its own was
            self.control.restart();
        }
        self.follows = true;
        self.accepted = true;
        self.refused = None;
        self.at_first = None;
        self.turns.count = 0;
    }

    fn candidate(&self) -> &[f64] {
        if self.accepted {
            &self.now.x[0]
        } else {
            &self.now.x[self.now.x.len() - 1]
        }
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let step = if self.accepted { &self.last } else { &self.now };
        self.polynomial(step, (t - step.t) / step.h, out);
    }

    /// The error estimate does not see what is algebraic: its values at the end are right, but the curve to them may have
    /// a corner. Carried back a little, the polynomial parts from that of the last step. A corner in the step makes it part
    /// there by a quarter to four times as much as it is wrong inside, wherever the corner lies; a smooth curve by more,
    /// in the proportion of the two places' products of distances from the nodes: what has a mass is as smooth as that.
    /// (Carried back over all of that step, either proportion is so small that corners were missed.)
    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        if !self.follows {
            return self.interior_of_first(sys, tol);
        }
        let s = self.now.x.len();
        let ratio = self.last.h / self.now.h;
        let theta = -ratio.min(BACK);
        let (now, last) = (&self.k[self.now.by].k, &self.k[self.last.by].k);
        let (here, there): (Vec<f64>, Vec<f64>) =
            (now.weights_at(theta).collect(), last.weights_at(1.0 + theta / ratio).collect());
        // as if through m equidistant nodes; their product is largest in the first interval
        let m = now.dense[0].len();
        let product = |x: f64| (0..m).map(|j| x - j as f64 / (m - 1) as f64).product::<f64>();
        let smooth = (product(0.4 / (m - 1) as f64) / product(theta)).abs().min(1.0);
        let corner = BACK / -theta;
        let mut worst = 0.0_f64;
        let jumped = |i: usize| self.last.by == FIRST && self.skip.quick[i];
        for i in sys.interpolated().filter(|&i| !jumped(i)) {
            let value = |w: &[f64], of: &Step| w.iter().zip(&of.x).map(|(w, x)| w * x[i]).sum::<f64>();
            let lacking = if matches!(sys.unknowns[i].kind, Kind::Coordinate | Kind::Speed) { smooth } else { corner };
            let error = (lacking * (value(&here, &self.now) - value(&there, &self.last))).abs();
            worst = worst.max(error / tol.weight(i, self.now.x[0][i], self.now.x[s - 1][i]));
        }
        worst
    }

    fn stages(&self) -> Stages<'_> {
        if self.skip.taken {
            let at = self.skip.calm.iter().map(|(t, x)| (*t, x.as_slice())).collect();
            return Stages { at, weights: &self.skip.weights };
        }
        let formula = &self.k[self.last.by];
        let nodes = formula.k.c.iter().zip(&self.last.x).map(|(c, x)| (self.last.t + c * self.last.h, x.as_slice()));
        Stages { at: nodes.collect(), weights: &formula.weights }
    }

    fn corner(&mut self) {
        self.started = false;
    }
}
