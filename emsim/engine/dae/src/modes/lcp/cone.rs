//! The same problem with efforts that have several directions: |f| <= r, inside w = 0, at the edge f = -r w/|w|; of friction where parts
//! touch r goes with the effort across, so that efforts lie in a cone.
//!
//! Efforts are where a step against their flows is projected back to them, f = P(f - rho w). Projected Gauss-Seidel finds which are
//! inside, Newton's method on these equations (Alart and Curnier 1991) the solution. A little on the diagonal makes it the least.
//! Where that fails, as it may with more touches than parts need and much friction, the proximal point method (Rockafellar 1976) leads
//! there: as much on the diagonal as Newton's method asks for, about the last efforts in place of 0, so that nothing of it is left.
use super::{dense, flows, Bounds, Solution, REFINED};
use crate::rounding::SAME;

struct Problem<'a> {
    a: Vec<f64>, // with something on the diagonal
    b: Vec<f64>,
    bounds: &'a Bounds,
    rho: Vec<f64>,
}

/// Where an effort is: its step z, its projection, and what that is.
#[derive(Clone, Copy)]
enum At {
    Inside,
    Low,
    High,
    /// radius and length of the step
    Edge(f64, f64),
}

impl Problem<'_> {
    fn new<'a>(a: &[f64], b: Vec<f64>, bounds: &'a Bounds, more: f64) -> Problem<'a> {
        let n = b.len();
        let mut a = a.to_vec();
        (0..n).for_each(|i| a[i * n + i] += more);
        let row = |i: usize| bounds.around(i).map(|j| a[i * n + j].abs()).sum::<f64>();
        let stiff = |i: usize| match bounds.pair[i].filter(|&j| bounds.pair[j] == Some(i)) {
            // the largest eigenvalue of its directions; of more than two what it is not above
            Some(j) => {
                let (p, q, off) = (a[i * n + i], a[j * n + j], 4.0 * a[i * n + j] * a[j * n + i]);
                0.5 * (p + q + ((p - q) * (p - q) + off).max(0.0).sqrt()).abs()
            }
            None => bounds.around(i).map(row).fold(0.0, f64::max),
        };
        let rho = (0..n).map(|i| 1.0 / stiff(i).max(more).max(f64::MIN_POSITIVE)).collect();
        Problem { a, b, bounds, rho }
    }

    fn flow(&self, i: usize, f: &[f64]) -> f64 {
        let n = f.len();
        self.b[i] + (0..n).map(|j| self.a[i * n + j] * f[j]).sum::<f64>()
    }

    /// f_i behind its step z_i, which with those of its other directions has this length.
    fn projected(&self, i: usize, z: f64, length: f64, f: &[f64]) -> (f64, At) {
        let (low, high) = (self.bounds.low(i, f), self.bounds.high(i, f).max(self.bounds.low(i, f)));
        if self.bounds.pair[i].is_some() {
            let radius = high.max(0.0);
            return if length < radius {
                (z, At::Inside)
            } else {
                (if length > 0.0 { radius * z / length } else { 0.0 }, At::Edge(radius, length))
            };
        }
        match z {
            _ if z <= low => (low, At::Low),
            _ if z >= high => (high, At::High),
            _ => (z, At::Inside),
        }
    }

    fn steps(&self, f: &[f64], w: &[f64]) -> Vec<f64> {
        (0..f.len()).map(|i| f[i] - self.rho[i] * w[i]).collect()
    }

    /// Of the steps of all its directions.
    fn length(&self, i: usize, z: &[f64]) -> f64 {
        self.bounds.around(i).map(|j| z[j]).fold(0.0, f64::hypot)
    }

    /// What is left of the equations, where each effort is, and whether it is within so much of what they are made of.
    fn left(&self, f: &[f64], w: &[f64], within: f64) -> (Vec<f64>, Vec<At>, bool) {
        let n = f.len();
        let z = self.steps(f, w);
        let (to, at): (Vec<f64>, Vec<At>) = (0..n).map(|i| self.projected(i, z[i], self.length(i, &z), f)).unzip();
        let left: Vec<f64> = (0..n).map(|i| f[i] - to[i]).collect();
        let size = |i: usize| {
            let made = self.b[i].abs() + (0..n).map(|j| (self.a[i * n + j] * f[j]).abs()).sum::<f64>();
            self.rho[i] * made + f[i].abs()
        };
        let solved = (0..n).all(|i| left[i].abs() <= within * size(i));
        (left, at, solved)
    }

    /// A step of Newton's method against `left`.
    fn newton(&self, f: &mut [f64], w: &[f64], left: &[f64], at: &[At]) -> Option<()> {
        let n = f.len();
        let z = self.steps(f, w);
        let mut m = vec![0.0; n * n];
        for i in 0..n {
            let row = &mut m[i * n..(i + 1) * n];
            let step = |i: usize, j: usize| f64::from(u8::from(i == j)) - self.rho[i] * self.a[i * n + j];
            row[i] = 1.0;
            match (at[i], self.bounds.with[i]) {
                (At::Inside, _) => (0..n).for_each(|j| row[j] -= step(i, j)),
                (At::Low, with) => with.into_iter().for_each(|(of, l, _)| row[of] -= l),
                (At::High, with) => with.into_iter().for_each(|(of, _, h)| row[of] -= h),
                (At::Edge(radius, length), with) if length > 0.0 => {
                    let own = z[i] / length;
                    for (j, entry) in row.iter_mut().enumerate() {
                        // across the step alone does the direction change
                        let along = self.bounds.around(i).map(|other| z[other] / length * step(other, j)).sum::<f64>();
                        *entry -= radius / length * (step(i, j) - own * along);
                    }
                    with.into_iter().for_each(|(of, _, h)| row[of] -= own * h);
                }
                (At::Edge(..), _) => {}
            }
        }
        let change = dense(m, left.iter().map(|v| -v).collect())?;
        f.iter_mut().zip(change).for_each(|(f, change)| *f += change);
        f.iter().all(|f| f.is_finite()).then_some(())
    }

    /// From f by sweeps, until Newton's method finds the solution from there.
    fn search(&self, mut f: Vec<f64>) -> Option<Vec<f64>> {
        for again in 0..3 {
            // sweeps before Newton's method is tried, twice as many each time
            (0..8 << again).for_each(|_| self.sweep(&mut f));
            let mut tried = f.clone();
            for _ in 0..30 {
                let w = flows(&self.a, &self.b, &tried);
                let (left, at, solved) = self.left(&tried, &w, 1e-11);
                if solved {
                    return Some(tried);
                }
                if self.newton(&mut tried, &w, &left, &at).is_none() {
                    break;
                }
            }
        }
        None
    }

    fn sweep(&self, f: &mut [f64]) {
        for i in 0..f.len() {
            if self.bounds.around(i).all(|j| j >= i) {
                let z: Vec<(usize, f64)> =
                    self.bounds.around(i).map(|j| (j, f[j] - self.rho[j] * self.flow(j, f))).collect();
                let length = z.iter().map(|&(_, z)| z).fold(0.0, f64::hypot);
                z.into_iter().for_each(|(j, z)| f[j] = self.projected(j, z, length, f).0);
            }
        }
    }
}

