//! Junction diode, SPICE level 1, with ngspice-39's temperature laws. Currents from anode to cathode, v across the junction
//! (inside the series resistance, which the circuit stamps).
//!
//! With vt = k T / q, and everything below at the temperature T of the device:
//!
//!   forward        v >= -3 n vt          c = is (exp(v / (n vt)) - 1)
//!   reverse        -bv <= v < -3 n vt    c = -is (1 + (3 n vt / (e v))^3)
//!   breakdown      v < -bv               c = c(-bv) - is (exp(-(bv + v) / (nbv vt)) - 1)
//!   high injection c > 0                 i = c / (1 + sqrt(c / ikf)),   likewise with ikr for c < 0
//!   leak                                 i = ... + gmin v
//!   depletion      v < fc vj             q = cjo vj (1 - (1 - v / vj)^(1 - m)) / (1 - m)
//!                  beyond                its parabola, continued with slope and curvature
//!   diffusion                            q = ... + tt i
//!
//! The sidewall, of perimeter pj, is a second junction beside the bottom: jsw and ns stand for is and n in c (which is the sum of
//! both before the knees; without ns the sidewall has the bottom's curve), cjp php mjsw fcs for cjo vj m fc in q. It breaks down
//! at the same voltage.
//!
//! The joint of forward and reverse is smooth as it stands (value and slope at -3 n vt are equal). Departures from ngspice,
//! all for continuity: breakdown starts at the value the reverse branch has reached (a shift below is/1000); the knees hold
//! for every current of their sign, not from 1e-18 A or from v < -3 n vt on; beyond 1e15 A the exponentials go on as straight lines.
//!
//! `bv` is moved to where the breakdown exponential passes the current `ibv` at the voltage `bv`, by the iteration of SPICE,
//! stopped as ngspice does at a relative error of 1e-3 (its default reltol), so that both see the same knee.
//!
//! Parameters: the table below. `is`, `cjo`, 1/`rs`, `ikf`, `ikr` go with area * m, `jsw`, `cjp` with pj * m; `ibv` with m alone
//! (level 1 of ngspice).

#[cfg(target_arch = "x86_64")]
mod four;

#[cfg(target_arch = "x86_64")]
pub use self::four::{Four, LANES};
use std::collections::HashMap;

/// A model parameter: names (the first is the one used here), unit, default, meaning.
pub struct Parameter {
    pub names: &'static [&'static str],
    pub unit: &'static str,
    pub default: f64,
    pub meaning: &'static str,
}

const fn p(names: &'static [&'static str], unit: &'static str, default: f64, meaning: &'static str) -> Parameter {
    Parameter { names, unit, default, meaning }
}

