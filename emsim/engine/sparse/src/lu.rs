//! The factors, laid out for speed, and what runs on every Newton iteration: refactor and solve.
//!
//! One array `lu` holds everything, column after column in pivot order:
//!
//!   column k:   F (off-diagonal blocks) | U (above the diagonal) | 1/u_kk | L (below, unit diagonal not stored)
//!
//! refactor: `lu` is cleared, the matrix is scattered into it, and for every entry u_jk of U
//!
//!   lu[target] -= l_ij * u_jk         for the entries l_ij of column j of L
//!
//! where the targets were written down beforehand (lu/arrangement.rs), one 4-byte number each ("grouped multiply-subtract list"):
//! no search, no dense work vector. Beyond `LIST_LIMIT` operations the list leaves the cache and a dense work vector is faster.
//!
//! What recurs often enough with the same pivots is turned into straight-line code (program.rs).
//!
//! A refactorisation keeps the pivots of the last `factor`. It refuses when a pivot has become small in its column (a weighted
//! multiplier above `MULTIPLIER_LIMIT`), has shrunk against what it was by `SHRINK_LIMIT`, or is not a number. Then the caller
//! chooses anew by `factor`, or lets `factor_or_refactor` do it.

mod arrangement;
mod kept;
mod loose;
mod programmed;
mod stamped;

pub(super) use self::arrangement::Arrangement;
pub use self::stamped::Stamp;
use self::stamped::Stamped;
use super::pivots::{eliminate, Pivots};
use super::program::{Layout, Recurring};
use super::{Scalar, Singular, Symbolic};
use std::collections::VecDeque;
use std::sync::Arc;

/// Refactor refuses a weighted multiplier above this (a pivot below 1e-6 of its column). With switches over 12 decades 1e8 let
/// backward errors of 1e-7 pass, 1e6 keeps them at 1e-10 and refuses one refactorisation in 300; 1e4 gains little more.
const MULTIPLIER_LIMIT: f64 = 1e6;
/// Refactor refuses a pivot below this part of its size in the last `factor`.
const SHRINK_LIMIT: f64 = 1e-10;

/// Pivots that values near a singular matrix have asked for may fill the factors: where these take more than so many times the
/// operations of the leanest ones that there were, pivots are chosen anew after so many refactorisations, and after twice as many
/// where that did not help. (Forty flat windows of four-bars under `radau` at 1e-8: 0.33 s, with pivots that are kept 1.4 s.)
const SWOLLEN: usize = 2;
const BORNE: u32 = 8;

/// The fixed pivots no longer serve the new values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefactorError {
    /// `factor` has not succeeded yet.
    NotFactored,
    /// A value is infinite or not a number; `factor` will name it.
    NotFinite,
    /// Pivot of this column of the original matrix became too small, or not a number.
    Pivot { col: usize },
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Pivot searches (`factor`), refactorisations done, refactorisations refused, solutions.
    pub factors: u64,
    pub refactors: u64,
    pub refusals: u64,
    pub solves: u64,
}

pub struct Lu<T: Scalar> {
    whole: Symbolic,            // of the pattern with all its rows
    symbolic: Symbolic,         // without those that are of the identity at present
    arranged: Arc<Arrangement>, // empty before the first factor
    // limits for refactor, of every entry of `lu`: multipliers, inverses of pivots; of the rest the largest number
    limits: Vec<f64>,
    // and what they must be larger than: an inverse 0, the rest nothing
    least: Vec<f64>,
    // numbers: the factors, and room for a solution behind them
    lu: Vec<T>,
    kept: VecDeque<(f64, Vec<T>)>, // other factors with these pivots, newest first: `keep`
    work: Vec<T>,
    stamped: Stamped<T>,
    ready: bool,
    dominant: Vec<bool>, // see `set_dominant`
    certain: bool,       // the present pivots serve whatever the values
    bare: bool,          // solutions by programs leave no factors where that is so
    leanest: usize,      // operations of any choice of pivots so far
    borne: u32,          // refactorisations by swollen factors
    patience: u32,       // with them
    counters: Counters,
    factor_and_solve: Recurring,
    factor_alone: Recurring,
    solve_alone: Recurring,
}

