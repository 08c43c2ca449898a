//! Newton's method on one implicit stage:   F(x, t) + a Q(x, t) + r = 0.
//!
//! Backward Euler, trapezoid, BDF and SDIRK stages, the consistent start and the operating point (a = 0) are all of this
//! form, so one loop serves them. Rows without d/dt have a Q = 0 and r = 0: they read F = 0.
//!
//! Convergence is judged on the update, |dx_i| <= reltol |x_i| + abstol_i. Since the residual of an accepted iterate is
//! J dx, a small update bounds the residual of every row by sum_j |J_ij| tol_j; the operating point, where steps can be
//! long, evaluates the residual itself once more. Multipliers, derivative unknowns and currents of voltage sources enter
//! linearly and converge with the rest: they are outside the norm, because the rounding noise of such a force, or of the
//! current of a capacitor across a source, grows as 1/h.
//!
//! Where accounts of energy are kept the currents of devices must agree with the lines that led to them as well: within the tolerance
//! of 300 V a diode's current may be anything.
//!
//! In a passive network of two-poles (passive.rs) an iterate may be accepted without that: what the straight lines of the
//! devices have missed at the new point is measured there, and bounds the next update of every device's voltage.
mod kept;
mod noise;

use crate::interrupt;
use crate::model::Kind;
use crate::multiversion::{by_lanes, whole, Lanes};
use crate::sparse::{Lu, Once, Program, Recurring, Singular};
use crate::system::{Stage, System, Work, LARGEST};
use crate::tape::{Value, Written};
pub use crate::tolerances::{Options, Tolerances};
pub use noise::Noise;

#[derive(Clone, Debug)]
pub enum Failure {
    Singular(Singular),
    /// worst unknown, and the row of the largest residual
    Diverged {
        unknown: usize,
        row: usize,
    },
    NotFinite {
        unknown: usize,
    },
    /// a clocked signal that is no number
    Signal {
        signal: usize,
    },
    /// an FMU that is part of the deck: its card, and why it does not go on
    Foreign {
        card: String,
        said: String,
    },
    /// flags that have no consistent values: one of them
    Contradiction {
        flag: usize,
    },
    /// a rigid end is met by a motion that is given: its flag
    Blocked {
        flag: usize,
    },
    /// a closed loop goes on in another way than it was on; the speed that jumps
    LeavesBranch {
        unknown: usize,
    },
    /// the method cannot do equations of this kind, whatever the step
    Unfit {
        why: String,
    },
    /// the rest would take too many steps: their number, the time of all, and who asks for them (unknown, period, steps a
    /// period)
    TooLong {
        steps: f64,
        seconds: f64,
        mode: Option<(usize, f64, f64)>,
    },
}

impl From<Singular> for Failure {
    fn from(s: Singular) -> Failure {
        match s.col.filter(|_| !s.finite) {
            Some(unknown) => Failure::NotFinite { unknown },
            None => Failure::Singular(s),
        }
    }
}

impl Failure {
    /// The same in a system of which this was a part; `of`: where its unknowns are there.
    pub fn renumbered(self, of: &[usize]) -> Failure {
        let at = |k: usize| of.get(k).copied().unwrap_or(k);
        match self {
            Failure::Singular(mut s) => {
                (s.row, s.col) = (s.row.map(at), s.col.map(at));
                Failure::Singular(s)
            }
            Failure::Diverged { unknown, row } => Failure::Diverged { unknown: at(unknown), row: at(row) },
            Failure::NotFinite { unknown } => Failure::NotFinite { unknown: at(unknown) },
            Failure::LeavesBranch { unknown } => Failure::LeavesBranch { unknown: at(unknown) },
            unfit => unfit,
        }
    }
}

/// An iteration that has not converged after so many may have met the rounding of charges.
const STALLS: usize = 8;

/// An exponential in an expression that has come to more than so many times what it was at the last solution is looked at once more,
/// and one that then falls by as much has not been solved.
const LEAP: f64 = 2.0;
/// ... if it is so much of the largest.
const COUNTS: f64 = 1e-3;
/// The same after an update of more than this part of a tolerance that is loose: millivolts of a hundred.
const FAR: f64 = 0.02;
const LOOSE: f64 = 2e-5;

/// A program of a stage, and how often what it computes was asked for.
#[derive(Default)]
struct Asked {
    count: u64,
    program: Recurring,
}

