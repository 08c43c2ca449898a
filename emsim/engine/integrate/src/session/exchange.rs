//! A run whose steps somebody else takes (FMI: model exchange). The equations are the explicit ODE of `reduced`,
//!
//! ```text
//!     dy/dt = f(y, u, t),    y = Q of the differential rows: charges, flux linkages, coordinates, momenta
//! ```
//!
//! What is algebraic is solved for at each point. Where Newton's method is needed, it begins at the point that was accepted last, so
//! that f is a function of y, u and t alone between two accepted points, to the last bit. Conditions are event indicators, corners and
//! edges of sources time events; what happens at an event is the driver's (driver/outside.rs).
use super::super::driver::{Mark, Transient};
use super::super::explicit::place;
use super::{Failed, Session};
use crate::model::Law;
use crate::newton::{Failure, Options};
use crate::record::Record;
use crate::reduced::{Point, Reduced, Trouble};
use crate::rounding::SAME;
use crate::system::System;
use crate::tolerances::Tolerances;
use std::sync::Arc;

pub struct Exchange {
    session: Session,
    system: Arc<System>,
    point: Point,
    t: f64,
    y: Vec<f64>,
    x: Vec<f64>,
    rates: Vec<f64>,
    outputs: Vec<f64>,
    /// the point that was accepted last
    anchor: Vec<f64>,
    accepted: f64,
    width: f64,
    since: f64,
    nominal: Vec<f64>,
    watched: Vec<usize>,
    fired: Vec<usize>,
    /// what conditions asked at the two points that were accepted last
    asking: [Vec<f64>; 2],
    is_known: bool,
    /// something has happened, or changed, since the last event
    is_due: bool,
}

/// What an event came to.
pub struct Happened {
    pub states_jumped: bool,
    pub next: Option<f64>,
}

/// What an exchange is taken back to.
pub struct Stood {
    mark: Mark,
    t: f64,
    y: Vec<f64>,
    anchor: Vec<f64>,
    accepted: f64,
    width: f64,
    since: f64,
    fired: Vec<usize>,
    asking: [Vec<f64>; 2],
    is_due: bool,
    ends: (f64, f64),
}

/// Flags whose operands are looked at between events: not those that sources decide, nor what is written at events.
pub fn watched(sys: &System) -> Vec<usize> {
    let asks = |law: Law| !law.remembers() && law != Law::Kept;
    (0..sys.flags.len()).filter(|&k| !sys.is_timed(k) && asks(sys.flags[k].law)).collect()
}

/// Of each state how large it is where what it stores is a million of the deck's absolute tolerances at SPICE's relative tolerance: a
/// volt, a microampere, a hundredth of the machine's length.
pub fn nominals(sys: &System, reduced: &Reduced, o: &Options) -> Vec<f64> {
    let plain = Options { reltol: Options::default().reltol, ..o.clone() };
    let (tol, mut w) = (Tolerances::new(sys, &plain), sys.work());
    w.gmin = o.gmin;
    let x: Vec<f64> = sys.unknowns.iter().map(|u| u.initial).collect();
    sys.eval_jacobian(&mut w, &x, 0.0, false);
    let stored = |i: usize| sys.pattern.position(i, i).map_or(0.0, |k| w.cv[k].abs());
    let of = |&row: &usize| {
        let size = 1e6 * tol.atol[row] * stored(row);
        if size > 0.0 && size.is_finite() {
            size
        } else {
            1.0
        }
    };
    reduced.states.iter().map(of).collect()
}

impl Exchange {
    /// A run at its start. The system has been prepared by `reduce_for_others`.
    pub fn new(system: Arc<System>, a: Transient, options: Options, record: Record) -> Result<Exchange, Failed> {
        // by whose formulas values behind a jump are found
        let options = Options { method: "rk45".into(), ..options };
        let reduced = system.reduced().map_err(unfit)?;
        let floor = Tolerances::new(&system, &options).atol;
        let (nominal, watched) = (nominals(&system, reduced, &options), watched(&system));
        let count = reduced.states.len();
        let point = reduced.point(&vec![0.0; system.flags.len()], options.gmin, floor);
        let session = Session::new(system.clone(), a, options, record)?;
        let mut made = Exchange {
            x: session.run.x.clone(),
            anchor: session.run.x.clone(),
            session,
            point,
            t: 0.0,
            y: vec![0.0; count],
            rates: vec![0.0; count],
            outputs: Vec::new(),
            accepted: 0.0,
            width: 0.0,
            since: 0.0,
            nominal,
            watched,
            fired: Vec::new(),
            asking: [vec![], vec![]],
            is_known: false,
            is_due: false,
            system,
        };
        made.y = made.behind()?;
        made.begin_asking()?;
        Ok(made)
    }

