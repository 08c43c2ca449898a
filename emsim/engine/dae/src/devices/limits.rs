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

/// Old voltage, new one -> one that Newton's method may go to, and whether that is another (SPICE's fetlim): no step of a gate is longer
/// than the channel's state allows.
pub fn gate(new: f64, old: f64, threshold: f64) -> (f64, bool) {
    let most_up = (2.0 * (old - threshold)).abs() + 2.0;
    let most_down = 0.5 * most_up + 2.0;
    let above = threshold + 3.5;
    let step = new - old;
    let to = if old >= threshold {
        if old >= above {
            if step <= 0.0 {
                if new >= above {
                    if -step > most_down {
                        old - most_down
                    } else {
                        new
                    }
                } else {
                    new.max(threshold + 2.0)
                }
            } else if step >= most_up {
                old + most_up
            } else {
                new
            }
        } else if step <= 0.0 {
            new.max(threshold - 0.5)
        } else {
            new.min(threshold + 4.0)
        }
    } else if step <= 0.0 {
        if -step > most_up {
            old - most_up
        } else {
            new
        }
    } else if new <= threshold + 0.5 {
        if step > most_down {
            old + most_down
        } else {
            new
        }
    } else {
        threshold + 0.5
    };
    (to, to != new)
}

/// SPICE's limvds: the drain of a transistor, which may as well be its source.
pub fn drain(new: f64, old: f64) -> (f64, bool) {
    if old < 0.0 {
        let (to, moved) = drain(-new, -old);
        return (-to, moved);
    }
    let to = if old >= 3.5 {
        if new > old {
            new.min(3.0 * old + 2.0)
        } else if new < 3.5 {
            new.max(2.0)
        } else {
            new
        }
    } else if new > old {
        new.min(4.0)
    } else {
        new.max(-0.5)
    };
    (to, to != new)
}

/// A step of more than `most` grows by its logarithm alone (SPICE's limitlog).
pub fn logarithmic(new: f64, old: f64, most: f64) -> (f64, bool) {
    let step = new - old;
    if step.abs() <= most {
        return (new, false);
    }
    (old + step.signum() * (most + (step.abs() / most).log10()), true)
}

/// A limiting function of Verilog-A's $limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Limiter {
    Junction,
    Gate,
    Drain,
    Logarithmic,
}

impl Limiter {
    pub fn named(name: &str, arguments: usize) -> Result<Limiter, String> {
        let (limiter, wants) = match name {
            "pnjlim" => (Limiter::Junction, 2),
            "fetlim" => (Limiter::Gate, 1),
            "limvds" => (Limiter::Drain, 0),
            "limitlog" => (Limiter::Logarithmic, 1),
            _ => return Err(format!("$limit knows pnjlim, fetlim, limvds and limitlog, not {name}")),
        };
        if arguments < wants {
            return Err(format!("$limit: {name} wants {wants} arguments, it has {arguments}"));
        }
        Ok(limiter)
    }

    /// A change of voltage that is never limited.
    pub fn quiet(self, arguments: &[f64]) -> f64 {
        match self {
            Limiter::Junction => (2.0 * arguments[0]).min(1.0),
            Limiter::Gate | Limiter::Drain => 0.5,
            Limiter::Logarithmic => arguments[0],
        }
    }

    #[inline]
    pub fn apply(self, new: f64, old: f64, arguments: &[f64]) -> (f64, bool) {
        match self {
            Limiter::Junction => junction(new, old, arguments[0], arguments[1]),
            Limiter::Gate => gate(new, old, arguments[0]),
            Limiter::Drain => drain(new, old),
            Limiter::Logarithmic => logarithmic(new, old, arguments[0]),
        }
    }
}
