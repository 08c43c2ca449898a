//! Junction field-effect transistor, n channel, by Shichman and Hodges (1968):
//!
//!   id = beta (max(vgs - vto, 0)^2 - max(vgd - vto, 0)^2) (1 + lambda |vds|)
//!
//! which is the triode and the saturation law in one, in both directions. Gate and channel are two junctions, is (exp(v/vt) - 1) with a
//! depletion charge each, cgs and cgd at 0 V; rd and rs lie outside.
use super::number::{Lane, Real};
use super::{limits, p, Card, Climate, Constants, Device, Flow, Given, Inner, Line, OrElse, Parameter, Spec};

const MODEL: &[Parameter] = &[
    p(&["vto"], "V", -2.0, "threshold voltage"),
    p(&["beta"], "A/V^2", 1e-4, "transconductance parameter"),
    p(&["lambda"], "1/V", 0.0, "channel length modulation"),
    p(&["rd"], "ohm", 0.0, "resistance of the drain"),
    p(&["rs"], "ohm", 0.0, "resistance of the source"),
    p(&["cgs"], "F", 0.0, "gate-source capacitance at 0 V"),
    p(&["cgd"], "F", 0.0, "gate-drain capacitance at 0 V"),
    p(&["pb"], "V", 1.0, "potential of the gate junctions"),
    p(&["is"], "A", 1e-14, "saturation current of the gate junctions"),
];
const INSTANCE: &[Parameter] = &[
    p(&["area"], "", 1.0, "area factor"),
    p(&["m"], "", 1.0, "number of devices in parallel"),
    p(&["temp"], "C", f64::NAN, "temperature (default: that of the circuit)"),
];

constants! { VTO, BETA, LAMBDA, SATURATION, VT, INVERSE_VT, LARGEST, C_S, C_D, INVERSE_PB, SLOPE_FROM, VCRIT, G_D, G_S }

const CHARGED: u32 = 1;

pub struct Jfet;

impl Device<2, 3, CONSTANTS> for Jfet {
    const SPEC: Spec = Spec {
        name: "njf",
        terminals: &["drain", "gate", "source"],
        inner: &[Inner { name: "drain", behind: 0 }, Inner { name: "source", behind: 2 }],
        model: MODEL,
        instance: INSTANCE,
    };
    // gate to inner source, gate to inner drain
    const PORTS: [(usize, usize); 2] = [(1, 4), (1, 3)];
    // channel, and the two junctions
    const BRANCHES: [(usize, usize); 3] = [(3, 4), (1, 4), (1, 3)];

    fn card(model: &Given, instance: &Given, at: Climate) -> Result<Card<CONSTANTS>, String> {
        let get = |name: &str| model.get(name);
        for name in ["beta", "is", "pb"] {
            if !(get(name) > 0.0) {
                return Err(format!("{name}= of a jfet must be positive, it is {:?}", get(name)));
            }
        }
        let scale = instance.get("area") * instance.get("m");
        let vt = 1.380_648_52e-23 / 1.602_176_620_8e-19 * (instance.get("temp").or(at.temp) + 273.15);
        let mut card = Card { has: 0, of: [0.0; CONSTANTS] };
        let c = &mut card.of;
        (c[VTO], c[BETA], c[LAMBDA]) = (get("vto"), scale * get("beta"), get("lambda"));
        (c[SATURATION], c[VT], c[INVERSE_VT]) = (scale * get("is"), vt, 1.0 / vt);
        c[LARGEST] = (1e15 / c[SATURATION]).ln();
        (c[C_S], c[C_D]) = (scale * get("cgs"), scale * get("cgd"));
        (c[INVERSE_PB], c[SLOPE_FROM]) = (1.0 / get("pb"), 0.5 * get("pb"));
        c[VCRIT] = limits::critical(vt, c[SATURATION]);
        (c[G_D], c[G_S]) = (conductance(get("rd"), scale), conductance(get("rs"), scale));
        if c[C_S] != 0.0 || c[C_D] != 0.0 {
            card.has |= CHARGED;
        }
        Ok(card)
    }

    fn series(card: &Card<CONSTANTS>, k: usize) -> Option<f64> {
        Some(card.of[[G_D, G_S][k]]).filter(|&g| g > 0.0)
    }

    #[inline(always)]
    fn law<R: Real>(c: &impl Constants<R::Const>, has: u32, [vgs, vgd]: [R; 2], gmin: R::Const) -> Flow<R, 3> {
        let (one, zero) = (vgs.of(1.0), vgs.of(0.0));
        let (s, d) = ((vgs - c.at(VTO)).at_least(zero), (vgd - c.at(VTO)).at_least(zero));
        let vds = vgs - vgd;
        let length = R::pick(vds.lt(zero), -vds, vds) * c.at(LAMBDA) + one;
        let channel = (s * s - d * d) * length * c.at(BETA);
        let gate = [vgs, vgd].map(|v| ((v * c.at(INVERSE_VT)).limexp(c.at(LARGEST)) - one) * c.at(SATURATION) + v * gmin);
        let mut q = [vgs.fixed(zero), vgs * zero, vgd * zero];
        if has & CHARGED != 0 {
            q = [q[0], depletion(c, vgs) * c.at(C_S), depletion(c, vgd) * c.at(C_D)];
        }
        Flow { i: [channel, gate[0], gate[1]], q }
    }

    fn limit(card: &Card<CONSTANTS>, new: &mut [f64; 2], old: &[f64; 2]) -> bool {
        let mut moved = false;
        for (new, old) in new.iter_mut().zip(old) {
            let (to, here) = limits::junction(*new, *old, card.of[VT], card.of[VCRIT]);
            *new = to;
            moved |= here;
        }
        moved
    }

    #[inline(always)]
    fn quiet<L: Lane>(c: &impl Constants<L>, new: [L; 2], old: [L; 2]) -> L::Mask {
        L::both((new[0] - old[0]).abs().lt(c.at(VT)), (new[1] - old[1]).abs().lt(c.at(VT)))
    }

    fn bend(card: &Card<CONSTANTS>, _: usize) -> f64 {
        card.of[VT]
    }

    fn output(_: &Card<CONSTANTS>, word: &str, _: &[f64; 2], at: &Line) -> Option<f64> {
        // slopes of the channel's current by vgs and vgd
        match word {
            "gm" => Some(at.g[0] + at.g[1]),
            "gds" => Some(-at.g[1]),
            _ => None,
        }
    }
}

fn conductance(ohm: f64, scale: f64) -> f64 {
    if ohm > 0.0 {
        scale / ohm
    } else {
        0.0
    }
}

/// Charge of a junction of 1 F at 0 V and of grade 1/2: 2 pb (1 - sqrt(1 - v/pb)), going on straight beyond pb/2.
#[inline(always)]
fn depletion<R: Real>(c: &impl Constants<R::Const>, v: R) -> R {
    let (one, from) = (v.of(1.0), c.at(SLOPE_FROM));
    let root = (-(v * c.at(INVERSE_PB)) + one).at_least(v.of(0.5)).sqrt();
    // from = pb/2, so 2 pb = 4 from; the slope there is sqrt 2
    let curved = (-root + one) * from * v.of(4.0);
    curved + (v - from).at_least(v.of(0.0)) * v.of(std::f64::consts::SQRT_2)
}
