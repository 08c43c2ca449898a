//! Momenta to speeds, p = M(q) u, solved in symbols where that takes fewer operations than a dense factorisation.
//!
//! The momenta come as expressions in which every shared quantity (the velocity of a link, the force on it) is one node. Each
//! such node v that is linear in u is taken as an unknown of its own, defined by its row
//!
//!   v = sum c_w w + r,       and the last rows are     0 = p_i(...) - y_i
//!
//! a large sparse system whose elimination in a good order is the recursive dynamics of trees: link by link from the tips,
//! each with its articulated inertia, O(n) where M is full (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7,
//! finds the same by mechanics). The order: whatever fills in least is next. (Markowitz's product
//! instead takes 7 300 operations on a chain of 20 where least fill takes 2 400 and a dense factorisation 8 000.)
//!
//! Pivots: a definition is eliminated by its own 1. A speed u_j is eliminated by row p_j, and only when no other path leads from
//! that row back to u_j; its coefficient is then dp_j/du_j of what remains, so a pivot of LDL^T of M in that order: positive, and no
//! larger growth than Cholesky's. Products of the update are written such that those of symmetric places are one node.
use crate::graph::{Graph, Id, Node};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Systems above this size are left to the dense factorisation.
const GONE: usize = usize::MAX;

/// v = scale (sum coef w + rest); scale is -1/pivot of a speed.
struct Row {
    terms: BTreeMap<usize, Id>,
    rest: Id,
    pivot: Option<Id>, // 1/d
}

struct Elimination<'a> {
    g: &'a mut Graph,
    nodes: Vec<Id>, // of the variables
    rows: Vec<Row>,
    columns: Vec<BTreeSet<usize>>,
    speeds: usize, // the first so many variables, in the order of their rows
    left: Vec<bool>,
    fill: Vec<usize>,
    queue: BTreeSet<(usize, usize)>, // (fill, variable) of those that are left
    stale: BTreeSet<usize>,          // whose fill has changed
}

pub(super) struct Solution {
    pub speeds: Vec<Id>,
    /// 1/d of each
    pub pivots: Vec<Id>,
    /// quantities that the way back computes anyhow: (node, its value)
    pub known: Vec<(Id, Id)>,
}

/// The speeds as expressions, from 0 = exprs; None where one of these is not linear in `speeds` node by node.
pub(super) fn eliminate(g: &mut Graph, exprs: &[Id], speeds: &[Id]) -> Option<Solution> {
    let mut e = Elimination::new(g, exprs, speeds)?;
    let mut order = Vec::with_capacity(e.rows.len());
    while let Some(v) = e.next() {
        if let Some(pair) = e.last_pair() {
            return Some(e.backwards(&order, Some(pair)));
        }
        e.substitute(v);
        order.push(v);
    }
    if order.len() < e.rows.len() {
        return None;
    }
    Some(e.backwards(&order, None))
}

