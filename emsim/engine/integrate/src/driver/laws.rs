//! Where a law with modes (friction, a rigid stop) asks for another mode: all of them are decided together by modes.rs, then values
//! follow as behind any jump.
use super::super::rows::{Forces, Sink};
use super::event::LATE;
use super::Run;
use crate::model::Law;
use crate::modes::{Modes, Short, INSTANT};
use crate::newton::Failure;
use crate::rounding::SAME;

/// Steps by which the modes are asked are no shorter than those of this part of the longest one.
const SHORTEST: f64 = 1e-5;
/// So often at one time, behind a jump.
const AGAIN: u32 = 4;

impl<S: Sink> Run<'_, S> {
    /// Flags of laws among those that fired at t, in a step of this width: the modes that follow. False where there was none.
    pub(super) fn turn_laws(&mut self, width: f64) -> bool {
        let fired: Vec<usize> = self.detector.fired().to_vec();
        fired.iter().any(|&k| self.sys.flags[k].law == Law::Mode) && self.decide(width, &fired)
    }

    /// Values have jumped at t: do laws ask for other modes? `times` is how often they have done so here.
    pub(super) fn laws_ask(&mut self, width: f64, times: &mut u32) -> bool {
        if self.modes.is_none() || *times >= AGAIN {
            return false;
        }
        self.find_forces(width);
        *times += 1;
        Modes::ask(self.sys, self.w, &self.x, self.t) && self.decide(width, &[])
    }

    /// Before the first step: which laws stick, which slide, and efforts where nothing has given those.
    pub(super) fn begin_laws(&mut self, width: f64, known: bool) {
        if self.modes.is_some() {
            let t = self.t;
            self.decide(width, &[]);
            self.t = t;
            self.settle(t, SAME * width, true);
        } else if known {
            return;
        }
        self.find_forces(width);
    }

    pub(super) fn decide(&mut self, width: f64, fired: &[usize]) -> bool {
        let Some(modes) = &mut self.modes else { return false };
        // a step that an event has cut is no measure of how fast things move
        let width = width.max(SHORTEST * self.tmax).min(self.until - self.t).max(1e-9 * self.a.tstop);
        let least = (INSTANT * width).max(64.0 * f64::EPSILON * self.t).max(1e-18 * self.a.tstop);
        let short = Short::new(width, least, 2.0 * LATE * self.tol.reltol * width, self.a.tstop);
        let before = self.w.flags.clone();
        let decided = modes.decide(self.sys, self.w, &mut self.x, &mut self.t, short, fired, &self.tol);
        for (t, h, x) in modes.jolts.drain(..) {
            self.record.jolt(self.sys, self.w, (t, h), &x);
        }
        self.outcome.stepped.clone_from(&modes.stepped);
        self.outcome.jammed.clone_from(&modes.jammed);
        self.late = 0.0;
        if !decided {
            match modes.blocked {
                Some(law) => {
                    let flag = self.sys.laws.list[law].flags[0];
                    self.fail(short.instant, Failure::Blocked { flag }, vec![]);
                }
                None => self.contradicts(short.instant),
            }
            return false;
        }
        let mut changed = false;
        for (k, flag) in
            self.sys.flags.iter().enumerate().filter(|(k, f)| f.law.of_modes() && before[*k] != self.w.flags[*k])
        {
            changed = true;
            if flag.law == Law::Mode {
                self.outcome.events.push((self.t, k, self.w.flags[k] != 0.0));
            }
        }
        changed || !fired.is_empty()
    }

    /// Efforts at (t, x) by way of slopes: over a step of no length they are rounding.
    pub(super) fn find_forces(&mut self, width: f64) {
        let everything = || (0..self.sys.n as u32).collect::<Vec<_>>();
        let begin = self.shown.begin.get_or_insert_with(|| Forces::new(self.sys, &everything()));
        if let Some(forces) = begin {
            let h = Forces::behind(width.min(self.stop.max(self.t + 1e-9 * self.a.tstop) - self.t), self.a.tstop);
            forces.settle(self.sys, self.w, (self.t, &mut self.x), h, &self.tol);
        }
    }
}
