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

use super::class::GAUSS;
use super::number::{Dual, Lane, Real};
use super::{limits, p, Card, Climate, Constants, Device, Flow, Given, Inner, Line, Noise, OrElse, Parameter, Spec};

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
    p(&["kf"], "A^(2-af)", 0.0, "1/f noise"),
    p(&["af"], "", 1.0, "1/f noise: exponent of the current"),
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

const CHARGE: f64 = 1.602_176_620_8e-19; // of the electron [C], CODATA 2014 as in ngspice
const BOLTZMANN: f64 = 1.380_648_52e-23; // [J/K], the same
const ZERO_CELSIUS: f64 = 273.15; // [K]
/// Temperature to which ngspice's laws of the band gap refer [K].
const REFERENCE: f64 = 300.15;
/// Current from which exponentials are continued by straight lines [A].
const HUGE_CURRENT: f64 = 1e15;
/// Voltages are clamped here, so that no square overflows.
const HUGE_VOLTAGE: f64 = 1e100;
/// Roots are taken of no less, so that they have a slope.
const TINY: f64 = 1e-300;

constants! {
    // of the bottom
    SATURATION, INVERSE_VT, LARGEST, REVERSE_START, REVERSE_SCALE, KNEE, BREAK_INVERSE_VT, BREAK_LARGEST, START,
    // of the sidewall: the same nine
    SIDE, SIDE_1, SIDE_2, SIDE_3, SIDE_4, SIDE_5, SIDE_6, SIDE_7, SIDE_8,
    // inverse currents of the knees, that of negative currents with a negative sign
    KNEE_FORWARD, KNEE_REVERSE,
    TRANSIT_TIME,
    // depletion charge of the bottom
    INVERSE_VJ, ONE_M, SCALE, LINEAR_FROM, Q_LINEAR, C_LINEAR, HALF_SLOPE,
    // of the sidewall: the same seven
    SIDE_CHARGE, SIDE_CHARGE_1, SIDE_CHARGE_2, SIDE_CHARGE_3, SIDE_CHARGE_4, SIDE_CHARGE_5, SIDE_CHARGE_6,
    /// 1/rs, 0 without
    SERIES,
    // of limiting
    VTE, VTB, VCRIT,
    /// a change of voltage that is never limited
    QUIET,
    /// below it limiting looks at breakdown
    NEAR_KNEE,
    // of noise: power of 1/f at 1 Hz and 1 A, exponent
    FLICKER, FLICKER_EXPONENT,
}

/// Parts of the law.
const BREAKS: u32 = 1;
const KNEES: u32 = 2;
const CHARGED: u32 = 4;
const POWERS: u32 = 8; // its m is not 1/2
const SIDE_WALL: u32 = 16;
const SIDE_CHARGED: u32 = 32;
const SIDE_POWERS: u32 = 64;

/// No breakdown: below every voltage.
const NO_KNEE: f64 = -1e101;

pub struct Diode;

impl Device<1, 1, CONSTANTS> for Diode {
    const SPEC: Spec = Spec {
        name: "d",
        terminals: &["anode", "cathode"],
        inner: &[Inner { name: "internal", behind: 0 }],
        model: MODEL,
        instance: INSTANCE,
    };
    const PORTS: [(usize, usize); 1] = [(2, 1)];
    const BRANCHES: [(usize, usize); 1] = [(2, 1)];
    const PASSIVE: bool = true;

    #[inline(always)]
    fn law<R: Real>(c: &impl Constants<R::Const>, has: u32, v: [R; 1], gmin: R::Const) -> Flow<R, 1> {
        let across = v[0];
        let v = across.at_most(across.of(HUGE_VOLTAGE)).at_least(across.of(-HUGE_VOLTAGE));
        let mut i = wall(c, SATURATION, has & BREAKS != 0, v);
        if has & SIDE_WALL != 0 {
            i = i + wall(c, SIDE, has & BREAKS != 0, v);
        }
        if has & KNEES != 0 {
            let knee = R::choose(i.lt(v.of(0.0)), c.at(KNEE_REVERSE), c.at(KNEE_FORWARD));
            let root = (i * knee).at_least(v.of(TINY)).sqrt();
            i = i * (root + v.of(1.0)).recip();
        }
        i = i + across * gmin;
        let mut q = i * c.at(TRANSIT_TIME);
        if has & CHARGED != 0 {
            q = q + depletion(c, INVERSE_VJ, has & POWERS != 0, v);
        }
        if has & SIDE_CHARGED != 0 {
            q = q + depletion(c, SIDE_CHARGE, has & SIDE_POWERS != 0, v);
        }
        Flow { i: [i], q: [q] }
    }

