//! Diodes as straight lines: about the voltage at which the last evaluation met each.
use super::{across, DiodeSlot};
use crate::devices::diode::DiodeOut;
use std::ops::Range;

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
