//! What the cards contribute to equation (1), before it is compiled: see `system`.
mod behaviour;
pub use behaviour::{runs_during, Told};

use crate::clocked::Clocked;
use crate::devices::class::Series;
use crate::devices::shape::{Sort, Wanted};
use crate::devices::{compiled, maker, Class, Climate};
use crate::graph::{Graph, Id, Node};
use crate::logic::Logic;
use crate::veriloga::Folded;
use crate::waves::Wave;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// What an unknown is: its tolerance, and whether the DC operating point holds it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Kind {
    Node,
    Branch,
    Coordinate,
    Speed,
    Lambda,
    Mu,
    Derivative,
}

impl Kind {
    pub fn from_name(name: &str) -> Option<Kind> {
        Some(match name {
            "node" => Kind::Node,
            "branch" => Kind::Branch,
            "coordinate" => Kind::Coordinate,
            "speed" => Kind::Speed,
            "lambda" => Kind::Lambda,
            "mu" => Kind::Mu,
            "derivative" => Kind::Derivative,
            _ => return None,
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Kind::Node => "node",
            Kind::Branch => "branch",
            Kind::Coordinate => "coordinate",
            Kind::Speed => "speed",
            Kind::Lambda => "lambda",
            Kind::Mu => "mu",
            Kind::Derivative => "derivative",
        }
    }

    /// Multipliers and derivatives: linear in the equations, outside every norm.
    pub fn enters_linearly(self) -> bool {
        matches!(self, Kind::Lambda | Kind::Mu | Kind::Derivative)
    }

    /// Held at its initial value while the circuit's DC point is found.
    pub fn mechanical(self) -> bool {
        matches!(self, Kind::Coordinate | Kind::Speed | Kind::Lambda | Kind::Mu)
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Unknown {
    pub name: String,
    pub kind: Kind,
    pub unit: String,
    pub initial: f64,
}

/// What a flag does where its operand is exactly at its threshold.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Law {
    /// operand > 0: false at the threshold
    Condition,
    /// a switch without hysteresis: turns where its operand arrives at the threshold, from either side
    Arrival,
    /// both sides of the threshold give the same (kinks), or nothing is said between two thresholds (hysteresis): stays
    Stays,
    /// no condition: the operand's own value at the last event, for what holds itself
    Memory,
    /// the same of a past that operating points do not write, for they search: kept where a run begins, at its events, and at
    /// every point of a sweep
    History,
    /// a kink between what moves on and what moves with any sign (a leg of a hysteresis loop): stays as kinks do, and small
    /// signals, which go to and fro, find it off
    Leg,
    /// in which mode a law is: asks as its operands say, and is turned together with the other laws (modes.rs)
    Mode,
    /// a number that goes with a law's mode; asks nothing
    Kept,
}

impl Law {
    /// Is it decided where the laws are?
    pub fn of_modes(self) -> bool {
        matches!(self, Law::Mode | Law::Kept)
    }

    /// Is it a number that events write?
    pub fn remembers(self) -> bool {
        matches!(self, Law::Memory | Law::History)
    }

    /// Do both sides of its threshold give the same?
    pub fn is_kink(self) -> bool {
        matches!(self, Law::Stays | Law::Leg)
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Form {
    /// |effort| <= bound, effort = -bound where flow > 0
    Relay,
    /// 0 <= gap, 0 <= effort, one of them is 0; flow is the gap's rate
    Corner,
    /// 0 <= flow, 0 <= effort, one of them is 0
    OneWay,
    /// flow 0 while it is held, effort 0 while it is let go; gap: is it held at the start, stick: does a condition let it go
    Bond,
}

/// A set-valued law between an effort, which is the unknown `row`, and a flow, which is linear in the speeds. Its flags:
/// relay: does it slide, share of the bound (as a sign where it slides), mode as it is shown, with two directions 1 where it slides and
/// the share in which it did so at the last event; the others: is it closed, then
/// how often it has hit, its impulses, the energy that they took; of a bond whether it has broken.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LawSpec {
    pub form: Form,
    pub row: usize,
    pub flow: Id,
    pub bound: Id,
    pub stick: Id,
    pub gap: Id,
    pub restitution: f64,
    pub flags: Vec<usize>,
    /// of a relay where two parts touch: what presses them on each other
    pub normal: Option<Normal>,
    /// of a relay: by what its bound is multiplied in its row where it slides
    pub way: Id,
    /// of a relay with several directions: the law of the next one, in a ring. Together they are within the bound, and against all flows.
    pub across: Option<usize>,
    /// of a corner whose gap is to one of several edges
    pub feature: Option<Feature>,
}

/// The directions of a law, its own first.
pub fn around(list: &[LawSpec], k: usize) -> impl Iterator<Item = usize> + '_ {
    std::iter::successors(Some(k), move |&at| list[at].across.filter(|&next| next != k))
}

impl LawSpec {
    // flags of a relay
    pub fn slides(&self) -> usize {
        self.flags[0]
    }
    pub fn side(&self) -> usize {
        self.flags[1]
    }
    pub fn shown(&self) -> usize {
        self.flags[2]
    }
    // ... and of a corner or a one way
    pub fn closed(&self) -> usize {
        self.flags[0]
    }
    pub fn hits(&self) -> usize {
        self.flags[1]
    }
    pub fn impulse(&self) -> usize {
        self.flags[2]
    }
    pub fn lost(&self) -> usize {
        self.flags[3]
    }
}

/// Which of its edges a corner's gap is to: while it is closed the number in the flag, else 0 and the gap finds it. `which`: the
/// number at a point, 0 where none can press there.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Feature {
    pub flag: usize,
    pub which: Id,
}

/// The law whose effort bounds a relay, by mu where it slides and mus where it sticks.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Normal {
    pub law: usize,
    pub mu: f64,
    pub mus: f64,
}