impl Asked {
    #[inline(always)]
    fn due(
        &mut self,
        n: usize,
        once: &Once,
        write: impl FnOnce() -> Option<(Written, Vec<Value>)>,
    ) -> Option<&mut Program> {
        self.count += 1;
        let write = || write().and_then(|(program, results)| program.native(&results));
        if n <= LARGEST {
            self.program.shared(self.count, once, write)
        } else {
            None
        }
    }
}

/// Iterates that are good but for the currents of diodes: more than so many are not waited for.
const PATIENCE: u32 = 6;

pub struct Newton {
    lu: Lu<f64>,
    /// What a device's voltage may miss when straight lines end an iteration, in parts of its tolerance.
    pub missed: f64,
    held: bool, // every device's nodes are, by capacitors or sources: no current is driven into it whatever its voltage
    key: f64,   // the `a` of a factorisation that is still valid (linear systems only)
    a: f64,     // the `a` of `rows` and of the base in `lu`
    rows: Vec<f64>,
    base: Vec<f64>,
    sources: Vec<f64>,
    settled: Vec<f64>, // the sources of the last solution, where exponentials are to be watched
    effort: usize,     // of an iteration, in operations
    n: usize,
    step: Vec<f64>, // whole blocks
    noise: Noise,
    stage: Stage,
    closing: Asked,    // q of a solution
    storing: Asked,    // a C e of a filtered error
    charges: Vec<f64>, // Q of the solution, in whole blocks
    slopes: Vec<f64>,  // F there; empty for those who do not ask for it
}

impl Newton {
    pub fn new(sys: &System) -> Result<Newton, Failure> {
        let symbolic = sys.symbolic().map_err(Failure::from)?;
        let mut lu = Lu::new(symbolic);
        lu.set_stamps(sys.stamps());
        if sys.is_dominant() {
            lu.set_dominant(sys.unknowns.iter().map(|u| u.kind == Kind::Node).collect());
        }
        Ok(Newton {
            lu,
            missed: 1.0,
            held: sys.passive && !sys.has_coils() && sys.nodes_hold_devices(),
            key: f64::NAN,
            a: f64::NAN,
            rows: Vec::new(),
            base: Vec::new(),
            sources: Vec::new(),
            settled: Vec::new(),
            n: sys.n,
            effort: 10 * sys.n + sys.operations().1 + 100,
            step: vec![0.0; whole(sys.n)],
            noise: Noise::new(sys.n),
            stage: Stage::new(sys),
            closing: Asked::default(),
            storing: Asked::default(),
            charges: vec![0.0; whole(sys.n)],
            slopes: vec![0.0; sys.n],
        })
    }

    /// For a method that hardly ever asks for factors: what it finds solutions by may leave none. They are made when they are asked
    /// for, by `hold`, and F by `find_f`.
    pub fn bare(mut self) -> Newton {
        self.lu.set_bare();
        self.slopes.clear();
        self
    }

    /// The held factorisation no longer fits (a flag changed, say).
    pub fn forget(&mut self) {
        self.key = f64::NAN;
    }

    /// Q of the last solution.
    pub fn q(&self) -> &[f64] {
        &self.charges[..self.n]
    }

    /// Q of a solution that was found elsewhere.
    pub fn put_q(&mut self, q: &[f64]) {
        self.charges[..self.n].copy_from_slice(q);
    }

    /// F of the last solution, as the stage equation gives it: charge is conserved.
    pub fn f(&self) -> &[f64] {
        &self.slopes
    }

    /// The same from where it was found. `r` is 0 in rows without d/dt.
    pub fn find_f(&self, a: f64, stage: &Stage, f: &mut [f64]) {
        for (f, (q, r)) in f.iter_mut().zip(self.charges.iter().zip(stage.r())) {
            *f = 0.0 - (a * q + r);
        }
    }

    /// Q of the last solution in whole blocks.
    pub fn q_blocks(&self) -> &[f64] {
        &self.charges
    }

    /// Solves the stage from the guess in `x`; leaves its charges in `q` and `f`. `r` is 0 in rows without d/dt.
    pub fn solve(
        &mut self,
        sys: &System,
        w: &mut Work,
        a: f64,
        r: &[f64],
        x: &mut [f64],
        t: f64,
        tol: &Tolerances,
        max_iterations: usize,
    ) -> Result<usize, Failure> {
        let mut stage = std::mem::take(&mut self.stage);
        let (guess, past) = stage.parts_mut();
        guess.copy_from_slice(x);
        past.copy_from_slice(r);
        let solved = solve_stage(self, sys, w, a, &mut stage, t, tol, max_iterations);
        x.copy_from_slice(stage.x());
        self.stage = stage;
        solved
    }

