//! Laws with modes where a machine comes to rest (`.op static`). Downhill from the start its steps are those of a motion without
//! inertia of speed, x_0 -> x_1 -> ..; with d = w(q - q_last), the flow of a law by the way of a step, each law has
//!
//!   relay     |f| <= F,  d = 0   or   f = -F sign(d)       one way   0 <= d,  0 <= f,  d f = 0       corner   0 <= g,  0 <= f,  g f = 0
//!
//! so the machine stays where its friction can hold it, and comes to rest where it first can (the least of V + sum of F |d|).
//! What holds has the row  d + C f = 0  in the place of w = 0, which is 0 = 0 at rest: with one compliance C, far below the
//! tolerances, frictions that hold the same motion share its load equally. Modes follow from the solution of each step, until both agree.
//! A row of speeds, a(q) u = 0, of what rolls or cuts, has the row  a d = 0  there: it has come where it could come so.
//! Friction with several directions holds up to |f| = F, and slides with f = -F d/|d|.
use super::{rest::way, Dc};
use crate::model::{around, Form, Kind, LawSpec};
use crate::newton::{Failure, Tolerances};
use crate::rounding::SAME;
use crate::system::{Reading, System, Work};

/// Rounds until modes agree, before they are changed one by one, and in all.
const TOGETHER: usize = 12;
const ROUNDS: usize = 60;

/// What is known of the laws between the steps.
pub struct Holding {
    pub from: Vec<f64>,
    laws: Vec<Held>,
    rolls: Vec<(usize, usize, Vec<usize>)>, // row of speeds, a speed there, the coordinates that it moves
}

struct Held {
    slopes: Vec<(usize, usize)>, // coordinate and speed of its flow
    gives: f64,                  // C
    least: f64,                  // of the way, what is none
    slid: bool,
}

/// Rows of speeds, with each speed that they read and the coordinates that this one moves.
fn rolls(sys: &System, couples: &[(usize, usize)]) -> Vec<(usize, usize, Vec<usize>)> {
    let is = |i: usize, kind: Kind| sys.unknowns.get(i).is_some_and(|u| u.kind == kind);
    let rows = (0..sys.n).filter(|&i| is(i, Kind::Lambda) && !is(i + 1, Kind::Mu) && !sys.laws.has_row(i));
    let moves = |row: usize, of: &[(usize, usize)]| {
        let read = sys.pattern.position(row, of[0].1).is_some();
        read.then(|| (row, of[0].1, of.iter().map(|c| c.0).collect()))
    };
    rows.flat_map(|row| couples.chunk_by(|a, b| a.1 == b.1).filter_map(move |of| moves(row, of))).collect()
}

/// Entries that the rows of what holds add to the pattern.
pub fn entries(sys: &System, couples: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let rolls = rolls(sys, couples).into_iter().flat_map(|(row, _, qs)| qs.into_iter().map(move |q| (row, q)));
    let row = |law: usize| sys.laws.list[law].row;
    let along = |u: usize| couples.iter().filter(move |c| c.1 == u).map(|c| c.0);
    let all = |law: usize| around(&sys.laws.list, law);
    let laws = sys.laws.flows().flat_map(|(law, u)| all(law).flat_map(move |of| along(u).map(move |q| (row(of), q))));
    laws.chain(rolls).collect()
}

impl Holding {
    /// None without laws and rows of speeds.
    pub fn new(sys: &System, w: &mut Work, x: &[f64], couples: &[(usize, usize)], tol: &Tolerances) -> Option<Holding> {
        let rolls = rolls(sys, couples);
        if !sys.has_laws() && rolls.is_empty() {
            return None;
        }
        let (readings, rates) = sys.read_laws(w, x, 0.0);
        // what presses where parts touch is not known yet: no more than what pulls at them
        sys.eval(w, x, 0.0);
        let pulls = couples.iter().map(|&(_, u)| w.f[u].abs()).fold(0.0, f64::max);
        let mut laws: Vec<Held> = Vec::new();
        for (k, law) in sys.laws.list.iter().enumerate() {
            let of = |(_, u): (usize, usize)| couples.iter().copied().filter(move |c| c.1 == u);
            let slopes: Vec<(usize, usize)> = sys.laws.flows().filter(|f| f.0 == k).flat_map(of).collect();
            let least = slopes.iter().map(|&(q, _)| tol.atol[q]).fold(f64::INFINITY, f64::min);
            let unit = |row: usize| &sys.unknowns[row].unit;
            let like = sys.laws.list.iter().zip(&readings).filter(|(l, _)| unit(l.row) == unit(law.row));
            let most = |l: &LawSpec, at: &Reading| if l.normal.is_some() { pulls } else { at.stick.max(at.bound) };
            let most = like.map(|(l, at)| most(l, at)).fold(0.0, f64::max);
            let gives =
                // at its largest effort what holds gives way by this part of the absolute tolerance
                if law.form == Form::Relay && most > 0.0 && least.is_finite() { 5e-4 * least / most } else { 0.0 };
            let rate = |u: usize| rates.iter().find(|s| s.0 == k && s.1 == u).map_or(0.0, |s| s.2);
            let none = slopes.iter().map(|&(q, u)| (rate(u) * tol.atol[q]).abs()).fold(0.0, f64::max);
            laws.push(Held { slopes, gives, least: none, slid: false });
            match law.form {
                Form::Relay => put_relay(sys, w, k, [0.0; 3]),
                Form::Bond => sys.put_mode(w, law.closed(), readings[k].gap),
                _ => sys.put_mode(w, law.closed(), f64::from(u8::from(readings[k].gap <= 0.0))),
            }
        }
        Some(Holding { from: x.to_vec(), laws, rolls })
    }

