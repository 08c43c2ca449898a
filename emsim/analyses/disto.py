"""`.disto dec|oct|lin n fstart fstop [f2overf1] [static]`: distortion of small signals, by Volterra series.

With sources of amplitudes X e^(j w1 t) (distof1) and Y e^(j w2 t) (distof2) as in ngspice, x = x0 + Re(sum of phasors), and
F and Q developed about the operating point to third order (Wambacq and Sansen, Distortion Analysis of Analog Integrated Circuits,
1998), each phasor of frequency w solves (G + j w C) Z = -(F-part + j w Q-part), the same of both:

    2 f1        1/4 D2[X, X]                                f1 + f2     1/2 D2[X, Y]            f1 - f2     1/2 D2[X, Y*]
    3 f1        1/2 D2[X, Z(2 f1)] + 1/24 D3[X, X, X]
    2 f1 - f2   1/2 D2[Z(2 f1), Y*] + 1/2 D2[X, Z(f1 - f2)] + 1/8 D3[X, X, Y*]                              (1)

X and Y the responses of first order. D2 and D3 are taken along directions, as differences of the exact G and C of seven points;
of sixth order, so that they are known to about 1e-8. Two tables without f2overf1, three with it, over f1; f2 is f2overf1 times
fstart.
"""

from __future__ import annotations

import cmath
import math

from .ac import OverFrequencies, grid, linearised, without_delays
from .base import Computed, Run, recorded, wrong

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar, Self

    import numpy as np

    from .._engine import SmallSignal, System
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Sink
    from .base import Progress
    from .points import Points

HARMONICS = ("2nd harmonic", "3rd harmonic")
MIXED = ("IM: f1+f2", "IM: f1-f2", "IM: 2f1-f2")
KINDS = {
    name: f"{short} disto"
    for name, short in zip((*HARMONICS, *MIXED), ("2f1", "3f1", "f1+f2", "f1-f2", "2f1-f2"), strict=True)
}
STEP = 1e-3  # of a direction, of its largest voltage [V]: small beside what a junction takes for e times its current
# weights of values at -3 .. 3 steps: first and second derivatives of sixth order
FIRST = (-1 / 60, 3 / 20, -3 / 4, 0.0, 3 / 4, -3 / 20, 1 / 60)
SECOND = (1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90)
SAME = 1e-6  # of the largest: matrices that differ by more are of other conditions


class Disto(OverFrequencies):
    word = "disto"
    asks_as = "ac"
    form = ".disto dec|oct|lin points fstart fstop [f2overf1]"
    meaning = "harmonics and mixed frequencies of small signals; sources with distof1, distof2"
    plotname = "DISTORTION - 2nd harmonic"
    names_itself = True
    tables: ClassVar[tuple[str, ...]] = tuple(KINDS.values())
    complex = True

    def __init__(self, card: Card, frequencies: Points, ratio: float | None) -> None:
        super().__init__(card, frequencies)
        self.ratio = ratio

    @property
    def second(self) -> float | None:
        """f2 [Hz], which stays where it is, as in ngspice."""
        return None if self.ratio is None else self.ratio * self.frequencies[0]

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        args = [a for a in card.args if a != "static"]
        ratio = float(args.pop()) if [isinstance(a, str) for a in args] == [True, *[False] * 4] else None
        if ratio is not None and not 0.0 < ratio < 1.0:
            wrong(cls, card, sink, f"f2overf1 is {ratio:g}, it must lie between 0 and 1")
            return None
        found = grid(cls, card, sink, args)
        return None if found is None else cls(card, found, ratio)

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import columns

        without_delays(self, ctx)
        for key in ("distof1", "distof2") if self.ratio is not None else ("distof1",):
            if not driven(ctx, key):
                ctx.sink.warning(
                    "W305", f"no source has {key}: the distortion of .disto is 0", self.card.span,
                    hint=f"give the one that excites the circuit an amplitude: V1 in 0 dc 0 {key} 1",
                )  # fmt: skip
        return columns(ctx, "", "", whole=False)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        from .modes import slopes

        names, units, exprs = recorded(assembly, self)
        kinds = HARMONICS if self.ratio is None else MIXED
        linear, trouble = linearised(assembly, self, self.static)
        found: dict[str, list[np.ndarray]] = {kind: [] for kind in kinds}
        terms: list[list[tuple[int, float]]] = [[] for _ in exprs]
        if linear is not None:
            series = Series(assembly, linear)
            if not series.fits():
                from ..diagnostics import Diagnostic

                said = ".disto does not know slopes across conditions: switches, thresholds"
                hint = "put a resistor in the place of each switch"
                trouble = [Diagnostic("error", "E413", said, self.card.span, hint)]
            else:
                terms = slopes(assembly, linear, exprs)
                for f in self.frequencies:
                    for kind, z in series.at(f, self.second).items():
                        found[kind].append(z)
        runs = []
        frequencies = [] if trouble else list(self.frequencies)
        for kind in kinds:
            columns = [_parts([sum(d * z[k] for k, d in row) for z in found[kind]]) for row in terms]
            flags, status = [False] + [True] * len(names), "failed" if trouble else "ok"
            waves = Computed([frequencies, *columns], flags, status)
            told = ["frequency", *names], ["Hz", *units]
            runs.append(Run(self, *told, waves, self.axis, kind=KINDS[kind], plotname=f"DISTORTION - {kind}"))
        runs[0].trouble = trouble
        runs[0].beside = runs[1:]
        return runs[0]


