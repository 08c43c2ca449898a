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
use std::borrow::Cow;
use std::collections::hash_map::RandomState;
use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher};

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
    words: HashMap<String, Py<PyString>, Quick>,
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

    /// (rule, name, the words between, the last word, its value or None, place) of a card that is nothing but
    /// words; all in lower case.
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
        let children = tree.of(first, count);
        let word = |k: usize| match tree.nodes[children[k] as usize] {
            Node::Leaf { start, end, .. } => &text[start as usize..end as usize],
            Node::Rule { .. } => "",
        };
        let name_of_card = PyString::new(py, &lower(word(0)));
        let middle = 1..children.len() - 1;
        let nodes = PyList::new(py, middle.map(|k| known(py, &mut self.words, word(k))))?;
        let last = known(py, &mut self.words, word(children.len() - 1));
        let place = PyInt::new(py, (line.number as u64) << 40 | (line.indent as u64) << 20 | start as u64);
        let rule = trees.rules[name as usize].bind(py);
        let card = [rule.as_any(), name_of_card.as_any(), nodes.as_any(), last.as_any(), &value, place.as_any()];
        PyTuple::new(py, card).map(Some)
    }
}

fn lower(word: &str) -> Cow<'_, str> {
    if word.bytes().any(|b| b.is_ascii_uppercase()) {
        Cow::Owned(word.to_ascii_lowercase())
    } else {
        Cow::Borrowed(word)
    }
}

/// A word in lower case, as the string that was made for it before: most words of a deck are nodes.
fn known<'py>(py: Python<'py>, words: &mut HashMap<String, Py<PyString>, Quick>, word: &str) -> Bound<'py, PyString> {
    let word = lower(word);
    if let Some(known) = words.get(&*word) {
        return known.bind(py).clone();
    }
    let made = PyString::new(py, &word);
    if word.len() <= 40 {
        words.insert(word.into_owned(), made.clone().unbind());
    }
    made
}

/// FNV-1a with a seed of the process: the words are short.
#[derive(Clone)]
struct Quick(u64);

impl Default for Quick {
    fn default() -> Self {
        Quick(RandomState::new().build_hasher().finish())
    }
}

impl BuildHasher for Quick {
    type Hasher = QuickHasher;

    fn build_hasher(&self) -> QuickHasher {
        QuickHasher(self.0)
    }
}

struct QuickHasher(u64);

impl Hasher for QuickHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
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
    // brackets in brackets, as `MAX_NESTING` of mistakes.py, which says so to the user
    deepest > 100
}

/// Makes trees. `leaf`: the class of leaves; `plain`: rule -> (number of words, is the last one a number?) of the
/// cards that come as words; `handed_back`: first words of lines that are not read (machine cards, or elements by their marks).
#[pyclass(frozen)]
pub struct Trees {
    leaf: Py<PyType>,
    terminals: Vec<Py<PyString>>,
    rules: Vec<Py<PyString>>,
    /// by the number of the rule's name; 0 words: never
    plain: Vec<(u32, bool)>,
    handed_back: Vec<String>,
    /// the terminal WORD
    word: usize,
}

#[pymethods]
impl Trees {
    #[new]
    fn new(py: Python<'_>, leaf: Py<PyType>, plain: HashMap<String, (u32, bool)>, handed_back: Vec<String>) -> Self {
        let table = table();
        Trees {
            leaf,
            handed_back,
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

    /// A text's title, stray continuation lines, first .control, first card behind .end, the lines of .control sections, all as
    /// places, and its cards. A place is (line, column, start, end): the first two count from 1, the others from 0 in the text.
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
        let behind = found.behind.as_ref().map(&mut of_piece);
        let commands: Vec<Place> =
            found.commands.iter().map(|l| characters.place(whole, l.number, l.indent, l.start, l.end)).collect();
        let cards = Cards {
            trees: this.clone().unbind(),
            text: text.clone().unbind(),
            lines: found.cards.into_iter(),
            reader: Reader::default(),
            characters: Characters::of(whole),
        };
        (title, stray, control, behind, commands, cards).into_pyobject(this.py())
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
        let start = start_of(slice, &trees.handed_back);
        let read = !start.is_empty() && self.reader.parse(slice, start);
        if read {
            if let Some(plain) = self.reader.plain(py, trees, text, &line)? {
                return Ok(Some(plain));
            }
        }
        let place = self.characters.place(text, line.number, line.indent, line.start, line.end);
        if !read {
            return (py.None(), start, place, py.None(), py.None(), -1).into_pyobject(py).map(Some);
        }
        let tree = self.reader.objects(py, trees, slice)?;
        let tree = tree.cast::<PyTuple>()?;
        (tree.get_item(0)?, tree.get_item(1)?, place, py.None(), py.None(), -1).into_pyobject(py).map(Some)
    }
}

/// From which start a line is parsed; "" where it begins no card, or is handed back.
fn start_of(line: &str, handed_back: &[String]) -> &'static str {
    match line.as_bytes().first() {
        Some(b'.') => "dot",
        Some(first) if first.is_ascii_alphabetic() => {
            // a comment may follow without a blank
            let word = line.split(|c| c == ';' || lines::space(c)).next().unwrap_or("");
            if !word.is_ascii() || handed_back.iter().any(|card| word.eq_ignore_ascii_case(card)) {
                ""
            } else {
                "element"
            }
        }
        _ => "",
    }
}
