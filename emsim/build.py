"""Trees become typed cards: the words of a line get their meaning, values stay expressions until elaboration.

`read` takes a path or a text to a `Deck`; `read_file` is the part that includes use. Each grammar rule has one
method, `on_` + its name, in build_machine.py or build_dots.py; the rules of elements are read by their classes (elements/).
"""

from __future__ import annotations

import os

from . import syntax
from .build_dots import DotCards
from .build_elements import ElementCards
from .build_expr import expression, extent
from .cards import CARDS
from .deck import Analysis, Deck, Dot, Unread
from .diagnostics import DeckError, Diagnostic, OutsideError, Sink, Span, suggest
from .elements import LETTERS, Element
from .marks import card_class, start_of
from .parsed import parse_line
from .source import Line, NoCollection, Reading, SourceFile, decode, load
from .syntax import LineError
from .units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    from .deck import Measure, Probe
    from .dialects import Dialect
    from .expr import Node

_LETTERS = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ")
FOREIGN_STARTS = frozenset("(</EVvwpmcb")  # how texts of other programs begin, see slips.py
_CLOSERS = {"subckt": "ends", "if": "endif", "lib": "endl"}


def read(
    source: str | bytes | os.PathLike[str],
    defines: Mapping[str, Any] | None = None,
    also: Sequence[Probe] = (),
    dialect: str | None = None,
) -> Deck:
    """The deck of a path, or of a text (a str with a line end in it). Raises OutsideError, never DeckError:
    what is wrong in the deck is in `deck.sink`, and `elaborate.flatten` raises it.

    `defines` stand above the deck's own .param of the same name; values are numbers or text such as "10k", TypeError where one
    is neither.
    `also` are signals to record beside those that the deck asks for.
    `dialect` stands above the one that the deck names (dialects/); E294 where there is none of that name.
    """
    sink, spoken = Sink(), None
    if dialect is not None:
        from .dialects import find, unknown

        spoken = find(dialect)
        if spoken is None:
            said, hint = unknown(dialect)
            sink.error("E294", said, None, hint)
    if isinstance(source, bytes):
        decoded = decode(source)
        if decoded is None:
            sink.error("E100", "these bytes are no text", hint="a deck is text, one card a line")
        source = decoded or "\n"
    if isinstance(source, str) and ("\n" in source or "\r" in source or not source):
        text = source.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")
        deck = _build(SourceFile("<text>", text), sink, True, spoken)
    else:
        path = os.fspath(source)
        try:
            file = load(path)
        except OSError as error:
            raise cannot_read(path, error) from None
        except ValueError:
            sink.error("E100", f"{path} is not a text file", hint="a deck is text, one card a line")
            return Deck("", SourceFile(path, "", path), sink)
        deck = _build(file, sink, True, spoken)
    deck.defines = dict(defines or {})
    for name, value in deck.defines.items():
        if not isinstance(value, (str, float)):
            from numbers import Real  # numpy's are such too; not wanted on the command line

            if not isinstance(value, Real):
                raise TypeError(f"the parameter `{name}` is a number or text, not {value!r}")
    if also:
        deck.body.append(Dot("also", list(also), also[0].span))
    return deck


def read_source(file: SourceFile) -> Deck:
    """The deck of a text that is not on disk as it is here: that of an editor. Never raises."""
    return _build(file, Sink(), is_main=True)


