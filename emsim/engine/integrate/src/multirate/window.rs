//! What the circuit did in one macro step: its rows and steps, and the moments of what the machine reads of it.
//!
//! P y is the projection on polynomials of degree `MOMENTS` - 1: with Legendre's P_m and s in [-1, 1] on the macro step,
//!   P y = sum_m c_m P_m(s),   c_m = (2 m + 1)/H  integral y(t) P_m(s) dt,
//! integrated over every step of the circuit on its dense output by Gauss' rule with three nodes (order 6). Degree 2, because
//! more of it is ripple cut off at the ends of the macro step rather than the course of the mean.
use super::super::rows::Sink;
use crate::ledger::{Inside, GAUSS};
use crate::system::{ExchangedInputs, Polynomial, System, Work, DEGREE};

const MOMENTS: usize = 3; // coefficients of a parabola
const NODES: usize = 3; // of Gauss' rule of order 6, which integrates its square exactly
/// Integrals on [0, 1] up to Gauss' nodes.
const UP_TO: [[f64; NODES]; NODES] = [
    [5.0 / 36.0, -0.035_976_667_524_938_9, 0.009_789_444_015_308_33],
    [0.300_263_194_980_864_57, 2.0 / 9.0, -0.022_485_417_203_132_7],
    [0.267_988_333_762_469_45, 0.480_421_111_969_383_34, 5.0 / 36.0],
];

#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Open,
    Row,
    Jump,
    Step,
}

pub struct Item {
    pub kind: Kind,
    pub t: f64,
    at: usize, // of its state in `data`, behind it those inside the step
    flags: usize,
    start: f64, // of the step
}

pub struct Window {
    centre: f64,
    half: f64,
    covered: f64, // integrated so far
    n: usize,
    reads: Vec<usize>,
    moments: Vec<[f64; MOMENTS]>, // integral of y P_m ds
    projection: Vec<[f64; MOMENTS]>,
    pub items: Vec<Item>,
    data: Vec<f64>, // y; of each input the integral from the start, and the integral of that
    before: usize,  // items of before this macro step
    waiting: usize, // items from here on wait for their integrals
    versions: Vec<Vec<f64>>,
    follows: bool, // accounts are kept: steps and leaps are needed
    inner: [Vec<f64>; NODES],
    twice: Vec<f64>, // integral of the integral of each input, so far
}

impl Window {
    pub fn new(n: usize, reads: &[usize], follows: bool) -> Window {
        Window {
            centre: 0.0,
            half: 1.0,
            covered: 0.0,
            n,
            reads: reads.to_vec(),
            moments: vec![[0.0; MOMENTS]; reads.len()],
            projection: vec![[0.0; MOMENTS]; reads.len()],
            items: Vec::new(),
            data: Vec::new(),
            before: 0,
            waiting: 0,
            versions: Vec::new(),
            follows,
            inner: std::array::from_fn(|_| vec![0.0; n]),
            twice: vec![0.0; reads.len()],
        }
    }

    /// A macro step begins, or begins anew; what came before it stays until it is taken.
    pub fn begin(&mut self, start: f64, end: f64) {
        (self.centre, self.half, self.covered) = (0.5 * (start + end), 0.5 * (end - start), start);
        self.moments.fill([0.0; MOMENTS]);
        self.items.truncate(self.before);
        let end = |i: &Item| i.at + self.width() * if i.kind == Kind::Step { 1 + NODES } else { 1 };
        self.data.truncate(self.items.last().map_or(0, end));
        self.waiting = self.before;
        self.twice.fill(0.0);
    }

    /// What there is comes before the next macro step.
    pub fn hold(&mut self) {
        self.before = self.items.len();
    }

    /// All has been taken.
    pub fn clear(&mut self) {
        self.items.clear();
        self.data.clear();
        self.versions.clear();
        self.before = 0;
    }

    pub fn place(&self, t: f64) -> f64 {
        (t - self.centre) / self.half
    }

    fn width(&self) -> usize {
        self.n + 2 * self.reads.len()
    }

    pub fn flags(&self, item: &Item) -> &[f64] {
        &self.versions[item.flags]
    }

    /// y, and the two integrals of each input of the machine.
    pub fn state(&self, item: &Item) -> (&[f64], &[f64]) {
        self.data[item.at..item.at + self.width()].split_at(self.n)
    }

    /// The same at the node of the step that t is.
    pub fn inside(&self, item: &Item, t: f64) -> (&[f64], &[f64]) {
        let theta = (t - item.start) / (item.t - item.start);
        let k = if theta < 0.3 {
            1
        } else if theta < 0.7 {
            2
        } else {
            3
        };
        let at = item.at + k * self.width();
        self.data[at..at + self.width()].split_at(self.n)
    }

    fn integral(&self, input: usize) -> f64 {
        self.moments[input][0] * self.half
    }

    fn push(&mut self, kind: Kind, w: &Work, t: f64, y: &[f64]) {
        if self.versions.last().is_none_or(|f| *f != w.flags) {
            self.versions.push(w.flags.clone());
        }
        let (at, flags) = (self.data.len(), self.versions.len() - 1);
        self.data.extend_from_slice(y);
        for j in 0..self.reads.len() {
            self.data.extend([self.integral(j), self.twice[j]]);
        }
        self.items.push(Item { kind, t, at, flags, start: self.covered });
    }

