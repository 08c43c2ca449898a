//! A loop that could go on in two ways (a change point, where links lie in one line) and a step that goes over to the other one.
//! Momenta and speeds are continuous between corners and events; on the other way the speeds are others, at once:
//!
//!   |u(t + h) - u(t)|  stays,  however short the step is.
//!
//! So a step whose speeds change by a good part, and much faster than before, is refused and tried again with a shorter one, whose
//! start is nearer to the way that the loop is on. What moves smoothly changes the less, the shorter the step.
use super::super::rows::Sink;
use super::super::Method;
use super::Run;
use crate::newton::Failure;
use crate::system::{Kind, System};

/// Speeds change by more than this part of the largest of their kind, ...
const PART: f64 = 0.03;
/// ... so many times as fast as in the step before.
const FASTER: f64 = 10.0;
/// So many such steps on end are tried; each next one has this part of the length.
const TRIED: u32 = 40;
const SHORTER: f64 = 0.3;

pub struct Branch {
    speeds: Vec<Vec<usize>>, // of one unit each
    before: Option<f64>,     // largest change a second in the step before, by parts of the largest speed
    refused: u32,
}

impl Branch {
    /// None without closed loops.
    pub fn new(sys: &System) -> Option<Branch> {
        let of = |kind: Kind| (0..sys.n).filter(move |&k| sys.unknowns[k].kind == kind);
        of(Kind::Lambda).next()?;
        let mut speeds: Vec<Vec<usize>> = Vec::new();
        for k in of(Kind::Speed) {
            match speeds.iter_mut().find(|like| sys.unknowns[like[0]].unit == sys.unknowns[k].unit) {
                Some(like) => like.push(k),
                None => speeds.push(vec![k]),
            }
        }
        Some(Branch { speeds, before: None, refused: 0 })
    }

    /// Behind a corner or an event speeds may change as they like.
    pub fn begin(&mut self) {
        self.before = None;
    }

    /// Does a step of length h from x to y go over to the other way? The speed that changes most, then.
    fn leaves(&mut self, x: &[f64], y: &[f64], h: f64) -> Option<usize> {
        let (mut part, mut worst) = (0.0_f64, 0);
        for like in &self.speeds {
            let largest = like.iter().map(|&k| x[k].abs().max(y[k].abs())).fold(0.0, f64::max);
            for &k in like {
                if largest > 0.0 && (y[k] - x[k]).abs() > part * largest {
                    (part, worst) = ((y[k] - x[k]).abs() / largest, k);
                }
            }
        }
        let fast = self.before.is_some_and(|before| part > FASTER * before * h);
        if part > PART && fast {
            return Some(worst);
        }
        self.before = Some(part / h);
        None
    }
}

impl<S: Sink> Run<'_, S> {
    /// The attempted step is one to the other way: the length to try, unless the run has ended here.
    pub(super) fn leaves_branch(&mut self, method: &dyn Method, step: f64, smallest: f64) -> Option<Option<f64>> {
        let branch = self.branch.as_mut()?;
        let Some(unknown) = branch.leaves(&self.x, method.candidate(), step) else {
            branch.refused = 0;
            return None;
        };
        branch.refused += 1;
        self.w.counters.rejected += 1;
        if branch.refused < TRIED && SHORTER * step > smallest && self.o.fixed_step.is_none() {
            return Some(Some(SHORTER * step));
        }
        let failure = Failure::LeavesBranch { unknown };
        self.fail(step, failure, self.tried(step, method).into());
        Some(None)
    }
}
