//! Instances of one shape (shape.rs) of a module that was compiled from a text, side by side.
//!
//! First port voltages of Newton's method (what a module cannot say): a module with gates (fetlim) starts there at the threshold and
//! everywhere else at 0 V; any other at the critical voltage of its first junction (pnjlim).
use super::class::{across, add, by_panels, Asked, Class, Facts, Line, Met, Number, Seat, Shape, LANES};
use super::limits::Limiter;
use super::shape::{Anonymous, Constants, Key, Program, Wanted};
use super::Noise;
use crate::graph::{Graph, Id};
use crate::multiversion::in_blocks_mut;
#[cfg(target_arch = "x86_64")]
use crate::tape::vectors;
use crate::tape::{batch::WIDEST, Inputs};
use crate::veriloga::Folded;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, Weak};

/// So many ports are limited at most.
pub const MOST_LIMITED: usize = 32;

pub struct Compiled {
    kind: String,
    key: Arc<Key>,
    program: Arc<Program>,
    seats: Vec<Seat>,
    numbers: HashMap<String, usize>,
    own: Vec<Own>,
    wires: Vec<Wires>,
    groups: Vec<Group>,
    together: usize, // groups that one evaluation takes
    /// of every so many groups, block by block
    constants: Vec<Vec<[f64; LANES]>>,
    /// of each branch and port: the slope, if there is one
    slope_of: Vec<Option<usize>>,
    /// what programs run on; another thread that is here at the same time makes its own
    scratch: Mutex<Option<Scratch>>,
}

/// What an instance has for itself.
#[derive(Clone)]
struct Own {
    constants: Constants, // those of the shape, then what hangs on them alone
    /// of every limited port: arguments, and a change of voltage that is never limited
    arguments: Vec<(Vec<f64>, f64)>,
    start: Vec<f64>,
}

/// Up to four instances, side by side.
struct Group {
    ports: Vec<[(i32, i32); LANES]>,
    quiet: Vec<[f64; LANES]>, // of every limited port
}

/// Places in the system.
struct Wires {
    ports: Vec<(i32, i32)>,
    rows: Vec<[i32; 4]>,
}

struct Scratch {
    lines: Vec<f64>,
    values: Vec<f64>,
    x: Vec<f64>,
    out: Vec<f64>,
    four: Vec<[f64; LANES]>,
    x4: Vec<[f64; LANES]>,
    before: Vec<[f64; LANES]>,
}

impl Scratch {
    fn new(program: &Program, together: usize) -> Scratch {
        let results = program.lines.outputs().max(program.values.outputs());
        Scratch {
            lines: program.lines.workspace(),
            values: program.values.workspace(),
            x: vec![0.0; program.ports() + 1],
            out: vec![0.0; results],
            four: program.four.as_ref().map_or_else(|| program.lines.workspace_of_many(), |four| four.workspace()),
            x4: vec![[0.0; LANES]; together * (program.ports() + 1)],
            before: vec![[0.0; LANES]; together * program.ports()],
        }
    }
}

impl Compiled {
    pub fn new(of: Anonymous) -> Compiled {
        // (its key is needed to find it again, and the program is made of the rest)
        let key = Arc::new(of.key.clone());
        let program = Arc::new(Program::new(of));
        Compiled::running(key, program)
    }

    fn running(key: Arc<Key>, program: Arc<Program>) -> Compiled {
        let ports = program.ports();
        let mut slope_of = vec![None; program.shape.links.len()];
        program.slopes.iter().enumerate().for_each(|(k, s)| slope_of[s.branch * ports + s.port] = Some(k));
        let kind = format!("module {}", program.module);
        let (seats, numbers, own, wires, groups, constants) = Default::default();
        let together = if program.four.is_some() { 1 } else { WIDEST };
        let scratch = Mutex::new(None);
        Compiled { kind, key, program, seats, numbers, own, wires, groups, together, constants, slope_of, scratch }
    }

