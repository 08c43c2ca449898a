//! What of a Verilog-A module hangs on time, on the kind of analysis or on events stands in the deck's own expressions; the rest of it
//! runs as a device (devices/compiled.rs). There its modes are flags: a condition is an event, what is kept is a history (events.rs),
//! and steps end where any of them turns.
use super::{Delay, FlagSpec, Kind, Law, Model, Unknown};
use crate::devices::shape::seats;
use crate::graph::{Fun, Graph, Id, Node};
use crate::veriloga::folded::{self, Flow, Folded, Mode, GMIN, GROUND, SOURCE_SCALE};
use crate::waves::Wave;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Before the name of an analysis: the flag that is 1 while that one runs.
const DURING: &str = "analysis ";
/// The flag that is 1 where equations are linearised (assemble/context.py).
const SMALL_SIGNALS: &str = "small signals";

/// Is this the flag of that analysis (1), of another one (0), or none of these?
pub fn runs_during(flag: &FlagSpec, symbol: u32) -> Option<bool> {
    let of = flag.name.strip_prefix(DURING).filter(|_| flag.law == Law::Kept)?;
    Some(folded::analysis_of(symbol) == Some(of))
}

/// An operating-point value as an expression of the deck's.
#[derive(Clone, Debug)]
pub struct Told {
    pub name: String,
    pub unit: String,
    pub meaning: String,
    pub value: Id,
}

/// What a deck is told of a module that behaves.
#[derive(Default)]
pub struct Behaviour {
    /// sources of small signals: wave, amplitude (real, imaginary)
    pub stimuli: Vec<(usize, (f64, f64))>,
    /// unknowns that are late
    pub late: Vec<usize>,
    /// does anything of it hang on time, analyses or events?
    pub any: bool,
}

fn reads_foreign(g: &Graph, ids: &[Id]) -> bool {
    g.reachable(ids).into_iter().any(|id| Folded::is_foreign(g.node(id)))
}

/// Of each flow: does it stand in the deck's expressions? A row of an unknown that one of these reads goes with it.
fn foreign_flows(folded: &Folded) -> Vec<bool> {
    let g = &folded.graph;
    let mut foreign: Vec<bool> = folded.flows.iter().map(|f| reads_foreign(g, &[f.i, f.q])).collect();
    let told = folded.outputs.iter().map(|o| o.value).filter(|&e| reads_foreign(g, &[e]));
    let mut look: Vec<Id> = told.chain(folded.modes.iter().map(|mode| mode.of())).collect();
    look.extend(folded.flows.iter().zip(&foreign).filter(|(_, &f)| f).flat_map(|(f, _)| [f.i, f.q]));
    let mut seen = HashSet::new();
    while !look.is_empty() {
        let ports = g.reachable(&look).into_iter().filter_map(|id| match g.node(id) {
            Node::Unknown(k) => folded.ports.get(k as usize),
            _ => None,
        });
        let read: Vec<usize> = ports.map(|p| p.from).filter(|&k| seen.insert(k)).collect();
        look.clear();
        for k in read {
            let own = folded.unknowns.get(k).is_some_and(|u| u.kind == folded::Kind::Current);
            let rows = folded.flows.iter().enumerate().filter(|(_, f)| own && f.from == k);
            for (j, f) in rows {
                if !std::mem::replace(&mut foreign[j], true) {
                    look.extend([f.i, f.q]);
                }
            }
        }
    }
    foreign
}

/// The part that runs as a device. Noise is asked for in .noise alone, about a point at which time stands still.
fn as_device(folded: &Folded, foreign: &[bool]) -> Folded {
    let mut rest = folded.clone();
    let kept = |f: &(Flow, &bool)| !*f.1;
    rest.flows = std::mem::take(&mut rest.flows).into_iter().zip(foreign).filter(kept).map(|f| f.0).collect();
    let g = &mut rest.graph;
    rest.outputs.retain(|o| !reads_foreign(g, &[o.value]));
    let powers: Vec<Id> = rest.noise.iter().flat_map(|n| [Some(n.power), n.exponent]).flatten().collect();
    let start = (g.time(), g.constant(0.0));
    let powers = crate::derive::substitute(g, &powers, &[start]);
    let places = rest.noise.iter_mut().flat_map(|n| std::iter::once(&mut n.power).chain(n.exponent.as_mut()));
    places.zip(powers).for_each(|(place, power)| *place = power);
    rest.behaves = false;
    rest.modes.clear();
    rest.stimuli.clear();
    rest
}

