"""Lines with losses. With r, l, g, c of a length, voltage and current along the line follow

    -dv/dx = r i + l di/dt        -di/dx = g v + c dv/dt

What its two ends have in common sees half the line with an open end, what is opposite sees half the line with a short. With
T = len sqrt(l c) the delay, y = sqrt(c/l), a = r/l, b = g/c, m = (a + b)/2, d = (a - b)/2 and w = sqrt((s + m)^2 - d^2):

    cosh(w T/2) (i1 + i2)   = y (s + b) sinh(w T/2)/w (v1 + v2)
    y cosh(w T/2) (v1 - v2) =   (s + a) sinh(w T/2)/w (i1 - i2)                                             (1)

cosh and sinh/w are entire functions of w^2. So, times 2 exp(-(s + m) T/2), both are delays by T and integrals over the last T,
nothing older (from Sonine's integral of J0; h = sqrt(t (T - t))):

    2 exp(..) sinh(w T/2)/w = int_0^T exp(-s t) exp(-m t) J0(d h) dt
    2 exp(..) cosh(w T/2)   = 1 + exp(-m T) exp(-s T) - int_0^T exp(-s t) exp(-m t) d (T/2) J1(d h)/h dt    (2)

The kernels behind exp(-m t) are smooth: a few Legendre polynomials P_j(2 t/T - 1) are as exact as numbers are. Their integrals
over the last T are states, by the recurrence of Legendre's polynomials:

    q_j = 1/T int_0^T P_j exp(-m t) x(now - t) dt
    T q_0' =  x - exp(-m T) x(now - T) - m T q_0
    T q_1' = -x - exp(-m T) x(now - T) - m T q_1 + 2 q_0
    T (q_{j+1} - q_{j-1})' = 2 (2 j + 1) q_j - m T (q_{j+1} - q_{j-1})                                     (3)

The operating point is exact. A line of great loss is cut into equal ones, since (1) is exp(d T/2) times smaller than its terms
there. (Convolution with the impulse responses of an endless line, Roychowdhury and Pederson 1991, remembers everything since the
start, and its tails fall as slowly as t^(-1/2).)

Without l there is no delay. With z = r len (s c + g) len the partial fractions

    i1 + i2 = 1/(r len)      sum_{k odd}  4 z/(z + k^2 pi^2)  (v1 + v2)
    i1 - i2 = 1/(r len) [2 + sum_{k even} 4 z/(z + k^2 pi^2)] (v1 - v2)

are resistors with capacitors behind them. Of the slow ones each has its own; the fast ones are Gauss quadratures of the sum with
positive weights, over stretches of k. Without l and c it is a network of three resistors.
"""

from __future__ import annotations

import cmath
import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from .contract import Circuit, Expr

    Pair = tuple[Expr, Expr]

SMALL, FAR = 1e-4, 20.0  # nepers of half a line: tanh(x)/x by its series, tanh(x) is 1
LOSS = 8.0  # |d| T of one piece at most
PIECES = 64  # and so many at most
NODES = 48  # of the quadrature for coefficients
SHARE = 1e-12  # of the largest coefficient: less is left out
FIRST, RATIO, LAST = 6, 3, 6  # terms that stand alone; a stretch of k; so many stretches


class Mode:
    """A line of several that do not know of each other: u = of_voltage . v and j = of_current . i for it, v and i of the
    conductors; back, i = of_voltage j and v = of_current u."""

    def __init__(self, line: Telegraph, of_voltage: list[float], of_current: list[float]) -> None:
        self.line, self.of_voltage, self.of_current = line, of_voltage, of_current

    def voltage(self, v: list[Expr]) -> Expr:
        return _sum(self.of_voltage, v)

    def current(self, i: list[Expr]) -> Expr:
        return _sum(self.of_current, i)


def _sum(factors: list[float], of: list[Expr]) -> Expr:
    if factors == [1.0]:
        return of[0]
    first, *rest = (factor * one for factor, one in zip(factors, of, strict=True))
    return sum(rest, first)


