//! Backward differentiation formulas, orders 1 to 6, variable step and order ("Gear"). Without maxord the orders are 1 to 5, and 6
//! where nothing oscillates by itself (`REAL`); with maxord 2 or less everything is as SPICE's users expect: rows are steps, no longer than TSTEP.
//!
//! dQ/dt at t1 is the slope of the polynomial through the last k+1 charges (Lagrange form on the true, unequal points):
//!
//!   sum_j alpha_j Q_j + F(x1, t1) = 0,   alpha_j = l_j'(t1)
//!
//! so that  a = alpha_0  and  r = sum_{j>=1} alpha_j Q_j; by differences (differences.rs)
//!
//!   a = sum_{i<=k} 1 / (t1 - t_{1-i}),    r = - sum_{m<=k} beta_m phi_m sum_{m<=i<=k} 1 / (t1 - t_{1-i})
//!
//! and with a share of the next formula's last term in it (`NEXT`).
//!
//! Error constants are those of the variable-step formula: with the (k+1)-th divided difference dd of x over k+2 points,
//! lte = h / (t1 - t_{-k}) * prod_{j=0..k} (t1 - t_{-j}) * dd (Brenan, Campbell and Petzold 1996, section 5.2).  The order
//! moves by at most one a step, to whichever of k-1, k, k+1 allows the longest next step.
//!
//! First guess: the polynomial through the last k+1 points, which is k+1-th order accurate as the solution is (its distance
//! from the solution is the product in the error estimate). Dense output: the polynomial through the k+1 points of the formula.
//! Accounts of energy integrate the polynomial through the powers at the newest k points, of the formula's order too: the
//! points solve the equations, between them a diode's exponential is far from any polynomial of its voltage.
mod control;
mod differences;

use self::control::{Control, Pace, Taken, AHEAD, SPICE};
use self::differences::{slope, towards, towards_by, Differences, ROWS};
use super::rows::Lags;
use super::{response, Attempt, Character, History, Method, Response};
use crate::ledger::Stages;
use crate::multiversion::{by_lanes, whole, Lanes};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::rounding::{ROUNDED, SAME};
use crate::sparse::Complex;
use crate::system::{Stage, System, Work};

const MOST: usize = 6; // the highest order that is zero-stable (Cryer 1972; Hairer, Norsett and Wanner I, theorem III.3.4)
const POINTS: usize = MOST + 2; // past points that are kept
/// ... without being asked for more: order 6 is stable to 18 degrees only.
const HIGHEST: usize = 5;
/// The local tolerance against the asked one, where trtol does not say: keeps the global error near what was asked.
pub const LOCAL: f64 = 0.33;
/// ... where there are coils beside diodes, which `auto` leaves to gear: what rings adds up its errors over the periods (a flyback
/// converter's leakage at 1e-4: 40 times reltol with 0.4). And where accounts are kept, which integrate currents.
const STRICT: f64 = 0.1;
/// Beside diodes without coils, where long steps are held to less (`control::Pace`), short ones to so many times that.
const SHORT: f64 = 3.0;
/// Of nodes that capacitors tie together what they have in common hardly counts in the norm, and errs with the rest: that is held to less.
const TIED: f64 = 0.25;
/// At looser tolerances the share of it is below them.
const TIED_BELOW: f64 = 5e-6;
/// Beside junctions looser tolerances than this save hardly a step and lose their digits all the same: errors are held to this one.
const FAITHFUL: f64 = 1e-4;
/// The slope of the formula of order k lacks (Q1 - what the polynomial through the k + 1 points behind says)/(t1 - t_{1-k-1}) of that of
/// order k + 1. With a share of it the order stays, and the error is so much smaller: the numerical differentiation formulas of
/// Klopfenstein (1971), on unequal points. Shampine and Reichelt (The MATLAB ODE suite, 1997) take 0.37, 0.5, 0.6 and 0.43 from order 1
/// on. 0.5 leaves order 2 A-stable, 0.3 order 3 to 84 degrees (86 without), 0.43 would order 4 to 66 (73): not for what rings. Order 1 is
/// that of the steps past corners, of which the points behind know nothing. Not where accounts are kept: their integrals are exact for
/// what follows the plain formulas.
const NEXT: [f64; MOST + 1] = [0.0, 0.0, 0.5, 0.3, 0.0, 0.0, 0.0];
/// The same in passive networks without coils: matrices C and G of their nodes are symmetric and have no negative eigenvalue, so modes
/// are exp(-lambda t) with real lambda, on which every order and every share here is stable (test below). Steps and iterations of the
/// diode multiplier to 1e-6 and 1e-7: 5860 and 6760, 8280 and 8900 without, 5500 and 6430, 7550 and 8190 with 0.3 in order 5 too.
const REAL: [f64; MOST + 1] = [0.0, 0.0, 0.5, 0.3, 0.3, 0.5, 0.0];
/// So much of what the error falls by is taken in longer steps: estimates of long steps know it less well.
const TAKEN: f64 = 0.5;
/// Of the first step's movement, what is held to the tolerance.
const FIRST: f64 = 0.2;

