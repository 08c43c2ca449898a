"""KiCad's schematics (.kicad_sch, versions 6 to 9), by its file format ("Schematic File Format") and its manual ("Simulator").

Symbols lie in the file with their pins and lines. What a symbol is to SPICE its fields say (kicad_parts.py). Sheets below are
read once for every use and stand below the first: KiCad's netlist has one level. Labels of one sheet are one net where they have
one name; global labels and power symbols are so everywhere, and a label for the sheet above is its pin there.
"""

from __future__ import annotations

import os
from contextlib import suppress
from math import cos, radians, sin

from ..diagnostics import Span
from ..marks import card_class
from ..source import Line, SourceFile, load
from . import outlines
from .kicad_parts import Fields, Lacks, Parts
from .nets import Rule, connect, stray
from .sexpr import Node, Wrong, parse
from .sheet import SCALES, Label, Pin, Sheet, Symbol, Wire, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .sheet import Card, Point, Word

DIALECT = None
RULE = Rule(tees=False, pins=False, labels=True, number=lambda k: f"Net-{k}")
ANALYSES = (".tran", ".ac ", ".dc ", ".op", ".noise", ".sp ")
POWER, GLOBAL, LOCAL, BELOW, SHEET = 1, 2, 3, 4, 5  # which name of a net stands


class Page:
    """A use of a file: `path` of identifiers, `name` before its labels, `down` how far below it is drawn."""

    def __init__(self, file: SourceFile, tree: Node, path: str, name: str, down: int) -> None:
        self.file, self.tree, self.path, self.name, self.down = file, tree, path, name, down


class Unit:
    """A symbol as it stands: one of the units that make a part. `pins` by number; `every`: numbers of all units."""

    def __init__(self, fields: Fields, symbol: Symbol, pins: dict[str, Pin], every: set[str]) -> None:
        self.fields, self.symbol, self.pins, self.every = fields, symbol, pins, every


def read(file: SourceFile, sink: Sink) -> Sheet:
    """The sheet of a drawing, with those of all sheets below it."""
    return Reader(file, sink).read()


