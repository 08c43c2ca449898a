use super::*;
use crate::graph::Fun;
use crate::veriloga::folded::{Flow, Kind, Limit, Port, Unknown, GMIN, GROUND};

const VT: f64 = 0.02585;

/// Ebers and Moll's transistor with a base resistance (0: none) and charges: c b e, inner base.
fn transistor(saturation: f64, beta: f64, rb: f64) -> Folded {
    let mut g = Graph::new();
    let unknown = |name: &str| Unknown { name: name.into(), kind: Kind::Voltage };
    let limit = || Some(Limit { function: "pnjlim".into(), arguments: vec![VT, 0.7] });
    let (vbe, vbc, vb) = (g.unknown(0), g.unknown(1), g.unknown(2));
    let vt = g.constant(VT);
    let is = g.constant(saturation);
    let one = g.constant(1.0);
    let gmin = g.given(GMIN);
    let mut current = |v: Id| {
        let x = g.div(v, vt);
        let e = g.call(Fun::Exp, x);
        let e = g.sub(e, one);
        g.mul(is, e)
    };
    let (forward, reverse) = (current(vbe), current(vbc));
    let ice = g.sub(forward, reverse);
    let beta = g.constant(beta);
    let ibe = g.div(forward, beta);
    let leak = g.mul(gmin, vbe);
    let ibe = g.add(ibe, leak);
    let ibc = g.mul(gmin, vbc);
    let tf = g.constant(1e-9);
    let qbe = g.mul(tf, forward);
    let cjc = g.constant(2e-12);
    let qbc = g.mul(cjc, vbc);
    let zero = g.constant(0.0);
    let (inner, ib) = if rb > 0.0 { (3, g.constant(1.0 / rb)) } else { (3, zero) };
    let ib = g.mul(ib, vb);
    let port = |from, to, limit| Port { from, to, limit };
    let flow = |from, to, i, q| Flow { from, to, i, q };
    Folded {
        unknowns: ["c", "b", "e", "base"].map(unknown).into(),
        terminals: 3,
        merged: if rb > 0.0 { vec![] } else { vec![(1, 3)] },
        ports: vec![port(inner, 2, limit()), port(inner, 0, limit()), port(1, 3, None)],
        flows: vec![flow(0, 2, ice, zero), flow(inner, 2, ibe, qbe), flow(inner, 0, ibc, qbc), flow(1, 3, ib, zero)],
        graph: g,
        noise: vec![],
        outputs: vec![],
        starts: vec![],
        modes: vec![],
        behaves: false,
        stimuli: Vec::new(),
        noise_tables: Vec::new(),
        bound_step: None,
        said: vec![],
        left_out: vec![],
    }
}

fn seated(all: &[Folded]) -> Vec<Box<dyn Class>> {
    let (mut classes, mut lately) = (Vec::new(), Lately::default());
    let mut next = 3;
    for (k, folded) in all.iter().enumerate() {
        let mut inner = |_: Wanted| {
            next += 1;
            next - 1
        };
        let (places, folded) = ((&mut classes, &mut lately), Arc::new(folded.clone()));
        seat(places, "bjt", (&format!("q{k}"), &[0, 1, 2]), &folded, 1.0, &mut inner).unwrap();
    }
    classes.iter_mut().for_each(|c| c.settle());
    classes
}

#[test]
fn instances_of_one_shape_share_a_class_and_a_resistance_of_zero_is_another() {
    let classes = seated(&[
        transistor(1e-15, 100.0, 10.0),
        transistor(3e-15, 80.0, 5.0),
        transistor(3e-15, 80.0, 0.0),
        transistor(2e-15, 120.0, 0.0),
    ]);
    let seats: Vec<usize> = classes.iter().map(|c| c.seats().len()).collect();
    assert_eq!(seats, [2, 2]);
    assert_eq!(classes[0].ports(), 3);
    assert_eq!(classes[1].ports(), 2);
    // without a base resistance the inner base is the base
    assert_eq!(classes[1].seats()[0].nodes, [0, 1, 2, -1]);
}

