//! Picks the method, at the start and while it runs.
//!
//! Rules, each justified by the work-precision charts of the benchmark decks (`python tests/bench/auto.py`):
//!
//!  1. Explicit where the equations reduce to an ODE (`System::reduced`) and nothing is stiff: dop853, in circuits rk45 at loose
//!     tolerances. Never with diodes or exponentials of voltages: those are stiff whenever they conduct. Not where the equations are
//!     linear either: a step of radau at order 13 is one solution there, with a factorisation that is kept, and reaches from one
//!     corner of a source to the next.
//!  2. Otherwise implicit. What each of these is for which equations: `auto/rules.rs`.
//!  3. From explicit to implicit when stability has limited `STIFF` steps, when the step collapses, or when a stage cannot be
//!     solved. Back after `TRIAL` implicit steps, on probation: the first explicit step must have room to spare and must not be
//!     shorter than a `fraction` of the implicit one. Each regretted return makes the next one twice as rare. For good where a loop
//!     comes near a position in which its constraints lose rank: what a step is off them is magnified there (`beside_singular`).
//!  4. A run begins implicitly where the fastest eigenvalue, by a few power iterations, is `FAST` times faster than the
//!     shortest time that its sources and its print grid speak of, `FAST_DAMPED` times where it is damped (with loops
//!     to close `FAST_IN_LOOPS`): order is lost on what follows such a mode long before stability is. Also where it is damped and
//!     `LASTING` times faster than the run is long: it will have died, and stability will want all those steps.
//!  5. Circuits with diodes and switches that ring for more than `LONG` steps from one restart to the next go on with gear, whose start
//!     is a small part of those steps then (a flyback converter whose leakage rings: 0.55 of the time to 7e-4), until two stretches in
//!     a row are shorter; twice as many before each further return, since stretches of several kinds follow one another.
//!  6. Where a method gives up for good, or would take too many steps, the others that can do it go on from the last good point, and hand back later.
//!
//! Nothing is measured with a clock: equal decks take equal steps.
mod rules;

pub use self::rules::reduces;
use self::rules::{beside_singular, mechanical, one_step};
use super::rows::Lags;
use super::{make_one, Attempt, Method, Used};
use crate::ledger::Stages;
use crate::newton::{Failure, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{System, Work};

/// h |lambda| over the bound of stability: above it stability is what limits, below `ROOM` there is room.
const LIMIT: f64 = 0.9;
const ROOM: f64 = 0.6;
const STIFF: u32 = 6;
/// A step of so little of the longest has collapsed.
const COLLAPSE: f64 = 1e-7;
const TRIAL: u32 = 40;
const FAST: f64 = 30.0;
const FAST_DAMPED: f64 = 12.0;
const LASTING: f64 = 2000.0;
/// ... with loops to close, where implicit steps are dearer: a motor on a slider-crank at 1e-6 takes radau 20 ms, dop853 9 ms.
const FAST_IN_LOOPS: f64 = 25.0;
/// A fast mode that has died down shows in no error, until steps beyond the bound of stability wake it: every so many steps
/// its eigenvalue is looked at, and h |lambda| above so much is too long a step, if it is so for some steps in a row: an oscillation's
/// own conductance is for one (LC oscillator).
const LOOK: u32 = 64;
const SILENT: f64 = 7.0;
const IN_A_ROW: u32 = 3;
/// An explicit stretch of fewer steps is a regretted return.
const WORTH: u32 = 100;
const RAREST: u32 = 1 << 20;
/// What part of an explicit step an implicit one is, beside a singular position.
const OF_EXPLICIT: f64 = 0.3;
/// Rule 5: a one-step method's steps, and gear's, which are shorter: four and more of these cost what one of those
/// does, and are less accurate.
const LONG: u32 = 60;
const BRIEF: u32 = 200;
/// More than a method has.
const FORMULAS: usize = 100;
/// So many changes are told one by one.
const TOLD: usize = 100;

pub struct Auto<'a> {
    sys: &'a System,
    o: Options,
    methods: Vec<(&'static str, Box<dyn Method + 'a>)>, // made when first needed
    now: usize,
    explicit: Option<&'static str>, // rule 1; None: it cannot be
    implicit: &'static str,         // rule 2
    away: bool,                     // another method goes on in its place
    stretches: bool,                // rule 5 applies
    stretch: u32,                   // steps since the last restart
    brief: u32,                     // stretches in a row that were brief
    enough: u32,                    // ... from which on esdirk is worth another trial
    begun: bool,
    feature: f64, // shortest time that sources and print grid speak of
    t: f64,
    x: Vec<f64>,              // the present point, where an attempt may change the method
    tried: Vec<&'static str>, // methods that gave up at it
    longest: f64,             // attempt from it
    reach: f64,               // longest explicit step since the last restart
    refused: u32,             // attempts from it that gave nothing
    collapsed: bool,
    limited: u32,                         // explicit steps in a row that stability limited
    silent: u32,                          // ... beyond its bound
    steps: u32,                           // since the last change
    patience: u32,                        // implicit steps before the next return
    probation: Option<(usize, f64, f64)>, // the method before, its step, the least one that is worth the change
    used: Vec<Used>,
}

