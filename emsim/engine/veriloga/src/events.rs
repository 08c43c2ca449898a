//! Events: what is done at the start and where an expression crosses 0, and variables that keep what they were given there.
//!
//! What an event assigns is made of values just before it (`Mode::Kept`), so it stays as it is until the next one. Outside of events
//! such a variable is a symbol, which in the end stands for what the last event left.
use super::ast::{Expression, Statement, Type, E, S};
use super::elaborate::{Answer, Elaborator, Num, State, Val};
use super::folded::{symbol_of, Mode, SYMBOLS};
use super::source::Place;
use emsim_expr::derive::substitute;
use emsim_expr::graph::{Id, Node};
use std::collections::{BTreeSet, HashSet};
use std::rc::Rc;

/// A variable that events set, or a row of them.
pub struct Held {
    cells: Vec<Cell>,
    /// the first index of a row
    first: Option<i64>,
    whole: bool,
}

/// One of its values.
#[derive(Clone, Copy)]
struct Cell {
    /// what it is outside of events
    symbol: Id,
    /// just before the event
    before: Id,
    /// behind those events that the text has so far
    now: Id,
}

impl Held {
    fn value(&self, of: impl Fn(&Cell) -> Id) -> Val {
        let number = |cell: &Cell| Val::Num(Num { id: of(cell), whole: self.whole, q: None, noise: None });
        match self.first {
            Some(first) => Val::Row(first, Rc::new(self.cells.iter().map(number).collect())),
            None => number(&self.cells[0]),
        }
    }

    /// Symbols, and what they stand for behind all events.
    pub fn finals(&self) -> impl Iterator<Item = (Id, Id)> + '_ {
        self.cells.iter().map(|cell| (cell.symbol, cell.now))
    }
}

/// When the statement of an event is done.
struct When {
    /// in a run: the condition; else at its start, if a condition holds there
    at: Option<Id>,
    in_run: bool,
}

impl<'a> Elaborator<'a> {
    /// May it not be set here?
    pub fn is_held(&self, k: u32) -> bool {
        !self.frame.at_event && self.frame.held.contains_key(&k)
    }

    /// Before the analog block of a module: its variables that events set have the values that they kept.
    pub fn hold(&mut self, analog: &[S]) -> Answer<()> {
        let mut set = BTreeSet::new();
        analog.iter().for_each(|&s| self.set_at_events(s, false, &mut set));
        for k in set {
            let variable = self.variable(k).clone();
            let (first, starts) = match self.frame.values[k as usize].clone() {
                // each has a history of its own
                Val::Row(_, items) if items.len() > 1000 => {
                    let what =
                        format!("{} is set at an event, and has {} values", self.word(variable.name), items.len());
                    return self.stop(variable.at, what, "1000 are kept at most");
                }
                Val::Row(first, items) => (Some(first), items.to_vec()),
                one => (None, vec![one]),
            };
            let mut cells = Vec::with_capacity(starts.len());
            for start in starts {
                let Val::Num(start) = start else {
                    let what = format!("{} is set at an event, and is a string", self.word(variable.name));
                    return self.stop(variable.at, what, "numbers are kept");
                };
                cells.push(self.cell(&start));
            }
            let held = Held { cells, first, whole: variable.kind == Type::Integer };
            self.frame.values[k as usize] = held.value(|cell| cell.symbol);
            self.frame.held.insert(k, held);
        }
        Ok(())
    }

    fn cell(&mut self, start: &Num) -> Cell {
        let start = if self.unset.contains_key(&start.id) { self.g.constant(0.0) } else { self.plain(start).id };
        let symbol = self.g.symbol();
        let (begun, kept) = (self.begun(), self.mode(Mode::Kept(symbol)));
        let before = self.g.select(begun, kept, start);
        Cell { symbol, before, now: before }
    }

    /// The variables that an expression sets: seeds, and what functions give back.
    fn set_by_value(&self, e: E, set: &mut BTreeSet<u32>) {
        let mut given = |e: E| {
            if let Expression::Variable(k) | Expression::Element(k, _) = self.library.expressions[e as usize] {
                set.insert(k);
            }
        };
        match &self.library.expressions[e as usize] {
            Expression::Call(word, arguments) => {
                if super::random::draws(self.word(*word)) {
                    arguments.first().copied().into_iter().for_each(&mut given);
                }
                arguments.iter().for_each(|&e| self.set_by_value(e, set));
            }
            Expression::Function(k, arguments) => {
                let function = &self.library.modules[self.scope.module].functions[*k as usize];
                let outputs = function.arguments.iter().zip(arguments).filter(|(a, _)| a.2);
                outputs.for_each(|(_, &e)| given(e));
                arguments.iter().for_each(|&e| self.set_by_value(e, set));
            }
            Expression::Unary(_, a) => self.set_by_value(*a, set),
            Expression::Binary(_, a, b) => [a, b].into_iter().for_each(|&e| self.set_by_value(e, set)),
            Expression::Conditional(a, b, c) => [a, b, c].into_iter().for_each(|&e| self.set_by_value(e, set)),
            _ => {}
        }
    }