pub const MODEL: &[Parameter] = &[
    p(&["is", "js"], "A", 1e-14, "saturation current"),
    p(&["n"], "", 1.0, "emission coefficient"),
    p(&["jsw"], "A", 0.0, "saturation current of the sidewall, for a perimeter of 1"),
    p(&["ns"], "", f64::NAN, "emission coefficient of the sidewall (default: that of the bottom)"),
    p(&["rs"], "ohm", 0.0, "series resistance"),
    p(&["trs1", "trs"], "1/K", 0.0, "first temperature coefficient of rs"),
    p(&["trs2"], "1/K^2", 0.0, "second temperature coefficient of rs"),
    p(&["cjo", "cj0", "cj"], "F", 0.0, "junction capacitance at 0 V"),
    p(&["vj", "pb"], "V", 1.0, "junction potential"),
    p(&["m", "mj"], "", 0.5, "grading coefficient"),
    p(&["tm1"], "1/K", 0.0, "first temperature coefficient of m"),
    p(&["tm2"], "1/K^2", 0.0, "second temperature coefficient of m"),
    p(&["fc"], "", 0.5, "part of vj above which the capacitance goes on as a straight line"),
    p(&["cjp", "cjsw"], "F", 0.0, "capacitance of the sidewall at 0 V, for a perimeter of 1"),
    p(&["php"], "V", 1.0, "junction potential of the sidewall"),
    p(&["mjsw"], "", 0.33, "grading coefficient of the sidewall"),
    p(&["fcs"], "", 0.5, "part of php above which the sidewall's capacitance goes on as a straight line"),
    p(&["tt"], "s", 0.0, "transit time"),
    p(&["ttt1"], "1/K", 0.0, "first temperature coefficient of tt"),
    p(&["ttt2"], "1/K^2", 0.0, "second temperature coefficient of tt"),
    p(&["bv", "vb", "vrb"], "V", f64::INFINITY, "reverse breakdown voltage"),
    p(&["ibv", "ib"], "A", 1e-3, "current at the breakdown voltage"),
    p(&["nbv", "nz"], "", f64::NAN, "emission coefficient of breakdown (default: n)"),
    p(&["tcv"], "V/K or 1/K", 0.0, "temperature coefficient of bv"),
    p(&["ikf", "ik"], "A", f64::INFINITY, "knee of forward high injection"),
    p(&["ikr"], "A", f64::INFINITY, "knee of reverse high injection"),
    p(&["eg"], "eV", 1.11, "activation energy"),
    p(&["xti"], "", 3.0, "temperature exponent of is"),
    p(&["tlev"], "", 0.0, "1: tcv is relative"),
    p(&["tlevc"], "", 0.0, "1: cjo and vj follow cta and tpb"),
    p(&["cta", "ctc"], "1/K", 0.0, "temperature coefficient of cjo (tlevc = 1)"),
    p(&["tpb", "tvj"], "V/K", 0.0, "temperature coefficient of vj (tlevc = 1)"),
    p(&["ctp"], "1/K", 0.0, "temperature coefficient of cjp (tlevc = 1)"),
    p(&["tphp"], "V/K", 0.0, "temperature coefficient of php (tlevc = 1)"),
    p(&["tnom", "tref"], "C", f64::NAN, "temperature at which the parameters were measured (default: option tnom)"),
    p(&["area"], "", 1.0, "area of instances that give none"),
    p(&["pj"], "", 0.0, "perimeter of instances that give none"),
    p(&["level"], "", 1.0, "only 1 is known"),
];

pub const INSTANCE: &[Parameter] = &[
    p(&["area"], "", f64::NAN, "area factor (default: the model's)"),
    p(&["pj"], "", f64::NAN, "perimeter factor of the sidewall (default: the model's)"),
    p(&["m"], "", 1.0, "number of devices in parallel"),
    p(&["temp"], "C", f64::NAN, "temperature (default: option temp + dtemp)"),
    p(&["dtemp"], "K", 0.0, "temperature above that of the circuit"),
];

/// The model parameter of that name; None when it has no effect here (the caller warns).
pub fn model_parameter(name: &str) -> Option<&'static Parameter> {
    MODEL.iter().find(|p| p.names.contains(&name))
}

const CHARGE: f64 = 1.602_176_620_8e-19;
const BOLTZMANN: f64 = 1.380_648_52e-23;
const ZERO_CELSIUS: f64 = 273.15;
/// Temperature to which ngspice's laws of the band gap refer [K].
const REFERENCE: f64 = 300.15;
/// Current from which exponentials are continued by straight lines [A].
const HUGE_CURRENT: f64 = 1e15;
/// Voltages are clamped here, so that no square overflows.
const HUGE_VOLTAGE: f64 = 1e100;

/// Nodes and weights of Gauss-Legendre's rule of order 6 on [0, 1].
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
/// More intervals than any diode's energy wants.
const PANELS: usize = 4000;

/// Current and charge with their derivatives: g = di/dv, c = dq/dv.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct DiodeOut {
    pub i: f64,
    pub g: f64,
    pub q: f64,
    pub c: f64,
}

