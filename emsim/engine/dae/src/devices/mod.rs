//! Devices: what carries current and charge between nodes by a law of the voltages between them.
//!
//! To add one: write `devices/<name>.rs` with a type that implements `Device`, and put it into `REGISTRY`. The file says
//!
//!   SPEC                what a deck's .model card and the element may give (read by the checks, hover and reference pages)
//!   PORTS, BRANCHES     between which nodes its law reads voltages, and between which its currents and charges go
//!   card                the constants of one instance at its temperature, area and m; errors are sentences for the user
//!   law                 currents and charges of the branches, once, over any number (number.rs); no derivative is written
//!   limit, start        where Newton's method may be deceived: voltages to use in place of those it asks for, and its first ones
//!
//! and, where the defaults do not hold, the rest of `Device`. Matrix places, derivatives, four instances at a time, sums of floating
//! floating groups, explicit methods, energy accounts, the choice of a method and error messages need nothing more: they ask `Class`
//! (class.rs), which `Instances` implements for every `Device`, and `Compiled` (compiled.rs) for every module of Verilog-A.
/// Numbers 0, 1, ... for the constants of a card.
macro_rules! constants {
    ($($(#[$about:meta])* $name:ident),* $(,)?) => {
        constants!(@ 0_usize; $($(#[$about])* $name)*);
    };
    (@ $n:expr; $(#[$about:meta])* $name:ident $($rest:tt)*) => {
        $(#[$about])* pub const $name: usize = $n;
        constants!(@ $n + 1; $($rest)*);
    };
    (@ $n:expr;) => {
        /// How many there are.
        pub const CONSTANTS: usize = $n;
    };
}

pub mod class;
pub mod compiled;
pub mod diode;
pub mod foreign;
pub mod limits;
pub mod number;
pub mod shape;

pub use class::{Class, Facts, Instances, Layout, Line, Met, Near, Number, Seat, Shape, LANES};
use number::{Lane, Real};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Every device, by the word of its .model card.
#[rustfmt::skip]
pub const REGISTRY: &[&(dyn Maker + Sync)] = &[
    // one line each
    &Of::<diode::Diode, 1, 1, { diode::CONSTANTS }>::NEW,
];

/// A parameter: names (the first is the one used here), unit, default, meaning.
pub struct Parameter {
    pub names: &'static [&'static str],
    pub unit: &'static str,
    pub default: f64,
    pub meaning: &'static str,
}

pub const fn p(names: &'static [&'static str], unit: &'static str, default: f64, meaning: &'static str) -> Parameter {
    Parameter { names, unit, default, meaning }
}

/// What a deck can say of a device.
pub struct Spec {
    /// as the class is asked for: the word of .model
    pub name: &'static str,
    pub terminals: &'static [&'static str],
    /// Nodes of its own, numbered behind the terminals.
    pub inner: &'static [Inner],
    pub model: &'static [Parameter],
    pub instance: &'static [Parameter],
}

/// A node behind a resistance at a terminal; where that is zero the two are one.
pub struct Inner {
    pub name: &'static str,
    pub behind: usize,
}

/// What was given, by lower-case names, and what is meant by it. Names that are not in the table have no effect.
pub struct Given<'a> {
    values: &'a HashMap<String, f64>,
    table: &'static [Parameter],
}

impl<'a> Given<'a> {
    pub fn new(values: &'a HashMap<String, f64>, table: &'static [Parameter]) -> Self {
        Given { values, table }
    }

    /// Value of a parameter by any of its names, or its default: NaN marks one that depends on something else (see `OrElse`).
    pub fn get(&self, name: &str) -> f64 {
        let parameter = self.table.iter().find(|p| p.names[0] == name).expect("a name from the table");
        parameter.names.iter().find_map(|alias| self.values.get(*alias).copied()).unwrap_or(parameter.default)
    }
}

/// NaN marks a default that depends on something else.
pub trait OrElse {
    fn or(self, other: f64) -> f64;
}

impl OrElse for f64 {
    fn or(self, other: f64) -> f64 {
        if self.is_nan() {
            other
        } else {
            self
        }
    }
}

/// Temperatures of the circuit [C].
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Climate {
    pub temp: f64,
    pub tnom: f64,
}

/// An instance at its temperature: its constants, and which parts of the law it has. Four instances that go together have the parts
/// of any of them; the constants of a part that one of them lacks must make nothing of it.
#[derive(Clone, Debug)]
pub struct Card<const K: usize> {
    pub has: u32,
    pub of: [f64; K],
}

/// Constants as a law reads them.
pub trait Constants<C> {
    fn at(&self, k: usize) -> C;
}

impl<const K: usize> Constants<f64> for [f64; K] {
    #[inline(always)]
    fn at(&self, k: usize) -> f64 {
        self[k]
    }
}

/// Currents [A] and charges [C] of the branches.
pub struct Flow<R, const B: usize> {
    pub i: [R; B],
    pub q: [R; B],
}

/// A device with P port voltages, B branches, K constants.
pub trait Device<const P: usize, const B: usize, const K: usize>: Send + Sync + 'static {
    const SPEC: Spec;
    /// The voltages that the law reads, from node to node: terminals first, then inner nodes.
    const PORTS: [(usize, usize); P];
    /// Where current and charge go: out of the first node, into the second.
    const BRANCHES: [(usize, usize); B];
    /// Nothing but a two-pole that neither makes energy nor amplifies: one branch across its own port, whose conductance and
    /// capacitance are never negative.
    const PASSIVE: bool = false;

    fn card(model: &Given, instance: &Given, at: Climate) -> Result<Card<K>, String>;

    /// Conductance between inner node k and the terminal it lies behind; None where the two are one.
    fn series(_card: &Card<K>, _k: usize) -> Option<f64> {
        None
    }

    /// The device's physics, for any finite voltages. `has`: which parts of it are there. gmin [S] is to lie across each junction.
    fn law<R: Real>(c: &impl Constants<R::Const>, has: u32, v: [R; P], gmin: R::Const) -> Flow<R, B>;

    /// Moves port voltages that a Newton step from `old` must not reach; true where one was moved.
    fn limit(_card: &Card<K>, _new: &mut [f64; P], _old: &[f64; P]) -> bool {
        false
    }

    /// A change of port voltages that `limit` never moves, told quickly. False is always right.
    #[inline(always)]
    fn quiet<L: Lane>(_c: &impl Constants<L>, new: [L; P], _old: [L; P]) -> L::Mask {
        // (never less than itself)
        new[0].lt(new[0])
    }

    /// Where Newton's method starts, whatever the nodes' voltages are. (`off` and `ic` are parameters of the instance: a card that knows
    /// them keeps for this what they say.)
    fn start(_card: &Card<K>) -> [f64; P] {
        [0.0; P]
    }

    /// Over how many volts at port k an exponential current changes by a factor of e; infinite where none hangs on it.
    fn bend(_card: &Card<K>, _k: usize) -> f64 {
        f64::INFINITY
    }

    /// Energy of the charges at these port voltages [J], where there is a closed form; else the integral of v dq is taken
    /// along a straight line from 0 V.
    fn energy(_card: &Card<K>, _v: &[f64; P], _gmin: f64) -> Option<f64> {
        None
    }

    /// What `@name[word]` shows besides currents, charges and their slopes.
    fn output(_card: &Card<K>, _word: &str, _v: &[f64; P], _at: &Line) -> Option<f64> {
        None
    }

    /// Its sources of noise at an operating point, those of series resistances aside.
    fn noise(_card: &Card<K>, _at: &Line, _each: &mut dyn FnMut(Noise)) {}
}

/// A current of noise.
#[derive(Clone, Copy, Debug)]
pub struct Noise<'a> {
    /// as columns show it behind the instance's name; a name may come twice, and means the sum
    pub name: &'a str,
    /// nodes of the instance: terminals first, then inner ones; any other number is ground
    pub from: usize,
    pub to: usize,
    /// power density [A^2/Hz] at 1 Hz; it falls with frequency to the exponent
    pub power: f64,
    pub exponent: f64,
}

/// Makes classes without instances.
pub trait Maker {
    fn spec(&self) -> &'static Spec;
    fn class(&self) -> Box<dyn Class>;
}

/// The maker of a `Device`.
pub struct Of<D, const P: usize, const B: usize, const K: usize>(std::marker::PhantomData<fn() -> D>);

impl<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize> Of<D, P, B, K> {
    pub const NEW: Self = Of(std::marker::PhantomData);
    const SPEC: &'static Spec = &D::SPEC;
}

impl<D: Device<P, B, K>, const P: usize, const B: usize, const K: usize> Maker for Of<D, P, B, K> {
    fn spec(&self) -> &'static Spec {
        Self::SPEC
    }

    fn class(&self) -> Box<dyn Class> {
        Box::new(Instances::<D, P, B, K>::new())
    }
}

/// The device of that name.
pub fn maker(name: &str) -> Option<&'static (dyn Maker + Sync)> {
    REGISTRY.iter().copied().find(|m| m.spec().name == name)
}
