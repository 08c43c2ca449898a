"""What the drawing of a circuit shows of a run: voltages of nodes and currents into terminals, as columns beside the table's own.

A current is a list of terms [factor, column, 1 where its rate is meant]: of resistors and capacitors of one value it follows from
voltages; of anything else it is a column. Where only a source of 0 V tells it (diodes, transistors), such sources are put in
while the circuit is drawn, as `.print @q1[ic]` does.

    {"volts": {node: column}, "currents": {part: [terms by terminal]}, "uses": {use: {node: terms}}, "channels": [..]}
"""

from __future__ import annotations

from ..expr import Call, Name
from .outputs import Output

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Collection
    from typing import Any

    from .._engine import Expr
    from ..elements import Element
    from .context import Context

    Terms = list[tuple[float, str, int]]

GROUND = ("0", "gnd")
TELL = "rlviewbfghsdqmjzn"  # letters of elements whose currents are expressions of their own


class Flows:
    """Columns of a drawing; made while the deck's expressions are."""

    def __init__(self, ctx: Context, swept: Collection[str] = ()) -> None:
        """`swept`: elements whose value an analysis changes."""
        self.ctx, self.swept = ctx, swept
        self.channels: list[Output] = []
        self.volts = {
            name: self._column(f"v({name})", "V", ctx.b.x(index)) for name, index in ctx.nodes.items()
        }
        self.currents: dict[str, list[Terms]] = {e.name: self._element(e) for e in ctx.elements.values()}
        for card in ctx.machine.active if ctx.machine is not None else ():
            if any(kind == "node" for _, kind, _ in card.terminals):
                self.currents[card.name] = self._card(card)

    def _column(self, name: str, unit: str, value: Expr) -> str:
        self.channels.append(Output(name, unit, value))
        return name

    def _element(self, e: Element) -> list[Terms]:
        ctx, count = self.ctx, len(e.nodes)
        value = e.value if isinstance(e.value, (int, float)) else None
        plain = value is not None and not e.params and e.model is None and e.name not in self.swept
        if e.letter == "r" and plain and value:
            return self._between(e, 1.0 / value, 0)
        if e.letter == "c":
            return self._between(e, value, 1) if plain and value is not None else []
        if e.name in ctx.series and ctx.branch(e.name) is None:
            p, inner, gs = ctx.series[e.name]
            drop = ctx.b.x(p) - ctx.b.x(inner) if p >= 0 else -ctx.b.x(inner)
            name = self._column(f"i({e.name})", "A", gs * drop)
            return [[(1.0, name, 0)], [(-1.0, name, 0)]]
        if e.letter not in TELL or not e.paths() or (e.is_metered and ctx.branch(e.name) is None):
            return []
        found: list[Terms] = []
        names = getattr(e, "currents", ()) or ()
        for k in range(min(count, 2 if not names else count)):
            if k == 1 and not names:
                found.append([(-factor, column, rate) for factor, column, rate in found[0]])
                continue
            name = f"@{e.name}[{names[k]}]" if k < len(names) else f"i({e.name})"
            found.append([(1.0, self._column(name, "A", e.current(ctx, k)), 0)])
        return found

    def _between(self, e: Element, factor: float, rate: int) -> list[Terms]:
        ends = [
            (sign * factor, node, rate)
            for sign, node in zip((1.0, -1.0), e.nodes, strict=False)
            if node not in GROUND
        ]
        terms: Terms = [(g, self.volts[node], rate) for g, node, rate in ends]
        return [terms, [(-g, column, rate) for g, column, rate in terms]]

    def _card(self, card: Any) -> list[Terms]:
        ctx, s = self.ctx, self.ctx.machine
        own = card.node_currents(s)
        if own is not None:
            words = [label for label, kind, _ in card.terminals if kind == "node"]
            return [
                [(1.0, self._column(f"i({card.name}.{w})", "A", s.public(i)), 0)]
                for w, i in zip(words, own, strict=True)
            ]
        if ctx.branch(card.name) is None or sum(kind == "node" for _, kind, _ in card.terminals) != 2:
            return []
        value = ctx.compile(Call("i", [Name(card.name)]), card.span)
        terms: Terms = [(1.0, self._column(f"i({card.name})", "A", value), 0)]
        return [terms, [(-1.0, column, 0) for _, column, _ in terms]]

    def data(self) -> dict[str, Any]:
        return {
            "volts": self.volts, "currents": self.currents, "uses": self._uses(),
            "channels": [{"name": c.name, "unit": c.unit} for c in self.channels],
        }  # fmt: skip

    def _uses(self) -> dict[str, dict[str, Terms]]:
        """What flows into a subcircuit from each node: what all that is inside takes there."""
        flat = self.ctx.flat
        found: dict[str, dict[str, Terms]] = {}
        for name, _, ports in flat.uses:
            own: dict[str, Terms] = {node: [] for node in ports.values()}
            for e in flat.elements:
                if not e.name.startswith(name + "."):
                    continue
                for node, terms in zip(e.nodes, self.currents.get(e.name, ()), strict=False):
                    if not node.startswith(name + "."):  # a terminal, or a .global node
                        own.setdefault(node, []).extend(terms)
            found[name] = own
        return found
