//! `System`: the compiled equations, open to anyone; and the analyses. `Waveforms`: what an analysis recorded.
use super::expr::{lock, Expr, SharedGraph};
use super::guarded;
use super::request::request;
use super::smallsignal::SmallSignal;
use super::table::bytes;
use super::Given;
use crate::graph::{Graph, Id, Node};
use crate::integrate::{self, Failed};
use crate::interrupt;
use crate::model::Model;
use crate::modes::Modes;
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::op;
use crate::packed::{Accounts, Equations, Input, Output, Packed, State, Varies};
use crate::raw;
use crate::record::Record;
use crate::system::{Counters, Work};
use crate::tangent::{Beside, Refused};
use crate::tape::Tape;
use crate::tolerances::{Absolute, Quantity, QUANTITIES};
use crate::waves::Wave;
use pyo3::exceptions::{PyIndexError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, OnceLock};

mod tran;

/// The flag of this name is 0, and 1 for small signals: what is another thing to them reads it.
const SMALL_SIGNALS: &str = "small signals";

#[pyclass(frozen)]
pub struct System {
    inner: Arc<crate::system::System>,
    integrated: OnceLock<Result<Arc<crate::system::System>, String>>,
    graph: SharedGraph,
    /// nodes of the graph that were there, and the equations before they were compiled, where they are to be packed
    equations: Option<(usize, Vec<u8>)>,
    origin: Option<Arc<Origin>>,
}

/// What a system was compiled from, for others that differ in numbers alone.
pub struct Origin {
    pub graph: Graph,
    pub model: Model,
}

impl System {
    pub fn new(
        system: crate::system::System,
        graph: SharedGraph,
        equations: Option<(usize, Vec<u8>)>,
        origin: Option<Arc<Origin>>,
    ) -> System {
        System { inner: Arc::new(system), integrated: OnceLock::new(), graph, equations, origin }
    }

    fn ids(&self, outputs: &[Given<'_>]) -> PyResult<Vec<Id>> {
        outputs.iter().map(|o| Expr::operand(&self.graph, o)).collect()
    }

    /// What a run integrates by this method: equations of a lower index, where these hide constraints. Sensitivities are of these, and so
    /// is what the method shares out.
    fn integrable(&self, o: &Options, beside: bool) -> PyResult<Arc<crate::system::System>> {
        if beside || !integrate::lowers(&o.method) {
            return Ok(self.inner.clone());
        }
        let made = self.integrated.get_or_init(|| self.inner.integrable(&mut lock(&self.graph)));
        made.clone().map_err(PyValueError::new_err)
    }

    /// The equations of these unknowns, which nothing ties to the others.
    fn part(&self, of: Vec<usize>, o: &Options) -> PyResult<integrate::Part> {
        let missing = || PyValueError::new_err("tran: the builder was not asked to keep its equations");
        let (_, bytes) = self.equations.as_ref().ok_or_else(missing)?;
        let compiled = Equations::read(bytes).and_then(|Equations { mut graph, mut model }| {
            let flags = model.only(&mut graph, &of);
            model.place()?;
            let system = Arc::new(crate::system::System::compile(model, &mut graph)?);
            let system = system.integrable(&mut graph)?;
            if integrate::reduces(&system, o) {
                system.reduce(&mut graph);
            }
            Ok(integrate::Part { system, graph, of, flags })
        });
        compiled.map_err(PyValueError::new_err)
    }

    /// Scratch with the flags as they are at (x, t).
    fn work_at(&self, x: &[f64], t: f64) -> PyResult<Work> {
        if x.len() != self.inner.n {
            return Err(PyValueError::new_err(format!("x has {} values, the system {}", x.len(), self.inner.n)));
        }
        let mut w = self.inner.work();
        for _ in 0..8 {
            if !self.inner.update_flags(&mut w, x, t) {
                break;
            }
        }
        self.inner.show_modes(&mut w, x, t);
        Ok(w)
    }
}

fn options(given: Option<&Bound<'_, PyDict>>) -> PyResult<Options> {
    let mut o = Options::default();
    let Some(given) = given else { return Ok(o) };
    for (key, value) in given.iter() {
        let key: String = key.extract()?;
        match key.as_str() {
            "reltol" => o.reltol = value.extract()?,
            "trtol" => o.trtol = value.extract()?,
            "gmin" => o.gmin = value.extract()?,
            "itl1" => o.itl1 = value.extract::<f64>()? as usize,
            "itl4" => o.itl4 = value.extract::<f64>()?.max(10.0) as usize,
            "maxord" => o.maxord = Some(value.extract::<f64>()? as usize),
            "fixed_step" => o.fixed_step = value.extract()?,
            "spoiled" => o.spoiled = Some(value.extract()?),
            "unwatched" => o.unwatched = value.extract()?,
            "stuck_flag" => o.stuck_flag = Some(value.extract()?),
            "maxsteps" => o.maxsteps = value.extract()?,
            "projection" => o.projection = value.extract::<f64>()? != 0.0,
            "method" => {
                let name: String = value.extract()?;
                if !integrate::known(&name) {
                    return Err(PyValueError::new_err(format!("no such method: {name}")));
                }
                o.method = name;
            }
            name if Absolute::knows(name) => o.absolute.set(name, value.extract()?),
            _ => {}
        }
    }
    for (name, v) in [("reltol", o.reltol), ("gmin", o.gmin)] {
        if !(v.is_finite() && v >= 0.0) || (name == "reltol" && v <= 0.0) {
            return Err(PyValueError::new_err(format!("{name} must be a positive number")));
        }
    }
    o.reltol = o.reltol.clamp(1e-13, 0.5);
    Ok(o)
}

/// Places of constants and what stands there.
type Numbers = Vec<(usize, f64)>;

impl System {
    pub(super) fn equations(&self) -> Arc<crate::system::System> {
        self.inner.clone()
    }

