//! Equation (1):  d/dt Q(x, t) + F(x, t) = 0, compiled.
//!
//! `Model` collects contributions; `System` is what was compiled and never changes while it runs; `Work` is the scratch
//! and the held state (flags, limited voltages of devices) of one run.  Row i belongs to unknown i.  C = dQ/dx and
//! G = dF/dx share one sparse pattern.  The linear part is summed once; expressions run as tapes; devices as kernels.
use crate::clocked::{self, Clocked};
use crate::conditions::{Scale, Standing};
use crate::edges::{EdgeWork, Edges};
use crate::graph::Id;
use crate::interrupt;
use crate::logic::{Live, Logic};
use crate::model::runs_during;
pub use crate::model::{FlagSpec, Force, Free, Kind, Model, Response, Unknown};
use crate::reduced::Reduced;
use crate::sparse::{Once, Pattern, Rows, Singular, Stamp, Symbolic};
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;
use delays::{Delays, Past};
pub use exchanged::{ExchangedInputs, Polynomial, DEGREE};
pub use phases::Phase;
pub use split::{Part, Parts};
pub use stage::Stage;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
pub use together::{Together, POINTS};

mod compile;
mod counters;
pub mod delays;
mod devices;
mod exchanged;
pub mod follow;
mod laws;
mod linear;
mod loose;
mod lowered;
mod nonlinear;
mod paces;
mod phases;
mod reduce;
mod slopes;
mod split;
mod stage;
mod stops;
pub mod time_only;
mod together;
mod work;

pub use self::compile::summed;
pub use self::counters::Counters;
pub use self::devices::{Devices, Instance};
pub use self::laws::{Laws, Reading};
use self::linear::Linear;
use self::lowered::Prepared;
use self::nonlinear::Nonlinear;
use self::time_only::TimeOnly;
use self::work::Programs;
pub use self::work::{Doubts, Hanging, Held, Unstable, Work};
use crate::devices::{Met, Near};

/// Unknowns of a system above which what follows a solution is not written as a program.
pub const LARGEST: usize = 200;

/// A node whose row is part of its group's root's, and the place of its column there.
pub struct Summed {
    pub node: usize,
    pub root: usize,
    pub place: usize,
    pub tied: bool, // by capacitors alone: of both voltages their difference is a state
}

pub struct System {
    pub n: usize,
    pub unknowns: Vec<Unknown>,
    pub waves: Vec<Wave>,
    pub delays: Delays,
    pub responses: Vec<Response>,
    pub logic: Logic,
    pub clocked: Clocked,
    pub flags: Vec<FlagSpec>,
    pub laws: Laws,
    pub forces: Vec<Force>,
    pub start: Start,
    pub pattern: Pattern,
    pub constant: Constant,
    expressions: Expressions,
    conditions: Conditions,
    stamps: Vec<Stamp>, // slopes of devices, then entries of G, then of C, that are not constant
    pub time_only: TimeOnly,
    /// the highest frequency at which sources swing that can move a condition which is found by stepping
    pub swing: f64,
    pub edges: Edges,
    pub devices: Devices,
    nonlinear: Nonlinear,
    pub has_q: Vec<bool>,        // row i has a d/dt term
    pub differential: Vec<bool>, // unknown i appears under d/dt (in derivatives that are only shown it does not count)
    pub linear: bool,            // C, G constant: one factorisation per step size, one solve per point
    pub pure_linear: bool,       // F = G x + waves, no expression at all
    pub passive: bool,           // nothing but passive devices in a passive network (see passive.rs)
    pub sums: Vec<Summed>,       // nodes whose rows are part of another one's (see floating_groups.rs)
    pub floating: Vec<bool>,     // nodes of groups and loose parts: what they have in common is no state
    pub phases: Vec<Phase>,      // of sines and cosines in expressions
    /// follows from the slope of a source's slope, which jumps where the source bends
    pub twice_bent: Option<usize>,
    pub made: Made,
    /// which analysis asks (folded::symbol_of)
    pub analysis: AtomicU32,
    /// of one whose index was lowered: the equations as they were, which runs start by
    pub whole: Option<Arc<System>>,
    /// waves that are slopes of others: of which, which
    pub slopes: Vec<(usize, usize)>,
}

/// What a deck gives a run to start from: by row or unknown, and how much.
pub struct Start {
    pub currents: Vec<(usize, f64)>,
    pub states: Vec<(usize, f64)>,
    /// with UIC, what is stored in a row
    pub charges: Vec<(usize, f64)>,
    /// values of .ic and .nodeset
    pub given: Vec<(usize, f64)>,
}

