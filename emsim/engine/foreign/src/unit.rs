//! A co-simulation FMU during a run: at each tick of its own clock it has come to the tick's time by the inputs of the tick before, gives
//! its outputs, and takes its inputs anew.
//!
//! A run that is taken back takes the FMU with it, where that can be (canGetAndSetFMUState); else the next tick says that it cannot.
use super::{instantiate, Calls, Handle, Spec, Stepped};
use std::sync::{Arc, Mutex, Weak};

/// An instance, which of its states it is in (no number is given twice), how many it has been in, and its time.
struct Running {
    calls: Box<dyn Calls>,
    state: u64,
    states: u64,
    at: f64,
    /// can it be taken back
    returns: bool,
    /// which state was kept last
    last: (u64, Weak<Kept>),
}

/// A state that a run may be taken back to.
struct Kept {
    state: Handle,
    at: f64,
    of: Arc<Mutex<Option<Running>>>,
}

impl Drop for Kept {
    fn drop(&mut self) {
        if let Ok(Some(running)) = self.of.lock().as_deref_mut() {
            running.calls.release(self.state);
        }
    }
}

#[derive(Default)]
pub struct Unit {
    of: Arc<Mutex<Option<Running>>>,
    state: u64,
    kept: Option<Arc<Kept>>,
    /// why it went no further: it is not asked again
    failed: Option<String>,
}

impl Clone for Unit {
    fn clone(&self) -> Unit {
        let kept = match &self.kept {
            Some(kept) => Some(kept.clone()),
            None => self.keep(),
        };
        Unit { of: self.of.clone(), state: self.state, kept, failed: self.failed.clone() }
    }
}

impl Unit {
    /// The state that it is in, where there is one and it can be kept.
    fn keep(&self) -> Option<Arc<Kept>> {
        let mut of = self.of.lock().ok()?;
        let running = of.as_mut().filter(|running| running.returns && running.state == self.state)?;
        if running.last.0 == running.state {
            if let Some(kept) = running.last.1.upgrade() {
                return Some(kept);
            }
        }
        let state = running.calls.keep().ok()?;
        let kept = Arc::new(Kept { state, at: running.at, of: self.of.clone() });
        running.last = (running.state, Arc::downgrade(&kept));
        Some(kept)
    }

    /// It has come to t: its outputs there, of the inputs before. Nothing at the first tick, by which it begins.
    pub fn arrive(&mut self, spec: &Spec, t: f64, outputs: &mut [f64]) -> Result<(), String> {
        self.unless_failed(|unit| unit.step_to(spec, t, outputs))
    }

    fn unless_failed(&mut self, act: impl FnOnce(&mut Unit) -> Result<(), String>) -> Result<(), String> {
        if let Some(said) = &self.failed {
            return Err(said.clone());
        }
        let done = act(self);
        self.failed = done.as_ref().err().cloned();
        done
    }

    fn step_to(&mut self, spec: &Spec, t: f64, outputs: &mut [f64]) -> Result<(), String> {
        let of = self.of.clone();
        let mut of = of.lock().map_err(|_| "a run of it broke off".to_string())?;
        let Some(running) = of.as_mut() else { return Ok(()) };
        if running.state != self.state {
            let back =
                self.kept.as_ref().ok_or("the run goes back, and it cannot (canGetAndSetFMUState is not set)")?;
            running.calls.put_back(back.state)?;
            (running.state, running.at) = (self.state, back.at);
        }
        let from = running.at;
        let Stepped { until, ends } = running.calls.step(from, t - from)?;
        if ends {
            return Err(format!("it ends the simulation in the step from t = {from} s"));
        }
        if let Some(until) = until.filter(|&until| until < t) {
            return Err(format!(
                "it discards the step from t = {from} s to {t} s: it came to {until} s (a shorter step= may do)"
            ));
        }
        running.states += 1;
        (running.at, running.state, self.state) = (t, running.states, running.states);
        running.calls.get(&spec.outputs, outputs)?;
        drop(of);
        self.kept = None;
        Ok(())
    }

    /// Inputs from t on, and the outputs that go with them.
    pub fn give(&mut self, spec: &Arc<Spec>, t: f64, inputs: &[f64], outputs: &mut [f64]) -> Result<(), String> {
        self.unless_failed(|unit| unit.take(spec, t, inputs, outputs))
    }

    fn take(&mut self, spec: &Arc<Spec>, t: f64, inputs: &[f64], outputs: &mut [f64]) -> Result<(), String> {
        let mut of = self.of.lock().map_err(|_| "a run of it broke off".to_string())?;
        if let Some(running) = of.as_mut() {
            running.calls.set(&spec.inputs, inputs)?;
            return running.calls.get(&spec.outputs, outputs);
        }
        let mut calls = begun(spec, t, Some(inputs))?;
        calls.get(&spec.outputs, outputs)?;
        *of = Some(Running { calls, state: 0, states: 0, at: t, returns: spec.returns, last: (0, Weak::new()) });
        Ok(())
    }
}

/// An instance that has its start values, and is initialised at t.
pub fn begun(spec: &Arc<Spec>, t: f64, inputs: Option<&[f64]>) -> Result<Box<dyn Calls>, String> {
    let mut calls = instantiate(spec)?;
    for start in &spec.starts {
        match start {
            super::Start::Number(variable, value) => calls.set(&[*variable], &[*value])?,
            super::Start::Text(reference, text) => calls.set_text(*reference, text)?,
        }
    }
    calls.enter_initialisation(t)?;
    if let Some(inputs) = inputs {
        calls.set(&spec.inputs, inputs)?;
    }
    calls.exit_initialisation()?;
    Ok(calls)
}
