//! Functions of a library, by name.
use super::log::Status;
use super::Spec;
use libloading::Library;

pub fn open(spec: &Spec) -> Result<Library, String> {
    // SAFETY: what a library does when it is loaded is its own affair; a crash is told (crash.rs)
    unsafe { Library::new(&spec.library) }.map_err(|e| format!("its library cannot be loaded: {e}"))
}

/// Tables of functions: a struct with a place for each, which is empty where the library has none of that name.
macro_rules! functions {
    ($(#[$doc:meta])* $table:ident { $($field:ident = $name:literal ($($arg:ty),*) $(-> $out:ty)?;)* }) => {
        $(#[$doc])*
        pub struct $table { $($field: Option<unsafe extern "C" fn($($arg),*) $(-> $out)?>,)* }

        impl $table {
            pub fn new(library: &libloading::Library) -> $table {
                // SAFETY: the types are those of the standard
                unsafe { $table { $($field: library.get(concat!($name, "\0").as_bytes()).ok().map(|f| *f),)* } }
            }
        }
    };
}
pub(super) use functions;

/// A call of a function with a status: what it is called, its place in the table, its arguments.
macro_rules! call {
    ($self:ident, $field:ident, $name:literal $(, $arg:expr)*) => {{
        const NAME: &std::ffi::CStr = $name;
        match $self.functions.$field {
            // SAFETY: an instance that lives, and arrays as long as is said
            Some(function) if $self.over.is_none() => {
                Ok(crate::crash::guarded(&$self.scene, NAME, || unsafe { function($self.component $(, $arg)*) }))
            }
            Some(_) => Err(format!("{} is not called: an error came before", NAME.to_string_lossy())),
            None => Err(format!("its library has no function {}", NAME.to_string_lossy())),
        }
    }};
}
pub(super) use call;

/// The same of what may be called behind an error too, though not behind a fatal one: what is left to an instance then is to be freed.
macro_rules! freed {
    ($self:ident, $field:ident, $name:literal $(, $arg:expr)*) => {
        if let (Some(function), true) = ($self.functions.$field, $self.over != Some(Status::Fatal)) {
            // SAFETY: an instance that lives
            crate::crash::guarded(&$self.scene, $name, || unsafe { function($self.component $(, $arg)*) });
        }
    };
}
pub(super) use freed;

/// The same, where any status but OK and a warning is an error.
macro_rules! done {
    ($self:ident, $field:ident, $name:literal $(, $arg:expr)*) => {
        match $crate::library::call!($self, $field, $name $(, $arg)*) {
            Ok(status) => $self.judged($name, status),
            Err(said) => Err(said),
        }
    };
}
pub(super) use done;

/// What a status that is an error is called.
pub fn failed(function: &std::ffi::CStr, status: Status, reason: &str) -> String {
    let word = match status {
        Status::Unknown => "an unknown status".into(),
        known => format!("{known:?}"),
    };
    let why = if reason.is_empty() { String::new() } else { format!(": {reason}") };
    format!("{} gives {word}{why}", function.to_string_lossy())
}
