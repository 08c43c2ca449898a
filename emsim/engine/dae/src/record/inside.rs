//! What lies inside the steps: outputs at Chebyshev's points of every accepted step, by the method's own dense output.
//!
//! Values at n + 1 such points are a polynomial of degree n, so that crossings, extremes and integrals of a step are those of its
//! dense output, whatever the rows are. The start of a step has the values behind a jump there.
use super::Record;
use crate::graph::{Graph, Id};
use crate::ledger::Inside;
use crate::system::{System, Work};
use std::f64::consts::PI;

pub struct Samples {
    record: Record,
    degree: usize,
    nodes: Vec<f64>, // on 0 .. 1, between the ends
    from: f64,       // steps that end before are of no use
    at: f64,
    x: Vec<f64>,
    inside: Vec<f64>,
    full: bool,
}

impl Samples {
    pub fn new(g: &Graph, outputs: &[Id], degree: usize, from: f64) -> Samples {
        let degree = degree.max(2);
        let node = |j: usize| 0.5 - 0.5 * (PI * j as f64 / degree as f64).cos();
        Samples {
            record: Record::new(g, outputs),
            degree,
            nodes: (1..degree).map(node).collect(),
            from,
            at: 0.0,
            x: Vec::new(),
            inside: Vec::new(),
            full: false,
        }
    }

    /// The run goes on from (t, x).
    pub fn begin(&mut self, t: f64, x: &[f64]) {
        self.at = t;
        self.x.clear();
        self.x.extend_from_slice(x);
    }

    /// An accepted step up to (t1, x1). Corners of sources that no step ends at part it.
    pub fn step(&mut self, sys: &System, w: &mut Work, t1: f64, x1: &[f64], inside: &Inside) {
        if t1 > self.at && t1 > self.from && !self.full {
            let silent = self.record.shows_silent(sys);
            let mut t0 = self.at;
            while t0 < t1 {
                let corner = if silent { sys.next_silent_corner(t0) } else { f64::INFINITY };
                let end = if corner > t0 { corner.min(t1) } else { t1 };
                self.part(sys, w, (t0, end), (t1, x1), inside);
                t0 = end;
            }
            sys.set_time(w, t1);
        }
        self.begin(t1, x1);
    }

    fn part(&mut self, sys: &System, w: &mut Work, (a, b): (f64, f64), (t1, x1): (f64, &[f64]), inside: &Inside) {
        let rows = self.record.data.len();
        for j in 0..=self.degree {
            let t = match j {
                0 => a,
                j if j == self.degree => b,
                j => a + self.nodes[j - 1] * (b - a),
            };
            if t == self.at {
                self.record.push(sys, w, t, &self.x);
            } else if t == t1 {
                self.record.push(sys, w, t, x1);
            } else {
                self.inside.resize(x1.len(), 0.0);
                (inside.dense)(t, &mut self.inside);
                sys.pin(w, t, &mut self.inside);
                self.record.push(sys, w, t, &self.inside);
            }
        }
        let written = self.record.data.len() - rows;
        // more numbers than this are too many to keep: 128 MB
        if self.record.data.len() > (1 << 24) || written != (self.degree + 1) * self.record.columns {
            (self.full, self.record.data) = (true, Vec::new());
        }
    }

    /// Rows of time and outputs, so many and one for every step; none where they were too many.
    pub fn rows(&self) -> &Record {
        &self.record
    }
}
