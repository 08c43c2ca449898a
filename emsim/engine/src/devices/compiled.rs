//! Instances of one shape (shape.rs) of a module that was compiled from a text, side by side.
//!
//! First port voltages of Newton's method (what a module cannot say): a module with gates (fetlim) starts there at the threshold and
//! everywhere else at 0 V; any other at the critical voltage of its first junction (pnjlim). An instance that is `off` starts at 0 V.
use super::class::{across, add, Asked, Class, Facts, Line, Met, Number, Seat, Shape, GAUSS, LANES};
use super::limits::Limiter;
use super::shape::{Anonymous, Constants, Key, Program};
use super::{Climate, Noise};
use crate::graph::{Graph, Id};
use crate::tape::Inputs;
use crate::veriloga::folded::{self, Folded};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// Numbers of a branch: stage's current, current, charge; those of a slope likewise.
const KINDS: usize = 3;
/// Energy: intervals of at most so many volts, and at most so many.
const PANEL: f64 = 0.05;
const MOST_PANELS: f64 = 400.0;

pub struct Compiled {
    kind: String,
    key: Arc<Key>,
    program: Arc<Program>,
    seats: Vec<Seat>,
    own: Vec<Own>,
    wires: Vec<Wires>,
    /// of each branch and port: the slope, if there is one
    slope_of: Vec<Option<usize>>,
    /// what programs run on; another thread that is here at the same time makes its own
    scratch: Mutex<Option<Scratch>>,
}

/// What an instance has for itself.
#[derive(Clone)]
struct Own {
    constants: Constants, // those of the shape, then what hangs on them alone
    arguments: Vec<Vec<f64>>,
    start: Vec<f64>,
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
    voltages: Vec<f64>,
}

