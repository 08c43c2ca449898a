"""The cards of a sheet as a deck, and where each of their words stands in the schematic."""

from __future__ import annotations

import os

from ..source import SourceFile
from .sheet import Pin, Word, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..dialects import Dialect
    from .sheet import Card, Sheet

Piece = tuple[int, int, SourceFile, int, int]  # columns from and to, file, line, column there


class Text:
    """Lines that come, with `origins` by their numbers."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.origins: dict[int, list[Piece]] = {}

    def add(self, file: SourceFile, card: Card) -> None:
        """A card: words with places in `file`; lines that continue it follow as cards of their own."""
        out, pieces = "", []
        for piece in card:
            text, place = (piece.net, piece.place) if isinstance(piece, Pin) else (piece, piece)
            if not text:
                continue
            out += " " if out else ""
            if isinstance(place, Word) and place.line:
                pieces.append((len(out) + 1, len(out) + 1 + len(text), file, place.line, place.col))
            out += text
        self.lines.append(out)
        if pieces:
            self.origins[len(self.lines)] = pieces

    def sheet(self, sheet: Sheet) -> None:
        if sheet.name:
            self.add(
                sheet.file,
                [
                    ".subckt",
                    sheet.name,
                    *sheet.ports,
                    *(f"{k}={v}" for k, v in sheet.parameters.items() if v),
                ],
            )
        for symbol in sheet.symbols:
            for card in symbol.cards:
                self.add(sheet.file, card)
        for card in sheet.cards:
            self.add(sheet.file, card)
        if sheet.name:
            self.add(sheet.file, [".ends", sheet.name])


def emitted(sheet: Sheet, file: SourceFile, dialect: Dialect | None) -> SourceFile:
    """The deck of a sheet and of the subcircuits below it."""
    text = Text()
    title = os.path.basename(file.name)
    text.add(file, [word(title)])
    text.sheet(sheet)
    for below in sheet.below.values():
        text.sheet(below)
    text.add(file, [".end"])
    deck = SourceFile(file.name, "\n".join(text.lines) + "\n", file.path, file.included_from)
    deck.origins, deck.sheet, deck.dialect = text.origins, sheet, dialect
    return deck
