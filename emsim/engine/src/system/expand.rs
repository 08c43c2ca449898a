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

impl Diodes<'_> {
    /// Expands every diode at x. With `limit` its voltage moves from the one it was held at by no more than SPICE's limiting allows;
    /// true where that made a difference.
    pub fn expand(&mut self, x: &[f64], gmin: f64, limit: bool) -> bool {
        #[cfg(target_arch = "x86_64")]
        if let Some(moved) = self.expand_fours(x, gmin, limit) {
            return moved;
        }
        self.expand_each(0..self.slots.len(), x, gmin, limit)
    }

    #[inline(never)]
    pub fn expand_each(&mut self, which: Range<usize>, x: &[f64], gmin: f64, limit: bool) -> bool {
        let mut moved = false;
        for k in which {
            let d = &self.slots[k];
            let v = across(x, d.p, d.n);
            let (at, limited) = if limit { d.kernel.limit(v, self.held[k]) } else { (v, false) };
            moved |= limited;
            self.held[k] = at;
            self.lines[k] = Expansion { v, at, o: d.kernel.eval(at, gmin) };
        }
        moved
    }
}
