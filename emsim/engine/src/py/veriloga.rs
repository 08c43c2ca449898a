//! Verilog-A for Python: what a text declares, what is wrong with it, and the numbers of an instance at given voltages.
use super::{expr::lock, guarded};
use crate::derive::slopes as slopes_of;
use crate::graph::{Graph, Id, Node};
use crate::tape::{Inputs, Tape};
use crate::veriloga::folded::{Kind, Port, GMIN, SOURCE_SCALE};
use crate::veriloga::{Folded, Given, Library, Message, Value};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A text that was read, or what is wrong with it.
#[pyclass(frozen)]
pub struct VerilogA {
    library: Library,
    messages: Vec<Message>,
    /// What modules came to lately, the last one first: instances that are alike are folded once.
    lately: Mutex<Vec<Come>>,
}

struct Come {
    module: String,
    given: Given,
    to: Arc<Folded>,
}

/// Reads a text: `name` is what messages call it, `folders` are looked in for what it includes.
#[pyfunction]
#[pyo3(signature = (text, name="", folders=Vec::new(), defines=HashMap::new()))]
pub fn veriloga(text: &str, name: &str, folders: Vec<PathBuf>, defines: HashMap<String, String>) -> PyResult<VerilogA> {
    let mut defines: Vec<(String, String)> = defines.into_iter().collect();
    defines.sort();
    Ok(match guarded(|| Library::parse(text, name, &folders, &defines))? {
        Ok(library) => VerilogA { library, messages: Vec::new(), lately: Mutex::default() },
        Err(messages) => VerilogA { library: Library::default(), messages, lately: Mutex::default() },
    })
}

fn told<'py>(py: Python<'py>, messages: &[Message]) -> PyResult<Bound<'py, PyList>> {
    let out = PyList::empty(py);
    for m in messages {
        let d = PyDict::new(py);
        put!(d, m; text file line column length source hint through);
        out.append(d)?;
    }
    Ok(out)
}

fn values(of: HashMap<String, Bound<'_, PyAny>>) -> PyResult<HashMap<String, Value>> {
    let one = |v: &Bound<'_, PyAny>| {
        if let Ok(text) = v.extract::<String>() {
            Ok(Value::Text(text))
        } else if let Ok(number) = v.extract::<f64>() {
            Ok(Value::Number(number))
        } else {
            v.extract::<Vec<f64>>().map(Value::Numbers)
        }
    };
    of.into_iter().map(|(k, v)| Ok((k, one(&v)?))).collect()
}

/// Parameters of a .model, read once for all of its instances.
#[pyclass(frozen)]
pub struct Values {
    pub(super) read: Arc<HashMap<String, Value>>,
    /// As they were given.
    #[pyo3(get)]
    given: Py<PyDict>,
}

#[pymethods]
impl Values {
    #[new]
    fn new(given: Bound<'_, PyDict>) -> PyResult<Values> {
        Ok(Values { read: Arc::new(values(given.extract()?)?), given: given.unbind() })
    }
}

/// What an instance is given; temperatures [temp, tnom] in Celsius.
pub fn given(
    model: Arc<HashMap<String, Value>>,
    instance: HashMap<String, Bound<'_, PyAny>>,
    [temp, tnom]: [f64; 2],
    multiplier: f64,
    connected: usize,
) -> PyResult<Given> {
    let (temperature, tnom) = (temp + 273.15, tnom + 273.15);
    Ok(Given { model, instance: values(instance)?, temperature, tnom, multiplier, connected })
}

/// The same for instances that are alike.
pub fn remembered(this: &VerilogA, py: Python<'_>, module: &str, given: Given) -> PyResult<Arc<Folded>> {
    {
        let mut lately = lock(&this.lately);
        if let Some(k) = lately.iter().position(|c| c.module == module && c.given == given) {
            lately[..=k].rotate_right(1);
            return Ok(lately[0].to.clone());
        }
    }
    let to = Arc::new(folded(this, py, module, &given)?);
    let mut lately = lock(&this.lately);
    lately.insert(0, Come { module: module.to_string(), given, to: to.clone() });
    // so many are remembered: cells of a chip have transistors of some ten sizes, and a large model comes to some 200
    // kB
    lately.truncate(64);
    Ok(to)
}

