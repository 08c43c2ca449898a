//! How long the next step of a one-step method is: one rule for radau, the diagonally implicit methods and gauss.
//!
//! A step of length h has an error e, in units of what is allowed, that falls as h^p:  e = c h^p.
//!
//!   taken, e <= 1:   h_next = h * safety * e^(-1/p) * min(1, g),    g = (h/h') (e'/e)^(1/p) = (c'/c)^(1/p)
//!   refused:         h_next = h * safety * e^(-1/p)
//!   not solved:      h_next = h / change
//!
//! h', e', c' are of the step before: a coefficient that has grown is expected to grow on, as where a diode turns on (Gustafsson, ACM
//! Trans. Math. Software 20 (1994) 496; Hairer and Wanner, Solving Ordinary Differential Equations II, equation (IV.8.25)). What
//! follows a refused attempt is no longer than it (Hairer, Norsett and Wanner, part I, section II.4).
//!
//! Logarithms are of base 2: one of each error, one power for the step.
use super::Attempt;
use crate::newton::Failure;

/// Share that is taken of the step that an error allows: 0.9 in RADAU5 and DOPRI5 (Hairer and Wanner).
const SAFETY: f64 = 0.9;
/// A step is longer than the one before by so much at most, or shorter: between 5 (Hairer, Norsett and Wanner, part I, section II.4) and
/// 8 in RADAU5.
const CHANGE: f64 = 5.0;
/// An attempt that is wrong by so many tolerances has met something quick before its end. Steps go there by such parts of what is left
/// of the way, not as long as errors up to it allow: the farther behind it a stage lies, the more iterations are lost.
const WRONG: f64 = 10.0;
const PART: f64 = 0.3;
/// What is left of a refused step at least: an estimate that asks for less is far from where it falls as h^p.
const LEAST: f64 = 0.1;
/// A step that may grow by less than this keeps its length, where that keeps its factors: they cost more than half a step.
const KEEP: f64 = 1.5;
/// The error of the step before counts as this at least, as in RADAU5: smaller ones say little of their coefficient.
const BELIEVED: f64 = 1e-2;

/// An attempted step: its length, its error in units of what is allowed, and the power of h that the error falls with.
#[derive(Clone, Copy)]
pub struct Tried {
    pub h: f64,
    pub error: f64,
    pub power: usize,
}

pub struct Controller {
    foresees: bool,
    now: Option<Tried>,    // the good attempt
    before: Option<Tried>, // the step before
    refused: bool,         // was an attempt from here?
    ahead: f64,            // from here to where an attempt ended that met something quick
}

impl Controller {
    /// `foresees`: a growing coefficient is expected to grow on. Not where errors of a fast mode that is damped fall less than as h^p:
    /// the shorter the steps, the larger their coefficient then is, down to none.
    pub fn new(foresees: bool) -> Controller {
        Controller { foresees, now: None, before: None, refused: false, ahead: 0.0 }
    }

    /// What lies behind tells nothing of what comes.
    pub fn restart(&mut self) {
        (self.now, self.before, self.refused, self.ahead) = (None, None, false, 0.0);
    }

    /// The attempted step has been taken.
    pub fn accept(&mut self) {
        self.ahead -= self.now.map_or(self.ahead, |now| now.h);
        (self.before, self.refused) = (self.now.take(), false);
    }

    /// log2 of the factor to the step that an error allows, whatever the last ones were.
    #[inline(always)]
    fn growth(&self, error: f64, power: usize) -> f64 {
        SAFETY.log2() - error.max(f64::MIN_POSITIVE).log2() / power as f64
    }

    /// The step that an error allows, whatever the last ones were.
    pub fn allows(&self, tried: Tried) -> f64 {
        tried.h * self.growth(tried.error, tried.power).exp2()
    }

    /// Judges a step; `keeps`: a next one of the same length needs no new factors. An error that is no number refuses it.
    pub fn judge(&mut self, tried: Tried, keeps: bool) -> Attempt {
        if tried.error <= 1.0 {
            Attempt::Good { next: self.next(tried, keeps) }
        } else {
            self.refuse(tried)
        }
    }

