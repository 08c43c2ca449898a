"""A signal between its points: polynomials, one a segment, through values at Chebyshev's points of the second kind.

    t_j = (a + b)/2 - (b - a)/2 cos(pi j / n),   j = 0 .. n                                             (1)

hold a polynomial of degree n; it is evaluated by the barycentric formula with weights (-1)^j, halved at the ends (Berrut and
Trefethen, SIAM Review 46, 2004, 501), differentiated by the matrix of Trefethen, Spectral Methods in MATLAB, 2000, p. 53, and
integrated by Clenshaw and Curtis. Segments follow each other; where the end of one and the start of the next differ the signal
jumps. A step of an integrator is a segment whose polynomial is the method's own dense output; other tables have one between
neighbouring points, through what `Table.at` gives there.
"""

from __future__ import annotations

from functools import cache

import numpy as np

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

DEGREE = 4  # between two points of a table
ROUNDED = 64 * 2.0**-52  # of the largest value: what differs by less is on the level, as for conditions (engine: conditions.rs)
EQUAL = 1e-9  # of the whole swing: extremes that differ by less are equal


@cache
def nodes(n: int) -> np.ndarray:
    """(1) on 0 .. 1."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(n + 1) / n)


@cache
def _weights(n: int) -> np.ndarray:
    w = (-1.0) ** np.arange(n + 1)
    w[[0, -1]] *= 0.5
    return w


@cache
def slopes(n: int) -> np.ndarray:
    """The matrix that takes values at (1) on 0 .. 1 to derivatives there."""
    t, w = nodes(n), _weights(n)
    with np.errstate(divide="ignore"):
        d = (w[None, :] / w[:, None]) / (t[:, None] - t[None, :])
    d[np.diag_indices(n + 1)] = 0.0
    d[np.diag_indices(n + 1)] = -d.sum(axis=1)
    return d


@cache
def areas(n: int) -> np.ndarray:
    """Weights of the integral over 0 .. 1."""
    k = np.arange(n + 1)
    # moments of Chebyshev's polynomials on 0 .. 1 are 1/(1 - k^2) for even k
    moments = np.where(k % 2 == 0, 1.0 / (1.0 - (k % 2 == 0) * k**2.0), 0.0)
    values = np.cos(np.pi * np.outer(k, k[::-1]) / n)  # T_k at the points
    return np.linalg.solve(values, moments)


@cache
def integrals(n: int) -> np.ndarray:
    """The matrix that takes values at (1) on 0 .. 1 to integrals from 0 to each point."""
    return np.array([t * areas(n) @ resampling(n, t * nodes(n)) for t in nodes(n)])


def between(y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Polynomials with values y (..., n+1) at (1), evaluated at places 0 .. 1 of shape (m,): (..., m)."""
    n = y.shape[-1] - 1
    return y @ resampling(n, at).T


@cache
def _listed(n: int) -> tuple[list[float], list[float]]:
    return nodes(n).tolist(), _weights(n).tolist()


def at_place(y: list[float], place: float) -> float:
    """As `between`, at one place."""
    above = below = 0.0
    for t, w, value in zip(*_listed(len(y) - 1), y, strict=True):
        difference = place - t
        if difference == 0.0:
            return value
        share = w / difference
        above += share * value
        below += share
    return above / below


def resampling(n: int, at: np.ndarray) -> np.ndarray:
    """The matrix (m, n+1) that takes values at (1) to those at other places."""
    difference = np.asarray(at, dtype=float)[:, None] - nodes(n)[None, :]
    same = difference == 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = _weights(n) / difference
        rows = terms / terms.sum(axis=1, keepdims=True)
    hit = same.any(axis=1)
    rows[hit] = same[hit]
    return rows


