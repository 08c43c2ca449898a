//! Linear circuits whose factors fill: power grids.
use crate::newton::Options;
use crate::root;
use crate::system::System;

/// Rule 2, of linear equations. A step of `SMOOTH` has a real and three complex factorisations and solutions, the work of 13 real ones;
/// one of `SHORT` a factorisation and six solutions. What rings undamped asks for the most steps of `SHORT` to one of `SMOOTH`: 4.4 at
/// 1e-3, as the sixth root of the tolerance (two_loop_rlc, rlc_ladder, lc_tank: 3.3, 4.4, 6.3, 9.2, 13 from 1e-2 to 1e-6); where each step
/// ends at a corner it is one. (A grid of 2500 nodes with 500 loads: 6.8 s of radau, 0.8 s of esdirk.)
pub fn fills(sys: &System, o: &Options) -> bool {
    let Ok(symbolic) = sys.symbolic() else { return false };
    let (factor, solve) = symbolic.fill();
    let (factor, solve) = (factor as f64, solve as f64);
    let steps = 4.4 * root(1e-3 / o.reltol, 6);
    o.fixed_step.is_none() && 13.0 * (factor + solve) > steps * (factor + 6.0 * solve)
}
