//! The expansion of diodes (expand.rs) four at a time.
use super::expand::{Diodes, Expansion, NUMBERS};
use super::DiodeSlot;
use crate::devices::diode::{Four, LANES};
use crate::lanes::{put_rows, Places, V};

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

impl Diodes<'_> {
    /// `expand` where there are registers of four numbers.
    #[inline]
    pub fn expand_fours(&mut self, x: &[f64], gmin: f64, limit: bool) -> Option<bool> {
        // SAFETY: there are none that go together where the processor has not AVX2 and FMA (`Four::new`)
        self.fours.any.then(|| unsafe { self.wide(x, gmin, limit) })
    }

    #[target_feature(enable = "avx2,fma")]
    unsafe fn wide(&mut self, x: &[f64], gmin: f64, limit: bool) -> bool {
        let (mut moved, fours) = (false, self.fours);
        for (k, together) in fours.groups.iter().enumerate() {
            let first = LANES * k;
            let last = self.slots.len().min(first + LANES);
            let Some(Together { four, p, n }) = together else {
                moved |= self.expand_each(first..last, x, gmin, limit);
                continue;
            };
            let held = &mut self.held[first..last];
            let v = V::gather(x, p) - V::gather(x, n);
            if limit && !four.quiet(v, V::first(held)) {
                moved |= self.expand_each(first..last, x, gmin, true);
                continue;
            }
            v.put_first(held);
            let [i, g, q, c] = four.eval(v, gmin);
            put_rows([v, v, i, g, q, c], numbers(&mut self.lines[first..last]));
        }
        moved
    }
}
