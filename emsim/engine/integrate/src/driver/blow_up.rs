//! A solution that leaves for infinity within the run. Towards a pole every step is shorter and every value larger than the one
//! before, until time has no finer division; what a method or another one finds beyond it is some other solution of its stage
//! equations, under a tolerance as large as the values have become.

use super::super::rows::Sink;
use super::super::Method;
use super::{Failed, Run, Status};
use crate::multiversion::{by_lanes, side_by_side, Lanes, One};
use crate::newton::{Failure, Tolerances};
use crate::rounding::SAME;

/// No quantity of a deck is larger; a solution on its way to infinity ends here, before it is NaN.
const LARGEST: f64 = 1e100;
/// Steps, each shorter than this part of the run, in which an unknown was larger by so much than it had ever been; between them only
/// such in which it was larger by less, which a rounded time may have made too short.
const CLIMBS: u32 = 8;
const MORE: f64 = 1.05;

#[derive(Default)]
pub struct BlowUp {
    climbs: u32,
    unknown: usize,
    rate: f64, // of the last climb, in parts of what it was, by part of the run
}

impl BlowUp {
    /// An accepted step ended at x; `part` of the run was its length, tol knows the largest values until then. What does not stand
    /// under d/dt may jump at a corner. What is small beside others of its kind is on its way from a start at rest.
    #[inline]
    pub fn step(&mut self, x: &[f64], tol: &Tolerances, under_ddt: &[bool], part: f64) {
        let counts = |k: usize| under_ddt[k] && tol.peak[k] > 0.0 && x[k].abs() >= tol.largest_like(k);
        let higher = |by: f64| (0..x.len()).find(|&k| x[k].abs() > by * tol.peak[k] && counts(k));
        let short = part < SAME;
        let rate = |k: usize| (x[k].abs() / tol.peak[k] - 1.0) / part;
        match short.then(|| higher(MORE)).flatten() {
            Some(k) if rate(k) < self.rate => {} // (towards a pole it grows, from a start at rest it falls)
            Some(k) => (self.climbs, self.unknown, self.rate) = (self.climbs + 1, k, rate(k)),
            None if self.climbs > 0 && short && higher(1.0).is_some() => {}
            None => (self.climbs, self.rate) = (0, 0.0),
        }
    }

    /// The unknown that is on its way, where the next step can be no shorter.
    pub fn unknown(&self) -> Option<usize> {
        (self.climbs >= CLIMBS).then_some(self.unknown)
    }
}

/// The first value that has gone.
pub fn gone(x: &[f64]) -> Option<usize> {
    // all at once first: hardly ever is there one
    (largest(x) > LARGEST).then(|| x.iter().position(|v| v.abs() > LARGEST)).flatten()
}

by_lanes! {
    fn largest<L>(x: &[f64]) -> f64 {
        if x.len() < L::COUNT { largest_of::<One>(x) } else { largest_of::<L>(x) }
    }
}

#[inline(always)]
fn largest_of<L: Lanes>(x: &[f64]) -> f64 {
    let mut worst = L::all(0.0);
    for (_, [x]) in side_by_side::<L, 1>(x.len(), [x]) {
        worst = x.abs().larger(worst);
    }
    worst.largest()
}

impl<S: Sink> Run<'_, S> {
    #[cold]
    #[inline(never)]
    pub(super) fn tried(&self, step: f64, method: &dyn Method) -> [String; 2] {
        let by = method.used().last().map_or(self.o.method.clone(), |u| u.method.clone());
        [format!("shorter steps, down to {step:.2e} s"), format!("method {by}")]
    }

    #[cold]
    #[inline(never)]
    pub(super) fn runs_away(&mut self, step: f64, unknown: usize, method: &dyn Method) {
        self.fail(step, Failure::NotFinite { unknown }, self.tried(step, method).into());
    }

    /// Flags set each other off without an end: there are no values that all of them agree with.
    #[cold]
    #[inline(never)]
    pub(super) fn contradicts(&mut self, h: f64) {
        let mut roots = vec![0.0; self.sys.flags.len()];
        self.sys.eval_all_roots(self.w, &self.x, self.t, &mut roots);
        let flag = roots.iter().position(|&r| r > 0.0).or(self.outcome.events.last().map(|e| e.1)).unwrap_or(0);
        self.fail(h, Failure::Contradiction { flag }, vec![]);
    }

    #[cold]
    #[inline(never)]
    pub(super) fn fail(&mut self, h: f64, why: Failure, tried: Vec<String>) {
        self.outcome.status = Status::Failed;
        self.outcome.failed = Some(Failed { t: self.t, h, during: "transient", why, tried });
    }
}