    /// Rows of what holds, in a matrix and a residual that have w = 0 there.
    pub fn rows(
        &self,
        sys: &System,
        w: &mut Work,
        x: &[f64],
        put: &mut dyn FnMut(usize, usize, f64),
        residual: &mut [f64],
    ) {
        let discs = sys.laws.list.iter().any(|law| law.across.is_some());
        let (readings, slopes) = if discs { sys.read_laws(w, x, 0.0) } else { Default::default() };
        let slope = |row: usize, col: usize| sys.pattern.position(row, col).map_or(0.0, |at| w.gv[at]);
        for (row, u, moved) in &self.rolls {
            let chord = moved.iter().map(|&q| (x[q] - self.from[q]).powi(2)).sum::<f64>().sqrt();
            // a quaternion goes along an arc of half the turn, of which its projection is the sine
            let half = 2.0 * (0.5 * chord).min(1.0).asin();
            let arc = if moved.len() > 1 && half > 0.0 { half / half.sin() } else { 1.0 };
            for &q in moved {
                let along = arc * slope(*row, *u) * way(sys, w, q, *u);
                put(*row, q, along);
                residual[*row] -= along * (x[q] - self.from[q]);
            }
        }
        for (k, held) in self.laws.iter().enumerate() {
            let law = &sys.laws.list[k];
            if law.across.is_some() && w.flags[law.slides()] != 0.0 {
                // against its way, not the one it had
                let share = |k: usize| w.flags[sys.laws.list[k].side()];
                let went = |k: usize| self.way(sys, w, k, x, &slopes) + held.least * share(k);
                let all: Vec<(usize, f64)> = around(&sys.laws.list, k).map(|k| (k, went(k))).collect();
                let (length, bound) = (all.iter().map(|at| at.1).fold(0.0, f64::hypot), self.bound(k, &readings[k]));
                if length > 0.0 && all.iter().any(|&(k, _)| share(k) != 0.0) {
                    let to = all[0].1 / length;
                    residual[law.row] -= bound * to - readings[k].stick * share(k);
                    for (of, went) in all {
                        let part = f64::from(u8::from(of == k)) - to * went / length;
                        for &(q, u) in &self.laws[of].slopes {
                            put(law.row, q, bound / length * part * slope_of(&slopes, of, u) * way(sys, w, q, u));
                        }
                    }
                }
                continue;
            }
            let holds = match law.form {
                Form::Relay => w.flags[law.slides()] == 0.0,
                Form::OneWay | Form::Bond => w.flags[law.closed()] != 0.0,
                Form::Corner => false,
            };
            if !holds {
                continue;
            }
            for &(q, u) in &held.slopes {
                let along = slope(law.row, u) * way(sys, w, q, u);
                put(law.row, q, along);
                residual[law.row] -= along * (x[q] - self.from[q]);
            }
            put(law.row, law.row, held.gives);
            residual[law.row] -= held.gives * x[law.row];
        }
    }

    /// Modes that x, to where a step has led, contradicts are changed: `one` alone, or all. True where one was.
    fn turn(&self, sys: &System, w: &mut Work, x: &[f64], one: bool, tol: &Tolerances) -> bool {
        let (readings, slopes) = sys.read_laws(w, x, 0.0);
        let mut turned = false;
        for (k, held) in self.laws.iter().enumerate() {
            if one && turned {
                break;
            }
            let (law, at, f) = (&sys.laws.list[k], readings[k], x[sys.laws.list[k].row]);
            let way = self.way(sys, w, k, x, &slopes);
            let slope = |u: usize| slope_of(&slopes, k, u);
            let least: f64 = held.slopes.iter().map(|&(q, u)| (slope(u) * tol.atol[q]).abs()).fold(0.0, f64::max);
            let small = tol.atol[law.row];
            if law.form == Form::Relay {
                if around(&sys.laws.list, k).all(|other| other >= k) {
                    turned |= self.turn_relay(sys, w, k, x, &slopes, &at, [least, small]);
                }
                continue;
            }
            let open = w.flags[law.closed()] == 0.0;
            let wrong = match law.form {
                Form::Corner => at.gap < -1e-3 * least,
                _ => way < -least,
            };
            if law.opens() && (open && wrong || !open && f < -small) {
                sys.put_mode(w, law.closed(), f64::from(u8::from(open)));
                turned = true;
            }
        }
        turned
    }

