//! The Python face: thin, one file for the expressions, one for the builder, one for the compiled
//! system, one for syntax trees, one for Verilog-A, one for circuit diagrams, one for the numbers of tables.
/// Puts values into a dict: fields of a struct under their names, or what is said.
macro_rules! put {
    ($d:expr, $of:expr; $($field:ident)*) => { $( $d.set_item(stringify!($field), $of.$field.clone())?; )* };
    ($d:expr; $($key:literal => $value:expr),*) => { $( $d.set_item($key, $value)?; )* };
}

mod builder;
mod expr;
mod foreign;
mod instance;
mod request;
mod schematic;
mod smallsignal;
mod syntax;
mod system;
mod table;
mod veriloga;

use crate::interrupt;
use pyo3::exceptions::{PyException, PyKeyboardInterrupt, PyValueError};
use pyo3::panic::PanicException;
use pyo3::prelude::*;
use std::sync::Mutex;

pyo3::create_exception!(_engine, Endless, PyValueError, "What is computed has no end: a loop of a module.");

/// What Python's handler of a signal has raised.
static RAISED: Mutex<Option<PyErr>> = Mutex::new(None);

/// Has Python been asked to end what it does?
fn ask() -> bool {
    let Err(raised) = Python::attach(|py| py.check_signals()) else { return false };
    *expr::lock(&RAISED) = Some(raised);
    true
}

/// What Python gives.
type Given<'py> = Bound<'py, PyAny>;

/// An error where the work has found that it has no end.
pub fn ends() -> PyResult<()> {
    interrupt::failed().map_or(Ok(()), |why| Err(Endless::new_err(why)))
}

/// Why what takes long was ended.
fn ended() -> PyErr {
    let raised = || expr::lock(&RAISED).take().unwrap_or_else(|| PyKeyboardInterrupt::new_err(()));
    ends().err().unwrap_or_else(raised)
}

/// What may take long; where it was interrupted, what Python's handler has raised.
pub fn guarded<T>(run: impl FnOnce() -> T) -> PyResult<T> {
    interrupt::guarded(run).map_err(|_| ended())
}

#[pymodule]
fn _engine(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    interrupt::ask_by(ask);
    // a panic at any entry is an `Exception` like every other fault: no net that catches those lets it through
    let (panic, base) = (m.py().get_type::<PanicException>(), m.py().get_type::<PyException>());
    panic.setattr("__bases__", (base,))?;
    m.add("Panic", panic)?;
    m.add("Endless", m.py().get_type::<Endless>())?;
    let code = crate::tape::Code::chosen().map_err(pyo3::exceptions::PyImportError::new_err)?;
    m.add("code", code.name())?;
    m.add_class::<expr::Expr>()?;
    m.add_class::<builder::Builder>()?;
    m.add_class::<system::System>()?;
    m.add_class::<system::Waveforms>()?;
    m.add_class::<smallsignal::SmallSignal>()?;
    m.add_class::<syntax::Trees>()?;
    m.add_class::<instance::Instance>()?;
    m.add_class::<instance::State>()?;
    m.add_function(wrap_pyfunction!(instance::lead, m)?)?;
    m.add_class::<veriloga::VerilogA>()?;
    m.add_class::<veriloga::Values>()?;
    m.add_class::<table::Curve>()?;
    m.add_function(wrap_pyfunction!(table::interpolated, m)?)?;
    m.add_function(wrap_pyfunction!(table::segments, m)?)?;
    m.add_function(wrap_pyfunction!(table::smooth, m)?)?;
    m.add_function(wrap_pyfunction!(table::chebyshev, m)?)?;
    m.add_function(wrap_pyfunction!(table::table_text, m)?)?;
    m.add_function(wrap_pyfunction!(veriloga::veriloga, m)?)?;
    m.add_function(wrap_pyfunction!(schematic::arrange_diagram, m)?)?;
    m.add_function(wrap_pyfunction!(device_parameters, m)?)?;
    m.add_function(wrap_pyfunction!(devices, m)?)?;
    m.add_function(wrap_pyfunction!(methods, m)?)?;
    m.add_function(wrap_pyfunction!(digital_parts, m)?)?;
    Ok(())
}

/// (names, unit, default, meaning) of every parameter of a device: of its .model, or of an instance.
#[pyfunction]
#[pyo3(signature = (kind, of="model"))]
fn device_parameters(kind: &str, of: &str) -> PyResult<Vec<(Vec<&'static str>, &'static str, f64, &'static str)>> {
    let spec =
        crate::devices::maker(kind).ok_or_else(|| PyValueError::new_err(format!("there is no device {kind}")))?.spec();
    let table = if of == "model" { spec.model } else { spec.instance };
    Ok(table.iter().map(|p| (p.names.to_vec(), p.unit, p.default, p.meaning)).collect())
}

/// (name, terminals) of every device there is.
#[pyfunction]
fn devices() -> Vec<(&'static str, Vec<&'static str>)> {
    crate::devices::REGISTRY.iter().map(|m| (m.spec().name, m.spec().terminals.to_vec())).collect()
}

type Port = (&'static str, bool, bool, bool);

/// Of every digital part: name, what it is, ports (name, is it an output, a list, may it be open?), parameters (name, unit, default,
/// meaning).
#[pyfunction]
fn digital_parts() -> Vec<(&'static str, &'static str, Vec<Port>, Vec<(&'static str, &'static str, f64, &'static str)>)>
{
    let specs = crate::logic::REGISTRY.iter().flat_map(|specs| specs.iter());
    let port = |p: &crate::logic::Port| (p.name, p.is_output, p.is_list, p.may_be_open);
    let told = |s: &crate::logic::Spec| {
        let parameters = s.parameters.iter().map(|p| (p.name, p.unit, p.default, p.meaning)).collect();
        (s.name, s.what, s.ports.iter().map(port).collect(), parameters)
    };
    specs.map(told).collect()
}

/// (names, order, kind, what it is for) of every integrator; `.options method=` has the first name.
#[pyfunction]
fn methods() -> Vec<(Vec<&'static str>, &'static str, &'static str, &'static str)> {
    crate::integrate::methods().map(|(names, [order, kind, used])| (names.to_vec(), order, kind, used)).collect()
}
