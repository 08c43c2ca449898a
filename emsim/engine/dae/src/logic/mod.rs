//! Digital nodes and what stands between them: an event queue beside the time axis of the equations.
//!
//! A node has a level (0, 1, undefined) and a strength (strong, resistive, high impedance, undetermined): twelve states, as XSPICE
//! has them. Parts (gates, flip-flops, ...) are called when a node at one of their inputs changes, and post states of their outputs
//! for later. What was posted for that time or a later one is forgotten then, so that a pulse shorter than the difference of two
//! delays does not come out. A node that several outputs drive has what they come to together.
//!
//! The equations see digital nodes as waves: their level as a number, and ramps that follow them (dac_bridge). Digital nodes see
//! the equations by flags: a node between two thresholds is undefined. So crossings are located like those of any condition,
//! events are corners that a step ends on, and between two events nothing here changes.
//!
//! At rest, before a run, there is no delay: parts are called until nothing changes; what goes on changing is undefined.
//!
//! To add a part: one file here with its ports, its parameters and what it does when it is called, and its line in `REGISTRY`.

mod bridges;
mod counter;
mod flipflops;
mod gates;
mod latches;
mod lut;
mod machine;
mod ram;
mod source;
mod tristate;

use crate::graph::{Graph, Id};
use crate::rounding::SUMMED;
use crate::tape::{Inputs, Tape};
use serde::{Deserialize, Serialize};
use std::cmp::{Ordering, Reverse};
use std::collections::{BinaryHeap, HashMap, VecDeque};

/// Every part, by the word of its .model card.
pub const REGISTRY: &[&[Spec]] = &[
    gates::SPECS,
    tristate::SPECS,
    flipflops::SPECS,
    latches::SPECS,
    counter::SPECS,
    lut::SPECS,
    machine::SPECS,
    ram::SPECS,
    source::SPECS,
    bridges::SPECS,
];

pub fn spec(kind: &str) -> Option<&'static Spec> {
    REGISTRY.iter().flat_map(|specs| specs.iter()).find(|s| s.name == kind)
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Level {
    Zero,
    One,
    #[default]
    Unknown,
}
pub use Level::{One, Unknown, Zero};

impl Level {
    pub fn is(high: bool) -> Level {
        if high {
            One
        } else {
            Zero
        }
    }

    /// 0, 1, anything else: undefined.
    pub fn of(v: f64) -> Level {
        match v {
            0.0 => Zero,
            1.0 => One,
            _ => Unknown,
        }
    }

    pub fn number(self) -> f64 {
        match self {
            Zero => 0.0,
            One => 1.0,
            Unknown => 0.5,
        }
    }
}

impl std::ops::Not for Level {
    type Output = Level;

    fn not(self) -> Level {
        match self {
            Zero => One,
            One => Zero,
            Unknown => Unknown,
        }
    }
}

/// In the order in which they prevail.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum Strength {
    HighImpedance,
    Resistive,
    /// any of the others
    #[default]
    Undetermined,
    Strong,
}
pub use Strength::{HighImpedance, Resistive, Strong, Undetermined};

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct State {
    pub level: Level,
    pub strength: Strength,
}

impl State {
    pub fn strong(level: Level) -> State {
        State { level, strength: Strong }
    }

    pub fn of(level: Level, strength: Strength) -> State {
        State { level, strength }
    }

    /// What two outputs on one node come to. A stronger one prevails, but for one whose strength nobody knows: that leaves the
    /// level open where the other says something else.
    pub fn join(self, other: State) -> State {
        let (a, b) = if self.strength >= other.strength { (self, other) } else { (other, self) };
        let open = a.strength == b.strength
            || a.strength == Strong && b.strength == Undetermined
            || a.strength == Undetermined;
        let level = if open && a.level != b.level { Unknown } else { a.level };
        State { level, strength: a.strength }
    }

    /// As it is written: 0s, 1r, Uz, 0u.
    pub fn text(self) -> String {
        let level = ["0", "1", "U"][self.level as usize];
        level.to_string() + ["z", "r", "u", "s"][self.strength as usize]
    }
}

/// A parameter: name, unit, default (NaN: none), the least value, meaning.
pub struct Parameter {
    pub name: &'static str,
    pub unit: &'static str,
    pub default: f64,
    pub least: f64,
    pub meaning: &'static str,
}

pub const fn p(name: &'static str, unit: &'static str, default: f64, least: f64, meaning: &'static str) -> Parameter {
    Parameter { name, unit, default, least, meaning }
}

/// Delays are of 1 ns where nothing is said, and never of nothing.
pub const fn delay(name: &'static str, meaning: &'static str) -> Parameter {
    p(name, "s", 1e-9, 1e-12, meaning)
}

