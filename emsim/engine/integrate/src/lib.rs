//! Integrators, one file each, all on equation (1).
//!
//! The contract of a method:
//!  1. `restart` forgets all history; (t, x) is consistent and may follow a discontinuity.
//!  2. `attempt` computes a candidate at t + h and its error in units of the tolerance; it changes nothing that a later
//!     `attempt` from the same point needs.
//!  3. `accept` makes the candidate the new point, at the driver's time (a compensated sum: t + h rounds the same way
//!     each time, and a million equal steps would be late by more than their error).
//!  4. `dense` evaluates the candidate's (or the accepted) step anywhere inside it, with the method's own polynomial.
//!  5. `candidate` is the state at the end of the attempted step.
//!
//! The length of a step of radau, the diagonally implicit methods and gauss is `Controller`'s to choose (control.rs), from the error
//! that the method finds; trap, gear and the explicit methods choose their own.
//!
//! `character` says what the method is like, `Response` what its formulas do to an oscillation. Whoever asks for more than that asks an
//! optional function, which answers for a method that has nothing to say. `auto` is one more method (auto.rs).
mod auto;
mod control;
mod dirk;
mod driver;
mod explicit;
mod gauss;
mod gear;
mod independent;
mod monitor;
mod multirate;
mod oscillation;
mod radau;
mod response;
mod rows;
mod session;
mod split;
mod trap;

pub use driver::{Failed, Outcome, Status, Tick, Transient};
pub use independent::{run as run_independent, Part};
pub use monitor::Report;
pub use multirate::pays;
pub use session::{nominals, watched, Exchange, Place, Session, Stood};

use emsim_sparse as sparse;
use {emsim_dae::*, emsim_expr::*};

use crate::ledger::Stages;
use crate::newton::{Failure, Options, Tolerances};
use crate::record::Record;
use crate::sparse::Complex;
use crate::system::{System, Work};
pub use rows::undetermined;
use rows::Lags;

/// What came of one attempted step.
pub enum Attempt {
    /// error <= 1; the step that would have met the tolerance
    Good { next: f64 },
    /// error > 1; try this one instead
    TooLarge { next: f64 },
    /// Newton's method gave up
    Stuck { next: f64, why: Box<Failure> },
}

impl Attempt {
    /// Length of what is to be tried next.
    pub fn next(&self) -> f64 {
        match *self {
            Attempt::Good { next } | Attempt::TooLarge { next } | Attempt::Stuck { next, .. } => next,
        }
    }
}

/// The transient analysis.
pub fn run(sys: &System, w: &mut Work, a: Transient, o: &Options, record: &mut Record, tick: &mut Tick) -> Outcome {
    if splits(&o.method) {
        return multirate::run(sys, w, a, o, record, tick);
    }
    driver::run(sys, w, a, o, record, tick)
}

/// What a method is like, said once: all that the driver, the rows, the monitor and `auto` go by.
#[derive(Clone, Copy, Debug)]
pub struct Character {
    /// No step is longer than the run over so many, where the deck does not say: every part of the run is to be seen.
    pub fewest_steps: f64,
    /// Steps without which, in a period of a source, diodes turn unseen between them.
    pub steps_a_period: Option<f64>,
    /// A step may reach from one corner of a source to the next (the error estimate needs no second step behind it).
    pub full_length: bool,
    /// A step goes on from the slopes at its start, as from a stage: what follows from slopes there has to be theirs.
    pub begins_with_slopes: bool,
    /// The method starts anew at the corners of sources; one-step methods of high order need not.
    pub restarts_at_corners: bool,
    /// Output between internal points belongs into the record (methods whose steps are long).
    pub dense_record: bool,
    /// Parts of a step, so that the points between them and its end show the fastest oscillation that it follows.
    pub pieces: usize,
    /// Parts of a step, so that a curve drawn through the points between them follows it.
    pub shown: usize,
    /// The first step behind a jump may leap over a transient: it is tried as long as others, now and then.
    pub leaps: bool,
    /// What is not as good as the state: rows that show it compute it anew.
    pub lags: Lags,
    /// So many steps take nothing of an oscillation that is worth a word, whatever their length: they need not be watched.
    pub faithful: u64,
}

impl Character {
    /// A method of short steps, whose ends are its rows.
    pub const PLAIN: Character = Character {
        fewest_steps: 10.0,
        steps_a_period: None,
        full_length: false,
        begins_with_slopes: false,
        restarts_at_corners: true,
        dense_record: false,
        pieces: 1,
        shown: 1,
        leaps: false,
        lags: Lags::Nothing,
        faithful: 0,
    };
    /// A method with dense output, whose rows lie where they are asked for.
    pub const DENSE: Character = Character { dense_record: true, pieces: 2, ..Character::PLAIN };
}

