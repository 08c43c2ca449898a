//! Small dense factorisations in place, without allocation: what one explicit stage solves.
//!
//! Symmetric positive definite A (row-major, upper triangle read) becomes  A = U^T D^-1 U  with U_kk = d_k, by rows, so that the
//! inner loops run over contiguous numbers:   U_ij <- U_ij - U_ki U_kj / d_k,  k < i <= j.
//! General A: LU with scaled partial pivoting.
//! Constraints: S = Z^T Z with the columns of Z of very different length near a singular position of a mechanism. Gram-Schmidt
//! with pivoting on the columns, not S itself, keeps all digits: Z P = Q R, S^+ = P R^-1 R^-T P^T on the leading rank.
use crate::rounding::ROUNDED;

/// A <- U; `inverse` <- 1/d. Err(k) where the matrix is not positive definite at pivot k.
pub fn factor_symmetric(a: &mut [f64], n: usize, inverse: &mut [f64]) -> Result<(), usize> {
    assert!(a.len() >= n * n && inverse.len() >= n);
    for k in 0..n {
        inverse[k] = a[k * n + k];
    }
    for k in 0..n {
        let d = a[k * n + k];
        if !(d > ROUNDED * inverse[k]) {
            return Err(k);
        }
        let r = 1.0 / d;
        inverse[k] = r;
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &above[k * n..];
        for i in k + 1..n {
            let f = row[i] * r;
            if f != 0.0 {
                let target = &mut below[(i - k - 1) * n + i..(i - k) * n];
                for (t, u) in target.iter_mut().zip(&row[i..n]) {
                    *t -= f * u;
                }
            }
        }
    }
    Ok(())
}

/// b <- U^-T b, scaled so that b^T A^-1 b = sum of b_k^2 inverse_k afterwards.
pub fn forward_symmetric(u: &[f64], n: usize, inverse: &[f64], b: &mut [f64]) {
    assert!(u.len() >= n * n && inverse.len() >= n && b.len() >= n);
    for k in 0..n {
        let f = b[k] * inverse[k];
        for (t, u) in b[k + 1..n].iter_mut().zip(&u[k * n + k + 1..(k + 1) * n]) {
            *t -= f * u;
        }
    }
}

/// b <- U^-1 b of what `forward_symmetric` left.
pub fn backward_symmetric(u: &[f64], n: usize, inverse: &[f64], b: &mut [f64]) {
    assert!(u.len() >= n * n && inverse.len() >= n && b.len() >= n);
    for k in (0..n).rev() {
        let s = dot(&u[k * n + k + 1..(k + 1) * n], &b[k + 1..n]);
        b[k] = (b[k] - s) * inverse[k];
    }
}

/// The sum in four lanes, which run in parallel.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < 4 {
        return a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y);
    }
    let mut lanes = [0.0; 4];
    let (ca, cb) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for k in 0..4 {
            lanes[k] += x[k] * y[k];
        }
    }
    lanes[0] + lanes[1] + lanes[2] + lanes[3] + rest
}

/// A <- L\U with row exchanges in `order`. Err(k): no pivot for column k.
pub fn factor_general(a: &mut [f64], n: usize, order: &mut [usize], scale: &mut [f64]) -> Result<(), usize> {
    for i in 0..n {
        let largest = a[i * n..(i + 1) * n].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        scale[i] = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        order[i] = i;
    }
    for k in 0..n {
        let (mut best, mut size) = (k, -1.0);
        for i in k..n {
            let s = (a[i * n + k] * scale[i]).abs();
            if s > size {
                (best, size) = (i, s);
            }
        }
        // (NaN compares false: it is found by whoever reads the solution)
        if size <= ROUNDED {
            return Err(k);
        }
        if best != k {
            for j in 0..n {
                a.swap(k * n + j, best * n + j);
            }
            order.swap(k, best);
            scale.swap(k, best);
        }
        let r = 1.0 / a[k * n + k];
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &above[k * n..];
        for i in 0..n - k - 1 {
            let target = &mut below[i * n..(i + 1) * n];
            let f = target[k] * r;
            target[k] = f;
            if f != 0.0 {
                for (t, u) in target[k + 1..].iter_mut().zip(&row[k + 1..n]) {
                    *t -= f * u;
                }
            }
        }
    }
    Ok(())
}

