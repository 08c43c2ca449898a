//! The starting point of an analysis.
//!
//! `operating_point`: F(x) = 0 with the machine held at its initial coordinates and speeds (or, for a static
//! equilibrium, let go). Plain Newton, then gmin stepping, source stepping, pseudo-transient.
//! `initial_conditions`: UIC, from given charges and fluxes. `consistent`: algebraic unknowns that fit the charges.
mod hanging;
mod holding;
mod linear;
mod rest;
pub mod sweep;

use self::holding::Holding;
pub use self::rest::couples;
use self::rest::descend;
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::reduced::augment;
use crate::sparse::{Lu, Pattern, Singular, Symbolic};
use crate::system::{Hanging, Held, Kind, System, Work};
use crate::tolerances::Quantity;

pub struct NoPoint {
    pub why: Failure,
    pub tried: Vec<String>,
}

pub fn initial(sys: &System) -> Vec<f64> {
    sys.unknowns.iter().map(|u| u.initial).collect()
}

/// Matrix, factorisation and the choice of rows that stand for the operating point.
struct Dc<'a> {
    sys: &'a System,
    pattern: &'a Pattern,
    place: Vec<usize>,    // of each entry of the system's pattern
    diagonal: Vec<usize>, // of each unknown
    lu: Lu<f64>,
    matrix: Vec<f64>,
    held: Vec<Option<f64>>, // this unknown is fixed
    forced: Vec<(usize, f64)>,
    residual: Vec<f64>,
    /// (coordinate, its momentum's row, place of that entry): what a static equilibrium leans on while it is approached
    pairs: Vec<(usize, usize, usize)>,
    lean: Option<(f64, Vec<f64>)>, // 1/s^2, last coordinates
    holding: Option<Holding>,      // laws with modes, of a machine that comes to rest
    unbalanced: bool,              // an update was small where there is no solution (linear.rs)
    resting: bool,                 // switches stay as their cards say
}

/// Where conditions have flipped so often, full steps jump over the place where they hold: from then on a step ends where the
/// first of them turns (Katzenelson 1965), which finds the solution of what is continuous and piecewise linear.
const CHATTER: usize = 25;
/// Bisections of a step for the place where a condition turns.
const HALVINGS: usize = 60;
/// Iterations after which an update above the tolerance may be the rounding of the equations.
const ROUNDED: usize = 6;
/// Iterations that may leave out expressions without a value, beyond one for each row that has some.
const VALUELESS: usize = 5;
/// Iterations from the least divisor, 1e-32, to 1.
const DOUBLINGS: usize = 107;
/// Conductance that holds a forced node (`.ic`, `.nodeset`) at its value.
const FORCE: f64 = 1e10;

/// The pattern of equations at rest: that of a run, every diagonal but those of branches, and `couples`.
fn analysed(sys: &System, couples: &[(usize, usize)]) -> Result<(Pattern, Symbolic), Singular> {
    let own = (0..sys.n).flat_map(|c| sys.pattern.column(c).iter().map(move |&r| (r, c)));
    let diagonal = (0..sys.n).filter(|&i| sys.unknowns[i].kind != Kind::Branch).map(|i| (i, i));
    let held = holding::entries(sys, couples);
    let entries: Vec<_> = own.chain(diagonal).chain(couples.iter().map(|&(q, u)| (u, q))).chain(held).collect();
    let pattern = Pattern::from_entries(sys.n, &entries);
    let symbolic = Symbolic::analyse(&pattern)?;
    Ok((pattern, symbolic))
}

