"""`.ac dec|oct|lin n fstart fstop [static]`: what small signals of the sources with `ac=` come to, over frequency.

The equations are linearised about the operating point, machine included: it is there at its initial coordinates and speeds,
or, with `static`, where it comes to rest. Columns are complex amplitudes; expressions of them (`vdb(out)`, `v(out)/v(in)`)
are made of these, as in ngspice.
"""

from __future__ import annotations

import math
from itertools import pairwise

from .base import Analysis, Axis, Computed, Run, channels, derived, recorded, wrong
from .op import is_static
from .points import Points, evenly

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Self

    from .._engine import SmallSignal
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Diagnostic, Sink
    from .base import Progress

SPACINGS = ("dec", "oct", "lin")
STOP = 1e-3  # the last point may lie so much of a step behind the end, as in ngspice
DEGREE = 8  # of the polynomials in frequency that measurements see


class OverFrequencies(Analysis):
    """What is computed at the frequencies of `dec|oct|lin n fstart fstop`."""

    axis = Axis("frequency", "Hz", log=True)
    frequencies: Points

    def __init__(self, card: Card, frequencies: Points) -> None:
        self.card, self.frequencies, self.static = card, frequencies, is_static(card)
        self.axis = Axis("frequency", "Hz", frequencies.law is not evenly)


class Ac(OverFrequencies):
    word = "ac"
    asks_as = "ac"
    form = ".ac dec points fstart fstop, .ac oct points fstart fstop, .ac lin points fstart fstop"
    meaning = "small signals over frequency, about the operating point"
    plotname = "AC Analysis"
    has_responses = True
    complex = True
    draws = ("circuit",)

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        found = grid(cls, card, sink, card.args)
        return None if found is None else cls(card, found)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        names, units, exprs = recorded(assembly, self)
        exprs = [*exprs, *channels(assembly, self)]
        inside = [o for o in assembly.measured(self) if o.expr is not None]
        linear, trouble = linearised(assembly, self, self.static)
        waves = Computed([b""] * (1 + len(exprs)), [False] + [True] * len(exprs), "failed")
        if linear is not None:
            sources = excited(assembly.ctx)
            if not sources:
                assembly.flat.sink.warning(
                    "W305", "no source has ac=: all signals of .ac are 0", self.card.span,
                    hint="give the one that excites the circuit an amplitude: V1 in 0 dc 0 ac 1",
                )  # fmt: skip
            s = [(0.0, 2.0 * math.pi * f) for f in self.frequencies]
            try:
                found = linear.respond(s, exprs, sources)
                within = self._inside(linear, inside, sources) if inside else []
                waves = Computed([self.frequencies, *found], waves.complex, within=within)
            except ValueError as error:
                trouble = [singular(assembly, self, error)]
        return Run(
            self, ["frequency", *names], ["Hz", *units], waves, self.axis, derived=derived(assembly, self), trouble=trouble,
            inside=(inside, DEGREE),
        )  # fmt: skip

    def _inside(
        self, linear: SmallSignal, outputs: list[Output], sources: list[tuple[int, tuple[float, float]]]
    ) -> list[bytes]:
        """What measurements read, solved between the frequencies of the table too."""
        from array import array

        f = between(self.frequencies, 1.0 + 1.0 / DEGREE if self.axis.log else 0.0)
        s = [(0.0, 2.0 * math.pi * x) for x in f]
        return [
            array("d", f).tobytes(),
            *linear.respond(s, [o.expr for o in outputs if o.expr is not None], sources),
        ]


def between(points: Points, ratio: float) -> list[float]:
    """Chebyshev's points of the second kind of each stretch between neighbours, of parts of it where they lie farther apart than
    so many times the first."""
    cosines = [0.5 - 0.5 * math.cos(math.pi * j / DEGREE) for j in range(DEGREE + 1)]
    found: list[float] = []
    for a, b in pairwise(points):
        parts = max(1, math.ceil(math.log(b / a) / math.log(ratio))) if ratio and 0 < a < b else 1
        ends = [a if k == 0 else b if k == parts else a * (b / a) ** (k / parts) for k in range(parts + 1)]
        for c, d in pairwise(ends):
            found += [c, *(c + (d - c) * x for x in cosines[1:-1]), d]
    return found


