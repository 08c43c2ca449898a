//! A run that is led from outside (FMI): it goes on stretch by stretch as far as is asked, and between two stretches what comes from
//! outside (`waves::Input`) may change.
mod exchange;

use super::driver::{starting_point, Failed, Mark, Run, Status, Transient};
use super::rows::Sink;
use super::{make, Method};
use crate::ledger::Inside;
use crate::newton::Options;
use crate::record::Record;
use crate::system::{System, Work};
pub use exchange::{nominals, watched, Exchange, Stood};
use std::sync::Arc;

/// What is said to be the end of a run may be passed; it is then so much farther away.
const FARTHER: f64 = 2.0;

/// The outputs at the rows of the newest stretch, or at the newest row alone.
struct Newest {
    record: Record,
    all: bool,
}

impl Sink for Newest {
    fn row(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        if !self.all {
            self.record.data.clear();
        }
        self.record.push(sys, w, t, x);
    }
    fn reads(&self) -> &[u32] {
        self.record.reads()
    }
    fn shows_silent(&self, sys: &System) -> bool {
        self.record.shows_silent(sys)
    }
    fn open(&mut self, _: &System, _: &mut Work, _: f64, _: &[f64]) {}
    fn jump(&mut self, _: &System, _: &mut Work, _: f64, _: &[f64]) {}
    fn step(&mut self, _: &System, _: &mut Work, _: f64, _: &[f64], _: &Inside) {}
    fn close(&mut self, _: &System, _: &mut Work) {}
}

/// A place that a session can be taken back to.
pub struct Place {
    mark: Mark,
    values: Vec<f64>,
}

pub struct Session {
    // these two borrow what `Owned` holds, and are gone before it
    run: Run<'static, Newest>,
    method: Box<dyn Method>,
    end: f64,
    _owned: Owned,
}

/// What the run borrows: at places of its own, which nobody else touches.
struct Owned {
    _system: Arc<System>,
    work: *mut Work,
    options: *mut Options,
    newest: *mut Newest,
}

impl Owned {
    fn new(system: Arc<System>, options: Options, newest: Newest) -> Owned {
        let work = Box::into_raw(Box::new(system.work()));
        let (options, newest) = (Box::into_raw(Box::new(options)), Box::into_raw(Box::new(newest)));
        Owned { _system: system, work, options, newest }
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: made by `Box::into_raw` and freed here alone; fields are dropped in order, so who borrowed them is gone
        unsafe {
            drop(Box::from_raw(self.work));
            drop(Box::from_raw(self.options));
            drop(Box::from_raw(self.newest));
        }
    }
}

// SAFETY: all that is borrowed belongs to the session itself and moves with it; none of it is bound to a thread
unsafe impl Send for Session {}

impl Session {
    /// A run at its start, with the outputs of `record` known there. Where its rows are drawn, all of a stretch are kept.
    pub fn new(system: Arc<System>, a: Transient, options: Options, record: Record) -> Result<Session, Failed> {
        let owned = Owned::new(system, options, Newest { record, all: a.drawn });
        // SAFETY: these live until `owned` is dropped, which is behind the run and the method (the order of fields); the
        // system is behind an Arc that `owned` holds
        let (sys, w, o, newest): (&'static System, &'static mut Work, &'static Options, &'static mut Newest) =
            unsafe { (&*Arc::as_ptr(&owned._system), &mut *owned.work, &*owned.options, &mut *owned.newest) };
        let x = starting_point(sys, w, a, o).map_err(|failed| *failed)?;
        let at_start = |why| Failed::at_start("transient", why, vec![]);
        let method = make(sys, o, &o.method).map_err(at_start)?;
        let run = Run::new(sys, w, a, o, newest, x, method.character()).map_err(at_start)?;
        let mut session = Session { run, method, end: a.tstop, _owned: owned };
        session.run.start(session.method.as_mut());
        session.outcome().map(|()| session)
    }

    fn outcome(&self) -> Result<(), Failed> {
        match (&self.run.outcome.status, &self.run.outcome.failed) {
            (Status::Ok, _) => Ok(()),
            (_, Some(failed)) => Err(failed.clone()),
            (_, None) => Err(Failed::at_start(
                "transient",
                crate::newton::Failure::Unfit { why: "it was stopped".into() },
                vec![],
            )),
        }
    }

    /// Inputs have changed at the present point, and jump or not: values that hang on them follow.
    pub fn disturb(&mut self, jumps: bool, until: f64) {
        self.run.disturb(self.method.as_mut(), jumps, until);
    }

    /// Goes on to `until`.
    pub fn advance(&mut self, until: f64) -> Result<(), Failed> {
        while until > self.end {
            self.end *= FARTHER;
            self.run.lengthen(self.end);
        }
        if self.run.record.all {
            self.run.record.record.data.clear();
        }
        self.run.go_on(self.method.as_mut(), until, &mut |_, _, _, _| true);
        self.outcome()
    }

    /// Flags that have turned since this was asked, when, and what to; and those that chatter.
    pub fn happened(&mut self) -> (Vec<(f64, usize, bool)>, &[usize]) {
        self.run.w.logic.log.clear();
        (std::mem::take(&mut self.run.outcome.events), &self.run.outcome.resting)
    }

    /// What is stored in a row where the run stands, and how fast it changes.
    pub fn stored(&mut self, row: usize) -> (f64, f64) {
        let (sys, t) = (self._owned._system.clone(), self.run.time());
        sys.eval(self.run.w, &self.run.x, t);
        (self.run.w.q[row], -self.run.w.f[row])
    }

    /// What a watched condition asks where the run stands: above 0 where it is to turn.
    pub fn indicator(&mut self, k: usize) -> f64 {
        let (sys, t) = (self._owned._system.clone(), self.run.time());
        let mut all = vec![0.0; sys.flags.len()];
        sys.eval_all_roots(self.run.w, &self.run.x, t, &mut all);
        watched(&sys).get(k).map_or(0.0, |&k| all[k])
    }

    /// The rows of the newest stretch, or the newest row: time and outputs, one after the other.
    pub fn rows(&self) -> &[f64] {
        &self.run.record.record.data
    }

    /// The outputs where the run stands.
    pub fn outputs(&self) -> &[f64] {
        let (rows, columns) = (self.rows(), self.run.record.record.columns);
        rows.get((rows.len() + 1).saturating_sub(columns)..).unwrap_or(&[])
    }

    pub fn place(&self) -> Place {
        Place { mark: self.run.mark(), values: self.run.record.record.data.clone() }
    }

    pub fn return_to(&mut self, place: &Place) {
        self.run.rewind(&place.mark, self.method.as_mut());
        self.run.record.record.data.clone_from(&place.values);
    }
}
