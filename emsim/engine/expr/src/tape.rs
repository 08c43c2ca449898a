//! A set of expressions as one straight scalar program: operands first, every shared subexpression once.
//!
//! Slots: constants first (written once, when the workspace is made), two signs for the machine code, then one slot per
//! instruction in order. `native` turns the program into machine code where it can; its workspace is shorter.
//! Calls of the mathematical library are brought together: first all that need no other call, then the next.
use crate::graph::{Fun, Graph, Id, Node};
use rustc_hash::FxHashMap as HashMap;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::sync::OnceLock;

pub mod batch;
mod loops;
mod native;
mod sizes;
mod trig;
mod written;

use native::Native;
pub use native::{Code, Move, To};
pub use trig::{sin_cos, vectors};
pub use written::{Leaf, Signed, Value, Written};

/// Machine code that takes long to make (Cranelift: an instruction costs as much as it saves in thousands of runs): the part is
/// interpreted until it has run so often that the code pays. Outputs lie at the same places of the workspace either way.
#[derive(Default)]
struct Later {
    runs: AtomicU32,
    made: OnceLock<Option<Native>>,
}

impl Later {
    const PAYS: u32 = 7500; // runs that machine code is worth (see above)

    #[inline]
    fn native(&self, runs: u32, make: impl FnOnce() -> Option<Native>) -> Option<&Native> {
        match self.made.get() {
            Some(made) => made.as_ref(),
            None if self.runs.fetch_add(runs, Relaxed) < Later::PAYS => None,
            None => self.made.get_or_init(make).as_ref(),
        }
    }
}

/// What the leaves read.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    pub x: &'a [f64],
    pub t: f64,
    pub waves: &'a [f64],
    pub flags: &'a [f64],
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Op {
    X,
    T,
    Wave,
    Flag,
    Neg,
    Add,
    Sub,
    Mul,
    Div,
    Pow,
    Powi,
    Atan2,
    Sin,
    Cos,
    Exp,
    Sqrt,
    Call,
    Select,
    NotLess, // all bits, or none: a condition
    // of a loop: its arguments one after the other (a: the value, b: number, c: room that it wants), itself (a: number of the loop, b:
    // of arguments, c: of results), and its results one after the other (a: number, b: of arguments)
    Argument,
    Loop,
    Result,
    Free,
}

#[derive(Clone, Copy, Debug)]
struct Instr {
    op: Op,
    a: u32,
    b: u32,
    c: u32,
}

impl Instr {
    fn same(&self, other: &Instr) -> bool {
        (self.op, self.a, self.b, self.c) == (other.op, other.a, other.b, other.c)
    }

    /// Slots that it reads.
    fn operands(&self) -> impl Iterator<Item = u32> {
        let n = match self.op {
            Op::X | Op::T | Op::Wave | Op::Flag | Op::Free | Op::Loop | Op::Result => 0,
            Op::Neg | Op::Powi | Op::Sin | Op::Cos | Op::Exp | Op::Sqrt | Op::Call | Op::Argument => 1,
            Op::Add | Op::Sub | Op::Mul | Op::Div | Op::Pow | Op::Atan2 | Op::NotLess => 2,
            Op::Select => 3,
        };
        [self.a, self.b, self.c].into_iter().take(n)
    }
}

/// Compiled program; never changes while it runs. Scratch lives in the workspace of `workspace()`.
pub struct Tape {
    constants: Vec<f64>,
    code: Vec<Instr>,
    functions: Vec<Fun>,
    outputs: Vec<u32>,
    places: Vec<u32>,              // where in the workspace outputs lie: interpreted, the same
    length: usize,                 // of the workspace
    ends: Vec<(usize, usize)>,     // of each part: end of its code, end of its outputs
    limits: (usize, usize, usize), // highest index + 1 of unknowns, waves, flags: checked once per call
    native: Vec<Native>,           // of each part, or of none
    later: Vec<Later>,             // of each part, or of none: machine code once it pays
    into: bool,                    // results are wanted in a row, see `native_into`
}

impl Tape {
    pub fn new(g: &Graph, outs: &[Id]) -> Tape {
        Tape::in_parts(g, &[(outs, true)])
    }

