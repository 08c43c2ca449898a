"""Rser= Lser= RLshunt= Rpar= Cpar= on the lines of C, L and V, as LTspice has them: elements of their own.

n+ --- Rser --- Lser --- the element --- n-        Rpar and Cpar from n+ to n-, RLshunt across Lser
"""

from __future__ import annotations

from .base import Element
from .c import Capacitor
from .l import Inductor
from .r import Resistor

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

# what each letter may have, in the order from n+
SERIES: dict[str, tuple[str, ...]] = {"c": ("rser", "lser"), "l": ("rser",), "v": ("rser",)}
ACROSS: dict[str, tuple[str, ...]] = {"c": ("rpar", "cpar"), "l": ("rpar", "cpar"), "v": ("cpar",)}
KINDS: dict[str, type[Element]] = {"r": Resistor, "l": Inductor, "c": Capacitor}


def taken_out(e: Element) -> list[Element]:
    """The elements that the parameters of `e` stand for; `e` loses those parameters and moves behind what is in series."""
    found: list[Element] = []
    outer = list(e.nodes)

    def add(key: str, nodes: list[str], value: Any) -> None:
        part = KINDS[key[0]](f"{key}#{e.name}", nodes, e.span, value)
        if "m" in e.params:
            part.params["m"] = e.params["m"]
        part.is_plain = isinstance(value, float) and e.is_plain
        found.append(part)

    for key in SERIES.get(e.letter, ()):
        if key not in e.params:
            continue
        inner, begin = f"{e.name}#{key}", e.nodes[0]
        add(key, [begin, inner], e.params.pop(key))
        if key == "lser" and "rlshunt" in e.params:
            add("rlshunt", [begin, inner], e.params.pop("rlshunt"))
        e.nodes = [inner, *e.nodes[1:]]
    for key in ACROSS.get(e.letter, ()):
        if key in e.params:
            add(key, outer, e.params.pop(key))
    return found