    pub(super) fn shared(&self) -> SharedGraph {
        self.graph.clone()
    }
}

#[pymethods]
impl System {
    /// What the deck's FMUs have said since this was asked: card and message.
    fn said(&self) -> Vec<(String, String)> {
        let of = |spec: &Arc<crate::foreign::Spec>| {
            let told = spec.told.lock().map(|mut told| std::mem::take(&mut *told)).unwrap_or_default();
            told.into_iter().map(|text| (spec.card.clone(), text)).collect::<Vec<_>>()
        };
        let exchanges = self.inner.clocked.exchanges.iter().map(|seat| &seat.of.spec);
        self.inner.clocked.units.iter().chain(exchanges).flat_map(of).collect()
    }

    /// Of FMUs for model exchange that could not be evaluated when this was asked last: card and why.
    fn unevaluated(&self) -> Vec<(String, String)> {
        let seats = self.inner.clocked.exchanges.iter();
        seats.filter_map(|seat| Some((seat.of.spec.card.clone(), seat.of.trouble()?))).collect()
    }

    /// The system that the same builder would have made with other numbers: constants of F, of Q, of sources, and charges of a
    /// start with UIC, by place, and waves. It takes the expressions of this one. The builder was told that what it made is kept.
    fn again(
        &self,
        py: Python<'_>,
        numbers: [Numbers; 4],
        waves: Vec<(usize, String, Vec<f64>, Option<f64>)>,
    ) -> PyResult<System> {
        let missing =
            || PyValueError::new_err("again: the builder was not asked to keep what it made, or has no such number");
        let origin = self.origin.clone().ok_or_else(missing)?;
        let mut model = origin.model.twin();
        let [g, c, sources, charges] = numbers;
        for (k, v) in charges {
            model.ic_charge.get_mut(k).ok_or_else(missing)?.1 = v;
        }
        for (entries, numbers) in [(&mut model.g, g), (&mut model.c, c), (&mut model.f_wave, sources)] {
            for (k, v) in numbers {
                entries.get_mut(k).ok_or_else(missing)?.2 = v;
            }
        }
        for (k, kind, args, dc) in waves {
            *model.waves.get_mut(k).ok_or_else(missing)? =
                Wave::new(&kind, &args, dc).map_err(PyValueError::new_err)?;
        }
        let made = py.detach(|| {
            guarded(|| {
                let mut graph = origin.graph.clone();
                let system = crate::system::System::compile(model, &mut graph)?;
                Ok((system, Arc::new(Mutex::new(graph))))
            })
        });
        let (system, graph) = made?.map_err(|why: String| PyValueError::new_err(why))?;
        Ok(System::new(system, graph, None, self.origin.clone()))
    }

    #[getter]
    fn n(&self) -> usize {
        self.inner.n
    }
    #[getter]
    fn names(&self) -> Vec<String> {
        self.inner.unknowns.iter().map(|u| u.name.clone()).collect()
    }
    #[getter]
    fn kinds(&self) -> Vec<&'static str> {
        self.inner.unknowns.iter().map(|u| u.kind.name()).collect()
    }
    #[getter]
    fn units(&self) -> Vec<String> {
        self.inner.unknowns.iter().map(|u| u.unit.clone()).collect()
    }
    #[getter]
    fn device_names(&self) -> Vec<String> {
        self.inner.device_names()
    }

    /// Of every flag its name, what raises it above zero, what lowers it below.
    #[getter]
    fn flags(&self) -> Vec<(String, Expr, Expr)> {
        let expr = |id| Expr { graph: self.graph.clone(), id };
        self.inner.flags.iter().map(|f| (f.name.clone(), expr(f.up), expr(f.down))).collect()
    }

    #[getter]
    fn flag_names(&self) -> Vec<String> {
        self.inner.flags.iter().map(|f| f.name.clone()).collect()
    }
    /// Rows that stand under d/dt.
    #[getter]
    fn differential_rows(&self) -> Vec<bool> {
        self.inner.has_q.clone()
    }
    #[getter]
    fn differential_unknowns(&self) -> Vec<bool> {
        self.inner.differential.clone()
    }
    #[getter]
    fn linear(&self) -> bool {
        self.inner.linear
    }
    /// (operations of Q and F, operations of these and their derivatives), devices not counted
    #[getter]
    fn operations(&self) -> (usize, usize) {
        self.inner.operations()
    }
    /// Unknowns of circuits that nothing ties to each other, by the pace of their sources, where a run of that length gains from giving
    /// each pace steps of its own; else none.
    fn paces(&self, tstop: f64) -> Vec<Vec<usize>> {
        self.inner.paces(&lock(&self.graph), tstop).unwrap_or_default()
    }
    /// Do circuit and machine want a pace each, `method=multirate`, in a run of that length?
    fn two_paces(&self, tstop: f64) -> bool {
        integrate::pays(&self.inner, tstop)
    }
    /// Of each expression: does it read an unknown of higher index?
    fn lags(&self, outputs: Vec<Given<'_>>) -> PyResult<Vec<bool>> {
        let (ids, graph) = (self.ids(&outputs)?, lock(&self.graph));
        let late = integrate::undetermined(&self.inner);
        let is_late = |&id: &Id| matches!(graph.node(id), Node::Unknown(i) if late[i as usize]);
        Ok(ids.iter().map(|&id| graph.reachable(&[id]).iter().any(is_late)).collect())
    }
    fn initial(&self) -> Vec<f64> {
        op::initial(&self.inner)
    }

