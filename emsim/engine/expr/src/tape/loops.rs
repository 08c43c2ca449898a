//! Loops in a program: instructions, and how they are interpreted.
use super::{Instr, Op};
use crate::graph::{Graph, Id, Node};
use crate::{alike, repeat};
use rustc_hash::FxHashMap as HashMap;

/// Of each call which of its results are read.
pub type Read = HashMap<(u32, Id), Vec<u32>>;

pub fn read(g: &Graph, order: &[Id]) -> Read {
    let mut read = Read::default();
    for &id in order {
        if let Node::Result(number, k, list) = g.node(id) {
            read.entry((number, list)).or_default().push(k);
        }
    }
    read.values_mut().for_each(|of| of.sort_unstable());
    read
}

/// Where a result is among those of its call: all of a loop, those that are read of a form.
pub fn place(number: u32, k: u32, read: &[u32]) -> u32 {
    if alike::is(number) {
        return read.partition_point(|&r| r < k) as u32;
    }
    k
}

/// A loop with its arguments before it and its results behind it; the slot of the first of them.
pub fn called(
    number: u32,
    read: &[u32],
    arguments: impl Iterator<Item = u32>,
    base: u32,
    code: &mut Vec<Instr>,
) -> u32 {
    let (first, results) = (code.len(), repeat::results(number).unwrap_or(read.len()) as u32);
    let number = if alike::is(number) { alike::program(number, read) } else { number };
    code.extend((0..).zip(arguments).map(|(b, a)| Instr { op: Op::Argument, a, b, c: results }));
    let count = (code.len() - first) as u32;
    code.push(Instr { op: Op::Loop, a: number, b: count, c: results });
    code.extend((0..results).map(|a| Instr { op: Op::Result, a, b: count, c: 0 }));
    base + code.len() as u32 - results
}

/// Runs the loop whose call has this slot: its arguments stand before it, its results behind it.
pub fn run(i: &Instr, slot: usize, w: &mut [f64]) -> f64 {
    let (before, behind) = w.split_at_mut(slot);
    repeat::run(i.a, &before[slot - i.b as usize..], &mut behind[1..][..i.c as usize]);
    0.0
}
