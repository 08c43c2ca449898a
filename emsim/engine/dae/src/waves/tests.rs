//! Against ngspice 39.3, and corner by corner.

use super::*;

fn wave(kind: &str, args: &[f64]) -> Wave {
    Wave::new(kind, args, None).unwrap()
}

fn breakpoints(w: &Wave, until: f64) -> Vec<f64> {
    let mut all = Vec::new();
    let mut t = w.next_breakpoint(-1.0);
    while t <= until {
        all.push(t);
        t = w.next_breakpoint(t);
    }
    all
}

fn near(a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= 1e-12 * y.abs().max(1e-9), "{a:?} {b:?}");
    }
}

#[test]
fn pulse_corners_and_values() {
    let w = wave("pulse", &[1.0, 3.0, 0.1, 0.2, 0.3, 0.4, 2.0, 0.0]);
    near(&breakpoints(&w, 4.2), &[0.1, 0.3, 0.7, 1.0, 2.1, 2.3, 2.7, 3.0, 4.1]);
    for (t, v) in
        [(0.0, 1.0), (0.1, 1.0), (0.2, 2.0), (0.3, 3.0), (0.5, 3.0), (0.7, 3.0), (0.85, 2.0), (1.0, 1.0), (2.2, 2.0)]
    {
        assert!((w.value(t) - v).abs() < 1e-14, "{t} {}", w.value(t));
    }
    assert_eq!(w.dc_value(), 1.0);
    assert!((w.shortest() - 0.2).abs() < 1e-15);
}

#[test]
fn pulse_cut_off_by_its_period_and_limited_in_number() {
    // ngspice 39.3: PULSE(1 3 0.1u 0.2u 0.3u 0.4u 0.7u 2) at 0.155u 0.375u 0.845u 1.035u 1.445u 1.665u
    let u = 1e-6;
    let w = wave("pulse", &[1.0, 3.0, 0.1 * u, 0.2 * u, 0.3 * u, 0.4 * u, 0.7 * u, 2.0]);
    for (t, v) in [(0.155, 1.55), (0.375, 3.0), (0.845, 1.45), (1.035, 3.0), (1.445, 2.7), (1.665, 1.0), (9.0, 1.0)] {
        assert!((w.value(t * u) - v).abs() < 1e-9, "{t} {}", w.value(t * u));
    }
    near(&breakpoints(&w, 1.0), &[0.1, 0.3, 0.7, 0.8, 1.0, 1.4, 1.5].map(|t| t * u));
    // cut off at 0.8u on the way down, and for good at 1.5u
    assert!((w.value_before(0.8 * u) - (3.0 - 2.0 / 3.0)).abs() < 1e-9);
    assert_eq!(w.value(0.8 * u), 1.0);
    assert!((w.value_before(1.5 * u) - (3.0 - 2.0 / 3.0)).abs() < 1e-9);
    assert_eq!(w.value(1.5 * u), 1.0);
}

#[test]
fn pulse_with_negative_delay() {
    // ngspice 39.3: PULSE(1 3 -0.3u 0.2u 0.3u 0.7u 1u) at 0 0.625u 0.845u 2.735u
    let w = wave("pulse", &[1.0, 3.0, -0.3, 0.2, 0.3, 0.7, 1.0, 0.0]);
    for (t, v) in [(0.0, 3.0), (0.625, 2.0 + 5.0 / 6.0), (0.845, 2.45), (2.735, 1.35)] {
        assert!((w.value(t) - v).abs() < 1e-9, "{t} {}", w.value(t));
    }
    assert_eq!(w.dc_value(), 3.0);
    near(&[w.next_breakpoint(0.0), w.next_breakpoint(0.7)], &[0.6, 0.9]);
}