/// A diode with all constants at its temperature; nothing changes while it runs.
#[derive(Clone, Debug)]
pub struct Diode {
    bottom: Wall,
    sidewall: Option<Box<Sidewall>>, // few diodes have one: no room is taken from the others
    knee_forward: f64,               // 1/ikf, 0 for none
    knee_reverse: f64,
    transit_time: f64,
    junction: Option<Junction>,
    series_conductance: Option<f64>,
    /// What its current is bent on [V].
    pub vte: f64,
    vcrit: f64,
}

/// What carries current by one saturation current and one emission coefficient.
#[derive(Clone, Copy, Debug)]
struct Wall {
    saturation: f64,
    forward: Exponential,
    reverse_start: f64, // -3 n vt
    reverse_scale: f64, // 3 n vt / e
    breakdown: Option<Breakdown>,
}

#[derive(Clone, Debug)]
struct Sidewall {
    wall: Option<Wall>, // None: its current is in the bottom's
    junction: Option<Junction>,
}

/// exp(x / vt), going on as a straight line where is * exp(..) would pass HUGE_CURRENT.
#[derive(Clone, Copy, Debug)]
struct Exponential {
    inverse_vt: f64,
    largest: f64,     // argument
    exp_largest: f64, // exp of it
}

#[derive(Clone, Copy, Debug)]
struct Breakdown {
    voltage: f64,
    vt: f64, // nbv vt
    exponential: Exponential,
    start: f64, // c / is at -bv, plus 1
}

#[derive(Clone, Copy, Debug)]
struct Junction {
    c0: f64,
    inverse_vj: f64,
    m: f64,
    square_root: bool,
    scale: f64, // c0 vj / (1 - m)
    linear_from: f64,
    q_linear: f64,   // charge at linear_from
    c_linear: f64,   // capacitance there
    half_slope: f64, // half its slope
}

impl Exponential {
    fn new(vt: f64, saturation: f64) -> Exponential {
        let largest = (HUGE_CURRENT / saturation).ln().clamp(1.0, 600.0);
        Exponential { inverse_vt: 1.0 / vt, largest, exp_largest: largest.exp() }
    }

    /// exp and its derivative with respect to v.
    #[inline(always)]
    fn at(&self, v: f64) -> (f64, f64) {
        let x = v * self.inverse_vt;
        if x <= self.largest {
            let e = x.exp();
            (e, e * self.inverse_vt)
        } else {
            (self.exp_largest * (1.0 + (x - self.largest)), self.exp_largest * self.inverse_vt)
        }
    }
}

