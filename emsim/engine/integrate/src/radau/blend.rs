//! Sums over stages, four unknowns at a time: T^-1 before the split systems, T behind them, polynomials through the stages.
//! Each unknown's sums are of the same terms in the same order, whatever stands beside it.
use super::dense::{Table, WIDTH};
use super::tables::Scheme;
use crate::multiversion::{blocks, by_lanes, Lanes, One, LANES};
use crate::sparse::{Complex, Scalar};

/// The same with the number of stages known to the compiler.
macro_rules! by_stages {
    ($scheme:expr, $lanes:ident, $with:ident($($arg:expr),*)) => {
        match $scheme.s {
            3 => $with::<$lanes, 3>($($arg),*),
            5 => $with::<$lanes, 5>($($arg),*),
            _ => $with::<$lanes, 7>($($arg),*),
        }
    };
}

/// `$one` for every block of unknowns, and one by one for those that are left.
macro_rules! blocks_and_rest {
    ($n:expr, $lanes:ident, $stages:ident, $one:ident($($arg:expr),*)) => {
        let whole = $n - $n % $lanes::COUNT;
        for i in (0..whole).step_by($lanes::COUNT) {
            $one::<$lanes, $stages>(i, $($arg),*);
        }
        for i in whole..$n {
            $one::<One, $stages>(i, $($arg),*);
        }
    };
}

/// The same where what is written is not read: the last block may begin within the one before.
macro_rules! blocks_over {
    ($n:expr, $lanes:ident, $stages:ident, $one:ident($($arg:expr),*)) => {
        if $n < $lanes::COUNT {
            for i in 0..$n {
                $one::<One, $stages>(i, $($arg),*);
            }
        } else {
            for i in blocks::<$lanes>($n) {
                $one::<$lanes, $stages>(i, $($arg),*);
            }
        }
    };
}

// Loops and no closures in what follows: what is compiled for a processor's registers does not go into a closure.

/// Sum of weights times numbers.
#[inline(always)]
fn sum<L: Lanes, const S: usize>(weights: &[f64], of: &[L; S]) -> L {
    sum_in((weights, 1, 0), of)
}

/// Weights of each number in turn: column `at` of a table of so wide rows.
type Column<'a> = (&'a [f64], usize, usize);

#[inline(always)]
fn sum_in<L: Lanes, const S: usize>((table, width, at): Column, of: &[L; S]) -> L {
    let table = &table[..(S - 1) * width + at + 1];
    let mut sum = L::all(table[at]) * of[0];
    for k in 1..S {
        sum = sum + L::all(table[k * width + at]) * of[k];
    }
    sum
}

/// What stands in each at i.
#[inline(always)]
fn each<L: Lanes, const S: usize>(of: &[&[f64]; S], i: usize) -> [L; S] {
    let mut each = [L::all(0.0); S];
    for k in 0..S {
        each[k] = L::at(of[k], i);
    }
    each
}

/// Of every stage F, then Q; and Q at the start of the step.
pub type Rows<'a> = (&'a [Vec<f64>], &'a [f64]);

