//! The three stages of Radau together, each with its own derivatives: what simplified Newton falls back on where an
//! exponential moves by more than its own size within a step. Costs about five times as much an iteration; on an H-bridge
//! with diodes it took the failed iterations from 212 000 to none and the steps from 188 000 to 66 000.
use super::{Radau, C1, C2, LOCAL, MOST_ITERATIONS, NEWTON, STALLED};
use crate::newton::Tolerances;
use crate::sparse::{Lu, Pattern, Symbolic};
use crate::system::{System, Work};

/// A^-1 of Radau IIA of order 5.
#[rustfmt::skip]
const INVERSE_A: [[f64; 3]; 3] = [
    [3.224_744_871_391_589, 1.167_840_084_690_405_5, -0.253_197_264_742_180_8],
    [-3.567_840_084_690_405_5, 0.775_255_128_608_411, 1.053_197_264_742_180_7],
    [5.531_972_647_421_808, -7.531_972_647_421_808, 5.0],
];

/// Matrix and factorisation of the full Newton method.
pub struct FullNewton {
    lu: Lu<f64>,
    matrix: Vec<f64>,
    /// of block (i, j): place of each entry of the system's pattern, usize::MAX where there is none
    place: Vec<[[usize; 3]; 3]>,
    junction: [Vec<f64>; 3],
    b: Vec<f64>,
}

impl FullNewton {
    pub fn new(sys: &System) -> Option<FullNewton> {
        let n = sys.n;
        let p = &sys.pattern;
        let cells: Vec<(usize, usize)> =
            (0..n).flat_map(|c| p.rowidx[p.colptr[c]..p.colptr[c + 1]].iter().map(move |&r| (r, c))).collect();
        let stands = |i: usize, j: usize, r: usize| i == j || sys.has_q[r];
        let mut entries = Vec::with_capacity(9 * cells.len());
        for &(r, c) in &cells {
            for i in 0..3 {
                for j in (0..3).filter(|&j| stands(i, j, r)) {
                    entries.push((i * n + r, j * n + c));
                }
            }
        }
        let pattern = Pattern::from_entries(3 * n, &entries);
        let mut place = vec![[[usize::MAX; 3]; 3]; cells.len()];
        for (k, &(r, c)) in cells.iter().enumerate() {
            for i in 0..3 {
                for j in (0..3).filter(|&j| stands(i, j, r)) {
                    place[k][i][j] = pattern.position(i * n + r, j * n + c)?;
                }
            }
        }
        let symbolic = Symbolic::analyse(&pattern).ok()?;
        let matrix = vec![0.0; pattern.rowidx.len()];
        let junction = std::array::from_fn(|_| Vec::new());
        Some(FullNewton { lu: Lu::new(&pattern, &symbolic), matrix, place, junction, b: vec![0.0; 3 * n] })
    }

    pub fn solve(
        &mut self,
        m: &mut Radau,
        sys: &System,
        w: &mut Work,
        h: f64,
        tol: &Tolerances,
    ) -> Result<usize, (usize, bool)> {
        let n = sys.n;
        let reltol = tol.reltol * LOCAL;
        let target = (1e-13 / reltol).max(reltol.sqrt().clamp(NEWTON, 0.03));
        for j in &mut self.junction {
            j.clone_from(&w.junction);
        }
        let outer = w.junction.clone();
        let mut worst = 0;
        let mut found = Err((0, true));
        let mut old = f64::INFINITY;
        for iteration in 1..=3 * MOST_ITERATIONS {
            self.matrix.fill(0.0);
            let mut limited = false;
            for (j, c) in [C1, C2, 1.0].into_iter().enumerate() {
                std::mem::swap(&mut w.junction, &mut self.junction[j]);
                sys.eval_jacobian(w, &m.stage[j], m.t0 + c * h, true);
                std::mem::swap(&mut w.junction, &mut self.junction[j]);
                limited |= w.limited;
                for (k, place) in self.place.iter().enumerate() {
                    self.matrix[place[j][j]] += w.gv[k];
                    if w.cv[k] != 0.0 {
                        for i in 0..3 {
                            if place[i][j] != usize::MAX {
                                self.matrix[place[i][j]] += INVERSE_A[i][j] / h * w.cv[k];
                            }
                        }
                    }
                }
                for r in 0..n {
                    m.d[j][r] = w.q[r] - m.q0[r];
                }
                m.f[j].copy_from_slice(&w.f);
            }
            w.counters.iterations += 1;
            for i in 0..3 {
                for r in 0..n {
                    let mut v = m.f[i][r];
                    if sys.has_q[r] {
                        v += (0..3).map(|j| INVERSE_A[i][j] * m.d[j][r]).sum::<f64>() / h;
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
            for i in 0..3 {
                for r in 0..n {
                    let dx = self.b[i * n + r];
                    m.stage[i][r] += dx;
                    if !dx.is_finite() {
                        w.junction = outer;
                        return Err((r, false));
                    }
                    let ratio = dx.abs() / (tol.weight(r, m.x0[r], m.stage[2][r]) * LOCAL);
                    if tol.in_norm[r] && ratio > norm {
                        norm = ratio;
                        worst = r;
                    }
                }
            }
            let stalled = norm <= STALLED && norm > 0.5 * old;
            if (norm <= target || stalled) && !limited {
                found = Ok(iteration);
                break;
            }
            old = norm;
            found = Err((worst, true));
        }
        w.junction = outer;
        found
    }
}
