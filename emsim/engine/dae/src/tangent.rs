//! Forward sensitivities s = dx/dp beside a run (staggered direct method):
//!
//! ```text
//!     d/dt (C s + dQ/dp) + G s + dF/dp = 0,      C = dQ/dx, G = dF/dx at x(t)                          (1)
//! ```
//!
//! linear in s, and for all parameters with the same matrix. Behind each accepted step it is solved on that step, with x(t) by the
//! step's own dense output, by the collocation method Radau IIA of order 5 (Hairer and Wanner, Solving ODEs II, IV.5): stiffly accurate,
//! so that algebraic rows hold at every stage. With A its matrix and Y = C s + dQ/dp,
//!
//! ```text
//!     sum_j (A^-1)_ij (Y_j - Y_0) + h (G_i s_i + dF/dp_i) = 0,      i = 1 .. 3                          (2)
//! ```
//!
//! one factorisation a step. Each step is solved in so many equal parts and in twice as many; the difference is the error estimate.
//!
//! C and G are exact. dQ/dp and dF/dp are differences of fourth order of the equations with other values of one parameter, at the same
//! x: compiled beside, `Beside`. Nothing is integrated with these.
//!
//! Y goes on through jumps, for charges and momenta do. Where a flag turns at a time tau(p) of the state's own, g(x(tau), tau, p) = 0,
//!
//! ```text
//!     dtau/dp = -(dg/dx s + dg/dp)/(dg/dt along x),      Y+ = Y- + (F+ - F-) dtau/dp                    (3)
//! ```
//!
//! (Barton, Allgor, Feehery and Galan 1998). Where momenta jump, the impact itself is solved with other values: tangent/impact.rs.
//!
//! A parameter may move the corners of sources. Then time goes at another pace between two of them, so that each stays where it is:
//! tangent/course.rs. What is told of a source's corner and of a flag, `turns`, says how they move with the parameters.
mod course;
mod impact;

use crate::ledger::Inside;
use crate::model::Law;
use crate::newton::Tolerances;
use crate::sparse::{Lu, Pattern, Singular, Symbolic};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};
use std::sync::Arc;

