//! Boxed linear complementarity problem:  w = b + A f,  lo <= f <= hi,  w = 0 inside, w >= 0 at lo, w <= 0 at hi.
//! Friction where parts touch has bounds that go with another effort, lo + l f(n) and hi + h f(n). Where it has several directions: cone.rs.
//!
//! A = W^T M^-1 W is symmetric and positive semidefinite up to what circuits add; a little on the diagonal makes it definite, and its
//! solution is then the least of those there are (effort shared equally where that decides nothing). What moves no flow of the others is
//! solved alone (islands.rs). Principal pivoting by the least index (Murty 1974), which ends for such matrices; where rounding or much
//! friction keeps it from that, Lemke's method (its pivots chosen lexicographically, so that it ends), which always answers for
//! friction where parts touch.

use crate::reduced::dense::{dot, factor_general, solve_general};
use crate::rounding::SAME;

/// Part of the largest diagonal entry.
const REGULAR: f64 = 1e-10;
const REFINED: usize = 3;

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

impl Solution {
    fn of(f: Vec<f64>, w: Vec<f64>, at: &[At]) -> Solution {
        Solution { f, w, bound: at.iter().map(|&at| at != At::Inside).collect() }
    }
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
mod islands;
mod lemke;

pub use islands::solve;

/// By the least index alone: blocks at once would leave redundant efforts shares that hang on how equations are written.
fn pivoted(a: &[f64], b: &[f64], bounds: &Bounds) -> Option<Solution> {
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
            At::Low if w[i] < 0.0 && w[i] < -1e-12 * size(i) => Some(At::Inside),
            At::High if w[i] > 0.0 && w[i] > 1e-12 * size(i) => Some(At::Inside),
            _ => None,
        };
        match (0..n).find_map(|i| Some((i, wrong(i)?))) {
            Some((i, to)) => at[i] = to,
            None => return Some(Solution::of(f, w, &at)),
        }
    }
    let at = lemke::solve(a, b, bounds)?;
    let f = inside(a, b, bounds, &at, little)?;
    Some(Solution::of(f.clone(), flows(a, b, &f), &at))
}

fn flows(a: &[f64], b: &[f64], f: &[f64]) -> Vec<f64> {
    a.chunks_exact(f.len()).zip(b).map(|(row, b)| b + dot(row, f)).collect()
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
    let mut matrix = Vec::with_capacity(own.len() * own.len());
    own.iter().for_each(|&i| matrix.extend(own.iter().map(|&j| bound[i * n + j])));
    let (factors, order) = factored(matrix, own.len())?;
    let (mut f, mut scratch) = (vec![0.0; n], vec![0.0; own.len()]);
    for _ in 0..REFINED {
        put(&mut f);
        let w = flows(a, b, &f);
        let mut change: Vec<f64> = own.iter().map(|&i| -w[i]).collect();
        solve_general(&factors, own.len(), &order, &mut change, &mut scratch);
        own.iter().zip(change).for_each(|(&i, change)| f[i] += change);
    }
    put(&mut f);
    f.iter().all(|f| f.is_finite()).then_some(f)
}

/// Factors of a small system, and the order of its rows.
fn factored(mut m: Vec<f64>, n: usize) -> Option<(Vec<f64>, Vec<usize>)> {
    let (mut order, mut scale) = (vec![0; n], vec![0.0; n]);
    factor_general(&mut m, n, &mut order, &mut scale).ok()?;
    Some((m, order))
}

/// The solution of a small system.
pub fn dense(m: Vec<f64>, mut r: Vec<f64>) -> Option<Vec<f64>> {
    let n = r.len();
    let (m, order) = factored(m, n)?;
    solve_general(&m, n, &order, &mut r, &mut vec![0.0; n]);
    r.iter().all(|r| r.is_finite()).then_some(r)
}

/// Of efforts f >= 0 of `which` those that the others can do without: their flows are as before, and none is below 0.
pub fn spare(a: &[f64], n: usize, which: &[usize], f: &[f64]) -> Vec<usize> {
    let (mut carry, mut f, mut found) = (which.to_vec(), f.to_vec(), Vec::new());
    loop {
        let own = independent(a, n, &carry, SAME, &|_| false);
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

/// A largest set of `which` with rows of A that are independent by more than `least`: those of `first` first, then larger diagonals.
pub fn independent(a: &[f64], n: usize, which: &[usize], least: f64, first: &dyn Fn(usize) -> bool) -> Vec<usize> {
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
        if pivot <= least * begun[p] || pivot <= 1e-14 * largest {
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

    fn numbers(mut seed: f64) -> impl FnMut() -> f64 {
        move || {
            seed = (seed * 997.0 + 0.123_456_7).fract();
            2.0 * seed - 1.0
        }
    }

    /// A of this rank and the flows that a motion gives.
    fn problem(n: usize, rank: usize, random: &mut dyn FnMut() -> f64) -> (Vec<f64>, Vec<f64>) {
        let w: Vec<f64> = (0..(n + 1) * rank).map(|_| random()).collect();
        let product = |i: usize, j: usize| dot(&w[i * rank..(i + 1) * rank], &w[j * rank..(j + 1) * rank]);
        let a = (0..n * n).map(|k| product(k / n, k % n)).collect();
        (a, (0..n).map(|i| product(i, n)).collect())
    }

    /// Random problems of all ranks: the solution is one.
    #[test]
    fn solutions_are_complementary() {
        let mut random = numbers(0.417);
        for round in 0..400 {
            let (n, rank) = (1 + round % 7, 1 + round % 4);
            let (a, b) = problem(n, rank, &mut random);
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
        assert_eq!(independent(&a, 2, &[0, 1], SAME, &|_| false), vec![0]);
        assert_eq!(independent(&a, 2, &[0, 1], SAME, &|i| i == 1), vec![1]);
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
        let mut random = numbers(0.731);
        for round in 0..400 {
            let (touches, rank) = (1 + round % 3, 3 + round % 2);
            let (n, mu) = (2 * touches, 0.05 + 0.3 * (round % 3) as f64);
            let (a, b) = problem(n, rank, &mut random);
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