impl<T: Scalar> Lu<T> {
    pub fn new(symbolic: &Symbolic) -> Lu<T> {
        Lu {
            whole: symbolic.clone(),
            symbolic: symbolic.clone(),
            arranged: Arc::default(),
            limits: Vec::new(),
            least: Vec::new(),
            lu: Vec::new(),
            kept: VecDeque::new(),
            work: vec![T::ZERO; symbolic.n()],
            stamped: Stamped {
                values: vec![T::ZERO; symbolic.slots],
                base: Vec::new(),
                finite: true,
                stamps: Vec::new(),
                places: Vec::new(),
                sources: 0,
            },
            ready: false,
            dominant: Vec::new(),
            certain: false,
            bare: false,
            leanest: usize::MAX,
            borne: 0,
            patience: BORNE,
            counters: Counters::default(),
            factor_and_solve: Recurring::default(),
            factor_alone: Recurring::default(),
            solve_alone: Recurring::default(),
        }
    }

    pub fn n(&self) -> usize {
        self.symbolic.n()
    }

    /// Entries of the factors, off-diagonal blocks included; 0 before the first factorisation.
    pub fn nnz(&self) -> usize {
        self.arranged.rows.len()
    }

    /// Multiply-subtract operations of one refactorisation.
    pub fn operations(&self) -> usize {
        self.arranged.operations
    }

    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Have factors with their solution become straight-line code?
    pub fn has_program(&self) -> bool {
        self.factor_and_solve.program.is_some()
    }

    /// ... by themselves?
    #[cfg(test)]
    pub fn factor_alone_has_program(&self) -> bool {
        self.factor_alone.program.is_some() && self.solve_alone.program.is_some()
    }

    /// True when `solve` may be called.
    pub fn is_ready(&self) -> bool {
        self.ready
    }

    /// All matrices to come are those of a passive network's stages without coils (passive.rs), with these rows and columns its
    /// nodes': symmetric there, off-diagonal entries no larger than 0, row sums no smaller. What is eliminated by a pivot on their
    /// diagonal, or by the 1 of a source, leaves such a matrix again, and no entry grows (Wilkinson 1961): where all pivots are of
    /// these kinds nobody has to look at them.
    pub fn set_dominant(&mut self, nodes: Vec<bool>) {
        self.dominant = nodes;
    }

    /// Solutions by programs leave no factors where no pivot has to be looked at: for those who hardly ever ask for them.
    pub fn set_bare(&mut self) {
        self.bare = true;
    }

    /// Chooses pivots for `values` (in the order of the pattern) and factors.
    pub fn factor(&mut self, values: &[T]) -> Result<(), Singular> {
        self.ready = false;
        self.counters.factors += 1;
        if values.len() != self.symbolic.slots {
            return Err(Singular { row: None, col: None, structural: true, finite: true });
        }
        self.follow(values);
        let pivots = eliminate(&self.symbolic, values)?;
        if pivots.row != self.arranged.pivot_rows {
            self.arrange(&pivots);
        }
        self.leanest = self.leanest.min(self.arranged.operations);
        let in_vain = self.borne_enough() && self.swollen();
        self.patience = if in_vain { self.patience.saturating_mul(2) } else { BORNE };
        self.borne = 0;
        self.set_limits(&pivots);
        self.scatter(values);
        // the limits hold by construction, but for sums in another order: only a non-finite or zero pivot is an error now
        let outcome = if self.arranged.dense { self.eliminate_dense(false) } else { self.eliminate_listed::<false>() };
        match outcome {
            Ok(()) => {
                self.ready = true;
                Ok(())
            }
            Err(k) => Err(Singular {
                row: Some(self.arranged.input_rows[k] as usize),
                col: Some(self.symbolic.cols[k] as usize),
                structural: false,
                finite: true,
            }),
        }
    }

