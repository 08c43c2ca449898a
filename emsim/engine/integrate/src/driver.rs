//! The transient analysis: one loop for every method. Corners of sources and known edges (edges.rs) are stepped onto;
//! state events are located on the method's dense output, stepped onto. Where something jumps, one implicit step of
//! a billionth of what lies ahead gives the values after it, and the method restarts there. The length that served
//! after the last jump of the same kind is remembered. What was computed is kept whatever ends the run.
mod blow_up;
mod branch;
mod jumps;
mod laws;
mod memory;
mod outside;
mod step_state;
mod stretch;

use self::blow_up::{gone, BlowUp};
use self::branch::Branch;
use self::memory::Memory;
pub use self::memory::IMPOSED;
use self::step_state::{StepState, FAILURES};
pub use self::stretch::Mark;

use super::monitor::{Monitor, Report};
use super::rows::{undetermined, Fitting, Forces, Grid, Lags, Poses, Row, Sink};
use super::{make, Attempt, Character, Method, Used};
use crate::events::{Candidate, Check, Detector, Located};
use crate::ledger::Inside;
use crate::modes::{put_thresholds, Modes};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::op;
use crate::record::Record;
use crate::system::time_only::Ahead;
use crate::system::{Kind, System, Work};

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
/// Relative tolerance of starting points whose differences are formed.
const START: f64 = 1e-9;
/// Steps into what is too large are shortened to this part of the run.
const RUNAWAY: f64 = 1e-6;
/// So often a step is taken anew to end on an event, ...
const ONTO: usize = 6;
/// ... until it ends behind it by less than this part of reltol, in parts of itself.
const LATE: f64 = 0.1;

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
    forces: Option<Option<Forces>>, // multipliers of the rows, where they are asked for and the method's own lag behind
    fitting: Option<Fitting>,       // algebraic equations at rows between the ends of steps
    settles: bool,                  // it is so at present
    begin: Option<Option<Forces>>,  // the same after a jump
    poses: Option<Option<Poses>>,   // where rows show forces of closed loops
    slopes: Option<(bool, bool)>, // unknowns follow from the slopes of others: a corner is a jump to them; conditions read such
    kept: f64,                    // end of the last recorded step
    crept: (f64, f64),            // where a corner was last stepped over, and how often there
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
        let tight = Options { reltol: o.reltol.min(START), ..o.clone() };
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

/// Where another run ended, initial conditions, or the operating point with the machine held.
pub(super) fn starting_point(sys: &System, w: &mut Work, a: Transient, o: &Options) -> Result<Vec<f64>, Box<Failed>> {
    let tol = Tolerances::new(sys, o);
    w.gmin = o.gmin;
    sys.put_floors(w, &tol.atol);
    if let Some((x, flags)) = w.begin.take() {
        w.flags = flags;
        return Ok(x);
    }
    if let Some(whole) = &sys.whole {
        let mut own = whole.work();
        let x = starting_point(whole, &mut own, a, o)?;
        w.start_as(&own);
        if a.uic {
            w.past.begin();
        }
        return Ok(x);
    }
    let mut x = op::initial(sys);
    if a.uic {
        w.start_from_given();
        w.past.begin();
    }
    if sys.has_laws() {
        Modes::begin(sys, w, &x, 0.0, &tol);
    }
    let found = if a.uic {
        op::initial_conditions(sys, w, &mut x, a.tstep, &tol)
            .map_err(|why| Failed::at_start("initial conditions", why, vec!["charges as given by IC=".into()]))
    } else {
        op::operating_point(sys, w, o, &tol, false, &mut x)
            .map_err(|e| Failed::at_start("operating point", e.why, e.tried))
    };
    if found.is_ok() && !a.uic {
        w.unstable = op::falls_over(sys, w, &x, o, &tol);
    }
    found.map(|()| x).map_err(Box::new)
}

