//! Boxed linear complementarity problem:  w = b + A f,  lo <= f <= hi,  w = 0 inside, w >= 0 at lo, w <= 0 at hi.
//! Friction where parts touch has bounds that go with another effort, lo + l f(n) and hi + h f(n). Where it has several directions: cone.rs.
//!
//! A = W^T M^-1 W is symmetric and positive semidefinite up to what circuits add; a little on the diagonal makes it definite, and its
//! solution is then the least of those there are (effort shared equally where that decides nothing). Principal pivoting by the
//! least index (Murty 1974), which ends for such matrices; where rounding or much friction keeps it from that, Lemke's method (its pivots
//! chosen lexicographically, so that it ends), which always answers for friction where parts touch; then projected Gauss-Seidel.

/// Part of the largest diagonal entry.
const REGULAR: f64 = 1e-10;
const REFINED: usize = 3;
const SWEEPS: usize = 20_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum At {
    Inside,
    Low,
    High,
}

pub struct Solution {
    pub f: Vec<f64>,
    pub w: Vec<f64>,
    /// which of f are at a bound
    pub bound: Vec<bool>,
}

/// Bounds of efforts.
#[derive(Clone)]
pub struct Bounds {
    pub lo: Vec<f64>,
    pub hi: Vec<f64>,
    /// the effort that they go with, and how much of it is added to lo and hi
    pub with: Vec<Option<(usize, f64, f64)>>,
    /// the effort of the next direction of one that has several, in a ring, together within hi of each
    pub pair: Vec<Option<usize>>,
}

impl Bounds {
    pub fn new(lo: Vec<f64>, hi: Vec<f64>) -> Bounds {
        let (with, pair) = (vec![None; lo.len()], vec![None; lo.len()]);
        Bounds { lo, hi, with, pair }
    }

    fn low(&self, i: usize, f: &[f64]) -> f64 {
        self.lo[i] + self.with[i].map_or(0.0, |(n, l, _)| l * f[n])
    }

    fn high(&self, i: usize, f: &[f64]) -> f64 {
        self.hi[i] + self.with[i].map_or(0.0, |(n, _, h)| h * f[n])
    }

    /// The directions of an effort, its own first.
    pub fn around(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(i), move |&at| self.pair[at].filter(|&next| next != i))
    }

    fn fixed(&self, i: usize) -> bool {
        self.lo[i] == self.hi[i] && self.with[i].is_none_or(|(_, l, h)| l == h)
    }
}

mod cone;
mod lemke;

/// A by rows. None where there is no solution within rounding.
pub fn solve(a: &[f64], b: &[f64], bounds: &Bounds) -> Option<Solution> {
    if bounds.pair.iter().any(Option::is_some) {
        return cone::solve(a, b, bounds);
    }
    let n = b.len();
    let largest = (0..n).map(|i| a[i * n + i].abs()).fold(0.0, f64::max);
    let little = REGULAR * largest.max(f64::MIN_POSITIVE);
    // what can open is open at first: where friction leaves two answers, that is the one
    let opens = |i: usize| bounds.lo[i].is_finite() && bounds.hi[i].is_infinite();
    let mut at: Vec<At> = (0..n).map(|i| if bounds.fixed(i) || opens(i) { At::Low } else { At::Inside }).collect();
    for _ in 0..100 + 40 * n {
        let Some(f) = inside(a, b, bounds, &at, little) else { break };
        let w = flows(a, b, &f);
        let size = |i: usize| b[i].abs() + (0..n).map(|j| (a[i * n + j] * f[j]).abs()).sum::<f64>();
        let wrong = |i: usize| match at[i] {
            _ if bounds.fixed(i) => None,
            At::Inside if f[i] < bounds.low(i, &f) => Some(At::Low),
            At::Inside if f[i] > bounds.high(i, &f) => Some(At::High),
            At::Low if w[i] < -1e-12 * size(i) => Some(At::Inside),
            At::High if w[i] > 1e-12 * size(i) => Some(At::Inside),
            _ => None,
        };
        match (0..n).find_map(|i| Some((i, wrong(i)?))) {
            Some((i, to)) => at[i] = to,
            None => {
                let bound = at.iter().map(|&at| at != At::Inside).collect();
                return Some(Solution { f, w, bound });
            }
        }
    }
    let found = lemke::solve(a, b, bounds).and_then(|at| {
        let f = inside(a, b, bounds, &at, little)?;
        let (w, bound) = (flows(a, b, &f), at.iter().map(|&at| at != At::Inside).collect());
        Some(Solution { f, w, bound })
    });
    found.or_else(|| relaxed(a, b, bounds, little))
}

