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
    rows: Vec<f64>,
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
        let mut instance = Instance::new(packed)?;
        instance.drawn = true;
        Ok((instance, count))
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

/// A coordinate that `page_place` may move, or that gives way: its unknown and that of its speed, or -1.
#[no_mangle]
pub extern "C" fn page_coordinate(unknown: u32, speed: i32) -> u32 {
    with(|_, deck| deck.may_move(unknown as usize, usize::try_from(speed).ok())).is_some() as u32
}

/// Where a coordinate is at the start; not a number: where the deck has it. The run that is led is over.
#[no_mangle]
pub extern "C" fn page_place(unknown: u32, value: f64) -> u32 {
    with(|_, deck| deck.place(unknown as usize, Some(value).filter(|v| v.is_finite()))).is_some() as u32
}

/// The outputs at the start that only hang on coordinates, in `page_led`.
#[no_mangle]
pub extern "C" fn page_pose() -> u32 {
    with(|page, deck| {
        deck.pose(&mut page.rows);
        Ok(())
    })
    .is_some() as u32
}

/// The energy accounts of the last run, in `page_led`: how many powers, energies and devices there are; of each power its integral, of
/// each device heat and charge, what went through each power and device, how far each energy went, energies at the start and at the end;
/// then the rows of their course. How many numbers, 0 where none are kept.
#[no_mangle]
pub extern "C" fn page_accounts() -> usize {
    PAGE.with_borrow_mut(|page| {
        page.rows.clear();
        let Some(ledger) = page.record.as_ref().and_then(|record| record.ledger.as_ref()) else { return 0 };
        let (powers, devices, (moved, swing)) = (ledger.powers(), ledger.devices(), ledger.turned_over());
        let counts = [powers.len(), ledger.first.len(), devices.len()].map(|n| n as f64);
        let rows = &mut page.rows;
        rows.extend(counts.into_iter().chain(powers));
        rows.extend(devices.into_iter().flat_map(|(heat, charge)| [heat, charge]));
        for more in [&moved, swing, &ledger.first, &ledger.last, ledger.trace.as_deref().unwrap_or(&[])] {
            rows.extend_from_slice(more);
        }
        rows.len()
    })
}

/// To the start of a run that is led, with the values as they are. How many numbers `page_led` has.
#[no_mangle]
pub extern "C" fn page_start() -> usize {
    led(|deck| deck.restart())
}

/// On by h [s]. How many numbers `page_led` has; where it fails `page_text` says why, and is empty where it does not.
#[no_mangle]
pub extern "C" fn page_step(h: f64) -> usize {
    led(|deck| deck.step(deck.time(), h))
}

fn led(what: impl FnOnce(&mut Instance) -> Result<(), String>) -> usize {
    let count = with(|page, deck| {
        TEXT.set(what(deck).err().unwrap_or_default());
        page.record = None;
        page.rows.clear();
        page.rows.extend_from_slice(deck.rows());
        Ok(page.rows.len())
    });
    count.unwrap_or(0)
}

/// The rows of the last step, one after the other: time and outputs.
#[no_mangle]
pub extern "C" fn page_led() -> *const f64 {
    PAGE.with_borrow(|page| page.rows.as_ptr())
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
