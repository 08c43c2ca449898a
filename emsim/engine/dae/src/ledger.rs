//! Energy accounts: integrals of powers along the solution, and energies at its two ends.
//!
//! A power is integrated as if it were one more row of equation (1), by the formula that took the step: sum_j b_j P(X_j) over
//! the stages, which solve the equations and balance each for itself (Tellegen), so that the account is of the method's order and
//! no worse than the solution. Between its stages the solution of a stiff circuit is not known: a polynomial that overshoots
//! there by a tenth of a volt is 50 times the current of a diode. Methods whose dense output is all there is (explicit
//! ones, multistep ones) have it integrated by Gauss-Legendre's rule with three nodes (order 6) on each of `parts`
//! equal parts of the step. Sums are compensated (Kahan), a million small steps lose nothing. What then remains of
//!
//!   energy(end) - energy(start) - supplied + dissipated
//!
//! is the error of the solution itself. Devices keep accounts of their own: heat is the integral of v i(v), the
//! energy of their charges is a function of the voltages, like that of a capacitor.
mod timed;

use self::timed::Timed;
use crate::graph::{Graph, Id};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};

/// Gauss' rule of order 6 on (0, 1), places 1/2 -+ sqrt(15)/10 and weights: it integrates polynomials of degree 5.
pub const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

#[derive(Clone, Copy, Default)]
pub struct Sum {
    value: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, v: f64) {
        let y = v - self.lost;
        let t = self.value + y;
        self.lost = (t - self.value) - y;
        self.value = t;
    }
}

/// An accepted step, as its method knows the inside.
pub struct Inside<'a> {
    /// dense output; it is best taken in so many parts
    pub dense: &'a dyn Fn(f64, &mut [f64]),
    pub parts: usize,
    pub stages: &'a dyn Fn() -> Stages<'a>,
}

/// The states that a step was computed by, with their times, may be none; and their weights, in units of the step, in
/// integrals from its start to the end of each of some equal parts.
#[derive(Default)]
pub struct Stages<'a> {
    pub at: Vec<(f64, &'a [f64])>,
    pub weights: &'a [Vec<f64>],
}

pub struct Ledger {
    powers: Tape,
    timed: Timed, // what time alone decides of them
    energies: Tape,
    power_scratch: Vec<f64>,
    energy_scratch: Vec<f64>,
    sums: Vec<Sum>,
    heat: Vec<Sum>,    // of every device
    charged: Vec<f64>, // energy of every device's charge at the start
    stored: Vec<f64>,  // and its growth, at the end
    moved: Vec<f64>,   // of every power and device: its parts without their sign [J]
    swing: Vec<f64>,   // of every energy: how far it has been from where it began [J]
    steps: u32,
    /// energies at the start and at the end [J]; empty before
    pub first: Vec<f64>,
    pub last: Vec<f64>,
    at: f64,
    x: Vec<f64>,
    inside: Vec<f64>,
    /// rows of time, powers' integrals, heat and charge energy of every device, energies; one for every part of a step
    pub trace: Option<Vec<f64>>,
    started: bool,
    /// powers that work in impulses too
    pub impulsive: Vec<usize>,
}

impl Ledger {
    pub fn new(g: &Graph, powers: &[Id], energies: &[Id], traced: bool) -> Ledger {
        let timed = Timed::new(g, powers);
        let (powers, energies) = (Tape::new(g, powers), Tape::new(g, energies));
        Ledger {
            timed,
            power_scratch: powers.workspace(),
            energy_scratch: energies.workspace(),
            sums: vec![Sum::default(); powers.outputs()],
            powers,
            energies,
            heat: Vec::new(),
            charged: Vec::new(),
            stored: Vec::new(),
            moved: Vec::new(),
            swing: Vec::new(),
            steps: 0,
            first: Vec::new(),
            last: Vec::new(),
            at: 0.0,
            x: Vec::new(),
            inside: Vec::new(),
            trace: traced.then(Vec::new),
            started: false,
            impulsive: Vec::new(),
        }
    }

