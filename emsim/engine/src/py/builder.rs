//! `Builder`: collects the contributions of one deck and compiles them.
use super::expr::{lock, Expr, SharedGraph};
use super::request::request;
use super::system::{Origin, System};
use super::veriloga::{self, VerilogA};
use super::Given;
use super::{foreign, guarded};
use crate::alike;
use crate::assembly;
use crate::clocked::{Clock, Signal, Timer};
use crate::derive;
use crate::devices::compiled::Compiled;
use crate::devices::foreign::Exchanged;
use crate::devices::Climate;
use crate::foreign::exchange::{Exchange, Seat};
use crate::graph::{Fun, Graph, Id, Node};
use crate::logic;
use crate::model::{Delay, Feature, Form, Law, LawSpec, Normal, Response};
use crate::packed::Equations;
use crate::system::{FlagSpec, Force, Kind, Model, Unknown};
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;
use pyo3::exceptions::{PyIndexError, PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};

#[pyclass]
pub struct Builder {
    graph: SharedGraph,
    model: Option<Model>,
    /// what symbols have been substituted by: flags made from expressions that held them follow
    symbols: Mutex<Vec<(Id, Id)>>,
}

impl Builder {
    fn expr(&self, id: Id) -> Expr {
        Expr { graph: self.graph.clone(), id }
    }

    fn add(&mut self, row: i64, e: &Given<'_>, to: fn(&mut Model) -> &mut BTreeMap<usize, Id>) -> PyResult<()> {
        let (id, graph) = (Expr::operand(&self.graph, e)?, self.graph.clone());
        let Some(row) = self.row(row)? else { return Ok(()) };
        to(self.model()?).entry(row).and_modify(|sum| *sum = lock(&graph).add(*sum, id)).or_insert(id);
        Ok(())
    }

    fn made(&self, make: impl FnOnce(&mut Graph) -> Id) -> Expr {
        let id = make(&mut lock(&self.graph));
        self.expr(id)
    }

    fn flagged(&mut self, flag: FlagSpec) -> PyResult<Expr> {
        let flags = &mut self.model()?.flags;
        flags.push(flag);
        let k = flags.len() as u32 - 1;
        Ok(self.made(|g| g.flag(k)))
    }

    fn model(&mut self) -> PyResult<&mut Model> {
        self.model.as_mut().ok_or_else(|| PyValueError::new_err("this builder has been compiled already"))
    }

    fn row(&mut self, row: i64) -> PyResult<Option<usize>> {
        let n = self.model()?.unknowns.len() as i64;
        match row {
            -1 => Ok(None),
            r if r >= 0 && r < n => Ok(Some(r as usize)),
            r => Err(PyIndexError::new_err(format!("row {r} does not exist"))),
        }
    }

    fn ids(&self, xs: &[Given<'_>]) -> PyResult<Vec<Id>> {
        xs.iter().map(|x| Expr::operand(&self.graph, x)).collect()
    }

    fn flag_number(&self, flag: Id) -> PyResult<usize> {
        match lock(&self.graph).node(flag) {
            Node::Flag(k) => Ok(k as usize),
            _ => Err(PyValueError::new_err("no flag")),
        }
    }
}

/// Are these made of flags and constants alone?
fn logic_alone(g: &Graph, ids: &[Id]) -> bool {
    let plain = |&id: &Id| !g.node(id).is_leaf() || matches!(g.node(id), Node::Const(_) | Node::Flag(_));
    g.reachable(ids).iter().all(plain)
}

fn two_terminal(stamps: &mut Vec<(usize, usize, f64)>, (p, n): (Option<usize>, Option<usize>), v: f64) {
    for (a, b) in [(p, n), (n, p)] {
        if let Some(a) = a {
            stamps.push((a, a, v));
            if let Some(b) = b {
                stamps.push((a, b, -v));
            }
        }
    }
}

/// Of a source of noise: its name, frequencies with densities, and whether logarithms are interpolated.
type NoiseTables = Vec<(String, Vec<(f64, f64)>, bool)>;

request! {
    /// A law, beside its form and row.
    LawRequest {
        flow: Bound<'py, PyAny>,
        bound: Bound<'py, PyAny>,
        stick: Bound<'py, PyAny>,
        gap: Bound<'py, PyAny>,
        restitution: f64,
        flags: Vec<Bound<'py, PyAny>>,
        normal: Option<(usize, f64, f64)> = None,
        way: Option<Bound<'py, PyAny>> = None,
        across: Option<usize> = None,
        feature: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)> = None,
    }
}

#[pymethods]
impl Builder {
    #[new]
    fn new() -> Self {
        Builder {
            graph: Arc::new(Mutex::new(crate::graph::Graph::new())),
            model: Some(Model::default()),
            symbols: Mutex::new(Vec::new()),
        }
    }

