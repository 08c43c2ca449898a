//! Ordering by the pattern alone: maximum matching, block triangular form, fill-reducing order in each block.
//!
//! 1. Matching. A set of entries, one in each row and column, becomes the diagonal. Found by augmenting paths (Duff's MC21);
//!    true diagonal entries are taken first, for they keep the symmetry on which AMD relies. If no full matching exists the
//!    matrix is singular whatever its values are.
//! 2. Blocks. With column j an edge to the column matched to each of its rows, the strongly connected components are the
//!    diagonal blocks. Tarjan's algorithm gives a component after all those that it points to, which is the order that makes
//!    the matrix block UPPER triangular.
//! 3. AMD on B + B^T of each block B.
//!
//! Everything is iterative: a ladder of 100 000 nodes would overflow the stack of a recursive search.

mod loose;

use self::loose::Loose;
use super::program::Shelf;
use super::{Pattern, Singular, NONE};
use std::ops::{Deref, Range};
use std::sync::Arc;

/// What the pattern alone says, shared by all factors of it.
#[derive(Clone)]
pub struct Symbolic(Arc<Analysis>);

/// The permutations: position k of the permuted matrix holds row `rows[k]` and column `cols[k]`;
/// block b takes the positions `blocks[b]..blocks[b + 1]`.
pub struct Analysis {
    pub(super) rows: Vec<u32>,
    pub(super) cols: Vec<u32>,
    pub(super) blocks: Vec<u32>,
    pub(super) matrix: Columns,
    pub(super) shelf: Shelf,
    pub(super) slots: usize, // values that the caller gives
    fill: (usize, usize),
    loose: Option<Loose>,
    open: Vec<bool>, // which of the loose rows are left out here
}

/// The permuted matrix by columns: entry p of position k has its value at `source[p]` of the caller's list and stands in the
/// row at position `rows[p]` (before pivoting).
pub(super) struct Columns {
    start: Vec<u32>,
    rows: Vec<u32>,
    source: Vec<u32>,
}

impl Columns {
    fn new(pattern: &Pattern, rows: &[u32], cols: &[u32]) -> Columns {
        let mut position = vec![0u32; pattern.n];
        for (k, &row) in rows.iter().enumerate() {
            position[row as usize] = k as u32;
        }
        let mut matrix = Columns {
            start: Vec::with_capacity(pattern.n + 1),
            rows: Vec::with_capacity(pattern.nnz()),
            source: Vec::with_capacity(pattern.nnz()),
        };
        matrix.start.push(0);
        for &col in cols {
            for p in pattern.colptr[col as usize]..pattern.colptr[col as usize + 1] {
                matrix.rows.push(position[pattern.rowidx[p]]);
                matrix.source.push(p as u32);
            }
            matrix.start.push(matrix.rows.len() as u32);
        }
        matrix
    }

    pub fn nnz(&self) -> usize {
        self.rows.len()
    }

    fn range(&self, k: usize) -> Range<usize> {
        self.start[k] as usize..self.start[k + 1] as usize
    }

    /// Rows of position k.
    pub fn rows(&self, k: usize) -> &[u32] {
        &self.rows[self.range(k)]
    }

    /// (row, place of its value) of position k.
    pub fn entries(&self, k: usize) -> impl Iterator<Item = (u32, usize)> + '_ {
        let range = self.range(k);
        self.rows[range.clone()].iter().copied().zip(self.source[range].iter().map(|&p| p as usize))
    }
}

impl Deref for Symbolic {
    type Target = Analysis;
    fn deref(&self) -> &Analysis {
        &self.0
    }
}

impl Symbolic {
    /// Analyses a pattern. Errors name an unmatched row and column.
    pub fn analyse(pattern: &Pattern) -> Result<Symbolic, Singular> {
        Ok(Symbolic(Arc::new(Symbolic::analysed(pattern)?)))
    }