    fn q(&self, x: Vec<f64>, t: f64) -> PyResult<Vec<f64>> {
        let mut w = self.work_at(&x, t)?;
        self.inner.eval(&mut w, &x, t);
        Ok(w.q)
    }

    fn f(&self, x: Vec<f64>, t: f64) -> PyResult<Vec<f64>> {
        let mut w = self.work_at(&x, t)?;
        self.inner.eval(&mut w, &x, t);
        Ok(w.f)
    }

    /// Compressed sparse columns: (indptr, indices), common to C and G.
    fn pattern(&self) -> (Vec<usize>, Vec<usize>) {
        (self.inner.pattern.colptr.clone(), self.inner.pattern.rowidx.clone())
    }

    /// Values of C = dQ/dx and G = dF/dx on the pattern.
    fn jac(&self, x: Vec<f64>, t: f64) -> PyResult<(Vec<f64>, Vec<f64>)> {
        let mut w = self.work_at(&x, t)?;
        self.inner.eval_jacobian(&mut w, &x, t, false);
        Ok((w.cv, w.gv))
    }

    /// Absolute tolerances under these options, of the kinds of quantity that the unknowns have or that are given:
    /// (name, unit, option, value, given).
    #[pyo3(signature = (options_=None))]
    fn quantities(&self, options_: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(&str, &str, &str, f64, bool)>> {
        let o = options(options_)?;
        let has = |q| self.inner.unknowns.iter().any(|u| Quantity::of(u) == Some(q));
        let row = |&(q, name, unit, option): &(Quantity, &'static str, &'static str, &'static str)| {
            let given = o.absolute.given[q as usize].is_finite();
            (has(q) || given).then(|| (name, unit, option, o.absolute.of(q, o.reltol), given))
        };
        Ok(QUANTITIES.iter().filter_map(row).collect())
    }
    /// Absolute tolerance of each unknown under these options.
    #[pyo3(signature = (options_=None))]
    fn tolerances(&self, options_: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<f64>> {
        Ok(Tolerances::new(&self.inner, &options(options_)?).atol)
    }

    /// The consistent starting point of a transient analysis: (ok, x, failure).
    #[pyo3(signature = (options_=None, uic=false, tstep=1e-6))]
    fn start(
        &self,
        py: Python<'_>,
        options_: Option<&Bound<'_, PyDict>>,
        uic: bool,
        tstep: f64,
    ) -> PyResult<(bool, Vec<f64>, Option<Py<PyDict>>)> {
        let o = options(options_)?;
        let sys = &self.inner;
        let tol = Tolerances::new(sys, &o);
        let mut w = sys.work();
        let mut x = op::initial(sys);
        let failed = |why, tried| Failed { t: 0.0, h: 0.0, during: "operating point", why, tried };
        let result = guarded(|| match uic {
            true => op::initial_conditions(sys, &mut w, &mut x, tstep, &tol).map_err(|why| failed(why, vec![])),
            false => op::operating_point(sys, &mut w, &o, &tol, false, &mut x).map_err(|e| failed(e.why, e.tried)),
        })?;
        match result {
            Ok(()) => {
                let feature = sys.shortest_feature().min(tstep);
                if let Ok(mut newton) = Newton::new(sys) {
                    op::consistent(sys, &mut newton, &mut w, &mut x, None, (0.0, 1e-5 * feature), &tol, true);
                }
                Ok((true, x, None))
            }
            Err(f) => Ok((false, x, Some(failure_dict(py, &self.inner, &f)?))),
        }
    }

    /// Values of expressions at (x, t), conditions as they are there.
    fn values(&self, outputs: Vec<Given<'_>>, x: Vec<f64>, t: f64) -> PyResult<Vec<f64>> {
        if x.len() != self.inner.n {
            return Err(PyValueError::new_err(format!(
                "x has {} values, there are {} unknowns",
                x.len(),
                self.inner.n
            )));
        }
        let ids = self.ids(&outputs)?;
        let mut record = Record::new(&lock(&self.graph), &ids);
        let mut w = self.inner.work();
        self.inner.update_flags(&mut w, &x, t);
        record.push(&self.inner, &mut w, t, &x);
        Ok(record.data[1..].to_vec())
    }

    /// DC operating point: one row. `statics`: the machine comes to rest too.
    #[pyo3(signature = (outputs, options_=None, statics=false))]
    fn op(
        &self,
        py: Python<'_>,
        outputs: Vec<Given<'_>>,
        options_: Option<&Bound<'_, PyDict>>,
        statics: bool,
    ) -> PyResult<Waveforms> {
        let ids = self.ids(&outputs)?;
        let o = options(options_)?;
        let sys = self.inner.clone();
        let mut record = Record::new(&lock(&self.graph), &ids);
        let (w, failed, record, seconds) = py.detach(move || {
            let clock = Clock::start();
            let tol = Tolerances::new(&sys, &o);
            let mut w = sys.work();
            w.dc = true;
            let mut x = op::initial(&sys);
            let found = guarded(|| {
                op::operating_point(&sys, &mut w, &o, &tol, statics, &mut x).map_err(no_point)?;
                w.doubts.unstable = op::unstable(&sys, &mut w, &x, 0.0, &o, &tol);
                complete(&sys, &mut w, &mut x, &tol, statics);
                record.push(&sys, &mut w, 0.0, &x);
                Ok(())
            })?;
            PyResult::Ok((w, found.err(), record, clock.seconds()))
        })?;
        super::ends()?;
        let failure = failed.map(|f| failure_dict(py, &self.inner, &f)).transpose()?;
        let status = if failure.is_some() { "failed" } else { "ok" };
        Ok(Waveforms::new(record, &w, seconds, status, failure))
    }

    /// Operating points along a sweep, one row each, whose first column is the number of the point. `points`: values of the
    /// sources `waves`. `near`: unknowns and conditions to begin from, those of `state` of a sweep before.
    #[pyo3(signature = (outputs, options_=None, statics=false, waves=vec![], points=vec![], near=None))]
    fn dc(
        &self,
        py: Python<'_>,
        outputs: Vec<Given<'_>>,
        options_: Option<&Bound<'_, PyDict>>,
        statics: bool,
        waves: Vec<usize>,
        points: Vec<Vec<f64>>,
        near: Option<(Vec<f64>, Vec<f64>)>,
    ) -> PyResult<Waveforms> {
        if waves.iter().any(|&k| k >= self.inner.waves.len()) || points.iter().any(|p| p.len() != waves.len()) {
            return Err(PyValueError::new_err("dc: a value for each of the sources at every point"));
        }
        let ids = self.ids(&outputs)?;
        let o = options(options_)?;
        let sys = self.inner.clone();
        let mut record = Record::new(&lock(&self.graph), &ids);
        let (w, failed, stopped, record, state, hung, seconds) = py.detach(move || {
            let clock = Clock::start();
            let tol = Tolerances::new(&sys, &o);
            let mut w = sys.work();
            let mut x = op::initial(&sys);
            let mut sweep = op::sweep::Sweep::new(&sys, &o, &tol, statics, &waves);
            if let (Some((near, flags)), Some(first)) = (near, points.first()) {
                if near.len() == x.len() && flags.len() == w.flags.len() {
                    (x, w.flags) = (near, flags);
                    sweep.begin_near(first);
                }
            }
            let (mut failed, mut stopped, mut hung) = (None, false, None);
            for (k, values) in points.iter().enumerate() {
                match interrupt::guarded(|| sweep.to(&mut w, &mut x, values)) {
                    Ok(Ok(())) => {}
                    Ok(Err(e)) => {
                        failed = Some(no_point(e));
                        break;
                    }
                    Err(_) => {
                        stopped = true;
                        break;
                    }
                }
                hung = hung.or_else(|| hanging(k, &w));
                let mut shown = x.clone();
                let held = sys.has_laws().then(|| w.held());
                complete(&sys, &mut w, &mut shown, &tol, statics);
                let row = record.data.len();
                record.push(&sys, &mut w, 0.0, &shown);
                record.data[row] = k as f64;
                held.iter().for_each(|held| w.restore(held));
            }
            let state = (x, w.flags.clone());
            (w, failed, stopped, record, state, hung, clock.seconds())
        });
        super::ends()?;
        let failure = failed.map(|f| failure_dict(py, &self.inner, &f)).transpose()?;
        let status = ["ok", "interrupted", "failed"][if failure.is_some() { 2 } else { usize::from(stopped) }];
        let found = Waveforms::new(record, &w, seconds, status, failure);
        Ok(Waveforms { hanging: hung, substitute: None, unstable: None, state: Some(state), ..found })
    }

    /// (node, root) of nodes whose rows are part of the root's.
    #[getter]
    fn sums(&self) -> Vec<(usize, usize)> {
        self.inner.sums.iter().map(|s| (s.node, s.root)).collect()
    }

    /// Which analysis asks from now on, in Verilog-A's words: dc, tran, ac, noise.
    fn begin(&self, analysis: &str) -> PyResult<()> {
        let known = crate::veriloga::folded::symbol_of(analysis);
        let symbol = known.ok_or_else(|| PyValueError::new_err(format!("no analysis {analysis}")))?;
        self.inner.analysis.store(symbol, Relaxed);
        Ok(())
    }

    /// The equations linearised about the operating point: (found, what was linearised, failure). `hold`: of what stands still
    /// there, .tf and .sens: the machine does not move, and nothing is another one to small signals.
    /// `given`: values of sources, by their waves, in place of their own.
    #[pyo3(signature = (options_=None, statics=false, hold=false, given=vec![]))]
    fn small_signal(
        &self,
        py: Python<'_>,
        options_: Option<&Bound<'_, PyDict>>,
        statics: bool,
        hold: bool,
        given: Vec<(usize, f64)>,
    ) -> PyResult<(Option<SmallSignal>, Option<Py<PyDict>>)> {
        let o = options(options_)?;
        let (sys, graph) = (self.inner.clone(), self.graph.clone());
        let found = py.detach(move || {
            let tol = Tolerances::new(&sys, &o);
            let mut w = sys.work();
            (w.dc, w.given) = (true, given);
            let mut x = op::initial(&sys);
            let found = guarded(|| {
                op::operating_point(&sys, &mut w, &o, &tol, statics, &mut x).map_err(no_point)?;
                w.doubts.unstable = op::unstable(&sys, &mut w, &x, 0.0, &o, &tol);
                complete(&sys, &mut w, &mut x, &tol, statics);
                Ok(())
            })?;
            if let Err(failed) = found {
                return Ok(Err(failed));
            }
            for (held, _) in w.flags.iter_mut().zip(&sys.flags).filter(|(_, f)| f.name == SMALL_SIGNALS && !hold) {
                *held = 1.0;
            }
            let linear = guarded(|| SmallSignal::new(sys, graph, w, x, hold))?;
            PyResult::Ok(linear.map_err(|e| Failed {
                t: 0.0,
                h: 0.0,
                during: "small signals",
                why: Failure::Singular(e),
                tried: vec![],
            }))
        })?;
        match found {
            Ok(linear) => Ok((Some(linear), None)),
            Err(f) => Ok((None, Some(failure_dict(py, &self.inner, &f)?))),
        }
    }

    /// The system as bytes, for an engine without Python, as a `PackRequest` says. Of what `Builder.note_places` has noted.
    #[pyo3(signature = (**request))]
    fn pack<'py>(
        &self,
        py: Python<'py>,
        request: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Bound<'py, PyBytes>, Vec<(String, Option<String>)>, Option<Exchanged>, Option<String>)> {
        let r = PackRequest::read("pack", request)?;
        let missing = || PyValueError::new_err("pack: the builder was not asked to keep its equations");
        let (known, equations) = self.equations.as_ref().ok_or_else(missing)?;
        let noted = |expr: &Given<'_>| {
            let id = Expr::operand(&self.graph, expr)?;
            let there = (id as usize) < *known;
            there.then_some(id).ok_or_else(|| PyValueError::new_err("pack: an output made too late"))
        };
        let output = |(expr, name): (Given<'_>, String)| Ok(Output { id: noted(&expr)?, name });
        let guard = |(expr, sign): (Given<'_>, i8)| Ok((noted(&expr)?, sign));
        let input = |(wave, name, start, word): (usize, String, f64, String)| {
            let varies =
                Varies::of(&word).ok_or_else(|| PyValueError::new_err(format!("pack: nothing varies `{word}`")))?;
            Ok(Input { wave, name, start, varies })
        };
        let all = |exprs: Vec<Given<'_>>| exprs.iter().map(&noted).collect::<PyResult<Vec<_>>>();
        let account = |(powers, energies, impulsive)| {
            Ok::<_, PyErr>(Accounts { powers: all(powers)?, energies: all(energies)?, impulsive })
        };
        let mut packed = Packed {
            version: env!("CARGO_PKG_VERSION").into(),
            token: r.token,
            equations: equations.clone(),
            inputs: r.inputs.into_iter().map(input).collect::<PyResult<Vec<_>>>()?,
            outputs: r.outputs.into_iter().map(output).collect::<PyResult<Vec<_>>>()?,
            guards: r.guards.into_iter().map(guard).collect::<PyResult<Vec<_>>>()?,
            options: options(r.options_.as_ref())?,
            tstep: r.times.0,
            tstop: r.times.1,
            tmax: r.times.2,
            tstart: r.times.3,
            uic: r.uic,
            codes: r.codes,
            conditions: r.conditions,
            warnings: r.warnings,
            accounts: r.accounts.map(account).transpose()?,
            exchange: None,
        };
        // what cannot be read again is no file
        packed.compile().map_err(PyValueError::new_err)?;
        let impeding = packed.impeding().map_err(PyValueError::new_err)?;
        let (exchange, refused) = match r.exchange.then(|| packed.exchanged()) {
            Some(Ok(found)) => (Some(found), None),
            Some(Err(why)) => (None, Some(why)),
            None => (None, None),
        };
        packed.exchange.clone_from(&exchange);
        let shown = exchange.map(|e| {
            let state = |s: State| (s.of, s.kind, s.unit, s.nominal);
            (e.states.into_iter().map(state).collect(), e.indicators, e.slopes)
        });
        Ok((PyBytes::new(py, &packed.bytes().map_err(PyValueError::new_err)?), impeding, shown, refused))
    }

    /// Transient analysis, as a `TranRequest` says.
    #[pyo3(signature = (tstep, tstop, **request))]
    fn tran(&self, py: Python<'_>, tstep: f64, tstop: f64, request: Option<&Bound<'_, PyDict>>) -> PyResult<Waveforms> {
        let request = tran::TranRequest::read("tran", request)?;
        tran::run(py, self, tstep, tstop, request)
    }
}

fn column_of<'py>(py: Python<'py>, record: &Record, k: usize) -> PyResult<Bound<'py, PyBytes>> {
    let (r, c) = (record.rows(), record.columns);
    if k >= c {
        return Err(PyIndexError::new_err("no such column"));
    }
    PyBytes::new_with(py, r * 8, |out| {
        for (chunk, row) in out.chunks_exact_mut(8).zip(record.data.chunks_exact(c)) {
            chunk.copy_from_slice(&row[k].to_ne_bytes());
        }
        Ok(())
    })
}

