//! From tokens to modules: the LALR tables of grammar/veriloga.lark make a tree, and here it is read: names get their meanings, and
//! what is not declared, declared twice or called wrongly is told with its place.
use super::ast::*;
use super::source::{Kind, Place, Token, Word};
use super::{nearest, unquote, Library, Message};
use emsim_syntax::parse::{Node as Item, Parser, Tree};
use emsim_syntax::pattern::{Found, Stack};
use emsim_syntax::table::Table;
use std::collections::HashMap;
use std::sync::OnceLock;

/// More messages about one text nobody reads.
const MOST_MESSAGES: usize = 20;

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| Table::open(include_str!("tables.txt")).expect("the tables of the grammar"))
}

/// Reads all tokens into the library, and how deeply they are nested.
pub fn read(library: &mut Library, tokens: &[Token]) -> Result<u32, Vec<Message>> {
    let table = table();
    let terminals: Vec<&'static str> = table.terminal_names().collect();
    let kinds = terminals_of(library, tokens, &terminals)?;
    let mut parser = Parser::default();
    let start = table.start("start").unwrap_or_default();
    if let Err((at, wanted)) = parser.tokens(table, start, &kinds) {
        return Err(vec![unexpected(library, tokens, at, &wanted, &terminals)]);
    }
    let deepest = depth(library, &parser.tree, tokens)?;
    let mut reader = Reader {
        names: &table.names,
        terminals: &terminals,
        tree: &parser.tree,
        tokens,
        library,
        scopes: Vec::new(),
        functions: HashMap::new(),
        frame: Vec::new(),
        module: Module::default(),
        messages: Vec::new(),
    };
    reader.all();
    if reader.messages.is_empty() {
        Ok(deepest)
    } else {
        Err(reader.messages)
    }
}

/// The terminal of every token: a fixed word before what stands for all words.
fn terminals_of(library: &Library, tokens: &[Token], names: &[&str]) -> Result<Vec<u8>, Vec<Message>> {
    let table = table();
    let number = |name: &str| names.iter().position(|n| *n == name).unwrap_or(0) as u8;
    let general = [number("NAME"), number("SYSNAME"), number("NUMBER"), number("STRING")];
    let mut known: HashMap<Word, u8> = HashMap::new();
    let mut stack = Stack::default();
    let mut out = Vec::with_capacity(tokens.len());
    for token in tokens {
        let terminal = match token.kind {
            Kind::System => general[1],
            Kind::Number => general[2],
            Kind::Text => general[3],
            _ => match known.get(&token.word) {
                Some(&terminal) => terminal,
                None => {
                    let text = library.sources.word(token.word);
                    let mut whole = |k: u8| {
                        let Some(terminal) = table.terminal(k as usize) else { return false };
                        !terminal.ignored
                            && matches!(terminal.pattern.at(&table.classes, text, 0, &mut stack), Found::To(end) if end == text.len())
                    };
                    let found = (0..names.len() as u8).find(|&k| !general.contains(&k) && whole(k));
                    let terminal = match found {
                        Some(k) => k,
                        None if token.kind == Kind::Name => general[0],
                        None => {
                            let what = format!("{text} means nothing here");
                            return Err(vec![library.sources.message(token.at, what, "")]);
                        }
                    };
                    known.insert(token.word, terminal);
                    terminal
                }
            },
        };
        out.push(terminal);
    }
    Ok(out)
}

/// Words of the language that are not for analogue modules.
const DIGITAL: &[&str] = &[
    "initial",
    "always",
    "assign",
    "reg",
    "wire",
    "wreal",
    "fork",
    "join",
    "task",
    "specify",
    "primitive",
    "posedge",
    "negedge",
    "logic",
    "connectmodule",
    "connectrules",
    "supply0",
    "supply1",
    "tri",
    "wand",
    "wor",
    "casex",
    "casez",
];

