//! The transient analysis: one loop for every method. Corners of sources and known edges (edges.rs) are stepped onto;
//! state events are located on the method's dense output, stepped onto. Where something jumps, one implicit step of
//! a billionth of what lies ahead gives the values after it, and the method restarts there. The length that served
//! after the last jump of the same kind is remembered. What was computed is kept whatever ends the run.
mod begin;
mod blow_up;
mod branch;
mod event;
mod jumps;
mod laws;
mod memory;
mod outside;
mod step_state;
mod stretch;

pub(super) use self::begin::starting_point;
use self::blow_up::{gone, BlowUp};
use self::branch::Branch;
use self::event::Event;
use self::memory::Memory;
pub use self::memory::IMPOSED;
use self::step_state::{StepState, FAILURES};
pub use self::stretch::Mark;
use crate::rounding::SAME;

use super::monitor::{Monitor, Report};
use super::rows::{undetermined, Fitting, Forces, Grid, Lags, Poses, Row, Sink};
use super::{make, Attempt, Character, Method, Used};
use crate::events::{Check, Detector};
use crate::ledger::Inside;
use crate::modes::Modes;
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::op;
use crate::record::Record;
use crate::system::time_only::Ahead;
use crate::system::{System, Work};

#[derive(Clone, Copy, Debug)]
pub struct Transient {
    pub tstep: f64,
    pub tstop: f64,
    pub tstart: f64,
    pub tmax: Option<f64>,
    pub uic: bool,
    /// it begins with `Work::begin`, at `from`
    pub begun: bool,
    pub from: f64,
    /// it ends there, on its way to tstop
    pub until: f64,
    /// curves are drawn through the rows: none far apart, whatever tstep says
    pub drawn: bool,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub enum Status {
    #[default]
    Ok,
    Failed,
    Interrupted,
}

#[derive(Clone, Debug)]
pub struct Failed {
    pub t: f64,
    pub h: f64,
    pub during: &'static str, // "operating point", "transient"
    pub why: Failure,
    pub tried: Vec<String>,
}

#[derive(Default)]
pub struct Outcome {
    pub status: Status,
    pub failed: Option<Failed>,
    pub events: Vec<(f64, usize, bool)>,
    /// flags that chattered and were put to rest for a while
    pub resting: Vec<usize>,
    /// times at which modes of laws were found by a step of Moreau's
    pub stepped: Vec<f64>,
    /// laws that no finite force kept sliding, with their times
    pub jammed: Vec<(f64, usize)>,
    /// flags that were not what their conditions say, and when first
    pub broken: Vec<(f64, usize)>,
    pub watch: Report,
    /// unknowns where it ended, and when
    pub end: Vec<f64>,
    pub ended: f64,
    /// what `auto` chose
    pub used: Vec<Used>,
}

/// Called now and then with (t, h, steps, events); false stops the run.
pub type Tick<'a> = dyn FnMut(f64, f64, u64, u64) -> bool + 'a;

/// Why a method did the work that was named.
pub(super) const ASKED: &str = "asked for";
const TICK: u64 = 64;
/// What a run holds beside its method.
pub(super) struct Run<'a, S: Sink> {
    sys: &'a System,
    pub w: &'a mut Work,
    a: Transient,
    o: &'a Options,
    pub record: &'a mut S,
    tol: Tolerances,
    newton: Option<Newton>, // for values after a jump: its symbolic analysis is done once, when it is needed
    modes: Option<Modes>,   // of laws, where there are any
    detector: Detector,
    check: Check,
    grid: Grid,
    memory: Memory,
    blow_up: BlowUp,
    branch: Option<Branch>, // of closed loops
    ahead: Option<Ahead>,
    pub outcome: Outcome,
    pub x: Vec<f64>,
    before: Vec<f64>, // x where the last step began
    first: bool,      // the next step is the first behind a restart
    peak: f64,        // where a step was last asked to end
    t: f64,
    late: f64,  // what rounding has taken from t
    stop: f64,  // the next corner or edge
    until: f64, // steps go no further
    slack: f64, // a stretch shorter than this is no step
    next: Next,
    tmax: f64,
    dense: bool,
    scratch: Vec<f64>,
    monitor: Monitor,
    shown: Shown,
    slopes: Option<(bool, bool)>, // unknowns follow from the slopes of others: a corner is a jump to them; conditions read such
    crept: (f64, f64),            // where a corner was last stepped over, and how often there
}