fn flows(a: &[f64], b: &[f64], f: &[f64]) -> Vec<f64> {
    let n = b.len();
    (0..n).map(|i| b[i] + (0..n).map(|j| a[i * n + j] * f[j]).sum::<f64>()).collect()
}

/// Efforts where those inside make their flows 0; with a little on the diagonal, and what that leaves of the flows taken off again.
fn inside(a: &[f64], b: &[f64], bounds: &Bounds, at: &[At], little: f64) -> Option<Vec<f64>> {
    let n = b.len();
    // those at bounds that go with others come after these
    let put = |f: &mut Vec<f64>| {
        for goes in [false, true] {
            for i in (0..n).filter(|&i| bounds.with[i].is_some() == goes) {
                match at[i] {
                    At::Inside => {}
                    At::Low => f[i] = bounds.low(i, f),
                    At::High => f[i] = bounds.high(i, f),
                }
            }
        }
    };
    let own: Vec<usize> = (0..n).filter(|&i| at[i] == At::Inside).collect();
    let mut bound = a.to_vec();
    (0..n).for_each(|i| bound[i * n + i] += little);
    for (i, &with) in bounds.with.iter().enumerate() {
        let (Some((of, l, h)), true) = (with, at[i] != At::Inside) else { continue };
        let share = if at[i] == At::Low { l } else { h };
        (0..n).for_each(|r| bound[r * n + of] += share * a[r * n + i]);
    }
    let matrix: Vec<f64> =
        own.iter().flat_map(|&i| own.iter().map(move |&j| (i, j))).map(|(i, j)| bound[i * n + j]).collect();
    let mut f = vec![0.0; n];
    for _ in 0..REFINED {
        put(&mut f);
        let w = flows(a, b, &f);
        let right: Vec<f64> = own.iter().map(|&i| -w[i]).collect();
        for (&i, change) in own.iter().zip(dense(matrix.clone(), right)?) {
            f[i] += change;
        }
    }
    put(&mut f);
    Some(f)
}