fn no_point(e: op::NoPoint) -> Failed {
    Failed { t: 0.0, h: 0.0, during: "operating point", why: e.why, tried: e.tried }
}

/// Modes, accelerations and reactions of the point where a transient would start. A circuit rests at its operating point: what
/// was solved for is all there is.
fn complete(sys: &crate::system::System, w: &mut Work, x: &mut [f64], tol: &Tolerances, statics: bool) {
    if !statics && sys.unknowns.iter().any(|u| u.kind.mechanical()) {
        let feature = sys.shortest_feature().min(1e-3);
        if let Ok(mut newton) = Newton::new(sys) {
            op::consistent(sys, &mut newton, w, x, None, (0.0, 1e-5 * feature), tol, true);
            if sys.has_laws() {
                Modes::settle(sys, w, x, feature, tol);
                op::consistent(sys, &mut newton, w, x, None, (0.0, 1e-5 * feature), tol, true);
            }
        }
    }
}

/// CPU seconds of this thread where the system tells, else wall time.
struct Clock(f64);

impl Clock {
    fn start() -> Clock {
        Clock(thread_seconds())
    }
    fn seconds(&self) -> f64 {
        thread_seconds() - self.0
    }
}

#[cfg(unix)]
fn thread_seconds() -> f64 {
    let mut ts = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `ts` is a valid place for the result
    if unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut ts) } != 0 {
        return wall_seconds();
    }
    ts.tv_sec as f64 + ts.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    wall_seconds()
}