    pub fn is_of(&self, key: &Key) -> bool {
        *self.key == *key
    }

    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The instance of that name.
    pub fn number(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// An operating-point value of instance k as an expression of the system's unknowns.
    pub fn output_symbol(&self, k: usize, word: &str, g: &mut Graph, gmin: f64) -> Option<Id> {
        let number = self.program.outputs.iter().position(|o| o[0].eq_ignore_ascii_case(word))?;
        let seat = &self.seats[k];
        let mut node = |k: usize| match usize::try_from(seat.nodes[k]) {
            Ok(unknown) => g.unknown(unknown as u32),
            Err(_) => g.constant(0.0),
        };
        let ends: Vec<(Id, Id)> = self.program.shape.ports.iter().map(|&(p, n)| (node(p), node(n))).collect();
        let v: Vec<Id> = ends.into_iter().map(|(p, n)| g.sub(p, n)).collect();
        let gmin = g.constant(gmin);
        Some(self.program.output_symbol(number, &self.own[k].constants, g, &v, gmin))
    }

    /// An instance more; `unknown` makes what it asks for.
    pub fn join(
        &mut self,
        name: &str,
        terminals: &[i32],
        (constants, arguments): (Constants, Vec<Vec<f64>>),
        unknown: &mut dyn FnMut(Wanted) -> i32,
    ) {
        let program = &*self.program;
        let mut nodes = terminals.to_vec();
        nodes.extend(program.inner.iter().map(|(name, sort)| unknown(Wanted::Own(name, *sort))));
        for &node in &program.rates {
            nodes.push(unknown(Wanted::Rate(nodes[node])));
        }
        nodes.push(-1); // the reference node
        let rows = program.shape.branches.iter().map(|&(from, to)| [nodes[from], nodes[to], -1, -1]).collect();
        let constants = program.all_constants(&constants);
        let start = first_voltages(program, &arguments);
        let quiet = |(arguments, &(_, limiter)): (Vec<f64>, &(usize, Limiter))| {
            let quiet = limiter.quiet(&arguments);
            (arguments, quiet)
        };
        let arguments = arguments.into_iter().zip(&program.limited).map(quiet).collect();
        self.own.push(Own { constants, arguments, start });
        self.numbers.insert(name.to_string(), self.seats.len());
        self.seats.push(Seat { name: name.to_string(), nodes, rows, series: Vec::new() });
    }

    fn with_scratch<T>(&self, run: impl FnOnce(&mut Scratch) -> T) -> T {
        let kept = self.scratch.try_lock().ok().and_then(|mut kept| kept.take());
        let mut scratch = kept.unwrap_or_else(|| Scratch::new(&self.program, self.together));
        let result = run(&mut scratch);
        if let Ok(mut kept) = self.scratch.try_lock() {
            *kept = Some(scratch);
        }
        result
    }

    /// Numbers of an instance: port voltages asked for, those that were taken, what the program gives, and of the stage the currents
    /// and slopes.
    fn numbers(&self) -> usize {
        self.row_of_slope(self.program.slopes.len())
    }

    fn row_of_result(&self, k: usize) -> usize {
        2 * self.ports() + k
    }

    fn row_of_current(&self, branch: usize) -> usize {
        self.row_of_result(self.program.lines.outputs()) + branch
    }

    fn row_of_slope(&self, slope: usize) -> usize {
        self.row_of_current(self.program.currents.len()) + slope
    }

    fn limit_ports(program: &Program, own: &Own, new: &mut [f64], old: impl Fn(usize) -> f64) -> bool {
        let mut moved = false;
        for (&(p, limiter), (arguments, _)) in program.limited.iter().zip(&own.arguments) {
            let (to, by) = limiter.apply(new[p], old(p), arguments);
            new[p] = to;
            moved |= by;
        }
        moved
    }

    /// Results of `lines` at these port voltages.
    fn run<'a>(program: &Program, own: &Own, s: &'a mut Scratch, v: &[f64], gmin: f64) -> &'a [f64] {
        let ports = program.ports();
        s.x[..ports].copy_from_slice(v);
        s.x[ports] = gmin;
        let inputs = Inputs { x: &s.x, t: 0.0, waves: &own.constants, flags: &[] };
        program.lines.run_into(0, &inputs, &mut s.lines, &mut s.out);
        &s.out
    }

    /// Group n: the voltages that are asked for to `rows`, limited ones to `held`; was one moved?
    #[inline(always)]
    fn gather(&self, n: usize, asked: &Asked, held: &mut [[f64; LANES]], rows: &mut [[f64; LANES]]) -> bool {
        let (ports, limited) = (self.ports(), self.program.limited.len());
        let (group, rows) = (&self.groups[n], &mut rows[..2 * ports]);
        let (v, at) = rows.split_at_mut(ports);
        for (v, ends) in v.iter_mut().zip(&group.ports) {
            *v = std::array::from_fn(|lane| across(asked.x, ends[lane].0, ends[lane].1));
        }
        let mut calm = true;
        if asked.limit {
            for (&(p, _), quiet) in self.program.limited.iter().zip(&group.quiet[..limited]) {
                // (a number that is none is not calm)
                calm &= (0..LANES).all(|lane| (v[p][lane] - held[p][lane]).abs() <= quiet[lane]);
            }
        }
        let moved = !calm && self.limit_group(n, v, held);
        if calm {
            held[..ports].copy_from_slice(v);
        }
        at.copy_from_slice(&held[..ports]);
        moved
    }

    /// The same where a voltage may have to be limited.
    #[inline(never)]
    fn limit_group(&self, n: usize, v: &[[f64; LANES]], held: &mut [[f64; LANES]]) -> bool {
        let mut moved = false;
        let mut before = [[0.0; LANES]; MOST_LIMITED];
        let limited = &self.program.limited;
        limited.iter().zip(&mut before).for_each(|(l, before)| *before = held[l.0]);
        held[..v.len()].copy_from_slice(v);
        for (lane, own) in self.own.iter().skip(n * LANES).take(LANES).enumerate() {
            for ((&(p, limiter), (arguments, _)), before) in limited.iter().zip(&own.arguments).zip(&before) {
                let (to, by) = limiter.apply(v[p][lane], before[lane], arguments);
                moved |= by;
                held[p][lane] = to;
            }
        }
        moved
    }

    /// What the program gives at the voltages that were taken, of groups from n on.
    #[inline(always)]
    fn evaluate(&self, n: usize, gmin: f64, rows: &mut [[f64; LANES]], s: &mut Scratch) {
        let (program, ports, numbers) = (&*self.program, self.ports(), self.numbers());
        let constants = &self.constants[n / self.together];
        if let Some(four) = &program.four {
            let (at, out) = rows[ports..].split_at_mut(ports);
            s.x4[..ports].copy_from_slice(at);
            s.x4[ports] = [gmin; LANES];
            return four.run(&s.x4, constants, &mut s.four, out);
        }
        let width = rows.len() / numbers;
        let results = program.lines.outputs();
        if program.lines.interprets(width as u32) {
            for (b, rows) in rows.chunks_exact(numbers).enumerate() {
                (0..ports).for_each(|p| s.x4[p * width + b] = rows[ports + p]);
            }
            s.x4[ports * width..].fill([gmin; LANES]);
            program.lines.run_many(width, &s.x4, constants, &mut s.four);
            for k in 0..results {
                let of_all = program.lines.of_many(k, width, &s.four);
                rows.chunks_exact_mut(numbers).zip(of_all).for_each(|(rows, v)| rows[self.row_of_result(k)] = *v);
            }
            return;
        }
        for (lane, own) in self.own.iter().skip(n * LANES).take(width * LANES).enumerate() {
            let rows = &mut rows[lane / LANES * numbers..];
            let (at, out) = rows[ports..].split_at_mut(ports);
            s.x.iter_mut().zip(&*at).for_each(|(x, at)| *x = at[lane % LANES]);
            s.x[ports] = gmin;
            let inputs = Inputs { x: &s.x, t: 0.0, waves: &own.constants, flags: &[] };
            program.lines.run_into(0, &inputs, &mut s.lines, &mut s.out);
            out.iter_mut().zip(&s.out[..results]).for_each(|(row, v)| row[lane % LANES] = *v);
        }
    }

    /// Straight lines of the stage; of an instance a current is apart from the line that led here.
    #[inline(always)]
    fn stage(&self, count: usize, asked: &Asked, before: &[[f64; LANES]], rows: &mut [[f64; LANES]]) -> bool {
        let (program, ports, a) = (&*self.program, self.ports(), asked.a);
        let (first, first_slope) = (self.row_of_current(0), self.row_of_slope(0));
        let results = self.row_of_result(0);
        let mut apart = false;
        let mut slope = 0;
        for (j, current) in program.currents.iter().enumerate() {
            let mut stage = rows[results + current.i];
            if let Some(q) = current.q {
                let q = rows[results + q];
                (0..LANES).for_each(|k| stage[k] += a * q[k]);
            }
            let (mut line, mut worth) = (rows[first + j], [0.0; LANES]);
            while let Some(of) = program.slopes.get(slope).filter(|of| of.branch == j) {
                let mut both = rows[results + of.g];
                if let Some(c) = of.c {
                    let c = rows[results + c];
                    (0..LANES).for_each(|k| both[k] += a * c[k]);
                }
                let (v, at) = (rows[of.port], rows[ports + of.port]);
                (0..LANES).for_each(|k| stage[k] += both[k] * (v[k] - at[k]));
                let row = first_slope + slope;
                if let Some(near) = asked.near {
                    let (led, old) = (rows[row], before[of.port]);
                    for k in 0..LANES {
                        line[k] += led[k] * (v[k] - old[k]);
                        worth[k] += both[k].abs() * (near.reltol * v[k].abs() + near.vntol);
                    }
                }
                rows[row] = both;
                slope += 1;
            }
            if let Some(near) = asked.near {
                for k in 0..count {
                    let worth = worth[k] + near.share * stage[k].abs().max(near.least);
                    // (a number that is none is not near anything)
                    apart |= !((stage[k] - line[k]).abs() < worth + f64::MIN_POSITIVE);
                }
            }
            rows[first + j] = stage;
        }
        apart
    }

    /// Port voltages, and no gmin.
    fn inputs(&self, v: &[f64]) -> Vec<f64> {
        v.iter().copied().chain([0.0]).collect()
    }

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn wide(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64], s: &mut Scratch) -> Met {
        self.each_group(asked, held, lines, s)
    }

    #[inline(always)]
    fn each_group(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64], s: &mut Scratch) -> Met {
        let (mut met, count, ports) = (Met::default(), self.own.len(), self.ports());
        let (numbers, together) = (self.numbers(), self.together);
        let (held, lines) = (in_blocks_mut(held), in_blocks_mut(lines));
        let groups = count.div_ceil(LANES);
        // a module may have no port (a source that is constant), or carry nothing at all
        if numbers == 0 {
            return met;
        }
        for first in (0..groups).step_by(together) {
            let many = together.min(groups - first);
            let rows = &mut lines[first * numbers..(first + many) * numbers];
            for b in 0..many {
                let rows = &mut rows[b * numbers..][..numbers];
                if asked.near.is_some() {
                    s.before[b * ports..][..ports].copy_from_slice(&rows[..ports]);
                }
                met.moved |= self.gather(first + b, asked, &mut held[(first + b) * ports..][..ports], rows);
            }
            self.evaluate(first, asked.gmin, rows, s);
            for (b, rows) in rows.chunks_exact_mut(numbers).enumerate() {
                let instances = (count - (first + b) * LANES).min(LANES);
                met.apart |= self.stage(instances, asked, &s.before[b * ports..], rows);
            }
        }
        met
    }
}