impl Diode {
    /// From the parameters given on the .model card and on the element (lower-case names), and the circuit's temperatures in
    /// Celsius. Names that are not in the tables have no effect. Errors are sentences for the user.
    pub fn new(
        model: &HashMap<String, f64>,
        instance: &HashMap<String, f64>,
        temp_c: f64,
        tnom_c: f64,
    ) -> Result<Diode, String> {
        let get = |name: &str| find(model, MODEL, name);
        let given = |name: &str| find(instance, INSTANCE, name);
        let positive = |name: &str, value: f64| match value > 0.0 {
            true => Ok(value),
            false => Err(format!("{name}= of a diode must be positive, it is {value:?}")),
        };
        let not_negative = |name: &str| match get(name) {
            value if value >= 0.0 => Ok(value),
            value => Err(format!("{name}= of a diode must not be negative, it is {value:?}")),
        };
        if get("level") != 1.0 {
            return Err(format!("diode level {} is not known, only level 1", get("level")));
        }

        // scale and temperatures
        let area = positive("area", given("area").or(get("area")))?;
        let multiplicity = positive("m", given("m"))?;
        let scale = area * multiplicity;
        let temperature = positive("temp", given("temp").or(temp_c + given("dtemp")) + ZERO_CELSIUS)?;
        let nominal = positive("tnom", get("tnom").or(tnom_c) + ZERO_CELSIUS)?;
        let rise = temperature - nominal;
        let vt = BOLTZMANN / CHARGE * temperature;
        let n = positive("n", get("n"))?;
        let vte = n * vt;

        // saturation currents
        let growth = |n: f64| {
            let vte = n * vt;
            (temperature / nominal - 1.0) * get("eg") / vte + get("xti") / n * (temperature / nominal).ln()
        };
        let saturation = scale * positive("is", get("is"))? * growth(n).exp();
        if !(saturation > 0.0 && saturation.is_finite()) {
            return Err(format!("saturation current of a diode is {saturation} A at {} C", temperature - ZERO_CELSIUS));
        }
        let perimeter = multiplicity * given("pj").or(get("pj"));
        if !(perimeter >= 0.0 && perimeter.is_finite()) {
            return Err(format!("pj= of a diode must not be negative, it is {:?}", given("pj").or(get("pj"))));
        }
        let ns = positive("ns", get("ns").or(1.0))?;
        let of_sidewall = perimeter * not_negative("jsw")? * growth(ns).exp();
        let merged = saturation + if get("ns").is_nan() { of_sidewall } else { 0.0 };

        let (voltage, nbv) = (get("bv"), positive("nbv", get("nbv").or(n))?);
        let mut diode = Diode {
            bottom: Wall::new(merged, vte),
            sidewall: None,
            knee_forward: inverse_knee(get("ikf"), scale),
            knee_reverse: inverse_knee(get("ikr"), scale),
            transit_time: not_negative("tt")? * (1.0 + get("ttt1") * rise + get("ttt2") * rise * rise),
            junction: None,
            series_conductance: None,
            vte,
            // (of milliamperes and more it would be no forward voltage, and the logarithm of limiting none of a positive number)
            vcrit: vte * (vte / (std::f64::consts::SQRT_2 * saturation)).ln().max(2.0 * vte),
        };

        let rs = not_negative("rs")? * (1.0 + get("trs1") * rise + get("trs2") * rise * rise);
        if rs > 0.0 {
            diode.series_conductance = Some(scale / rs);
        }

        let c0 = not_negative("cjo")? * scale;
        if c0 > 0.0 {
            let law = (get("tlevc") == 1.0).then(|| (get("cta"), get("tpb")));
            let m = get("m") * (1.0 + get("tm1") * rise + get("tm2") * rise * rise);
            let vj = positive("vj", get("vj"))?;
            diode.junction = Some(Junction::new(c0, vj, m, get("fc"), temperature, nominal, law)?);
        }

        let c0 = not_negative("cjp")? * perimeter;
        let mut wall = (of_sidewall > 0.0 && !get("ns").is_nan()).then(|| Wall::new(of_sidewall, ns * vt));

        if voltage < 0.0 {
            return Err(format!("bv of a diode must not be negative, it is {voltage}"));
        }
        if voltage > 0.0 && voltage.is_finite() {
            let shifted = match get("tlev") {
                0.0 => voltage - get("tcv") * rise,
                _ => voltage * (1.0 - get("tcv") * rise),
            };
            let knee = fit_breakdown(shifted, positive("ibv", get("ibv"))? * multiplicity, saturation, vt, nbv * vt);
            diode.bottom.breaks_down(knee, nbv * vt);
            if let Some(wall) = &mut wall {
                wall.breaks_down(knee, nbv * vt);
            }
        }
        if wall.is_some() || c0 > 0.0 {
            let law = (get("tlevc") == 1.0).then(|| (get("ctp"), get("tphp")));
            let php = positive("php", get("php"))?;
            let junction = match c0 > 0.0 {
                true => Some(Junction::new(c0, php, get("mjsw"), get("fcs"), temperature, nominal, law)?),
                false => None,
            };
            diode.sidewall = Some(Box::new(Sidewall { wall, junction }));
        }
        Ok(diode)
    }

    pub fn transit_time(&self) -> f64 {
        self.transit_time
    }

    /// Conductance of `rs`, None without one.
    pub fn series_conductance(&self) -> Option<f64> {
        self.series_conductance
    }

    /// Voltage of the strongest bend; where Newton's method starts.
    pub fn vcrit(&self) -> f64 {
        self.vcrit
    }

