//! The stages of Radau together: s n unknowns, blocks (A^-1)_ij/h C(X_j) + delta_ij G(X_i), each with its own
//! derivatives: what simplified Newton falls back on where an exponential moves by more than its own size within a step. Costs about five times as much an iteration; on an H-bridge
//! with diodes it took the failed iterations from 212 000 to none and the steps from 188 000 to 66 000.
use super::estimate::believed;
use super::stages::{moved, target, Stuck, STALLED};
use super::{Radau, MOST_ITERATIONS};
use crate::newton::Tolerances;
use crate::sparse::Lu;
use crate::system::{System, Together, Work, POINTS};

/// Matrix and factorisation of the full Newton method.
pub struct FullNewton {
    lu: Lu<f64>,
    matrix: Vec<f64>,
    ports: Vec<Vec<f64>>,
    b: Vec<f64>,
}

impl Radau {
    /// Newton's method on the stages together, junction voltages limited stage by stage.
    pub(super) fn full_newton(
        &mut self,
        sys: &System,
        w: &mut Work,
        h: f64,
        tol: &Tolerances,
    ) -> Result<usize, (usize, bool)> {
        let mut full = match self.newton.full.take() {
            Some(full) => full,
            None => Box::new(FullNewton::new(sys).ok_or((0, true))?),
        };
        let result = full.solve(self, sys, w, h, tol);
        self.newton.full = Some(full);
        if result.is_ok() {
            // the error estimate reads the charges of the stages as they are now, and the derivatives at the end: those in the
            // middle may be of a diode that has turned off since, and hold a node that nothing holds any more
            self.evaluate(sys, w, h, false);
            self.move_charges(sys);
            if sys.turns() {
                sys.eval_jacobian(w, &self.points.x[self.scheme.s - 1], self.start.t + h, false);
                self.matrices.keep(sys, w);
                self.matrices.at = f64::NAN;
                self.matrices.factor(sys, w, h, &self.scheme.eigenvalues()).map_err(|_| (0, true))?;
            }
        }
        result
    }
}

impl FullNewton {
    /// None where no such matrix has an inverse.
    pub fn new(sys: &System) -> Option<FullNewton> {
        let Together { pattern, symbolic, .. } = sys.together()?;
        Some(FullNewton {
            lu: Lu::new(symbolic),
            matrix: vec![0.0; pattern.nnz()],
            ports: vec![Vec::new(); POINTS],
            b: vec![0.0; pattern.n],
        })
    }

    pub fn solve(
        &mut self,
        m: &mut Radau,
        sys: &System,
        w: &mut Work,
        h: f64,
        tol: &Tolerances,
    ) -> Result<usize, Stuck> {
        let scheme = m.scheme;
        let (n, s) = (sys.n, POINTS);
        let place = &sys.together().ok_or((0, true))?.place;
        let (_, target) = target(tol, m.fixed);
        for j in &mut self.ports {
            j.clone_from(&w.ports);
        }
        let outer = w.ports.clone();
        let slopes: [f64; POINTS * POINTS] = std::array::from_fn(|k| scheme.inverse_a[k] / h);
        let mut found = Err((0, true));
        let mut old = f64::INFINITY;
        let mut was_flat = false;
        // twice no longer contracting it has met rounding, not a curve; a shorter step, nearer to a change point, has more of it
        let rounding = believed(tol);
        m.estimate.noise = 0.0;
        for iteration in 1..=3 * MOST_ITERATIONS {
            self.matrix.fill(0.0);
            let mut limited = false;
            for (j, c) in scheme.c.iter().enumerate() {
                std::mem::swap(&mut w.ports, &mut self.ports[j]);
                sys.eval_jacobian(w, &m.points.x[j], m.start.t + c * h, true);
                std::mem::swap(&mut w.ports, &mut self.ports[j]);
                limited |= w.limited;
                for (place, (g, c)) in place.chunks_exact(s * s).zip(w.gv.iter().zip(&w.cv)) {
                    self.matrix[place[j * s + j]] += g;
                    if *c != 0.0 {
                        for i in (0..s).filter(|i| place[i * s + j] != usize::MAX) {
                            self.matrix[place[i * s + j]] += slopes[i * s + j] * c;
                        }
                    }
                }
                moved(&w.q, &m.start.q, &mut m.points.d[j]);
                m.points.f[j][..n].copy_from_slice(&w.f);
            }
            w.counters.iterations += 1;
            for (i, (b, f)) in self.b.chunks_exact_mut(n).zip(&m.points.f).enumerate() {
                let [first, second, third]: [f64; POINTS] = std::array::from_fn(|j| scheme.inverse_a[i * s + j]);
                let moved = m.points.d[0].iter().zip(&m.points.d[1]).zip(&m.points.d[2]);
                for ((b, f), ((d0, d1), d2)) in b.iter_mut().zip(f).zip(moved) {
                    *b = -(f + (first * d0 + second * d1 + third * d2) / h);
                }
            }
            if self.lu.factor_or_refactor(&self.matrix).is_err() {
                break;
            }
            w.counters.factorisations += 1;
            self.lu.solve(&mut self.b);
            w.counters.solves += 1;
            if let Some(odd) = self.b.iter().position(|dx| !dx.is_finite()) {
                w.ports = outer;
                return Err((odd % n, false));
            }
            let mut norm = 0.0_f64;
            m.newton.moved.fill(0.0);
            for (i, step) in self.b.chunks_exact_mut(n).enumerate() {
                for ((x, dx), moved) in m.points.x[i].iter_mut().zip(&mut *step).zip(&mut m.newton.moved) {
                    *x += *dx;
                    *dx = dx.abs();
                    *moved = moved.max(*dx);
                }
                let end = &m.points.x[s - 1];
                norm = norm.max(tol.largest_move(step, &m.start.x, end));
            }
            let flat = norm > 0.5 * old;
            let stalled = flat && (norm <= STALLED || (norm <= rounding && was_flat));
            let settled = (norm <= target || flat) && !limited && !m.leaves_lines(sys, w, 1.0);
            if (norm <= target || stalled) && settled {
                m.estimate.noise = if norm > target { norm } else { 0.0 };
                m.newton.level = m.newton.level.max(m.estimate.noise);
                found = Ok(iteration);
                break;
            }
            if flat && was_flat && settled && sys.turns() && m.within_rounding(sys, w, h, tol) {
                found = Ok(iteration);
                break;
            }
            was_flat = flat;
            old = norm;
            found = Err((m.farthest(tol), true));
        }
        w.ports = outer;
        found
    }
}
