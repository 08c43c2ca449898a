//! Limiting of Newton's steps, shared by devices.

/// ngspice's pnjlim: logarithmic steps above vcrit, and no more than doubling (and one volt) on the way down.
pub fn junction(vnew: f64, vold: f64, vt: f64, vcrit: f64) -> (f64, bool) {
    if vnew > vcrit && (vnew - vold).abs() > 2.0 * vt {
        if vold <= 0.0 {
            return (vt * (vnew / vt).ln(), true);
        }
        let steps = (vnew - vold) / vt;
        let limited = if steps > 0.0 { 2.0 + (steps - 2.0).ln() } else { -(2.0 + (2.0 - steps).ln()) };
        return (vold + vt * limited, true);
    }
    if vnew < 0.0 {
        let lowest = if vold > 0.0 { -1.0 - vold } else { 2.0 * vold - 1.0 };
        if vnew < lowest {
            return (lowest, true);
        }
    }
    (vnew, false)
}

/// Voltage of the strongest bend of `saturation` (exp(v/vt) - 1), where Newton's method starts. (Of milliamperes and more it would be no
/// forward voltage, and the logarithm of limiting none of a positive number.)
pub fn critical(vt: f64, saturation: f64) -> f64 {
    vt * (vt / (std::f64::consts::SQRT_2 * saturation)).ln().max(2.0 * vt)
}