/// Constant contributions to F = G x and Q = C x, and what sources add to F.
pub struct Constant {
    g_rows: Rows,
    c_rows: Rows,
    stage_g: Rows, // the same on the union of both patterns
    stage_c: Rows,
    g: Vec<f64>, // on the pattern, with constant derivatives of expressions
    pub c: Vec<f64>,
    f_wave: Vec<(usize, usize, f64)>,
}

/// Rows that are expressions.
struct Expressions {
    rows: [Vec<(usize, Id)>; 2], // of F and of Q, for `reduce`
    values: Tape,                // F rows, then Q rows
    f_rows: Vec<usize>,
    q_rows: Vec<usize>,
    jacobian: Tape,      // the same, then entries of G, then of C, that are not constant
    g_slots: Vec<usize>, // place on the pattern of each such entry
    c_slots: Vec<usize>,
    c_places: Vec<(usize, usize)>,        // row and column of each of c_slots
    constant_c: Vec<(usize, usize, f64)>, // constant entries of dQ/dx that expressions have
    exponential: bool,                    // are there exponentials of unknowns in them?
    yielding: Vec<usize>, // own entries that may fall by orders of magnitude within a step: see `bent_behind`
}

/// What flags hang on.
struct Conditions {
    roots: Tape, // up and down of every flag
    sizes: Tape, // what is added up in them, in magnitude
    /// unknowns that conditions and kinks hang on
    read: Vec<usize>,
    turning: Vec<Phase>, // of sines and cosines in them
}

/// What is made when it is first asked for, and kept.
#[derive(Default)]
pub struct Made {
    symbolic: OnceLock<Result<Symbolic, Singular>>,
    second: OnceLock<Option<usize>>,
    together: OnceLock<Option<Together>>,
    /// patterns of the operating point: with a machine that moves to where it rests, and with one that is held (op.rs)
    pub rest_patterns: [OnceLock<Result<(Pattern, Symbolic), Singular>>; 2],
    pub closing: Once, // charges behind a solution (newton.rs)
    pub storing: Once, // those of an error
    linear_program: Once,
    whole_program: Once, // Q and F
    reduced: OnceLock<Result<Reduced, String>>,
    parts: OnceLock<Result<Box<Parts>, String>>,
    lowered: Mutex<Option<Box<Prepared>>>,
}

impl System {
    fn initial_flag(&self, flag: &FlagSpec) -> f64 {
        let during = runs_during(flag, self.analysis.load(Ordering::Relaxed));
        during.map_or_else(|| f64::from(flag.initial.max(0)), |runs| f64::from(u8::from(runs)))
    }

    pub fn work(&self) -> Work {
        let mut w = Work {
            waves: vec![0.0; self.waves.len()],
            flags: self.flags.iter().map(|f| self.initial_flag(f)).collect(),
            standing: Standing::new(self.flags.len()),
            scale: Scale::default(),
            wave_time: f64::NAN,
            before: f64::INFINITY,
            exchanged: ExchangedInputs::default(),
            past: self.delays.past(),
            begin: None,
            charges: None,
            halts: Vec::new(),
            every_corner: false,
            logic: self.logic.live(),
            clocked: self.clocked.live(),
            source_factor: 1.0,
            dc: false,
            given: Vec::new(),
            gmin: 1e-12,
            programs: Programs {
                values: self.expressions.values.workspace(),
                jacobian: self.expressions.jacobian.workspace(),
                roots: self.conditions.roots.workspace(),
            },
            q: vec![0.0; self.n],
            f: vec![0.0; self.n],
            gv: self.constant.g.clone(),
            cv: self.constant.c.clone(),
            edges: self.edges.work(self.waves.len()),
            free: Vec::new(),
            asked: Vec::new(),
            linear: Linear::default(),
            ports: self.devices.start(),
            lines: self.devices.lines(),
            limited: false,
            without_off: false,
            where_finite: false,
            doubts: Doubts::default(),
            counters: Counters::default(),
        };
        w.logic.rest(&self.logic, &w.flags);
        w
    }

    /// How the matrices of steps are permuted, which the pattern alone decides.
    pub fn symbolic(&self) -> Result<&Symbolic, Singular> {
        self.made.symbolic.get_or_init(|| Symbolic::loosely(&self.pattern, &self.loose_rows())).as_ref().map_err(|&e| e)
    }

