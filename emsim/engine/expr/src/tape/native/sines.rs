//! Sine and cosine of up to four arguments in the code of a program: the operations of `trig::x86::lanes` one by one, so that
//! interpreter and machine code agree to the bit. Up to two arguments take half registers, and their results stay in
//! registers; those of more go to the workspace.
//!
//!   registers:  xmm14 arguments, then r   xmm0 quadrant   xmm1 z = y^2   xmm2 z^2   xmm3 y   xmm4 sine   xmm5 d
//!               xmm6, 7, 15 what is at hand;  in the end xmm1 sines, xmm2 cosines
use super::super::trig;
use super::x86::{Aside, Base, Place, Writer, DOUBLE, F2, MASK, P66, WIDE, ZERO};
use trig::row;

/// Registers 0 to 7 are written.
pub const TAKEN: usize = 8;
const SINES: u8 = 1;
const COSINES: u8 = 2;
const ARGUMENT: u8 = MASK;
const OTHER: u8 = ZERO;
/// Of the stack of an aside: arguments, sines, cosines, and xmm8 to 13.
const FRAME: u32 = 256;

/// [arguments, sines, cosines] of so many lanes.
extern "sysv64" fn library(at: *mut [[f64; 4]; 3], lanes: usize) {
    // SAFETY: the code passes such a place on its stack
    let [x, s, c] = unsafe { &mut *at };
    for k in 0..lanes {
        (s[k], c[k]) = trig::sin_cos(x[k]);
    }
}

fn table(row: usize) -> Place {
    Place::Memory { base: Base::Table, index: 4 * row as u32 }
}