/// What messages offer as the next word, most telling first: the grammar's name and how it is written.
const OFFERED: &[(&str, &str)] = &[
    ("EMPTY", ";"),
    ("SEMICOLON", ";"),
    ("RPAR", ")"),
    ("COMMA", ","),
    ("CONTRIBUTES", "<+"),
    ("ASSIGN", "="),
    ("COLON", ":"),
    ("RBRACKET", "]"),
    ("RBRACE", "}"),
    ("END", "end"),
    ("ENDCASE", "endcase"),
    ("ENDFUNCTION", "endfunction"),
    ("ENDMODULE", "endmodule"),
    ("MODULE", "module"),
    ("LPAR", "("),
    ("NAME", "a name"),
];

fn unexpected(library: &Library, tokens: &[Token], at: usize, wanted: &[u8], names: &[&str]) -> Message {
    let has = |name: &str| wanted.iter().any(|&k| names[k as usize] == name);
    let mut words: Vec<&str> = OFFERED.iter().filter(|o| has(o.0)).map(|o| o.1).collect();
    words.dedup();
    words.truncate(4);
    let expected = if words.is_empty() { String::new() } else { format!("expected here: {}", words.join("  or  ")) };
    let Some(token) = tokens.get(at) else { return too_early(library, tokens, expected) };
    let word = library.sources.word(token.word);
    let before = at.checked_sub(1).map(|k| tokens[k]);
    for token in before.iter().chain([token]) {
        let word = library.sources.word(token.word);
        if DIGITAL.contains(&word) {
            let what = format!("{word} belongs to digital or structural Verilog, which is not supported");
            return library.sources.message(
                token.at,
                what,
                "an analogue module says what it does in analog begin ... end",
            );
        }
    }
    if has("CONTRIBUTES") && word == "=" {
        return library.sources.message(token.at, "a branch cannot be assigned to", "contribute to it with <+");
    }
    // a statement that is not closed is told where it ends
    if let Some(before) = before {
        if (has("SEMICOLON") || has("EMPTY")) && !has("BEGIN") && token.at.call == before.at.call {
            let place = Place { start: before.at.start + before.at.length.max(1) - 1, length: 1, ..before.at };
            let what = format!("a ; is missing before {word}");
            return library.sources.message(place, what, "statements and declarations end with ;");
        }
    }
    library.sources.message(token.at, format!("{word} is not expected here"), expected)
}

/// The text ends within something: what is open is told, or else what was expected.
fn too_early(library: &Library, tokens: &[Token], expected: String) -> Message {
    let place = tokens.last().map(|t| t.at).unwrap_or_default();
    let mut open: Vec<Token> = Vec::new();
    for token in tokens {
        match library.sources.word(token.word) {
            "module" | "macromodule" | "begin" | "case" | "function" | "nature" | "discipline" | "paramset" => {
                open.push(*token)
            }
            "end" | "endmodule" | "endcase" | "endfunction" | "endnature" | "enddiscipline" | "endparamset" => {
                open.pop();
            }
            _ => {}
        }
    }
    let hint = open.last().map_or(expected, |t| {
        let word = library.sources.word(t.word);
        let close = match word {
            "begin" => "end".to_string(),
            "macromodule" => "endmodule".to_string(),
            word => format!("end{word}"),
        };
        format!("{close} is missing: the {word} of line {} is open", library.sources.message(t.at, "", "").line)
    });
    library.sources.message(place, "the text ends too early", hint)
}

fn depth(library: &Library, tree: &Tree, tokens: &[Token]) -> Result<u32, Vec<Message>> {
    // children come before parents; with the first leaf of each
    let mut depths: Vec<(u32, u32)> = Vec::with_capacity(tree.nodes.len());
    let mut deepest = 0;
    for node in &tree.nodes {
        let (depth, leaf) = match *node {
            Item::Leaf { start, .. } => (0, start),
            Item::Rule { first, count, .. } => {
                let children = tree.of(first, count);
                let depth = children.iter().map(|&c| depths[c as usize].0).max().unwrap_or(0) + 1;
                (depth, children.first().map_or(0, |&c| depths[c as usize].1))
            }
        };
        // deeper trees are refused: what reads them calls itself
        if depth > 1500 {
            let at = tokens.get(leaf as usize).map(|t| t.at).unwrap_or_default();
            return Err(vec![library.sources.message(
                at,
                "this is nested too deeply",
                "use variables for parts of it",
            )]);
        }
        deepest = deepest.max(depth);
        depths.push((depth, leaf));
    }
    Ok(deepest)
}

