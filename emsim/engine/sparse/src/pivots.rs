//! Gilbert-Peierls elimination: finds the pivots and the pattern of the factors.
//!
//! Column k of a block, left-looking: solve L x = a_k with the columns of L already known; the part of x in pivoted rows is
//! column k of U, the rest divided by the pivot is column k of L. Which columns of L take part is found beforehand by a
//! depth-first search through the pattern of L, so that the work is proportional to the multiplications. Eisenstat-Liu
//! pruning shortens the search: once a later column has a symmetric pair with column j, its own pattern covers the rest of j.
//!
//! Pivot choice: the largest entry of column k, weighted by row scales, unless the diagonal entry reaches 1e-3 of it. The row
//! scales r_i = 1 / max_j (|a_ij| / c_j), c_j = max_i |a_ij| only weigh the choice: the factors of the scaled matrix and of the
//! original one differ by these weights alone, so scaling inside the elimination would cost time and change nothing. They make
//! the choice blind to equations written in nanoamperes beside volts, and to columns scaled as a whole.
//!
//! Singular: every candidate has drowned in cancellation, |x_i| <= (1 + log2 n) eps m_i, with m_i the sum of the magnitudes
//! of the terms that made x_i and n the size of the block (rounding errors add up along the elimination). This needs no
//! absolute threshold: a pivot of 1e-20 that is exact is good, one of 1e-3 left over from 1e14 is not. It catches what
//! floats; it does not promise to catch every ill-conditioned matrix.
//!
//! The values found here are not kept. `Lu` lays the pattern out for refactorisation and computes the values by it, so that a
//! first and a repeated factorisation give the same bits.

use super::{Scalar, Singular, Symbolic, NONE};
use emsim_expr::interrupt;

/// A diagonal entry of at least this part of the largest candidate is preferred.
const DIAGONAL_THRESHOLD: f64 = 1e-3;

/// Result of an elimination. Rows and columns are positions before pivoting unless said otherwise.
pub(super) struct Pivots {
    /// Row taken as pivot k.
    pub row: Vec<u32>,
    /// Its inverse: the pivot that a row became.
    pub rank: Vec<u32>,
    /// Pattern of U without its diagonal, by columns, as pivots (column k: `upper[upper_start[k]..upper_start[k + 1]]`).
    pub upper_start: Vec<u32>,
    pub upper: Vec<u32>,
    /// Pattern of L without its diagonal, by columns, as rows.
    pub lower_start: Vec<u32>,
    pub lower: Vec<u32>,
    /// Row weights used in the choice.
    pub scale: Vec<f64>,
    /// Size of each pivot.
    pub size: Vec<f64>,
}