pub fn solve(a: &[f64], b: &[f64], bounds: &Bounds) -> Option<Solution> {
    let n = b.len();
    let largest = (0..n).map(|i| a[i * n + i].abs()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let bare = Problem::new(a, b.to_vec(), bounds, 0.0);
    // what can open is open at first; rounding of flows over so little is what it makes of efforts that are redundant
    let little = Problem::new(a, b.to_vec(), bounds, 1e-6 * largest);
    let least = little.search(vec![0.0; n]).and_then(|f| refined(&bare, &little, f));
    if let Some(s) = least.and_then(|f| solution(&bare, f)) {
        return Some(s);
    }
    // on the diagonal: at first, at least and at most
    let [mut weight, floor, top] = [1.0, 1e-8, 1e3];
    let mut f = vec![0.0; n];
    // steps of the proximal point method, with less on it after a step and more where there is none
    for _ in 0..100 {
        let more = weight * largest;
        let right = (0..n).map(|i| b[i] - more * f[i]).collect();
        let Some(next) = Problem::new(a, right, bounds, more).search(f.clone()) else {
            weight *= 5.0;
            if weight > top {
                return None;
            }
            continue;
        };
        (f, weight) = (next, (0.3 * weight).max(floor));
        if let Some(s) = solution(&bare, f.clone()) {
            return Some(s);
        }
    }
    None
}

/// Efforts f as a solution; None where they are none. Rounding of A leaves something of flows that are redundant.
fn solution(p: &Problem, f: Vec<f64>) -> Option<Solution> {
    let w = flows(&p.a, &p.b, &f);
    let (_, at, solved) = p.left(&f, &w, SAME);
    let bound = at.iter().map(|at| !matches!(at, At::Inside)).collect();
    solved.then_some(Solution { f, w, bound })
}

/// What the little on the diagonal leaves of the flows is taken off again.
fn refined(bare: &Problem, p: &Problem, mut f: Vec<f64>) -> Option<Vec<f64>> {
    let (_, at, _) = p.left(&f, &flows(&p.a, &p.b, &f), SAME);
    for _ in 0..REFINED {
        let w = flows(&bare.a, &bare.b, &f);
        let z = p.steps(&f, &w);
        let left: Vec<f64> = (0..f.len())
            .map(|i| match at[i] {
                At::Inside => p.rho[i] * w[i],
                At::Low => f[i] - p.bounds.low(i, &f),
                At::High => f[i] - p.bounds.high(i, &f),
                At::Edge(_, length) if length > 0.0 => f[i] - p.bounds.high(i, &f).max(0.0) * z[i] / p.length(i, &z),
                At::Edge(..) => f[i],
            })
            .collect();
        let mut next = f.clone();
        p.newton(&mut next, &w, &left, &at)?;
        f = next;
    }
    Some(f)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random touches of a rigid part in space, more than it needs: what holds of their solutions.
    #[test]
    fn friction_in_space_is_complementary() {
        let mut seed = 0.377_f64;
        let mut random = || {
            seed = (seed * 997.0 + 0.123_456_7).fract();
            2.0 * seed - 1.0
        };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let unit = |a: [f64; 3]| a.map(|v| v / a.iter().map(|v| v * v).sum::<f64>().sqrt());
        for round in 0..400 {
            let (touches, rank) = (1 + round % 8, 6);
            let (n, mu) = (3 * touches, 0.05 + 0.3 * (round % 5) as f64);
            let mut w = Vec::new();
            for _ in 0..touches {
                let mut three = || [random(), random(), random()];
                let (at, normal) = (three(), unit(three()));
                let one = unit(cross(normal, three()));
                for way in [normal, one, cross(normal, one)] {
                    // of mass 1 and radius of gyration 1/2
                    w.extend([way, cross(at, way).map(|v| 2.0 * v)].concat());
                }
            }
            let a: Vec<f64> =
                (0..n * n).map(|k| (0..rank).map(|r| w[(k / n) * rank + r] * w[(k % n) * rank + r]).sum()).collect();
            let motion: Vec<f64> = (0..rank).map(|_| random()).collect();
            let b: Vec<f64> = (0..n).map(|i| (0..rank).map(|r| w[i * rank + r] * motion[r]).sum()).collect();
            let mut bounds = Bounds::new(vec![0.0; n], vec![0.0; n]);
            for i in (0..n).step_by(3) {
                bounds.hi[i] = f64::INFINITY;
                for (one, other) in [(i + 1, i + 2), (i + 2, i + 1)] {
                    (bounds.with[one], bounds.pair[one]) = (Some((i, -mu, mu)), Some(other));
                }
            }
            let s = solve(&a, &b, &bounds).expect("an impact without restitution has a solution");
            let work: f64 = (0..n).map(|i| 0.5 * s.f[i] * (b[i] + s.w[i])).sum();
            assert!(work < 1e-9);
            for i in (0..n).step_by(3) {
                let (push, rise) = (s.f[i], s.w[i]);
                assert!(push > -1e-9 && rise > -1e-7 && push * rise < 1e-7, "{round}: {push} {rise}");
                let (rub, slip) = (s.f[i + 1].hypot(s.f[i + 2]), s.w[i + 1].hypot(s.w[i + 2]));
                assert!(rub <= mu * push + 1e-8, "{round}: {rub} of {push}");
                let power = s.f[i + 1] * s.w[i + 1] + s.f[i + 2] * s.w[i + 2];
                assert!((power + mu * push * slip).abs() < 1e-7, "{round}: {power} {slip}");
            }
        }
    }
}