    /// Factors new values with the pivots of the last `factor`. After an error the old factors are gone.
    pub fn refactor(&mut self, values: &[T]) -> Result<(), RefactorError> {
        self.follow(values);
        if self.arranged.columns.len() != self.n() || values.len() != self.arranged.place.len() {
            self.ready = false;
            return Err(RefactorError::NotFactored);
        }
        if self.refactor_by_program(values) {
            self.refactored();
            return Ok(());
        }
        self.ready = false;
        if !self.scatter(values) {
            self.counters.refusals += 1;
            return Err(RefactorError::NotFinite);
        }
        self.eliminate()
    }

    /// Eliminates what `lu` holds, with the old pivots and their limits.
    fn eliminate(&mut self) -> Result<(), RefactorError> {
        let outcome = if self.arranged.dense { self.eliminate_dense(true) } else { self.eliminate_listed::<true>() };
        match outcome {
            Ok(()) => {
                self.refactored();
                Ok(())
            }
            Err(k) => {
                self.counters.refusals += 1;
                Err(RefactorError::Pivot { col: self.symbolic.cols[k] as usize })
            }
        }
    }

    fn refactored(&mut self) {
        self.counters.refactors += 1;
        self.borne += u32::from(self.swollen());
        self.ready = true;
    }

    /// Refactors where the old pivots serve, else factors.
    pub fn factor_or_refactor(&mut self, values: &[T]) -> Result<(), Singular> {
        match self.refactor(values) {
            Ok(()) if !self.borne_enough() => Ok(()),
            // what no choice of pivots is sure of, the swollen ones may still serve
            Ok(()) => self.factor(values).or_else(|singular| {
                self.borne = 0;
                self.refactor(values).map_err(|_| singular)
            }),
            Err(_) => self.factor(values),
        }
    }

    fn swollen(&self) -> bool {
        self.arranged.operations / SWOLLEN > self.leanest
    }

    /// Have swollen factors served for long enough?
    fn borne_enough(&self) -> bool {
        self.borne >= self.patience
    }

