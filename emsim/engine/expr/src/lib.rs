//! Expressions: a graph of nodes, its derivatives, and its evaluation for one instance or for many.
// machine code and vectors are not for it
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]

pub mod alike; // like expressions as calls of one program
pub mod derive; // reverse and forward differentiation, substitution
pub mod graph; // hash-consed expression nodes with folding
pub mod interrupt; // Ctrl-C: the token that all that takes long looks at
pub mod lanes; // four numbers in one register
pub mod multiversion; // loops for registers of two numbers and of four
pub mod repeat; // loops whose end hangs on what they compute
pub mod rounding; // what counts as equal
pub mod stopwatch; // seconds on the wall
pub mod tape; // native evaluation of a set of expressions