/// What keeps a step from being longer, other than its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    None,
    /// Estimate of h |lambda| over the bound of the method's stability, lambda being the fastest eigenvalue: from 1 on stability, not
    /// accuracy, limits the step.
    Stability(f64),
    /// Closed loops came near a loss of rank.
    Rank,
}

/// What the monitor (monitor.rs) asks: what a step does to an oscillation.
pub trait Response {
    /// Which of the method's formulas took the last accepted step: an order, a number of stages.
    fn formula(&self) -> usize {
        0
    }
    /// R(j y), what a formula does to an undamped oscillation of y radians a step (response.rs).
    fn response(&self, _formula: usize, _y: f64) -> Option<Complex> {
        None
    }
    /// The same a second, of a formula whose points lie where the last steps put them, times newest first, on exp(j w t): what it
    /// takes of the amplitude (ln) and how late it makes it (radians).
    fn drift(&self, _formula: usize, _times: &[f64], _w: f64) -> Option<(f64, f64)> {
        None
    }
}

pub trait Method: Response {
    fn character(&self) -> &Character;
    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]);
    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt;
    fn accept(&mut self, t1: f64);
    fn candidate(&self) -> &[f64];
    fn dense(&self, t: f64, out: &mut [f64]);
    /// Error of the dense output inside the candidate step, in units of the tolerance. Above 1 the driver ends the step at
    /// a point that is asked for, rather than interpolate it.
    fn interior(&mut self, _sys: &System, _tol: &Tolerances) -> f64 {
        0.0
    }
    /// The states that the accepted step was computed by; none where dense output knows as much.
    fn stages(&self) -> Stages<'_> {
        Stages::default()
    }
    /// Length of the run's first step, for which `first` is said to be short enough.
    fn begin(&mut self, _sys: &System, _w: &mut Work, first: f64, _tol: &Tolerances) -> f64 {
        first
    }
    /// Takes x, of which something has jumped at t, to what it is at t + h, h next to nothing; or, h 0, to what fits its states where
    /// a run starts. False: it is as it was.
    fn settle(&mut self, _sys: &System, _w: &mut Work, _t: f64, _h: f64, _x: &mut [f64]) -> bool {
        false
    }
    /// Sources bend, or functions of time that the equations read have changed, at the accepted point, and nothing restarts there.
    fn corner(&mut self) {}
    /// Of the last steps.
    fn limit(&self) -> Limit {
        Limit::None
    }
    /// The driver would give up at the present point x: the length of the step to try instead, where another way is left.
    fn fallback(&mut self, _w: &mut Work, _x: &[f64]) -> Option<f64> {
        None
    }
    /// Which methods did the work, from when on and why, where it is a choice.
    fn used(&self) -> Vec<Used> {
        Vec::new()
    }
}

/// A method that took over at t.
#[derive(Clone, Debug)]
pub struct Used {
    pub t: f64,
    pub method: String,
    pub why: String,
}

/// Who makes a method, and what help tells of it: order, kind, what it is for.
type Maker = for<'a> fn(&'a System, &Options) -> Result<Box<dyn Method + 'a>, Failure>;
type Told = [&'static str; 3];
/// The methods by their names, the first of them its own. To add one: a file here, and its line.
#[rustfmt::skip]
const REGISTRY: &[(&[&str], Told, Maker)] = &[
    (&["auto"], ["-", "chooses", "the default: explicit where nothing is stiff, implicit otherwise, and changes on the way"],
     |sys, o| Ok(Box::new(auto::Auto::new(sys, o)?))),
    (&["trap", "trapezoidal"], ["2", "trapezoidal rule, A-stable, keeps every oscillation and every ringing", "what SPICE does"],
     |sys, o| Ok(Box::new(trap::Trap::new(sys, o)?))),
    (&["gear", "bdf"], ["1 to 5", "backward differentiation; damps", "driven nonlinear circuits; maxord=2 is SPICE's other method"],
     |sys, o| Ok(Box::new(gear::Gear::new(sys, o)?))),
    (&["radau"], ["5, 9 or 13", "collocation, L-stable", "accuracy; linear circuits; stiff machines; closed loops"],
     |sys, o| Ok(Box::new(radau::Radau::new(sys, o, "radau")?))),
    (&["radau5"], ["5", "radau of one order", "comparisons"], |sys, o| Ok(Box::new(radau::Radau::new(sys, o, "radau5")?))),
    (&["radau9"], ["9", "radau of one order", "comparisons"], |sys, o| Ok(Box::new(radau::Radau::new(sys, o, "radau9")?))),
    (&["radau13"], ["13", "radau of one order", "comparisons"], |sys, o| Ok(Box::new(radau::Radau::new(sys, o, "radau13")?))),
    (&["trbdf2"], ["2", "one step, L-stable", "circuits of diodes at loose tolerances"], |sys, o| Ok(Box::new(dirk::trbdf2(sys, o)?))),
    (&["esdirk"], ["4", "one step, L-stable", "switches and diodes"], |sys, o| Ok(Box::new(dirk::esdirk(sys, o)?))),
    (&["gauss"], ["4 or 6", "collocation, symmetric, steps of one length", "energy over 100 000 periods"],
     |sys, o| Ok(Box::new(gauss::Gauss::new(sys, o)?))),
    (&["gauss4"], ["4", "gauss of one order", "comparisons"], |sys, o| Ok(Box::new(gauss::Gauss::new(sys, o)?))),
    (&["gauss6"], ["6", "gauss of one order", "comparisons"], |sys, o| Ok(Box::new(gauss::Gauss::new(sys, o)?))),
    (&["rk45", "dopri5"], ["5", "explicit", "lossless circuits whose sources have corners, loose tolerances"],
     |sys, o| Ok(Box::new(explicit::Explicit::new(sys, o, &explicit::RK45)?))),
    (&["dop853"], ["8", "explicit", "machines that are not stiff, many digits"],
     |sys, o| Ok(Box::new(explicit::Explicit::new(sys, o, &explicit::DOP853)?))),
];
/// It is no method of one system but two of them: multirate/ runs it.
const TWO_PACES: (&[&str], Told) = (&["multirate"], ["5 and 4", "two paces", "a slow machine beside a fast circuit"]);

pub fn make<'a>(sys: &'a System, o: &Options, name: &str) -> Result<Box<dyn Method + 'a>, Failure> {
    let known = REGISTRY.iter().find(|(names, ..)| names.contains(&name));
    let (.., make) = known.ok_or_else(|| Failure::Unfit { why: format!("there is no method `{name}`") })?;
    make(sys, o)
}

