"""`when v(a)=1`: where; `find v(b) when v(a)=1`, `find v(b) at=1m`: what is there; `deriv` of it."""

from __future__ import annotations

from .base import Kind, Measured, NotFound

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..diagnostics import Sink
    from .points import Points


class When(Kind):
    words = ("when",)
    form = ".meas tran name when v(a)=0.5 rise=2, .meas tran name when v(a)=v(b) cross=last"
    meaning = "the place where a signal crosses a value or another signal"

    def read(self, sink: Sink) -> None:
        super().read(sink)
        self.check_level(self.clause, sink)
        self.check_window(self.clause, sink)
        for c in self.card.clauses[1:]:
            self.wrong(
                sink,
                f"`{c.word}` does not go with `when`; what is found there stands first: find ... when ...",
                c.span,
            )

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        return self.measured(points, self.crossing(self.clause, points, given), points.axis_unit)


class Find(Kind):
    words = ("find",)
    form = ".meas tran name find v(b) when v(a)=0.5 rise=1, .meas tran name find v(b) at=1m"
    meaning = "the value of a signal at a place, or where another one crosses a value"

    def read(self, sink: Sink) -> None:
        super().read(sink)
        when = self.other("when")
        if when is not None:
            # from, to and td may stand on either side
            for word in ("from", "to", "td", "rise", "fall", "cross"):
                if word in self.clause.values:
                    when.values.setdefault(word, self.clause.values[word])
            self.check_level(when, sink)
            self.check_window(when, sink)
        elif "at" not in self.clause.values and self.card.analysis not in ("op", "tf"):
            self.wrong(sink, f"`{self.clause.word}` does not say where: at=, or when ...", self.clause.span)
        for c in self.card.clauses[1:]:
            if c is not when:
                self.wrong(sink, f"`{c.word}` does not go with `{self.clause.word}`", c.span)

    def place(self, points: Points, given: Mapping[str, Measured]) -> float:
        when = self.other("when")
        if when is None and "at" not in self.clause.values:
            return 0.0
        return self.crossing(when or self.clause, points, given)

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        assert self.clause.body is not None
        place = self.place(points, given)
        curve, unit = self.curve(points, self.clause.body, given)
        more = {"at": place} if self.other("when") is not None else {}
        return self.measured(points, curve.value(place), unit, more)


class Deriv(Find):
    words = ("deriv",)
    form = ".meas tran name deriv v(b) at=1m, .meas tran name deriv v(b) when v(a)=0.5 rise=1"
    meaning = "the slope of a signal at a place, or where another one crosses a value"

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        assert self.clause.body is not None
        if not points.axis_name:
            raise NotFound("one point has no slope")
        place = self.place(points, given)
        curve, unit = self.curve(points, self.clause.body, given)
        more = {"at": place} if self.other("when") is not None else {}
        return self.measured(points, curve.slope(place), self.slope_unit(unit, points), more)
