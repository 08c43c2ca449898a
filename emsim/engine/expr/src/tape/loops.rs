//! Loops in a program: instructions, and how they are interpreted.
use super::{Instr, Op};
use crate::repeat;

/// A loop with its arguments before it and its results behind it; the slot of the first of them.
pub fn called(number: u32, arguments: impl Iterator<Item = u32>, base: u32, code: &mut Vec<Instr>) -> u32 {
    let (first, results) = (code.len(), repeat::of(number).results() as u32);
    code.extend((0..).zip(arguments).map(|(b, a)| Instr { op: Op::Argument, a, b, c: results }));
    let count = (code.len() - first) as u32;
    code.push(Instr { op: Op::Loop, a: number, b: count, c: results });
    code.extend((0..results).map(|a| Instr { op: Op::Result, a, b: count, c: 0 }));
    base + code.len() as u32 - results
}

/// Runs the loop whose call has this slot: its arguments stand before it, its results behind it.
pub fn run(i: &Instr, slot: usize, w: &mut [f64]) -> f64 {
    let (before, behind) = w.split_at_mut(slot);
    repeat::of(i.a).run(&before[slot - i.b as usize..], &mut behind[1..][..i.c as usize]);
    0.0
}