fn first_voltages(program: &Program, arguments: &[Vec<f64>]) -> Vec<f64> {
    let mut start = vec![0.0; program.ports()];
    let of = |wanted: Limiter| move |&(_, &(_, limiter)): &(usize, &(usize, Limiter))| limiter == wanted;
    let limited = || program.limited.iter().enumerate();
    let gates: Vec<_> = limited().filter(of(Limiter::Gate)).collect();
    if gates.is_empty() {
        if let Some((k, &(p, _))) = limited().find(of(Limiter::Junction)) {
            start[p] = arguments[k][1];
        }
    }
    for (k, &(p, _)) in gates {
        start[p] = arguments[k][0];
    }
    start
}

impl Class for Compiled {
    fn kind(&self) -> &str {
        &self.kind
    }

    fn terminals(&self) -> usize {
        self.program.terminals
    }

    fn ports(&self) -> usize {
        self.program.ports()
    }

    fn room(&self, count: usize) -> usize {
        count.div_ceil(LANES) * self.numbers() * LANES
    }

    fn place(&self, instance: usize, number: Number) -> usize {
        let (program, ports) = (&*self.program, self.ports());
        let slope = |j: usize, p: usize| self.slope_of[j * ports + p].expect("a slope that is there");
        let row = match number {
            Number::Voltage(p) => p,
            Number::At(p) => ports + p,
            Number::StageCurrent(j) => self.row_of_current(j),
            Number::Current(j) => self.row_of_result(program.currents[j].i),
            Number::Charge(j) => self.row_of_result(program.currents[j].q.expect("a charge that is there")),
            Number::StageConductance(j, p) => self.row_of_slope(slope(j, p)),
            Number::Conductance(j, p) => self.row_of_result(program.slopes[slope(j, p)].g),
            Number::Capacitance(j, p) => {
                self.row_of_result(program.slopes[slope(j, p)].c.expect("a capacitance that is there"))
            }
        };
        (instance / LANES * self.numbers() + row) * LANES + instance % LANES
    }