    /// The same of friction, of whose directions k is the first.
    fn turn_relay(
        &self,
        sys: &System,
        w: &mut Work,
        k: usize,
        x: &[f64],
        slopes: &[(usize, usize, f64)],
        at: &Reading,
        [least, small]: [f64; 2],
    ) -> bool {
        let list = &sys.laws.list;
        let of = |value: &dyn Fn(usize) -> f64| around(list, k).map(value).collect::<Vec<f64>>();
        let (ways, shares) = (of(&|k| self.way(sys, w, k, x, slopes)), of(&|k| w.flags[list[k].side()]));
        let to: Vec<f64> = if around(list, k).all(|k| w.flags[list[k].slides()] == 0.0) {
            let efforts = of(&|k| x[list[k].row]);
            let effort = efforts.iter().copied().fold(0.0, f64::hypot);
            if effort <= self.bound(k, at) * (1.0 + SAME) + small {
                return false;
            }
            efforts.iter().map(|f| -f / effort).collect()
        } else {
            if ways.iter().zip(&shares).map(|(way, share)| way * share).sum::<f64>() < -least {
                around(list, k).for_each(|k| put_relay(sys, w, k, [0.0; 3]));
                return true;
            }
            let length = ways.iter().copied().fold(0.0, f64::hypot);
            if length <= least {
                return false;
            }
            let to: Vec<f64> = ways.iter().map(|way| way / length).collect();
            if to.iter().zip(&shares).map(|(to, share)| to - share).fold(0.0, f64::hypot) <= SAME {
                return false;
            }
            to
        };
        let shown = |to: f64| if list[k].across.is_some() { 0.0 } else { to };
        around(list, k).zip(to).for_each(|(k, to)| put_relay(sys, w, k, [1.0, to, shown(to)]));
        true
    }

    /// How far a law has gone from the last point to x.
    fn way(&self, sys: &System, w: &Work, k: usize, x: &[f64], slopes: &[(usize, usize, f64)]) -> f64 {
        let went = |&(q, u): &(usize, usize)| slope_of(slopes, k, u) * way(sys, w, q, u) * (x[q] - self.from[q]);
        self.laws[k].slopes.iter().map(went).sum()
    }

    /// The most that friction holds: what has slid is let go.
    fn bound(&self, k: usize, at: &Reading) -> f64 {
        if self.laws[k].slid {
            at.bound
        } else {
            at.stick.max(at.bound)
        }
    }

    /// A step has been made, to x: what has slid does so at less than what it held.
    pub fn accept(&mut self, sys: &System, w: &mut Work, x: &[f64]) {
        for (held, law) in self.laws.iter_mut().zip(&sys.laws.list) {
            let moved = held.slopes.iter().any(|&(q, _)| x[q] != self.from[q]);
            held.slid |= law.form == Form::Relay && moved && w.flags[law.slides()] != 0.0;
        }
        self.from.copy_from_slice(x);
    }

    /// At rest nothing slides: what is at its bound is held there.
    pub fn end(&self, sys: &System, w: &mut Work) {
        let (readings, _) = sys.read_laws(w, &self.from, 0.0);
        for (law, at) in sys.laws.list.iter().zip(readings).filter(|(law, _)| law.form == Form::Relay) {
            let slides = if law.across.is_some() { law.slides() } else { law.shown() };
            if w.flags[slides] != 0.0 && at.stick > 0.0 {
                sys.put_mode(w, law.side(), w.flags[law.side()] * at.bound / at.stick);
            }
            sys.put_mode(w, law.shown(), 0.0);
        }
    }
}

/// The slope of a law's flow along a speed.
fn slope_of(slopes: &[(usize, usize, f64)], law: usize, speed: usize) -> f64 {
    slopes.iter().find(|s| s.0 == law && s.1 == speed).map_or(0.0, |s| s.2)
}

fn put_relay(sys: &System, w: &mut Work, k: usize, values: [f64; 3]) {
    let law = &sys.laws.list[k];
    for (flag, value) in [law.slides(), law.side(), law.shown()].into_iter().zip(values) {
        sys.put_mode(w, flag, value);
    }
}

impl Dc<'_> {
    /// Newton's method from `x`, and modes that agree with what it finds.
    pub(super) fn step(
        &mut self,
        w: &mut Work,
        x: &mut [f64],
        tol: &Tolerances,
        most: usize,
    ) -> Result<usize, Failure> {
        if self.holding.is_none() {
            return self.newton(w, x, 0.0, None, tol, most);
        }
        let start = x.to_vec();
        for round in 0..ROUNDS {
            x.copy_from_slice(&start);
            let found = self.newton(w, x, 0.0, None, tol, most)?;
            let turned = self.holding.as_ref().is_some_and(|h| h.turn(self.sys, w, x, round >= TOGETHER, tol));
            if !turned {
                return Ok(found);
            }
        }
        let unknown = self.sys.laws.list.first().map_or(0, |law| law.row);
        Err(Failure::Diverged { unknown, row: unknown })
    }
}
