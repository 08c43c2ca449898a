//! What tells one explicit Runge-Kutta method from another. Rows are lists of (stage, coefficient), zeros left out.

use super::super::root;
use crate::multiversion::LANES;
use crate::reduced::Reduced;
use crate::tape::{Move, Sequence, To};

pub type Row = &'static [(usize, f64)];

pub struct Tableau {
    pub order: i32,
    /// without the new point, whose slope has the number `stages`, and without the extra ones after it
    pub stages: usize,
    /// h |lambda| to which the method is stable on the negative real axis
    pub stable: f64,
    /// of the PI control: exponent of the last error
    pub beta: f64,
    /// longest growth of a step
    pub growth: f64,
    pub c: &'static [f64],
    pub a: &'static [Row],
    pub b: Row,
    /// stages of the dense output alone
    pub extra: &'static [Row],
    pub error: Row,
    /// a second estimate, of lower order, or empty
    pub coarse: Row,
    /// dense output, see `Explicit::dense`
    pub dense: &'static [Row],
}

/// A table of rows: slopes of the stages, at y1, extra ones; then y0 and what follows from the slopes; behind the rows the length
/// of the step and the times of the stages.
impl Tableau {
    pub const LAST: usize = 1; // rows after that of y0
    pub const Y1: usize = 2; // the new point
    pub const FINE: usize = 3; // the error estimate
    pub const COARSE: usize = 4; // the second one
    /// Coefficients of dense output from here on.
    pub const DENSE: usize = 1;

    pub fn y0(&self) -> usize {
        self.stages + 1 + self.extra.len()
    }

    /// Place of the length of the step; times follow.
    pub fn h(&self, width: usize) -> usize {
        (self.y0() + (1 + Tableau::COARSE).max(Tableau::DENSE + self.terms())) * width
    }

    pub fn size(&self, width: usize) -> usize {
        self.h(width) + 1 + self.stages
    }

    /// Terms of dense output.
    pub fn terms(&self) -> usize {
        3 + self.dense.len()
    }

    /// Length of a step in parts of one with such an error, the one before having had another: PI control.
    pub fn allows(&self, error: f64, before: f64) -> f64 {
        if self.beta == 0.0 {
            return root(error, self.order as usize).recip();
        }
        error.powf(0.75 * self.beta - 1.0 / f64::from(self.order)) * before.powf(self.beta)
    }

    /// All of a step up to y1 and its errors.
    pub fn step<'a>(&self, reduced: &'a Reduced) -> Option<&'a Sequence> {
        let (y0, from) = (self.y0(), Some(self.y0()));
        let last = [To::State, To::Row(y0 + Tableau::LAST)];
        let stage = |i: usize| {
            let to = if i + 1 < self.stages { &last[..1] } else { &last };
            Move { row: self.a[i], from, to, run: Some(i) }
        };
        let rest = [
            (self.b, from, [To::Row(y0 + Tableau::Y1)]),
            (self.error, None, [To::Row(y0 + Tableau::FINE)]),
            (self.coarse, None, [To::Row(y0 + Tableau::COARSE)]),
        ];
        let wanted = rest.iter().filter(|r| !r.0.is_empty() && self.known(r.0));
        let sums = wanted.map(|(row, from, to)| Move { row, from: *from, to, run: None });
        let moves: Vec<Move> = (1..self.stages).map(stage).chain(sums).collect();
        self.sequence(reduced, 0, &moves)
    }

    /// Does a row read the stages alone, not the slope at y1?
    pub fn known(&self, row: Row) -> bool {
        row.iter().all(|&(j, _)| j < self.stages)
    }

    /// The extra stages, and the terms of dense output that are sums.
    pub fn inside<'a>(&self, reduced: &'a Reduced) -> Option<&'a Sequence> {
        let (y0, state) = (self.y0(), [To::State]);
        let terms: Vec<[To; 1]> = (0..self.dense.len()).map(|i| [To::Row(y0 + Tableau::DENSE + 3 + i)]).collect();
        let extra = self.extra.iter().enumerate();
        let extra = extra.map(|(i, row)| Move { row, from: Some(y0), to: &state, run: Some(self.stages + 1 + i) });
        let sums = self.dense.iter().zip(&terms).map(|(row, to)| Move { row, from: None, to, run: None });
        let moves: Vec<Move> = extra.chain(sums).collect();
        self.sequence(reduced, 1, &moves)
    }

    fn sequence<'a>(&self, reduced: &'a Reduced, purpose: usize, moves: &[Move]) -> Option<&'a Sequence> {
        let h = self.h(reduced.width());
        reduced.sequence(2 * usize::from(self.order == 8) + purpose, moves, h, h + 1)
    }
}

/// out = y + h sum of a_j k_j, k by rows of the length of y.
#[inline]
pub fn combine(out: &mut [f64], y: &[f64], h: f64, row: Row, k: &[f64]) {
    let n = y.len();
    let out = &mut out[..n];
    sums(n, row, k, |i, sum| out[i] = y[i] + h * sum);
}

/// out = h sum of a_j k_j.
#[inline]
pub fn scaled(out: &mut [f64], h: f64, row: Row, k: &[f64]) {
    sums(out.len(), row, k, |i, sum| out[i] = h * sum);
}

/// Every component's sum is finished in registers before the next ones begin; rows are of whole vectors.
#[inline(always)]
fn sums(n: usize, row: Row, k: &[f64], mut take: impl FnMut(usize, f64)) {
    for i in (0..n).step_by(LANES) {
        let mut sum = [0.0; LANES];
        for &(j, a) in row {
            let kj: &[f64; LANES] = k[j * n + i..][..LANES].try_into().expect("so many");
            for l in 0..LANES {
                sum[l] += a * kj[l];
            }
        }
        for (l, &s) in sum.iter().enumerate() {
            take(i + l, s);
        }
    }
}
