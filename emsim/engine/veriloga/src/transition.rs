//! transition(): what changes at events, with ramps in place of jumps.
//!
//! At each change the ramp's origin, slope and end are made of values just before it, and kept until the next one (events.rs). A
//! flag turns at the end of each ramp, as that of a timer does, so a step ends there. What is late is the whole course: the filter does
//! not hang on time. LRM 4.5.8: a ramp that is interrupted goes on from where it is; one that turns round has its old destination as
//! origin, one that goes further on keeps its own; its slope is the way from the origin in the time for rise or fall.
use super::ast::E;
use super::elaborate::{Answer, Elaborator, Num};
use super::folded::{symbol_of, Mode};
use super::source::Place;
use emsim_expr::graph::{Id, Node};
use std::collections::HashSet;

impl Elaborator<'_> {
    /// transition(x, delay, rise, fall): at operating points and in sweeps x itself.
    pub fn transition(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let mut times = [0.0; 3];
        for k in 0..3 {
            times[k] = match arguments.get(k + 1) {
                Some(&e) => self.known(e, "a time of transition")?,
                None if k == 2 => times[1],
                None => 0.0,
            };
            if !(times[k] >= 0.0 && times[k].is_finite()) {
                let what = format!("transition with a time of {} s", times[k]);
                return self.stop(at, what, "delay, rise and fall are 0 or positive");
            }
        }
        let [delay, rise, fall] = times;
        if self.value_of(&x).is_some() {
            return Ok(x);
        }
        if self.frame.at_event {
            return self.stop(at, "transition at an event", "keep the value there, and ramp it outside of the event");
        }
        if self.moves_between_events(x.id) {
            let hint = "compare it, transition(V(a) > 0.5 ? 1 : 0, ..), or keep it at an event";
            return self.stop(at, "transition of a value that changes between events", hint);
        }
        let mut id = x.id;
        if rise > 0.0 || fall > 0.0 {
            id = self.ramped(id, [rise, fall]);
        }
        if delay > 0.0 {
            id = self.mode(Mode::Late(id, delay));
        }
        Ok(self.real(id))
    }

    /// Does it hang on anything but conditions and what is kept?
    pub fn moves_between_events(&self, x: Id) -> bool {
        let (mut look, mut seen) = (vec![x], HashSet::new());
        while let Some(id) = look.pop() {
            let moves = match self.g.node(id) {
                Node::NotLess(..) => continue,
                Node::Unknown(_) | Node::Time | Node::Wave(_) => true,
                Node::Symbol(_) => self.moving.contains(&id),
                Node::Flag(k) => matches!(self.modes[k as usize], Mode::Late(..)),
                node => {
                    look.extend(node.operands().filter(|o| seen.insert(*o)));
                    false
                }
            };
            if moves {
                return true;
            }
        }
        false
    }

    /// x with ramps that take so long for all of a way, up and down.
    pub fn ramped(&mut self, x: Id, times: [f64; 2]) -> Id {
        // what holds from the last change on
        let [origin, slope, end, idle, output] = std::array::from_fn(|_| self.g.symbol());
        let [zero, one, never] = [0.0, 1.0, -1.0].map(|v| self.g.constant(v));
        let was = self.mode(Mode::Kept(x));
        let begun = self.mode(Mode::Kept(one));
        let same = self.equals(x, was);
        let other = self.g.sub(one, same);
        let mut changed = self.g.mul(begun, other);
        if let Some(run) = symbol_of("tran") {
            let run = self.g.given(run);
            changed = self.g.mul(changed, run);
        }
        let up = self.g.flag(self.modes.len() as u32);
        let time = self.g.time();
        let (past, left) = (self.g.sub(time, end), self.g.sub(end, time));
        let (waits, stays) = (self.g.select(idle, never, past), self.g.select(idle, one, left));
        let beyond = self.g.select(up, stays, waits);
        let up = self.mode(Mode::Above(beyond));
        let was_up = self.mode(Mode::Kept(up));
        let same = self.equals(up, was_up);
        let turned = self.g.sub(one, same);
        let ended = self.g.mul(begun, turned);
        let new = self.next_ramp([x, was], changed, [origin, output], times);
        let states = [
            (origin, new[0], None, x),
            (slope, new[1], Some(zero), zero),
            (end, new[2], None, zero),
            (idle, new[3], Some(one), one),
        ];
        for (symbol, new, at_end, first) in states {
            let kept = self.mode(Mode::Kept(symbol));
            let kept = at_end.map_or(kept, |v| self.g.select(ended, v, kept));
            let held = self.g.select(changed, new, kept);
            let held = self.g.select(begun, held, first);
            self.finals.push((symbol, held));
        }
        let way = self.g.mul(slope, past);
        let y = self.g.add(x, way);
        self.finals.push((output, y));
        y
    }

    /// Origin, slope and end of the ramp that begins with a change to x, and 1 where it is a jump. The old origin and the output are
    /// symbols.
    fn next_ramp(&mut self, [x, was]: [Id; 2], changed: Id, [origin, output]: [Id; 2], times: [f64; 2]) -> [Id; 4] {
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let time = self.g.time();
        let [y, first, begins] = [output, origin, time].map(|e| self.mode(Mode::Kept(e)));
        let (left, old_left) = (self.g.sub(x, y), self.g.sub(was, y));
        let onwards = self.g.mul(left, old_left);
        let turns = self.g.not_less(zero, onwards);
        let origin = self.g.select(turns, was, first);
        let rises = self.g.not_less(x, y);
        let jumps = times.map(|t| if t > 0.0 { zero } else { one });
        let at_once = self.g.select(rises, jumps[0], jumps[1]);
        let there = self.equals(x, y);
        let at_once = self.g.select(there, one, at_once);
        let [up, down] = times.map(|t| self.g.constant(if t > 0.0 { t } else { 1.0 }));
        let takes = self.g.select(rises, up, down);
        let whole = self.g.sub(x, origin);
        let whole = self.g.select(changed, whole, one);
        let slope = self.g.div(whole, takes);
        let part = self.g.div(left, whole);
        let takes = self.g.mul(part, takes);
        let end = self.g.add(begins, takes);
        [origin, self.g.select(at_once, zero, slope), end, at_once]
    }

    /// 1 where both are the same, else 0.
    fn equals(&mut self, a: Id, b: Id) -> Id {
        let [zero, one] = [0.0, 1.0].map(|v| self.g.constant(v));
        let (not_less, not_more) = (self.g.not_less(a, b), self.g.not_less(b, a));
        let not_more = self.g.select(not_more, one, zero);
        self.g.select(not_less, not_more, zero)
    }
}
