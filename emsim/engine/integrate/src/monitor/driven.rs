//! What drives: frequencies at which an oscillation is held up, not left to itself (monitor.rs).
use crate::system::{Phase, System};
use crate::waves::Wave;
use std::f64::consts::TAU;

/// So many frequencies at most are taken with their sums and differences: products of few sines, not a spectrum.
const MIXED: usize = 4;
/// Phases that are looked at, of larger machines the first ones.
const MOST: usize = 32;
/// A shaft turns that goes on by a radian and more in a burst, as fast in both halves to this share.
const EVEN: f64 = 0.1;
const TURNS: f64 = 1.0;
/// Frequencies that agree to this share are one, and so are harmonics up to this order.
const SAME: f64 = 0.02;
const HARMONICS: f64 = 20.5;

pub struct Drives {
    fixed: Vec<f64>,    // sources and sines of time [Hz]
    shafts: Vec<Phase>, // that may turn
    times: Vec<f64>,
    angles: Vec<f64>,  // by time, then shaft
    turning: Vec<f64>, // frequencies of those that did in the last burst
}

impl Drives {
    pub fn new(sys: &System) -> Drives {
        let (clocks, shafts): (Vec<_>, Vec<_>) = sys.phases.iter().cloned().partition(|p| p.of.is_empty());
        let mut fixed: Vec<f64> = sys.waves.iter().filter_map(Wave::frequency).collect();
        fixed.extend(clocks.iter().map(|p| p.clock.abs() / TAU));
        mix(&mut fixed);
        let shafts = shafts.into_iter().take(MOST).collect();
        Drives { fixed, shafts, times: Vec::new(), angles: Vec::new(), turning: Vec::new() }
    }

    /// A sample of the burst, its first one where `first`.
    pub fn sample(&mut self, first: bool, t: f64, x: &[f64]) {
        if self.shafts.is_empty() {
            return;
        }
        if first {
            self.times.clear();
            self.angles.clear();
        }
        self.times.push(t);
        self.angles.extend(self.shafts.iter().map(|p| p.at(t, x)));
    }

    /// The burst ended: which shafts turned, and how fast?
    pub fn finish(&mut self) {
        self.turning.clear();
        let n = self.shafts.len();
        let last = self.times.len().saturating_sub(1);
        for k in 0..n {
            let angle = |j: usize| self.angles[j * n + k];
            let rate = |from: usize, to: usize| (angle(to) - angle(from)) / (self.times[to] - self.times[from]);
            let (mean, middle) = (rate(0, last), last / 2);
            let even = (rate(0, middle) - rate(middle, last)).abs() < EVEN * mean.abs();
            if even && (angle(last) - angle(0)).abs() > TURNS {
                self.turning.push(mean.abs() / TAU);
            }
        }
        if !self.turning.is_empty() && self.fixed.len() <= MIXED {
            self.turning.extend(&self.fixed);
            mix(&mut self.turning);
        }
    }

    /// Of what drove in the last burst, which harmonic is an oscillation of this period? The lowest one.
    pub fn harmonic(&self, period: f64) -> Option<u32> {
        let order = |&f: &f64| {
            let ratio = 1.0 / (f * period);
            let near = ratio > 0.5 && ratio < HARMONICS && (ratio - ratio.round()).abs() < SAME * ratio.min(1.0);
            near.then_some(ratio.round() as u32)
        };
        self.fixed.iter().chain(&self.turning).filter_map(order).min()
    }
}

/// Sums and differences of few frequencies beside them: products of sines have these.
fn mix(frequencies: &mut Vec<f64>) {
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup();
    if frequencies.len() > MIXED {
        return;
    }
    let n = frequencies.len();
    for (k, j) in (0..n).flat_map(|k| (0..k).map(move |j| (k, j))) {
        let (a, b) = (frequencies[k], frequencies[j]);
        frequencies.extend([a + b, a - b]);
    }
}
