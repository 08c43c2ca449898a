//! Backward differentiation formulas, orders 1 to 6, variable step and order ("Gear"). Without maxord the orders are 1 to 5
//! (6 is hardly stable); with maxord 2 or less everything is as SPICE's users expect: rows are steps, no longer than TSTEP.
//!
//! dQ/dt at t1 is the slope of the polynomial through the last k+1 charges (Lagrange form on the true, unequal points):
//!
//!   sum_j alpha_j Q_j + F(x1, t1) = 0,   alpha_j = l_j'(t1)
//!
//! so that  a = alpha_0  and  r = sum_{j>=1} alpha_j Q_j.  Error constants are those of the variable-step formula: with the
//! (k+1)-th divided difference dd of x over k+2 points,   lte = h / (t1 - t_{-k}) * prod_{j=0..k} (t1 - t_{-j}) * dd
//! (Brenan, Campbell and Petzold 1996, section 5.2).  The order moves by at most one a step, to whichever of k-1, k, k+1
//! allows the longest next step.
//!
//! First guess: the polynomial through the last k+1 points, which is k+1-th order accurate as the solution is (its distance
//! from the solution is what the error is estimated by). Dense output: the polynomial through the k+1 points of the formula.
//! Accounts of energy integrate the polynomial through the powers at the newest k points, of the formula's order too: the
//! points solve the equations, between them a diode's exponential is far from any polynomial of its voltage.
use super::{interpolate, response, Attempt, History, Method};
use crate::ledger::Stages;
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::sparse::Complex;
use crate::system::{System, Work};

const MOST: usize = 6;
/// ... without being asked for more.
const HIGHEST: usize = 5;
/// The local tolerance against the asked one, where trtol does not say: keeps the global error near what was asked.
const LOCAL: f64 = 0.1;

pub struct Gear {
    newton: Newton,
    past: History,
    charges: Vec<Vec<f64>>, // beside past.x
    q1: Vec<f64>,
    r: Vec<f64>,
    t1: f64,
    x1: Vec<f64>,
    order: usize,
    maxord: usize,
    spice: bool, // maxord asks for what SPICE has
    since_change: usize,
    trtol: f64,
    fixed: bool,
    itl4: usize,
    next_order: usize,
    used: usize,                      // order of the candidate's step
    accounts: Option<Vec<Vec<f64>>>,  // weights of the newest points in the integral over the accepted step
    starter: Option<Box<dyn Method>>, // fixed steps: supplies the first maxord - 1 points
}

impl Gear {
    pub fn new(sys: &System, o: &Options) -> Result<Gear, Failure> {
        let fixed = o.fixed_step.is_some();
        let maxord = o.maxord.unwrap_or(if fixed { 2 } else { HIGHEST }).clamp(1, MOST);
        let spice = o.maxord.is_some_and(|m| m <= 2);
        let starter: Option<Box<dyn Method>> =
            if fixed && maxord > 1 { Some(Box::new(super::radau::Radau::new(sys, o)?)) } else { None };
        Ok(Gear {
            newton: Newton::new(sys)?,
            past: History::new(sys.n, MOST + 2),
            charges: vec![vec![0.0; sys.n]; MOST + 2],
            q1: vec![0.0; sys.n],
            r: vec![0.0; sys.n],
            t1: 0.0,
            x1: vec![0.0; sys.n],
            order: 1,
            maxord,
            spice,
            since_change: 0,
            trtol: if o.trtol.is_finite() { o.trtol } else { [LOCAL, 1.0][usize::from(spice)] },
            fixed,
            itl4: o.itl4,
            next_order: 1,
            used: 1,
            accounts: o.accounts.then(|| vec![Vec::new()]),
            starter,
        })
    }

    /// alpha_j = l_j'(t1) for the points t1, past[0..k-1].
    fn slopes(&self, k: usize) -> [f64; MOST + 1] {
        let mut t = [0.0; MOST + 1];
        t[0] = self.t1;
        t[1..=k].copy_from_slice(&self.past.t[..k]);
        let mut alpha = [0.0; MOST + 1];
        for j in 1..=k {
            let mut v = 1.0 / (t[j] - t[0]);
            for m in 1..=k {
                if m != j {
                    v *= (t[0] - t[m]) / (t[j] - t[m]);
                }
            }
            alpha[j] = v;
            alpha[0] -= v; // the slopes of a constant sum to zero
        }
        alpha
    }