    fn operations(&self, _: usize) -> f64 {
        self.program.lines.len() as f64
    }

    fn compiled(&mut self) -> Option<&mut Compiled> {
        Some(self)
    }

    fn seats(&self) -> &[Seat] {
        &self.seats
    }

    fn seats_mut(&mut self) -> &mut [Seat] {
        &mut self.seats
    }

    fn settle(&mut self) {
        let wires = |seat: &Seat| {
            let ports = self.program.shape.ports.iter().map(|&(p, n)| (seat.nodes[p], seat.nodes[n])).collect();
            Wires { ports, rows: seat.rows.clone() }
        };
        self.wires = self.seats.iter().map(wires).collect();
        // (the last one stands for those that are missing)
        let four = |first: usize| {
            let last = self.own.len() - 1;
            let at = |lane: usize| (first + lane).min(last);
            let ends = |p: usize| std::array::from_fn(|lane| self.wires[at(lane)].ports[p]);
            let quiet = |k: usize| std::array::from_fn(|lane| self.own[at(lane)].arguments[k].1);
            Group {
                ports: (0..self.program.ports()).map(ends).collect(),
                quiet: (0..self.program.limited.len()).map(quiet).collect(),
            }
        };
        self.groups = (0..self.own.len()).step_by(LANES).map(four).collect();
        let blocks = |groups: std::ops::Range<usize>| {
            let own = |n: usize, lane: usize| &self.own[(n * LANES + lane).min(self.own.len() - 1)];
            let block = |k: usize, n: usize| std::array::from_fn(|lane| own(n, lane).constants[k]);
            (0..self.own[0].constants.len()).flat_map(|k| groups.clone().map(move |n| block(k, n))).collect()
        };
        let firsts = (0..self.groups.len()).step_by(self.together);
        self.constants = firsts.map(|n| blocks(n..(n + self.together).min(self.groups.len()))).collect();
    }