class Telegraph:
    """A uniform line between two pairs of terminals: r [Ohm], l [H], g [S], c [F] of a length, `length`."""

    def __init__(self, r: float, l: float, g: float, c: float, length: float) -> None:  # noqa: E741
        self.r, self.l, self.g, self.c = r * length, l * length, g * length, c * length

    def trouble(self) -> str:
        """Why this is no line; empty where it is one."""
        if min(self.r, self.l, self.g, self.c) < 0.0:
            return "r, l, g, c and the length must not be negative"
        if self.l > 0.0:
            if not self.c > 0.0:
                return "has l but no c: it would be without end as fast"
            if self.pieces > PIECES:
                return f"has so much loss that it is a line of r and c: nothing is left of a front, {self.loss:.3g} nepers down"
            return ""
        return "" if self.r > 0.0 else "has neither r nor l: its two ends would be one"

    # ---- small signals, exactly ----

    def admittances(self, s: complex, by: Sequence[float] | None = None) -> tuple[complex, complex]:
        """Of (1) at s [rad/s]: (i1 + i2)/(v1 + v2) and (i1 - i2)/(v1 - v2) [S]; or how they change where `by` is what r, l, g, c
        of all of the line change."""
        along, across = s * self.l + self.r, s * self.c + self.g
        if along == 0.0:
            return (0.5 * across, complex(math.inf)) if by is None else (0.5 * (s * by[3] + by[2]), 0j)
        z = along * across
        half = cmath.sqrt(z) / 2.0
        shape: complex
        bend: complex  # d shape/d z
        if abs(half) < SMALL:
            shape, bend = 1.0 - z / 12.0, -1.0 / 12.0
        else:
            tanh = 1.0 + 0j if half.real > FAR else cmath.tanh(half)
            shape = tanh / half
            bend = (1.0 - tanh * tanh - shape) / (2.0 * z)
        if by is None:
            return 0.5 * across * shape, 2.0 / (along * shape)
        d_along, d_across = s * by[1] + by[0], s * by[3] + by[2]
        d_shape = bend * (d_along * across + along * d_across)
        return (
            0.5 * (d_across * shape + across * d_shape),
            -2.0 * (d_along * shape + along * d_shape) / (along * shape) ** 2,
        )

    # ---- equation (1) ----

    @property
    def loss(self) -> float:
        """|d| T."""
        return 0.5 * abs(self.r * math.sqrt(self.c / self.l) - self.g * math.sqrt(self.l / self.c))

    @property
    def pieces(self) -> int:
        return max(1, math.ceil(self.loss / LOSS)) if self.l > 0.0 else 1

    def rows(
        self, ctx: Circuit, name: str, v: Pair, i: Pair, initial: Sequence[float] = (0.0, 0.0, 0.0, 0.0)
    ) -> Pair:
        """What is zero [A], for a row each of the currents i into the first terminals; v between the terminals of either end;
        initial: v1, i1, v2, i2 before a start from given values."""
        if self.l > 0.0:
            return self._late(ctx, name, v, i, initial)
        common, opposite = (v[0] + v[1]) * 0.5, (v[0] - v[1]) * 0.5
        at_start = (0.5 * (initial[0] + initial[2]), 0.5 * (initial[0] - initial[2]))
        if self.c > 0.0:
            sums = [
                self._fractions(ctx, f"{name}#common", common, at_start[0], 1),
                self._fractions(ctx, f"{name}#opposite", opposite, at_start[1], 2),
            ]
        else:
            both = self.admittances(0.0)
            sums = [both[0].real * common, (both[1].real - 2.0 / self.r) * opposite]
        along = (2.0 / self.r) * opposite
        return sums[0] + sums[1] + along - i[0], sums[0] - sums[1] - along - i[1]

    def _fractions(self, ctx: Circuit, name: str, x: Expr, at: float, first: int) -> Expr:
        """The sum over k = first, first + 2, .. for the voltage x, `at` before the start."""
        b, total = ctx.b, None
        for j, (k, weight) in enumerate(stretches(first)):
            conductance, slow = 4.0 / self.r * weight, (k * math.pi) ** 2 / self.r
            q = b.unknown(
                f"{name}{j}", "branch", "A", conductance * at
            )  # what the capacitor has, as a current
            b.c(q, q, self.c / slow)
            b.add_f(q, (1.0 + self.g / slow) * b.x(q) - conductance * x)
            part = conductance * x - b.x(q)
            total = part if total is None else total + part
        assert total is not None
        return total

    def _late(self, ctx: Circuit, name: str, v: Pair, i: Pair, initial: Sequence[float]) -> Pair:
        """Equal pieces in a row; between two of them a voltage, and the current into the end of the first."""
        b, pieces = ctx.b, self.pieces
        piece = Piece(self.r / pieces, self.l / pieces, self.g / pieces, self.c / pieces)
        v1, i1, at_v, at_i = v[0], i[0], initial[0], initial[1]
        between: list[int] = []
        rows: list[Expr] = []
        for k in range(1, pieces + 1):
            share = k / pieces
            v_next = initial[0] + share * (initial[2] - initial[0])
            i_next = -initial[1] + share * (initial[3] + initial[1])
            v2, i2, named = v[1], i[1], name
            if pieces > 1:
                named = f"{name}#{k}"
            if k < pieces:
                between += [
                    b.unknown(f"{named}#v", "node", "V", v_next),
                    b.unknown(f"{named}#i", "branch", "A", i_next),
                ]
                v2, i2 = b.x(between[-2]), b.x(between[-1])
            rows += piece.rows(ctx, named, (v1, v2), (i1, i2), (at_v, at_i, v_next, i_next))
            v1, i1, at_v, at_i = v2, -i2, v_next, -i_next
        for unknown, row in zip(between, rows[1:-1], strict=True):
            b.add_f(unknown, row)
        return rows[0], rows[-1]