def read_file(
    path: str, sink: Sink, included_from: Span | None = None, shown: str | None = None, dialect: Dialect | None = None
) -> Deck:  # fmt: skip
    """An included file as a Deck without a title, in a `dialect` where it names none of its own. Raises OSError, or
    ValueError when it is not text.

    A file most of whose lines are no cards is no deck: one error says so, where it is included, and shows none of them."""
    file, own = load(path, included_from, shown), Sink()
    file.dialect = dialect
    if file.text.lstrip()[:1] in FOREIGN_STARTS:
        from .sheets import kind

        if (found := kind(file.text)) is not None:
            said, hint = (
                f"{shown or path} is {found[0]}, and a deck includes decks",
                "emsim convert makes a deck of it",
            )
            sink.error("E157", said, included_from, hint)
            return Deck("", SourceFile(file.name, "", path, included_from), sink)
    deck = _build(file, own, is_main=False)
    # lines with a dot card's word are meant as cards, whatever is wrong in them
    wrong = {d.span.line for d in own.diagnostics if d.severity == "error" and d.span}
    wrong = {line for line in wrong if not file.text_line(line).lstrip().startswith(".")}
    lines = sum(line.strip()[:1] not in ("", "*") for line in file.text.split("\n")) if wrong else 0
    if 2 * len(wrong) > lines:
        said = f"{shown or path} is no deck: {len(wrong)} of its {lines} lines are no cards, line {min(wrong)} is the first"
        sink.error("E100", said, included_from, "an included file holds cards, one a line, and no title")
        deck.body.clear()
    else:
        for diagnostic in own.diagnostics:
            sink.add(diagnostic)
    deck.sink = sink
    return deck


def cannot_read(path: str, error: OSError) -> OutsideError:
    """The error of a deck that is not there or may not be opened, with the file in its folder that is spelt nearly so."""
    said, hint = f"cannot read {path}: {error.strerror or error}", None
    if isinstance(error, IsADirectoryError):
        said = f"{path} is a directory, not a deck"
    elif isinstance(error, FileNotFoundError):
        said = f"there is no file {path}"
        folder, name = os.path.split(path)
        near = suggest(name, os.listdir(folder or ".")) if os.path.isdir(folder or ".") else None
        hint = f"did you mean {os.path.join(folder, near)}?" if near else None
    return OutsideError(Diagnostic("error", "E500", said, None, hint))


def _build(file: SourceFile, sink: Sink, is_main: bool, dialect: Dialect | None = None) -> Deck:
    if is_main and file.text.lstrip()[:1] in FOREIGN_STARTS:
        from .sheets import deck as of_schematic
        from .slips import foreign

        if (drawn := of_schematic(file, sink)) is not None:
            file = drawn
        elif (found := foreign(file)) is not None:
            sink.add(found)
            return Deck("", file, sink)
    with NoCollection():
        return _Builder(file, sink).build(is_main, dialect)


def reread_as_element(line: Line, sink: Sink) -> Element | None:
    """A line first read as a machine card, as SPICE reads it; None when SPICE cannot read it either."""
    try:
        rule, children = parse_line(line, "element")
    except LineError:
        return None
    card = _Builder(line.file, sink).convert(rule, children, line)
    return card if isinstance(card, Element) else None


def command_card(text: str, line: Line, at: int, span: Span) -> Any:
    """The dot card that a command of .control is, with places in the deck where the text is the deck's own: `at` is where the
    command begins in its line, `span` its place. Raises LineError."""
    own = line.single and line.text.startswith(text, at)
    given = (
        Line(line.file, line.number, line.col + at - 1, 0, 0)
        if own
        else Line(SourceFile("<command>", ""), 1, 0, 0, 0)
    )
    given.text, given.single = "." + text, True
    builder = _Builder(given.file, Sink())
    try:
        try:
            card = builder.convert(*parse_line(given, "dot"), given)
        except LineError:
            if syntax.first_word(text) != "save":
                raise
            card = builder.piece_by_piece(given, ".save")
    except LineError as error:
        if not own:
            error.diagnostic.span = span
        error.diagnostic.message = error.diagnostic.message.replace(
            "`." + syntax.first_word(text), "`" + syntax.first_word(text)
        )
        raise
    errors = [d for d in builder.sink.diagnostics if d.severity == "error"]
    if errors:
        raise LineError(errors[0])
    if card is not None:
        card.span = span
    return card


