//! Collocation's simplified Newton method: T^-1 A^-1 T splits the equations of all stages into real and complex ones of the size of x,
//! (gamma/h C + G) and ((alpha + i beta)/h C + G), by the eigenvalues of A^-1 (Hairer and Wanner 1996, section IV.8).
use crate::newton::Failure;
use crate::sparse::{Complex, Lu};
use crate::system::{System, Work};

/// Of A^-1: a real one where the number of stages is odd, and pairs alpha +- i beta.
pub struct Eigenvalues<'a> {
    pub gamma: Option<f64>,
    pub alpha: &'a [f64],
    pub beta: &'a [f64],
}

/// The Jacobian, and the factors for a step.
pub struct Split {
    pub at: f64, // time of the Jacobian
    pub gv: Vec<f64>,
    pub cv: Vec<f64>,
    pub slopes: Vec<(f64, f64)>, // of the diodes in these
    pub real: Lu<f64>,
    pub real_matrix: Vec<f64>,
    pub complex: Vec<Lu<Complex>>, // one for each pair of eigenvalues, made when first needed
    complex_matrix: Vec<Complex>,
    factored: Option<(f64, usize)>, // step and number of pairs
}

impl Split {
    pub fn new(sys: &System) -> Result<Split, Failure> {
        let zeros = || vec![0.0; sys.pattern.rowidx.len()];
        Ok(Split {
            at: f64::NAN,
            gv: zeros(),
            cv: zeros(),
            slopes: Vec::new(),
            real: Lu::new(sys.symbolic().map_err(Failure::from)?),
            real_matrix: zeros(),
            complex: Vec::new(),
            complex_matrix: vec![Complex::from(0.0); sys.pattern.rowidx.len()],
            factored: None,
        })
    }

    pub fn forget(&mut self) {
        (self.at, self.factored) = (f64::NAN, None);
    }

    /// The derivatives that were just evaluated.
    pub fn keep(&mut self, sys: &System, w: &Work) {
        self.gv.copy_from_slice(&w.gv);
        self.cv.copy_from_slice(&w.cv);
        self.slopes.clear();
        self.slopes.extend(sys.slopes(w));
        self.factored = None;
    }

    pub fn factor(&mut self, sys: &System, w: &mut Work, h: f64, of: &Eigenvalues) -> Result<(), Failure> {
        let asked = Some((h, of.alpha.len()));
        if self.factored == asked {
            return Ok(());
        }
        self.factored = None;
        if let Some(gamma) = of.gamma {
            let a = gamma / h;
            for ((m, g), c) in self.real_matrix.iter_mut().zip(&self.gv).zip(&self.cv) {
                *m = g + a * c;
            }
            self.real.factor_or_refactor(&self.real_matrix).map_err(Failure::from)?;
        }
        for (k, (alpha, beta)) in of.alpha.iter().zip(of.beta).enumerate() {
            if self.complex.len() == k {
                self.complex.push(Lu::new(sys.symbolic().map_err(Failure::from)?));
            }
            let z = Complex::new(alpha / h, beta / h);
            for ((m, g), c) in self.complex_matrix.iter_mut().zip(&self.gv).zip(&self.cv) {
                *m = Complex::new(g + z.re * c, z.im * c);
            }
            self.complex[k].factor_or_refactor(&self.complex_matrix).map_err(Failure::from)?;
        }
        w.counters.factorisations += (of.alpha.len() + usize::from(of.gamma.is_some())) as u64;
        self.factored = asked;
        Ok(())
    }

    /// Solves for the right-hand sides, the complex ones as many as there are pairs.
    pub fn solve(&mut self, b: &mut [f64], z: &mut [Vec<Complex>], w: &mut Work) {
        self.real.solve(b);
        for (lu, z) in self.complex.iter_mut().zip(&mut *z) {
            lu.solve(z);
        }
        w.counters.solves += 1 + z.len() as u64;
    }
}
