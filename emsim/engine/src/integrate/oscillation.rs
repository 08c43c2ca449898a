//! Is a stretch of samples an oscillation, and which?
//!
//! It oscillates where its second differences, or else what it is above its middle, change sign at regular times; these
//! give w. Least squares over all samples
//!
//!   x = a + b tau + (c + c' tau) cos w(t - tm) + (s + s' tau) sin w(t - tm),    tau = -1..1 over the stretch,
//!
//! then give the amplitude A = hypot(c, s) at its middle, what it falls by (from (c c' + s s')/A^2), the rest of w (from
//! (c s' - s c')/A^2), and what is left over: where that is much, it is not one oscillation.

use crate::tape::sin_cos;
use crate::twice::twice;

/// Half-periods between crossings may differ by so much.
const REGULAR: f64 = 1.5;
/// Crossings, and samples between them, that it takes.
const CROSSINGS: u32 = 4;
const SAMPLES: f64 = 2.5;
/// Mean square that may be left over, as a part of the oscillation's.
const LEFT: f64 = 0.1;
const N: usize = 6;

pub struct Oscillation {
    pub w: f64,
    pub amplitude: f64,
    /// ln of the amplitudes' ratio between the halves
    pub fell: f64,
}

/// Weights (below, above) of second differences on unequal times, for all but the ends.
pub fn weights(t: &[f64], out: &mut [(f64, f64)]) {
    for k in 1..t.len() - 1 {
        let (a, b, c) = (t[k] - t[k - 1], t[k + 1] - t[k], t[k + 1] - t[k - 1]);
        out[k] = (2.0 / (a * c), 2.0 / (b * c));
    }
}

pub fn oscillation(t: &[f64], weights: &[(f64, f64)], x: &[f64]) -> Option<Oscillation> {
    let w = frequency(t, weights, x)?;
    fit(t, x, w)
}

fn frequency(t: &[f64], weights: &[(f64, f64)], x: &[f64]) -> Option<f64> {
    let curved = |j: usize| {
        let (a, b) = weights[j];
        b * (x[j + 1] - x[j]) - a * (x[j] - x[j - 1])
    };
    // on unequal steps it is the second derivative of the mean of the three times
    let centre = |j: usize| (t[j - 1] + t[j] + t[j + 1]) / 3.0;
    turns((1..t.len() - 1).map(|j| (centre(j), curved(j)))).or_else(|| {
        // few and very unequal steps leave more error than curvature: crossings of the middle between the extremes
        let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
        turns(t.iter().zip(x).map(|(&t, &x)| (t, x - 0.5 * (low + high))))
    })
}

/// The frequency of regular changes of sign.
fn turns(mut points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (mut first, mut last, mut n) = ((0.0, 0), (0.0, 0), 0u32);
    let (mut shortest, mut longest) = (f64::MAX, 0.0_f64);
    let mut before = points.next()?;
    for (j, now) in points.enumerate() {
        if (now.1 > 0.0) != (before.1 > 0.0) {
            let at = before.0 + (now.0 - before.0) * before.1 / (before.1 - now.1);
            if n == 0 {
                first = (at, j);
            } else {
                let gap: f64 = at - last.0;
                shortest = shortest.min(gap);
                longest = longest.max(gap);
                if longest > REGULAR * shortest {
                    return None;
                }
            }
            last = (at, j);
            n += 1;
        }
        before = now;
    }
    if n < CROSSINGS {
        return None;
    }
    let samples = (last.1 - first.1) as f64 / f64::from(n - 1);
    (samples >= SAMPLES).then(|| std::f64::consts::PI * f64::from(n - 1) / (last.0 - first.0))
}

fn fit(t: &[f64], x: &[f64], w: f64) -> Option<Oscillation> {
    let (start, stop) = (t[0], t[t.len() - 1]);
    let (middle, half) = (0.5 * (start + stop), 0.5 * (stop - start));
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let row = |(&t, &x): (&f64, &f64)| {
        let (tau, (s, c)) = ((t - middle) / half, sin_cos(w * (t - middle)));
        [1.0, tau, c, s, tau * c, tau * s, x - mean, 0.0]
    };
    let rows: Vec<Row> = t.iter().zip(x).map(row).collect();
    let p = solve(normal(&rows))?;
    let (mut left, mut whole) = (0.0, 0.0);
    for b in &rows {
        let wave: f64 = (2..N).map(|i| p[i] * b[i]).sum();
        left += (b[N] - p[0] - p[1] * b[1] - wave).powi(2);
        whole += wave * wave;
    }
    let (c, s, dc, ds) = (p[2], p[3], p[4], p[5]);
    let square = c * c + s * s;
    let right = left <= LEFT * whole && square > 0.0;
    right.then(|| Oscillation {
        w: w - (c * ds - s * dc) / square / half,
        amplitude: square.sqrt(),
        fell: -(c * dc + s * ds) / square,
    })
}

/// The basis at a sample and what is to be fitted there, in two whole vectors.
type Row = [f64; 8];

twice! {
    /// Normal equations, the right side behind them.
    fn normal(rows: &[Row]) -> [Row; N] {
        let mut m = [[0.0; 8]; N];
        for b in rows {
            for (m, by) in m.iter_mut().zip(b) {
                for (m, b) in m.iter_mut().zip(b) {
                    *m += by * b;
                }
            }
        }
        m
    }
}

/// Elimination of a positive definite system; None where it is not.
fn solve(mut m: [Row; N]) -> Option<[f64; N]> {
    for k in 0..N {
        let pivot = m[k];
        if pivot[k].is_nan() || pivot[k] <= 1e-9 * m[0][0] {
            return None;
        }
        for row in m.iter_mut().skip(k + 1) {
            let f = row[k] / pivot[k];
            for j in k..=N {
                row[j] -= f * pivot[j];
            }
        }
    }
    let mut p = [0.0; N];
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| m[k][j] * p[j]).sum();
        p[k] = (m[k][N] - known) / m[k][k];
    }
    Some(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(x: impl Fn(f64) -> f64) -> Option<Oscillation> {
        // unequal steps
        let t: Vec<f64> = (0..96).map(|k| 0.1 * (f64::from(k) + 0.3 * f64::from(k % 3))).collect();
        let x: Vec<f64> = t.iter().map(|&t| x(t)).collect();
        let mut w = vec![(0.0, 0.0); 96];
        weights(&t, &mut w);
        oscillation(&t, &w, &x)
    }

    #[test]
    fn finds_what_is_there() {
        for (w, decay) in [(1.2, 0.0), (3.0, 0.01), (6.0, -0.02)] {
            let seen = look(|t| 5.0 - 0.1 * t + 2.0 * (-decay * t).exp() * (w * t + 0.7).cos()).unwrap();
            let (middle, half) = (4.78, 4.78);
            assert!((seen.w / w - 1.0).abs() < 2e-3, "{} {w}", seen.w);
            assert!((seen.amplitude / (2.0 * (-decay * middle).exp()) - 1.0).abs() < 5e-3, "{}", seen.amplitude);
            assert!((seen.fell - decay * half).abs() < 5e-3, "{} {}", seen.fell, decay * half);
        }
    }

    #[test]
    fn leaves_the_rest_alone() {
        assert!(look(|t| (-t).exp()).is_none());
        assert!(look(|t| t * t).is_none());
        assert!(look(|t| (1.1 * t * t).sin()).is_none(), "a chirp");
        assert!(look(|t| if t < 5.0 { 0.0 } else { (3.0 * t).sin() }).is_none(), "half of it still");
    }
}
