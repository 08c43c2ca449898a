//! What the loop over steps does now and then: kept out of it, so that what runs at every step lies close together.

use super::super::rows::Sink;
use super::super::Method;
use super::{newton, Run, Status, Tick, TICK};
use crate::newton::Failure;
use crate::op;
use crate::rounding::{ROUNDED, SAME};

/// A run that advances less than `SAME` of its span in `PATIENCE` steps, so many times `TICK`, is stopped: it would need 2e14 of them.
const PATIENCE: u64 = 200_000;
const _: () = assert!(PATIENCE % TICK == 0);
/// A step over a corner may take this part of the next stretch.
const LEAP: f64 = 1e-4;
/// So many attempts at one step in vain are the end.
pub const FAILURES: u32 = 60;

/// What the loop remembers from step to step.
#[derive(Default)]
pub struct StepState {
    pub h: f64, // of the next step
    pub first: f64,
    pub normal: f64, // of steps between corners
    pub failures: u32,
    pub count: u64,
    pub still: bool,  // nothing moves by itself
    pub coarse: bool, // rows want steps that end on them
    pub gave_up: Option<(f64, Failure, Vec<String>)>,
    pub mark: f64,   // time at the last look for progress
    pub creeps: u64, // looks in a row at steps of rounding's length
}

impl StepState {
    /// A step was good.
    pub fn passed(&mut self) {
        if self.failures > 0 || self.gave_up.is_some() {
            self.forget();
        }
    }

    #[cold]
    #[inline(never)]
    fn forget(&mut self) {
        (self.failures, self.gave_up) = (0, None);
    }
}