    /// The variables that a statement sets at events of a run.
    fn set_at_events(&self, s: S, within: bool, set: &mut BTreeSet<u32>) {
        let mut all = |of: &[S], within: bool| of.iter().for_each(|&s| self.set_at_events(s, within, set));
        match &self.library.statements[s as usize] {
            Statement::Block(body) => all(body, within),
            Statement::If(_, yes, no) => {
                all(&[*yes], within);
                all(no.as_slice(), within);
            }
            Statement::Case(_, arms, otherwise) => {
                arms.iter().for_each(|arm| all(&[arm.1], within));
                all(otherwise.as_slice(), within);
            }
            Statement::For(first, _, next, body) => all(&[*first, *next, *body], within),
            Statement::While(_, body, _) | Statement::Repeat(_, body) => all(&[*body], within),
            Statement::Event(triggers, body) => {
                let in_run = |&e: &E| !matches!(self.event_name(e), "initial_step" | "final_step");
                all(&[*body], within || triggers.iter().any(in_run));
            }
            Statement::Begin(k, _) if within => {
                set.insert(*k);
            }
            Statement::Assign(k, _, e) if within => {
                set.insert(*k);
                self.set_by_value(*e, set);
            }
            Statement::Call(e) if within => self.set_by_value(*e, set),
            _ => {}
        }
    }

    /// last_crossing(expression, direction): when; -1 before there was one.
    pub fn last_crossing(&mut self, e: E) -> Answer<Num> {
        let crossed = self.crossing(e)?.1;
        let (time, symbol, begun) = (self.g.time(), self.g.symbol(), self.begun());
        let (now, before) = (self.mode(Mode::Kept(time)), self.mode(Mode::Kept(symbol)));
        let last = self.g.select(crossed, now, before);
        let never = self.g.constant(-1.0);
        let last = self.g.select(begun, last, never);
        self.finals.push((symbol, last));
        Ok(self.real(symbol))
    }

    /// What symbols stand for in the end: each may be made of others, but not of itself.
    pub fn resolve_finals(&mut self) -> Answer<()> {
        for _ in 0..self.finals.len() {
            let symbols: HashSet<Id> = self.finals.iter().map(|f| f.0).collect();
            let mut open = false;
            for k in 0..self.finals.len() {
                let e = self.finals[k].1;
                if self.g.reachable(&[e]).iter().any(|id| symbols.contains(id)) {
                    open = true;
                    self.finals[k].1 = substitute(&mut self.g, &[e], &self.finals)[0];
                }
            }
            if !open {
                return Ok(());
            }
        }
        let symbols: HashSet<Id> = self.finals.iter().map(|f| f.0).collect();
        let of: Vec<Id> = self.finals.iter().map(|f| f.1).collect();
        if self.g.reachable(&of).iter().any(|id| symbols.contains(id)) {
            let at = self.library.modules[self.scope.module].at;
            return self.stop(
                at,
                "what keeps its value hangs on itself",
                "let events set it: @(cross(..)), @(timer(..))",
            );
        }
        Ok(())
    }

    fn event_name(&self, trigger: E) -> &str {
        match &self.library.expressions[trigger as usize] {
            Expression::Name(word, _) | Expression::Call(word, _) => self.word(*word),
            _ => "",
        }
    }

    /// 1 but for where a run begins.
    pub fn begun(&mut self) -> Id {
        let one = self.g.constant(1.0);
        self.mode(Mode::Kept(one))
    }

    pub fn event(&mut self, triggers: &[E], body: S, at: Place) -> Answer<()> {
        let (mut begins, mut starts, mut fired) = (false, Vec::new(), Vec::new());
        for &trigger in triggers {
            match self.event_name(trigger) {
                "initial_step" => begins = true,
                "final_step" => {}
                "cross" => fired.push(self.crossing(trigger)?.1),
                "above" => {
                    let (on, rises) = self.crossing(trigger)?;
                    starts.push(on);
                    fired.push(rises);
                }
                "timer" | "absdelta" => {
                    let is_timer = self.event_name(trigger) == "timer";
                    let (at_once, later) = if is_timer { self.timer(trigger)? } else { self.absdelta(trigger)? };
                    starts.extend(at_once);
                    fired.push(later);
                }
                name => {
                    let what = format!("@({name}) is not supported");
                    let hint = "initial_step, final_step, cross, above, absdelta and timer are";
                    return self.stop(self.place(trigger), what, hint);
                }
            }
        }
        if self.frame.at_event || !fired.is_empty() && !self.path.is_empty() {
            let hint = "write the condition inside of the event";
            return self.stop(at, "an event inside of a condition that voltages decide, or of another event", hint);
        }
        if begins || !starts.is_empty() {
            let holds = if begins { None } else { Some(self.any(&starts)) };
            self.done_at(&When { at: holds, in_run: false }, body, at)?;
        }
        if !fired.is_empty() {
            let fires = Some(self.any(&fired));
            self.done_at(&When { at: fires, in_run: true }, body, at)?;
        }
        Ok(())
    }

