//! Events of a clock, @(timer(start, period)), and of a way that a value has gone, @(absdelta(x, way)).
//!
//! The flag of such an event turns each time that it fires, and then waits for the next one: a step ends there.
use super::ast::E;
use super::elaborate::{Answer, Elaborator};
use super::folded::Mode;
use emsim_expr::graph::{Fun, Id};

impl Elaborator<'_> {
    /// timer(start, period, tolerance, enable): does it fire where a run begins, and later?
    pub fn timer(&mut self, trigger: E) -> Answer<(Option<Id>, Id)> {
        let at = self.place(trigger);
        let arguments = self.event_arguments(trigger, 1, 4)?;
        let given = arguments.get(1).filter(|&&e| !self.is_missing(e));
        let start = self.plain_number(arguments[0])?.id;
        let period = match given {
            Some(&e) => self.plain_number(e)?.id,
            None => self.g.constant(0.0),
        };
        let (at_once, later) = match (self.g.value(start), self.g.value(period)) {
            (Some(start), Some(period)) => {
                if !(start.is_finite() && period.is_finite() && period >= 0.0) {
                    let what = format!("a timer from {start} s on, every {period} s");
                    return self.stop(at, what, "a period is positive, or 0 for once");
                }
                self.instants(start, period)
            }
            _ if self.moves_between_events(start) || self.moves_between_events(period) => {
                let hint = "let an event set a variable, and the timer read that";
                return self.stop(at, "a timer whose start or period hangs on voltages", hint);
            }
            _ => (None, self.moved_timer(start, period)),
        };
        let at_once = at_once.map(|on| self.enabled(arguments.get(3), on)).transpose()?;
        Ok((at_once, self.enabled(arguments.get(3), later)?))
    }

    /// Instants of known times: does it fire where a run begins, and does it just fire?
    pub fn instants(&mut self, start: f64, period: f64) -> (Option<Id>, Id) {
        // the first instant in the run
        let repeats = period > 0.0;
        let first = if start < 0.0 && repeats { start + (-start / period).ceil() * period } else { start };
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let at_once = (first == 0.0).then_some(one);
        if !repeats && first <= 0.0 {
            return (at_once, zero);
        }
        let next = self.g.constant(if first > 0.0 { first } else { period });
        let fired_so_far = self.g.symbol();
        let before = self.mode(Mode::Kept(fired_so_far));
        let (period, time) = (self.g.constant(period), self.g.time());
        let since = self.g.mul(fired_so_far, period);
        let next = self.g.add(next, since);
        let (past, left) = (self.g.sub(time, next), self.g.sub(next, time));
        let turned = self.turns(past, if repeats { left } else { one });
        let sum = self.g.add(before, turned);
        self.finals.push((fired_so_far, sum));
        (at_once, turned)
    }

    /// Does what fires by a flag that turns just fire? The flag turns up where `past` comes above 0, down where `left` is not above it.
    fn turns(&mut self, past: Id, left: Id) -> Id {
        let up = self.g.flag(self.modes.len() as u32);
        let beyond = self.g.select(up, left, past);
        let (up, begun) = (self.mode(Mode::Above(beyond)), self.begun());
        let was = self.mode(Mode::Kept(up));
        let one = self.g.constant(1.0);
        let was_not = self.g.sub(one, was);
        let turned = self.g.select(up, was_not, was);
        self.g.mul(turned, begun)
    }

    /// A start and a period that events set: it fires at the first instant start + k period behind the one at which it fired last.
    fn moved_timer(&mut self, start: Id, period: Id) -> Id {
        let last = self.g.symbol();
        // so near to an instant, in periods, is on it: rounding of start + k period
        let [zero, one, never, on_it] = [0.0, 1.0, -1.0, 1e-6].map(|v| self.g.constant(v));
        let (begun, time) = (self.begun(), self.g.time());
        let repeats = self.g.not_less(zero, period);
        let repeats = self.g.select(repeats, zero, one);
        let every = self.g.select(repeats, period, one);
        let counted = |run: &mut Self, until: Id| {
            let since = run.g.sub(until, start);
            run.g.div(since, every)
        };
        // behind the last one, and none that was past when an event changed them
        let fired = counted(self, last);
        let fired = self.g.add(fired, on_it);
        let fired = self.g.call(Fun::Floor, fired);
        let fired = self.g.add(fired, one);
        let now = self.mode(Mode::Kept(time));
        let past = counted(self, now);
        let past = self.g.sub(past, on_it);
        let past = self.g.call(Fun::Ceil, past);
        let whole = self.greater(fired, past);
        let whole = self.greater(whole, zero);
        let whole = self.g.select(repeats, whole, zero);
        let whole = self.g.mul(whole, every);
        let next = self.g.add(start, whole);
        let gone = self.g.not_less(last, next);
        let (past, left) = (self.g.sub(time, next), self.g.sub(next, time));
        let (past, left) = (self.g.select(gone, never, past), self.g.select(gone, one, left));
        let turned = self.turns(past, left);
        let (at, before) = (self.mode(Mode::Kept(next)), self.mode(Mode::Kept(last)));
        let held = self.g.select(turned, at, before);
        // an instant at which a run begins is still to come
        let first = self.g.constant(-f64::MIN_POSITIVE);
        let held = self.g.select(begun, held, first);
        self.finals.push((last, held));
        turned
    }

    fn greater(&mut self, a: Id, b: Id) -> Id {
        let c = self.g.not_less(a, b);
        self.g.select(c, a, b)
    }

    /// absdelta(x, way, tolerances, enable): where a run begins, and each time that x has gone so far from where it fired last.
    pub fn absdelta(&mut self, trigger: E) -> Answer<(Option<Id>, Id)> {
        let at = self.place(trigger);
        let arguments = self.event_arguments(trigger, 2, 5)?;
        let (x, way) = (self.plain_number(arguments[0])?.id, self.known(arguments[1], "the way of absdelta")?);
        if !(way > 0.0 && way.is_finite()) {
            return self.stop(at, format!("absdelta with a way of {way}"), "it must be positive");
        }
        let last = self.g.symbol();
        let [way, one] = [way, 1.0].map(|v| self.g.constant(v));
        let gone = self.g.sub(x, last);
        let gone = self.magnitude(gone);
        let (past, left) = (self.g.sub(gone, way), self.g.sub(way, gone));
        let turned = self.turns(past, left);
        // what jumps is taken behind its jump
        let here = if self.moves_between_events(x) { self.mode(Mode::Kept(x)) } else { x };
        let (before, begun) = (self.mode(Mode::Kept(last)), self.begun());
        let held = self.g.select(turned, here, before);
        let held = self.g.select(begun, held, x);
        self.finals.push((last, held));
        let fires = self.enabled(arguments.get(4), turned)?;
        Ok((Some(self.enabled(arguments.get(4), one)?), fires))
    }
}
