"""`.dc source start stop step [source2 start2 stop2 step2] [static]`: operating points over a V or I source, a resistor or the
temperature (`temp`), for each value of a second one.

Every point is sought from the one before, so that switches and circuits of several states keep theirs as long as it lasts.
Sources and plain resistances change in the compiled equations, whose values from outside they are (opened.py). For the
temperature, and for a resistance that a model or parameters scale, the equations are made anew.
"""

from __future__ import annotations

import math
from itertools import pairwise

from ..assemble.outputs import Output
from ..elements.r import LEAST_RESISTANCE
from ..expr import OUTSIDE, Name
from ..opened import Opened
from .base import POINT, Analysis, Axis, Computed, Run, channels, derived, recorded, wrong
from .op import is_static
from .points import Points, evenly

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, Self

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

    def is_open(self, ctx: Context) -> bool:
        """Is it a resistor of a number and nothing else? An expression can stand in its place."""
        e = self.element(ctx)
        return e is not None and e.letter in "Rr" and _is_number(e) and not e.params and e.model is None

    def at(self, ctx: Context, value: float) -> float:
        """The value that the equations get."""
        e: Any = self.element(ctx) if value == 0.0 and self.is_open(ctx) else None
        if e is None:
            return value
        e.warn_of_zero(ctx)
        return LEAST_RESISTANCE

    def wave(self, ctx: Context) -> int | None:
        """The engine's number of what changes; None of what is no element."""
        e = self.element(ctx)
        if e is None:
            return None
        return ctx.wave(e) if self.is_source(ctx) else ctx.input(OUTSIDE + e.name)


def _is_number(e: Element) -> bool:
    return isinstance(e.value, (int, float))


def _is_outside(e: Element) -> bool:
    """Does its value come from outside, as that of a resistor that is swept?"""
    return isinstance(e.value, Name) and e.value.id == OUTSIDE + e.name


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
                sink.warning("W308", said, card.span, f"write {-step:g}")
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
            elif e is not None and e.letter in "Rr" and not (_is_number(e) or _is_outside(e)):
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
        for made, inside, block in self._blocks(assembly, parts_of):
            waves = [k for s in inside if (k := s.wave(made.ctx)) is not None]
            values = self._values(made.ctx, inside, block)
            exprs = [*recorded(made, self)[2], *channels(made, self)]
            part = made.system.dc(exprs, made.options, self.static, waves, values, near)
            parts.append(part)
            if hanging is None and part.hanging is not None:
                row, unknown, volts, amperes = part.hanging
                hanging = (len(points) + row, unknown, volts, amperes)
            points += block[: part.rows]
            near = part.state
            if part.status == "failed":
                from .failure import explain

                trouble = explain(made, self, part)
            count = self._count(parts_of)
            if part.status != "ok" or (progress and progress(len(points), count, 0.0, len(points), 0)):
                break
        steps = [f"sweep({s.name})" for s in outer]
        columns = [array("d", [p[k] for p in points]) for k in range(len(self.sweeps))]
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

    def _values(self, ctx: Context, inside: list[Sweep], block: list[list[float]]) -> list[list[float]]:
        """What the equations get at each point of a block, in the order of `inside`."""
        zeros = any(s.is_open(ctx) for s in inside) and any(0.0 in p for p in block)
        if inside == self.sweeps and not zeros:
            return block
        which = [(self.sweeps.index(s), s) for s in inside]
        return [[s.at(ctx, p[k]) for k, s in which] for p in block]

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
        return [[a, b] for b in outer[0] for a in inner] if outer else [[a] for a in inner]

    def _blocks(
        self, assembly: Assembly, parts: int
    ) -> Iterator[tuple[Assembly, list[Sweep], list[list[float]]]]:
        """Stretches of points that have the equations in common: these, what changes in them, the points."""
        ctx = assembly.ctx
        opened = [s for s in self.sweeps if s.is_open(ctx)]
        inside = [s for s in self.sweeps if s in opened or s.is_source(ctx)]
        others = [k for k, s in enumerate(self.sweeps) if s not in inside]
        points, first = self._points(parts), 0
        for k in range(1, len(points) + 1) if others else (len(points),):
            here = [points[first][i] for i in others]
            if k < len(points) and [points[k][i] for i in others] == here:
                continue
            values: list[tuple[Sweep, float | None]] = [
                (self.sweeps[i], v) for i, v in zip(others, here, strict=True)
            ]
            values += [(s, None) for s in opened]
            yield self._made(assembly, values) if values else assembly, inside, points[first:k]
            first = k

    def _made(self, assembly: Assembly, values: list[tuple[Sweep, float | None]]) -> Assembly:
        """The equations with these values of a resistance or the temperature; None: of one that comes from outside."""
        from ..assemble import assemble

        flat, before = assembly.flat, []
        inputs = flat.inputs
        try:
            for sweep, value in values:
                e: Any = sweep.element(assembly.ctx)
                before.append((e, flat.temp if e is None else e.value))
                if value is None:
                    name = OUTSIDE + e.name
                    flat.inputs = Opened({**(flat.inputs or {}), name: e.value})
                    e.value = Name(name, self.card.span)
                elif e is None:
                    flat.temp = value
                else:
                    e.value = value
            made = assemble(flat, assembly.options, assembly.ctx.times, analyses=assembly.analyses)
            if assembly.drawn is not None:
                made.drawing()
            return made
        finally:
            flat.inputs = inputs
            for e, value in before:
                if e is None:
                    flat.temp = value
                else:
                    e.value = value
