//! What recurs as a program against the same, row by row.
use super::*;
use crate::devices::Climate;
use crate::graph::Graph;
use crate::model::{Kind, Model, Unknown};
use crate::waves::Wave;
use std::collections::{BTreeMap, HashMap};

/// Five nodes in a row behind a source: diodes with and without charge, one between nodes, one from ground, a product of two voltages,
/// a controlled source of constant gain as an expression, and where `stores` a charge that is one.
fn system(stores: bool) -> System {
    let mut g = Graph::new();
    let x: Vec<_> = (0..5).map(|i| g.unknown(i)).collect();
    let product = g.mul(x[1], x[2]);
    let gain = g.constant(0.3);
    let controlled = g.mul(gain, x[4]);
    let row = g.add(product, controlled);
    let mut model = Model {
        unknowns: (0..5)
            .map(|i| Unknown { name: format!("n{i}"), kind: Kind::Node, unit: "V".into(), initial: 0.0 })
            .collect(),
        waves: vec![Wave::new("sin", &[0.1, 2.0, 3.0, 0.0, 0.0, 0.0], None).unwrap()],
        f_wave: vec![(0, 0, -1.5)],
        f: BTreeMap::from([(3, row)]),
        ..Model::default()
    };
    for i in 0..5 {
        model.g.push((i, i, 2.0 + 0.1 * i as f64));
        if i > 0 {
            model.g.extend([(i, i - 1, -0.7), (i - 1, i, -0.6)]);
            model.c.extend([(i, i, 1e-3), (i, i - 1, -2e-4), (i - 1, i, -2e-4)]);
        }
    }
    let mut put = |name: &str, given: &[(&str, f64)], p: i32, n: i32| {
        let given: HashMap<String, f64> = given.iter().map(|&(name, value)| (name.to_string(), value)).collect();
        let climate = Climate { temp: 27.0, tnom: 27.0 };
        model.add_device("d", name, &[p, n], [&given, &HashMap::new()], climate).unwrap();
    };
    put("d1", &[("is", 1e-9), ("cjo", 1e-5), ("tt", 1e-4)], 1, 2);
    put("d2", &[("is", 1e-12)], -1, 3);
    put("d3", &[("is", 1e-10), ("cjo", 1e-6)], 0, -1);
    if stores {
        let square = g.powi(x[2], 2);
        let half = g.constant(1e-3);
        let charge = g.mul(half, square);
        let line = g.mul(half, x[1]);
        let charge = g.add(charge, line);
        model.q.insert(2, charge);
    }
    System::compile(model, &mut g).unwrap()
}

#[test]
fn a_program_solves_what_rows_solve() {
    for stores in [false, true] {
        let sys = system(stores);
        let tol = Tolerances::new(&sys, &Options { reltol: 1e-9, ..Options::default() });
        let mut often = Newton::new(&sys).unwrap();
        let (mut w, mut x) = (sys.work(), vec![0.0; 5]);
        let mut programs = 0;
        for k in 0..2000 + i32::try_from(crate::sparse::worth()).unwrap() {
            let (t, a) = (1e-3 * f64::from(k), 100.0 + f64::from(k % 7));
            let r: Vec<f64> =
                (0..5).map(|i| if sys.has_q[i] { 0.1 * f64::from((k + i as i32) % 5) } else { 0.0 }).collect();
            let (mut other, mut y, held) = (Newton::new(&sys).unwrap(), x.clone(), w.held());
            let mine = often.solve(&sys, &mut w, a, &r, &mut x, t, &tol, 50).unwrap();
            w.restore(&held);
            let theirs = other.solve(&sys, &mut w, a, &r, &mut y, t, &tol, 50).unwrap();
            assert_eq!(mine, theirs, "round {k}");
            let of = |newton: &Newton, x: &[f64]| [x, newton.q(), newton.f()].concat();
            for (mine, theirs) in of(&often, &x).into_iter().zip(of(&other, &y)) {
                assert!((mine - theirs).abs() <= 1e-13 * (theirs.abs() + 1e-3), "round {k}: {mine:e} {theirs:e}");
            }
            programs += usize::from(often.closing.program.program.is_some());
        }
        let machine_code = crate::tape::Code::chosen() != Ok(crate::tape::Code::Interpreted);
        assert_eq!(programs > 1000, machine_code && !stores);
        assert_eq!(often.lu.has_program(), machine_code);
    }
}

/// Charges and currents after some hundred evaluations are to the last bit those of the first, which go row by row.
#[test]
fn a_program_evaluates_what_rows_evaluate() {
    for stores in [false, true] {
        let sys = system(stores);
        let mut recurring = sys.work();
        for k in 0..400 {
            let x: Vec<f64> = (0..5).map(|i| 0.3 * ((7 * k + 3 * i) as f64).sin()).collect();
            let t = 1e-3 * k as f64;
            sys.eval(&mut recurring, &x, t);
            let mut first = sys.work();
            sys.eval(&mut first, &x, t);
            assert_eq!((&recurring.q, &recurring.f), (&first.q, &first.f), "evaluation {k}");
        }
        assert!(recurring.q.iter().any(|q| q.abs() > 1e-6) && recurring.f.iter().all(|f| f.abs() > 1e-6));
    }
}