    /// A Newton step must not run far up an exponential, neither the forward one nor, mirrored about -bv, that of breakdown.
    #[inline]
    fn limit(card: &Card<CONSTANTS>, new: &mut [f64; 1], old: &[f64; 1]) -> bool {
        let (c, [vnew], [vold]) = (&card.of, *new, *old);
        let (to, moved) = if vnew < c[NEAR_KNEE] {
            let knee = c[KNEE];
            let (mirrored, moved) = limits::junction(knee - vnew, knee - vold, c[VTB], c[VCRIT]);
            (if moved { knee - mirrored } else { vnew }, moved)
        } else {
            limits::junction(vnew, vold, c[VTE], c[VCRIT])
        };
        new[0] = to;
        moved
    }

    #[inline(always)]
    fn quiet<L: Lane>(c: &impl Constants<L>, [v]: [L; 1], [before]: [L; 1]) -> L::Mask {
        let one = L::all(1.0);
        let lowest = L::pick(L::all(0.0).lt(before), -(one + before), before + before - one);
        let lowest = lowest.largest(c.at(NEAR_KNEE));
        let inside = L::both(v.lt(c.at(VCRIT)), lowest.lt(v));
        L::either((v - before).abs().lt(c.at(QUIET)), inside)
    }

    fn start(card: &Card<CONSTANTS>) -> [f64; 1] {
        [card.of[VCRIT]]
    }

    fn bend(card: &Card<CONSTANTS>, _: usize) -> f64 {
        card.of[VTE]
    }

    fn series(card: &Card<CONSTANTS>, _: usize) -> Option<f64> {
        Some(card.of[SERIES]).filter(|&g| g > 0.0)
    }

    /// 2 q i, and m kf (i / m)^af / f.
    fn noise(card: &Card<CONSTANTS>, at: &Line, each: &mut dyn FnMut(Noise)) {
        let (c, i) = (&card.of, at.i[0].abs());
        let mut one = |name, power, exponent| each(Noise { name, from: 2, to: 1, power, exponent });
        one("id", 2.0 * CHARGE * i, 0.0);
        // of 1/f noise it is 1e-38 A at least, as in ngspice
        one("1overf", c[FLICKER] * i.max(1e-38).powf(c[FLICKER_EXPONENT]), 1.0);
    }

    /// Of the depletion charge in closed form, of the diffusion charge by Gauss-Legendre's rule on intervals over which the current
    /// changes by no more than a few times.
    fn energy(card: &Card<CONSTANTS>, &[v]: &[f64; 1], gmin: f64) -> Option<f64> {
        let c = &card.of;
        let depletion: f64 = [INVERSE_VJ, SIDE_CHARGE]
            .iter()
            .filter(|&&at| c[at + SCALE - INVERSE_VJ] != 0.0)
            .map(|&at| stored(c, at, v))
            .sum();
        if c[TRANSIT_TIME] == 0.0 {
            return Some(depletion);
        }
        let conductance = |v: f64| Diode::law(c, card.has, [Dual::<f64, 1>::port(v, 0)], gmin).i[0].d[0];
        let (mut sum, mut from, mut width) = (0.0, 0.0_f64, c[VTE]);
        // more intervals than any diode's energy wants
        for _ in 0..4000 {
            let to = if v >= from {
                v.min(from + width)
            } else if from > c[KNEE] {
                v.max(c[KNEE]).max(from - width)
            } else {
                v.max(from - c[VTB])
            };
            for (node, weight) in GAUSS {
                let at = from + node * (to - from);
                sum += weight * (to - from) * at * conductance(at);
            }
            if to == v {
                break;
            }
            (from, width) = (to, if v < 0.0 { 2.0 * width } else { width });
        }
        Some(depletion + c[TRANSIT_TIME] * sum)
    }