    pub fn operations(&self) -> (usize, usize) {
        (self.expressions.values.len(), self.expressions.jacobian.len())
    }

    /// Are there currents with a flux?
    pub fn has_coils(&self) -> bool {
        self.unknowns.iter().zip(&self.differential).any(|(u, &d)| d && u.kind == Kind::Branch)
    }

    /// Are the matrices of all stages as `Lu::set_dominant` wants them?
    pub fn is_dominant(&self) -> bool {
        self.passive && self.sums.is_empty() && !self.has_coils()
    }

    #[inline(always)]
    pub fn set_time(&self, w: &mut Work, t: f64) {
        if t == w.wave_time && !w.dc {
            return;
        }
        for (v, wave) in w.waves.iter_mut().zip(&self.waves) {
            *v = w.source_factor
                * match w.dc {
                    true => wave.dc_value(),
                    false => wave.value_at(t, t >= w.before),
                };
        }
        if w.dc {
            w.given.iter().for_each(|&(k, v)| w.waves[k] = w.source_factor * v);
        }
        w.exchanged.write(t, &mut w.waves);
        w.past.write(t, t >= w.before, &mut w.waves);
        w.logic.write(&self.logic, t, &mut w.waves);
        w.clocked.write(&self.clocked, &mut w.waves);
        w.wave_time = if w.dc { f64::NAN } else { t };
    }

    /// What `set_time` has found for this time already.
    pub fn recall_waves(&self, w: &mut Work, t: f64, waves: &[f64]) {
        w.waves.copy_from_slice(waves);
        w.wave_time = t;
    }

    /// Sources are to be read anew (the factor or the DC mode changed).
    pub fn touch_sources(&self, w: &mut Work) {
        w.wave_time = f64::NAN;
    }

    /// F of what is linear at (x, t) in w.f, and the constant entries of G on the pattern.
    pub fn linear_part(&self, w: &mut Work, x: &[f64], t: f64) -> &[f64] {
        self.set_time(w, t);
        self.eval_linear(w, x);
        &self.constant.g
    }

    /// (row, unknown, coefficient) of what is constant in F.
    pub fn constant_terms(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.constant.g_rows.entries()
    }

    /// dQ_i/dx_i, what is constant of it.
    pub fn own_capacitance(&self, i: usize) -> f64 {
        self.pattern.position(i, i).map_or(0.0, |k| self.constant.c[k])
    }

    /// Unknowns that conditions and kinks hang on.
    pub fn conditions_read(&self) -> &[usize] {
        &self.conditions.read
    }

    /// Sines and cosines in what flags hang on.
    pub fn turning(&self) -> &[Phase] {
        &self.conditions.turning
    }

    /// (row, source, coefficient) of sources that come into F as they are.
    pub fn source_rows(&self) -> &[(usize, usize, f64)] {
        &self.constant.f_wave
    }

    /// Expressions of F (0) or of Q (1), by row.
    pub fn expression_ids(&self, which: usize) -> &[(usize, Id)] {
        &self.expressions.rows[which]
    }

    /// Rows with an expression in F.
    pub fn expression_rows(&self) -> &[usize] {
        &self.expressions.f_rows
    }

