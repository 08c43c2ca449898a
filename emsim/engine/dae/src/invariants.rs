//! What must hold at every recorded row, whichever method made it: the algebraic rows of equation (1), F_i(x, t) = 0. These are
//! Kirchhoff's law at nodes without a capacitor of their own (of nodes that capacitors tie together: of their sum, floating_groups.rs), the
//! laws of branches, the closures of loops with their rates, and what laws with modes say of their efforts. Beside them stands what
//! follows from rows with a derivative alone, charge that nothing carries away (charges.rs).
//!
//! A row is asked for as much as the tolerances of what it adds up:  |F_i| <= MOST sum_j |G_ij| weight_j,  or it is told. Rows between
//! the ends of steps can be made better (`holds`): at a node where all is linear no more than MOST reltol of its largest current is left there,
//! for voltages within their tolerances make any current in a small resistance. The bounds are renewed, with the matrix, every RENEWED rows and wherever one is passed. In between one sum stands for all of them,
//!
//!   | sum_i s_i F_i / bound_i | <= 1,   s_i of either sign and of different sizes,
//!
//! which is a product of x with one row of numbers; where it is larger they are looked at one by one. Where currents of devices enter,
//! which are dear, rows are looked at when the bounds are renewed, and between the ends of steps in which a voltage goes up or down
//! an exponential: a polynomial through the ends has a junction conduct what nothing gives it, or not conduct what a coil drives. Up an
//! exponential a voltage's tolerance is worth any current, so that there no more is left than what all currents but the largest come to.
mod charges;

use self::charges::Charges;
use crate::graph::{Graph, Id};
use crate::rounding::{ROUNDED, SUMMED};
use crate::system::{Kind, System, Work};
use crate::tape::{Inputs, Tape};
use crate::tolerances::{Options, Quantity, Tolerances, PEAK_SHARE};
use std::collections::BTreeMap;

/// So many tolerances: dense output and values that were settled anew are off by a few.
const MOST: f64 = 10.0;
const RENEWED: u32 = 1024;

/// A row that does not hold: what is left of it, what the tolerances allow, and where this was worst.
#[derive(Clone, Copy, Debug)]
pub struct Broken {
    pub row: usize,
    pub first: f64,
    pub t: f64,
    pub left: f64,
    pub bound: f64,
    /// of charge that nothing carries away: of this node, and of those that currents flow between it and
    pub charge: bool,
}

/// The widest that a closure has come open.
#[derive(Clone, Copy, Default, Debug)]
pub struct Gap {
    pub t: f64,
    pub wide: f64,
}

/// A voltage that an exponential current hangs on, and how far up it may go in a step before rows are looked at.
struct Port {
    nodes: (i32, i32),
    volts: f64,
    reach: f64,
}

impl Port {
    #[inline]
    fn voltage(&self, x: &[f64]) -> f64 {
        let at = |k: i32| usize::try_from(k).map_or(0.0, |k| x[k]);
        at(self.nodes.0) - at(self.nodes.1)
    }
}

pub struct Invariants {
    watched: Vec<usize>,           // algebraic rows, those without devices first
    plain: usize,                  // how many these are
    terms: Vec<(u32, u32, f64)>,   // (place in `watched`, unknown, coefficient) of all
    sources: Vec<(u32, u32, f64)>, // the same of sources
    expressions: Vec<u32>,         // places that outputs of the tape are added to
    tape: Tape,                    // those expressions, then closures
    scratch: Vec<f64>,
    asked: u32,                 // how often they have been
    left: Vec<f64>,             // F_i, without the currents of devices
    bent: Vec<f64>,             // F_i of those with devices, when these are asked
    bounds: Vec<f64>,           // of all
    loose: Vec<f64>,            // ... by the tolerances of what is added up alone: beyond these it is told
    seen: f64,                  // time of the row that was asked for, and holds
    law: Vec<bool>,             // of what is watched: what a law with modes says
    largest: Vec<f64>,          // of rows with devices: what all currents but the largest have come to at most
    before: f64,                // time of the row before
    now: f64,                   // and of this one
    counts: Vec<f64>,           // what each unknown counts for in all rows together
    sums: [Vec<(u32, f64)>; 2], // and sources and outputs of the tape
    ports: Vec<Port>,
    turns: bool, // a voltage moves along its exponential in the present step
    until: u32,  // rows until they are renewed
    tol: Tolerances,
    abstol: f64,
    charges: Charges,
    last: (f64, Vec<f64>),   // the newest row, where there are such
    work: Option<Box<Work>>, // what a method knows in its own is not touched
    pub gaps: Vec<Gap>,
    pub broken: Vec<Broken>,
}

