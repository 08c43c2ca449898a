//! How the equations are brought into an order in which one stage of an explicit method can solve them.
//!
//! Unknowns of a stage: x, and of their rates z = dx/dt those that something asks for. Equations:
//!
//!   Q_i(x, t) - y_i = 0          differential rows, y being the state
//!   F_i(x, t) = 0                algebraic rows
//!   d/dt F_k = 0                 rows of multipliers: the velocity constraint, differentiated (mu = 0, its row is dropped)
//!   d/dt w = 0 or f + s F = 0    rows of laws with modes, as their flags choose
//!   d/dt Q_k + F_k = 0           rows of derivatives that are shown or read
//!   d/dt Q_i + F_i = 0, d/dt F_i = 0    for z where it is asked for
//!
//! A maximum matching gives every unknown its equation, strong components of what reads what give the blocks, in order.
//! A block of one with a constant coefficient is no block: its solution is substituted. Where the matching leaves an
//! unknown over, the equations have a higher index: only the derivative of a state would give it.
//!
//! Capacitors that float between nodes leave one combination of their rows without charge: the sum over such a group is
//! algebraic and takes the place of one of its rows.
use super::order::{augment, strong_components};
use super::whole::Whole;
use super::{Reduced, Step};
use crate::derive::tangent;
use crate::devices::Class;
use crate::graph::{Graph, Id, Node};
use crate::model::{Form, Kind, LawSpec, Unknown};
use crate::tape::Tape;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// What a system hands over.
pub struct Source<'a> {
    pub unknowns: &'a [Unknown],
    pub f: Vec<(usize, Id)>,
    pub q: Vec<(usize, Id)>,
    pub g: Vec<(usize, usize, f64)>,
    pub c: Vec<(usize, usize, f64)>,
    pub f_wave: &'a [(usize, usize, f64)],
    pub classes: Vec<Arc<dyn Class>>,
    pub waves: usize,
    pub flags: usize,
    pub laws: &'a [LawSpec],
}

/// Numbers of the leaves: x, z, gmin, y, changes of y.
/// Behind y is room for whole vectors of four.
#[derive(Clone, Copy)]
pub struct Layout {
    pub n: usize,
    pub states: usize,
}

impl Layout {
    pub fn z(&self, j: usize) -> usize {
        self.n + j
    }
    pub fn gmin(&self) -> usize {
        2 * self.n
    }
    pub fn y(&self, s: usize) -> usize {
        2 * self.n + 1 + s
    }
    /// States, to the next four.
    pub fn width(&self) -> usize {
        self.states.next_multiple_of(4).max(4)
    }
    pub fn change(&self, s: usize) -> usize {
        self.y(self.width()) + s
    }
    pub fn leaves(&self) -> usize {
        self.change(self.states)
    }
}

/// 0 = expr determines the leaf `unknown`; `state`: y_s stands in it; `row` of the system it stems from.
pub(super) struct Equation {
    pub expr: Id,
    pub unknown: usize,
    pub state: Option<usize>,
    pub row: usize,
}

pub(super) struct Plan<'a> {
    pub g: &'a mut Graph,
    pub source: &'a Source<'a>,
    pub at: Layout,
    pub f: Vec<Id>,
    pub q: Vec<Option<Id>>,
    pub sums: Vec<(usize, Vec<usize>)>,
    pub equations: Vec<Equation>,
    pub owner: HashMap<usize, usize>,
    pub image: HashMap<Id, Id>,
    pub parts: Vec<(Vec<Id>, bool)>,
    pub steps: Vec<Step>,
    pub direct: Vec<(usize, usize, f64)>,
    /// what direct steps solve for, as expressions of the state
    pub known: Vec<(Id, Id)>,
    pub f_part: usize,
    pub whole: Option<Whole>,
}

