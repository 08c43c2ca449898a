//! Expressions: numbers where parameters decide, nodes of the graph where voltages do.
use super::ast::{Expression, Operator, Type, E};
use super::elaborate::{Answer, Elaborator, Num, Val, MOST_NODES};
use super::folded::{symbol_of, Limit, Mode, GROUND};
use super::source::{Place, Word};
use emsim_expr::derive::gradient;
use emsim_expr::graph::{Fun, Id, Node};
use std::rc::Rc;

/// k/q of CODATA 2018.
const VOLTS_PER_KELVIN: f64 = 1.380649e-23 / 1.602176634e-19;

mod arithmetic;
mod calls;

impl Elaborator<'_> {
    pub fn eval(&mut self, e: E) -> Answer<Val> {
        let library = self.library;
        Ok(match &library.expressions[e as usize] {
            Expression::Number(v, whole) => Val::Num(Num { whole: *whole, ..self.constant(*v) }),
            Expression::Text(t) => Val::Text(t.clone()),
            Expression::Variable(k) => self.read(*k, e)?,
            Expression::Parameter(k) => self.parameter(*k)?,
            Expression::Element(k, index) => {
                let row = self.read(*k, e)?;
                self.element(row, *index)?
            }
            Expression::ParameterElement(k, index) => {
                let row = self.parameter(*k)?;
                self.element(row, *index)?
            }
            Expression::Unary(op, a) => {
                let a = self.number(*a)?;
                Val::Num(self.unary(*op, a, e)?)
            }
            Expression::Binary(op, a, b) => self.binary(*op, *a, *b, e)?,
            Expression::Conditional(c, a, b) => self.conditional(*c, *a, *b)?,
            Expression::List(list) => {
                let mut row = Vec::with_capacity(list.len());
                self.listed(list, &mut row)?;
                Val::Row(0, Rc::new(row))
            }
            Expression::System(word) => self.system(*word, &[], e)?,
            Expression::Call(word, arguments) => self.call(*word, arguments, e)?,
            Expression::Function(k, arguments) => self.function(*k, arguments, e)?,
            Expression::Name(word, _) | Expression::Part(word, ..) => {
                let what = format!("{} is no value", self.word(*word));
                return self.stop(self.place(e), what, "V(node) is the potential of a node");
            }
            Expression::Port(_) | Expression::Empty | Expression::Repeated(..) => {
                return self.stop(self.place(e), "a value is missing here", "");
            }
        })
    }

    /// What stands between { }, with what is repeated.
    fn listed(&mut self, list: &[E], row: &mut Vec<Val>) -> Answer<()> {
        let library = self.library;
        for &item in list {
            let Expression::Repeated(count, items) = &library.expressions[item as usize] else {
                row.push(self.eval(item)?);
                continue;
            };
            let times = self.index_of(*count)?;
            // a row of variables is as long at most
            if !(0..=100_000).contains(&times) {
                let what = format!("repeated {times} times");
                return self.stop(self.place(*count), what, "0 to 100000 times");
            }
            for _ in 0..times {
                self.listed(items, row)?;
            }
        }
        Ok(())
    }

    pub fn number(&mut self, e: E) -> Answer<Num> {
        match self.eval(e)? {
            Val::Num(n) => Ok(n),
            Val::Text(_) => self.stop(self.place(e), "a string where a number is expected", ""),
            Val::Row(..) => {
                self.stop(self.place(e), "a row of values where a number is expected", "write one of them: name[index]")
            }
        }
    }

    /// A number without d/dt and noise.
    pub fn plain_number(&mut self, e: E) -> Answer<Num> {
        let n = self.number(e)?;
        Ok(self.plain(&n))
    }

    pub fn known(&mut self, e: E, what: &str) -> Answer<f64> {
        let n = self.number(e)?;
        self.decided_value(&n, e, what)
    }

    pub fn decided_value(&self, n: &Num, e: E, what: &str) -> Answer<f64> {
        let hint = "it must follow from parameters alone";
        self.value_of(n).map_or_else(|| self.stop(self.place(e), format!("{what} hangs on voltages"), hint), Ok)
    }

    pub fn is_small(&self, at: Place) -> Answer<()> {
        if self.g.len() <= MOST_NODES {
            return Ok(());
        }
        self.stop(at, "the module comes to too many operations", "are loops unrolled that end on voltages?")
    }

    pub fn text(&mut self, e: E) -> Answer<String> {
        match self.eval(e)? {
            Val::Text(t) => Ok(t.to_string()),
            _ => self.stop(self.place(e), "a string is expected here", "strings stand in quotes"),
        }
    }

    pub fn row_of_numbers(&mut self, e: E) -> Answer<Vec<f64>> {
        let Val::Row(_, items) = self.eval(e)? else {
            return self.stop(self.place(e), "a row of numbers is expected here", "'{1, 2, ...}");
        };
        let value = |item: &Val| match item {
            Val::Num(n) => self.decided_value(n, e, "a number of this row"),
            _ => self.stop(self.place(e), "a row of numbers is expected here", "'{1, 2, ...}"),
        };
        items.iter().map(value).collect()
    }

    fn element(&mut self, row: Val, index: E) -> Answer<Val> {
        let Val::Row(first, items) = row else {
            return self.stop(
                self.place(index),
                "this is no row of values",
                "declare it with a range: real name[0:3];",
            );
        };
        let place = self.plain_number(index)?;
        if self.value_of(&place).is_none() {
            return self.element_at(first, &items, &place, index);
        }
        let at = self.index_of(index)?;
        match usize::try_from(at - first).ok().and_then(|k| items.get(k)) {
            Some(item) => Ok(item.clone()),
            None => {
                let last = first + items.len() as i64 - 1;
                self.stop(self.place(index), format!("{at} is outside of {first}:{last}"), "")
            }
        }
    }

    /// One of a row that voltages choose; beyond its ends the last one.
    fn element_at(&mut self, first: i64, items: &[Val], place: &Num, at: E) -> Answer<Val> {
        let mut chosen = items[0].clone();
        for (k, item) in items.iter().enumerate().skip(1) {
            let edge = self.g.constant(first as f64 + k as f64 - 0.5);
            let behind = self.g.not_less(place.id, edge);
            chosen = self.merged((behind, false), item.clone(), chosen, self.place(at))?;
        }
        self.is_small(self.place(at))?;
        Ok(chosen)
    }

    // ---- conditions ----

    /// A condition of the graph for a value that is true where it is not 0, and whether it is turned round.
    pub fn condition(&self, id: Id) -> (Id, bool) {
        if let Node::Select(c, a, b) = self.g.node(id) {
            match (self.g.value(a), self.g.value(b)) {
                (Some(x), Some(0.0)) if x != 0.0 => return (c, false),
                (Some(0.0), Some(y)) if y != 0.0 => return (c, true),
                _ => {}
            }
        }
        (id, false)
    }

    /// What is decided of it: by parameters, or because the run is inside of that condition.
    pub fn decided(&self, id: Id) -> Option<bool> {
        if let Some(v) = self.g.value(id) {
            return Some(v != 0.0);
        }
        let (c, turned) = self.condition(id);
        self.path.iter().rev().find(|p| p.0 == c).map(|p| p.1 != turned)
    }

    pub fn select(&mut self, c: (Id, bool), a: Id, b: Id) -> Id {
        if c.1 {
            self.g.select(c.0, b, a)
        } else {
            self.g.select(c.0, a, b)
        }
    }

    fn truth(&mut self, c: (Id, bool)) -> Num {
        let (one, zero) = (self.g.constant(1.0), self.g.constant(0.0));
        let id = self.select(c, one, zero);
        Num { id, whole: true, q: None, noise: None }
    }

    /// What a value is under the conditions that the run is inside of.
    pub fn within(&self, mut id: Id) -> Id {
        while let Node::Select(c, a, b) = self.g.node(id) {
            match self.path.iter().rev().find(|p| p.0 == c) {
                Some(p) => id = if p.1 { a } else { b },
                None => break,
            }
        }
        id
    }

    fn conditional(&mut self, c: E, a: E, b: E) -> Answer<Val> {
        let condition = self.plain_number(c)?;
        match self.decided(condition.id) {
            Some(true) => self.eval(a),
            Some(false) => self.eval(b),
            None => {
                let (c, turned) = self.condition(condition.id);
                self.path.push((c, !turned));
                let yes = self.eval(a);
                self.path.pop();
                self.path.push((c, turned));
                let no = self.eval(b);
                self.path.pop();
                self.merged((c, turned), yes?, no?, self.place(a))
            }
        }
    }

    /// The value of a selection.
    pub fn merged(&mut self, c: (Id, bool), yes: Val, no: Val, at: Place) -> Answer<Val> {
        match (yes, no) {
            (Val::Num(a), Val::Num(b)) => {
                if a.id == b.id && a.q == b.q && a.noise.is_none() && b.noise.is_none() {
                    return Ok(Val::Num(a));
                }
                // one charge on both sides goes on; different ones are currents of their own
                let (a, b) = if a.q == b.q { (a, b) } else { (self.without_charge(a), self.without_charge(b)) };
                let zero = self.g.constant(0.0);
                let mut noise = Vec::new();
                for (of, side) in [(&a.noise, true), (&b.noise, false)] {
                    for &(source, factor) in of.iter().flat_map(|n| n.iter()) {
                        let f = if side { self.select(c, factor, zero) } else { self.select(c, zero, factor) };
                        noise.push((source, f));
                    }
                }
                let noise = (!noise.is_empty()).then(|| Rc::new(noise));
                Ok(Val::Num(Num { id: self.select(c, a.id, b.id), whole: a.whole && b.whole, q: a.q, noise }))
            }
            (Val::Text(a), Val::Text(b)) if a == b => Ok(Val::Text(a)),
            (Val::Row(first, a), Val::Row(_, b)) if a.len() == b.len() => {
                let mut row = Vec::with_capacity(a.len());
                for (x, y) in a.iter().zip(b.iter()) {
                    row.push(self.merged(c, x.clone(), y.clone(), at)?);
                }
                Ok(Val::Row(first, Rc::new(row)))
            }
            _ => self.stop(at, "voltages decide between strings", "they must follow from parameters alone"),
        }
    }

    fn without_charge(&mut self, n: Num) -> Num {
        let noise = n.noise.clone();
        let plain = self.plain(&Num { noise: None, ..n });
        Num { noise, ..plain }
    }
}
