//! Accelerations and multipliers of closed loops, and the way back onto their constraints.
//!
//!   M z - W^T lambda + c = 0,   W z + d = 0
//!
//! Z = M^-1/2 W^T by columns, S = Z^T Z = W M^-1 W^T, S lambda = W M^-1 c - d. Where links lie on one line S loses rank: its
//! pseudo-inverse at threshold `SAME` then shares the forces. The same factors give the least change in the metric of the masses
//! that closes a gap, of positions or of speeds.
use super::dense::{dot, forward_symmetric};
use super::quick::Quick;
use super::{Block, Held, Point, Reduced, Step, Trouble};
use crate::graph::Id;
use crate::rounding::SAME;
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;

/// Corrections of positions with one factorisation.
const CLOSINGS: usize = 4;
/// Constraints so near to a loss of rank (a change point, where links lie on one line) magnify what a stage is off them: there
/// the explicit methods project stages too. That is the method applied to f(P(y)), so its order stays.
pub const NEAR: f64 = 0.1;

pub struct Saddle {
    pub(super) mass: Block,
    pub(super) momenta: Vec<Option<usize>>,  // state of each momentum
    pub(super) carried: Vec<(usize, usize)>, // states of coordinates, and the speed that each moves with ...
    pub(super) constant: Vec<f64>,           // ... at this rate (an entry of N),
    pub(super) turning: bool,                // unless it depends on where they are:
    pub(super) carried_ids: Vec<Id>,
    pub(super) carried_part: usize,
    pub(super) rows: Vec<usize>,  // multipliers
    pub(super) kinds: Vec<usize>, // of these, by their units
    pub(super) rates: bool,       // the accelerations are read
    pub(super) gaps: Tape,        // h, on its own: it is looked at where nothing else is
    pub(super) drift_part: usize, // dh/dt
    pub(super) quick: Option<Quick>,
}

impl Saddle {
    /// rhs <- W^T S^+ lambda
    fn push(&self, held: &mut Held) {
        let Some(columns) = held.columns.as_mut() else { return };
        columns.solve(&mut held.lambda);
        let k = self.mass.unknowns.len();
        held.rhs.fill(0.0);
        for (row, &l) in held.pull.chunks_exact(k).zip(&held.lambda) {
            for (r, w) in held.rhs.iter_mut().zip(row) {
                *r += w * l;
            }
        }
    }
}

impl Reduced {
    pub(super) fn saddle(&self, s: &Saddle, step: usize, p: &mut Point) -> Result<(), Trouble> {
        self.run(s.mass.part, p);
        if self.quickly(s, step, p) {
            return Ok(());
        }
        self.look(s, step, p)?;
        let outputs = self.tape.part_places(s.mass.part);
        let (k, m) = (s.mass.unknowns.len(), s.rows.len());
        let value = |i: usize| p.slots[outputs[i] as usize];
        let held = &mut p.held[step];
        let Some(columns) = held.columns.as_mut() else { return Ok(()) };
        for i in 0..k {
            held.rhs[i] = value(i);
        }
        half(&held.matrix, &held.inverse, &mut held.rhs);
        for j in 0..m {
            held.lambda[j] = dot(&columns.z[j * k..(j + 1) * k], &held.rhs) - value(k + j);
        }
        columns.solve(&mut held.lambda);
        if s.rates {
            for i in 0..k {
                held.rhs[i] = -value(i);
                for j in 0..m {
                    held.rhs[i] += held.pull[j * k + i] * held.lambda[j];
                }
            }
            s.mass.solve(held);
            for (&u, &v) in s.mass.unknowns.iter().zip(&held.rhs) {
                p.v[u] = v;
            }
        }
        for (&row, &v) in s.rows.iter().zip(&held.lambda) {
            p.v[row] = v;
        }
        Ok(())
    }

    /// The masses and the columns of Z, factored, of the last stage.
    fn look(&self, s: &Saddle, step: usize, p: &mut Point) -> Result<(), Trouble> {
        let outputs = self.tape.part_places(s.mass.part);
        let (k, m) = (s.mass.unknowns.len(), s.rows.len());
        let held = &mut p.held[step];
        held.stale = false;
        s.mass.refactor(&outputs[k + m..], &p.slots, held)?;
        let first = k + m + s.mass.varying.len();
        for (pull, &slot) in held.pull.iter_mut().zip(&outputs[first..]) {
            *pull = p.slots[slot as usize];
        }
        let Some(columns) = held.columns.as_mut() else { return Ok(()) };
        columns.z.copy_from_slice(&held.pull);
        for column in columns.z.chunks_exact_mut(k) {
            half(&held.matrix, &held.inverse, column);
        }
        columns.factor(SAME);
        Ok(())
    }

    /// The same where that stage went quickly.
    fn renew(&self, s: &Saddle, step: usize, p: &mut Point) {
        if p.held[step].stale {
            // the masses have been found sound
            let _ = self.look(s, step, p);
        }
    }

