//! What is known of a point before the forces in its loops are: coordinates, speeds, and what follows from them. Rows that show
//! no more than that need none of a stage's dearest step.
use super::plan::Plan;
use super::{Point, Reduced, Trouble};
use crate::graph::Id;
use crate::model::Kind;
use crate::waves::Wave;

pub struct Glance {
    part: usize,
    steps: usize,         // that come first
    unknowns: Vec<usize>, // in ascending order
}

impl Plan<'_> {
    /// Does a strong component hold multipliers?
    pub fn closes_loops(&self, component: &[usize]) -> bool {
        let mut members = component.iter().filter_map(|&e| self.equations.get(e));
        members.any(|e| self.source.unknowns[e.row].kind == Kind::Lambda)
    }

    /// The part of what these components, which have become steps, have solved for.
    pub fn glance(&mut self, before: &[Vec<usize>]) -> Glance {
        let members = before.iter().flatten().filter_map(|&e| self.equations.get(e));
        let mut unknowns: Vec<usize> = members.map(|e| e.unknown).filter(|&u| u < self.at.n).collect();
        unknowns.sort_unstable();
        let xs: Vec<Id> = unknowns.iter().map(|&u| self.leaf(u)).collect();
        let xs: Vec<Id> = xs.into_iter().map(|x| self.image(x)).collect();
        // private: stages do without it
        self.parts.push((xs, false));
        Glance { part: self.parts.len() - 1, steps: self.steps.len(), unknowns }
    }
}

impl Reduced {
    /// The unknowns `wanted` of a point, into their places in x, which holds others of an earlier one afterwards. None where that takes
    /// all of `arrive`, and where nobody says what is wanted.
    pub fn glance(
        &self,
        p: &mut Point,
        waves: &[Wave],
        t: f64,
        wanted: &[u32],
        x: &mut [f64],
    ) -> Option<Result<(), Trouble>> {
        let glance = self.glance.as_ref()?;
        if wanted.is_empty() || wanted.iter().any(|&u| glance.unknowns.binary_search(&(u as usize)).is_err()) {
            return None;
        }
        self.set_time(p, waves, t, false);
        p.depart();
        if let Err(trouble) = (0..glance.steps).try_for_each(|k| self.step(k, p)) {
            return Some(Err(trouble));
        }
        self.run(glance.part, p);
        let mut sound = Ok(());
        for (&u, &slot) in glance.unknowns.iter().zip(self.tape.part_places(glance.part)) {
            let v = p.slots[slot as usize];
            if !v.is_finite() {
                sound = Err(Trouble::NotFinite { unknown: u });
            }
            x[u] = v;
        }
        Some(sound)
    }
}
