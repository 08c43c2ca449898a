//! Loops over numbers that are compiled twice: for any processor, and for one with registers of four numbers (AVX2), between
//! which the running one decides. The operations and their order are the same, hence every bit.

use std::ops::{Add, Div, Mul, Sub};

/// Defines a function so.
macro_rules! twice {
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

pub(crate) use twice;

/// Numbers that go through the registers together.
pub const LANES: usize = 4;

/// So many numbers: `V` in a register of a processor that has one for them, `Plain` elsewhere.
pub trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    fn all(v: f64) -> Self;
    fn load(v: &[f64; LANES]) -> Self;
    fn store(self) -> [f64; LANES];
    fn abs(self) -> Self;
    /// The larger ones, `other` where one is no number.
    fn larger(self, other: Self) -> Self;
}

#[derive(Clone, Copy)]
pub struct Plain([f64; LANES]);

/// Defines a function that is generic over `Lanes`, for the processor that runs it.
macro_rules! by_lanes {
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$lanes:ident>($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        #[inline]
        $vis fn $name($($arg: $type),*) $(-> $result)? {
            #[inline(always)]
            fn by_lanes<$lanes: $crate::twice::Lanes>($($arg: $type),*) $(-> $result)? $body
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
            by_lanes::<$crate::twice::Plain>($($arg),*)
        }
    };
}

pub(crate) use by_lanes;

/// Blocks of vectors of one length, `LANES` at least, and where each begins. The last one reaches back, and has some numbers of the
/// one before again.
#[inline(always)]
pub fn blocks<const K: usize>(of: [&[f64]; K]) -> impl Iterator<Item = (usize, [&[f64; LANES]; K])> {
    let n = of[0].len();
    assert!(n >= LANES && of.iter().all(|v| v.len() == n));
    (0..n).step_by(LANES).map(move |first| {
        let first = first.min(n - LANES);
        // SAFETY: so many numbers follow there in each
        (first, of.map(|v| unsafe { &*v.as_ptr().add(first).cast() }))
    })
}

/// What there is of fewer numbers, and zeros.
#[inline(always)]
pub fn padded(v: &[f64]) -> [f64; LANES] {
    std::array::from_fn(|k| v.get(k).copied().unwrap_or(0.0))
}

/// The block of `v` that begins there.
#[inline(always)]
pub fn block(v: &[f64], first: usize) -> [f64; LANES] {
    v[first..first + LANES].try_into().expect("so many")
}

#[cfg(target_arch = "x86_64")]
impl Lanes for crate::lanes::V {
    #[inline(always)]
    fn all(v: f64) -> Self {
        Self::all(v)
    }
    #[inline(always)]
    fn load(v: &[f64; LANES]) -> Self {
        Self::load(v)
    }
    #[inline(always)]
    fn store(self) -> [f64; LANES] {
        self.store()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.max(other)
    }
}

impl Lanes for Plain {
    fn all(v: f64) -> Plain {
        Plain([v; LANES])
    }
    fn load(v: &[f64; LANES]) -> Plain {
        Plain(*v)
    }
    fn store(self) -> [f64; LANES] {
        self.0
    }
    fn abs(self) -> Plain {
        Plain(self.0.map(f64::abs))
    }
    fn larger(self, other: Plain) -> Plain {
        Plain(std::array::from_fn(|k| if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] }))
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
    };
}

plain!(Add, add, +);
plain!(Sub, sub, -);
plain!(Mul, mul, *);
plain!(Div, div, /);