    fn moved(&self, place: &dyn Fn(i32) -> i32) -> Box<dyn Class> {
        let mut other = Compiled::running(self.key.clone(), self.program.clone());
        other.own.clone_from(&self.own);
        other.seats.clone_from(&self.seats);
        other.numbers.clone_from(&self.numbers);
        for seat in &mut other.seats {
            seat.nodes.iter_mut().chain(seat.rows.as_flattened_mut()).for_each(|k| *k = place(*k));
        }
        Box::new(other)
    }

    fn shape(&self, _: usize) -> &Shape {
        &self.program.shape
    }

    fn facts(&self, _: usize) -> Facts {
        Facts { exponential: self.program.exponential, passive: false }
    }

    fn bend(&self, k: usize, port: usize) -> f64 {
        let mut limited = self.program.limited.iter().zip(&self.own[k].arguments);
        let junction = limited.find(|((p, limiter), _)| *p == port && *limiter == Limiter::Junction);
        junction.map_or(f64::INFINITY, |(_, (arguments, _))| arguments[0])
    }

    fn values(&self, x: &[f64], gmin: f64, f: &mut [f64], q: &mut [f64]) {
        let program = &*self.program;
        self.with_scratch(|s| {
            for (own, wires) in self.own.iter().zip(&self.wires) {
                for (v, &(p, n)) in s.x.iter_mut().zip(&wires.ports) {
                    *v = across(x, p, n);
                }
                s.x[program.ports()] = gmin;
                let inputs = Inputs { x: &s.x, t: 0.0, waves: &own.constants, flags: &[] };
                program.values.run_into(0, &inputs, &mut s.values, &mut s.out);
                for (rows, pair) in wires.rows.iter().zip(s.out.chunks_exact(2)) {
                    add(f, rows, pair[0]);
                    add(q, rows, pair[1]);
                }
            }
        });
    }