    /// Does it store charge?
    pub fn has_charge(&self) -> bool {
        self.transit_time > 0.0 || self.junction.is_some() || self.side_junction().is_some()
    }

    fn side_junction(&self) -> Option<&Junction> {
        self.sidewall.as_ref().and_then(|s| s.junction.as_ref())
    }

    /// Current, charge and their derivatives at v, for any finite v.
    #[inline(always)]
    pub fn eval(&self, v: f64, gmin: f64) -> DiodeOut {
        match &self.sidewall {
            None => self.with(None, v, gmin),
            Some(side) => self.with_sidewall(side, v, gmin),
        }
    }

    /// Out of the way of the diodes that have none: their values stay in registers.
    #[cold]
    #[inline(never)]
    fn with_sidewall(&self, side: &Sidewall, v: f64, gmin: f64) -> DiodeOut {
        self.with(Some(side), v, gmin)
    }

    #[inline(always)]
    fn with(&self, side: Option<&Sidewall>, v: f64, gmin: f64) -> DiodeOut {
        let v = v.clamp(-HUGE_VOLTAGE, HUGE_VOLTAGE);
        let (mut i, mut g) = self.bottom.at(v);
        if let Some(wall) = side.and_then(|s| s.wall.as_ref()) {
            let (more, slope) = wall.at(v);
            i += more;
            g += slope;
        }
        let knee = if i > 0.0 { self.knee_forward } else { -self.knee_reverse };
        if knee != 0.0 {
            let root = (i * knee).sqrt();
            let divisor = 1.0 / (1.0 + root);
            i *= divisor;
            g *= (1.0 + 0.5 * root) * divisor * divisor;
        }
        i += gmin * v;
        g += gmin;
        let mut out = DiodeOut { i, g, q: self.transit_time * i, c: self.transit_time * g };
        if let Some(junction) = &self.junction {
            let (q, c) = junction.at(v);
            out.q += q;
            out.c += c;
        }
        if let Some(junction) = side.and_then(|s| s.junction.as_ref()) {
            let (q, c) = junction.at(v);
            out.q += q;
            out.c += c;
        }
        out
    }

    /// Energy of the charge at v, the integral of v dq from 0 V [J]: of the depletion charge in closed form, of the diffusion
    /// charge by Gauss-Legendre's rule on intervals over which the current changes by no more than a few times.
    pub fn energy(&self, v: f64, gmin: f64) -> f64 {
        let depletion: f64 = self.junction.iter().chain(self.side_junction()).map(|j| j.energy(v)).sum();
        if self.transit_time == 0.0 {
            return depletion;
        }
        let knee = self.bottom.breakdown.as_ref().map_or(f64::NEG_INFINITY, |b| -b.voltage);
        let (mut sum, mut from, mut width) = (0.0, 0.0_f64, self.vte);
        for _ in 0..PANELS {
            let to = if v >= from {
                v.min(from + width)
            } else if from > knee {
                v.max(knee).max(from - width)
            } else {
                v.max(from - self.bottom.breakdown.as_ref().map_or(width, |b| b.vt))
            };
            for (c, weight) in GAUSS {
                let at = from + c * (to - from);
                sum += weight * (to - from) * at * self.eval(at, gmin).g;
            }
            if to == v {
                break;
            }
            (from, width) = (to, if v < 0.0 { 2.0 * width } else { width });
        }
        depletion + self.transit_time * sum
    }

    /// Junction voltage to use in place of `vnew` when the last one was `vold`, and whether it differs: a Newton step must
    /// not run far up an exponential, neither the forward one nor, mirrored about -bv, that of breakdown.
    #[inline]
    pub fn limit(&self, vnew: f64, vold: f64) -> (f64, bool) {
        match &self.bottom.breakdown {
            Some(b) if vnew < (-b.voltage + 10.0 * b.vt).min(0.0) => {
                let (mirrored, limited) = limit_junction(-(vnew + b.voltage), -(vold + b.voltage), b.vt, self.vcrit);
                (if limited { -(mirrored + b.voltage) } else { vnew }, limited)
            }
            _ => limit_junction(vnew, vold, self.vte, self.vcrit),
        }
    }
}

