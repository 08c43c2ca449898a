//! Against dense elimination, on the shapes that circuits and mechanisms have.

use super::*;

mod pivots;

/// xorshift64*: the tests need repeatable numbers, not good ones.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }
    /// In -1..1.
    fn real(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

trait Draw: Scalar {
    fn draw(random: &mut Random) -> Self;
}
impl Draw for f64 {
    fn draw(random: &mut Random) -> f64 {
        random.real()
    }
}
impl Draw for Complex {
    fn draw(random: &mut Random) -> Complex {
        Complex::new(random.real(), random.real())
    }
}

fn dense<T: Scalar>(pattern: &Pattern, values: &[T]) -> Vec<Vec<T>> {
    let mut a = vec![vec![T::ZERO; pattern.n]; pattern.n];
    for j in 0..pattern.n {
        for p in pattern.colptr[j]..pattern.colptr[j + 1] {
            a[pattern.rowidx[p]][j] = values[p];
        }
    }
    a
}

/// Gauss with partial pivoting, the reference.
fn dense_solve<T: Scalar>(mut a: Vec<Vec<T>>, b: &[T]) -> Vec<T> {
    let n = b.len();
    let mut x = b.to_vec();
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| a[i][k].magnitude().total_cmp(&a[j][k].magnitude())).unwrap();
        a.swap(k, p);
        x.swap(k, p);
        for i in k + 1..n {
            let l = a[i][k] * a[k][k].recip();
            if l != T::ZERO {
                for j in k..n {
                    let t = l * a[k][j];
                    a[i][j] -= t;
                }
                let t = l * x[k];
                x[i] -= t;
            }
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            let t = a[k][j] * x[j];
            x[k] -= t;
        }
        x[k] *= a[k][k].recip();
    }
    x
}

/// Largest |b - A x| over rows, each against |A| |x| + |b| of the row: the backward error.
fn backward_error<T: Scalar>(pattern: &Pattern, values: &[T], x: &[T], b: &[T], transposed: bool) -> f64 {
    let mut residual = b.to_vec();
    let mut size: Vec<f64> = b.iter().map(|v| v.magnitude()).collect();
    for j in 0..pattern.n {
        for p in pattern.colptr[j]..pattern.colptr[j + 1] {
            let (i, j) = if transposed { (j, pattern.rowidx[p]) } else { (pattern.rowidx[p], j) };
            let t = values[p] * x[j];
            residual[i] -= t;
            size[i] += t.magnitude();
        }
    }
    residual.iter().zip(&size).map(|(r, &s)| if s > 0.0 { r.magnitude() / s } else { 0.0 }).fold(0.0, f64::max)
}

fn lu_of<T: Scalar>(pattern: &Pattern, values: &[T]) -> Lu<T> {
    let symbolic = Symbolic::analyse(pattern).expect("structure");
    let mut lu = Lu::new(&symbolic);
    lu.factor(values).expect("factor");
    lu
}

fn check<T: Draw>(pattern: &Pattern, values: &[T], lu: &mut Lu<T>, random: &mut Random, tolerance: f64) {
    let b: Vec<T> = (0..pattern.n).map(|_| T::draw(random)).collect();
    let mut x = b.clone();
    lu.solve(&mut x);
    let error = backward_error(pattern, values, &x, &b, false);
    assert!(error < tolerance, "n {} backward error {error:e}", pattern.n);
    let mut y = b.clone();
    lu.solve_transposed(&mut y);
    let error = backward_error(pattern, values, &y, &b, true);
    assert!(error < tolerance, "n {} transposed backward error {error:e}", pattern.n);
}

/// A random pattern with a hidden full transversal and about `extra` further entries a column.
fn random_pattern(n: usize, extra: usize, random: &mut Random) -> Pattern {
    let mut shuffled: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        shuffled.swap(i, random.below(i + 1));
    }
    let mut entries: Vec<(usize, usize)> = (0..n).map(|j| (shuffled[j], j)).collect();
    for j in 0..n {
        for _ in 0..random.below(2 * extra + 1) {
            entries.push((random.below(n), j));
        }
    }
    Pattern::from_entries(n, &entries)
}

