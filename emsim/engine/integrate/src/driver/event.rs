//! Events inside attempted steps: found on dense output, stepped onto, gone through.

use super::super::rows::Sink;
use super::super::{Attempt, Method};
use super::{Run, Tick};
use crate::events::{Candidate, Located};

/// So often a step is taken anew to end on an event, ...
const ONTO: usize = 6;
/// ... until it ends behind it by less than this part of reltol, in parts of itself.
pub const LATE: f64 = 0.1;

/// What `Run::event` found in an attempted step.
pub enum Event {
    None,
    /// the shortened step failed; the length to try
    Refused(f64),
    /// the run was stopped while rows were made
    Ended,
    /// the run stands behind the event; the length of the next step
    Passed(f64),
}

impl<S: Sink> Run<'_, S> {
    /// The earliest event in the attempted step, which ends at t1.
    fn locate(&mut self, method: &dyn Method, t1: f64, peaks: bool) -> Option<Located> {
        let (sys, t, end) = (self.sys, self.t, method.candidate());
        let inside = |t: f64, out: &mut [f64]| method.dense(t, out);
        let turn = sys.turning().iter().map(|p| (p.at(t1, end) - p.at(t, &self.x)).abs()).fold(0.0, f64::max);
        let candidate = Candidate { end, dense: &inside, long: self.dense, turn, reltol: self.tol.reltol, peaks };
        self.detector.locate(sys, self.w, &candidate, t, t1, &mut self.scratch)
    }

    /// The attempted step again, shorter, until its end, `at`, says that the event is there. Err: the length to try.
    fn step_onto(
        &mut self,
        method: &mut dyn Method,
        at: &mut f64,
        t1: f64,
        (step, smallest): (f64, f64),
    ) -> Result<(), f64> {
        let (sys, t) = (self.sys, self.t);
        let mut again = method.attempt(sys, self.w, *at - t, &self.tol);
        for _ in 0..ONTO {
            if !matches!(again, Attempt::Good { .. }) {
                break;
            }
            let least = (1e-12 * step).max(smallest);
            let near = (LATE * self.tol.reltol * (*at - t)).max(least);
            let Some(due) = self.detector.due(sys, self.w, method.candidate(), *at) else {
                // the shorter step knows better where that was
                match self.locate(method, *at, false) {
                    Some(Located::Turn(first)) if first < *at - near && first - t > smallest => *at = first,
                    _ => break,
                }
                again = method.attempt(sys, self.w, *at - t, &self.tol);
                continue;
            };
            // a little behind it: a short way is known well
            let goal = *at + due + (0.5 * near).min(due.abs().max(least));
            if (-near..=0.0).contains(&due) || goal >= t1 || goal - t <= smallest {
                break;
            }
            *at = goal;
            self.detector.keep_due(due + near);
            again = method.attempt(sys, self.w, *at - t, &self.tol);
        }
        match again {
            Attempt::TooLarge { next } | Attempt::Stuck { next, .. } => Err(next),
            Attempt::Good { .. } => Ok(()),
        }
    }

    /// A flag that turns inside the attempted step (t, t1]: the step ends there, the flag flips, the method restarts.
    #[inline(never)]
    pub(super) fn event(
        &mut self,
        method: &mut dyn Method,
        t1: f64,
        (step, smallest): (f64, f64),
        next: f64,
        failures: &mut u32,
        tick: &mut Tick,
    ) -> Event {
        let (sys, t) = (self.sys, self.t);
        // a step that ends at a peak is as long as it is to be
        let ends_there = (t1 - self.peak).abs() <= 1e-9 * step;
        let asks = !ends_there && self.o.fixed_step.is_none();
        let found = match self.locate(method, t1, asks) {
            Some(Located::Peak(at)) if at - t > smallest => {
                self.w.counters.rejected += 1;
                self.peak = at;
                return Event::Refused(at - t);
            }
            Some(Located::Peak(_)) => self.locate(method, t1, false),
            found => found,
        };
        let Some(Located::Turn(mut at)) = found else { return Event::None };
        if at < t1 && at - t > smallest {
            if let Err(next) = self.step_onto(method, &mut at, t1, (step, smallest)) {
                self.w.counters.rejected += 1;
                *failures += 1;
                return Event::Refused(next.min(0.5 * (at - t)).max(smallest));
            }
        }
        // an event at the very start of the step: nothing has moved yet, the candidate belongs to t1
        let at_once = at < t1 && at - t <= smallest;
        let te = if at_once { t + smallest } else { at }.min(t1);
        *failures = 0;
        self.late = 0.0;
        self.t = te;
        if at_once {
            self.tol.observe(&self.x, self.t);
        } else {
            self.grid.arrive((t, te), (&self.x, method.candidate()), sys, self.w);
            method.accept(te);
            self.w.counters.steps += 1;
            self.move_on(method);
            if !self.keep(method, tick) {
                return Event::Ended;
            }
        }
        self.w.past.corner(te);
        // the flags flip, then the algebraic unknowns jump
        sys.remember(self.w, &self.x, te);
        self.tick();
        for &k in self.detector.fired().iter().filter(|&&k| !sys.flags[k].law.of_modes()) {
            self.sys.flip(self.w, k);
            self.outcome.events.push((te, k, self.w.flags[k] != 0.0));
        }
        self.w.counters.events += 1;
        self.turn_laws(step);
        if let Some(k) = self.detector.flipped(sys, self.w, te, self.a.tstop) {
            if !self.outcome.resting.contains(&k) {
                self.outcome.resting.push(k);
            }
        }
        self.slopes_jump(method);
        self.stop = self.sys.next_stop(self.w, self.t, self.until);
        self.jump(step.min(self.tmax), method);
        self.grid.bent(self.t, self.stop - self.t);
        self.restart(method);
        let fraction = if self.dense { 0.25 } else { 0.02 };
        let cautious = (fraction * next.min(self.tmax)).max(0.1 * (te - t).min(next));
        let known = self.memory.first(method.character().leaps);
        Event::Passed(known.unwrap_or(cautious).max(smallest))
    }
}