    /// What the programs are written from.
    fn layout(&self) -> Layout<'_> {
        Layout { symbolic: &self.symbolic, arranged: &self.arranged }
    }

    /// b <- A^-1 b. Without valid factors b becomes NaN, lest it pass for a solution.
    pub fn solve(&mut self, b: &mut [T]) {
        let n = self.n();
        if !self.ready || b.len() != n {
            b.fill(T::from_real(f64::NAN));
            return;
        }
        self.counters.solves += 1;
        if self.solve_by_program(b) {
            return;
        }
        let (w, lu, rows, columns) =
            (&mut self.work[..], &self.lu[..], &self.arranged.rows[..], &self.arranged.columns[..]);
        // SAFETY: `arrange` made every index: columns' ranges lie in 0..lu.len() = rows.len(), rows and input_rows and cols in 0..n
        unsafe {
            for k in 0..n {
                *w.get_unchecked_mut(k) = *b.get_unchecked(*self.arranged.input_rows.get_unchecked(k) as usize);
            }
            let blocks = &self.symbolic.blocks;
            for block in (0..blocks.len() - 1).rev() {
                let (first, last) = (blocks[block] as usize, blocks[block + 1] as usize);
                // along a chain of pivots the next value is ready in a register before memory would have it
                if last - first > 1 {
                    let mut value = *w.get_unchecked(first);
                    for k in first..last {
                        let c = columns.get_unchecked(k);
                        let (mut e, end) = (c.diagonal as usize + 1, c.end as usize);
                        *w.get_unchecked_mut(k) = value;
                        let mut next = if k + 1 < last { *w.get_unchecked(k + 1) } else { T::ZERO };
                        if e < end && *rows.get_unchecked(e) as usize == k + 1 {
                            next -= *lu.get_unchecked(e) * value;
                            e += 1;
                        }
                        while e < end {
                            *w.get_unchecked_mut(*rows.get_unchecked(e) as usize) -= *lu.get_unchecked(e) * value;
                            e += 1;
                        }
                        value = next;
                    }
                }
                let mut value = *w.get_unchecked(last - 1);
                for k in (first..last).rev() {
                    let c = columns.get_unchecked(k);
                    value *= *lu.get_unchecked(c.diagonal as usize);
                    *w.get_unchecked_mut(k) = value;
                    let mut next = if k > first { *w.get_unchecked(k - 1) } else { T::ZERO };
                    let (mut e, mut end) = (c.first as usize, c.diagonal as usize);
                    if k > first && end > e && *rows.get_unchecked(end - 1) as usize == k - 1 {
                        end -= 1;
                        next -= *lu.get_unchecked(end) * value;
                    }
                    while e < end {
                        *w.get_unchecked_mut(*rows.get_unchecked(e) as usize) -= *lu.get_unchecked(e) * value;
                        e += 1;
                    }
                    value = next;
                }
            }
            for k in 0..n {
                *b.get_unchecked_mut(*self.symbolic.cols.get_unchecked(k) as usize) = *w.get_unchecked(k);
            }
        }
    }

    /// b <- A^-T b (transposed, not conjugated).
    pub fn solve_transposed(&mut self, b: &mut [T]) {
        let n = self.n();
        if !self.ready || b.len() != n {
            b.fill(T::from_real(f64::NAN));
            return;
        }
        self.counters.solves += 1;
        let w = &mut self.work;
        for k in 0..n {
            w[k] = b[self.symbolic.cols[k] as usize];
        }
        for range in self.symbolic.blocks.windows(2) {
            let (first, last) = (range[0] as usize, range[1] as usize);
            for k in first..last {
                let c = self.arranged.columns[k];
                let mut sum = w[k];
                for e in c.first as usize..c.diagonal as usize {
                    sum -= self.lu[e] * w[self.arranged.rows[e] as usize];
                }
                w[k] = sum * self.lu[c.diagonal as usize];
            }
            for k in (first..last).rev() {
                let c = self.arranged.columns[k];
                let mut sum = w[k];
                for e in c.diagonal as usize + 1..c.end as usize {
                    sum -= self.lu[e] * w[self.arranged.rows[e] as usize];
                }
                w[k] = sum;
            }
        }
        for k in 0..n {
            b[self.arranged.input_rows[k] as usize] = w[k];
        }
    }

    /// Lays out the factors for a choice of pivots.
    fn arrange(&mut self, pivots: &Pivots) {
        self.arranged = self.symbolic.shelf.arranged(pivots, || Arrangement::new(&self.symbolic, pivots));
        self.kept.clear();
        self.lu.clear();
        self.lu.resize(self.arranged.rows.len() + self.n(), T::ZERO);
        let rows = self.arranged.input_rows.iter().zip(&self.symbolic.cols);
        let node = |&k: &u32| self.dominant[k as usize];
        self.certain = !self.dominant.is_empty() && rows.into_iter().all(|(r, c)| r == c || !(node(r) && node(c)));
        self.factor_and_solve.start(self.counters.refactors);
        self.factor_alone.start(self.counters.refactors);
        self.solve_alone.start(self.counters.solves);
        self.place_base();
        self.place_stamps();
    }

    fn set_limits(&mut self, pivots: &Pivots) {
        self.limits.clear();
        self.limits.resize(self.arranged.rows.len(), f64::MAX);
        self.least.clear();
        self.least.resize(self.arranged.rows.len(), -1.0);
        for (k, c) in self.arranged.columns.iter().enumerate() {
            let own = pivots.scale[pivots.row[k] as usize];
            for e in c.diagonal as usize + 1..c.end as usize {
                let other = pivots.scale[pivots.row[self.arranged.rows[e] as usize] as usize];
                self.limits[e] = MULTIPLIER_LIMIT * own / other;
            }
            self.limits[c.diagonal as usize] = 1.0 / (SHRINK_LIMIT * pivots.size[k]);
            self.least[c.diagonal as usize] = 0.0;
        }
    }

    /// Puts the values into the layout; true when all are finite.
    fn scatter(&mut self, values: &[T]) -> bool {
        self.lu.fill(T::ZERO);
        let mut finite = true;
        for (&place, &value) in self.arranged.place.iter().zip(values) {
            // SAFETY: `arrange` took `place` from 0..lu.len()
            unsafe { *self.lu.get_unchecked_mut(place as usize) = value };
            finite &= value.magnitude() < f64::INFINITY;
        }
        finite
    }

    /// Eliminates along the grouped list. The error is the pivot that failed; `STRICT` enforces the limits.
    fn eliminate_listed<const STRICT: bool>(&mut self) -> Result<(), usize> {
        let lu = &mut self.lu[..];
        let (mut g, mut t) = (0usize, 0usize);
        for (k, c) in self.arranged.columns.iter().enumerate() {
            // SAFETY: `arrange` made groups and targets, all within 0..lu.len(), and one limit for every entry of L and pivot
            unsafe {
                while g < c.group_end as usize {
                    let group = *self.arranged.groups.get_unchecked(g);
                    let u = *lu.get_unchecked(group.u as usize);
                    // (of laws that are open the row is that of the identity)
                    let len = if u == T::ZERO { 0 } else { group.len as usize };
                    for i in 0..len {
                        let target = *self.arranged.targets.get_unchecked(t + i) as usize;
                        let l = *lu.get_unchecked(group.l as usize + i);
                        *lu.get_unchecked_mut(target) -= l * u;
                    }
                    t += group.len as usize;
                    g += 1;
                }
                let d = c.diagonal as usize;
                let limit = |e: usize| if STRICT { *self.limits.get_unchecked(e) } else { f64::MAX };
                let inverse = lu.get_unchecked(d).recip();
                let mut good = (inverse.magnitude() <= limit(d)) & (inverse.magnitude() > 0.0);
                *lu.get_unchecked_mut(d) = inverse;
                let (mut e, end) = (d + 1, c.end as usize);
                while e < end {
                    let l = *lu.get_unchecked(e) * inverse;
                    *lu.get_unchecked_mut(e) = l;
                    good &= l.magnitude() <= limit(e);
                    e += 1;
                }
                if !good {
                    return Err(k);
                }
            }
        }
        Ok(())
    }

    /// The same with a dense work vector, for large factors.
    fn eliminate_dense(&mut self, strict: bool) -> Result<(), usize> {
        let (lu, x) = (&mut self.lu[..], &mut self.work[..]);
        let mut g = 0usize;
        for (k, c) in self.arranged.columns.iter().enumerate() {
            // SAFETY: as in `eliminate_listed`; rows are in 0..n
            unsafe {
                for e in c.upper as usize..c.end as usize {
                    *x.get_unchecked_mut(*self.arranged.rows.get_unchecked(e) as usize) = *lu.get_unchecked(e);
                }
                while g < c.group_end as usize {
                    let group = *self.arranged.groups.get_unchecked(g);
                    let u = *x.get_unchecked(*self.arranged.rows.get_unchecked(group.u as usize) as usize);
                    let end = group.l + if u == T::ZERO { 0 } else { group.len };
                    for e in group.l as usize..end as usize {
                        *x.get_unchecked_mut(*self.arranged.rows.get_unchecked(e) as usize) -= *lu.get_unchecked(e) * u;
                    }
                    g += 1;
                }
                for e in c.upper as usize..c.diagonal as usize {
                    *lu.get_unchecked_mut(e) = *x.get_unchecked(*self.arranged.rows.get_unchecked(e) as usize);
                }
                let limit = |e: usize| if strict { *self.limits.get_unchecked(e) } else { f64::MAX };
                let inverse = x.get_unchecked(k).recip();
                let mut good = (inverse.magnitude() <= limit(c.diagonal as usize)) & (inverse.magnitude() > 0.0);
                *lu.get_unchecked_mut(c.diagonal as usize) = inverse;
                for e in c.diagonal as usize + 1..c.end as usize {
                    let l = *x.get_unchecked(*self.arranged.rows.get_unchecked(e) as usize) * inverse;
                    *lu.get_unchecked_mut(e) = l;
                    good &= l.magnitude() <= limit(e);
                }
                if !good {
                    return Err(k);
                }
            }
        }
        Ok(())
    }
}

impl Lu<f64> {
    /// Is the determinant of what was factored last negative, the columns being in the order of elimination?
    pub fn negative(&self) -> bool {
        self.arranged.columns.iter().fold(self.arranged.odd, |odd, c| odd ^ (self.lu[c.diagonal as usize] < 0.0))
    }
}
