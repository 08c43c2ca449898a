//! The shape of a module's instance: what is left of a `Folded` when its constants are put aside. Instances of one shape share one program,
//! and keep their constants.
//!
//!   Folded      merged unknowns become one, ports that nothing reads go, currents between the same nodes are added
//!   anonymous   every constant but 0 and 1 becomes Wave(k): constant number k of the instance
//!   slopes      of every current and charge by every port voltage it hangs on (derive::slopes)
//!   hoisted     what hangs on constants alone is computed once for an instance (`prologue`), and is a constant too from then on
//!
//! A program reads port p as Unknown(p), gmin as Unknown(P).
use super::class::{Link, Shape};
use super::compiled::MOST_LIMITED;
use super::limits::Limiter;
use crate::derive;
use crate::graph::{Graph, Id, Node};
use crate::tape::{Four, Inputs, Tape};
use crate::veriloga::folded::{self, Folded, GMIN, SOURCE_SCALE};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::OnceLock;

/// What an unknown of an instance is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sort {
    Node,
    Current,
    /// d/dt of something: its row says so, and nothing else
    Rate,
}

/// An unknown that an instance asks for.
#[derive(Clone, Copy, Debug)]
pub enum Wanted<'a> {
    /// of its own, by name
    Own(&'a str, Sort),
    /// the rate of what is at a node, which all who read it share
    Rate(i32),
}

/// Constants of an instance, one after the other.
pub type Constants = Vec<f64>;

/// What two instances must have in common to share a program.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Key {
    module: String,
    nodes: Vec<Node>,
    results: Vec<Id>,
    ports: Vec<(usize, usize, Option<Limiter>)>,
    branches: Vec<(usize, usize)>,
    inner: Vec<(String, Sort)>,
    rates: Vec<usize>,
    terminals: usize,
    outputs: Vec<String>,
}

/// Where results of the program stand, of one branch.
pub struct Current {
    pub i: usize,
    pub q: Option<usize>,
}

/// ... and of a slope: of branch `branch` by port `port`.
pub struct Slope {
    pub branch: usize,
    pub port: usize,
    pub g: usize,
    pub c: Option<usize>,
}

/// A source of noise: branch from node to node, results of `Program::told`.
pub struct Noise {
    pub branch: (usize, usize),
    pub name: String,
    pub power: usize,
    pub exponent: Option<usize>,
}

pub struct Program {
    pub module: String,
    /// Unknowns of an instance that it does not share with others: name and kind; terminals come before them.
    pub inner: Vec<(String, Sort)>,
    /// behind them: the rates of these nodes
    pub rates: Vec<usize>,
    pub terminals: usize,
    pub shape: Shape,
    pub limited: Vec<(usize, Limiter)>, // ports
    pub exponential: bool,
    pub currents: Vec<Current>,
    pub slopes: Vec<Slope>,
    /// of each branch: its voltage as a sum of port voltages, where it is one
    pub along: Vec<Option<Vec<(usize, f64)>>>,
    pub noise: Vec<Noise>,
    /// operating-point values: name, unit, meaning
    pub outputs: Vec<[String; 3]>,
    /// current and charge of each branch; noise and operating-point values
    graph: Graph,
    flows: Vec<(Id, Id)>,
    told: Vec<Id>,
    prologue: Tape,
    /// everything that an iteration wants ...
    pub lines: Tape,
    /// ... and currents and charges alone: i, q of each branch.
    pub values: Tape,
    /// `lines` on four instances at once, where there is machine code for that
    pub four: Option<Four>,
    tell: OnceLock<Tape>,
    constants: usize,
}

/// One instance of a `Folded`, its constants put aside.
pub struct Anonymous {
    pub key: Key,
    pub constants: Constants,
    /// of every limited port
    pub arguments: Vec<Vec<f64>>,
    graph: Graph,
    flows: Vec<(Id, Id)>,
    told: Vec<Id>,
    noise: Vec<Noise>,
    outputs: Vec<[String; 3]>,
    inner: Vec<(String, Sort)>,
}

