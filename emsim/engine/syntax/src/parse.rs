//! One logical line to its tree: Lark's contextual lexer (each state looks only for the terminals that it can
//! take) and its LALR(1) automaton, with the tree shaped as Lark's tree builder does.
use super::pattern::{Found, Stack};
use super::table::{Action, Child, Lexer, Table};

/// A node of a tree.
#[derive(Clone, Copy, Debug)]
pub enum Node {
    Leaf {
        terminal: u8,
        start: u32,
        end: u32,
    },
    /// `name` is an index into `Table::names`; the children are `Tree::children[first..first + count]`
    Rule {
        name: u16,
        first: u32,
        count: u32,
    },
}

/// The nodes of one line, children before parents.
#[derive(Default)]
pub struct Tree {
    pub nodes: Vec<Node>,
    pub children: Vec<u32>,
    pub root: u32,
}

impl Tree {
    pub fn of(&self, first: u32, count: u32) -> &[u32] {
        &self.children[first as usize..(first + count) as usize]
    }
}

enum Value {
    Node(u32),
    /// the children of a rule without a name, or nothing that is kept
    List(Vec<u32>),
}

/// A parser with its scratch memory; `tree` holds the last line's.
#[derive(Default)]
pub struct Parser {
    pub tree: Tree,
    states: Vec<u16>,
    values: Vec<Value>,
    spare: Vec<Vec<u32>>,
    stack: Stack,
}

impl Parser {
    /// True when the line is accepted from `start` and its tree stands in `self.tree`. False: Lark shall read it,
    /// because it is wrong or because it is not certain.
    pub fn parse(&mut self, table: &Table, start: (u16, u16), text: &str) -> bool {
        self.tree.nodes.clear();
        self.tree.children.clear();
        self.states.clear();
        self.values.clear();
        if text.len() > (u32::MAX / 2) as usize {
            return false;
        }
        self.states.push(start.0);
        let mut at = 0;
        loop {
            let Some(lexer) = self.lexer(table) else { return false };
            match self.token(table, lexer, text, at) {
                Token::Some(terminal, end) => {
                    self.tree.nodes.push(Node::Leaf { terminal, start: at as u32, end: end as u32 });
                    let leaf = self.tree.nodes.len() as u32 - 1;
                    if !self.feed(table, terminal as usize, Some(leaf), start.1) {
                        return false;
                    }
                    at = end;
                }
                Token::Ignored(end) => at = end,
                Token::End => break,
                Token::No => return false,
            }
        }
        if !self.feed(table, table.end(), None, start.1) {
            return false;
        }
        match self.values.pop() {
            Some(Value::Node(root)) => {
                self.tree.root = root;
                true
            }
            _ => false,
        }
    }

    /// The tree of tokens that were cut elsewhere, each given by its terminal; leaves hold their numbers. Otherwise the number of
    /// the token that does not fit (their count: the end does not) and what would.
    pub fn tokens(&mut self, table: &Table, start: (u16, u16), tokens: &[u8]) -> Result<(), (usize, Vec<u8>)> {
        self.tree.nodes.clear();
        self.tree.children.clear();
        self.states.clear();
        self.values.clear();
        self.states.push(start.0);
        for (k, &terminal) in tokens.iter().enumerate() {
            self.tree.nodes.push(Node::Leaf { terminal, start: k as u32, end: k as u32 + 1 });
            let leaf = self.tree.nodes.len() as u32 - 1;
            if !self.feed(table, terminal as usize, Some(leaf), start.1) {
                return Err((k, self.awaited(table)));
            }
        }
        if self.feed(table, table.end(), None, start.1) {
            if let Some(Value::Node(root)) = self.values.pop() {
                self.tree.root = root;
                return Ok(());
            }
        }
        Err((tokens.len(), self.awaited(table)))
    }

    /// The terminals that the state can take.
    fn awaited(&self, table: &Table) -> Vec<u8> {
        let Some(state) = self.states.last().and_then(|&s| table.state(s)) else { return Vec::new() };
        (0..table.end()).filter(|&k| state.action(k) != Action::Error).map(|k| k as u8).collect()
    }