def parse_expression(text: str, name: str = "<expression>") -> Node:
    """The tree of an expression given on its own (a command-line option). Raises LineError."""
    line = Line(SourceFile(name, text), 1, 1, 0, len(text))
    return expression(parse_line(line, "expression"), line)


def parse_signals(text: str, name: str = "signals") -> list[Probe]:
    """Signals given beside a deck (an option, an argument), as .print takes them; commas may stand between. `name`
    is what messages call the text. Raises DeckError with its place in the text."""
    file, card = SourceFile(name, text), ".save "
    line = Line(file, 1, 1 - len(card), 0, 0)
    line.text, line.single = card + _blank_commas(" ".join(text.splitlines())), True
    try:
        return _Builder(file, Sink()).probes(parse_line(line, "dot")[1], line)
    except LineError as error:
        raise DeckError(error.diagnostic) from None


def parse_measure(text: str, name: str = "meas") -> Measure:
    """A measurement given on its own, as .meas takes it: "tran delay trig v(a) val=1 rise=1 targ ...". Raises DeckError."""
    from .build_measure import measure

    file = SourceFile(name, " ".join(text.splitlines()))
    try:
        return measure(Line(file, 1, 1, 0, len(file.text)), 0)
    except LineError as error:
        raise DeckError(error.diagnostic) from None


def parse_analysis(text: str, name: str = "analyses") -> Analysis:
    """An analysis given beside a deck, as its dot card: ".tran 1u 1m", with or without the dot. Raises DeckError."""
    file = SourceFile(name, "." + " ".join(text.split()).removeprefix("."))
    line = Line(file, 1, 1, 0, len(file.text))
    try:
        rule, children = parse_line(line, "dot")
        card = _Builder(file, Sink()).convert(rule, children, line)
    except LineError as error:
        raise DeckError(error.diagnostic) from None
    if not isinstance(card, Analysis):
        raise DeckError(
            Diagnostic("error", "E306", f"`{text}` is no analysis", line.whole, "for example .tran 1u 1m")
        )
    return card


def _blank_commas(text: str) -> str:
    """Commas outside brackets as blanks: they separate."""
    out, depth = [], 0
    for c in text:
        depth += (c in "({[") - (c in ")}]")
        out.append(" " if c == "," and depth <= 0 else c)
    return "".join(out)


def without_statistics(line: Line) -> Line | None:
    """A .param without the spreads of HSPICE's statistics, dev/gauss='..': its nominal values, as in ngspice."""
    import re

    blank = re.sub(
        r"\b(?:dev|lot)/\w+\s*=\s*(?:'[^']*'|\{[^}]*\}|\S+)",
        lambda found: " " * len(found[0]),
        line.text,
        flags=re.IGNORECASE,
    )
    if blank == line.text:
        return None
    nominal = Line(line.file, line.number, line.col, line.start, line.end)
    nominal.text = blank
    return nominal


# ---- cards ----


