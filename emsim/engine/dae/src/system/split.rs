//! Two systems out of one: the circuit (fast) and the machine (slow), each with what it reads of the other as exchanged waves.
//!
//! Unknowns and their rows are shared out by kind. A row's terms in unknowns of the other part become sources: constant
//! entries become coefficients of an exchanged wave, in expressions the unknown is replaced by it. The machine must stand to
//! the circuit as a motor does: its momenta do not contain electrical unknowns, and its forces are affine in them (so
//! their mean over a macro step is all that it feels), and no condition switches its equations.
//!
//! A speed v that the circuit reads moves with the circuit's own impulses, at once and by the machine's inertia alone: the
//! exchanged wave is  v = g(t) + sum_j a_j I_j,  I_j the integral of what the machine reads, an unknown of the circuit,  a_j the
//! speed by a unit impulse and g the rest, which is smooth.
use super::paces::heard;
use super::{FlagSpec, Kind, Model, System, Unknown};
use crate::derive::{depends, gradient, substitute};
use crate::graph::{Graph, Id, Node};
use crate::waves::Wave;
use std::collections::BTreeMap;

/// One part: its equations, and where its unknowns and exchanged waves are.
pub struct Part {
    pub system: System,
    /// index in the whole system of each unknown
    pub of: Vec<usize>,
    /// unknowns of the other part that are exchanged here, by their index there
    pub reads: Vec<usize>,
    /// waves behind these: what an integral does to a speed, by the number of the wave and of the integral
    pub moves: Vec<(usize, usize)>,
    /// the first integral's place
    pub integrals: usize,
}

pub struct Parts {
    pub fast: Part,
    pub slow: Part,
}

impl System {
    /// Shares the equations out, once; for the method that needs it.
    pub fn split(&self, g: &mut Graph) {
        self.made.parts.get_or_init(|| Splitter::new(self, g).split(g).map(Box::new));
    }

    pub fn parts(&self) -> Result<&Parts, &str> {
        match self.made.parts.get() {
            Some(Ok(parts)) => Ok(parts),
            Some(Err(why)) => Err(why),
            None => Err("its equations were not shared out"),
        }
    }
}

struct Splitter<'a> {
    sys: &'a System,
    f: BTreeMap<usize, Id>,
    q: BTreeMap<usize, Id>,
    leaves: Vec<Id>,
    slow: Vec<bool>,
    place: Vec<usize>, // of each unknown in its part
}

