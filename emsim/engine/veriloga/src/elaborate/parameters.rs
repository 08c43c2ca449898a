//! Values of parameters: as they are given, or by default; within what they allow.
use super::*;

impl Elaborator<'_> {
    pub fn parameter(&mut self, k: u32) -> Answer<Val> {
        if let Some(Some(known)) = self.scope.parameters.get(k as usize) {
            return Ok(known.clone());
        }
        let parameter = &self.library.modules[self.scope.module].parameters[k as usize];
        let name = self.word(parameter.name);
        if self.open_parameters.contains(&k) {
            return self.stop(
                parameter.at,
                format!("the default of {name} hangs on {name} itself"),
                "give it a number",
            );
        }
        self.open_parameters.push(k);
        let given = self.scope.given.get(&k).cloned();
        let is_given = given.is_some();
        let value = match given {
            Some(value) => value,
            None => {
                // a default is read outside of what is run
                let frame = std::mem::take(&mut self.frame);
                let value = self.eval(parameter.default);
                self.frame = frame;
                value?
            }
        };
        self.open_parameters.pop();
        let kind = match (parameter.kind, &value) {
            (Some(kind), _) => kind,
            (None, Val::Text(_)) => Type::Text,
            (None, Val::Num(n)) if n.whole => Type::Integer,
            _ => Type::Real,
        };
        let value = match parameter.size {
            Some((a, b)) => {
                let (low, high) = (self.index_of(a)?, self.index_of(b)?);
                let Val::Row(_, items) = value else {
                    return self.stop(parameter.at, format!("{name} is a row of numbers"), "give it '{1, 2, ...}");
                };
                if items.len() as i64 != (high - low).abs() + 1 {
                    let what = format!("{name} has {} numbers, here are {}", (high - low).abs() + 1, items.len());
                    return self.stop(parameter.at, what, "");
                }
                let mut row = Vec::new();
                for item in items.iter() {
                    row.push(self.converted(item.clone(), kind, parameter.at)?);
                }
                Val::Row(low.min(high), Rc::new(row))
            }
            None => self.converted(value, kind, parameter.at)?,
        };
        if let Val::Num(n) = &value {
            // what the simulator gives, gmin, is no number before the run, and none that voltages change
            let free = |&id: &Id| matches!(self.g.node(id), Node::Unknown(_) | Node::Time);
            if n.q.is_some() || n.noise.is_some() || self.g.reachable(&[n.id]).iter().any(free) {
                let what = format!("the value of {name} hangs on voltages");
                return self.stop(parameter.at, what, "parameters are numbers");
            }
        }
        if is_given {
            self.check(k, &value)?;
        }
        if self.scope.parameters.len() <= k as usize {
            self.scope.parameters.resize(k as usize + 1, None);
        }
        self.scope.parameters[k as usize] = Some(value.clone());
        Ok(value)
    }

    /// A value as a variable of this type keeps it.
    pub fn converted(&mut self, value: Val, kind: Type, at: Place) -> Answer<Val> {
        Ok(match (value, kind) {
            (Val::Num(n), Type::Integer) if !n.whole => {
                let n = self.plain(&n);
                Val::Num(self.rounded(&n))
            }
            (Val::Num(n), Type::Integer) => Val::Num(n),
            (Val::Num(n), Type::Real) => Val::Num(Num { whole: false, ..n }),
            (Val::Text(t), Type::Text) => Val::Text(t),
            (Val::Row(..), _) => return self.stop(at, "a row of values where one is expected", ""),
            (Val::Text(_), _) => return self.stop(at, "a string where a number is expected", ""),
            (Val::Num(_), Type::Text) => {
                return self.stop(at, "a number where a string is expected", "strings stand in quotes")
            }
        })
    }

    /// Is a value that was given one of those that are allowed?
    pub(super) fn check(&mut self, k: u32, value: &Val) -> Answer<()> {
        let parameter = &self.library.modules[self.scope.module].parameters[k as usize];
        let values = match value {
            Val::Row(_, items) => items.to_vec(),
            other => vec![other.clone()],
        };
        for value in &values {
            // several `from` add up
            let mut inside = parameter.limits.iter().all(|l| l.0);
            let mut out = false;
            for (excluded, allowed) in &parameter.limits {
                let holds = match (allowed, value) {
                    (Allowed::Interval(low, high, closed_low, closed_high), Val::Num(n)) => {
                        let (low, high) = (self.number(*low)?, self.number(*high)?);
                        let v = self.g.value(n.id).unwrap_or(f64::NAN);
                        let (low, high) =
                            (self.g.value(low.id).unwrap_or(f64::NAN), self.g.value(high.id).unwrap_or(f64::NAN));
                        (v > low || (*closed_low && v == low)) && (v < high || (*closed_high && v == high))
                    }
                    (Allowed::Interval(..), _) => false,
                    (Allowed::Values(list), value) => {
                        let mut any = false;
                        for &e in list {
                            any |= match (self.eval(e)?, value) {
                                (Val::Text(a), Val::Text(b)) => a == *b,
                                (Val::Num(a), Val::Num(b)) => self.g.value(a.id) == self.g.value(b.id),
                                _ => false,
                            };
                        }
                        any
                    }
                };
                if *excluded {
                    out |= holds;
                } else {
                    inside |= holds;
                }
            }
            if !inside || out {
                let shown = match value {
                    Val::Text(t) => format!("{t:?}"),
                    Val::Num(n) => format!("{}", self.g.value(n.id).unwrap_or(f64::NAN)),
                    Val::Row(..) => String::new(),
                };
                let limits: Vec<String> = parameter.limits.iter().map(|(x, a)| self.shown(*x, a)).collect();
                let what = format!("{} = {shown} is not allowed", self.word(parameter.name));
                return self.stop(parameter.at, what, format!("it must be {}", limits.join(", ")));
            }
        }
        Ok(())
    }

    pub(super) fn shown(&mut self, excluded: bool, allowed: &Allowed) -> String {
        let mut one = |e: E| match self.eval(e) {
            Ok(Val::Text(t)) => format!("{t:?}"),
            Ok(Val::Num(n)) => self.g.value(n.id).map_or("?".to_string(), |v| format!("{v}")),
            _ => "?".to_string(),
        };
        let word = if excluded { "not " } else { "" };
        match allowed {
            Allowed::Interval(low, high, a, b) => {
                let (low, high) = (one(*low), one(*high));
                format!("{word}in {}{low}:{high}{}", if *a { "[" } else { "(" }, if *b { "]" } else { ")" })
            }
            Allowed::Values(list) => {
                let list: Vec<String> = list.iter().map(|&e| one(e)).collect();
                format!("{word}one of {}", list.join(" "))
            }
        }
    }

    /// The parameter of the module that a name means; the exact spelling comes first.
    pub fn parameter_named(&self, module: usize, name: &str) -> Option<u32> {
        let parameters = &self.library.modules[module].parameters;
        let is = |same: &dyn Fn(&str) -> bool| {
            parameters
                .iter()
                .position(|p| !p.local && std::iter::once(&p.name).chain(&p.aliases).any(|&w| same(self.word(w))))
        };
        is(&|w| w == name).or_else(|| is(&|w| w.eq_ignore_ascii_case(name))).map(|k| k as u32)
    }

    pub(super) fn take(&mut self, value: &Value) -> Val {
        match value {
            Value::Number(v) => Val::Num(self.constant(*v)),
            Value::Text(t) => Val::Text(t.as_str().into()),
            Value::Numbers(list) => {
                let row = list.iter().map(|&v| Val::Num(self.constant(v))).collect();
                Val::Row(0, Rc::new(row))
            }
        }
    }

    /// What the deck gave, for the module of the scope.
    pub(super) fn take_given(&mut self) -> Answer<()> {
        let module = self.scope.module;
        let given = self.given;
        for of in [&given.model, &given.instance] {
            // in one order, for what is made of them is numbered as it is made
            let mut of: Vec<(&String, &Value)> = of.iter().collect();
            of.sort_unstable_by_key(|g| g.0);
            for (name, value) in of {
                let Some(k) = self.parameter_named(module, name) else {
                    let known: Vec<&str> = self.library.modules[module]
                        .parameters
                        .iter()
                        .filter(|p| !p.local)
                        .map(|p| self.word(p.name))
                        .collect();
                    let hint = match crate::nearest(name, known.into_iter()) {
                        Some(near) => format!("did you mean {near}?"),
                        None => String::new(),
                    };
                    let about = &self.library.modules[module];
                    let what = format!("{} has no parameter {name}", self.word(about.name));
                    return self.stop(about.at, what, hint);
                };
                let value = self.take(value);
                self.scope.given.insert(k, value);
            }
        }
        Ok(())
    }
}
