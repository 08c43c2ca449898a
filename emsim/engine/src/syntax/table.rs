//! The tables of the grammar: terminals, rules, lexers, LALR(1) states; read from tables.txt, which
//! grammar/export.py writes. Reading takes about a third of a millisecond, once a process.
//!
//! Sections, each opened by its name and its number of lines:
//!
//!     terminals   name, `i` if it is ignored, its pattern
//!     classes     characters: ASCII mask, the others
//!     rules       origin, number of symbols, name of the tree, `1` if a single child stands for it, children
//!     lexers      terminals in the order in which they are tried; `w>k`: a w that k matches whole is a k
//!     lookaheads  sets of terminals
//!     states      lexer, `symbol:state` shifts and gotos, `lookahead@rule` reductions
//!     starts      name, first state, last state
//!     cards       the words that begin a machine card
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
    pub name: u16,
    /// the rule has no name of its own, its children go to its parent
    pub nameless: bool,
    pub single: bool,
    pub children: Vec<Child>,
}

#[derive(Default)]
pub struct Lexer {
    pub order: Vec<u8>,
    /// (word, keyword)
    pub unless: Vec<(u8, u8)>,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Action {
    Error,
    Shift(u16),
    Reduce(u16),
}

#[derive(Default)]
pub struct State {
    pub lexer: u16,
    /// sorted by symbol
    gotos: Vec<(u16, u16)>,
}

pub struct Table {
    pub terminals: Vec<Terminal>,
    pub classes: Vec<Class>,
    pub rules: Vec<Rule>,
    /// names of trees
    pub names: Vec<&'static str>,
    pub lexers: Vec<Lexer>,
    pub states: Vec<State>,
    /// states x (terminals and $END): 0 error, n shift to n - 1, REDUCE + rule
    actions: Vec<u16>,
    width: usize,
    pub starts: Vec<(&'static str, u16, u16)>,
    pub cards: Vec<&'static str>,
}

const REDUCE: u16 = 0x8000;

/// The tables of the grammar that this engine was built with.
pub fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    // a test reads the very same text; it cannot fail later
    TABLE.get_or_init(|| Table::read(include_str!("tables.txt")).expect("the tables of the grammar"))
}

impl Table {
    /// None if the text is not such a table.
    pub fn read(text: &'static str) -> Option<Table> {
        let mut lines = text.lines();
        lines.next()?;
        let terminal_lines = section(&mut lines, "terminals")?;
        let classes: Vec<Class> = section(&mut lines, "classes")?.into_iter().map(read_class).collect::<Option<_>>()?;
        let terminals: Vec<Terminal> =
            terminal_lines.into_iter().map(|l| read_terminal(l, &classes)).collect::<Option<_>>()?;
        let width = terminals.len() + 1;
        let mut names = Vec::new();
        let rules: Vec<Rule> =
            section(&mut lines, "rules")?.into_iter().map(|l| read_rule(l, &mut names)).collect::<Option<_>>()?;
        let lexers = section(&mut lines, "lexers")?.into_iter().map(read_lexer).collect::<Option<_>>()?;
        let lookaheads: Vec<Vec<usize>> = section(&mut lines, "lookaheads")?
            .into_iter()
            .map(|l| l.split(' ').map(|w| w.parse().ok()).collect::<Option<_>>())
            .collect::<Option<_>>()?;
        let state_lines = section(&mut lines, "states")?;
        let mut table = Table {
            actions: vec![0; state_lines.len() * width],
            states: Vec::with_capacity(state_lines.len()),
            terminals,
            classes,
            rules,
            names,
            lexers,
            width,
            starts: Vec::new(),
            cards: Vec::new(),
        };
        for (k, line) in state_lines.into_iter().enumerate() {
            let state = table.read_state(k, line, &lookaheads)?;
            table.states.push(state);
        }
        for line in section(&mut lines, "starts")? {
            let mut words = line.split(' ');
            table.starts.push((words.next()?, words.next()?.parse().ok()?, words.next()?.parse().ok()?));
        }
        table.cards = section(&mut lines, "cards")?;
        table.is_sound().then_some(table)
    }

