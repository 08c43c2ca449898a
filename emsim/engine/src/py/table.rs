//! Numbers of tables: between their points, over an axis as curves, and as text. Columns are bytes of float64 in native order.
use crate::curve::{self, Curve as Inner};
use crate::interpolate::Points;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::fmt::Write;

fn doubles(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|b| f64::from_ne_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])).collect()
}

/// Numbers as the bytes of native float64.
pub fn bytes<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyBytes> {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    PyBytes::new(py, &raw)
}

fn checked(x: &[f64], y: &[f64]) -> PyResult<()> {
    if x.len() != y.len() || x.is_empty() {
        return Err(PyValueError::new_err("x and y are columns of one length, not empty"));
    }
    Ok(())
}

/// y at places `at`, within x[0] .. x[last] (interpolate.rs).
#[pyfunction]
pub fn interpolated<'py>(
    py: Python<'py>,
    x: &[u8],
    y: &[u8],
    at: &[u8],
    corners: &[u8],
) -> PyResult<Bound<'py, PyBytes>> {
    let (x, y, corners) = (doubles(x), doubles(y), doubles(corners));
    checked(&x, &y)?;
    let points = Points { x: &x, y: &y, corners: &corners };
    let found: Vec<f64> = doubles(at).into_iter().map(|t| points.at(t)).collect();
    Ok(bytes(py, &found))
}

/// Chebyshev's n + 1 points between neighbours of an axis.
#[pyfunction]
pub fn segments<'py>(py: Python<'py>, x: &[u8], n: usize) -> Bound<'py, PyBytes> {
    bytes(py, &curve::segments(&doubles(x), n.max(1)))
}

/// What a signal is there.
#[pyfunction]
pub fn smooth<'py>(
    py: Python<'py>,
    x: &[u8],
    y: &[u8],
    n: usize,
    corners: &[u8],
    logarithmic: bool,
) -> PyResult<Bound<'py, PyBytes>> {
    let (x, y) = (doubles(x), doubles(y));
    checked(&x, &y)?;
    Ok(bytes(py, &curve::smooth(&x, &y, n.max(1), &doubles(corners), logarithmic)))
}

/// Matrices of Chebyshev's n + 1 points on 0 .. 1, row by row: "areas" (one row), "integrals", "slopes"; "resampling" to `at`.
#[pyfunction]
#[pyo3(signature = (what, n, at=vec![]))]
pub fn chebyshev(what: &str, n: usize, at: Vec<f64>) -> PyResult<Vec<Vec<f64>>> {
    let n = n.max(1);
    Ok(match what {
        "nodes" => vec![curve::nodes(n)],
        "areas" => vec![curve::areas(n)],
        "integrals" => curve::integrals(n),
        "slopes" => curve::slopes(n),
        "resampling" => curve::resampling(n, &at),
        _ => return Err(PyValueError::new_err(format!("there is no matrix {what}"))),
    })
}

/// Lines of a table: its rows numbered from `first`, each number with `digits` behind the point, in columns that are so wide.
/// What is `complex` holds pairs.
#[pyfunction]
pub fn table_text(
    columns: Vec<Vec<u8>>,
    complex: Vec<bool>,
    widths: Vec<usize>,
    first: usize,
    digits: usize,
) -> PyResult<String> {
    if columns.len() != complex.len() || columns.len() != widths.len() {
        return Err(PyValueError::new_err("a width for each column"));
    }
    let columns: Vec<Vec<f64>> = columns.iter().map(|c| doubles(c)).collect();
    let lengths = columns.iter().zip(&complex).map(|(c, &pairs)| c.len() / if pairs { 2 } else { 1 });
    let rows = lengths.min().unwrap_or(0);
    let mut text = String::with_capacity(rows * (9 + widths.iter().sum::<usize>()));
    for k in 0..rows {
        let mut at = text.len();
        let _ = write!(text, "{}", first + k);
        pad(&mut text, at, 8);
        for ((values, &pairs), &width) in columns.iter().zip(&complex).zip(&widths) {
            at = text.len();
            if pairs {
                number(&mut text, values[2 * k], digits);
                text.push_str(", ");
                number(&mut text, values[2 * k + 1], digits);
            } else {
                number(&mut text, values[k], digits);
            }
            pad(&mut text, at, width);
        }
        text.truncate(text.trim_end_matches(' ').len());
        text.push('\n');
    }
    Ok(text)
}

/// Blanks, until the text is so much longer than it was.
fn pad(text: &mut String, was: usize, width: usize) {
    while text.len() < was + width {
        text.push(' ');
    }
}

/// As Python and C write `%.6e`: an exponent has a sign and two digits at least.
fn number(text: &mut String, value: f64, digits: usize) {
    if !value.is_finite() {
        text.push_str(if value.is_nan() {
            "nan"
        } else if value > 0.0 {
            "inf"
        } else {
            "-inf"
        });
        return;
    }
    let at = text.len();
    let _ = write!(text, "{value:.digits$e}");
    let Some(e) = text[at..].rfind('e').map(|e| at + e + 1) else { return };
    let sign = if text[e..].starts_with('-') { 1 } else { 0 };
    if sign == 0 {
        text.insert(e, '+');
    }
    if text.len() == e + 2 {
        text.insert(e + 1, '0');
    }
}

/// A signal over an axis: polynomials, one a segment (curve.rs).
#[pyclass(frozen)]
pub struct Curve {
    inner: Inner,
}

#[pymethods]
impl Curve {
    /// x and y segment by segment, n + 1 values each.
    #[new]
    fn new(x: &[u8], y: &[u8], n: usize) -> PyResult<Curve> {
        let inner = Inner::new(doubles(x), doubles(y), n);
        Ok(Curve { inner: inner.ok_or_else(|| PyValueError::new_err("a curve has n + 1 values a segment"))? })
    }

    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        bytes(py, &self.inner.x)
    }

    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        bytes(py, &self.inner.y)
    }

    #[getter]
    fn n(&self) -> usize {
        self.inner.n
    }

    #[getter]
    fn first(&self) -> f64 {
        self.inner.first()
    }

    #[getter]
    fn last(&self) -> f64 {
        self.inner.last()
    }

    /// Where the table begins.
    #[getter]
    fn start(&self) -> f64 {
        self.inner.y[0]
    }

    /// Its value where it does not change, to a billionth.
    #[getter]
    fn constant(&self) -> Option<f64> {
        let size = self.inner.y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        (!(self.inner.swing() > 1e-9 * size)).then_some(self.inner.y[0])
    }

    fn value(&self, t: f64) -> f64 {
        self.inner.value(t)
    }

    fn slope(&self, t: f64) -> f64 {
        self.inner.slope(t)
    }

    fn crossings(&self, level: &Curve, begin: f64, end: f64) -> PyResult<Vec<(f64, i32)>> {
        checked(&self.inner.y, &level.inner.y)?;
        Ok(self.inner.crossings(&level.inner, begin, end))
    }

    fn touch(&self, level: &Curve, begin: f64, end: f64, direction: i32) -> Option<f64> {
        self.inner.touch(&level.inner, begin, end, direction)
    }

    fn cut(&self, begin: f64, end: f64) -> Curve {
        Curve { inner: self.inner.cut(begin, end) }
    }

    #[pyo3(signature = (power=1))]
    fn integral(&self, power: usize) -> f64 {
        self.inner.integral(power.clamp(1, 2))
    }

    fn extreme(&self, sign: f64) -> (f64, f64) {
        self.inner.extreme(sign)
    }
}