impl<'a> Dc<'a> {
    fn new(sys: &'a System, hold: bool, starts: bool, x: &[f64]) -> Result<Dc<'a>, Failure> {
        let n = sys.n;
        let held: Vec<Option<f64>> = sys
            .unknowns
            .iter()
            .enumerate()
            .map(|(i, u)| {
                let hold = match u.kind {
                    k if k.mechanical() => hold || matches!(k, Kind::Lambda | Kind::Mu),
                    _ => false,
                };
                hold.then_some(x[i])
            })
            .collect();
        // a static equilibrium needs its multipliers
        let mut held = if hold { held } else { vec![None; n] };
        for &(row, value) in sys.starting_currents.iter().filter(|_| starts) {
            held[row] = Some(value);
        }
        let couples: Vec<(usize, usize)> = if hold { Vec::new() } else { couples(sys) };
        let analysed = sys.rest_patterns[usize::from(hold)].get_or_init(|| analysed(sys, &couples));
        let (pattern, symbolic) = analysed.as_ref().map_err(|&e| Failure::from(e))?;
        let find = |r: usize, c: usize| pattern.position(r, c);
        let mut place = Vec::with_capacity(sys.pattern.rowidx.len());
        for c in 0..n {
            for k in sys.pattern.colptr[c]..sys.pattern.colptr[c + 1] {
                place.push(find(sys.pattern.rowidx[k], c).unwrap_or(usize::MAX));
            }
        }
        let diagonal = (0..n).map(|i| find(i, i).unwrap_or(usize::MAX)).collect();
        let pairs = couples.iter().filter_map(|&(q, u)| Some((q, u, pattern.position(u, q)?))).collect();
        let lu = Lu::new(symbolic);
        let matrix = vec![0.0; pattern.rowidx.len()];
        Ok(Dc {
            sys,
            pattern,
            place,
            diagonal,
            lu,
            matrix,
            held,
            forced: Vec::new(),
            residual: vec![0.0; n],
            pairs,
            lean: None,
            holding: None,
            unbalanced: false,
            resting: false,
        })
    }

    /// Newton on F(x) + shunt v + a (Q - Q0) = 0 from `x`.
    fn newton(
        &mut self,
        w: &mut Work,
        x: &mut [f64],
        shunt: f64,
        transient: Option<(f64, &[f64])>,
        tol: &Tolerances,
        most: usize,
    ) -> Result<usize, Failure> {
        let (sys, n) = (self.sys, self.sys.n);
        let mut worst = 0;
        let (mut flips, mut turned, patience) = (0, 0, CHATTER + 2 * sys.flags.len());
        let mut valueless = sys.expression_rows().len() + VALUELESS;
        for iteration in 1..=most {
            // expressions without a value here, 1/v(a) at a start of 0 V, are left out until others give them one; rows of what is
            // held ask for none
            let mut absent = sys.eval_where_finite(w, x, 0.0);
            absent.retain(|&row| self.held[row].is_none());
            if let Some(&unknown) = absent.first() {
                if valueless == 0 {
                    return Err(Failure::NotFinite { unknown });
                }
                valueless -= 1;
            }
            w.counters.iterations += 1;
            self.assemble(w, x, shunt, transient);
            for &row in absent.iter().filter(|&&row| sys.unknowns[row].kind == Kind::Node) {
                self.lead(row, linear::LEAK, -x[row]);
            }
            self.hold(x);
            if let Err(e) = self.lu.factor_or_refactor(&self.matrix) {
                return Err(self.named(w, Failure::from(e)));
            }
            w.counters.factorisations += 1;
            self.lu.solve(&mut self.residual);
            w.counters.solves += 1;
            // the first condition that turns on the way ends the step
            let turns = flips >= CHATTER && turned < patience && self.shorten(w, x);
            let mut largest = 0.0_f64;
            for i in 0..n {
                let new = x[i] + self.residual[i];
                if !new.is_finite() {
                    return Err(self.named(w, Failure::NotFinite { unknown: i }));
                }
                if tol.in_norm[i] {
                    let ratio = self.residual[i].abs() / tol.weight(i, x[i], new);
                    if ratio > largest {
                        largest = ratio;
                        worst = i;
                    }
                }
                x[i] = new;
            }
            // conditions follow the iterate; what finds no rest (a relaxation oscillator) is left as it is in the end
            let mut settled = absent.is_empty();
            let flip = if self.resting { System::update_free_flags } else { System::update_flags };
            if turns {
                turned += 1;
                settled &= !sys.turn_first(w, x, 0.0);
            } else if flips < CHATTER && flip(sys, w, x, 0.0) {
                flips += 1;
                settled = false;
            }
            if !w.limited && settled && (iteration > 1 || sys.linear) {
                if largest <= 1.0 && (transient.is_some() || self.balances(w, x, shunt)) {
                    return Ok(iteration);
                }
                self.unbalanced |= largest <= 1.0;
                // tolerances below the rounding of the equations: nothing better can be found
                if iteration > ROUNDED && shunt == 0.0 && transient.is_none() && self.is_rounding(w, x) {
                    return Ok(iteration);
                }
            }
        }
        let row = (0..n).max_by(|&i, &j| w.f[i].abs().total_cmp(&w.f[j].abs())).unwrap_or(0);
        Err(Failure::Diverged { unknown: worst, row })
    }

    /// Matrix and right side of Newton's step for F(x) + shunt v + a (Q - Q0) = 0, of what was evaluated at x.
    fn assemble(&mut self, w: &mut Work, x: &[f64], shunt: f64, transient: Option<(f64, &[f64])>) {
        let (sys, n) = (self.sys, self.sys.n);
        self.matrix.fill(0.0);
        for (k, &at) in self.place.iter().enumerate() {
            let dynamic = transient.map_or(0.0, |(a, _)| a * w.cv[k]);
            self.matrix[at] += w.gv[k] + dynamic;
        }
        for i in 0..n {
            self.residual[i] = -w.f[i];
            if let Some((a, q0)) = transient {
                self.residual[i] -= a * (w.q[i] - q0[i]);
            }
        }
        if shunt > 0.0 {
            (0..n).filter(|&i| sys.unknowns[i].kind == Kind::Node).for_each(|i| self.lead(i, shunt, -x[i]));
        }
        for &(row, value) in &self.forced {
            self.matrix[self.diagonal[row]] += FORCE;
            self.residual[row] += FORCE * (value - x[row]);
        }
        if let Some((per_square, last)) = &self.lean {
            for &(q, u, place) in &self.pairs {
                // the mass of the coordinate itself: the diagonal of dp/du
                let mass = sys.pattern.position(u, u).map_or(0.0, |k| w.cv[k].abs());
                let k = per_square * if mass > 0.0 { mass } else { 1.0 };
                self.matrix[place] += k;
                self.residual[u] -= k * (x[q] - last[q]);
            }
        }
        if let Some(holding) = &self.holding {
            let (matrix, pattern) = (&mut self.matrix, self.pattern);
            let mut put = |row: usize, col: usize, v: f64| {
                pattern.position(row, col).into_iter().for_each(|at| matrix[at] += v);
            };
            holding.rows(sys, w, x, &mut put, &mut self.residual);
        }
    }

    /// Of values that are not finite, the row they come from: a solution carries them everywhere.
    fn named(&self, w: &Work, why: Failure) -> Failure {
        match (&why, self.sys.not_finite(w)) {
            (Failure::NotFinite { .. }, Some(unknown)) => Failure::NotFinite { unknown },
            _ => why,
        }
    }

    /// Shortens the step from x to where the first condition turns; false where none does.
    fn shorten(&mut self, w: &mut Work, x: &[f64]) -> bool {
        let sys = self.sys;
        let at = |s: f64, step: &[f64]| -> Vec<f64> { x.iter().zip(step).map(|(x, d)| x + s * d).collect() };
        if !sys.is_asked(w, &at(1.0, &self.residual), 0.0) {
            return false;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if sys.is_asked(w, &at(middle, &self.residual), 0.0) {
                high = middle;
            } else {
                low = middle;
            }
        }
        self.residual.iter_mut().for_each(|d| *d *= high);
        true
    }

    /// A conductance to ground at a node, with so much across it.
    fn lead(&mut self, node: usize, conductance: f64, across: f64) {
        self.matrix[self.diagonal[node]] += conductance;
        self.residual[node] += conductance * across;
        for s in self.sys.sums.iter().filter(|s| s.node == node) {
            self.matrix[self.place[s.place]] += conductance;
            self.residual[s.root] += conductance * across;
        }
    }

    /// Rows of held unknowns become x_i = value.
    fn hold(&mut self, x: &[f64]) {
        if self.held.iter().all(Option::is_none) {
            return;
        }
        for c in 0..self.sys.n {
            for k in self.pattern.colptr[c]..self.pattern.colptr[c + 1] {
                let r = self.pattern.rowidx[k];
                if self.held[r].is_some() {
                    self.matrix[k] = if r == c { 1.0 } else { 0.0 };
                }
            }
        }
        for (i, h) in self.held.iter().enumerate() {
            if let Some(v) = h {
                self.residual[i] = v - x[i];
            }
        }
    }

    /// One homotopy: parameter from `from` to `to` on a logarithmic or linear scale with adaptive steps.
    fn walk(
        &mut self,
        w: &mut Work,
        x: &mut [f64],
        tol: &Tolerances,
        most: usize,
        set: &mut dyn FnMut(&mut Work, f64) -> f64, // s in (0, 1] -> shunt
    ) -> Result<(), Failure> {
        let (mut done, mut step) = (0.0_f64, 0.1_f64);
        let mut last = Failure::Diverged { unknown: 0, row: 0 };
        for _ in 0..400 {
            let s = (done + step).min(1.0);
            let mut trial = x.to_vec();
            let held = w.held();
            let shunt = set(w, s);
            self.sys.touch_sources(w);
            match self.newton(w, &mut trial, shunt, None, tol, most) {
                Ok(iterations) => {
                    x.copy_from_slice(&trial);
                    done = s;
                    if done >= 1.0 {
                        return Ok(());
                    }
                    step *= if iterations <= most / 4 { 2.0 } else { 1.0 };
                }
                Err(e) => {
                    w.restore(&held);
                    last = e;
                    step *= 0.25;
                    if step < 1e-7 {
                        break;
                    }
                }
            }
        }
        Err(last)
    }
}

/// DC operating point into `x` (which holds the initial values of the machine). `statics`: the machine is let go.
pub fn operating_point(
    sys: &System,
    w: &mut Work,
    o: &Options,
    tol: &Tolerances,
    statics: bool,
    x: &mut Vec<f64>,
) -> Result<(), NoPoint> {
    if !statics && sys.unknowns.iter().all(|u| u.kind.mechanical()) {
        // all of it is held where it is
        for _ in 0..CHATTER {
            if !sys.update_flags(w, x, 0.0) {
                break;
            }
        }
        w.gmin = o.gmin;
        return Ok(());
    }
    let singular = |why| NoPoint { why, tried: vec![] };
    let mut dc = Dc::new(sys, !statics, !w.dc, x).map_err(singular)?;
    let gmin = o.gmin;
    w.gmin = gmin;
    w.hanging = None;
    let mut start = x.clone();
    // `.ic` is about the start of a run: where sources have their DC values it counts for nothing
    let forces = || sys.forces.iter().filter(|f| f.release || !w.dc);
    for f in forces() {
        start[f.row] = f.value; // every attempt begins where the user expects the point
    }
    let mut tried = Vec::new();

    // nodesets: a first solution with the nodes held there, then let go
    let nodesets: Vec<_> = forces().filter(|f| f.release).map(|f| (f.row, f.value)).collect();
    let ics: Vec<_> = forces().filter(|f| !f.release).map(|f| (f.row, f.value)).collect();
    dc.forced.clone_from(&ics);
    if !nodesets.is_empty() {
        dc.forced.extend(&nodesets);
        if dc.newton(w, x, 0.0, None, tol, o.itl1).is_err() {
            x.copy_from_slice(&start);
        }
        dc.forced.clone_from(&ics);
    }
    sys.update_flags(w, x, 0.0);
    let reset = |w: &mut Work, x: &mut Vec<f64>| {
        x.copy_from_slice(&start);
        w.ports = sys.work().ports;
        w.reset_flags(sys);
        w.source_factor = 1.0;
        w.gmin = gmin;
        sys.touch_sources(w);
        sys.update_flags(w, x, 0.0);
    };
    // between its thresholds a switch is what its card says; whether it is between them, a first solution tells
    if sys.flags.iter().zip(&w.flags).any(|(f, &now)| f.rest > 0 || (f.rest == 0 && now > 0.0)) {
        for (flag, f) in w.flags.iter_mut().zip(&sys.flags).filter(|(_, f)| f.rest >= 0) {
            *flag = f64::from(f.rest);
        }
        dc.resting = true;
        match dc.newton(w, x, 0.0, None, tol, o.itl1) {
            Ok(_) => _ = sys.update_flags(w, x, 0.0),
            Err(_) => reset(w, x),
        }
        dc.resting = false;
    }

    if !dc.pairs.is_empty() {
        // electrical unknowns first, the machine where it is
        if let Ok(mut held) = Dc::new(sys, true, !w.dc, x) {
            let _ = held.newton(w, x, 0.0, None, tol, o.itl1);
        }
        tried.push("downhill from the start".into());
        let couples = couples(sys);
        dc.holding = Holding::new(sys, w, x, &couples, tol);
        return match descend(&mut dc, w, x, tol) {
            Ok(()) => {
                let found = settled(&mut dc, w, x, tol, o).map_err(|why| NoPoint { why, tried });
                w.hanging = dc.hanging(w, x, 0.0, o);
                dc.holding.iter().for_each(|holding| holding.end(sys, w));
                found
            }
            Err(why) => Err(NoPoint { why, tried }),
        };
    }
    tried.push(format!("Newton's method ({} iterations)", o.itl1));
    // a point that another iteration leaves again is none: conditions that were left as they are, for one
    let found = dc.newton(w, x, 0.0, None, tol, o.itl1).and_then(|_| polish(&mut dc, w, x, tol, o));
    // a point that is one by the currents of gmin alone is the last that is taken
    let mut hung: Option<(Vec<f64>, Held, Hanging)> = None;
    let mut stands = |dc: &mut Dc, w: &mut Work, x: &[f64], shunt: f64| {
        let hanging = dc.hanging(w, x, shunt, o);
        if let (Some(hanging), None) = (hanging, &hung) {
            hung = Some((x.to_vec(), w.held(), hanging));
        }
        hanging.is_none()
    };
    let mut why = match found {
        Ok(()) if stands(&mut dc, w, x, 0.0) => return Ok(()),
        Ok(()) => Failure::Diverged { unknown: 0, row: 0 },
        Err(why) => why,
    };
    if dc.unbalanced {
        tried.push("a start without the expressions".into());
        reset(w, x);
        // from nothing on, Newton's method doubles a divisor in every iteration
        if dc.without_expressions(w, x) && dc.newton(w, x, 0.0, None, tol, o.itl1 + DOUBLINGS).is_ok() {
            match polish(&mut dc, w, x, tol, o) {
                Ok(()) if stands(&mut dc, w, x, 0.0) => return Ok(()),
                Ok(()) => {}
                Err(e) => why = e,
            }
        }
    }
    // a matrix that is singular whatever the shunts are has no point to find
    let hopeless = matches!(&why, Failure::Singular(s) if s.structural);
    if !hopeless {
        tried.push("gmin stepping".into());
        reset(w, x);
        let ladder = |s: f64| 1e-2_f64 * (1e-13_f64 / 1e-2).powf(s);
        let walked = dc.walk(w, x, tol, 50, &mut |_, s| if s >= 1.0 { 0.0 } else { ladder(s) });
        if walked.and_then(|()| polish(&mut dc, w, x, tol, o)).is_ok() && stands(&mut dc, w, x, 0.0) {
            return Ok(());
        }
        // nodes that hang on capacitors alone: the shunt of gmin gives them a point
        reset(w, x);
        let shunted = dc.walk(w, x, tol, 50, &mut |_, s| ladder(s).max(gmin)).is_ok();
        w.gmin = gmin;
        let shunted = shunted && !sys.update_flags(w, x, 0.0) && balanced(&dc, w, x, tol, o).is_ok();
        // (what only this shunt carries nothing determines)
        match shunted.then(|| dc.hanging(w, x, gmin, o)) {
            Some(None) => return Ok(()),
            Some(Some(_)) if matches!(why, Failure::Singular(_)) => return Err(NoPoint { why, tried }),
            _ => {}
        }
        tried.push("source stepping".into());
        reset(w, x);
        let walked = dc.walk(w, x, tol, 50, &mut |w, s| {
            w.source_factor = s;
            if s >= 1.0 {
                0.0
            } else {
                gmin
            }
        });
        w.source_factor = 1.0;
        sys.touch_sources(w);
        if walked.and_then(|()| polish(&mut dc, w, x, tol, o)).is_ok() && stands(&mut dc, w, x, 0.0) {
            return Ok(());
        }
        tried.push("pseudo-transient".into());
        reset(w, x);
        match pseudo_transient(&mut dc, w, x, tol).and_then(|()| polish(&mut dc, w, x, tol, o)) {
            Ok(()) if stands(&mut dc, w, x, 0.0) => return Ok(()),
            Ok(()) => {}
            Err(e) => why = e,
        }
    }
    if let Some((point, held, hanging)) = hung {
        reset(w, x);
        x.copy_from_slice(&point);
        w.restore(&held);
        w.hanging = Some(hanging);
        return Ok(());
    }
    Err(NoPoint { why, tried })
}

/// Implicit Euler from the present point with growing steps, every node loaded by a capacitor: a damped way to rest.
fn pseudo_transient(dc: &mut Dc, w: &mut Work, x: &mut [f64], tol: &Tolerances) -> Result<(), Failure> {
    let n = dc.sys.n;
    let mut h = 1e-9_f64;
    let mut last = Failure::Diverged { unknown: 0, row: 0 };
    for _ in 0..400 {
        let before = x.to_vec();
        dc.sys.eval(w, x, 0.0);
        let q0 = w.q.clone();
        let mut trial = x.to_vec();
        // 1 nF at every node: the shunt c, with c v of the last point in the charge term a Q0
        let c = 1e-9 / h;
        let mut shifted = q0.clone();
        for i in (0..n).filter(|&i| dc.sys.unknowns[i].kind == Kind::Node) {
            shifted[i] += c * x[i] * h;
        }
        let solved = dc.newton(w, &mut trial, c, Some((1.0 / h, &shifted)), tol, 50);
        match solved {
            Ok(iterations) => {
                x.copy_from_slice(&trial);
                let moved = (0..n)
                    .filter(|&i| tol.in_norm[i])
                    .map(|i| (x[i] - before[i]).abs() / tol.weight(i, x[i], before[i]))
                    .fold(0.0, f64::max);
                if moved < 0.1 && h > 1.0 {
                    return Ok(());
                }
                h *= if iterations < 10 { 4.0 } else { 1.5 };
            }
            Err(e) => {
                last = e;
                h *= 0.125;
                if h < 1e-18 {
                    return Err(last);
                }
            }
        }
    }
    Err(last)
}

/// The accepted point must satisfy the equations themselves: no device limited, no condition left behind, and the
/// residual of each row within the tolerances of its terms.
fn polish(dc: &mut Dc, w: &mut Work, x: &mut [f64], tol: &Tolerances, o: &Options) -> Result<(), Failure> {
    dc.newton(w, x, 0.0, None, tol, o.itl1)?;
    // where a run starts, a condition that found no rest may stay as it is; a point that is reported has none such
    if w.dc {
        dc.sys.update_flags(w, x, 0.0);
    }
    balanced(dc, w, x, tol, o)
}

/// The same where a machine has come to rest. One that lies on others, or that friction holds, may lie elsewhere just as well: where
/// nothing pulls it along it stays where it is.
fn settled(dc: &mut Dc, w: &mut Work, x: &mut [f64], tol: &Tolerances, o: &Options) -> Result<(), Failure> {
    let start = x.to_vec();
    match polish(dc, w, x, tol, o) {
        Err(Failure::Singular(_)) if dc.holding.is_some() => {}
        found => return found,
    }
    x.copy_from_slice(&start);
    let mut found = Ok(());
    for _ in 0..LEANS {
        dc.lean = Some((1.0, x.to_vec()));
        found = polish(dc, w, x, tol, o);
    }
    dc.lean = None;
    found
}

/// Is F of the equations, without any shunt, nothing but what the tolerances of its terms allow? `abstol` besides, and what leaks
/// through gmin where there is nothing else. Currents of sources are no part of Newton's norm, but their rows are equations too.
fn balanced(dc: &Dc, w: &mut Work, x: &[f64], tol: &Tolerances, o: &Options) -> Result<(), Failure> {
    let sys = dc.sys;
    sys.eval_jacobian(w, x, 0.0, false);
    let mut allowed: Vec<f64> = (0..sys.n)
        .map(|i| match sys.unknowns[i].kind {
            Kind::Node => o.absolute.of(Quantity::Current, o.reltol) + 2.0 * o.gmin * x[i].abs(),
            _ => o.absolute.of(Quantity::Voltage, o.reltol),
        })
        .collect();
    for c in 0..sys.n {
        for k in sys.pattern.colptr[c]..sys.pattern.colptr[c + 1] {
            allowed[sys.pattern.rowidx[k]] += w.gv[k].abs() * (o.reltol * x[c].abs() + tol.floor[c]);
        }
    }
    let forced: Vec<usize> = dc.forced.iter().map(|f| f.0).collect();
    let excess = |i: usize| w.f[i].abs() / allowed[i];
    let electrical = |i: usize| matches!(sys.unknowns[i].kind, Kind::Node | Kind::Branch);
    let counts = |i: &usize| (electrical(*i) || tol.in_norm[*i]) && dc.held[*i].is_none() && !forced.contains(i);
    let worst = (0..sys.n).filter(counts).max_by(|&i, &j| excess(i).total_cmp(&excess(j)));
    match worst {
        Some(i) if excess(i).is_nan() || excess(i) > 1.0 => Err(Failure::Diverged { unknown: i, row: i }),
        _ => Ok(()),
    }
}

/// So often a rest that is indifferent is solved for from the last solution.
const LEANS: usize = 3;

/// Nothing is divided by the length over which what is stored is held: so much of the other.
const STILL: f64 = 1e-3;
/// ... and up to so many times a hundredth of it.
const SHORTER: usize = 6;

/// Does `consistent` with `refine` leave everything as it is?
pub fn is_all_state(sys: &System) -> bool {
    sys.devices() == 0 && sys.differential.iter().all(|&d| d)
}

/// Consistent values at t after a discontinuity, or at the start: one backward Euler step so short that charges,
/// fluxes and momenta cannot move, but everything algebraic must fit:  Q(x1) - Q(x0) + h F(x1) = 0.
/// With `refine`, multipliers and derivative unknowns are extrapolated from two such steps (their error is O(h)).
/// On failure what is stored stays as it was, false: the method's own first step, stiffly accurate, will do the same work.
#[allow(clippy::too_many_arguments)]
pub fn consistent(
    sys: &System,
    newton: &mut Newton,
    w: &mut Work,
    x: &mut [f64],
    t: f64,
    h: f64,
    tol: &Tolerances,
    refine: bool,
) -> bool {
    consistent_with(sys, newton, w, x, None, t, h, tol, refine)
}

/// The same; `charges`: Q(x0) where the equations were others before.
#[allow(clippy::too_many_arguments)]
pub fn consistent_with(
    sys: &System,
    newton: &mut Newton,
    w: &mut Work,
    x: &mut [f64],
    charges: Option<Vec<f64>>,
    t: f64,
    h: f64,
    tol: &Tolerances,
    refine: bool,
) -> bool {
    sys.eval(w, x, t);
    let q0 = charges.unwrap_or_else(|| w.q.clone());
    let ports = w.ports.clone();
    let mut step = |w: &mut Work, h: f64, from: &[f64]| -> Option<Vec<f64>> {
        newton.forget();
        let r: Vec<f64> = q0.iter().map(|q| -q / h).collect();
        let mut y = from.to_vec();
        newton.solve(sys, w, 1.0 / h, &r, &mut y, t + h, tol, 100).ok()?;
        // multipliers live on second differences of positions, voltages of coils on those of fluxes: a second, linear pass removes
        // Newton's noise
        newton.solve(sys, w, 1.0 / h, &r, &mut y, t + h, tol, 100).ok()?;
        Some(y)
    };
    let (lags, given) = if refine { (undetermined(sys), vec![false; sys.n]) } else { (Vec::new(), Vec::new()) };
    let stays = Stays { lags: &lags, given: &given, near: true };
    let Some(y1) = step(w, h, x) else {
        w.ports = ports;
        if refine {
            hold(sys, newton, w, (t, x), h, &tol.at_least(1e-6), &stays);
        }
        return false;
    };
    let y2 = if refine { step(w, 2.0 * h, &y1) } else { None };
    if let Some(y2) = y2 {
        // of nodes that capacitors tie together the differences are states, what they have in common is not
        let floats = |i: usize| sys.sums.iter().any(|s| s.node == i || s.root == i);
        for i in 0..sys.n {
            if !sys.differential[i] || floats(i) {
                x[i] = 2.0 * y1[i] - y2[i];
            }
        }
    } else {
        for i in 0..sys.n {
            if !(sys.differential[i] && sys.unknowns[i].kind.mechanical() && refine) {
                x[i] = y1[i];
            }
        }
    }
    if refine {
        hold(sys, newton, w, (t, x), STILL * h, tol, &stays);
    }
    true
}

/// Unknowns that stand neither under d/dt nor are given, as index 1, by the rows without it: a maximum matching of these rows
/// leaves them over, or could (the underdetermined part of Dulmage and Mendelsohn's decomposition). They are multipliers,
/// derivatives, the current of a capacitor across a source, and what follows from them; the current that a motor of
/// no inductance takes, r i = v - k omega, is none.
pub fn undetermined(sys: &System) -> Vec<bool> {
    // what nodes that capacitors tie together have in common is no state: their root stands for it, in every row that reads one of them
    let tied: Vec<(usize, usize)> = sys.sums.iter().filter(|s| s.tied).map(|s| (s.node, s.root)).collect();
    let algebraic = |k: usize| !sys.differential[k] || tied.iter().any(|&(_, root)| root == k);
    let mut columns: Vec<Vec<usize>> = (0..sys.n).map(|k| sys.pattern.column(k).to_vec()).collect();
    for &(node, root) in &tied {
        let more = columns[node].clone();
        columns[root].extend(more);
    }
    let mut reads = vec![Vec::new(); sys.n];
    for k in (0..sys.n).filter(|&k| algebraic(k)) {
        for &r in columns[k].iter().filter(|&&r| !sys.has_q[r]) {
            if !reads[r].contains(&k) {
                reads[r].push(k);
            }
        }
    }
    let (mut by, mut of) = (vec![None; sys.n], vec![None; sys.n]);
    for r in (0..sys.n).filter(|r| reads[*r].contains(r)) {
        (by[r], of[r]) = (Some(r), Some(r));
    }
    for r in 0..sys.n {
        if of[r].is_none() && !reads[r].is_empty() {
            augment(r, &|r| reads[r].clone(), &mut by, &mut of);
        }
    }
    // (the effort of a law is one while its flow is 0, whatever its row reads in its other modes)
    let laws = sys.laws.list.iter().map(|law| law.row);
    let mut left: Vec<usize> = (0..sys.n).filter(|&k| algebraic(k) && by[k].is_none()).chain(laws).collect();
    let mut found = vec![false; sys.n];
    while let Some(k) = left.pop() {
        if !std::mem::replace(&mut found[k], true) {
            left.extend(columns[k].iter().filter_map(|&r| of[r]));
        }
    }
    found
}

/// What a point holds while its algebraic equations are solved.
pub struct Stays<'a> {
    /// follows from changes of what is stored, and stays
    pub lags: &'a [bool],
    /// has what a source has, whatever is stored there
    pub given: &'a [bool],
    /// is the point near enough for the slopes there to be taken away from the first step?
    pub near: bool,
}

