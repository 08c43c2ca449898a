"""Magnetic cores with hysteresis, as `K` lines name them: one field strength H, one flux density B, windings by turns.

    H l + B gap/mu0 = sum N i,   v = N e,   d/dt (A B) = e,   B = mu0 (H + M),   He = H + alpha M
    M = c Man(He) + sum w_k Man(h_k)           Man = ms F(He/a), F(x) = x/(1 + |x|) or Langevin's coth x - 1/x

Every h_k is a reversible field that lags behind He; what it loses and keeps follows from it, whatever the law:

    power lost    mu0 A l sum w_k (He - h_k) d/dt Man(h_k) >= 0
    energy held   A l mu0 (H^2/2 - alpha M^2/2 + c S(He) + sum w_k S(h_k)) + A gap B^2/2mu0,   S(h) = int h dMan

law=play  cells with pinning fields kappa_k (Bergqvist 1997): h_k stays while |He - h_k| < kappa_k, and is He -+ kappa_k where
          it is pulled. That is friction: set-valued, and independent of rate. The kappa_k are the means of `cells` equally
          likely parts of an exponential distribution of mean k.
law=ja    one h (Jiles and Atherton 1986): d Man(h) = |Man(He) - Man(h)|/k |dHe| where He goes away from h, else none, so
          that nothing is ever gained. Its largest loop is that of infinitely many play cells.

The law changes with the sign of e, which is that of dHe/dt: an event, there alone h_k turn. Between two events h_k is a function
of He and of what it was at the first (a memory); operating points move along the same functions from where they were.
"""

from __future__ import annotations

import math
from itertools import pairwise

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .contract import Circuit, Expr

    Scalar = Expr | float

MU0 = 4e-7 * math.pi
NEAR = 0.3  # below that Langevin's function is its series: coth x - 1/x loses digits
# panels of int e^-t Man(He - k t) dt, and Gauss-Legendre's rule in each
PANELS = (0.0, 0.5, 1.0, 2.0, 3.5, 5.5, 8.0, 12.0, 18.0, 26.0, 38.0)
GAUSS = (
    (0.1834346424956498, 0.3626837833783620), (0.5255324099163290, 0.3137066458778873),
    (0.7966664774136267, 0.2223810344533745), (0.9602898564975363, 0.1012285362903763),
)  # fmt: skip
LANGEVIN = (1 / 3, -1 / 45, 2 / 945, -1 / 4725, 2 / 93555, -1382 / 638512875, 4 / 18243225)
STILL = 1e-12  # induced voltages [V per turn] that are no change of direction


def lagged(f: Callable[[Any], Any], exp: Callable[[Any], Any], ends: Sequence[Any]) -> Any:
    """int e^-t f(t) dt over panels between these ends."""
    total: Any = 0.0
    for p, q in pairwise(ends):
        for node, weight in GAUSS:
            for at in (node, -node):
                t = 0.5 * (p + q) + (0.5 * at) * (q - p)
                total = total + (0.5 * weight) * (q - p) * exp(-t) * f(t)
    return total


class Shape:
    """F(x), its slope, and s(x) = int x dF, as expressions."""

    slope_at_0 = 1.0

    def __init__(self, b: Any) -> None:
        self.b = b

    def value(self, x: Expr) -> Expr:
        return x / (1.0 + self.b.call("abs", x))

    def slope(self, x: Expr) -> Expr:
        d = 1.0 + self.b.call("abs", x)
        return 1.0 / (d * d)

    def stored(self, x: Expr) -> Expr:
        size = self.b.call("abs", x)
        return self.b.call("log", 1.0 + size) - size / (1.0 + size)

    @staticmethod
    def number(x: float) -> float:
        return x / (1.0 + abs(x))


