//! Against ngspice 39.3, and against the diode's own derivatives.

use super::super::class::{Asked, Class, Instances, Number};
use super::*;
use std::collections::HashMap;
use std::ops::Deref;

fn map(pairs: &[(&str, f64)]) -> HashMap<String, f64> {
    pairs.iter().map(|&(k, v)| (k.to_string(), v)).collect()
}

struct One(Card<CONSTANTS>);

#[derive(Debug, PartialEq)]
struct Out {
    i: f64,
    g: f64,
    q: f64,
    c: f64,
}

impl Deref for One {
    type Target = [f64; CONSTANTS];

    fn deref(&self) -> &Self::Target {
        &self.0.of
    }
}

impl One {
    fn new(model: &[(&str, f64)], instance: &[(&str, f64)]) -> Result<One, String> {
        let (model, instance) = (map(model), map(instance));
        let climate = Climate { temp: 27.0, tnom: 27.0 };
        Diode::card(&Given::new(&model, MODEL), &Given::new(&instance, INSTANCE), climate).map(One)
    }

    fn eval(&self, v: f64, gmin: f64) -> Out {
        let Flow { i: [i], q: [q] } = Diode::law(&self.0.of, self.0.has, [Dual::<f64, 1>::port(v, 0)], gmin);
        Out { i: i.v, g: i.d[0], q: q.v, c: q.d[0] }
    }

    fn limit(&self, v: f64, before: f64) -> (f64, bool) {
        let mut v = [v];
        let moved = Diode::limit(&self.0, &mut v, &[before]);
        (v[0], moved)
    }

    fn series_conductance(&self) -> Option<f64> {
        Diode::series(&self.0, 0)
    }
}

fn diode(model: &[(&str, f64)], instance: &[(&str, f64)]) -> One {
    One::new(model, instance).unwrap()
}

const TYPICAL: &[(&str, f64)] =
    &[("is", 2e-14), ("n", 1.2), ("cjo", 2e-12), ("vj", 0.8), ("m", 0.4), ("tt", 5e-9), ("bv", 20.0), ("ibv", 1e-3)];

fn close(got: f64, want: f64, tolerance: f64, what: &str) {
    assert!((got - want).abs() <= tolerance * want.abs(), "{what}: {got:e} {want:e}");
}

/// (v, i, g, c); c = 0 is not compared.
fn compare(d: &One, table: &[(f64, f64, f64, f64)], tolerance: f64) {
    for &(v, i, g, c) in table {
        let out = d.eval(v, 1e-12);
        close(out.i, i, tolerance, &format!("i({v})"));
        close(out.g, g, tolerance, &format!("g({v})"));
        if c != 0.0 {
            close(out.c, c, tolerance, &format!("c({v})"));
        }
    }
}

// V1 1 0 <v>    D1 1 0 DM area=2 m=3    .model DM D(is=2e-14 n=1.2 cjo=2p vj=0.8 m=0.4 tt=5n bv=20 ibv=1m)
// op, print @d1[id] @d1[gd]; capacitance by `ac lin 1 159154.943091895 ...` through a 0 V source (omega = 1e6).
// One ngspice process for each voltage: in 39.3 repeated analyses multiply area and m in again.
#[test]
fn ngspice_with_area_and_multiplicity() {
    compare(
        &diode(TYPICAL, &[("area", 2.0), ("m", 3.0)]),
        &[
            (-20.4, -1.18598228841e+03, 3.821077691456e+04, 1.910538878078e-04),
            (-20.0, -2.99999993078e-03, 9.665601961848e-02, 4.865399052339e-10),
            (-10.0, -1.01199999952e-11, 1.000000001447e-12, 4.236895369195e-12),
            (-1.0, -1.11999517676e-12, 1.000014469710e-12, 8.675774174582e-12),
            (-0.2, -3.19397095420e-13, 1.009043568706e-12, 1.097532125130e-11),
            (-0.05, -1.46035872263e-13, 1.772092423186e-12, 1.171250180669e-11),
            (0.1, 2.988988212432e-12, 9.794561077975e-11, 1.265837745672e-11),
            (0.39, 3.437302032624e-08, 1.107445442883e-06, 1.568400790680e-11),
            (0.41, 6.547327351086e-08, 2.109453722283e-06, 1.600298314718e-11),
            (0.6, 2.982748907059e-05, 9.610021370317e-04, 2.380592460029e-11),
            (0.9, 4.702560692280e-01, 1.515102706809e+01, 7.577888648285e-08),
        ],
        2e-10,
    );
}

