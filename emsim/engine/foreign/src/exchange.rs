//! An FMU for model exchange: its states are unknowns of the deck, its derivatives, outputs and event indicators functions of its states, its
//! inputs and the time (devices/foreign.rs), its events what the driver finds.
//!
//! One instance serves all who evaluate the equations. It changes at events alone, which a run has at points that it keeps; where a run is taken
//! back the instance goes with it (canGetAndSetFMUState), or the run fails.
use super::unit::begun;
use super::{Calls, Handle, Kind, Spec, Updated};
use std::sync::{Arc, Mutex, MutexGuard, Weak};

/// The instance, and what is known of it.
#[derive(Default)]
struct Running {
    calls: Option<Box<dyn Calls>>,
    /// which of the instances it is
    instance: u64,
    /// which discrete state it is in (no number is given twice), and how many there were
    state: u64,
    states: u64,
    kept: Weak<Kept>,
    /// when its own next event is
    next: Option<f64>,
    /// where its states jumped as it began: the run goes on from there
    jumped: Option<Vec<f64>>,
    /// after an error that is not of the point alone
    failed: Option<String>,
    /// why the last point could not be evaluated
    refused: Option<String>,
}

/// An instance, its next event, and where its states jumped.
type Made = (Box<dyn Calls>, Option<f64>, Option<Vec<f64>>);

pub struct Exchange {
    pub spec: Arc<Spec>,
    running: Mutex<Running>,
}

struct Kept {
    state: Handle,
    instance: u64,
    number: u64,
    next: Option<f64>,
    of: Arc<Exchange>,
}

impl Drop for Kept {
    fn drop(&mut self) {
        // (an instance takes what was kept of it along when it goes)
        if let Ok(mut running) = self.of.running.lock() {
            if let (true, Some(calls)) = (running.instance == self.instance, &mut running.calls) {
                calls.release(self.state);
            }
        }
    }
}

impl Exchange {
    pub fn new(spec: Arc<Spec>) -> Exchange {
        Exchange { spec, running: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Running> {
        self.running.lock().unwrap_or_else(|broken| broken.into_inner())
    }

    /// A fresh instance is made at the next evaluation: operating points and runs begin so.
    pub fn restart(&self) {
        let mut running = self.lock();
        // (a number is given once: what was kept of the last instance is not to be taken for one of the next)
        let (instance, states) = (running.instance + 1, running.states + 1);
        *running = Running { instance, state: states, states, ..Running::default() };
    }

    /// States of a fresh instance.
    pub fn first_states(&self) -> Result<Vec<f64>, String> {
        self.restart();
        let mut running = self.lock();
        let calls = self.ready(&mut running, 0.0, None)?;
        let mut x = vec![0.0; self.spec.states.len()];
        calls.states(&mut x)?;
        drop(running);
        self.restart();
        Ok(x)
    }

    /// The instance, in continuous-time mode.
    fn ready<'a>(&self, running: &'a mut Running, t: f64, u: Option<&[f64]>) -> Result<&'a mut Box<dyn Calls>, String> {
        if let Some(said) = &running.failed {
            return Err(said.clone());
        }
        if running.calls.is_none() {
            let made = self.made(t, u);
            match made {
                Ok((calls, next, jumped)) => {
                    (running.calls, running.next, running.jumped) = (Some(calls), next, jumped);
                }
                Err(said) => {
                    running.failed = Some(said.clone());
                    return Err(said);
                }
            }
        }
        running.calls.as_mut().ok_or_else(|| "there is no instance".into())
    }

    fn made(&self, t: f64, u: Option<&[f64]>) -> Result<Made, String> {
        let mut calls = begun(&self.spec, t, u.filter(|u| u.iter().all(|u| u.is_finite())))?;
        let updated = iterate(&mut *calls)?;
        calls.enter_continuous()?;
        let mut jumped = vec![0.0; self.spec.states.len()];
        let moved = updated.moved && !jumped.is_empty();
        if moved {
            calls.states(&mut jumped)?;
        }
        Ok((calls, updated.next, moved.then_some(jumped)))
    }

