//! What a first step loses by leaping over a transient.
//!
//! The charge q of a node goes to where it belongs at the end of the transient, whose duration is that of the charge at the current
//! that the node had too much at the start:  tau = q / |F_0 - F_s|.  All other rows have had, so long, the current at the start instead
//! of the one that the stages know: their charges are off by  tau (F_0 - F_s),  half of it where the node moves evenly
//! (a coil that charges a junction), all of it where it settles exponentially. (Of a buck converter at 1e-5 the coil's current was off
//! by 1.4e-4 of its range without this.)
//!
//! q is what the error estimate was made of: d annihilates what is smooth, and of a charge that moves at once
//! it leaves  q d.A^-1 1 / h.
use super::{Dirk, FIRST, NEXT, TRANSIENT};
use crate::integrate::Method;
use crate::newton::Tolerances;
use crate::system::{System, Work};

/// Where a leap was refused, first steps are short from then on: one that follows a transient is not asked for longer ones. What was too
/// much at the start of a run, beside small currents, may be little later: after so many restarts the leap is tried again, after nearly
/// twice as many where it is refused again. Odd numbers: of edges that alternate both have their turn.
#[derive(Default)]
pub struct Again {
    leap: f64, // length that was refused
    wait: u32,
    restarts: u32, // since then
}

const AT_FIRST: u32 = 3;
const RAREST: u32 = 65;
/// A first step of so little of the leap follows the transient.
const FOLLOWS: f64 = 0.1;

impl Again {
    pub fn refused(&mut self, leap: f64) {
        self.wait = if self.wait == 0 { AT_FIRST } else { (2 * self.wait - 1).min(RAREST) };
        (self.leap, self.restarts) = (leap, 0);
    }

    /// Length of the next first step.
    pub fn length(&mut self, known: f64) -> f64 {
        self.restarts += 1;
        let due = self.wait > 0 && self.restarts >= self.wait && known < FOLLOWS * self.leap;
        if due {
            self.restarts = 0;
            return self.leap;
        }
        known
    }
}

impl Dirk {
    /// Has the first stage of a first step leapt over a transient? It is an implicit Euler step: a current at the start that would
    /// have moved far more charge by then than has moved is gone.
    pub(super) fn leaps(&self, h: f64, tol: &Tolerances) -> bool {
        let (x0, x1, h) = (&self.now.x[0], &self.now.x[1], h * self.k[FIRST].k.c[1]);
        let fast = |(i, (q1, q0)): (usize, (&f64, &f64))| {
            h * self.f[0][i].abs() > TRANSIENT * (q1 - q0).abs() && (x1[i] - x0[i]).abs() > tol.weight(i, x1[i], x0[i])
        };
        self.newton.q().iter().zip(&self.q0).enumerate().any(fast)
    }

    /// First guess of the first stage of a step that knows its start, by the line through the start and that implicit Euler step.
    pub(super) fn continue_to_first_stage(&self, guess: &mut [f64]) {
        let by = self.k[NEXT].k.c[1] / self.k[FIRST].k.c[1];
        for (g, (x0, x1)) in guess.iter_mut().zip(self.now.x[0].iter().zip(&self.now.x[1])) {
            *g = x0 + by * (x1 - x0);
        }
    }

    /// The time that must not be leapt over, if what is lost by it is more than the tolerance.
    pub(super) fn leap(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Option<f64> {
        if self.now.by != FIRST {
            return None;
        }
        let last = self.now.x.len() - 1;
        let (k, at_once) = (&self.k[FIRST].k, self.k[FIRST].at_once);
        let (x1, x0, q1) = (&self.now.x[last], &self.now.x[0], self.newton.q());
        let mut tau = 0.0_f64;
        for i in 0..sys.n {
            let more = self.f[0][i] - self.f[last][i];
            let fast = h * self.f[0][i].abs() > TRANSIENT * (q1[i] - self.q0[i]).abs();
            if fast && (x1[i] - x0[i]).abs() > tol.weight(i, x1[i], x0[i]) {
                tau = tau.max(h * self.fast[i].abs() / (at_once * more.abs()));
            }
            self.e[i] = if fast { 0.0 } else { more };
        }
        if tau == 0.0 {
            return None;
        }
        let (scale, local) = (tau / (h * k.a[0][1]), k.local);
        self.e.iter_mut().for_each(|e| *e *= scale);
        self.newton.solve_held(w, &mut self.e);
        let lost = tol.largest_error(&self.e, self.candidate(), &self.now.x[0]) / local;
        (lost > 1.0).then_some(tau)
    }
}
