//! The equations as an explicit ODE  dy/dt = f(y, t):  what a stage of an explicit method evaluates, and nothing else.
//!
//! The state y is Q of the differential rows: charges, fluxes, coordinates, momenta. `plan` brings everything that a stage must
//! solve for into blocks, each after those it reads; the expressions of all blocks are one tape in parts:
//!
//!   Direct    momenta give speeds, M(q) u = p, in symbols (`eliminate`): trees and small mechanisms
//!   Linear    A x_b = -r        A known by now, M(q) u = p too; factored anew, or once where it is constant
//!   Saddle    accelerations and multipliers of closed loops (`saddle`)
//!   Newton    what is not linear, devices by the expressions of their laws
//!
//! Blocks that only somebody who looks at a point wants (currents of sources, reactions, d/dt of something) come after the
//! rates and are run by `unknowns` alone.
mod blocks;
pub mod dense;
mod eliminate;
mod fastest;
mod order;
mod plan;
mod quick;
mod rows;
mod saddle;
mod whole;

use crate::rounding::ROUNDED;
pub use dense::Columns;
pub use order::{augment, strong_components};
pub use plan::{Layout, Source};
use quick::Quick;
use saddle::Saddle;
pub use saddle::NEAR;

use crate::devices::Class;
use crate::graph::{Graph, Id};
use crate::tape::{Inputs, Tape};
use crate::waves::Wave;
use dense::{backward_symmetric, factor_general, factor_symmetric, forward_symmetric, solve_general};
use std::sync::Arc;
use whole::{Slots, Whole};

/// What a stage could not solve.
#[derive(Clone, Copy, Debug)]
pub enum Trouble {
    Singular { unknown: usize },
    Diverged { unknown: usize },
    NotFinite { unknown: usize },
}

/// A dense block of equations: rows in the order of `states`, columns in that of `unknowns` (numbers of leaves).
pub struct Block {
    part: usize,
    unknowns: Vec<usize>,
    states: Vec<Option<usize>>, // y_s stands in the row
    base: Vec<f64>,             // constant entries
    varying: Vec<(usize, Id)>,  // places of the others
    symmetric: bool,
    constant: Option<(Vec<f64>, Vec<usize>)>, // factored once for all; empty where that failed
}

/// Outputs: the unknowns, then 1/pivot of each.
pub struct Direct {
    part: usize,
    unknowns: Vec<usize>,
    momenta: Tape, // p(q, u) - y
    changes: Vec<Id>,
    changes_part: usize, // of the unknowns for changes of the states
}

/// Devices whose voltages an iteration moves: class and number there. `part` has all their port voltages.
pub struct Limits {
    part: usize,
    list: Vec<(usize, usize)>,
}

/// Parts: block.part (what does not move), limits.part, and the one after it (residuals and slopes).
pub struct Newton {
    block: Block,
    limits: Limits,
}

enum Step {
    Direct(Box<Direct>),
    Linear(Block),
    Newton(Newton),
    Saddle(Box<Saddle>),
}

pub struct Reduced {
    at: Layout,
    waves: usize,
    wave_rates: bool,
    tape: Tape,
    /// the row of the system behind each state
    pub states: Vec<usize>,
    /// rows in whose place the sum of the rows of a floating group stands, whose charges cancel
    pub sums: Vec<(usize, Vec<usize>)>,
    steps: Vec<Step>,
    stage_steps: usize,
    f_part: usize,
    whole: Option<Whole>,
    x_part: usize,
    direct: Vec<(usize, usize, f64)>, // unknown, state, d unknown / d state
    classes: Vec<Arc<dyn Class>>,
}

/// Scratch of a block.
#[derive(Default)]
struct Held {
    matrix: Vec<f64>,
    factored: Vec<f64>, // varying entries whose factors these are
    inverse: Vec<f64>,
    order: Vec<usize>,
    rhs: Vec<f64>,
    scratch: Vec<f64>,
    pull: Vec<f64>, // W, m x k
    columns: Option<Columns>,
    lambda: Vec<f64>,
    slots: Vec<f64>, // of the gaps
    quick: (Vec<f64>, Vec<f64>),
    stale: bool, // the factors are those of an earlier stage
}

