"""A builder that notes which numbers of equation (1) hang on traced ones (traced.py): constants of F and Q, coefficients of
sources, and what waveforms are made of. All else that gets a traced number loses it."""

from __future__ import annotations

from ..traced import Trace, Traced, holds
from .compiling import Compiling

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .._engine import Builder, System
    from ..elaborate.flat import FlatDeck
    from .context import Context

    Numbers = list[tuple[int, int]]  # place, number of the traced value


def context(trace: Trace) -> Callable[[Builder, FlatDeck, dict[str, Any]], Context]:
    """What `assemble` takes, with such a builder."""
    return lambda builder, flat, options: Compiling(Numbered(builder, trace), flat, options)  # type: ignore[arg-type]


class Numbered:
    """As Builder is. What changes: `numbers`, constants of F, of Q, of sources, and charges of a start with UIC, and `waves` (its
    number, kind, arguments, DC value)."""

    def __init__(self, builder: Builder, trace: Trace) -> None:
        self._builder, self._trace = builder, trace
        self.numbers: tuple[Numbers, ...] = ([], [], [], [])
        self.waves: list[tuple[int, str, list[float], float | None]] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._builder, name)

        def called(*args: Any, **given: Any) -> Any:
            if holds(args) or holds(given):
                self._trace.lose(name)
            return method(*args, **given)

        setattr(self, name, called)  # (the next time it is found at once)
        return called

    def _constant(self, which: int, put: Callable[..., None], *args: Any) -> None:
        """One constant, the last of the arguments, unless ground is its row or its column."""
        v = args[-1]
        if v.__class__ is not Traced:
            put(*args)
            return
        place = self._builder.constants()[which]
        put(*args)
        if self._builder.constants()[which] > place:
            self.numbers[which].append((place, v.number))

    def g(self, row: int, col: int, v: float) -> None:
        self._constant(0, self._builder.g, row, col, v)

    def c(self, row: int, col: int, v: float) -> None:
        self._constant(1, self._builder.c, row, col, v)

    def f_wave(self, row: int, wave: int, coefficient: float) -> None:
        self._constant(2, self._builder.f_wave, row, wave, coefficient)

    def ic_charge(self, row: int, dq: float) -> None:
        self._constant(3, self._builder.ic_charge, row, dq)

    def conductance(self, p: int, n: int, v: float) -> None:
        if v.__class__ is not Traced:
            self._builder.conductance(p, n, v)
            return
        for a, b in ((p, n), (n, p)):
            self.g(a, a, v)
            self.g(a, b, -v)

    def capacitance(self, p: int, n: int, v: float) -> None:
        if v.__class__ is not Traced:
            self._builder.capacitance(p, n, v)
            return
        for a, b in ((p, n), (n, p)):
            self.c(a, a, v)
            self.c(a, b, -v)

    def wave(self, kind: str, args: list[float], dc: float | None = None) -> int:
        k = self._builder.wave(kind, args, dc)
        if holds(args) or holds(dc):
            self.waves.append((k, kind, list(args), dc))
        return k

    def wave_at(self, kind: str, args: list[float], t: float) -> float:
        if kind == "dc":
            return args[0]
        if holds(args):
            self._trace.lose("wave_at")
        return self._builder.wave_at(kind, args, t)

    def compile(self) -> System:
        return self._builder.compile(True)