fn wall_seconds() -> f64 {
    use std::time::{SystemTime, UNIX_EPOCH};
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64())
}

fn failure_dict(py: Python<'_>, sys: &crate::system::System, f: &Failed) -> PyResult<Py<PyDict>> {
    let d = PyDict::new(py);
    put!(d, f; t h during tried);
    let (kind, unknown, row) = match &f.why {
        Failure::Unfit { why } => {
            d.set_item("why", why)?;
            ("unfit", None, None)
        }
        Failure::TooLong { steps, seconds, mode } => {
            put!(d; "steps" => steps, "seconds" => seconds);
            if let Some((_, period, resolution)) = mode {
                put!(d; "period" => period, "steps_per_period" => resolution);
            }
            ("too long", mode.map(|m| m.0), None)
        }
        Failure::Signal { signal } => {
            d.set_item("signal", sys.clocked.signals.get(*signal).map(|s| s.name.clone()))?;
            ("signal", None, None)
        }
        Failure::Foreign { card, said } => {
            put!(d; "card" => card, "said" => said);
            ("foreign", None, None)
        }
        Failure::Contradiction { flag } => {
            d.set_item("flag", flag)?;
            ("contradiction", None, None)
        }
        Failure::Blocked { flag } => {
            d.set_item("flag", flag)?;
            ("blocked", None, None)
        }
        Failure::Singular(s) => {
            d.set_item("structural", s.structural)?;
            ("singular", s.col, s.row)
        }
        Failure::Diverged { unknown, row } => ("no convergence", Some(*unknown), Some(*row)),
        Failure::NotFinite { unknown } => ("not finite", Some(*unknown), Some(*unknown)),
        Failure::LeavesBranch { unknown } => ("leaves branch", Some(*unknown), Some(*unknown)),
    };
    let name = |k: Option<usize>| k.and_then(|k| sys.unknowns.get(k)).map(|u| u.name.clone());
    put!(d; "kind" => kind, "unknown" => unknown, "row" => row, "unknown_name" => name(unknown), "row_name" => name(row));
    Ok(d.unbind())
}

