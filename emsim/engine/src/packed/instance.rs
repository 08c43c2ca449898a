//! One instance of a packed deck, as FMUs and pages have them: what is set, how far it is, and why it fails, in the deck's names.
//!
//! Value references: 0 is the time, then the inputs, then the outputs, in the order of the description; where the deck is an explicit ODE
//! too, then its states, then their rates.
//! An input goes on from where it is set as a straight line, of slope 0 where none is given for the step to come (FMI 2: input
//! derivatives). Where its value jumps, the step begins with the values behind the jump, as at the corner of a source.
mod exchanged;
mod placed;
mod slopes;

use super::{Accounts, Packed, Varies};
use crate::graph::{Graph, Id};
use crate::integrate::{self, Exchange, Failed, Place, Session, Stood, Transient};
use crate::ledger::Ledger;
use crate::newton::{Failure, Options};
use crate::record::Record;
use crate::rounding::{ROUNDED, SAME};
use crate::system::System;
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    Instantiated,
    Initialising,
    Stepping,
    /// of model exchange
    Event,
    Continuous,
    Terminated,
    Failed,
}

/// An input as it is set for the step to come.
#[derive(Clone, Copy)]
struct Given {
    value: f64,
    slope: f64,
}

pub struct Instance {
    packed: Packed,
    system: Arc<System>,
    graph: Graph,
    phase: Phase,
    given: Vec<Given>,
    changed: bool,
    session: Option<Session>,
    exchange: Option<Exchange>,
    slopes: Option<slopes::Tapes>,
    time: f64,
    stop: Option<f64>,
    reltol: Option<f64>,
    /// what is to be told: warnings of the last step
    pub told: Vec<String>,
    said: BTreeSet<String>,
    places: placed::Places,
    /// all rows of a step are kept, as they are drawn
    pub drawn: bool,
    /// its steps are somebody else's: model exchange
    by_others: bool,
    /// what failed may succeed at another point
    pub discards: bool,
}

/// What an instance is put back to.
pub struct Kept {
    phase: Phase,
    given: Vec<Given>,
    changed: bool,
    lines: Vec<[f64; 3]>,
    place: Option<Place>,
    stood: Option<Stood>,
    time: f64,
    stop: Option<f64>,
    reltol: Option<f64>,
}

impl Instance {
    pub fn new(packed: Packed) -> Result<Instance, String> {
        Instance::of(packed, false)
    }

    /// One whose steps are its own, or somebody else's.
    pub fn of(packed: Packed, by_others: bool) -> Result<Instance, String> {
        if by_others && packed.exchange.is_none() {
            return Err("this FMU is for co-simulation: it has its own integrator".into());
        }
        let (system, graph) = if by_others { packed.compile_for_others()? } else { packed.compile()? };
        let mut made = Instance {
            packed,
            system,
            graph,
            phase: Phase::Instantiated,
            given: Vec::new(),
            changed: false,
            session: None,
            exchange: None,
            slopes: None,
            time: 0.0,
            stop: None,
            reltol: None,
            told: Vec::new(),
            said: BTreeSet::new(),
            places: placed::Places::default(),
            drawn: false,
            by_others,
            discards: false,
        };
        made.reset();
        Ok(made)
    }

    pub fn reset(&mut self) {
        (self.session, self.exchange) = (None, None);
        self.given = self.packed.inputs.iter().map(|i| Given { value: i.start, slope: 0.0 }).collect();
        (self.phase, self.changed, self.time) = (Phase::Instantiated, false, 0.0);
        (self.stop, self.reltol) = (None, None);
        self.said.clear();
    }

    pub fn time(&self) -> f64 {
        self.time
    }

    /// Times and tolerance of the experiment, where they are said.
    pub fn set_up(&mut self, start: f64, stop: Option<f64>, reltol: Option<f64>) -> Result<(), String> {
        self.must_be(&[Phase::Instantiated], "be set up")?;
        if start != 0.0 {
            return Err(format!("a deck begins at t = 0, the experiment at {start} s"));
        }
        if let Some(stop) = stop.filter(|s| !(s.is_finite() && *s > 0.0)) {
            return Err(format!("the experiment ends at {stop} s: a run ends behind its start"));
        }
        if let Some(tol) = reltol.filter(|r| !(r.is_finite() && *r > 0.0 && *r < 1.0)) {
            return Err(format!("the tolerance is {tol}: a relative tolerance lies between 0 and 1"));
        }
        (self.stop, self.reltol) = (stop, reltol);
        Ok(())
    }

