//! A program interpreted for many sets of numbers side by side, for where there is no machine code: what an instruction costs besides
//! its arithmetic is paid once for all of them. The numbers are those of the interpreter, to the bit.
//!
//! Sets stand in blocks of four, `width` blocks side by side: block b of number k is at `k * width + b`.
use super::{trig, Instr, Op, Tape};
use crate::graph::Fun;
use crate::repeat;

/// More blocks than so many no longer fit into the processor's nearer caches.
pub const WIDEST: usize = 8;

const LANES: usize = 4; // numbers of a block: a register of AVX2
type Block = [f64; LANES];

impl Tape {
    pub fn workspace_of_many(&self) -> Vec<Block> {
        let mut w: Vec<Block> = Vec::new();
        w.resize((self.constants.len() + self.code.len()) * WIDEST, [0.0; LANES]);
        w
    }

    /// Runs the only part on `width` blocks of unknowns and waves; its results are then in the workspace, see `of_many`.
    pub fn run_many(&self, width: usize, x: &[Block], waves: &[Block], w: &mut [Block]) {
        let slots = self.constants.len() + self.code.len();
        assert!(self.ends.len() == 1 && self.limits.2 == 0 && width > 0 && w.len() >= slots * width);
        assert!(x.len() >= self.limits.0 * width && waves.len() >= self.limits.1 * width);
        for (row, &c) in w.chunks_exact_mut(width).zip(&self.constants) {
            row.fill([c; LANES]);
        }
        interpret(self, width, (x, waves), w);
    }

    /// Result k of `run_many`.
    pub fn of_many<'a>(&self, k: usize, width: usize, w: &'a [Block]) -> &'a [Block] {
        &w[self.outputs[k] as usize * width..][..width]
    }
}

/// `plain`, for the processor that runs it.
fn interpret(tape: &Tape, width: usize, leaves: (&[Block], &[Block]), w: &mut [Block]) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        unsafe fn wide(tape: &Tape, width: usize, leaves: (&[Block], &[Block]), w: &mut [Block]) {
            plain(&tape.code, &tape.functions, tape.constants.len(), width, leaves, w);
        }
        if trig::vectors() {
            // SAFETY: the processor has what is asked for
            return unsafe { wide(tape, width, leaves, w) };
        }
    }
    plain(&tape.code, &tape.functions, tape.constants.len(), width, leaves, w);
}

#[inline(always)]
fn plain(code: &[Instr], functions: &[Fun], first: usize, width: usize, leaves: (&[Block], &[Block]), w: &mut [Block]) {
    let (x, waves) = leaves;
    for (k, i) in code.iter().enumerate() {
        // operand slots precede the instruction's own by construction
        let (before, rest) = w.split_at_mut((first + k) * width);
        let to = &mut rest[..width];
        let row = |slot: u32| &before[slot as usize * width..][..width];
        match i.op {
            Op::X => to.copy_from_slice(&x[i.a as usize * width..][..width]),
            Op::Wave => to.copy_from_slice(&waves[i.a as usize * width..][..width]),
            Op::T | Op::Flag | Op::Free => to.fill([f64::NAN; LANES]),
            Op::Neg => each(to, row(i.a), |a| -a),
            Op::Add => pairs(to, row(i.a), row(i.b), |a, b| a + b),
            Op::Sub => pairs(to, row(i.a), row(i.b), |a, b| a - b),
            Op::Mul => pairs(to, row(i.a), row(i.b), |a, b| a * b),
            Op::Div => pairs(to, row(i.a), row(i.b), |a, b| a / b),
            Op::Pow => pairs(to, row(i.a), row(i.b), f64::powf),
            Op::Powi => each(to, row(i.a), |a| a.powi(i.b as i32)),
            Op::Atan2 => pairs(to, row(i.a), row(i.b), f64::atan2),
            Op::Sin => each(to, row(i.a), |a| trig::sin_cos(a).0),
            Op::Cos => each(to, row(i.a), |a| trig::sin_cos(a).1),
            Op::Exp => each(to, row(i.a), f64::exp),
            Op::Sqrt => each(to, row(i.a), f64::sqrt),
            Op::Argument => to.copy_from_slice(row(i.a)),
            Op::Loop => {
                let arguments = before[(first + k - i.b as usize) * width..].as_flattened();
                let results = rest[width..].as_flattened_mut();
                let step = width * LANES;
                repeat::run_many(i.a, step, arguments, &mut results[..i.c as usize * step]);
            }
            Op::Result => {} // the loop has put it there
            Op::Call => each(to, row(i.a), |a| functions[i.b as usize].apply(a)),
            Op::Select => {
                let [c, a, b] = [i.a, i.b, i.c].map(|slot| row(slot).as_flattened());
                for (((to, c), &a), &b) in to.as_flattened_mut().iter_mut().zip(c).zip(a).zip(b) {
                    *to = if *c != 0.0 { a } else { b };
                }
            }
            Op::NotLess => pairs(to, row(i.a), row(i.b), |a, b| f64::from_bits(if a < b { 0 } else { u64::MAX })),
        }
    }
}

// (number by number, not block by block: so the compiler has them side by side)

#[inline(always)]
fn each(to: &mut [Block], a: &[Block], f: impl Fn(f64) -> f64) {
    for (to, a) in to.as_flattened_mut().iter_mut().zip(a.as_flattened()) {
        *to = f(*a);
    }
}

#[inline(always)]
fn pairs(to: &mut [Block], a: &[Block], b: &[Block], f: impl Fn(f64, f64) -> f64) {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    for ((to, a), b) in to.as_flattened_mut().iter_mut().zip(a).zip(b) {
        *to = f(*a, *b);
    }
}
