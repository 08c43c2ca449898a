//! Partial evaluation: a module is run once, as it stands in the text, with numbers where parameters decide and with expressions
//! where voltages do. What it contributes to its branches is gathered and becomes rows.
//!
//! A value is  id + d/dt q + noise: a charge goes along with what it is added to and multiplied by constants; anything else makes
//! an unknown of its own of it. Noise likewise.
use super::ast::{Allowed, Expression, Type, E};
use super::events::Held;
use super::folded::{
    self, Description, Flow, Folded, Kind, Limit, Mode, Output, Port, Unknown, GMIN, GROUND, SOURCE_SCALE,
};
use super::memory::{Memory, Owner, Remembered};
use super::source::{Place, Word};
use super::{Given, Library, Message, Value};
use emsim_expr::graph::{Graph, Id, Node};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

mod end;
mod parameters;

pub type Stop = Box<Message>;
pub type Answer<T> = Result<T, Stop>;

/// A number: id + d/dt q, and sources of noise with their factors.
#[derive(Clone, Debug)]
pub struct Num {
    pub id: Id,
    pub whole: bool,
    pub q: Option<Id>,
    pub noise: Option<Rc<Vec<(usize, Id)>>>,
}

#[derive(Clone, Debug)]
pub enum Val {
    Num(Num),
    Text(Arc<str>),
    /// the first index and the elements
    Row(i64, Rc<Vec<Val>>),
}

/// A source of noise, before it is known where it goes.
pub struct Source {
    pub name: String,
    pub power: Id,
    pub exponent: Option<Id>,
    /// where it goes: from, to, factor
    pub uses: Vec<(usize, usize, Id)>,
    /// the unknown that carries it where it goes to several places
    pub unknown: Option<Id>,
}

/// What was contributed to a branch so far: a flow i + d/dt iq, or a potential v + d/dt vq, as `is_potential` says (0, 1, or by
/// voltages).
#[derive(Clone, Copy, PartialEq)]
pub struct State {
    pub is_potential: Id,
    pub i: Id,
    pub iq: Id,
    pub v: Id,
    pub vq: Id,
    pub touched: bool,
    /// does what was contributed before the condition that is run count (0, 1, or by voltages)? Not where it became one of the
    /// other kind since; the sums are of what came since
    pub keep: Id,
}

pub struct Branch {
    pub from: usize,
    pub to: usize,
    pub state: State,
    /// the unknown that is its flow, where that is read or not given
    pub flow: Option<usize>,
    /// the equation that an indirect contribution asks for: id + d/dt q = 0
    pub indirect: Option<(Id, Option<Id>)>,
    /// noise of its potential
    pub noise: Vec<(usize, Id)>,
    pub at: Place,
}

/// The variables of a module or function while it is run.
#[derive(Default)]
pub struct Frame {
    pub values: Vec<Val>,
    /// what was changed in the condition that is run
    pub journal: Vec<(u32, Val)>,
    pub stamps: Vec<u32>,
    /// variables that were read before they had a value
    pub early: HashMap<u32, Place>,
    /// of a function: its number + 1
    pub function: usize,
    /// variables that events set
    pub held: BTreeMap<u32, Held>,
    pub at_event: bool,
    /// variables that have a value where a run begins
    pub begun: BTreeSet<u32>,
    /// those of them that keep their value
    pub memories: BTreeMap<u32, Memory>,
}

/// One module of the hierarchy.
pub struct Scope {
    pub module: usize,
    pub prefix: String,
    pub nodes: HashMap<(Word, Option<i64>), usize>,
    pub ranges: HashMap<Word, (i64, i64)>,
    pub parameters: Vec<Option<Val>>,
    pub given: HashMap<u32, Val>,
    pub connected: Vec<bool>,
    pub branches: HashMap<(usize, Option<i64>), usize>, // named
    pub pairs: HashMap<(usize, usize), usize>,          // between two nodes
}

