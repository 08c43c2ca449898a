//! Hash-consed expression graph with folding at construction.
//!
//! A node is built once: asking for the same operation on the same operands returns the same `Id`, so common
//! subexpressions are shared by construction. What is constant folds away before anything runs; that is how a planar
//! scene loses its third dimension (DESIGN.md, idea 3).
mod called;
mod copied;

use super::repeat;
use crate::interrupt;
use called::Listed;
use rustc_hash::FxHashMap as HashMap;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::sync::{Arc, Mutex};

pub type Id = u32;

/// Functions of one argument.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
pub enum Fun {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Asinh,
    Acosh,
    Atanh,
    Exp,
    Log,
    Sqrt,
    Abs,
    Sign,
    Floor,
    Ceil,
    Round,
}

impl Fun {
    pub fn apply(self, a: f64) -> f64 {
        match self {
            Fun::Sin => a.sin(),
            Fun::Cos => a.cos(),
            Fun::Tan => a.tan(),
            Fun::Asin => a.asin(),
            Fun::Acos => a.acos(),
            Fun::Atan => a.atan(),
            Fun::Sinh => a.sinh(),
            Fun::Cosh => a.cosh(),
            Fun::Tanh => a.tanh(),
            Fun::Asinh => a.asinh(),
            Fun::Acosh => a.acosh(),
            Fun::Atanh => a.atanh(),
            Fun::Exp => a.exp(),
            Fun::Log => a.ln(),
            Fun::Sqrt => a.sqrt(),
            Fun::Abs => a.abs(),
            Fun::Sign => {
                if a > 0.0 {
                    1.0
                } else if a < 0.0 {
                    -1.0
                } else {
                    0.0
                }
            }
            Fun::Floor => a.floor(),
            Fun::Ceil => a.ceil(),
            Fun::Round => a.round_ties_even(),
        }
    }

