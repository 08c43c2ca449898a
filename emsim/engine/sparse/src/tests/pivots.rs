//! When pivots are chosen anew.

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
    lu.factor(&nearly_singular).unwrap();
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
