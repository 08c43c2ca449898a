//! Trees for Python: (rule, [children]), a leaf is Python's own `Leaf`, a str with its type and place.
//!
//! Places count characters, as Python does. A card that is nothing but words (the most frequent kind by far) comes
//! without a tree: its words in lower case and the value of the last one.
use crate::syntax::lines::{self, Line, Piece};
use crate::syntax::number;
use crate::syntax::parse::{Node, Parser, Tree};
use crate::syntax::table::table;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyString, PyTuple, PyType};
use std::collections::HashMap;

const MAX_NESTING: usize = 100;

/// Counts characters up to places that come in order.
struct Characters {
    ascii: bool,
    at: usize,
    count: usize,
}

/// Line and column from 1, start and end from 0 in the whole text.
type Place = (usize, usize, usize, usize);

impl Characters {
    fn of(text: &str) -> Self {
        Characters { ascii: text.is_ascii(), at: 0, count: 0 }
    }

    fn before(&mut self, text: &str, place: usize) -> usize {
        if self.ascii {
            return place;
        }
        if place < self.at {
            (self.at, self.count) = (0, 0);
        }
        self.count += text[self.at..place].chars().count();
        self.at = place;
        self.count
    }

    fn place(&mut self, text: &str, number: usize, indent: usize, start: usize, end: usize) -> Place {
        let col = 1 + text[start - indent..start].chars().count();
        (number, col, self.before(text, start), self.before(text, end))
    }
}

/// The parser, and words that it has made before.
#[derive(Default)]
struct Reader {
    parser: Parser,
    words: HashMap<String, Py<PyString>>,
}

impl Reader {
    fn parse(&mut self, text: &str, start: &str) -> bool {
        if too_deep(text) {
            return false;
        }
        let Some(start) = table().start(start) else { return false };
        self.parser.parse(table(), start, text)
    }

