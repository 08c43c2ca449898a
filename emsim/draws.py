"""Random values of a deck: gauss, agauss, unif, aunif, limit (ngspice's), mc, flat (LTspice's).

A run draws each once, from the seed that `.options seed=` or `--seed` gives, 1 otherwise: the same deck gives the same values.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

SEED = 1

# name -> (least and most arguments, value); limit(x,lo,hi) is no random value
RANDOM: dict[str, tuple[int, int, Callable[..., float]]] = {
    "gauss": (1, 3, lambda r, nominal, spread=None, sigmas=1.0: (
        nominal * r.gauss(0.0, 1.0) if spread is None else nominal * (1.0 + spread / sigmas * r.gauss(0.0, 1.0)))),
    "agauss": (3, 3, lambda r, nominal, spread, sigmas: nominal + spread / sigmas * r.gauss(0.0, 1.0)),
    "unif": (2, 2, lambda r, nominal, spread: nominal * (1.0 + spread * r.uniform(-1.0, 1.0))),
    "aunif": (2, 2, lambda r, nominal, spread: nominal + spread * r.uniform(-1.0, 1.0)),
    "limit": (2, 2, lambda r, nominal, spread: nominal + (spread if r.random() > 0.5 else -spread)),
    "mc": (2, 2, lambda r, nominal, spread: nominal * (1.0 + spread * r.uniform(-1.0, 1.0))),
    "flat": (1, 1, lambda r, spread: spread * r.uniform(-1.0, 1.0)),
}  # fmt: skip


def is_random(function: str, arguments: int) -> bool:
    return function in RANDOM and not (function == "limit" and arguments == 3)


class Draws:
    """The random values of one reading of a deck, in the order in which they are asked for."""

    __slots__ = ("_random", "count", "seed")

    def __init__(self, seed: int = SEED) -> None:
        self.seed, self.count = seed, 0
        self._random: Random | None = None

    def of(self, function: str) -> Callable[..., float]:
        """What draws a value from its arguments. It raises ZeroDivisionError for 0 sigmas."""

        def draw(*arguments: float) -> float:
            if self._random is None:
                from random import Random

                self._random = Random(self.seed)
            self.count += 1
            return float(RANDOM[function][2](self._random, *arguments))

        return draw