    /// A program in parts, run one by one and in order (see `run_part`): what a part computes serves the later ones,
    /// unless it is private (`false`: its leaves may change before the next part reads them).
    pub fn in_parts(g: &Graph, parts: &[(&[Id], bool)]) -> Tape {
        let outs: Vec<Id> = parts.iter().flat_map(|p| p.0).copied().collect();
        let order = g.reachable(&outs);
        let mut constants: Vec<f64> = order.iter().filter_map(|&id| g.value(id)).collect();
        constants.extend([-0.0; 2]);
        let base = constants.len() as u32;
        let mut slot: HashMap<Id, u32> = HashMap::with_capacity_and_hasher(order.len(), Default::default());
        let (mut code, mut functions) = (Vec::new(), Vec::new());
        let mut limits = (0, 0, 0);
        for (k, id) in order.iter().filter(|&&id| g.value(id).is_some()).enumerate() {
            slot.insert(*id, k as u32);
        }
        let (mut outputs, mut ends) = (Vec::with_capacity(outs.len()), Vec::new());
        let mut known: HashMap<(u32, Id), u32> = HashMap::default(); // slots of their first results
        let read = loops::read(g, &order);
        for &(part, kept) in parts {
            let order = if parts.len() > 1 { g.reachable(part) } else { order.clone() };
            let mut private = Vec::new();
            for id in calls_together(g, order) {
                if slot.contains_key(&id) {
                    continue;
                }
                let node = g.node(id);
                let s = |o: Id| slot[&o];
                if let Node::Result(number, k, list) = node {
                    let read = &read[&(number, list)];
                    let mut made = || loops::called(number, read, g.listed(list).into_iter().map(s), base, &mut code);
                    let first = *known.entry((number, list)).or_insert_with(&mut made);
                    slot.insert(id, first + loops::place(number, k, read));
                    if !kept {
                        private.push(id);
                    }
                    continue;
                }
                let (op, a, b, c) = match node {
                    Node::Unknown(i) => {
                        limits.0 = limits.0.max(i as usize + 1);
                        (Op::X, i, 0, 0)
                    }
                    Node::Wave(k) => {
                        limits.1 = limits.1.max(k as usize + 1);
                        (Op::Wave, k, 0, 0)
                    }
                    Node::Flag(k) => {
                        limits.2 = limits.2.max(k as usize + 1);
                        (Op::Flag, k, 0, 0)
                    }
                    Node::Call(f, a) if !matches!(f, Fun::Sin | Fun::Cos | Fun::Exp | Fun::Sqrt) => {
                        functions.push(f);
                        (Op::Call, s(a), functions.len() as u32 - 1, 0)
                    }
                    Node::Join(..) => continue,
                    node => operation(node, s),
                };
                slot.insert(id, base + code.len() as u32);
                code.push(Instr { op, a, b, c });
                if !kept {
                    private.push(id);
                }
            }
            outputs.extend(part.iter().map(|o| slot[o]));
            ends.push((code.len(), outputs.len()));
            for id in private {
                slot.remove(&id);
            }
            if !kept {
                known.clear();
            }
        }
        Tape::interpreted(constants, code, functions, outputs, ends, limits)
    }

    fn interpreted(
        constants: Vec<f64>,
        code: Vec<Instr>,
        functions: Vec<Fun>,
        outputs: Vec<u32>,
        ends: Vec<(usize, usize)>,
        limits: (usize, usize, usize),
    ) -> Tape {
        let (places, length) = (outputs.clone(), constants.len() + code.len());
        Tape {
            constants,
            code,
            functions,
            outputs,
            places,
            length,
            ends,
            limits,
            native: Vec::new(),
            later: Vec::new(),
            into: false,
        }
    }

    /// The same as machine code, where there is any for this machine. For programs that run often.
    pub fn native(mut self) -> Tape {
        // shorter programs are interpreted: calling them would cost what they do
        if self.code.len() < 8 {
            return self;
        }
        if Code::chosen() == Ok(Code::Cranelift) {
            self.later = self.ends.iter().map(|_| Later::default()).collect();
            return self;
        }
        self.native_now()
    }

    /// ... at once, however long it takes to make.
    fn native_now(mut self) -> Tape {
        if Code::chosen() == Ok(Code::Cranelift) {
            let made: Option<Vec<Native>> = (0..self.ends.len()).map(|part| self.make(part)).collect();
            self.native = made.unwrap_or_default();
            return self;
        }
        let (homes, free) = self.homes();
        let part = |part| Native::new(&self.part(part, &homes, free));
        let Some(native) = (0..self.ends.len()).map(part).collect::<Option<Vec<Native>>>() else { return self };
        self.length = native.iter().map(|n| n.length as usize).max().unwrap_or(0);
        if !self.into {
            self.places = self.outputs.iter().map(|&slot| homes[slot as usize]).collect();
        }
        self.native = native;
        self
    }

