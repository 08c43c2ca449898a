//! Lemke's method with lexicographic pivots (Cottle, Pang, Stone 1992, 4.4 and 4.9) for the problem of lcp.rs, as a plain one:
//!
//!   0 <= z, 0 <= M z + q, one of each pair is 0
//!
//! of efforts with one bound f = lo + z against w, of those with two f = lo + r against w + s, s against hi - lo - r, s >= 0 the part
//! of w below 0 (Glocker). Bounds that go with another effort f(n) are lo + l f(n) and hi + h f(n).
use super::{At, Bounds};
use crate::rounding::ROUNDED;

/// At which bounds the efforts of a solution are. None where the method ends on a ray, or an effort has no bound.
pub fn solve(a: &[f64], b: &[f64], bounds: &Bounds) -> Option<Vec<At>> {
    let n = b.len();
    let endless =
        |i: usize| bounds.lo[i].is_infinite() || bounds.with[i].is_some_and(|(of, ..)| bounds.lo[of].is_infinite());
    if n == 0 || (0..n).any(endless) {
        return None;
    }
    // in units in which every effort moves its own flow by 1
    let unit: Vec<f64> = (0..n).map(|i| 1.0 / a[i * n + i].abs().max(f64::MIN_POSITIVE).sqrt().max(1e-150)).collect();
    let moved = |i: usize| !bounds.fixed(i);
    let boxed = |i: usize| moved(i) && bounds.hi[i].is_finite();
    let places: Vec<usize> = (0..n).filter(|&i| moved(i)).collect();
    let boxes: Vec<usize> = (0..n).filter(|&i| boxed(i)).collect();
    let (m, size) = (places.len(), places.len() + boxes.len());
    // f / unit = base + T z
    let mut shape = vec![0.0; n * size];
    let mut base: Vec<f64> = (0..n).map(|i| bounds.lo[i] / unit[i]).collect();
    for (column, &i) in places.iter().enumerate() {
        shape[i * size + column] = 1.0;
    }
    for i in 0..n {
        let Some((of, l, _)) = bounds.with[i] else { continue };
        let l = l * unit[of] / unit[i];
        base[i] += l * base[of];
        (0..size).for_each(|c| shape[i * size + c] += l * shape[of * size + c]);
    }
    let entry = |i: usize, j: usize| unit[i] * a[i * n + j] * unit[j];
    let (mut matrix, mut q) = (vec![0.0; size * size], vec![0.0; size]);
    for (row, &i) in places.iter().enumerate() {
        q[row] = unit[i] * b[i] + (0..n).map(|j| entry(i, j) * base[j]).sum::<f64>();
        for c in 0..size {
            matrix[row * size + c] = (0..n).map(|j| entry(i, j) * shape[j * size + c]).sum();
        }
    }
    for (k, &i) in boxes.iter().enumerate() {
        let (row, own) = (m + k, places.iter().position(|&p| p == i)?);
        matrix[own * size + row] += 1.0;
        matrix[row * size + own] -= 1.0;
        q[row] = (bounds.hi[i] - bounds.lo[i]) / unit[i];
        if let Some((of, l, h)) = bounds.with[i] {
            let more = (h - l) * unit[of] / unit[i];
            q[row] += more * base[of];
            (0..size).for_each(|c| matrix[row * size + c] += more * shape[of * size + c]);
        }
    }
    let z = plain(&matrix, &q)?;
    let at = |i: usize| {
        let own = places.iter().position(|&p| p == i);
        let upper = boxes.iter().position(|&p| p == i);
        match (own, upper) {
            (Some(own), _) if z[own] == 0.0 => At::Low,
            (Some(_), Some(k)) if z[m + k] > 0.0 => At::High,
            (Some(own), Some(k)) => {
                let left = q[m + k] + (0..size).map(|c| matrix[(m + k) * size + c] * z[c]).sum::<f64>();
                if left <= ROUNDED * z[own] {
                    At::High
                } else {
                    At::Inside
                }
            }
            (Some(_), None) => At::Inside,
            (None, _) => At::Low,
        }
    };
    Some((0..n).map(at).collect())
}

/// z of 0 <= z, 0 <= M z + q; None on a ray.
fn plain(matrix: &[f64], q: &[f64]) -> Option<Vec<f64>> {
    let n = q.len();
    if q.iter().all(|&q| q >= 0.0) {
        return Some(vec![0.0; n]);
    }
    // rows of  w - M z - z0 = q;  columns: w (n), z (n), z0, q
    let (wide, last) = (2 * n + 2, 2 * n + 1);
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row = vec![0.0; wide];
            row[i] = 1.0;
            (0..n).for_each(|j| row[n + j] = -matrix[i * n + j]);
            (row[2 * n], row[last]) = (-1.0, q[i]);
            row
        })
        .collect();
    let mut basis: Vec<usize> = (0..n).collect();
    // by the right side, then by the columns of w, which are those of the inverse
    let earlier = |rows: &[Vec<f64>], by: &dyn Fn(usize) -> f64, i: usize, j: usize| {
        std::iter::once(last)
            .chain(0..n)
            .map(|c| (rows[i][c] / by(i)).total_cmp(&(rows[j][c] / by(j))))
            .find(|order| order.is_ne())
            .is_some_and(std::cmp::Ordering::is_lt)
    };
    let pivot = |rows: &mut Vec<Vec<f64>>, basis: &mut Vec<usize>, row: usize, column: usize| {
        let by = rows[row][column];
        rows[row].iter_mut().for_each(|v| *v /= by);
        let own = rows[row].clone();
        for (_, other) in rows.iter_mut().enumerate().filter(|(i, r)| *i != row && r[column] != 0.0) {
            let by = other[column];
            other.iter_mut().zip(&own).for_each(|(v, own)| *v -= by * own);
            other[column] = 0.0;
        }
        std::mem::replace(&mut basis[row], column)
    };
    let found = |rows: &[Vec<f64>], basis: &[usize]| {
        let mut z = vec![0.0; n];
        for (row, &at) in rows.iter().zip(basis) {
            if (n..2 * n).contains(&at) {
                z[at - n] = row[last].max(0.0);
            }
        }
        z
    };
    let none = ROUNDED * q.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
    let mut row = (0..n).reduce(|best, i| if earlier(&rows, &|_| 1.0, i, best) { i } else { best })?;
    let mut enters = 2 * n;
    for _ in 0..50 + 20 * n {
        let leaves = pivot(&mut rows, &mut basis, row, enters);
        if leaves == 2 * n {
            return Some(found(&rows, &basis));
        }
        enters = if leaves < n { n + leaves } else { leaves - n };
        let size = rows.iter().map(|r| r[enters].abs()).fold(0.0, f64::max);
        let can: Vec<usize> = (0..n).filter(|&i| rows[i][enters] > ROUNDED * size).collect();
        let by = |i: usize| rows[i][enters];
        let Some(next) = can.into_iter().reduce(|best, i| if earlier(&rows, &by, i, best) { i } else { best }) else {
            // a ray from where z0 is 0 to rounding: it has been solved
            let z0 = basis.iter().position(|&at| at == 2 * n)?;
            return (rows[z0][last] <= none).then(|| found(&rows, &basis));
        };
        row = next;
        // z0 leaves as soon as it can
        if let Some(z0) = basis.iter().position(|&at| at == 2 * n) {
            let (own, best) = (rows[z0][last] / rows[z0][enters], rows[row][last] / rows[row][enters]);
            if rows[z0][enters] > ROUNDED * size && own <= best * (1.0 + ROUNDED) + f64::MIN_POSITIVE {
                row = z0;
            }
        }
    }
    None
}
