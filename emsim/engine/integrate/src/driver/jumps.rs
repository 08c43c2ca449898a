//! At a corner of a source, an edge or an event: what jumps there, and the point from which the run goes on.
use super::super::rows::{undetermined, Sink};
use super::super::Method;
use super::Run;
use crate::clocked::Trouble;
use crate::newton::Failure;
use crate::rounding::SAME;

/// ... or ten times as much, so often, where that cannot be solved.
const LONGER: usize = 4;

impl<S: Sink> Run<'_, S> {
    /// At a corner or an edge: flags flip, values jump, the next stop is found. True when something jumped. Another one
    /// beside it, to rounding, is of the same time: nothing can be solved in between.
    pub(super) fn land(&mut self, method: &mut dyn Method) -> bool {
        let mut jumped = false;
        self.sys.remember(self.w, &self.x, self.t);
        self.w.past.corner(self.t);
        for _ in 0..self.sys.rounds() {
            let before = self.outcome.events.len();
            let bends = self.slopes_jump(method);
            let jumps = self.tick()
                || bends
                || self.w.past.corner_at(self.t)
                || self.w.logic.due(self.t)
                || self.sys.jumps_at(self.t)
                || self.sys.hidden_corner(self.t).is_some();
            let (t, events) = (self.t, &mut self.outcome.events);
            self.sys.flip_edges(self.w, t, false, |k, on| events.push((t, k, on)));
            let flipped = self.outcome.events.len() > before;
            self.w.counters.events += u64::from(flipped);
            self.stop = self.sys.next_stop(self.w, t, self.until);
            if jumps || flipped {
                self.jump(self.tmax, method);
                jumped = true;
            }
            if self.stop > self.same(self.t) || self.stop >= self.until {
                break;
            }
            (self.t, self.late) = (self.stop, 0.0);
        }
        jumped
    }

    /// What clocks have due happens at the point that stands.
    pub(super) fn tick(&mut self) -> bool {
        let ticked = self.sys.tick(self.w, &self.x, self.t);
        self.unless_trouble(ticked).unwrap_or(false)
    }

    fn unless_trouble<T>(&mut self, done: Result<T, Trouble>) -> Option<T> {
        let why = match done {
            Ok(found) => return Some(found),
            Err(Trouble::Signal(signal)) => Failure::Signal { signal },
            Err(Trouble::Unit(card, said)) => Failure::Foreign { card, said },
        };
        self.fail(0.0, why, vec![]);
        None
    }

    /// FMUs for model exchange hear of the step that was accepted; true where one of them asks for an event.
    pub(super) fn hear(&mut self) -> bool {
        if self.sys.clocked.exchanges.is_empty() {
            return false;
        }
        let heard = self.w.clocked.completed(&self.sys.clocked, &self.x, self.t);
        self.unless_trouble(heard).is_some() && self.w.clocked.asks()
    }

    /// Their events at the point that stands.
    fn exchange(&mut self) {
        if self.w.clocked.asks() {
            let done = self.sys.exchange(self.w, &mut self.x, self.t);
            let _ = self.unless_trouble(done);
            self.stop = self.sys.next_stop(self.w, self.t, self.until);
        }
    }

    /// An event that an FMU asks for behind a step.
    pub(super) fn step_event(&mut self, width: f64, method: &mut dyn Method) {
        self.sys.remember(self.w, &self.x, self.t);
        self.w.past.corner(self.t);
        self.w.counters.events += 1;
        self.slopes_jump(method);
        self.stop = self.sys.next_stop(self.w, self.t, self.until);
        self.jump(width.min(self.tmax), method);
        self.grid.bent(self.t, self.stop - self.t);
        self.restart(method);
    }

    /// Up to here it is the time t: steps are longer.
    pub(super) fn same(&self, t: f64) -> f64 {
        t + (64.0 * f64::EPSILON * t).max(1e-18 * self.a.tstop)
    }

    /// Is a corner of a source a jump to what the method's next step begins with, or to what a condition reads?
    pub(super) fn slopes_jump(&mut self, method: &dyn Method) -> bool {
        let reads = self.sys.conditions_read();
        if !method.character().begins_with_slopes && reads.is_empty() {
            return false;
        }
        let (any, read) = *self.slopes.get_or_insert_with(|| {
            let found = undetermined(self.sys);
            (found.contains(&true), reads.iter().any(|&k| found[k]))
        });
        if method.character().begins_with_slopes {
            any
        } else {
            read
        }
    }

    /// Behind a step of length h over an impulse: the next one holds nothing of it but the rounding of voltages of 1 / h, over the
    /// resistance between them, the one behind that the rounding of those, and so on until nothing moves.
    fn pass_impulse(&mut self, h: f64) {
        let mut last = f64::INFINITY;
        loop {
            let before = self.x.clone();
            if !self.settle(self.t, h, false) {
                break;
            }
            self.t += h;
            let moved: Vec<f64> = self.x.iter().zip(&before).map(|(a, b)| (a - b).abs()).collect();
            let now = self.tol.largest_move(&moved, &self.x, &before);
            // what no longer falls by half is no rounding of the impulse
            if now <= 1.0 || !(now < 0.5 * last) {
                break;
            }
            last = now;
        }
    }

    /// Something has jumped at t, from where the next stop is known: a step of nearly no length gives the values after it, and
    /// their time: the method's own, or an implicit one.
    pub(super) fn jump(&mut self, width: f64, method: &mut dyn Method) {
        let (rounds, mut asked) = (self.sys.rounds(), 0);
        for again in 0..rounds {
            self.exchange();
            // latches that are let go together fall to one side when they are asked one by one
            let (one, seen) = (2 * again > rounds, self.outcome.events.len());
            // edges that are due at once
            let t = self.t;
            let due = self.stop <= t;
            if due {
                self.tick();
                let events = &mut self.outcome.events;
                self.sys.flip_edges(self.w, t, one, |k, on| events.push((t, k, on)));
            }
            if due || again > 0 {
                self.stop = self.sys.next_stop(self.w, t, self.until);
            }
            let least = (SAME * width.min(self.stop - t)).max(self.same(t) - t);
            let least = self.sys.hidden_corner(t).map_or(least, |end| least.max(2.0 * (end - t)));
            // rounding may keep so short a step from converging: a flux of so much over h is no voltage
            let known = method.settle(self.sys, self.w, t, least, &mut self.x).then_some(least);
            let lengths = || (0..LONGER).map(|k| least * 10f64.powi(k as i32));
            let longer = known.or_else(|| lengths().find(|&h| self.settle(t, h, false)));
            // where none does, no time has passed
            let h = longer.unwrap_or(least);
            self.t = t + h;
            if self.sys.twice_bent.is_some() && longer.is_some() {
                self.pass_impulse(h);
            }
            self.late = 0.0;
            let before = self.w.flags.clone();
            let settled = !self.sys.settle_flags(self.w, &self.x, self.t, one);
            for (k, (old, new)) in before.iter().zip(&self.w.flags).enumerate() {
                if old != new {
                    self.outcome.events.push((self.t, k, *new != 0.0));
                }
            }
            let turned = self.outcome.events.len() > seen;
            let asks = self.w.clocked.look(&self.sys.clocked, &self.x);
            if settled && !asks && (self.stop > self.t || again > 0 && !turned) && !self.laws_ask(width, &mut asked) {
                break;
            }
            if turned && again + 1 == rounds {
                return self.contradicts(h);
            }
        }
        // over a step of no length slopes are rounding
        if self.slopes_jump(method) || self.shown.settles || self.modes.is_some() {
            self.find_forces(width);
        }
        if self.t >= self.a.tstart {
            self.record.row(self.sys, self.w, self.t, &self.x);
            self.record.corner(self.shown.kept);
            self.record.corner(self.t);
            self.grid.last = self.t;
        }
        self.record.jump(self.sys, self.w, self.t, &self.x);
    }
}