by_lanes! {
    /// What the charges have moved by, D, and the right-hand sides of the split systems: minus T^-1 (F + A^-1 D / h).
    pub fn split<L>(scheme: &Scheme, h: f64, rows: Rows, d: &mut [Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
        by_stages!(scheme, L, split_of(scheme, h, rows, d, b, z))
    }
}

#[inline(always)]
fn split_of<L: Lanes, const S: usize>(
    scheme: &Scheme,
    h: f64,
    (rows, q0): Rows,
    d: &mut [Vec<f64>],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let n = b.len();
    let (f, q): ([&[f64]; S], [&[f64]; S]) =
        (std::array::from_fn(|k| &rows[k][..n]), std::array::from_fn(|k| &rows[k][n..2 * n]));
    let over_h = 1.0 / h;
    blocks_over!(n, L, S, split_at(scheme, over_h, (&f, &q, &q0[..n]), d, b, z));
}

#[inline(always)]
fn split_at<L: Lanes, const S: usize>(
    i: usize,
    scheme: &Scheme,
    over_h: f64,
    (f, q, q0): (&[&[f64]; S], &[&[f64]; S], &[f64]),
    d: &mut [Vec<f64>],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let ti = &scheme.ti[..S * S];
    let (f, mut moved, q0, over_h) = (each::<L, S>(f, i), each::<L, S>(q, i), L::at(q0, i), L::all(over_h));
    for k in 0..S {
        moved[k] = moved[k] - q0;
        moved[k].put(&mut d[k], i);
    }
    (-(sum(ti, &f) + L::all(scheme.gamma) * (over_h * sum(ti, &moved)))).put(b, i);
    for m in 0..(S - 1) / 2 {
        let (alpha, beta) = (L::all(scheme.alpha[m]), L::all(scheme.beta[m]));
        let (first, second) = (&ti[(2 * m + 1) * S..], &ti[(2 * m + 2) * S..]);
        let (re, im) = (sum(first, &f), sum(second, &f));
        let (x, y) = (over_h * sum(first, &moved), over_h * sum(second, &moved));
        let pairs = [-(re + (alpha * x - beta * y)), -(im + (alpha * y + beta * x))];
        L::put_pairs(pairs, Complex::parts_mut(&mut z[m]), i);
    }
}

by_lanes! {
    /// Right-hand sides where no charge has moved: minus T^-1 F.
    pub fn split_still<L>(scheme: &Scheme, f: &[Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
        by_stages!(scheme, L, still_of(scheme, f, b, z))
    }
}

#[inline(always)]
fn still_of<L: Lanes, const S: usize>(scheme: &Scheme, f: &[Vec<f64>], b: &mut [f64], z: &mut [Vec<Complex>]) {
    let n = b.len();
    let f: [&[f64]; S] = std::array::from_fn(|k| &f[k][..n]);
    blocks_over!(n, L, S, still_at(scheme, &f, b, z));
}

#[inline(always)]
fn still_at<L: Lanes, const S: usize>(
    i: usize,
    scheme: &Scheme,
    f: &[&[f64]; S],
    b: &mut [f64],
    z: &mut [Vec<Complex>],
) {
    let ti = &scheme.ti[..S * S];
    let f = each::<L, S>(f, i);
    (-sum(ti, &f)).put(b, i);
    for m in 0..(S - 1) / 2 {
        let pair = [-sum(&ti[(2 * m + 1) * S..], &f), -sum(&ti[(2 * m + 2) * S..], &f)];
        L::put_pairs(pair, Complex::parts_mut(&mut z[m]), i);
    }
}

by_lanes! {
    /// Adds T w to the stages, w from the solutions of the split systems; `moved`: the largest movement of each unknown, no
    /// number where the solutions are none.
    pub fn join<L>(scheme: &Scheme, b: &[f64], z: &[Vec<Complex>], stage: &mut [Vec<f64>], moved: &mut [f64]) {
        by_stages!(scheme, L, join_of(scheme, b, z, stage, moved))
    }
}

#[inline(always)]
fn join_of<L: Lanes, const S: usize>(
    scheme: &Scheme,
    b: &[f64],
    z: &[Vec<Complex>],
    stage: &mut [Vec<f64>],
    moved: &mut [f64],
) {
    let n = b.len();
    blocks_and_rest!(n, L, S, join_at(scheme, b, z, stage, moved));
}

#[inline(always)]
fn join_at<L: Lanes, const S: usize>(
    i: usize,
    scheme: &Scheme,
    b: &[f64],
    z: &[Vec<Complex>],
    stage: &mut [Vec<f64>],
    moved: &mut [f64],
) {
    let t = &scheme.t[..S * S];
    let w = solutions::<L, S>(i, b, z);
    let mut largest = L::all(0.0);
    for k in 0..S {
        let stage = &mut stage[k];
        let step = sum(&t[k * S..], &w);
        (L::at(stage, i) + step).or_nothing().put(stage, i);
        largest = largest.larger(step.abs());
    }
    largest.put(moved, i);
}

/// Of each split system in turn, real and imaginary parts.
#[inline(always)]
fn solutions<L: Lanes, const S: usize>(i: usize, b: &[f64], z: &[Vec<Complex>]) -> [L; S] {
    let mut w = [L::at(b, i); S];
    for m in 0..(S - 1) / 2 {
        [w[2 * m + 1], w[2 * m + 2]] = L::pairs_at(Complex::parts(&z[m]), i);
    }
    w
}

by_lanes! {
    /// What stage k moves from x0: row k of T times the solutions.
    pub fn movement<L>(scheme: &Scheme, k: usize, b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
        by_stages!(scheme, L, movement_of(scheme, k, b, z, step))
    }
}

#[inline(always)]
fn movement_of<L: Lanes, const S: usize>(scheme: &Scheme, k: usize, b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
    let n = b.len();
    let row = &scheme.t[k * S..(k + 1) * S];
    blocks_over!(n, L, S, movement_at(row, b, z, step));
}

#[inline(always)]
fn movement_at<L: Lanes, const S: usize>(i: usize, row: &[f64], b: &[f64], z: &[Vec<Complex>], step: &mut [f64]) {
    sum(row, &solutions::<L, S>(i, b, z)).or_nothing().put(step, i);
}

by_lanes! {
    /// A polynomial through values at the start and at the stages, with Lagrange's weights of all of them.
    pub fn through<L>(scheme: &Scheme, l: &[f64], x0: &[f64], stage: &[Vec<f64>], out: &mut [f64]) {
        by_stages!(scheme, L, through_of(l, x0, stage, out))
    }
}

#[inline(always)]
fn through_of<L: Lanes, const S: usize>(l: &[f64], x0: &[f64], stage: &[Vec<f64>], out: &mut [f64]) {
    let n = out.len();
    let stage: [&[f64]; S] = std::array::from_fn(|k| &stage[k][..n]);
    blocks_over!(n, L, S, through_at(l, &x0[..n], &stage, out));
}

#[inline(always)]
fn through_at<L: Lanes, const S: usize>(i: usize, l: &[f64], x0: &[f64], stage: &[&[f64]; S], out: &mut [f64]) {
    from_start((l, 1, 0), L::at(x0, i), &each::<L, S>(stage, i)).put(out, i);
}

#[inline(always)]
fn from_start<L: Lanes, const S: usize>((table, width, at): Column, x0: L, stage: &[L; S]) -> L {
    let table = &table[..S * width + at + 1];
    let mut sum = L::all(table[at]) * x0;
    for k in 0..S {
        sum = sum + L::all(table[(k + 1) * width + at]) * stage[k];
    }
    sum
}

/// Lagrange's weights of the start and the stages, and of the stages alone.
pub type Both<'a> = (&'a [f64], &'a [f64]);

by_lanes! {
    /// The same of what `moves`; of the others that through the stages alone.
    pub fn foretold<L>(scheme: &Scheme, l: Both, x0: &[f64], stage: &[Vec<f64>], moves: &[bool], out: &mut [f64]) {
        by_stages!(scheme, L, foretold_of(l, x0, stage, moves, out))
    }
}

#[inline(always)]
fn foretold_of<L: Lanes, const S: usize>(l: Both, x0: &[f64], stage: &[Vec<f64>], moves: &[bool], out: &mut [f64]) {
    let n = out.len();
    let stage: [&[f64]; S] = std::array::from_fn(|k| &stage[k][..n]);
    blocks_over!(n, L, S, foretold_at(l, &x0[..n], &stage, &moves[..n], out));
}

#[inline(always)]
fn foretold_at<L: Lanes, const S: usize>(
    i: usize,
    (all, inside): Both,
    x0: &[f64],
    stage: &[&[f64]; S],
    moves: &[bool],
    out: &mut [f64],
) {
    let (start, stage, moving) = (L::at(x0, i), each::<L, S>(stage, i), moving::<L>(moves, i));
    foretold_by((all, 1, 0), (inside, 1, 0), start, &stage, moving).put(out, i);
}

/// Which of a block move: some, all, each.
type Moving<'a> = (bool, bool, &'a [bool]);

#[inline(always)]
fn moving<L: Lanes>(moves: &[bool], i: usize) -> Moving<'_> {
    let moves = &moves[i..i + L::COUNT];
    let (some, all) = moves.iter().fold((false, true), |(some, all), &m| (some | m, all & m));
    (some, all, moves)
}

