//! Parts of a circuit that nothing ties to each other: which there are, how often the sources of each move, and the equations of some
//! of them alone.
use super::{Kind, System};
use crate::derive::substitute;
use crate::floating_groups::Groups;
use crate::graph::{Graph, Id, Node};
use crate::model::{FlagSpec, Law, Model, Placed};
use crate::waves::Wave;
use std::collections::BTreeMap;

/// Fewer periods or corners of sources in a run are few: who has so few goes with those that have none.
const FEW: f64 = 100.0;
/// Sources that move so many times as often as others are of another pace.
const FASTER: f64 = 8.0;

impl System {
    /// Unknowns by the pace of what drives them, slowest first, where a run gains from giving each pace steps of its own: parts that
    /// nothing ties to each other, and sources in them that move at least `FASTER` times as often as those in others. None where
    /// there is nothing to gain, where more than circuits is at work, and in browsers, which have no threads for them.
    pub fn paces(&self, g: &Graph, tstop: f64) -> Option<Vec<Vec<usize>>> {
        let integral = |k: usize| self.unknowns[k].unit.is_empty() && self.unknowns[k].kind == Kind::Coordinate;
        let machine = (0..self.n).any(|k| self.unknowns[k].kind.mechanical() && !integral(k));
        let events = !self.logic.is_empty() || !self.clocked.is_empty();
        let more = machine || self.has_laws() || events || !self.delays.list.is_empty();
        if more || !self.responses.is_empty() || cfg!(target_family = "wasm") {
            return None;
        }
        let often: Vec<f64> = self.waves.iter().map(|wave| moves(wave, tstop)).collect();
        if !often.iter().any(|&n| n >= FEW) {
            return None;
        }
        let (part, heard) = self.parts_of(g);
        let mut pace = vec![0.0_f64; self.n]; // of each part, by its first unknown
        for (row, wave) in heard {
            pace[part[row]] = pace[part[row]].max(often[wave]);
        }
        let class = |n: f64| if n < FEW { 0 } else { 1 + (n / FEW).log(FASTER) as u32 };
        let mut groups: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for k in 0..self.n {
            groups.entry(class(pace[part[k]])).or_default().push(k);
        }
        let groups: Vec<Vec<usize>> = groups.into_values().collect();
        let (fastest, slower) = groups.split_last()?;
        let slow: usize = slower.iter().map(Vec::len).sum();
        // those that are slower must be worth it: so large a share of the unknowns of those that are fastest
        (slow > 0 && slow as f64 >= 0.5 * fastest.len() as f64).then_some(groups)
    }

    /// Of every unknown the first one of its part; rows, with the sources that they or conditions in their part read.
    fn parts_of(&self, g: &Graph) -> (Vec<usize>, Vec<(usize, usize)>) {
        let mut parts = Groups::new(self.n + self.flags.len());
        let mut heard: Vec<(usize, usize)> = self.constant.f_wave.iter().map(|&(row, wave, _)| (row, wave)).collect();
        for col in 0..self.n {
            self.pattern.column(col).iter().for_each(|&row| parts.join(row, col));
        }
        let rows = self.expressions.rows.iter().flatten().map(|&(row, e)| (row, vec![e]));
        let flags = self.flags.iter().enumerate().map(|(k, flag)| (self.n + k, vec![flag.up, flag.down]));
        for (at, expressions) in rows.chain(flags) {
            for id in g.reachable(&expressions) {
                match g.node(id) {
                    Node::Unknown(k) => parts.join(at, k as usize),
                    Node::Flag(k) => parts.join(at, self.n + k as usize),
                    Node::Wave(k) => heard.push((at, k as usize)),
                    _ => {}
                }
            }
        }
        let mut first = vec![usize::MAX; self.n + self.flags.len()];
        let of: Vec<usize> = (0..self.n + self.flags.len()).map(|k| parts.of(k)).collect();
        (0..self.n).rev().for_each(|k| first[of[k]] = k);
        heard.iter_mut().for_each(|(at, _)| *at = first[of[*at]]);
        heard.retain(|&(at, _)| at < self.n);
        ((0..self.n).map(|k| first[of[k]]).collect(), heard)
    }
}

/// Which of so many sources expressions read, or rows of these entries.
pub(super) fn heard<'a>(
    g: &Graph,
    expressions: &[Id],
    entries: impl Iterator<Item = &'a (usize, usize, f64)>,
    sources: usize,
) -> Vec<bool> {
    let mut heard = vec![false; sources];
    entries.for_each(|&(_, k, _)| heard[k] = true);
    for id in g.reachable(expressions) {
        if let Node::Wave(k) = g.node(id) {
            heard[k as usize] = true;
        }
    }
    heard
}