class Curve:
    """y over x: arrays (segments, n+1), along the axis in the direction in which the table goes."""

    __slots__ = ("down", "n", "x", "y")

    def __init__(self, x: np.ndarray, y: np.ndarray) -> None:
        self.down = bool(x.size and x[-1, -1] < x[0, 0])
        self.x, self.y, self.n = x, y, x.shape[1] - 1

    @property
    def first(self) -> float:
        return float(min(self.x[0, 0], self.x[-1, -1]))

    @property
    def last(self) -> float:
        return float(max(self.x[0, 0], self.x[-1, -1]))

    def _segment(self, t: float) -> int:
        """The one that t lies in, behind a jump at t."""
        starts, sign = self.x[:, 0], -1.0 if self.down else 1.0
        k = int(np.searchsorted(sign * starts, sign * t, side="right")) - 1
        return min(max(k, 0), len(starts) - 1)

    def _place(self, k: int, t: float) -> float:
        """Where in a segment, 0 .. 1."""
        a, b = self.x[k, 0], self.x[k, -1]
        return float(min(max((t - a) / (b - a), 0.0), 1.0)) if b != a else 1.0

    def value(self, t: float) -> float:
        """At t; behind a jump there."""
        k = self._segment(t)
        return at_place(self.y[k].tolist(), self._place(k, t))

    def slope(self, t: float) -> float:
        """dy/dx at t; between two segments that of the one behind it."""
        k = self._segment(t)
        width = self.x[k, -1] - self.x[k, 0]
        if width == 0.0:
            return float("nan")
        return float(at_place((slopes(self.n) @ self.y[k]).tolist(), self._place(k, t)) / width)

    def crossings(self, level: Curve, begin: float, end: float) -> Iterator[tuple[float, int]]:
        """(place, 1 rising or -1 falling) of each time at which y comes to `level` from one side, within begin .. end and in
        the direction of the axis. Touching from below is rising, and staying there is no more than that; what starts on a
        constant level crosses it where it leaves, as in ngspice; what starts on another signal does not."""
        d = self.y - level.y
        size = max(float(np.abs(y[np.isfinite(y)]).max(initial=0.0)) for y in (self.y, level.y))
        d[np.abs(d) <= ROUNDED * size] = 0.0
        flat = d.ravel()
        leaves = int(np.argmax(flat != 0.0))
        if leaves and np.ptp(level.y) == 0.0 and begin <= (t := float(self.x.ravel()[leaves - 1])) <= end:
            yield t, 1 if flat[leaves] > 0 else -1
        before, now = flat[:-1], flat[1:]
        found = np.flatnonzero(((before < 0) & (now >= 0)) | ((before > 0) & (now <= 0)))
        for i in found.tolist():
            k, j = divmod(i, self.n + 1)
            # at the end of a segment: a jump to the next one
            t = float(self.x[k, -1]) if j == self.n else self._root(d, k, j)
            if begin <= t <= end:
                yield t, 1 if flat[i] < 0 else -1

    def touch(self, level: Curve, begin: float, end: float, direction: int) -> float | None:
        """Where y comes to a constant level and turns: its maximum (direction 1), its minimum (-1), either (0). It is how a
        measurement finds the place of an extreme that another one has the value of, to rounding."""
        part = self.cut(begin, end)
        if np.ptp(level.y) == 0.0:
            for sign in (1, -1):
                value, place = part.extreme(sign)
                if direction in (0, sign) and abs(value - level.y.flat[0]) <= EQUAL * np.ptp(part.y):
                    return place
        return None

    def _root(self, d: np.ndarray, k: int, j: int) -> float:
        """Where the polynomial of segment k is zero between two of its points: Illinois' regula falsi."""
        at = nodes(self.n)
        a, b, fa, fb = at[j], at[j + 1], d[k, j], d[k, j + 1]
        width, start = self.x[k, -1] - self.x[k, 0], self.x[k, 0]
        c = last = b
        if not np.isfinite(d[k]).all():  # no polynomial: a straight line, or the point where it has a value
            share = (
                -fa / (fb - fa) if np.isfinite(fa) and np.isfinite(fb) else 1.0 if np.isfinite(fb) else 0.0
            )
            return float(start + (a + share * (b - a)) * width)
        if fb != 0.0:
            values, moved = d[k].tolist(), 0
            for _ in range(80):
                c = b - fb * (b - a) / (fb - fa)
                if not a < c < b:
                    c = 0.5 * (a + b)
                fc = at_place(values, c)
                if fc == 0.0 or abs(c - last) < 4e-16:
                    break
                last = c
                moves = -1 if (fc < 0) == (fa < 0) else 1
                again = 0.5 if moves == moved else 1.0  # the same end twice: the other one counts half
                if moves < 0:
                    a, fa, fb = c, fc, again * fb
                else:
                    b, fb, fa = c, fc, again * fa
                moved = moves
        return float(start + c * width)

    def cut(self, begin: float, end: float) -> Curve:
        """The part within begin .. end, in ascending order."""
        x, y = self.x, self.y
        if self.down:
            x, y = x[::-1, ::-1], y[::-1, ::-1]
        inside = (x[:, -1] > begin) & (x[:, 0] < end)
        if not inside.any():  # a point
            k = int(np.argmin(np.abs(x[:, 0] - begin) + np.abs(x[:, -1] - end)))
            place = np.array([min(max((begin - x[k, 0]) / ((x[k, -1] - x[k, 0]) or 1.0), 0.0), 1.0)])
            value = between(y[k], place)[0]
            return Curve(np.full((1, self.n + 1), begin), np.full((1, self.n + 1), value))
        x, y = x[inside].copy(), y[inside].copy()
        for k in dict.fromkeys((0, len(x) - 1)):
            a, b = x[k, 0], x[k, -1]
            low, high = max(a, begin), min(b, end)
            if (low, high) != (a, b) and b > a:
                places = (low - a) / (b - a) + (high - low) / (b - a) * nodes(self.n)
                y[k] = between(y[k], places)
                x[k] = low + (high - low) * nodes(self.n)
        return Curve(x, y)

    def integral(self, power: int = 1) -> float:
        """Of y^power over all of x, by a rule that is exact for it."""
        n = self.n * power
        y = self.y if power == 1 else between(self.y, nodes(n)) ** power
        return float(np.sum((self.x[:, -1] - self.x[:, 0]) * (y @ areas(n))))

    def extreme(self, sign: float) -> tuple[float, float]:
        """(value, place) of the largest value (sign 1) or the smallest one (-1); of several that are equal the first."""
        y = np.where(np.isnan(self.y), -np.inf, sign * self.y)
        top, swing = y.max(axis=1), np.ptp(y, axis=1)
        best, first = float(top.max()), int(np.argmax(y.ravel()))
        found = [(best, float(self.x.ravel()[first]))]
        # a polynomial may go beyond its values at the points, by less than they lie apart
        near = np.flatnonzero((swing > 0) & (top + swing > best))
        slope = y[near] @ slopes(self.n).T
        turns: list[tuple[float, float]] = []
        for row, j in np.argwhere((slope[:, :-1] > 0) & (slope[:, 1:] <= 0)).tolist():
            k = int(near[row])
            c = _turn(slope[row], j)
            value = at_place(y[k].tolist(), c)
            turns.append((value, float(self.x[k, 0] + c * (self.x[k, -1] - self.x[k, 0]))))
        best = max(value for value, _ in (*found, *turns))
        finite = y[np.isfinite(y)]
        if not np.isfinite(best) or not finite.size:
            return sign * best, found[0][1]
        least = best - EQUAL * (best - float(finite.min()))
        if 0 < first < y.size - 1 and any(value >= least for value, _ in turns):
            found = []  # a point beside the turn
        value, place = next(
            (value, place) for value, place in sorted((*found, *turns), key=lambda f: f[1]) if value >= least
        )
        return sign * max(value, best), place


def _turn(slope: np.ndarray, j: int) -> float:
    """Where a polynomial with these values comes to zero between two points."""
    line = Curve(nodes(len(slope) - 1)[None, :], slope[None, :])
    return line._root(line.y, 0, j)