pub struct Elaborator<'a> {
    pub library: &'a Library,
    pub given: &'a Given,
    pub g: Graph,
    pub scope: Scope,
    pub frame: Frame,
    pub unknowns: Vec<Unknown>,
    pub terminals: usize,
    pub ports: Vec<Port>,
    pub branches: Vec<Branch>,
    pub rows: Vec<Flow>,
    pub sources: Vec<Source>,
    pub noise_tables: Vec<folded::NoiseTable>,
    /// (node, unknown) of flows into a port that were read
    pub port_flows: Vec<(usize, Id, usize)>,
    /// variables without a value: symbols
    pub unset: HashMap<Id, (Word, Place)>,
    /// conditions that voltages decide, and how they came out where the run is
    pub path: Vec<(Id, bool)>,
    pub stamp: u32,
    pub next_stamp: u32,
    pub steps: usize,
    pub calls: usize,
    pub loops: usize,
    pub open_parameters: Vec<u32>,
    pub bound_step: Option<Id>,
    pub said: Vec<String>,
    pub left_out: Vec<String>,
    pub starts: Vec<(usize, f64)>,
    pub modes: Vec<Mode>,
    /// symbols of variables that keep their values, and what they come to
    pub finals: Vec<(Id, Id)>,
    /// variables that were found to keep their value from one evaluation to the next
    pub keepers: BTreeSet<Owner>,
    pub remembered: Vec<Remembered>,
    /// symbols whose values change between events
    pub moving: HashSet<Id>,
    pub stimuli: Vec<(f64, f64)>,
    pub outputs: Vec<Output>,
    /// Only parameters have values.
    pub only_parameters: bool,
}

/// ... and more operations.
pub const MOST_NODES: usize = 2_000_000;

impl<'a> Elaborator<'a> {
    fn new(library: &'a Library, given: &'a Given) -> Self {
        let mut g = Graph::new();
        // those that have a meaning for who runs the result
        for k in 0..folded::SYMBOLS {
            g.given(k);
        }
        Elaborator {
            library,
            given,
            g,
            scope: Scope::of(0, String::new()),
            frame: Frame::default(),
            unknowns: Vec::new(),
            terminals: 0,
            ports: Vec::new(),
            branches: Vec::new(),
            rows: Vec::new(),
            sources: Vec::new(),
            noise_tables: Vec::new(),
            port_flows: Vec::new(),
            unset: HashMap::new(),
            path: Vec::new(),
            stamp: 0,
            next_stamp: 0,
            steps: 0,
            calls: 0,
            loops: 0,
            open_parameters: Vec::new(),
            bound_step: None,
            said: Vec::new(),
            left_out: Vec::new(),
            starts: Vec::new(),
            modes: Vec::new(),
            finals: Vec::new(),
            keepers: BTreeSet::new(),
            remembered: Vec::new(),
            moving: HashSet::new(),
            stimuli: Vec::new(),
            outputs: Vec::new(),
            only_parameters: false,
        }
    }

    pub fn stop<T>(&self, at: Place, text: impl Into<String>, hint: impl Into<String>) -> Answer<T> {
        Err(Box::new(self.library.sources.message(at, text, hint)))
    }

    pub fn place(&self, e: E) -> Place {
        self.library.expression_places[e as usize]
    }