/// Where a stage is, and its scratch.
pub struct Point {
    v: Vec<f64>, // leaves
    slots: Vec<f64>,
    whole: Slots,
    pub waves: Vec<f64>,
    pub flags: Vec<f64>,
    time: f64,
    side: bool,
    checked: bool, // the masses, since the start
    held: Vec<Held>,
    ports: [Vec<f64>; 2], // port voltages before a step of Newton's method and behind it
    open: Vec<f64>,       // a state before its loops are closed
    pub floor: Vec<f64>,  // absolute tolerance of each unknown, for Newton's method
    pub evaluations: u64,
}

impl Block {
    fn new(
        g: &Graph,
        part: usize,
        unknowns: Vec<usize>,
        states: Vec<Option<usize>>,
        matrix: &[Id],
        symmetric: bool,
    ) -> Block {
        let n = unknowns.len();
        let mut base = vec![0.0; n * n];
        let mut varying = Vec::new();
        for (k, &id) in matrix.iter().enumerate() {
            if symmetric && k % n < k / n {
                continue;
            }
            match g.value(id) {
                Some(v) => base[k] = v,
                None => varying.push((k, id)),
            }
        }
        let mut block = Block { part, unknowns, states, base, varying, symmetric, constant: None };
        if block.varying.is_empty() {
            let mut held = Held::of(&block);
            held.matrix.copy_from_slice(&block.base);
            let good = block.factor(&mut held).is_ok();
            let keep = if block.symmetric { (held.matrix, vec![]) } else { (held.matrix, held.order) };
            block.constant = Some(if good { keep } else { (vec![], vec![]) });
        }
        block
    }

    fn hopeless(&self) -> bool {
        self.constant.as_ref().is_some_and(|c| c.0.is_empty())
    }

    fn factor(&self, held: &mut Held) -> Result<(), Trouble> {
        let n = self.unknowns.len();
        let result = if self.symmetric {
            factor_symmetric(&mut held.matrix, n, &mut held.inverse)
        } else {
            factor_general(&mut held.matrix, n, &mut held.order, &mut held.scratch)
        };
        result.map_err(|k| Trouble::Singular { unknown: self.unknowns[k] })
    }

    /// The matrix from constants and from `slots` at the varying outputs; factored, where an entry is another than it was (between
    /// the edges of a switch none is).
    #[inline]
    fn refactor(&self, outputs: &[u32], slots: &[f64], held: &mut Held) -> Result<(), Trouble> {
        if self.constant.is_some() {
            return Ok(());
        }
        let mut same = true;
        for (known, &slot) in held.factored.iter_mut().zip(outputs) {
            let value = slots[slot as usize];
            same &= *known == value;
            *known = value;
        }
        if same {
            return Ok(());
        }
        held.matrix.copy_from_slice(&self.base);
        for (&(place, _), &value) in self.varying.iter().zip(&held.factored) {
            held.matrix[place] = value;
        }
        self.factor(held).inspect_err(|_| held.factored.fill(f64::NAN))
    }

    /// held.rhs <- -A^-1 b, of b and the matrix's varying entries in `slots`.
    #[inline]
    fn solve_anew(&self, outputs: &[u32], slots: &[f64], held: &mut Held) -> Result<(), Trouble> {
        self.refactor(&outputs[self.unknowns.len()..], slots, held)?;
        for (b, &slot) in held.rhs.iter_mut().zip(outputs) {
            *b = -slots[slot as usize];
        }
        self.solve(held);
        Ok(())
    }

    /// held.rhs <- A^-1 held.rhs
    #[inline]
    fn solve(&self, held: &mut Held) {
        let n = self.unknowns.len();
        if self.symmetric {
            forward_symmetric(&held.matrix, n, &held.inverse, &mut held.rhs);
            backward_symmetric(&held.matrix, n, &held.inverse, &mut held.rhs);
        } else {
            solve_general(&held.matrix, n, &held.order, &mut held.rhs, &mut held.scratch);
        }
    }
}

