//! Coefficients: order conditions, stiff accuracy, L-stability, and the conditions of dense output.
use super::formula::Formula;
use super::{esdirk, sdirk, trbdf2, Tableau};

struct Full {
    a: Vec<Vec<f64>>,
    c: Vec<f64>,
}

fn full(k: &Tableau) -> Full {
    let s = k.c.len();
    let mut a = vec![vec![0.0; s]; s];
    for (i, row) in k.a.iter().enumerate() {
        a[i + 1][..row.len()].copy_from_slice(row);
    }
    Full { a, c: k.c.clone() }
}

impl Full {
    fn times(&self, v: &[f64]) -> Vec<f64> {
        self.a.iter().map(|row| row.iter().zip(v).map(|(a, v)| a * v).sum()).collect()
    }

    fn power(&self, k: i32) -> Vec<f64> {
        self.c.iter().map(|c| c.powi(k)).collect()
    }

    /// Weights of the trees of order 1 to 4, with what they must give.
    fn trees(&self) -> Vec<(usize, Vec<f64>, f64)> {
        let ac = self.times(&self.c);
        let mixed = self.c.iter().zip(&ac).map(|(c, a)| c * a).collect();
        vec![
            (1, self.power(0), 1.0),
            (2, self.power(1), 0.5),
            (3, self.power(2), 1.0 / 3.0),
            (3, ac.clone(), 1.0 / 6.0),
            (4, self.power(3), 0.25),
            (4, mixed, 0.125),
            (4, self.times(&self.power(2)), 1.0 / 12.0),
            (4, self.times(&ac), 1.0 / 24.0),
        ]
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Largest order up to which all conditions hold for the weights b.
fn order(f: &Full, b: &[f64]) -> usize {
    let trees = f.trees();
    let holds = |p: usize| trees.iter().filter(|t| t.0 == p).all(|(_, v, want)| (dot(b, v) - want).abs() < 1e-13);
    (1..=4).take_while(|&p| holds(p)).last().unwrap_or(0)
}

#[test]
fn orders_of_methods_and_embedded_formulas() {
    for (k, p, embedded) in [(trbdf2::tableau(), 2, 3), (esdirk::tableau(), 4, 3)] {
        let f = full(&k);
        let b = f.a[f.c.len() - 1].clone();
        let hat: Vec<f64> = b.iter().zip(&k.d).map(|(b, d)| b - d).collect();
        assert_eq!((order(&f, &b), order(&f, &hat)), (p, embedded));
        assert_eq!(k.falls, p.min(embedded) + 1);
        // rows sum to c, stages are of order 2, the diagonal is one number, the last stage is the new point
        for ((sum, c), row) in f.times(&f.power(0)).iter().zip(&f.c).zip(&f.a) {
            assert!((sum - c).abs() < 1e-14 && (dot(row, &f.c) - 0.5 * c * c).abs() < 1e-14);
        }
        assert!((1..f.c.len()).all(|i| f.a[i][i] == f.a[1][1]) && f.c.iter().all(|c| (0.0..=1.0).contains(c)));
        assert_eq!(f.c.last(), Some(&1.0));
    }
}

#[test]
fn orders_of_steps_that_begin_with_a_jump() {
    for (k, next, p) in [(sdirk::order2(), trbdf2::tableau(), 2), (sdirk::order4(), esdirk::tableau(), 4)] {
        let f = full(&k);
        let s = f.c.len();
        let b = f.a[s - 1].clone();
        assert_eq!(order(&f, &b), p);
        let hat: Vec<f64> = b.iter().zip(&k.d).map(|(b, d)| b - d).collect();
        assert_eq!(order(&f, &hat), if p == 4 { 3 } else { 1 });
        // the start stands in no stage; as many stages and the same matrix as in the steps that follow
        assert!(k.starts_anew() && !next.starts_anew() && f.a.iter().all(|row| row[0] == 0.0) && k.d[0] == 0.0);
        assert!(s == next.c.len() && (1..s).all(|i| (f.a[i][i] - next.a[0][1]).abs() < 1e-15));
        for (sum, c) in f.times(&f.power(0)).iter().zip(&f.c) {
            assert!((sum - c).abs() < 1e-14 && (0.0..=1.0).contains(c));
        }
    }
}

/// dq/dt = -q/tau with h far longer than tau: every stage is behind it, and d leaves `at_once` of the charge that was there.
#[test]
fn a_charge_that_moves_at_once_is_in_the_estimate() {
    for k in [sdirk::order2(), sdirk::order4()] {
        let f = full(&k);
        let (s, z) = (f.c.len(), 1e9);
        let mut rates = vec![z];
        for i in 1..s {
            let q = (1.0 - dot(&f.a[i][..i], &rates) + f.a[i][0] * z) / (1.0 + f.a[i][i] * z);
            rates.push(z * q);
        }
        let left = dot(&k.d, &rates);
        let formula = Formula::new(k);
        assert!((left - formula.at_once).abs() < 1e-6 && left.abs() > 0.05, "{left}");
        assert!(formula.spread.iter().zip(&rates).skip(1).all(|(k, rate)| (k - rate).abs() < 1e-6));
    }
}

#[test]
fn dense_output_behind_a_jump() {
    for (k, q) in [(sdirk::order2(), 1), (sdirk::order4(), 2)] {
        let f = full(&k);
        let s = f.c.len();
        for step in 0..=20 {
            let theta = 0.05 * f64::from(step);
            let w: Vec<f64> = k.weights_at(theta).collect();
            assert!(w[0] == 0.0 && w.iter().map(|w| w.abs()).sum::<f64>() < 5.0);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-13 && (dot(&w, &f.c) - theta).abs() < 1e-13);
            assert!(q < 2 || (dot(&w, &f.times(&f.c)) - 0.5 * theta * theta).abs() < 1e-13);
        }
        let w: Vec<f64> = k.weights_at(1.0).collect();
        assert!((0..s).all(|j| (w[j] - f64::from(u8::from(j == s - 1))).abs() < 1e-13));
    }
}

/// R(z) of the test equation, by the stages themselves.
fn growth(f: &Full, re: f64, im: f64) -> f64 {
    let mut x: Vec<(f64, f64)> = vec![(1.0, 0.0)];
    for i in 1..f.c.len() {
        let (mut sr, mut si) = (0.0, 0.0);
        for (a, x) in f.a[i].iter().zip(&x) {
            sr += a * x.0;
            si += a * x.1;
        }
        // (1 - gamma z) x = 1 + z s
        let (nr, ni) = (1.0 + re * sr - im * si, re * si + im * sr);
        let (dr, di) = (1.0 - f.a[i][i] * re, -f.a[i][i] * im);
        let d = dr * dr + di * di;
        x.push(((nr * dr + ni * di) / d, (ni * dr - nr * di) / d));
    }
    let last = x[x.len() - 1];
    last.0.hypot(last.1)
}

#[test]
fn l_stable() {
    for k in [trbdf2::tableau(), esdirk::tableau(), sdirk::order2(), sdirk::order4()] {
        let f = full(&k);
        // the imaginary axis bounds the left half plane (maximum principle: no pole in it, gamma > 0)
        for e in -200..=200 {
            let y = 10f64.powf(f64::from(e) / 50.0);
            assert!(growth(&f, 0.0, y) <= 1.0 + 1e-12, "{y}: {}", growth(&f, 0.0, y));
        }
        assert!(growth(&f, -1e9, 0.0) < 1e-8);
    }
}

#[test]
fn conditions_of_dense_output() {
    for (k, q) in [(trbdf2::tableau(), 2), (esdirk::tableau(), 3)] {
        let f = full(&k);
        let s = f.c.len();
        let deep = f.times(&f.power(2));
        for step in 0..=20 {
            let theta = 0.05 * f64::from(step);
            let w: Vec<f64> = k.dense.iter().map(|d| d.iter().rev().fold(0.0, |sum, c| sum * theta + c)).collect();
            for p in 0..=q {
                assert!((dot(&w, &f.power(p)) - theta.powi(p)).abs() < 1e-13, "{theta} {p}");
            }
            if q == 3 {
                assert!((dot(&w, &deep) - theta.powi(3) / 3.0).abs() < 1e-13);
            }
            for (at, stage) in [(0, 0), (20, s - 1)] {
                if step == at {
                    assert!((0..s).all(|j| (w[j] - f64::from(u8::from(j == stage))).abs() < 1e-13));
                }
            }
        }
    }
}

/// h lambda to infinity: Q is what the sources make it, F_i is its derivative as the stages give it. The estimate is the error
/// of the last one.
#[test]
fn esdirk_sees_what_follows_at_once() {
    let (k, f) = (esdirk::tableau(), full(&esdirk::tableau()));
    let gamma = f.a[1][1];
    for p in 1..=3 {
        let mut slopes = vec![if p == 1 { 1.0 } else { 0.0 }];
        for i in 1..f.c.len() {
            let known = dot(&f.a[i][..i], &slopes);
            slopes.push((f.c[i].powi(p) - known) / gamma);
        }
        let wrong = slopes[f.c.len() - 1] - f64::from(p);
        assert_eq!(p == 3, wrong.abs() > 0.1);
        assert!((dot(&k.d, &slopes) / gamma + wrong).abs() < 1e-8, "{p}: {wrong}");
    }
}
