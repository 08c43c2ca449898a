//! `Instance`: a packed deck that Python leads from step to step, as an FMU's importer or a page does.
use super::{expr::lock, guarded};
use crate::packed::instance::{self, Kept};
use crate::packed::Packed;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};

#[pyclass(frozen)]
pub struct Instance {
    held: Mutex<instance::Instance>,
    /// what its states are known by
    own: Arc<()>,
}

/// What an instance is put back to.
#[pyclass(frozen)]
pub struct State {
    kept: Kept,
    of: Arc<()>,
}

impl Instance {
    /// Does it without Python's lock; what it says where it fails is a RuntimeError.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        what: impl FnOnce(&mut instance::Instance) -> Result<T, String> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| guarded(|| what(&mut lock(&self.held))))?;
        done.map_err(PyRuntimeError::new_err)
    }
}

#[pymethods]
impl Instance {
    #[new]
    fn new(packed: &[u8]) -> PyResult<Self> {
        let made = Packed::read(packed).and_then(instance::Instance::new).map_err(PyRuntimeError::new_err)?;
        Ok(Instance { held: Mutex::new(made), own: Arc::new(()) })
    }

    /// As it was made: inputs as the deck has them, whatever became of the run.
    fn reset(&self) {
        lock(&self.held).reset();
    }

    /// At t = 0, with the inputs as they are.
    fn start(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, instance::Instance::restart)
    }

    #[getter]
    fn time(&self) -> f64 {
        lock(&self.held).time()
    }

    /// By value reference: 0 is the time, then the inputs, then the outputs.
    fn get(&self, py: Python<'_>, reference: u32) -> PyResult<f64> {
        self.with(py, |it| it.get(reference))
    }

    fn set(&self, py: Python<'_>, reference: u32, value: f64, slope: f64) -> PyResult<()> {
        self.with(py, |it| {
            it.set(reference, value)?;
            if slope == 0.0 {
                return Ok(());
            }
            it.set_slope(reference, slope)
        })
    }

    /// On for h [s]; what it had to tell.
    fn step(&self, py: Python<'_>, h: f64) -> PyResult<Vec<String>> {
        self.with(py, |it| {
            it.step(it.time(), h)?;
            Ok(std::mem::take(&mut it.told))
        })
    }

    fn save(&self, py: Python<'_>) -> PyResult<State> {
        self.with(py, |it| it.keep()).map(|kept| State { kept, of: self.own.clone() })
    }

    fn restore(&self, py: Python<'_>, state: &State) -> PyResult<()> {
        if !Arc::ptr_eq(&self.own, &state.of) {
            return Err(PyRuntimeError::new_err("the state is of another session"));
        }
        self.with(py, |it| it.put_back(&state.kept))
    }
}