    /// A step from x0 with the charges q0 at t has met values that are not finite: the row that they come from, as steps of length h and longer ones find it
    /// again, up to `longest`. (What is known of a solution that has failed is that they are everywhere.)
    pub fn whence(
        &mut self,
        sys: &System,
        w: &mut Work,
        (t, x0, q0): (f64, &[f64], &[f64]),
        (h, longest): (f64, f64),
        tol: &Tolerances,
    ) -> Option<usize> {
        let lengths = std::iter::successors(Some(h), |h| Some(10.0 * h)).take_while(|&l| l <= h.max(longest));
        for h in lengths {
            let r: Vec<f64> = q0.iter().map(|q| -q / h).collect();
            for most in 0..STALLS {
                let mut x = x0.to_vec();
                self.forget();
                let ended = most > 0 && self.solve(sys, w, 1.0 / h, &r, &mut x, t + h, tol, most).is_ok();
                if x.iter().any(|v| !v.is_finite()) {
                    break;
                }
                sys.eval_jacobian(w, &x, t + h, false);
                if let Some(row) = sys.not_finite(w) {
                    return Some(row);
                }
                if ended {
                    break;
                }
            }
        }
        None
    }

    /// `solve` of a stage that the caller has.
    #[inline(always)]
    pub fn solve_stage<L: Lanes>(
        &mut self,
        sys: &System,
        w: &mut Work,
        a: f64,
        stage: &mut Stage,
        t: f64,
        tol: &Tolerances,
        max_iterations: usize,
    ) -> Result<usize, Failure> {
        sys.set_time(w, t);
        stage.set_sources(w);
        if sys.pure_linear {
            return self.solve_linear(sys, w, a, stage);
        }
        sys.stage_expand(w, stage.x(), t, a);
        let (fit, mut good) = (tol.accounts && a > 0.0 && sys.exponentials() > 0, 0);
        for iteration in 1..=max_iterations {
            w.counters.iterations += 1;
            interrupt::spent(self.effort);
            self.update(sys, w, a, stage)?;
            let converged = self.advance::<L>(stage, tol)?;
            let x = stage.x();
            if fit {
                let limited = w.limited;
                let met = sys.stage_expand_and_fit(w, x, t, a);
                let near = converged || (iteration >= STALLS && self.within_rounding(sys, w, a, x, tol));
                good += u32::from(near && !limited);
                if (met && near) || good > PATIENCE {
                    self.close(sys, w, a, stage, false);
                    return Ok(iteration);
                }
                continue;
            }
            let asked = converged || iteration >= STALLS;
            let straight = asked && !w.limited && (self.held || !sys.leaves_lines(w, &self.step, x));
            let converged = converged && straight;
            let doubtful =
                converged && sys.is_exponential() && (leapt(&self.sources, &self.settled) || self.far(x, tol));
            if sys.linear || (converged && !doubtful) {
                if sys.is_exponential() {
                    self.settled.clone_from(&self.sources);
                }
                self.close(sys, w, a, stage, true);
                return Ok(iteration);
            }
            let judged = if doubtful {
                sys.stage_expand(w, x, t, a);
                !w.limited && !self.turns(sys, w, a)
            } else {
                let judged = sys.stage_expand_and_judge(w, x, t, a, (self.missed * tol.reltol, tol.vntol));
                judged || (iteration >= STALLS && straight && !w.limited && self.within_rounding(sys, w, a, x, tol))
            };
            if judged {
                self.close(sys, w, a, stage, false);
                return Ok(iteration);
            }
        }
        let x = stage.x();
        let ratio = |i: usize| {
            if tol.in_norm[i] {
                self.step[i].abs() / tol.weight(i, x[i], x[i])
            } else {
                0.0
            }
        };
        let unknown = (0..sys.n).max_by(|&i, &j| ratio(i).total_cmp(&ratio(j))).unwrap_or(0);
        sys.eval(w, x, t);
        let row = (0..sys.n).max_by(|&i, &j| w.f[i].abs().total_cmp(&w.f[j].abs())).unwrap_or(0);
        Err(Failure::Diverged { unknown, row })
    }

    /// Does the iterate that has just been expanded show derivatives that have fallen or risen by far? Holds them as the last ones.
    fn turns(&mut self, sys: &System, w: &Work, a: f64) -> bool {
        let before = std::mem::take(&mut self.sources);
        sys.stage_sources(w, a, &mut self.sources);
        let turns = leapt(&before, &self.sources) || leapt(&self.sources, &before);
        if !turns {
            self.settled.clone_from(&self.sources);
        }
        turns
    }