/// The solution of a small system, pivoting by rows.
pub fn dense(mut m: Vec<f64>, mut r: Vec<f64>) -> Option<Vec<f64>> {
    let n = r.len();
    for k in 0..n {
        let best = (k..n).max_by(|&i, &j| m[i * n + k].abs().total_cmp(&m[j * n + k].abs()))?;
        if m[best * n + k] == 0.0 || !m[best * n + k].is_finite() {
            return None;
        }
        if best != k {
            (0..n).for_each(|j| m.swap(k * n + j, best * n + j));
            r.swap(k, best);
        }
        for i in k + 1..n {
            let by = m[i * n + k] / m[k * n + k];
            (k..n).for_each(|j| m[i * n + j] -= by * m[k * n + j]);
            r[i] -= by * r[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| m[k * n + j] * r[j]).sum();
        r[k] = (r[k] - rest) / m[k * n + k];
    }
    Some(r)
}

fn relaxed(a: &[f64], b: &[f64], bounds: &Bounds, little: f64) -> Option<Solution> {
    let n = b.len();
    let mut f = vec![0.0; n];
    let clamp = |f: &[f64], i: usize, v: f64| v.max(bounds.low(i, f)).min(bounds.high(i, f));
    (0..n).for_each(|i| f[i] = clamp(&f, i, 0.0));
    for _ in 0..SWEEPS {
        let mut moved = 0.0_f64;
        for i in 0..n {
            let w = b[i] + (0..n).map(|j| a[i * n + j] * f[j]).sum::<f64>();
            let new = clamp(&f, i, f[i] - w / (a[i * n + i] + little));
            moved = moved.max((new - f[i]).abs() / (1e-300 + new.abs()));
            f[i] = new;
        }
        if moved < 1e-13 {
            let w = flows(a, b, &f);
            // where a diagonal is below 0 it stands still at what is no solution
            let (low, high) = (|i: usize| f[i] <= bounds.low(i, &f), |i: usize| f[i] >= bounds.high(i, &f));
            let solves = |i: usize| {
                let size = b[i].abs() + (0..n).map(|j| (a[i * n + j] * f[j]).abs()).sum::<f64>();
                // flows of less of what they are made of are 0
                (w[i] >= -1e-6 * size || high(i)) && (w[i] <= 1e-6 * size || low(i)) && f[i].is_finite()
            };
            if !(0..n).all(solves) {
                return None;
            }
            let bound = (0..n).map(|i| low(i) || high(i)).collect();
            return Some(Solution { f, w, bound });
        }
    }
    None
}

/// Of efforts f >= 0 of `which` those that the others can do without: their flows are as before, and none is below 0.
pub fn spare(a: &[f64], n: usize, which: &[usize], f: &[f64]) -> Vec<usize> {
    let (mut carry, mut f, mut found) = (which.to_vec(), f.to_vec(), Vec::new());
    loop {
        let own = independent(a, n, &carry, &|_| false);
        let Some(&other) = carry.iter().find(|i| !own.contains(i)) else { return found };
        let matrix = own.iter().flat_map(|&i| own.iter().map(move |&j| a[i * n + j])).collect();
        let Some(part) = dense(matrix, own.iter().map(|&i| a[i * n + other]).collect()) else { return found };
        // what changes no flow: one more of the other, so much less of its own
        let change: Vec<(usize, f64)> =
            own.iter().zip(part).map(|(&i, part)| (i, -part)).chain([(other, 1.0)]).collect();
        let reach = |&(i, change): &(usize, f64)| if change > 0.0 { f[i] / change } else { f64::INFINITY };
        let Some(first) = change.iter().min_by(|p, q| reach(p).total_cmp(&reach(q))) else { return found };
        let (spared, by) = (first.0, reach(first));
        change.iter().for_each(|&(i, change)| f[i] -= by * change);
        carry.retain(|&i| i != spared);
        found.push(spared);
    }
}

/// A largest set of `which` whose rows of A are independent, by pivoted elimination; those of `first` first, then larger diagonals.
pub fn independent(a: &[f64], n: usize, which: &[usize], first: &dyn Fn(usize) -> bool) -> Vec<usize> {
    let k = which.len();
    let mut m: Vec<f64> = which.iter().flat_map(|&i| which.iter().map(move |&j| a[i * n + j])).collect();
    let begun: Vec<f64> = (0..k).map(|i| m[i * k + i].abs()).collect();
    let largest = begun.iter().copied().fold(0.0, f64::max);
    let (mut left, mut found): (Vec<usize>, Vec<usize>) = ((0..k).collect(), Vec::new());
    let rank = |i: &usize, j: &usize, m: &[f64]| {
        let own = |i: usize| first(which[i]);
        own(*i).cmp(&own(*j)).then(m[i * k + i].total_cmp(&m[j * k + j])).then(j.cmp(i))
    };
    while let Some(p) = left.iter().copied().max_by(|i, j| rank(i, j, &m)) {
        let pivot = m[p * k + p];
        left.retain(|&i| i != p);
        if pivot <= 1e-9 * begun[p] || pivot <= 1e-14 * largest {
            continue;
        }
        found.push(which[p]);
        for &i in &left {
            let by = m[i * k + p] / pivot;
            for &j in &left {
                m[i * k + j] -= by * m[p * k + j];
            }
        }
    }
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random problems of all ranks: the solution is one.
    #[test]
    fn solutions_are_complementary() {
        let mut seed = 0.417_f64;
        let mut random = || {
            seed = (seed * 997.0 + 0.123_456_7).fract();
            2.0 * seed - 1.0
        };
        for round in 0..400 {
            let (n, rank) = (1 + round % 7, 1 + round % 4);
            let w: Vec<f64> = (0..n * rank).map(|_| random()).collect();
            let a: Vec<f64> =
                (0..n * n).map(|k| (0..rank).map(|r| w[(k / n) * rank + r] * w[(k % n) * rank + r]).sum()).collect();
            // what a motion gives
            let motion: Vec<f64> = (0..rank).map(|_| random()).collect();
            let b: Vec<f64> = (0..n).map(|i| (0..rank).map(|r| w[i * rank + r] * motion[r]).sum()).collect();
            let corner = round % 3 == 0;
            let lo: Vec<f64> = (0..n).map(|i| if corner && i % 2 == 0 { 0.0 } else { -0.3 }).collect();
            let hi: Vec<f64> = (0..n).map(|i| if corner && i % 2 == 0 { f64::INFINITY } else { 0.3 }).collect();
            let s = solve(&a, &b, &Bounds::new(lo.clone(), hi.clone())).expect("there is a solution");
            for i in 0..n {
                assert!(s.f[i] >= lo[i] - 1e-9 && s.f[i] <= hi[i] + 1e-9);
                assert!(s.w[i] > -1e-7 || s.f[i] > hi[i] - 1e-7, "{i}: {} {}", s.w[i], s.f[i]);
                assert!(s.w[i] < 1e-7 || s.f[i] < lo[i] + 1e-7, "{i}: {} {}", s.w[i], s.f[i]);
            }
        }
    }

    /// Two elements that lock one motion share its load equally, and one of them is left over.
    #[test]
    fn what_is_redundant_shares_equally() {
        let a = [1.0, 1.0, 1.0, 1.0];
        let bounds = Bounds::new(vec![-3.0, -3.0], vec![3.0, 3.0]);
        let s = solve(&a, &[-1.0, -1.0], &bounds).expect("there is a solution");
        assert!((s.f[0] - 0.5).abs() < 1e-6 && (s.f[1] - 0.5).abs() < 1e-6);
        assert_eq!(independent(&a, 2, &[0, 1], &|_| false), vec![0]);
        assert_eq!(independent(&a, 2, &[0, 1], &|i| i == 1), vec![1]);
    }

    /// A table on four legs: three carry it, and none pulls.
    #[test]
    fn a_leg_of_a_table_is_spare() {
        let legs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let a: Vec<f64> =
            legs.iter().flat_map(|p| legs.iter().map(move |q| 1.0 + 3.0 * (p.0 * q.0 + p.1 * q.1))).collect();
        // it leans to the first leg
        let f = [0.5, 0.25, 0.2, 0.05];
        let spared = spare(&a, 4, &[0, 1, 2, 3], &f);
        assert_eq!(spared, vec![2]);
        assert!(spare(&a, 4, &[0, 1, 3], &f).is_empty());
    }

    /// Random touches of a rigid part with friction: (normal, tangent) pairs, bounds that go with the normal effort.
    #[test]
    fn friction_of_touches_is_complementary() {
        let mut seed = 0.731_f64;
        let mut random = || {
            seed = (seed * 997.0 + 0.123_456_7).fract();
            2.0 * seed - 1.0
        };
        for round in 0..400 {
            let (touches, rank) = (1 + round % 3, 3 + round % 2);
            let (n, mu) = (2 * touches, 0.05 + 0.3 * (round % 3) as f64);
            let w: Vec<f64> = (0..n * rank).map(|_| random()).collect();
            let a: Vec<f64> =
                (0..n * n).map(|k| (0..rank).map(|r| w[(k / n) * rank + r] * w[(k % n) * rank + r]).sum()).collect();
            let motion: Vec<f64> = (0..rank).map(|_| random()).collect();
            let b: Vec<f64> = (0..n).map(|i| (0..rank).map(|r| w[i * rank + r] * motion[r]).sum()).collect();
            let mut bounds = Bounds::new(vec![0.0; n], vec![0.0; n]);
            for i in 0..touches {
                bounds.hi[2 * i] = f64::INFINITY;
                bounds.with[2 * i + 1] = Some((2 * i, -mu, mu));
            }
            let s = solve(&a, &b, &bounds).expect("an impact without restitution has a solution");
            let mut work = 0.0;
            for i in 0..n {
                work += 0.5 * s.f[i] * (b[i] + s.w[i]);
                let (low, high) = (bounds.low(i, &s.f), bounds.high(i, &s.f));
                assert!(s.f[i] >= low - 1e-7 && s.f[i] <= high + 1e-7);
                assert!(s.w[i] > -1e-6 || s.f[i] > high - 1e-6, "{round} {i}: {} {}", s.w[i], s.f[i]);
                assert!(s.w[i] < 1e-6 || s.f[i] < low + 1e-6, "{round} {i}: {} {}", s.w[i], s.f[i]);
            }
            assert!(work < 1e-9);
        }
    }
}
