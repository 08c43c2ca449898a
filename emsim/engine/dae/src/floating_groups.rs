//! Nodes that capacitors tie to each other and to nothing else: what the currents into all of them come to.
//!
//! The rows of such a group have  sum_i Q_i = 0:  its common voltage stores nothing, and follows from the sum of its rows, in
//! which every charge cancels. A solver that meets only the rows themselves finds that sum as a difference of numbers of the size of
//! C/h: at a nanosecond 100 uF are 1e5 S, which leaves 1e-11 S of rounding, and turned-off diodes of a bridge have 1e-12 S in common.
//! So one row of each group, its root's, is replaced by the sum, made here, from contributions that cancel one by one; no row of C is
//! left in it, and methods see an algebraic equation for what it is.
//!
//! A group whose voltage a source fixes is left as it is: there nothing hangs on the sum but the source's current. So is one that
//! resistances hold firmly: the sum has more entries than the row it replaces.
//!
//! The same befalls a whole part of a circuit that hangs on nothing but megohms, as the secondary of a transformer with all that it
//! feeds: its nodes may be held firmly, but only by each other. Such a part gets a sum of its own, of the groups' sums in it
//! and the rows of its other nodes: a second layer.
use crate::devices::Line;
use crate::graph::{Graph, Id, Node};
use crate::model::{Kind, Model};
use crate::sparse::Pairs;
use std::collections::{BTreeMap, BTreeSet};

/// Union-find over unknowns.
pub struct Groups {
    parent: Vec<usize>,
}

impl Groups {
    pub fn new(n: usize) -> Groups {
        Groups { parent: (0..n).collect() }
    }

    pub fn of(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.parent[a] = b;
    }
}

/// A resistance above this (below, as a conductance [S]) does not make two nodes one part.
const LOOSE: f64 = 1e-5;

/// A branch of a device.
struct Branch {
    ends: (i32, i32),
    stores: bool,
    capacitance: f64,     // without a voltage
    charged_by: Vec<i32>, // the nodes whose voltages its charge hangs on
}

/// Of every node whose row is part of a sum the node whose row the sum is, itself included.
pub type Roots = BTreeMap<usize, usize>;

impl Model {
    /// Makes the roots' rows of floating groups and parts sums: what each layer sums. And the nodes of all groups, the ones that are left
    /// as they are among them.
    pub fn sum_floating_groups(&mut self, g: &mut Graph) -> ([Roots; 2], Vec<usize>) {
        let (mut groups, floating) = self.floating(g);
        let parts = self.loose_parts(g, &mut groups);
        self.sum_rows(g, &groups);
        // a node of a group is in its root's row by now
        let rows = parts.iter().filter(|(node, _)| groups.get(node).is_none_or(|root| root == *node));
        let rows = rows.map(|(&node, &root)| (node, root)).collect();
        self.sum_rows(g, &rows);
        ([groups, parts], floating)
    }

