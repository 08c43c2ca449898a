//! A solution that leaves for infinity within the run. Towards a pole every step is shorter and every value larger than the one
//! before, until time has no finer division; what a method or another one finds beyond it is some other solution of its stage
//! equations, under a tolerance as large as the values have become.

use super::super::rows::Sink;
use super::super::Method;
use super::{Failed, Run, Status};
use crate::newton::Failure;

/// No quantity of a deck is larger; a solution on its way to infinity ends here, before it is NaN.
const LARGEST: f64 = 1e100;
/// Steps in a row, each shorter than this part of the run, in which an unknown was larger by so much than it had ever been.
const CLIMBS: u32 = 8;
const SHORT: f64 = 1e-9;
const MORE: f64 = 1.05;

#[derive(Default)]
pub struct Escape {
    climbs: u32,
    unknown: usize,
}

impl Escape {
    /// An accepted step ended at x; `part` of the run was its length, `peak` the largest values until then.
    #[inline]
    pub fn step(&mut self, x: &[f64], peak: &[f64], part: f64) {
        let higher = |(v, p): (&f64, &f64)| *p > 0.0 && v.abs() > MORE * p;
        match (part < SHORT).then(|| x.iter().zip(peak).position(higher)).flatten() {
            Some(unknown) => (self.climbs, self.unknown) = (self.climbs + 1, unknown),
            None => self.climbs = 0,
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
    let too_large = |v: &f64| v.abs() > LARGEST;
    let any = x.iter().map(|v| u64::from(too_large(v))).sum::<u64>() > 0;
    any.then(|| x.iter().position(too_large)).flatten()
}

impl<S: Sink> Run<'_, S> {
    pub(super) fn tried(&self, step: f64, method: &dyn Method) -> [String; 2] {
        let by = method.used().last().map_or(self.o.method.clone(), |u| u.method.clone());
        [format!("shorter steps, down to {step:.2e} s"), format!("method {by}")]
    }

    pub(super) fn runs_away(&mut self, step: f64, unknown: usize, method: &dyn Method) {
        self.fail(step, Failure::NotFinite { unknown }, self.tried(step, method).into());
    }

    pub(super) fn fail(&mut self, h: f64, why: Failure, tried: Vec<String>) {
        self.outcome.status = Status::Failed;
        self.outcome.failed = Some(Failed { t: self.t, h, during: "transient", why, tried });
    }
}
