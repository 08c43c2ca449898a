//! Picks the method, at the start and while it runs. It knows the equations by what they are made of and a method by what it says of
//! itself; nothing is measured with a clock, so that equal decks take equal steps. The rules, with the price of each in
//! `python tests/bench/auto.py`:
//!
//!  1. `EXPLICIT` where the equations reduce to an ODE and hold no exponential, which is stiff whenever it conducts. Not where all
//!     is linear: a step of `SMOOTH` is one solution there, with a factorisation that is kept, from one corner to the next. Nor with
//!     more than `LOOPS` closed loops, which every stage has to be brought onto.
//!  2. Otherwise implicit (`implicit`): `SMOOTH` where nothing turns within a step, `GENTLE` where exponentials alone do, `SHORT` where they
//!     do beside what throws many-step methods back: switches, machines, coils that ring on with what a junction has left in them.
//!     Exponentials written as expressions bend what rings beside them more gently than a junction: `SMOOTH` there. `GENTLE` all the same
//!     where currents follow from changes of what is stored, as of a source with the charge of a junction across it, unless nothing of it is
//!     shown beside switches: `SHORT` has to solve for them anew in every row, ten solutions each. `SHORT` too where all is linear and the
//!     factors fill so much that its one factorisation a step outweighs all the steps that `SMOOTH` saves (`fills`).
//!  3. A run begins implicitly where its fastest eigenvalue is `FAST` times faster than the shortest time that its sources and its print
//!     grid speak of: order is lost on what follows such a mode long before stability is. Also where that mode is damped and `LASTING` times
//!     faster than the run is long: it will have died, and stability will want all those steps.
//!  4. From explicit to implicit by the same measure behind an event whose first step is refused, when stability has limited `STIFF`
//!     steps in a row, when the step collapses, when a stage cannot be solved, or where a loop comes near a loss of rank. There is no way back.
//!  5. Where a method gives up, the others go on from the last good point in the order of `OTHERS`.
mod fills;

use self::fills::fills;
use super::explicit::place;
use super::{make, Attempt, Character, Limit, Method, Response, Used};
use crate::ledger::Stages;
use crate::newton::{Failure, Options, Tolerances};
use crate::op::undetermined;
use crate::reduced::Point;
use crate::rounding::SAME;
use crate::sparse::Complex;
use crate::system::{System, Work};

const EXPLICIT: &str = "dop853";
const SMOOTH: &str = "radau";
const GENTLE: &str = "gear";
const SHORT: &str = "esdirk";
const OTHERS: [&str; 5] = [SMOOTH, SHORT, "trbdf2", "trap", GENTLE];

/// Below this tolerance order 13 is cheaper than order 4 whatever turns, and steps of orders below that come near to rounding.
const TIGHT: f64 = 5e-7;
/// Rule 1. The work of a stage grows with the cube of a dense block's size; that of an implicit one hardly grows with it.
const SMALL: usize = 400;
const BLOCK: usize = 60;
const LOOPS: usize = 6;
/// Rule 3: a stage of order 8 spans a third of what its step may follow, ten of which make the shortest time.
const FAST: f64 = 30.0;
const LASTING: f64 = 2000.0;
/// Rule 4, of h |lambda| over the bound of stability: near 1 stability is what limits.
const LIMIT: f64 = 0.9;
/// Two steps may be limited by chance, on their way to a longer one.
const STIFF: u32 = 6;
/// More than a method has.
const FORMULAS: usize = 100;

/// Rule 1: is the explicit form worth making?
pub fn reduces(sys: &System, o: &Options) -> bool {
    o.fixed_step.is_none() && never_explicit(sys).is_none() && sys.n <= SMALL
}

/// Rule 1: what no explicit form is asked about.
fn never_explicit(sys: &System) -> Option<&'static str> {
    match () {
        () if sys.devices() > 0 => Some("devices"),
        () if sys.is_exponential() && !mechanical(sys) => Some("exponentials"),
        () if sys.pure_linear => Some("linear equations"),
        () => None,
    }
}

/// Rule 1: is the run explicit, or why not?
fn explicit(sys: &System) -> Result<&'static str, String> {
    match never_explicit(sys).map_or_else(|| sys.reduced(), Err) {
        Ok(r) if r.largest_block() > BLOCK => Err("large dense blocks".into()),
        Ok(r) if r.constraints() > LOOPS => Err("several closed loops".into()),
        Ok(r) if r.iterates() => Err("stages that want iterations".into()),
        Ok(_) => Ok("nothing stiff"),
        Err(why) => Err(why.into()),
    }
}