/// 0/1 state held between events: becomes 1 when `up` > 0, 0 when `down` < 0. Between the two it is what it was: at the start
/// of a run from given values `initial`, at the operating point `rest`; -1 where nothing is said.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FlagSpec {
    pub up: Id,
    pub down: Id,
    pub name: String,
    pub initial: i8,
    pub rest: i8,
    pub law: Law,
}

/// Conditions that follow what Newton's method finds; the others stay as they are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Free {
    All,
    /// those whose card says nothing of a start
    Unsaid,
    /// kinks: what they choose between goes on through their threshold
    Kinks,
}

impl Free {
    pub fn has(self, f: &FlagSpec) -> bool {
        match self {
            Free::All => true,
            Free::Unsaid => f.rest < 0,
            Free::Kinks => f.is_kink(),
        }
    }
}

impl FlagSpec {
    /// Is it min, max, abs: one threshold, and the same on both sides of it? (A hysteresis says nothing between two.)
    pub fn is_kink(&self) -> bool {
        self.law.is_kink() && self.up == self.down
    }
}

/// Node voltages forced at the operating point (`.ic`) or only suggested (`.nodeset`).
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Force {
    pub row: usize,
    pub value: f64,
    pub release: bool, // nodeset: released before the final solution
}

/// What an expression was a time ago (system/delays.rs).
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Delay {
    pub of: Id,
    pub by: f64,
    pub wave: usize,
    /// the row that reads it, as unknown = expression(t - by)
    pub row: usize,
    /// before a run that starts from given values
    pub initial: f64,
}

/// A gain that only frequencies have: small signals have -H(s) in that row and column. Of (re, im) of s as (re, im).
#[derive(Clone)]
pub struct Response {
    pub row: usize,
    pub col: usize,
    pub of: Arc<dyn Fn((f64, f64)) -> (f64, f64) + Send + Sync>,
}

/// A device, a module or a digital part, as it was placed: with what it takes to place it again.
#[derive(Clone, Serialize, Deserialize)]
pub enum Placed {
    Device {
        kind: String,
        name: String,
        terminals: Vec<i32>,
        values: [BTreeMap<String, f64>; 2], // of the model, of the instance; in order, so that the same is written
        at: Climate,
        inner: Vec<usize>,
    },
    Module {
        module: String,
        name: String,
        terminals: Vec<i32>,
        folded: Box<Folded>,
        multiplied: f64,
        inner: Vec<i32>,
    },
    Part {
        kind: String,
        name: String,
        ports: Vec<Vec<(usize, bool)>>,
        values: BTreeMap<String, Vec<f64>>,
    },
}