class Reader:
    most = 1000  # uses of sheets

    def __init__(self, file: SourceFile, sink: Sink) -> None:
        self.file, self.sink = file, sink
        self.own = Sheet(file, SCALES["kicad"])
        self.trees: dict[str, tuple[SourceFile, Node]] = {}
        self.units: dict[str, list[Unit]] = {}
        self.references: dict[str, tuple[str, str]] = {}  # of version 6, by path
        self.down = 0
        self.pages = 0

    def read(self) -> Sheet:
        tree = self._tree(self.file)
        if tree is None:
            return self.own
        for instances in tree.all("symbol_instances"):
            for path in instances.all("path"):
                self.references[path.word(1)] = (path.text("reference"), path.text("unit"))
        uuid = tree.text("uuid")
        self._page(Page(self.file, tree, f"/{uuid}", "/", 0))
        connect(self.own, RULE)
        for at, net in stray(self.own):
            x, y = at[0] * 1e-4, at[1] * 1e-4
            said = f"a wire of `{net}` ends on another without a junction, at {x:g}, {y:g} mm: they are not connected"
            self.sink.warning(
                "W155", said, Span(self.file, 1, 1, 1), "KiCad connects such lines by a junction alone"
            )
        parts = Parts(self.sink, self.own)
        for units in self.units.values():
            try:
                parts.add(units)
            except Lacks as lack:
                place = units[0].fields.reference
                self.sink.error("E156", str(lack), _span(units[0].fields.file, place), lack.hint)
        parts.finish()
        if not any(str(card[0]).lower().startswith(ANALYSES) for card in self.own.cards):
            self.own.cards += self._workbook()
        return self.own

    def _workbook(self) -> list[Card]:
        """The analyses of the simulator's workbook beside the schematic (.wbk, versions 8 and 9), each kind once."""
        from json import loads

        found: dict[str, Card] = {}
        stem = (self.file.path or "").removesuffix(".kicad_sch")
        named = stem + ".wbk"
        with suppress(OSError, ValueError, KeyError, TypeError):
            if not os.path.isfile(named):
                project = loads(load(stem + ".kicad_pro").text)
                named = os.path.join(
                    os.path.dirname(stem), project["schematic"]["ngspice"]["workbook_filename"]
                )
        try:
            book = loads(load(named).text)
            commands = [c for tab in book["tabs"] for c in tab["commands"]]
        except (OSError, ValueError, KeyError, TypeError):
            return []
        for command in commands:
            if isinstance(command, str) and command.lower().startswith(ANALYSES):
                found.setdefault(command.split()[0].lower(), [word(command)])
        return list(found.values())

    def _tree(self, file: SourceFile, span: Span | None = None) -> Node | None:
        try:
            tree = parse(file.text)
            if tree.kind == "kicad_sch":
                return tree
            line = 1
        except Wrong as wrong:
            line = wrong.line
        whole = Span(file, line, 1, len(file.text_line(line)) + 1)
        self.sink.error("E155", f"{os.path.basename(file.name)} is no schematic from here on", span or whole)
        return None

    # ---- a page ----

    def _page(self, page: Page) -> None:
        library = {lib.word(1): lib for libs in page.tree.all("lib_symbols") for lib in libs.all("symbol")}
        before = len(self.own.wires), len(self.own.labels), len(self.own.texts)
        self.pages += 1
        for node in page.tree:
            if isinstance(node, Node):
                try:
                    self._item(page, node, library)
                except (ValueError, IndexError, StopIteration):
                    whole = Span(page.file, node.line, 1, len(page.file.text_line(node.line)) + 1)
                    self.sink.error(
                        "E155", f"this `{node.kind}` of the schematic lacks what it should have", whole
                    )
        ys = [y for wire in self.own.wires[before[0] :] for y in (wire.a[1], wire.b[1])]
        ys += [label.at[1] for label in self.own.labels[before[1] :]]
        ys += [round(text[1]) for text in self.own.texts[before[2] :]]
        self.down = max([self.down, page.down, *ys])
        for sheet in page.tree.all("sheet"):
            self._below(page, sheet)

    def _item(self, page: Page, node: Node, library: dict[Word, Node]) -> None:
        kind = node.kind
        if kind == "wire":
            (ax, ay), (bx, by) = (
                [_whole(v) for v in map(float, p[1:3])] for p in next(node.all("pts")).all("xy")
            )
            self.own.wires.append(Wire((ax, ay + page.down), (bx, by + page.down)))
        elif kind == "junction":
            self.own.junctions.append(self._at(page, node))
        elif kind in ("label", "global_label", "hierarchical_label"):
            self._label(page, node, kind)
        elif kind == "symbol":
            self._symbol(page, node, library)
        elif kind in ("text", "text_box"):
            self._text(page, node)
        elif kind == "sheet":
            self._box(page, node)

    def _at(self, page: Page, node: Node) -> Point:
        x, y = node.numbers("at")[:2]
        return _whole(x), _whole(y) + page.down

    def _label(self, page: Page, node: Node, kind: str) -> None:
        name = node.word(1)
        if kind == "global_label":
            said, rank, key, mark = str(name), GLOBAL, f"global {name}", "port"
        else:
            rank, mark = (LOCAL, "name") if kind == "label" else (BELOW, "port")
            said, key = page.name + name, f"local {page.path} {name}"
        self.own.labels.append(Label(self._at(page, node), _net(said), name, rank, mark, key, str(name)))

    def _text(self, page: Page, node: Node) -> None:
        """A comment, or directives: text whose first line is a dot card, a coupling of coils or a machine's card."""
        body = node.word(1)
        x, y = self._at(page, node)
        anchor = "start"
        lines = body.replace("${", "$ {").split("\n")
        first = next((line.strip() for line in lines if line.strip()), "")
        sim = node.text("exclude_from_sim") != "yes"
        is_cards = sim and (first[:1] == "." or _is_coupling(first) or _is_machine(first))
        for k, line in enumerate(lines):
            self.own.texts.append((x, y + k * _whole(2), anchor, line))
            if is_cards and line.strip() and line.strip().lower() != ".end":
                # the file has the line's words on one line with \n between
                shown = page.file.text_line(body.line)
                at = shown.find(line.strip(), body.col - 1) + 1
                self.own.cards.append([word(line.strip(), body.line if at else 0, at)])

    # ---- symbols ----

    def _symbol(self, page: Page, node: Node, library: dict[Word, Node]) -> None:
        shape = library.get(node.text("lib_name") or node.text("lib_id"))
        fields = Fields(page.file, node, self._reference(page, node))
        if shape is None:
            span = Span(page.file, node.line, 1, len(page.file.text_line(node.line)) + 1)
            self.sink.error("E156", f"`{node.text('lib_id')}` has no symbol in the file's lib_symbols", span)
            return
        x, y, angle = (*node.numbers("at"), 0.0)[:3]
        mirror = node.text("mirror")

        def at(p: tuple[float, float]) -> Point:
            dx, dy = turned(p, angle, mirror)
            return _whole(x + dx), _whole(y + dy) + page.down

        symbol = Symbol("", [], [])
        symbol.strokes = []
        pins: dict[str, Pin] = {}
        every = {str(pin.text("number")) for part in shape.all("symbol") for pin in part.all("pin")}
        feeds = any(pin.word(1) == "power_in" for part in shape.all("symbol") for pin in part.all("pin"))
        for part in shape.all("symbol"):
            _, unit, style = part.word(1).rsplit("_", 2)
            if unit not in ("0", fields.unit) or style not in (
                "0",
                str(node.text("convert") or node.text("body_style") or "1"),
            ):
                continue
            for item in part:
                if isinstance(item, Node) and item.kind == "pin":
                    self._pin(item, at, symbol, pins, fields)
                elif isinstance(item, Node):
                    symbol.strokes += _strokes(item, at)
        self.own.symbols.append(symbol)
        if shape.first("power") is not None or fields.reference.startswith("#"):
            name = fields.value
            for pin in symbol.pins:
                ground = name.upper() in ("GND", "0")
                label = Label(
                    (pin.x, pin.y),
                    "0" if ground else _net(name),
                    name,
                    0 if ground else POWER,
                    "",
                    f"global {name}",
                    "",
                )
                if feeds:
                    self.own.labels.append(label)
            if name.upper() not in ("GND", "0"):
                symbol.texts += self._texts(page, node, ("Value",), angle, mirror)
            return
        symbol.texts += self._texts(page, node, ("Reference", "Value"), angle, mirror, fields.reference)
        self.units.setdefault(fields.reference.lower(), []).append(Unit(fields, symbol, pins, every))

    def _pin(self, item: Node, at: Any, symbol: Symbol, pins: dict[str, Pin], fields: Fields) -> None:
        x, y, out = item.numbers("at")
        length = (item.numbers("length") or [0.0])[0]
        end = (x + length * cos(radians(out)), y + length * sin(radians(out)))
        name, number = item.text("name"), item.text("number")
        (px, py) = at((x, y))
        pin = Pin(px, py, name, fields.reference)
        symbol.pins.append(pin)
        pins[str(number)] = pin
        if length and symbol.strokes is not None:
            symbol.strokes.append(["line", [at((x, y)), at(end)]])

    def _texts(
        self, page: Page, node: Node, names: tuple[str, ...], angle: float, mirror: str, reference: str = ""
    ) -> list[tuple[float, float, str, str]]:
        """Fields that are shown, where they stand."""
        found: list[tuple[float, float, str, str]] = []
        for field in node.all("property"):
            effects = field.first("effects")
            hidden = [field, effects] if effects is not None else [field]
            if field.word(1) not in names or any(
                "hide" in n[1:] or n.text("hide") == "yes" for n in hidden if n is not None
            ):
                continue
            x, y = self._at(page, field)
            justify = effects.first("justify") if effects is not None else None
            way = (
                {"left": 1, "right": -1}.get(
                    next((str(w) for w in justify[1:] if w in ("left", "right")), ""), 0
                )
                if justify
                else 0
            )
            dx, _ = turned((way, 0), angle if angle in (0, 180) else 0, mirror)
            anchor = "start" if dx > 0.5 else "end" if dx < -0.5 else "middle"
            found.append(
                (
                    x,
                    y,
                    anchor,
                    reference if reference and field.word(1) == "Reference" else str(field.word(2)),
                )
            )
        return found

    def _reference(self, page: Page, node: Node) -> Word:
        """Which part a symbol is in this use of its file."""
        own = next(
            (f.word(2) for f in node.all("property") if f.word(1) == "Reference"), word("?", node.line)
        )
        found, unit = "", ""
        for instances in node.all("instances"):
            for project in instances.all("project"):
                for path in project.all("path"):
                    if path.word(1) == page.path:
                        found, unit = path.text("reference"), path.text("unit")
        if not found:
            key = page.path.split("/", 2)[2] if page.path.count("/") > 1 else ""
            found, unit = self.references.get(
                "/".join(["", *([key] if key else []), node.text("uuid")]), ("", "")
            )
        if unit:
            node.append(Node([word("use"), word(str(unit))]))
        return word(found or str(own), own.line, own.col)

    # ---- sheets below ----

    def _box(self, page: Page, node: Node) -> None:
        """A sheet as a box with its name, and its pins."""
        x, y = self._at(page, node)
        w, h = (_whole(v) for v in node.numbers("size")[:2])
        self.own.lines.append(outlines.box((x, y), (x + w, y + h)))
        fields = {f.word(1).replace(" ", "").lower(): f.word(2) for f in node.all("property")}
        self.own.texts.append((x, y - _whole(1), "start", str(fields.get("sheetname", ""))))
        below = f"{page.path}/{node.text('uuid')}"
        for pin in node.all("pin"):
            name = pin.word(1)
            at = self._at(page, pin)
            anchor = "start" if at[0] == x else "end" if at[0] == x + w else "middle"
            self.own.texts.append((at[0] + _whole(1 if anchor == "start" else -1), at[1], anchor, str(name)))
            said = page.name + fields.get("sheetname", word("")) + "/" + name
            self.own.labels.append(Label(at, _net(said), name, SHEET, "", f"local {below} {name}", ""))
            if "[" in name or "{" in name:
                self.sink.error(
                    "E155", f"`{name}` is a bus: a sheet's pins are single nets here", _span(page.file, name)
                )

    def _below(self, page: Page, node: Node) -> None:
        fields = {f.word(1).replace(" ", "").lower(): f.word(2) for f in node.all("property")}
        name, given = fields.get("sheetname", word("")), fields.get("sheetfile", word("", node.line))
        span = _span(page.file, given)
        path = os.path.normpath(os.path.join(os.path.dirname(page.file.path or ""), given))
        if page.path.count("/") > Sheet.most_below or self.pages > self.most:
            self.sink.error(
                "E155", f"{given} is within itself, or there are more than {self.most} sheets", span
            )
            return
        if path not in self.trees:
            try:
                file = load(path, span)
            except (OSError, ValueError) as error:
                self.sink.error(
                    "E501", f"cannot read {given}: {getattr(error, 'strerror', None) or error}", span
                )
                return
            tree = self._tree(file)
            if tree is None:
                return
            self.trees[path] = (file, tree)
        file, tree = self.trees[path]
        down = self.down + 2 * _whole(15)
        self.own.texts.append((0, down - _whole(15), "start", f"{page.name}{name}/"))
        self._page(Page(file, tree, f"{page.path}/{node.text('uuid')}", f"{page.name}{name}/", down))


