"""An element of a BEAM in space: bent about two axes, twisted and stretched; Euler-Bernoulli, corotational.

Of length l0, between nodes p, q whose own axes are t along the beam, n and b the principal axes of its section. e is the
direction of its chord, l long; each node's axes are turned by the shortest way that takes t to e, so that n lies across it:

    n'       n - (e.n)/(1 + c) (t + e),   c = t.e
    A        4 g(v^2)/(1 + s) u,  u = (t - c e)/(1 + c),  s^2 = 1 + u.u,  v^2 = (s - 1)/(s + 1): from the chord to the
             tangent [rad], v = tan(angle/4), g = atan(v)/v as a series
    phi      the angle about e from n' of p to n' of q
    a, b     A of p and of q along the bisector of both n', and across it
    twist    phi + (a x b)/2       what the shortest ways enclose, of a cubic between the slopes
    eps      (l - l0)/l0 + (2 a^2 - a.b + 2 b^2)/30, less what it is at rest; so is M where the beam is an arc
    kappa    a cubic's, in axes that turn with the twist, to second order in phi: its mean M/l0 and its slope S/l0^2 are
             M = m (1 - phi^2/24) + phi J c/2,   S = 6 c + phi J m,   m = b - a,  c = a + b,  J (x, y) = (y, -x)
    V        EA l0 eps^2/2 + GK twist^2/(2 l0) + sum of EI (M^2 + S^2/12)/(2 l0)
The measure of twist is that of discrete elastic rods, M. Bergou et al., ACM Trans. Graphics 27 (2008) 63, refined by a x b.
"""

from __future__ import annotations

from math import sin

from .kinematics import add, cross, dot, scale, subtract

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .base import Scene


def sinc(x: float) -> float:
    """sin(x)/x"""
    return sin(x) / x if x else 1.0


ATAN = (-1.0 / 3.0, 1.0 / 5.0, -1.0 / 7.0, 1.0 / 9.0)


class Rod:
    """`strains`: (word, stiffness, strain), V = sum of stiffness strain^2/2; `moments` about x, y, z in the middle, and the pull:
    (stiffness, strain) of each."""

    def __init__(
        self,
        s: Scene,
        ends: Sequence[Any],
        frames: Sequence[Any],
        rest: tuple[float, float],
        stiffness: Sequence[float],
    ) -> None:
        (ei, ea, _, eiy, gj), (p, q), (l0, bow) = stiffness, ends, rest
        d = subtract(q.pos, p.pos)
        chord = s.b.call("sqrt", s.b.const(0.0) + dot(d, d))
        e = [x / chord for x in d]
        self.chord, self.way = chord, e
        (at_p, n_p), (at_q, n_q) = (self._from_chord(s, frame, e) for frame in frames)
        phi = s.b.call("atan2", s.b.const(0.0) + dot(e, cross(n_p, n_q)), s.b.const(0.0) + dot(n_p, n_q))
        both = add(n_p, n_q)
        middle = scale(1.0 / s.b.call("sqrt", s.b.const(0.0) + dot(both, both)), both)
        axes = (middle, cross(e, middle))
        a, b = ([dot(at, axis) for axis in axes] for at in (at_p, at_q))
        m, c = subtract(b, a), add(a, b)
        even = 1.0 - phi * phi / 24.0
        round_chord = 2.0 * dot(a, a) - dot(a, b) + 2.0 * dot(b, b) - 1.25 * bow * bow
        along = chord / l0 - sinc(0.5 * bow) + round_chord / 30.0
        twist = phi + 0.5 * (a[0] * b[1] - a[1] * b[0])
        self.strains = [("along", ea * l0, along), ("twist", gj / l0, twist)]
        bends = []
        for k, way, stiff in ((0, 1.0, ei), (1, -1.0, eiy)):
            mean = m[k] * even + 0.5 * way * phi * c[1 - k] - (0.0 if k else bow)
            slope = 6.0 * c[k] + way * phi * m[1 - k]
            word = "yz"[k]
            self.strains += [(f"even {word}", stiff / l0, mean), (f"odd {word}", stiff / (12.0 * l0), slope)]
            bends.append((stiff / l0, way * mean))
        self.pull, self.moments = (ea, along), [(gj / l0, twist), bends[1], bends[0]]

    @staticmethod
    def _from_chord(s: Scene, frame: Any, e: Sequence[Any]) -> tuple[list[Any], list[Any]]:
        """A, and n across the chord."""
        t, n = (frame.direction(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        c = dot(t, e)
        size = s.b.call("sqrt", 2.0 / (1.0 + c))  # 1 + u.u = 2/(1 + c)
        v2 = (size - 1.0) / (size + 1.0)
        series: Any = ATAN[-1]
        for term in (*ATAN[-2::-1], 1.0):
            series = series * v2 + term
        bend = 4.0 * series / ((1.0 + size) * (1.0 + c))
        return scale(bend, subtract(t, scale(c, e))), subtract(n, scale(dot(e, n) / (1.0 + c), add(t, e)))