    /// Derivatives, outputs, indicators of `v`: states, inputs, time; with `slopes` of each of these by each of v, row after row. NaN where the
    /// FMU gives none.
    pub fn evaluate(&self, v: &[f64], out: &mut [f64], slopes: Option<&mut [f64]>) {
        let mut running = self.lock();
        let done = self.attempt(&mut running, v, out, slopes);
        if let Err(said) = done {
            out.fill(f64::NAN);
            // (what is discarded may be asked at another point; behind an error nothing is)
            if running.calls.as_ref().is_some_and(|calls| calls.is_over()) {
                running.failed = Some(said.clone());
            }
            running.refused = Some(said);
        }
    }

    fn attempt(
        &self,
        running: &mut Running,
        v: &[f64],
        out: &mut [f64],
        slopes: Option<&mut [f64]>,
    ) -> Result<(), String> {
        let (nx, ports) = (self.spec.states.len(), v.len());
        if !v.iter().all(|v| v.is_finite()) {
            return Err("what it is to be evaluated at is not finite".into());
        }
        let calls = self.ready(running, v[ports - 1].max(0.0), Some(&v[nx..ports - 1]))?;
        let point = Point { spec: &self.spec };
        point.put(&mut **calls, v)?;
        point.read(&mut **calls, out)?;
        let Some(slopes) = slopes else { return Ok(()) };
        let (exact, rows) = (self.spec.differentiates, out.len());
        if exact {
            point.directional(&mut **calls, slopes, ports)?;
        }
        // indicators, the time and what is no output are no part of what an FMU differentiates
        let outputs = nx..nx + self.spec.outputs.len();
        let apart = |row: usize| row >= outputs.end || outputs.contains(&row) && self.spec.rough[row - nx];
        let mut near = vec![0.0; rows];
        let mut at = v.to_vec();
        for k in 0..ports {
            let asked: Vec<usize> = (0..rows).filter(|&row| !exact || k == ports - 1 || apart(row)).collect();
            if asked.is_empty() {
                continue;
            }
            // truncation and rounding are alike over the square root of the latter, in parts of the value, or of 1
            let h = f64::EPSILON.sqrt() * v[k].abs().max(1.0);
            at[k] = v[k] + h;
            let h = at[k] - v[k];
            point.put(&mut **calls, &at)?;
            point.read(&mut **calls, &mut near)?;
            at[k] = v[k];
            for row in asked {
                slopes[row * ports + k] = (near[row] - out[row]) / h;
            }
        }
        point.put(&mut **calls, v)
    }

    /// Why an evaluation failed, since this was asked.
    pub fn trouble(&self) -> Option<String> {
        let mut running = self.lock();
        running.failed.clone().or_else(|| running.refused.take())
    }
}

/// Rounds of an event until nothing changes.
fn iterate(calls: &mut dyn Calls) -> Result<Updated, String> {
    let mut moved = false;
    // (one that asks for a thousand never comes to an end)
    for _ in 0..1000 {
        let updated = calls.update()?;
        moved |= updated.moved;
        if updated.ends {
            return Err("it ends the simulation".into());
        }
        if !updated.again {
            return Ok(Updated { moved, ..updated });
        }
    }
    Err("it asks for round after round of one event".into())
}

/// Evaluations at a point.
struct Point<'a> {
    spec: &'a Spec,
}

