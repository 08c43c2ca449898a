//! What a run holds of a system: scratch, state between steps, what is to be told of a point at rest.
use super::*;

/// Scratch and held state of one run.
pub struct Work {
    pub waves: Vec<f64>,
    pub flags: Vec<f64>,
    /// kinks that no event follows for a while: functions of the point that is evaluated, in every iteration
    pub free: Vec<usize>,
    pub(super) standing: Standing,
    pub(super) scale: Scale,
    pub(super) wave_time: f64,
    pub(super) before: f64, // from here on sources have the value before their jump: what lies at a step's end
    /// values that another system gives, in place of the last waves
    pub exchanged: ExchangedInputs,
    /// ... and those that the past gives
    pub past: Past,
    /// unknowns and flags that a run begins with, in place of an operating point
    pub begin: Option<(Vec<f64>, Vec<f64>)>,
    /// ... and Q there, where other equations have left it
    pub charges: Option<Vec<f64>>,
    /// flags that end a run when they turn to 1, or whenever they turn
    pub halts: Vec<(usize, bool)>,
    /// steps end at the corners of silent sources too
    pub every_corner: bool,
    /// digital nodes, whose levels and ramps are waves
    pub logic: Live,
    /// signals of clocks, which are waves
    pub clocked: clocked::Live,
    pub source_factor: f64,
    pub dc: bool, // independent sources at their DC value
    /// ... but for these, with the value that a sweep gives them
    pub given: Vec<(usize, f64)>,
    pub gmin: f64,
    pub(super) programs: Programs,
    pub q: Vec<f64>,
    pub f: Vec<f64>,
    pub gv: Vec<f64>,
    pub cv: Vec<f64>,
    pub ports: Vec<f64>, // port voltages of devices that limiting holds
    pub(super) edges: EdgeWork,
    pub(super) asked: Vec<f64>,
    pub(super) linear: Linear,
    pub(super) lines: Vec<f64>, // devices as straight lines, see `devices::Layout`
    pub limited: bool,
    /// devices that are off at the start carry nothing
    pub without_off: bool,
    pub(super) where_finite: bool, // what expressions give that is not finite is left out
    pub doubts: Doubts,
    pub counters: Counters,
}

/// What programs have computed last.
pub(super) struct Programs {
    pub(super) values: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
    pub(super) roots: Vec<f64>,
}

/// What is to be told of a point at rest.
#[derive(Default)]
pub struct Doubts {
    /// a rest that does not stay: an operating point, the start of a run, or its end
    pub unstable: Option<Unstable>,
    /// a run begins where this condition, as it is held, is not what it says: there is no operating point (op.rs)
    pub substitute: Option<(usize, bool)>,
    /// of the operating point that was found last: the node that only gmin holds
    pub hanging: Option<Hanging>,
}

/// What a run holds between steps beside its state.
#[derive(Clone)]
pub struct Held {
    pub(super) flags: Vec<f64>,
    pub(super) standing: Standing,
    pub(super) ports: Vec<f64>,
    pub(super) edges: EdgeWork,
    pub(super) logic: Live,
    pub(super) clocked: clocked::Live,
}

impl Work {
    pub fn held(&self) -> Held {
        Held {
            flags: self.flags.clone(),
            standing: self.standing.clone(),
            ports: self.ports.clone(),
            edges: self.edges.clone(),
            logic: self.logic.clone(),
            clocked: self.clocked.clone(),
        }
    }

    /// Does the stretch between the sources' corners end before t?
    pub fn ends_before(&self, t: f64) -> bool {
        t > self.before
    }

    /// From t on, sources have the value before their jumps: t ends a step.
    pub fn until(&mut self, t: f64) {
        self.before = t * (1.0 - 8.0 * f64::EPSILON);
        self.wave_time = f64::NAN;
    }

    /// The values at the start are given: see `Standing::given`.
    pub fn start_from_given(&mut self) {
        self.standing.given = true;
    }

    pub fn hold_flag(&mut self, flag: Option<usize>) {
        self.standing.stuck = flag;
    }

    /// Conditions, and sources at t, as in `other`, for a look at the equations beside the run.
    pub fn follow(&mut self, other: &Work, t: f64) {
        self.flags.copy_from_slice(&other.flags);
        self.waves.copy_from_slice(&other.waves);
        (self.gmin, self.source_factor, self.wave_time) = (other.gmin, other.source_factor, t);
    }

    /// As a run begins.
    pub fn reset_flags(&mut self, sys: &System) {
        let mut fresh = sys.work();
        std::mem::swap(&mut fresh.standing.floor, &mut self.standing.floor);
        let flags = std::mem::replace(&mut self.flags, fresh.flags);
        (self.standing, self.logic, self.clocked) = (fresh.standing, fresh.logic, fresh.clocked);
        sys.inherit(self, &flags);
    }

    pub fn restore_flags(&mut self, held: &Held) {
        self.flags.copy_from_slice(&held.flags);
        self.standing = held.standing.clone();
        self.logic = held.logic.clone();
        self.clocked = held.clocked.clone();
        self.clocked.return_exchanges();
        self.wave_time = f64::NAN;
    }

    pub fn restore(&mut self, held: &Held) {
        self.restore_flags(held);
        self.ports.copy_from_slice(&held.ports);
        self.edges = held.edges.clone();
    }
}

/// What hangs on gmin at an operating point: the node that is farthest from where it would be with less of it, its voltage, and
/// the largest current that gmin carries.
#[derive(Clone, Copy, Debug)]
pub struct Hanging {
    pub unknown: usize,
    pub volts: f64,
    pub amperes: f64,
}

/// A rest that the least disturbance leads away from (op/unstable.rs).
#[derive(Clone, Copy, Debug)]
pub struct Unstable {
    /// the node that moves most
    pub unknown: usize,
    /// Re and Im of s [1/s]; 0 where nothing is stored
    pub s: (f64, f64),
    /// a run starts there
    pub at_start: bool,
}
