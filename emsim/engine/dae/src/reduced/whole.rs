//! Where nothing has to be solved but what is known in symbols (trees of bodies, linear circuits), points are reached by
//! programs of the state alone:
//!
//!   stage     the rates, for stages that nobody looks at
//!   arrival   1. rates, unknowns, 1/pivots    2. a small change of the state as one of the unknowns
//!
//! What a block writes for the next one, and reads again, is there a value in a register. The stages of a step are brought into one
//! piece of code (`Tape::sequence`) when a method first asks for it.
use super::plan::Plan;
use super::{Point, Reduced, Step, Trouble};
use crate::derive::substitute;
use crate::graph::Id;
use crate::tape::{Again, Inputs, Move, Sequence, Tape};
use std::ops::Range;
use std::sync::OnceLock;

pub struct Whole {
    stage: Tape,
    /// the stages of a step in one, of each method that has run
    sequences: [OnceLock<Option<Sequence>>; SEQUENCES],
    arrival: Option<Arrival>, // none where something that only shows is solved for otherwise
}

const SEQUENCES: usize = 4; // two methods, each with a step and its inside

struct Arrival {
    tape: Tape,
    pivots: Vec<usize>, // their unknowns
}

/// Scratch of a point.
#[derive(Default)]
pub struct Slots {
    stage: Vec<f64>,
    arrival: Vec<f64>,
    results: Vec<f64>,
    arrived: bool, // what changes are computed from is there
}

impl Plan<'_> {
    /// `ids` by the state alone; None where something else is read.
    fn by_state(&mut self, mut ids: Vec<Id>) -> Option<Vec<Id>> {
        let solved = |plan: &Self, ids: &[Id]| plan.leaves(ids).iter().any(|&l| l < plan.at.gmin());
        for _ in 0..=self.steps.len() {
            if !solved(self, &ids) {
                return Some(ids);
            }
            ids = substitute(self.g, &ids, &self.known);
        }
        None
    }

    fn all_direct(&self) -> bool {
        self.steps.iter().all(|s| matches!(s, Step::Direct(_)))
    }

    /// The program of a stage.
    pub fn whole_stage(&mut self, rates: &[Id]) {
        if self.all_direct() {
            let Some(rates) = self.by_state(rates.to_vec()) else { return };
            let stage = Tape::new(self.g, &rates).native_into();
            self.whole = Some(Whole { stage, sequences: Default::default(), arrival: None });
        }
    }

    /// The program of an arrival.
    pub fn whole_arrival(&mut self, rates: &[Id], xs: &[Id]) {
        if self.whole.is_none() || !self.all_direct() {
            return;
        }
        let zero = self.g.constant(0.0);
        let (mut outs, mut pivots, mut changes) = ([rates, xs].concat(), Vec::new(), vec![zero; xs.len()]);
        for &(unknown, s, r) in &self.direct {
            let change = self.g.unknown(self.at.change(s) as u32);
            let r = self.g.constant(r);
            changes[unknown] = self.g.mul(r, change);
        }
        for step in &self.steps {
            let Step::Direct(d) = step else { continue };
            outs.extend(&self.parts[d.part].0[d.unknowns.len()..]);
            for (&u, &change) in d.unknowns.iter().zip(&d.changes) {
                pivots.push(u);
                changes[u] = change;
            }
        }
        let (Some(outs), Some(changes)) = (self.by_state(outs), self.by_state(changes)) else { return };
        let tape = Tape::in_parts(self.g, &[(&outs, true), (&changes, false)]).native_into();
        if let Some(whole) = &mut self.whole {
            whole.arrival = Some(Arrival { tape, pivots });
        }
    }
}

impl Whole {
    pub fn slots(&self) -> Slots {
        let arrival = self.arrival.as_ref();
        Slots {
            stage: self.stage.workspace(),
            arrival: arrival.map(|a| a.tape.workspace()).unwrap_or_default(),
            results: arrival.map(|a| vec![0.0; a.tape.part_places(0).len()]).unwrap_or_default(),
            arrived: false,
        }
    }
}

/// Stages one after the other.
pub struct Stages<'a> {
    program: Again<'a>,
    y: Range<usize>,
}

