//! What follows sources at once, through resistors, controlled sources and expressions, and is so a function of time; and which sources
//! are behind what does not.
//!
//! 1. Every unknown is given a row (a maximum matching). It reads what else stands in that row; strong components of this relation are
//!    the blocks of equations that have to be solved together, and come in an order in which each reads only itself and earlier ones.
//! 2. A block follows if its rows store nothing, hold no device, read otherwise only what follows, and are linear in its own unknowns with
//!    constant coefficients A. Then  x = -A^-1 (terms of the rows without x), and what is wanted of it costs one solution with A
//!    transposed.
//! 3. What an unknown reads, by way of any number of rows, is all that can move it.
use super::phases::phases;
use crate::derive::{gradient, substitute};
use crate::edges::waves_of;
use crate::graph::{Graph, Id};
use crate::model::{Kind, Model};
use crate::reduced::{augment, strong_components};
use crate::sparse::{Lu, Pattern, Symbolic};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

type Entries = BTreeMap<(usize, usize), f64>;

/// What stands in every row, and whose equation it is.
pub struct Follow {
    linear: Vec<Vec<(usize, f64)>>,
    reads: Vec<Vec<usize>>, // unknowns in a row, of G, C, expressions and devices
    instant: Vec<bool>,     // nothing in the row is stored, nothing a device's
    waves: Vec<Vec<(usize, f64)>>,
    row_of: Vec<Option<usize>>,
    blocks: Vec<Vec<usize>>, // earlier ones first
    follows: Vec<bool>,      // by block
    block_of: Vec<usize>,
}

impl Follow {
    pub fn new(model: &Model, g: &mut Graph, constant_g: &Entries, constant_c: &Entries) -> Follow {
        let n = model.unknowns.len();
        let (mut linear, mut reads, mut waves) = (vec![Vec::new(); n], vec![BTreeSet::new(); n], vec![Vec::new(); n]);
        let mut instant = vec![true; n];
        for (&(r, c), &v) in constant_g.iter().filter(|(_, &v)| v != 0.0) {
            linear[r].push((c, v));
            reads[r].insert(c);
        }
        for (&(r, c), _) in constant_c.iter().filter(|(_, &v)| v != 0.0) {
            reads[r].insert(c);
            instant[r] = false;
        }
        for (&r, &e) in model.f.iter().chain(&model.q) {
            reads[r].extend(g.unknowns(&[e]));
        }
        model.q.keys().for_each(|&r| instant[r] = false);
        for seat in model.classes.iter().flat_map(|class| class.seats()) {
            let nodes = || seat.nodes.iter().filter_map(|&k| usize::try_from(k).ok());
            for r in seat.rows.iter().flatten().filter_map(|&r| usize::try_from(r).ok()) {
                reads[r].extend(nodes());
                instant[r] = false;
            }
        }
        model.f_wave.iter().for_each(|&(r, k, c)| waves[r].push((k, c)));
        let reads: Vec<Vec<usize>> = reads.into_iter().map(|of| of.into_iter().collect()).collect();
        let row_of = matched(&reads);
        let next: Vec<Vec<usize>> = (0..n).map(|u| row_of[u].map_or(Vec::new(), |r| reads[r].clone())).collect();
        let blocks = strong_components(&next, &(0..n).collect::<Vec<_>>());
        let mut block_of = vec![0; n];
        blocks.iter().enumerate().for_each(|(b, of)| of.iter().for_each(|&u| block_of[u] = b));
        let mut found = Follow { linear, reads, instant, waves, row_of, blocks, follows: Vec::new(), block_of };
        for b in 0..found.blocks.len() {
            let follows = found.can_follow(model, g, b);
            found.follows.push(follows);
        }
        found
    }