class Piece:
    """A line with a delay, by (1) to (3); r, l, g, c are those of all of it."""

    def __init__(self, r: float, l: float, g: float, c: float) -> None:  # noqa: E741
        import numpy as np

        self.delay, self.y = math.sqrt(l * c), math.sqrt(c / l)
        self.m, d = 0.5 * (r / l + g / c) * self.delay, 0.5 * (r / l - g / c) * self.delay  # of T
        self.left = math.exp(-self.m)
        y, weights = np.polynomial.legendre.leggauss(NODES)
        square = 0.25 * d * d * (1.0 - y * y)
        j0, bend = bessel(square, 0), 0.25 * d * d * bessel(square, 1)
        basis = legendre(NODES, y)

        def series(kernel: np.ndarray) -> list[float]:
            terms = (np.arange(NODES) + 0.5) * (basis @ (weights * kernel))
            terms[np.abs(terms) <= SHARE * np.abs(terms).max()] = 0.0
            return np.trim_zeros(terms, "b").tolist() if d else []

        self.both = series(-bend)  # behind cosh
        self.even = series(-d * j0 + y * bend)  # behind (s + b) sinh/w
        self.odd = series(d * j0 + y * bend)
        self.past = (0.5 * basis @ (weights * np.exp(-0.5 * self.m * (1.0 + y)))).tolist()  # q_j of 1

    def rows(self, ctx: Circuit, name: str, v: Pair, i: Pair, initial: Sequence[float]) -> Pair:
        y = self.y
        v1, i1, v2, i2 = initial
        terms = [
            self._seen(ctx, f"{name}#{word}", x, at, sign, kernel)
            for word, x, at, sign, kernel in (
                ("i+", i[0] + i[1], i1 + i2, 1.0, self.both), ("v+", y * (v[0] + v[1]), y * (v1 + v2), -1.0, self.even),
                ("v-", y * (v[0] - v[1]), y * (v1 - v2), 1.0, self.both), ("i-", i[0] - i[1], i1 - i2, -1.0, self.odd),
            )
        ]  # fmt: skip
        return terms[0] - terms[1], terms[2] - terms[3]

    def _seen(self, ctx: Circuit, name: str, x: Expr, at: float, sign: float, kernel: list[float]) -> Expr:
        """x + sign exp(-m T) x(now - T) + 1/T int kernel exp(-m t) x(now - t) dt."""
        b, m, left = ctx.b, self.m, self.left * ctx.delay(x, self.delay, name, at)
        found = x + sign * left
        # q_j times its share in the kernel: what is not q_j, at rest (2 (2 j + 1)/m)^j times a rounding, comes to nothing in that
        largest = max(map(abs, kernel), default=1.0)
        share = [max(map(abs, kernel[j:])) / largest for j in range(len(kernel))]
        q = [b.unknown(f"{name}{j}", "branch", "A", at * s * self.past[j]) for j, s in enumerate(share)]
        for j, (k, weight) in enumerate(zip(q, kernel, strict=True)):
            if weight:
                found = found + weight / share[j] * b.x(k)
            b.c(k, k, self.delay)
            b.g(k, k, m)
            if j == 0:
                b.add_f(k, left - x)
            elif j == 1:
                b.add_f(k, share[1] * (left + x))
                b.g(k, q[0], -2.0 * share[1])
            else:
                b.c(k, q[j - 2], -self.delay * share[j] / share[j - 2])
                b.g(k, q[j - 2], -m * share[j] / share[j - 2])
                b.g(k, q[j - 1], -2.0 * (2 * j - 1) * share[j] / share[j - 1])
        return found