    /// Fills the machine's exchanged with P y.
    pub fn moments(&mut self, exchanged: &mut ExchangedInputs) {
        (exchanged.centre, exchanged.half) = (self.centre, self.half);
        for ((p, c), m) in exchanged.values.iter_mut().zip(&mut self.projection).zip(&self.moments) {
            for (k, (c, m)) in c.iter_mut().zip(m).enumerate() {
                *c = (k as f64 + 0.5) * m;
            }
            p.0 = [0.0; DEGREE + 1];
            p.0[..MOMENTS].copy_from_slice(&powers(c));
        }
    }

    /// Integral of P y from the start of the step, and the integral of that: polynomials in s.
    pub fn projected(&self, input: usize) -> (Polynomial, Polynomial) {
        let mut p = Polynomial::default();
        p.0[..MOMENTS].copy_from_slice(&powers(&self.projection[input]));
        let once = integral(&p, self.half);
        (once, integral(&once, self.half))
    }
}

impl Sink for Window {
    fn row(&mut self, _sys: &System, w: &mut Work, t: f64, y: &[f64]) {
        self.push(Kind::Row, w, t, y);
    }

    fn reads(&self) -> &[u32] {
        &[]
    }

    fn open(&mut self, _sys: &System, w: &mut Work, t: f64, y: &[f64]) {
        if self.follows {
            self.push(Kind::Open, w, t, y);
        }
        self.waiting = self.items.len();
    }

    fn jump(&mut self, _sys: &System, w: &mut Work, t: f64, y: &[f64]) {
        // the little time that it took belongs to the next step
        if self.follows {
            self.push(Kind::Jump, w, t, y);
        }
        self.waiting = self.items.len();
    }

    fn step(&mut self, _sys: &System, w: &mut Work, t: f64, y: &[f64], inside: &Inside) {
        let dense = inside.dense;
        let (from, length) = (self.covered, t - self.covered);
        if length <= 0.0 {
            self.waiting = self.items.len();
            return;
        }
        let mut inner = std::mem::take(&mut self.inner);
        // rows inside the step: their own integral from its start; the one at its end gets the whole one
        for k in self.waiting..self.items.len() {
            let (at, part) = (self.items[k].at + self.n, self.items[k].t - from);
            if part < length {
                for (node, weight) in GAUSS {
                    dense(from + node * part, &mut inner[0]);
                    for (j, &i) in self.reads.iter().enumerate() {
                        let impulse = weight * part * inner[0][i];
                        self.data[at + 2 * j] += impulse;
                        self.data[at + 2 * j + 1] += (1.0 - node) * part * impulse;
                    }
                }
                for j in 0..self.reads.len() {
                    self.data[at + 2 * j + 1] += part * self.integral(j);
                }
            }
        }
        for ((node, _), inner) in GAUSS.into_iter().zip(&mut inner) {
            dense(from + node * length, inner);
        }
        let start: Vec<(f64, f64)> = (0..self.reads.len()).map(|j| (self.integral(j), self.twice[j])).collect();
        for ((twice, (once, _)), &i) in self.twice.iter_mut().zip(&start).zip(&self.reads) {
            let rest = GAUSS.iter().zip(&inner).map(|((c, w), y)| w * (1.0 - c) * y[i]);
            *twice += length * (once + length * rest.sum::<f64>());
        }
        for ((node, weight), inner) in GAUSS.into_iter().zip(&inner) {
            let p = legendre(self.place(from + node * length));
            for (m, &i) in self.moments.iter_mut().zip(&self.reads) {
                let part = inner[i] * weight * length / self.half;
                for (m, p) in m.iter_mut().zip(&p) {
                    *m += part * p;
                }
            }
        }
        if let Some(last) = self.items[self.waiting..].last().filter(|last| last.t >= t) {
            let at = last.at + self.n;
            for j in 0..self.reads.len() {
                (self.data[at + 2 * j], self.data[at + 2 * j + 1]) = (self.integral(j), self.twice[j]);
            }
        }
        if self.follows {
            self.push(Kind::Step, w, t, y);
            for (up_to, y) in UP_TO.iter().zip(&inner) {
                self.data.extend_from_slice(y);
                for (&i, (once, twice)) in self.reads.iter().zip(&start) {
                    let up =
                        |to: &[f64; NODES]| once + length * to.iter().zip(&inner).map(|(a, y)| a * y[i]).sum::<f64>();
                    let course: f64 = up_to.iter().zip(&UP_TO).map(|(a, to)| a * up(to)).sum();
                    self.data.extend([up(up_to), twice + length * course]);
                }
            }
        }
        self.covered = t;
        self.waiting = self.items.len();
        self.inner = inner;
    }

    fn close(&mut self, _sys: &System, _w: &mut Work) {}
}

/// Integral over time from s = -1; `p` is of a degree less than there is room for.
fn integral(p: &Polynomial, half: f64) -> Polynomial {
    let mut integral = Polynomial::default();
    for k in 0..DEGREE {
        integral.0[k + 1] = half * p.0[k] / (k + 1) as f64;
    }
    integral.0[0] = -integral.at(-1.0);
    integral
}

/// Legendre's polynomials in powers of s.
fn powers(c: &[f64; MOMENTS]) -> [f64; MOMENTS] {
    [c[0] - 0.5 * c[2], c[1], 1.5 * c[2]]
}

fn legendre(s: f64) -> [f64; MOMENTS] {
    [1.0, s, 1.5 * s * s - 0.5]
}