/// Accepted as XSPICE has it; a digital node has no load.
pub const fn load(name: &'static str) -> Parameter {
    p(name, "F", 1e-12, f64::NEG_INFINITY, "")
}

/// A connection of a part: is it an output, is it a list, may it be left open (`null`)?
pub struct Port {
    pub name: &'static str,
    pub is_output: bool,
    pub is_list: bool,
    pub may_be_open: bool,
}

pub const fn input(name: &'static str) -> Port {
    Port { name, is_output: false, is_list: false, may_be_open: false }
}

pub const fn output(name: &'static str) -> Port {
    Port { name, is_output: true, is_list: false, may_be_open: false }
}

pub const fn list(port: Port) -> Port {
    Port { is_list: true, ..port }
}

pub const fn open(port: Port) -> Port {
    Port { may_be_open: true, ..port }
}

/// What a deck can say of a part, and who makes one; errors are sentences for the user.
pub struct Spec {
    pub name: &'static str,
    pub what: &'static str,
    pub ports: &'static [Port],
    pub parameters: &'static [Parameter],
    pub make: fn(&Given) -> Result<Box<dyn Part>, String>,
}

/// What was given to one instance.
pub struct Given<'a> {
    pub spec: &'static Spec,
    pub values: &'a HashMap<String, Vec<f64>>,
    /// connections of each port
    pub widths: Vec<usize>,
}

impl Given<'_> {
    /// A parameter's number, or its default.
    pub fn number(&self, name: &str) -> f64 {
        let known = self.spec.parameters.iter().find(|p| p.name == name);
        let default = known.map_or(f64::NAN, |p| p.default);
        let value = self.values.get(name).and_then(|v| v.first()).copied().unwrap_or(default);
        known.map_or(value, |p| value.max(p.least))
    }

    pub fn level(&self, name: &str) -> Level {
        Level::of(self.number(name))
    }

    pub fn list(&self, name: &str) -> &[f64] {
        self.values.get(name).map_or(&[], Vec::as_slice)
    }
}

/// What stands between digital nodes.
pub trait Part: Send + Sync {
    /// An input has changed, or all begins: `Call::rests`.
    fn call(&mut self, c: &mut Call);

    /// A run begins: what comes by itself is posted.
    fn begin(&mut self, _: &mut Call) {}

    /// The same in the same state.
    fn twin(&self) -> Box<dyn Part>;
}

/// What a part is called with.
pub struct Call<'a> {
    /// before a run: what is posted holds at once
    pub rests: bool,
    seat: &'a Seat,
    nodes: &'a [State],
    posts: &'a mut Vec<(usize, State, f64)>,
}

impl Call<'_> {
    /// The level at an input; what is open is at `otherwise`.
    pub fn level_or(&self, port: usize, otherwise: Level) -> Level {
        self.seat.ports[port].first().map_or(otherwise, |c| self.read(*c))
    }

    pub fn level(&self, port: usize) -> Level {
        self.level_or(port, Zero)
    }

    pub fn levels(&self, port: usize) -> impl Iterator<Item = Level> + '_ {
        self.seat.ports[port].iter().map(|c| self.read(*c))
    }

    fn read(&self, c: Connection) -> Level {
        let level = self.nodes[c.at].level;
        if c.inverted {
            !level
        } else {
            level
        }
    }

    /// An output is to be so after a delay [s].
    pub fn post(&mut self, port: usize, state: State, delay: f64) {
        self.post_at(port, 0, state, delay);
    }

    /// An output's level becomes another one; at rest it is said again.
    pub fn change(&mut self, port: usize, last: &mut Level, level: Level, delays: [f64; 2]) {
        if self.rests || level != *last {
            self.post(port, State::strong(level), slope(*last, level, delays));
        }
        *last = level;
    }

    /// The same of one of a list.
    pub fn post_at(&mut self, port: usize, k: usize, state: State, delay: f64) {
        if let Some(c) = self.seat.ports[port].get(k) {
            let level = if c.inverted { !state.level } else { state.level };
            self.posts.push((c.at, State { level, ..state }, delay));
        }
    }
}

/// An output's delay as XSPICE has it: that of rising for what goes up, to undefined from 0 included.
pub fn slope(from: Level, to: Level, [rise, fall]: [f64; 2]) -> f64 {
    match (from, to) {
        (_, One) | (Zero, Unknown) => rise,
        _ => fall,
    }
}

#[derive(Clone, Copy)]
pub struct Connection {
    /// a node, or the number of an output
    pub at: usize,
    pub inverted: bool,
}