impl<'a> Splitter<'a> {
    fn new(sys: &'a System, g: &mut Graph) -> Splitter<'a> {
        let [f, q] = sys.expressions.rows.clone();
        let (f, q): (BTreeMap<_, _>, BTreeMap<_, _>) = (f.into_iter().collect(), q.into_iter().collect());
        let leaves: Vec<Id> = (0..sys.n).map(|i| g.unknown(i as u32)).collect();
        // integrals in expressions are coordinates without a unit
        let machine = |i: usize| {
            let u = &sys.unknowns[i];
            u.kind.mechanical() && !(u.kind == Kind::Coordinate && u.unit.is_empty())
        };
        let mut slow: Vec<bool> = (0..sys.n).map(machine).collect();
        // derivatives go with what they differentiate
        for i in (0..sys.n).filter(|&i| sys.unknowns[i].kind == Kind::Derivative) {
            slow[i] = q.get(&i).is_some_and(|&e| g.unknowns(&[e]).iter().any(|&k| machine(k)));
        }
        let mut counts = [0, 0];
        let place = slow
            .iter()
            .map(|&s| {
                counts[usize::from(s)] += 1;
                counts[usize::from(s)] - 1
            })
            .collect();
        Splitter { sys, f, q, leaves, slow, place }
    }

    fn split(&self, g: &mut Graph) -> Result<Parts, String> {
        if !self.sys.delays.list.is_empty() {
            return Err("there are delays".into());
        }
        if !self.sys.logic.is_empty() {
            return Err("there are digital nodes".into());
        }
        if !self.sys.clocked.is_empty() {
            return Err("there are clocks".into());
        }
        if !self.slow.contains(&true) || !self.slow.contains(&false) {
            return Err("it takes a circuit and a machine".into());
        }
        self.check(g)?;
        let impulses = self.foreign(g, true);
        Ok(Parts { fast: self.part(g, false, &impulses)?, slow: self.part(g, true, &[])? })
    }

    /// Does the machine stand to the circuit as a motor does?
    fn check(&self, g: &mut Graph) -> Result<(), String> {
        let name = |i: usize| &self.sys.unknowns[i].name;
        let c_foreign = self.sys.constant.c_rows.entries().find(|&(r, c, _)| self.slow[r] && !self.slow[c]);
        if let Some((r, c, _)) = c_foreign {
            return Err(format!("the momentum of {} contains {}", name(r), name(c)));
        }
        for (&r, &e) in self.q.iter().filter(|(&r, _)| self.slow[r]) {
            if let Some(c) = g.unknowns(&[e]).into_iter().find(|&c| !self.slow[c]) {
                return Err(format!("the momentum of {} contains {}", name(r), name(c)));
            }
        }
        for (&r, &e) in self.f.iter().chain(&self.q).filter(|(&r, _)| self.slow[r]) {
            if g.reachable(&[e]).iter().any(|&id| matches!(g.node(id), Node::Flag(_))) {
                return Err(format!("a condition switches the equations of {}", name(r)));
            }
        }
        for (&r, &e) in self.f.iter().filter(|(&r, _)| self.slow[r]) {
            let foreign: Vec<usize> = g.unknowns(&[e]).into_iter().filter(|&c| !self.slow[c]).collect();
            let xs: Vec<Id> = foreign.iter().map(|&c| self.leaves[c]).collect();
            for (&c, slope) in foreign.iter().zip(gradient(g, e, &xs)) {
                if depends(g, slope, &xs).contains(&true) {
                    return Err(format!("the force on {} is not linear in {}", name(r), name(c)));
                }
            }
        }
        Ok(())
    }

    /// Expressions of a part's rows and conditions.
    fn expressions(&self, slow: bool) -> Vec<Id> {
        let rows = |m: &BTreeMap<usize, Id>| -> Vec<Id> {
            m.iter().filter(|(&r, _)| self.slow[r] == slow).map(|(_, &e)| e).collect()
        };
        let mut expressions = [rows(&self.f), rows(&self.q)].concat();
        if !slow {
            expressions.extend(self.sys.flags.iter().flat_map(|f| [f.up, f.down]));
        }
        expressions
    }

    /// What a part reads of the other one.
    fn foreign(&self, g: &Graph, slow: bool) -> Vec<usize> {
        let entries = self.sys.constant.g_rows.entries().chain(self.sys.constant.c_rows.entries());
        let mut foreign: Vec<usize> = entries.filter(|e| self.slow[e.0] == slow).map(|e| e.1).collect();
        for e in self.expressions(slow) {
            foreign.extend(g.unknowns(&[e]));
        }
        foreign.retain(|&c| self.slow[c] != slow);
        foreign.sort_unstable();
        foreign.dedup();
        foreign
    }

    /// `impulses`: what the other part reads, where that moves it at once.
    fn part(&self, g: &mut Graph, slow: bool, impulses: &[usize]) -> Result<Part, String> {
        let sys = self.sys;
        let of: Vec<usize> = (0..sys.n).filter(|&i| self.slow[i] == slow).collect();
        let mine = |i: usize| self.slow[i] == slow;
        let expressions = self.expressions(slow);
        let foreign = self.foreign(g, slow);

        // leaves in their new places
        let (first, integrals) = (sys.waves.len(), of.len());
        let mut moves: Vec<(usize, usize)> = Vec::new();
        for (k, _) in foreign.iter().enumerate().filter(|(_, &i)| sys.unknowns[i].kind == Kind::Speed) {
            moves.extend((0..impulses.len()).map(|j| (k, j)));
        }
        let exchanged = |c: usize| foreign.binary_search(&c).unwrap_or(0);
        let mut leaf: Vec<Id> = Vec::new();
        for k in 0..foreign.len() {
            let mut sum = g.wave((first + k) as u32);
            for (m, &(_, j)) in moves.iter().enumerate().filter(|(_, &(of, _))| of == k) {
                let (a, i) = (g.wave((first + foreign.len() + m) as u32), g.unknown((integrals + j) as u32));
                let part = g.mul(a, i);
                sum = g.add(sum, part);
            }
            leaf.push(sum);
        }
        let map: Vec<(Id, Id)> = (0..sys.n)
            .filter(|&i| mine(i) || foreign.binary_search(&i).is_ok())
            .map(|i| (self.leaves[i], if mine(i) { g.unknown(self.place[i] as u32) } else { leaf[exchanged(i)] }))
            .collect();
        // corners of sources that this part does not read are none of its own
        let heard = heard(g, &expressions, sys.constant.f_wave.iter().filter(|e| mine(e.0)), first);
        let own = sys.waves.iter().zip(&heard).map(|(v, &heard)| if heard { v.clone() } else { Wave::exchanged() });
        let mut model = Model {
            unknowns: of.iter().map(|&i| sys.unknowns[i].clone()).collect(),
            waves: own.chain((0..foreign.len() + moves.len()).map(|_| Wave::exchanged())).collect(),
            ..Model::default()
        };
        for (from, to) in [(&self.f, &mut model.f), (&self.q, &mut model.q)] {
            for (&r, &e) in from.iter().filter(|(&r, _)| mine(r)) {
                to.insert(self.place[r], substitute(g, &[e], &map)[0]);
            }
        }
        for (entries, own, terms) in
            [(&sys.constant.g_rows, &mut model.g, &mut model.f), (&sys.constant.c_rows, &mut model.c, &mut model.q)]
        {
            for (r, c, v) in entries.entries().filter(|e| mine(e.0)) {
                if mine(c) {
                    own.push((self.place[r], self.place[c], v));
                } else {
                    let v = g.constant(v);
                    let term = g.mul(v, leaf[exchanged(c)]);
                    let old = terms.get(&self.place[r]).copied();
                    terms.insert(self.place[r], old.map_or(term, |old| g.add(old, term)));
                }
            }
        }
        if !moves.is_empty() {
            for (j, &i) in impulses.iter().enumerate() {
                let unknown = &sys.unknowns[i];
                let unit = format!("{} s", unknown.unit);
                let name = format!("integral of {}", unknown.name);
                model.unknowns.push(Unknown { name, kind: Kind::Coordinate, unit, initial: 0.0 });
                model.c.push((integrals + j, integrals + j, 1.0));
                model.g.push((integrals + j, self.place[i], -1.0));
            }
        }
        for &(r, k, v) in sys.constant.f_wave.iter().filter(|&&(r, _, _)| mine(r)) {
            model.f_wave.push((self.place[r], k, v));
        }
        if !slow {
            let place = |k: i32| if k >= 0 { self.place[k as usize] as i32 } else { k };
            model.classes.extend(sys.devices.classes.iter().map(|c| c.class.moved(&place)));
            for f in &sys.flags {
                let roots = substitute(g, &[f.up, f.down], &map);
                model.flags.push(FlagSpec { up: roots[0], down: roots[1], ..f.clone() });
            }
        }
        let system = System::compile(model, g)?;
        let reads = foreign.iter().map(|&i| self.place[i]).collect();
        Ok(Part { system, of, reads, moves, integrals })
    }
}