    /// The tree as Python objects, made in the order of the nodes: children before parents, no recursion.
    fn objects<'py>(&self, py: Python<'py>, trees: &Trees, text: &str) -> PyResult<Bound<'py, PyAny>> {
        let tree = &self.parser.tree;
        // leaves come in the order of the text
        let mut characters = Characters::of(text);
        let mut places = Vec::new();
        if !characters.ascii {
            places.extend(tree.nodes.iter().map(|node| match *node {
                Node::Leaf { start, end, .. } => {
                    (characters.before(text, start as usize), characters.before(text, end as usize))
                }
                Node::Rule { .. } => (0, 0),
            }));
        }
        let leaf = |k: usize, terminal: u8, start: usize, end: usize| -> PyResult<Bound<'py, PyAny>> {
            let leaf = trees.leaf.bind(py).call1((&text[start..end],))?;
            let (start, end) = places.get(k).copied().unwrap_or((start, end));
            leaf.setattr(intern!(py, "type"), &trees.terminals[terminal as usize])?;
            leaf.setattr(intern!(py, "start_pos"), start)?;
            leaf.setattr(intern!(py, "end_pos"), end)?;
            Ok(leaf)
        };
        let mut made: Vec<Option<Bound<'py, PyAny>>> = vec![None; tree.nodes.len()];
        for (k, node) in tree.nodes.iter().enumerate() {
            let Node::Rule { name, first, count } = *node else { continue };
            let children = PyList::empty(py);
            for &child in tree.of(first, count) {
                match (tree.nodes[child as usize], made[child as usize].take()) {
                    (Node::Leaf { terminal, start, end }, _) => {
                        children.append(leaf(child as usize, terminal, start as usize, end as usize)?)?;
                    }
                    (_, Some(inner)) => children.append(inner)?,
                    _ => {}
                }
            }
            made[k] =
                Some(PyTuple::new(py, [trees.rules[name as usize].bind(py).as_any(), children.as_any()])?.into_any());
        }
        let root = tree.root as usize;
        match (tree.nodes[root], made[root].take()) {
            (Node::Leaf { terminal, start, end }, _) => leaf(root, terminal, start as usize, end as usize),
            (_, Some(inner)) => Ok(inner),
            _ => Ok(py.None().into_bound(py)),
        }
    }

    /// (rule, words in lower case, the value of the last or None, place) of a card that is nothing but words.
    fn plain<'py>(
        &mut self,
        py: Python<'py>,
        trees: &Trees,
        whole: &str,
        line: &Line,
    ) -> PyResult<Option<Bound<'py, PyTuple>>> {
        let (tree, text) = (&self.parser.tree, &whole[line.start..line.end]);
        let Node::Rule { name, first, count } = tree.nodes[tree.root as usize] else { return Ok(None) };
        let (wanted, numeric) = trees.plain[name as usize];
        if count != wanted {
            return Ok(None);
        }
        let Some(last) = last_word(tree, first, count, trees.word) else { return Ok(None) };
        let (start, end) = last;
        let is_small = line.number < 1 << 22 && line.indent < 1 << 20 && start < 1 << 20;
        // places are counted in bytes here
        let before = &whole[line.start - line.indent..line.start];
        if !is_small || !before.is_ascii() || !text[..end].bytes().all(|b| b.is_ascii() && b != b'\n') {
            return Ok(None);
        }
        let value = match numeric.then(|| number::plain(&text[start..end])) {
            Some(Some(value)) => PyFloat::new(py, value).into_any(),
            Some(None) => return Ok(None),
            None => py.None().into_bound(py),
        };
        let words = PyList::empty(py);
        for (k, &child) in tree.of(first, count).iter().enumerate() {
            let Node::Leaf { start, end, .. } = tree.nodes[child as usize] else { return Ok(None) };
            let word = &text[start as usize..end as usize];
            let lower;
            let word = if word.bytes().any(|b| b.is_ascii_uppercase()) {
                lower = word.to_ascii_lowercase();
                &lower
            } else {
                word
            };
            if k == 0 || word.len() > 40 {
                words.append(PyString::new(py, word))?;
            } else if let Some(known) = self.words.get(word) {
                words.append(known)?;
            } else {
                let made = PyString::new(py, word);
                words.append(&made)?;
                self.words.insert(word.to_owned(), made.unbind());
            }
        }
        let place = PyInt::new(py, (line.number as u64) << 40 | (line.indent as u64) << 20 | start as u64);
        let rule = trees.rules[name as usize].bind(py);
        Ok(Some(PyTuple::new(py, [rule.as_any(), words.as_any(), &value, place.as_any()])?))
    }
}

/// Start and end of the last child, when all but the first are words and the first is no tree.
fn last_word(tree: &Tree, first: u32, count: u32, word: usize) -> Option<(usize, usize)> {
    let mut last = None;
    for (k, &child) in tree.of(first, count).iter().enumerate() {
        match tree.nodes[child as usize] {
            Node::Leaf { terminal, start, end } if k == 0 || terminal as usize == word => {
                last = (k > 0).then_some((start as usize, end as usize));
            }
            _ => return None,
        }
    }
    last
}