/// What rows show that the method's own points do not.
#[derive(Default)]
struct Shown {
    forces: Option<Option<Forces>>, // multipliers, where they are asked for and the method's own lag behind
    fitting: Option<Fitting>,       // algebraic equations between the ends of steps
    settles: bool,                  // it is so at present
    begin: Option<Option<Forces>>,  // the same after a jump
    poses: Option<Option<Poses>>,   // where rows show forces of closed loops
    kept: f64,                      // end of the last recorded step
}

/// Lengths of the steps to come.
#[derive(Clone, Copy)]
struct Next {
    h: Option<f64>,
    normal: f64, // of the step before a corner cut it
}

pub fn run(sys: &System, w: &mut Work, a: Transient, o: &Options, record: &mut Record, tick: &mut Tick) -> Outcome {
    let x = match starting_point(sys, w, a, o) {
        Ok(x) => x,
        Err(failed) => return Outcome::failed(*failed),
    };
    if let Some(tangent) = &mut record.tangent {
        // differences of starts: these are to be known better than by the run's tolerance
        let tight = Options { reltol: o.reltol.min(SAME), ..o.clone() };
        tangent.begin(|sys, w| starting_point(sys, w, a, &tight).ok());
    }
    begun(sys, w, a, o, record, x, tick)
}

/// A run whose rows go anywhere.
pub(super) fn lead(
    sys: &System,
    w: &mut Work,
    a: Transient,
    o: &Options,
    sink: &mut impl Sink,
    tick: &mut Tick,
) -> Outcome {
    let start = starting_point(sys, w, a, o);
    start.map_or_else(|failed| Outcome::failed(*failed), |x| begun(sys, w, a, o, sink, x, tick))
}

/// A run that begins at x.
fn begun(
    sys: &System,
    w: &mut Work,
    a: Transient,
    o: &Options,
    sink: &mut impl Sink,
    x: Vec<f64>,
    tick: &mut Tick,
) -> Outcome {
    let o = &Options { shown: sink.reads().to_vec(), ..o.clone() };
    let outcome = make(sys, o, &o.method).and_then(|mut method| conduct(sys, w, a, o, sink, x, &mut *method, tick));
    outcome.unwrap_or_else(|why| Outcome::failed(Failed::at_start("transient", why, vec![])))
}

fn conduct(
    sys: &System,
    w: &mut Work,
    a: Transient,
    o: &Options,
    record: &mut impl Sink,
    x: Vec<f64>,
    method: &mut dyn Method,
    tick: &mut Tick,
) -> Result<Outcome, Failure> {
    let mut run = Run::new(sys, w, a, o, record, x, method.character())?;
    run.start(method);
    run.w.hold_flag(o.stuck_flag);
    run.advance(method, tick);
    run.record.close(run.sys, run.w);
    run.outcome.watch = run.monitor.report(run.sys, run.w, (run.t, &run.x), method, &run.tol);
    run.outcome.end.clone_from(&run.x);
    run.outcome.ended = run.t;
    run.outcome.used = method.used();
    run.outcome.broken = std::mem::take(&mut run.check.broken);
    if run.outcome.used.is_empty() {
        run.outcome.used.push(Used { t: 0.0, method: o.method.clone(), why: ASKED.into() });
    }
    Ok(run.outcome)
}

impl Outcome {
    /// Of a run that an interrupt has ended between two steps.
    pub fn interrupted() -> Outcome {
        Outcome { status: Status::Interrupted, ..Outcome::default() }
    }

