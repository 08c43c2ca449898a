//! When pivots are chosen anew, and factors that are kept with the present ones.

use super::{lu_of, mesh};

#[test]
fn pivots_that_fill_the_factors_are_given_up_again() {
    let (pattern, usual) = mesh(12);
    // next to nothing on most places of the diagonal: other rows are taken first, and fill
    let mut nearly_singular = usual.clone();
    for i in (0..pattern.n).filter(|i| i % 5 > 0) {
        nearly_singular[pattern.position(i, i).unwrap()] = 1e-9;
    }
    let mut lu = lu_of(&pattern, &usual);
    let lean = lu.operations();
    lu.keep(1.0);
    lu.factor(&nearly_singular).unwrap();
    assert!(!lu.recall(1.0), "of other pivots");
    let swollen = lu.operations();
    assert!(swollen > 2 * lean, "{swollen} for {lean}");
    for _ in 0..20 {
        lu.factor_or_refactor(&usual).unwrap();
    }
    assert_eq!(lu.operations(), lean);
    // where nothing leaner serves, the search is given up
    lu.factor(&nearly_singular).unwrap();
    let before = lu.counters().factors;
    for _ in 0..1000 {
        lu.factor_or_refactor(&nearly_singular).unwrap();
    }
    assert_eq!(lu.operations(), swollen);
    assert!(lu.counters().factors - before < 10);
}

#[test]
fn what_was_kept_solves_as_it_did() {
    let (pattern, usual) = mesh(12);
    let mut lu = lu_of(&pattern, &usual);
    let mut solved = |key: f64, anew: bool| {
        let values: Vec<f64> = usual.iter().map(|v| if *v > 0.0 { key * v } else { *v }).collect();
        match anew {
            true => lu.refactor(&values).map(|()| lu.keep(key)).unwrap(),
            false => assert!(lu.recall(key)),
        }
        let mut b = vec![1.0; pattern.n];
        lu.solve(&mut b);
        b
    };
    let (one, two) = (solved(1.0, true), solved(1.5, true));
    assert!(one != two && solved(1.0, false) == one && solved(1.5, false) == two);
    (3..10).for_each(|key| drop(solved(f64::from(key), true)));
    assert!(lu.recall(1.5) && !lu.recall(1.0), "those asked for least lately go first");
}
