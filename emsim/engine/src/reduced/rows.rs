//! F and Q of every row as expressions, and which rows keep a state.
use super::plan::Plan;
use crate::derive::substitute;
use crate::devices::{Seat, Shape};
use crate::graph::Id;
use crate::islands::Islands;
use crate::model::Kind;
use std::collections::{HashMap, HashSet};

impl Plan<'_> {
    /// F and Q of every row as expressions (multipliers mu are 0); the rows that keep a state.
    pub fn rows(&mut self) -> Vec<usize> {
        let n = self.at.n;
        let s = self.source;
        let zero = self.g.constant(0.0);
        let (mut f, mut q) = (vec![zero; n], vec![zero; n]);
        let mut island = Islands::new(n);
        for (list, out, charge) in [(&s.g, &mut f, false), (&s.c, &mut q, true)] {
            for &(r, c, v) in list {
                if v == 0.0 || s.unknowns[c].kind == Kind::Mu {
                    continue;
                }
                let (x, v) = (self.g.unknown(c as u32), self.g.constant(v));
                let term = self.g.mul(v, x);
                out[r] = self.g.add(out[r], term);
                if charge {
                    island.join(r, c);
                }
            }
        }
        for &(r, k, v) in s.f_wave {
            let (x, v) = (self.g.wave(k as u32), self.g.constant(v));
            let term = self.g.mul(v, x);
            f[r] = self.g.add(f[r], term);
        }
        let mus: Vec<(Id, Id)> =
            (0..n).filter(|&i| s.unknowns[i].kind == Kind::Mu).map(|i| (self.g.unknown(i as u32), zero)).collect();
        for (list, out) in [(&s.f, &mut f), (&s.q, &mut q)] {
            let ids: Vec<Id> = list.iter().map(|e| e.1).collect();
            let ids = if mus.is_empty() { ids } else { substitute(self.g, &ids, &mus) };
            for (&(r, _), id) in list.iter().zip(ids) {
                out[r] = self.g.add(out[r], id);
            }
        }
        for &(r, id) in &s.q {
            for leaf in self.leaves(&[id]) {
                if s.unknowns[leaf].kind == Kind::Node {
                    island.join(r, leaf);
                }
            }
        }
        // linear charges of an island cancel in its sum, or they do not: numbers, whatever the graph makes of them
        let mut linear: HashMap<(usize, usize), (f64, f64)> = HashMap::new();
        let node = |i: usize| s.unknowns[i].kind == Kind::Node;
        let branches = self.branches();
        for b in branches.iter().filter(|b| b.stores) {
            let ends: Vec<usize> = b.ends.iter().filter_map(|&k| usize::try_from(k).ok()).collect();
            ends.windows(2).for_each(|pair| island.join(pair[0], pair[1]));
        }
        let mut has_q = vec![false; n];
        let mut grounded: HashSet<usize> = HashSet::new();
        for &(r, c, v) in &s.c {
            has_q[r] |= v != 0.0;
            if node(r) {
                let sum = linear.entry((island.of(r), c)).or_default();
                *sum = (sum.0 + v, sum.1 + v.abs());
            }
        }
        for (&(i, _), (sum, size)) in &linear {
            if sum.abs() > 1e-12 * size {
                grounded.insert(i);
            }
        }
        let mut nonlinear: HashMap<usize, Id> = HashMap::new();
        for &(r, id) in &s.q {
            has_q[r] = true;
            let i = island.of(r);
            let old = nonlinear.get(&i).copied().unwrap_or(zero);
            nonlinear.insert(i, self.g.add(old, id));
        }
        for (i, sum) in nonlinear {
            if sum != zero {
                grounded.insert(i);
            }
        }
        for b in branches.iter().filter(|b| b.stores) {
            let (first, second) = (b.ends[0], b.ends[1]);
            for i in b.ends.iter().filter_map(|&k| usize::try_from(k).ok()) {
                has_q[i] = true;
                if first < 0 || second < 0 {
                    grounded.insert(island.of(i));
                }
            }
        }
        // one row of every island that floats becomes the sum of all its rows
        let mut floating: HashMap<usize, Vec<usize>> = HashMap::new();
        for r in (0..n).filter(|&r| node(r) && has_q[r]) {
            let i = island.of(r);
            if !grounded.contains(&i) {
                floating.entry(i).or_default().push(r);
            }
        }
        let mut dropped: HashMap<usize, Vec<usize>> = HashMap::new();
        for rows in floating.into_values() {
            if let Some(&last) = rows.last() {
                dropped.insert(last, rows);
            }
        }
        let keeps = |i: usize| {
            let k = s.unknowns[i].kind;
            has_q[i] && !matches!(k, Kind::Mu | Kind::Lambda | Kind::Derivative) && !dropped.contains_key(&i)
        };
        let states: Vec<usize> = (0..n).filter(|&i| keeps(i)).collect();
        self.at.states = states.len();
        for b in &branches {
            for (&row, sign) in b.rows.iter().zip([1.0, -1.0, 1.0, -1.0]) {
                let Ok(row) = usize::try_from(row) else { continue };
                let sign = self.g.constant(sign);
                for (out, flow) in [(&mut f, b.current), (&mut q, b.charge)] {
                    let term = self.g.mul(sign, flow);
                    out[row] = self.g.add(out[row], term);
                }
            }
        }
        for (&last, rows) in &dropped {
            let sum = rows.iter().fold(zero, |sum, &r| self.g.add(sum, f[r]));
            f[last] = sum;
        }
        self.q = (0..n).map(|i| (has_q[i] && !dropped.contains_key(&i)).then_some(q[i])).collect();
        self.f = f;
        states
    }

    /// The branches of all devices by their laws, read as expressions.
    fn branches(&mut self) -> Vec<Branch> {
        let gmin = self.leaf(self.at.gmin());
        let mut branches = Vec::new();
        for class in &self.source.classes {
            for (k, seat) in class.seats().iter().enumerate() {
                let shape = class.shape(k);
                let v = self.voltages(seat, shape);
                for (j, (current, charge)) in class.symbols(k, self.g, &v, gmin).into_iter().enumerate() {
                    let (p, n) = shape.branches[j];
                    let ends = [seat.nodes[p], seat.nodes[n]];
                    branches.push(Branch { ends, rows: seat.rows[j], stores: shape.stores(j), current, charge });
                }
            }
        }
        branches
    }

    /// Port voltages of an instance.
    pub fn voltages(&mut self, seat: &Seat, shape: &Shape) -> Vec<Id> {
        let zero = self.g.constant(0.0);
        let mut node = |k: usize| usize::try_from(seat.nodes[k]).map_or(zero, |k| self.g.unknown(k as u32));
        let ends: Vec<(Id, Id)> = shape.ports.iter().map(|&(p, n)| (node(p), node(n))).collect();
        ends.into_iter().map(|(p, n)| self.g.sub(p, n)).collect()
    }
}

/// A branch of a device.
struct Branch {
    ends: [i32; 2],
    rows: [i32; 4],
    stores: bool,
    current: Id,
    charge: Id,
}
