"""The functions of vectors, as ngspice has them: one table.

`each` work on numbers one by one; the others take whole vectors (with what belongs to them) and the session.
"""

from __future__ import annotations

import math
import warnings

import numpy as np

from .errors import CommandError
from .plots import Vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .session import Session

MOST = 100_000_000  # numbers of a vector that a command makes
RAD = 180.0 / math.pi


def in_degrees(s: Session) -> bool:
    return str(s.variables.get("units", "")).lower() == "degrees"


def _angle(f: Callable[[Any], Any]) -> Callable[[Session, np.ndarray], Any]:
    """A function of an angle: in degrees after `set units=degrees`."""
    return lambda s, x: f(x / RAD if in_degrees(s) else x)


def _into_angle(f: Callable[[Any], Any]) -> Callable[[Session, np.ndarray], Any]:
    return lambda s, x: f(x) * (RAD if in_degrees(s) else 1.0)


def _plain(f: Callable[[Any], Any]) -> Callable[[Session, np.ndarray], Any]:
    return lambda s, x: f(x)


def _phase(x: np.ndarray) -> np.ndarray:
    return np.angle(x) if np.iscomplexobj(x) else np.zeros(len(x))


def _unwrapped(x: np.ndarray) -> np.ndarray:
    return np.unwrap(_phase(x))


def _of_positive(name: str, f: Callable[[Any], Any]) -> Callable[[Session, np.ndarray], Any]:
    """A logarithm: of complex numbers too, not of negative ones."""

    def found(s: Session, x: np.ndarray) -> Any:
        if not np.iscomplexobj(x) and (x < 0).any():
            raise CommandError(
                "E164", f"{name}() of a negative number", f"{name}(mag(..)), or of a complex number"
            )
        return f(x)

    return found


