//! Change of the machine's speeds by a unit impulse of each input:  C dz = -B, constraints kept. Only momenta move in no
//! time, so it is the answer to a step of next to no length,  (G + C/h) dz = -B/h. How that change changes in turn, by
//! springs and dampers, and how the coordinates follow:  C dz' = -G dz,  from  (G + C/h) z1 = C/h dz,  dz' = (z1 - dz)/h.
use crate::newton::Failure;
use crate::sparse::Lu;
use crate::system::{Kind, System, Work};

/// The step, in units of the macro step's half.
const SHORT: f64 = 1e-9;

pub struct Response {
    lu: Lu<f64>,
    matrix: Vec<f64>,
    column: Vec<f64>,
    after: Vec<f64>,
    /// speeds, and coordinates
    pub moving: Vec<usize>,
    /// of each input: what it moves, in the order of `moving`
    speeds: Vec<Vec<f64>>,
    /// how that goes on, and how coordinates follow
    rates: Vec<Vec<f64>>,
}

impl Response {
    pub fn new(slow: &System, exchanged: usize) -> Result<Response, Failure> {
        let symbolic = slow.symbolic().map_err(Failure::from)?;
        let lu = Lu::new(symbolic);
        let moves = |&i: &usize| matches!(slow.unknowns[i].kind, Kind::Speed | Kind::Coordinate);
        let moving: Vec<usize> = (0..slow.n).filter(moves).collect();
        Ok(Response {
            lu,
            matrix: vec![0.0; slow.pattern.rowidx.len()],
            column: vec![0.0; slow.n],
            after: vec![0.0; slow.n],
            speeds: vec![vec![0.0; moving.len()]; exchanged],
            rates: vec![vec![0.0; moving.len()]; exchanged],
            moving,
        })
    }

    /// At (t, z), an end of a macro step.
    pub fn at(&mut self, slow: &System, w: &mut Work, z: &[f64], t: f64) {
        let short = SHORT * w.exchanged.half;
        slow.eval_jacobian(w, z, t, false);
        w.counters.factorisations += 1;
        for (m, (g, c)) in self.matrix.iter_mut().zip(w.gv.iter().zip(&w.cv)) {
            *m = g + c / short;
        }
        let solved = self.lu.factor_or_refactor(&self.matrix).is_ok();
        slow.eval(w, z, t);
        let base = w.f.clone();
        for j in 0..self.speeds.len() {
            // F is affine in the input: a difference is its derivative
            let kept = w.exchanged.values[j];
            w.exchanged.values[j].0[0] += 1.0;
            slow.touch_sources(w);
            slow.eval(w, z, t);
            w.exchanged.values[j] = kept;
            if !solved {
                self.speeds[j].fill(0.0);
                self.rates[j].fill(0.0);
                continue;
            }
            for (c, (f, b)) in self.column.iter_mut().zip(w.f.iter().zip(&base)) {
                *c = -(f - b) / short;
            }
            self.lu.solve(&mut self.column);
            // coordinates do not move in no time, multipliers are impulses
            for (c, u) in self.column.iter_mut().zip(&slow.unknowns) {
                if u.kind != Kind::Speed || !c.is_finite() {
                    *c = 0.0;
                }
            }
            self.after.fill(0.0);
            for (i, c) in self.column.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                for k in slow.pattern.colptr[i]..slow.pattern.colptr[i + 1] {
                    self.after[slow.pattern.rowidx[k]] += w.cv[k] / short * c;
                }
            }
            self.lu.solve(&mut self.after);
            for (&i, (speed, rate)) in self.moving.iter().zip(self.speeds[j].iter_mut().zip(&mut self.rates[j])) {
                *speed = self.column[i];
                *rate = (self.after[i] - self.column[i]) / short;
                if !rate.is_finite() {
                    *rate = 0.0;
                }
            }
        }
        slow.touch_sources(w);
    }

    /// What input j does to speed i.
    pub fn between(&self, i: usize, j: usize) -> f64 {
        self.moving.iter().position(|&k| k == i).map_or(0.0, |k| self.speeds[j][k])
    }

    /// Adds what an impulse of input j does at once, and what its integral does, to the unknowns at `of`; by a share of
    /// the way from here to `end`.
    pub fn add(&self, end: &Response, share: f64, j: usize, ripple: [f64; 2], of: &[usize], x: &mut [f64]) {
        let [impulse, after] = ripple;
        let mixed = |a: &[f64], b: &[f64], k: usize| a[k] + share * (b[k] - a[k]);
        for (k, &i) in self.moving.iter().enumerate() {
            x[of[i]] +=
                mixed(&self.speeds[j], &end.speeds[j], k) * impulse + mixed(&self.rates[j], &end.rates[j], k) * after;
        }
    }
}
