//! Values of the past: what an expression was a fixed time ago. A row reads it as a source, which is known ahead for as long as the
//! shortest delay; no step is longer. What was there is kept as polynomials, one a step, of the method's own dense output.
//!
//! A corner at t is one at t + by for as long as anything of it is left: a jump or a kink that is nothing beside the largest value
//! so far makes none. Before a run begins the delayed is the expression itself: the row has a term for that, with a wave that is 1 until then.
use super::exchanged::{Polynomial, DEGREE};
use super::{System, Work};
use crate::graph::Graph;
use crate::model::Delay;
use crate::rounding::{ROUNDED, SUMMED};
use crate::tape::{Inputs, Tape};
use std::collections::VecDeque;

/// A corner counts where the value jumps, or the slope within a delay changes it, by more than this of the largest value so far.
const KINK: f64 = 1e-6;

#[derive(Default)]
pub struct Delays {
    pub list: Vec<Delay>,
    of: Option<Tape>,
    still: Option<usize>,
}

impl Delays {
    pub fn new(g: &Graph, list: Vec<Delay>, still: Option<usize>) -> Delays {
        let of = (!list.is_empty()).then(|| Tape::new(g, &list.iter().map(|d| d.of).collect::<Vec<_>>()));
        Delays { list, of, still }
    }

    pub fn shortest(&self) -> f64 {
        self.list.iter().map(|d| d.by).fold(f64::INFINITY, f64::min)
    }

    pub fn past(&self) -> Past {
        let course = |d: &Delay| Course { by: d.by, wave: d.wave, initial: d.initial, largest: 0.0 };
        let courses = self.list.iter().map(course).collect();
        Past { courses, still: self.still, fit: fit(), ..Past::default() }
    }
}

struct Course {
    by: f64,
    wave: usize,
    initial: f64,
    largest: f64,
}

struct Piece {
    from: f64,
    to: f64,
    of: Vec<Polynomial>, // of each delay
}

struct Corner {
    at: f64,
    of: Option<Vec<bool>>, // whether it is one for each delay; unknown until there is a step behind it
}

#[derive(Default)]
pub struct Past {
    courses: Vec<Course>,
    pieces: VecDeque<Piece>,
    corners: VecDeque<Corner>,
    from: f64, // where the next piece begins
    still: Option<usize>,
    begun: bool,
    fit: Vec<[f64; DEGREE + 1]>,
}

impl Past {
    /// Values at t in place of those waves; `before`: at a jump the value before it.
    #[inline]
    pub fn write(&self, t: f64, before: bool, waves: &mut [f64]) {
        let Some(still) = self.still else { return };
        waves[still] = f64::from(!self.begun);
        if !self.begun {
            return;
        }
        for (k, c) in self.courses.iter().enumerate() {
            waves[c.wave] = self.value(k, t, before);
        }
    }

    /// A run begins: until then there is no past.
    pub fn begin(&mut self) {
        self.begun = true;
    }

    fn value(&self, k: usize, t: f64, before: bool) -> f64 {
        let (s, tol) = (t - self.courses[k].by, SUMMED * t.abs());
        let place = match before {
            true => self.pieces.partition_point(|p| p.from < s - tol).checked_sub(1),
            false => Some(self.pieces.partition_point(|p| p.to <= s + tol).min(self.pieces.len().saturating_sub(1))),
        };
        match place.and_then(|place| self.pieces.get(place)) {
            Some(p) if s >= p.from - tol || place != Some(0) => p.of[k].at(p.place(s.clamp(p.from, p.to))),
            _ => self.courses[k].initial,
        }
    }

    /// The first corner after t.
    pub fn next_corner(&self, t: f64) -> f64 {
        let later = |b: f64| b > t + SUMMED * b.abs();
        (0..self.courses.len()).filter_map(|k| self.due(k, later).next()).fold(f64::INFINITY, f64::min)
    }

    /// Is there one at t?
    pub fn corner_at(&self, t: f64) -> bool {
        let tol = SUMMED * t.abs();
        (0..self.courses.len()).any(|k| self.due(k, |b| b >= t - tol).next().is_some_and(|b| b <= t + tol))
    }

