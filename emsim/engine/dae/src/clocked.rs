//! Control with a clock: signals that change at the ticks of clocks and stay what they are in between.
//!
//! A clock ticks at  t_k = offset + k period,  computed and not accumulated. The driver steps onto every tick. There
//!
//! 1. what a clock's `delay` has held back until now is shown to circuit and machine; edges of timers that are due happen;
//! 2. the rules of the clocks that tick are evaluated in their order. They read unknowns and sources as they are just before the tick,
//!    and each other's newest values: a rule writes its signals before the next one reads them. (A previous value x[-1] is a signal of
//!    its own, whose rule stands before that of x.)
//! 3. signals of clocks without delay are shown, and timers whose clock ticks take their times.
//!
//! An FMU for co-simulation is a rule with a clock of its own: it makes its step to the tick before all rules, so that all see what it has come
//! to, and takes its inputs where the rule stands.
//!
//! Then values of circuit and machine jump as behind any other corner, and the method restarts. At operating points and before a clock's
//! first tick signals are at their initial values.
//!
//! A timer is a level that is 1 from `on` to `off` behind each tick [s], with the complement beside it: 0 <= on, off <= period within
//! a period, what lies beyond is cut off there. Both rise later by `dead`, and not at all where they would fall before.
use crate::foreign::exchange::{Place, Seat};
use crate::foreign::{unit::Unit, Spec};
use crate::graph::{Graph, Id};
use crate::rounding::SUMMED;
use crate::tape::{Inputs, Tape};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Clock {
    pub period: f64,
    pub offset: f64,
    pub delay: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Signal {
    pub name: String,
    pub clock: usize,
    pub initial: f64,
    /// what rules read, and what all others do: one wave where the clock has no delay
    pub waves: [usize; 2],
}

/// What signals of one clock become at its tick: the values, or what the FMU with that number makes of them.
#[derive(Serialize, Deserialize)]
pub struct Rule {
    pub clock: usize,
    pub signals: Vec<usize>,
    pub values: Vec<Id>,
    #[serde(skip)]
    unit: Option<usize>,
    #[serde(skip)]
    program: Option<Tape>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Timer {
    pub clock: usize,
    /// signals: from when to when [s]
    pub on: usize,
    pub off: usize,
    pub dead: f64,
    /// of the level and of its complement
    pub waves: [usize; 2],
}

/// All of a deck's clocked signals.
#[derive(Default, Serialize, Deserialize)]
pub struct Clocked {
    pub clocks: Vec<Clock>,
    pub signals: Vec<Signal>,
    pub rules: Vec<Rule>,
    pub timers: Vec<Timer>,
    #[serde(skip)]
    pub units: Vec<Arc<Spec>>,
    /// FMUs for model exchange, whose events are here
    #[serde(skip)]
    pub exchanges: Vec<Seat>,
}

/// Why a tick does not come off.
#[derive(Clone, Debug)]
pub enum Trouble {
    /// a signal that is no number
    Signal(usize),
    /// of an FMU: its card, and what was said
    Unit(String, String),
}

impl Clocked {
    pub fn is_empty(&self) -> bool {
        self.clocks.is_empty() && self.exchanges.is_empty()
    }

    pub fn rule(&mut self, clock: usize, signals: Vec<usize>, values: Vec<Id>) {
        self.rules.push(Rule { clock, signals, values, unit: None, program: None });
    }

    /// What an FMU makes of values at the ticks of its clock.
    pub fn unit(&mut self, clock: usize, spec: Arc<Spec>, values: Vec<Id>, signals: Vec<usize>) {
        self.units.push(spec);
        self.rules.push(Rule { clock, signals, values, unit: Some(self.units.len() - 1), program: None });
    }

    /// Once all is there.
    pub fn compile(&mut self, g: &Graph) {
        for rule in &mut self.rules {
            rule.program = Some(Tape::new(g, &rule.values));
        }
    }

    /// The same once more, before it is compiled.
    pub fn twin(&self) -> Clocked {
        let rule = |r: &Rule| Rule { signals: r.signals.clone(), values: r.values.clone(), program: None, ..*r };
        Clocked {
            clocks: self.clocks.clone(),
            signals: self.signals.clone(),
            rules: self.rules.iter().map(rule).collect(),
            timers: self.timers.clone(),
            units: self.units.clone(),
            exchanges: self.exchanges.clone(),
        }
    }

    pub fn live(&self) -> Live {
        let initial: Vec<f64> = self.signals.iter().map(|s| s.initial).collect();
        Live {
            runs: false,
            ticks: vec![0; self.clocks.len()],
            shown: initial.clone(),
            values: initial,
            held: vec![VecDeque::new(); self.clocks.len()],
            timers: vec![Edges::default(); self.timers.len()],
            units: self.units.iter().map(|_| Unit::default()).collect(),
            exchanges: self.exchanges.iter().map(Place::new).collect(),
        }
    }
}

/// A timer during a run.
#[derive(Clone, Default)]
struct Edges {
    /// none before the first tick
    level: Option<bool>,
    outputs: [bool; 2],
    /// what the level turns to, and when, within the present period
    turns: VecDeque<(f64, bool)>,
    /// when the output that is to be on rises
    rises: Option<f64>,
}

impl Edges {
    fn next(&self) -> f64 {
        let turn = self.turns.front().map_or(f64::INFINITY, |turn| turn.0);
        self.rises.map_or(turn, |at| at.min(turn))
    }

    fn turn(&mut self, level: bool, t: f64, dead: f64) {
        if self.level != Some(level) {
            (self.level, self.outputs) = (Some(level), [false; 2]);
            self.rises = Some(t + dead);
        }
    }

    /// Everything up to t happens.
    fn advance(&mut self, t: f64, dead: f64) {
        let until = t + SUMMED * t;
        while let Some(&(at, level)) = self.turns.front().filter(|turn| turn.0 <= until) {
            self.turns.pop_front();
            self.turn(level, at, dead);
        }
        if self.rises.is_some_and(|at| at <= until) {
            self.rises = None;
            self.outputs[usize::from(self.level != Some(true))] = true;
        }
    }

    /// A period begins at t.
    fn load(&mut self, t: f64, [on, off]: [f64; 2], period: f64, dead: f64) {
        let (on, off) = (on.max(0.0), off.min(period));
        self.turns.clear();
        let pulse = off > on;
        self.turn(pulse && on == 0.0, t, dead);
        if pulse && on > 0.0 {
            self.turns.push_back((t + on, true));
        }
        if pulse && off < period {
            self.turns.push_back((t + off, false));
        }
        self.advance(t, dead);
    }
}

/// Clocked signals during a run.
#[derive(Clone, Default)]
pub struct Live {
    runs: bool,
    ticks: Vec<u64>, // of each clock: how often it has ticked
    values: Vec<f64>,
    shown: Vec<f64>,
    held: Vec<VecDeque<(f64, Vec<f64>)>>, // by clock: what its delay holds back, and until when
    timers: Vec<Edges>,
    units: Vec<Unit>,
    exchanges: Vec<Place>,
}

/// What is read at a tick: unknowns, time, sources, conditions.
pub struct Left<'a> {
    pub x: &'a [f64],
    pub t: f64,
    pub waves: &'a [f64],
    pub flags: &'a [f64],
}

impl Live {
    /// A run begins.
    pub fn begin(&mut self) {
        self.runs = true;
        self.exchanges.iter_mut().for_each(|place| place.asked = true);
    }

    /// FMUs for model exchange go back to where they were.
    pub fn return_exchanges(&mut self) {
        self.exchanges.iter_mut().for_each(Place::put_back);
    }

    /// This flag has turned: it may be an event of an FMU.
    pub fn turned(&mut self, clocked: &Clocked, flag: usize) {
        for (seat, place) in clocked.exchanges.iter().zip(&mut self.exchanges) {
            place.asked |= seat.flags.contains(&flag);
        }
    }

    /// Values have jumped to x: does an FMU have an event there?
    pub fn look(&mut self, clocked: &Clocked, x: &[f64]) -> bool {
        clocked.exchanges.iter().zip(&mut self.exchanges).for_each(|(seat, place)| place.look(seat, x));
        self.asks()
    }

    /// Does an FMU have an event at the point that stands?
    pub fn asks(&self) -> bool {
        self.exchanges.iter().any(|place| place.asked)
    }

    /// The events that are asked for: x changes where states jump. Gives flags with the indicators whose signs they are.
    pub fn exchange(&mut self, clocked: &Clocked, x: &mut [f64], t: f64) -> Result<Vec<(usize, f64)>, Trouble> {
        let mut signs = Vec::new();
        for (seat, place) in clocked.exchanges.iter().zip(&mut self.exchanges).filter(|(_, place)| place.asked) {
            let found = place.event(seat, x, t).map_err(|said| Trouble::Unit(seat.of.spec.card.clone(), said))?;
            signs.extend(seat.flags.iter().copied().zip(found));
        }
        Ok(signs)
    }

    /// A step was accepted.
    pub fn completed(&mut self, clocked: &Clocked, x: &[f64], t: f64) -> Result<(), Trouble> {
        for (seat, place) in clocked.exchanges.iter().zip(&mut self.exchanges) {
            place.completed(seat, x, t).map_err(|said| Trouble::Unit(seat.of.spec.card.clone(), said))?;
        }
        Ok(())
    }

    /// Values in place of the waves of signals and timers.
    #[inline]
    pub fn write(&self, clocked: &Clocked, waves: &mut [f64]) {
        for ((signal, &value), &shown) in clocked.signals.iter().zip(&self.values).zip(&self.shown) {
            waves[signal.waves[0]] = value;
            waves[signal.waves[1]] = shown;
        }
        for (timer, edges) in clocked.timers.iter().zip(&self.timers) {
            for (&wave, &on) in timer.waves.iter().zip(&edges.outputs) {
                waves[wave] = f64::from(u8::from(on));
            }
        }
    }

    fn next_tick(&self, clocked: &Clocked, k: usize) -> f64 {
        let clock = clocked.clocks[k];
        clock.offset + self.ticks[k] as f64 * clock.period
    }

    /// When something happens next.
    pub fn next(&self, clocked: &Clocked) -> f64 {
        if !self.runs {
            return f64::INFINITY;
        }
        let ticks = (0..clocked.clocks.len()).map(|k| self.next_tick(clocked, k));
        let held = self.held.iter().filter_map(|held| held.front()).map(|held| held.0);
        let events = self.exchanges.iter().map(|place| place.next);
        ticks.chain(held).chain(self.timers.iter().map(Edges::next)).chain(events).fold(f64::INFINITY, f64::min)
    }

    /// Tells stretches between corners apart: equal where timers are.
    pub fn levels(&self) -> impl Iterator<Item = bool> + '_ {
        self.timers.iter().flat_map(|edges| edges.outputs)
    }

    /// Everything up to the time of `left` happens.
    pub fn advance(&mut self, clocked: &Clocked, left: &Left) -> Result<(), Trouble> {
        let t = left.t;
        let until = t + SUMMED * t;
        for (k, held) in self.held.iter_mut().enumerate() {
            while held.front().is_some_and(|held| held.0 <= until) {
                let (_, values) = held.pop_front().unwrap_or_default();
                let mut values = values.into_iter();
                for (signal, shown) in clocked.signals.iter().zip(&mut self.shown) {
                    if signal.clock == k {
                        *shown = values.next().unwrap_or(*shown);
                    }
                }
            }
        }
        for (timer, edges) in clocked.timers.iter().zip(&mut self.timers) {
            edges.advance(t, timer.dead);
        }
        for place in self.exchanges.iter_mut().filter(|place| place.next <= until) {
            (place.asked, place.next) = (true, f64::INFINITY);
        }
        let ticking: Vec<Option<f64>> =
            (0..clocked.clocks.len()).map(|k| Some(self.next_tick(clocked, k)).filter(|&at| at <= until)).collect();
        if ticking.iter().all(Option::is_none) {
            return Ok(());
        }
        self.evaluate(clocked, left, &ticking)?;
        for (k, at) in ticking.iter().enumerate().filter_map(|(k, at)| Some((k, (*at)?))) {
            self.ticks[k] += 1;
            self.show(clocked, k, at);
        }
        for (timer, edges) in clocked.timers.iter().zip(&mut self.timers) {
            if let Some(at) = ticking[timer.clock] {
                let times = [timer.on, timer.off].map(|k| self.shown[k]);
                edges.load(at, times, clocked.clocks[timer.clock].period, timer.dead);
            }
        }
        Ok(())
    }

    /// The rules of the clocks that tick, in their order.
    fn evaluate(&mut self, clocked: &Clocked, left: &Left, ticking: &[Option<f64>]) -> Result<(), Trouble> {
        let mut waves = left.waves.to_vec();
        let ticks = |rule: &&Rule| ticking[rule.clock].is_some();
        for (rule, unit) in clocked.rules.iter().filter(ticks).filter_map(|rule| Some((rule, rule.unit?))) {
            let spec = &clocked.units[unit];
            let mut found: Vec<f64> = rule.signals.iter().map(|&k| self.values[k]).collect();
            let at = ticking[rule.clock].unwrap_or(left.t);
            let done = self.units[unit].arrive(spec, at, &mut found);
            done.map_err(|said| Trouble::Unit(spec.card.clone(), said))?;
            self.put(clocked, rule, found, &mut waves)?;
        }
        for rule in clocked.rules.iter().filter(ticks) {
            let Some(program) = &rule.program else { continue };
            let mut found = program.eval(&Inputs { x: left.x, t: left.t, waves: &waves, flags: left.flags });
            if let Some(unit) = rule.unit {
                let (spec, inputs) = (&clocked.units[unit], found);
                if let Some(k) = inputs.iter().position(|v| !v.is_finite()) {
                    return Err(Trouble::Unit(spec.card.clone(), format!("its input number {} is not finite", k + 1)));
                }
                found = vec![0.0; rule.signals.len()];
                let at = ticking[rule.clock].unwrap_or(left.t);
                let done = self.units[unit].give(spec, at, &inputs, &mut found);
                done.map_err(|said| Trouble::Unit(spec.card.clone(), said))?;
            }
            self.put(clocked, rule, found, &mut waves)?;
        }
        Ok(())
    }

    fn put(&mut self, clocked: &Clocked, rule: &Rule, found: Vec<f64>, waves: &mut [f64]) -> Result<(), Trouble> {
        for (&k, value) in rule.signals.iter().zip(found) {
            if !value.is_finite() {
                return Err(Trouble::Signal(k));
            }
            self.values[k] = value;
            waves[clocked.signals[k].waves[0]] = value;
        }
        Ok(())
    }

    /// Signals of a clock that has ticked are seen outside, now or later.
    fn show(&mut self, clocked: &Clocked, k: usize, at: f64) {
        let own = |signal: &Signal| signal.clock == k;
        let delay = clocked.clocks[k].delay;
        if delay > 0.0 {
            let values = clocked.signals.iter().zip(&self.values).filter(|(s, _)| own(s)).map(|(_, &v)| v).collect();
            self.held[k].push_back((at + delay, values));
            return;
        }
        for ((signal, &value), shown) in clocked.signals.iter().zip(&self.values).zip(&mut self.shown) {
            if own(signal) {
                *shown = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (time, level, complement) at every change of a timer with these times, period by period.
    fn changes(times: &[[f64; 2]], dead: f64) -> Vec<(f64, bool, bool)> {
        let (mut edges, mut found, period) = (Edges::default(), Vec::new(), 10.0);
        for (k, &times) in times.iter().enumerate() {
            let (start, end) = (k as f64 * period, (k + 1) as f64 * period);
            while edges.next() < start {
                let at = edges.next();
                edges.advance(at, dead);
                found.push((at, edges.outputs[0], edges.outputs[1]));
            }
            edges.advance(start, dead);
            edges.load(start, times, period, dead);
            found.push((start, edges.outputs[0], edges.outputs[1]));
            while edges.next() < end {
                let at = edges.next();
                edges.advance(at, dead);
                found.push((at, edges.outputs[0], edges.outputs[1]));
            }
        }
        found.dedup_by_key(|(_, a, b)| (*a, *b));
        found
    }

    #[test]
    fn a_pulse_within_the_period() {
        let expected =
            [(0.0, false, true), (3.0, true, false), (7.0, false, true), (13.0, true, false), (17.0, false, true)];
        assert_eq!(changes(&[[3.0, 7.0]; 2], 0.0), expected);
    }

    #[test]
    fn full_and_empty_periods_have_no_edges() {
        assert_eq!(changes(&[[0.0, 10.0]; 3], 0.0), [(0.0, true, false)]);
        assert_eq!(changes(&[[5.0, 5.0]; 3], 0.0), [(0.0, false, true)]);
        assert_eq!(changes(&[[-2.0, 12.0], [5.0, 5.0]], 0.0), [(0.0, true, false), (10.0, false, true)]);
    }

    #[test]
    fn dead_times_delay_what_rises() {
        let expected = [
            (0.0, false, false),
            (1.0, false, true),
            (3.0, false, false),
            (4.0, true, false),
            (7.0, false, false),
            (8.0, false, true),
        ];
        assert_eq!(changes(&[[3.0, 7.0]], 1.0), expected);
        // a pulse shorter than the dead time does not come out, and the complement is off around it
        assert_eq!(changes(&[[5.0, 5.5]], 1.0)[1..], [(1.0, false, true), (5.0, false, false), (6.5, false, true)]);
    }
}