    /// The accounts open at t with the state x.
    pub fn open(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.heat = vec![Sum::default(); sys.devices()];
        self.inside = x.to_vec();
        self.jump(t, x);
        self.first = self.energies(sys, w);
        self.charged = sys.device_energies(w, x);
        self.moved = vec![0.0; self.sums.len() + self.heat.len()];
        self.swing = vec![0.0; self.first.len()];
        self.started = true;
        self.note(sys, w);
    }

    /// Something jumped: time and state move on, no power flows.
    pub fn jump(&mut self, t: f64, x: &[f64]) {
        self.at = t;
        self.timed.jump(t);
        self.x.clear();
        self.x.extend_from_slice(x);
    }

    /// Impulses flowed in a step of length h that ends at t, with the state x, whose speeds are the mean of both sides: what works in them.
    pub fn jolt(&mut self, sys: &System, w: &mut Work, (t, h): (f64, f64), x: &[f64]) {
        if !self.started || self.impulsive.is_empty() {
            return;
        }
        let mut flows = Vec::new();
        self.flow(sys, w, t, x, |_, power| flows.push(power));
        for &k in &self.impulsive {
            self.sums[k].add(h * flows[k]);
            self.moved[k] += (h * flows[k]).abs();
        }
    }

    /// An accepted step up to t1 with the state x1.
    pub fn step(&mut self, sys: &System, w: &mut Work, t1: f64, x1: &[f64], inside: &Inside) {
        let (t0, whole) = (self.at, t1 - self.at);
        if whole <= 0.0 {
            return;
        }
        let stages = (inside.stages)();
        if stages.at.is_empty() {
            let h = whole / inside.parts as f64;
            for part in 0..inside.parts {
                let before = self.accounts();
                let start = t0 + part as f64 * h;
                for (c, weight) in GAUSS {
                    let mut x = self.look(sys, w, start + c * h, inside);
                    self.flow(sys, w, start + c * h, &x, |sum, power| sum.add(h * weight * power));
                    std::mem::swap(&mut self.inside, &mut x);
                }
                self.count(&before);
                if part + 1 < inside.parts {
                    self.pause(sys, w, start + h, inside);
                }
            }
        } else {
            self.by_stages(sys, w, (t0, whole), &stages, inside);
        }
        self.timed.advance(sys, w, t1, x1);
        self.jump(t1, x1);
        self.note(sys, w);
        self.steps += 1;
        // steps between looks at the energies
        if self.steps % 8 == 0 {
            let now = self.energies(sys, w);
            for (swing, (now, first)) in self.swing.iter_mut().zip(now.iter().zip(&self.first)) {
                *swing = swing.max((now - first).abs());
            }
        }
    }

    fn accounts(&self) -> Vec<Sum> {
        self.sums.iter().chain(&self.heat).copied().collect()
    }

    /// What has moved since, without its sign.
    fn count(&mut self, before: &[Sum]) {
        let after = self.sums.iter().chain(&self.heat);
        for (moved, (after, before)) in self.moved.iter_mut().zip(after.zip(before)) {
            *moved += (after.value - before.value).abs();
        }
    }

    /// A long step may hold a whole swing: what has moved is counted part by part.
    fn by_stages(&mut self, sys: &System, w: &mut Work, (t0, h): (f64, f64), stages: &Stages, inside: &Inside) {
        let mut flows = Vec::new();
        for (t, x) in &stages.at {
            self.flow(sys, w, *t, x, |_, power| flows.push(power));
        }
        let accounts = self.sums.len() + self.heat.len();
        let parts = stages.weights.len();
        let before = self.accounts();
        for (part, weights) in stages.weights.iter().enumerate() {
            let until_here = self.accounts();
            for (k, (sum, before)) in self.sums.iter_mut().chain(&mut self.heat).zip(&before).enumerate() {
                *sum = *before;
                sum.add(h * weights.iter().enumerate().map(|(j, b)| b * flows[j * accounts + k]).sum::<f64>());
            }
            self.count(&until_here);
            if part + 1 < parts {
                self.pause(sys, w, t0 + (part + 1) as f64 * h / parts as f64, inside);
            }
        }
    }

