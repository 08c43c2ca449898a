//! `Instance`: a packed deck that Python leads from step to step, as an FMU's importer or a page does.
use super::{expr::lock, guarded, table::bytes};
use crate::packed::instance::{self, Kept};
use crate::packed::Packed;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
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

    /// A coordinate that the start may have elsewhere, by its row and that of its speed.
    fn may_move(&self, py: Python<'_>, coordinate: usize, speed: Option<usize>) -> PyResult<()> {
        self.with(py, |it| it.may_move(coordinate, speed))
    }

    /// Where a coordinate is at the start, or as the deck has it; loops follow. The run is then to be started.
    fn place(&self, py: Python<'_>, coordinate: usize, value: Option<f64>) -> PyResult<()> {
        self.with(py, |it| it.place(coordinate, value))
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

/// One step of many instances, shared out among threads, without Python's lock: `inputs` are set to the rows of `values` (an instance a
/// row), all go on by h [s], and `outputs` are read. The rows of these as bytes of f64, and of each instance what it said where it failed.
#[pyfunction]
pub fn lead<'py>(
    py: Python<'py>,
    instances: Vec<Py<Instance>>,
    inputs: Vec<u32>,
    values: Vec<f64>,
    h: f64,
    outputs: Vec<u32>,
    threads: usize,
) -> PyResult<(Bound<'py, PyBytes>, Vec<Option<String>>)> {
    if values.len() != inputs.len() * instances.len() {
        return Err(PyValueError::new_err("lead: a value for each input of each instance"));
    }
    let (mut read, mut said) = (vec![f64::NAN; outputs.len() * instances.len()], vec![None; instances.len()]);
    py.detach(|| {
        let share = instances.len().div_ceil(threads.max(1)).max(1);
        std::thread::scope(|scope| {
            let mut rest = (&instances[..], &values[..], &mut read[..], &mut said[..]);
            while !rest.0.is_empty() {
                let n = share.min(rest.0.len());
                let (own, instances) = rest.0.split_at(n);
                let (given, values) = rest.1.split_at(n * inputs.len());
                let (found, read) = std::mem::take(&mut rest.2).split_at_mut(n * outputs.len());
                let (told, said) = std::mem::take(&mut rest.3).split_at_mut(n);
                rest = (instances, values, read, said);
                let (inputs, outputs) = (&inputs, &outputs);
                let mut work = move || {
                    for (k, instance) in own.iter().enumerate() {
                        let given = &given[k * inputs.len()..(k + 1) * inputs.len()];
                        let found = &mut found[k * outputs.len()..(k + 1) * outputs.len()];
                        let led = || step_of(&instance.get().held, (inputs, given), h, (outputs, found));
                        told[k] = crate::py::guarded(led).map_or_else(|e| Some(e.to_string()), Result::err);
                    }
                };
                match rest.0.is_empty() {
                    true => work(),
                    false => drop(scope.spawn(work)),
                }
            }
        });
    });
    Ok((bytes(py, &read), said))
}

fn step_of(
    held: &Mutex<instance::Instance>,
    (inputs, given): (&[u32], &[f64]),
    h: f64,
    (outputs, found): (&[u32], &mut [f64]),
) -> Result<(), String> {
    let mut it = lock(held);
    inputs.iter().zip(given).try_for_each(|(&input, &value)| it.set(input, value))?;
    let from = it.time();
    it.step(from, h)?;
    it.told.clear();
    outputs.iter().zip(found).try_for_each(|(&output, v)| it.get(output).map(|got| *v = got))
}