/// Beside diodes: what conducts at a crest for less than a twentieth of a period lies between longer steps (peak_detector).
const IN_A_PERIOD: f64 = 40.0;

pub struct Gear {
    character: Character,
    newton: Newton,
    now: f64,             // of the newest point
    times: [f64; POINTS], // of past points since then, newest first: sums of steps, of which absolute times know too little
    len: usize,           // how many there are
    behind: Differences,
    f0: Vec<f64>, // F at the start
    t1: f64,      // of the candidate, since then as well
    stage: Stage,
    betas: [f64; ROWS], // towards it
    missed: Vec<f64>, // of the candidate: less what the polynomial through the points of the formula and one more says; whole blocks
    given: Vec<usize>, // unknowns that have what a source has
    noise: Noise,
    order: usize,
    maxord: usize,
    spice: bool, // maxord asks for what SPICE has
    control: Control,
    shares: [f64; MOST + 1], // of the next formula in that of each order
    since_change: usize,
    last: Taken,
    pace: Pace,
    allowed: f64, // of the tolerance, to the candidate's error
    weighs: bool, // errors, by the length of their steps
    trtol: f64,
    fixed: bool,
    itl4: usize,
    next_order: usize,
    used: usize, // order of the candidate's step
    accounts: Option<Accounts>,
    starter: Option<Box<dyn Method>>, // fixed steps: supplies the first maxord - 1 points
}

/// When rounding is to be looked at again, in steps, and whether it was worth counting. With nothing but noise before it an error
/// control takes shorter steps, which have more of it, and lower orders, which look no worse.
#[derive(Default)]
struct Noise {
    due: usize,
    counts: bool,
    silent: f64,  // up to this a it is nothing to speak of
    of: Vec<f64>, // what weights of errors are larger by: 0 where it does not count; whole blocks
}

/// Noise that is so much of what an error may be counts.
const NOISY: f64 = 0.02;
/// Less than so much of that is nothing to speak of, until steps are so much shorter. Beside diodes without coils: where something rings
/// for long, one last bit makes another run.
const SILENT: f64 = 0.06;
const SHORTER: f64 = 8.0;
/// Steps for which what did not count is not looked at, and what was nothing to speak of.
const QUIET: (usize, usize) = (16, 256);

impl Noise {
    fn is_due(&self, a: f64) -> bool {
        self.counts || self.due == 0 || (self.silent > 0.0 && a > self.silent)
    }

    /// The largest noise in parts of what an error may be, with this a.
    fn found(&mut self, largest: f64, a: f64, rings: bool) {
        self.counts = largest > NOISY;
        let silent = !rings && largest < SILENT * NOISY;
        self.silent = if silent { SHORTER * a } else { 0.0 };
        self.due = if silent { QUIET.1 } else { QUIET.0 };
    }
}

/// The newest points, and their weights in the integral over the accepted step.
struct Accounts {
    points: History,
    weights: Vec<Vec<f64>>,
}