impl Model {
    /// An instance of a module more, between unknowns (-1: ground), with its inner unknowns, m in parallel. Errors are sentences for
    /// the user.
    pub fn add_module(
        &mut self,
        g: &mut Graph,
        module: &str,
        (name, terminals): (&str, &[i32]),
        folded: &Arc<Folded>,
        m: f64,
        gmin: f64,
    ) -> Result<Behaviour, String> {
        if !folded.behaves {
            self.add_compiled(module, name, terminals, folded, m)?;
            return Ok(Behaviour::default());
        }
        let foreign = foreign_flows(folded);
        let rest = Arc::new(as_device(folded, &foreign));
        let seat = self.add_compiled(module, name, terminals, &rest, m)?;
        let place = seats(&rest)?;
        let nodes = place.iter().map(|p| p.and_then(|p| seat.get(p).copied()).unwrap_or(-1)).collect();
        let mut copy = Copy { folded, name, nodes, gmin, image: HashMap::new(), modes: Vec::new() };
        let mut told = Behaviour { any: true, ..Behaviour::default() };
        for &amplitude in &folded.stimuli {
            self.waves.push(Wave::new("dc", &[0.0], None)?);
            told.stimuli.push((self.waves.len() - 1, amplitude));
        }
        self.put_modes(g, &mut copy, &mut told);
        let waves: Vec<usize> = told.stimuli.iter().map(|s| s.0).collect();
        for (flow, _) in folded.flows.iter().zip(&foreign).filter(|(_, &foreign)| foreign) {
            let own = folded.unknowns.get(flow.from).is_some_and(|u| u.kind == folded::Kind::Current);
            let times = g.constant(if own { 1.0 } else { m });
            for (e, is_charge) in [(flow.i, false), (flow.q, true)] {
                let e = self.copied(g, &mut copy, &waves, e);
                let e = g.mul(times, e);
                let less = g.neg(e);
                for (end, e) in [(flow.from, e), (flow.to, less)] {
                    let node = if end == GROUND { -1 } else { copy.nodes[end] };
                    let (Ok(row), false) = (usize::try_from(node), g.value(e) == Some(0.0)) else { continue };
                    let rows = if is_charge { &mut self.q } else { &mut self.f };
                    let sum = rows.get(&row).map_or(e, |&old| g.add(old, e));
                    rows.insert(row, sum);
                }
            }
        }
        let behaving = folded.outputs.iter().filter(|o| reads_foreign(&folded.graph, &[o.value]));
        for o in behaving {
            let value = self.copied(g, &mut copy, &waves, o.value);
            let (own, unit, meaning) = (o.name.clone(), o.unit.clone(), o.meaning.clone());
            self.told.entry(name.into()).or_default().push(Told { name: own, unit, meaning, value });
        }
        Ok(told)
    }

    /// Flags and histories for the modes, with what they ask of.
    fn put_modes(&mut self, g: &mut Graph, copy: &mut Copy, told: &mut Behaviour) {
        let zero = g.constant(0.0);
        let modes = copy.folded.modes.clone();
        for (k, mode) in modes.iter().enumerate() {
            let law = match mode {
                Mode::Above(_) => Law::Condition,
                Mode::Kept(_) => Law::History,
                Mode::Late(..) => {
                    let name = format!("{}#late{k}", copy.name);
                    self.unknowns.push(Unknown { name, kind: Kind::Branch, unit: String::new(), initial: 0.0 });
                    copy.modes.push(g.unknown(self.unknowns.len() as u32 - 1));
                    continue;
                }
                Mode::Floor(_) => {
                    copy.modes.push(zero); // made below, of what is there by then
                    continue;
                }
            };
            let name = format!("{}#{k}", copy.name);
            self.flags.push(FlagSpec { up: zero, down: zero, name, initial: -1, rest: -1, law });
            copy.modes.push(g.flag(self.flags.len() as u32 - 1));
        }
        let waves: Vec<usize> = told.stimuli.iter().map(|s| s.0).collect();
        for (k, mode) in modes.iter().enumerate() {
            if let Mode::Floor(e) = *mode {
                let e = self.copied(g, copy, &waves, e);
                copy.modes[k] = self.floor(g, copy.name, e);
            }
        }
        for (k, mode) in modes.iter().enumerate() {
            let e = match mode {
                Mode::Floor(_) => continue,
                mode => self.copied(g, copy, &waves, mode.of()),
            };
            match (g.node(copy.modes[k]), mode) {
                (Node::Flag(flag), _) => (self.flags[flag as usize].up, self.flags[flag as usize].down) = (e, e),
                (Node::Unknown(row), &Mode::Late(_, by)) => {
                    self.put_late(g, row as usize, e, by);
                    told.late.push(row as usize);
                }
                _ => {}
            }
        }
    }

