//! Matrices that are a constant base plus stamps, as every Newton iteration of a circuit asks for them.

use super::super::{Scalar, Singular};
use super::Lu;

/// `sign` times source number `source` is added to value number `slot` of the matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamp {
    pub slot: u32,
    pub source: u32,
    pub sign: f64,
}

/// A matrix that is a constant base plus stamps: the base lies ready in the layout of the factors, so that a new
/// matrix costs one copy and one addition a stamp.
pub(super) struct Stamped<T> {
    pub values: Vec<T>, // the base as the caller gave it
    pub base: Vec<T>,   // the same in the layout
    pub finite: bool,
    pub stamps: Vec<Stamp>,
    pub places: Vec<(u32, u32, f64)>, // in the layout, source, sign
    pub sources: usize,               // highest source + 1
}

impl<T: Scalar> Lu<T> {
    /// Announces the stamps of `factor_stamped`; slots are places on the pattern.
    pub fn set_stamps(&mut self, stamps: &[Stamp]) {
        self.stamped.stamps = stamps.to_vec();
        self.stamped.sources = stamps.iter().map(|s| s.source as usize + 1).max().unwrap_or(0);
        assert!(stamps.iter().all(|s| (s.slot as usize) < self.symbolic.slots));
        self.place_stamps();
    }

    /// The constant part of the next matrices, in the order of the pattern.
    pub fn set_base(&mut self, values: &[T]) {
        self.stamped.values.copy_from_slice(values);
        self.place_base();
    }

    /// Factors base + stamps, with the old pivots where they serve.
    pub fn factor_stamped(&mut self, sources: &[T]) -> Result<(), Singular> {
        assert!(sources.len() >= self.stamped.sources);
        if self.whole.is_loose() {
            self.follow(&self.sum(sources));
        }
        if self.arranged.columns.len() == self.n()
            && self.n() > 0
            && self.stamped.base.len() == self.arranged.rows.len() + 1
        {
            self.ready = false;
            self.lu[..self.stamped.base.len()].copy_from_slice(&self.stamped.base);
            for &(place, source, sign) in &self.stamped.places {
                // SAFETY: `place_stamps` took places from 0..lu.len(), sources are below `sources` as asserted
                unsafe {
                    *self.lu.get_unchecked_mut(place as usize) +=
                        *sources.get_unchecked(source as usize) * T::from_real(sign);
                }
            }
            let finite = self.stamped.finite && sources.iter().all(|v| v.magnitude() < f64::INFINITY);
            if finite && self.eliminate().is_ok() {
                if !self.borne_enough() {
                    return Ok(());
                }
                return self.factor_or_refactor(&self.sum(sources));
            }
        }
        self.factor(&self.sum(sources))
    }

    /// Base + stamps, in the order of the pattern.
    fn sum(&self, sources: &[T]) -> Vec<T> {
        let mut values = self.stamped.values.clone();
        for s in &self.stamped.stamps {
            values[s.slot as usize] += sources[s.source as usize] * T::from_real(s.sign);
        }
        values
    }

    pub(super) fn place_base(&mut self) {
        let s = &mut self.stamped;
        s.base.clear();
        s.finite = true;
        if self.arranged.rows.is_empty() {
            return;
        }
        s.base.resize(self.arranged.rows.len() + 1, T::ZERO);
        for (&place, &value) in self.arranged.place.iter().zip(&s.values) {
            // SAFETY: `arrange` took `place` from 0..lu.len()
            unsafe { *s.base.get_unchecked_mut(place as usize) = value };
            s.finite &= value.magnitude() < f64::INFINITY;
        }
    }

    pub(super) fn place_stamps(&mut self) {
        let place = &self.arranged.place;
        let placed = self.stamped.stamps.iter().filter_map(|s| Some((*place.get(s.slot as usize)?, s.source, s.sign)));
        self.stamped.places = placed.collect(); // none before the first factorisation
    }
}

impl Lu<f64> {
    /// Factors base + stamps, with the old pivots where they serve, and solves: b <- A^-1 b.
    pub fn factor_and_solve(&mut self, sources: &[f64], b: &mut [f64]) -> Result<(), Singular> {
        self.factor_stamped(sources)?;
        self.solve(b);
        Ok(())
    }
}