/// Rule 6, in this order.
const OTHERS: [&str; 5] = ["radau", "esdirk", "trbdf2", "trap", "gear"];

impl<'a> Auto<'a> {
    pub fn new(sys: &'a System, o: &Options) -> Result<Auto<'a>, Failure> {
        let (explicit, why) = rules::explicit(sys, o);
        let implicit = rules::implicit(sys, o);
        let name = explicit.unwrap_or(implicit);
        Ok(Auto {
            sys,
            o: o.clone(),
            methods: vec![(name, make_one(sys, o, name)?)],
            now: 0,
            explicit,
            implicit,
            away: false,
            stretches: sys.diodes() > 0 && !mechanical(sys) && implicit == "esdirk",
            stretch: 0,
            brief: 0,
            enough: 2,
            begun: false,
            feature: 0.0,
            t: 0.0,
            x: vec![0.0; sys.n],
            tried: Vec::new(),
            longest: 0.0,
            reach: 0.0,
            refused: 0,
            collapsed: false,
            limited: 0,
            silent: 0,
            steps: 0,
            patience: TRIAL,
            probation: None,
            used: vec![Used { t: 0.0, method: name.into(), why }],
        })
    }

    fn inner(&self) -> &(dyn Method + 'a) {
        &*self.methods[self.now].1
    }

    fn name(&self) -> &'static str {
        self.methods[self.now].0
    }

    /// (The explicit method is the first one that is made.)
    fn explicitly(&self) -> bool {
        self.explicit.is_some() && self.now == 0
    }

    /// Is there nothing to choose between attempts: no explicit form, no other method for stretches of another kind?
    #[inline(always)]
    fn settled(&self) -> bool {
        self.begun && self.explicit.is_none() && !self.stretches && !self.away
    }

    /// What part of an implicit step an explicit one has to be: with 3, 5, 7 stages to iterate it is worth 4, 6, 8 of those.
    fn fraction(&self) -> f64 {
        match self.name() {
            "radau" | "radau5" => 1.0 / (1.0 + self.inner().formula() as f64),
            _ => 0.25,
        }
    }

    /// Another method takes over at the present point.
    fn switch(&mut self, w: &mut Work, name: &'static str) -> Result<(), Failure> {
        self.now = match self.methods.iter().position(|m| m.0 == name) {
            Some(known) => known,
            None => {
                self.methods.push((name, make_one(self.sys, &self.o, name)?));
                self.methods.len() - 1
            }
        };
        self.away = name != self.implicit;
        (self.limited, self.silent, self.refused, self.steps) = (0, 0, 0, 0);
        (self.reach, self.collapsed) = (0.0, false);
        self.methods[self.now].1.restart(self.sys, w, self.t, &self.x);
        Ok(())
    }