def grid(kind: type[Analysis], card: Card, sink: Sink, args: Sequence[float | str]) -> Points | None:
    """The frequencies of `dec|oct|lin n fstart fstop` [Hz], as ngspice lays them; None after an error."""
    words = [a.lower() for a in args if isinstance(a, str) and a.lower() != "static"]
    numbers = [float(a) for a in args if not isinstance(a, str)]
    spacing = words[0] if len(words) == 1 else ""
    if spacing not in SPACINGS or len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        wrong(kind, card, sink, f".{kind.word} takes dec, oct or lin, a number of points and two frequencies")
        return None
    points, start, stop = int(numbers[0]), numbers[1], numbers[2]
    if spacing == "lin" and points == 0 and 0 <= start == stop:  # as schematic programs leave it
        said = f".{card.kind} asks for no points: the one at {start:g} Hz is computed, as in ngspice"
        sink.warning(
            "W309", said, card.span, f"write .{card.kind} lin 1 {start:g} {stop:g}, or dec 10 1 1meg"
        )
        points = 1
    if points < 1:
        wrong(kind, card, sink, f"the number of points is {numbers[0]:g}, it must be 1 at least")
    elif spacing != "lin" and not start > 0:
        wrong(kind, card, sink, f"fstart is {start:g} Hz, with {spacing} it must be positive")
    elif not 0 <= start <= stop:
        wrong(kind, card, sink, f"the frequencies {start:g} .. {stop:g} Hz must ascend from 0 or more")
    elif spacing == "lin":
        return Points(points, evenly, start, stop - start, max(points - 1, 1))
    else:
        ratio = 2.0 ** (1 / points)
        if spacing == "dec":
            steps = math.floor(math.log10(stop / start) * points + 1e-9)
            ratio = (stop / start) ** (1 / steps) if steps else 10.0 ** (1 / points)
        count = math.floor(math.log(stop * (1 + STOP * ratio) / start) / math.log(ratio) + 1e-9) + 1
        return Points(
            count, _by_ratios, start, ratio, count - 1 if spacing == "dec" and count > 1 else -1, stop
        )
    return None


def _by_ratios(k: int, start: float, ratio: float, last: int, stop: float) -> float:
    return stop if k == last else start * ratio**k


def linearised(
    assembly: Assembly, analysis: Analysis, static: bool, hold: bool = False
) -> tuple[SmallSignal | None, list[Diagnostic]]:
    """The equations about the operating point, or why there is none; `hold`: the machine does not move."""
    linear, failure = assembly.system.small_signal(assembly.options, static, hold)
    if linear is None:
        from .failure import explain_failure

        return None, explain_failure(assembly, analysis, dict(failure or {}))
    if linear.hanging is not None:
        from .afterwards import hangs

        hangs(assembly, "at the operating point", *linear.hanging)
    if linear.unstable is not None and analysis.word not in ("pz", "modes"):  # which show it
        from .afterwards import unstable

        unstable(assembly, analysis, "the operating point is unstable", linear.unstable)
    if not hold and assembly.machine is not None:
        from .moving import unsteady

        if trouble := unsteady(assembly, analysis, linear):
            return None, trouble
    return linear, []


def without_delays(analysis: Analysis, ctx: Context) -> None:
    """An error where something is late: the equations are then no pencil, and have poles without number."""
    if ctx.delayed:
        said = f".{analysis.word} finds no poles of lines: they have more than there are numbers"
        ctx.sink.error(
            "E305", said, analysis.card.span, "put some coils and capacitors in the place of each line"
        )


def singular(assembly: Assembly, analysis: Analysis, error: ValueError) -> Diagnostic:
    """The error of a frequency at which there is no solution."""
    from .failure import explain_failure

    unknown = str(error).partition("singular: ")[2]
    why = {"kind": "singular", "during": "operating point", "unknown_name": unknown}
    return explain_failure(assembly, analysis, why)[0]


def excited(ctx: Context) -> list[tuple[int, tuple[float, float]]]:
    """(number of the waveform, amplitude) of every source with ac=."""
    found = (pair for e in ctx.elements.values() for pair in e.excite(ctx))
    return [(k, (z.real, z.imag)) for k, z in found]
