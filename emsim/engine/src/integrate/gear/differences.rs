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
use super::{MOST, POINTS};
use crate::twice::{twice, LANES};

/// The predictor of the highest order reads so many.
pub const ROWS: usize = MOST + 1;

/// beta_1, beta_2, ... towards t, as far as there are points: the first `len` of `times`, newest first.
pub fn towards(t: f64, times: &[f64; POINTS], len: usize) -> [f64; ROWS] {
    // all quotients at once; those of points that are not there are left out
    let quotients: [f64; ROWS - 1] = std::array::from_fn(|i| (t - times[i]) / (times[0] - times[i + 1]));
    let mut beta = [1.0; ROWS];
    for i in 1..ROWS.min(len) {
        beta[i] = beta[i - 1] * quotients[i - 1];
    }
    beta
}

/// n quantities and what fills their last block.
pub fn whole(n: usize) -> usize {
    n.next_multiple_of(LANES)
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

    /// out = sum over differences, with a weight each; out may have whole blocks.
    pub fn sum(&self, weights: &[f64], out: &mut [f64]) {
        sum(&self.blocks, weights, out);
    }

    /// The point y is the newest: differences over `beta.len()` points behind it are renewed.
    pub fn push(&mut self, beta: &[f64], y: &[f64]) {
        push(&mut self.blocks, beta, y);
    }

    /// phi_{row + 1} of quantity i.
    pub fn phi(&self, row: usize, i: usize) -> f64 {
        self.blocks[i / LANES][row.min(ROWS - 1)][i % LANES]
    }

    /// Largest |e + factor phi_{row + 1}| times the scale, of all quantities, for a first factor and row, for none, and for a second; e
    /// and scales of whole blocks.
    pub fn largest(&self, e: &[f64], scales: &[f64], of: [(f64, usize); 2]) -> [f64; 3] {
        largest(&self.blocks, e, scales, of)
    }
}

/// The same with the number of weights known to the compiler: the loops over them unrolled, the sums in registers.
macro_rules! counted {
    ($weights:ident, $with:ident($($arg:expr),*)) => {
        match $weights.len() {
            1 => $with::<1>($($arg),*),
            2 => $with::<2>($($arg),*),
            3 => $with::<3>($($arg),*),
            4 => $with::<4>($($arg),*),
            5 => $with::<5>($($arg),*),
            6 => $with::<6>($($arg),*),
            7 => $with::<7>($($arg),*),
            _ => $with::<0>($($arg),*),
        }
    };
}

twice! {
    fn sum(blocks: &[Block], weights: &[f64], out: &mut [f64]) {
        counted!(weights, sum_of(blocks, weights, out))
    }
}

#[inline(always)]
fn sum_of<const M: usize>(blocks: &[Block], weights: &[f64], out: &mut [f64]) {
    let weights: [f64; M] = std::array::from_fn(|m| weights[m]);
    for (block, out) in blocks.iter().zip(out.chunks_mut(LANES)) {
        let mut sum = [0.0; LANES];
        for m in 0..M {
            sum = std::array::from_fn(|k| sum[k] + weights[m] * block[m][k]);
        }
        match <&mut [f64; LANES]>::try_from(&mut *out) {
            Ok(out) => *out = sum,
            Err(_) => out.iter_mut().zip(sum).for_each(|(out, sum)| *out = sum),
        }
    }
}

twice! {
    fn push(blocks: &mut [Block], beta: &[f64], y: &[f64]) {
        counted!(beta, push_behind(blocks, beta, y))
    }
}

#[inline(always)]
fn push_behind<const M: usize>(blocks: &mut [Block], beta: &[f64], y: &[f64]) {
    let beta: [f64; M] = std::array::from_fn(|m| beta[m]);
    for (block, y) in blocks.iter_mut().zip(y.chunks(LANES)) {
        let mut carry = lanes(y);
        for m in 0..M {
            let old = std::mem::replace(&mut block[m], carry);
            carry = std::array::from_fn(|k| carry[k] - beta[m] * old[k]);
        }
        if let Some(phi) = block.get_mut(M) {
            *phi = carry;
        }
    }
}

twice! {
    fn largest(blocks: &[Block], e: &[f64], scales: &[f64], of: [(f64, usize); 2]) -> [f64; 3] {
        let [below, above] = of;
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let (low, high) = (below.1.min(ROWS - 1), above.1.min(ROWS - 1));
        // each in its own register
        let (mut under, mut own, mut over) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for ((block, e), scales) in blocks.iter().zip(e.chunks_exact(LANES)).zip(scales.chunks_exact(LANES)) {
            let (e, scales) = (lanes(e), lanes(scales));
            let held = |worst: [f64; LANES], missed: [f64; LANES]| -> [f64; LANES] {
                std::array::from_fn(|k| larger(missed[k].abs() * scales[k], worst[k]))
            };
            own = held(own, e);
            under = held(under, std::array::from_fn(|k| e[k] + below.0 * block[low][k]));
            over = held(over, std::array::from_fn(|k| e[k] + above.0 * block[high][k]));
        }
        [under, own, over].map(|lanes| larger(larger(lanes[0], lanes[1]), larger(lanes[2], lanes[3])))
    }
}

/// So many numbers of a vector, or what is left of it and zeros.
#[inline(always)]
fn lanes(y: &[f64]) -> [f64; LANES] {
    y.try_into().unwrap_or_else(|_| std::array::from_fn(|k| y.get(k).copied().unwrap_or(0.0)))
}