// D1 1 0 DM3 area=2 m=3    .model DM3 D(is=2e-14 n=1.2 ikf=1m tt=5n)
#[test]
fn ngspice_high_injection() {
    compare(
        &diode(&[("is", 2e-14), ("n", 1.2), ("ikf", 1e-3), ("tt", 5e-9)], &[("area", 2.0), ("m", 3.0)]),
        &[
            (-1.0, -1.11999517676e-12, 1.000014469710e-12, 5.000072348550e-21),
            (0.1, 2.988924820571e-12, 9.794241994757e-11, 4.897120997378e-19),
            (0.39, 3.429094638475e-08, 1.103482115685e-06, 5.517410578427e-15),
            (0.6, 2.786295365990e-05, 8.681444455126e-04, 4.340722227563e-12),
            (0.9, 4.772708659127e-02, 8.468837923870e-01, 4.234418961935e-09),
        ],
        2e-10,
    );
}

// D2 1 0 DM temp=85 (the same DM)
#[test]
fn ngspice_hot() {
    compare(
        &diode(TYPICAL, &[("temp", 85.0)]),
        &[
            (-20.4, -4.90415745161e+01, 1.324175236978e+03, 6.620876727612e-06),
            (-20.0, -9.99993653235e-04, 2.700090320063e-02, 1.355514066483e-10),
            (-19.5, -1.38971359523e-09, 3.699824020038e-08, 5.524490583103e-13),
            (-10.0, -2.01877471219e-11, 1.000000208707e-12, 7.120100410283e-13),
            (-1.0, -1.11870521282e-11, 1.002087067948e-12, 1.484307593774e-12),
            (-0.05, -7.59681538629e-12, 7.230801493503e-11, 2.055297788247e-12),
            (0.3, 3.356414917614e-08, 9.065360927005e-07, 2.639791450008e-12),
            (0.41, 6.544900483726e-07, 1.767219996399e-05, 3.055132591768e-12),
            (0.9, 3.646316132553e-01, 9.845445576920e+00, 4.923174167774e-08),
        ],
        2e-9,
    );
}

// D5 1 0 DM5 dtemp=-40    .model DM5 D(is=1e-12 tnom=50 eg=0.69 xti=2 cjo=1n tt=1u)
#[test]
fn ngspice_cold_with_own_nominal_temperature() {
    compare(
        &diode(
            &[("is", 1e-12), ("tnom", 50.0), ("eg", 0.69), ("xti", 2.0), ("cjo", 1e-9), ("tt", 1e-6)],
            &[("dtemp", -40.0)],
        ),
        &[
            (-20.4, -2.04016056338e-11, 1.0, 2.131287139253e-10),
            (-1.0, -1.00160560945e-12, 1.000000072952e-12, 6.890640718827e-10),
            (-0.05, -5.14330432683e-14, 1.007698751532e-12, 9.402237268673e-10),
            (0.3, 1.041234787427e-09, 4.643409374112e-08, 1.138162793664e-09),
            (0.6, 6.748416730317e-04, 3.010269104475e-02, 3.155910795401e-08),
            (0.9, 4.375015475377e+02, 1.951565004752e+04, 1.951565189192e-02),
        ]
        .map(|(v, i, g, c)| (v, i, if g == 1.0 { 1e-12 } else { g }, c)),
        2e-10,
    );
}

