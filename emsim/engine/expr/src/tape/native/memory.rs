//! Executable memory. What the system takes to map, write, protect and unmap pages takes longer than writing a small program.
//! So programs lie side by side in the pages of a file in memory, where the system has such (Linux): they are
//! mapped to be executed, and written through the file. At no address are they writable.
//!
//! Pages are shared with a forked child: what has been written is never written again, a child begins pages of its own, and all
//! go when the last program in them does.
use std::sync::Arc;

/// Code that stays where it is.
pub struct Code {
    start: *const u8,
    _pages: Arc<Pages>,
}

// SAFETY: never written after it was made
unsafe impl Send for Code {}
unsafe impl Sync for Code {}

impl Code {
    /// None where the system forbids executable memory.
    pub fn new(code: &[u8]) -> Option<Code> {
        shared(code).or_else(|| own(code))
    }

    pub fn start(&self) -> *const u8 {
        self.start
    }
}

/// A mapping.
struct Pages {
    execute: *mut libc::c_void,
    length: usize,
}

// SAFETY: only addresses; what lies there is written once, under the lock below, before anybody executes it
unsafe impl Send for Pages {}
unsafe impl Sync for Pages {}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: mapped with this length, and nobody holds code in it any more
        unsafe {
            libc::munmap(self.execute, self.length);
        }
    }
}

/// Pages of its own.
fn own(code: &[u8]) -> Option<Code> {
    // SAFETY: a fresh private mapping, written before it becomes executable and read-only
    unsafe {
        let (length, none) = (code.len(), std::ptr::null_mut());
        let access = libc::PROT_READ | libc::PROT_WRITE;
        let execute = libc::mmap(none, length, access, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS, -1, 0);
        if execute == libc::MAP_FAILED {
            return None;
        }
        let pages = Pages { execute, length };
        std::ptr::copy_nonoverlapping(code.as_ptr(), execute.cast::<u8>(), length);
        if libc::mprotect(execute, length, libc::PROT_READ | libc::PROT_EXEC) != 0 {
            return None;
        }
        Some(Code { start: execute.cast(), _pages: Arc::new(pages) })
    }
}

#[cfg(not(target_os = "linux"))]
fn shared(_: &[u8]) -> Option<Code> {
    None
}

/// Behind the programs that were written last.
#[cfg(target_os = "linux")]
fn shared(code: &[u8]) -> Option<Code> {
    use std::fs::File;
    use std::os::unix::fs::FileExt;
    struct Current {
        pages: Arc<Pages>,
        file: File,
        used: usize,
        process: u32,
    }
    static CURRENT: std::sync::Mutex<Option<Current>> = std::sync::Mutex::new(None);

    let mut current = CURRENT.lock().ok()?;
    let process = std::process::id();
    if current.as_ref().is_none_or(|c| c.process != process || c.used + code.len() > c.pages.length) {
        // bytes that are asked for at once
        let (pages, file) = mapped((1 << 18).max(code.len()))?;
        *current = Some(Current { pages: Arc::new(pages), file, used: 0, process });
    }
    let current = current.as_mut()?;
    let at = current.used;
    current.file.write_all_at(code, at as u64).ok()?;
    // x86 keeps its caches of instructions coherent; what was never executed cannot be held in the pipeline either
    // of the cache, where a program begins
    current.used = (at + code.len()).next_multiple_of(64);
    // SAFETY: within the pages
    let start = unsafe { current.pages.execute.cast::<u8>().add(at) };
    Some(Code { start, _pages: current.pages.clone() })
}

#[cfg(target_os = "linux")]
fn mapped(length: usize) -> Option<(Pages, std::fs::File)> {
    use std::os::fd::{AsRawFd, FromRawFd};
    // SAFETY: a fresh file that nobody else knows
    let file = unsafe {
        let file = libc::memfd_create(c"emsim".as_ptr(), libc::MFD_CLOEXEC);
        (file >= 0).then(|| std::fs::File::from_raw_fd(file))?
    };
    file.set_len(length as u64).ok()?;
    let access = libc::PROT_READ | libc::PROT_EXEC;
    // SAFETY: a fresh mapping of that file
    let execute = unsafe { libc::mmap(std::ptr::null_mut(), length, access, libc::MAP_SHARED, file.as_raw_fd(), 0) };
    (execute != libc::MAP_FAILED).then_some((Pages { execute, length }, file))
}
