//! The rows of a record: the print grid between the steps, and the forces in each row.
//!
//! In a stiffly accurate collocation method multipliers and derivatives that are only shown are of order s where the
//! coordinates are of order 2s - 1 (Hairer and Wanner 1996, table VII.4.1), in a diagonally implicit one of the stages' order,
//! 2, of gear's formulas and the trapezoid's their own, by steps that are none of theirs; what the dense output gives is worse. But they are functions of the state: where a row shows them they
//! are computed anew, at index 1. The state is brought onto its constraints (Newton's method with what stands under d/dt
//! held), and three implicit Euler steps of nearly no length, h, 2h and 4h, are extrapolated to none.
mod poses;

use super::driver::Transient;
use super::Method;
use crate::events::Check;
use crate::ledger::Inside;
use crate::newton::{Newton, Tolerances};
pub use crate::op::undetermined;
use crate::op::{hold, Stays};
use crate::record::Record;
use crate::system::{Kind, System, Work};
pub use poses::Poses;

/// Length of those steps in units of the method's step: the error goes with its third power, rounding with its inverse.
const SHORT: f64 = 1e-4;
/// Rounding, of so much of the run, asks for more where a step is a first one and shorter than anything moves, but for no more of
/// it than this.
const ROUNDED: f64 = 1e-10;
const MOST: f64 = 1e-2;
/// After a jump nothing says how fast things move: so much of the stretch that begins.
const SHORTER: f64 = 1e-6;

/// Where the rows of a run go, and what follows its steps.
pub trait Sink {
    fn row(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]);
    /// Signals may bend or jump at the row of time t.
    fn corner(&mut self, _t: f64) {}
    /// Unknowns that the rows show; none where they are all of use.
    fn reads(&self) -> &[u32];
    /// Do they show anything of sources that only edges read?
    fn shows_silent(&self, _sys: &System) -> bool {
        true
    }
    /// Do the algebraic equations hold at (t, x)?
    fn holds(&mut self, _sys: &System, _w: &mut Work, _t: f64, _x: &[f64]) -> bool {
        true
    }
    /// Rows follow that lie within the step from x0 to x1, a first one behind a jump or not.
    fn within_step(&mut self, _x0: &[f64], _x1: &[f64], _first: bool) {}
    /// The run begins at (t, x).
    fn open(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]);
    /// Something jumped: (t, x) is where the run goes on.
    fn jump(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]);
    /// Impulses flowed in a step of nearly no length that ends at t with the state x, efforts over it among it.
    fn jolt(&mut self, _sys: &System, _w: &mut Work, _step: (f64, f64), _x: &[f64]) {}
    /// An accepted step ends at (t, x).
    fn step(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], inside: &Inside);
    /// The run ends.
    fn close(&mut self, sys: &System, w: &mut Work);
}

impl Sink for Record {
    fn row(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.push(sys, w, t, x);
    }

    fn corner(&mut self, t: f64) {
        if self.corners.last().is_none_or(|&last| last < t) {
            self.corners.push(t);
        }
    }

    fn reads(&self) -> &[u32] {
        Record::reads(self)
    }

    fn shows_silent(&self, sys: &System) -> bool {
        Record::shows_silent(self, sys)
    }

    fn holds(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> bool {
        self.invariants.as_mut().is_none_or(|invariants| invariants.holds(sys, w, t, x))
    }

    fn within_step(&mut self, x0: &[f64], x1: &[f64], first: bool) {
        self.invariants.iter_mut().for_each(|invariants| invariants.within_step(x0, x1, first));
    }

    fn open(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        if let Some(samples) = &mut self.samples {
            samples.begin(t, x);
        }
        if let Some(ledger) = &mut self.ledger {
            ledger.open(sys, w, t, x);
        }
        if let Some(tangent) = &mut self.tangent {
            tangent.open(sys, w, t, x);
        }
    }

    fn jump(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        if let Some(samples) = &mut self.samples {
            samples.begin(t, x);
        }
        if let Some(ledger) = &mut self.ledger {
            ledger.jump(t, x);
        }
        if let Some(tangent) = &mut self.tangent {
            tangent.jump(sys, w, t, x);
        }
    }

    fn jolt(&mut self, sys: &System, w: &mut Work, step: (f64, f64), x: &[f64]) {
        if let Some(ledger) = &mut self.ledger {
            ledger.jolt(sys, w, step, x);
        }
    }

    fn step(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], inside: &Inside) {
        if let Some(samples) = &mut self.samples {
            samples.step(sys, w, t, x, inside);
        }
        if let Some(ledger) = &mut self.ledger {
            ledger.step(sys, w, t, x, inside);
        }
        if let Some(tangent) = &mut self.tangent {
            tangent.step(sys, w, t, x, inside);
        }
    }

