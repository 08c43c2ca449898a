//! Edges that are known before they come: switches and conditions that sources alone decide.
//!
//! The gate of a bridge is a PULSE source, and the switch it drives turns where the ramp meets the threshold. That time
//! needs no search inside integration steps, and the ramp itself, which nothing else reads, needs no steps at all.
//!
//! 1. What follows sources at once (system/follow.rs) is an expression of sources, time and flags.
//! 2. A flag is timed where its roots are such expressions. Between two corners of sources a root that is affine in piecewise linear
//!    ones is a straight line in t, and its zero one division; any other is smooth, and its first zero is found by bounds of its values and
//!    slopes (edges/course.rs), however short it is beyond.
//! 3. A node is pinned where a source fixes its voltage, which is affine in piecewise linear ones. Such a source is silent where only
//!    pinned nodes and timed flags read it: its corners move nothing that is integrated.
//!
//! The driver stops at the edges and at the corners of the other sources; recorded rows carry the pinned values.
mod course;

use self::course::{Course, Piece, Seen};
use crate::bounds::is_known;
use crate::conditions::{size, Standing};
use crate::derive::substitute;
use crate::graph::{Graph, Id, Node};
use crate::model::{Kind, Law, Model};
use crate::rounding::{ROUNDED, SAME};
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;
use std::collections::BTreeMap;

type Entries = BTreeMap<(usize, usize), f64>;

pub struct Edges {
    /// by flag: decided by sources alone
    pub timed: Vec<bool>,
    /// by wave: its corners need no step
    pub silent: Vec<bool>,
    any_silent: bool,
    flags: Vec<usize>,            // the timed ones
    laws: Vec<Law>,               // of these
    sources: Vec<usize>,          // waves their roots read
    roots: Tape,                  // up, down and size of each of `flags`
    courses: Vec<Option<Course>>, // of those that are no straight lines
    pinned: Vec<usize>,
    values: Tape,
}

/// Scratch of one run, and what the last search found.
#[derive(Clone, Default)]
pub struct EdgeWork {
    roots: Vec<f64>,
    values: Vec<f64>,
    waves: Vec<f64>,
    early: Vec<f64>,
    late: Vec<f64>,
    times: Vec<f64>,
    seen: Vec<Seen>,     // of smooth ones, how far they have been followed
    clear: Vec<f64>,     // from when on an operand has been clear of its threshold, on its flag's own side
    pending: Vec<usize>, // flags that flip at `at`
    at: f64,
    flipped: Vec<usize>, // flags that flipped at `when`
    when: f64,
}

/// Where the integration has to stop next.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Edge {
    pub t: f64,
    /// false: nothing happens there, the search went so far
    pub flips: bool,
}

impl Edges {
    /// Unknowns that conditions and kinks read, or that sources fix: those of them that follow sources make edges.
    pub fn reads(model: &Model, g: &Graph) -> Vec<usize> {
        let roots: Vec<Id> = model.flags.iter().flat_map(|f| [f.up, f.down]).collect();
        g.unknowns(&roots)
    }