/// Unknowns that are one: number of each among those that are left, the terminals first, None for the reference node.
fn places(folded: &Folded, rates: &HashMap<usize, Difference>) -> Result<(Vec<Option<usize>>, Vec<usize>), String> {
    let n = folded.unknowns.len();
    // the reference node is number n
    let mut root: Vec<usize> = (0..=n).collect();
    let find = |root: &[usize], mut k: usize| {
        while root[k] != k {
            k = root[k];
        }
        k
    };
    let rank = |k: usize| if k == n { 0 } else { k + 1 };
    for &(a, b) in &folded.merged {
        let (a, b) = (find(&root, a.min(n)), find(&root, b.min(n)));
        let (to, from) = if rank(a) <= rank(b) { (a, b) } else { (b, a) };
        if from < folded.terminals && from != to {
            let name = |k: usize| folded.unknowns.get(k).map_or("ground", |u| u.name.as_str());
            return Err(format!("its terminals {} and {} are joined by a resistance of 0", name(to), name(from)));
        }
        root[from] = to;
    }
    let (mut place, mut left) = (vec![None; n], Vec::new());
    for k in (0..n).filter(|k| !rates.contains_key(k)) {
        let to = find(&root, k);
        if to == k {
            place[k] = Some(left.len());
            left.push(k);
        } else if to < n {
            place[k] = place[to];
        }
    }
    Ok((place, left))
}

/// What is at one unknown less what is at another.
type Difference = (usize, usize);

/// Unknowns that are the rate of a difference, by their only row: C(v) dv/dt has one. Rates of nodes are in their place then, of which
/// there are fewer: a gate that ten transistors share has one.
fn rates_of_differences(folded: &Folded) -> HashMap<usize, Difference> {
    // the port that an expression is, and does it look the same way?
    let port = |e: Id| match folded.graph.node(e) {
        Node::Unknown(k) => folded.ports.get(k as usize).map(|p| (p, true)),
        Node::Neg(a) => match folded.graph.node(a) {
            Node::Unknown(k) => folded.ports.get(k as usize).map(|p| (p, false)),
            _ => None,
        },
        _ => None,
    };
    let inner = (folded.terminals..folded.unknowns.len())
        .filter(|&k| folded.unknowns[k].kind == folded::Kind::Current)
        .filter(|&k| !folded.merged.iter().any(|&(a, b)| a == k || b == k));
    inner
        .filter_map(|k| {
            let mut rows = folded.flows.iter().filter(|f| f.from == k || f.to == k);
            let row = rows.next().filter(|row| row.from == k)?;
            let ((own, along), (of, with)) = (port(row.i)?, port(row.q)?);
            let alone = rows.next().is_none() && (own.from, own.to) == (k, folded::GROUND) && of.limit.is_none();
            let nodes = [of.from, of.to]
                .iter()
                .all(|&end| folded.unknowns.get(end).is_none_or(|u| u.kind != folded::Kind::Current));
            // u = -d/dt of q where the row is u + dq/dt
            (alone && nodes).then_some((k, if along == with { (of.to, of.from) } else { (of.from, of.to) }))
        })
        .collect()
}

/// The place of each unknown among the nodes of a seat, None at the reference node and of rates.
pub fn seats(folded: &Folded) -> Result<Vec<Option<usize>>, String> {
    Ok(places(folded, &rates_of_differences(folded))?.0)
}

/// Where the unknowns of an instance are: terminals and its own nodes and currents, then rates, then ground.
struct Places {
    of: Vec<Option<usize>>,
    /// those that are left, by their numbers in the module
    left: Vec<usize>,
    /// places whose rates are read
    rates: Vec<usize>,
    differences: HashMap<usize, Difference>,
    ground: usize,
}

impl Places {
    fn new(folded: &Folded) -> Result<Places, String> {
        let differences = rates_of_differences(folded);
        let (of, left) = places(folded, &differences)?;
        let ends = (0..folded.unknowns.len()).filter_map(|k| differences.get(&k));
        let place = |k: usize| of.get(k).copied().flatten();
        let mut rates: Vec<usize> = ends.flat_map(|&(a, b)| [place(a), place(b)]).flatten().collect();
        rates.sort_unstable();
        rates.dedup();
        let ground = left.len() + rates.len();
        Ok(Places { of, left, rates, differences, ground })
    }

    fn of(&self, k: usize) -> Option<usize> {
        self.of.get(k).copied().flatten()
    }

    fn at(&self, k: usize) -> usize {
        self.of(k).unwrap_or(self.ground)
    }

    fn rate(&self, k: usize) -> usize {
        let place = |k| self.left.len() + self.rates.binary_search(&k).expect("one of them");
        self.of(k).map_or(self.ground, place)
    }

    /// The two ends of a port of the module.
    fn ends(&self, port: &folded::Port) -> (usize, usize) {
        match self.differences.get(&port.from) {
            Some(&(a, b)) => (self.rate(a), self.rate(b)),
            None => (self.at(port.from), self.at(port.to)),
        }
    }