    pub fn states(&self) -> &[f64] {
        &self.y
    }

    pub fn nominals(&self) -> &[f64] {
        &self.nominal
    }

    pub fn put_time(&mut self, t: f64) {
        self.is_known &= self.t.to_bits() == t.to_bits();
        self.t = t;
    }

    pub fn put_states(&mut self, y: &[f64]) {
        let same = self.y.iter().zip(y).all(|(a, b)| a.to_bits() == b.to_bits());
        self.is_known &= same;
        self.y.copy_from_slice(y);
    }

    /// What comes from outside has another value.
    pub fn disturb(&mut self) {
        (self.is_known, self.is_due) = (false, true);
    }

    pub fn rates(&mut self) -> Result<&[f64], Failed> {
        self.arrive().map(|()| &*self.rates)
    }

    /// The outputs of the record.
    pub fn outputs(&mut self) -> Result<&[f64], Failed> {
        self.arrive()?;
        if self.outputs.is_empty() {
            let run = &mut self.session.run;
            let record = &mut run.record.record;
            record.data.clear();
            record.push(&self.system, run.w, self.t, &self.x);
            self.outputs.extend_from_slice(&record.data[1..]);
        }
        Ok(&self.outputs)
    }

    /// Of each watched condition what is above 0 where it is to turn.
    pub fn indicators(&mut self, out: &mut [f64]) -> Result<(), Failed> {
        self.arrive()?;
        let all = self.asked();
        self.watched.iter().zip(out).for_each(|(&k, out)| *out = all[k]);
        Ok(())
    }

    /// What all conditions ask at the point that is known.
    fn asked(&mut self) -> Vec<f64> {
        let mut all = vec![0.0; self.system.flags.len()];
        self.system.eval_roots(self.session.run.w, &self.x, self.t, &mut all);
        all
    }

    /// A step of the importer's is accepted; true where it is to come for an event.
    pub fn accept(&mut self) -> Result<bool, Failed> {
        self.arrive()?;
        self.session.run.stand(self.t, &self.x);
        self.anchor.copy_from_slice(&self.x);
        let now = self.asked();
        if self.t > self.accepted {
            (self.width, self.accepted) = (self.t - self.accepted, self.t);
            self.asking.swap(0, 1);
        }
        self.asking[1] = now;
        self.session.run.reach(self.t);
        Ok(self.session.run.ends().0 < self.t)
    }

    /// Notes which conditions have crossed, before what comes from outside may jump.
    pub fn begin_event(&mut self) -> Result<(), Failed> {
        self.accept()?;
        let [before, now] = &self.asking;
        // what has a millionth of its way since the step began still to go has arrived: where a solver finds it is its own
        let has_come = |&k: &usize| now[k] > 0.0 || now[k] > -1e-6 * (now[k] - before[k]);
        self.fired = self.watched.iter().copied().filter(has_come).collect();
        self.is_due = true;
        Ok(())
    }

    /// The event: values behind it.
    pub fn happen(&mut self) -> Result<Happened, Failed> {
        let mut states_jumped = false;
        if std::mem::take(&mut self.is_due) {
            let fired = std::mem::take(&mut self.fired);
            let Session { run, method, .. } = &mut self.session;
            let width = if self.width > 0.0 { self.width } else { f64::INFINITY };
            let modes = run.occur(method.as_mut(), &fired, width);
            self.session.outcome()?;
            self.since = self.t;
            let y = self.behind()?;
            let moved = |k: usize| {
                let size = self.y[k].abs().max(y[k].abs()).max(self.nominal[k]);
                // (else what so short a step moves)
                let least = if modes { 0.0 } else { SAME * size };
                (y[k] - self.y[k]).abs() > least
            };
            states_jumped = (0..y.len()).any(moved);
            if states_jumped {
                self.y = y;
            }
            self.begin_asking()?;
        }
        Ok(Happened { states_jumped, next: self.session.run.next_corner() })
    }

    /// Conditions are asked from here on.
    fn begin_asking(&mut self) -> Result<(), Failed> {
        self.arrive()?;
        let now = self.asked();
        self.asking = [now.clone(), now];
        self.accepted = self.t;
        Ok(())
    }