    fn close(&mut self, sys: &System, w: &mut Work) {
        if let Some(invariants) = &mut self.invariants {
            invariants.close(sys, w);
        }
        if let Some(ledger) = &mut self.ledger {
            ledger.close(sys, w);
        }
    }
}

/// What a method knows less well than the state. Step by step it may be far worse: the error estimate is that of the state, which a
/// step of any length may have right (a torque that is constant), and a trapezoidal stage lets multipliers swing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Lags {
    Nothing,
    /// multipliers, reactions and accelerations of a machine
    Forces,
    /// these, and what else is of higher index
    Index,
}

impl Lags {
    /// Steps of a fixed length show what the method gives.
    pub fn unless(fixed: bool, lags: Lags) -> Lags {
        if fixed {
            Lags::Nothing
        } else {
            lags
        }
    }
}

/// What computes the forces of rows.
pub struct Forces {
    newton: Newton,
    lags: Vec<bool>,  // unknowns of higher index
    given: Vec<bool>, // those that have what a source has
    /// rows show forces of a machine
    pub of_machine: bool,
}

impl Forces {
    /// None where no row shows an unknown of higher index.
    pub fn new(sys: &System, reads: &[u32]) -> Option<Forces> {
        if reads.iter().all(|&k| sys.differential[k as usize]) {
            return None;
        }
        let mut lags = undetermined(sys);
        let lagging = || reads.iter().map(|&k| k as usize).filter(|&k| lags[k]);
        lagging().next()?;
        // nodes that capacitors tie together go along with what they have in common
        let tied: Vec<usize> = sys.sums.iter().filter(|s| s.tied && lags[s.root]).map(|s| s.node).collect();
        let of_machine = lagging().any(|k| matches!(sys.unknowns[k].kind, Kind::Lambda | Kind::Derivative));
        tied.into_iter().for_each(|node| lags[node] = true);
        Some(Forces { newton: Newton::new(sys).ok()?, lags, given: sys.alone(), of_machine })
    }

    /// Length to settle over within a step of this width, of a run of length `whole`.
    pub fn inside(width: f64, whole: f64) -> f64 {
        (SHORT * width).max((ROUNDED * whole).min(MOST * width))
    }

    /// The same right after a jump, at the beginning of a stretch of this width.
    pub fn behind(width: f64, whole: f64) -> f64 {
        (SHORT * width).min((SHORTER * width).max(ROUNDED * whole))
    }

