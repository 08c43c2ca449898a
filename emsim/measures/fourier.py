"""`.four f v(a) ...`: the harmonics of signals over the last period of a transient, and the total harmonic distortion.

    y(t) = a_0 + sum_k  M_k sin(2 pi k f t + phi_k),     M_k e^(j phi_k) = (2 j/T) integral y(t) e^(-2 pi j k f t) dt       (1)

over the T = 1/f before the end, t counted from the start of that period, as ngspice does. The integrals are those of the method's
dense output, where ngspice takes 200 points of straight lines.
"""

from __future__ import annotations

import math

import numpy as np

from .base import NotFound
from .curve import areas, nodes, resampling

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .._engine import Curve

HARMONICS = 10  # the mean among them
RULE = 32  # points of the integral over a piece
PIECE = 0.5  # of the shortest harmonic: no piece is longer


class Harmonic:
    """The k-th one: its frequency [Hz], magnitude, phase [deg] of a sine, and both beside the first one's."""

    __slots__ = ("frequency", "k", "magnitude", "normalised", "phase", "relative_phase")

    def __init__(
        self,
        k: int,
        frequency: float,
        magnitude: float,
        phase: float,
        normalised: float,
        relative_phase: float,
    ) -> None:
        self.k, self.frequency, self.magnitude, self.phase = k, frequency, magnitude, phase
        self.normalised, self.relative_phase = normalised, relative_phase

    def __repr__(self) -> str:
        return f"{self.k} x: {self.magnitude:g} at {self.phase:g} deg"


class Spectrum:
    """Harmonics of a signal; `thd` [%] is the root of the sum of squares of those above the first, over the first."""

    __slots__ = ("harmonics", "signal", "step", "thd", "unit")

    def __init__(self, signal: str, unit: str, harmonics: list[Harmonic]) -> None:
        self.signal, self.unit, self.harmonics, self.step = signal, unit, harmonics, 0
        self.thd = 100.0 * math.sqrt(sum(h.normalised**2 for h in harmonics[2:]))

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> Iterator[str]:
        """As ngspice prints it."""
        yield f"Fourier analysis for {self.signal}:"
        yield f"  No. Harmonics: {len(self.harmonics)}, THD: {self.thd:g} %"
        yield ""
        widths = (8, 11, 11, 11, 11, 11)
        heads = ("Harmonic", "Frequency", "Magnitude", "Phase", "Norm. Mag", "Norm. Phase")
        yield " ".join(f"{h:<{w}}" for h, w in zip(heads, widths, strict=True)).rstrip()
        yield " ".join("-" * len(h) + " " * (w - len(h)) for h, w in zip(heads, widths, strict=True)).rstrip()
        for h in self.harmonics:
            cells = (h.k, h.frequency, h.magnitude, h.phase, h.normalised, h.relative_phase)
            texts = [f" {h.k}", *(f"{c:g}" for c in cells[1:])]
            yield " ".join(f"{t:<{w}}" for t, w in zip(texts, widths, strict=True)).rstrip()
        yield ""

    def to_dict(self) -> dict[str, object]:
        harmonics = [
            {"harmonic": h.k, "frequency": h.frequency, "magnitude": h.magnitude, "phase": h.phase}
            for h in self.harmonics
        ]
        return {
            "signal": self.signal,
            "unit": self.unit,
            "thd": self.thd,
            "step": self.step,
            "harmonics": harmonics,
        }


def spectrum(
    signal: str, unit: str, curve: Curve, frequency: float, last: float, first: float, count: int = HARMONICS
) -> Spectrum:
    """(1) of a curve, `count` harmonics with the mean. NotFound where the results are shorter than a period."""
    period = 1.0 / frequency
    if last - first < period * (1 - 1e-9):
        said = f"a period of {frequency:g} Hz takes {period:g} s, the results {last - first:g} s"
        raise NotFound(said, "run longer, or name a higher frequency")
    begin = max(last - period, first)
    part = curve.cut(begin, last)
    # pieces so short that the rule knows the fastest harmonic
    x, y_all = (np.frombuffer(values).reshape(-1, part.n + 1) for values in (part.x, part.y))
    widths = x[:, -1] - x[:, 0]
    longest = PIECE * period / max(count - 1, 1) * RULE / 8
    sums = np.zeros(max(count, 2), dtype=complex)
    parts = np.maximum(1, np.ceil(widths / longest)).astype(int)
    for pieces in np.unique(parts):
        own = parts == pieces
        x0, y, w = x[own, 0], y_all[own], widths[own] / pieces
        for j in range(pieces):
            at = (j + nodes(RULE)) / pieces
            values = y @ resampling(part.n, at).T
            t = x0[:, None] + widths[own][:, None] * at - begin
            for k in range(len(sums)):
                wave = np.exp(-2j * np.pi * k * frequency * t)
                sums[k] += np.sum(w * ((values * wave) @ areas(RULE)))
    found = []
    mean = float(sums[0].real / period)
    first_one = 2j * sums[1] / period
    size = abs(first_one)
    for k in range(count):
        z = 2j * sums[k] / period
        magnitude, phase = (mean, 0.0) if k == 0 else (abs(z), math.degrees(math.atan2(z.imag, z.real)))
        normalised = 0.0 if k == 0 or not size else magnitude / size
        relative = 0.0 if k == 0 else phase - math.degrees(math.atan2(first_one.imag, first_one.real))
        found.append(Harmonic(k, k * frequency, magnitude, phase, normalised, relative))
    return Spectrum(signal, unit, found)
