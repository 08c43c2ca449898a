//! Calls of loops: arguments and results lie in one row of the workspace.
use super::super::Op;
use super::calls::RDI;
use super::x86::{Base, Place, Writer, F2, ZERO};
use crate::repeat;

extern "sysv64" fn repeated(at: *mut f64, number: u32, count: u32) {
    of_lanes(at, number, count, 1);
}
extern "sysv64" fn repeated_for_four(at: *mut f64, number: u32, count: u32) {
    of_lanes(at, number, count, 4);
}
/// A loop for so many sets of numbers side by side, whose results replace its arguments.
fn of_lanes(at: *mut f64, number: u32, count: u32, lanes: usize) {
    let called = repeat::of(number);
    // SAFETY: the code has made room for both
    let arguments = unsafe { std::slice::from_raw_parts(at, count as usize * lanes) }.to_vec();
    let results = unsafe { std::slice::from_raw_parts_mut(at, called.results() * lanes) };
    called.run_many(lanes, &arguments, results);
}

impl Writer<'_> {
    /// An argument of a loop, the call of it, or a result: the first and the last in one row of the workspace.
    pub fn repeated(&mut self, k: usize) {
        let i = self.part.code[k];
        let place = |first: u32, j: u32| Place::Memory { base: Base::Work, index: first + j };
        match i.op {
            Op::Argument => {
                if i.b == 0 {
                    let count = self.part.code[k..].iter().take_while(|j| matches!(j.op, Op::Argument)).count();
                    self.arguments = self.length;
                    self.length += i.c.max(count as u32);
                }
                let from = self.place(i.a);
                self.copy(ZERO, from);
                self.release(k);
                self.vex(0x11, F2, 1, ZERO, 0, place(self.arguments, i.b));
            }
            Op::Loop => {
                self.save_all();
                self.address(RDI, self.arguments);
                self.out.push(0xbe); // mov esi, number
                self.out.extend(i.a.to_le_bytes());
                self.out.push(0xba); // mov edx, count
                self.out.extend(i.b.to_le_bytes());
                let function = if self.wide { repeated_for_four as *const () } else { repeated as *const () };
                if self.wide {
                    self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
                }
                self.call(function as u64);
            }
            _ => {
                let r = self.result(k, &[]);
                self.vex(0x10, F2, 1, r, 0, place(self.arguments, i.a));
                self.done(k);
            }
        }
    }
}
