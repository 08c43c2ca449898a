//! Where a machine that is let go comes to rest: `.op static`.
use super::Dc;
use crate::newton::{Failure, Tolerances};
use crate::rounding::SUMMED;
use crate::system::{Kind, System, Work};
use std::f64::consts::PI;

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
const SHARE: f64 = 0.3;
/// A force without a pole near is a polynomial of this degree along the step: through Chebyshev's points its coefficients fall as
/// r^-k, r + 1/r = 2 + 4 d for the nearest pole, at d of the step beyond an end (Trefethen, Approximation Theory, 8.1). Tails of a
/// thousandth are poles within a twentieth, and none where stiff links turn: the line between two places stretches them.
const DEGREE: usize = 16;

/// To what the force of each momentum is known, with the slopes that x was solved by: what the last digits of x make of it. Places
/// add up, so each is known to the rounding of the largest; an angle, which enters by its sine, to that of 1.
fn rounding(dc: &Dc, w: &Work, x: &[f64]) -> Vec<f64> {
    let (sys, mut sums) = (dc.sys, vec![1e-30; x.len()]);
    let metres = |q: usize| sys.unknowns[q].unit == "m";
    let largest = dc.pairs.iter().filter(|p| metres(p.0)).fold(0.0_f64, |most, p| most.max(x[p.0].abs()));
    let mut sizes: Vec<f64> = x.iter().map(|x| x.abs()).collect();
    dc.pairs.iter().for_each(|&(q, _, _)| sizes[q] = if metres(q) { largest } else { sizes[q].max(1.0) });
    for (c, size) in sizes.iter().enumerate() {
        for k in sys.pattern.colptr[c]..sys.pattern.colptr[c + 1] {
            sums[sys.pattern.rowidx[k]] += SUMMED * w.gv[k].abs() * size;
        }
    }
    dc.pairs.iter().map(|&(_, u, _)| sums[u]).collect()
}

/// Whether the step from x to `trial` leaps over a pole: a force, of all momenta, that is far larger half-way than at both ends,
/// and is no polynomial between them.
fn leaps(dc: &Dc, w: &mut Work, x: &[f64], trial: &[f64]) -> bool {
    let known = rounding(dc, w, trial);
    let mut force = |share: f64| -> Vec<f64> {
        let between: Vec<f64> = x.iter().zip(trial).map(|(a, b)| a + share * (b - a)).collect();
        dc.sys.eval(w, &between, 0.0);
        dc.pairs.iter().map(|&(_, u, _)| w.f[u]).collect()
    };
    let (here, there) = (force(0.0), force(1.0));
    // as near to either end as the pole may be
    // a pole is looked for at 1/2, 1/4, ... of a step from both its ends
    let shares = (1..30).map(|k| 0.5_f64.powi(k));
    let mut suspects = vec![false; here.len()];
    for share in shares.flat_map(|s| [s, 1.0 - s]) {
        for (i, middle) in force(share).iter().enumerate() {
            let most = 1.2 * here[i].abs().max(there[i].abs()) + known[i];
            suspects[i] |= !(middle.abs() <= most);
        }
    }
    if !suspects.contains(&true) {
        return false;
    }
    let angle = |j: usize| PI * j as f64 / DEGREE as f64;
    let along: Vec<Vec<f64>> = (0..=DEGREE).map(|j| force(0.5 - 0.5 * angle(j).cos())).collect();
    let ends = |j: usize| if j % DEGREE == 0 { 0.5 } else { 1.0 };
    (0..here.len()).filter(|&i| suspects[i]).any(|i| {
        let most = along.iter().fold(0.0_f64, |most, f| most.max(f[i].abs()));
        (DEGREE - 1..=DEGREE).any(|k| {
            let sum: f64 = (0..=DEGREE).map(|j| ends(j) * along[j][i] * (angle(j) * k as f64).cos()).sum();
            !(2.0 / DEGREE as f64 * sum.abs() <= 1e-3 * most + known[i])
        })
    })
}

/// Static equilibrium, approached downhill: M (q - q_last)/s^2 = force, implicit Euler on the steepest descent of the
/// potential in the metric of the masses. It comes to the rest that lies downhill from the start, not to whichever root
/// Newton's method jumps to; steps are short enough not to leap over a pole (the closed gap of a capacitor).
pub(super) fn descend(dc: &mut Dc, w: &mut Work, x: &mut [f64], tol: &Tolerances) -> Result<(), Failure> {
    let start = x.to_vec();
    let mut square = 1e-12_f64; // s^2
    let mut last = Failure::Diverged { unknown: dc.pairs.first().map_or(0, |p| p.0), row: 0 };
    let mut first = true;
    let mut gone = vec![0.0_f64; x.len()];
    let mut refused = 0;
    for _ in 0..2000 {
        let mut trial = x.to_vec();
        let held = w.held();
        dc.lean = Some((1.0 / square, x.to_vec()));
        let solved = dc.step(w, &mut trial, tol, 12);
        dc.lean = None;
        let mut farthest = (0usize, 0.0_f64);
        // steps grow so fast, and are no longer than this part of the way gone on a slide, or of a radian
        let (mut moved, mut growth) = (0.0_f64, 3.0_f64);
        for &(q, _, _) in &dc.pairs {
            let (step, weight) = ((trial[q] - x[q]).abs(), tol.weight(q, x[q], trial[q]));
            let metres = dc.sys.unknowns[q].unit == "m";
            // nothing says what is far on a slide but the way that it has gone, also where it comes back to its start
            let way = |at: &[f64]| gone[q].max((at[q] - start[q]).abs());
            let room = |at: &[f64]| (if metres { SHARE * way(at) } else { SHARE }).max(weight);
            if step / room(x) > farthest.1 {
                farthest = (q, step / room(x));
            }
            growth = growth.min(0.9 * room(&trial) / step);
            moved = moved.max(step / weight);
        }
        let leaps = solved.is_ok() && moved > 1.0 && leaps(dc, w, x, &trial);
        match solved {
            Ok(_) if !leaps && !first && farthest.1 > 1.0 => {
                w.restore(&held);
                square *= 0.9 / farthest.1;
            }
            Ok(_) if !leaps => {
                x.copy_from_slice(&trial);
                gone.iter_mut()
                    .zip(x.iter().zip(&start))
                    .for_each(|(way, (x, start))| *way = way.max((x - start).abs()));
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
                refused += i32::from(leaps);
                if refused > 40 || square < 1e-40 {
                    return Err(last);
                }
            }
        }
    }
    Err(last)
}
