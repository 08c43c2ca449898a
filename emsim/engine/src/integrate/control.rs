//! How long the next step is, and of what order: one rule for every method.
//!
//! A step of length h has an error e, in units of what is allowed, that falls as h^p:  e = c h^p.
//!
//!   taken, e <= 1:   h_next = h * safety * e^(-1/p) * min(1, g),    g = (h/h') (e'/e)^(1/p) = (c'/c)^(1/p)
//!   refused:         h_next = h * safety * e^(-1/p)
//!   not solved:      h_next = h * unsolved
//!
//! h', e', c' are of the step before: a coefficient that has grown is expected to grow on, as where a diode turns on (Gustafsson, ACM
//! Trans. Math. Software 20 (1994) 496; Hairer and Wanner, Solving Ordinary Differential Equations II, equation (IV.8.25)). What
//! follows a refused attempt is no longer than it (Hairer, Norsett and Wanner, part I, section II.4).
//!
//! Methods give errors and choose no length. Logarithms are of base 2: one of each error, one power for the step.
use super::Attempt;
use crate::newton::Failure;

/// The numbers of the rule.
#[derive(Clone, Copy)]
pub struct Config {
    /// Share that is taken of the step that an error allows: 0.9 in RADAU5 and DOPRI5 (Hairer and Wanner).
    pub safety: f64,
    /// A step is longer than the one before by so much at most, or shorter: between 5 (Hairer, Norsett and Wanner, part I, section II.4)
    /// and 8 in RADAU5. Multistep methods: 2, since BDF2 is stable while steps grow by less than 1 + sqrt 2 (Grigorieff 1983; part I,
    /// section III.5).
    pub change: f64,
    /// What the growth of c counts: in full by Gustafsson's derivation, which has errors of one step; estimates of multistep methods
    /// reach over several.
    pub trend: f64,
    /// An attempt that is wrong by so many tolerances has met something quick before its end. Steps go there by such parts of what is
    /// left of the way, not as long as errors up to it allow: the farther behind it a stage lies, the more iterations are lost.
    pub wrong: f64,
    pub part: f64,
    /// What is left of a refused step at least: an estimate that asks for less is far from where it falls as h^p.
    pub least: f64,
    /// What is left of a step whose equations were not solved.
    pub unsolved: f64,
    /// A step that may grow by less than this keeps its length, where that keeps its factors: 1.2 in RADAU5 (QUOT2).
    pub keep: f64,
    /// The error of the step before counts as this at least, as in RADAU5: smaller ones say little of their coefficient.
    pub believed: f64,
    /// Errors below this are as good as none: any step is then the longest, since (1e-12)^(-1/9) > 8.
    pub none: f64,
    /// Another order's step must be longer by so much: less is what estimates of unequal orders differ by anyhow.
    pub worth: f64,
}

impl Config {
    pub const ONE_STEP: Config = Config {
        safety: 0.9,
        change: 5.0,
        trend: 1.0,
        wrong: 10.0,
        part: 0.3,
        least: 0.1,
        unsolved: 0.25,
        keep: 1.2,
        believed: 1e-2,
        none: 1e-12,
        worth: 1.05,
    };
    pub const MULTISTEP: Config = Config { change: 2.0, trend: 0.7, ..Config::ONE_STEP };
}

/// An attempted step: its length, its error in units of what is allowed, and the power of h that the error falls with.
#[derive(Clone, Copy)]
pub struct Tried {
    pub h: f64,
    pub error: f64,
    pub power: usize,
}

pub struct Controller {
    config: Config,
    now: Option<Tried>,    // the good attempt
    before: Option<Tried>, // the step before
    refused: bool,         // was an attempt from here?
    /// a step is longer than the one before by so much at most
    pub longer: f64,
    ahead: f64, // from here to where an attempt ended that met something quick
}

impl Controller {
    pub fn new(config: Config) -> Controller {
        Controller { config, now: None, before: None, refused: false, ahead: 0.0, longer: config.change }
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
        self.config.safety.log2() - error.max(self.config.none).log2() / power as f64
    }

    /// The step that an error allows, whatever the last ones were.
    pub fn allows(&self, tried: Tried) -> f64 {
        tried.h * self.growth(tried.error, tried.power).exp2()
    }

    /// Judges a step; `keeps`: a next one of the same length needs no new factors. An error that is no number refuses it.
    pub fn judge(&mut self, tried: Tried, keeps: bool) -> Attempt {
        if tried.error <= 1.0 {
            Attempt::Good { next: self.next(tried, [None; 2], keeps).1 }
        } else {
            self.refuse(tried)
        }
    }