def _complex_where_negative(f: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """sqrt: of negative numbers complex."""
    return lambda x: f(x.astype(complex)) if not np.iscomplexobj(x) and (x < 0).any() else f(x)


def _parts(f: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda x: f(x.real) + 1j * f(x.imag) if np.iscomplexobj(x) else f(x)


EACH: dict[str, Callable[[Any, np.ndarray], Any]] = {
    "mag": _plain(np.abs), "magnitude": _plain(np.abs), "abs": _plain(np.abs),
    "ph": _into_angle(_phase), "phase": _into_angle(_phase), "cph": _into_angle(_unwrapped), "cphase": _into_angle(_unwrapped),
    "unwrap": lambda s, x: np.unwrap(x.real / RAD) * RAD if in_degrees(s) else np.unwrap(x.real),
    "j": _plain(lambda x: x * 1j), "real": _plain(np.real), "re": _plain(np.real), "imag": _plain(np.imag), "im": _plain(np.imag),
    "conj": _plain(np.conj), "pos": _plain(lambda x: (x.real > 0) * 1.0), "db": _plain(lambda x: 20.0 * np.log10(np.abs(x))),
    "log": _of_positive("log", np.log), "ln": _of_positive("ln", np.log), "log10": _of_positive("log10", np.log10),
    "exp": _plain(np.exp), "sqrt": _plain(_complex_where_negative(np.sqrt)),
    "sin": _angle(np.sin), "cos": _angle(np.cos), "tan": _angle(np.tan), "atan": _into_angle(np.arctan),
    "asin": _into_angle(np.arcsin), "acos": _into_angle(np.arccos),
    "sinh": _angle(np.sinh), "cosh": _angle(np.cosh), "tanh": _angle(np.tanh),
    "floor": _plain(_parts(np.floor)), "ceil": _plain(_parts(np.ceil)), "nint": _plain(_parts(np.rint)),
    "deg": _plain(lambda x: x * RAD), "rpm": _plain(lambda x: x * 30 / math.pi),
}  # fmt: skip
KEEP_UNIT = frozenset(
    "mag magnitude abs real re imag im conj mean avg stddev vecmin vecmax minimum maximum floor ceil nint rms".split()
)
UNIT = {"ph": "rad", "phase": "rad", "cph": "rad", "cphase": "rad", "db": "dB", "deg": "deg", "rpm": "rpm"}


def scale_of(s: Session, v: Vector) -> np.ndarray | None:
    """What a vector is over: its own scale, or that of its plot where the lengths fit; real numbers."""
    plot = v.plot if v.plot is not None else s.plots.current
    scale = v.scale or plot.scale or s.plots.current.scale
    return scale.values.real if scale is not None and len(scale) == len(v) else None


def _needs_scale(s: Session, v: Vector, name: str) -> np.ndarray:
    x = scale_of(s, v)
    if x is None:
        raise CommandError("E164", f"{name}() needs a vector with a scale of its length")
    return x


def _uneven(s: Session, v: Vector, name: str) -> np.ndarray | None:
    """The times of a vector whose steps are uneven: there the mean of the points says little, and that over time is taken."""
    plot = v.plot if v.plot is not None else s.plots.current
    x = scale_of(s, v)
    if x is None or len(x) < 3 or plot.scale is None or plot.scale.key != "time" or v.scale is not None:
        return None
    steps = np.diff(x)
    if steps.max() <= 1.001 * steps.min() or x[-1] <= x[0]:
        return None
    s.note(f"{name}() is taken over time, since the steps are uneven; ngspice takes that of the points")
    return x


def _areas(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])


def _mean(s: Session, v: Vector) -> Any:
    x = _uneven(s, v, "mean")
    return [v.values.mean() if x is None else _areas(x, v.values)[-1] / (x[-1] - x[0])]


def _avg(s: Session, v: Vector) -> Any:
    """The mean so far."""
    x, y = _uneven(s, v, "avg"), v.values
    if x is None:
        return np.cumsum(y) / np.arange(1, len(y) + 1)
    with np.errstate(all="ignore"):
        return np.where(x > x[0], _areas(x, y) / (x - x[0]), y[0])


def _integ(s: Session, v: Vector) -> Any:
    return _areas(_needs_scale(s, v, "integ"), v.values)


def _deriv(s: Session, v: Vector) -> Any:
    """The slope of the parabola through three neighbours (`set dpolydegree` changes the degree)."""
    x, y = _needs_scale(s, v, "deriv"), v.values
    degree = max(1, min(s.integer("dpolydegree", 2), 8, len(y) - 1))
    if len(y) < 2:
        return np.zeros(len(y))
    n, out = len(y), np.empty(len(y), dtype=y.dtype)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for k in range(n):
            first = min(max(k - degree // 2, 0), n - degree - 1)
            px, py = x[first : first + degree + 1], y[first : first + degree + 1]
            out[k] = _slope(px - x[k], py)
    return out


def _slope(x: np.ndarray, y: np.ndarray) -> Any:
    """The derivative at 0 of the polynomial through the points, by Lagrange's formula."""
    total: Any = 0.0
    for i in range(len(x)):
        others = [j for j in range(len(x)) if j != i]
        bottom = math.prod(x[i] - x[j] for j in others)
        top = sum(math.prod(-x[j] for j in others if j != k) for k in others)
        total = total + y[i] * top / bottom if bottom else math.nan
    return total


def _group_delay(s: Session, v: Vector) -> Any:
    """-d phase / d omega [s]."""
    x = _needs_scale(s, v, "group_delay")
    if not v.is_complex:
        raise CommandError("E164", "group_delay() needs complex values over a frequency")
    phase = Vector("", _unwrapped(v.values), "", v.plot)
    phase.scale = Vector("", x)
    return -_deriv(s, phase) / (2 * math.pi)


def _interpolate(s: Session, v: Vector) -> Any:
    """The vector on the scale of the current plot."""
    x, to = _needs_scale(s, v, "interpolate"), s.plots.current.scale
    if to is None:
        raise CommandError("E164", "interpolate() needs a current plot with a scale")
    if v.is_complex:
        return np.interp(to.values.real, x, v.values.real) + 1j * np.interp(to.values.real, x, v.values.imag)
    return np.interp(to.values.real, x, v.values)


def _count(v: Vector, name: str) -> int:
    n = abs(complex(v.values[0]))
    if not n < MOST:
        raise CommandError("E165", f"{name}({n:g}): a vector has {MOST:g} numbers at most")
    return max(1, int(n))


def _normed(s: Session, v: Vector) -> Any:
    largest = np.abs(v.values).max()
    return v.values / largest if largest else v.values


def _extreme(f: Callable[[Any], Any]) -> Callable[[Any, Vector], Any]:
    def found(s: Session, v: Vector) -> Any:
        return [f(v.values.real) + 1j * f(v.values.imag)] if v.is_complex else [f(v.values)]

    return found


def _differences(y: np.ndarray) -> np.ndarray:
    """Between the neighbours on both sides; at the ends to the only one."""
    if len(y) < 2:
        return np.zeros(len(y))
    return np.concatenate([y[1:2] - y[:1], y[2:] - y[:-2], y[-1:] - y[-2:-1]])


def _fft(s: Session, v: Vector) -> Any:
    """Amplitudes from 0 up to half the rate of what is real, of complex numbers at all places; windows as `set specwindow` says,
    none where it does not. Its frequencies are the plot's `fft_scale`."""
    from .windows import window

    n, x = len(v), scale_of(s, v)
    times = x if x is not None else np.arange(n, dtype=float)
    kind = s.plots.current.scale.key if s.plots.current.scale is not None and x is not None else ""
    given = v.values * window(s, times, "none")
    found = np.fft.fft(given) / n if v.is_complex else np.fft.rfft(given) / max(n // 2, 1)
    places = np.arange(len(found), dtype=float)
    if kind == "frequency":
        places = times[: len(found)]
    elif kind == "time" and n > 1:
        places = places / (times[-1] - times[0])
    scale = s.plots.current.add(Vector("fft_scale", places, "Hz", s.plots.current))
    return _over(found, scale)


def _ifft(s: Session, v: Vector) -> Any:
    """What amplitudes at all places add up to; its times are the plot's `ifft_scale`."""
    plot_scale, n = s.plots.current.scale, len(v)
    count = len(plot_scale) if plot_scale is not None and plot_scale.key in ("time", "frequency") else n
    places = np.arange(count, dtype=float)
    if plot_scale is not None and plot_scale.key == "time":
        places = plot_scale.values.real
    elif plot_scale is not None and plot_scale.key == "frequency" and count > 1:
        places = places / (plot_scale.values.real[-1] - plot_scale.values.real[0])
    scale = s.plots.current.add(Vector("ifft_scale", places, "s", s.plots.current))
    return _over(np.fft.ifft(v.values, count) * count, scale)


def _over(values: np.ndarray, scale: Vector) -> Vector:
    found = Vector("", values)
    found.scale = scale
    return found


WHOLE: dict[str, Callable[[Any, Vector], Any]] = {
    "length": lambda s, v: [float(len(v))],
    "mean": _mean, "avg": _avg, "integ": _integ, "deriv": _deriv, "group_delay": _group_delay, "interpolate": _interpolate,
    "stddev": lambda s, v: [float(np.std(np.abs(v.values) if v.is_complex else v.values, ddof=1)) if len(v) > 1 else 0.0],
    "norm": _normed, "sortorder": lambda s, v: np.argsort(v.values.real, kind="stable").astype(float),
    "vecmin": _extreme(np.min), "minimum": _extreme(np.min), "vecmax": _extreme(np.max), "maximum": _extreme(np.max),
    "rms": lambda s, v: [_rms(s, v)], "fft": _fft, "ifft": _ifft,
    "vecd": lambda s, v: _differences(v.values),
    "vector": lambda s, v: np.arange(_count(v, "vector"), dtype=float),
    "cvector": lambda s, v: np.arange(_count(v, "cvector")) * (1.0 + 1.0j),
    "unitvec": lambda s, v: np.ones(_count(v, "unitvec")),
    "rnd": lambda s, v: np.floor(s.random.random(len(v)) * np.floor(np.abs(v.values))),
    "sunif": lambda s, v: s.random.uniform(-1.0, 1.0, len(v)),
    "sgauss": lambda s, v: s.random.standard_normal(len(v)),
    "poisson": lambda s, v: s.random.poisson(np.clip(np.nan_to_num(np.abs(v.values)), 0, 1e9)).astype(float),
    "exponential": lambda s, v: s.random.exponential(1.0, len(v)) * np.abs(v.values),
}  # fmt: skip


def _rms(s: Session, v: Vector) -> float:
    """Over the scale where there is one."""
    square = np.abs(v.values) ** 2
    x = scale_of(s, v)
    if x is None or len(x) < 2 or x[-1] == x[0]:
        return math.sqrt(square.mean())
    return math.sqrt(abs(float(np.trapezoid(square, x) / (x[-1] - x[0]))))


def names() -> list[str]:
    return [*EACH, *WHOLE]


def apply(s: Session, name: str, v: Vector) -> Vector:
    """The function of a vector. Raises CommandError for a name that is none."""
    if not len(v):
        raise CommandError("E164", f"{name}() of an empty vector")
    with np.errstate(all="ignore"):
        values = EACH[name](s, v.values) if name in EACH else WHOLE[name](s, v)
    unit = v.unit if name in KEEP_UNIT else UNIT.get(name, "")
    if unit == "rad" and in_degrees(s):
        unit = "deg"
    made = values if isinstance(values, Vector) else None
    values = np.asarray(values if made is None else made.values)
    out = Vector(name, values if np.iscomplexobj(values) else values.astype(float), unit, v.plot)
    out.derived = True
    if made is not None:
        out.scale = made.scale
    elif len(out) == len(v):
        out.dims, out.scale = v.dims, v.scale
    return out
