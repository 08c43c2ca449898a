//! The Python face: thin, one file for the expressions, one for the builder, one for the compiled
//! system, one for syntax trees.
mod builder;
mod expr;
mod syntax;
mod system;

use pyo3::prelude::*;

#[pymodule]
fn _engine(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let code = crate::tape::Code::chosen().map_err(pyo3::exceptions::PyImportError::new_err)?;
    m.add("code", code.name())?;
    m.add_class::<expr::Expr>()?;
    m.add_class::<builder::Builder>()?;
    m.add_class::<system::System>()?;
    m.add_class::<system::Waveforms>()?;
    m.add_class::<syntax::Trees>()?;
    m.add_function(wrap_pyfunction!(diode_parameters, m)?)?;
    Ok(())
}

/// (names, unit, default, meaning) of every parameter of a diode's .model.
#[pyfunction]
fn diode_parameters() -> Vec<(Vec<&'static str>, &'static str, f64, &'static str)> {
    crate::devices::diode::MODEL.iter().map(|p| (p.names.to_vec(), p.unit, p.default, p.meaning)).collect()
}
