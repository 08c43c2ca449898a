//! Loops that voltages end: one pass is run with symbols in place of what changes in it, and becomes a law that is repeated while the
//! program runs (`repeat.rs` of the expressions).
use super::ast::{Expression, Statement, Type, E, S};
use super::elaborate::{Answer, Elaborator, Num, Val};
use super::source::Place;
use emsim_expr::derive::substitute;
use emsim_expr::graph::Id;
use emsim_expr::repeat;
use std::collections::BTreeSet;

/// Operators that have unknowns, events or sources of noise of their own, and slopes of what a pass does not know: not in a loop.
const NOT_IN_LOOPS: &[&str] = &[
    "ddt",
    "idt",
    "idtmod",
    "ddx",
    "white_noise",
    "flicker_noise",
    "noise_table",
    "noise_table_log",
    "laplace_nd",
    "laplace_np",
    "laplace_zd",
    "laplace_zp",
    "zi_nd",
    "zi_np",
    "zi_zd",
    "zi_zp",
    "absdelay",
    "transition",
    "slew",
    "ac_stim",
    "last_crossing",
    "$limit",
    "$bound_step",
];

/// What ends a loop.
#[derive(Clone, Copy)]
pub enum End {
    Condition(E),
    /// so many passes
    Count(E, Id),
}

/// A variable that a pass changes.
struct Carried {
    variable: u32,
    symbol: Id,
}

