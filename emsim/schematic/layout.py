"""How a circuit is laid out: columns by signal flow, rows by voltage level.

The engine searches for a placement that costs little (engine/schematic). Here it learns what makes a drawing a textbook's:

    variants   every way that a part may stand, with a cost: ground below, positive rails above, the current of a transistor
               downwards, parts against ground or a rail upright, parts in series lying, labels where there is room
    wishes     sources left, what they drive to the right of them, pairs and repeated stages in a row, and the deck's hints

Grounds and rails are symbols at pins and belong to the part, as labels do; so nothing can come to lie on them.
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil

from .order import Order
from .symbols import LETTER

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from .circuit import Circuit, Part
    from .hints import Hint
    from .symbols import Symbol

    Grid = tuple[int, int]
    Rect = tuple[int, int, int, int]
    Turn = tuple[int, bool]  # quarter turns clockwise, mirrored before

LINE = 1.3  # height of a line of writing [grid units]
GAP = 3  # between what is not wired together
PAGE = 1.8  # width by height
MOST = 60  # parts of a drawing
TEXTBOOK = 40  # ... that still looks like one


class Laid:
    """A part as it stands: variant's turn, where, and where its label is: (x, y of the first line, anchor)."""

    __slots__ = ("at", "decor", "label", "pins", "symbol", "turn")

    def __init__(
        self, symbol: Symbol, turn: Turn, pins: list[tuple[int, int, int, int]], label: tuple[float, float, str] | None,
        decor: list[tuple[str, int, int, int, int, str]],
    ) -> None:  # fmt: skip
        self.symbol, self.turn, self.pins, self.label, self.decor = symbol, turn, pins, label, decor
        self.at = (0, 0)


def turned(p: tuple[float, float], turn: Turn) -> tuple[float, float]:
    x, y = p
    if turn[1]:
        x = -x
    for _ in range(turn[0]):
        x, y = -y, x
    return x, y


def wide(text: str) -> float:
    return LETTER * len(text)