/// Algebraic unknowns that satisfy their rows at (t, x) with what is stored as it is: over a length of h the fastest may move, and
/// what was extrapolated from there does not fit the state at t. So the slopes at t are taken away, and what they are is known the better
/// the better the algebraic unknowns are: again and again, over shorter lengths, while states move by less each time (10 nH behind
/// 10 kohm are there within 1 ps). Gives by how many tolerances they would still have moved.
pub fn hold(
    sys: &System,
    newton: &mut Newton,
    w: &mut Work,
    (t, x): (f64, &mut [f64]),
    h: f64,
    tol: &Tolerances,
    stays: &Stays,
) -> f64 {
    let (mut h, mut left) = (h, f64::INFINITY);
    // what stays may be far up an exponential, and slopes there say nothing
    let passes = if sys.exponentials() > 0 && !stays.near { 1 } else { SHORTER };
    for pass in 0..passes {
        let ports = w.ports.clone();
        sys.eval(w, x, t);
        let slope = |i: usize| if stays.near || pass > 0 { w.f[i] } else { 0.0 };
        let r: Vec<f64> = (0..sys.n).map(|i| if sys.has_q[i] { -(w.q[i] / h + slope(i)) } else { 0.0 }).collect();
        newton.forget();
        let mut y = x.to_vec();
        let solved = newton.solve(sys, w, 1.0 / h, &r, &mut y, t, tol, 100).is_ok();
        let moved: Vec<f64> = (0..sys.n).map(|i| if stays.given[i] { 0.0 } else { y[i] - x[i] }).collect();
        let now = if solved { tol.largest_error(&moved, &y, x) } else { f64::INFINITY };
        // beyond that there is rounding, and what no length changes
        if now >= left {
            w.ports = ports;
            break;
        }
        let solved_for = |i: &usize| stays.given[*i] || !sys.differential[*i] && !stays.lags[*i];
        (0..sys.n).filter(solved_for).for_each(|i| x[i] = y[i]);
        left = now;
        if left <= 1.0 && (pass > 0 || !stays.near) {
            break;
        }
        h *= 0.01;
    }
    left
}

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
    for &(row, dq) in &sys.ic_charge {
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
