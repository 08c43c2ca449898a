"""What is connected in a sheet: points that wires, pins and labels share, by the rule of the program that drew it.

Points are the nodes of a graph, wires tie their ends. What else lies on a wire is tied to it as the rule says; lines that only
cross are not. Nets are then called by their labels, or numbered in the order in which their first wire or pin stands.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator

    from .sheet import Label, Point, Sheet


class Rule:
    """What is tied to a wire between its ends: `tees` ends of other wires, `pins`, `labels`. Junctions always are. `number`: what
    a net without a label is called, by its number from 1."""

    def __init__(
        self,
        tees: bool,
        pins: bool,
        labels: bool,
        number: Callable[[int], str],
    ) -> None:
        self.tees, self.pins, self.labels, self.number = tees, pins, labels, number


class Ties:
    """Things that are connected: Tarjan's disjoint sets."""

    def __init__(self) -> None:
        self.of: dict[Hashable, Hashable] = {}

    def root(self, a: Hashable) -> Hashable:
        self.of.setdefault(a, a)
        while self.of[a] != a:
            self.of[a] = a = self.of[self.of[a]]
        return a

    def tie(self, a: Hashable, b: Hashable) -> None:
        self.of[self.root(a)] = self.root(b)


def connect(sheet: Sheet, rule: Rule, ties: Iterable[tuple[Point, Point]] = ()) -> dict[str, list[Label]]:
    """Says of every pin and wire of a sheet which net it is on; `ties` are points that are one beside. Returns the labels by the
    net that they are on."""
    found = Ties()
    for wire in sheet.wires:
        found.tie(wire.a, wire.b)
    for a, b in ties:
        found.tie(a, b)
    pins = {(pin.x, pin.y) for symbol in sheet.symbols for pin in symbol.pins}
    inner = set(sheet.junctions)
    inner |= {end for wire in sheet.wires for end in (wire.a, wire.b)} if rule.tees else set()
    inner |= pins if rule.pins else set()
    inner |= {label.at for label in sheet.labels} if rule.labels else set()
    for point, end in _within(sheet, inner):
        found.tie(point, end)
    for label in sheet.labels:
        found.tie(label.at, label.key)
    return _name(sheet, rule, found)


def stray(sheet: Sheet) -> Iterator[tuple[Point, str]]:
    """Ends of wires that lie on a wire of another net: its point and its net."""
    nets = {end: wire.net for wire in sheet.wires for end in (wire.a, wire.b)}
    for point, end in _within(sheet, set(nets)):
        if nets[point] != nets[end]:
            yield point, nets[point]


def _within(sheet: Sheet, points: set[Point]) -> Iterator[tuple[Point, Point]]:
    """Points that lie on a wire, with an end of that wire."""
    columns: dict[int, list[int]] = defaultdict(list)
    rows: dict[int, list[int]] = defaultdict(list)
    for x, y in sorted(points):
        columns[x].append(y)
        rows[y].append(x)
    for wire in sheet.wires:
        (x0, y0), (x1, y1) = min(wire.a, wire.b), max(wire.a, wire.b)
        if x0 == x1:
            near = [(x0, y) for y in _between(columns.get(x0, []), y0, y1)]
        elif y0 == y1:
            near = [(x, y0) for x in _between(rows.get(y0, []), x0, x1)]
        else:
            near = [
                (x, y) for x, y in points if x0 <= x <= x1 and (x - x0) * (y1 - y0) == (y - y0) * (x1 - x0)
            ]
        for point in near:
            yield point, wire.a


def _between(values: list[int], low: int, high: int) -> list[int]:
    return values[bisect_left(values, low) : bisect_right(values, high)]


def _name(sheet: Sheet, rule: Rule, found: Ties) -> dict[str, list[Label]]:
    """Names of nets: by the label that goes first, or by number."""
    labels: dict[Hashable, list[Label]] = defaultdict(list)
    for label in sheet.labels:
        labels[found.root(label.at)].append(label)
    names: dict[Hashable, str] = {}
    for root, these in labels.items():
        names[root] = min(these, key=lambda label: label.rank).name
        for label in these:
            label.net = names[root]
    taken = {name.lower() for name in names.values()}
    number = 0
    first: dict[Hashable, Point] = {}
    for a in [*(w.a for w in sheet.wires), *(w.b for w in sheet.wires)]:
        root = found.root(a)
        first[root] = min(first.get(root, a), a, key=lambda p: (p[1], p[0]))
    for symbol in sheet.symbols:
        for pin in symbol.pins:
            first.setdefault(found.root((pin.x, pin.y)), (pin.x, pin.y))
    for root, _ in sorted(first.items(), key=lambda item: (item[1][1], item[1][0])):
        if root not in names:
            number += 1
            while rule.number(number).lower() in taken:
                number += 1
            names[root] = rule.number(number)
    for symbol in sheet.symbols:
        for pin in symbol.pins:
            pin.net = names[found.root((pin.x, pin.y))]
    for wire in sheet.wires:
        wire.net = names[found.root(wire.a)]
    return {names[root]: these for root, these in labels.items()}