    /// What the machine code of a part is made from.
    fn part<'a>(&'a self, part: usize, homes: &'a [u32], free: u32) -> native::Part<'a> {
        let (base, from) = (self.constants.len(), self.start(part));
        native::Part {
            code: &self.code[from..self.ends[part].0],
            first: base + from,
            homes,
            free,
            functions: &self.functions,
            sign: base as u32 - 2,
            results: if self.into { &self.outputs[self.range(part)] } else { &[] },
        }
    }

    /// Where machine code has the values of slots in its workspace: constants at the head, behind them what is read from
    /// outside the part that computes it, the others nowhere; and from where on the workspace is free.
    fn homes(&self) -> (Vec<u32>, u32) {
        let base = self.constants.len();
        let mut homes: Vec<u32> = (0..base as u32).collect();
        homes.resize(base + self.code.len(), native::NOWHERE);
        let mut free = base as u32;
        let mut settle = |slot: u32| {
            let home = &mut homes[slot as usize];
            if *home == native::NOWHERE {
                (*home, free) = (free, free + 1);
            }
        };
        if !self.into {
            self.outputs.iter().copied().for_each(&mut settle);
        }
        for (part, &(to, _)) in self.ends.iter().enumerate() {
            let from = self.start(part);
            let results = self.outputs[self.range(part)].iter().copied();
            let read = self.code[from..to].iter().flat_map(Instr::operands).chain(results);
            read.filter(|&slot| (slot as usize) < base + from).for_each(&mut settle);
        }
        (homes, free)
    }

    /// The machine code of a part, if there is any by now.
    #[inline]
    fn code(&self, part: usize) -> Option<&Native> {
        self.code_for(part, 1)
    }

    #[inline]
    fn code_for(&self, part: usize, runs: u32) -> Option<&Native> {
        if let Some(native) = self.native.get(part) {
            return Some(native);
        }
        self.later.get(part)?.native(runs, || self.make(part))
    }

    /// Is the first part interpreted, once more so many times?
    pub fn interprets(&self, runs: u32) -> bool {
        self.code_for(0, runs).is_none()
    }

    /// Machine code on the interpreter's workspace, which has a place for every slot.
    #[cold]
    fn make(&self, part: usize) -> Option<Native> {
        let (homes, _) = self.homes();
        let same = |(slot, &home): (usize, &u32)| if home == native::NOWHERE { home } else { slot as u32 };
        let homes: Vec<u32> = homes.iter().enumerate().map(same).collect();
        Native::new(&self.part(part, &homes, self.length as u32))
    }

    /// Machine code that leaves the results of a part one after the other, for `run_into`; not in slots.
    pub fn native_into(mut self) -> Tape {
        self.into = true;
        self.native()
    }

    /// The only part of a `native_into` as machine code on four sets of numbers at once, where there is such.
    pub fn four(&self) -> Option<Four> {
        assert!(self.into && self.ends.len() == 1);
        let (homes, free) = self.homes();
        let native = Native::four(&self.part(0, &homes, free))?;
        let reads_time = self.code.iter().any(|i| matches!(i.op, Op::T));
        let constants = self.constants.clone();
        (!reads_time).then_some(Four { native, constants, limits: self.limits, results: self.outputs.len() })
    }