    /// Nodes that a source fixes, or a controlled one, by a row in which they stand alone.
    pub fn fixed<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = usize> + 'a {
        let by_source = |r: usize| model.unknowns[r].kind == Kind::Branch && self.linear[r].len() == 1;
        let node = |&u: &usize| model.unknowns[u].kind == Kind::Node;
        (0..self.row_of.len()).filter(node).filter(move |&u| self.row(u).is_some_and(by_source))
    }

    /// The row that says what an unknown is, if it follows sources.
    fn row(&self, unknown: usize) -> Option<usize> {
        self.row_of[unknown].filter(|_| self.follows[self.block_of[unknown]])
    }

    fn can_follow(&self, model: &Model, g: &mut Graph, b: usize) -> bool {
        let electrical = |k: usize| matches!(model.unknowns[k].kind, Kind::Node | Kind::Branch);
        let block = &self.blocks[b];
        block.iter().all(|&u| {
            let Some(r) = self.row_of[u] else { return false };
            let known = |&c: &usize| self.block_of[c] == b || self.follows[self.block_of[c]];
            let mut straight = || model.f.get(&r).is_none_or(|&e| self.own_slope(g, e, block).is_some());
            electrical(u) && electrical(r) && self.instant[r] && self.reads[r].iter().all(known) && straight()
        })
    }

    /// By how much an expression changes with the one unknown of its block, which it may read as one factor of flags; None where it is
    /// not so.
    fn own_slope(&self, g: &mut Graph, e: Id, block: &[usize]) -> Option<Id> {
        let read = g.unknowns(&[e]);
        if !block.iter().any(|u| read.contains(u)) {
            return Some(g.constant(0.0));
        }
        let [u] = block[..] else { return None };
        let x = g.unknown(u as u32);
        let slope = gradient(g, e, &[x])[0];
        g.unknowns(&[slope]).is_empty().then_some(slope)
    }

    /// The wanted unknowns that follow, as expressions of sources, time and flags.
    pub fn expressions(
        &self,
        model: &Model,
        g: &mut Graph,
        wanted: impl Iterator<Item = usize>,
    ) -> BTreeMap<usize, Id> {
        let mut of_block: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        wanted.filter(|&u| self.row(u).is_some()).for_each(|u| {
            of_block.entry(self.block_of[u]).or_default().insert(u);
        });
        // from the last block to the first: which rows count, with which weights, and what these read
        let mut sums: Vec<(usize, Vec<(usize, f64)>)> = Vec::new();
        while let Some((b, members)) = of_block.pop_last() {
            for (u, rows) in self.weights(b, members) {
                for &(r, _) in &rows {
                    for &c in self.reads[r].iter().filter(|&&c| self.block_of[c] != b) {
                        of_block.entry(self.block_of[c]).or_default().insert(c);
                    }
                }
                sums.push((u, rows));
            }
        }
        let mut found: BTreeMap<usize, Id> = BTreeMap::new();
        for (u, rows) in sums.into_iter().rev() {
            let block = &self.blocks[self.block_of[u]];
            let Some(e) = self.sum(model, g, block, &rows, &found) else { continue };
            found.insert(u, e);
        }
        found
    }

    /// Of each member of a block the rows of which it is a sum, with the weights -A^-T e_u.
    fn weights(&self, b: usize, members: BTreeSet<usize>) -> Vec<(usize, Vec<(usize, f64)>)> {
        let block = &self.blocks[b];
        let rows: Vec<usize> = block.iter().filter_map(|&u| self.row_of[u]).collect();
        if let ([_], [row]) = (&block[..], &rows[..]) {
            return members.into_iter().map(|u| (u, vec![(*row, -1.0)])).collect();
        }
        let place: BTreeMap<usize, usize> = block.iter().enumerate().map(|(k, &u)| (u, k)).collect();
        let entries = || {
            let of_row = |(k, &r): (usize, &usize)| {
                self.linear[r].iter().filter_map(|(c, v)| Some((k, *place.get(c)?, *v))).collect::<Vec<_>>()
            };
            rows.iter().enumerate().flat_map(of_row)
        };
        let places: Vec<(usize, usize)> = entries().map(|(r, c, _)| (r, c)).collect();
        let pattern = Pattern::from_entries(block.len(), &places);
        let mut values = vec![0.0; pattern.nnz()];
        for (r, c, v) in entries() {
            if let Some(k) = pattern.position(r, c) {
                values[k] += v;
            }
        }
        let Ok(symbolic) = Symbolic::analyse(&pattern) else { return Vec::new() };
        let mut lu: Lu<f64> = Lu::new(&symbolic);
        if lu.factor(&values).is_err() {
            return Vec::new();
        }
        let mut solved = |u: usize| {
            let mut y = vec![0.0; block.len()];
            y[place[&u]] = -1.0;
            lu.solve_transposed(&mut y);
            let counts = y.iter().zip(&rows).filter(|(&y, _)| y != 0.0);
            (u, counts.map(|(&y, &r)| (r, y)).collect())
        };
        members.into_iter().map(&mut solved).collect()
    }

    /// What the rows hold beside the block's own unknowns, by their weights; of a block of one over its own coefficient.
    fn sum(
        &self,
        model: &Model,
        g: &mut Graph,
        block: &[usize],
        rows: &[(usize, f64)],
        found: &BTreeMap<usize, Id>,
    ) -> Option<Id> {
        let zero = g.constant(0.0);
        let own: Vec<(Id, Id)> = block.iter().map(|&u| (g.unknown(u as u32), zero)).collect();
        let (mut total, mut coefficient) = (zero, g.constant(1.0));
        for &(r, weight) in rows {
            let mut row = zero;
            for &(c, v) in &self.linear[r] {
                let v = g.constant(v);
                if block.contains(&c) {
                    coefficient = v;
                    continue;
                }
                let term = g.mul(v, *found.get(&c)?);
                row = g.add(row, term);
            }
            if block.len() == 1 && !self.linear[r].iter().any(|&(c, _)| c == block[0]) {
                coefficient = zero;
            }
            for &(k, c) in &self.waves[r] {
                let (wave, c) = (g.wave(k as u32), g.constant(c));
                let term = g.mul(c, wave);
                row = g.add(row, term);
            }
            if let Some(&e) = model.f.get(&r) {
                if block.len() == 1 {
                    let slope = self.own_slope(g, e, block)?;
                    coefficient = g.add(coefficient, slope);
                }
                let map: Option<Vec<(Id, Id)>> = g
                    .unknowns(&[e])
                    .into_iter()
                    .filter(|c| !block.contains(c))
                    .map(|c| Some((g.unknown(c as u32), *found.get(&c)?)))
                    .collect();
                let map: Vec<(Id, Id)> = map?.into_iter().chain(own.iter().copied()).collect();
                let rest = substitute(g, &[e], &map)[0];
                row = g.add(row, rest);
            }
            let weight = g.constant(weight);
            let term = g.mul(weight, row);
            total = g.add(total, term);
        }
        match block.len() {
            1 if g.value(coefficient) == Some(0.0) => None,
            1 => Some(divided(g, total, coefficient)),
            _ => Some(total),
        }
    }

    /// The highest frequency at which sources or sines of time swing that can move these expressions.
    pub fn swing(&self, model: &Model, g: &Graph, expressions: &[Id]) -> f64 {
        let direct: BTreeSet<usize> = expressions.iter().flat_map(|&e| g.unknowns(&[e])).collect();
        let rows = self.behind(direct.into_iter());
        let in_rows = rows.iter().flat_map(|r| model.f.get(r).into_iter().chain(model.q.get(r))).copied();
        let read: Vec<Id> = expressions.iter().copied().chain(in_rows).collect();
        let named = rows.iter().flat_map(|&r| self.waves[r].iter().map(|&(k, _)| k));
        let waves = waves_of(g, &read).into_iter().chain(named).filter_map(|k| model.waves.get(k)?.swing());
        let sines = phases(g, &read).into_iter().map(|phase| phase.clock.abs() / TAU);
        waves.chain(sines).fold(0.0, f64::max)
    }

    /// Rows that can move these unknowns.
    pub fn behind(&self, unknowns: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut seen = vec![false; self.row_of.len()];
        let mut stack: Vec<usize> = unknowns.collect();
        let mut rows = Vec::new();
        while let Some(u) = stack.pop() {
            if std::mem::replace(&mut seen[u], true) {
                continue;
            }
            if let Some(r) = self.row_of[u] {
                rows.push(r);
                stack.extend(&self.reads[r]);
            }
        }
        rows
    }
}

/// a / b, as a product where b is a number.
fn divided(g: &mut Graph, a: Id, b: Id) -> Id {
    match g.value(b) {
        Some(v) => {
            let scale = g.constant(1.0 / v);
            g.mul(scale, a)
        }
        None => g.div(a, b),
    }
}

/// Of every unknown its row: its own where it stands in it.
fn matched(reads: &[Vec<usize>]) -> Vec<Option<usize>> {
    let n = reads.len();
    let (mut by, mut of) = (vec![None; n], vec![None; n]);
    for r in (0..n).filter(|&r| reads[r].binary_search(&r).is_ok()) {
        (by[r], of[r]) = (Some(r), Some(r));
    }
    for r in 0..n {
        if of[r].is_none() {
            augment(r, &|r| reads[r].clone(), &mut by, &mut of);
        }
    }
    by
}
