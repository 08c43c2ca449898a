//! What a module comes to once parameters, geometry and temperature are known: currents, charges and limits as expressions of
//! voltages. The elaborator makes it, a class of devices runs it; neither knows more of the other.
use emsim_expr::graph::{Graph, Id, Node};
use serde::{Deserialize, Serialize};

/// The other end of a port or flow that ends at the reference node.
pub const GROUND: usize = usize::MAX;
/// `Node::Symbol` of the smallest conductance that lies across junctions ($simparam("gmin")), [S].
pub const GMIN: u32 = 0;
/// `Node::Symbol` of the factor that sources are multiplied with while an operating point is looked for ($simparam("sourceScaleFactor")).
pub const SOURCE_SCALE: u32 = 1;

/// What analysis("name") knows: "static" is an operating point of any of them, "ic" that of a transient. Each is a symbol, 1 or 0.
pub const ANALYSES: &[&str] = &["static", "dc", "tran", "ac", "noise", "ic", "nodeset"];
/// Symbols below this have a meaning; no other is left in what is handed over.
pub const SYMBOLS: u32 = SOURCE_SCALE + 1 + ANALYSES.len() as u32;

/// The symbol of an analysis.
pub fn symbol_of(analysis: &str) -> Option<u32> {
    (SOURCE_SCALE + 1..).zip(ANALYSES).find(|a| *a.1 == analysis).map(|a| a.0)
}

/// The analysis of a symbol.
pub fn analysis_of(symbol: u32) -> Option<&'static str> {
    ANALYSES.get(symbol.checked_sub(SOURCE_SCALE + 1)? as usize).copied()
}

/// One instance. Expressions read port k as `Node::Unknown(k)`, time as `Node::Time`, mode k as `Node::Flag(k)` and the small signal of
/// ac_stim k as `Node::Wave(k)`. Nothing else is free: every parameter is a constant. Conditions are `Select` and comparisons as
/// values; which of them are events is for who runs it to say.
#[derive(Clone, Serialize, Deserialize)]
pub struct Folded {
    pub graph: Graph,
    /// Terminals first, in the order of the module's ports, then inner nodes and unknown currents.
    pub unknowns: Vec<Unknown>,
    pub terminals: usize,
    /// Pairs of unknowns that are one (branches whose potential is contributed as 0: a series resistance of 0).
    pub merged: Vec<(usize, usize)>,
    /// What expressions read: the potential from one unknown to another; of an unknown current (k, GROUND).
    pub ports: Vec<Port>,
    /// What goes from the row of one unknown to that of another; in the row of an unknown current (k, GROUND) it is what must be 0.
    pub flows: Vec<Flow>,
    pub noise: Vec<Noise>,
    /// Sources of noise, by name, whose power is multiplied with that of a table (noise_table).
    pub noise_tables: Vec<NoiseTable>,
    /// Unknowns that an operating point holds at a value in place of their rows (`idt` with an initial value).
    pub starts: Vec<(usize, f64)>,
    pub modes: Vec<Mode>,
    /// Does anything read time, the kind of analysis, a mode or a small signal?
    pub behaves: bool,
    /// Amplitudes of ac_stim, real and imaginary.
    pub stimuli: Vec<(f64, f64)>,
    /// Variables of the module with a description: operating-point values.
    pub outputs: Vec<Output>,
    /// The longest step that the module allows ($bound_step) [s].
    pub bound_step: Option<Id>,
    /// What $warning, $strobe and the like said while nothing but parameters decided.
    pub said: Vec<String>,
    /// Tasks that are not carried out, for voltages decide whether they are reached.
    pub left_out: Vec<String>,
}

impl Folded {
    /// Is it a leaf that devices do not know?
    pub fn is_foreign(node: Node) -> bool {
        match node {
            Node::Time | Node::Flag(_) | Node::Wave(_) => true,
            Node::Symbol(k) => k != GMIN && k != SOURCE_SCALE,
            _ => false,
        }
    }
}

