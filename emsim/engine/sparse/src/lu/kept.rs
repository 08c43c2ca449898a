//! Factors of several step lengths, kept beside the present ones: a linear circuit comes back to the same lengths.
use super::{Lu, Scalar};

impl<T: Scalar> Lu<T> {
    /// The present factors are to be found again by `key`, until eight others have been kept since they were last asked for. Not
    /// those that cost no more than a solution, nor such as are left behind by other pivots.
    pub fn keep(&mut self, key: f64) {
        if self.ready && self.operations() > 2 * self.nnz() {
            let room = if self.kept.len() < 8 { None } else { self.kept.pop_back() };
            let mut lu = room.map_or_else(Vec::new, |(_, lu)| lu);
            lu.clone_from(&self.lu);
            self.kept.push_front((key, lu));
        }
    }

    /// The keys of what is kept.
    pub fn kept(&self) -> impl Iterator<Item = f64> + '_ {
        self.kept.iter().map(|&(key, _)| key)
    }

    /// Factors that were kept by this very key become the present ones. False where there are none.
    pub fn recall(&mut self, key: f64) -> bool {
        let found = self.kept.iter().position(|kept| kept.0 == key).and_then(|at| self.kept.remove(at));
        let Some((key, lu)) = found else { return false };
        self.lu.clone_from(&lu);
        self.kept.push_front((key, lu));
        self.ready = true;
        true
    }
}
