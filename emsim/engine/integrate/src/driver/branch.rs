//! A loop that could go on in two ways (a change point, where links lie in one line) and a step that goes over to the other one.
//! Positions and speeds are continuous between corners and events; on the other way the speeds are others, at once, and Newton's
//! method may come back from the singular pose by some turns:
//!
//!   |u(t + h) - u(t)|  or  |q(t + h) - q(t)|  stays,  however short the step is.
//!
//! So a step whose speeds change by a good part, and much faster than before, or whose coordinates go farther than speeds can take
//! them, is refused and tried again with a shorter one, whose start is nearer to the way that the loop is on. What moves smoothly
//! changes the less, the shorter the step.
use super::super::rows::Sink;
use super::super::Method;
use super::Run;
use crate::newton::{Failure, Tolerances};
use crate::op::couples;
use crate::system::{Kind, System};

/// Speeds change by more than this part of the largest of their kind, ...
const PART: f64 = 0.03;
/// ... so many times as fast as in the step before.
const FASTER: f64 = 10.0;
/// A coordinate goes so many times as far as at the largest speed that there was.
const FARTHER: f64 = 3.0;
/// So many such steps on end are tried; each next one has this part of the length.
const TRIED: u32 = 40;
const SHORTER: f64 = 0.3;
/// ... and every so many times the method starts anew.
const ANEW: u32 = 3;

pub struct Branch {
    kinds: Vec<Like>,
    before: Option<f64>, // largest change a second in the step before, by parts of the largest speed
    refused: u32,
}

/// Speeds of one unit, and the coordinates that move with them.
struct Like {
    speeds: Vec<usize>,
    places: Vec<usize>,
    largest: f64, // speed so far
}

impl Like {
    fn fastest(&self, x: &[f64]) -> f64 {
        self.speeds.iter().map(|&k| x[k].abs()).fold(0.0, f64::max)
    }
}

impl Branch {
    /// None without closed loops.
    pub fn new(sys: &System) -> Option<Branch> {
        let of = |kind: Kind| (0..sys.n).filter(move |&k| sys.unknowns[k].kind == kind);
        of(Kind::Lambda).next()?;
        let mut kinds: Vec<Like> = Vec::new();
        let mut all = couples(sys);
        all.dedup_by_key(|c| c.1); // of a quaternion's four coordinates the first one of each speed
        for (place, speed) in all {
            let unit = &sys.unknowns[speed].unit;
            let k = kinds.iter().position(|like| sys.unknowns[like.speeds[0]].unit == *unit).unwrap_or(kinds.len());
            if k == kinds.len() {
                kinds.push(Like { speeds: Vec::new(), places: Vec::new(), largest: 0.0 });
            }
            kinds[k].speeds.push(speed);
            kinds[k].places.push(place);
        }
        Some(Branch { kinds, before: None, refused: 0 })
    }

    /// Behind a corner or an event speeds may change as they like.
    pub fn begin(&mut self) {
        self.before = None;
    }

    /// Does a step of length h from x to y go over to the other way? The speed that changes most, then.
    fn leaves(&mut self, x: &[f64], y: &[f64], h: f64, tol: &Tolerances) -> Option<usize> {
        let (mut part, mut worst) = (0.0_f64, 0);
        for like in &self.kinds {
            let largest = like.fastest(x).max(like.fastest(y));
            for &k in &like.speeds {
                let change = (y[k] - x[k]).abs();
                // what stands still has speeds of rounding
                if change > part * largest && change > tol.weight(k, x[k], y[k]) {
                    (part, worst) = (change / largest, k);
                }
            }
            let far = FARTHER * h * like.largest.max(largest);
            if let Some(&k) = like.places.iter().find(|&&k| (y[k] - x[k]).abs() > far + tol.weight(k, x[k], y[k])) {
                return Some(k);
            }
        }
        let fast = self.before.is_some_and(|before| part > FASTER * before * h);
        if part > PART && fast {
            return Some(worst);
        }
        self.before = Some(part / h);
        self.kinds.iter_mut().for_each(|like| like.largest = like.largest.max(like.fastest(y)));
        None
    }
}

impl<S: Sink> Run<'_, S> {
    /// The attempted step is one to the other way: the length to try, unless the run has ended here.
    pub(super) fn leaves_branch(&mut self, method: &mut dyn Method, step: f64, smallest: f64) -> Option<Option<f64>> {
        let branch = self.branch.as_mut()?;
        let Some(unknown) = branch.leaves(&self.x, method.candidate(), step, &self.tol) else {
            branch.refused = 0;
            return None;
        };
        branch.refused += 1;
        self.w.counters.rejected += 1;
        if branch.refused < TRIED && SHORTER * step > smallest {
            if branch.refused % ANEW == 0 {
                // what the method keeps from attempt to attempt (a matrix) may be that of the other way
                method.restart(self.sys, self.w, self.t, &self.x);
            }
            return Some(Some(SHORTER * step));
        }
        let failure = Failure::LeavesBranch { unknown };
        self.fail(step, failure, self.tried(step, method).into());
        Some(None)
    }
}