    fn tell(&mut self, why: &str) {
        let method = self.name().into();
        if self.used.last().is_some_and(|u| u.t == self.t) {
            self.used.pop();
        }
        if self.used.len() < TOLD && self.used.last().is_none_or(|u| u.method != method) {
            self.used.push(Used { t: self.t, method, why: why.to_string() });
        }
    }

    /// Rule 3, one way.
    fn go_implicit(&mut self, w: &mut Work, why: &str) -> Result<(), Failure> {
        self.patience = if self.steps < WORTH { (2 * self.patience).min(RAREST) } else { TRIAL };
        self.switch(w, self.implicit)?;
        self.tell(why);
        Ok(())
    }

    /// Rule 5.
    fn go_on_with(&mut self, w: &mut Work, name: &'static str) -> Result<(), Failure> {
        self.implicit = name;
        self.switch(w, name)?;
        let how_many = if name == "gear" { "many" } else { "few" };
        self.tell(&format!("{how_many} steps from restart to restart"));
        Ok(())
    }

    /// Rule 4, before the first attempt, of length h.
    fn look(&mut self, w: &mut Work, h: f64) -> Result<(), Failure> {
        if std::mem::replace(&mut self.begun, true) || !self.explicitly() {
            return Ok(());
        }
        // the first step is a hundredth of it
        self.feature = 100.0 * h;
        if self.fastest(w).is_none_or(|f| self.fast(f)) {
            self.go_implicit(w, "stiff from the start")?;
            // with a loop to close in every stage, the way back has never paid
            if self.sys.reduced().is_ok_and(|r| r.has_constraints()) {
                self.explicit = None;
            }
        }
        Ok(())
    }

    /// Rule 3, before an attempt of length h.
    fn choose(&mut self, w: &mut Work, h: f64) -> Result<(), Failure> {
        self.look(w, h)?;
        if self.explicitly() {
            if self.refused == 0 && (self.silent > 0 || self.steps % LOOK == LOOK - 1) {
                let beyond = self.fastest(w).is_some_and(|(l, _)| l * h > SILENT);
                self.silent = if beyond { self.silent + 1 } else { 0 };
                if self.silent == IN_A_ROW {
                    return self.go_implicit(w, "a mode that is silent is stiff");
                }
            }
            if self.limited >= STIFF {
                return self.go_implicit(w, "stability limits the explicit step");
            }
            if self.collapsed {
                return self.go_implicit(w, "the explicit step collapses");
            }
            return Ok(());
        }
        if self.stretches && self.stretch == LONG && self.implicit != "gear" {
            return self.go_on_with(w, "gear");
        }
        if self.steps < self.patience || self.refused > 0 {
            return Ok(());
        }
        // the way back
        if let Some(name) = self.explicit {
            let least = h * self.fraction();
            if self.fastest(w).is_none_or(|f| f.0 * least > SILENT || self.fast(f)) {
                self.patience = (2 * self.patience).min(RAREST);
                return Ok(());
            }
            let before = self.now;
            self.switch(w, name)?;
            self.probation = Some((before, h, least));
        } else if self.away {
            self.patience = (2 * self.patience).min(RAREST);
            self.switch(w, self.implicit)?;
            self.tell("once more");
        }
        Ok(())
    }

    /// Rule 4.
    fn fast(&self, (l, damped): (f64, bool)) -> bool {
        let loops = self.sys.reduced().is_ok_and(|r| r.has_constraints());
        let most = match damped {
            true if loops => FAST_IN_LOOPS,
            true => FAST_DAMPED,
            false => FAST,
        };
        l * self.feature > most || (damped && l * self.o.span > LASTING)
    }

