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
//! and one difference more: every order's error from the same numbers. States and charges are gone through together: a step does so
//! three times, to foresee, to judge, and to remember. Vectors are of whole blocks.
use super::{MOST, POINTS};
use crate::multiversion::{by_lanes, each, in_blocks, in_blocks_mut, whole, Lanes, LANES};
use crate::tolerances::Norm;

/// The predictor of the highest order reads so many.
pub const ROWS: usize = MOST + 1;

by_lanes! {
    /// beta_1, beta_2, ... towards t, as far as there are points: the first `len` of `times`, newest first.
    pub fn towards<L>(t: f64, times: &[f64; POINTS], len: usize) -> [f64; ROWS] { towards_by::<L>(t, times, len) }
}

#[inline(always)]
pub fn towards_by<L: Lanes>(t: f64, times: &[f64; POINTS], len: usize) -> [f64; ROWS] {
    // all quotients at once; those of points that are not there are left out
    let mut quotients = [0.0; POINTS];
    for k in [0, POINTS - LANES - 1] {
        ((L::all(t) - L::at(times, k)) / (L::all(times[0]) - L::at(times, k + 1))).put(&mut quotients, k);
    }
    let mut betas = [1.0; ROWS];
    for i in 1..ROWS.min(len) {
        betas[i] = betas[i - 1] * quotients[i - 1];
    }
    betas
}

/// The a of the formula of order k with a share of the next one's last term, and the weights of past charges in its r.
#[inline(always)]
pub fn slope<L: Lanes>(t: f64, times: &[f64; POINTS], betas: &[f64; ROWS], k: usize, next: f64) -> (f64, [f64; ROWS]) {
    let mut inverse = [0.0; POINTS];
    for k in [0, POINTS - LANES] {
        (L::all(1.0) / (L::all(t) - L::at(times, k))).put(&mut inverse, k);
    }
    let (mut a, mut weights) = (0.0, [0.0; ROWS]);
    for m in (0..ROWS).rev() {
        let share = if m < k { 1.0 } else { next };
        a += if m <= k { share * inverse[m] } else { 0.0 };
        weights[m] = -a * betas[m];
    }
    (a, weights)
}

/// With the number of weights known to the compiler: loops over them unrolled, sums in registers.
macro_rules! counted {
    ($weights:ident, $with:ident::<$lanes:ident>($($arg:expr),*)) => {
        match $weights.len() {
            1 => $with::<$lanes, 1>($($arg),*),
            2 => $with::<$lanes, 2>($($arg),*),
            3 => $with::<$lanes, 3>($($arg),*),
            4 => $with::<$lanes, 4>($($arg),*),
            5 => $with::<$lanes, 5>($($arg),*),
            6 => $with::<$lanes, 6>($($arg),*),
            7 => $with::<$lanes, 7>($($arg),*),
            _ => $with::<$lanes, 0>($($arg),*),
        }
    };
}

/// phi_1, phi_2, ... of states and of charges.
pub struct Differences {
    states: Vec<Block>,
    charges: Vec<Block>,
}

type Block = [[f64; LANES]; ROWS];

impl Differences {
    pub fn new(n: usize) -> Differences {
        let blocks = vec![[[0.0; LANES]; ROWS]; whole(n) / LANES];
        Differences { states: blocks.clone(), charges: blocks }
    }

    /// out = sum over differences of states, with a weight each.
    pub fn sum(&self, weights: &[f64], out: &mut [f64]) {
        sum(&self.states, weights, out);
    }

    /// The same with `betas` to two places, and of charges with other weights, of which there may be fewer.
    #[inline(always)]
    pub fn foresee<L: Lanes>(&self, betas: &[f64], weights: &[f64; ROWS], to: [&mut [f64]; 3]) {
        counted!(betas, foresee_by::<L>(self, betas, weights, to))
    }

    /// The point x, q is the newest: differences over `betas.len()` points behind it are renewed.
    pub fn push(&mut self, betas: &[f64], point: [&[f64]; 2]) {
        push(self, betas, point);
    }

    /// State i of the newest point.
    pub fn newest(&self, i: usize) -> f64 {
        self.phi(0, i)
    }

    /// phi_{row + 1} of state i.
    pub fn phi(&self, row: usize, i: usize) -> f64 {
        self.states[i / LANES][row.min(ROWS - 1)][i % LANES]
    }

