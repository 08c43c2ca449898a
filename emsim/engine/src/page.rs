//! The functions that a page in a browser calls (outputs/web/engine.js): a packed deck is opened, given values, run as a whole or led step by
//! step. Numbers and bytes alone pass; text is UTF-8 in memory that the page reads. One deck a module: a page has one open.
//!
//! Whatever fails leaves its sentence in `page_text`. A panic does too, and then ends the module.
use crate::packed::instance::Instance;
use crate::packed::Packed;
use crate::record::Record;
use std::cell::RefCell;

#[derive(Default)]
struct Page {
    open: Option<Instance>,
    record: Option<Record>,
    row: Vec<f64>,
}

thread_local! {
    static PAGE: RefCell<Page> = RefCell::default();
    static TEXT: RefCell<String> = RefCell::default();
}

/// Does it with the open deck: 1, or 0 where it fails.
fn with<T>(what: impl FnOnce(&mut Page, &mut Instance) -> Result<T, String>) -> Option<T> {
    PAGE.with_borrow_mut(|page| {
        let Some(mut instance) = page.open.take() else {
            TEXT.set("no deck is open".into());
            return None;
        };
        let done = what(page, &mut instance);
        page.open = Some(instance);
        done.map_err(|said| TEXT.set(said)).ok()
    })
}

/// Room for n bytes, to be written by the page and handed to `page_open`.
#[no_mangle]
pub extern "C" fn page_room(n: usize) -> *mut u8 {
    Box::into_raw(vec![0u8; n].into_boxed_slice()).cast()
}

/// The packed deck in the n bytes that `page_room` gave, compiled. How many numbers a row of it has, or -1.
/// # Safety
/// `at` is what `page_room(n)` gave, handed over once.
#[no_mangle]
pub unsafe extern "C" fn page_open(at: *mut u8, n: usize) -> i32 {
    std::panic::set_hook(Box::new(|panic| TEXT.set(format!("a fault inside emsim: {panic}"))));
    // SAFETY: the caller's promise
    let bytes = unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(at, n)) };
    let made = Packed::read(&bytes).and_then(|packed| {
        let count = 1 + packed.outputs.len();
        Instance::new(packed).map(|instance| (instance, count))
    });
    PAGE.with_borrow_mut(|page| match made {
        Ok((instance, count)) => {
            page.open = Some(instance);
            count as i32
        }
        Err(said) => {
            TEXT.set(said);
            -1
        }
    })
}

/// The value of an input, by its place among them.
#[no_mangle]
pub extern "C" fn page_set(input: u32, value: f64) -> u32 {
    with(|_, deck| deck.set(input + 1, value)).is_some() as u32
}

/// The whole transient with the values as they are. How many rows there are: `page_rows` gives them. Where it fails before its
/// end `page_text` says why, and is empty where it does not.
#[no_mangle]
pub extern "C" fn page_run() -> usize {
    let rows = with(|page, deck| {
        let (record, done) = deck.whole();
        TEXT.set(done.err().unwrap_or_default());
        let rows = record.rows();
        page.record = Some(record);
        Ok(rows)
    });
    rows.unwrap_or(0)
}

/// The rows of the last run, one after the other: time and outputs.
#[no_mangle]
pub extern "C" fn page_rows() -> *const f64 {
    PAGE.with_borrow(|page| page.record.as_ref().map_or(std::ptr::null(), |record| record.data.as_ptr()))
}

/// To the start of a run that is led, with the values as they are.
#[no_mangle]
pub extern "C" fn page_start() -> u32 {
    let done = with(|page, deck| {
        page.record = None;
        deck.restart()?;
        deck.outputs(&mut page.row)
    });
    done.is_some() as u32
}

/// On by h [s].
#[no_mangle]
pub extern "C" fn page_step(h: f64) -> u32 {
    let done = with(|page, deck| {
        deck.step(deck.time(), h)?;
        deck.outputs(&mut page.row)
    });
    done.is_some() as u32
}

/// Time and outputs where the run that is led stands.
#[no_mangle]
pub extern "C" fn page_row() -> *const f64 {
    PAGE.with_borrow(|page| page.row.as_ptr())
}

/// What the last call that failed, or a panic, has said.
#[no_mangle]
pub extern "C" fn page_text() -> *const u8 {
    TEXT.with_borrow(|text| text.as_ptr())
}

#[no_mangle]
pub extern "C" fn page_text_length() -> usize {
    TEXT.with_borrow(|text| text.len())
}
