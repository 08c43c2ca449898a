//! Corners of sources that move with a parameter. Between two of them beside time goes at another pace, t -> phi(t), so that each
//! corner falls on that of the run: with d/dt Q + phi' F(x, phi) = 0 no source jumps at another time. What `Tangent` has is then
//! the derivative of x(phi(t)), and that of phi itself is told beside it.
use super::{Refused, Tangent};
use crate::system::System;

/// From one corner to the next, in the run and beside it.
pub(super) struct Stretch {
    own: (f64, f64),
    there: (f64, f64),
}

impl Default for Stretch {
    fn default() -> Stretch {
        Stretch { own: (0.0, f64::INFINITY), there: (0.0, f64::INFINITY) }
    }
}

impl Stretch {
    /// The time beside.
    pub fn when(&self, t: f64) -> f64 {
        if self.own == self.there {
            t
        } else if t >= self.own.1 {
            self.there.1
        } else {
            self.there.0 + (t - self.own.0) * self.pace()
        }
    }

    pub fn pace(&self) -> f64 {
        if self.own == self.there || self.own.1.is_infinite() {
            1.0
        } else {
            (self.there.1 - self.there.0) / (self.own.1 - self.own.0)
        }
    }

    /// The next stretch: where the sources have their next corners, in the run and beside; None where they do not go together.
    fn next(&mut self, own: &[f64], there: &[f64], span: f64) -> Option<()> {
        let (here, beside) = (first(own), first(there));
        let together = own.iter().zip(there).all(|(&a, &b)| is(a, here) == is(b, beside));
        let finite = here.is_finite() && beside.is_finite() && together;
        if here.min(beside) < span && !(finite && beside > self.there.1) {
            return None;
        }
        // behind the last corner nothing moves
        let end = |t: f64| if finite { t } else { f64::INFINITY };
        *self = Stretch { own: (self.own.1, end(here)), there: (self.there.1, end(beside)) };
        Some(())
    }
}

/// Is t not behind a corner? What is nearer to it, in parts of its time, is at it: rounding of sums of periods.
fn is(t: f64, corner: f64) -> bool {
    t <= corner * (1.0 + 1e-12)
}

fn first(of: &[f64]) -> f64 {
    of.iter().fold(f64::INFINITY, |first, &t| first.min(t))
}

impl Tangent {
    /// Goes on to the next corner. Refuses where it is not the same one with another value of a parameter.
    pub(super) fn corners(&mut self, sys: &System) -> Result<(), Refused> {
        while is(self.corner, self.at) {
            let from = self.corner;
            if from == 0.0 {
                self.besides.iter_mut().for_each(|b| b.stretch = Stretch { own: (0.0, 0.0), there: (0.0, 0.0) });
            } else {
                self.turns.extend([from, from]);
                self.turns.resize(self.turns.len() + self.count, 0.0);
            }
            let next: Vec<f64> = sys.waves.iter().map(|wave| wave.next_breakpoint(from)).collect();
            for b in &mut self.besides {
                let last = b.stretch.there.1;
                let there: Vec<f64> = b.sys.waves.iter().map(|wave| wave.next_breakpoint(last)).collect();
                if b.stretch.next(&next, &there, self.span).is_none() {
                    return Err(Refused::Corner { t: first(&next).min(first(&there)), parameter: b.parameter });
                }
            }
            self.corner = first(&next);
        }
        Ok(())
    }
}
