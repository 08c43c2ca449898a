//! A run in stretches, each of which can be taken back: for a method that runs a part of the equations by themselves.
use super::super::rows::{Grid, Sink};
use super::super::Method;
use super::{Next, Run, Status, Tick};
use crate::events::Detector;
use crate::rounding::SAME;
use crate::system::Held;

/// A place in a run that it can be taken back to.
pub struct Mark {
    t: f64,
    late: f64,
    x: Vec<f64>,
    held: Held,
    detector: Detector,
    grid: Grid,
    events: usize,
    next: Next,
    kept: f64,
}

impl<S: Sink> Run<'_, S> {
    /// Goes on to `until`. That is no corner: a step ends there, and nothing is forgotten.
    pub fn go_on(&mut self, method: &mut dyn Method, until: f64, tick: &mut Tick) {
        self.until = until;
        self.slack = SAME * (until - self.t);
        // a corner may lie where the last stretch ended, or next to it
        if self.t > 0.0 {
            let corner = self.sys.next_stop(self.w, self.t, until);
            if corner < until && corner - self.t <= self.slack {
                self.t = corner;
            }
            if self.land(method) {
                self.restart(method);
                self.next.h = self.memory.length().or(self.next.h.map(|h| 0.1 * h));
            }
        }
        self.stop = self.sys.next_stop(self.w, self.t, until);
        self.advance(method, tick);
        if self.outcome.status == Status::Ok && self.t < until {
            (self.t, self.late) = (until, 0.0);
        }
    }

    /// What comes from outside (`waves::Input`) is another line from here on, or jumps to it; the next stretch ends at `until`.
    pub fn disturb(&mut self, method: &mut dyn Method, jumps: bool, until: f64) {
        self.until = until;
        self.sys.remember(self.w, &self.x, self.t);
        self.w.past.corner(self.t);
        let jumps = self.slopes_jump(method) || jumps;
        self.stop = self.sys.next_stop(self.w, self.t, until);
        let ahead = self.stop - self.t;
        if jumps {
            self.jump(self.tmax.min(ahead), method);
        }
        self.grid.bent(self.t, ahead);
        if jumps || method.character().restarts_at_corners {
            self.restart(method);
            let known = self.memory.first(method.character().leaps);
            self.next.h = Some(known.unwrap_or(0.1 * ahead.min(self.next.normal).min(self.tmax)));
        } else {
            method.corner();
        }
    }

    /// The run goes on beyond what was said to be its end.
    pub fn lengthen(&mut self, tstop: f64) {
        self.a.tstop = tstop;
        self.grid.reach(tstop);
        self.ahead = self.sys.time_only.ahead(&self.sys.waves, tstop);
    }

    pub fn mark(&self) -> Mark {
        Mark {
            t: self.t,
            late: self.late,
            x: self.x.clone(),
            held: self.w.held(),
            detector: self.detector.clone(),
            grid: self.grid.clone(),
            events: self.outcome.events.len(),
            next: self.next,
            kept: self.shown.kept,
        }
    }

    /// Back to where `mark` was made; the method starts there anew.
    pub fn rewind(&mut self, mark: &Mark, method: &mut dyn Method) {
        (self.t, self.late, self.next, self.shown.kept) = (mark.t, mark.late, mark.next, mark.kept);
        self.x.copy_from_slice(&mark.x);
        self.w.restore(&mark.held);
        self.detector = mark.detector.clone();
        self.grid = mark.grid.clone();
        self.outcome.events.truncate(mark.events);
        self.restart(method);
    }
}