    fn linearise(&self, asked: &Asked, held: &mut [f64], lines: &mut [f64]) -> Met {
        #[cfg(target_arch = "x86_64")]
        if vectors() {
            // SAFETY: the processor has them
            return self.with_scratch(|s| unsafe { self.wide(asked, held, lines, s) });
        }
        self.with_scratch(|s| self.each_group(asked, held, lines, s))
    }

    fn start(&self, held: &mut [f64]) {
        let ports = self.ports();
        for (k, own) in self.own.iter().enumerate() {
            for (p, &v) in own.start.iter().enumerate() {
                held[(k / LANES * ports + p) * LANES + k % LANES] = v;
            }
        }
    }

    fn at(&self, k: usize, v: &[f64], gmin: f64, line: &mut Line) {
        let program = &*self.program;
        let (branches, ports) = (program.currents.len(), program.ports());
        for values in [&mut line.i, &mut line.q, &mut line.g, &mut line.c] {
            values.clear();
        }
        line.g.resize(branches * ports, 0.0);
        line.c.resize(branches * ports, 0.0);
        self.with_scratch(|s| {
            let out = Self::run(program, &self.own[k], s, v, gmin);
            let value = |k: Option<usize>| k.map_or(0.0, |k| out[k]);
            line.i.extend(program.currents.iter().map(|c| out[c.i]));
            line.q.extend(program.currents.iter().map(|c| value(c.q)));
            for slope in &program.slopes {
                let at = slope.branch * ports + slope.port;
                (line.g[at], line.c[at]) = (out[slope.g], value(slope.c));
            }
        });
    }

    fn limit(&self, k: usize, new: &mut [f64], old: &[f64]) -> bool {
        Self::limit_ports(&self.program, &self.own[k], new, |p| old[p])
    }

