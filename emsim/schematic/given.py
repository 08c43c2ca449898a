"""The picture of a circuit that somebody has drawn: where its parts stand and its wires run is theirs, and nothing is laid out.

What a symbol looks like stands in its file, or is ours: then it is turned as the pins are, set between the first and the last of
them, and lines lead from its own pins to those of the drawing. Nets, parts and what flows are those of the deck, by their names.
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot

from . import symbols
from .back import TURNS
from .circuit import Circuit
from .layout import turned
from .picture import flow, in_pixels, runs, writing
from .symbols import ground

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..elaborate.flat import FlatDeck
    from ..sheets.sheet import Label, Sheet
    from ..sheets.sheet import Symbol as Drawn
    from .circuit import Part
    from .layout import Turn
    from .symbols import Symbol

    Spot = tuple[float, float]


def given(flat: FlatDeck, inside: str = "") -> Sheet | None:
    """The sheet that a level of the deck was drawn on."""
    sheet = flat.sources[0].sheet if flat.sources else None
    if sheet is None or not inside:
        return sheet
    of = next((of for name, of, _ in flat.uses if name == inside), "")
    return sheet.below.get(of.lower())


class Given:
    """The picture of a sheet, as `picture.Picture` is that of a netlist."""

    aside = 0.45  # grid units from a label to its name

    def __init__(self, flat: FlatDeck, sheet: Sheet, look: str, inside: str = "") -> None:
        self.sheet, self.look = sheet, look
        self.circuit = Circuit(flat, inside, cores=False)
        self.uses = {name for name, *_ in flat.uses}
        self.prefix = f"{inside}." if inside else ""
        self.of = {part.name: part for part in self.circuit.parts if part.role != "port"}
        self.boxes: list[tuple[float, float, float, float]] = []
        self.data = self._draw()

    def note(self) -> str:
        return ""

    def at(self, x: float, y: float) -> Spot:
        """A place of the sheet in grid units."""
        return round(x * self.sheet.scale, 4), round(y * self.sheet.scale, 4)

    def net(self, name: str) -> str:
        """What the flat deck calls a net of the sheet."""
        low = name.lower()
        if low in ("0", "gnd"):
            return "0"
        ports = {port.lower(): net for port, net in self.circuit.ports.items()}
        return ports.get(low, self.prefix + low)

    def _draw(self) -> dict[str, Any]:
        parts = [self._part(symbol) for symbol in self.sheet.symbols if symbol.name]
        ends = {(x, y): (k, j) for k, part in enumerate(parts) for j, (x, y, _) in enumerate(part["pins"])}
        wires, dots = self._wires(ends)
        names, loose = self._names()
        loose += [
            self._stroke(s) for symbol in self.sheet.symbols if not symbol.name for s in symbol.strokes or ()
        ]
        loose += [self._stroke(s) for s in self.sheet.lines]
        if loose and not parts:
            parts.append(_bare("drawing"))
        for stroke in loose:  # what is nobody's is drawn with the nearest
            _nearest(parts, stroke)["strokes"].append(stroke)
        bare = [text for symbol in self.sheet.symbols if not symbol.name for text in symbol.texts]
        for x, y, anchor, words in (*self.sheet.texts, *bare):
            names.append((*self.at(x, y), anchor, words, ""))
        return self._framed(parts, wires, dots, names)

    # ---- parts ----

    def _part(self, symbol: Drawn) -> dict[str, Any]:
        name = self.prefix + symbol.name
        known = self.of.get(name)
        pins = [(*self.at(pin.x, pin.y), self.net(pin.net)) for pin in symbol.terminals]
        if symbol.strokes is not None:
            strokes = [self._stroke(s) for s in symbol.strokes]
        else:
            strokes = self._ours(known, [pin[:2] for pin in pins])
        texts = [(*self.at(x, y), anchor, words) for x, y, anchor, words in symbol.texts]
        frame = _hull([p for s in strokes for p in _points(s)] + [pin[:2] for pin in pins])
        return {
            "name": name, "kind": known.kind if known else "device", "card": known.card if known else "",
            "sources": [(name, k) for k in range(len(pins))], "strokes": strokes, "texts": texts, "box": frame,
            "pins": [list(pin) for pin in pins],
        }  # fmt: skip

    def _ours(self, part: Part | None, pins: list[Spot]) -> list[list[Any]]:
        """The symbol that we have for a part, with lines to the pins of the drawing; a box where there is none."""
        if part is None or len(pins) < 2:
            x0, y0, x1, y1 = _hull(pins)
            corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
            return [["line", corners]]
        symbol, terminals = part.symbol(self.look), [k for _, k in part.sources]
        if part.kind == "amplifier" and part.name not in self.uses:  # its inputs stand apart
            symbol, terminals = symbols.diamond(self.look, "v"), [0, 1]
        ties = [(j, pins[k]) for j, k in enumerate(terminals) if k < len(pins)]
        if len(ties) < 2:
            return self._ours(None, pins)
        turn, (dx, dy) = _fit(symbol, ties)
        strokes = []
        for kind, *rest in symbol.strokes:
            if kind in ("line", "fill"):
                strokes.append([kind, [_plus(turned(p, turn), dx, dy) for p in rest[0]]])
            elif kind in ("ring", "dot"):
                strokes.append([kind, *_plus(turned(rest[0], turn), dx, dy), rest[1]])
        for j, target in ties:
            at, out = symbol.pins[j]
            strokes += _lead(_plus(turned(at, turn), dx, dy), turned(out, turn), target)
        used = {k for _, k in zip(ties, terminals, strict=False)}
        return strokes + self._controls(
            [p for k, p in enumerate(pins) if k not in used and k not in terminals], pins
        )

    def _controls(self, loose: list[Spot], pins: list[Spot]) -> list[list[Any]]:
        """Short lines at pins that the symbol does not have, towards it."""
        x, y = (pins[0][0] + pins[1][0]) / 2, (pins[0][1] + pins[1][1]) / 2
        lies = abs(pins[0][1] - pins[1][1]) < abs(pins[0][0] - pins[1][0])
        found: list[list[Any]] = []
        for px, py in loose:
            qx, qy = (px, py + (y - py) / 2) if lies else (px + (x - px) / 2, py)
            found.append(["line", [(px, py), (qx, qy)]])
        return found

    def _stroke(self, stroke: list[Any]) -> list[Any]:
        kind, *rest = stroke
        if kind in ("line", "fill"):
            return [kind, [self.at(x, y) for x, y in rest[0]]]
        return [kind, *self.at(rest[0], rest[1]), rest[2] * self.sheet.scale]

    # ---- wires and names ----

    def _wires(self, ends: dict[Spot, tuple[int, int]]) -> tuple[list[Any], list[tuple[float, float, str]]]:
        """Wires of the sheet, cut where something meets them; and the dots."""
        points: dict[str, set[tuple[int, int]]] = {}
        for wire in self.sheet.wires:
            points.setdefault(wire.net, set()).update((wire.a, wire.b))
        for symbol in self.sheet.symbols:
            for pin in symbol.pins:
                points.setdefault(pin.net, set()).add((pin.x, pin.y))
        edges: dict[str, set[tuple[Spot, Spot]]] = {}
        for wire in self.sheet.wires:
            (ax, ay), (bx, by) = wire.a, wire.b
            on = [p for p in points[wire.net] if _is_on(p, wire.a, wire.b)]
            on.sort(key=lambda p: (p[0] - ax) * (bx - ax) + (p[1] - ay) * (by - ay))
            spots = [self.at(*p) for p in on]
            pieces = {(min(a, b), max(a, b)) for a, b in pairwise(spots) if a != b}
            edges.setdefault(self.net(wire.net), set()).update(pieces)
        wires: list[Any] = []
        dots: list[tuple[float, float, str]] = []
        for net, own in edges.items():
            lines, joints = runs(own, set(ends))
            wires += [{"net": net, "points": line, "flow": flow(own, line, ends)} for line in lines]
            dots += [(x, y, net) for x, y in joints]
        return wires, dots

    def _names(self) -> tuple[list[tuple[float, float, str, str, str]], list[list[Any]]]:
        """Labels as names beside their points, and grounds as strokes."""
        names, strokes = [], []
        for label in self.sheet.labels:
            x, y = self.at(*label.at)
            if label.mark == "ground":
                turn = (-label.turns % 4, False)
                strokes += [
                    [kind, [_plus(turned(p, turn), x, y) for p in points]] for kind, points in ground()
                ]
            elif label.seat is not None:
                names.append((*self.at(*label.seat), "start", label.shown, self.net(label.net)))
            elif label.mark:
                dx, dy = self._away(label)
                anchor = "start" if dx > 0 else "end" if dx < 0 else "middle"
                if label.mark == "port":
                    strokes += [
                        ["line", [(x, y), (x + 0.4 * dx, y + 0.4 * dy)]],
                        ["ring", x + 0.65 * dx, y + 0.65 * dy, 0.25],
                    ]
                far = self.aside + (0.55 if label.mark == "port" else 0)
                names.append((x + far * dx, y + (dy * (far + 0.4)), anchor, label.shown, self.net(label.net)))
        return names, strokes

    def _away(self, label: Label) -> tuple[int, int]:
        """The side of a label on which no wire leaves it."""
        x, y = label.at
        taken = set()
        for wire in self.sheet.wires:
            if _is_on(label.at, wire.a, wire.b):
                for px, py in (wire.a, wire.b):
                    taken.add(((px > x) - (px < x), (py > y) - (py < y)))
        sides = [(1, 0), (-1, 0), (0, -1), (0, 1)]
        opposite = [(dx, dy) for dx, dy in sides if (dx, dy) not in taken and (-dx, -dy) in taken]
        free = [side for side in sides if side not in taken]
        return (
            opposite
            if len(taken - {(0, 0)}) == 1 and opposite
            else free[1:]
            if (1, 0) in free and len(free) == 3
            else free or sides
        )[0]

    # ---- pixels ----

    def _framed(
        self, parts: list[Any], wires: list[Any], dots: list[Any], names: list[Any]
    ) -> dict[str, Any]:
        spots = [p for part in parts for s in part["strokes"] for p in _points(s)]
        spots += [p for wire in wires for p in wire["points"]]
        written = [writing(*text) for part in parts for text in part["texts"]]
        written += [writing(*name[:4]) for name in names]
        spots += [p for x0, y0, x1, y1 in written for p in ((x0, y0), (x1, y1))]
        nets = dict.fromkeys([w["net"] for w in wires] + [p[2] for part in parts for p in part["pins"]])
        return {
            "look": self.look, "inside": self.circuit.inside, "note": self.note(), "nets": list(nets),
            **in_pixels(parts, wires, dots, names, _hull(spots)),
        }  # fmt: skip


# ---- pieces ----


def _fit(symbol: Symbol, ties: list[tuple[int, Spot]]) -> tuple[Turn, Spot]:
    """How our symbol stands so that its pins are nearest to those of the drawing, and where: of three pins in the middle of what
    the first and the last of them span, else in the middle of all."""
    best: tuple[float, Turn, Spot] | None = None
    for turn in TURNS:
        own = [turned(symbol.pins[j][0], turn) for j, _ in ties]
        want = [target for _, target in ties]
        if len(own) == 3:  # a gate or base may stand anywhere beside its channel
            dx, dy = ((want[0][k] + want[2][k] - own[0][k] - own[2][k]) / 2 for k in (0, 1))
        else:
            dx, dy = (sum(w[k] - o[k] for w, o in zip(want, own, strict=True)) / len(own) for k in (0, 1))
        cost = sum(hypot(o[0] + dx - w[0], o[1] + dy - w[1]) for o, w in zip(own, want, strict=True))
        if best is None or cost < best[0] - 1e-6:
            best = (cost, turn, (dx, dy))
    assert best is not None
    return best[1], best[2]


def _lead(a: Spot, out: Spot, b: Spot) -> list[list[Any]]:
    """From a pin of our symbol, which points `out`, to that of the drawing: straight, or with one step."""
    (ax, ay), (bx, by) = a, b
    if abs(ax - bx) < 1e-6 and abs(ay - by) < 1e-6:
        return []
    if abs(ax - bx) < 1e-6 or abs(ay - by) < 1e-6:
        return [["line", [a, b]]]
    corner = (ax, by) if out[0] else (bx, ay)
    return [["line", [a, corner, b]]]


def _plus(p: Spot, dx: float, dy: float) -> Spot:
    return p[0] + dx, p[1] + dy


def _points(stroke: list[Any]) -> list[Spot]:
    kind, *rest = stroke
    if kind in ("line", "fill"):
        return [tuple(p) for p in rest[0]]
    x, y, r = rest
    return [(x - r, y - r), (x + r, y + r)]


def _hull(points: list[Any]) -> tuple[float, float, float, float]:
    xs, ys = [p[0] for p in points] or [0.0], [p[1] for p in points] or [0.0]
    return min(xs), min(ys), max(xs), max(ys)


def _is_on(p: tuple[int, int], a: tuple[int, int], b: tuple[int, int]) -> bool:
    """Is a point on the line from a to b?"""
    across = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    within = min(a[0], b[0]) <= p[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= p[1] <= max(a[1], b[1])
    return across == 0 and within


def _bare(kind: str) -> dict[str, Any]:
    return {
        "name": "",
        "kind": kind,
        "card": "",
        "sources": [],
        "strokes": [],
        "texts": [],
        "box": (0, 0, 0, 0),
        "pins": [],
    }


def _nearest(parts: list[dict[str, Any]], stroke: list[Any]) -> dict[str, Any]:
    """The part to whose pins a stroke is nearest."""
    x, y = _points(stroke)[0]

    def far(part: dict[str, Any]) -> float:
        return min((abs(px - x) + abs(py - y) for px, py, _ in part["pins"]), default=1e9)

    return min(parts, key=far)