impl Scratch {
    fn new(program: &Program) -> Scratch {
        let results = program.lines.outputs().max(program.values.outputs());
        Scratch {
            lines: program.lines.workspace(),
            values: program.values.workspace(),
            x: vec![0.0; program.ports() + 1],
            out: vec![0.0; results],
            voltages: vec![0.0; program.ports()],
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
        let (seats, own, wires) = Default::default();
        Compiled { kind, key, program, seats, own, wires, slope_of, scratch: Mutex::new(None) }
    }

    pub fn is_of(&self, key: &Key) -> bool {
        *self.key == *key
    }

    pub fn program(&self) -> &Program {
        &self.program
    }

    /// An instance more; `inner` makes an unknown of that name and kind.
    pub fn join(
        &mut self,
        name: &str,
        terminals: &[i32],
        (constants, arguments): (Constants, Vec<Vec<f64>>),
        off: bool,
        inner: &mut dyn FnMut(&str, folded::Kind) -> usize,
    ) {
        let program = &*self.program;
        let mut nodes = terminals.to_vec();
        nodes.extend(program.inner.iter().map(|(name, kind)| inner(name, *kind) as i32));
        nodes.push(-1); // the reference node
        let rows = program.shape.branches.iter().map(|&(from, to)| [nodes[from], nodes[to], -1, -1]).collect();
        let constants = program.all_constants(&constants);
        let start = first_voltages(program, &arguments, off);
        self.own.push(Own { constants, arguments, start });
        self.seats.push(Seat { name: name.to_string(), nodes, rows, series: Vec::new() });
    }

    fn with_scratch<T>(&self, run: impl FnOnce(&mut Scratch) -> T) -> T {
        let kept = self.scratch.try_lock().ok().and_then(|mut kept| kept.take());
        let mut scratch = kept.unwrap_or_else(|| Scratch::new(&self.program));
        let result = run(&mut scratch);
        if let Ok(mut kept) = self.scratch.try_lock() {
            *kept = Some(scratch);
        }
        result
    }

    fn numbers(&self) -> usize {
        2 * self.ports() + KINDS * (self.program.currents.len() + self.program.slopes.len())
    }

    /// Row of the first number of a branch, of a slope.
    fn row_of_branch(&self, branch: usize) -> usize {
        2 * self.ports() + KINDS * branch
    }

    fn row_of_slope(&self, slope: usize) -> usize {
        2 * self.ports() + KINDS * (self.program.currents.len() + slope)
    }

    fn limit_ports(program: &Program, own: &Own, new: &mut [f64], old: impl Fn(usize) -> f64) -> bool {
        let mut moved = false;
        for (&(p, limiter), arguments) in program.limited.iter().zip(&own.arguments) {
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

    /// One instance: its numbers into its places of the group; was a voltage moved, is a current apart?
    fn one(&self, k: usize, asked: &Asked, held: &mut [f64], lines: &mut [f64], s: &mut Scratch) -> (bool, bool) {
        let (program, own, wires, lane) = (&*self.program, &self.own[k], &self.wires[k], k % LANES);
        let ports = program.ports();
        let mut v = std::mem::take(&mut s.voltages);
        for (v, &(p, n)) in v.iter_mut().zip(&wires.ports) {
            *v = across(asked.x, p, n);
        }
        s.x[..ports].copy_from_slice(&v);
        let moved = asked.limit && {
            let old = |p: usize| held[p * LANES + lane];
            Self::limit_ports(program, own, &mut s.x[..ports], old)
        };
        (0..ports).for_each(|p| held[p * LANES + lane] = s.x[p]);
        s.x[ports] = asked.gmin;
        let inputs = Inputs { x: &s.x, t: 0.0, waves: &own.constants, flags: &[] };
        program.lines.run_into(0, &inputs, &mut s.lines, &mut s.out);
        let (at, out) = (&s.x, &s.out);
        let value = |k: Option<usize>| k.map_or(0.0, |k| out[k]);
        let mut apart = false;
        let mut slope = 0;
        for (j, current) in program.currents.iter().enumerate() {
            let (i, q) = (out[current.i], value(current.q));
            let mut stage = i + asked.a * q;
            let place = |row: usize| row * LANES + lane;
            let base = self.row_of_branch(j);
            let near = asked.near.map(|near| (near, lines[place(base)]));
            let (mut line, mut worth) = (near.map_or(0.0, |n| n.1), 0.0);
            while let Some(of) = program.slopes.get(slope).filter(|of| of.branch == j) {
                let (p, row) = (of.port, self.row_of_slope(slope));
                let (g, c) = (value(of.g), value(of.c));
                let both = g + asked.a * c;
                stage += both * (v[p] - at[p]);
                if let Some((near, _)) = near {
                    line += lines[place(row)] * (v[p] - lines[place(p)]);
                    worth += both.abs() * (near.reltol * v[p].abs() + near.vntol);
                }
                lines[place(row)] = both;
                lines[place(row + 1)] = g;
                lines[place(row + 2)] = c;
                slope += 1;
            }
            if let Some((near, _)) = near {
                worth += near.share * stage.abs().max(near.least);
                // (a number that is none is not near anything)
                apart |= !((stage - line).abs() < worth + f64::MIN_POSITIVE);
            }
            lines[place(base)] = stage;
            lines[place(base + 1)] = i;
            lines[place(base + 2)] = q;
        }
        for p in 0..ports {
            lines[p * LANES + lane] = v[p];
            lines[(ports + p) * LANES + lane] = at[p];
        }
        s.voltages = v;
        (moved, apart)
    }
}

fn first_voltages(program: &Program, arguments: &[Vec<f64>], off: bool) -> Vec<f64> {
    let mut start = vec![0.0; program.ports()];
    if off {
        return start;
    }
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
        let ports = self.ports();
        let slope =
            |j: usize, p: usize| self.row_of_slope(self.slope_of[j * ports + p].expect("a slope that is there"));
        let row = match number {
            Number::Voltage(p) => p,
            Number::At(p) => ports + p,
            Number::StageCurrent(j) => self.row_of_branch(j),
            Number::Current(j) => self.row_of_branch(j) + 1,
            Number::Charge(j) => self.row_of_branch(j) + 2,
            Number::StageConductance(j, p) => slope(j, p),
            Number::Conductance(j, p) => slope(j, p) + 1,
            Number::Capacitance(j, p) => slope(j, p) + 2,
        };
        (instance / LANES * self.numbers() + row) * LANES + instance % LANES
    }

    fn operations(&self, _: usize) -> f64 {
        self.program.lines.len() as f64
    }

    fn compiled(&mut self) -> Option<&mut Compiled> {
        Some(self)
    }

    fn add(
        &mut self,
        _: &str,
        _: &[i32],
        _: &HashMap<String, f64>,
        _: &HashMap<String, f64>,
        _: Climate,
        _: &mut dyn FnMut(&str) -> usize,
    ) -> Result<(), String> {
        Err(format!("an instance of {} comes from its text", self.kind))
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
    }

    fn moved(&self, place: &dyn Fn(i32) -> i32) -> Box<dyn Class> {
        let mut other = Compiled::running(self.key.clone(), self.program.clone());
        other.own.clone_from(&self.own);
        other.seats.clone_from(&self.seats);
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
        junction.map_or(f64::INFINITY, |(_, arguments)| arguments[0])
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
        let mut met = Met::default();
        let groups = held.chunks_mut(self.ports().max(1) * LANES).zip(lines.chunks_mut(self.numbers() * LANES));
        self.with_scratch(|s| {
            for (n, (held, lines)) in groups.enumerate() {
                for k in n * LANES..((n + 1) * LANES).min(self.own.len()) {
                    let (moved, apart) = self.one(k, asked, held, lines, s);
                    met.moved |= moved;
                    met.apart |= apart;
                }
            }
        });
        met
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
                (line.g[at], line.c[at]) = (value(slope.g), value(slope.c));
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
        let panels = (v.iter().fold(0.0_f64, |m, v| m.max(v.abs())) / PANEL).ceil().clamp(1.0, MOST_PANELS);
        let (mut sum, mut line, mut at) = (0.0, Line::default(), vec![0.0; v.len()]);
        for panel in 0..panels as usize {
            for (c, weight) in GAUSS {
                let s = (panel as f64 + c) / panels;
                at.iter_mut().zip(v).for_each(|(at, v)| *at = s * v);
                self.at(k, &at, gmin, &mut line);
                for slope in program.slopes.iter().filter(|slope| slope.c.is_some()) {
                    let c = line.c[slope.branch * v.len() + slope.port];
                    sum += weight / panels * c * v[slope.port] * s * voltages[slope.branch];
                }
            }
        }
        sum
    }

    fn output(&self, k: usize, word: &str, v: &[f64], _: &Line) -> Option<f64> {
        let number = self.program.outputs.iter().position(|o| o[0].eq_ignore_ascii_case(word))?;
        let mut x = v.to_vec();
        x.push(0.0);
        Some(self.program.tell(&x, &self.own[k].constants)[self.program.output(number)])
    }

    fn noise(&self, _: usize, _: &[f64], _: &Line, _: &mut dyn FnMut(Noise)) {}

    fn symbols(&self, k: usize, g: &mut Graph, v: &[Id], gmin: Id) -> Vec<(Id, Id)> {
        self.program.symbols(&self.own[k].constants, g, v, gmin)
    }
}

/// Puts an instance of a folded module into the class of its shape among `classes`, which is made where there is none.
pub fn seat(
    classes: &mut Vec<Box<dyn Class>>,
    module: &str,
    name: &str,
    terminals: &[i32],
    folded: &Folded,
    (m, off): (f64, bool),
    inner: &mut dyn FnMut(&str, folded::Kind) -> usize,
) -> Result<(), String> {
    if terminals.len() != folded.terminals {
        return Err(format!("{module} has {} terminals", folded.terminals));
    }
    let mut of = Anonymous::of(module, folded, m)?;
    let own = (std::mem::take(&mut of.constants), std::mem::take(&mut of.arguments));
    if let Some(class) = classes.iter_mut().filter_map(|c| c.compiled()).find(|c| c.is_of(&of.key)) {
        class.join(name, terminals, own, off, inner);
        return Ok(());
    }
    of.constants.clone_from(&own.0); // (how many there are)
    let mut class = Compiled::new(of);
    class.join(name, terminals, own, off, inner);
    classes.push(Box::new(class));
    Ok(())
}

#[cfg(test)]
mod tests;
