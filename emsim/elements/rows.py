"""Equation (1) while it is written: unknowns, and expressions of them with the flags that hold their kinks and jumps.

Rows and unknowns are the same list: row i of d/dt Q(x) + F(x, t) = 0 belongs to unknown i, index -1 is ground and every stamp
on it is dropped.
"""

from __future__ import annotations

import math
from itertools import pairwise

from ..diagnostics import suggest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .._engine import Builder, Expr
    from ..diagnostics import Sink, Span

GROUND = ("0", "gnd")
SHOWN = 8  # names that a hint lists
ON_THE_NUMBER = 1e-9  # so little below a whole number is that number: rounding
SMALL_SIGNALS = "small signals"  # the flag that is 1 where the equations are linearised for these


class Rows:
    """
    b         the engine's builder
    nodes     node name -> unknown (ground left out); `branches` element or coupling name -> current unknown
    conditions  number of a flag -> place of the expression that it belongs to
    """

    def __init__(self, b: Builder, sink: Sink) -> None:
        self.b, self.sink = b, sink
        self.nodes: dict[str, int] = {}
        self.branches: dict[str, int] = {}
        self.ics: dict[str, float] = {}
        # name of a digital node -> its number, its level as an expression: 0, 1, 1/2 where it is undefined
        self.digital: dict[str, tuple[int, Expr]] = {}
        self.flags: dict[str, Expr] = {}
        self.conditions: dict[int, Span | None] = {}
        self.still: Expr | None = None  # 1 at the DC point, 0 in a run
        self.delayed: list[int] = []  # unknowns that read what was a time ago
        self._ddts: dict[int, int] = {}
        self._remarked: set[str] = set()

    @property
    def where(self) -> Span | None:
        """Place of the expression at hand."""
        return None

    # unknowns ------------------------------------------------------------------------------------

    def node(self, name: str) -> int:
        """Unknown of a node, made at its first mention; -1 for ground."""
        if name in GROUND:
            return -1
        index = self.nodes.get(name)
        if index is None:
            index = self.nodes[name] = self.b.unknown(name, "node", "V", self.ics.get(name, 0.0))
        return index

    def inner_node(self, name: str) -> int:
        """A node of an element's own; it is no output and nobody else can name it."""
        return self.b.unknown(name, "node", "V", 0.0)

    def digital_node(self, name: str) -> tuple[int, Expr]:
        """A digital node (its number, its level), made at its first mention."""
        if name not in self.digital:
            number, wave = self.b.digital_node(name)
            self.digital[name] = (number, self.b.wave_expr(wave))
        return self.digital[name]

    def new_branch(self, name: str, initial: float = 0.0) -> int:
        """A current unknown; `initial` counts under UIC."""
        index = self.branches[name] = self.b.unknown(name, "branch", "A", initial)
        return index

    def branch(self, name: str) -> int | None:
        """Current unknown of a voltage-defined element or of a coupling; None where there is none."""
        return self.branches.get(name)

    def v(self, p: str, n: str | None = None) -> Expr:
        """Voltage of node p, against n when given [V]; of a digital node its level."""
        value = self._voltage(p)
        return value if n is None or n in GROUND else value - self._voltage(n)

    def _voltage(self, name: str) -> Expr:
        if name in self.digital and name not in self.nodes:
            return self.digital[name][1]
        index = self.node(name)
        return self.b.x(index) if index >= 0 else self.b.const(0.0)

    def ddt(self, e: Expr, name: str) -> Expr:
        """Time derivative of e, an unknown d of its own with the row d/dt e - d = 0; zero at the DC point."""
        if e.value is not None:
            return self.b.const(0.0)
        index = self._ddts.get(e.id)
        if index is None:
            index = self._ddts[e.id] = self.b.unknown(name, "derivative", "", 0.0)
            self.b.add_q(index, e)
            self.b.g(index, index, -1.0)
        return self.b.x(index)

    def idt(self, e: Expr, start: float, name: str) -> Expr:
        """Time integral of e from `start`, a state that the DC point holds."""
        index = self.b.unknown(name, "coordinate", "", start)
        self.b.c(index, index, 1.0)
        self.b.add_f(index, -e)
        return self.b.x(index)

    def delay(self, e: Expr, td: float, name: str, initial: float = 0.0) -> Expr:
        """What e was `td` [s] ago, a current unknown of its own; at the DC point e itself, before a start from given values
        `initial`. Runs keep what was, small signals turn its phase (engine/dae/src/system/delays.rs)."""
        b = self.b
        index = b.unknown(name, "branch", "A", initial)
        past = b.wave_expr(b.delay(index, e, td, initial))
        still = self.standstill()
        b.add_f(index, b.x(index) - still * e - (1.0 - still) * past)
        self.delayed.append(index)
        return b.x(index)

    def standstill(self) -> Expr:
        """1 at operating points and in small signals, 0 in a run."""
        if self.still is None:
            self.still = self.b.wave_expr(self.b.still())
        return self.still

    # expressions ---------------------------------------------------------------------------------

    def abs_(self, e: Expr) -> Expr:
        """|e|, its kink a held flag."""
        if e.value is not None:
            return self.b.const(abs(e.value))
        return self.b.select(self.kink(e), e, -e)

    def min_(self, a: Expr, b: Expr) -> Expr:
        if a.value is not None and b.value is not None:
            return a if a.value <= b.value else b
        return self.b.select(self.kink(a - b), b, a)

    def max_(self, a: Expr, b: Expr) -> Expr:
        if a.value is not None and b.value is not None:
            return a if a.value >= b.value else b
        return self.b.select(self.kink(a - b), a, b)

    def clamp(self, e: Expr, lo: float | Expr, hi: float | Expr) -> Expr:
        low = self.b.const(lo) if isinstance(lo, (int, float)) else lo
        high = self.b.const(hi) if isinstance(hi, (int, float)) else hi
        return self.min_(self.max_(e, low), high)

    def floor_(self, e: Expr, halves_to_even: bool = False) -> Expr:
        """The whole number n below e, its jumps held flags; halves_to_even: e is a half above what is rounded.

        Two flags tell n modulo 4, and one of them flips from each whole number to the next. Given this remainder r, the
        nearest r + 4 k to e - 1/2 stays n while a step runs on past n + 1, until its flag flips at the located event.
        """
        b = self.b
        turn = math.pi / 2
        angle = turn * (e - 4.0 * b.call("floor", 0.25 * e))
        past = turn * ON_THE_NUMBER
        half = self.flag(b.call("sin", angle + past))
        outer = self.flag(b.call("cos", angle - past if halves_to_even else angle + past))
        zero, one, two, three = map(b.const, (0.0, 1.0, 2.0, 3.0))
        r = b.select(half, b.select(outer, zero, one), b.select(outer, three, two))
        return r + 4.0 * b.call("round", 0.25 * (e - 0.5 - r))

    def flag(self, up: Expr, name: str = "") -> Expr:
        """1 while up > 0, else 0; changes only at located events. Constants fold. One flag per expression. Of flags and
        constants alone no event is needed: their comparison is 0 or 1 at once."""
        return self._flag(up, name, "")

    def kink(self, up: Expr) -> Expr:
        """The same where both sides agree at zero, so that nothing happens while `up` stays there."""
        return self._flag(up, "", "stays")

    def small_signals(self) -> Expr:
        """0, and 1 where the equations are linearised for small signals."""
        found = self.flags.get(SMALL_SIGNALS)
        if found is None:
            zero = self.b.const(0.0)
            found = self.flags[SMALL_SIGNALS] = self.b.flag(zero, None, SMALL_SIGNALS, 0, 0, law="kept")
        return found

    def memory(self, node: str) -> Expr:
        """Voltage of a node as it was before the last event [V]."""
        key = f"memory {node}"
        found = self.flags.get(key)
        if found is None:
            found = self.flags[key] = self.b.flag(self.v(node), None, key, law="memory")
        return found

    def _flag(self, up: Expr, name: str, law: str) -> Expr:
        if up.value is None:
            up = self.outside_energy(up)
        if up.value is not None:
            return self.b.const(1.0 if up.value > 0 else 0.0)
        if self.b.is_logic(up):
            sign = self.b.call("sgn", up)
            return 0.5 * (sign * sign + sign)
        key = f"#{up.id} {law}"
        found = self.flags.get(key)
        if found is None:
            found = self.flags[key] = self.b.flag(up, None, name, -1, law=law)
            self.conditions.setdefault(int(found.node[1]), self.where)
        return found

    def outside_energy(self, up: Expr) -> Expr:
        """A condition of unknowns, where it was one of symbols that stand for them."""
        return up

    def table(
        self,
        x: Expr,
        points: Sequence[tuple[float, float]],
        clamped: bool,
        where: Span | None,
        rounding: float = 0.0,
        share: bool = True,
    ) -> Expr:
        """Piecewise linear y(x); beyond the ends constant if `clamped`, else along the last segments.

        `rounding` r turns the corner at x_k into the parabola that joins its two lines smoothly at x_k - d
        and x_k + d, with d = r times the shorter segment beside it, or d = r but for half of that (not `share`).
        """
        if len(points) < 2 or any(a[0] >= b[0] for a, b in pairwise(points)):
            self.sink.error(
                "E286", "the abscissas of a table must ascend, and there must be two points at least", where
            )
            return self.b.const(0.0)
        slopes = [(y1 - y0) / (x1 - x0) for (x0, y0), (x1, y1) in pairwise(points)]
        widths = [x1 - x0 for (x0, _), (x1, _) in pairwise(points)]
        corners = list(points[1:-1])
        if clamped:
            slopes, widths, corners = [0.0, *slopes, 0.0], [float("inf"), *widths, float("inf")], list(points)

        # pieces y = y0 + m (x - x0) + a (x - x0)^2 and the places where one follows the other
        def line(x0: float, y0: float, m: float) -> Expr:
            return (y0 - m * x0) + m * x if m else self.b.const(y0)

        pieces, bounds = [line(*corners[0], slopes[0]) if corners else line(*points[0], slopes[0])], []
        for (xk, yk), before, after, left, right in zip(
            corners, slopes, slopes[1:], widths, widths[1:], strict=False
        ):
            d = rounding * min(left, right) if share else min(rounding, 0.5 * min(left, right))
            if d > 0.0 and before != after:
                s = x - (xk - d)
                pieces.append((yk - before * d) + before * s + ((after - before) / (4.0 * d)) * (s * s))
                bounds += [xk - d, xk + d]
            else:
                bounds.append(xk)
            pieces.append(line(xk, yk, after))

        def pick(lo: int, hi: int) -> Expr:
            # a balanced tree over the pieces: one flag a bound
            if hi - lo == 1:
                return pieces[lo]
            mid = (lo + hi) // 2
            return self.b.select(self.kink(x - bounds[mid - 1]), pick(mid, hi), pick(lo, mid))

        return pick(0, len(pieces))

    def remark(self, code: str, message: str, span: Span | None, hint: str | None = None) -> None:
        """A warning that is said once, however many elements give rise to it."""
        if message not in self._remarked:
            self._remarked.add(message)
            self.sink.warning(code, message, span, hint=hint)

    def unknown(
        self,
        code: str,
        message: str,
        word: str,
        candidates: Iterable[str],
        span: Span | None,
        more: str = "",
    ) -> None:
        """An error about a name; the hint is the nearest one that exists, or else `more` and what there is."""
        known = list(dict.fromkeys(name for name in candidates if "#" not in name))
        near = suggest(word, known)
        some = ", ".join(f"`{name}`" for name in known[:SHOWN]) + (", ..." if len(known) > SHOWN else "")
        parts = (
            [f"did you mean `{near}`?"]
            if near
            else [part for part in (more, some and f"there are {some}") if part]
        )
        self.sink.error(code, message, span, hint="; ".join(parts) or None)