    fn native_into_now(mut self) -> Tape {
        self.into = true;
        self.native_now()
    }

    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }

    pub fn len(&self) -> usize {
        self.code.len()
    }

    /// The value of a place that is a constant.
    pub fn constant(&self, place: u32) -> Option<f64> {
        self.constants.get(place as usize).copied()
    }

    /// Free symbols left in the program make it meaningless.
    pub fn has_free_symbols(&self) -> bool {
        self.code.iter().any(|i| matches!(i.op, Op::Free))
    }

    pub fn workspace(&self) -> Vec<f64> {
        let mut w = self.constants.clone();
        w.resize(self.length, 0.0);
        w
    }

    /// Runs the program; the results are read with `output`.
    #[inline]
    pub fn run(&self, inp: &Inputs, w: &mut [f64]) {
        for part in 0..self.ends.len() {
            self.run_part(part, inp, w);
        }
    }

    /// Runs one part; those before it have run, with the same inputs but for what this part is the first to read.
    #[inline]
    pub fn run_part(&self, part: usize, inp: &Inputs, w: &mut [f64]) {
        if let Some(native) = self.code(part) {
            self.check(inp, w);
            // SAFETY: checked; there are no results beside the slots
            assert!(!self.into);
            return unsafe { native.run(inp, w, std::ptr::null_mut()) };
        }
        self.interpret(part, inp, w);
    }

    /// Runs one part of a `native_into` and leaves its results in `out`.
    #[inline(always)]
    pub fn run_into(&self, part: usize, inp: &Inputs, w: &mut [f64], out: &mut [f64]) {
        let places = self.part_places(part);
        if let Some(native) = self.code(part).filter(|_| self.into) {
            self.check(inp, w);
            assert!(out.len() >= places.len());
            // SAFETY: checked
            return unsafe { native.run(inp, w, out.as_mut_ptr()) };
        }
        self.interpret_into(part, inp, w, out);
    }

    #[inline(never)]
    fn interpret_into(&self, part: usize, inp: &Inputs, w: &mut [f64], out: &mut [f64]) {
        self.interpret(part, inp, w);
        for (o, &place) in out.iter_mut().zip(self.part_places(part)) {
            *o = w[place as usize];
        }
    }

    /// The machine code of the only part of a `native_into`, to be run on these leaves again and again; None where there is
    /// none.
    pub fn again<'a>(
        &'a self,
        x: &'a mut [f64],
        waves: &'a [f64],
        flags: &'a [f64],
        slots: &'a mut [f64],
    ) -> Option<Again<'a>> {
        let native = self.code(0).filter(|_| self.into && self.ends.len() == 1)?;
        self.check(&Inputs { x, t: 0.0, waves, flags }, slots);
        Some(Again { native, x, waves, flags, slots, results: self.outputs.len() })
    }

    /// The only part of a `native_into` as the stages of a method: `moves` over a table of rows of `width`, whose element `h`
    /// is the length of the step and where the times of the runs stand from `times` on; the state is at leaf `y`.
    pub fn sequence(&self, moves: &[Move], width: usize, y: usize, h: usize, times: usize) -> Option<Sequence> {
        let results = self.outputs.len();
        assert!(width % 4 == 0 && results <= width && self.ends.len() == 1 && self.into);
        let rows = moves.iter().flat_map(|m| {
            let to = m.to.iter().filter_map(|to| if let To::Row(row) = to { Some(*row) } else { None });
            m.row.iter().map(|c| c.0).chain(m.from).chain(m.run).chain(to)
        });
        let runs = moves.iter().filter(|m| m.run.is_some()).count();
        let length = rows.map(|row| (row + 1) * width).chain([h + 1, times + runs]).max().unwrap_or(0);
        let (homes, free) = self.homes();
        let native = Native::sequence(&self.part(0, &homes, free), moves, width, y, h)?;
        (native.length as usize <= self.length).then_some(Sequence { native, length, times, leaves: y + width })
    }

    fn interpret(&self, part: usize, inp: &Inputs, w: &mut [f64]) {
        self.run_code(self.start(part), self.ends[part].0, inp, w);
    }

    /// Does it read a wave of this number or a higher one?
    pub fn reads_waves_from(&self, first: usize) -> bool {
        self.limits.1 > first
    }

    #[inline(always)]
    fn check(&self, inp: &Inputs, w: &[f64]) {
        assert!(w.len() == self.length);
        self.check_leaves(inp);
    }

    #[inline(always)]
    fn check_leaves(&self, inp: &Inputs) {
        assert!(inp.x.len() >= self.limits.0 && inp.waves.len() >= self.limits.1 && inp.flags.len() >= self.limits.2);
    }

    /// Where in the workspace the results of one part lie.
    pub fn part_places(&self, part: usize) -> &[u32] {
        &self.places[self.range(part)]
    }

    /// The outputs of one part.
    fn range(&self, part: usize) -> std::ops::Range<usize> {
        let from = if part > 0 { self.ends[part - 1].1 } else { 0 };
        from..self.ends[part].1
    }

    /// Where the code of a part begins.
    fn start(&self, part: usize) -> usize {
        if part > 0 {
            self.ends[part - 1].0
        } else {
            0
        }
    }

    #[inline]
    fn run_code(&self, from: usize, to: usize, inp: &Inputs, w: &mut [f64]) {
        let base = self.constants.len();
        assert!(w.len() >= base + to);
        self.check_leaves(inp);
        for (k, i) in self.code[from..to].iter().enumerate() {
            let k = from + k;
            // SAFETY: operand slots precede the instruction's own by construction, input indices are below `limits`
            unsafe {
                let v = |s: u32| *w.get_unchecked(s as usize);
                let r = match i.op {
                    Op::X => *inp.x.get_unchecked(i.a as usize),
                    Op::T => inp.t,
                    Op::Wave => *inp.waves.get_unchecked(i.a as usize),
                    Op::Flag => *inp.flags.get_unchecked(i.a as usize),
                    Op::Neg => -v(i.a),
                    Op::Add => v(i.a) + v(i.b),
                    Op::Sub => v(i.a) - v(i.b),
                    Op::Mul => v(i.a) * v(i.b),
                    Op::Div => v(i.a) / v(i.b),
                    Op::Pow => v(i.a).powf(v(i.b)),
                    Op::Powi => v(i.a).powi(i.b as i32),
                    Op::Atan2 => v(i.a).atan2(v(i.b)),
                    Op::Sin => trig::sin_cos(v(i.a)).0,
                    Op::Cos => trig::sin_cos(v(i.a)).1,
                    Op::Exp => v(i.a).exp(),
                    Op::Sqrt => v(i.a).sqrt(),
                    Op::Call => self.functions[i.b as usize].apply(v(i.a)),
                    Op::Select => {
                        if v(i.a) != 0.0 {
                            v(i.b)
                        } else {
                            v(i.c)
                        }
                    }
                    Op::NotLess => f64::from_bits(if v(i.a) < v(i.b) { 0 } else { u64::MAX }),
                    Op::Argument => v(i.a),
                    Op::Loop => loops::run(i, base + k, w),
                    Op::Result => continue, // the loop has put it there
                    Op::Free => f64::NAN,
                };
                *w.get_unchecked_mut(base + k) = r;
            }
        }
    }

    #[inline]
    pub fn output(&self, w: &[f64], k: usize) -> f64 {
        w[self.places[k] as usize]
    }

    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Evaluates once, with a workspace of its own. For assembly and tests, not for the inner loop.
    pub fn eval(&self, inp: &Inputs) -> Vec<f64> {
        let mut w = self.workspace();
        self.run(inp, &mut w);
        (0..self.outputs.len()).map(|k| self.output(&w, k)).collect()
    }
}

