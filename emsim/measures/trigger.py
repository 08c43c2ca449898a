"""`trig ... targ ...`: from one event to another."""

from __future__ import annotations

from .base import Kind, Measured

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..diagnostics import Sink
    from .points import Points


class Trigger(Kind):
    words = ("trig", "targ")
    form = ".meas tran name trig v(a) val=0.5 rise=1 targ v(b) val=0.5 fall=1 (or trig at=0)"
    meaning = "from one event to another: where signals cross values, or given places"

    def read(self, sink: Sink) -> None:
        super().read(sink)
        for word, missing in (("trig", "begins"), ("targ", "ends")):
            same = [c for c in self.card.clauses if c.word == word]
            if len(same) != 1:
                said = (
                    f"`{word}` is missing: where it {missing}" if not same else f"`{word}` stands here twice"
                )
                self.wrong(sink, said)
        for c in self.card.clauses:
            if c.word not in ("trig", "targ"):
                self.wrong(sink, f"`{c.word}` does not go with `trig`", c.span)
            else:
                self.check_level(c, sink)

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        begin, end = (
            self.crossing(next(c for c in self.card.clauses if c.word == word), points, given)
            for word in ("trig", "targ")
        )
        return self.measured(points, end - begin, points.axis_unit, {"targ": end, "trig": begin})
