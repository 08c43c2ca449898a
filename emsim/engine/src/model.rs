//! What the cards contribute to equation (1), before it is compiled: see `system`.
use crate::devices::diode::Diode;
use crate::graph::Id;
use crate::waves::Wave;
use std::collections::BTreeMap;

/// What an unknown is: its tolerance, and whether the DC operating point holds it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Node,
    Branch,
    Coordinate,
    Speed,
    Lambda,
    Mu,
    Derivative,
}

impl Kind {
    pub fn from_name(name: &str) -> Option<Kind> {
        Some(match name {
            "node" => Kind::Node,
            "branch" => Kind::Branch,
            "coordinate" => Kind::Coordinate,
            "speed" => Kind::Speed,
            "lambda" => Kind::Lambda,
            "mu" => Kind::Mu,
            "derivative" => Kind::Derivative,
            _ => return None,
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Kind::Node => "node",
            Kind::Branch => "branch",
            Kind::Coordinate => "coordinate",
            Kind::Speed => "speed",
            Kind::Lambda => "lambda",
            Kind::Mu => "mu",
            Kind::Derivative => "derivative",
        }
    }

    /// Multipliers and derivatives: linear in the equations, outside every norm.
    pub fn enters_linearly(self) -> bool {
        matches!(self, Kind::Lambda | Kind::Mu | Kind::Derivative)
    }

    /// Held at its initial value while the circuit's DC point is found.
    pub fn mechanical(self) -> bool {
        matches!(self, Kind::Coordinate | Kind::Speed | Kind::Lambda | Kind::Mu)
    }
}

#[derive(Clone, Debug)]
pub struct Unknown {
    pub name: String,
    pub kind: Kind,
    pub unit: String,
    pub initial: f64,
}

/// 0/1 state held between events: becomes 1 when `up` > 0, 0 when `down` < 0. Between the two it is what it was: at the start
/// of a run from given values `initial`, at the operating point `rest`; -1 where nothing is said.
#[derive(Clone, Debug)]
pub struct FlagSpec {
    pub up: Id,
    pub down: Id,
    pub name: String,
    pub initial: i8,
    pub rest: i8,
}

pub struct DiodeAt {
    pub name: String,
    pub kernel: Diode,
    pub p: i32,
    pub n: i32,
}

/// Node voltages forced at the operating point (`.ic`) or only suggested (`.nodeset`).
#[derive(Clone, Copy)]
pub struct Force {
    pub row: usize,
    pub value: f64,
    pub release: bool, // nodeset: released before the final solution
}

/// Contributions, as the cards make them.
#[derive(Default)]
pub struct Model {
    pub unknowns: Vec<Unknown>,
    pub waves: Vec<Wave>,
    pub g: Vec<(usize, usize, f64)>,
    pub c: Vec<(usize, usize, f64)>,
    pub f_wave: Vec<(usize, usize, f64)>,
    pub f: BTreeMap<usize, Id>,
    pub q: BTreeMap<usize, Id>,
    pub diodes: Vec<DiodeAt>,
    pub flags: Vec<FlagSpec>,
    pub forces: Vec<Force>,
    pub ic_charge: Vec<(usize, f64)>,
}
