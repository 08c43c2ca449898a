//! Values that another system gives: polynomials in time on a window, written in place of the last waves.

/// Of every polynomial.
pub const DEGREE: usize = 7;

/// sum_k c_k s^k with s = (t - centre)/half.
#[derive(Clone, Copy, Default, Debug)]
pub struct Polynomial(pub [f64; DEGREE + 1]);

impl Polynomial {
    pub fn at(&self, s: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * s + c)
    }
}

#[derive(Clone, Default, Debug)]
pub struct ExchangedInputs {
    pub first: usize, // wave that the first one replaces
    pub centre: f64,
    pub half: f64,
    pub values: Vec<Polynomial>,
}

impl ExchangedInputs {
    pub fn place(&self, t: f64) -> f64 {
        (t - self.centre) / self.half
    }

    #[inline]
    pub fn write(&self, t: f64, waves: &mut [f64]) {
        if self.values.is_empty() {
            return;
        }
        let s = self.place(t);
        for (wave, p) in waves[self.first..].iter_mut().zip(&self.values) {
            *wave = p.at(s);
        }
    }
}
