//! Where a machine that is let go comes to rest: `.op static`.
use super::Dc;
use crate::newton::{Failure, Tolerances};
use crate::system::{Kind, System, Work};

/// Each coordinate with the row of its momentum: the speed that its own row reads. A quaternion's four read three.
pub fn couples(sys: &System) -> Vec<(usize, usize)> {
    let of = |u: usize| sys.pattern.column(u).iter().filter(|&&r| sys.unknowns[r].kind == Kind::Coordinate);
    let speeds = (0..sys.n).filter(|&u| sys.unknowns[u].kind == Kind::Speed);
    speeds.flat_map(|u| of(u).map(move |&q| (q, u)).collect::<Vec<_>>()).collect()
}

/// How far a speed goes where a coordinate does: q' = N u, whose columns are at right angles.
pub fn way(sys: &System, w: &Work, q: usize, u: usize) -> f64 {
    let slope = |r: usize| sys.pattern.position(r, u).map_or(0.0, |at| w.gv[at]);
    let moved = sys.pattern.column(u).iter().filter(|&&r| sys.unknowns[r].kind == Kind::Coordinate);
    -slope(q) / moved.map(|&r| slope(r) * slope(r)).sum::<f64>()
}

/// Steps grow so fast, and are no longer than this part of the way gone on a slide, or of a radian.
const GROWTH: f64 = 3.0;
const SHARE: f64 = 0.3;
/// A pole is looked for at 1/2, 1/4, ... of a step from both its ends.
const NEAREST: i32 = 30;

/// Static equilibrium, approached downhill: M (q - q_last)/s^2 = force, implicit Euler on the steepest descent of the
/// potential in the metric of the masses. It comes to the rest that lies downhill from the start, not to whichever root
/// Newton's method jumps to; steps are short enough not to leap over a pole (the closed gap of a capacitor).
pub(super) fn descend(dc: &mut Dc, w: &mut Work, x: &mut [f64], tol: &Tolerances) -> Result<(), Failure> {
    let start = x.to_vec();
    let mut square = 1e-12_f64; // s^2
    let mut last = Failure::Diverged { unknown: dc.pairs.first().map_or(0, |p| p.0), row: 0 };
    let mut first = true;
    let mut refused = 0;
    // gaps that close belong to what a circuit drives
    let no_gaps = !dc.sys.unknowns.iter().any(|u| matches!(u.kind, Kind::Node | Kind::Branch));
    let mut peaks = vec![0.0_f64; dc.pairs.len()];
    for _ in 0..2000 {
        let mut trial = x.to_vec();
        let held = w.held();
        dc.lean = Some((1.0 / square, x.to_vec()));
        let solved = dc.step(w, &mut trial, tol, 12);
        dc.lean = None;
        let mut farthest = (0usize, 0.0_f64);
        let (mut moved, mut growth) = (0.0_f64, GROWTH);
        for &(q, _, _) in &dc.pairs {
            let (step, weight) = ((trial[q] - x[q]).abs(), tol.weight(q, x[q], trial[q]));
            let metres = dc.sys.unknowns[q].unit == "m";
            // nothing says what is far on a slide but the way that it has gone
            let room = |at: &[f64]| (if metres { SHARE * (at[q] - start[q]).abs() } else { SHARE }).max(weight);
            if step / room(x) > farthest.1 {
                farthest = (q, step / room(x));
            }
            growth = growth.min(0.9 * room(&trial) / step);
            moved = moved.max(step / weight);
        }
        // a force that is far larger half-way than at both ends: the step leaps over a pole
        let mut leaps = false;
        if solved.is_ok() {
            let mut force = |dc: &Dc, at: &[f64]| -> Vec<f64> {
                dc.sys.eval(w, at, 0.0);
                dc.pairs.iter().map(|&(_, u, _)| w.f[u].abs()).collect()
            };
            // of links that turn, beside the largest that there was on the way: near the rest both ends have next to none
            for ((peak, here), &(q, _, _)) in peaks.iter_mut().zip(force(dc, x)).zip(&dc.pairs) {
                let link = no_gaps && dc.sys.unknowns[q].unit != "m";
                *peak = if link { here.max(*peak) } else { here };
            }
            let there = force(dc, &trial);
            // as near to either end as the pole may be
            let shares = (1..NEAREST).map(|k| 0.5_f64.powi(k));
            for share in shares.flat_map(|s| [s, 1.0 - s]) {
                let between: Vec<f64> = x.iter().zip(&trial).map(|(a, b)| a + share * (b - a)).collect();
                let most = peaks.iter().zip(&there).map(|(peak, there)| 1.2 * peak.max(*there) + 1e-30);
                leaps |= force(dc, &between).iter().zip(most).any(|(middle, most)| !(*middle <= most));
            }
            leaps &= moved > 1.0;
        }
        match solved {
            Ok(_) if !leaps && !first && farthest.1 > 1.0 => {
                w.restore(&held);
                square *= 0.9 / farthest.1;
            }
            Ok(_) if !leaps => {
                x.copy_from_slice(&trial);
                if let Some(holding) = &mut dc.holding {
                    holding.accept(dc.sys, w, x);
                }
                if moved < 1e-3 && square > 1e6 {
                    return Ok(());
                }
                first = false;
                square *= growth;
                last = Failure::Diverged { unknown: farthest.0, row: farthest.0 };
                if x.iter().any(|v| v.abs() > 1e30) {
                    return Err(last);
                }
            }
            outcome => {
                w.restore(&held);
                if let Err(e) = outcome {
                    last = e;
                }
                square *= 0.3;
                // again and again: a pole that draws the machine in
                refused += 1;
                if refused > 40 || square < 1e-40 {
                    return Err(last);
                }
            }
        }
    }
    Err(last)
}
