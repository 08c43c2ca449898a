"""Patterns that textbooks draw in one way, found in the netlist, and what is wished of their parts.

    R-2R ladder   the R in a row, a 2R below each node, what drives it below that; the end that 2R closes is left
    legs          of a bridge of switches, transistors or diodes: side by side in the deck's order
    class AB      a complementary pair, emitter on emitter; what biases their bases is a column before them, from rail to rail

`standing` turns parts (1: the first pin above, -1: below), `mirrored` transistors; `settled` says of which pairs nothing else is
wished.
"""

from __future__ import annotations

from itertools import pairwise
from math import log2
from typing import NamedTuple

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .circuit import Circuit, Part
    from .order import Wish

UPPER, LOWER = ("npn", "nmos", "njf"), ("pnp", "pmos", "pjf")


class Ladder(NamedTuple):
    """Parts by number; the legs of a node: first that of its bit, then what closes the end; drivers by leg."""

    rungs: list[int]
    legs: list[list[int]]
    drivers: dict[int, int]


class Patterns:
    def __init__(self, circuit: Circuit) -> None:
        self.circuit = circuit
        self.fixed = {"0"} | set(circuit.rails)
        self.standing: dict[str, int] = {}
        self.groups: list[set[int]] = []
        self.drivers: set[int] = set()
        self.wishes: list[Wish] = []
        self.mirrored: dict[str, bool] = {}
        for ladder in circuit.ladders:
            self._ladder(ladder)
        self._bridges()
        self._output_stages()

    def settled(self, a: int, b: int) -> bool:
        """Does a pattern alone say how two parts stand to each other?"""
        return bool({a, b} & self.drivers) or any(a in group and b in group for group in self.groups)

    # ---- R-2R ladder ----

    def _ladder(self, ladder: Ladder) -> None:
        rungs, legs, drivers = ladder
        firsts = [node[0] for node in legs]
        standing = [*(leg for node in legs[:1] for leg in node[1:]), *firsts]
        standing += [leg for node in legs[1:] for leg in node[1:]]
        self.groups.append({*rungs, *standing, *drivers.values()})
        self.drivers |= set(drivers.values())
        for row in (rungs, standing, [drivers[leg] for leg in firsts if leg in drivers]):
            for a, b in pairwise(row):
                self.wishes += [("right", a, b, 6), ("row", a, b, 6)]
        for rung, (left, right) in zip(rungs, pairwise(firsts), strict=True):
            self.wishes += [("right", left, rung, 3), ("right", rung, right, 3)]
        for leg, driver in drivers.items():
            self.wishes += [("below", leg, driver, 4), ("column", leg, driver, 8)]
        parts = self.circuit.parts
        ends = {net for k in rungs for net in parts[k].nets}
        for k in standing:
            self.standing[parts[k].name] = 1 if parts[k].nets[0] in ends else -1

    # ---- legs of a bridge ----

    def _bridges(self) -> None:
        """In the deck's order; where others of their kind lie beside them, as diodes do, these stay with their leg."""
        parts = self.circuit.parts
        families = [self._legs(kinds) for kinds in (("switch",), (*UPPER, *LOWER), ("diode",))]
        for legs in families[:2]:
            self._side_by_side([leg for _, leg in legs])
        for _, leg in families[1]:
            self._driven(leg)
        active = [leg for legs in families[:2] for leg in legs]
        diodes = families[2]
        for mid, (a, b) in diodes:
            # a diode whose cathode is in the middle is the lower one; both point upwards
            lower, upper = (a, b) if parts[a].nets[1] == mid else (b, a)
            self.wishes += [("below", upper, lower, 6), ("column", upper, lower, 8)]
            self.standing |= {parts[k].name: -1 for k in (a, b)}
        if not active:
            return self._side_by_side([leg for _, leg in diodes])
        mids = [mid for mid, _ in active]
        for (_, (left, _)), (right_mid, (right, _)) in pairwise(active):
            for mid, (beside, _) in diodes:
                if mid == right_mid:
                    self.wishes.append(("right", left, beside, 4))
                elif mids.index(mid) + 1 == mids.index(right_mid) if mid in mids else False:
                    self.wishes.append(("right", beside, right, 4))
        return None

    def _side_by_side(self, legs: list[list[int]]) -> None:
        for (a, _), (b, _) in pairwise(legs):
            self.wishes += [("right", a, b, 8), ("row", a, b, 4)]

    def _driven(self, leg: list[int]) -> None:
        """Gates look left, and a source that a gate has for itself stands before it, not before the whole bridge."""
        for k in leg:
            part = self.circuit.parts[k]
            self.mirrored[part.name] = False
            gate = self.circuit.pins[part.nets[1]]
            for source, _ in gate if len(gate) == 2 else ():
                if self.circuit.parts[source].role == "source":
                    self.drivers.add(source)
                    self.wishes += [("right", source, k, 6), ("row", source, k, 2)]

    def _legs(self, kinds: tuple[str, ...]) -> list[tuple[str, list[int]]]:
        """By middle the two parts on one another of every leg; of several legs between the same two nets, in the deck's order. A
        middle that controls another leg is a stage of a signal, no leg."""
        parts = self.circuit.parts
        found: dict[tuple[str, ...], list[tuple[str, list[int]]]] = {}
        for mid, places in self.circuit.pins.items():
            if mid in self.fixed:
                continue
            ends = [(k, pin) for k, pin in places if parts[k].kind in kinds and pin in _power(parts[k])]
            outer = sorted(_other(parts[k], mid) for k, _ in ends)
            controls = any(parts[k].kind in kinds and pin not in _power(parts[k]) for k, pin in places)
            if len(ends) == 2 and outer[0] != outer[1] and mid not in outer and not controls:
                (a, own), (b, other) = ends
                # one feeds the middle and the other draws from it; switches do either
                alike = (parts[a].kind in LOWER) == (parts[b].kind in LOWER)
                if kinds == ("switch",) or alike == (own != other):
                    found.setdefault(tuple(outer), []).append((mid, [a, b]))
        several = [legs for legs in found.values() if len(legs) > 1]
        return [leg for legs in several for leg in sorted(legs, key=lambda leg: min(leg[1]))]

    # ---- class AB output stage ----

    def _output_stages(self) -> None:
        parts = self.circuit.parts
        over = [k for k, p in enumerate(parts) if p.kind in UPPER]
        under = [k for k, p in enumerate(parts) if p.kind in LOWER]
        for a in over:
            for b in under:
                outputs, bias = self._joined(a, b), self._bias(a, b)
                if outputs is None or not bias:
                    continue
                for column in ([a, *outputs, b], bias):
                    for up, down in pairwise(column):
                        self.wishes += [("below", up, down, 6), ("column", up, down, 6)]
                self.wishes += [("right", bias[0], a, 3), ("right", bias[-1], b, 3)]
                self.groups.append({a, b, *outputs, *bias})
                self._stand([a, *outputs, b], parts[a].nets[2])
                self._stand(bias, None)

    def _stand(self, column: list[int], net: str | None) -> None:
        """Two-pin parts of a column from above: the net between one and the next is the lower end of the one."""
        parts = self.circuit.parts
        for up, down in pairwise(column):
            shared = set(parts[up].nets) & set(parts[down].nets) - self.fixed
            for k, side in ((up, -1), (down, 1)):
                if len(parts[k].nets) == 2 and shared:
                    self.standing[parts[k].name] = side if parts[k].nets[0] in shared else -side

    def _joined(self, a: int, b: int) -> list[int] | None:
        """What lies between two emitters: nothing, or a resistor at each; None where they are not joined."""
        parts, pins = self.circuit.parts, self.circuit.pins
        up, down = parts[a].nets[2], parts[b].nets[2]
        if up in self.fixed or down in self.fixed:
            return None
        if up == down:
            return []
        upper, lower = (
            {_other(parts[k], net): k for k, _ in pins[net] if parts[k].kind == "resistor"}
            for net in (up, down)
        )
        middle = [net for net in upper if net in lower and net not in self.fixed]
        return [upper[middle[0]], lower[middle[0]]] if middle else None

    def _bias(self, a: int, b: int) -> list[int]:
        """From the rail above to that below: what feeds one base, what lies between the two, what draws from the other."""
        parts = self.circuit.parts
        top, bottom = parts[a].nets[1], parts[b].nets[1]
        outputs = {parts[a].nets[2], parts[b].nets[2]}
        if top == bottom:
            return []
        before: dict[str, tuple[str, int]] = {top: ("", -1)}
        queue = [top]
        for net in queue:
            for k, other in self._through(net) if net not in self.fixed else ():
                if other not in before and other not in self.fixed | outputs and k not in (a, b):
                    before[other] = (net, k)
                    queue.append(other)
        if bottom not in before:
            return []
        between: list[int] = []
        net = bottom
        while net != top:
            net, k = before[net]
            between.insert(0, k)
        feeds = [
            [k for k, other in self._through(net) if other in self.fixed and k not in (a, b)]
            for net in (top, bottom)
        ]
        return [*feeds[0][:1], *between, *feeds[1][:1]]

    def _through(self, net: str) -> Iterator[tuple[int, str]]:
        """What conducts at rest from a net, and the net at its other end."""
        for k, pin in self.circuit.pins[net]:
            part = self.circuit.parts[k]
            if pin in _power(part) and part.kind != "capacitor":
                yield k, _other(part, net)


