"""`.dc source start stop step [source2 start2 stop2 step2] [static]`: operating points over a V or I source, a resistor or the
temperature (`temp`), for each value of a second one.

Every point is sought from the one before, so that switches and circuits of several states keep theirs as long as it lasts.
Sources change in the compiled equations; for a resistance or a temperature these are made anew.
"""

from __future__ import annotations

import math
from itertools import pairwise

from ..assemble.outputs import Output
from .base import Analysis, Axis, Computed, Run, channels, derived, recorded, wrong
from .failure import explain
from .op import is_static
from .points import POINT, Points, evenly

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Self

    from .._engine import Waveforms
    from ..assemble import Assembly, Context
    from ..deck import Analysis as Card
    from ..diagnostics import Sink
    from ..elements import Element
    from .base import Progress

SWEEPS = {"v": Axis("v-sweep", "V"), "i": Axis("i-sweep", "A"), "r": Axis("res-sweep", "Ohm")}
TEMPERATURE = Axis("temp-sweep", "C")
STOP = 1e-9  # of a step: rounding of the last point
PARTS = 4  # of a step, where measurements look between the points


class Sweep:
    """One of the quantities that are swept: its name ("temp", or an element's), and its values."""

    __slots__ = ("axis", "name", "values")

    def __init__(self, name: str, values: Points) -> None:
        self.name, self.values = name, values
        letter = name.rpartition(".")[2][:1]
        self.axis = TEMPERATURE if name == "temp" else SWEEPS.get(letter)

    def element(self, ctx: Context) -> Element | None:
        """What is swept, where it is one of V, I, R; None where it is the temperature, or nothing."""
        e = None if self.name == "temp" else ctx.elements.get(ctx.element_name(self.name))
        return e if e is not None and e.letter in "VvIiRr" else None

    def is_source(self, ctx: Context) -> bool:
        e = self.element(ctx)
        return e is not None and e.letter in "VvIi"


