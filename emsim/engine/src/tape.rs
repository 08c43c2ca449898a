//! A set of expressions as one straight scalar program: operands first, every shared subexpression once.
//!
//! Slots: constants first (written once, when the workspace is made), then one slot per instruction in order.
use crate::graph::{Fun, Graph, Id, Node};
use std::collections::HashMap;

/// What the leaves read.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    pub x: &'a [f64],
    pub t: f64,
    pub waves: &'a [f64],
    pub flags: &'a [f64],
}

#[derive(Clone, Copy, Debug)]
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
    Free,
}

#[derive(Clone, Copy, Debug)]
struct Instr {
    op: Op,
    a: u32,
    b: u32,
    c: u32,
}

/// Compiled program; never changes while it runs. Scratch lives in the workspace of `workspace()`.
pub struct Tape {
    constants: Vec<f64>,
    code: Vec<Instr>,
    functions: Vec<Fun>,
    outputs: Vec<u32>,
    ends: Vec<(usize, usize)>,     // of each part: end of its code, end of its outputs
    limits: (usize, usize, usize), // highest index + 1 of unknowns, waves, flags: checked once per call
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
        let constants: Vec<f64> = order.iter().filter_map(|&id| g.value(id)).collect();
        let base = constants.len() as u32;
        let mut slot: HashMap<Id, u32> = HashMap::with_capacity(order.len());
        let (mut code, mut functions) = (Vec::new(), Vec::new());
        let mut limits = (0, 0, 0);
        for (k, id) in order.iter().filter(|&&id| g.value(id).is_some()).enumerate() {
            slot.insert(*id, k as u32);
        }
        let (mut outputs, mut ends) = (Vec::with_capacity(outs.len()), Vec::new());
        for &(part, kept) in parts {
            let order = if parts.len() > 1 { g.reachable(part) } else { order.clone() };
            let mut private = Vec::new();
            for id in order {
                if slot.contains_key(&id) {
                    continue;
                }
                let node = g.node(id);
                let s = |o: Id| slot[&o];
                let (op, a, b, c) = match node {
                    Node::Unknown(i) => {
                        limits.0 = limits.0.max(i as usize + 1);
                        (Op::X, i, 0, 0)
                    }
                    Node::Time => (Op::T, 0, 0, 0),
                    Node::Wave(k) => {
                        limits.1 = limits.1.max(k as usize + 1);
                        (Op::Wave, k, 0, 0)
                    }
                    Node::Flag(k) => {
                        limits.2 = limits.2.max(k as usize + 1);
                        (Op::Flag, k, 0, 0)
                    }
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
                    Node::Call(f, a) => {
                        functions.push(f);
                        (Op::Call, s(a), functions.len() as u32 - 1, 0)
                    }
                    Node::Select(c, a, b) => (Op::Select, s(c), s(a), s(b)),
                    // a free symbol that nobody substituted: no value exists
                    Node::Symbol(_) => (Op::Free, 0, 0, 0),
                    Node::Const(_) => unreachable!("constants have their slots already"),
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
        }
        Tape { constants, code, functions, outputs, ends, limits }
    }

    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }

    pub fn len(&self) -> usize {
        self.code.len()
    }

    /// Free symbols left in the program make it meaningless.
    pub fn has_free_symbols(&self) -> bool {
        self.code.iter().any(|i| matches!(i.op, Op::Free))
    }

    pub fn workspace(&self) -> Vec<f64> {
        let mut w = self.constants.clone();
        w.resize(self.constants.len() + self.code.len(), 0.0);
        w
    }

    /// Runs the program; the results are read with `output`.
    #[inline]
    pub fn run(&self, inp: &Inputs, w: &mut [f64]) {
        self.run_code(0, self.code.len(), inp, w);
    }

    /// Runs one part; those before it have run, with the same inputs but for what this part is the first to read.
    #[inline]
    pub fn run_part(&self, part: usize, inp: &Inputs, w: &mut [f64]) {
        let from = if part > 0 { self.ends[part - 1].0 } else { 0 };
        self.run_code(from, self.ends[part].0, inp, w);
    }

    /// Does it read a wave of this number or a higher one?
    pub fn reads_waves_from(&self, first: usize) -> bool {
        self.limits.1 > first
    }

    /// Slots of the results of one part.
    pub fn part_slots(&self, part: usize) -> &[u32] {
        let from = if part > 0 { self.ends[part - 1].1 } else { 0 };
        &self.outputs[from..self.ends[part].1]
    }

    #[inline]
    fn run_code(&self, from: usize, to: usize, inp: &Inputs, w: &mut [f64]) {
        let base = self.constants.len();
        assert!(w.len() == base + self.code.len());
        assert!(inp.x.len() >= self.limits.0 && inp.waves.len() >= self.limits.1 && inp.flags.len() >= self.limits.2);
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
                    Op::Sin => v(i.a).sin(),
                    Op::Cos => v(i.a).cos(),
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
                    Op::Free => f64::NAN,
                };
                *w.get_unchecked_mut(base + k) = r;
            }
        }
    }

    #[inline]
    pub fn output(&self, w: &[f64], k: usize) -> f64 {
        w[self.outputs[k] as usize]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::derive::{gradient, substitute, tangent};

    fn value(g: &Graph, id: Id, x: &[f64]) -> f64 {
        Tape::new(g, &[id]).eval(&Inputs { x, t: 0.0, waves: &[], flags: &[] })[0]
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