    /// The newest points, `most` of them, the candidate first while there is one.
    fn points(&self, most: usize) -> ([f64; MOST + 2], [&[f64]; MOST + 2], usize) {
        let (mut ts, mut xs) = ([self.t1; MOST + 2], [self.x1.as_slice(); MOST + 2]);
        let skip = usize::from(self.past.t[0] == self.t1 && self.past.len > 1);
        let len = (self.past.len - skip).min(most - 1);
        for j in 0..len {
            (ts[j + 1], xs[j + 1]) = (self.past.t[j + skip], &self.past.x[j + skip]);
        }
        (ts, xs, len + 1)
    }

    /// Largest lte over tolerance that order k would have made, or None when too few points stand behind.
    fn error(&self, k: usize, h: f64, tol: &Tolerances) -> Option<f64> {
        if k < 1 || self.past.len < k + 1 {
            return None;
        }
        // weights of the divided difference over t1, past[0..=k]
        let mut t = [0.0; MOST + 3];
        t[0] = self.t1;
        t[1..=k + 1].copy_from_slice(&self.past.t[..=k]);
        let mut wgt = [0.0; MOST + 3];
        for j in 0..=k + 1 {
            let mut p = 1.0;
            for m in 0..=k + 1 {
                if m != j {
                    p *= t[j] - t[m];
                }
            }
            wgt[j] = 1.0 / p;
        }
        let mut c = h / (self.t1 - t[k + 1]);
        for tj in &t[1..=k + 1] {
            c *= self.t1 - tj;
        }
        let mut worst = 0.0_f64;
        for i in 0..self.x1.len() {
            if tol.in_error[i] {
                let mut dd = wgt[0] * self.x1[i];
                for j in 1..=k + 1 {
                    dd += wgt[j] * self.past.x[j - 1][i];
                }
                worst = worst.max((c * dd).abs() / tol.weight(i, self.x1[i], self.past.x[0][i]));
            }
        }
        Some(worst / self.trtol)
    }

    fn noise(&mut self, w: &mut Work, a: f64, tol: &Tolerances) -> f64 {
        self.newton.noise(w, a, &self.x1, &self.past.x[0], tol) / self.trtol
    }
}

