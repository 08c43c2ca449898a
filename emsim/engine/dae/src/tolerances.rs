//! What a run is asked for: its options, and how small an error is small enough: one relative tolerance, one absolute tolerance per kind of quantity.
//!
//!   weight_i = reltol max(|x_i|, 0.02 recent_i) + atol_i + 1e-12 (largest neighbour of the same kind)
//!
//! recent_i is the largest value that x_i has had: a signal that crosses zero is not asked for relative accuracy of zero. When it has
//! been below 0.02 of that for ten times as long as all before, that is forgotten as time goes on: what dies away through decades of
//! time is still known. Robertson's first species, 2e-8 of its beginning after 1e11 s, would be on either side of zero within a
//! tolerance of that beginning, and runs away on the wrong one.
//! atol decides while a signal has not yet been larger than some 50 atol / reltol, as at a start from rest. It must
//! therefore be small beside what the deck is about, and above the rounding of what the deck is made of. Volt and ampere
//! keep SPICE's values. A length has no such custom: a comb drive moves by micrometres, a crane by tens of metres. So
//! lengths are a share of L, the largest length that the deck states, and
//!
//!   velocity   of sqrt(g L), what L is fallen through with         g = 9.81 m/s^2
//!   force      of M g, torque of M g L, M being the largest mass
//!
//! Errors of capacitors and inductors are measured in volt and ampere. SPICE also lets pass what is less than chgtol =
//! 1e-14 C: on a femtofarad that is 10 V. Here charge and flux count only where they are asked for:
//! atol(V) = max(vntol, chgtol / C), atol(A) = max(abstol, flxtol / L).
use crate::model::{Kind, Unknown};
use crate::multiversion::{by_lanes, in_blocks, in_blocks_mut, side_by_side, whole, Lanes, One, LANES};
use crate::system::System;
use serde::{Deserialize, Serialize};

/// Share of a signal's largest value so far below which relative accuracy is no longer asked for.
pub const PEAK_SHARE: f64 = 0.02;
/// So many times the time since which a signal is below that share, its largest value begins to be forgotten.
const KEPT: f64 = 10.0;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Options {
    pub reltol: f64,
    pub absolute: Absolute,
    pub trtol: f64,
    pub gmin: f64,
    pub itl1: usize,
    pub itl4: usize,
    pub maxord: Option<usize>,
    pub method: String,
    pub fixed_step: Option<f64>,
    /// explicit methods take closed loops back onto their constraints after every step
    pub projection: bool,
    /// a run that would need more steps is refused
    pub maxsteps: f64,
    /// energy accounts are kept: what a method knows of the inside of its steps is wanted
    pub accounts: bool,
    /// unknowns that rows show; none where they are all of use
    pub shown: Vec<u32>,
    /// length of the run and of its print grid [s]; 0 where they are not known
    pub span: f64,
    pub grid: f64,
    /// a flag that does not turn during a transient: for tests of what is told then
    pub stuck_flag: Option<usize>,
    /// an unknown that rows show wrongly, for the same
    pub spoiled: Option<usize>,
    /// rows are not looked at: to measure what that costs
    pub unwatched: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            reltol: 1e-3,
            absolute: Absolute::default(), // follows reltol
            trtol: f64::NAN,
            gmin: 1e-12,
            itl1: 100,
            itl4: 30,
            maxord: None,
            method: "trap".into(),
            fixed_step: None,
            projection: true,
            maxsteps: 1e8,
            accounts: false,
            shown: Vec::new(),
            span: 0.0,
            grid: 0.0,
            stuck_flag: None,
            spoiled: None,
            unwatched: false,
        }
    }
}

/// Absolute tolerances as `.options` gives them, and what the deck is made of; NaN where nothing is said.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Absolute {
    pub given: [f64; QUANTITIES.len()],
    pub length: f64,
    pub mass: f64,
}

impl Default for Absolute {
    fn default() -> Self {
        Absolute { given: [f64::NAN; QUANTITIES.len()], length: f64::NAN, mass: f64::NAN }
    }
}

