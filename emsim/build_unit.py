"""`FMU name file.fmu in=(u=v(a)) out=(y v(b)=z) p=(k=2) step=1m`: an FMU of others as part of the deck."""

from __future__ import annotations

import re

from .build_expr import expression
from .deck import MachineCard
from .diagnostics import Diagnostic
from .expr import Node, Num
from .parsed import parse_line
from .source import Line
from .syntax import LineError, uncommented
from .units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn

FORM = "FMU name file.fmu in=(u=v(a) ..) out=(y v(b)=z ..) [p=(k=2 ..)] [step=1m] [kind=cosim|model] [log=yes|no]"
LISTS = ("in", "out", "p")
_BRACKETS = r"\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)"
_QUOTED = r"'[^']*'|\"[^\"]*\""
_WORD = re.compile(rf"(?:{_QUOTED}|\{{[^}}]*\}}|{_BRACKETS}|[^\s,='\"{{}}()])+")
_EQUAL = re.compile(r"\s*=(?!=)\s*")
_VOLTAGE = re.compile(r"v\(([^(),\s]+)(?:,([^(),\s]+))?\)", re.IGNORECASE)


class _Reading:
    """The words of one line, one after the other."""

    def __init__(self, line: Line) -> None:
        self.line, self.text, self.at = line, uncommented(line.text).rstrip(), 0

    def skip(self) -> bool:
        """To the next word; False at the end."""
        while self.at < len(self.text) and self.text[self.at] in " \t\r\n\f,":
            self.at += 1
        return self.at < len(self.text)

    def word(self, what: str) -> tuple[str, int, int]:
        self.skip()
        found = _WORD.match(self.text, self.at)
        if found is None:
            self.wrong(self.at, self.at + 1, f"{what} is missing here")
        self.at = found.end()
        return found[0], found.start(), found.end()

    def sets(self) -> bool:
        """Is there an equals sign? It is passed."""
        found = _EQUAL.match(self.text, self.at)
        self.at = self.at if found is None else found.end()
        return found is not None

    def wrong(self, start: int, end: int, said: str) -> NoReturn:
        raise wrong(self.line, start, end, said)


def unit(line: Line) -> MachineCard:
    """The card. Its parameters: `file`, words (step, kind, ..), and for each item of a list `in u`, `out y`, `p k` with the
    expression, the name of a variable, the number or text. Raises LineError (E386)."""
    read = _Reading(line)
    read.word("FMU")
    name, start, end = read.word("the card's name")
    card = MachineCard("FMU", name.lower(), [], {}, None, line.span_at(start, end), {}, line)
    path, start, end = read.word("the file")
    card.params["file"] = _bare(path)
    card.param_spans["file"] = line.span_at(start, end)
    while read.skip():
        key, start, end = read.word("a list")
        if not read.sets():
            read.wrong(start, end, f"`{key}` stands in no list")
        key = key.lower()
        if key in LISTS:
            _list(read, card, key)
            continue
        value, start, end = read.word(f"the value of {key}")
        if key in card.params:
            read.wrong(start, end, f"`{key}` is given twice")
        number = spice_number(value)
        card.params[key] = _bare(value).lower() if number is None else number
        card.param_spans[key] = line.span_at(start, end)
    return card


def _list(read: _Reading, card: MachineCard, key: str) -> None:
    if read.text[read.at : read.at + 1] != "(":
        read.wrong(read.at, read.at + 1, f"{key}= is a list in parentheses")
    begin = read.at
    read.at += 1
    while read.skip() and read.text[read.at] != ")":
        _item(read, card, key)
    if read.at >= len(read.text):
        read.wrong(begin, begin + 1, "this parenthesis is never closed")
    read.at += 1


def _item(read: _Reading, card: MachineCard, key: str) -> None:
    """`u=expression` of in, `k=number` or `k='text'` of p, `y`, `name=y`, `v(node)=y` of out."""
    target, start, end = read.word("a variable")
    value, value_start, value_end = target, start, end
    if read.sets():
        value, value_start, value_end = read.word("what it is to be")
    elif key != "out":
        read.wrong(
            start, end, f"`{target}` is given no value: {key}=({target}={'v(node)' if key == 'in' else '1'})"
        )
    voltage = _VOLTAGE.fullmatch(target) if key == "out" and value is not target else None
    own = _bare(target)
    if voltage is not None:
        own = f"v({','.join(n.lower() for n in voltage.groups() if n)})"
    elif key == "out":
        own = own.lower()
        if not own.replace("_", "a").isalnum() or own[:1].isdigit():
            read.wrong(
                start, end, f"`{own}` is no name that expressions could read: give it one, out=(y={target})"
            )
    where = f"{key} {own}"
    if where in card.params:
        read.wrong(start, end, f"`{own}` is given twice")
    found: object
    if key == "out":
        found = _bare(value)
    elif key == "p" and value[0] in "'\"":
        found = value[1:-1]
    else:
        found = _expression(read.line, value, value_start, value_end)
    card.params[where] = found
    card.param_spans[where] = read.line.span_at(start, value_end)


def _expression(line: Line, text: str, start: int, end: int) -> Node:
    if text[0] in "'\"{":
        start, end = start + 1, end - 1
    place = Line(line.file, line.number, line.col + start, line.start + start, line.start + end)
    node = expression(parse_line(place, "expression"), place)
    return node if isinstance(node, Node) else Num(float(node))


def _bare(word: str) -> str:
    return word[1:-1] if word[0] in "'\"" and word[-1] == word[0] and len(word) > 1 else word


def wrong(line: Line, start: int, end: int, said: str) -> LineError:
    return LineError(
        Diagnostic("error", "E386", said, line.span_at(start, max(end, start + 1)), f"the form is: {FORM}")
    )