/// Every method: its names, and what help tells of it.
pub fn methods() -> impl Iterator<Item = (&'static [&'static str], Told)> {
    REGISTRY.iter().map(|&(names, told, _)| (names, told)).chain([TWO_PACES])
}

pub fn known(method: &str) -> bool {
    methods().any(|(names, _)| names.contains(&method))
}

/// Does the run need the equations as an explicit ODE (`System::reduce`)?
pub fn reduces(sys: &System, o: &Options) -> bool {
    match o.method.as_str() {
        "auto" => auto::reduces(sys, o),
        name => matches!(name, "rk45" | "dop853"),
    }
}

/// Does the method integrate equations whose hidden constraints were put in? Those that damp nothing keep what is not quite met, and
/// refuse such equations by name.
pub fn lowers(method: &str) -> bool {
    !matches!(method, "rk45" | "dopri5" | "dop853" | "gauss" | "gauss4" | "gauss6") && !splits(method)
}

/// Does the method need circuit and machine apart (`System::split`)?
pub fn splits(method: &str) -> bool {
    method == "multirate"
}

/// Past points, newest first: t and x. A small ring without allocation after the start.
pub struct History {
    pub t: Vec<f64>,
    pub x: Vec<Vec<f64>>,
    pub len: usize,
}

impl History {
    pub fn new(n: usize, capacity: usize) -> History {
        History { t: vec![0.0; capacity], x: vec![vec![0.0; n]; capacity], len: 0 }
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }

    pub fn push(&mut self, t: f64, x: &[f64]) {
        self.t.rotate_right(1);
        self.x.rotate_right(1);
        self.t[0] = t;
        self.x[0].copy_from_slice(x);
        self.len = (self.len + 1).min(self.t.len());
    }
}

/// The root of this degree: in a short run a power would cost as much as a stage.
pub fn root(x: f64, degree: usize) -> f64 {
    match degree {
        2 => x.sqrt(),
        3 => x.cbrt(),
        4 => x.sqrt().sqrt(),
        6 => x.sqrt().cbrt(),
        8 => x.sqrt().sqrt().sqrt(),
        _ => x.powf(1.0 / degree as f64),
    }
}

/// out = sum of rows, with a weight each.
pub fn weighted_sum<'a>(terms: impl IntoIterator<Item = (f64, &'a [f64])>, out: &mut [f64]) {
    out.fill(0.0);
    for (weight, row) in terms {
        for (o, v) in out.iter_mut().zip(row) {
            *o += weight * v;
        }
    }
}

/// The polynomial through (t_k, x_k), evaluated at t by Lagrange's weights, for dense output.
pub fn interpolate(ts: &[f64], xs: &[&[f64]], t: f64, out: &mut [f64]) {
    let weight = |j: usize| {
        // products may be as small as the seventh power of a step; one division each
        let others = ts.iter().enumerate().filter(|&(k, _)| k != j);
        let (above, below) =
            others.fold((1.0, 1.0), |(above, below), (_, tk)| (above * (t - tk), below * (ts[j] - tk)));
        above / below
    };
    weighted_sum(xs.iter().enumerate().map(|(j, x)| (weight(j), *x)), out);
}