    fn card(model: &Given, instance: &Given, at: Climate) -> Result<Card<CONSTANTS>, String> {
        let p = Parameters { model, instance };
        if p.get("level") != 1.0 {
            return Err(format!("diode level {} is not known, only level 1", p.get("level")));
        }

        // scale and temperatures
        let area = positive("area", p.given("area").or(p.get("area")))?;
        let multiplicity = positive("m", p.given("m"))?;
        let scale = area * multiplicity;
        let temperature = positive("temp", p.given("temp").or(at.temp + p.given("dtemp")) + ZERO_CELSIUS)?;
        let nominal = positive("tnom", p.get("tnom").or(at.tnom) + ZERO_CELSIUS)?;
        let rise = temperature - nominal;
        let vt = BOLTZMANN / CHARGE * temperature;
        let n = positive("n", p.get("n"))?;
        let vte = n * vt;

        // saturation currents
        let growth = |n: f64| {
            let vte = n * vt;
            (temperature / nominal - 1.0) * p.get("eg") / vte + p.get("xti") / n * (temperature / nominal).ln()
        };
        let saturation = scale * positive("is", p.get("is"))? * growth(n).exp();
        if !(saturation > 0.0 && saturation.is_finite()) {
            return Err(format!("saturation current of a diode is {saturation} A at {} C", temperature - ZERO_CELSIUS));
        }
        let perimeter = p.perimeter(multiplicity)?;
        let ns = positive("ns", p.get("ns").or(1.0))?;
        let of_sidewall = perimeter * p.not_negative("jsw")? * growth(ns).exp();
        let own_slope = !p.get("ns").is_nan();
        let merged = saturation + if own_slope { 0.0 } else { of_sidewall };

        let mut card = Card { has: 0, of: [0.0; CONSTANTS] };
        let c = &mut card.of;
        put_wall(c, SATURATION, merged, vte);
        put_wall(c, SIDE, 0.0, vte);
        for at in [INVERSE_VJ, SIDE_CHARGE] {
            c[at + ONE_M - INVERSE_VJ] = 0.5;
        }
        (c[KNEE_FORWARD], c[KNEE_REVERSE]) = (inverse_knee(p.get("ikf"), scale), -inverse_knee(p.get("ikr"), scale));
        if c[KNEE_FORWARD] != 0.0 || c[KNEE_REVERSE] != 0.0 {
            card.has |= KNEES;
        }
        c[TRANSIT_TIME] = p.not_negative("tt")? * p.warmed("ttt", rise);
        (c[VTE], c[VTB], c[VCRIT]) = (vte, vte, limits::critical(vte, saturation));

        c[FLICKER_EXPONENT] = p.get("af");
        c[FLICKER] = p.not_negative("kf")? * multiplicity.powf(1.0 - p.get("af"));
        let rs = p.not_negative("rs")? * p.warmed("trs", rise);
        if rs > 0.0 {
            c[SERIES] = scale / rs;
        }

        let law = |slope: &str, built_in: &str| (p.get("tlevc") == 1.0).then(|| (p.get(slope), p.get(built_in)));
        let c0 = p.not_negative("cjo")? * scale;
        if c0 > 0.0 {
            let (vj, m) = (positive("vj", p.get("vj"))?, p.get("m") * p.warmed("tm", rise));
            let law = law("cta", "tpb");
            let powers = put_depletion(c, INVERSE_VJ, [c0, vj, m, p.get("fc")], [temperature, nominal], law)?;
            card.has |= CHARGED | if powers { POWERS } else { 0 };
        }
        let c0 = p.not_negative("cjp")? * perimeter;
        if of_sidewall > 0.0 && own_slope {
            put_wall(c, SIDE, of_sidewall, ns * vt);
            card.has |= SIDE_WALL;
        }
        card.has |= p.put_breakdown(c, card.has, [rise, vt, n], [saturation, multiplicity])?;
        if c0 > 0.0 {
            let php = positive("php", p.get("php"))?;
            let side = [c0, php, p.get("mjsw"), p.get("fcs")];
            let powers = put_depletion(c, SIDE_CHARGE, side, [temperature, nominal], law("ctp", "tphp"))?;
            card.has |= SIDE_CHARGED | if powers { SIDE_POWERS } else { 0 };
        } else if card.has & SIDE_WALL != 0 {
            positive("php", p.get("php"))?;
        }
        let breaks = card.has & BREAKS != 0;
        c[QUIET] = (2.0 * vte.min(c[VTB])).min(1.0);
        c[NEAR_KNEE] = if breaks { (c[KNEE] + 10.0 * c[VTB]).min(0.0) } else { 10.0 * NO_KNEE };
        Ok(card)
    }
}