impl Gear {
    pub fn new(sys: &System, o: &Options) -> Result<Gear, Failure> {
        let fixed = o.fixed_step.is_some();
        let real = sys.exponentials() > 0 && sys.passive && !sys.has_coils() && !o.accounts;
        let highest = if real { MOST } else { HIGHEST };
        let maxord = o.maxord.unwrap_or(if fixed { 2 } else { highest }).clamp(1, MOST);
        let spice = o.maxord.is_some_and(|m| m <= 2);
        let weighs = !spice && sys.exponentials() > 0 && !sys.has_coils();
        let starter: Option<Box<dyn Method>> =
            if fixed && maxord > 1 { Some(Box::new(super::radau::Radau::new(sys, o, "radau")?)) } else { None };
        let mut newton = Newton::new(sys)?.bare();
        // beside diodes without coils straight lines end an iteration
        newton.missed = if weighs { super::trap::MISSED } else { 1.0 };
        // its first step is judged by how far it moves from there, and rows in it are on the way from there
        let plain = if spice { Character::PLAIN } else { Character::DENSE };
        Ok(Gear {
            character: Character {
                begins_with_slopes: true,
                steps_a_period: Some(IN_A_PERIOD),
                lags: Lags::unless(fixed, Lags::Forces),
                ..plain
            },
            newton,
            now: 0.0,
            times: [0.0; POINTS],
            len: 0,
            behind: Differences::new(sys.n),
            f0: vec![0.0; sys.n],
            t1: 0.0,
            stage: Stage::new(sys),
            betas: [0.0; ROWS],
            missed: vec![0.0; whole(sys.n)],
            given: sys.alone().iter().enumerate().filter_map(|(i, &alone)| alone.then_some(i)).collect(),
            noise: Noise { of: vec![0.0; whole(sys.n)], ..Noise::default() },
            order: 1,
            maxord,
            spice,
            control: if spice { SPICE } else { AHEAD },
            shares: match spice || fixed || o.accounts {
                true => [0.0; MOST + 1],
                false if real => REAL,
                false => NEXT,
            },
            since_change: 0,
            last: Taken::default(),
            pace: Pace::default(),
            allowed: 1.0,
            weighs,
            trtol: match (o.trtol.is_finite(), spice, o.accounts || (sys.has_coils() && sys.exponentials() > 0)) {
                (true, ..) => o.trtol,
                (false, true, _) => 1.0,
                (false, false, strict) => {
                    let longer = if weighs { SHORT * (FAITHFUL / o.reltol).min(1.0) } else { 1.0 };
                    let tied = if sys.sums.is_empty() || o.reltol > TIED_BELOW { 1.0 } else { TIED };
                    tied * longer * if strict { STRICT } else { LOCAL }
                }
            },
            fixed,
            itl4: o.itl4,
            next_order: 1,
            used: 1,
            accounts: o.accounts.then(|| Accounts { points: History::new(sys.n, MOST), weights: vec![Vec::new()] }),
            starter,
        })
    }

    fn past(&self) -> &[f64] {
        &self.times[..self.len]
    }

    /// Share of the next formula in that of order k, as far as there are points for it.
    fn next(&self, k: usize) -> f64 {
        if self.len > k {
            self.shares[k]
        } else {
            0.0
        }
    }

    /// Error of the formula of order k in parts of what its polynomial and one point more miss.
    fn constant(&self, k: usize, h: f64) -> f64 {
        (1.0 - TAKEN * self.next(k)) * h / (self.t1 - self.times[k])
    }

    /// Points that the polynomial reads which `missed` is counted from.
    fn predicted(&self) -> usize {
        (self.used + 1).min(self.len)
    }

    /// Attempts a step of the length h from the points behind.
    #[inline(always)]
    fn step<L: Lanes>(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        let k = if self.fixed { self.maxord } else { self.order.min(self.len) };
        self.used = k;
        self.betas = towards_by::<L>(h, &self.times, self.len);
        let (a, weights) = slope::<L>(h, &self.times, &self.betas, k, self.next(k));
        let behind = self.predicted();
        let (guess, r) = self.stage.blocks_mut();
        self.behind.foresee::<L>(&self.betas[..behind], &weights, [&mut self.missed, guess, r]);
        if self.fixed {
            self.behind.sum(&self.betas[..k.min(2)], self.stage.x_mut());
        }
        if let Err(why) = self.newton.solve_stage::<L>(sys, w, a, &mut self.stage, self.now + h, tol, self.itl4) {
            self.order = 1;
            return Attempt::Stuck { next: h / 8.0, why: why.into() };
        }
        if self.fixed {
            self.compare();
            return Attempt::Good { next: h };
        }
        if self.noise.is_due(a) {
            self.heed_noise(sys, w, a, tol);
        }
        self.noise.due -= 1;
        let [below, error, above] = self.errors::<L>(h, tol);
        let Some(error) = error else {
            let worst = self.first_error(sys, w, a, tol);
            return if worst > 1.0 {
                Attempt::TooLarge { next: h * (0.9 / worst).max(0.1) }
            } else {
                self.next_order = k;
                Attempt::Good { next: h }
            };
        };
        let share = self.constant(k, h);
        let noisy = error > 1.0 && a > self.noise.silent;
        let error = if noisy { self.above_noise(sys, w, a, share, tol) } else { error };
        if error > 1.0 {
            if below.is_some_and(|e| e < error) {
                self.order = k - 1;
            }
            return Attempt::TooLarge { next: h * self.control.shorter(error, k) };
        }
        let free = self.since_change > if self.spice { k } else { 0 };
        let others = [below, above.filter(|_| k < self.maxord)].map(|error| error.filter(|_| free));
        let (order, f) = self.control.next((k, h, error), others, &mut self.last, self.allowed < self.trtol);
        self.next_order = order;
        // a linear system keeps its factors with its step
        Attempt::Good { next: if sys.linear && !self.spice && (0.9..1.2).contains(&f) { h } else { f * h } }
    }