/// Contributions, as the cards make them.
#[derive(Default, Serialize, Deserialize)]
pub struct Model {
    pub unknowns: Vec<Unknown>,
    pub waves: Vec<Wave>,
    pub delays: Vec<Delay>,
    /// the wave that is 1 where a run has not begun: what is late is there what it will be
    pub still: Option<usize>,
    #[serde(skip)]
    pub responses: Vec<Response>,
    pub g: Vec<(usize, usize, f64)>,
    pub c: Vec<(usize, usize, f64)>,
    pub f_wave: Vec<(usize, usize, f64)>,
    pub f: BTreeMap<usize, Id>,
    pub q: BTreeMap<usize, Id>,
    #[serde(skip)]
    pub classes: Vec<Box<dyn Class>>,
    #[serde(skip)]
    pub lately: compiled::Lately,
    /// operating-point values of modules that are expressions of the deck's, by instance
    #[serde(skip)]
    pub told: HashMap<String, Vec<Told>>,
    /// unknowns that are the rates of others, by these
    #[serde(skip)]
    pub rates: BTreeMap<usize, usize>,
    /// those of `classes` and of `logic`, where the model is to be written
    pub placed: Option<Vec<Placed>>,
    pub flags: Vec<FlagSpec>,
    pub laws: Vec<LawSpec>,
    pub logic: Logic,
    pub clocked: Clocked,
    pub forces: Vec<Force>,
    /// Branch currents held while a run's start is sought: of coils that would short a voltage.
    pub starting_currents: Vec<(usize, f64)>,
    /// Integrals that every operating point holds at their initial values.
    pub states: Vec<(usize, f64)>,
    pub ic_charge: Vec<(usize, f64)>,
    /// node voltages of a start with UIC, where capacitors have them
    pub given: Vec<(usize, f64)>,
    /// names of the devices that carry no current in the first solution of an operating point
    pub off: Vec<String>,
    /// waves that are slopes of others: of which, which (hidden.rs)
    #[serde(skip)]
    pub slopes: Vec<(usize, usize)>,
}

impl Model {
    /// The same once more, but for what it takes to write it.
    pub fn twin(&self) -> Model {
        Model {
            unknowns: self.unknowns.clone(),
            waves: self.waves.clone(),
            delays: self.delays.clone(),
            still: self.still,
            responses: self.responses.clone(),
            g: self.g.clone(),
            c: self.c.clone(),
            f_wave: self.f_wave.clone(),
            f: self.f.clone(),
            q: self.q.clone(),
            classes: self.classes.iter().map(|class| class.moved(&|k| k)).collect(),
            lately: Default::default(),
            told: self.told.clone(),
            rates: self.rates.clone(),
            placed: None,
            flags: self.flags.clone(),
            laws: self.laws.clone(),
            logic: self.logic.twin(),
            clocked: self.clocked.twin(),
            forces: self.forces.clone(),
            starting_currents: self.starting_currents.clone(),
            states: self.states.clone(),
            ic_charge: self.ic_charge.clone(),
            given: self.given.clone(),
            off: self.off.clone(),
            slopes: self.slopes.clone(),
        }
    }