class Langevin(Shape):
    slope_at_0 = 1 / 3

    def _near(self, x: Expr) -> tuple[Expr, Expr]:
        """(0 where the series holds, x where it does not)"""
        far = self.b.call("floor", self.b.call("abs", x) * (1.0 / NEAR))
        return far, self.b.select(far, x, 1.0)

    def _series(self, x: Expr, coefficients: Sequence[float]) -> Expr:
        square, sum_ = x * x, self.b.const(0.0)
        for c in reversed(coefficients):
            sum_ = sum_ * square + c
        return sum_

    def value(self, x: Expr) -> Expr:
        far, y = self._near(x)
        return self.b.select(far, 1.0 / self.b.call("tanh", y) - 1.0 / y, x * self._series(x, LANGEVIN))

    def slope(self, x: Expr) -> Expr:
        far, y = self._near(x)
        coth = 1.0 / self.b.call("tanh", y)
        series = self._series(x, [(2 * k + 1) * c for k, c in enumerate(LANGEVIN)])
        return self.b.select(far, 1.0 - coth * coth + 1.0 / (y * y), series)

    def stored(self, x: Expr) -> Expr:
        far, y = self._near(x)
        size = self.b.call("abs", y)
        # ln(sinh(y)/y)
        log = size + self.b.call("log", (1.0 - self.b.call("exp", -2.0 * size)) / (2.0 * size))
        series = [c * (2 * k + 1) / (2 * k + 2) for k, c in enumerate(LANGEVIN)]
        return self.b.select(far, y * self.value(x) - log, x * x * self._series(x, series))

    @staticmethod
    def number(x: float) -> float:
        if abs(x) < NEAR:
            return sum(c * x ** (2 * k + 1) for k, c in enumerate(LANGEVIN))
        return 1.0 / math.tanh(x) - 1.0 / x


SHAPES = {"froehlich": Shape, "langevin": Langevin}


class Material:
    """The numbers of a .model, in SI units."""

    def __init__(self, p: dict[str, Any]) -> None:
        self.area = 1e-4 * float(p.get("area", 0.1)) * float(p.get("pack", 1.0))  # m^2
        self.path = 1e-2 * float(p.get("path", 1.0))  # m
        self.gap = 1e-2 * float(p.get("gap", 0.0))
        self.ms, self.a, self.k = (float(p.get(*d)) for d in (("ms", 1e6), ("a", 1e3), ("k", 500.0)))
        self.c, self.alpha = float(p.get("c", 0.2)), float(p.get("alpha", 0.0))
        self.law, self.shape = p.get("law", "ja"), SHAPES[p.get("shape", "froehlich")]
        self.cells = float(p.get("cells", 8.0))
        if self.k == 0.0:
            self.c = 1.0

    def wrong(self) -> tuple[str, str] | None:
        """(parameter, what is wrong with it)"""
        for key in ("area", "path", "ms", "a"):
            if not getattr(self, key) > 0.0:
                return key, "must be above 0"
        for key in ("gap", "k", "alpha"):
            if getattr(self, key) < 0.0:
                return key, "must not be below 0"
        if not 0.0 <= self.c <= 1.0:
            return "c", "is the reversible part of the magnetisation, from 0 to 1"
        if self.cells != round(self.cells) or not 1.0 <= self.cells <= 100.0:
            return "cells", "is a whole number from 1 to 100"
        if (rise := self.alpha * self.ms * self.shape.slope_at_0 / self.a) >= 1.0:
            said = f"makes {rise:.3g} of alpha dMan/dHe at 0: from 1 on a core magnetises itself, and no loop goes through 0"
            return "alpha", said
        return None

    def pinning(self) -> list[tuple[float, float]]:
        """(kappa [A/m], share of M) of the play cells: means of equally likely parts of an exponential distribution."""
        n = round(self.cells)

        def rest(p: float) -> float:  # int over the last p of it, kappa in means
            return p * (1.0 - math.log(p)) if p > 0.0 else 0.0

        means = [n * (rest(1.0 - j / n) - rest(1.0 - (j + 1) / n)) for j in range(n)]
        return [(self.k * mean, (1.0 - self.c) / n) for mean in means]

    def man(self, h: float) -> float:
        return self.ms * self.shape.number(h / self.a)

    def at_rest(self, b0: float) -> tuple[float, list[float]] | None:
        """(He, h_k) where no current flows and B is b0, as a field has left it that was taken away; None where the core keeps
        no such B."""
        field = -b0 * self.gap / (MU0 * self.path)
        m = b0 / MU0 - field
        he = field + self.alpha * m
        if b0 == 0.0:
            return 0.0, [0.0] * (round(self.cells) if self.law == "play" else 1)
        cells = self.pinning() if self.law == "play" else [(math.inf, 1.0 - self.c)]

        def left(x: float) -> list[float]:
            return [min(max(x, he - kappa), he + kappa) for kappa, _ in cells]

        def excess(x: float) -> float:
            of_cells = sum(w * self.man(h) for (_, w), h in zip(cells, left(x), strict=True))
            return (self.c * self.man(he) + of_cells - m) * math.copysign(1.0, b0)

        low, high = 0.0, math.copysign(1e4 * (self.a + self.k) + abs(he), b0)
        if excess(high) < 0.0 or self.c == 1.0:
            return None
        if self.law == "ja":
            side = math.copysign(1.0, b0)
            most = lagged(lambda t: self.man(side * he + self.k * t), math.exp, PANELS)
            if abs(m - self.c * self.man(he)) > (1.0 - self.c) * most:
                return None
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if excess(middle) > 0.0 else (middle, high)
        return he, left(high)

    def remanence(self) -> float:
        """The largest B that stays without a current [T]."""
        low, high = 0.0, MU0 * self.ms
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.at_rest(middle) is None else (middle, high)
        return low


