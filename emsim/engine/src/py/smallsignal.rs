//! `SmallSignal`: the equations linearised about an operating point.
use super::expr::{lock, Expr, SharedGraph};
use super::guarded;
use super::Given;
use crate::smallsignal::{self, Excitation, Gradients, NoiseSource};
use crate::sparse::{Complex, Scalar, Singular};
use crate::system::{System, Work};
use crate::tape::{Inputs, Tape};
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
    /// The point.
    #[pyo3(get)]
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
    /// (unknown, volts, amperes) where the point hangs on gmin.
    #[getter]
    fn hanging(&self) -> Option<(usize, f64, f64)> {
        let held = lock(&self.held);
        held.1.doubts.hanging.map(|h| (h.unknown, h.volts, h.amperes))
    }

    /// (unknown, growth [1/s], turning [rad/s], false) of what the least disturbance does there, if it grows.
    #[getter]
    fn unstable(&self) -> Option<(usize, f64, f64, bool)> {
        lock(&self.held).1.doubts.unstable.as_ref().map(|u| (u.unknown, u.s.0, u.s.1, u.at_start))
    }

    /// F at the point.
    #[getter]
    fn residual(&self) -> Vec<f64> {
        let mut held = lock(&self.held);
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
        let mut held = lock(&self.held);
        let (linear, w) = &mut *held;
        let (slopes, excitation) = {
            let mut g = lock(&self.graph);
            let gradients = Gradients::new(&mut g, &ids);
            (gradients.at(&self.system, w, &self.x), Excitation::at(&self.system, &mut g, w, &self.x))
        };
        let mut columns = vec![Vec::with_capacity(16 * s.len()); slopes.len()];
        for &s in &s {
            let s = complex(s);
            let mut b = excitation.of(s, &sources);
            for &(row, v) in &rows {
                let place = b.get_mut(row).ok_or_else(|| PyValueError::new_err("no such row"))?;
                *place += complex(v);
                self.system.sums.iter().filter(|s| s.node == row).for_each(|s| b[s.root] += complex(v));
            }
            guarded(|| linear.solve(s, &mut b))?.map_err(|e| self.singular(e))?;
            for (column, slopes) in columns.iter_mut().zip(&slopes) {
                let value = slopes.of(&b, &sources);
                column.extend(value.re.to_ne_bytes());
                column.extend(value.im.to_ne_bytes());
            }
        }
        Ok(columns.iter().map(|c| PyBytes::new(py, c)).collect())
    }

    /// Other equations of the same unknowns about a point of theirs, with the conditions of this one; nothing is solved.
    fn elsewhere(&self, other: &super::system::System, x: Vec<f64>, hold: bool) -> PyResult<SmallSignal> {
        let system = other.equations();
        let held = lock(&self.held);
        let mut w = system.work();
        if x.len() != system.n || system.n != self.system.n || w.flags.len() != held.1.flags.len() {
            return Err(PyValueError::new_err("these are equations of other unknowns"));
        }
        (w.dc, w.gmin, w.given) = (true, held.1.gmin, held.1.given.clone());
        w.flags.copy_from_slice(&held.1.flags);
        w.free.clone_from(&held.1.free);
        drop(held);
        guarded(|| SmallSignal::new(system, other.shared(), w, x, hold))?
            .map_err(|e| PyValueError::new_err(format!("singular: {:?}", e.col)))
    }

    /// Where the unknowns are X at each s, whether that is the solution or not: what expressions come to, with sources of these
    /// amplitudes; and what these put into the rows.
    fn weigh(
        &self,
        s: Vec<Pair>,
        x: Vec<Vec<Pair>>,
        outputs: Vec<Given<'_>>,
        sources: Vec<(usize, Pair)>,
    ) -> PyResult<(Vec<Vec<Pair>>, Vec<Vec<Pair>>)> {
        let ids = outputs.iter().map(|o| Expr::operand(&self.graph, o)).collect::<PyResult<Vec<_>>>()?;
        let sources: Vec<(usize, Complex)> = sources.into_iter().map(|(k, u)| (k, complex(u))).collect();
        if x.iter().any(|x| x.len() != self.system.n) {
            return Err(PyValueError::new_err("X has a number for each unknown"));
        }
        let mut held = lock(&self.held);
        let w = &mut held.1;
        let mut g = lock(&self.graph);
        let gradients = Gradients::new(&mut g, &ids);
        let (slopes, excitation) =
            (gradients.at(&self.system, w, &self.x), Excitation::at(&self.system, &mut g, w, &self.x));
        let pairs = |z: &[Complex]| z.iter().map(|z| (z.re, z.im)).collect::<Vec<_>>();
        let each = s.into_iter().zip(&x).map(|(s, x)| {
            let x: Vec<Complex> = x.iter().map(|&z| complex(z)).collect();
            let values: Vec<Complex> = slopes.iter().map(|slopes| slopes.of(&x, &sources)).collect();
            (pairs(&values), pairs(&excitation.of(complex(s), &sources)))
        });
        Ok(each.unzip())
    }

    /// Values of expressions at the point.
    fn values(&self, outputs: Vec<Given<'_>>) -> PyResult<Vec<f64>> {
        let ids = outputs.iter().map(|o| Expr::operand(&self.graph, o)).collect::<PyResult<Vec<_>>>()?;
        let tape = Tape::new(&lock(&self.graph), &ids);
        let mut held = lock(&self.held);
        let w = &mut held.1;
        self.system.set_time(w, 0.0);
        Ok(tape.eval(&Inputs { x: &self.x, t: 0.0, waves: &w.waves, flags: &w.flags }).to_vec())
    }

    /// Sources of noise of devices at the point: (instance, source, nodes from and to, power density at 1 Hz, exponent of 1/f); and
    /// their series resistances: (instance, terminal, nodes, conductance).
    fn device_noise(&self) -> (Vec<(String, String, [i32; 2], f64, f64)>, Vec<(String, usize, [i32; 2], f64)>) {
        let held = lock(&self.held);
        let mut found = Vec::new();
        self.system.each_noise(&held.1, &self.x, |name, n, nodes| {
            found.push((name.to_owned(), n.name.to_owned(), nodes, n.power, n.exponent));
        });
        (found, self.system.series())
    }

    /// At each frequency [Hz], as columns: the square of the gain from a source (its wave) to an expression, and for each source of
    /// noise (rows of F with factors, power density at 1 Hz, exponent of 1/f) the density in the expression.
    fn noise<'py>(
        &self,
        py: Python<'py>,
        frequencies: Vec<f64>,
        output: &Bound<'py, PyAny>,
        wave: usize,
        sources: Vec<(Vec<(usize, f64)>, f64, f64)>,
    ) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        let id = Expr::operand(&self.graph, output)?;
        let sums = &self.system.sums;
        let sources: Vec<NoiseSource> = sources
            .into_iter()
            .map(|(mut rows, power, exponent)| {
                for (row, k) in rows.clone() {
                    rows.extend(sums.iter().filter(|s| s.node == row).map(|s| (s.root, k)));
                }
                NoiseSource { rows, power, exponent }
            })
            .collect();
        if sources.iter().flat_map(|s| &s.rows).any(|&(row, _)| row >= self.system.n) {
            return Err(PyValueError::new_err("no such row"));
        }
        let mut held = lock(&self.held);
        let (linear, w) = &mut *held;
        let (slopes, excitation) = {
            let mut g = lock(&self.graph);
            let slopes = Gradients::new(&mut g, &[id]).at(&self.system, w, &self.x).remove(0);
            (slopes, Excitation::at(&self.system, &mut g, w, &self.x))
        };
        let mut columns = vec![Vec::with_capacity(8 * frequencies.len()); 1 + sources.len()];
        let one = [(wave, Complex::ONE)];
        for &frequency in &frequencies {
            let s = Complex::new(0.0, 2.0 * std::f64::consts::PI * frequency);
            let mut a = vec![Complex::ZERO; self.system.n];
            slopes.unknowns.iter().for_each(|&(i, d)| a[i].re += d);
            guarded(|| linear.solve_transposed(s, &mut a))?.map_err(|e| self.singular(e))?;
            let mut gain = slopes.by_sources(&one);
            for (b, &a) in excitation.of(s, &one).into_iter().zip(&a) {
                gain += b * a;
            }
            columns[0].extend((gain.re * gain.re + gain.im * gain.im).to_ne_bytes());
            for (column, source) in columns[1..].iter_mut().zip(&sources) {
                column.extend(source.density(&a, frequency).to_ne_bytes());
            }
        }
        Ok(columns.iter().map(|c| PyBytes::new(py, c)).collect())
    }

    /// a = (G + s C)^-T de/dx of an expression: what one ampere (or whatever the row's unit is) into each row of F gives in it.
    fn adjoint(&self, s: Pair, output: &Given<'_>) -> PyResult<Vec<Pair>> {
        let id = Expr::operand(&self.graph, output)?;
        let mut held = lock(&self.held);
        let (linear, w) = &mut *held;
        let slopes = Gradients::new(&mut lock(&self.graph), &[id]).at(&self.system, w, &self.x);
        let mut a = vec![Complex::new(0.0, 0.0); self.system.n];
        slopes[0].unknowns.iter().for_each(|&(i, d)| a[i].re += d);
        linear.solve_transposed(complex(s), &mut a).map_err(|e| self.singular(e))?;
        Ok(a.into_iter().map(|z| (z.re, z.im)).collect())
    }

    /// (indptr, indices, values of G, values of C), compressed sparse columns: det(G + s C) = 0 at the poles.
    fn pencil(&self) -> (Vec<usize>, Vec<usize>, Vec<f64>, Vec<f64>) {
        let held = lock(&self.held);
        let (pattern, g, c) = held.0.pencil();
        (pattern.colptr.clone(), pattern.rowidx.clone(), g.to_vec(), c.to_vec())
    }
}