fn random_matrices<T: Draw>(seed: u64) {
    let mut random = Random(seed);
    for n in [1, 2, 3, 5, 8, 20, 60, 150, 300] {
        for extra in [0, 1, 2, 4] {
            let pattern = random_pattern(n, extra, &mut random);
            let values: Vec<T> = (0..pattern.nnz()).map(|_| T::draw(&mut random)).collect();
            let symbolic = Symbolic::analyse(&pattern).unwrap();
            let mut lu = Lu::new(&symbolic);
            lu.factor(&values).unwrap();
            // pivots down to 1e-3 of their column cost some digits on matrices as adverse as these
            check(&pattern, &values, &mut lu, &mut random, 1e-9);
            // new values every time: sometimes the pivots serve, sometimes not
            for _ in 0..3 {
                let values: Vec<T> = (0..pattern.nnz()).map(|_| T::draw(&mut random)).collect();
                lu.factor_or_refactor(&values).unwrap();
                check(&pattern, &values, &mut lu, &mut random, 1e-7);
            }
            if n <= 60 {
                let b: Vec<T> = (0..n).map(|_| T::draw(&mut random)).collect();
                let want = dense_solve(dense(&pattern, &values), &b);
                lu.factor(&values).unwrap();
                let mut got = b.clone();
                lu.solve(&mut got);
                let scale = want.iter().map(|v| v.magnitude()).fold(0.0, f64::max);
                for (g, w) in got.iter().zip(&want) {
                    assert!((*g - *w).magnitude() < 1e-7 * scale, "n {n} extra {extra}: {g:?} {w:?}");
                }
            }
        }
    }
}

#[test]
fn random_real_matrices() {
    random_matrices::<f64>(1);
}

#[test]
fn random_complex_matrices() {
    random_matrices::<Complex>(2);
}

/// RC ladder of n nodes driven by a voltage source (its branch is the last unknown).
pub(super) fn ladder(n: usize) -> (Pattern, Vec<f64>) {
    let mut entries = Vec::new();
    for i in 0..n - 1 {
        entries.push((i, i));
        if i + 1 < n - 1 {
            entries.extend([(i, i + 1), (i + 1, i)]);
        }
    }
    entries.extend([(n - 1, 0), (0, n - 1)]);
    let pattern = Pattern::from_entries(n, &entries);
    let mut values = vec![-1.0; pattern.nnz()];
    for i in 0..n - 1 {
        values[pattern.position(i, i).unwrap()] = 2.1;
    }
    values[pattern.position(n - 1, 0).unwrap()] = 1.0;
    values[pattern.position(0, n - 1).unwrap()] = 1.0;
    (pattern, values)
}

/// Square mesh of resistors with a capacitor at each node.
pub(super) fn mesh(side: usize) -> (Pattern, Vec<f64>) {
    let n = side * side;
    let mut entries = Vec::new();
    for i in 0..n {
        entries.push((i, i));
        if i % side + 1 < side {
            entries.extend([(i, i + 1), (i + 1, i)]);
        }
        if i + side < n {
            entries.extend([(i, i + side), (i + side, i)]);
        }
    }
    let pattern = Pattern::from_entries(n, &entries);
    let mut values = vec![-1.0; pattern.nnz()];
    for i in 0..n {
        values[pattern.position(i, i).unwrap()] = 4.01;
    }
    (pattern, values)
}

