//! Where the factors lie for a choice of pivots, whatever the numbers are.

use super::super::pivots::Pivots;
use super::super::Symbolic;

/// Multiply-subtract operations above which refactor uses a dense work vector.
const LIST_LIMIT: usize = 1_500_000;

/// Ranges of column k in `lu`: F from `first`, U from `upper`, the diagonal at `diagonal`, L up to `end`;
/// its groups end at `group_end`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Column {
    pub first: u32,
    pub upper: u32,
    pub diagonal: u32,
    pub end: u32,
    pub group_end: u32,
}

/// One entry of U at `u` and the column of L, `len` entries from `l`, that it multiplies.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    pub u: u32,
    pub l: u32,
    pub len: u32,
}

#[derive(Default)]
pub struct Arrangement {
    pub pivot_rows: Vec<u32>, // row (position before pivoting) of each pivot
    pub input_rows: Vec<u32>, // row of the original matrix of each pivot
    pub columns: Vec<Column>,
    pub rows: Vec<u32>,  // pivot number of the row of each entry of `lu`
    pub place: Vec<u32>, // where in `lu` each value of the caller goes; behind `rows` what is left out
    pub groups: Vec<Group>,
    pub targets: Vec<u32>, // empty when the dense work vector is used
    pub dense: bool,
    pub operations: usize, // multiply-subtracts of one refactorisation
    pub odd: bool,         // the permutation of rows
}

impl Arrangement {
    pub fn new(symbolic: &Symbolic, pivots: &Pivots) -> Arrangement {
        let (n, a) = (symbolic.n(), &symbolic.matrix);
        let input_rows: Vec<u32> = pivots.row.iter().map(|&row| symbolic.rows[row as usize]).collect();

        // columns of the layout: F, U ascending, diagonal, L ascending
        let mut columns = Vec::with_capacity(n);
        let mut rows = Vec::with_capacity(pivots.upper.len() + pivots.lower.len() + a.nnz());
        for range in symbolic.blocks.windows(2) {
            for k in range[0] as usize..range[1] as usize {
                let first = rows.len() as u32;
                let above = a.rows(k).iter().filter(|&&row| row < range[0]);
                rows.extend(above.map(|&row| pivots.rank[row as usize]));
                let upper = rows.len();
                rows.extend_from_slice(
                    &pivots.upper[pivots.upper_start[k] as usize..pivots.upper_start[k + 1] as usize],
                );
                rows[upper..].sort_unstable();
                let diagonal = rows.len();
                rows.push(k as u32);
                let lower = &pivots.lower[pivots.lower_start[k] as usize..pivots.lower_start[k + 1] as usize];
                rows.extend(lower.iter().map(|&row| pivots.rank[row as usize]));
                rows[diagonal + 1..].sort_unstable();
                columns.push(Column {
                    first,
                    upper: upper as u32,
                    diagonal: diagonal as u32,
                    end: rows.len() as u32,
                    group_end: 0,
                });
            }
        }

        let mut operations = 0;
        for c in &columns {
            for &j in &rows[c.upper as usize..c.diagonal as usize] {
                let from = &columns[j as usize];
                operations += (from.end - from.diagonal - 1) as usize;
            }
        }
        let dense = operations > LIST_LIMIT;

        // places of the caller's values, and the groups with their targets
        let mut at = vec![0u32; n];
        let mut place = vec![rows.len() as u32; symbolic.slots];
        let mut groups = Vec::with_capacity(pivots.upper.len());
        let mut targets = Vec::with_capacity(if dense { 0 } else { operations });
        for k in 0..n {
            let c = columns[k];
            for e in c.first..c.end {
                at[rows[e as usize] as usize] = e;
            }
            for (row, source) in a.entries(k) {
                place[source] = at[pivots.rank[row as usize] as usize];
            }
            for u in c.upper..c.diagonal {
                let from = columns[rows[u as usize] as usize];
                let len = from.end - from.diagonal - 1;
                if len == 0 {
                    continue;
                }
                groups.push(Group { u, l: from.diagonal + 1, len });
                if !dense {
                    let rows = &rows[from.diagonal as usize + 1..from.end as usize];
                    targets.extend(rows.iter().map(|&row| at[row as usize]));
                }
            }
            columns[k].group_end = groups.len() as u32;
        }
        let odd = odd(&input_rows) ^ odd(&symbolic.cols);
        let pivot_rows = pivots.row.clone();
        Arrangement { pivot_rows, input_rows, columns, rows, place, groups, targets, dense, operations, odd }
    }
}

/// Is it an odd permutation?
fn odd(rows: &[u32]) -> bool {
    let (mut odd, mut seen) = (false, vec![false; rows.len()]);
    for start in 0..rows.len() {
        let mut at = start;
        while !std::mem::replace(&mut seen[at], true) {
            at = rows[at] as usize;
            odd ^= at != start;
        }
    }
    odd
}
