//! Equation (1):  d/dt Q(x, t) + F(x, t) = 0, compiled.
//!
//! `Model` collects contributions; `System` is what was compiled and never changes while it runs; `Work` is the scratch
//! and the held state (flags, limited voltages of devices) of one run.  Row i belongs to unknown i.  C = dQ/dx and
//! G = dF/dx share one sparse pattern.  The linear part is summed once; expressions run as tapes; devices as kernels.
use crate::clocked::{self, Clocked};
use crate::conditions::{size, Scale, Standing};
use crate::derive::gradient;
use crate::edges::{affine, EdgeWork, Edges};
use crate::graph::{Graph, Id, Node};
use crate::interrupt;
use crate::islands::sum_pairs;
use crate::logic::{Live, Logic};
use crate::model::runs_during;
pub use crate::model::{FlagSpec, Force, Free, Kind, Model, Response, Unknown};
use crate::passive::is_passive;
use crate::reduced::Reduced;
use crate::sparse::{reciprocal, Once, Pattern, Rows, Singular, Stamp, Symbolic};
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;
use delays::{Delays, Past};
pub use guests::{Guests, Polynomial, DEGREE};
pub use phases::Phase;
pub use split::{Part, Parts};
pub use stage::Stage;
use std::collections::{BTreeMap, HashSet};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
pub use together::{Together, POINTS};

mod apart;
mod bends;
pub mod delays;
mod devices;
pub mod follow;
pub mod foreseen;
mod guests;
mod laws;
mod linear;
mod lowered;
mod phases;
mod reduce;
mod slopes;
mod split;
mod stage;
mod stops;
mod together;

use self::bends::{Bend, Gate};
pub use self::devices::{Devices, Instance};
use self::follow::Follow;
use self::foreseen::Foreseen;
pub use self::laws::{Laws, Reading};
use self::linear::Linear;
use self::lowered::Prepared;
use crate::devices::{Met, Near};

/// A node whose row is part of its island's root's, and the place of its column there.
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
    pub starting_currents: Vec<(usize, f64)>,
    pub states: Vec<(usize, f64)>,
    pub ic_charge: Vec<(usize, f64)>,
    pub given: Vec<(usize, f64)>,
    pub pattern: Pattern,
    g_rows: Rows, // constant contributions to F = G x, Q = C x
    c_rows: Rows,
    stage_g: Rows, // the same on the union of both patterns
    stage_c: Rows,
    expression_c: Vec<(usize, usize, f64)>, // constant entries of dQ/dx that expressions have
    c_places: Vec<(usize, usize)>,          // row and column of each of c_slots
    stamps: Vec<Stamp>,                     // slopes of devices, then entries of G, then of C, that are not constant
    g_linear: Vec<f64>,                     // on the pattern
    pub c_linear: Vec<f64>,
    f_wave: Vec<(usize, usize, f64)>,
    values: Tape, // F rows, then Q rows
    f_rows: Vec<usize>,
    q_rows: Vec<usize>,
    jacobian: Tape,      // the same, then entries of G, then of C, that are not constant
    g_slots: Vec<usize>, // place on the pattern of each such entry
    c_slots: Vec<usize>,
    pub foreseen: Foreseen,
    /// the highest frequency at which sources swing that can move a condition which is found by stepping
    pub swing: f64,
    roots: Tape, // up and down of every flag
    /// unknowns that conditions and kinks hang on
    pub conditions_read: Vec<usize>,
    sizes: Tape, // what is added up in them, in magnitude
    pub edges: Edges,
    pub devices: Devices,
    bent: Vec<Bend>,             // voltages that exponentials of devices hang on
    gates: Vec<Gate>,            // branches of devices
    pub has_q: Vec<bool>,        // row i has a d/dt term
    pub differential: Vec<bool>, // unknown i appears under d/dt (in derivatives that are only shown it does not count)
    pub linear: bool,            // C, G constant: one factorisation per step size, one solve per point
    pub pure_linear: bool,       // F = G x + waves, no expression at all
    pub passive: bool,           // nothing but passive devices in a passive network (see passive.rs)
    exponential: bool,           // are there exponentials of unknowns in expressions?
    yielding: Vec<usize>,        // own entries that may fall by orders of magnitude within a step: see `bent_behind`
    rows: [Vec<(usize, Id)>; 2], // F and Q of rows that are expressions, for `reduce`
    pub sums: Vec<Summed>,       // nodes whose rows are part of another one's (see islands.rs)
    pub floating: Vec<bool>,     // nodes of islands and loose parts: what they have in common is no state
    pub phases: Vec<Phase>,      // of sines and cosines in expressions
    pub turning: Vec<Phase>,     // the same in what flags hang on
    symbolic: OnceLock<Result<Symbolic, Singular>>,
    second: OnceLock<Option<usize>>,
    /// follows from the slope of a source's slope, which jumps where the source bends
    pub twice_bent: Option<usize>,
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
    /// which analysis asks (folded::symbol_of)
    pub analysis: AtomicU32,
    /// of one whose index was lowered: the equations as they were, which runs start by
    pub whole: Option<Arc<System>>,
    /// waves that are slopes of others: of which, which
    pub slopes: Vec<(usize, usize)>,
}

