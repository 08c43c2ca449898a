//! A constant sparse matrix by compressed rows, for products: a row's sum stays in a register.

use std::collections::BTreeMap;

pub struct Rows {
    n: usize,
    start: Vec<u32>,
    col: Vec<u32>,
    pub value: Vec<f64>,
}

impl Rows {
    /// n x n, from entries sorted by row and column.
    pub fn new(n: usize, entries: &BTreeMap<(usize, usize), f64>) -> Rows {
        let mut start = vec![0u32; n + 1];
        for &(row, col) in entries.keys() {
            assert!(row < n && col < n);
            start[row + 1] += 1;
        }
        for row in 0..n {
            start[row + 1] += start[row];
        }
        let col = entries.keys().map(|&(_, col)| col as u32).collect();
        Rows { n, start, col, value: entries.values().copied().collect() }
    }

    /// (row, column, value) of every entry.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.n).flat_map(move |row| {
            let places = self.start[row] as usize..self.start[row + 1] as usize;
            places.map(move |k| (row, self.col[k] as usize, self.value[k]))
        })
    }

    /// Calls `put(i, sum_j a_ij x_j)` for every row i, with `a` in place of the own values.
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
        assert!(x.len() == self.n && a.len() == self.col.len());
        // SAFETY: `new` made start ascending from 0 to col.len() = a.len(), n + 1 of them, and every col < n = x.len()
        unsafe {
            let mut k = 0;
            for row in 0..self.n {
                let end = *self.start.get_unchecked(row + 1) as usize;
                let mut sum = 0.0;
                while k < end {
                    sum += of(a.get_unchecked(k) * x.get_unchecked(*self.col.get_unchecked(k) as usize));
                    k += 1;
                }
                put(row, sum);
            }
        }
    }
}
