//! The tables of the grammar: terminals, rules, lexers, LALR(1) states; from tables.txt, which grammar/export.py
//! writes. Opening them cuts the text into lines; an item is read when it is first used, for a small deck visits
//! a tenth of the states and a process lives for milliseconds.
//!
//! Sections, each opened by its name and its number of lines:
//!
//! ```text
//! terminals   name, `i` if it is ignored, its pattern
//! classes     characters: ASCII mask, the others
//! names       of trees; `_` for rules whose children go to the parent
//! rules       origin, name, `1` if a single child stands for it, what becomes of its symbols
//! lexers      terminals in the order in which they are tried; `w>k`: a w that k matches whole is a k
//! lookaheads  sets of terminals
//! states      lexer, `symbol:state` shifts and gotos, `lookahead@rule` reductions
//! starts      name, first state, last state
//! ```
//!
//! Symbols are numbered terminals first, then `$END`, then rules' origins.
use super::pattern::{Class, Others, Pattern};
use std::sync::OnceLock;

pub struct Terminal {
    pub name: &'static str,
    pub ignored: bool,
    pub pattern: Pattern,
}

/// What becomes of a symbol of a rule in the tree.
#[derive(Clone, Copy, PartialEq)]
pub enum Child {
    Keep,
    Drop,
    /// a rule without a name: its children take its place
    Inline,
}

pub struct Rule {
    pub origin: u16,
    /// into `Table::names`
    pub name: u16,
    /// the rule has no name of its own, its children go to its parent
    pub nameless: bool,
    pub single: bool,
    pub children: Vec<Child>,
}

pub struct Lexer {
    pub order: Vec<u8>,
    /// (word, keyword)
    pub unless: Vec<(u8, u8)>,
    /// only ignored terminals begin with a blank: between words there is nothing to find
    pub gap: bool,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Action {
    Error,
    Shift(u16),
    Reduce(u16),
}

pub struct State {
    pub lexer: usize,
    /// by terminal, `$END` the last
    actions: Vec<Action>,
    /// sorted by symbol
    gotos: Vec<(u16, u16)>,
}

impl State {
    #[inline]
    pub fn action(&self, terminal: usize) -> Action {
        self.actions.get(terminal).copied().unwrap_or(Action::Error)
    }

    #[inline]
    pub fn goto(&self, origin: u16) -> Option<u16> {
        self.gotos.binary_search_by_key(&origin, |g| g.0).ok().map(|k| self.gotos[k].1)
    }
}

/// Items that are read when they are first used; None for what is no such item.
struct Lazy<T> {
    lines: Vec<&'static str>,
    items: Vec<OnceLock<Option<T>>>,
}

impl<T> Lazy<T> {
    fn over(lines: Vec<&'static str>) -> Self {
        let items = lines.iter().map(|_| OnceLock::new()).collect();
        Lazy { lines, items }
    }

    #[inline]
    fn get(&self, k: usize, read: impl FnOnce(&'static str) -> Option<T>) -> Option<&T> {
        self.items.get(k)?.get_or_init(|| read(self.lines[k])).as_ref()
    }
}

pub struct Table {
    terminals: Lazy<Terminal>,
    pub classes: Vec<Class>,
    pub names: Vec<&'static str>,
    rules: Lazy<Rule>,
    lexers: Lazy<Lexer>,
    lookaheads: Vec<&'static str>,
    states: Lazy<State>,
    pub starts: Vec<(&'static str, u16, u16)>,
}

/// The tables of the grammar that this engine was built with.
pub fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    // a test opens the very same text and reads every item of it
    TABLE.get_or_init(|| Table::open(include_str!("tables.txt")).expect("the tables of the grammar"))
}

impl Table {
    /// None if the text is not such a table.
    pub fn open(text: &'static str) -> Option<Table> {
        let mut lines = text.lines();
        lines.next()?;
        let terminals = Lazy::over(section(&mut lines, "terminals")?);
        let classes = section(&mut lines, "classes")?.into_iter().map(read_class).collect::<Option<_>>()?;
        let names = section(&mut lines, "names")?;
        let rules = Lazy::over(section(&mut lines, "rules")?);
        let lexers = Lazy::over(section(&mut lines, "lexers")?);
        let lookaheads = section(&mut lines, "lookaheads")?;
        let states = Lazy::over(section(&mut lines, "states")?);
        let mut starts = Vec::new();
        for line in section(&mut lines, "starts")? {
            let mut words = line.split(' ');
            starts.push((words.next()?, words.next()?.parse().ok()?, words.next()?.parse().ok()?));
        }
        Some(Table { terminals, classes, names, rules, lexers, lookaheads, states, starts })
    }

    /// `$END`, as a terminal; the number of the others.
    pub fn end(&self) -> usize {
        self.terminals.lines.len()
    }

    pub fn terminal_names(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.terminals.lines.iter().map(|line| line.split(' ').next().unwrap_or(""))
    }

    pub fn start(&self, name: &str) -> Option<(u16, u16)> {
        self.starts.iter().find(|s| s.0 == name).map(|s| (s.1, s.2))
    }

