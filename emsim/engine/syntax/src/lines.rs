//! A text cut into its title, its logical lines and the commands of its .control sections. Nothing is changed: a
//! logical line is a slice of the text, from its first character to the end of its last continuation line.

/// A logical line. Places count bytes from 0; `number` counts lines from 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub number: usize,
    /// bytes before it on its line
    pub indent: usize,
    pub start: usize,
    pub end: usize,
}

/// What stands in one physical line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub number: usize,
    pub start: usize,
    pub end: usize,
}

#[derive(Default)]
pub struct Lines {
    pub title: Option<Piece>,
    pub cards: Vec<Line>,
    pub commands: Vec<Line>,
    /// where the first .control stands
    pub control: Option<Piece>,
    /// continuation lines that continue nothing
    pub stray: Vec<Piece>,
    /// the first card behind .end, where only .control sections are read
    pub behind: Option<Piece>,
}

/// `has_title`: the first line is the title; `skip_empty`: empty lines above it do not count.
pub fn cut(text: &str, has_title: bool, skip_empty: bool) -> Lines {
    let mut out = Lines::default();
    let (mut in_control, mut ended) = (false, false);
    let mut awaiting_title = has_title;
    let mut open: Option<Line> = None;
    let mut at = 0;
    for (k, raw) in text.split('\n').enumerate() {
        let (number, begin) = (k + 1, at);
        at += raw.len() + 1;
        let body = strip(raw);
        let indent = body.as_ptr() as usize - raw.as_ptr() as usize;
        let start = begin + indent;
        let end = begin + raw.len();
        if awaiting_title {
            if !body.is_empty() || !skip_empty {
                out.title = Some(Piece { number, start, end: start + body.len() });
                awaiting_title = false;
            }
            continue;
        }
        let first = match body.as_bytes().first() {
            None | Some(b'*' | b';' | b'$') => continue,
            Some(_) if body.starts_with("//") => continue,
            Some(&first) => first,
        };
        if first == b'+' {
            match &mut open {
                Some(line) => line.end = end,
                None if ended => {}
                None => out.stray.push(Piece { number, start, end }),
            }
            continue;
        }
        if let Some(line) = open.take() {
            if in_control { &mut out.commands } else { &mut out.cards }.push(line);
        }
        if first == b'.' {
            let word = body.split(space).next().unwrap_or("");
            if word.eq_ignore_ascii_case(".control") {
                in_control = true;
                out.control.get_or_insert(Piece { number, start, end: start + body.len() });
                continue;
            }
            if word.eq_ignore_ascii_case(".endc") {
                in_control = false;
                continue;
            }
            if word.eq_ignore_ascii_case(".end") && !in_control {
                ended = true;
                continue;
            }
        }
        if ended && !in_control {
            out.behind.get_or_insert(Piece { number, start, end: start + body.len() });
            continue;
        }
        open = Some(Line { number, indent, start, end });
    }
    if let Some(line) = open {
        if in_control { &mut out.commands } else { &mut out.cards }.push(line);
    }
    out
}

/// White space as Python's str.strip has it.
pub fn space(c: char) -> bool {
    c.is_whitespace() || ('\x1c'..='\x1f').contains(&c)
}

fn strip(raw: &str) -> &str {
    let bytes = raw.as_bytes();
    // the plain case
    if let (Some(first), Some(last)) = (bytes.first(), bytes.last()) {
        if first.is_ascii_graphic() && last.is_ascii_graphic() {
            return raw;
        }
    }
    let left = raw.trim_start_matches(space);
    // an empty body stands at the line's beginning
    if left.is_empty() {
        &raw[..0]
    } else {
        left.trim_end_matches(space)
    }
}
