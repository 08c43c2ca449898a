//! How the next step, and its order, follow from errors. Logarithms here are of base 2 and known to 1e-4, which is a hundredth of
//! a per cent of a step.

/// log2 of the share of the step that an error allows which is taken, and what the growth of its coefficient over the last step counts
/// besides (Gustafsson 1994 has it count in full).
#[derive(Clone, Copy)]
pub struct Control {
    safety: f64,
    trend: f64,
}

/// exp(-0.4)
pub const AHEAD: Control = Control { safety: -0.5770780163555854, trend: 0.7 };
/// 0.85
pub const SPICE: Control = Control { safety: -0.23446525363702297, trend: 0.0 };
/// Another order's step must be longer by 5 %: log2 1.05.
const WORTH_IT: f64 = 0.070389327891398;
/// 1 over an order and one more.
const INVERSE: [f64; 8] = [1.0, 0.5, 1.0 / 3.0, 0.25, 0.2, 1.0 / 6.0, 1.0 / 7.0, 0.125];
/// Errors below 1e-12 are as good as none: log2.
const LEAST: f64 = -39.863137138648355;

/// Beside diodes errors of short steps, in which something turns on, mostly go by themselves: it then conducts, and takes everything near
/// to where it belongs. What is wrong at the end of a long step, in which something turns off, stays. So the errors of steps longer than
/// this part of the mean step so far are held to less, in proportion, down to a thirtieth. Steps and evaluations to an error of 1e-6:
/// diode multiplier 6340 and 8710, now 5200 and 7300, four-diode bridge 1800 and 2300, now 1610 and 1970.
const LONG: f64 = 0.1;
const HELD: f64 = 30.0;
/// A step is longer than the one before by so much at most, and by so much behind one whose error is held to less: there is time to see
/// what the next ones miss.
const LONGER: f64 = 2.0;
const LONGER_HELD: f64 = 1.4;
/// A mean is one of so many steps at least.
const MEAN: f64 = 20.0;

/// How long the steps of a run have been.
#[derive(Clone, Copy, Default)]
pub struct Pace {
    time: f64,
    steps: f64,
}

impl Pace {
    pub fn count(&mut self, h: f64) {
        self.time += h;
        self.steps += 1.0;
    }

    /// What errors of a step of length h are multiplied by.
    pub fn weight(&self, h: f64) -> f64 {
        if self.steps < MEAN {
            return 1.0;
        }
        (h * self.steps / (LONG * self.time)).clamp(1.0, HELD)
    }
}

/// An accepted step.
#[derive(Clone, Copy, Default)]
pub struct Taken {
    pub order: usize,
    pub h: f64,
    pub error: f64, // log2
}

impl Control {
    /// log2 of the factor to the next step that an error of order k allows, whose own log2 is given.
    #[inline(always)]
    fn growth(self, error: f64, k: usize) -> f64 {
        if error < LEAST {
            1.0
        } else {
            self.safety - error * INVERSE[k]
        }
    }

    /// What is left of a step whose error of order k was too large.
    pub fn shorter(self, error: f64, k: usize) -> f64 {
        self.growth(error.log2(), k).exp2().clamp(0.1, 0.8)
    }

    /// The order of the next step and what it is longer by, after one of order k and length h that was good and the one before it, which
    /// becomes that one; errors of `others` are those that orders below and above would have had. Was its error `held` to less (`Pace`)?
    #[inline(always)]
    pub fn next(
        self,
        (k, h, error): (usize, f64, f64),
        others: [Option<f64>; 2],
        before: &mut Taken,
        held: bool,
    ) -> (usize, f64) {
        let now = Taken { order: k, h, error: error.log2() };
        let before = std::mem::replace(before, now);
        let (mut best, mut order) = (self.growth(now.error, k), k);
        for (k, error) in [(k.wrapping_sub(1), others[0]), (k + 1, others[1])] {
            let longer = error.map_or(f64::NEG_INFINITY, |e| self.growth(e.log2(), k));
            if longer > best + WORTH_IT {
                (best, order) = (longer, k);
            }
        }
        let mut trend = 0.0;
        if self.trend > 0.0 && order == k && before.order == k {
            let grown = (now.error - before.error.max(LEAST)) * INVERSE[k];
            trend = (grown - (now.h / before.h).log2()).max(0.0);
        }
        (order, (best - self.trend * trend).exp2().clamp(0.5, if held { LONGER_HELD } else { LONGER }))
    }
}