    pub fn from_name(name: &str) -> Option<Fun> {
        Some(match name {
            "sin" => Fun::Sin,
            "cos" => Fun::Cos,
            "tan" => Fun::Tan,
            "asin" => Fun::Asin,
            "acos" => Fun::Acos,
            "atan" => Fun::Atan,
            "sinh" => Fun::Sinh,
            "cosh" => Fun::Cosh,
            "tanh" => Fun::Tanh,
            "asinh" => Fun::Asinh,
            "acosh" => Fun::Acosh,
            "atanh" => Fun::Atanh,
            "exp" => Fun::Exp,
            "log" | "ln" => Fun::Log,
            "sqrt" => Fun::Sqrt,
            "abs" => Fun::Abs,
            "sgn" | "sign" => Fun::Sign,
            "floor" => Fun::Floor,
            "ceil" => Fun::Ceil,
            "round" | "nint" => Fun::Round,
            _ => return None,
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
pub enum Node {
    Const(u64), // bits of the f64
    Unknown(u32),
    Time,
    Wave(u32),
    Flag(u32),
    Symbol(u32),
    Neg(Id),
    Add(Id, Id),
    Sub(Id, Id),
    Mul(Id, Id),
    Div(Id, Id),
    Pow(Id, Id),
    Powi(Id, i32),
    Atan2(Id, Id),
    Call(Fun, Id),
    Select(Id, Id, Id),
    /// a condition: not a < b, so true where one is no number
    NotLess(Id, Id),
    /// a list of arguments, no value: what stands before, which is no list at the beginning, and one more
    Join(Id, Id),
    /// of loop number n, result k for a list of arguments (`repeat.rs`)
    Result(u32, u32, Id),
}

impl Node {
    /// Operands, in order.
    pub fn operands(&self) -> impl Iterator<Item = Id> {
        let (n, ops) = match *self {
            Node::Neg(a) | Node::Powi(a, _) | Node::Call(_, a) | Node::Result(_, _, a) => (1, [a, 0, 0]),
            Node::Add(a, b) | Node::Sub(a, b) | Node::Mul(a, b) | Node::Div(a, b) => (2, [a, b, 0]),
            Node::Pow(a, b) | Node::Atan2(a, b) | Node::NotLess(a, b) | Node::Join(a, b) => (2, [a, b, 0]),
            Node::Select(c, a, b) => (3, [c, a, b]),
            _ => (0, [0, 0, 0]),
        };
        ops.into_iter().take(n)
    }

    pub fn is_leaf(&self) -> bool {
        matches!(self, Node::Const(_) | Node::Unknown(_) | Node::Time | Node::Wave(_) | Node::Flag(_) | Node::Symbol(_))
    }
}

#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(from = "Listed", into = "Listed")]
pub struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    symbols: u32,
    /// what it is a copy of, and how many nodes they have in common
    copied: Option<(Arc<Mutex<Graph>>, usize)>,
}

impl Graph {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub fn node(&self, id: Id) -> Node {
        self.nodes[id as usize]
    }

    /// The node as it is, without folding. Operands always precede: ids are a topological order.
    fn intern(&mut self, node: Node) -> Id {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = self.nodes.len() as Id;
        interrupt::spent(50);
        self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    pub fn value(&self, id: Id) -> Option<f64> {
        match self.nodes[id as usize] {
            Node::Const(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn is(&self, id: Id, v: f64) -> bool {
        self.value(id) == Some(v)
    }

    pub fn constant(&mut self, v: f64) -> Id {
        // +0 and -0 are one constant: folding must not depend on the sign of a zero
        let v = if v == 0.0 { 0.0 } else { v };
        self.intern(Node::Const(v.to_bits()))
    }

    pub fn unknown(&mut self, i: u32) -> Id {
        self.intern(Node::Unknown(i))
    }

    pub fn time(&mut self) -> Id {
        self.intern(Node::Time)
    }

    pub fn wave(&mut self, k: u32) -> Id {
        self.intern(Node::Wave(k))
    }

    pub fn flag(&mut self, k: u32) -> Id {
        self.intern(Node::Flag(k))
    }

    pub fn symbol(&mut self) -> Id {
        self.symbols += 1;
        self.intern(Node::Symbol(self.symbols))
    }

    /// The symbol of this number.
    pub fn given(&mut self, k: u32) -> Id {
        self.symbols = self.symbols.max(k);
        self.intern(Node::Symbol(k))
    }

    pub fn neg(&mut self, a: Id) -> Id {
        match self.node(a) {
            Node::Const(bits) => self.constant(-f64::from_bits(bits)),
            Node::Neg(b) => b,
            Node::Sub(x, y) => self.sub(y, x),
            _ => self.intern(Node::Neg(a)),
        }
    }

    pub fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x + y),
            (Some(0.0), _) => return b,
            (_, Some(0.0)) => return a,
            _ => {}
        }
        if a == b {
            let two = self.constant(2.0);
            return self.mul(two, a);
        }
        match (self.node(a), self.node(b)) {
            (Node::Neg(x), Node::Neg(y)) => {
                let s = self.add(x, y);
                return self.neg(s);
            }
            (_, Node::Neg(y)) => return self.sub(a, y),
            (Node::Neg(x), _) => return self.sub(b, x),
            // (x - y) + y = x
            (Node::Sub(x, y), _) if y == b => return x,
            (_, Node::Sub(x, y)) if y == a => return x,
            _ => {}
        }
        if let Some(id) = self.join_multiples(a, b, 1.0) {
            return id;
        }
        // c1 + (c2 + x) = (c1 + c2) + x
        let (a, b) = if self.value(b).is_some() { (b, a) } else { (a, b) };
        if let (Some(c1), Node::Add(p, q)) = (self.value(a), self.node(b)) {
            if let Some(c2) = self.value(p) {
                let c = self.constant(c1 + c2);
                return self.add(c, q);
            }
        }
        let (a, b) = if a <= b || self.value(a).is_some() { (a, b) } else { (b, a) };
        self.intern(Node::Add(a, b))
    }

    pub fn sub(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x - y),
            (_, Some(0.0)) => return a,
            (Some(0.0), _) => return self.neg(b),
            (None, Some(y)) => {
                let c = self.constant(-y);
                return self.add(c, a);
            }
            _ => {}
        }
        if a == b {
            return self.constant(0.0);
        }
        match (self.node(a), self.node(b)) {
            (_, Node::Neg(y)) => return self.add(a, y),
            (Node::Neg(x), _) => {
                let s = self.add(x, b);
                return self.neg(s);
            }
            // (x + y) - y = x
            (Node::Add(x, y), _) if y == b => return x,
            (Node::Add(x, y), _) if x == b => return y,
            _ => {}
        }
        if let Some(id) = self.join_multiples(a, b, -1.0) {
            return id;
        }
        self.intern(Node::Sub(a, b))
    }

    /// c1*x + s*c2*x = (c1 + s*c2)*x where both are multiples of one x.
    fn join_multiples(&mut self, a: Id, b: Id, sign: f64) -> Option<Id> {
        let (ca, xa) = self.as_multiple(a);
        let (cb, xb) = self.as_multiple(b);
        if xa == xb && self.value(xa).is_none() {
            let c = self.constant(ca + sign * cb);
            return Some(self.mul(c, xa));
        }
        None
    }

    fn as_multiple(&self, a: Id) -> (f64, Id) {
        if let Node::Mul(c, x) = self.node(a) {
            if let Some(v) = self.value(c) {
                return (v, x);
            }
        }
        (1.0, a)
    }

    pub fn mul(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x * y),
            _ if self.is(a, 0.0) || self.is(b, 0.0) => return self.constant(0.0),
            (Some(1.0), _) => return b,
            (_, Some(1.0)) => return a,
            (Some(-1.0), _) => return self.neg(b),
            (_, Some(-1.0)) => return self.neg(a),
            _ => {}
        }
        match (self.node(a), self.node(b)) {
            (Node::Neg(x), Node::Neg(y)) => return self.mul(x, y),
            (Node::Neg(x), _) => {
                if let Some(c) = self.value(b) {
                    let c = self.constant(-c);
                    return self.mul(c, x);
                }
                let m = self.mul(x, b);
                return self.neg(m);
            }
            (_, Node::Neg(y)) => {
                if let Some(c) = self.value(a) {
                    let c = self.constant(-c);
                    return self.mul(c, y);
                }
                let m = self.mul(a, y);
                return self.neg(m);
            }
            _ => {}
        }
        // constants gather at the front: c1*(c2*x) = (c1*c2)*x, x*(c*y) = c*(x*y)
        let (a, b) = if self.value(b).is_some() { (b, a) } else { (a, b) };
        let (cb, xb) = self.as_multiple(b);
        if cb != 1.0 {
            if let Some(ca) = self.value(a) {
                let c = self.constant(ca * cb);
                return self.mul(c, xb);
            }
            let m = self.mul(a, xb);
            let c = self.constant(cb);
            return self.mul(c, m);
        }
        let (ca, xa) = self.as_multiple(a);
        if ca != 1.0 && self.value(a).is_none() {
            let m = self.mul(xa, b);
            let c = self.constant(ca);
            return self.mul(c, m);
        }
        let (a, b) = if self.value(a).is_some() || a <= b { (a, b) } else { (b, a) };
        self.intern(Node::Mul(a, b))
    }