    #[pyo3(signature = (name, kind, unit, initial=0.0))]
    fn unknown(&mut self, name: String, kind: &str, unit: String, initial: f64) -> PyResult<usize> {
        let kind = Kind::from_name(kind).ok_or_else(|| PyValueError::new_err(format!("no such kind: {kind}")))?;
        let m = self.model()?;
        m.unknowns.push(Unknown { name, kind, unit, initial });
        Ok(m.unknowns.len() - 1)
    }

    fn set_initial(&mut self, i: usize, value: f64) -> PyResult<()> {
        let m = self.model()?;
        let u = m.unknowns.get_mut(i).ok_or_else(|| PyIndexError::new_err("no such unknown"))?;
        u.initial = value;
        Ok(())
    }

    fn x(&self, i: usize) -> Expr {
        self.made(|g| g.unknown(i as u32))
    }

    fn time(&self) -> Expr {
        self.made(|g| g.time())
    }

    #[pyo3(name = "const")]
    fn constant(&self, v: f64) -> Expr {
        self.made(|g| g.constant(v))
    }

    fn symbol(&self) -> Expr {
        self.made(|g| g.symbol())
    }

    /// Is y made of flags and constants alone?
    fn is_logic(&self, y: &Given<'_>) -> PyResult<bool> {
        let y = Expr::operand(&self.graph, y)?;
        Ok(logic_alone(&lock(&self.graph), &[y]))
    }

    #[pyo3(signature = (function, *args))]
    fn call(&self, function: &str, args: Vec<Given<'_>>) -> PyResult<Expr> {
        let a = self.ids(&args)?;
        let mut g = lock(&self.graph);
        let id = match (function, a.as_slice()) {
            ("pow", &[x, y]) => g.pow(x, y),
            ("atan2", &[y, x]) => g.atan2(y, x),
            ("notless", &[x, y]) => g.not_less(x, y),
            ("hypot", &[x, y]) => {
                let xx = g.mul(x, x);
                let yy = g.mul(y, y);
                let s = g.add(xx, yy);
                g.call(Fun::Sqrt, s)
            }
            ("log10", &[x]) => {
                let l = g.call(Fun::Log, x);
                let c = g.constant(std::f64::consts::LOG10_E);
                g.mul(c, l)
            }
            (name, &[x]) => match Fun::from_name(name) {
                Some(f) => g.call(f, x),
                None => return Err(PyValueError::new_err(format!("no function `{name}` of one argument"))),
            },
            (name, _) => return Err(PyValueError::new_err(format!("no function `{name}` of {} arguments", a.len()))),
        };
        drop(g);
        Ok(self.expr(id))
    }

    fn select(&self, cond: &Given<'_>, a: &Given<'_>, b: &Given<'_>) -> PyResult<Expr> {
        let ids = self.ids(&[cond.clone(), a.clone(), b.clone()])?;
        Ok(self.made(|g| g.select(ids[0], ids[1], ids[2])))
    }

    /// 0/1, held between events: 1 when `up` > 0, 0 when `down` < 0; in between `initial` at the start of a run from given
    /// values, `rest` at the operating point (-1: as it comes).
    #[pyo3(signature = (up, down=None, name=String::new(), initial=-1, rest=-1, law=""))]
    fn flag(
        &mut self,
        up: &Given<'_>,
        down: Option<&Given<'_>>,
        name: String,
        initial: i8,
        rest: i8,
        law: &str,
    ) -> PyResult<Expr> {
        let law = match law {
            "" if down.is_none() => Law::Condition,
            "stays" | "" => Law::Stays,
            "arrival" => Law::Arrival,
            "memory" => Law::Memory,
            "leg" => Law::Leg,
            "mode" => Law::Mode,
            "kept" => Law::Kept,
            _ => return Err(PyValueError::new_err(format!("no law `{law}` of a flag"))),
        };
        let up = Expr::operand(&self.graph, up)?;
        let down = down.map_or(Ok(up), |d| Expr::operand(&self.graph, d))?;
        if up == down {
            let known = lock(&self.graph).value(up); // the guard must be gone before the next lock
            if let (Some(v), false) = (known, law.of_modes()) {
                return Ok(self.made(|g| g.constant(if v > 0.0 { 1.0 } else { 0.0 })));
            }
            // one comparison asked twice is one flag
            if let Some(k) =
                self.model()?.flags.iter().position(|f| f.up == up && f.down == down && f.name == name && f.law == law)
            {
                return Ok(self.made(|g| g.flag(k as u32)));
            }
        }
        self.flagged(FlagSpec { up, down, name, initial, rest, law })
    }

    /// What `keep` gives it, as it was just before the last event; 0 before the first. It may read itself. `past`: points of a
    /// sweep write it too, and no search for an operating point does.
    #[pyo3(signature = (name, past=false))]
    fn memory(&mut self, name: String, past: bool) -> PyResult<Expr> {
        let law = if past { Law::History } else { Law::Memory };
        let nothing = lock(&self.graph).constant(0.0);
        self.flagged(FlagSpec { up: nothing, down: nothing, name, initial: -1, rest: -1, law })
    }

