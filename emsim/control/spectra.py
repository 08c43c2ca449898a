"""Spectra, and what makes even steps of them: linearize, fft, psd, spec, fourier."""

from __future__ import annotations

import math

import numpy as np

from .._engine import Curve
from ..measures.fourier import HARMONICS, spectrum
from ..measures.points import Points
from . import words
from .base import Command
from .errors import CommandError, usage
from .plots import Plot, Vector, column_name, table_of
from .windows import window

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..measures.fourier import Spectrum
    from .program import Statement
    from .session import Session


def cutout(s: Session, text: str, at: Statement) -> None:
    """The vectors of the current plot from cut-tstart to cut-tstop, its own points, as a plot."""
    old, x = _timed(s, "cutout")
    ends = [_own(old, name, x[k]) for name, k in (("cut-tstart", 0), ("cut-tstop", -1))]
    first, last = (
        min(int(np.searchsorted(x, end, "right")), len(x) - 1) if name in old.vectors else k % len(x)
        for end, (name, k) in zip(ends, (("cut-tstart", 0), ("cut-tstop", -1)), strict=True)
    )
    if not (ends[1] > ends[0] and last > first):
        raise CommandError("E164", f"there are no points from {ends[0]:g} to {ends[1]:g}")
    names = words.split(text) or [v.name for v in old.sorted() if v is not old.scale and len(v) >= last]
    found = [s.plots.vector(n) for n in names]
    what = "(cut out)" if "cut-tstart" in old.vectors or "cut-tstop" in old.vectors else "(copy)"
    new = s.plots.new("tran", old.title, f"{old.plotname} {what}")
    new.over("time", x[first:last], "s", shown=True)
    for v in found:
        new.add(
            Vector(v.key if v.key in old.vectors else v.name, v.values[first:last], v.unit, new)
        ).derived = v.derived


def linearize(s: Session, text: str, at: Statement) -> None:
    """The vectors of the current plot on even steps: those of the transient, or of lin-tstep, lin-tstart, lin-tstop."""
    old, x = _timed(s, "linearize")
    grid = old.table.grid if old.table is not None else None
    step, start, stop = grid or ((x[-1] - x[0]) / max(len(x) - 1, 1), x[0], x[-1])
    step, start, stop = (
        _own(old, n, v)
        for n, v in (("lin-tstep", step), ("lin-tstart", start), ("lin-tstop", min(stop, x[-1])))
    )
    if not step > 0 or not stop > start:
        raise CommandError("E164", f"no even steps of {step:g} from {start:g} to {stop:g}")
    count = (stop - start) / step
    if count > 1e8:
        raise CommandError("E165", f"{count:.3g} steps are too many")
    times = start + step * np.arange(int(count + 1.5))
    names = words.split(text) or [v.name for v in old.sorted() if v is not old.scale and len(v) == len(x)]
    found = [s.plots.vector(n) for n in names]
    new = s.plots.new("tran", old.title, f"{old.plotname.removesuffix(' (linearized)')} (linearized)")
    new.over("time", times, "s")
    for v in found:
        new.add(Vector(v.key if v.key in old.vectors else v.name, _sampled(old, v, times), v.unit, new))


def _own(plot: Plot, name: str, value: float) -> float:
    found = plot.vectors.get(name)
    return float(found.values[0].real) if found is not None and len(found) else float(value)


def _sampled(plot: Plot, v: Vector, times: np.ndarray) -> np.ndarray:
    """Values between the points: of a column by its table's own rule, else on straight lines."""
    assert plot.scale is not None
    x, y = plot.scale.values.real, v.values
    if v.is_complex:
        return np.interp(times, x, y.real) + 1j * np.interp(times, x, y.imag)
    return np.interp(times, x, y)


# sums of a[k] cos(2 pi k u), u from 0 to 1, whose mean is 1
def _timed(s: Session, what: str) -> tuple[Plot, np.ndarray]:
    """The current plot and its times. Raises CommandError where it is over something else."""
    plot = s.plots.current
    if plot.scale is None or plot.scale.key != "time":
        raise CommandError("E164", f"{what} needs a plot over time", "tran or run makes one")
    return plot, plot.scale.values.real


