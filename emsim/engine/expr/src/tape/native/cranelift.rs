//! Machine code by the code generator Cranelift, where there is no encoder of our own (aarch64, Windows, x86-64 without AVX2).
//!
//! Each instruction of the tape becomes one of Cranelift's on scalar doubles, in the tape's order and with its rounding, so that the
//! numbers are those of the interpreter to the bit. Functions of the mathematical library are calls of the same ones. A long
//! program is cut into pieces, one function each: what a later piece reads goes by the slot's place in the workspace, so that the time to
//! make the code grows with its length and not faster.
use super::super::{trig, Instr, Op};
use super::{Entry, Part, NOWHERE};
use crate::graph::Fun;
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{
    types, AbiParam, InstBuilder, MemFlags, SigRef, Signature, StackSlotData, StackSlotKind, Value,
};
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{default_libcall_names, FuncId, Module};
use std::sync::OnceLock;

mod called;

/// Instructions of a piece: some thousand keep the allocation of registers, whose time grows faster than its input, short.
const PIECE: usize = 2000;
const ARGUMENTS: usize = 6; // of `Entry`

/// What keeps the code of one part where it is.
pub struct Held {
    module: Option<JITModule>,
    // the code holds its address
    _functions: Box<[Fun]>,
}

// SAFETY: the module is not touched between its making and its end; its code does not change
unsafe impl Send for Held {}
unsafe impl Sync for Held {}

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(module) = self.module.take() {
            // SAFETY: nobody else has the entry
            unsafe { module.free_memory() };
        }
    }
}

/// Entry, code, and length of the workspace that it wants, which is one with a place for every slot. None where Cranelift knows no code for this processor, or the system
/// forbids executable memory.
pub fn program(part: &Part) -> Option<(Entry, Held, u32)> {
    Maker::new(part)?.finish(|maker| maker.program())
}

extern "C" fn exponential(a: f64) -> f64 {
    a.exp()
}
extern "C" fn power(a: f64, b: f64) -> f64 {
    a.powf(b)
}
extern "C" fn integer_power(a: f64, n: i32) -> f64 {
    a.powi(n)
}
extern "C" fn arctangent(a: f64, b: f64) -> f64 {
    a.atan2(b)
}
extern "C" fn apply(f: *const Fun, a: f64) -> f64 {
    // SAFETY: `Held` keeps the functions that its code names
    unsafe { (*f).apply(a) }
}
extern "C" fn sine_cosine(a: f64, both: *mut f64) {
    let (sine, cosine) = trig::sin_cos(a);
    // SAFETY: two numbers of the caller's stack
    unsafe {
        *both = sine;
        *both.add(1) = cosine;
    }
}

/// The code generator for this processor.
fn processor() -> Option<OwnedTargetIsa> {
    static KNOWN: OnceLock<Option<OwnedTargetIsa>> = OnceLock::new();
    let make = || {
        let mut flags = settings::builder();
        let wanted = [
            ("opt_level", "none"),
            ("is_pic", "false"),
            ("use_colocated_libcalls", "false"),
            ("enable_verifier", "false"),
            ("regalloc_algorithm", "backtracking"),
        ];
        for (name, value) in wanted {
            flags.set(name, value).ok()?;
        }
        cranelift_native::builder().ok()?.finish(settings::Flags::new(flags)).ok()
    };
    KNOWN.get_or_init(make).clone()
}

struct Maker<'a> {
    part: &'a Part<'a>,
    functions: Box<[Fun]>,
    module: JITModule,
    scratch: FunctionBuilderContext,
    homes: Vec<u32>, // of the part's own slots: also those that a later piece reads
}

