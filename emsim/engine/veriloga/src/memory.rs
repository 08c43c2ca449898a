//! Variables that keep their value from one evaluation to the next, though no event sets them: `if (V(in) > high) s = 1;`.
//!
//! Behind its analogue block such a variable is F(s): a choice by conditions between new values and the old one, s. Conditions are
//! events, so between two of them it is the same choice: s is what F was just before the last event. That holds where the choice does
//! not hang on s itself, and where s is not computed with; else a value would hang on how often a module is evaluated, and it is an error.
use super::ast::{Type, S};
use super::elaborate::{Answer, Elaborator, Num, Val};
use super::folded::Mode;
use super::source::{Place, Word};
use emsim_expr::derive::substitute;
use emsim_expr::graph::{Id, Node};
use std::collections::{HashMap, HashSet};

/// Of the whole module tree: the prefix of the instance, and the variable.
pub type Owner = (String, u32);

/// A variable of the frame that is run.
pub struct Memory {
    /// what it was before
    symbol: Id,
    /// what it is where a run begins
    pub start: Id,
}

/// What a variable comes to behind the analogue block.
pub struct Remembered {
    symbol: Id,
    start: Id,
    end: Id,
    word: Word,
    at: Place,
    /// Has it a value of its own at the start? Others begin at 0.
    declared: bool,
}

impl Elaborator<'_> {
    /// Before the analogue block: the variables that were found to keep their value, and those without one.
    pub fn remember(&mut self) -> Vec<(u32, Id)> {
        let mut without = Vec::new();
        for k in 0..self.frame.values.len() as u32 {
            let n = match self.frame.values[k as usize].clone() {
                Val::Num(n) => n,
                Val::Row(_, items) => {
                    let known = |item: &Val| matches!(item, Val::Num(n) if !self.unset.contains_key(&n.id));
                    if items.iter().any(known) {
                        self.frame.begun.insert(k);
                    }
                    continue;
                }
                Val::Text(_) => continue,
            };
            if self.unset.contains_key(&n.id) {
                without.push((k, n.id));
            } else {
                self.frame.begun.insert(k);
            }
            if self.frame.held.contains_key(&k) || !self.keepers.contains(&(self.scope.prefix.clone(), k)) {
                continue;
            }
            let start = if self.unset.contains_key(&n.id) { self.g.constant(0.0) } else { self.plain(&n).id };
            let symbol = self.g.symbol();
            self.frame.memories.insert(k, Memory { symbol, start });
            let whole = self.variable(k).kind == Type::Integer;
            if !whole {
                self.moving.insert(symbol);
            }
            self.frame.values[k as usize] = Val::Num(Num { whole, ..self.real(symbol) });
        }
        without
    }

    /// A variable with a value of its own at the start is set where voltages decide: it keeps its value, which the next run of the
    /// module knows.
    pub fn may_keep(&mut self, k: u32, at: Place) -> Answer<()> {
        let outside = self.frame.function == 0 && !self.frame.at_event && !self.path.is_empty();
        if !outside || !self.frame.begun.contains(&k) {
            return Ok(());
        }
        if !matches!(self.frame.values[k as usize], Val::Num(_)) {
            let what = format!(
                "{} has a value at the start, and is set where voltages decide",
                self.word(self.variable(k).name)
            );
            return self.stop(at, what, "rows of values and strings do not keep theirs: use single numbers");
        }
        self.keepers.insert((self.scope.prefix.clone(), k));
        Ok(())
    }

    /// What an event of the start gives a variable that keeps its value.
    pub fn begins_with(&mut self, k: u32, start: Id) {
        if let Some(memory) = self.frame.memories.get_mut(&k) {
            memory.start = start;
        }
    }

    /// Behind the analogue block.
    pub fn note_memories(&mut self, without: &[(u32, Id)]) {
        let zero = self.g.constant(0.0);
        let known = self.frame.memories.iter().map(|(&k, m)| (k, m.symbol, m.start)).collect::<Vec<_>>();
        let open = without.iter().map(|&(k, symbol)| (k, symbol, zero));
        for (k, symbol, start) in known.into_iter().chain(open) {
            let Val::Num(n) = self.frame.values[k as usize].clone() else { continue };
            let variable = self.variable(k);
            let (word, at) = (variable.name, variable.at);
            let declared = self.frame.memories.contains_key(&k);
            if n.id != symbol || declared {
                let end = self.plain(&n).id;
                self.remembered.push(Remembered { symbol, start, end, word, at, declared });
            }
        }
    }

    /// Of those that rows read: what they come to. What is told alone (operating-point values) is 0 where it has no value.
    pub fn resolve_memories(&mut self, rows: &[Id]) -> Answer<()> {
        let open = std::mem::take(&mut self.remembered);
        let rest = self.resolved(rows, open)?;
        let told: Vec<Id> = self.outputs.iter().map(|o| o.value).collect();
        self.resolved(&told, rest.into_iter().filter(|r| r.declared).collect())?;
        Ok(())
    }

    fn resolved(&mut self, roots: &[Id], mut open: Vec<Remembered>) -> Answer<Vec<Remembered>> {
        loop {
            let mut all: Vec<Id> = roots.iter().copied().chain(self.finals.iter().map(|f| f.1)).collect();
            all.extend(self.modes.iter().map(|mode| mode.of()));
            let symbols: HashSet<Id> = open.iter().map(|r| r.symbol).collect();
            let Some(found) = self.reached(&all, &|id| symbols.contains(&id)) else { return Ok(open) };
            let Some(place) = open.iter().position(|r| r.symbol == found) else { return Ok(open) };
            let Remembered { symbol, start, end, word, at, .. } = open.swap_remove(place);
            if end != symbol && !self.is_chosen(end, symbol, &mut HashMap::new()) {
                let what = format!(
                    "{} keeps its value from one evaluation to the next, and is computed of it",
                    self.word(word)
                );
                let hint = "let events set it, @(cross(..)) or @(timer(..)), or make its rate an integral: idt()";
                return self.stop(at, what, hint);
            }
            let (begun, kept) = (self.begun(), self.mode(Mode::Kept(symbol)));
            let before = self.g.select(begun, kept, start);
            let now = substitute(&mut self.g, &[end], &[(symbol, before)])[0];
            self.unset.remove(&symbol);
            self.finals.push((symbol, if end == symbol { start } else { now }));
        }
    }

    /// Is it a choice between the symbol and what does not hang on it, by what does not hang on it?
    fn is_chosen(&self, e: Id, symbol: Id, known: &mut HashMap<Id, bool>) -> bool {
        if e == symbol {
            return true;
        }
        if let Some(&answer) = known.get(&e) {
            return answer;
        }
        let free = |run: &Self, e: Id| !run.g.reachable(&[e]).contains(&symbol);
        let answer = match self.g.node(e) {
            Node::Select(c, yes, no) => {
                free(self, c) && self.is_chosen(yes, symbol, known) && self.is_chosen(no, symbol, known)
            }
            _ => free(self, e),
        };
        known.insert(e, answer);
        answer
    }

    /// The statements at events of what is generated stand with those of the analogue block.
    pub fn all_statements(&self) -> Vec<S> {
        let module = &self.library.modules[self.scope.module];
        module.analog.iter().chain(&module.generated_analog).copied().collect()
    }
}
