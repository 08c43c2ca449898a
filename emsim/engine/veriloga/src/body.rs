//! Statements and expressions: names become what they mean, calls are checked.
use super::ast::*;
use super::source::{Place, Word};
use super::tree::{Meaning, Reader};
use super::{functions, nearest, unquote};
use std::collections::HashMap;

impl Reader<'_> {
    // ---- statements ----

    pub(super) fn analog(&mut self, node: u32) {
        let children = self.children(node);
        let Some(&what) = children.last() else { return };
        let statement = self.statement(what);
        if self.terminal(children[0]) == "INITIAL" {
            self.module.initial.push(statement);
        } else {
            self.module.analog.push(statement);
        }
    }

    pub(super) fn put(&mut self, node: u32, statement: Statement) -> S {
        self.library.statements.push(statement);
        self.library.statement_places.push(self.place(node));
        self.library.statements.len() as S - 1
    }

    pub(super) fn statement(&mut self, node: u32) -> S {
        let children = self.children(node);
        let Some(&what) = children.last() else { return self.put(node, Statement::Nothing) };
        if self.rule(node) != "statement" {
            return self.simple(node);
        }
        let c = self.children(what);
        let made = match self.rule(what) {
            "block" => Statement::Block(self.block(c)),
            "if" => {
                let condition = self.expression(c[2], false);
                let yes = self.statement(c[4]);
                let no = c.get(5).map(|&s| self.statement(s));
                Statement::If(condition, yes, no)
            }
            "case" => {
                let value = self.expression(c[2], false);
                let (mut arms, mut otherwise) = (Vec::new(), None);
                for &arm in &c[4..] {
                    let parts = self.children(arm);
                    let Some((&last, first)) = parts.split_last() else { continue };
                    let body = self.statement(last);
                    if self.rule(arm) == "otherwise" {
                        otherwise = Some(body);
                    } else {
                        arms.push((first.iter().map(|&e| self.expression(e, false)).collect(), body));
                    }
                }
                Statement::Case(value, arms, otherwise)
            }
            "for" => {
                let first = self.simple(c[2]);
                let condition = self.expression(c[3], false);
                let next = self.simple(c[4]);
                let body = self.statement(c[6]);
                Statement::For(first, condition, next, body)
            }
            "while" => {
                let unroll = self.attributes(node).unroll;
                let condition = self.expression(c[2], false);
                let body = self.statement(c[4]);
                Statement::While(condition, body, unroll)
            }
            "repeat" => {
                let count = self.expression(c[2], false);
                let body = self.statement(c[4]);
                Statement::Repeat(count, body)
            }
            "event" => {
                let triggers: Vec<E> = c[2..c.len() - 2].iter().map(|&t| self.expression(t, true)).collect();
                let body = self.statement(c[c.len() - 1]);
                Statement::Event(triggers, body)
            }
            "attributes" | "" => Statement::Nothing,
            _ => return self.simple(what),
        };
        self.put(what, made)
    }

    fn block(&mut self, children: &[u32]) -> Vec<S> {
        self.scopes.push(HashMap::new());
        let mut body = Vec::new();
        for &child in children {
            match self.rule(child) {
                "local_declaration" => {
                    let about = self.attributes(child);
                    let Some(&declared) = self.children(child).last() else { continue };
                    if self.rule(declared) == "variables" {
                        let first = self.frame.len();
                        self.declare_variables(declared, &about, true);
                        self.fill_variables(declared);
                        for k in first..self.frame.len() {
                            let initial = self.frame[k].initial;
                            body.push(self.put(declared, Statement::Begin(k as u32, initial)));
                        }
                    } else {
                        self.declare_parameters(declared, &about);
                        self.fill_parameters(declared);
                    }
                }
                "statement" => body.push(self.statement(child)),
                _ => {}
            }
        }
        self.scopes.pop();
        body
    }

    pub(super) fn simple(&mut self, node: u32) -> S {
        let c = self.children(node);
        let made = match self.rule(node) {
            "assign" => {
                let (target, value) = (c[0], self.expression(c[2], false));
                let word = self.word(target);
                let index = if self.rule(target) == "index" {
                    Some(self.expression(self.children(target)[2], false))
                } else {
                    None
                };
                match self.meaning(word) {
                    Some(Meaning::Variable(k)) => Statement::Assign(k, index, value),
                    Some(Meaning::Parameter(_)) => {
                        let what = format!("{} is a parameter: it cannot be assigned to", self.spelled(word));
                        self.error(self.place(target), what, "declare a variable for what is computed");
                        Statement::Nothing
                    }
                    None => {
                        let hint = self.near_value(word);
                        let what = format!("there is no variable {}", self.spelled(word));
                        self.error(self.place(target), what, hint);
                        Statement::Nothing
                    }
                }
            }
            "contribution" => {
                let to = self.branch_access(c[0]);
                Statement::Contribute(to, self.expression(c[2], false))
            }
            "indirect" => {
                let to = self.branch_access(c[0]);
                Statement::Indirect(to, self.expression(c[1], false))
            }
            "call" | "system_name" => Statement::Call(self.expression(node, false)),
            _ => Statement::Nothing,
        };
        self.put(node, made)
    }

    /// What is contributed to.
    pub(super) fn branch_access(&mut self, node: u32) -> E {
        let e = self.expression(node, false);
        if let Expression::Call(word, _) = self.library.expressions[e as usize] {
            if self.is_access(word) {
                return e;
            }
        }
        self.error(
            self.place(node),
            "only potentials and flows of branches can be contributed to",
            "write I(a, b) <+ ... or V(a, b) <+ ...",
        );
        e
    }

    pub(super) fn is_access(&self, word: Word) -> bool {
        matches!(self.library.sources.word(word), "potential" | "flow")
            || self.library.natures.iter().any(|n| n.access == Some(word))
    }

    // ---- expressions ----

    pub(super) fn push(&mut self, node: u32, e: Expression) -> E {
        self.library.expressions.push(e);
        self.library.expression_places.push(self.place(node));
        self.library.expressions.len() as E - 1
    }

    pub(super) fn meaning(&self, word: Word) -> Option<Meaning> {
        self.scopes.iter().rev().find_map(|s| s.get(&word).copied())
    }

    pub(super) fn near_value(&self, word: Word) -> String {
        let known = self.scopes.iter().flat_map(|s| s.keys()).map(|&w| self.library.sources.word(w));
        match nearest(self.library.sources.word(word), known) {
            Some(near) => format!("did you mean {near}?"),
            None => "declare it: real name; or parameter real name = ...;".to_string(),
        }
    }

    /// What is no variable and no parameter: a node or branch, where those may stand.
    fn declared_node(&mut self, node: u32, word: Word, index: Option<E>, names: bool) -> Expression {
        if names {
            return Expression::Name(word, index);
        }
        let (what, hint) = (format!("{} is not declared", self.spelled(word)), self.near_value(word));
        self.error(self.place(node), what, hint);
        Expression::Empty
    }

    /// `names`: nodes, branches and others may stand here by their name.
    pub(super) fn expression(&mut self, node: u32, names: bool) -> E {
        let c = self.children(node);
        let made = match (self.terminal(node), self.rule(node)) {
            ("NUMBER", _) => self.number(node),
            ("STRING", _) => Expression::Text(unquote(self.text(node)).into()),
            (_, "name") => {
                if c.len() > 1 {
                    self.error(
                        self.place(node),
                        "names of other instances are not supported",
                        "pass the value through a parameter or port",
                    );
                }
                let word = self.word(node);
                match self.meaning(word) {
                    Some(Meaning::Variable(k)) => Expression::Variable(k),
                    Some(Meaning::Parameter(k)) => Expression::Parameter(k),
                    None if self.library.sources.word(word) == "inf" => Expression::Number(f64::INFINITY, false),
                    None => self.declared_node(node, word, None, names),
                }
            }
            (_, "index") => {
                let word = self.word(node);
                let index = self.expression(c[2], false);
                match self.meaning(word) {
                    Some(Meaning::Variable(k)) => Expression::Element(k, index),
                    Some(Meaning::Parameter(k)) => Expression::ParameterElement(k, index),
                    None => self.declared_node(node, word, Some(index), names),
                }
            }
            (_, "part") => {
                Expression::Part(self.word(node), self.expression(c[2], false), self.expression(c[3], false))
            }
            (_, "system_name") => {
                let word = self.word(node);
                self.system(word, None, self.place(node));
                Expression::System(word)
            }
            (_, "call") => return self.call(node, names),
            (_, "port_reference") => return self.reference(node),
            (_, "unary") => Expression::Unary(self.operator(c[0]), self.expression(c[1], false)),
            (_, "minus") => Expression::Unary(Operator::Minus, self.expression(c[0], false)),
            (_, "binary") => {
                let (a, b) = (self.expression(c[0], false), self.expression(c[2], false));
                Expression::Binary(self.operator(c[1]), a, b)
            }
            (_, "conditional") => {
                let parts: Vec<u32> = c.iter().copied().filter(|&p| self.rule(p) != "attributes").collect();
                Expression::Conditional(
                    self.expression(parts[0], false),
                    self.expression(parts[1], false),
                    self.expression(parts[2], false),
                )
            }
            (_, "set") => Expression::List(c.iter().map(|&e| self.expression(e, names)).collect()),
            (_, "replicated") => {
                let count = self.expression(c[0], false);
                Expression::Repeated(count, c[1..].iter().map(|&e| self.expression(e, names)).collect())
            }
            _ => Expression::Empty,
        };
        self.push(node, made)
    }

    pub(super) fn number(&mut self, node: u32) -> Expression {
        let text: String = self.text(node).chars().filter(|&c| c != '_').collect();
        let value = scaled(&text).unwrap_or(0.0);
        let whole = text.bytes().all(|b| b.is_ascii_digit()) && value <= 2_147_483_647.0;
        Expression::Number(value, whole)
    }

    pub(super) fn operator(&self, leaf: u32) -> Operator {
        use Operator::*;
        match self.terminal(leaf) {
            "OR" => Or,
            "AND" => And,
            "BIT_OR" => BitOr,
            "BIT_XOR" => BitXor,
            "BIT_XNOR" => BitXnor,
            "BIT_AND" => BitAnd,
            "BIT_NOT" => BitNot,
            "EQUALS" => Equals,
            "DIFFERS" => Differs,
            "LESS" => Less,
            "MORE" => More,
            "AT_MOST" => AtMost,
            "AT_LEAST" => AtLeast,
            "LEFT" => Left,
            "RIGHT" => Right,
            "PLUS" => Plus,
            "MINUS" => Minus,
            "TIMES" => Times,
            "OVER" => Over,
            "PERCENT" => Percent,
            "POWER" => Power,
            _ => Not,
        }
    }

    pub(super) fn call(&mut self, node: u32, names: bool) -> E {
        let c = self.children(node);
        let word = self.word(c[0]);
        let arguments = &c[2..c.len() - 1];
        let given: Vec<u32> =
            if arguments.len() == 1 && self.rule(arguments[0]) == "empty" { Vec::new() } else { arguments.to_vec() };
        let (name, at) = (self.spelled(word), self.place(c[0]));
        if let Some(&k) = self.functions.get(&word) {
            let values = given.iter().map(|&e| self.expression(e, false)).collect();
            return self.push(node, Expression::Function(k, values));
        }
        let access = self.is_access(word);
        if !access {
            let known = if self.terminal(c[0]) == "SYSNAME" {
                self.system(word, Some(given.len()), at)
            } else {
                self.library_function(&name, given.len(), at, names)
            };
            if !known {
                return self.push(node, Expression::Empty);
            }
        } else if given.is_empty() || given.len() > 2 {
            self.error(at, format!("{name} takes a branch, or one node or two"), "write V(a, b)");
        }
        let names = access || name.starts_with('$') || matches!(name.as_str(), "analysis");
        let mut values = Vec::new();
        for &e in &given {
            let value = self.expression(e, names);
            if access {
                if let Expression::Name(word, _) = self.library.expressions[value as usize] {
                    self.known_node(word, self.place(e));
                } else if !matches!(self.library.expressions[value as usize], Expression::Port(_) | Expression::Empty) {
                    self.error(
                        self.place(e),
                        format!("{name} takes nodes or a branch"),
                        "V(a, b) is the potential from a to b",
                    );
                }
            }
            values.push(value);
        }
        self.push(node, Expression::Call(word, values))
    }

    pub(super) fn library_function(&mut self, name: &str, count: usize, at: Place, event: bool) -> bool {
        match functions::arity(name) {
            Some((least, most)) if (least..=most).contains(&count) => true,
            Some((least, most)) => {
                let takes = if least == most { format!("{least}") } else { format!("{least} to {most}") };
                self.error(at, format!("{name} takes {takes} arguments, here are {count}"), "");
                false
            }
            None if event && functions::EVENTS.contains(&name) => true,
            None => {
                let own: Vec<Word> = self.functions.keys().copied().collect();
                let mut known: Vec<&str> = functions::names().collect();
                known.extend(own.iter().map(|&w| self.library.sources.word(w)));
                let hint = match nearest(name, known.into_iter()) {
                    Some(near) => format!("did you mean {near}?"),
                    None => "declare it with analog function, or `include what declares its nature".to_string(),
                };
                self.error(at, format!("there is no function {name}"), hint);
                false
            }
        }
    }

    pub(super) fn system(&mut self, word: Word, count: Option<usize>, at: Place) -> bool {
        let name = self.spelled(word);
        match functions::system(&name) {
            Some((least, most)) if (least..=most).contains(&count.unwrap_or(0)) => true,
            Some((least, most)) => {
                let takes = if least == most { format!("{least}") } else { format!("{least} to {most}") };
                self.error(at, format!("{name} takes {takes} arguments, here are {}", count.unwrap_or(0)), "");
                false
            }
            None => {
                let hint = match nearest(&name, functions::systems()) {
                    Some(near) => format!("did you mean {near}?"),
                    None => String::new(),
                };
                self.error(at, format!("{name} is not supported"), hint);
                false
            }
        }
    }
}

/// A number with a letter of scale behind it.
pub(super) fn scaled(text: &str) -> Option<f64> {
    let scale = match text.chars().last() {
        Some('T') => 1e12,
        Some('G') => 1e9,
        Some('M') => 1e6,
        Some('K' | 'k') => 1e3,
        Some('m') => 1e-3,
        Some('u') => 1e-6,
        Some('n') => 1e-9,
        Some('p') => 1e-12,
        Some('f') => 1e-15,
        Some('a') => 1e-18,
        _ => return text.parse().ok(),
    };
    let digits = &text[..text.len() - 1];
    // 1.5u is the number nearest to 1.5e-6
    match digits.contains(['e', 'E']) {
        true => digits.parse::<f64>().ok().map(|v| v * scale),
        false => format!("{digits}e{}", scale.log10().round()).parse().ok(),
    }
}