    /// An instance of a device more, between unknowns (-1: ground), with its inner nodes and the resistances before them. `kind` is the
    /// device's name. Gives its seat's series resistances; errors are sentences for the user.
    pub fn add_device(
        &mut self,
        kind: &str,
        name: &str,
        terminals: &[i32],
        [model, instance]: [&HashMap<String, f64>; 2],
        at: Climate,
    ) -> Result<Vec<Series>, String> {
        let k = self.class_of(kind)?;
        let (unknowns, mut made) = (&mut self.unknowns, Vec::new());
        let mut inner = |node: &str| {
            let name = format!("{name}#{node}");
            unknowns.push(Unknown { name, kind: Kind::Node, unit: "V".into(), initial: 0.0 });
            made.push(unknowns.len() - 1);
            unknowns.len() - 1
        };
        self.classes[k].add(name, terminals, model, instance, at, &mut inner)?;
        if let Some(placed) = &mut self.placed {
            let (kind, name, terminals) = (kind.into(), name.into(), terminals.to_vec());
            let values = [model, instance].map(|of| of.clone().into_iter().collect());
            placed.push(Placed::Device { kind, name, terminals, values, at, inner: made });
        }
        let series = self.classes[k].seats().last().map_or(Vec::new(), |seat| seat.series.clone());
        for s in &series {
            let (i, gs) = (s.inner, s.conductance);
            self.g.push((i, i, gs));
            if let Ok(p) = usize::try_from(s.outer) {
                self.g.extend([(p, p, gs), (p, i, -gs), (i, p, -gs)]);
            }
        }
        Ok(series)
    }

    /// An instance of a module more, between unknowns (-1: ground), with its inner unknowns. Gives the unknowns of its nodes; errors
    /// are sentences for the user.
    pub fn add_compiled(
        &mut self,
        module: &str,
        name: &str,
        terminals: &[i32],
        folded: &Arc<Folded>,
        m: f64,
    ) -> Result<Vec<i32>, String> {
        let (unknowns, rates, mut made) = (&mut self.unknowns, &mut self.rates, Vec::new());
        let (g, c, states) = (&mut self.g, &mut self.c, &mut self.states);
        let add = |unknowns: &mut Vec<Unknown>, name: String, kind: Kind, unit: &str| {
            unknowns.push(Unknown { name, kind, unit: unit.into(), initial: 0.0 });
            unknowns.len() - 1
        };
        let mut unknown = |wanted: Wanted| {
            let k = match wanted {
                Wanted::Own(node, sort) => {
                    let (kind, unit) = match sort {
                        Sort::Node => (Kind::Node, "V"),
                        Sort::Current => (Kind::Branch, "A"),
                        Sort::Rate => (Kind::Derivative, ""),
                    };
                    let k = add(unknowns, format!("{name}#{node}"), kind, unit);
                    let start = folded.starts.iter().find(|s| folded.unknowns[s.0].name == node);
                    states.extend(start.map(|s| (k, s.1)));
                    k as i32
                }
                Wanted::Rate(node) => usize::try_from(node).map_or(-1, |node| {
                    *rates.entry(node).or_insert_with(|| {
                        let name = format!("{}#rate", unknowns[node].name);
                        let k = add(unknowns, name, Kind::Derivative, "");
                        g.push((k, k, 1.0));
                        c.push((k, node, -1.0));
                        k
                    }) as i32
                }),
            };
            made.push(k);
            k
        };
        let places = (&mut self.classes, &mut self.lately);
        let nodes = compiled::seat(places, module, (name, terminals), folded, m, &mut unknown)?;
        if let Some(placed) = &mut self.placed {
            let (module, name, terminals) = (module.into(), name.into(), terminals.to_vec());
            let folded = Box::new(Folded::clone(folded));
            placed.push(Placed::Module { module, name, terminals, folded, multiplied: m, inner: made });
        }
        Ok(nodes)
    }

    /// A digital part between nodes: of each port (number, inverted) of its connections. Errors are sentences for the user.
    pub fn add_part(
        &mut self,
        kind: &str,
        name: &str,
        ports: Vec<Vec<(usize, bool)>>,
        values: HashMap<String, Vec<f64>>,
    ) -> Result<(), String> {
        self.logic.add(kind, name, ports.clone(), &values)?;
        if let Some(placed) = &mut self.placed {
            let values = values.into_iter().collect();
            placed.push(Placed::Part { kind: kind.into(), name: name.into(), ports, values });
        }
        Ok(())
    }

    /// The place of a class of devices, made at its first mention.
    fn class_of(&mut self, kind: &str) -> Result<usize, String> {
        let maker = maker(kind).ok_or_else(|| format!("there is no device {kind}"))?;
        Ok(self.classes.iter().position(|c| c.kind() == kind).unwrap_or_else(|| {
            self.classes.push(maker.class());
            self.classes.len() - 1
        }))
    }

