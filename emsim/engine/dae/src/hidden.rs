//! Constraints between states alone, and what they hide: the index of the equations is lowered by them before a run.
//!
//! Where a loop holds nothing but capacitors and voltage sources, or a cutset nothing but coils and current sources, combinations of
//! algebraic rows bind what stands under d/dt and nothing else. With constant coefficients
//!
//!   sum_j m_j (G x + B u)_j = 0,      sum_j m_j G_j = - sum_i z_i C_i                                           (1)
//!
//! for a combination z of the rows that store. Its derivative is the sum of those rows without any derivative of a state,
//!
//!   sum_i z_i F_i + sum_j m_j B_j du/dt = 0                                                                   (2)
//!
//! and (2) takes the place of one of the rows i. Nothing else changes: the solutions are the same, the index is one less, and with the
//! sources' slopes (`Wave::slope`), which are known exactly, currents and voltages that follow from them jump where the sources bend,
//! whatever the method. (Hairer and Wanner 1996, section VII.2: index reduction by differentiation.)
//!
//! The rows of nodes that only capacitors tie together store nothing in their sum, which is such a constraint and takes the place of
//! one of them, where it is not long: what a source drives into them follows from voltages then, not from a change of charges.
//!
//! A constraint that reads a slope already is not differentiated again: slopes jump. One that reads a source which jumps is left as
//! it is, for what it hides is an impulse there, and one that holds expressions that are not linear: no row here is an approximation.
use crate::graph::Graph;
use crate::model::{linear_form, Kind, Model};
use std::collections::{BTreeMap, BTreeSet};

/// Looking for constraints takes no more operations than so many for each entry, as factorising the equations a few times does: what
/// wants more (a large mesh of resistors) is integrated as it is.
const WORK: usize = 50;
/// ... and these, for small circuits.
const LEAST_WORK: usize = 20_000;
/// A row that adds up more rows than this would fill the matrices of every step.
const LONGEST: usize = 64;

/// A coefficient, and the largest that it was added up from.
#[derive(Clone, Copy, Default)]
struct Term {
    v: f64,
    size: f64,
}

type Terms = BTreeMap<usize, Term>;

impl Term {
    fn new(v: f64) -> Term {
        Term { v, size: v.abs() }
    }
}

/// mine += factor theirs
fn add(mine: &mut Terms, factor: f64, theirs: impl Iterator<Item = (usize, Term)>) {
    for (k, t) in theirs {
        let e = mine.entry(k).or_default();
        e.v += factor * t.v;
        e.size = e.size.max((factor * t.size).abs());
        // entries that cancel to this part of what they are added up from are none
        if e.v.abs() <= 1e-13 * e.size {
            mine.remove(&k);
        }
    }
}

/// A combination of rows: what it has of each unknown, and of which rows it is made.
#[derive(Clone, Default)]
struct Line {
    x: Terms,
    of: Terms,
}

impl Line {
    fn new(row: usize, entries: &BTreeMap<usize, f64>) -> Line {
        let x = entries.iter().map(|(&k, &v)| (k, Term::new(v))).collect();
        Line { x, of: BTreeMap::from([(row, Term::new(1.0))]) }
    }

    /// Takes away so much of another one that nothing of this unknown is left; how many entries that touched.
    fn eliminate(&mut self, column: usize, by: &Line) -> usize {
        let factor = -self.x[&column].v / by.x[&column].v;
        add(&mut self.x, factor, by.x.iter().map(|(&k, &t)| (k, t)));
        add(&mut self.of, factor, by.of.iter().map(|(&k, &t)| (k, t)));
        self.x.remove(&column);
        by.x.len() + by.of.len()
    }
}

/// A row that the sum of rows replaces: the others of them, and the rows whose sources' slopes stand in it.
pub struct Relation {
    pub row: usize,
    pub others: Vec<(usize, f64)>,
    pub slopes: Vec<(usize, f64)>,
}