impl Writer<'_> {
    /// Arguments into the lanes of one register. (Lanes without one of their own repeat another.)
    pub fn gather(&mut self, from: &[Place]) {
        for (half, pair) in from.chunks(2).enumerate() {
            let to = if half == 0 { ARGUMENT } else { OTHER };
            match *pair {
                [one] => self.vex(0x12, F2, 1, to, 0, one), // vmovddup
                [Place::Register(a), two] => self.high(to, a, two),
                [one, two] => {
                    self.copy(to, one);
                    self.high(to, to, two);
                }
                _ => {}
            }
        }
        if from.len() > 2 {
            self.vex(0x18, P66 | WIDE, 3, ARGUMENT, ARGUMENT, Place::Register(OTHER)); // vinsertf128
            self.out.push(1);
        }
    }

    /// to <- [low of a, low of b]
    fn high(&mut self, to: u8, a: u8, b: Place) {
        let opcode = if matches!(b, Place::Register(_)) { 0x14 } else { 0x16 }; // vunpcklpd, vmovhpd
        self.vex(opcode, P66, 1, to, a, b);
    }

    /// Sines and cosines of the arguments that were gathered.
    pub fn compute(&mut self, count: usize) {
        let wide = if count > 2 { WIDE } else { 0 };
        let lanes = if count > 2 { 4 } else { 2 };
        let register = Place::Register;
        self.out.extend([0x48, 0xb8]); // mov rax, table
        self.out.extend((&raw const trig::TABLE as u64).to_le_bytes());
        // out of range: aside
        self.vex(0x54, P66 | wide, 1, 0, ARGUMENT, table(row!(magnitude)));
        self.vex(0xc2, P66 | wide, 1, 0, 0, table(row!(largest)));
        self.out.push(0x12); // less or equal, quiet
        self.vex(0x50, P66 | wide, 1, 10, 0, register(0)); // vmovmskpd r10d
        self.out.extend([0x41, 0x83, 0xfa, (1 << lanes) - 1, 0x0f, 0x85, 0, 0, 0, 0]); // cmp r10d, all; jne
        let jump = self.out.len();

        let mut op = |opcode: u8, to: u8, a: u8, b: Place| self.vex(opcode, P66 | wide, 1, to, a, b);
        let (add, mul, sub) = (0x58, 0x59, 0x5c);
        // 213: to = a to + b    231: to = a b + to    132: to = to b - a
        op(mul, 0, ARGUMENT, table(row!(two_over_pi)));
        op(add, 0, 0, table(row!(round)));
        op(sub, 1, 0, table(row!(round))); // k
        self.fused(Fused::Negated231, wide, ARGUMENT, 1, table(row!(p))); // r
        let mut op = |opcode: u8, to: u8, a: u8, b: Place| self.vex(opcode, P66 | wide, 1, to, a, b);
        op(mul, 2, 1, table(row!(p) + 1)); // product
        op(sub, 3, ARGUMENT, register(2)); // y
        op(sub, 4, 3, register(ARGUMENT)); // taken
        op(sub, 5, 3, register(4));
        op(sub, 5, ARGUMENT, register(5));
        op(add, 4, 2, register(4));
        op(sub, 5, 5, register(4)); // error
        op(MOVE, 4, 0, register(1));
        self.fused(Fused::Sub132, wide, 4, 2, table(row!(p) + 1));
        self.vex(sub, P66 | wide, 1, 5, 5, register(4));
        self.fused(Fused::Negated231, wide, 5, 1, table(row!(p) + 2)); // d
        self.vex(mul, P66 | wide, 1, 1, 3, register(3)); // z
        self.vex(mul, P66 | wide, 1, 2, 1, register(1)); // z^2

        // sine: y + (y^3 s1 + (z (y^3 s - d/2) + d))
        let load = |w: &mut Self, to: u8, at: usize| w.vex(MOVE, P66 | wide, 1, to, 0, table(at));
        load(self, 4, row!(sine) + 5);
        for c in (1..5).rev() {
            self.fused(Fused::Add213, wide, 4, 1, table(row!(sine) + c));
        }
        self.vex(mul, P66 | wide, 1, 6, 1, register(3)); // y^3
        self.vex(mul, P66 | wide, 1, 7, 5, table(row!(half)));
        self.fused(Fused::Sub213, wide, 4, 6, register(7));
        self.fused(Fused::Add213, wide, 4, 1, register(5));
        self.fused(Fused::Add231, wide, 4, 6, table(row!(sine)));
        self.vex(add, P66 | wide, 1, 4, 3, register(4));

        // cosine: w + ((1 - w) - z/2 + (z^2 c - y d)),  w = 1 - z/2
        self.vex(mul, P66 | wide, 1, 6, 1, table(row!(half)));
        load(self, OTHER, row!(one));
        self.vex(sub, P66 | wide, 1, 7, OTHER, register(6)); // w
        self.vex(mul, P66 | wide, 1, 5, 3, register(5)); // y d
        load(self, ARGUMENT, row!(cosine) + 5);
        for c in (0..5).rev() {
            self.fused(Fused::Add213, wide, ARGUMENT, 1, table(row!(cosine) + c));
        }
        self.fused(Fused::Sub213, wide, ARGUMENT, 2, register(5));
        load(self, OTHER, row!(one));
        self.vex(sub, P66 | wide, 1, OTHER, OTHER, register(7));
        self.vex(sub, P66 | wide, 1, OTHER, OTHER, register(6));
        self.vex(add, P66 | wide, 1, OTHER, OTHER, register(ARGUMENT));
        self.vex(add, P66 | wide, 1, 7, 7, register(OTHER));

        self.turn(wide);
        self.aside.push(Aside { jump, back: self.out.len(), lanes });
    }

    /// To the quadrant: odd ones change places; sine is negative in 2 and 3, cosine in 1 and 2.
    fn turn(&mut self, wide: u8) {
        let register = Place::Register;
        self.shift(wide, ARGUMENT, 0, 63);
        for (to, one, two) in [(SINES, 4, 7), (COSINES, 7, 4)] {
            self.vex(0x4b, P66 | wide, 3, to, one, register(two)); // vblendvpd
            self.out.push(ARGUMENT << 4);
        }
        for to in [SINES, COSINES] {
            self.shift(wide, OTHER, 0, 62);
            self.vex(0x54, P66 | wide, 1, OTHER, OTHER, table(row!(sign)));
            self.vex(0x57, P66 | wide, 1, to, to, register(OTHER));
            if to == SINES {
                self.vex(0xd4, P66 | wide, 1, 0, 0, table(row!(unit))); // vpaddq
            }
        }
    }

    fn fused(&mut self, opcode: Fused, wide: u8, to: u8, a: u8, b: Place) {
        self.vex(opcode as u8, P66 | wide | DOUBLE, 2, to, a, b);
    }

    /// 64-bit lanes shifted to the left.
    fn shift(&mut self, wide: u8, to: u8, from: u8, by: u8) {
        self.vex(0x73, P66 | wide, 1, 6, to, Place::Register(from));
        self.out.push(by);
    }

    /// Sine (0) or cosine (1) of one of the first two lanes in a register of its own.
    pub fn spread(&mut self, lane: usize, value: usize) -> u8 {
        let from = [SINES, COSINES][value];
        if lane == 0 {
            return from;
        }
        self.vex(0x15, P66, 1, from + 2, from, Place::Register(from)); // vunpckhpd
        from + 2
    }

    /// Lanes 2 and 3 take the place of 0 and 1.
    pub fn upper(&mut self) {
        for r in [SINES, COSINES] {
            self.vex(0x19, P66 | WIDE, 3, r, 0, Place::Register(r)); // vextractf128
            self.out.push(1);
        }
    }

    /// ... of any lane to memory.
    pub fn scatter(&mut self, lane: usize, value: usize, to: Place) {
        let from = [SINES, COSINES][value];
        self.vex(0x13 + 4 * (lane as u8 & 1), P66, 1, from, 0, to); // vmovlpd, vmovhpd
    }

    /// Behind the program: where an argument is out of range, its lanes go to the library.
    pub fn asides(&mut self) {
        for Aside { jump, back, lanes } in std::mem::take(&mut self.aside) {
            let here = self.out.len();
            self.out[jump - 4..jump].copy_from_slice(&((here - jump) as u32).to_le_bytes());
            let wide = if lanes > 2 { WIDE } else { 0 };
            let stack = |index: u32| Place::Memory { base: Base::Stack, index };
            let kept = |r: u8| stack(12 + 2 * u32::from(r - TAKEN as u8));
            self.keep_bases();
            self.out.extend([0x48, 0x81, 0xec]); // sub rsp
            self.out.extend(FRAME.to_le_bytes());
            self.vex(0x11, P66 | wide, 1, ARGUMENT, 0, stack(0));
            for r in TAKEN as u8..MASK {
                self.vex(0x11, P66, 1, r, 0, kept(r));
            }
            self.out.extend([0x48, 0x89, 0xe7, 0xbe]); // mov rdi, rsp; mov esi, lanes
            self.out.extend(lanes.to_le_bytes());
            self.call(library as *const () as u64);
            for r in TAKEN as u8..MASK {
                self.vex(0x10, P66, 1, r, 0, kept(r));
            }
            self.vex(0x10, P66 | wide, 1, SINES, 0, stack(4));
            self.vex(0x10, P66 | wide, 1, COSINES, 0, stack(8));
            self.out.extend([0x48, 0x81, 0xc4]); // add rsp
            self.out.extend(FRAME.to_le_bytes());
            self.restore_bases();
            self.out.push(0xe9); // jmp
            let away = back as i64 - (self.out.len() as i64 + 4);
            self.out.extend((away as i32).to_le_bytes());
        }
    }
}

const MOVE: u8 = 0x28; // opcode of VMOVAPS and VMOVAPD (Intel's manual, volume 2)

/// Opcodes of fused products and sums: to = to, with a and b.
#[derive(Clone, Copy)]
enum Fused {
    /// a to + b
    Add213 = 0xa8,
    /// a b + to
    Add231 = 0xb8,
    /// to b - a
    Sub132 = 0x9a,
    /// a to - b
    Sub213 = 0xaa,
    /// to - a b
    Negated231 = 0xbc,
}