    /// The solution inside the step, in the ledger's own buffer.
    fn look(&mut self, sys: &System, w: &mut Work, t: f64, inside: &Inside) -> Vec<f64> {
        let mut x = std::mem::take(&mut self.inside);
        (inside.dense)(t, &mut x);
        sys.pin(w, t, &mut x);
        x
    }

    /// A row of the trace inside the step.
    fn pause(&mut self, sys: &System, w: &mut Work, t: f64, inside: &Inside) {
        if self.trace.is_some() {
            let mut x = self.look(sys, w, t, inside);
            self.timed.advance(sys, w, t, &x);
            self.jump(t, &x);
            std::mem::swap(&mut self.inside, &mut x);
            self.note(sys, w);
        }
    }

    /// All powers at (t, x), in order.
    fn flow(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], mut take: impl FnMut(&mut Sum, f64)) {
        sys.set_time(w, t);
        let at = Inputs { x, t, waves: &w.waves, flags: &w.flags };
        self.powers.run(&at, &mut self.power_scratch);
        let timed = self.timed.at(&at);
        for (k, sum) in self.sums.iter_mut().enumerate() {
            take(sum, self.powers.output(&self.power_scratch, k) - timed[k]);
        }
        let heat = &mut self.heat;
        sys.each_power(w, x, |k, power| take(&mut heat[k], power));
    }

    fn energies(&mut self, sys: &System, w: &mut Work) -> Vec<f64> {
        sys.set_time(w, self.at);
        let at = Inputs { x: &self.x, t: self.at, waves: &w.waves, flags: &w.flags };
        self.energies.run(&at, &mut self.energy_scratch);
        (0..self.energies.outputs()).map(|k| self.energies.output(&self.energy_scratch, k)).collect()
    }

    fn note(&mut self, sys: &System, w: &mut Work) {
        if self.trace.is_none() {
            return;
        }
        let energies = self.energies(sys, w);
        let trace = self.trace.as_mut().expect("seen above");
        trace.push(self.at);
        trace.extend(self.sums.iter().zip(&self.timed.sums).map(|(s, timed)| s.value + timed.value));
        let charged = sys.device_energies(w, &self.x);
        let devices = self.heat.iter().zip(charged.iter().zip(&self.charged));
        trace.extend(devices.flat_map(|(heat, (now, first))| [heat.value, now - first]));
        trace.extend(energies);
    }

    /// The end of the run: energies are read once more.
    pub fn close(&mut self, sys: &System, w: &mut Work) {
        if self.started {
            self.last = self.energies(sys, w);
            let charged = sys.device_energies(w, &self.x);
            self.stored = charged.iter().zip(&self.charged).map(|(now, first)| now - first).collect();
        }
    }

    /// Energy that went through each power and each device, back and forth, and the farthest that each energy has been from
    /// its start [J].
    pub fn turned_over(&self) -> (Vec<f64>, &[f64]) {
        let timed = self.timed.moved.iter().copied().chain(std::iter::repeat(0.0));
        (self.moved.iter().zip(timed).map(|(moved, timed)| moved + timed).collect(), &self.swing)
    }

    /// Integrals of the powers [J].
    pub fn powers(&self) -> Vec<f64> {
        self.sums.iter().zip(&self.timed.sums).map(|(s, timed)| s.value + timed.value).collect()
    }

    /// Heat and charge energy of every device [J].
    pub fn devices(&self) -> Vec<(f64, f64)> {
        self.heat.iter().map(|h| h.value).zip(self.stored.iter().copied()).collect()
    }
}
