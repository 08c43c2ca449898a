//! Ctrl-C: one token, at which everything looks that may take long.
//!
//! Whoever has done some work says so (`spent`). When that has come to enough, the token is looked at, and where an end is asked for, the
//! phase is left by unwinding up to `guarded`, which stands about every entry: no phase needs a way out of its own.
mod endless;

pub use endless::{fail, failed};
use endless::{FAILED, OWN};
use std::cell::Cell;
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Between two looks at the token, which needs the caller's lock.
pub const PATIENCE: Duration = Duration::from_millis(20);

static ASK: OnceLock<fn() -> bool> = OnceLock::new();
/// For threads that may not ask themselves.
static ASKED: AtomicBool = AtomicBool::new(false);

thread_local! {
    static DONE: Cell<usize> = const { Cell::new(0) };
    static LAST: Cell<Option<Instant>> = const { Cell::new(None) };
    static GUARDS: Cell<usize> = const { Cell::new(0) };
    /// One that its entry waits for: it is told, and asks nobody (the entry has the caller's lock).
    static BESIDE: Cell<bool> = const { Cell::new(false) };
    static FOUND: Cell<bool> = const { Cell::new(false) };
}

/// What unwinds.
pub struct Interrupted;

/// How an entry's thread finds out whether an end is asked for.
pub fn ask_by(ask: fn() -> bool) {
    let _ = ASK.set(ask);
}

/// So much work was done, in elementary operations.
#[inline(always)]
pub fn spent(operations: usize) {
    DONE.with(|done| {
        let sum = done.get().saturating_add(operations);
        done.set(sum);
        // elementary operations between two looks at the clock: some tenths of a millisecond
        if sum >= 200_000 {
            look();
        }
    });
}

#[cold]
#[inline(never)]
fn look() {
    DONE.set(0);
    let asks = || GUARDS.get() > 0 && LAST.get().is_none_or(|last| last.elapsed() >= PATIENCE) && asked();
    if BESIDE.get() && ASKED.load(Relaxed) || asks() {
        resume_unwind(Box::new(Interrupted));
    }
}

/// Is an end asked for?
pub fn asked() -> bool {
    LAST.set(Some(Instant::now()));
    if !ASKED.load(Relaxed) && ASK.get().is_some_and(|ask| ask()) {
        FOUND.set(true);
        ASKED.store(true, Relaxed);
    }
    ASKED.load(Relaxed) || OWN.with_borrow(Option::is_some)
}

/// Work of an entry, or of a thread for one; other panics go on. Where an end was asked for, work that is done meanwhile is ended too.
pub fn guarded<T>(run: impl FnOnce() -> T) -> Result<T, Interrupted> {
    if GUARDS.get() == 0 {
        OWN.take();
    }
    GUARDS.set(GUARDS.get() + 1);
    let done = catch_unwind(AssertUnwindSafe(run));
    GUARDS.set(GUARDS.get() - 1);
    // who has found it, forgets it: the next entry is asked for anew
    let outermost = GUARDS.get() == 0;
    let heard = outermost && (FOUND.replace(false) || FAILED.lock().is_ok_and(|why| why.is_some()));
    let found = heard || outermost && OWN.with_borrow(Option::is_some);
    if heard {
        ASKED.store(false, Relaxed);
    }
    match done {
        Ok(value) if !found => Ok(value),
        Err(other) if !other.is::<Interrupted>() => resume_unwind(other),
        _ => Err(Interrupted),
    }
}

/// Work of a thread that its entry waits for.
pub fn beside<T>(run: impl FnOnce() -> T) -> T {
    BESIDE.set(true);
    run()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_heard_where_the_work_ends_before_it_looks() {
        FOUND.set(true);
        assert!(guarded(|| ()).is_err() && guarded(|| ()).is_ok());
    }
}