    /// The unknown `row` is what e was so long ago; e itself until a run begins.
    fn put_late(&mut self, g: &mut Graph, row: usize, e: Id, by: f64) {
        let still = self.standstill();
        self.waves.push(Wave::exchanged());
        let wave = self.waves.len() - 1;
        self.delays.push(Delay { of: e, by, wave, row, initial: 0.0 });
        let (x, still, past) = (g.unknown(row as u32), g.wave(still as u32), g.wave(wave as u32));
        let one = g.constant(1.0);
        let (now, then) = (g.mul(still, e), g.sub(one, still));
        let then = g.mul(then, past);
        let less = g.sub(x, now);
        let f = g.sub(less, then);
        self.f.insert(row, f);
    }

    /// The wave that is 1 until a run begins.
    pub fn standstill(&mut self) -> usize {
        *self.still.get_or_insert_with(|| {
            self.waves.push(Wave::exchanged());
            self.waves.len() - 1
        })
    }

    /// A number that goes with how the equations are used; no event changes it.
    fn held(&mut self, g: &mut Graph, name: &str, initial: i8) -> Id {
        let k = self.flags.iter().position(|f| f.law == Law::Kept && f.name == name).unwrap_or_else(|| {
            let zero = g.constant(0.0);
            let law = Law::Kept;
            self.flags.push(FlagSpec { up: zero, down: zero, name: name.into(), initial, rest: -1, law });
            self.flags.len() - 1
        });
        g.flag(k as u32)
    }

    /// analysis("..").
    fn analysis(&mut self, g: &mut Graph, name: &str) -> Id {
        let one = g.constant(1.0);
        let still = |model: &mut Self, g: &mut Graph| {
            let still = model.standstill();
            g.wave(still as u32)
        };
        match name {
            "static" => {
                let (still, moves) = (still(self, g), self.held(g, SMALL_SIGNALS, 0));
                let rests = g.sub(one, moves);
                g.mul(still, rests)
            }
            "ic" => {
                let (still, runs) = (still(self, g), self.analysis(g, "tran"));
                g.mul(still, runs)
            }
            _ => self.held(g, &format!("{DURING}{name}"), i8::from(name == "tran")),
        }
    }

    /// 1 while e is above 0; `kink`: what it chooses between is the same at 0.
    fn above(&mut self, g: &mut Graph, name: &str, e: Id, kink: bool) -> Id {
        let law = if kink { Law::Stays } else { Law::Condition };
        let same = |f: &FlagSpec| f.up == e && f.down == e && f.law == law;
        let k = self.flags.iter().position(same).unwrap_or_else(|| {
            self.flags.push(FlagSpec { up: e, down: e, name: name.into(), initial: -1, rest: -1, law });
            self.flags.len() - 1
        });
        g.flag(k as u32)
    }

    /// The whole number below e. Two flags tell it modulo 4, and one of them flips from each whole number to the next; given this
    /// remainder r, the nearest r + 4 k to e - 1/2 stays what it is while a step runs on past the next one (as in assemble/context.py).
    fn floor(&mut self, g: &mut Graph, name: &str, e: Id) -> Id {
        if let Some(v) = g.value(e) {
            return g.constant(v.floor());
        }
        let [one, two, three, four] = [1.0, 2.0, 3.0, 4.0].map(|v| g.constant(v));
        let [zero, turn, half] = [0.0, FRAC_PI_2, 0.5].map(|v| g.constant(v));
        // rounding: what agrees with a whole number in half of its digits is on it
        let past = g.constant(FRAC_PI_2 * f64::EPSILON.sqrt());
        let fourth = g.div(e, four);
        let fours = g.call(Fun::Floor, fourth);
        let fours = g.mul(four, fours);
        let within = g.sub(e, fours);
        let angle = g.mul(turn, within);
        let angle = g.add(angle, past);
        let [sine, cosine] = [Fun::Sin, Fun::Cos].map(|f| g.call(f, angle));
        let (upper, outer) = (self.above(g, name, sine, false), self.above(g, name, cosine, false));
        let (low, high) = (g.select(outer, zero, one), g.select(outer, three, two));
        let r = g.select(upper, low, high);
        let near = g.sub(e, half);
        let near = g.sub(near, r);
        let near = g.div(near, four);
        let near = g.call(Fun::Round, near);
        let near = g.mul(four, near);
        g.add(r, near)
    }