class Dc(Analysis):
    word = "dc"
    form = ".dc source start stop step [source2 start2 stop2 step2]"
    meaning = "operating points over a source, a resistor or the temperature"
    plotname = "DC transfer characteristic"
    has_responses = True
    axis: Axis | None = Axis("v-sweep", "V")  # or that of what is swept
    draws = ("machine", "circuit")

    def __init__(self, card: Card, sweeps: list[Sweep]) -> None:
        self.card, self.sweeps, self.static = card, sweeps, is_static(card)
        self.axis = sweeps[0].axis

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        args = [a for a in card.args if a != "static"]
        sweeps = []
        for k in range(0, max(len(args), 1), 4):
            name, *numbers = args[k : k + 4] or [""]
            if (
                not isinstance(name, str)
                or len(numbers) != 3
                or any(isinstance(n, str) for n in numbers)
                or k > 4
            ):
                wrong(cls, card, sink, ".dc takes a source, a start, an end and a step, once or twice")
                return None
            start, stop, step = map(float, numbers)
            if not all(map(math.isfinite, (start, stop, step))):
                wrong(cls, card, sink, ".dc has an argument that is no finite number")
                return None
            if step * (stop - start) < 0.0:
                said = f"steps of {step:g} do not lead from {start:g} to {stop:g}: {-step:g} is taken"
                sink.warning("W308", said, card.span, f"write {-step:g}", [])
                step = -step
            if step == 0.0 and start != stop:
                wrong(cls, card, sink, f"steps of {step:g} do not lead from {start:g} to {stop:g}")
                return None
            count = math.floor((stop - start) / step + STOP) + 1 if step else 1
            sweeps.append(Sweep(name.lower(), Points(count, evenly, start, step, 1)))
        if any(s.axis is None for s in sweeps):
            strange = next(s.name for s in sweeps if s.axis is None)
            said = f"`{strange}` cannot be swept: .dc sweeps V and I sources, resistors and temp"
            wrong(cls, card, sink, said)
            return None
        return cls(card, sweeps)

    def columns(self, ctx: Context) -> list[Output]:
        for s in self.sweeps:
            e = s.element(ctx)
            if s.name != "temp" and e is None:
                names = [x.name for x in ctx.elements.values() if x.letter in "VvIiRr"]
                said = f".dc sweeps `{s.name}`, which is no source and no resistor of this deck"
                ctx.unknown("E309", said, s.name, names, self.card.span)
            elif e is not None and e.letter in "Rr" and not isinstance(e.value, (int, float)):
                said = f".dc sweeps `{s.name}`, whose resistance is no number"
                ctx.sink.error("E309", said, self.card.span, "sweep a source that the expression reads")
            elif s.name == "temp" and ctx.flat.reads_temper:
                said = "a parameter reads `temper`, which .dc temp would have to change"
                hint = "run the deck once for each temperature: .temp 27 85, or .step temp"
                ctx.sink.error("E309", said, self.card.span, hint)
        return super().columns(ctx)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        from array import array  # loads late: its import takes a millisecond

        names, units, _ = recorded(assembly, self)
        recording = len(names) + len(channels(assembly, self))
        inner, outer = self.sweeps[0], self.sweeps[1:]
        assert inner.axis is not None
        asked = [o for o in assembly.measured(self) if o.expr is not None]
        parts_of = PARTS if asked and len(inner.values) > 1 else 1
        parts: list[Waveforms] = []
        points: list[list[float]] = []
        trouble, near = [], None
        hanging: tuple[int, int, float, float] | None = None
        for made, sources, block in self._blocks(assembly, parts_of):
            waves = [made.ctx.wave(e) for s in sources if (e := s.element(made.ctx)) is not None]
            values = [[p[self.sweeps.index(s)] for s in sources] for p in block]
            exprs = [*recorded(made, self)[2], *channels(made, self)]
            part = made.system.dc(exprs, made.options, self.static, waves, values, near)
            parts.append(part)
            if hanging is None and part.hanging is not None:
                row, unknown, volts, amperes = part.hanging
                hanging = (len(points) + row, unknown, volts, amperes)
            points += block[: part.rows]
            near = part.state
            if part.status == "failed":
                trouble = explain(made, self, part)
            count = self._count(parts_of)
            if part.status != "ok" or (progress and progress(len(points), count, 0.0, len(points), 0)):
                break
        steps = [f"sweep({s.name})" for s in outer]
        columns = [array("d", (p[k] for p in points)) for k in range(len(self.sweeps))]
        columns += [array("d", b"".join(part.column(1 + k) for part in parts)) for k in range(recording)]
        within: list[bytes] = []
        if parts_of > 1:
            # the points of the table, and for measurements those between them
            read = [names.index(o.name) + len(self.sweeps) for o in asked]
            within = [columns[k].tobytes() for k in (*range(len(self.sweeps)), *read)]
            length = (len(inner.values) - 1) * parts_of + 1
            kept = [k for k in range(len(points)) if k % length % parts_of == 0]
            columns = [array("d", (c[k] for k in kept)) for c in columns]
        status = next((part.status for part in parts if part.status != "ok"), "ok")
        if status == "ok" and len(points) < self._count(parts_of):
            status = "interrupted"
        stats = {
            key: sum(p.stats[key] for p in parts) for key in ("iterations", "factorisations", "solve_time")
        }
        outer_units = [s.axis.unit for s in outer if s.axis is not None]
        whole = Computed(columns, (), status, stats, within)
        whole.hanging = hanging
        between = [Output(name, unit, None) for name, unit in zip(steps, outer_units, strict=True)]
        return Run(
            self, [inner.axis.name, *steps, *names], [inner.axis.unit, *outer_units, *units], whole, inner.axis,
            derived=derived(assembly, self), steps=steps, trouble=trouble, inside=([*between, *asked] if within else (), 0),
        )  # fmt: skip

    def rows(self) -> tuple[float, int, str]:
        return self._count(1), POINT, "a larger step: what lies between is found from the points beside it"

    def _count(self, parts: int) -> int:
        inner, *outer = (len(s.values) for s in self.sweeps)
        return ((inner - 1) * parts + 1) * math.prod(outer)

    def _points(self, parts: int) -> list[list[float]]:
        """Values of the sweeps at every point, the first one running fastest, in so many parts of its steps."""
        inner, *outer = (list(s.values) for s in self.sweeps)
        if parts > 1:
            inner = [a + (b - a) * j / parts for a, b in pairwise(inner) for j in range(parts)] + inner[-1:]
        return [[a, *([b] if outer else [])] for b in (outer[0] if outer else [0.0]) for a in inner]

    def _blocks(
        self, assembly: Assembly, parts: int
    ) -> Iterator[tuple[Assembly, list[Sweep], list[list[float]]]]:
        """Stretches of points that have the equations in common: these, the sources swept in them, the points."""
        sources = [s for s in self.sweeps if s.is_source(assembly.ctx)]
        others = [k for k, s in enumerate(self.sweeps) if s not in sources]
        points, first = self._points(parts), 0
        for k in range(1, len(points) + 1):
            here = [points[first][i] for i in others]
            if k < len(points) and [points[k][i] for i in others] == here:
                continue
            made = self._made(assembly, here, others) if others else assembly
            yield made, sources, points[first:k]
            first = k

    def _made(self, assembly: Assembly, values: list[float], which: list[int]) -> Assembly:
        """The equations with these values of a resistance or the temperature."""
        from ..assemble import assemble

        flat, before = assembly.flat, []
        try:
            for k, value in zip(which, values, strict=True):
                e = self.sweeps[k].element(assembly.ctx)
                before.append((e, flat.temp if e is None else e.value))
                if e is None:
                    flat.temp = value
                else:
                    e.value = value
            made = assemble(flat, assembly.options, assembly.ctx.times, analyses=assembly.analyses)
            if assembly.drawn is not None:
                made.drawing()
            return made
        finally:
            for e, value in before:
                if e is None:
                    flat.temp = value
                else:
                    e.value = value