def _even(s: Session, form: str, text: str) -> tuple[np.ndarray, list[Vector]]:
    """The times of the plot, of which uneven steps are told, and the vectors."""
    _, x = _timed(s, "a spectrum")
    if not text.strip():
        usage(form, "no vector is named")
    found = s.vectors(text)
    if len(x) < 2 or any(len(v) != len(x) for v in found):
        raise CommandError("E164", "the vectors are not as long as the time")
    if any(v.is_complex for v in found):
        raise CommandError("E164", "a spectrum is of real vectors")
    steps = np.diff(x)
    if steps.max() > 1.01 * steps.min():
        s.warn(
            "the times have uneven steps, and the spectrum takes them for even ones, as in ngspice",
            "linearize makes even steps of them",
        )
    return x, found


def _frequencies(s: Session, x: np.ndarray, word: str, title: str) -> Plot:
    """A plot over frequencies from 0 to half of that of the points, which are told."""
    n, span = len(x), x[-1] - x[0]
    half = n // 2 + 1
    s.say(f"{word}: Time span: {span:g} s, input length: {n}, zero padding: 0")
    s.say(f"{word}: Frequency resolution: {1 / span:g} Hz, output length: {half}")
    new = s.plots.new("sp", s.deck.title, title)
    new.over("frequency", np.arange(half) / span, "Hz")
    return new


def fft(s: Session, text: str, at: Statement) -> None:
    """The amplitudes of the frequencies from 0 to half of that of the points."""
    x, found = _even(s, "fft vector ..", text)
    w, new = window(s, x), _frequencies(s, x, "FFT", "Spectrum")
    s.note("at 0 Hz stands the mean of the vector; ngspice shows twice of it")
    for v in found:
        spectrum = np.fft.rfft(v.values * w) / len(x)
        spectrum[1:] *= 2.0
        new.add(Vector(v.name, spectrum, "", new))


def psd(s: Session, text: str, at: Statement) -> None:
    """The power density over frequency, averaged over so many neighbours."""
    count, _, rest = text.strip().partition(" ")
    form = "psd averages vector .."
    if not rest.strip():
        usage(form, "a number of neighbours and vectors are needed")
    asked = s.numbers(count)[0]
    if not math.isfinite(asked):
        usage(form, "the number of neighbours is finite")
    smooth = int(asked)
    x, found = _even(s, form, rest)
    w, new = window(s, x), _frequencies(s, x, "PSD", "PSD")
    n, span, half = len(x), x[-1] - x[0], len(x) // 2 + 1
    for v in found:
        power = np.abs(np.fft.rfft(v.values * w) / n) ** 2
        power[1:] *= 2.0
        s.say(
            f"Total noise power up to Nyquist frequency {(half - 1) / span:5.3e} Hz: {power.sum():e} V^2 (or A^2), \n"
            f"Noise voltage or current: {np.sqrt(power.sum()):e} V (or A)"
        )
        if smooth > 1:
            kernel = np.ones(min(smooth, half)) / min(smooth, half)
            power = np.convolve(power, kernel, mode="same")
        new.add(Vector(v.name, (power * span).astype(complex), "", new))


def spec(s: Session, text: str, at: Statement) -> None:
    """The spectrum at the frequencies asked for, by the sums themselves."""
    form = "spec fstart fstop fstep vector .."
    given = text.split(None, 3)
    if len(given) < 4:
        usage(form, "three frequencies and vectors are needed")
    low, high, step = s.numbers(" ".join(given[:3]), 3)
    x, found = _even(s, form, given[3])
    if not (step > 0 and 0 <= low <= high < math.inf):
        usage(form, "frequencies are not negative, and the step is positive")
    count = int((high - low) / step + 1e-9) + 1
    if count * len(x) > 1e9:
        raise CommandError("E165", f"{count} frequencies of {len(x)} points are too many")
    frequencies = low + step * np.arange(count)
    w, n = window(s, x), len(x)
    new = s.plots.new("sp", s.deck.title, "Spectrum")
    new.over("frequency", frequencies, "Hz")
    for v in found:
        y = v.values * w
        values = np.array([np.sum(y[1:] * np.exp(2j * np.pi * f * (x[1:] - x[0]))) for f in frequencies]) / (
            n - 1
        )
        values[frequencies > 0] *= 2.0
        new.add(Vector(v.name, values, "", new))


