"""What an element depends on beside its own terminals, and how a drawing writes it.

Control is not wired: it is written beside what it controls, and every net that is read so bears its name. So a label has to
hold all that is read; a formula that is too long for one becomes f( ) of what it reads.
"""

from __future__ import annotations

import re

from ..expr import Binary, Call, Name, Node, Num, Unary, rewritten

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from ..elements import Element

GROUND = ("0", "gnd")
PROBE = re.compile(r"@([^\[\]]+)\[")  # @r1[i]
# names in expressions that belong to no element
PLAIN = ("time", "temper", "hertz", "pi", "e", "boltz", "planck", "echarge", "kelvin", "c")


class Reads:
    """`nets` whose voltages are read, `names` of elements and joints of which something else is; `probes` as expressions."""

    __slots__ = ("names", "nets", "probes")

    def __init__(self) -> None:
        self.nets: list[str] = []
        self.names: list[str] = []
        self.probes: list[Node] = []

    def between(self, a: str, b: str) -> None:
        self.probes.append(Call("v", [Name(n) for n in (a, b) if n not in GROUND or n == a]))
        self._net(a)
        self._net(b)

    def current(self, name: str) -> None:
        self.probes.append(Call("i", [Name(name)]))
        self.names.append(name)

    def expression(self, node: Node) -> None:
        for part in _parts(node):
            if isinstance(part, Call):
                own = [
                    a.id for a in part.args if isinstance(a, Name) and a.id not in PLAIN and a.id[0] != "@"
                ]
                if own:
                    self.probes.append(part)
                for name in own:
                    if part.fn == "v":
                        self._net(name)
                    else:
                        self.names.append(name)
            elif isinstance(part, Name) and (found := PROBE.match(part.id)):
                self.probes.append(part)
                self.names.append(found[1])

    def _net(self, net: str) -> None:
        if net not in GROUND:
            self.nets.append(net)


def reads(e: Element) -> Reads:
    """All that an element reads."""
    found = Reads()
    form: Any = e.extra.get("form")
    controls = e.extra.get("controls", ())
    if amplifies(e) is not None:
        return found  # its inputs are wired
    if e.letter == "s" or (e.letter in "eg" and form == "linear"):
        found.between(*e.nodes[2:4])
    for control in controls:
        if isinstance(control, tuple):
            found.between(*control)
        else:
            found.current(control)
    if e.letter == "a":
        for kind, word, _ in form:
            if kind == "source":
                found.current(word)
    for value in (e.value, *e.params.values()):
        if isinstance(value, Node):
            found.expression(value)
    return found


def amplifies(e: Element) -> tuple[str, str, float] | None:
    """Of a voltage source that is an operational amplifier by its gain +, - and the gain: its output stands against ground, and
    its inputs are wired. E with a number, B whose expression is a multiple of a voltage or of a difference of two."""
    if e.letter not in "eb" or e.nodes[1] not in GROUND:
        return None
    if e.letter == "e":
        if e.extra.get("form") != "linear" or not isinstance(e.value, (int, float)):
            return None
        plus, minus, gain = e.nodes[2], e.nodes[3], float(e.value)
    else:
        parts = _linear(e.value) if e.extra.get("output") == "v" and isinstance(e.value, Node) else None
        found = sorted((parts or {}).items(), key=lambda item: -item[1])
        if len(found) == 1:
            found = sorted([*found, ("0", -found[0][1])], key=lambda item: -item[1])
        if len(found) != 2 or found[0][1] != -found[1][1]:
            return None
        (plus, gain), (minus, _) = found
    if gain < 0:
        plus, minus, gain = minus, plus, -gain
    # 60 dB and more; what a source of less is, a drawing says as a factor
    return (plus, minus, gain) if gain >= 1e3 and plus != minus else None


def _linear(node: Node) -> dict[str, float] | None:
    """Of a sum of multiples of voltages the factor of each; "" stands for 1, and ground for nothing. None: it is another law."""
    if isinstance(node, Num):
        return {"": float(node.value)} if node.value else {}
    if isinstance(node, Call) and node.fn == "v" and all(isinstance(a, Name) for a in node.args):
        nets = [getattr(a, "id", "") for a in node.args]
        both: dict[str, float] = {}
        for net, sign in zip(nets, (1.0, -1.0), strict=False):
            both = _added(both, {net: sign} if net not in GROUND else {}, 1.0)
        return both
    if isinstance(node, Unary) and node.op in "+-":
        inner = _linear(node.a)
        return None if inner is None else _added({}, inner, -1.0 if node.op == "-" else 1.0)
    if not isinstance(node, Binary):
        return None
    a, b = _linear(node.a), _linear(node.b)
    if a is None or b is None:
        return None
    if node.op in "+-":
        return _added(a, b, -1.0 if node.op == "-" else 1.0)
    if node.op == "*" and set(a) <= {""}:
        return _added({}, b, a.get("", 0.0))
    if node.op == "*" and set(b) <= {""}:
        return _added({}, a, b.get("", 0.0))
    return _added({}, a, 1.0 / b[""]) if node.op == "/" and set(b) == {""} else None


def _added(a: dict[str, float], b: dict[str, float], factor: float) -> dict[str, float]:
    found = {net: a.get(net, 0.0) + factor * b.get(net, 0.0) for net in (*a, *b)}
    return {net: value for net, value in found.items() if value}


def terminals(e: Element) -> list[str]:
    """Its nodes as they stand on its line, those aside that only control it; of an amplifier +, -, out."""
    if (found := amplifies(e)) is not None:
        return [found[0], found[1], e.nodes[0]]
    if e.letter in "eghfbsw":
        return e.nodes[:2]
    return list(e.extra.get("ends", e.nodes)) if e.letter == "a" else e.nodes


def told(node: Node, net: Callable[[str], str], name: Callable[[str], str]) -> Node:
    """An expression in the names that a drawing has for nets and for all else."""

    def change(part: Node) -> Node | None:
        if isinstance(part, Call) and part.fn == "v":
            return Call("v", [Name(net(a.id)) if isinstance(a, Name) else a for a in part.args], part.at)
        if isinstance(part, Name):
            probe = PROBE.match(part.id)
            return Name(f"@{name(probe[1])}{part.id[probe.end(1) :]}" if probe else name(part.id), part.at)
        return None

    return rewritten(node, change)


def _parts(node: Node) -> Iterator[Node]:
    yield node
    for part in (*getattr(node, "args", ()), *(getattr(node, key, None) for key in "cab")):
        if isinstance(part, Node):
            yield from _parts(part)