    fn analysed(pattern: &Pattern) -> Result<Analysis, Singular> {
        let n = pattern.n;
        let row_of = maximum_matching(pattern)?;
        let mut col_of = vec![NONE; n];
        for (col, &row) in row_of.iter().enumerate() {
            col_of[row as usize] = col as u32;
        }
        let (mut cols, blocks) = strong_components(pattern, &col_of);
        let mut fill = (0, 0);
        for b in 0..blocks.len() - 1 {
            let block = &mut cols[blocks[b] as usize..blocks[b + 1] as usize];
            let (operations, entries) = fill_reducing(pattern, &col_of, block);
            fill = (fill.0 + operations, fill.1 + entries);
        }
        let rows: Vec<u32> = cols.iter().map(|&col| row_of[col as usize]).collect();
        let matrix = Columns::new(pattern, &rows, &cols);
        let (slots, shelf) = (pattern.nnz(), Shelf::default());
        Ok(Analysis { rows, cols, blocks, matrix, shelf, slots, fill, loose: None, open: Vec::new() })
    }

    pub fn n(&self) -> usize {
        self.cols.len()
    }

    /// What the order says of factors with pivots on the diagonal, of blocks of more than `SMALL` unknowns: multiply-subtract
    /// operations of a factorisation, entries off the diagonal of both factors.
    pub fn fill(&self) -> (usize, usize) {
        self.fill
    }
}

/// Row matched to each column.
fn maximum_matching(pattern: &Pattern) -> Result<Vec<u32>, Singular> {
    let n = pattern.n;
    let mut row_of = vec![NONE; n];
    let mut col_of = vec![NONE; n];
    for j in 0..n {
        if pattern.column(j).binary_search(&j).is_ok() {
            row_of[j] = j as u32;
            col_of[j] = j as u32;
        }
    }

    // `free[j]`: how far column j was searched for a free row (never to be searched again: rows stay matched);
    // `seen[j]`: the start column whose search has visited j; the path is a stack of (column, next entry, row taken)
    let mut free: Vec<usize> = pattern.colptr[..n].to_vec();
    let mut seen = vec![NONE; n];
    let mut path: Vec<(usize, usize, usize)> = Vec::new();
    let mut failed_col = None;
    for start in 0..n {
        if row_of[start] != NONE {
            continue;
        }
        path.clear();
        path.push((start, pattern.colptr[start], 0));
        seen[start] = start as u32;
        let mut found = false;
        'search: while let Some(&(col, next, _)) = path.last() {
            let end = pattern.colptr[col + 1];
            // a free row at once?
            while free[col] < end {
                let row = pattern.rowidx[free[col]];
                free[col] += 1;
                if col_of[row] == NONE {
                    path.last_mut().unwrap().2 = row;
                    found = true;
                    break 'search;
                }
            }
            // else go on to the owner of one of the rows
            let top = path.last_mut().unwrap();
            for p in next..end {
                let row = pattern.rowidx[p];
                let owner = col_of[row] as usize;
                if seen[owner] != start as u32 {
                    seen[owner] = start as u32;
                    top.1 = p + 1;
                    top.2 = row;
                    path.push((owner, pattern.colptr[owner], 0));
                    continue 'search;
                }
            }
            path.pop();
        }
        if !found {
            failed_col.get_or_insert(start);
            continue;
        }
        // flip the path: each column on it takes the row by which it was left
        for &(col, _, row) in &path {
            row_of[col] = row as u32;
            col_of[row] = col as u32;
        }
    }
    match failed_col {
        None => Ok(row_of),
        Some(col) => Err(Singular {
            row: col_of.iter().position(|&c| c == NONE),
            col: Some(col),
            structural: true,
            finite: true,
        }),
    }
}