/// b <- A^-1 b; `scratch` of the same length.
pub fn solve_general(lu: &[f64], n: usize, order: &[usize], b: &mut [f64], scratch: &mut [f64]) {
    for i in 0..n {
        let s = dot(&lu[i * n..i * n + i], &scratch[..i]);
        scratch[i] = b[order[i]] - s;
    }
    for i in (0..n).rev() {
        let s = dot(&lu[i * n + i + 1..(i + 1) * n], &b[i + 1..n]);
        b[i] = (scratch[i] - s) / lu[i * n + i];
    }
}

/// Gram-Schmidt with column pivoting on m columns of k numbers.
pub struct Columns {
    k: usize,
    m: usize,
    pub z: Vec<f64>,
    q: Vec<f64>,
    r: Vec<f64>, // m x m, upper
    order: Vec<usize>,
    scale: Vec<f64>,
    work: Vec<f64>,
    kinds: Vec<usize>, // of the columns: lengths of one kind, in one unit, can be compared
    longest: Vec<f64>, // square of the longest of each kind so far: a row that is alone of its kind can vanish too
    pub rank: usize,
    /// How near to a loss of rank: the least of pivots against the first, and of lengths against the largest of their kind.
    pub weakest: f64,
}

impl Columns {
    pub fn new(k: usize, kinds: &[usize]) -> Columns {
        let m = kinds.len();
        Columns {
            k,
            m,
            kinds: kinds.to_vec(),
            longest: vec![0.0; m],
            z: vec![0.0; k * m],
            q: vec![0.0; k * m],
            r: vec![0.0; m * m],
            order: vec![0; m],
            scale: vec![1.0; m],
            work: vec![0.0; m],
            rank: 0,
            weakest: 1.0,
        }
    }

    /// Factors `z`. Columns are brought to one length first, but one that happens to vanish is not blown up; what is
    /// then below `tolerance` of the first pivot counts as dependent.
    pub fn factor(&mut self, tolerance: f64) {
        let (k, m) = (self.k, self.m);
        for j in 0..m {
            let c = &self.z[j * k..(j + 1) * k];
            self.work[j] = dot(c, c).sqrt();
            self.order[j] = j;
        }
        for (&kind, &length) in self.kinds.iter().zip(&self.work) {
            self.longest[kind] = self.longest[kind].max(length * length);
        }
        for j in 0..m {
            let longest = self.longest[self.kinds[j]].sqrt();
            let s = if longest > 0.0 { 1.0 / self.work[j].max(1e-4 * longest) } else { 1.0 };
            self.scale[j] = s;
            for (q, z) in self.q[j * k..(j + 1) * k].iter_mut().zip(&self.z[j * k..(j + 1) * k]) {
                *q = s * z;
            }
        }
        self.rank = 0;
        self.weakest = 1.0;
        let mut first = 0.0;
        for j in 0..m.min(k) {
            let (mut best, mut square) = (j, -1.0);
            for l in j..m {
                let c = &self.q[l * k..(l + 1) * k];
                let s = dot(c, c);
                if s > square {
                    (best, square) = (l, s);
                }
            }
            let length = f64::max(square, 0.0).sqrt();
            if j == 0 {
                first = length;
            }
            if !(length > tolerance * first) {
                return;
            }
            if best != j {
                self.order.swap(j, best);
                for i in 0..k {
                    self.q.swap(j * k + i, best * k + i);
                }
                for i in 0..j {
                    self.r.swap(i * m + j, i * m + best);
                }
            }
            self.r[j * m + j] = length;
            let (left, right) = self.q.split_at_mut((j + 1) * k);
            let pivot = &mut left[j * k..];
            for v in pivot.iter_mut() {
                *v /= length;
            }
            for l in j + 1..m {
                let c = &mut right[(l - j - 1) * k..(l - j) * k];
                let s = dot(pivot, c);
                self.r[j * m + l] = s;
                for (c, p) in c.iter_mut().zip(pivot.iter()) {
                    *c -= s * p;
                }
            }
            self.rank = j + 1;
            let own = self.order[j];
            let relative = self.work[own] / self.longest[self.kinds[own]].sqrt();
            self.weakest = self.weakest.min(length / first).min(relative);
        }
    }

