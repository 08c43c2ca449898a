//! What a first step loses by leaping over a transient.
//!
//! The charge q of a node goes to where it belongs at the end of the transient, whose duration is that of the charge at the current
//! that the node had too much at the start:  tau = q / |F_0 - F_s|.  All other rows have had, so long, the current at the start instead
//! of the one that the stages know: their charges are off by  tau (F_0 - F_s),  half of it where the node moves evenly
//! (a coil that charges a junction), all of it where it settles exponentially. (Of a buck converter at 1e-5 the coil's current was off
//! by 1.4e-4 of its range without this.)
//!
//! q is what the error estimate was made of: d annihilates what is smooth, and of a charge that moves at once
//! it leaves  q d.k / h,  k = A^-1 (1, .., 1).
//!
//! The stages spread q over the step, as currents  k_j q / h,  which shifts what is quick by  k_j u,  u = -(G + a C)^-1 q / h: the current of a
//! supply by half an ampere. The sums of the step need them; what is shown, and the point from which the run goes on, is without.
//! By these sums the others have  -h G u = C u / a_11  of what they lose already: all of it where the charge goes through a resistance
//! (a switch on a junction), nothing where a coil charges the node. Lost is the rest.
use super::{Dirk, FIRST, NEXT};
use crate::newton::Tolerances;
use crate::system::{Kind, System, Work};
use crate::Method;

/// What a leap may lose at an edge, in parts of the tolerance. Edges of a period lose with opposite signs, so that a mean is wrong by what
/// they lose of a period's swing; that may be a tenth of the mean.
const LOST_IN_LEAP: f64 = 0.3;
/// A current at the start of a step that would have moved so many times the charge that moved is over long before the step's end.
const TRANSIENT: f64 = 10.0;
/// A row that would keep so much of its charge over a step is not quick: a coil loses by a leap, though its voltage is over at once.
const SLOW: f64 = 0.5;

/// A transient at the start of the attempted step.
pub(super) struct Skip {
    pub taken: bool,                // the step does not follow it
    pub calm: [(f64, Vec<f64>); 2], // times and states in the step that know nothing of it
    pub weights: Vec<Vec<f64>>,     // of those
    pub fast: Vec<f64>,             // per unit of step, charges that the estimate is made of
    pub brief: Option<f64>,         // what the step must not leap over [s]
    pub shift: Vec<f64>,            // what the transient's charge does to the unknowns
    pub quick: Vec<bool>,           // those that follow it
}

impl Skip {
    pub fn new(n: usize) -> Skip {
        let v = || vec![0.0; n];
        Skip {
            taken: false,
            calm: [(0.0, v()), (0.0, v())],
            weights: vec![vec![0.75, 0.25]],
            fast: v(),
            brief: None,
            shift: v(),
            quick: vec![false; n],
        }
    }
}

impl Dirk {
    /// Has the first stage of a first step leapt over a transient? It is an implicit Euler step: a current at the start that would
    /// have moved far more charge by then than has moved is gone.
    pub(super) fn leaps_over(&self, h: f64, tol: &Tolerances) -> bool {
        let h = h * self.k[FIRST].k.c[1];
        (0..self.q0.len()).any(|i| self.is_over(i, h) && self.now.moves(i, 1, tol))
    }

    /// Would the current at the start have moved far more charge of row i in h than has moved, up to the stage just solved?
    pub(super) fn is_over(&self, i: usize, h: f64) -> bool {
        h * self.f[0][i].abs() > TRANSIENT * (self.newton.q()[i] - self.q0[i]).abs()
    }

    /// First guess of the first stage of a step that knows its start, by the line through the start and that implicit Euler step.
    pub(super) fn continue_to_first_stage(&self, guess: &mut [f64]) {
        let by = self.k[NEXT].k.c[1] / self.k[FIRST].k.c[1];
        for (g, (x0, x1)) in guess.iter_mut().zip(self.now.x[0].iter().zip(&self.now.x[1])) {
            *g = x0 + by * (x1 - x0);
        }
    }

    /// Takes from x what a step's charges that moved at once shift it by, where the stages are weighed so.
    pub(super) fn unspread(&self, weights: impl Iterator<Item = f64>, x: &mut [f64]) {
        let k: f64 = weights.zip(&self.k[FIRST].spread).map(|(w, k)| w * k).sum();
        for (x, (shift, quick)) in x.iter_mut().zip(self.skip.shift.iter().zip(&self.skip.quick)) {
            *x -= if *quick { k * shift } else { 0.0 };
        }
    }