class _Builder(ElementCards, DotCards):
    """Builds one text. `stack` holds the open blocks: (kind, list that receives cards, where it began)."""

    def __init__(self, file: SourceFile, sink: Sink) -> None:
        self.file = file
        self.sink = sink
        self.stack: list[tuple[str, list[Any], Any]] = []
        self.deck = Deck("", file, sink)
        self.body: list[Any] = self.deck.body
        self.methods: dict[str, Callable[[list[Any], Line], Any]] = {}

    # ---- the text as a whole ----

    def build(self, is_main: bool, dialect: Dialect | None = None) -> Deck:
        """`dialect`: in place of the one that the text names."""
        deck, sink = self.deck, self.sink
        titled = reading = Reading(self.file, has_title=is_main)
        deck.title = reading.title
        # ngspice 39 reads an .include there, and nothing else
        if is_main and dialect is None and deck.title.lower().split()[:1] in ([".inc"], [".include"]):
            reading = Reading(self.file, has_title=False)
        self.file.dialect = dialect or self.stated_dialect(reading) or self.file.dialect
        for span in reading.stray:
            sink.error("E101", "this line continues nothing", span, "`+` joins a line to the card above it")
        if reading.behind is not None:
            sink.warning(
                "W109", "what stands behind .end is not read, but for .control sections", reading.behind,
                "ngspice reads it: move .end to the end, or leave the lines out",
            )  # fmt: skip
        for rule, content, between, last, value, place in reading.cards:
            if place >= 0:
                self.body.append(self.plain(content, between, last, value, place))
                continue
            line = reading.line(between)
            try:
                card = self.unread_line(line) if rule is None else self.convert(rule, content, line)
            except LineError as error:
                from .mistakes import other_card

                said = other_card(line) or error.diagnostic
                if is_main or not any(kind == "subckt" for kind, _, _ in self.stack):
                    sink.add(said if is_main else self.dotless(line) or said)
                    continue
                card = Unread(said)
            if card is not None:
                self.body.append(card)
        for diagnostic in self.file.remarks:
            sink.add(diagnostic)
        for kind, _, owner in self.stack:
            sink.error(
                "E106",
                f"this .{kind} has no .{_CLOSERS[kind]}",
                _span_of(owner),
                f"close it with .{_CLOSERS[kind]}",
            )
        self.commands(reading)
        if self.file.dialect is not None and self.file.dialect.coil_resistance:
            from .elements.parasitics import with_resistance

            for body in (self.deck.body, *self.deck.sections.values()):
                with_resistance(body, self.file.dialect.coil_resistance)
        if is_main:
            self.judge_title(titled)
        return deck

    def stated_dialect(self, reading: Reading) -> Dialect | None:
        """What .options dialect= says, wherever it stands: it counts for the whole text. E294."""
        if "dialect" not in self.file.text.lower():
            return None
        from .dialects import find, unknown

        found = None
        reading.cards = list(reading.cards)
        for rule, content, between, *_ in reading.cards:
            for item in content if rule == "options" else ():
                if item.__class__ is tuple and item[1][0].lower() == "dialect":
                    word = item[1][1]
                    found = None if word.__class__ is tuple else find(word)
                    if found is None:
                        span = reading.line(between).span_at(*extent(word))
                        said, hint = unknown(span.text)
                        self.sink.error("E294", said, span, hint)
        return found

    @staticmethod
    def dotless(line: Line) -> Diagnostic | None:
        """`include "file"` in a library, as in one of sky130's: ngspice takes it as a source of 0 A."""
        if syntax.first_word(line.text) != "include":
            return None
        said = "`include` without its dot includes nothing, as in ngspice"
        return Diagnostic(
            "warning", "W114", said, line.whole, "write .include if the file is meant to be read"
        )

    def unread_line(self, line: Line) -> Any:
        """A line that the native parser did not read: a machine card, or what Lark knows the fault of, or can read."""
        first = line.text[0]
        if first == ".":
            return self.unread_dot(line)
        if line.text.strip() == ")":
            return None  # closes the model above; ngspice passes it over
        if first not in _LETTERS:
            raise LineError(_not_a_card(line))
        start = start_of(line)
        if start == "machine_card" and syntax.first_word(line.text) == "fmu":
            from .build_unit import unit

            return unit(line)
        rule, children = parse_line(line, start)
        return self.convert(rule, children, line)

    def unread_dot(self, line: Line) -> Any:
        """Of what is to be shown, the part that can be read; ngspice leaves the rest out too."""
        try:
            rule, children = parse_line(line, "dot")
        except LineError as error:
            word = syntax.first_word(line.text)
            if word == ".param" and (nominal := without_statistics(line)) is not None:
                return self.convert(*parse_line(nominal, "dot"), line)
            if word not in (".print", ".save", ".probe") or error.diagnostic.code == "E103":
                raise
            return self.piece_by_piece(line, word)
        return self.convert(rule, children, line)

    def on_machine_card(self, ch: list[Any], line: Line) -> Any:
        from .build_machine import machine_card

        return machine_card(ch, line)

    def convert(self, rule: str, children: list[Any], line: Line) -> Any:
        method = self.methods.get(rule)
        if method is None:
            method = getattr(self, "on_" + rule, None) or (lambda ch, line: self.element(rule, ch, line))
            self.methods[rule] = method
        return method(children, line)

    def commands(self, reading: Any) -> None:
        """A .control section: its lines, and what of it is known before it runs (build_control.py)."""
        if reading.control_span is None:
            return
        words = [syntax.first_word(line.text) for line in reading.control]
        # an .end among the commands is the deck's own
        if ".end" in words:
            if any(word[:1] == "." and word != ".end" for word in words) or words[-1] != ".end":
                said = "this .control has no .endc, and cards of the deck stand behind it"
                self.sink.error("E106", said, reading.control_span, "close it with .endc")
                return
            del reading.control[words.index(".end") :]
        from .build_control import foreseen

        for line in [x for x in reading.control if syntax.first_word(x.text)[:4] == ".opt"]:
            reading.control.remove(line)  # the deck's, as in ngspice
            try:
                self.body.append(self.convert(*parse_line(line, "dot"), line))
            except LineError as error:
                self.sink.add(error.diagnostic)
        cards = foreseen(reading.control, self.convert)
        self.body += [card for card in cards if not isinstance(card, Analysis)]
        analyses = [card for card in cards if isinstance(card, Analysis)]
        self.body.append(Dot("control", (reading.control, analyses), reading.control_span))

    @staticmethod
    def has_nodes(letter: str) -> bool:
        kind = LETTERS.get(letter)
        return kind is not None and kind.supported and len(kind.terminals) > 1

    def looks_like_card(self, title: str, words: list[str]) -> bool:
        """A dot card, a machine card with its mark, or a numbered element with a value or a waveform."""
        if not words:
            return False
        first = words[0].lower()
        if first[0] == ".":
            return first in _TITLES_BY_SLIP
        if first.upper() in CARDS:
            start = self.file.text.index(title)
            return card_class(Line(self.file, 1, 1, start, start + len(title))) is not None
        if len(words) < 4 or not self.has_nodes(first[0]) or not first[-1].isdigit():
            return False
        wave = words[3].lower().startswith(("pulse(", "sin(", "exp(", "pwl("))
        return wave or (len(words) < 6 and spice_number(words[3]) is not None)

    def judge_title(self, reading: Any) -> None:
        """ngspice takes the first line as the title whatever it says; a card there is probably a slip."""
        words = reading.title.split()
        if self.looks_like_card(reading.title, words):
            read = (
                ", and is read as one, as in ngspice"
                if words[0].lower().startswith(".inc")
                else " and is not read as one"
            )
            text_line = self.file.text_line(reading.title_line)
            col = len(text_line) - len(text_line.lstrip()) + 1
            self.sink.warning(
                "W108",
                f"the first line is the title; this one looks like a card{read}",
                Span(self.file, reading.title_line, col, col + len(reading.title)),
                "put a title line above it",
            )


# the dot cards that a first line may have been meant for
_TITLES_BY_SLIP = (
    ".param", ".func", ".include", ".inc", ".lib", ".model", ".subckt", ".global", ".options", ".option", ".temp",
    ".ic", ".tran", ".op", ".print", ".save", ".gravity",
)  # fmt: skip


def _span_of(owner: Any) -> Span:
    return owner.whole if isinstance(owner, Line) else owner.span


def _not_a_card(line: Line) -> Diagnostic:
    word = line.text.split(None, 1)[0]
    return Diagnostic(
        "error",
        "E107",
        f"`{word[:40]}` begins no card",
        line.span_at(0, min(len(word), 40)),
        "a card begins with a letter or a dot, a comment with `*`",
    )
