//! Rows that may be those of the identity, as of laws that are open: parts that do not touch. While they are, nothing of them is in the
//! pattern, and what they would have tied falls into blocks: factors grow with what touches, not with all that might.
use super::super::program::KEPT;
use super::super::{Pattern, Singular};
use super::Symbolic;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Of a pattern with such rows.
pub(super) struct Loose {
    pattern: Pattern,
    beside: Vec<Vec<usize>>, // of each the places off its diagonal
    known: Mutex<VecDeque<Symbolic>>,
}

impl Symbolic {
    /// The same where these rows may be those of the identity: then nothing of them stands in the way of the others, and what they
    /// would have tied falls into blocks.
    pub fn loosely(pattern: &Pattern, rows: &[usize]) -> Result<Symbolic, Singular> {
        let mut whole = Symbolic::analysed(pattern)?;
        let mut beside = vec![Vec::new(); pattern.n];
        for j in 0..pattern.n {
            let column = (pattern.colptr[j]..).zip(pattern.column(j));
            column.filter(|&(_, &row)| row != j).for_each(|(slot, &row)| beside[row].push(slot));
        }
        if !rows.is_empty() {
            let beside = rows.iter().map(|&row| std::mem::take(&mut beside[row])).collect();
            whole.open = vec![false; rows.len()];
            whole.loose = Some(Loose { pattern: pattern.clone(), beside, known: Mutex::default() });
        }
        Ok(Symbolic(Arc::new(whole)))
    }

    /// Of this pattern with loose rows the analysis that fits values where `present` does not.
    pub(in super::super) fn fitting(&self, present: &Symbolic, is_zero: impl Fn(usize) -> bool) -> Option<Symbolic> {
        let loose = self.loose.as_ref()?;
        let open: Vec<bool> = loose.beside.iter().map(|slots| slots.iter().all(|&k| is_zero(k))).collect();
        if open == present.open {
            return None;
        }
        let mut known = loose.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = known.iter().find(|s| s.open == open) {
            return Some(found.clone());
        }
        // where such rows leave no inverse the whole pattern will say so
        let Some(new) = loose.without(open) else { return Some(self.clone()) };
        known.push_front(new.clone());
        known.truncate(KEPT);
        Some(new)
    }

    /// Are there loose rows?
    pub(in super::super) fn is_loose(&self) -> bool {
        self.loose.is_some()
    }
}

impl Loose {
    /// Without what stands beside the diagonals of open rows.
    fn without(&self, open: Vec<bool>) -> Option<Symbolic> {
        let mut left = vec![true; self.pattern.nnz()];
        for (_, slots) in open.iter().zip(&self.beside).filter(|(&open, _)| open) {
            slots.iter().for_each(|&k| left[k] = false);
        }
        let (mut colptr, mut source) = (vec![0], Vec::with_capacity(left.len()));
        for range in self.pattern.colptr.windows(2) {
            source.extend((range[0]..range[1]).filter(|&k| left[k]).map(|k| k as u32));
            colptr.push(source.len());
        }
        let rowidx = source.iter().map(|&k| self.pattern.rowidx[k as usize]).collect();
        let mut new = Symbolic::analysed(&Pattern { n: self.pattern.n, colptr, rowidx }).ok()?;
        new.matrix.source.iter_mut().for_each(|k| *k = source[*k as usize]);
        (new.slots, new.open) = (left.len(), open);
        Some(Symbolic(Arc::new(new)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Lu, Pattern, Symbolic};

    /// Rows that come and go leave the solution as it is, whatever the factors have seen before.
    #[test]
    fn rows_of_the_identity_come_and_go() {
        let n = 12;
        // a ring of eight, and four rows that each tie two of them
        let ties = (8..n).flat_map(|k| [(k, k), (k, k - 8), (k, k - 4), (k - 8, k), (k - 4, k)]);
        let ring = (0..8).flat_map(|k| [(k, k), (k, (k + 1) % 8)]);
        let pattern = Pattern::from_entries(n, &ties.chain(ring).collect::<Vec<_>>());
        let mut lu: Lu<f64> = Lu::new(&Symbolic::loosely(&pattern, &[8, 9, 10, 11]).unwrap());
        let mut sizes = Vec::new();
        for round in 0..40 {
            let open = |row: usize| row >= 8 && (round >> (row - 8)) % 2 == 0;
            let mut values = vec![0.0; pattern.nnz()];
            for col in 0..n {
                for slot in pattern.colptr[col]..pattern.colptr[col + 1] {
                    let row = pattern.rowidx[slot];
                    let own = if row < 8 { 4.0 } else { f64::from(u8::from(open(row))) };
                    let beside = if open(row) { 0.0 } else { 0.3 + 0.1 * ((7 * row + 3 * col + round) % 5) as f64 };
                    values[slot] = if row == col { own } else { beside };
                }
            }
            lu.factor_or_refactor(&values).unwrap();
            let b: Vec<f64> = (0..n).map(|k| (k as f64).cos()).collect();
            let mut x = b.clone();
            lu.solve(&mut x);
            let mut left = b;
            for col in 0..n {
                (pattern.colptr[col]..pattern.colptr[col + 1])
                    .for_each(|slot| left[pattern.rowidx[slot]] -= values[slot] * x[col]);
            }
            assert!(left.iter().all(|v| v.abs() < 1e-12), "round {round}: {left:?}");
            sizes.push(lu.nnz());
        }
        assert!(sizes[0] < sizes[15] && sizes[0] == sizes[16]);
    }
}