    /// The integral of v dq of every branch along a straight line from 0 V.
    fn energy(&self, k: usize, v: &[f64], gmin: f64) -> f64 {
        let (program, shape) = (&*self.program, &self.program.shape);
        if !shape.stores_any() {
            return 0.0;
        }
        let along = |j: usize| {
            let path = program.along[j].as_deref().unwrap_or_default();
            path.iter().map(|&(p, sign)| sign * v[p]).sum::<f64>()
        };
        let voltages: Vec<f64> = (0..program.currents.len()).map(along).collect();
        let (mut line, mut at) = (Line::default(), vec![0.0; v.len()]);
        by_panels(v, |s| {
            at.iter_mut().zip(v).for_each(|(at, v)| *at = s * v);
            self.at(k, &at, gmin, &mut line);
            let stored = program.slopes.iter().filter(|slope| slope.c.is_some());
            let c = |of: &super::shape::Slope| line.c[of.branch * v.len() + of.port];
            stored.map(|of| c(of) * v[of.port] * s * voltages[of.branch]).sum()
        })
    }

    fn output(&self, k: usize, word: &str, v: &[f64], _: &Line) -> Option<f64> {
        let number = self.program.outputs.iter().position(|o| o[0].eq_ignore_ascii_case(word))?;
        Some(self.program.tell(&self.inputs(v), &self.own[k].constants)[self.program.output(number)])
    }

    fn noise(&self, k: usize, v: &[f64], _: &Line, each: &mut dyn FnMut(Noise)) {
        let told = self.program.tell(&self.inputs(v), &self.own[k].constants);
        for source in &self.program.noise {
            let ((from, to), exponent) = (source.branch, source.exponent.map_or(0.0, |k| told[k]));
            each(Noise { name: &source.name, from, to, power: told[source.power], exponent });
        }
    }

    fn symbols(&self, k: usize, g: &mut Graph, v: &[Id], gmin: Id) -> Vec<(Id, Id)> {
        self.program.symbols(&self.own[k].constants, g, v, gmin)
    }
}

/// What an instance has for itself: constants, and arguments of its limiters.
type Given = (Constants, Vec<Vec<f64>>);

/// Classes of what was folded lately: instances that share it differ in their nodes alone, so that it is looked through once.
#[derive(Default)]
pub struct Lately(Vec<(Weak<Folded>, f64, usize, Given)>);

/// Puts an instance of a folded module into the class of its shape among `classes`, which is made where there is none. Gives the
/// unknowns of its nodes (`Seat`).
pub fn seat(
    (classes, lately): (&mut Vec<Box<dyn Class>>, &mut Lately),
    module: &str,
    (name, terminals): (&str, &[i32]),
    folded: &Arc<Folded>,
    m: f64,
    unknown: &mut dyn FnMut(Wanted) -> i32,
) -> Result<Vec<i32>, String> {
    if terminals.len() != folded.terminals {
        return Err(format!("{module} has {} terminals", folded.terminals));
    }
    let alike = lately.0.iter().find(|l| std::ptr::eq(l.0.as_ptr(), Arc::as_ptr(folded)) && l.1 == m);
    let (class, own) = match alike {
        Some((_, _, class, own)) => (*class, own.clone()),
        None => {
            let (class, own) = class_of(classes, Anonymous::of(module, folded, m)?);
            lately.0.retain(|l| l.0.strong_count() > 0);
            lately.0.push((Arc::downgrade(folded), m, class, own.clone()));
            (class, own)
        }
    };
    let class = classes[class].compiled().ok_or("a class of another kind")?;
    class.join(name, terminals, own, unknown);
    Ok(class.seats.last().map_or(Vec::new(), |seat| seat.nodes.clone()))
}

/// The class of its shape, by its place, and what is the instance's own.
fn class_of(classes: &mut Vec<Box<dyn Class>>, mut of: Anonymous) -> (usize, Given) {
    let own = (std::mem::take(&mut of.constants), std::mem::take(&mut of.arguments));
    let found = classes.iter_mut().position(|c| c.compiled().is_some_and(|c| c.is_of(&of.key)));
    let class = found.unwrap_or_else(|| {
        of.constants.clone_from(&own.0); // (how many there are)
        classes.push(Box::new(Compiled::new(of)));
        classes.len() - 1
    });
    (class, own)
}

#[cfg(test)]
mod tests;