/// Inverter-like stages between two ideal rails: unsymmetric, and the rails touch every stage.
pub(super) fn rails(stages: usize) -> (Pattern, Vec<f64>) {
    let n = stages + 2; // node i of each stage, then the rail's node and its branch current
    let (rail, branch) = (stages, stages + 1);
    let mut triples: Vec<(usize, usize, f64)> = vec![(rail, branch, 1.0), (branch, rail, 1.0)];
    for i in 0..stages {
        triples.extend([(i, i, 1e-3), (i, rail, -1e-3), (rail, i, -1e-3), (rail, rail, 1e-3)]);
        if i > 0 {
            triples.extend([(i, i - 1, 5e-2), (rail, i - 1, -5e-2)]);
        }
    }
    from_triples(n, &triples)
}

fn from_triples(n: usize, triples: &[(usize, usize, f64)]) -> (Pattern, Vec<f64>) {
    let entries: Vec<(usize, usize)> = triples.iter().map(|&(i, j, _)| (i, j)).collect();
    let pattern = Pattern::from_entries(n, &entries);
    let mut values = vec![0.0; pattern.nnz()];
    for &(i, j, v) in triples {
        values[pattern.position(i, j).unwrap()] += v;
    }
    (pattern, values)
}

#[test]
fn circuit_shapes() {
    let mut random = Random(3);
    for (pattern, values) in [ladder(5), ladder(100), ladder(3000), mesh(10), mesh(40), rails(10), rails(500)] {
        let mut lu = lu_of(&pattern, &values);
        check(&pattern, &values, &mut lu, &mut random, 1e-13);
    }
}

#[test]
fn ladder_has_no_fill() {
    let (pattern, values) = ladder(1000);
    let lu = lu_of(&pattern, &values);
    assert!(lu.nnz() <= pattern.nnz(), "{} entries from {}", lu.nnz(), pattern.nnz());
}

#[test]
fn rails_are_split_off() {
    let (pattern, values) = rails(500);
    assert_eq!(lu_of(&pattern, &values).nnz(), pattern.nnz(), "a chain of stages without feedback is triangular");
}

#[test]
fn permuted_triangular_needs_no_elimination() {
    let mut random = Random(4);
    let n = 200;
    let mut row: Vec<usize> = (0..n).collect();
    let mut col = row.clone();
    for i in (1..n).rev() {
        row.swap(i, random.below(i + 1));
        col.swap(i, random.below(i + 1));
    }
    let mut entries = Vec::new();
    for i in 0..n {
        entries.push((row[i], col[i]));
        for _ in 0..3 {
            entries.push((row[random.below(i + 1)], col[i]));
        }
    }
    let pattern = Pattern::from_entries(n, &entries);
    let values: Vec<f64> = (0..pattern.nnz()).map(|_| 1.5 + random.real()).collect();
    let mut lu = lu_of(&pattern, &values);
    assert_eq!(lu.operations(), 0);
    assert_eq!(lu.nnz(), pattern.nnz());
    let exact: Vec<f64> = (0..n).map(|i| i as f64 - 50.0).collect();
    let mut b = vec![0.0; n];
    for j in 0..n {
        for p in pattern.colptr[j]..pattern.colptr[j + 1] {
            b[pattern.rowidx[p]] += values[p] * exact[j];
        }
    }
    lu.solve(&mut b);
    let mut residual = vec![0.0; n];
    for j in 0..n {
        for p in pattern.colptr[j]..pattern.colptr[j + 1] {
            residual[pattern.rowidx[p]] += values[p] * (b[j] - exact[j]);
        }
    }
    assert!(residual.iter().all(|r| r.abs() < 1e-6), "{residual:?}");
}

#[test]
fn long_chains_do_not_recurse() {
    // one block of 200 000 unknowns, and a matching that must flip a path through all of them
    let n = 200_000;
    let mut entries = vec![(n - 1, 0)];
    for j in 0..n - 1 {
        entries.extend([(j, j + 1), (j + 1, j + 1)]);
    }
    entries.push((0, 0));
    let pattern = Pattern::from_entries(n, &entries);
    let values: Vec<f64> = (0..pattern.nnz()).map(|p| 2.0 + (p % 3) as f64).collect();
    let mut lu = lu_of(&pattern, &values);
    check(&pattern, &values, &mut lu, &mut Random(5), 1e-11);
}

