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
    m.add_class::<expr::Expr>()?;
    m.add_class::<builder::Builder>()?;
    m.add_class::<system::System>()?;
    m.add_class::<system::Waveforms>()?;
    m.add_class::<syntax::Trees>()?;
    Ok(())
}
