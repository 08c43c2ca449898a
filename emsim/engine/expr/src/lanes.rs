//! Four numbers in one register of a processor that has AVX2 and FMA (`tape::vectors` says so): what is behind `V` is for
//! functions that are compiled for these, into which all of it goes.
#![cfg(target_arch = "x86_64")]

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Clone, Copy)]
pub struct V(__m256d);

/// Where four numbers stand in a vector; a negative place stands for a number that is 0.
#[derive(Clone, Debug)]
pub struct Places {
    at: [i32; 4],
    there: [f64; 4], // all bits of a lane, or none
    within: usize,   // vectors of at least this length have them
}

impl Places {
    pub fn new(at: [i32; 4]) -> Places {
        let there = at.map(|k| f64::from_bits(if k < 0 { 0 } else { u64::MAX }));
        Places { at: at.map(|k| k.max(0)), there, within: at.iter().map(|k| (k + 1) as usize).max().unwrap_or(0) }
    }
}

/// All bits of a lane, or none.
#[derive(Clone, Copy)]
pub struct Mask(__m256d);

/// Integers as the exponent of a power of two wants them.
#[derive(Clone, Copy)]
pub struct Exponent(__m256i);

// SAFETY of all that follows: nobody makes a V but where the processor has its instructions
impl V {
    #[inline(always)]
    pub fn all(v: f64) -> V {
        V(unsafe { _mm256_set1_pd(v) })
    }

    #[inline(always)]
    pub fn load(v: &[f64; 4]) -> V {
        V(unsafe { _mm256_loadu_pd(v.as_ptr()) })
    }

    /// The same by four loads.
    #[inline(always)]
    pub fn one_by_one(v: &[f64; 4]) -> V {
        // SAFETY, besides: four numbers (volatile, or the compiler makes one load of them)
        unsafe {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| v.as_ptr().add(k).read_volatile());
            V(_mm256_set_pd(d, c, b, a))
        }
    }

    /// The first four numbers, 0 for those that are missing.
    #[inline(always)]
    pub fn first(v: &[f64]) -> V {
        if let Some(four) = v.first_chunk() {
            return V::load(four);
        }
        // one by one: what has just been stored is not there for a masked load
        let at = |k: usize| v.get(k).copied().unwrap_or(0.0);
        V(unsafe { _mm256_set_pd(0.0, at(2), at(1), at(0)) })
    }

    #[inline(always)]
    pub fn gather(x: &[f64], places: &Places) -> V {
        assert!(places.within <= x.len());
        if x.is_empty() {
            return V::all(0.0);
        }
        // SAFETY: every place is one of x
        unsafe {
            let [a, b, c, d] = places.at.map(|k| *x.get_unchecked(k as usize));
            V(_mm256_and_pd(_mm256_set_pd(d, c, b, a), V::load(&places.there).0))
        }
    }

    #[inline(always)]
    pub fn store(self) -> [f64; 4] {
        let mut v = [0.0; 4];
        unsafe { _mm256_storeu_pd(v.as_mut_ptr(), self.0) };
        v
    }

    /// Of four pairs the first ones and the second ones.
    #[inline(always)]
    pub fn apart(pairs: &[f64; 8]) -> [V; 2] {
        // SAFETY, besides: eight numbers
        unsafe {
            let (low, high) = (_mm256_loadu_pd(pairs.as_ptr()), _mm256_loadu_pd(pairs[4..].as_ptr()));
            // 0 2 | 1 3 of each kind
            let (first, second) = (_mm256_unpacklo_pd(low, high), _mm256_unpackhi_pd(low, high));
            let in_order =
                [_mm256_permute4x64_pd::<0b11_01_10_00>(first), _mm256_permute4x64_pd::<0b11_01_10_00>(second)];
            [V(in_order[0]), V(in_order[1])]
        }
    }

    /// Four pairs, each of one of either.
    #[inline(always)]
    pub fn together([a, b]: [V; 2]) -> [f64; 8] {
        let mut pairs = [0.0; 8];
        unsafe {
            let (a, b) = (_mm256_permute4x64_pd::<0b11_01_10_00>(a.0), _mm256_permute4x64_pd::<0b11_01_10_00>(b.0));
            _mm256_storeu_pd(pairs.as_mut_ptr(), _mm256_unpacklo_pd(a, b));
            _mm256_storeu_pd(pairs[4..].as_mut_ptr(), _mm256_unpackhi_pd(a, b));
        }
        pairs
    }

    #[inline(always)]
    pub fn abs(self) -> V {
        V(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    pub fn sqrt(self) -> V {
        V(unsafe { _mm256_sqrt_pd(self.0) })
    }

    /// The smaller, `other` where one is no number.
    #[inline(always)]
    pub fn min(self, other: V) -> V {
        V(unsafe { _mm256_min_pd(self.0, other.0) })
    }

    /// The larger, `other` where one is no number.
    #[inline(always)]
    pub fn max(self, other: V) -> V {
        V(unsafe { _mm256_max_pd(self.0, other.0) })
    }

    /// The largest of four numbers.
    #[inline(always)]
    pub fn largest(self) -> f64 {
        unsafe {
            let two = _mm_max_pd(_mm256_castpd256_pd128(self.0), _mm256_extractf128_pd::<1>(self.0));
            _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)))
        }
    }

    #[inline(always)]
    pub fn is_zero(self) -> bool {
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_NEQ_UQ>(self.0, _mm256_setzero_pd())) == 0 }
    }

    #[inline(always)]
    pub fn less(self, than: V) -> Mask {
        Mask(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, than.0) })
    }

    /// 0 in the lanes of the mask.
    #[inline(always)]
    pub fn unless(self, mask: Mask) -> V {
        V(unsafe { _mm256_andnot_pd(mask.0, self.0) })
    }

    /// self + a b, rounded once.
    #[inline(always)]
    pub fn more_product(self, a: V, b: V) -> V {
        V(unsafe { _mm256_fmadd_pd(a.0, b.0, self.0) })
    }

    /// self - a b, rounded once.
    #[inline(always)]
    pub fn less_product(self, a: V, b: V) -> V {
        V(unsafe { _mm256_fnmadd_pd(a.0, b.0, self.0) })
    }

    /// The nearest integer, below 2^51 in size, as a number and as an exponent: it stands in the last bits of what it makes of
    /// 1.5 2^52.
    #[inline(always)]
    pub fn to_integer(self) -> (V, Exponent) {
        let large = V::all(6_755_399_441_055_744.0);
        let rounded = self + large;
        (rounded - large, Exponent(unsafe { _mm256_slli_epi64::<52>(_mm256_castpd_si256(rounded.0)) }))
    }

    /// self 2^k, where that is a normal number.
    #[inline(always)]
    pub fn times_two_to(self, k: Exponent) -> V {
        V(unsafe { _mm256_castsi256_pd(_mm256_add_epi64(_mm256_castpd_si256(self.0), k.0)) })
    }
}