impl<'a, S: Sink> Run<'a, S> {
    pub(super) fn new(
        sys: &'a System,
        w: &'a mut Work,
        a: Transient,
        o: &'a Options,
        record: &'a mut S,
        x: Vec<f64>,
        character: &Character,
    ) -> Result<Run<'a, S>, Failure> {
        let mut tol = Tolerances::new(sys, o);
        tol.observe(&x, a.from);
        sys.put_floors(w, &tol.atol);
        if sys.has_laws() {
            // (an operating point begins with fresh flags)
            Modes::begin(sys, w, &x, a.from, &tol);
            put_thresholds(sys, w, &x, a.from, &tol);
        }
        // (an estimate by differences of past points does not satisfy the algebraic rows)
        if sys.linear && !character.restarts_at_corners {
            let (lags, given) = (undetermined(sys), sys.alone());
            let at_once = |&i: &usize| !sys.differential[i] && !lags[i] && !given[i];
            tol.count((0..sys.n).filter(at_once).filter(|&i| sys.unknowns[i].kind == Kind::Node));
        }
        let (dense, shows_silent) = (character.dense_record, record.shows_silent(sys));
        let known = sys.delays.shortest();
        let tmax = a.tmax.unwrap_or_else(|| memory::longest(sys, &a, character)).min(known);
        if o.fixed_step.is_some_and(|h| h > known) {
            let why = format!("steps of a fixed length are longer than a delay of {known:e} s");
            return Err(Failure::Unfit { why });
        }
        Ok(Run {
            sys,
            w,
            a,
            o,
            record,
            tol,
            newton: None,
            modes: Modes::new(sys),
            detector: Detector::new(sys),
            check: Check::new(a.tstop, o.reltol),
            grid: Grid::new(sys, a, dense, shows_silent),
            memory: Memory::default(),
            blow_up: BlowUp::default(),
            branch: Branch::new(sys).filter(|_| o.fixed_step.is_none()),
            ahead: sys.time_only.ahead(&sys.waves, a.tstop),
            outcome: Outcome::default(),
            before: x.clone(),
            first: true,
            peak: f64::NAN,
            x,
            t: a.from,
            late: 0.0,
            stop: a.from,
            until: a.until,
            slack: 0.0,
            next: Next { h: None, normal: tmax },
            tmax,
            dense,
            scratch: vec![0.0; sys.n],
            forces: None,
            poses: None,
            fitting: None,
            settles: false,
            begin: None,
            slopes: None,
            kept: a.from,
            crept: (f64::NEG_INFINITY, 0.0),
            monitor: Monitor::new(sys, o, a.tstop, tmax),
        })
    }

    pub(super) fn start(&mut self, method: &mut dyn Method) {
        let t = self.t;
        self.sys.remember(self.w, &self.x, t);
        self.sys.begin_past(self.w, &self.x, self.a.uic);
        let feature = self.sys.shortest_feature().min(self.a.tstep).min(self.tmax);
        // within so little of the run charges are not known to rounding: what need not be computed from their change is not
        let (short, rounded) = (1e-5 * feature, 1e-10 * self.a.tstop);
        let fits = !(self.a.uic || self.a.begun) && self.sys.forces.is_empty();
        let known = || {
            op::is_all_state(self.sys)
                || self.sys.slopes.is_empty() && short < rounded && fits && !undetermined(self.sys).contains(&true)
        };
        if let Some(mut charges) = self.w.charges.take() {
            charges.iter_mut().zip(&self.sys.has_q).filter(|(_, &stores)| !stores).for_each(|(q, _)| *q = 0.0);
            // the equations are others from here on, what is stored is not
            self.settle_from(Some(charges), t, short.max(rounded.min(1e-3 * feature)), false);
        }
        if !known() && (self.a.uic || !method.settle(self.sys, self.w, t, 0.0, &mut self.x)) {
            self.settle(t, short.max(rounded.min(1e-3 * feature)), true);
        }
        let rounds = self.sys.rounds();
        for again in 0..=rounds {
            // flags may hang on algebraic unknowns that other flags move: settle them together
            let turn = if 2 * again > rounds { System::turn_first } else { System::update_flags };
            if !turn(self.sys, self.w, &self.x, t) {
                break;
            }
            self.settle(t, 1e-9 * feature, false);
            if again == rounds {
                return self.contradicts(1e-9 * feature);
            }
        }
        self.w.logic.begin(&self.sys.logic);
        self.w.clocked.begin();
        self.begin_laws(feature);
        if self.a.tstart <= t {
            self.record.row(self.sys, self.w, t, &self.x);
        }
        self.record.open(self.sys, self.w, t, &self.x);
        let ticked = self.tick() || self.w.clocked.asks();
        self.stop = self.sys.next_stop(self.w, t, self.until);
        if ticked || self.stop <= self.same(t) {
            self.t = if ticked { t } else { self.stop.max(t) };
            self.slopes_jump(method);
            self.jump(feature, method);
        }
        if self.sys.starts_bending() {
            self.grid.bent(t, self.stop - t);
        }
        self.restart(method);
    }

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
            .is_some_and(|n| op::consistent_with(self.sys, n, self.w, &mut self.x, charges, t, h, &self.tol, refine))
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
        let (fixed, known) = (self.o.fixed_step.is_some(), sys.delays.shortest());
        let followed = memory::followed(sys);
        let h = match self.next.h {
            Some(h) => h,
            None if fixed => first,
            None => method.begin(sys, self.w, first, &self.tol),
        };
        // dense output would not do for a row between the ends of a step; nothing bounds a step where nothing moves by itself
        let still = !fixed && !sys.differential.contains(&true);
        let mut s = StepState { h, first, normal: self.next.normal, coarse: still, ..StepState::default() };
        while self.until - self.t > self.slack && self.outcome.status == Status::Ok {
            if !self.w.halts.is_empty() && self.halts() {
                break;
            }
            s.count += 1;
            if s.count % TICK == 0 && !self.looks_up(&mut s, method, tick) {
                return;
            }
            // how far may this step go
            let t = self.t;
            let left = (self.stop - t) - self.late;
            let mut step = s.h.min(if fixed { s.h } else { memory::bound(&a, t, tmax).min(known).min(followed) });
            if let Some(ahead) = self.ahead.as_ref().filter(|_| !fixed) {
                step = step.min(ahead.limit(t));
            }
            let smallest = (16.0 * f64::EPSILON * t).max(1e-18 * a.tstop);
            // (nothing is solved in less than the smallest step: what is nearer is where the step ends)
            let mut lands = step.max(smallest) >= left * (1.0 - 1e-9);
            if lands {
                step = self.memory.recurring(left, 8.0 * f64::EPSILON * self.stop);
            } else if step > 0.5 * left && !fixed {
                step = 0.5 * left; // two equal steps instead of a long and a tiny one
            }
            let asked = self.grid.after(t);
            // a row that is asked for at a corner stands at the end of the step onto it
            if s.coarse && t + step > asked && asked < self.stop - 1e-9 * a.tstep {
                (step, lands) = (asked - t, false);
            }
            step = if lands { step } else { step.max(smallest) };
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
                    self.t = (t + step).min(self.stop);
                    self.late = 0.0;
                    method.accept(self.t);
                    s.h = 2.0 * smallest;
                }
                // so that what is kept ends where the solution runs away
                Attempt::Good { .. } if !fixed && step > RUNAWAY * span && gone(method.candidate()).is_some() => {
                    self.w.counters.rejected += 1;
                    s.h = 0.1 * step;
                    continue;
                }
                Attempt::Good { next } => {
                    match self.leaves_branch(method, step, smallest) {
                        None => {}
                        Some(Some(shorter)) => {
                            s.h = shorter;
                            continue;
                        }
                        Some(None) => return,
                    }
                    let t1 = if lands { self.stop } else { t + (step + self.late) };
                    let inside = asked < t1 - 1e-7 * self.grid.step;
                    if self.dense && !fixed && (s.coarse || inside) {
                        s.coarse = still || method.interior(sys, &self.tol) > 1.0;
                        if s.coarse && inside {
                            self.w.counters.rejected += 1;
                            continue;
                        }
                    }
                    if !fixed {
                        self.grid.parted(method, step, next, sys, &self.tol);
                        self.grid.arrive((t, t1), (&self.x, method.candidate()), sys, self.w);
                    }
                    let event = match sys.edges.all_timed() {
                        true => Event::None,
                        false => self.event(method, t1, step, next, smallest, &mut s.failures, tick),
                    };
                    match event {
                        Event::None => {}
                        Event::Ended => return,
                        Event::Refused(_) if s.failures > FAILURES => match self.lost(&mut s, method, smallest) {
                            true => continue,
                            false => return,
                        },
                        Event::Refused(next) | Event::Passed(next) => {
                            s.h = next;
                            continue;
                        }
                    }
                    s.passed();
                    method.accept(t1);
                    self.w.counters.steps += 1;
                    self.memory.learn(step, next);
                    self.late = if lands { 0.0 } else { (step + self.late) - (t1 - t) };
                    self.t = t1;
                    s.h = next;
                }
            }
            self.move_on(method);
            // (that of a longer step has been looked at)
            if let Some(unknown) = if fixed || step <= RUNAWAY * span { gone(&self.x) } else { None } {
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

    /// A step was accepted.
    #[inline(always)]
    fn move_on(&mut self, method: &dyn Method) {
        std::mem::swap(&mut self.x, &mut self.before);
        self.x.copy_from_slice(method.candidate());
    }

    /// Records the accepted step up to its end x at t; false where the run is stopped meanwhile.
    #[inline(always)]
    fn keep(&mut self, method: &dyn Method, tick: &mut Tick) -> bool {
        let width = self.t - self.kept;
        let forces = match method.character().lags {
            Lags::Nothing => None,
            lags => {
                let made = self.forces.get_or_insert_with(|| Forces::new(self.sys, self.record.reads()));
                made.as_mut().filter(|f| lags == Lags::Index || f.of_machine)
            }
        };
        self.settles = forces.is_some();
        let poses =
            || self.branch.as_ref().and_then(|_| Poses::new(self.sys, self.record.reads(), &undetermined(self.sys)));
        let poses = self.poses.get_or_insert_with(poses).as_mut();
        let (steps, events) = (self.w.counters.steps, self.w.counters.events);
        let (check, fitting) = (&mut self.check, &mut self.fitting);
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
        self.kept = self.t;
        self.sys.keep_past(self.w, self.t, &|t, out| method.dense(t, out), &mut self.scratch);
        let dense = |t: f64, out: &mut [f64]| method.dense(t, out);
        let inside = Inside { dense: &dense, parts: if self.dense { 4 } else { 1 }, stages: &|| method.stages() };
        self.record.step(self.sys, self.w, self.t, &self.x, &inside);
        self.tol.observe(&self.x, self.t);
        self.monitor.step(self.t, &self.x, method, &self.tol);
        true
    }

    /// The earliest event in the attempted step, which ends at t1.
    fn locate(&mut self, method: &dyn Method, t1: f64, peaks: bool) -> Option<Located> {
        let (sys, t, end) = (self.sys, self.t, method.candidate());
        let inside = |t: f64, out: &mut [f64]| method.dense(t, out);
        let turn = sys.turning().iter().map(|p| (p.at(t1, end) - p.at(t, &self.x)).abs()).fold(0.0, f64::max);
        let candidate = Candidate { end, dense: &inside, long: self.dense, turn, reltol: self.tol.reltol, peaks };
        self.detector.locate(sys, self.w, &candidate, t, t1, &mut self.scratch)
    }

    /// A flag that turns inside the attempted step (t, t1]: the step ends there, the flag flips, the method restarts.
    #[inline(never)]
    fn event(
        &mut self,
        method: &mut dyn Method,
        t1: f64,
        step: f64,
        next: f64,
        smallest: f64,
        failures: &mut u32,
        tick: &mut Tick,
    ) -> Event {
        let (sys, t) = (self.sys, self.t);
        // a step that ends at a peak is as long as it is to be
        let ends_there = (t1 - self.peak).abs() <= 1e-9 * step;
        let asks = !ends_there && self.o.fixed_step.is_none();
        let found = match self.locate(method, t1, asks) {
            Some(Located::Peak(at)) if at - t > smallest => {
                self.w.counters.rejected += 1;
                self.peak = at;
                return Event::Refused(at - t);
            }
            Some(Located::Peak(_)) => self.locate(method, t1, false),
            found => found,
        };
        let Some(Located::Turn(mut at)) = found else { return Event::None };
        if at < t1 && at - t > smallest {
            // step onto the event: the same step, shorter, until its end says that it is there
            let mut again = method.attempt(sys, self.w, at - t, &self.tol);
            for _ in 0..ONTO {
                if !matches!(again, Attempt::Good { .. }) {
                    break;
                }
                let least = (1e-12 * step).max(smallest);
                let near = (LATE * self.tol.reltol * (at - t)).max(least);
                let Some(due) = self.detector.due(sys, self.w, method.candidate(), at) else {
                    // the shorter step knows better where that was
                    match self.locate(method, at, false) {
                        Some(Located::Turn(first)) if first < at - near && first - t > smallest => at = first,
                        _ => break,
                    }
                    again = method.attempt(sys, self.w, at - t, &self.tol);
                    continue;
                };
                // a little behind it: a short way is known well
                let goal = at + due + (0.5 * near).min(due.abs().max(least));
                if (-near..=0.0).contains(&due) || goal >= t1 || goal - t <= smallest {
                    break;
                }
                at = goal;
                self.detector.keep_due(due + near);
                again = method.attempt(sys, self.w, at - t, &self.tol);
            }
            if let Attempt::TooLarge { next } | Attempt::Stuck { next, .. } = again {
                self.w.counters.rejected += 1;
                *failures += 1;
                return Event::Refused(next.min(0.5 * (at - t)).max(smallest));
            }
        }
        // an event at the very start of the step: nothing has moved yet, the candidate belongs to t1
        let at_once = at < t1 && at - t <= smallest;
        let te = if at_once { t + smallest } else { at }.min(t1);
        *failures = 0;
        self.late = 0.0;
        self.t = te;
        if at_once {
            self.tol.observe(&self.x, self.t);
        } else {
            self.grid.arrive((t, te), (&self.x, method.candidate()), sys, self.w);
            method.accept(te);
            self.w.counters.steps += 1;
            self.move_on(method);
            if !self.keep(method, tick) {
                return Event::Ended;
            }
        }
        self.w.past.corner(te);
        // the flags flip, then the algebraic unknowns jump
        sys.remember(self.w, &self.x, te);
        self.tick();
        for &k in self.detector.fired().iter().filter(|&&k| !sys.flags[k].law.of_modes()) {
            self.sys.flip(self.w, k);
            self.outcome.events.push((te, k, self.w.flags[k] != 0.0));
        }
        self.w.counters.events += 1;
        self.turn_laws(step);
        if let Some(k) = self.detector.flipped(sys, self.w, te, self.a.tstop) {
            if !self.outcome.resting.contains(&k) {
                self.outcome.resting.push(k);
            }
        }
        self.slopes_jump(method);
        self.stop = self.sys.next_stop(self.w, self.t, self.until);
        self.jump(step.min(self.tmax), method);
        self.grid.bent(self.t, self.stop - self.t);
        self.restart(method);
        let fraction = if self.dense { 0.25 } else { 0.02 };
        let cautious = (fraction * next.min(self.tmax)).max(0.1 * (te - t).min(next));
        let known = self.memory.first(method.character().leaps);
        Event::Passed(known.unwrap_or(cautious).max(smallest))
    }
}

/// What `Run::event` found in an attempted step.
enum Event {
    None,
    /// the shortened step failed; the length to try
    Refused(f64),
    /// the run was stopped while rows were made
    Ended,
    /// the run stands behind the event; the length of the next step
    Passed(f64),
}

fn newton<'n>(sys: &System, made: &'n mut Option<Newton>) -> Option<&'n mut Newton> {
    if made.is_none() {
        *made = Newton::new(sys).ok();
    }
    made.as_mut()
}