impl<'a> Maker<'a> {
    fn new(part: &'a Part<'a>) -> Option<Maker<'a>> {
        let module = JITModule::new(JITBuilder::with_isa(processor()?, default_libcall_names()));
        let mut homes: Vec<u32> = part.homes[part.first..part.first + part.code.len()].to_vec();
        let last = part.code.len().saturating_sub(1);
        let read = part.code.iter().enumerate().flat_map(|(k, i)| i.operands().map(move |slot| (k, slot)));
        for (k, slot) in read.chain(part.results.iter().map(|&slot| (last, slot))) {
            if let Some(j) = (slot as usize).checked_sub(part.first).filter(|j| j / PIECE != k / PIECE) {
                homes[j] = slot;
            }
        }
        let scratch = FunctionBuilderContext::new();
        Some(Maker { part, functions: part.functions.into(), module, scratch, homes })
    }

    fn finish(mut self, make: impl FnOnce(&mut Self) -> Option<FuncId>) -> Option<(Entry, Held, u32)> {
        let made = make(&mut self).filter(|_| self.module.finalize_definitions().is_ok());
        let Some(entry) = made.map(|id| self.module.get_finalized_function(id)) else {
            // SAFETY: nobody has anything of it
            unsafe { self.module.free_memory() };
            return None;
        };
        // SAFETY: the function was declared with this signature
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(entry) };
        let length = self.part.free;
        Some((entry, Held { module: Some(self.module), _functions: self.functions }, length))
    }

    fn signature(&self) -> Signature {
        let mut signature = self.module.make_signature();
        let pointer = self.module.target_config().pointer_type();
        signature.params = vec![AbiParam::new(pointer); ARGUMENTS];
        signature
    }

    /// Declares and defines a function with the arguments of `Entry`.
    fn define(
        &mut self,
        write: impl FnOnce(&mut Self, &mut FunctionBuilder, [Value; ARGUMENTS]) -> Option<()>,
    ) -> Option<FuncId> {
        let signature = self.signature();
        let id = self.module.declare_anonymous_function(&signature).ok()?;
        let mut context = self.module.make_context();
        context.func.signature = signature;
        let mut scratch = std::mem::take(&mut self.scratch);
        let mut b = FunctionBuilder::new(&mut context.func, &mut scratch);
        let block = b.create_block();
        b.append_block_params_for_function_params(block);
        b.switch_to_block(block);
        let arguments: [Value; ARGUMENTS] = b.block_params(block).try_into().ok()?;
        let written = write(self, &mut b, arguments);
        if written.is_some() {
            b.ins().return_(&[]);
            b.seal_all_blocks();
            b.finalize();
            self.module.define_function(id, &mut context).ok()?;
        }
        self.scratch = FunctionBuilderContext::new();
        written.map(|()| id)
    }

    /// The whole program: its one piece, or a function that calls its pieces in turn.
    fn program(&mut self) -> Option<FuncId> {
        let n = self.part.code.len();
        let pieces: Vec<FuncId> = (0..n.max(1))
            .step_by(PIECE)
            .map(|from| self.define(|maker, b, arguments| maker.piece(b, arguments, from, (from + PIECE).min(n))))
            .collect::<Option<_>>()?;
        if let [only] = pieces[..] {
            return Some(only);
        }
        self.define(|maker, b, arguments| {
            for &piece in &pieces {
                let piece = maker.module.declare_func_in_func(piece, b.func);
                b.ins().call(piece, &arguments);
            }
            Some(())
        })
    }

    fn piece(&mut self, b: &mut FunctionBuilder, arguments: [Value; ARGUMENTS], from: usize, to: usize) -> Option<()> {
        let mut piece = Piece {
            homes: &self.homes,
            part: self.part,
            functions: &self.functions,
            arguments,
            from,
            values: vec![None; to - from],
            outside: std::collections::HashMap::new(),
            signatures: [None; 6],
            pointer: self.module.target_config().pointer_type(),
            convention: self.module.target_config().default_call_conv,
        };
        for k in from..to {
            piece.instruction(b, k)?;
        }
        if to == self.part.code.len() {
            for (i, &slot) in self.part.results.iter().enumerate() {
                let value = piece.value(b, slot);
                b.ins().store(MemFlags::trusted(), value, arguments[3], 8 * i32::try_from(i).ok()?);
            }
        }
        Some(())
    }
}