    fn read_state(&mut self, k: usize, line: &str, lookaheads: &[Vec<usize>]) -> Option<State> {
        let mut words = line.split(' ');
        let mut state = State { lexer: words.next()?.parse().ok()?, gotos: Vec::new() };
        for word in words {
            if let Some((symbol, target)) = word.split_once(':') {
                let (symbol, target): (usize, u16) = (symbol.parse().ok()?, target.parse().ok()?);
                if symbol < self.width {
                    self.actions[k * self.width + symbol] = target + 1;
                } else {
                    state.gotos.push((symbol as u16, target));
                }
            } else {
                let (set, rule) = word.split_once('@')?;
                let rule: u16 = rule.parse().ok()?;
                for &terminal in lookaheads.get(set.parse::<usize>().ok()?)? {
                    *self.actions.get_mut(k * self.width + terminal)? = REDUCE + rule;
                }
            }
        }
        Some(state)
    }

    /// Every number points at something.
    fn is_sound(&self) -> bool {
        let states = self.states.len() as u16;
        let terminals = self.terminals.len();
        let action_fits = |&a: &u16| {
            if a >= REDUCE {
                ((a - REDUCE) as usize) < self.rules.len()
            } else {
                a <= states
            }
        };
        self.width < 256
            && self.actions.iter().all(action_fits)
            && self
                .states
                .iter()
                .all(|s| (s.lexer as usize) < self.lexers.len() && s.gotos.iter().all(|&(_, target)| target < states))
            && self.lexers.iter().all(|l| {
                l.order.iter().chain(l.unless.iter().flat_map(|(a, b)| [a, b])).all(|&t| (t as usize) < terminals)
            })
            && self.starts.iter().all(|&(_, first, last)| first < states && last < states)
    }

    /// `$END`, as a terminal.
    pub fn end(&self) -> usize {
        self.terminals.len()
    }

    #[inline]
    pub fn action(&self, state: u16, terminal: usize) -> Action {
        match self.actions[state as usize * self.width + terminal] {
            0 => Action::Error,
            a if a >= REDUCE => Action::Reduce(a - REDUCE),
            a => Action::Shift(a - 1),
        }
    }

    #[inline]
    pub fn goto(&self, state: u16, origin: u16) -> Option<u16> {
        let gotos = &self.states[state as usize].gotos;
        gotos.binary_search_by_key(&origin, |g| g.0).ok().map(|k| gotos[k].1)
    }

    pub fn start(&self, name: &str) -> Option<(u16, u16)> {
        self.starts.iter().find(|s| s.0 == name).map(|s| (s.1, s.2))
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

fn read_terminal(line: &'static str, classes: &[Class]) -> Option<Terminal> {
    let mut words = line.splitn(3, ' ');
    let (name, ignored) = (words.next()?, words.next()? == "i");
    Some(Terminal { name, ignored, pattern: Pattern::read(words.next()?, classes)? })
}

fn read_rule(line: &'static str, names: &mut Vec<&'static str>) -> Option<Rule> {
    let words: Vec<&str> = line.split(' ').collect();
    let [origin, size, name, single, children] = words[..] else { return None };
    let children: Vec<Child> = children
        .chars()
        .filter_map(|c| match c {
            'k' => Some(Child::Keep),
            'x' => Some(Child::Drop),
            'i' => Some(Child::Inline),
            _ => None,
        })
        .collect();
    if children.len() != size.parse::<usize>().ok()? {
        return None;
    }
    let number = names.iter().position(|n| *n == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    });
    Some(Rule {
        origin: origin.parse().ok()?,
        name: number as u16,
        nameless: name.starts_with('_'),
        single: single == "1",
        children,
    })
}

fn read_lexer(line: &str) -> Option<Lexer> {
    let mut lexer = Lexer::default();
    for word in line.split(' ') {
        match word.split_once('>') {
            Some((word, keyword)) => lexer.unless.push((word.parse().ok()?, keyword.parse().ok()?)),
            None => lexer.order.push(word.parse().ok()?),
        }
    }
    Some(lexer)
}
