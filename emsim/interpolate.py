"""Values between recorded points: a cubic through four points that turns straight beside a kink.

Between x1 and x2, with the second divided differences a = y[x0,x1,x2] and b = y[x1,x2,x3],

    y(t) = chord(t) + c(t) (t - x1)(t - x2),    c(t) = a + (b - a) (t - x0)/(x3 - x0)          (1)

is the cubic through the four points: fourth order where the signal is smooth, third at inflections. Where an edge
that nobody told of lies beside the interval one of a, b is large and says nothing about it, so |c| is held to three
times the smaller of the two, and c = 0 where they differ in sign (an inflection, or an edge within one step). There is
no overshoot beside an edge, and straight edges stay straight. Limiting divided differences is Harten's ENO idea
(J. Comput. Phys. 71, 1987, 231).

Over the ends of the run, a jump (two points with one x, or nearly) and `corners`, times at which the run knows that
signals may bend, nothing is learnt from the other side: (1) is then the cubic through four points of this side, with
the second divided differences about its two inner points and the same limits. Where this side has but three points
|c| is held to |chord'|/(x2 - x1), beyond which y(t) turns back; so it is between two corners, for the low of a pulse
that one step takes has an edge for each neighbour, a parabola to four points. At a jump the later value holds.

The rule stands here twice: `cubic` for tables on the command line, which must not wait for numpy, and
`cubic_many` for arrays. A test holds them together.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np


# neighbours so much closer together than to the next point are two sides of a jump
JUMP = 1e-6


def cubic(x: Sequence[float], y: Sequence[float], t: float, corners: Sequence[float] = ()) -> float:
    """Value at t, x[0] <= t <= x[-1]; x ascending, repeated where y jumps; corners ascending."""
    last = len(x) - 1
    k = min(bisect_right(x, t) - 1, last - 1)
    if k < 0 or t == x[k + 1]:
        return y[k + 1]
    width = x[k + 1] - x[k]
    secant = (y[k + 1] - y[k]) / width
    chord = y[k] + secant * (t - x[k])
    a, b = _bend(x, y, k, corners), _bend(x, y, k + 1, corners)
    few = a is None and b is None
    if few:  # what the other sides of two corners tell is better than nothing
        a, b = _bend(x, y, k), _bend(x, y, k + 1)
        if a is None or b is None:
            return chord
    if a is None and b is not None:
        far = _bend(x, y, k + 2, corners)
        few, near, other = far is None, b, b if far is None else far
        c = near + (other - near) * (t - x[k + 2]) / (x[min(k + 3, last)] - x[k])
    elif b is None and a is not None:
        far = _bend(x, y, k - 1, corners)
        few, near, other = far is None, a, a if far is None else far
        c = near + (near - other) * (t - x[k - 1]) / (x[k + 1] - x[max(k - 2, 0)])
    elif a is not None and b is not None:
        near, other = a, b
        c = near + (other - near) * (t - x[k - 1]) / (x[k + 2] - x[k - 1])
    if near * other <= 0:
        return chord
    limit = 3 * min(abs(near), abs(other))
    if few:
        limit = min(limit, abs(secant) / width)
    return chord + max(-limit, min(limit, c)) * (t - x[k]) * (t - x[k + 1])


def _bend(x: Sequence[float], y: Sequence[float], k: int, corners: Sequence[float] = ()) -> float | None:
    """The second divided difference about point k; None where there is none."""
    if not 0 < k < len(x) - 1:
        return None
    left, right = x[k] - x[k - 1], x[k + 1] - x[k]
    if left <= JUMP * right or right <= JUMP * left or (corners and _among(corners, x[k])):
        return None
    return ((y[k + 1] - y[k]) / right - (y[k] - y[k - 1]) / left) / (x[k + 1] - x[k - 1])


def _among(corners: Sequence[float], t: float) -> bool:
    k = bisect_left(corners, t)
    return k < len(corners) and corners[k] == t


def cubic_many(x: np.ndarray, y: np.ndarray, query: np.ndarray, corners: Sequence[float] = ()) -> np.ndarray:
    """`cubic` for an array of any shape; every query within x[0] .. x[-1]."""
    import numpy as np

    last = len(x) - 1
    if last == 0:
        return np.full(query.shape, y[0])
    width = np.diff(x)
    bend = np.full(len(x), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = np.diff(y) / width
        jump = np.minimum(width[1:], width[:-1]) <= JUMP * np.maximum(width[1:], width[:-1])
        bend[1:-1] = np.where(jump, np.nan, np.diff(secant) / (x[2:] - x[:-2]))
    known = np.where(np.isin(x, corners), np.nan, bend) if len(corners) else bend

    k = np.clip(np.searchsorted(x, query, side="right") - 1, 0, last - 1)
    inside = (width[k] > 0) & (query != x[k + 1])
    before, after, behind = np.maximum(k - 1, 0), np.minimum(k + 2, last), np.minimum(k + 3, last)
    a, b = known[k], known[k + 1]
    few = np.isnan(a) & np.isnan(b)
    a, b = np.where(few, bend[k], a), np.where(few, bend[k + 1], b)
    straight = few & np.isnan(a + b)
    # from the point where c(t) is `near`, to the divided difference `other`
    left, right = np.isnan(b), np.isnan(a)
    far = np.where(left, known[before], known[after])
    one = left | right
    few |= one & np.isnan(far)
    near = np.where(right, b, a)
    other = np.where(one, np.where(np.isnan(far), near, far), b)
    begin = x[np.where(right, after, before)]
    span = np.where(
        right, x[behind] - x[k], np.where(left, x[k + 1] - x[np.maximum(k - 2, 0)], x[after] - x[before])
    )
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        c = near + np.where(left, near - other, other - near) * (query - begin) / span
        limit = np.where((near * other > 0) & ~straight, 3 * np.minimum(abs(near), abs(other)), 0.0)
        limit = np.where(few, np.minimum(limit, abs(secant[k]) / width[k]), limit)
        c = np.where(limit > 0, np.clip(c, -limit, limit), 0.0)
        value = y[k] + secant[k] * (query - x[k]) + c * (query - x[k]) * (query - x[k + 1])
    return np.where(inside, value, y[k + 1])
