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

The rule itself is `engine/src/interpolate.rs`.
"""

from __future__ import annotations

from struct import pack

from ._engine import interpolated

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np


def doubles(values: Sequence[float]) -> bytes:
    """Numbers as the engine has them: float64, in native order."""
    return pack(f"{len(values)}d", *values)


def cubic_many(x: np.ndarray, y: np.ndarray, query: np.ndarray, corners: Sequence[float] = ()) -> np.ndarray:
    """Values at places of any shape, within x[0] .. x[-1]; x ascending, repeated where y jumps; corners ascending."""
    import numpy as np

    x, y, at = (np.asarray(v, dtype=float) for v in (x, y, query))
    found = interpolated(x.tobytes(), y.tobytes(), at.tobytes(), np.asarray(corners, dtype=float).tobytes())
    return np.frombuffer(found).reshape(at.shape).copy()
