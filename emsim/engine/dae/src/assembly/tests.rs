//! Four-bar linkages, good and bad guesses, and the identities of the decompositions.

use super::*;

const LINKS: [f64; 4] = [0.1, 0.3, 0.25, 0.3]; // crank, coupler, rocker, ground

/// Four-bar with joint coordinates q = (crank, coupler against crank, rocker), plus its closure again with another factor
/// (a redundant row) and an empty row.
fn four_bar(q: &[f64], h: &mut [f64], jac: &mut [f64]) {
    let [l1, l2, l3, d] = LINKS;
    let (a, b, c) = (q[0], q[0] + q[1], q[2]);
    h[0] = l1 * a.cos() + l2 * b.cos() - d - l3 * c.cos();
    h[1] = l1 * a.sin() + l2 * b.sin() - l3 * c.sin();
    jac[..3].copy_from_slice(&[-l1 * a.sin() - l2 * b.sin(), -l2 * b.sin(), l3 * c.sin()]);
    jac[3..6].copy_from_slice(&[l1 * a.cos() + l2 * b.cos(), l2 * b.cos(), -l3 * c.cos()]);
    h[2] = 3.0 * h[0] - h[1];
    for j in 0..3 {
        jac[6 + j] = 3.0 * jac[j] - jac[3 + j];
    }
}

const UNIT3: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

#[test]
fn four_bar_assembles_from_rough_guesses() {
    let mut failures = 0;
    for crank in [0.0, 0.7, 1.5, 3.0, -2.0, 5.0] {
        for (coupler, rocker) in [(0.0, 1.0), (-0.5, 1.5), (1.0, 2.5), (0.3, -1.0), (-2.0, 0.1), (0.0, 0.0)] {
            let found = project(4, &mut four_bar, &UNIT3, &[crank, coupler, rocker], &[true, false, false], 1e-12, 50);
            let Ok(x) = found else {
                failures += 1;
                continue;
            };
            assert_eq!(x[0], crank);
            let (mut h, mut jac) = ([0.0; 4], [0.0; 12]);
            four_bar(&x, &mut h, &mut jac);
            assert!(h.iter().all(|v| v.abs() <= 1e-12));
        }
    }
    assert_eq!(failures, 0);
}

#[test]
fn a_good_guess_keeps_its_branch() {
    // crank at 0.7: elbow up and elbow down differ in the sign of the rocker angle
    for sign in [1.0, -1.0] {
        let x =
            project(4, &mut four_bar, &UNIT3, &[0.7, sign * 0.4 - 0.7, sign * 1.6], &[true, false, false], 1e-13, 50)
                .unwrap();
        assert!(x[2] * sign > 0.5 && x[2] * sign < 3.0, "{x:?}");
    }
}

#[test]
fn a_linkage_laid_out_straight_is_pushed_off() {
    // all on one line, and 0.05 too short: the closure cannot move along itself
    let x = project(4, &mut four_bar, &UNIT3, &[0.0, 0.0, 0.0], &[false; 3], 1e-12, 60).unwrap();
    let (mut h, mut jac) = ([0.0; 4], [0.0; 12]);
    four_bar(&x, &mut h, &mut jac);
    assert!(h.iter().all(|v| v.abs() <= 1e-12));
}

#[test]
fn an_impossible_linkage_reports_its_gap() {
    let mut too_far = |q: &[f64], h: &mut [f64], jac: &mut [f64]| {
        four_bar(q, h, jac);
        h[0] -= 1.0;
        h[2] -= 3.0;
    };
    let error = project(4, &mut too_far, &UNIT3, &[0.7, -0.5, 1.5], &[true, false, false], 1e-12, 100).unwrap_err();
    // crank + coupler + rocker reach 0.62 of the 1.3 that are wanted
    let gap = error.residual[0].hypot(error.residual[1]);
    assert!(gap > 0.6 && gap < 1.0, "{error:?}");
    assert_eq!(error.residual[3], 0.0);
    assert!(error.iterations <= 100);
}

#[test]
fn nothing_free_and_nothing_to_do() {
    let held = project(4, &mut four_bar, &UNIT3, &[0.7, 0.1, 0.2], &[true; 3], 1e-12, 10);
    assert!(held.is_err());
    let mut closed = |_: &[f64], h: &mut [f64], _: &mut [f64]| h.fill(0.0);
    assert_eq!(project(1, &mut closed, &UNIT3, &[1.0, 2.0, 3.0], &[true; 3], 1e-12, 10).unwrap(), [1.0, 2.0, 3.0]);
}

#[test]
fn functions_that_are_not_defined_everywhere() {
    // sqrt(x) = 2 from a guess where the full step leads into x < 0
    let mut root = |x: &[f64], h: &mut [f64], jac: &mut [f64]| {
        h[0] = 1.0 / x[0].sqrt() - 0.5;
        jac[0] = -0.5 * x[0].powf(-1.5);
    };
    let x = project(1, &mut root, &[1.0], &[100.0], &[false], 1e-12, 50).unwrap();
    assert!((x[0] - 4.0).abs() < 1e-9, "{x:?}");
}