#[test]
fn slopes_are_those_of_the_currents() {
    let classes = seated(&[transistor(1e-15, 100.0, 10.0)]);
    let class = &classes[0];
    let v = [0.62, -1.3, 0.01];
    let at = |v: &[f64]| {
        let mut line = Line::default();
        class.at(0, v, 1e-12, &mut line);
        line
    };
    let line = at(&v);
    for p in 0..3 {
        let (mut up, mut down) = (v, v);
        up[p] += 1e-6;
        down[p] -= 1e-6;
        let (up, down) = (at(&up), at(&down));
        for j in 0..line.i.len() {
            let (g, c) = ((up.i[j] - down.i[j]) / 2e-6, (up.q[j] - down.q[j]) / 2e-6);
            assert!((line.g[j * 3 + p] - g).abs() < 1e-6 * g.abs() + 1e-12, "i{j} by v{p}");
            assert!((line.c[j * 3 + p] - c).abs() < 1e-6 * c.abs() + 1e-17, "q{j} by v{p}");
        }
    }
    // and the symbols are the same currents
    let mut g = Graph::new();
    let ports: Vec<Id> = (0..3).map(|k| g.unknown(k)).collect();
    let gmin = g.constant(1e-12);
    let flows = class.symbols(0, &mut g, &ports, gmin);
    let outs: Vec<Id> = flows.iter().flat_map(|f| [f.0, f.1]).collect();
    let values = crate::tape::Tape::new(&g, &outs).eval(&Inputs { x: &v, t: 0.0, waves: &[], flags: &[] });
    for (j, pair) in values.chunks_exact(2).enumerate() {
        assert!((pair[0] - line.i[j]).abs() <= 1e-13 * line.i[j].abs());
        assert!((pair[1] - line.q[j]).abs() <= 1e-13 * line.q[j].abs());
    }
}

#[test]
fn a_group_holds_every_instance_as_it_is_alone() {
    let all: Vec<Folded> =
        (0..7).map(|k| transistor(1e-15 * (k + 1) as f64, 50.0 + k as f64, 10.0 + k as f64)).collect();
    let together = seated(&all);
    assert_eq!(together.len(), 1);
    let mut x = vec![0.0; 3 + all.len()];
    x[..3].copy_from_slice(&[2.0, 0.66, 0.0]);
    (0..all.len()).for_each(|k| x[3 + k] = 0.6 + 0.01 * k as f64);
    let class = &together[0];
    let asked = Asked { x: &x, a: 1e6, gmin: 1e-12, limit: false, near: None };
    let (mut held, mut lines) = (vec![0.0; class.room_held(7)], vec![0.0; class.room(7)]);
    class.linearise(&asked, &mut held, &mut lines);
    for k in 0..7 {
        let v = [x[3 + k], x[3 + k] - 2.0, 0.66 - x[3 + k]];
        let mut line = Line::default();
        class.at(k, &v, 1e-12, &mut line);
        for j in 0..line.i.len() {
            let got = lines[class.place(k, Number::StageCurrent(j))];
            let want = line.i[j] + 1e6 * line.q[j];
            assert!((got - want).abs() <= 1e-12 * want.abs(), "{k} {j}: {got} {want}");
        }
    }
}

#[test]
fn m_in_parallel_carry_m_times_the_current() {
    let (mut classes, mut lately, mut inner) = (Vec::new(), Lately::default(), |_: Wanted| 3);
    let folded = Arc::new(transistor(1e-15, 100.0, 10.0));
    for (k, m) in [1.0, 3.0].into_iter().enumerate() {
        let places = (&mut classes, &mut lately);
        seat(places, "bjt", (&k.to_string(), &[0, 1, 2]), &folded, m, &mut inner).unwrap();
    }
    let mut lines = [Line::default(), Line::default()];
    classes.iter().zip(&mut lines).for_each(|(class, line)| class.at(0, &[0.6, -1.0, 0.02], 1e-12, line));
    for (one, three) in lines[0].i.iter().zip(&lines[1].i) {
        assert!((3.0 * one - three).abs() <= 1e-14 * three.abs());
    }
}

#[test]
fn a_limited_port_that_is_not_known_is_told() {
    let mut folded = transistor(1e-15, 100.0, 10.0);
    folded.ports[0].limit = Some(Limit { function: "mylim".into(), arguments: vec![] });
    let (places, folded) = ((&mut Vec::new(), &mut Lately::default()), Arc::new(folded));
    let told = seat(places, "bjt", ("q", &[0, 1, 2]), &folded, 1.0, &mut |_| 3);
    assert_eq!(told.unwrap_err(), "$limit knows pnjlim, fetlim, limvds and limitlog, not mylim");
    assert_eq!(folded.ports[2].to, 3);
    assert_ne!(GROUND, 3);
    assert_eq!(GMIN, 0);
}
