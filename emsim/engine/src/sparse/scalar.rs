//! What the factorisation needs of a number, for real and complex matrices.

use super::program::Program;
use crate::tape::Inputs;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

pub trait Scalar:
    Copy
    + PartialEq
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    const ZERO: Self;
    const ONE: Self;
    /// A magnitude, cheap rather than exact: |re| + |im|. Pivoting needs no more.
    fn magnitude(self) -> f64;
    fn recip(self) -> Self;
    fn from_real(re: f64) -> Self;
    /// Are there programs (program.rs) for numbers of this kind?
    const PROGRAMS: bool;
    fn solve_by(_: &mut Program, _lu: &[Self], _b: &[Self], _x: &mut [Self]) {}
}

impl Scalar for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    #[inline(always)]
    fn magnitude(self) -> f64 {
        self.abs()
    }
    #[inline(always)]
    fn recip(self) -> f64 {
        1.0 / self
    }
    #[inline(always)]
    fn from_real(re: f64) -> f64 {
        re
    }
    const PROGRAMS: bool = true;
    fn solve_by(program: &mut Program, lu: &[f64], b: &[f64], x: &mut [f64]) {
        program.run(&Inputs { x: lu, t: 0.0, waves: &[], flags: b }, x);
    }
}

/// re + j im.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Complex {
    pub re: f64,
    pub im: f64,
}

impl Complex {
    pub const I: Complex = Complex { re: 0.0, im: 1.0 };

    /// Real and imaginary parts in turn.
    pub fn parts(z: &[Complex]) -> &[f64] {
        // SAFETY: a number is its two parts and nothing else
        unsafe { std::slice::from_raw_parts(z.as_ptr().cast(), 2 * z.len()) }
    }

    pub fn parts_mut(z: &mut [Complex]) -> &mut [f64] {
        // SAFETY: as above
        unsafe { std::slice::from_raw_parts_mut(z.as_mut_ptr().cast(), 2 * z.len()) }
    }

    pub const fn new(re: f64, im: f64) -> Complex {
        Complex { re, im }
    }

    pub fn conj(self) -> Complex {
        Complex::new(self.re, -self.im)
    }

    pub fn abs(self) -> f64 {
        self.re.hypot(self.im)
    }

    pub fn scale(self, s: f64) -> Complex {
        Complex::new(self.re * s, self.im * s)
    }
}

impl From<f64> for Complex {
    fn from(re: f64) -> Complex {
        Complex::new(re, 0.0)
    }
}

impl Scalar for Complex {
    const PROGRAMS: bool = false;
    const ZERO: Complex = Complex::new(0.0, 0.0);
    const ONE: Complex = Complex::new(1.0, 0.0);
    #[inline(always)]
    fn magnitude(self) -> f64 {
        self.re.abs() + self.im.abs()
    }
    /// Smith's division: no overflow where |z|^2 would.
    #[inline(always)]
    fn recip(self) -> Complex {
        if self.re.abs() >= self.im.abs() {
            let r = self.im / self.re;
            let d = 1.0 / (self.re + self.im * r);
            Complex::new(d, -r * d)
        } else {
            let r = self.re / self.im;
            let d = 1.0 / (self.im + self.re * r);
            Complex::new(r * d, -d)
        }
    }
    #[inline(always)]
    fn from_real(re: f64) -> Complex {
        Complex::new(re, 0.0)
    }
}

impl Add for Complex {
    type Output = Complex;
    #[inline(always)]
    fn add(self, o: Complex) -> Complex {
        Complex::new(self.re + o.re, self.im + o.im)
    }
}

impl Sub for Complex {
    type Output = Complex;
    #[inline(always)]
    fn sub(self, o: Complex) -> Complex {
        Complex::new(self.re - o.re, self.im - o.im)
    }
}

impl Mul for Complex {
    type Output = Complex;
    #[inline(always)]
    fn mul(self, o: Complex) -> Complex {
        Complex::new(self.re * o.re - self.im * o.im, self.re * o.im + self.im * o.re)
    }
}

impl Div for Complex {
    type Output = Complex;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn div(self, o: Complex) -> Complex {
        self * Scalar::recip(o)
    }
}

impl Neg for Complex {
    type Output = Complex;
    #[inline(always)]
    fn neg(self) -> Complex {
        Complex::new(-self.re, -self.im)
    }
}

impl AddAssign for Complex {
    #[inline(always)]
    fn add_assign(&mut self, o: Complex) {
        *self = *self + o;
    }
}

impl SubAssign for Complex {
    #[inline(always)]
    fn sub_assign(&mut self, o: Complex) {
        *self = *self - o;
    }
}

impl MulAssign for Complex {
    #[inline(always)]
    fn mul_assign(&mut self, o: Complex) {
        *self = *self * o;
    }
}