/// Scratch and held state of one run.
pub struct Work {
    pub waves: Vec<f64>,
    pub flags: Vec<f64>,
    /// kinks that no event follows for a while: functions of the point that is evaluated, in every iteration
    pub free: Vec<usize>,
    standing: Standing,
    scale: Scale,
    wave_time: f64,
    before: f64, // from here on sources have the value before their jump: what lies at a step's end
    /// values that another system gives, in place of the last waves
    pub guests: Guests,
    /// ... and those that the past gives
    pub past: Past,
    /// unknowns and flags that a run begins with, in place of an operating point
    pub begin: Option<(Vec<f64>, Vec<f64>)>,
    /// ... and Q there, where other equations have left it
    pub charges: Option<Vec<f64>>,
    /// flags that end a run when they turn to 1, or whenever they turn
    pub halts: Vec<(usize, bool)>,
    /// digital nodes, whose levels and ramps are waves
    pub logic: Live,
    /// signals of clocks, which are waves
    pub clocked: clocked::Live,
    pub source_factor: f64,
    pub dc: bool, // independent sources at their DC value
    /// ... but for these, with the value that a sweep gives them
    pub given: Vec<(usize, f64)>,
    pub gmin: f64,
    values: Vec<f64>,
    jacobian: Vec<f64>,
    roots: Vec<f64>,
    pub q: Vec<f64>,
    pub f: Vec<f64>,
    pub gv: Vec<f64>,
    pub cv: Vec<f64>,
    pub ports: Vec<f64>, // port voltages of devices that limiting holds
    edges: EdgeWork,
    asked: Vec<f64>,
    linear: Linear,
    lines: Vec<f64>, // devices as straight lines, see `devices::Layout`
    pub limited: bool,
    /// devices that are off at the start carry nothing
    pub without_off: bool,
    where_finite: bool, // what expressions give that is not finite is left out
    /// a rest that does not stay: an operating point, the start of a run, or its end
    pub unstable: Option<Unstable>,
    /// a run begins where this condition, as it is held, is not what it says: there is no operating point (op.rs)
    pub substitute: Option<(usize, bool)>,
    /// of the operating point that was found last: the node that only gmin holds
    pub hanging: Option<Hanging>,
    pub counters: Counters,
}