impl Invariants {
    /// `closures`: how far loops are open, to be told of.
    pub fn new(g: &Graph, sys: &System, o: &Options, closures: &[Id]) -> Invariants {
        let bends = sys.rows_of_devices();
        let kind = |i: usize| matches!(sys.unknowns[i].kind, Kind::Node | Kind::Branch | Kind::Lambda | Kind::Mu);
        let algebraic = |i: &usize| !sys.has_q[*i] && kind(*i);
        let plain: Vec<usize> = (0..sys.n).filter(algebraic).filter(|&i| !bends[i]).collect();
        let (count, mut place) = (plain.len(), vec![None; sys.n]);
        let watched: Vec<usize> = plain.into_iter().chain((0..sys.n).filter(algebraic).filter(|&i| bends[i])).collect();
        watched.iter().enumerate().for_each(|(k, &i)| place[i] = Some(k as u32));
        let law = watched.iter().map(|&i| sys.laws.has_row(i)).collect();
        let terms = sys.constant_terms().filter_map(|(row, col, v)| Some((place[row]?, col as u32, v))).collect();
        let sources = sys.source_rows().iter().filter_map(|&(row, k, v)| Some((place[row]?, k as u32, v))).collect();
        let found = sys.expression_ids(0).iter().filter_map(|&(row, id)| Some((place[row]?, id)));
        let (expressions, mut ids): (Vec<u32>, Vec<Id>) = found.unzip();
        ids.extend(closures);
        let tape = Tape::new(g, &ids);
        let scratch = tape.workspace();
        let left = vec![0.0; watched.len()];
        let bounds = vec![0.0; watched.len()];
        let ports = sys.exponential_ports().map(|(nodes, volts)| Port { nodes, volts, reach: f64::NEG_INFINITY });
        let ports = if watched.len() > count { ports.collect() } else { Vec::new() };
        let gaps = vec![Gap::default(); closures.len()];
        let tol = Tolerances::new(sys, o);
        Invariants {
            watched,
            plain: count,
            terms,
            sources,
            expressions,
            tape,
            scratch,
            asked: 0,
            left,
            bent: Vec::new(),
            bounds,
            loose: Vec::new(),
            seen: f64::NAN,
            law,
            largest: Vec::new(),
            before: f64::NEG_INFINITY,
            now: f64::NEG_INFINITY,
            counts: vec![0.0; sys.n],
            sums: Default::default(),
            ports,
            turns: false,
            until: 0,
            tol,
            abstol: o.absolute.of(Quantity::Current, o.reltol),
            charges: Charges::new(sys),
            last: (0.0, Vec::new()),
            work: None,
            gaps,
            broken: Vec::new(),
        }
    }

    /// The row (t, x) is recorded.
    #[inline]
    pub fn row(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        if self.watched.is_empty() && self.gaps.is_empty() && self.charges.is_empty() {
            return;
        }
        (self.before, self.now) = (self.now, t);
        if !self.charges.is_empty() {
            if self.charges.row(t, x) {
                self.until = 0;
            }
            self.last.0 = t;
            self.last.1.clear();
            self.last.1.extend_from_slice(x);
        }
        // what was just asked for needs no second look
        let asked = t == self.seen;
        let good = asked || self.sum(sys, w, t, x).abs() <= 1.0;
        self.seen = f64::NAN;
        // signals may have been larger since the last look; some of the rows tell it, and each that is looked at
        // from one row within a step whose size is remembered to the next
        if !good || self.until % 8 == 0 {
            self.tol.observe(x, t);
        }
        for (k, gap) in self.gaps.iter_mut().enumerate() {
            let wide = self.tape.output(&self.scratch, self.expressions.len() + k).abs();
            if wide > gap.wide {
                *gap = Gap { t, wide };
            }
        }
        if self.until > 0 && good {
            self.until -= 1;
        } else {
            self.look(sys, w, t, x);
        }
    }

    /// The run ends.
    pub fn close(&mut self, sys: &System, w: &mut Work) {
        let (t, x) = std::mem::take(&mut self.last);
        if !x.is_empty() {
            self.sum(sys, w, t, &x);
            self.until = 0;
            self.look(sys, w, t, &x);
        }
    }

    /// The next row is not the one that was asked for.
    pub fn forget(&mut self) {
        self.seen = f64::NAN;
    }

