//! Laws with modes, decided together at an event (Pfeiffer and Glocker 1996).
//!
//! A law ties an effort f, an unknown of equation (1), to a flow w, which is linear in the speeds:
//!
//!   relay     f = -F where w > 0, F where w < 0, |f| <= Fs at w = 0       Coulomb friction, clutch, brake
//!   corner    0 <= g, 0 <= f, g f = 0, w = dg/dt, restitution e           rigid stop
//!   one way   0 <= w, 0 <= f, w f = 0                                     freewheel
//!   slip      a relay with F = mu f of a corner                           friction where parts touch
//!
//! Parts in space slip in two directions across each other: two relays together, f = -F w/|w| where they slide, |f| <= F at w = 0. While
//! they slide the direction is that of w, and they are asked where it has turned far from that of the last event: w goes through 0
//! there, or else its direction is noted again.
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
//! 6. Parts in space that lie on each other at more places than they need: as few carry the load as can do it without pulling, the
//!    others touch without a force. Friction there would have no bound else.
//!
//! A = W^T M^-1 W and all that circuits and closed loops add to it is read from the factors of that step, a column a law.
use crate::edges::TOGETHER;
use crate::model::{Form, Law, LawSpec, Normal, CLOSED, NOTHING, SHOWN, SIDE, SLIDES};
use crate::newton::{Newton, Tolerances};
use crate::system::{Kind, Reading, System, Work};

mod lcp;
use lcp::Bounds;

/// Thresholds of modes, in absolute tolerances of what they are about.
const WIDE: f64 = 10.0;
/// ... and in tolerances of what they are parts of: so much an iteration leaves of a speed that was as large as its largest.
const LEFT: f64 = 0.03;
const NEARBY: f64 = 3e-3;
/// A gap is closed within so many of its thresholds, and a rebound that rises less than two of them is none.
const TOUCHES: f64 = 3.0;
const REST: f64 = 2.0;
/// Events at one time, before the way out.
const MANY: u32 = 12;
/// Rounds of impacts, before all that touch are taken together without restitution.
const ROUNDS: u32 = 60;

/// Rounds until friction and the load that makes it agree to so much.
const LOADS: u32 = 50;
const AGREE: f64 = 1e-6;

/// A direction whose part along that of the last event is so large is noted no more.
const SAME: f64 = 0.75;
/// So often one may turn below its threshold, each time within a step of the last, before it is no solution.
const TURNS: u32 = 1000;

/// Friction alone stops a flow in half of that: what pulls it on is less.
const LATE: f64 = 4.0;
/// The step slightly past an event is no shorter than so many of the shortest.
const SHORTEST: f64 = 100.0;

/// The modes are asked so much of a step behind the event: at the event itself what is let go has no acceleration yet.
const AHEAD: f64 = 1e-3;
/// Rounding of charges over a short step keeps an iteration from more, and another one, linear, follows.
const SOLVED: f64 = 1e-9;
/// Steps are ten times as long, so often, where they cannot be solved.
const LONGER: i32 = 4;
/// A step in which momenta alone change takes this part of one that there is room for: what turns meanwhile is an error of the impact,
/// whatever the tolerance.
pub const INSTANT: f64 = 1e-11;

/// Of a corner's and a one way's flags, behind `CLOSED`.
const HITS: usize = 1;
const IMPULSE: usize = 2;
const LOST: usize = 3;

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
        let ahead = (AHEAD * width).max(10.0 * least);
        Short { instant: least, late: late.max(10.0 * least), ahead, step: width, near: ahead.max(TOGETHER * span) }
    }
}

/// With which acceleration parts fall back on each other, the others held by what they lie on.
struct Falls {
    look: Look,
    change: Vec<f64>, // of the flows
    at: Vec<usize>,   // those that touch
    lies: Vec<bool>,  // of them
    h: f64,
    found: Vec<Option<f64>>,
}

impl Falls {
    fn of(&mut self, law: usize) -> f64 {
        let Some(k) = law_at(&self.at, Some(law)) else { return 0.0 };
        *self.found[k].get_or_insert_with(|| {
            let most: Vec<f64> = self
                .lies
                .iter()
                .enumerate()
                .map(|(j, &lies)| if j != k && lies { f64::INFINITY } else { 0.0 })
                .collect();
            let held = lcp::solve(&self.look.a, &self.change, &Bounds::new(vec![0.0; most.len()], most));
            -held.map_or(self.change[k], |held| held.w[k]) / self.h
        })
    }
}

/// Does a rebound rise so little that it is none?
fn is_none(rebound: f64, fall: f64, gap: f64) -> bool {
    fall > 0.0 && rebound * rebound < 2.0 * fall * REST * gap
}