/// What a card and a line say.
struct Parameters<'a> {
    model: &'a Given<'a>,
    instance: &'a Given<'a>,
}

fn positive(name: &str, value: f64) -> Result<f64, String> {
    match value > 0.0 {
        true => Ok(value),
        false => Err(format!("{name}= of a diode must be positive, it is {value:?}")),
    }
}

impl Parameters<'_> {
    fn get(&self, name: &str) -> f64 {
        self.model.get(name)
    }

    fn given(&self, name: &str) -> f64 {
        self.instance.get(name)
    }

    fn not_negative(&self, name: &str) -> Result<f64, String> {
        match self.get(name) {
            value if value >= 0.0 => Ok(value),
            value => Err(format!("{name}= of a diode must not be negative, it is {value:?}")),
        }
    }

    fn perimeter(&self, multiplicity: f64) -> Result<f64, String> {
        let pj = self.given("pj").or(self.get("pj"));
        match multiplicity * pj {
            whole if whole >= 0.0 && whole.is_finite() => Ok(whole),
            _ => Err(format!("pj= of a diode must not be negative, it is {pj:?}")),
        }
    }

    /// 1 + t1 rise + t2 rise^2
    fn warmed(&self, name: &str, rise: f64) -> f64 {
        let [first, second] = ["1", "2"].map(|order| self.get(&format!("{name}{order}")));
        1.0 + first * rise + second * rise * rise
    }

    /// Breakdown of the walls that it `has`, where there is one: the bit that says so.
    fn put_breakdown(
        &self,
        c: &mut [f64; CONSTANTS],
        has: u32,
        [rise, vt, n]: [f64; 3],
        [saturation, multiplicity]: [f64; 2],
    ) -> Result<u32, String> {
        let (voltage, nbv) = (self.get("bv"), positive("nbv", self.get("nbv").or(n))?);
        if voltage < 0.0 {
            return Err(format!("bv of a diode must not be negative, it is {voltage}"));
        }
        if !(voltage > 0.0 && voltage.is_finite()) {
            return Ok(0);
        }
        let shifted = match self.get("tlev") {
            0.0 => voltage - self.get("tcv") * rise,
            _ => voltage * (1.0 - self.get("tcv") * rise),
        };
        let current = positive("ibv", self.get("ibv"))? * multiplicity;
        let knee = fit_breakdown(shifted, current, saturation, vt, nbv * vt);
        break_down(c, SATURATION, knee, nbv * vt);
        if has & SIDE_WALL != 0 {
            break_down(c, SIDE, knee, nbv * vt);
        }
        c[VTB] = nbv * vt;
        Ok(BREAKS)
    }
}

/// Current of the wall whose constants begin at `at`.
#[inline(always)]
fn wall<R: Real>(c: &impl Constants<R::Const>, at: usize, breaks: bool, v: R) -> R {
    let (one, inverse_vt, largest) = (v.of(1.0), c.at(at + INVERSE_VT), c.at(at + LARGEST));
    let ratio = v.recip() * c.at(at + REVERSE_SCALE);
    let reverse = -(ratio * ratio * ratio) - one;
    let reversed = v.lt(c.at(at + REVERSE_START));
    let current = if breaks {
        let knee = c.at(at + KNEE);
        let broken = v.lt(knee);
        let x = R::pick(broken, (v - knee) * c.at(at + BREAK_INVERSE_VT), v * inverse_vt);
        let e = x.limexp(R::choose(broken, c.at(at + BREAK_LARGEST), largest));
        R::pick(broken, -e + c.at(at + START), R::pick(reversed, reverse, e - one))
    } else {
        R::pick(reversed, reverse, (v * inverse_vt).limexp(largest) - one)
    };
    current * c.at(at + SATURATION)
}

