"""Where a name of the deck's own text is used, and the edits that give it another one.

An occurrence is a word of that spelling that means the same symbol, by the rules of hover and definition. Renaming is checked by
its result: the deck with the new name must be read with the same messages as before, otherwise nothing is edited.
"""

from __future__ import annotations

import re

from .document import Document, Symbol
from .hover import ANYTHING, definition
from .place import Place

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

Use = tuple[int, int, int]  # row, first column, column behind it; from 0
READS = (
    ".step",
    ".dc",
    ".sens",
    ".tf",
    ".noise",
    ".fmu",
    ".pz",
    ".temp",
)  # cards whose words name without saying what


class NotRenamed(Exception):
    """Why a name stays what it is."""


def symbol_under(document: Document, row: int, col: int) -> Symbol | None:
    """What the name at a place stands for: where it is used, or where it is given."""
    for symbol in document.symbols:
        span = symbol.span
        here = span.file is document.file and span.line - 1 == row
        if here and span.col - 1 <= col <= span.end - 1 and span.text.lower() == symbol.name:
            return symbol
    place = Place(document.lines, row, col)
    if place.is_code and place.is_call and place.word:
        return document.find(place.name, ("func",), document.scope_at(row))
    return definition(document, row, col)


def uses(document: Document, row: int, col: int) -> list[Use]:
    """All places of the name under the cursor, in order; empty where there is none."""
    symbol = symbol_under(document, row, col)
    return [] if symbol is None else list(_uses(document, symbol))


def _uses(document: Document, symbol: Symbol) -> Iterator[Use]:
    # points of a body bear its name: arm.tip
    behind = r"(?![\w#$])" if symbol.kind == "body" else r"(?![\w.#$])"
    pattern = re.compile(rf"(?<![\w.#$]){re.escape(symbol.name)}{behind}", re.I)
    for row, line in enumerate(document.lines):
        for found in pattern.finditer(line):
            if _means(document, symbol, row, found):
                yield row, found.start(), found.end()


def _means(document: Document, symbol: Symbol, row: int, found: re.Match[str]) -> bool:
    col = found.start()
    place = Place(document.lines, row, col)
    if not place.is_code:
        return False
    meant = symbol_under(document, row, col)
    if meant is None:
        return place.card in READS and bool(place.words) and not place.is_key
    if meant is symbol:
        return True
    dotted = found.string[found.end() : found.end() + 1] == "."
    return dotted and symbol.kind == "body" and meant.kind == "point" and meant.scope == symbol.scope


def rename(document: Document, row: int, col: int, new: str) -> list[Use]:
    """The places that are to read `new`. Raises NotRenamed."""
    symbol = symbol_under(document, row, col)
    if symbol is None:
        raise NotRenamed("there is no name here that the deck gives")
    _check(document, symbol, new)
    found = list(_uses(document, symbol))
    lines = list(document.lines)
    for at, start, end in reversed(found):
        lines[at] = lines[at][:start] + new + lines[at][end:]
    after = Document("\n".join(lines), document.file.path)
    if _said(after) != _said(document):
        told = next(
            (d.message for d in after.diagnostics if (d.severity, d.code) not in _said(document)), "it fails"
        )
        raise NotRenamed(f"not everything that names {symbol.name} is found; with {new}: {told}")
    return found


def _said(document: Document) -> list[tuple[str, str | None]]:
    return sorted((d.severity, d.code or "") for d in document.diagnostics)


def _check(document: Document, symbol: Symbol, new: str) -> None:
    name, kind = symbol.name, symbol.kind
    if symbol.span.file is not document.file:
        raise NotRenamed(f"{name} is given in {symbol.span.file.name}")
    if name == "0" or (kind == "node" and name == "gnd"):
        raise NotRenamed("ground is 0 everywhere")
    if kind == "param" and symbol.scope and name in getattr(_subckt(document, symbol), "params", {}):
        raise NotRenamed(f"lines that use subcircuit {symbol.scope[-1]} give {name}=, in other files too")
    form = (
        r"[\w#$]+"
        if kind == "node"
        else r"[^\W\d][\w#$]*(\.[\w#$]+)?"
        if kind == "point"
        else r"[^\W\d][\w#$]*"
    )
    if not re.fullmatch(form, new) or new.lower() in ("0", "gnd"):
        raise NotRenamed(f"{new!r} is no name for a {kind}")
    if kind == "element" and new[0].lower() != name[0]:
        raise NotRenamed(f"the first letter of {name} says what it is: {name[0]}..")
    if kind == "point" and new.lower().partition(".")[0] != name.partition(".")[0]:
        raise NotRenamed(f"{name} is a point of {name.partition('.')[0]}")
    other = document.find(new, ANYTHING, symbol.scope)
    if other is not None and other is not symbol:
        raise NotRenamed(f"there is a {other.kind} {new} already")


def _subckt(document: Document, symbol: Symbol) -> object:
    found = document.find(symbol.scope[-1], ("subckt",), symbol.scope[:-1])
    return None if found is None else found.card
