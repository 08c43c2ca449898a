//! Parts of a circuit that nothing ties to each other, each with steps of its own, side by side in threads.
//!
//! Every part is a system of its own and runs as if there were no other (driver.rs). They share the table of rows: a row of one is a row
//! of all, and the others have there what their own dense output says, made as good as their own rows are (rows.rs). So a part waits
//! at the end of each step until all others have come as far, and knows then at which times they have rows within the step; the one
//! that is farthest behind waits for nobody.
use super::driver::{self, Outcome, Status, Tick, Transient, ASKED};
use super::monitor::Report;
use super::rows::{Around, Fitting, Forces, Sink};
use super::Used;
use crate::graph::Graph;
use crate::interrupt;
use crate::invariants::Invariants;
use crate::ledger::Inside;
use crate::newton::{Options, Tolerances};
use crate::record::Record;
use crate::system::{Hanging, System, Unstable, Work};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

/// So long nobody asks whether the run is to go on.
const BREATH: Duration = Duration::from_millis(50);

/// Some of the unknowns, with equations of their own.
pub struct Part {
    pub system: Arc<System>,
    pub graph: Graph,
    /// where its unknowns are in the whole
    pub of: Vec<usize>,
    /// its conditions, by their numbers, which are those of the whole
    pub flags: Vec<usize>,
}

/// A row of a part.
struct Given {
    t: f64,
    corner: bool,
    x: Vec<f64>,
    flags: Vec<f64>,
}

#[derive(Default)]
struct State {
    ends: Vec<f64>,                 // how far each part has come
    times: Vec<Vec<f64>>,           // of the rows of its own
    ready: Vec<VecDeque<Given>>,    // rows at the times of all
    progress: Vec<(f64, u64, u64)>, // length of the last step, steps, events
    stopped: bool,
}

/// Where parts wait for each other.
struct Meeting {
    state: Mutex<State>,
    turn: Condvar,
}

impl Meeting {
    fn new(parts: usize) -> Meeting {
        let state = State {
            ends: vec![-1.0; parts],
            times: vec![Vec::new(); parts],
            ready: (0..parts).map(|_| VecDeque::new()).collect(),
            progress: vec![(0.0, 0, 0); parts],
            stopped: false,
        };
        Meeting { state: Mutex::new(state), turn: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// A part has come to `end`, with rows of its own at these times: the times of the others' rows up to there, behind those that it
    /// knows (`seen`, by part). None where all is over.
    fn wait(&self, part: usize, own: &[f64], end: f64, seen: &mut [usize]) -> Option<Vec<f64>> {
        let mut state = self.state();
        state.times[part].extend(own);
        state.ends[part] = end;
        self.turn.notify_all();
        while !state.stopped && state.ends.iter().any(|&other| other < end) {
            state = self.turn.wait(state).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
        if state.stopped {
            return None;
        }
        let mut times = Vec::new();
        for (other, seen) in seen.iter_mut().enumerate().filter(|&(other, _)| other != part) {
            let before = times.len();
            times.extend(state.times[other][*seen..].iter().take_while(|&&t| t <= end));
            *seen += times.len() - before;
        }
        times.sort_unstable_by(f64::total_cmp);
        times.dedup();
        Some(times)
    }

    fn deliver(&self, part: usize, rows: impl Iterator<Item = Given>) {
        self.state().ready[part].extend(rows);
        self.turn.notify_all();
    }

    /// A part has ended; where it did not come to the end of the run, the others are to stop.
    fn leave(&self, part: usize, whole: bool) {
        let mut state = self.state();
        state.ends[part] = f64::INFINITY;
        state.stopped |= !whole;
        self.turn.notify_all();
    }
}

/// The place of a part in the meeting; it leaves whatever happens.
struct Place<'a> {
    meeting: &'a Meeting,
    part: usize,
    whole: bool,
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.meeting.leave(self.part, self.whole);
    }
}

/// Where the rows of a part go.
struct Own<'a> {
    meeting: &'a Meeting,
    part: usize,
    flags: &'a [usize],
    reads: Vec<u32>,
    shows_silent: bool,
    whole: f64,
    pending: Vec<Given>, // rows of its own since the last step
    corner: f64,
    seen: Vec<usize>, // rows of others, by part
    invariants: Invariants,
    tol: Tolerances,
    forces: Option<Forces>,
    fitting: Option<Fitting>,
    start: (f64, Vec<f64>), // of the step
    first: bool,            // behind a jump
}

