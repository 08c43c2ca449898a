//! Multirate: the circuit at its own small steps, the machine at its own large ones.
//!
//! A switching converter forces a few steps a period on whatever is solved with it. Here the equations are shared out
//! (system/split.rs) and a macro step of length H goes
//!
//!   1. the circuit from t to t + H by an ESDIRK, with its own steps, edges and events. What it reads of the machine is
//!      z(t) = g(t) + A I(t),   I = integral y dt
//!      y being what the machine reads of the circuit (a current for a torque), A the change of the speeds by a unit
//!      impulse of y, the machine's inertia (response.rs), and g the rest, the smooth part: that of the last macro step,
//!      continued. Ripple in a speed is thus seen by the circuit at once.
//!   2. the machine over the same H in one step of Radau IIA; what it reads of the circuit is the projection P y of that
//!      y(t) on polynomials of degree `MOMENTS` - 1 (window.rs). With its z~(t):  g = z~ - A integral P y dt
//!   3. this g against the one the circuit was given: where they differ by more than a share of the tolerance the circuit
//!      goes again with the new one, and then the machine
//!
//! Forces are affine in y (split.rs sees to that), so a speed at t + H feels of y - P y only
//!   integral (Phi - P Phi)(y - P y) dt = O(H^(MOMENTS + 1)) |y - P y|,
//! Phi being the machine's smooth response: ripple at the switching frequency has next to no effect that way, and impulses
//! agree exactly. Inside the step it moves the machine by A integral (y - P y) dt, which is in what is recorded too.
//! That is the answer of masses alone; how springs and dampers answer, and how coordinates follow, is added to what is
//! recorded, A' times the integral of that integral, and A moves from its value at the start of the macro step to that at
//! its end. The circuit does not see this, nor need it: ripple of its ripple. What is no state, accelerations and reactions, feels
//! y itself, and is computed anew from the states of both in every row that shows it (rows.rs).
//!
//! The coupling is a dynamic iteration (Arnold and Guenther, BIT 41, 2001): it contracts with H, since both ways go
//! through an integral, the winding's and the masses', the latter twice as A is taken out. So the machine's error bounds H
//! and the iteration seldom does; where it does not contract, the macro step is shortened. Compare Gear and Wells, Multirate linear multistep methods,
//! BIT 24, 1984: this is their "fastest first".
//!
//! A macro step shorter than a few periods sees the ripple instead of its mean, and its error estimate keeps it short. So
//! after some short ones a long one is tried, of `LEAP` steps of the circuit.
mod response;
mod window;

use self::response::Response;
use self::window::Window;
use super::driver::{self, Failed, Outcome, Run, Status, Tick, Transient, IMPOSED};
use super::rows::{Forces, Sink};
use super::{make, Attempt, Method};
use crate::ledger::{Inside, Stages};
use crate::newton::{Failure, Newton, Options, Tolerances};
use crate::op;
use crate::record::Record;
use crate::system::{ExchangedInputs, Kind, Part, Parts, Polynomial, System, Work, DEGREE};

const FAST: &str = "esdirk";
const SLOW: &str = "radau";
/// Share of the tolerance by which the machine may differ from what the circuit was given.
const AGREE: f64 = 0.1;
/// So often the circuit goes again in one macro step.
const PASSES: u32 = 4;
/// Each pass must bring the two nearer by this.
const CONTRACTS: f64 = 0.3;
/// A macro step of fewer steps of the circuit is short; so many are tried after some short ones.
const FEW: f64 = 16.0;
const LEAP: f64 = 64.0;
const NODES: usize = DEGREE + 1;
/// Degrees of the polynomial by which the machine is predicted.
const FORESEEN: usize = 4;
const GIVES_UP: u32 = 60;
/// Speeds of a machine, and edges and corners in a run, from which on it pays.
const LARGE: usize = 10;
const OFTEN: usize = 400;

/// Does it pay to give circuit and machine a pace each?  Where a machine of some size stands behind edges that come far
/// more often than it needs steps of its own, by the map that tests/bench/multirate.py draws. A guess from the deck alone:
/// whether the two can be taken apart is seen when it is tried.
pub fn pays(sys: &System, tstop: f64) -> bool {
    let speeds = sys.unknowns.iter().filter(|u| u.kind == Kind::Speed).count();
    let circuit = sys.unknowns.iter().any(|u| !u.kind.mechanical());
    if speeds < LARGE || !circuit {
        return false;
    }
    let (mut w, mut t) = (sys.work(), 0.0);
    for _ in 0..OFTEN {
        sys.flip_edges(&mut w, t, false, |_, _| {});
        t = sys.next_stop(&mut w, t, tstop);
        if t >= tstop {
            return false;
        }
    }
    true
}