/// The model with its hidden constraints in the place of rows that store, and which took whose; None where it has none.
pub fn lowered(model: &Model, g: &mut Graph) -> Option<(Model, Vec<Relation>)> {
    let mut made: Option<(Model, Vec<Relation>)> = None;
    loop {
        let rows = Rows::new(made.as_ref().map_or(model, |m| &m.0), g, Bends::Once);
        let found = rows.relations();
        if found.is_empty() {
            return made;
        }
        let (into, relations) = made.get_or_insert_with(|| (model.twin(), Vec::new()));
        for relation in &found {
            let of_row = |&(j, m): &(usize, f64)| rows.sources[j].iter().map(move |&(k, b)| (k, m * b));
            into.replace(g, relation, relation.slopes.iter().flat_map(of_row));
        }
        relations.extend(found);
    }
}

/// Of a model with its hidden constraints put in: what follows from the slope of a slope. That is a constraint between states that reads
/// slopes: where a source bends it asks for an impulse, which no row shows. The branch of the coil or of the capacitor's loop.
pub fn twice_bent(made: &Model, g: &Graph) -> Option<usize> {
    let rows = Rows::new(made, g, Bends::Twice);
    let bends = |relation: &Relation| {
        let mut sum = Terms::new();
        for &(j, m) in &relation.slopes {
            let slopes = rows.sources[j].iter().filter(|(k, _)| made.slopes.iter().any(|s| s.1 == *k));
            add(&mut sum, m, slopes.map(|&(k, b)| (k, Term::new(b))));
        }
        !sum.is_empty()
    };
    let found = rows.relations().into_iter().filter(|r| r.slopes.iter().all(|s| s.0 < rows.g.len())).find(bends)?;
    let carries = rows.g[found.row].keys().find(|&&k| rows.coil[k] && !rows.stores[k]);
    Some(carries.filter(|_| !rows.coil[found.row]).copied().unwrap_or(found.row))
}

/// Which sources constraints may read: those that have a slope, or slopes too.
#[derive(Clone, Copy, PartialEq)]
enum Bends {
    Once,
    Twice,
}

/// The rows of a model, as far as they are linear.
struct Rows {
    g: Vec<BTreeMap<usize, f64>>,
    c: Vec<BTreeMap<usize, f64>>,
    sources: Vec<Vec<(usize, f64)>>, // those whose slopes count
    constraint: Vec<bool>,           // algebraic, linear, of sources that do not jump
    plain: Vec<bool>,                // linear but for what it stores, of sources that do not jump
    stores: Vec<bool>,               // what they store is linear
    devices: Vec<bool>,              // devices drive currents into them
    shown: Vec<bool>,                // derivatives
    coil: Vec<bool>,                 // of branches: fluxes, not charges
    budget: usize,
}