/// Kinds of quantity, in the order of QUANTITIES.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Quantity {
    Voltage,
    Current,
    Charge,
    Flux,
    Length,
    Angle,
    Velocity,
    AngularVelocity,
    Force,
    Torque,
}

/// Name, unit, option.
pub const QUANTITIES: [(Quantity, &str, &str, &str); 10] = [
    (Quantity::Voltage, "voltage", "V", "vntol"),
    (Quantity::Current, "current", "A", "abstol"),
    (Quantity::Charge, "charge", "C", "chgtol"),
    (Quantity::Flux, "flux linkage", "Wb", "flxtol"),
    (Quantity::Length, "length", "m", "lentol"),
    (Quantity::Angle, "angle", "rad", "angtol"),
    (Quantity::Velocity, "velocity", "m/s", "veltol"),
    (Quantity::AngularVelocity, "angular velocity", "rad/s", "spintol"),
    (Quantity::Force, "force", "N", "forcetol"),
    (Quantity::Torque, "torque", "N m", "torquetol"),
];

impl Absolute {
    pub fn knows(name: &str) -> bool {
        matches!(name, "length" | "mass") || QUANTITIES.iter().any(|q| q.3 == name)
    }

    pub fn set(&mut self, name: &str, value: f64) {
        match name {
            "length" => self.length = value,
            "mass" => self.mass = value,
            _ => {
                if let Some(k) = QUANTITIES.iter().position(|q| q.3 == name) {
                    self.given[k] = value;
                }
            }
        }
    }

    /// The tolerance at `reltol`. SPICE's defaults belong to reltol 1e-3: asking for more asks for more everywhere, in
    /// machines down to where lengths and angles of ordinary size have their rounding.
    pub fn of(&self, quantity: Quantity, reltol: f64) -> f64 {
        const GRAVITY: f64 = 9.81; // [m/s^2]: makes a speed and a force of a length and a mass
        let given = self.given[quantity as usize];
        if given.is_finite() {
            return given;
        }
        let or = |value: f64, other: f64| if value > 0.0 && value.is_finite() { value } else { other };
        // of a machine that states none: a millimetre, a gram
        let (length, mass) = (or(self.length, 1e-3), or(self.mass, 1e-3));
        let tighter = (reltol / 1e-3).min(1.0);
        let least = tighter.max(1e-4);
        match quantity {
            Quantity::Voltage => 1e-6 * tighter,
            Quantity::Current => 1e-12 * tighter,
            Quantity::Charge | Quantity::Flux => 0.0,
            Quantity::Length => 1e-8 * length * least,
            Quantity::Angle => 1e-8 * least,
            Quantity::Velocity => 1e-8 * (GRAVITY * length).sqrt() * least,
            Quantity::AngularVelocity => 1e-6 * least,
            Quantity::Force => 1e-8 * mass * GRAVITY * least,
            Quantity::Torque => 1e-8 * mass * GRAVITY * length * least,
        }
    }

    /// Of an unknown that stores `storage` (farad, henry) of its own value.
    fn of_unknown(&self, u: &Unknown, storage: f64, reltol: f64) -> f64 {
        let own = Quantity::of(u).map_or(0.0, |q| self.of(q, reltol));
        let stored = match u.kind {
            Kind::Node => self.of(Quantity::Charge, reltol),
            Kind::Branch => self.of(Quantity::Flux, reltol),
            _ => 0.0,
        };
        if stored > 0.0 && storage > 0.0 {
            own.max(stored / storage)
        } else {
            own
        }
    }
}

impl Quantity {
    /// None of what is in no norm.
    pub fn of(u: &Unknown) -> Option<Quantity> {
        Some(match (u.kind, u.unit.as_str()) {
            (Kind::Node, _) => Quantity::Voltage,
            (Kind::Branch, _) => Quantity::Current,
            (Kind::Coordinate, "m") => Quantity::Length,
            (Kind::Coordinate, _) => Quantity::Angle,
            (Kind::Speed, "m/s") => Quantity::Velocity,
            (Kind::Speed, _) => Quantity::AngularVelocity,
            (Kind::Lambda, "N m") => Quantity::Torque,
            (Kind::Lambda, _) => Quantity::Force,
            (Kind::Mu | Kind::Derivative, _) => return None,
        })
    }
}

