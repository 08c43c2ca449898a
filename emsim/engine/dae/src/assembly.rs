//! Small dense linear algebra for closed loops: rank, assembly of positions, projection of velocities.
//!
//! A scene with loops has coordinates x and closure rows h(x) = 0 with the Jacobian H = dh/dx. Three questions are answered:
//!
//!   rank                which rows of H say something new (earlier rows are preferred)
//!   project             from a guess x0 to a point with h(x) = 0
//!   project_velocity    from u0 to the nearest u with H u = rhs
//!
//! "Nearest" is measured by the mass matrix M, as Gauss's principle of least constraint does: among all corrections that close
//! the loops take the one of least d^T M d. A light crank then gives way before a heavy platform, and the change of velocity is
//! the one that impulses in the joints would make. With the Cholesky factor M = L L^T and y = L^T d this becomes the shortest
//! solution of A y = -h, A = H L^-T, which the pseudo-inverse gives, also where rows are redundant (Bricard's mechanism) or
//! contradict each other by rounding:
//!
//!   A^T P = Q [R11 R12; 0 0]      Householder with column pivoting; what is below 1e-9 of the first pivot counts as 0
//!   y = -Q1 [R11^T; R12^T]^+ P^T h
//!
//! The threshold 1e-9 was found to carry a mechanism through its change points with 8 digits.
//!
//! `project` repeats this (Gauss-Newton). Far from a solution the step is halved until the residual falls; where that fails, near
//! a singular position, Levenberg's step min |A y + h|^2 + (lambda |y|)^2 is taken instead. A start that cannot move at all
//! though it is no solution (a linkage laid out straight) is pushed off a little and tried again.
//!
//! Matrices are row-major slices. Coordinates that are `held` never change.
use crate::interrupt;

/// L of A = L L^T, A symmetric positive definite.
#[derive(Clone, Debug)]
pub struct Cholesky {
    n: usize,
    l: Vec<f64>,
}

impl Cholesky {
    /// None when `a` (n x n, lower part read) is not positive definite.
    pub fn new(a: &[f64], n: usize) -> Option<Cholesky> {
        let mut l = a[..n * n].to_vec();
        for j in 0..n {
            let mut d = l[j * n + j];
            for k in 0..j {
                d -= l[j * n + k] * l[j * n + k];
            }
            if !(d > 0.0) {
                return None;
            }
            let d = d.sqrt();
            l[j * n + j] = d;
            for i in j + 1..n {
                let mut s = l[i * n + j];
                for k in 0..j {
                    s -= l[i * n + k] * l[j * n + k];
                }
                l[i * n + j] = s / d;
            }
        }
        Some(Cholesky { n, l })
    }

    /// No pivot has lost all the digits of the diagonal it started from.
    fn is_sound(&self, diagonal: &[f64]) -> bool {
        (0..self.n).all(|i| self.l[i * self.n + i].powi(2) > 1e-11 * diagonal[i])
    }

    /// b <- A^-1 b.
    pub fn solve(&self, b: &mut [f64]) {
        self.forward(b);
        self.backward(b);
    }

    /// b <- L^-1 b.
    pub fn forward(&self, b: &mut [f64]) {
        let n = self.n;
        for i in 0..n {
            let mut s = b[i];
            for k in 0..i {
                s -= self.l[i * n + k] * b[k];
            }
            b[i] = s / self.l[i * n + i];
        }
    }

    /// b <- L^-T b.
    pub fn backward(&self, b: &mut [f64]) {
        let n = self.n;
        for i in (0..n).rev() {
            let mut s = b[i];
            for k in i + 1..n {
                s -= self.l[k * n + i] * b[k];
            }
            b[i] = s / self.l[i * n + i];
        }
    }
}

/// A P = Q R by Householder reflections, the longest remaining column first. Stored by columns: R in the upper part, the
/// reflection vectors v_k (I - beta_k v_k v_k^T) below and on the diagonal of `v`.
#[derive(Clone, Debug)]
pub struct Qr {
    rows: usize,
    a: Vec<f64>,
    beta: Vec<f64>,
    diagonal: Vec<f64>,
    /// Column of A at each place of R.
    pub order: Vec<usize>,
    pub rank: usize,
}