impl Point<'_> {
    fn put(&self, calls: &mut dyn Calls, v: &[f64]) -> Result<(), String> {
        let nx = self.spec.states.len();
        calls.set_time(v[v.len() - 1])?;
        if nx > 0 {
            calls.set_states(&v[..nx])?;
        }
        calls.set(&self.spec.continuous(), &self.spec.of_continuous(&v[nx..v.len() - 1]))
    }

    fn read(&self, calls: &mut dyn Calls, out: &mut [f64]) -> Result<(), String> {
        let (dx, rest) = out.split_at_mut(self.spec.states.len());
        let (y, z) = rest.split_at_mut(self.spec.outputs.len());
        if !dx.is_empty() {
            calls.derivatives(dx)?;
        }
        calls.get(&self.spec.outputs, y)?;
        if !z.is_empty() {
            calls.indicators(z)?;
        }
        Ok(())
    }

    /// Columns of the states and the inputs, rows of the derivatives and outputs.
    fn directional(&self, calls: &mut dyn Calls, slopes: &mut [f64], ports: usize) -> Result<(), String> {
        let spec = self.spec;
        // (whole numbers have no derivatives)
        let smooth = |v: &super::Variable| matches!(v.kind, Kind::Float64 | Kind::Float32);
        let outputs = spec.outputs.iter().enumerate().filter(|&(j, v)| smooth(v) && !spec.rough[j]);
        let outputs = outputs.map(|(j, v)| (spec.states.len() + j, v.reference));
        let (rows, unknowns): (Vec<usize>, Vec<u32>) =
            spec.derivatives.iter().copied().enumerate().chain(outputs).unzip();
        let inputs = spec.inputs.iter().zip(&spec.discrete).map(|(v, discrete)| (!discrete).then_some(v.reference));
        let mut column = vec![0.0; unknowns.len()];
        for (k, known) in spec.states.iter().copied().map(Some).chain(inputs).enumerate() {
            if let Some(known) = known {
                calls.directional(&unknowns, known, &mut column)?;
                rows.iter().zip(&column).for_each(|(&row, &value)| slopes[row * ports + k] = value);
            }
        }
        Ok(())
    }
}

impl Spec {
    /// Inputs that may be set between events: FMI lets discrete ones change at events alone.
    fn continuous(&self) -> Vec<super::Variable> {
        self.inputs.iter().zip(&self.discrete).filter(|(_, &discrete)| !discrete).map(|(v, _)| *v).collect()
    }

    fn of_continuous(&self, u: &[f64]) -> Vec<f64> {
        u.iter().zip(&self.discrete).filter(|(_, &discrete)| !discrete).map(|(u, _)| *u).collect()
    }
}

/// Where it is in the equations: unknowns that are its states and its inputs, flags that are the signs of its indicators.
#[derive(Clone)]
pub struct Seat {
    pub of: Arc<Exchange>,
    pub states: Vec<usize>,
    pub inputs: Vec<usize>,
    pub flags: Vec<usize>,
}

/// An FMU during a run.
pub struct Place {
    of: Arc<Exchange>,
    pub asked: bool,
    pub next: f64,
    number: Option<u64>,
    kept: Option<Arc<Kept>>,
    /// inputs at its last event
    given: Vec<f64>,
    /// so often it has asked, one event after the other, for the next at a time that is not ahead
    stands: u32,
}

impl Clone for Place {
    fn clone(&self) -> Place {
        let kept = self.kept.clone().or_else(|| self.keep());
        Place {
            of: self.of.clone(),
            asked: self.asked,
            next: self.next,
            number: self.number,
            kept,
            given: self.given.clone(),
            stands: self.stands,
        }
    }
}

impl Place {
    pub fn new(seat: &Seat) -> Place {
        let of = seat.of.clone();
        Place { of, asked: false, next: f64::INFINITY, number: None, kept: None, given: Vec::new(), stands: 0 }
    }

    fn keep(&self) -> Option<Arc<Kept>> {
        let mut running = self.of.lock();
        let number = self.number.filter(|&n| n == running.state && self.of.spec.returns)?;
        if let Some(kept) = running.kept.upgrade().filter(|kept| kept.number == number) {
            return Some(kept);
        }
        let state = running.calls.as_mut()?.keep().ok()?;
        let kept =
            Arc::new(Kept { state, instance: running.instance, number, next: running.next, of: self.of.clone() });
        running.kept = Arc::downgrade(&kept);
        Some(kept)
    }

    /// Values have jumped: an input that changes at events alone is another one, so there is an event.
    pub fn look(&mut self, seat: &Seat, x: &[f64]) {
        let now = seat.inputs.iter().zip(&self.given).zip(&self.of.spec.discrete);
        self.asked |= now.into_iter().any(|((&k, given), &discrete)| discrete && x[k] != *given);
    }