    /// When corners of delay k come again, in order, from the first that `from` is true of on.
    fn due(&self, k: usize, from: impl Fn(f64) -> bool) -> impl Iterator<Item = f64> + '_ {
        let by = self.courses[k].by;
        let first = self.corners.partition_point(|c| !from(c.at + by));
        self.corners.range(first..).filter(move |c| c.of.as_ref().is_none_or(|of| of[k])).map(move |c| c.at + by)
    }

    /// Something may bend or jump at t.
    pub fn corner(&mut self, t: f64) {
        if !self.courses.is_empty() && self.corners.back().is_none_or(|c| c.at < t) {
            self.corners.push_back(Corner { at: t, of: None });
        }
    }

    /// The run goes on from t.
    pub fn resume(&mut self, t: f64) {
        self.from = t;
    }

    /// Of a piece from where the last one ended.
    fn add(&mut self, to: f64, samples: &[Vec<f64>]) {
        let polynomial = |k: usize| {
            let mut p = Polynomial::default();
            for (c, row) in p.0.iter_mut().zip(&self.fit) {
                *c = row.iter().zip(samples).map(|(f, s)| f * s[k]).sum();
            }
            p
        };
        let piece = Piece { from: self.from, to, of: (0..self.courses.len()).map(polynomial).collect() };
        for (k, c) in self.courses.iter_mut().enumerate() {
            c.largest = samples.iter().fold(c.largest.max(c.initial.abs()), |m, s| m.max(s[k].abs()));
        }
        if let Some(corner) = self.corners.back_mut().filter(|c| c.of.is_none()) {
            let last = self.pieces.back();
            let counts = |(k, c): (usize, &Course)| {
                let [before, after] =
                    [last.map(|p| p.end(k, 1.0)), Some(piece.end(k, -1.0))].map(|end| end.unwrap_or((c.initial, 0.0)));
                (after.0 - before.0).abs() > ROUNDED * c.largest || (after.1 - before.1).abs() * c.by > KINK * c.largest
            };
            corner.of = Some(self.courses.iter().enumerate().map(counts).collect());
        }
        self.pieces.push_back(piece);
        self.from = to;
        let longest = self.courses.iter().map(|c| c.by).fold(0.0, f64::max);
        let old = to - 1.01 * longest;
        while self.pieces.len() > 2 && self.pieces[1].to < old {
            self.pieces.pop_front();
        }
        while self.corners.front().is_some_and(|c| c.at < old) {
            self.corners.pop_front();
        }
    }
}

impl Piece {
    fn place(&self, t: f64) -> f64 {
        (2.0 * t - self.from - self.to) / (self.to - self.from)
    }

    /// Value and slope at an end.
    fn end(&self, k: usize, s: f64) -> (f64, f64) {
        let c = &self.of[k].0;
        let slope = (1..=DEGREE).rev().fold(0.0, |sum, j| sum * s + j as f64 * c[j]);
        (self.of[k].at(s), slope * 2.0 / (self.to - self.from))
    }
}

/// Where pieces are sampled, on [-1, 1].
fn nodes() -> [f64; DEGREE + 1] {
    std::array::from_fn(|j| -(std::f64::consts::PI * j as f64 / DEGREE as f64).cos())
}

/// Coefficients from values at the nodes: the inverse of Vandermonde's matrix, by the products that are Lagrange's polynomials.
fn fit() -> Vec<[f64; DEGREE + 1]> {
    let x = nodes();
    let mut rows = vec![[0.0; DEGREE + 1]; DEGREE + 1];
    for j in 0..=DEGREE {
        let (mut p, mut below) = ([0.0; DEGREE + 1], 1.0);
        p[0] = 1.0;
        for i in (0..=DEGREE).filter(|&i| i != j) {
            for c in (0..=DEGREE).rev() {
                p[c] = if c > 0 { p[c - 1] } else { 0.0 } - x[i] * p[c];
            }
            below *= x[j] - x[i];
        }
        for (row, c) in rows.iter_mut().zip(p) {
            row[j] = c / below;
        }
    }
    rows
}

impl System {
    /// What was there before the start: the same as at the start.
    pub fn begin_past(&self, w: &mut Work, x: &[f64], given: bool) {
        if self.delays.still.is_none() {
            return;
        }
        if let (Some(tape), false) = (&self.delays.of, given) {
            let values = tape.eval(&Inputs { x, t: 0.0, waves: &w.waves, flags: &w.flags });
            w.past.courses.iter_mut().zip(values).for_each(|(c, v)| c.initial = v);
        }
        w.past.begin();
        if self.delays.of.is_none() {
            return self.touch_sources(w);
        }
        w.past.corner(0.0);
        self.touch_sources(w);
    }

    /// A step to t is done.
    pub fn keep_past(&self, w: &mut Work, t: f64, dense: &dyn Fn(f64, &mut [f64]), x: &mut [f64]) {
        let Some(tape) = &self.delays.of else { return };
        let from = w.past.from;
        if t <= from {
            return;
        }
        let mut samples = Vec::with_capacity(DEGREE + 1);
        for s in nodes() {
            let at = if s >= 1.0 { t } else { from + 0.5 * (1.0 + s) * (t - from) };
            dense(at, x);
            self.set_time(w, at);
            samples.push(tape.eval(&Inputs { x, t: at, waves: &w.waves, flags: &w.flags }).to_vec());
        }
        w.past.add(t, &samples);
    }
}
