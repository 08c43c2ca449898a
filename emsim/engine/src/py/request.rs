//! Requests: what a call is asked for by keywords, as one struct. Python gives a dict; words that the request does not know are
//! refused.
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A struct that is read from keywords: of each its name, type, and what it is where it is not given.
macro_rules! request {
    ($(#[$about:meta])* $name:ident { $($(#[$of:meta])* $field:ident: $type:ty $(= $default:expr)?,)* }) => {
        $(#[$about])*
        pub struct $name<'py> {
            $($(#[$of])* pub $field: $type,)*
        }

        impl<'py> $name<'py> {
            const WORDS: &'static [&'static str] = &[$(stringify!($field)),*];

            /// What `call` was given.
            pub fn read(
                call: &str,
                given: Option<&pyo3::Bound<'py, pyo3::types::PyDict>>,
            ) -> pyo3::PyResult<$name<'py>> {
                let words = $crate::py::request::Words::new(call, given, Self::WORDS)?;
                Ok($name { $($field: words.read(stringify!($field), || $crate::py::request::default!($($default)?))?,)* })
            }
        }
    };
}
macro_rules! default {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}
pub(super) use default;
pub(super) use request;

/// The keywords of a call.
pub struct Words<'a, 'py> {
    call: &'a str,
    given: Option<&'a Bound<'py, PyDict>>,
}

impl<'a, 'py> Words<'a, 'py> {
    /// TypeError where one is none of `known`.
    pub fn new(call: &'a str, given: Option<&'a Bound<'py, PyDict>>, known: &[&str]) -> PyResult<Words<'a, 'py>> {
        for (word, _) in given.into_iter().flat_map(|given| given.iter()) {
            let word: String = word.extract()?;
            if !known.contains(&word.as_str()) {
                return Err(PyTypeError::new_err(format!("{call} knows no `{word}`")));
            }
        }
        Ok(Words { call, given })
    }

    /// TypeError where it is neither given nor has a default, or is of another type.
    pub fn read<T>(&self, word: &str, default: impl FnOnce() -> Option<T>) -> PyResult<T>
    where
        T: for<'b> FromPyObject<'b, 'py>,
    {
        let Some(value) = self.given.map(|given| given.get_item(word)).transpose()?.flatten() else {
            return default().ok_or_else(|| PyTypeError::new_err(format!("{} needs `{word}`", self.call)));
        };
        let found: PyResult<T> = value.extract::<T>().map_err(Into::into);
        found.map_err(|error| {
            let told = PyTypeError::new_err(format!("{}: `{word}`", self.call));
            told.set_cause(value.py(), Some(error));
            told
        })
    }
}