/// Weights of every unknown, and which of them count where.
#[derive(Clone)]
pub struct Tolerances {
    pub reltol: f64,
    pub vntol: f64, // of a device's voltage
    /// accounts are kept: currents of diodes must be right where their voltages are, an exponential apart
    pub accounts: bool,
    pub atol: Vec<f64>,
    pub peak: Vec<f64>,
    recent: Vec<f64>, // `peak`, less what lies long behind
    last: Vec<f64>,   // time at which each was last above its share of that
    /// absolute floor of each weight: `atol`, and the rounding that larger neighbours of the same unit bring
    pub floor: Vec<f64>,
    own: Vec<f64>,         // what errors are allowed besides, of nodes that are a diode's own
    error_floor: Vec<f64>, // `floor` and that
    group: Vec<usize>,     // unknowns of one kind and unit
    largest: [f64; 16],    // value of each group so far
    observed: u32,
    /// in Newton's norm; multipliers, derivative unknowns and algebraic currents are not
    pub in_norm: Vec<bool>,
    /// in the local error norm: what stands under d/dt
    pub in_error: Vec<bool>,
    pub norm_mask: Vec<f64>, // the same as 1 or 0
    pub error_mask: Vec<f64>,
    /// nodes of a group and its root (see floating_groups.rs)
    pub tied: Vec<(usize, usize)>,
    alone: Vec<f64>, // error_mask without these, of roots the share that their errors count for
}

/// What errors are measured by, for those who go through all unknowns block by block: 1 over the weights, 0 where they do not count.
#[derive(Clone, Copy)]
pub struct Norm<'a> {
    reltol: f64,
    rows: [&'a [f64]; 3], // share, peak, floor
}

impl<'a> Norm<'a> {
    /// share, peak and floor of every unknown, in whole blocks.
    #[inline(always)]
    pub fn rows(&self) -> [&'a [f64]; 3] {
        self.rows
    }

    /// What errors of a block of unknowns are multiplied by, which are a and b, and known to `noise`.
    #[inline(always)]
    pub fn inverse<L: Lanes>(&self, [share, peak, floor]: [L; 3], [a, b]: [L; 2], noise: L) -> L {
        share / (weight(self.reltol, [a, b, peak, floor]) + share * noise)
    }
}