/// Arguments and results of the library's functions.
#[derive(Clone, Copy)]
enum Kind {
    One,      // f(a)
    Two,      // f(a, b)
    Integer,  // f(a, n)
    Applied,  // f(function, a)
    Both,     // f(a, where)
    Repeated, // f(where, loop, counts)
}

struct Piece<'a> {
    part: &'a Part<'a>,
    homes: &'a [u32],
    functions: &'a [Fun],
    arguments: [Value; ARGUMENTS],
    from: usize,
    values: Vec<Option<Value>>,                     // of the piece's own slots
    outside: std::collections::HashMap<u32, Value>, // of slots before it
    signatures: [Option<SigRef>; 6],
    pointer: types::Type,
    convention: cranelift_codegen::isa::CallConv,
}

impl Piece<'_> {
    /// The value of a slot: computed here, or read from the workspace once.
    fn value(&mut self, b: &mut FunctionBuilder, slot: u32) -> Value {
        if let Some(k) = (slot as usize).checked_sub(self.part.first + self.from) {
            return self.values[k].expect("operands come first");
        }
        if let Some(&value) = self.outside.get(&slot) {
            return value;
        }
        let home = match (slot as usize).checked_sub(self.part.first) {
            Some(own) => self.homes[own],
            None => self.part.homes[slot as usize],
        };
        let value = b.ins().load(types::F64, MemFlags::trusted(), self.arguments[0], 8 * home as i32);
        self.outside.insert(slot, value);
        value
    }

    fn instruction(&mut self, b: &mut FunctionBuilder, k: usize) -> Option<()> {
        if self.values[k - self.from].is_some() {
            return Some(()); // the cosine of a sine
        }
        let i = self.part.code[k];
        let input = |b: &mut FunctionBuilder, base: Value| -> Option<Value> {
            Some(b.ins().load(types::F64, MemFlags::trusted(), base, 8 * i32::try_from(i.a).ok()?))
        };
        let value = match i.op {
            Op::X => input(b, self.arguments[1])?,
            Op::Wave => input(b, self.arguments[2])?,
            Op::Flag => input(b, self.arguments[4])?,
            Op::T => b.ins().load(types::F64, MemFlags::trusted(), self.arguments[5], 0),
            Op::Neg | Op::Sqrt => {
                let a = self.value(b, i.a);
                match i.op {
                    Op::Neg => b.ins().fneg(a),
                    _ => b.ins().sqrt(a),
                }
            }
            Op::Add | Op::Sub | Op::Mul | Op::Div => {
                let (l, r) = (self.value(b, i.a), self.value(b, i.b));
                match i.op {
                    Op::Add => b.ins().fadd(l, r),
                    Op::Sub => b.ins().fsub(l, r),
                    Op::Mul => b.ins().fmul(l, r),
                    _ => b.ins().fdiv(l, r),
                }
            }
            Op::Select => {
                let (c, yes, no) = (self.value(b, i.a), self.value(b, i.b), self.value(b, i.c));
                let zero = b.ins().f64const(0.0);
                let c = b.ins().fcmp(FloatCC::NotEqual, c, zero);
                b.ins().select(c, yes, no)
            }
            Op::NotLess => {
                let (l, r) = (self.value(b, i.a), self.value(b, i.b));
                let c = b.ins().fcmp(FloatCC::UnorderedOrGreaterThanOrEqual, l, r);
                let (yes, no) = (b.ins().f64const(f64::from_bits(u64::MAX)), b.ins().f64const(0.0));
                b.ins().select(c, yes, no)
            }
            // square and multiply in the order of the library's powi
            Op::Powi if (2..=8).contains(&(i.b as i32)) => {
                let (mut n, mut base, mut product) = (i.b, self.value(b, i.a), None);
                loop {
                    if n & 1 == 1 {
                        product = Some(product.map_or(base, |p| b.ins().fmul(p, base)));
                    }
                    n >>= 1;
                    if n == 0 {
                        break product?;
                    }
                    base = b.ins().fmul(base, base);
                }
            }
            Op::Powi => {
                let (a, n) = (self.value(b, i.a), b.ins().iconst(types::I32, i64::from(i.b as i32)));
                self.call(b, Kind::Integer, integer_power as *const (), &[a, n])
            }
            Op::Exp => {
                let a = self.value(b, i.a);
                self.call(b, Kind::One, exponential as *const (), &[a])
            }
            Op::Pow | Op::Atan2 => {
                let arguments = [self.value(b, i.a), self.value(b, i.b)];
                let function = if i.op == Op::Pow { power as *const () } else { arctangent as *const () };
                self.call(b, Kind::Two, function, &arguments)
            }
            Op::Call => {
                let function = &self.functions[i.b as usize] as *const Fun as i64;
                let arguments = [b.ins().iconst(self.pointer, function), self.value(b, i.a)];
                self.call(b, Kind::Applied, apply as *const (), &arguments)
            }
            Op::Argument | Op::Loop | Op::Result => return self.repeated(b, k),
            Op::Sin | Op::Cos => return self.sine_cosine(b, k),
            Op::Free => return None,
        };
        self.done(b, k, value);
        Some(())
    }

    /// Sine and cosine of one argument by one call, where the piece wants both.
    fn sine_cosine(&mut self, b: &mut FunctionBuilder, k: usize) -> Option<()> {
        let i = self.part.code[k];
        let a = self.value(b, i.a);
        let both = b.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, 16, 3));
        let place = b.ins().stack_addr(self.pointer, both, 0);
        self.call(b, Kind::Both, sine_cosine as *const (), &[a, place]);
        let to = self.from + self.values.len();
        let same = |j: &usize| {
            let other: &Instr = &self.part.code[*j];
            matches!(other.op, Op::Sin | Op::Cos) && other.a == i.a
        };
        let alike: Vec<usize> = (k..to).filter(same).collect();
        for j in alike {
            let offset = if self.part.code[j].op == Op::Sin { 0 } else { 8 };
            let value = b.ins().stack_load(types::F64, both, offset);
            self.done(b, j, value);
        }
        Some(())
    }

    fn call(&mut self, b: &mut FunctionBuilder, kind: Kind, function: *const (), arguments: &[Value]) -> Value {
        let known = self.signatures[kind as usize];
        let signature = known.unwrap_or_else(|| {
            let mut s = Signature::new(self.convention);
            let parameters = match kind {
                Kind::One => vec![types::F64],
                Kind::Two => vec![types::F64, types::F64],
                Kind::Integer => vec![types::F64, types::I32],
                Kind::Applied => vec![self.pointer, types::F64],
                Kind::Both => vec![types::F64, self.pointer],
                Kind::Repeated => vec![self.pointer, types::I32, types::I32, types::I32],
            };
            s.params = parameters.into_iter().map(AbiParam::new).collect();
            if !matches!(kind, Kind::Both | Kind::Repeated) {
                s.returns.push(AbiParam::new(types::F64));
            }
            b.import_signature(s)
        });
        self.signatures[kind as usize] = Some(signature);
        let function = b.ins().iconst(self.pointer, function as i64);
        let call = b.ins().call_indirect(signature, function, arguments);
        b.inst_results(call).first().copied().unwrap_or(function)
    }

    fn done(&mut self, b: &mut FunctionBuilder, k: usize, value: Value) {
        self.values[k - self.from] = Some(value);
        let home = self.homes[k];
        if home != NOWHERE {
            b.ins().store(MemFlags::trusted(), value, self.arguments[0], 8 * home as i32);
        }
    }
}
