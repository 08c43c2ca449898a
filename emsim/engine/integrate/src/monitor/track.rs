//! A mode that is followed from burst to burst (monitor.rs).
use super::OWN;

/// A loss of so many times what is predicted is not the method's.
const MOST_ALIKE: f64 = 2.0;
/// By so much, as a share and as a logarithm, an amplitude falls less between two bursts than within them before it is another's.
const UNEVEN: f64 = 0.25;
const EXCITED: f64 = 0.1;
/// Where it would have fallen by so much, ln, between two bursts, nobody knows what happened there.
const GONE: f64 = 1.0;

/// What a track has added up at some time.
#[derive(Clone, Copy, Default)]
pub struct Sum {
    pub loss: f64, // ln
    pub late: f64,
    pub cycles: f64,
    pub left: f64,
    pub until: f64,
}

impl Sum {
    pub fn damped(&self) -> f64 {
        self.left * (1.0 - (-self.loss).exp())
    }

    pub fn delayed(&self) -> f64 {
        self.left * self.late.abs()
    }
}

#[derive(Clone, Copy, Default)]
pub struct Track {
    pub bursts: u32,
    pub driven: u32, // bursts in which something of its frequency, or that part of it, drove
    pub forced: u32, // ... of its very frequency
    pub w: f64,
    pub first: (f64, f64), // time, amplitude
    pub last: (f64, f64),
    pub loss: f64,  // predicted between first and last
    pub apart: f64, // what the falls from burst to burst differ from it by
    pub late: f64,
    pub cycles: f64,
    pub rates: (f64, f64),  // of loss and lateness, a second
    pub coarsest: f64,      // least steps a period
    pub seen: bool,         // fell within one burst as predicted
    pub within: (f64, f64), // what it fell by within the halves of its bursts, and was to
    pub halves: f64,        // their time
    pub burst: (f64, f64),  // what it fell by, and the time, in the half of the last burst
    pub lately: (f64, f64), // ... of the last long burst
    pub shift: f64,         // periods gained since its frequency was the first
    pub began: f64,         // that frequency
    pub damped: Sum,        // when most was lost
    pub delayed: Sum,       // and when it was latest, of what the mode itself had left
    pub quick: f64,         // a period seen with stride 1: longer strides would see its alias
    pub stride: u32,        // of the burst that saw it last
    pub edge: f64,          // half of the first burst
    pub share: f64,         // of the amplitude at first in the unknown's largest value
}

impl Track {
    /// What is added up `rest` seconds after the last burst.
    pub fn sum(&self, rest: f64) -> Sum {
        let span = self.last.0 - self.first.0;
        let own = match self.bursts {
            1 => (self.within.0 - self.within.1) / self.halves,
            _ => ((self.first.1 / self.last.1).ln() - self.loss) / span,
        };
        Sum {
            loss: self.loss + self.rates.0 * rest,
            late: self.late + self.rates.1 * rest,
            cycles: self.cycles + rest * self.w / std::f64::consts::TAU,
            left: (-own.max(0.0) * (span + rest)).exp(),
            until: self.last.0 + rest,
        }
    }

    /// Was it excited anew before the burst that begins with this amplitude? It has fallen by less than within the bursts at both ends.
    pub fn excited(&self, t: f64, amplitude: f64, burst: (f64, f64)) -> bool {
        let rate = (self.burst.0 + burst.0) / (self.burst.1 + burst.1);
        let falls = rate * (t - self.last.0);
        falls > GONE || (self.last.1 / amplitude).ln() < (1.0 - UNEVEN) * falls - EXCITED
    }

    /// Does the mode decay by itself? It falls by more than predicted within the bursts, and as fast from one to the
    /// next: what is excited anew between them does not; and to the last: what settles to an amplitude of its own does not.
    pub fn decays(&self) -> bool {
        let within = self.within.0 / self.halves;
        let (span, fell) = (self.last.0 - self.first.0, (self.first.1 / self.last.1).ln());
        let evenly = self.bursts == 1 || (fell > 0.5 * within * span && fell < 2.0 * within * span);
        self.within.0 > OWN * self.within.1 && evenly && self.lately.0 > 0.3 * within * self.lately.1
    }
}

/// Does an amplitude fall as predicted? What a tank loses to its method alone is predicted to a percent; where half and more
/// of what it loses is not the method's, the method is not what is to be told.
pub fn alike(fell: f64, predicted: f64) -> bool {
    fell > 0.5 * predicted && fell < MOST_ALIKE * predicted
}