    pub fn word(&self, word: Word) -> &'a str {
        self.library.sources.word(word)
    }

    // ---- numbers ----

    pub fn constant(&mut self, value: f64) -> Num {
        Num { id: self.g.constant(value), whole: false, q: None, noise: None }
    }

    pub fn whole(&mut self, value: f64) -> Num {
        Num { whole: true, ..self.constant(value) }
    }

    pub fn real(&self, id: Id) -> Num {
        Num { id, whole: false, q: None, noise: None }
    }

    pub fn value_of(&self, n: &Num) -> Option<f64> {
        if n.q.is_some() || n.noise.is_some() {
            return None;
        }
        self.g.value(n.id)
    }

    /// A new unknown with a row of its own: i + dq/dt = 0 is to be given.
    pub fn unknown(&mut self, name: String) -> (usize, Id) {
        let k = self.unknowns.len();
        self.unknowns.push(Unknown { name: format!("{}{name}", self.scope.prefix), kind: Kind::Current });
        let id = self.port(k, GROUND, None);
        (k, id)
    }

    pub fn row(&mut self, k: usize, i: Id, q: Id) {
        self.rows.push(Flow { from: k, to: GROUND, i, q });
    }

    /// The same value without d/dt and noise, which become unknowns.
    pub fn plain(&mut self, n: &Num) -> Num {
        let mut id = n.id;
        if let Some(q) = n.q {
            let name = format!("ddt#{}", self.unknowns.len());
            let (k, u) = self.unknown(name);
            let minus = self.g.neg(u);
            self.row(k, minus, q);
            id = self.g.add(id, u);
        }
        if let Some(noise) = &n.noise {
            for &(source, factor) in noise.iter() {
                let u = self.noise_unknown(source);
                let term = self.g.mul(factor, u);
                id = self.g.add(id, term);
            }
        }
        Num { id, whole: n.whole, q: None, noise: None }
    }

    /// The unknown that a source of noise drives: its row is u = 0 plus the noise.
    pub fn noise_unknown(&mut self, source: usize) -> Id {
        if let Some(u) = self.sources[source].unknown {
            return u;
        }
        let name = format!("noise#{}", self.unknowns.len());
        let (k, u) = self.unknown(name);
        let zero = self.g.constant(0.0);
        let one = self.g.constant(1.0);
        self.row(k, u, zero);
        self.sources[source].unknown = Some(u);
        // uses so far read the unknown, see `finish`
        self.sources[source].uses.insert(0, (k, GROUND, one));
        u
    }

    // ---- nodes and ports ----

    /// The potential from one unknown to another, or an unknown current (k, GROUND).
    pub fn port(&mut self, from: usize, to: usize, limit: Option<Limit>) -> Id {
        if from == to {
            return self.g.constant(0.0);
        }
        if let Some(k) = self.ports.iter().position(|p| p.from == from && p.to == to && p.limit == limit) {
            return self.g.unknown(k as u32);
        }
        if limit.is_none() {
            if let Some(k) = self.ports.iter().position(|p| p.from == to && p.to == from && p.limit.is_none()) {
                let x = self.g.unknown(k as u32);
                return self.g.neg(x);
            }
        }
        if from == GROUND {
            if limit.is_some() {
                let x = self.port(to, from, None);
                return self.g.neg(x);
            }
            self.ports.push(Port { from: to, to: from, limit });
            let x = self.g.unknown(self.ports.len() as u32 - 1);
            return self.g.neg(x);
        }
        self.ports.push(Port { from, to, limit });
        self.g.unknown(self.ports.len() as u32 - 1)
    }

    fn kind_of(&self, discipline: Option<Word>) -> Kind {
        let Some(word) = discipline else { return Kind::Voltage };
        let found = self.library.disciplines.iter().find(|d| d.name == word);
        let volts = |nature: Word| self.word(nature) == "Voltage";
        if found.is_none_or(|d| d.potential.is_some_and(volts) || d.potential.is_none()) {
            return Kind::Voltage;
        }
        Kind::Other(super::folded::discipline(self.word(word)))
    }

    /// The nodes of the scope: ports as they are bound, others made.
    /// `bound`: the nodes of each port, of those that are connected from within another module.
    fn make_nodes(&mut self, bound: &[Vec<usize>]) -> Answer<()> {
        let module = &self.library.modules[self.scope.module];
        let mut seat = 0;
        for (k, node) in module.nodes.iter().enumerate() {
            let mut indices = vec![None];
            if let Some((a, b)) = node.range {
                let (low, high) = (self.index_of(a)?, self.index_of(b)?);
                if (high - low).abs() > 1000 {
                    return self.stop(node.at, "a row of more than 1000 nodes", "");
                }
                self.scope.ranges.insert(node.name, (low, high));
                let step = if high >= low { 1 } else { -1 };
                indices = (0..=(high - low).abs()).map(|j| Some(low + step * j)).collect();
            }
            let port = k < module.ports;
            let ends = bound.get(k).filter(|ends| port && !ends.is_empty());
            if let Some(ends) = ends.filter(|ends| ends.len() != indices.len()) {
                let what =
                    format!("port {} has {} nodes, here are {}", self.word(node.name), indices.len(), ends.len());
                return self.stop(node.at, what, "a part of a row: name[first:last]");
            }
            for (j, index) in indices.into_iter().enumerate() {
                let known = ends.map(|ends| ends[j]);
                seat += usize::from(port);
                let at = if node.ground {
                    GROUND
                } else if let Some(known) = known {
                    known
                } else {
                    let name = match index {
                        Some(j) => format!("{}{}[{j}]", self.scope.prefix, self.word(node.name)),
                        None => format!("{}{}", self.scope.prefix, self.word(node.name)),
                    };
                    self.unknowns.push(Unknown { name, kind: self.kind_of(node.discipline) });
                    self.unknowns.len() - 1
                };
                if port {
                    self.scope
                        .connected
                        .push(known.is_some() || (self.scope.prefix.is_empty() && seat <= self.given.connected));
                }
                self.scope.nodes.insert((node.name, index), at);
            }
        }
        Ok(())
    }

    pub fn index_of(&mut self, e: E) -> Answer<i64> {
        match self.known(e, "this index")? {
            v if v == v.round() && v.abs() < 1e9 => Ok(v as i64),
            v => self.stop(self.place(e), format!("{v} is no index"), "an index is a whole number"),
        }
    }

    pub fn node_at(&mut self, e: E) -> Answer<usize> {
        match *self.nodes_at(e)? {
            [only] => Ok(only),
            ref several => {
                let what = format!("a row of {} nodes", several.len());
                self.stop(self.place(e), what, "write one of them: name[index]")
            }
        }
    }

    /// One node, or those of a row or of a part of it, in the order in which they are written.
    pub fn nodes_at(&mut self, e: E) -> Answer<Vec<usize>> {
        let (word, part) = match self.library.expressions[e as usize] {
            Expression::Name(word, None) => (word, self.scope.ranges.get(&word).copied()),
            Expression::Name(word, Some(i)) => {
                let index = self.index_of(i)?;
                (word, Some((index, index)))
            }
            Expression::Part(word, a, b) => (word, Some((self.index_of(a)?, self.index_of(b)?))),
            Expression::List(ref list) => {
                let mut nodes = Vec::new();
                for &item in list {
                    nodes.extend(self.nodes_at(item)?);
                }
                return Ok(nodes);
            }
            _ => return self.stop(self.place(e), "a node is expected here", ""),
        };
        let indices: Vec<Option<i64>> = match part {
            None => vec![None],
            Some((a, b)) if a <= b => (a..=b).map(Some).collect(),
            Some((a, b)) => (b..=a).rev().map(Some).collect(),
        };
        let found: Option<Vec<usize>> = indices.iter().map(|&i| self.scope.nodes.get(&(word, i)).copied()).collect();
        match found {
            Some(nodes) => Ok(nodes),
            None => self.stop(self.place(e), format!("there is no node {}", self.word(word)), ""),
        }
    }

    // ---- branches ----

    /// The branch that an access names, and whether it is read against its direction.
    pub fn branch_of(&mut self, arguments: &[E], at: Place) -> Answer<(usize, bool)> {
        let module = &self.library.modules[self.scope.module];
        if let [only] = arguments {
            if let Expression::Name(word, index) = self.library.expressions[*only as usize] {
                if let Some(k) = module.branches.iter().position(|b| b.name == word) {
                    let index = match index {
                        Some(i) => Some(self.index_of(i)?),
                        None => None,
                    };
                    if let Some(&known) = self.scope.branches.get(&(k, index)) {
                        return Ok((known, false));
                    }
                    let branch = &module.branches[k];
                    let from = self.node_at(branch.ends.0)?;
                    let to = match branch.ends.1 {
                        Some(e) => self.node_at(e)?,
                        None => GROUND,
                    };
                    let made = self.make_branch(from, to, at);
                    self.scope.branches.insert((k, index), made);
                    return Ok((made, false));
                }
            }
        }
        let from = self.node_at(arguments[0])?;
        let to = match arguments.get(1) {
            Some(&e) => self.node_at(e)?,
            None => GROUND,
        };
        if let Some(&known) = self.scope.pairs.get(&(from, to)) {
            return Ok((known, false));
        }
        if let Some(&known) = self.scope.pairs.get(&(to, from)) {
            return Ok((known, true));
        }
        let made = self.make_branch(from, to, at);
        self.scope.pairs.insert((from, to), made);
        Ok((made, false))
    }

    fn make_branch(&mut self, from: usize, to: usize, at: Place) -> usize {
        let (zero, one) = (self.g.constant(0.0), self.g.constant(1.0));
        let state = State { is_potential: zero, i: zero, iq: zero, v: zero, vq: zero, touched: false, keep: one };
        self.branches.push(Branch { from, to, state, flow: None, indirect: None, noise: Vec::new(), at });
        self.branches.len() - 1
    }

    /// The flow of a branch as an unknown.
    pub fn flow_of(&mut self, branch: usize) -> Id {
        if let Some(k) = self.branches[branch].flow {
            return self.port(k, GROUND, None);
        }
        let name = |k: usize| self.unknowns.get(k).map_or("0", |u| u.name.as_str());
        let name = format!("I({},{})", name(self.branches[branch].from), name(self.branches[branch].to));
        let k = self.unknowns.len();
        self.unknowns.push(Unknown { name, kind: Kind::Current });
        self.branches[branch].flow = Some(k);
        self.port(k, GROUND, None)
    }

    // ---- the hierarchy ----

    /// Runs the module of the scope.
    pub fn run_module(&mut self, bound: &[Vec<usize>]) -> Answer<()> {
        let module = &self.library.modules[self.scope.module];
        self.make_nodes(bound)?;
        for k in 0..module.parameters.len() {
            self.parameter(k as u32)?;
        }
        self.frame = self.new_frame(&module.variables, 0)?;
        for k in 0..module.variables.len() {
            if let Some(e) = module.variables[k].initial {
                self.begin(k as u32, Some(e))?;
            }
        }
        for &s in &module.initial {
            self.execute(s)?;
        }
        self.hold(&self.all_statements())?;
        let without = self.remember();
        for &s in &module.analog {
            self.execute(s)?;
        }
        self.generate(&module.generated, "")?;
        self.note_memories(&without);
        self.finals.extend(self.frame.held.values().flat_map(Held::finals));
        self.operating_values()?;
        for instance in &module.instances {
            self.instance(instance, "")?;
        }
        Ok(())
    }

    /// Of a paramset: its choices become what its module is given.
    pub fn resolve_set(&mut self) -> Answer<()> {
        let mut nested = 0;
        while let Some(base) = self.library.modules[self.scope.module].base {
            nested += 1;
            let set = &self.library.modules[self.scope.module];
            let Some(target) = self.library.modules.iter().position(|m| m.name == base).filter(|_| nested < 20) else {
                let hint = "a paramset stands behind its module";
                return self.stop(set.at, format!("there is no module {}", self.word(base)), hint);
            };
            for k in 0..set.parameters.len() {
                self.parameter(k as u32)?;
            }
            self.frame = self.new_frame(&set.variables, 0)?;
            let mut given = HashMap::new();
            for &(word, e, at) in &set.choices {
                let Some(k) = self.parameter_named(target, self.word(word)) else {
                    return self.stop(at, format!("{} has no parameter {}", self.word(base), self.word(word)), "");
                };
                given.insert(k, self.eval(e)?);
            }
            let prefix = std::mem::take(&mut self.scope.prefix);
            self.scope = Scope::of(target, prefix);
            self.scope.given = given;
        }
        Ok(())
    }

    /// Variables with a description are the module's operating-point values.
    fn operating_values(&mut self) -> Answer<()> {
        let module = &self.library.modules[self.scope.module];
        for (k, variable) in module.variables.iter().enumerate() {
            if !variable.described {
                continue;
            }
            if let Val::Num(n) = &self.frame.values[k] {
                if n.q.is_none() && n.noise.is_none() && !self.unset.contains_key(&n.id) {
                    let name = format!("{}{}", self.scope.prefix, self.word(variable.name));
                    let (unit, meaning) = (variable.unit.clone(), variable.meaning.clone());
                    let factor = self.g.constant(self.given.multiplier.powi(variable.multiplicity));
                    let value = self.g.mul(n.id, factor);
                    self.outputs.push(Output { name, unit, meaning, value });
                }
            }
        }
        Ok(())
    }

    pub fn gmin(&mut self) -> Id {
        self.g.given(GMIN)
    }

    pub fn source_scale(&mut self) -> Id {
        self.g.given(SOURCE_SCALE)
    }
}

