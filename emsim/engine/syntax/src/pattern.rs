//! The terminals' regular expressions with the meaning of Python's `re`: alternatives in order, greedy and lazy
//! repetition, lookahead. A backtracking matcher with a stack of its own and a budget.
//!
//! The notation is described in grammar/export.py, which takes Python's expressions apart.

/// A class of characters.
pub struct Class {
    /// which of ASCII are in it, one bit each
    pub ascii: u128,
    pub others: Others,
    /// ranges that differ from `others`, or (`Others::Settled`) that are in
    pub ranges: Vec<(u32, u32)>,
}

/// What holds for characters beyond ASCII that are in no range.
#[derive(Clone, Copy, PartialEq)]
pub enum Others {
    In,
    Out,
    /// out where all versions of Unicode agree, else unknown
    Settled,
}

enum Member {
    Yes,
    No,
    Unknown,
}

impl Class {
    fn holds(&self, c: u32) -> Member {
        let listed = self.ranges.iter().any(|&(a, b)| a <= c && c <= b);
        match self.others {
            Others::In if !listed => Member::Yes,
            Others::Out if listed => Member::Yes,
            Others::In | Others::Out => Member::No,
            // the SETTLED of grammar/export.py
            Others::Settled if !matches!(c, 0x80..=0x24f | 0x391..=0x3c9) => Member::Unknown,
            Others::Settled => {
                if listed {
                    Member::Yes
                } else {
                    Member::No
                }
            }
        }
    }
}

enum Op {
    /// one character of a class
    One(u16),
    /// a class `least` to `most` times, as often as possible; `fixed`: nothing behind it could want some back
    Many {
        class: u16,
        least: u32,
        most: u32,
        fixed: bool,
    },
    /// go on here; if that fails, there
    Either(usize, usize),
    Jump(usize),
    /// what begins at the next op must (not) match here; on at `after`
    Ahead {
        wanted: bool,
        after: usize,
    },
    AtEnd,
    Done,
}

pub struct Pattern {
    ops: Vec<Op>,
    /// ASCII characters that a match can begin with, and whether others can
    pub first: u128,
    pub first_other: bool,
}

#[derive(Debug, PartialEq, Clone, Copy)]
pub enum Found {
    /// the end of the match
    To(usize),
    Nothing,
    /// Python has to be asked
    Unknown,
}

/// A place to go back to: the op, the position, and how far a repetition may be shortened to.
struct Frame {
    op: usize,
    at: usize,
    shortest: usize,
}

/// Memory of the matcher, kept between matches.
#[derive(Default)]
pub struct Stack(Vec<Frame>);

const STEPS: usize = 200_000; // of the search, after which Python is asked
const STEPS_PER_BYTE: usize = 64; // and so many more
const MOST_COPIES: u32 = 32; // that a counted repetition is written as

impl Pattern {
    /// From the notation; None if it is malformed.
    pub fn read(notation: &str, classes: &[Class]) -> Option<Pattern> {
        let words: Vec<&str> = notation.split(' ').collect();
        let mut ops = Vec::new();
        let rest = sequence(&words, &mut ops)?;
        if !rest.is_empty() {
            return None;
        }
        ops.push(Op::Done);
        // a repetition at the very end keeps all it has
        let last = ops.len() - 1;
        for k in 0..last {
            let next_is_done =
                matches!(ops[k + 1], Op::Done) || matches!(ops[k + 1], Op::Jump(to) if matches!(ops[to], Op::Done));
            if let Op::Many { fixed, .. } = &mut ops[k] {
                *fixed = next_is_done;
            }
        }
        let mut pattern = Pattern { ops, first: 0, first_other: false };
        let mut seen = vec![false; pattern.ops.len()];
        pattern.collect_first(0, classes, &mut seen)?;
        Some(pattern)
    }