    /// Of a run that ended before its first step.
    pub(super) fn failed(failed: Failed) -> Outcome {
        Outcome { status: Status::Failed, failed: Some(failed), ..Outcome::default() }
    }
}

impl Failed {
    pub(super) fn at_start(during: &'static str, why: Failure, tried: Vec<String>) -> Failed {
        Failed { t: 0.0, h: 0.0, during, why, tried }
    }
}

impl<'a, S: Sink> Run<'a, S> {
    /// Has one of the conditions come that end the run? What holds from the start on does so at once, unless it has ended a run there.
    fn halts(&self) -> bool {
        let at_start = |k: usize| !self.a.begun && self.w.flags[k] != 0.0 && self.t == self.a.from;
        self.w.halts.iter().any(|&(k, both)| {
            let turned = self.outcome.events.iter().any(|&(_, flag, on)| flag == k && (on || both));
            turned || !both && at_start(k)
        })
    }

    /// Values that fit the charges at t + h.
    fn settle(&mut self, t: f64, h: f64, refine: bool) -> bool {
        self.settle_from(None, t, h, refine)
    }

    /// `charges`: in place of those at x.
    fn settle_from(&mut self, charges: Option<Vec<f64>>, t: f64, h: f64, refine: bool) -> bool {
        newton(self.sys, &mut self.newton)
            .is_some_and(|n| op::consistent(self.sys, n, self.w, &mut self.x, charges, (t, h), &self.tol, refine))
    }

    fn restart(&mut self, method: &mut dyn Method) {
        self.monitor.cut(method, &self.tol);
        self.w.past.resume(self.t);
        method.restart(self.sys, self.w, self.t, &self.x);
        self.first = true;
        self.detector.start(self.sys, self.w, &self.x, self.t);
        self.check.begin(self.t);
        self.branch.iter_mut().for_each(Branch::begin);
        self.memory.restart(self.sys.stretch(self.w, self.t));
    }

    /// The loop over steps.
    fn advance(&mut self, method: &mut dyn Method, tick: &mut Tick) {
        let (sys, a, tmax) = (self.sys, self.a, self.tmax);
        let span = a.tstop;
        let feature = sys.shortest_feature().min(a.tstep).min(tmax);
        let first = match self.o.fixed_step {
            Some(h) => h,
            None if self.dense => 1e-2 * feature,
            None => (0.01 * feature).min(1e-3 * span),
        };
        let fixed = self.o.fixed_step.is_some();
        let longest = if fixed { f64::INFINITY } else { sys.delays.shortest().min(memory::followed(sys)) };
        let h = match self.next.h {
            Some(h) => h,
            None if fixed => first,
            None => method.begin(sys, self.w, first, &self.tol),
        };
        // dense output would not do for a row between the ends of a step; nothing bounds a step where nothing moves by itself
        let still = !fixed && !sys.differential.contains(&true);
        let mut s = StepState { h, first, normal: self.next.normal, coarse: still, still, ..StepState::default() };
        while self.until - self.t > self.slack && self.outcome.status == Status::Ok {
            if !self.w.halts.is_empty() && self.halts() {
                break;
            }
            s.count += 1;
            if s.count % TICK == 0 && !self.looks_up(&mut s, method, tick) {
                return;
            }
            let stride = self.stride(&s, longest);
            let Stride { step, smallest, lands, .. } = stride;
            match method.attempt(sys, self.w, step, &self.tol) {
                Attempt::Stuck { next, why } => match self.stuck(&mut s, method, (step, smallest), (next, why)) {
                    true => continue,
                    false => return,
                },
                Attempt::TooLarge { next } => {
                    self.w.counters.rejected += 1;
                    if step > smallest * 1.01 {
                        s.h = next.max(smallest);
                        continue;
                    }
                    if let Some(unknown) = self.blow_up.unknown() {
                        return self.runs_away(step, unknown, method);
                    }
                    // the smallest step there is: the solution jumps here, take it as it comes
                    self.t = (self.t + step).min(self.stop);
                    self.late = 0.0;
                    method.accept(self.t);
                    s.h = 2.0 * smallest;
                }
                // so that what is kept ends where the solution runs away
                Attempt::Good { .. } if !fixed && step > SAME * span && gone(method.candidate()).is_some() => {
                    self.w.counters.rejected += 1;
                    s.h = 0.1 * step;
                    continue;
                }
                Attempt::Good { next } => match self.arrives(&mut s, method, tick, &stride, next) {
                    Arrival::There => {}
                    Arrival::Again => continue,
                    Arrival::Ended => return,
                },
            }
            self.move_on(method);
            // (that of a longer step has been looked at)
            if let Some(unknown) = if fixed || step <= SAME * span { gone(&self.x) } else { None } {
                return self.runs_away(step, unknown, method);
            }
            self.blow_up.step(&self.x, &self.tol, &sys.differential, step / span);
            if !self.keep(method, tick) {
                return;
            }
            self.detector.accept(sys, self.w, &self.x, self.t, &mut self.check);
            if self.hear() && self.same(self.t) < self.until {
                self.step_event(step, method);
                if !fixed {
                    // (not a part of this step: an FMU may ask behind every one)
                    s.h = (0.1 * (self.stop - self.t).min(s.normal).min(tmax)).max(smallest);
                }
                continue;
            }
            if !(lands && self.t >= self.stop) {
                s.normal = s.h;
                continue;
            }
            if self.t >= self.until {
                break;
            }
            self.landed(&mut s, method, smallest);
        }
        self.next = Next { h: Some(s.h), normal: s.normal };
    }

