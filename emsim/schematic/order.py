"""The order that a circuit's netlist holds: what the signal comes to first, what lies higher, what belongs together.

From it follow how a part stands (`falls`, `mirrored`) and what is wished of two parts (`wishes`): (what, a, b, weight), see
engine/schematic/src/lib.rs.
"""

from __future__ import annotations

from itertools import combinations, pairwise, permutations, product

from .patterns import Patterns

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .circuit import Circuit, Part
    from .hints import Hint

    Wish = tuple[str, int, int, int]

LEVEL = 0.12  # difference of levels from which on a part stands


class Order:
    """`near`: steps of the signal to every part; `heights`: voltage levels of nets; `mirrored`: transistors in pairs."""

    def __init__(self, circuit: Circuit) -> None:
        self.circuit = circuit
        self.fixed = {"0"} | set(circuit.rails)
        self.near = self._distances()
        self.heights = self._heights()
        self.patterns = Patterns(circuit)
        self.mirrored = dict(self.patterns.mirrored)
        self.pairs = self._pairs()

    # ---- how a part stands ----

    def falls(self, part: Part) -> int:
        """1 or -1 where the voltage falls along a part, from its first pin or towards it, so that it stands; else 0."""
        if (stands := self.patterns.standing.get(part.name)) is not None:
            return stands
        if part.kind in ("diode", "switch") and (leg := self._leg(part)) is not None:
            return leg[0]
        if part.kind == "capacitor" or not self.circuit.rails:
            return 0
        over, under = (self.heights.get(net, 0.0) for net in part.nets[:2])
        return 0 if abs(over - under) < LEVEL else 1 if over > under else -1

    def _heights(self) -> dict[str, float]:
        """The voltage level of every net, rails at 1 and -1: as if all that conducts at rest were resistors of one value."""
        circuit = self.circuit
        level = {net: 1.0 if above else -1.0 for net, above in circuit.rails.items()} | {"0": 0.0}
        links: dict[str, list[tuple[str, float]]] = {net: [] for net in circuit.pins}
        for part in circuit.parts:
            if part.role == "source" and "0" in part.nets:
                for net in part.nets:
                    level.setdefault(net, 0.0 if False in circuit.rails.values() else 0.3)
            if part.role == "transistor":
                pairs = [(0, 2, 1.0), (1, 2, 0.05)]
            elif len(part.nets) != 2:
                pairs = []
            else:
                pairs = [(0, 1, 0.001 if part.kind == "capacitor" else 1.0)]
            for i, j, g in pairs:
                links[part.nets[i]].append((part.nets[j], g))
                links[part.nets[j]].append((part.nets[i], g))
        found = {net: level.get(net, 0.0) for net in links} | level
        for _ in range(200):
            for net, others in links.items():
                if net not in level and others:
                    found[net] = sum(g * found[n] for n, g in others) / sum(g for _, g in others)
        return found

    def _pairs(self) -> list[tuple[int, int]]:
        """Transistors alike that stand side by side, the left one first: with a common emitter the bases look outwards, with a
        common base at each other."""
        parts = self.circuit.parts
        found: list[tuple[int, int]] = []
        transistors = [k for k, p in enumerate(parts) if p.role == "transistor"]
        for common in (2, 1):
            for i, j in combinations(transistors, 2):
                a, b = parts[i], parts[j]
                if a.kind != b.kind or a.nets[common] != b.nets[common]:
                    continue
                if common == 2 and (a.nets[2] in self.fixed or a.nets[1] == b.nets[1]):
                    continue
                if a.name in self.mirrored or b.name in self.mirrored:
                    continue
                left, right = (i, j) if (self.near[i], i) <= (self.near[j], j) else (j, i)
                self.mirrored[parts[left].name] = common == 1
                self.mirrored[parts[right].name] = common == 2
                found.append((left, right))
        return found

    def _leg(self, part: Part) -> tuple[int, int] | None:
        """Of a bridge of diodes or switches: whether this one stands as its symbol does, 1 or -1, and its partner in the leg."""
        for j, net in enumerate(part.nets[:2]):
            for k, pin in self.circuit.pins[net] if net not in self.fixed else ():
                other = self.circuit.parts[k]
                if other is part or other.kind != part.kind or pin == j:
                    continue
                # +1: the outer end of the other one is above, -1: below
                side = self._outside(other.nets[1 - pin], part.kind, 1 - pin)
                own = self._outside(part.nets[1 - j], part.kind, 1 - j)
                if side == -1 or own == 1:
                    return (1 if j == 1 else -1), k
                if side == 1 or own == -1:
                    return (1 if j == 0 else -1), k
        return None

    def _outside(self, net: str, kind: str, pin: int) -> int:
        """Where the common end of a bridge's legs is: below, -1, above, 1, or no such end, 0."""
        if net in self.fixed:
            return 1 if self.circuit.rails.get(net) else -1
        alike = [j for k, j in self.circuit.pins[net] if self.circuit.parts[k].kind == kind]
        if kind != "diode" or len(alike) < 2 or any(j != pin for j in alike):
            return 0
        return 1 if pin == 1 else -1

    # ---- along the signal ----

    def _distances(self) -> list[int]:
        """How many steps from a source each part is: into a base or gate, out of collector and emitter, from what controls a
        source to what it drives, through anything else. What no signal reaches is at its net's distance; supplies are at -1."""
        parts, pins, fixed = self.circuit.parts, self.circuit.pins, self.fixed
        starts = [
            k
            for k, p in enumerate(parts)
            if p.role == "source" and "0" in p.nets and not set(p.nets) <= fixed
        ]
        signal = [k for k in starts if parts[k].kind in ("voltage", "current")] or starts
        found: dict[int, int] = dict.fromkeys(signal, 0)
        far = {net: 1 for k in signal for net in parts[k].nets if net not in fixed}
        far |= {
            p.nets[0]: 0 for p in parts if p.kind == "in" and p.nets[0] not in fixed and p.nets[0] not in far
        }
        if not far:
            far = {net: 1 for p in parts for net in p.nets if net not in fixed and p.role != "port"}
            far = dict(list(far.items())[:1])
        queue = list(far)
        controlled: dict[str, list[tuple[int, int]]] = {}
        for k, part in enumerate(parts):
            for net in part.reads:
                controlled.setdefault(net, []).append((k, -1))
        for net in queue:
            for k, pin in (*pins.get(net, ()), *controlled.get(net, ())):
                part, d = parts[k], far[net]
                if k in found or (part.reads and pin >= 0):
                    continue
                found[k] = d
                is_out = part.role in ("transistor", "amplifier") and not _is_input(part, pin)
                for j, other in enumerate(part.nets):
                    if other not in fixed and other not in far and not (is_out and _is_input(part, j)):
                        far[other] = d + 1
                        queue.append(other)
        for k, part in enumerate(parts):
            if k not in found:
                supply = part.role == "source" and set(part.nets) <= fixed
                found[k] = -1 if supply else min((far.get(n, 98) for n in part.nets), default=98)
        return [found[k] for k in range(len(parts))]

    # ---- wishes ----

    def wishes(self, hints: list[Hint]) -> list[Wish]:
        alone = (*self._along(), *self._stages(), *self._stacks())
        found = [wish for wish in alone if not self.patterns.settled(wish[1], wish[2])]
        found += [*self._bridges(), *self.patterns.wishes]
        names = {p.name: k for k, p in enumerate(self.circuit.parts)}
        for what, a, b in hints:
            if a in names and b in names:
                first, second = (names[b], names[a]) if what in ("right", "below") else (names[a], names[b])
                lies = what in ("right", "left")
                found.append(("right" if lies else "below", first, second, 60))
                found.append(("row" if lies else "column", first, second, 12))
        return found

    def _along(self) -> Iterator[Wish]:
        """The signal goes to the right; what hangs on ground or a rail need only not stand further left."""
        parts, near = self.circuit.parts, self.near
        seen: set[tuple[int, int]] = set()
        for net, places in self.circuit.pins.items():
            for a, b in permutations([k for k, _ in places], 2) if net not in self.fixed else ():
                if near[a] < near[b] and (a, b) not in seen:
                    seen.add((a, b))
                    hangs = len(parts[b].nets) == 2 and bool(set(parts[b].nets) & self.fixed)
                    yield "after" if hangs else "right", a, b, 3 if near[a] == 0 else 2
        for a, part in enumerate(parts):
            if part.role == "source" and near[a] == 0:
                yield from (("after", a, b, 2) for b in range(len(parts)) if near[b] > 0)
            if part.kind == "out":
                yield from (("after", b, a, 2) for b in range(len(parts)) if b != a)

    def _stages(self) -> Iterator[Wish]:
        """Alike things in a row: what lies between two nets, what hangs on ground, transistors that share a net, boxes."""
        parts, near, fixed = self.circuit.parts, self.near, self.fixed

        def ties(part: Part) -> set[str]:
            return set(part.nets) & fixed

        for j, i in combinations(range(len(parts)), 2):
            a, b = parts[i], parts[j]
            if a.role == b.role == "transistor":
                if a.kind == b.kind and any(m == n for m, n in zip(a.nets, b.nets, strict=False)):
                    yield "row", j, i, 3
            elif len(a.nets) == len(b.nets) == 2:
                if ties(a) and ties(b) and set(a.nets) == set(b.nets):
                    yield "row", j, i, 2
                elif (
                    a.kind == b.kind and bool(ties(a)) == bool(ties(b)) and set(a.nets) & set(b.nets) - fixed
                ):
                    yield "row", j, i, 1
        boxes = [k for k, p in enumerate(parts) if p.kind == "use"]
        yield from (
            ("row", i, j, 3) for i, j in pairwise(boxes) if set(parts[i].nets) & set(parts[j].nets) - fixed
        )
        supplies = {k for k, p in enumerate(parts) if p.role == "source" and set(p.nets) <= fixed}
        two = [k for k, p in enumerate(parts) if len(p.nets) == 2 and k not in supplies]
        hanging = sorted((k for k in two if "0" in parts[k].nets), key=lambda k: (near[k], k))
        yield from (("row", i, j, 1) for i, j in pairwise(hanging))
        for kind in dict.fromkeys(parts[k].kind for k in hanging):
            yield from (("row", i, j, 3) for i, j in pairwise(k for k in hanging if parts[k].kind == kind))
        lying = [k for k in two if not ties(parts[k]) and not self.falls(parts[k])]
        for j, i in combinations(lying, 2):
            if len(set(parts[i].nets) & set(parts[j].nets)) == 1:
                yield "row", j, i, 3 if parts[i].kind == parts[j].kind else 2

    def _stacks(self) -> Iterator[Wish]:
        """Pairs of transistors, and transistors on one another."""
        parts = self.circuit.parts
        for a, b in self.pairs:
            yield "row", a, b, 4
            yield "right", a, b, 4

        def looks(part: int, pin: int) -> int:
            return int(parts[part].symbol("ansi").pins[pin][1][1])

        for net, places in self.circuit.pins.items():
            if net in self.fixed or len(places) > 5:
                continue
            over = [k for k, j in places if parts[k].role == "transistor" and looks(k, j) > 0]
            under = [k for k, j in places if parts[k].role == "transistor" and looks(k, j) < 0]
            for a, b in product(over, under):
                yield "below", a, b, 6
                if len(over) == len(under) == 1:
                    yield "column", a, b, 3

    def _bridges(self) -> Iterator[Wish]:
        """A leg of a bridge is a column, the legs stand side by side."""
        parts = self.circuit.parts
        for i, part in enumerate(parts):
            leg = self._leg(part) if part.kind in ("diode", "switch") else None
            if leg is None:
                continue
            turn, other = leg
            lower = part.nets[1 if turn > 0 else 0]
            if lower in parts[other].nets:
                yield "below", i, other, 4
                yield "column", i, other, 6
            if lower not in self.fixed:
                for j in range(i):
                    if parts[j].kind == part.kind and set(parts[j].nets) & set(part.nets) - {lower}:
                        yield "row", i, j, 4


def _is_input(part: Part, pin: int) -> bool:
    return pin < 2 if part.role == "amplifier" else pin == 1
