"""Voltages of a start with UIC: what capacitors have by ic= and nodes by .ic, brought together.

A capacitor's ic= is a difference of two node voltages, .ic a node's voltage. Along capacitors from ground, or from a node of
.ic, they give the voltage of every node that they reach, so that what else stores charge there begins with it. Where two of them
say different things of one node no such voltages exist: ic= holds before .ic, as in ngspice, the earlier line before the later
one, and charge flows at once between capacitors that stand across each other. That is told.
"""

from __future__ import annotations

from ..expr import Node

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Span
    from .context import Context

GROUND = "0"
SAME = 1e-9  # of the larger one: voltages that differ by less are the same


class _Levels:
    """Nodes whose differences are known."""

    def __init__(self) -> None:
        self._of: dict[
            str, tuple[str, float]
        ] = {}  # a node of the same set, and by how much it lies above that

    def find(self, name: str) -> tuple[str, float]:
        """A node that stands for the set, and how far the node lies above it [V]."""
        above = 0.0
        while name in self._of:
            name, by = self._of[name]
            above += by
        return name, above

    def join(self, a: str, b: str, volts: float) -> float | None:
        """v(a) - v(b) is volts; what it is already, if that is known."""
        (of_a, above_a), (of_b, above_b) = self.find(a), self.find(b)
        if of_a == of_b:
            return above_a - above_b
        if of_a == GROUND:
            of_a, of_b, above_a, above_b, volts = of_b, of_a, above_b, above_a, -volts
        self._of[of_a] = (of_b, above_b + volts - above_a)
        return None


def voltages(ctx: Context) -> dict[str, float]:
    """Voltages of nodes at a start with UIC that ic= and .ic give [V]; contradictions are told (W291)."""
    levels, given = _Levels(), {}
    for e in ctx.elements.values():
        if e.letter == "c" and "ic" in e.params and not isinstance(e.value, Node):
            a, b = ("0" if n == "gnd" else n for n in e.nodes[:2])
            _join(ctx, levels, (a, b, e.number("ic")), f"`{e.name}` begins", e.span)
    for name, value, span in ctx.flat.ics:
        if name in ctx.nodes:
            _join(ctx, levels, (name, GROUND, float(value)), f"node `{name}` begins", span)
    reached = {name for name in ctx.nodes if levels.find(name)[0] == GROUND}
    # one without ic= has the difference of what .ic says of its nodes, 0 where it says nothing, as in ngspice: not what the
    # ic= of others comes to
    said = {name: float(value) for name, value, _ in ctx.flat.ics}
    for e in ctx.elements.values():
        if e.letter == "c" and "ic" not in e.params and not isinstance(e.value, Node):
            a, b = ("0" if n == "gnd" else n for n in e.nodes[:2])
            if a != b:
                levels.join(a, b, said.get(a, 0.0) - said.get(b, 0.0))
    for name in ctx.nodes:
        root, above = levels.find(name)
        if root == GROUND and (name in reached or above):
            given[name] = above
    return given


def _join(ctx: Context, levels: _Levels, says: tuple[str, str, float], who: str, span: Span | None) -> None:
    a, b, volts = says
    there = 0.0 if a == b else levels.join(a, b, volts)
    if there is not None and abs(there - volts) > SAME * max(abs(there), abs(volts)):
        ctx.remark(
            "W291",
            f"{who} with {volts:.6g} V, and what other lines say comes to {there:.6g} V there",
            span,
            "leave out one of them: ic= holds before .ic, and charge flows at once between capacitors that differ",
        )