def ladders(circuit: Circuit) -> list[Ladder]:
    """Chains of at least two equal resistors with one of twice that value at every node: nearer to twice than to once or four
    times on the logarithmic scale, so that a ladder with tolerances is one."""
    values = {e.name: e.value for e in circuit.flat.elements if e.letter == "r"}
    ohms = {
        k: float(value)
        for k, p in enumerate(circuit.parts)
        if p.kind == "resistor" and isinstance(value := values.get(p.name), (int, float)) and value > 0
    }
    found: list[Ladder] = []
    taken: set[int] = set()
    for r in sorted(set(ohms.values())):
        size = {k: log2(ohm / r) for k, ohm in ohms.items() if k not in taken}
        rungs = [k for k, s in size.items() if abs(s) < 0.5 and "0" not in circuit.parts[k].nets]
        twice = {k for k, s in size.items() if abs(s - 1) <= 0.5}
        for chain in _chains(circuit, rungs):
            ladder = _ladder(circuit, chain, twice)
            if ladder is not None:
                found.append(ladder)
                taken |= {*ladder.rungs, *(leg for node in ladder.legs for leg in node)}
    return found


def _chains(circuit: Circuit, rungs: list[int]) -> list[list[int]]:
    """Parts in series, in the order in which they follow each other; no net has a third one."""
    on: dict[str, list[int]] = {}
    for k in rungs:
        for net in circuit.parts[k].nets:
            on.setdefault(net, []).append(k)
    found: list[list[int]] = []
    for net, own in on.items():
        if len(own) != 1 or any(own[0] in chain for chain in found):
            continue
        chain, here = [own[0]], _other(circuit.parts[own[0]], net)
        while len(on[here]) == 2 and (more := [k for k in on[here] if k not in chain]):
            chain.append(more[0])
            here = _other(circuit.parts[more[0]], here)
        if len(on[here]) == 1 and len(chain) > 1:
            found.append(chain)
    return found


