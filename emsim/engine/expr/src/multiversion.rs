//! Loops over numbers that are compiled twice: for any processor, and for one with registers of four numbers (AVX2), between
//! which the running one decides. The operations and their order are the same, hence every bit.
//!
//! `multiversion!` leaves it to the compiler what goes side by side. `by_lanes!` says it, for loops of which the compiler makes shuffles:
//! loops, not closures, since what is compiled for those registers does not go into a closure.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Defines a function so.
#[macro_export]
macro_rules! multiversion {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        #[inline]
        $vis fn $name($($arg: $type),*) $(-> $result)? {
            #[inline(always)]
            fn plain($($arg: $type),*) $(-> $result)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                unsafe fn wide($($arg: $type),*) $(-> $result)? {
                    plain($($arg),*)
                }
                if $crate::tape::vectors() {
                    // SAFETY: the processor has what is asked for
                    return unsafe { wide($($arg),*) };
                }
            }
            plain($($arg),*)
        }
    };
}

pub use multiversion;

/// Numbers that go through the registers together.
pub const LANES: usize = 4;

/// n numbers and what fills their last block.
pub const fn whole(n: usize) -> usize {
    n.next_multiple_of(LANES)
}

/// Numbers side by side: `V` in a register of a processor that has one for four of them, `Plain` elsewhere, `One` by itself.
pub trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    const COUNT: usize; // numbers side by side

    fn all(v: f64) -> Self;
    fn abs(self) -> Self;
    /// The larger ones, `other` where one is no number.
    fn larger(self, other: Self) -> Self;
    /// `then` where this is less than `than`, `otherwise` elsewhere.
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self;
    /// 0 where there is next to nothing (`NOTHING`).
    fn or_nothing(self) -> Self;
    /// Is all of it 0? What is no number is not.
    fn is_zero(self) -> bool;
    /// The largest of them and 0, of what is a number.
    fn largest(self) -> f64;
    /// What stands in `v` from i on.
    fn at(v: &[f64], i: usize) -> Self;
    /// The first numbers of `v`, 0 for those that are missing.
    fn first(v: &[f64]) -> Self;
    /// What stands in `v`, where it has just been stored number by number: a register that is loaded at once would wait for all of them
    /// to reach the cache.
    #[inline(always)]
    fn newly(v: &[f64]) -> Self {
        Self::at(v, 0)
    }
    fn put(self, v: &mut [f64], i: usize);
    /// Of the pairs in `v`, from the one of number i on, the first ones and the second ones.
    fn pairs_at(v: &[f64], i: usize) -> [Self; 2];
    fn put_pairs(pairs: [Self; 2], v: &mut [f64], i: usize);
}

/// What is smaller is no quantity of any unit, and on its way to numbers that processors take a hundred times as long over.
pub const NOTHING: f64 = 1e-200;

#[derive(Clone, Copy)]
pub struct Plain([f64; LANES]);

#[derive(Clone, Copy)]
pub struct One(f64);

/// Defines a function that is generic over `Lanes`, for the processor that runs it.
#[macro_export]
macro_rules! by_lanes {
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$lanes:ident>($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        #[inline]
        $vis fn $name($($arg: $type),*) $(-> $result)? {
            #[inline(always)]
            fn by_lanes<$lanes: $crate::multiversion::Lanes>($($arg: $type),*) $(-> $result)? $body
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2,fma")]
                unsafe fn wide($($arg: $type),*) $(-> $result)? {
                    by_lanes::<$crate::lanes::V>($($arg),*)
                }
                if $crate::tape::vectors() {
                    // SAFETY: the processor has what is asked for
                    return unsafe { wide($($arg),*) };
                }
            }
            by_lanes::<$crate::multiversion::Plain>($($arg),*)
        }
    };
}

pub use by_lanes;

/// Where blocks of n numbers begin, n being no fewer than one holds. The last one reaches back, and has some of the one before again.
#[inline(always)]
pub fn blocks<L: Lanes>(n: usize) -> impl Iterator<Item = usize> {
    (0..n).step_by(L::COUNT).map(move |first| first.min(n - L::COUNT))
}

/// The numbers one by one, 0 behind them where there are fewer.
#[inline(always)]
pub fn each<L: Lanes>(v: L) -> [f64; LANES] {
    let mut each = [0.0; LANES];
    v.put(&mut each, 0);
    each
}

/// A row of whole blocks as such; what is behind them is left out.
#[inline(always)]
pub fn in_blocks(v: &[f64]) -> &[[f64; LANES]] {
    // SAFETY: so many times LANES numbers
    unsafe { std::slice::from_raw_parts(v.as_ptr().cast(), v.len() / LANES) }
}

#[inline(always)]
pub fn in_blocks_mut(v: &mut [f64]) -> &mut [[f64; LANES]] {
    // SAFETY: so many times LANES numbers
    unsafe { std::slice::from_raw_parts_mut(v.as_mut_ptr().cast(), v.len() / LANES) }
}