    /// A step of linearly implicit Euler from (t, x), of length h, in the unknowns' changes, so that nothing is divided by h but what a
    /// source changes by. `at`: what is stored there, and what rows without d/dt come to, which is rounding.
    fn step(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], h: f64, at: &[Vec<f64>; 2]) -> Option<Vec<f64>> {
        sys.eval(w, x, t + h);
        let row = |i: usize| if sys.has_q[i] { (at[0][i] - w.q[i]) / h - w.f[i] } else { at[1][i] - w.f[i] };
        let mut y: Vec<f64> = (0..sys.n).map(row).collect();
        self.newton.forget();
        sys.stage_expand(w, x, t + h, 1.0 / h);
        self.newton.factor(sys, w, 1.0 / h).then_some(())?;
        self.newton.solve_held(w, &mut y);
        y.iter_mut().zip(x).for_each(|(y, x)| *y += x);
        Some(y)
    }

    /// What those steps of h, 2h and 4h are extrapolated to.
    fn limit(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], h: f64, tol: &Tolerances) -> Option<Vec<f64>> {
        let mut x = x.to_vec();
        // a polynomial's voltages may be far up an exponential, whose current would be held
        let nears = usize::from(sys.exponentials() > 0);
        for pass in 0..nears + 2 {
            let holds = pass >= nears;
            sys.eval(w, &x, t);
            let slope = |i: usize| if holds && sys.has_q[i] { w.f[i] } else { 0.0 };
            let r: Vec<f64> = (0..sys.n).map(|i| -(w.q[i] / h + slope(i))).collect();
            let mut y = x.clone();
            self.newton.forget();
            self.newton.solve(sys, w, 1.0 / h, &r, &mut y, t, tol, 20).ok()?;
            (0..sys.n).filter(|&i| holds || !sys.differential[i]).for_each(|i| x[i] = y[i]);
        }
        sys.eval(w, &x, t);
        let start = [w.q.clone(), w.f.clone()];
        // (what lags need not enter linearly)
        for _ in 0..2 {
            let y = self.step(sys, w, t, &x, h, &start)?;
            (0..sys.n).filter(|&i| self.lags[i] && !sys.differential[i]).for_each(|i| x[i] = y[i]);
        }
        let mut over = |h: f64| {
            let y = self.step(sys, w, t, &x, h, &start)?;
            if sys.exponentials() > 0 || self.of_machine {
                return Some(y);
            }
            // a second derivative needs the step before it, of the same length, as its start
            sys.eval(w, &y, t + h);
            let start = [w.q.clone(), w.f.clone()];
            self.step(sys, w, t + h, &y, h, &start)
        };
        let [one, two, four] = [over(h)?, over(2.0 * h)?, over(4.0 * h)?];
        Some((0..sys.n).map(|i| (8.0 * one[i] - 6.0 * two[i] + four[i]) / 3.0).collect())
    }

    /// What is of higher index at (t, x), from what stands under d/dt, over a length of `inside` or `behind`. x stays as it is where
    /// that fails.
    pub fn settle(&mut self, sys: &System, w: &mut Work, (t, x): (f64, &mut [f64]), h: f64, tol: &Tolerances) {
        let ports = w.ports.clone();
        let h = (t + h) - t;
        // slopes at a corner are those before it
        let h = if w.ends_before(t + 4.0 * h) { -h } else { h };
        if let Some(found) = self.limit(sys, w, t, x, h, tol) {
            // what follows from other states than the row shows belongs to another row
            let mechanical = |i: usize| sys.unknowns[i].kind.mechanical() || sys.unknowns[i].kind.enters_linearly();
            for side in [false, true] {
                if !tol.states_apart(&found, x, MOVED, |i| mechanical(i) == side) {
                    (0..sys.n).filter(|&i| self.lags[i] && mechanical(i) == side).for_each(|i| x[i] = found[i]);
                }
            }
        }
        w.ports = ports;
    }
}

/// Slopes of dense output are differences over so much of its step: with the weights of four points its third power is the error,
/// its inverse that of rounding.
const SLOPE: f64 = 1e-3;
const WEIGHTS: [(f64, f64); 4] = [(3.0, -1.0 / 3.0), (2.0, 1.5), (1.0, -3.0), (0.0, 11.0 / 6.0)];

/// The step that a row lies in.
#[derive(Clone, Copy)]
pub struct Around<'a> {
    /// what is at a time within it, by the method's polynomial
    pub dense: &'a dyn Fn(f64, &mut [f64]),
    pub begin: f64,
    pub h: f64,     // its length
    pub whole: f64, // ... and that of the run
}

/// The row (t, x) of a step of width h as the solution of  F(y, t) + (Q(y) - Q(x)) / h + dQ/dt = 0  with the slope of the dense output.
/// Over nearly no length what a row's states are off their slow manifold by would be multiplied, by a large resistance or by 1 / h; over
/// the width of the step it is not, and nothing is lost by that, for where x is the solution y = x.
fn by_slopes(
    newton: &mut Newton,
    sys: &System,
    w: &mut Work,
    Around { dense, begin, h, .. }: Around,
    (t, x): (f64, &[f64]),
    tol: &Tolerances,
) -> Option<Vec<f64>> {
    newton.forget();
    // before the step's begin another polynomial holds, and behind a corner other slopes of sources
    let e = if t - 3.0 * SLOPE * h < begin { -SLOPE * h } else { SLOPE * h };
    let (mut y, mut slopes) = (x.to_vec(), vec![0.0; sys.n]);
    for (back, part) in WEIGHTS {
        let t = t - back * e;
        if back == 0.0 {
            y.copy_from_slice(x);
        } else {
            dense(t, &mut y);
        }
        sys.eval(w, &y, t);
        // onto the constraints; a polynomial's voltages may be far up an exponential, whose current would be held
        if sys.exponentials() == 0 {
            let held: Vec<f64> = (0..sys.n).map(|i| if sys.has_q[i] { -(w.q[i] / h + w.f[i]) } else { 0.0 }).collect();
            newton.solve(sys, w, 1.0 / h, &held, &mut y, t, tol, 20).ok()?;
            sys.eval(w, &y, t);
        }
        slopes.iter_mut().zip(&w.q).for_each(|(slope, q)| *slope += part / e * q);
    }
    slopes.iter_mut().zip(&w.q).for_each(|(slope, q)| *slope -= q / h);
    newton.solve(sys, w, 1.0 / h, &slopes, &mut y, t, tol, 20).ok()?;
    Some(y)
}

