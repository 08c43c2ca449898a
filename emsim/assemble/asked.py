"""Which reactions and efforts a deck reads: each costs an unknown, so it is made only where it is asked for."""

from __future__ import annotations

from ..expr import Name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

FORCES = {"fx": ("shift", 0), "fy": ("shift", 1), "fz": ("shift", 2)}
MOMENTS = {"mx": ("turn", 0), "my": ("turn", 1), "mz": ("turn", 2)}
REACTIONS = {**FORCES, **MOMENTS}
LOAD = "load"  # with how much force the parts of a joint press on each other
EFFORTS = ("force", "torque", "power", "p", "friction")


def wanted(flat: Any) -> set[tuple[str, str]]:
    """(function, name) of every call in the deck that may need a reaction."""
    found: set[tuple[str, str]] = set()
    for card in flat.machine:
        if card.kind == "FRICTION" and "mu" in card.params:  # it rubs by the load of its joint
            found |= {(LOAD, ref.name) for ref in card.args[:1]}
    for call in _calls(_expressions(flat)):
        most = (
            1 if call.fn in REACTIONS else 2 if call.fn in EFFORTS else 0
        )  # torque(ratio,2): of its second joint
        if 1 <= len(call.args) <= most and isinstance(call.args[0], Name):
            found.add((call.fn, call.args[0].id))
    return found


def _expressions(flat: Any) -> Iterator[Any]:
    for e in flat.elements:
        yield e.value
        if e.params:
            yield from e.params.values()
        if e.extra:
            yield from e.extra.values()
    for card in flat.machine:
        yield from card.params.values()
    for request in flat.prints:
        yield from (ast for _, ast in request.items)
    for card in (*flat.measures, *flat.fours):
        yield from card.expressions()
    for probe in (*flat.saves, *flat.probes, *flat.also):
        yield probe.ast
    for analysis in flat.analyses:
        yield from analysis.args


def _calls(nodes: Iterable[Any]) -> Iterator[Any]:
    stack = list(nodes)
    while stack:
        node = stack.pop()
        if node is None or isinstance(node, (int, float, str)):
            continue
        if isinstance(node, (list, tuple)):
            stack.extend(node)
            continue
        if hasattr(node, "fn"):
            yield node
            stack.extend(node.args)
        else:
            stack.extend(getattr(node, part, None) for part in ("a", "b", "c"))
