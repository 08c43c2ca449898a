//! When a leap over a transient is tried again.

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