    /// Closes loops: moves the coordinates in `y` by the least change in the metric of the masses,
    ///   dq = -N M^-1 W^T S^+ h,
    /// with the factors of the last stage, which is near. Returns the largest gap |h| that it met first.
    pub fn close(&self, p: &mut Point, y: &mut [f64], rounding: f64) -> f64 {
        let mut met = 0.0_f64;
        for k in 0..self.stage_steps {
            let Step::Saddle(s) = &self.steps[k] else { continue };
            self.renew(s, k, p);
            for round in 0..CLOSINGS {
                let gap = self.gap(s, k, p, y);
                if round == 0 {
                    met = met.max(gap);
                }
                if !(gap > rounding) {
                    break;
                }
                self.correct(s, k, p, y);
            }
        }
        met
    }

    /// The same where the factors may be those of another place: loops are left as they are near a loss of rank, and where the
    /// gap does not shrink at once. A row that was off by 1e-2 beside a change point would end in another branch. At the time t,
    /// on which a driven loop hangs.
    pub fn close_gently(&self, p: &mut Point, waves: &[Wave], t: f64, y: &mut [f64], rounding: f64) {
        self.set_time(p, waves, t, false);
        for k in 0..self.stage_steps {
            let Step::Saddle(s) = &self.steps[k] else { continue };
            self.renew(s, k, p);
            if p.held[k].columns.as_ref().is_none_or(|c| c.weakest < NEAR) {
                continue;
            }
            let (mut last, mut enough) = (f64::INFINITY, rounding);
            let mut before = std::mem::take(&mut p.open);
            before.clear();
            before.extend_from_slice(y);
            for round in 0..CLOSINGS {
                let gap = self.gap(s, k, p, y);
                if !(gap > enough) {
                    break;
                }
                if round == 0 {
                    // and need be no smaller than this part of what they were, which is within the tolerance: nothing
                    // goes on from there
                    enough = rounding.max(1e-4 * gap);
                }
                // gaps that are closed from afar shrink so much at once, or are left
                if gap > 0.25 * last {
                    y.copy_from_slice(&before);
                    break;
                }
                self.correct(s, k, p, y);
                // as much less again will do
                if gap * gap <= enough * last && round > 0 {
                    break;
                }
                last = gap;
            }
            p.open = before;
        }
    }

    /// Takes the gaps in `lambda` of step k out of y, where `gap` was run last:  dq = -N M^-1 W^T S^+ h.
    fn correct(&self, s: &Saddle, k: usize, p: &mut Point, y: &mut [f64]) {
        if s.turning {
            self.run(s.carried_part, p);
        }
        let held = &mut p.held[k];
        s.push(held);
        s.mass.solve(held);
        for (i, &(state, speed)) in s.carried.iter().enumerate() {
            let rate =
                if s.turning { p.slots[self.tape.part_places(s.carried_part)[i] as usize] } else { s.constant[i] };
            y[state] -= rate * held.rhs[speed];
        }
    }

    /// How far the loop of step k is open at y, row by row into its `lambda`; the largest.
    fn gap(&self, s: &Saddle, k: usize, p: &mut Point, y: &[f64]) -> f64 {
        self.y(p).copy_from_slice(y);
        let held = &mut p.held[k];
        let inputs = Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags };
        s.gaps.run(&inputs, &mut held.slots);
        for (j, l) in held.lambda.iter_mut().enumerate() {
            *l = s.gaps.output(&held.slots, j);
        }
        largest(&held.lambda)
    }

    /// How near the constraints were to a loss of rank in the last stage: 1 is far away.
    pub fn weakest(&self, p: &Point) -> f64 {
        let columns = p.held.iter().filter_map(|h| h.columns.as_ref());
        columns.fold(1.0, |m, c| m.min(c.weakest))
    }

    /// The same for speeds, where `rates` or `solve` was run last: dp = -W^T S^+ (dh/dt). Exact in one go.
    pub fn calm(&self, p: &mut Point, y: &mut [f64]) -> f64 {
        let mut met = 0.0_f64;
        for k in 0..self.stage_steps {
            let Step::Saddle(s) = &self.steps[k] else { continue };
            self.renew(s, k, p);
            self.run(s.drift_part, p);
            let held = &mut p.held[k];
            for (l, &slot) in held.lambda.iter_mut().zip(self.tape.part_places(s.drift_part)) {
                *l = p.slots[slot as usize];
            }
            met = met.max(largest(&held.lambda));
            s.push(held);
            for (place, d) in s.momenta.iter().zip(&held.rhs) {
                if let Some(s) = *place {
                    y[s] -= d;
                }
            }
        }
        met
    }
}

impl Point {
    /// What loops are closed with will do for the next point, which is near.
    pub fn keep_factors(&mut self) {
        self.held.iter_mut().for_each(|h| h.stale = false);
    }
}

/// b <- D^-1/2 U^-T b
fn half(u: &[f64], inverse: &[f64], b: &mut [f64]) {
    forward_symmetric(u, b.len(), inverse, b);
    for (b, r) in b.iter_mut().zip(inverse) {
        *b *= r.sqrt();
    }
}

/// Largest size, INFINITY where something is not a number.
fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m: f64, v| if v.is_nan() { f64::INFINITY } else { m.max(v.abs()) })
}