    fn keep(&mut self, memory: &Expr, value: &Given<'_>) -> PyResult<()> {
        let value = Expr::operand(&self.graph, value)?;
        let node = lock(&self.graph).node(memory.id);
        match node {
            Node::Flag(k) if self.model()?.flags[k as usize].law.remembers() => {
                let flag = &mut self.model()?.flags[k as usize];
                (flag.up, flag.down) = (value, value);
                Ok(())
            }
            _ => Err(PyValueError::new_err("no memory")),
        }
    }

    /// A set-valued law between the unknown `row` and a flow: see `LawSpec` and `LawRequest`.
    #[pyo3(signature = (form, row, **request))]
    fn law(&mut self, form: &str, row: usize, request: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let r = LawRequest::read("law", request)?;
        let form = match form {
            "relay" => Form::Relay,
            "corner" => Form::Corner,
            "one way" => Form::OneWay,
            "bond" => Form::Bond,
            _ => return Err(PyValueError::new_err(format!("no form `{form}` of a law"))),
        };
        let ids = self.ids(&[r.flow, r.bound, r.stick, r.gap])?;
        let [flow, bound, stick, gap] = [ids[0], ids[1], ids[2], ids[3]];
        let flags = self.ids(&r.flags)?;
        let way = match r.way {
            Some(way) => self.ids(&[way])?[0],
            None => flags[1.min(flags.len() - 1)],
        };
        let flags = flags.into_iter().map(|flag| self.flag_number(flag)).collect::<PyResult<Vec<_>>>()?;
        let feature = match r.feature {
            None => None,
            Some((flag, which)) => {
                let ids = self.ids(&[flag, which])?;
                Some(Feature { flag: self.flag_number(ids[0])?, which: ids[1] })
            }
        };
        self.row(row as i64)?;
        let laws = &mut self.model()?.laws;
        let of_row = |row: usize, missing: &'static str| {
            laws.iter().position(|law| law.row == row).ok_or_else(|| PyValueError::new_err(missing))
        };
        let bounded =
            r.normal.map(|(of, mu, mus)| Ok::<_, PyErr>(Normal { law: of_row(of, "no law bounds it")?, mu, mus }));
        let normal = bounded.transpose()?;
        let across = r.across.map(|row| of_row(row, "no law across it")).transpose()?;
        let (restitution, count) = (r.restitution, laws.len());
        // into the ring of its directions
        let across = across.map(|other| laws[other].across.replace(count).unwrap_or(other));
        laws.push(LawSpec { form, row, flow, bound, stick, gap, restitution, flags, normal, way, across, feature });
        Ok(())
    }

    fn grad(&self, y: &Given<'_>, xs: Vec<Given<'_>>) -> PyResult<Vec<Expr>> {
        let y = Expr::operand(&self.graph, y)?;
        let xs = self.ids(&xs)?;
        let ds = guarded(|| derive::gradient(&mut lock(&self.graph), y, &xs))?;
        Ok(ds.into_iter().map(|d| self.expr(d)).collect())
    }

    /// d ys / ds along the direction given by (leaf, tangent) pairs: forward mode.
    fn tangent(&self, ys: Vec<Given<'_>>, seed: Vec<(Given<'_>, Given<'_>)>) -> PyResult<Vec<Expr>> {
        let ys = self.ids(&ys)?;
        let map = self.pairs(seed)?;
        let ds = guarded(|| derive::tangent(&mut lock(&self.graph), &ys, &map))?;
        Ok(ds.into_iter().map(|d| self.expr(d)).collect())
    }

    fn substitute(&self, ys: Vec<Given<'_>>, map: Vec<(Given<'_>, Given<'_>)>) -> PyResult<Vec<Expr>> {
        let ys = self.ids(&ys)?;
        let map = self.pairs(map)?;
        let mut g = lock(&self.graph);
        let out = guarded(|| derive::substitute(&mut g, &ys, &map))?;
        if let Ok(mut known) = self.symbols.lock() {
            known.extend(map.iter().filter(|(from, _)| matches!(g.node(*from), Node::Symbol(_))));
        }
        drop(g);
        Ok(out.into_iter().map(|d| self.expr(d)).collect())
    }

    /// Each group of expressions as calls of one program where others have its form, but for their leaves (alike.rs); else None.
    fn outlined(&self, groups: Vec<Vec<Given<'_>>>) -> PyResult<Vec<Option<Vec<Expr>>>> {
        let groups = groups.iter().map(|group| self.ids(group)).collect::<PyResult<Vec<_>>>()?;
        let made = guarded(|| alike::outlined(&mut lock(&self.graph), &groups))?;
        Ok(made.into_iter().map(|group| Some(group?.into_iter().map(|e| self.expr(e)).collect())).collect())
    }

    fn depends(&self, y: &Given<'_>, xs: Vec<Given<'_>>) -> PyResult<Vec<bool>> {
        let y = Expr::operand(&self.graph, y)?;
        let xs = self.ids(&xs)?;
        Ok(derive::depends(&lock(&self.graph), y, &xs))
    }

    fn count(&self, ys: Vec<Given<'_>>) -> PyResult<usize> {
        let ys = self.ids(&ys)?;
        Ok(lock(&self.graph).count(&ys))
    }

    /// Values of `ys` at unknowns x (missing ones read 0), time t, waves at t, flags by their roots.
    #[pyo3(signature = (ys, x, t=0.0))]
    fn eval(&mut self, ys: Vec<Given<'_>>, mut x: Vec<f64>, t: f64) -> PyResult<Vec<f64>> {
        let ys = self.ids(&ys)?;
        let graph = self.graph.clone();
        let m = self.model()?;
        x.resize(x.len().max(m.unknowns.len()), 0.0);
        let waves: Vec<f64> = m.waves.iter().map(|w| w.value(t)).collect();
        let g = lock(&graph);
        let mut flags: Vec<f64> = m.flags.iter().map(|f| f64::from(f.initial.max(0))).collect();
        // a flag may hang on another flag: a few rounds settle them in order
        let roots: Vec<Id> = m.flags.iter().map(|f| f.up).collect();
        let tape = Tape::new(&g, &roots);
        for _ in 0..roots.len().min(8) {
            let r = tape.eval(&Inputs { x: &x, t, waves: &waves, flags: &flags });
            flags = r.iter().map(|&v| if v > 0.0 { 1.0 } else { 0.0 }).collect();
        }
        Ok(Tape::new(&g, &ys).eval(&Inputs { x: &x, t, waves: &waves, flags: &flags }))
    }

    #[pyo3(signature = (kind, args, dc=None))]
    fn wave(&mut self, kind: &str, args: Vec<f64>, dc: Option<f64>) -> PyResult<usize> {
        let wave = Wave::new(kind, &args, dc).map_err(PyValueError::new_err)?;
        let m = self.model()?;
        m.waves.push(wave);
        Ok(m.waves.len() - 1)
    }

    /// A source whose value comes from outside, for `System.pack`; what it is where nothing is said.
    fn input(&mut self, start: f64) -> PyResult<usize> {
        let m = self.model()?;
        m.waves.push(Wave::input(start));
        Ok(m.waves.len() - 1)
    }

    /// What is placed from now on is noted, so that the compiled system can be packed. Before the first element.
    fn note_places(&mut self) -> PyResult<()> {
        self.model()?.placed = Some(Vec::new());
        Ok(())
    }

    /// Makes the row of an unknown read an expression a time ago, as a source; gives its number.
    fn delay(&mut self, row: usize, of: &Given<'_>, by: f64, initial: f64) -> PyResult<usize> {
        let of = Expr::operand(&self.graph, of)?;
        if !(by > 0.0 && by.is_finite()) {
            return Err(PyValueError::new_err("a delay is positive"));
        }
        let m = self.model()?;
        m.waves.push(Wave::exchanged());
        m.delays.push(Delay { of, by, wave: m.waves.len() - 1, row, initial });
        Ok(m.waves.len() - 1)
    }

    /// A gain H(s) from one unknown in the row of another, where equations are linearised: `of` takes and gives (re, im).
    fn response(&mut self, row: usize, col: usize, of: Py<PyAny>) -> PyResult<()> {
        let of = Arc::new(move |s: (f64, f64)| {
            Python::attach(|py| of.call1(py, s).and_then(|found| found.extract(py)).unwrap_or((f64::NAN, f64::NAN)))
        });
        self.model()?.responses.push(Response { row, col, of });
        Ok(())
    }

    /// The wave that is 1 until a run begins, 0 from then on.
    fn still(&mut self) -> PyResult<usize> {
        Ok(self.model()?.standstill())
    }

    /// A digital node; gives its number and the wave that shows its level.
    fn digital_node(&mut self, name: String) -> PyResult<(usize, usize)> {
        let m = self.model()?;
        m.waves.push(Wave::exchanged());
        let wave = m.waves.len() - 1;
        Ok((m.logic.node(name, wave), wave))
    }

    /// What is made of flags decides that node: is it above what is low, is it below what is high?
    fn digital_senses(&mut self, node: usize, above: &Given<'_>, below: &Given<'_>) -> PyResult<()> {
        let ids = [Expr::operand(&self.graph, above)?, Expr::operand(&self.graph, below)?];
        if !logic_alone(&lock(&self.graph), &ids) {
            return Err(PyValueError::new_err("flags alone decide a digital node"));
        }
        let m = self.model()?;
        let node = m.logic.nodes.get_mut(node).ok_or_else(|| PyIndexError::new_err("no such digital node"))?;
        node.senses = Some(ids);
        Ok(())
    }

    /// A wave that follows a digital node in straight lines: values at 0, 1 and undefined, times of a rise and a fall.
    fn digital_ramp(&mut self, node: (usize, bool), values: (f64, f64, f64), times: (f64, f64)) -> PyResult<usize> {
        let m = self.model()?;
        m.waves.push(Wave::exchanged());
        let ((node, inverted), (low, high, undefined), (rise, fall)) = (node, values, times);
        let wave = m.waves.len() - 1;
        m.logic.ramps.push(logic::Ramp { node, inverted, wave, low, high, undefined, rise, fall });
        Ok(wave)
    }

    /// A digital part between nodes: of each port (number, inverted) of its connections. ValueError: what is wrong, as a sentence.
    fn digital_part(
        &mut self,
        kind: &str,
        name: &str,
        ports: Vec<Vec<(usize, bool)>>,
        values: HashMap<String, Vec<f64>>,
    ) -> PyResult<()> {
        self.model()?.add_part(kind, name, ports, values).map_err(PyValueError::new_err)
    }

    /// A clock; gives its number.
    fn clock(&mut self, period: f64, offset: f64, delay: f64) -> PyResult<usize> {
        let clocks = &mut self.model()?.clocked.clocks;
        clocks.push(Clock { period, offset, delay });
        Ok(clocks.len() - 1)
    }

    /// A signal of a clock; gives its number and two waves: what rules read, and what all others do.
    fn clocked_signal(&mut self, name: String, clock: usize, initial: f64) -> PyResult<(usize, usize, usize)> {
        let m = self.model()?;
        let late = m.clocked.clocks.get(clock).is_some_and(|c| c.delay > 0.0);
        m.waves.resize_with(m.waves.len() + 1 + usize::from(late), Wave::exchanged);
        let last = m.waves.len() - 1;
        let waves = [last - usize::from(late), last];
        m.clocked.signals.push(Signal { name, clock, initial, waves });
        Ok((m.clocked.signals.len() - 1, waves[0], waves[1]))
    }

    /// What signals of a clock become at its ticks, behind the rules that were given before.
    fn clocked_rule(&mut self, clock: usize, signals: Vec<usize>, values: Vec<Given<'_>>) -> PyResult<()> {
        let values = self.ids(&values)?;
        self.model()?.clocked.rule(clock, signals, values);
        Ok(())
    }

    /// An FMU for co-simulation (py/foreign.rs): what it makes of values at the ticks of a clock of its own.
    fn clocked_unit(
        &mut self,
        clock: usize,
        spec: &Bound<'_, PyDict>,
        values: Vec<Given<'_>>,
        signals: Vec<usize>,
    ) -> PyResult<()> {
        let (spec, values) = (foreign::spec(spec)?, self.ids(&values)?);
        self.model()?.clocked.unit(clock, spec, values, signals);
        Ok(())
    }

    /// An FMU for model exchange between unknowns: its states, its inputs, the time, its outputs, its indicators; flags that are the signs of
    /// the latter.
    fn exchange(&mut self, spec: &Bound<'_, PyDict>, places: [Vec<usize>; 5], flags: Vec<Given<'_>>) -> PyResult<()> {
        let flags = self.ids(&flags)?.into_iter().map(|id| self.flag_number(id)).collect::<PyResult<Vec<_>>>()?;
        let of = Arc::new(Exchange::new(foreign::spec(spec)?));
        let [states, inputs, time, outputs, indicators] = places;
        let ports = [states.clone(), inputs.clone(), time].concat();
        let rows = [states.clone(), outputs, indicators].concat();
        let m = self.model()?;
        m.classes.push(Box::new(Exchanged::new(of.clone(), &ports, &rows)));
        m.clocked.exchanges.push(Seat { of, states, inputs, flags });
        Ok(())
    }

    /// States with which an FMU for model exchange begins: an instance is made, and goes. ValueError: why there is none.
    #[staticmethod]
    fn exchange_starts(spec: &Bound<'_, PyDict>) -> PyResult<Vec<f64>> {
        Exchange::new(foreign::spec(spec)?).first_states().map_err(PyValueError::new_err)
    }

    /// A timer between two signals; gives the waves of its level and of the complement.
    fn clocked_timer(&mut self, clock: usize, on: usize, off: usize, dead: f64) -> PyResult<(usize, usize)> {
        let m = self.model()?;
        m.waves.resize_with(m.waves.len() + 2, Wave::exchanged);
        let waves = [m.waves.len() - 2, m.waves.len() - 1];
        m.clocked.timers.push(Timer { clock, on, off, dead, waves });
        Ok((waves[0], waves[1]))
    }

    fn wave_expr(&self, k: u32) -> Expr {
        self.made(|g| g.wave(k))
    }

    fn g(&mut self, row: i64, col: i64, v: f64) -> PyResult<()> {
        if let (Some(r), Some(c)) = (self.row(row)?, self.row(col)?) {
            self.model()?.g.push((r, c, v));
        }
        Ok(())
    }

    fn c(&mut self, row: i64, col: i64, v: f64) -> PyResult<()> {
        if let (Some(r), Some(c)) = (self.row(row)?, self.row(col)?) {
            self.model()?.c.push((r, c, v));
        }
        Ok(())
    }

    /// The four stamps of a conductance between two nodes.
    fn conductance(&mut self, p: i64, n: i64, v: f64) -> PyResult<()> {
        let rows = (self.row(p)?, self.row(n)?);
        two_terminal(&mut self.model()?.g, rows, v);
        Ok(())
    }

    /// The four stamps of a capacitance between two nodes.
    fn capacitance(&mut self, p: i64, n: i64, v: f64) -> PyResult<()> {
        let rows = (self.row(p)?, self.row(n)?);
        two_terminal(&mut self.model()?.c, rows, v);
        Ok(())
    }

    fn f_wave(&mut self, row: i64, wave: usize, coefficient: f64) -> PyResult<()> {
        if let Some(r) = self.row(row)? {
            let m = self.model()?;
            if wave >= m.waves.len() {
                return Err(PyIndexError::new_err("no such wave"));
            }
            m.f_wave.push((r, wave, coefficient));
        }
        Ok(())
    }

    fn add_f(&mut self, row: i64, e: &Given<'_>) -> PyResult<()> {
        self.add(row, e, |m| &mut m.f)
    }

    fn add_q(&mut self, row: i64, e: &Given<'_>) -> PyResult<()> {
        self.add(row, e, |m| &mut m.q)
    }

    /// An instance of the device `kind` between `nodes`, with its inner nodes; what it makes of parameters is its own business.
    /// Returns its series resistances: (number of the terminal, inner node, conductance [S]).
    #[pyo3(signature = (kind, name, nodes, model, instance, temp_c=27.0, tnom_c=27.0))]
    fn device(
        &mut self,
        kind: &str,
        name: &str,
        nodes: Vec<i64>,
        model: HashMap<String, f64>,
        instance: HashMap<String, f64>,
        temp_c: f64,
        tnom_c: f64,
    ) -> PyResult<Vec<(usize, usize, f64)>> {
        let rows = nodes.into_iter().map(|k| Ok(self.row(k)?.map_or(-1, |k| k as i32)));
        let nodes = rows.collect::<PyResult<Vec<i32>>>()?;
        let climate = Climate { temp: temp_c, tnom: tnom_c };
        let series = self.model()?.add_device(kind, name, &nodes, [&model, &instance], climate);
        let series = series.map_err(PyValueError::new_err)?;
        Ok(series.iter().map(|s| (s.terminal, s.inner, s.conductance)).collect())
    }

    /// An instance of a Verilog-A module between `nodes`, -1 being ground, with its inner unknowns; `connected`: so many terminals stand in
    /// the deck. Returns what the module said, what of it is not carried out, the longest step that it allows [s], and where it hangs on
    /// time, analyses or events (wave, (re, im)) of ac_stim and the unknowns that are late; tables of its noise, by the source's name.
    #[pyo3(signature = (modules, module, name, nodes, model, instance, temp_c=27.0, tnom_c=27.0, m=1.0, connected=usize::MAX,
        gmin=1e-12))]
    fn module(
        &mut self,
        py: Python<'_>,
        modules: &VerilogA,
        module: &str,
        name: &str,
        nodes: Vec<i64>,
        model: &veriloga::Values,
        instance: HashMap<String, Given<'_>>,
        temp_c: f64,
        tnom_c: f64,
        m: f64,
        connected: usize,
        gmin: f64,
    ) -> PyResult<(Vec<String>, Vec<String>, Option<f64>, Option<(Vec<(usize, (f64, f64))>, Vec<usize>)>, NoiseTables)>
    {
        let rows = nodes.into_iter().map(|k| Ok(self.row(k)?.map_or(-1, |k| k as i32)));
        let nodes = rows.collect::<PyResult<Vec<i32>>>()?;
        let given = veriloga::given(model.read.clone(), instance, [temp_c, tnom_c], m, connected)?;
        let folded = veriloga::remembered(modules, py, module, given)?;
        let graph = self.graph.clone();
        let mut g = lock(&graph);
        let behaves = self.model()?.add_module(&mut g, module, (name, &nodes), &folded, m, gmin);
        let behaves = behaves.map_err(PyValueError::new_err)?;
        let longest = folded.bound_step.and_then(|id| folded.graph.value(id));
        let mut left_out = folded.left_out.clone();
        if folded.bound_step.is_some() && longest.is_none() {
            left_out.push("a $bound_step that voltages decide: steps are not bound by it".into());
        }
        let longest = longest.filter(|h| *h > 0.0 && h.is_finite());
        let tables = folded.noise_tables.iter().map(|t| (t.name.clone(), t.points.clone(), t.logarithmic)).collect();
        Ok((folded.said.clone(), left_out, longest, behaves.any.then_some((behaves.stimuli, behaves.late)), tables))
    }

    /// The instance of that name carries no current in the first solution of an operating point.
    fn off(&mut self, name: &str) -> PyResult<()> {
        self.model()?.off.push(name.to_string());
        Ok(())
    }

    /// Names, units and meanings of the operating-point values of a module's instance.
    fn module_outputs(&mut self, name: &str) -> PyResult<Vec<(String, String, String)>> {
        let told = self.model()?.told.get(name).cloned().unwrap_or_default();
        let (class, _) = self.compiled(name)?;
        let own = class.program().outputs.iter().cloned().map(|[name, unit, meaning]| (name, unit, meaning));
        Ok(own.chain(told.into_iter().map(|t| (t.name, t.unit, t.meaning))).collect())
    }

    /// An operating-point value of a module's instance as an expression.
    #[pyo3(signature = (name, output, gmin=0.0))]
    fn module_output(&mut self, name: &str, output: &str, gmin: f64) -> PyResult<Option<Expr>> {
        let graph = self.graph.clone();
        let told = self.model()?.told.get(name).into_iter().flatten();
        if let Some(value) = told.filter(|t| t.name.eq_ignore_ascii_case(output)).map(|t| t.value).next() {
            return Ok(Some(self.expr(value)));
        }
        let (class, k) = self.compiled(name)?;
        let id = class.output_symbol(k, output, &mut lock(&graph), gmin);
        Ok(id.map(|id| self.expr(id)))
    }

    /// Of an instance: the nodes that each current goes from and to (-1: ground), and whether charge goes with it.
    fn device_branches(&mut self, name: &str) -> PyResult<Vec<(i32, i32, bool)>> {
        for class in &self.model()?.classes {
            if let Some(k) = class.seats().iter().rposition(|seat| seat.name == name) {
                let (nodes, shape) = (&class.seats()[k].nodes, class.shape(k));
                let branch = |(j, &(p, n)): (usize, &(usize, usize))| (nodes[p], nodes[n], shape.stores(j));
                return Ok(shape.branches.iter().enumerate().map(branch).collect());
            }
        }
        Err(PyKeyError::new_err(name.to_string()))
    }

    /// Forces a node voltage at the operating point: kind "ic" (until t = 0) or "nodeset" (a first guess).
    fn force(&mut self, row: i64, value: f64, kind: &str) -> PyResult<()> {
        if let Some(row) = self.row(row)? {
            self.model()?.forces.push(Force { row, value, release: kind == "nodeset" });
        }
        Ok(())
    }

    /// Holds a branch current while the start of a run is sought, in place of the branch's own equation.
    fn start_current(&mut self, row: i64, value: f64) -> PyResult<()> {
        if let Some(row) = self.row(row)? {
            self.model()?.starting_currents.push((row, value));
        }
        Ok(())
    }

    /// What a waveform is at a time.
    #[staticmethod]
    fn wave_at(kind: &str, args: Vec<f64>, t: f64) -> PyResult<f64> {
        Ok(Wave::new(kind, &args, None).map_err(PyValueError::new_err)?.value_before(t))
    }

    /// With UIC: charge (or flux linkage) added to row `row` of Q at t = 0.
    /// A node's voltage at a start with UIC, where capacitors say it.
    fn given(&mut self, row: i64, volts: f64) -> PyResult<()> {
        if let Some(row) = self.row(row)? {
            self.model()?.given.push((row, volts));
        }
        Ok(())
    }

    fn ic_charge(&mut self, row: i64, dq: f64) -> PyResult<()> {
        if let Some(row) = self.row(row)? {
            self.model()?.ic_charge.push((row, dq));
        }
        Ok(())
    }

    /// Indices of a maximal set of independent rows of the matrix `rows` (row-major, list of rows), earlier ones first.
    #[pyo3(signature = (rows, tol=1e-9))]
    fn rank(&self, rows: Vec<Vec<f64>>, tol: f64) -> PyResult<(usize, Vec<usize>)> {
        let cols = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|r| r.len() != cols) {
            return Err(PyValueError::new_err("rows of unequal length"));
        }
        let flat: Vec<f64> = rows.concat();
        guarded(|| assembly::rank(&flat, rows.len(), cols, tol))
    }

    /// Mass-weighted projection of the coordinates `q` (indices of unknowns) onto h = 0, the held ones fixed.
    /// `mass` is the n x n mass matrix as expressions, evaluated at x. Returns (ok, q values, residual of each h).
    #[pyo3(signature = (q, h, mass, x, held, t=0.0, tol=1e-12))]
    fn project(
        &mut self,
        q: Vec<usize>,
        h: Vec<Given<'_>>,
        mass: Vec<Given<'_>>,
        mut x: Vec<f64>,
        held: Vec<bool>,
        t: f64,
        tol: f64,
    ) -> PyResult<(bool, Vec<f64>, Vec<f64>)> {
        let h = self.ids(&h)?;
        let mass_ids = self.ids(&mass)?;
        let graph = self.graph.clone();
        let m = self.model()?;
        x.resize(x.len().max(m.unknowns.len()), 0.0);
        if held.len() != q.len() || mass_ids.len() != q.len() * q.len() || q.iter().any(|&i| i >= x.len()) {
            return Err(PyValueError::new_err("project: lengths do not fit"));
        }
        let waves: Vec<f64> = m.waves.iter().map(|w| w.value(t)).collect();
        let flags = vec![0.0; m.flags.len()];
        let mut g = lock(&graph);
        let leaves: Vec<Id> = q.iter().map(|&i| g.unknown(i as u32)).collect();
        let mut outs = h.clone();
        for &row in &h {
            outs.extend(derive::gradient(&mut g, row, &leaves));
        }
        let tape = Tape::new(&g, &outs);
        let weights = Tape::new(&g, &mass_ids).eval(&Inputs { x: &x, t, waves: &waves, flags: &flags });
        drop(g);
        let x0: Vec<f64> = q.iter().map(|&i| x[i]).collect();
        let mut work = tape.workspace();
        let nh = h.len();
        let mut constraint = |at: &[f64], value: &mut [f64], jac: &mut [f64]| {
            for (&i, &v) in q.iter().zip(at) {
                x[i] = v;
            }
            tape.run(&Inputs { x: &x, t, waves: &waves, flags: &flags }, &mut work);
            for (k, v) in value.iter_mut().enumerate() {
                *v = tape.output(&work, k);
            }
            for (k, v) in jac.iter_mut().enumerate() {
                *v = tape.output(&work, nh + k);
            }
        };
        match guarded(|| assembly::project(nh, &mut constraint, &weights, &x0, &held, tol, 200))? {
            Ok(at) => Ok((true, at, vec![0.0; nh])),
            Err(e) => Ok((false, e.x, e.residual)),
        }
    }

    /// Minimal mass-weighted change of u such that H u = rhs (H as list of rows, mass row-major n*n).
    fn project_velocity(
        &self,
        h: Vec<Vec<f64>>,
        mass: Vec<f64>,
        u0: Vec<f64>,
        held: Vec<bool>,
        rhs: Vec<f64>,
    ) -> PyResult<Vec<f64>> {
        let n = u0.len();
        if mass.len() != n * n || held.len() != n || rhs.len() != h.len() || h.iter().any(|r| r.len() != n) {
            return Err(PyValueError::new_err("project_velocity: lengths do not fit"));
        }
        guarded(|| assembly::project_velocity(&h.concat(), &mass, &u0, &held, &rhs))
    }

    /// `kept`: for `System.again`.
    #[pyo3(signature = (kept=false))]
    fn compile(&mut self, kept: bool) -> PyResult<System> {
        let mut model = self.model.take().ok_or_else(|| PyValueError::new_err("compiled already"))?;
        if let Ok(known) = self.symbols.lock() {
            let mut g = lock(&self.graph);
            // a symbol may stand for an expression of other symbols
            for _ in 0..if known.is_empty() { 0 } else { 4 } {
                let asked: Vec<Id> = model.flags.iter().flat_map(|flag| [flag.up, flag.down]).collect();
                let made = derive::substitute(&mut g, &asked, &known);
                for (flag, out) in model.flags.iter_mut().zip(made.chunks_exact(2)) {
                    (flag.up, flag.down) = (out[0], out[1]);
                }
                for rule in &mut model.clocked.rules {
                    rule.values = derive::substitute(&mut g, &rule.values, &known);
                }
            }
        }
        let mut g = lock(&self.graph);
        let written = model.placed.is_some().then(|| Equations::write(&g, &model)).transpose();
        let equations = written.map_err(PyValueError::new_err)?.map(|bytes| (g.len(), bytes));
        let origin = kept.then(|| Arc::new(Origin { graph: g.copy(&self.graph), model: model.twin() }));
        let system = guarded(|| crate::system::System::compile(model, &mut g))?.map_err(PyValueError::new_err)?;
        drop(g);
        Ok(System::new(system, self.graph.clone(), equations, origin))
    }

    /// How many constants of F, of Q, of sources, and charges of a start with UIC there are so far.
    fn constants(&mut self) -> PyResult<[usize; 4]> {
        let m = self.model()?;
        Ok([m.g.len(), m.c.len(), m.f_wave.len(), m.ic_charge.len()])
    }
}

impl Builder {
    /// The class of a module's instance, and its number there.
    fn compiled(&mut self, name: &str) -> PyResult<(&Compiled, usize)> {
        let classes = self.model()?.classes.iter_mut().filter_map(|c| c.compiled());
        let mut found = classes.filter_map(|c| Some((c.number(name)?, c)));
        let (k, class) = found.next().ok_or_else(|| PyKeyError::new_err(name.to_string()))?;
        Ok((class, k))
    }

    fn pairs(&self, map: Vec<(Given<'_>, Given<'_>)>) -> PyResult<Vec<(Id, Id)>> {
        map.iter().map(|(a, b)| Ok((Expr::operand(&self.graph, a)?, Expr::operand(&self.graph, b)?))).collect()
    }
}
