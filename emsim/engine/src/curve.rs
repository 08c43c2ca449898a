//! A signal between its points: polynomials, one a segment, through values at Chebyshev's points of the second kind.
//!
//! ```text
//! t_j = (a + b)/2 - (b - a)/2 cos(pi j / n),   j = 0 .. n                                                 (1)
//! ```
//!
//! hold a polynomial of degree n; it is evaluated by the barycentric formula with weights (-1)^j, halved at the ends (Berrut and
//! Trefethen, SIAM Review 46, 2004, 501), differentiated by the matrix of Trefethen, Spectral Methods in MATLAB, 2000, p. 53, and
//! integrated by Clenshaw and Curtis (the same, p. 128). Segments follow each other; where the end of one and the start of the
//! next differ the signal jumps. A step of an integrator is a segment whose polynomial is the method's own dense output; other
//! tables have one between neighbouring points.
use crate::interpolate::Points;
use crate::rounding::{SAME, SUMMED};
use std::f64::consts::PI;

/// (1) on 0 .. 1.
pub fn nodes(n: usize) -> Vec<f64> {
    (0..=n).map(|j| 0.5 - 0.5 * (PI * j as f64 / n as f64).cos()).collect()
}

fn weights(n: usize) -> Vec<f64> {
    let weight = |j: usize| {
        let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
        sign * if j == 0 || j == n { 0.5 } else { 1.0 }
    };
    (0..=n).map(weight).collect()
}

/// The matrix, row by row, that takes values at (1) on 0 .. 1 to derivatives there.
pub fn slopes(n: usize) -> Vec<Vec<f64>> {
    let (t, w) = (nodes(n), weights(n));
    let row = |i: usize| {
        let mut row: Vec<f64> = (0..=n).map(|j| if i == j { 0.0 } else { (w[j] / w[i]) / (t[i] - t[j]) }).collect();
        row[i] = -row.iter().sum::<f64>();
        row
    };
    (0..=n).map(row).collect()
}

/// Weights of the integral over 0 .. 1.
pub fn areas(n: usize) -> Vec<f64> {
    let weight = |j: usize| {
        let of = |k: usize| {
            let share = if 2 * k == n { 1.0 } else { 2.0 };
            share / (4.0 * (k * k) as f64 - 1.0) * (2.0 * PI * (k * j) as f64 / n as f64).cos()
        };
        let ends = if j == 0 || j == n { 0.5 } else { 1.0 };
        ends / n as f64 * (1.0 - (1..=n / 2).map(of).sum::<f64>())
    };
    (0..=n).map(weight).collect()
}

/// The matrix, row by row, that takes values at (1) to those at other places of 0 .. 1.
pub fn resampling(n: usize, at: &[f64]) -> Vec<Vec<f64>> {
    let (t, w) = (nodes(n), weights(n));
    let row = |&place: &f64| {
        if let Some(hit) = t.iter().position(|&t| t == place) {
            return (0..=n).map(|j| if j == hit { 1.0 } else { 0.0 }).collect();
        }
        let terms: Vec<f64> = (0..=n).map(|j| w[j] / (place - t[j])).collect();
        let sum: f64 = terms.iter().sum();
        terms.into_iter().map(|term| term / sum).collect()
    };
    at.iter().map(row).collect()
}

/// The matrix, row by row, that takes values at (1) on 0 .. 1 to integrals from 0 to each point.
pub fn integrals(n: usize) -> Vec<Vec<f64>> {
    let (t, areas) = (nodes(n), areas(n));
    let row = |&end: &f64| {
        let at: Vec<f64> = t.iter().map(|t| t * end).collect();
        let values = resampling(n, &at);
        (0..=n).map(|j| end * areas.iter().zip(&values).map(|(w, row)| w * row[j]).sum::<f64>()).collect()
    };
    t.iter().map(row).collect()
}

fn product(row: &[f64], y: &[f64]) -> f64 {
    row.iter().zip(y).map(|(a, b)| a * b).sum()
}

/// (1) between neighbouring points of an axis, segment by segment.
pub fn segments(x: &[f64], n: usize) -> Vec<f64> {
    if x.len() < 2 {
        return vec![x.first().copied().unwrap_or(0.0); n + 1];
    }
    let t = nodes(n);
    let one =
        |w: &[f64]| -> Vec<f64> { (0..=n).map(|j| if j == n { w[1] } else { w[0] + (w[1] - w[0]) * t[j] }).collect() };
    x.windows(2).flat_map(one).collect()
}

