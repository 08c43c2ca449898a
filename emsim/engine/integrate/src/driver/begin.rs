//! Where a run begins: the point, what the run holds, values and modes that fit each other there.

use super::super::rows::{undetermined, Grid, Sink};
use super::super::{Character, Method};
use super::*;
use crate::modes::put_thresholds;
use crate::system::Kind;

/// Where another run ended, initial conditions, or the operating point with the machine held.
pub fn starting_point(sys: &System, w: &mut Work, a: Transient, o: &Options) -> Result<Vec<f64>, Box<Failed>> {
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
        w.doubts.unstable = op::falls_over(sys, w, &x, o, &tol);
    }
    found.map(|()| x).map_err(Box::new)
}

impl<'a, S: Sink> Run<'a, S> {
    pub fn new(
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
            slopes: None,
            shown: Shown { kept: a.from, ..Shown::default() },
            crept: (f64::NEG_INFINITY, 0.0),
            monitor: Monitor::new(sys, o, a.tstop, tmax),
        })
    }

    pub fn start(&mut self, method: &mut dyn Method) {
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
        let mut exact = known() || !self.a.uic && method.settle(self.sys, self.w, t, 0.0, &mut self.x);
        if !exact {
            self.settle(t, short.max(rounded.min(1e-3 * feature)), true);
        }
        let rounds = self.sys.rounds();
        for again in 0..=rounds {
            // flags may hang on algebraic unknowns that other flags move: settle them together
            let turn = if 2 * again > rounds { System::turn_first } else { System::update_flags };
            if !turn(self.sys, self.w, &self.x, t) {
                break;
            }
            (exact, _) = (false, self.settle(t, 1e-9 * feature, false));
            if again == rounds {
                return self.contradicts(1e-9 * feature);
            }
        }
        self.w.logic.begin(&self.sys.logic);
        self.w.clocked.begin();
        self.stop = self.sys.next_stop(self.w, t, self.until);
        self.begin_laws(feature, exact);
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
}