impl Scope {
    pub fn of(module: usize, prefix: String) -> Scope {
        Scope {
            module,
            prefix,
            nodes: HashMap::new(),
            ranges: HashMap::new(),
            parameters: Vec::new(),
            given: HashMap::new(),
            connected: Vec::new(),
            branches: HashMap::new(),
            pairs: HashMap::new(),
        }
    }
}

/// The instance of a module, or of the first paramset of its name whose ranges hold what is given.
pub fn fold(library: &Library, index: usize, given: &Given) -> Answer<Folded> {
    let word = library.modules[index].name;
    let mut answer = None;
    for k in (0..library.modules.len()).filter(|&k| library.modules[k].name == word) {
        let mut keepers = BTreeSet::new();
        loop {
            let mut run = Elaborator::new(library, given);
            run.scope = Scope::of(k, String::new());
            let ready = run.take_given().and_then(|()| run.resolve_set());
            if let Err(message) = ready {
                answer = answer.or(Some(message));
                break;
            }
            let module = &library.modules[run.scope.module];
            run.terminals = run.port_count(module)?;
            run.keepers.clone_from(&keepers);
            let done = run.run_module(&[]);
            if run.keepers.len() > keepers.len() {
                // once more, for what was read of them before was wrong
                keepers = run.keepers;
                continue;
            }
            done?;
            return run.finish();
        }
    }
    Err(answer.unwrap_or_default())
}

