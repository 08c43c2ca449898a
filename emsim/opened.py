"""Values that come from outside while the deck runs: sliders of a page, inputs of an FMU. And numbers of cards among them.

A card computes with an open number as with any. In formulas it is an expression of the input, so that the equations hold for
every value. Where the card decides by it, it is the value at which the deck was read, and the decision is noted as a guard: the
sign of an expression, which must stay. Where a card takes it as a plain number, its names are lost: the equations would hold for
one value alone, and whoever opened it gives it up.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from ._engine import Expr


def hand_on(name: str) -> str:
    """The input by which a page's reader holds a body (0 or 1), or what is added to the control of a switch."""
    return f"hand on {name}"


class Opened(dict[str, float]):
    """Name -> value where nothing is said. `guards` (expression, its sign) and names that are `lost`: of its open numbers."""

    def __init__(self, values: dict[str, float]) -> None:
        super().__init__(values)
        self.guards: dict[int, tuple[Expr, int]] = {}
        self.lost: set[str] = set()


def as_read(value: Any) -> Any:
    """The number at which the deck was read: for pictures that are as good at another one."""
    return value.start if isinstance(value, OpenNumber) else value


class OpenNumber:
    """`start` is the value at which the deck was read, `names` are those of the inputs behind `expr`."""

    __slots__ = ("expr", "names", "noted", "start")

    def __init__(self, expr: Expr, start: float, names: frozenset[str], noted: Opened) -> None:
        self.expr, self.start, self.names, self.noted = expr, start, names, noted

    def _with(self, other: Any, of: Callable[[Any, Any], Any]) -> Any:
        if isinstance(other, OpenNumber):
            names = self.names | other.names
            return OpenNumber(of(self.expr, other.expr), of(self.start, other.start), names, self.noted)
        if isinstance(other, (int, float)):
            return OpenNumber(of(self.expr, other), of(self.start, other), self.names, self.noted)
        return of(self.expr, other)

    def __add__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a + b)

    def __sub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a - b)

    def __mul__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a * b)

    def __truediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a / b)

    def __pow__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: a**b)

    def __radd__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b + a)

    def __rsub__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b - a)

    def __rmul__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b * a)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(other, lambda a, b: b / a)

    @property
    def value(self) -> None:
        """Of a constant expression its number: this one is none."""

    def __neg__(self) -> OpenNumber:
        return OpenNumber(-self.expr, -self.start, self.names, self.noted)

    def __abs__(self) -> OpenNumber:
        return -self if self < 0.0 else self

    # decisions

    def _sign(self, other: Any = 0.0) -> int:
        """Of the difference, which is noted."""
        difference = self - other
        start = difference.start
        sign = (start > 0.0) - (start < 0.0)
        self.noted.guards[difference.expr.id] = (difference.expr, sign)
        return sign

    def __lt__(self, other: Any) -> bool:
        return self._sign(other) < 0

    def __le__(self, other: Any) -> bool:
        return self._sign(other) <= 0

    def __gt__(self, other: Any) -> bool:
        return self._sign(other) > 0

    def __ge__(self, other: Any) -> bool:
        return self._sign(other) >= 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, (int, float, OpenNumber)) and self._sign(other) == 0

    def __hash__(self) -> int:
        return hash(self.expr.id)

    def __bool__(self) -> bool:
        return self._sign() != 0

    # a plain number

    def __float__(self) -> float:
        self.noted.lost |= self.names
        return self.start

    def __int__(self) -> int:
        return int(float(self))

    def __round__(self) -> int:
        return round(float(self))

    def __format__(self, spec: str) -> str:
        return format(self.start, spec)

    def __repr__(self) -> str:
        return f"{self.start!r} ({', '.join(sorted(self.names))})"