/// Rule 2.
fn implicit(sys: &System, o: &Options) -> &'static str {
    let thrown_back = !sys.flags.is_empty() || mechanical(sys) || sys.has_coils();
    let turns = sys.devices() > 0 || (sys.is_exponential() && !thrown_back);
    let all = o.accounts || sys.flags.is_empty() || o.shown.is_empty();
    let slopes = || undetermined(sys).iter().zip(0..).any(|(&of_slopes, k)| of_slopes && (all || o.shown.contains(&k)));
    match (turns, thrown_back) {
        _ if o.reltol < TIGHT => SMOOTH,
        (false, _) if sys.pure_linear && fills(sys, o) => SHORT,
        (false, _) => SMOOTH,
        (true, false) => GENTLE,
        (true, true) if !mechanical(sys) && slopes() => GENTLE,
        (true, true) => SHORT,
    }
}

fn mechanical(sys: &System) -> bool {
    sys.unknowns.iter().any(|u| u.kind.mechanical())
}

pub struct Auto<'a> {
    sys: &'a System,
    o: Options,
    methods: Vec<(&'static str, Box<dyn Method + 'a>)>, // made when first needed
    now: usize,
    implicit: &'static str,
    begun: bool,
    point: Option<Point>, // where eigenvalues are looked for
    feature: f64,         // shortest time that sources and print grid speak of
    t: f64,
    x: Vec<f64>,              // the present point, where an attempt may change the method
    tried: Vec<&'static str>, // methods that gave up at it
    longest: f64,             // attempt from it
    refused: u32,             // attempts from it that gave nothing
    anew: bool,               // nothing has been accepted since the last restart
    reach: f64,               // longest step since the last restart
    limited: u32,             // explicit steps in a row that stability limited
    steps: u32,               // since the last change
    used: Vec<Used>,
}

impl<'a> Auto<'a> {
    pub fn new(sys: &'a System, o: &Options) -> Result<Auto<'a>, Failure> {
        let (chosen, implicit) = (explicit(sys), implicit(sys, o));
        let name = if chosen.is_ok() { EXPLICIT } else { implicit };
        let why = chosen.clone().map_or_else(|why| why, str::to_string);
        Ok(Auto {
            sys,
            o: o.clone(),
            methods: vec![(name, make(sys, o, name)?)],
            now: 0,
            implicit,
            begun: false,
            point: None,
            feature: 0.0,
            t: 0.0,
            x: vec![0.0; sys.n],
            tried: Vec::new(),
            longest: 0.0,
            refused: 0,
            anew: true,
            reach: 0.0,
            limited: 0,
            steps: 0,
            used: vec![Used { t: 0.0, method: name.into(), why }],
        })
    }

    fn inner(&self) -> &(dyn Method + 'a) {
        &*self.methods[self.now].1
    }

    fn inner_mut(&mut self) -> &mut (dyn Method + 'a) {
        &mut *self.methods[self.now].1
    }

    fn name(&self) -> &'static str {
        self.methods[self.now].0
    }

    fn explicitly(&self) -> bool {
        self.name() == EXPLICIT
    }

    /// Another method takes over at the present point.
    fn switch(&mut self, w: &mut Work, name: &'static str) -> Result<(), Failure> {
        self.now = match self.methods.iter().position(|m| m.0 == name) {
            Some(known) => known,
            None => {
                self.methods.push((name, make(self.sys, &self.o, name)?));
                self.methods.len() - 1
            }
        };
        (self.limited, self.refused, self.steps, self.reach) = (0, 0, 0, 0.0);
        self.methods[self.now].1.restart(self.sys, w, self.t, &self.x);
        Ok(())
    }

    fn tell(&mut self, why: &str) {
        let method = self.name().into();
        if self.used.last().is_some_and(|u| u.t == self.t) {
            self.used.pop();
        }
        if self.used.last().is_none_or(|u| u.method != method) {
            self.used.push(Used { t: self.t, method, why: why.to_string() });
        }
    }

    /// Rule 4, one way.
    fn go_implicit(&mut self, w: &mut Work, why: &str) -> Result<(), Failure> {
        self.switch(w, self.implicit)?;
        self.tell(why);
        Ok(())
    }

    fn look(&mut self, w: &mut Work, h: f64) -> Result<(), Failure> {
        if !std::mem::replace(&mut self.begun, true) && self.explicitly() {
            // the first step is a hundredth of it
            self.feature = 100.0 * h;
            if self.fast(w) {
                self.go_implicit(w, "stiff from the start")?;
            }
        }
        Ok(())
    }

    /// Rule 3, at the present point.
    fn fast(&mut self, w: &mut Work) -> bool {
        let Ok(reduced) = self.sys.reduced() else { return true };
        let floor = || Tolerances::new(self.sys, &self.o).atol;
        let point = self.point.get_or_insert_with(|| reduced.point(&w.flags, w.gmin, floor()));
        place(reduced, point, self.sys, w, (self.t, &self.x));
        reduced
            .fastest(point, &self.sys.waves, self.t)
            .is_none_or(|(lambda, damped)| lambda * self.feature > FAST || damped && lambda * self.o.span > LASTING)
    }