# ---- pieces ----


def turned(p: tuple[float, float], angle: float, mirror: str) -> tuple[float, float]:
    """A point of a symbol, y upwards, as it stands, y downwards: turned against the clock, then mirrored about an axis."""
    x, y = p
    for _ in range(round(angle / 90) % 4):
        x, y = -y, x
    x, y = (-x if "y" in mirror else x), (-y if "x" in mirror else y)
    return x, -y


def _strokes(item: Node, at: Any) -> list[list[Any]]:
    """Lines of a symbol."""
    solid = (item.first("fill") or Node()).text("type") == "outline"
    if item.kind == "polyline":
        points = [at((float(p[1]), float(p[2]))) for p in next(item.all("pts")).all("xy")]
        return [["line", points], *([["fill", points]] if solid and len(points) > 2 else [])]
    if item.kind == "rectangle":
        box = outlines.box(at(tuple(item.numbers("start"))), at(tuple(item.numbers("end"))))
        return [box, *([["fill", box[1]]] if solid else [])]
    if item.kind == "circle":
        r = _whole(item.numbers("radius")[0])
        return [["dot" if solid else "ring", *at(tuple(item.numbers("center"))), r]]
    if item.kind == "arc" and item.first("mid") is not None:
        return [outlines.arc_through(*(at(tuple(item.numbers(k))) for k in ("start", "mid", "end")))]
    return []


def _whole(v: float) -> int:
    """Millimetres as whole numbers."""
    return round(v * 10_000)


def _net(name: str) -> str:
    """A net's name as SPICE can have it."""
    return "".join("_" if c in " ()=,;{}\t" else c for c in name)


def _is_coupling(line: str) -> bool:
    words = line.split()
    return (
        len(words) >= 4
        and words[0][:1] in "kK"
        and words[0][1:].isalnum()
        and all(w[:1] in "lL" for w in words[1:3])
    )


def _is_machine(line: str) -> bool:
    file = SourceFile("", line)
    return card_class(Line(file, 1, 1, 0, len(line))) is not None


def _span(file: SourceFile, place: Word) -> Span:
    return Span(file, max(1, place.line), place.col, place.col + max(1, len(place)))
