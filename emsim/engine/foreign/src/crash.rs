//! A library that crashes, or that ends the program, must not pass for a run that has ended. While one of its functions is called a fault
//! (SIGSEGV and the like) or `exit` says whose it was, removes what was unpacked, and ends the process with the exit code of the outside
//! world. All that is done there is allowed in a signal handler (POSIX, 2.4.3): write, unlink, rmdir, _exit. On Windows the process ends
//! by the system's own exception code.
use super::Spec;
use std::cell::Cell;
use std::ffi::{CStr, CString};

/// What is said and done in the end.
pub struct Scene {
    words: CString,
    files: Vec<CString>,
    folders: Vec<CString>,
}

impl Scene {
    pub fn new(spec: &Spec) -> Scene {
        let text = |s: &String| CString::new(s.replace('\0', " ")).unwrap_or_default();
        Scene {
            words: text(&spec.last_words),
            files: spec.files.iter().map(text).collect(),
            folders: spec.folders.iter().map(text).collect(),
        }
    }
}

#[derive(Clone, Copy)]
struct Call {
    scene: *const Scene,
    function: &'static CStr,
}

thread_local! {
    static CALL: Cell<Option<Call>> = const { Cell::new(None) };
}

/// The call of a function of the library.
pub fn guarded<T>(scene: &Scene, function: &'static CStr, call: impl FnOnce() -> T) -> T {
    #[cfg(unix)]
    handlers::ready();
    let before = CALL.replace(Some(Call { scene, function }));
    let result = call();
    CALL.set(before);
    result
}

#[cfg(unix)]
mod handlers {
    use super::{Call, CALL};
    use std::cell::Cell;
    use std::ffi::CStr;
    use std::sync::Once;

    const SIGNALS: [libc::c_int; 5] = [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGABRT];
    static READY: Once = Once::new();
    static mut BEFORE: [Option<libc::sigaction>; SIGNALS.len()] = [None; SIGNALS.len()];

    thread_local! {
        static HAS_STACK: Cell<bool> = const { Cell::new(false) };
    }

    pub fn ready() {
        READY.call_once(|| {
            // SAFETY: plain calls of the C library; BEFORE is written here alone, before any handler can run
            unsafe {
                for (k, &signal) in SIGNALS.iter().enumerate() {
                    let mut action: libc::sigaction = std::mem::zeroed();
                    let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = handle;
                    action.sa_sigaction = handler as usize;
                    action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
                    let mut before: libc::sigaction = std::mem::zeroed();
                    if libc::sigaction(signal, &action, &mut before) == 0 {
                        let place = std::ptr::addr_of_mut!(BEFORE).cast::<Option<libc::sigaction>>();
                        place.add(k).write(Some(before));
                    }
                }
                libc::atexit(at_exit);
            }
        });
        if !HAS_STACK.replace(true) {
            // SAFETY: the memory is this thread's from here on
            unsafe {
                let mut now: libc::stack_t = std::mem::zeroed();
                if libc::sigaltstack(std::ptr::null(), &mut now) == 0 && now.ss_flags & libc::SS_DISABLE != 0 {
                    // a stack of its own for the handler: that of the thread may be what has overflowed. (With registers of
                    // wide vector units the system writes down 11 kB there before the handler begins, more than SIGSTKSZ on Linux.)
                    let room = Box::leak(vec![0u8; 4 * libc::SIGSTKSZ].into_boxed_slice());
                    let own = libc::stack_t { ss_sp: room.as_mut_ptr().cast(), ss_flags: 0, ss_size: room.len() };
                    libc::sigaltstack(&own, std::ptr::null_mut());
                }
            }
        }
    }

    extern "C" fn handle(signal: libc::c_int, _: *mut libc::siginfo_t, _: *mut libc::c_void) {
        if let Ok(Some(call)) = CALL.try_with(std::cell::Cell::get) {
            end(call, c" crashes in ");
        }
        // not of a library: as before, by the instruction that is done again
        // SAFETY: as above; BEFORE is no longer written
        unsafe {
            if let Some(k) = SIGNALS.iter().position(|&s| s == signal) {
                let place = std::ptr::addr_of!(BEFORE).cast::<Option<libc::sigaction>>();
                if let Some(before) = place.add(k).read() {
                    libc::sigaction(signal, &before, std::ptr::null_mut());
                    if signal == libc::SIGABRT {
                        libc::raise(signal);
                    }
                }
            }
        }
    }

    extern "C" fn at_exit() {
        if let Ok(Some(call)) = CALL.try_with(std::cell::Cell::get) {
            end(call, c" ends the program in ");
        }
    }

    fn say(text: &CStr) {
        // SAFETY: as long as it is
        unsafe { libc::write(2, text.as_ptr().cast(), text.to_bytes().len()) };
    }

    fn end(call: Call, how: &CStr) -> ! {
        // SAFETY: the scene lives as long as its call
        let scene = unsafe { &*call.scene };
        for text in [scene.words.as_c_str(), how, call.function, c"\n"] {
            say(text);
        }
        // SAFETY: names of files and folders that were unpacked for this run
        unsafe {
            scene.files.iter().for_each(|file| _ = libc::unlink(file.as_ptr()));
            scene.folders.iter().for_each(|folder| _ = libc::rmdir(folder.as_ptr()));
            // the exit code of the outside world (cli/console.py)
            libc::_exit(5)
        }
    }
}
