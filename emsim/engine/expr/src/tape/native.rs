//! Straight-line machine code for a tape: by an encoder of our own for x86-64 with AVX2 and FMA, by Cranelift elsewhere
//! (`cranelift.rs`). Where there is neither the tape is interpreted. `Code` chooses, and EMSIM_CODE may.
//!
//! Our own code: every instruction of the tape becomes one machine instruction on scalar doubles, in the tape's order and with its
//! rounding (no fused multiply-add), so both ways give the same numbers to the bit. An operand that is needed again stays in a
//! register, or waits in the workspace (`values.rs`). Functions of the mathematical library are calls (`calls.rs`), before
//! which everything that is still needed goes to the workspace. Sines and cosines stand in the code itself, those of up to four
//! arguments side by side (`sines.rs`). The same program runs on four sets of numbers when it is `wide`: every register, every place in memory
//! is four numbers then. Instructions take as few bytes as will do (`encode.rs`).
//!
//!   registers:  xmm0-13 values   xmm14, 15 scratch   the others in `encode.rs`
use super::{Inputs, Instr, Op};

#[cfg(all(target_arch = "x86_64", unix))]
mod calls;
#[cfg(cranelift)]
mod cranelift;
#[cfg(all(target_arch = "x86_64", unix))]
mod encode;
#[cfg(all(target_arch = "x86_64", unix))]
mod loops;
#[cfg(all(target_arch = "x86_64", unix))]
mod memory;
#[cfg(all(target_arch = "x86_64", unix))]
mod sequence;
#[cfg(all(target_arch = "x86_64", unix))]
mod sines;
#[cfg(all(target_arch = "x86_64", unix))]
mod values;

/// Not in the workspace.
pub const NOWHERE: u32 = u32::MAX;

/// What the code of one part is made from.
pub struct Part<'a> {
    pub code: &'a [Instr],
    pub first: usize, // slot of the first instruction
    /// where in the workspace the values of slots lie: constants, what outputs or other parts read; the others NOWHERE
    pub homes: &'a [u32],
    pub free: u32, // from here on the workspace is free
    pub functions: &'a [crate::graph::Fun],
    pub sign: u32, // slot of two -0.0
    /// slots whose values go to the results, in their order
    pub results: &'a [u32],
}

/// One sum of a Runge-Kutta method, over rows of a table:  [row `from` +] h sum a_j row_j, to the state or to another row.
pub struct Move<'a> {
    pub row: &'a [(usize, f64)],
    pub from: Option<usize>,
    pub to: &'a [To],
    /// the program is run on the state, its results go to this row
    pub run: Option<usize>,
}

#[derive(Clone, Copy)]
pub enum To {
    State,
    Row(usize),
}

/// How programs run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Code {
    /// machine code by the encoder of this folder
    Native,
    /// machine code by Cranelift
    Cranelift,
    Interpreted,
}

impl Code {
    const ALL: [(Code, &'static str); 3] =
        [(Code::Native, "native"), (Code::Cranelift, "cranelift"), (Code::Interpreted, "interpreted")];

    pub fn name(self) -> &'static str {
        Code::ALL.iter().find(|(code, _)| *code == self).map_or("", |found| found.1)
    }

    /// Can this engine, on this processor, do so?
    fn possible(self) -> bool {
        match self {
            Code::Native => cfg!(all(target_arch = "x86_64", unix)) && super::trig::vectors(),
            Code::Cranelift => cfg!(cranelift),
            Code::Interpreted => true,
        }
    }

    /// What the environment variable EMSIM_CODE asks for, or else the first that is possible. The error is a sentence.
    pub fn chosen() -> Result<Code, String> {
        static CHOSEN: std::sync::OnceLock<Result<Code, String>> = std::sync::OnceLock::new();
        CHOSEN.get_or_init(Code::choose).clone()
    }

    fn choose() -> Result<Code, String> {
        let possible: Vec<(Code, &str)> = Code::ALL.into_iter().filter(|(code, _)| code.possible()).collect();
        let asked = std::env::var("EMSIM_CODE").unwrap_or_default();
        match possible.iter().find(|(_, name)| asked.is_empty() || *name == asked) {
            Some(&(code, _)) => Ok(code),
            None => {
                let names: Vec<&str> = possible.iter().map(|p| p.1).collect();
                Err(format!("EMSIM_CODE={asked}: this engine, on this processor, knows {}", names.join(", ")))
            }
        }
    }
}

/// Workspace, unknowns, waves, results, flags, time.
type Entry = unsafe extern "C" fn(*mut f64, *const f64, *const f64, *mut f64, *const f64, *const f64);

/// The machine code of one part.
pub struct Native {
    pub length: u32, // of the workspace that it wants
    entry: Entry,
    _held: Box<dyn std::any::Any + Send + Sync>, // what keeps the code where it is
}

impl Native {
    /// None where it is to be interpreted.
    pub fn new(part: &Part) -> Option<Native> {
        match Code::chosen() {
            #[cfg(all(target_arch = "x86_64", unix))]
            Ok(Code::Native) => x86::program(part, false).map(Native::of),
            #[cfg(cranelift)]
            Ok(Code::Cranelift) => cranelift::program(part).map(Native::of),
            _ => None,
        }
    }