    /// Does (t, x) hold?
    #[inline]
    pub fn holds(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> bool {
        let good = self.sum(sys, w, t, x).abs() <= 1.0 && !self.turns && self.within_reach(x);
        self.seen = if good { t } else { f64::NAN };
        good || self.holds_one_by_one(sys, w, t, x)
    }

    /// What stands for all rows without devices, in units of their bounds; closures.
    #[inline]
    fn sum(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> f64 {
        sys.set_time(w, t);
        self.asked = self.asked.saturating_add(1);
        // what is asked so often is asked by machine code
        if self.asked == 200 {
            self.compile();
        }
        let [sources, outputs] = &self.sums;
        let mut sum = product(&self.counts, x);
        sum += sources.iter().map(|&(k, v)| v * w.waves[k as usize]).sum::<f64>();
        if !self.tape.is_empty() {
            self.tape.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut self.scratch);
            sum += outputs.iter().map(|&(k, v)| v * self.tape.output(&self.scratch, k as usize)).sum::<f64>();
        }
        sum
    }

    /// Short runs end before machine code has paid for being made.
    #[cold]
    #[inline(never)]
    fn compile(&mut self) {
        let tape = std::mem::replace(&mut self.tape, Tape::new(&Graph::default(), &[]));
        self.tape = tape.native();
        self.scratch = self.tape.workspace();
    }

    #[inline]
    fn within_reach(&self, x: &[f64]) -> bool {
        self.ports.iter().all(|port| port.voltage(x) <= port.reach)
    }

    /// Rows follow that lie within the step from x0 to x1. `first`: behind a jump, where polynomials may be little better than lines.
    pub fn within_step(&mut self, x0: &[f64], x1: &[f64], first: bool) {
        self.turns = false;
        let missed = MOST * self.tol.reltol;
        // a line misses m^2 / 8, a cubic some hundredth of m^4, where the current goes to e^m of what it was
        let most = if first { (missed / 0.125).sqrt() } else { (missed / 1e-2).powf(0.25) };
        for port in &mut self.ports {
            let (v0, v1) = (port.voltage(x0), port.voltage(x1));
            // at e^12 of it a current is one at all
            let (high, conducts) = (v0.max(v1), 12.0 * port.volts);
            // up an exponential by what makes a factor of e, and to where there is a current at all
            port.reach = (high + port.volts).max(conducts);
            self.turns |= high > conducts && (v1 - v0).abs() > most * port.volts;
        }
    }

    #[cold]
    #[inline(never)]
    fn holds_one_by_one(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> bool {
        self.one_by_one(w, x);
        if !within(&self.left[..self.plain], &self.bounds) {
            self.renew(sys, w, t, x);
            if !within(&self.left[..self.plain], &self.bounds) {
                return false;
            }
        }
        !self.turns && self.within_reach(x) || self.devices_hold(sys, w, t, x)
    }

    /// Do the rows with devices hold to MOST reltol of their largest current? One of no device: what a wrong voltage makes of theirs is
    /// no measure.
    fn devices_hold(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> bool {
        let mut own = self.own(sys, w, t);
        sys.eval(&mut own, x, t);
        self.bent.clear();
        self.bent.extend(self.watched[self.plain..].iter().map(|&row| own.f[row]));
        let largest = self.largest_currents(sys, &own, x);
        let mut sizes = vec![0.0; sys.n];
        sys.terms(x, &mut sizes);
        self.work = Some(own);
        let bound = |k: usize, row: usize| self.tight(largest[self.plain + k], sizes[row]);
        self.watched[self.plain..].iter().enumerate().all(|(k, &row)| self.bent[k].abs() <= bound(k, row))
    }

    /// What may be left of currents of which the largest is known, and what all of them come to.
    fn tight(&self, largest: f64, size: f64) -> f64 {
        MOST * (self.tol.reltol * largest + self.abstol) + ROUNDED * size
    }

    /// Workspace for a look beside the run.
    fn own(&mut self, sys: &System, w: &Work, t: f64) -> Box<Work> {
        let mut own = self.work.take().unwrap_or_else(|| Box::new(sys.work()));
        own.follow(w, t);
        own
    }

    /// All rows against their bounds.
    #[cold]
    #[inline(never)]
    fn look(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.one_by_one(w, x);
        if self.until > 0 && within(&self.left[..self.plain], &self.bounds) {
            self.until -= 1;
            return;
        }
        self.until = RENEWED;
        self.renew(sys, w, t, x);
        self.tell(t);
    }

    /// F_i without devices, behind `sum`.
    fn one_by_one(&mut self, w: &Work, x: &[f64]) {
        self.left.fill(0.0);
        for &(k, j, v) in &self.terms {
            self.left[k as usize] += v * x[j as usize];
        }
        for &(k, j, v) in &self.sources {
            self.left[k as usize] += v * w.waves[j as usize];
        }
        for (output, &k) in self.expressions.iter().enumerate() {
            self.left[k as usize] += self.tape.output(&self.scratch, output);
        }
    }

    /// The bounds anew; and what is left in rows with devices.
    #[cold]
    #[inline(never)]
    fn renew(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        let mut own = self.own(sys, w, t);
        let w = &mut *own;
        sys.eval_jacobian(w, x, t, false);
        let mut sums = vec![0.0; sys.n];
        for j in 0..sys.n {
            let weight = self.tol.error_weight(j, x[j], x[j]);
            for k in sys.pattern.colptr[j]..sys.pattern.colptr[j + 1] {
                sums[sys.pattern.rowidx[k]] += w.gv[k].abs() * weight;
            }
        }
        let plain = self.plain;
        self.bounds.iter_mut().zip(&self.watched).for_each(|(bound, &row)| *bound = MOST * sums[row]);
        // a source is known as well as the time is
        for &(k, j, v) in &self.sources {
            let slope =
                sys.waves.get(j as usize).map_or(0.0, |wave| wave.rate(t, true).abs().max(wave.rate(t, false).abs()));
            self.bounds[k as usize] += v.abs() * slope * SUMMED * t;
        }
        self.loose.clone_from(&self.bounds);
        let largest = self.largest_currents(sys, w, x);
        let mut sizes = vec![0.0; sys.n];
        sys.terms(x, &mut sizes);
        for k in 0..plain {
            self.bounds[k] = self.bounds[k].min(self.tight(largest[k], sizes[self.watched[k]]));
        }
        let share: Vec<f64> = self.bounds[..plain].iter().enumerate().map(|(k, bound)| sign(k) / bound).collect();
        let of = |&(k, j, v): &(u32, u32, f64)| Some((j, share.get(k as usize)? * v));
        self.counts.fill(0.0);
        self.terms.iter().filter_map(of).for_each(|(j, v)| self.counts[j as usize] += v);
        let mut sources = BTreeMap::new();
        self.sources.iter().filter_map(of).for_each(|(j, v)| *sources.entry(j).or_default() += v);
        let outputs = (0..).zip(&self.expressions).filter_map(|(output, &k)| Some((output, *share.get(k as usize)?)));
        self.sums = [sources.into_iter().collect(), outputs.collect()];
        self.bent.clear();
        self.bent.extend(self.watched[plain..].iter().map(|&row| w.f[row]));
        self.bend(sys, w, x, &sizes);
        for found in self.charges.look(w, &self.tol, t, x) {
            self.told(found);
        }
        self.work = Some(own);
    }

    /// The largest current at each node, without those of devices; infinite where there are expressions, or where that means nothing.
    fn largest_currents(&self, sys: &System, w: &Work, x: &[f64]) -> Vec<f64> {
        let (mut largest, mut whole) = (vec![0.0_f64; self.left.len()], vec![0.0; self.left.len()]);
        let node = |i: usize| sys.unknowns[i].kind == Kind::Node;
        for &(k, j, v) in &self.terms {
            let (k, j, row) = (k as usize, j as usize, self.watched[k as usize]);
            let across = if node(j) { x[j] - x[row] } else { x[j] };
            largest[k] = largest[k].max((v * across).abs());
            whole[k] += if node(j) { v } else { 0.0 };
        }
        for &(k, j, v) in &self.sources {
            largest[k as usize] = largest[k as usize].max((v * w.waves[j as usize]).abs());
        }
        for (k, &row) in self.watched.iter().enumerate() {
            largest[k] = if node(row) { largest[k].max((whole[k] * x[row]).abs()) } else { f64::INFINITY };
        }
        self.expressions.iter().for_each(|&k| largest[k as usize] = f64::INFINITY);
        largest
    }

    /// The bounds of rows with devices: of what devices carry no more than what all currents but the largest come to, and, as of other
    /// signals, a share of what that has been.
    fn bend(&mut self, sys: &System, w: &Work, x: &[f64], sizes: &[f64]) {
        let rest = self.all_but_the_largest(sys, w, x);
        self.largest.resize(rest.len(), 0.0);
        let mut linear = vec![0.0; self.watched.len()];
        let weight = |j: usize| self.tol.error_weight(j, x[j], x[j]);
        self.terms.iter().for_each(|&(k, j, v)| linear[k as usize] += v.abs() * weight(j as usize));
        for (j, rest) in rest.into_iter().enumerate() {
            let k = self.plain + j;
            self.largest[j] = self.largest[j].max(rest);
            let most = rest.max(PEAK_SHARE * self.largest[j]);
            let bound = rest + MOST * linear[k] + self.tight(most, sizes[self.watched[k]]);
            self.loose[k] = self.loose[k].min(bound);
        }
    }

    /// What the currents into each node with devices come to without the largest of them.
    fn all_but_the_largest(&self, sys: &System, w: &Work, x: &[f64]) -> Vec<f64> {
        let mut found = vec![(0.0_f64, 0.0_f64); self.watched.len()]; // the largest, all
        let mut add = |k: usize, current: f64| {
            found[k] = (found[k].0.max(current), found[k].1 + current);
        };
        let node = |i: usize| sys.unknowns[i].kind == Kind::Node;
        let mut to_ground = vec![0.0; self.watched.len()];
        for &(k, j, v) in &self.terms {
            let (k, j, row) = (k as usize, j as usize, self.watched[k as usize]);
            add(k, (v * if node(j) { x[j] - x[row] } else { x[j] }).abs());
            to_ground[k] += if node(j) { v } else { 0.0 };
        }
        for &(k, j, v) in &self.sources {
            add(k as usize, (v * w.waves[j as usize]).abs());
        }
        for (output, &k) in self.expressions.iter().enumerate() {
            add(k as usize, self.tape.output(&self.scratch, output).abs());
        }
        let place: BTreeMap<usize, usize> =
            (self.plain..).zip(&self.watched[self.plain..]).map(|(k, &row)| (row, k)).collect();
        for (row, current) in sys.device_currents(w) {
            place.get(&row).into_iter().for_each(|&k| add(k, current));
        }
        for (k, &row) in self.watched.iter().enumerate() {
            add(k, (to_ground[k] * x[row]).abs());
        }
        found[self.plain..].iter().map(|(largest, all)| all - largest).collect()
    }

    /// Those that are beyond their bounds.
    fn tell(&mut self, t: f64) {
        for k in 0..self.watched.len() {
            let left = if k < self.plain { self.left[k] } else { self.bent[k - self.plain] };
            let bound = self.loose[k];
            // (behind an event a source may be on its way up while time hardly moves, and modes follow at the next row)
            // rows so near to each other, in parts of the time, are one
            let asked = !self.law[k] || self.now - self.before > 1e-12 * self.now;
            if asked && left.abs() > bound && left.is_finite() {
                self.told(Broken { row: self.watched[k], first: t, t, left, bound, charge: false });
            }
        }
    }

    /// One that is told, each with its worst place.
    fn told(&mut self, found: Broken) {
        match self.broken.iter().position(|b| (b.row, b.charge) == (found.row, found.charge)) {
            Some(at) => {
                let b = &mut self.broken[at];
                if found.left.abs() * b.bound > b.left.abs() * found.bound {
                    *b = Broken { first: b.first, ..found };
                }
            }
            // so many rows are told, each with its worst place
            None if self.broken.len() < 8 => self.broken.push(found),
            None => {}
        }
    }
}

/// Of either sign and of different sizes, so that an error that several rows have in common does not cancel.
fn sign(k: usize) -> f64 {
    let mixed = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11;
    let size = 0.5 + (mixed >> 1 & 0xFFFF) as f64 / 65536.0;
    if mixed & 1 == 1 {
        -size
    } else {
        size
    }
}

/// sum a_j x_j in four sums, which do not wait for one another.
#[inline]
fn product(a: &[f64], x: &[f64]) -> f64 {
    let (a, x) = (a.chunks_exact(4), x[..a.len()].chunks_exact(4));
    let rest: f64 = a.remainder().iter().zip(x.remainder()).map(|(a, x)| a * x).sum();
    let mut sums = [0.0; 4];
    for (a, x) in a.zip(x) {
        (0..4).for_each(|k| sums[k] += a[k] * x[k]);
    }
    rest + (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[inline]
fn within(left: &[f64], bounds: &[f64]) -> bool {
    left.iter().zip(bounds).all(|(left, bound)| left.abs() <= *bound)
}