def _ladder(circuit: Circuit, chain: list[int], twice: set[int]) -> Ladder | None:
    parts, pins = circuit.parts, circuit.pins
    (joint,) = set(parts[chain[0]].nets) & set(parts[chain[1]].nets)
    nodes = [_other(parts[chain[0]], joint), joint]
    for k in chain[1:]:
        nodes.append(_other(parts[k], nodes[-1]))
    # that of a bit first, then what goes to ground
    legs = [
        sorted((k for k, _ in pins[net] if k in twice), key=lambda k: ("0" in parts[k].nets, k))
        for net in nodes
    ]
    if not all(legs):
        return None
    driven = [any(parts[k].role == "source" for k, _ in pins[nodes[end]]) for end in (0, -1)]
    closed = [len(legs[end]) > 1 for end in (0, -1)]
    if driven[1] > driven[0] or (driven[0] == driven[1] and closed[1] > closed[0]):
        chain, nodes, legs = chain[::-1], nodes[::-1], legs[::-1]
    drivers: dict[int, int] = {}
    for net, (leg, *_) in zip(nodes, legs, strict=True):
        places = pins[_other(parts[leg], net)]
        for k, _ in places:
            if parts[k].role == "source" and "0" in parts[k].nets and len(places) == 2:
                drivers[leg] = k
    return Ladder(chain, legs, drivers)


def _power(part: Part) -> tuple[int, ...]:
    """Pins that a current flows between; of a transistor all but what controls it."""
    return (0, 2) if part.role == "transistor" else (0, 1) if len(part.nets) == 2 else ()


def _other(part: Part, net: str) -> str:
    """The net at the other end."""
    i, j = _power(part)
    return part.nets[j] if part.nets[i] == net else part.nets[i]