    /// The program on four sets of numbers side by side: of all that it reads and writes, four numbers are one; by our own encoder
    /// alone.
    #[allow(unused_variables)]
    pub fn four(part: &Part) -> Option<Native> {
        match Code::chosen() {
            #[cfg(all(target_arch = "x86_64", unix))]
            Ok(Code::Native) => x86::program(part, true).map(Native::of),
            _ => None,
        }
    }

    /// The program as the stages of a Runge-Kutta method, see `Sequence`; by our own encoder alone.
    #[allow(unused_variables)]
    pub fn sequence(part: &Part, moves: &[Move], width: usize, y: usize, h: usize) -> Option<Native> {
        match Code::chosen() {
            #[cfg(all(target_arch = "x86_64", unix))]
            Ok(Code::Native) => x86::sequence(part, moves, width, y, h).map(Native::of),
            _ => None,
        }
    }

    fn of<Held: Send + Sync + 'static>((entry, held, length): (Entry, Held, u32)) -> Native {
        Native { length, entry, _held: Box::new(held) }
    }

    /// # Safety
    /// `w` is a workspace of the tape, the inputs reach as far as the tape reads, and there is room for the results.
    #[inline]
    pub unsafe fn run(&self, inp: &Inputs, w: &mut [f64], results: *mut f64) {
        let (x, waves, flags) = (inp.x.as_ptr(), inp.waves.as_ptr(), inp.flags.as_ptr());
        (self.entry)(w.as_mut_ptr(), x, waves, results, flags, &inp.t);
    }

    /// # Safety
    /// As `run`; every time of the sequence at `times`, all its rows at `rows`, and room for whole vectors behind the
    /// state in `inp.x`, which is written.
    #[inline]
    pub unsafe fn run_sequence(&self, x: *mut f64, inp: &Inputs, w: &mut [f64], times: *const f64, rows: *mut f64) {
        (self.entry)(w.as_mut_ptr(), x, inp.waves.as_ptr(), rows, inp.flags.as_ptr(), times);
    }
}

#[cfg(all(target_arch = "x86_64", unix))]
mod x86 {
    use super::*;
    use crate::graph::Fun;

    /// The code of one part, and what it holds the addresses of.
    pub struct Held {
        _code: memory::Code,
        _functions: Box<[Fun]>,
        _coefficients: Box<[f64]>,
    }

    /// Entry, code, and length of the workspace that it wants. None where the system forbids executable memory.
    /// `wide`: on four numbers for each.
    pub fn program(part: &Part, wide: bool) -> Option<(Entry, Held, u32)> {
        let functions: Box<[Fun]> = part.functions.into();
        let mut writer = Writer::new(part, &functions, wide);
        writer.write()?;
        let (code, length) = (writer.out, writer.length);
        held(&code, length, functions, Box::default())
    }

    /// The program as the stages of a Runge-Kutta method, see `Sequence`.
    pub fn sequence(part: &Part, moves: &[Move], width: usize, y: usize, h: usize) -> Option<(Entry, Held, u32)> {
        let functions: Box<[Fun]> = part.functions.into();
        let coefficients: Box<[f64]> = moves.iter().flat_map(|m| m.row).map(|c| c.1).collect();
        let mut writer = Writer::new(part, &functions, false);
        writer.sequence(moves, &coefficients, width, y, h)?;
        let (code, length) = (writer.out, writer.length);
        held(&code, length, functions, coefficients)
    }

