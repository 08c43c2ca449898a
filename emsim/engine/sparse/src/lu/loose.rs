//! Factors follow loose rows (order/loose.rs) as these come and go.
use super::{Arc, Lu, Scalar};

impl<T: Scalar> Lu<T> {
    /// Loose rows that have become those of the identity leave the pattern, others come back.
    pub(super) fn follow(&mut self, values: &[T]) {
        if let Some(fits) = self.whole.fitting(&self.symbolic, |k| values[k] == T::ZERO) {
            (self.symbolic, self.arranged) = (fits, Arc::default());
            (self.ready, self.leanest, self.borne) = (false, usize::MAX, 0);
        }
    }
}