    /// An attempt where there is something to choose.
    #[inline(never)]
    fn attempt_chosen(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if let Err(why) = self.choose(w, h) {
            return Attempt::Stuck { next: 0.0, why: why.into() };
        }
        self.longest = self.longest.max(h);
        let mut result = self.methods[self.now].1.attempt(sys, w, h, tol);
        if self.probation.is_some() {
            result = self.judge(w, h, result);
        } else if self.explicitly() && unfit(&result) {
            self.explicit = None;
            if self.go_implicit(w, "the explicit method cannot get on").is_ok() {
                return Attempt::TooLarge { next: self.longest };
            }
        } else if self.explicitly() && self.steps > 0 && self.inner().near_singular() {
            // (a run that begins at such a position has two ways to go on: an implicit step finds neither)
            self.explicit = None;
            self.implicit = beside_singular(&mut self.o);
            if self.go_implicit(w, "a loop comes near a singular position").is_ok() {
                return Attempt::TooLarge { next: OF_EXPLICIT * self.longest };
            }
        }
        if let Attempt::TooLarge { next } | Attempt::Stuck { next, .. } = result {
            self.refused += 1;
            self.collapsed = next < COLLAPSE * self.reach;
        }
        result
    }

    /// What the explicit method did on probation: kept, continued, or taken back.
    fn judge(&mut self, w: &mut Work, h: f64, result: Attempt) -> Attempt {
        let Some((before, asked, least)) = self.probation else { return result };
        match result {
            Attempt::Good { .. } if self.inner().stiffness() < ROOM => {
                self.probation = None;
                self.tell("nothing stiff any more");
                return result;
            }
            Attempt::TooLarge { next } if next >= least && self.inner().stiffness() < ROOM => return result,
            _ => {}
        }
        self.probation = None;
        self.patience = (2 * self.patience).min(RAREST);
        match self.switch(w, self.methods[before].0) {
            Ok(()) => Attempt::TooLarge { next: asked },
            Err(why) => Attempt::Stuck { next: h, why: why.into() },
        }
    }

    /// Size of the fastest eigenvalue at the present point, roughly, and whether it is a damped mode's, which the explicit method
    /// can tell.
    fn fastest(&mut self, w: &mut Work) -> Option<(f64, bool)> {
        self.methods[0].1.fastest(self.sys, w, self.t, &self.x)
    }
}

fn unfit(result: &Attempt) -> bool {
    matches!(result, Attempt::Stuck { why, .. } if matches!(**why, Failure::Unfit { .. }))
}

