//! Model exchange: states and rates of a deck, its event indicators and events, for an importer that has the solver.
use super::{Instance, Phase};
use crate::integrate::{Exchange, Failed};

/// What an event has come to, in FMI's words.
#[derive(Default)]
pub struct Update {
    pub states_changed: bool,
    pub next_event: Option<f64>,
}

impl Instance {
    pub fn states(&self) -> usize {
        self.packed.exchange.as_ref().map_or(0, |e| e.states.len())
    }

    pub fn indicators(&self) -> usize {
        self.packed.exchange.as_ref().map_or(0, |e| e.indicators)
    }

    /// Is it a state, or a rate, by its number behind the inputs?
    pub(super) fn is_stored(&self, k: usize) -> bool {
        k.checked_sub(self.packed.outputs.len()).is_some_and(|k| k < 2 * self.states() + self.indicators())
    }

    pub(super) fn name_of(&self, k: usize) -> &str {
        let outputs = &self.packed.outputs;
        let states = self.packed.exchange.as_ref().map_or(&[][..], |e| &e.states);
        match outputs.get(k) {
            Some(output) => &output.name,
            None => states.get((k - outputs.len()) % states.len().max(1)).map_or("a state", |s| &s.of),
        }
    }

    /// An output, a state or a rate, by its number behind the inputs.
    pub(super) fn get_of_ode(&mut self, k: usize) -> Result<f64, String> {
        let (outputs, states) = (self.packed.outputs.len(), self.states());
        if let (Some(session), Some(e)) = (&mut self.session, &self.packed.exchange) {
            let k = k - outputs;
            return Ok(match k.checked_sub(2 * states) {
                Some(k) => session.indicator(k),
                None if k < states => session.stored(e.states[k].row).0,
                None => session.stored(e.states[k - states].row).1,
            });
        }
        if k < outputs {
            return self.evaluated(|e| e.outputs().map(|v| v[k]));
        }
        let k = k - outputs;
        if k < states {
            return self.exchange().map(|e| e.states()[k]);
        }
        if k < 2 * states {
            return self.evaluated(|e| e.rates().map(|v| v[k - states]));
        }
        let mut all = vec![0.0; self.indicators()];
        self.evaluated(|e| e.indicators(&mut all))?;
        Ok(all[k - 2 * states])
    }

    pub(super) fn exchange(&mut self) -> Result<&mut Exchange, String> {
        self.exchange.as_mut().ok_or_else(|| "the model was not initialised".into())
    }

    /// What is evaluated at a point of a solver's may fail there, and be right at another one.
    pub(super) fn evaluated<T>(&mut self, what: impl FnOnce(&mut Exchange) -> Result<T, Failed>) -> Result<T, String> {
        let done = what(self.exchange()?);
        done.map_err(|failed| {
            self.discards = true;
            super::told(&self.system, &failed, &self.packed)
        })
    }

    /// An input that has been set is so from here on.
    pub(super) fn hand_on(&mut self, k: usize) -> Result<(), String> {
        if !std::mem::take(&mut self.changed) {
            return Ok(());
        }
        if let Some(line) = self.system.waves[self.packed.inputs[k].wave].as_input() {
            line.set(self.time, self.given[k].value, 0.0);
        }
        self.guarded(self.time)?;
        self.exchange()?.disturb();
        Ok(())
    }

    pub fn enter_event_mode(&mut self) -> Result<(), String> {
        self.must_be(&[Phase::Continuous], "enter event mode")?;
        self.evaluated(Exchange::begin_event)?;
        self.phase = Phase::Event;
        Ok(())
    }

    pub fn enter_continuous_time_mode(&mut self) -> Result<(), String> {
        self.must_be(&[Phase::Event], "enter continuous-time mode")?;
        self.phase = Phase::Continuous;
        Ok(())
    }

    /// Values behind the event.
    pub fn update_discrete_states(&mut self) -> Result<Update, String> {
        self.must_be(&[Phase::Event], "update its discrete states")?;
        match self.exchange()?.happen() {
            Ok(happened) => {
                self.listen()?;
                Ok(Update { states_changed: happened.states_jumped, next_event: happened.next })
            }
            Err(failed) => Err(self.fail(&failed)),
        }
    }

    /// True where the importer is to enter event mode.
    pub fn completed_step(&mut self) -> Result<bool, String> {
        self.must_be(&[Phase::Continuous], "complete a step")?;
        self.evaluated(Exchange::accept)
    }

    pub fn put_time(&mut self, t: f64) -> Result<(), String> {
        self.must_be(&[Phase::Continuous, Phase::Event], "be given a time")?;
        if !(t.is_finite() && t >= 0.0) {
            return Err(format!("a deck begins at t = 0, the time is set to {t} s"));
        }
        self.time = t;
        self.exchange()?.put_time(t);
        Ok(())
    }

    pub fn put_states(&mut self, y: &[f64]) -> Result<(), String> {
        self.must_be(&[Phase::Continuous], "be given states")?;
        self.counted(y.len(), self.states(), "states")?;
        if let Some(k) = y.iter().position(|v| !v.is_finite()) {
            self.discards = true;
            return Err(format!(
                "the state of `{}` is set to {}: a state is a finite number",
                self.name_of(self.packed.outputs.len() + k),
                y[k]
            ));
        }
        self.exchange()?.put_states(y);
        Ok(())
    }

    pub fn get_states(&mut self, out: &mut [f64]) -> Result<(), String> {
        self.counted(out.len(), self.states(), "states")?;
        self.begun()?;
        out.copy_from_slice(self.exchange()?.states());
        Ok(())
    }

    pub fn nominals(&mut self, out: &mut [f64]) -> Result<(), String> {
        self.counted(out.len(), self.states(), "states")?;
        let known = self.packed.exchange.iter().flat_map(|e| &e.states);
        out.iter_mut().zip(known).for_each(|(out, state)| *out = state.nominal);
        Ok(())
    }

    pub fn rates(&mut self, out: &mut [f64]) -> Result<(), String> {
        self.counted(out.len(), self.states(), "states")?;
        self.begun()?;
        self.evaluated(|e| e.rates().map(|rates| out.copy_from_slice(rates)))
    }

    pub fn event_indicators(&mut self, out: &mut [f64]) -> Result<(), String> {
        self.counted(out.len(), self.indicators(), "event indicators")?;
        self.begun()?;
        self.evaluated(|e| e.indicators(out))
    }

    /// In initialisation mode values are those of the start.
    pub(super) fn begun(&mut self) -> Result<(), String> {
        if self.phase == Phase::Initialising {
            return self.start();
        }
        Ok(())
    }

    fn counted(&self, given: usize, has: usize, what: &str) -> Result<(), String> {
        (given == has).then_some(()).ok_or_else(|| format!("the model has {has} {what}, not {given}"))
    }
}
