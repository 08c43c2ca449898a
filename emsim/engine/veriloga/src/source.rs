//! From text to tokens: files, `include, macros, conditions of compilation. Every token knows where it stands in its file and through
//! which macros it came.
use super::Message;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A number for a word; `Sources::word` gives the text.
pub type Word = u32;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Name,
    System, // $name
    Number,
    Text,
    Operator,
    Macro, // `name
}

/// Where a token stands: bytes of a file; `call` counts from 1 in `Sources::calls`, 0 is none.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Place {
    pub file: u32,
    pub start: u32,
    pub length: u32,
    pub call: u32,
}

#[derive(Clone, Copy, Debug)]
pub struct Token {
    pub kind: Kind,
    pub word: Word,
    pub at: Place,
}

struct File {
    name: String,
    text: Arc<str>,
}

/// A macro's name where it was used.
struct Call {
    name: Word,
    at: Place,
}

/// The texts that were read, for messages.
#[derive(Default)]
pub struct Sources {
    files: Vec<File>,
    calls: Vec<Call>,
    words: Vec<Arc<str>>,
    known: HashMap<Arc<str>, Word>,
}

impl Sources {
    pub fn word(&self, word: Word) -> &str {
        &self.words[word as usize]
    }

    pub fn intern(&mut self, text: &str) -> Word {
        if let Some(&word) = self.known.get(text) {
            return word;
        }
        let text: Arc<str> = text.into();
        self.words.push(text.clone());
        self.known.insert(text, self.words.len() as Word - 1);
        self.words.len() as Word - 1
    }

    /// The names of all files but the definitions that were given.
    pub fn files(&self) -> Vec<String> {
        self.files.iter().skip(1).map(|f| f.name.clone()).collect()
    }

    /// (file, line, column) of a place, both from 1, the column in characters.
    fn position(&self, at: Place) -> (&File, usize, usize, &str) {
        let file = &self.files[at.file as usize];
        let before = &file.text[..at.start as usize];
        let begin = before.rfind('\n').map_or(0, |k| k + 1);
        let line = file.text[begin..].split('\n').next().unwrap_or("").trim_end_matches('\r');
        (file, before.matches('\n').count() + 1, before[begin..].chars().count() + 1, line)
    }

    pub fn message(&self, at: Place, text: impl Into<String>, hint: impl Into<String>) -> Message {
        let (file, line, column, source) = self.position(at);
        let end = (at.start + at.length) as usize;
        let length = file.text[at.start as usize..end].split('\n').next().map_or(1, |t| t.chars().count().max(1));
        let mut through = Vec::new();
        let mut call = at.call;
        while call > 0 && through.len() < 20 {
            let Call { name, at } = &self.calls[call as usize - 1];
            let (file, line, column, _) = self.position(*at);
            through.push((self.word(*name).to_string(), file.name.clone(), line, column));
            call = at.call;
        }
        Message {
            text: text.into(),
            file: file.name.clone(),
            line,
            column,
            length,
            source: source.to_string(),
            hint: hint.into(),
            through,
        }
    }
}

/// Files whose text is part of the engine, found behind all folders.
const OWN: &[(&str, &str)] = &[
    ("constants.vams", include_str!("../../../devices/constants.vams")),
    ("disciplines.vams", include_str!("../../../devices/disciplines.vams")),
    ("constants.h", include_str!("../../../devices/constants.vams")),
    ("discipline.h", include_str!("../../../devices/disciplines.vams")),
    ("disciplines.h", include_str!("../../../devices/disciplines.vams")),
];

const OPERATORS: &[&str] = &[
    "<<<", ">>>", "<+", "<=", "<<", ">=", ">>", "==", "!=", "&&", "||", "**", "(*", "*)", "~^", "^~", "+", "-", "*",
    "/", "%", "<", ">", "!", "&", "|", "^", "~", "?", ":", ";", ",", ".", "(", ")", "[", "]", "{", "}", "#", "@", "=",
    "'",
];

// a text that asks for more is not a model
const MOST_TOKENS: usize = 4_000_000;
const MOST_CALLS: usize = 1_000_000;
const DEEPEST: usize = 100;
const MOST_FILES: usize = 500;
const MOST_BYTES: u64 = 16 << 20;

struct Macro {
    /// with what they are where nothing is given
    parameters: Option<Vec<(Word, Option<Vec<Token>>)>>,
    body: Vec<Token>,
}

