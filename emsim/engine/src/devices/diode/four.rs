//! Four diodes at once: the same laws (diode.rs) with every operation done for four of them, and both sides of what is decided there
//! computed and one of them kept. A processor with registers of four numbers takes for four diodes little longer than for one.
//!
//! The exponential: x = k ln 2 + r, |r| <= ln(2)/2, and of exp(r) Taylor's series to r^13/13!, what is left out being 4e-18; about
//! one unit in the last place. Its terms are added in pairs, and these in pairs (Estrin 1960): everything waits for a diode's current,
//! and so for as few operations as can be one after the other, none of them a division.

use super::{Diode, HUGE_VOLTAGE};
use crate::lanes::V;
use crate::tape::vectors;

pub use crate::twice::LANES;
type Lanes = [f64; LANES];

/// Constants of up to four diodes; the last one's stand for those that are missing.
#[derive(Clone, Debug)]
pub struct Four {
    inverse_vt: Lanes,
    largest: Lanes,
    saturation: Lanes,
    reverse_start: Lanes,
    reverse_scale: Lanes,
    // of breakdown, where one of them has it
    breaks: bool,
    knee: Lanes, // -bv
    inverse_vtb: Lanes,
    largest_b: Lanes,
    start: Lanes,
    // of high injection, where one of them has it
    knees: bool,
    knee_forward: Lanes,
    knee_reverse: Lanes,
    transit_time: Lanes,
    // of depletion, where one of them has it
    junctions: bool,
    square_roots: bool,
    m: Lanes,
    c0: Lanes,
    inverse_vj: Lanes,
    scale: Lanes,
    linear_from: Lanes,
    q_linear: Lanes,
    c_linear: Lanes,
    half_slope: Lanes,
    // of limiting
    quiet: Lanes, // a change of voltage that is never limited
    vcrit: Lanes,
    near_knee: Lanes, // below it limiting looks at breakdown
}

/// One number for each of them.
fn each(f: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(f)
}

impl Four {
    /// None where one of them has a sidewall, and where the processor has no registers of four. `diodes`: one to four.
    pub fn new(diodes: &[&Diode]) -> Option<Four> {
        if !vectors() || diodes.is_empty() || diodes.iter().any(|d| d.sidewall.is_some()) {
            return None;
        }
        let of = |f: &dyn Fn(&Diode) -> f64| each(|k| f(diodes[k.min(diodes.len() - 1)]));
        let wall = |f: fn(&super::Wall) -> f64| of(&|d| f(&d.bottom));
        let broken = |none: f64, f: fn(&super::Breakdown) -> f64| of(&|d| d.bottom.breakdown.as_ref().map_or(none, f));
        let stored = |none: f64, f: fn(&super::Junction) -> f64| of(&|d| d.junction.as_ref().map_or(none, f));
        let vtb = broken(f64::INFINITY, |b| b.vt);
        let vte = of(&|d| d.vte);
        Some(Four {
            inverse_vt: wall(|w| w.forward.inverse_vt),
            largest: wall(|w| w.forward.largest),
            saturation: wall(|w| w.saturation),
            reverse_start: wall(|w| w.reverse_start),
            reverse_scale: wall(|w| w.reverse_scale),
            breaks: diodes.iter().any(|d| d.bottom.breakdown.is_some()),
            knee: broken(f64::NEG_INFINITY, |b| -b.voltage),
            inverse_vtb: broken(0.0, |b| b.exponential.inverse_vt),
            largest_b: broken(0.0, |b| b.exponential.largest),
            start: broken(0.0, |b| b.start),
            knees: diodes.iter().any(|d| d.knee_forward != 0.0 || d.knee_reverse != 0.0),
            knee_forward: of(&|d| d.knee_forward),
            knee_reverse: of(&|d| -d.knee_reverse),
            transit_time: of(&|d| d.transit_time),
            junctions: diodes.iter().any(|d| d.junction.is_some()),
            square_roots: diodes.iter().all(|d| d.junction.as_ref().is_none_or(|j| j.square_root)),
            m: stored(0.5, |j| j.m),
            c0: stored(0.0, |j| j.c0),
            inverse_vj: stored(0.0, |j| j.inverse_vj),
            scale: stored(0.0, |j| j.scale),
            linear_from: stored(0.0, |j| j.linear_from),
            q_linear: stored(0.0, |j| j.q_linear),
            c_linear: stored(0.0, |j| j.c_linear),
            half_slope: stored(0.0, |j| j.half_slope),
            quiet: each(|k| (2.0 * vte[k].min(vtb[k])).min(1.0)),
            vcrit: of(&|d| d.vcrit),
            near_knee: broken(f64::NEG_INFINITY, |b| (-b.voltage + 10.0 * b.vt).min(0.0)),
        })
    }
}