pub fn run(sys: &System, w: &mut Work, a: Transient, o: &Options, record: &mut Record, tick: &mut Tick) -> Outcome {
    if sys.has_laws() {
        let why = "friction and rigid stops have modes, which multirate does not decide".to_string();
        return Outcome::failed(Failed::at_start("transient", Failure::Unfit { why }, vec![]));
    }
    let parts = match sys.parts() {
        Ok(parts) => parts,
        Err(why) => {
            let why = format!("circuit and machine cannot be taken apart: {why}");
            return Outcome::failed(Failed::at_start("transient", Failure::Unfit { why }, vec![]));
        }
    };
    let x = match driver::starting_point(sys, w, a, o) {
        Ok(x) => x,
        Err(failed) => return Outcome::failed(*failed),
    };
    let (fit, seen) = (inverse_vandermonde(&nodes()), Seen::default());
    let (forces, tol) = (Forces::new(sys, record.reads()), Tolerances::new(sys, o));
    Multirate { sys, parts, w, a, o, record, x, forces, tol, shown: 0.0, fit, nodes: nodes(), degree: 1, seen }
        .run(tick)
        .unwrap_or_else(|why| Outcome::failed(Failed::at_start("transient", why, vec![])))
}

/// Everything between two macro steps but the circuit's run and the machine's.
struct Multirate<'a> {
    sys: &'a System,
    parts: &'a Parts,
    w: &'a mut Work,
    a: Transient,
    o: &'a Options,
    record: &'a mut Record,
    x: Vec<f64>,
    forces: Option<Forces>, // of rows
    tol: Tolerances,        // of circuit and machine together
    shown: f64,             // time of the last row
    fit: [[f64; NODES]; NODES],
    nodes: [f64; NODES],
    degree: usize, // by which the machine is predicted
    seen: Seen,
}

/// The last macro step as the other side saw it.
#[derive(Clone, Default)]
struct Seen {
    centre: f64,
    half: f64,
    z: Vec<Polynomial>, // z~, of each input of the circuit
    r: Vec<Polynomial>, // integral of P y, of each input of the machine
}

/// The machine at its place.
struct Slow<'a> {
    part: &'a Part,
    w: Work,
    method: Box<dyn Method + 'a>,
    tol: Tolerances,
    z: Vec<f64>,
    curves: Vec<[f64; NODES]>, // its polynomials on the macro step, all unknowns
    scratch: Vec<f64>,
}

/// What came of one macro step's iteration.
enum Macro {
    Taken { next: f64 },
    Again { next: f64 },
    Stuck { next: f64, why: Failure },
    Ended, // the circuit did
}