impl Elaborator<'_> {
    /// So many passes: unrolled where parameters say how many.
    pub fn counted(&mut self, count: E, body: S) -> Answer<()> {
        let n = self.plain_number(count)?;
        self.loops += 1;
        if self.value_of(&n).is_none() && self.impeding(count, &[body]).is_none() {
            let begins = self.is_left(n.id);
            self.looped(End::Count(count, n.id), &[body], (begins, false))?;
        } else {
            for _ in 0..self.decided_value(&n, count, "how often this is repeated")?.round() as u64 {
                self.execute(body)?;
                self.steps += 1;
            }
        }
        self.loops -= 1;
        Ok(())
    }

    /// What stands in the way of a loop of its own.
    pub fn impeding(&self, c: E, body: &[S]) -> Option<(Place, String)> {
        body.iter().find_map(|&s| self.in_statement(s)).or_else(|| self.in_expression(c))
    }

    fn in_statement(&self, s: S) -> Option<(Place, String)> {
        let here = |what: &str| Some((self.library.statement_places[s as usize], what.to_string()));
        let all = |list: &[S]| list.iter().find_map(|&s| self.in_statement(s));
        let of = |e: E| self.in_expression(e);
        match &self.library.statements[s as usize] {
            Statement::Nothing => None,
            Statement::Block(body) => all(body),
            Statement::Begin(_, e) => e.and_then(of),
            Statement::If(c, yes, no) => {
                of(*c).or_else(|| all(&[*yes])).or_else(|| no.and_then(|s| self.in_statement(s)))
            }
            Statement::Case(e, arms, otherwise) => {
                let arm = |arm: &(Vec<E>, S)| arm.0.iter().find_map(|&e| of(e)).or_else(|| self.in_statement(arm.1));
                of(*e).or_else(|| arms.iter().find_map(arm)).or_else(|| otherwise.and_then(|s| self.in_statement(s)))
            }
            Statement::For(first, c, next, body) => all(&[*first, *next, *body]).or_else(|| of(*c)),
            Statement::While(e, body, _) | Statement::Repeat(e, body) => of(*e).or_else(|| all(&[*body])),
            Statement::Assign(_, None, e) | Statement::Call(e) => of(*e),
            Statement::Assign(_, Some(_), _) => here("a row of values is assigned to"),
            Statement::Event(..) => here("an event stands"),
            Statement::Contribute(..) | Statement::Indirect(..) => here("a contribution stands"),
        }
    }

    fn in_expression(&self, e: E) -> Option<(Place, String)> {
        let all = |list: &[E]| list.iter().find_map(|&e| self.in_expression(e));
        let library = self.library;
        match &library.expressions[e as usize] {
            Expression::Unary(_, a) | Expression::Element(_, a) | Expression::ParameterElement(_, a) => all(&[*a]),
            Expression::Binary(_, a, b) => all(&[*a, *b]),
            Expression::Conditional(a, b, c) => all(&[*a, *b, *c]),
            Expression::List(list) => all(list),
            Expression::Port(_) => Some((self.place(e), "the flow into a port is read".into())),
            Expression::Call(word, list) => {
                let name = self.word(*word);
                let barred = NOT_IN_LOOPS.contains(&name) || crate::random::draws(name);
                let what = || (self.place(e), format!("{name} stands"));
                barred.then(what).or_else(|| all(list))
            }
            Expression::Function(k, list) => {
                let body = &library.modules[self.scope.module].functions[*k as usize].body;
                all(list).or_else(|| body.iter().find_map(|&s| self.in_statement(s)))
            }
            _ => None,
        }
    }

    /// Variables that a statement assigns to, but for those that functions give back.
    fn assigned(&self, s: S, found: &mut BTreeSet<u32>) {
        let mut all = |list: &[S]| list.iter().for_each(|&s| self.assigned(s, found));
        match &self.library.statements[s as usize] {
            Statement::Block(body) => all(body),
            Statement::If(_, yes, no) => {
                all(&[*yes]);
                no.iter().for_each(|&s| all(&[s]));
            }
            Statement::Case(_, arms, otherwise) => {
                arms.iter().for_each(|arm| all(&[arm.1]));
                otherwise.iter().for_each(|&s| all(&[s]));
            }
            Statement::For(first, _, next, body) => all(&[*first, *next, *body]),
            Statement::While(_, body, _) | Statement::Repeat(_, body) => all(&[*body]),
            Statement::Assign(k, None, _) | Statement::Begin(k, Some(_)) => {
                found.insert(*k);
            }
            _ => {}
        }
    }

    /// The loop from here on: what it changed has the value that it ends with. `begins`: its condition here.
    pub fn looped(&mut self, end: End, body: &[S], begins: (Id, bool)) -> Answer<()> {
        // what has a value and is assigned to has a symbol from the first pass on; what has none may not be read before it is set
        let mut assigned = BTreeSet::new();
        body.iter().for_each(|&s| self.assigned(s, &mut assigned));
        assigned.retain(|&k| match self.frame.values.get(k as usize) {
            Some(Val::Num(n)) => !self.unset.contains_key(&n.id) && !self.is_held(k),
            _ => false,
        });
        let mut carried: Vec<Carried> = Vec::new();
        for variable in assigned {
            carried.push(Carried { variable, symbol: self.g.symbol() });
        }
        let left = self.g.symbol();
        let (condition, changed) = loop {
            let (condition, changed) = self.pass((end, left), body, &carried)?;
            let known = carried.len();
            for (variable, _) in &changed {
                if !carried.iter().any(|v| v.variable == *variable) {
                    carried.push(Carried { variable: *variable, symbol: self.g.symbol() });
                }
            }
            // once more, with symbols for those too
            if carried.len() == known {
                break (condition, changed);
            }
        };
        let (mut symbols, mut starts, mut next, mut still) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for v in &carried {
            let start = self.begins_as(v.variable)?;
            match changed.iter().find(|new| new.0 == v.variable).map(|new| &new.1) {
                Some(Val::Num(n)) if n.id != v.symbol => {
                    symbols.push(v.symbol);
                    next.push(n.id);
                    starts.push(start);
                }
                _ => still.push((v.symbol, start)),
            }
        }
        carried.retain(|v| symbols.contains(&v.symbol));
        let (End::Condition(e) | End::Count(e, _)) = end;
        if let End::Count(_, count) = end {
            let one = self.g.constant(1.0);
            symbols.push(left);
            next.push(self.g.sub(left, one));
            starts.push(count);
        }
        let zero = self.g.constant(0.0);
        // it is not run where it is not reached
        let mut condition = condition;
        for (c, holds) in self.path.clone().into_iter().rev() {
            condition = self.select((c, !holds), condition, zero);
        }
        let here = self.library.sources.message(self.place(e), "", "");
        let name = here.file.rsplit(['/', '\\']).next().unwrap_or_default();
        let at = format!("{name}:{}", here.line);
        next.push(condition);
        let mut next = substitute(&mut self.g, &next, &still);
        let condition = next.pop().unwrap_or(zero);
        let (number, inputs) = repeat::made(&self.g, &symbols, condition, &next, &at);
        let begin = |&id: &Id| if self.unset.contains_key(&id) { zero } else { id };
        let arguments: Vec<Id> = starts.iter().map(begin).chain(inputs).collect();
        let list = self.g.list(&arguments);
        for (k, (v, start)) in carried.iter().zip(starts).enumerate() {
            let mut id = self.g.result(number, k as u32, list);
            if self.unset.contains_key(&start) {
                // without a pass it has no value
                id = self.select(begins, id, start);
            }
            let whole = self.variable(v.variable).kind == Type::Integer;
            self.keep(v.variable, Val::Num(Num { whole, ..self.real(id) }));
        }
        Ok(())
    }

    /// Is another pass left of so many? Half of one is rounded up.
    pub fn is_left(&mut self, count: Id) -> Id {
        let half = self.g.constant(0.5);
        self.g.not_less(count, half)
    }

    fn begins_as(&mut self, variable: u32) -> Answer<Id> {
        match self.frame.values[variable as usize].clone() {
            Val::Num(n) => Ok(self.plain(&n).id),
            _ => self.carries(variable, "a row of values or a string"),
        }
    }

    fn carries<T>(&self, variable: u32, what: &str) -> Answer<T> {
        let about = self.variable(variable);
        let text = format!("{} changes in a loop whose end hangs on voltages: {what}", self.word(about.name));
        self.stop(about.at, text, "such a loop carries numbers from pass to pass")
    }

    /// One pass with symbols in place of what it carries: its condition, and what it changed. Nothing is left of it.
    fn pass(&mut self, end: (End, Id), body: &[S], carried: &[Carried]) -> Answer<(Id, Vec<(u32, Val)>)> {
        let outer = std::mem::take(&mut self.frame.journal);
        let stamp = self.stamp;
        self.next_stamp += 1;
        self.stamp = self.next_stamp;
        for v in carried {
            let whole = self.variable(v.variable).kind == Type::Integer;
            self.keep(v.variable, Val::Num(Num { whole, ..self.real(v.symbol) }));
        }
        let condition = match end {
            (End::Condition(e), _) => self.plain_number(e)?.id,
            (End::Count(..), left) => self.is_left(left),
        };
        let known = self.condition(condition);
        self.path.push((known.0, !known.1));
        for &s in body {
            self.execute(s)?;
        }
        self.path.pop();
        let changed = self.undone();
        self.frame.journal = outer;
        self.stamp = stamp;
        for (variable, value) in &changed {
            if !matches!(value, Val::Num(n) if n.q.is_none() && n.noise.is_none()) {
                return self.carries(*variable, "a row of values, a string, a rate or noise");
            }
        }
        Ok((condition, changed))
    }
}
