//! Expressions: numbers where parameters decide, nodes of the graph where voltages do.
use super::ast::{Expression, Operator, Type, E};
use super::elaborate::{Answer, Elaborator, Num, Val, MOST_NODES};
use super::folded::{symbol_of, Limit, Mode, GROUND};
use super::source::{Place, Word};
use crate::derive::gradient;
use crate::graph::{Fun, Id, Node};
use std::rc::Rc;

/// k/q of CODATA 2018.
const VOLTS_PER_KELVIN: f64 = 1.380649e-23 / 1.602176634e-19;
/// Where limexp goes on as a straight line.
const STEEPEST: f64 = 80.0;

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

    fn decided_value(&self, n: &Num, e: E, what: &str) -> Answer<f64> {
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

    // ---- operators ----

    fn unary(&mut self, op: Operator, a: Num, e: E) -> Answer<Num> {
        Ok(match op {
            Operator::Plus => a,
            Operator::Minus => self.negated(&a),
            Operator::Not => {
                let a = self.plain(&a);
                match self.g.value(a.id) {
                    Some(v) => self.whole(f64::from(u8::from(v == 0.0))),
                    None => {
                        let (c, turned) = self.condition(a.id);
                        self.truth((c, !turned))
                    }
                }
            }
            _ => self.whole(f64::from(!(self.decided_value(&a, e, "what bits are read of")? as i32))),
        })
    }

    fn negated(&mut self, a: &Num) -> Num {
        let minus = self.g.constant(-1.0);
        self.times(a, minus)
    }

    /// A number times what is no sum of charges and noise.
    fn times(&mut self, a: &Num, factor: Id) -> Num {
        let noise = a.noise.clone().map(|list| {
            let list = list.iter().map(|&(s, f)| (s, self.g.mul(f, factor))).collect();
            Rc::new(list)
        });
        let q = a.q.map(|q| self.g.mul(q, factor));
        Num { id: self.g.mul(a.id, factor), whole: a.whole, q, noise }
    }

    pub fn sum(&mut self, a: &Num, b: &Num) -> Num {
        let q = match (a.q, b.q) {
            (Some(x), Some(y)) => Some(self.g.add(x, y)),
            (x, y) => x.or(y),
        };
        let noise = match (&a.noise, &b.noise) {
            (Some(x), Some(y)) => Some(Rc::new(x.iter().chain(y.iter()).copied().collect())),
            (x, y) => x.clone().or_else(|| y.clone()),
        };
        Num { id: self.g.add(a.id, b.id), whole: a.whole && b.whole, q, noise }
    }

    /// Of a counter that a condition has set, and a known number: chosen among known numbers too, so that the condition decides a loop
    /// that ends by it.
    fn chosen(&mut self, op: Operator, a: &Num, b: &Num) -> Option<Num> {
        use Operator::*;
        if !(a.whole && b.whole) {
            return None;
        }
        if let (Some(x), Some(y)) = (self.value_of(a), self.value_of(b)) {
            return match op {
                Plus => Some(self.whole(x + y)),
                Minus => Some(self.whole(x - y)),
                Equals | Differs | Less | More | AtMost | AtLeast => Some(self.comparison(op, a.id, b.id)),
                _ => None,
            };
        }
        // one choice behind the other, no tree of them: its leaves would double with each
        let choice = |run: &Self, n: &Num| match run.g.node(n.id) {
            Node::Select(c, yes, no) if run.g.value(yes).or(run.g.value(no)).is_some() => Some((c, yes, no)),
            _ => None,
        };
        let one = |run: &Self, id| Num { whole: true, ..run.real(id) };
        let (c, yes, no) = match (choice(self, a), self.value_of(b), choice(self, b), self.value_of(a)) {
            (Some((c, yes, no)), Some(_), ..) => {
                (c, self.chosen(op, &one(self, yes), b)?, self.chosen(op, &one(self, no), b)?)
            }
            (_, _, Some((c, yes, no)), Some(_)) => {
                (c, self.chosen(op, a, &one(self, yes))?, self.chosen(op, a, &one(self, no))?)
            }
            _ => return None,
        };
        let id = self.g.select(c, yes.id, no.id);
        Some(one(self, id))
    }

    fn binary(&mut self, op: Operator, ea: E, eb: E, e: E) -> Answer<Val> {
        use Operator::*;
        let a = self.eval(ea)?;
        if let Val::Text(x) = &a {
            let Val::Text(y) = self.eval(eb)? else {
                return self.stop(self.place(eb), "a string is expected here", "strings stand in quotes");
            };
            let holds = match op {
                Equals => *x == y,
                Differs => *x != y,
                Less => **x < *y,
                More => **x > *y,
                AtMost => **x <= *y,
                AtLeast => **x >= *y,
                _ => return self.stop(self.place(e), "strings can only be compared", ""),
            };
            return Ok(Val::Num(self.whole(f64::from(u8::from(holds)))));
        }
        let Val::Num(a) = a else {
            return self.stop(self.place(ea), "a number is expected here", "");
        };
        if matches!(op, And | Or) {
            return self.logical(op == And, a, eb).map(Val::Num);
        }
        let b = self.number(eb)?;
        self.is_small(self.place(e))?;
        if let Some(chosen) = self.chosen(op, &a, &b) {
            return Ok(Val::Num(chosen));
        }
        let known = (self.value_of(&a), self.value_of(&b));
        Ok(Val::Num(match op {
            Plus => self.sum(&a, &b),
            Minus => {
                let b = self.negated(&b);
                self.sum(&a, &b)
            }
            Times => {
                // a charge only goes along with constants
                let a = if a.q.is_none() || known.1.is_some() { a } else { self.without_charge(a) };
                let b = if b.q.is_none() || known.0.is_some() { b } else { self.without_charge(b) };
                if a.noise.is_some() && b.noise.is_some() {
                    return self.stop(self.place(e), "a product of two sources of noise", "noise is a small signal");
                }
                let special = |n: &Num| n.q.is_some() || n.noise.is_some();
                let whole = a.whole && b.whole;
                let n = if special(&b) { self.times(&b, a.id) } else { self.times(&a, b.id) };
                Num { whole, ..n }
            }
            Over => {
                let b = self.plain(&b);
                if a.whole && b.whole {
                    return self.whole_quotient(&a, &b, eb).map(Val::Num);
                }
                if known.1 == Some(0.0) && known.0.is_some() {
                    // infinity is a value; 0/0 is told at the end
                    let v = known.0.unwrap_or(0.0) / 0.0;
                    return Ok(Val::Num(self.constant(v)));
                }
                if a.q.is_some() || a.noise.is_some() {
                    let a = if known.1.is_some() { a } else { self.without_charge(a) };
                    let one = self.g.constant(1.0);
                    let inverse = self.g.div(one, b.id);
                    Num { whole: false, ..self.times(&a, inverse) }
                } else {
                    let id = self.g.div(a.id, b.id);
                    self.real(id)
                }
            }
            Percent => {
                let (a, b) = (self.plain(&a), self.plain(&b));
                let whole = a.whole && b.whole;
                let n = match known {
                    (Some(_), Some(0.0)) => return self.stop(self.place(eb), "a remainder of a division by 0", ""),
                    (Some(x), Some(y)) => self.constant(x % y),
                    _ => {
                        let ratio = self.g.div(a.id, b.id);
                        let t = self.truncated(ratio);
                        let t = self.g.mul(t, b.id);
                        let id = self.g.sub(a.id, t);
                        self.real(id)
                    }
                };
                Num { whole, ..n }
            }
            Power => {
                let (a, b) = (self.plain(&a), self.plain(&b));
                self.power(&a, &b)
            }
            Equals | Differs | Less | More | AtMost | AtLeast => {
                let (a, b) = (self.plain(&a), self.plain(&b));
                self.comparison(op, a.id, b.id)
            }
            BitAnd | BitOr | BitXor | BitXnor | Left | Right => {
                let bits = |n: &Num| self.decided_value(n, e, "what bits are read of").map(|v| v as i32);
                let (x, y) = (bits(&a)?, bits(&b)?);
                self.whole(f64::from(match op {
                    BitAnd => x & y,
                    BitOr => x | y,
                    BitXor => x ^ y,
                    BitXnor => !(x ^ y),
                    Left => x.checked_shl(y as u32).unwrap_or(0),
                    _ => ((x as u32).checked_shr(y as u32).unwrap_or(0)) as i32,
                }))
            }
            And | Or | Not | BitNot => return self.stop(self.place(e), "an operator is not expected here", ""),
        }))
    }

    /// a && b, a || b: b is not looked at where a decides.
    fn logical(&mut self, and: bool, a: Num, eb: E) -> Answer<Num> {
        let a = self.plain(&a);
        match self.decided(a.id) {
            Some(v) if v != and => Ok(self.whole(f64::from(u8::from(v)))),
            Some(_) => {
                let b = self.plain_number(eb)?;
                Ok(match self.g.value(b.id) {
                    Some(v) => self.whole(f64::from(u8::from(v != 0.0))),
                    None => {
                        let c = self.condition(b.id);
                        self.truth(c)
                    }
                })
            }
            None => {
                let c = self.condition(a.id);
                self.path.push((c.0, and != c.1));
                let b = self.plain_number(eb);
                self.path.pop();
                let b = b?;
                let b = match self.g.value(b.id) {
                    Some(v) => self.whole(f64::from(u8::from(v != 0.0))),
                    None => {
                        let c = self.condition(b.id);
                        self.truth(c)
                    }
                };
                let id = if and {
                    let zero = self.g.constant(0.0);
                    self.select(c, b.id, zero)
                } else {
                    let one = self.g.constant(1.0);
                    self.select(c, one, b.id)
                };
                Ok(Num { whole: true, ..self.real(id) })
            }
        }
    }

    pub fn comparison(&mut self, op: Operator, a: Id, b: Id) -> Num {
        use Operator::*;
        if let (Some(x), Some(y)) = (self.g.value(a), self.g.value(b)) {
            let holds = match op {
                Equals => x == y,
                Differs => x != y,
                Less => x < y,
                More => x > y,
                AtMost => x <= y,
                _ => x >= y,
            };
            return self.whole(f64::from(u8::from(holds)));
        }
        if a == b {
            return self.whole(f64::from(u8::from(matches!(op, Equals | AtMost | AtLeast))));
        }
        match op {
            Less => {
                let c = self.g.not_less(a, b);
                self.truth((c, true))
            }
            AtLeast => {
                let c = self.g.not_less(a, b);
                self.truth((c, false))
            }
            More => {
                let c = self.g.not_less(b, a);
                self.truth((c, true))
            }
            AtMost => {
                let c = self.g.not_less(b, a);
                self.truth((c, false))
            }
            _ => {
                let (c, d) = (self.g.not_less(a, b), self.g.not_less(b, a));
                let zero = self.g.constant(0.0);
                let second = self.truth((d, false));
                let both = self.g.select(c, second.id, zero);
                if op == Equals {
                    Num { whole: true, ..self.real(both) }
                } else {
                    self.truth((both, true))
                }
            }
        }
    }

    fn whole_quotient(&mut self, a: &Num, b: &Num, at: E) -> Answer<Num> {
        let n = match (self.value_of(a), self.value_of(b)) {
            // behind a condition that voltages decide it may never be read
            (_, Some(0.0)) if !self.path.is_empty() => self.constant(f64::NAN),
            (_, Some(0.0)) => {
                return self.stop(
                    self.place(at),
                    "a division of whole numbers by 0",
                    "write 1.0 in place of 1 for real numbers",
                )
            }
            (Some(x), Some(y)) => self.constant((x / y).trunc()),
            _ => {
                let a = self.plain(a);
                let ratio = self.g.div(a.id, b.id);
                let id = self.truncated(ratio);
                self.real(id)
            }
        };
        Ok(Num { whole: true, ..n })
    }

    /// |x| with the slope 1 at x = 0: a transistor without a voltage between its ends conducts as it does beside it.
    pub fn magnitude(&mut self, x: Id) -> Id {
        if let Some(v) = self.g.value(x) {
            return self.g.constant(v.abs());
        }
        let zero = self.g.constant(0.0);
        let (c, less) = (self.g.not_less(x, zero), self.g.neg(x));
        self.g.select(c, x, less)
    }

    /// Towards zero.
    fn truncated(&mut self, x: Id) -> Id {
        if let Some(v) = self.g.value(x) {
            return self.g.constant(v.trunc());
        }
        let zero = self.g.constant(0.0);
        let c = self.g.not_less(x, zero);
        let (down, up) = (self.g.call(Fun::Floor, x), self.g.call(Fun::Ceil, x));
        self.g.select(c, down, up)
    }

    /// A real number as an integer variable keeps it: halves away from zero.
    pub fn rounded(&mut self, n: &Num) -> Num {
        let id = match self.g.value(n.id) {
            Some(v) => self.g.constant(v.round()),
            None if n.whole => n.id,
            None => {
                let (zero, half) = (self.g.constant(0.0), self.g.constant(0.5));
                let c = self.g.not_less(n.id, zero);
                let (above, below) = (self.g.add(n.id, half), self.g.sub(n.id, half));
                let (down, up) = (self.g.call(Fun::Floor, above), self.g.call(Fun::Ceil, below));
                self.g.select(c, down, up)
            }
        };
        Num { id, whole: true, q: None, noise: None }
    }

    fn power(&mut self, a: &Num, b: &Num) -> Num {
        let whole = a.whole && b.whole;
        let n = match (self.g.value(a.id), self.g.value(b.id)) {
            (Some(x), Some(y)) => {
                let v = x.powf(y);
                self.constant(if whole { v.trunc() } else { v })
            }
            _ => {
                let id = self.g.pow(a.id, b.id);
                self.real(id)
            }
        };
        Num { whole, ..n }
    }

    // ---- functions ----

    fn call(&mut self, word: Word, arguments: &[E], e: E) -> Answer<Val> {
        let name = self.word(word);
        if name.starts_with('$') {
            return self.system(word, arguments, e);
        }
        if let Some(known) = self.mathematics(name, arguments, e)? {
            return Ok(Val::Num(known));
        }
        let at = self.place(e);
        let n = match name {
            "ddt" => {
                let n = self.plain_number(arguments[0])?;
                let zero = self.g.constant(0.0);
                if self.g.value(n.id).is_some() {
                    self.constant(0.0)
                } else {
                    let made = Num { id: zero, whole: false, q: Some(n.id), noise: None };
                    // inside of a condition that voltages decide the charge goes on by itself
                    if self.path.is_empty() {
                        made
                    } else {
                        self.plain(&made)
                    }
                }
            }
            "idt" => self.integral(arguments, at)?,
            "limexp" => {
                let x = self.plain_number(arguments[0])?.id;
                let (edge, one) = (self.g.constant(STEEPEST), self.g.constant(1.0));
                let c = self.g.not_less(edge, x);
                let low = self.g.select(c, x, edge);
                let grown = self.g.call(Fun::Exp, low);
                let over = self.g.sub(x, edge);
                let line = self.g.add(one, over);
                let line = self.g.mul(grown, line);
                let id = self.g.select(c, grown, line);
                self.real(id)
            }
            "ddx" => self.partial(arguments, e)?,
            "white_noise" | "flicker_noise" => self.noise(name, arguments)?,
            "analysis" => {
                let mut any = self.whole(0.0);
                for &a in arguments {
                    let kind = self.text(a)?;
                    if let Some(symbol) = symbol_of(&kind) {
                        let id = self.g.given(symbol);
                        let one = self.g.constant(1.0);
                        let id = self.g.select(id, one, any.id);
                        any = Num { whole: true, ..self.real(id) };
                    }
                }
                any
            }
            "laplace_nd" | "laplace_np" | "laplace_zd" | "laplace_zp" => self.laplace(name, arguments, at)?,
            "absdelay" => self.late(arguments, at)?,
            "idtmod" => self.integral_within(arguments, at)?,
            "transition" => self.transition(arguments, at)?,
            "slew" => self.slew(arguments, at)?,
            "ac_stim" => self.stimulus(arguments)?,
            "last_crossing" => self.last_crossing(e)?,
            "zi_nd" | "zi_np" | "zi_zd" | "zi_zp" => self.sampled(name, arguments, at)?,
            "noise_table" | "noise_table_log" => self.noise_of_table(name, arguments, at)?,
            _ => self.access(name, arguments, e)?,
        };
        Ok(Val::Num(n))
    }

    /// The potential or flow of a branch.
    fn access(&mut self, name: &str, arguments: &[E], e: E) -> Answer<Num> {
        let at = self.place(e);
        if self.only_parameters || self.frame.function > 0 {
            return self.stop(at, "voltages and currents cannot be read here", "pass them as arguments");
        }
        if let Expression::Port(word) = self.library.expressions[arguments[0] as usize] {
            let Some(&node) = self.scope.nodes.get(&(word, None)) else {
                return self.stop(at, format!("there is no port {}", self.word(word)), "");
            };
            let label = format!("I(<{}>)", self.word(word));
            let (k, u) = self.unknown(label);
            self.port_flows.push((node, u, k));
            return Ok(self.real(u));
        }
        let (branch, turned) = self.branch_of(arguments, at)?;
        let id = if self.is_flow(name, branch, at)? {
            self.flow_of(branch)
        } else {
            let (from, to) = (self.branches[branch].from, self.branches[branch].to);
            self.port(from, to, None)
        };
        let id = if turned { self.g.neg(id) } else { id };
        Ok(self.real(id))
    }

    /// Does the access read the flow of the branch? An error where it does not fit the discipline.
    pub fn is_flow(&self, name: &str, branch: usize, at: Place) -> Answer<bool> {
        match name {
            "potential" => return Ok(false),
            "flow" => return Ok(true),
            _ => {}
        }
        let ends = [self.branches[branch].from, self.branches[branch].to];
        let module = &self.library.modules[self.scope.module];
        let mut discipline = None;
        for end in ends.into_iter().filter(|&k| k != GROUND) {
            let word = self.scope.nodes.iter().find(|n| *n.1 == end).map(|n| n.0 .0);
            discipline = discipline.or(word.and_then(|w| module.nodes.iter().find(|n| n.name == w)?.discipline));
        }
        let Some(discipline) = discipline.and_then(|d| self.library.disciplines.iter().find(|k| k.name == d)) else {
            return Ok(matches!(name, "I" | "F" | "Tau" | "Pwr"));
        };
        let access = |nature: Option<Word>| {
            nature.and_then(|n| self.library.natures.iter().find(|k| k.name == n)?.access).map(|a| self.word(a))
        };
        let (potential, flow) = (access(discipline.potential), access(discipline.flow));
        if potential == Some(name) {
            Ok(false)
        } else if flow == Some(name) {
            Ok(true)
        } else {
            let known: Vec<String> = [potential, flow].into_iter().flatten().map(|w| format!("{w}()")).collect();
            let what = format!("{name}() does not fit the discipline {}", self.word(discipline.name));
            self.stop(at, what, format!("it has {}", known.join(" and ")))
        }
    }

    pub fn mode(&mut self, mode: Mode) -> Id {
        let known = self.modes.iter().position(|&m| m == mode);
        let k = known.unwrap_or_else(|| {
            self.modes.push(mode);
            self.modes.len() - 1
        });
        self.g.flag(k as u32)
    }

    /// d expression / d potential of a node, or d flow of a branch.
    fn partial(&mut self, arguments: &[E], e: E) -> Answer<Num> {
        let y = self.plain_number(arguments[0])?;
        let Expression::Call(word, of) = &self.library.expressions[arguments[1] as usize] else {
            let hint = "ddx(expression, V(node))";
            return self.stop(self.place(e), "ddx takes an expression and a potential or flow", hint);
        };
        let name = self.word(*word);
        let (branch, turned) = self.branch_of(of, self.place(e))?;
        let ports: Vec<Id> = (0..self.ports.len()).map(|k| self.g.unknown(k as u32)).collect();
        let slopes = gradient(&mut self.g, y.id, &ports);
        let flow = self.is_flow(name, branch, self.place(e))?;
        let mut total = self.g.constant(0.0);
        let (from, to) = (self.branches[branch].from, self.branches[branch].to);
        let node = if turned { to } else { from };
        for (k, slope) in slopes.into_iter().enumerate() {
            let port = &self.ports[k];
            if flow {
                if Some(port.from) == self.branches[branch].flow {
                    total = self.g.add(total, slope);
                }
            } else if port.from == node {
                total = self.g.add(total, slope);
            } else if port.to == node {
                total = self.g.sub(total, slope);
            }
        }
        if flow && turned {
            total = self.g.neg(total);
        }
        Ok(self.real(total))
    }

    fn mathematics(&mut self, name: &str, arguments: &[E], e: E) -> Answer<Option<Num>> {
        let function = match name {
            "log" | "log10" => None,
            "ln" => Some(Fun::Log),
            "sgn" | "sign" | "round" | "nint" => return Ok(None),
            _ => Fun::from_name(name),
        };
        if let Some(f) = function {
            let a = self.plain_number(arguments[0])?;
            if let Some(v) = self.g.value(a.id) {
                let wrong = match f {
                    Fun::Sqrt => v < 0.0,
                    Fun::Log => v < 0.0,
                    Fun::Asin | Fun::Acos => v.abs() > 1.0,
                    Fun::Acosh => v < 1.0,
                    Fun::Atanh => v.abs() > 1.0,
                    _ => false,
                };
                if wrong && self.path.is_empty() {
                    return self.stop(
                        self.place(e),
                        format!("{name}({v}) has no value"),
                        "check the parameters that lead to it",
                    );
                }
            }
            let id = if f == Fun::Abs { self.magnitude(a.id) } else { self.g.call(f, a.id) };
            return Ok(Some(Num { whole: a.whole && f == Fun::Abs, ..self.real(id) }));
        }
        if !matches!(name, "log" | "log10" | "min" | "max" | "pow" | "atan2" | "hypot" | "int") {
            return Ok(None);
        }
        let a = self.plain_number(arguments[0])?;
        if matches!(name, "log" | "log10") {
            let id = match self.g.value(a.id) {
                Some(v) => self.g.constant(v.log10()),
                None => {
                    let l = self.g.call(Fun::Log, a.id);
                    let c = self.g.constant(std::f64::consts::LOG10_E);
                    self.g.mul(c, l)
                }
            };
            return Ok(Some(self.real(id)));
        }
        if name == "int" {
            let id = self.truncated(a.id);
            return Ok(Some(Num { whole: true, ..self.real(id) }));
        }
        let b = self.plain_number(arguments[1])?;
        Ok(Some(match name {
            "min" | "max" => {
                let whole = a.whole && b.whole;
                let id = match (self.g.value(a.id), self.g.value(b.id)) {
                    (Some(x), Some(y)) => self.g.constant(if name == "min" { x.min(y) } else { x.max(y) }),
                    _ => {
                        let c = self.g.not_less(a.id, b.id);
                        if name == "min" {
                            self.g.select(c, b.id, a.id)
                        } else {
                            self.g.select(c, a.id, b.id)
                        }
                    }
                };
                Num { whole, ..self.real(id) }
            }
            "pow" => Num { whole: false, ..self.power(&Num { whole: false, ..a }, &b) },
            "atan2" => {
                let id = self.g.atan2(a.id, b.id);
                self.real(id)
            }
            _ => {
                let (x, y) = (self.g.mul(a.id, a.id), self.g.mul(b.id, b.id));
                let s = self.g.add(x, y);
                let id = self.g.call(Fun::Sqrt, s);
                self.real(id)
            }
        }))
    }

    fn system(&mut self, word: Word, arguments: &[E], e: E) -> Answer<Val> {
        let name = self.word(word);
        let at = self.place(e);
        Ok(Val::Num(match name {
            "$temperature" => self.constant(self.given.temperature),
            "$vt" => match arguments.first() {
                Some(&t) => {
                    let t = self.plain_number(t)?;
                    let c = self.g.constant(VOLTS_PER_KELVIN);
                    self.times(&t, c)
                }
                None => self.constant(VOLTS_PER_KELVIN * self.given.temperature),
            },
            "$abstime" | "$realtime" => {
                let id = self.g.time();
                self.real(id)
            }
            "$mfactor" => self.constant(self.given.multiplier),
            "$hflip" | "$vflip" => self.constant(1.0),
            "$angle" | "$xposition" | "$yposition" => self.constant(0.0),
            "$simparam" => {
                let of = self.text(arguments[0])?;
                match of.as_str() {
                    "gmin" => {
                        let id = self.gmin();
                        self.real(id)
                    }
                    "sourceScaleFactor" => {
                        let id = self.source_scale();
                        self.real(id)
                    }
                    "tnom" => self.constant(self.given.tnom - 273.15),
                    "scale" => self.constant(1.0),
                    "shrink" => self.constant(0.0),
                    _ => match arguments.get(1) {
                        Some(&default) => self.number(default)?,
                        None => {
                            let what = format!("there is no simulation parameter {of}");
                            return self.stop(at, what, "give a default: $simparam(\"name\", value)");
                        }
                    },
                }
            }
            "$simparam$str" => {
                let of = self.text(arguments[0])?;
                return match of.as_str() {
                    "module" => Ok(Val::Text(self.word(self.library.modules[self.scope.module].name).into())),
                    "instance" | "path" => Ok(Val::Text(self.scope.prefix.trim_end_matches('.').into())),
                    _ => self.stop(at, format!("there is no simulation parameter {of}"), ""),
                };
            }
            "$param_given" => {
                let Expression::Parameter(k) = self.library.expressions[arguments[0] as usize] else {
                    return self.stop(at, "$param_given takes a parameter", "$param_given(name)");
                };
                let given = self.scope.given.contains_key(&k);
                self.whole(f64::from(u8::from(given)))
            }
            "$port_connected" => {
                let Expression::Name(word, _) = self.library.expressions[arguments[0] as usize] else {
                    return self.stop(at, "$port_connected takes a port", "$port_connected(name)");
                };
                let module = &self.library.modules[self.scope.module];
                let Some(k) = module.nodes[..module.ports].iter().position(|n| n.name == word) else {
                    return self.stop(at, format!("{} is no port", self.word(word)), "");
                };
                let connected = self.scope.connected.get(k).copied().unwrap_or(false);
                self.whole(f64::from(u8::from(connected)))
            }
            "$limit" => self.limited(arguments, at)?,
            "$rtoi" => {
                let a = self.plain_number(arguments[0])?;
                let id = self.truncated(a.id);
                Num { whole: true, ..self.real(id) }
            }
            "$itor" => Num { whole: false, ..self.number(arguments[0])? },
            "$clog2" => {
                let v = self.known(arguments[0], "this")?;
                self.whole(if v > 1.0 { v.log2().ceil() } else { 0.0 })
            }
            "$table_model" => self.table_model(arguments, at)?,
            _ if super::random::draws(name) => self.random(name, arguments, at)?,
            _ => match self.mathematics(&name[1..], arguments, e)? {
                Some(n) => n,
                None => return self.stop(at, format!("{name} gives no value"), "it is a statement"),
            },
        }))
    }

    /// A potential as Newton's limited steps leave it.
    fn limited(&mut self, arguments: &[E], at: Place) -> Answer<Num> {
        let Expression::Call(word, of) = &self.library.expressions[arguments[0] as usize] else {
            return self.stop(at, "$limit takes a potential first", "$limit(V(a, b), \"pnjlim\", vt, vcrit)");
        };
        let (branch, turned) = self.branch_of(of, at)?;
        if self.is_flow(self.word(*word), branch, at)? {
            return self.stop(at, "$limit of a flow is not supported", "limit the potential that it hangs on");
        }
        let function = match arguments.get(1).map(|&e| &self.library.expressions[e as usize]) {
            Some(Expression::Text(t)) => t.to_string(),
            // a function of the module's own: only the way to the solution would differ
            _ => return self.number(arguments[0]),
        };
        let mut numbers = Vec::new();
        for &e in arguments.iter().skip(2) {
            numbers.push(self.known(e, "an argument of $limit")?);
        }
        const LIMITS: &[(&str, usize)] = &[("pnjlim", 2), ("fetlim", 1), ("limvds", 0), ("limitlog", 1)];
        match LIMITS.iter().find(|l| l.0 == function) {
            Some(&(_, least)) if numbers.len() >= least => {}
            Some(&(_, least)) => return self.stop(at, format!("{function} takes {least} numbers"), ""),
            None => {
                let known: Vec<&str> = LIMITS.iter().map(|l| l.0).collect();
                return self.stop(
                    at,
                    format!("there is no limiting function {function}"),
                    format!("there are {}", known.join(", ")),
                );
            }
        }
        let (mut from, mut to) = (self.branches[branch].from, self.branches[branch].to);
        if turned {
            (from, to) = (to, from);
        }
        let id = self.port(from, to, Some(Limit { function, arguments: numbers }));
        Ok(self.real(id))
    }

    /// An analogue function of the module: its statements are run in a frame of its own.
    fn function(&mut self, k: u32, arguments: &[E], e: E) -> Answer<Val> {
        let function = &self.library.modules[self.scope.module].functions[k as usize];
        let name = self.word(function.name);
        if arguments.len() != function.arguments.len() {
            let what = format!("{name} takes {} arguments, here are {}", function.arguments.len(), arguments.len());
            return self.stop(self.place(e), what, "");
        }
        if self.calls > 50 {
            return self.stop(self.place(e), format!("{name} calls itself"), "functions cannot be recursive");
        }
        let mut frame = self.new_frame(&function.variables, k as usize + 1)?;
        for (&(variable, comes, _), &e) in function.arguments.iter().zip(arguments) {
            if comes {
                let value = self.eval(e)?;
                // charges and noise do not pass through variables of functions: they would be read more than once
                let about = &function.variables[variable as usize];
                frame.values[variable as usize] = self.converted(value, about.kind, self.place(e))?;
            }
        }
        let result = function.result as usize;
        if let Val::Num(n) = &frame.values[result] {
            // a function that is not assigned gives 0
            if self.unset.contains_key(&n.id) {
                frame.values[result] = Val::Num(Num { whole: function.kind == Type::Integer, ..self.constant(0.0) });
            }
        }
        let outer = std::mem::replace(&mut self.frame, frame);
        self.calls += 1;
        let mut done = Ok(());
        for variable in 0..function.variables.len() {
            if let (Some(initial), Ok(())) = (function.variables[variable].initial, &done) {
                done = self.begin(variable as u32, Some(initial));
            }
        }
        for &s in &function.body {
            if done.is_ok() {
                done = self.execute(s);
            }
        }
        self.calls -= 1;
        let frame = std::mem::replace(&mut self.frame, outer);
        done?;
        for (&(variable, _, goes), &e) in function.arguments.iter().zip(arguments) {
            if goes {
                let value = frame.values[variable as usize].clone();
                match self.library.expressions[e as usize] {
                    Expression::Variable(k) => self.assign(k, None, value, self.place(e))?,
                    Expression::Element(k, index) => self.assign(k, Some(index), value, self.place(e))?,
                    _ => {
                        return self.stop(self.place(e), format!("{name} gives a value back here"), "write a variable")
                    }
                }
            }
        }
        Ok(frame.values[result].clone())
    }
}