/// Values there of a signal at its points, by the limited cubic; over a `logarithmic` axis in its logarithm. Ends are as they
/// are: a jump has two points at one place.
pub fn smooth(x: &[f64], y: &[f64], n: usize, corners: &[f64], logarithmic: bool) -> Vec<f64> {
    if x.len() < 2 {
        return vec![y.first().copied().unwrap_or(0.0); n + 1];
    }
    let mut at = segments(x, n);
    let mut known = x.to_vec();
    for values in [&mut known, &mut at] {
        if logarithmic && x[0] > 0.0 {
            values.iter_mut().for_each(|v| *v = v.ln());
        }
        if x[x.len() - 1] < x[0] {
            values.iter_mut().for_each(|v| *v = -*v);
        }
    }
    let points = Points { x: &known, y, corners };
    let (low, high) = (known[0], known[known.len() - 1]);
    let value = |(i, &t): (usize, &f64)| match (i / (n + 1), i % (n + 1)) {
        (k, 0) => y[k],
        (k, j) if j == n => y[k + 1],
        _ => points.at(t.max(low).min(high)),
    };
    at.iter().enumerate().map(value).collect()
}

/// y over x, both segment by segment, along the axis in the direction in which the table goes.
#[derive(Clone)]
pub struct Curve {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub n: usize,
    nodes: Vec<f64>,
    weights: Vec<f64>,
}

impl Curve {
    /// None where the sizes do not fit or there is no segment.
    pub fn new(x: Vec<f64>, y: Vec<f64>, n: usize) -> Option<Curve> {
        let fits = n > 0 && !x.is_empty() && x.len() == y.len() && x.len() % (n + 1) == 0;
        fits.then(|| Curve { x, y, n, nodes: nodes(n), weights: weights(n) })
    }

    fn made(&self, x: Vec<f64>, y: Vec<f64>) -> Curve {
        Curve { x, y, n: self.n, nodes: self.nodes.clone(), weights: self.weights.clone() }
    }

    fn count(&self) -> usize {
        self.x.len() / (self.n + 1)
    }

    fn start(&self, k: usize) -> f64 {
        self.x[k * (self.n + 1)]
    }

    fn end(&self, k: usize) -> f64 {
        self.x[k * (self.n + 1) + self.n]
    }

    fn values(&self, k: usize) -> &[f64] {
        &self.y[k * (self.n + 1)..][..self.n + 1]
    }

    fn down(&self) -> bool {
        self.x[self.x.len() - 1] < self.x[0]
    }

    pub fn first(&self) -> f64 {
        self.x[0].min(self.x[self.x.len() - 1])
    }

    pub fn last(&self) -> f64 {
        self.x[0].max(self.x[self.x.len() - 1])
    }

    /// Largest less smallest value; nan where one of them is.
    pub fn swing(&self) -> f64 {
        swing(&self.y)
    }

    /// A polynomial with values y at (1), at one place of 0 .. 1.
    fn at_place(&self, y: &[f64], place: f64) -> f64 {
        let (mut above, mut below) = (0.0, 0.0);
        for ((t, w), value) in self.nodes.iter().zip(&self.weights).zip(y) {
            let difference = place - t;
            if difference == 0.0 {
                return *value;
            }
            let share = w / difference;
            above += share * value;
            below += share;
        }
        above / below
    }

