//! Where a machine starts, moved by hand: coordinates that are held at other values than the deck's, and closed loops that follow.
//!
//! What is left open of a loop are the rows of its `mu`, how fast they open those of its `lambda` (assemble/equations.py). Corrections
//! are the least by the mass matrix, as those of the deck's own start are (assemble/start.py).
use super::Instance;
use crate::assembly::{project, project_velocity};
use crate::model::Kind;
use crate::record::Record;
use crate::system::{System, Work};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

#[derive(Default)]
pub(super) struct Places {
    /// coordinates that may give way, with their speeds where these are their derivatives
    coordinates: Vec<(usize, Option<usize>)>,
    held: BTreeMap<usize, f64>,
    /// as the deck has it, once anything is held
    own: Vec<f64>,
}

impl Instance {
    /// A coordinate that may be held elsewhere, or gives way; its speed.
    pub fn may_move(&mut self, coordinate: usize, speed: Option<usize>) -> Result<(), String> {
        if coordinate.max(speed.unwrap_or(0)) >= self.system.n {
            return Err("a coordinate is none of the model".into());
        }
        self.places.coordinates.push((coordinate, speed));
        Ok(())
    }

    /// Holds a coordinate at a value at the start, or no more. Where the loops cannot close so, all stays as it was.
    pub fn place(&mut self, coordinate: usize, value: Option<f64>) -> Result<(), String> {
        if !self.places.coordinates.iter().any(|&(q, _)| q == coordinate) {
            return Err("a coordinate that cannot be moved".into());
        }
        self.session = None;
        let now: Vec<f64> = self.system.unknowns.iter().map(|u| u.initial).collect();
        if self.places.own.is_empty() {
            self.places.own.clone_from(&now);
        }
        let before = self.places.held.clone();
        match value {
            Some(value) => self.places.held.insert(coordinate, value),
            None => self.places.held.remove(&coordinate),
        };
        let x = if self.places.held.is_empty() { self.places.own.clone() } else { now };
        match self.led(x, coordinate) {
            Ok(x) => start_at(&mut self.system, &x),
            Err(said) => {
                self.places.held = before;
                Err(said)
            }
        }
    }

    /// Time 0 and the outputs there, of which those that only hang on coordinates are right: the pose.
    pub fn pose(&self, row: &mut Vec<f64>) {
        let ids: Vec<_> = self.packed.outputs.iter().map(|o| o.id).collect();
        let (mut record, mut w) = (Record::new(&self.graph, &ids), self.system.work());
        let x: Vec<f64> = self.system.unknowns.iter().map(|u| u.initial).collect();
        record.push(&self.system, &mut w, 0.0, &x);
        *row = record.data;
    }

    /// The start with that coordinate where it is held: by steps of half a metre or radian, so that loops follow on their branch.
    fn led(&self, mut x: Vec<f64>, coordinate: usize) -> Result<Vec<f64>, String> {
        let from = x[coordinate];
        let way = self.places.held.get(&coordinate).map_or(0.0, |to| to - from);
        let steps = (2.0 * way.abs()).ceil().clamp(1.0, 1e4);
        for k in 1..=steps as usize {
            x[coordinate] = from + way * (k as f64 / steps);
            x = self.closed(x)?;
        }
        Ok(x)
    }

    /// Positions, then speeds, that keep the loops closed.
    fn closed(&self, mut x: Vec<f64>) -> Result<Vec<f64>, String> {
        let sys = &self.system;
        let of = |kind: Kind| (0..sys.n).filter(move |&i| sys.unknowns[i].kind == kind);
        let gaps: Vec<usize> = of(Kind::Mu).collect();
        let rates: Vec<usize> = of(Kind::Lambda).filter(|&i| !sys.laws.has_row(i)).collect();
        if gaps.is_empty() && rates.is_empty() || self.places.held.is_empty() {
            return Ok(x);
        }
        let mut w = sys.work();
        let (places, speeds): (Vec<usize>, Vec<Option<usize>>) = self.places.coordinates.iter().copied().unzip();
        let held: Vec<bool> = places.iter().map(|q| self.places.held.contains_key(q)).collect();
        sys.eval_jacobian(&mut w, &x, 0.0, false);
        let mass = mass(sys, &w, &speeds);
        let at: Vec<f64> = places.iter().map(|&q| x[q]).collect();
        let mut gap = |at: &[f64], value: &mut [f64], slopes: &mut [f64]| {
            places.iter().zip(at).for_each(|(&q, &v)| x[q] = v);
            sys.eval_jacobian(&mut w, &x, 0.0, false);
            entries(sys, &w, &gaps, &places, value, slopes);
        };
        // gaps [m or rad] and tries are those of the deck's own start (`Builder.project`)
        let found = project(gaps.len(), &mut gap, &mass, &at, &held, 1e-12, 200);
        // half a turn in so short a step is another way to close them
        let turns = |(k, v): (usize, &f64)| sys.unknowns[places[k]].unit == "rad" && (v - at[k]).abs() > PI;
        let found = found.ok().filter(|found| !found.iter().enumerate().any(turns));
        let found = found.ok_or_else(|| "the closed loops of the machine do not reach there".to_string())?;
        places.iter().zip(found).for_each(|(&q, v)| x[q] = v);

        let speeds: Vec<usize> = speeds.into_iter().flatten().collect();
        let own: Vec<f64> = speeds.iter().map(|&u| x[u]).collect();
        speeds.iter().for_each(|&u| x[u] = 0.0);
        sys.eval_jacobian(&mut w, &x, 0.0, false);
        let (mut drift, mut slopes) = (vec![0.0; rates.len()], vec![0.0; rates.len() * speeds.len()]);
        entries(sys, &w, &rates, &speeds, &mut drift, &mut slopes);
        drift.iter_mut().for_each(|v| *v = -*v);
        let all: Vec<Option<usize>> = speeds.iter().map(|&u| Some(u)).collect();
        let free = vec![false; speeds.len()];
        let found = project_velocity(&slopes, &self::mass(sys, &w, &all), &own, &free, &drift);
        speeds.iter().zip(found).for_each(|(&u, v)| x[u] = v);
        Ok(x)
    }
}

/// F of some rows, and its slopes by some unknowns.
fn entries(sys: &System, w: &Work, rows: &[usize], by: &[usize], value: &mut [f64], slopes: &mut [f64]) {
    for (k, &row) in rows.iter().enumerate() {
        value[k] = w.f[row];
        for (j, &u) in by.iter().enumerate() {
            slopes[k * by.len() + j] = sys.pattern.position(row, u).map_or(0.0, |at| w.gv[at]);
        }
    }
}

/// The mass matrix: momenta by speeds; 1 where coordinates have speeds that are not their derivatives.
fn mass(sys: &System, w: &Work, speeds: &[Option<usize>]) -> Vec<f64> {
    let n = speeds.len();
    let known: Option<Vec<usize>> = speeds.iter().copied().collect();
    let entry = |i: usize, j: usize| match &known {
        Some(u) => sys.pattern.position(u[i], u[j]).map_or(0.0, |at| w.cv[at]),
        None => (i == j) as u8 as f64,
    };
    (0..n * n).map(|k| entry(k / n, k % n)).collect()
}

/// Unknowns at the start, of these equations and of those that they were made of.
fn start_at(system: &mut Arc<System>, x: &[f64]) -> Result<(), String> {
    let sys = Arc::get_mut(system).ok_or("the equations are in use")?;
    sys.unknowns.iter_mut().zip(x).for_each(|(u, &v)| u.initial = v);
    sys.whole.as_mut().map_or(Ok(()), |whole| start_at(whole, x))
}
