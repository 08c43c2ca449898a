//! Logarithms and powers of 2 to four digits, for what is only ever a choice: of a step's length, or of an order.

const MANTISSA: u32 = 52;
const BIAS: i64 = 1023;

/// log2 v of a normal number v > 0, to 1e-4.
#[inline(always)]
pub fn log2(v: f64) -> f64 {
    // v = 2^e m, m from sqrt(1/2) to sqrt(2), and a polynomial of m - 1, to 2e-6 (no division: a step's end waits for it)
    const ROOT_HALF: i64 = 0x3fe6_a09e_667f_3bcd;
    let bits = v.to_bits() as i64;
    let e = (bits - ROOT_HALF) >> MANTISSA;
    let m = f64::from_bits((bits - (e << MANTISSA)) as u64);
    let z = m - 1.0;
    let square = z * z;
    let first = 1.442_713_48 - 0.721_131_858 * z;
    let rest = (0.479_348_021 - 0.367_489_994 * z) + square * (0.322_154_775 - 0.206_591_639 * z);
    e as f64 + z * (first + square * rest)
}

/// 2^x to 1e-4, for |x| < 1000.
#[inline(always)]
pub fn exp2(x: f64) -> f64 {
    // e next to x, and a polynomial of the rest, |r| <= 1/2, to 3e-6
    const SHIFT: f64 = 6_755_399_441_055_744.0; // 1.5 2^52: adding it rounds
    let e = x + SHIFT;
    let r = x - (e - SHIFT);
    let power = 1.0 + r * ((0.693_121_524 + 0.240_220_209 * r) + r * r * (0.055_919_731_9 + 0.009_681_915_83 * r));
    let bits = (e.to_bits() as i64 - SHIFT.to_bits() as i64 + BIAS) << MANTISSA;
    power * f64::from_bits(bits as u64)
}

#[cfg(test)]
mod tests {
    use super::{exp2, log2};

    #[test]
    fn four_digits() {
        for k in -3000..3000 {
            let x = f64::from(k) / 100.0;
            let v = x.exp2();
            assert!((log2(v) - x).abs() < 1e-4, "log2 {v}");
            assert!((exp2(x) / v - 1.0).abs() < 1e-4, "2^{x}");
        }
        assert!((log2(f64::MAX) - 1024.0).abs() < 1e-4 && (log2(f64::MIN_POSITIVE) + 1022.0).abs() < 1e-4);
        assert_eq!([log2(1.0), exp2(0.0), exp2(-2.0), log2(8.0)], [0.0, 1.0, 0.25, 3.0]);
    }
}
