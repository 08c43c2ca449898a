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
use crate::twice::twice;

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
    blocks: Vec<Block>,
}

type Block = [[f64; LANES]; ROWS];

impl Differences {
    pub fn new(n: usize) -> Differences {
        Differences { blocks: vec![[[0.0; LANES]; ROWS]; n.div_ceil(LANES)] }
    }

    /// One point, nothing behind it.
    pub fn start(&mut self, y: &[f64]) {
        self.push(&[], y);
    }

    /// out = sum over differences, with a weight each.
    pub fn sum(&self, weights: &[f64], out: &mut [f64]) {
        sum(&self.blocks, weights, out);
    }

    /// The point y is the newest: differences over `beta.len()` points behind it are renewed.
    pub fn push(&mut self, beta: &[f64], y: &[f64]) {
        push(&mut self.blocks, beta, y);
    }

    /// Largest |e + factor phi_{row + 1}| over the weight, of all quantities, for three factors and rows.
    pub fn largest(&self, e: &[f64], weights: &[f64], of: [(f64, usize); 3]) -> [f64; 3] {
        largest(&self.blocks, e, weights, of)
    }
}

twice! {
    fn sum(blocks: &[Block], weights: &[f64], out: &mut [f64]) {
        for (block, out) in blocks.iter().zip(out.chunks_mut(LANES)) {
            let mut sum = [0.0; LANES];
            for (weight, phi) in weights.iter().zip(block) {
                sum = std::array::from_fn(|k| sum[k] + weight * phi[k]);
            }
            match <&mut [f64; LANES]>::try_from(&mut *out) {
                Ok(out) => *out = sum,
                Err(_) => out.iter_mut().zip(sum).for_each(|(out, sum)| *out = sum),
            }
        }
    }
}

twice! {
    fn push(blocks: &mut [Block], beta: &[f64], y: &[f64]) {
        for (block, y) in blocks.iter_mut().zip(y.chunks(LANES)) {
            let mut carry = lanes(y, 0.0);
            for (beta, phi) in beta.iter().zip(block.iter_mut()) {
                let old = std::mem::replace(phi, carry);
                carry = std::array::from_fn(|k| carry[k] - beta * old[k]);
            }
            if let Some(phi) = block.get_mut(beta.len()) {
                *phi = carry;
            }
        }
    }
}

twice! {
    fn largest(blocks: &[Block], e: &[f64], weights: &[f64], of: [(f64, usize); 3]) -> [f64; 3] {
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let of = of.map(|(factor, row)| (factor, row.min(ROWS - 1)));
        let mut worst = [[0.0; LANES]; 3];
        for ((block, e), weights) in blocks.iter().zip(e.chunks(LANES)).zip(weights.chunks(LANES)) {
            let (e, weights) = (lanes(e, 0.0), lanes(weights, 1.0));
            for (worst, (factor, row)) in worst.iter_mut().zip(of) {
                let v: [f64; LANES] = std::array::from_fn(|k| (e[k] + factor * block[row][k]).abs() / weights[k]);
                *worst = std::array::from_fn(|k| larger(v[k], worst[k]));
            }
        }
        worst.map(|lanes| lanes.into_iter().fold(0.0, |worst, v| larger(v, worst)))
    }
}

/// So many numbers of a vector, or what is left of it and `none` for the rest.
#[inline(always)]
fn lanes(y: &[f64], none: f64) -> [f64; LANES] {
    y.try_into().unwrap_or_else(|_| std::array::from_fn(|k| y.get(k).copied().unwrap_or(none)))
}
