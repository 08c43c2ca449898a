//! Sine and cosine together, where the processor has AVX2 and FMA; elsewhere those of the library.
//!
//! x = k pi/2 + r, |r| <= pi/4. The first part of pi/2 has 33 bits, so k times it is exact up to k = 2^20 and so is what is left of
//! x; the second and third bring r to twice the precision, as y + d (Cody and Waite 1980). On y the polynomials of fdlibm's
//! k_sin.c and k_cos.c (Sun Microsystems 1993, minimax of degree 13 and 14), d to first order. Error below one unit in the last
//! place. What is larger or not finite goes to the library. k stands in the last bits of x 2/pi + 3 2^51, whose own last place
//! is 1.
//!
//! Machine code has these operations in itself (`native/sines.rs`), for up to four arguments at once. Four arguments there
//! take about as long as one call of the library for both.

/// Sine and cosine of one argument.
pub fn sin_cos(x: f64) -> (f64, f64) {
    #[cfg(target_arch = "x86_64")]
    if x.abs() <= LARGEST && vectors() {
        // SAFETY: the processor has them
        return unsafe { x86::sin_cos(x) };
    }
    x.sin_cos()
}

/// Has the processor what machine code for programs asks for?
pub fn vectors() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

const LARGEST: f64 = 8e5; // so k = x 2/pi is below 2^19, and k P1, P1 having 33 bits, has no rounding

/// What the operations read, four times each.
#[repr(C, align(32))]
pub struct Table {
    pub magnitude: [f64; 4],
    pub sign: [f64; 4],
    /// the integer 1
    pub unit: [f64; 4],
    pub largest: [f64; 4],
    pub two_over_pi: [f64; 4],
    /// 3 2^51
    pub round: [f64; 4],
    /// pi/2 in 33 + 53 + 53 bits
    pub p: [[f64; 4]; 3],
    pub half: [f64; 4],
    pub one: [f64; 4],
    /// coefficients of y^3, y^5 ... of the sine
    pub sine: [[f64; 4]; 6],
    /// ... and of y^4, y^6 ... of the cosine
    pub cosine: [[f64; 4]; 6],
}

/// The row of `TABLE` at which a field begins.
#[cfg(all(target_arch = "x86_64", unix))]
macro_rules! row {
    ($field:ident) => {
        std::mem::offset_of!($crate::tape::trig::Table, $field) / 32
    };
}
#[cfg(all(target_arch = "x86_64", unix))]
pub(super) use row;

pub static TABLE: Table = Table {
    magnitude: [f64::from_bits(!(1 << 63)); 4],
    sign: [-0.0; 4],
    unit: [f64::from_bits(1); 4],
    largest: [LARGEST; 4],
    two_over_pi: [std::f64::consts::FRAC_2_PI; 4],
    round: [6_755_399_441_055_744.0; 4],
    p: [
        [f64::from_bits(0x3ff9_21fb_5440_0000); 4],
        [f64::from_bits(0x3dd0_b461_1a62_6331); 4],
        [f64::from_bits(0x3a71_701b_839a_2520); 4],
    ],
    half: [0.5; 4],
    one: [1.0; 4],
    sine: [
        [-1.666_666_666_666_663_2e-1; 4],
        [8.333_333_333_322_49e-3; 4],
        [-1.984_126_982_985_795e-4; 4],
        [2.755_731_370_707_006_8e-6; 4],
        [-2.505_076_025_340_686_3e-8; 4],
        [1.589_690_995_211_55e-10; 4],
    ],
    cosine: [
        [4.166_666_666_666_66e-2; 4],
        [-1.388_888_888_887_411e-3; 4],
        [2.480_158_728_947_673e-5; 4],
        [-2.755_731_435_139_066_3e-7; 4],
        [2.087_572_321_298_175e-9; 4],
        [-1.135_964_755_778_819_5e-11; 4],
    ],
};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::TABLE;

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn sin_cos(x: f64) -> (f64, f64) {
        let [p1, p2, p3] = TABLE.p.map(|p| p[0]);
        let round = TABLE.round[0];
        let turned = x * TABLE.two_over_pi[0] + round;
        let k = turned - round;
        let r = (-k).mul_add(p1, x);
        // r - k P2 without an error (Knuth's sum of the rounded product, whose own error is exact), then - k P3
        let product = k * p2;
        let y = r - product;
        let taken = y - r;
        let error = (r - (y - taken)) - (product + taken);
        let d = error - k.mul_add(p2, -product);
        let d = (-k).mul_add(p3, d);
        let z = y * y;
        let zz = z * z;
        let polynomial =
            |c: &[[f64; 4]]| c.iter().rev().map(|c| c[0]).reduce(|sum, c| sum.mul_add(z, c)).unwrap_or(0.0);
        // sin(y + d) = y + (y^3 s1 + (z (y^3 s - d/2) + d))
        let s = polynomial(&TABLE.sine[1..]);
        let cube = z * y;
        let s = cube.mul_add(s, -(d * 0.5));
        let s = cube.mul_add(TABLE.sine[0][0], z.mul_add(s, d));
        let sine = y + s;
        // cos(y + d) = w + ((1 - w) - z/2 + (z^2 c - y d)),  w = 1 - z/2
        let half = z * 0.5;
        let w = 1.0 - half;
        let c = polynomial(&TABLE.cosine);
        let c = zz.mul_add(c, -(y * d));
        let cosine = w + (((1.0 - w) - half) + c);
        // the quadrant: odd ones change places; sine is negative in 2 and 3, cosine in 1 and 2
        let q = turned.to_bits();
        let (s, c) = if q & 1 == 1 { (cosine, sine) } else { (sine, cosine) };
        let signed = |v: f64, q: u64| f64::from_bits(v.to_bits() ^ (q & 2) << 62);
        (signed(s, q), signed(c, q + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within one unit in the last place of the library, whose own error is about half of one.
    #[test]
    fn agrees_with_the_library() {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        for round in 0..200_000_u32 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let unit = (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
            let scale = [1.0, 2.0, 20.0, 1e3, 1e5, 1.5e6][round as usize % 6];
            let near = std::f64::consts::FRAC_PI_2 * f64::from(round % 1000);
            let x = if round % 7 == 0 { near + 1e-9 * unit } else { scale * unit };
            let ((s, c), (t, d)) = (sin_cos(x), x.sin_cos());
            for (ours, theirs) in [(s, t), (c, d)] {
                let unit = theirs.abs() * f64::EPSILON;
                assert!((ours - theirs).abs() <= unit, "{x:e}: {ours:e} {theirs:e}");
            }
        }
    }

    #[test]
    fn ends_are_met() {
        assert!(sin_cos(0.0) == (0.0, 1.0) && sin_cos(-0.0) == (0.0, 1.0));
        assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    }
}
