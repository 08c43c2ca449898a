"""`param='a/b'`: an expression of other measurements and of parameters."""

from __future__ import annotations

from .base import Kind, Measured, with_measures

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..diagnostics import Sink
    from .points import Points


class Param(Kind):
    words = ("param",)
    form = ".meas tran name param='other1/other2'"
    meaning = "an expression of other measurements and of parameters"

    def read(self, sink: Sink) -> None:
        super().read(sink)
        for c in self.card.clauses[1:]:
            self.wrong(sink, f"`{c.word}` does not go with `param`", c.span)
        if self.clause.level is not None:
            self.wrong(sink, "`param` takes one expression", self.clause.span)

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        assert self.clause.body is not None
        from ..columns import unit_of_values

        units = {name: m.unit for name, m in given.items()}
        unit = unit_of_values(self.clause.body, units)
        node = with_measures(self.clause.body, given)
        return self.measured(points, points.number(node, "`param`", self.card.span), unit)