    /// The edges, the rows that are left to be stepped through, and operands of flags that are found by stepping. `follows`: unknowns
    /// that are expressions of sources; `fixed`: those of them that a source's row is about.
    pub fn find(
        model: &Model,
        g: &mut Graph,
        [constant_g, constant_c]: [&Entries; 2],
        follows: &BTreeMap<usize, Id>,
        fixed: impl Iterator<Item = usize>,
    ) -> (Edges, [Vec<Id>; 2]) {
        let known_node = |n: usize| Some((n, *follows.get(&n)?));
        let pinned: Vec<(usize, Id)> = fixed.filter_map(known_node).collect();
        let pinned: BTreeMap<usize, Id> = pinned.into_iter().filter(|&(_, e)| affine(g, e, &model.waves)).collect();
        let map: Vec<(Id, Id)> = follows.iter().map(|(&n, &e)| (g.unknown(n as u32), e)).collect();
        let (mut timed, mut flags, mut laws, mut root_ids) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut courses, mut others) = (Vec::new(), Vec::new());
        for (k, flag) in model.flags.iter().enumerate() {
            let roots = substitute(g, &[flag.up, flag.down], &map);
            let straight = roots.iter().all(|&r| affine(g, r, &model.waves));
            let known = !flag.law.remembers()
                && !flag.law.of_modes()
                && (straight || roots.iter().all(|&r| of_time(g, r, &model.waves)));
            timed.push(known);
            if known {
                courses.push((!straight).then(|| Course::new(g, roots[0], roots[1])));
                flags.push(k);
                laws.push(flag.law);
                let size = size(g, roots[0]);
                root_ids.extend(roots);
                root_ids.push(size);
            } else if !flag.law.remembers() && flag.law != Law::Kept {
                others.extend(roots);
            }
        }
        let sources = waves_of(g, &root_ids);
        let mut silent = vec![false; model.waves.len()];
        for e in root_ids.iter().chain(pinned.values()) {
            for k in waves_of(g, &[*e]) {
                silent[k] = model.waves[k].is_piecewise_linear();
            }
        }
        let read = read_elsewhere(model, g, constant_g, constant_c, &pinned, &timed);
        for k in waves_of(g, &read) {
            silent[k] = false;
        }
        let values: Vec<Id> = pinned.values().copied().collect();
        let edges = Edges {
            timed,
            any_silent: silent.contains(&true),
            silent,
            flags,
            laws,
            sources,
            roots: Tape::new(g, &root_ids),
            courses,
            pinned: pinned.keys().copied().collect(),
            values: Tape::new(g, &values),
        };
        (edges, [read, others])
    }

    pub fn work(&self, waves: usize) -> EdgeWork {
        let m = self.flags.len();
        EdgeWork {
            roots: self.roots.workspace(),
            values: self.values.workspace(),
            waves: vec![0.0; waves],
            early: vec![0.0; m],
            late: vec![0.0; m],
            times: vec![0.0; m],
            seen: vec![Seen::default(); m],
            clear: vec![f64::INFINITY; m],
            at: f64::NAN,
            when: f64::NAN,
            ..EdgeWork::default()
        }
    }

    pub fn all_timed(&self) -> bool {
        self.flags.len() == self.timed.len()
    }

    pub fn any_silent(&self) -> bool {
        self.any_silent
    }

    /// Does `pin` overwrite this unknown?
    pub fn pins(&self, unknown: usize) -> bool {
        self.any_silent() && self.pinned.binary_search(&unknown).is_ok()
    }

    /// Overwrites pinned nodes by what their sources say, with `waves` at the time of x.
    pub fn pin(&self, w: &mut EdgeWork, waves: &[f64], flags: &[f64], t: f64, x: &mut [f64]) {
        self.values.run(&Inputs { x: &[], t, waves, flags }, &mut w.values);
        for (k, &n) in self.pinned.iter().enumerate() {
            x[n] = self.values.output(&w.values, k);
        }
    }

    /// Operands of the flags, counted towards their other sides, and the widths of their thresholds.
    fn evaluate(
        &self,
        w: &mut EdgeWork,
        standing: &mut Standing,
        flags: &[f64],
        t: f64,
        waves: impl Fn(usize) -> f64,
        late: bool,
    ) {
        for &k in &self.sources {
            w.waves[k] = waves(k);
        }
        self.roots.run(&Inputs { x: &[], t, waves: &w.waves, flags }, &mut w.roots);
        for (m, &k) in self.flags.iter().enumerate() {
            let [up, down, size] = [0, 1, 2].map(|j| self.roots.output(&w.roots, 3 * m + j));
            let beyond = if flags[k] == 0.0 { up } else { -down };
            *(if late { &mut w.late[m] } else { &mut w.early[m] }) = beyond;
            standing.widen(k, size);
        }
    }

    /// The first edge from t on (t itself included) before `limit`. Its flags wait in `w` for `flip`.
    ///
    /// Between two corners an operand is a straight line, so its side behind a time is known: that of its value there, or, where
    /// that is on the threshold, that of its value at the next corner.
    pub fn next(
        &self,
        w: &mut EdgeWork,
        standing: &mut Standing,
        waves: &[Wave],
        flags: &[f64],
        t: f64,
        limit: f64,
    ) -> Option<Edge> {
        if self.flags.is_empty() {
            return None;
        }
        w.pending.clear();
        w.at = f64::NAN;
        for (m, &k) in self.flags.iter().enumerate() {
            standing.armed[k] |= w.clear[m] <= t;
            w.clear[m] = f64::INFINITY;
        }
        let when = w.when * (1.0 + 1e-12);
        let mut from = t;
        // as far behind t as the next corner is at least: a corner that t stands on to rounding has been passed
        let behind = t + ROUNDED * t;
        self.evaluate(w, standing, flags, behind, |k| waves[k].value(behind), false);
        if from <= when {
            // a flag that has just turned stands on its threshold, whatever rounding says, if nothing has jumped
            for (early, k) in w.early.iter_mut().zip(&self.flags) {
                // and is nearer to it than this part of what is added up in its operand
                let stands = w.flipped.contains(k) && *early <= 1e-6 * standing.size(*k);
                *early = if stands { early.min(0.0) } else { *early };
            }
        }
        // at most so many corners without an edge are looked through at once
        for _ in 0..64 {
            let corner = self.sources.iter().map(|&k| waves[k].next_breakpoint(from)).fold(limit, f64::min);
            self.evaluate(w, standing, flags, corner, |k| waves[k].value_before(corner), true);
            let (first, until) = self.find_times(w, standing, waves, flags, [from, corner]);
            if first.is_finite() && first <= until {
                let near = first + SAME * (corner - from).min(1e-3 * corner);
                w.pending.extend(self.flags.iter().zip(&w.times).filter(|(_, &te)| te <= near).map(|(&k, _)| k));
                w.at = first;
                return Some(Edge { t: first, flips: true });
            }
            if until < corner {
                return Some(Edge { t: until, flips: false });
            }
            for (m, &k) in self.flags.iter().enumerate() {
                if w.late[m] < -standing.band[k] {
                    w.clear[m] = w.clear[m].min(corner);
                }
            }
            if corner >= limit {
                return None;
            }
            // a jump, or a ramp too short for two times: what is behind it
            let behind = self.sources.iter().filter_map(|&k| waves[k].hidden_corner(corner)).fold(corner, f64::max);
            if self.sources.iter().any(|&k| waves[k].value(behind) != w.waves[k]) {
                self.evaluate(w, standing, flags, behind, |k| waves[k].value(behind), true);
            }
            std::mem::swap(&mut w.early, &mut w.late);
            from = corner;
        }
        Some(Edge { t: from, flips: false })
    }

    /// When each flag turns between two corners: the first of these times, and up to when they are known.
    fn find_times(
        &self,
        w: &mut EdgeWork,
        standing: &Standing,
        waves: &[Wave],
        flags: &[f64],
        [from, corner]: [f64; 2],
    ) -> (f64, f64) {
        let (mut first, mut until) = (f64::INFINITY, corner);
        for (m, &k) in self.flags.iter().enumerate() {
            if w.early[m] < -standing.band[k] {
                w.clear[m] = w.clear[m].min(from);
            }
            let armed = standing.armed[k] || w.clear[m] <= from;
            let on = flags[k] != 0.0;
            let ends = (w.early[m], w.late[m]);
            w.times[m] = match &self.courses[m] {
                _ if standing.stuck == Some(k) => f64::INFINITY,
                None => turns(self.laws[m], on, armed, standing.band[k], ends.0, ends.1)
                    .map_or(f64::INFINITY, |share| from + share * (corner - from)),
                Some(course) => {
                    let leaves = leaves(self.laws[m], on, armed);
                    let piece = Piece { from, to: corner, ends, band: standing.band[k], leaves, on };
                    let (turn, far) = course.turn(&piece, waves, flags, &mut w.seen[m]);
                    until = until.min(far);
                    turn
                }
            };
            first = first.min(w.times[m]);
        }
        (first, until)
    }

    /// Flags that are not what their operands say at t, a time between two steps' ends where none turns.
    pub fn broken(
        &self,
        w: &mut EdgeWork,
        standing: &mut Standing,
        waves: &[Wave],
        flags: &[f64],
        t: f64,
        mut tell: impl FnMut(usize),
    ) {
        if self.flags.is_empty() {
            return;
        }
        self.evaluate(w, standing, flags, t, |k| waves[k].value(t), true);
        for (m, &k) in self.flags.iter().enumerate() {
            let beyond = w.late[m];
            // rounding of ramps that meet is no fault
            let clear = beyond.abs() <= standing.band[k] || beyond > SAME * standing.size(k);
            if clear && standing.asks(k, self.laws[m], flags[k] != 0.0, beyond) > 0.0 {
                tell(k);
            }
        }
    }

    /// Flips what waits for t; each flipped flag is given to `say`.
    pub fn flip(
        &self,
        w: &mut EdgeWork,
        flags: &mut [f64],
        standing: &mut Standing,
        t: f64,
        one: bool,
        mut say: impl FnMut(usize, bool),
    ) {
        // (of a cascade at one time the next edge is due at once, and the run may stand a rounding behind it)
        if !(w.at <= t) {
            return;
        }
        if one {
            w.pending.truncate(1);
        }
        for &k in &w.pending {
            flags[k] = 1.0 - flags[k];
            standing.armed[k] = false;
            say(k, flags[k] != 0.0);
        }
        w.clear.fill(f64::INFINITY);
        std::mem::swap(&mut w.pending, &mut w.flipped);
        (w.when, w.at) = (t, f64::NAN);
    }
}