/// A program and what it runs on, looked up and checked once.
pub struct Again<'a> {
    native: &'a Native,
    x: &'a mut [f64],
    waves: &'a [f64],
    flags: &'a [f64],
    slots: &'a mut [f64],
    results: usize,
}

/// What `Tape::four` makes.
pub struct Four {
    native: Native,
    constants: Vec<f64>,
    limits: (usize, usize, usize),
    results: usize,
}

impl Four {
    pub fn workspace(&self) -> Vec<[f64; 4]> {
        let mut w: Vec<[f64; 4]> = self.constants.iter().map(|&c| [c; 4]).collect();
        w.resize(self.native.length as usize, [0.0; 4]);
        w
    }

    /// Runs the program on unknowns and waves; `out`: its results.
    #[inline]
    pub fn run(&self, x: &[[f64; 4]], waves: &[[f64; 4]], w: &mut [[f64; 4]], out: &mut [[f64; 4]]) {
        assert!(w.len() >= self.native.length as usize && out.len() >= self.results);
        assert!(x.len() >= self.limits.0 && waves.len() >= self.limits.1 && self.limits.2 == 0);
        let out = out.as_flattened_mut().as_mut_ptr();
        let inputs = Inputs { x: x.as_flattened(), t: 0.0, waves: waves.as_flattened(), flags: &[] };
        // SAFETY: the lengths were checked
        unsafe { self.native.run(&inputs, w.as_flattened_mut(), out) };
    }
}

/// What `Tape::sequence` makes.
pub struct Sequence {
    native: Native,
    length: usize,
    times: usize,
    leaves: usize,
}

impl Again<'_> {
    #[inline]
    pub fn run_sequence(&mut self, sequence: &Sequence, table: &mut [f64]) {
        assert!(table.len() >= sequence.length && self.x.len() >= sequence.leaves);
        let inputs = Inputs { x: &[], t: 0.0, waves: self.waves, flags: self.flags };
        let rows = table.as_mut_ptr();
        // SAFETY: checked by who made it and by who made the sequence of the same program, lengths above
        unsafe {
            let times = rows.add(sequence.times);
            sequence.native.run_sequence(self.x.as_mut_ptr(), &inputs, self.slots, times, rows);
        }
    }

    #[inline]
    pub fn x(&mut self) -> &mut [f64] {
        self.x
    }

    #[inline]
    pub fn run(&mut self, t: f64, out: &mut [f64]) {
        assert!(out.len() >= self.results);
        let inputs = Inputs { x: self.x, t, waves: self.waves, flags: self.flags };
        // SAFETY: checked by who made it, and no length has changed
        unsafe { self.native.run(&inputs, self.slots, out.as_mut_ptr()) };
    }
}