/// A step of implicit Euler with efforts as parameters.
struct Look {
    y: Vec<f64>,            // without them
    columns: Vec<Vec<f64>>, // dy/df of the laws in question
    a: Vec<f64>,            // their flows: w = b + A f
    b: Vec<f64>,
}

impl Look {
    fn at(&self, f: &[f64]) -> Vec<f64> {
        let mut x = self.y.clone();
        for (column, f) in self.columns.iter().zip(f) {
            x.iter_mut().zip(column).for_each(|(x, c)| *x += f * c);
        }
        x
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
                sys.put_mode(w, law.flags[CLOSED], 0.0);
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
            let sticks = law.form == Form::Relay && w.flags[law.flags[SLIDES]] == 0.0;
            // of efforts rounding is more than their threshold
            let floor = if sticks { 1e-6 * reading.stick } else { 0.0 };
            sys.flags[law.flags[0]].law == Law::Mode && roots[law.flags[0]] > floor
        })
    }

    /// The modes that follow (x, t), where the flags `fired` ask for others; x and t move on by next to nothing. Rounding may keep so
    /// short a step from converging (a flux of so much over h is no voltage): then longer ones. False where none finds values.
    #[allow(clippy::too_many_arguments)]
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
        for longer in 0..=LONGER {
            let short = short.longer(10f64.powi(longer));
            if self.attempt(sys, w, x, t, short, fired, tol) {
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

    #[allow(clippy::too_many_arguments)]
    fn attempt(
        &mut self,
        sys: &System,
        w: &mut Work,
        x: &mut [f64],
        t: &mut f64,
        short: Short,
        fired: &[usize],
        tol: &Tolerances,
    ) -> bool {
        let list = &sys.laws.list;
        let longer = 10f64.powi((self.count.saturating_sub(MANY) / MANY).min(6) as i32);
        let piles = *t - self.at < 4.0 * longer * short.near;
        let since = *t - self.at;
        (self.at, self.count) = if piles { (self.at, self.count + 1) } else { (*t, 1) };
        let (before, slopes) = sys.read_laws(w, x, *t);
        let moves = thresholds(sys, &slopes, tol);
        let gaps = gap_thresholds(sys, tol);
        put_bands(sys, w, &moves, &gaps, tol);
        seize(sys, w, &before);
        let hit = |k: usize| [Some(k), list[k].across].iter().flatten().any(|&k| fired.contains(&list[k].flags[0]));
        if !self.strike(sys, w, x, t, short, (&moves, &gaps), &hit, tol) {
            return false;
        }

        // those in question are free, the others in their modes
        let (readings, _) = sys.read_laws(w, x, *t);
        let mut asked = Vec::new();
        let touches: Vec<bool> = (0..list.len())
            .map(|k| {
                let closed = list[k].form != Form::Relay && w.flags[list[k].flags[CLOSED]] != 0.0;
                let near = list[k].form == Form::Corner && readings[k].gap <= TOUCHES * gaps[k] && faces(w, &list[k]);
                list[k].form == Form::OneWay || closed || near
            })
            .collect();
        let Some(rests) = self.rests(sys, w, (x, *t), short.ahead, &readings, &touches, (&moves, &gaps), tol) else {
            return false;
        };
        let sides: Vec<f64> = list.iter().map(|law| law.flags.get(SIDE).map_or(0.0, |&flag| w.flags[flag])).collect();
        for (k, law) in list.iter().enumerate() {
            let flow = readings[k].flow;
            if law.form != Form::Relay {
                sys.put_mode(w, law.flags[CLOSED], 0.0);
                if touches[k] && (flow <= moves[k] || rests[k]) {
                    asked.push(k);
                }
                continue;
            }
            if law.normal.is_some_and(|normal| !asked.contains(&normal.law)) {
                put_relay(sys, w, law, true, 0.0, 0.0);
                continue;
            }
            let [slid, side, seen] = [SLIDES, SIDE, SHOWN].map(|j| w.flags[law.flags[j]]);
            let (speed, to) = towards(list, &readings, k);
            // of the speed, along the direction of the last event
            let (along, real) = match law.across {
                None => (flow * side, side.abs() == 1.0),
                Some(other) => (flow * sides[k] + readings[other].flow * sides[other], seen != 0.0),
            };
            let returns = hit(k) && slid != 0.0 && real && along <= -0.5 * speed;
            if speed > moves[k] && !returns {
                let turned =
                    if law.across.is_some() { along < SAME * speed || !real } else { [side, seen] != [to, to] };
                if slid != 1.0 || turned {
                    put_relay(sys, w, law, true, to, shown(law, to, true));
                }
            } else {
                put_relay(sys, w, law, true, 0.0, 0.0);
                asked.push(k);
            }
        }
        if asked.is_empty() && self.count <= MANY {
            return true;
        }

        // what has died
        let Some(look) = self.look(sys, w, x, *t, short.instant, &asked, tol) else { return false };
        let recent = if since < short.step { since } else { 0.0 };
        let mut turns = false;
        let mut free = vec![f64::INFINITY; asked.len()];
        let stopped = loop {
            let least: Vec<f64> = free.iter().map(|f| -f).collect();
            let Some(solution) = lcp::solve(&look.a, &look.b, &Bounds::new(least, free.clone())) else { return false };
            let mut dies = true;
            for (i, &k) in asked.iter().enumerate().filter(|&(_, &k)| list[k].form == Form::Relay) {
                let stick = readings[k].stick.max(readings[k].bound);
                // (what a touch presses with is part of the solution)
                let stick = if list[k].normal.is_some() { before[k].stick.max(before[k].bound) } else { stick };
                let pair = law_at(&asked, list[k].across);
                let turned = pair.is_some() && hit(k) && towards(list, &readings, k).0 <= moves[k];
                let most = LATE * if turned { short.late.max(recent) } else { short.late } * stick;
                let effort = pair.map_or(solution.f[i].abs(), |j| solution.f[i].hypot(solution.f[j]));
                // what stops a corner that would fall back at once goes through the friction there too
                let shares = list[k].normal.is_some_and(|normal| {
                    let load = law_at(&asked, Some(normal.law)).map_or(0.0, |j| solution.f[j].abs());
                    towards(list, &readings, k).0 <= moves[k] && effort <= normal.mus.max(normal.mu) * load
                });
                let shares = shares && rests.contains(&true);
                let mut dead = || {
                    if pair.is_some() || !hit(k) || readings[k].flow * sides[k] >= 0.0 || sides[k].abs() != 1.0 {
                        return false;
                    }
                    let passed = self.passed(sys, w, (x, *t), short.ahead, &readings, (&asked, i, sides[k]), tol);
                    effort * short.instant <= LATE * passed.unwrap_or(0.0) * stick
                };
                if free[i] > 0.0 && !shares && effort * short.instant > most && !dead() {
                    (free[i], dies) = (0.0, false);
                    turns |= turned;
                    pair.into_iter().for_each(|j| free[j] = 0.0);
                }
            }
            if dies {
                break solution;
            }
        };
        self.turns = if since >= short.step { 0 } else { self.turns + u32::from(turns) };
        if self.turns > TURNS {
            return false;
        }
        self.go(sys, x, &look.at(&stopped.f));
        *t += short.instant;

        // a little later
        let (readings, _) = sys.read_laws(w, x, *t);
        let mut ahead = short.ahead * longer;
        let mut readings = readings;
        let mut jams = false;
        let (look, solution, goes) = loop {
            let Some(look) = self.look(sys, w, x, *t, ahead, &asked, tol) else { return false };
            // where an effort moves things against itself the step is longer than what is unstable there takes
            let m = asked.len();
            if ahead > SHORTEST * short.instant && (0..m).any(|i| look.a[i * m + i] < 0.0) {
                ahead *= 0.1;
                continue;
            }
            if let Some((solution, goes)) = follows(sys, w, &look, &mut readings, &asked, *t + ahead) {
                let presses = |i: &usize| list[asked[*i]].form == Form::Corner && solution.f[*i] > 0.0;
                let carry: Vec<usize> = (0..m).filter(presses).collect();
                let spare: Vec<usize> =
                    lcp::spare(&look.a, m, &carry, &solution.f).into_iter().map(|i| asked[i]).collect();
                // what presses has friction; without it any places do that are enough
                let rubs = |law: &LawSpec| law.across.is_some() && law.normal.is_some_and(|n| spare.contains(&n.law));
                if list.iter().any(rubs) {
                    asked.retain(|&k| !spare.contains(&list[k].normal.map_or(k, |normal| normal.law)));
                    continue;
                }
                break (look, solution, goes);
            }
            // whatever slides where parts touch may stop
            let slides = |k: &usize| {
                let touches = list[*k].normal.is_some_and(|normal| asked.contains(&normal.law));
                touches && !asked.contains(k)
            };
            let more: Vec<usize> = (0..list.len()).filter(slides).collect();
            if more.is_empty() {
                return false;
            }
            for &k in &more {
                put_relay(sys, w, &list[k], true, 0.0, 0.0);
                if list[k].across.is_none_or(|other| other > k) {
                    self.jammed.push((*t, k));
                }
            }
            (asked, jams) = ([asked, more].concat(), true);
        };
        let m = asked.len();
        if self.count > MANY || jams {
            self.push(sys, w, &asked, (&look, &solution.f, &solution.w), x, (*t, ahead));
            self.go(sys, x, &look.at(&solution.f));
            *t += ahead;
            if !jams {
                self.stepped.push(*t);
            }
        }
        // what lies beyond its threshold without a load would ask again and again while nothing parts it
        let lies = |i: usize, k: usize| {
            list[k].form == Form::Corner && readings[k].gap < -0.5 * gaps[k] && solution.w[i] <= moves[k]
        };
        let locks: Vec<usize> = (0..m)
            .filter(|&i| match list[asked[i]].form {
                Form::Relay => goes[i].is_none() && !solution.bound[i],
                _ => solution.f[i] > 0.0 || lies(i, asked[i]),
            })
            .collect();
        let locked = lcp::independent(&look.a, m, &locks, &|i| list[asked[i]].form != Form::Relay);
        for (i, &k) in asked.iter().enumerate() {
            let (law, f, stick) = (&list[k], solution.f[i], readings[k].stick);
            let locked = locked.contains(&i);
            if law.form != Form::Relay {
                sys.put_mode(w, law.flags[CLOSED], f64::from(u8::from(locked)));
            } else if let Some(to) = goes[i] {
                put_relay(sys, w, law, true, to, shown(law, to, true));
            } else if locked {
                put_relay(sys, w, law, false, 0.0, 0.0);
            } else {
                put_relay(sys, w, law, true, if stick > 0.0 { -f / stick } else { 0.0 }, 0.0);
            }
        }
        true
    }

    /// How long ago the flow of a relay, the i-th of those asked, went through 0, by the rate at which it slides on to that side: a flow
    /// is seen to turn once it is beyond its threshold, and what would have held it since then makes it 0.
    #[allow(clippy::too_many_arguments)]
    fn passed(
        &mut self,
        sys: &System,
        w: &mut Work,
        (x, t): (&[f64], f64),
        h: f64,
        readings: &[Reading],
        (asked, i, side): (&[usize], usize, f64),
        tol: &Tolerances,
    ) -> Option<f64> {
        let list = &sys.laws.list;
        let look = self.look(sys, w, x, t, h, asked, tol)?;
        let mut bounds = bounds(list, readings, asked);
        let at = &readings[asked[i]];
        match list[asked[i]].normal {
            Some(normal) => {
                let slides = -side * normal.mu;
                bounds.with[i] = with(asked, Some(normal), |_| 0.0).map(|(of, ..)| (of, slides, slides));
            }
            None => (bounds.lo[i], bounds.hi[i]) = (-side * at.bound, -side * at.bound),
        }
        let solution = lcp::solve(&look.a, &look.b, &bounds)?;
        let rate = (solution.w[i] - at.flow) / h;
        (rate * at.flow > 0.0).then(|| at.flow / rate)
    }

    /// Impacts, until nothing approaches.
    #[allow(clippy::too_many_arguments)]
    fn strike(
        &mut self,
        sys: &System,
        w: &mut Work,
        x: &mut [f64],
        t: &mut f64,
        short: Short,
        (moves, gaps): (&[f64], &[f64]),
        hit: &dyn Fn(usize) -> bool,
        tol: &Tolerances,
    ) -> bool {
        let list = &sys.laws.list;
        let mut falls: Option<Falls> = None;
        let mut rounds = 0;
        let faces: Vec<bool> = list.iter().map(|law| faces(w, law)).collect();
        for round in 0..2 * ROUNDS {
            let (readings, _) = sys.read_laws(w, x, *t);
            let near = |k: usize| match list[k].form {
                Form::Relay => false,
                Form::OneWay => true,
                Form::Corner => faces[k] && (readings[k].gap <= TOUCHES * gaps[k] || round == 0 && hit(k)),
            };
            let approaches = |k: usize| near(k) && readings[k].flow < -moves[k];
            if !(0..list.len()).any(approaches) {
                return true;
            }
            let together = round >= ROUNDS;
            let strikes = |k: usize| {
                let rests = near(k) && readings[k].flow <= moves[k] && (list[k].restitution == 0.0 || together);
                approaches(k) || rests
            };
            let struck: Vec<usize> =
                (0..list.len()).filter(|&k| strikes(list[k].normal.map_or(k, |normal| normal.law))).collect();
            for (k, law) in list.iter().enumerate() {
                match law.form {
                    Form::Relay if w.flags[law.flags[SLIDES]] == 0.0 || struck.contains(&k) => {
                        put_relay(sys, w, law, true, 0.0, 0.0);
                    }
                    Form::Relay => {}
                    _ => sys.put_mode(w, law.flags[CLOSED], 0.0),
                }
            }
            if falls.is_none() {
                let lies = |j: usize| readings[j].flow <= moves[j];
                let at = (0..list.len()).filter(|&j| near(j)).map(|j| (j, lies(j))).unzip();
                falls = self.falls(sys, w, (x, *t), short.ahead, &readings, at, tol);
            }
            let Some(falls) = &mut falls else { return false };
            let fall: Vec<f64> =
                struck.iter().map(|&k| if list[k].restitution > 0.0 { falls.of(k) } else { 0.0 }).collect();
            let m = struck.len();
            let pushes = |k: usize| if list[k].form == Form::Relay { 0.0 } else { f64::INFINITY };
            let mut bounds = Bounds::new(vec![0.0; m], struck.iter().map(|&k| pushes(k)).collect());
            for (i, &k) in struck.iter().enumerate() {
                bounds.with[i] = with(&struck, list[k].normal, |normal| normal.mu);
                bounds.pair[i] = law_at(&struck, list[k].across);
            }
            let restitution = |i: usize, k: usize| {
                let rebound = list[k].restitution * readings[k].flow.abs();
                if is_none(rebound, fall[i], gaps[k]) || together || list[k].form == Form::OneWay {
                    0.0
                } else {
                    list[k].restitution
                }
            };
            // what rebounds does so by the speed at which it came: forces have the instant to themselves
            let own = |i: usize, k: usize| list[k].form != Form::Relay && approaches(k) && restitution(i, k) > 0.0;
            let mut around: Option<(Look, Vec<f64>)> = None;
            let (look, came, press) = loop {
                let from = around.as_ref().map(|(look, f)| (look, &f[..]));
                let Some(look) = self.look_from(sys, w, (x, *t), short.instant, &struck, from, tol) else {
                    return false;
                };
                let moves = |i: usize| look.a[i * m + i].abs() > f64::MIN_POSITIVE;
                self.blocked = (0..m).find(|&i| approaches(struck[i]) && !moves(i)).map(|i| struck[i]);
                if self.blocked.is_some() {
                    return false;
                }
                let came: Vec<f64> = (struck.iter().enumerate())
                    .map(|(i, &k)| if own(i, k) { readings[k].flow } else { look.b[i] })
                    .collect();
                let Some(press) = lcp::solve(&look.a, &came, &bounds) else { return false };
                rounds += 1;
                if rounds >= LOADS || rubs_by_load(sys, w, &look.at(&press.f), *t + short.instant, &struck) {
                    break (look, came, press);
                }
                around = Some((look, press.f));
            };
            for (i, &k) in struck.iter().enumerate().filter(|&(_, &k)| list[k].form != Form::Relay) {
                bounds.lo[i] = restitution(i, k) * press.f[i];
            }
            let Some(back) = lcp::solve(&look.a, &press.w, &bounds) else { return false };
            let (f, after) = expanded(&came, &press, &back);
            self.push(sys, w, &struck, (&look, &f, &after), x, (*t, short.instant));
            for &k in struck.iter().filter(|&&k| list[k].form != Form::Relay && approaches(k)) {
                w.flags[list[k].flags[HITS]] += 1.0;
            }
            self.go(sys, x, &look.at(&f));
            *t += short.instant;
        }
        true
    }

    /// Falls of all corners from (x, t), those that lie on each other held.
    #[allow(clippy::too_many_arguments)]
    fn falls(
        &mut self,
        sys: &System,
        w: &mut Work,
        (x, t): (&[f64], f64),
        h: f64,
        readings: &[Reading],
        (at, lies): (Vec<usize>, Vec<bool>),
        tol: &Tolerances,
    ) -> Option<Falls> {
        let look = self.look(sys, w, x, t, h, &at, tol)?;
        let change = look.b.iter().zip(&at).map(|(b, &k)| b - readings[k].flow).collect();
        let found = vec![None; at.len()];
        Some(Falls { look, change, at, lies, h, found })
    }

    /// Corners that part from each other by less than a rebound that is none: what others gave them, so that they would fall back at
    /// once. Were they let go, what holds them to each other again would lift them, and so on for ever.
    #[allow(clippy::too_many_arguments)]
    fn rests(
        &mut self,
        sys: &System,
        w: &mut Work,
        (x, t): (&[f64], f64),
        h: f64,
        readings: &[Reading],
        touches: &[bool],
        (moves, gaps): (&[f64], &[f64]),
        tol: &Tolerances,
    ) -> Option<Vec<bool>> {
        let list = &sys.laws.list;
        let parts = |k: usize| list[k].form == Form::Corner && touches[k] && readings[k].flow > moves[k];
        let mut rests = vec![false; list.len()];
        if !(0..list.len()).any(parts) {
            return Some(rests);
        }
        for law in list {
            match law.form {
                Form::Relay if w.flags[law.flags[SLIDES]] == 0.0 => put_relay(sys, w, law, true, 0.0, 0.0),
                Form::Relay => {}
                _ => sys.put_mode(w, law.flags[CLOSED], 0.0),
            }
        }
        let lies = |j: usize| readings[j].flow <= moves[j];
        let at = (0..list.len()).filter(|&j| touches[j]).map(|j| (j, lies(j))).unzip();
        let mut falls = self.falls(sys, w, (x, t), h, readings, at, tol)?;
        for k in (0..list.len()).filter(|&k| parts(k)) {
            rests[k] = is_none(readings[k].flow, falls.of(k), gaps[k]);
        }
        Some(rests)
    }

    /// Books a step (t, h) from x in which the corners and freewheels among `which` gave impulses: these, and the energy that they took together, shared
    /// among those that took.
    fn push(
        &mut self,
        sys: &System,
        w: &mut Work,
        which: &[usize],
        (look, f, after): (&Look, &[f64], &[f64]),
        x: &[f64],
        (t, h): (f64, f64),
    ) {
        let list = &sys.laws.list;
        // with what rubs there
        let mut lost = vec![0.0; list.len()];
        for (i, &k) in which.iter().enumerate() {
            let of = list[k].normal.map_or(k, |normal| normal.law);
            if list[of].form != Form::Relay {
                lost[of] -= 0.5 * h * f[i] * (look.b[i] + after[i]);
            }
        }
        let whole = lost.iter().sum::<f64>().max(0.0);
        let taken = lost.iter().map(|lost| lost.max(0.0)).sum::<f64>();
        for (i, &k) in which.iter().enumerate().filter(|&(_, &k)| list[k].form != Form::Relay) {
            let share = if taken > 0.0 { lost[k].max(0.0) / taken } else { 0.0 };
            w.flags[list[k].flags[IMPULSE]] += f[i] * h;
            w.flags[list[k].flags[LOST]] += share * whole;
        }
        let mut mean = look.at(f);
        for ((mean, before), unknown) in mean.iter_mut().zip(x).zip(&sys.unknowns) {
            if unknown.kind == Kind::Speed {
                *mean = 0.5 * (*mean + before);
            }
        }
        self.jolts.push((t + h, h, mean));
    }

    /// A step of implicit Euler from x, with the efforts of `which`, whose modes are free, as parameters.
    #[allow(clippy::too_many_arguments)]
    fn look(
        &mut self,
        sys: &System,
        w: &mut Work,
        x: &[f64],
        t: f64,
        h: f64,
        which: &[usize],
        tol: &Tolerances,
    ) -> Option<Look> {
        self.look_from(sys, w, (x, t), h, which, None, tol)
    }

    /// The same with slopes at efforts that a look before has found, from there: friction by a load that the impact makes goes with its
    /// size, which bends.
    #[allow(clippy::too_many_arguments)]
    fn look_from(
        &mut self,
        sys: &System,
        w: &mut Work,
        (x, t): (&[f64], f64),
        h: f64,
        which: &[usize],
        from: Option<(&Look, &[f64])>,
        tol: &Tolerances,
    ) -> Option<Look> {
        let ports = w.ports.clone();
        sys.eval(w, x, t);
        let mut r: Vec<f64> = w.q.iter().map(|q| -q / h).collect();
        let f0 = from.map_or(vec![0.0; which.len()], |(_, f)| f.to_vec());
        which.iter().zip(&f0).for_each(|(&k, f)| r[sys.laws.list[k].row] -= f);
        let mut y = from.map_or(x.to_vec(), |(look, f)| look.at(f));
        self.newton.forget();
        let tol = &tol.at_least(SOLVED);
        let solved = (0..2).all(|_| self.newton.solve(sys, w, 1.0 / h, &r, &mut y, t + h, tol, 100).is_ok());
        w.ports = ports;
        if !solved {
            return None;
        }
        sys.stage_expand(w, &y, t + h, 1.0 / h);
        if !self.newton.hold(sys, w, 1.0 / h) {
            return None;
        }
        let columns: Vec<Vec<f64>> = which
            .iter()
            .map(|&k| {
                let mut column = vec![0.0; sys.n];
                column[sys.laws.list[k].row] = 1.0;
                self.newton.solve_held(w, &mut column);
                column
            })
            .collect();
        let (readings, slopes) = sys.read_laws(w, &y, t + h);
        let m = which.len();
        let mut a = vec![0.0; m * m];
        for (i, k) in which.iter().enumerate() {
            for &(_, unknown, slope) in slopes.iter().filter(|s| s.0 == *k) {
                (0..m).for_each(|j| a[i * m + j] += slope * columns[j][unknown]);
            }
        }
        let bent = |i: usize| (0..m).map(|j| a[i * m + j] * f0[j]).sum::<f64>();
        let b = which.iter().enumerate().map(|(i, &k)| readings[k].flow - bent(i)).collect();
        let back: Vec<f64> = f0.iter().map(|f| -f).collect();
        let look = Look { y, columns, a, b };
        Some(Look { y: look.at(&back), ..look })
    }

    /// To what a short step has found; efforts over it are none of what follows.
    fn go(&self, sys: &System, x: &mut [f64], to: &[f64]) {
        x.copy_from_slice(to);
        sys.laws.list.iter().for_each(|law| x[law.row] = 0.0);
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
        if let Some(feature) = law.feature.filter(|_| w.flags[law.flags[CLOSED]] == 0.0) {
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

/// How fast the flow of a relay is, with its other direction, and which part of that is its own.
fn towards(list: &[LawSpec], readings: &[Reading], k: usize) -> (f64, f64) {
    let flow = readings[k].flow;
    let speed = list[k].across.map_or(flow.abs(), |other| flow.hypot(readings[other].flow));
    (speed, if speed > 0.0 { flow / speed } else { 0.0 })
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

/// Efforts and flows behind the expansion `back` that follows the compression `press` of flows b: as much of it as does not raise the
/// energy.
fn expanded(b: &[f64], press: &lcp::Solution, back: &lcp::Solution) -> (Vec<f64>, Vec<f64>) {
    let change: Vec<f64> = back.w.iter().zip(&press.w).map(|(after, before)| after - before).collect();
    let both: Vec<f64> = b.iter().zip(&press.w).map(|(b, w)| b + w).collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // twice the work of press + s back
    let (none, some, square) =
        (product(&press.f, &both), product(&press.f, &change) + product(&back.f, &both), product(&back.f, &change));
    let size = none.abs() + some.abs() + square.abs();
    let part = if none + some + square <= NOTHING * size {
        1.0
    } else {
        ((-some + (some * some - 4.0 * none * square).max(0.0).sqrt()) / (2.0 * square)).clamp(0.0, 1.0)
    };
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + part * b).collect();
    (sum(&press.f, &back.f), sum(&press.w, &change))
}

/// Efforts of the laws that are asked, and which of them go and which way; None without a solution. `readings` become those at the end
/// of the step.
fn follows(
    sys: &System,
    w: &mut Work,
    look: &Look,
    readings: &mut Vec<Reading>,
    asked: &[usize],
    end: f64,
) -> Option<(lcp::Solution, Vec<Option<f64>>)> {
    for again in 0..LOADS {
        let found = bounded(look, &sys.laws.list, readings, asked)?;
        // friction by a load that depends on the friction: until both agree
        let (after, _) = sys.read_laws(w, &look.at(&found.0.f), end);
        let agree = |a: f64, b: f64| (a - b).abs() <= AGREE * a.abs().max(b.abs());
        let settled = asked
            .iter()
            .filter(|&&k| sys.laws.list[k].normal.is_none())
            .all(|&k| agree(after[k].stick, readings[k].stick) && agree(after[k].bound, readings[k].bound));
        *readings = after;
        if settled || again + 1 == LOADS {
            return Some(found);
        }
    }
    None
}

/// Do relays that slide beside those struck do so with what they are loaded with at x?
fn rubs_by_load(sys: &System, w: &mut Work, x: &[f64], t: f64, struck: &[usize]) -> bool {
    let (readings, _) = sys.read_laws(w, x, t);
    sys.laws.list.iter().zip(&readings).enumerate().all(|(k, (law, at))| {
        let slides = law.form == Form::Relay && w.flags[law.flags[SLIDES]] != 0.0 && w.flags[law.flags[SHOWN]] != 0.0;
        let own = law.normal.is_none() && law.across.is_none() && !struck.contains(&k);
        !(slides && own) || (x[law.row] + w.flags[law.flags[SIDE]] * at.bound).abs() <= AGREE * at.bound
    })
}

/// Bounds of the laws that are asked, at rest.
fn bounds(list: &[LawSpec], readings: &[Reading], asked: &[usize]) -> Bounds {
    let own = |k: usize| match list[k].form {
        Form::Relay if list[k].normal.is_some() => (0.0, 0.0),
        Form::Relay => (-readings[k].stick.max(readings[k].bound), readings[k].stick.max(readings[k].bound)),
        _ => (0.0, f64::INFINITY),
    };
    let (lo, hi): (Vec<f64>, Vec<f64>) = asked.iter().map(|&k| own(k)).unzip();
    let mut bounds = Bounds::new(lo, hi);
    for (i, &k) in asked.iter().enumerate() {
        bounds.with[i] = with(asked, list[k].normal, |normal| normal.mus.max(normal.mu));
        bounds.pair[i] = law_at(asked, list[k].across);
    }
    bounds
}

/// The same with bounds as they are known.
fn bounded(
    look: &Look,
    list: &[LawSpec],
    readings: &[Reading],
    asked: &[usize],
) -> Option<(lcp::Solution, Vec<Option<f64>>)> {
    let m = asked.len();
    let mut bounds = bounds(list, readings, asked);
    let mut goes: Vec<Option<f64>> = vec![None; m];
    loop {
        let solution = lcp::solve(&look.a, &look.b, &bounds)?;
        let size = |i: usize| look.b[i].abs() + (0..m).map(|j| (look.a[i * m + j] * solution.f[j]).abs()).sum::<f64>();
        let mut more = false;
        for (i, &k) in asked.iter().enumerate().filter(|&(_, &k)| list[k].form == Form::Relay) {
            let pair = bounds.pair[i];
            let (w, across) = (solution.w[i], pair.map_or(0.0, |j| solution.w[j]));
            let (speed, least) = (w.hypot(across), NOTHING * pair.map_or(size(i), |j| size(i).max(size(j))));
            if goes[i].is_none() && speed > least && solution.bound[i] {
                (goes[i], more) = (Some(w / speed), true);
                // with two directions it goes the way of its flow, at the edge of what it slides with
                let mu = list[k].normal.map_or(0.0, |normal| normal.mu);
                let (low, high) = if pair.is_some() { (-1.0, 1.0) } else { (-w.signum(), -w.signum()) };
                if let Some((of, ..)) = bounds.with[i] {
                    bounds.with[i] = Some((of, low * mu, high * mu));
                } else {
                    (bounds.lo[i], bounds.hi[i]) = (low * readings[k].bound, high * readings[k].bound);
                }
            } else if goes[i].is_some() && pair.is_some() && speed > 0.0 {
                goes[i] = Some(w / speed);
            }
        }
        if !more {
            return Some((solution, goes));
        }
    }
}

fn put_relay(sys: &System, w: &mut Work, law: &LawSpec, slides: bool, side: f64, shown: f64) {
    for (which, value) in [(SLIDES, f64::from(u8::from(slides))), (SIDE, side), (SHOWN, shown)] {
        sys.put_mode(w, law.flags[which], value);
    }
}

/// What of a speed is not known: tolerances, and what Newton's method leaves.
fn noise(tol: &Tolerances, i: usize) -> f64 {
    (WIDE * tol.atol[i]).max(LEFT * tol.reltol * tol.peak[i])
}

/// From which flow on a law moves: tolerances of the speeds that it is made of.
fn thresholds(sys: &System, slopes: &[(usize, usize, f64)], tol: &Tolerances) -> Vec<f64> {
    let mut found = vec![0.0_f64; sys.laws.list.len()];
    for &(k, unknown, slope) in slopes.iter().filter(|s| sys.unknowns[s.1].kind == Kind::Speed) {
        found[k] = found[k].max(slope.abs() * noise(tol, unknown));
    }
    for (k, law) in sys.laws.list.iter().enumerate() {
        found[k] = law.across.map_or(found[k], |other| found[k].max(found[other]));
    }
    found
}

/// The same of gaps.
fn gap_thresholds(sys: &System, tol: &Tolerances) -> Vec<f64> {
    let least = |unit: &str| {
        let of = |i: &usize| sys.unknowns[*i].kind == Kind::Coordinate && sys.unknowns[*i].unit == unit;
        let size = |i: usize| (WIDE * tol.atol[i]).max(NEARBY * tol.reltol * tol.peak[i]);
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
        };
        sys.put_mode_bands(w, law.flags[0], bands);
    }
}