impl Method for Auto<'_> {
    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.t = t;
        self.x.copy_from_slice(x);
        self.tried.clear();
        (self.longest, self.refused, self.probation) = (0.0, 0, None);
        (self.reach, self.collapsed) = (0.0, false);
        self.brief = if std::mem::take(&mut self.stretch) < BRIEF { self.brief + 1 } else { 0 };
        let due = self.stretches && self.implicit == "gear" && self.brief >= self.enough;
        if due && self.go_on_with(w, "esdirk").is_ok() {
            self.enough = (2 * self.enough).min(RAREST);
            return;
        }
        self.methods[self.now].1.restart(sys, w, t, x);
    }

    fn begin(&mut self, sys: &System, w: &mut Work, first: f64, tol: &Tolerances) -> f64 {
        match self.look(w, first) {
            Ok(()) => self.methods[self.now].1.begin(sys, w, first, tol),
            Err(_) => first,
        }
    }

    fn settle(&mut self, sys: &System, w: &mut Work, t: f64, h: f64, x: &mut [f64]) -> bool {
        self.methods[self.now].1.settle(sys, w, t, h, x)
    }

    #[inline(always)]
    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if !self.settled() {
            return self.attempt_chosen(sys, w, h, tol);
        }
        self.longest = self.longest.max(h);
        let result = self.methods[self.now].1.attempt(sys, w, h, tol);
        if !matches!(result, Attempt::Good { .. }) {
            self.refused += 1;
        }
        result
    }

    fn fallback(&mut self, w: &mut Work, x: &[f64]) -> Option<f64> {
        self.x.copy_from_slice(x);
        loop {
            let given_up = self.name();
            self.tried.push(given_up);
            let next = std::iter::once(self.implicit).chain(OTHERS).find(|m| !self.tried.contains(m))?;
            self.probation = None;
            self.stretches = false;
            if self.switch(w, next).is_ok() {
                self.tell(&format!("{given_up} could not get on"));
                return Some(self.longest);
            }
        }
    }

    fn gives_up(&mut self, w: &mut Work, x: &[f64]) -> Option<f64> {
        self.x.copy_from_slice(x);
        let (slow, next) = (self.name(), one_step(self.o.reltol));
        if slow == next || self.explicitly() {
            return None;
        }
        self.implicit = next;
        self.stretches = false;
        self.probation = None;
        self.switch(w, next).ok()?;
        self.tell(&format!("{slow} would take too long"));
        Some(self.longest)
    }

    #[inline(always)]
    fn accept(&mut self, t1: f64) {
        self.methods[self.now].1.accept(t1);
        self.reach = self.reach.max(t1 - self.t);
        self.t = t1;
        if !self.settled() {
            self.x.copy_from_slice(self.methods[self.now].1.candidate());
        }
        self.tried.clear();
        (self.longest, self.refused) = (0.0, 0);
        self.steps = self.steps.saturating_add(1);
        self.stretch = self.stretch.saturating_add(1);
        if self.explicitly() {
            self.limited = if self.inner().stiffness() > LIMIT { self.limited + 1 } else { 0 };
        }
    }

    #[inline(always)]
    fn candidate(&self) -> &[f64] {
        self.inner().candidate()
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        self.inner().dense(t, out);
    }

    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        self.methods[self.now].1.interior(sys, tol)
    }

    fn stages(&self) -> Stages<'_> {
        self.inner().stages()
    }

    fn off_course(&self, i: usize) -> f64 {
        self.inner().off_course(i)
    }

    fn leaps(&self) -> bool {
        self.inner().leaps()
    }

    fn behind_jump(&self) -> bool {
        self.inner().behind_jump()
    }

    fn wants_dense_record(&self) -> bool {
        self.inner().wants_dense_record()
    }

    fn pieces(&self) -> usize {
        self.inner().pieces()
    }

    fn fewest_steps(&self) -> f64 {
        self.inner().fewest_steps()
    }

    fn shown(&self) -> usize {
        self.inner().shown()
    }

    fn steps_a_period(&self) -> Option<f64> {
        self.inner().steps_a_period()
    }

    fn starts_at_full_length(&self) -> bool {
        self.inner().starts_at_full_length()
    }

    fn begins_with_slopes(&self) -> bool {
        self.inner().begins_with_slopes()
    }

    #[inline(always)]
    fn lags(&self) -> Lags {
        self.inner().lags()
    }

    fn restarts_at_corners(&self) -> bool {
        self.inner().restarts_at_corners()
    }

    fn stiffness(&self) -> f64 {
        self.inner().stiffness()
    }

    fn corner(&mut self) {
        self.methods[self.now].1.corner();
    }

    fn inputs_changed(&mut self) {
        self.methods[self.now].1.inputs_changed();
    }

    #[inline(always)]
    fn formula(&self) -> usize {
        self.now * FORMULAS + self.inner().formula()
    }

    fn faithful(&self) -> u64 {
        self.inner().faithful()
    }

    fn response(&self, formula: usize, y: f64) -> Option<Complex> {
        self.methods[formula / FORMULAS].1.response(formula % FORMULAS, y)
    }

    fn drift(&self, formula: usize, times: &[f64], w: f64) -> Option<(f64, f64)> {
        self.methods[formula / FORMULAS].1.drift(formula % FORMULAS, times, w)
    }

    fn used(&self) -> Vec<Used> {
        self.used.clone()
    }
}
