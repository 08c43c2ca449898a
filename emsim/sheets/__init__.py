"""Schematics of other programs as decks: a drawing goes in, a deck comes out whose places are those of the drawing.

sheet.py     `Sheet`, what every reader fills: symbols with their pins and cards, wires, labels, texts
nets.py      what is connected, by the rule of each program, and what the nets are called
emit.py      the cards of a sheet and of those below it as a text, each piece with its place in the drawing
library.py   what a library says of one of its names; shipped.py: those that come along
outlines.py  lines of a symbol as its owner drew it
ltspice.py   .asc and .asy; standard symbols: ltspice_symbols.py
kicad.py     .kicad_sch, sexpr.py; what fields of symbols mean to SPICE: kicad_parts.py
qucs.py      .sch of Qucs-S; its components: qucs_parts.py
"""

from __future__ import annotations

import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from ..source import SourceFile

# how a file begins, what it is called, the module that reads it
KINDS = (
    (re.compile(r"\s*Version 4\w*(?:\.\d+)?\s*\n\s*SHEET\s", re.I), "a schematic of LTspice's", "ltspice"),
    (re.compile(r"\s*\(\s*kicad_sch\b"), "a schematic of KiCad's", "kicad"),
    (re.compile(r"\s*<Qucs Schematic\b"), "a schematic of Qucs-S'", "qucs"),
)


def kind(text: str) -> tuple[str, str] | None:
    """What a text is called and the module that reads it, if it is a schematic."""
    return next(((says, module) for begins, says, module in KINDS if begins.match(text)), None)


def deck(file: SourceFile, sink: Sink) -> SourceFile | None:
    """The deck of a schematic, whose `sheet` is the layout and whose `origins` are places in the schematic; None where the file
    is none. What cannot be read is reported with its place (E155, E156)."""
    found = kind(file.text)
    if found is None:
        return None
    from importlib import import_module

    from .emit import emitted

    reader = import_module(f".{found[1]}", __name__)
    sheet = reader.read(file, sink)
    return emitted(sheet, file, reader.DIALECT)


def worded(deck: SourceFile) -> str:
    """The text of a schematic's deck, which says itself in which dialect it is read; a .tran of LTspice's has its step written
    out, so that ngspice reads it too."""
    if deck.dialect is None:
        return deck.text
    title, *rest = deck.text.split("\n")
    return "\n".join([title, f".options dialect={deck.dialect.name}", *map(_stepped, rest)])


def _stepped(card: str) -> str:
    """.tran 10m and .tran 0 10m with a thousandth as the step."""
    words = card.split()
    if words[:1] != [".tran"] or len(words) < 2:
        return card
    from ..units import spice_number

    alone = len(words) < 3 or not words[2][0].isdigit()
    stop = words[1] if alone else words[2]
    if not alone and spice_number(words[1]) != 0.0:
        return card
    value = spice_number(stop)
    return card if not value else " ".join([".tran", f"{value / 1000:g}", stop, *words[2 if alone else 3 :]])