/// Columns block by block, and the block boundaries.
fn strong_components(pattern: &Pattern, col_of: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.n;
    let mut cols = Vec::with_capacity(n);
    let mut blocks = vec![0u32];
    let mut index = vec![NONE; n];
    let mut low = vec![0u32; n];
    let mut done = vec![false; n];
    let mut open: Vec<u32> = Vec::new(); // Tarjan's stack of columns not yet in a component
    let mut calls: Vec<(usize, usize)> = Vec::new(); // (column, next entry)
    let mut counter = 0u32;
    for start in 0..n {
        if index[start] != NONE {
            continue;
        }
        calls.push((start, pattern.colptr[start]));
        while let Some(&(col, next)) = calls.last() {
            if index[col] == NONE {
                index[col] = counter;
                low[col] = counter;
                counter += 1;
                open.push(col as u32);
            }
            let mut p = next;
            let mut descend = None;
            while p < pattern.colptr[col + 1] {
                let to = col_of[pattern.rowidx[p]] as usize;
                p += 1;
                if index[to] == NONE {
                    descend = Some(to);
                    break;
                }
                if !done[to] {
                    low[col] = low[col].min(index[to]);
                }
            }
            calls.last_mut().unwrap().1 = p;
            if let Some(to) = descend {
                calls.push((to, pattern.colptr[to]));
                continue;
            }
            if low[col] == index[col] {
                while let Some(member) = open.pop() {
                    done[member as usize] = true;
                    cols.push(member);
                    if member as usize == col {
                        break;
                    }
                }
                blocks.push(cols.len() as u32);
            }
            calls.pop();
            if let Some(&(parent, _)) = calls.last() {
                low[parent] = low[parent].min(low[col]);
            }
        }
    }
    (cols, blocks)
}

/// Up to this size a set of unknowns is the bits of a number.
const SMALL: usize = 64;

/// Minimum degree, and of equal degrees the pivot that waits for the shortest chain of others: straight-line code takes as long as the
/// longest chain of divisions that wait for each other. (Eight diodes of a multiplier: from both ends of the ladder to its middle.)
fn short_chains(colptr: &[i64], rowidx: &[i64]) -> Vec<usize> {
    let size = colptr.len() - 1;
    let mut beside = vec![0_u64; size];
    for col in 0..size {
        for &row in &rowidx[colptr[col] as usize..colptr[col + 1] as usize] {
            beside[col] |= 1 << row;
            beside[row as usize] |= 1 << col;
        }
    }
    let (mut left, mut chain, mut order) = (Vec::from_iter(0..size), vec![0; size], Vec::with_capacity(size));
    while !left.is_empty() {
        let of = |&k: &usize| (beside[left[k]].count_ones(), chain[left[k]], left[k]);
        let Some(next) = (0..left.len()).min_by_key(of) else { break };
        let pivot = left.swap_remove(next);
        let others = beside[pivot] & !(1 << pivot);
        for &k in left.iter().filter(|&k| others >> k & 1 == 1) {
            beside[k] = (beside[k] | others) & !(1 << pivot);
            chain[k] = chain[k].max(chain[pivot] + 1);
        }
        order.push(pivot);
    }
    order
}

/// Reorders the columns of one block: those of a large one by approximate minimum degree, with what that says of the factors
/// (`Symbolic::fill`).
fn fill_reducing(pattern: &Pattern, col_of: &[u32], block: &mut [u32]) -> (usize, usize) {
    let size = block.len();
    if size < 3 {
        return (0, 0);
    }
    // the block with matched rows brought to the diagonal, in local numbers; AMD takes jumbled columns
    block.sort_unstable();
    let mut colptr = Vec::with_capacity(size + 1);
    let mut rowidx: Vec<i64> = Vec::new();
    colptr.push(0i64);
    for &col in block.iter() {
        let first = rowidx.len();
        for &row in pattern.column(col as usize) {
            if let Ok(local) = block.binary_search(&col_of[row]) {
                rowidx.push(local as i64);
            }
        }
        rowidx[first..].sort_unstable();
        colptr.push(rowidx.len() as i64);
    }
    if size <= SMALL {
        let natural = block.to_vec();
        for (place, local) in block.iter_mut().zip(short_chains(&colptr, &rowidx)) {
            *place = natural[local];
        }
        return (0, 0);
    }
    // on a refusal (not known to happen) the natural order still gives a correct, if fuller, factorisation
    let Ok((order, _, said)) = amd::order::<i64>(size as i64, &colptr, &rowidx, &amd::Control::default()) else {
        return (0, 0);
    };
    let natural = block.to_vec();
    for (place, &local) in block.iter_mut().zip(&order) {
        *place = natural[local as usize];
    }
    (said.n_mult_subs_lu, 2 * said.lnz)
}