/// Where a part stands: connections of its ports, none where a port is open.
#[derive(Clone)]
pub struct Seat {
    pub name: String,
    pub ports: Vec<Vec<Connection>>,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Node {
    pub name: String,
    /// what shows its level
    pub wave: usize,
    /// what of flags decides it, where the equations do: is it above what is low, is it below what is high?
    pub senses: Option<[Id; 2]>,
}

/// A wave that follows a node in straight lines.
#[derive(Clone, Serialize, Deserialize)]
pub struct Ramp {
    pub node: usize,
    pub inverted: bool,
    pub wave: usize,
    pub low: f64,
    pub high: f64,
    pub undefined: f64,
    pub rise: f64,
    pub fall: f64,
}

impl Ramp {
    fn goal(&self, level: Level) -> f64 {
        match if self.inverted { !level } else { level } {
            Zero => self.low,
            One => self.high,
            Unknown => self.undefined,
        }
    }
}

/// All of a deck's digital parts, as a run begins with them.
#[derive(Default, Serialize, Deserialize)]
pub struct Logic {
    pub nodes: Vec<Node>,
    pub ramps: Vec<Ramp>,
    #[serde(skip)]
    seats: Vec<Seat>,
    #[serde(skip)]
    parts: Vec<Box<dyn Part>>,
    #[serde(skip)]
    outputs: Vec<usize>, // node of each
    #[serde(skip)]
    drivers: Vec<Vec<usize>>, // outputs on each node
    #[serde(skip)]
    readers: Vec<Vec<usize>>, // parts that each node calls
    #[serde(skip)]
    sensed: Vec<usize>, // nodes that the equations decide
    #[serde(skip)]
    senses: Option<Tape>, // two values of each
}

impl Logic {
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Once all is there.
    pub fn compile(&mut self, g: &Graph) {
        let senses = |k: &usize| self.nodes[*k].senses;
        self.sensed = (0..self.nodes.len()).filter(|k| senses(k).is_some()).collect();
        let ids: Vec<Id> = self.sensed.iter().filter_map(senses).flatten().collect();
        self.senses = (!ids.is_empty()).then(|| Tape::new(g, &ids));
    }

    /// Nodes and ramps have been read: parts may come.
    pub fn reopen(&mut self) {
        self.drivers.resize(self.nodes.len(), Vec::new());
        self.readers.resize(self.nodes.len(), Vec::new());
    }

    /// A node more; `wave` shows its level.
    pub fn node(&mut self, name: String, wave: usize) -> usize {
        self.nodes.push(Node { name, wave, senses: None });
        self.drivers.push(Vec::new());
        self.readers.push(Vec::new());
        self.nodes.len() - 1
    }

    /// A part more; nodes of its ports with whether they are inverted.
    pub fn add(
        &mut self,
        kind: &str,
        name: &str,
        ports: Vec<Vec<(usize, bool)>>,
        values: &HashMap<String, Vec<f64>>,
    ) -> Result<(), String> {
        let spec = spec(kind).ok_or_else(|| format!("there is no digital part {kind}"))?;
        let given = Given { spec, values, widths: ports.iter().map(Vec::len).collect() };
        let part = (spec.make)(&given)?;
        let k = self.seats.len();
        let mut seat = Seat { name: name.into(), ports: Vec::new() };
        for (port, connections) in spec.ports.iter().zip(ports) {
            let mut made = Vec::new();
            for (node, inverted) in connections {
                if port.is_output {
                    self.drivers[node].push(self.outputs.len());
                    self.outputs.push(node);
                    made.push(Connection { at: self.outputs.len() - 1, inverted });
                } else {
                    self.readers[node].push(k);
                    made.push(Connection { at: node, inverted });
                }
            }
            seat.ports.push(made);
        }
        self.seats.push(seat);
        self.parts.push(part);
        Ok(())
    }

    /// The same once more, before it is compiled.
    pub fn twin(&self) -> Logic {
        Logic {
            nodes: self.nodes.clone(),
            ramps: self.ramps.clone(),
            seats: self.seats.clone(),
            parts: self.parts.iter().map(|part| part.twin()).collect(),
            outputs: self.outputs.clone(),
            drivers: self.drivers.clone(),
            readers: self.readers.clone(),
            sensed: Vec::new(),
            senses: None,
        }
    }