/// The same blocks of several rows of n numbers side by side, each with where it begins; lengths are looked at once.
#[inline(always)]
pub fn side_by_side<'a, L: Lanes + 'a, const M: usize>(
    n: usize,
    rows: [&'a [f64]; M],
) -> impl Iterator<Item = (usize, [L; M])> + 'a {
    assert!(rows.iter().all(|row| row.len() >= n));
    // SAFETY: what `blocks` gives and one block more is n at most
    blocks::<L>(n).map(move |k| (k, rows.map(|row| L::at(unsafe { row.get_unchecked(k..k + L::COUNT) }, 0))))
}

#[cfg(target_arch = "x86_64")]
impl Lanes for crate::lanes::V {
    const COUNT: usize = LANES; // a register

    #[inline(always)]
    fn all(v: f64) -> Self {
        Self::all(v)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.max(other)
    }
    #[inline(always)]
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        self.less(than).choose(then, otherwise)
    }
    #[inline(always)]
    fn or_nothing(self) -> Self {
        self.unless(self.abs().less(Self::all(NOTHING)))
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.is_zero()
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.max(Self::all(0.0)).largest()
    }
    #[inline(always)]
    fn at(v: &[f64], i: usize) -> Self {
        Self::load(v[i..i + LANES].first_chunk().expect("so many"))
    }
    #[inline(always)]
    fn newly(v: &[f64]) -> Self {
        Self::one_by_one(v[..LANES].first_chunk().expect("so many"))
    }
    #[inline(always)]
    fn first(v: &[f64]) -> Self {
        Self::first(v)
    }
    #[inline(always)]
    fn put(self, v: &mut [f64], i: usize) {
        v[i..i + LANES].copy_from_slice(&self.store());
    }
    #[inline(always)]
    fn pairs_at(v: &[f64], i: usize) -> [Self; 2] {
        Self::apart(v[2 * i..2 * (i + LANES)].first_chunk().expect("so many"))
    }
    #[inline(always)]
    fn put_pairs(pairs: [Self; 2], v: &mut [f64], i: usize) {
        v[2 * i..2 * (i + LANES)].copy_from_slice(&Self::together(pairs));
    }
}

impl Lanes for Plain {
    const COUNT: usize = LANES; // as many as a register

    fn all(v: f64) -> Plain {
        Plain([v; LANES])
    }
    fn abs(self) -> Plain {
        Plain(self.0.map(f64::abs))
    }
    fn larger(self, other: Plain) -> Plain {
        Plain(std::array::from_fn(|k| if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] }))
    }
    fn if_less(self, than: Plain, then: Plain, otherwise: Plain) -> Plain {
        Plain(std::array::from_fn(|k| if self.0[k] < than.0[k] { then.0[k] } else { otherwise.0[k] }))
    }
    fn or_nothing(self) -> Plain {
        Plain(self.0.map(|v| One(v).or_nothing().0))
    }
    fn is_zero(self) -> bool {
        self.0 == [0.0; LANES]
    }
    fn largest(self) -> f64 {
        self.0.into_iter().fold(0.0, f64::max)
    }
    fn at(v: &[f64], i: usize) -> Plain {
        Plain(v[i..i + LANES].try_into().expect("so many"))
    }
    fn first(v: &[f64]) -> Plain {
        Plain(std::array::from_fn(|k| v.get(k).copied().unwrap_or(0.0)))
    }
    fn put(self, v: &mut [f64], i: usize) {
        v[i..i + LANES].copy_from_slice(&self.0);
    }
    fn pairs_at(v: &[f64], i: usize) -> [Plain; 2] {
        [0, 1].map(|of| Plain(std::array::from_fn(|k| v[2 * (i + k) + of])))
    }
    fn put_pairs([a, b]: [Plain; 2], v: &mut [f64], i: usize) {
        for k in 0..LANES {
            (v[2 * (i + k)], v[2 * (i + k) + 1]) = (a.0[k], b.0[k]);
        }
    }
}

impl Lanes for One {
    const COUNT: usize = 1; // one

    #[inline(always)]
    fn all(v: f64) -> One {
        One(v)
    }
    #[inline(always)]
    fn abs(self) -> One {
        One(self.0.abs())
    }
    #[inline(always)]
    fn larger(self, other: One) -> One {
        One(if self.0 > other.0 { self.0 } else { other.0 })
    }
    #[inline(always)]
    fn if_less(self, than: One, then: One, otherwise: One) -> One {
        if self.0 < than.0 {
            then
        } else {
            otherwise
        }
    }
    #[inline(always)]
    fn or_nothing(self) -> One {
        One(if self.0.abs() < NOTHING { 0.0 } else { self.0 })
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self.0 == 0.0
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.max(0.0)
    }
    #[inline(always)]
    fn at(v: &[f64], i: usize) -> One {
        One(v[i])
    }
    #[inline(always)]
    fn first(v: &[f64]) -> One {
        One(v.first().copied().unwrap_or(0.0))
    }
    #[inline(always)]
    fn put(self, v: &mut [f64], i: usize) {
        v[i] = self.0;
    }
    #[inline(always)]
    fn pairs_at(v: &[f64], i: usize) -> [One; 2] {
        [One(v[2 * i]), One(v[2 * i + 1])]
    }
    #[inline(always)]
    fn put_pairs([a, b]: [One; 2], v: &mut [f64], i: usize) {
        (v[2 * i], v[2 * i + 1]) = (a.0, b.0);
    }
}