// SAFETY, of all here: there is no Four where the processor has not AVX2 and FMA (`Four::new`)
impl Four {
    /// Is no change from `before` to `v` such that `Diode::limit` could move it?
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    pub unsafe fn quiet(&self, v: V, before: V) -> bool {
        let far = V::load(&self.quiet).less((v - before).abs());
        let one = V::all(1.0);
        let lowest = V::all(0.0).less(before).choose(-(one + before), before + before - one);
        let lowest = lowest.max(V::load(&self.near_knee));
        !far.and(V::load(&self.vcrit).less(v).or(v.less(lowest))).any()
    }

    /// As `Diode::eval`, for any finite v: i, g, q and c, and of a stage with this a the i + a q and g + a c. Everything waits for these,
    /// and they for the exponential: what does not need it is computed beside it.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    pub unsafe fn eval(&self, v: V, gmin: f64, a: f64) -> ([V; 4], [V; 2]) {
        let (one, of, huge) = (V::all(1.0), V::load, V::all(HUGE_VOLTAGE));
        let saturation = of(&self.saturation);
        // what is kept of the exponential lies above -3
        let bounded = |x: V, largest: V| exp(x.min(largest).max(V::all(-4.0)));
        let within = v.min(huge).max(-huge);
        let (mut i, mut g, reversed);
        if self.breaks {
            let knee = of(&self.knee);
            let broken = within.less(knee);
            let inverse_vt = broken.choose(of(&self.inverse_vtb), of(&self.inverse_vt));
            let largest = broken.choose(of(&self.largest_b), of(&self.largest));
            let x = broken.choose(knee - within, within) * inverse_vt;
            let e = bounded(x, largest);
            g = saturation * (e * inverse_vt);
            let e = e * (one + (x - largest).max(V::all(0.0)));
            i = saturation * broken.choose(of(&self.start) - e, e - one);
            reversed = within.less(of(&self.reverse_start)).and_not(broken);
        } else {
            let (inverse_vt, largest) = (of(&self.inverse_vt), of(&self.largest));
            let e = bounded(v * inverse_vt, largest);
            g = (saturation * inverse_vt) * e;
            let e = e * (one + (within * inverse_vt - largest).max(V::all(0.0)));
            i = (-saturation).more_product(saturation, e);
            reversed = within.less(of(&self.reverse_start));
        }
        let v = within;
        let inverse = one / v;
        let ratio = of(&self.reverse_scale) * inverse;
        let cube = ratio * ratio * ratio;
        i = reversed.choose(saturation * -(one + cube), i);
        g = reversed.choose(saturation * (V::all(3.0) * cube * inverse), g);
        if self.knees {
            let high = V::all(0.0).less(i).choose(of(&self.knee_forward), of(&self.knee_reverse));
            let root = (i * high).sqrt();
            let divisor = one / (one + root);
            i = i * divisor;
            g = g * ((one + V::all(0.5) * root) * divisor * divisor);
        }
        let gmin = V::all(gmin);
        i = i + gmin * v;
        g = g + gmin;
        let (a, transit_time) = (V::all(a), of(&self.transit_time));
        let stored = one + a * transit_time;
        let (q, c, stage) = (transit_time * i, transit_time * g, [i * stored, g * stored]);
        if !self.junctions {
            return ([i, g, q, c], stage);
        }
        let from = of(&self.linear_from);
        let below = v.less(from);
        let left = one - v * of(&self.inverse_vj);
        let (power, rest) = if self.square_roots {
            let root = left.sqrt();
            (one / root, root)
        } else {
            let power = V::load(&self.powers(left.store()));
            (power, left * power)
        };
        let beyond = v - from;
        let (rise, c_linear) = (of(&self.half_slope) * beyond, of(&self.c_linear));
        let charge = below.choose(of(&self.scale) * (one - rest), of(&self.q_linear) + beyond * (c_linear + rise));
        let capacitance = below.choose(of(&self.c0) * power, c_linear + (rise + rise));
        ([i, g, q + charge, c + capacitance], [stage[0] + a * charge, stage[1] + a * capacitance])
    }

    /// a^-m, where it is wanted.
    fn powers(&self, a: Lanes) -> Lanes {
        std::array::from_fn(|k| if a[k] > 0.0 { a[k].powf(-self.m[k]) } else { 0.0 })
    }
}

/// For |x| <= 700.
#[target_feature(enable = "avx2,fma")]
#[inline]
unsafe fn exp(x: V) -> V {
    const LN2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];
    // 1/2!, 1/3!, ... 1/13!
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
    let pair = |k: usize| V::all(C[k]).more_product(r, V::all(C[k + 1]));
    let four = |k: usize| pair(k).more_product(z, pair(k + 2));
    let sum = four(0).more_product(square, four(4)).more_product(square * square, four(8));
    (V::all(1.0) + r).more_product(z, sum).times_two_to(power)
}
