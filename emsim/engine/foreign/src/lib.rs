//! FMUs of others in a deck: their libraries, FMI 2.0 (two.rs) and 3.0 (three.rs), as one face. (Standard: fmi-standard.org, versions 2.0.4
//! and 3.0.2.) What an FMU is, and which of its variables the deck reads and writes, the deck's side says (`Spec`).
//!
//! A library that crashes ends the process, and the last words say whose it was (crash.rs).
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]
#[cfg(not(target_family = "wasm"))]
mod crash;
pub mod exchange;
#[cfg(not(target_family = "wasm"))]
mod library;
#[cfg(not(target_family = "wasm"))]
mod log;
#[cfg(not(target_family = "wasm"))]
mod three;
#[cfg(not(target_family = "wasm"))]
mod two;
pub mod unit;

use std::sync::Mutex;

/// Types of variables that the deck can read and write, all of them as numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Float64,
    Float32,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
}

impl Kind {
    pub fn named(word: &str) -> Option<Kind> {
        Some(match word {
            "Float64" => Kind::Float64,
            "Float32" => Kind::Float32,
            "Int8" => Kind::Int8,
            "UInt8" => Kind::UInt8,
            "Int16" => Kind::Int16,
            "UInt16" => Kind::UInt16,
            "Int32" => Kind::Int32,
            "UInt32" => Kind::UInt32,
            "Int64" => Kind::Int64,
            "UInt64" => Kind::UInt64,
            "Boolean" => Kind::Boolean,
            _ => return None,
        })
    }
}

/// A variable, by its value reference.
#[derive(Clone, Copy, Debug)]
pub struct Variable {
    pub reference: u32,
    pub kind: Kind,
}

/// What a variable is to be before the FMU is initialised.
#[derive(Clone, Debug)]
pub enum Start {
    Number(Variable, f64),
    Text(u32, String),
}

/// An FMU as a card of the deck uses it.
#[derive(Default)]
pub struct Spec {
    pub card: String,
    pub version: u8,
    pub exchange: bool,
    pub library: String,
    /// the folder of its resources: a path in FMI 3, a URI in FMI 2
    pub resources: String,
    pub token: String,
    pub starts: Vec<Start>,
    pub inputs: Vec<Variable>,
    /// of each input: does it change at events alone
    pub discrete: Vec<bool>,
    pub outputs: Vec<Variable>,
    /// of each output: a number that is no output of the FMU's, whose slopes are differences
    pub rough: Vec<bool>,
    /// of model exchange: value references of the states and of their derivatives
    pub states: Vec<u32>,
    pub derivatives: Vec<u32>,
    pub indicators: usize,
    /// can it be taken back (canGetAndSetFMUState), does it know its derivatives, does it want to hear of completed steps
    pub returns: bool,
    pub differentiates: bool,
    pub hears_steps: bool,
    /// are all its messages told, or those alone that come with a warning or an error
    pub logs: bool,
    pub tolerance: Option<f64>,
    pub stop: f64,
    /// time between two communication points
    pub step: f64,
    /// what a crash says, in front of the function's name; the files and folders that are removed then
    pub last_words: String,
    pub files: Vec<String>,
    pub folders: Vec<String>,
    /// what it has said during runs, in order
    pub told: Mutex<Vec<String>>,
}

impl Spec {
    fn tell(&self, text: String) {
        if let Ok(mut told) = self.told.lock() {
            // (who says more than a thousand things is heard no longer)
            if told.len() < 1000 {
                told.push(text);
            }
        }
    }
}

/// What a step gives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stepped {
    /// fmi..Discard: it came no further than that time
    pub until: Option<f64>,
    pub ends: bool,
}

/// What an event gives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Updated {
    pub again: bool,
    pub ends: bool,
    pub moved: bool,
    pub next: Option<f64>,
}

/// A state that was kept, as the library gave it.
#[derive(Clone, Copy)]
pub struct Handle(*mut std::ffi::c_void);

// SAFETY: only the library looks at what it points to, and calls of an instance are made one at a time
unsafe impl Send for Handle {}
unsafe impl Sync for Handle {}

/// The calls of an instance, alike in both versions. Errors are sentences: which function, its status, what was logged.
pub trait Calls: Send {
    fn set(&mut self, variables: &[Variable], values: &[f64]) -> Result<(), String>;
    fn set_text(&mut self, reference: u32, text: &str) -> Result<(), String>;
    fn get(&mut self, variables: &[Variable], values: &mut [f64]) -> Result<(), String>;
    fn enter_initialisation(&mut self, t: f64) -> Result<(), String>;
    fn exit_initialisation(&mut self) -> Result<(), String>;
    fn step(&mut self, t: f64, h: f64) -> Result<Stepped, String>;
    fn keep(&mut self) -> Result<Handle, String>;
    fn put_back(&mut self, state: Handle) -> Result<(), String>;
    fn release(&mut self, state: Handle);
    /// Has an error ended it?
    fn is_over(&self) -> bool;

    // model exchange
    fn set_time(&mut self, t: f64) -> Result<(), String>;
    fn set_states(&mut self, x: &[f64]) -> Result<(), String>;
    fn states(&mut self, x: &mut [f64]) -> Result<(), String>;
    fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), String>;
    fn indicators(&mut self, z: &mut [f64]) -> Result<(), String>;
    /// (an event is wanted, the end is)
    fn completed(&mut self) -> Result<(bool, bool), String>;
    fn enter_event(&mut self) -> Result<(), String>;
    fn update(&mut self) -> Result<Updated, String>;
    fn enter_continuous(&mut self) -> Result<(), String>;
    /// Derivatives of `unknowns` by `known`.
    fn directional(&mut self, unknowns: &[u32], known: u32, out: &mut [f64]) -> Result<(), String>;
}

/// An instance of its own.
#[cfg(not(target_family = "wasm"))]
pub fn instantiate(spec: &std::sync::Arc<Spec>) -> Result<Box<dyn Calls>, String> {
    match spec.version {
        2 => Ok(Box::new(two::Instance::new(spec)?)),
        _ => Ok(Box::new(three::Instance::new(spec)?)),
    }
}

#[cfg(target_family = "wasm")]
pub fn instantiate(_: &std::sync::Arc<Spec>) -> Result<Box<dyn Calls>, String> {
    Err("a page loads no libraries".into())
}

/// As an integer of its type has it.
#[cfg(not(target_family = "wasm"))]
macro_rules! rounded {
    ($type:ty, $value:expr) => {
        // (beyond its bounds the nearest there is; a number that is none is 0)
        $value.round() as $type
    };
}
#[cfg(not(target_family = "wasm"))]
use rounded;

/// Stretches of variables of one type.
fn runs(variables: &[Variable]) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for (k, variable) in variables.iter().enumerate() {
        match found.last_mut() {
            Some(last) if variables[last.start].kind == variable.kind => last.end = k + 1,
            _ => found.push(k..k + 1),
        }
    }
    found
}
