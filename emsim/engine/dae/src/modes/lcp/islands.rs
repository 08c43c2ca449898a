//! What moves no flow of the others is an island: a problem of its own, however many there are beside it.
use super::{cone, pivoted, Bounds, Solution};

/// A by rows. None where there is no solution within rounding.
pub fn solve(a: &[f64], b: &[f64], bounds: &Bounds) -> Option<Solution> {
    let n = b.len();
    let mut whole = Solution { f: vec![0.0; n], w: vec![0.0; n], bound: vec![false; n] };
    for part in islands(a, bounds) {
        let mut own = Vec::with_capacity(part.len() * part.len());
        part.iter().for_each(|&i| own.extend(part.iter().map(|&j| a[i * n + j])));
        let b: Vec<f64> = part.iter().map(|&i| b[i]).collect();
        let found = match bounds.of(&part) {
            bounds if bounds.pair.iter().any(Option::is_some) => cone::solve(&own, &b, &bounds)?,
            bounds => pivoted(&own, &b, &bounds)?,
        };
        for (k, &i) in part.iter().enumerate() {
            (whole.f[i], whole.w[i], whole.bound[i]) = (found.f[k], found.w[k], found.bound[k]);
        }
    }
    Some(whole)
}

/// Efforts that move no flow of the others, apart.
fn islands(a: &[f64], bounds: &Bounds) -> Vec<Vec<usize>> {
    let n = bounds.lo.len();
    let mut left: Vec<usize> = (0..n).collect();
    let mut found = Vec::new();
    let tied = |i: usize, j: usize| bounds.pair[i] == Some(j) || bounds.with[i].is_some_and(|(of, ..)| of == j);
    while let Some(first) = left.first().copied() {
        let (mut part, mut next) = (vec![first], 0);
        left.remove(0);
        while let Some(&i) = part.get(next) {
            let joins = |&j: &usize| a[i * n + j] != 0.0 || a[j * n + i] != 0.0 || tied(i, j) || tied(j, i);
            part.extend(left.iter().copied().filter(joins));
            left.retain(|j| !joins(j));
            next += 1;
        }
        part.sort_unstable();
        found.push(part);
    }
    found
}

impl Bounds {
    /// Those of a part of the efforts, which goes with no other.
    fn of(&self, part: &[usize]) -> Bounds {
        let at = |i: usize| part.binary_search(&i).ok();
        Bounds {
            lo: part.iter().map(|&i| self.lo[i]).collect(),
            hi: part.iter().map(|&i| self.hi[i]).collect(),
            with: part.iter().map(|&i| self.with[i].and_then(|(of, l, h)| Some((at(of)?, l, h)))).collect(),
            pair: part.iter().map(|&i| self.pair[i].and_then(at)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{solve, Bounds};

    /// Two touches with friction that do not know of each other: each has what it has alone.
    #[test]
    fn islands_have_what_they_have_alone() {
        let own = [2.0, 0.5, 0.5, 1.0];
        let bounds = |touches: usize| {
            let mut bounds = Bounds::new(vec![0.0; 2 * touches], [f64::INFINITY, 0.0].repeat(touches));
            (0..touches).for_each(|k| bounds.with[2 * k + 1] = Some((2 * k, -0.4, 0.4)));
            bounds
        };
        let (n, flows) = (4, [-1.0, 0.9, -0.3, -0.05]);
        let mut a = vec![0.0; n * n];
        for (k, value) in own.iter().enumerate() {
            for (first, second) in [(0, 1), (2, 3)] {
                let at = [first, second];
                a[at[k / 2] * n + at[k % 2]] = *value;
            }
        }
        let both = solve(&a, &flows, &bounds(2)).expect("there is a solution");
        for first in [0, 2] {
            let alone = solve(&own, &flows[first..first + 2], &bounds(1)).expect("there is a solution");
            assert_eq!(both.f[first..first + 2], alone.f[..]);
            assert_eq!(both.w[first..first + 2], alone.w[..]);
        }
    }
}
