//! slew(x, up, down): x, whose slope is held between two bounds.
//!
//! From the last event on y lies between two lines that begin at what y was there and rise and fall as fast as it may. Where x
//! is beyond a line y is on it. Where x itself begins to move faster an event begins the lines anew. So y is exact, and no state.
use super::ast::E;
use super::elaborate::{Answer, Elaborator, Num};
use super::folded::{symbol_of, Mode};
use super::source::Place;
use emsim_expr::derive::gradient;
use emsim_expr::graph::{Id, Node};

impl Elaborator<'_> {
    /// At operating points and in sweeps x itself.
    pub fn slew(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let x = self.plain_number(arguments[0])?;
        let Some(&up) = arguments.get(1) else { return Ok(x) };
        let up = self.known(up, "a slope of slew")?;
        let down = arguments.get(2).map_or(Ok(-up), |&e| self.known(e, "a slope of slew"))?;
        if !(up > 0.0 && down < 0.0 && up.is_finite() && down.is_finite()) {
            return self.stop(
                at,
                format!("slew with slopes of {up} and {down}"),
                "the first is positive, the second negative",
            );
        }
        if self.value_of(&x).is_some() {
            return Ok(x);
        }
        if self.frame.at_event {
            return self.stop(at, "slew at an event", "keep the value there, and limit its slope outside of the event");
        }
        let x = x.id;
        let y = self.g.symbol();
        let [one, up, down] = [1.0, up, down].map(|v| self.g.constant(v));
        let time = self.g.time();
        let (began, from) = (self.mode(Mode::Kept(time)), self.mode(Mode::Kept(y)));
        let since = self.g.sub(time, began);
        let line = |run: &mut Self, slope: Id| {
            let way = run.g.mul(slope, since);
            run.g.add(from, way)
        };
        let (high, low) = (line(self, up), line(self, down));
        let (over, under) = (self.g.sub(x, high), self.g.sub(low, x));
        let (over, under) = (self.mode(Mode::Above(over)), self.mode(Mode::Above(under)));
        let (mut rises, mut falls) = (over, under);
        if let Some(slope) = self.rate(x) {
            // one that equals its bound would turn by rounding
            let more = self.g.constant(1.0 + 1e-9);
            let (most, least) = (self.g.mul(up, more), self.g.mul(down, more));
            let (fast, sinks) = (self.g.sub(slope, most), self.g.sub(least, slope));
            let (fast, sinks) = (self.mode(Mode::Above(fast)), self.mode(Mode::Above(sinks)));
            let (not_under, not_over) = (self.g.sub(one, under), self.g.sub(one, over));
            rises = self.g.select(fast, not_under, over);
            falls = self.g.select(sinks, not_over, under);
        }
        let held = self.g.select(falls, low, x);
        let held = self.g.select(rises, high, held);
        let begun = self.begun();
        let runs = self.in_transients(begun);
        let held = self.g.select(runs, held, x);
        self.finals.push((y, held));
        self.moving.insert(y);
        Ok(self.real(y))
    }

    /// A condition where the run is a transient.
    pub(super) fn in_transients(&mut self, condition: Id) -> Id {
        let Some(tran) = symbol_of("tran") else { return condition };
        let tran = self.g.given(tran);
        self.g.mul(condition, tran)
    }

    /// dx/dt between events; None where it is 0. What was a time ago has its slope of the whole.
    fn rate(&mut self, x: Id) -> Option<Id> {
        if !self.moves_between_events(x) {
            return None;
        }
        let zero = self.g.constant(0.0);
        let of = |run: &mut Self, q: Id| run.plain(&Num { id: zero, whole: false, q: Some(q), noise: None }).id;
        let leaves = self.g.reachable(&[x]);
        let late =
            |id: &Id| matches!(self.g.node(*id), Node::Flag(k) if matches!(self.modes[k as usize], Mode::Late(..)));
        if leaves.iter().any(late) {
            return Some(of(self, x));
        }
        let moved: Vec<Id> =
            leaves.into_iter().filter(|&id| matches!(self.g.node(id), Node::Unknown(_) | Node::Time)).collect();
        let slopes = gradient(&mut self.g, x, &moved);
        let mut sum = zero;
        for (leaf, slope) in moved.into_iter().zip(slopes) {
            if self.g.value(slope) == Some(0.0) {
                continue;
            }
            let speed = if self.g.node(leaf) == Node::Time { self.g.constant(1.0) } else { of(self, leaf) };
            let term = self.g.mul(slope, speed);
            sum = self.g.add(sum, term);
        }
        Some(sum)
    }
}