/// Does a flag turn whose operand stays at its threshold?
fn leaves(law: Law, on: bool, armed: bool) -> bool {
    match law {
        Law::Condition => on,
        Law::Arrival => armed,
        Law::Stays | Law::Leg | Law::Memory | Law::History | Law::Mode | Law::Kept => false,
    }
}

/// Where between two times, in parts of their distance, a flag turns whose operand goes straight from `early` to `late`.
fn turns(law: Law, on: bool, armed: bool, band: f64, early: f64, late: f64) -> Option<f64> {
    let side = |v: f64| if v.abs() <= band { 0.0 } else { v.signum() };
    let (here, there) = (side(early), side(late));
    let behind = if here != 0.0 { here } else { there };
    match () {
        _ if behind > 0.0 || behind == 0.0 && leaves(law, on, armed) => Some(0.0),
        _ if there > 0.0 => Some(-early / (late - early)),
        _ => None,
    }
}

/// What something other than pinned nodes and timed flags reads, be it by way of a pinned node.
fn read_elsewhere(
    model: &Model,
    g: &mut Graph,
    constant_g: &Entries,
    constant_c: &Entries,
    pinned: &BTreeMap<usize, Id>,
    timed: &[bool],
) -> Vec<Id> {
    // rows that only say what a pinned node is
    let saying = |r: usize| {
        let mut of = constant_g.range((r, 0)..(r + 1, 0)).filter(|(_, &v)| v != 0.0);
        matches!((of.next(), of.next()), (Some((&(_, c), _)), None)
            if pinned.contains_key(&c) && model.unknowns[r].kind == Kind::Branch)
    };
    let mut ids: Vec<Id> = Vec::new();
    for (&r, &e) in model.f.iter().chain(&model.q) {
        if !saying(r) {
            ids.push(e);
        }
    }
    for (flag, _) in model.flags.iter().zip(timed).filter(|(_, &t)| !t) {
        ids.extend([flag.up, flag.down]);
    }
    for &(r, k, _) in &model.f_wave {
        if !saying(r) {
            ids.push(g.wave(k as u32));
        }
    }
    let linear = constant_g.iter().filter(|(&(r, _), _)| !saying(r)).chain(constant_c);
    let mut nodes: Vec<usize> = linear.filter(|(_, &v)| v != 0.0).map(|(&(_, c), _)| c).collect();
    let seats = model.classes.iter().flat_map(|c| c.seats());
    nodes.extend(seats.flat_map(|seat| &seat.nodes).filter(|&&k| k >= 0).map(|&k| k as usize));
    ids.extend(nodes.iter().filter_map(|n| pinned.get(n)));
    let map: Vec<(Id, Id)> = pinned.iter().map(|(&n, &e)| (g.unknown(n as u32), e)).collect();
    substitute(g, &ids, &map)
}

