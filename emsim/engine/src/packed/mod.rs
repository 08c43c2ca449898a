//! A deck as bytes: what Python hands to an engine without Python, that of an FMU (fmi/) or of a page (page.rs). Graph and model
//! are those that `System::compile` takes, so that both ways lead through one door.
mod impeding;
pub mod instance;

use crate::graph::{Graph, Id};
use crate::integrate::{self, Transient};
use crate::model::Model;
use crate::newton::Options;
use crate::system::System;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A value that comes from outside: its wave, its name, what it is where nothing is said.
#[derive(Clone, Serialize, Deserialize)]
pub struct Input {
    pub wave: usize,
    pub name: String,
    pub start: f64,
    pub varies: Varies,
}

/// When a value from outside may change, in the words of FMI.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Varies {
    /// an input: at any time, as a line too
    Continuous,
    /// a parameter that is set between two steps as well
    Tunable,
    /// a parameter that holds still while the model runs
    Fixed,
}

impl Varies {
    pub fn of(word: &str) -> Option<Varies> {
        match word {
            "continuous" => Some(Varies::Continuous),
            "tunable" => Some(Varies::Tunable),
            "fixed" => Some(Varies::Fixed),
            _ => None,
        }
    }
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Output {
    pub id: Id,
    pub name: String,
}

/// Energy accounts: powers to be integrated, energies to be read at both ends, those of the powers that work in impulses.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Accounts {
    pub powers: Vec<Id>,
    pub energies: Vec<Id>,
    pub impulsive: Vec<usize>,
}

/// Graph and model, as they are before they are compiled.
#[derive(Serialize, Deserialize)]
pub struct Equations {
    pub graph: Graph,
    pub model: Model,
}

#[derive(Serialize, Deserialize)]
pub struct Packed {
    /// of emsim: another one does not read it
    pub version: String,
    /// what the model description says too
    pub token: String,
    /// of `Equations`
    pub equations: Vec<u8>,
    pub inputs: Vec<Input>,
    pub outputs: Vec<Output>,
    /// expressions of inputs that keep their sign: with another one the deck has other equations
    pub guards: Vec<(Id, i8)>,
    pub options: Options,
    pub tstep: f64,
    pub tstop: f64,
    pub tmax: Option<f64>,
    /// rows begin here [s]
    pub tstart: f64,
    pub uic: bool,
    /// kind of failure -> the code under which it is explained
    pub codes: BTreeMap<String, String>,
    /// of every flag what it is called
    pub conditions: Vec<String>,
    /// what is to be said when a flag turns to 1, by its number
    pub warnings: BTreeMap<usize, String>,
    /// where the deck keeps them
    pub accounts: Option<Accounts>,
    /// the deck as an explicit ODE, where it was asked for and is one
    pub exchange: Option<Exchange>,
}

/// What model exchange shows of the deck.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Exchange {
    /// rows of the system that are states, with what stores there
    pub states: Vec<State>,
    pub indicators: usize,
    /// are slopes of everything known from the Jacobian?
    pub slopes: bool,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct State {
    pub row: usize,
    /// of the unknown that stores it
    pub of: String,
    pub kind: String,
    pub unit: String,
    pub nominal: f64,
}

impl Packed {
    pub fn bytes(&self) -> Result<Vec<u8>, String> {
        postcard::to_allocvec(self).map_err(|e| e.to_string())
    }

    pub fn read(bytes: &[u8]) -> Result<Packed, String> {
        let here = env!("CARGO_PKG_VERSION");
        match postcard::from_bytes::<Packed>(bytes) {
            Ok(packed) if packed.version == here => Ok(packed),
            Ok(packed) => Err(format!("the model was written by emsim {}, this is {here}", packed.version)),
            Err(e) => Err(format!("the model cannot be read: {e}")),
        }
    }

    pub fn transient(&self) -> Transient {
        let (tstep, tstop, tmax, uic) = (self.tstep, self.tstop, self.tmax, self.uic);
        Transient { tstep, tstop, tstart: 0.0, tmax, uic, begun: false, from: 0.0, until: tstop, drawn: false }
    }

    /// The equations, compiled as for a run with these options, and the graph that the outputs are of.
    pub fn compile(&self) -> Result<(Arc<System>, Graph), String> {
        let (mut graph, model) = self.model()?;
        let mut system = Arc::new(System::compile(model, &mut graph)?);
        if integrate::lowers(&self.options.method) {
            system = system.integrable(&mut graph)?;
        }
        if integrate::reduces(&system, &self.options) {
            system.reduce(&mut graph);
        }
        Ok((system, graph))
    }

    /// The equations as an explicit ODE, for a solver of somebody else's. Err: why they are none.
    pub fn compile_for_others(&self) -> Result<(Arc<System>, Graph), String> {
        let (mut graph, model) = self.model()?;
        let system = Arc::new(System::compile(model, &mut graph)?).integrable(&mut graph)?;
        system.reduce_for_others(&mut graph)?;
        Ok((system, graph))
    }

    /// What model exchange shows. Err: why the deck has none.
    pub fn exchanged(&self) -> Result<Exchange, String> {
        let (system, _) = self.compile_for_others()?;
        let reduced = system.reduced()?;
        let nominals = integrate::nominals(&system, reduced, &self.options);
        let state = |(&row, nominal): (&usize, f64)| {
            let u = &system.unknowns[row];
            State { row, of: u.name.clone(), kind: u.kind.name().into(), unit: u.unit.clone(), nominal }
        };
        // multipliers and shown derivatives follow from rates, which no row of the Jacobian holds
        let slopes = !system.unknowns.iter().any(|u| u.kind.enters_linearly());
        Ok(Exchange {
            states: reduced.states.iter().zip(nominals).map(state).collect(),
            indicators: integrate::watched(&system).len(),
            slopes,
        })
    }

    fn model(&self) -> Result<(Graph, Model), String> {
        let Equations { graph, mut model } = Equations::read(&self.equations)?;
        for input in &self.inputs {
            let wave = model.waves.get_mut(input.wave).filter(|w| w.as_input().is_some());
            let wave = wave.ok_or("an input is none of the model")?;
            if input.varies == Varies::Fixed {
                wave.hold();
            }
        }
        model.place()?;
        Ok((graph, model))
    }
}

impl Equations {
    /// What these two come to.
    pub fn write(graph: &Graph, model: &Model) -> Result<Vec<u8>, String> {
        postcard::to_allocvec(&(graph, model)).map_err(|e| e.to_string())
    }

    pub fn read(bytes: &[u8]) -> Result<Equations, String> {
        let found = postcard::from_bytes(bytes).map_err(|e| format!("the equations cannot be read: {e}"))?;
        let (graph, model) = found;
        Ok(Equations { graph, model })
    }
}