impl<S: Sink> Run<'_, S> {
    /// Is the run to go on? Looked at every `TICK` steps.
    #[cold]
    #[inline(never)]
    pub(super) fn looks_up(&mut self, s: &mut StepState, method: &mut dyn Method, tick: &mut Tick) -> bool {
        // in so many steps so short, currents are roundings of charges, which a method does not outgrow: another one begins anew
        let creeps = s.h < ROUNDED * self.tmax && self.o.fixed_step.is_none();
        s.creeps = if creeps { s.creeps + 1 } else { 0 };
        if s.creeps > TICK && method.fallback(self.w, &self.x).is_some() {
            (s.h, s.creeps) = (s.first, 0);
            return true;
        }
        // so many steps for so little: the run would never end
        if s.count % PATIENCE == 0 {
            if self.t - s.mark < SAME * self.a.tstop && self.o.fixed_step.is_none() {
                self.fail(s.h, diverged(), vec![format!("{PATIENCE} steps without getting on")]);
                return false;
            }
            s.mark = self.t;
        }
        if !tick(self.t, s.h, self.w.counters.steps, self.w.counters.events) {
            self.outcome.status = Status::Interrupted;
            return false;
        }
        if let Some(why) = self.monitor.cost(s.count, self.t, s.h, &self.tol) {
            self.fail(s.h, why, vec![]);
            return false;
        }
        true
    }

    /// Newton's method gave up in an attempted step. Is there another way to go on?
    #[cold]
    #[inline(never)]
    pub(super) fn stuck(
        &mut self,
        s: &mut StepState,
        method: &mut dyn Method,
        (step, smallest): (f64, f64),
        (next, why): (f64, Box<Failure>),
    ) -> bool {
        let fixed = self.o.fixed_step.is_some();
        self.w.counters.newton_failures += 1;
        s.failures += 1;
        if next > smallest && s.failures <= FAILURES && !fixed {
            s.h = next;
            return true;
        }
        let last = fixed || self.blow_up.unknown().is_some();
        if let Some(over) = if last { None } else { self.creeps_over(step, method) } {
            self.restart(method);
            (s.h, s.failures) = (over, 0);
            return true;
        }
        // what is told is why the first method gave up, where others were tried after it
        let [halved, by] = self.tried(step, method);
        let (step, why, tried) = s.gave_up.get_or_insert_with(|| (step, *why, vec![halved]));
        tried.push(by);
        if let Some(next) = if last { None } else { method.fallback(self.w, &self.x) } {
            (s.h, s.failures) = (next, 0);
            return true;
        }
        let (step, why, tried) = (*step, why.clone(), std::mem::take(tried));
        let why = self.named(step, why);
        self.fail(step, why, tried);
        false
    }

    /// Of values that are not finite, the row they come from.
    fn named(&mut self, step: f64, why: Failure) -> Failure {
        let Failure::NotFinite { .. } = why else { return why };
        self.sys.eval(self.w, &self.x, self.t);
        let q0 = self.w.q.clone();
        let begin = (self.t, self.x.as_slice(), q0.as_slice());
        let found = newton(self.sys, &mut self.newton)
            .and_then(|n| n.whence(self.sys, self.w, begin, (step, self.tmax), &self.tol));
        found.map_or(why, |unknown| Failure::NotFinite { unknown })
    }

    /// An event cannot be located. Is there another method?
    #[cold]
    #[inline(never)]
    pub(super) fn lost(&mut self, s: &mut StepState, method: &mut dyn Method, smallest: f64) -> bool {
        if let Some(next) = method.fallback(self.w, &self.x) {
            (s.h, s.failures) = (next, 0);
            return true;
        }
        self.fail(smallest, diverged(), vec!["locating an event".into()]);
        false
    }

    /// A step ended on a corner or a known edge.
    #[cold]
    #[inline(never)]
    pub(super) fn landed(&mut self, s: &mut StepState, method: &mut dyn Method, smallest: f64) {
        self.w.counters.breakpoints += 1;
        self.record.corner(self.shown.kept);
        let jumped = self.land(method);
        let ahead = self.stop - self.t;
        self.grid.bent(self.t, ahead);
        if self.o.fixed_step.is_some() {
            s.h = s.first;
            match jumped {
                true => self.restart(method),
                false => method.corner(),
            }
        } else if jumped || method.character().restarts_at_corners {
            self.restart(method);
            let known = self.memory.first(method.character().leaps);
            s.h = known.unwrap_or(0.1 * ahead.min(s.normal).min(self.tmax)).max(smallest);
        } else {
            method.corner();
            self.memory.restart(self.sys.stretch(self.w, self.t));
            let known = self.memory.length().unwrap_or(s.normal.min(self.tmax));
            s.h = s.h.max(known).min(if method.character().full_length { ahead } else { 0.5 * ahead });
        }
    }

    /// Steps that have shrunk to nearly nothing, and then failed, are at a corner that the equations themselves have (the
    /// current of a diode without capacitance that an inductor turns off). One implicit step leads over it, the shortest
    /// that rounding allows, a longer one each time it was not enough; its length, for the next step.
    fn creeps_over(&mut self, step: f64, method: &mut dyn Method) -> Option<f64> {
        let width = self.tmax.min(self.stop - self.t);
        if step > ROUNDED * self.tmax {
            return None;
        }
        let again = self.t < self.crept.0 + LEAP * width;
        // never so short that time stands still
        let least = 64.0 * f64::EPSILON * self.t;
        let (t, mut h) = (self.t, if again { 10.0 * self.crept.1 } else { SAME * width }.max(least));
        let tol = self.tol.at_least(1e-5);
        while h <= least.max(LEAP * width) {
            if newton(self.sys, &mut self.newton)
                .is_some_and(|n| op::consistent(self.sys, n, self.w, &mut self.x, None, (t, h), &tol, false))
            {
                self.crept = (t, h);
                (self.t, self.late) = (t + h, 0.0);
                self.stop = self.sys.next_stop(self.w, self.t, self.until);
                self.jump(self.tmax, method);
                return Some(h);
            }
            h *= 10.0;
        }
        None
    }
}

fn diverged() -> Failure {
    Failure::Diverged { unknown: 0, row: 0 }
}