    /// Places everything again that a model which was written had; its unknowns and constants are there.
    pub fn place(&mut self) -> Result<(), String> {
        self.logic.reopen();
        for placed in self.placed.take().into_iter().flatten() {
            match placed {
                Placed::Device { kind, name, terminals, values, at, inner } => {
                    let [model, instance] = values.map(|of| of.into_iter().collect());
                    let k = self.class_of(&kind)?;
                    let mut inner = inner.into_iter();
                    let mut next = |_: &str| inner.next().unwrap_or(usize::MAX);
                    self.classes[k].add(&name, &terminals, &model, &instance, at, &mut next)?;
                }
                Placed::Module { module, name, terminals, folded, multiplied, inner } => {
                    let mut inner = inner.into_iter();
                    let mut next = |_: Wanted| inner.next().unwrap_or(-1);
                    let (places, folded) = ((&mut self.classes, &mut self.lately), Arc::new(*folded));
                    compiled::seat(places, &module, (&name, &terminals), &folded, multiplied, &mut next)?;
                }
                Placed::Part { kind, name, ports, values } => {
                    self.logic.add(&kind, &name, ports, &values.into_iter().collect())?;
                }
            }
        }
        Ok(())
    }

    /// Expressions that are linear forms of unknowns and sources become constants of G and C, if all of them are: a motor on a
    /// flywheel, masses on springs, are then solved like a linear circuit.
    pub fn fold_linear(&mut self, g: &Graph) {
        if !self.classes.is_empty() || !self.flags.is_empty() {
            return;
        }
        let forms = |rows: &BTreeMap<usize, Id>| -> Option<Vec<(usize, LinearForm)>> {
            rows.iter().map(|(&row, &e)| Some((row, linear_form(g, e, false)?))).collect()
        };
        let (Some(f), Some(q)) = (forms(&self.f), forms(&self.q)) else { return };
        if q.iter().any(|(_, [_, waves])| !waves.is_empty()) {
            return;
        }
        for (rows, out) in [(f, &mut self.g), (q, &mut self.c)] {
            for (row, [unknowns, waves]) in rows {
                out.extend(unknowns.into_iter().map(|(col, v)| (row, col, v)));
                self.f_wave.extend(waves.into_iter().map(|(k, v)| (row, k, v)));
            }
        }
        self.f.clear();
        self.q.clear();
    }
}

/// Coefficients of unknowns and of sources.
type LinearForm = [BTreeMap<usize, f64>; 2];

/// `e` as a linear form; None where it is none, or has a constant term that may not be.
pub fn linear_form(g: &Graph, e: Id, constant: bool) -> Option<LinearForm> {
    // factor of each node's value in e, passed down from e to the leaves
    let mut factors: BTreeMap<Id, f64> = BTreeMap::from([(e, 1.0)]);
    let [mut unknowns, mut waves] = LinearForm::default();
    while let Some((id, factor)) = factors.pop_last() {
        let mut pass = |to: Id, factor: f64| *factors.entry(to).or_default() += factor;
        match g.node(id) {
            Node::Unknown(i) => *unknowns.entry(i as usize).or_default() += factor,
            Node::Wave(k) => *waves.entry(k as usize).or_default() += factor,
            Node::Neg(a) => pass(a, -factor),
            Node::Add(a, b) => {
                pass(a, factor);
                pass(b, factor);
            }
            Node::Sub(a, b) => {
                pass(a, factor);
                pass(b, -factor);
            }
            Node::Mul(a, b) => match (g.value(a), g.value(b)) {
                (Some(v), _) => pass(b, v * factor),
                (_, Some(v)) => pass(a, v * factor),
                _ => return None,
            },
            Node::Div(a, b) => pass(a, factor / g.value(b)?),
            _ if g.value(id).is_some_and(|v| constant || v == 0.0) => {}
            _ => return None,
        }
    }
    let finite = unknowns.values().chain(waves.values()).all(|v: &f64| v.is_finite());
    finite.then_some([unknowns, waves])
}