    pub fn live(&self) -> Live {
        let n = self.nodes.len();
        Live {
            begun: false,
            fresh: true,
            nodes: vec![State::default(); n],
            outputs: vec![State::default(); self.outputs.len()],
            pending: vec![VecDeque::new(); self.outputs.len()],
            queue: BinaryHeap::new(),
            parts: self.parts.iter().map(|p| p.twin()).collect(),
            courses: self.ramps.iter().map(|r| Course::still(r.goal(Unknown))).collect(),
            log: Vec::new(),
        }
    }
}

/// Where a ramp is: in a straight line from one time to another, at rest before and after.
#[derive(Clone, Copy)]
struct Course {
    begin: f64,
    end: f64,
    from: f64,
    to: f64,
}

impl Course {
    fn still(at: f64) -> Course {
        Course { begin: 0.0, end: 0.0, from: at, to: at }
    }

    fn value(&self, t: f64) -> f64 {
        if t >= self.end {
            self.to
        } else if t <= self.begin {
            self.from
        } else {
            self.from + (self.to - self.from) * ((t - self.begin) / (self.end - self.begin))
        }
    }
}

/// A time in the queue, with the output that it is of.
#[derive(Clone, Copy, PartialEq)]
struct Due(f64, usize);

impl Eq for Due {}

impl Ord for Due {
    fn cmp(&self, other: &Due) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Due) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// So many rounds at rest beside one for each part, and there is no rest.
const ROUNDS: usize = 64;

/// The digital nodes during a run.
#[derive(Default)]
pub struct Live {
    begun: bool,
    fresh: bool, // nothing has been called yet
    nodes: Vec<State>,
    outputs: Vec<State>,
    pending: Vec<VecDeque<(f64, State)>>, // of each output, in order
    queue: BinaryHeap<Reverse<Due>>,      // entries whose output has nothing pending then are void
    parts: Vec<Box<dyn Part>>,
    courses: Vec<Course>,
    /// changes of nodes: time, node, state
    pub log: Vec<(f64, u32, State)>,
}

impl Clone for Live {
    fn clone(&self) -> Live {
        Live {
            begun: self.begun,
            fresh: self.fresh,
            nodes: self.nodes.clone(),
            outputs: self.outputs.clone(),
            pending: self.pending.clone(),
            queue: self.queue.clone(),
            parts: self.parts.iter().map(|p| p.twin()).collect(),
            courses: self.courses.clone(),
            log: self.log.clone(),
        }
    }
}

impl Live {
    /// Values at t in place of the waves of nodes and ramps.
    #[inline]
    pub fn write(&self, logic: &Logic, t: f64, waves: &mut [f64]) {
        for (node, state) in logic.nodes.iter().zip(&self.nodes) {
            waves[node.wave] = state.level.number();
        }
        for (ramp, course) in logic.ramps.iter().zip(&self.courses) {
            waves[ramp.wave] = course.value(t);
        }
    }

    /// The first time after t at which something happens: an event, a ramp's end.
    pub fn next_corner(&self, t: f64) -> f64 {
        let later = |at: &f64| *at > t + SUMMED * t.abs();
        let end = self.courses.iter().map(|c| c.end).filter(later).fold(f64::INFINITY, f64::min);
        end.min(self.next_event())
    }

    fn next_event(&self) -> f64 {
        self.queue.peek().map_or(f64::INFINITY, |Reverse(due)| due.0)
    }

    /// Does a node change at t?
    pub fn due(&self, t: f64) -> bool {
        self.next_event() <= t + SUMMED * t.abs()
    }

    /// Before a run: levels as the flags are, everything called until nothing changes. True where something has changed.
    pub fn rest(&mut self, logic: &Logic, flags: &[f64]) -> bool {
        let mut touched = self.read_flags(logic, flags, 0.0);
        let mut changed = !touched.is_empty() || self.fresh;
        if std::mem::take(&mut self.fresh) {
            touched = (0..logic.seats.len()).collect();
        }
        let mut posts = Vec::new();
        let patience = ROUNDS + logic.seats.len();
        for round in 0..2 * patience {
            if touched.is_empty() {
                break;
            }
            for &k in &touched {
                self.call(logic, k, true, &mut posts);
            }
            let mut nodes: Vec<usize> = Vec::new();
            for (output, state, _) in posts.drain(..) {
                // what finds no rest, a latch that its own negation feeds, is undefined
                let level = if round < patience { state.level } else { Unknown };
                self.outputs[output] = State { level, ..state };
                nodes.push(logic.outputs[output]);
            }
            touched = self.resolve(logic, nodes, 0.0);
            changed |= !touched.is_empty();
        }
        for (course, ramp) in self.courses.iter_mut().zip(&logic.ramps) {
            *course = Course::still(ramp.goal(self.nodes[ramp.node].level));
        }
        self.log.clear();
        changed
    }