    /// An expression of the module in the deck's graph.
    fn copied(&mut self, g: &mut Graph, copy: &mut Copy, waves: &[usize], e: Id) -> Id {
        let of = &copy.folded.graph;
        for id in of.reachable(&[e]) {
            if copy.image.contains_key(&id) {
                continue;
            }
            let node = of.node(id);
            let new = match node {
                Node::Unknown(k) => copy.port(g, k as usize),
                Node::Time => g.time(),
                Node::Flag(k) => copy.modes[k as usize],
                Node::Wave(k) => g.wave(waves[k as usize] as u32),
                Node::Symbol(GMIN) => g.constant(copy.gmin),
                Node::Symbol(SOURCE_SCALE) => g.constant(1.0),
                Node::Symbol(k) => self.analysis(g, folded::analysis_of(k).unwrap_or("")),
                Node::NotLess(a, b) => {
                    let beyond = g.sub(copy.image[&b], copy.image[&a]);
                    match is_logic(g, beyond) {
                        true => g.not_less(copy.image[&a], copy.image[&b]),
                        false => {
                            let less = self.above(g, copy.name, beyond, false);
                            let one = g.constant(1.0);
                            g.sub(one, less)
                        }
                    }
                }
                Node::Select(c, yes, no) => {
                    let kink = copy.kink(c, yes, no).map(|(a, b)| g.sub(copy.image[&b], copy.image[&a]));
                    match kink.filter(|&beyond| !is_logic(g, beyond)) {
                        Some(beyond) => {
                            let less = self.above(g, copy.name, beyond, true);
                            g.select(less, copy.image[&no], copy.image[&yes])
                        }
                        None => g.select(copy.image[&c], copy.image[&yes], copy.image[&no]),
                    }
                }
                _ => {
                    let mut operands = [0; 3];
                    node.operands().enumerate().for_each(|(k, o)| operands[k] = copy.image[&o]);
                    g.rebuild(node, operands)
                }
            };
            copy.image.insert(id, new);
        }
        copy.image[&e]
    }
}

/// Is it made of flags and constants alone?
fn is_logic(g: &Graph, e: Id) -> bool {
    let plain = |id: Id| !g.node(id).is_leaf() || matches!(g.node(id), Node::Const(_) | Node::Flag(_));
    g.reachable(&[e]).into_iter().all(plain)
}

/// One instance on its way into the deck's graph.
struct Copy<'a> {
    folded: &'a Folded,
    name: &'a str,
    /// unknown of the deck for each of the module, -1: ground
    nodes: Vec<i32>,
    gmin: f64,
    image: HashMap<Id, Id>,
    /// of each mode, what it is in the deck
    modes: Vec<Id>,
}

impl Copy<'_> {
    fn port(&self, g: &mut Graph, k: usize) -> Id {
        let port = &self.folded.ports[k];
        let [from, to] = [port.from, port.to].map(|end| if end == GROUND { -1 } else { self.nodes[end] });
        let [from, to] = [from, to].map(|node| match u32::try_from(node) {
            Ok(k) => g.unknown(k),
            Err(_) => g.constant(0.0),
        });
        g.sub(from, to)
    }

    /// What a selection compares, where it gives the same on both sides: min, max, abs.
    fn kink(&self, c: Id, yes: Id, no: Id) -> Option<(Id, Id)> {
        let g = &self.folded.graph;
        let Node::NotLess(a, b) = g.node(c) else { return None };
        let compared = BTreeSet::from([a, b]);
        let is_zero = |e: Id| g.value(e) == Some(0.0);
        let turned = |x: Id, y: Id| g.node(x) == Node::Neg(y) || g.node(y) == Node::Neg(x);
        let magnitude = turned(yes, no) && (is_zero(b) && (yes == a || no == a) || is_zero(a) && (yes == b || no == b));
        (compared == BTreeSet::from([yes, no]) || magnitude).then_some((a, b))
    }
}
