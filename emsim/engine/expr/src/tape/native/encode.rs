//! Instructions as bytes, as few as will do: a long program lives as long in the processor's caches as it is short.
//!
//! Base registers are those that the arguments come in, unless the library is called, which overwrites them:
//!
//!   workspace   unknowns   waves   results   flags   time   tables   stack
//!   rdi         rsi        rdx     rcx       r8      r9     rax      rsp
//!   rbx         rbp        r13     r12       r14     r15    rax      rsp     with calls
use super::x86::{Base, Place, Writer, DOUBLE, P66, WIDE};

/// The first five of them point so many bytes behind the first number: twice as many numbers are within reach of a displacement
/// of one byte.
const BEGIN: i32 = 128;

const ARGUMENTS: [u8; 8] = [7, 6, 2, 1, 8, 9, 0, 4];
const KEPT: [u8; 8] = [3, 5, 13, 12, 14, 15, 0, 4];
const POINTERS: [Base; 5] = [Base::Work, Base::Unknowns, Base::Waves, Base::Results, Base::Flags];

impl Writer<'_> {
    fn number(&self, base: Base) -> u8 {
        (if self.calls { KEPT } else { ARGUMENTS })[base as usize]
    }

    pub fn enter(&mut self) {
        if self.calls {
            // push rbx rbp r12 r13 r14 r15, sub rsp 8: with the return address the stack stands at a multiple of 16
            self.out.extend([0x53, 0x55, 0x41, 0x54, 0x41, 0x55, 0x41, 0x56, 0x41, 0x57, 0x48, 0x83, 0xec, 8]);
            for (to, from) in KEPT.into_iter().zip(ARGUMENTS).take(6) {
                // mov to, from
                self.out.extend([0x48 | from >> 3 << 2 | to >> 3, 0x89, 0xc0 | (from & 7) << 3 | to & 7]);
            }
        }
        for base in POINTERS {
            self.advance(base, BEGIN);
        }
    }

    pub fn leave(&mut self) {
        if self.wide {
            self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
        }
        if self.calls {
            self.out.extend([0x48, 0x83, 0xc4, 8, 0x41, 0x5f, 0x41, 0x5e, 0x41, 0x5d, 0x41, 0x5c, 0x5d, 0x5b]);
        }
        self.out.push(0xc3);
    }

    /// Before the library is called aside: bases that it would overwrite, and the stack to a multiple of 16.
    pub fn keep_bases(&mut self) {
        if !self.calls {
            // push rdi rsi rdx rcx r8 r9; sub rsp, 8
            self.out.extend([0x57, 0x56, 0x52, 0x51, 0x41, 0x50, 0x41, 0x51, 0x48, 0x83, 0xec, 8]);
        }
    }

    pub fn restore_bases(&mut self) {
        if !self.calls {
            self.out.extend([0x48, 0x83, 0xc4, 8, 0x41, 0x59, 0x41, 0x58, 0x59, 0x5a, 0x5e, 0x5f]);
        }
    }

    /// Address of a place in the workspace into rdi or rsi, while the library is called.
    pub fn address(&mut self, to: u8, index: u32) {
        let size = if self.wide { 32 } else { 8 };
        let displacement = (index as i32).wrapping_mul(size).wrapping_sub(BEGIN);
        self.out.extend([0x48, 0x8d, 0x80 | to << 3 | KEPT[Base::Work as usize]]); // lea
        self.out.extend(displacement.to_le_bytes());
    }

    /// A base register that points so many bytes further.
    pub fn advance(&mut self, base: Base, by: i32) {
        let r = self.number(base);
        let (first, register) = (0x48 | r >> 3, r & 7);
        match (i8::try_from(by), i8::try_from(-by)) {
            (Ok(by), _) => self.out.extend([first, 0x83, 0xc0 | register, by as u8]), // add
            (_, Ok(less)) => self.out.extend([first, 0x83, 0xe8 | register, less as u8]), // sub
            _ => {
                self.out.extend([first, 0x81, 0xc0 | register]);
                self.out.extend(by.to_le_bytes());
            }
        }
    }

    /// One VEX instruction:  reg <- op(second, rm).
    pub fn vex(&mut self, opcode: u8, prefix: u8, map: u8, reg: u8, second: u8, rm: Place) {
        let (prefix, size) = if self.wide { (P66 | WIDE, 32) } else { (prefix, 8) };
        let (base, displacement) = match rm {
            Place::Register(r) => (r, None),
            Place::Memory { base, index } => {
                let begin = if POINTERS.contains(&base) { BEGIN } else { 0 };
                (self.number(base), Some((index as i32).wrapping_mul(size).wrapping_sub(begin)))
            }
        };
        let inverted = |r: u8| u8::from(r < 8);
        let rest = (!second & 15) << 3 | prefix;
        if map == 1 && prefix & DOUBLE == 0 && base < 8 {
            self.out.extend([0xc5, inverted(reg) << 7 | rest]);
        } else {
            self.out.extend([0xc4, inverted(reg) << 7 | 1 << 6 | inverted(base) << 5 | map, rest]);
        }
        let registers = (reg & 7) << 3 | (base & 7);
        let index: &[u8] = if base & 7 == 4 { &[0x24] } else { &[] };
        self.out.push(opcode);
        match displacement.map(|d| (d, i8::try_from(d))) {
            None => self.out.push(0xc0 | registers),
            // (without displacement the numbers of rbp and r13 mean something else)
            Some((0, _)) if base & 7 != 5 => {
                self.out.push(registers);
                self.out.extend(index);
            }
            Some((_, Ok(near))) => {
                self.out.push(0x40 | registers);
                self.out.extend(index);
                self.out.push(near as u8);
            }
            Some((far, Err(_))) => {
                self.out.push(0x80 | registers);
                self.out.extend(index);
                self.out.extend(far.to_le_bytes());
            }
        }
    }
}
