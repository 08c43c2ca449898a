//! Boxed linear complementarity problem:  w = b + A f,  lo <= f <= hi,  w = 0 inside, w >= 0 at lo, w <= 0 at hi.
//!
//! A = W^T M^-1 W is symmetric and positive semidefinite up to what circuits add; a little on the diagonal makes it definite, and its
//! solution is then the least of those there are (effort shared equally where that decides nothing). Principal pivoting by the
//! least index (Murty 1974), which ends for such matrices; where rounding keeps it from that, projected Gauss-Seidel.

/// Part of the largest diagonal entry.
const REGULAR: f64 = 1e-10;
const SWEEPS: usize = 20_000;

#[derive(Clone, Copy, PartialEq)]
enum At {
    Inside,
    Low,
    High,
}

pub struct Solution {
    pub f: Vec<f64>,
    pub w: Vec<f64>,
}

/// A by rows. None where there is no solution within rounding.
pub fn solve(a: &[f64], b: &[f64], lo: &[f64], hi: &[f64]) -> Option<Solution> {
    let n = b.len();
    let largest = (0..n).map(|i| a[i * n + i].abs()).fold(0.0, f64::max);
    let mut a = a.to_vec();
    (0..n).for_each(|i| a[i * n + i] += REGULAR * largest.max(f64::MIN_POSITIVE));
    let mut at: Vec<At> = (0..n).map(|i| if lo[i] == hi[i] { At::Low } else { At::Inside }).collect();
    for _ in 0..100 + 40 * n {
        let f = inside(&a, b, lo, hi, &at)?;
        let w = flows(&a, b, &f);
        let size = |i: usize| b[i].abs() + (0..n).map(|j| (a[i * n + j] * f[j]).abs()).sum::<f64>();
        let wrong = |i: usize| match at[i] {
            _ if lo[i] == hi[i] => None,
            At::Inside if f[i] < lo[i] => Some(At::Low),
            At::Inside if f[i] > hi[i] => Some(At::High),
            At::Low if w[i] < -1e-12 * size(i) => Some(At::Inside),
            At::High if w[i] > 1e-12 * size(i) => Some(At::Inside),
            _ => None,
        };
        match (0..n).find_map(|i| Some((i, wrong(i)?))) {
            Some((i, to)) => at[i] = to,
            None => return Some(Solution { f, w }),
        }
    }
    relaxed(&a, b, lo, hi)
}

fn flows(a: &[f64], b: &[f64], f: &[f64]) -> Vec<f64> {
    let n = b.len();
    (0..n).map(|i| b[i] + (0..n).map(|j| a[i * n + j] * f[j]).sum::<f64>()).collect()
}

/// Efforts where those inside make their flows 0.
fn inside(a: &[f64], b: &[f64], lo: &[f64], hi: &[f64], at: &[At]) -> Option<Vec<f64>> {
    let n = b.len();
    let mut f: Vec<f64> = (0..n)
        .map(|i| match at[i] {
            At::Inside => 0.0,
            At::Low => lo[i],
            At::High => hi[i],
        })
        .collect();
    let w = flows(a, b, &f);
    let own: Vec<usize> = (0..n).filter(|&i| at[i] == At::Inside).collect();
    let matrix: Vec<f64> = own.iter().flat_map(|&i| own.iter().map(move |&j| a[i * n + j])).collect();
    let right: Vec<f64> = own.iter().map(|&i| -w[i]).collect();
    for (&i, v) in own.iter().zip(dense(matrix, right)?) {
        f[i] = v;
    }
    Some(f)
}