#[derive(Clone, Copy)]
pub(super) enum Meaning {
    Variable(u32),
    Parameter(u32),
}

pub(super) struct Reader<'a> {
    pub(super) names: &'a [&'static str],
    pub(super) terminals: &'a [&'static str],
    pub(super) tree: &'a Tree,
    pub(super) tokens: &'a [Token],
    pub(super) library: &'a mut Library,
    pub(super) scopes: Vec<HashMap<Word, Meaning>>,
    pub(super) functions: HashMap<Word, u32>,
    /// variables of the module or of the function that is read
    pub(super) frame: Vec<Variable>,
    pub(super) module: Module,
    pub(super) messages: Vec<Message>,
}

/// What attributes before or behind a declaration say.
#[derive(Clone, Default)]
pub(super) struct Attributes {
    pub(super) meaning: Option<String>,
    pub(super) unit: Option<String>,
    /// `multiplicity`: the power of $mfactor that an output variable is multiplied with (Verilog-AMS 2.4, 3.2.1)
    pub(super) multiplicity: Option<i32>,
    pub(super) instance: bool,
    pub(super) unroll: Option<u32>,
}

/// What stands in a module, with what is said of it.
struct Member {
    what: u32,
    about: Attributes,
}

impl<'a> Reader<'a> {
    // ---- the tree ----

