"""LTspice's schematics (.asc) and symbols (.asy), as its help has them: "Schematic Capture", "Creating New Symbols".

A symbol is a file beside the drawing, or a standard one (ltspice_symbols.py). Its attributes, of which the drawing states others,
are a card: name, nodes, SpiceModel, Value, Value2, SpiceLine, SpiceLine2. Where SpiceModel is a file and the prefix is X, it is a
library, and Value is only shown. A prefix that is the word of a machine's card makes such a card. A symbol without a prefix is a
schematic of its name beside the drawing: a subcircuit.
"""

from __future__ import annotations

import os
import re

from ..cards import CARDS
from ..diagnostics import Span, suggest
from ..dialects import find
from ..source import SourceFile, load
from . import outlines, shipped
from .library import model_of
from .ltspice_symbols import OWN, standard
from .nets import Rule, connect
from .sheet import SCALES, Label, Pin, Sheet, Symbol, Wire, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .sheet import Card, Point, Word

DIALECT = find("ltspice")
RULE = Rule(tees=True, pins=True, labels=True, number=lambda k: f"N{k:03d}")
SHOWN = ("SpiceModel", "Value", "Value2", "SpiceLine", "SpiceLine2")  # what follows the nodes, in this order
# attributes by the number of their window
WINDOWS = {0: "InstName", 3: "Value", 123: "Value2", 39: "SpiceLine", 40: "SpiceLine2", 38: "SpiceModel"}
# models that LTspice has without a card, by their names: what the card would say
DEFAULTS = {
    name: f".model {name} {name}"
    for name in (
        "D",
        "NPN",
        "PNP",
        "LPNP",
        "NMOS",
        "PMOS",
        "NJF",
        "PJF",
        "NMF",
        "PMF",
        "LTRA",
        "URC",
        "SW",
        "CSW",
    )
}
MIDDLE = re.compile(r"^(\d+)(meg|[tgkmunpf])(\d+)$", re.I)  # a value whose letter stands for the dot
# files of LTspice's models without a card, by the letters of elements that take them
STANDARD = {"Q": "standard.bjt", "D": "standard.dio", "M": "standard.mos", "J": "standard.jft"}
FOLDERS = "LTSPICE_LIB"  # an environment variable: LTspice's lib folders, which hold sym, sub and cmp
INSTALLED = ("~/Documents/LTspice/lib", "~/Documents/LTspiceXVII/lib", "~/AppData/Local/LTspice/lib")


class Shape:
    """A symbol: `pins` are (name, x, y) by the order of the netlist, `windows` (x, y, how) by number, `strokes` in its own
    coordinates or None. `block`: it stands for a schematic."""

    def __init__(self) -> None:
        self.pins: list[tuple[str, int, int]] = []
        self.attributes: dict[str, str] = {}
        self.windows: dict[int, tuple[int, int, str]] = {}
        self.strokes: list[list[Any]] | None = None
        self.texts: list[tuple[int, int, str, str]] = []
        self.path: str | None = None
        self.block = False


class Placed:
    """A symbol as it stands in a drawing: its line, its attributes with their places."""

    def __init__(self, name: Word, at: Point, turn: str) -> None:
        self.name, self.at, self.turn = name, at, turn
        self.attributes: dict[str, Word] = {}
        self.windows: dict[int, tuple[int, int, str]] = {}


def read(file: SourceFile, sink: Sink) -> Sheet:
    """The sheet of a drawing, with those of the schematics below it."""
    return Reader(sink, {}).sheet(file, "")


