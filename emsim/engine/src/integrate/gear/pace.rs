/// Beside diodes errors of short steps, in which something turns on, mostly go by themselves: it then conducts, and takes everything near
/// to where it belongs. What is wrong at the end of a long step, in which something turns off, stays. So the errors of steps longer than
/// this part of the mean step so far are held to less, in proportion, down to a thirtieth. Steps and evaluations to an error of 1e-6:
/// diode multiplier 6340 and 8710, now 5200 and 7300, four-diode bridge 1800 and 2300, now 1610 and 1970.
const LONG: f64 = 0.1;
const HELD: f64 = 30.0;
/// What follows a step whose error is held to less is longer by so much at most: there is time to see what the next ones miss.
pub const LONGER: f64 = 1.4;
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