impl Forces {
    /// What is of higher index in the row (t, x) of a step.
    pub fn settle_within(
        &mut self,
        sys: &System,
        w: &mut Work,
        around: Around,
        (t, x): (f64, &mut [f64]),
        tol: &Tolerances,
    ) {
        if sys.exponentials() > 0 || self.of_machine {
            return self.settle(sys, w, (t, x), Forces::inside(around.h, around.whole), tol);
        }
        let ports = w.ports.clone();
        if let Some(y) = by_slopes(&mut self.newton, sys, w, around, (t, x), tol) {
            if !tol.states_apart(&y, x, MOVED, |i| !self.given[i] && !self.lags[i]) {
                (0..sys.n).filter(|&i| self.lags[i] || self.given[i]).for_each(|i| x[i] = y[i]);
            }
        }
        w.ports = ports;
    }
}

/// Nothing is divided by that length where only index 1 is solved for: so much of it will do, ...
const BRIEF: f64 = 1e-3;
/// States that differ by more tolerances are those of another row; dense output by itself is off by one or two.
const MOVED: f64 = 10.0;

/// What solves the algebraic equations at a row.
pub struct Fitting {
    newton: Newton,
    lags: Vec<bool>,  // what follows from changes of what is stored
    given: Vec<bool>, // what has what a source has
    machine: bool,
}

impl Fitting {
    pub fn new(sys: &System) -> Option<Fitting> {
        let machine = sys.unknowns.iter().any(|u| u.kind.mechanical());
        Newton::new(sys).ok().map(|newton| Fitting { newton, lags: undetermined(sys), given: sys.alone(), machine })
    }

    /// Algebraic unknowns of index 1 and nodes of sources at (t, x), within a step, beside diodes whichever of two solutions leaves what
    /// both ends of the step span by less. x stays where states would not.
    pub fn fit(&mut self, sys: &System, w: &mut Work, around: Around, (t, x): (f64, &mut [f64]), tol: &Tolerances) {
        let ports = w.ports.clone();
        let mut y = x.to_vec();
        let h = BRIEF * Forces::inside(around.h, around.whole);
        let stays = Stays { lags: &self.lags, given: &self.given, near: false };
        let mut found = hold(sys, &mut self.newton, w, (t, &mut y), h, tol, &stays) <= MOVED;
        if sys.exponentials() > 0 && !self.machine {
            // what states are off by may flow through a leakage; and slopes may be those of a step that leapt over an edge
            let other = by_slopes(&mut self.newton, sys, w, around, (t, x), tol);
            if let Some(z) = other.filter(|z| !tol.states_apart(z, x, MOVED, |i| !self.given[i])) {
                let (mut x0, mut x1) = (x.to_vec(), x.to_vec());
                (around.dense)(around.begin, &mut x0);
                (around.dense)(around.begin + around.h, &mut x1);
                let beyond = |y: &[f64]| {
                    let off: Vec<f64> =
                        (0..sys.n).map(|i| y[i] - y[i].max(x0[i].min(x1[i])).min(x0[i].max(x1[i]))).collect();
                    tol.largest_error(&off, &x0, &x1)
                };
                if !found || beyond(&z) < beyond(&y) {
                    (found, y) = (true, z);
                }
            }
        }
        if found {
            x.copy_from_slice(&y);
        }
        w.ports = ports;
    }
}

/// The row that is being made.
pub struct Row<'a, S: Sink> {
    pub sink: &'a mut S,
    pub forces: Option<&'a mut Forces>,
    pub poses: Option<&'a mut Poses>,
    pub x: &'a mut [f64],
    /// where the step began, and is it the first behind a jump: until the sink knows, where exponentials want to know
    pub begins: Option<(&'a [f64], bool)>,
    pub until: f64, // end of the step it lies in
    pub width: f64, // of that
    pub whole: f64, // and of the run
    pub check: &'a mut Check,
    pub fitting: &'a mut Option<Fitting>,
}

