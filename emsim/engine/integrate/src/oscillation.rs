//! Is a stretch of samples an oscillation, and which?
//!
//! It oscillates where its second differences, or else what it is above its middle, change sign at regular times; these
//! give w. Least squares over all samples
//!
//!   x = a + b tau + (c + c' tau) cos w(t - tm) + (s + s' tau) sin w(t - tm),    tau = -1..1 over the stretch,
//!
//! then give the amplitude A = hypot(c, s) at its middle, what it falls by (from (c c' + s s')/A^2), the rest of w (from
//! (c s' - s c')/A^2), and what is left over: where that is much, it is not one oscillation. Unknowns of the same stretch that oscillate
//! together are fitted by the same cosines and sines.

use crate::multiversion::{by_lanes, each, multiversion, side_by_side, Lanes, LANES};
use crate::tape::sin_cos;

/// Half-periods between crossings may differ by so much.
const REGULAR: f64 = 1.5;
/// Crossings, and samples between them, that it takes.
const CROSSINGS: u32 = 4;
const SAMPLES: f64 = 2.5;
/// Mean square that may be left over, as a part of the oscillation's.
const LEFT: f64 = 0.1;
/// Oscillations that part by no more than this phase [rad] to the ends of the stretch are fitted by one w; what is left
/// of it is to first order in the fit.
const TOGETHER: f64 = 0.03;
const N: usize = 6;

pub struct Oscillation {
    pub w: f64,
    pub amplitude: f64,
    /// ln of the amplitudes' ratio between the halves
    pub fell: f64,
}

/// A stretch of times, and what its samples are looked at by.
#[derive(Default)]
pub struct Stretch {
    t: Vec<f64>,
    tau: Vec<f64>,
    middle: f64,
    half: f64,
    // of second differences on unequal times, for all but the ends
    below: Vec<f64>,
    above: Vec<f64>,
    centre: Vec<f64>, // where each stands: it is the second derivative of the mean of the three times
    curved: Vec<f64>,
    waves: Vec<Waves>,
}

/// cos, sin, tau cos, tau sin of one w at all times, and the factors of the normal equations, 1 and tau before them.
struct Waves {
    w: f64,
    columns: [Vec<f64>; 4],
    factors: [[f64; N]; N],
}

impl Stretch {
    /// `t`: as many as go side by side, or more.
    pub fn begin(&mut self, t: &[f64]) {
        let (start, stop) = (t[0], t[t.len() - 1]);
        (self.middle, self.half) = (0.5 * (start + stop), 0.5 * (stop - start));
        self.t.clear();
        self.t.extend_from_slice(t);
        self.tau.clear();
        self.tau.extend(t.iter().map(|t| (t - self.middle) / self.half));
        for v in [&mut self.below, &mut self.above, &mut self.centre] {
            v.clear();
        }
        for k in 1..t.len() - 1 {
            let (a, b, c) = (t[k] - t[k - 1], t[k + 1] - t[k], t[k + 1] - t[k - 1]);
            self.below.push(2.0 / (a * c));
            self.above.push(2.0 / (b * c));
            self.centre.push((t[k - 1] + t[k] + t[k + 1]) / 3.0);
        }
        self.waves.clear();
    }

    /// Of samples and the level half way between their extremes.
    pub fn oscillation(&mut self, x: &[f64], level: f64) -> Option<Oscillation> {
        assert!(x.len() == self.t.len());
        let w = self.frequency(x, level)?;
        let near = |b: &Waves| (b.w - w).abs() * self.half < TOGETHER;
        let k = match self.waves.iter().position(near) {
            Some(k) => k,
            None => {
                self.waves.push(Waves::new(w, &self.t, &self.tau, self.middle)?);
                self.waves.len() - 1
            }
        };
        self.fit(x, &self.waves[k])
    }