impl Rows {
    fn new(model: &Model, graph: &Graph, bends: Bends) -> Rows {
        let n = model.unknowns.len();
        let by_row = |entries: &[(usize, usize, f64)]| {
            let mut rows = vec![BTreeMap::new(); n];
            for &(r, c, v) in entries {
                *rows[r].entry(c).or_default() += v;
            }
            rows.iter_mut().for_each(|row: &mut BTreeMap<usize, f64>| row.retain(|_, v| *v != 0.0));
            rows
        };
        let (mut g, mut c) = (by_row(&model.g), by_row(&model.c));
        let mut sources = vec![Vec::new(); n];
        model.f_wave.iter().for_each(|&(r, k, v)| sources[r].push((k, v)));
        let kind = |i: usize| model.unknowns[i].kind;
        let electrical = |i: usize| matches!(kind(i), Kind::Node | Kind::Branch);
        let (mut devices, mut charged) = (vec![false; n], vec![false; n]);
        for (&r, &e) in &model.q {
            match linear_form(graph, e, true).filter(|[_, waves]| waves.is_empty()) {
                Some([unknowns, _]) => unknowns.into_iter().for_each(|(k, v)| *c[r].entry(k).or_default() += v),
                None => charged[r] = true,
            }
        }
        for (class, k) in model.classes.iter().flat_map(|c| (0..c.seats().len()).map(move |k| (c, k))) {
            for (j, rows) in class.seats()[k].rows.iter().enumerate() {
                for row in rows.iter().filter_map(|&r| usize::try_from(r).ok()) {
                    devices[row] = true;
                    charged[row] |= class.shape(k).stores(j);
                }
            }
        }
        let stores: Vec<bool> =
            (0..n).map(|r| !c[r].is_empty() && !charged[r] && (electrical(r) || kind(r) == Kind::Derivative)).collect();
        let mut plain: Vec<bool> = (0..n).map(|r| !charged[r] && !devices[r] && electrical(r)).collect();
        model.responses.iter().for_each(|r| plain[r.row] = false);
        for (&r, &e) in &model.f {
            match plain[r].then(|| linear_form(graph, e, true)).flatten() {
                Some([unknowns, waves]) => {
                    unknowns.into_iter().for_each(|(k, v)| *g[r].entry(k).or_default() += v);
                    g[r].retain(|_, v| *v != 0.0);
                    sources[r].extend(waves);
                }
                None => plain[r] = false,
            }
        }
        for r in 0..n {
            sources[r].retain(|&(k, v)| v != 0.0 && !model.waves[k].still());
            let known = |k: usize| {
                model.waves[k].slope().is_some() || bends == Bends::Twice && model.slopes.iter().any(|s| s.1 == k)
            };
            plain[r] &= sources[r].iter().all(|&(k, _)| known(k));
        }
        let constraint = (0..n).map(|r| plain[r] && c[r].is_empty()).collect();
        let entries: usize = g.iter().chain(&c).map(BTreeMap::len).sum();
        let [shown, coil] = [Kind::Derivative, Kind::Branch].map(|of| (0..n).map(|r| kind(r) == of).collect());
        Rows { g, c, sources, constraint, plain, stores, devices, shown, coil, budget: WORK * entries + LEAST_WORK }
    }

    fn relations(&self) -> Vec<Relation> {
        let storing = |r: &usize| self.stores[*r];
        let states: BTreeSet<usize> =
            (0..self.c.len()).filter(storing).flat_map(|r| self.c[r].keys().copied()).collect();
        if states.is_empty() {
            return Vec::new();
        }
        let n = self.g.len();
        let bound = (0..n).filter(|&r| self.constraint[r] && !self.g[r].is_empty());
        let mut lines: Vec<Line> = bound.map(|r| Line::new(r, &self.g[r])).collect();
        let sums = self.sums();
        for (k, sum) in sums.iter().enumerate() {
            let mut line = Line::new(n + k, &BTreeMap::new());
            sum.iter().for_each(|&(r, z)| add(&mut line.x, z, self.g[r].iter().map(|(&k, &v)| (k, Term::new(v)))));
            lines.push(line);
        }
        let constraints = self.between_states(lines, &states);
        let mut basis = Basis::default();
        let bound: Vec<usize> = constraints.iter().flat_map(|line| line.x.keys().copied()).collect();
        for mut line in constraints {
            basis.reduce(&mut line);
            basis.insert(line);
        }
        // small ones follow from large ones with coefficients below one; what is only shown, and what devices drive, from the others; and
        // where a cutset reads voltages, its coils' currents follow from those of capacitors, which it does not hold
        let size = |r: usize| self.c[r].values().fold(0.0_f64, |m, v| m.max(v.abs()));
        let last = |r: usize| self.shown[r] || self.devices[r];
        let mut rows: Vec<usize> = self.tied_to(bound);
        rows.sort_by(|&a, &b| (last(a), self.coil[a]).cmp(&(last(b), self.coil[b])).then(size(b).total_cmp(&size(a))));
        let mut found = Vec::new();
        for r in rows {
            let mut line = Line::new(r, &self.c[r]);
            basis.reduce(&mut line);
            if basis.work > self.budget {
                break;
            }
            if !line.x.is_empty() {
                // (what devices drive into a row stands in no other)
                if !self.devices[r] {
                    basis.insert(line);
                }
                continue;
            }
            let part = |which: &dyn Fn(usize) -> bool| -> Vec<(usize, f64)> {
                line.of.iter().filter(|(&k, _)| k != r && which(k)).map(|(&k, t)| (k, t.v)).collect()
            };
            let slopes = part(&|k| k >= n || self.constraint[k]);
            let others = part(&|k| k < n && !self.constraint[k]);
            // (without a constraint in it, rows store the same)
            if !slopes.is_empty() && others.len() < LONGEST {
                found.push(Relation { row: r, others, slopes });
            }
        }
        // sums of rows that store are rows first
        if found.is_empty() || found.iter().flat_map(|r| &r.slopes).any(|s| s.0 >= n) {
            let row = |sum: &Vec<(usize, f64)>| {
                let ((row, _), others) = sum.split_last()?;
                Some(Relation { row: *row, others: others.to_vec(), slopes: Vec::new() })
            };
            return sums.iter().filter_map(row).collect();
        }
        found
    }