impl Wall {
    fn new(saturation: f64, vte: f64) -> Wall {
        Wall {
            saturation,
            forward: Exponential::new(vte, saturation),
            reverse_start: -3.0 * vte,
            reverse_scale: 3.0 * vte / std::f64::consts::E,
            breakdown: None,
        }
    }

    /// From -voltage downwards, from the current that the reverse branch has there.
    fn breaks_down(&mut self, voltage: f64, vt: f64) {
        let (start, exponential) = (self.plain(-voltage).0 + 1.0, Exponential::new(vt, self.saturation));
        self.breakdown = Some(Breakdown { voltage, vt, exponential, start });
    }

    /// c / is and its slope, forward and reverse, without breakdown.
    #[inline(always)]
    fn plain(&self, v: f64) -> (f64, f64) {
        if v >= self.reverse_start {
            let (e, slope) = self.forward.at(v);
            (e - 1.0, slope)
        } else {
            let inverse = 1.0 / v;
            let a = self.reverse_scale * inverse;
            let cube = a * a * a;
            (-(1.0 + cube), 3.0 * cube * inverse)
        }
    }

    /// Current and its slope.
    #[inline(always)]
    fn at(&self, v: f64) -> (f64, f64) {
        let (c, slope) = match &self.breakdown {
            Some(b) if v < -b.voltage => {
                let (e, slope) = b.exponential.at(-(b.voltage + v));
                (b.start - e, slope)
            }
            _ => self.plain(v),
        };
        (self.saturation * c, self.saturation * slope)
    }
}

impl Junction {
    /// Temperature laws of ngspice's diotemp.c. `law` = (cta, tpb) for tlevc = 1.
    fn new(
        c0: f64,
        vj: f64,
        m: f64,
        fc: f64,
        temperature: f64,
        nominal: f64,
        law: Option<(f64, f64)>,
    ) -> Result<Junction, String> {
        if m.is_nan() || m < 0.0 {
            return Err(format!("m of a diode must not be negative, it is {m}"));
        }
        if fc.is_nan() || fc < 0.0 {
            return Err(format!("fc of a diode must not be negative, it is {fc}"));
        }
        let (m, fc) = (m.min(0.9), fc.min(0.95));
        let (c0, mut vj) = match law {
            Some((cta, tpb)) => {
                let rise = temperature - REFERENCE;
                (c0 * (1.0 + cta * rise), vj - tpb * rise)
            }
            None => {
                // the potential follows the band gap: vj(T) = shift(T) + (T / T0) vj0
                let vj0 = (vj - potential_shift(nominal)) / (nominal / REFERENCE);
                let to_zero = 1.0 + m * (400e-6 * (nominal - REFERENCE) - (vj - vj0) / vj0);
                let vj_now = potential_shift(temperature) + temperature / REFERENCE * vj0;
                let from_zero = 1.0 + m * (400e-6 * (temperature - REFERENCE) - (vj_now - vj0) / vj0);
                (c0 / to_zero * from_zero, vj_now)
            }
        };
        if !(vj > 0.0 && c0 > 0.0) {
            return Err(format!("junction of a diode has vj = {vj} V, cjo = {c0} F at its temperature"));
        }
        // as ngspice; unlike there the charge at the joint is that of the limited potential, hence continuous
        if fc * vj > 1.0 {
            vj = 1.0 / fc;
        }
        let q_linear = c0 * vj * (1.0 - (1.0 - fc).powf(1.0 - m)) / (1.0 - m);
        let c_linear = c0 * (1.0 - fc).powf(-m);
        Ok(Junction {
            c0,
            inverse_vj: 1.0 / vj,
            m,
            square_root: m == 0.5,
            scale: c0 * vj / (1.0 - m),
            linear_from: fc * vj,
            q_linear,
            c_linear,
            half_slope: 0.5 * c_linear * m / (vj * (1.0 - fc)),
        })
    }

