//! Energy accounts: integrals of powers along the solution, and energies at its two ends.
//!
//! A power is integrated over every accepted step on the method's own dense output, by Gauss-Legendre's rule with three
//! nodes (order 6) on each of `parts` equal parts of the step, so that the account is no worse than the solution; sums are
//! compensated (Kahan), a million small steps lose nothing. What then remains of
//!
//!   energy(end) - energy(start) - supplied + dissipated
//!
//! is the error of the solution itself. Junction diodes keep accounts of their own: heat is the integral of v i(v), the
//! energy of their charge that of v dq.
use crate::graph::{Graph, Id};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};

const NODES: [f64; 3] = [0.112_701_665_379_258_31, 0.5, 0.887_298_334_620_741_7];
const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];

#[derive(Clone, Copy, Default)]
struct Sum {
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

#[derive(Clone, Copy, Default)]
struct Junction {
    v: f64,
    q: f64,
    heat: Sum,
    stored: Sum,
}

pub struct Ledger {
    powers: Tape,
    energies: Tape,
    power_scratch: Vec<f64>,
    energy_scratch: Vec<f64>,
    sums: Vec<Sum>,
    junctions: Vec<Junction>,
    /// energies at the start and at the end [J]; empty before
    pub first: Vec<f64>,
    pub last: Vec<f64>,
    at: f64,
    x: Vec<f64>,
    inside: Vec<f64>,
    /// rows of time, powers' integrals, heat and charge energy of every diode, energies; one for every part of a step
    pub trace: Option<Vec<f64>>,
    started: bool,
}

impl Ledger {
    pub fn new(g: &Graph, powers: &[Id], energies: &[Id], traced: bool) -> Ledger {
        let (powers, energies) = (Tape::new(g, powers), Tape::new(g, energies));
        Ledger {
            power_scratch: powers.workspace(),
            energy_scratch: energies.workspace(),
            sums: vec![Sum::default(); powers.outputs()],
            powers,
            energies,
            junctions: Vec::new(),
            first: Vec::new(),
            last: Vec::new(),
            at: 0.0,
            x: Vec::new(),
            inside: Vec::new(),
            trace: traced.then(Vec::new),
            started: false,
        }
    }

    /// The accounts open at t with the state x.
    pub fn open(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.junctions = vec![Junction::default(); sys.diodes()];
        self.inside = x.to_vec();
        self.leap(sys, w, t, x);
        self.first = self.energies(sys, w);
        self.started = true;
        self.note(sys, w);
    }

    /// Something jumped: time and state move on, no power flows.
    pub fn leap(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.at = t;
        self.x.clear();
        self.x.extend_from_slice(x);
        let junctions = &mut self.junctions;
        sys.each_diode(w, x, |k, v, _, q| (junctions[k].v, junctions[k].q) = (v, q));
    }

    /// An accepted step up to t1 with the state x1; `dense` is inside it.
    pub fn step(
        &mut self,
        sys: &System,
        w: &mut Work,
        t1: f64,
        x1: &[f64],
        parts: usize,
        dense: &dyn Fn(f64, &mut [f64]),
    ) {
        let (t0, whole) = (self.at, t1 - self.at);
        if whole <= 0.0 {
            return;
        }
        let h = whole / parts as f64;
        for part in 0..parts {
            let start = t0 + part as f64 * h;
            for (c, weight) in NODES.into_iter().zip(WEIGHTS) {
                let t = start + c * h;
                dense(t, &mut self.inside);
                sys.pin(w, t, &mut self.inside);
                sys.set_time(w, t);
                let at = Inputs { x: &self.inside, t, waves: &w.waves, flags: &w.flags };
                self.powers.run(&at, &mut self.power_scratch);
                for (k, sum) in self.sums.iter_mut().enumerate() {
                    sum.add(h * weight * self.powers.output(&self.power_scratch, k));
                }
                let junctions = &mut self.junctions;
                sys.each_diode(w, &self.inside, |k, v, i, q| {
                    let j = &mut junctions[k];
                    j.heat.add(h * weight * v * i);
                    j.stored.add(0.5 * (v + j.v) * (q - j.q));
                    (j.v, j.q) = (v, q);
                });
            }
            if self.trace.is_some() && part + 1 < parts {
                let t = start + h;
                dense(t, &mut self.inside);
                sys.pin(w, t, &mut self.inside);
                let inside = std::mem::take(&mut self.inside);
                self.x.copy_from_slice(&inside);
                self.inside = inside;
                self.at = t;
                self.note(sys, w);
            }
        }
        let junctions = &mut self.junctions;
        sys.each_diode(w, x1, |k, v, _, q| {
            let j = &mut junctions[k];
            j.stored.add(0.5 * (v + j.v) * (q - j.q));
            (j.v, j.q) = (v, q);
        });
        self.at = t1;
        self.x.copy_from_slice(x1);
        self.note(sys, w);
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
        trace.extend(self.sums.iter().map(|s| s.value));
        trace.extend(self.junctions.iter().flat_map(|j| [j.heat.value, j.stored.value]));
        trace.extend(energies);
    }

    /// The end of the run: energies are read once more.
    pub fn close(&mut self, sys: &System, w: &mut Work) {
        if self.started {
            self.last = self.energies(sys, w);
        }
    }

    /// Integrals of the powers [J].
    pub fn powers(&self) -> Vec<f64> {
        self.sums.iter().map(|s| s.value).collect()
    }

    /// Heat and charge energy of every diode [J].
    pub fn diodes(&self) -> Vec<(f64, f64)> {
        self.junctions.iter().map(|j| (j.heat.value, j.stored.value)).collect()
    }
}