    /// Flows of the module but for rows of rates of differences.
    fn rows<'a>(&'a self, folded: &'a Folded) -> impl Iterator<Item = &'a folded::Flow> {
        folded.flows.iter().filter(|f| !self.differences.contains_key(&f.from))
    }
}

/// Ports that something reads, each once.
#[derive(Default)]
struct Ports {
    list: Vec<(usize, usize, Option<Limiter>)>,
    arguments: Vec<Vec<f64>>,
    /// of each port of the module: the port here, and whether it looks the same way; None between a node and itself
    seen: HashMap<u32, Option<(u32, bool)>>,
}

impl Ports {
    fn read(folded: &Folded, outs: &[Id], places: &Places) -> Result<Ports, String> {
        let leaves = folded.graph.reachable(outs).into_iter().filter_map(|id| match folded.graph.node(id) {
            Node::Unknown(k) => Some(k),
            _ => None,
        });
        let mut ports = Ports::default();
        for k in leaves.collect::<BTreeSet<u32>>() {
            let port = folded.ports.get(k as usize).ok_or("a port that is not there")?;
            let (from, to) = places.ends(port);
            if from == to {
                ports.seen.insert(k, None);
                continue;
            }
            let limiter = port.limit.as_ref().map(|l| Limiter::named(&l.function, l.arguments.len())).transpose()?;
            let same = |a, b| ports.list.iter().position(|p| limiter.is_none() && *p == (a, b, None));
            let (number, along) = match (same(from, to), same(to, from)) {
                (Some(p), _) => (p, true),
                (_, Some(p)) => (p, false),
                _ => {
                    ports.list.push((from, to, limiter));
                    ports.arguments.extend(port.limit.as_ref().map(|l| l.arguments.clone()));
                    (ports.list.len() - 1, true)
                }
            };
            ports.seen.insert(k, Some((number as u32, along)));
        }
        if ports.arguments.len() > MOST_LIMITED {
            return Err(format!("$limit is asked for at more than {MOST_LIMITED} voltages"));
        }
        Ok(ports)
    }

    fn leaf(&self, k: u32, g: &mut Graph) -> Id {
        match self.seen[&k] {
            None => g.constant(0.0),
            Some((p, true)) => g.unknown(p),
            Some((p, false)) => {
                let v = g.unknown(p);
                g.neg(v)
            }
        }
    }
}

/// Copies expressions, with constants but 0 and 1 put aside.
fn anonymous(folded: &Folded, outs: &[Id], ports: &Ports, g: &mut Graph) -> Result<(Vec<Id>, Constants), String> {
    let gmin = ports.list.len() as u32;
    let mut constants = Constants::new();
    let mut slots: HashMap<u64, u32> = HashMap::new();
    let mut refused = false;
    let images = folded.graph.copied(outs, g, |node, g| match node {
        Node::Const(bits) => {
            let v = f64::from_bits(bits);
            if v == 0.0 || v == 1.0 {
                return Some(g.constant(v));
            }
            let next = slots.len() as u32;
            let slot = *slots.entry(bits).or_insert(next);
            if slot == next {
                constants.push(v);
            }
            Some(g.wave(slot))
        }
        Node::Unknown(k) => Some(ports.leaf(k, g)),
        Node::Symbol(GMIN) => Some(g.unknown(gmin)),
        Node::Symbol(SOURCE_SCALE) => Some(g.constant(1.0)),
        // (rows that read these stand in the deck's own expressions: model/behaviour.rs)
        Node::Time | Node::Symbol(_) | Node::Wave(_) | Node::Flag(_) => {
            refused = true;
            Some(g.constant(0.0))
        }
        _ => None,
    });
    if refused {
        return Err("a source of noise hangs on time or on events".into());
    }
    Ok((images, constants))
}

/// Currents and charges of branches: those between the same nodes are one.
#[derive(Default)]
struct Branches {
    ends: Vec<(usize, usize)>,
    flows: Vec<(Id, Id)>,
}

impl Branches {
    fn add(&mut self, g: &mut Graph, (from, to): (usize, usize), (i, q): (Id, Id)) {
        if let Some(k) = self.ends.iter().position(|&b| b == (from, to)) {
            self.flows[k] = (g.add(self.flows[k].0, i), g.add(self.flows[k].1, q));
        } else if let Some(k) = self.ends.iter().position(|&b| b == (to, from)) {
            self.flows[k] = (g.sub(self.flows[k].0, i), g.sub(self.flows[k].1, q));
        } else {
            self.ends.push((from, to));
            self.flows.push((i, q));
        }
    }

