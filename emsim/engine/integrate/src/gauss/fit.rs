//! What Gauss's methods cannot do: without damping, |R(infinity)| = 1, nothing brings an index-2 unknown back, and what is
//! stiff rings from step to step instead of decaying.
use super::Gauss;
use crate::newton::Failure;
use crate::sparse::Complex;
use crate::system::{System, Work};

/// Steps that have shrunk to this part of the longest one and stay there for so many attempts will not grow again.
pub const CRAWLS: f64 = 1e-4;
pub const PATIENCE: usize = 2000;

pub fn stiff() -> Failure {
    Failure::Unfit { why: "what decays fast rings under gauss, which damps nothing".into() }
}

impl Gauss {
    /// A current that is the derivative of a given voltage grows with 1/h where nothing else moves it: index 2, which without
    /// damping no projection saves.
    pub(super) fn check(&mut self, sys: &System, w: &mut Work, h: f64) -> Result<(), Failure> {
        let mut sizes = Vec::new();
        // so short that nothing else moves
        for factor in [1e-6, 1e-7] {
            self.factor(sys, w, factor * h)?;
            for (i, z) in self.z.iter_mut().enumerate() {
                *z = Complex::from(1.0 + 0.37 * ((i * 7) % 5) as f64);
            }
            self.matrices.complex[0].solve(&mut self.z);
            sizes.push(self.z.iter().map(|z| z.abs()).collect::<Vec<f64>>());
        }
        let grown = |i: usize| sizes[1][i] > 5.0 * sizes[0][i];
        match (0..sys.n).find(|&i| grown(i) && !sys.unknowns[i].kind.enters_linearly()) {
            Some(i) => {
                let what = "a loop of capacitors and voltage sources, or a cut of inductors and current sources";
                let name = &sys.unknowns[i].name;
                Err(Failure::Unfit { why: format!("{what} (`{name}`): gauss has no damping for it") })
            }
            None => Ok(()),
        }
    }
}