    pub(super) fn rule(&self, node: u32) -> &'static str {
        match self.tree.nodes[node as usize] {
            Item::Leaf { .. } => "",
            Item::Rule { name, .. } => self.names[name as usize],
        }
    }

    pub(super) fn terminal(&self, node: u32) -> &'static str {
        match self.tree.nodes[node as usize] {
            Item::Leaf { terminal, .. } => self.terminals[terminal as usize],
            Item::Rule { .. } => "",
        }
    }

    pub(super) fn children(&self, node: u32) -> &'a [u32] {
        match self.tree.nodes[node as usize] {
            Item::Leaf { .. } => &[],
            Item::Rule { first, count, .. } => self.tree.of(first, count),
        }
    }

    pub(super) fn leaf(&self, node: u32, last: bool) -> Option<u32> {
        let mut node = node;
        loop {
            match self.tree.nodes[node as usize] {
                Item::Leaf { start, .. } => return Some(start),
                Item::Rule { first, count, .. } => {
                    let children = self.tree.of(first, count);
                    // empty rules have no place of their own
                    let found = children.iter().copied().find(|&c| self.rule(c) != "empty");
                    let end = children.iter().rev().copied().find(|&c| self.rule(c) != "empty");
                    node = if last { end? } else { found? };
                }
            }
        }
    }

    pub(super) fn place(&self, node: u32) -> Place {
        let Some(first) = self.leaf(node, false) else { return Place::default() };
        let first = self.tokens[first as usize].at;
        let last = self.leaf(node, true).map_or(first, |l| self.tokens[l as usize].at);
        if last.file == first.file && last.call == first.call && last.start >= first.start {
            return Place { length: last.start + last.length - first.start, ..first };
        }
        first
    }

    pub(super) fn word(&self, leaf: u32) -> Word {
        match self.tree.nodes[leaf as usize] {
            Item::Leaf { start, .. } => self.tokens[start as usize].word,
            Item::Rule { .. } => self.leaf(leaf, false).map_or(0, |l| self.tokens[l as usize].word),
        }
    }

    pub(super) fn text(&self, leaf: u32) -> &str {
        self.library.sources.word(self.word(leaf))
    }

    pub(super) fn spelled(&self, word: Word) -> String {
        self.library.sources.word(word).to_string()
    }

    pub(super) fn error(&mut self, at: Place, text: impl Into<String>, hint: impl Into<String>) {
        if self.messages.len() < MOST_MESSAGES {
            let message = self.library.sources.message(at, text, hint);
            self.messages.push(message);
        }
    }

    pub(super) fn find(&self, node: u32, rule: &str) -> Vec<u32> {
        self.children(node).iter().copied().filter(|&c| self.rule(c) == rule).collect()
    }

    /// What a declaration lists.
    pub(super) fn listed(&self, node: u32) -> Vec<u32> {
        self.find(node, "names").into_iter().flat_map(|n| self.children(n)).copied().collect()
    }

    // ---- the whole text ----

    pub(super) fn all(&mut self) {
        let items = self.children(self.tree.root);
        let of = |this: &Self, item: u32| {
            let children = this.children(item);
            children.last().copied()
        };
        for &item in items {
            let Some(what) = of(self, item) else { continue };
            match self.rule(what) {
                "nature" => self.nature(what),
                "discipline" => self.discipline(what),
                _ => {}
            }
        }
        for &item in items {
            let Some(what) = of(self, item) else { continue };
            if matches!(self.rule(what), "module" | "paramset") {
                let attributes = self.attributes(item);
                self.module(what, &attributes);
            }
        }
    }

    pub(super) fn nature(&mut self, node: u32) {
        let names: Vec<u32> = self.children(node).iter().copied().filter(|&c| self.terminal(c) == "NAME").collect();
        let mut nature = Nature { name: self.word(names[0]), ..Nature::default() };
        if let Some(&parent) = names.get(1) {
            let parent = self.word(parent);
            match self.library.natures.iter().find(|n| n.name == parent) {
                Some(known) => nature = Nature { name: nature.name, ..known.clone() },
                None => {
                    let what = format!("there is no nature {}", self.spelled(parent));
                    self.error(self.place(names[1]), what, "natures are declared before they are used");
                }
            }
        }
        for setting in self.find(node, "setting") {
            let children = self.children(setting);
            match self.text(children[0]) {
                "access" => nature.access = Some(self.word(children[1])),
                "units" => nature.unit = unquote(self.text(children[1])),
                _ => {}
            }
        }
        self.library.natures.retain(|n| n.name != nature.name);
        self.library.natures.push(nature);
    }

    pub(super) fn discipline(&mut self, node: u32) {
        let mut found = Discipline { name: self.word(self.children(node)[0]), ..Discipline::default() };
        for t in self.find(node, "trait") {
            let children = self.children(t);
            let value = self.word(children[1]);
            let known = self.library.natures.iter().any(|n| n.name == value);
            let which = self.text(children[0]).to_string();
            if matches!(which.as_str(), "potential" | "flow") && !known {
                let what = format!("there is no nature {}", self.spelled(value));
                self.error(self.place(children[1]), what, "natures are declared before the disciplines that use them");
            }
            match which.as_str() {
                "potential" => found.potential = Some(value),
                "flow" => found.flow = Some(value),
                _ => {}
            }
        }
        self.library.disciplines.retain(|d| d.name != found.name);
        self.library.disciplines.push(found);
    }

    pub(super) fn attributes(&mut self, node: u32) -> Attributes {
        let mut out = Attributes::default();
        for group in self.find(node, "attributes") {
            for &attribute in self.children(group) {
                let children = self.children(attribute);
                let Some(&value) = children.get(1) else { continue };
                let text = unquote(self.text(value));
                match self.text(children[0]) {
                    "desc" | "info" => out.meaning = Some(text),
                    "units" | "unit" => out.unit = Some(text),
                    "multiplicity" => {
                        let powers = [("multiply", 1), ("divide", -1), ("none", 0)];
                        out.multiplicity = powers.iter().find(|p| p.0 == text).map(|p| p.1);
                        if out.multiplicity.is_none() {
                            let hint = "it is \"multiply\", \"divide\" or \"none\"";
                            self.error(self.place(value), format!("there is no multiplicity \"{text}\""), hint);
                        }
                    }
                    "type" => out.instance = text == "instance",
                    "unroll" => out.unroll = text.parse().ok(),
                    _ => {}
                }
            }
        }
        out
    }

    // ---- modules ----

    pub(super) fn module(&mut self, node: u32, attributes: &Attributes) {
        let children = self.children(node);
        let is_set = self.rule(node) == "paramset";
        let behind = if is_set { None } else { self.attributes(node).meaning };
        let meaning = attributes.meaning.clone().or(behind);
        self.scopes = vec![HashMap::new()];
        self.functions.clear();
        self.frame.clear();
        self.module = Module {
            name: self.word(children[0]),
            at: self.place(children[0]),
            meaning: meaning.unwrap_or_default(),
            base: is_set.then(|| self.word(children[1])),
            ..Module::default()
        };
        let name = self.module.name;
        if !is_set && self.library.modules.iter().any(|m| m.name == name && m.base.is_none()) {
            let what = format!("the module {} is there twice", self.spelled(name));
            self.error(self.place(children[0]), what, "give one of them another name");
        }
        for formal in self.formals(node) {
            let kind = self.children(formal).iter().copied().find(|&c| self.terminal(c) == "TYPE");
            let kind = kind.map(|k| self.kind(k));
            for parameter in self.find(formal, "parameter") {
                self.declare_parameter(parameter, kind, false, &Attributes::default());
            }
        }
        for list in self.find(node, "ports") {
            for port in self.find(list, "port") {
                self.port(port);
            }
        }
        self.module.ports = self.module.nodes.len();
        // names first: what is declared may stand behind its use
        let members = if is_set { self.members_of_set(children) } else { self.members(node) };
        let functions = self.declare(&members);
        // then what they hang on
        for Member { what, .. } in &members {
            match self.rule(*what) {
                "parameters" => self.fill_parameters(*what),
                "variables" => self.fill_variables(*what),
                _ => {}
            }
        }
        for formal in self.formals(node) {
            for parameter in self.find(formal, "parameter") {
                self.fill_parameter(parameter);
            }
        }
        for f in functions {
            self.function(f);
        }
        self.bodies(&members);
        for k in 0..self.module.ports {
            let node = self.module.nodes[k].clone();
            if node.discipline.is_none() && !is_set {
                let what = format!("the port {} has no discipline", self.spelled(node.name));
                self.error(node.at, what, "declare it: electrical name;");
            }
        }
        self.module.variables = std::mem::take(&mut self.frame);
        let module = std::mem::take(&mut self.module);
        self.library.modules.push(module);
    }

    fn formals(&self, node: u32) -> Vec<u32> {
        self.find(node, "formals").into_iter().flat_map(|formals| self.find(formals, "formal")).collect()
    }

    fn members(&mut self, node: u32) -> Vec<Member> {
        let mut members = Vec::new();
        for m in self.find(node, "member") {
            let Some(&what) = self.children(m).last() else { continue };
            members.push(Member { what, about: self.attributes(m) });
        }
        members
    }

    /// Those of a paramset stand side by side with their attributes.
    fn members_of_set(&self, children: &[u32]) -> Vec<Member> {
        let mut pending = Attributes::default();
        let mut members = Vec::new();
        for &what in children {
            match self.rule(what) {
                "attributes" => {
                    for &a in self.children(what) {
                        let pair = self.children(a);
                        let value = pair.get(1).map(|&v| unquote(self.text(v)));
                        match self.text(pair[0]) {
                            "desc" => pending.meaning = value,
                            "units" => pending.unit = value,
                            _ => {}
                        }
                    }
                }
                "" => {}
                _ => members.push(Member { what, about: std::mem::take(&mut pending) }),
            }
        }
        members
    }

    /// Names of all that members declare; their functions.
    fn declare(&mut self, members: &[Member]) -> Vec<u32> {
        let mut functions = Vec::new();
        for Member { what, about } in members {
            match self.rule(*what) {
                "parameters" => self.declare_parameters(*what, about),
                "variables" => self.declare_variables(*what, about, true),
                "genvars" => {
                    for named in self.listed(*what) {
                        let leaf = self.leaf_named(named);
                        self.declare_variable(leaf, Type::Integer, &Attributes::default());
                    }
                }
                "directions" | "nets" | "ground" => self.nets(*what),
                "branches" => self.branches(*what),
                "function" => functions.push(*what),
                _ => {}
            }
        }
        for &Member { what, .. } in members {
            if self.rule(what) == "alias" {
                self.alias(what);
            }
        }
        let named = |&f: &u32| self.children(f).iter().copied().find(|&c| self.terminal(c) == "NAME");
        let names: Vec<(u32, Word)> = functions.iter().filter_map(|f| Some((*f, self.word(named(f)?)))).collect();
        for (k, &(f, name)) in names.iter().enumerate() {
            if self.functions.insert(name, k as u32).is_some() {
                let what = format!("the function {} is there twice", self.spelled(name));
                self.error(self.place(f), what, "");
            }
        }
        names.into_iter().map(|(f, _)| f).collect()
    }

    /// What a module does, what it is made of, and what it sets.
    fn bodies(&mut self, members: &[Member]) {
        for &Member { what, .. } in members {
            match self.rule(what) {
                "analog" => self.analog(what),
                "instance" => {
                    let instance = self.instance(what);
                    self.module.instances.push(instance);
                }
                "generate" | "generate_for" | "generate_if" => {
                    let generated = self.generated(what);
                    self.module.generated.extend(generated);
                }
                "choice" => {
                    let children = self.children(what);
                    let value = self.expression(children[1], false);
                    let choice = (self.word(children[0]), value, self.place(children[0]));
                    self.module.choices.push(choice);
                }
                _ => {}
            }
        }
        for &Member { what, .. } in members {
            if self.rule(what) == "defparam" {
                self.overrides(what);
            }
        }
    }

    pub(super) fn kind(&self, leaf: u32) -> Type {
        match self.text(leaf) {
            "integer" => Type::Integer,
            "string" => Type::Text,
            _ => Type::Real,
        }
    }

    pub(super) fn leaf_named(&self, node: u32) -> u32 {
        self.children(node).iter().copied().find(|&c| self.terminal(c) == "NAME").unwrap_or(node)
    }

    pub(super) fn range(&mut self, node: u32) -> Option<(E, E)> {
        let range = *self.find(node, "range").first()?;
        let children = self.children(range);
        Some((self.expression(children[1], false), self.expression(children[2], false)))
    }

    /// The discipline that a word names.
    pub(super) fn discipline_of(&mut self, leaf: u32) -> Option<Word> {
        let word = self.word(leaf);
        if self.library.disciplines.iter().any(|d| d.name == word) {
            return Some(word);
        }
        let name = self.spelled(word);
        let known = self.library.disciplines.iter().map(|d| self.library.sources.word(d.name));
        let hint = match nearest(&name, known) {
            Some(near) => format!("did you mean {near}?"),
            None => "`include \"disciplines.vams\" at the head of the file declares electrical and others".to_string(),
        };
        self.error(self.place(leaf), format!("there is no discipline {name}"), hint);
        None
    }

    pub(super) fn port(&mut self, port: u32) {
        let names: Vec<u32> = self.children(port).iter().copied().filter(|&c| self.terminal(c) == "NAME").collect();
        let Some(&leaf) = names.last() else { return };
        let discipline = if names.len() > 1 { self.discipline_of(names[0]) } else { None };
        let range = self.range(port);
        let (name, at) = (self.word(leaf), self.place(leaf));
        if self.module.nodes.iter().any(|n| n.name == name) {
            let what = format!("the port {} is there twice", self.spelled(name));
            self.error(at, what, "");
            return;
        }
        self.module.nodes.push(Node { name, at, discipline, range, ground: false });
    }

    pub(super) fn nets(&mut self, node: u32) {
        let rule = self.rule(node);
        let discipline = self.children(node).iter().copied().find(|&c| self.terminal(c) == "NAME");
        let discipline = discipline.and_then(|d| self.discipline_of(d));
        let whole = self.range(node);
        for named in self.listed(node) {
            let leaf = self.leaf_named(named);
            let (name, at) = (self.word(leaf), self.place(leaf));
            let range = self.range(named).or(whole);
            if self
                .children(named)
                .iter()
                .any(|&c| self.terminal(c) != "NAME" && !matches!(self.rule(c), "attributes" | "range"))
            {
                self.error(
                    at,
                    "a net cannot be given a value where it is declared",
                    "contribute to it in the analog block",
                );
            }
            match self.module.nodes.iter().position(|n| n.name == name) {
                Some(k) => {
                    let known = &mut self.module.nodes[k];
                    known.range = known.range.or(range);
                    known.ground |= rule == "ground";
                    if let (Some(old), Some(new)) = (known.discipline, discipline) {
                        if old != new {
                            let what = format!("{} has two disciplines", self.spelled(name));
                            self.error(at, what, "keep one of them");
                        }
                    }
                    let known = &mut self.module.nodes[k];
                    known.discipline = known.discipline.or(discipline);
                }
                None if rule == "directions" => {
                    let what = format!("{} is no port of the module", self.spelled(name));
                    self.error(at, what, "list it in the brackets behind the module's name");
                }
                None => {
                    self.fresh(name, at);
                    let node = Node { name, at, discipline, range, ground: rule == "ground" };
                    self.module.nodes.push(node);
                }
            }
        }
    }

    /// A name that is declared may not mean something else already.
    pub(super) fn fresh(&mut self, name: Word, at: Place) {
        let here = self.scopes.last().is_some_and(|s| s.contains_key(&name));
        let outer = self.scopes.len() == 1;
        let other = outer
            && (self.module.nodes.iter().any(|n| n.name == name)
                || self.module.branches.iter().any(|b| b.name == name));
        if here || other {
            let what = format!("{} is declared twice", self.spelled(name));
            self.error(at, what, "give one of them another name");
        }
    }

    pub(super) fn branches(&mut self, node: u32) {
        let ends: Vec<u32> = self
            .children(node)
            .iter()
            .copied()
            .filter(|&c| matches!(self.rule(c), "reference" | "port_reference"))
            .collect();
        let ends: Vec<E> = ends.iter().map(|&e| self.reference(e)).collect();
        for named in self.listed(node) {
            let leaf = self.leaf_named(named);
            let (name, at) = (self.word(leaf), self.place(leaf));
            self.fresh(name, at);
            self.module.branches.push(Branch { name, ends: (ends[0], ends.get(1).copied()) });
        }
    }

    /// A node, or a port in <>.
    pub(super) fn reference(&mut self, node: u32) -> E {
        if self.rule(node) == "port_reference" {
            let inner = self.children(node)[0];
            let word = self.word(inner);
            return self.push(node, Expression::Port(word));
        }
        let children = self.children(node);
        let index = children.get(1).map(|&e| self.expression(e, false));
        let word = self.word(children[0]);
        self.known_node(word, self.place(children[0]));
        self.push(node, Expression::Name(word, index))
    }

    pub(super) fn known_node(&mut self, word: Word, at: Place) {
        let is = |n: &&Node| n.name == word;
        if self.module.nodes.iter().any(|n| is(&n)) || self.module.branches.iter().any(|b| b.name == word) {
            return;
        }
        let name = self.spelled(word);
        let known = self.module.nodes.iter().map(|n| n.name).chain(self.module.branches.iter().map(|b| b.name));
        let hint = match nearest(&name, known.map(|w| self.library.sources.word(w))) {
            Some(near) => format!("did you mean {near}?"),
            None => "declare it: electrical name;".to_string(),
        };
        self.error(at, format!("there is no node or branch {name}"), hint);
    }
}
