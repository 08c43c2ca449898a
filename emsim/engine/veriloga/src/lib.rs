//! Verilog-A modules: from their text to expressions of branch voltages, which a class of devices runs (devices/).
//!
//!   text -> tokens (source) -> tree, names resolved (tree, declare, body, ast) -> expressions for given parameters (elaborate, evaluate, execute)
//!
//! `Library::parse` reads a text, `Module::describe` tells what a module can be given, `Module::fold` what it comes to.
#![cfg_attr(target_family = "wasm", allow(dead_code, unused_imports, unused_variables))]
mod ast;
mod body;
mod declare;
mod elaborate;
mod evaluate;
mod events;
mod execute;
pub mod folded;
mod functions;
mod generate;
mod looped;
mod memory;
mod operators;
mod random;
mod reached;
mod sampled;
mod slew;
mod source;
mod table;
mod timer;
mod transition;
mod tree;

#[cfg(test)]
mod tests;

use emsim_expr::interrupt;
pub use folded::{Description, Folded};
use source::Sources;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::Arc;

/// What is wrong, and where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Message {
    pub text: String,
    pub file: String,
    /// from 1; the column counts characters
    pub line: usize,
    pub column: usize,
    pub length: usize,
    /// the text of the line
    pub source: String,
    pub hint: String,
    /// The macros through which the place came, the innermost first: name, file, line, column of its use.
    pub through: Vec<(String, String, usize, usize)>,
}

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    Text(String),
    Numbers(Vec<f64>),
}

/// What one instance is given. Names that are spelled as in the module come first, then those that differ in case alone.
#[derive(Clone, Debug)]
pub struct Given {
    /// of the .model, which many instances share
    pub model: Arc<HashMap<String, Value>>,
    /// of the element's line: they come before those of the model
    pub instance: HashMap<String, Value>,
    /// [K]
    pub temperature: f64,
    /// [K]
    pub tnom: f64,
    /// what $mfactor reads; flows are not multiplied by it
    pub multiplier: f64,
    /// How many of the terminals are connected.
    pub connected: usize,
}

impl Default for Given {
    fn default() -> Self {
        let (model, instance) = (Arc::default(), HashMap::new());
        Given { model, instance, temperature: 300.15, tnom: 300.15, multiplier: 1.0, connected: usize::MAX }
    }
}

impl PartialEq for Given {
    fn eq(&self, other: &Given) -> bool {
        let rest = |g: &Given| (g.temperature, g.tnom, g.multiplier, g.connected);
        rest(self) == rest(other)
            && self.instance == other.instance
            && (Arc::ptr_eq(&self.model, &other.model) || self.model == other.model)
    }
}

/// The modules of a text.
#[derive(Default)]
pub struct Library {
    sources: Sources,
    natures: Vec<ast::Nature>,
    disciplines: Vec<ast::Discipline>,
    modules: Vec<ast::Module>,
    expressions: Vec<ast::Expression>,
    expression_places: Vec<source::Place>,
    statements: Vec<ast::Statement>,
    statement_places: Vec<source::Place>,
    depth: u32,
}

impl Library {
    /// Reads a text. `name` is what messages call it; what it includes is looked for in its folder, then in `folders`.
    pub fn parse(
        text: &str,
        name: &str,
        folders: &[PathBuf],
        defines: &[(String, String)],
    ) -> Result<Library, Vec<Message>> {
        deep(|| {
            let (sources, tokens) = source::tokens(text, name, folders, defines).map_err(|m| vec![*m])?;
            let mut library = Library { sources, ..Library::default() };
            library.depth = tree::read(&mut library, &tokens)?;
            Ok(library)
        })
    }

    /// Reads a file.
    pub fn read(path: &Path, folders: &[PathBuf], defines: &[(String, String)]) -> Result<Library, Vec<Message>> {
        let name = path.display().to_string();
        let text =
            source::read(path).map_err(|text| vec![Message { text, file: name.clone(), ..Message::default() }])?;
        Library::parse(&text, &name, folders, defines)
    }

    /// Every module and paramset, in the order of the text.
    pub fn modules(&self) -> impl Iterator<Item = Module<'_>> {
        (0..self.modules.len()).map(|index| Module { library: self, index })
    }

    pub fn module(&self, name: &str) -> Option<Module<'_>> {
        self.modules().find(|m| m.name() == name)
    }

    /// Every file that was read, the text itself first.
    pub fn files(&self) -> Vec<String> {
        self.sources.files()
    }
}

#[derive(Clone, Copy)]
pub struct Module<'a> {
    library: &'a Library,
    index: usize,
}

impl Module<'_> {
    pub fn name(&self) -> &str {
        self.library.sources.word(self.library.modules[self.index].name)
    }

    /// Terminals, parameters with units and meanings.
    pub fn describe(&self) -> Description {
        elaborate::describe(self.library, self.index)
    }

    /// An instance as expressions of its branch voltages. Of paramsets of one name it is the first whose ranges hold what is given.
    pub fn fold(&self, given: &Given) -> Result<Folded, Vec<Message>> {
        deep(|| elaborate::fold(self.library, self.index, given)).map_err(|m| vec![*m])
    }
}

/// Where no threads are there is the room that there is.
#[cfg(target_family = "wasm")]
fn deep<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Trees are read by what calls itself: where there is room for that. The token of interrupts is asked for meanwhile.
#[cfg(not(target_family = "wasm"))]
fn deep<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let (ends, ended) = std::sync::mpsc::channel::<()>();
        let run = move || {
            let _ends = ends; // closed when it goes, by unwinding too
            interrupt::beside(work)
        };
        let worker = std::thread::Builder::new().stack_size(256 << 20).spawn_scoped(scope, run);
        let worker = worker.unwrap_or_else(|e| panic!("no thread can be started: {e}"));
        while ended.recv_timeout(interrupt::PATIENCE) == Err(RecvTimeoutError::Timeout) {
            interrupt::asked();
        }
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The string between quotes.
fn unquote(text: &str) -> String {
    let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text);
    let mut out = String::with_capacity(inner.len());
    let mut characters = inner.chars();
    while let Some(c) = characters.next() {
        match (c, c == '\\') {
            (_, false) => out.push(c),
            _ => match characters.next() {
                Some('n') => out.push('\n'),
                Some('t') => out.push('\t'),
                Some('\n') | None => {}
                Some(other) => out.push(other),
            },
        }
    }
    out
}

/// The known word that a wrong one is nearest to, if it is near.
fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let distance = |a: &[u8], b: &[u8]| {
        let mut row: Vec<usize> = (0..=b.len()).collect();
        for (i, x) in a.iter().enumerate() {
            let mut corner = row[0];
            row[0] = i + 1;
            for (j, y) in b.iter().enumerate() {
                let cost = if x == y {
                    0
                } else if x.eq_ignore_ascii_case(y) {
                    // a letter in the other case is hardly a mistake
                    0
                } else {
                    1
                };
                let next = (corner + cost).min(row[j] + 1).min(row[j + 1] + 1);
                corner = row[j + 1];
                row[j + 1] = next;
            }
        }
        row[b.len()]
    };
    let most = match word.len() {
        0..=2 => 0,
        3..=5 => 1,
        _ => 2,
    };
    known
        .filter(|k| k.len().abs_diff(word.len()) <= most && word.len() < 60 && *k != word)
        .map(|k| (distance(word.as_bytes(), k.as_bytes()), k))
        .filter(|d| d.0 <= most)
        .min()
        .map(|d| d.1.to_string())
}