#[test]
fn the_light_side_gives_way() {
    // x1 + x2 = 3 from (0, 0) with masses 1 and 1e6; and with no mass at all on the first
    for mass in [[1.0, 0.0, 0.0, 1e6], [0.0, 0.0, 0.0, 1.0]] {
        let mut sum = |x: &[f64], h: &mut [f64], jac: &mut [f64]| {
            h[0] = x[0] + x[1] - 3.0;
            jac.copy_from_slice(&[1.0, 1.0]);
        };
        let x = project(1, &mut sum, &mass, &[0.0, 0.0], &[false; 2], 1e-12, 10).unwrap();
        assert!((x[0] - 3.0).abs() < 1e-2 && (x[0] + x[1] - 3.0).abs() < 1e-12, "{x:?}");
    }
}

#[test]
fn velocity_is_the_minimal_change() {
    // against the normal equations du = M^-1 H^T (H M^-1 H^T)^-1 (rhs - H u0), H of full rank, M full
    let mass = [3.0, 0.5, 0.2, 0.5, 2.0, -0.3, 0.2, -0.3, 1.0];
    let (mut value, mut full) = ([0.0; 4], [0.0; 12]);
    four_bar(&[0.7, -0.3, 1.4], &mut value, &mut full);
    let (u0, rhs) = ([1.0, -2.0, 0.5], [0.3, -0.1]);
    let u = project_velocity(&full[..6], &mass, &u0, &[false; 3], &rhs);
    for i in 0..2 {
        let hu: f64 = (0..3).map(|j| full[3 * i + j] * u[j]).sum();
        assert!((hu - rhs[i]).abs() < 1e-13);
    }
    // the change is M-orthogonal to every motion w with H w = 0, here the cross product of the rows
    let (a, b) = (&full[..3], &full[3..6]);
    let w = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let mut inner = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            inner += w[i] * mass[3 * i + j] * (u[j] - u0[j]);
        }
    }
    assert!(inner.abs() < 1e-14, "{inner}");
    // redundant rows that agree change nothing
    let again = project_velocity(&full, &mass, &u0, &[false; 3], &[rhs[0], rhs[1], 3.0 * rhs[0] - rhs[1], 0.0]);
    for (x, y) in u.iter().zip(&again) {
        assert!((x - y).abs() < 1e-12);
    }
    // a held speed stays
    let held = project_velocity(&full, &mass, &u0, &[true, false, false], &[0.0; 4]);
    assert_eq!(held[0], 1.0);
    let hu: f64 = (0..3).map(|j| full[j] * held[j]).sum();
    assert!(hu.abs() < 1e-13);
}

#[test]
fn rank_prefers_earlier_rows() {
    let a = [
        0.0, 0.0, 0.0, // empty
        1.0, 2.0, 3.0, //
        2.0, 4.0, 6.0, // twice the one before
        1e-20, 0.0, 1e-19, // rounding
        0.0, 1.0, 1.0, //
        1.0, 3.0, 4.0, // the sum
        0.0, 0.0, 1e-3, // small but new
    ];
    assert_eq!(rank(&a, 7, 3, 1e-9), (3, vec![1, 4, 6]));
    assert_eq!(rank(&a, 6, 3, 1e-9), (2, vec![1, 4]));
    assert_eq!(rank(&[], 0, 3, 1e-9), (0, vec![]));
    let (mut value, mut jac) = ([0.0; 4], [0.0; 12]);
    four_bar(&[0.7, -0.3, 1.4], &mut value, &mut jac);
    assert_eq!(rank(&jac, 4, 3, 1e-9), (2, vec![0, 1]));
}

#[test]
fn qr_and_cholesky_reproduce_their_matrices() {
    let (rows, cols) = (5, 4);
    let a: Vec<f64> = (0..rows * cols).map(|k| ((k * k * 7 + 3 * k) % 11) as f64 - 5.0).collect(); // by columns
    let qr = Qr::new(a.clone(), rows, cols, 1e-12, true);
    assert_eq!(qr.rank, 4);
    for place in 0..cols {
        let mut column: Vec<f64> = (0..rows).map(|i| if i <= place { qr.r(i, place) } else { 0.0 }).collect();
        qr.apply(&mut column);
        for i in 0..rows {
            assert!((column[i] - a[qr.order[place] * rows + i]).abs() < 1e-12);
        }
    }
    // normal matrix of the same, by Cholesky
    let mut normal = vec![0.0; cols * cols];
    for i in 0..cols {
        for j in 0..cols {
            normal[i * cols + j] = (0..rows).map(|k| a[i * rows + k] * a[j * rows + k]).sum();
        }
    }
    let exact = [1.0, -2.0, 0.5, 3.0];
    let mut b: Vec<f64> = (0..cols).map(|i| (0..cols).map(|j| normal[i * cols + j] * exact[j]).sum()).collect();
    Cholesky::new(&normal, cols).unwrap().solve(&mut b);
    for (x, y) in b.iter().zip(exact) {
        assert!((x - y).abs() < 1e-10);
    }
    assert!(Cholesky::new(&[1.0, 2.0, 2.0, 1.0], 2).is_none());
}

#[test]
fn semidefinite_mass_is_made_definite() {
    // two coordinates that only weigh together, and one that weighs nothing
    let mass = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let u = project_velocity(&[1.0, 0.0, 1.0], &mass, &[0.0; 3], &[false; 3], &[2.0]);
    assert!((u[0] + u[2] - 2.0).abs() < 1e-9 && u.iter().all(|v| v.is_finite()), "{u:?}");
}
