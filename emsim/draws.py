"""Random values of a deck: gauss, agauss, unif, aunif, limit (ngspice's), mc, flat (LTspice's).

A run draws each once, from the seed that `.options seed=` or `--seed` gives, 1 otherwise: the same deck gives the same values.
Each draw is a place u between 0 and 1 in its distribution, so a sweep may choose the places itself (sweeps/samples.py).
"""

from __future__ import annotations

from .traced import applied

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

SEED = 1
# a normal distribution of one number has no bounds of its own: corners are taken at so many sigmas
SIGMAS = 3.0

# name -> (least and most arguments, (centre, greatest deviation, sigmas in that or the distribution's name))
Spread = tuple[float, float, "float | str"]
RANDOM: dict[str, tuple[int, int, Callable[..., Spread]]] = {
    "gauss": (1, 3, lambda nominal, spread=None, sigmas=SIGMAS: (
        (0.0, SIGMAS * nominal, SIGMAS) if spread is None else (nominal, nominal * spread, sigmas))),
    "agauss": (3, 3, lambda nominal, spread, sigmas: (nominal, spread, sigmas)),
    "unif": (2, 2, lambda nominal, spread: (nominal, nominal * spread, "even")),
    "aunif": (2, 2, lambda nominal, spread: (nominal, spread, "even")),
    "limit": (2, 2, lambda nominal, spread: (nominal, spread, "ends")),
    "mc": (2, 2, lambda nominal, spread: (nominal, nominal * spread, "even")),
    "flat": (1, 1, lambda spread: (0.0, spread, "even")),
}  # fmt: skip


def is_random(function: str, arguments: int) -> bool:
    """limit(x,lo,hi) is no random value."""
    return function in RANDOM and not (function == "limit" and arguments == 3)


class Tolerance:
    """A draw that no call asks for: `tol=` of a card."""

    __slots__ = ("span", "text")

    def __init__(self, text: str, span: Any) -> None:
        self.text, self.span = text, span

    def __str__(self) -> str:
        return self.text


class Draws:
    """The random values of one reading of a deck, in the order in which they are asked for.

    tolerances  are those of cards drawn too (tol=5%)? In a run of its own a part has the value on its card
    places   where in its distribution each draw lies, 0 to 1; 0 and 1 are the centre -+ its greatest deviation. Draws beyond
             them come from the seed
    """

    __slots__ = ("_numbers", "asked", "drawn", "places", "seed", "tolerances")

    def __init__(self, seed: int = SEED, places: Sequence[float] = (), tolerances: bool = False) -> None:
        self.seed, self.places, self.tolerances = seed, places, tolerances
        self._numbers: Callable[[], float] | None = None
        self.asked: list[Any] = []  # the calls, in order
        self.drawn: list[float] = []  # their values; of a tolerance what multiplies the part's

    def of(self, call: Any) -> Callable[..., float]:
        """What draws a value from the arguments of a call in an expression. It raises ZeroDivisionError for 0 sigmas."""
        function: str = call.fn

        def draw(*arguments: float) -> float:
            return self._draw(call, *RANDOM[function][2](*arguments))

        draw.traces = True  # type: ignore[attr-defined]
        return draw

    def tolerance(self, name: str, share: float, span: Any) -> float:
        """What a card's value is multiplied by: evenly between 1 - share and 1 + share."""
        if not self.tolerances:
            return 1.0
        return self._draw(Tolerance(f"{name} tol={100 * share:g}%", span), 1.0, share, "even")

    def _draw(self, call: Any, *spread: Any) -> float:
        self.drawn.append(applied(at, (self._place(), *spread)))
        self.asked.append(call)
        return self.drawn[-1]

    def labels(self) -> list[str]:
        """What was drawn, in words."""
        return [f"{call} line {call.span.line}" if call.span else str(call) for call in self.asked]

    def _place(self) -> float:
        if len(self.drawn) < len(self.places):
            return self.places[len(self.drawn)]
        if self._numbers is None:
            from random import Random

            self._numbers = Random(self.seed).random
        return self._numbers()


def at(place: float, centre: float, deviation: float, kind: float | str) -> float:
    """The value at a place of a distribution."""
    if place <= 0.0 or place >= 1.0:
        return centre + (deviation if place >= 1.0 else -deviation)
    if kind == "ends":
        return centre + (deviation if place > 0.5 else -deviation)
    if isinstance(kind, str):
        return centre + deviation * (2.0 * place - 1.0)
    from statistics import NormalDist

    return centre + deviation / kind * NormalDist().inv_cdf(place)


def seeded(seed: object) -> Draws | None:
    """Draws of a seed that was given from outside; None where none was, or it is no number (options.py says so)."""
    good = isinstance(seed, (int, float)) and 0 <= seed < 1e18
    return Draws(int(seed)) if good else None  # type: ignore[call-overload]