    pub fn div(&mut self, a: Id, b: Id) -> Id {
        if let Some(y) = self.value(b) {
            if let Some(x) = self.value(a) {
                return self.constant(x / y);
            }
            if y != 0.0 {
                let r = self.constant(1.0 / y);
                return self.mul(r, a);
            }
        }
        if self.is(a, 0.0) {
            return self.constant(0.0);
        }
        if a == b {
            return self.constant(1.0);
        }
        match (self.node(a), self.node(b)) {
            (Node::Neg(x), Node::Neg(y)) => self.div(x, y),
            (Node::Neg(x), _) => {
                let d = self.div(x, b);
                self.neg(d)
            }
            (_, Node::Neg(y)) => {
                let d = self.div(a, y);
                self.neg(d)
            }
            _ => self.intern(Node::Div(a, b)),
        }
    }

    pub fn powi(&mut self, a: Id, n: i32) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(x.powi(n));
        }
        match n {
            0 => self.constant(1.0),
            1 => a,
            2 => self.mul(a, a),
            -1 => {
                let one = self.constant(1.0);
                self.div(one, a)
            }
            _ => self.intern(Node::Powi(a, n)),
        }
    }

    pub fn pow(&mut self, a: Id, b: Id) -> Id {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => return self.constant(x.powf(y)),
            (None, Some(y)) => {
                if y == y.trunc() && y.abs() <= 64.0 {
                    return self.powi(a, y as i32);
                }
                if y == 0.5 {
                    return self.call(Fun::Sqrt, a);
                }
            }
            _ => {}
        }
        self.intern(Node::Pow(a, b))
    }

    pub fn atan2(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(x.atan2(y));
        }
        self.intern(Node::Atan2(a, b))
    }

    pub fn call(&mut self, f: Fun, a: Id) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(f.apply(x));
        }
        // odd and even functions of -x
        if let Node::Neg(x) = self.node(a) {
            match f {
                Fun::Cos | Fun::Cosh | Fun::Abs => return self.call(f, x),
                Fun::Sin | Fun::Tan | Fun::Asin | Fun::Atan | Fun::Sinh | Fun::Tanh | Fun::Asinh | Fun::Atanh => {
                    let y = self.call(f, x);
                    return self.neg(y);
                }
                _ => {}
            }
        }
        self.intern(Node::Call(f, a))
    }

    pub fn select(&mut self, c: Id, a: Id, b: Id) -> Id {
        if let Some(v) = self.value(c) {
            return if v != 0.0 { a } else { b };
        }
        if a == b {
            return a;
        }
        self.intern(Node::Select(c, a, b))
    }

    /// What `select` asks: not a < b. No event: both sides of the selection agree where a = b.
    pub fn not_less(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(f64::from(u8::from(!(x < y))));
        }
        self.intern(Node::NotLess(a, b))
    }

    /// The same operation on other operands, folded anew.
    pub fn rebuild(&mut self, node: Node, ops: [Id; 3]) -> Id {
        let [a, b, c] = ops;
        match node {
            Node::Neg(_) => self.neg(a),
            Node::Add(..) => self.add(a, b),
            Node::Sub(..) => self.sub(a, b),
            Node::Mul(..) => self.mul(a, b),
            Node::Div(..) => self.div(a, b),
            Node::Pow(..) => self.pow(a, b),
            Node::Powi(_, n) => self.powi(a, n),
            Node::Atan2(..) => self.atan2(a, b),
            Node::Call(f, _) => self.call(f, a),
            Node::Select(..) => self.select(a, b, c),
            Node::NotLess(..) => self.not_less(a, b),
            Node::Join(..) => self.intern(Node::Join(a, b)),
            Node::Result(number, k, _) => self.result(number, k, a),
            leaf => self.intern(leaf),
        }
    }

    /// Every node that `outs` need, operands first.
    pub fn reachable(&self, outs: &[Id]) -> Vec<Id> {
        // the number of this walk, and by node that of the last one that met it: no walk pays for nodes that it does not meet
        thread_local!(static MET: RefCell<(u64, Vec<u64>)> = const { RefCell::new((0, Vec::new())) });
        let (mut stack, mut found) = (outs.to_vec(), Vec::new());
        MET.with_borrow_mut(|(walk, met)| {
            *walk += 1;
            met.resize(met.len().max(self.nodes.len()), 0);
            while let Some(id) = stack.pop() {
                if std::mem::replace(&mut met[id as usize], *walk) != *walk {
                    found.push(id);
                    stack.extend(self.nodes[id as usize].operands());
                }
            }
        });
        // ids are a topological order by construction
        found.sort_unstable();
        found
    }

    /// Unknowns that they read.
    pub fn unknowns(&self, outs: &[Id]) -> Vec<usize> {
        let unknown = |id| if let Node::Unknown(i) = self.node(id) { Some(i as usize) } else { None };
        self.reachable(outs).into_iter().filter_map(unknown).collect()
    }

    /// Does any of them read an unknown through an exponential?
    pub fn has_exponentials(&self, outs: &[Id]) -> bool {
        let mut reads: HashMap<Id, bool> = HashMap::default(); // an unknown
        self.reachable(outs).into_iter().any(|id| {
            let node = self.node(id);
            let moves = matches!(node, Node::Unknown(_)) || node.operands().any(|a| reads[&a]);
            reads.insert(id, moves);
            moves
                && match node {
                    Node::Result(number, ..) => repeat::has_exponentials(number),
                    _ => matches!(node, Node::Call(Fun::Exp | Fun::Sinh | Fun::Cosh, _)),
                }
        })
    }

    /// Number of operations (leaves are free).
    pub fn count(&self, outs: &[Id]) -> usize {
        self.reachable(outs).iter().filter(|&&id| !self.node(id).is_leaf()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding() {
        let mut g = Graph::new();
        let x = g.unknown(0);
        let y = g.unknown(1);
        let zero = g.constant(0.0);
        let a = g.mul(x, zero);
        assert_eq!(g.value(a), Some(0.0));
        let s = g.add(x, y);
        let t = g.add(y, x);
        assert_eq!(s, t);
        let d = g.sub(s, y);
        assert_eq!(d, x);
        let two = g.constant(2.0);
        let m = g.mul(x, two);
        let m3 = g.add(m, x);
        assert_eq!(g.node(m3), {
            let three = g.constant(3.0);
            Node::Mul(three, x)
        });
        let z = g.sub(m3, m3);
        assert_eq!(g.value(z), Some(0.0));
        let n = g.neg(x);
        let nn = g.mul(n, n);
        let xx = g.mul(x, x);
        assert_eq!(nn, xx);
        let q = g.pow(x, two);
        assert_eq!(q, xx);
    }
}
