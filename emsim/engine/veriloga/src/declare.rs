//! Declarations of parameters, variables, functions and instances.
use super::ast::*;
use super::source::Word;
use super::tree::{Attributes, Meaning, Reader};
use std::collections::HashMap;

impl Reader<'_> {
    // ---- declarations of values ----

    pub(super) fn declare_parameters(&mut self, node: u32, about: &Attributes) {
        let children = self.children(node);
        let local = self.text(children[0]) == "localparam";
        let list = children[1];
        let kind = self.children(list).iter().copied().find(|&c| self.terminal(c) == "TYPE").map(|k| self.kind(k));
        for parameter in self.find(list, "parameter") {
            self.declare_parameter(parameter, kind, local, about);
        }
    }

    pub(super) fn declare_parameter(&mut self, node: u32, kind: Option<Type>, local: bool, about: &Attributes) {
        let leaf = self.leaf_named(node);
        let (name, at) = (self.word(leaf), self.place(leaf));
        self.fresh(name, at);
        let own = self.attributes(node);
        let number = self.module.parameters.len() as u32;
        self.module.parameters.push(Parameter {
            name,
            aliases: Vec::new(),
            kind,
            at,
            local: local || self.scopes.len() > 1,
            size: None,
            default: 0,
            limits: Vec::new(),
            meaning: own.meaning.or_else(|| about.meaning.clone()).unwrap_or_default(),
            unit: own.unit.or_else(|| about.unit.clone()).unwrap_or_default(),
            instance: own.instance || about.instance,
        });
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name, Meaning::Parameter(number));
        }
    }

    pub(super) fn fill_parameters(&mut self, node: u32) {
        let list = self.children(node)[1];
        for parameter in self.find(list, "parameter") {
            self.fill_parameter(parameter);
        }
    }

    pub(super) fn fill_parameter(&mut self, node: u32) {
        let word = self.word(self.leaf_named(node));
        let Some(Meaning::Parameter(number)) = self.meaning(word) else { return };
        let children = self.children(node);
        let value =
            children.iter().copied().skip(1).find(|&c| !matches!(self.rule(c), "range" | "limit" | "attributes"));
        let Some(value) = value else { return };
        let default = self.expression(value, false);
        let size = self.range(node);
        let mut limits = Vec::new();
        for limit in self.find(node, "limit") {
            let parts = self.children(limit);
            let excluded = self.text(parts[0]) == "exclude";
            let allowed = self.children(parts[1]);
            let allowed = match self.rule(parts[1]) {
                "interval" => {
                    let (low, high) = (self.expression(allowed[1], false), self.expression(allowed[2], false));
                    let closed = |this: &Self, k: u32| matches!(this.terminal(k), "LBRACKET" | "RBRACKET");
                    Allowed::Interval(low, high, closed(self, allowed[0]), closed(self, allowed[3]))
                }
                "set" => Allowed::Values(allowed.iter().map(|&e| self.expression(e, false)).collect()),
                _ => Allowed::Values(vec![self.expression(parts[1], false)]),
            };
            limits.push((excluded, allowed));
        }
        let parameter = &mut self.module.parameters[number as usize];
        (parameter.default, parameter.size, parameter.limits) = (default, size, limits);
    }

    pub(super) fn alias(&mut self, node: u32) {
        let children = self.children(node);
        let (alias, of) = (self.word(children[0]), self.word(children[1]));
        if self.terminal(children[1]) == "SYSNAME" {
            return self.error(
                self.place(children[1]),
                "an alias of a system parameter is not supported",
                "use it by its own name",
            );
        }
        match self.meaning(of) {
            Some(Meaning::Parameter(k)) => {
                self.fresh(alias, self.place(children[0]));
                self.module.parameters[k as usize].aliases.push(alias);
                if let Some(scope) = self.scopes.last_mut() {
                    scope.insert(alias, Meaning::Parameter(k));
                }
            }
            _ => {
                let hint = self.near_value(of);
                let what = format!("there is no parameter {}", self.spelled(of));
                self.error(self.place(children[1]), what, hint);
            }
        }
    }

    pub(super) fn declare_variables(&mut self, node: u32, about: &Attributes, outer: bool) {
        let children = self.children(node);
        let kind = self.kind(children[0]);
        for variable in self.find(node, "variable") {
            let leaf = self.leaf_named(variable);
            let own = self.attributes(variable);
            let about = Attributes {
                meaning: own.meaning.or_else(|| about.meaning.clone()),
                unit: own.unit.or_else(|| about.unit.clone()),
                multiplicity: own.multiplicity.or(about.multiplicity),
                ..Attributes::default()
            };
            // input and type of an argument are declared one by one
            let word = self.word(leaf);
            if !outer && self.scopes.last().is_some_and(|s| s.contains_key(&word)) {
                if let Some(Meaning::Variable(k)) = self.meaning(word) {
                    self.frame[k as usize].kind = kind;
                    continue;
                }
            }
            self.declare_variable(leaf, kind, &about);
        }
    }

    pub(super) fn declare_variable(&mut self, leaf: u32, kind: Type, about: &Attributes) -> u32 {
        let (name, at) = (self.word(leaf), self.place(leaf));
        self.fresh(name, at);
        let number = self.frame.len() as u32;
        self.frame.push(Variable {
            name,
            kind,
            at,
            size: None,
            initial: None,
            meaning: about.meaning.clone().unwrap_or_default(),
            unit: about.unit.clone().unwrap_or_default(),
            multiplicity: about.multiplicity.unwrap_or(0),
            described: about.meaning.is_some() || about.unit.is_some(),
        });
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name, Meaning::Variable(number));
        }
        number
    }

    pub(super) fn fill_variables(&mut self, node: u32) {
        for variable in self.find(node, "variable") {
            let word = self.word(self.leaf_named(variable));
            let Some(Meaning::Variable(number)) = self.meaning(word) else { continue };
            let size = self.range(variable);
            let initial = self
                .children(variable)
                .iter()
                .copied()
                .skip(1)
                .find(|&c| !matches!(self.rule(c), "range" | "attributes"));
            let initial = initial.map(|e| self.expression(e, false));
            let variable = &mut self.frame[number as usize];
            (variable.size, variable.initial) = (size, initial);
        }
    }

    pub(super) fn function(&mut self, node: u32) {
        let children = self.children(node);
        let kind = children.iter().copied().find(|&c| self.terminal(c) == "TYPE").map_or(Type::Real, |k| self.kind(k));
        let leaf = self.leaf_named(node);
        let outer = std::mem::take(&mut self.frame);
        // parameters of the module may be read, its variables not
        let parameters =
            self.scopes[0].iter().filter(|s| matches!(s.1, Meaning::Parameter(_))).map(|(&w, &m)| (w, m)).collect();
        let scopes = std::mem::replace(&mut self.scopes, vec![parameters, HashMap::new()]);
        let result = self.declare_variable(leaf, kind, &Attributes::default());
        let mut arguments = Vec::new();
        for local in self.find(node, "local") {
            let Some(&what) = self.children(local).last() else { continue };
            match self.rule(what) {
                "directions" => {
                    let direction = self.text(self.children(what)[0]).to_string();
                    for named in self.listed(what) {
                        let leaf = self.leaf_named(named);
                        let known = self.scopes.last().and_then(|s| s.get(&self.word(leaf)).copied());
                        let k = match known {
                            Some(Meaning::Variable(k)) => k,
                            _ => self.declare_variable(leaf, Type::Real, &Attributes::default()),
                        };
                        arguments.push((k, direction != "output", direction != "input"));
                    }
                }
                "variables" => self.declare_variables(what, &Attributes::default(), false),
                _ => {
                    self.declare_parameters(what, &Attributes::default());
                    self.fill_parameters(what);
                }
            }
        }
        for local in self.find(node, "local") {
            let Some(&what) = self.children(local).last() else { continue };
            if self.rule(what) == "variables" {
                self.fill_variables(what);
            }
        }
        let body: Vec<S> = self.find(node, "statement").into_iter().map(|s| self.statement(s)).collect();
        self.scopes = scopes;
        let variables = std::mem::replace(&mut self.frame, outer);
        let name = self.word(leaf);
        self.module.functions.push(Function { name, kind, variables, arguments, result, body });
    }

    pub(super) fn instance(&mut self, node: u32) -> Instance {
        let children = self.children(node);
        let names: Vec<u32> = children.iter().copied().filter(|&c| self.terminal(c) == "NAME").collect();
        let second = children.iter().position(|&c| c == names[1]).unwrap_or(0);
        let mut instance = Instance {
            module: self.word(names[0]),
            name: self.word(names[1]),
            at: self.place(names[0]),
            range: self.range(node),
            parameters: Vec::new(),
            nodes: Vec::new(),
        };
        for (k, &child) in children.iter().enumerate() {
            if self.rule(child) != "bindings" {
                continue;
            }
            let nodes = k > second;
            for &binding in self.children(child) {
                let (name, value) = if self.rule(binding) == "by_name" {
                    let pair = self.children(binding);
                    let value = match pair.get(1) {
                        Some(&v) => self.expression(v, nodes),
                        None => self.push(binding, Expression::Empty),
                    };
                    (Some(self.word(pair[0])), value)
                } else {
                    (None, self.expression(binding, nodes))
                };
                if nodes {
                    instance.nodes.push((name, value));
                } else {
                    instance.parameters.push((name, value));
                }
            }
        }
        instance
    }

    /// What a generate block, or one of its parts, holds.
    pub(super) fn generated(&mut self, node: u32) -> Vec<Generated> {
        let c = self.children(node);
        match self.rule(node) {
            "generate" => c.iter().flat_map(|&part| self.generated(part)).collect(),
            "generated" => match c.last() {
                Some(&what) => self.generated(what),
                None => Vec::new(),
            },
            "generate_block" => {
                let name = c.iter().copied().find(|&k| self.terminal(k) == "NAME").map(|k| self.word(k));
                let body = self.find(node, "generated").into_iter().flat_map(|part| self.generated(part)).collect();
                vec![Generated::Block(name, body)]
            }
            "generate_for" => {
                let (first, condition, next) = (self.simple(c[2]), self.expression(c[3], false), self.simple(c[4]));
                vec![Generated::For(first, condition, next, self.generated(c[6]))]
            }
            "generate_if" => {
                let (condition, yes) = (self.expression(c[2], false), self.generated(c[4]));
                let no = c.get(5).map_or_else(Vec::new, |&part| self.generated(part));
                vec![Generated::If(condition, yes, no)]
            }
            "instance" => vec![Generated::Instance(self.instance(node))],
            "analog" => {
                let Some(&what) = c.last() else { return Vec::new() };
                let statement = self.statement(what);
                self.module.generated_analog.push(statement);
                vec![Generated::Analog(statement)]
            }
            _ => Vec::new(),
        }
    }

    /// defparam x1.r = 2: what the instance is given comes before.
    pub(super) fn overrides(&mut self, node: u32) {
        for one in self.find(node, "override_of") {
            let c = self.children(one);
            let at = self.place(one);
            let value = self.expression(c[c.len() - 1], false);
            let names: Vec<Word> = c.iter().filter(|&&k| self.terminal(k) == "NAME").map(|&k| self.word(k)).collect();
            let [instance, parameter] = names[..] else {
                self.error(at, "defparam reaches into an instance of this module alone", "x1.r = 2");
                continue;
            };
            let found = self.module.instances.iter_mut().find(|i| i.name == instance);
            match found {
                Some(found) => {
                    found.parameters.retain(|p| p.0 != Some(parameter));
                    found.parameters.push((Some(parameter), value));
                }
                None => {
                    let what = format!("defparam: there is no instance {}", self.spelled(instance));
                    self.error(at, what, "it names an instance of this module, and a parameter of it: x1.r = 2");
                }
            }
        }
    }
}