/// One `ifdef: is its text wanted, was any of its parts, did `else come.
struct Condition {
    active: bool,
    done: bool,
    last: bool,
    at: Place,
}

/// Where tokens come from.
enum Feed<'t> {
    Text { file: u32, text: Arc<str>, at: usize },
    Tokens(std::slice::Iter<'t, Token>),
}

pub struct Preprocessor<'a> {
    sources: Sources,
    folders: &'a [PathBuf],
    macros: HashMap<Word, Arc<Macro>>,
    conditions: Vec<Condition>,
    open: Vec<Word>,
    depth: usize,
    out: Vec<Token>,
}

/// The tokens of a text. `name` is what messages call it; its folder is looked in first.
pub fn tokens(
    text: &str,
    name: &str,
    folders: &[PathBuf],
    defines: &[(String, String)],
) -> Result<(Sources, Vec<Token>), Box<Message>> {
    let mut own: Vec<PathBuf> = Vec::new();
    if let Some(folder) = Path::new(name).parent() {
        own.push(if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder.to_path_buf() });
    }
    own.extend(folders.iter().cloned());
    let mut reader = Preprocessor {
        sources: Sources::default(),
        folders: &own,
        macros: HashMap::new(),
        conditions: Vec::new(),
        open: Vec::new(),
        depth: 0,
        out: Vec::new(),
    };
    let given = [("__VAMS_ENABLE__", "1"), ("__VAMS_COMPACT_MODELING__", "1")];
    let given = given.iter().map(|&(a, b)| (a.to_string(), b.to_string()));
    let lines: String = given.chain(defines.iter().cloned()).map(|(a, b)| format!("`define {a} {b}\n")).collect();
    reader.file("<given>", &lines)?;
    reader.file(name, text)?;
    Ok((reader.sources, reader.out))
}