    /// The branches of all devices.
    fn branches(&self) -> impl Iterator<Item = Branch> + '_ {
        let instances = self.classes.iter().flat_map(|c| (0..c.seats().len()).map(move |k| (c, k)));
        instances.flat_map(|(class, k)| {
            let (seat, shape, mut still) = (&class.seats()[k], class.shape(k), Line::default());
            if shape.stores_any() {
                class.at(k, &vec![0.0; shape.ports.len()], 0.0, &mut still);
            }
            let ports = shape.ports.len();
            let branch = move |(j, &(p, n)): (usize, &(usize, usize))| {
                let charging = (0..ports).filter(|&port| shape.link(j, port).charge);
                let own = still.c.iter().skip(j * ports).take(ports);
                Branch {
                    ends: (seat.nodes[p], seat.nodes[n]),
                    stores: shape.stores(j),
                    capacitance: own.map(|c| c.abs()).sum(),
                    charged_by: charging
                        .flat_map(|port| [shape.ports[port].0, shape.ports[port].1])
                        .map(|k| seat.nodes[k])
                        .collect(),
                }
            };
            shape.branches.iter().enumerate().map(branch).collect::<Vec<_>>()
        })
    }

    fn sum_rows(&mut self, g: &mut Graph, roots: &Roots) {
        if roots.is_empty() {
            return;
        }
        let root_of = |row: usize| roots.get(&row).copied();
        for entries in [&mut self.g, &mut self.c, &mut self.f_wave] {
            let mut sums: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
            for &(row, col, v) in entries.iter() {
                if let Some(root) = root_of(row) {
                    sums.entry((root, col)).or_default().push(v);
                }
            }
            entries.retain(|e| root_of(e.0) != Some(e.0));
            for ((root, col), mut parts) in sums {
                cancel(&mut parts);
                entries.extend(parts.into_iter().map(|v| (root, col, v)));
            }
        }
        for rows in [&mut self.f, &mut self.q] {
            let mut sums: BTreeMap<usize, BTreeMap<Id, i32>> = BTreeMap::new();
            for (&row, &e) in rows.iter() {
                if let Some(root) = root_of(row) {
                    add_terms(g, e, sums.entry(root).or_default());
                }
            }
            for (root, terms) in sums {
                rows.remove(&root);
                let sum = terms.into_iter().filter(|&(_, count)| count != 0).fold(None, |sum, (id, count)| {
                    let count = g.constant(f64::from(count));
                    let term = g.mul(count, id);
                    Some(sum.map_or(term, |sum| g.add(sum, term)))
                });
                rows.extend(sum.map(|sum| (root, sum)));
            }
        }
        for rows in self.classes.iter_mut().flat_map(|c| c.seats_mut()).flat_map(|seat| &mut seat.rows) {
            let mut net: BTreeMap<usize, i32> = BTreeMap::new();
            for (k, place) in rows.iter_mut().enumerate() {
                let Some((row, root)) = usize::try_from(*place).ok().and_then(|row| Some((row, root_of(row)?))) else {
                    continue;
                };
                *net.entry(root).or_default() += 1 - 2 * (k as i32 % 2);
                if row == root {
                    *place = -1;
                }
            }
            // inside of one group it cancels
            for (root, count) in net.into_iter().filter(|&(_, count)| count != 0) {
                let first = usize::from(count < 0);
                if let Some(k) = [first, first + 2].into_iter().find(|&k| rows[k] < 0) {
                    rows[k] = root as i32;
                }
            }
        }
        self.ic_charge.retain(|&(row, _)| root_of(row) != Some(row));
    }

    /// The groups, each with a root, and the nodes of all.
    fn floating(&self, g: &Graph) -> (Roots, Vec<usize>) {
        let n = self.unknowns.len();
        let node = |i: usize| self.unknowns[i].kind == Kind::Node;
        let ground = n;
        let mut group = Groups::new(n + 1);
        let end = |k: i32| usize::try_from(k).unwrap_or(ground);
        let mut charged: BTreeSet<usize> = BTreeSet::new();
        for &(row, col, _) in self.c.iter().filter(|e| node(e.0)) {
            group.join(row, if node(col) { col } else { ground });
            charged.insert(row);
        }
        for (&row, &e) in self.q.iter().filter(|(&row, _)| node(row)) {
            for leaf in g.unknowns(&[e]) {
                group.join(row, if node(leaf) { leaf } else { ground });
            }
            charged.insert(row);
        }
        for branch in self.branches().filter(|b| b.stores) {
            let (p, n) = branch.ends;
            group.join(end(p), end(n));
            branch.charged_by.iter().for_each(|&k| group.join(end(p), end(k)));
            charged.extend([p, n].into_iter().filter_map(|k| usize::try_from(k).ok()));
        }
        // a charge that does not cancel in the sum leads to ground
        for (of, _, _) in left(self.c.iter().filter(|e| node(e.0)), &mut group) {
            group.join(of, ground);
        }
        for of in with_terms_left(g, self.q.iter().filter(|(&row, _)| node(row)), &mut group) {
            group.join(of, ground);
        }
        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for &row in &charged {
            members.entry(group.of(row)).or_default().push(row);
        }
        members.remove(&group.of(ground));
        let floating = members.values().flatten().copied().collect();
        self.forget_pinned(&mut members, &mut group);

        let weight = self.weights();
        let mut roots = Roots::new();
        for nodes in members.values() {
            if let Some(root) = self.eligible(nodes).max_by_key(|&i| weight[i]) {
                roots.extend(nodes.iter().map(|&i| (i, root)));
            }
        }
        (roots, floating)
    }

    /// Nodes whose row may be the sum: where `.ic` holds one, the sum has what comes from there, and it is that node's row.
    fn eligible<'a>(&self, nodes: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        let forced: BTreeSet<usize> = self.forces.iter().map(|f| f.row).collect();
        let held = nodes.iter().any(|i| forced.contains(i));
        nodes.iter().copied().filter(move |i| !held || forced.contains(i))
    }

    /// The largest capacitance in each set of nodes, of devices without a voltage.
    fn stored(&self, set: &mut Groups) -> BTreeMap<usize, f64> {
        let mut stored: BTreeMap<usize, f64> = BTreeMap::new();
        let devices = self.branches().filter(|b| b.stores);
        let devices = devices.filter_map(|b| Some((usize::try_from(b.ends.0.max(b.ends.1)).ok()?, b.capacitance)));
        for (row, v) in self.c.iter().map(|&(row, _, v)| (row, v)).chain(devices) {
            let largest = stored.entry(set.of(row)).or_default();
            *largest = largest.max(v.abs());
        }
        stored
    }

    /// How many currents stand in each row.
    fn weights(&self) -> Vec<usize> {
        let mut weight = vec![0_usize; self.unknowns.len()];
        self.g.iter().for_each(|e| weight[e.0] += 1);
        let ends = self.branches().flat_map(|b| [b.ends.0, b.ends.1]);
        ends.filter(|&k| k >= 0).for_each(|k| weight[k as usize] += 1);
        weight
    }

    /// The parts that hang on nothing but loose resistances, each with a root. No root is of a group: where groups are all of a
    /// part, one of them gives way.
    fn loose_parts(&self, g: &Graph, groups: &mut Roots) -> Roots {
        let n = self.unknowns.len();
        let node = |i: usize| self.unknowns[i].kind == Kind::Node;
        let ground = n;
        let end = |k: i32| usize::try_from(k).unwrap_or(ground);
        let mut part = Groups::new(n + 1);
        // what flows from node to node: through a conductance, as a branch's current, as a term that both rows have
        let mut met: BTreeMap<usize, usize> = BTreeMap::new();
        let currents = self.g.iter().filter(|e| !node(e.1) || e.2.abs() >= LOOSE);
        for &(row, col, _) in currents.chain(&self.c).filter(|e| node(e.0)) {
            part.join(row, if node(col) { col } else { *met.entry(col).or_insert(row) });
        }
        let expressions = || self.f.iter().chain(&self.q).filter(|(&row, _)| node(row));
        let mut shared: BTreeMap<Id, usize> = BTreeMap::new();
        for (&row, &e) in expressions() {
            let mut terms = BTreeMap::new();
            add_terms(g, e, &mut terms);
            terms.keys().for_each(|&id| part.join(row, *shared.entry(id).or_insert(row)));
        }
        self.branches().for_each(|b| part.join(end(b.ends.0), end(b.ends.1)));
        // what does not cancel leads to ground, unless it is loose
        let mut leads: BTreeMap<usize, f64> = BTreeMap::new();
        for (of, col, size) in left(self.g.iter().filter(|e| node(e.0)), &mut part) {
            if size >= LOOSE || !node(col) {
                part.join(of, ground);
            }
            *leads.entry(of).or_default() += size;
        }
        for (of, _, _) in left(self.c.iter().filter(|e| node(e.0)), &mut part) {
            part.join(of, ground);
        }
        for of in with_terms_left(g, expressions(), &mut part) {
            part.join(of, ground);
        }
        let stored = self.stored(&mut part);
        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        (0..n).filter(|&i| node(i)).for_each(|i| members.entry(part.of(i)).or_default().push(i));
        members.remove(&part.of(ground));
        let weight = self.weights();
        let mut roots = Roots::new();
        for (of, nodes) in members {
            let held = leads.get(&of).copied().unwrap_or(0.0);
            // time constant in which a resistance to something fixed holds a group firmly [s]: of the sum 1e-20/h is
            // rounding then
            let firm = stored.get(&of).is_none_or(|c| *c <= 1e-4 * held);
            let group_of = |i: usize| groups.get(&i).copied();
            if firm
                || nodes.len() < 2
                || nodes.iter().all(|&i| group_of(i).is_some() && group_of(i) == group_of(nodes[0]))
            {
                continue;
            }
            let free = self.eligible(&nodes).filter(|&i| group_of(i).is_none()).max_by_key(|&i| weight[i]);
            let Some(root) = free.or_else(|| self.eligible(&nodes).max_by_key(|&i| weight[i])) else { continue };
            if let Some(way) = group_of(root) {
                groups.retain(|_, r| *r != way);
            }
            roots.extend(nodes.iter().map(|&i| (i, root)));
        }
        roots
    }

    /// Leaves out the groups whose voltage sources fix or resistances hold.
    fn forget_pinned(&self, members: &mut BTreeMap<usize, Vec<usize>>, group: &mut Groups) {
        let n = self.unknowns.len();
        let node = |i: usize| self.unknowns[i].kind == Kind::Node;
        let mut rows: BTreeMap<usize, Vec<(usize, f64)>> = BTreeMap::new();
        for &(row, col, v) in self.g.iter().filter(|e| self.unknowns[e.0].kind == Kind::Branch) {
            rows.entry(row).or_default().push((col, v));
        }
        let stores: BTreeSet<usize> = self.c.iter().map(|e| e.0).chain(self.q.keys().copied()).collect();
        rows.retain(|&row, entries| !stores.contains(&row) && entries.iter().all(|&(col, v)| col != row || v == 0.0));
        let mut tied = Groups::new(n + 1);
        (0..=n).for_each(|i| tied.join(i, group.of(i)));
        for entries in rows.values() {
            let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
            for &(col, v) in entries.iter().filter(|e| node(e.0)) {
                *sums.entry(group.of(col)).or_default() += v;
            }
            sums.retain(|_, sum| *sum != 0.0);
            let ends: Vec<(usize, f64)> = sums.into_iter().collect();
            match ends[..] {
                [(a, v), (b, w)] if v == -w => tied.join(a, b),
                _ => ends.iter().for_each(|&(of, _)| tied.join(of, n)),
            }
        }
        let fixed = tied.of(n);
        let (stored, mut held) = (self.stored(group), BTreeMap::<usize, f64>::new());
        for &(row, col, v) in self.g.iter().filter(|e| node(e.0) && node(e.1)) {
            // what a row's entries within its group and to nodes that follow come to leads to nodes that are fixed
            if group.of(row) == group.of(col) || tied.of(col) != fixed {
                *held.entry(group.of(row)).or_default() += v;
            }
        }
        let firm = |of: usize| match (stored.get(&of), held.get(&of)) {
            // the same of a group: its common voltage is no state, and in the femtoseconds in which a run begins or a
            // switch turns its rounding must not pass for a movement; of the sum 1e-24/h is
            (Some(c), Some(g)) => *c <= 1e-8 * g,
            _ => false,
        };
        members.retain(|&of, nodes| nodes.len() > 1 && tied.of(of) != fixed && !firm(of));
    }
}