/// What a run holds between steps beside its state.
#[derive(Clone)]
pub struct Held {
    flags: Vec<f64>,
    standing: Standing,
    ports: Vec<f64>,
    edges: EdgeWork,
    logic: Live,
    clocked: clocked::Live,
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

#[derive(Clone, Copy, Default, Debug)]
pub struct Counters {
    pub steps: u64,
    pub rejected: u64,
    pub newton_failures: u64,
    pub iterations: u64,
    pub evaluations: u64,
    pub jacobians: u64,
    pub factorisations: u64,
    pub solves: u64,
    pub events: u64,
    pub breakpoints: u64,
}

impl Counters {
    pub fn add(&mut self, other: &Counters) {
        self.steps += other.steps;
        self.rejected += other.rejected;
        self.newton_failures += other.newton_failures;
        self.iterations += other.iterations;
        self.evaluations += other.evaluations;
        self.jacobians += other.jacobians;
        self.factorisations += other.factorisations;
        self.solves += other.solves;
        self.events += other.events;
        self.breakpoints += other.breakpoints;
    }
}

impl System {
    /// A system of its own, with what lowers its index laid by (lowered.rs).
    pub fn compile(mut model: Model, g: &mut Graph) -> Result<System, String> {
        model.fold_linear(g);
        let [g_sum, c_sum] = [&model.g, &model.c].map(|entries| summed(entries));
        let passive = model.f.is_empty()
            && model.q.is_empty()
            && model.flags.is_empty()
            && is_passive(&model.unknowns, &g_sum, &c_sum);
        let mut pairs = reciprocal(|i| model.unknowns[i].kind == Kind::Node, [&g_sum, &c_sum]);
        let (islands, floating) = model.sum_islands(g);
        islands.iter().for_each(|layer| sum_pairs(&mut pairs, &g_sum, layer));
        let prepared = Prepared { model, islands, floating, pairs, passive, twice_bent: None };
        let lowered = prepared.lowered(g);
        let mut system = System::finish(prepared, g)?;
        system.lowered = lowered;
        Ok(system)
    }