impl Mask {
    #[inline(always)]
    pub fn all(self) -> bool {
        unsafe { _mm256_movemask_pd(self.0) == 15 }
    }

    #[inline(always)]
    pub fn choose(self, yes: V, no: V) -> V {
        V(unsafe { _mm256_blendv_pd(no.0, yes.0, self.0) })
    }

    #[inline(always)]
    pub fn and(self, other: Mask) -> Mask {
        Mask(unsafe { _mm256_and_pd(self.0, other.0) })
    }

    #[inline(always)]
    pub fn or(self, other: Mask) -> Mask {
        Mask(unsafe { _mm256_or_pd(self.0, other.0) })
    }
}

/// For |x| <= 700, to about one unit in the last place: x = k ln 2 + r, |r| <= ln(2)/2, and of exp(r) Taylor's series to r^13/13!,
/// what is left out being 4e-18. Its terms are added in pairs, and these in pairs (Estrin 1960): everything waits for a device's
/// current, and so for as few operations as can be one after the other, none of them a division.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
#[inline]
pub unsafe fn exp(x: V) -> V {
    // ln 2 in two parts, the first ending in zeros, so that a whole number of it is exact; and 1/2!, 1/3!, ... 1/13!
    const LN2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];
    const C: [f64; 12] = {
        let (mut c, mut factorial, mut k) = ([0.0; 12], 1.0, 0);
        while k < 12 {
            factorial *= (k + 2) as f64;
            c[k] = 1.0 / factorial;
            k += 1;
        }
        c
    };
    let (turns, power) = (x * V::all(std::f64::consts::LOG2_E)).to_integer();
    let r = x.less_product(turns, V::all(LN2[0])) - turns * V::all(LN2[1]);
    let z = r * r;
    let square = z * z;
    let sum = four(r, z, &C, 0).more_product(square, four(r, z, &C, 4));
    let sum = sum.more_product(square * square, four(r, z, &C, 8));
    (V::all(1.0) + r).more_product(z, sum).times_two_to(power)
}

/// c_k + c_k+1 r + (c_k+2 + c_k+3 r) r^2, z = r^2.
#[inline(always)]
fn four(r: V, z: V, c: &[f64; 12], k: usize) -> V {
    let low = V::all(c[k]).more_product(r, V::all(c[k + 1]));
    low.more_product(z, V::all(c[k + 2]).more_product(r, V::all(c[k + 3])))
}

macro_rules! operator {
    ($trait:ident, $name:ident, $instruction:ident) => {
        impl $trait for V {
            type Output = V;

            #[inline(always)]
            fn $name(self, other: V) -> V {
                V(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm256_add_pd);
operator!(Sub, sub, _mm256_sub_pd);
operator!(Mul, mul, _mm256_mul_pd);
operator!(Div, div, _mm256_div_pd);

impl Neg for V {
    type Output = V;

    #[inline(always)]
    fn neg(self) -> V {
        V(unsafe { _mm256_xor_pd(_mm256_set1_pd(-0.0), self.0) })
    }
}