/// The differences in the roots' rows: of a node outside from the one inside that leads there best. `g` are the entries before
/// their rows were summed.
pub fn sum_pairs(pairs: &mut Pairs, g: &BTreeMap<(usize, usize), f64>, roots: &Roots) {
    let mut best: BTreeMap<(usize, usize), (f64, usize)> = BTreeMap::new();
    for (&(row, col), &v) in g {
        let Some(&root) = roots.get(&row) else { continue };
        if roots.get(&col) != Some(&root) && pairs.contains_key(&(row, col)) {
            let held = best.entry((root, col)).or_insert((0.0, row));
            if v.abs() > held.0 {
                *held = (v.abs(), row);
            }
        }
    }
    pairs.retain(|&(row, _), _| roots.get(&row) != Some(&row));
    pairs.extend(best.into_iter().map(|(place, (_, from))| (place, from)));
}

/// What entries of one column do not cancel to in each set of rows: set, column, sum of the magnitudes that are left.
fn left<'a>(
    entries: impl Iterator<Item = &'a (usize, usize, f64)>,
    set: &mut Groups,
) -> impl Iterator<Item = (usize, usize, f64)> {
    let mut sums: BTreeMap<(usize, usize), Vec<f64>> = BTreeMap::new();
    for &(row, col, v) in entries {
        sums.entry((set.of(row), col)).or_default().push(v);
    }
    sums.into_iter().filter_map(|((of, col), mut parts)| {
        cancel(&mut parts);
        (!parts.is_empty()).then(|| (of, col, parts.iter().map(|v| v.abs()).sum()))
    })
}