impl<'a> Multirate<'a> {
    fn run(mut self, tick: &mut Tick) -> Result<Outcome, Failure> {
        let (parts, a, o) = (self.parts, self.a, self.o);
        let (fast, slow) = (&parts.fast, &parts.slow);
        let first = self.sys.waves.len();
        let exchanged =
            |n: usize| ExchangedInputs { first, centre: 0.0, half: 1.0, values: vec![Polynomial::default(); n] };

        // values that fit each other, multipliers too
        let feature = self.sys.shortest_feature().min(a.tstep);
        self.tol.observe(&self.x, 0.0);
        let (newton, at) = (&mut Newton::new(self.sys)?, (0.0, 1e-5 * feature));
        op::consistent(self.sys, newton, self.w, &mut self.x, None, at, &self.tol, true);
        self.sys.update_flags(self.w, &self.x, 0.0);
        let pick = |x: &[f64], of: &[usize]| of.iter().map(|&i| x[i]).collect::<Vec<f64>>();
        let (mut y, z) = (pick(&self.x, &fast.of), pick(&self.x, &slow.of));
        y.resize(fast.system.n, 0.0); // integrals begin with nothing

        // the machine
        let slow_o = Options { method: SLOW.into(), fixed_step: None, ..o.clone() };
        let mut newton = Newton::new(&slow.system)?;
        let response = || Response::new(&slow.system, slow.reads.len());
        let (mut response, mut ahead) = (response()?, response()?);
        let mut s = Slow {
            part: slow,
            w: slow.system.work(),
            method: make(&slow.system, &slow_o, &slow_o.method)?,
            tol: Tolerances::new(&slow.system, &slow_o),
            curves: vec![[0.0; NODES]; slow.system.n],
            scratch: vec![0.0; slow.system.n],
            z,
        };
        s.tol.observe(&s.z, 0.0);
        s.w.exchanged = exchanged(slow.reads.len());
        for (p, &i) in s.w.exchanged.values.iter_mut().zip(&slow.reads) {
            p.0[0] = y[i];
        }
        s.method.restart(&slow.system, &mut s.w, 0.0, &s.z);

        // the circuit
        let fast_o = Options { method: FAST.into(), ..o.clone() };
        let mut fw = fast.system.work();
        fw.gmin = o.gmin;
        fw.restore_flags(&self.w.held());
        fw.ports.copy_from_slice(&self.w.ports);
        let constant = |v: f64| Polynomial(std::array::from_fn(|k| if k == 0 { v } else { 0.0 }));
        let z = fast.reads.iter().map(|&i| constant(s.z[i])).collect();
        self.seen = Seen { centre: 0.0, half: 1.0, z, r: vec![constant(0.0); slow.reads.len()] };
        response.at(&slow.system, &mut s.w, &s.z, 0.0);
        let mut known = self.smooth(&self.seen, &response);
        fw.exchanged = known.clone();
        let mut fm = make(&fast.system, &fast_o, &fast_o.method)?;
        let mut window = Window::new(fast.system.n, &slow.reads, self.record.ledger.is_some());
        window.begin(0.0, feature);
        let mut circuit = Run::new(&fast.system, &mut fw, a, &fast_o, &mut window, y, fm.character())?;
        circuit.start(fm.as_mut());
        circuit.record.hold();

        let mut outcome = Outcome::default();
        let longest = a.tmax.unwrap_or(((a.tstop - a.tstart) / 50.0).max(a.tstop / IMPOSED));
        let ahead_of_time = slow.system.time_only.ahead(&slow.system.waves, a.tstop);
        let mut pace = Pace { h: (1e-4 * a.tstop).min(longest), ..Pace::default() };
        let (mut t, mut failures) = (0.0_f64, 0u32);
        while t < a.tstop {
            // how far may the machine go
            let corner = slow.system.next_stop(&mut s.w, t, a.tstop);
            let mut h = pace.length().min(longest);
            if let Some(ahead) = &ahead_of_time {
                h = h.min(ahead.limit(t));
            }
            let lands = t + h >= corner - 1e-9 * h;
            if lands {
                h = corner - t;
            } else if t + 2.0 * h > corner {
                h = 0.5 * (corner - t);
            }
            let end = if lands { corner } else { t + h };
            let mark = circuit.mark();
            let given = self.extrapolate(&known, t, end);
            let steps = circuit.w.counters.steps;
            let done = self.iterate(&mut circuit, fm.as_mut(), &mark, &mut s, &response, given, (t, end), tick);
            let next = match done {
                Macro::Taken { next } => next,
                Macro::Again { next } | Macro::Stuck { next, .. } => {
                    if let Macro::Stuck { why, .. } = done {
                        failures += 1;
                        if failures > GIVES_UP {
                            let tried = vec![format!("shortening the machine's step {failures} times")];
                            let failed = Failed { t, h, during: "transient", why: why.renumbered(&slow.of), tried };
                            (outcome.status, outcome.failed) = (Status::Failed, Some(failed));
                            break;
                        }
                    }
                    pace.refused(next);
                    circuit.rewind(&mark, fm.as_mut());
                    continue;
                }
                Macro::Ended => break,
            };
            // both stand at the end
            failures = 0;
            self.learn(&known, &s, &response);
            s.method.accept(end);
            s.w.counters.steps += 1;
            s.z.copy_from_slice(s.method.candidate());
            s.tol.observe(&s.z, end);
            ahead.at(&slow.system, &mut s.w, &s.z, end);
            let micro = (end - t) / (circuit.w.counters.steps - steps).max(1) as f64;
            self.flush(circuit.record, &s.curves, &response, &ahead, micro);
            circuit.record.clear();
            std::mem::swap(&mut response, &mut ahead);
            pace.accepted(next, end - t, circuit.w.counters.steps - steps);
            t = end;
            if lands && t < a.tstop {
                if slow.system.jumps_at(t) {
                    op::consistent(&slow.system, &mut newton, &mut s.w, &mut s.z, None, (t, 1e-9 * h), &s.tol, false);
                    response.at(&slow.system, &mut s.w, &s.z, t);
                }
                s.method.restart(&slow.system, &mut s.w, t, &s.z);
                pace.h *= 0.3;
            }
            known = self.smooth(&self.seen, &response);
        }
        let circuit = std::mem::take(&mut circuit.outcome);
        if circuit.status != Status::Ok {
            outcome.status = circuit.status;
            outcome.failed = circuit.failed.map(|f| Failed { why: f.why.renumbered(&fast.of), ..f });
        }
        (outcome.events, outcome.resting, outcome.broken) = (circuit.events, circuit.resting, circuit.broken);
        self.record.close(self.sys, self.w);
        self.w.counters.add(&fw.counters);
        self.w.counters.add(&s.w.counters);
        Ok(outcome)
    }