    /// The model's rows are final.
    fn finish(prepared: Prepared, g: &mut Graph) -> Result<System, String> {
        let Prepared { model, islands, floating, pairs, passive, twice_bent } = prepared;
        let n = model.unknowns.len();
        let [mut g_sum, c_sum] = [&model.g, &model.c].map(|entries| summed(entries));
        let leaves: Vec<Id> = (0..n).map(|i| g.unknown(i as u32)).collect();
        // derivatives of every row that is an expression, by reverse mode, only for unknowns that the row reads
        let mut f_jac = Vec::new();
        let mut q_jac = Vec::new();
        for (rows, out) in [(&model.f, &mut f_jac), (&model.q, &mut q_jac)] {
            for (&row, &expr) in rows {
                let read = g.unknowns(&[expr]);
                let xs: Vec<Id> = read.iter().map(|&i| leaves[i]).collect();
                for (&col, d) in read.iter().zip(gradient(g, expr, &xs)) {
                    if g.value(d) != Some(0.0) {
                        out.push((row, col, d));
                    }
                }
            }
        }
        // one pattern for C and G
        let mut places: Vec<(usize, usize)> = Vec::new(); // (col, row)
        places.extend(model.g.iter().chain(&model.c).map(|&(r, c, _)| (c, r)));
        places.extend(f_jac.iter().chain(&q_jac).map(|&(r, c, _)| (c, r)));
        for class in &model.classes {
            places.extend(devices::places(&**class, true).into_iter().map(|(r, c)| (c, r)));
        }
        // branches whose two ends are one node stand in no row, and their own has nothing but a number
        let loose = {
            let mut bound: HashSet<usize> = model.f.keys().chain(model.q.keys()).copied().collect();
            bound.extend(model.f_wave.iter().map(|&(r, _, _)| r));
            bound.extend(model.g.iter().chain(&model.c).flat_map(|&(r, c, _)| [r, c]));
            bound.extend(f_jac.iter().chain(&q_jac).flat_map(|&(r, c, _)| [r, c]));
            bound.extend(model.classes.iter().flat_map(|c| devices::places(&**c, false)).flat_map(|(r, c)| [r, c]));
            let branch = |i: &usize| model.unknowns[*i].kind == Kind::Branch;
            (0..n).filter(branch).filter(|i| !bound.contains(i)).collect::<Vec<_>>()
        };
        places.extend(loose.iter().map(|&i| (i, i)));
        places.extend(islands.iter().flatten().map(|(&node, &root)| (node, root)));
        places.sort_unstable();
        places.dedup();
        let mut colptr = vec![0; n + 1];
        for &(c, _) in &places {
            colptr[c + 1] += 1;
        }
        for c in 0..n {
            colptr[c + 1] += colptr[c];
        }
        let pattern = Pattern { n, colptr, rowidx: places.iter().map(|p| p.1).collect() };
        let nnz = pattern.rowidx.len();
        let at = |r: usize, c: usize| -> usize {
            let (lo, hi) = (pattern.colptr[c], pattern.colptr[c + 1]);
            lo + pattern.rowidx[lo..hi].binary_search(&r).expect("every place was collected")
        };

        // constants go to the linear part, the rest to the tape
        let mut g_linear = vec![0.0; nnz];
        let mut c_linear = vec![0.0; nnz];
        for (entries, linear) in [(&g_sum, &mut g_linear), (&c_sum, &mut c_linear)] {
            for (&(r, c), &v) in entries {
                linear[at(r, c)] = v;
            }
        }
        let follow = Follow::new(&model, g, &g_sum, &c_sum);
        let wanted = Edges::reads(&model, g).into_iter().chain(follow.fixed(&model));
        let follows = follow.expressions(&model, g, wanted);
        let (edges, [moved, conditions]) = Edges::find(&model, g, [&g_sum, &c_sum], &follows, follow.fixed(&model));
        let foreseen = Foreseen::find(g, &moved, &model.waves, |e| affine(g, e, &model.waves));
        let swing = follow.swing(&model, g, &conditions);
        let f_rows: Vec<usize> = model.f.keys().copied().collect();
        let q_rows: Vec<usize> = model.q.keys().copied().collect();
        let mut outs: Vec<Id> = model.f.values().chain(model.q.values()).copied().collect();
        let exponential = g.has_exponentials(&outs);
        let values = Tape::new(g, &outs).native();
        let (mut g_slots, mut c_slots) = (Vec::new(), Vec::new());
        for (jac, linear, slots) in [(&f_jac, &mut g_linear, &mut g_slots), (&q_jac, &mut c_linear, &mut c_slots)] {
            for &(r, c, d) in jac {
                match g.value(d) {
                    Some(v) => linear[at(r, c)] += v,
                    None => {
                        slots.push(at(r, c));
                        outs.push(d);
                    }
                }
            }
        }
        let jacobian = Tape::new(g, &outs).native();
        let root_ids: Vec<Id> = model.flags.iter().flat_map(|f| [f.up, f.down]).collect();
        let roots = Tape::new(g, &root_ids).native();
        let size_ids: Vec<Id> = model.flags.iter().map(|f| size(g, f.up)).collect();
        let sizes = Tape::new(g, &size_ids);
        if values.has_free_symbols() || jacobian.has_free_symbols() || roots.has_free_symbols() {
            return Err("an expression holds a symbol that was never substituted".into());
        }

        // which rows are differential, which unknowns stand under d/dt
        let mut has_q = vec![false; n];
        let mut differential = vec![false; n];
        // a derivative that nobody else's equation reads is only shown; one that is read makes a state of its argument
        let read = |k: usize| pattern.rowidx[pattern.colptr[k]..pattern.colptr[k + 1]].iter().any(|&r| r != k);
        let state = |r: usize| model.unknowns[r].kind != Kind::Derivative || read(r);
        for &(r, c) in c_sum.keys() {
            has_q[r] = true;
            differential[c] |= state(r);
        }
        for &r in &q_rows {
            has_q[r] = true;
        }
        for &(r, c, _) in &q_jac {
            differential[c] |= state(r);
        }
        for (class, k) in model.classes.iter().flat_map(|c| (0..c.seats().len()).map(move |k| (c, k))) {
            let (seat, shape) = (&class.seats()[k], class.shape(k));
            for (j, rows) in seat.rows.iter().enumerate().filter(|&(j, _)| shape.stores(j)) {
                rows.iter().filter(|&&k| k >= 0).for_each(|&k| has_q[k as usize] = true);
                for (_, port) in shape.ports.iter().enumerate().filter(|&(p, _)| shape.link(j, p).charge) {
                    let ends = [seat.nodes[port.0], seat.nodes[port.1]];
                    ends.iter().filter(|&&k| k >= 0).for_each(|&k| differential[k as usize] = true);
                }
            }
        }
        let laws = Laws::new(g, model.laws);
        let devices = Devices::new(model.classes, &model.off, &pattern);
        if !loose.is_empty() {
            // where this number is 0, the least current is as good as any; where it is not, nothing solves it
            let (mut f, mut q) = (vec![0.0; n], vec![0.0; n]);
            devices.add_values(&vec![0.0; n], 0.0, &mut f, &mut q);
            for &i in loose.iter().filter(|&&i| f[i] == 0.0) {
                g_linear[at(i, i)] = 1.0;
                g_sum.insert((i, i), 1.0);
            }
        }
        let mut sums = Vec::new();
        for (layer, tied) in islands.iter().zip([true, false]) {
            let others = layer.iter().filter(|(node, root)| node != root);
            sums.extend(others.map(|(&node, &root)| Summed { node, root, place: at(root, node), tied }));
        }
        let floating: HashSet<usize> = floating.into_iter().chain(sums.iter().flat_map(|s| [s.node, s.root])).collect();
        let linear = devices.is_empty() && g_slots.is_empty() && c_slots.is_empty() && model.flags.is_empty();
        let mut stage_g = g_sum.clone();
        let mut stage_c = c_sum.clone();
        for &place in c_sum.keys() {
            stage_g.entry(place).or_default();
        }
        for &place in g_sum.keys() {
            stage_c.entry(place).or_default();
        }
        let mut expression_c = Vec::new();
        let mut c_places = Vec::new();
        for &(r, c, d) in &q_jac {
            match g.value(d) {
                Some(v) => expression_c.push((r, c, v)),
                None => c_places.push((r, c)),
            }
        }
        let mut stamps = Vec::new();
        for (k, slope) in devices.slopes.iter().enumerate() {
            stamps.extend(slope.stamps().map(|(slot, sign)| Stamp { slot: slot as u32, source: k as u32, sign }));
        }
        for (k, &slot) in g_slots.iter().chain(&c_slots).enumerate() {
            stamps.push(Stamp { slot: slot as u32, source: (devices.slopes.len() + k) as u32, sign: 1.0 });
        }
        let unknowns = model.unknowns;
        let moving: HashSet<usize> = g_slots.iter().chain(&c_slots).copied().collect();
        let conducting: HashSet<usize> = g_slots.iter().copied().collect();
        let own = |i: usize| {
            let of = if exponential { &moving } else { &conducting };
            let yields = exponential || unknowns[i].kind == Kind::Node;
            pattern.position(i, i).filter(|k| yields && of.contains(k))
        };
        let yielding = (0..n).filter_map(own).collect();
        let mut logic = model.logic;
        logic.compile(g);
        let mut clocked = model.clocked;
        clocked.compile(g);
        let operands: Vec<Id> = model.flags.iter().flat_map(|f| [f.up, f.down]).collect();
        let turning = phases::phases(g, &operands);
        let asks = model.flags.iter().filter(|f| !f.law.remembers() && !f.law.of_modes());
        let asked: Vec<Id> = asks.flat_map(|f| [f.up, f.down]).collect();
        let leaves = g.reachable(&asked).into_iter().filter_map(|id| match g.node(id) {
            Node::Unknown(i) => Some(i as usize),
            _ => None,
        });
        let conditions_read = leaves.collect();
        let mut system = System {
            n,
            delays: Delays::new(g, model.delays, model.still),
            responses: model.responses,
            logic,
            clocked,
            turning,
            conditions_read,
            waves: model.waves,
            flags: model.flags,
            laws,
            forces: model.forces,
            starting_currents: model.starting_currents,
            states: model.states,
            ic_charge: model.ic_charge,
            given: model.given,
            phases: phases::phases(g, &model.f.values().chain(model.q.values()).copied().collect::<Vec<_>>()),
            rows: [&model.f, &model.q].map(|rows| rows.iter().map(|(&row, &id)| (row, id)).collect()),
            exponential,
            yielding,
            symbolic: OnceLock::new(),
            second: OnceLock::new(),
            twice_bent,
            together: OnceLock::new(),
            rest_patterns: Default::default(),
            closing: Once::default(),
            storing: Once::default(),
            linear_program: Once::default(),
            whole_program: Once::default(),
            reduced: OnceLock::new(),
            parts: OnceLock::new(),
            lowered: Mutex::new(None),
            analysis: AtomicU32::new(crate::veriloga::folded::symbol_of("tran").unwrap_or(0)),
            whole: None,
            slopes: model.slopes,
            passive: passive && devices.passive,
            floating: (0..n).map(|i| floating.contains(&i)).collect(),
            sums,
            g_rows: Rows::new(n, &g_sum, &model.g, &pairs),
            c_rows: Rows::new(n, &c_sum, &model.c, &pairs),
            stage_g: Rows::new(n, &stage_g, &model.g, &pairs),
            stage_c: Rows::new(n, &stage_c, &model.c, &pairs),
            expression_c,
            c_places,
            stamps,
            g_linear,
            c_linear,
            f_wave: model.f_wave,
            pure_linear: linear && values.is_empty(),
            values,
            f_rows,
            q_rows,
            jacobian,
            g_slots,
            c_slots,
            roots,
            sizes,
            edges,
            foreseen,
            swing,
            bent: Vec::new(),
            gates: Vec::new(),
            devices,
            has_q,
            differential,
            linear,
            pattern,
            unknowns,
        };
        system.find_bends();
        Ok(system)
    }

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
            guests: Guests::default(),
            past: self.delays.past(),
            begin: None,
            charges: None,
            halts: Vec::new(),
            logic: self.logic.live(),
            clocked: self.clocked.live(),
            source_factor: 1.0,
            dc: false,
            given: Vec::new(),
            gmin: 1e-12,
            values: self.values.workspace(),
            jacobian: self.jacobian.workspace(),
            roots: self.roots.workspace(),
            q: vec![0.0; self.n],
            f: vec![0.0; self.n],
            gv: self.g_linear.clone(),
            cv: self.c_linear.clone(),
            edges: self.edges.work(self.waves.len()),
            free: Vec::new(),
            asked: Vec::new(),
            linear: Linear::default(),
            ports: self.devices.start(),
            lines: self.devices.lines(),
            limited: false,
            without_off: false,
            where_finite: false,
            substitute: None,
            unstable: None,
            hanging: None,
            counters: Counters::default(),
        };
        w.logic.rest(&self.logic, &w.flags);
        w
    }

    /// How the matrices of steps are permuted, which the pattern alone decides.
    pub fn symbolic(&self) -> Result<&Symbolic, Singular> {
        self.symbolic.get_or_init(|| Symbolic::analyse(&self.pattern)).as_ref().map_err(|&e| e)
    }

    pub fn operations(&self) -> (usize, usize) {
        (self.values.len(), self.jacobian.len())
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
        w.guests.write(t, &mut w.waves);
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
        &self.g_linear
    }

    /// (row, unknown, coefficient) of what is constant in F.
    pub fn constant_terms(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.g_rows.entries()
    }

    /// (row, source, coefficient) of sources that come into F as they are.
    pub fn source_rows(&self) -> &[(usize, usize, f64)] {
        &self.f_wave
    }

    /// Expressions of F (0) or of Q (1), by row.
    pub fn expression_ids(&self, which: usize) -> &[(usize, Id)] {
        &self.rows[which]
    }

    /// Rows with an expression in F.
    pub fn expression_rows(&self) -> &[usize] {
        &self.f_rows
    }

    /// Q and F at (x, t): w.q, w.f. No limiting.
    pub fn eval(&self, w: &mut Work, x: &[f64], t: f64) {
        assert!(x.len() == self.n);
        interrupt::spent(self.n + self.values.len());
        self.set_time(w, t);
        self.eval_linear(w, x);
        w.counters.evaluations += 1;
        self.turn_free(w, x, t);
        if !self.values.is_empty() {
            self.values.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut w.values);
            for (k, &row) in self.f_rows.iter().enumerate() {
                w.f[row] += self.values.output(&w.values, k);
            }
            for (k, &row) in self.q_rows.iter().enumerate() {
                w.q[row] += self.values.output(&w.values, self.f_rows.len() + k);
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
        if self.linear && self.values.is_empty() {
            return; // gv, cv never change
        }
        w.gv.copy_from_slice(&self.g_linear);
        w.cv.copy_from_slice(&self.c_linear);
        self.expand(w, x, t, 0.0, limit, None);
        if !self.jacobian.is_empty() {
            let (nf, nq) = (self.f_rows.len(), self.q_rows.len());
            let all = !w.where_finite;
            let out = |k| Some(self.jacobian.output(&w.jacobian, k)).filter(|v| all || v.is_finite()).unwrap_or(0.0);
            for (k, &row) in self.f_rows.iter().enumerate() {
                w.f[row] += out(k);
            }
            for (k, &row) in self.q_rows.iter().enumerate() {
                w.q[row] += out(nf + k);
            }
            for (k, &slot) in self.g_slots.iter().enumerate() {
                w.gv[slot] += out(nf + nq + k);
            }
            let base = nf + nq + self.g_slots.len();
            for (k, &slot) in self.c_slots.iter().enumerate() {
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
        if self.jacobian.is_empty() {
            return Vec::new();
        }
        let (nf, nq) = (self.f_rows.len(), self.q_rows.len());
        let absent = |k: usize| !self.jacobian.output(&w.jacobian, k).is_finite();
        let values = self.f_rows.iter().enumerate().filter(|&(k, _)| absent(k)).map(|(_, &row)| row);
        let slopes = self.g_slots.iter().enumerate().filter(|&(k, _)| absent(nf + nq + k));
        values.chain(slopes.map(|(_, &slot)| self.pattern.rowidx[slot])).collect()
    }

    /// Expressions and devices with their derivatives at (x, t), kept in `w` for what follows: `eval_jacobian`,
    /// or the five functions of one implicit stage below it.
    #[inline(always)]
    fn expand(&self, w: &mut Work, x: &[f64], t: f64, a: f64, limit: bool, near: Option<Near>) -> Met {
        self.turn_free(w, x, t);
        if !self.jacobian.is_empty() {
            self.jacobian.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut w.jacobian);
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
        self.g_rows.sizes(x, |row, size| sizes[row] = size);
    }

    /// y += C x, the part of C that stems from expressions.
    fn add_expression_c(&self, w: &Work, x: &[f64], y: &mut [f64]) {
        for &(row, col, v) in &self.expression_c {
            y[row] += v * x[col];
        }
        let base = self.f_rows.len() + self.q_rows.len() + self.g_slots.len();
        for (k, &(row, col)) in self.c_places.iter().enumerate() {
            y[row] += self.jacobian.output(&w.jacobian, base + k) * x[col];
        }
    }
}

/// Entries, those of one place added up.
pub fn summed(entries: &[(usize, usize, f64)]) -> BTreeMap<(usize, usize), f64> {
    let mut sums = BTreeMap::new();
    for &(r, c, v) in entries {
        *sums.entry((r, c)).or_default() += v;
    }
    sums
}
