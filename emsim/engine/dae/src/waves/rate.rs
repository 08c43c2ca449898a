//! dw/dt of a waveform, exactly: what follows from a source's slope (a current into a capacitor across it, ddt()) is as right as the source.
use super::{passed, Pulse, Pwl, Shape, Side, Wave};
use std::f64::consts::TAU;

impl Wave {
    /// dw/dt at t; at a corner the slope before it or after it. Jumps have none.
    pub fn rate(&self, t: f64, before: bool) -> f64 {
        self.rates(t, if before { Side::Before } else { Side::After })[0]
    }

    /// ... and d2w/dt2.
    fn rates(&self, t: f64, side: Side) -> [f64; 2] {
        match &self.shape {
            Shape::Dc(_) | Shape::Guest => [0.0; 2],
            Shape::Input(input, _) => [input.slope(), 0.0],
            Shape::Slope(of) => [of.rates(t, side)[1], 0.0],
            Shape::Pulse(pulse) => [pulse.rate(t, side), 0.0],
            Shape::Pwl(pwl) => [pwl.rate(t, side), 0.0],
            Shape::Sin { delay, .. } | Shape::Am { delay, .. } if !passed(t - delay, 0.0, 0.0, side) => [0.0; 2],
            Shape::Sin { amplitude, frequency, delay, damping, phase, .. } => {
                let s = t - delay;
                let (sin, slope) = wave(*frequency, s, *phase);
                let of_sin = damping * damping - (TAU * frequency).powi(2);
                let bends = of_sin * sin - 2.0 * damping * slope;
                [slope - damping * sin, bends].map(|of| amplitude * of * (-s * damping).exp())
            }
            Shape::Exp { low, high, rise_at, rise_tau, fall_at, fall_tau } => {
                let of = |from: f64, tau: f64| match tau > 0.0 && passed(t, from, 0.0, side) {
                    true => [(-(t - from) / tau).exp() / tau, -(-(t - from) / tau).exp() / (tau * tau)],
                    false => [0.0; 2],
                };
                let falls = if passed(t, *rise_at, 0.0, side) { of(*fall_at, *fall_tau) } else { [0.0; 2] };
                let rises = of(*rise_at, *rise_tau);
                [0, 1].map(|k| (high - low) * (rises[k] - falls[k]))
            }
            Shape::Sffm { amplitude, carrier, index, signal, carrier_phase, signal_phase, .. } => {
                let (sin, slope) = wave(*signal, t, *signal_phase);
                let angle = TAU * (carrier * t - (carrier * t).floor()) + carrier_phase + index * sin;
                let turns = TAU * carrier + index * slope;
                let bends = angle.cos() * index * (TAU * signal).powi(2) * sin + angle.sin() * turns * turns;
                [amplitude * angle.cos() * turns, -amplitude * bends]
            }
            Shape::Am { amplitude, offset, modulation, carrier, delay, phase } => {
                let s = t - delay;
                let ((low, low_slope), (high, high_slope)) = (wave(*modulation, s, *phase), wave(*carrier, s, *phase));
                let (slow, fast) = ((TAU * modulation).powi(2), (TAU * carrier).powi(2));
                let bends = 2.0 * low_slope * high_slope - (slow * low + fast * (offset + low)) * high;
                [amplitude * (low_slope * high + (offset + low) * high_slope), amplitude * bends]
            }
        }
    }

    /// Its rate as a wave of its own; None where it jumps, where nobody knows ahead what it will be, and of a rate.
    pub fn slope(&self) -> Option<Wave> {
        let goes_on = match &self.shape {
            Shape::Guest | Shape::Input(_, true) | Shape::Slope(_) => false,
            Shape::Dc(_) | Shape::Input(_, false) | Shape::Sin { .. } | Shape::Sffm { .. } => true,
            Shape::Pulse(Pulse { v1, v2, period, corners: [rise, top, fall], .. }) => {
                v1 == v2 || *rise > 0.0 && fall > top && period >= fall
            }
            Shape::Pwl(pwl) => pwl.goes_on(),
            Shape::Exp { rise_at, rise_tau, fall_at, fall_tau, .. } => {
                *rise_tau > 0.0 && *fall_tau > 0.0 && rise_at <= fall_at
            }
            Shape::Am { phase, .. } => *phase == 0.0,
        };
        // a DC value of its own is another start
        let starts = self.dc.is_none_or(|dc| dc == self.value_before(0.0));
        (goes_on && starts).then(|| Wave { shape: Shape::Slope(Box::new(self.clone())), dc: Some(0.0) })
    }
}

/// sin(2 pi f s + phase) and its derivative with respect to s.
fn wave(f: f64, s: f64, phase: f64) -> (f64, f64) {
    let cycles = f * s;
    let (sin, cos) = (TAU * (cycles - cycles.floor()) + phase).sin_cos();
    (sin, TAU * f * cos)
}

impl Pulse {
    fn rate(&self, t: f64, side: Side) -> f64 {
        let Some((s, snap)) = self.fold(t, side) else { return 0.0 };
        let [rise, top, fall] = self.corners;
        if !passed(s, rise, snap, side) {
            (self.v2 - self.v1) / rise
        } else if passed(s, top, snap, side) && !passed(s, fall, snap, side) {
            (self.v1 - self.v2) / (fall - top)
        } else {
            0.0
        }
    }
}

impl Pwl {
    /// Is there no jump in it?
    fn goes_on(&self) -> bool {
        let upright = |i: usize| self.times[i] == self.times[i + 1] && self.values[i] != self.values[i + 1];
        let again = self.repeat.map(|from| self.at(self.delay + from, Side::After));
        !(0..self.times.len() - 1).any(upright) && again.is_none_or(|v| Some(&v) == self.values.last())
    }

    fn rate(&self, t: f64, side: Side) -> f64 {
        let (i, ..) = self.passed(t, side);
        if i == 0 || i == self.times.len() {
            return 0.0;
        }
        (self.values[i] - self.values[i - 1]) / (self.times[i] - self.times[i - 1])
    }
}
