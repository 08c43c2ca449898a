//! Work that asks for its own end: a loop of a module that does not end.
use super::{Relaxed, ASKED, BESIDE};
use std::cell::RefCell;
use std::sync::{Mutex, PoisonError};

thread_local! {
    /// Why the work of this thread asks for its end.
    pub(super) static OWN: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// What was found by a thread that its entry waits for.
pub(super) static FAILED: Mutex<Option<String>> = Mutex::new(None);

/// An end is asked for by the work itself, for this reason: it has no answer.
pub fn fail(why: String) {
    if BESIDE.get() {
        FAILED.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
        ASKED.store(true, Relaxed);
    } else {
        OWN.with_borrow_mut(|own| own.get_or_insert(why).len());
    }
}

/// Why the work asked for its end, if it did.
pub fn failed() -> Option<String> {
    OWN.take().or_else(|| FAILED.lock().unwrap_or_else(PoisonError::into_inner).take())
}