#[test]
fn structurally_singular_names_row_and_column() {
    // rows 1 and 3 live in column 2 alone; column 3 has no place then
    let pattern = Pattern::from_entries(4, &[(0, 0), (0, 1), (2, 1), (1, 2), (3, 2), (0, 3), (2, 3)]);
    let error = Symbolic::analyse(&pattern).err().unwrap();
    assert!(error.structural);
    assert!(matches!(error.row, Some(1) | Some(3)), "{error:?}");
    assert!(matches!(error.col, Some(0) | Some(1) | Some(3)), "{error:?}");
    let empty_row = Pattern::from_entries(2, &[(0, 0), (0, 1)]);
    assert_eq!(Symbolic::analyse(&empty_row).err().unwrap().row, Some(1));
}

#[test]
fn numerically_singular_names_row_and_column() {
    // nodes 1 and 2 float together: g (v1 - v2) and nothing to ground
    let g = 1.0 / 3.0;
    let (pattern, values) = from_triples(
        4,
        &[(0, 0, 2.0), (1, 1, g), (1, 2, -g), (2, 1, -g), (2, 2, g), (3, 3, 1.0), (0, 3, 1.0), (3, 0, 1.5)],
    );
    let symbolic = Symbolic::analyse(&pattern).unwrap();
    let mut lu = Lu::new(&symbolic);
    let error = lu.factor(&values).unwrap_err();
    assert!(!error.structural && matches!(error.col, Some(1) | Some(2)) && matches!(error.row, Some(1) | Some(2)));
    assert!(!lu.is_ready());
}

#[test]
fn what_is_not_finite_is_not_called_singular() {
    let (pattern, values) = from_triples(2, &[(0, 0, 1.0), (1, 1, f64::INFINITY), (0, 1, 2.0)]);
    let symbolic = Symbolic::analyse(&pattern).unwrap();
    let error = Lu::new(&symbolic).factor(&values).unwrap_err();
    assert!(!error.finite && error.col == Some(1), "{error:?}");
    assert_eq!(error.to_string(), "the matrix is not finite, row 1, column 1");
}

#[test]
fn a_floating_mesh_is_singular_in_spite_of_rounding() {
    let mut random = Random(6);
    for side in [2, 5, 12] {
        let (pattern, _) = mesh(side);
        let mut values = vec![0.0; pattern.nnz()];
        for j in 0..pattern.n {
            for &i in pattern.column(j) {
                if i < j {
                    let g = 2.0 + random.real();
                    values[pattern.position(i, j).unwrap()] = -g;
                    values[pattern.position(j, i).unwrap()] = -g;
                    values[pattern.position(i, i).unwrap()] += g;
                    values[pattern.position(j, j).unwrap()] += g;
                }
            }
        }
        let symbolic = Symbolic::analyse(&pattern).unwrap();
        let mut lu = Lu::new(&symbolic);
        let floating = lu.factor(&values);
        // a leak of 1e-9 makes it regular
        values[0] += 1e-9;
        lu.factor(&values).unwrap();
        assert!(floating.is_err(), "side {side}");
    }
}

#[test]
fn zero_values_on_the_pattern_are_no_pivots() {
    let (pattern, values) = from_triples(
        3,
        &[
            (0, 0, 0.0),
            (0, 1, 1.0),
            (1, 0, 1.0),
            (1, 1, 0.0),
            (1, 2, 2.0),
            (2, 1, 3.0),
            (2, 2, 0.0),
            (0, 2, 1.0),
            (2, 0, 0.0),
        ],
    );
    let mut lu = lu_of(&pattern, &values);
    check(&pattern, &values, &mut lu, &mut Random(7), 1e-14);
}

