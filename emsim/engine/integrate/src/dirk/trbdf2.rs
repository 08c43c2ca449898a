//! TR-BDF2: L-stable, stiffly accurate, order 2, one trapezoidal stage to gamma h and BDF2 from there to h.
//!
//! gamma = 2 - sqrt 2 makes both stages share one matrix and the error least (Bank, Coughran, Fichtner, Grosse, Rose and
//! Smith 1985; Hosea and Shampine 1996, table 1, whose embedded formula of order 3 measures the error).
//! Dense output: the parabola through the three stages, each of which is of order 2.
use super::Tableau;

pub fn tableau() -> Tableau {
    let root = std::f64::consts::SQRT_2;
    let (gamma, d, w) = (2.0 - root, 1.0 - 0.5 * root, 0.25 * root);
    let embedded = [(1.0 - w) / 3.0, (3.0 * w + 1.0) / 3.0, d / 3.0];
    let (l0, l1, l2) = (1.0 / gamma, 1.0 / (gamma * (gamma - 1.0)), 1.0 / (1.0 - gamma));
    Tableau {
        c: vec![0.0, gamma, 1.0],
        a: vec![vec![d, d], vec![w, w, d]],
        d: vec![w - embedded[0], w - embedded[1], d - embedded[2]],
        // Lagrange's polynomials of the nodes 0, gamma, 1
        dense: vec![vec![1.0, -(1.0 + gamma) * l0, l0], vec![0.0, -l1, l1], vec![0.0, -gamma * l2, l2]],
        falls: 3,
        local: 0.1,
    }
}
