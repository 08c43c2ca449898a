//! The starting point of an analysis.
//!
//! `operating_point`: F(x) = 0 with the machine held at its initial coordinates and speeds (or, for a static
//! equilibrium, let go). Plain Newton, then gmin stepping, source stepping, pseudo-transient.
//! `initial_conditions`: UIC, from given charges and fluxes. `consistent`: algebraic unknowns that fit the charges.
mod consistent;
mod given;
mod hanging;
mod holding;
mod linear;
mod rest;
pub mod sweep;
mod unstable;

pub use self::consistent::{consistent, hold, is_all_state, undetermined, Stays};
pub use self::given::initial_conditions;
use self::holding::Holding;
pub use self::rest::couples;
use self::rest::descend;
pub use self::unstable::{falls_over, unstable};
use crate::newton::{Failure, Options, Tolerances};
use crate::sparse::{Lu, Pattern, Singular, Symbolic};
use crate::system::{FlagSpec, Free, Hanging, Held, Kind, System, Work};
use crate::tolerances::Quantity;

pub struct NoPoint {
    pub why: Failure,
    pub tried: Vec<String>,
}

pub fn initial(sys: &System) -> Vec<f64> {
    sys.clocked.exchanges.iter().for_each(|seat| seat.of.restart());
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
    free: Free,                    // conditions that follow the iterate
    reltol: f64,
}