pub fn waves_of(g: &Graph, ids: &[Id]) -> Vec<usize> {
    g.reachable(ids)
        .iter()
        .filter_map(|&id| if let Node::Wave(k) = g.node(id) { Some(k as usize) } else { None })
        .collect()
}

/// Is e a function of time, whatever the flags, that is known before the run?
fn of_time(g: &Graph, e: Id, waves: &[Wave]) -> bool {
    g.reachable(&[e]).into_iter().all(|id| is_known(g.node(id), waves, true))
}

/// Is e a straight line in piecewise linear sources, whatever the flags? What comes from outside is one until it is disturbed.
pub fn affine(g: &Graph, e: Id, waves: &[Wave]) -> bool {
    // degree of each node: 0 of flags and constants alone, 1 affine
    let mut degree: BTreeMap<Id, u8> = BTreeMap::new();
    for id in g.reachable(&[e]) {
        let node = g.node(id);
        let of = |o: Id| degree[&o];
        let d = match node {
            Node::Const(_) | Node::Flag(_) => 0,
            Node::Time => 1,
            Node::Wave(k) if waves[k as usize].is_piecewise_linear() || waves[k as usize].as_input().is_some() => 1,
            Node::Neg(a) => of(a),
            Node::Add(a, b) | Node::Sub(a, b) => of(a).max(of(b)),
            Node::Mul(a, b) => of(a).saturating_add(of(b)),
            Node::Div(a, b) if of(b) == 0 => of(a),
            Node::Select(c, a, b) if of(c) == 0 => of(a).max(of(b)),
            _ if node.is_leaf() => 2,
            _ if node.operands().all(|o| of(o) == 0) => 0,
            _ => 2,
        };
        degree.insert(id, d);
    }
    degree[&e] <= 1
}
