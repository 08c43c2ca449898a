//! The hierarchy: instances of modules, rows of them, and what generate blocks make.
use super::ast::{Expression, Generated, Instance, Statement};
use super::elaborate::{Answer, Elaborator, Scope, Val};
use emsim_expr::repeat::MOST_STEPS;

impl Elaborator<'_> {
    /// Generate blocks. `prefix`: the names of the blocks around, with points behind.
    pub fn generate(&mut self, items: &[Generated], prefix: &str) -> Answer<()> {
        for item in items {
            match item {
                Generated::Instance(instance) => self.instance(instance, prefix)?,
                Generated::Analog(s) => self.execute(*s)?,
                Generated::Block(name, body) => {
                    let name = name.map_or_else(String::new, |w| format!("{}.", self.word(w)));
                    self.generate(body, &format!("{prefix}{name}"))?;
                }
                Generated::If(condition, yes, no) => {
                    let holds = self.known(*condition, "what is generated")? != 0.0;
                    self.generate(if holds { yes } else { no }, prefix)?;
                }
                Generated::For(first, condition, next, body) => {
                    self.execute(*first)?;
                    let Statement::Assign(counter, ..) = self.library.statements[*first as usize] else {
                        continue;
                    };
                    while self.known(*condition, "what is generated")? != 0.0 {
                        self.steps += 1;
                        if self.steps > MOST_STEPS || self.unknowns.len() > 10_000 {
                            let hint = "the condition of this loop stays true";
                            return self.stop(self.place(*condition), "the module takes too many steps", hint);
                        }
                        let index = match &self.frame.values[counter as usize] {
                            Val::Num(n) => self.value_of(n).unwrap_or(f64::NAN),
                            _ => f64::NAN,
                        };
                        match &body[..] {
                            [Generated::Block(name, inner)] => {
                                let name = name.map_or("genblk", |w| self.word(w));
                                self.generate(inner, &format!("{prefix}{name}[{index}]."))?;
                            }
                            _ => self.generate(body, &format!("{prefix}genblk[{index}]."))?,
                        }
                        self.execute(*next)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// An instance, or each of a row of them: what it is connected to is shared, or has a node for each.
    pub fn instance(&mut self, instance: &Instance, prefix: &str) -> Answer<()> {
        let name = self.word(instance.name);
        let Some((first, last)) = instance.range else {
            return self.one_instance(instance, &format!("{prefix}{name}"), None);
        };
        let (first, last) = (self.index_of(first)?, self.index_of(last)?);
        let count = first.abs_diff(last) as usize + 1;
        if count > 1000 {
            return self.stop(instance.at, format!("a row of {count} instances"), "1000 are the most");
        }
        for k in 0..count {
            let index = if last >= first { first + k as i64 } else { first - k as i64 };
            self.one_instance(instance, &format!("{prefix}{name}[{index}]"), Some((k, count)))?;
        }
        Ok(())
    }

    /// `seat`: which of a row of so many.
    fn one_instance(&mut self, instance: &Instance, label: &str, seat: Option<(usize, usize)>) -> Answer<()> {
        let name = self.word(instance.module);
        let Some(child) = self.library.modules.iter().position(|m| m.name == instance.module) else {
            let known = self.library.modules.iter().map(|m| self.library.sources.word(m.name));
            let hint = match super::nearest(name, known) {
                Some(near) => format!("did you mean {near}?"),
                None => "it must stand in the same text or in an included one".to_string(),
            };
            return self.stop(instance.at, format!("there is no module {name}"), hint);
        };
        if self.scope.prefix.matches('.').count() > 20 || self.unknowns.len() > 10_000 {
            return self.stop(instance.at, "modules are nested too deeply", "does one hold itself?");
        }
        // values and nodes, as this module has them
        let mut values: Vec<(u32, Val)> = Vec::new();
        let of = &self.library.modules[child];
        let open: Vec<u32> = (0..of.parameters.len() as u32).filter(|&k| !of.parameters[k as usize].local).collect();
        for (k, &(word, e)) in instance.parameters.iter().enumerate() {
            let number = match word {
                Some(w) => self.parameter_named(child, self.word(w)),
                None => open.get(k).copied(),
            };
            let Some(number) = number else {
                let what = match word {
                    Some(w) => format!("{name} has no parameter {}", self.word(w)),
                    None => format!("{name} has {} parameters", open.len()),
                };
                return self.stop(self.place(e), what, "");
            };
            values.push((number, self.eval(e)?));
        }
        let mut bound: Vec<Vec<usize>> = vec![Vec::new(); of.ports];
        for (k, &(word, e)) in instance.nodes.iter().enumerate() {
            let place = match word {
                Some(w) => of.nodes[..of.ports].iter().position(|n| n.name == w),
                None => Some(k).filter(|&k| k < of.ports),
            };
            let Some(place) = place else {
                return self.stop(self.place(e), format!("{name} has no such port"), format!("it has {}", of.ports));
            };
            if !matches!(self.library.expressions[e as usize], Expression::Empty) {
                let nodes = self.nodes_at(e)?;
                bound[place] = match seat {
                    // LRM 6.2.2: a row of nodes as long as that of the instances gives one to each
                    Some((k, count)) if of.nodes[place].range.is_none() && nodes.len() == count => vec![nodes[k]],
                    _ => nodes,
                };
            }
        }
        let mut scope = Scope::of(child, format!("{}{label}.", self.scope.prefix));
        scope.given.extend(values);
        let outer = std::mem::replace(&mut self.scope, scope);
        let frame = std::mem::take(&mut self.frame);
        self.resolve_set()?;
        self.run_module(&bound)?;
        self.scope = outer;
        self.frame = frame;
        Ok(())
    }
}
