"""Where two ellipsoids meet in space: one place of CONTACT, which moves over both.

    gap = the largest of  g(n) = n . c - h1(n) - h2(n)  over all normals n,  h(n)^2 = n . S n,  S = sum s_k^2 e_k e_k^T
with c from the middle of B to that of A: how far the planes across n that touch them are apart. g is concave in the ball of all n
where it is above 0, and has one top. Two ways go up to it: Newton's method, near it, and far off it by turns
    the ellipsoid (1 + 1/q) S1 + (1 + q) S2, which holds all sums of places of both: its nearest normal to c (nearest.py)
    q = h1/h2 of that normal, for which it is the smallest where both touch
of which neither ever goes down. Each time the highest is kept. The last step of Newton's method alone is differentiated: g is
flat at its top, so that what n is wrong by counts squared.
"""

from __future__ import annotations

from .kinematics import add, cross, dot, scale, subtract
from .nearest import NOTHING, View, largest, meeting

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Meeting, Part

    Way = Sequence[Scalar]
    Matrix = Sequence[Way]  # symmetric


class Eggs:
    """Both in the axes of B."""

    def __init__(self, s: Scene, a: View, b: View) -> None:
        self.s, self.c = s, b.local(a.centre)
        axes = [b.turned(axis) for axis in a.axes]
        first, second = (self._squares(view) for view in (a, b))
        parts = [[[v * x for x in axis] for v in axis] for axis in axes]
        self.one = [
            [sum((q * p[i][j] for q, p in zip(first, parts, strict=True)), s.b.const(0.0)) for j in range(3)]
            for i in range(3)
        ]
        self.other = [[second[i] if i == j else 0.0 for j in range(3)] for i in range(3)]
        self.least, self.size = max(min(first), min(second)), (max(first) + max(second)) ** 0.5

    @staticmethod
    def _squares(view: View) -> list[float]:
        return [half * half for half in view.solid.semi or ()]

    def unit(self, v: Way) -> Way:
        return scale(1.0 / self.s.b.call("sqrt", self.s.b.const(NOTHING * NOTHING) + dot(v, v)), v)

    def reach(self, m: Matrix, n: Way) -> Expr:
        return self.s.b.call("sqrt", self.s.b.const(NOTHING * NOTHING) + dot(n, _times(m, n)))

    def gap(self, n: Way) -> Expr:
        return dot(n, self.c) - self.reach(self.one, n) - self.reach(self.other, n)

    def newton(self, n: Way) -> Way:
        """Across n: (g'' - g) d = g n - g', where n is no more than 1 long."""
        slope, bends = self.c, [[0.0] * 3 for _ in range(3)]
        for m in (self.one, self.other):
            reach, mn = self.reach(m, n), _times(m, n)
            slope = subtract(slope, scale(1.0 / reach, mn))  # type: ignore[assignment]
            bends = [
                [bends[i][j] + (m[i][j] - mn[i] * mn[j] / (reach * reach)) / reach for j in range(3)]  # type: ignore[misc]
                for i in range(3)
            ]
        high = dot(n, slope)
        # along n anything: there nothing is asked
        whole = [
            [bends[i][j] + float(i == j) * high + self.size * n[i] * n[j] for j in range(3)] for i in range(3)
        ]
        return self.unit(add(n, _solved(whole, subtract(slope, scale(high, n)))))

    def turn(self, n: Way) -> Way:
        """The nearest normal of the ellipsoid of all sums that touches at n, by a step of Newton's method."""
        q = self.reach(self.one, n) / self.reach(self.other, n)
        m = [
            [(1.0 + 1.0 / q) * u + (1.0 + q) * v for u, v in zip(*rows, strict=True)]
            for rows in zip(self.one, self.other, strict=True)
        ]
        below = self.reach(m, self.c) - (m[0][0] + m[1][1] + m[2][2])
        t = largest(self.s, [below, self.gap(n) * self.reach(m, n), -0.5 * self.least])
        z = _solved(_plus(m, t), self.c)
        mz = _times(m, z)
        square = dot(z, mz)
        t = t + square * (self.s.b.call("sqrt", square) - 1.0) / dot(mz, _solved(_plus(m, t), z))
        return self.unit(_solved(_plus(m, largest(self.s, [t, -0.5 * self.least])), self.c))

    def higher(self, n: Way, others: Sequence[Way]) -> Way:
        best = self.gap(n)
        for other in others:
            high = self.gap(other)
            more = self.s.b.call("notless", best, high)
            n = [self.s.b.select(more, u, v) for u, v in zip(n, other, strict=True)]
            best = self.s.b.select(more, best, high)
        return n


def _times(m: Matrix, v: Way) -> list[Expr]:
    return [dot(row, v) for row in m]  # type: ignore[misc]


def _plus(m: Matrix, t: Scalar) -> Matrix:
    return [[c + t if i == j else c for j, c in enumerate(row)] for i, row in enumerate(m)]


def _solved(m: Matrix, v: Way) -> Way:
    """m^-1 v, m symmetric and definite: by its rows' cross products."""
    a, b, c = m
    columns = cross(b, c), cross(c, a), cross(a, b)
    whole = 1.0 / dot(a, columns[0])
    found: Way = (0.0, 0.0, 0.0)
    for part, column in zip(v, columns, strict=True):
        found = add(found, scale(part * whole, column))
    return found


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """The one place at which two ellipsoids can touch."""
    one, other = View(s, a, own=True), View(s, b, own=True)
    eggs = Eggs(s, one, other)
    n = eggs.unit(eggs.c)
    # to rounding for half-axes up to 10 to 1
    for _ in range(10):
        turned = eggs.turn(n)
        n = eggs.higher(n, [turned, eggs.newton(n), eggs.newton(turned)])
    # numbers without a slope, from which one step goes all the way
    n = eggs.newton([s.b.call("round", c / 1e-12) * 1e-12 for c in n])
    foot = subtract(eggs.c, scale(1.0 / eggs.reach(eggs.one, n), _times(eggs.one, n)))
    label = f"{one.name} {other.name}"
    return [meeting(one, other, label, eggs.gap(n), other.world(n), other.placed(foot), None)]