    /// Error of dense output in a first step, for which there is no step before to be compared with: what it is off the
    /// stages behind the jump, where it is no curve through all of them. Not where the jump kicks coils, by megavolts
    /// that last for picoseconds: what each of them has behind that hangs on the way there, and the shorter the step
    /// the more it knows of it.
    pub(super) fn interior_of_first(&self, sys: &System, tol: &Tolerances) -> f64 {
        let (of, x) = (&self.k[self.now.by], &self.now.x);
        let kicked = |i: usize| self.skip.quick[i] && sys.differential[i] && sys.unknowns[i].kind == Kind::Branch;
        if self.now.by != FIRST || of.k.dense[0].len() > of.through.len() || (0..sys.n).any(kicked) {
            return f64::INFINITY;
        }
        let last = x.len() - 1;
        let mut worst = 0.0_f64;
        for (j, weights) in (1..).zip(&of.through) {
            let spread = weights.iter().zip(&of.spread).map(|(w, k)| w * k).sum::<f64>() - of.spread[j];
            for i in sys.interpolated() {
                let curve = weights.iter().zip(x).map(|(w, x)| w * x[i]).sum::<f64>();
                let shift = if self.skip.quick[i] { spread * self.skip.shift[i] } else { 0.0 };
                let off = (x[j][i] - curve + shift).abs();
                worst = worst.max(off / tol.weight(i, x[last][i], x[j][i]));
            }
        }
        worst
    }

    /// What part of a charge of row i, moved by itself, an implicit Euler step of a stage's length leaves there.
    fn left(&mut self, sys: &System, w: &mut Work, a: f64, i: usize) -> f64 {
        self.skip.shift.fill(0.0);
        self.skip.shift[i] = 1.0;
        self.newton.solve_held(w, &mut self.skip.shift);
        sys.c_times(w, &self.skip.shift, &mut self.r);
        (a * self.r[i]).abs()
    }

    /// The time that must not be leapt over, if what is lost by it is more than the tolerance.
    pub(super) fn skipped_transient(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Option<f64> {
        if self.now.by != FIRST {
            return None;
        }
        let last = self.now.x.len() - 1;
        let (gamma, at_once) = (1.0 / self.k[FIRST].k.a[0][1], self.k[FIRST].at_once);
        for i in 0..sys.n {
            let over = self.is_over(i, h);
            let given = sys.unknowns[i].kind == Kind::Node || !self.now.moves(i, last, tol);
            self.skip.quick[i] = over && (given || self.left(sys, w, gamma / h, i) < SLOW);
        }
        let mut tau = 0.0_f64;
        for i in 0..sys.n {
            let (more, fast) = (self.f[0][i] - self.f[last][i], self.skip.quick[i]);
            if fast && self.now.moves(i, last, tol) {
                tau = tau.max(h * (self.skip.fast[i] / (at_once * more)).abs());
            }
            self.e[i] = if fast { 0.0 } else { more };
            self.skip.quick[i] = fast || !sys.differential[i];
            self.skip.shift[i] = if fast { self.skip.fast[i] / at_once } else { 0.0 };
        }
        if tau == 0.0 {
            self.skip.shift.fill(0.0);
            return None;
        }
        self.newton.solve_held(w, &mut self.skip.shift);
        // what the others lose, less what they have of it by the charge that the stages spread
        sys.c_times(w, &self.skip.shift, &mut self.r);
        for (e, known) in self.e.iter_mut().zip(&self.r) {
            *e = if *e == 0.0 { 0.0 } else { (tau * *e + gamma * known) * gamma / h };
        }
        self.newton.solve_held(w, &mut self.e);
        let lost = tol.largest_error(&self.e, self.candidate(), &self.now.x[0]);
        (lost > LOST_IN_LEAP).then_some(tau)
    }

    /// The charges from which the run goes on behind a leap: of what moved at once those of the unknowns, not what the stages have spread
    /// of them as well. They differ by charge that the others' sums are to know of as it would have flowed, the last of it, in a next
    /// step. (A converter's next steps would be femtoseconds.)
    pub(super) fn settle(&mut self, sys: &System, w: &mut Work, tol: &Tolerances) {
        let a = 1.0 / (self.k[FIRST].k.a[0][1] * self.last.h);
        let end = self.last.x.len() - 1;
        let moves = |i: usize| self.skip.quick[i] && sys.has_q[i] && self.last.moves(i, end, tol);
        for i in 0..sys.n {
            self.e[i] = if moves(i) { w.q[i] - self.q0[i] } else { 0.0 };
        }
        self.newton.solve_held(w, &mut self.e);
        sys.c_times(w, &self.e, &mut self.r);
        for i in 0..sys.n {
            self.q0[i] = if moves(i) { w.q[i] } else { self.q0[i] - a * self.r[i] };
        }
    }
}