    /// Circuit and machine over (t, end) in turn, until they agree.
    fn iterate(
        &mut self,
        circuit: &mut Run<Window>,
        fm: &mut dyn Method,
        mark: &driver::Mark,
        s: &mut Slow,
        response: &Response,
        mut given: ExchangedInputs,
        (t, end): (f64, f64),
        tick: &mut Tick,
    ) -> Macro {
        let h = end - t;
        let fast = &self.parts.fast;
        let before: Vec<f64> =
            (0..s.part.reads.len()).map(|j| circuit.x.get(fast.integrals + j).copied().unwrap_or(0.0)).collect();
        let mut allowed = f64::INFINITY;
        for pass in 0..=PASSES {
            // the circuit, with what it is given of the machine
            if pass > 0 {
                circuit.rewind(mark, fm);
            }
            circuit.record.begin(t, end);
            circuit.w.exchanged = given.clone();
            fast.system.touch_sources(circuit.w);
            fm.corner();
            circuit.go_on(fm, end, tick);
            if circuit.outcome.status != Status::Ok {
                return Macro::Ended;
            }
            // the machine, with the circuit's moments
            circuit.record.moments(&mut s.w.exchanged);
            s.part.system.touch_sources(&mut s.w);
            s.method.corner();
            let machine = match s.method.attempt(&s.part.system, &mut s.w, h, &s.tol) {
                Attempt::Good { next } => next,
                Attempt::TooLarge { next } => {
                    s.w.counters.rejected += 1;
                    return Macro::Again { next: next.min(0.9 * h) };
                }
                Attempt::Stuck { next, why } => {
                    s.w.counters.newton_failures += 1;
                    return Macro::Stuck { next: next.min(0.5 * h), why: *why };
                }
            };
            self.trace(s, t, end);
            let z = fast.reads.iter().map(|&i| Polynomial(s.curves[i])).collect();
            let integral = |j: usize| {
                let (mut r, _) = circuit.record.projected(j);
                r.0[0] += before[j];
                r
            };
            let r = (0..s.part.reads.len()).map(integral).collect();
            self.seen = Seen { centre: given.centre, half: given.half, z, r };
            let new = self.smooth(&self.seen, response);
            let gap = self.gap(&given, &new, s);
            if gap <= 1.0 {
                let grow = match pass {
                    0 => 2.5,
                    1 => (0.3 / gap.max(1e-3)).powf(0.3).clamp(0.7, 2.0),
                    _ => 0.6,
                };
                return Macro::Taken { next: machine.min(grow * h) };
            }
            if gap > allowed {
                break;
            }
            allowed = CONTRACTS * gap.min(allowed);
            given = new;
        }
        s.w.counters.rejected += 1;
        Macro::Again { next: 0.3 * h }
    }

    /// The machine's polynomials on the macro step.
    fn trace(&self, s: &mut Slow, t: f64, end: f64) {
        let (centre, half) = (0.5 * (t + end), 0.5 * (end - t));
        for (k, node) in self.nodes.iter().enumerate() {
            if k == NODES - 1 {
                s.scratch.copy_from_slice(s.method.candidate());
            } else {
                s.method.dense(centre + node * half, &mut s.scratch);
            }
            for (c, v) in s.curves.iter_mut().zip(&s.scratch) {
                c[k] = *v;
            }
        }
        for c in &mut s.curves {
            *c = self.fitted(c);
        }
    }