/// What the watch over the steps has to say (integrate/monitor.rs), with unknowns by name.
fn watch_dict(py: Python<'_>, sys: &crate::system::System, r: &integrate::Report) -> PyResult<Py<PyDict>> {
    let d = PyDict::new(py);
    let name = |k: usize| sys.unknowns[k].name.clone();
    for (key, mode) in [("damped", r.damped), ("late", r.late)] {
        let Some(m) = mode else { continue };
        let e = PyDict::new(py);
        e.set_item("unknown", name(m.unknown))?;
        put!(e, m; period steps share loss late cycles left from until);
        d.set_item(key, e)?;
    }
    if let Some(ring) = r.ringing {
        d.set_item("ringing", (name(ring.unknown), ring.t, ring.share))?;
    }
    if let Some((row, gap)) = r.open {
        d.set_item("open", (name(row), gap))?;
    }
    if let Some(unknown) = r.second {
        d.set_item("second", name(unknown))?;
    }
    d.set_item("stiff", r.stiff)?;
    Ok(d.unbind())
}

/// What hangs on gmin at the operating point in this row.
fn hanging(row: usize, w: &Work) -> Option<(usize, usize, f64, f64)> {
    w.doubts.hanging.map(|h| (row, h.unknown, h.volts, h.amperes))
}

#[pyclass]
pub struct Waveforms {
    record: Record,
    counters: Counters,
    /// (row, unknown, volts, amperes) of the first operating point that hangs on gmin
    #[pyo3(get)]
    hanging: Option<(usize, usize, f64, f64)>,
    /// a rest that does not stay: the node that moves most, Re and Im of s
    #[pyo3(get)]
    unstable: Option<(usize, f64, f64, bool)>,
    /// the condition that is not what it says where a transient starts, and how it is held: there is no operating point
    #[pyo3(get)]
    substitute: Option<(usize, bool)>,
    seconds: f64,
    #[pyo3(get)]
    status: &'static str,
    failure: Option<Py<PyDict>>,
    #[pyo3(get)]
    events: Vec<(f64, usize, u8)>,
    #[pyo3(get)]
    chattering: Vec<usize>,
    /// times at which modes of laws were found by a step of Moreau's
    #[pyo3(get)]
    short_steps: Vec<f64>,
    /// (time, flag) of laws that no finite force kept sliding
    #[pyo3(get)]
    jams: Vec<(f64, usize)>,
    #[pyo3(get)]
    broken: Vec<(f64, usize)>,
    watch: Option<Py<PyDict>>,
    /// (from when on, method, why)
    used: Vec<(f64, String, String)>,
    /// of every column: it does not bend with a source's corner
    #[pyo3(get)]
    steady: Vec<bool>,
    digital: Changes,
    /// of a sweep: unknowns and conditions at its last point
    #[pyo3(get)]
    state: Option<(Vec<f64>, Vec<f64>)>,
    /// of a transient: when it ended
    #[pyo3(get)]
    ended: f64,
}

