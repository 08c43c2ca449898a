"""Statistics of a signal over a part of the axis: avg, rms, min, max, pp, integ, min_at, max_at.

The part is `from` .. `to`, or from one event to another, as LTspice has it: `avg v(a) trig v(b)=1 rise=1 targ v(b)=1 rise=2`.
"""

from __future__ import annotations

from abc import abstractmethod
from math import sqrt

from ..units import product
from .base import Kind, Measured, NotFound

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from .._engine import Curve
    from ..diagnostics import Sink
    from .points import Points


class Statistic(Kind):
    def read(self, sink: Sink) -> None:
        super().read(sink)
        self.check_window(self.clause, sink)
        for c in self.card.clauses[1:]:
            if c.word in ("trig", "targ"):
                self.check_level(c, sink)
            else:
                self.wrong(sink, f"`{c.word}` does not go with `{self.clause.word}`", c.span)

    def part(self, points: Points, given: Mapping[str, Measured]) -> tuple[float, float]:
        begin, end = self.window(self.clause, points, given)
        if (trig := self.other("trig")) is not None:
            begin = self.crossing(trig, points, given)
        if (targ := self.other("targ")) is not None:
            end = self.crossing(targ, points, given)
        if begin > end:
            raise NotFound(f"the part ends at {points.place(end)}, before it begins at {points.place(begin)}")
        return begin, end

    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured:
        assert self.clause.body is not None
        begin, end = self.part(points, given)
        curve, unit = self.curve(points, self.clause.body, given)
        if not points.axis_name:
            return self.of(points, curve, unit, begin, begin)
        return self.of(points, curve.cut(begin, end), unit, begin, end)

    @abstractmethod
    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        """Of the part of the signal."""

    def over(self, points: Points, value: float, unit: str, begin: float, end: float) -> Measured:
        return self.measured(points, value, unit, {"from": begin, "to": end})


class Average(Statistic):
    words = ("avg",)
    form = ".meas tran name avg v(a) from=0 to=1m"
    meaning = "the mean value: integral over length"

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        mean = part.integral() / (end - begin) if end > begin else part.start
        return self.over(points, mean, unit, begin, end)


class Rms(Statistic):
    words = ("rms",)
    form = ".meas tran name rms v(a) from=0 to=1m"
    meaning = "the root of the mean square"

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        square = part.integral(2) / (end - begin) if end > begin else part.start**2
        return self.over(points, sqrt(max(square, 0.0)), unit, begin, end)


class Integral(Statistic):
    words = ("integ",)
    form = ".meas tran name integ v(a) from=0 to=1m"
    meaning = "the integral along the axis"

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        return self.over(points, part.integral(), product(unit, points.axis_unit), begin, end)


class PeakToPeak(Statistic):
    words = ("pp",)
    form = ".meas tran name pp v(a) from=0 to=1m"
    meaning = "from the smallest to the largest value"

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        return self.over(points, part.extreme(1.0)[0] - part.extreme(-1.0)[0], unit, begin, end)


class Extreme(Statistic):
    sign = 1.0

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        value, at = part.extreme(self.sign)
        return self.measured(points, value, unit, {"at": at})


class Maximum(Extreme):
    words = ("max",)
    form = ".meas tran name max v(a) from=0 to=1m"
    meaning = "the largest value, and where it is"


class Minimum(Extreme):
    words = ("min",)
    form = ".meas tran name min v(a) from=0 to=1m"
    meaning = "the smallest value, and where it is"
    sign = -1.0


class PlaceOfMaximum(Statistic):
    words = ("max_at",)
    form = ".meas tran name max_at v(a) from=0 to=1m"
    meaning = "where the largest value is"
    sign = 1.0

    def of(self, points: Points, part: Curve, unit: str, begin: float, end: float) -> Measured:
        value, at = part.extreme(self.sign)
        return self.measured(points, at, points.axis_unit, {"with": value})


class PlaceOfMinimum(PlaceOfMaximum):
    words = ("min_at",)
    form = ".meas tran name min_at v(a) from=0 to=1m"
    meaning = "where the smallest value is"
    sign = -1.0


KINDS = (Average, Rms, Minimum, Maximum, PeakToPeak, Integral, PlaceOfMinimum, PlaceOfMaximum)
