//! Is the linear part of a system a passive network without gain?
//!
//! Resistors, capacitors, inductors without coupling and independent sources have, in one implicit stage, the matrix
//!
//!   [ Y   B ]      Y = G + a C of the nodes: symmetric, off-diagonal entries <= 0, row sums >= 0
//!   [ B'  Z ]      a source's row has B' = B^T, Z = 0;  an inductor's B' = -B^T, Z = a L + R >= 0
//!
//! with columns of B that hold +1 and -1, or one of the two. A junction with conductance m = g + a c across (p, n) adds
//! m d d^T to Y. For the voltage e that a stray current r through that junction makes across it, J^-1 being positive
//! semidefinite on the nodes,   |e| = |d^T J^-1 d r| <= |r| / m,   and by the maximum principle no node moves further than
//! |e| from where it was. So m, which is known without a solution, bounds what a residual at the junction can do.
//! Controlled sources, transformers and expressions can amplify; then nothing of the kind is claimed.
use crate::model::{Kind, Unknown};
use std::collections::BTreeMap;

type Entries = BTreeMap<(usize, usize), f64>;

/// True when `g` and `c` (sums of constant entries by row and column) are of the form above.
pub fn is_passive(unknowns: &[Unknown], g: &Entries, c: &Entries) -> bool {
    let n = unknowns.len();
    let node = |i: usize| unknowns[i].kind == Kind::Node;
    if !unknowns.iter().all(|u| matches!(u.kind, Kind::Node | Kind::Branch)) {
        return false;
    }
    let at = |m: &Entries, i: usize, j: usize| m.get(&(i, j)).copied().unwrap_or(0.0);
    // nodes: symmetric, diagonally dominant
    for m in [g, c] {
        let mut sum = vec![0.0; n];
        for (&(i, j), &v) in m {
            if node(i) && node(j) {
                if i != j && (v > 0.0 || v != at(m, j, i)) {
                    return false;
                }
                sum[i] += v;
            }
        }
        if (0..n).any(|i| node(i) && sum[i] < -1e-12 * at(m, i, i)) {
            return false;
        }
    }
    // branches: incidence in G alone, nothing between different branches
    if c.keys().any(|&(i, j)| node(i) != node(j)) {
        return false;
    }
    let mut columns: Vec<Vec<(f64, f64)>> = vec![Vec::new(); n]; // per branch: entry of its column, of its row
    for m in [g, c] {
        if m.iter().any(|(&(i, j), &v)| !node(i) && !node(j) && (i != j || v < 0.0)) {
            return false;
        }
    }
    for &(i, j) in g.keys() {
        match (node(i), node(j)) {
            (true, false) => columns[j].push((at(g, i, j), at(g, j, i))),
            (false, true) if at(g, j, i) == 0.0 => return false,
            _ => {}
        }
    }
    (0..n).filter(|&b| !node(b)).all(|b| {
        let storing = at(g, b, b) > 0.0 || at(c, b, b) > 0.0;
        let incidence = match columns[b][..] {
            [(p, _)] => p.abs() == 1.0,
            [(p, _), (q, _)] => p.abs() == 1.0 && q == -p,
            _ => false,
        };
        incidence && columns[b].iter().all(|&(p, q)| q == -p || (q == p && !storing))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknowns(kinds: &[Kind]) -> Vec<Unknown> {
        let of = |&kind: &Kind| Unknown { name: String::new(), kind, unit: String::new(), initial: 0.0 };
        kinds.iter().map(of).collect()
    }

    /// source 0-a, resistor a-b, inductor b-0 with its own branch, capacitor at b
    fn network() -> (Vec<Unknown>, Entries, Entries) {
        let u = unknowns(&[Kind::Node, Kind::Node, Kind::Branch, Kind::Branch]);
        let g = [((0, 0), 0.1), ((0, 1), -0.1), ((1, 0), -0.1), ((1, 1), 0.1), ((0, 2), 1.0), ((2, 0), 1.0)];
        let l = [((1, 3), 1.0), ((3, 1), -1.0)];
        (u, g.into_iter().chain(l).collect(), [((1, 1), 1e-6), ((3, 3), 1e-3)].into_iter().collect())
    }

    #[test]
    fn passive_network_is_recognised() {
        let (u, g, c) = network();
        assert!(is_passive(&u, &g, &c));
    }

    #[test]
    fn gain_negative_resistance_coupling_and_machines_are_not_passive() {
        let (u, g, c) = network();
        // voltage-controlled source: its row reads a node into which its current does not flow
        let mut gain = g.clone();
        gain.insert((2, 1), -1e3);
        assert!(!is_passive(&u, &gain, &c));
        let mut transconductance = g.clone();
        *transconductance.get_mut(&(1, 0)).unwrap() = 5.0;
        assert!(!is_passive(&u, &transconductance, &c));
        let mut negative = g.clone();
        *negative.get_mut(&(1, 1)).unwrap() = 0.05;
        assert!(!is_passive(&u, &negative, &c));
        let mut coupled = c.clone();
        coupled.insert((3, 2), 1e-4);
        assert!(!is_passive(&u, &g, &coupled));
        // an ideal transformer's column holds its ratio
        let mut ratio = g.clone();
        ratio.extend([((1, 2), -10.0), ((2, 1), -10.0)]);
        assert!(!is_passive(&u, &ratio, &c));
        let machine = unknowns(&[Kind::Node, Kind::Node, Kind::Branch, Kind::Coordinate]);
        assert!(!is_passive(&machine, &g, &c));
    }
}
