//! Laws with modes, decided together at an event (Pfeiffer and Glocker 1996).
//!
//! A law ties an effort f, an unknown of equation (1), to a flow w, which is linear in the speeds:
//!
//!   relay     f = -F where w > 0, F where w < 0, |f| <= Fs at w = 0       Coulomb friction, clutch, brake
//!   corner    0 <= g, 0 <= f, g f = 0, w = dg/dt, restitution e           rigid stop
//!   one way   0 <= w, 0 <= f, w f = 0                                     freewheel
//!   slip      a relay with F = mu f of a corner                           friction where parts touch
//!   bond      w = 0, or let go f = 0, by its card's conditions            latches, what may break (bonds.rs)
//!
//! Parts in space slip in two directions, a ball joint turns in three: relays together, f = -F w/|w| where they slide, |f| <= F at
//! w = 0. While they slide the direction is that of w, and they are asked where it has turned far from that of the last event: w goes
//! through 0 there, or else its direction is noted again.
//!
//! Between events each is in a mode, which its flags tell, and equation (1) is smooth: a relay sticks (w = 0) or slides
//! (f = -s F), a corner is open (f = 0) or closed (w = 0 with g = 0). Where a mode ends:
//!
//! 1. Impact, where a gap is closed and closing. Over an instant momenta alone change: u+ - u- = A p. Poisson's law in two problems,
//!    compression (0 <= u, 0 <= p) and expansion (p >= e p of the compression), each with |p along| <= mu p of its own. Where that
//!    would raise the energy, as it may with friction at several places, the expansion is as large a part of it as does not. Contacts
//!    that approach are solved, then those that approach on account of that, and so on, as a shock wave goes through a row of balls. A
//!    rebound lower than the length tolerance is none, which ends every series of them. What they take together is shared among
//!    those that take: rigid parts do not know where it was lost.
//! 2. What has died is made exactly 0, by the least change of momenta; of relays where their friction has it done so in the time by which
//!    the event was found late. Two directions rarely meet at 0: what turns round below its threshold has had the time since the last
//!    event. (The flow of a piston is 0 at its dead centre too, and no friction stops the crank there.)
//! 3. Which modes follow is asked a little later: of a step of implicit Euler with f as parameters, w = b + A f, which is a
//!    complementarity problem. At the event itself a law that is let go has f = F and no acceleration, to rounding, and would stick
//!    again for ever. Laws that lock the same motion are redundant: one sticks, the others are held at the share of the load that
//!    the solution of least norm gives them.
//! 4. Where fs > fc those that let go pull the others: they are asked again until no more go.
//! 5. Way out, where events pile up at one time, or where no finite force keeps a touch sliding (Painleve 1895; it jams): that short
//!    step itself is taken (Moreau 1988), in which everything that touches may stop.
//!
//! 6. Parts that touch, or stand at their stops, at more places than they need: as few carry the load as can do it without pulling,
//!    the others touch without a force. Friction there would have no bound else.
//!
//! A = W^T M^-1 W and all that circuits and closed loops add to it is read from the factors of that step, a column a law.
use crate::model::{around, Form, Law, LawSpec, Normal};
use crate::newton::{Newton, Tolerances};
use crate::rounding::SAME;
use crate::system::{Kind, Reading, System, Work};

mod bonds;
mod impact;
mod lcp;
mod look;
mod next;
use look::Look;
use next::Next;

/// Thresholds of modes, in absolute tolerances of what they are about.
const WIDE: f64 = 10.0;
/// A gap is closed within so many of its thresholds.
const TOUCHES: f64 = 3.0;
/// Events at one time, before the way out.
const MANY: u32 = 12;
/// Rounds of impacts, before all that touch are taken together without restitution.
const ROUNDS: u32 = 60;

/// Rounds until friction and the load that makes it agree to so much.
const LOADS: u32 = 50;
const AGREE: f64 = 1e-6;

/// Friction alone stops a flow in half of that: what pulls it on is less.
const LATE: f64 = 4.0;

/// A step in which momenta alone change takes this part of one that there is room for: what turns meanwhile is an error of the impact,
/// whatever the tolerance.
pub const INSTANT: f64 = 1e-11;

pub struct Modes {
    newton: Newton,
    at: f64, // when events have begun to pile up, how many there are
    count: u32,
    turns: u32, // of two directions below their threshold that did not end there
    /// times at which the way out was taken
    pub stepped: Vec<f64>,
    /// laws that no finite force kept sliding, with the time
    pub jammed: Vec<(f64, usize)>,
    /// a corner that approaches and that no force can stop: its motion is given
    pub blocked: Option<usize>,
    /// steps in which impulses flowed since they were last taken from here: end, length, state with the efforts over it and the
    /// mean of the speeds before and behind it, by which impulses work
    pub jolts: Vec<(f64, f64, Vec<f64>)>,
}

