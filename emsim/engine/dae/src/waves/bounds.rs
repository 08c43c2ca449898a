//! Between which values a waveform and its slope lie over a stretch of time: what a search for crossings goes by.
//!
//! A sine is between those of its ends, and 1 where a quarter of a turn lies in between; what is made of several parts (a decay times
//! a sine, a sine of a sine) is bounded by the parts' bounds, so its bounds are too wide, and the less so the shorter the stretch.
use super::{Shape, Wave};
use std::f64::consts::{PI, TAU};

/// From the least to the largest.
pub type Interval = (f64, f64);
pub const ANYTHING: Interval = (f64::NEG_INFINITY, f64::INFINITY);

/// Values and slopes over a stretch. A jump has every slope.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub value: Interval,
    pub slope: Interval,
}

pub fn plus(a: Interval, b: Interval) -> Interval {
    (a.0 + b.0, a.1 + b.1)
}

/// Products; what is 0 makes nothing of what has no bound.
pub fn times(a: Interval, b: Interval) -> Interval {
    let product = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
    let p = [product(a.0, b.0), product(a.0, b.1), product(a.1, b.0), product(a.1, b.1)];
    (p.iter().copied().fold(f64::INFINITY, f64::min), p.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

pub fn hull(a: Interval, b: Interval) -> Interval {
    (a.0.min(b.0), a.1.max(b.1))
}

impl Bounds {
    pub const UNKNOWN: Bounds = Bounds { value: ANYTHING, slope: ANYTHING };

    pub fn constant(v: f64) -> Bounds {
        Bounds { value: (v, v), slope: (0.0, 0.0) }
    }

    fn times(self, other: Bounds) -> Bounds {
        let slope = plus(times(self.slope, other.value), times(self.value, other.slope));
        Bounds { value: times(self.value, other.value), slope }
    }

    fn plus(self, other: Bounds) -> Bounds {
        Bounds { value: plus(self.value, other.value), slope: plus(self.slope, other.slope) }
    }
}

impl Wave {
    /// Does the deck alone say what it will be?
    pub fn is_known_ahead(&self) -> bool {
        !matches!(self.shape, Shape::Guest | Shape::Input(..) | Shape::Slope(_))
    }

    /// Highest frequency of what swings without corners, at any time.
    pub fn swing(&self) -> Option<f64> {
        let f = match &self.shape {
            Shape::Sin { frequency, amplitude, .. } if *amplitude != 0.0 => frequency.abs(),
            Shape::Sffm { amplitude, carrier, index, signal, .. } if *amplitude != 0.0 => {
                carrier.abs() + (index * signal).abs()
            }
            Shape::Am { amplitude, modulation, carrier, .. } if *amplitude != 0.0 => carrier.abs() + modulation.abs(),
            _ => 0.0,
        };
        (f > 0.0 && f.is_finite()).then_some(f)
    }

    /// From a, where a jump is over, to b, where one has not come.
    pub fn over(&self, a: f64, b: f64) -> Bounds {
        let (mut all, mut from) = (None::<Bounds>, a);
        // more corners of a source within a stretch are not looked through
        for _ in 0..64 {
            let to = self.next_breakpoint(from).min(b);
            let piece = self.between_corners(from, to);
            let jumps = to < b && self.value(to) != self.value_before(to);
            let piece = if jumps { Bounds { slope: ANYTHING, ..piece } } else { piece };
            all = Some(all.map_or(piece, |all| Bounds {
                value: hull(all.value, piece.value),
                slope: hull(all.slope, piece.slope),
            }));
            if to >= b {
                return all.unwrap_or(piece);
            }
            from = to;
        }
        Bounds::UNKNOWN
    }

    fn between_corners(&self, a: f64, b: f64) -> Bounds {
        let ends = (self.value(a), if b > a { self.value_before(b) } else { self.value(a) });
        let value = (ends.0.min(ends.1), ends.0.max(ends.1));
        let slopes = (self.rate(a, false), self.rate(b, true));
        let straight = Bounds { value, slope: (slopes.0.min(slopes.1), slopes.0.max(slopes.1)) };
        if a == b {
            return straight;
        }
        match &self.shape {
            Shape::Guest | Shape::Input(..) | Shape::Slope(_) => Bounds::UNKNOWN,
            Shape::Dc(_) | Shape::Pulse(_) | Shape::Pwl(_) => straight,
            Shape::Exp { low, high, rise_at, rise_tau, fall_at, fall_tau } => {
                let of = |from: f64, tau: f64| decay(a - from, b - from, tau);
                let step = high - low;
                let mut sum = Bounds::constant(*low);
                if b > *rise_at {
                    sum = sum.plus(of(*rise_at, *rise_tau).times(Bounds::constant(-step))).plus(Bounds::constant(step));
                    if b > *fall_at {
                        let falls = of(*fall_at, *fall_tau).times(Bounds::constant(step));
                        sum = sum.plus(falls).plus(Bounds::constant(-step));
                    }
                }
                sum
            }
            Shape::Sin { delay, .. } | Shape::Am { delay, .. } if b <= *delay => Bounds::constant(ends.0),
            Shape::Sin { offset, amplitude, frequency, delay, damping, phase } => {
                let sine = swings(*frequency, a - delay, b - delay, *phase);
                let swing = match *damping == 0.0 {
                    true => sine,
                    false => sine.times(decay(a - delay, b - delay, 1.0 / damping)),
                };
                swing.times(Bounds::constant(*amplitude)).plus(Bounds::constant(*offset))
            }
            Shape::Sffm { offset, amplitude, carrier, index, signal, carrier_phase, signal_phase } => {
                let signal = swings(*signal, a, b, *signal_phase).times(Bounds::constant(*index));
                let cycles = carrier * a;
                let whole = cycles.round();
                let phase = plus(
                    signal.value,
                    (carrier_phase + TAU * (cycles - whole), carrier_phase + TAU * (carrier * b - whole)),
                );
                let rate = plus(signal.slope, (TAU * carrier, TAU * carrier));
                let sine = Bounds {
                    value: sine_over(phase),
                    slope: times(sine_over((phase.0 + 0.5 * PI, phase.1 + 0.5 * PI)), rate),
                };
                sine.times(Bounds::constant(*amplitude)).plus(Bounds::constant(*offset))
            }
            Shape::Am { amplitude, offset, modulation, carrier, delay, phase } => {
                let [low, high] = [modulation, carrier].map(|f| swings(*f, a - delay, b - delay, *phase));
                low.plus(Bounds::constant(*offset)).times(high).times(Bounds::constant(*amplitude))
            }
        }
    }
}

/// sin(2 pi f s + phase) from a to b.
fn swings(f: f64, a: f64, b: f64, phase: f64) -> Bounds {
    let whole = (f * a).round();
    let arguments = (TAU * (f * a - whole) + phase, TAU * (f * b - whole) + phase);
    let (lo, hi) = (arguments.0.min(arguments.1), arguments.0.max(arguments.1));
    let rate = TAU * f;
    Bounds { value: sine_over((lo, hi)), slope: times(sine_over((lo + 0.5 * PI, hi + 0.5 * PI)), (rate, rate)) }
}

/// exp(-s / tau) from a to b, which has begun; 0 where tau is 0.
fn decay(a: f64, b: f64, tau: f64) -> Bounds {
    if tau == 0.0 {
        return Bounds::constant(0.0);
    }
    let (first, last) = ((-a.max(0.0) / tau).exp(), (-b / tau).exp());
    let value = (first.min(last), first.max(last));
    Bounds { value, slope: times(value, (-1.0 / tau, -1.0 / tau)) }
}

/// Sines of arguments from the one to the other.
pub fn sine_over((lo, hi): Interval) -> Interval {
    let turns = |shift: f64| ((hi - shift) / TAU).floor() > ((lo - shift) / TAU).floor();
    let (first, last) = (lo.sin(), hi.sin());
    let least = if lo < hi && turns(-0.5 * PI) { -1.0 } else { first.min(last) };
    let most = if lo < hi && turns(0.5 * PI) { 1.0 } else { first.max(last) };
    if least.is_nan() || most.is_nan() {
        return (-1.0, 1.0);
    }
    (least, most)
}