    /// What was predicted becomes what that lacks of x1; of this e the largest |e + factor phi_{row + 1}| over the weights of x1 and the
    /// newest point, and their noise, for a first factor and row, for none, and for a second.
    #[inline(always)]
    pub fn judge<L: Lanes>(
        &self,
        predicted: &mut [f64],
        x1: &[f64],
        noise: &[f64],
        norm: Norm<'_>,
        of: [(f64, usize); 2],
    ) -> [f64; 3] {
        let states = &self.states;
        let [below, above] = of;
        let (low, high) = (below.1.min(ROWS - 1), above.1.min(ROWS - 1));
        let (n, [share, peak, floor]) = (states.len(), norm.rows());
        let [x1, noise, share, peak, floor] = [x1, noise, share, peak, floor].map(|v| &in_blocks(v)[..n]);
        let predicted = &mut in_blocks_mut(predicted)[..n];
        // each in its own register
        let (mut under, mut own, mut over) = (L::all(0.0), L::all(0.0), L::all(0.0));
        for k in 0..n {
            let block = &states[k];
            let [x1, noise, share, peak, floor] = [x1, noise, share, peak, floor].map(|v| L::at(&v[k], 0));
            let e = x1 - L::at(&predicted[k], 0);
            e.put(&mut predicted[k], 0);
            let scale = norm.inverse([share, peak, floor], [x1, L::at(&block[0], 0)], noise);
            own = (e.abs() * scale).larger(own);
            under = ((e + L::all(below.0) * L::at(&block[low], 0)).abs() * scale).larger(under);
            over = ((e + L::all(above.0) * L::at(&block[high], 0)).abs() * scale).larger(over);
        }
        [under.largest(), own.largest(), over.largest()]
    }
}

/// The first M numbers, each throughout a register.
#[inline(always)]
fn spread<L: Lanes, const M: usize>(weights: &[f64]) -> [L; M] {
    let mut spread = [L::all(0.0); M];
    for m in 0..M {
        spread[m] = L::all(weights[m]);
    }
    spread
}

#[inline(always)]
fn weighted<L: Lanes, const M: usize>(block: &Block, weights: &[L; M]) -> L {
    let mut sum = L::all(0.0);
    for m in 0..M {
        sum = sum + weights[m] * L::at(&block[m], 0);
    }
    sum
}

by_lanes! {
    fn sum<L>(blocks: &[Block], weights: &[f64], out: &mut [f64]) {
        counted!(weights, sum_of::<L>(blocks, weights, out))
    }
}

#[inline(always)]
fn sum_of<L: Lanes, const M: usize>(blocks: &[Block], weights: &[f64], out: &mut [f64]) {
    let weights = spread::<L, M>(weights);
    for (block, out) in blocks.iter().zip(out.chunks_mut(LANES)) {
        let sum = weighted(block, &weights);
        if out.len() == LANES {
            sum.put(out, 0);
        } else {
            out.copy_from_slice(&each(sum)[..out.len()]);
        }
    }
}

#[inline(always)]
fn foresee_by<L: Lanes, const M: usize>(
    behind: &Differences,
    betas: &[f64],
    weights: &[f64; ROWS],
    [there, guess, r]: [&mut [f64]; 3],
) {
    let n = behind.states.len();
    let (states, charges) = (&behind.states[..], &behind.charges[..n]);
    let [there, guess, r] = [there, guess, r].map(|v| &mut in_blocks_mut(v)[..n]);
    let (betas, weights) = (spread::<L, M>(betas), spread::<L, M>(weights));
    for k in 0..n {
        let (x, q) = (weighted(&states[k], &betas), weighted(&charges[k], &weights));
        x.put(&mut there[k], 0);
        x.put(&mut guess[k], 0);
        q.put(&mut r[k], 0);
    }
}

by_lanes! {
    fn push<L>(behind: &mut Differences, betas: &[f64], point: [&[f64]; 2]) {
        counted!(betas, push_both::<L>(behind, betas, point))
    }
}

#[inline(always)]
fn push_both<L: Lanes, const M: usize>(behind: &mut Differences, betas: &[f64], [x, q]: [&[f64]; 2]) {
    let betas = spread::<L, M>(betas);
    let n = behind.states.len();
    let (states, charges) = (&mut behind.states[..], &mut behind.charges[..n]);
    let [x, q] = [x, q].map(|v| &in_blocks(v)[..n]);
    for k in 0..n {
        renew(&mut states[k], &betas, L::at(&x[k], 0));
        renew(&mut charges[k], &betas, L::at(&q[k], 0));
    }
}

#[inline(always)]
fn renew<L: Lanes, const M: usize>(block: &mut Block, beta: &[L; M], newest: L) {
    let mut carry = newest;
    for m in 0..M {
        let old = L::at(&block[m], 0);
        carry.put(&mut block[m], 0);
        carry = carry - beta[m] * old;
    }
    if M < ROWS {
        carry.put(&mut block[M], 0);
    }
}
