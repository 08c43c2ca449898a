//! What the factorisation needs of a number, for real and complex matrices.

use emsim_expr::multiversion::multiversion;
use emsim_expr::tape::{Value, Written};
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
    const ZERO: Self; // neutral in sums
    const ONE: Self; // neutral in products
    /// A magnitude, cheap rather than exact: |re| + |im|. Pivoting needs no more.
    fn magnitude(self) -> f64;
    fn recip(self) -> Self;
    fn from_real(re: f64) -> Self;
    /// What stands for a number of this kind in a program (program.rs).
    type Term: Term;
    /// What the numbers are made of, `Term::PARTS` of each.
    fn parts(v: &[Self]) -> &[f64];
    fn parts_mut(v: &mut [Self]) -> &mut [f64];
    /// How many values are larger in size than their limits, no larger than their least, or no numbers?
    fn outside(values: &[Self], limits: &[f64], least: &[f64]) -> u64;
}

/// A number that a program computes with, of one real number or of several. Operations and their order are the number's own.
pub trait Term: Copy {
    const PARTS: usize; // values that make it up
    /// Of its parts.
    fn of(part: impl FnMut(usize) -> Value) -> Self;
    fn parts(&self) -> &[Value];
    fn sub(self, other: Self, p: &mut Written) -> Self;
    fn mul(self, other: Self, p: &mut Written) -> Self;
    fn recip(self, one: Value, p: &mut Written) -> Self;
}

impl Scalar for f64 {
    const ZERO: f64 = 0.0; // neutral in sums
    const ONE: f64 = 1.0; // neutral in products
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
    type Term = Value;
    fn parts(v: &[f64]) -> &[f64] {
        v
    }
    fn parts_mut(v: &mut [f64]) -> &mut [f64] {
        v
    }
    fn outside(values: &[f64], limits: &[f64], least: &[f64]) -> u64 {
        reals_outside(values, limits, least)
    }
}

impl Term for Value {
    const PARTS: usize = 1; // a real number
    fn of(mut part: impl FnMut(usize) -> Value) -> Value {
        part(0)
    }
    fn parts(&self) -> &[Value] {
        std::slice::from_ref(self)
    }
    fn sub(self, other: Value, p: &mut Written) -> Value {
        p.sub(self, other)
    }
    fn mul(self, other: Value, p: &mut Written) -> Value {
        p.mul(self, other)
    }
    fn recip(self, one: Value, p: &mut Written) -> Value {
        p.div(one, self)
    }
}

impl Term for [Value; 2] {
    const PARTS: usize = 2; // real and imaginary part
    fn of(part: impl FnMut(usize) -> Value) -> [Value; 2] {
        [0, 1].map(part)
    }
    fn parts(&self) -> &[Value] {
        self
    }
    fn sub(self, other: [Value; 2], p: &mut Written) -> [Value; 2] {
        [p.sub(self[0], other[0]), p.sub(self[1], other[1])]
    }
    fn mul(self, [re, im]: [Value; 2], p: &mut Written) -> [Value; 2] {
        let (a, b) = (p.mul(self[0], re), p.mul(self[1], im));
        let (c, d) = (p.mul(self[0], im), p.mul(self[1], re));
        [p.sub(a, b), p.add(c, d)]
    }
    fn recip(self, one: Value, p: &mut Written) -> [Value; 2] {
        let [re, im] = self;
        let squares = (p.mul(re, re), p.mul(im, im));
        let either = |a: Value, b: Value, p: &mut Written| p.where_not_less(squares.0, squares.1, a, b);
        let (large, small) = (either(re, im, p), either(im, re, p));
        let r = p.div(small, large);
        let product = p.mul(small, r);
        let sum = p.add(large, product);
        let d = p.div(one, sum);
        let less = p.mul(r, d);
        let real = either(d, less, p);
        let imaginary = either(less, d, p);
        [real, p.neg(imaginary)]
    }
}

#[inline(always)]
fn count_outside<T: Scalar>(values: &[T], limits: &[f64], least: &[f64]) -> u64 {
    let each = values.iter().zip(limits.iter().zip(least)).map(|(v, limits)| (v.magnitude(), limits));
    each.map(|(size, (limit, least))| u64::from(!(size <= *limit && size > *least))).sum()
}

multiversion! {
    fn reals_outside(values: &[f64], limits: &[f64], least: &[f64]) -> u64 {
        count_outside(values, limits, least)
    }
}

multiversion! {
    fn pairs_outside(values: &[Complex], limits: &[f64], least: &[f64]) -> u64 {
        count_outside(values, limits, least)
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

    pub const fn new(re: f64, im: f64) -> Complex {
        Complex { re, im }
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
    const ZERO: Complex = Complex::new(0.0, 0.0); // neutral in sums
    const ONE: Complex = Complex::new(1.0, 0.0); // neutral in products
    #[inline(always)]
    fn magnitude(self) -> f64 {
        self.re.abs() + self.im.abs()
    }
    /// Smith's division. Which part is larger is told by squares: down to 1e-154, below which no pivot is one.
    #[inline(always)]
    fn recip(self) -> Complex {
        if self.re * self.re >= self.im * self.im {
            let r = self.im / self.re;
            let d = 1.0 / (self.re + self.im * r);
            Complex::new(d, -(r * d))
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
    type Term = [Value; 2];
    /// Real and imaginary parts in turn.
    fn parts(z: &[Complex]) -> &[f64] {
        // SAFETY: a number is its two parts and nothing else
        unsafe { std::slice::from_raw_parts(z.as_ptr().cast(), 2 * z.len()) }
    }
    fn parts_mut(z: &mut [Complex]) -> &mut [f64] {
        // SAFETY: as above
        unsafe { std::slice::from_raw_parts_mut(z.as_mut_ptr().cast(), 2 * z.len()) }
    }
    fn outside(values: &[Complex], limits: &[f64], least: &[f64]) -> u64 {
        pairs_outside(values, limits, least)
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