impl Waveforms {
    /// What an operating point has: no events, no watch.
    fn new(record: Record, w: &Work, seconds: f64, status: &'static str, failure: Option<Py<PyDict>>) -> Waveforms {
        Waveforms {
            record,
            counters: w.counters,
            hanging: hanging(0, w),
            unstable: w.doubts.unstable.as_ref().map(|u| (u.unknown, u.s.0, u.s.1, u.at_start)),
            substitute: w.doubts.substitute,
            seconds,
            status,
            failure,
            events: vec![],
            chattering: vec![],
            short_steps: vec![],
            jams: vec![],
            broken: vec![],
            watch: None,
            used: vec![],
            steady: vec![],
            digital: Changes::default(),
            state: None,
            ended: 0.0,
        }
    }
}

/// Changes of digital nodes, by number; they are written out for who asks.
#[derive(Default)]
struct Changes {
    nodes: Vec<String>,
    log: Box<[(f64, u32, crate::logic::State)]>,
}

#[pymethods]
impl Waveforms {
    /// Changes of digital nodes: time, node, state as it is written.
    #[getter]
    fn digital(&self) -> Vec<(f64, &str, String)> {
        let Changes { nodes, log } = &self.digital;
        log.iter().map(|&(t, k, s)| (t, nodes[k as usize].as_str(), s.text())).collect()
    }
    #[getter]
    fn rows(&self) -> usize {
        self.record.rows()
    }
    #[getter]
    fn columns(&self) -> usize {
        self.record.columns
    }
    /// (row, first time, worst time, what is left there, what tolerances allow, is it charge?) of algebraic rows that did not hold at a
    /// recorded row, and of nodes whose charge came or went without a current.
    #[getter]
    fn unbalanced(&self) -> Vec<(usize, f64, f64, f64, f64, bool)> {
        let broken = self.record.invariants.iter().flat_map(|i| &i.broken);
        broken.map(|b| (b.row, b.first, b.t, b.left, b.bound, b.charge)).collect()
    }
    /// (time, how wide) of each of the closures that were asked for, where it was widest.
    #[getter]
    fn gaps(&self) -> Vec<(f64, f64)> {
        self.record.invariants.iter().flat_map(|i| &i.gaps).map(|g| (g.t, g.wide)).collect()
    }
    #[getter]
    fn failure(&self, py: Python<'_>) -> Option<Py<PyDict>> {
        self.failure.as_ref().map(|f| f.clone_ref(py))
    }

    /// Energy accounts: integrals of the powers, (heat, charge energy) of every device, what went through each of these back
    /// and forth, energies at the start and at the end and their largest change [J], and the trace as bytes of float64 rows; None where they were not asked for.
    #[getter]
    fn accounts(&self, py: Python<'_>) -> PyResult<Option<Py<PyDict>>> {
        let Some(ledger) = &self.record.ledger else { return Ok(None) };
        let d = PyDict::new(py);
        let (moved, swing) = ledger.turned_over();
        put!(d; "powers" => ledger.powers(), "devices" => ledger.devices(), "moved" => moved, "swing" => swing);
        put!(d, ledger; first last);
        if let Some(trace) = &ledger.trace {
            d.set_item("trace", bytes(py, trace))?;
        }
        Ok(Some(d.unbind()))
    }

    /// What the steps of a transient told about it, by kind; empty where there was none.
    #[getter]
    fn watch(&self, py: Python<'_>) -> Py<PyDict> {
        self.watch.as_ref().map_or_else(|| PyDict::new(py).unbind(), |d| d.clone_ref(py))
    }

