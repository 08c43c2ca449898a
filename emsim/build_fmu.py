"""`.fmu in=v1,load param=v2 tune=r1 out=v(out),angle(arm)`: what an FMU of the deck takes and gives."""

from __future__ import annotations

import re

from .build_expr import expression
from .deck import Dot, Probe
from .diagnostics import Diagnostic
from .expr import Name, Num
from .parsed import parse_line
from .source import Line
from .syntax import LineError, code_end

FORM = ".fmu in=v1,load param=v2 tune=r1 out=v(out),angle(arm)"
LISTS = ("in", "param", "tune", "out")
_BRACKETS = r"\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)"
_PIECE = re.compile(
    rf"(?:(?P<key>\w+)\s*=(?!=)\s*)|(?P<word>(?:'[^']*'|\"[^\"]*\"|\{{[^}}]*\}}|{_BRACKETS}|[^\s,='\"{{}}()])+)"
)


def fmu(line: Line, start: int) -> Dot:
    """The card whose words begin at `start` of the line; items: list -> its probes. Raises LineError (E380)."""
    text = line.text[: code_end(line.text)]
    lists: dict[str, list[Probe]] = {}
    into: list[Probe] | None = None
    at = start
    while at < len(text):
        if text[at] in " \t,":
            at += 1
            continue
        piece = _PIECE.match(text, at)
        if piece is None:
            raise wrong(line, at, at + 1, f"`{text[at]}` does not fit here")
        at = piece.end()
        if piece["key"]:
            key = piece["key"].lower()
            if key not in LISTS:
                raise wrong(line, piece.start(), piece.end(), f".fmu has no list `{key}`")
            into = lists.setdefault(key, [])
        elif into is None:
            raise wrong(line, piece.start(), at, f"`{piece['word']}` stands in no list")
        else:
            into.append(_probe(line, *piece.span("word"), is_signal=into is lists.get("out")))
    empty = next((key for key in LISTS if lists.get(key) == []), None)
    if empty or not lists:
        raise wrong(line, 0, len(text), f".fmu has an empty list `{empty}`" if empty else ".fmu has no lists")
    return Dot("fmu", lists, line.whole)


def _probe(line: Line, start: int, end: int, is_signal: bool) -> Probe:
    span = line.span_at(start, end)
    text = line.text[start:end]
    if not is_signal:
        return Probe(text.lower(), Name(text.lower(), span), span)
    if text[0] in "'\"{":
        start, end = start + 1, end - 1
    place = Line(line.file, line.number, line.col + start, line.start + start, line.start + end)
    ast = expression(parse_line(place, "expression"), place)
    if isinstance(ast, Num):
        ast = Name(text.lower(), span)  # a node whose name is a number
    return Probe(line.text[start:end].strip(), ast, span)


def wrong(line: Line, start: int, end: int, said: str) -> LineError:
    return LineError(Diagnostic("error", "E380", said, line.span_at(start, end), f"form: {FORM}"))