impl Tolerances {
    pub fn new(sys: &System, o: &Options) -> Tolerances {
        let storage = |i: usize| sys.own_capacitance(i).abs();
        let atol = (sys.unknowns.iter().enumerate()).map(|(i, u)| o.absolute.of_unknown(u, storage(i), o.reltol));
        let in_norm: Vec<bool> = sys
            .unknowns
            .iter()
            .zip(&sys.differential)
            .map(|(u, &d)| !u.kind.enters_linearly() && (d || u.kind != Kind::Branch))
            .collect();
        let in_error: Vec<bool> = in_norm.iter().zip(&sys.differential).map(|(&a, &b)| a && b).collect();
        let mask = |of: &[bool]| of.iter().map(|&b| f64::from(b)).collect();
        let (norm_mask, error_mask): (Vec<f64>, Vec<f64>) = (mask(&in_norm), mask(&in_error));
        let tied: Vec<(usize, usize)> = sys.sums.iter().filter(|s| s.tied).map(|s| (s.node, s.root)).collect();
        let mut alone = error_mask.clone();
        for &(node, root) in &tied {
            // what the nodes of a group have in common is no state: it leaps where a diode turns off, whatever the
            // step, and what coils give it there is known one order less well than their currents. It is held to a
            // hundredth of its size, or to reltol where that is more. (Not held at all, the switch of a Cuk converter
            // had -35 V for -16 V; to reltol, a grounded secondary at 1e-7 took 124 501 steps for 787.)
            (alone[node], alone[root]) = (0.0, error_mask[root] * (o.reltol / 1e-2).min(1.0));
        }
        let vntol = o.absolute.of(Quantity::Voltage, o.reltol);
        let (atol, peak): (Vec<f64>, Vec<f64>) = (atol.collect(), vec![0.0; sys.n]);
        let mut kinds: Vec<(Kind, &str)> = Vec::new();
        let group = (sys.unknowns.iter())
            .map(|u| {
                let key = (u.kind, u.unit.as_str());
                kinds.iter().position(|&k| k == key).unwrap_or_else(|| {
                    kinds.push(key);
                    kinds.len() - 1
                })
            })
            .collect();
        let floor = atol.clone();
        let mut own = vec![0.0; sys.n];
        // the error of a device's own node, behind its series resistance, is a share of one volt: it stands off its terminal by a
        // current's drop, microvolts of which would otherwise be held to their own size. Accounts integrate the currents themselves
        for node in sys.behind_resistances().filter(|_| !o.accounts) {
            own[node] = o.reltol;
        }
        let mut error_floor: Vec<f64> = floor.iter().zip(&own).map(|(floor, own)| floor + own).collect();
        // whole blocks, see `Norm`
        let mut recent = peak.clone();
        let (mut peak, mut floor, mut norm_mask) = (peak, floor, norm_mask);
        for (row, filling) in [(&mut peak, 0.0), (&mut recent, 0.0), (&mut norm_mask, 0.0), (&mut alone, 0.0)]
            .into_iter()
            .chain([(&mut floor, 1.0), (&mut error_floor, 1.0)])
        {
            row.resize(whole(sys.n), filling);
        }
        Tolerances {
            reltol: o.reltol,
            vntol,
            accounts: o.accounts,
            atol,
            recent,
            last: vec![0.0; whole(sys.n)],
            peak,
            floor,
            own,
            error_floor,
            group,
            largest: [0.0; 16],
            observed: 0,
            in_norm,
            in_error,
            norm_mask,
            error_mask,
            tied,
            alone,
        }
    }

    /// The same tolerances, wider where reltol is tighter than `reltol`.
    pub fn at_least(&self, reltol: f64) -> Tolerances {
        let factor = (reltol / self.reltol).max(1.0);
        let mut t = self.clone();
        t.reltol *= factor;
        t.vntol *= factor;
        let absolute = t.atol.iter_mut().chain(&mut t.floor).chain(&mut t.own).chain(&mut t.error_floor);
        absolute.for_each(|a| *a *= factor);
        t
    }

    #[inline]
    pub fn weight(&self, i: usize, a: f64, b: f64) -> f64 {
        self.relative(i, a, b) + self.floor[i]
    }

    #[inline]
    fn relative(&self, i: usize, a: f64, b: f64) -> f64 {
        self.reltol * a.abs().max(b.abs()).max(PEAK_SHARE * self.recent[i])
    }

    /// ... in the local error norm.
    #[inline]
    pub fn error_weight(&self, i: usize, a: f64, b: f64) -> f64 {
        self.relative(i, a, b) + self.error_floor[i]
    }

    /// Weight of what is in no norm, a multiplier or an algebraic current: it follows linearly from the rest and is held
    /// to the largest of its kind and unit, since one force among large ones is known no better than these.
    pub fn own_scale(&self, i: usize, value: f64) -> f64 {
        self.reltol * value.abs().max(self.largest_like(i)) + self.atol[i]
    }

    /// Largest value so far of what is of the kind and unit of unknown i, now and then renewed.
    pub fn largest_like(&self, i: usize) -> f64 {
        self.largest[self.group[i].min(15)]
    }

    /// Largest |e_i| over the weight of x1_i, x0_i, in the local error norm.
    pub fn largest_error(&self, e: &[f64], x1: &[f64], x0: &[f64]) -> f64 {
        let n = self.atol.len();
        let worst = largest(self.reltol, &self.alone, &e[..n], [&x1[..n], &x0[..n], &self.recent, &self.error_floor]);
        worst.max(self.largest_tied(|i| e[i], x1, x0))
    }

