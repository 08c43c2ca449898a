//! Factors that are kept beside the present ones.

use super::{ladder, lu_of, mesh};

#[test]
fn what_was_kept_solves_as_it_did() {
    let (pattern, first) = mesh(12);
    let second: Vec<f64> = first.iter().map(|v| if *v > 0.0 { 1.5 * v } else { *v }).collect();
    let mut lu = lu_of(&pattern, &first);
    let solved = |lu: &mut super::Lu<f64>| {
        let mut b: Vec<f64> = (0..pattern.n).map(|k| (k as f64).sin()).collect();
        lu.solve(&mut b);
        b
    };
    lu.keep(1.0);
    let one = solved(&mut lu);
    lu.refactor(&second).unwrap();
    lu.keep(2.0);
    let two = solved(&mut lu);
    assert_ne!(one, two);
    assert!(lu.recall(1.0));
    assert_eq!(solved(&mut lu), one);
    assert!(lu.recall(2.0));
    assert_eq!(solved(&mut lu), two);
    assert!(!lu.recall(3.0));
    assert_eq!(solved(&mut lu), two, "what is not there leaves the present factors");
    // those asked for least lately go first
    assert!(lu.recall(1.0));
    for key in 10..17 {
        lu.keep(f64::from(key));
    }
    assert!(lu.recall(1.0) && !lu.recall(2.0));
}

#[test]
fn factors_of_other_pivots_are_gone() {
    let (pattern, usual) = mesh(12);
    let mut nearly_singular = usual.clone();
    for i in (0..pattern.n).filter(|i| i % 5 > 0) {
        nearly_singular[pattern.position(i, i).unwrap()] = 1e-9;
    }
    let mut lu = lu_of(&pattern, &usual);
    lu.keep(1.0);
    lu.factor(&nearly_singular).unwrap();
    assert!(!lu.recall(1.0));
}

#[test]
fn factors_as_cheap_as_a_solution_are_not_kept() {
    let (pattern, values) = ladder(1000);
    let mut lu = lu_of(&pattern, &values);
    lu.keep(1.0);
    assert!(!lu.recall(1.0));
}