def fourier(s: Session, text: str, at: Statement) -> None:
    """Harmonics of the last period: amplitude and phase of each, and their distortion."""
    given, _, rest = text.strip().partition(" ")
    form = "fourier frequency vector .. [> file]"
    if not rest.strip():
        usage(form, "a frequency and vectors are needed")
    base = s.numbers(given)[0]
    plot, x = _timed(s, "fourier")
    if not 0 < base < math.inf:
        usage(form, "the frequency is positive")
    period = 1.0 / base
    if x[-1] - x[0] < period * (1 - 1e-9):
        raise CommandError("E164", f"the run is shorter than a period of {period:g} s")
    count = max(1, min(s.integer("nfreqs", HARMONICS), 10_000))
    if idle := [name for name in ("fourgridsize", "polydegree") if name in s.variables]:
        s.note(f"{' and '.join(idle)}: no effect on harmonics, which are integrals and no sums over a grid")
    table = table_of(plot)
    assert table is not None
    points = Points(table)
    for v in s.vectors(rest):
        if len(v) != len(x) or v.is_complex:
            raise CommandError("E164", f"`{v.name}` is no real vector over time")
        # a column by the table's own rule between points, what is computed here on straight lines
        name = column_name(v, plot)
        if v.plot is plot and table.has_column(name):
            curve = Curve(points.x, points.real(name), points.n)
        else:
            ends = [np.stack([of[:-1], of[1:]], axis=1).tobytes() for of in (x, v.values)]
            curve = Curve(ends[0], ends[1], 1)
        _told(s, spectrum(v.name, v.unit, curve, base, float(x[-1]), float(x[0]), count))


def _told(s: Session, found: Spectrum) -> None:
    grid, degree, count = s.integer("fourgridsize", 200), s.integer("polydegree", 1), len(found.harmonics)
    s.say(f"Fourier analysis for {found.signal}:")
    s.say(
        f"  No. Harmonics: {count}, THD: {found.thd:g} %, Gridsize: {grid}, Interpolation Degree: {degree}\n"
    )
    s.say("Harmonic Frequency   Magnitude   Phase       Norm. Mag   Norm. Phase")
    s.say("-------- ---------   ---------   -----       ---------   -----------")
    for h in found.harmonics:
        numbers = (h.frequency, h.magnitude, h.phase, h.normalised, h.relative_phase)
        s.say(f" {h.k:<4d}    " + "".join(f"{t:<11.{5 if t < 0 else 6}g} " for t in numbers))
    s.say("")
    plot = s.plots.current
    number = 1
    while f"fourier{number}1" in plot.vectors:
        number += 1
    values = np.array(
        [[getattr(h, key) for h in found.harmonics] for key in ("frequency", "magnitude", "phase")]
    )
    made = Vector(f"fourier{number}1", values.reshape(-1), "", plot)
    made.dims = values.shape
    plot.add(made)


COMMANDS = (
    Command("linearize", "linearize [vector ..]", "a plot on even steps of time", linearize, records=True),
    Command(
        "cutout",
        "cutout [vector ..]",
        "a plot of the points between the vectors cut-tstart and cut-tstop",
        cutout,
        records=True,
    ),
    Command("fft", "fft vector ..", "a spectrum; `set specwindow`", fft, "vectors"),
    Command("psd", "psd averages vector ..", "power over frequency", psd, records=True),
    Command(
        "spec",
        "spec fstart fstop fstep vector ..",
        "a spectrum at frequencies of your choice",
        spec,
        records=True,
    ),
    Command(
        "fourier",
        "fourier frequency vector .. [> file]",
        "harmonics of the last period",
        fourier,
        records=True,
        shows=True,
    ),
    Command("four", "four frequency vector .. [> file]", "the same", fourier, records=True, shows=True),
)