    /// Is the row of this place that of a rate: its own unknown, and the rate of something?
    fn is_rate(&self, g: &Graph, ports: &Ports, place: usize, ground: usize) -> bool {
        let own = ports.list.iter().position(|p| (p.0, p.1) == (place, ground)).map(|p| Node::Unknown(p as u32));
        let mut rows = self.ends.iter().zip(&self.flows).filter(|(b, _)| b.0 == place || b.1 == place);
        let Some((_, &(i, q))) = rows.next().filter(|_| own.is_some()) else { return false };
        let i = if let Node::Neg(a) = g.node(i) { a } else { i };
        Some(g.node(i)) == own && g.value(q).is_none() && rows.next().is_none()
    }
}

/// What is told of an instance beside its currents.
#[derive(Default)]
struct Told {
    results: Vec<Id>,
    noise: Vec<Noise>,
    outputs: Vec<[String; 3]>,
}

impl Told {
    /// `images` of power and exponent of each source of noise, then of operating-point values; `multiple`: so many in parallel.
    fn new(
        folded: &Folded,
        places: &Places,
        g: &mut Graph,
        multiple: Id,
        images: &mut impl Iterator<Item = Id>,
    ) -> Told {
        let mut told = Told::default();
        let mut next = || images.next().expect("as many images as expressions");
        for source in &folded.noise {
            let power = next();
            let power = g.mul(multiple, power);
            let exponent = source.exponent.map(|_| next());
            let branch = (places.at(source.from), places.at(source.to));
            if branch.0 != branch.1 && g.value(power) != Some(0.0) {
                told.results.push(power);
                let power = told.results.len() - 1;
                told.results.extend(exponent);
                let exponent = exponent.map(|_| told.results.len() - 1);
                told.noise.push(Noise { branch, name: source.name.clone(), power, exponent });
            }
        }
        for output in &folded.outputs {
            told.results.push(next());
            told.outputs.push([output.name.clone(), output.unit.clone(), output.meaning.clone()]);
        }
        told
    }
}

impl Anonymous {
    /// `m`: so many in parallel.
    pub fn of(module: &str, folded: &Folded, m: f64) -> Result<Anonymous, String> {
        let places = Places::new(folded)?;
        let mut g = Graph::new();
        let mut outs: Vec<Id> = places.rows(folded).flat_map(|f| [f.i, f.q]).collect();
        outs.extend(folded.noise.iter().flat_map(|s| [Some(s.power), s.exponent]).flatten());
        outs.extend(folded.outputs.iter().map(|o| o.value));
        let ports = Ports::read(folded, &outs, &places)?;
        let (images, mut constants) = anonymous(folded, &outs, &ports, &mut g)?;
        let multiple = if m == 1.0 {
            g.constant(1.0)
        } else {
            constants.push(m);
            g.wave(constants.len() as u32 - 1)
        };
        let mut images = images.into_iter();
        let mut branches = Branches::default();
        for flow in places.rows(folded) {
            let (Some(mut i), Some(mut q)) = (images.next(), images.next()) else { break };
            let (from, to) = (places.at(flow.from), places.at(flow.to));
            let nothing = |e: Id| g.value(e) == Some(0.0);
            if from == to || (nothing(i) && nothing(q)) {
                continue;
            }
            if folded.unknowns[flow.from.min(folded.unknowns.len() - 1)].kind != folded::Kind::Current {
                (i, q) = (g.mul(multiple, i), g.mul(multiple, q));
            }
            branches.add(&mut g, (from, to), (i, q));
        }
        let told = Told::new(folded, &places, &mut g, multiple, &mut images);
        let sort = |&(place, k): &(usize, usize)| match folded.unknowns[k].kind {
            folded::Kind::Current if branches.is_rate(&g, &ports, place, places.ground) => Sort::Rate,
            folded::Kind::Current => Sort::Current,
            _ => Sort::Node,
        };
        let inner = places.left.iter().copied().enumerate().filter(|&(_, k)| k >= folded.terminals);
        let inner: Vec<(String, Sort)> = inner.map(|own| (folded.unknowns[own.1].name.clone(), sort(&own))).collect();
        let results: Vec<Id> =
            branches.flows.iter().flat_map(|f| [f.0, f.1]).chain(told.results.iter().copied()).collect();
        let mut number: HashMap<Id, Id> = HashMap::new();
        let mut nodes = Vec::new();
        for (k, id) in g.reachable(&results).into_iter().enumerate() {
            number.insert(id, k as Id);
            nodes.push(g.node(id).numbered(|id| number[&id]));
        }
        let key = Key {
            module: module.to_string(),
            nodes,
            results: results.iter().map(|r| number[r]).collect(),
            ports: ports.list,
            branches: branches.ends,
            inner: inner.clone(),
            rates: places.rates,
            terminals: folded.terminals,
            outputs: told.outputs.iter().map(|o| o[0].clone()).collect(),
        };
        Ok(Anonymous {
            key,
            constants,
            arguments: ports.arguments,
            graph: g,
            flows: branches.flows,
            told: told.results,
            noise: told.noise,
            outputs: told.outputs,
            inner,
        })
    }
}