// D4 1 0 DM4    .model DM4 D(is=1e-9 bv=5 ibv=1u nbv=2 ikr=1u)
#[test]
fn ngspice_soft_breakdown_with_reverse_knee() {
    compare(
        &diode(&[("is", 1e-9), ("bv", 5.0), ("ibv", 1e-6), ("nbv", 2.0), ("ikr", 1e-6)], &[]),
        &[
            (-5.6, -2.98185612418e-04, 2.891744784236e-03, 0.0),
            (-5.1, -1.67836517175e-06, 2.101798667685e-05, 0.0),
            (-1.0, -9.70324368334e-10, 1.066604919092e-12, 0.0),
            (-0.2, -9.66771274162e-10, 4.263082262409e-11, 0.0),
            (0.3, 1.089575378125e-04, 4.212599542007e-03, 0.0),
            (0.6, 1.187196289587e+01, 4.589986851141e+02, 0.0),
        ],
        1e-6,
    );
}

const SIDED: &[(&str, f64)] = &[
    ("is", 2e-14),
    ("n", 1.2),
    ("cjo", 2e-12),
    ("vj", 0.8),
    ("m", 0.4),
    ("tt", 5e-9),
    ("jsw", 3e-14),
    ("ns", 1.5),
    ("cjp", 1e-12),
    ("php", 0.7),
    ("mjsw", 0.3),
    ("fcs", 0.4),
];

fn side(more: &[(&str, f64)], instance: &[(&str, f64)]) -> One {
    let instance = [&[("area", 2.0), ("pj", 5.0)], instance].concat();
    diode(&[SIDED, more].concat(), &instance)
}

// D6 1 0 DM6 area=2 pj=5    .model DM6 D(is=2e-14 n=1.2 cjo=2p vj=0.8 m=0.4 tt=5n jsw=3e-14 ns=1.5 cjp=1p php=0.7 mjsw=0.3 fcs=0.4)
// print @d6[id] @d6[gd] @d6[cd]
#[test]
fn ngspice_sidewall() {
    compare(
        &side(&[], &[]),
        &[
            (-20.0, -2.018999999833e-11, 1.000000000251e-12, 2.896726327490e-12),
            (-1.0, -1.189986616774e-12, 1.000040149677e-12, 6.723388645234e-12),
            (-0.2, -3.883270967957e-13, 1.025093548064e-12, 8.295329034374e-12),
            (0.1, 2.887612069166e-12, 8.421081115334e-11, 9.456115356134e-12),
            (0.25, 2.203109818499e-10, 6.489469201690e-09, 1.035547910792e-11),
            (0.33, 2.399457907417e-09, 7.252612385692e-08, 1.098488553636e-11),
            (0.41, 2.765357350135e-08, 8.533946902877e-07, 1.170432495282e-11),
            (0.6, 1.072311649690e-05, 3.404544766503e-04, 1.519610849492e-11),
            (0.9, 1.585328175110e-01, 5.096242224543e+00, 2.549753724009e-08),
        ],
        2e-10,
    );
}

