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
//! off by  tau (F_0 - F_x).
//!
//! The stages spread q over the step, as currents  k_j q / h,  k = A^-1 (1, .., 1), which shifts what is quick by  k_j u,  u = -M^-1 q / h: a
//! supply's current by a tenth of an ampere. The step's sums need them; what is shown, and the point from which the run goes on, is without.
//! By these sums the others have  -h G u = gamma C u  already, all that they lose where the charge goes through a resistance (a switch
//! on a junction, ron q of the coil's flux), next to nothing of it where a coil charges the node before a diode takes over. Lost is the rest.
//!
//! What else the step is wrong by is told by the stages, F_x from all of them against that from all but the first, an estimate of lower
//! order; where the transient is short beside the step, of the charges without what has moved at once.
use super::super::{LOST_IN_LEAP, SLOW, TRANSIENT};
use super::dense;
use super::estimate::norm;
use super::tables::Scheme;
use super::Radau;
use crate::newton::Tolerances;
use crate::system::{Kind, System, Work};

/// A step of so many times a transient knows nothing of it: what the charge that moved makes of the estimate is no error either.
const LONG: f64 = 1e4;

pub struct Leap {
    begun: bool,
    jumped: bool,           // something may have, where the step begins
    pub taken: bool,        // the attempted step leaps
    pub last: bool,         // the step before did
    pub smooth: Vec<bool>,  // what is on one curve with the start of such a step
    moved: Vec<f64>,        // q
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
            moved: vec![0.0; smooth.len()],
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
    /// What part of a charge of row i, moved by itself, an implicit Euler step of h / gamma leaves there.
    fn left(&mut self, sys: &System, w: &mut Work, h: f64, i: usize) -> f64 {
        self.leap.shift.fill(0.0);
        self.leap.shift[i] = 1.0;
        self.real.solve(&mut self.leap.shift);
        w.counters.solves += 1;
        sys.c_times(w, &self.leap.shift, &mut self.scratch);
        (self.scheme.gamma / h * self.scratch[i]).abs()
    }

    /// The error estimate of a step that leaps, in units of the tolerance; None where it does not. `b` is F_x.
    pub(super) fn leap(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Option<f64> {
        (self.leap.taken, self.leap.brief) = (false, None);
        if !self.leap.jumped {
            return None;
        }
        let scheme = self.scheme;
        let (back, last, gamma) = (dense::back(scheme), scheme.s - 1, scheme.gamma);
        let at_start = |of: &[Vec<f64>], i: usize| back.iter().zip(of).map(|(l, v)| l * v[i]).sum::<f64>();
        for i in 0..sys.n {
            let (x0, x1) = (self.x0[i], self.stage[last][i]);
            let more = if sys.has_q[i] { self.b[i] - self.f0[i] } else { 0.0 };
            let off = (x0 - at_start(&self.stage, i)).abs();
            self.leap.smooth[i] = self.corrected[i] && off <= tol.weight(i, x0, x1);
            let moved = at_start(&self.d, i);
            let fast = !self.leap.smooth[i] && h * more.abs() > TRANSIENT * moved.abs();
            self.e[i] = more;
            self.leap.moved[i] = if fast { moved } else { 0.0 };
        }
        if self.leap.moved.iter().all(|moved| *moved == 0.0) {
            return None;
        }
        sys.eval(w, &self.stage[last], self.t0 + h);
        for i in 0..sys.n {
            let node = sys.unknowns[i].kind == Kind::Node;
            if self.leap.moved[i] != 0.0 && !node && self.left(sys, w, h, i) > SLOW {
                self.leap.moved[i] = 0.0;
                self.leap.smooth[i] = self.corrected[i];
            }
        }
        self.leap.shift.iter_mut().zip(&self.leap.moved).for_each(|(s, moved)| *s = -moved / h);
        self.real.solve(&mut self.leap.shift);
        sys.c_times(w, &self.leap.shift, &mut self.scratch);
        let long = |(moved, more): (&f64, &f64)| if *more == 0.0 { 0.0 } else { (moved / more).abs() };
        let tau = self.leap.moved.iter().zip(&self.e).map(long).fold(0.0, f64::max);
        if tau == 0.0 {
            return None;
        }
        self.leap.taken = true;
        // what the others lose, less what they have of it by the charge that the stages spread
        for ((e, moved), c) in self.e.iter_mut().zip(&mut self.leap.moved).zip(&self.scratch) {
            *e = if *moved == 0.0 { (tau * *e - gamma * c) * gamma / h } else { 0.0 };
            *moved += if *moved == 0.0 { gamma * c } else { 0.0 };
        }
        self.real.solve(&mut self.e);
        let lost = norm(&self.e, &self.x0, &self.stage[last], tol);
        if lost > LOST_IN_LEAP {
            self.leap.brief = Some(tau);
        }
        // F_x of all stages less that of all but the first, in the charges; of those that moved long before the end, from where they went
        let jump = f64::from(u8::from(h > LONG * tau));
        let c = scheme.c;
        let lagrange = |j: usize| (1..=last).filter(|&k| k != j).map(|k| c[k] / (c[k] - c[j])).product::<f64>();
        self.e.fill(0.0);
        for (k, d) in self.d.iter().enumerate().take(scheme.s) {
            let without: f64 = (1..=last).map(|j| lagrange(j) * scheme.inverse_a[j * scheme.s + k]).sum();
            let weight = (scheme.d[k] + without) / h;
            let behind = d.iter().zip(&self.leap.moved);
            self.e.iter_mut().zip(behind).for_each(|(e, (d, moved))| *e += weight * (d - jump * moved));
        }
        (0..sys.n).filter(|&i| !sys.has_q[i]).for_each(|i| self.e[i] = 0.0);
        self.real.solve(&mut self.e);
        // what the transient leaves of it is damped
        sys.c_times(w, &self.e, &mut self.scratch);
        self.scratch.iter_mut().for_each(|e| *e *= gamma / h);
        self.real.solve(&mut self.scratch);
        w.counters.solves += 4;
        let smooth = norm(&self.scratch, &self.x0, &self.stage[last], tol);
        self.e.fill(0.0);
        Some(smooth)
    }
}