class Layout:
    """Places and wires of a circuit; `look` is "iec" or "ansi". `apart` nets are not wired but named at their pins."""

    def __init__(self, circuit: Circuit, look: str = "ansi", hints: list[Hint] | None = None) -> None:
        self.circuit, self.look = circuit, look
        self.hints = hints or []
        self.apart: set[str] = set()
        self.hangs = bool(circuit.rails) and not any(circuit.rails.values())  # all supplies are negative
        self.variants: list[list[tuple[int, list[Rect], Laid]]] = []
        self.order = Order(circuit)
        self._solve()

    # ---- the search ----

    def _solve(self) -> None:
        """What is wired together is laid out by itself, then all of it side by side."""
        parts = self.circuit.parts
        laid_of: dict[int, Laid] = {}
        self.wires: dict[str, list[list[Grid]]] = {}
        self.failed: list[str] = []
        self.cost = 0
        done: dict[tuple[int, ...], tuple[Any, ...]] = {}
        for attempt in range(4):
            groups = self._groups()
            self.variants = [list(self._stand(part)) for part in parts]
            wishes = self.order.wishes(self.hints)
            far: set[str] = set()
            for group in groups:
                key = tuple(group)
                if key not in done:
                    done[key] = self._arrange(group, wishes)
                    places, nets, wires, failed, _ = done[key]
                    bad = {net for i, net in enumerate(nets) if i in failed or self._is_long(net, wires[i])}
                    if bad and attempt < 3:
                        far |= bad
                        del done[key]
            if not far:
                break
            self.apart |= far
        frames = [self._frame(group, done[tuple(group)]) for group in groups]
        for group, (left, top) in zip(groups, packed(frames), strict=True):
            places, nets, wires, failed, cost = done[tuple(group)]
            for k, (x, y, v) in zip(group, places, strict=True):
                laid = self.variants[k][v][2]
                laid.at = (x + left, y + top)
                laid_of[k] = laid
            for net, paths in zip(nets, wires, strict=True):
                self.wires[net] = [[(x + left, y + top) for x, y in path] for path in paths]
            self.failed += [nets[i] for i in failed]
            self.cost += cost
        self.laid = [laid_of[k] for k in range(len(parts))]

    def _groups(self) -> list[list[int]]:
        """Parts that wires or hints hold together, in the order of the signal."""
        parts = self.circuit.parts
        of = list(range(len(parts)))

        def root(k: int) -> int:
            while of[k] != k:
                k = of[k]
            return k

        names = {p.name: k for k, p in enumerate(parts)}
        joined = [[k for k, _ in places] for net, places in self.circuit.pins.items() if self.wired(net)]
        joined += [[names[a], names[b]] for _, a, b in self.hints if a in names and b in names]
        for first, *others in joined:
            for k in others:
                of[max(root(first), root(k))] = min(root(first), root(k))
        groups: dict[int, list[int]] = {}
        for k in sorted(range(len(parts)), key=lambda k: (self.order.near[k], k)):
            groups.setdefault(root(k), []).append(k)
        return list(groups.values())

    def _arrange(self, group: list[int], wishes: list[Any]) -> tuple[Any, ...]:
        """Places, nets, their wires, those that failed, and the cost."""
        place = {k: i for i, k in enumerate(group)}
        nets = [net for net, pins in self.circuit.pins.items() if self.wired(net) and pins[0][0] in place]
        ties = [[(place[k], j) for k, j in self.circuit.pins[net]] for net in nets]
        own = [
            (what, place[a], place[b], weight) for what, a, b, weight in wishes if a in place and b in place
        ]
        given = [[(cost, rects, laid.pins) for cost, rects, laid in self.variants[k]] for k in group]
        n = len(group)
        effort = (
            (1, 50, 0)
            if n == 1
            else (8, 1500 * n, 50 * n)
            if n <= 16
            else (4, 22000, 400)
            if n <= 26
            else (2, 20000, 120)
        )
        rounds, moves, polish = effort
        from .._engine import arrange_diagram

        places, wires, failed, cost = arrange_diagram(given, ties, own, 1, rounds, moves, polish)
        return places, nets, wires, failed, cost

    def _frame(self, group: list[int], found: tuple[Any, ...]) -> Rect:
        """What a group covers: rectangles, pins, wires."""
        places, _, wires, _, _ = found
        rects = [(x, y, x, y) for paths in wires for path in paths for x, y in path]
        for k, (x, y, v) in zip(group, places, strict=True):
            _, own, laid = self.variants[k][v]
            rects += [(x + r[0], y + r[1], x + r[2], y + r[3]) for r in own]
            rects += [(x + px, y + py, x + px, y + py) for px, py, *_ in laid.pins]
        lefts, tops, rights, bottoms = zip(*rects, strict=True)
        return min(lefts), min(tops), max(rights), max(bottoms)

    def wired(self, net: str) -> bool:
        return (
            net != "0"
            and net not in self.circuit.rails
            and net not in self.apart
            and len(self.circuit.pins[net]) > 1
        )

    def _is_long(self, net: str, paths: list[list[tuple[int, int]]]) -> bool:
        """Textbooks name the ends of a wire that winds through the whole drawing."""
        bends = sum(len(path) - 2 for path in paths)
        far = sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for path in paths for a, b in pairwise(path))
        return bends > 4 + 2 * len(paths) and far > 50 + 25 * len(paths)

    # ---- how a part may stand ----

    def _stand(self, part: Part) -> Iterator[tuple[int, list[Rect], Laid]]:
        symbol = part.symbol(self.look)
        for turn, cost in self._turns(part, symbol):
            pins = []
            for at, out in symbol.pins:
                (x, y), (dx, dy) = turned(at, turn), turned(out, turn)
                pins.append((round(x), round(y), round(dx), round(dy)))
            box = _box(symbol.box, turn)
            decor, boxes, more = self._decor(part, pins)
            for label, rect, extra in self._labels(part, box, pins, boxes):
                rects = [box, *boxes] + ([rect] if rect else [])
                yield cost + more + extra, rects, Laid(symbol, turn, pins, label, decor)

    def _turns(self, part: Part, symbol: Symbol) -> list[tuple[Turn, int]]:
        upright: list[Turn] = [(0, False), (2, False)]
        lying: list[Turn] = [(3, False), (1, False)]
        if part.role == "port":
            mirrored = part.kind == "out"
            return [((0, mirrored), 0), ((0, not mirrored), 0 if part.kind == "flag" else 12)]
        if part.role == "amplifier":
            return [((0, False), 0), ((2, True), 6)]
        if part.role == "box" and part.kind != "pot":
            return [((0, False), 0), ((0, True), 14 if part.kind == "transformer" else 40)]
        if part.kind == "pot":
            return [((0, False), 0), ((0, True), 3), ((2, False), 9), ((2, True), 9)]
        if part.role == "transistor":
            ends = {part.nets[0], part.nets[2]}
            tied = ends & ({"0"} | set(self.circuit.rails))
            lie = 44 if tied else 32 if part.kind in ("npn", "pnp") else 10
            wanted = self.order.mirrored.get(part.name)
            plain, mirror = (0, 2) if wanted is None else (0, 30) if not wanted else (30, 0)
            found = [
                ((0, False), plain),
                ((0, True), mirror),
                ((2, True), 30 + plain),
                ((2, False), 30 + mirror),
            ]
            return found + [((t, m), lie + (mirror if m else plain)) for t in (1, 3) for m in (False, True)]
        fixed = [net == "0" or net in self.circuit.rails for net in part.nets]
        if part.role == "source" and not any(fixed):
            return [(t, 0 if t in upright else 4) for t in upright + lying]
        if any(fixed):
            return [(t, 0) for t in upright] + [(t, 26) for t in lying]
        stands = self.order.falls(part)
        high = 0 if stands >= 0 else 1
        if part.name in self.order.patterns.standing:
            return [(upright[high], 0)]
        return [(upright[high], 0 if stands else 7), (upright[1 - high], 16 if stands else 7)] + [
            (t, 12 if stands else 0) for t in lying
        ]

    # ---- grounds, rails, names at pins ----

    def _decor(self, part: Part, pins: list[Any]) -> tuple[list[Any], list[Rect], int]:
        """Symbols at pins: (what, x, y, dx, dy, words), the room that they take, and what the eye says to where they point."""
        decor, boxes, cost = [], [], 0
        for net, (x, y, dx, dy) in zip(part.nets, pins, strict=True):
            rails = self.circuit.rails
            words = self.circuit.port(net)
            half = ceil(wide(words) / 2)
            if not self.wired(net):
                boxes.append((x, y, x, y))
            if net == "0" and dy < 0 and self.hangs and part.role != "source":
                # below ground everything hangs on it
                decor.append(("rail", x, y, dx, dy, "0"))
                boxes.append((x - 1, y - 3, x + 1, y - 1))
            elif net == "0":
                side = abs(dx)
                cost += 4 if self.hangs and dy > 0 and part.role != "source" else 0
                decor.append(("ground", x, y, dx, dy, ""))
                cost += 0 if dy > 0 else 9 if side else 60
                boxes.append(
                    (x - 1, y + 1, x + 1, y + 2)
                    if dy > 0
                    else (x - 1, y - 2, x + 1, y - 1)
                    if dy < 0
                    else _hull((x + dx, y), (x + 2 * dx - dx, y + 2), 1)
                )
            elif net in rails:
                up = -1 if rails[net] else 1
                decor.append(("rail", x, y, dx, dy, words))
                half = max(1, half)
                # the bar one step along, its name beyond
                if dy == up or (dy < 0 and part.role == "source"):
                    up = dy
                    boxes.append(_hull((x - half, y + up), (x + half, y + 3 * up), 0))
                elif dx:
                    cost += 9
                    boxes.append(_hull((x + dx, y), (x + dx + 2 * half * dx, y + 4 * up), 0))
                else:
                    cost += 60
                    boxes.append(_hull((x - half, y + dy), (x + half, y + 3 * dy), 0))
            elif not self.wired(net) and part.role != "port":
                decor.append(("name", x, y, dx, dy, words))
                far = ceil(wide(words)) + 1
                if dx:
                    boxes.append(_hull((x + dx, y - 1), (x + far * dx, y + 1), 0))
                else:
                    boxes.append(_hull((x - half, y + dy), (x + half, y + 2 * dy), 0))
        return decor, boxes, cost

    # ---- labels ----

    def _labels(
        self, part: Part, box: Rect, pins: list[Any], boxes: list[Rect]
    ) -> Iterator[tuple[tuple[float, float, str] | None, Rect | None, int]]:
        """Places of the label about the box: (x, y of the first line, anchor), its room, and a cost."""
        lines = part.label
        if not lines:
            yield None, None, 0
            return
        width, n = max(map(wide, lines)), len(lines)
        x0, y0, x1, y1 = box
        cx, cy = (x0 + x1) / 2, (y0 + y1) / 2
        first = cy - LINE * (n - 1) / 2
        tall = LINE * n / 2
        rows = (round(cy - tall + 0.2), round(cy + tall - 0.2))
        half, far = ceil(width / 2 - 0.2), round(width + 0.4)
        places: list[tuple[tuple[float, float, str], Rect, int]] = [
            ((x1 + 0.35, first, "start"), (x1 + 1 - (x1 > cx), rows[0], x1 + far, rows[1]), 0),
            ((x0 - 0.35, first, "end"), (x0 - far, rows[0], x0 - 1 + (x0 < cx), rows[1]), 2),
        ]
        above = (
            (cx, y0 - 0.2 - LINE * (n - 0.5), "middle"),
            (round(cx) - half, y0 - ceil(LINE * n), round(cx) + half, y0 - 1),
            0,
        )
        below = (
            (cx, y1 + 0.2 + LINE * 0.5, "middle"),
            (round(cx) - half, y1 + 1, round(cx) + half, y1 + ceil(LINE * n)),
            3,
        )
        if part.role == "port":
            places = places[:1] if pins[0][2] < 0 else places[1:]
            (lx, _, anchor), *_ = places[0]
            far = ceil(width) + 1
            yield (lx, 0.0, anchor), (1, 0, far, 0) if pins[0][2] < 0 else (-far, 0, -1, 0), 0
            return
        if part.role == "amplifier":
            left = x1 - 0.1
            above = (
                (left, y0 - 0.6 - LINE * (n - 1), "start"),
                (x1, y0 - ceil(LINE * n), x1 + ceil(width), y0 - 1),
                0,
            )
            below = ((left, y1 + 0.8, "start"), (x1, y1 + 1, x1 + ceil(width), y1 + ceil(LINE * n)), 3)
        lies = all(dy == 0 for *_, dy in pins)
        about = [above, below] if lies else places
        if part.role in ("box", "amplifier", "transistor") and not lies:
            about = [*places, above, below]
        taken = [r for x, y, dx, dy in pins for r in ((x, y, x, y), (x + dx, y + dy, x + dx, y + dy))] + boxes
        found = [place for place in about if not any(_meet(place[1], other) for other in taken)]
        yield from found or [_corner(box, taken, width, n)]