    /// What looks for the terminals of the state.
    fn lexer<'t>(&self, table: &'t Table) -> Option<&'t Lexer> {
        table.lexer(table.state(*self.states.last()?)?.lexer)
    }

    /// The first terminal of the lexer, in its order, that matches.
    fn token(&mut self, table: &Table, lexer: &Lexer, text: &str, at: usize) -> Token {
        let bytes = text.as_bytes();
        let Some(&byte) = bytes.get(at) else { return Token::End };
        // the blanks between words, nearly all there are: of what is ignored only a comment and a continuation begin
        // with blanks too, and those go on otherwise
        if byte == b' ' && lexer.gap {
            let end = at + bytes[at..].iter().take_while(|&&b| b == b' ').count();
            if bytes.get(end).is_some_and(u8::is_ascii_alphanumeric) {
                return Token::Ignored(end);
            }
        }
        for &k in &lexer.order {
            let Some(terminal) = table.terminal(k as usize) else { return Token::No };
            let pattern = &terminal.pattern;
            if !(if byte < 128 { pattern.first >> byte & 1 != 0 } else { pattern.first_other }) {
                continue;
            }
            match pattern.at(&table.classes, text, at, &mut self.stack) {
                Found::Nothing => {}
                Found::Unknown => return Token::No,
                Found::To(end) if end == at => return Token::No, // no terminal is empty
                Found::To(end) if terminal.ignored => return Token::Ignored(end),
                Found::To(end) => {
                    // a keyword among the words
                    for &(word, keyword) in &lexer.unless {
                        if word == k {
                            let Some(keyword_terminal) = table.terminal(keyword as usize) else {
                                return Token::No;
                            };
                            let pattern = &keyword_terminal.pattern;
                            if byte < 128 && pattern.first >> byte & 1 == 0 {
                                continue;
                            }
                            match pattern.at(&table.classes, &text[..end], at, &mut self.stack) {
                                Found::To(stop) if stop == end => return Token::Some(keyword, end),
                                Found::Unknown => return Token::No,
                                _ => {}
                            }
                        }
                    }
                    return Token::Some(k, end);
                }
            }
        }
        Token::No
    }

    /// Reduces as often as the terminal asks for and shifts it; at the end, until the start is complete.
    fn feed(&mut self, table: &Table, terminal: usize, leaf: Option<u32>, last: u16) -> bool {
        loop {
            let Some(state) = self.states.last().and_then(|&s| table.state(s)) else { return false };
            match state.action(terminal) {
                Action::Error => return false,
                Action::Shift(next) => {
                    let Some(leaf) = leaf else { return false };
                    self.states.push(next);
                    self.values.push(Value::Node(leaf));
                    return true;
                }
                Action::Reduce(rule) => {
                    let Some(next) = self.reduce(table, rule) else { return false };
                    if leaf.is_none() && next == last {
                        return true;
                    }
                }
            }
        }
    }

    fn reduce(&mut self, table: &Table, number: u16) -> Option<u16> {
        let rule = table.rule(number as usize)?;
        let size = rule.children.len();
        let from = self.values.len().checked_sub(size)?;
        // the children of a repetition are appended to in place
        let mut list = match (rule.children.first(), self.values.get_mut(from)) {
            (Some(Child::Inline), Some(Value::List(list))) => std::mem::take(list),
            _ => self.spare.pop().unwrap_or_default(),
        };
        for (k, (value, child)) in self.values.drain(from..).zip(&rule.children).enumerate() {
            match (child, value) {
                (Child::Keep, Value::Node(node)) => list.push(node),
                (Child::Inline, Value::List(mut more)) => {
                    if k > 0 {
                        list.append(&mut more);
                    }
                    if more.capacity() > 0 && self.spare.len() < 64 {
                        self.spare.push(more);
                    }
                }
                (Child::Drop, Value::Node(_)) => {}
                _ => return None,
            }
        }
        self.states.truncate(self.states.len().checked_sub(size)?);
        let value = if rule.single && list.len() == 1 {
            let only = list[0];
            list.clear();
            self.spare.push(list);
            Value::Node(only)
        } else if rule.nameless {
            Value::List(list)
        } else {
            let first = self.tree.children.len() as u32;
            self.tree.children.extend_from_slice(&list);
            self.tree.nodes.push(Node::Rule { name: rule.name, first, count: list.len() as u32 });
            list.clear();
            self.spare.push(list);
            Value::Node(self.tree.nodes.len() as u32 - 1)
        };
        self.values.push(value);
        let next = table.state(*self.states.last()?)?.goto(rule.origin)?;
        self.states.push(next);
        Some(next)
    }
}

enum Token {
    Some(u8, usize),
    Ignored(usize),
    End,
    No,
}