    /// Combinations of rows in which nothing is stored, as of the two ends of a capacitor: what they come to is a constraint. Each ends
    /// with a row that none of the others has, with the factor 1.
    fn sums(&self) -> Vec<Vec<(usize, f64)>> {
        let (mut basis, mut found) = (Basis::default(), Vec::new());
        for r in (0..self.c.len()).filter(|&r| self.stores[r] && self.plain[r]) {
            let mut line = Line::new(r, &self.c[r]);
            basis.reduce(&mut line);
            if basis.work > self.budget {
                break;
            }
            if line.x.is_empty() && line.of.len() <= LONGEST {
                found.push(line.of.iter().filter(|(&k, _)| k != r).map(|(&k, t)| (k, t.v)).chain([(r, 1.0)]).collect());
            } else {
                basis.insert(line);
            }
        }
        found
    }

    /// Combinations of the constraints in which there is nothing but states.
    fn between_states(&self, mut lines: Vec<Line>, states: &BTreeSet<usize>) -> Vec<Line> {
        let mut holders: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new(); // lines with an unknown that is no state
        for (k, line) in lines.iter().enumerate() {
            line.x.keys().filter(|c| !states.contains(c)).for_each(|&c| {
                holders.entry(c).or_default().insert(k);
            });
        }
        // the unknown that fewest lines hold goes first: one by itself takes its line away and no more
        let mut order: BTreeSet<(usize, usize)> = holders.iter().map(|(&c, of)| (of.len(), c)).collect();
        let mut work = 0;
        while let Some((_, column)) = order.pop_first() {
            let Some(of) = holders.remove(&column) else { continue };
            let value = |k: usize| lines[k].x[&column].v.abs();
            let largest = of.iter().map(|&k| value(k)).fold(0.0, f64::max);
            // an entry of its column by which others are eliminated is no smaller, in parts of the largest
            let good = of.iter().copied().filter(|&k| value(k) >= 0.05 * largest);
            let Some(pivot) = good.min_by_key(|&k| lines[k].x.len()) else { continue };
            let by = std::mem::take(&mut lines[pivot]);
            let foreign = |c: &&usize| **c != column && !states.contains(c);
            let touched: Vec<usize> = by.x.keys().filter(foreign).copied().collect();
            for c in &touched {
                if let Some(of_c) = holders.get_mut(c) {
                    order.remove(&(of_c.len(), *c));
                    of_c.remove(&pivot);
                }
            }
            for k in of.into_iter().filter(|&k| k != pivot) {
                work += lines[k].eliminate(column, &by);
                for &c in &touched {
                    let of_c = holders.entry(c).or_default();
                    if lines[k].x.contains_key(&c) {
                        of_c.insert(k)
                    } else {
                        of_c.remove(&k)
                    };
                }
            }
            for c in touched {
                let count = holders.get(&c).map_or(0, BTreeSet::len);
                if count > 0 {
                    order.insert((count, c));
                } else {
                    holders.remove(&c);
                }
            }
            if work > self.budget {
                break;
            }
        }
        lines.retain(|line| !line.x.is_empty() && line.x.keys().all(|c| states.contains(c)));
        lines
    }

