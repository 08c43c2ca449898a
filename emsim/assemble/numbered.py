"""A builder that notes which numbers of equation (1) hang on traced ones (traced.py): constants of F and Q, coefficients of sources,
and what waveforms are made of. All else that gets a traced number loses it."""

from __future__ import annotations

from ..traced import Trace, Traced, holds

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .._engine import Builder, System

    Numbers = list[tuple[int, int]]  # place, number of the traced value


class Numbered:
    """As Builder is. `f`, `q`, `sources` and `waves` (its number, kind, arguments, DC value) are what changes."""

    def __init__(self, builder: Builder, trace: Trace) -> None:
        self._builder, self._trace = builder, trace
        self.f: Numbers = []
        self.q: Numbers = []
        self.sources: Numbers = []
        self.waves: list[tuple[int, str, list[float], float | None]] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._builder, name)

        def called(*args: Any, **given: Any) -> Any:
            if holds(args) or holds(given):
                self._trace.lose(name)
            return method(*args, **given)

        setattr(self, name, called)  # (the next time it is found at once)
        return called

    def _constant(self, which: int, name: str, row: int, other: int, v: float) -> None:
        """One constant, unless ground is its row or its column."""
        if v.__class__ is not Traced:
            getattr(self._builder, name)(row, other, v)
            return
        place = self._builder.constants()[which]
        getattr(self._builder, name)(row, other, v)
        if self._builder.constants()[which] > place:
            (self.f, self.q, self.sources)[which].append((place, v.number))

    def g(self, row: int, col: int, v: float) -> None:
        self._constant(0, "g", row, col, v)

    def c(self, row: int, col: int, v: float) -> None:
        self._constant(1, "c", row, col, v)

    def f_wave(self, row: int, wave: int, coefficient: float) -> None:
        self._constant(2, "f_wave", row, wave, coefficient)

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
