//! Change of the machine's speeds by a unit impulse of each guest:  C dz = -B, constraints kept. Only momenta move in no
//! time, so it is the answer to a step of next to no length,  (G + C/h) dz = -B/h.
use crate::newton::Failure;
use crate::sparse::{Lu, Symbolic};
use crate::system::{Kind, System, Work};

/// The step, in units of the macro step's half.
const SHORT: f64 = 1e-9;

pub struct Response {
    lu: Lu<f64>,
    matrix: Vec<f64>,
    column: Vec<f64>,
    speeds: Vec<Vec<(usize, f64)>>, // of each guest: what it moves, and by how much
}

impl Response {
    pub fn new(slow: &System, guests: usize) -> Result<Response, Failure> {
        let symbolic = Symbolic::analyse(&slow.pattern).map_err(Failure::Singular)?;
        let lu = Lu::new(&slow.pattern, &symbolic);
        let matrix = vec![0.0; slow.pattern.rowidx.len()];
        Ok(Response { lu, matrix, column: vec![0.0; slow.n], speeds: vec![Vec::new(); guests] })
    }

    /// At the start (t, z) of a macro step.
    pub fn at(&mut self, slow: &System, w: &mut Work, z: &[f64], t: f64) {
        let short = SHORT * w.guests.half;
        slow.eval_jacobian(w, z, t, false);
        w.counters.factorisations += 1;
        for (m, (g, c)) in self.matrix.iter_mut().zip(w.gv.iter().zip(&w.cv)) {
            *m = g + c / short;
        }
        let solved = self.lu.factor_or_refactor(&self.matrix).is_ok();
        slow.eval(w, z, t);
        let base = w.f.clone();
        for (j, speeds) in self.speeds.iter_mut().enumerate() {
            speeds.clear();
            // F is affine in the guest: a difference is its derivative
            let kept = w.guests.values[j];
            w.guests.values[j].0[0] += 1.0;
            slow.touch_sources(w);
            slow.eval(w, z, t);
            w.guests.values[j] = kept;
            for (c, (f, b)) in self.column.iter_mut().zip(w.f.iter().zip(&base)) {
                *c = -(f - b) / short;
            }
            if solved {
                self.lu.solve(&mut self.column);
                // coordinates do not move in no time, multipliers are impulses
                let moved = self
                    .column
                    .iter()
                    .enumerate()
                    .filter(|(i, c)| slow.unknowns[*i].kind == Kind::Speed && c.is_finite() && **c != 0.0);
                speeds.extend(moved.map(|(i, c)| (i, *c)));
            }
        }
        slow.touch_sources(w);
    }

    /// What guest j does to speed i.
    pub fn between(&self, i: usize, j: usize) -> f64 {
        self.speeds[j].iter().find(|&&(k, _)| k == i).map_or(0.0, |&(_, a)| a)
    }

    pub fn of(&self, guest: usize) -> &[(usize, f64)] {
        &self.speeds[guest]
    }
}
