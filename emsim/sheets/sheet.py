"""What a schematic holds, whoever drew it. Coordinates are whole numbers of the program's own unit, x to the right, y downwards.

A symbol says its cards as pieces: words of the file with their places, and pins, which are written as the names of their nets. So
one program's resistor and another's are the same here, and a part that needs a model brings its card along.
"""

from __future__ import annotations

from ..source import SourceFile

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    Point = tuple[int, int]
    Card = list["Word | Pin | str"]


# grid units of a drawing (schematic/symbols.py) in one unit of the program's: two-pin parts are as long as ours, 6
SCALES = {
    "ltspice": 1.5 / 16,  # a capacitor is 64 long
    "kicad": 1 / 12_700,  # a resistor is 7.62 mm long, in units of 0.1 um
    "qucs": 0.1,  # a resistor is 60 long
}


class Word(str):
    """A word with its place in the file: line and column from 1; line 0 where it stands nowhere."""

    __slots__ = ("col", "line")
    line: int
    col: int


def word(text: str, line: int = 0, col: int = 1) -> Word:
    found = Word(text)
    found.line, found.col = line, col
    return found


class Pin:
    """`net` is its name when `nets.connect` has run; `place` what a message points to."""

    __slots__ = ("name", "net", "place", "x", "y")

    def __init__(self, x: int, y: int, name: str, place: Word) -> None:
        self.x, self.y, self.name, self.place = x, y, name, place
        self.net = ""


class Symbol:
    """`name` is that of its element in the deck, "" where it has none. `cards` are what it becomes. `strokes` are its lines as
    the file has them (outlines.py), None where the drawing has a symbol of its own for such an element. `texts`: (x, y,
    anchor, words)."""

    __slots__ = ("cards", "name", "pins", "strokes", "texts")

    def __init__(self, name: str, pins: list[Pin], cards: list[Card]) -> None:
        self.name, self.pins, self.cards = name, pins, cards
        self.strokes: list[list[Any]] | None = None
        self.texts: list[tuple[float, float, str, str]] = []

    @property
    def terminals(self) -> list[Pin]:
        """Pins in the order of its element's terminals, then those that are none."""
        card = next(
            (
                c
                for c in self.cards
                if self.name in [str(piece).lower() for piece in c[:2] if isinstance(piece, str)]
            ),
            [],
        )
        found = [piece for piece in card if isinstance(piece, Pin) and piece in self.pins]
        return [*found, *(pin for pin in self.pins if pin not in found)]


class Wire:
    __slots__ = ("a", "b", "net")

    def __init__(self, a: Point, b: Point) -> None:
        self.a, self.b = a, b
        self.net = ""


class Label:
    """A name at a point. `rank`: of several on one net the least says what it is called; nets of labels with one `key` are one.
    `mark`: how it is drawn: "ground", "port", "name", or "" where a symbol draws it; `shown`: as what; `turns`: of a ground, to
    the left by quarters; `seat`: where its words begin, if the file says so."""

    __slots__ = ("at", "key", "mark", "name", "net", "place", "rank", "seat", "shown", "turns")

    def __init__(
        self, at: Point, name: str, place: Word, rank: int, mark: str, key: str = "", shown: str = ""
    ) -> None:
        self.at, self.name, self.place, self.rank, self.mark = at, name, place, rank, mark
        self.key, self.shown, self.net = key or name.lower(), shown or name, name
        self.turns = 0
        self.seat: Point | None = None


class Sheet:
    """`name` is that of its subcircuit, "" for the deck itself; `ports` are the nets of its terminals, `parameters` its own with
    what they are where nobody says. `scale`: grid units of a
    drawing (schematic/symbols.py) in one unit of the program's."""

    most_below = 50  # schematics within schematics

    def __init__(self, file: SourceFile, scale: float, name: str = "") -> None:
        self.file, self.scale, self.name = file, scale, name
        self.ports: list[str] = []
        self.parameters: dict[str, str] = {}
        self.symbols: list[Symbol] = []
        self.wires: list[Wire] = []
        self.labels: list[Label] = []
        self.junctions: list[Point] = []
        self.lines: list[list[Any]] = []  # strokes that belong to no symbol
        self.texts: list[tuple[float, float, str, str]] = []
        self.cards: list[Card] = []  # directives
        self.below: dict[
            str, Sheet
        ] = {}  # subcircuits by name; those of all sheets stand in the uppermost one
