//! Sums over stages, four unknowns at a time: T^-1 before the split systems, T behind them, polynomials through the stages.
//! Each unknown's sums are of the same terms in the same order, whatever stands beside it.
use super::tables::Scheme;
use crate::sparse::Complex;
use crate::twice::twice;

/// Unknowns that go through the registers together.
const LANES: usize = 4;

/// The same with the number of stages known to the compiler.
macro_rules! by_stages {
    ($scheme:expr, $with:ident($($arg:expr),*)) => {
        match $scheme.s {
            3 => $with::<3>($($arg),*),
            5 => $with::<5>($($arg),*),
            _ => $with::<7>($($arg),*),
        }
    };
}

/// `$one` for every block of unknowns, and one by one for those that are left.
macro_rules! blocks {
    ($n:expr, $stages:ident, $one:ident($($arg:expr),*)) => {
        let whole = $n - $n % LANES;
        for i in (0..whole).step_by(LANES) {
            $one::<$stages, LANES>(i, $($arg),*);
        }
        for i in whole..$n {
            $one::<$stages, 1>(i, $($arg),*);
        }
    };
}

/// The same where what is written is not read: the last block may begin within the one before.
macro_rules! blocks_over {
    ($n:expr, $stages:ident, $one:ident($($arg:expr),*)) => {
        if $n >= LANES {
            for i in (0..$n - LANES).step_by(LANES) {
                $one::<$stages, LANES>(i, $($arg),*);
            }
            $one::<$stages, LANES>($n - LANES, $($arg),*);
        } else {
            for i in 0..$n {
                $one::<$stages, 1>(i, $($arg),*);
            }
        }
    };
}

#[inline(always)]
fn lanes<const L: usize>(v: &[f64], i: usize) -> [f64; L] {
    let v = &v[i..i + L];
    std::array::from_fn(|l| v[l])
}

/// Sum of weights times what stands at i of each.
#[inline(always)]
fn sum<const S: usize, const L: usize>(weights: &[f64], of: &[[f64; L]; S]) -> [f64; L] {
    let mut sum = of[0].map(|v| weights[0] * v);
    for k in 1..S {
        sum = std::array::from_fn(|l| sum[l] + weights[k] * of[k][l]);
    }
    sum
}