#[test]
fn pulse_jumps_have_two_sides() {
    let w = wave("pulse", &[0.0, 5.0, 1.0, 0.0, 0.0, 0.3, 0.7, 0.0]);
    let mut t = 0.0;
    for i in 0..4000 {
        t = w.next_breakpoint(t);
        let (before, after) = (w.value_before(t), w.value(t));
        assert_eq!((before, after), if i % 2 == 0 { (0.0, 5.0) } else { (5.0, 0.0) }, "{i} {t}");
        assert_eq!(w.value(t * (1.0 - 1e-13)), before);
        assert_eq!(w.value_before(t * (1.0 + 1e-13)), after);
    }
    let step = wave("pulse", &[0.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!((step.dc_value(), step.value(0.0), step.value(1.0)), (0.0, 5.0, 0.0));
    assert_eq!(step.next_breakpoint(1.0), f64::INFINITY);
}

#[test]
fn pulse_does_not_drift_over_a_million_periods() {
    let (rise, width, period) = (1.3e-7, 2.9e-6, 7.1e-6);
    let w = wave("pulse", &[-1.0, 2.0, 3e-7, rise, rise, width, period, 0.0]);
    for k in [0u64, 1, 7, 99_999, 1_000_000] {
        let start = 3e-7 + k as f64 * period;
        let t = w.next_breakpoint(start - 0.1 * period);
        assert!((t - start).abs() <= 1e-15 * start.max(1e-6), "{k}");
        let corners = [(t, -1.0), (w.next_breakpoint(t), 2.0)];
        let top = w.next_breakpoint(corners[1].0);
        for (t, v) in [corners[0], corners[1], (top, 2.0), (w.next_breakpoint(top), -1.0)] {
            assert_eq!(w.value(t), v, "{k} {t} {}", w.value(t));
        }
    }
}

#[test]
fn sine_with_delay_damping_and_phase() {
    // ngspice 39.3: SIN(0.5 1 300k 1u 2e5 50)
    let w = wave("sin", &[0.5, 1.0, 300e3, 1e-6, 2e5, 50.0]);
    for (t, v) in [(0.0, 1.26604), (0.845e-6, 1.26604), (1.035e-6, 1.30113), (2.955e-6, -0.16831), (5.995e-6, 0.22015)]
    {
        assert!((w.value(t) - v).abs() < 6e-6, "{t} {}", w.value(t));
    }
    near(&breakpoints(&w, 1.0), &[1e-6]);
    // a whole number of periods late is where it began
    let plain = wave("sin", &[0.0, 1.0, 50.0, 0.0, 0.0, 30.0]);
    assert!((plain.value(2e4) - 0.5).abs() < 1e-12);
    assert_eq!(plain.next_breakpoint(0.0), f64::INFINITY);
}

#[test]
fn exponential_and_its_odd_order_of_delays() {
    let w = wave("exp", &[1.0, 5.0, 1.0, 0.5, 3.0, 0.25]);
    near(&breakpoints(&w, 10.0), &[1.0, 3.0]);
    assert_eq!(w.value(1.0), 1.0);
    assert!((w.value(2.0) - (1.0 + 4.0 * (1.0 - (-2.0f64).exp()))).abs() < 1e-14);
    assert!((w.value(3.0) - w.value_before(3.0)).abs() < 1e-14);
    // ngspice 39.3: EXP(0 1 2u 1u 1u 3u) at 1.885u 2.075u 4.115u: the fall waits for the rise, then jumps
    let odd = wave("exp", &[0.0, 1.0, 2.0, 1.0, 1.0, 3.0]);
    for (t, v) in [(1.885, 0.0), (2.075, -0.2289), (4.115, 0.23341)] {
        assert!((odd.value(t) - v).abs() < 1e-5, "{}", odd.value(t));
    }
}

#[test]
fn modulated_waves() {
    // ngspice 39.3: SFFM(0.5 1 1k 0.4 200 30 70) at t = 0; AM(2 0.3 100 1k 0) at 10u
    let fm = wave("sffm", &[0.5, 1.0, 1e3, 0.4, 200.0, 30.0, 70.0]);
    assert!((fm.dc_value() - 1.28300097).abs() < 1e-8);
    assert_eq!(fm.next_breakpoint(0.0), f64::INFINITY);
    let am = wave("am", &[2.0, 0.3, 100.0, 1e3, 1e-3, 0.0]);
    let s: f64 = 2.3e-4;
    let want = 2.0 * (0.3 + (TAU * 100.0 * s).sin()) * (TAU * 1e3 * s).sin();
    assert!((am.value(1e-3 + s) - want).abs() < 1e-12);
    assert_eq!(am.value(0.9e-3), 0.0);
    near(&breakpoints(&am, 1.0), &[1e-3]);
    let phased = wave("am", &[2.0, 0.3, 100.0, 1e3, 0.0, 90.0]);
    assert!((phased.value_before(0.0) - 0.0).abs() < 1e-15 && (phased.value(0.0) - 2.6).abs() < 1e-12);
}

#[test]
fn piecewise_linear() {
    let w = wave("pwl", &[1.0, 0.0, 2.0, 4.0, 2.0, 1.0, 3.0, 3.0]);
    for (t, v) in [(0.0, 0.0), (1.0, 0.0), (1.5, 2.0), (2.0, 1.0), (2.5, 2.0), (3.0, 3.0), (9.0, 3.0)] {
        assert_eq!(w.value(t), v, "{t}");
    }
    assert_eq!(w.value_before(2.0), 4.0);
    near(&breakpoints(&w, 9.0), &[1.0, 2.0, 3.0]);
    assert_eq!(w.shortest(), 1.0);
    assert_eq!(wave("pwl", &[0.0, 7.0]).value(3.0), 7.0);
}

#[test]
fn piecewise_linear_repeats_like_ngspice() {
    // ngspice 39.3: PWL(0 0 1u 1 2u 0.5 3u 2) r=1u td=0.5u, and r=0; times in us
    let points = [0.0, 0.0, 1.0, 1.0, 2.0, 0.5, 3.0, 2.0];
    let make = |td: f64, r: f64| wave("pwlr", &[&[td, r], &points[..]].concat());
    let w = make(0.5, 1.0);
    for (t, v) in [
        (0.375, 0.0),
        (0.625, 0.125),
        (1.665, 0.9175),
        (2.735, 0.8525),
        (3.425, 1.8875),
        (3.645, 0.9275),
        (5.305, 1.7075),
    ] {
        assert!((w.value(t) - v).abs() < 1e-12, "{t} {}", w.value(t));
    }
    near(&breakpoints(&w, 6.0), &[0.5, 1.5, 2.5, 3.5, 4.5, 5.5]);
    assert_eq!((w.value_before(3.5), w.value(3.5)), (2.0, 1.0));
    let w = make(0.0, 0.0);
    for (t, v) in [(2.955, 1.9325), (3.175, 0.175), (5.055, 0.5825), (5.995, 1.9925)] {
        assert!((w.value(t) - v).abs() < 1e-12, "{t} {}", w.value(t));
    }
    let mut t = 0.0;
    for i in 1..30_000 {
        t = w.next_breakpoint(t);
        assert!((t - i as f64).abs() < 1e-10);
        assert_eq!(w.value(t), [0.0, 1.0, 0.5][i % 3], "{i}");
    }
    assert_eq!(make(0.0, -1.0).value(7.0), 2.0);
}

#[test]
fn every_wave_advances_and_agrees_across_its_breakpoints() {
    let all = [
        wave("pulse", &[0.0, 1.0, 1e-3, 1e-5, 3e-5, 2e-4, 1e-3, 0.0]),
        wave("sin", &[0.0, 1.0, 1e3, 1e-3, 0.0, 0.0]),
        wave("exp", &[0.0, 1.0, 1e-3, 1e-4, 2e-3, 1e-4]),
        wave("pwlr", &[1e-4, 0.0, 0.0, 0.0, 1e-3, 1.0, 2e-3, 0.0]),
    ];
    for w in &all {
        let mut t = 0.0;
        for _ in 0..500 {
            let next = w.next_breakpoint(t);
            if next.is_infinite() {
                break;
            }
            assert!(next > t);
            assert!((w.value(next) - w.value_before(next)).abs() < 1e-12);
            t = next;
        }
    }
}

#[test]
fn bad_waves_are_refused() {
    for (kind, args) in [
        ("pulse", &[0.0, 1.0][..]),
        ("pulse", &[0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 2.0, 0.0]),
        ("pwl", &[0.0, 1.0, 2.0]),
        ("pwl", &[1.0, 1.0, 0.0, 2.0]),
        ("pwlr", &[0.0, 5.0, 0.0, 1.0, 2.0, 3.0]),
        ("sin", &[f64::NAN; 6]),
        ("square", &[1.0]),
    ] {
        assert!(Wave::new(kind, args, None).is_err(), "{kind} {args:?}");
    }
    assert_eq!(Wave::new("dc", &[2.0], Some(3.0)).unwrap().dc_value(), 3.0);
}

#[test]
fn rates_are_those_of_the_values() {
    let waves = [
        wave("pulse", &[1.0, 3.0, 0.1, 0.2, 0.3, 0.4, 2.0, 0.0]),
        wave("pulse", &[0.0, 5.0, 0.5, 0.3, 0.0, 0.1, 1.0, 2.0]),
        wave("sin", &[1.0, 2.0, 0.7, 0.3, 0.2, 40.0]),
        wave("exp", &[1.0, 3.0, 0.5, 0.3, 1.5, 0.2]),
        wave("sffm", &[1.0, 2.0, 1.5, 0.8, 0.3, 10.0, 20.0]),
        wave("am", &[2.0, 1.0, 0.3, 2.0, 0.4, 30.0]),
        wave("pwl", &[0.2, 1.0, 0.5, 3.0, 0.5, -1.0, 2.0, 4.0]),
        wave("pwlr", &[0.3, 0.0, 0.0, 1.0, 0.5, 2.0, 0.8, 1.0]),
    ];
    // the rate of a slope is the second derivative; what jumps has no slope
    let other_start = Wave::new("dc", &[1.0], Some(2.0)).unwrap();
    let jumps = [other_start, wave("pwlr", &[0.3, 0.2, 0.0, 1.0, 0.5, 2.0, 0.8, 1.5])];
    assert!(jumps.iter().chain([&waves[1], &waves[5], &waves[6]]).all(|w| w.slope().is_none()));
    assert!(Wave::exchanged().slope().is_none() && Wave::input(0.0).slope().is_none());
    let smooth = [wave("am", &[2.0, 1.0, 0.3, 2.0, 0.4, 0.0])];
    let slopes: Vec<Wave> = waves.iter().chain(&smooth).filter_map(Wave::slope).collect();
    assert_eq!(slopes.len(), 6);
    assert!(slopes.iter().all(|w| w.slope().is_none() && w.dc_value() == 0.0));
    for (k, w) in waves.iter().chain(&slopes).enumerate() {
        let (h, tight) = (1e-5, 1e-3);
        for step in 0..4000 {
            let t = 1e-3 * f64::from(step) + 1.7e-4;
            if w.next_breakpoint(t - 2.0 * h) > t + 2.0 * h {
                let centred = (w.value(t + h) - w.value(t - h)) / (2.0 * h);
                assert!((w.rate(t, false) - centred).abs() < tight, "{k} {t} {} {centred}", w.rate(t, false));
                assert_eq!(w.rate(t, false), w.rate(t, true));
            }
        }
        for t in breakpoints(w, 4.0) {
            let after = (w.value(t + h) - w.value(t)) / h;
            let before = (w.value_before(t) - w.value(t - h)) / h;
            assert!((w.rate(t, false) - after).abs() < 100.0 * tight, "{k} {t} {} {after}", w.rate(t, false));
            assert!((w.rate(t, true) - before).abs() < 100.0 * tight, "{k} {t} {} {before}", w.rate(t, true));
        }
    }
}