    /// ... of what nodes of groups are apart; infinite where that is no number.
    pub fn largest_tied(&self, e: impl Fn(usize) -> f64, x1: &[f64], x0: &[f64]) -> f64 {
        let of =
            |&(node, root): &(usize, usize)| (e(node) - e(root)).abs() / self.error_weight(node, x1[node], x0[node]);
        self.tied.iter().map(of).fold(0.0, |worst, r| if r.is_finite() { worst.max(r) } else { f64::INFINITY })
    }

    /// Do a and b differ by more than so many tolerances in one of these unknowns under d/dt: by itself, or, tied by capacitors to others,
    /// against these, for what they have in common is no state?
    pub fn states_apart(&self, a: &[f64], b: &[f64], most: f64, of: impl Fn(usize) -> bool) -> bool {
        let by = |i: usize| a[i] - b[i];
        let weight = |i: usize| most * self.error_weight(i, a[i], b[i]);
        let tied = |&(node, root): &(usize, usize)| of(node) && (by(node) - by(root)).abs() > weight(node);
        let alone = |i: usize| of(i) && self.in_error[i] && self.share(i).is_some() && by(i).abs() > weight(i);
        (0..a.len()).any(alone) || self.tied.iter().any(tied)
    }

    /// What follows from states at once counts in the local error norm as well, maybe for less: 1 V behind 1 uA is much where amperes are
    /// the state, and an estimate that satisfies the algebraic rows has its error.
    pub fn count(&mut self, follows: impl Iterator<Item = usize>) {
        // a voltage that follows at once may be off by ten tolerances
        follows.for_each(|i| self.alone[i] = 0.1);
    }

    /// Does unknown i count by itself in the local error norm, and for how much?
    pub fn share(&self, i: usize) -> Option<f64> {
        Some(self.alone[i]).filter(|&share| share != 0.0)
    }

    /// Largest e_i over the weight of a_i, b_i, in Newton's norm; e not negative.
    pub fn largest_move(&self, e: &[f64], a: &[f64], b: &[f64]) -> f64 {
        largest(self.reltol, &self.norm_mask, e, [a, b, &self.recent, &self.floor])
    }

    /// Largest |e_i| over Newton's weight of a_i, b_i, of what counts by itself in the local error norm.
    pub fn largest_alone(&self, e: &[f64], a: &[f64], b: &[f64]) -> f64 {
        largest(self.reltol, &self.alone, e, [a, b, &self.recent, &self.floor])
    }

    /// The local error norm, of what counts by itself.
    pub fn norm(&self) -> Norm<'_> {
        Norm { reltol: self.reltol, rows: [&self.alone, &self.recent, &self.error_floor] }
    }

    /// x <- x + step; whether the step was within the tolerance of Newton's norm, and all is finite still. In whole blocks.
    #[inline(always)]
    pub fn advance<L: Lanes>(&self, step: &[f64], x: &mut [f64]) -> (bool, bool) {
        advance::<L>(self.reltol, [step, &self.norm_mask, &self.recent, &self.floor], x)
    }

    /// A step ended with x at t.
    #[inline(always)]
    pub fn observe(&mut self, x: &[f64], t: f64) {
        remember(&mut self.peak, &mut self.recent, &mut self.last, x, t);
        // floors move slowly: now and then is enough
        if self.observed % 16 == 0 {
            self.move_floors();
        }
        self.observed = self.observed.wrapping_add(1);
    }

    #[cold]
    #[inline(never)]
    fn move_floors(&mut self) {
        let largest = &mut self.largest;
        for (&g, &p) in self.group.iter().zip(&self.peak) {
            let l = &mut largest[g.min(15)];
            *l = l.max(p);
        }
        for ((f, &a), &g) in self.floor.iter_mut().zip(&self.atol).zip(&self.group) {
            // what rounding leaves of an unknown beside neighbours of size 1: a coordinate near zero of a chain of
            // metre-long links is known to some 1e-14 m, however small its own tolerance. Asking for less made tight
            // runs stop
            *f = a + 1e-12 * largest[g.min(15)];
        }
        for (all, (floor, own)) in self.error_floor.iter_mut().zip(self.floor.iter().zip(&self.own)) {
            *all = floor + own;
        }
    }
}

