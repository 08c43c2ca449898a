//! How long a step is that follows another.
//!
//! By its estimate  e = c h^k  a step may be  0.9 e^(-1/k)  times as long, if c stays what it is. Where c has grown it goes on growing,
//! as a diode turns on: with c' of the step before, the next one is shorter by another  (c' / c)^(1/k)  (Gustafsson's predictive
//! controller). So are steps no longer found too long one after the other, each a tenth, at the price of its stages. Where nothing
//! turns it saves little, by steps that follow each swing.
//!
//! An attempt that is wrong by many tolerances has met something quick before its end. Steps go there by thirds of what is left of the
//! way, not five times as long as the last one: the farther behind it a stage lies, the more iterations are lost.

/// An estimate so large tells nothing but that something quick is there.
const WRONG: f64 = 10.0;
/// A step's part of the way to the end of such an attempt.
const PART: f64 = 0.3;
/// A step that is estimated to be better than that says no more of c.
const LEAST: f64 = 1e-2;

pub struct Control {
    turns: bool,                // is there what turns?
    estimate: f64,              // of the attempted step, in tolerances
    before: Option<(f64, f64)>, // length and estimate of the step before
    ahead: f64,                 // where an attempt ended that was wrong
}

impl Control {
    pub fn new(turns: bool) -> Control {
        Control { turns, estimate: 0.0, before: None, ahead: 0.0 }
    }

    pub fn restart(&mut self) {
        *self = Control::new(self.turns);
    }

    pub fn refused(&mut self, t1: f64, estimate: f64) {
        if estimate > WRONG {
            self.ahead = t1;
        }
    }

    /// What a step of h that ends at t1 makes of `factor`, by which its estimate alone lets the next one grow.
    pub fn next(&mut self, h: f64, t1: f64, estimate: f64, k: f64, factor: f64) -> f64 {
        self.estimate = estimate;
        let grown = |(old_h, old): (f64, f64)| (h / old_h * (old / estimate).powf(1.0 / k)).min(1.0);
        let factor = factor * self.before.map_or(1.0, grown);
        if t1 < self.ahead {
            factor.min((PART * (self.ahead - t1) / h).max(1.0))
        } else {
            factor
        }
    }

    /// The attempted step is taken; `knows` where the next one's estimate is made as its own was.
    pub fn accept(&mut self, h: f64, knows: bool) {
        self.before = (knows && self.turns).then_some((h, self.estimate.max(LEAST)));
    }
}
