//! Calls of loops: arguments and results lie in one row of the workspace.
use super::super::Op;
use super::calls::RDI;
use super::x86::{Base, Place, Writer, F2, ZERO};
use crate::repeat;

extern "sysv64" fn repeated(at: *mut f64, number: u32, count: u32, results: u32) {
    let (arguments, results) = row(at, count as usize, results as usize);
    repeat::run(number, arguments, results);
}
extern "sysv64" fn repeated_for_four(at: *mut f64, number: u32, count: u32, results: u32) {
    let (arguments, results) = row(at, 4 * count as usize, 4 * results as usize);
    repeat::run_many(number, 4, arguments, results);
}
/// Arguments, and behind them results.
fn row<'a>(at: *mut f64, count: usize, results: usize) -> (&'a [f64], &'a mut [f64]) {
    // SAFETY: the code has made room for both
    unsafe { (std::slice::from_raw_parts(at, count), std::slice::from_raw_parts_mut(at.add(count), results)) }
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
                    self.length += i.c + count as u32;
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
                self.out.push(0xb9); // mov ecx, results
                self.out.extend(i.c.to_le_bytes());
                let function = if self.wide { repeated_for_four as *const () } else { repeated as *const () };
                if self.wide {
                    self.out.extend([0xc5, 0xf8, 0x77]); // vzeroupper
                }
                self.call(function as u64);
            }
            _ => {
                let r = self.result(k, &[]);
                self.vex(0x10, F2, 1, r, 0, place(self.arguments, i.b + i.a));
                self.done(k);
            }
        }
    }
}