/// Depletion charge; its constants begin at `at`.
#[inline(always)]
fn depletion<R: Real>(c: &impl Constants<R::Const>, at: usize, powers: bool, v: R) -> R {
    let get = at - INVERSE_VJ;
    let (one, from) = (v.of(1.0), c.at(get + LINEAR_FROM));
    let left = (-(v * c.at(get + INVERSE_VJ)) + one).at_least(v.of(TINY));
    let power = if powers { left.pow(c.at(get + ONE_M)) } else { left.sqrt() };
    let beyond = v - from;
    let line = beyond * (beyond * c.at(get + HALF_SLOPE) + c.at(get + C_LINEAR)) + c.at(get + Q_LINEAR);
    R::pick(v.lt(from), (-power + one) * c.at(get + SCALE), line)
}

/// The wall at `at` carries this saturation current, and does not break down.
fn put_wall(c: &mut [f64; CONSTANTS], at: usize, saturation: f64, vte: f64) {
    c[at + SATURATION] = saturation;
    c[at + INVERSE_VT] = 1.0 / vte;
    c[at + LARGEST] = largest(saturation);
    c[at + REVERSE_START] = -3.0 * vte;
    c[at + REVERSE_SCALE] = 3.0 * vte / std::f64::consts::E;
    c[at + KNEE] = NO_KNEE;
    c[at + BREAK_LARGEST] = 1.0;
}

/// The argument at which is exp(x) passes HUGE_CURRENT.
fn largest(saturation: f64) -> f64 {
    (HUGE_CURRENT / saturation).ln().clamp(1.0, 600.0)
}

/// From -voltage downwards, from the current that the reverse branch has there.
fn break_down(c: &mut [f64; CONSTANTS], at: usize, voltage: f64, vt: f64) {
    let reached = wall(c, at, false, -voltage) / c[at + SATURATION];
    c[at + START] = reached + 1.0;
    c[at + KNEE] = -voltage;
    c[at + BREAK_INVERSE_VT] = -1.0 / vt;
    c[at + BREAK_LARGEST] = largest(c[at + SATURATION]);
}

/// Temperature laws of ngspice's diotemp.c for the depletion charge at `at`, of [c0, vj, m, fc] at [temperature, nominal]. `law` = (cta, tpb)
/// for tlevc = 1. Is m another than 1/2?
fn put_depletion(
    c: &mut [f64; CONSTANTS],
    at: usize,
    [c0, vj, m, fc]: [f64; 4],
    [temperature, nominal]: [f64; 2],
    law: Option<(f64, f64)>,
) -> Result<bool, String> {
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
    let numbers =
        [1.0 / vj, 1.0 - m, c0 * vj / (1.0 - m), fc * vj, q_linear, c_linear, 0.5 * c_linear * m / (vj * (1.0 - fc))];
    c[at..at + numbers.len()].copy_from_slice(&numbers);
    Ok(m != 0.5)
}

/// Integral of v dq of the depletion charge at `at` from 0 V, with a = 1 - v/vj:
/// c0 vj^2 ((1 - a^(1-m))/(1-m) - (1 - a^(2-m))/(2-m)), then a cubic.
fn stored(c: &[f64; CONSTANTS], at: usize, v: f64) -> f64 {
    let [inverse_vj, one_m, scale, from, _, c_linear, half_slope] = [0, 1, 2, 3, 4, 5, 6].map(|k| c[at + k]);
    let a = 1.0 - v.min(from) * inverse_vj;
    let part = |p: f64| (1.0 - a.powf(p)) / p;
    // scale = c0 vj / (1 - m)
    let curved = scale * one_m * (part(one_m) - part(1.0 + one_m)) / inverse_vj;
    let beyond = (v - from).max(0.0);
    let line = from * (c_linear + half_slope * beyond) + beyond * (0.5 * c_linear + 2.0 / 3.0 * half_slope * beyond);
    curved + beyond * line
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

#[cfg(test)]
mod tests;
