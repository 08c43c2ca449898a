//! A start from given values: UIC.
use crate::newton::{Failure, Newton, Tolerances};
use crate::system::{Kind, System, Work};

/// UIC: the charges and fluxes that x, `.ic` and `IC=` give, then values that fit them.
pub fn initial_conditions(
    sys: &System,
    w: &mut Work,
    x: &mut [f64],
    tstep: f64,
    tol: &Tolerances,
) -> Result<(), Failure> {
    for f in sys.forces.iter().filter(|f| !f.release) {
        x[f.row] = f.value;
    }
    for &(row, value) in sys.start.given.iter().chain(&sys.start.states) {
        x[row] = value;
    }
    // a junction behind a series resistance has the voltage of the terminals, as in ngspice
    for (inner, outer) in sys.tied_inside() {
        if !sys.forces.iter().any(|f| !f.release && f.row == inner) {
            x[inner] = usize::try_from(outer).map_or(0.0, |k| x[k]);
        }
    }
    // what a source's current decides is not known yet: it stays as its card says
    let unknown = |i: usize| sys.unknowns[i].kind == Kind::Branch && !sys.differential[i];
    let known: Vec<f64> = x.iter().enumerate().map(|(i, &v)| if unknown(i) { f64::NAN } else { v }).collect();
    sys.update_flags(w, &known, 0.0);
    sys.eval(w, x, 0.0);
    let mut q0 = w.q.clone();
    for &(row, dq) in &sys.start.charges {
        q0[row] += dq;
    }
    // the shorter, the nearer to t = 0; but what two floating capacitors have in common is known to eps V RC/h only
    let (flags, start) = (w.held(), x.to_vec());
    let mut found = fit_charges(sys, w, x, &q0, 1e-9 * tstep, tol);
    for h in [1e-8 * tstep, 1e-7 * tstep, 1e-6 * tstep] {
        if !matches!(found, Ok(Rounding::Shows)) {
            break;
        }
        let (kept, mut longer) = (w.held(), start.clone());
        w.restore_flags(&flags);
        let Ok(rounding) = fit_charges(sys, w, &mut longer, &q0, h, tol) else {
            w.restore(&kept);
            break;
        };
        x.copy_from_slice(&longer);
        found = Ok(rounding);
    }
    // where it is all that Newton's method sees, no more is asked (their charges are what counts)
    let modest = tol.at_least(1e-6);
    for h in [1e-7 * tstep, 1e-5 * tstep] {
        if found.is_ok() {
            break;
        }
        w.restore_flags(&flags);
        found = fit_charges(sys, w, x, &q0, h, &modest);
    }
    found.map(|_| ())
}

/// Is the rounding of charges within the tolerances?
enum Rounding {
    Shows,
    Hides,
}

/// x at t = 0 that has the charges q0, by implicit Euler steps of h and 2 h from them.
fn fit_charges(
    sys: &System,
    w: &mut Work,
    x: &mut [f64],
    q0: &[f64],
    h: f64,
    tol: &Tolerances,
) -> Result<Rounding, Failure> {
    for round in 0..20 {
        let mut newton = Newton::new(sys)?;
        let r: Vec<f64> = q0.iter().map(|q| -q / h).collect();
        let mut y = x.to_vec();
        newton.solve(sys, w, 1.0 / h, &r, &mut y, h, tol, 100).map_err(|why| match why {
            Failure::NotFinite { unknown } => {
                Failure::NotFinite { unknown: newton.whence(sys, w, (0.0, x, q0), (h, h), tol).unwrap_or(unknown) }
            }
            why => why,
        })?;
        let flipped = sys.update_flags(w, &y, 0.0);
        if !flipped || round == 19 {
            // y belongs to t = h; with a second one from twice the step, the values at t = 0 to O(h^2)
            let noise = newton.round(sys, w, 1.0 / h, &y);
            let shows = (0..sys.n).any(|i| tol.in_norm[i] && noise[i].abs() > 0.1 * tol.weight(i, y[i], y[i]));
            let twice: Vec<f64> = q0.iter().map(|q| -q / (2.0 * h)).collect();
            let (mut z, ports) = (y.clone(), w.ports.clone());
            let ok = newton.solve(sys, w, 0.5 / h, &twice, &mut z, 2.0 * h, tol, 100).is_ok();
            w.ports = ports;
            for i in 0..sys.n {
                x[i] = if ok && sys.differential[i] { 2.0 * y[i] - z[i] } else { y[i] };
            }
            return Ok(if shows { Rounding::Shows } else { Rounding::Hides });
        }
    }
    Ok(Rounding::Hides)
}