by_lanes! {
    fn remember<L>(peak: &mut [f64], recent: &mut [f64], last: &mut [f64], x: &[f64], t: f64) {
        let (kept, now, share) = (L::all(KEPT / t), L::all(t), L::all(PEAK_SHARE));
        let [peak, recent, last] = [peak, recent, last].map(in_blocks_mut);
        let n = peak.len();
        let (recent, last) = (&mut recent[..n], &mut last[..n]);
        for k in 0..n {
            let v = L::first(&x[LANES * k..]).abs();
            let (top, before) = (v.larger(L::at(&peak[k], 0)), L::at(&last[k], 0));
            let seen = v.if_less(share * top, L::all(0.0).if_less(before, before, now), now);
            // (at the start, when there is no time yet, all of it)
            let left = kept * seen;
            left.if_less(L::all(1.0), left * top, top).put(&mut recent[k], 0);
            top.put(&mut peak[k], 0);
            seen.put(&mut last[k], 0);
        }
    }
}

/// reltol times the largest of |a|, |b| and the share of the peak, and the floor.
#[inline(always)]
fn weight<L: Lanes>(reltol: f64, [a, b, peak, floor]: [L; 4]) -> L {
    L::all(reltol) * a.abs().larger(b.abs()).larger(L::all(PEAK_SHARE) * peak) + floor
}

by_lanes! {
    fn largest<L>(reltol: f64, share: &[f64], e: &[f64], of: [&[f64]; 4]) -> f64 {
        if e.len() < L::COUNT { largest_of::<One>(reltol, share, e, of) } else { largest_of::<L>(reltol, share, e, of) }
    }
}

/// Largest share times |e_i| over the weight of (a, b, peak, floor)_i; infinite where one that has a share is no number.
#[inline(always)]
fn largest_of<L: Lanes>(reltol: f64, share: &[f64], e: &[f64], [a, b, peak, floor]: [&[f64]; 4]) -> f64 {
    let (mut worst, mut numbers) = (L::all(0.0), L::all(0.0));
    for (_, [share, e, a, b, peak, floor]) in side_by_side::<L, 6>(e.len(), [share, e, a, b, peak, floor]) {
        worst = (share * e.abs() / weight(reltol, [a, b, peak, floor])).larger(worst);
        numbers = numbers + L::all(0.0) * e;
    }
    let odd = !numbers.is_zero() && e.iter().zip(share).any(|(e, share)| *share != 0.0 && e.is_nan());
    if odd {
        f64::INFINITY
    } else {
        worst.largest()
    }
}

/// x <- x + step; whether every step times its share was within the weight of (x, peak, floor), and every x is finite.
#[inline(always)]
fn advance<L: Lanes>(reltol: f64, rows: [&[f64]; 4], x: &mut [f64]) -> (bool, bool) {
    let x = in_blocks_mut(x);
    let n = x.len();
    let [step, share, peak, floor] = rows.map(|v| &in_blocks(v)[..n]);
    let (mut over, mut numbers) = (L::all(0.0), L::all(0.0));
    for k in 0..n {
        let [share, peak, floor] = [share, peak, floor].map(|v| L::at(&v[k], 0));
        let step = L::newly(&step[k]);
        let old = L::at(&x[k], 0);
        let new = old + step;
        over = (share * step.abs() - weight(reltol, [old, new, peak, floor])).larger(over);
        numbers = numbers + L::all(0.0) * new;
        new.put(&mut x[k], 0);
    }
    (over.is_zero(), numbers.is_zero())
}

#[cfg(test)]
mod tests {
    use super::{advance, largest, remember, Norm, KEPT, PEAK_SHARE};
    use crate::multiversion::{each, whole, Lanes, One, Plain, LANES};