def turned(p: Point, turn: str) -> Point:
    """A point of a symbol that stands as `turn` says: R0, R90 .. clockwise as seen, M0 .. left and right changed after that."""
    x, y = p
    for _ in range(int(turn[1:]) // 90):
        x, y = -y, x
    return (-x if turn[0] == "M" else x), y


class Reader:
    """`below`: the subcircuits that schematics beside the drawing make, by name."""

    def __init__(self, sink: Sink, below: dict[str, Sheet]) -> None:
        self.sink, self.below = sink, below
        self.shapes: dict[str, Shape | None] = {}
        self.standard = standard()
        self.depth = 0

    def sheet(self, file: SourceFile, name: str) -> Sheet:
        own = Sheet(file, SCALES["ltspice"], name)
        own.below = self.below
        placed = self._lines(own)
        ties: list[tuple[Point, Point]] = []
        found = [(p, self._shape(p, file)) for p in placed]
        made = [(p, shape, self._symbol(own, p, shape)) for p, shape in found if shape is not None]
        for _, shape, symbol in made:
            own.symbols.append(symbol)
            if not shape.attributes.get("Prefix") and not shape.block:
                ties += [((symbol.pins[0].x, symbol.pins[0].y), (q.x, q.y)) for q in symbol.pins[1:]]
        self._netlist(own, ties)
        for p, shape, symbol in made:
            symbol.cards = self._cards(own, p, shape, symbol)
        if not name:
            self._defaults(own)
        return own

    def _netlist(self, own: Sheet, ties: list[tuple[Point, Point]]) -> None:
        for net, labels in connect(own, RULE, ties).items():
            other = next((one for one in labels if one.name.lower() != net.lower()), None)
            if other is not None:
                said = f"one net is called {net} and {other.name}: it is {net} here"
                self.sink.warning("W155", said, _span(own.file, other.place), "a net has one name")

    # ---- lines of the drawing ----

    def _lines(self, own: Sheet) -> list[Placed]:
        placed: list[Placed] = []
        for number, text in enumerate(own.file.text.split("\n"), 1):
            words = text.split()
            if not words:
                continue
            try:
                self._line(own, placed, number, text, words)
            except (ValueError, IndexError):
                whole = Span(own.file, number, 1, len(text) + 1)
                self.sink.error("E155", f"this line of the schematic is no {words[0]}", whole)
        return placed

    def _line(self, own: Sheet, placed: list[Placed], number: int, text: str, words: list[str]) -> None:
        key = words[0].upper()
        if key == "WIRE":
            a, b, c, d = map(int, words[1:5])
            own.wires.append(Wire((a, b), (c, d)))
        elif key == "FLAG":
            at, name = (int(words[1]), int(words[2])), _rest(text, number, 3)
            ground = name.upper() in ("0", "GND")
            mark = "ground" if ground else "name"
            own.labels.append(
                Label(at, "0" if ground else name.replace(" ", "_"), name, 0 if ground else 1, mark)
            )
        elif key == "IOPIN":
            at = (int(words[1]), int(words[2]))
            for label in own.labels:
                label.mark = "port" if label.at == at else label.mark
        elif key == "SYMBOL":
            name = word(" ".join(words[1:-3]), number, text.index(words[1]) + 1)
            if words[-1][0] not in "RM" or int(words[-1][1:]) % 90:
                raise ValueError
            placed.append(Placed(name, (int(words[-3]), int(words[-2])), words[-1]))
        elif key == "SYMATTR" and placed:
            placed[-1].attributes[words[1]] = _rest(text, number, 2)
        elif key == "WINDOW" and placed:
            placed[-1].windows[int(words[1])] = (int(words[2]), int(words[3]), words[4])
        elif key == "TEXT":
            self._text(own, number, text, words)
        elif key in ("LINE", "RECTANGLE", "CIRCLE", "ARC"):
            own.lines.append(_stroke(key, [int(w) for w in words[2:10]]))
        elif key == "BUSTAP":
            whole = Span(own.file, number, 1, len(text) + 1)
            self.sink.error("E155", "buses are not read", whole, "draw its wires one by one")

    def _text(self, own: Sheet, number: int, text: str, words: list[str]) -> None:
        """A comment, or directives, one a line."""
        body = _rest(text, number, 5)
        anchor = {"left": "start", "right": "end"}.get(words[3].lower(), "middle")
        x, y = int(words[1]), int(words[2])
        at = body.col + 1
        for k, line in enumerate(body[1:].split("\\n")):
            own.texts.append((x, y + 22 * k, anchor, line.strip()))
            if body[:1] == "!" and line.strip() and line.strip().lower() not in (".end", ".backanno"):
                blank = len(line) - len(line.lstrip())
                card = _plain(word(line.strip(), number, at + blank))
                names = re.match(r"(\.lib|\.include|\.inc)\s+(\S.*)$", card, re.I)
                path = _shipped(word(names[2]), own.file) if names else ""
                path = f'"{path}"' if " " in path and '"' not in path else path
                lies = names is not None and (path != names[2] or self._lies(own, path))
                ours = shipped.cards(path) if names and not lies else None
                moved = (
                    word(f"{names[1]} {path}", card.line, card.col) if names and path != names[2] else card
                )
                own.cards += ours or [[moved]]
            at += len(line) + 2

    def _lies(self, own: Sheet, name: str) -> bool:
        """Does a file lie beside the drawing?"""
        return _beside(os.path.dirname(own.file.path or ""), name) is not None

    # ---- symbols ----

    def _shape(self, p: Placed, file: SourceFile) -> Shape | None:
        """What a symbol is; None, with a message, where nobody knows."""
        folder = os.path.dirname(file.path or "")
        name = re.sub(r"\\+(?! )", "/", p.name).replace("\\ ", " ") + ".asy"
        path = _beside(folder, name)
        if path is None and os.path.basename(name)[:-4].lower() not in self.standard:
            path = next(
                (at for f in libraries() if (at := _beside(os.path.join(f, "sym"), name, True))), None
            )
        key = path or p.name.lower().replace("\\", "/").rpartition("/")[2]
        if key not in self.shapes:
            self.shapes[key] = self._file(path, p, file) if path else self._known(key)
        shape = self.shapes[key]
        if shape is None and not path:
            span = _span(file, p.name)
            if key in OWN:
                said = f"`{p.name}` is a part of LTspice's own, whose law no card of SPICE has"
                self.sink.error("E156", said, span, "write what it does as a B source")
            else:
                near = suggest(key, self.standard)
                hint = f"copy {key}.asy, and the library that it names, beside the schematic"
                self.sink.error(
                    "E156", f"there is no symbol `{p.name}`", span, f"did you mean {near}?" if near else hint
                )
        return shape

    def _known(self, name: str) -> Shape | None:
        known = self.standard.get(name)
        if known is None:
            return None
        shape = Shape()
        shape.pins, shape.attributes = known.pins, known.attributes
        shape.windows = {k: (x, y, "Left") for k, (x, y) in known.windows.items()}
        return shape

    def _file(self, path: str, p: Placed, file: SourceFile) -> Shape | None:
        """The symbol of a file beside the drawing."""
        span = _span(file, p.name)
        try:
            text = load(path, span).text
        except (OSError, ValueError) as error:
            self.sink.error("E501", f"cannot read {os.path.basename(path)}: {error}", span)
            return None
        shape, pins = Shape(), []
        shape.path, shape.strokes = path, []
        order: list[int] = []
        for line in text.split("\n"):
            words = line.split()
            key = words[0].upper() if words else ""
            try:
                if key == "SYMBOLTYPE":
                    shape.block = words[1].upper() == "BLOCK"
                elif key == "PIN":
                    pins.append(("", int(words[1]), int(words[2]), words[3] if len(words) > 3 else "NONE"))
                    order.append(len(pins))
                elif key == "PINATTR" and words[1] == "PinName":
                    pins[-1] = (" ".join(words[2:]), *pins[-1][1:])
                elif key == "PINATTR" and words[1] == "SpiceOrder":
                    order[-1] = int(words[2])
                elif key == "SYMATTR":
                    shape.attributes[words[1]] = " ".join(words[2:])
                elif key == "WINDOW":
                    shape.windows[int(words[1])] = (int(words[2]), int(words[3]), words[4])
                elif key in ("LINE", "RECTANGLE", "CIRCLE", "ARC"):
                    shape.strokes.append(_stroke(key, [int(w) for w in words[2:10]]))
                elif key == "TEXT":
                    shape.texts.append((int(words[1]), int(words[2]), words[3], " ".join(words[5:])))
            except (ValueError, IndexError):
                self.sink.error("E155", f"{os.path.basename(path)}: `{line.strip()}` is no {key}", span)
                return None
        shape.pins = [pin[:3] for _, pin in sorted(zip(order, pins, strict=True), key=lambda pair: pair[0])]
        for name, x, y, side in pins:
            if side.upper() != "NONE" and name:
                aside = {"LEFT": 8, "RIGHT": -8}.get(side.upper(), 0)
                below = {"TOP": 12, "BOTTOM": -12}.get(side.upper(), 0)
                shape.texts.append((x + aside, y + below, side, name.removeprefix("_")))
        shape.block = not shape.attributes.get("Prefix")
        return shape

    def _symbol(self, own: Sheet, p: Placed, shape: Shape) -> Symbol:
        def at(x: float, y: float) -> tuple[Any, Any]:
            dx, dy = turned((x, y), p.turn)  # type: ignore[arg-type]
            return p.at[0] + dx, p.at[1] + dy

        prefix = self._attribute(p, shape, "Prefix")
        inst = p.attributes.get("InstName") or word("?", p.name.line, p.name.col)
        machine = prefix.upper() in CARDS
        name = f"X{inst}" if shape.block else str(inst) if machine else _named(inst, prefix)
        pins = [Pin(*at(x, y), pin, p.name) for pin, x, y in shape.pins]
        symbol = Symbol(name.lower() if prefix or shape.block else "", pins, [])
        if shape.strokes is not None:
            symbol.strokes = [_moved(s, at) for s in shape.strokes]
        elif shape.attributes.get("Value", "").startswith("opamp"):
            symbol.strokes = [_moved(s, at) for s in _triangle(len(shape.pins) > 3)]
        elif not prefix:
            symbol.strokes = [["line", [(q.x, q.y) for q in pins]]]
        for x, y, how, said in shape.texts:
            symbol.texts.append((*at(x, y), _anchor(how, p.turn), said))
        windows = {0: (0, 0, "Left"), 3: (0, 32, "Left"), **shape.windows, **p.windows}
        for number, (x, y, how) in windows.items():
            said = self._attribute(p, shape, WINDOWS.get(number, ""))
            if said and how != "Invisible" and (number in (0, 3) or number in p.windows):
                symbol.texts.append((*at(x, y), _anchor(how, p.turn), said))
        return symbol

    def _attribute(self, p: Placed, shape: Shape, key: str) -> Word:
        """As the drawing states it, else as the symbol does."""
        found = p.attributes.get(key)
        if found is None:
            found = word(shape.attributes.get(key, ""), p.name.line, p.name.col)
        return word("") if found == '""' else found

    # ---- cards ----

    def _cards(self, own: Sheet, p: Placed, shape: Shape, symbol: Symbol) -> list[Card]:
        prefix = self._attribute(p, shape, "Prefix")
        values = {key: _plain(self._attribute(p, shape, key)) for key in SHOWN}
        if prefix[:1].upper() in ("R", "C", "L"):
            values["Value"] = _dotted(values["Value"])
        inst = p.attributes.get("InstName")
        if not symbol.name:
            return []
        if inst is None:
            self.sink.error(
                "E156", f"this `{p.name}` has no name", _span(own.file, p.name), "add SYMATTR InstName"
            )
            return []
        if prefix.upper() in CARDS:
            return [[prefix, inst, *symbol.pins, *(v for v in values.values() if v)]]
        name = _named(inst, prefix)
        if shape.block:
            name = word(f"X{inst}".replace(" ", "_"), inst.line, inst.col)
            return self._block(own, p, shape, symbol, [name, *symbol.pins], values)
        cards: list[Card] = []
        library = self._attribute(p, shape, "ModelFile")
        kind = prefix[:1].upper()
        if kind == "X" and "." in values["SpiceModel"] and not library:
            library = values["SpiceModel"]
            values["SpiceModel"] = values["Value"] = word("") if values["Value2"] else values["Value"]
            values["SpiceModel"] = word("")
        include: Card = [".lib", _shipped(library, own.file)]
        if library and include not in [c for s in own.symbols for c in s.cards]:
            cards.append(include)
        pins: list[Any] = list(symbol.pins)
        if kind == "M" and len(pins) == 3:
            pins.append(pins[2])
        if kind == "A":
            said = f"`{p.name}` is a part of LTspice's own, whose law no card of SPICE has"
            self.sink.error("E156", said, _span(own.file, p.name), "write what it does as a B source")
            return []
        return [*cards, [name, *pins, *(v for v in values.values() if v)]]

    def _block(
        self, own: Sheet, p: Placed, shape: Shape, symbol: Symbol, head: Card, values: dict[str, Word]
    ) -> list[Card]:
        """A use of the schematic that lies beside its symbol."""
        assert shape.path is not None
        path = _beside(os.path.dirname(shape.path), os.path.basename(shape.path)[:-4] + ".asc")
        of = os.path.basename(shape.path)[:-4].replace(" ", "_")
        if path is None:
            said = f"the symbol `{p.name}` has no Prefix, and no schematic of its name lies beside it"
            self.sink.error("E156", said, _span(own.file, p.name), f"put {of}.asc beside it")
            return []
        if of.lower() not in self.below and self.depth < Sheet.most_below:
            span = _span(own.file, p.name)
            try:
                file = load(path, span)
            except (OSError, ValueError) as error:
                self.sink.error("E501", f"cannot read {os.path.basename(path)}: {error}", span)
                return []
            self.below[of.lower()] = Sheet(file, SCALES["ltspice"], of)  # for one that is within itself
            self.depth += 1
            sheet = self.below[of.lower()] = self.sheet(file, of)
            self.depth -= 1
            known = {label.name.lower(): label.name for label in sheet.labels}
            for name, _, _ in shape.pins:
                if name.lower() not in known:
                    said = f"no net of {os.path.basename(path)} is called `{name}`, as a pin of `{p.name}` is"
                    self.sink.warning("W155", said, span, "nothing is connected to that pin")
            sheet.ports = [known.get(name.lower(), name) for name, _, _ in shape.pins]
        params = [v for v in values.values() if v]
        return [[*head, of, *(["params:", *params] if params else [])]]

    def _defaults(self, own: Sheet) -> None:
        """Cards of models that LTspice has by their names, where a card asks for one."""
        stated = {
            str(card[0]).split()[1].lower()
            for card in own.cards
            if str(card[0]).lower().startswith(".model ")
        }
        sheets = [own, *self.below.values()]
        asked = {str(card[-1]) for s in sheets for symbol in s.symbols for card in symbol.cards if card}
        for kind, file in STANDARD.items():
            used = {
                str(c[-1])
                for s in sheets
                for y in s.symbols
                for c in y.cards
                if c and str(c[0])[:1].upper() == kind
            }
            own.cards += _models(
                file, {name for name in used if name.lower() not in stated and name not in DEFAULTS}
            )
        self._three(own, sheets)
        for name, card in DEFAULTS.items():
            if name in asked and name.lower() not in stated:
                own.cards.append([card])

    def _three(self, own: Sheet, sheets: list[Sheet]) -> None:
        """A power transistor has no bulk: its fourth node, the source once more, is left out."""
        texts = [str(piece) for sheet in sheets for card in sheet.cards for piece in card]
        files = [
            m[1].strip("\"'")
            for text in texts
            if (m := re.match(r"\.(?:lib|include|inc)\s+(\S.*)$", text, re.I))
        ]
        folder = os.path.dirname(own.file.path or "")
        for card in (card for sheet in sheets for symbol in sheet.symbols for card in symbol.cards):
            if card and str(card[0])[:1] == "M" and len(card) > 5 and card[3] is card[4]:
                name = re.escape(str(card[5]).split()[0])
                stated = any(re.match(rf"\.model\s+{name}\s+vdmos\b", text, re.I) for text in texts)
                if stated or any(model_of(os.path.join(folder, f), str(card[5])) == "VDMOS" for f in files):
                    del card[4]


# ---- pieces ----


def _span(file: SourceFile, place: Word) -> Span:
    return Span(file, place.line, place.col, place.col + max(1, len(place)))


def _rest(text: str, number: int, skip: int) -> Word:
    """What follows the first words of a line."""
    at = 0
    for _ in range(skip):
        while at < len(text) and text[at].isspace():
            at += 1
        while at < len(text) and not text[at].isspace():
            at += 1
    while at < len(text) and text[at].isspace():
        at += 1
    return word(text[at:].rstrip(), number, at + 1)


def _plain(given: Word) -> Word:
    """With the letter u for micro: as many letters, so that places stay."""
    return word(given.replace("\u00b5", "u").replace("\u03bc", "u"), given.line, given.col)


def _dotted(given: Word) -> Word:
    """4k7 is 4.7k."""
    return word(MIDDLE.sub(r"\1.\3\2", given), given.line, given.col)


def libraries() -> list[str]:
    """LTspice's own folders on this machine."""
    given = [f for f in os.environ.get(FOLDERS, "").split(os.pathsep) if f]
    return [f for f in (*given, *map(os.path.expanduser, INSTALLED)) if os.path.isdir(f)]


def _models(file: str, names: set[str]) -> list[Card]:
    """The cards of these models in a file of LTspice's own, each as it stands there."""
    found: list[Card] = []
    for folder in libraries() if names else ():
        path = _beside(os.path.join(folder, "cmp"), file)
        try:
            text = re.sub(r"\n[ \t]*\+", " ", load(path).text) if path else ""
        except (OSError, ValueError):
            continue
        for line in re.findall(r"^[ \t]*\.model[ \t]+.*$", text, re.I | re.M):
            name = line.split()[1]
            if name.lower() in {n.lower() for n in names}:
                found.append([line.strip()])
                names = {n for n in names if n.lower() != name.lower()}
    return found


def _shipped(name: Word, file: SourceFile) -> Word:
    """The path of a library: as it is named if it lies beside the drawing, else in LTspice's own folders."""
    plain = name.strip("\"'")
    if _beside(os.path.dirname(file.path or ""), plain.replace("\\", "/")) is None:
        for folder in libraries():
            for part in ("sub", "cmp"):
                found = _beside(os.path.join(folder, part), plain.replace("\\", "/"))
                if found is not None:
                    return word(f'"{found}"', name.line, name.col)
    return name


def _named(inst: Word, prefix: str) -> Word:
    """The name of the element: it begins with the letter that the symbol says."""
    letter, text = prefix[:1].upper(), inst.replace(" ", "_")
    if letter and text[:1].upper() != letter:
        text = letter + text
    return word(text, inst.line, inst.col)


def _beside(folder: str, name: str, below: bool = False) -> str | None:
    """The path of a file in a folder, or below it as `name` says, capitals or not; `below`: in any folder below it, where `name`
    says none."""
    if below and "/" not in name:
        for at, _, files in sorted(os.walk(folder)):
            found = {entry.lower(): entry for entry in files}.get(name.lower())
            if found is not None:
                return os.path.join(at, found)
        return None
    for wanted in dict.fromkeys((name, os.path.basename(name))):
        path = folder or "."
        for piece in wanted.split("/"):
            try:
                found = {entry.lower(): entry for entry in os.listdir(path)}.get(piece.lower())
            except OSError:
                found = None
            if found is None:
                break
            path = os.path.join(path, found)
        else:
            return path if os.path.isfile(path) else None
    return None


def _stroke(key: str, at: list[int]) -> list[Any]:
    a, b = (at[0], at[1]), (at[2], at[3])
    if key == "LINE":
        return ["line", [a, b]]
    if key == "RECTANGLE":
        return outlines.box(a, b)
    if key == "CIRCLE":
        return outlines.ellipse(a, b)
    return outlines.arc_in_box(a, b, (at[4], at[5]), (at[6], at[7]))


def _moved(stroke: list[Any], at: Any) -> list[Any]:
    kind, *rest = stroke
    if kind == "line":
        return [kind, [at(x, y) for x, y in rest[0]]]
    return [kind, *at(rest[0], rest[1]), rest[2]]


def _triangle(supplies: bool) -> list[list[Any]]:
    """An operational amplifier, its inverting input above."""
    lines: list[Any] = [
        [(-32, 32), (-32, 96), (32, 64), (-32, 32)], [(-28, 48), (-20, 48)], [(-28, 80), (-20, 80)], [(-24, 76), (-24, 84)],
    ]  # fmt: skip
    lines += [[(0, 32), (0, 48)], [(0, 80), (0, 96)]] if supplies else []
    return [["line", points] for points in lines]


def _anchor(how: str, turn: str) -> str:
    """Where writing begins that the symbol wants `how` and that turns with it; what would stand upright is centred."""
    upright = how[:1].upper() == "V" and how[1:2].isupper()
    word_ = how[1:].lower() if upright else how.lower()
    x = {"left": 1, "right": -1}.get(word_, 0)
    dx, _ = turned((0, -x) if upright else (x, 0), turn)
    return "start" if dx > 0 else "end" if dx < 0 else "middle"