def legendre(count: int, y: np.ndarray) -> np.ndarray:
    """P_0 .. of `count` at y, a row each."""
    import numpy as np

    rows = [np.ones_like(y), y]
    for j in range(1, count - 1):
        rows.append(((2 * j + 1) * y * rows[j] - j * rows[j - 1]) / (j + 1))
    return np.array(rows[:count])


def bessel(square: np.ndarray, order: int) -> np.ndarray:
    """J_order(x)/(x/2)^order of x^2, by its series."""
    import numpy as np

    term = np.full_like(square, 1.0 / math.factorial(order))
    total, k = term.copy(), 1
    while np.abs(term).max() > 1e-18:
        term = term * (-0.25 * square / (k * (k + order)))
        total, k = total + term, k + 1
    return total


def stretches(first: int) -> list[tuple[float, float]]:
    """(k, weight) in place of k = first, first + 2, .. each with weight 1: the first FIRST themselves, then quadratures of FIRST
    nodes, exact for polynomials of k, over stretches that end RATIO times as far as they begin; what is behind the last by
    its sum of 1/k^2."""
    import numpy as np

    found = [(float(first + 2 * j), 1.0) for j in range(FIRST)]
    begin = FIRST
    for _ in range(LAST):
        count = (RATIO - 1) * begin
        # Gauss's quadrature for equal weights at 0, 1, .. count - 1: eigenvalues of the recurrence of Gram's polynomials
        j = np.arange(1, FIRST)
        side = np.sqrt(j**2 * (count**2 - j**2) / (4.0 * (4.0 * j**2 - 1.0)))
        at, vectors = np.linalg.eigh(
            np.diag(np.full(FIRST, 0.5 * (count - 1))) + np.diag(side, 1) + np.diag(side, -1)
        )
        weights = count * vectors[0] ** 2
        found += [(first + 2.0 * (begin + float(x)), float(w)) for x, w in zip(at, weights, strict=True)]
        begin *= RATIO
    whole = math.pi**2 / (8.0 if first == 1 else 24.0)
    left = whole - math.fsum(w / k**2 for k, w in found)
    last = 2.0 * RATIO * begin
    return [*found, (last, left * last**2)]