impl Own<'_> {
    fn given(&self, w: &Work, t: f64, x: Vec<f64>) -> Given {
        Given { t, corner: t == self.corner, x, flags: self.flags.iter().map(|&k| w.flags[k]).collect() }
    }

    /// A row of another part, within the step that ends at (t1, x1).
    fn row_of_others(&mut self, sys: &System, w: &mut Work, t: f64, t1: f64, inside: &Inside) -> Given {
        let mut x = vec![0.0; sys.n];
        (inside.dense)(t, &mut x);
        sys.pin(w, t, &mut x);
        let begin = self.start.0;
        let around = Around { dense: &inside.dense, begin, h: t1 - begin, whole: self.whole };
        if let Some(forces) = &mut self.forces {
            forces.settle_within(sys, w, around, (t, &mut x), &self.tol);
        }
        if !self.invariants.holds(sys, w, t, &x) {
            if self.fitting.is_none() {
                self.fitting = Fitting::new(sys);
            }
            if let Some(fitting) = &mut self.fitting {
                fitting.fit(sys, w, around, (t, &mut x), &self.tol);
            }
        }
        self.given(w, t, x)
    }

    fn begin(&mut self, t: f64, x: &[f64]) {
        self.start.0 = t;
        self.start.1.clear();
        self.start.1.extend_from_slice(x);
    }
}

impl Sink for Own<'_> {
    fn row(&mut self, _: &System, w: &mut Work, t: f64, x: &[f64]) {
        let row = self.given(w, t, x.to_vec());
        self.pending.push(row);
    }

    fn corner(&mut self, t: f64) {
        self.corner = t;
    }

    fn reads(&self) -> &[u32] {
        &self.reads
    }

    fn shows_silent(&self, _: &System) -> bool {
        self.shows_silent
    }

    fn holds(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) -> bool {
        self.invariants.holds(sys, w, t, x)
    }

    fn within_step(&mut self, x0: &[f64], x1: &[f64], first: bool) {
        self.invariants.within_step(x0, x1, first);
    }

    fn open(&mut self, _: &System, _: &mut Work, t: f64, x: &[f64]) {
        self.begin(t, x);
        self.first = true;
        // the first row is one of all
        let rows = std::mem::take(&mut self.pending);
        self.meeting.deliver(self.part, rows.into_iter());
    }

    fn jump(&mut self, _: &System, _: &mut Work, t: f64, x: &[f64]) {
        self.begin(t, x);
        self.first = true;
    }

    fn step(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64], inside: &Inside) {
        self.tol.observe(x, t);
        let own = std::mem::take(&mut self.pending);
        let times: Vec<f64> = own.iter().map(|row| row.t).collect();
        if let Some(others) = self.meeting.wait(self.part, &times, t, &mut self.seen) {
            let mut rows = Vec::with_capacity(own.len() + others.len());
            let mut own = own.into_iter().peekable();
            for at in others {
                rows.extend(std::iter::from_fn(|| own.next_if(|row| row.t < at)));
                if own.peek().is_some_and(|row| row.t == at) {
                    continue;
                }
                self.invariants.within_step(&self.start.1, x, self.first);
                rows.push(self.row_of_others(sys, w, at, t, inside));
            }
            rows.extend(own);
            sys.set_time(w, t);
            self.meeting.deliver(self.part, rows.into_iter());
        }
        self.begin(t, x);
        self.first = false;
    }

    fn close(&mut self, _: &System, _: &mut Work) {}
}