// the same without ns, with bv=20 ibv=1m, with temp=85
#[test]
fn ngspice_sidewall_merged_in_breakdown_and_hot() {
    compare(
        &side(&[("ns", f64::NAN)], &[]),
        &[
            (-1.0, -1.189992363209e-12, 1.000022910374e-12, 6.723388645234e-12),
            (0.25, 5.982672909003e-10, 1.927444578807e-08, 1.035554303280e-11),
            (0.9, 7.445721096105e-01, 2.398912619115e+01, 1.199619570731e-07),
        ],
        2e-10,
    );
    let soft = [("php", 1.0), ("mjsw", 0.33), ("fcs", 0.5), ("bv", 20.0), ("ibv", 1e-3)];
    compare(
        &side(&soft, &[]),
        &[
            (-20.4, -1.877805289981e+03, 6.050039678138e+04, 3.025019868047e-04),
            (-20.0, -4.749999878732e-03, 1.530386977287e-01, 7.681108772530e-10),
            (-10.0, -1.018999998662e-11, 1.000000004015e-12, 3.678562033077e-12),
        ],
        2e-10,
    );
    compare(
        &side(&[("fcs", 0.5)], &[("temp", 85.0)]),
        &[
            (-1.0, -4.333610411921e-11, 1.012962706638e-12, 6.884260924332e-12),
            (0.25, 2.222868011815e-08, 5.750679029254e-07, 1.126746215235e-11),
            (0.9, 7.353550977601e-01, 1.982248081286e+01, 9.913195687667e-08),
        ],
        2e-9,
    );
}

// model DM6 with ... php=0.7 tlevc=1 cta=1m tpb=1m ctp=2m tphp=1.5m, temp=85;  with jsw=3e-12 ns=1.5 ikf=1m bv=20
#[test]
fn ngspice_sidewall_with_own_temperature_laws_and_knee() {
    let laws =
        [("mjsw", 0.33), ("fcs", 0.5), ("tlevc", 1.0), ("cta", 1e-3), ("tpb", 1e-3), ("ctp", 2e-3), ("tphp", 1.5e-3)];
    compare(
        &side(&laws, &[("temp", 85.0)]),
        &[
            (-1.0, -4.333610411921e-11, 1.012962706638e-12, 7.062939031915e-12),
            (0.6, 2.306298717471e-04, 6.176810229323e-03, 4.707756266906e-11),
        ],
        2e-9,
    );
    compare(
        &side(&[("jsw", 3e-12), ("cjp", 0.0), ("ikf", 1e-3), ("ikr", 1e-6), ("bv", 20.0)], &[]),
        &[
            (-20.4, -5.452376051200e-01, 8.783448588779e+00, 4.391832129861e-08),
            (0.41, 5.943770151298e-07, 1.532652638029e-05, 5.407444591424e-12),
            (0.9, 2.402132948276e-02, 3.706147619569e-01, 1.860990857249e-09),
        ],
        2e-10,
    );
}

#[test]
fn a_perimeter_without_sidewall_changes_nothing() {
    let (with, without) = (diode(TYPICAL, &[("pj", 7.0)]), diode(TYPICAL, &[]));
    for v in [-20.3, -3.0, 0.1, 0.7, 1.2] {
        assert_eq!(with.eval(v, 1e-12), without.eval(v, 1e-12));
    }
    assert!(One::new(SIDED, &[("pj", -1.0)]).is_err());
}

fn variety() -> Vec<One> {
    vec![
        diode(TYPICAL, &[]),
        diode(&[], &[]),
        diode(
            &[("is", 1e-9), ("bv", 5.0), ("nbv", 2.0), ("ikr", 1e-6), ("ikf", 1e-3), ("cjo", 1e-9), ("tt", 1e-7)],
            &[],
        ),
        side(&[("bv", 9.0)], &[]),
        diode(&[("bv", 0.05), ("cjo", 1e-12), ("m", 0.0), ("fc", 0.0)], &[]),
        diode(&[("vj", 3.0), ("fc", 0.6), ("cjo", 1e-12), ("m", 2.0)], &[("temp", 120.0)]),
    ]
}

