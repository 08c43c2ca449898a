//! The stages of Radau together: s n unknowns, blocks (A^-1)_ij/h C(X_j) + delta_ij G(X_i), each with its own
//! derivatives: what simplified Newton falls back on where an exponential moves by more than its own size within a step. Costs about five times as much an iteration; on an H-bridge
//! with diodes it took the failed iterations from 212 000 to none and the steps from 188 000 to 66 000.
use super::estimate::believed;
use super::stages::{target, Stuck, STALLED};
use super::tables::Scheme;
use super::{Radau, MOST_ITERATIONS};
use crate::newton::Tolerances;
use crate::sparse::{Lu, Pattern, Symbolic};
use crate::system::{System, Work};

/// Matrix and factorisation of the full Newton method.
pub struct FullNewton {
    lu: Lu<f64>,
    matrix: Vec<f64>,
    /// of block (i, j): place of each entry of the system's pattern, usize::MAX where there is none
    place: Vec<usize>,
    junction: Vec<Vec<f64>>,
    b: Vec<f64>,
}

impl FullNewton {
    pub fn new(sys: &System, scheme: &Scheme) -> Option<FullNewton> {
        let (n, s) = (sys.n, scheme.s);
        let p = &sys.pattern;
        let cells: Vec<(usize, usize)> =
            (0..n).flat_map(|c| p.rowidx[p.colptr[c]..p.colptr[c + 1]].iter().map(move |&r| (r, c))).collect();
        let stands = |i: usize, j: usize, r: usize| i == j || sys.has_q[r];
        let mut entries = Vec::with_capacity(s * s * cells.len());
        for &(r, c) in &cells {
            for i in 0..s {
                for j in (0..s).filter(|&j| stands(i, j, r)) {
                    entries.push((i * n + r, j * n + c));
                }
            }
        }
        let pattern = Pattern::from_entries(s * n, &entries);
        let mut place = vec![usize::MAX; s * s * cells.len()];
        for (k, &(r, c)) in cells.iter().enumerate() {
            for i in 0..s {
                for j in (0..s).filter(|&j| stands(i, j, r)) {
                    place[(k * s + i) * s + j] = pattern.position(i * n + r, j * n + c)?;
                }
            }
        }
        let symbolic = Symbolic::analyse(&pattern).ok()?;
        let matrix = vec![0.0; pattern.rowidx.len()];
        Some(FullNewton {
            lu: Lu::new(&pattern, &symbolic),
            matrix,
            place,
            junction: vec![Vec::new(); s],
            b: vec![0.0; s * n],
        })
    }

    pub fn stages(&self) -> usize {
        self.junction.len()
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
        let (n, s) = (sys.n, scheme.s);
        let (_, target) = target(tol, m.fixed);
        for j in &mut self.junction {
            j.clone_from(&w.junction);
        }
        let outer = w.junction.clone();
        let mut worst = 0;
        let mut found = Err((0, true));
        let mut old = f64::INFINITY;
        let mut was_flat = false;
        // twice no longer contracting it has met rounding, not a curve; a shorter step, nearer to a change point, has more of it
        let rounding = believed(tol);
        m.noise = 0.0;
        for iteration in 1..=3 * MOST_ITERATIONS {
            self.matrix.fill(0.0);
            let mut limited = false;
            for (j, c) in scheme.c.iter().enumerate() {
                std::mem::swap(&mut w.junction, &mut self.junction[j]);
                sys.eval_jacobian(w, &m.stage[j], m.t0 + c * h, true);
                std::mem::swap(&mut w.junction, &mut self.junction[j]);
                limited |= w.limited;
                for (k, place) in self.place.chunks_exact(s * s).enumerate() {
                    self.matrix[place[j * s + j]] += w.gv[k];
                    if w.cv[k] != 0.0 {
                        for i in 0..s {
                            if place[i * s + j] != usize::MAX {
                                self.matrix[place[i * s + j]] += scheme.inverse_a[i * s + j] / h * w.cv[k];
                            }
                        }
                    }
                }
                for r in 0..n {
                    m.d[j][r] = w.q[r] - m.q0[r];
                }
                m.f[j][..n].copy_from_slice(&w.f);
            }
            w.counters.iterations += 1;
            for i in 0..s {
                for r in 0..n {
                    let mut v = m.f[i][r];
                    if sys.has_q[r] {
                        v += (0..s).map(|j| scheme.inverse_a[i * s + j] * m.d[j][r]).sum::<f64>() / h;
                    }
                    self.b[i * n + r] = -v;
                }
            }
            if self.lu.factor_or_refactor(&self.matrix).is_err() {
                break;
            }
            w.counters.factorisations += 1;
            self.lu.solve(&mut self.b);
            w.counters.solves += 1;
            let mut norm = 0.0_f64;
            m.moved.fill(0.0);
            for i in 0..s {
                for r in 0..n {
                    let dx = self.b[i * n + r];
                    m.stage[i][r] += dx;
                    m.moved[r] = m.moved[r].max(dx.abs());
                    if !dx.is_finite() {
                        w.junction = outer;
                        return Err((r, false));
                    }
                    let ratio = dx.abs() / tol.weight(r, m.x0[r], m.stage[s - 1][r]);
                    if tol.in_norm[r] && ratio > norm {
                        norm = ratio;
                        worst = r;
                    }
                }
            }
            let flat = norm > 0.5 * old;
            let stalled = flat && (norm <= STALLED || (norm <= rounding && was_flat));
            if (norm <= target || stalled) && !limited {
                m.noise = if norm > target { norm } else { 0.0 };
                m.level = m.level.max(m.noise);
                found = Ok(iteration);
                break;
            }
            if flat && was_flat && !limited && sys.turns() && m.within_rounding(sys, w, h, tol) {
                found = Ok(iteration);
                break;
            }
            was_flat = flat;
            old = norm;
            found = Err((worst, true));
        }
        w.junction = outer;
        found
    }
}