#[test]
fn values_that_are_not_finite_are_refused_and_named() {
    let (pattern, mut values) = ladder(6);
    let symbolic = Symbolic::analyse(&pattern).unwrap();
    let mut lu = Lu::new(&symbolic);
    lu.factor(&values).unwrap();
    let bad = pattern.position(2, 3).unwrap();
    for poison in [f64::NAN, f64::INFINITY] {
        values[bad] = poison;
        assert_eq!(lu.refactor(&values), Err(RefactorError::NotFinite));
        let error = lu.factor_or_refactor(&values).unwrap_err();
        assert_eq!((error.row, error.col), (Some(2), Some(3)));
    }
}

#[test]
fn a_sign_flip_forces_new_pivots() {
    // 1 + x on a diagonal that eliminates to 1 + x - 1: at x = 0 the old pivot vanishes
    let (pattern, mut values) = from_triples(
        3,
        &[
            (0, 0, 1.0),
            (0, 1, 1.0),
            (1, 0, 1.0),
            (1, 1, 3.0),
            (1, 2, 1.0),
            (2, 1, 1.0),
            (2, 2, 2.0),
            (0, 2, 0.5),
            (2, 0, 0.25),
        ],
    );
    let symbolic = Symbolic::analyse(&pattern).unwrap();
    let mut lu = Lu::new(&symbolic);
    lu.factor(&values).unwrap();
    let mut random = Random(8);
    for (first, second) in [(1.0, 1.0), (-1.0, -1.0), (0.0, 0.0), (1e-13, 1.0), (1.0, 1e-14), (0.0, 1.0)] {
        values[pattern.position(0, 0).unwrap()] = first;
        values[pattern.position(1, 1).unwrap()] = second;
        lu.factor_or_refactor(&values).unwrap();
        check(&pattern, &values, &mut lu, &mut random, 1e-7);
    }
    let counters = lu.counters();
    assert!(counters.refusals >= 1 && counters.factors == counters.refusals + 1, "{counters:?}");
}

#[test]
fn rows_and_columns_of_wild_scale() {
    let mut random = Random(9);
    for n in [10, 80] {
        let pattern = random_pattern(n, 3, &mut random);
        let plain: Vec<f64> = (0..pattern.nnz()).map(|_| random.real()).collect();
        let row: Vec<f64> = (0..n).map(|_| 10f64.powi(random.below(13) as i32 - 6)).collect();
        let col: Vec<f64> = (0..n).map(|_| 10f64.powi(-(random.below(13) as i32))).collect();
        let mut values = plain.clone();
        for j in 0..n {
            for p in pattern.colptr[j]..pattern.colptr[j + 1] {
                values[p] *= row[pattern.rowidx[p]] * col[j];
            }
        }
        let mut lu = lu_of(&pattern, &values);
        check(&pattern, &values, &mut lu, &mut random, 1e-11);
        lu.refactor(&values).unwrap();
        let b: Vec<f64> = (0..n).map(|_| random.real()).collect();
        let want = dense_solve(dense(&pattern, &plain), &b);
        let mut got: Vec<f64> = b.iter().zip(&row).map(|(b, r)| b * r).collect();
        lu.solve(&mut got);
        let size = want.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for j in 0..n {
            assert!((got[j] * col[j] - want[j]).abs() < 1e-8 * size, "{} {}", got[j] * col[j], want[j]);
        }
    }
}

#[test]
fn refactor_repeats_factor_bit_for_bit() {
    let mut random = Random(10);
    let pattern = random_pattern(120, 3, &mut random);
    let values: Vec<f64> = (0..pattern.nnz()).map(|_| random.real()).collect();
    let mut lu = lu_of(&pattern, &values);
    let b: Vec<f64> = (0..120).map(|_| random.real()).collect();
    let (mut x, mut y) = (b.clone(), b);
    lu.solve(&mut x);
    lu.refactor(&values).unwrap();
    lu.solve(&mut y);
    assert_eq!(x, y);
}