    /// A run begins.
    pub fn begin(&mut self, logic: &Logic) {
        self.begun = true;
        self.log = self.nodes.iter().enumerate().map(|(k, &s)| (0.0, k as u32, s)).collect();
        let mut posts = Vec::new();
        for k in 0..logic.seats.len() {
            let mut c = Call { rests: false, seat: &logic.seats[k], nodes: &self.nodes, posts: &mut posts };
            self.parts[k].begin(&mut c);
        }
        self.put(&mut posts, 0.0);
    }

    /// Everything up to t happens, then what the flags say there.
    pub fn advance(&mut self, logic: &Logic, flags: &[f64], t: f64) {
        if !self.begun {
            return;
        }
        while self.due(t) {
            let now = self.next_event();
            let mut nodes = Vec::new();
            while let Some(&Reverse(Due(at, output))) = self.queue.peek() {
                if at > now + SUMMED * now {
                    break;
                }
                self.queue.pop();
                while let Some(&(when, state)) = self.pending[output].front() {
                    if when > at {
                        break;
                    }
                    self.pending[output].pop_front();
                    self.outputs[output] = state;
                    nodes.push(logic.outputs[output]);
                }
            }
            let touched = self.resolve(logic, nodes, now);
            self.react(logic, &touched, now);
        }
        let touched = self.read_flags(logic, flags, t);
        self.react(logic, &touched, t);
    }

    fn react(&mut self, logic: &Logic, touched: &[usize], t: f64) {
        let mut posts = Vec::new();
        for &k in touched {
            self.call(logic, k, false, &mut posts);
        }
        self.put(&mut posts, t);
    }

    fn call(&mut self, logic: &Logic, k: usize, rests: bool, posts: &mut Vec<(usize, State, f64)>) {
        self.parts[k].call(&mut Call { rests, seat: &logic.seats[k], nodes: &self.nodes, posts });
    }

    /// What was posted at t waits.
    fn put(&mut self, posts: &mut Vec<(usize, State, f64)>, t: f64) {
        for (output, state, delay) in posts.drain(..) {
            let (at, pending) = (t + delay, &mut self.pending[output]);
            while pending.back().is_some_and(|&(when, _)| when >= at - SUMMED * at) {
                pending.pop_back();
            }
            pending.push_back((at, state));
            self.queue.push(Reverse(Due(at, output)));
        }
    }

    /// Nodes that the equations decide; the parts that read those that have changed.
    fn read_flags(&mut self, logic: &Logic, flags: &[f64], t: f64) -> Vec<usize> {
        let mut changed = Vec::new();
        let Some(tape) = &logic.senses else { return changed };
        let values = tape.eval(&Inputs { x: &[], t, waves: &[], flags });
        for (&k, values) in logic.sensed.iter().zip(values.chunks(2)) {
            let level = match [values[0] != 0.0, values[1] != 0.0] {
                [false, _] => Zero,
                [_, false] => One,
                _ => Unknown,
            };
            if self.nodes[k] != State::strong(level) {
                self.set(logic, k, State::strong(level), t);
                changed.push(k);
            }
        }
        readers(logic, &changed)
    }

    /// Outputs on these nodes have changed; the parts that are called for it.
    fn resolve(&mut self, logic: &Logic, mut nodes: Vec<usize>, t: f64) -> Vec<usize> {
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|&k| {
            let states = logic.drivers[k].iter().map(|&o| self.outputs[o]);
            let state = states.reduce(State::join).unwrap_or_default();
            let changes = state != self.nodes[k];
            if changes {
                self.set(logic, k, state, t);
            }
            changes
        });
        readers(logic, &nodes)
    }

    fn set(&mut self, logic: &Logic, k: usize, state: State, t: f64) {
        let turns = state.level != self.nodes[k].level;
        self.nodes[k] = state;
        self.log.push((t, k as u32, state));
        if !turns {
            return;
        }
        for (course, ramp) in self.courses.iter_mut().zip(&logic.ramps).filter(|(_, ramp)| ramp.node == k) {
            let (from, to) = (course.value(t), ramp.goal(state.level));
            // at the slope of a whole ramp
            let share = (to - from) / (ramp.high - ramp.low);
            let time = if share > 0.0 { ramp.rise } else { ramp.fall } * share.abs();
            let end = if time.is_finite() { t + time } else { t };
            *course = Course { begin: t, end, from, to };
        }
    }
}

fn readers(logic: &Logic, nodes: &[usize]) -> Vec<usize> {
    let mut found: Vec<usize> = nodes.iter().flat_map(|&k| &logic.readers[k]).copied().collect();
    found.sort_unstable();
    found.dedup();
    found
}