    pub fn refuse(&mut self, tried: Tried) -> Attempt {
        self.refused = true;
        if tried.error > self.config.wrong {
            self.ahead = tried.h;
        }
        let least = self.config.least * tried.h;
        Attempt::TooLarge { next: if tried.error.is_finite() { self.allows(tried).max(least) } else { least } }
    }

    pub fn stuck(&mut self, h: f64, why: Failure) -> Attempt {
        self.refused = true;
        Attempt::Stuck { next: self.config.unsolved * h, why: why.into() }
    }

    /// Power and length of the step after a good one; `others` are errors that the orders below and above would have had.
    #[inline(always)]
    pub fn next(&mut self, tried: Tried, others: [Option<f64>; 2], keeps: bool) -> (usize, f64) {
        let Tried { h, error, power } = tried;
        let own = self.growth(error, power);
        let (mut best, mut chosen) = (own, power);
        for (power, error) in [(power - 1, others[0]), (power + 1, others[1])] {
            let other = error.map_or(f64::NEG_INFINITY, |e| self.growth(e, power));
            if other > best + self.config.worth.log2() {
                (best, chosen) = (other, power);
            }
        }
        self.now = Some(tried);
        if let Some(before) = self.before.filter(|b| b.power == power && chosen == power) {
            let allowed = self.growth(before.error.max(self.config.believed), power);
            best += self.config.trend * ((h / before.h).log2() + own - allowed).min(0.0);
        }
        let quick = if h < self.ahead { (self.config.part * (self.ahead - h) / h).max(1.0) } else { f64::INFINITY };
        let longest = if self.refused { 1.0 } else { self.longer.min(quick) };
        let factor = best.exp2().clamp(self.config.change.recip(), longest);
        (chosen, if keeps && (1.0..self.config.keep).contains(&factor) { h } else { factor * h })
    }
}

#[cfg(test)]
mod tests {
    use super::{Attempt, Config, Controller, Tried};

    fn next(control: &mut Controller, h: f64, error: f64) -> f64 {
        control.judge(Tried { h, error, power: 4 }, false).next()
    }

    /// With e = c h^4 the steps settle at safety c^(-1/4), from either side, and each is good.
    #[test]
    fn steps_settle_where_the_error_is_allowed() {
        for start in [1e-3, 1.0] {
            let (mut control, mut h) = (Controller::new(Config::ONE_STEP), start);
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
        let mut control = Controller::new(Config::ONE_STEP);
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
        let mut control = Controller::new(Config::ONE_STEP);
        for error in [1.001, 3.0, 1e9, f64::INFINITY, f64::NAN] {
            let to = next(&mut control, 1.0, error);
            assert!((0.1..=0.9).contains(&to), "{error}: {to}");
        }
        assert_eq!(next(&mut control, 0.1, 1e-9), 0.1);
        control.accept();
        // (the coefficient has not grown since)
        assert_eq!(next(&mut control, 0.1, 1e-9), 0.5);
    }

    #[test]
    fn the_order_follows_the_longest_step_that_is_worth_it() {
        let mut control = Controller::new(Config::MULTISTEP);
        let mut to = |others: [Option<f64>; 2]| control.next(Tried { h: 1.0, error: 0.5, power: 3 }, others, false).0;
        assert_eq!(to([None, None]), 3);
        assert_eq!(to([Some(1e-3), Some(0.5)]), 2);
        assert_eq!(to([Some(0.5), Some(0.01)]), 4);
        // 0.5^(1/3 - 1/4) is 6 % more, 0.42^(1/4) with 0.5^(1/3) 1.6 %
        assert_eq!(to([None, Some(0.40)]), 3);
    }

    #[test]
    fn a_step_that_would_hardly_grow_keeps_its_factors() {
        let mut control = Controller::new(Config::ONE_STEP);
        let of = |factor: f64| Tried { h: 1.0, error: (0.9 / factor).powi(4), power: 4 };
        assert_eq!(control.judge(of(1.15), true).next(), 1.0);
        assert!((control.judge(of(1.15), false).next() - 1.15).abs() < 1e-12);
        assert!((control.judge(of(1.25), true).next() - 1.25).abs() < 1e-12);
        assert!((control.judge(of(0.95), true).next() - 0.95).abs() < 1e-12);
    }
}