#[test]
fn derivatives_are_those_of_current_and_charge() {
    for (k, d) in variety().iter().enumerate() {
        let mut v = -25.0;
        while v < 2.5 {
            v += 0.0137;
            let h = 1e-5;
            let (a, b, o) = (d.eval(v - h, 1e-12), d.eval(v + h, 1e-12), d.eval(v, 1e-12));
            let curvature = (b.g - a.g).abs().max((b.c - a.c).abs());
            let rounding = 4e-16 / h;
            let g = (b.i - a.i) / (2.0 * h);
            assert!(
                (g - o.g).abs() <= 1e-4 * o.g.abs() + (b.g - a.g).abs() + rounding * o.i.abs(),
                "{k} g({v}) {g:e} {:e}",
                o.g
            );
            let c = (b.q - a.q) / (2.0 * h);
            assert!(
                (c - o.c).abs() <= 1e-4 * o.c.abs() + (b.c - a.c).abs() + rounding * o.q.abs(),
                "{k} c({v}) {c:e} {:e}",
                o.c
            );
            assert!(o.g > 0.0 && o.c >= 0.0 && curvature.is_finite());
        }
    }
}

#[test]
fn continuous_at_every_joint() {
    for (k, d) in variety().iter().enumerate() {
        let mut joints = vec![d[REVERSE_START], 0.0, d[SIDE + REVERSE_START], d[LARGEST] * d[VTE]];
        joints.extend(
            [d[KNEE], d[LINEAR_FROM], d[SIDE_CHARGE + LINEAR_FROM - INVERSE_VJ]].iter().filter(|v| **v > NO_KNEE),
        );
        for v in joints {
            let h = 1e-12;
            let (a, b) = (d.eval(v - h, 0.0), d.eval(v + h, 0.0));
            let size = d.eval(v, 0.0);
            assert!(
                (a.i - b.i).abs() <= 3.0 * h * (a.g + b.g) + 1e-14 * size.i.abs(),
                "{k} i at {v}: {:e} {:e}",
                a.i,
                b.i
            );
            assert!(
                (a.q - b.q).abs() <= 3.0 * h * (a.c + b.c) + 1e-14 * size.q.abs(),
                "{k} q at {v}: {:e} {:e}",
                a.q,
                b.q
            );
        }
        // the joint of forward and reverse is smooth
        let slope = |v: f64| wall(&d.0.of, SATURATION, false, Dual::<f64, 1>::port(v, 0)).d[0];
        let (a, b) = (slope(d[REVERSE_START] - 1e-12), slope(d[REVERSE_START] + 1e-12));
        close(a, b, 1e-9, "slope at -3 n vt");
    }
}

#[test]
fn no_overflow_anywhere() {
    for d in variety() {
        for v in [f64::MAX, 1e200, 1e10, 1e4, 100.0, -100.0, -1e4, -1e10, -1e200, -f64::MAX] {
            let o = d.eval(v, 1e-12);
            assert!(o.i.is_finite() && o.g.is_finite() && o.q.is_finite() && o.c.is_finite(), "{v} {o:?}");
            assert!(o.g > 0.0 && o.i * v >= 0.0);
        }
        let mut last = f64::NEG_INFINITY;
        for step in -4000..4000 {
            let o = d.eval(f64::from(step) * 0.01, 0.0);
            assert!(o.i >= last, "the current falls at {step}");
            last = o.i;
        }
    }
}

#[test]
fn series_resistance_follows_area_and_temperature() {
    assert_eq!(diode(&[("rs", 0.0)], &[]).series_conductance(), None);
    close(diode(&[("rs", 2.0)], &[("area", 3.0), ("m", 2.0)]).series_conductance().unwrap(), 3.0, 1e-15, "g");
    let warm = diode(&[("rs", 2.0), ("trs1", 1e-2)], &[("dtemp", 50.0)]);
    close(warm.series_conductance().unwrap(), 1.0 / 3.0, 1e-12, "g");
}