    /// Charge and capacitance.
    #[inline(always)]
    fn at(&self, v: f64) -> (f64, f64) {
        if v < self.linear_from {
            let a = 1.0 - v * self.inverse_vj;
            let s = if self.square_root { 1.0 / a.sqrt() } else { a.powf(-self.m) };
            (self.scale * (1.0 - a * s), self.c0 * s)
        } else {
            let beyond = v - self.linear_from;
            let rise = self.half_slope * beyond;
            (self.q_linear + beyond * (self.c_linear + rise), self.c_linear + 2.0 * rise)
        }
    }

    /// Integral of v dq from 0 V, with a = 1 - v/vj:  c0 vj^2 ((1 - a^(1-m))/(1-m) - (1 - a^(2-m))/(2-m)), then a cubic.
    fn energy(&self, v: f64) -> f64 {
        let a = 1.0 - v.min(self.linear_from) * self.inverse_vj;
        let part = |p: f64| (1.0 - a.powf(p)) / p;
        let curved = self.c0 * (part(1.0 - self.m) - part(2.0 - self.m)) / (self.inverse_vj * self.inverse_vj);
        let (from, beyond) = (self.linear_from, (v - self.linear_from).max(0.0));
        let line = from * (self.c_linear + self.half_slope * beyond)
            + beyond * (0.5 * self.c_linear + 2.0 / 3.0 * self.half_slope * beyond);
        curved + beyond * line
    }
}

/// 1 / (knee current scale), 0 when there is no knee.
fn inverse_knee(knee: f64, scale: f64) -> f64 {
    if knee > 0.0 && knee.is_finite() {
        1.0 / (knee * scale)
    } else {
        0.0
    }
}

/// What the band gap adds to a junction potential at temperature t [K], SPICE's `pbfact`.
fn potential_shift(t: f64) -> f64 {
    let gap = 1.16 - 7.02e-4 * t * t / (t + 1108.0);
    let arg = -gap / (2.0 * BOLTZMANN * t) + 1.115_087_7 / (2.0 * BOLTZMANN * REFERENCE);
    -2.0 * (BOLTZMANN / CHARGE * t) * (1.5 * (t / REFERENCE).ln() + CHARGE * arg)
}

/// Knee voltage for which the breakdown current at `voltage` is `current`.
fn fit_breakdown(voltage: f64, current: f64, saturation: f64, vt: f64, vt_breakdown: f64) -> f64 {
    if current < saturation * voltage / vt {
        return voltage; // the leakage is already more than that
    }
    let mut knee = voltage - vt_breakdown * (1.0 + current / saturation).ln();
    for _ in 0..25 {
        knee = voltage - vt_breakdown * (current / saturation + 1.0 - knee / vt).ln();
        let reached = saturation * (((voltage - knee) / vt_breakdown).exp() - 1.0 + knee / vt);
        if (reached - current).abs() <= 1e-3 * current {
            break;
        }
    }
    if knee.is_finite() {
        knee
    } else {
        voltage
    }
}

/// ngspice's pnjlim: logarithmic steps above vcrit, and no more than doubling (and one volt) on the way down.
fn limit_junction(vnew: f64, vold: f64, vt: f64, vcrit: f64) -> (f64, bool) {
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

/// Value of a parameter by any of its names, or its default.
fn find(values: &HashMap<String, f64>, table: &[Parameter], name: &str) -> f64 {
    let parameter = table.iter().find(|p| p.names[0] == name).expect("a name from the table");
    parameter.names.iter().find_map(|alias| values.get(*alias).copied()).unwrap_or(parameter.default)
}

/// NaN marks a default that depends on something else.
trait OrElse {
    fn or(self, other: f64) -> f64;
}

impl OrElse for f64 {
    fn or(self, other: f64) -> f64 {
        if self.is_nan() {
            other
        } else {
            self
        }
    }
}

#[cfg(test)]
mod tests;