    fn collect_first(&mut self, k: usize, classes: &[Class], seen: &mut [bool]) -> Option<()> {
        if std::mem::replace(&mut seen[k], true) {
            return Some(());
        }
        match self.ops[k] {
            Op::One(class) | Op::Many { class, .. } => {
                let c = classes.get(class as usize)?;
                self.first |= c.ascii;
                self.first_other |= c.others != Others::Out || !c.ranges.is_empty();
                if matches!(self.ops[k], Op::Many { least: 0, .. }) {
                    self.collect_first(k + 1, classes, seen)?;
                }
            }
            Op::Either(a, b) => {
                self.collect_first(a, classes, seen)?;
                self.collect_first(b, classes, seen)?;
            }
            Op::Jump(to) | Op::Ahead { after: to, .. } => self.collect_first(to, classes, seen)?,
            Op::AtEnd | Op::Done => {
                self.first = u128::MAX;
                self.first_other = true;
            }
        }
        Some(())
    }

    /// Matches at a position, as `re.compile(..).match(text, at)` does.
    pub fn at(&self, classes: &[Class], text: &str, at: usize, stack: &mut Stack) -> Found {
        stack.0.clear();
        let mut steps = STEPS + STEPS_PER_BYTE * (text.len() - at);
        self.run(classes, text, 0, at, stack, &mut steps)
    }

    fn run(
        &self,
        classes: &[Class],
        text: &str,
        mut op: usize,
        mut at: usize,
        stack: &mut Stack,
        steps: &mut usize,
    ) -> Found {
        let base = stack.0.len();
        loop {
            if *steps == 0 {
                return Found::Unknown;
            }
            *steps -= 1;
            let next = match self.ops[op] {
                Op::Done => {
                    stack.0.truncate(base);
                    return Found::To(at);
                }
                Op::One(class) => match step(&classes[class as usize], text, at) {
                    Step::To(next) => Some((op + 1, next)),
                    Step::No => None,
                    Step::Unknown => return Found::Unknown,
                },
                Op::Many { class, least, most, fixed } => {
                    match many(&classes[class as usize], text, at, (least, most), steps) {
                        Many::Unknown => return Found::Unknown,
                        Many::No => None,
                        Many::To { shortest, longest } => {
                            if !fixed && longest > shortest {
                                stack.0.push(Frame { op: op + 1, at: longest, shortest });
                            }
                            Some((op + 1, longest))
                        }
                    }
                }
                Op::Either(a, b) => {
                    stack.0.push(Frame { op: b, at, shortest: at });
                    Some((a, at))
                }
                Op::Jump(to) => Some((to, at)),
                Op::Ahead { wanted, after } => match self.run(classes, text, op + 1, at, stack, steps) {
                    Found::Unknown => return Found::Unknown,
                    found => ((found != Found::Nothing) == wanted).then_some((after, at)),
                },
                // Python's `$`: at the end, or before a line end there
                Op::AtEnd => (at == text.len() || &text[at..] == "\n").then_some((op + 1, at)),
            };
            let Some(to) = next.or_else(|| stack.back(text, base)) else { return Found::Nothing };
            (op, at) = to;
        }
    }
}

impl Stack {
    /// The last other way: where to go on with it. None above `base`.
    fn back(&mut self, text: &str, base: usize) -> Option<(usize, usize)> {
        if self.0.len() == base {
            return None;
        }
        let frame = self.0.last_mut()?;
        if frame.at <= frame.shortest {
            return self.0.pop().map(|frame| (frame.op, frame.at));
        }
        // a repetition gives one character back
        let mut back = frame.at - 1;
        while !text.is_char_boundary(back) {
            back -= 1;
        }
        frame.at = back;
        let to = (frame.op, back);
        if back == frame.shortest {
            self.0.pop();
        }
        Some(to)
    }
}

enum Many {
    /// as few as must be, as many as can be
    To {
        shortest: usize,
        longest: usize,
    },
    No,
    Unknown,
}