fn folded(this: &VerilogA, py: Python<'_>, module: &str, given: &Given) -> PyResult<Folded> {
    let Some(module) = this.library.module(module) else {
        return Err(PyKeyError::new_err(format!("there is no module {module}")));
    };
    guarded(|| module.fold(given))?.map_err(|m| match told(py, &m) {
        Ok(list) => PyValueError::new_err(list.unbind()),
        Err(e) => e,
    })
}

super::request::request! {
    /// A point at which an instance is evaluated; temperatures in Celsius.
    EvaluateRequest {
        temp: f64 = 27.0,
        /// of unknowns by name, 0 where none is given, as limiting left them
        voltages: HashMap<String, f64> = Default::default(),
        gmin: f64 = Default::default(),
        tnom: f64 = 27.0,
        instance: HashMap<String, Bound<'py, PyAny>> = Default::default(),
        connected: Option<usize> = None,
        multiplier: f64 = 1.0,
        time: f64 = Default::default(),
        symbols: HashMap<u32, f64> = Default::default(),
        /// of i and q of every flow, one row of ports each
        slopes: bool = Default::default(),
    }
}

#[pymethods]
impl VerilogA {
    /// What is wrong with the text: dicts of text, file, line, column, length, source, hint, through (the macros: name, file, line,
    /// column).
    #[getter]
    fn messages<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        told(py, &self.messages)
    }

    #[getter]
    fn modules(&self) -> Vec<String> {
        self.library.modules().map(|m| m.name().to_string()).collect()
    }

    #[getter]
    fn files(&self) -> Vec<String> {
        self.library.files()
    }

    /// module, meaning, terminals, parameters (names, unit, meaning, default, instance, integer, text).
    fn describe<'py>(&self, py: Python<'py>, module: &str) -> PyResult<Bound<'py, PyDict>> {
        let Some(module) = self.library.module(module) else {
            return Err(PyKeyError::new_err(format!("there is no module {module}")));
        };
        let about = module.describe();
        let d = PyDict::new(py);
        put!(d, about; module meaning terminals disciplines);
        let list = PyList::empty(py);
        for p in about.parameters {
            let one = PyDict::new(py);
            put!(one, p; names unit meaning default instance integer text);
            list.append(one)?;
        }
        d.set_item("parameters", list)?;
        Ok(d)
    }

    /// The numbers of an instance at a point, as an `EvaluateRequest` says. ValueError with messages where the module refuses.
    #[pyo3(signature = (module, parameters=HashMap::new(), **request))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        module: &str,
        parameters: HashMap<String, Bound<'py, PyAny>>,
        request: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let r = EvaluateRequest::read("evaluate", request)?;
        let connected = r.connected.unwrap_or(usize::MAX);
        let given = given(Arc::new(values(parameters)?), r.instance, [r.temp, r.tnom], r.multiplier, connected)?;
        let mut f = folded(self, py, module, &given)?;
        for unknown in r.voltages.keys() {
            if !f.unknowns.iter().any(|u| u.name == *unknown) {
                return Err(PyKeyError::new_err(format!("there is no unknown {unknown}")));
            }
        }
        let at = |k: usize| f.unknowns.get(k).and_then(|u| r.voltages.get(&u.name)).copied().unwrap_or(0.0);
        let x: Vec<f64> = f.ports.iter().map(|p| at(p.from) - at(p.to)).collect();
        let d = PyDict::new(py);
        tell_shape(&f, &d)?;
        // one program for all numbers, symbols as they are given
        let mut outs: Vec<Id> = f.flows.iter().flat_map(|w| [w.i, w.q]).collect();
        d.set_item("operations", f.graph.count(&outs))?;
        outs.extend(f.noise.iter().flat_map(|n| [n.power, n.exponent.unwrap_or(n.power)]));
        outs.extend(f.outputs.iter().map(|o| o.value));
        outs.extend(f.bound_step);
        if r.slopes {
            let leaves: Vec<Id> = (0..f.ports.len() as u32).map(|k| f.graph.unknown(k)).collect();
            let flown: Vec<Id> = outs[..2 * f.flows.len()].to_vec();
            let rows = slopes_of(&mut f.graph, &flown, &leaves);
            let count = f.graph.count(&flown.iter().chain(rows.iter().flatten()).copied().collect::<Vec<_>>());
            d.set_item("operations_with_slopes", count)?;
            outs.extend(rows.into_iter().flatten());
        }
        let outs = numbered(&mut f.graph, &outs, r.gmin, &r.symbols);
        let inputs = Inputs { x: &x, t: r.time, waves: &[], flags: &[] };
        let values = guarded(|| Tape::new(&f.graph, &outs).eval(&inputs))?;
        tell_values(&f, &values, r.slopes, &d)?;
        Ok(d)
    }
}