    /// Coefficients of powers from values at the nodes.
    fn fitted(&self, values: &[f64; NODES]) -> [f64; NODES] {
        std::array::from_fn(|k| self.fit[k].iter().zip(values).map(|(f, v)| f * v).sum())
    }

    /// g = z~ - A r, and behind it A.
    fn smooth(&self, seen: &Seen, response: &Response) -> ExchangedInputs {
        let fast = &self.parts.fast;
        let mut values = seen.z.clone();
        for &(k, j) in &fast.moves {
            let a = response.between(fast.reads[k], j);
            for (v, r) in values[k].0.iter_mut().zip(&seen.r[j].0) {
                *v -= a * r;
            }
            let mut constant = Polynomial::default();
            constant.0[0] = a;
            values.push(constant);
        }
        ExchangedInputs { first: self.sys.waves.len(), centre: seen.centre, half: seen.half, values }
    }

    /// The last step's polynomials, continued over the next step.
    fn extrapolate(&self, last: &ExchangedInputs, t: f64, end: f64) -> ExchangedInputs {
        let mut given = ExchangedInputs { centre: 0.5 * (t + end), half: 0.5 * (end - t), ..last.clone() };
        let (centre, half) = (given.centre, given.half);
        for (new, p) in given.values.iter_mut().zip(&last.values).take(self.parts.fast.reads.len()) {
            let at = |k: usize| last.place(centre + self.nodes[k] * half);
            new.0 = self.fitted(&std::array::from_fn(|k| continued(p, at(k), self.degree)));
        }
        given
    }

    /// Which degree would have predicted this step best?
    fn learn(&mut self, last: &ExchangedInputs, s: &Slow, response: &Response) {
        let end = last.place(self.seen.centre + self.seen.half);
        let new = self.smooth(&self.seen, response);
        let miss = |degree: usize| {
            let misses = self.parts.fast.reads.iter().enumerate().map(|(k, &i)| {
                let miss = continued(&last.values[k], end, degree) - new.values[k].at(1.0);
                let z = self.seen.z[k].at(1.0);
                miss.abs() / s.tol.weight(i, z, z)
            });
            misses.fold(0.0, f64::max)
        };
        let misses: [f64; FORESEEN + 1] = std::array::from_fn(miss);
        let best = (0..=FORESEEN).min_by(|&i, &j| misses[i].total_cmp(&misses[j]));
        self.degree = best.unwrap_or(1);
    }

    /// How far what the circuit was given is from what came of it, in units of what is allowed.
    fn gap(&self, given: &ExchangedInputs, new: &ExchangedInputs, s: &Slow) -> f64 {
        let mut worst = 0.0_f64;
        for (k, &i) in self.parts.fast.reads.iter().enumerate() {
            for &node in &self.nodes {
                let (off, z) = (new.values[k].at(node) - given.values[k].at(node), self.seen.z[k].at(node));
                let gap = off.abs() / (AGREE * s.tol.weight(i, z, z));
                worst = if gap.is_finite() { worst.max(gap) } else { f64::INFINITY };
            }
        }
        worst
    }

