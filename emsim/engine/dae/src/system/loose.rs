//! Which rows come and go with what touches.
use super::{Kind, System, LARGEST};
use crate::model::{Form, LawSpec};

impl System {
    /// Rows of what touches, those of the identity while it does not; none of a system whose factors are programs.
    pub fn loose_rows(&self) -> Vec<usize> {
        let touch = |law: &&LawSpec| law.form == Form::Corner || law.normal.is_some();
        let mut rows: Vec<usize> = self.laws.list.iter().filter(touch).map(|law| law.row).collect();
        if rows.is_empty() || self.n <= LARGEST {
            return Vec::new();
        }
        rows.extend((0..self.n).filter(|&k| self.unknowns[k].kind == Kind::Mu));
        rows
    }
}
