//! Waveforms of independent sources: value, corners, and the shortest time that matters.
//!
//! With s = t - td (formulas as measured on ngspice 39.3; all defaults are resolved by the caller, angles in degrees):
//!
//!   dc     v
//!   pulse  v1 v2 td tr tf pw per np    v1, up in tr, v2 for pw, down in tf, v1; again every per, np times (0: for ever).
//!                                      A period shorter than tr + pw + tf cuts the pulse off where it is. tr, tf = 0: a jump
//!   sin    vo va f td theta phase      s <= 0: vo + va sin(phase)    else vo + va sin(2 pi f s + phase) exp(-s theta)
//!   exp    v1 v2 td1 tau1 td2 tau2     v1 + (v2 - v1)(1 - exp(-(t - td1)/tau1)) from td1
//!                                      + (v1 - v2)(1 - exp(-(t - td2)/tau2)) from td2, if td1 has passed
//!   sffm   vo va fc mdi fs phc phs     vo + va sin(2 pi fc t + phc + mdi sin(2 pi fs t + phs))
//!   am     va vo mf fc td ph           s <= 0: 0    else va (vo + sin(2 pi mf s + ph)) sin(2 pi fc s + ph)
//!   pwl    t0 v0 t1 v1 ...             straight lines; constant before and after. Equal times: a jump
//!   pwlr   td r t0 v0 t1 v1 ...        the same, td later; after its end it repeats from time r (r < 0: it does not)
//!
//! (ngspice 39.3 reads am's phase from a seventh value and ignores the sixth, against its manual. Here it is the sixth.)
//!
//! At a jump there are two values. `value` gives the one after it, `value_before` the one before it, and a DC value that was not
//! given is `value_before(0)`: what starts at t = 0 has not started yet.
//!
//! A corner is a kink or jump; an integrator must step onto it. Corners are computed, not accumulated: td + k per + c with
//! k = floor(s / per), so that the millionth pulse is as exact as the first. Rounding of t itself cannot be avoided; a time
//! within a few units in the last place of a corner counts as the corner, so that the value there is the corner's own.

pub mod bounds;
mod rate;