    /// The segment that t lies in, behind a jump at t.
    fn segment(&self, t: f64) -> usize {
        let sign = if self.down() { -1.0 } else { 1.0 };
        let (mut low, mut high) = (0, self.count());
        while low < high {
            let middle = (low + high) / 2;
            if sign * self.start(middle) <= sign * t {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low.max(1) - 1
    }

    /// Where in a segment, 0 .. 1.
    fn place(&self, k: usize, t: f64) -> f64 {
        let (a, b) = (self.start(k), self.end(k));
        if b == a {
            return 1.0;
        }
        ((t - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// At t; behind a jump there.
    pub fn value(&self, t: f64) -> f64 {
        let k = self.segment(t);
        self.at_place(self.values(k), self.place(k, t))
    }

    /// dy/dx at t; between two segments that of the one behind it; nan at a point.
    pub fn slope(&self, t: f64) -> f64 {
        let k = self.segment(t);
        let width = self.end(k) - self.start(k);
        let of: Vec<f64> = slopes(self.n).iter().map(|row| product(row, self.values(k))).collect();
        if width == 0.0 {
            f64::NAN
        } else {
            self.at_place(&of, self.place(k, t)) / width
        }
    }

    /// (place, 1 rising or -1 falling) of each time at which y comes to `level` from one side, within begin .. end and in the
    /// direction of the axis. Touching from below is rising, and staying there is no more than that; what starts on a constant
    /// level crosses it where it leaves, as in ngspice; what starts on another signal does not.
    pub fn crossings(&self, level: &Curve, begin: f64, end: f64) -> Vec<(f64, i32)> {
        let size = |y: &[f64]| y.iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
        let rounded = SUMMED * size(&self.y).max(size(&level.y));
        let near = |d: f64| if d.abs() <= rounded { 0.0 } else { d };
        let d: Vec<f64> = self.y.iter().zip(&level.y).map(|(a, b)| near(a - b)).collect();
        let within = |t: f64| begin <= t && t <= end;
        let mut found = vec![];
        let leaves = d.iter().position(|&v| v != 0.0).unwrap_or(0);
        if leaves > 0 && level.swing() == 0.0 && within(self.x[leaves - 1]) {
            found.push((self.x[leaves - 1], if d[leaves] > 0.0 { 1 } else { -1 }));
        }
        for (i, w) in d.windows(2).enumerate() {
            if !((w[0] < 0.0 && w[1] >= 0.0) || (w[0] > 0.0 && w[1] <= 0.0)) {
                continue;
            }
            let (k, j) = (i / (self.n + 1), i % (self.n + 1));
            // at the end of a segment: a jump to the next one
            let t = if j == self.n {
                self.end(k)
            } else {
                let width = self.end(k) - self.start(k);
                self.start(k) + self.root(&d[k * (self.n + 1)..][..self.n + 1], j) * width
            };
            if within(t) {
                found.push((t, if w[0] < 0.0 { 1 } else { -1 }));
            }
        }
        found
    }

    /// Where y comes to a constant level and turns: its maximum (direction 1), its minimum (-1), either (0). It is how a
    /// measurement finds the place of an extreme that another one has the value of, to rounding.
    pub fn touch(&self, level: &Curve, begin: f64, end: f64, direction: i32) -> Option<f64> {
        if level.swing() != 0.0 {
            return None;
        }
        let part = self.cut(begin, end);
        let near = SAME * part.swing();
        let turn = |sign: i32| {
            let (value, place) = part.extreme(f64::from(sign));
            ((direction == 0 || direction == sign) && (value - level.y[0]).abs() <= near).then_some(place)
        };
        turn(1).or_else(|| turn(-1))
    }

    /// Where in 0 .. 1 a polynomial with values d is zero between its points j and j + 1: Illinois' regula falsi. Where it has
    /// values that are none: a straight line, or the point that has one.
    fn root(&self, d: &[f64], j: usize) -> f64 {
        let (mut a, mut b, mut fa, mut fb) = (self.nodes[j], self.nodes[j + 1], d[j], d[j + 1]);
        if !d.iter().all(|v| v.is_finite()) {
            return match (fa.is_finite(), fb.is_finite()) {
                (true, true) => a - fa / (fb - fa) * (b - a),
                (_, true) => b,
                _ => a,
            };
        }
        let (mut c, mut last, mut moved) = (b, b, 0);
        if fb == 0.0 {
            return c;
        }
        for _ in 0..80 {
            c = b - fb * (b - a) / (fb - fa);
            if !(a < c && c < b) {
                c = 0.5 * (a + b);
            }
            let fc = self.at_place(d, c);
            if fc == 0.0 || (c - last).abs() < 4e-16 {
                break;
            }
            last = c;
            let moves = if (fc < 0.0) == (fa < 0.0) { -1 } else { 1 };
            // the same end twice: the other one counts half
            let again = if moves == moved { 0.5 } else { 1.0 };
            if moves < 0 {
                (a, fa, fb) = (c, fc, again * fb);
            } else {
                (b, fb, fa) = (c, fc, again * fa);
            }
            moved = moves;
        }
        c
    }

    /// The part within begin .. end, in ascending order.
    pub fn cut(&self, begin: f64, end: f64) -> Curve {
        let turned;
        let whole = if self.down() {
            let back = |v: &[f64]| v.iter().rev().copied().collect();
            turned = self.made(back(&self.x), back(&self.y));
            &turned
        } else {
            self
        };
        let (n, count) = (self.n, whole.count());
        let inside: Vec<usize> = (0..count).filter(|&k| whole.end(k) > begin && whole.start(k) < end).collect();
        let (Some(&low), Some(&high)) = (inside.first(), inside.last()) else {
            let away = |k: usize| (whole.start(k) - begin).abs() + (whole.end(k) - end).abs();
            let k = (0..count).fold(0, |best, k| if away(k) < away(best) { k } else { best });
            let width = whole.end(k) - whole.start(k);
            let place = ((begin - whole.start(k)) / if width == 0.0 { 1.0 } else { width }).clamp(0.0, 1.0);
            let value = whole.at_place(whole.values(k), place);
            return self.made(vec![begin; n + 1], vec![value; n + 1]);
        };
        let (mut x, mut y) = (vec![], vec![]);
        for &k in &inside {
            let (a, b) = (whole.start(k), whole.end(k));
            let (from, to) = if k == low || k == high { (a.max(begin), b.min(end)) } else { (a, b) };
            if (from, to) == (a, b) || b <= a {
                x.extend_from_slice(&whole.x[k * (n + 1)..][..n + 1]);
                y.extend_from_slice(whole.values(k));
                continue;
            }
            for t in &self.nodes {
                x.push(from + (to - from) * t);
                y.push(whole.at_place(whole.values(k), (from - a) / (b - a) + (to - from) / (b - a) * t));
            }
        }
        self.made(x, y)
    }

    /// Of y^power over all of x, by a rule that is exact for it.
    pub fn integral(&self, power: usize) -> f64 {
        let finer = self.n * power;
        let (areas, rows) = (areas(finer), resampling(self.n, &nodes(finer)));
        let mut sum = 0.0;
        for k in 0..self.count() {
            let y = self.values(k);
            let area: f64 = if power == 1 {
                product(&areas, y)
            } else {
                areas.iter().zip(&rows).map(|(w, row)| w * product(row, y).powi(power as i32)).sum()
            };
            sum += (self.end(k) - self.start(k)) * area;
        }
        sum
    }

    /// (value, place) of the largest value (sign 1) or the smallest one (-1); of several that are equal the first.
    pub fn extreme(&self, sign: f64) -> (f64, f64) {
        let y: Vec<f64> = self.y.iter().map(|v| if v.is_nan() { f64::NEG_INFINITY } else { sign * v }).collect();
        let first = (0..y.len()).fold(0, |best, i| if y[i] > y[best] { i } else { best });
        let highest = y[first];
        let mut found = vec![(highest, self.x[first])];
        let turns = self.turns(&y, highest);
        let best = turns.iter().fold(highest, |m, f| m.max(f.0));
        let least = y.iter().filter(|v| v.is_finite()).fold(f64::INFINITY, |m, &v| m.min(v));
        if !best.is_finite() || !least.is_finite() {
            return (sign * best, self.x[first]);
        }
        let equal = best - SAME * (best - least);
        if 0 < first && first < y.len() - 1 && turns.iter().any(|f| f.0 >= equal) {
            found.clear(); // a point beside the turn
        }
        found.extend(turns);
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (value, place) = found.into_iter().find(|f| f.0 >= equal).unwrap_or((highest, self.x[first]));
        (sign * value.max(best), place)
    }

    /// (value, place) where polynomials turn: they may go beyond their values at the points, by less than these lie apart.
    fn turns(&self, y: &[f64], highest: f64) -> Vec<(f64, f64)> {
        let matrix = slopes(self.n);
        let mut found = vec![];
        for k in 0..self.count() {
            let own = &y[k * (self.n + 1)..][..self.n + 1];
            let (top, swing) = (own.iter().copied().fold(f64::NEG_INFINITY, f64::max), swing(own));
            if !(swing > 0.0 && top + swing > highest) {
                continue;
            }
            let slope: Vec<f64> = matrix.iter().map(|row| product(row, own)).collect();
            for j in 0..self.n {
                if slope[j] > 0.0 && slope[j + 1] <= 0.0 {
                    let c = self.root(&slope, j);
                    found.push((self.at_place(own, c), self.start(k) + c * (self.end(k) - self.start(k))));
                }
            }
        }
        found
    }
}

fn swing(y: &[f64]) -> f64 {
    if y.iter().any(|v| v.is_nan()) {
        return f64::NAN;
    }
    let (low, high) = y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    high - low
}