    /// Rows that store something of these unknowns, or of those that stand beside them in such rows.
    fn tied_to(&self, mut open: Vec<usize>) -> Vec<usize> {
        let mut holders: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for r in (0..self.c.len()).filter(|&r| self.stores[r]) {
            self.c[r].keys().for_each(|&c| holders.entry(c).or_default().push(r));
        }
        let mut found = BTreeSet::new();
        while let Some(column) = open.pop() {
            for r in holders.remove(&column).unwrap_or_default() {
                if found.insert(r) {
                    open.extend(self.c[r].keys());
                }
            }
        }
        found.into_iter().collect()
    }
}

/// Lines in echelon form: none has the unknown of one before it.
#[derive(Default)]
struct Basis {
    lines: Vec<(usize, Line)>,
    at: BTreeMap<usize, usize>,
    work: usize,
}

impl Basis {
    /// What of a line is none of these.
    fn reduce(&mut self, line: &mut Line) {
        while let Some(k) = line.x.keys().filter_map(|c| self.at.get(c)).min() {
            let (column, by) = &self.lines[*k];
            self.work += line.eliminate(*column, by);
        }
    }

    fn insert(&mut self, line: Line) {
        let largest = line.x.iter().max_by(|a, b| a.1.v.abs().total_cmp(&b.1.v.abs()));
        if let Some((&column, _)) = largest {
            self.at.insert(column, self.lines.len());
            self.lines.push((column, line));
        }
    }
}

impl Model {
    /// Puts a sum of rows, and slopes of sources, into the place of a row that stored.
    fn replace(&mut self, g: &mut Graph, relation: &Relation, slopes: impl Iterator<Item = (usize, f64)>) {
        let Relation { row, others, .. } = relation;
        let factor: BTreeMap<usize, f64> = others.iter().copied().chain([(*row, 1.0)]).collect();
        self.c.retain(|e| e.0 != *row);
        self.q.remove(row);
        for entries in [&mut self.g, &mut self.f_wave] {
            let mut sum = Terms::new();
            for &(r, k, v) in entries.iter() {
                if let Some(&by) = factor.get(&r) {
                    add(&mut sum, by, std::iter::once((k, Term::new(v))));
                }
            }
            entries.retain(|e| e.0 != *row);
            entries.extend(sum.into_iter().map(|(k, t)| (*row, k, t.v)));
        }
        let expressions = factor.iter().filter_map(|(r, &by)| Some((*self.f.get(r)?, by))).collect::<Vec<_>>();
        let sum = expressions.into_iter().fold(None, |sum, (e, by)| {
            let by = g.constant(by);
            let term = g.mul(by, e);
            Some(sum.map_or(term, |sum| g.add(sum, term)))
        });
        self.f.extend(sum.map(|sum| (*row, sum)));
        let mut each = BTreeMap::new();
        slopes.for_each(|(k, v)| *each.entry(k).or_insert(0.0) += v);
        for (k, v) in each.into_iter().filter(|&(_, v)| v != 0.0) {
            let slope = self.slope_of(k);
            self.f_wave.push((*row, slope, v));
        }
        self.ic_charge.retain(|&(r, _)| r != *row);
    }

    /// The wave that is the slope of another one.
    fn slope_of(&mut self, of: usize) -> usize {
        if let Some(&(_, k)) = self.slopes.iter().find(|s| s.0 == of) {
            return k;
        }
        self.waves.extend(self.waves[of].slope());
        self.slopes.push((of, self.waves.len() - 1));
        self.waves.len() - 1
    }
}