#[test]
fn limiting_follows_pnjlim() {
    let d = diode(TYPICAL, &[]);
    let (vt, vcrit) = (d[VTE], d[VCRIT]);
    assert!(vcrit > 0.8 && vcrit < 1.0);
    // small steps and everything below vcrit pass
    assert_eq!(d.limit(0.5, -0.3), (0.5, false));
    assert_eq!(d.limit(1.0, 1.0 - vt), (1.0, false));
    // up and down the exponential
    let (v, limited) = d.limit(5.0, 0.7);
    assert!(limited);
    close(v, 0.7 + vt * (2.0 + (4.3 / vt - 2.0).ln()), 1e-14, "up");
    let (v, limited) = d.limit(1.2, 5.0);
    assert!(limited);
    close(v, 5.0 - vt * (2.0 + (2.0 + 3.8 / vt).ln()), 1e-14, "down");
    let (v, _) = d.limit(5.0, -1.0);
    close(v, vt * (5.0 / vt).ln(), 1e-14, "from reverse");
    // going negative
    assert_eq!(d.limit(-9.0, 0.5), (-1.5, true));
    assert_eq!(d.limit(-9.0, -3.0), (-7.0, true));
    assert_eq!(d.limit(-6.0, -3.0), (-6.0, false));
    // breakdown is the same law mirrored about -bv
    let (v, limited) = d.limit(-30.0, d[KNEE] - 0.7);
    assert!(limited);
    let (mirrored, _) = limits::junction(30.0 + d[KNEE], 0.7, d[VTB], vcrit);
    close(v, d[KNEE] - mirrored, 1e-14, "breakdown");
    // Newton through a resistor reaches breakdown from any start
    for start in [-1.0, 0.0, 0.6, -21.0] {
        let (source, r) = (-60.0, 1e3);
        let mut v: f64 = start;
        let mut count = 0;
        loop {
            let o = d.eval(v, 1e-12);
            let next = v - ((v - source) / r + o.i) / (1.0 / r + o.g);
            let (limited, changed) = d.limit(next, v);
            count += 1;
            if (limited - v).abs() < 1e-9 && !changed {
                break;
            }
            assert!(count < 60, "start {start}");
            v = limited;
        }
        assert!(v < -19.9 && v > -21.0, "{v}");
    }
}

#[test]
fn impossible_parameters_are_refused() {
    for bad in [("is", 0.0), ("n", -1.0), ("vj", 0.0), ("level", 3.0), ("bv", -5.0), ("rs", -1.0), ("tnom", -300.0)] {
        assert!(One::new(&[("cjo", 1e-12), bad], &[]).is_err(), "{bad:?}");
    }
    assert!(One::new(&[], &[("area", 0.0)]).is_err());
    let known = |name: &str| MODEL.iter().find(|p| p.names.contains(&name));
    assert_eq!(known("cj0").unwrap().names[0], "cjo");
    assert!(known("iave").is_none());
}

fn together(all: &[&One]) -> Instances<Diode, 1, 1, CONSTANTS> {
    let mut class = Instances::of(all.iter().map(|one| one.0.clone()).collect());
    class.settle();
    class
}