    /// The run was taken back.
    pub fn put_back(&mut self) {
        let Some(number) = self.number else { return };
        let mut running = self.of.lock();
        if running.state == number {
            return;
        }
        let instance = running.instance;
        let done = match (&self.kept, &mut running.calls) {
            // (what was kept of another instance has gone with it)
            (Some(kept), Some(calls)) if kept.instance == instance => calls.put_back(kept.state),
            _ => Err("the run goes back, and it cannot (canGetAndSetFMUState is not set)".into()),
        };
        match done {
            Ok(()) => (running.state, running.next) = (number, self.kept.as_ref().and_then(|kept| kept.next)),
            Err(said) => running.failed = Some(said),
        }
    }

    /// An event at the point that stands; states that jump go into x. Gives the indicators behind it.
    pub fn event(&mut self, seat: &Seat, x: &mut [f64], t: f64) -> Result<Vec<f64>, String> {
        self.asked = false;
        let of = self.of.clone();
        let mut running = of.lock();
        let inputs: Vec<f64> = seat.inputs.iter().map(|&k| x[k]).collect();
        of.ready(&mut running, t, Some(&inputs))?;
        let jumped = running.jumped.take();
        let moved = jumped.is_some();
        let states = jumped.unwrap_or_else(|| seat.states.iter().map(|&k| x[k]).collect());
        let calls = of.ready(&mut running, t, Some(&inputs))?;
        let done = at_event(&of.spec, &mut **calls, (&states, &inputs), t);
        let (updated, found, indicators) = done.inspect_err(|said| running.failed = Some(said.clone()))?;
        self.stands = if updated.next.is_some_and(|next| next <= t) { self.stands + 1 } else { 0 };
        // times are rounded, so that a few are none of its faults
        if self.stands > 100 {
            return Err("it asks for its next event at a time that has passed, again and again".into());
        }
        if updated.moved || moved {
            seat.states.iter().zip(found).for_each(|(&k, value)| x[k] = value);
        }
        running.states += 1;
        (running.state, running.next) = (running.states, updated.next);
        self.number = Some(running.state);
        self.given = inputs;
        self.next = updated.next.unwrap_or(f64::INFINITY);
        drop(running);
        self.kept = None;
        Ok(indicators)
    }

    /// A step was accepted: the FMU hears of it, where it wants to, and may ask for an event.
    pub fn completed(&mut self, seat: &Seat, x: &[f64], t: f64) -> Result<(), String> {
        let of = self.of.clone();
        let mut running = of.lock();
        // (a point that it refused was passed by shorter steps)
        running.refused = None;
        if !of.spec.hears_steps {
            return Ok(());
        }
        let at: Vec<f64> = seat.states.iter().chain(&seat.inputs).map(|&k| x[k]).chain([t]).collect();
        let calls = of.ready(&mut running, t, None)?;
        Point { spec: &of.spec }.put(&mut **calls, &at)?;
        let (event, ends) = calls.completed()?;
        if ends {
            return Err("it ends the simulation".into());
        }
        self.asked |= event;
        Ok(())
    }
}

/// Event mode and back; the states and the indicators behind it.
fn at_event(
    spec: &Spec,
    calls: &mut dyn Calls,
    (states, inputs): (&[f64], &[f64]),
    t: f64,
) -> Result<(Updated, Vec<f64>, Vec<f64>), String> {
    let at: Vec<f64> = states.iter().chain(inputs).copied().chain([t]).collect();
    Point { spec }.put(calls, &at)?;
    calls.enter_event()?;
    calls.set(&spec.inputs, inputs)?;
    let updated = iterate(calls)?;
    let mut found = states.to_vec();
    if updated.moved && !found.is_empty() {
        calls.states(&mut found)?;
    }
    calls.enter_continuous()?;
    let mut indicators = vec![0.0; spec.indicators];
    if !indicators.is_empty() {
        calls.indicators(&mut indicators)?;
    }
    Ok((updated, found, indicators))
}
