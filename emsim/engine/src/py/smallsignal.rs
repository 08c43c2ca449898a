//! `SmallSignal`: the equations linearised about an operating point.
use super::expr::{lock, Expr, SharedGraph};
use crate::smallsignal::{self, Excitation, Gradients};
use crate::sparse::{Complex, Singular};
use crate::system::{System, Work};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::{Arc, Mutex};

type Pair = (f64, f64);

fn complex((re, im): Pair) -> Complex {
    Complex::new(re, im)
}

#[pyclass(frozen)]
pub struct SmallSignal {
    system: Arc<System>,
    graph: SharedGraph,
    x: Vec<f64>,
    held: Mutex<(smallsignal::SmallSignal, Work)>,
}

impl SmallSignal {
    pub fn new(
        system: Arc<System>,
        graph: SharedGraph,
        mut w: Work,
        x: Vec<f64>,
        hold: bool,
    ) -> Result<SmallSignal, Singular> {
        let linear = smallsignal::SmallSignal::at(&system, &mut w, &x, hold)?;
        Ok(SmallSignal { system, graph, x, held: Mutex::new((linear, w)) })
    }

    fn singular(&self, e: Singular) -> PyErr {
        let at = e.col.and_then(|k| self.system.unknowns.get(k)).map_or("", |u| u.name.as_str());
        PyValueError::new_err(format!("singular: {at}"))
    }
}

#[pymethods]
impl SmallSignal {
    /// The point.
    #[getter]
    fn x(&self) -> Vec<f64> {
        self.x.clone()
    }

    /// F at the point.
    #[getter]
    fn residual(&self) -> Vec<f64> {
        let mut held = self.held.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        self.system.eval(&mut held.1, &self.x, 0.0);
        held.1.f.clone()
    }

    /// What expressions come to at each s when the sources have these amplitudes and `rows` of F take these in: for each
    /// expression the bytes of complex128.
    #[pyo3(signature = (s, outputs, sources, rows=vec![]))]
    fn respond<'py>(
        &self,
        py: Python<'py>,
        s: Vec<Pair>,
        outputs: Vec<Bound<'py, PyAny>>,
        sources: Vec<(usize, Pair)>,
        rows: Vec<(usize, Pair)>,
    ) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        let ids = outputs.iter().map(|o| Expr::operand(&self.graph, o)).collect::<PyResult<Vec<_>>>()?;
        let sources: Vec<(usize, Complex)> = sources.into_iter().map(|(k, u)| (k, complex(u))).collect();
        let mut held = self.held.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (linear, w) = &mut *held;
        let (slopes, excitation) = {
            let mut g = lock(&self.graph);
            let gradients = Gradients::new(&mut g, &ids);
            (gradients.at(&self.system, w, &self.x), Excitation::at(&self.system, &mut g, w, &self.x))
        };
        let mut columns = vec![Vec::with_capacity(16 * s.len()); slopes.len()];
        for (k, &s) in s.iter().enumerate() {
            if k % 64 == 63 {
                py.check_signals()?;
            }
            let s = complex(s);
            let mut b = excitation.of(s, &sources);
            for &(row, v) in &rows {
                let place = b.get_mut(row).ok_or_else(|| PyValueError::new_err("no such row"))?;
                *place += complex(v);
                self.system.sums.iter().filter(|s| s.node == row).for_each(|s| b[s.root] += complex(v));
            }
            linear.solve(s, &mut b).map_err(|e| self.singular(e))?;
            for (column, slopes) in columns.iter_mut().zip(&slopes) {
                let value = slopes.of(&b, &sources);
                column.extend(value.re.to_ne_bytes());
                column.extend(value.im.to_ne_bytes());
            }
        }
        Ok(columns.iter().map(|c| PyBytes::new(py, c)).collect())
    }

    /// a = (G + s C)^-T de/dx of an expression: what one ampere (or whatever the row's unit is) into each row of F gives in it.
    fn adjoint(&self, s: Pair, output: &Bound<'_, PyAny>) -> PyResult<Vec<Pair>> {
        let id = Expr::operand(&self.graph, output)?;
        let mut held = self.held.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (linear, w) = &mut *held;
        let slopes = Gradients::new(&mut lock(&self.graph), &[id]).at(&self.system, w, &self.x);
        let mut a = vec![Complex::new(0.0, 0.0); self.system.n];
        slopes[0].unknowns.iter().for_each(|&(i, d)| a[i].re += d);
        linear.solve_transposed(complex(s), &mut a).map_err(|e| self.singular(e))?;
        Ok(a.into_iter().map(|z| (z.re, z.im)).collect())
    }

    /// (indptr, indices, values of G, values of C), compressed sparse columns: det(G + s C) = 0 at the poles.
    fn pencil(&self) -> (Vec<usize>, Vec<usize>, Vec<f64>, Vec<f64>) {
        let held = self.held.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let (pattern, g, c) = held.0.pencil();
        (pattern.colptr.clone(), pattern.rowidx.clone(), g.to_vec(), c.to_vec())
    }
}
