//! Trapezoidal rule: A-stable, order 2, no damping at all (it keeps an oscillation, and it keeps a ringing).
//!
//!   Q1 - Q0 + h/2 (F1 + F0) = 0      ->      F1 + a Q1 + (F0 - a Q0) = 0,   a = 2/h
//!
//! After a discontinuity the first step is the stiffly accurate SDIRK of order 2 (Alexander 1977), L-stable,
//! gamma = 1 - 1/sqrt 2, which needs neither F0 nor consistent algebraic unknowns; SPICE takes backward Euler there.
//!
//! Local error  h^3/12 x'''  from the third divided difference of the last four points, on what stands under d/dt.
use super::rows::Lags;
use super::{interpolate, response, root, Attempt, Character, History, Method, Response};
use crate::ledger::Stages;
use crate::newton::{Newton, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{Kind, System, Work};

const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2; // of the L-stable SDIRK of order 2 (Alexander 1977)

/// Errors that are damped at once (a junction behind a milliohm) do not deserve small steps: an estimate above
/// `FILTER_FROM` is filtered by (G + a C)^-1 a C. The rule itself does not damp, so that a share `RINGING` of the plain
/// estimate stays in force: without it, ringing that a diode rectifies cost three digits on a ten-stage multiplier;
/// without the filter, that circuit took 3.8 times as many steps.
///
/// Ringing that has got in stays in, and its plain estimate then halves the steps for good (24 000 or 50 000 steps on that
/// multiplier, by chance). So where the plain share is what decides, and is worth more than `DAMP_FROM`, one step is taken
/// by the L-stable rule of the start: it removes what is not resolved and below four tolerances anyway, and costs one
/// more solution. The three differences after it still hold the ringing: `CALM` steps pass before the next.
const FILTER_FROM: f64 = 0.3;
const RINGING: f64 = 0.25;
const DAMP_FROM: f64 = 0.1;
const CALM: u32 = 3;
/// Error of the parabola between the ends of a step, in parts of what it missed.
const INSIDE: f64 = 0.25;
/// Beside diodes: a step that is no longer than the time in which they turn meets them without being refused, and the errors of equal
/// steps cancel where those of unequal ones add up. A hundredth of a period is as good for more iterations, a sixtieth no longer is.
pub const IN_A_PERIOD: f64 = 80.0;
/// What a junction's voltage may miss when an iteration ends, in parts of its tolerance: on ten circuits of diodes as near to the
/// solution as 1 is, for up to an eighth of the iterations less (methods of higher order gain nothing).
pub const MISSED: f64 = 3.0;

pub struct Trap {
    character: Character,
    newton: Newton,
    now: f64,      // of the newest point
    past: History, // points, at times since then: sums of steps, of which absolute times know too little
    q0: Vec<f64>,
    f0: Vec<f64>,
    r: Vec<f64>,
    t1: f64, // of the candidate, since then as well
    x1: Vec<f64>,
    trtol: f64,
    fixed: bool,
    linear: bool,
    itl4: usize,
    e: Vec<f64>,
    ringing: bool,               // in the attempted step
    damp: bool,                  // take the next step by the L-stable rule
    stage: Vec<f64>,             // of that rule
    weights: [Vec<Vec<f64>>; 2], // of the ends of a step, of stage and end
    two_stages: bool,            // the attempted step was by that rule
    calm: u32,                   // steps since one was
    given: Vec<usize>,           // unknowns that have what a source has
    slopes: Vec<(usize, f64)>,   // rows that only ask for a derivative, with Q one step before the last
}

impl Trap {
    pub fn new(sys: &System, o: &Options) -> Result<Trap, crate::newton::Failure> {
        let v = || vec![0.0; sys.n];
        let mut newton = Newton::new(sys)?;
        let alone = sys.alone();
        newton.missed = MISSED;
        Ok(Trap {
            character: Character {
                steps_a_period: Some(IN_A_PERIOD),
                lags: Lags::unless(o.fixed_step.is_some(), Lags::Forces),
                ..Character::PLAIN
            },
            newton,
            now: 0.0,
            past: History::new(sys.n, 4),
            q0: v(),
            f0: v(),
            r: v(),
            t1: 0.0,
            x1: v(),
            trtol: if o.trtol.is_finite() { o.trtol } else { 1.0 },
            fixed: o.fixed_step.is_some(),
            linear: sys.linear,
            itl4: o.itl4,
            e: v(),
            ringing: false,
            damp: false,
            stage: v(),
            weights: [vec![vec![0.5, 0.5]], vec![vec![1.0 - GAMMA, GAMMA]]],
            two_stages: false,
            calm: 0,
            given: (0..sys.n).filter(|&i| alone[i]).collect(),
            slopes: (0..sys.n).filter(|&i| sys.unknowns[i].kind == Kind::Derivative).map(|i| (i, 0.0)).collect(),
        })
    }

    /// First step after a discontinuity, and the one that damps ringing: two SDIRK stages.
    fn first(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Result<(), crate::newton::Failure> {
        let a = 1.0 / (GAMMA * h);
        let t0 = self.now;
        for i in 0..sys.n {
            self.r[i] = -a * self.q0[i];
        }
        self.x1.copy_from_slice(&self.past.x[0]);
        self.newton.solve(sys, w, a, &self.r, &mut self.x1, t0 + GAMMA * h, tol, self.itl4)?;
        self.stage.copy_from_slice(&self.x1);
        let k = (1.0 - GAMMA) / GAMMA;
        for i in 0..sys.n {
            self.r[i] += k * self.newton.f()[i];
        }
        self.newton.solve(sys, w, a, &self.r, &mut self.x1, t0 + h, tol, self.itl4)?;
        Ok(())
    }

    fn trapezoid(
        &mut self,
        sys: &System,
        w: &mut Work,
        h: f64,
        tol: &Tolerances,
    ) -> Result<(), crate::newton::Failure> {
        let a = 2.0 / h;
        for (r, (f, q)) in self.r.iter_mut().zip(self.f0.iter().zip(&self.q0)) {
            *r = f - a * q;
        }
        // linear prediction: on switching diodes it beats the quadratic one
        if sys.pure_linear {
            // one solution is all, whatever the guess
        } else if self.linear {
            self.x1.copy_from_slice(&self.past.x[0]);
        } else {
            let s = h / (self.past.t[0] - self.past.t[1]);
            for (x1, (x0, xa)) in self.x1.iter_mut().zip(self.past.x[0].iter().zip(&self.past.x[1])) {
                *x1 = x0 + s * (x0 - xa);
            }
        }
        self.newton.solve(sys, w, a, &self.r, &mut self.x1, self.now + h, tol, self.itl4)?;
        Ok(())
    }

    /// Largest local error over tolerance, and the order of the estimate.
    fn error(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> (f64, usize) {
        let p = &self.past;
        let t1 = self.t1;
        let n = self.x1.len();
        // that of the last factorisation
        let a = if self.damp { 1.0 / (GAMMA * h) } else { 2.0 / h };
        let (order, a) = match p.len {
            1 => {
                // the first step: its stage gives the second difference, a tenth of whose term is held to the tolerance
                let c = 0.1 * h;
                for i in 0..n {
                    let (x0, stage) = (p.x[0][i], self.stage[i]);
                    let dd = (self.x1[i] - stage) / ((1.0 - GAMMA) * h) - (stage - x0) / (GAMMA * h);
                    self.e[i] = if tol.in_error[i] { c * dd } else { 0.0 };
                }
                (2, 1.0 / (GAMMA * h))
            }
            2 => {
                // no third difference yet: a tenth of the second-order term stands in for it
                let (d0, d1) = (1.0 / h, 1.0 / (p.t[0] - p.t[1]));
                let c = 0.1 * h * h / (t1 - p.t[1]);
                for i in 0..n {
                    let dd = (self.x1[i] - p.x[0][i]) * d0 - (p.x[0][i] - p.x[1][i]) * d1;
                    self.e[i] = if tol.in_error[i] { c * dd } else { 0.0 };
                }
                (2, a)
            }
            m => {
                let m = m.min(3);
                let (ta, tb, tc) = (p.t[0], p.t[1], p.t[m - 1]);
                let (h0, h1, h2) = (1.0 / (t1 - ta), 1.0 / (ta - tb), 1.0 / (tb - tc));
                let (k0, k1) = (1.0 / (t1 - tb), 1.0 / (ta - tc));
                let c = 0.5 * h * h * h / (t1 - tc);
                let (xa, xb, xc) = (&p.x[0][..n], &p.x[1][..n], &p.x[m - 1][..n]);
                let (e, x1, mask) = (&mut self.e[..n], &self.x1[..n], &tol.error_mask[..n]);
                for i in 0..n {
                    let da = (x1[i] - xa[i]) * h0;
                    let db = (xa[i] - xb[i]) * h1;
                    let dc = (xb[i] - xc[i]) * h2;
                    e[i] = mask[i] * c * ((da - db) * k0 - (db - dc) * k1);
                }
                (3, a)
            }
        };
        self.ringing = false;
        // the first step damps what it filters
        let share = if p.len == 1 { 0.0 } else { RINGING };
        let mut error = tol.largest_error(&self.e, &self.x1, &self.past.x[0]) / self.trtol;
        if error > FILTER_FROM {
            self.r.copy_from_slice(&self.e);
            self.newton.filter(sys, w, a, &mut self.e);
            let filtered = tol.largest_error(&self.e, &self.x1, &self.past.x[0]) / self.trtol;
            self.ringing = share * error > filtered.max(DAMP_FROM) && {
                // what a source says does not ring
                let mut own = self.r.clone();
                self.given.iter().for_each(|&i| own[i] = 0.0);
                let own = tol.largest_error(&own, &self.x1, &self.past.x[0]) / self.trtol;
                share * own > filtered.max(DAMP_FROM)
            };
            error = filtered.max(share * error);
        }
        if error > 1.0 {
            let (e, plain) = (&self.e, &self.r);
            let error_of = |i: usize| e[i].abs().max(share * plain[i].abs());
            let points = (self.x1.as_slice(), self.past.x[0].as_slice());
            error = self.newton.above_noise(sys, w, a, error_of, points, tol, self.trtol);
        }
        (error, order)
    }
}

impl Response for Trap {
    fn response(&self, _formula: usize, y: f64) -> Option<Complex> {
        Some(response::pade(1, 1, y))
    }
}

impl Method for Trap {
    fn character(&self) -> &Character {
        &self.character
    }

    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.now = t;
        self.past.clear();
        self.past.push(0.0, x);
        (self.ringing, self.damp, self.calm) = (false, false, 0);
        sys.eval(w, x, t);
        self.q0.copy_from_slice(&w.q);
        self.newton.forget();
        self.x1.copy_from_slice(x);
        self.t1 = 0.0;
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        self.t1 = h;
        self.two_stages = self.past.len == 1 || self.damp;
        let solved = if self.two_stages { self.first(sys, w, h, tol) } else { self.trapezoid(sys, w, h, tol) };
        if let Err(why) = solved {
            return Attempt::Stuck { next: h / 8.0, why: why.into() };
        }
        if self.fixed {
            return Attempt::Good { next: h };
        }
        let (error, order) = self.error(sys, w, h, tol);
        if error > 1.0 {
            let factor = (0.9 / root(error, order)).clamp(0.1, 0.8);
            return Attempt::TooLarge { next: factor * h };
        }
        // a step that stays as it is keeps its factorisation in a linear circuit
        let grows = error < if order == 2 { 0.2 } else { 0.091 }; // 0.45^order: to twice the step, without the power
        let factor = if grows { 2.0 } else { (0.9 / root(error, order)).clamp(0.5, 2.0) };
        let keep = if self.linear { 1.5 } else { 1.1 };
        Attempt::Good { next: if (0.9..keep).contains(&factor) { h } else { factor * h } }
    }

    fn accept(&mut self, t1: f64) {
        let h = std::mem::take(&mut self.t1);
        self.calm = if self.damp { 0 } else { self.calm + 1 };
        self.damp = self.ringing && self.calm >= CALM;
        // Newton's method left Q and F of the candidate
        let q1 = self.newton.q();
        self.f0.copy_from_slice(self.newton.f());
        // w = dQ/dt of a reaction or an acceleration: the recursion would carry its first error for ever with changing
        // sign; the slope of the parabola through three charges, O(h^2) as well, forgets it
        for (row, before) in &mut self.slopes {
            let (q1, q0) = (q1[*row], self.q0[*row]);
            if self.past.len > 1 {
                let h0 = -self.past.t[1];
                let (d, d0) = ((q1 - q0) / h, (q0 - *before) / h0);
                self.f0[*row] = -(d + h * (d - d0) / (h + h0));
            }
            *before = q0;
        }
        self.q0.copy_from_slice(q1);
        self.past.t.iter_mut().for_each(|t| *t -= h);
        self.past.push(0.0, &self.x1);
        self.now = t1;
    }

    /// The parabola through three points parts from the next one by d. Where a diode turns within the step it is wrong there by a third of
    /// d at most, where all is smooth by a sixteenth.
    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        let p = &self.past;
        if p.len < 3 {
            return f64::INFINITY;
        }
        let (xs, x1) = ([p.x[0].as_slice(), &p.x[1], &p.x[2]], &self.x1);
        let mut predicted = vec![0.0; x1.len()];
        interpolate(&p.t[..3], &xs, self.t1, &mut predicted);
        let missed = |i: usize| (x1[i] - predicted[i]).abs() / tol.weight(i, x1[i], xs[0][i]);
        let worst = sys.interpolated().map(missed).fold(0.0, f64::max);
        INSIDE * worst
    }

    fn stages(&self) -> Stages<'_> {
        let (h, x) = (-self.past.t[1], &self.past.x);
        let first = if self.two_stages {
            (self.now - h + GAMMA * h, self.stage.as_slice())
        } else {
            (self.now - h, x[1].as_slice())
        };
        Stages { at: vec![first, (self.now, &x[0])], weights: &self.weights[usize::from(self.two_stages)] }
    }

    fn candidate(&self) -> &[f64] {
        &self.x1
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        // before acceptance the candidate is the newest point; after it, the candidate equals past[0]
        let skip = usize::from(self.t1 == 0.0 && self.past.len > 1);
        let m = (self.past.len - skip).min(2);
        let mut ts = [self.t1, 0.0, 0.0];
        let mut xs: [&[f64]; 3] = [&self.x1, &self.x1, &self.x1];
        if m == 1 && self.two_stages {
            // the first step begins with what may be over at once: its stage and its end know nothing of that
            let h = if skip == 1 { -self.past.t[1] } else { self.t1 };
            (ts[1], xs[1]) = (self.t1 - (1.0 - GAMMA) * h, &self.stage);
            return interpolate(&ts[..2], &xs[..2], t - self.now, out);
        }
        for k in 0..m {
            ts[k + 1] = self.past.t[k + skip];
            xs[k + 1] = &self.past.x[k + skip];
        }
        interpolate(&ts[..=m], &xs[..=m], t - self.now, out);
    }
}