impl Held {
    fn of(block: &Block) -> Held {
        let n = block.unknowns.len();
        let mut held = Held {
            matrix: vec![0.0; n * n],
            factored: vec![f64::NAN; block.varying.len()],
            inverse: vec![0.0; n],
            order: vec![0; n],
            rhs: vec![0.0; n],
            scratch: vec![0.0; n],
            ..Held::default()
        };
        if let Some((matrix, order)) = block.constant.as_ref().filter(|c| !c.0.is_empty()) {
            held.matrix.clone_from(matrix);
            if block.symmetric {
                for (k, r) in held.inverse.iter_mut().enumerate() {
                    *r = 1.0 / matrix[k * n + k];
                }
            } else {
                held.order.clone_from(order);
            }
        }
        held
    }
}

impl Reduced {
    /// Err: why these equations are no explicit ODE, in the words of the deck.
    pub fn compile(g: &mut Graph, source: &Source) -> Result<Reduced, String> {
        plan::compile(g, source)
    }

    pub fn operations(&self) -> usize {
        self.tape.len()
    }

    /// Unknowns of the largest block that a stage solves.
    pub fn largest_block(&self) -> usize {
        let of = |step: &Step| match step {
            Step::Direct(_) => 0,
            Step::Linear(b) | Step::Newton(Newton { block: b, .. }) => b.unknowns.len(),
            Step::Saddle(s) => s.mass.unknowns.len() + s.rows.len(),
        };
        self.steps.iter().map(of).max().unwrap_or(0)
    }

    /// Does a stage need Newton's method?
    pub fn iterates(&self) -> bool {
        self.steps[..self.stage_steps].iter().any(|s| matches!(s, Step::Newton(_)))
    }

    /// Closure rows.
    pub fn constraints(&self) -> usize {
        let of = |step: &Step| if let Step::Saddle(s) = step { s.rows.len() } else { 0 };
        self.steps.iter().map(of).sum()
    }

    /// Do the closed loops leave the machine a motion of its own?
    pub fn moves_freely(&self) -> bool {
        self.steps.iter().any(|s| matches!(s, Step::Saddle(s) if s.rows.len() < s.mass.unknowns.len()))
    }

    pub fn has_constraints(&self) -> bool {
        self.steps.iter().any(|s| matches!(s, Step::Saddle(_)))
    }

    pub fn point(&self, flags: &[f64], gmin: f64, floor: Vec<f64>) -> Point {
        let held = self.steps.iter().map(|step| match step {
            Step::Direct(_) => Held::default(),
            Step::Linear(b) | Step::Newton(Newton { block: b, .. }) => Held::of(b),
            Step::Saddle(s) => {
                let (k, m) = (s.mass.unknowns.len(), s.rows.len());
                let mut held = Held::of(&s.mass);
                held.pull = vec![0.0; k * m];
                held.columns = Some(Columns::new(k, &s.kinds));
                held.lambda = vec![0.0; m];
                held.slots = s.gaps.workspace();
                held.quick = s.quick.as_ref().map(Quick::scratch).unwrap_or_default();
                held
            }
        });
        let mut v = vec![0.0; self.at.leaves()];
        v[self.at.gmin()] = gmin;
        Point {
            v,
            slots: self.tape.workspace(),
            whole: self.whole.as_ref().map(Whole::slots).unwrap_or_default(),
            waves: vec![0.0; 2 * self.waves],
            flags: flags.to_vec(),
            time: f64::NAN,
            side: false,
            checked: false,
            held: held.collect(),
            ports: Default::default(),
            open: Vec::new(),
            floor,
            evaluations: 0,
        }
    }

    pub fn gmin(&self, p: &Point) -> f64 {
        p.v[self.at.gmin()]
    }

    pub fn set_gmin(&self, p: &mut Point, gmin: f64) {
        p.v[self.at.gmin()] = gmin;
    }

    /// Takes charges of all rows and the values of all unknowns as a starting point: states and Newton's guesses.
    pub fn start(&self, p: &mut Point, q: &[f64], x: &[f64]) {
        p.checked = false;
        self.go_to(p, q, x);
    }

