//! A program that is written instruction by instruction, where no expression stands behind it.
use super::{Instr, Op, Tape};
use crate::graph::Fun;
use std::collections::HashMap;
use std::ops::Neg;

/// Where a leaf is read from: the inputs of a program.
#[derive(Clone, Copy)]
pub enum Leaf {
    X(usize),
    Wave(usize),
    Flag(usize),
    Time,
}

/// A value of the program.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Value(u32);

/// What has been computed is not computed again.
pub struct Written {
    constants: Vec<f64>,
    code: Vec<Instr>,
    known: Places,
    functions: Vec<Fun>,
    limits: (usize, usize, usize),
}

/// A value, or the negative of one: sums and products of these round as those of the values themselves.
#[derive(Clone, Copy)]
pub struct Signed {
    value: Value,
    negative: bool,
}

impl From<Value> for Signed {
    fn from(value: Value) -> Signed {
        Signed { value, negative: false }
    }
}

impl Neg for Signed {
    type Output = Signed;
    fn neg(self) -> Signed {
        Signed { negative: !self.negative, ..self }
    }
}

impl Written {
    /// A program that knows these constants; their values come with it, in their order. Equal ones have one value: what lies near the
    /// beginning of the workspace is reached in fewer bytes.
    pub fn new(constants: &[f64]) -> (Written, Vec<Value>) {
        let (mut first, mut distinct) = (HashMap::with_capacity(constants.len()), Vec::new());
        let mut one_of = |c: &f64| {
            Value(*first.entry(c.to_bits()).or_insert_with(|| {
                distinct.push(*c);
                distinct.len() as u32 - 1
            }))
        };
        let values = constants.iter().map(&mut one_of).collect();
        let constants = distinct.into_iter().chain([-0.0; 2]).collect();
        let (known, functions) = (Places::default(), Vec::new());
        (Written { constants, code: Vec::new(), known, functions, limits: (0, 0, 0) }, values)
    }

    /// A program that begins with all of `tape` and knows these constants besides: their values, and the tape's outputs.
    pub fn after(tape: &Tape, constants: &[f64]) -> (Written, Vec<Value>, Vec<Value>) {
        let own = tape.constants.len() - 2; // without the signs
        let known: Vec<f64> = tape.constants[..own].iter().chain(constants).copied().collect();
        let (mut p, values) = Written::new(&known);
        let base = p.constants.len();
        let moved = |slot: u32| match slot as usize {
            k if k < own => values[k].0,
            k => (k - tape.constants.len() + base) as u32,
        };
        p.code.extend(tape.code.iter().map(|i| {
            let mut j = *i;
            let operands = [&mut j.a, &mut j.b, &mut j.c].into_iter().take(i.operands().count());
            operands.for_each(|slot| *slot = moved(*slot));
            j
        }));
        p.functions.clone_from(&tape.functions);
        p.limits = tape.limits;
        (p, values[own..].to_vec(), tape.outputs.iter().map(|&slot| Value(moved(slot))).collect())
    }

    fn push(&mut self, op: Op, a: u32, b: u32) -> Value {
        self.instruction(Instr { op, a, b, c: 0 })
    }

    fn instruction(&mut self, i: Instr) -> Value {
        let base = self.constants.len();
        let place = self.known.of(i, &self.code);
        if place == self.code.len() {
            self.code.push(i);
        }
        Value((base + place) as u32)
    }

    pub fn leaf(&mut self, leaf: Leaf) -> Value {
        let mut none = 0;
        let (op, k, limit) = match leaf {
            Leaf::X(k) => (Op::X, k, &mut self.limits.0),
            Leaf::Wave(k) => (Op::Wave, k, &mut self.limits.1),
            Leaf::Flag(k) => (Op::Flag, k, &mut self.limits.2),
            Leaf::Time => (Op::T, 0, &mut none),
        };
        *limit = (*limit).max(k + 1);
        self.push(op, k as u32, 0)
    }

    pub fn add(&mut self, a: Value, b: Value) -> Value {
        self.push(Op::Add, a.0, b.0)
    }

