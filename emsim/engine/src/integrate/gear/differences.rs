//! What a multistep method remembers, as modified divided differences (Krogh 1974; Brenan, Campbell and Petzold 1996,
//! section 5.2): with the past points at t_0 > t_1 > ...
//!
//!   phi_i = (t_0 - t_1) ... (t_0 - t_{i-1}) y[t_0, ..., t_{i-1}],      phi_1 = y_0
//!
//! Towards a new point at t the polynomial through the last m points is  sum_{i<=m} beta_i phi_i, with
//!
//!   beta_i = (t - t_0) ... (t - t_{i-2}) / ((t_0 - t_1) ... (t_0 - t_{i-1}))
//!
//! so that one division a point is all that unequal steps cost, and what m points miss of the new value is what m + 1 miss
//! and one difference more: every order's error from the same numbers.
use super::MOST;

/// The predictor of the highest order reads so many.
pub const ROWS: usize = MOST + 1;
/// Quantities that go through the registers together.
const LANES: usize = 4;

/// beta_1, beta_2, ... towards t, as far as there are points; `times` newest first.
pub fn towards(t: f64, times: &[f64]) -> [f64; ROWS] {
    let mut beta = [1.0; ROWS];
    for i in 1..ROWS.min(times.len()) {
        beta[i] = beta[i - 1] * (t - times[i - 1]) / (times[0] - times[i]);
    }
    beta
}

/// phi_1, phi_2, ... of n quantities.
pub struct Differences {
    blocks: Vec<[[f64; LANES]; ROWS]>,
}

impl Differences {
    pub fn new(n: usize) -> Differences {
        Differences { blocks: vec![[[0.0; LANES]; ROWS]; n.div_ceil(LANES)] }
    }

    /// phi_{k + 1} of quantity i, by k.
    #[inline(always)]
    pub fn of(&self, i: usize) -> impl Fn(usize) -> f64 + '_ {
        let block = &self.blocks[i / LANES];
        move |k| block[k][i % LANES]
    }

    /// One point, nothing behind it.
    pub fn start(&mut self, y: &[f64]) {
        self.push(&[], y);
    }

    /// out = sum over differences, with a weight each.
    pub fn sum(&self, weights: &[f64], out: &mut [f64]) {
        for (block, out) in self.blocks.iter().zip(out.chunks_mut(LANES)) {
            let mut sum = [0.0; LANES];
            for (weight, phi) in weights.iter().zip(block) {
                for (s, phi) in sum.iter_mut().zip(phi) {
                    *s += weight * phi;
                }
            }
            match <&mut [f64; LANES]>::try_from(&mut *out) {
                Ok(out) => *out = sum,
                Err(_) => (0..LANES).for_each(|lane| {
                    if let Some(o) = out.get_mut(lane) {
                        *o = sum[lane];
                    }
                }),
            }
        }
    }

    /// The point y is the newest: differences over `beta.len()` points behind it are renewed.
    pub fn push(&mut self, beta: &[f64], y: &[f64]) {
        for (block, y) in self.blocks.iter_mut().zip(y.chunks(LANES)) {
            let mut carry: [f64; LANES] = match y.try_into() {
                Ok(y) => y,
                Err(_) => std::array::from_fn(|lane| y.get(lane).copied().unwrap_or(0.0)),
            };
            for (&beta, phi) in beta.iter().zip(block.iter_mut()) {
                let old = std::mem::replace(phi, carry);
                for (c, old) in carry.iter_mut().zip(old) {
                    *c -= beta * old;
                }
            }
            if let Some(phi) = block.get_mut(beta.len()) {
                *phi = carry;
            }
        }
    }
}