/// Expressions with numbers for all that stands for a quantity of the run. There are no events at a point.
fn numbered(g: &mut Graph, outs: &[Id], gmin: f64, symbols: &HashMap<u32, f64>) -> Vec<Id> {
    let mut values: Vec<(Id, Id)> = Vec::new();
    for id in g.reachable(outs) {
        let value = match g.node(id) {
            Node::Symbol(GMIN) => gmin,
            Node::Symbol(SOURCE_SCALE) => 1.0,
            Node::Symbol(k) => symbols.get(&k).copied().unwrap_or(0.0),
            Node::Flag(_) | Node::Wave(_) => 0.0,
            _ => continue,
        };
        values.push((id, g.constant(value)));
    }
    crate::derive::substitute(g, outs, &values)
}

fn name(f: &Folded, k: usize) -> String {
    f.unknowns.get(k).map_or("0", |u| &u.name).to_string()
}

/// Unknowns, what is one, ports, and what a module said.
fn tell_shape(f: &Folded, d: &Bound<'_, PyDict>) -> PyResult<()> {
    let kinds = f.unknowns.iter().map(|u| {
        let kind = match u.kind {
            Kind::Voltage => "voltage",
            Kind::Current => "current",
            Kind::Other(other) => other,
        };
        (u.name.clone(), kind)
    });
    d.set_item("unknowns", kinds.collect::<Vec<_>>())?;
    d.set_item("terminals", f.terminals)?;
    d.set_item("merged", f.merged.iter().map(|&(a, b)| (name(f, a), name(f, b))).collect::<Vec<_>>())?;
    let limit = |p: &Port| p.limit.as_ref().map(|l| (l.function.clone(), l.arguments.clone()));
    d.set_item("ports", f.ports.iter().map(|p| (name(f, p.from), name(f, p.to), limit(p))).collect::<Vec<_>>())?;
    d.set_item("starts", f.starts.iter().map(|s| (&f.unknowns[s.0].name, s.1)).collect::<Vec<_>>())?;
    d.set_item("said", &f.said)
}

/// Flows, noise, operating-point values, the bound of the step and slopes, in this order.
fn tell_values(f: &Folded, values: &[f64], slopes: bool, d: &Bound<'_, PyDict>) -> PyResult<()> {
    let mut next = values.iter().copied();
    let mut take = || next.next().unwrap_or(f64::NAN);
    let flows: Vec<_> = f.flows.iter().map(|w| (name(f, w.from), name(f, w.to), take(), take())).collect();
    d.set_item("flows", flows)?;
    let noise = f.noise.iter().map(|n| {
        let (power, exponent) = (take(), take());
        (name(f, n.from), name(f, n.to), n.name.clone(), power, n.exponent.map(|_| exponent))
    });
    d.set_item("noise", noise.collect::<Vec<_>>())?;
    let outputs = PyDict::new(d.py());
    for o in &f.outputs {
        outputs.set_item(&o.name, take())?;
    }
    d.set_item("outputs", outputs)?;
    d.set_item("bound_step", f.bound_step.map(|_| take()))?;
    if slopes {
        let rows: Vec<Vec<f64>> =
            f.flows.iter().flat_map(|_| [(); 2]).map(|_| f.ports.iter().map(|_| take()).collect()).collect();
        d.set_item("slopes", rows)?;
    }
    Ok(())
}