/// Characters of a class, at least and at most so many.
#[inline]
fn many(class: &Class, text: &str, mut at: usize, (least, most): (u32, u32), steps: &mut usize) -> Many {
    let (mut count, mut shortest) = (0, at);
    if least <= 1 {
        // ASCII in a row, the rest below
        let longest = text.len().min(at.saturating_add(most as usize));
        let run = text.as_bytes()[at..longest].iter();
        let run = run.take_while(|&&b| b < 128 && class.ascii >> b & 1 != 0).count();
        (count, at) = (run as u32, at + run);
        shortest += (least as usize).min(run);
    }
    while count < most {
        match step(class, text, at) {
            Step::To(next) => at = next,
            Step::No => break,
            Step::Unknown => return Many::Unknown,
        }
        count += 1;
        if count == least {
            shortest = at;
        }
    }
    *steps = steps.saturating_sub(count as usize / 8);
    if count < least {
        Many::No
    } else {
        Many::To { shortest, longest: at }
    }
}

enum Step {
    To(usize),
    No,
    Unknown,
}

/// One character of a class at a position.
#[inline]
fn step(class: &Class, text: &str, at: usize) -> Step {
    match text.as_bytes().get(at) {
        None => Step::No,
        Some(&byte) if byte < 128 => {
            if class.ascii >> byte & 1 != 0 {
                Step::To(at + 1)
            } else {
                Step::No
            }
        }
        Some(_) => {
            let c = text[at..].chars().next().unwrap_or('\0');
            match class.holds(c as u32) {
                Member::Yes => Step::To(at + c.len_utf8()),
                Member::No => Step::No,
                Member::Unknown => Step::Unknown,
            }
        }
    }
}

/// Items up to `|`, `)` or the end; returns what is left.
fn sequence<'a>(mut words: &'a [&'a str], ops: &mut Vec<Op>) -> Option<&'a [&'a str]> {
    while !matches!(words.first(), None | Some(&"|") | Some(&")")) {
        words = item(words, ops)?;
    }
    Some(words)
}

fn item<'a>(words: &'a [&'a str], ops: &mut Vec<Op>) -> Option<&'a [&'a str]> {
    let (&word, rest) = words.split_first()?;
    match word {
        "$" => {
            ops.push(Op::AtEnd);
            Some(rest)
        }
        "(" => {
            let mut ends = Vec::new();
            let mut rest = rest;
            loop {
                let fork = ops.len();
                ops.push(Op::Done); // an Either, if another alternative follows
                rest = sequence(rest, ops)?;
                let (&stop, tail) = rest.split_first()?;
                rest = tail;
                if stop == ")" {
                    ops[fork] = Op::Jump(fork + 1);
                    break;
                }
                ends.push(ops.len());
                ops.push(Op::Done); // a Jump behind the group
                ops[fork] = Op::Either(fork + 1, ops.len());
            }
            let behind = ops.len();
            for end in ends {
                ops[end] = Op::Jump(behind);
            }
            Some(rest)
        }
        "=" | "!" => {
            let ahead = ops.len();
            ops.push(Op::Done);
            let rest = item(rest, ops)?;
            ops.push(Op::Done);
            ops[ahead] = Op::Ahead { wanted: word == "=", after: ops.len() };
            Some(rest)
        }
        "*" => {
            let [least, most, how, body @ ..] = rest else { return None };
            let least: u32 = least.parse().ok()?;
            let most: u32 = if *most == "-" { u32::MAX } else { most.parse().ok()? };
            if let (Ok(class), "g") = (body.first()?.parse(), *how) {
                ops.push(Op::Many { class, least, most, fixed: false });
                return Some(&body[1..]);
            }
            if least > MOST_COPIES || (most != u32::MAX && most > MOST_COPIES) {
                return None;
            }
            let mut rest = body;
            let mut copies = 0;
            while copies < least {
                rest = item(body, ops)?;
                copies += 1;
            }
            let mut forks = Vec::new();
            while copies < most {
                let fork = ops.len();
                ops.push(Op::Done);
                forks.push(fork);
                rest = item(body, ops)?;
                if most == u32::MAX {
                    ops.push(Op::Jump(fork));
                    break;
                }
                copies += 1;
            }
            let behind = ops.len();
            for fork in forks {
                ops[fork] = if *how == "g" { Op::Either(fork + 1, behind) } else { Op::Either(behind, fork + 1) };
            }
            Some(rest)
        }
        _ => {
            ops.push(Op::One(word.parse().ok()?));
            Some(rest)
        }
    }
}