def _parts(values: list[complex]) -> list[float]:
    return [part for v in values for part in (complex(v).real, complex(v).imag)]


def driven(ctx: Context, key: str) -> list[tuple[int, tuple[float, float]]]:
    """(number of the waveform, amplitude) of every source with that word: a magnitude, 1 without, and a phase [deg]."""
    found = []
    for e in ctx.elements.values():
        if e.letter in "vi" and key in e.params:
            given = e.params[key]
            magnitude, phase = (*given, 0.0)[:2] if isinstance(given, (list, tuple)) else (given, 0.0)
            z = cmath.rect(float(magnitude), math.radians(float(phase)))
            found.append((ctx.wave(e), (z.real, z.imag)))
    return found


class Series:
    """(1) about the point of linearised equations."""

    def __init__(self, assembly: Assembly, linear: SmallSignal) -> None:
        import numpy as np

        from .pencil import dense

        self.assembly, self.linear = assembly, linear
        self.system: System = assembly.system
        self.x = np.array(linear.x)
        self.g, self.c = dense(linear)
        indptr, rows = self.system.pattern()
        self.places = np.array(rows), np.repeat(np.arange(self.system.n), np.diff(indptr))
        volts = np.array([u == "V" for u in self.system.units])
        self.scaling = volts if volts.any() else np.ones(self.system.n, dtype=bool)
        self.unknowns = [assembly.ctx.b.x(k) for k in range(self.system.n)]

    def matrices(self, x: np.ndarray) -> np.ndarray:
        """G and C at a point."""
        import numpy as np

        c, g = self.system.jac(x.tolist(), 0.0)
        whole = np.zeros((2, self.system.n, self.system.n))
        whole[0][self.places], whole[1][self.places] = g, c
        return whole

    def fits(self) -> bool:
        """Are the matrices at the point those of the operating point?"""
        import numpy as np

        return all(
            np.abs(a - b).max(initial=0.0) <= SAME * np.abs(b).max(initial=1e-30)
            for a, b in zip(self.matrices(self.x), (self.g, self.c), strict=True)
        )

    def along(self, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First and second derivatives of G and C along a real direction."""
        import numpy as np

        size = float(np.abs(a[self.scaling]).max(initial=0.0)) or float(np.abs(a).max(initial=0.0))
        if size == 0.0:
            none = np.zeros((2, self.system.n, self.system.n))
            return none, none
        h = STEP / size
        points = [self.matrices(self.x + k * h * a) for k in range(-3, 4)]
        one = sum(w * p for w, p in zip(FIRST, points, strict=True)) / h
        two = sum(w * p for w, p in zip(SECOND, points, strict=True)) / h**2
        return np.asarray(one), np.asarray(two)

    def first(self, f: float, key: str) -> np.ndarray:
        """The response of first order."""
        import numpy as np

        sources = driven(self.assembly.ctx, key)
        if not sources:
            return np.zeros(self.system.n, dtype=complex)
        found = self.linear.respond([(0.0, 2.0 * math.pi * f)], self.unknowns, sources)
        return np.array([np.frombuffer(v, complex)[0] for v in found])

    def answer(self, f: float, parts: np.ndarray) -> np.ndarray:
        """The phasor at f of what F and Q take in."""
        import numpy as np

        s = 2j * math.pi * f
        found: np.ndarray = np.linalg.solve(self.g + s * self.c, -(parts[0] + s * parts[1]))
        return found

    def at(self, f: float, g: float | None) -> dict[str, np.ndarray]:
        """The phasors of (1) that are asked for."""
        x = self.first(f, "distof1")
        d, dd = Directions(self, x).both()
        twice = self.answer(2.0 * f, 0.25 * d @ x)
        if g is None:
            third = 0.5 * d @ twice + dd @ x / 24.0
            return {HARMONICS[0]: twice, HARMONICS[1]: self.answer(3.0 * f, third)}
        y = self.first(g, "distof2")
        less = self.answer(f - g, 0.5 * d @ y.conj())
        e, _ = Directions(self, y.conj()).both()
        parts = 0.5 * e @ twice + 0.5 * d @ less + 0.125 * dd @ y.conj()
        return {
            MIXED[0]: self.answer(f + g, 0.5 * d @ y), MIXED[1]: less, MIXED[2]: self.answer(2.0 * f - g, parts)
        }  # fmt: skip


class Directions:
    """D2[z, .] and D3[z, z, .] of a complex direction z = a + j b, from real ones."""

    def __init__(self, series: Series, z: np.ndarray) -> None:
        self.series, self.a, self.b = series, z.real, z.imag

    def both(self) -> tuple[np.ndarray, np.ndarray]:
        (a, aa), (b, bb) = self.series.along(self.a), self.series.along(self.b)
        if not self.b.any():
            return a + 0j, aa + 0j
        _, plus = self.series.along(self.a + self.b)
        _, minus = self.series.along(self.a - self.b)
        return a + 1j * b, aa - bb + 0.5j * (plus - minus)