/// Lengths of the short steps.
#[derive(Clone, Copy)]
pub struct Short {
    /// nearly none: over it momenta alone change
    pub instant: f64,
    /// by which an event may be found late
    pub late: f64,
    /// to where the modes are asked
    pub ahead: f64,
    /// of the integration
    pub step: f64,
    /// events that are nearer to one another pile up
    pub near: f64,
}

impl Short {
    /// With an instant so many times as long.
    fn longer(self, times: f64) -> Short {
        let instant = times * self.instant;
        Short { instant, late: self.late.max(10.0 * instant), ahead: self.ahead.max(10.0 * instant), ..self }
    }

    /// Of steps of this width in a run of this span, at a point that is found so late, from where the shortest step is `least`.
    pub fn new(width: f64, least: f64, late: f64, span: f64) -> Short {
        // the modes are asked so much of a step behind the event: at the event itself what is let go has no
        // acceleration yet
        let ahead = (1e-3 * width).max(10.0 * least);
        Short { instant: least, late: late.max(10.0 * least), ahead, step: width, near: ahead.max(SAME * span) }
    }
}

/// What holds while laws are decided at one event.
struct Event<'a> {
    sys: &'a System,
    tol: &'a Tolerances,
    short: Short,
    /// flags that asked
    fired: &'a [usize],
    /// from which flow on each law moves, and from which gap on it is open
    moves: Vec<f64>,
    gaps: Vec<f64>,
}

impl Event<'_> {
    fn list(&self) -> &[LawSpec] {
        &self.sys.laws.list
    }

    /// Did this law ask, in one of its directions?
    fn hit(&self, k: usize) -> bool {
        let list = self.list();
        around(list, k).any(|k| self.fired.contains(&list[k].flags[0]))
    }
}

/// Where the run is.
struct Point<'a> {
    w: &'a mut Work,
    x: &'a mut [f64],
    t: f64,
}

impl Point<'_> {
    fn readings(&mut self, sys: &System) -> Vec<Reading> {
        sys.read_laws(self.w, self.x, self.t).0
    }

    /// To what a step of length h has found; efforts over it are none of what follows.
    fn go(&mut self, sys: &System, to: &[f64], h: f64) {
        self.x.copy_from_slice(to);
        sys.laws.list.iter().for_each(|law| self.x[law.row] = 0.0);
        self.t += h;
    }
}

impl Modes {
    pub fn new(sys: &System) -> Option<Modes> {
        let newton = Newton::new(sys).ok().filter(|_| sys.has_laws())?;
        Some(Modes {
            newton,
            at: f64::NEG_INFINITY,
            count: 0,
            turns: 0,
            stepped: Vec::new(),
            jammed: Vec::new(),
            blocked: None,
            jolts: Vec::new(),
        })
    }

    /// Modes for the start, until they are decided: what moves slides, all else is free.
    pub fn begin(sys: &System, w: &mut Work, x: &[f64], t: f64, tol: &Tolerances) {
        let (readings, slopes) = sys.read_laws(w, x, t);
        let moves = thresholds(sys, &slopes, tol);
        for (k, law) in sys.laws.list.iter().enumerate() {
            if law.form == Form::Relay {
                let (speed, side) = towards(&sys.laws.list, &readings, k);
                let side = if speed > moves[k] { side } else { 0.0 };
                put_relay(sys, w, law, true, side, shown(law, side, speed > moves[k]));
            } else {
                sys.put_mode(w, law.closed(), if law.form == Form::Bond { readings[k].gap } else { 0.0 });
            }
        }
    }

    /// The modes that a transient from x would start with, for analyses that have none; `width`: the shortest time in which something
    /// changes. x is where it would start, behind an impact if there is one.
    pub fn settle(sys: &System, w: &mut Work, x: &mut [f64], width: f64, tol: &Tolerances) {
        let Some(mut modes) = Modes::new(sys) else { return };
        Modes::begin(sys, w, x, 0.0, tol);
        put_thresholds(sys, w, x, 0.0, tol);
        let (held, start) = (w.held(), x.to_vec());
        let short = Short::new(width, INSTANT * width, 0.0, width);
        if !modes.decide(sys, w, x, &mut 0.0, short, &[], tol) {
            w.restore(&held);
            x.copy_from_slice(&start);
        }
    }