    /// Was the last update more than a small part of the tolerance, which may be many times what an exponential is bent on?
    fn far(&self, x: &[f64], tol: &Tolerances) -> bool {
        let far = |i: usize| tol.in_norm[i] && self.step[i].abs() > FAR * tol.weight(i, x[i], x[i]);
        tol.reltol >= LOOSE && (0..x.len()).any(far)
    }

    /// step <- -(G + a C)^-1 (F + a Q + r) at x, of what was expanded there.
    #[inline(always)]
    fn update(&mut self, sys: &System, w: &mut Work, a: f64, stage: &Stage) -> Result<(), Failure> {
        if !sys.linear {
            let inputs = sys.stage_inputs(w, stage.numbers(), a);
            if self.lu.factor_and_solve_by_program(|| sys.stage_equations(), &inputs, &mut self.step[..self.n]) {
                if sys.is_exponential() {
                    sys.stage_sources(w, a, &mut self.sources);
                }
                w.counters.factorisations += 1;
                w.counters.solves += 1;
                return Ok(());
            }
        }
        self.set_constants(sys, a);
        sys.stage_residual(w, a, &self.rows, stage.r(), stage.x(), &mut self.step[..self.n]);
        let mut step = std::mem::take(&mut self.step);
        let solved = self.solution(sys, w, a, &mut step[..self.n]);
        self.step = step;
        solved
    }

    /// Constant parts of matrix and residual with this a.
    fn set_constants(&mut self, sys: &System, a: f64) {
        if self.a != a {
            sys.stage_constants(a, &mut self.rows, &mut self.base);
            self.lu.set_base(&self.base);
            self.a = a;
        }
    }

    /// b <- (G + a C)^-1 b, with the held factors where they are still those.
    fn solution(&mut self, sys: &System, w: &mut Work, a: f64, b: &mut [f64]) -> Result<(), Failure> {
        if (sys.linear && self.key == a) || (sys.pure_linear && self.lu.recall(a)) {
            self.lu.solve(b);
        } else {
            sys.stage_sources(w, a, &mut self.sources);
            self.lu.factor_and_solve(&self.sources, b).map_err(Failure::from)?;
            w.counters.factorisations += 1;
            if sys.pure_linear {
                self.lu.keep(a);
            }
        }
        self.key = if sys.linear { a } else { f64::NAN };
        w.counters.solves += 1;
        Ok(())
    }

    /// One solution is all: F = G x + waves, Q = C x, whatever the guess.
    fn solve_linear(&mut self, sys: &System, w: &mut Work, a: f64, stage: &mut Stage) -> Result<usize, Failure> {
        w.counters.evaluations += 1;
        w.counters.iterations += 1;
        interrupt::spent(self.effort);
        self.set_constants(sys, a);
        let (x, r) = stage.parts_mut();
        for (b, r) in x.iter_mut().zip(r) {
            *b = -*r;
        }
        sys.subtract_waves(w, x);
        self.solution(sys, w, a, x)?;
        if x.iter().fold(false, |bad, v| bad | !v.is_finite()) {
            return Err(not_finite(x));
        }
        self.close(sys, w, a, stage, false);
        Ok(1)
    }

    /// x <- x + step; true when the step was within the tolerance. Dividing is left for the failure's report.
    #[inline(always)]
    fn advance<L: Lanes>(&self, stage: &mut Stage, tol: &Tolerances) -> Result<bool, Failure> {
        match tol.advance::<L>(&self.step, stage.blocks_mut().0) {
            (converged, true) => Ok(converged),
            _ => Err(not_finite(stage.x())),
        }
    }

    /// e <- (G + a C)^-1 a C e with the last factorisation: what remains of an error where it is not damped at once.
    pub fn filter(&mut self, sys: &System, w: &mut Work, a: f64, e: &mut [f64]) {
        let step = &mut self.step[..self.n];
        if let Some(program) = self.storing.due(sys.n, &sys.made.storing, || sys.stage_stored()) {
            program.run(&sys.stage_inputs(w, e, a), step);
        } else {
            sys.c_times(w, e, step);
            for v in step.iter_mut() {
                *v *= a;
            }
        }
        self.lu.solve(step);
        w.counters.solves += 1;
        e.copy_from_slice(step);
    }

