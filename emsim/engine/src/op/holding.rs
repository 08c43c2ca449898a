//! Laws with modes where a machine comes to rest (`.op static`). Downhill from the start its steps are those of a motion without
//! inertia of speed, x_0 -> x_1 -> ..; with d = w(q - q_last), the flow of a law by the way of a step, each law has
//!
//!   relay     |f| <= F,  d = 0   or   f = -F sign(d)       one way   0 <= d,  0 <= f,  d f = 0       corner   0 <= g,  0 <= f,  g f = 0
//!
//! so the machine stays where its friction can hold it, and comes to rest where it first can (the least of V + sum of F |d|).
//! What holds has the row  d + C f = 0  in the place of w = 0, which is 0 = 0 at rest: with one compliance C, far below the
//! tolerances, frictions that hold the same motion share its load equally. Modes follow from the solution of each step, until both agree.
use super::Dc;
use crate::model::Form;
use crate::newton::{Failure, Tolerances};
use crate::system::{System, Work};

/// At its largest effort what holds gives way by this part of the absolute tolerance.
const GIVES: f64 = 5e-4;
/// An effort beyond its bound by no more than this part is at it.
const WITHIN: f64 = 1e-9;
/// Rounds until modes agree, before they are changed one by one, and in all.
const TOGETHER: usize = 12;
const ROUNDS: usize = 60;

const SLIDES: usize = 0;
const SIDE: usize = 1;
const SHOWN: usize = 2;
const CLOSED: usize = 0;

/// What is known of the laws between the steps.
pub struct Holding {
    pub from: Vec<f64>,
    laws: Vec<Held>,
}

struct Held {
    slopes: Vec<(usize, usize)>, // coordinate and speed of its flow
    gives: f64,                  // C
    slid: bool,
}

/// Entries that the rows of what holds add to the pattern.
pub fn entries(sys: &System, couples: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let row = |law: usize| sys.laws.list[law].row;
    let along = |u: usize| couples.iter().find(|c| c.1 == u).map(|c| c.0);
    sys.laws.flows().filter_map(|(law, u)| Some((row(law), along(u)?))).collect()
}

impl Holding {
    /// None without laws.
    pub fn new(sys: &System, w: &mut Work, x: &[f64], couples: &[(usize, usize)], tol: &Tolerances) -> Option<Holding> {
        if !sys.has_laws() {
            return None;
        }
        let (readings, _) = sys.read_laws(w, x, 0.0);
        let mut laws: Vec<Held> = Vec::new();
        for (k, law) in sys.laws.list.iter().enumerate() {
            let of = |(_, u): (usize, usize)| couples.iter().find(|c| c.1 == u).map(|&(q, u)| (q, u));
            let slopes: Vec<(usize, usize)> = sys.laws.flows().filter(|f| f.0 == k).filter_map(of).collect();
            let least = slopes.iter().map(|&(q, _)| tol.atol[q]).fold(f64::INFINITY, f64::min);
            let unit = |row: usize| &sys.unknowns[row].unit;
            let like = sys.laws.list.iter().zip(&readings).filter(|(l, _)| unit(l.row) == unit(law.row));
            let most = like.map(|(_, at)| at.stick.max(at.bound)).fold(0.0, f64::max);
            let gives =
                if law.form == Form::Relay && most > 0.0 && least.is_finite() { GIVES * least / most } else { 0.0 };
            laws.push(Held { slopes, gives, slid: false });
            match law.form {
                Form::Relay => put_relay(sys, w, k, [0.0; 3]),
                _ => sys.put_mode(w, law.flags[CLOSED], f64::from(u8::from(readings[k].gap <= 0.0))),
            }
        }
        Some(Holding { from: x.to_vec(), laws })
    }

    /// Rows of what holds, in a matrix and a residual that have w = 0 there.
    pub fn rows(
        &self,
        sys: &System,
        w: &Work,
        x: &[f64],
        put: &mut dyn FnMut(usize, usize, f64),
        residual: &mut [f64],
    ) {
        for (k, held) in self.laws.iter().enumerate() {
            let law = &sys.laws.list[k];
            let holds = match law.form {
                Form::Relay => w.flags[law.flags[SLIDES]] == 0.0,
                Form::OneWay => w.flags[law.flags[CLOSED]] != 0.0,
                Form::Corner => false,
            };
            if !holds {
                continue;
            }
            for &(q, u) in &held.slopes {
                let slope = sys.pattern.position(law.row, u).map_or(0.0, |at| w.gv[at]);
                put(law.row, q, slope);
                residual[law.row] -= slope * (x[q] - self.from[q]);
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
            let slope = |u: usize| slopes.iter().find(|s| s.0 == k && s.1 == u).map_or(0.0, |s| s.2);
            let way: f64 = held.slopes.iter().map(|&(q, u)| slope(u) * (x[q] - self.from[q])).sum();
            let least: f64 = held.slopes.iter().map(|&(q, u)| (slope(u) * tol.atol[q]).abs()).fold(0.0, f64::max);
            let small = tol.atol[law.row];
            if law.form == Form::Relay {
                let [slides, side] = [SLIDES, SIDE].map(|j| w.flags[law.flags[j]]);
                let most = if held.slid { at.bound } else { at.stick.max(at.bound) };
                if slides == 0.0 && f.abs() > most * (1.0 + WITHIN) + small {
                    put_relay(sys, w, k, [1.0, -f.signum(), -f.signum()]);
                    turned = true;
                } else if slides != 0.0 && way * side < -least {
                    put_relay(sys, w, k, [0.0; 3]);
                    turned = true;
                }
                continue;
            }
            let open = w.flags[law.flags[CLOSED]] == 0.0;
            let wrong = match law.form {
                Form::Corner => at.gap < -1e-3 * least,
                _ => way < -least,
            };
            if open && wrong || !open && f < -small {
                sys.put_mode(w, law.flags[CLOSED], f64::from(u8::from(open)));
                turned = true;
            }
        }
        turned
    }

    /// A step has been made, to x: what has slid does so at less than what it held.
    pub fn accept(&mut self, sys: &System, w: &mut Work, x: &[f64]) {
        for (held, law) in self.laws.iter_mut().zip(&sys.laws.list) {
            let moved = held.slopes.iter().any(|&(q, _)| x[q] != self.from[q]);
            held.slid |= law.form == Form::Relay && moved && w.flags[law.flags[SLIDES]] != 0.0;
        }
        self.from.copy_from_slice(x);
    }

    /// At rest nothing slides: what is at its bound is held there.
    pub fn end(&self, sys: &System, w: &mut Work) {
        let (readings, _) = sys.read_laws(w, &self.from, 0.0);
        for (law, at) in sys.laws.list.iter().zip(readings).filter(|(law, _)| law.form == Form::Relay) {
            if w.flags[law.flags[SHOWN]] != 0.0 && at.stick > 0.0 {
                sys.put_mode(w, law.flags[SIDE], w.flags[law.flags[SIDE]] * at.bound / at.stick);
            }
            sys.put_mode(w, law.flags[SHOWN], 0.0);
        }
    }
}

fn put_relay(sys: &System, w: &mut Work, k: usize, values: [f64; 3]) {
    for (which, value) in [SLIDES, SIDE, SHOWN].into_iter().zip(values) {
        sys.put_mode(w, sys.laws.list[k].flags[which], value);
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