const STAGES: usize = 3; // of Radau IIA of order 5
const ROOT: f64 = 2.449_489_742_783_178; // sqrt 6
const NODES: [f64; STAGES] = [(4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0]; // Hairer and Wanner II, table IV.5.6
const A: [[f64; STAGES]; STAGES] = [
    [(88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0, (-2.0 + 3.0 * ROOT) / 225.0],
    [(296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0, (-2.0 - 3.0 * ROOT) / 225.0],
    [(16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0],
];

/// The same equations with another value of one parameter.
pub struct Beside {
    pub sys: Arc<System>,
    pub outputs: Tape,
    pub parameter: usize,
    /// how far the parameter is from its value
    pub by: f64,
    /// of these equations in the derivative
    pub weight: f64,
    pub w: Work,
    scratch: Vec<f64>,
    stretch: course::Stretch,
}

impl Beside {
    pub fn new(sys: Arc<System>, outputs: Tape, parameter: usize, (by, weight): (f64, f64)) -> Beside {
        let (w, scratch) = (sys.work(), outputs.workspace());
        Beside { sys, outputs, parameter, by, weight, w, scratch, stretch: course::Stretch::default() }
    }

    /// What does not fit the equations that it stands beside.
    pub fn differs(&self, sys: &System) -> bool {
        let names = |s: &System| s.unknowns.iter().map(|u| u.name.clone()).collect::<Vec<_>>();
        let flags = |s: &System| s.flags.iter().map(|f| f.name.clone()).collect::<Vec<_>>();
        let sums = |s: &System| s.sums.iter().map(|m| (m.node, m.root)).collect::<Vec<_>>();
        let own = &*self.sys;
        names(own) != names(sys)
            || flags(own) != flags(sys)
            || sums(own) != sums(sys)
            || own.waves.len() != sys.waves.len()
    }
}

/// Why there are no sensitivities.
#[derive(Clone, Debug, PartialEq)]
pub enum Refused {
    /// the equations read what this flag keeps of the state at an event
    Memory {
        t: f64,
        flag: usize,
    },
    /// momenta jump where this flag turns, and otherwise with other values
    Impact {
        t: f64,
        flag: usize,
    },
    /// this flag touches its threshold without crossing it, or turns together with another one
    Touch {
        t: f64,
        flag: usize,
    },
    /// the parameter parts corners of sources that fall together, or lets them change places
    Corner {
        t: f64,
        parameter: usize,
    },
    /// the equations with another value of the parameter are others, or have no start
    Other {
        parameter: usize,
    },
    Singular(Singular),
    Full,
}

/// C, G, dQ/dp and dF/dp at a point, the last two by parameter.
struct Point {
    c: Vec<f64>,
    g: Vec<f64>,
    q: Vec<Vec<f64>>,
    f: Vec<Vec<f64>>,
}

/// s at the stages of a part of a step, and Y at its end; by parameter.
struct Part {
    from: f64,
    h: f64,
    stages: [Vec<Vec<f64>>; STAGES],
    end: Vec<Vec<f64>>,
}

pub struct Tangent {
    besides: Vec<Beside>,
    count: usize,
    outputs: usize,
    sizes: Vec<f64>, // of the parameters
    tol: Tolerances,
    span: f64,
    own: Work,
    inverse: [[f64; STAGES]; STAGES],
    coupled: Option<Lu<f64>>,
    single: Option<Lu<f64>>,
    y: Vec<Vec<f64>>,
    s: Vec<Vec<f64>>,
    most: Vec<Vec<f64>>, // largest |s| of late
    fresh: bool,         // s is not known behind a jump
    parts: usize,
    at: f64,
    x: Vec<f64>,
    flags: Vec<f64>,
    last: f64,       // length of the last step
    rates: Vec<f64>, // of the flags' operands, at an event
    roots: Vec<f64>,
    slopes: Vec<f64>, // of the unknowns, there too
    corner: f64,
    /// time, then for each parameter the derivative of each output and that of the time itself: four rows for every part of a
    /// step, its ends and the stages
    pub rows: Vec<f64>,
    /// where something may jump: when before and behind it, and the derivative of that by each parameter, beside that of `rows`
    pub turns: Vec<f64>,
    pub refused: Option<Refused>,
}

impl Tangent {
    /// `sizes`: of the parameters, for tolerances; `tol` those of the run, which ends at `span`.
    pub fn new(sys: &System, besides: Vec<Beside>, sizes: Vec<f64>, tol: Tolerances, span: f64) -> Tangent {
        let (n, count) = (sys.n, sizes.len());
        let outputs = besides.first().map_or(0, |b| b.outputs.outputs());
        let other = besides.iter().find(|b| b.differs(sys)).map(|b| Refused::Other { parameter: b.parameter });
        Tangent {
            besides,
            count,
            outputs,
            sizes,
            tol,
            span,
            own: sys.work(),
            inverse: inverse(&A),
            coupled: None,
            single: None,
            y: vec![vec![0.0; n]; count],
            s: vec![vec![0.0; n]; count],
            most: vec![vec![0.0; n]; count],
            fresh: true,
            parts: 1,
            at: 0.0,
            x: Vec::new(),
            flags: Vec::new(),
            last: 0.0,
            rates: vec![0.0; sys.flags.len()],
            roots: vec![0.0; sys.flags.len()],
            slopes: vec![0.0; n],
            corner: 0.0,
            rows: Vec::new(),
            turns: Vec::new(),
            refused: other,
        }
    }

    /// Numbers in a row.
    pub fn width(&self) -> usize {
        1 + self.count * (self.outputs + 1)
    }

    /// The points where runs with other values begin, found by `start`: what is stored there is where Y begins.
    pub fn begin(&mut self, mut start: impl FnMut(&System, &mut Work) -> Option<Vec<f64>>) {
        if self.refused.is_some() {
            return;
        }
        for b in &mut self.besides {
            let Some(x) = start(&b.sys, &mut b.w) else {
                self.refused = Some(Refused::Other { parameter: b.parameter });
                return;
            };
            b.sys.touch_sources(&mut b.w);
            b.sys.eval(&mut b.w, &x, 0.0);
            for (y, q) in self.y[b.parameter].iter_mut().zip(&b.w.q) {
                *y += b.weight * q;
            }
        }
    }

    /// The run begins at (t, x).
    pub fn open(&mut self, sys: &System, w: &Work, t: f64, x: &[f64]) {
        self.own.gmin = w.gmin;
        self.besides.iter_mut().for_each(|b| b.w.gmin = w.gmin);
        self.flags = w.flags.clone();
        self.arrive(t, x);
        self.hold(sys, &w.flags);
    }

    fn arrive(&mut self, t: f64, x: &[f64]) {
        self.at = t;
        self.x.clear();
        self.x.extend_from_slice(x);
        self.fresh = true;
    }

    /// Flags as they are from here on.
    fn hold(&mut self, _sys: &System, flags: &[f64]) {
        self.flags.copy_from_slice(flags);
        self.own.flags.copy_from_slice(flags);
        self.besides.iter_mut().for_each(|b| b.w.flags.copy_from_slice(flags));
    }

    /// From t on, sources have the value before their jumps.
    fn until(&mut self, t: f64) {
        self.own.until(t);
        self.besides.iter_mut().for_each(|b| b.w.until(b.stretch.when(t)));
    }

    /// Something jumped: the run goes on from (t, x).
    pub fn jump(&mut self, sys: &System, w: &Work, t: f64, x: &[f64]) {
        if self.refused.is_none() && self.flags != w.flags {
            self.cross(sys, w, t, x);
        }
        self.hold(sys, &w.flags);
        self.arrive(t, x);
    }

    /// Flags have turned between (at, x-) and (t, x+).
    fn cross(&mut self, sys: &System, w: &Work, t: f64, x: &[f64]) {
        self.until(self.at);
        sys.eval(&mut self.own, &self.x, self.at);
        let before = self.own.f.clone();
        self.own.flags.copy_from_slice(&w.flags);
        self.own.until(f64::INFINITY);
        sys.eval(&mut self.own, x, t);
        let behind = self.own.f.clone();
        self.own.flags.copy_from_slice(&self.flags);
        if let Some(flag) = self.remembers(sys, w, t, x) {
            self.refused = Some(Refused::Memory { t, flag });
            return;
        }
        // this part of the run is its start
        if self.at <= 1e-12 * self.span && !self.strikes(sys, w) {
            return; // what stands on its threshold when the run begins turns then, whatever the parameters
        }
        let size = before.iter().zip(&behind).fold(0.0f64, |m, (a, b)| m.max(a.abs()).max(b.abs()));
        let alike = |i: usize| !sys.has_q[i] || (behind[i] - before[i]).abs() <= 1e-12 * size;
        let kink = (0..sys.n).all(alike) && !self.strikes(sys, w);
        self.own.until(self.at);
        let moves = match self.look_back(sys).map_err(Refused::Singular).and_then(|()| self.moves(sys, w, t)) {
            Ok(moves) => moves,
            Err(_) if kink => return,
            Err(why) => {
                self.refused = Some(why);
                return;
            }
        };
        self.turns.extend([self.at, t].iter().chain(&moves));
        if self.strikes(sys, w) {
            if let Err(why) = self.strike(sys, w, t, &moves) {
                self.refused = Some(why);
                return;
            }
            self.add(sys, &moves, |i| behind[i]);
        } else if !kink {
            self.add(sys, &moves, |i| behind[i] - before[i]);
        }
    }

    /// How unknowns and operands of flags change along the run, at the end of the last step. A step of implicit Euler of nearly no length h,
    /// (C + h G) dx/dt = -(F + dQ/dt + h dF/dt), with F = 0 where nothing is stored, and of half of that, extrapolated.
    fn look_back(&mut self, sys: &System) -> Result<(), Singular> {
        let (x, t) = (std::mem::take(&mut self.x), self.at);
        let least = 1e-6 * self.last;
        // slopes along time by a difference of third order, backwards
        let (mut q, mut f) = (vec![0.0; sys.n], vec![0.0; sys.n]);
        for (k, weight) in backward().into_iter().enumerate().rev() {
            sys.eval(&mut self.own, &x, t - 1e3 * least * k as f64);
            let weight = weight / (6e3 * least);
            q.iter_mut().zip(&self.own.q).for_each(|(sum, v)| *sum += weight * v);
            f.iter_mut().zip(&self.own.f).for_each(|(sum, v)| *sum += weight * v);
        }
        sys.eval_jacobian(&mut self.own, &x, t, false);
        let lu = made(&mut self.single, sys)?;
        self.slopes = vec![0.0; sys.n];
        for (h, share) in [(least, -1.0), (0.5 * least, 2.0)] {
            let matrix: Vec<f64> = self.own.cv.iter().zip(&self.own.gv).map(|(c, g)| c + h * g).collect();
            lu.factor(&matrix)?;
            let stored = |i: usize| if sys.has_q[i] { self.own.f[i] + q[i] } else { 0.0 };
            let mut b: Vec<f64> = (0..sys.n).map(|i| -stored(i) - h * f[i]).collect();
            lu.solve(&mut b);
            self.slopes.iter_mut().zip(&b).for_each(|(sum, v)| *sum += share * v);
        }
        self.rates.fill(0.0);
        for (k, weight) in backward().into_iter().enumerate().rev() {
            let back = 1e3 * least * k as f64;
            let along: Vec<f64> = x.iter().zip(&self.slopes).map(|(x, slope)| x - back * slope).collect();
            for flag in 0..sys.flags.len() {
                self.roots[flag] = sys.operand(&mut self.own, &along, t - back, flag);
                self.rates[flag] += weight / (6e3 * least) * self.roots[flag];
            }
        }
        self.x = x;
        Ok(())
    }

    /// What moves with an event, to Y.
    fn add(&mut self, sys: &System, moves: &[f64], change: impl Fn(usize) -> f64) {
        for (y, moved) in self.y.iter_mut().zip(moves) {
            (0..sys.n).filter(|&i| sys.has_q[i]).for_each(|i| y[i] += change(i) * moved);
        }
    }

    /// How the time of the event at `at` moves with each parameter.
    fn moves(&mut self, sys: &System, w: &Work, t: f64) -> Result<Vec<f64>, Refused> {
        let changed = |k: usize| self.flags[k] != w.flags[k];
        let holds = |k: usize| sys.flags[k].law.remembers() || sys.flags[k].law == Law::Kept;
        let mut turned: Vec<usize> = (0..self.flags.len()).filter(|&k| changed(k) && !holds(k)).collect();
        // what slides the other way is in the mode that it was in
        let heads = sys.laws.list.iter().filter(|law| law.flags.iter().any(|&k| changed(k))).map(|law| law.flags[0]);
        turned.extend(heads);
        turned.sort_unstable();
        turned.dedup();
        // that which has crossed, and those that have with it; the others follow at the same time
        let off = |k: usize| if self.roots[k] == 0.0 { 0.0 } else { (self.roots[k] / self.rates[k]).abs() };
        turned.sort_by(|&a, &b| off(a).total_cmp(&off(b)));
        // others turn by themselves at the same time so near, or by the tolerance
        let near = 1e-9_f64.max(self.tol.reltol) * self.last;
        // the condition whose event it is lies so near to its zero, in steps
        let first = turned.iter().copied().find(|&k| self.rates[k] != 0.0 && off(k) <= 1e-2 * self.last);
        let crossed: Vec<usize> = match first {
            _ if self.jumps(sys, t) => Vec::new(),
            Some(first) => {
                turned.iter().copied().filter(|&k| k == first || self.rates[k] != 0.0 && off(k) <= near).collect()
            }
            None => return Err(Refused::Touch { t, flag: turned.first().copied().unwrap_or(0) }),
        };
        (0..self.count).map(|p| self.moved(p, &crossed, t)).collect()
    }

    /// The same by one parameter, of those that have crossed.
    fn moved(&mut self, p: usize, crossed: &[usize], t: f64) -> Result<f64, Refused> {
        let mut moves: Option<f64> = None;
        for &k in crossed {
            let moved = -self.operand(p, k) / self.rates[k];
            let rounding = self.tol.reltol * self.last / self.sizes[p];
            // two conditions of one time have one derivative of it, to this
            let same = |m: f64| (moved - m).abs() <= 1e-2 * m.abs().max(moved.abs()) + rounding;
            if !moved.is_finite() || !moves.is_none_or(same) {
                return Err(Refused::Touch { t, flag: k });
            }
            moves.get_or_insert(moved);
        }
        Ok(moves.unwrap_or(0.0))
    }

    /// Does a source jump here, before t? What turns then, turns at the source's time.
    fn jumps(&self, sys: &System, t: f64) -> bool {
        let before = self.at * (1.0 - 1e-9);
        let jump = |at: f64, wave: &crate::waves::Wave| at <= t && wave.value(at) != wave.value_before(at);
        sys.waves.iter().any(|wave| jump(wave.next_breakpoint(before), wave))
    }

    /// A memory that has changed, and that the equations read.
    fn remembers(&mut self, sys: &System, w: &Work, t: f64, x: &[f64]) -> Option<usize> {
        let changed = |&k: &usize| sys.flags[k].law.remembers() && self.flags[k] != w.flags[k];
        let memories: Vec<usize> = (0..self.flags.len()).filter(changed).collect();
        let before = (self.own.f.clone(), self.own.q.clone(), self.own.flags.clone());
        let found = memories.into_iter().find(|&k| {
            self.own.flags.copy_from_slice(&w.flags);
            sys.eval(&mut self.own, x, t);
            let (f, q) = (self.own.f.clone(), self.own.q.clone());
            self.own.flags[k] += 1e-3 * w.flags[k].abs().max(1e-3);
            sys.eval(&mut self.own, x, t);
            self.own.f != f || self.own.q != q
        });
        (self.own.f, self.own.q, self.own.flags) = before;
        found
    }

    /// The whole derivative of a flag's operand at the end of the last step.
    fn operand(&mut self, p: usize, flag: usize) -> f64 {
        let mut sum = 0.0;
        for b in self.besides.iter_mut().filter(|b| b.parameter == p) {
            let x: Vec<f64> = self.x.iter().zip(&self.s[p]).map(|(x, s)| x + b.by * s).collect();
            sum += b.weight * b.sys.operand(&mut b.w, &x, b.stretch.when(self.at), flag);
        }
        sum
    }

    /// An accepted step up to (t1, x1).
    pub fn step(&mut self, sys: &System, w: &mut Work, t1: f64, x1: &[f64], inside: &Inside) {
        if self.refused.is_some() || t1 <= self.at {
            return;
        }
        if let Err(why) = self.advance(sys, w, t1, x1, inside) {
            self.refused = Some(why);
        }
        sys.set_time(w, t1);
    }

    fn advance(&mut self, sys: &System, w: &mut Work, t1: f64, x1: &[f64], inside: &Inside) -> Result<(), Refused> {
        if self.flags != w.flags {
            self.hold(sys, &w.flags.clone());
        }
        self.corners(sys)?;
        self.until(t1);
        let whole = t1 - self.at;
        if self.fresh {
            // values behind a jump are those after this part of the next step
            self.behind(sys, 1e-6 * whole / self.parts as f64).map_err(Refused::Singular)?;
        }
        let mut coarse = self.solve(sys, w, (t1, x1), self.parts, inside)?;
        loop {
            let fine = self.solve(sys, w, (t1, x1), 2 * self.parts, inside)?;
            let error = self.error(sys, &coarse, &fine);
            // parts of a step at most
            if error <= 1.0 || 2 * self.parts >= 64 {
                if error < 1.0 / 64.0 && self.parts > 1 {
                    self.parts /= 2;
                }
                self.write(sys, w, (t1, x1), &fine, inside)?;
                let last = fine.into_iter().next_back().expect("a step has parts");
                let [_, _, s] = last.stages;
                (self.s, self.y) = (s, last.end);
                break;
            }
            self.parts *= 2;
            coarse = fine;
        }
        for (most, s) in self.most.iter_mut().zip(&self.s) {
            // it fades: what a short spike was is no measure of what follows it
            most.iter_mut().zip(s).for_each(|(m, s)| *m = (0.7 * *m).max(s.abs()));
        }
        self.tol.observe(x1, t1);
        self.arrive(t1, x1);
        (self.last, self.fresh) = (whole, false);
        Ok(())
    }

    /// s from Y behind a jump, a short while after it: (C + h G) s = Y - dQ/dp - h dF/dp.
    fn behind(&mut self, sys: &System, h: f64) -> Result<(), Singular> {
        let x = std::mem::take(&mut self.x);
        let point = self.point(sys, self.at, &x);
        self.x = x;
        let matrix: Vec<f64> = point.c.iter().zip(&point.g).map(|(c, g)| c + h * g).collect();
        let lu = made(&mut self.single, sys)?;
        lu.factor(&matrix)?;
        for p in 0..self.count {
            let stored = self.y[p].iter().zip(&point.q[p]).zip(&point.f[p]);
            self.s[p] = stored.map(|((y, q), f)| y - q - h * f).collect();
            lu.solve(&mut self.s[p]);
        }
        Ok(())
    }

    fn point(&mut self, sys: &System, t: f64, x: &[f64]) -> Point {
        sys.eval_jacobian(&mut self.own, x, t, false);
        let (mut q, mut f) = (vec![vec![0.0; sys.n]; self.count], vec![vec![0.0; sys.n]; self.count]);
        for b in &mut self.besides {
            b.sys.eval(&mut b.w, x, b.stretch.when(t));
            let pace = b.weight * b.stretch.pace();
            q[b.parameter].iter_mut().zip(&b.w.q).for_each(|(sum, v)| *sum += b.weight * v);
            f[b.parameter].iter_mut().zip(&b.w.f).for_each(|(sum, v)| *sum += pace * v);
        }
        Point { c: self.own.cv.clone(), g: self.own.gv.clone(), q, f }
    }

    /// The state at a time inside the step that ends at (t1, x1).
    fn look(&self, sys: &System, w: &mut Work, t: f64, (t1, x1): (f64, &[f64]), inside: &Inside) -> Vec<f64> {
        if t >= t1 {
            return x1.to_vec();
        }
        let mut x = vec![0.0; sys.n];
        (inside.dense)(t, &mut x);
        sys.pin(w, t, &mut x);
        x
    }

    /// Equation (2) over the step in equal parts.
    fn solve(
        &mut self,
        sys: &System,
        w: &mut Work,
        end: (f64, &[f64]),
        parts: usize,
        inside: &Inside,
    ) -> Result<Vec<Part>, Refused> {
        let (t0, whole, n) = (self.at, end.0 - self.at, sys.n);
        if self.coupled.is_none() {
            self.coupled = Some(Lu::new(&Symbolic::analyse(&three(&sys.pattern)).map_err(Refused::Singular)?));
        }
        let h = whole / parts as f64;
        let mut found: Vec<Part> = Vec::with_capacity(parts);
        for part in 0..parts {
            let from = t0 + part as f64 * h;
            let mut points = Vec::with_capacity(STAGES);
            for (j, c) in NODES.iter().enumerate() {
                let t = if part + 1 == parts && j + 1 == STAGES { end.0 } else { from + c * h };
                let x = self.look(sys, w, t, end, inside);
                points.push(self.point(sys, t, &x));
            }
            let values = coupled(&sys.pattern, &self.inverse, &points, h);
            let lu = self.coupled.as_mut().expect("made above");
            lu.factor_or_refactor(&values).map_err(Refused::Singular)?;
            let mut stages: [Vec<Vec<f64>>; STAGES] = Default::default();
            let mut ends = Vec::with_capacity(self.count);
            for p in 0..self.count {
                let y = found.last().map_or(&self.y[p], |before| &before.end[p]);
                let mut b = vec![0.0; STAGES * n];
                for i in 0..STAGES {
                    for k in 0..n {
                        let stored = |j: usize| self.inverse[i][j] * (y[k] - points[j].q[p][k]);
                        b[i * n + k] = (0..STAGES).map(stored).sum::<f64>() - h * points[i].f[p][k];
                    }
                }
                lu.solve(&mut b);
                if b.iter().any(|v| !v.is_finite()) {
                    return Err(Refused::Singular(Singular { col: None, row: None, structural: false, finite: false }));
                }
                let (last, point) = (&b[(STAGES - 1) * n..], &points[STAGES - 1]);
                let mut kept = point.q[p].clone();
                for col in 0..n {
                    for k in sys.pattern.colptr[col]..sys.pattern.colptr[col + 1] {
                        kept[sys.pattern.rowidx[k]] += point.c[k] * last[col];
                    }
                }
                ends.push(kept);
                b.chunks_exact(n).zip(&mut stages).for_each(|(s, stage)| stage.push(s.to_vec()));
            }
            found.push(Part { from, h, stages, end: ends });
        }
        Ok(found)
    }

    /// Of the coarser solution at the step's end, in units of the tolerance; and of the finer one, of which it is a sixteenth, where its
    /// polynomials are farthest from their nodes.
    fn error(&self, sys: &System, coarse: &[Part], fine: &[Part]) -> f64 {
        let weights = middle();
        let mut worst = 0.0f64;
        for p in 0..self.count {
            let mut before = &self.s[p];
            for (k, part) in coarse.iter().enumerate() {
                let [a, b, end] = [0, 1, 2].map(|j| &part.stages[j][p]);
                let [half, last] = [2 * k, 2 * k + 1].map(|j| &fine[j].stages[STAGES - 1][p]);
                let of = if k + 1 == coarse.len() { 1.0 } else { 0.0 };
                for i in (0..sys.n).filter(|&i| sys.differential[i] && self.tol.atol[i].is_finite()) {
                    let within = [before[i], a[i], b[i], end[i]].iter().zip(weights).map(|(s, w)| s * w).sum::<f64>();
                    let off = ((within - half[i]).abs() / 16.0).max(of * (end[i] - last[i]).abs());
                    let most = self.most[p][i].max(last[i].abs());
                    worst = worst.max(off / (self.tol.reltol * most + self.tol.atol[i] / self.sizes[p]));
                }
                before = end;
            }
        }
        worst
    }

    /// The derivatives of the outputs go to the rows.
    fn write(
        &mut self,
        sys: &System,
        w: &mut Work,
        end: (f64, &[f64]),
        parts: &[Part],
        inside: &Inside,
    ) -> Result<(), Refused> {
        // more numbers than this are too many to keep: 256 MB
        if self.rows.len() + 4 * parts.len() * self.width() > (1 << 25) {
            return Err(Refused::Full);
        }
        for (k, part) in parts.iter().enumerate() {
            let before = match k {
                0 => std::mem::take(&mut self.s),
                _ => parts[k - 1].stages[STAGES - 1].clone(),
            };
            let x = if k == 0 { self.x.clone() } else { self.look(sys, w, part.from, end, inside) };
            self.row(part.from, &x, &before);
            for (j, (c, s)) in NODES.iter().zip(&part.stages).enumerate() {
                let t = if k + 1 == parts.len() && j + 1 == STAGES { end.0 } else { part.from + c * part.h };
                let x = self.look(sys, w, t, end, inside);
                self.row(t, &x, s);
            }
        }
        Ok(())
    }

    fn row(&mut self, t: f64, x: &[f64], s: &[Vec<f64>]) {
        let (first, wide) = (self.rows.len() + 1, self.outputs + 1);
        self.rows.push(t);
        self.rows.resize(first + self.count * wide, 0.0);
        for b in &mut self.besides {
            let moved: Vec<f64> = x.iter().zip(&s[b.parameter]).map(|(x, s)| x + b.by * s).collect();
            let there = b.stretch.when(t);
            b.sys.set_time(&mut b.w, there);
            b.outputs.run(&Inputs { x: &moved, t: there, waves: &b.w.waves, flags: &b.w.flags }, &mut b.scratch);
            let row = &mut self.rows[first + b.parameter * wide..][..wide];
            for (k, sum) in row[..self.outputs].iter_mut().enumerate() {
                *sum += b.weight * b.outputs.output(&b.scratch, k);
            }
            row[self.outputs] += b.weight * (there - t);
        }
    }
}

/// The pattern of three by three blocks.
fn three(of: &Pattern) -> Pattern {
    let (mut colptr, mut rowidx) = (vec![0], Vec::with_capacity(STAGES * STAGES * of.rowidx.len()));
    for _ in 0..STAGES {
        for col in 0..of.n {
            for i in 0..STAGES {
                rowidx.extend(of.column(col).iter().map(|r| i * of.n + r));
            }
            colptr.push(rowidx.len());
        }
    }
    Pattern { n: STAGES * of.n, colptr, rowidx }
}

/// The matrix of equation (2) on it.
fn coupled(of: &Pattern, inverse: &[[f64; STAGES]; STAGES], points: &[Point], h: f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(STAGES * STAGES * of.rowidx.len());
    for (j, point) in points.iter().enumerate() {
        for col in 0..of.n {
            let places = of.colptr[col]..of.colptr[col + 1];
            for (i, row) in inverse.iter().enumerate() {
                let own = if i == j { h } else { 0.0 };
                values.extend(places.clone().map(|k| row[j] * point.c[k] + own * point.g[k]));
            }
        }
    }
    values
}

/// Weights of a slope at the last of four points, by six times their distance.
fn backward() -> [f64; 4] {
    [11.0, -18.0, 9.0, -2.0]
}

/// Weights of the values at the start of a part and at its stages, in its middle.
fn middle() -> [f64; STAGES + 1] {
    let nodes = [0.0, NODES[0], NODES[1], NODES[2]];
    nodes.map(|own| nodes.iter().filter(|&&x| x != own).map(|x| (0.5 - x) / (own - x)).product())
}

/// By cofactors.
fn inverse(a: &[[f64; STAGES]; STAGES]) -> [[f64; STAGES]; STAGES] {
    let minor = |i: usize, j: usize| {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        a[r][c] * a[s][d] - a[r][d] * a[s][c]
    };
    let determinant: f64 = (0..STAGES).map(|j| a[0][j] * minor(0, j)).sum();
    let mut out = [[0.0; STAGES]; STAGES];
    for (i, row) in out.iter_mut().enumerate() {
        for (j, v) in row.iter_mut().enumerate() {
            *v = minor(j, i) / determinant;
        }
    }
    out
}

/// Factors of a single matrix, made when first needed.
fn made<'a>(single: &'a mut Option<Lu<f64>>, sys: &System) -> Result<&'a mut Lu<f64>, Singular> {
    if single.is_none() {
        *single = Some(Lu::new(sys.symbolic()?));
    }
    Ok(single.as_mut().expect("made above"))
}