    /// The rounding of charges and currents, where that is not far below the tolerances.
    #[cold]
    #[inline(never)]
    fn heed_noise(&mut self, sys: &System, w: &mut Work, a: f64, tol: &Tolerances) {
        let (x1, behind, allowed) = (self.stage.x(), &self.behind, self.allowed);
        let noise = self.newton.round(sys, w, a, x1);
        let weight = |i: usize| tol.error_weight(i, x1[i], behind.newest(i));
        let share = |(i, noise): (usize, &f64)| Some(tol.share(i)? * noise / weight(i));
        let largest = noise.iter().enumerate().filter_map(share).fold(0.0, f64::max) / allowed;
        self.noise.found(largest, a, !self.weighs);
        for (of, noise) in self.noise.of.iter_mut().zip(noise) {
            *of = if self.noise.counts { noise / allowed } else { 0.0 };
        }
    }

    /// Largest lte over tolerance of the orders below, at and above that of the step; None where too few points stand behind.
    /// `missed` held what was predicted.
    #[inline(always)]
    fn errors<L: Lanes>(&mut self, h: f64, tol: &Tolerances) -> [Option<f64>; 3] {
        let (k, beta) = (self.used, &self.betas);
        if self.len < k + 1 {
            self.compare();
            return [None; 3];
        }
        let above = if self.len > k + 1 && k < MOST { k + 1 } else { k };
        let of = [(beta[k], k), (-beta[above], above)];
        let x1 = self.stage.x_blocks();
        let mut worst = self.behind.judge::<L>(&mut self.missed, x1, &self.noise.of, tol.norm(), of);
        for &(node, root) in &tol.tied {
            let weight = tol.error_weight(node, x1[node], self.behind.newest(node));
            let apart = |of: &dyn Fn(usize) -> f64| (of(node) - of(root)).abs() / weight;
            let beyond = |(factor, row): (f64, usize)| apart(&|i| self.missed[i] + factor * self.behind.phi(row, i));
            let errors = [beyond(of[0]), apart(&|i| self.missed[i]), beyond(of[1])];
            worst.iter_mut().zip(errors).for_each(|(worst, e)| *worst = worst.max(e));
        }
        let of = |k: usize, worst: f64| Some(self.constant(k, h) / self.allowed * worst);
        let below = if k > 1 { of(k - 1, worst[0]) } else { None };
        [below, of(k, worst[1]), if above > k { of(above, worst[2]) } else { None }]
    }

    /// `missed` holds what was predicted, and then what that lacks.
    fn compare(&mut self) {
        for (missed, x1) in self.missed.iter_mut().zip(self.stage.x()) {
            *missed = x1 - *missed;
        }
    }

