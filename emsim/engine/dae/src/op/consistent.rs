//! Algebraic unknowns that fit what is stored: at the start, and behind jumps.
use crate::newton::{Newton, Tolerances};
use crate::reduced::augment;
use crate::system::{System, Work};

/// Does `consistent` with `refine` leave everything as it is?
pub fn is_all_state(sys: &System) -> bool {
    sys.devices() == 0 && sys.differential.iter().all(|&d| d)
}

/// Consistent values at t after a discontinuity, or at the start: one backward Euler step so short that charges,
/// fluxes and momenta cannot move, but everything algebraic must fit:  Q(x1) - Q(x0) + h F(x1) = 0.
/// With `refine`, multipliers and derivative unknowns are extrapolated from two such steps (their error is O(h)).
/// On failure what is stored stays as it was, false: the method's own first step, stiffly accurate, will do the same work.
/// `charges`: Q(x0) where the equations were others before.
pub fn consistent(
    sys: &System,
    newton: &mut Newton,
    w: &mut Work,
    x: &mut [f64],
    charges: Option<Vec<f64>>,
    (t, h): (f64, f64),
    tol: &Tolerances,
    refine: bool,
) -> bool {
    sys.eval(w, x, t);
    let q0 = charges.unwrap_or_else(|| w.q.clone());
    let ports = w.ports.clone();
    let mut step = |w: &mut Work, h: f64, from: &[f64]| -> Option<Vec<f64>> {
        newton.forget();
        let r: Vec<f64> = q0.iter().map(|q| -q / h).collect();
        let mut y = from.to_vec();
        newton.solve(sys, w, 1.0 / h, &r, &mut y, t + h, tol, 100).ok()?;
        // multipliers live on second differences of positions, voltages of coils on those of fluxes: a second, linear pass removes
        // Newton's noise
        newton.solve(sys, w, 1.0 / h, &r, &mut y, t + h, tol, 100).ok()?;
        Some(y)
    };
    let (lags, given) = if refine { (undetermined(sys), vec![false; sys.n]) } else { (Vec::new(), Vec::new()) };
    let stays = Stays { lags: &lags, given: &given, near: true };
    let Some(y1) = step(w, h, x) else {
        w.ports = ports;
        if refine {
            hold(sys, newton, w, (t, x), h, &tol.at_least(1e-6), &stays);
        }
        return false;
    };
    let y2 = if refine { step(w, 2.0 * h, &y1) } else { None };
    if let Some(y2) = y2 {
        // of nodes that capacitors tie together the differences are states, what they have in common is not
        for i in 0..sys.n {
            if !sys.differential[i] || sys.floating[i] {
                x[i] = 2.0 * y1[i] - y2[i];
            }
        }
    } else {
        for i in 0..sys.n {
            if !(sys.differential[i] && sys.unknowns[i].kind.mechanical() && refine) {
                x[i] = y1[i];
            }
        }
    }
    if refine {
        // nothing is divided by the length over which what is stored is held: so much of the other
        hold(sys, newton, w, (t, x), 1e-3 * h, tol, &stays);
    }
    true
}

