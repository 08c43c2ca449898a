"""Which runs a sweep has, and where in their distributions the deck's random values lie in each.

A deck draws n values, in a fixed order (draws.py). A scheme gives each run n places between 0 and 1:

    Nominal          none: the deck's own seed draws
    MonteCarlo       independent; run k of seed s is the k-th stream of numpy's PCG64 spawned from s
    LatinHypercube   each value once in each of N equal slices (McKay, Beckman and Conover 1979)
    Sobol            a scrambled sequence of low discrepancy (Owen's scrambling)
    Corners          all at their least or greatest, 2^n runs
    OneAtATime       all at their centre, then each at its least and its greatest, 2 n + 1 runs
    Indices          two Sobol' samples A and B of N, and A with one column of B, N (n + 2) runs: what Sobol's indices are
                     estimated from (Saltelli and others 2010)
"""

from __future__ import annotations

from itertools import product

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import ClassVar

    from .axes import Axis

MOST_CORNERS = 16  # random values of which all corners are run

Places = tuple[float, ...]


class Scheme:
    name: ClassVar[str] = ""
    is_random: ClassVar[bool] = True  # its runs follow from a seed

    def __init__(self, runs: int = 1, seed: int = 1) -> None:
        self.runs, self.seed = runs, seed

    def count(self, draws: int) -> int:
        """Runs of a deck that draws so many values."""
        return self.runs

    def places(self, draws: int) -> list[Places]:
        """One for each run. Raises ValueError with a sentence."""
        raise NotImplementedError

    def label(self) -> str:
        return f"{self.name} {self.runs}, seed {self.seed}"

    def tag(self, places: Places, names: Sequence[str]) -> str:
        """Which run one is, in words, where it has a name."""
        return ""


class Nominal(Scheme):
    name = "nominal"
    is_random = False

    def places(self, draws: int) -> list[Places]:
        return [()]

    def label(self) -> str:
        return "grid"


class MonteCarlo(Scheme):
    name = "mc"

    def places(self, draws: int) -> list[Places]:
        from numpy.random import PCG64, Generator, SeedSequence

        streams = SeedSequence(self.seed).spawn(self.runs)
        return [tuple(_open(Generator(PCG64(stream)).random(draws).tolist())) for stream in streams]


class LatinHypercube(Scheme):
    name = "lhs"

    def places(self, draws: int) -> list[Places]:
        from scipy.stats import qmc

        if not draws:
            return [()] * self.runs
        found = qmc.LatinHypercube(draws, rng=self.seed).random(self.runs)
        return [tuple(_open(row)) for row in found.tolist()]


class Sobol(Scheme):
    name = "sobol"

    def places(self, draws: int) -> list[Places]:
        from scipy.stats import qmc

        if not draws:
            return [()] * self.runs
        power = max(0, (self.runs - 1).bit_length())  # balanced are powers of 2 only: the rest is left
        found = qmc.Sobol(draws, rng=self.seed).random_base2(power)[: self.runs]
        return [tuple(_open(row)) for row in found.tolist()]


class Corners(Scheme):
    name = "corners"
    is_random = False

    def count(self, draws: int) -> int:
        return 2**draws

    def places(self, draws: int) -> list[Places]:
        if draws > MOST_CORNERS:
            said = f"{draws} random values have 2^{draws} corners"
            raise ValueError(f"{said}: --sensitivity runs {2 * draws + 1}, --mc N any number")
        return list(product((0.0, 1.0), repeat=draws))

    def label(self) -> str:
        return "corners"

    def tag(self, places: Places, names: Sequence[str]) -> str:
        return " ".join(f"{name}{'+' if u else '-'}" for name, u in zip(names, places, strict=True))


class OneAtATime(Scheme):
    name = "sensitivity"
    is_random = False

    def count(self, draws: int) -> int:
        return 2 * draws + 1

    def places(self, draws: int) -> list[Places]:
        centre = (0.5,) * draws
        ends = ((*centre[:k], end, *centre[k + 1 :]) for k in range(draws) for end in (0.0, 1.0))
        return [centre, *ends]

    def label(self) -> str:
        return "one at a time"

    def tag(self, places: Places, names: Sequence[str]) -> str:
        moved = (f"{name}{'+' if u else '-'}" for name, u in zip(names, places, strict=True) if u != 0.5)
        return next(moved, "nominal")


class Indices(Scheme):
    name = "indices"

    def count(self, draws: int) -> int:
        return self.runs * (draws + 2)

    def places(self, draws: int) -> list[Places]:
        from scipy.stats import qmc

        if self.runs & (self.runs - 1) or self.runs < 2:
            raise ValueError(f"{self.runs} runs: the samples of Sobol' indices are balanced at powers of 2")
        both = qmc.Sobol(2 * draws, rng=self.seed).random_base2(self.runs.bit_length() - 1)
        a, b = both[:, :draws], both[:, draws:]
        found = [a, b]
        for k in range(draws):
            found.append(a.copy())
            found[-1][:, k] = b[:, k]
        return [tuple(_open(row)) for part in found for row in part.tolist()]


SCHEMES: dict[str, type[Scheme]] = {
    kind.name: kind for kind in (Nominal, MonteCarlo, LatinHypercube, Sobol, Corners, OneAtATime, Indices)
}


def _open(places: list[float]) -> list[float]:
    """Places inside the distribution: its ends are corners."""
    return [min(max(u, 2.0**-54), 1.0 - 2.0**-53) for u in places]


def grid(axes: list[Axis]) -> Iterator[tuple[float, ...]]:
    """All combinations, the last axis fastest."""
    return product(*(axis.values for axis in axes))