impl<S: Sink> Row<'_, S> {
    pub fn x(&mut self) -> &mut [f64] {
        self.x
    }

    /// The row at x, where a step ends.
    #[inline(always)]
    pub fn end(&mut self, m: &dyn Method, sys: &System, w: &mut Work, t: f64, x: &[f64], tol: &Tolerances) {
        if self.forces.is_none() && self.poses.is_none() {
            return self.sink.row(sys, w, t, x);
        }
        self.x.copy_from_slice(x);
        self.settle(m, sys, w, t, tol);
        self.sink.row(sys, w, t, self.x);
    }

    /// A row follows inside the step.
    fn tell_ends(&mut self, m: &dyn Method) {
        if let Some((x0, first)) = self.begins.take() {
            self.sink.within_step(x0, m.candidate(), first);
        }
    }

    /// Between the ends of steps a polynomial follows states better than what is algebraic, and behind a bend by far: where the
    /// algebraic equations do not hold that is solved for, with the states as they are.
    fn fit(&mut self, m: &dyn Method, sys: &System, w: &mut Work, t: f64, tol: &Tolerances) {
        if self.sink.holds(sys, w, t, self.x) {
            return;
        }
        if self.fitting.is_none() {
            *self.fitting = Fitting::new(sys);
        }
        if let Some(fitting) = self.fitting {
            let begin = self.until - self.width;
            let around = Around { dense: &|t, x| m.dense(t, x), begin, h: self.width, whole: self.whole };
            fitting.fit(sys, w, around, (t, self.x), tol);
        }
    }

    #[inline]
    fn settle(&mut self, m: &dyn Method, sys: &System, w: &mut Work, t: f64, tol: &Tolerances) {
        let begin = self.until - self.width;
        let around = Around { dense: &|t, x| m.dense(t, x), begin, h: self.width, whole: self.whole };
        let mut settle = |w: &mut Work, t: f64, x: &mut [f64]| {
            if let Some(forces) = &mut self.forces {
                forces.settle_within(sys, w, around, (t, x), tol);
            }
        };
        settle(w, t, self.x);
        if let Some(poses) = &mut self.poses {
            let mut y = self.x.to_vec();
            poses.limit(sys, w, (t, self.x), (begin, self.until), |w, t| {
                m.dense(t, &mut y);
                sys.pin(w, t, &mut y);
                settle(w, t, &mut y);
                y.clone()
            });
        }
    }
}

/// Rows between internal points, from the method's dense output: the print grid tstart + k tstep for methods whose steps
/// are long, the corners of sources on which no step ends, and a few rows after whatever bends the signals, for what
/// follows there is faster than the grid. Where the rows are to be drawn, the grid is parted until it has as many intervals
/// as SPICE takes steps, and a step that is shorter than them has rows of its own, for it may hold half a period.
#[derive(Clone)]
pub struct Grid {
    start: f64,
    print: f64,
    split: f64, // intervals in one of the print grid
    pub step: f64,
    drawn: bool,
    parts: usize, // of the step that is being kept
    stop: f64,
    k: f64,
    dense: bool,
    corner: f64,
    bend: f64, // time of the last bend
    width: f64,
    shown: usize, // rows after it
    bends: f64,
    jumped: bool,  // the next step is the first behind a jump
    arrived: f64,  // when what jumped is over
    due: f64,      // the next row that is asked for, at a corner, behind a bend
    pub last: f64, // time of the newest row
}

/// Rows after a bend, in parts of the print interval or of what lies before the next corner.
const AFTER: [f64; 9] = [0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9];
/// So many bends have them, and one more in so many rows of the grid: a train of pulses is not drawn pulse by pulse.
const BENDS: f64 = 16.0;
const APART: f64 = 10.0;
/// A run that is to be drawn has no gap longer than this part of it.
const INTERVALS: f64 = 50.0;
/// A step that could be more than so much longer has as many rows of its own less, or none where they were fewer than these: its
/// curve is hardly bent.
const LONGER: f64 = 2.0;
const FEWEST: usize = 3;
/// Without rows a reader draws a cubic, and is off by far more than this part of a signal where the step follows a polynomial of higher
/// degree: such rows need be no nearer, however tight the tolerance.
const ROUGH: f64 = 1e-5;
const CUBIC: usize = 3;
/// So many rows of a step are made before it is asked whether the run is to go on.
const SPELL: usize = 1024;
/// A step's own row that lies next to another one, by less than this part of their distance, is left out.
const BESIDE: f64 = 0.2;

