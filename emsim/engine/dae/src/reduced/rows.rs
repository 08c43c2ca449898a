//! F and Q of every row as expressions, and which rows keep a state.
use super::plan::{Plan, Source};
use crate::derive::substitute;
use crate::devices::{Seat, Shape};
use crate::floating_groups::Groups;
use crate::graph::Id;
use crate::model::Kind;
use std::collections::{BTreeMap, HashMap, HashSet};

impl Plan<'_> {
    /// F and Q of every row as expressions (multipliers mu are 0); the rows that keep a state.
    pub fn rows(&mut self) -> Vec<usize> {
        let (n, s) = (self.at.n, self.source);
        let [mut f, mut q] = self.without_devices();
        let branches = self.branches();
        let mut group = self.tied_by_charges(&branches);
        let mut has_q = vec![false; n];
        s.c.iter().for_each(|&(r, _, v)| has_q[r] |= v != 0.0);
        s.q.iter().for_each(|&(r, _)| has_q[r] = true);
        branches.iter().filter(|b| b.stores).flat_map(Branch::nodes).for_each(|i| has_q[i] = true);
        let dropped = self.dependent(&branches, &mut group, &has_q);
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
        let zero = self.g.constant(0.0);
        for (&last, rows) in &dropped {
            let sum = rows.iter().fold(zero, |sum, &r| self.g.add(sum, f[r]));
            f[last] = sum;
            self.sums.push((last, rows.clone()));
        }
        self.q = (0..n).map(|i| (has_q[i] && !dropped.contains_key(&i)).then_some(q[i])).collect();
        self.f = f;
        states
    }

    /// F and Q of every row but for devices.
    fn without_devices(&mut self) -> [Vec<Id>; 2] {
        let (n, s) = (self.at.n, self.source);
        let zero = self.g.constant(0.0);
        let (mut f, mut q) = (vec![zero; n], vec![zero; n]);
        for (list, out) in [(&s.g, &mut f), (&s.c, &mut q)] {
            for &(r, c, v) in list.iter().filter(|e| counts(s, e)) {
                let (x, v) = (self.g.unknown(c as u32), self.g.constant(v));
                let term = self.g.mul(v, x);
                out[r] = self.g.add(out[r], term);
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
        [f, q]
    }

    /// Rows and nodes that share charges.
    fn tied_by_charges(&self, branches: &[Branch]) -> Groups {
        let s = self.source;
        let mut group = Groups::new(self.at.n);
        s.c.iter().filter(|e| counts(s, e)).for_each(|&(r, c, _)| group.join(r, c));
        for &(r, id) in &s.q {
            for leaf in self.leaves(&[id]).into_iter().filter(|&leaf| s.unknowns[leaf].kind == Kind::Node) {
                group.join(r, leaf);
            }
        }
        for b in branches.iter().filter(|b| b.stores) {
            let ends: Vec<usize> = b.nodes().collect();
            ends.windows(2).for_each(|pair| group.join(pair[0], pair[1]));
        }
        group
    }

    /// Groups whose charges do not add up to nothing, by numbers, whatever the graph makes of them.
    fn grounded(&mut self, branches: &[Branch], group: &mut Groups) -> HashSet<usize> {
        let (s, zero) = (self.source, self.g.constant(0.0));
        let mut linear: HashMap<(usize, usize), (f64, f64)> = HashMap::new();
        for &(r, c, v) in s.c.iter().filter(|e| s.unknowns[e.0].kind == Kind::Node) {
            let sum = linear.entry((group.of(r), c)).or_default();
            *sum = (sum.0 + v, sum.1 + v.abs());
        }
        let mut nonlinear: HashMap<usize, Id> = HashMap::new();
        for &(r, id) in &s.q {
            let i = group.of(r);
            let old = nonlinear.get(&i).copied().unwrap_or(zero);
            nonlinear.insert(i, self.g.add(old, id));
        }
        let uneven = linear.iter().filter(|(_, (sum, size))| sum.abs() > 1e-12 * size).map(|(&(i, _), _)| i);
        let mut grounded: HashSet<usize> = uneven.collect();
        grounded.extend(nonlinear.into_iter().filter(|&(_, sum)| sum != zero).map(|(i, _)| i));
        let to_ground = branches.iter().filter(|b| b.stores && b.ends.iter().any(|&k| k < 0));
        grounded.extend(to_ground.flat_map(Branch::nodes).map(|i| group.of(i)));
        grounded
    }

    /// One row of every group that floats becomes the sum of all its rows: that one, and these.
    fn dependent(&mut self, branches: &[Branch], group: &mut Groups, has_q: &[bool]) -> BTreeMap<usize, Vec<usize>> {
        let grounded = self.grounded(branches, group);
        let mut floating: HashMap<usize, Vec<usize>> = HashMap::new();
        for r in (0..self.at.n).filter(|&r| self.source.unknowns[r].kind == Kind::Node && has_q[r]) {
            let i = group.of(r);
            if !grounded.contains(&i) {
                floating.entry(i).or_default().push(r);
            }
        }
        floating.into_values().filter_map(|rows| Some((*rows.last()?, rows))).collect()
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

impl Branch {
    /// Its ends but for ground.
    fn nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.ends.iter().filter_map(|&k| usize::try_from(k).ok())
    }
}

/// Is a constant entry part of the equations, without multipliers mu?
fn counts(s: &Source, &(_, c, v): &(usize, usize, f64)) -> bool {
    v != 0.0 && s.unknowns[c].kind != Kind::Mu
}