    fn any(&mut self, of: &[Id]) -> Id {
        let (one, zero) = (self.g.constant(1.0), self.g.constant(0.0));
        of.iter().fold(zero, |any, &c| self.g.select(c, one, any))
    }

    /// cross(expression, direction) or above(expression): is it above 0, and has it just been crossed in that direction?
    fn crossing(&mut self, trigger: E) -> Answer<(Id, Id)> {
        let (name, at) = (self.event_name(trigger).to_string(), self.place(trigger));
        let is_cross = name != "above";
        // the tolerances of time and value are those of the run: a step ends at the event
        let most = if is_cross { 5 } else { 4 };
        let arguments = self.event_arguments(trigger, 1, most)?;
        let x = self.plain_number(arguments[0])?.id;
        let given = arguments.get(1).filter(|&&e| !self.is_missing(e));
        let direction = match given.filter(|_| is_cross) {
            Some(&e) => self.known(e, "the direction")?,
            None => f64::from(u8::from(!is_cross)),
        };
        let on = match self.g.value(x) {
            Some(v) => self.g.constant(f64::from(u8::from(v > 0.0))),
            None => self.mode(Mode::Above(x)),
        };
        let (was, begun, one) = (self.mode(Mode::Kept(on)), self.begun(), self.g.constant(1.0));
        let (off, was_off) = (self.g.sub(one, on), self.g.sub(one, was));
        let (rises, falls) = (self.g.mul(on, was_off), self.g.mul(was, off));
        let turned = match direction {
            1.0 => rises,
            -1.0 => falls,
            0.0 => self.g.add(rises, falls),
            _ => return self.stop(at, format!("a direction of {direction}"), "1 is up, -1 down, 0 both"),
        };
        // LRM 5.10.3.2: sweeps see above, but no cross
        let while_on = symbol_of("tran").filter(|_| is_cross).map_or(one, |k| self.g.given(k));
        let turned = self.g.mul(turned, while_on);
        let turned = self.g.mul(turned, begun);
        let (on, turned) = (self.enabled(arguments.get(most - 1), on)?, self.enabled(arguments.get(most - 1), turned)?);
        Ok((on, turned))
    }