    #[test]
    fn what_lies_long_behind_is_forgotten() {
        let (mut peak, mut recent, mut last) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut at = |x: f64, t: f64| {
            remember(&mut peak, &mut recent, &mut last, &[x, -x], t);
            assert_eq!(recent, [recent[0], recent[0], 0.0, 0.0]);
            recent[0]
        };
        assert_eq!(at(-2.0, 0.0), 2.0);
        assert_eq!([at(1.0, 1.0), at(0.03, 2.0), at(0.0, KEPT)], [2.0; 3]);
        // last above its share at 1 s, after the first step
        assert_eq!([at(0.01, 2.0 * KEPT), at(0.01, 20.0 * KEPT)], [1.0, 0.1]);
        assert_eq!(at(3.0, 30.0 * KEPT), 3.0);
        assert_eq!(at(0.0, 200.0 * KEPT), 3.0);
    }

    /// Every length up to three blocks: with a remainder, with a part of one block, whole.
    #[test]
    fn norms_are_those_of_every_unknown() {
        assert_eq!(largest(1e-2, &[], &[], [&[]; 4]), 0.0);
        assert_eq!(advance::<Plain>(1e-2, [&[]; 4], &mut []), (true, true));
        let number = |k: usize| ((k * 37 + 11) % 19) as f64 / 19.0 - 0.4;
        for n in 1..=12 {
            let of = |from: usize| -> Vec<f64> { (0..n).map(|i| number(from + 5 * i)).collect() };
            let (e, a, b, peak) = (of(1), of(2), of(3), of(4));
            let floor: Vec<f64> = of(5).iter().map(|f| 1e-3 * (1.0 + f)).collect();
            let share: Vec<f64> = (0..n).map(|i| [1.0, 0.0, 0.5][i % 3]).collect();
            let weight = |i: usize, a: f64, b: f64| 1e-2 * a.abs().max(b.abs()).max(PEAK_SHARE * peak[i]) + floor[i];
            let ratio = |i: usize| share[i] * e[i].abs() / weight(i, a[i], b[i]);
            let norm = |e: &[f64]| largest(1e-2, &share, e, [&a, &b, &peak, &floor]);
            assert_eq!(norm(&e), (0..n).map(ratio).fold(0.0, f64::max));
            for i in 0..n {
                let mut odd = e.clone();
                odd[i] = f64::NAN;
                let without = (0..n).filter(|&k| k != i).map(ratio).fold(0.0, f64::max);
                assert_eq!(norm(&odd), if share[i] > 0.0 { f64::INFINITY } else { without });
            }
            let by_blocks = Norm { reltol: 1e-2, rows: [&share, &peak, &floor] };
            for i in 0..n {
                let of = by_blocks.rows().map(|row| One::at(row, i));
                let inverse = by_blocks.inverse(of, [One::at(&a, i), One::at(&b, i)], One::all(0.0));
                assert_eq!(each(inverse)[0], share[i] / weight(i, a[i], b[i]));
            }
            let filled = |v: &[f64], filling: f64| {
                let mut v = v.to_vec();
                v.resize(whole(n), filling);
                v
            };
            let moved = |step: &[f64]| {
                let rows = [filled(step, 0.0), filled(&share, 0.0), filled(&peak, 0.0), filled(&floor, 1.0)];
                let mut x = filled(&a, 0.0);
                let outcome = advance::<Plain>(1e-2, rows.each_ref().map(|row| &row[..]), &mut x);
                x.truncate(n);
                (outcome, x)
            };
            for scale in [1e-4, 1.0] {
                let step: Vec<f64> = e.iter().map(|e| scale * e).collect();
                let to = |i: usize| a[i] + step[i];
                let within = (0..n).all(|i| share[i] * step[i].abs() <= weight(i, a[i], to(i)));
                assert_eq!(moved(&step), ((within, true), (0..n).map(to).collect::<Vec<_>>()));
            }
            let mut step = e.clone();
            step[n - 1] = f64::INFINITY;
            assert!(!moved(&step).0 .1);
        }
    }
}
