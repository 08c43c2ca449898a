//! The expansion of diodes (expand.rs) four at a time.
use super::expand::{DiodeSlot, Diodes, Expansion, Met, Near, NUMBERS};
use crate::devices::diode::{Four, LANES};
use crate::lanes::{put_rows, take_rows, Places, V};

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

fn numbers(lines: &mut [Expansion]) -> &mut [[f64; NUMBERS]] {
    // SAFETY: an expansion is so many numbers in the order of its fields and nothing else
    unsafe { std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast(), lines.len()) }
}

/// Four straight lines of current and a times charge.
struct Line {
    at: V,
    current: V,
    conductance: V,
}

impl Line {
    #[inline(always)]
    fn of([_, at, i, g, q, c]: [V; NUMBERS], a: f64) -> Line {
        let a = V::all(a);
        Line { at, current: i + a * q, conductance: g + a * c }
    }

    /// `Near::fits` at v, where `met` was expanded.
    #[inline(always)]
    fn is_near(&self, v: V, met: &Line, near: &Near) -> bool {
        let line = self.current + self.conductance * (v - self.at);
        let worth = met.conductance * (V::all(near.reltol) * v.abs() + V::all(near.vntol));
        let share = V::all(near.share) * met.current.abs().max(V::all(near.least));
        (met.current - line).abs().all_within(worth + share)
    }
}

impl Diodes<'_> {
    /// `expand` where there are registers of four numbers.
    #[inline]
    pub fn expand_fours(&mut self, x: &[f64], gmin: f64, limit: bool, near: Option<Near>, met: &mut Met) -> bool {
        if self.fours.any {
            // SAFETY: there are none that go together where the processor has not AVX2 and FMA (`Four::new`)
            unsafe { self.wide(x, gmin, limit, near, met) }
        }
        self.fours.any
    }

    #[target_feature(enable = "avx2,fma")]
    unsafe fn wide(&mut self, x: &[f64], gmin: f64, limit: bool, near: Option<Near>, met: &mut Met) {
        let fours = self.fours;
        for (k, together) in fours.groups.iter().enumerate() {
            let first = LANES * k;
            let last = self.slots.len().min(first + LANES);
            let Some(Together { four, p, n }) = together else {
                self.expand_each(first..last, x, gmin, limit, near, met);
                continue;
            };
            let held = &mut self.held[first..last];
            let v = V::gather(x, p) - V::gather(x, n);
            if limit && !four.quiet(v, V::first(held)) {
                self.expand_each(first..last, x, gmin, true, near, met);
                continue;
            }
            v.put_first(held);
            let [i, g, q, c] = four.eval(v, gmin);
            let lines = numbers(&mut self.lines[first..last]);
            if let Some(near) = near {
                let before = Line::of(take_rows(lines), near.a);
                met.apart |= !before.is_near(v, &Line::of([v, v, i, g, q, c], near.a), &near);
            }
            put_rows([v, v, i, g, q, c], lines);
        }
    }
}