    pub fn refuse(&mut self, tried: Tried) -> Attempt {
        self.refused = true;
        if tried.error > WRONG {
            self.ahead = tried.h;
        }
        let least = LEAST * tried.h;
        Attempt::TooLarge { next: if tried.error.is_finite() { self.allows(tried).max(least) } else { least } }
    }

    pub fn stuck(&mut self, h: f64, why: Failure) -> Attempt {
        self.refused = true;
        Attempt::Stuck { next: h / CHANGE, why: why.into() }
    }

    /// Length of the step after a good one.
    fn next(&mut self, tried: Tried, keeps: bool) -> f64 {
        let Tried { h, error, power } = tried;
        let own = self.growth(error, power);
        let mut best = own;
        self.now = Some(tried);
        if let Some(before) = self.before.filter(|b| self.foresees && b.power == power) {
            let allowed = self.growth(before.error.max(BELIEVED), power);
            best += ((h / before.h).log2() + own - allowed).min(0.0);
        }
        let quick = if h < self.ahead { (PART * (self.ahead - h) / h).max(1.0) } else { f64::INFINITY };
        let factor = best.exp2().clamp(CHANGE.recip(), if self.refused { 1.0 } else { CHANGE.min(quick) });
        if keeps && (1.0..KEEP).contains(&factor) {
            h
        } else {
            factor * h
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Attempt, Controller, Tried, CHANGE, PART};

    fn next(control: &mut Controller, h: f64, error: f64) -> f64 {
        control.judge(Tried { h, error, power: 4 }, false).next()
    }

    /// With e = c h^4 the steps settle at safety c^(-1/4), from either side, and each is good.
    #[test]
    fn steps_settle_where_the_error_is_allowed() {
        for start in [1e-3, 1.0] {
            let (mut control, mut h) = (Controller::new(true), start);
            for _ in 0..12 {
                let attempt = control.judge(Tried { h, error: 16.0 * h.powi(4), power: 4 }, false);
                if let Attempt::Good { .. } = attempt {
                    control.accept();
                }
                h = attempt.next();
            }
            assert!((h / (0.9 * 0.5) - 1.0).abs() < 1e-12, "{h}");
        }
    }

    /// A coefficient that doubles in power four from step to step has each step half as long as the last allows by itself.
    #[test]
    fn a_growing_coefficient_is_foreseen() {
        let mut control = Controller::new(true);
        assert!((next(&mut control, 1.0, 0.9_f64.powi(4)) - 1.0).abs() < 1e-12);
        control.accept();
        // 16 times the coefficient, at a step of half the length: the same error
        assert!((next(&mut control, 0.5, 0.9_f64.powi(4)) - 0.25).abs() < 1e-12);
        // one that falls is not
        control.accept();
        assert!((next(&mut control, 1.0, 0.9_f64.powi(4)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_follows_a_refusal_is_shorter_and_no_longer_than_what_was_refused() {
        let mut control = Controller::new(true);
        for error in [1.001, 3.0, 1e9, f64::INFINITY, f64::NAN] {
            let to = next(&mut control, 1.0, error);
            assert!((0.1..=0.9).contains(&to), "{error}: {to}");
        }
        assert_eq!(next(&mut control, 0.1, 1e-9), 0.1);
        control.accept();
        // something quick is 0.9 ahead, 0.8 behind the next step
        assert_eq!(next(&mut control, 0.1, 1e-9), PART * 0.8);
        control.restart();
        assert_eq!(next(&mut control, 0.1, 1e-9), CHANGE * 0.1);
    }

    #[test]
    fn a_step_that_would_hardly_grow_keeps_its_factors() {
        let mut control = Controller::new(true);
        let of = |factor: f64| Tried { h: 1.0, error: (0.9 / factor).powi(4), power: 4 };
        assert_eq!(control.judge(of(1.45), true).next(), 1.0);
        assert!((control.judge(of(1.45), false).next() - 1.45).abs() < 1e-12);
        assert!((control.judge(of(1.55), true).next() - 1.55).abs() < 1e-12);
        assert!((control.judge(of(0.95), true).next() - 0.95).abs() < 1e-12);
    }
}