/// How often a source moves in a run: its periods, or its corners.
fn moves(wave: &Wave, tstop: f64) -> f64 {
    if let Some(f) = wave.frequency() {
        return f * tstop;
    }
    let (mut t, mut corners) = (0.0, 0.0);
    while corners < FEW * FASTER * FASTER {
        t = wave.next_breakpoint(t);
        if !(t < tstop) {
            break;
        }
        corners += 1.0;
    }
    corners
}

impl Model {
    /// What of it belongs to these unknowns, which nothing ties to the others, in their order; the numbers of its conditions. Conditions
    /// and sources keep their numbers; those of others are still.
    pub fn only(&mut self, g: &mut Graph, of: &[usize]) -> Vec<usize> {
        let mut place = vec![usize::MAX; self.unknowns.len()];
        of.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let mine = |i: usize| place.get(i).copied().filter(|&k| k != usize::MAX);
        let map: Vec<(Id, Id)> = of.iter().map(|&i| (g.unknown(i as u32), g.unknown(place[i] as u32))).collect();
        self.unknowns = of.iter().map(|&i| self.unknowns[i].clone()).collect();
        for entries in [&mut self.g, &mut self.c] {
            *entries = entries.iter().filter_map(|&(r, c, v)| Some((mine(r)?, mine(c)?, v))).collect();
        }
        self.f_wave = self.f_wave.iter().filter_map(|&(r, k, v)| Some((mine(r)?, k, v))).collect();
        // conditions that rows of others read, and own ones
        let mut read = [vec![false; self.flags.len()], vec![false; self.flags.len()]];
        for (&row, &e) in self.f.iter().chain(&self.q) {
            for id in g.reachable(&[e]) {
                if let Node::Flag(k) = g.node(id) {
                    read[usize::from(mine(row).is_some())][k as usize] = true;
                }
            }
        }
        for rows in [&mut self.f, &mut self.q] {
            let own = std::mem::take(rows).into_iter().filter_map(|(r, e)| Some((mine(r)?, e)));
            *rows = own.map(|(r, e)| (r, substitute(g, &[e], &map)[0])).collect();
        }
        let (never, mut own) = (g.constant(-1.0), Vec::new());
        for (number, flag) in self.flags.iter_mut().enumerate() {
            let reached = g.reachable(&[flag.up, flag.down]);
            let unknowns = reached.iter().filter_map(|&id| match g.node(id) {
                Node::Unknown(i) => Some(mine(i as usize).is_none()),
                _ => None,
            });
            // one of time alone is whose rows read it
            let of_others = read[0][number] && !read[1][number];
            let foreign = unknowns.reduce(|a, b| a || b).unwrap_or(of_others);
            *flag = if foreign {
                FlagSpec { up: never, down: never, initial: 0, rest: 0, law: Law::Condition, ..flag.clone() }
            } else {
                own.push(number);
                let roots = substitute(g, &[flag.up, flag.down], &map);
                FlagSpec { up: roots[0], down: roots[1], ..flag.clone() }
            };
        }
        if own.is_empty() {
            self.flags.clear();
        }
        // corners of sources that it does not read are none of its own
        let conditions = self.flags.iter().flat_map(|flag| [flag.up, flag.down]);
        let read: Vec<Id> = self.f.values().chain(self.q.values()).copied().chain(conditions).collect();
        let heard = heard(g, &read, self.f_wave.iter(), self.waves.len());
        for (wave, _) in self.waves.iter_mut().zip(&heard).filter(|(_, &heard)| !heard) {
            *wave = Wave::exchanged();
        }
        let terminal = |k: &mut i32| *k = usize::try_from(*k).ok().and_then(mine).map_or(-1, |k| k as i32);
        for p in self.placed.iter_mut().flatten() {
            match p {
                Placed::Device { terminals, inner, .. } => {
                    terminals.iter_mut().for_each(terminal);
                    inner.iter_mut().for_each(|k| *k = mine(*k).unwrap_or(usize::MAX));
                }
                Placed::Module { terminals, inner, .. } => {
                    terminals.iter_mut().chain(inner).for_each(terminal);
                }
                Placed::Part { .. } => {}
            }
        }
        if let Some(placed) = &mut self.placed {
            let anywhere = |inner: &[usize]| inner.iter().any(|&k| k != usize::MAX);
            placed.retain(|p| match p {
                Placed::Device { terminals, inner, .. } => terminals.iter().any(|&k| k >= 0) || anywhere(inner),
                Placed::Module { terminals, inner, .. } => terminals.iter().chain(inner).any(|&k| k >= 0),
                Placed::Part { .. } => false,
            });
        }
        let held = std::mem::take(&mut self.forces).into_iter();
        self.forces = held.filter_map(|f| Some(crate::model::Force { row: mine(f.row)?, ..f })).collect();
        for values in [&mut self.starting_currents, &mut self.states, &mut self.ic_charge, &mut self.given] {
            *values = values.iter().filter_map(|&(k, v)| Some((mine(k)?, v))).collect();
        }
        own
    }
}
