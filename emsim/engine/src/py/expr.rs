//! `Expr`: a node of the graph, with Python's operators.
use super::Given;
use crate::graph::{Graph, Id, Node};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard};

pub type SharedGraph = Arc<Mutex<Graph>>;

/// A lock, also of what a panic has left.
pub fn lock<T>(held: &Mutex<T>) -> MutexGuard<'_, T> {
    held.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[pyclass(frozen)]
#[derive(Clone)]
pub struct Expr {
    pub graph: SharedGraph,
    #[pyo3(get)]
    pub id: Id,
}

impl Expr {
    /// A number or an expression of the same graph, or of one that it is a copy of.
    pub fn operand(graph: &SharedGraph, value: &Given<'_>) -> PyResult<Id> {
        if let Ok(e) = value.cast::<Expr>() {
            let e = e.get();
            if !Arc::ptr_eq(&e.graph, graph) {
                let mut g = lock(graph);
                let common = g
                    .in_common(&e.graph)
                    .ok_or_else(|| PyValueError::new_err("expressions of two different builders do not mix"))?;
                return Ok(g.take_over(&lock(&e.graph), e.id, common));
            }
            return Ok(e.id);
        }
        // a number that comes from outside is its expression (opened.py), whatever else it may be taken for
        if let Some(open) = value.getattr_opt("expr")? {
            return Expr::operand(graph, &open);
        }
        match value.extract::<f64>() {
            Ok(v) => Ok(lock(graph).constant(v)),
            Err(_) => Err(PyTypeError::new_err("an Expr or a number is needed")),
        }
    }

    fn with(&self, id: Id) -> Expr {
        Expr { graph: self.graph.clone(), id }
    }

    fn operands(&self, node: Node) -> Vec<Expr> {
        node.operands().map(|id| self.with(id)).collect()
    }

    fn binary(&self, other: &Given<'_>, f: fn(&mut Graph, Id, Id) -> Id, swap: bool) -> PyResult<Expr> {
        let o = Expr::operand(&self.graph, other)?;
        let mut g = lock(&self.graph);
        let id = if swap { f(&mut g, o, self.id) } else { f(&mut g, self.id, o) };
        Ok(self.with(id))
    }
}

#[pymethods]
impl Expr {
    #[getter]
    fn value(&self) -> Option<f64> {
        lock(&self.graph).value(self.id)
    }

    /// (operation, its number, operands): "const" v, "x" i, "time", "wave" k, "flag" k, "symbol" k, "neg" "add" "sub"
    /// "mul" "div" "pow" "powi" n "atan2" "select" "notless", or the name of a function.
    #[getter]
    fn node(&self) -> (String, f64, Vec<Expr>) {
        let node = lock(&self.graph).shown(self.id);
        let (name, number) = match node {
            Node::Const(bits) => ("const", f64::from_bits(bits)),
            Node::Unknown(i) => ("x", f64::from(i)),
            Node::Time => ("time", 0.0),
            Node::Wave(k) => ("wave", f64::from(k)),
            Node::Flag(k) => ("flag", f64::from(k)),
            Node::Symbol(k) => ("symbol", f64::from(k)),
            Node::Neg(_) => ("neg", 0.0),
            Node::Add(..) => ("add", 0.0),
            Node::Sub(..) => ("sub", 0.0),
            Node::Mul(..) => ("mul", 0.0),
            Node::Div(..) => ("div", 0.0),
            Node::Pow(..) => ("pow", 0.0),
            Node::Powi(_, n) => ("powi", f64::from(n)),
            Node::Atan2(..) => ("atan2", 0.0),
            Node::Select(..) => ("select", 0.0),
            Node::NotLess(..) => ("notless", 0.0),
            Node::Join(..) => ("join", 0.0),
            Node::Result(_, k, _) => ("result", f64::from(k)),
            Node::Call(f, _) => return (format!("{f:?}").to_lowercase(), 0.0, self.operands(node)),
        };
        (name.to_string(), number, self.operands(node))
    }

    fn __add__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::add, false)
    }
    fn __radd__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::add, true)
    }
    fn __sub__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::sub, false)
    }
    fn __rsub__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::sub, true)
    }
    fn __mul__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::mul, false)
    }
    fn __rmul__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::mul, true)
    }
    fn __truediv__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::div, false)
    }
    fn __rtruediv__(&self, o: &Given<'_>) -> PyResult<Expr> {
        self.binary(o, Graph::div, true)
    }
    fn __pow__(&self, o: &Given<'_>, _modulo: Option<&Given<'_>>) -> PyResult<Expr> {
        self.binary(o, Graph::pow, false)
    }
    fn __rpow__(&self, o: &Given<'_>, _modulo: Option<&Given<'_>>) -> PyResult<Expr> {
        self.binary(o, Graph::pow, true)
    }
    fn __neg__(&self) -> Expr {
        let id = lock(&self.graph).neg(self.id);
        self.with(id)
    }
    fn __pos__(&self) -> Expr {
        self.clone()
    }
    fn __bool__(&self) -> PyResult<bool> {
        Err(PyTypeError::new_err("an Expr has no truth value; use Builder.flag and Builder.select"))
    }
    fn __repr__(&self) -> String {
        let g = lock(&self.graph);
        match g.value(self.id) {
            Some(v) => format!("Expr({v})"),
            None => format!("Expr(#{}: {:?})", self.id, g.node(self.id)),
        }
    }
}
