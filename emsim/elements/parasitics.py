"""Rser= Lser= RLshunt= Rpar= Cpar= on the lines of C, L, V and B, as LTspice has them: elements of their own.

n+ --- Rser --- Lser --- the element --- n-        Rpar and Cpar from n+ to n-, RLshunt across Lser
"""

from __future__ import annotations

from .base import Element
from .c import Capacitor
from .l import Inductor
from .r import Resistor

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

# what each letter may have, in the order from n+
SERIES: dict[str, tuple[str, ...]] = {"c": ("rser", "lser"), "l": ("rser",), "v": ("rser",)}
ACROSS: dict[str, tuple[str, ...]] = {
    "c": ("rpar", "cpar"),
    "l": ("rpar", "cpar"),
    "v": ("cpar",),
    "b": ("rpar", "cpar"),
}
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
        if e.params[key] == 0.0:  # nothing in series
            e.extra[key] = e.params.pop(key)
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


def with_resistance(body: list[Any], ohm: float) -> None:
    """A resistance in series with every coil of a level that no K names and that has none of its own."""
    from ..deck import Conditional, Subckt
    from .k import Coupling

    def cards(body: list[Any]) -> Iterator[Any]:
        for card in body:
            yield card
            if isinstance(card, Conditional):
                for _, branch in card.branches:
                    yield from cards(branch)

    everything = list(cards(body))
    held = {name for k in everything if isinstance(k, Coupling) for name in k.extra["inductors"]}
    held.update(part.name.removeprefix("rser#") for part in everything if isinstance(part, Resistor))
    for card in everything:
        if isinstance(card, Subckt):
            with_resistance(card.body, ohm)
    for level in (
        body,
        *(branch for c in everything if isinstance(c, Conditional) for _, branch in c.branches),
    ):
        for card in list(level):
            if (
                isinstance(card, Inductor)
                and not card.is_whole
                and card.name not in held
                and "rser" not in card.extra
            ):
                card.params = {**card.params, "rser": ohm}
                level += taken_out(card)
