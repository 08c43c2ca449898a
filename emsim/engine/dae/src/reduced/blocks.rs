//! A strong component of a stage's equations becomes a step, or is substituted.
use super::eliminate::eliminate;
use super::plan::Plan;
use super::{Block, Direct, Limits, Newton, Saddle, Step};
use crate::derive::{gradient, substitute, tangent};
use crate::graph::{Graph, Id, Node};
use crate::model::Kind;
use crate::tape::{Inputs, Tape};
use std::collections::HashSet;

/// Unknowns of a loop: multipliers and speeds; rows of each, with their equations.
#[derive(Default)]
struct Pairs {
    lambdas: Vec<usize>,
    speeds: Vec<usize>,
    rows: Vec<(usize, usize)>,
    momenta: Vec<(usize, usize)>,
}

impl Plan<'_> {
    /// One strong component becomes a step, or is substituted.
    pub fn block(&mut self, component: &[usize]) -> Result<(), String> {
        let mut members: Vec<usize> = component.to_vec();
        members.sort_unstable_by_key(|&e| self.equations[e].unknown);
        if self.saddle(&members)? {
            return Ok(());
        }
        // rows in the order of their unknowns where each is its own unknown's row
        let unknowns: Vec<usize> = members.iter().map(|&e| self.equations[e].unknown).collect();
        let leaves: Vec<Id> = unknowns.iter().map(|&u| self.g.unknown(u as u32)).collect();
        let mut rows: Vec<usize> = members.clone();
        rows.sort_unstable_by_key(|&e| self.equations[e].row);
        let diagonal = rows.iter().zip(&unknowns).all(|(&e, &u)| self.equations[e].row == u);
        if !diagonal {
            rows.clone_from(&members);
        }
        let size = rows.len();
        let momenta = diagonal
            && rows
                .iter()
                .zip(&unknowns)
                .all(|(&e, &u)| self.equations[e].state.is_some() && self.source.unknowns[u].kind == Kind::Speed);
        let states: Vec<Option<usize>> = rows.iter().map(|&e| self.equations[e].state).collect();
        let exprs: Vec<Id> = rows.iter().map(|&e| self.equations[e].expr).collect();
        if momenta && size > 1 && self.direct(&exprs, &unknowns, &states) {
            return Ok(());
        }
        let zero = self.g.constant(0.0);
        let mut matrix = vec![zero; size * size];
        for (i, &e) in rows.iter().enumerate() {
            let expr = self.equations[e].expr;
            for (j, d) in gradient(self.g, expr, &leaves).into_iter().enumerate() {
                matrix[i * size + j] = d;
            }
        }
        let own: HashSet<usize> = unknowns.iter().copied().collect();
        if self.leaves(&matrix).iter().any(|l| own.contains(l)) {
            return self.newton(unknowns, states, exprs, matrix);
        }
        let none: Vec<(Id, Id)> = leaves.iter().map(|&l| (l, zero)).collect();
        let rest = substitute(self.g, &exprs, &none);
        let rest: Vec<Id> = rest.into_iter().map(|r| self.image(r)).collect();
        let matrix: Vec<Id> = matrix.into_iter().map(|m| self.image(m)).collect();
        if size == 1 {
            if let Some(c) = self.g.value(matrix[0]).filter(|&c| c != 0.0) {
                let by = self.g.constant(-1.0 / c);
                let solution = self.g.mul(by, rest[0]);
                self.image.insert(leaves[0], solution);
                if let (Some(s), true) = (states[0], unknowns[0] < self.at.n) {
                    self.direct.push((unknowns[0], s, 1.0 / c));
                }
                return Ok(());
            }
            if momenta && self.direct(&exprs, &unknowns, &states) {
                return Ok(());
            }
        }
        // what was solved is a leaf from here on
        for &l in &leaves {
            self.image.insert(l, l);
        }
        let block = Block::new(self.g, self.parts.len(), unknowns, states, &matrix, momenta);
        if block.hopeless() {
            let left: Vec<usize> = block.unknowns.iter().copied().filter(|&u| u < self.at.n).collect();
            return Err(self.singular(&left));
        }
        let mut outs = rest;
        outs.extend(block.varying.iter().map(|&(_, id)| id));
        self.parts.push((outs, true));
        self.steps.push(Step::Linear(block));
        Ok(())
    }

    /// Momenta to speeds in symbols; false where a dense factorisation takes less.
    fn direct(&mut self, exprs: &[Id], unknowns: &[usize], states: &[Option<usize>]) -> bool {
        let n = unknowns.len();
        let speeds: Vec<Id> = unknowns.iter().map(|&u| self.g.unknown(u as u32)).collect();
        for &u in &speeds {
            self.image.insert(u, u);
        }
        let exprs: Vec<Id> = exprs.iter().map(|&e| self.image(e)).collect();
        let Some(solution) = eliminate(self.g, &exprs, &speeds) else { return false };
        // operations of straight-line code that one of the dense factorisation is worth
        let dense = self.g.reachable(&exprs).len() + 4 * (n * n * n / 3 + 2 * n * n);
        if self.g.reachable(&solution.speeds).len() > dense {
            return false;
        }
        // a small change of the momenta as one of the speeds
        let seed: Vec<(Id, Id)> =
            states.iter().flatten().map(|&s| (self.leaf(self.at.y(s)), self.leaf(self.at.change(s)))).collect();
        let changes = tangent(self.g, &solution.speeds, &seed);
        self.known.extend(solution.known);
        let outs = [solution.speeds, solution.pivots].concat();
        self.parts.push((outs, true));
        self.steps.push(Step::Direct(Box::new(Direct {
            part: self.parts.len() - 1,
            unknowns: unknowns.to_vec(),
            momenta: Tape::new(self.g, &exprs),
            changes,
            changes_part: usize::MAX,
        })));
        true
    }

    fn singular(&self, left: &[usize]) -> String {
        let names: Vec<String> = left.iter().take(3).map(|&i| format!("`{}`", self.source.unknowns[i].name)).collect();
        format!("charges, fluxes or momenta do not determine {} (index 2)", names.join(", "))
    }

    fn newton(
        &mut self,
        unknowns: Vec<usize>,
        states: Vec<Option<usize>>,
        exprs: Vec<Id>,
        matrix: Vec<Id>,
    ) -> Result<(), String> {
        for &u in &unknowns {
            let leaf = self.leaf(u);
            self.image.insert(leaf, leaf);
        }
        let mut outs: Vec<Id> = exprs.into_iter().map(|e| self.image(e)).collect();
        let matrix: Vec<Id> = matrix.into_iter().map(|m| self.image(m)).collect();
        let block = Block::new(self.g, self.parts.len(), unknowns, states, &matrix, false);
        outs.extend(block.varying.iter().map(|&(_, id)| id));
        // what does not hang on the iterate is computed once
        let mut moving: HashSet<Id> = HashSet::new();
        let own: HashSet<usize> = block.unknowns.iter().copied().collect();
        let mut known: HashSet<Id> = HashSet::new();
        for id in self.g.reachable(&outs) {
            let node = self.g.node(id);
            let moves = match node {
                Node::Unknown(i) => own.contains(&(i as usize)),
                _ => node.operands().any(|o| moving.contains(&o)),
            };
            if moves {
                moving.insert(id);
                known.extend(node.operands().filter(|o| !moving.contains(o)));
            }
        }
        let mut known: Vec<Id> = known.into_iter().collect();
        known.sort_unstable();
        self.parts.push((known, true));
        let limits = self.limits(&own);
        self.parts.push((outs, false));
        self.steps.push(Step::Newton(Newton { block, limits }));
        Ok(())
    }

    /// The devices whose voltages hang on these unknowns, and a part that computes the voltages.
    fn limits(&mut self, own: &HashSet<usize>) -> Limits {
        let (mut list, mut voltages) = (Vec::new(), Vec::new());
        for (n, class) in self.source.classes.iter().enumerate() {
            for (k, seat) in class.seats().iter().enumerate() {
                let v = self.voltages(seat, class.shape(k));
                let v: Vec<Id> = v.into_iter().map(|v| self.image(v)).collect();
                if self.leaves(&v).iter().any(|l| own.contains(l)) {
                    list.push((n, k));
                    voltages.extend(v);
                }
            }
        }
        self.parts.push((voltages, false));
        Limits { part: self.parts.len() - 1, list }
    }

    /// Momenta and multipliers together:  M z + s W^T lambda + c = 0,  W z + d = 0. False where the block is none such.
    fn saddle(&mut self, members: &[usize]) -> Result<bool, String> {
        let n = self.at.n;
        let Some(Pairs { lambdas, speeds, rows, momenta }) = self.pairs(members)? else { return Ok(false) };
        let (k, m) = (speeds.len(), lambdas.len());
        let leaf_of = |g: &mut Graph, list: &[usize], shift: usize| -> Vec<Id> {
            list.iter().map(|&j| g.unknown((j + shift) as u32)).collect()
        };
        let z = leaf_of(self.g, &speeds, n);
        let l = leaf_of(self.g, &lambdas, 0);
        let u = leaf_of(self.g, &speeds, 0);
        let (mut mass, mut push, mut pull) = (Vec::new(), Vec::new(), Vec::new());
        for &(row, e) in &momenta {
            mass.extend(gradient(self.g, self.q[row].unwrap_or(0), &u));
            push.extend(gradient(self.g, self.equations[e].expr, &l)); // k x m
        }
        for &(_, e) in &rows {
            pull.extend(gradient(self.g, self.equations[e].expr, &z)); // m x k
        }
        let own: HashSet<usize> = members.iter().map(|&e| self.equations[e].unknown).collect();
        for ids in [&mass, &push, &pull] {
            if self.leaves(ids).iter().any(|l| own.contains(l)) {
                return Ok(false);
            }
        }
        let transposed: Vec<Id> = (0..k * m).map(|i| push[(i % k) * m + i / k]).collect();
        if !self.opposite(&transposed, &pull) {
            return Ok(false);
        }
        let zero = self.g.constant(0.0);
        let none: Vec<(Id, Id)> = z.iter().chain(&l).map(|&v| (v, zero)).collect();
        let exprs: Vec<Id> = momenta.iter().chain(&rows).map(|&(_, e)| self.equations[e].expr).collect();
        let rest = substitute(self.g, &exprs, &none);
        let mut outs: Vec<Id> = rest.into_iter().map(|r| self.image(r)).collect();
        let mass: Vec<Id> = mass.into_iter().map(|v| self.image(v)).collect();
        let pull: Vec<Id> = pull.into_iter().map(|v| self.image(v)).collect();
        for &leaf in z.iter().chain(&l) {
            self.image.insert(leaf, leaf);
        }
        let unknowns: Vec<usize> = speeds.iter().map(|&j| j + n).collect();
        let part = self.parts.len();
        let mass = Block::new(self.g, part, unknowns, vec![None; k], &mass, true);
        outs.extend(mass.varying.iter().map(|&(_, id)| id));
        outs.extend(&pull);
        self.parts.push((outs, true));
        let (rates, carried) = self.carried(&speeds, &lambdas, &u)?;
        // are the accelerations read by anybody else?
        let members: HashSet<usize> = members.iter().copied().collect();
        let others: Vec<Id> =
            (self.equations.iter().enumerate()).filter(|(e, _)| !members.contains(e)).map(|(_, e)| e.expr).collect();
        let read = self.leaves(&others).iter().any(|l| mass.unknowns.contains(l));
        let unit = |l: usize| self.source.unknowns.get(l).map(|u| &u.unit);
        let kinds =
            (lambdas.iter()).map(|&l| lambdas.iter().position(|&other| unit(other) == unit(l)).unwrap_or(0)).collect();
        self.steps.push(Step::Saddle(Box::new(Saddle {
            rates: read,
            kinds,
            mass,
            momenta: speeds.iter().map(|&j| self.state_of(j)).collect(),
            turning: rates.iter().any(|&r| self.g.value(r).is_none()),
            constant: rates.iter().map(|&r| self.g.value(r).unwrap_or(0.0)).collect(),
            carried,
            carried_ids: rates,
            carried_part: usize::MAX,
            rows: lambdas,
            drift_part: usize::MAX,
            gaps: Tape::new(self.g, &[]),
            quick: None,
        })));
        Ok(true)
    }

    /// Multipliers and speeds with the rows that are theirs; None where others are among them.
    fn pairs(&self, members: &[usize]) -> Result<Option<Pairs>, String> {
        let n = self.at.n;
        let mut p = Pairs::default();
        for &e in members {
            let (unknown, row) = (self.equations[e].unknown, self.equations[e].row);
            match self.source.unknowns.get(unknown).map(|u| u.kind) {
                Some(Kind::Lambda) => p.lambdas.push(unknown),
                None if unknown < 2 * n && self.source.unknowns[unknown - n].kind == Kind::Speed => {
                    p.speeds.push(unknown - n);
                }
                _ => return Ok(None),
            }
            match self.source.unknowns[row].kind {
                Kind::Lambda => p.rows.push((row, e)),
                Kind::Speed => p.momenta.push((row, e)),
                _ => return Ok(None),
            }
        }
        p.lambdas.sort_unstable();
        p.speeds.sort_unstable();
        p.rows.sort_unstable();
        p.momenta.sort_unstable();
        let paired = |a: &[usize], b: &[(usize, usize)]| a.iter().eq(b.iter().map(|(row, _)| row));
        // of laws alone: a general block
        let laws = p.lambdas.iter().filter(|&&l| self.source.laws.iter().any(|law| law.row == l)).count();
        if laws > 0 && laws == p.lambdas.len() {
            return Ok(None);
        }
        if laws > 0 {
            return Err("friction acts within a closed loop".into());
        }
        let whole = !p.lambdas.is_empty() && paired(&p.lambdas, &p.rows) && paired(&p.speeds, &p.momenta);
        Ok(whole.then_some(p))
    }

    fn state_of(&self, row: usize) -> Option<usize> {
        self.equations.iter().find(|e| e.row == row && e.state.is_some()).and_then(|e| e.state)
    }

    /// Coordinates move with the speeds that their rows read,  q' = N(q) u: entries of N, and (state, speed) of each.
    fn carried(
        &mut self,
        speeds: &[usize],
        lambdas: &[usize],
        u: &[Id],
    ) -> Result<(Vec<Id>, Vec<(usize, usize)>), String> {
        let (mut rates, mut carried) = (Vec::new(), Vec::new());
        let closed: Vec<Id> = lambdas.iter().filter_map(|&l| self.closure(l)).collect();
        let closed = self.leaves(&closed);
        for c in (0..self.at.n).filter(|&c| self.source.unknowns[c].kind == Kind::Coordinate) {
            let Some(state) = self.state_of(c) else { continue };
            let slopes = gradient(self.g, self.f[c], u);
            if self.leaves(&slopes).iter().any(|l| speeds.contains(l)) {
                if closed.contains(&c) {
                    let name = &self.source.unknowns[c].name;
                    return Err(format!("`{name}` is part of a loop, and its rate is not linear in the speeds"));
                }
                continue;
            }
            for (i, slope) in slopes.into_iter().enumerate() {
                if self.g.value(slope) != Some(0.0) {
                    rates.push(self.g.neg(slope));
                    carried.push((state, i));
                }
            }
        }
        Ok((rates, carried))
    }

    /// The expression of positions whose rate the row of a multiplier holds; None of a row of speeds.
    pub fn closure(&self, lambda: usize) -> Option<Id> {
        let follows = self.source.unknowns.get(lambda + 1)?;
        (follows.kind == Kind::Mu).then(|| self.f[lambda + 1])
    }

    /// a = -b, by numbers: two ways of differentiating seldom give one and the same expression.
    fn opposite(&mut self, a: &[Id], b: &[Id]) -> bool {
        let both: Vec<Id> = a.iter().chain(b).copied().collect();
        let tape = Tape::new(self.g, &both);
        let (mut waves, mut flags) = (vec![0.3; 2 * self.source.waves], vec![0.0; self.source.flags]);
        let mut seed = 0.37_f64;
        (0..3).all(|round| {
            let mut x: Vec<f64> = Vec::with_capacity(self.at.leaves());
            for _ in 0..self.at.leaves() {
                seed = (seed * 997.0 + 0.1234567).fract();
                x.push(0.1 + 0.8 * seed);
            }
            waves.iter_mut().for_each(|w| *w = 0.2 + 0.3 * f64::from(round));
            flags.iter_mut().for_each(|f| *f = f64::from(round % 2));
            let v = tape.eval(&Inputs { x: &x, t: 0.4, waves: &waves, flags: &flags });
            let (a, b) = v.split_at(a.len());
            let size = v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            a.iter().zip(b).all(|(a, b)| (a + b).abs() <= 1e-9 * size)
        })
    }
}
