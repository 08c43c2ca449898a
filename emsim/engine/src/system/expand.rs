//! Diodes as straight lines: about the voltage at which the last evaluation met each.
use super::{across, add_pair};
use crate::devices::diode::{Diode, DiodeOut};
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
#[repr(C)]
pub struct Expansion {
    pub v: f64,
    pub at: f64,
    pub o: DiodeOut,
}

/// Numbers of an expansion, as programs read them.
pub const NUMBERS: usize = 6;
const _: () = assert!(std::mem::size_of::<Expansion>() == NUMBERS * std::mem::size_of::<f64>());

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
    pub a: f64,
    pub reltol: f64,
    pub vntol: f64,
    pub share: f64,
    pub least: f64, // current that a share is taken of [A]
}

impl Near {
    fn fits(&self, line: f64, e: &Expansion) -> bool {
        let current = e.current(self.a, e.v);
        let worth = e.conductance(self.a) * (self.reltol * e.v.abs() + self.vntol);
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
    pub lines: &'a mut [Expansion],
}

/// How an expansion met the diodes.
#[derive(Clone, Copy, Default)]
pub struct Met {
    pub moved: bool, // limiting moved a voltage
    pub apart: bool, // a current is not near that of the straight line of before, where that was asked for
}

impl Diodes<'_> {
    /// Expands every diode at x. With `limit` its voltage moves from the one it was held at by no more than SPICE's
    /// limiting allows.
    pub fn expand(&mut self, x: &[f64], gmin: f64, limit: bool, near: Option<Near>) -> Met {
        let mut met = Met::default();
        #[cfg(target_arch = "x86_64")]
        if self.expand_fours(x, gmin, limit, near, &mut met) {
            return met;
        }
        self.expand_each(0..self.slots.len(), x, gmin, limit, near, &mut met);
        met
    }

    #[inline(never)]
    pub fn expand_each(
        &mut self,
        which: Range<usize>,
        x: &[f64],
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
            let line = &mut self.lines[k];
            let before = std::mem::replace(line, Expansion { v, at, o: d.kernel.eval(at, gmin) });
            met.apart |= near.is_some_and(|near| !near.fits(before.current(near.a, v), line));
        }
    }
}