macro_rules! plain {
    ($trait:ident, $name:ident, $sign:tt) => {
        impl $trait for Plain {
            type Output = Plain;
            fn $name(self, other: Plain) -> Plain {
                Plain(std::array::from_fn(|k| self.0[k] $sign other.0[k]))
            }
        }

        impl $trait for One {
            type Output = One;
            #[inline(always)]
            fn $name(self, other: One) -> One {
                One(self.0 $sign other.0)
            }
        }
    };
}

plain!(Add, add, +);
plain!(Sub, sub, -);
plain!(Mul, mul, *);
plain!(Div, div, /);

impl Neg for Plain {
    type Output = Plain;
    fn neg(self) -> Plain {
        Plain(self.0.map(f64::neg))
    }
}

impl Neg for One {
    type Output = One;
    #[inline(always)]
    fn neg(self) -> One {
        One(-self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{Lanes, One, Plain, LANES};

    /// Every operation on numbers side by side against the same on each.
    fn agrees<L: Lanes>() {
        let a = [1.5, -2.25, 0.0, f64::NAN, 7.0, -0.0, 3.0, 0.1];
        let b = [-0.5, 3.0, 0.0, 2.0, f64::NAN, 4.0, 1e300, 0.3];
        let same = |x: f64, y: f64| x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan());
        for i in 0..=a.len() - L::COUNT {
            let (va, vb, mut out) = (L::at(&a, i), L::at(&b, i), [0.0; LANES]);
            let results: [(L, fn(f64, f64) -> f64); 9] = [
                (va + vb, |a, b| a + b),
                (va - vb, |a, b| a - b),
                (va * vb, |a, b| a * b),
                (va / vb, |a, b| a / b),
                (-va, |a, _| -a),
                (va.abs(), |a, _| a.abs()),
                (va.larger(vb), |a, b| if a > b { a } else { b }),
                (va.if_less(vb, vb, -va), |a, b| if a < b { b } else { -a }),
                ((va * L::all(1e-200)).or_nothing(), |a, _| if a.abs() < 1.0 { 0.0 } else { a * 1e-200 }),
            ];
            for (k, (v, want)) in results.into_iter().enumerate() {
                v.put(&mut out, 0);
                for l in 0..L::COUNT {
                    let want = want(a[i + l], b[i + l]);
                    assert!(same(out[l], want), "operation {k}: {} and {want}", out[l]);
                }
            }
        }
        assert_eq!(L::at(&[-3.0, -1.0, f64::NAN, -2.0], 0).largest(), 0.0);
        for k in 0..L::COUNT {
            let mut one = [1.0, f64::NAN, -5.0, 0.5];
            one[k] = 7.0;
            assert_eq!(L::at(&one, 0).largest(), 7.0);
        }
        for n in 0..LANES {
            let mut first = [-1.0; LANES];
            L::first(&a[..n]).put(&mut first, 0);
            assert!((0..L::COUNT).all(|l| same(first[l], if l < n { a[l] } else { 0.0 })), "first {n}");
        }
        // pairs 2 and on of six
        let pairs: Vec<f64> = (0..12).map(f64::from).collect();
        let [first, second] = L::pairs_at(&pairs, 2);
        let (mut x, mut y, mut back) = ([0.0; LANES], [0.0; LANES], vec![-1.0; 12]);
        first.put(&mut x, 0);
        second.put(&mut y, 0);
        L::put_pairs([first, second], &mut back, 2);
        for l in 0..L::COUNT {
            assert_eq!((x[l], y[l]), (pairs[2 * (l + 2)], pairs[2 * (l + 2) + 1]));
            assert_eq!(back[2 * (l + 2)..2 * (l + 3)], pairs[2 * (l + 2)..2 * (l + 3)]);
        }
        assert!(back[..4].iter().chain(&back[4 + 2 * L::COUNT..]).all(|&v| v == -1.0));
    }

    #[test]
    fn numbers_side_by_side_are_each_by_itself() {
        agrees::<One>();
        agrees::<Plain>();
        #[cfg(target_arch = "x86_64")]
        if crate::tape::vectors() {
            agrees::<crate::lanes::V>();
        }
    }
}