    /// How far may the next step go? `longest`: by what is delayed and followed [s].
    #[inline(always)]
    fn stride(&mut self, s: &StepState, longest: f64) -> Stride {
        let (t, fixed) = (self.t, self.o.fixed_step.is_some());
        let left = (self.stop - t) - self.late;
        let mut step = s.h.min(if fixed { s.h } else { memory::bound(&self.a, t, self.tmax).min(longest) });
        if let Some(ahead) = self.ahead.as_ref().filter(|_| !fixed) {
            step = step.min(ahead.limit(t));
        }
        let smallest = (16.0 * f64::EPSILON * t).max(1e-18 * self.a.tstop);
        // (nothing is solved in less than the smallest step: what is nearer is where the step ends)
        let mut lands = step.max(smallest) >= left * (1.0 - 1e-9);
        if lands {
            step = self.memory.recurring(left, 8.0 * f64::EPSILON * self.stop);
        } else if step > 0.5 * left && !fixed {
            step = 0.5 * left; // two equal steps instead of a long and a tiny one
        }
        let asked = self.grid.after(t);
        // a row that is asked for at a corner stands at the end of the step onto it
        if s.coarse && t + step > asked && asked < self.stop - 1e-9 * self.a.tstep {
            (step, lands) = (asked - t, false);
        }
        step = if lands { step } else { step.max(smallest) };
        Stride { step, smallest, asked, lands }
    }

    /// Is the run at the end of a step that the method finds good?
    #[inline(always)]
    fn arrives(
        &mut self,
        s: &mut StepState,
        method: &mut dyn Method,
        tick: &mut Tick,
        stride: &Stride,
        next: f64,
    ) -> Arrival {
        let (sys, t, fixed) = (self.sys, self.t, self.o.fixed_step.is_some());
        let &Stride { step, smallest, asked, lands } = stride;
        match self.leaves_branch(method, step, smallest) {
            None => {}
            Some(Some(shorter)) => {
                s.h = shorter;
                return Arrival::Again;
            }
            Some(None) => return Arrival::Ended,
        }
        let t1 = if lands { self.stop } else { t + (step + self.late) };
        let inside = asked < t1 - 1e-7 * self.grid.step;
        if self.dense && !fixed && (s.coarse || inside) {
            s.coarse = s.still || method.interior(sys, &self.tol) > 1.0;
            if s.coarse && inside {
                self.w.counters.rejected += 1;
                return Arrival::Again;
            }
        }
        if !fixed {
            self.grid.parted(method, step, next, sys, &self.tol);
            self.grid.arrive((t, t1), (&self.x, method.candidate()), sys, self.w);
        }
        let event = match sys.edges.all_timed() {
            true => Event::None,
            false => self.event(method, t1, (step, smallest), next, &mut s.failures, tick),
        };
        match event {
            Event::None => {}
            Event::Ended => return Arrival::Ended,
            Event::Refused(_) if s.failures > FAILURES => match self.lost(s, method, smallest) {
                true => return Arrival::Again,
                false => return Arrival::Ended,
            },
            Event::Refused(next) | Event::Passed(next) => {
                s.h = next;
                return Arrival::Again;
            }
        }
        s.passed();
        method.accept(t1);
        self.w.counters.steps += 1;
        self.memory.learn(step, next);
        self.late = if lands { 0.0 } else { (step + self.late) - (t1 - t) };
        self.t = t1;
        s.h = next;
        Arrival::There
    }