impl Elimination<'_> {
    fn new<'a>(g: &'a mut Graph, exprs: &[Id], speeds: &[Id]) -> Option<Elimination<'a>> {
        let zero = g.constant(0.0);
        let one = g.constant(1.0);
        let minus = g.constant(-1.0);
        let mut number: HashMap<Id, usize> = speeds.iter().copied().zip(0..).collect();
        let empty = || Row { terms: BTreeMap::new(), rest: zero, pivot: None };
        let mut nodes = speeds.to_vec();
        let mut rows: Vec<Row> = speeds.iter().map(|_| empty()).collect();
        for id in g.reachable(exprs) {
            let node = g.node(id);
            if number.contains_key(&id) || !node.operands().any(|o| number.contains_key(&o)) {
                continue;
            }
            let mut row = empty();
            let parts: [(Id, Id); 2] = match node {
                Node::Neg(a) => [(a, minus), (zero, one)],
                Node::Add(a, b) => [(a, one), (b, one)],
                Node::Sub(a, b) => [(a, one), (b, minus)],
                Node::Mul(a, b) if !number.contains_key(&a) => [(b, a), (zero, one)],
                Node::Mul(a, b) if !number.contains_key(&b) => [(a, b), (zero, one)],
                Node::Div(a, b) if !number.contains_key(&b) => {
                    let r = g.div(one, b);
                    [(a, r), (zero, one)]
                }
                _ => return None,
            };
            for (operand, factor) in parts {
                match number.get(&operand) {
                    Some(&w) => {
                        let old = row.terms.get(&w).copied().unwrap_or(zero);
                        row.terms.insert(w, g.add(old, factor));
                    }
                    None => {
                        let product = g.mul(operand, factor);
                        row.rest = g.add(row.rest, product);
                    }
                }
            }
            number.insert(id, rows.len());
            nodes.push(id);
            rows.push(row);
        }
        for (row, expr) in rows.iter_mut().zip(exprs) {
            row.terms.insert(*number.get(expr)?, one);
        }
        // systems above this size are left to the dense factorisation
        if rows.len() > 20_000 {
            return None;
        }
        let mut columns = vec![BTreeSet::new(); rows.len()];
        for (k, row) in rows.iter().enumerate() {
            for &w in row.terms.keys() {
                columns[w].insert(k);
            }
        }
        let n = rows.len();
        let (left, fill, stale) = (vec![true; n], vec![GONE; n], (0..n).collect());
        Some(Elimination { g, nodes, rows, columns, speeds: speeds.len(), left, fill, queue: BTreeSet::new(), stale })
    }

    /// The variable whose elimination fills in least, among those that may be next.
    fn next(&mut self) -> Option<usize> {
        for v in std::mem::take(&mut self.stale) {
            let fill = if self.left[v] { self.fill_of(v) } else { GONE };
            let old = std::mem::replace(&mut self.fill[v], fill);
            if old != fill {
                self.queue.remove(&(old, v));
                if fill != GONE {
                    self.queue.insert((fill, v));
                }
            }
        }
        let pair = self.left[..self.speeds].iter().filter(|&&left| left).count() == 2;
        let mut ready = self.queue.iter().map(|&(_, v)| v).filter(|&v| self.eligible(v));
        let first = ready.next()?;
        // the last two speeds wait for everything else
        Some(if pair && first < self.speeds { ready.find(|&v| v >= self.speeds).unwrap_or(first) } else { first })
    }

    /// Entries that the elimination of v would make.
    fn fill_of(&self, v: usize) -> usize {
        let rows = self.columns[v].iter().filter(|&&k| k != v);
        let new = |k: usize| self.rows[v].terms.keys().filter(|w| !self.rows[k].terms.contains_key(w)).count();
        rows.map(|&k| new(k)).sum()
    }

    fn eligible(&self, v: usize) -> bool {
        if v >= self.speeds {
            return !self.rows[v].terms.contains_key(&v);
        }
        if !self.rows[v].terms.contains_key(&v) {
            return false;
        }
        // is there another way from the row back to the speed?
        let mut seen = BTreeSet::new();
        let mut stack: Vec<usize> = self.rows[v].terms.keys().copied().filter(|&w| w != v).collect();
        while let Some(w) = stack.pop() {
            if w == v {
                return false;
            }
            if w >= self.speeds && seen.insert(w) {
                stack.extend(self.rows[w].terms.keys());
            }
        }
        true
    }

    /// Row `v` is solved for its variable, which leaves all other rows.
    fn substitute(&mut self, v: usize) {
        self.left[v] = false;
        self.stale.insert(v);
        let mut row = std::mem::replace(&mut self.rows[v], Row { terms: BTreeMap::new(), rest: 0, pivot: None });
        if v < self.speeds {
            let one = self.g.constant(1.0);
            row.pivot = row.terms.remove(&v).map(|d| self.g.div(one, d));
        }
        self.columns[v].remove(&v);
        for &w in row.terms.keys() {
            self.columns[w].remove(&v);
            self.stale.insert(w);
        }
        for k in std::mem::take(&mut self.columns[v]) {
            self.stale.insert(k);
            self.stale.extend(self.rows[k].terms.keys());
            let Some(factor) = self.rows[k].terms.remove(&v) else { continue };
            for (&w, &c) in &row.terms {
                let term = self.product(factor, c, row.pivot);
                let old = self.rows[k].terms.get(&w).copied();
                let new = match old {
                    Some(old) if row.pivot.is_some() => self.g.sub(old, term),
                    Some(old) => self.g.add(old, term),
                    None if row.pivot.is_some() => self.g.neg(term),
                    None => term,
                };
                if self.g.value(new) == Some(0.0) {
                    self.rows[k].terms.remove(&w);
                    self.columns[w].remove(&k);
                } else {
                    self.rows[k].terms.insert(w, new);
                    self.columns[w].insert(k);
                }
            }
            self.stale.extend(self.rows[k].terms.keys());
            let term = self.product(factor, row.rest, row.pivot);
            let rest = self.rows[k].rest;
            self.rows[k].rest = if row.pivot.is_some() { self.g.sub(rest, term) } else { self.g.add(rest, term) };
        }
        self.rows[v] = row;
    }

    /// a b r, one node whichever way round a and b come.
    fn product(&mut self, a: Id, b: Id, r: Option<Id>) -> Id {
        let Some(r) = r else { return self.g.mul(a, b) };
        let bare = |g: &Graph, id: Id| match g.node(id) {
            Node::Neg(x) => (x, true),
            _ => (id, false),
        };
        let ((a, na), (b, nb)) = (bare(self.g, a), bare(self.g, b));
        let scaled = self.g.mul(a.min(b), r);
        let product = self.g.mul(a.max(b), scaled);
        if na == nb {
            product
        } else {
            self.g.neg(product)
        }
    }

    /// The two speeds that alone are left.
    fn last_pair(&self) -> Option<[usize; 2]> {
        let left: Vec<usize> = (0..self.left.len()).filter(|&v| self.left[v]).collect();
        left.try_into().ok().filter(|pair: &[usize; 2]| pair[1] < self.speeds)
    }

    /// These two by Cramer's rule: one division, where a pivot after the other takes two that wait for each other.
    /// The second pivot is the determinant over the first: what it loses to cancellation is the same.
    fn by_determinant(&mut self, [a, b]: [usize; 2], values: &mut [Id], pivots: &mut [Id]) {
        let (one, zero) = (self.g.constant(1.0), self.g.constant(0.0));
        let coefficient = |row: usize, w: usize| self.rows[row].terms.get(&w).copied().unwrap_or(zero);
        let ([aa, ab, ba, bb], [ra, rb]) = (
            [coefficient(a, a), coefficient(a, b), coefficient(b, a), coefficient(b, b)],
            [self.rows[a].rest, self.rows[b].rest],
        );
        let (g, mut difference) = (&mut *self.g, [0; 3]);
        for (d, [p, q, r, s]) in difference.iter_mut().zip([[aa, bb, ab, ba], [ab, rb, bb, ra], [ba, ra, aa, rb]]) {
            let (left, right) = (g.mul(p, q), g.mul(r, s));
            *d = g.sub(left, right);
        }
        let [determinant, of_a, of_b] = difference;
        let inverse = g.div(one, determinant);
        (values[a], values[b]) = (g.mul(of_a, inverse), g.mul(of_b, inverse));
        (pivots[a], pivots[b]) = (g.div(one, aa), g.mul(aa, inverse));
    }

    /// Values, last eliminated first.
    fn backwards(mut self, order: &[usize], pair: Option<[usize; 2]>) -> Solution {
        let mut values: Vec<Id> = vec![0; self.rows.len()];
        let mut pivots: Vec<Id> = vec![0; self.speeds];
        if let Some(pair) = pair {
            self.by_determinant(pair, &mut values, &mut pivots);
        }
        for &v in order.iter().rev() {
            let row = std::mem::replace(&mut self.rows[v], Row { terms: BTreeMap::new(), rest: 0, pivot: None });
            let mut sum = row.rest;
            for (&w, &c) in &row.terms {
                let term = self.g.mul(c, values[w]);
                sum = self.g.add(sum, term);
            }
            if let Some(r) = row.pivot {
                let product = self.g.mul(r, sum);
                sum = self.g.neg(product);
                pivots[v] = r;
            }
            values[v] = sum;
        }
        let speeds = values[..self.speeds].to_vec();
        let needed: HashSet<Id> = self.g.reachable(&speeds).into_iter().collect();
        let all = self.nodes.iter().copied().zip(values);
        let known = all.filter(|(_, value)| needed.contains(value)).collect();
        Solution { speeds, pivots, known }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::derive::gradient;
    use crate::tape::{Inputs, Tape};

    /// A planar chain of point masses: angles q0.., speeds u0.. (relative), momenta y0..; p - y, and the graph.
    fn chain(g: &mut Graph, n: usize) -> (Vec<Id>, Vec<Id>) {
        let leaf = |g: &mut Graph, k: usize| g.unknown(k as u32);
        let u: Vec<Id> = (0..n).map(|k| leaf(g, n + k)).collect();
        let zero = g.constant(0.0);
        let (mut angle, mut speed, mut v, mut energy) = (zero, zero, [zero, zero], zero);
        for (k, &uk) in u.iter().enumerate() {
            let q = leaf(g, k);
            (angle, speed) = (g.add(angle, q), g.add(speed, uk));
            let arm = [g.call(crate::graph::Fun::Cos, angle), g.call(crate::graph::Fun::Sin, angle)];
            for i in 0..2 {
                let part = g.mul(arm[i], speed);
                v[i] = g.add(v[i], part);
                let square = g.mul(v[i], v[i]);
                let half = g.constant(0.5 + 0.1 * k as f64);
                let part = g.mul(half, square);
                energy = g.add(energy, part);
            }
        }
        let p = gradient(g, energy, &u);
        let exprs = p.iter().enumerate().map(|(k, &p)| {
            let y = leaf(g, 2 * n + k);
            g.sub(p, y)
        });
        (exprs.collect(), u)
    }

    #[test]
    fn speeds_give_back_their_momenta() {
        for n in [2, 3, 10] {
            let mut g = Graph::new();
            let (exprs, u) = chain(&mut g, n);
            let solution = eliminate(&mut g, &exprs, &u).expect("linear");
            let mut x: Vec<f64> = (0..3 * n).map(|k| (0.7 * k as f64).sin() + 0.2).collect();
            let outs = [solution.speeds, solution.pivots].concat();
            let found = Tape::new(&g, &outs).eval(&Inputs { x: &x, t: 0.0, waves: &[], flags: &[] });
            assert!(found[n..].iter().all(|&r| r > 0.0), "{found:?}");
            x[n..2 * n].copy_from_slice(&found[..n]);
            let left = Tape::new(&g, &exprs).eval(&Inputs { x: &x, t: 0.0, waves: &[], flags: &[] });
            assert!(left.iter().all(|r| r.abs() < 1e-12), "{left:?}");
        }
    }

    /// A mass matrix of two speeds costs one division, not two of which the second waits for the first; the same numbers.
    #[test]
    fn the_last_two_take_one_division() {
        let mut g = Graph::new();
        let (exprs, u) = chain(&mut g, 2);
        let [aa, ab, bb] = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| gradient(&mut g, exprs[i], &[u[j]])[0]);
        let Solution { speeds, pivots, .. } = eliminate(&mut g, &exprs, &u).expect("linear");
        let divisions = |ids: &[Id]| g.reachable(ids).iter().filter(|&&id| matches!(g.node(id), Node::Div(..))).count();
        assert_eq!(divisions(&speeds), 1);
        let x = [0.4, 1.1, 0.0, 0.0, 0.7, -0.3];
        let outs = [aa, ab, bb, pivots[0], pivots[1]];
        let [aa, ab, bb, first, second] =
            Tape::new(&g, &outs).eval(&Inputs { x: &x, t: 0.0, waves: &[], flags: &[] }).try_into().expect("five");
        assert!((first * aa - 1.0).abs() < 1e-14 && (second * (bb - ab * ab / aa) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_chain_takes_operations_in_proportion_to_its_length() {
        let operations = |n: usize| {
            let mut g = Graph::new();
            let (exprs, u) = chain(&mut g, n);
            let solution = eliminate(&mut g, &exprs, &u).expect("linear");
            g.reachable(&solution.speeds).len()
        };
        let (ten, twenty, forty) = (operations(10), operations(20), operations(40));
        assert!(twenty < 25 * ten / 10 && forty < 22 * twenty / 10, "{ten} {twenty} {forty}");
    }

    #[test]
    fn what_is_not_linear_is_left_alone() {
        let mut g = Graph::new();
        let (exprs, u) = chain(&mut g, 2);
        let square = g.mul(u[0], u[0]);
        let bent = g.add(exprs[0], square);
        assert!(eliminate(&mut g, &[bent, exprs[1]], &u).is_none());
    }
}