    fn held(code: &[u8], length: u32, functions: Box<[Fun]>, coefficients: Box<[f64]>) -> Option<(Entry, Held, u32)> {
        let code = memory::Code::new(code)?;
        // SAFETY: the code begins as a function of this kind
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(code.start()) };
        Some((entry, Held { _code: code, _functions: functions, _coefficients: coefficients }, length))
    }

    /// What memory operands are relative to.
    #[derive(Clone, Copy, PartialEq)]
    pub enum Base {
        Work,
        Unknowns,
        Waves,
        Results,
        Flags,
        Time,
        Table,
        Stack,
    }

    pub const VALUES: usize = 14; // registers that hold values, xmm0 to xmm13
    pub const MASK: u8 = 14; // xmm14
    pub const ZERO: u8 = 15; // xmm15
    pub const NEVER: u32 = u32::MAX; // no instruction

    #[derive(Clone, Copy)]
    pub enum Place {
        Register(u8),
        Memory { base: Base, index: u32 },
    }

    pub struct Writer<'a> {
        pub part: &'a Part<'a>,
        pub functions: &'a [Fun],
        pub out: Vec<u8>,
        pub holds: [Option<u32>; VALUES], // slot that a register holds
        pub register: Vec<u8>,            // of each own instruction; VALUES: none
        pub at: Vec<u32>,                 // where in the workspace its value lies
        pub left: Vec<u32>,               // places that are free again
        pub leaving: Vec<u32>,            // ... once the present instruction is written
        pub length: u32,                  // of the workspace
        pub uses: Vec<u32>,               // of all own instructions, one after the other
        pub ahead: Vec<(u32, u32)>,       // of each: which of them are still to come
        partner: Vec<u32>,                // of a sine its cosine and the other way round
        called: Vec<bool>,                // sines and cosines that are there already
        pub results: Vec<bool>,           // that have been written
        pub wanted: Vec<(u32, u32)>,      // slot and number of each result, by slot
        pub aside: Vec<Aside>,
        pub calls: bool,         // of the library, on the straight way
        pub wide: bool,          // four numbers in each register
        pub second: Option<u32>, // place of the second arguments of functions, when wide
        pub arguments: u32,      // place of the arguments of a loop, then of its results
    }

    /// Is it a function of the library?
    fn is_call(i: &Instr, wide: bool) -> bool {
        match i.op {
            Op::Sin | Op::Cos => wide,
            Op::Powi => !(2..=8).contains(&(i.b as i32)),
            op => matches!(op, Op::Exp | Op::Call | Op::Pow | Op::Atan2 | Op::Loop),
        }
    }

    /// What lies behind the program: for arguments of sines out of range, jumped to and back from.
    pub struct Aside {
        pub jump: usize,
        pub back: usize,
        pub lanes: u32,
    }

    impl<'a> Writer<'a> {
        fn new(part: &'a Part<'a>, functions: &'a [Fun], wide: bool) -> Writer<'a> {
            let n = part.code.len();
            let own = |slot: u32| (slot as usize).checked_sub(part.first);
            let mut ahead = vec![(0, 0); n];
            for k in part.code.iter().flat_map(Instr::operands).filter_map(own) {
                ahead[k].1 += 1;
            }
            let mut total = 0;
            for (from, count) in &mut ahead {
                (*from, total) = (total, total + *count);
                *count = *from;
            }
            let mut uses = vec![0; total as usize];
            let mut partner = vec![NEVER; n];
            let mut seen = std::collections::HashMap::new();
            for (k, i) in part.code.iter().enumerate() {
                for j in i.operands().filter_map(own) {
                    uses[ahead[j].1 as usize] = k as u32;
                    ahead[j].1 += 1;
                }
                if matches!(i.op, Op::Sin | Op::Cos) {
                    if let Some(other) = seen.insert(i.a, k as u32) {
                        partner[k] = other;
                        partner[other as usize] = k as u32;
                    }
                }
            }
            let mut wanted: Vec<(u32, u32)> = part.results.iter().zip(0..).map(|(&slot, i)| (slot, i)).collect();
            wanted.sort_unstable();
            Writer {
                part,
                functions,
                out: Vec::with_capacity(16 * n),
                holds: [None; VALUES],
                register: vec![VALUES as u8; n],
                at: vec![NOWHERE; n],
                left: Vec::new(),
                leaving: Vec::new(),
                length: part.free,
                uses,
                ahead,
                partner,
                called: vec![false; n],
                results: vec![false; part.results.len()],
                wanted,
                aside: Vec::new(),
                calls: part.code.iter().any(|i| is_call(i, wide)),
                wide,
                second: None,
                arguments: 0,
            }
        }

        /// Number of results.
        pub fn count(&self) -> usize {
            self.results.len()
        }

        fn write(&mut self) -> Option<()> {
            self.enter();
            self.program()?;
            self.leave();
            self.asides();
            Some(())
        }

        pub fn program(&mut self) -> Option<()> {
            for k in 0..self.part.code.len() {
                self.instruction(k)?;
                self.left.append(&mut self.leaving);
            }
            // results that no instruction computes last: constants, leaves, what went to the workspace
            for i in 0..self.results.len() {
                if !self.results[i] {
                    let from = self.place(self.part.results[i]);
                    self.copy(ZERO, from);
                    self.vex(0x11, F2, 1, ZERO, 0, Place::Memory { base: Base::Results, index: i as u32 });
                }
            }
            Some(())
        }

        fn instruction(&mut self, k: usize) -> Option<()> {
            let i = self.part.code[k];
            match i.op {
                Op::X | Op::Wave | Op::Flag | Op::T => {
                    if self.part.homes[self.part.first + k] != NOWHERE {
                        let from = self.place((self.part.first + k) as u32);
                        let r = self.result(k, &[]);
                        self.vex(0x10, F2, 1, r, 0, from);
                        self.done(k);
                    }
                }
                Op::Add | Op::Mul | Op::Sub | Op::Div | Op::NotLess => self.arithmetic(k),
                Op::Neg => {
                    let ra = self.load(i.a, &[]);
                    self.release(k);
                    let r = self.target(k, ra, &[ra]);
                    self.vex(0x57, P66, 1, r, ra, self.place(self.part.sign));
                    self.done(k);
                }
                Op::Sqrt => {
                    let ra = self.load(i.a, &[]);
                    self.release(k);
                    let r = self.target(k, ra, &[ra]);
                    // (of packed numbers it has no second operand)
                    self.vex(0x51, F2, 1, r, if self.wide { 0 } else { ra }, Place::Register(ra));
                    self.done(k);
                }
                Op::Select => {
                    // mask = (condition != 0); result = mask ? a : b
                    let rc = self.load(i.a, &[]);
                    let ra = self.load(i.b, &[rc]);
                    let rb = self.load(i.c, &[rc, ra]);
                    self.release(k);
                    let r = self.target(k, ra, &[rc, ra, rb]);
                    self.vex(0x57, P66, 1, ZERO, ZERO, Place::Register(ZERO));
                    self.vex(0xc2, F2, 1, MASK, rc, Place::Register(ZERO));
                    self.out.push(4); // not equal, or unordered
                    self.vex(0x4b, P66, 3, r, rb, Place::Register(ra));
                    self.out.push(MASK << 4);
                    self.done(k);
                }
                Op::Powi if !is_call(&i, self.wide) => self.whole_power(k),
                Op::Sin | Op::Cos if self.wide => self.function_of_four(k),
                Op::Sin | Op::Cos if self.called[k] => self.release(k),
                Op::Sin | Op::Cos => self.sines_cosines(k),
                Op::Exp | Op::Call | Op::Powi | Op::Pow | Op::Atan2 if self.wide => self.function_of_four(k),
                Op::Exp | Op::Call | Op::Powi | Op::Pow | Op::Atan2 => self.function(k),
                Op::Argument | Op::Loop | Op::Result => self.repeated(k),
                Op::Free => return None,
            }
            Some(())
        }

        /// A sum, product, difference, quotient or comparison.
        fn arithmetic(&mut self, k: usize) {
            let i = self.part.code[k];
            let opcode = match i.op {
                Op::Add => 0x58,
                Op::Mul => 0x59,
                Op::Sub => 0x5c,
                Op::Div => 0x5e,
                _ => 0xc2,
            };
            let (mut a, mut b) = (i.a, i.b);
            let symmetric = matches!(i.op, Op::Add | Op::Mul);
            if symmetric && matches!(self.place(b), Place::Register(_)) {
                std::mem::swap(&mut a, &mut b);
            }
            let ra = self.load(a, &[]);
            let pb = self.place(b);
            self.release(k);
            let held = if let Place::Register(rb) = pb { [ra, rb] } else { [ra, ra] };
            let r = self.target(k, ra, &held);
            self.vex(opcode, F2, 1, r, ra, pb);
            if matches!(i.op, Op::NotLess) {
                self.out.push(5); // what to compare for
            }
            self.done(k);
        }

        /// Squares and multiplies in the order of the library's powi.
        fn whole_power(&mut self, k: usize) {
            let i = self.part.code[k];
            let ra = self.load(i.a, &[]);
            self.release(k);
            let r = self.target(k, ra, &[ra]);
            let (mut n, mut base, mut started) = (i.b, ra, false);
            loop {
                if n & 1 == 1 {
                    if started {
                        self.vex(0x59, F2, 1, ZERO, ZERO, Place::Register(base));
                    } else {
                        self.vex(0x28, P66, 1, ZERO, 0, Place::Register(base));
                        started = true;
                    }
                }
                n >>= 1;
                if n == 0 {
                    break;
                }
                self.vex(0x59, F2, 1, MASK, base, Place::Register(base));
                base = MASK;
            }
            self.vex(0x28, P66, 1, r, 0, Place::Register(ZERO));
            self.done(k);
        }

        /// Sines and cosines that can be computed by now, of up to four arguments: k's and those that follow it at once.
        fn sines_cosines(&mut self, k: usize) {
            let mut list: Vec<(Place, [Option<usize>; 2])> = Vec::new();
            for j in k..self.part.code.len() {
                let i = self.part.code[j];
                if list.len() == 4 || !matches!(i.op, Op::Sin | Op::Cos) || self.own(i.a).is_some_and(|a| a >= k) {
                    break;
                }
                if self.called[j] {
                    continue;
                }
                let other = Some(self.partner[j] as usize).filter(|&o| o != NEVER as usize);
                for j in [Some(j), other].into_iter().flatten() {
                    self.called[j] = true;
                }
                let pair = if matches!(i.op, Op::Sin) { [Some(j), other] } else { [other, Some(j)] };
                list.push((self.place(i.a), pair));
            }
            let places: Vec<Place> = list.iter().map(|l| l.0).collect();
            self.gather(&places);
            self.release(k);
            for r in 0..sines::TAKEN {
                self.evict(r);
            }
            self.compute(list.len());
            for (lane, &(_, pair)) in list.iter().enumerate() {
                if lane == 2 {
                    self.upper();
                }
                for (value, j) in pair.into_iter().enumerate() {
                    let Some(j) = j else { continue };
                    if list.len() > 2 {
                        let to = self.settle(j);
                        self.scatter(lane, value, to);
                    } else {
                        let r = self.spread(lane, value);
                        self.holds[r as usize] = Some((self.part.first + j) as u32);
                        self.register[j] = r;
                    }
                }
            }
            if list.len() > 2 {
                self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
            } else {
                for j in list.iter().flat_map(|l| l.1).flatten() {
                    self.done(j);
                }
            }
        }

        pub fn copy(&mut self, to: u8, from: Place) {
            match from {
                Place::Register(_) => self.vex(0x28, P66, 1, to, 0, from),
                memory => self.vex(0x10, F2, 1, to, 0, memory),
            }
        }

        pub fn call(&mut self, function: u64) {
            self.out.extend([0x48, 0xb8]); // mov rax, function
            self.out.extend(function.to_le_bytes());
            self.out.extend([0xff, 0xd0]); // call rax
        }

        /// A function's result in xmm0 is that of instruction k.
        pub fn returned(&mut self, k: usize) {
            self.holds[0] = Some((self.part.first + k) as u32);
            self.register[k] = 0;
            self.done(k);
        }
    }

    /// Mandatory prefixes in VEX; lanes of 256 bits, and the bit W.
    pub const P66: u8 = 1;
    pub const F2: u8 = 3;
    pub const WIDE: u8 = 4;
    pub const DOUBLE: u8 = 0x80;
}