/// The transient analysis of `sys`, of which these are the parts.
pub fn run(
    sys: &System,
    w: &mut Work,
    parts: &[Part],
    a: Transient,
    o: &Options,
    record: &mut Record,
    tick: &mut Tick,
) -> Outcome {
    let meeting = Meeting::new(parts.len());
    let mut shown = vec![false; sys.n];
    record.reads().iter().for_each(|&k| shown[k as usize] = true);
    let silent = record.shows_silent(sys);
    let lead = |k: usize, part: &Part| {
        let mut place = Place { meeting: &meeting, part: k, whole: false };
        let (sys, reads) = (&part.system, (0..part.of.len()).filter(|&i| shown[part.of[i]]).map(|i| i as u32));
        let reads: Vec<u32> = reads.collect();
        let mut own = Own {
            meeting: &meeting,
            part: k,
            flags: &part.flags,
            shows_silent: silent,
            whole: a.tstop,
            pending: Vec::new(),
            corner: f64::NAN,
            seen: vec![0; parts.len()],
            invariants: Invariants::new(&part.graph, sys, o, &[]),
            tol: Tolerances::new(sys, o),
            forces: Forces::new(sys, &reads),
            fitting: None,
            start: (0.0, Vec::new()),
            first: true,
            reads,
        };
        let mut w = sys.work();
        let mut goes_on = |_: f64, h: f64, steps: u64, events: u64| {
            let mut state = meeting.state();
            state.progress[k] = (h, steps, events);
            !state.stopped
        };
        let outcome = driver::lead(sys, &mut w, a, o, &mut own, &mut goes_on);
        place.whole = outcome.status == Status::Ok;
        (outcome, w)
    };
    let lead = &lead;
    let done: Vec<(Outcome, Work)> = std::thread::scope(|scope| {
        let threads: Vec<_> = parts
            .iter()
            .enumerate()
            .map(|(k, part)| scope.spawn(move || interrupt::beside(|| lead(k, part))))
            .collect();
        gather(sys, w, parts, &meeting, record, tick);
        let joined = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        joined.map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    record.close(sys, w);
    together(sys, w, parts, done)
}

/// Rows of all parts as they come, until all have left; now and then it is asked whether the run is to go on.
fn gather(sys: &System, w: &mut Work, parts: &[Part], meeting: &Meeting, record: &mut Record, tick: &mut Tick) {
    let (mut x, mut reached) = (vec![0.0; sys.n], 0.0);
    loop {
        let mut state = meeting.state();
        let rows = loop {
            let rows = state.ready.iter().map(VecDeque::len).min().unwrap_or(0);
            if rows > 0 || state.ends.iter().all(|&end| end == f64::INFINITY) {
                break rows;
            }
            let (next, late) =
                meeting.turn.wait_timeout(state, BREATH).unwrap_or_else(std::sync::PoisonError::into_inner);
            state = next;
            if late.timed_out() {
                break 0;
            }
        };
        let ended = rows == 0 && state.ends.iter().all(|&end| end == f64::INFINITY);
        let mut given: Vec<_> = state.ready.iter_mut().map(|ready| ready.drain(..rows).collect::<Vec<_>>()).collect();
        let h = state.progress.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        let (steps, events) = state.progress.iter().fold((0, 0), |sum, p| (sum.0 + p.1, sum.1 + p.2));
        drop(state);
        for row in 0..rows {
            let mut corner = false;
            for (part, given) in parts.iter().zip(&mut given) {
                let own = &mut given[row];
                part.of.iter().zip(&own.x).for_each(|(&i, &v)| x[i] = v);
                part.flags.iter().zip(&own.flags).for_each(|(&k, &v)| w.flags[k] = v);
                corner |= own.corner;
                own.x = Vec::new();
            }
            let t = given[0][row].t;
            debug_assert!(given.iter().all(|given| given[row].t == t));
            if t > 0.0 {
                w.until(t);
            }
            if corner {
                record.corner(t);
            }
            record.row(sys, w, t, &x);
            reached = t;
        }
        if ended {
            return;
        }
        if !tick(reached, h, steps, events) {
            meeting.state().stopped = true;
            meeting.turn.notify_all();
        }
    }
}

/// What the runs of the parts come to.
fn together(sys: &System, w: &mut Work, parts: &[Part], done: Vec<(Outcome, Work)>) -> Outcome {
    let mut whole = Outcome::default();
    let mut end = vec![0.0; sys.n];
    let (mut complete, mut used) = (true, Vec::<Used>::new());
    for (part, (mut own, done)) in parts.iter().zip(done) {
        w.counters.add(&done.counters);
        if let Some(hanging) = done.doubts.hanging.filter(|_| w.doubts.hanging.is_none()) {
            w.doubts.hanging = Some(Hanging { unknown: part.of[hanging.unknown], ..hanging });
        }
        if let Some(unstable) = done.doubts.unstable.filter(|_| w.doubts.unstable.is_none()) {
            w.doubts.unstable = Some(Unstable { unknown: part.of[unstable.unknown], ..unstable });
        }
        w.doubts.substitute = w.doubts.substitute.or(done.doubts.substitute);
        part.flags.iter().for_each(|&k| w.flags[k] = done.flags[k]);
        match own.status {
            Status::Failed if whole.status != Status::Failed => {
                whole.status = Status::Failed;
                whole.failed = own.failed.take().map(|mut failed| {
                    failed.why = failed.why.renumbered(&part.of);
                    failed
                });
            }
            Status::Interrupted if whole.status == Status::Ok => whole.status = Status::Interrupted,
            _ => {}
        }
        complete &= own.end.len() == part.of.len();
        part.of.iter().zip(&own.end).for_each(|(&i, &v)| end[i] = v);
        whole.events.append(&mut own.events);
        whole.resting.append(&mut own.resting);
        whole.broken.append(&mut own.broken);
        used.append(&mut own.used);
        add(&mut whole.watch, own.watch, &part.of);
    }
    // conditions of time alone that no row reads turn in every part
    whole.events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    whole.events.dedup();
    whole.broken.sort_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
    whole.broken.dedup_by_key(|&mut (_, flag)| flag);
    let mut methods: Vec<&str> = used.iter().map(|u| u.method.as_str()).collect();
    methods.sort_unstable();
    methods.dedup();
    let why = if used.iter().all(|u| u.why == ASKED) { ASKED } else { "parts of different paces" };
    whole.used = vec![Used { t: 0.0, method: methods.join(" and "), why: why.into() }];
    if complete {
        whole.end = end;
    }
    whole
}

/// What was seen in a part, beside what was seen in others: the first of each kind is told.
fn add(all: &mut Report, own: Report, of: &[usize]) {
    let mode = |mut m: super::monitor::Mode| {
        m.unknown = of[m.unknown];
        m
    };
    all.damped = all.damped.or(own.damped.map(mode));
    all.late = all.late.or(own.late.map(mode));
    all.ringing = all.ringing.or(own.ringing.map(|mut r| {
        r.unknown = of[r.unknown];
        r
    }));
    all.second = all.second.or(own.second.map(|k| of[k]));
    all.stiff = all.stiff.max(own.stiff);
}