    /// The arguments of an event, as many as it takes.
    pub fn event_arguments(&self, trigger: E, least: usize, most: usize) -> Answer<&'a [E]> {
        let library = self.library;
        let arguments: &[E] = match &library.expressions[trigger as usize] {
            Expression::Call(_, arguments) => arguments,
            _ => &[],
        };
        if (least..=most).contains(&arguments.len()) {
            return Ok(arguments);
        }
        let name = self.event_name(trigger);
        let what = format!("@({name}) takes {least} to {most} arguments, here are {}", arguments.len());
        self.stop(self.place(trigger), what, "")
    }

    pub fn is_missing(&self, e: E) -> bool {
        matches!(self.library.expressions[e as usize], Expression::Empty)
    }

    /// What fires, where the last argument of the event lets it.
    pub fn enabled(&mut self, condition: Option<&E>, fires: Id) -> Answer<Id> {
        let Some(&condition) = condition.filter(|&&e| !self.is_missing(e)) else { return Ok(fires) };
        let (condition, zero) = (self.plain_number(condition)?.id, self.g.constant(0.0));
        Ok(self.g.select(condition, fires, zero))
    }

    /// Runs the statement of an event. What it sets is made of values just before it.
    fn done_at(&mut self, when: &When, body: S, at: Place) -> Answer<()> {
        let outer = std::mem::take(&mut self.frame.journal);
        let stamp = self.stamp;
        self.next_stamp += 1;
        self.stamp = self.next_stamp;
        let touched: Vec<State> = self.branches.iter().map(|b| b.state).collect();
        for (&k, held) in &self.frame.held {
            self.frame.values[k as usize] = held.value(|cell| cell.now);
        }
        let depth = self.path.len();
        self.path.extend(when.at.map(|c| (c, true)));
        self.frame.at_event = true;
        let done = self.execute(body);
        self.frame.at_event = false;
        self.path.truncate(depth);
        done?;
        let journal = std::mem::replace(&mut self.frame.journal, outer);
        self.stamp = stamp;
        let mut set: Vec<(u32, Val)> = Vec::new();
        for (k, old) in journal.into_iter().rev() {
            let new = std::mem::replace(&mut self.frame.values[k as usize], old);
            if !set.iter().any(|v| v.0 == k) {
                set.push((k, new));
            }
        }
        for (&k, held) in &self.frame.held {
            self.frame.values[k as usize] = held.value(|cell| cell.symbol);
        }
        let mut branches = self.branches.iter().enumerate();
        if branches.any(|(b, branch)| touched.get(b).map_or(branch.state.touched, |t| branch.state != *t)) {
            let hint = "contribute outside of the event what a variable keeps";
            return self.stop(at, "a contribution at an event is not supported", hint);
        }
        set.into_iter().rev().try_for_each(|(k, new)| self.set_by_event(k, new, when, at))
    }

    fn set_by_event(&mut self, k: u32, new: Val, when: &When, at: Place) -> Answer<()> {
        let name = self.word(self.variable(k).name);
        if self.frame.held.contains_key(&k) {
            if !self.path.is_empty() {
                let what = format!("{name} keeps its value, and voltages decide whether it is set");
                return self.stop(at, what, "write the condition inside of the event");
            }
            let new = match new {
                Val::Row(_, items) => items.to_vec(),
                one => vec![one],
            };
            for (j, new) in new.into_iter().enumerate() {
                let Val::Num(new) = new else { continue };
                let old = self.frame.held[&k].cells[j].now;
                let new = self.plain(&new).id;
                if new == old {
                    continue;
                }
                let new = self.just_before(new, when.in_run);
                let begun = self.begun();
                let chosen = when.at.map_or(new, |c| self.g.select(c, new, old));
                let now = if when.in_run { chosen } else { self.g.select(begun, old, chosen) };
                self.frame.held.entry(k).and_modify(|held| held.cells[j].now = now);
            }
            return Ok(());
        }
        let mut ids = Vec::new();
        gathered(&new, &mut ids);
        ids.retain(|id| !self.unset.contains_key(id));
        let moves = |node: Node| match node {
            Node::Symbol(k) => k >= SYMBOLS,
            node => matches!(node, Node::Unknown(_) | Node::Time | Node::Flag(_) | Node::Wave(_)),
        };
        let moves = self.g.reachable(&ids).into_iter().any(|id| moves(self.g.node(id)));
        self.frame.begun.insert(k);
        match new {
            Val::Num(new) if when.at.is_none() && self.path.is_empty() && self.frame.memories.contains_key(&k) => {
                let new = self.plain(&new).id;
                let start = self.just_before(new, false);
                self.begins_with(k, start);
            }
            // the same at every evaluation
            new if !moves && when.at.is_none() => self.keep(k, new),
            Val::Num(new) if when.at.is_none() && self.path.is_empty() => {
                let (symbol, begun) = (self.g.symbol(), self.begun());
                let (kept, new) = (self.mode(Mode::Kept(symbol)), self.plain(&new));
                let first = self.just_before(new.id, false);
                let id = self.g.select(begun, kept, first);
                self.finals.push((symbol, id));
                self.keep(k, Val::Num(Num { id: symbol, ..new }));
            }
            _ => {
                let what = format!("{name} is kept from an event, and hangs on voltages");
                return self.stop(at, what, "assign to it in the event itself, outside of conditions and functions");
            }
        }
        Ok(())
    }

    /// An expression of values just before the event. Where a run begins they are those of its operating point.
    fn just_before(&mut self, e: Id, in_run: bool) -> Id {
        let cells = self.frame.held.values().flat_map(|held| &held.cells);
        let mut map: Vec<(Id, Id)> = cells.map(|cell| (cell.symbol, cell.before)).collect();
        let leaves: Vec<Id> = self.g.reachable(&[e]).into_iter().filter(|_| in_run).collect();
        for leaf in leaves {
            let changes = match self.g.node(leaf) {
                Node::Flag(k) => !matches!(self.modes[k as usize], Mode::Kept(_)),
                Node::Symbol(k) => k >= SYMBOLS && !map.iter().any(|m| m.0 == leaf),
                node => matches!(node, Node::Unknown(_) | Node::Time | Node::Wave(_)),
            };
            if changes {
                map.push((leaf, self.mode(Mode::Kept(leaf))));
            }
        }
        substitute(&mut self.g, &[e], &map)[0]
    }
}

/// The expressions that a value is made of.
fn gathered(value: &Val, ids: &mut Vec<Id>) {
    match value {
        Val::Num(n) => ids.extend([Some(n.id), n.q].into_iter().flatten()),
        Val::Text(_) => {}
        Val::Row(_, items) => items.iter().for_each(|item| gathered(item, ids)),
    }
}