/// The operation of a node that is read as it is, with the slots of its operands.
fn operation(node: Node, s: impl Fn(Id) -> u32) -> (Op, u32, u32, u32) {
    match node {
        Node::Time => (Op::T, 0, 0, 0),
        Node::Neg(a) => (Op::Neg, s(a), 0, 0),
        Node::Add(a, b) => (Op::Add, s(a), s(b), 0),
        Node::Sub(a, b) => (Op::Sub, s(a), s(b), 0),
        Node::Mul(a, b) => (Op::Mul, s(a), s(b), 0),
        Node::Div(a, b) => (Op::Div, s(a), s(b), 0),
        Node::Pow(a, b) => (Op::Pow, s(a), s(b), 0),
        Node::Powi(a, n) => (Op::Powi, s(a), n as u32, 0),
        Node::Atan2(a, b) => (Op::Atan2, s(a), s(b), 0),
        Node::Call(Fun::Sin, a) => (Op::Sin, s(a), 0, 0),
        Node::Call(Fun::Cos, a) => (Op::Cos, s(a), 0, 0),
        Node::Call(Fun::Exp, a) => (Op::Exp, s(a), 0, 0),
        Node::Call(Fun::Sqrt, a) => (Op::Sqrt, s(a), 0, 0),
        Node::Select(c, a, b) => (Op::Select, s(c), s(a), s(b)),
        Node::NotLess(a, b) => (Op::NotLess, s(a), s(b), 0),
        // a free symbol that nobody substituted: no value exists
        Node::Symbol(_) => (Op::Free, 0, 0, 0),
        _ => unreachable!("constants and results have their slots already"),
    }
}