// Four at a time: as one at a time, to the last places that the exponential and sums that cancel leave.
#[test]
fn four_are_as_one() {
    const A: f64 = 3e8;
    let plain: &[(&str, f64)] = &[("is", 1e-9), ("n", 1.5), ("cjo", 2e-12)];
    let bare: &[(&str, f64)] = &[("is", 1e-14)];
    let knees: &[(&str, f64)] =
        &[("is", 1e-12), ("ikf", 1e-3), ("ikr", 1e-6), ("tt", 1e-8), ("bv", 6.0), ("nbv", 2.0), ("ibv", 1e-6)];
    let huge: &[(&str, f64)] = &[("is", 1e3), ("n", 0.02), ("m", 0.33), ("cjo", 1e-9), ("fc", 0.9)];
    let all = [
        diode(TYPICAL, &[]),
        diode(plain, &[]),
        diode(bare, &[]),
        diode(knees, &[]),
        diode(huge, &[("temp", 30.0)]),
        side(&[("bv", 9.0)], &[]),
    ];
    for count in 1..=all.len() {
        for first in 0..=all.len() - count {
            let diodes: Vec<&One> = all[first..first + count].iter().collect();
            let class = together(&diodes);
            let (mut held, mut lines) = (vec![0.0; class.room_held(count)], vec![0.0; class.room(count)]);
            for k in -2400..1200 {
                // the ends of every branch, and far beyond
                let v = 0.01 * f64::from(k) + 1e-4 * f64::from(k % 7) + if k == 1199 { 1e3 } else { 0.0 };
                let asked = Asked { x: &[v], a: A, gmin: 1e-12, limit: false, near: None };
                assert!(!class.linearise(&asked, &mut held, &mut lines).moved);
                for (lane, d) in diodes.iter().enumerate() {
                    let got = |number| lines[class.place(lane, number)];
                    let (i, g) = (got(Number::Current(0)), got(Number::Conductance(0, 0)));
                    let (q, c) = (got(Number::Charge(0)), got(Number::Capacitance(0, 0)));
                    let want = d.eval(v, 1e-12);
                    let size = want.i.abs() + d[SATURATION] + d[SIDE];
                    let near = |got: f64, want: f64, size: f64| (got - want).abs() <= 1e-14 * size;
                    let stored = want.q.abs() + d[TRANSIT_TIME] * size + d[SCALE] + d[SIDE_CHARGE + SCALE - INVERSE_VJ];
                    assert!(
                        near(i, want.i, size)
                            && near(g, want.g, want.g)
                            && near(q, want.q, stored)
                            && near(c, want.c, want.c),
                        "{count} {first} {lane} {v}: {i:e} {g:e} {q:e} {c:e} {want:?}"
                    );
                    // the same of a stage, from these
                    let stage = (got(Number::StageCurrent(0)), got(Number::StageConductance(0, 0)));
                    assert!(near(stage.0, i + A * q, i.abs() + A * q.abs()), "{v}: {stage:?}");
                    assert!(near(stage.1, g + A * c, g + A * c), "{v}: {stage:?}");
                }
            }
        }
    }
}

// As a symbol: the same value, and by differentiation the same slopes.
#[test]
fn a_graph_reads_the_same_law() {
    use crate::derive::gradient;
    use crate::graph::Graph;
    use crate::tape::{Inputs, Tape};
    for (n, d) in variety().into_iter().enumerate() {
        let class = together(&[&d]);
        let mut g = Graph::new();
        let (v, gmin) = (g.unknown(0), g.unknown(1));
        let (i, q) = class.symbols(0, &mut g, &[v], gmin)[0];
        let outs = [i, q, gradient(&mut g, i, &[v])[0], gradient(&mut g, q, &[v])[0]];
        let tape = Tape::new(&g, &outs).native();
        for k in -2400..200 {
            let v = 0.01 * f64::from(k) + 3e-4;
            let got = tape.eval(&Inputs { x: &[v, 1e-12], t: 0.0, waves: &[], flags: &[] });
            let want = d.eval(v, 1e-12);
            for (got, want) in got.iter().zip([want.i, want.q, want.g, want.c]) {
                assert!((got - want).abs() <= 1e-13 * want.abs() + 1e-26, "{n} at {v}: {got:e} {want:e}");
            }
        }
    }
}

#[test]
fn four_let_no_limiting_pass() {
    let all = [diode(TYPICAL, &[]), diode(&[("is", 1e-9)], &[]), diode(&[("bv", 0.3), ("nbv", 4.0)], &[])];
    let mut passed = 0;
    for d in &all {
        for a in -300..60 {
            for b in -300..60 {
                let (v, before) = (0.1 * f64::from(a), 0.1 * f64::from(b) + 0.003 * f64::from(a % 5));
                if Diode::quiet(&d.0.of, [v], [before]) {
                    passed += 1;
                    assert!(d.limit(v, before) == (v, false), "{v} {before}");
                }
            }
        }
    }
    assert!(passed > 1000, "{passed}");
}