    /// A step was accepted.
    #[inline(always)]
    fn move_on(&mut self, method: &dyn Method) {
        std::mem::swap(&mut self.x, &mut self.before);
        self.x.copy_from_slice(method.candidate());
    }

    /// Records the accepted step up to its end x at t; false where the run is stopped meanwhile.
    #[inline(always)]
    fn keep(&mut self, method: &dyn Method, tick: &mut Tick) -> bool {
        let width = self.t - self.shown.kept;
        let forces = match method.character().lags {
            Lags::Nothing => None,
            lags => {
                let made = self.shown.forces.get_or_insert_with(|| Forces::new(self.sys, self.record.reads()));
                made.as_mut().filter(|f| lags == Lags::Index || f.of_machine)
            }
        };
        self.shown.settles = forces.is_some();
        let poses =
            || self.branch.as_ref().and_then(|_| Poses::new(self.sys, self.record.reads(), &undetermined(self.sys)));
        let poses = self.shown.poses.get_or_insert_with(poses).as_mut();
        let (steps, events) = (self.w.counters.steps, self.w.counters.events);
        let (check, fitting) = (&mut self.check, &mut self.shown.fitting);
        let first = std::mem::replace(&mut self.first, false);
        let begins = if self.sys.exponentials() > 0 { Some((self.before.as_slice(), first)) } else { None };
        let (x, whole) = (self.scratch.as_mut_slice(), self.a.tstop);
        let mut row = Row { sink: self.record, forces, poses, x, begins, until: self.t, width, whole, check, fitting };
        let mut goes_on = |t: f64| tick(t, width, steps, events);
        let passed = self.grid.passes(self.t)
            || self.grid.fill(method, self.t, self.sys, self.w, &self.tol, &mut row, &mut goes_on);
        if !passed {
            self.outcome.status = Status::Interrupted;
            return false;
        }
        if self.t >= self.a.tstart {
            row.end(method, self.sys, self.w, self.t, &self.x, &self.tol);
        }
        self.shown.kept = self.t;
        self.sys.keep_past(self.w, self.t, &|t, out| method.dense(t, out), &mut self.scratch);
        let dense = |t: f64, out: &mut [f64]| method.dense(t, out);
        let inside = Inside { dense: &dense, parts: if self.dense { 4 } else { 1 }, stages: &|| method.stages() };
        self.record.step(self.sys, self.w, self.t, &self.x, &inside);
        self.tol.observe(&self.x, self.t);
        self.monitor.step(self.t, &self.x, method, &self.tol);
        true
    }
}

/// A step that is to be attempted.
struct Stride {
    step: f64,
    smallest: f64, // that time can be told apart by
    asked: f64,    // the next row
    lands: bool,   // on the next corner or edge
}

/// Behind a good step the run stands there, tries again from where it stands now, or is over.
enum Arrival {
    There,
    Again,
    Ended,
}

fn newton<'n>(sys: &System, made: &'n mut Option<Newton>) -> Option<&'n mut Newton> {
    if made.is_none() {
        *made = Newton::new(sys).ok();
    }
    made.as_mut()
}
