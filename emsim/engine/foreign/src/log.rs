//! What an FMU says: kept until its call has ended, so that a failure is told with its reason.
use super::Spec;
use std::ffi::{c_char, c_int, c_void, CStr};
use std::sync::{Arc, Mutex};

/// How a call went (FMI 2.0, section 2.1.3; FMI 3.0, section 2.2.4): its numbers are those of both versions.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Debug)]
pub enum Status {
    Ok,
    Warning,
    Discard,
    Error,
    Fatal,
    Unknown,
}

impl Status {
    pub fn of(number: c_int) -> Status {
        let all = [Status::Ok, Status::Warning, Status::Discard, Status::Error, Status::Fatal];
        usize::try_from(number).ok().and_then(|k| all.get(k).copied()).unwrap_or(Status::Unknown)
    }
}

/// Where the callbacks of an instance write to.
pub struct Journal {
    spec: Arc<Spec>,
    recent: Mutex<Vec<String>>,
}

impl Journal {
    pub fn new(spec: &Arc<Spec>) -> Box<Journal> {
        Box::new(Journal { spec: spec.clone(), recent: Mutex::new(Vec::new()) })
    }

    fn write(&self, status: c_int, text: String) {
        let text = text.trim().to_string();
        let status = Status::of(status);
        if status >= Status::Discard {
            if let Ok(mut recent) = self.recent.lock() {
                recent.push(text.clone());
            }
        }
        if status == Status::Warning || self.spec.logs {
            self.spec.tell(text);
        }
    }

    /// The reason why a call failed, where it was said.
    pub fn reason(&self) -> String {
        let said = self.recent.lock().map(|mut recent| std::mem::take(&mut *recent)).unwrap_or_default();
        said.join("; ")
    }
}

/// SAFETY: null, or a C string.
unsafe fn text_at(p: *const c_char) -> String {
    if p.is_null() {
        return String::new();
    }
    CStr::from_ptr(p).to_string_lossy().into_owned()
}

/// fmi3LogMessageCallback.
pub unsafe extern "C" fn three(journal: *mut c_void, status: c_int, _category: *const c_char, text: *const c_char) {
    if let Some(journal) = journal.cast::<Journal>().as_ref() {
        journal.write(status, text_at(text));
    }
}

/// fmi2CallbackLogger, which has a variable number of arguments as printf has: they are handed on to the C library as they lie. On x86-64 and
/// on aarch64 (but for Apple's) integers and pointers come in registers, then on the stack, numbers in registers of their own, in the same
/// order as `snprintf` finds them.
#[cfg(all(unix, not(target_vendor = "apple")))]
macro_rules! logger {
    ($($word:ident)*; $($number:ident)*) => {
        #[allow(clippy::too_many_arguments)]
        pub unsafe extern "C" fn two(
            journal: *mut c_void, _: *const c_char, status: c_int, _: *const c_char, text: *const c_char,
            $($word: usize,)* $($number: f64),*
        ) {
            // what is longer is cut
            let mut room = [0 as c_char; libc::BUFSIZ as usize];
            if !text.is_null() {
                libc::snprintf(room.as_mut_ptr(), room.len(), text, $($word,)* $($number),*);
            }
            if let Some(journal) = journal.cast::<Journal>().as_ref() {
                journal.write(status, text_at(room.as_ptr()));
            }
        }
    };
}
#[cfg(all(unix, not(target_vendor = "apple")))]
logger!(a b c d e f g h; r s t u v w x y);

#[cfg(not(all(unix, not(target_vendor = "apple"))))]
pub unsafe extern "C" fn two(
    journal: *mut c_void,
    _: *const c_char,
    status: c_int,
    _: *const c_char,
    text: *const c_char,
) {
    // (what stands for %s and the like is not known here)
    if let Some(journal) = journal.cast::<Journal>().as_ref() {
        journal.write(status, text_at(text));
    }
}