    fn frequency(&mut self, x: &[f64], level: f64) -> Option<f64> {
        self.curved.resize(self.centre.len(), 0.0);
        curvatures(&self.below, &self.above, x, &mut self.curved);
        // few and very unequal steps leave more error than curvature
        turns(&self.centre, &self.curved, 0.0).or_else(|| turns(&self.t, x, level))
    }

    fn fit(&self, x: &[f64], waves: &Waves) -> Option<Oscillation> {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let [cos, sin, tau_cos, tau_sin] = &waves.columns;
        let columns = [x, &self.tau, cos, sin, tau_cos, tau_sin];
        let p = waves.solve(moments(mean, columns));
        let (left, whole) = apart(mean, p, columns);
        let (c, s, dc, ds) = (p[2], p[3], p[4], p[5]);
        let square = c * c + s * s;
        let right = left <= LEFT * whole && square > 0.0;
        right.then(|| Oscillation {
            w: waves.w - (c * ds - s * dc) / square / self.half,
            amplitude: square.sqrt(),
            fell: -(c * dc + s * ds) / square,
        })
    }
}

/// The frequency of regular changes of the sign of x - level.
fn turns(t: &[f64], x: &[f64], level: f64) -> Option<f64> {
    let (mut first, mut last, mut n) = ((0.0, 0), (0.0, 0), 0u32);
    let (mut shortest, mut longest) = (f64::MAX, 0.0_f64);
    let mut above = x.first().is_some_and(|&x| x > level);
    for (j, pair) in x.windows(2).enumerate() {
        if (pair[1] > level) != above {
            above = !above;
            let (before, now) = (pair[0] - level, pair[1] - level);
            let at = t[j] + (t[j + 1] - t[j]) * before / (before - now);
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
    }
    if n < CROSSINGS {
        return None;
    }
    let samples = (last.1 - first.1) as f64 / f64::from(n - 1);
    (samples >= SAMPLES).then(|| std::f64::consts::PI * f64::from(n - 1) / (last.0 - first.0))
}

by_lanes! {
    /// The least and the largest of numbers, of which there are as many as go side by side, or more.
    pub fn extremes<L>(x: &[f64]) -> [f64; 2] {
        let first = L::at(x, 0);
        let (mut low, mut high) = (-first, first);
        for (_, [x]) in side_by_side::<L, 1>(x.len(), [x]) {
            (low, high) = ((-x).larger(low), x.larger(high));
        }
        let largest = |v: L| each(v)[..L::COUNT].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        [-largest(low), largest(high)]
    }
}

multiversion! {
    /// Second differences by these weights.
    fn curvatures(below: &[f64], above: &[f64], x: &[f64], out: &mut [f64]) {
        let n = out.len();
        let (a, b, x0, x1, x2) = (&below[..n], &above[..n], &x[..n], &x[1..=n], &x[2..n + 2]);
        for j in 0..n {
            out[j] = b[j] * (x2[j] - x1[j]) - a[j] * (x1[j] - x0[j]);
        }
    }
}

by_lanes! {
    /// The right side of the normal equations: sums of x - mean times 1, tau and the waves.
    fn moments<L>(mean: f64, columns: [&[f64]; N]) -> [f64; N] {
        let (n, mean, mut sums) = (columns[0].len(), L::all(mean), [L::all(0.0); N]);
        for (k, [x, tau, c, s, dc, ds]) in side_by_side::<L, N>(n, columns) {
            let x = (x - mean) * fresh::<L>(k, n);
            for (sum, by) in sums.iter_mut().zip([L::all(1.0), tau, c, s, dc, ds]) {
                *sum = *sum + by * x;
            }
        }
        sums.map(|sum| each(sum).iter().sum())
    }
}

by_lanes! {
    /// The upper triangle of the normal equations' matrix: sums of columns times columns.
    fn products<L>(columns: [&[f64]; N]) -> [[f64; N]; N] {
        let (n, mut sums) = (columns[0].len(), [[L::all(0.0); N]; N]);
        for (k, column) in side_by_side::<L, N>(n, columns) {
            let fresh = fresh::<L>(k, n);
            for i in 0..N {
                let by = column[i] * fresh;
                for j in i..N {
                    sums[i][j] = sums[i][j] + by * column[j];
                }
            }
        }
        sums.map(|row| row.map(|sum| each(sum).iter().sum()))
    }
}

by_lanes! {
    /// Sums of squares: of what the fit leaves, and of its waves.
    fn apart<L>(mean: f64, p: [f64; N], columns: [&[f64]; N]) -> (f64, f64) {
        let (n, p0) = (columns[0].len(), L::all(mean + p[0]));
        let [_, p1, p2, p3, p4, p5] = p.map(L::all);
        let (mut left, mut whole) = (L::all(0.0), L::all(0.0));
        for (k, [x, tau, c, s, dc, ds]) in side_by_side::<L, N>(n, columns) {
            let fresh = fresh::<L>(k, n);
            let wave = (p2 * c + p3 * s + p4 * dc + p5 * ds) * fresh;
            let rest = (x - p0 - p1 * tau) * fresh - wave;
            left = left + rest * rest;
            whole = whole + wave * wave;
        }
        (each(left).iter().sum(), each(whole).iter().sum())
    }
}

/// 1 where a block from k on has what no block had before, 0 where the last one reaches back.
#[inline(always)]
fn fresh<L: Lanes>(k: usize, n: usize) -> L {
    const MASK: [f64; 2 * LANES] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]; // read from `again` places before the middle on
    let again = if k + L::COUNT == n { n.next_multiple_of(L::COUNT) - n } else { 0 };
    L::at(&MASK, LANES - again)
}