/// Factors `values`; errors name the row and column that could not be eliminated.
pub(super) fn eliminate<T: Scalar>(symbolic: &Symbolic, values: &[T]) -> Result<Pivots, Singular> {
    let (n, a) = (symbolic.n(), &symbolic.matrix);
    let singular = |row: u32, k: usize| Singular {
        row: Some(symbolic.rows[row as usize] as usize),
        col: Some(symbolic.cols[k] as usize),
        structural: false,
        finite: true,
    };
    let not_finite = |(row, k): (u32, usize)| Singular { finite: false, ..singular(row, k) };
    let sizes: Vec<f64> = values.iter().map(|v| v.magnitude()).collect();
    let scale = row_scales(symbolic, &sizes).map_err(not_finite)?;

    let nnz = a.nnz();
    let mut out = Pivots {
        row: vec![NONE; n],
        rank: vec![NONE; n],
        upper_start: Vec::with_capacity(n + 1),
        upper: Vec::with_capacity(nnz),
        lower_start: Vec::with_capacity(n + 1),
        lower: Vec::with_capacity(nnz),
        scale,
        size: vec![0.0; n],
    };
    out.upper_start.push(0);
    out.lower_start.push(0);
    let mut lower_values: Vec<T> = Vec::with_capacity(nnz);
    let mut pruned: Vec<u32> = vec![0; n]; // end of the part of column j of L that the search must follow
    let mut is_pruned = vec![false; n];

    // the dense column x, the sum of its terms' magnitudes, the mark of the search, and the search's stack
    let mut x = vec![T::ZERO; n];
    let mut term = vec![0.0f64; n];
    let mut mark = vec![NONE; n];
    let mut stack: Vec<(u32, u32)> = Vec::with_capacity(n);
    let mut topological: Vec<u32> = Vec::with_capacity(n); // columns of L to use, last first
    let mut candidates: Vec<u32> = Vec::with_capacity(n);

    // the row that counts as diagonal of a column, and back; changes when a pivot is taken elsewhere
    let mut diagonal: Vec<u32> = (0..n as u32).collect();
    let mut diagonal_of: Vec<u32> = (0..n as u32).collect();

    for b in 0..symbolic.blocks.len() - 1 {
        let (first, last) = (symbolic.blocks[b], symbolic.blocks[b + 1]);
        let noise = (1.0 + f64::from(last - first).log2()) * f64::EPSILON;
        for k in first..last {
            let kk = k as usize;
            interrupt::spent(50 * (1 + topological.len() + candidates.len()));
            // pattern of column k: everything reachable from its entries
            topological.clear();
            candidates.clear();
            for &row in a.rows(kk) {
                if row < first || mark[row as usize] == k {
                    continue;
                }
                mark[row as usize] = k;
                if out.rank[row as usize] == NONE {
                    candidates.push(row);
                    continue;
                }
                let j = out.rank[row as usize];
                stack.push((j, out.lower_start[j as usize]));
                while let Some(top) = stack.last_mut() {
                    let j = top.0 as usize;
                    let mut next = top.1;
                    let mut descend = None;
                    while next < pruned[j] {
                        let row = out.lower[next as usize];
                        next += 1;
                        if mark[row as usize] == k {
                            continue;
                        }
                        mark[row as usize] = k;
                        let to = out.rank[row as usize];
                        if to == NONE {
                            candidates.push(row);
                        } else {
                            descend = Some(to);
                            break;
                        }
                    }
                    top.1 = next;
                    match descend {
                        Some(to) => stack.push((to, out.lower_start[to as usize])),
                        None => {
                            topological.push(j as u32);
                            stack.pop();
                        }
                    }
                }
            }

            // numerical values: x = L^-1 a_k
            for (row, source) in a.entries(kk) {
                if row >= first {
                    x[row as usize] = values[source];
                    term[row as usize] = sizes[source];
                }
            }
            for &j in topological.iter().rev() {
                let row = out.row[j as usize] as usize;
                let u = x[row];
                x[row] = T::ZERO;
                term[row] = 0.0;
                let range = out.lower_start[j as usize] as usize..out.lower_start[j as usize + 1] as usize;
                for (&row, &l) in out.lower[range.clone()].iter().zip(&lower_values[range]) {
                    let product = l * u;
                    x[row as usize] -= product;
                    term[row as usize] += product.magnitude();
                }
            }

            // choice of the pivot
            let mut best = NONE;
            let mut best_size = 0.0;
            let mut finite = true;
            for &row in &candidates {
                let r = row as usize;
                let size = x[r].magnitude();
                finite &= size < f64::INFINITY;
                let weighted = size * out.scale[r];
                if weighted > best_size && size > noise * term[r] {
                    best_size = weighted;
                    best = row;
                }
            }
            let expected = diagonal[kk];
            if best == NONE || !finite {
                return Err(singular(expected, kk));
            }
            let d = expected as usize;
            if mark[d] == k
                && x[d].magnitude() * out.scale[d] >= DIAGONAL_THRESHOLD * best_size
                && x[d].magnitude() > noise * term[d]
            {
                best = expected;
            }
            let pivot = best as usize;
            if best != expected {
                let other = diagonal_of[pivot] as usize;
                diagonal[other] = expected;
                diagonal_of[d] = other as u32;
            }
            out.row[kk] = best;
            out.rank[pivot] = k;
            out.size[kk] = x[pivot].magnitude();

            // column k of U and L
            let inverse = x[pivot].recip();
            out.upper.extend_from_slice(&topological);
            out.upper_start.push(out.upper.len() as u32);
            for &row in &candidates {
                if row != best {
                    out.lower.push(row);
                    lower_values.push(x[row as usize] * inverse);
                }
                x[row as usize] = T::ZERO;
                term[row as usize] = 0.0;
            }
            out.lower_start.push(out.lower.len() as u32);
            pruned[kk] = out.lower.len() as u32;

            // prune: column j of L has the pivot row of k and U has (j, k), so beyond its pivoted rows j need not be followed
            for &j in &topological {
                let j = j as usize;
                if is_pruned[j] {
                    continue;
                }
                let (start, end) = (out.lower_start[j] as usize, out.lower_start[j + 1] as usize);
                if !out.lower[start..end].contains(&best) {
                    continue;
                }
                let (mut head, mut tail) = (start, end);
                while head < tail {
                    if out.rank[out.lower[head] as usize] != NONE {
                        head += 1;
                    } else {
                        tail -= 1;
                        out.lower.swap(head, tail);
                        lower_values.swap(head, tail);
                    }
                }
                pruned[j] = head as u32;
                is_pruned[j] = true;
            }
        }
    }
    Ok(out)
}

/// r_i of the head of this file, over the diagonal blocks, of the magnitudes of values. The error gives a value that is not finite,
/// by row and column.
fn row_scales(symbolic: &Symbolic, sizes: &[f64]) -> Result<Vec<f64>, (u32, usize)> {
    let a = &symbolic.matrix;
    let mut largest = vec![0.0f64; symbolic.n()];
    for range in symbolic.blocks.windows(2) {
        for k in range[0] as usize..range[1] as usize {
            let mut column = 0.0f64;
            for (row, source) in a.entries(k) {
                if !sizes[source].is_finite() {
                    return Err((row, k));
                }
                if row >= range[0] {
                    column = column.max(sizes[source]);
                }
            }
            let inverse = if column > 0.0 { (1.0 / column).min(f64::MAX) } else { 0.0 };
            for (row, source) in a.entries(k) {
                if row >= range[0] {
                    let largest = &mut largest[row as usize];
                    *largest = largest.max(sizes[source] * inverse);
                }
            }
        }
    }
    // a zero row keeps weight 1: the elimination will find and name it
    Ok(largest.into_iter().map(|m| if m > 0.0 { (1.0 / m).min(f64::MAX) } else { 1.0 }).collect())
}