    /// Column k (0 is time) as the bytes of native float64.
    fn column<'py>(&self, py: Python<'py>, k: usize) -> PyResult<Bound<'py, PyBytes>> {
        column_of(py, &self.record, k)
    }

    /// The time (0) or expression k - 1 of `inside`, as the bytes of native float64; empty where they were too many to keep.
    fn inside<'py>(&self, py: Python<'py>, k: usize) -> PyResult<Bound<'py, PyBytes>> {
        let samples =
            self.record.samples.as_ref().ok_or_else(|| PyIndexError::new_err("nothing was asked for inside"))?;
        column_of(py, samples.rows(), k)
    }

    /// Numbers in a row, and rows of time and derivatives of outputs and of the time (parameter by parameter), four for every part of
    /// a step, at its ends and at the stages between them, as the bytes of native float64; and rows of what may jump: the times
    /// before and behind it, and the derivative of its time by each parameter. None where nothing was asked for.
    fn tangent<'py>(&self, py: Python<'py>) -> Option<(usize, Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let tangent = self.record.tangent.as_ref()?;
        Some((tangent.width(), bytes(py, &tangent.rows), bytes(py, &tangent.turns)))
    }

    /// Why there are no sensitivities from a time on: kind (memory, impact, touch, corner, other, singular, full), and t, flag, parameter where
    /// they are known.
    #[getter]
    fn refused(&self, py: Python<'_>) -> PyResult<Option<Py<PyDict>>> {
        let Some(why) = self.record.tangent.as_ref().and_then(|t| t.refused.as_ref()) else { return Ok(None) };
        let (kind, t, flag, parameter) = match *why {
            Refused::Memory { t, flag } => ("memory", Some(t), Some(flag), None),
            Refused::Impact { t, flag } => ("impact", Some(t), Some(flag), None),
            Refused::Touch { t, flag } => ("touch", Some(t), Some(flag), None),
            Refused::Corner { t, parameter } => ("corner", Some(t), None, Some(parameter)),
            Refused::Other { parameter } => ("other", None, None, Some(parameter)),
            Refused::Singular(_) => ("singular", None, None, None),
            Refused::Full => ("full", None, None, None),
        };
        let d = PyDict::new(py);
        put!(d; "kind" => kind, "t" => t, "flag" => flag, "parameter" => parameter);
        Ok(Some(d.unbind()))
    }

    /// Times of rows at which signals may bend or jump, as the bytes of native float64.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        bytes(py, &self.record.corners)
    }

    /// One value, for callers without numpy.
    fn value(&self, row: usize, column: usize) -> PyResult<f64> {
        if row >= self.record.rows() || column >= self.record.columns {
            return Err(PyIndexError::new_err("no such value"));
        }
        Ok(self.record.data[row * self.record.columns + column])
    }

    #[getter]
    fn stats(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let d = PyDict::new(py);
        let c = &self.counters;
        put!(d, c; steps rejected newton_failures iterations evaluations jacobians factorisations solves events breakpoints);
        d.set_item("points", self.record.rows())?;
        if !self.used.is_empty() {
            let mut names: Vec<&str> = Vec::new();
            for (_, name, _) in &self.used {
                if !names.contains(&name.as_str()) {
                    names.push(name);
                }
            }
            put!(d; "method" => names.join(", "), "methods" => self.used.clone());
        }
        d.set_item("solve_time", self.seconds)?;
        Ok(d.unbind())
    }

    /// Puts the columns from `first` on that `table` names behind what a raw file holds.
    #[pyo3(signature = (path, table, ascii=false, first=0))]
    fn write_raw(&self, path: &str, table: RawTable, ascii: bool, first: usize) -> PyResult<()> {
        let rows = raw::Rows { width: self.record.columns, first, columns: table.names.len() };
        if rows.first + rows.columns > rows.width {
            return Err(PyValueError::new_err(format!("{} names for {} columns", rows.columns, rows.width)));
        }
        raw::write(path, &table.header()?, &self.record.data, rows, ascii)
            .map_err(|e| PyOSError::new_err(format!("{path}: {e}")))
    }

    /// Writes the last rows of a stream: how many there are in its file, and what went wrong; None where there is no such file,
    /// for the run was short.
    fn finish_stream(&mut self) -> Option<(usize, Option<String>)> {
        let Record { stream, data, .. } = &mut self.record;
        stream.as_mut()?.finish(data).map(|(rows, error)| (rows, error.map(ToString::to_string)))
    }
}

/// The equations with another value of a parameter: its number, how far it is moved, their weight in the derivative, outputs.
#[derive(FromPyObject)]
struct Besides<'py>(usize, f64, f64, PyRef<'py, System>, Vec<Bound<'py, PyAny>>);

impl Besides<'_> {
    fn compiled(self) -> PyResult<Beside> {
        let Besides(parameter, by, weight, system, outputs) = self;
        let outputs = Tape::new(&lock(&system.graph), &system.ids(&outputs)?);
        Ok(Beside::new(system.inner.clone(), outputs, parameter, (by, weight)))
    }
}

request! {
    /// What an engine without Python is to know.
    PackRequest {
        token: String,
        /// wave, name, value where nothing is said, when it varies
        inputs: Vec<(usize, String, f64, String)>,
        outputs: Vec<(Bound<'py, PyAny>, String)>,
        /// expressions of inputs, whose signs are to stay
        guards: Vec<(Bound<'py, PyAny>, i8)>,
        options_: Option<Bound<'py, PyDict>>,
        /// tstep, tstop, tmax, tstart of a transient
        times: (f64, f64, Option<f64>, f64),
        uic: bool,
        /// kind of failure -> code
        codes: BTreeMap<String, String>,
        /// what flags are called
        conditions: Vec<String>,
        /// flag -> what is said when it turns to 1
        warnings: BTreeMap<usize, String>,
        /// powers, energies, those of the powers that work in impulses; where the deck keeps them
        accounts: Option<(Vec<Bound<'py, PyAny>>, Vec<Bound<'py, PyAny>>, Vec<usize>)>,
        /// as an explicit ODE too
        exchange: bool,
    }
}

/// Of each state what stores it, of which kind and unit that is, and the nominal value; event indicators; is the Jacobian known?
type Exchanged = (Vec<(String, String, String, f64)>, usize, bool);

/// What stands above a table in a raw file.
#[derive(FromPyObject)]
struct RawTable {
    title: String,
    date: String,
    plotname: String,
    command: String,
    names: Vec<String>,
    types: Vec<String>,
}

impl RawTable {
    fn header(&self) -> PyResult<raw::Header> {
        if self.names.len() != self.types.len() {
            return Err(PyValueError::new_err("a name and a type for every column are needed"));
        }
        Ok(raw::Header {
            title: self.title.clone(),
            date: self.date.clone(),
            plotname: self.plotname.clone(),
            command: self.command.clone(),
            variables: self.names.iter().cloned().zip(self.types.iter().cloned()).collect(),
        })
    }
}
