//! A transient analysis as Python asks for it.
use super::{failure_dict, lock, options, watch_dict, Besides, Changes, Clock, RawTable, System, Waveforms};
use crate::integrate::{self, Outcome, Status, Transient};
use crate::interrupt;
use crate::invariants::Invariants;
use crate::ledger::Ledger;
use crate::newton::{Options, Tolerances};
use crate::op;
use crate::py::guarded;
use crate::py::request::request;
use crate::raw;
use crate::record::{Record, Samples};
use crate::system::Work;
use crate::tangent::Tangent;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Expressions as Python has them.
type Exprs<'py> = Vec<Bound<'py, PyAny>>;

request! {
    /// What a run is asked for, beside its print step and its end.
    TranRequest {
        tstart: f64 = Default::default(),
        tmax: Option<f64> = None,
        uic: bool = Default::default(),
        outputs: Exprs<'py> = Default::default(),
        options_: Option<Bound<'py, PyDict>> = None,
        /// progress(t, h, steps, events) is called now and then; a true return value stops the run
        progress: Option<Py<PyAny>> = None,
        /// powers to integrate, energies to read at both ends, keep a trace of them
        accounts: Option<(Exprs<'py>, Exprs<'py>, bool)> = None,
        /// if not, the rows beside the steps' ends are those of the print grid alone
        drawn: bool = true,
        stream: Option<(String, bool, RawTable)> = None,
        /// expressions to be kept within the steps, and the degree of their polynomials
        inside: Option<(Exprs<'py>, usize)> = None,
        closures: Exprs<'py> = Default::default(),
        /// the `state` of another run, in place of an operating point
        begin: Option<(Vec<f64>, Vec<f64>)> = None,
        /// sizes of parameters, and the equations with other values of them: see `tangent::Beside`
        tangent: Option<(Vec<f64>, Vec<Besides<'py>>)> = None,
        /// those of the powers of `accounts` that work in impulses
        impulsive: Vec<usize> = Default::default(),
        /// of `paces`, for a system whose builder noted its places: each of these with steps of its own
        apart: Vec<Vec<usize>> = Default::default(),
        /// it goes from here to there alone, with these charges where `begin` is of other equations
        leg: Option<(f64, f64, Option<Vec<f64>>)> = None,
        /// flags that end it when they turn to 1, or whenever they turn
        halts: Vec<(usize, bool)> = Default::default(),
    }
}

/// `what` as an error.
fn wrong<T>(what: &str) -> PyResult<T> {
    Err(PyValueError::new_err(format!("tran: {what}")))
}

pub(super) fn run(py: Python<'_>, this: &System, tstep: f64, tstop: f64, mut r: TranRequest) -> PyResult<Waveforms> {
    let (a, charges) = checked(this, tstep, tstop, &mut r)?;
    let ids = this.ids(&r.outputs)?;
    let mut o = options(r.options_.as_ref())?;
    (o.accounts, o.span, o.grid) = (r.accounts.is_some(), tstop, tstep);
    let sys = this.integrable(&o, r.tangent.is_some())?;
    let record = record(this, &sys, &o, &a, &ids, &mut r)?;
    if integrate::reduces(&sys, &o) {
        guarded(|| sys.reduce(&mut lock(&this.graph)))?;
    }
    if integrate::splits(&o.method) {
        guarded(|| sys.split(&mut lock(&this.graph)))?;
    }
    let parts = r.apart.into_iter().map(|of| this.part(of, &o)).collect::<PyResult<Vec<_>>>()?;
    let (begin, halts, progress) = (r.begin, r.halts, r.progress);
    let (outcome, w, record, seconds) = py.detach(move || {
        let clock = Clock::start();
        let mut record = record;
        let mut w = sys.work();
        (w.begin, w.charges, w.halts) = (begin, charges, halts);
        w.every_corner = record.tangent.is_some();
        let mut tick = ticks(&record, progress);
        // what was recorded before an interrupt is kept, wherever in the run it is seen
        let mut outcome = Outcome::interrupted();
        let _ = interrupt::guarded(|| match parts.as_slice() {
            [] => outcome = integrate::run(&sys, &mut w, a, &o, &mut record, &mut tick),
            parts => outcome = integrate::run_independent(&sys, &mut w, parts, a, &o, &mut record, &mut tick),
        });
        if outcome.status == Status::Ok && outcome.end.len() == sys.n {
            let ended = op::unstable(&sys, &mut w, &outcome.end, outcome.ended, &o, &Tolerances::new(&sys, &o));
            w.doubts.unstable = ended.or(w.doubts.unstable);
        }
        (outcome, w, record, clock.seconds())
    });
    super::super::ends()?;
    told(py, this, outcome, w, record, seconds)
}

/// The span of the run, with the charges that it begins with.
fn checked(this: &System, tstep: f64, tstop: f64, r: &mut TranRequest) -> PyResult<(Transient, Option<Vec<f64>>)> {
    let n = this.inner.n;
    if r.begin.as_ref().is_some_and(|(x, flags)| x.len() != n || flags.len() != this.inner.flags.len()) {
        return wrong("begin is the state of a run of these equations");
    }
    let begun = r.begin.is_some();
    let (from, until, charges) = r.leg.take().unwrap_or((0.0, tstop, None));
    let fits = charges.as_ref().is_none_or(|q| q.len() == n);
    if !(fits && from >= 0.0 && from < until && until <= tstop && (from == 0.0 || begun)) {
        return wrong("a leg is a part of the run, behind its start with a state");
    }
    if r.halts.iter().any(|&(k, _)| k >= this.inner.flags.len()) {
        return wrong("no such flag");
    }
    let (tstart, tmax) = (r.tstart, r.tmax);
    let good = |v: f64| v.is_finite() && v > 0.0;
    let ordered = tstart >= 0.0 && tstart < tstop;
    if !(good(tstep) && good(tstop) && ordered && tmax.is_none_or(good)) {
        return wrong("times must be positive, tstart before tstop");
    }
    Ok((Transient { tstep, tstop, tstart, tmax, uic: r.uic, begun, from, until, drawn: r.drawn }, charges))
}

/// What is recorded beside the rows.
fn record(
    this: &System,
    sys: &Arc<crate::system::System>,
    o: &Options,
    a: &Transient,
    ids: &[crate::graph::Id],
    r: &mut TranRequest,
) -> PyResult<Record> {
    let mut record = Record::new(&lock(&this.graph), ids);
    let closures = this.ids(&r.closures)?;
    record.invariants = (!o.unwatched).then(|| Invariants::new(&lock(&this.graph), sys, o, &closures));
    record.spoiled = o.spoiled;
    if let Some((powers, energies, traced)) = r.accounts.take() {
        let (powers, energies) = (this.ids(&powers)?, this.ids(&energies)?);
        let mut ledger = Ledger::new(&lock(&this.graph), &powers, &energies, traced);
        ledger.impulsive = std::mem::take(&mut r.impulsive);
        record.ledger = Some(ledger);
    }
    if let Some((expressions, degree)) = r.inside.take() {
        let ids = this.ids(&expressions)?;
        record.samples = Some(Box::new(Samples::new(&lock(&this.graph), &ids, degree, a.tstart)));
    }
    if let Some((sizes, others)) = r.tangent.take() {
        let besides = others.into_iter().map(Besides::compiled).collect::<PyResult<Vec<_>>>()?;
        if besides.iter().any(|b| b.parameter >= sizes.len()) {
            return wrong("no such parameter");
        }
        let tol = Tolerances::new(sys, o);
        record.tangent = Some(Box::new(Tangent::new(sys, besides, sizes, tol, a.tstop)));
    }
    if let Some((path, append, table)) = r.stream.take() {
        let rows = raw::Rows { width: record.columns, first: 0, columns: table.names.len() };
        if rows.columns > rows.width {
            return Err(PyValueError::new_err(format!("{} names for {} columns", rows.columns, rows.width)));
        }
        record.stream = Some(raw::Stream::new(path, append, table.header()?, rows));
    }
    Ok(record)
}

/// Called at every step: goes on unless Python, the memory or an interrupt says otherwise.
fn ticks(record: &Record, progress: Option<Py<PyAny>>) -> impl FnMut(f64, f64, u64, u64) -> bool + use<> {
    let (gate, streams) = (record.gate.clone(), record.stream.is_some());
    let mut last = Instant::now();
    move |t: f64, h: f64, steps: u64, events: u64| {
        if last.elapsed() < Duration::from_millis(50) {
            return true;
        }
        last = Instant::now();
        gate.due.store(streams, Relaxed);
        if gate.full.load(Relaxed) {
            return false;
        }
        !interrupt::asked()
            && progress.as_ref().is_none_or(|call| {
                Python::attach(|py| match call.call1(py, (t, h, steps, events)) {
                    Ok(stop) => !stop.is_truthy(py).unwrap_or(false),
                    Err(_) => false,
                })
            })
    }
}

/// What the run has come to.
fn told(
    py: Python<'_>,
    this: &System,
    outcome: Outcome,
    mut w: Work,
    record: Record,
    seconds: f64,
) -> PyResult<Waveforms> {
    let sys = &this.inner;
    let mut failure = outcome.failed.as_ref().map(|f| failure_dict(py, sys, f)).transpose()?;
    let full = record.gate.full.load(Relaxed);
    if full {
        let d = PyDict::new(py);
        d.set_item("kind", "memory")?;
        failure = Some(d.unbind());
    }
    let status = match outcome.status {
        _ if full => "failed",
        Status::Ok => "ok",
        Status::Failed => "failed",
        Status::Interrupted => "interrupted",
    };
    let nodes = if w.logic.log.is_empty() { &[][..] } else { &sys.logic.nodes };
    let digital =
        Changes { nodes: nodes.iter().map(|n| n.name.clone()).collect(), log: std::mem::take(&mut w.logic.log).into() };
    let steady = record.steady(sys);
    let watch = Some(watch_dict(py, sys, &outcome.watch)?);
    let found = Waveforms::new(record, &w, seconds, status, failure);
    Ok(Waveforms {
        events: outcome.events.iter().map(|&(t, k, v)| (t, k, u8::from(v))).collect(),
        chattering: outcome.resting,
        short_steps: outcome.stepped,
        jams: outcome.jammed.iter().map(|&(t, law)| (t, sys.laws.list[law].flags[0])).collect(),
        broken: outcome.broken,
        watch,
        used: outcome.used.into_iter().map(|u| (u.t, u.method, u.why)).collect(),
        steady,
        digital,
        state: (!outcome.end.is_empty()).then_some((outcome.end, w.flags)),
        ended: outcome.ended,
        ..found
    })
}
