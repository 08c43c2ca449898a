//! A constant sparse matrix by compressed rows, for products: a row's sum stays in a register.
//!
//! Conductances are multiplied by differences: what a node's row has in common with a neighbour's stands as
//!
//!   sum_j a_ij x_j  =  sum_j a_ij (x_j - x_i) + (a_ii + sum_j a_ij) x_i
//!
//! with the sum in brackets, what leads elsewhere, made of the contributions before they were rounded. 30 mOhm at 17 V would
//! otherwise be known to 1e-13 A, which on the microsiemens that all the nodes of a bridge have in common is 0.1 uV.

use std::collections::BTreeMap;

/// Places (i, j) whose entries are multiplied by x_j - x_k, with k: in a node's own row it is i, in the sum of several nodes' rows
/// the node that leads to j.
pub type Pairs = BTreeMap<(usize, usize), usize>;

pub struct Rows {
    n: usize,
    start: Vec<u32>,
    col: Vec<u32>,
    whole: Vec<f64>,     // entries of the matrix
    pub value: Vec<f64>, // what is multiplied: the same, on the diagonal what leads elsewhere
    less: Vec<f64>,      // 1 where it is multiplied by a difference, else 0
    from: Vec<u32>,      // ... from this unknown
}

impl Rows {
    /// n x n, from entries sorted by row and column, and the contributions that they are the sums of.
    pub fn new(n: usize, entries: &BTreeMap<(usize, usize), f64>, of: &[(usize, usize, f64)], pairs: &Pairs) -> Rows {
        let mut start = vec![0u32; n + 1];
        for &(row, col) in entries.keys() {
            assert!(row < n && col < n);
            start[row + 1] += 1;
        }
        for row in 0..n {
            start[row + 1] += start[row];
        }
        let col = entries.keys().map(|&(_, col)| col as u32).collect();
        let elsewhere = remainders(n, of, pairs);
        let value = |(place, &v): (&(usize, usize), &f64)| elsewhere.get(place).map_or(v, |(sum, lost)| sum + lost);
        let less = entries.keys().map(|place| f64::from(pairs.contains_key(place))).collect();
        let from = entries.keys().map(|place| pairs.get(place).map_or(place.0, |&from| from) as u32).collect();
        Rows {
            n,
            start,
            col,
            whole: entries.values().copied().collect(),
            value: entries.iter().map(value).collect(),
            less,
            from,
        }
    }

    /// (row, column, value) of every entry.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.n).flat_map(move |row| {
            let places = self.start[row] as usize..self.start[row + 1] as usize;
            places.map(move |k| (row, self.col[k] as usize, self.whole[k]))
        })
    }

    /// (row, column, what is multiplied, and from which unknown where it is by a difference) in the same order.
    pub fn terms(&self) -> impl Iterator<Item = (usize, usize, f64, Option<usize>)> + '_ {
        let products = self.value.iter().zip(self.less.iter().zip(&self.from));
        let from = |less: f64, from: u32| (less != 0.0).then_some(from as usize);
        self.entries().zip(products).map(move |((row, col, _), (&value, (&l, &f)))| (row, col, value, from(l, f)))
    }

    /// Calls `put(i, sum_j a_ij x_j)` for every row i, with `a` in place of the own values of its terms.
    #[inline(always)]
    pub fn times(&self, a: &[f64], x: &[f64], put: impl FnMut(usize, f64)) {
        self.sums(a, x, |term| term, put);
    }

    /// Calls `put(i, sum_j |a_ij x_j|)` for every row i.
    #[inline(always)]
    pub fn sizes(&self, x: &[f64], put: impl FnMut(usize, f64)) {
        self.sums(&self.value, x, f64::abs, put);
    }

    #[inline(always)]
    fn sums(&self, a: &[f64], x: &[f64], of: impl Fn(f64) -> f64, mut put: impl FnMut(usize, f64)) {
        assert!(
            x.len() == self.n && a.len() == self.col.len() && self.less.len() == a.len() && self.from.len() == a.len()
        );
        // SAFETY: `new` made start ascending from 0 to col.len() = a.len(), n + 1 of them, and every col and from < n = x.len()
        unsafe {
            let mut k = 0;
            for row in 0..self.n {
                let end = *self.start.get_unchecked(row + 1) as usize;
                let mut sum = 0.0;
                while k < end {
                    let there = x.get_unchecked(*self.col.get_unchecked(k) as usize);
                    let here = x.get_unchecked(*self.from.get_unchecked(k) as usize);
                    sum += of(a.get_unchecked(k) * (there - self.less.get_unchecked(k) * here));
                    k += 1;
                }
                put(row, sum);
            }
        }
    }
}

/// Of what stands at the diagonal and at the unknowns that differences are from the sum with what stands in these pairs, as if it were
/// summed before it is rounded: a sum and what rounding has taken from it.
fn remainders(n: usize, of: &[(usize, usize, f64)], pairs: &Pairs) -> BTreeMap<(usize, usize), (f64, f64)> {
    let ends = pairs.iter().map(|(&(row, _), &from)| (row, from));
    let mut sums: BTreeMap<_, _> = (0..n).map(|i| (i, i)).chain(ends).map(|place| (place, (0.0, 0.0))).collect();
    for &(row, col, v) in of {
        let place = pairs.get(&(row, col)).map_or((row, col), |&from| (row, from));
        if let Some((sum, lost)) = sums.get_mut(&place) {
            let more: f64 = *sum + v;
            let part = more - *sum;
            *lost += (*sum - (more - part)) + (v - part);
            *sum = more;
        }
    }
    sums
}

/// Places of two nodes that have a conductance or a capacitance, or both, in common and nothing else.
pub fn reciprocal(node: impl Fn(usize) -> bool, parts: [&BTreeMap<(usize, usize), f64>; 2]) -> Pairs {
    let fits = |m: &BTreeMap<(usize, usize), f64>, (i, j): (usize, usize)| match m.get(&(i, j)) {
        Some(&v) => v <= 0.0 && m.get(&(j, i)) == Some(&v) && m.contains_key(&(i, i)),
        None => !m.contains_key(&(j, i)),
    };
    let places = parts.iter().flat_map(|m| m.keys()).copied();
    let both = places.filter(|&(i, j)| i != j && node(i) && node(j) && parts.iter().all(|m| fits(m, (i, j))));
    both.map(|(i, j)| ((i, j), i)).collect()
}
