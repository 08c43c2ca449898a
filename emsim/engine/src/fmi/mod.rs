//! The functions of an FMU for co-simulation and model exchange, FMI 2.0 (two.rs) and 3.0 (three.rs), without Python: the library
//! in an FMU is this one.
//!
//! Where a library may leave symbols open until it is loaded, the module of Python is the FMU's library too, its references to Python
//! made weak (emsim/fmus/library.py). Elsewhere it is built without the feature `python`.
//!
//! No panic passes a function's end: what should not happen is a fatal error there, and the instance takes no further call.

/// What both versions have alike: the functions of a component. (Arguments behind those named are left to the caller, whatever they are.)
macro_rules! of_component {
    ($($(#[doc = $doc:literal])* $name:ident: |$c:tt $(, $arg:ident: $type:ty)*| $what:expr;)*) => {$(
        $(#[doc = $doc])*
        #[no_mangle]
        pub unsafe extern "C" fn $name(c: *mut c_void $(, $arg: $type)*) -> c_int {
            with(c, |$c| $what)
        }
    )*};
}

/// Variables of other types than `$real`: there are none.
macro_rules! no_variables {
    ($real:literal: $($name:ident)*) => {of_component! {$(
        $name: |_, _vr: *const u32, n: usize| match n {
            0 => Ok(()),
            _ => Err(concat!(stringify!($name), ": all variables of this model are ", $real).into()),
        };
    )*}};
}

/// What the model description says that it cannot do.
macro_rules! refused {
    ($($name:ident)*) => {of_component! {$(
        $name: |_| Err(concat!(stringify!($name), " is not supported").into());
    )*}};
}

mod three;
mod two;

use crate::packed::instance::Instance;
use crate::packed::Packed;
use std::ffi::{c_char, c_void, CStr, CString};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::path::{Path, PathBuf};

const OK: i32 = 0; // fmi2Status (FMI 2.0, section 2.1.3)
const WARNING: i32 = 1; // the same
const ERROR: i32 = 3; // the same; 2 is fmi2Discard
const FATAL: i32 = 4; // the same

/// In the folder `resources` of an FMU.
const MODEL: &str = "model.emsim";
/// Category of a message, by its status.
fn category(status: i32) -> &'static CStr {
    match status {
        WARNING => c"logStatusWarning",
        _ => c"logStatusError",
    }
}

/// Who is told what went wrong: status and text.
type Log = Box<dyn Fn(&CStr, i32, &CStr)>;

/// What a component pointer points to.
struct Component {
    name: CString,
    instance: Instance,
    log: Log,
    broken: bool,
}

impl Component {
    fn tell(&self, status: i32, text: &str) {
        (self.log)(&self.name, status, &c_text(text));
    }
}

fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// SAFETY: null, or a C string.
unsafe fn text_at<'a>(p: *const c_char) -> Option<&'a str> {
    if p.is_null() {
        return None;
    }
    CStr::from_ptr(p).to_str().ok()
}

/// SAFETY: null where `n` is 0, else `n` values.
unsafe fn slice<'a, T>(p: *const T, n: usize) -> &'a [T] {
    if n == 0 || p.is_null() {
        return &[];
    }
    std::slice::from_raw_parts(p, n)
}

/// SAFETY: null where `n` is 0, else room for `n` values that nobody else uses.
unsafe fn slice_mut<'a, T>(p: *mut T, n: usize) -> &'a mut [T] {
    if n == 0 || p.is_null() {
        return &mut [];
    }
    std::slice::from_raw_parts_mut(p, n)
}

/// SAFETY: null, or a place for a value.
unsafe fn put<T>(p: *mut T, value: T) {
    if !p.is_null() {
        p.write(value);
    }
}

/// An instance of what lies in `resources`; null where that fails, and the log says why.
fn instantiate(name: &str, token: &str, resources: Option<PathBuf>, by_others: bool, log: Log) -> *mut c_void {
    let name = c_text(name);
    let made = catch_unwind(AssertUnwindSafe(|| {
        let folder = resources.ok_or("the FMU does not say where its resources are")?;
        let path = folder.join(MODEL);
        let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let packed = Packed::read(&bytes)?;
        if packed.token != token {
            return Err(format!("the description speaks of the model {token}, the resources hold {}", packed.token));
        }
        Instance::of(packed, by_others)
    }));
    match made {
        Ok(Ok(instance)) => Box::into_raw(Box::new(Component { name, instance, log, broken: false })).cast(),
        Ok(Err(text)) => {
            log(&name, ERROR, &c_text(&text));
            std::ptr::null_mut()
        }
        Err(panic) => {
            log(&name, FATAL, &c_text(&format!("a fault inside emsim: {}", said(&*panic))));
            std::ptr::null_mut()
        }
    }
}

/// SAFETY: null, or what `instantiate` gave, and no longer used.
unsafe fn free(c: *mut c_void) {
    if !c.is_null() {
        let component = Box::from_raw(c.cast::<Component>());
        let _ = catch_unwind(AssertUnwindSafe(|| drop(component)));
    }
}

/// Does it with the component, and gives the status.
/// SAFETY: null, or what `instantiate` gave; one call at a time, as FMI demands.
unsafe fn with(c: *mut c_void, what: impl FnOnce(&mut Component) -> Result<(), String>) -> i32 {
    let Some(component) = c.cast::<Component>().as_mut() else { return ERROR };
    if component.broken {
        return FATAL;
    }
    match catch_unwind(AssertUnwindSafe(|| what(component))) {
        Ok(Ok(())) => {
            for text in std::mem::take(&mut component.instance.told) {
                component.tell(WARNING, &text);
            }
            OK
        }
        Ok(Err(text)) => {
            // fmi2Discard: an importer's solver may try a shorter step
            let status = if std::mem::take(&mut component.instance.discards) { 2 } else { ERROR };
            component.tell(status, &text);
            status
        }
        Err(panic) => {
            component.broken = true;
            component.tell(FATAL, &format!("a fault inside emsim: {}", said(&*panic)));
            FATAL
        }
    }
}

fn said(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no more is known")
}

/// Values of variables, and values for variables.
fn get(component: &mut Component, references: &[u32], values: &mut [f64]) -> Result<(), String> {
    if references.len() != values.len() {
        return Err(format!("{} variables have one value each, not {}", references.len(), values.len()));
    }
    for (&reference, value) in references.iter().zip(values) {
        *value = component.instance.get(reference)?;
    }
    Ok(())
}

fn set(component: &mut Component, references: &[u32], values: &[f64]) -> Result<(), String> {
    if references.len() != values.len() {
        return Err(format!("{} variables take one value each, not {}", references.len(), values.len()));
    }
    references.iter().zip(values).try_for_each(|(&reference, &value)| component.instance.set(reference, value))
}

/// States of an instance, as FMI's functions hand them about.
/// SAFETY: `state` null, or a place that holds null or what this gave.
unsafe fn keep_state(component: &mut Component, state: *mut *mut c_void) -> Result<(), String> {
    let Some(place) = state.as_mut() else { return Err("there is no place for the state".into()) };
    let kept = Box::new(component.instance.keep()?);
    free_state(place);
    *place = Box::into_raw(kept).cast();
    Ok(())
}

/// SAFETY: as above.
unsafe fn free_state(state: *mut *mut c_void) {
    if let Some(place) = state.as_mut() {
        if !place.is_null() {
            drop(Box::from_raw(place.cast::<crate::packed::instance::Kept>()));
            *place = std::ptr::null_mut();
        }
    }
}

/// SAFETY: null, or what `keep_state` gave.
unsafe fn put_state(component: &mut Component, state: *mut c_void) -> Result<(), String> {
    match state.cast::<crate::packed::instance::Kept>().as_ref() {
        Some(kept) => component.instance.put_back(kept),
        None => Err("there is no such state".into()),
    }
}

/// A file: URI as a path; what is none is a path already.
fn path_of(uri: &str) -> PathBuf {
    let Some(rest) = uri.strip_prefix("file:") else { return Path::new(uri).to_path_buf() };
    let path = match rest.strip_prefix("//") {
        Some(host) => host.find('/').map_or("", |k| &host[k..]),
        None => rest,
    };
    let (mut bytes, mut left) = (Vec::new(), path.as_bytes());
    while let Some((&b, after)) = left.split_first() {
        let hex = |k: usize| after.get(k).and_then(|d| (*d as char).to_digit(16));
        match (b, hex(0), hex(1)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((16 * high + low) as u8);
                left = &after[2..];
            }
            _ => {
                bytes.push(b);
                left = after;
            }
        }
    }
    let path = String::from_utf8_lossy(&bytes).into_owned();
    // /C:/folder
    let drive = cfg!(windows) && path.len() > 2 && path.as_bytes()[2] == b':';
    PathBuf::from(if drive { &path[1..] } else { &path })
}

#[cfg(test)]
mod tests {
    use super::path_of;
    use std::path::Path;

    #[test]
    fn uris_are_paths() {
        for (uri, path) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/x", "/tmp/x"),
            ("file://localhost/tmp/x", "/tmp/x"),
            ("/tmp/100%/x", "/tmp/100%/x"),
        ] {
            assert_eq!(path_of(uri), Path::new(path));
        }
    }
}