impl Qr {
    /// Of a matrix given by columns (`rows` numbers each). `tolerance`: a column whose remainder is below this part of the
    /// first pivot ends the factorisation; the rank is the number of columns before it. `pivot` = false keeps the order.
    pub fn new(mut a: Vec<f64>, rows: usize, cols: usize, tolerance: f64, pivot: bool) -> Qr {
        let steps = rows.min(cols);
        let mut order: Vec<usize> = (0..cols).collect();
        let (mut beta, mut diagonal) = (vec![0.0; steps], vec![0.0; steps]);
        let mut rank = 0;
        let norm =
            |a: &[f64], j: usize, k: usize| a[j * rows + k..(j + 1) * rows].iter().map(|v| v * v).sum::<f64>().sqrt();
        for k in 0..steps {
            let mut length = norm(&a, k, k);
            if pivot {
                let mut best = k;
                for j in k + 1..cols {
                    let other = norm(&a, j, k);
                    if other > length {
                        length = other;
                        best = j;
                    }
                }
                if best != k {
                    order.swap(k, best);
                    for i in 0..rows {
                        a.swap(k * rows + i, best * rows + i);
                    }
                }
            }
            let first = if k == 0 { length } else { f64::abs(diagonal[0]) };
            if !(length > tolerance * first) || length == 0.0 {
                break;
            }
            // v = x + sign(x0) |x| e0, beta = 2 / v^T v
            let head = a[k * rows + k];
            let signed = if head < 0.0 { -length } else { length };
            a[k * rows + k] = head + signed;
            beta[k] = 1.0 / (signed * (head + signed));
            diagonal[k] = -signed;
            for j in k + 1..cols {
                let (left, right) = a.split_at_mut(j * rows);
                reflect(&left[k * rows + k..(k + 1) * rows], beta[k], &mut right[k..rows]);
            }
            rank = k + 1;
        }
        Qr { rows, a, beta, diagonal, order, rank }
    }

    /// Entry of R.
    fn r(&self, i: usize, j: usize) -> f64 {
        if i == j {
            self.diagonal[i]
        } else {
            self.a[j * self.rows + i]
        }
    }

    /// b <- Q^T b.
    fn apply_transposed(&self, b: &mut [f64]) {
        for k in 0..self.rank {
            reflect(&self.a[k * self.rows + k..(k + 1) * self.rows], self.beta[k], &mut b[k..self.rows]);
        }
    }

    /// b <- Q b.
    fn apply(&self, b: &mut [f64]) {
        for k in (0..self.rank).rev() {
            reflect(&self.a[k * self.rows + k..(k + 1) * self.rows], self.beta[k], &mut b[k..self.rows]);
        }
    }

    /// Least squares min |A x - b| for full column rank, in the order of R's columns.
    fn least_squares(&self, mut b: Vec<f64>) -> Vec<f64> {
        self.apply_transposed(&mut b);
        let n = self.rank;
        for i in (0..n).rev() {
            let mut s = b[i];
            for j in i + 1..n {
                s -= self.r(i, j) * b[j];
            }
            b[i] = s / self.r(i, i);
        }
        b.truncate(n);
        b
    }
}

/// b <- (I - beta v v^T) b.
fn reflect(v: &[f64], beta: f64, b: &mut [f64]) {
    let s = beta * v.iter().zip(&*b).map(|(v, b)| v * b).sum::<f64>();
    for (b, v) in b.iter_mut().zip(v) {
        *b -= s * v;
    }
}

