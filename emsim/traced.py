"""Numbers that remember what they were computed from, so that the same is computed again for other values, to the last bit.

Arithmetic with a traced number is noted as a step. A comparison is one too, whose result has to stay: it decides over what comes
behind it. Where a traced number is taken as a plain one (a text, an integer, a key, an expression of the engine), `lost` says so:
what follows holds for one value alone.
"""

from __future__ import annotations

import operator
from math import isfinite

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, NoReturn

    # function, arguments, (place among the arguments, number of a value)
    Step = tuple[Callable[..., Any], tuple[Any, ...], list[tuple[int, int]]]


class Trace:
    """Steps in the order in which they were taken. `values`: of the first numbers, the roots, then of each step."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.steps: list[Step] = []
        self.guards: dict[int, bool] = {}  # number of a step -> its result, which has to stay
        self.lost: list[str] = []  # by what numbers were taken as plain ones

    def root(self, value: float) -> Traced:
        """One more number that changes. Before the first step."""
        assert not self.steps, "roots come before steps"
        self.values.append(float(value))
        return Traced(value, self, len(self.values) - 1)

    def apply(self, function: Callable[..., Any], args: Sequence[Any]) -> Traced:
        """A number from others."""
        return Traced(self._step(function, args), self, len(self.values) - 1)

    def decide(self, function: Callable[..., bool], *args: Any) -> bool:
        """What is decided by a number."""
        result = bool(self._step(function, args))
        self.guards[len(self.values) - 1] = result
        return result

    def _step(self, function: Callable[..., Any], args: Sequence[Any]) -> Any:
        places = [(i, a.number) for i, a in enumerate(args) if a.__class__ is Traced]
        plain = tuple(self.values[a.number] if a.__class__ is Traced else a for a in args)
        value = function(*plain)
        self.values.append(value if value.__class__ is bool else float(value))
        self.steps.append((function, plain, places))
        return value

    def lose(self, how: str) -> None:
        self.lost.append(how)

    def again(self, roots: Iterable[float]) -> list[Any] | None:
        """All values for other roots; None where something is decided otherwise, or has no finite value."""
        values: list[Any] = [*roots]
        first, guards = len(values), self.guards
        try:
            for function, plain, places in self.steps:
                args = list(plain)
                for i, number in places:
                    args[i] = values[number]
                value = function(*args)
                values.append(value if value.__class__ is bool else float(value))
        except (ArithmeticError, ValueError, TypeError):  # (a power of a negative number is complex)
            return None
        same = all(bool(values[k]) is result for k, result in guards.items())
        return values if same and all(map(isfinite, values[first:])) else None


class Traced(float):
    """A float for all who take it as one; see above."""

    __slots__ = ("number", "trace")
    number: int
    trace: Trace

    def __new__(cls, value: float, trace: Trace, number: int) -> Traced:
        made = float.__new__(cls, value)
        made.trace, made.number = trace, number
        return made

    @property
    def plain(self) -> float:
        return float(self.trace.values[self.number])

    @property
    def expr(self) -> NoReturn:
        # asked by the engine, before a number becomes part of an expression
        self.trace.lose("an expression")
        raise AttributeError("a number has no expression")

    def __bool__(self) -> bool:
        return self.trace.decide(operator.truth, self)

    def __deepcopy__(self, memo: object) -> Traced:
        return self


def _arithmetic(function: Callable[[Any, Any], Any], swapped: bool) -> Callable[[Traced, Any], Any]:
    def method(self: Traced, other: Any) -> Any:
        if not isinstance(other, (int, float)):
            return NotImplemented
        return self.trace.apply(function, (other, self) if swapped else (self, other))

    return method


def _comparison(function: Callable[[Any, Any], bool]) -> Callable[[Traced, Any], Any]:
    def method(self: Traced, other: Any) -> Any:
        if not isinstance(other, (int, float)):
            return NotImplemented
        return self.trace.decide(function, self, other)

    return method


def _one(function: Callable[[Any], Any]) -> Callable[[Traced], Traced]:
    return lambda self: self.trace.apply(function, (self,))


def _plain(name: str) -> Callable[..., Any]:
    of = getattr(float, name)

    def method(self: Traced, *args: Any) -> Any:
        self.trace.lose(name)
        return of(self.plain, *args)

    return method


for _name in ("add", "sub", "mul", "truediv", "pow", "mod", "floordiv"):
    setattr(Traced, f"__{_name}__", _arithmetic(getattr(operator, _name), False))
    setattr(Traced, f"__r{_name}__", _arithmetic(getattr(operator, _name), True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Traced, f"__{_name}__", _comparison(getattr(operator, _name)))
for _name in ("neg", "pos", "abs"):
    setattr(Traced, f"__{_name}__", _one(getattr(operator, _name)))
for _name in (
    "__float__", "__int__", "__round__", "__trunc__", "__floor__", "__ceil__", "__divmod__", "__rdivmod__", "__format__",
    "__str__", "__repr__", "__hash__", "is_integer", "as_integer_ratio", "hex", "conjugate", "__complex__",
):  # fmt: skip
    if hasattr(float, _name):
        setattr(Traced, _name, _plain(_name))


def number(value: Any) -> float:
    """As a float; a traced one stays one."""
    return value if isinstance(value, float) else float(value)


def applied(function: Callable[..., Any], args: Sequence[Any]) -> float:
    """A function of numbers, some of which may be traced; one with an attribute `traces` sees to that itself."""
    for a in args:
        if a.__class__ is Traced and not hasattr(function, "traces"):
            return a.trace.apply(function, args)
    return number(function(*args))


def holds(value: Any) -> bool:
    """Is it a traced number, or a list, a tuple or a dictionary with one in it?"""
    if value.__class__ is Traced:
        return True
    if isinstance(value, dict):
        return any(map(holds, value.values()))
    return isinstance(value, (list, tuple)) and any(map(holds, value))