/// `order` with the calls of functions brought together; operands still come first.
fn calls_together(g: &Graph, order: Vec<Id>) -> Vec<Id> {
    let calls = |id: Id| {
        matches!(g.node(id), Node::Call(f, _) if f != Fun::Sqrt)
            || matches!(g.node(id), Node::Pow(..) | Node::Atan2(..) | Node::Result(..))
    };
    // twice the calls before it, plus 1 for a call
    let mut rank: HashMap<Id, usize> = HashMap::with_capacity_and_hasher(order.len(), Default::default());
    let mut ranked: Vec<Vec<Id>> = Vec::new();
    for id in order {
        let before = g.node(id).operands().map(|o| rank[&o].next_multiple_of(2)).max().unwrap_or(0);
        let own = before + usize::from(calls(id));
        rank.insert(id, own);
        ranked.resize_with(ranked.len().max(own + 1), Vec::new);
        ranked[own].push(id);
    }
    ranked.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::derive::{gradient, substitute, tangent};

    fn value(g: &Graph, id: Id, x: &[f64]) -> f64 {
        Tape::new(g, &[id]).eval(&Inputs { x, t: 0.0, waves: &[], flags: &[] })[0]
    }

    /// Whole numbers below n, the same in every run.
    fn random(mut seed: u64) -> impl FnMut(usize) -> usize {
        move |n| {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            (seed >> 33) as usize % n
        }
    }

    /// One expression more of those in a pool.
    fn grow(g: &mut Graph, pool: &mut Vec<Id>, random: &mut impl FnMut(usize) -> usize, calls: &[Fun]) {
        let [a, b, c] = [(); 3].map(|()| pool[random(pool.len())]);
        pool.push(match random(16) {
            0 | 1 => g.add(a, b),
            2 | 3 => g.sub(a, b),
            4..=6 => g.mul(a, b),
            7 => g.div(a, b),
            8 => g.neg(a),
            9 => {
                let c = g.not_less(c, a);
                g.select(c, a, b)
            }
            10..=12 => g.call(calls[random(calls.len())], a),
            13 => g.powi(a, random(12) as i32 - 2),
            14 => g.atan2(a, b),
            _ => g.pow(a, b),
        });
    }

    /// every function's derivative against a central difference, reverse and forward mode alike
    #[test]
    fn derivatives_match_differences() {
        let funs = [
            Fun::Sin,
            Fun::Cos,
            Fun::Tan,
            Fun::Asin,
            Fun::Acos,
            Fun::Atan,
            Fun::Sinh,
            Fun::Cosh,
            Fun::Tanh,
            Fun::Asinh,
            Fun::Atanh,
            Fun::Exp,
            Fun::Log,
            Fun::Sqrt,
            Fun::Abs,
        ];
        for f in funs {
            let mut g = Graph::new();
            let (x, y) = (g.unknown(0), g.unknown(1));
            let a = g.call(f, x);
            let p = g.pow(y, x);
            let q = g.atan2(a, y);
            let s = g.mul(p, q);
            let d = g.powi(y, 3);
            let r = g.div(s, d);
            let r = g.sub(r, x);
            let at = [0.37, 0.81];
            let d = gradient(&mut g, r, &[x, y]);
            for k in 0..2 {
                let e = 1e-6;
                let (mut hi, mut lo) = (at, at);
                hi[k] += e;
                lo[k] -= e;
                let diff = (value(&g, r, &hi) - value(&g, r, &lo)) / (2.0 * e);
                let exact = value(&g, d[k], &at);
                assert!((diff - exact).abs() < 1e-7 * (1.0 + exact.abs()), "{f:?}: {diff} {exact}");
                let one = g.constant(1.0);
                let leaf = [x, y][k];
                let fwd = tangent(&mut g, &[r], &[(leaf, one)])[0];
                assert!((value(&g, fwd, &at) - exact).abs() < 1e-12 * (1.0 + exact.abs()));
            }
        }
    }

    /// the same program on four sets of numbers agrees to the bit with the interpreter on each; an exponential to its last place
    #[test]
    fn machine_code_of_four_agrees_with_the_interpreter() {
        let mut random = random(0x9e37_79b9_7f4a_7c15);
        for round in 0..100 {
            let mut g = Graph::new();
            let mut pool: Vec<Id> = (0..4).map(|i| g.unknown(i)).collect();
            pool.extend([g.wave(0), g.wave(1), g.constant(0.7), g.constant(-2.5)]);
            let calls = [Fun::Cos, Fun::Tanh, Fun::Log, Fun::Atan, Fun::Sqrt];
            (0..40 + round).for_each(|_| grow(&mut g, &mut pool, &mut random, &calls));
            let mut outs: Vec<Id> = (0..9).map(|_| pool[random(pool.len())]).collect();
            let growing = g.unknown(3);
            outs.push(g.call(Fun::Exp, growing));
            let tape = Tape::new(&g, &outs).native_into();
            let Some(four) = tape.four() else { return };
            let x: Vec<[f64; 4]> = (0..4).map(|k| [0.3, -1.7, 40.0, 0.0].map(|v| v + 0.25 * k as f64)).collect();
            let waves = [[2.0, 0.5, -3.0, 1.0], [0.1, 0.2, 0.3, 0.4]];
            let (mut w, mut out) = (four.workspace(), vec![[0.0; 4]; outs.len()]);
            four.run(&x, &waves, &mut w, &mut out);
            for lane in 0..4 {
                let own = |rows: &[[f64; 4]]| rows.iter().map(|r| r[lane]).collect::<Vec<f64>>();
                let (x, waves) = (own(&x), own(&waves));
                let inputs = Inputs { x: &x, t: 0.0, waves: &waves, flags: &[] };
                let slow = Tape::new(&g, &outs).eval(&inputs);
                for (k, (got, want)) in own(&out).into_iter().zip(slow).enumerate() {
                    let near = k + 1 == outs.len() && (got - want).abs() <= 4e-16 * want;
                    let same = got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan());
                    assert!(near || same, "round {round}, result {k}, lane {lane}: {got:?} {want:?}");
                }
            }
        }
    }

    /// machine code and interpreter agree to the bit, on expressions that need more values than there are registers
    #[test]
    fn machine_code_agrees_with_the_interpreter() {
        let mut random = random(0x2545_f491_4f6c_dd1d);
        for round in 0..200 {
            let mut g = Graph::new();
            let mut pool: Vec<Id> = (0..4).map(|i| g.unknown(i)).collect();
            pool.extend([g.time(), g.wave(0), g.flag(0), g.constant(0.7), g.constant(-2.5)]);
            let calls = [Fun::Sin, Fun::Cos, Fun::Tanh, Fun::Exp, Fun::Atan, Fun::Sqrt];
            (0..40 + round).for_each(|_| grow(&mut g, &mut pool, &mut random, &calls));
            let outs: Vec<Id> = (0..12).map(|_| pool[random(pool.len())]).collect();
            let parts: [(&[Id], bool); 3] = [(&outs[..4], true), (&outs[4..8], false), (&outs[8..], true)];
            let slow = Tape::in_parts(&g, &parts);
            let fast = Tape::in_parts(&g, &parts).native_now();
            let row = Tape::in_parts(&g, &parts).native_into_now();
            assert!(Code::chosen() == Ok(Code::Interpreted) || !fast.native.is_empty());
            // (the second argument is beyond what the code's own sines take)
            for (flag, x) in [(0.0, [0.3, -1.2, 2.1, 0.05]), (1.0, [-7.3, 1e7, 2.1, 40.0])] {
                let inp = Inputs { x: &x, t: 0.4, waves: &[3.3], flags: &[flag] };
                let (mut a, mut b, mut c) = (slow.workspace(), fast.workspace(), row.workspace());
                slow.run(&inp, &mut a);
                fast.run(&inp, &mut b);
                let mut results = [0.0; 12];
                for part in 0..3 {
                    row.run_into(part, &inp, &mut c, &mut results[4 * part..]);
                }
                for k in 0..outs.len() {
                    let x = slow.output(&a, k);
                    for y in [fast.output(&b, k), results[k]] {
                        assert!(x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()), "{round} {k}: {x} {y}");
                    }
                }
            }
        }
    }

    /// many sets of numbers side by side give what each gives by itself, to the bit
    #[test]
    fn many_sets_agree_with_each_by_itself() {
        let mut g = Graph::new();
        let mut pool: Vec<Id> = (0..4).map(|i| g.unknown(i)).collect();
        pool.extend([g.wave(0), g.wave(1), g.constant(0.7), g.constant(-2.5)]);
        let mut random = random(0x9e37_79b9_7f4a_7c15);
        let calls = [Fun::Sin, Fun::Cos, Fun::Tanh, Fun::Log, Fun::Exp, Fun::Atan, Fun::Sqrt];
        (0..200).for_each(|_| grow(&mut g, &mut pool, &mut random, &calls));
        let tape = Tape::new(&g, &pool[8..]);
        for width in 1..=batch::WIDEST {
            let row =
                |k: usize| (0..width).map(move |b| [0, 1, 2, 3].map(|l| ((17 * k + 4 * b + l) as f64).sin() * 3.0));
            let (x, waves): (Vec<_>, Vec<_>) = ((0..4).flat_map(row).collect(), (4..6).flat_map(row).collect());
            let mut w = tape.workspace_of_many();
            tape.run_many(width, &x, &waves, &mut w);
            for (b, l) in (0..width).flat_map(|b| (0..4).map(move |l| (b, l))) {
                let own = |rows: &[[f64; 4]]| rows.iter().skip(b).step_by(width).map(|r| r[l]).collect::<Vec<f64>>();
                let want = tape.eval(&Inputs { x: &own(&x), t: 0.0, waves: &own(&waves), flags: &[] });
                for (k, want) in want.into_iter().enumerate() {
                    let got = tape.of_many(k, width, &w)[b][l];
                    assert!(got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan()), "{k}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn substitution_folds() {
        let mut g = Graph::new();
        let (x, s) = (g.unknown(0), g.symbol());
        let sum = g.add(x, s);
        let y = g.call(Fun::Sin, sum);
        let zero = g.constant(0.0);
        let out = substitute(&mut g, &[y], &[(s, zero)])[0];
        let sx = g.call(Fun::Sin, x);
        assert_eq!(out, sx);
        assert!(Tape::new(&g, &[y]).has_free_symbols());
    }

    #[test]
    fn nan_in_the_branch_not_taken_stays_there() {
        let mut g = Graph::new();
        let x = g.unknown(0);
        let f = g.flag(0);
        let r = g.call(Fun::Sqrt, x);
        let one = g.constant(1.0);
        let y = g.select(f, r, one);
        let d = gradient(&mut g, y, &[x])[0];
        let inp = Inputs { x: &[-1.0], t: 0.0, waves: &[], flags: &[0.0] };
        assert_eq!(Tape::new(&g, &[y]).eval(&inp), vec![1.0]);
        // the derivative is selected after it met sqrt's own: 0 * NaN must not appear
        assert_eq!(Tape::new(&g, &[d]).eval(&inp), vec![0.0]);
    }
}