/// Rank of `a` (rows x cols) and a set of independent rows. A row is taken, in order, when what it has beyond the rows taken
/// before exceeds `tol` of its own length; rows shorter than `tol` of the longest count as zero.
pub fn rank(a: &[f64], rows: usize, cols: usize, tol: f64) -> (usize, Vec<usize>) {
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let longest = (0..rows).map(|i| length(&a[i * cols..(i + 1) * cols])).fold(0.0, f64::max);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut taken = Vec::new();
    for i in 0..rows {
        let mut v = a[i * cols..(i + 1) * cols].to_vec();
        let size = length(&v);
        if basis.len() == cols || !(size > tol * longest) {
            continue;
        }
        // twice is enough (Kahan, Parlett): the second pass removes what rounding left of the first
        interrupt::spent(4 * basis.len() * cols);
        for _ in 0..2 {
            for b in &basis {
                let s: f64 = b.iter().zip(&v).map(|(b, v)| b * v).sum();
                for (v, b) in v.iter_mut().zip(b) {
                    *v -= s * b;
                }
            }
        }
        let rest = length(&v);
        if rest > tol * size {
            basis.push(v.into_iter().map(|x| x / rest).collect());
            taken.push(i);
        }
    }
    (taken.len(), taken)
}

/// The metric: Cholesky factor of the mass matrix of the free coordinates, made definite where it is not.
struct Metric {
    free: Vec<usize>,
    factor: Cholesky,
}

impl Metric {
    fn new(mass: &[f64], n: usize, held: &[bool]) -> Metric {
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let f = free.len();
        let mut m = vec![0.0; f * f];
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                m[a * f + b] = mass[i * n + j];
            }
        }
        // a coordinate without mass of its own gives way first
        let lightest = (0..f).map(|a| m[a * f + a]).filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min);
        let floor = if lightest.is_finite() { 1e-3 * lightest } else { 1.0 };
        for a in 0..f {
            if !(m[a * f + a] > 0.0) {
                m[a * f + a] = floor;
            }
        }
        // a matrix that is only semidefinite gets more of its own diagonal, until the factorisation succeeds
        let diagonal: Vec<f64> = (0..f).map(|a| m[a * f + a]).collect();
        for extra in [0.0, 1e-9, 1e-6, 1e-3, 1.0, 1e3] {
            for a in 0..f {
                m[a * f + a] = diagonal[a] * (1.0 + extra);
            }
            if let Some(factor) = Cholesky::new(&m, f).filter(|factor| factor.is_sound(&diagonal)) {
                return Metric { free, factor };
            }
        }
        // not a mass matrix at all (not a number, or indefinite by far): every coordinate alike
        let unit = (0..f * f).map(|k| if k % (f + 1) == 0 { 1.0 } else { 0.0 }).collect();
        Metric { free, factor: Cholesky { n: f, l: unit } }
    }

    /// A^T = L^-1 H^T of the free columns, by columns: column i belongs to row i of H.
    fn weigh(&self, jacobian: &[f64], rows: usize, n: usize) -> Vec<f64> {
        let f = self.free.len();
        let mut at = vec![0.0; f * rows];
        for i in 0..rows {
            let column = &mut at[i * f..(i + 1) * f];
            for (a, &j) in self.free.iter().enumerate() {
                column[a] = jacobian[i * n + j];
            }
            self.factor.forward(column);
        }
        at
    }

    /// x + scale d, d = L^-T y.
    fn moved(&self, x: &[f64], y: &[f64], scale: f64) -> Vec<f64> {
        let mut d = y.to_vec();
        self.factor.backward(&mut d);
        let mut x = x.to_vec();
        for (a, &j) in self.free.iter().enumerate() {
            x[j] += scale * d[a];
        }
        x
    }
}

/// Shortest y that minimises |A y - r|, A given by `at` = A^T by columns (f x rows).
fn pseudo_solve(at: Vec<f64>, f: usize, rows: usize, r: &[f64]) -> Vec<f64> {
    // singular values below this part of the largest are taken for zero
    let qr = Qr::new(at, f, rows, 1e-9, true);
    let k = qr.rank;
    // B z = P^T r with B = [R11 R12]^T, by columns: column i of B is row i of R
    let mut b = vec![0.0; rows * k];
    for i in 0..k {
        for j in i..rows {
            b[i * rows + j] = qr.r(i, j);
        }
    }
    let permuted: Vec<f64> = qr.order.iter().map(|&i| r[i]).collect();
    let mut y = Qr::new(b, rows, k, 0.0, false).least_squares(permuted);
    y.resize(f, 0.0);
    qr.apply(&mut y);
    y
}

