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
        pub unsafe extern "C" fn two(
            journal: *mut c_void, _: *const c_char, status: c_int, _: *const c_char, text: *const c_char,
            $($word: usize,)* $($number: f64),*
        ) {
            // (of more nobody knows where they lie: the message is told as it was written)
            let (words, numbers) = ([$(stringify!($word)),*].len(), [$(stringify!($number)),*].len());
            if let (false, Some(journal)) = (fits(text, words, numbers), journal.cast::<Journal>().as_ref()) {
                return journal.write(status, text_at(text));
            }
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
logger!(a b c d e f g h i j k l m n o p q r s t u v w x; n0 n1 n2 n3 n4 n5 n6 n7);

/// Does a format ask for so many words and numbers at most? (ISO C, 7.21.6.1: flags, width, precision, length, conversion; a star is an
/// integer; eight numbers lie in registers of their own, what comes behind them between the words.)
#[cfg(all(unix, not(target_vendor = "apple")))]
unsafe fn fits(format: *const c_char, words: usize, numbers: usize) -> bool {
    let (mut asked, mut floats) = (0, 0);
    let text = text_at(format);
    let mut left = text.bytes();
    while let Some(byte) = left.next() {
        if byte != b'%' {
            continue;
        }
        for byte in left.by_ref() {
            match byte {
                b'%' => break,
                b'*' => asked += 1,
                b'e' | b'E' | b'f' | b'F' | b'g' | b'G' | b'a' | b'A' => {
                    floats += 1;
                    break;
                }
                b'L' => return false, // a long double lies elsewhere
                b'h' | b'l' | b'j' | b'z' | b't' | b'q' => {}
                letter if letter.is_ascii_alphabetic() => {
                    asked += 1;
                    break;
                }
                _ => {}
            }
        }
    }
    asked <= words && floats <= numbers
}

#[cfg(all(test, unix, not(target_vendor = "apple")))]
mod tests {
    use super::fits;

    #[test]
    fn a_format_asks_for_so_many() {
        for (format, words, numbers) in
            [(c"100 %% of %s", 1, 0), (c"%-*.*f at %5.2lf of %lu", 3, 2), (c"%d %i %u %x %c %p %s %zu %lld", 9, 0)]
        {
            // SAFETY: a C string
            unsafe {
                assert!(fits(format.as_ptr(), words, numbers));
                assert!(words == 0 || !fits(format.as_ptr(), words - 1, numbers));
                assert!(numbers == 0 || !fits(format.as_ptr(), words, numbers - 1));
            }
        }
        // SAFETY: as above
        assert!(unsafe { !fits(c"%Lf".as_ptr(), 9, 9) });
    }
}

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