use crate::rounding::{ROUNDED, SUMMED};
use crate::tape::sin_cos;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::Arc;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Wave {
    shape: Shape,
    dc: Option<f64>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Shape {
    Dc(f64),
    Pulse(Pulse),
    Sin { offset: f64, amplitude: f64, frequency: f64, delay: f64, damping: f64, phase: f64 },
    Exp { low: f64, high: f64, rise_at: f64, rise_tau: f64, fall_at: f64, fall_tau: f64 },
    Sffm { offset: f64, amplitude: f64, carrier: f64, index: f64, signal: f64, carrier_phase: f64, signal_phase: f64 },
    Am { amplitude: f64, offset: f64, modulation: f64, carrier: f64, delay: f64, phase: f64 },
    Pwl(Pwl),
    Guest,                                  // what another system gives, see system/split.rs
    Input(#[serde(skip)] Arc<Input>, bool), // does it change while a run goes on?
    Slope(Box<Wave>),                       // of another one, see hidden.rs
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pulse {
    v1: f64,
    v2: f64,
    delay: f64,
    period: f64,
    count: f64,
    /// Ends of rise, top and fall, from the start of the period.
    corners: [f64; 3],
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pwl {
    delay: f64,
    times: Vec<f64>,
    values: Vec<f64>,
    /// Where the repetition starts, if there is one: earlier than the last time.
    repeat: Option<f64>,
}

/// What somebody outside gives while a run stands: a straight line from a time on.
#[derive(Debug, Default)]
pub struct Input {
    from: AtomicU64, // bits of f64
    value: AtomicU64,
    slope: AtomicU64,
}

impl Input {
    /// From `from` on. The run has to be told (`Session`).
    pub fn set(&self, from: f64, value: f64, slope: f64) {
        for (place, v) in [(&self.from, from), (&self.value, value), (&self.slope, slope)] {
            place.store(v.to_bits(), Relaxed);
        }
    }

    pub fn value(&self, t: f64) -> f64 {
        let [from, value, slope] = self.line();
        if slope == 0.0 {
            value
        } else {
            value + slope * (t - from)
        }
    }

    pub fn slope(&self) -> f64 {
        self.line()[2]
    }

    /// Where it begins, its value there, its slope.
    pub fn line(&self) -> [f64; 3] {
        [&self.from, &self.value, &self.slope].map(|place| f64::from_bits(place.load(Relaxed)))
    }
}

/// Which of two values at a jump.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Before,
    After,
}

impl Wave {
    /// `kind` and `args` as in the table above. Errors are sentences for the user, without the source's name.
    pub fn new(kind: &str, args: &[f64], dc: Option<f64>) -> Result<Wave, String> {
        if let Some(bad) = args.iter().position(|v| v.is_nan()) {
            return Err(format!("value {} of {kind} is not a number", bad + 1));
        }
        let miscounted = |n: usize| format!("{kind} needs {n} values, not {}", args.len());
        let not_negative = |which: &[(usize, &str)]| match which.iter().find(|(i, _)| args[*i] < 0.0) {
            Some((i, what)) => Err(format!("{what} of {kind} must not be negative, it is {}", args[*i])),
            None => Ok(()),
        };
        let shape = match (kind, args) {
            ("dc", &[value]) => Shape::Dc(value),
            ("pulse", &[v1, v2, delay, rise, fall, width, period, count]) => {
                not_negative(&[
                    (3, "rise time"),
                    (4, "fall time"),
                    (5, "width"),
                    (6, "period"),
                    (7, "number of pulses"),
                ])?;
                let period = if period > 0.0 { period } else { f64::INFINITY };
                let count = if count > 0.0 { count.ceil() } else { f64::INFINITY };
                Shape::Pulse(Pulse { v1, v2, delay, period, count, corners: [rise, rise + width, rise + width + fall] })
            }
            ("sin", &[offset, amplitude, frequency, delay, damping, phase]) => {
                Shape::Sin { offset, amplitude, frequency, delay, damping, phase: phase.to_radians() }
            }
            ("exp", &[low, high, rise_at, rise_tau, fall_at, fall_tau]) => {
                not_negative(&[(3, "rise time constant"), (5, "fall time constant")])?;
                Shape::Exp { low, high, rise_at, rise_tau, fall_at, fall_tau }
            }
            ("sffm", &[offset, amplitude, carrier, index, signal, of_carrier, of_signal]) => {
                let (carrier_phase, signal_phase) = (of_carrier.to_radians(), of_signal.to_radians());
                Shape::Sffm { offset, amplitude, carrier, index, signal, carrier_phase, signal_phase }
            }
            ("am", &[amplitude, offset, modulation, carrier, delay, phase]) => {
                Shape::Am { amplitude, offset, modulation, carrier, delay, phase: phase.to_radians() }
            }
            ("pwl", _) => Shape::Pwl(Pwl::new(args, 0.0, -1.0)?),
            ("pwlr", &[delay, repeat, ..]) => Shape::Pwl(Pwl::new(&args[2..], delay, repeat)?),
            ("pwlr", _) => return Err("pwlr needs a delay and a start of repetition".to_string()),
            ("dc", _) => return Err(miscounted(1)),
            ("sin" | "exp" | "am", _) => return Err(miscounted(6)),
            ("sffm", _) => return Err(miscounted(7)),
            ("pulse", _) => return Err(miscounted(8)),
            _ => return Err(format!("unknown waveform '{kind}'")),
        };
        Ok(Wave { shape, dc })
    }

    /// A place for a value that another system gives.
    pub fn exchanged() -> Wave {
        Wave { shape: Shape::Guest, dc: None }
    }

    /// A place for a value that comes from outside.
    pub fn input(value: f64) -> Wave {
        let input = Input::default();
        input.set(0.0, value, 0.0);
        Wave { shape: Shape::Input(Arc::new(input), true), dc: None }
    }

    /// Nobody changes an input while a run goes on.
    pub fn hold(&mut self) {
        if let Shape::Input(_, changes) = &mut self.shape {
            *changes = false;
        }
    }

    pub fn as_input(&self) -> Option<&Arc<Input>> {
        match &self.shape {
            Shape::Input(input, _) => Some(input),
            _ => None,
        }
    }

    /// Value at t; at a jump the value after it.
    pub fn value(&self, t: f64) -> f64 {
        self.at(t, Side::After)
    }

    /// Does it never change?
    pub fn still(&self) -> bool {
        matches!(self.shape, Shape::Dc(_) | Shape::Input(_, false))
    }

    /// Value at t; at a jump the value before it.
    pub fn value_before(&self, t: f64) -> f64 {
        self.at(t, Side::Before)
    }

    /// Value for the DC operating point.
    pub fn dc_value(&self) -> f64 {
        self.dc.unwrap_or_else(|| self.value_before(0.0))
    }

    /// Value at t; at a jump the one that is asked for.
    #[inline(always)]
    pub fn value_at(&self, t: f64, before: bool) -> f64 {
        match &self.shape {
            Shape::Dc(v) => *v,
            Shape::Sin { offset, amplitude, frequency, delay, damping, phase } if t > *delay && *damping == 0.0 => {
                offset + amplitude * sine(frequency * (t - delay), *phase)
            }
            _ => self.at(t, if before { Side::Before } else { Side::After }),
        }
    }

    #[inline(never)]
    fn at(&self, t: f64, side: Side) -> f64 {
        match &self.shape {
            Shape::Dc(v) => *v,
            Shape::Guest => 0.0,
            Shape::Input(input, _) => input.value(t),
            Shape::Slope(of) => of.rate(t, side == Side::Before),
            Shape::Pulse(pulse) => pulse.at(t, side),
            Shape::Sin { offset, amplitude, frequency, delay, damping, phase } => {
                let s = t - delay;
                if s <= 0.0 {
                    return offset + amplitude * phase.sin();
                }
                let decay = if *damping == 0.0 { 1.0 } else { (-s * damping).exp() };
                offset + amplitude * sine(frequency * s, *phase) * decay
            }
            Shape::Exp { low, high, rise_at, rise_tau, fall_at, fall_tau } => {
                let mut v = *low;
                if passed(t, *rise_at, 0.0, side) {
                    v += (high - low) * approach(t - rise_at, *rise_tau);
                    if passed(t, *fall_at, 0.0, side) {
                        v += (low - high) * approach(t - fall_at, *fall_tau);
                    }
                }
                v
            }
            Shape::Sffm { offset, amplitude, carrier, index, signal, carrier_phase, signal_phase } => {
                offset + amplitude * sine(carrier * t, carrier_phase + index * sine(signal * t, *signal_phase))
            }
            Shape::Am { amplitude, offset, modulation, carrier, delay, phase } => {
                let s = t - delay;
                if !passed(s, 0.0, 0.0, side) {
                    return 0.0;
                }
                amplitude * (offset + sine(modulation * s, *phase)) * sine(carrier * s, *phase)
            }
            Shape::Pwl(pwl) => pwl.at(t, side),
        }
    }

    /// Straight lines between corners.
    pub fn is_piecewise_linear(&self) -> bool {
        match &self.shape {
            Shape::Slope(of) => of.is_piecewise_linear(),
            shape => matches!(shape, Shape::Dc(_) | Shape::Pulse(_) | Shape::Pwl(_)),
        }
    }

    /// The first corner after t (by more than 1e-12 of t), INFINITY when there is none.
    pub fn next_breakpoint(&self, t: f64) -> f64 {
        self.corner_after(t, ROUNDED)
    }

    /// The last of the corners after t that are too near to it to be a breakpoint.
    pub fn hidden_corner(&self, t: f64) -> Option<f64> {
        let next = |t: f64| Some(self.corner_after(t, SUMMED)).filter(|&b| b.is_finite());
        let hidden = |b: &f64| *b <= t + ROUNDED * b.abs();
        std::iter::successors(next(t).filter(hidden), |&b| next(b).filter(hidden)).last()
    }

    /// The first corner after t by more than `part` of t.
    fn corner_after(&self, t: f64, part: f64) -> f64 {
        let first_of = |times: &[f64]| {
            let later = times.iter().copied().filter(|&b| later(t, b, part));
            later.fold(f64::INFINITY, f64::min)
        };
        match &self.shape {
            Shape::Dc(_) | Shape::Guest | Shape::Input(..) | Shape::Sffm { .. } => f64::INFINITY,
            Shape::Pulse(pulse) => pulse.corner_after(t, part),
            Shape::Sin { delay, .. } | Shape::Am { delay, .. } => first_of(&[*delay]),
            Shape::Exp { rise_at, fall_at, .. } => first_of(&[*rise_at, *fall_at]),
            Shape::Pwl(pwl) => pwl.corner_after(t, part),
            Shape::Slope(of) => of.corner_after(t, part),
        }
    }

    /// Number of the piece that starts at or lies around t; the same in every period. 0 where there are none.
    pub fn piece(&self, t: f64) -> usize {
        match &self.shape {
            Shape::Pulse(p) => p.piece(t),
            Shape::Pwl(p) => p.passed(t, Side::After).0,
            Shape::Slope(of) => of.piece(t),
            _ => 0,
        }
    }

    /// Of what repeats itself.
    pub fn frequency(&self) -> Option<f64> {
        let f = match &self.shape {
            Shape::Pulse(p) => 1.0 / p.period,
            Shape::Sin { frequency, amplitude, .. } if *amplitude != 0.0 => frequency.abs(),
            Shape::Sffm { carrier, .. } | Shape::Am { carrier, .. } => carrier.abs(),
            Shape::Pwl(p) => 1.0 / (p.times.last()? - p.repeat?),
            Shape::Slope(of) => return of.frequency(),
            _ => 0.0,
        };
        (f > 0.0 && f.is_finite()).then_some(f)
    }

    /// The shortest time in which the wave changes much: an edge, a time constant, 1/(2 pi f). INFINITY for dc.
    pub fn shortest(&self) -> f64 {
        let least = |times: &[f64]| {
            let positive = times.iter().copied().filter(|&s| s > 0.0);
            positive.fold(f64::INFINITY, f64::min)
        };
        let radian = |f: f64| 1.0 / (TAU * f.abs());
        match &self.shape {
            Shape::Dc(_) | Shape::Guest | Shape::Input(..) => f64::INFINITY,
            Shape::Slope(of) => of.shortest(),
            Shape::Pulse(p) if p.v1 == p.v2 => f64::INFINITY,
            Shape::Pulse(p) => {
                let [rise, top, fall] = p.corners;
                least(&[rise, top - rise, fall - top, p.period - fall])
            }
            Shape::Sin { frequency, damping, .. } => least(&[radian(*frequency), 1.0 / damping.abs()]),
            Shape::Exp { rise_tau, fall_tau, .. } => least(&[*rise_tau, *fall_tau]),
            Shape::Sffm { carrier, index, signal, .. } => {
                least(&[1.0 / (TAU * (carrier.abs() + (index * signal).abs()))])
            }
            Shape::Am { modulation, carrier, .. } => least(&[1.0 / (TAU * (carrier.abs() + modulation.abs()))]),
            Shape::Pwl(pwl) => {
                pwl.times.windows(2).map(|w| w[1] - w[0]).filter(|&s| s > 0.0).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

impl Pulse {
    /// t from the start of its period, and what counts as a corner there; None before the first pulse and after the last.
    #[inline]
    fn fold(&self, t: f64, side: Side) -> Option<(f64, f64)> {
        let snap = SUMMED * t.abs().max(self.delay.abs());
        let s = t - self.delay;
        if !passed(s, 0.0, snap, side) {
            return None;
        }
        let k = if self.period.is_finite() { periods(s, self.period, snap, side) } else { 0.0 };
        (k < self.count).then(|| (if k > 0.0 { k.mul_add(-self.period, s) } else { s }, snap))
    }

    fn at(&self, t: f64, side: Side) -> f64 {
        let Some((s, snap)) = self.fold(t, side) else { return self.v1 };
        let [rise, top, fall] = self.corners;
        if !passed(s, rise, snap, side) {
            line(self.v1, self.v2, s, rise, snap)
        } else if !passed(s, top, snap, side) {
            self.v2
        } else if !passed(s, fall, snap, side) {
            line(self.v2, self.v1, s - top, fall - top, snap)
        } else {
            self.v1
        }
    }

    fn piece(&self, t: f64) -> usize {
        let Some((s, snap)) = self.fold(t, Side::After) else { return 0 };
        1 + self.corners.iter().filter(|&&c| passed(s, c, snap, Side::After)).count()
    }

    fn corner_after(&self, t: f64, part: f64) -> f64 {
        if self.v1 == self.v2 {
            return f64::INFINITY;
        }
        let s = t - self.delay;
        let first = if self.period.is_finite() { whole(s / self.period) } else { 0.0 };
        // t may stand within rounding of the end of a period, hence two of them and the start of a third
        for k in [first, first + 1.0, first + 2.0] {
            let start = if k > 0.0 { k.mul_add(self.period, self.delay) } else { self.delay };
            if k >= self.count {
                // nothing starts here, but the last pulse may be cut off
                let cut = k == self.count && self.corners[2] > self.period && later(t, start, part);
                return if cut { start } else { f64::INFINITY };
            }
            for corner in [0.0, self.corners[0], self.corners[1], self.corners[2]] {
                let time = start + corner;
                if corner < self.period && time.is_finite() && later(t, time, part) {
                    return time;
                }
            }
            if !self.period.is_finite() {
                break;
            }
        }
        f64::INFINITY
    }
}

impl Pwl {
    fn new(pairs: &[f64], delay: f64, repeat: f64) -> Result<Pwl, String> {
        if pairs.is_empty() || pairs.len() % 2 != 0 {
            return Err(format!("pwl needs pairs of time and value, not {} numbers", pairs.len()));
        }
        let times: Vec<f64> = pairs.iter().copied().step_by(2).collect();
        let values: Vec<f64> = pairs.iter().copied().skip(1).step_by(2).collect();
        if let Some(i) = times.windows(2).position(|w| w[1] < w[0]) {
            return Err(format!("the times of pwl must ascend, but {} comes after {}", times[i + 1], times[i]));
        }
        let last = times[times.len() - 1];
        if repeat >= 0.0 && repeat >= last {
            return Err(format!("pwl cannot repeat from {repeat}, it ends at {last}"));
        }
        if repeat >= 0.0 && repeat < times[0] {
            return Err(format!("pwl cannot repeat from {repeat}, it starts at {}", times[0]));
        }
        Ok(Pwl { delay, times, values, repeat: (repeat >= 0.0).then_some(repeat) })
    }

    /// Number of repetitions begun at s, and s folded back into the listed times.
    fn fold(&self, s: f64, snap: f64, side: Side) -> (f64, f64) {
        let last = self.times[self.times.len() - 1];
        match self.repeat {
            Some(from) if passed(s, last, snap, side) => {
                let k = periods(s - from, last - from, snap, side);
                (k, k.mul_add(from - last, s))
            }
            _ => (0.0, s),
        }
    }

    /// Points that t has passed, the next of which ends its line; t among the listed times, and what counts as one of them.
    #[inline]
    fn passed(&self, t: f64, side: Side) -> (usize, f64, f64) {
        let snap = SUMMED * t.abs().max(self.delay.abs());
        let (_, s) = self.fold(t - self.delay, snap, side);
        (self.times.partition_point(|&time| passed(s, time, snap, side)), s, snap)
    }

    fn at(&self, t: f64, side: Side) -> f64 {
        let (i, s, snap) = self.passed(t, side);
        if i == 0 {
            return self.values[0];
        }
        if i == self.times.len() {
            return self.values[i - 1];
        }
        let start = self.times[i - 1];
        line(self.values[i - 1], self.values[i], s - start, self.times[i] - start, snap)
    }

    fn corner_after(&self, t: f64, part: f64) -> f64 {
        let s = t - self.delay;
        let (k, _) = self.fold(s, 0.0, Side::After);
        for k in [k, k + 1.0] {
            let shift = match self.repeat {
                Some(from) if k > 0.0 => k.mul_add(self.times[self.times.len() - 1] - from, self.delay),
                _ if k > 0.0 => break,
                _ => self.delay,
            };
            let first = match self.repeat {
                Some(from) if k > 0.0 => self.times.partition_point(|&time| time < from),
                _ => 0,
            };
            let later = |&time: &f64| later(t, time + shift, part);
            let i = first + self.times[first..].partition_point(|time| !later(time));
            if let Some(&time) = self.times.get(i) {
                return time + shift;
            }
        }
        f64::INFINITY
    }
}

/// Is a corner at b later than t by more than `part` of them?
fn later(t: f64, b: f64, part: f64) -> bool {
    b > t + part * t.abs().max(b.abs())
}

/// Has s passed the corner at c?
fn passed(s: f64, c: f64, snap: f64, side: Side) -> bool {
    match side {
        Side::After => s >= c - snap,
        Side::Before => s > c + snap,
    }
}

/// Number of whole periods gone by at s, at least 0.
fn periods(s: f64, period: f64, snap: f64, side: Side) -> f64 {
    match side {
        Side::After => whole((s + snap) / period),
        Side::Before => {
            let gone = ((s - snap) / period).max(0.0);
            let k = whole(gone);
            // at the end of a period that one is not yet gone by
            if k == gone {
                (k - 1.0).max(0.0)
            } else {
                k
            }
        }
    }
}

/// The largest integer up to v, at least 0. (By way of an integer: the library's is a call.)
#[inline]
fn whole(v: f64) -> f64 {
    // from here on every number is one
    if v < 4_503_599_627_370_496.0 {
        v.max(0.0) as i64 as f64
    } else {
        v
    }
}

/// From a at s = 0 to b at s = length, and exactly so at both ends.
fn line(a: f64, b: f64, s: f64, length: f64, snap: f64) -> f64 {
    if s >= length - snap {
        b
    } else if s <= snap {
        a
    } else {
        a + (b - a) * (s / length)
    }
}

/// sin(2 pi cycles + phase), exact after many cycles.
fn sine(cycles: f64, phase: f64) -> f64 {
    sin_cos(TAU * (cycles - nearest(cycles)) + phase).0
}

/// The integer next to v, v itself beyond 2^51.
fn nearest(v: f64) -> f64 {
    if v.abs() < 2_251_799_813_685_248.0 {
        // 1.5 2^52
        (v + 6_755_399_441_055_744.0) - 6_755_399_441_055_744.0
    } else {
        v
    }
}

/// 1 - exp(-s / tau), a step for tau = 0.
fn approach(s: f64, tau: f64) -> f64 {
    if tau > 0.0 {
        -(-s / tau).exp_m1()
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests;
