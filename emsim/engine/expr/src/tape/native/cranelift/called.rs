//! Calls of loops: arguments and results have their places in the workspace.
use super::super::super::Op;
use super::{Kind, Piece};
use crate::repeat;
use cranelift_codegen::ir::{types, InstBuilder, MemFlags};
use cranelift_frontend::FunctionBuilder;

extern "C" fn repeated(at: *mut f64, number: u32, count: u32, results: u32) {
    // SAFETY: the arguments and, behind the place of the call, the results have their places in the workspace
    let arguments = unsafe { std::slice::from_raw_parts(at, count as usize) };
    let results = unsafe { std::slice::from_raw_parts_mut(at.add(count as usize + 1), results as usize) };
    repeat::run(number, arguments, results);
}
impl Piece<'_> {
    /// Of a loop: an argument and a result have their places in the workspace, where the call finds them.
    pub(super) fn repeated(&mut self, b: &mut FunctionBuilder, k: usize) -> Option<()> {
        let i = self.part.code[k];
        let place = 8 * i32::try_from(self.part.first + k).ok()?;
        match i.op {
            Op::Argument => {
                let value = self.value(b, i.a);
                b.ins().store(MemFlags::trusted(), value, self.arguments[0], place);
            }
            Op::Loop => {
                let at = b.ins().iadd_imm(self.arguments[0], i64::from(place) - 8 * i64::from(i.b));
                let [number, count, results] = [i.a, i.b, i.c].map(|n| b.ins().iconst(types::I32, i64::from(n)));
                self.call(b, Kind::Repeated, repeated as *const (), &[at, number, count, results]);
            }
            _ => {
                let value = b.ins().load(types::F64, MemFlags::trusted(), self.arguments[0], place);
                self.done(b, k, value);
            }
        }
        Some(())
    }
}