impl Elaborator<'_> {
    /// Terminals, rows of them counted one by one.
    fn port_count(&mut self, module: &super::ast::Module) -> Answer<usize> {
        let mut count = 0;
        for node in &module.nodes[..module.ports] {
            count += match node.range {
                Some((a, b)) => (self.index_of(a)? - self.index_of(b)?).unsigned_abs() as usize + 1,
                None => 1,
            };
        }
        Ok(count)
    }
}

pub fn describe(library: &Library, index: usize) -> Description {
    let module = &library.modules[index];
    let given = Given::default();
    let word = |w: Word| library.sources.word(w).to_string();
    // a paramset has the terminals of its module
    let mut base = module;
    for _ in 0..20 {
        match base.base.and_then(|b| library.modules.iter().find(|m| m.name == b)) {
            Some(next) => base = next,
            None => break,
        }
    }
    let mut run = Elaborator::new(library, &given);
    run.scope = Scope::of(index, String::new());
    run.only_parameters = true;
    let (mut terminals, mut disciplines) = (Vec::new(), Vec::new());
    for node in &base.nodes[..base.ports] {
        match node.range.and_then(|(a, b)| Some((run.index_of(a).ok()?, run.index_of(b).ok()?))) {
            Some((a, b)) if (a - b).abs() < 1000 => {
                let step = if b >= a { 1 } else { -1 };
                terminals.extend((0..=(b - a).abs()).map(|j| format!("{}[{}]", word(node.name), a + step * j)));
            }
            _ => terminals.push(word(node.name)),
        }
        disciplines.resize(terminals.len(), node.discipline.map_or_else(String::new, word));
    }
    let mut parameters = Vec::new();
    for (k, p) in module.parameters.iter().enumerate().filter(|p| !p.1.local) {
        let own = !run.hangs_on_others(p.default);
        let value = if own { run.parameter(k as u32).ok() } else { None };
        let default = match &value {
            Some(Val::Num(n)) => run.g.value(n.id),
            _ => None,
        };
        let text = p.kind == Some(Type::Text) || matches!(value, Some(Val::Text(_)));
        let integer = match &value {
            Some(Val::Num(n)) => n.whole,
            _ => p.kind == Some(Type::Integer),
        };
        parameters.push(folded::Parameter {
            names: std::iter::once(&p.name).chain(&p.aliases).map(|&w| word(w)).collect(),
            unit: p.unit.clone(),
            meaning: p.meaning.clone(),
            default,
            instance: p.instance,
            integer,
            text,
        });
    }
    Description { module: word(module.name), meaning: module.meaning.clone(), terminals, disciplines, parameters }
}

impl Elaborator<'_> {
    /// Does a default read other parameters, or the temperature?
    fn hangs_on_others(&self, e: E) -> bool {
        let again = |e: E| self.hangs_on_others(e);
        match &self.library.expressions[e as usize] {
            Expression::Number(..) | Expression::Text(_) => false,
            Expression::Unary(_, a) => again(*a),
            Expression::Binary(_, a, b) => again(*a) || again(*b),
            Expression::Conditional(a, b, c) => again(*a) || again(*b) || again(*c),
            Expression::List(list) => list.iter().any(|&e| again(e)),
            Expression::Call(_, list) => list.iter().any(|&e| again(e)),
            _ => true,
        }
    }
}