/// What changes at events alone, or was known before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mode {
    /// 1 while the expression is above 0, else 0
    Above(Id),
    /// the expression as it was just before the last event; 0 before there was one
    Kept(Id),
    /// the expression so many seconds ago
    Late(Id, f64),
    /// the greatest whole number that is not above the expression
    Floor(Id),
}

impl Mode {
    pub fn of(self) -> Id {
        match self {
            Mode::Above(e) | Mode::Kept(e) | Mode::Late(e, _) | Mode::Floor(e) => e,
        }
    }

    /// The same of another expression.
    pub fn with(self, e: Id) -> Mode {
        match self {
            Mode::Above(_) => Mode::Above(e),
            Mode::Kept(_) => Mode::Kept(e),
            Mode::Late(_, by) => Mode::Late(e, by),
            Mode::Floor(_) => Mode::Floor(e),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    pub name: String,
    pub kind: Kind,
}

/// Disciplines that have a name of their own here; the rest are "other".
pub const DISCIPLINES: &[&str] =
    &["thermal", "magnetic", "kinematic", "kinematic_v", "rotational", "rotational_omega", "other"];

/// The discipline of that name.
pub fn discipline(name: &str) -> &'static str {
    DISCIPLINES.iter().find(|known| **known == name).copied().unwrap_or("other")
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(into = "String")]
pub enum Kind {
    /// a node: its row is Kirchhoff's current law
    Voltage,
    /// a current of a branch whose potential is given, or an implicit variable: its row is an equation of its own
    Current,
    /// a node of another discipline (thermal, rotational, ...): named by the discipline
    Other(&'static str),
}

impl From<Kind> for String {
    fn from(kind: Kind) -> String {
        match kind {
            Kind::Voltage => "voltage".into(),
            Kind::Current => "current".into(),
            Kind::Other(name) => name.into(),
        }
    }
}

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Kind, D::Error> {
        Ok(match String::deserialize(d)?.as_str() {
            "voltage" => Kind::Voltage,
            "current" => Kind::Current,
            name => Kind::Other(discipline(name)),
        })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Port {
    pub from: usize,
    pub to: usize,
    /// It is read through $limit: Newton's steps of this port are limited, and what is read is where limiting left it.
    pub limit: Option<Limit>,
}

/// A limiting function with its arguments, which are constants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    pub function: String, // pnjlim, fetlim, limvds, limitlog
    pub arguments: Vec<f64>,
}

/// Current i + dq/dt from the row of `from` to that of `to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flow {
    pub from: usize,
    pub to: usize,
    pub i: Id,
    pub q: Id,
}

/// A current of noise from `from` to `to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    pub from: usize,
    pub to: usize,
    pub name: String,
    /// power density [A^2/Hz]; with an exponent it is that at 1 Hz and falls with frequency to it
    pub power: Id,
    pub exponent: Option<Id>,
}

/// Power densities over frequency, as noise_table has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseTable {
    pub name: String,
    /// frequency [Hz] and power density [A^2/Hz], ascending
    pub points: Vec<(f64, f64)>,
    /// straight lines between logarithms of both
    pub logarithmic: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    pub name: String,
    pub unit: String,
    pub meaning: String,
    pub value: Id,
}

/// What a module says of itself: for checks of a .model card, help, hover and the reference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    pub module: String,
    pub meaning: String,
    pub terminals: Vec<String>,
    /// of each terminal; empty where it has none
    pub disciplines: Vec<String>,
    pub parameters: Vec<Parameter>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub names: Vec<String>, // the first is the module's own, the rest are aliases
    pub unit: String,
    pub meaning: String,
    /// None where it hangs on others
    pub default: Option<f64>,
    /// (* type="instance" *): may stand on the element's line as well
    pub instance: bool,
    pub integer: bool,
    pub text: bool,
}
