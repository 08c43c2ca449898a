//! Values between recorded points: the limited cubic that `interpolate.py` describes, its (1).

/// A signal at its points: x ascending, repeated where y jumps; corners ascending, times at which it may bend.
#[derive(Clone, Copy)]
pub struct Points<'a> {
    pub x: &'a [f64],
    pub y: &'a [f64],
    pub corners: &'a [f64],
}

impl Points<'_> {
    /// The value at t, x[0] <= t <= x[last]; nan without a point.
    pub fn at(&self, t: f64) -> f64 {
        let (x, y) = (self.x, self.y);
        let Some(last) = x.len().checked_sub(1) else { return f64::NAN };
        let behind = x.partition_point(|&a| a <= t);
        if behind == 0 || last == 0 {
            return y[0];
        }
        let k = (behind - 1).min(last - 1);
        if t == x[k + 1] {
            return y[k + 1];
        }
        let width = x[k + 1] - x[k];
        let secant = (y[k + 1] - y[k]) / width;
        let chord = y[k] + secant * (t - x[k]);
        let (mut a, mut b) = (self.bend(k, self.corners), self.bend(k + 1, self.corners));
        let mut few = a.is_none() && b.is_none();
        if few {
            // what the other sides of two corners tell is better than nothing
            (a, b) = (self.bend(k, &[]), self.bend(k + 1, &[]));
        }
        let (near, other, c) = match (a, b) {
            (Some(a), Some(b)) => (a, b, a + (b - a) * (t - x[k - 1]) / (x[k + 2] - x[k - 1])),
            (None, Some(near)) if !few => {
                let far = self.bend(k + 2, self.corners);
                few = far.is_none();
                let other = far.unwrap_or(near);
                (near, other, near + (other - near) * (t - x[k + 2]) / (x[(k + 3).min(last)] - x[k]))
            }
            (Some(near), None) if !few => {
                let far = k.checked_sub(1).and_then(|before| self.bend(before, self.corners));
                few = far.is_none();
                let other = far.unwrap_or(near);
                (near, other, near + (near - other) * (t - x[k - 1]) / (x[k + 1] - x[k.max(2) - 2]))
            }
            _ => return chord,
        };
        if !(near * other > 0.0) {
            return chord;
        }
        let mut limit = 3.0 * near.abs().min(other.abs());
        if few {
            limit = limit.min(secant.abs() / width);
        }
        chord + c.min(limit).max(-limit) * (t - x[k]) * (t - x[k + 1])
    }

    /// The second divided difference about point k; None where there is none.
    fn bend(&self, k: usize, corners: &[f64]) -> Option<f64> {
        let (x, y) = (self.x, self.y);
        if k == 0 || k + 1 >= x.len() {
            return None;
        }
        let (left, right) = (x[k] - x[k - 1], x[k + 1] - x[k]);
        let edge = corners.get(corners.partition_point(|&c| c < x[k])) == Some(&x[k]);
        // neighbours so much closer together than to the next point are two sides of a jump
        if left <= 1e-6 * right || right <= 1e-6 * left || edge {
            return None;
        }
        Some(((y[k + 1] - y[k]) / right - (y[k] - y[k - 1]) / left) / (x[k + 1] - x[k - 1]))
    }
}