    /// Does a law ask for another mode at (x, t), where something has jumped?
    pub fn ask(sys: &System, w: &mut Work, x: &[f64], t: f64) -> bool {
        let mut roots = vec![0.0; sys.flags.len()];
        sys.eval_all_roots(w, x, t, &mut roots);
        let (readings, _) = sys.read_laws(w, x, t);
        sys.laws.list.iter().zip(readings).any(|(law, reading)| {
            let sticks = law.form == Form::Relay && w.flags[law.slides()] == 0.0;
            // of efforts rounding is more than their threshold
            let floor = if sticks { 1e-6 * reading.stick } else { 0.0 };
            sys.flags[law.flags[0]].law == Law::Mode && roots[law.flags[0]] > floor
        })
    }

    /// The modes that follow (x, t), where the flags `fired` ask for others; x and t move on by next to nothing. Rounding may keep so
    /// short a step from converging (a flux of so much over h is no voltage): then longer ones. False where none finds values.
    pub fn decide(
        &mut self,
        sys: &System,
        w: &mut Work,
        x: &mut [f64],
        t: &mut f64,
        short: Short,
        fired: &[usize],
        tol: &Tolerances,
    ) -> bool {
        let (held, start, begun) = (w.held(), (x.to_vec(), *t), (self.at, self.count, self.turns));
        let kept = (self.stepped.len(), self.jammed.len(), self.jolts.len());
        // steps are ten times as long, so often, where they cannot be solved
        for longer in 0..=4 {
            let short = short.longer(10f64.powi(longer));
            let found = self.attempt(sys, Point { w, x, t: *t }, short, fired, tol);
            if let Some(end) = found {
                *t = end;
                release(sys, w);
                return true;
            }
            w.restore(&held);
            x.copy_from_slice(&start.0);
            (*t, (self.at, self.count, self.turns)) = (start.1, begun);
            self.stepped.truncate(kept.0);
            self.jammed.truncate(kept.1);
            self.jolts.truncate(kept.2);
            if self.blocked.is_some() {
                break;
            }
        }
        false
    }

    /// One try, with these short steps: the time at which the modes are decided.
    fn attempt(&mut self, sys: &System, mut p: Point, short: Short, fired: &[usize], tol: &Tolerances) -> Option<f64> {
        let since = p.t - self.at;
        let longer = self.pile(p.t, short.near);
        let (before, slopes) = sys.read_laws(p.w, p.x, p.t);
        let (moves, gaps) = (thresholds(sys, &slopes, tol), gap_thresholds(sys, tol));
        put_bands(sys, p.w, &moves, &gaps, tol);
        seize(sys, p.w, &before);
        let e = Event { sys, tol, short, fired, moves, gaps };
        self.bond(&e, &mut p)?;
        self.strike(&e, &mut p)?;
        let asked = self.free(&e, &mut p)?;
        if asked.which.is_empty() && self.count <= MANY {
            return Some(p.t);
        }
        self.stop(&e, &mut p, &asked, &before, since)?;
        // what moves is held by large opposite efforts at places that are nearly one, which count as one then
        let now = p.readings(sys);
        let still = asked.which.iter().all(|&k| now[k].flow.abs() <= SAME * e.moves[k]);
        let next = self.follow(&e, &mut p, asked.which, longer)?;
        if self.count > MANY || next.jams {
            self.step_out(&e, &mut p, &next);
        }
        next.put(&e, p.w, if still { SAME } else { AGREE });
        Some(p.t)
    }

    /// Counts the events that pile up at one time: how many times as far ahead the modes are asked, where there are many.
    fn pile(&mut self, t: f64, near: f64) -> f64 {
        let longer = 10f64.powi((self.count.saturating_sub(MANY) / MANY).min(6) as i32);
        let piles = t - self.at < 4.0 * longer * near;
        (self.at, self.count) = if piles { (self.at, self.count + 1) } else { (t, 1) };
        longer
    }

    /// The way out: the short step ahead itself.
    fn step_out(&mut self, e: &Event, p: &mut Point, next: &Next) {
        let end = next.look.at(&next.solution.f);
        self.push(e, p, &next.asked, (&next.look, &next.solution.f, &next.solution.w), next.ahead);
        p.go(e.sys, &end, next.ahead);
        if !next.jams {
            self.stepped.push(p.t);
        }
    }
}

/// Corners stay at the edges at which they are now, until all is decided.
fn seize(sys: &System, w: &mut Work, readings: &[Reading]) {
    for (law, at) in sys.laws.list.iter().zip(readings) {
        if let Some(feature) = law.feature {
            sys.put_mode(w, feature.flag, at.which);
        }
    }
}