class Core:
    """A core in its circuit: its unknowns and rows, once it has been wound."""

    def __init__(
        self,
        ctx: Circuit,
        name: str,
        m: Material,
        coupling: float,
        coils: list[tuple[int, float]],
        start: tuple[float, list[float]],
    ) -> None:
        self.ctx, self.name, self.m, self.coils = ctx, name, m, coils
        b = self.b = ctx.b
        self.shape = m.shape(b)
        he, hs = start
        # as magnetomotive forces [A]
        row = b.unknown(f"{name}#field", "branch", "A", he * m.path)
        induced = b.unknown(f"{name}#induced", "branch", "V", 0.0)
        self.he, self.e = b.x(row) * (1.0 / m.path), b.x(induced)
        self.rises = b.flag(self.e - STILL, self.e + STILL, f"{name} rises", law="stays")
        self.still = ctx.standstill()
        self.parts: list[tuple[float, Expr, Expr]] = []  # share of M, h, dh/dHe
        self.lost: Expr | None = None  # what has become heat [J], where that is a function of the state
        if m.c < 1.0:
            (self._play if m.law == "play" else self._jiles)(he, hs)
        self.magnetisation = m.c * self.man(self.he)
        for share, h, _ in self.parts:
            self.magnetisation = self.magnetisation + share * self.man(h)
        self.h = self.he - m.alpha * self.magnetisation
        self.flux_density = MU0 * (self.h + self.magnetisation)
        b.add_q(induced, m.area * self.flux_density)
        b.g(induced, induced, -1.0)
        force = self.h * m.path + self.flux_density * (m.gap / MU0)
        # windings
        air = (1.0 - coupling) * MU0 * m.area / m.path  # H, of the flux beside the core
        for br, turns in coils:
            force = force - turns * b.x(br)
            b.g(br, induced, turns)
            for other, n in coils if air else ():
                if other != br:
                    b.c(br, other, -air * turns * n)
        b.add_f(row, force)
        self.air = air

    def man(self, h: Expr) -> Expr:
        return self.m.ms * self.shape.value(h * (1.0 / self.m.a))

    def slope(self, h: Expr) -> Expr:
        return self.m.ms / self.m.a * self.shape.slope(h * (1.0 / self.m.a))

    def _play(self, he: float, hs: list[float]) -> None:
        b = self.b
        way = b.const(0.0)
        for k, ((kappa, share), h0) in enumerate(zip(self.m.pinning(), hs, strict=True)):
            memory = b.memory(f"{self.name} {k}", past=True)
            kept = h0 + memory
            up, down = self.he - (kept + kappa), (kept - kappa) - self.he
            # off where it goes the other way: turned at the event that turned it round
            up = b.select(self.still, up, b.select(self.rises, up, -kappa))
            down = b.select(self.still, down, b.select(self.rises, -kappa, down))
            pulls = b.flag(up, None, f"{self.name} {k} up", law="leg")
            pushes = b.flag(down, None, f"{self.name} {k} down", law="leg")
            h = b.select(pulls, self.he - kappa, b.select(pushes, self.he + kappa, kept))
            b.keep(memory, h - h0)
            way = way + (share * kappa) * b.call("abs", self.man(h) - self.man(kept))
            self.parts.append((share, h, pulls + pushes))

        before = b.memory(f"{self.name} lost", past=True)
        self.lost = before + (MU0 * self.volume) * way
        b.keep(before, self.lost)

    def _jiles(self, he: float, hs: list[float]) -> None:
        b, m = self.b, self.m
        row = b.unknown(f"{self.name}#reversible", "branch", "A", hs[0] * m.path)
        h = b.x(row) * (1.0 / m.path)
        behind = b.flag(self.he - h, None, f"{self.name} behind", law="leg")
        goes = self.rises * behind + (1.0 - self.rises) * (1.0 - behind)
        rate = goes * (1.0 / m.k) * b.call("abs", self.man(self.he) - self.man(h))  # d Man(h)/dHe
        self.parts.append((1.0 - m.c, h, rate / self.slope(h)))
        scale = m.path * m.a / m.ms
        b.add_q(row, scale * self.man(h))
        still = self.man(h) - self._leg(he, hs[0])
        b.add_f(row, scale * b.select(self.still, still, -rate * self.field_rate))

    def _leg(self, he: float, h0: float) -> Expr:
        """Man(h) at an operating point, from the last one: a linear differential equation in He, solved by quadrature."""
        b, m = self.b, self.m
        before = [b.memory(f"{self.name} {word}", past=True) for word in ("field", "reversible")]
        x0, y0 = he + before[0], h0 + before[1]
        b.keep(before[0], self.he - he)
        b.keep(before[1], self.parts[0][1] - h0)
        apart = 0.5 * b.call("abs", x0 - y0)
        high, low = 0.5 * (x0 + y0) + apart, 0.5 * (x0 + y0) - apart
        sides = []
        for sign, start in ((1.0, high), (-1.0, low)):
            way = sign * (self.he - start)
            moves = b.flag(b.select(self.still, way, -1.0), None, f"{self.name} {sign:+g}", law="leg")
            length = b.select(moves, way * (1.0 / m.k), 0.0)
            ends = [
                0.5 * (end + length - b.call("abs", length - end)) for end in PANELS
            ]  # no further than it goes
            rest = lagged(self._before(sign * m.k), lambda x: b.call("exp", x), ends)
            total = b.call("exp", -length) * self.man(y0) + rest
            sides.append((moves, total))
        (up, rising), (down, falling) = sides
        return b.select(up, rising, b.select(down, falling, self.man(y0)))

    def _before(self, back: float) -> Callable[[Expr], Expr]:
        """What the anhysteretic curve was at a field so much earlier on the way."""
        return lambda t: self.man(self.he - back * t)

    @property
    def field_rate(self) -> Expr:
        """dHe/dt [A/m s]."""
        m = self.m
        parts = (share * follows * self.slope(h) for share, h, follows in self.parts)
        slope = sum(parts, m.c * self.slope(self.he))
        return self.e * (1.0 / (m.area * MU0)) / (1.0 + (1.0 - m.alpha) * slope)

    # ---- energy ----

    @property
    def volume(self) -> float:
        return self.m.area * self.m.path

    def loss(self) -> Expr:
        """[W]"""
        parts = (share * (self.he - h) * follows * self.slope(h) for share, h, follows in self.parts)
        lost = sum(parts, self.b.const(0.0))
        return MU0 * self.volume * lost * self.field_rate

    def energy(self) -> Expr:
        """[J], of the core, its gap and the flux beside it."""
        m, b = self.m, self.b

        def stored(h: Expr) -> Expr:
            return m.ms * m.a * self.shape.stored(h * (1.0 / m.a))

        density = 0.5 * self.h * self.h - (0.5 * m.alpha) * self.magnetisation * self.magnetisation
        density = density + m.c * stored(self.he)
        for share, h, _ in self.parts:
            density = density + share * stored(h)
        total = MU0 * self.volume * density
        if m.gap:
            total = total + (0.5 * m.area * m.gap / MU0) * self.flux_density * self.flux_density
        for k, (one, turns) in enumerate(self.coils if self.air else ()):
            for other, n in self.coils[k + 1 :]:
                total = total - self.air * turns * n * b.x(one) * b.x(other)
        return total
