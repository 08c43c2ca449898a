"""What is looked for: a quantity of the deck (elaborate/quantity.py) with bounds and a start.

    r                  from the deck's value on; a value above zero stays above zero
    r=100..10k         between bounds, from the deck's value on, or from their middle where that lies outside
    r=100..10k:2k      from 2k on

Above zero it is the logarithm that is looked for: one per cent is one per cent, and units do not matter. Else it is the value, in
parts of its size.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


class Quantity(NamedTuple):
    name: str
    low: float
    high: float
    start: float | None = None

    def begun(self, value: float) -> Quantity:
        """With a start, from the deck's value where none was given."""
        start = value if self.start is None else self.start
        if not self.low <= start <= self.high:
            both = self.low > 0.0 and math.isfinite(self.high)
            start = math.sqrt(self.low * self.high) if both else 0.5 * (self.low + self.high)
            if not math.isfinite(start):
                start = self.low if math.isfinite(self.low) else self.high
        return self._replace(start=start)

    @property
    def first(self) -> float:
        assert self.start is not None
        return self.start

    @property
    def by_ratio(self) -> bool:
        """Is it looked for by its logarithm?"""
        return self.first > 0.0 and (self.low > 0.0 or self.low == -math.inf)

    @property
    def size(self) -> float:
        spread = self.high - self.low
        return abs(self.first) or (spread if math.isfinite(spread) else 1.0)

    def inner(self, value: float) -> float:
        if self.by_ratio:
            return math.log(value) if value > 0.0 else -math.inf
        return value / self.size

    def outer(self, place: float) -> float:
        value = math.exp(min(place, 700.0)) if self.by_ratio else place * self.size
        return min(max(value, self.low), self.high)

    def slope(self, value: float) -> float:
        """Change of the value with its place."""
        return value if self.by_ratio else self.size


def read(vary: Mapping[str, object] | Sequence[str] | str) -> list[Quantity]:
    """From texts, or from a mapping of names to None, a start, (low, high) or (low, high, start). Raises ValueError with
    a sentence."""
    if hasattr(vary, "items"):
        found = [_given(str(name).lower(), what) for name, what in vary.items()]
    else:
        found = [_parsed(text) for text in ((vary,) if isinstance(vary, str) else vary)]
    names = [q.name for q in found]
    if not names:
        raise ValueError("nothing is to be found: name a parameter or an element")
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"`{twice}` is given twice")
    for q in found:
        if not q.low < q.high:
            raise ValueError(f"{q.name}: the lower bound {q.low:g} is not below {q.high:g}")
        if q.start is not None and not q.low <= q.start <= q.high:
            raise ValueError(f"{q.name}: the start {q.start:g} is not between {q.low:g} and {q.high:g}")
    return found


def _given(name: str, what: object) -> Quantity:
    if isinstance(what, Quantity):
        return what
    if what is None:
        return Quantity(name, -math.inf, math.inf)
    if isinstance(what, str):
        return _parsed(f"{name}={what}")
    if isinstance(what, (int, float)):
        return Quantity(name, -math.inf, math.inf, float(what))
    numbers = [float(v) for v in what]  # type: ignore[attr-defined]
    if len(numbers) not in (2, 3):
        raise ValueError(f"{name}: give (low, high) or (low, high, start)")
    return Quantity(name, numbers[0], numbers[1], numbers[2] if numbers[2:] else None)


def _parsed(text: str) -> Quantity:
    name, equals, rest = text.partition("=")
    name = name.strip().lower()
    if not name or (equals and not rest.strip()):
        raise ValueError(f"{text}: write name, name=low..high or name=low..high:start")
    if not equals:
        return Quantity(name, -math.inf, math.inf)
    bounds, colon, start = rest.partition(":")
    first = _number(start, text) if colon else None
    if ".." not in bounds:
        if colon:
            raise ValueError(f"{text}: write name=low..high:start")
        return Quantity(name, -math.inf, math.inf, _number(bounds, text))
    low, _, high = bounds.partition("..")
    return Quantity(name, _number(low, text), _number(high, text), first)


def _number(text: str, whole: str) -> float:
    value = spice_number(text.strip())
    if value is None:
        raise ValueError(f"{whole}: `{text.strip()}` is not a number")
    return float(value)