impl Program {
    pub fn new(of: Anonymous) -> Program {
        let Anonymous { key, graph: mut g, flows, told, noise, outputs, inner, constants, .. } = of;
        let count = key.ports.len();
        let ports: Vec<Id> = (0..count as u32).map(|p| g.unknown(p)).collect();
        let both: Vec<Id> = flows.iter().flat_map(|f| [f.0, f.1]).collect();
        let slopes_of = derive::slopes(&mut g, &both, &ports);
        let there = |g: &Graph, e: Id| g.value(e) != Some(0.0);
        let mut links = vec![Link::default(); flows.len() * count];
        for (j, pair) in slopes_of.chunks_exact(2).enumerate() {
            for p in 0..count {
                links[j * count + p] = Link { current: there(&g, pair[0][p]), charge: there(&g, pair[1][p]) };
            }
        }
        let branches = key.branches.clone();
        let shape = Shape { ports: key.ports.iter().map(|p| (p.0, p.1)).collect(), branches, links };

        let (mut results, mut currents, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
        let mut put = |e: Id| {
            results.push(e);
            results.len() - 1
        };
        for (j, &(i, q)) in flows.iter().enumerate() {
            currents.push(Current { i: put(i), q: shape.stores(j).then(|| put(q)) });
            for p in 0..count {
                let link = shape.link(j, p);
                if link.current || link.charge {
                    let g = put(slopes_of[2 * j][p]);
                    let c = link.charge.then(|| put(slopes_of[2 * j + 1][p]));
                    slopes.push(Slope { branch: j, port: p, g, c });
                }
            }
        }
        let exponential = g.has_exponentials(&both);

        let (hoisted, program, outs) = hoist(&g, &[&results, &both]);
        let prologue = Tape::new(&g, &hoisted);
        let lines = Tape::new(&program, &outs[0]).native_into();
        let values = Tape::new(&program, &outs[1]).native_into();
        let along = shape.branches.iter().map(|&branch| path(&shape.ports, branch)).collect();
        let limited = key.ports.iter().enumerate().filter_map(|(p, port)| Some((p, port.2?))).collect();
        Program {
            module: key.module,
            inner,
            rates: key.rates,
            terminals: key.terminals,
            shape,
            limited,
            exponential,
            currents,
            slopes,
            along,
            noise,
            outputs,
            graph: g,
            flows,
            told,
            prologue,
            four: lines.four(),
            lines,
            values,
            tell: OnceLock::new(),
            constants: constants.len(),
        }
    }

    /// What programs read as constants: those of the instance, and what hangs on them alone.
    pub fn all_constants(&self, of: &[f64]) -> Constants {
        let mut all = of.to_vec();
        all.extend(self.prologue.eval(&Inputs { x: &[], t: 0.0, waves: of, flags: &[] }));
        all
    }

    pub fn ports(&self) -> usize {
        self.shape.ports.len()
    }

    /// Noise and operating-point values at port voltages; `x` ends with gmin.
    pub fn tell(&self, x: &[f64], constants: &[f64]) -> Vec<f64> {
        let tape = self.tell.get_or_init(|| Tape::new(&self.graph, &self.told));
        tape.eval(&Inputs { x, t: 0.0, waves: &constants[..self.constants], flags: &[] })
    }

    /// Result of `tell` that is operating-point value k.
    pub fn output(&self, k: usize) -> usize {
        self.told.len() - self.outputs.len() + k
    }

    fn in_graph(&self, outs: &[Id], constants: &[f64], g: &mut Graph, v: &[Id], gmin: Id) -> Vec<Id> {
        self.graph.copied(outs, g, |node, g| match node {
            Node::Unknown(p) => Some(v.get(p as usize).copied().unwrap_or(gmin)),
            Node::Wave(k) => Some(g.constant(constants[k as usize])),
            Node::Const(bits) => Some(g.constant(f64::from_bits(bits))),
            _ => None,
        })
    }

    /// An operating-point value in another graph.
    pub fn output_symbol(&self, number: usize, constants: &[f64], g: &mut Graph, v: &[Id], gmin: Id) -> Id {
        self.in_graph(&[self.told[self.output(number)]], constants, g, v, gmin)[0]
    }

    /// Currents and charges in another graph, with an instance's constants.
    pub fn symbols(&self, constants: &[f64], g: &mut Graph, v: &[Id], gmin: Id) -> Vec<(Id, Id)> {
        let outs: Vec<Id> = self.flows.iter().flat_map(|f| [f.0, f.1]).collect();
        let images = self.in_graph(&outs, constants, g, v, gmin);
        images.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect()
    }
}

/// Expressions of constants alone go: (those, a graph in which they are constants behind the others, the results there).
fn hoist(g: &Graph, results: &[&[Id]]) -> (Vec<Id>, Graph, Vec<Vec<Id>>) {
    let all = results.concat();
    let order = g.reachable(&all);
    let mut moves: HashMap<Id, bool> = HashMap::with_capacity(order.len());
    let mut first = 0;
    for &id in &order {
        let node = g.node(id);
        if let Node::Wave(k) = node {
            first = first.max(k + 1);
        }
        // (a list of arguments has no value that could be a constant)
        let on = matches!(node, Node::Unknown(_) | Node::Time | Node::Join(..)) || node.operands().any(|o| moves[&o]);
        moves.insert(id, on);
    }
    let still = |id: Id| !moves[&id] && !g.node(id).is_leaf();
    let mut wanted: BTreeMap<Id, u32> = BTreeMap::new();
    let mut want = |id: Id| {
        if still(id) {
            wanted.insert(id, 0);
        }
    };
    all.iter().copied().for_each(&mut want);
    order.iter().filter(|&id| moves[id]).flat_map(|&id| g.node(id).operands()).for_each(&mut want);
    // (the instance has as many constants as it has, whether or not the results read the last ones)
    let first = first.max((0..g.len() as Id).filter_map(|id| wave(g.node(id))).map(|k| k + 1).max().unwrap_or(0));
    wanted.values_mut().zip(first..).for_each(|(place, k)| *place = k);
    let mut program = Graph::new();
    let mut image: HashMap<Id, Id> = HashMap::new();
    for &id in &order {
        let node = g.node(id);
        let new = match node {
            _ if wanted.contains_key(&id) => program.wave(wanted[&id]),
            Node::Const(bits) => program.constant(f64::from_bits(bits)),
            _ if node.is_leaf() || moves[&id] => {
                let mut operands = [0; 3];
                node.operands().enumerate().for_each(|(k, o)| operands[k] = image[&o]);
                program.rebuild(node, operands)
            }
            _ => continue, // inside of what is hoisted
        };
        image.insert(id, new);
    }
    let outs = results.iter().map(|part| part.iter().map(|id| image[id]).collect()).collect();
    (wanted.into_keys().collect(), program, outs)
}

fn wave(node: Node) -> Option<u32> {
    if let Node::Wave(k) = node {
        Some(k)
    } else {
        None
    }
}

/// The voltage along a branch as a sum of port voltages, the shortest there is.
fn path(ports: &[(usize, usize)], (from, to): (usize, usize)) -> Option<Vec<(usize, f64)>> {
    let mut came: BTreeMap<usize, Option<(usize, usize, f64)>> = BTreeMap::from([(from, None)]);
    let mut queue = std::collections::VecDeque::from([from]);
    while let Some(at) = queue.pop_front() {
        if at == to {
            break;
        }
        for (p, &(a, b)) in ports.iter().enumerate() {
            let step = [(a, b, 1.0), (b, a, -1.0)].into_iter().find(|s| s.0 == at);
            if let Some((_, next, sign)) = step.filter(|s| !came.contains_key(&s.1)) {
                came.insert(next, Some((at, p, sign)));
                queue.push_back(next);
            }
        }
    }
    let (mut at, mut sum) = (to, Vec::new());
    while let Some((before, p, sign)) = *came.get(&at)? {
        sum.push((p, sign));
        at = before;
    }
    Some(sum)
}