impl Waves {
    /// None where the times do not tell the waves from one another.
    fn new(w: f64, t: &[f64], tau: &[f64], middle: f64) -> Option<Waves> {
        let (sin, cos): (Vec<f64>, Vec<f64>) = t.iter().map(|t| sin_cos(w * (t - middle))).unzip();
        let by_tau = |v: &[f64]| v.iter().zip(tau).map(|(v, tau)| v * tau).collect();
        let columns = [by_tau(&cos), by_tau(&sin)];
        let [tau_cos, tau_sin] = columns;
        let columns = [cos, sin, tau_cos, tau_sin];
        let ones = vec![1.0; t.len()];
        let mut m = products([&ones, tau, &columns[0], &columns[1], &columns[2], &columns[3]]);
        // elimination of a positive definite matrix: its upper triangle stays, below it the factors
        for k in 0..N {
            let pivot = m[k];
            if pivot[k].is_nan() || pivot[k] <= 1e-9 * m[0][0] {
                return None;
            }
            for (r, row) in m.iter_mut().enumerate().skip(k + 1) {
                let f = pivot[r] / pivot[k];
                for j in r..N {
                    row[j] -= f * pivot[j];
                }
                row[k] = f;
            }
        }
        Some(Waves { w, columns, factors: m })
    }

    fn solve(&self, mut b: [f64; N]) -> [f64; N] {
        let m = &self.factors;
        for k in 1..N {
            let known: f64 = (0..k).map(|j| m[k][j] * b[j]).sum();
            b[k] -= known;
        }
        for k in (0..N).rev() {
            let known: f64 = (k + 1..N).map(|j| m[k][j] * b[j]).sum();
            b[k] = (b[k] - known) / m[k][k];
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(x: impl Fn(f64) -> f64) -> Option<Oscillation> {
        // unequal steps
        let t: Vec<f64> = (0..96).map(|k| 0.1 * (f64::from(k) + 0.3 * f64::from(k % 3))).collect();
        let x: Vec<f64> = t.iter().map(|&t| x(t)).collect();
        let mut stretch = Stretch::default();
        stretch.begin(&t);
        let [low, high] = extremes(&x);
        stretch.oscillation(&x, 0.5 * (low + high))
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