    /// Rule 4, before an attempt of length h.
    fn choose(&mut self, w: &mut Work, h: f64) -> Result<(), Failure> {
        self.look(w, h)?;
        if self.explicitly() {
            if self.limited >= STIFF {
                return self.go_implicit(w, "stability limits the explicit step");
            }
            if self.anew && self.refused > 0 && self.fast(w) {
                return self.go_implicit(w, "stiff behind an event");
            }
        }
        Ok(())
    }

    /// Why an explicit attempt is the last one.
    fn given_up(&self, result: &Attempt) -> Option<&'static str> {
        match result {
            Attempt::Stuck { why, .. } if matches!(**why, Failure::Unfit { .. }) => {
                Some("the explicit method cannot get on")
            }
            // (a run that begins at such a position has two ways to go on: an implicit step finds neither)
            _ if self.steps > 0 && self.inner().limit() == Limit::Rank => Some("a loop comes near a singular position"),
            Attempt::TooLarge { next } | Attempt::Stuck { next, .. } if *next < SAME * self.reach => {
                Some("the explicit step collapses")
            }
            _ => None,
        }
    }
}

impl Response for Auto<'_> {
    fn formula(&self) -> usize {
        self.now * FORMULAS + self.inner().formula()
    }

    fn response(&self, formula: usize, y: f64) -> Option<Complex> {
        self.methods[formula / FORMULAS].1.response(formula % FORMULAS, y)
    }

    fn drift(&self, formula: usize, times: &[f64], w: f64) -> Option<(f64, f64)> {
        self.methods[formula / FORMULAS].1.drift(formula % FORMULAS, times, w)
    }
}

impl Method for Auto<'_> {
    fn character(&self) -> &Character {
        self.inner().character()
    }

    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        self.t = t;
        self.x.copy_from_slice(x);
        self.tried.clear();
        (self.longest, self.refused, self.reach) = (0.0, 0, 0.0);
        self.anew = true;
        self.inner_mut().restart(sys, w, t, x);
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        if let Err(why) = self.choose(w, h) {
            return Attempt::Stuck { next: 0.0, why: why.into() };
        }
        self.longest = self.longest.max(h);
        let result = self.inner_mut().attempt(sys, w, h, tol);
        if self.explicitly() {
            if let Some(why) = self.given_up(&result) {
                if self.go_implicit(w, why).is_ok() {
                    return Attempt::TooLarge { next: self.longest };
                }
            }
        }
        self.refused += u32::from(!matches!(result, Attempt::Good { .. }));
        result
    }

    fn accept(&mut self, t1: f64) {
        self.inner_mut().accept(t1);
        self.reach = self.reach.max(t1 - self.t);
        self.t = t1;
        self.x.copy_from_slice(self.methods[self.now].1.candidate());
        self.tried.clear();
        (self.longest, self.refused, self.anew) = (0.0, 0, false);
        self.steps = self.steps.saturating_add(1);
        self.limited = if matches!(self.limit(), Limit::Stability(by) if by > LIMIT) { self.limited + 1 } else { 0 };
    }

    fn candidate(&self) -> &[f64] {
        self.inner().candidate()
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        self.inner().dense(t, out);
    }

    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        self.inner_mut().interior(sys, tol)
    }

    fn stages(&self) -> Stages<'_> {
        self.inner().stages()
    }

    fn begin(&mut self, sys: &System, w: &mut Work, first: f64, tol: &Tolerances) -> f64 {
        match self.look(w, first) {
            Ok(()) => self.inner_mut().begin(sys, w, first, tol),
            Err(_) => first,
        }
    }

    fn settle(&mut self, sys: &System, w: &mut Work, t: f64, h: f64, x: &mut [f64]) -> bool {
        self.inner_mut().settle(sys, w, t, h, x)
    }

    fn corner(&mut self) {
        self.inner_mut().corner();
    }

    fn limit(&self) -> Limit {
        self.inner().limit()
    }

    /// Rule 5.
    fn fallback(&mut self, w: &mut Work, x: &[f64]) -> Option<f64> {
        self.x.copy_from_slice(x);
        loop {
            let given_up = self.name();
            self.tried.push(given_up);
            let mut order = std::iter::once(self.implicit).chain(OTHERS);
            let next = order.find(|m| !self.tried.contains(m))?;
            if self.switch(w, next).is_ok() {
                self.tell(&format!("{given_up} could not get on"));
                return Some(self.longest);
            }
        }
    }

    fn used(&self) -> Vec<Used> {
        self.used.clone()
    }
}