pub(super) fn compile(g: &mut Graph, source: &Source) -> Result<Reduced, String> {
    let n = source.unknowns.len();
    let at = Layout { n, states: 0 };
    let plan = Plan {
        g,
        source,
        at,
        f: Vec::new(),
        q: Vec::new(),
        sums: Vec::new(),
        equations: Vec::new(),
        owner: HashMap::new(),
        image: HashMap::new(),
        parts: Vec::new(),
        steps: Vec::new(),
        direct: Vec::new(),
        known: Vec::new(),
        f_part: 0,
        whole: None,
    };
    plan.run()
}

impl Plan<'_> {
    fn run(mut self) -> Result<Reduced, String> {
        let n = self.at.n;
        let kind = |i: usize| self.source.unknowns[i].kind;
        let states = self.rows();
        let own: Vec<usize> = (0..n)
            .filter(|&i| match kind(i) {
                Kind::Mu | Kind::Lambda => false,
                Kind::Derivative => self.q[i].is_none(),
                _ => true,
            })
            .collect();
        let place: HashMap<usize, usize> = states.iter().enumerate().map(|(s, &row)| (row, s)).collect();
        let mut own_equations = Vec::with_capacity(own.len());
        for &row in &own {
            let (expr, state) = match place.get(&row) {
                Some(&s) => {
                    let y = self.leaf(self.at.y(s));
                    let q = self.q[row].unwrap_or(y);
                    (self.g.sub(q, y), Some(s))
                }
                None => (self.f[row], None),
            };
            own_equations.push(Equation { expr, unknown: usize::MAX, state, row });
        }
        self.equations = own_equations;
        self.match_own(&own)?;
        self.rates_and_multipliers(&own)?;

        // strong components, those that the rates of the states need first
        let mut roots: Vec<usize> = Vec::new();
        for &row in &states {
            roots.extend(self.leaves(&[self.f[row]]));
        }
        // (loops are closed in every unknown that they hold, even one that moves nothing else)
        for row in (0..n).filter(|&i| matches!(kind(i), Kind::Lambda | Kind::Mu)) {
            roots.extend(self.leaves(&[self.f[row]]));
        }
        let (components, stage) = self.components(&roots);
        let mut stage_steps = 0;
        for (k, component) in components.iter().enumerate() {
            if k == stage {
                stage_steps = self.stage_end(&states);
            }
            self.block(component)?;
        }
        if stage == components.len() {
            stage_steps = self.stage_end(&states);
        }
        // every unknown, for whoever looks at a point
        let xs: Vec<Id> = (0..n).map(|j| self.leaf(j)).collect();
        let xs: Vec<Id> = xs.into_iter().map(|x| self.image(x)).collect();
        self.parts.push((xs, true));
        let rates = self.parts[self.f_part].0.clone();
        self.whole_arrival(&rates, &self.parts[self.parts.len() - 1].0.clone());
        let parts: Vec<(&[Id], bool)> = self.parts.iter().map(|(ids, kept)| (ids.as_slice(), *kept)).collect();
        let tape = Tape::in_parts(self.g, &parts).native();
        for step in &mut self.steps {
            if let Step::Saddle(saddle) = step {
                saddle.quick = saddle.quick(&tape);
            }
        }
        if tape.has_free_symbols() {
            return Err("an expression holds a symbol without a value".into());
        }
        Ok(Reduced {
            at: self.at,
            waves: self.source.waves,
            wave_rates: tape.reads_waves_from(self.source.waves),
            x_part: self.parts.len() - 1,
            f_part: self.f_part,
            whole: self.whole,
            tape,
            states,
            sums: self.sums,
            steps: self.steps,
            stage_steps,
            direct: self.direct,
            classes: self.source.classes.clone(),
        })
    }

    pub fn leaf(&mut self, index: usize) -> Id {
        self.g.unknown(index as u32)
    }

    /// Leaves (numbers) that expressions read.
    pub fn leaves(&self, ids: &[Id]) -> Vec<usize> {
        let mut seen: HashSet<Id> = HashSet::new();
        let mut stack = ids.to_vec();
        let mut out = Vec::new();
        while let Some(id) = stack.pop() {
            if !seen.insert(id) {
                continue;
            }
            match self.g.node(id) {
                Node::Unknown(i) => out.push(i as usize),
                node => stack.extend(node.operands()),
            }
        }
        out.sort_unstable();
        out
    }

    /// `id` with everything substituted that has been solved already.
    pub fn image(&mut self, id: Id) -> Id {
        let mut todo = vec![id];
        while let Some(&top) = todo.last() {
            if self.image.contains_key(&top) {
                todo.pop();
                continue;
            }
            let node = self.g.node(top);
            let missing: Vec<Id> = node.operands().filter(|o| !self.image.contains_key(o)).collect();
            if !missing.is_empty() {
                todo.extend(missing);
                continue;
            }
            let mut operands = [0; 3];
            let mut changed = false;
            for (k, o) in node.operands().enumerate() {
                operands[k] = self.image[&o];
                changed |= operands[k] != o;
            }
            let new = if changed { self.g.rebuild(node, operands) } else { top };
            self.image.insert(top, new);
            todo.pop();
        }
        self.image[&id]
    }

    /// Every unknown of `own` gets its equation, or the reason why it has none.
    fn match_own(&mut self, own: &[usize]) -> Result<(), String> {
        let n = self.at.n;
        let mut wanted = vec![false; n];
        own.iter().for_each(|&i| wanted[i] = true);
        let reads: Vec<Vec<usize>> = (self.equations.iter())
            .map(|e| self.leaves(&[e.expr]).into_iter().filter(|&l| l < n && wanted[l]).collect())
            .collect();
        let mut by: Vec<Option<usize>> = vec![None; n];
        let mut of: Vec<Option<usize>> = vec![None; reads.len()];
        for (e, list) in reads.iter().enumerate() {
            let row = self.equations[e].row;
            if list.contains(&row) && by[row].is_none() {
                (by[row], of[e]) = (Some(e), Some(row));
            }
        }
        for e in 0..reads.len() {
            if of[e].is_none() {
                augment(e, &|e| reads[e].clone(), &mut by, &mut of);
            }
        }
        let left: Vec<usize> = own.iter().copied().filter(|&i| by[i].is_none()).collect();
        if !left.is_empty() {
            return Err(self.higher_index(&left));
        }
        for (e, unknown) in of.into_iter().enumerate() {
            self.equations[e].unknown = unknown.unwrap_or(usize::MAX);
            self.owner.insert(self.equations[e].unknown, e);
        }
        Ok(())
    }

    /// In words: what stands over, and what makes it so.
    fn higher_index(&self, left: &[usize]) -> String {
        let names = |kind: Kind| -> Vec<String> {
            let of = left.iter().filter(|&&i| self.source.unknowns[i].kind == kind);
            of.take(3).map(|&i| format!("`{}`", self.source.unknowns[i].name)).collect()
        };
        let (branches, nodes, speeds) = (names(Kind::Branch), names(Kind::Node), names(Kind::Speed));
        if !branches.is_empty() {
            return format!(
                "only the derivative of a charge gives the current of {}: capacitors and voltage sources form a loop there \
                 (index 2)",
                branches.join(", ")
            );
        }
        if !nodes.is_empty() {
            return format!(
                "nothing gives the voltage at {} directly: only inductors and current sources meet there, or what conducts \
                 there cancels (index 2)",
                nodes.join(", ")
            );
        }
        if !speeds.is_empty() {
            return format!(
                "{} moves without mass or inertia: its momentum says nothing of its speed",
                speeds.join(", ")
            );
        }
        let all: Vec<String> = left.iter().take(3).map(|&i| format!("`{}`", self.source.unknowns[i].name)).collect();
        format!("no equation of a stage gives {} (index 2)", all.join(", "))
    }

    /// Equations of multipliers, of shown derivatives, and of the rates that they read.
    fn rates_and_multipliers(&mut self, own: &[usize]) -> Result<(), String> {
        let n = self.at.n;
        let kind = |i: usize| self.source.unknowns[i].kind;
        let lambdas: Vec<usize> = (0..n).filter(|&i| kind(i) == Kind::Lambda).collect();
        let shown: Vec<usize> = (0..n).filter(|&i| kind(i) == Kind::Derivative && self.q[i].is_some()).collect();
        if lambdas.is_empty() && shown.is_empty() {
            return Ok(());
        }
        let one = self.g.constant(1.0);
        let mut seed: Vec<(Id, Id)> = Vec::new();
        for &j in own {
            seed.push((self.leaf(j), self.leaf(self.at.z(j))));
        }
        seed.push((self.g.time(), one));
        for k in 0..self.source.waves as u32 {
            seed.push((self.g.wave(k), self.g.wave(k + self.source.waves as u32)));
        }
        // multipliers and derivatives have no rates here
        let forbidden: HashSet<usize> = lambdas.iter().chain(&shown).copied().collect();
        let checked = |plan: &mut Self, id: Id, row: usize| -> Result<Id, String> {
            let bad = plan.leaves(&[id]).into_iter().find(|l| forbidden.contains(l));
            if let Some(bad) = bad {
                let name = |i: usize| plan.source.unknowns[i].name.clone();
                return Err(format!("the equation of `{}` asks for the derivative of `{}`", name(row), name(bad)));
            }
            Ok(tangent(plan.g, &[id], &seed)[0])
        };
        let row_equation: HashMap<usize, usize> =
            self.equations.iter().map(|e| e.unknown).zip(0..self.equations.len()).collect();
        let mut fresh: Vec<Id> = Vec::new();
        let constraints = self.equations.len()..self.equations.len() + lambdas.len();
        for &k in &lambdas {
            let law = self.source.laws.iter().find(|law| law.row == k);
            let expr = match law {
                Some(law) => {
                    let still = checked(self, law.flow, k)?;
                    self.law_row(law, still)
                }
                None => checked(self, self.f[k], k)?,
            };
            fresh.push(expr);
            self.equations.push(Equation { expr, unknown: usize::MAX, state: None, row: k });
        }
        for &k in &shown {
            let q = self.q[k].unwrap_or(0);
            let rate = checked(self, q, k)?;
            let expr = self.g.add(rate, self.f[k]);
            fresh.push(expr);
            self.owner.insert(k, self.equations.len());
            self.equations.push(Equation { expr, unknown: k, state: None, row: k });
        }
        // rates that are read, and those that their equations read
        let first = self.equations.len();
        let mut asked: HashSet<usize> = HashSet::new();
        while !fresh.is_empty() {
            let leaves = self.leaves(&fresh);
            fresh.clear();
            for leaf in leaves {
                if leaf < n || leaf >= 2 * n || !asked.insert(leaf) {
                    continue;
                }
                let Some(&e) = row_equation.get(&(leaf - n)) else { continue };
                let (row, state) = (self.equations[e].row, self.equations[e].state);
                let expr = if state.is_some() {
                    let rate = checked(self, self.q[row].unwrap_or(0), row)?;
                    self.g.add(rate, self.f[row])
                } else {
                    checked(self, self.f[row], row)?
                };
                fresh.push(expr);
                self.owner.insert(leaf, self.equations.len());
                self.equations.push(Equation { expr, unknown: leaf, state: None, row });
            }
        }
        self.reach_multipliers(&lambdas, constraints, first)
    }

    /// Constraints push against the momenta: each multiplier is reached through one of them. `first`: the equations of rates begin there.
    fn reach_multipliers(
        &mut self,
        lambdas: &[usize],
        mut constraints: std::ops::Range<usize>,
        first: usize,
    ) -> Result<(), String> {
        let n = self.at.n;
        let mut by: Vec<Option<usize>> = vec![None; self.at.leaves()];
        let mut of: Vec<Option<usize>> = vec![None; self.equations.len()];
        for e in first..self.equations.len() {
            let unknown = self.equations[e].unknown;
            (by[unknown], of[e]) = (Some(e), Some(unknown));
        }
        let reached = |l: &usize| lambdas.contains(l) || (*l >= n && *l < 2 * n);
        let reads: Vec<Vec<usize>> =
            self.equations.iter().map(|e| self.leaves(&[e.expr]).into_iter().filter(reached).collect()).collect();
        if let Some(e) = constraints.find(|&e| !augment(e, &|e| reads[e].clone(), &mut by, &mut of)) {
            let name = &self.source.unknowns[self.equations[e].row].name;
            return Err(format!("nothing that has inertia gives way to the constraint of `{name}`"));
        }
        for (e, unknown) in of.into_iter().enumerate() {
            if let Some(unknown) = unknown {
                self.equations[e].unknown = unknown;
                self.owner.insert(unknown, e);
            }
        }
        Ok(())
    }

    /// The row of a law, with the rate of its flow in the flow's place.
    fn law_row(&mut self, law: &LawSpec, still: Id) -> Id {
        let (effort, chosen) = (self.leaf(law.row), self.g.flag(law.flags[0] as u32));
        if law.form != Form::Relay {
            return self.g.select(chosen, still, effort);
        }
        let mode = self.g.flag(law.flags[2] as u32);
        let most = self.g.select(mode, law.bound, law.stick);
        let bound = self.g.mul(law.way, most);
        let slides = self.g.add(effort, bound);
        self.g.select(chosen, slides, still)
    }

    /// Strong components of "reads", each after those it reads; the first `stage` of them are what `roots` need.
    fn components(&self, roots: &[usize]) -> (Vec<Vec<usize>>, usize) {
        let count = self.equations.len();
        let node_of = |leaf: usize| self.owner.get(&leaf).copied();
        let reads = |e: &Equation| {
            let mut leaves = self.leaves(&[e.expr]);
            // Constraints stay with what pushes for them: where they alone give the accelerations (everything is driven) they
            // would be a block without multipliers, and nobody would hold positions and speeds to them.
            if self.source.unknowns[e.row].kind == Kind::Lambda {
                leaves.push(e.row);
            }
            leaves.into_iter().filter_map(node_of).collect()
        };
        let next: Vec<Vec<usize>> = self.equations.iter().map(reads).collect();
        let mut order = strong_components(&next, &roots.iter().filter_map(|&l| node_of(l)).collect::<Vec<_>>());
        let stage = order.len();
        let done: HashSet<usize> = order.iter().flatten().copied().collect();
        let rest: Vec<usize> = (0..count).filter(|v| !done.contains(v)).collect();
        let all = strong_components(&next, &rest);
        order.extend(all.into_iter().filter(|c| !c.iter().any(|v| done.contains(v))));
        (order, stage)
    }

    /// The part that ends a stage, and those that look at the constraints.
    fn stage_end(&mut self, states: &[usize]) -> usize {
        let mut rates = Vec::with_capacity(states.len());
        for &row in states {
            let f = self.image(self.f[row]);
            rates.push(self.g.neg(f));
        }
        self.whole_stage(&rates);
        self.f_part = self.parts.len();
        // private: what it computes does not hold where a point is only solved for
        self.parts.push((rates, false));
        let steps = self.steps.len();
        for k in 0..steps {
            let part = self.parts.len();
            let Step::Direct(direct) = &mut self.steps[k] else { continue };
            direct.changes_part = part;
            self.parts.push((direct.changes.clone(), false));
        }
        // saddles look at h and dh/dt when they project
        for k in 0..steps {
            let Step::Saddle(saddle) = &self.steps[k] else { continue };
            let (rows, carried, turning) = (saddle.rows.clone(), saddle.carried_ids.clone(), saddle.turning);
            let none = self.g.constant(0.0);
            let gaps: Vec<Id> = rows.iter().map(|&row| self.closure(row).map_or(none, |h| self.image(h))).collect();
            let drifts: Vec<Id> = rows.iter().map(|&row| self.image(self.f[row])).collect();
            let part = self.parts.len();
            self.parts.push((drifts, false));
            if turning {
                let carried = carried.into_iter().map(|id| self.image(id)).collect();
                self.parts.push((carried, false));
            }
            let gaps = Tape::new(self.g, &gaps).native();
            if let Step::Saddle(saddle) = &mut self.steps[k] {
                (saddle.drift_part, saddle.carried_part, saddle.gaps) = (part, part + 1, gaps);
            }
        }
        steps
    }
}
