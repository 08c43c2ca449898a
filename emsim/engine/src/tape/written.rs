//! A program that is written instruction by instruction, where no expression stands behind it.
use super::{Instr, Op, Tape};
use crate::graph::Fun;

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

pub struct Written {
    constants: Vec<f64>,
    code: Vec<Instr>,
    functions: Vec<Fun>,
    limits: (usize, usize, usize),
}

impl Written {
    /// A program that knows these constants; their values come with it, in their order.
    pub fn new(constants: &[f64]) -> (Written, Vec<Value>) {
        let values = (0..constants.len() as u32).map(Value).collect();
        let constants = constants.iter().copied().chain([-0.0; 2]).collect();
        (Written { constants, code: Vec::new(), functions: Vec::new(), limits: (0, 0, 0) }, values)
    }

    /// A program that begins with all of `tape` and knows these constants besides: their values, and the tape's outputs.
    pub fn after(tape: &Tape, constants: &[f64]) -> (Written, Vec<Value>, Vec<Value>) {
        let own = tape.constants.len() - 2; // without the signs
        let known: Vec<f64> = tape.constants[..own].iter().chain(constants).copied().collect();
        let (mut p, values) = Written::new(&known);
        let base = p.constants.len();
        let moved = |slot: u32| match slot as usize {
            k if k < own => slot,
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
        self.code.push(i);
        Value((self.constants.len() + self.code.len() - 1) as u32)
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

    pub fn neg(&mut self, a: Value) -> Value {
        self.push(Op::Neg, a.0, 0)
    }

    /// As machine code that leaves `results` in a row (`Tape::run_into`); None where there is no machine code.
    pub fn native(self, results: &[Value]) -> Option<Tape> {
        let outputs: Vec<u32> = results.iter().map(|v| v.0).collect();
        let ends = vec![(self.code.len(), outputs.len())];
        let tape = Tape {
            constants: self.constants,
            code: self.code,
            functions: self.functions,
            outputs,
            ends,
            limits: self.limits,
            native: Vec::new(),
            into: false,
        };
        let tape = tape.native_into();
        tape.native[0].is_some().then_some(tape)
    }
}
