"""TRNOISE and TRRANDOM: random waveforms as points with straight lines between, the same for the same seed.

    TRNOISE(na nt nalpha namp rtsam rtscapt rtsemt)
        every nt [s] from 0 on, which is 0: normal values of deviation na, plus 1/f noise, straight lines between; plus a
        telegraph signal: 0 for exponential times of mean rtscapt, rtsam for such of mean rtsemt
    TRRANDOM(type ts td a b)
        0 up to td, then a value for each ts: 1 even within b -+ a, 2 normal of deviation a about b, 3 exponential of mean a
        plus b, 4 Poisson's of mean a plus b

1/f noise (Kasdin 1995): white noise of deviation namp through (1 - z^-1)^(-nalpha/2), so its one-sided density is
2 namp^2 nt |1 - exp(-j w nt)|^(-nalpha), namp^2 nt^(1 - nalpha) 2/w^nalpha at low frequencies.
"""

from __future__ import annotations

import math

from ..elements.courses import MOST

TYPE_CHECKING = False
if TYPE_CHECKING:
    from random import Random


Points = list[float]  # t0, v0, t1, v1, ..


def points(kind: str, given: list[float], tstop: float, seed: str) -> Points:
    """Times [s] and values up to tstop. Raises ValueError with what is wrong."""
    from random import Random

    a = [*given, *[0.0] * (7 - len(given))]
    return (_noise if kind == "trnoise" else _steps)(a, len(given), tstop, Random(seed))


def _count(every: float, tstop: float) -> int:
    count = math.ceil(tstop / every) + 2
    if count > MOST:
        raise ValueError(
            f"a value every {every:g} s up to {tstop:g} s makes {count:,} points, {MOST:,} are the most"
        )
    return count


def _noise(a: list[float], count: int, tstop: float, draw: Random) -> Points:
    na, nt, alpha, namp, rtsam, capture, emission = a[:7]
    sampled, switched = bool(na or (alpha and namp)), bool(rtsam)
    if sampled and not nt > 0.0:
        raise ValueError(f"its time step is {nt:g} s, it must be positive")
    if not 0.0 <= alpha <= 2.0:
        raise ValueError(f"the exponent of 1/f is {alpha:g}, it must lie between 0 and 2")
    if switched and not (capture > 0.0 and emission > 0.0):
        raise ValueError("the mean times of its telegraph signal must be positive")
    if not sampled:
        found = [0.0, 0.0]
    else:
        values = [0.0, *(draw.gauss(0.0, na) if na else 0.0 for _ in range(_count(nt, tstop) - 1))]
        if alpha and namp:
            coloured = _falling(alpha, [draw.gauss(0.0, namp) for _ in values[1:]])
            values = [0.0, *(v + c for v, c in zip(values[1:], coloured, strict=True))]
        found = [x for k, v in enumerate(values) for x in (k * nt, v)]
    return _with_telegraph(found, rtsam, (capture, emission), tstop, draw) if switched else found


def _falling(alpha: float, white: list[float]) -> list[float]:
    """White noise through (1 - z^-1)^(-alpha/2)."""
    import numpy as np

    k = np.arange(1, len(white))
    response = np.concatenate(([1.0], np.cumprod((0.5 * alpha + k - 1.0) / k)))
    size = 1 << (2 * len(white) - 1).bit_length()
    found: list[float] = np.fft.irfft(np.fft.rfft(response, size) * np.fft.rfft(white, size), size)[
        : len(white)
    ].tolist()
    return found


def _with_telegraph(
    line: Points, height: float, means: tuple[float, float], tstop: float, draw: Random
) -> Points:
    """Jumps between 0 and a height on top of straight lines."""
    found: Points = []
    t, up, at = draw.expovariate(1.0 / means[0]), False, 0
    times, values = line[::2], line[1::2]
    while True:
        while at < len(times) and times[at] <= t:
            found += [times[at], values[at] + (height if up else 0.0)]
            at += 1
        if t > tstop:
            break
        base = values[at - 1]
        if at < len(times):
            base += (values[at] - base) * (t - times[at - 1]) / (times[at] - times[at - 1])
        for level in (up, not up):
            found += [t, base + (height if level else 0.0)]
        if len(found) > 2 * MOST:
            raise ValueError(f"its telegraph signal makes more than {MOST:,} points")
        up = not up
        t += draw.expovariate(1.0 / means[up])
    for time, value in zip(times[at:], values[at:], strict=True):
        found += [time, value + (height if up else 0.0)]
    return found


def _steps(a: list[float], count: int, tstop: float, draw: Random) -> Points:
    kind, ts, td = a[:3]
    size, middle = (a[3] if count > 3 else 1.0), a[4]
    if not ts > 0.0:
        raise ValueError(f"its time step is {ts:g} s, it must be positive")
    if td < 0.0:
        raise ValueError(f"its delay is {td:g} s, it must not be negative")
    if kind not in (1.0, 2.0, 3.0, 4.0):
        raise ValueError(f"its type is {kind:g}; 1 is uniform, 2 gaussian, 3 exponential, 4 poisson")
    if kind > 2.0 and not size > 0.0:
        raise ValueError(f"its mean is {size:g}, it must be positive")
    of = {
        1.0: lambda: draw.uniform(-size, size), 2.0: lambda: draw.gauss(0.0, size),
        3.0: lambda: draw.expovariate(1.0 / size), 4.0: lambda: _poisson(size, draw),
    }[kind]  # fmt: skip
    # before its first value: 0, and without a delay what the values lie about
    last = 0.0 if td else middle
    found = [0.0, last]
    for k in range(_count(ts, max(tstop - td, 0.0))):
        value = middle + of()
        found += [td + k * ts, last, td + k * ts, value]
        last = value
    return found


def _poisson(mean: float, draw: Random) -> float:
    """How many exponential times of mean 1 fit into `mean`, one after the other."""
    count, t = 0, draw.expovariate(1.0)
    while t < mean:
        count, t = count + 1, t + draw.expovariate(1.0)
    return float(count)