    /// The first step after a start has no difference to judge by: its movement counts. What that would make so short that charges are
    /// rounding (a nanofarad that a switch charges by 10 V moves by its microvolt in 1e-16 s) is judged by its slopes. Of what is given
    /// no step is asked for that rounding of the time would spoil (a current that a source ramps up from 0 A would).
    fn first_error(&mut self, sys: &System, w: &mut Work, a: f64, tol: &Tolerances) -> f64 {
        let missed = self.missed.clone();
        if self.t1 < SAME * (self.now + self.t1) {
            self.given.iter().for_each(|&i| self.missed[i] = 0.0);
        }
        let x0: Vec<f64> = (0..sys.n).map(|i| self.behind.newest(i)).collect();
        let mut worst = FIRST * tol.largest_error(&self.missed, self.stage.x(), &x0) / self.allowed;
        if worst > 1.0 {
            worst = self.above_noise(sys, w, a, FIRST, tol);
        }
        if worst * ROUNDED * (self.now + self.t1) > self.t1 {
            let mut apart = vec![0.0; sys.n];
            self.newton.find_f(a, &self.stage, &mut apart);
            for (i, f) in apart.iter_mut().enumerate() {
                *f = if sys.has_q[i] { 0.5 * (self.f0[i] - *f) } else { 0.0 };
            }
            self.newton.hold(sys, w, a);
            self.newton.solve_held(w, &mut apart);
            worst = worst.min(tol.largest_error(&apart, self.stage.x(), &x0) / self.allowed);
        }
        self.missed = missed;
        worst
    }

    /// Largest of `factor` times what was missed, over the tolerance and the rounding of charges and currents.
    fn above_noise(&mut self, sys: &System, w: &mut Work, a: f64, factor: f64, tol: &Tolerances) -> f64 {
        let x0: Vec<f64> = (0..sys.n).map(|i| self.behind.newest(i)).collect();
        let points = (self.stage.x(), x0.as_slice());
        self.newton.above_noise(sys, w, a, |i| factor * self.missed[i], points, tol, self.allowed)
    }
}

