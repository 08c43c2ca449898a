"""A circuit as a picture: plain data in pixels that a page, a film and an SVG file draw by the same few rules.

    {"width", "height", "look", "note",
     "parts":  [{"name", "kind", "card", "strokes", "texts", "box", "pins": [[x, y, net]]}],
     "wires":  [{"net", "points": [[x, y], ..], "flow": [[part, pin, sign], ..]}],
     "dots":   [[x, y, net]], "names": [[x, y, anchor, words, net]], "nets": [..]}

Strokes are ["line", points], ["fill", points], ["ring", x, y, r], ["dot", x, y, r]. Texts are [x, y, anchor, words]; y is the
middle of the line. The current along a wire, from its first point to its last, is the sum of sign times the current into that
pin of that part.
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil

from ..diagnostics import DeckError, deck_error, did_you_mean
from .back import differences, gap, listing
from .layout import LINE, MOST, TEXTBOOK, Layout, turned, wide
from .symbols import UNIT, ground

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from ..elaborate.flat import FlatDeck
    from .circuit import Circuit
    from .given import Given
    from .layout import Laid

    Grid = tuple[int, int]
    Spot = tuple[float, float]
    Frame = tuple[float, float, float, float]

MARGIN = 16  # pixels about it all
REPORT = "a fault of emsim: please report it with the deck"
ASIDE, CLEAR = 0.2, 0.2  # grid units from a name to its wire, and how much nearer that is than any other
BULGE = 0.3  # grid units: a transistor's ring reaches out of its box


class Picture:
    """The picture of a circuit; `data` is what is drawn, `layout` where everything stands on the grid."""

    def __init__(
        self, circuit: Circuit, look: str = "ansi", hints: list[tuple[str, str, str]] | None = None
    ) -> None:
        self.circuit = circuit
        self.frames: list[Frame] = []  # of symbols and writing, in grid units
        while True:
            self.layout = Layout(circuit, look, hints)
            self.frames.clear()
            self.edges = {net: _edges(paths) for net, paths in self.layout.wires.items()}
            self.data = self._draw(look)
            written = {name[4] for name in self.data["names"]}
            bare = [n for n in circuit.read & circuit.named if self.layout.wired(n) and n not in written]
            if not bare:
                break
            for net in sorted(bare):  # a name of which labels speak has room kept for it
                circuit.flag(net)

    def _draw(self, look: str) -> dict[str, Any]:
        parts = [self._part(k, laid) for k, laid in enumerate(self.layout.laid)]
        wires: list[dict[str, Any]] = []
        dots: list[tuple[float, float, str]] = []
        for net, edges in self.edges.items():
            pins: dict[Spot, Grid] = {self._pin(k, j): (k, j) for k, j in self.circuit.pins[net]}
            lines, joints = runs(edges, set(pins))
            for points in lines:
                wires.append({"net": net, "points": points, "flow": flow(edges, points, pins)})
            dots += [(x, y, net) for x, y in joints]
        names = self._names()
        names += self._captions([*self.frames, *((x, y, x, y) for w in wires for x, y in w["points"])])
        covered = [*self.frames, *((x, y, x, y) for w in wires for x, y in w["points"])]
        lefts, tops, rights, bottoms = zip(*covered, strict=True)
        room = min(lefts), min(tops), max(rights), max(bottoms)
        return {
            "look": look, "inside": self.circuit.inside, "note": self.note(), "nets": list(self.circuit.pins),
            **in_pixels(parts, wires, dots, names, room),
        }  # fmt: skip

    def note(self) -> str:
        n = len(self.circuit.parts)
        if n > TEXTBOOK:
            return f"{n} parts on one level: subcircuits would make boxes of them"
        return ""

    def _pin(self, part: int, pin: int) -> Grid:
        laid = self.layout.laid[part]
        x, y, _, _ = laid.pins[pin]
        return laid.at[0] + x, laid.at[1] + y

    # ---- parts ----

    def _part(self, k: int, laid: Laid) -> dict[str, Any]:
        part, (ax, ay) = self.circuit.parts[k], laid.at
        strokes: list[list[Any]] = []
        texts: list[tuple[float, float, str, str]] = []

        def at(p: tuple[float, float]) -> tuple[float, float]:
            x, y = turned(p, laid.turn)
            return ax + x, ay + y

        for kind, *rest in laid.symbol.strokes:
            if kind in ("line", "fill"):
                strokes.append([kind, [at(p) for p in rest[0]]])
            elif kind == "text":
                (x, y), words = at(rest[0]), rest[1]
                anchor = rest[2] if len(rest) > 2 else "middle"
                if laid.turn[1] and anchor != "middle":
                    anchor = "end" if anchor == "start" else "start"
                texts.append((x, y, anchor, words))
            else:
                strokes.append([kind, *at(rest[0]), rest[1]])
        x0, y0, x1, y1 = laid.symbol.box
        (px, py), (qx, qy) = at((x0, y0)), at((x1, y1))
        box = (min(px, qx), min(py, qy), max(px, qx), max(py, qy))
        self.frames.append(box)
        for what, x, y, dx, dy, words in laid.decor:
            self._decor(what, (ax + x, ay + y), (dx, dy), words, strokes, texts)
        if laid.label is not None:
            lx, ly, anchor = laid.label
            if part.role == "transistor" and any(s[0] == "ring" for s in laid.symbol.strokes):
                lx += {"start": BULGE, "end": -BULGE}.get(anchor, 0.0)
            for i, words in enumerate(part.label):
                texts.append((ax + lx, ay + ly + LINE * i, anchor, words))
        self.frames += [writing(*text) for text in texts]
        pins = [[*self._pin(k, j), net] for j, net in enumerate(part.nets)]
        return {
            "name": part.name, "kind": part.kind, "card": part.card, "sources": part.sources,
            "strokes": strokes, "texts": texts, "box": box, "pins": pins,
        }  # fmt: skip

    def _decor(
        self, what: str, at: Grid, out: Grid, words: str, strokes: list[Any], texts: list[Any]
    ) -> None:
        (x, y), (dx, dy) = at, out
        if what == "ground":
            if dx:
                strokes.append(["line", [(x, y), (x + dx, y)]])
            x, over = x + dx, -1 if dy < 0 else 1
            for kind, points in ground():
                strokes.append([kind, [(x + px, y + over * py) for px, py in points]])
            self.frames.append((x - 1, min(y, y + 2 * over), x + 1, max(y, y + 2 * over)))
        elif what == "rail":
            rails = self.circuit.rails
            positive = next((sign for n, sign in rails.items() if self.circuit.port(n) == words), True)
            up = dy if dy else (-1 if positive else 1)
            if dx:
                far = dx * (1 + max(1, ceil(wide(words) / 2)))
                strokes.append(["line", [(x, y), (x + far, y)]])
                x += far
            strokes += [["line", [(x, y), (x, y + up)]], ["line", [(x - 1, y + up), (x + 1, y + up)]]]
            texts.append((x, y + up + up * 0.9, "middle", words))
            self.frames.append((x - 1, min(y, y + up), x + 1, max(y, y + up)))
        else:
            strokes.append(["line", [(x, y), (x + 0.5 * dx, y + 0.5 * dy)]])
            strokes.append(["ring", x + 0.75 * dx, y + 0.75 * dy, 0.25])
            if dx:
                texts.append((x + 1.3 * dx, y, "start" if dx > 0 else "end", words))
            else:
                texts.append((x, y + 1.75 * dy, "middle", words))

    # ---- names of nets ----

    def _names(self) -> list[tuple[float, float, str, str, str]]:
        """Names beside wires, or where pins meet, nearer to their own net than to any other."""
        places = {net: [*self.edges.get(net, ())] for net in self.circuit.pins}
        for net, pins in self.circuit.pins.items():
            places[net] += [(p, p) for p in (self._pin(k, j) for k, j in pins)]
        found = []
        for net, edges in self.edges.items():
            if net not in self.circuit.named:
                continue
            words = self.circuit.port(net)
            others = [place for other, own in places.items() if other != net for place in own]
            for x, y, anchor in _beside(edges) if edges else _about(self._pin(*self.circuit.pins[net][0])):
                frame = writing(x, y, anchor, words)
                away = min(gap(frame, a, b) for a, b in places[net])
                if away < ASIDE or any(_meet(frame, f) for f in self.frames):
                    continue
                if all(gap(frame, a, b) > away + CLEAR for a, b in others):
                    found.append((x, y, anchor, words, net))
                    self.frames.append(frame)
                    break
        return found

    def _captions(self, covered: list[Frame]) -> list[tuple[float, float, str, str, str]]:
        """What is told below the drawing."""
        left, bottom = min(f[0] for f in covered), max(f[3] for f in covered)
        found = []
        for k, words in enumerate(self.circuit.captions):
            y = bottom + 1 + LINE * (k + 0.5)
            found.append((left, y, "start", words, ""))
            self.frames.append(writing(left, y, "start", words))
        return found


def draw(
    flat: FlatDeck, look: str = "ansi", inside: str = "", sink: Sink | None = None
) -> Picture | Given | None:
    """The picture of a deck's circuit, or of the inside of a subcircuit's use; None where there are no parts. What comes from a
    schematic stands as it does there. Hints that are not understood are reported to `sink`.

    Raises DeckError: no such subcircuit (E371), more than MOST parts on the level (E372)."""
    from .circuit import Circuit
    from .hints import hints

    uses = [name for name, *_ in flat.uses]
    if inside and inside not in uses:
        hint = did_you_mean(inside, uses, f"there are {', '.join(uses)}" if uses else "the deck uses none")
        deck_error("E371", f"no use of a subcircuit is called `{inside}`", None, hint)
    from .given import Given, given

    if (sheet := given(flat, inside)) is not None:
        return Given(flat, sheet, look, inside) if sheet.symbols else None
    circuit = Circuit(flat, inside)
    if not circuit.parts:
        return None
    if len(circuit.parts) > MOST:
        said = (
            f"the circuit has {len(circuit.parts)} parts on one level, and {MOST} is the most that is drawn"
        )
        deck_error(
            "E372",
            said,
            None,
            "make subcircuits of what belongs together: each is drawn as a box, its inside by itself",
        )
    names = [*(e.name for e in flat.elements), *(card.name for card in flat.machine), *uses]
    found = [hint for file in flat.sources[:1] for hint in hints(file, names, sink)]
    picture = Picture(circuit, look, found)
    if wrong := differences(picture.data, circuit):
        said = f"the drawing does not read as the deck ({wrong[0]}): its elements are listed in place of it"
        picture.data = listing(flat, inside, look, said)
        if sink is not None:
            sink.warning("W351", said, None, REPORT)
    return picture


def pictures(flat: FlatDeck, look: str = "ansi") -> dict[str, dict[str, Any]]:
    """Data of the whole circuit, under "", and of the insides of subcircuits by the use's name, as long as all of it comes to
    MOST parts; empty where there is no circuit. Raises DeckError where the whole is too much to draw."""
    whole = draw(flat, look)
    if whole is None:
        return {}
    found, left = {"": whole.data}, MOST - len(whole.circuit.parts)
    if flat.sources[0].sheet is not None:
        left = MOST  # its owner has laid it out
    for inside in (name for name, *_ in flat.uses):
        try:
            picture = draw(flat, look, inside) if left > 0 else None
        except DeckError:
            continue
        if picture is not None and len(picture.circuit.parts) <= left:
            left -= len(picture.circuit.parts)
            found[inside] = picture.data
    return found


def writing(x: float, y: float, anchor: str, words: str) -> Frame:
    """The room of a line of writing [grid units]."""
    width = wide(words)
    left = x - (width if anchor == "end" else width / 2 if anchor == "middle" else 0)
    return left, y - 0.5, left + width, y + 0.5


def _about(p: Grid) -> list[tuple[float, float, str]]:
    """Where a name may stand about a point at which pins meet."""
    x, y = p
    return [
        (x + dx, y + dy, anchor) for dy in (-0.75, 0.8, 0) for dx, anchor in ((0.4, "start"), (-0.4, "end"))
    ]


def _meet(a: Frame, b: Frame) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def in_pixels(
    parts: list[dict[str, Any]],
    wires: list[dict[str, Any]],
    dots: list[tuple[float, float, str]],
    names: list[tuple[float, float, str, str, str]],
    room: Frame,
) -> dict[str, Any]:
    """What stands in this room of the grid (left, top, right, bottom), in pixels, and how large it is. Parts and wires change."""
    left, top, right, bottom = room

    def x_(x: float) -> float:
        return round(MARGIN + UNIT * (x - left), 1)

    def y_(y: float) -> float:
        return round(MARGIN + UNIT * (y - top), 1)

    for part in parts:
        part["strokes"] = [placed(s, x_, y_) for s in part["strokes"]]
        part["texts"] = [[x_(x), y_(y), anchor, words] for x, y, anchor, words in part["texts"]]
        x0, y0, x1, y1 = part["box"]
        part["box"] = [x_(x0), y_(y0), x_(x1), y_(y1)]
        part["pins"] = [[x_(x), y_(y), net] for x, y, net in part["pins"]]
    for wire in wires:
        wire["points"] = [[x_(x), y_(y)] for x, y in wire["points"]]
    return {
        "width": round(2 * MARGIN + UNIT * (right - left)), "height": round(2 * MARGIN + UNIT * (bottom - top)),
        "parts": parts, "wires": wires, "dots": [[x_(x), y_(y), net] for x, y, net in dots],
        "names": [[x_(x), y_(y), anchor, words, net] for x, y, anchor, words, net in names],
    }  # fmt: skip


def placed(stroke: list[Any], x_: Any, y_: Any) -> list[Any]:
    kind, *rest = stroke
    if kind in ("line", "fill"):
        return [kind, [[x_(x), y_(y)] for x, y in rest[0]]]
    return [kind, x_(rest[0]), y_(rest[1]), UNIT * rest[2]]


def _edges(paths: list[list[Grid]]) -> set[tuple[Spot, Spot]]:
    """The pieces of one grid unit, each from its left or upper end."""
    found: set[tuple[Spot, Spot]] = set()
    for path in paths:
        for (x0, y0), (x1, y1) in pairwise(path):
            n = max(abs(x1 - x0), abs(y1 - y0))
            dx, dy = (x1 > x0) - (x1 < x0), (y1 > y0) - (y1 < y0)
            points = [(x0 + k * dx, y0 + k * dy) for k in range(n + 1)]
            found |= {(min(a, b), max(a, b)) for a, b in pairwise(points)}
    return found


def _neighbours(edges: set[tuple[Spot, Spot]]) -> dict[Spot, list[Spot]]:
    near: dict[Spot, list[Spot]] = {}
    for a, b in sorted(edges):
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    return near


def runs(edges: set[tuple[Spot, Spot]], pins: set[Spot]) -> tuple[list[list[Spot]], list[Spot]]:
    """Wires from junction or pin to the next, as their corners; and the junctions."""
    near = _neighbours(edges)
    joints = sorted(p for p, others in near.items() if len(others) + (p in pins) > 2)
    stops = {p for p, others in near.items() if len(others) != 2 or p in pins}
    left, found = set(edges), []
    for start in sorted(stops):
        for first in near[start]:
            if (min(start, first), max(start, first)) not in left:
                continue
            run, at, to = [start], start, first
            while True:
                left.discard((min(at, to), max(at, to)))
                if to in stops:
                    run.append(to)
                    break
                onward = next(p for p in near[to] if p != at)
                if (onward[0] - to[0], onward[1] - to[1]) != (to[0] - at[0], to[1] - at[1]):
                    run.append(to)
                at, to = to, onward
            found.append(run)
    return found, joints


def flow(
    edges: set[tuple[Spot, Spot]], run: list[Spot], pins: dict[Spot, tuple[int, int]]
) -> list[tuple[int, int, int]]:
    """Pins beyond the last point of a run: what flows along it flows into them."""
    last, before = run[-1], run[-2]
    near = _neighbours(edges)
    cut = next(p for p in near[last] if _is_towards(last, p, before))
    seen, stack, found = {last, cut}, [last], []
    while stack:
        p = stack.pop()
        if p in pins:
            found.append((*pins[p], 1))
        for q in near.get(p, ()):
            if q not in seen:
                seen.add(q)
                stack.append(q)
    return sorted(found)


def _is_towards(a: Spot, p: Spot, b: Spot) -> bool:
    """Seen from a, does p lie where b does?"""
    (px, py), (bx, by) = (p[0] - a[0], p[1] - a[1]), (b[0] - a[0], b[1] - a[1])
    return abs(px * by - py * bx) < 1e-6 and px * bx + py * by > 0


def _beside(edges: set[tuple[Spot, Spot]]) -> list[tuple[float, float, str]]:
    """Where a name may stand beside wires, the best first."""
    rows: dict[float, list[float]] = {}
    columns: dict[float, list[float]] = {}
    for (x0, y0), (x1, _) in sorted(edges):
        if x0 != x1:
            rows.setdefault(y0, []).append(x0)
        else:
            columns.setdefault(x0, []).append(y0)
    found: list[tuple[float, float, float, str]] = []
    for y, xs in rows.items():
        for x in xs:
            middle = abs(x - (xs[0] + xs[-1]) / 2)
            found += [(middle, x + 0.5, y - 0.75, "middle"), (middle + 8, x + 0.5, y + 0.8, "middle")]
    for x, ys in columns.items():
        for y in ys:
            middle = abs(y - (ys[0] + ys[-1]) / 2)
            found += [(middle + 12, x + 0.5, y + 0.5, "start"), (middle + 14, x - 0.5, y + 0.5, "end")]
    # the ends of wires, beside what stands there
    return [place[1:] for place in sorted(found)]