/// The sets of rows in which terms of expressions do not cancel.
fn with_terms_left<'a>(
    g: &Graph,
    rows: impl Iterator<Item = (&'a usize, &'a Id)>,
    set: &mut Groups,
) -> impl Iterator<Item = usize> {
    let mut terms: BTreeMap<usize, BTreeMap<Id, i32>> = BTreeMap::new();
    for (&row, &e) in rows {
        add_terms(g, e, terms.entry(set.of(row)).or_default());
    }
    terms.into_iter().filter(|(_, terms)| terms.values().any(|&count| count != 0)).map(|(of, _)| of)
}

/// Leaves out numbers that are each other's opposites.
fn cancel(parts: &mut Vec<f64>) {
    let mut k = 0;
    while k < parts.len() {
        match (k + 1..parts.len()).find(|&j| parts[j] == -parts[k]) {
            Some(j) => {
                parts.swap_remove(j);
                parts.swap_remove(k);
            }
            None if parts[k] == 0.0 => {
                parts.swap_remove(k);
            }
            None => k += 1,
        }
    }
}

/// Adds the terms of a sum, each with how often it stands in it.
fn add_terms(g: &Graph, e: Id, terms: &mut BTreeMap<Id, i32>) {
    let mut open = vec![(e, 1)];
    while let Some((id, count)) = open.pop() {
        match g.node(id) {
            Node::Add(a, b) => open.extend([(a, count), (b, count)]),
            Node::Sub(a, b) => open.extend([(a, count), (b, -count)]),
            Node::Neg(a) => open.push((a, -count)),
            _ if g.value(id) == Some(0.0) => {}
            _ => *terms.entry(id).or_default() += count,
        }
    }
}