    /// The same where the masses have been looked at since a start.
    pub fn go_to(&self, p: &mut Point, q: &[f64], x: &[f64]) {
        for (s, &row) in self.states.iter().enumerate() {
            p.v[self.at.y(s)] = q[row];
        }
        self.start_from(p, x);
    }

    /// Guesses for Newton's method alone.
    pub fn start_from(&self, p: &mut Point, x: &[f64]) {
        p.v[..x.len()].copy_from_slice(x);
        p.time = f64::NAN;
    }

    /// Length of a state with room for whole vectors of four.
    pub fn width(&self) -> usize {
        self.at.width()
    }

    /// The state, to be written before `rates`.
    #[inline]
    pub fn y<'a>(&self, p: &'a mut Point) -> &'a mut [f64] {
        let from = self.at.y(0);
        &mut p.v[from..from + self.states.len()]
    }

    #[inline]
    fn set_time(&self, p: &mut Point, waves: &[Wave], t: f64, before: bool) {
        if waves.is_empty() {
            p.time = t;
        } else if p.time != t || p.side != before {
            self.set_waves(p, waves, t, before);
        }
    }

    /// A point in the stretch that ends at `stop`, by a solver that steps past it: a source that has a corner there goes on as it came.
    /// For what follows at the same time and side.
    pub fn stretch(&self, p: &mut Point, waves: &[Wave], (t, before): (f64, bool), stop: f64) {
        self.set_waves(p, waves, t, before);
        if t <= stop {
            return;
        }
        for (k, wave) in waves.iter().enumerate().filter(|(_, wave)| wave.is_piecewise_linear()) {
            let rate = wave.rate(stop, true);
            p.waves[k] = wave.value_before(stop) + rate * (t - stop);
            if self.wave_rates {
                p.waves[waves.len() + k] = rate;
            }
        }
    }

    fn set_waves(&self, p: &mut Point, waves: &[Wave], t: f64, before: bool) {
        (p.time, p.side) = (t, before);
        for (v, wave) in p.waves.iter_mut().zip(waves) {
            *v = if before { wave.value_before(t) } else { wave.value(t) };
        }
        if self.wave_rates {
            for (v, wave) in p.waves[waves.len()..].iter_mut().zip(waves) {
                *v = wave.rate(t, before);
            }
        }
    }

    /// f(y, t) into `out`, with the y that was written into the point. Sources that jump at t have the value before or after.
    #[inline]
    pub fn rates(&self, p: &mut Point, waves: &[Wave], t: f64, before: bool, out: &mut [f64]) -> Result<(), Trouble> {
        self.set_time(p, waves, t, before);
        if self.whole_rates(p, out) {
            self.finite(out)
        } else {
            self.rates_by_blocks(p, waves, t, before, out)
        }
    }

    fn rates_by_blocks(
        &self,
        p: &mut Point,
        waves: &[Wave],
        t: f64,
        before: bool,
        out: &mut [f64],
    ) -> Result<(), Trouble> {
        self.solve(p, waves, t, before)?;
        p.evaluations += 1;
        self.run(self.f_part, p);
        for (o, &slot) in out.iter_mut().zip(self.tape.part_places(self.f_part)) {
            *o = p.slots[slot as usize];
        }
        self.finite(out)
    }

    /// An error where a rate is not; rates of one point, or of several in rows of `width`.
    #[inline]
    pub fn finite(&self, rates: &[f64]) -> Result<(), Trouble> {
        let mut sums = [0.0; 4];
        let fours = rates.chunks_exact(4);
        sums[..fours.remainder().len()].copy_from_slice(fours.remainder());
        for four in fours {
            for (sum, v) in sums.iter_mut().zip(four) {
                *sum += v * 0.0;
            }
        }
        if sums.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        let k = rates.iter().position(|v| !v.is_finite()).unwrap_or(0);
        Err(Trouble::NotFinite { unknown: self.states.get(k % self.width()).copied().unwrap_or(0) })
    }

    /// The point in full: every unknown, and f(y, t) where it is asked for.
    pub fn arrive(
        &self,
        p: &mut Point,
        waves: &[Wave],
        t: f64,
        before: bool,
        rates: Option<&mut [f64]>,
        x: &mut [f64],
    ) -> Result<(), Trouble> {
        self.set_time(p, waves, t, before);
        let mut rates = rates;
        if let Some(done) = self.whole_point(p, rates.as_deref_mut(), x) {
            return done;
        }
        match rates {
            Some(rates) => self.rates_by_blocks(p, waves, t, before, rates)?,
            None => self.solve(p, waves, t, before)?,
        }
        self.unknowns(p, x)
    }

    /// What a stage must solve for, without the rates.
    pub fn solve(&self, p: &mut Point, waves: &[Wave], t: f64, before: bool) -> Result<(), Trouble> {
        self.set_time(p, waves, t, before);
        p.depart();
        for k in 0..self.stage_steps {
            self.step(k, p)?;
        }
        p.checked = true;
        Ok(())
    }

    /// Every unknown at the point where `solve` was run last.
    fn unknowns(&self, p: &mut Point, x: &mut [f64]) -> Result<(), Trouble> {
        for k in self.stage_steps..self.steps.len() {
            self.step(k, p)?;
        }
        self.run(self.x_part, p);
        for (o, &slot) in x.iter_mut().zip(self.tape.part_places(self.x_part)) {
            *o = p.slots[slot as usize];
        }
        match x.iter().position(|v| !v.is_finite()) {
            Some(unknown) => Err(Trouble::NotFinite { unknown }),
            None => Ok(()),
        }
    }

    #[inline]
    fn run(&self, part: usize, p: &mut Point) {
        self.tape.run_part(part, &Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags }, &mut p.slots);
    }

    fn step(&self, k: usize, p: &mut Point) -> Result<(), Trouble> {
        match &self.steps[k] {
            Step::Direct(d) => {
                self.run(d.part, p);
                let outputs = self.tape.part_places(d.part);
                let (speeds, pivots) = outputs.split_at(d.unknowns.len());
                if !p.checked {
                    self.check(d, p)?;
                }
                for (&u, &slot) in d.unknowns.iter().zip(speeds) {
                    p.v[u] = p.slots[slot as usize];
                }
                match pivots.iter().position(|&slot| !(p.slots[slot as usize] > 0.0)) {
                    Some(k) => Err(Trouble::Singular { unknown: d.unknowns[k] }),
                    None => Ok(()),
                }
            }
            Step::Linear(block) => {
                self.run(block.part, p);
                let outputs = self.tape.part_places(block.part);
                let held = &mut p.held[k];
                block.solve_anew(outputs, &p.slots, held)?;
                for (&u, &v) in block.unknowns.iter().zip(&held.rhs) {
                    p.v[u] = v;
                }
                Ok(())
            }
            Step::Newton(newton) => self.newton(newton, k, p),
            Step::Saddle(saddle) => self.saddle(saddle, k, p),
        }
    }

    /// Is M positive definite at the start, by the pivots against its diagonal?
    fn check(&self, d: &Direct, p: &mut Point) -> Result<(), Trouble> {
        let mut w = d.momenta.workspace();
        let mut run = |p: &mut Point, moving: Option<usize>| {
            for (j, &u) in d.unknowns.iter().enumerate() {
                p.v[u] = f64::from(u8::from(moving == Some(j)));
            }
            d.momenta.run(&Inputs { x: &p.v, t: p.time, waves: &p.waves, flags: &p.flags }, &mut w);
            (0..d.unknowns.len()).map(|k| d.momenta.output(&w, k)).collect::<Vec<f64>>()
        };
        let still = run(p, None);
        for (k, &unknown) in d.unknowns.iter().enumerate() {
            let diagonal = run(p, Some(k))[k] - still[k];
            let inverse = p.slots[self.tape.part_places(d.part)[d.unknowns.len() + k] as usize];
            if !(inverse * diagonal * ROUNDED < 1.0) {
                return Err(Trouble::Singular { unknown });
            }
        }
        Ok(())
    }

    /// What part of a step leads no further than devices let their voltages go, from p.ports[0] to those of the part.
    fn within_limits(&self, limits: &Limits, p: &mut Point) -> f64 {
        self.voltages(limits, p, 1);
        let (mut share, mut at) = (1.0_f64, 0);
        for &(class, k) in &limits.list {
            let class = &self.classes[class];
            let own = at..at + class.ports();
            at = own.end;
            let (old, new) = (&p.ports[0][own.clone()], &p.ports[1][own]);
            let mut to = new.to_vec();
            if class.limit(k, &mut to, old) {
                for ((old, new), to) in old.iter().zip(new).zip(&to).filter(|((_, new), to)| new != to) {
                    // of a step that limiting cuts at least so much is taken: a device whose limited voltage is the old
                    // one must not stop the others
                    share = share.min(((to - old) / (new - old)).clamp(1e-3, 1.0));
                }
            }
        }
        share
    }

    fn voltages(&self, limits: &Limits, p: &mut Point, which: usize) {
        if !limits.list.is_empty() {
            self.run(limits.part, p);
            let (slots, ports) = (&p.slots, &mut p.ports[which]);
            ports.clear();
            ports.extend(self.tape.part_places(limits.part).iter().map(|&slot| slots[slot as usize]));
        }
    }

    fn newton(&self, newton: &Newton, k: usize, p: &mut Point) -> Result<(), Trouble> {
        let Newton { block, limits } = newton;
        let part = limits.part + 1;
        let outputs = self.tape.part_places(part);
        self.run(block.part, p);
        self.voltages(limits, p, 0);
        let mut worst = block.unknowns[0];
        // of Newton's method from a point near by, which takes three or four: more are one that goes nowhere
        for _ in 0..50 {
            self.run(part, p);
            let held = &mut p.held[k];
            block.solve_anew(outputs, &p.slots, held)?;
            let mut ratio = 0.0_f64;
            for (&u, &d) in block.unknowns.iter().zip(&held.rhs) {
                let x = p.v[u] + d;
                p.v[u] = x;
                if !x.is_finite() {
                    p.v[u] = 0.0;
                    return Err(Trouble::NotFinite { unknown: u });
                }
                let floor = p.floor.get(u).copied().unwrap_or(1e-12);
                // Newton's method converges quadratically: an update so small leaves its square
                let r = d.abs() / (1e-7 * x.abs() + floor);
                if r > ratio {
                    ratio = r;
                    worst = u;
                }
            }
            let share = self.within_limits(limits, p);
            if share < 1.0 {
                for (&u, &d) in block.unknowns.iter().zip(&p.held[k].rhs) {
                    p.v[u] -= (1.0 - share) * d;
                }
                self.voltages(limits, p, 0);
            } else if ratio <= 1.0 {
                return Ok(());
            } else {
                let [before, behind] = &mut p.ports;
                std::mem::swap(before, behind);
            }
        }
        Err(Trouble::Diverged { unknown: worst })
    }

    /// A small change of the state as a change of the unknowns that it determines, by the factors of the last stage.
    /// (What a change of one block means for later ones is left out: it has the same relative size there.)
    pub fn changes(&self, p: &mut Point, e: &[f64], out: &mut [f64]) {
        if self.whole_changes(p, e, out) {
            return;
        }
        out.fill(0.0);
        for &(unknown, s, r) in &self.direct {
            out[unknown] = r * e[s];
        }
        for (k, step) in self.steps[..self.stage_steps].iter().enumerate() {
            if let Step::Direct(d) = step {
                let from = self.at.change(0);
                p.v[from..from + e.len()].copy_from_slice(e);
                self.run(d.changes_part, p);
                for (&u, &slot) in d.unknowns.iter().zip(self.tape.part_places(d.changes_part)) {
                    out[u] = p.slots[slot as usize];
                }
            }
            let (Step::Linear(block) | Step::Newton(Newton { block, .. })) = step else { continue };
            if block.states.iter().all(Option::is_none) {
                continue;
            }
            let held = &mut p.held[k];
            for (b, s) in held.rhs.iter_mut().zip(&block.states) {
                *b = s.map_or(0.0, |s| e[s]);
            }
            block.solve(held);
            for (&u, &v) in block.unknowns.iter().zip(&held.rhs) {
                if u < out.len() {
                    out[u] = v;
                }
            }
        }
    }
}