by_lanes! {
    fn step<L>(gear: &mut Gear, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt { gear.step::<L>(sys, w, h, tol) }
}

/// Integral over the step from t0 to ts[0] of Lagrange's polynomials through ts, in units of the step: Gauss-Legendre's rule
/// of order 6, the polynomials are of degree 5 at most.
fn over_step(ts: &[f64], t0: f64) -> Vec<f64> {
    const GAUSS: [(f64, f64); 3] =
        [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
    let l = |j: usize, t: f64| -> f64 {
        (0..ts.len()).filter(|&k| k != j).map(|k| (t - ts[k]) / (ts[j] - ts[k])).product()
    };
    (0..ts.len()).map(|j| GAUSS.iter().map(|(c, b)| b * l(j, t0 + c * (ts[0] - t0))).sum()).collect()
}

impl Response for Gear {
    fn formula(&self) -> usize {
        self.used
    }

    fn response(&self, order: usize, y: f64) -> Option<Complex> {
        Some(response::bdf(order, self.shares[order], y))
    }

    fn drift(&self, order: usize, times: &[f64], w: f64) -> Option<(f64, f64)> {
        let next = if times.len() > order + 1 { self.shares[order] } else { 0.0 };
        response::bdf_drift(order, next, times, w)
    }
}

impl Method for Gear {
    fn character(&self) -> &Character {
        &self.character
    }

    fn restart(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        (self.now, self.times[0], self.len) = (t, 0.0, 1);
        sys.eval(w, x, t);
        self.stage.x_mut().copy_from_slice(x);
        self.newton.put_q(&w.q);
        self.behind.push(&[], [self.stage.x_blocks(), self.newton.q_blocks()]);
        self.f0.copy_from_slice(&w.f);
        if let Some(accounts) = &mut self.accounts {
            accounts.points.clear();
            accounts.points.push(t, x);
        }
        self.order = 1;
        self.next_order = 1;
        self.since_change = 0;
        self.last.order = 0;
        self.t1 = 0.0;
        self.newton.forget();
        if let Some(s) = &mut self.starter {
            s.restart(sys, w, t, x);
        }
    }

    fn attempt(&mut self, sys: &System, w: &mut Work, h: f64, tol: &Tolerances) -> Attempt {
        self.t1 = h;
        self.allowed = self.trtol / if self.weighs { self.pace.weight(h) } else { 1.0 };
        let t1 = self.now + h;
        if self.fixed && self.len < self.maxord {
            // fixed order k wants k starting points of at least its own order
            if let Some(s) = &mut self.starter {
                let attempt = s.attempt(sys, w, h, tol);
                self.used = self.maxord;
                self.betas = towards(h, &self.times, self.len);
                self.stage.x_mut().copy_from_slice(s.candidate());
                sys.eval(w, self.stage.x(), t1);
                self.newton.put_q(&w.q);
                self.behind.sum(&self.betas[..self.predicted()], &mut self.missed);
                self.compare();
                return attempt;
            }
        }
        step(self, sys, w, h, tol)
    }

    fn accept(&mut self, t1: f64) {
        let behind = self.predicted();
        let x1 = self.stage.x_blocks();
        self.behind.push(&self.betas[..behind], [x1, self.newton.q_blocks()]);
        let step = std::mem::take(&mut self.t1);
        for k in (1..self.times.len()).rev() {
            self.times[k] = self.times[k - 1] - step;
        }
        self.pace.count(step);
        self.now = t1;
        self.len = (self.len + 1).min(self.times.len());
        if let Some(accounts) = &mut self.accounts {
            accounts.points.push(t1, self.stage.x());
            let newest = &self.times[..self.len.min(self.used)];
            accounts.weights[0] = over_step(newest, self.times[1]);
        }
        if self.next_order == self.order {
            self.since_change += 1;
        } else {
            self.order = self.next_order;
            self.since_change = 0;
        }
        if let Some(s) = &mut self.starter {
            if self.len <= self.maxord {
                s.accept(t1);
            }
        }
    }

    /// What the polynomial lacks in the middle of the step, by one point more. The error estimate sees nothing of algebraic
    /// unknowns, which may have corners.
    fn interior(&mut self, sys: &System, tol: &Tolerances) -> f64 {
        let m = self.used + 1;
        let Some(past) = self.past().get(..m) else { return f64::INFINITY };
        let t = 0.5 * (self.t1 + past[0]);
        let there: f64 = (t - self.t1) * past[..m - 1].iter().map(|tj| t - tj).product::<f64>();
        let share = there / past.iter().map(|tj| self.t1 - tj).product::<f64>();
        let (x1, missed) = (self.stage.x(), &self.missed);
        let weight = |i: usize| tol.weight(i, x1[i], self.behind.newest(i));
        let worst = sys.interpolated().map(|i| missed[i].abs() / weight(i)).fold(0.0, f64::max);
        share.abs() * worst
    }

    fn stages(&self) -> Stages<'_> {
        let Some(Accounts { points, weights }) = &self.accounts else { return Stages::default() };
        let at = points.t.iter().zip(&points.x).take(weights[0].len());
        Stages { at: at.map(|(&t, x)| (t, x.as_slice())).collect(), weights }
    }

    fn candidate(&self) -> &[f64] {
        self.stage.x()
    }

    fn dense(&self, t: f64, out: &mut [f64]) {
        let t = t - self.now;
        let betas = towards(t, &self.times, self.len);
        self.behind.sum(&betas[..self.predicted()], out);
        if self.t1 == 0.0 {
            return;
        }
        // the candidate is a point as well
        let behind = &self.past()[..self.used.min(self.len)];
        let share: f64 = behind.iter().map(|tj| (t - tj) / (self.t1 - tj)).product();
        for (x, missed) in out.iter_mut().zip(&self.missed) {
            *x += share * missed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST, NEXT, REAL};
    use crate::sparse::{Complex, Scalar};

    /// sum_m (1 - z)^m / m, m to k, and a share of the term after it, is h lambda where a mode keeps its size from step to step as z
    /// goes round the unit circle: nowhere on the negative real axis. (At lambda of minus infinity all of it is gone in k + 1 steps.)
    #[test]
    fn real_modes_are_stable() {
        for shares in [NEXT, REAL] {
            for k in 1..=MOST {
                let next = if k < MOST { shares[k] } else { 0.0 };
                let locus = |angle: f64| {
                    let (u, mut power, mut sum) =
                        (Complex::ONE - Complex::new(angle.cos(), -angle.sin()), Complex::ONE, Complex::ZERO);
                    for m in 1..=k + 1 {
                        power *= u;
                        sum += power.scale(if m > k { next } else { 1.0 } / m as f64);
                    }
                    sum
                };
                let n = 20_000_u32;
                let at: Vec<Complex> =
                    (1..=n).map(|j| locus(std::f64::consts::PI * f64::from(j) / f64::from(n))).collect();
                assert!(at.last().is_some_and(|end| end.re > 0.0));
                let crossings = at.windows(2).filter(|w| w[0].im * w[1].im <= 0.0);
                assert!(crossings.into_iter().all(|w| w[0].re > 0.0 && w[1].re > 0.0), "order {k}");
            }
        }
    }
}
