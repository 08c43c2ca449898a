"""The commands of a .control section as a program: what stands in which block, and what is wrong before anything runs."""

from __future__ import annotations

from ..build_control import ENDS, commands, comment
from ..build_expr import extent
from ..diagnostics import Diagnostic, suggest
from ..parsed import parse_line
from ..source import Line, SourceFile
from ..syntax import LineError
from . import words
from .budget import DEPTH

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from typing import Any

    from ..diagnostics import Sink, Span
    from .base import Command

CONDITIONS = ("if", "elseif", "while")
BLOCKS = ("if", "while", "dowhile", "repeat", "foreach")
FLOW = {
    "if": ("if condition", "the commands up to else, elseif or end where the condition is not 0"),
    "else": ("else", "the commands of an if whose condition is 0"),
    "elseif": ("elseif condition", "the same with a condition of its own"),
    "while": ("while condition", "the commands up to end as long as the condition is not 0"),
    "dowhile": ("dowhile condition", "the same, with the condition behind the commands"),
    "repeat": ("repeat [count]", "the commands up to end so many times"),
    "foreach": ("foreach name word ..", "the commands up to end for each word, which $name is"),
    "end": ("end", "ends a block"),
    "begin": ("begin", "the commands up to end, as `if 1`"),
    **{word: (word, "end, by another name") for word in ENDS[1:]},
    "break": ("break [loops]", "leaves a loop, or several"),
    "continue": ("continue [loops]", "goes on with the next round of a loop"),
    "label": ("label name", "a place for goto"),
    "goto": ("goto name", "goes on behind that label, of this block or one about it"),
}


class Statement:
    """One command: its first word, the text behind it, the line, and where in the line it stands."""

    __slots__ = ("at", "line", "rest", "text", "word")

    def __init__(self, line: Line, at: int, text: str) -> None:
        self.line, self.at, self.text = line, at, text
        word, _, rest = text.partition(" ")
        if "\t" in word:
            word, _, rest = text.partition("\t")
        if "=" in word and not word.startswith("="):
            word, rest = text, ""  # a=3 is no command
        self.word, self.rest = word.lower(), rest.strip()

    @property
    def span(self) -> Span:
        if self.line.single:
            return self.line.span_at(self.at, self.at + len(self.text))
        return self.line.whole

    @property
    def word_span(self) -> Span:
        return self.line.span_at(self.at, self.at + len(self.word)) if self.line.single else self.line.whole

    def tree(self, text: str, start: str) -> Any:
        """The tree of what is behind the word, `text` after variables are put in. Raises LineError with places in the deck
        where the text is the deck's own."""
        within = self.line.text.find(text, self.at) if text and self.line.single else -1
        if start == "vectors":
            text = words.without_commas(text, within=False)
        if within >= 0:
            line = Line(self.line.file, self.line.number, self.line.col + within, 0, 0)
            line.text, line.single = text, True
            return parse_line(line, start)
        file = SourceFile("<command>", text)
        try:
            return parse_line(Line(file, 1, 1, 0, len(text)), start)
        except LineError as error:
            found = error.diagnostic
            found.span = self.span
            found.message = f"`{text[:60]}`: {found.message}"
            raise


class Block:
    """A command with a block: branches (head, body) of an if, or the one of a loop."""

    __slots__ = ("branches", "head")

    def __init__(self, head: Statement) -> None:
        self.head = head
        self.branches: list[tuple[Statement, list[Statement | Block]]] = [(head, [])]


Body = list["Statement | Block"]


def statements(lines: Iterable[Line]) -> Iterator[Statement]:
    for line in lines:
        for at, text in commands(line.text):
            yield Statement(line, at, text)


def program(lines: Iterable[Line], sink: Sink) -> Body:
    """The commands in their blocks; what does not fit together goes to the sink."""
    top: Body = []
    stack: list[Block] = []
    for s in statements(lines):
        body = stack[-1].branches[-1][1] if stack else top
        if s.word == "begin":
            s = Statement(s.line, s.at, "if 1")
        if s.word in BLOCKS:
            if len(stack) >= DEPTH:
                said = f"{DEPTH} blocks within each other are the most"
                sink.error("E165", said, s.word_span)
                return top
            block = Block(s)
            body.append(block)
            stack.append(block)
        elif s.word in ("else", "elseif"):
            if not stack or stack[-1].head.word != "if" or stack[-1].branches[-1][0].word == "else":
                sink.error("E160", f"`{s.word}` belongs to no if", s.word_span)
                continue
            behind = s.rest.split(None, 1)
            if (
                s.word == "else" and behind and behind[0].lower() == "if"
            ):  # else if: ngspice takes it for an else
                s = Statement(s.line, s.at, "elseif " + (behind[1] if len(behind) > 1 else ""))
            stack[-1].branches.append((s, []))
        elif s.word in ENDS:
            if not stack:
                sink.error(
                    "E160",
                    f"this `{s.word}` ends nothing",
                    s.word_span,
                    "it ends if, while, dowhile, repeat, foreach",
                )
            else:
                stack.pop()
        else:
            body.append(s)
    for block in stack:
        sink.error("E160", f"this `{block.head.word}` has no end", block.head.word_span, "close it with end")
    return top


def every(body: Body) -> Iterator[Statement]:
    for one in body:
        if isinstance(one, Block):
            for head, inner in one.branches:
                yield head
                yield from every(inner)
        else:
            yield one


def check(body: Body, sink: Sink, commands: Mapping[str, Command]) -> None:
    """Words that are no commands, and expressions that cannot be read: told before anything runs."""
    named = {s.rest.split()[0].lower() for s in every(body) if s.word == "alias" and s.rest}
    known = {*commands, *FLOW, *named}
    for s in every(body):
        behind_semicolon(s, known, sink)
        if s.word not in known:
            sink.add(unknown(s, suggest(s.word, known)))
            continue
        command = None if s.word in named else commands.get(s.word)
        start = "vectors" if s.word in CONDITIONS else command.grammar if command is not None else None
        found = words.redirected(s.rest) if command is not None and command.shows else None
        rest = s.rest if found is None else found[0].strip()
        if start is None or not rest or any(c in rest for c in "$`{"):
            continue
        try:
            s.tree(rest, start)
        except LineError as error:
            sink.add(error.diagnostic)


def behind_semicolon(s: Statement, known: Iterable[str], sink: Sink) -> None:
    """A command behind a `;` is part of a comment, as in ngspice: told where it looks like one."""
    text = s.line.text
    at = comment(text)
    word = text[at + 1 :].split()[:1]
    if text[at : at + 1] == ";" and word and word[0].lower() in known:
        said = f"`;` begins a comment, as in ngspice: this `{word[0]}` is not carried out"
        sink.note("N160", said, s.line.span_at(at, len(text)), "write it on a line of its own")


def unknown(s: Statement, near: str | None) -> Diagnostic:
    if "=" in s.word:
        return Diagnostic("error", "E160", f"`{s.text[:40]}` is no command", s.span, f"let {s.text[:40]}")
    hint = f"did you mean `{near}`?" if near else "emsim help control lists the commands"
    return Diagnostic("error", "E160", f"`{s.word[:40]}` is no command of .control", s.word_span, hint)


def pieces(tree: Any, text: str) -> list[str]:
    """The texts of the items of a list."""
    return [text[slice(*extent(item))] for item in tree[1]]
