//! Values from outside by which what is shown would not be what it is where the deck states them as numbers. What follows from slopes
//! of sources does so by constraints that are differentiated (hidden.rs), which takes coefficients that are numbers and sources that
//! have slopes.
use super::{Packed, Varies};
use crate::derive::{gradient, substitute};
use crate::edges::waves_of;
use crate::graph::{Graph, Id};
use crate::hidden::{lowered, Relation};
use crate::integrate;
use crate::model::Model;
use crate::system::follow::Follow;
use crate::system::summed;
use crate::waves::Wave;
use std::collections::BTreeSet;

impl Packed {
    /// Such inputs, each with an output that shows it; None of a condition, or of what is late.
    pub fn impeding(&self) -> Result<Vec<(String, Option<String>)>, String> {
        if !integrate::lowers(&self.options.method) {
            return Ok(Vec::new());
        }
        let (mut graph, mut open) = self.model()?;
        let g = &mut graph;
        let mut stated = self.stated(&open, g)?;
        for model in [&mut stated, &mut open] {
            model.fold_linear(g);
            model.sum_floating_groups(g);
        }
        let Some((made, relations)) = lowered(&stated, g) else { return Ok(Vec::new()) };
        let kept: BTreeSet<usize> =
            lowered(&open, g).map_or(BTreeSet::new(), |(_, kept)| kept.iter().map(|r| r.row).collect());
        let jumps = |r: &&Relation| made.f_wave.iter().any(|e| e.0 == r.row && made.slopes.iter().any(|s| s.1 == e.1));
        let missed: Vec<&Relation> = relations.iter().filter(|r| !kept.contains(&r.row)).filter(jumps).collect();
        if missed.is_empty() {
            return Ok(Vec::new());
        }
        let (g_sum, c_sum) = (summed(&made.g), summed(&made.c));
        let follow = Follow::new(&made, g, &g_sum, &c_sum);
        let held = made.flags.iter().flat_map(|f| [f.up, f.down]).chain(made.delays.iter().map(|d| d.of)).collect();
        let shown = self.outputs.iter().map(|o| (Some(o.name.clone()), vec![o.id]));
        let looks: Vec<(Option<String>, BTreeSet<usize>)> = shown
            .chain([(None, held)])
            .map(|(name, of)| (name, follow.behind(g.unknowns(&of).into_iter()).into_iter().collect()))
            .collect();
        let mut found: Vec<(String, Option<String>)> = Vec::new();
        for relation in missed {
            let Some((shown, _)) = looks.iter().find(|(_, rows)| rows.contains(&relation.row)) else { continue };
            let read = read_by(&open, g, &relations, relation);
            for input in self.inputs.iter().filter(|i| read.contains(&i.wave)) {
                if !found.iter().any(|(name, _)| *name == input.name) {
                    found.push((input.name.clone(), shown.clone()));
                }
            }
        }
        Ok(found)
    }

    /// The model with numbers in the place of what comes from outside: of its factors, and of conditions that read nothing else, which
    /// a deck with numbers has not. What moves while a run goes on is a sine where it is added.
    fn stated(&self, open: &Model, g: &mut Graph) -> Result<Model, String> {
        let mut stated = open.twin();
        let mut numbers: Vec<(Id, Id)> = Vec::new();
        let mut moving: Vec<Id> = Vec::new();
        for input in &self.inputs {
            let wave = g.wave(input.wave as u32);
            numbers.push((wave, g.constant(if input.start == 0.0 { 1.0 } else { input.start })));
            stated.waves[input.wave] = if input.varies == Varies::Continuous {
                moving.push(wave);
                Wave::new("sin", &[0.0, 1.0, 1.0, 0.0, 0.0, 0.0], None)?
            } else {
                Wave::new("dc", &[input.start], None)?
            };
        }
        for (k, f) in open.flags.iter().enumerate() {
            let at = substitute(g, &[f.up, f.down], &numbers);
            let (Some(up), Some(down)) = (g.value(at[0]), g.value(at[1])) else { continue };
            let on = up > 0.0 || down >= 0.0 && f.rest > 0;
            numbers.push((g.flag(k as u32), g.constant(f64::from(u8::from(on)))));
        }
        for e in stated.f.values_mut().chain(stated.q.values_mut()) {
            let slopes = gradient(g, *e, &moving);
            let slopes = substitute(g, &slopes, &numbers);
            *e = substitute(g, &[*e], &numbers)[0];
            for (slope, wave) in slopes.into_iter().zip(&moving) {
                // (else a factor of an unknown)
                if g.value(slope).is_some() {
                    let term = g.mul(slope, *wave);
                    *e = g.add(*e, term);
                }
            }
        }
        Ok(stated)
    }
}

/// Waves in what rows of a relation store, and in its constraints, which may be sums of rows that stored.
fn read_by(open: &Model, g: &mut Graph, relations: &[Relation], relation: &Relation) -> BTreeSet<usize> {
    let (mut stores, mut bound, mut stack) = (Vec::new(), Vec::new(), vec![relation]);
    while let Some(of) = stack.pop() {
        stores.extend(of.others.iter().map(|o| o.0).chain([of.row]));
        for &(row, _) in &of.slopes {
            bound.push(row);
            let sum = relations.iter().find(|r| r.row == row);
            bound.extend(sum.iter().flat_map(|r| r.others.iter().map(|o| o.0)));
            stack.extend(sum);
        }
    }
    let charges = stores.iter().filter_map(|r| open.q.get(r));
    let mut read: Vec<Id> = charges.chain(bound.iter().filter_map(|r| open.f.get(r))).copied().collect();
    // (a condition reads earlier ones)
    for (k, f) in open.flags.iter().enumerate().rev() {
        let flag = g.flag(k as u32);
        if g.reachable(&read).contains(&flag) {
            read.extend([f.up, f.down]);
        }
    }
    let added = open.f_wave.iter().filter(|e| bound.contains(&e.0)).map(|e| e.1);
    waves_of(g, &read).into_iter().chain(added).collect()
}