/// A current that would have moved so many times the charge that it moved in its step, and has fallen by as much, is over long
/// before the step's end.
const OVER: f64 = 10.0;

/// When what jumped at the start of the step from (t, x0) to (t1, x1) is over: currents that fall along a straight line have moved
/// their charge by then, all together, and averages over the rows are right. (The row behind a switch that closes on a junction's
/// capacitance shows hundreds of amperes, which a line to the step's end would count for half of it.) Where no charge moves like that,
/// coils' voltages and their flux.
fn arrival(sys: &System, w: &mut Work, (t, t1): (f64, f64), (x0, x1): (&[f64], &[f64])) -> f64 {
    let h = t1 - t;
    sys.eval(w, x1, t1);
    let (q1, f1) = (w.q.clone(), w.f.clone());
    sys.eval(w, x0, t);
    for kind in [Kind::Node, Kind::Branch] {
        let (mut charge, mut current) = (0.0, 0.0);
        for i in (0..sys.n).filter(|&i| sys.has_q[i] && sys.unknowns[i].kind == kind) {
            let (moved, f) = ((q1[i] - w.q[i]).abs(), w.f[i].abs());
            if h * f > OVER * moved && f > OVER * f1[i].abs() {
                charge += moved;
                current += f;
            }
        }
        if charge > 0.0 {
            return t + 2.0 * charge / current;
        }
    }
    f64::INFINITY
}

impl Grid {
    /// `silent`: corners of sources that only edges read are rows as well.
    pub fn new(sys: &System, a: Transient, dense: bool, silent: bool) -> Grid {
        let corner = if silent { sys.next_silent_corner(a.tstart.max(a.from)) } else { f64::INFINITY };
        let intervals = INTERVALS * a.tstep / (a.tstop - a.tstart) - 1e-6;
        let short = a.tmax.is_some_and(|h| INTERVALS * h <= a.tstop - a.tstart); // the steps are rows enough
        let split = if a.drawn && !short { intervals.ceil().max(1.0) } else { 1.0 };
        let step = a.tstep / split;
        // a run begins with a row; one that is shown from later on has its first row between two steps
        let first = match a.from > a.tstart {
            true => ((a.from - a.tstart) / step * (1.0 + 4.0 * f64::EPSILON)).floor() + 1.0,
            false if a.tstart > 0.0 => 0.0,
            false => 1.0,
        };
        Grid {
            start: a.tstart,
            print: a.tstep,
            split,
            step,
            drawn: dense && a.drawn,
            parts: 1,
            stop: a.tstop,
            k: first,
            dense,
            corner,
            bend: 0.0,
            width: step,
            shown: AFTER.len(),
            bends: 0.0,
            jumped: false,
            arrived: f64::INFINITY,
            due: f64::NEG_INFINITY,
            last: if a.tstart > a.from { f64::NEG_INFINITY } else { a.from },
        }
    }

    /// Signals bend or jump at t, and again after `ahead`.
    pub fn bent(&mut self, t: f64, ahead: f64) {
        self.jumped = self.drawn && t >= self.start;
        if self.dense && t >= self.start && self.bends < BENDS + self.k / APART {
            self.bends += 1.0;
            (self.bend, self.width, self.shown) = (t, self.step.min(ahead), 0);
            self.due = f64::NEG_INFINITY;
        }
    }

    /// The run goes on beyond what was said to be its end: so do its rows.
    pub fn reach(&mut self, tstop: f64) {
        self.stop = tstop;
    }

    fn point(&self, k: f64) -> f64 {
        if self.split == 1.0 {
            return self.start + k * self.step;
        }
        let whole = (k / self.split).floor();
        self.start + whole * self.print + (k - whole * self.split) * self.step
    }

    /// The next row behind a bend.
    fn extra(&self) -> f64 {
        AFTER.get(self.shown).map_or(f64::INFINITY, |a| self.bend + a * self.width)
    }

