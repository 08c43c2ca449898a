//! Recorded waveforms: time and the asked outputs at every kept point, row by row.
use crate::graph::{Graph, Id, Node};
use crate::invariants::Invariants;
use crate::ledger::Ledger;
use crate::raw::Stream;
use crate::system::{System, Work};
use crate::tangent::Tangent;
use crate::tape::{Inputs, Tape};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::Arc;

mod inside;
pub use inside::Samples;

/// What the record and those who watch the run tell each other.
#[derive(Default)]
pub struct Gate {
    /// rows are to be passed on to the file
    pub due: AtomicBool,
    /// there is no memory for further rows
    pub full: AtomicBool,
}

pub struct Record {
    unknowns: Vec<u32>,      // index of the unknown of every output; 0 where a probe overwrites it
    probes: Vec<(u32, u32)>, // column of the row, output of the tape
    tape: Tape,
    scratch: Vec<f64>,
    reads: Vec<u32>, // unknowns that any output depends on
    sources: bool,   // does one depend on a source itself?
    pub columns: usize,
    pub data: Vec<f64>,
    /// times of rows at which signals may bend or jump
    pub corners: Vec<f64>,
    /// energy accounts, where they were asked for
    pub ledger: Option<Ledger>,
    /// the insides of steps, where they were asked for
    pub samples: Option<Box<Samples>>,
    /// sensitivities, where they were asked for
    pub tangent: Option<Box<Tangent>>,
    /// what must hold at every row of a transient
    pub invariants: Option<Invariants>,
    /// an unknown that the rows show wrongly by a tenth: for tests of what is told then
    pub spoiled: Option<usize>,
    /// the file that rows go to while the run goes on
    pub stream: Option<Stream>,
    pub gate: Arc<Gate>,
}

impl Record {
    pub fn new(g: &Graph, outputs: &[Id]) -> Record {
        let (mut probes, mut ids, mut unknowns) = (Vec::new(), Vec::new(), Vec::new());
        for (k, &id) in outputs.iter().enumerate() {
            if let Node::Unknown(i) = g.node(id) {
                unknowns.push(i);
            } else {
                unknowns.push(0);
                probes.push((k as u32 + 1, ids.len() as u32));
                ids.push(id);
            }
        }
        let tape = Tape::new(g, &ids).native();
        let scratch = tape.workspace();
        let unknown = |&id: &Id| if let Node::Unknown(i) = g.node(id) { Some(i) } else { None };
        let reachable = g.reachable(outputs);
        let reads = reachable.iter().filter_map(unknown).collect();
        let sources = reachable.iter().any(|&id| matches!(g.node(id), Node::Wave(_)));
        Record {
            unknowns,
            probes,
            tape,
            scratch,
            reads,
            sources,
            columns: outputs.len() + 1,
            data: Vec::new(),
            corners: Vec::new(),
            ledger: None,
            samples: None,
            tangent: None,
            invariants: None,
            spoiled: None,
            stream: None,
            gate: Arc::default(),
        }
    }

    pub fn reads(&self) -> &[u32] {
        &self.reads
    }

    /// Is anything of sources to be seen that only edges read?
    pub fn shows_silent(&self, sys: &System) -> bool {
        self.sources || self.ledger.is_some() || self.reads.iter().any(|&i| sys.edges.pins(i as usize))
    }

    /// Of every column: is it a state that no source fixes? Such a one goes on smoothly where a source has a corner.
    pub fn steady(&self, sys: &System) -> Vec<bool> {
        let alone = sys.alone();
        let state = |&i: &u32| sys.differential.get(i as usize) == Some(&true) && !alone[i as usize];
        let mut steady: Vec<bool> = std::iter::once(true).chain(self.unknowns.iter().map(state)).collect();
        for &(column, _) in &self.probes {
            steady[column as usize] = false;
        }
        steady
    }

    pub fn rows(&self) -> usize {
        self.data.len() / self.columns
    }

    /// Rows go to the file; room for the next one. False where there is none.
    #[cold]
    #[inline(never)]
    fn turn(&mut self) -> bool {
        if self.gate.due.swap(false, Relaxed) {
            if let Some(stream) = &mut self.stream {
                stream.append(&self.data);
            }
        }
        let length = self.data.len();
        if self.data.capacity() - length >= self.columns {
            return true;
        }
        // twice as much; near the end of memory less
        // room for so many numbers to begin with
        // where there is no room for so many more, memory is at its end: what is left is for all else
        let wanted = [length, length / 8, (1 << 20)].map(|more| more.max(self.columns).max(512));
        let found = wanted.iter().any(|&more| self.data.try_reserve_exact(more).is_ok());
        match found {
            true => prefer_huge_pages(&self.data),
            false => self.gate.full.store(true, Relaxed),
        }
        found
    }

    #[inline(always)]
    pub fn push(&mut self, sys: &System, w: &mut Work, t: f64, x: &[f64]) {
        let mut wrong = Vec::new();
        let x = match self.spoiled {
            Some(k) => {
                wrong.extend_from_slice(x);
                wrong[k] *= 1.1;
                self.invariants.iter_mut().for_each(Invariants::forget);
                &wrong
            }
            None => x,
        };
        if let Some(invariants) = &mut self.invariants {
            invariants.row(sys, w, t, x);
        }
        if !self.tape.is_empty() {
            sys.set_time(w, t);
            self.tape.run(&Inputs { x, t, waves: &w.waves, flags: &w.flags }, &mut self.scratch);
        }
        let row = self.data.len();
        if (self.data.capacity() < row + self.columns || self.gate.due.load(Relaxed)) && !self.turn() {
            return;
        }
        self.data.push(t);
        self.data.extend(self.unknowns.iter().map(|&i| x.get(i as usize).copied().unwrap_or(0.0)));
        for &(column, output) in &self.probes {
            self.data[row + column as usize] = self.tape.output(&self.scratch, output as usize);
        }
    }
}

/// Asks for large pages behind a large buffer, before it is touched: page by page the system takes longer to hand out and
/// clear the memory of a long record than the solver takes for some circuits. Only a hint; nothing depends on it.
fn prefer_huge_pages(data: &Vec<f64>) {
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 1 << 12; // 4 KiB
        const HUGE: usize = 1 << 21; // 2 MiB, as on x86-64; elsewhere the hint is refused, no more
        let bytes = data.capacity() * std::mem::size_of::<f64>();
        if bytes >= 2 * HUGE {
            // whole pages, so that a mapping of its own stays in one piece and can be moved when it grows
            let start = data.as_ptr() as usize & !(PAGE - 1);
            let end = (data.as_ptr() as usize + bytes).next_multiple_of(PAGE);
            // SAFETY: MADV_HUGEPAGE changes neither content nor access of any page, be it of `data` or of a neighbour
            unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = data;
}