/// Where conditions have flipped so often, full steps jump over the place where they hold: from then on a step ends where the
/// first of them turns (Katzenelson 1965), which finds the solution of what is continuous and piecewise linear.
const CHATTER: usize = 25;
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
    fn new(sys: &'a System, hold: bool, starts: bool, reltol: f64, x: &[f64]) -> Result<Dc<'a>, Failure> {
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
        for &(row, value) in sys.start.currents.iter().filter(|_| starts).chain(&sys.start.states) {
            held[row] = Some(value);
        }
        let couples: Vec<(usize, usize)> = if hold { Vec::new() } else { couples(sys) };
        let analysed = sys.made.rest_patterns[usize::from(hold)].get_or_init(|| analysed(sys, &couples));
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
            free: Free::All,
            reltol,
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
        let mut valueless = sys.expression_rows().len() + 5;
        for iteration in 1..=most {
            // expressions without a value here, 1/v(a) at a start of 0 V, are left out until others give them one, for a few more
            // iterations than there are rows with some; rows of what is held ask for none
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
            // conditions follow the iterate
            let mut settled = absent.is_empty();
            if turns {
                turned += 1;
                settled &= !sys.turn_first_of(w, x, 0.0, self.free);
            } else if flips < CHATTER && sys.follow_flags(w, x, 0.0, self.free) {
                flips += 1;
                settled = false;
            }
            if !w.limited && settled && (iteration > 1 || sys.linear) {
                if largest <= 1.0 && (transient.is_some() || self.balances(w, x, shunt)) {
                    // what finds no rest, a relaxation oscillator, has no point
                    return match sys.asking(w, x, 0.0, self.free, self.reltol) {
                        Some(flag) if flips >= CHATTER => Err(Failure::Contradiction { flag }),
                        _ => Ok(iteration),
                    };
                }
                self.unbalanced |= largest <= 1.0;
                // tolerances below the rounding of the equations, after as many iterations: nothing better can be found
                if iteration > 6 && shunt == 0.0 && transient.is_none() && self.is_rounding(w, x) {
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
                let k = per_square * rest::way(sys, w, q, u) * if mass > 0.0 { mass } else { 1.0 };
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
        let free = self.free;
        let asked = |w: &mut Work, x: &[f64]| sys.asking(w, x, 0.0, free, 0.0).is_some();
        if !asked(w, &at(1.0, &self.residual)) {
            return false;
        }
        let (mut low, mut high) = (0.0, 1.0);
        // bisections of a step for the place where a condition turns
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if asked(w, &at(middle, &self.residual)) {
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
///
/// Where a run starts (not `w.dc`) and conditions find no rest, as in a relaxation oscillator, there is no such point. The run then starts
/// from a named substitute: conditions that jump stay as the given values have them, and all that is continuous is solved,
/// min, max and limits with it. `w.doubts.substitute` is the condition that is not what it says there, and how it is held.
pub fn operating_point(
    sys: &System,
    w: &mut Work,
    o: &Options,
    tol: &Tolerances,
    statics: bool,
    x: &mut [f64],
) -> Result<(), NoPoint> {
    w.gmin = o.gmin;
    (w.doubts.hanging, w.doubts.substitute) = (None, None);
    if !statics && sys.unknowns.iter().all(|u| u.kind.mechanical()) {
        // all of it is held where it is
        for _ in 0..CHATTER {
            if !sys.update_flags(w, x, 0.0) {
                break;
            }
        }
        return Ok(());
    }
    let singular = |why| NoPoint { why, tried: vec![] };
    let dc = Dc::new(sys, !statics, !w.dc, o.reltol, x).map_err(singular)?;
    let mut search = Search { dc, o, tol, start: x.to_vec(), tried: Vec::new(), hung: None };
    search.begin(w, x);
    if !search.dc.pairs.is_empty() {
        return search.rest(w, x);
    }
    let found = search.seek(w, x).map_err(|why| NoPoint { why, tried: std::mem::take(&mut search.tried) });
    let jumps = |f: &FlagSpec| !f.is_kink() && !f.law.of_modes();
    if w.dc || found.is_ok() || !sys.flags.iter().any(jumps) {
        return found;
    }
    search.dc.free = Free::Kinks;
    search.hung = None;
    if search.seek(w, x).is_err() {
        return found;
    }
    w.doubts.substitute = sys.asking(w, x, 0.0, Free::All, o.reltol).map(|flag| (flag, w.flags[flag] != 0.0));
    Ok(())
}

/// A search for an operating point.
struct Search<'a> {
    dc: Dc<'a>,
    o: &'a Options,
    tol: &'a Tolerances,
    start: Vec<f64>, // of every attempt
    tried: Vec<String>,
    /// a point that is one by the currents of gmin alone is the last that is taken
    hung: Option<(Vec<f64>, Held, Hanging)>,
}

impl Search<'_> {
    /// First solutions: with nodes held where the deck says so, without devices that are off, with switches as their cards say.
    fn begin(&mut self, w: &mut Work, x: &mut [f64]) {
        let (sys, dc, most) = (self.dc.sys, &mut self.dc, self.o.itl1);
        // `.ic` is about the start of a run: where sources have their DC values it counts for nothing
        let forces: Vec<_> = sys.forces.iter().filter(|f| f.release || !w.dc).collect();
        let held = |release: bool| -> Vec<(usize, f64)> {
            forces.iter().filter(|f| f.release == release).map(|f| (f.row, f.value)).collect()
        };
        let (nodesets, ics) = (held(true), held(false));
        // every attempt begins where the user expects the point
        nodesets.iter().chain(&ics).for_each(|&(row, value)| self.start[row] = value);
        dc.forced.clone_from(&ics);
        if !nodesets.is_empty() {
            dc.forced.extend(&nodesets);
            if dc.newton(w, x, 0.0, None, self.tol, most).is_err() {
                x.copy_from_slice(&self.start);
            }
            dc.forced.clone_from(&ics);
        }
        sys.update_flags(w, x, 0.0);
        if sys.devices.some_off {
            w.without_off = true;
            let found = dc.newton(w, x, linear::LEAK, None, self.tol, most);
            w.without_off = false;
            match found {
                Ok(_) => self.start.copy_from_slice(x),
                Err(_) => self.reset(w, x),
            }
        }
        // between its thresholds a switch is what its card says; whether it is between them, a first solution tells
        if sys.flags.iter().zip(&w.flags).any(|(f, &now)| f.rest > 0 || (f.rest == 0 && now > 0.0)) {
            for (flag, f) in w.flags.iter_mut().zip(&sys.flags).filter(|(_, f)| f.rest >= 0) {
                *flag = f64::from(f.rest);
            }
            self.dc.free = Free::Unsaid;
            match self.dc.newton(w, x, 0.0, None, self.tol, most) {
                Ok(_) => _ = sys.update_flags(w, x, 0.0),
                Err(_) => self.reset(w, x),
            }
            self.dc.free = Free::All;
        }
    }

    /// As it was before the first attempt.
    fn reset(&self, w: &mut Work, x: &mut [f64]) {
        let sys = self.dc.sys;
        x.copy_from_slice(&self.start);
        w.ports = sys.work().ports;
        w.reset_flags(sys);
        w.source_factor = 1.0;
        w.gmin = self.o.gmin;
        sys.touch_sources(w);
        sys.update_flags(w, x, 0.0);
    }

    /// A machine comes to rest: electrical unknowns first, then downhill.
    fn rest(mut self, w: &mut Work, x: &mut [f64]) -> Result<(), NoPoint> {
        let (sys, dc) = (self.dc.sys, &mut self.dc);
        if let Ok(mut held) = Dc::new(sys, true, !w.dc, self.o.reltol, x) {
            let _ = held.newton(w, x, 0.0, None, self.tol, self.o.itl1);
        }
        let tried = vec!["downhill from the start".into()];
        let couples = couples(sys);
        dc.holding = Holding::new(sys, w, x, &couples, self.tol);
        if let Err(why) = descend(dc, w, x, self.tol) {
            return Err(NoPoint { why, tried });
        }
        let found = settled(dc, w, x, self.tol, self.o).map_err(|why| NoPoint { why, tried });
        w.doubts.hanging = dc.hanging(w, x, 0.0, self.o);
        dc.holding.iter().for_each(|holding| holding.end(sys, w));
        found
    }

    /// A point that does not hang on gmin; one that does is kept.
    fn stands(&mut self, w: &mut Work, x: &[f64], shunt: f64) -> bool {
        let hanging = self.dc.hanging(w, x, shunt, self.o);
        if let (Some(hanging), None) = (hanging, &self.hung) {
            self.hung = Some((x.to_vec(), w.held(), hanging));
        }
        hanging.is_none()
    }

    /// What an attempt has led to: polished, it stands on its own. None where it hangs.
    fn accept(&mut self, led: Result<(), Failure>, w: &mut Work, x: &mut [f64]) -> Result<bool, Failure> {
        led.and_then(|()| polish(&mut self.dc, w, x, self.tol, self.o))?;
        Ok(self.stands(w, x, 0.0))
    }

    /// Newton's method from x, then from afar.
    fn seek(&mut self, w: &mut Work, x: &mut [f64]) -> Result<(), Failure> {
        let (tol, o) = (self.tol, self.o);
        self.tried.push(format!("Newton's method ({} iterations)", o.itl1));
        if self.dc.free == Free::Kinks {
            self.reset(w, x);
        }
        // a point that another iteration leaves again is none
        let led = self.dc.newton(w, x, 0.0, None, tol, o.itl1).map(|_| ());
        let mut why = match self.accept(led, w, x) {
            Ok(true) => return Ok(()),
            Ok(false) => Failure::Diverged { unknown: 0, row: 0 },
            Err(why) => why,
        };
        if self.dc.unbalanced {
            self.tried.push("a start without the expressions".into());
            self.reset(w, x);
            // from nothing on, Newton's method doubles a divisor in every iteration
            // iterations from the least divisor, 1e-32, to 1
            if self.dc.without_expressions(w, x) && self.dc.newton(w, x, 0.0, None, tol, o.itl1 + 107).is_ok() {
                match self.accept(Ok(()), w, x) {
                    Ok(true) => return Ok(()),
                    Ok(false) => {}
                    Err(e) => why = e,
                }
            }
        }
        // a matrix that is singular whatever the shunts are has no point to find
        if !matches!(&why, Failure::Singular(s) if s.structural) {
            match self.search_from_afar(w, x, &why) {
                Ok(true) => return Ok(()),
                Ok(false) => {}
                Err(e) => why = e,
            }
        }
        let Some((point, held, hanging)) = self.hung.take() else { return Err(why) };
        self.reset(w, x);
        x.copy_from_slice(&point);
        w.restore(&held);
        w.doubts.hanging = Some(hanging);
        Ok(())
    }

    /// By homotopies: conductances to ground that fall, sources that grow, time. False: all that was found hangs on gmin. `why`: what
    /// Newton's method said.
    fn search_from_afar(&mut self, w: &mut Work, x: &mut [f64], why: &Failure) -> Result<bool, Failure> {
        let (tol, o, gmin) = (self.tol, self.o, self.o.gmin);
        self.tried.push("gmin stepping".into());
        self.reset(w, x);
        let ladder = |s: f64| 1e-2_f64 * (1e-13_f64 / 1e-2).powf(s);
        let led = self.dc.walk(w, x, tol, 50, &mut |_, s| if s >= 1.0 { 0.0 } else { ladder(s) });
        if matches!(self.accept(led, w, x), Ok(true)) {
            return Ok(true);
        }
        // nodes that hang on capacitors alone: the shunt of gmin gives them a point
        self.reset(w, x);
        let shunted = self.dc.walk(w, x, tol, 50, &mut |_, s| ladder(s).max(gmin)).is_ok();
        w.gmin = gmin;
        let asked = self.dc.sys.asking(w, x, 0.0, self.dc.free, o.reltol).is_some();
        let shunted = shunted && !asked && balanced(&self.dc, w, x, 0.0, tol, o).is_ok();
        // (what only this shunt carries nothing determines)
        match shunted.then(|| self.dc.hanging(w, x, gmin, o)) {
            Some(None) => return Ok(true),
            Some(Some(_)) if matches!(why, Failure::Singular(_)) => {
                self.hung = None;
                return Err(why.clone());
            }
            _ => {}
        }
        self.tried.push("source stepping".into());
        self.reset(w, x);
        let mut grow = |w: &mut Work, s: f64| {
            w.source_factor = s;
            if s >= 1.0 {
                0.0
            } else {
                gmin
            }
        };
        let led = self.dc.walk(w, x, tol, 50, &mut grow);
        w.source_factor = 1.0;
        self.dc.sys.touch_sources(w);
        if matches!(self.accept(led, w, x), Ok(true)) {
            return Ok(true);
        }
        self.tried.push("pseudo-transient".into());
        self.reset(w, x);
        let led = pseudo_transient(&mut self.dc, w, x, tol);
        self.accept(led, w, x)
    }
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
    if let Some(flag) = dc.sys.asking(w, x, 0.0, dc.free, o.reltol) {
        return Err(Failure::Contradiction { flag });
    }
    balanced(dc, w, x, 0.0, tol, o)
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
    // so often a rest that is indifferent is solved for from the last solution
    for _ in 0..3 {
        dc.lean = Some((1.0, x.to_vec()));
        found = polish(dc, w, x, tol, o);
    }
    dc.lean = None;
    found
}

/// Is F of the equations, without any shunt, nothing but what the tolerances of its terms allow? `abstol` besides, and what leaks
/// through gmin where there is nothing else. Currents of sources are no part of Newton's norm, but their rows are equations too.
fn balanced(dc: &Dc, w: &mut Work, x: &[f64], t: f64, tol: &Tolerances, o: &Options) -> Result<(), Failure> {
    let sys = dc.sys;
    sys.eval_jacobian(w, x, t, false);
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
