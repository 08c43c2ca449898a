//! First steps that leap over a transient.
//!
//! A switch has closed on a junction's capacitance: F_0 is that of what will be over within nanoseconds, all stages are behind it. The
//! error estimate takes the difference of F_0 from what the stages say of the start, F_x, for one of the whole step: of a coil's
//! flux, tens of volts over that step, so that steps had to follow the transient at every tolerance (a synchronous buck converter at
//! 1e-4: 3500 iterations, and an error of 1e-14). Where a node jumps and its charge
//!
//!   q = sum_i l_i(0) D_i
//!
//! would have moved in a small part of the step, in  tau = q / |F_0 - F_x|,  that difference lasts for tau: the others' charges are
//! off by  tau (F_0 - F_x).  What else the step is wrong by is told by the stages, F_x from all of them against that from
//! all but the first, an estimate of lower order.
//!
//! The stages spread q over the step, as currents  k_j q / h,  k = A^-1 (1, .., 1), which shifts what is quick by  k_j u,  u = M^-1 q / h: a
//! supply's current by a tenth of an ampere. The step's sums need them; what is shown, and the point from which the run goes on, is without.
use super::super::{LOST_IN_LEAP, TRANSIENT};
use super::dense;
use super::estimate::norm;
use super::tables::Scheme;
use super::Radau;
use crate::newton::Tolerances;
use crate::system::{System, Work};

pub struct Leap {
    begun: bool,
    jumped: bool,           // something may have, where the step begins
    pub taken: bool,        // the attempted step leaps
    pub last: bool,         // the step before did
    pub smooth: Vec<bool>,  // what is on one curve with the start of such a step
    pub shift: Vec<f64>,    // u
    pub brief: Option<f64>, // what the attempted step must not leap over [s]
}

impl Leap {
    pub fn new(smooth: &[bool]) -> Leap {
        Leap {
            begun: false,
            jumped: false,
            taken: false,
            last: false,
            smooth: smooth.to_vec(),
            shift: vec![0.0; smooth.len()],
            brief: None,
        }
    }

    /// A run begins in balance.
    pub fn restart(&mut self) {
        self.jumped = std::mem::replace(&mut self.begun, true);
        (self.taken, self.last) = (false, false);
    }

    /// Takes from x what the charge of the transient shifts it by, at theta.
    pub fn unspread(&self, scheme: &Scheme, theta: f64, x: &mut [f64]) {
        let k = spread(scheme, theta);
        for (x, (shift, smooth)) in x.iter_mut().zip(self.shift.iter().zip(&self.smooth)) {
            *x -= if *smooth { 0.0 } else { k * shift };
        }
    }

    pub fn accept(&mut self) {
        self.last = std::mem::take(&mut self.taken);
        self.jumped = false;
    }
}

/// k at theta, by the polynomial through the stages.
fn spread(scheme: &Scheme, theta: f64) -> f64 {
    let s = scheme.s;
    let k = |j: usize| scheme.inverse_a[j * s..(j + 1) * s].iter().sum::<f64>();
    dense::inside(scheme, theta)[..s].iter().enumerate().map(|(j, l)| l * k(j)).sum()
}

impl Radau {
    /// The error estimate of a step that leaps, in units of the tolerance; None where it does not. `b` is F_x.
    pub(super) fn leap(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Option<f64> {
        (self.leap.taken, self.leap.brief) = (false, None);
        if !self.leap.jumped {
            return None;
        }
        let scheme = self.scheme;
        let (back, last, gamma) = (dense::back(scheme), scheme.s - 1, scheme.gamma);
        let at_start = |of: &[Vec<f64>], i: usize| back.iter().zip(of).map(|(l, v)| l * v[i]).sum::<f64>();
        let mut tau = 0.0_f64;
        for i in 0..sys.n {
            let (x0, x1) = (self.x0[i], self.stage[last][i]);
            let more = if sys.has_q[i] { self.b[i] - self.f0[i] } else { 0.0 };
            self.leap.smooth[i] = self.corrected[i] && (x0 - at_start(&self.stage, i)).abs() <= tol.weight(i, x0, x1);
            let moved = at_start(&self.d, i);
            let fast = !self.leap.smooth[i] && h * more.abs() > TRANSIENT * moved.abs();
            if fast && more != 0.0 {
                tau = tau.max((moved / more).abs());
            }
            self.e[i] = if fast { 0.0 } else { more };
            self.leap.shift[i] = if fast { -moved / h } else { 0.0 };
        }
        if tau == 0.0 {
            return None;
        }
        self.leap.taken = true;
        self.e.iter_mut().for_each(|e| *e *= tau * gamma / h);
        self.real.solve(&mut self.e);
        let lost = norm(&self.e, &self.x0, &self.stage[last], tol);
        if lost > LOST_IN_LEAP {
            self.leap.brief = Some(tau);
        }
        // F_x of all stages less that of all but the first, in the charges
        let c = scheme.c;
        let lagrange = |j: usize| (1..=last).filter(|&k| k != j).map(|k| c[k] / (c[k] - c[j])).product::<f64>();
        self.e.fill(0.0);
        for (k, d) in self.d.iter().enumerate().take(scheme.s) {
            let without: f64 = (1..=last).map(|j| lagrange(j) * scheme.inverse_a[j * scheme.s + k]).sum();
            let weight = (scheme.d[k] + without) / h;
            self.e.iter_mut().zip(d).for_each(|(e, d)| *e += weight * d);
        }
        (0..sys.n).filter(|&i| !sys.has_q[i]).for_each(|i| self.e[i] = 0.0);
        self.real.solve(&mut self.e);
        // what the transient leaves of it is damped
        sys.eval(w, &self.stage[last], self.t0 + h);
        sys.c_times(w, &self.e, &mut self.scratch);
        self.scratch.iter_mut().for_each(|e| *e *= gamma / h);
        self.real.solve(&mut self.scratch);
        self.real.solve(&mut self.leap.shift);
        w.counters.solves += 4;
        let smooth = norm(&self.scratch, &self.x0, &self.stage[last], tol);
        self.e.fill(0.0);
        Some(smooth)
    }
}
