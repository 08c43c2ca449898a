"""`.modes [static]`: the modes of circuit and mechanism about the operating point: frequency, damping and shape of each.

A mode is a motion x exp(s t) that (G + s C) x = 0 allows. One row each, conjugate pairs once: its frequency |Im s|/2 pi, its
damping ratio -Re s/|s| (1 dies out without swinging, below 0 it grows), its rate -Re s. The shape is what the deck's signals
come to, as complex amplitudes: the largest coordinate is 1, or the largest signal where the machine does not move. A free
motion, of frequency and rate 0, is there as often as its equations have such solutions: twice, place and speed.
"""

from __future__ import annotations

import math

from .ac import linearised, without_delays
from .base import Analysis, Axis, Computed, Run, derived, recorded
from .op import is_static

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar, Self

    from .._engine import Expr, SmallSignal
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Diagnostic, Sink
    from .base import Progress

SEEN = 1e-6  # of a mode's largest signal: a speed above it is a motion of the machine
ROUNDING = 1e-8  # of a vector
NOTHING = 1e-12


class Modes(Analysis):
    word = "modes"
    asks_as = "ac"
    form = ".modes [static]"
    meaning = "frequency, damping and shape of every mode of circuit and mechanism"
    plotname = "Modes"
    axis: Axis | None = Axis("mode", "")
    names_itself = True
    shown: ClassVar[tuple[str, ...]] = ("modes",)
    complex = True

    def __init__(self, card: Card) -> None:
        self.card, self.static = card, is_static(card)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        from .base import wrong

        if any(a != "static" for a in card.args):
            wrong(cls, card, sink, f".modes takes nothing but static, not `{card.args[0]}`")
            return None
        return cls(card)

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import columns

        without_delays(self, ctx)
        return columns(ctx, "", "", whole=False)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        names, units, exprs = recorded(assembly, self)
        linear, trouble = linearised(assembly, self, self.static)
        heads = ["mode", "frequency", "damping", "rate"]
        columns: list[Any] = [[] for _ in (*heads, *names)]
        swing = None
        if linear is not None:
            from .pencil import SingularPencil, dense, eigenvalues, vectors

            g, c = dense(linear)
            try:
                found = eigenvalues(g, c)
            except SingularPencil:
                trouble = [_undetermined(self)]
            else:
                found = found[found.imag >= 0.0]
                found = found[sorted(range(len(found)), key=lambda k: (found[k].imag, abs(found[k].real)))]
                shapes = _shapes(assembly, linear, exprs, units, found, vectors(g, c, found))
                size = [abs(s) for s in found]
                columns = [
                    list(range(1, len(found) + 1)),
                    [s.imag / (2.0 * math.pi) for s in found],
                    [(0.0 - s.real) / a if a else 0.0 for s, a in zip(found, size, strict=True)],
                    [0.0 - s.real for s in found],
                    *([part for z in column for part in (z.real, z.imag)] for column in shapes),
                ]
            if linear is not None and not trouble and assembly.drawn is not None:
                from .swinging import swinging

                swing = swinging(assembly, linear, vectors(g, c, found))
        waves = Computed(columns, [False] * 4 + [True] * len(names), "failed" if trouble else "ok")
        run = Run(
            self, [*heads, *names], ["", "Hz", "", "1/s", *units], waves, self.axis, derived=derived(assembly, self),
            trouble=trouble,
        )  # fmt: skip
        run.swing = swing
        return run


def _undetermined(analysis: Modes) -> Diagnostic:
    from ..diagnostics import Diagnostic

    said = "the modes are not determined: the equations have a solution at every frequency"
    return Diagnostic("error", "E411", said, analysis.card.span, "something of the deck hangs on nothing")


def _tidy(z: complex) -> complex:
    """Without what is rounding: of the other part, or of 1."""
    if abs(z) < NOTHING:
        return 0j
    return complex(*(part if abs(part) > ROUNDING * abs(z) else 0.0 for part in (z.real, z.imag)))


def slopes(assembly: Assembly, linear: SmallSignal, exprs: list[Expr]) -> list[list[tuple[int, float]]]:
    """Of each expression (unknown, derivative) at the point."""
    b, n = assembly.ctx.b, assembly.system.n
    xs = [b.x(k) for k in range(n)]
    terms: list[list[tuple[int, float]]] = []
    for e in exprs:
        kind, number, _ = e.node
        if kind == "x":
            terms.append([(int(number), 1.0)])
            continue
        read = [k for k, depends in enumerate(b.depends(e, [x]) for x in xs) if depends[0]]
        found = linear.values(b.grad(e, [xs[k] for k in read])) if read else []
        terms.append(list(zip(read, found, strict=True)))
    return terms


def _shapes(
    assembly: Assembly,
    linear: SmallSignal,
    exprs: list[Expr],
    units: list[str],
    found: Any,
    vectors: list[Any],
) -> list[list[complex]]:
    """What signals come to in each mode."""
    terms = slopes(assembly, linear, exprs)
    columns: list[list[complex]] = [[] for _ in exprs]
    places = [k for k, unit in enumerate(units) if unit in ("rad", "m")]
    for s, x in zip(found, vectors, strict=True):
        shape = [complex(sum(d * x[k] for k, d in row)) for row in terms]
        largest = max(shape, key=abs, default=0j)
        place = max((shape[k] for k in places), key=abs, default=0j)
        if abs(place) * max(abs(s), 1.0) > SEEN * abs(largest):
            largest = place
        for column, value in zip(columns, shape, strict=True):
            column.append(_tidy(value / largest) if largest else 0j)
    return columns