    pub fn sub(&mut self, a: Value, b: Value) -> Value {
        self.push(Op::Sub, a.0, b.0)
    }

    pub fn mul(&mut self, a: Value, b: Value) -> Value {
        self.push(Op::Mul, a.0, b.0)
    }

    pub fn div(&mut self, a: Value, b: Value) -> Value {
        self.push(Op::Div, a.0, b.0)
    }

    /// a where `x` is not less than `y`, else b.
    pub fn where_not_less(&mut self, x: Value, y: Value, a: Value, b: Value) -> Value {
        let condition = self.push(Op::NotLess, x.0, y.0);
        self.instruction(Instr { op: Op::Select, a: condition.0, b: a.0, c: b.0 })
    }

    /// a - b, where b - a has the same value with the other sign; a by itself where there is no b.
    pub fn difference(&mut self, a: Value, b: Option<Value>) -> Signed {
        match b {
            None => a.into(),
            Some(b) if a.0 < b.0 => self.sub(a, b).into(),
            Some(b) => -Signed::from(self.sub(b, a)),
        }
    }

    pub fn times(&mut self, factor: Value, s: Signed) -> Signed {
        Signed { value: self.mul(factor, s.value), ..s }
    }

    /// sum + b, or b where there is none yet.
    pub fn more(&mut self, sum: Option<Signed>, b: Signed) -> Signed {
        let Some(a) = sum else { return b };
        match (a.negative, b.negative) {
            (false, true) => self.sub(a.value, b.value).into(),
            (true, false) => self.sub(b.value, a.value).into(),
            (negative, _) => Signed { value: self.add(a.value, b.value), negative },
        }
    }

    pub fn neg(&mut self, a: Value) -> Value {
        self.push(Op::Neg, a.0, 0)
    }

    /// 0 less a sum.
    pub fn less(&mut self, zero: Value, s: Signed) -> Value {
        if s.negative {
            s.value
        } else {
            self.sub(zero, s.value)
        }
    }

    /// The value itself.
    pub fn plain(&mut self, s: Signed) -> Value {
        if s.negative {
            self.neg(s.value)
        } else {
            s.value
        }
    }

    /// As machine code that leaves `results` in a row (`Tape::run_into`); None where there is no machine code.
    pub fn native(self, results: &[Value]) -> Option<Tape> {
        let outputs: Vec<u32> = results.iter().map(|v| v.0).collect();
        let ends = vec![(self.code.len(), outputs.len())];
        let tape = Tape::interpreted(self.constants, self.code, self.functions, outputs, ends, self.limits);
        let tape = tape.native_into_now();
        (!tape.native.is_empty()).then_some(tape)
    }
}

/// Where instructions stand in a code: open addressing, half of the places empty.
#[derive(Default)]
struct Places(Vec<u32>);

impl Places {
    /// Where this instruction stands; the end of the code, and from now on known there, if it does not.
    fn of(&mut self, i: Instr, code: &[Instr]) -> usize {
        if self.0.len() < 2 * (code.len() + 1) {
            self.0 = vec![u32::MAX; (4 * code.len()).next_power_of_two().max(64)];
            for (k, known) in code.iter().enumerate() {
                let free = self.find(*known, |_| false);
                self.0[free] = k as u32;
            }
        }
        let at = self.find(i, |k| code[k].same(&i));
        if self.0[at] == u32::MAX {
            self.0[at] = code.len() as u32;
        }
        self.0[at] as usize
    }

    fn find(&self, i: Instr, same: impl Fn(usize) -> bool) -> usize {
        let mixed = [i.op as u32, i.a, i.b, i.c]
            .iter()
            // 2^64 over the golden ratio
            .fold(0_u64, |h, &w| (h ^ u64::from(w)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29));
        let mut at = mixed as usize & (self.0.len() - 1);
        while self.0[at] != u32::MAX && !same(self.0[at] as usize) {
            at = (at + 1) & (self.0.len() - 1);
        }
        at
    }
}