    /// How near to a loss of rank columns of these squared lengths are, whose Gram matrix has these pivots.
    pub fn nearness(&mut self, squares: &[f64], pivots: &[f64]) -> f64 {
        for (&kind, &square) in self.kinds.iter().zip(squares) {
            self.longest[kind] = self.longest[kind].max(square);
        }
        let least = |j: usize| (pivots[j] / squares[j]).min(squares[j] / self.longest[self.kinds[j]]);
        // (not a number stays one)
        (0..self.m).map(least).fold(1.0, |n: f64, own| if own > n { n } else { own }).sqrt()
    }

    /// b <- S^+ b, S = Z^T Z on the leading rank; 0 in the dependent columns.
    pub fn solve(&mut self, b: &mut [f64]) {
        let (m, rank) = (self.m, self.rank);
        for i in 0..rank {
            let mut s = b[self.order[i]] * self.scale[self.order[i]];
            for j in 0..i {
                s -= self.r[j * m + i] * self.work[j];
            }
            self.work[i] = s / self.r[i * m + i];
        }
        for i in (0..rank).rev() {
            let mut s = self.work[i];
            for j in i + 1..rank {
                s -= self.r[i * m + j] * self.work[j];
            }
            self.work[i] = s / self.r[i * m + i];
        }
        for i in 0..m {
            let c = self.order[i];
            b[c] = if i < rank { self.work[i] * self.scale[c] } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize) -> Vec<f64> {
        // positive definite, no structure
        let b: Vec<f64> = (0..n * n).map(|k| ((k * 37 + 11) % 19) as f64 / 19.0 - 0.4).collect();
        let at = |i: usize, j: usize| (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>();
        (0..n * n).map(|k| at(k / n, k % n) + f64::from(u8::from(k / n == k % n))).collect()
    }

    fn times(a: &[f64], n: usize, x: &[f64]) -> Vec<f64> {
        (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect()
    }

    #[test]
    fn both_factorisations_solve() {
        for n in [1, 2, 3, 7, 20] {
            let a = matrix(n);
            let x: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let b = times(&a, n, &x);
            let (mut u, mut inverse, mut y) = (a.clone(), vec![0.0; n], b.clone());
            factor_symmetric(&mut u, n, &mut inverse).unwrap();
            forward_symmetric(&u, n, &inverse, &mut y);
            backward_symmetric(&u, n, &inverse, &mut y);
            let (mut lu, mut order, mut scale, mut z) = (a.clone(), vec![0; n], vec![0.0; n], b.clone());
            factor_general(&mut lu, n, &mut order, &mut scale).unwrap();
            solve_general(&lu, n, &order, &mut z, &mut scale);
            for i in 0..n {
                assert!((y[i] - x[i]).abs() < 1e-11 && (z[i] - x[i]).abs() < 1e-11, "{n}: {y:?} {z:?}");
            }
        }
    }

    #[test]
    fn singular_matrices_are_named() {
        let mut a = vec![1.0, 2.0, 2.0, 4.0];
        assert_eq!(factor_symmetric(&mut a.clone(), 2, &mut [0.0; 2]), Err(1));
        assert_eq!(factor_general(&mut a, 2, &mut [0; 2], &mut [0.0; 2]), Err(1));
    }

    #[test]
    fn dependent_constraints_share_one_multiplier() {
        // columns 0 and 2 are one and the same, of very different length from column 1
        let mut c = Columns::new(3, &[0; 3]);
        c.z.copy_from_slice(&[1.0, 2.0, 0.0, 0.0, 1e-3, 1e-3, 1.0, 2.0, 0.0]);
        c.factor(1e-9);
        assert_eq!(c.rank, 2);
        // a right-hand side in the range of S = Z^T Z
        let z = c.z.clone();
        let column = |j: usize| &z[3 * j..3 * j + 3];
        let want = [0.7, -40.0, 0.0];
        let force: Vec<f64> = (0..3).map(|i| (0..3).map(|j| column(j)[i] * want[j]).sum()).collect();
        let mut b: Vec<f64> = (0..3).map(|j| dot(column(j), &force)).collect();
        c.solve(&mut b);
        let again: Vec<f64> = (0..3).map(|i| (0..3).map(|j| column(j)[i] * b[j]).sum()).collect();
        for i in 0..3 {
            assert!((again[i] - force[i]).abs() < 1e-10, "{again:?} {force:?}");
        }
    }
}
