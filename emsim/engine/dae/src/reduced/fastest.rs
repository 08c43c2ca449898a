//! The fastest eigenvalue of f(y, t), roughly: is an explicit step limited by stability?
use super::{Point, Reduced};
use crate::waves::Wave;

impl Reduced {
    /// Size of the fastest eigenvalue at the y of the point, by power iterations, and whether it is a damped mode's; None where the
    /// rates cannot be evaluated.
    pub fn fastest(&self, p: &mut Point, waves: &[Wave], t: f64) -> Option<(f64, bool)> {
        let y0 = self.y(p).to_vec();
        let (mut f0, mut f1) = (vec![0.0; y0.len()], vec![0.0; y0.len()]);
        self.rates(p, waves, t, false, &mut f0).ok()?;
        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let size = 1e-6 * norm(&y0).max(1e-6 * norm(&f0)).max(1e-12);
        let mut direction: Vec<f64> = (0..y0.len()).map(|i| if i % 2 == 0 { 1.0 } else { -0.7 }).collect();
        let (mut fastest, mut damped) = (0.0, false);
        // each takes from the other eigenvalues by their ratio to the largest: of one half as large 1/64 is left
        for _ in 0..6 {
            let scale = size / norm(&direction).max(1e-300);
            for ((y, y0), d) in self.y(p).iter_mut().zip(&y0).zip(&direction) {
                *y = y0 + scale * d;
            }
            self.rates(p, waves, t, false, &mut f1).ok()?;
            let mut along = 0.0;
            for ((d, f1), f0) in direction.iter_mut().zip(&f1).zip(&f0) {
                along += scale * *d * (f1 - f0);
                *d = f1 - f0;
            }
            fastest = norm(&direction) / size;
            damped = along < -0.5 * fastest * size * size;
            if !fastest.is_finite() {
                return None;
            }
        }
        Some((fastest, damped))
    }
}
