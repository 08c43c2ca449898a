//! Rows at poses where a closed loop loses rank (links in one line). Forces there are 0/0: any number solves the equations. They have a
//! limit from either side all the same, and rows show that: by values of dense output at a tenth of a step's distance, where what a
//! state is off is not divided by next to nothing.
use crate::system::{Kind, System, Work};

/// A row is looked at where the closures are so near to a loss of rank, ...
const NEAR: f64 = 1e-2;
/// ... and its forces are limits where beside it they are so many times as far from one.
const NEARER: f64 = 0.1;
/// The look costs the cube of the closures in every row: no more of them are looked at.
const MOST: usize = 24;
/// Distance to the points beside it, in steps.
const BESIDE: f64 = 0.1;

pub struct Poses {
    closures: Vec<usize>,
    coordinates: Vec<usize>,
    shown: Vec<usize>, // unknowns of rows that follow from forces
    work: Box<Work>,   // what a method knows in its own is not touched
}

impl Poses {
    /// None without closed loops, with very many, or where no row shows a force. `lags`: unknowns that follow from what others change by.
    pub fn new(sys: &System, reads: &[u32], lags: &[bool]) -> Option<Poses> {
        let of = |kind: Kind| (0..sys.n).filter(|&i| sys.unknowns[i].kind == kind).collect::<Vec<_>>();
        let closures: Vec<usize> = of(Kind::Mu).into_iter().filter(|&i| !sys.has_q[i]).collect();
        let shown: Vec<usize> = reads.iter().map(|&k| k as usize).filter(|&k| lags[k]).collect();
        if closures.is_empty() || closures.len() > MOST || shown.is_empty() {
            return None;
        }
        let shown = (0..sys.n).filter(|&i| lags[i]).collect();
        Some(Poses { closures, coordinates: of(Kind::Coordinate), shown, work: Box::new(sys.work()) })
    }

    /// How near to a loss of rank the closures are at (t, x): the least that a row of dh/dq has of its own, 1 at most.
    fn nearness(&mut self, sys: &System, w: &Work, t: f64, x: &[f64]) -> f64 {
        self.work.follow(w, t);
        sys.eval_jacobian(&mut self.work, x, t, false);
        let slope = |row: usize, col: usize| sys.pattern.position(row, col).map_or(0.0, |k| self.work.gv[k]);
        let column = |&col: &usize| -> Vec<f64> { self.closures.iter().map(|&row| slope(row, col)).collect() };
        let mut columns: Vec<Vec<f64>> = self.coordinates.iter().map(column).collect();
        // metres and radians alike
        for column in &mut columns {
            let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            column.iter_mut().for_each(|v| *v /= largest.max(f64::MIN_POSITIVE));
        }
        let row = |k: usize| -> Vec<f64> { columns.iter().map(|c| c[k]).collect() };
        let mut rows: Vec<Vec<f64>> = (0..self.closures.len()).map(row).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // Gram and Schmidt, the longest first
        let mut least = 1.0_f64;
        while !rows.is_empty() {
            let longest = (0..rows.len()).max_by(|&a, &b| dot(&rows[a], &rows[a]).total_cmp(&dot(&rows[b], &rows[b])));
            let axis = rows.swap_remove(longest.unwrap_or(0));
            let square = dot(&axis, &axis);
            least = least.min(square.sqrt());
            if square > 0.0 {
                for row in &mut rows {
                    let part = dot(row, &axis) / square;
                    row.iter_mut().zip(&axis).for_each(|(v, a)| *v -= part * a);
                }
            }
        }
        least
    }

    /// Of the row (t, x) within the step (begin, end]: its forces as limits, where they are. `at`: the solution at a time within it.
    pub fn limit(
        &mut self,
        sys: &System,
        w: &mut Work,
        (t, x): (f64, &mut [f64]),
        (begin, end): (f64, f64),
        mut at: impl FnMut(&mut Work, f64) -> Vec<f64>,
    ) {
        let own = self.nearness(sys, w, t, x);
        if own > NEAR {
            return;
        }
        let d = BESIDE * (end - begin);
        // two points on a line with the row
        let (first, second, parts) = if t - d >= begin && t + d <= end {
            (t - d, t + d, [0.5, 0.5])
        } else if t - 2.0 * d >= begin {
            (t - d, t - 2.0 * d, [2.0, -1.0])
        } else {
            (t + d, t + 2.0 * d, [2.0, -1.0])
        };
        let sides = [first, second].map(|t| (t, at(w, t)));
        if sides.iter().all(|(t, y)| own < NEARER * self.nearness(sys, w, *t, y)) {
            self.shown.iter().for_each(|&i| x[i] = parts[0] * sides[0].1[i] + parts[1] * sides[1].1[i]);
        }
    }
}