    /// The next row asked for that lies clearly after t.
    pub fn after(&self, t: f64) -> f64 {
        let next =
            if self.point(self.k) > t + 1e-6 * self.step { self.point(self.k) } else { self.point(self.k + 1.0) };
        if self.dense && next < self.stop {
            next
        } else {
            f64::INFINITY
        }
    }

    /// Of the attempted step (t, t1] from x0 to x1: where the rows are to be drawn, one more tells when what jumped is over.
    #[inline(always)]
    pub fn arrive(&mut self, (t, t1): (f64, f64), (x0, x1): (&[f64], &[f64]), sys: &System, w: &mut Work) {
        self.arrived = if self.jumped { arrival(sys, w, (t, t1), (x0, x1)) } else { f64::INFINITY };
    }

    /// Does a step of length h need rows of its own, where it can hardly be longer? They are put where the method says that its
    /// dense output is good enough, and where forces can be computed to more than rounding.
    pub fn parted(&mut self, m: &mut dyn Method, h: f64, next: f64, sys: &System, tol: &Tolerances) {
        self.parts = 1;
        if self.drawn && SHORT * h >= ROUNDED * self.stop {
            let all = m.character().shown;
            let parts = (all as f64 * (LONGER * h / next).min(1.0)) as usize;
            let enough = if all > CUBIC { (ROUGH / tol.reltol).max(1.0) } else { 1.0 };
            let needed = parts >= FEWEST.min(all).max(2) && self.step > 1.5 * h / parts as f64;
            if needed && m.interior(sys, tol) <= enough {
                self.parts = parts;
            }
        }
    }

    /// Is there no row before `t1`?
    #[inline(always)]
    pub fn passes(&mut self, t1: f64) -> bool {
        let passes = self.parts == 1 && self.due.min(self.arrived) > t1 + 1e-9 * self.print;
        if passes {
            (self.last, self.jumped) = (t1, false);
        }
        passes
    }

    /// Rows strictly before `t1`, which is recorded by the caller; false where the run is not to go on.
    #[inline(never)]
    pub fn fill(
        &mut self,
        m: &dyn Method,
        t1: f64,
        sys: &System,
        w: &mut Work,
        tol: &Tolerances,
        row: &mut Row<impl Sink>,
        goes_on: &mut dyn FnMut(f64) -> bool,
    ) -> bool {
        let near = 1e-9 * self.print;
        let begin = t1 - row.width;
        let part = if self.parts > 1 { row.width / self.parts as f64 } else { f64::INFINITY };
        let mut newest = self.start.max(self.last);
        let mut left = self.parts;
        let mut own = begin + part;
        let mut rows = 0;
        loop {
            let asked = self.dense || self.k == 0.0;
            let point = if asked { self.point(self.k) } else { f64::INFINITY };
            let extra = self.extra();
            let others = point.min(self.corner).min(extra).min(self.arrived);
            if left > 1 && own < others {
                // not beside one of the others
                if own > newest + BESIDE * part && own < (others - BESIDE * part).min(t1) {
                    row.tell_ends(m);
                    self.push(m, own, sys, w, tol, row);
                    newest = own;
                }
                left -= 1;
                own += part;
                continue;
            }
            let t = others;
            let near = if t < point || self.k == 0.0 { 0.0 } else { near };
            if t > t1 + near || t > self.stop {
                (self.last, self.parts, self.jumped) = (t1, 1, false);
                self.due = point.min(self.corner).min(extra);
                return true;
            }
            if t == self.arrived {
                self.arrived = f64::INFINITY;
            }
            if t == extra {
                self.shown += 1;
            }
            if t == self.corner {
                row.sink.corner(t);
                self.corner = sys.next_silent_corner(t);
            }
            if t == point {
                self.k += 1.0;
            }
            if t < t1 - near && t > self.last {
                row.tell_ends(m);
                self.push(m, t, sys, w, tol, row);
                newest = t;
                rows += 1;
                if rows % SPELL == 0 && !goes_on(t) {
                    return false;
                }
            }
        }
    }

    fn push(&self, m: &dyn Method, t: f64, sys: &System, w: &mut Work, tol: &Tolerances, row: &mut Row<impl Sink>) {
        m.dense(t, row.x);
        sys.pin(w, t, row.x());
        row.check.inside(sys, w, row.x, t);
        row.settle(m, sys, w, t, tol);
        row.fit(m, sys, w, t, tol);
        row.sink.row(sys, w, t, row.x);
    }
}