/// y of least |A y - r|^2 + (lambda |y|)^2.
fn damped_solve(at: &[f64], f: usize, rows: usize, r: &[f64], lambda: f64) -> Vec<f64> {
    let height = rows + f;
    let mut a = vec![0.0; height * f];
    for j in 0..f {
        for i in 0..rows {
            a[j * height + i] = at[i * f + j];
        }
        a[j * height + rows + j] = lambda;
    }
    let mut b = r.to_vec();
    b.resize(height, 0.0);
    let mut y = Qr::new(a, height, f, 0.0, false).least_squares(b);
    y.resize(f, 0.0);
    y
}

/// No point with h = 0 was found.
#[derive(Clone, Debug)]
pub struct ProjectError {
    /// h of the best point, one for each row.
    pub residual: Vec<f64>,
    /// The best point.
    pub x: Vec<f64>,
    pub iterations: usize,
}

/// From x0 to a point with |h_i| <= tol for every row.
///
/// `h(x, value, jacobian)` writes `rows` values and the rows x n Jacobian. `mass` is n x n and may be semidefinite.
/// `max_iter` bounds the Jacobians. Rows may be redundant.
pub fn project(
    rows: usize,
    h: &mut dyn FnMut(&[f64], &mut [f64], &mut [f64]),
    mass: &[f64],
    x0: &[f64],
    held: &[bool],
    tol: f64,
    max_iter: usize,
) -> Result<Vec<f64>, ProjectError> {
    let n = x0.len();
    let metric = Metric::new(mass, n, held);
    let f = metric.free.len();
    let mut at_x = Evaluation::new(rows, n);
    let mut trial = Evaluation::new(rows, n);
    at_x.take(h, x0.to_vec());
    let mut best = at_x.clone();
    let mut scale: Vec<f64> = Vec::new();
    let mut pushes = 0;
    let mut slow = 0; // steps in a row that gained little: a minimum of the residual that is no solution is near
    let mut iterations = 0;
    loop {
        interrupt::spent(at_x.x.len() * at_x.x.len());
        if at_x.largest() <= tol {
            return Ok(at_x.x);
        }
        if at_x.largest() < best.largest() || !best.largest().is_finite() {
            best.clone_from(&at_x);
        }
        if iterations >= max_iter || f == 0 || rows == 0 {
            return Err(ProjectError { residual: best.value, x: best.x, iterations });
        }
        iterations += 1;

        let accepted = improve(h, &metric, &at_x, &mut trial, &mut scale);
        slow = if trial.size(&scale) > 0.8 * at_x.size(&scale) { slow + 1 } else { 0 };
        if accepted && slow < 4 {
            std::mem::swap(&mut at_x, &mut trial);
            continue;
        }
        // stuck: push the guess off, each time further and another way
        pushes += 1;
        if pushes > 8 {
            return Err(ProjectError { residual: best.value, x: best.x, iterations });
        }
        let mut start = x0.to_vec();
        for (a, &j) in metric.free.iter().enumerate() {
            let angle = (a + 1) as f64 * 2.399_963 * pushes as f64; // the golden angle: no two alike
            start[j] += 0.01 * 1.9f64.powi(pushes) * angle.cos();
        }
        scale.clear();
        slow = 0;
        at_x.take(h, start);
    }
}

