//! Diodes as straight lines: about the voltage at which the last evaluation met each.
use super::{across, add_pair};
use crate::devices::diode::{Diode, DiodeOut};
use crate::twice::LANES;
use std::ops::Range;

/// A diode in the equations: between which nodes, and where its numbers go.
pub struct DiodeSlot {
    pub kernel: Diode,
    pub p: i32,
    pub n: i32,
    pub rows: [i32; 4], // that hold its current, with the signs + - + -: p's, n's, sums that these are part of
    pub slots: [Option<usize>; 8], // (row, p) (row, n) of each
    pub outer: Option<(f64, usize)>, // of a node behind a series resistance: that conductance, and the place of the outer node's own entry
}

impl DiodeSlot {
    /// y <- y + v in p's rows, - v in n's.
    #[inline]
    pub fn add(&self, y: &mut [f64], v: f64) {
        add_pair(y, self.rows[0], self.rows[1], v);
        add_pair(y, self.rows[2], self.rows[3], v);
    }

    /// Places of its conductance in the matrix, with their signs.
    pub fn stamps(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let signed = self.slots.iter().zip([1.0, -1.0, -1.0, 1.0].into_iter().cycle());
        signed.filter_map(|(slot, sign)| slot.map(|slot| (slot, sign)))
    }

    /// Its rows, p's with true.
    pub fn rows(&self) -> impl Iterator<Item = (usize, bool)> {
        let rows = self.rows.into_iter().zip([true, false, true, false]);
        rows.filter_map(|(row, of_p)| Some((usize::try_from(row).ok()?, of_p)))
    }
}

/// A diode's characteristic as the last evaluation expanded it: about `at`, which is `v` unless limiting moved it.
#[derive(Clone, Copy, Default)]
pub struct Expansion {
    pub v: f64,
    pub at: f64,
    pub o: DiodeOut,
}

/// Which number of an expansion; the last two with the a of the stage it was asked for.
#[derive(Clone, Copy)]
pub enum Number {
    Voltage,
    At,
    Current,
    Conductance,
    Charge,
    Capacitance,
    StageCurrent,     // i + a q of the straight line, at the voltage
    StageConductance, // g + a c
}

pub const NUMBERS: usize = 8;

/// The same numbers of diodes side by side.
pub type Row = [f64; LANES];
pub type Rows = [Row; NUMBERS];

/// The expansions of all diodes, by `LANES` of them.
#[derive(Clone, Default)]
pub struct Lines {
    groups: Vec<Rows>,
    count: usize,
}

impl Lines {
    pub fn new(count: usize) -> Lines {
        Lines { groups: vec![[[0.0; LANES]; NUMBERS]; count.div_ceil(LANES)], count }
    }

    pub fn get(&self, k: usize) -> Expansion {
        let of = |number: Number| self.groups[k / LANES][number as usize][k % LANES];
        let [i, g, q, c] = [Number::Current, Number::Conductance, Number::Charge, Number::Capacitance].map(of);
        Expansion { v: of(Number::Voltage), at: of(Number::At), o: DiodeOut { i, g, q, c } }
    }

    pub fn put(&mut self, k: usize, e: &Expansion, a: f64) {
        let Expansion { v, at, o: DiodeOut { i, g, q, c } } = *e;
        let numbers = [v, at, i, g, q, c, e.current(a, v), e.conductance(a)];
        let group = &mut self.groups[k / LANES];
        group.iter_mut().zip(numbers).for_each(|(row, number)| row[k % LANES] = number);
    }

    pub fn iter(&self) -> impl Iterator<Item = Expansion> + '_ {
        (0..self.count).map(|k| self.get(k))
    }

    pub fn groups(&mut self) -> &mut [Rows] {
        &mut self.groups
    }

    /// All numbers, as programs read them, ...
    pub fn numbers(&self) -> &[f64] {
        self.groups.as_flattened().as_flattened()
    }

    /// ... and where one of diode k stands among them.
    pub fn place(k: usize, number: Number) -> usize {
        (k / LANES * NUMBERS + number as usize) * LANES + k % LANES
    }
}

impl Expansion {
    /// Current and a times charge of the straight line, at v.
    #[inline(always)]
    pub fn current(&self, a: f64, v: f64) -> f64 {
        self.o.i + a * self.o.q + self.conductance(a) * (v - self.at)
    }

    #[inline(always)]
    pub fn conductance(&self, a: f64) -> f64 {
        self.o.g + a * self.o.c
    }
}

/// How near a diode's current, its charge with it, is to be to that of the straight line which led to its voltage: to
/// so much of what the conductance makes of the voltage's tolerance, and to a share of itself.
#[derive(Clone, Copy)]
pub struct Near {
    pub reltol: f64,
    pub vntol: f64,
    pub share: f64,
    pub least: f64, // current that a share is taken of [A]
}

impl Near {
    fn fits(&self, line: f64, e: &Expansion, a: f64) -> bool {
        let current = e.current(a, e.v);
        let worth = e.conductance(a) * (self.reltol * e.v.abs() + self.vntol);
        (current - line).abs() <= worth + self.share * current.abs().max(self.least)
    }
}

#[cfg(target_arch = "x86_64")]
pub use super::fours::Fours;

/// Other processors take diodes one at a time.
#[cfg(not(target_arch = "x86_64"))]
pub struct Fours;

#[cfg(not(target_arch = "x86_64"))]
impl Fours {
    pub fn of(_: &[DiodeSlot]) -> Fours {
        Fours
    }
}

/// What there is of every diode, in one order.
pub struct Diodes<'a> {
    pub slots: &'a [DiodeSlot],
    pub fours: &'a Fours,
    pub held: &'a mut [f64],
    pub lines: &'a mut Lines,
}

/// How an expansion met the diodes.
#[derive(Clone, Copy, Default)]
pub struct Met {
    pub moved: bool, // limiting moved a voltage
    pub apart: bool, // a current is not near that of the straight line of before, where that was asked for
}

impl Diodes<'_> {
    /// Expands every diode at x. With `limit` its voltage moves from the one it was held at by no more than SPICE's
    /// limiting allows. `a` is that of the stage.
    #[inline(always)]
    pub fn expand(&mut self, x: &[f64], a: f64, gmin: f64, limit: bool, near: Option<Near>) -> Met {
        let mut met = Met::default();
        #[cfg(target_arch = "x86_64")]
        if self.expand_fours(x, a, gmin, limit, near, &mut met) {
            return met;
        }
        self.expand_each(0..self.slots.len(), x, a, gmin, limit, near, &mut met);
        met
    }

    #[inline(never)]
    #[allow(clippy::too_many_arguments)]
    pub fn expand_each(
        &mut self,
        which: Range<usize>,
        x: &[f64],
        a: f64,
        gmin: f64,
        limit: bool,
        near: Option<Near>,
        met: &mut Met,
    ) {
        for k in which {
            let d = &self.slots[k];
            let v = across(x, d.p, d.n);
            let (at, limited) = if limit { d.kernel.limit(v, self.held[k]) } else { (v, false) };
            met.moved |= limited;
            self.held[k] = at;
            let (before, line) = (self.lines.get(k), Expansion { v, at, o: d.kernel.eval(at, gmin) });
            met.apart |= near.is_some_and(|near| !near.fits(before.current(a, v), &line, a));
            self.lines.put(k, &line, a);
        }
    }
}