/// Unknowns that stand neither under d/dt nor are given, as index 1, by the rows without it: a maximum matching of these rows
/// leaves them over, or could (the underdetermined part of Dulmage and Mendelsohn's decomposition). They are multipliers,
/// derivatives, the current of a capacitor across a source, and what follows from them; the current that a motor of
/// no inductance takes, r i = v - k omega, is none.
pub fn undetermined(sys: &System) -> Vec<bool> {
    // what nodes that capacitors tie together have in common is no state: their root stands for it, in every row that reads one of them
    let tied: Vec<(usize, usize)> = sys.sums.iter().filter(|s| s.tied).map(|s| (s.node, s.root)).collect();
    let algebraic = |k: usize| !sys.differential[k] || tied.iter().any(|&(_, root)| root == k);
    let mut columns: Vec<Vec<usize>> = (0..sys.n).map(|k| sys.pattern.column(k).to_vec()).collect();
    for &(node, root) in &tied {
        let more = columns[node].clone();
        columns[root].extend(more);
    }
    let mut reads = vec![Vec::new(); sys.n];
    for k in (0..sys.n).filter(|&k| algebraic(k)) {
        for &r in columns[k].iter().filter(|&&r| !sys.has_q[r]) {
            if !reads[r].contains(&k) {
                reads[r].push(k);
            }
        }
    }
    let (mut by, mut of) = (vec![None; sys.n], vec![None; sys.n]);
    for r in (0..sys.n).filter(|r| reads[*r].contains(r)) {
        (by[r], of[r]) = (Some(r), Some(r));
    }
    for r in 0..sys.n {
        if of[r].is_none() && !reads[r].is_empty() {
            augment(r, &|r| reads[r].clone(), &mut by, &mut of);
        }
    }
    // (the effort of a law is one while its flow is 0, whatever its row reads in its other modes)
    let laws = sys.laws.list.iter().map(|law| law.row);
    let mut left: Vec<usize> = (0..sys.n).filter(|&k| algebraic(k) && by[k].is_none()).chain(laws).collect();
    let mut found = vec![false; sys.n];
    while let Some(k) = left.pop() {
        if !std::mem::replace(&mut found[k], true) {
            left.extend(columns[k].iter().filter_map(|&r| of[r]));
        }
    }
    found
}

/// What a point holds while its algebraic equations are solved.
pub struct Stays<'a> {
    /// follows from changes of what is stored, and stays
    pub lags: &'a [bool],
    /// has what a source has, whatever is stored there
    pub given: &'a [bool],
    /// is the point near enough for the slopes there to be taken away from the first step?
    pub near: bool,
}

/// Algebraic unknowns that satisfy their rows at (t, x) with what is stored as it is: over a length of h the fastest may move, and
/// what was extrapolated from there does not fit the state at t. So the slopes at t are taken away, and what they are is known the better
/// the better the algebraic unknowns are: again and again, over shorter lengths, while states move by less each time (10 nH behind
/// 10 kohm are there within 1 ps). Gives by how many tolerances they would still have moved.
pub fn hold(
    sys: &System,
    newton: &mut Newton,
    w: &mut Work,
    (t, x): (f64, &mut [f64]),
    h: f64,
    tol: &Tolerances,
    stays: &Stays,
) -> f64 {
    let (mut h, mut left) = (h, f64::INFINITY);
    // what stays may be far up an exponential, and slopes there say nothing
    // up to so many times a hundredth of it
    let passes = if sys.exponentials() > 0 && !stays.near { 1 } else { 6 };
    for pass in 0..passes {
        let ports = w.ports.clone();
        sys.eval(w, x, t);
        let slope = |i: usize| if stays.near || pass > 0 { w.f[i] } else { 0.0 };
        let r: Vec<f64> = (0..sys.n).map(|i| if sys.has_q[i] { -(w.q[i] / h + slope(i)) } else { 0.0 }).collect();
        newton.forget();
        let mut y = x.to_vec();
        let solved = newton.solve(sys, w, 1.0 / h, &r, &mut y, t, tol, 100).is_ok();
        let moved: Vec<f64> = (0..sys.n).map(|i| if stays.given[i] { 0.0 } else { y[i] - x[i] }).collect();
        let now = if solved { tol.largest_error(&moved, &y, x) } else { f64::INFINITY };
        // beyond that there is rounding, and what no length changes
        if now >= left {
            w.ports = ports;
            break;
        }
        let solved_for = |i: &usize| stays.given[*i] || !sys.differential[*i] && !stays.lags[*i];
        (0..sys.n).filter(solved_for).for_each(|i| x[i] = y[i]);
        left = now;
        if left <= 1.0 && (pass > 0 || !stays.near) {
            break;
        }
        h *= 0.01;
    }
    left
}