twice! {
    /// Right-hand sides of the split systems: minus T^-1 (F + A^-1 D / h).
    pub fn split(scheme: &Scheme, h: f64, f: &[Vec<f64>], d: &[Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
        by_stages!(scheme, split_of(scheme, h, f, d, b, z))
    }
}

#[inline(always)]
fn split_of<const S: usize>(
    scheme: &Scheme,
    h: f64,
    f: &[Vec<f64>],
    d: &[Vec<f64>],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let n = b.len();
    let f: [&[f64]; S] = std::array::from_fn(|k| &f[k][..n]);
    let d: [&[f64]; S] = std::array::from_fn(|k| &d[k][..n]);
    let over_h = 1.0 / h;
    blocks_over!(n, S, split_at(scheme, over_h, &f, &d, b, z));
}

#[inline(always)]
fn split_at<const S: usize, const L: usize>(
    i: usize,
    scheme: &Scheme,
    over_h: f64,
    f: &[&[f64]; S],
    d: &[&[f64]; S],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let ti = &scheme.ti[..S * S];
    let f: [[f64; L]; S] = std::array::from_fn(|k| lanes(f[k], i));
    let d: [[f64; L]; S] = std::array::from_fn(|k| lanes(d[k], i));
    let of_f = |m: usize| sum(&ti[m * S..(m + 1) * S], &f);
    let of_d = |m: usize| sum(&ti[m * S..(m + 1) * S], &d).map(|v| over_h * v);
    let (r, x) = (of_f(0), of_d(0));
    b[i..i + L].iter_mut().enumerate().for_each(|(l, b)| *b = -(r[l] + scheme.gamma * x[l]));
    for m in 0..(S - 1) / 2 {
        let (alpha, beta) = (scheme.alpha[m], scheme.beta[m]);
        let (re, im) = (of_f(2 * m + 1), of_f(2 * m + 2));
        let (x, y) = (of_d(2 * m + 1), of_d(2 * m + 2));
        for (l, z) in z[m][i..i + L].iter_mut().enumerate() {
            *z = Complex::new(-(re[l] + (alpha * x[l] - beta * y[l])), -(im[l] + (alpha * y[l] + beta * x[l])));
        }
    }
}

twice! {
    /// Right-hand sides where no charge has moved: minus T^-1 F.
    pub fn split_still(scheme: &Scheme, f: &[Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
        by_stages!(scheme, still_of(scheme, f, b, z))
    }
}

#[inline(always)]
fn still_of<const S: usize>(scheme: &Scheme, f: &[Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
    let n = b.len();
    let f: [&[f64]; S] = std::array::from_fn(|k| &f[k][..n]);
    blocks_over!(n, S, still_at(scheme, &f, b, z));
}

#[inline(always)]
fn still_at<const S: usize, const L: usize>(
    i: usize,
    scheme: &Scheme,
    f: &[&[f64]; S],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let ti = &scheme.ti[..S * S];
    let f: [[f64; L]; S] = std::array::from_fn(|k| lanes(f[k], i));
    let of_f = |m: usize| sum(&ti[m * S..(m + 1) * S], &f);
    let r = of_f(0);
    b[i..i + L].iter_mut().enumerate().for_each(|(l, b)| *b = -r[l]);
    for m in 0..(S - 1) / 2 {
        let (re, im) = (of_f(2 * m + 1), of_f(2 * m + 2));
        z[m][i..i + L].iter_mut().enumerate().for_each(|(l, z)| *z = Complex::new(-re[l], -im[l]));
    }
}

twice! {
    /// Adds T w to the stages, w from the solutions of the split systems; `moved`: the largest movement of each unknown, not
    /// a number where one is none.
    pub fn join(scheme: &Scheme, b: &[f64], z: &[Vec<Complex>], stage: &mut [Vec<f64>], moved: &mut [f64]) {
        by_stages!(scheme, join_of(scheme, b, z, stage, moved))
    }
}

#[inline(always)]
fn join_of<const S: usize>(scheme: &Scheme, b: &[f64], z: &[Vec<Complex>], stage: &mut [Vec<f64>], moved: &mut [f64]) {
    let n = b.len();
    blocks!(n, S, join_at(scheme, b, z, stage, moved));
}

#[inline(always)]
fn join_at<const S: usize, const L: usize>(
    i: usize,
    scheme: &Scheme,
    b: &[f64],
    z: &[Vec<Complex>],
    stage: &mut [Vec<f64>],
    moved: &mut [f64],
) {
    let t = &scheme.t[..S * S];
    let w = solutions::<S, L>(i, b, z);
    let mut largest = [0.0; L];
    for (k, stage) in stage[..S].iter_mut().enumerate() {
        let step = sum(&t[k * S..(k + 1) * S], &w);
        for (l, x) in stage[i..i + L].iter_mut().enumerate() {
            *x += step[l];
            // one that is no number stays
            largest[l] = if step[l].abs() <= largest[l] { largest[l] } else { step[l].abs() };
        }
    }
    moved[i..i + L].copy_from_slice(&largest);
}

/// Of each split system in turn, real and imaginary parts.
#[inline(always)]
fn solutions<const S: usize, const L: usize>(i: usize, b: &[f64], z: &[Vec<Complex>]) -> [[f64; L]; S] {
    let mut w = [lanes(b, i); S];
    for m in 0..(S - 1) / 2 {
        let z = &z[m][i..i + L];
        w[2 * m + 1] = std::array::from_fn(|l| z[l].re);
        w[2 * m + 2] = std::array::from_fn(|l| z[l].im);
    }
    w
}

twice! {
    /// What stage k moves from x0: row k of T times the solutions.
    pub fn movement(scheme: &Scheme, k: usize, b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
        by_stages!(scheme, movement_of(scheme, k, b, z, step))
    }
}

#[inline(always)]
fn movement_of<const S: usize>(scheme: &Scheme, k: usize, b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
    let n = b.len();
    let row = &scheme.t[k * S..(k + 1) * S];
    blocks_over!(n, S, movement_at(row, b, z, step));
}

#[inline(always)]
fn movement_at<const S: usize, const L: usize>(i: usize, row: &[f64], b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
    step[i..i + L].copy_from_slice(&sum(row, &solutions::<S, L>(i, b, z)));
}

twice! {
    /// A polynomial through values at the start and at the stages, with Lagrange's weights of all of them.
    pub fn through(scheme: &Scheme, l: &[f64], x0: &[f64], stage: &[Vec<f64>], out: &mut [f64]) {
        by_stages!(scheme, through_of(l, x0, stage, out))
    }
}

#[inline(always)]
fn through_of<const S: usize>(l: &[f64], x0: &[f64], stage: &[Vec<f64>], out: &mut [f64]) {
    let n = out.len();
    let stage: [&[f64]; S] = std::array::from_fn(|k| &stage[k][..n]);
    blocks_over!(n, S, through_at(l, &x0[..n], &stage, out));
}

#[inline(always)]
fn through_at<const S: usize, const L: usize>(i: usize, l: &[f64], x0: &[f64], stage: &[&[f64]; S], out: &mut [f64]) {
    out[i..i + L].copy_from_slice(&from_start::<S, L>(i, l, x0, stage));
}

#[inline(always)]
fn from_start<const S: usize, const L: usize>(i: usize, l: &[f64], x0: &[f64], stage: &[&[f64]; S]) -> [f64; L] {
    let l = &l[..S + 1];
    let mut sum = lanes::<L>(x0, i).map(|v| l[0] * v);
    for k in 0..S {
        let x = lanes::<L>(stage[k], i);
        sum = std::array::from_fn(|m| sum[m] + l[k + 1] * x[m]);
    }
    sum
}

/// Lagrange's weights of the start and the stages, and of the stages alone.
pub type Both<'a> = (&'a [f64], &'a [f64]);

twice! {
    /// The same of what `moves`; of the others that through the stages alone.
    pub fn foretold(scheme: &Scheme, l: Both, x0: &[f64], stage: &[Vec<f64>], moves: &[bool], out: &mut [f64]) {
        by_stages!(scheme, foretold_of(l, x0, stage, moves, out))
    }
}

#[inline(always)]
fn foretold_of<const S: usize>(l: Both, x0: &[f64], stage: &[Vec<f64>], moves: &[bool], out: &mut [f64]) {
    let n = out.len();
    let stage: [&[f64]; S] = std::array::from_fn(|k| &stage[k][..n]);
    blocks_over!(n, S, foretold_at(l, &x0[..n], &stage, &moves[..n], out));
}

#[inline(always)]
fn foretold_at<const S: usize, const L: usize>(
    i: usize,
    l: Both,
    x0: &[f64],
    stage: &[&[f64]; S],
    moves: &[bool],
    out: &mut [f64],
) {
    let whole = from_start::<S, L>(i, l.0, x0, stage);
    let inside = sum::<S, L>(&l.1[..S], &std::array::from_fn(|k| lanes(stage[k], i)));
    let moves = &moves[i..i + L];
    out[i..i + L].copy_from_slice(&std::array::from_fn::<f64, L, _>(|m| if moves[m] { whole[m] } else { inside[m] }));
}