/// The solution of a small system, pivoting by rows.
pub fn dense(mut m: Vec<f64>, mut r: Vec<f64>) -> Option<Vec<f64>> {
    let n = r.len();
    for k in 0..n {
        let best = (k..n).max_by(|&i, &j| m[i * n + k].abs().total_cmp(&m[j * n + k].abs()))?;
        if m[best * n + k] == 0.0 || !m[best * n + k].is_finite() {
            return None;
        }
        if best != k {
            (0..n).for_each(|j| m.swap(k * n + j, best * n + j));
            r.swap(k, best);
        }
        for i in k + 1..n {
            let by = m[i * n + k] / m[k * n + k];
            (k..n).for_each(|j| m[i * n + j] -= by * m[k * n + j]);
            r[i] -= by * r[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| m[k * n + j] * r[j]).sum();
        r[k] = (r[k] - rest) / m[k * n + k];
    }
    Some(r)
}

fn relaxed(a: &[f64], b: &[f64], lo: &[f64], hi: &[f64]) -> Option<Solution> {
    let n = b.len();
    let mut f: Vec<f64> = (0..n).map(|i| 0.0_f64.clamp(lo[i], hi[i])).collect();
    for _ in 0..SWEEPS {
        let mut moved = 0.0_f64;
        for i in 0..n {
            let w = b[i] + (0..n).map(|j| a[i * n + j] * f[j]).sum::<f64>();
            let new = (f[i] - w / a[i * n + i]).clamp(lo[i], hi[i]);
            moved = moved.max((new - f[i]).abs() / (1e-300 + new.abs()));
            f[i] = new;
        }
        if moved < 1e-13 {
            let w = flows(a, b, &f);
            return f.iter().all(|v| v.is_finite()).then_some(Solution { f, w });
        }
    }
    None
}

/// A largest set of `which` whose rows of A are independent, by pivoted elimination; larger diagonals first.
pub fn independent(a: &[f64], n: usize, which: &[usize]) -> Vec<usize> {
    let k = which.len();
    let mut m: Vec<f64> = which.iter().flat_map(|&i| which.iter().map(move |&j| a[i * n + j])).collect();
    let first: Vec<f64> = (0..k).map(|i| m[i * k + i].abs()).collect();
    let largest = first.iter().copied().fold(0.0, f64::max);
    let (mut left, mut found): (Vec<usize>, Vec<usize>) = ((0..k).collect(), Vec::new());
    while let Some(p) = left.iter().copied().max_by(|&i, &j| m[i * k + i].total_cmp(&m[j * k + j]).then(j.cmp(&i))) {
        let pivot = m[p * k + p];
        if pivot <= 1e-9 * first[p] || pivot <= 1e-14 * largest {
            break;
        }
        found.push(which[p]);
        left.retain(|&i| i != p);
        for &i in &left {
            let by = m[i * k + p] / pivot;
            for &j in &left {
                m[i * k + j] -= by * m[p * k + j];
            }
        }
    }
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random problems of all ranks: the solution is one.
    #[test]
    fn solutions_are_complementary() {
        let mut seed = 0.417_f64;
        let mut random = || {
            seed = (seed * 997.0 + 0.123_456_7).fract();
            2.0 * seed - 1.0
        };
        for round in 0..400 {
            let (n, rank) = (1 + round % 7, 1 + round % 4);
            let w: Vec<f64> = (0..n * rank).map(|_| random()).collect();
            let a: Vec<f64> =
                (0..n * n).map(|k| (0..rank).map(|r| w[(k / n) * rank + r] * w[(k % n) * rank + r]).sum()).collect();
            // what a motion gives
            let motion: Vec<f64> = (0..rank).map(|_| random()).collect();
            let b: Vec<f64> = (0..n).map(|i| (0..rank).map(|r| w[i * rank + r] * motion[r]).sum()).collect();
            let corner = round % 3 == 0;
            let lo: Vec<f64> = (0..n).map(|i| if corner && i % 2 == 0 { 0.0 } else { -0.3 }).collect();
            let hi: Vec<f64> = (0..n).map(|i| if corner && i % 2 == 0 { f64::INFINITY } else { 0.3 }).collect();
            let s = solve(&a, &b, &lo, &hi).expect("there is a solution");
            for i in 0..n {
                assert!(s.f[i] >= lo[i] - 1e-9 && s.f[i] <= hi[i] + 1e-9);
                assert!(s.w[i] > -1e-7 || s.f[i] > hi[i] - 1e-7, "{i}: {} {}", s.w[i], s.f[i]);
                assert!(s.w[i] < 1e-7 || s.f[i] < lo[i] + 1e-7, "{i}: {} {}", s.w[i], s.f[i]);
            }
        }
    }

    /// Two elements that lock one motion share its load equally, and one of them is left over.
    #[test]
    fn what_is_redundant_shares_equally() {
        let a = [1.0, 1.0, 1.0, 1.0];
        let s = solve(&a, &[-1.0, -1.0], &[-3.0, -3.0], &[3.0, 3.0]).expect("there is a solution");
        assert!((s.f[0] - 0.5).abs() < 1e-6 && (s.f[1] - 0.5).abs() < 1e-6);
        assert_eq!(independent(&a, 2, &[0, 1]), vec![0]);
    }
}
