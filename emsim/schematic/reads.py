"""What an element depends on beside its own terminals, and how a drawing writes it.

Control is not wired: it is written beside what it controls, and every net that is read so bears its name. So a label has to
hold all that is read; a formula that is too long for one becomes f( ) of what it reads.
"""

from __future__ import annotations

import re

from ..expr import Call, Name, Node, rewritten

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


def terminals(e: Element) -> list[str]:
    """Its nodes as they stand on its line, those aside that only control it."""
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