    /// Makes the factors of what was expanded last where a solution has left none. False where that has none: solutions by
    /// them are no numbers.
    pub fn hold(&mut self, sys: &System, w: &Work, a: f64) -> bool {
        self.lu.is_ready() || self.factor(sys, w, a)
    }

    /// Makes the factors of what was expanded last.
    pub fn factor(&mut self, sys: &System, w: &Work, a: f64) -> bool {
        self.set_constants(sys, a);
        sys.stage_sources(w, a, &mut self.sources);
        self.lu.factor_stamped(&self.sources).is_ok()
    }

    /// b <- (G + a C)^-1 b with the last factorisation.
    pub fn solve_held(&mut self, w: &mut Work, b: &mut [f64]) {
        self.lu.solve(b);
        w.counters.solves += 1;
    }

    /// Sign of the last matrix's determinant, to be compared with another one's of the same equations.
    pub fn negative(&self) -> bool {
        self.lu.negative()
    }

    /// What rounding does to the unknowns at x, whose charges are held.
    pub fn round(&mut self, sys: &System, w: &mut Work, a: f64, x: &[f64]) -> &[f64] {
        w.counters.solves += 2;
        if !self.hold(sys, w, a) {
            self.noise.of.fill(0.0);
        } else {
            self.noise.find(sys, (w, a), [x, &self.charges], |b| self.lu.solve(b));
        }
        &self.noise.of
    }

    /// The largest of the errors e over `share` of its unknown's tolerance and that noise: no shorter step has less of it.
    pub fn above_noise(
        &mut self,
        sys: &System,
        w: &mut Work,
        a: f64,
        e: impl Fn(usize) -> f64,
        (x1, x0): (&[f64], &[f64]),
        tol: &Tolerances,
        share: f64,
    ) -> f64 {
        self.round(sys, w, a, x1);
        let over = |e: f64, i: usize| e.abs() / (share * tol.error_weight(i, x1[i], x0[i]) + self.noise.of[i]);
        let alone = (0..x1.len()).filter_map(|i| Some(tol.share(i)? * over(e(i), i))).fold(0.0, f64::max);
        tol.tied.iter().map(|&(node, root)| over(e(node) - e(root), node)).fold(alone, f64::max)
    }

    /// Is the last update no more than that, where it is more than the tolerance? No iteration gets nearer.
    fn within_rounding(&mut self, sys: &System, w: &mut Work, a: f64, x: &[f64], tol: &Tolerances) -> bool {
        sys.stage_charges(w, x, None, &mut self.charges[..sys.n]);
        self.round(sys, w, a, x);
        (0..x.len()).all(|i| !tol.in_norm[i] || self.step[i].abs() <= tol.weight(i, x[i], x[i]) + self.noise.of[i])
    }

    /// Q at the solution x, to first order from where it was expanded if the last step led away from there (`moved`), and F.
    #[inline(always)]
    fn close(&mut self, sys: &System, w: &Work, a: f64, stage: &Stage, moved: bool) {
        if let Some(program) = self.closing.due(sys.n, &sys.made.closing, || sys.stage_closing()) {
            program.run(&sys.stage_inputs(w, stage.numbers(), a), &mut self.charges);
        } else {
            sys.stage_charges(w, stage.x(), moved.then_some(&self.step), &mut self.charges[..sys.n]);
        }
        let mut slopes = std::mem::take(&mut self.slopes);
        self.find_f(a, stage, &mut slopes);
        self.slopes = slopes;
    }
}

by_lanes! {
    fn solve_stage<L>(
        newton: &mut Newton,
        sys: &System,
        w: &mut Work,
        a: f64,
        stage: &mut Stage,
        t: f64,
        tol: &Tolerances,
        most: usize,
    ) -> Result<usize, Failure> { newton.solve_stage::<L>(sys, w, a, stage, t, tol, most) }
}

/// Are some of these derivatives, none of the small ones, far larger than before? Up an exponential that was guessed too far every
/// update is its own scale, 26 mV of a junction, and within the tolerance of 300 V.
fn leapt(now: &[f64], before: &[f64]) -> bool {
    let largest = now.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
    let far = |(s, before): (&f64, &f64)| s.abs() > LEAP * before.abs() && s.abs() > COUNTS * largest;
    now.len() != before.len() || now.iter().zip(before).any(far)
}

fn not_finite(x: &[f64]) -> Failure {
    Failure::NotFinite { unknown: x.iter().position(|v| !v.is_finite()).unwrap_or(0) }
}

#[cfg(test)]
mod tests;