    #[inline]
    pub fn terminal(&self, k: usize) -> Option<&Terminal> {
        self.terminals.get(k, |line| {
            let mut words = line.splitn(3, ' ');
            let (name, ignored) = (words.next()?, words.next()? == "i");
            Some(Terminal { name, ignored, pattern: Pattern::read(words.next()?, &self.classes)? })
        })
    }

    #[inline]
    pub fn rule(&self, k: usize) -> Option<&Rule> {
        self.rules.get(k, |line| {
            let mut words = line.split(' ');
            let (origin, name) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
            let nameless = *self.names.get(name as usize)? == "_";
            let single = words.next()? == "1";
            let child = |c| match c {
                'k' => Child::Keep,
                'i' => Child::Inline,
                _ => Child::Drop,
            };
            let children = words.next()?.chars().filter(|&c| c != '-').map(child).collect();
            Some(Rule { origin, name, nameless, single, children })
        })
    }

    #[inline]
    pub fn lexer(&self, k: usize) -> Option<&Lexer> {
        self.lexers.get(k, |line| {
            let mut lexer = Lexer { order: Vec::new(), unless: Vec::new(), gap: true };
            for word in line.split(' ') {
                match word.split_once('>') {
                    Some((word, keyword)) => lexer.unless.push((word.parse().ok()?, keyword.parse().ok()?)),
                    None => lexer.order.push(word.parse().ok()?),
                }
            }
            for &k in &lexer.order {
                let terminal = self.terminal(k as usize)?;
                lexer.gap &= terminal.ignored || terminal.pattern.first >> b' ' & 1 == 0;
            }
            Some(lexer)
        })
    }

    #[inline]
    pub fn state(&self, k: u16) -> Option<&State> {
        self.states.get(k as usize, |line| self.read_state(line))
    }

    fn read_state(&self, line: &'static str) -> Option<State> {
        let mut words = line.split(' ');
        let lexer = words.next()?.parse().ok()?;
        let mut state = State { lexer, actions: vec![Action::Error; self.end() + 1], gotos: Vec::new() };
        for word in words {
            if let Some((symbol, target)) = word.split_once(':') {
                let (symbol, target): (u16, u16) = (symbol.parse().ok()?, target.parse().ok()?);
                match state.actions.get_mut(symbol as usize) {
                    Some(action) => *action = Action::Shift(target),
                    None => state.gotos.push((symbol, target)),
                }
            } else {
                let (set, rule) = word.split_once('@')?;
                let rule = rule.parse().ok()?;
                for terminal in self.lookaheads.get(set.parse::<usize>().ok()?)?.split(' ') {
                    *state.actions.get_mut(terminal.parse::<usize>().ok()?)? = Action::Reduce(rule);
                }
            }
        }
        Some(state)
    }

    /// Every item can be read, and every number in it points at something.
    #[cfg(test)]
    pub fn is_sound(&self) -> bool {
        let terminal = |k: u8| self.terminal(k as usize).is_some();
        let state = |k: u16| self.state(k).is_some();
        let fits = |action: &Action| match *action {
            Action::Error => true,
            Action::Shift(next) => state(next),
            Action::Reduce(rule) => self.rule(rule as usize).is_some(),
        };
        self.end() < 255
            && (0..self.end()).all(|k| terminal(k as u8))
            && (0..self.rules.lines.len()).all(|k| self.rule(k).is_some())
            && (0..self.lexers.lines.len()).all(|k| {
                self.lexer(k).is_some_and(|l| {
                    l.order.iter().copied().all(terminal) && l.unless.iter().all(|&(w, k)| terminal(w) && terminal(k))
                })
            })
            && (0..self.states.lines.len() as u16).all(|k| {
                self.state(k).is_some_and(|s| {
                    self.lexer(s.lexer).is_some() && s.actions.iter().all(fits) && s.gotos.iter().all(|g| state(g.1))
                })
            })
            && self.starts.iter().all(|&(_, first, last)| state(first) && state(last))
    }
}

fn section(lines: &mut std::str::Lines<'static>, name: &str) -> Option<Vec<&'static str>> {
    let count: usize = lines.next()?.strip_prefix(name)?.trim().parse().ok()?;
    let found: Vec<_> = lines.take(count).collect();
    (found.len() == count).then_some(found)
}

fn read_class(line: &str) -> Option<Class> {
    let (mask, rest) = line.split_once(' ')?;
    let others = match rest.chars().next()? {
        '+' => Others::In,
        '-' => Others::Out,
        '?' => Others::Settled,
        _ => return None,
    };
    let ranges = rest[1..]
        .split(',')
        .filter(|r| !r.is_empty())
        .map(|r| {
            let (a, b) = r.split_once('-')?;
            Some((u32::from_str_radix(a, 16).ok()?, u32::from_str_radix(b, 16).ok()?))
        })
        .collect::<Option<_>>()?;
    Some(Class { ascii: u128::from_str_radix(mask, 16).ok()?, others, ranges })
}
