//! Operators: of numbers with what goes along with them, charges and noise; of bits; of strings.
use super::*;

impl Elaborator<'_> {
    pub(super) fn unary(&mut self, op: Operator, a: Num, e: E) -> Answer<Num> {
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

    pub(super) fn negated(&mut self, a: &Num) -> Num {
        let minus = self.g.constant(-1.0);
        self.times(a, minus)
    }

    /// A number times what is no sum of charges and noise.
    pub(super) fn times(&mut self, a: &Num, factor: Id) -> Num {
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
    pub(super) fn chosen(&mut self, op: Operator, a: &Num, b: &Num) -> Option<Num> {
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

    pub(super) fn binary(&mut self, op: Operator, ea: E, eb: E, e: E) -> Answer<Val> {
        use Operator::*;
        let a = match self.eval(ea)? {
            Val::Text(a) => return self.compared(op, &a, eb, e),
            Val::Num(a) => a,
            _ => return self.stop(self.place(ea), "a number is expected here", ""),
        };
        if matches!(op, And | Or) {
            return self.logical(op == And, a, eb).map(Val::Num);
        }
        let b = self.number(eb)?;
        self.is_small(self.place(e))?;
        if let Some(chosen) = self.chosen(op, &a, &b) {
            return Ok(Val::Num(chosen));
        }
        Ok(Val::Num(match op {
            Plus => self.sum(&a, &b),
            Minus => {
                let b = self.negated(&b);
                self.sum(&a, &b)
            }
            Times => self.product(a, b, e)?,
            Over => self.quotient(a, &b, eb)?,
            Percent => self.remainder(&a, &b, eb)?,
            Power => {
                let (a, b) = (self.plain(&a), self.plain(&b));
                self.power(&a, &b)
            }
            Equals | Differs | Less | More | AtMost | AtLeast => {
                let (a, b) = (self.plain(&a), self.plain(&b));
                self.comparison(op, a.id, b.id)
            }
            BitAnd | BitOr | BitXor | BitXnor | Left | Right => self.bits(op, &a, &b, e)?,
            And | Or | Not | BitNot => return self.stop(self.place(e), "an operator is not expected here", ""),
        }))
    }

    /// Strings can be compared, no more.
    pub(super) fn compared(&mut self, op: Operator, x: &str, eb: E, e: E) -> Answer<Val> {
        let Val::Text(y) = self.eval(eb)? else {
            return self.stop(self.place(eb), "a string is expected here", "strings stand in quotes");
        };
        let Some(holds) = holds(op, x, &*y) else {
            return self.stop(self.place(e), "strings can only be compared", "");
        };
        Ok(Val::Num(self.whole(f64::from(u8::from(holds)))))
    }

    /// A charge only goes along with constants.
    pub(super) fn product(&mut self, a: Num, b: Num, e: E) -> Answer<Num> {
        let known = (self.value_of(&a), self.value_of(&b));
        let a = if a.q.is_none() || known.1.is_some() { a } else { self.without_charge(a) };
        let b = if b.q.is_none() || known.0.is_some() { b } else { self.without_charge(b) };
        if a.noise.is_some() && b.noise.is_some() {
            return self.stop(self.place(e), "a product of two sources of noise", "noise is a small signal");
        }
        let special = |n: &Num| n.q.is_some() || n.noise.is_some();
        let whole = a.whole && b.whole;
        let n = if special(&b) { self.times(&b, a.id) } else { self.times(&a, b.id) };
        Ok(Num { whole, ..n })
    }

    pub(super) fn quotient(&mut self, a: Num, b: &Num, eb: E) -> Answer<Num> {
        let known = (self.value_of(&a), self.value_of(b));
        let b = self.plain(b);
        if a.whole && b.whole {
            return self.whole_quotient(&a, &b, eb);
        }
        if let (Some(a), Some(0.0)) = known {
            // infinity is a value; 0/0 is told at the end
            return Ok(self.constant(a / 0.0));
        }
        if a.q.is_some() || a.noise.is_some() {
            let a = if known.1.is_some() { a } else { self.without_charge(a) };
            let one = self.g.constant(1.0);
            let inverse = self.g.div(one, b.id);
            return Ok(Num { whole: false, ..self.times(&a, inverse) });
        }
        let id = self.g.div(a.id, b.id);
        Ok(self.real(id))
    }

    pub(super) fn remainder(&mut self, a: &Num, b: &Num, eb: E) -> Answer<Num> {
        let known = (self.value_of(a), self.value_of(b));
        let (a, b) = (self.plain(a), self.plain(b));
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
        Ok(Num { whole, ..n })
    }

    pub(super) fn bits(&mut self, op: Operator, a: &Num, b: &Num, e: E) -> Answer<Num> {
        use Operator::*;
        let bits = |n: &Num| self.decided_value(n, e, "what bits are read of").map(|v| v as i32);
        let (x, y) = (bits(a)?, bits(b)?);
        Ok(self.whole(f64::from(match op {
            BitAnd => x & y,
            BitOr => x | y,
            BitXor => x ^ y,
            BitXnor => !(x ^ y),
            Left => x.checked_shl(y as u32).unwrap_or(0),
            _ => ((x as u32).checked_shr(y as u32).unwrap_or(0)) as i32,
        })))
    }

    /// 1 where a number is not 0.
    fn holds(&mut self, b: Id) -> Num {
        match self.g.value(b) {
            Some(v) => self.whole(f64::from(u8::from(v != 0.0))),
            None => {
                let c = self.condition(b);
                self.truth(c)
            }
        }
    }

    /// a && b, a || b: b is not looked at where a decides.
    pub(super) fn logical(&mut self, and: bool, a: Num, eb: E) -> Answer<Num> {
        let a = self.plain(&a);
        match self.decided(a.id) {
            Some(v) if v != and => Ok(self.whole(f64::from(u8::from(v)))),
            Some(_) => {
                let b = self.plain_number(eb)?;
                Ok(self.holds(b.id))
            }
            None => {
                let c = self.condition(a.id);
                self.path.push((c.0, and != c.1));
                let b = self.plain_number(eb);
                self.path.pop();
                let b = self.holds(b?.id);
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
            let holds = holds(op, &x, &y) == Some(true);
            return self.whole(f64::from(u8::from(holds)));
        }
        if a == b {
            return self.whole(f64::from(u8::from(matches!(op, Equals | AtMost | AtLeast))));
        }
        match op {
            Less | AtLeast => {
                let c = self.g.not_less(a, b);
                self.truth((c, op == Less))
            }
            More | AtMost => {
                let c = self.g.not_less(b, a);
                self.truth((c, op == More))
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

    pub(super) fn whole_quotient(&mut self, a: &Num, b: &Num, at: E) -> Answer<Num> {
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
    pub(super) fn truncated(&mut self, x: Id) -> Id {
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

    pub(super) fn power(&mut self, a: &Num, b: &Num) -> Num {
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
}

/// What a comparison comes to; None of other operators.
fn holds<T: PartialOrd + ?Sized>(op: Operator, x: &T, y: &T) -> Option<bool> {
    Some(match op {
        Operator::Equals => x == y,
        Operator::Differs => x != y,
        Operator::Less => x < y,
        Operator::More => x > y,
        Operator::AtMost => x <= y,
        Operator::AtLeast => x >= y,
        _ => return None,
    })
}
