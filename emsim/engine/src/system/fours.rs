//! The expansion of diodes (expand.rs) four at a time.
use super::expand::{DiodeSlot, Diodes, Met, Near, Number, Rows};
use crate::devices::diode::{Four, LANES};
use crate::lanes::{Places, V};

/// Diodes that go together.
struct Together {
    four: Four,
    p: Places,
    n: Places,
}

/// The diodes of a system four by four; None where they cannot go together.
pub struct Fours {
    groups: Vec<Option<Together>>,
    any: bool,
}

impl Fours {
    pub fn of(diodes: &[DiodeSlot]) -> Fours {
        let together = |slots: &[DiodeSlot]| {
            let four = Four::new(&slots.iter().map(|d| &d.kernel).collect::<Vec<_>>())?;
            let places =
                |node: fn(&DiodeSlot) -> i32| Places::new(std::array::from_fn(|k| slots.get(k).map_or(-1, node)));
            Some(Together { four, p: places(|d| d.p), n: places(|d| d.n) })
        };
        let groups: Vec<_> = diodes.chunks(LANES).map(together).collect();
        let any = groups.iter().any(Option::is_some);
        Fours { groups, any }
    }
}

/// Four straight lines of current and a times charge, as an expansion has them.
struct Line {
    at: V,
    current: V,
    conductance: V,
}

impl Line {
    #[inline(always)]
    fn of(rows: &Rows) -> Line {
        let [at, current, conductance] = [Number::Voltage, Number::StageCurrent, Number::StageConductance]
            .map(|number| V::load(&rows[number as usize]));
        Line { at, current, conductance }
    }

    /// `Near::fits` where `met` was expanded.
    #[inline(always)]
    fn is_near(&self, met: &Line, near: &Near) -> bool {
        let line = self.current + self.conductance * (met.at - self.at);
        let worth = met.conductance * (V::all(near.reltol) * met.at.abs() + V::all(near.vntol));
        let share = V::all(near.share) * met.current.abs().max(V::all(near.least));
        (met.current - line).abs().all_within(worth + share)
    }
}

impl Diodes<'_> {
    /// `expand` where there are registers of four numbers.
    #[inline]
    pub fn expand_fours(
        &mut self,
        x: &[f64],
        a: f64,
        gmin: f64,
        limit: bool,
        near: Option<Near>,
        met: &mut Met,
    ) -> bool {
        if self.fours.any {
            // SAFETY: there are none that go together where the processor has not AVX2 and FMA (`Four::new`)
            unsafe { self.wide(x, a, gmin, limit, near, met) }
        }
        self.fours.any
    }

    #[target_feature(enable = "avx2,fma")]
    unsafe fn wide(&mut self, x: &[f64], a: f64, gmin: f64, limit: bool, near: Option<Near>, met: &mut Met) {
        let fours = self.fours;
        for (k, together) in fours.groups.iter().enumerate() {
            let first = LANES * k;
            let last = self.slots.len().min(first + LANES);
            let Some(Together { four, p, n }) = together else {
                self.expand_each(first..last, x, a, gmin, limit, near, met);
                continue;
            };
            let held = &mut self.held[first..last];
            let v = V::gather(x, p) - V::gather(x, n);
            if limit && !four.quiet(v, V::first(held)) {
                self.expand_each(first..last, x, a, gmin, true, near, met);
                continue;
            }
            v.put_first(held);
            let ([i, g, q, c], [current, conductance]) = four.eval(v, gmin, a);
            let rows = &mut self.lines.groups()[k];
            if let Some(near) = near {
                met.apart |= !Line::of(rows).is_near(&Line { at: v, current, conductance }, &near);
            }
            *rows = [v, v, i, g, q, c, current, conductance].map(V::store);
        }
    }
}