    /// Q and F at (x, t): w.q, w.f. No limiting.
    pub fn eval(&self, w: &mut Work, x: &[f64], t: f64) {
        assert!(x.len() == self.n);
        interrupt::spent(self.n + self.expressions.values.len());
        self.set_time(w, t);
        self.eval_linear(w, x);
        w.counters.evaluations += 1;
        self.turn_free(w, x, t);
        if !self.expressions.values.is_empty() {
            self.expressions.values.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut w.programs.values);
            for (k, &row) in self.expressions.f_rows.iter().enumerate() {
                w.f[row] += self.expressions.values.output(&w.programs.values, k);
            }
            for (k, &row) in self.expressions.q_rows.iter().enumerate() {
                w.q[row] += self.expressions.values.output(&w.programs.values, self.expressions.f_rows.len() + k);
            }
        }
        self.devices.add_values(x, w.gmin, &mut w.f, &mut w.q);
    }

    /// Q, F and their derivatives at (x, t): w.q, w.f, w.gv, w.cv. With `limit`, port voltages of devices move at most as
    /// SPICE's limiting allows and the device is continued linearly from there (w.limited says so).
    pub fn eval_jacobian(&self, w: &mut Work, x: &[f64], t: f64, limit: bool) {
        assert!(x.len() == self.n);
        self.set_time(w, t);
        self.eval_linear(w, x);
        w.counters.evaluations += 1;
        w.counters.jacobians += 1;
        w.limited = false;
        if self.linear && self.expressions.values.is_empty() {
            return; // gv, cv never change
        }
        w.gv.copy_from_slice(&self.constant.g);
        w.cv.copy_from_slice(&self.constant.c);
        self.expand(w, x, t, 0.0, limit, None);
        if !self.expressions.jacobian.is_empty() {
            let (nf, nq) = (self.expressions.f_rows.len(), self.expressions.q_rows.len());
            let all = !w.where_finite;
            let out = |k| {
                Some(self.expressions.jacobian.output(&w.programs.jacobian, k))
                    .filter(|v| all || v.is_finite())
                    .unwrap_or(0.0)
            };
            for (k, &row) in self.expressions.f_rows.iter().enumerate() {
                w.f[row] += out(k);
            }
            for (k, &row) in self.expressions.q_rows.iter().enumerate() {
                w.q[row] += out(nf + k);
            }
            for (k, &slot) in self.expressions.g_slots.iter().enumerate() {
                w.gv[slot] += out(nf + nq + k);
            }
            let base = nf + nq + self.expressions.g_slots.len();
            for (k, &slot) in self.expressions.c_slots.iter().enumerate() {
                w.cv[slot] += out(base + k);
            }
        }
        self.add_lines(w, x);
    }

    /// `eval_jacobian` with limiting, without what expressions give that is not finite: the rows in which it was left out.
    pub fn eval_where_finite(&self, w: &mut Work, x: &[f64], t: f64) -> Vec<usize> {
        w.where_finite = true;
        self.eval_jacobian(w, x, t, true);
        w.where_finite = false;
        if self.expressions.jacobian.is_empty() {
            return Vec::new();
        }
        let (nf, nq) = (self.expressions.f_rows.len(), self.expressions.q_rows.len());
        let absent = |k: usize| !self.expressions.jacobian.output(&w.programs.jacobian, k).is_finite();
        let values = self.expressions.f_rows.iter().enumerate().filter(|&(k, _)| absent(k)).map(|(_, &row)| row);
        let slopes = self.expressions.g_slots.iter().enumerate().filter(|&(k, _)| absent(nf + nq + k));
        values.chain(slopes.map(|(_, &slot)| self.pattern.rowidx[slot])).collect()
    }

    /// Expressions and devices with their derivatives at (x, t), kept in `w` for what follows: `eval_jacobian`,
    /// or the five functions of one implicit stage below it.
    #[inline(always)]
    fn expand(&self, w: &mut Work, x: &[f64], t: f64, a: f64, limit: bool, near: Option<Near>) -> Met {
        self.turn_free(w, x, t);
        if !self.expressions.jacobian.is_empty() {
            self.expressions.jacobian.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut w.programs.jacobian);
        }
        let met = self.linearise(w, x, a, limit, near);
        w.limited = met.moved;
        met
    }

    /// y = C x with the C of what was expanded last.
    pub fn c_times(&self, w: &Work, x: &[f64], y: &mut [f64]) {
        self.charges_of(x, y);
        self.add_expression_c(w, x, y);
        self.add_capacitances(w, x, y);
    }

    /// Of what was evaluated last, with slopes: the first row that is no number.
    pub fn not_finite(&self, w: &Work) -> Option<usize> {
        let bad = |v: &f64| !v.is_finite();
        let by_slopes =
            || w.gv.iter().position(bad).or_else(|| w.cv.iter().position(bad)).map(|k| self.pattern.rowidx[k]);
        w.f.iter().position(bad).or_else(|| w.q.iter().position(bad)).or_else(by_slopes)
    }

    /// sizes <- sum of |terms| of G x, of constant entries: what they come to in each row before they cancel.
    pub fn terms(&self, x: &[f64], sizes: &mut [f64]) {
        self.constant.g_rows.sizes(x, |row, size| sizes[row] = size);
    }

    /// y += C x, the part of C that stems from expressions.
    fn add_expression_c(&self, w: &Work, x: &[f64], y: &mut [f64]) {
        for &(row, col, v) in &self.expressions.constant_c {
            y[row] += v * x[col];
        }
        let base = self.expressions.f_rows.len() + self.expressions.q_rows.len() + self.expressions.g_slots.len();
        for (k, &(row, col)) in self.expressions.c_places.iter().enumerate() {
            y[row] += self.expressions.jacobian.output(&w.programs.jacobian, base + k) * x[col];
        }
    }
}