impl Stages<'_> {
    /// The state to be written before `run`, and room for whole vectors of four.
    #[inline]
    pub fn y(&mut self) -> &mut [f64] {
        &mut self.program.x()[self.y.clone()]
    }

    #[inline]
    pub fn run(&mut self, t: f64, out: &mut [f64]) {
        self.program.run(t, out);
    }

    /// Writes the state, too.
    #[inline]
    pub fn run_sequence(&mut self, sequence: &Sequence, table: &mut [f64]) {
        self.program.run_sequence(sequence, table);
    }
}

impl Point {
    /// The blocks are run, not the programs, from here on.
    pub fn depart(&mut self) {
        self.whole.arrived = false;
    }
}

impl Reduced {
    /// What runs `count` stages that read no source; None where they are no one program. Whether rates are finite is for the
    /// caller to see.
    pub fn stages<'a>(&'a self, p: &'a mut Point, count: usize) -> Option<Stages<'a>> {
        let whole = self.whole.as_ref().filter(|_| p.checked && self.waves == 0)?;
        p.evaluations += count as u64;
        let y = self.at.y(0)..self.at.y(self.at.width());
        let program = whole.stage.again(&mut p.v, &p.waves, &p.flags, &mut p.whole.stage)?;
        Some(Stages { program, y })
    }

    /// The stages of a method in one, made when it first runs; `number` is that of the method and its purpose. Not for long
    /// states: there the sums are long loops anyhow, and the code would be.
    pub fn sequence(&self, number: usize, moves: &[Move], h: usize, times: usize) -> Option<&Sequence> {
        // states of a program that is written out; sums over more are loops whose cost is their arithmetic
        let whole = self.whole.as_ref().filter(|_| self.at.width() <= 64 && self.waves == 0)?;
        let make = || whole.stage.sequence(moves, self.at.width(), self.at.y(0), h, times);
        whole.sequences[number].get_or_init(make).as_ref()
    }

    /// f(y, t) by the program of a stage, where there is one; true then.
    #[inline]
    pub(super) fn whole_rates(&self, p: &mut Point, out: &mut [f64]) -> bool {
        let Some(whole) = self.whole.as_ref().filter(|_| p.checked) else { return false };
        p.evaluations += 1;
        let inputs = Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags };
        whole.stage.run_into(0, &inputs, &mut p.whole.stage, out);
        true
    }

    /// Rates and unknowns by the program of an arrival, where there is one.
    pub(super) fn whole_point(
        &self,
        p: &mut Point,
        rates: Option<&mut [f64]>,
        x: &mut [f64],
    ) -> Option<Result<(), Trouble>> {
        let arrival = self.whole.as_ref().filter(|_| p.checked)?.arrival.as_ref()?;
        let Slots { arrival: slots, results, arrived, .. } = &mut p.whole;
        let inputs = Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags };
        arrival.tape.run_into(0, &inputs, slots, results);
        *arrived = true;
        let (f, rest) = results.split_at(self.states.len());
        let (found, pivots) = rest.split_at(self.at.n);
        x.copy_from_slice(found);
        if let Some(rates) = rates {
            p.evaluations += 1;
            rates.copy_from_slice(f);
        }
        if let Some(k) = pivots.iter().position(|&r| !(r > 0.0)) {
            return Some(Err(Trouble::Singular { unknown: arrival.pivots[k] }));
        }
        let bad = |v: &f64| !v.is_finite();
        if let Some(k) = f.iter().position(bad) {
            return Some(Err(Trouble::NotFinite { unknown: self.states[k] }));
        }
        Some(found.iter().position(bad).map_or(Ok(()), |unknown| Err(Trouble::NotFinite { unknown })))
    }

    /// Changes of the unknowns at the last arrival; false where there was none.
    pub(super) fn whole_changes(&self, p: &mut Point, e: &[f64], out: &mut [f64]) -> bool {
        let Some(arrival) = self.whole.as_ref().filter(|_| p.whole.arrived).and_then(|w| w.arrival.as_ref()) else {
            return false;
        };
        let from = self.at.change(0);
        p.v[from..from + e.len()].copy_from_slice(e);
        let inputs = Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags };
        arrival.tape.run_into(1, &inputs, &mut p.whole.arrival, out);
        true
    }
}