/// Integral over the step from t0 to ts[0] of Lagrange's polynomials through ts, in units of the step: Gauss-Legendre's rule
/// of order 6, the polynomials are of degree 5 at most.
fn over_step(ts: &[f64], t0: f64) -> Vec<f64> {
    const GAUSS: [(f64, f64); 3] =
        [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
    let l = |j: usize, t: f64| -> f64 {
        (0..ts.len()).filter(|&k| k != j).map(|k| (t - ts[k]) / (ts[j] - ts[k])).product()
    };
    (0..ts.len()).map(|j| GAUSS.iter().map(|(c, b)| b * l(j, t0 + c * (ts[0] - t0))).sum()).collect()
}

fn factor(error: f64, k: usize) -> f64 {
    if error < 1e-12 {
        2.0
    } else {
        0.85 * error.powf(-1.0 / (k as f64 + 1.0))
    }
}

impl Method for Gear {
    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.past.clear();
        self.past.push(t, x);
        sys.eval(w, x, t);
        self.charges[0].copy_from_slice(&w.q);
        self.order = 1;
        self.next_order = 1;
        self.since_change = 0;
        self.x1.copy_from_slice(x);
        self.t1 = t;
        self.newton.forget();
        if let Some(s) = &mut self.starter {
            s.restart(sys, w, t, x);
        }
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        let t0 = self.past.t[0];
        self.t1 = t0 + h;
        if self.fixed && self.past.len < self.maxord {
            // fixed order k wants k starting points of at least its own order
            if let Some(s) = &mut self.starter {
                let attempt = s.attempt(sys, w, h, tol);
                self.used = self.maxord;
                self.x1.copy_from_slice(s.candidate());
                sys.eval(w, &self.x1, self.t1);
                self.q1.copy_from_slice(&w.q);
                return attempt;
            }
        }
        let k = if self.fixed { self.maxord } else { self.order.min(self.past.len) };
        self.used = k;
        let alpha = self.slopes(k);
        self.r.fill(0.0);
        for j in 1..=k {
            for i in 0..sys.n {
                self.r[i] += alpha[j] * self.charges[j - 1][i];
            }
        }
        let m = if self.fixed { k.min(2) } else { k + 1 }.min(self.past.len);
        let refs: Vec<&[f64]> = self.past.x[..m].iter().map(Vec::as_slice).collect();
        interpolate(&self.past.t[..m], &refs, self.t1, &mut self.x1);
        if let Err(why) = self.newton.solve(sys, w, alpha[0], &self.r, &mut self.x1, self.t1, tol, self.itl4) {
            self.order = 1;
            return Attempt::Stuck { next: h / 8.0, why };
        }
        self.q1.copy_from_slice(&self.newton.q);
        if self.fixed {
            return Attempt::Good { next: h };
        }
        // the first step after a start has no difference to judge by: a tenth of the tolerance's worth of movement
        let Some(error) = self.error(k, h, tol) else {
            let mut worst = 0.0_f64;
            for i in 0..sys.n {
                if tol.in_error[i] {
                    let d = 0.05 * (self.x1[i] - self.past.x[0][i]).abs();
                    worst = worst.max(d / tol.weight(i, self.x1[i], self.past.x[0][i]));
                }
            }
            let worst = worst / self.trtol;
            let worst = if worst > 1.0 { worst / self.noise(w, alpha[0], tol).max(1.0) } else { worst };
            return if worst > 1.0 {
                Attempt::TooLarge { next: h * (0.9 / worst).max(0.1) }
            } else {
                self.next_order = k;
                Attempt::Good { next: h }
            };
        };
        let error = if error > 1.0 { error / self.noise(w, alpha[0], tol).max(1.0) } else { error };
        if error > 1.0 {
            let next = h * factor(error, k).clamp(0.1, 0.8);
            if self.error(k.saturating_sub(1), h, tol).is_some_and(|e| e < error) {
                self.order = k - 1;
            }
            return Attempt::TooLarge { next };
        }
        let mut best = (factor(error, k), k);
        if self.since_change > k {
            if let Some(e) = self.error(k - 1, h, tol) {
                let f = factor(e, k - 1);
                if f > 1.05 * best.0 {
                    best = (f, k - 1);
                }
            }
            if k < self.maxord {
                if let Some(e) = self.error(k + 1, h, tol) {
                    let f = factor(e, k + 1);
                    if f > 1.05 * best.0 {
                        best = (f, k + 1);
                    }
                }
            }
        }
        self.next_order = best.1;
        let f = best.0.clamp(0.5, 2.0);
        Attempt::Good { next: if (0.9..1.2).contains(&f) { h } else { f * h } }
    }

    fn accept(&mut self, t1: f64) {
        self.t1 = t1;
        self.past.push(self.t1, &self.x1);
        let (ts, _, len) = self.points(self.used);
        if let Some(weights) = &mut self.accounts {
            weights[0] = over_step(&ts[..len.min(self.used)], self.past.t[1]);
        }
        self.charges.rotate_right(1);
        self.charges[0].copy_from_slice(&self.q1);
        if self.next_order == self.order {
            self.since_change += 1;
        } else {
            self.order = self.next_order;
            self.since_change = 0;
        }
        if let Some(s) = &mut self.starter {
            if self.past.len <= self.maxord {
                s.accept(t1);
            }
        }
    }

    /// What the polynomial lacks in the middle of the step, by one point more. The error estimate sees nothing of algebraic
    /// unknowns, which may have corners.
    fn interior(&self, sys: &System, tol: &Tolerances) -> f64 {
        let m = self.used + 1;
        let (ts, xs, len) = self.points(m + 1);
        if len <= m {
            return f64::INFINITY;
        }
        let t = 0.5 * (ts[0] + ts[1]);
        let whole: f64 = ts[..m].iter().map(|tj| t - tj).product();
        let weight = |j: usize| (0..=m).filter(|&i| i != j).map(|i| ts[j] - ts[i]).product::<f64>().recip();
        let mut weights = [0.0; MOST + 2];
        for (j, v) in weights.iter_mut().enumerate().take(m + 1) {
            *v = whole * weight(j);
        }
        let mut worst = 0.0_f64;
        for i in sys.interpolated() {
            let error: f64 = weights[..=m].iter().zip(&xs).map(|(w, x)| w * x[i]).sum();
            worst = worst.max(error.abs() / tol.weight(i, xs[0][i], xs[1][i]));
        }
        worst
    }

    fn stages(&self) -> Stages<'_> {
        let Some(weights) = &self.accounts else { return Stages::default() };
        let (ts, xs, _) = self.points(self.used);
        Stages { at: ts.into_iter().zip(xs).take(weights[0].len()).collect(), weights }
    }

    fn wants_dense_record(&self) -> bool {
        !self.spice
    }

    fn formula(&self) -> usize {
        self.used
    }

    fn response(&self, order: usize, y: f64) -> Option<Complex> {
        Some(response::bdf(order, y))
    }

    fn drift(&self, order: usize, times: &[f64], w: f64) -> Option<(f64, f64)> {
        response::bdf_drift(times.get(..=order)?, w)
    }

    fn candidate(&self) -> &[f64] {
        &self.x1
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let (ts, xs, len) = self.points(self.used + 1);
        interpolate(&ts[..len], &xs[..len], t, out);
    }
}
