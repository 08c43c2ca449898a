//! The transient analysis: one loop for every method. Breakpoints are stepped onto; state events are located on the
//! method's dense output, stepped onto, and followed by a restart with consistent values; what was computed is kept
//! whatever ends the run.
use super::{make, Attempt, Method};
use crate::events::{Candidate, Detector, Located};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::op;
use crate::record::Record;
use crate::system::{System, Work};

#[derive(Clone, Copy, Debug)]
pub struct Transient {
    pub tstep: f64,
    pub tstop: f64,
    pub tstart: f64,
    pub tmax: Option<f64>,
    pub uic: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Status {
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

pub struct Outcome {
    pub status: Status,
    pub failed: Option<Failed>,
    pub events: Vec<(f64, usize, bool)>,
    /// flags that chattered and were put to rest for a while
    pub resting: Vec<usize>,
}

/// Called now and then with (t, h, steps, events); false stops the run.
pub type Tick<'a> = dyn FnMut(f64, f64, u64, u64) -> bool + 'a;

const TICK: u64 = 64;
/// A run that advances less than `LEAST` of its span in `PATIENCE` steps is stopped: it would need 1e14 of them.
const PATIENCE: u64 = 200_000;
const LEAST: f64 = 2e-9;
/// No quantity of a deck is larger; a solution on its way to infinity ends here, before it is NaN.
const LARGEST: f64 = 1e100;

pub fn run(sys: &System, w: &mut Work, a: Transient, o: &Options, record: &mut Record, tick: &mut Tick) -> Outcome {
    let mut outcome = Outcome { status: Status::Ok, failed: None, events: Vec::new(), resting: Vec::new() };
    let fail = |outcome: &mut Outcome, t, h, during, why, tried| {
        outcome.status = Status::Failed;
        outcome.failed = Some(Failed { t, h, during, why, tried });
    };
    let mut tol = Tolerances::new(sys, o);
    w.gmin = o.gmin;

    // the starting point: initial conditions, or the operating point with the machine held
    let mut x = op::initial(sys);
    if a.uic {
        if let Err(why) = op::initial_conditions(sys, w, &mut x, a.tstep, &tol) {
            fail(&mut outcome, 0.0, 0.0, "initial conditions", why, vec!["charges as given by IC=".into()]);
            return outcome;
        }
    } else if let Err(e) = op::operating_point(sys, w, o, &tol, false, &mut x) {
        fail(&mut outcome, 0.0, 0.0, "operating point", e.why, e.tried);
        return outcome;
    }
    tol.observe(&x);
    let span = a.tstop;
    // one Newton for every restart with consistent values: its symbolic analysis is done once
    let (mut method, mut newton) = match (make(sys, o), Newton::new(sys)) {
        (Ok(m), Ok(n)) => (m, n),
        (Err(why), _) | (_, Err(why)) => {
            fail(&mut outcome, 0.0, 0.0, "transient", why, vec![]);
            return outcome;
        }
    };
    let dense = method.wants_dense_record();
    // SPICE bounds the step by TSTEP; methods with dense output of their own order need only see every part of the span
    let fiftieth = (a.tstop - a.tstart) / 50.0;
    let tmax = a.tmax.unwrap_or(if dense { fiftieth } else { a.tstep.min(fiftieth) });
    let feature = sys.shortest_feature().min(a.tstep).min(tmax);
    op::consistent(sys, &mut newton, w, &mut x, 0.0, 1e-5 * feature, &tol, true);
    let mut detector = Detector::new(sys);
    let settle =
        |newton: &mut Newton, w: &mut Work, x: &mut Vec<f64>, t: f64, h: f64, tol: &Tolerances, events: &mut Vec<_>| {
            // flags may hang on algebraic unknowns that other flags move: settle them together
            for _ in 0..20 {
                let before = w.flags.clone();
                if !sys.update_flags(w, x, t) {
                    break;
                }
                for (k, (old, new)) in before.iter().zip(&w.flags).enumerate() {
                    if old != new {
                        events.push((t, k, *new != 0.0));
                    }
                }
                op::consistent(sys, newton, w, x, t, h, tol, false);
            }
        };
    let mut settled = Vec::new();
    settle(&mut newton, w, &mut x, 0.0, 1e-9 * feature, &tol, &mut settled);
    if a.tstart <= 0.0 {
        record.push(sys, w, 0.0, &x);
    }
    method.restart(sys, w, 0.0, &x);
    detector.start(sys, w, &x, 0.0);

    let first = match o.fixed_step {
        Some(h) => h,
        None if dense => 1e-2 * feature,
        None => (0.01 * feature).min(1e-3 * span),
    };
    let (mut t, mut h) = (0.0_f64, first);
    let mut late = 0.0_f64; // what rounding has taken from t
    let mut breakpoint = sys.next_breakpoint(0.0).min(a.tstop);
    let mut grid = Grid::new(a.tstart, a.tstep, a.tstop);
    let mut scratch = vec![0.0; sys.n];
    let mut failures = 0u32;
    let mut normal_h = tmax; // the step before a corner cut it
    let mut count = 0u64;
    let mut mark = 0.0_f64;
    while t < a.tstop {
        count += 1;
        // so many steps for so little: the run would never end
        if count % PATIENCE == 0 {
            if t - mark < LEAST * span && o.fixed_step.is_none() {
                let why = Failure::Diverged { unknown: 0, row: 0 };
                let tried = vec![format!("{PATIENCE} steps without getting on")];
                fail(&mut outcome, t, h, "transient", why, tried);
                return outcome;
            }
            mark = t;
        }
        if count % TICK == 0 && !tick(t, h, w.counters.steps, w.counters.events) {
            outcome.status = Status::Interrupted;
            return outcome;
        }
        // how far may this step go
        let left = (breakpoint - t) - late;
        let mut step = h.min(if o.fixed_step.is_some() { h } else { tmax });
        let mut lands = false;
        if step >= left * (1.0 - 1e-9) {
            step = left;
            lands = true;
        } else if step > 0.5 * left && o.fixed_step.is_none() {
            step = 0.5 * left; // two equal steps instead of a long and a tiny one
        }
        let smallest = (16.0 * f64::EPSILON * t).max(1e-18 * a.tstop);
        if step < smallest && !lands {
            step = smallest;
        }
        match method.attempt(sys, w, step, &tol) {
            Attempt::Stuck { next, why } => {
                w.counters.newton_failures += 1;
                failures += 1;
                if next <= smallest || failures > 60 || o.fixed_step.is_some() {
                    let tried = vec![format!("halving the step {failures} times"), format!("method {}", o.method)];
                    fail(&mut outcome, t, step, "transient", why, tried);
                    return outcome;
                }
                h = next;
                continue;
            }
            Attempt::TooLarge { next } => {
                w.counters.rejected += 1;
                if step > smallest * 1.01 {
                    h = next.max(smallest);
                    continue;
                }
                // the smallest step there is: the solution jumps here, take it as it comes
                t = (t + step).min(breakpoint);
                late = 0.0;
                method.accept(t);
                h = 2.0 * smallest;
            }
            Attempt::Good { next } => {
                let t1 = if lands { breakpoint } else { t + (step + late) };
                let mut located = None;
                if !sys.flags.is_empty() {
                    let inside = |t: f64, out: &mut [f64]| method.dense(t, out);
                    let candidate = Candidate { end: method.candidate(), dense: &inside, long: dense };
                    located = detector.locate(sys, w, &candidate, t, t1, &mut scratch);
                }
                if let Some(Located { mut at }) = located {
                    if at < t1 && at - t > smallest {
                        // step onto the event: the same step, shorter; a little further where dense output was early
                        let mut again = method.attempt(sys, w, at - t, &tol);
                        for _ in 0..6 {
                            if !matches!(again, Attempt::Good { .. }) {
                                break;
                            }
                            let Some(more) = detector.missing(sys, w, method.candidate(), t, at) else { break };
                            let further = at + (2.0 * more).max(1e-12 * step).max(smallest);
                            if further >= t1 {
                                break;
                            }
                            at = further;
                            again = method.attempt(sys, w, at - t, &tol);
                        }
                        match again {
                            Attempt::Good { .. } => {}
                            Attempt::TooLarge { next } | Attempt::Stuck { next, .. } => {
                                w.counters.rejected += 1;
                                failures += 1;
                                if failures > 60 {
                                    let why = Failure::Diverged { unknown: 0, row: 0 };
                                    fail(&mut outcome, t, step, "transient", why, vec!["locating an event".into()]);
                                    return outcome;
                                }
                                h = next.min(0.5 * (at - t)).max(smallest);
                                continue;
                            }
                        }
                    }
                    // an event at the very start of the step: nothing has moved yet, the candidate belongs to t1
                    let at_once = at < t1 && at - t <= smallest;
                    let te = if at_once { t + smallest } else { at.min(t1) };
                    failures = 0;
                    late = 0.0;
                    if !at_once {
                        method.accept(te);
                        w.counters.steps += 1;
                        x.copy_from_slice(method.candidate());
                        if dense {
                            grid.fill(method.as_ref(), te, sys, w, record, &mut scratch);
                        }
                    }
                    if te >= a.tstart {
                        record.push(sys, w, te, &x);
                    }
                    tol.observe(&x);
                    let taken = te - t;
                    t = te;
                    // the flags flip, then the algebraic unknowns jump
                    for &k in detector.fired() {
                        w.flags[k] = 1.0 - w.flags[k];
                        outcome.events.push((te, k, w.flags[k] != 0.0));
                    }
                    w.counters.events += 1;
                    if let Some(k) = detector.flipped(te, span) {
                        if !outcome.resting.contains(&k) {
                            outcome.resting.push(k);
                        }
                    }
                    op::consistent(sys, &mut newton, w, &mut x, t, 1e-9 * step.min(tmax), &tol, false);
                    settle(&mut newton, w, &mut x, t, 1e-9 * step.min(tmax), &tol, &mut outcome.events);
                    method.restart(sys, w, t, &x);
                    detector.start(sys, w, &x, t);
                    if breakpoint <= t * (1.0 + 1e-15) {
                        breakpoint = sys.next_breakpoint(t).min(a.tstop);
                    }
                    let fraction = if dense { 0.25 } else { 0.02 };
                    h = (fraction * next.min(tmax)).max(0.1 * taken.min(next)).max(smallest);
                    continue;
                }
                failures = 0;
                method.accept(t1);
                w.counters.steps += 1;
                late = if lands { 0.0 } else { (step + late) - (t1 - t) };
                t = t1;
                h = next;
            }
        }
        x.copy_from_slice(method.candidate());
        if let Some(unknown) = x.iter().position(|v| v.abs() > LARGEST) {
            fail(
                &mut outcome,
                t,
                step,
                "transient",
                Failure::NotFinite { unknown },
                vec!["it grows without bound".into()],
            );
            return outcome;
        }
        if dense {
            grid.fill(method.as_ref(), t, sys, w, record, &mut scratch);
        }
        if t >= a.tstart {
            record.push(sys, w, t, &x);
        }
        tol.observe(&x);
        detector.accept(sys, w, &x, t);
        if lands && t >= breakpoint {
            if t >= a.tstop {
                break;
            }
            w.counters.breakpoints += 1;
            let jump = sys.jumps_at(t);
            breakpoint = sys.next_breakpoint(t).min(a.tstop);
            if jump {
                op::consistent(sys, &mut newton, w, &mut x, t * (1.0 + 1e-15) + 1e-12 * tmax, 1e-9 * tmax, &tol, false);
                settle(&mut newton, w, &mut x, t, 1e-9 * tmax, &tol, &mut outcome.events);
            }
            if o.fixed_step.is_none() && (jump || method.restarts_at_corners()) {
                method.restart(sys, w, t, &x);
                detector.start(sys, w, &x, t);
                h = (0.1 * (breakpoint - t).min(normal_h).min(tmax)).max(smallest);
            } else if o.fixed_step.is_none() {
                h = h.max(normal_h.min(tmax)).min(0.5 * (breakpoint - t));
            } else {
                h = first;
            }
        } else {
            normal_h = h;
        }
    }
    outcome
}

/// The print grid tstart + k tstep: rows between internal points, from the method's dense output.
struct Grid {
    start: f64,
    step: f64,
    stop: f64,
    k: f64,
}

impl Grid {
    fn new(start: f64, step: f64, stop: f64) -> Grid {
        Grid { start, step, stop, k: 1.0 }
    }

    /// Rows for every grid time strictly before `t1`, which is recorded by the caller.
    fn fill(&mut self, m: &dyn Method, t1: f64, sys: &System, w: &mut Work, record: &mut Record, scratch: &mut [f64]) {
        loop {
            let t = self.start + self.k * self.step;
            let near = 1e-9 * self.step;
            if t > t1 + near || t > self.stop {
                return;
            }
            self.k += 1.0;
            if t < t1 - near {
                m.dense(t, scratch);
                record.push(sys, w, t, scratch);
            }
        }
    }
}
