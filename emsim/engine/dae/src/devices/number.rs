//! The numbers that a device's law is written over. One text of the law is read four ways:
//!
//!   f64            its value
//!   V              four instances side by side (x86-64 with AVX2)
//!   Dual<L, P>     value and exact derivatives by the P port voltages, of one instance or of four
//!   Sym            a node of the expression graph
//!
//! There are no branches on a number: `lt` gives a mask, `pick` takes one of two values that are both there. What is picked must be
//! continuous where the mask turns, for no event is found there.
//!
//! Inside of `#[target_feature]` code closures, `array::map` and `from_fn` over vectors are compiled without the feature and called, at
//! ten times the price: loops and `#[inline(always)]` functions only.
use crate::graph::{Fun, Graph, Id};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{self, V};
use std::cell::RefCell;
use std::ops::{Add, Mul, Neg, Sub};

pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Add<<Self as Real>::Const, Output = Self>
    + Sub<<Self as Real>::Const, Output = Self>
    + Mul<<Self as Real>::Const, Output = Self>
{
    /// what does not hang on a port voltage: f64, four of them, a node
    type Const: Copy;
    type Mask: Copy;

    /// A plain number as a constant of the kind that goes with `self`.
    fn of(self, v: f64) -> Self::Const;
    /// A constant as a number that does not move.
    fn fixed(self, c: Self::Const) -> Self;
    fn exp(self) -> Self;
    fn sqrt(self) -> Self;
    fn recip(self) -> Self;
    /// self^e of a positive number.
    fn pow(self, e: Self::Const) -> Self;
    fn lt(self, than: Self::Const) -> Self::Mask;
    fn pick(m: Self::Mask, yes: Self, no: Self) -> Self;
    fn choose(m: Self::Mask, yes: Self::Const, no: Self::Const) -> Self::Const;

    /// The smaller; it stands still where that is the constant.
    #[inline(always)]
    fn at_most(self, c: Self::Const) -> Self {
        Self::pick(self.lt(c), self, self.fixed(c))
    }

    /// The larger.
    #[inline(always)]
    fn at_least(self, c: Self::Const) -> Self {
        Self::pick(self.lt(c), self.fixed(c), self)
    }

    /// The exponential, going on as a straight line beyond `largest` (limexp of Verilog-A).
    #[inline(always)]
    fn limexp(self, largest: Self::Const) -> Self {
        let e = self.at_most(largest).at_least(self.of(LEAST_EXPONENT)).exp();
        e * ((self - largest).at_least(self.of(0.0)) + self.of(1.0))
    }
}

/// exp(-700) is 0 beside everything.
const LEAST_EXPONENT: f64 = -700.0;

/// A plain number or four: what values and duals are made of.
pub trait Lane: Real<Const = Self> {
    fn all(v: f64) -> Self;
    fn abs(self) -> Self;
    fn either(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// In every lane?
    fn everywhere(m: Self::Mask) -> bool;

    #[inline(always)]
    fn largest(self, other: Self) -> Self {
        Self::pick(self.lt(other), other, self)
    }
}

impl Real for f64 {
    type Const = f64;
    type Mask = bool;

    #[inline(always)]
    fn of(self, v: f64) -> f64 {
        v
    }

    #[inline(always)]
    fn fixed(self, c: f64) -> f64 {
        c
    }

    #[inline(always)]
    fn exp(self) -> f64 {
        f64::exp(self)
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn recip(self) -> f64 {
        1.0 / self
    }

    #[inline(always)]
    fn pow(self, e: f64) -> f64 {
        self.powf(e)
    }

    #[inline(always)]
    fn lt(self, than: f64) -> bool {
        self < than
    }

    #[inline(always)]
    fn pick(m: bool, yes: f64, no: f64) -> f64 {
        if m {
            yes
        } else {
            no
        }
    }

    #[inline(always)]
    fn choose(m: bool, yes: f64, no: f64) -> f64 {
        Self::pick(m, yes, no)
    }
}

impl Lane for f64 {
    #[inline(always)]
    fn all(v: f64) -> f64 {
        v
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }

    #[inline(always)]
    fn either(a: bool, b: bool) -> bool {
        a || b
    }

    #[inline(always)]
    fn both(a: bool, b: bool) -> bool {
        a && b
    }

    #[inline(always)]
    fn everywhere(m: bool) -> bool {
        m
    }
}

#[cfg(target_arch = "x86_64")]
impl Real for V {
    type Const = V;
    type Mask = lanes::Mask;

    #[inline(always)]
    fn of(self, v: f64) -> V {
        V::all(v)
    }

    #[inline(always)]
    fn fixed(self, c: V) -> V {
        c
    }

    #[inline(always)]
    fn exp(self) -> V {
        // SAFETY: there is no V where the processor has not AVX2 and FMA
        unsafe { lanes::exp(self) }
    }

    #[inline(always)]
    fn sqrt(self) -> V {
        V::sqrt(self)
    }

    #[inline(always)]
    fn recip(self) -> V {
        V::all(1.0) / self
    }

    #[inline(always)]
    fn pow(self, e: V) -> V {
        let (mut a, e) = (self.store(), e.store());
        let mut k = 0;
        while k < 4 {
            a[k] = a[k].powf(e[k]);
            k += 1;
        }
        V::load(&a)
    }

    #[inline(always)]
    fn lt(self, than: V) -> lanes::Mask {
        self.less(than)
    }

    #[inline(always)]
    fn pick(m: lanes::Mask, yes: V, no: V) -> V {
        m.choose(yes, no)
    }

    #[inline(always)]
    fn choose(m: lanes::Mask, yes: V, no: V) -> V {
        m.choose(yes, no)
    }

    #[inline(always)]
    fn at_most(self, c: V) -> V {
        self.min(c)
    }

    #[inline(always)]
    fn at_least(self, c: V) -> V {
        self.max(c)
    }
}

#[cfg(target_arch = "x86_64")]
impl Lane for V {
    #[inline(always)]
    fn all(v: f64) -> V {
        V::all(v)
    }

    #[inline(always)]
    fn abs(self) -> V {
        V::abs(self)
    }

    #[inline(always)]
    fn either(a: lanes::Mask, b: lanes::Mask) -> lanes::Mask {
        a.or(b)
    }

    #[inline(always)]
    fn both(a: lanes::Mask, b: lanes::Mask) -> lanes::Mask {
        a.and(b)
    }

    #[inline(always)]
    fn everywhere(m: lanes::Mask) -> bool {
        m.all()
    }
}

/// A number with its derivatives by P port voltages.
#[derive(Clone, Copy, Debug)]
pub struct Dual<L, const P: usize> {
    pub v: L,
    pub d: [L; P],
}

impl<L: Lane, const P: usize> Dual<L, P> {
    /// The voltage of port k.
    #[inline(always)]
    pub fn port(v: L, k: usize) -> Self {
        let mut d = [L::all(0.0); P];
        d[k] = L::all(1.0);
        Dual { v, d }
    }

    /// A function of `self`: its value and slope.
    #[inline(always)]
    fn chain(self, v: L, slope: L) -> Self {
        let mut d = self.d;
        let mut k = 0;
        while k < P {
            d[k] = slope * self.d[k];
            k += 1;
        }
        Dual { v, d }
    }
}

impl<L: Lane, const P: usize> Real for Dual<L, P> {
    type Const = L;
    type Mask = L::Mask;

    #[inline(always)]
    fn of(self, v: f64) -> L {
        L::all(v)
    }

    #[inline(always)]
    fn fixed(self, c: L) -> Self {
        Dual { v: c, d: [L::all(0.0); P] }
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let e = self.v.exp();
        self.chain(e, e)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.v.sqrt();
        self.chain(root, L::all(0.5) * root.recip())
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let r = self.v.recip();
        self.chain(r, -(r * r))
    }

    #[inline(always)]
    fn pow(self, e: L) -> Self {
        let p = self.v.pow(e);
        self.chain(p, e * p * self.v.recip())
    }

    #[inline(always)]
    fn lt(self, than: L) -> L::Mask {
        self.v.lt(than)
    }