impl Preprocessor<'_> {
    fn error<T>(&self, at: Place, text: impl Into<String>, hint: impl Into<String>) -> Result<T, Box<Message>> {
        Err(Box::new(self.sources.message(at, text, hint)))
    }

    fn file(&mut self, name: &str, text: &str) -> Result<(), Box<Message>> {
        let text: Arc<str> = text.into();
        self.sources.files.push(File { name: name.to_string(), text: text.clone() });
        let file = self.sources.files.len() as u32 - 1;
        let before = self.conditions.len();
        self.run(&mut Feed::Text { file, text, at: 0 })?;
        if self.conditions.len() > before {
            let at = self.conditions[self.conditions.len() - 1].at;
            return self.error(at, "this condition has no `endif", "close it with `endif in the same file");
        }
        Ok(())
    }

    fn active(&self) -> bool {
        self.conditions.iter().all(|c| c.active)
    }

    fn run(&mut self, feed: &mut Feed) -> Result<(), Box<Message>> {
        while let Some(token) = self.next(feed)? {
            if token.kind == Kind::Macro {
                self.directive(token, feed)?;
            } else if self.active() {
                if self.out.len() >= MOST_TOKENS {
                    return self.error(token.at, "the text grows without end", "a macro multiplies itself");
                }
                self.out.push(token);
            }
        }
        Ok(())
    }

    fn next(&mut self, feed: &mut Feed) -> Result<Option<Token>, Box<Message>> {
        match feed {
            Feed::Tokens(tokens) => Ok(tokens.next().copied()),
            Feed::Text { file, text, at } => {
                let found = self.cut(*file, text, *at, text.len())?;
                Ok(found.map(|(token, end)| {
                    *at = end;
                    token
                }))
            }
        }
    }

    /// Where the first token at or behind a place begins: behind blanks, comments and line ends that a backslash takes away.
    fn after_blanks(&self, file: u32, text: &str, mut at: usize) -> Result<Option<usize>, Box<Message>> {
        let bytes = text.as_bytes();
        loop {
            match bytes.get(at) {
                None => return Ok(None),
                Some(b) if b.is_ascii_whitespace() => at += 1,
                Some(b'/') if bytes.get(at + 1) == Some(&b'/') => {
                    at += bytes[at..].iter().take_while(|&&b| b != b'\n').count();
                }
                Some(b'/') if bytes.get(at + 1) == Some(&b'*') => match text[at + 2..].find("*/") {
                    Some(k) => at += k + 4,
                    None => {
                        let place = Place { file, start: at as u32, length: 2, call: 0 };
                        return self.error(place, "this comment has no end", "close it with */");
                    }
                },
                // a line that goes on
                Some(b'\\') if text[at + 1..].trim_start_matches([' ', '\t', '\r']).starts_with('\n') => at += 1,
                Some(_) => return Ok(Some(at)),
            }
        }
    }

    /// The token at or behind a place, and where it ends. What conditions leave out may hold anything.
    fn cut(&mut self, file: u32, text: &str, from: usize, to: usize) -> Result<Option<(Token, usize)>, Box<Message>> {
        let bytes = &text.as_bytes()[..to];
        let mut from = from;
        let found = 'again: loop {
            let Some(start) = self.after_blanks(file, &text[..to], from)? else { return Ok(None) };
            let mut at = start;
            let word_end = |k: usize| k + bytes[k..].iter().take_while(|&&b| is_word(b)).count();
            let first = bytes[at];
            let place = |end: usize| Place { file, start: start as u32, length: (end - start) as u32, call: 0 };
            let (kind, end) = match first {
                b'a'..=b'z' | b'A'..=b'Z' | b'_' => (Kind::Name, word_end(at)),
                b'\\' => {
                    let end = start + bytes[start..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
                    let word = self.sources.intern(&text[start + 1..end]);
                    return Ok(Some((Token { kind: Kind::Name, word, at: place(end) }, end)));
                }
                b'$' => (Kind::System, word_end(at + 1)),
                b'`' => {
                    let end = word_end(at + 1);
                    if end == at + 1 {
                        if !self.active() {
                            from = end;
                            continue 'again;
                        }
                        return self.error(place(end), "a macro's name is missing behind `", "");
                    }
                    (Kind::Macro, end)
                }
                b'0'..=b'9' => (Kind::Number, number_end(bytes, at)),
                b'.' if bytes.get(at + 1).is_some_and(u8::is_ascii_digit) => (Kind::Number, number_end(bytes, at)),
                b'"' => {
                    at += 1;
                    while at < to && bytes[at] != b'"' && bytes[at] != b'\n' {
                        at += if bytes[at] == b'\\' { 2 } else { 1 };
                    }
                    if at >= to || bytes[at] != b'"' {
                        if !self.active() {
                            from = start + 1;
                            continue 'again;
                        }
                        return self.error(place(start + 1), "this string has no end on its line", "close it with \"");
                    }
                    (Kind::Text, at + 1)
                }
                _ => match OPERATORS.iter().find(|o| bytes[at..].starts_with(o.as_bytes())) {
                    Some(o) => (Kind::Operator, at + o.len()),
                    None => {
                        let end = at + text[at..].chars().next().map_or(1, char::len_utf8);
                        if !self.active() {
                            from = end;
                            continue 'again;
                        }
                        let what = format!("the character {:?} means nothing in Verilog-A", &text[at..end]);
                        return self.error(place(end), what, "");
                    }
                },
            };
            if kind == Kind::Number && bytes.get(end).is_some_and(|&b| is_word(b)) && self.active() {
                let whole = word_end(end);
                let what = format!("{} is no number", &text[start..whole]);
                return self.error(
                    place(whole),
                    what,
                    "scale factors are one of T G M K k m u n p f a, units are not written",
                );
            }
            let word = self.sources.intern(&text[start..end]);
            break Token { kind, word, at: place(end) };
        };
        let end = (found.at.start + found.at.length) as usize;
        Ok(Some((found, end)))
    }

    fn directive(&mut self, token: Token, feed: &mut Feed) -> Result<(), Box<Message>> {
        let name = self.sources.word(token.word)[1..].to_string();
        let at = token.at;
        match name.as_str() {
            "ifdef" | "ifndef" => {
                let wanted = self.name(feed, at)?;
                let active = self.macros.contains_key(&wanted) == (name == "ifdef");
                if self.conditions.len() >= 10 * DEEPEST {
                    return self.error(at, "conditions are nested too deeply", "");
                }
                self.conditions.push(Condition { active, done: active, last: false, at });
                return Ok(());
            }
            "else" | "elsif" => {
                let holds = if name == "else" {
                    true
                } else {
                    let wanted = self.name(feed, at)?;
                    self.macros.contains_key(&wanted)
                };
                match self.conditions.last_mut() {
                    Some(c) if !c.last => {
                        c.active = holds && !c.done;
                        c.done |= c.active;
                        c.last = name == "else";
                        return Ok(());
                    }
                    _ => {
                        return self.error(
                            at,
                            format!("`{name} without its `ifdef"),
                            "take it out, or open with `ifdef",
                        )
                    }
                }
            }
            "endif" => {
                return match self.conditions.pop() {
                    Some(_) => Ok(()),
                    None => self.error(at, "`endif without its `ifdef", "take it out, or open with `ifdef"),
                }
            }
            _ if !self.active() => return Ok(()),
            "define" => return self.define(at, feed),
            "undef" => {
                let name = self.name(feed, at)?;
                self.macros.remove(&name);
                return Ok(());
            }
            "include" => return self.include(at, feed),
            "resetall" | "celldefine" | "endcelldefine" | "nounconnected_drive" | "end_keywords" => return Ok(()),
            "timescale" | "default_discipline" | "default_nettype" | "default_transition" | "begin_keywords"
            | "pragma" | "unconnected_drive" | "line" => {
                if let Feed::Text { text, at, .. } = feed {
                    *at = text[*at..].find('\n').map_or(text.len(), |k| *at + k);
                }
                return Ok(());
            }
            "__LINE__" => {
                let line = self.sources.position(at).1.to_string();
                let word = self.sources.intern(&line);
                self.out.push(Token { kind: Kind::Number, word, at });
                return Ok(());
            }
            "__FILE__" => {
                let file = format!("{:?}", self.sources.position(at).0.name);
                let word = self.sources.intern(&file);
                self.out.push(Token { kind: Kind::Text, word, at });
                return Ok(());
            }
            _ => {}
        }
        self.expand(token, &name, feed)
    }

    /// The name behind a directive.
    fn name(&mut self, feed: &mut Feed, at: Place) -> Result<Word, Box<Message>> {
        match self.next(feed)? {
            Some(token) if token.kind == Kind::Name => Ok(token.word),
            _ if !self.active() => Ok(Word::MAX),
            Some(token) => self.error(token.at, "a macro's name is expected here", "names are written without `"),
            None => self.error(at, "a macro's name is missing", ""),
        }
    }

    fn define(&mut self, at: Place, feed: &mut Feed) -> Result<(), Box<Message>> {
        let Feed::Text { file, text, at: from } = feed else {
            return self.error(at, "a macro cannot define another", "write the `define outside");
        };
        // to the end of the line that does not go on; comments end lines too
        let (file, text, bytes) = (*file, text.clone(), text.as_bytes());
        let mut end = *from;
        while end < text.len() {
            match bytes[end] {
                b'\n' if !text[*from..end].trim_end_matches([' ', '\t', '\r']).ends_with('\\') => break,
                b'/' if bytes.get(end + 1) == Some(&b'*') => {
                    end += text[end + 2..].find("*/").map_or(text.len() - end, |k| k + 4);
                }
                b'/' if bytes.get(end + 1) == Some(&b'/') => {
                    // a comment that ends with a backslash goes on as the macro does
                    end += text[end..].find('\n').unwrap_or(text.len() - end);
                }
                b'"' => {
                    end += 1;
                    while end < text.len() && !matches!(bytes[end], b'"' | b'\n') {
                        end += if bytes[end] == b'\\' && bytes.get(end + 1) == Some(&b'"') { 2 } else { 1 };
                    }
                    end += usize::from(end < text.len() && bytes[end] == b'"');
                }
                _ => end += 1,
            }
        }
        let mut pos = *from;
        *from = end;
        let Some((name, stop)) = self.cut(file, &text, pos, end)?.filter(|t| t.0.kind == Kind::Name) else {
            return self.error(at, "the name of the macro is missing", "`define NAME text");
        };
        pos = stop;
        let mut parameters = None;
        if bytes.get(pos) == Some(&b'(') && pos < end {
            pos += 1;
            let (mut names, mut defaults) = (Vec::new(), Vec::new());
            loop {
                let Some((token, stop)) = self.cut(file, &text, pos, end)? else {
                    return self.error(
                        name.at,
                        "the parameters of the macro are not closed",
                        "`define NAME(a, b) text",
                    );
                };
                pos = stop;
                match (token.kind, self.sources.word(token.word)) {
                    (Kind::Name, _) => {
                        names.push(token.word);
                        defaults.push(None);
                    }
                    (Kind::Operator, "=") if !names.is_empty() => {
                        let (given, stop) = self.default_of(file, &text, pos, end)?;
                        pos = stop;
                        if let Some(last) = defaults.last_mut() {
                            *last = Some(given);
                        }
                    }
                    (Kind::Operator, ",") => {}
                    (Kind::Operator, ")") => break,
                    _ => return self.error(token.at, "a parameter of a macro is a name", "`define NAME(a, b) text"),
                }
            }
            parameters = Some(names.into_iter().zip(defaults).collect::<Vec<_>>());
        }
        let mut body = Vec::new();
        while let Some((token, stop)) = self.cut(file, &text, pos, end)? {
            body.push(token);
            pos = stop;
        }
        self.macros.insert(name.word, Arc::new(Macro { parameters, body }));
        Ok(())
    }

    /// What a parameter of a macro is where nothing is given: up to the next comma or the end of the list, and where that is.
    fn default_of(
        &mut self,
        file: u32,
        text: &str,
        from: usize,
        end: usize,
    ) -> Result<(Vec<Token>, usize), Box<Message>> {
        let (mut found, mut pos, mut depth) = (Vec::new(), from, 0);
        while let Some((token, stop)) = self.cut(file, text, pos, end)? {
            if token.kind == Kind::Operator {
                match self.sources.word(token.word) {
                    "," | ")" if depth == 0 => break,
                    "(" | "[" | "{" => depth += 1,
                    ")" | "]" | "}" => depth -= 1,
                    _ => {}
                }
            }
            found.push(token);
            pos = stop;
        }
        Ok((found, pos))
    }

    fn expand(&mut self, token: Token, name: &str, feed: &mut Feed) -> Result<(), Box<Message>> {
        let word = self.sources.intern(name);
        let Some(found) = self.macros.get(&word).cloned() else {
            let names = self.macros.keys().map(|&w| self.sources.word(w));
            let hint = match super::nearest(name, names) {
                Some(near) => format!("did you mean `{near}?"),
                None => "give it with `define, or `include the file that does".to_string(),
            };
            return self.error(token.at, format!("the macro `{name} is not defined"), hint);
        };
        if self.open.contains(&word) {
            return self.error(token.at, format!("the macro `{name} uses itself"), "it would never end");
        }
        if self.depth >= DEEPEST || self.sources.calls.len() >= MOST_CALLS {
            return self.error(token.at, "macros are nested too deeply", "");
        }
        self.depth += 1;
        self.sources.calls.push(Call { name: word, at: token.at });
        let call = self.sources.calls.len() as u32;
        let mut arguments: Vec<Vec<Token>> = Vec::new();
        if let Some(parameters) = &found.parameters {
            for raw in self.arguments(token, name, feed)? {
                let before = std::mem::take(&mut self.out);
                self.run(&mut Feed::Tokens(raw.iter()))?;
                arguments.push(std::mem::replace(&mut self.out, before));
            }
            if parameters.is_empty() && arguments.len() == 1 && arguments[0].is_empty() {
                arguments.clear();
            }
            for (k, (_, default)) in parameters.iter().enumerate() {
                if let (Some(default), true) = (default, arguments.get(k).is_none_or(Vec::is_empty)) {
                    let here = default.iter().map(|t| Token { at: Place { call, ..t.at }, ..*t }).collect();
                    if k < arguments.len() {
                        arguments[k] = here;
                    } else if k == arguments.len() {
                        arguments.push(here);
                    }
                }
            }
            if arguments.len() != parameters.len() {
                let what = format!("`{name} takes {} arguments, here are {}", parameters.len(), arguments.len());
                return self.error(token.at, what, "commas inside of brackets do not separate");
            }
        }
        let mut body = Vec::with_capacity(found.body.len());
        for &t in &found.body {
            let parameter = found.parameters.as_ref().and_then(|p| p.iter().position(|p| p.0 == t.word));
            match parameter.filter(|_| t.kind == Kind::Name) {
                Some(k) => body.extend_from_slice(&arguments[k]),
                None => body.push(Token { at: Place { call, ..t.at }, ..t }),
            }
            if body.len() > MOST_TOKENS {
                return self.error(token.at, "the text grows without end", "a macro multiplies itself");
            }
        }
        self.open.push(word);
        self.run(&mut Feed::Tokens(body.iter()))?;
        self.open.pop();
        self.depth -= 1;
        Ok(())
    }

    /// What stands in the brackets behind a macro's name, cut at commas.
    fn arguments(&mut self, of: Token, name: &str, feed: &mut Feed) -> Result<Vec<Vec<Token>>, Box<Message>> {
        let open = self.next(feed)?;
        if !open.is_some_and(|t| t.kind == Kind::Operator && matches!(self.sources.word(t.word), "(")) {
            return self.error(of.at, format!("`{name} takes arguments"), format!("write `{name}(...)"));
        }
        let (mut found, mut depth) = (vec![Vec::new()], 0);
        loop {
            let Some(token) = self.next(feed)? else {
                return self.error(of.at, format!("the arguments of `{name} are not closed"), "a ) is missing");
            };
            if token.kind == Kind::Operator {
                match self.sources.word(token.word) {
                    "(" | "[" | "{" | "(*" => depth += 1,
                    ")" if depth == 0 => return Ok(found),
                    ")" | "]" | "}" | "*)" => depth -= 1,
                    "," if depth == 0 => {
                        found.push(Vec::new());
                        continue;
                    }
                    _ => {}
                }
            }
            if let Some(last) = found.last_mut() {
                last.push(token);
            }
        }
    }

    fn include(&mut self, at: Place, feed: &mut Feed) -> Result<(), Box<Message>> {
        let mut token = self.next(feed)?;
        // the name may come through a macro
        if let Some(t) = token.filter(|t| t.kind == Kind::Macro) {
            let before = std::mem::take(&mut self.out);
            self.directive(t, feed)?;
            token = std::mem::replace(&mut self.out, before).first().copied();
        }
        let Some(token) = token.filter(|t| t.kind == Kind::Text) else {
            return self.error(at, "the name of the file is missing", "`include \"name\"");
        };
        let name = super::unquote(self.sources.word(token.word));
        if self.depth >= DEEPEST / 4 || self.sources.files.len() >= MOST_FILES {
            return self.error(
                token.at,
                format!("{name} includes itself"),
                "guard it with `ifndef ... `define ... `endif",
            );
        }
        let Some((path, text)) = self.look(&name).map_err(|why| self.sources.message(token.at, why, ""))? else {
            let what = format!("there is no file {name}");
            return self.error(token.at, what, "it is looked for beside the file and in the include folders");
        };
        self.depth += 1;
        self.file(&path, &text)?;
        self.depth -= 1;
        Ok(())
    }

    /// The file of this name in the folders, not outside of them, or one of the engine's own.
    fn look(&self, name: &str) -> Result<Option<(String, String)>, String> {
        for folder in self.folders {
            let path = folder.join(name);
            let (Ok(real), Ok(inside)) = (path.canonicalize(), folder.canonicalize()) else { continue };
            if !self.folders.iter().filter_map(|f| f.canonicalize().ok()).any(|f| real.starts_with(f)) {
                return Err(format!("{name} lies outside of the include folders ({})", inside.display()));
            }
            return read(&real).map(|text| Some((path.display().to_string(), text)));
        }
        let own = OWN.iter().find(|own| own.0 == name);
        Ok(own.map(|own| (own.0.to_string(), own.1.to_string())))
    }
}