def _corner(
    box: Rect, taken: list[Rect], width: float, lines: int
) -> tuple[tuple[float, float, str], Rect, int]:
    """A label beside a corner of a box whose four sides have pins: right above, as far up as all that hangs on the pins asks."""
    _, y0, x1, _ = box
    far, up = ceil(width), ceil(LINE * lines)
    bottom = y0 - 1
    while any(_meet((x1 + 1, bottom - up + 1, x1 + far, bottom), other) for other in taken):
        bottom -= 1
    rect = (x1 + 1, bottom - up + 1, x1 + far, bottom)
    return (x1 + 0.6, bottom + 0.5 - LINE * (lines - 0.5), "start"), rect, 2


def packed(frames: list[Rect]) -> list[Grid]:
    """How far each of the frames is moved so that they stand on shelves, in their order: of all widths of a shelf the one that
    fills a page best."""
    sizes = [f[2] - f[0] + GAP for f in frames]
    widths = {sum(sizes[i : j + 1]) for i in range(len(sizes)) for j in range(i, len(sizes))}
    best: list[Grid] = []
    least = float("inf")
    for width in sorted(w for w in widths if w >= max(sizes)):
        shelves: list[list[int]] = [[]]
        for k, size in enumerate(sizes):
            if sum(sizes[i] for i in shelves[-1]) + size > width:
                shelves.append([])
            shelves[-1].append(k)
        moved, top, reach = [], 0, 0
        for shelf in shelves:
            x, tall = 0, max(frames[k][3] - frames[k][1] for k in shelf)
            for k in shelf:
                moved.append((x - frames[k][0], top + tall - frames[k][3]))
                x += sizes[k]
            reach, top = max(reach, x), top + tall + GAP
        if max(reach / PAGE, top) < least:
            best, least = moved, max(reach / PAGE, top)
    return best


def _box(box: Rect, turn: Turn) -> Rect:
    a, b = turned((box[0], box[1]), turn), turned((box[2], box[3]), turn)
    return (round(min(a[0], b[0])), round(min(a[1], b[1])), round(max(a[0], b[0])), round(max(a[1], b[1])))


def _hull(a: tuple[int, int], b: tuple[int, int], about: int) -> Rect:
    return (min(a[0], b[0]) - about, min(a[1], b[1]), max(a[0], b[0]) + about, max(a[1], b[1]))


def _meet(a: Rect, b: Rect) -> bool:
    return a[0] <= b[2] and b[0] <= a[2] and a[1] <= b[3] and b[1] <= a[3]