    #[inline(always)]
    fn pick(m: L::Mask, yes: Self, no: Self) -> Self {
        let mut d = yes.d;
        let mut k = 0;
        while k < P {
            d[k] = L::pick(m, yes.d[k], no.d[k]);
            k += 1;
        }
        Dual { v: L::pick(m, yes.v, no.v), d }
    }

    #[inline(always)]
    fn choose(m: L::Mask, yes: L, no: L) -> L {
        L::pick(m, yes, no)
    }

    /// The slope is the exponential as far as it goes, wherever the argument is: one product less.
    #[inline(always)]
    fn limexp(self, largest: L) -> Self {
        let e = self.v.at_most(largest).at_least(L::all(LEAST_EXPONENT)).exp();
        self.chain(e * ((self.v - largest).at_least(L::all(0.0)) + L::all(1.0)), e)
    }
}

macro_rules! sum {
    ($trait:ident $name:ident $sign:tt) => {
        impl<L: Lane, const P: usize> $trait for Dual<L, P> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, o: Self) -> Self {
                let mut d = self.d;
                let mut k = 0;
                while k < P {
                    d[k] = self.d[k] $sign o.d[k];
                    k += 1;
                }
                Dual { v: self.v $sign o.v, d }
            }
        }

        impl<L: Lane, const P: usize> $trait<L> for Dual<L, P> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, o: L) -> Self {
                Dual { v: self.v $sign o, d: self.d }
            }
        }
    };
}
sum!(Add add +);
sum!(Sub sub -);

impl<L: Lane, const P: usize> Mul for Dual<L, P> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let mut d = self.d;
        let mut k = 0;
        while k < P {
            d[k] = self.d[k] * o.v + self.v * o.d[k];
            k += 1;
        }
        Dual { v: self.v * o.v, d }
    }
}

impl<L: Lane, const P: usize> Mul<L> for Dual<L, P> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, o: L) -> Self {
        self.chain(self.v * o, o)
    }
}

impl<L: Lane, const P: usize> Neg for Dual<L, P> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.v, L::all(-1.0))
    }
}

/// A node of a graph. What is constant folds away: a law read with an instance's own constants keeps only what that instance has.
#[derive(Clone, Copy)]
pub struct Sym<'a> {
    pub g: &'a RefCell<Graph>,
    pub id: Id,
}

impl Sym<'_> {
    fn call(self, f: Fun) -> Self {
        self.with(|g| g.call(f, self.id))
    }

    fn with(self, make: impl FnOnce(&mut Graph) -> Id) -> Self {
        Sym { g: self.g, id: make(&mut self.g.borrow_mut()) }
    }
}

impl Real for Sym<'_> {
    type Const = Self;
    /// not less: the condition of a selection whose sides are exchanged
    type Mask = Self;

    fn of(self, v: f64) -> Self {
        self.with(|g| g.constant(v))
    }

    fn fixed(self, c: Self) -> Self {
        c
    }

    fn exp(self) -> Self {
        self.call(Fun::Exp)
    }

    fn sqrt(self) -> Self {
        self.call(Fun::Sqrt)
    }

    fn recip(self) -> Self {
        self.with(|g| {
            let one = g.constant(1.0);
            g.div(one, self.id)
        })
    }

    fn pow(self, e: Self) -> Self {
        self.with(|g| g.pow(self.id, e.id))
    }

    fn lt(self, than: Self) -> Self {
        self.with(|g| g.not_less(self.id, than.id))
    }

    fn pick(m: Self, yes: Self, no: Self) -> Self {
        m.with(|g| g.select(m.id, no.id, yes.id))
    }

    fn choose(m: Self, yes: Self, no: Self) -> Self {
        Self::pick(m, yes, no)
    }
}

macro_rules! operation {
    ($trait:ident $name:ident) => {
        impl $trait for Sym<'_> {
            type Output = Self;

            fn $name(self, o: Self) -> Self {
                self.with(|g| g.$name(self.id, o.id))
            }
        }
    };
}
operation!(Add add);
operation!(Sub sub);
operation!(Mul mul);

impl Neg for Sym<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        self.with(|g| g.neg(self.id))
    }
}
