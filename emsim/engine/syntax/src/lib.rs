//! Text to syntax trees: Lark's LALR(1) tables of grammar/*.lark, run natively.
//!
//! Stands apart from the rest of the engine: it knows nothing of equations, and nothing here knows what a word of
//! a deck means. Whatever this driver does not accept, or is not sure of (a letter that Unicode's versions judge
//! differently, a pattern that backtracks without end), it hands back: Lark itself then reads the line, and its
//! word is final. So a tree given here must be Lark's tree, and a refusal costs time only.
pub mod lines; // a text's logical lines
pub mod number; // words that are numbers by SPICE's rule
pub mod parse; // the contextual lexer and the LALR automaton
pub mod pattern; // the terminals' regular expressions
pub mod table; // the tables, as grammar/export.py writes them

#[cfg(test)]
mod tests;
