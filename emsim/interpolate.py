"""Values between recorded points: a cubic through four points that turns straight beside a kink.

Between x1 and x2, with the second divided differences a = y[x0,x1,x2] and b = y[x1,x2,x3],

    y(t) = chord(t) + c(t) (t - x1)(t - x2),    c(t) = a + (b - a) (t - x0)/(x3 - x0)          (1)

is the cubic through the four points: fourth order where the signal is smooth, third at inflections. At a
corner of a source one of a, b is large and says nothing about this interval, so |c| is held to three times
the smaller of the two, and c = 0 where they differ in sign (an inflection, or an edge within one step) or a
neighbour is missing (the ends, a jump). The low of a pulse that one step takes has an edge for each
neighbour, a parabola to four points: between two `corners`, times at which the run knows that signals may
bend, |c| is held to |chord'|/(x2 - x1), beyond which y(t) turns back. There is no overshoot beside an edge,
and straight edges stay straight. At a jump (two points with one x) the later value holds. Limiting divided
differences is Harten's ENO idea (J. Comput. Phys. 71, 1987, 231).

The rule stands here twice: `cubic` for tables on the command line, which must not wait for numpy, and
`cubic_many` for arrays. A test holds them together.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np


def cubic(x: Sequence[float], y: Sequence[float], t: float, corners: Sequence[float] = ()) -> float:
    """Value at t, x[0] <= t <= x[-1]; x ascending, repeated where y jumps; corners ascending."""
    last = len(x) - 1
    k = min(bisect_right(x, t) - 1, last - 1)
    if k < 0 or t == x[k + 1]:
        return y[k + 1]
    width = x[k + 1] - x[k]
    secant = (y[k + 1] - y[k]) / width
    chord = y[k] + secant * (t - x[k])
    if k == 0 or k + 2 > last or x[k - 1] == x[k] or x[k + 2] == x[k + 1]:
        return chord
    a = (secant - (y[k] - y[k - 1]) / (x[k] - x[k - 1])) / (x[k + 1] - x[k - 1])
    b = ((y[k + 2] - y[k + 1]) / (x[k + 2] - x[k + 1]) - secant) / (x[k + 2] - x[k])
    if a * b <= 0:
        return chord
    limit = 3 * min(abs(a), abs(b))
    if _among(corners, x[k]) and _among(corners, x[k + 1]):
        limit = min(limit, abs(secant) / width)
    c = a + (b - a) * (t - x[k - 1]) / (x[k + 2] - x[k - 1])
    return chord + max(-limit, min(limit, c)) * (t - x[k]) * (t - x[k + 1])


def _among(corners: Sequence[float], t: float) -> bool:
    k = bisect_left(corners, t)
    return k < len(corners) and corners[k] == t


def cubic_many(x: np.ndarray, y: np.ndarray, query: np.ndarray, corners: Sequence[float] = ()) -> np.ndarray:
    """`cubic` for an array of any shape; every query within x[0] .. x[-1]."""
    import numpy as np

    width = np.diff(x)
    if len(width) == 0:
        return np.full(query.shape, y[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = np.diff(y) / width
        second = np.diff(secant) / (x[2:] - x[:-2])
        # one value an interval: the differences about its two ends
        a, b = np.append(0.0, second), np.append(second, 0.0)
        limit = 3 * np.minimum(np.abs(a), np.abs(b))
        limit = np.where(np.isfinite(a) & np.isfinite(b) & (a * b > 0), limit, 0.0)
        span = np.append(x[2:], x[-1]) - np.append(x[0], x[:-2])
        third = (b - a) / span[: len(a)] if len(a) > 1 else np.zeros(1)

    k = np.clip(np.searchsorted(x, query, side="right") - 1, 0, len(width) - 1)
    inside = (width[k] > 0) & (query != x[k + 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        from_left = query - x[np.maximum(k - 1, 0)]
        c = np.clip(a[k] + third[k] * from_left, -limit[k], limit[k])
        if len(corners):
            both = np.isin(x[k], corners) & np.isin(x[k + 1], corners)
            steady = np.where(both, abs(secant[k]) / width[k], np.inf)
            c = np.clip(c, -steady, steady)
        value = y[k] + secant[k] * (query - x[k]) + np.nan_to_num(c) * (query - x[k]) * (query - x[k + 1])
    return np.where(inside, value, y[k + 1])
