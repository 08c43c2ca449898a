//! What is constant and what time alone decides, by themselves.
use super::{System, Work};

impl System {
    #[inline]
    pub fn subtract_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.f_wave {
            out[row] -= coefficient * w.waves[k];
        }
    }

    #[inline]
    pub fn add_waves(&self, w: &Work, out: &mut [f64]) {
        for &(row, k, coefficient) in &self.f_wave {
            out[row] += coefficient * w.waves[k];
        }
    }

    /// q = C x of the constant part of C: all of Q where the equations are linear.
    #[inline]
    pub fn charges_of(&self, x: &[f64], q: &mut [f64]) {
        assert!(q.len() == self.n);
        self.c_rows.times(&self.c_rows.value, x, |row, v| q[row] = v);
    }
}