#[test]
fn large_factors_use_the_dense_work_vector() {
    let (pattern, mut values) = mesh(90);
    let mut lu = lu_of(&pattern, &values);
    assert!(lu.operations() > 1_500_000 / 4, "{}", lu.operations());
    let mut random = Random(11);
    for v in &mut values {
        *v *= 1.0 + 0.01 * random.real();
    }
    lu.refactor(&values).unwrap();
    check(&pattern, &values, &mut lu, &mut random, 1e-12);
}

#[test]
fn empty_and_single() {
    let pattern = Pattern::from_entries(0, &[]);
    let mut lu: Lu<f64> = lu_of(&pattern, &[]);
    lu.solve(&mut []);
    lu.refactor(&[]).unwrap();
    let pattern = Pattern::from_entries(1, &[(0, 0)]);
    let mut lu = lu_of(&pattern, &[4.0]);
    let mut b = [2.0];
    lu.solve(&mut b);
    assert_eq!(b, [0.5]);
    assert!(lu.refactor(&[0.0]).is_err());
    assert!(lu.factor(&[0.0]).is_err());
}

#[test]
fn stamps_on_a_base_are_the_sum() {
    let mut random = Random(12);
    let (pattern, mut values) = mesh(6);
    let symbolic = Symbolic::analyse(&pattern).unwrap();
    let (mut stamped, mut plain) = (Lu::new(&symbolic), Lu::new(&symbolic));
    let slot = |row, col| pattern.position(row, col).unwrap() as u32;
    let at = [(slot(7, 7), 1.0), (slot(7, 8), -1.0), (slot(8, 7), -1.0), (slot(8, 8), 1.0)];
    let stamps: Vec<Stamp> = at.iter().map(|&(slot, sign)| Stamp { slot, source: 0, sign }).collect();
    stamped.set_stamps(&stamps);
    let b: Vec<f64> = (0..pattern.n).map(|_| random.real()).collect();
    // before the first pivots, with kept pivots, with a new base, and where the pivots must change
    for (scale, source) in [(1.0, 0.5), (1.0, 1e3), (2.0, -3.0), (1.0, 1e12), (1.0, 0.0)] {
        for v in &mut values {
            *v *= scale;
        }
        stamped.set_base(&values);
        stamped.factor_stamped(&[source]).unwrap();
        let mut sum = values.clone();
        for s in &stamps {
            sum[s.slot as usize] += s.sign * source;
        }
        plain.factor(&sum).unwrap();
        let (mut x, mut y) = (b.clone(), b.clone());
        stamped.solve(&mut x);
        plain.solve(&mut y);
        let size = y.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-9 * size), "{scale} {source}");
    }
    assert!(stamped.factor_stamped(&[f64::NAN]).is_err());
}

/// By cofactors.
fn determinant(a: &[Vec<f64>]) -> f64 {
    if a.is_empty() {
        return 1.0;
    }
    let minor = |i: usize| -> Vec<Vec<f64>> { (0..a.len()).filter(|&r| r != i).map(|r| a[r][1..].to_vec()).collect() };
    (0..a.len()).map(|i| if i % 2 == 0 { a[i][0] } else { -a[i][0] } * determinant(&minor(i))).sum()
}

/// Whatever rows are pivots, signs of two determinants differ where the determinants' do.
#[test]
fn sign_of_the_determinant() {
    let mut random = Random(7);
    for n in [1, 2, 3, 5, 6] {
        let pattern = random_pattern(n, 3, &mut random);
        let mut lu = Lu::new(&Symbolic::analyse(&pattern).unwrap());
        let mut apart = Vec::new();
        for _ in 0..40 {
            let values: Vec<f64> = (0..pattern.nnz()).map(|_| f64::draw(&mut random)).collect();
            lu.factor_or_refactor(&values).unwrap();
            apart.push(lu.negative() == (determinant(&dense(&pattern, &values)) < 0.0));
        }
        assert!(apart.iter().all(|&a| a == apart[0]), "n {n}");
    }
}