/// One block, by the weights of the start and the stages, and of the stages alone.
#[inline(always)]
fn foretold_by<L: Lanes, const S: usize>(
    all: Column,
    inside: Column,
    start: L,
    stage: &[L; S],
    (some, every, moves): Moving,
) -> L {
    let still = if every { start } else { sum_in(inside, stage) };
    if !some {
        return still;
    }
    let sum = from_start(all, start, stage);
    if every {
        return sum;
    }
    let (mut mixed, mut others) = ([0.0; LANES], [0.0; LANES]);
    sum.put(&mut mixed, 0);
    still.put(&mut others, 0);
    for l in 0..L::COUNT {
        if !moves[l] {
            mixed[l] = others[l];
        }
    }
    L::at(&mixed, 0)
}

by_lanes! {
    /// The same at as many places as there are rows to be written.
    pub fn foretold_each<L>(
        scheme: &Scheme,
        l: (&Table, &Table),
        x0: &[f64],
        stage: &[Vec<f64>],
        moves: &[bool],
        out: &mut [Vec<f64>],
    ) {
        by_stages!(scheme, L, each_of(l, x0, stage, moves, out))
    }
}

#[inline(always)]
fn each_of<L: Lanes, const S: usize>(
    l: (&Table, &Table),
    x0: &[f64],
    stage: &[Vec<f64>],
    moves: &[bool],
    out: &mut [Vec<f64>],
) {
    let n = x0.len();
    let stage: [&[f64]; S] = std::array::from_fn(|k| &stage[k][..n]);
    blocks_over!(n, L, S, each_at(l, x0, &stage, &moves[..n], out));
}

#[inline(always)]
fn each_at<L: Lanes, const S: usize>(
    i: usize,
    (all, inside): (&Table, &Table),
    x0: &[f64],
    stage: &[&[f64]; S],
    moves: &[bool],
    out: &mut [Vec<f64>],
) {
    let (start, stage, moving) = (L::at(x0, i), each::<L, S>(stage, i), moving::<L>(moves, i));
    for (k, out) in out.iter_mut().enumerate().take(WIDTH) {
        foretold_by((all, WIDTH, k), (inside, WIDTH, k), start, &stage, moving).put(out, i);
    }
}