/// Those that are open find their edges by themselves.
fn release(sys: &System, w: &mut Work) {
    for law in &sys.laws.list {
        if let Some(feature) = law.feature.filter(|_| w.flags[law.closed()] == 0.0) {
            sys.put_mode(w, feature.flag, 0.0);
        }
    }
}

/// Can a corner press where it is?
fn faces(w: &Work, law: &LawSpec) -> bool {
    law.feature.is_none_or(|feature| w.flags[feature.flag] != 0.0)
}

/// Where a law is among `which`.
fn law_at(which: &[usize], law: Option<usize>) -> Option<usize> {
    which.iter().position(|&k| Some(k) == law)
}

/// How fast the flow of a relay is, with its other directions, and which part of that is its own.
fn towards(list: &[LawSpec], readings: &[Reading], k: usize) -> (f64, f64) {
    let speed = around(list, k).map(|k| readings[k].flow).fold(0.0, f64::hypot);
    (speed, if speed > 0.0 { readings[k].flow / speed } else { 0.0 })
}

/// The mode of a relay as it is shown, where it slides to that side.
fn shown(law: &LawSpec, side: f64, slides: bool) -> f64 {
    if law.across.is_some() {
        f64::from(u8::from(slides))
    } else {
        side
    }
}

/// The bounds of a law's effort that go with another one of `which`, by a coefficient of friction.
fn with(which: &[usize], normal: Option<Normal>, mu: impl Fn(Normal) -> f64) -> Option<(usize, f64, f64)> {
    let normal = normal?;
    Some((law_at(which, Some(normal.law))?, -mu(normal), mu(normal)))
}

fn put_relay(sys: &System, w: &mut Work, law: &LawSpec, slides: bool, side: f64, shown: f64) {
    let slides = f64::from(u8::from(slides));
    for (flag, value) in [(law.slides(), slides), (law.side(), side), (law.shown(), shown)] {
        sys.put_mode(w, flag, value);
    }
}

/// What of a speed is not known: tolerances, and what Newton's method leaves.
fn noise(tol: &Tolerances, i: usize) -> f64 {
    // so much an iteration leaves of a speed that was as large as its largest
    (WIDE * tol.atol[i]).max(0.03 * tol.reltol * tol.peak[i])
}

/// From which flow on a law moves: tolerances of the speeds that it is made of.
fn thresholds(sys: &System, slopes: &[(usize, usize, f64)], tol: &Tolerances) -> Vec<f64> {
    let mut found = vec![0.0_f64; sys.laws.list.len()];
    for &(k, unknown, slope) in slopes.iter().filter(|s| sys.unknowns[s.1].kind == Kind::Speed) {
        found[k] = found[k].max(slope.abs() * noise(tol, unknown));
    }
    for k in 0..found.len() {
        found[k] = around(&sys.laws.list, k).map(|k| found[k]).fold(0.0, f64::max);
    }
    found
}

/// The same of gaps.
fn gap_thresholds(sys: &System, tol: &Tolerances) -> Vec<f64> {
    let least = |unit: &str| {
        let of = |i: &usize| sys.unknowns[*i].kind == Kind::Coordinate && sys.unknowns[*i].unit == unit;
        // of gaps it leaves less
        let size = |i: usize| (WIDE * tol.atol[i]).max(3e-3 * tol.reltol * tol.peak[i]);
        (0..sys.n).filter(of).map(size).reduce(f64::max)
    };
    let (length, angle) = (least("m"), least("rad"));
    let of = |law: &LawSpec| match sys.unknowns[law.row].unit.as_str() {
        "N m" => angle.or(length),
        _ => length.or(angle),
    };
    sys.laws.list.iter().map(|law| of(law).unwrap_or(0.0)).collect()
}

/// Widths of the modes' thresholds, which grow with the largest speeds.
pub fn put_thresholds(sys: &System, w: &mut Work, x: &[f64], t: f64, tol: &Tolerances) {
    let (_, slopes) = sys.read_laws(w, x, t);
    put_bands(sys, w, &thresholds(sys, &slopes, tol), &gap_thresholds(sys, tol), tol);
}

fn put_bands(sys: &System, w: &mut Work, moves: &[f64], gaps: &[f64], tol: &Tolerances) {
    for (k, law) in sys.laws.list.iter().enumerate() {
        let effort = WIDE * tol.atol[law.row];
        let bands = match law.form {
            Form::Relay => [effort, moves[k]],
            Form::Corner => [gaps[k], effort],
            Form::OneWay => [moves[k], effort],
            Form::Bond => [0.0; 2],
        };
        sys.put_mode_bands(w, law.flags[0], bands);
    }
}