/// A step from `at_x` to `trial`; is it a gain? `scale`: of the rows, made where it is empty.
fn improve(
    h: &mut dyn FnMut(&[f64], &mut [f64], &mut [f64]),
    metric: &Metric,
    at_x: &Evaluation,
    trial: &mut Evaluation,
    scale: &mut Vec<f64>,
) -> bool {
    let (rows, n, f) = (at_x.value.len(), at_x.x.len(), metric.free.len());
    // rows in metres and rows in radians are brought to one scale, which stays: the residual must be comparable
    let mut at = metric.weigh(&at_x.jacobian, rows, n);
    if scale.is_empty() {
        *scale = row_scales(&at, f, rows);
    }
    for (i, s) in scale.iter().enumerate() {
        for v in &mut at[i * f..(i + 1) * f] {
            *v *= s;
        }
    }
    let wanted: Vec<f64> = at_x.value.iter().zip(&*scale).map(|(v, s)| -v * s).collect();
    let size = at_x.size(scale);
    let frobenius = at.iter().map(|v| v * v).sum::<f64>().sqrt();

    // Gauss-Newton, halved until the residual falls by a good part of what was promised
    let y = pseudo_solve(at.clone(), f, rows, &wanted);
    let mut part = 1.0;
    for _ in 0..6 {
        trial.take(h, metric.moved(&at_x.x, &y, part));
        // 1 - part would be left of a linear residual
        if trial.size(scale) < size * (1.0 - 0.5 * part).max(0.5 * (1.0 - part)) {
            return true;
        }
        part *= 0.5;
    }
    // Levenberg
    let strengths = [1e-3, 1e-2, 1e-1, 1.0, 10.0].into_iter().filter(|_| frobenius > 0.0);
    for lambda in strengths {
        let y = damped_solve(&at, f, rows, &wanted, lambda * frobenius);
        trial.take(h, metric.moved(&at_x.x, &y, 1.0));
        if trial.size(scale) < size * (1.0 - 1e-3) {
            return true;
        }
    }
    false
}

/// Scales that make rows of A of similar length; a row that happens to vanish is not blown up.
fn row_scales(at: &[f64], f: usize, rows: usize) -> Vec<f64> {
    let lengths: Vec<f64> =
        (0..rows).map(|i| at[i * f..(i + 1) * f].iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    lengths.iter().map(|&l| if longest > 0.0 { 1.0 / l.max(1e-4 * longest) } else { 1.0 }).collect()
}

/// h and H at a point.
#[derive(Clone)]
struct Evaluation {
    x: Vec<f64>,
    value: Vec<f64>,
    jacobian: Vec<f64>,
}

impl Evaluation {
    fn new(rows: usize, n: usize) -> Evaluation {
        Evaluation { x: vec![0.0; n], value: vec![0.0; rows], jacobian: vec![0.0; rows * n] }
    }

    fn take(&mut self, h: &mut dyn FnMut(&[f64], &mut [f64], &mut [f64]), x: Vec<f64>) {
        self.x = x;
        self.value.fill(0.0);
        self.jacobian.fill(0.0);
        h(&self.x, &mut self.value, &mut self.jacobian);
    }

    /// Largest |h_i|, INFINITY when something is not a number.
    fn largest(&self) -> f64 {
        self.value.iter().fold(0.0, |m: f64, v| if v.is_nan() { f64::INFINITY } else { m.max(v.abs()) })
    }

    /// Length of the scaled residual.
    fn size(&self, scale: &[f64]) -> f64 {
        let sum: f64 = self.value.iter().zip(scale).map(|(v, s)| (v * s).powi(2)).sum();
        let known = self.jacobian.iter().all(|v| v.is_finite());
        if sum.is_finite() && known {
            sum.sqrt()
        } else {
            f64::INFINITY
        }
    }
}

/// The u with H u = rhs that is nearest to u0 (least squares where rows contradict each other). `jacobian` is
/// rhs.len() x u0.len().
pub fn project_velocity(jacobian: &[f64], mass: &[f64], u0: &[f64], held: &[bool], rhs: &[f64]) -> Vec<f64> {
    let (rows, n) = (rhs.len(), u0.len());
    let metric = Metric::new(mass, n, held);
    let f = metric.free.len();
    if rows == 0 || f == 0 {
        return u0.to_vec();
    }
    let mut at = metric.weigh(jacobian, rows, n);
    let scale = row_scales(&at, f, rows);
    let mut missing = vec![0.0; rows];
    for i in 0..rows {
        let now: f64 = jacobian[i * n..(i + 1) * n].iter().zip(u0).map(|(h, u)| h * u).sum();
        missing[i] = (rhs[i] - now) * scale[i];
        for v in &mut at[i * f..(i + 1) * f] {
            *v *= scale[i];
        }
    }
    metric.moved(u0, &pseudo_solve(at, f, rows, &missing), 1.0)
}

#[cfg(test)]
mod tests;
