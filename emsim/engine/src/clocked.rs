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
//! Then values of circuit and machine jump as behind any other corner, and the method restarts. At operating points and before a clock's
//! first tick signals are at their initial values.
//!
//! A timer is a level that is 1 from `on` to `off` behind each tick [s], with the complement beside it: 0 <= on, off <= period within
//! a period, what lies beyond is cut off there. Both rise later by `dead`, and not at all where they would fall before.
use crate::graph::{Graph, Id};
use crate::tape::{Inputs, Tape};
use crate::waves::SNAP;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

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

/// What signals of one clock become at its tick.
#[derive(Serialize, Deserialize)]
pub struct Rule {
    pub clock: usize,
    pub signals: Vec<usize>,
    pub values: Vec<Id>,
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
}

impl Clocked {
    pub fn is_empty(&self) -> bool {
        self.clocks.is_empty()
    }

    pub fn rule(&mut self, clock: usize, signals: Vec<usize>, values: Vec<Id>) {
        self.rules.push(Rule { clock, signals, values, program: None });
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
        let until = t + SNAP * t;
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
        ticks.chain(held).chain(self.timers.iter().map(Edges::next)).fold(f64::INFINITY, f64::min)
    }

    /// Tells stretches between corners apart: equal where timers are.
    pub fn levels(&self) -> impl Iterator<Item = bool> + '_ {
        self.timers.iter().flat_map(|edges| edges.outputs)
    }

    /// Everything up to the time of `left` happens; a signal that is no number as an error.
    pub fn advance(&mut self, clocked: &Clocked, left: &Left) -> Result<(), usize> {
        let t = left.t;
        let until = t + SNAP * t;
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
    fn evaluate(&mut self, clocked: &Clocked, left: &Left, ticking: &[Option<f64>]) -> Result<(), usize> {
        let mut waves = left.waves.to_vec();
        for rule in clocked.rules.iter().filter(|rule| ticking[rule.clock].is_some()) {
            let Some(program) = &rule.program else { continue };
            let found = program.eval(&Inputs { x: left.x, t: left.t, waves: &waves, flags: left.flags });
            for (&k, value) in rule.signals.iter().zip(found) {
                if !value.is_finite() {
                    return Err(k);
                }
                self.values[k] = value;
                waves[clocked.signals[k].waves[0]] = value;
            }
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