/// More brackets open than Python would recurse into: for syntax.py to refuse.
fn too_deep(text: &str) -> bool {
    let (mut depth, mut deepest) = (0usize, 0);
    for byte in text.bytes() {
        match byte {
            b'(' | b'{' => {
                depth += 1;
                deepest = deepest.max(depth);
            }
            b')' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    deepest > MAX_NESTING
}

/// Makes trees. `leaf`: the class of leaves; `plain`: rule -> (number of words, is the last one a number?) of the
/// cards that come as words.
#[pyclass(frozen)]
pub struct Trees {
    leaf: Py<PyType>,
    terminals: Vec<Py<PyString>>,
    rules: Vec<Py<PyString>>,
    /// by the number of the rule's name; 0 words: never
    plain: Vec<(u32, bool)>,
    /// the terminal WORD
    word: usize,
}

#[pymethods]
impl Trees {
    #[new]
    fn new(py: Python<'_>, leaf: Py<PyType>, plain: HashMap<String, (u32, bool)>) -> Self {
        let table = table();
        Trees {
            leaf,
            terminals: table.terminal_names().map(|n| PyString::new(py, n).unbind()).collect(),
            rules: table.names.iter().map(|n| PyString::new(py, n).unbind()).collect(),
            word: table.terminal_names().position(|n| n == "WORD").unwrap_or(usize::MAX),
            plain: table.names.iter().map(|n| plain.get(*n).copied().unwrap_or((0, false))).collect(),
        }
    }

    /// The tree of one line, or None: then Lark has to say what is the matter.
    fn line<'py>(&self, py: Python<'py>, text: &str, start: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let mut reader = Reader::default();
        if !reader.parse(text, start) {
            return Ok(None);
        }
        reader.objects(py, self, text).map(Some)
    }

    /// A text's title, stray continuation lines, first .control, the lines of .control sections as places, and its
    /// cards. A place is (line, column, start, end): the first two count from 1, the others from 0 in the text.
    fn cards<'py>(
        this: &Bound<'py, Self>,
        text: &Bound<'py, PyString>,
        has_title: bool,
        skip_empty: bool,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let whole = text.to_str()?;
        let found = lines::cut(whole, has_title, skip_empty);
        let mut characters = Characters::of(whole);
        let mut of_piece = |p: &Piece| {
            let begin = whole[..p.start].rfind('\n').map_or(0, |k| k + 1);
            characters.place(whole, p.number, p.start - begin, p.start, p.end)
        };
        let title = found.title.as_ref().map(&mut of_piece);
        let stray: Vec<Place> = found.stray.iter().map(&mut of_piece).collect();
        let control = found.control.as_ref().map(&mut of_piece);
        let commands: Vec<Place> =
            found.commands.iter().map(|l| characters.place(whole, l.number, l.indent, l.start, l.end)).collect();
        let cards = Cards {
            trees: this.clone().unbind(),
            text: text.clone().unbind(),
            lines: found.cards.into_iter(),
            reader: Reader::default(),
            characters: Characters::of(whole),
        };
        (title, stray, control, commands, cards).into_pyobject(this.py())
    }
}

/// The cards of a text, one after the other.
#[pyclass]
pub struct Cards {
    trees: Py<Trees>,
    text: Py<PyString>,
    lines: std::vec::IntoIter<Line>,
    reader: Reader,
    characters: Characters,
}

#[pymethods]
impl Cards {
    fn __iter__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyTuple>>> {
        let Some(line) = self.lines.next() else { return Ok(None) };
        let (trees, text) = (self.trees.get(), self.text.bind(py).to_str()?);
        let slice = &text[line.start..line.end];
        let start = start_of(slice);
        let read = !start.is_empty() && self.reader.parse(slice, start);
        if read {
            if let Some(plain) = self.reader.plain(py, trees, text, &line)? {
                return Ok(Some(plain));
            }
        }
        let place = self.characters.place(text, line.number, line.indent, line.start, line.end);
        if !read {
            return (py.None(), start, place, -1).into_pyobject(py).map(Some);
        }
        let tree = self.reader.objects(py, trees, slice)?;
        let tree = tree.cast::<PyTuple>()?;
        (tree.get_item(0)?, tree.get_item(1)?, place, -1).into_pyobject(py).map(Some)
    }
}

/// From which start a line is parsed; "" where it begins no card, or not clearly one.
fn start_of(line: &str) -> &'static str {
    match line.as_bytes().first() {
        Some(b'.') => "dot",
        Some(first) if first.is_ascii_alphabetic() => {
            let word = line.split(lines::space).next().unwrap_or("");
            if !word.is_ascii() {
                ""
            } else if table().cards.iter().any(|card| word.eq_ignore_ascii_case(card)) {
                "card"
            } else {
                "element"
            }
        }
        _ => "",
    }
}