    /// Rows and accounts of the macro step, circuit and machine together; `micro`: how long the circuit's steps were.
    fn flush(&mut self, window: &Window, curves: &[[f64; NODES]], response: &Response, ahead: &Response, micro: f64) {
        let (fast, slow) = (&self.parts.fast, &self.parts.slow);
        let projected: Vec<_> = (0..slow.reads.len()).map(|j| window.projected(j)).collect();
        let fill = |x: &mut [f64], t: f64, y: &[f64], integrals: &[f64]| {
            for (&i, v) in fast.of.iter().zip(y) {
                x[i] = *v;
            }
            let s = window.place(t);
            for (&i, c) in slow.of.iter().zip(curves) {
                x[i] = Polynomial(*c).at(s);
            }
            // ripple: what the projection has left out so far
            for (j, (both, (once, twice))) in integrals.chunks_exact(2).zip(&projected).enumerate() {
                let ripple = [both[0] - once.at(s), both[1] - twice.at(s)];
                response.add(ahead, 0.5 * (s + 1.0), j, ripple, &slow.of, x);
            }
        };
        for item in &window.items {
            self.w.flags.copy_from_slice(window.flags(item));
            let (y, integrals) = window.state(item);
            fill(&mut self.x, item.t, y, integrals);
            match item.kind {
                window::Kind::Row => {
                    if self.forces.is_some() {
                        // of two rows at a corner the first has what comes before it
                        self.sys.next_stop(self.w, self.shown, self.a.tstop);
                        self.shown = item.t;
                    }
                    self.tol.observe(&self.x, item.t);
                    if let Some(forces) = &mut self.forces {
                        let h = Forces::inside(micro, self.a.tstop);
                        forces.settle(self.sys, self.w, (item.t, &mut self.x), h, &self.tol);
                    }
                    // the circuit's own come from its steps
                    for (&i, v) in fast.of.iter().zip(y) {
                        self.x[i] = *v;
                    }
                    self.record.row(self.sys, self.w, item.t, &self.x);
                }
                window::Kind::Open => self.record.open(self.sys, self.w, item.t, &self.x),
                window::Kind::Jump => self.record.jump(self.sys, self.w, item.t, &self.x),
                window::Kind::Step => {
                    let dense = |t: f64, out: &mut [f64]| {
                        let (y, integrals) = window.inside(item, t);
                        fill(out, t, y, integrals);
                    };
                    let inside = Inside { dense: &dense, parts: 1, stages: &Stages::default };
                    self.record.step(self.sys, self.w, item.t, &self.x, &inside);
                }
            }
        }
    }
}

/// Lengths of macro steps.
#[derive(Default)]
struct Pace {
    h: f64,
    micro: f64,         // mean step of the circuit
    trial: Option<f64>, // a long step is being tried; the length if it fails
    short: u32,         // short steps since the last trial
    failed: u32,        // trials
}

impl Pace {
    fn length(&mut self) -> f64 {
        if self.trial.is_none() && self.micro > 0.0 && self.h < FEW * self.micro {
            self.short += 1;
            if self.short > 4 << self.failed.min(8) {
                self.short = 0;
                self.trial = Some(self.h);
                self.h = LEAP * self.micro;
            }
        }
        self.h
    }

    fn refused(&mut self, next: f64) {
        self.h = next;
        if let Some(before) = self.trial.take() {
            self.h = before;
            self.failed += 1;
        }
    }

    fn accepted(&mut self, next: f64, h: f64, steps: u64) {
        self.h = next;
        let micro = h / steps.max(1) as f64;
        self.micro = if self.micro > 0.0 { 0.8 * self.micro + 0.2 * micro } else { micro };
        if self.trial.take().is_some() {
            self.failed = 0;
        }
    }
}

/// The polynomial of so low a degree that meets `p` at points spread over its step, at s.
fn continued(p: &Polynomial, s: f64, degree: usize) -> f64 {
    let node = |k: usize| if degree == 0 { 1.0 } else { -(std::f64::consts::PI * k as f64 / degree as f64).cos() };
    (0..=degree)
        .map(|j| {
            let others = (0..=degree).filter(|&k| k != j);
            p.at(node(j)) * others.map(|k| (s - node(k)) / (node(j) - node(k))).product::<f64>()
        })
        .sum()
}

fn nodes() -> [f64; NODES] {
    std::array::from_fn(|k| -(std::f64::consts::PI * k as f64 / DEGREE as f64).cos())
}

/// Rows that turn values at the nodes into coefficients of powers, by elimination.
fn inverse_vandermonde(nodes: &[f64; NODES]) -> [[f64; NODES]; NODES] {
    let mut a = [[0.0; 2 * NODES]; NODES];
    for (k, (row, s)) in a.iter_mut().zip(nodes).enumerate() {
        let mut power = 1.0;
        for v in row.iter_mut().take(NODES) {
            *v = power;
            power *= s;
        }
        row[NODES + k] = 1.0;
    }
    for c in 0..NODES {
        let best = (c..NODES).max_by(|&i, &j| a[i][c].abs().total_cmp(&a[j][c].abs())).unwrap_or(c);
        a.swap(c, best);
        let pivot = a[c];
        for (r, row) in a.iter_mut().enumerate() {
            let factor = row[c] / pivot[c];
            for (v, p) in row.iter_mut().zip(&pivot) {
                *v = if r == c { *p / pivot[c] } else { *v - factor * p };
            }
        }
    }
    std::array::from_fn(|r| std::array::from_fn(|c| a[r][NODES + c]))
}