/// The text of a plain file.
pub fn read(path: &Path) -> Result<String, String> {
    let about = path.metadata().map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
    if !about.is_file() || about.len() > MOST_BYTES {
        return Err(format!("{} is no file of text", path.display()));
    }
    let bytes = std::fs::read(path).map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
    // comments of old models are in Latin 1
    Ok(String::from_utf8(bytes).unwrap_or_else(|e| e.into_bytes().iter().map(|&b| char::from(b)).collect()))
}

fn number_end(bytes: &[u8], from: usize) -> usize {
    let mut at = from;
    let digits = |mut at: usize| {
        while at < bytes.len() && (bytes[at].is_ascii_digit() || bytes[at] == b'_') {
            at += 1;
        }
        at
    };
    at = digits(at);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    match bytes.get(at) {
        Some(b'e' | b'E') => {
            let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
            if bytes.get(at + 1 + sign).is_some_and(u8::is_ascii_digit) {
                return digits(at + 1 + sign);
            }
            at
        }
        Some(b'T' | b'G' | b'M' | b'K' | b'k' | b'm' | b'u' | b'n' | b'p' | b'f' | b'a') => {
            let next = bytes.get(at + 1).copied().unwrap_or(b' ');
            at + usize::from(!(next.is_ascii_alphanumeric() || next == b'_'))
        }
        _ => at,
    }
}

/// Is it part of a name?
fn is_word(b: u8) -> bool {
    b.is_ascii_alphanumeric() || b == b'_' || b == b'$'
}