    /// The states that the run has where it stands, which is a little behind t: less what they have moved since.
    fn behind(&mut self) -> Result<Vec<f64>, Failed> {
        let (sys, run) = (self.system.clone(), &mut self.session.run);
        let reduced = sys.reduced().map_err(unfit)?;
        let at = run.time();
        place(reduced, &mut self.point, &sys, run.w, (at, &run.x));
        self.anchor.copy_from_slice(&run.x);
        let mut y = reduced.y(&mut self.point).to_vec();
        let mut rates = vec![0.0; y.len()];
        let done = reduced.rates(&mut self.point, &sys.waves, at, false, &mut rates);
        done.map_err(|why| failed(&sys, at, why))?;
        y.iter_mut().zip(&rates).for_each(|(y, rate)| *y -= (at - self.t) * rate);
        self.is_known = false;
        Ok(y)
    }

    /// Everything at (t, y).
    fn arrive(&mut self) -> Result<(), Failed> {
        if self.is_known {
            return Ok(());
        }
        let (sys, w) = (self.system.clone(), &mut *self.session.run.w);
        let reduced = sys.reduced().map_err(unfit)?;
        sys.touch_sources(w);
        self.point.flags.copy_from_slice(&w.flags);
        let stop = self.session.run.ends().0;
        let before = self.t > self.since && self.t >= stop * (1.0 - 8.0 * f64::EPSILON);
        let (y, t, near) = (&self.y, self.t, self.x.clone());
        let (point, rates, x) = (&mut self.point, &mut self.rates, &mut self.x);
        let mut from = |guess: &[f64]| {
            reduced.start_from(point, guess);
            reduced.y(point).copy_from_slice(y);
            reduced.stretch(point, &sys.waves, (t, before), stop);
            reduced.arrive(point, &sys.waves, t, before, Some(rates), x)
        };
        // (where Newton's method finds no way from there, it begins at the point that was asked for last)
        from(&self.anchor).or_else(|_| from(&near)).map_err(|why| failed(&sys, t, why))?;
        self.outputs.clear();
        self.is_known = true;
        Ok(())
    }

    /// Unknowns at (t, y), for slopes there.
    pub fn unknowns(&mut self) -> Result<(&[f64], f64), Failed> {
        self.arrive().map(|()| (&*self.x, self.t))
    }

    pub fn work(&mut self) -> &mut crate::system::Work {
        self.session.run.w
    }

    pub fn happened(&mut self) -> (Vec<(f64, usize, bool)>, &[usize]) {
        self.session.happened()
    }

    pub fn stood(&self) -> Stood {
        Stood {
            mark: self.session.run.mark(),
            t: self.t,
            y: self.y.clone(),
            anchor: self.anchor.clone(),
            accepted: self.accepted,
            width: self.width,
            since: self.since,
            fired: self.fired.clone(),
            asking: self.asking.clone(),
            is_due: self.is_due,
            ends: self.session.run.ends(),
        }
    }

    pub fn return_to(&mut self, stood: &Stood) {
        let Session { run, method, .. } = &mut self.session;
        run.rewind(&stood.mark, method.as_mut());
        run.end_at(stood.ends);
        (self.t, self.accepted, self.width, self.since) = (stood.t, stood.accepted, stood.width, stood.since);
        self.y.clone_from(&stood.y);
        self.anchor.clone_from(&stood.anchor);
        self.fired.clone_from(&stood.fired);
        self.asking.clone_from(&stood.asking);
        (self.is_known, self.is_due) = (false, stood.is_due);
    }
}

fn unfit(why: &str) -> Failed {
    Failed::at_start("transient", Failure::Unfit { why: why.into() }, vec![])
}

fn failed(sys: &System, t: f64, why: Trouble) -> Failed {
    let row = |k: usize| if k < sys.n { k } else { k % sys.n };
    let why = match why {
        Trouble::Singular { unknown } => Failure::Unfit {
            why: format!("charges, fluxes or momenta do not determine `{}`", sys.unknowns[row(unknown)].name),
        },
        Trouble::Diverged { unknown } => Failure::Diverged { unknown: row(unknown), row: row(unknown) },
        Trouble::NotFinite { unknown } => Failure::NotFinite { unknown: row(unknown) },
    };
    Failed { t, h: 0.0, during: "transient", why, tried: vec![] }
}
