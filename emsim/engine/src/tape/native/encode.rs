//! Instructions as bytes, as few as will do: a long program lives as long in the processor's caches as it is short.
use super::x86::{Place, Writer, DOUBLE, STACK, TABLE};

/// Where base registers point: so many bytes behind the first number, which leaves twice as many numbers within reach of a
/// displacement of one byte.
pub const BEGIN: i32 = 128;
/// The time is a single number.
const TIME: u8 = 15;

impl Writer<'_> {
    /// One VEX instruction:  reg <- op(second, rm).
    pub fn vex(&mut self, opcode: u8, prefix: u8, map: u8, reg: u8, second: u8, rm: Place) {
        let (base, displacement) = match rm {
            Place::Register(r) => (r, None),
            Place::Memory { base, index } => {
                let begin = if matches!(base, STACK | TABLE | TIME) { 0 } else { BEGIN };
                (base, Some((index as i32).wrapping_mul(8).wrapping_sub(begin)))
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