    /// At the start once more, with the inputs as they are, ready to go on.
    pub fn restart(&mut self) -> Result<(), String> {
        self.session = None;
        (self.phase, self.time) = (Phase::Stepping, 0.0);
        self.start()
    }

    /// Time and outputs where it stands, or, drawn, at the rows of the last step.
    pub fn rows(&self) -> &[f64] {
        self.session.as_ref().map_or(&[], Session::rows)
    }

    pub fn enter_initialisation(&mut self) -> Result<(), String> {
        self.must_be(&[Phase::Instantiated], "begin its initialisation")?;
        self.phase = Phase::Initialising;
        Ok(())
    }

    pub fn exit_initialisation(&mut self) -> Result<(), String> {
        self.must_be(&[Phase::Initialising], "end its initialisation")?;
        self.start()?;
        self.phase = if self.by_others { Phase::Event } else { Phase::Stepping };
        Ok(())
    }

    pub fn terminate(&mut self) -> Result<(), String> {
        self.must_be(&[Phase::Stepping, Phase::Event, Phase::Continuous], "be terminated")?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    fn must_be(&self, phases: &[Phase], what: &str) -> Result<(), String> {
        if phases.contains(&self.phase) {
            return Ok(());
        }
        let now = match self.phase {
            Phase::Instantiated => "instantiated, and not initialised",
            Phase::Initialising => "being initialised",
            Phase::Stepping => "running",
            Phase::Event => "in event mode",
            Phase::Continuous => "in continuous-time mode",
            Phase::Terminated => "terminated",
            Phase::Failed => "stopped by an error",
        };
        Err(format!("it is {now} and cannot {what}"))
    }

    /// The run at its start, with the inputs as they are.
    fn start(&mut self) -> Result<(), String> {
        if (self.session.is_some() || self.exchange.is_some()) && !self.changed {
            return Ok(());
        }
        (self.session, self.exchange) = (None, None);
        let (a, options, record) = self.prepared();
        self.guarded(0.0)?;
        self.changed = false;
        if self.by_others {
            let made = Exchange::new(self.system.clone(), a, options, record);
            self.exchange = Some(made.map_err(|failed| self.fail(&failed))?);
            return Ok(());
        }
        match Session::new(self.system.clone(), a, options, record) {
            Ok(session) => {
                self.session = Some(session);
                Ok(())
            }
            Err(failed) => Err(self.fail(&failed)),
        }
    }

    /// The whole transient with the inputs as they are, and its rows as they are drawn: time and outputs, up to where it fails.
    pub fn whole(&mut self) -> (Record, Result<(), String>) {
        let (a, mut options, mut record) = self.prepared();
        if let Err(said) = self.guarded(0.0) {
            return (record, Err(said));
        }
        let a = Transient { tstart: self.packed.tstart, ..a };
        if let Some(Accounts { powers, energies, impulsive }) = &self.packed.accounts {
            let mut ledger = Ledger::new(&self.graph, powers, energies, true);
            ledger.impulsive.clone_from(impulsive);
            (record.ledger, options.accounts) = (Some(ledger), true);
        }
        let system = self.system.clone();
        let mut w = system.work();
        let outcome = integrate::run(&system, &mut w, a, &options, &mut record, &mut |_, _, _, _| true);
        (record, outcome.failed.map_or(Ok(()), |failed| Err(told(&system, &failed, &self.packed))))
    }

    /// What a run from the start is given, once the inputs are handed to the equations.
    fn prepared(&self) -> (Transient, Options, Record) {
        for (input, given) in self.packed.inputs.iter().zip(&self.given) {
            if let Some(line) = self.system.waves[input.wave].as_input() {
                line.set(0.0, given.value, 0.0);
            }
        }
        let (mut a, mut options) = (self.packed.transient(), self.packed.options.clone());
        a.drawn = self.drawn;
        a.tstop = self.stop.unwrap_or(a.tstop);
        a.tstep = a.tstep.min(a.tstop);
        a.until = a.tstop;
        options.reltol = self.reltol.unwrap_or(options.reltol).clamp(1e-13, 0.5);
        (options.span, options.grid) = (a.tstop, a.tstep);
        let ids: Vec<Id> = self.packed.outputs.iter().map(|o| o.id).collect();
        (a, options, Record::new(&self.graph, &ids))
    }

    /// Are the equations those of the values that the inputs have at t? What decided over them reads inputs alone.
    fn guarded(&self, t: f64) -> Result<(), String> {
        if self.packed.guards.is_empty() {
            return Ok(());
        }
        let ids: Vec<Id> = self.packed.guards.iter().map(|&(id, _)| id).collect();
        let (mut found, mut w) = (Record::new(&self.graph, &ids), self.system.work());
        found.push(&self.system, &mut w, t, &vec![0.0; self.system.n]);
        let sign = |v: f64| (v > 0.0) as i8 - (v < 0.0) as i8;
        let kept = self.packed.guards.iter().zip(&found.data[1..]).all(|(&(_, was), &v)| sign(v) == was);
        kept.then_some(()).ok_or_else(|| "with these values the deck has other equations: it is to be read anew".into())
    }

    fn fail(&mut self, failed: &Failed) -> String {
        self.phase = Phase::Failed;
        told(&self.system, failed, &self.packed)
    }

    pub fn get(&mut self, reference: u32) -> Result<f64, String> {
        let k = reference as usize;
        let inputs = self.packed.inputs.len();
        match k.checked_sub(1) {
            None => return Ok(self.time),
            Some(k) if k < inputs => return Ok(self.given[k].value),
            _ => {}
        }
        let k = k - 1 - inputs;
        if k >= self.packed.outputs.len() && !self.is_stored(k) {
            return Err(format!("there is no variable with the value reference {reference}"));
        }
        if self.phase == Phase::Instantiated {
            return Err(format!("`{}` has no value before the model is initialised", self.name_of(k)));
        }
        if self.phase == Phase::Initialising {
            self.start()?;
        }
        if self.by_others || k >= self.packed.outputs.len() {
            return self.get_of_ode(k);
        }
        let found = self.session.as_ref().and_then(|s| s.outputs().get(k).copied());
        found.ok_or_else(|| "the model has no values: it could not be initialised".into())
    }

    pub fn set(&mut self, reference: u32, value: f64) -> Result<(), String> {
        let k = self.input(reference)?;
        let input = &self.packed.inputs[k];
        if !value.is_finite() {
            return Err(format!("`{}` is set to {value}: an input is a finite number", input.name));
        }
        if input.varies == Varies::Fixed && !matches!(self.phase, Phase::Instantiated | Phase::Initialising) {
            return Err(format!("`{}` is fixed: it is set before the model runs", input.name));
        }
        if matches!(self.phase, Phase::Terminated | Phase::Failed) {
            self.must_be(&[], "be given values")?;
        }
        self.changed |= self.given[k].value != value || self.given[k].slope != 0.0;
        self.given[k].value = value;
        if self.exchange.is_some() && self.phase != Phase::Initialising {
            return self.hand_on(k);
        }
        Ok(())
    }

    /// The slope with which an input goes on in the step to come.
    pub fn set_slope(&mut self, reference: u32, slope: f64) -> Result<(), String> {
        let k = self.input(reference)?;
        let input = &self.packed.inputs[k];
        let why = match input.varies {
            Varies::Fixed => Some("it is fixed".to_string()),
            Varies::Tunable => Some("it is a parameter".to_string()),
            Varies::Continuous => (!slope.is_finite()).then(|| format!("it is {slope}")),
        };
        if let Some(why) = why {
            return Err(format!("`{}` takes no such derivative: {why}", input.name));
        }
        self.changed |= self.given[k].slope != slope;
        self.given[k].slope = slope;
        Ok(())
    }

    fn input(&self, reference: u32) -> Result<usize, String> {
        let k = (reference as usize).checked_sub(1).unwrap_or(usize::MAX);
        if k < self.packed.inputs.len() {
            return Ok(k);
        }
        let name = match (reference as usize).checked_sub(1 + self.packed.inputs.len()) {
            Some(k) if k < self.packed.outputs.len() => format!("`{}` is an output", self.packed.outputs[k].name),
            _ if reference == 0 => "the time is no input".into(),
            _ => format!("there is no variable with the value reference {reference}"),
        };
        Err(format!("{name}: it cannot be set"))
    }

    /// From t on for h.
    pub fn step(&mut self, t: f64, h: f64) -> Result<(), String> {
        self.must_be(&[Phase::Stepping], "go on")?;
        if !(t.is_finite() && h.is_finite() && h > 0.0) {
            return Err(format!("a step goes forward, not by {h} s from t = {t} s"));
        }
        let until = t + h;
        if (t - self.time).abs() > SAME * until.abs().max(self.time) {
            return Err(format!("the step begins at t = {t} s, the model stands at {} s", self.time));
        }
        if let Some(stop) = self.stop.filter(|s| until > s * (1.0 + SAME)) {
            return Err(format!("the step ends at t = {until} s, behind the end that was said, {stop} s"));
        }
        let (jumps, t) = (self.hand_over(until), self.time);
        if jumps.is_some() {
            self.guarded(t)?;
        }
        let Some(session) = &mut self.session else { return Err("the model was not initialised".into()) };
        if let Some(jumps) = jumps {
            session.disturb(jumps, until);
        }
        let done = session.advance(until);
        self.time = until;
        let wrong = self.listen();
        // an input goes on from where its line has led
        for (input, given) in self.packed.inputs.iter().zip(&mut self.given) {
            if let Some(line) = self.system.waves[input.wave].as_input() {
                self.changed |= given.slope != 0.0;
                *given = Given { value: line.value(until), slope: 0.0 };
            }
        }
        done.map_err(|failed| self.fail(&failed))?;
        wrong
    }

    /// What the run of a deck says behind its end: functions that left their domain, parts that left their range, conditions that
    /// chatter; each once. Err: an error, from where on nothing is right.
    fn listen(&mut self) -> Result<(), String> {
        let packed = &self.packed;
        let (events, resting) = match (&mut self.session, &mut self.exchange) {
            (Some(session), _) => session.happened(),
            (None, Some(exchange)) => exchange.happened(),
            (None, None) => return Ok(()),
        };
        let turned = events.iter().filter(|(_, _, on)| *on).filter_map(|(t, k, _)| {
            let text = packed.warnings.get(k)?;
            Some((text.clone(), format!("{text}; first at t = {t} s")))
        });
        let chatters = resting.iter().filter_map(|&k| {
            let name = packed.conditions.get(k)?;
            let code = packed.codes.get("chattering").map_or(String::new(), |code| format!("[{code}] "));
            Some((
                format!("{code}{name}"),
                format!("{code}{name} turns again and again: it is followed to 1e-4 of the run"),
            ))
        });
        for (key, text) in turned.chain(chatters) {
            if key.starts_with("[E") {
                self.phase = Phase::Failed;
                return Err(text);
            }
            if self.said.insert(key) {
                self.told.push(text);
            }
        }
        Ok(())
    }

    /// Inputs as they were set, handed to the run: None where nothing is new, else whether anything jumps.
    fn hand_over(&mut self, until: f64) -> Option<bool> {
        if !std::mem::take(&mut self.changed) {
            return None;
        }
        let mut found = None;
        for (input, given) in self.packed.inputs.iter().zip(&self.given) {
            let Some(line) = self.system.waves[input.wave].as_input() else { continue };
            let led = line.value(self.time);
            let size = led.abs().max(given.value.abs()).max((given.slope * (until - self.time)).abs());
            let jumps = (given.value - led).abs() > ROUNDED * size;
            if jumps || given.slope != line.slope() {
                line.set(self.time, given.value, given.slope);
                found = Some(found == Some(true) || jumps);
            }
        }
        found
    }

    /// Not where a deck reads what was a time ago: of the past there is one.
    pub fn keep(&self) -> Result<Kept, String> {
        if !self.system.delays.list.is_empty() {
            return Err("a model with delays has no state that it could be put back to".into());
        }
        let line = |k: usize| self.system.waves[k].as_input().map_or([0.0; 3], |line| line.line());
        Ok(Kept {
            phase: self.phase,
            given: self.given.clone(),
            changed: self.changed,
            lines: self.packed.inputs.iter().map(|i| line(i.wave)).collect(),
            place: self.session.as_ref().map(Session::place),
            stood: self.exchange.as_ref().map(Exchange::stood),
            time: self.time,
            stop: self.stop,
            reltol: self.reltol,
        })
    }

    pub fn put_back(&mut self, kept: &Kept) -> Result<(), String> {
        (self.phase, self.changed, self.time) = (kept.phase, kept.changed, kept.time);
        (self.stop, self.reltol) = (kept.stop, kept.reltol);
        self.given.clone_from(&kept.given);
        for (input, &[from, value, slope]) in self.packed.inputs.iter().zip(&kept.lines) {
            if let Some(line) = self.system.waves[input.wave].as_input() {
                line.set(from, value, slope);
            }
        }
        match (&kept.stood, &mut self.exchange) {
            (None, exchange) => *exchange = None,
            (Some(stood), Some(exchange)) => exchange.return_to(stood),
            (Some(_), None) => return Err("the state is of a run, and there is none to be put back".into()),
        }
        match (&kept.place, &mut self.session) {
            (None, session) => *session = None,
            (Some(place), Some(session)) => session.return_to(place),
            (Some(_), None) => return Err("the state is of a run, and there is none to be put back".into()),
        }
        Ok(())
    }
}

/// Why a run stopped, in one line (more words: analyses/failure.py).
fn told(sys: &System, failed: &Failed, packed: &Packed) -> String {
    let name = |k: usize| sys.unknowns.get(k).map_or("?", |u| u.name.as_str());
    let when = match failed.during {
        "transient" if failed.t > 0.0 => format!("at t = {} s", failed.t),
        "transient" => "in the first step".into(),
        during => format!("at the {during}"),
    };
    let (kind, said) = match &failed.why {
        Failure::Diverged { row, .. } => {
            ("no convergence", format!("no convergence {when}, worst at `{}`", name(*row)))
        }
        Failure::Singular(s) => match s.row.or(s.col) {
            Some(k) => ("singular", format!("nothing determines `{}` {when}", name(k))),
            None => ("singular", format!("no unique solution {when}")),
        },
        Failure::NotFinite { unknown } => {
            ("not finite", format!("a value is not finite {when}, at `{}`", name(*unknown)))
        }
        Failure::LeavesBranch { unknown } => (
            "leaves branch",
            format!("a closed loop goes over to another way of moving {when}, at `{}`", name(*unknown)),
        ),
        Failure::Unfit { why } => ("unfit", format!("the method cannot do this deck: {why}")),
        Failure::TooLong { steps, .. } => ("too long", format!("the rest would take {steps:.2e} steps, {when}")),
        Failure::Signal { signal } => {
            let of = sys.clocked.signals.get(*signal).map_or("?", |s| s.name.as_str());
            ("signal", format!("{of} is not finite {when}"))
        }
        Failure::Foreign { card, said } => ("foreign", format!("the FMU {card} fails {when}: {said}")),
        Failure::Contradiction { flag } => {
            let of = packed.conditions.get(*flag).map_or("a condition", String::as_str);
            ("contradiction", format!("{of} contradicts itself or others {when}"))
        }
        Failure::Blocked { flag } => {
            let of = packed.conditions.get(*flag).map_or("a rigid end", String::as_str);
            ("blocked", format!("a motion that is given runs into {of} {when}"))
        }
    };
    let said = packed.codes.get(kind).map_or(said.clone(), |code| format!("[{code}] {said}"));
    match failed.tried.is_empty() {
        true => said,
        false => format!("{said} (tried: {})", failed.tried.join("; ")),
    }
}
