//! The equations at several points of a step that are solved for together: a matrix of blocks, one for every pair of points, each of
//! the entries of the system's own.
use super::System;
use crate::sparse::{Pattern, Symbolic};

/// Stages of Radau at order 5, the only one that asks.
pub const POINTS: usize = 3;

pub struct Together {
    pub pattern: Pattern,
    pub symbolic: Symbolic,
    /// entry k of the system's pattern, block (i, j): place [(k POINTS + i) POINTS + j], usize::MAX where there is none
    pub place: Vec<usize>,
}

impl System {
    /// None where such a matrix has no inverse, whatever stands in it. A charge at one point stands in the rows of all.
    pub fn together(&self) -> Option<&Together> {
        self.made.together.get_or_init(|| self.laid_out()).as_ref()
    }

    fn laid_out(&self) -> Option<Together> {
        let (n, s, p) = (self.n, POINTS, &self.pattern);
        let cells: Vec<(usize, usize)> = (0..n).flat_map(|c| p.column(c).iter().map(move |&r| (r, c))).collect();
        let stands = |i: usize, j: usize, r: usize| i == j || self.has_q[r];
        let mut entries = Vec::with_capacity(s * s * cells.len());
        for &(r, c) in &cells {
            for i in 0..s {
                entries.extend((0..s).filter(|&j| stands(i, j, r)).map(|j| (i * n + r, j * n + c)));
            }
        }
        let pattern = Pattern::from_entries(s * n, &entries);
        let mut place = vec![usize::MAX; s * s * cells.len()];
        for (k, &(r, c)) in cells.iter().enumerate() {
            for i in 0..s {
                for j in (0..s).filter(|&j| stands(i, j, r)) {
                    place[(k * s + i) * s + j] = pattern.position(i * n + r, j * n + c)?;
                }
            }
        }
        let loose: Vec<usize> = self.loose_rows().iter().flat_map(|r| (0..s).map(move |i| i * n + r)).collect();
        let symbolic = Symbolic::loosely(&pattern, &loose).ok()?;
        Some(Together { pattern, symbolic, place })
    }
}
