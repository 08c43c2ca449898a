"""What a measurement is: one class in one file of this folder, and its line in `KINDS` (measures/__init__.py).

The duties of an author: `words`, the clauses that the card begins with; `form` and `meaning` for people; `read`, what is wrong
with a card; `find`, its value. A measurement that finds nothing raises NotFound, which says why.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import isfinite

from ..deck import Clause
from ..diagnostics import Diagnostic
from ..expr import MEASURED, Call, Name, Node, Num, rewritten
from ..units import quotient

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import ClassVar

    from .._engine import Curve
    from ..deck import Measure as Card
    from ..diagnostics import Sink, Span
    from .points import Points


GOALS = ("goal", "minval", "weight")


class NotFound(Exception):
    """Why a measurement has no value."""

    def __init__(self, said: str, hint: str | None = None, span: Span | None = None) -> None:
        super().__init__(said)
        self.said, self.hint, self.span = said, hint, span


class Measured:
    """One measurement: `value` with its `unit`, nan where it found nothing, which `trouble` tells. `more` is what ngspice prints
    beside it: targ and trig, at, from and to. `step` counts the steps of a sweep from 0. `remark`: how it was read, if that needs
    a word."""

    __slots__ = ("analysis", "more", "name", "remark", "step", "trouble", "unit", "value")

    def __init__(
        self,
        name: str,
        analysis: str,
        value: float = float("nan"),
        unit: str = "",
        more: Mapping[str, float] | None = None,
        trouble: Diagnostic | None = None,
    ) -> None:
        self.name, self.analysis, self.value, self.unit = name, analysis, value, unit
        self.more, self.trouble, self.step = dict(more or {}), trouble, 0
        self.remark: Diagnostic | None = None

    def __repr__(self) -> str:
        return self.text()

    def text(self) -> str:
        """As ngspice -b prints it: `trise = 2.197225e-06 targ= 2.302585e-06 trig= 1.053605e-07`."""
        if self.trouble is not None:
            return f"{self.name:<20}= failed"
        words = [f"{self.name:<20}= {self.value: .6e}", *(f"{k}= {v: .6e}" for k, v in self.more.items())]
        return " ".join(words)

    def to_dict(self) -> dict[str, object]:
        found: dict[str, object] = {
            "name": self.name, "analysis": self.analysis, "value": self.value, "unit": self.unit, "step": self.step, **self.more
        }  # fmt: skip
        if self.trouble is not None:
            found["failed"] = self.trouble.message
        return found


class Kind(ABC):
    """A measurement, of a card."""

    words: ClassVar[tuple[str, ...]]  # clauses that tell it: the first one's word
    form: ClassVar[str]
    meaning: ClassVar[str]

    def __init__(self, card: Card) -> None:
        self.card = card

    @property
    def clause(self) -> Clause:
        return self.card.clauses[0]

    def other(self, word: str) -> Clause | None:
        return next((c for c in self.card.clauses[1:] if c.word == word), None)

    def read(self, sink: Sink) -> None:
        """What is wrong with the card, as far as it tells by itself."""
        for c in self.card.clauses:
            if c.body is None and not (c.word in ("trig", "targ") and "at" in c.values):
                self.wrong(sink, f"`{c.word}` does not say of which signal", c.span)

        goals = [word for word in GOALS if any(word in c.values for c in self.card.clauses)]
        if goals:
            said = f"`{goals[0]}=` of `{self.card.name}` has no effect: it is for optimisers"
            sink.note("N333", said, self.card.span)

    def wrong(self, sink: Sink, said: str, span: Span | None = None, hint: str | None = None) -> None:
        sink.error("E330", said, span or self.card.span, hint or f"form: {self.form}")

    @abstractmethod
    def find(self, points: Points, given: Mapping[str, Measured]) -> Measured: ...

    # ---- what the kinds have in common ----

    def measured(
        self, points: Points, value: float, unit: str, more: Mapping[str, float] | None = None
    ) -> Measured:
        if not isfinite(value):
            raise NotFound(f"what `{self.card.name}` measures has no value there")
        return Measured(self.card.name, points.analysis, value, unit, more)

    def curve(self, points: Points, node: Node, given: Mapping[str, Measured]) -> tuple[Curve, str]:
        return points.curve(with_measures(node, given), self.card.span)

    def number(
        self, node: Node, points: Points, given: Mapping[str, Measured], what: str = "a value"
    ) -> float:
        """The value of an expression of parameters and other measurements."""
        return points.number(with_measures(node, given), what, self.card.span)

    def window(self, c: Clause, points: Points, given: Mapping[str, Measured]) -> tuple[float, float]:
        """from and to of a clause, within the results."""
        begin, end = points.first, points.last
        if (start := c.values.get("from")) is not None:
            begin = max(begin, self.number(start, points, given, "`from`"))
        if (delay := c.values.get("td")) is not None:
            begin = max(begin, self.number(delay, points, given, "`td`"))
        if (stop := c.values.get("to")) is not None:
            end = min(end, self.number(stop, points, given, "`to`"))
        if begin > end:
            said = f"there is nothing between {points.place(begin)} and {points.place(end)}"
            raise NotFound(
                said, f"the results go from {points.place(points.first)} to {points.place(points.last)}"
            )
        return begin, end

    def crossing(self, c: Clause, points: Points, given: Mapping[str, Measured]) -> float:
        """Where a clause's signal crosses its level, the time that its rise, fall or cross asks for; or its `at`."""
        if (at := c.values.get("at")) is not None:
            place = self.number(at, points, given, "`at`")
            points.check(place)
            return place
        level = c.level if c.level is not None else c.values.get("val")
        assert c.body is not None and level is not None
        curve, _ = self.curve(points, c.body, given)
        other, _ = self.curve(points, level, given)
        begin, end = self.window(c, points, given)
        direction, count = self.counted(c, points, given)
        found = [(t, d) for t, d in curve.crossings(other, begin, end) if direction in (0, d)]
        if not found and abs(count) == 1 and (t := curve.touch(other, begin, end, direction)) is not None:
            return t
        if not found or count > len(found) or -count > len(found):
            raise NotFound(*self.no_crossing(c, level, curve, points, (begin, end), len(found), count))
        return found[count - 1 if count > 0 else count][0]

    def counted(self, c: Clause, points: Points, given: Mapping[str, Measured]) -> tuple[int, int]:
        """(1 rise, -1 fall, 0 cross; which of them: 1 the first, -1 the last)."""
        for word, direction in (("rise", 1), ("fall", -1), ("cross", 0)):
            node = c.values.get(word)
            if node is None:
                continue
            if isinstance(node, Name) and node.id == "last":
                return direction, -1
            count = self.number(node, points, given, f"`{word}`")
            if count != int(count) or count == 0:
                raise NotFound(
                    f"`{word}` counts crossings, it is {count:g}",
                    f"{word}=1 is the first, {word}=last the last",
                )
            return direction, int(count)
        return 0, 1

    def no_crossing(
        self, c: Clause, level: Node, curve: Curve, points: Points, window: tuple[float, float], there: int, asked: int
    ) -> tuple[str, str, Span]:  # fmt: skip
        way = next((w for w in ("rise", "fall") if w in c.values), "cross")
        verb = {"rise": "rises through", "fall": "falls through", "cross": "crosses"}[way]
        where = f"between {points.place(window[0])} and {points.place(window[1])}"
        part = curve.cut(*window)
        low, high = (part.extreme(s)[0] for s in (-1.0, 1.0))
        low, high = (0.0 if abs(v) < 1e-12 * (high - low) else v for v in (low, high))
        hint = f"`{c.body!r}` lies between {low:g} and {high:g} there"
        if there:
            times = "once" if there == 1 else f"{there} times"
            return f"`{c.body!r}` {verb} {level!r} {times}, not {abs(asked)} times, {where}", hint, c.span
        return f"`{c.body!r}` never {verb} {level!r} {where}", hint, c.span

    def check_level(self, c: Clause, sink: Sink) -> None:
        if "at" not in c.values and c.level is None and "val" not in c.values:
            self.wrong(sink, f"`{c.word}` does not say at which value", c.span)
        ways = [w for w in ("rise", "fall", "cross") if w in c.values]
        if len(ways) > 1:
            self.wrong(sink, f"`{c.word}` counts by {ways[0]} or by {ways[1]}, not by both", c.span)

    def check_window(self, c: Clause, sink: Sink) -> None:
        begin, end = (c.values.get(word) for word in ("from", "to"))
        if isinstance(begin, Num) and isinstance(end, Num) and begin.value > end.value:
            said = f"the window ends before it begins: from={begin.value:g} to={end.value:g}"
            sink.error("E331", said, c.span, f"from={end.value:g} to={begin.value:g}")

    def slope_unit(self, unit: str, points: Points) -> str:
        return quotient(unit, points.axis_unit)


def with_measures(node: Node, given: Mapping[str, Measured]) -> Node:
    """The expression with the values of other measurements. NotFound where one of them is not there."""

    def known(part: Node) -> Node | None:
        if not isinstance(part, Call) or part.fn != MEASURED:
            return None
        name = part.args[0].id  # type: ignore[attr-defined]
        other = given.get(name)
        if other is None:
            raise NotFound(
                f"`{name}` is measured further down", "write the card below those that it reads", part.span
            )
        if other.trouble is not None:
            raise NotFound(f"it reads `{name}`, which has no value", None, part.span)
        return Num(other.value, part.at)

    return rewritten(node, known)
