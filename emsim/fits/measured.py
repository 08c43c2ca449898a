"""Measures of a deck at other values of some quantities, with their derivatives by them.

A measure of a transient hangs on a quantity through the signals that it reads, whose derivatives the run has beside it: it
is measured anew with every signal moved along its derivative, once up and once down, and no other run is made. Measures of other
analyses, and of decks whose transients have no such derivatives (an impact, a line), take differences of runs.
"""

from __future__ import annotations

from typing import NamedTuple

from ..analyses.slopes import Slopes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np

    from ..analyses import Tran
    from ..assemble import Assembly, Context, Output
    from ..elaborate.flat import FlatDeck

RELTOL = 1e-6
STEP = 1e-4  # of a quantity


class Task(NamedTuple):
    source: str | bytes
    fixed: dict[str, str]
    names: tuple[str, ...]
    options: dict[str, Any]


class _Read(Slopes):
    """What the measures of a transient read, and its derivatives."""

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import measured

        return [output for output in measured(ctx, "tran", "time") if output.expr is not None]


class Measures:
    """A deck that is run at other values. Raises DeckError."""

    def __init__(self, task: Task) -> None:
        from .. import pipeline
        from ..diagnostics import Span, deck_error
        from ..elaborate import flatten

        self.task = task
        self.deck = pipeline.load(task.source, task.fixed, options=task.options)
        self.said = list(self.deck.sink.diagnostics)
        self.place = Span(self.deck.file, 1, 1, 2)
        self.flat = flatten(self.deck, task.options.get("temp"))
        if self.flat.steps or self.flat.commands:
            what = ".step" if self.flat.steps else ".control"
            deck_error("E437", f"the deck has {what} itself, which says what is run", hint="take it out")
        if not self.flat.measures:
            deck_error(
                "E437", "the deck has no .meas: goals are of measures", hint=".meas tran vmax MAX v(out)"
            )
        self.names = [card.name for card in self.flat.measures]
        self.by_runs = False  # are derivatives differences of runs?

    def read(self, values: Mapping[str, float]) -> tuple[FlatDeck, dict[str, Any]]:
        from ..elaborate.quantity import with_values

        options = {**self.task.options, **({"temp": values["temp"]} if "temp" in values else {})}
        options.setdefault("reltol", RELTOL)
        return with_values(self.deck, values, self.place, options.get("temp"), said=self.said), options

    def run(self, values: tuple[float, ...]) -> dict[str, float]:
        """The measures. Raises ConvergenceError, DeckError."""
        from .. import pipeline

        flat, options = self.read(dict(zip(self.task.names, values, strict=True)))
        assembly, planned = pipeline.prepare(flat, options)
        result = pipeline.deliver(assembly, pipeline.solve(assembly, planned))
        return {m.name: float(m.value) for m in result.measured}

    def slopes(self, values: tuple[float, ...], sizes: tuple[float, ...]) -> dict[str, np.ndarray]:
        """Derivatives of the measures by the quantities. Raises ConvergenceError, DeckError."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        if not self.by_runs:
            try:
                return self._along(values, sizes)
            except (ConvergenceError, DeckError):
                self.by_runs = True
        found: dict[str, list[float]] = {name: [] for name in self.names}
        for k, size in enumerate(sizes):
            up, down = ({**dict(enumerate(values)), k: values[k] + by * STEP * size} for by in (1.0, -1.0))
            above, below = (self.run(tuple(p.values())) for p in (up, down))
            for name in self.names:
                found[name].append((above[name] - below[name]) / (2.0 * STEP * size))
        return {name: np.array(row) for name, row in found.items()}

    def _along(self, values: tuple[float, ...], sizes: tuple[float, ...]) -> dict[str, np.ndarray]:
        import numpy as np

        from ..analyses import plan, transients
        from ..analyses.slopes import DEGREE, solve, told
        from ..assemble import assemble
        from ..assemble.options import resolve
        from ..diagnostics import ConvergenceError, deck_error
        from ..measures import measure

        given = dict(zip(self.task.names, values, strict=True))
        flat, options = self.read(given)
        settings = resolve(flat, options)
        planned = plan(flat, settings.pop("tmax", None))
        runs = transients(planned)
        if len(runs) != 1 or any(card.analysis != "tran" for card in flat.measures):
            deck_error("E437", "not all measures are of one transient")
        analysis = _Read(runs[0].card, (), self.task.names)
        assembly = assemble(flat, settings, runs[0].times(), analyses=[analysis])
        waves, along = solve(assembly, runs[0], analysis, self.task.names)
        if trouble := told(assembly, analysis, runs[0], waves, self.task.names):
            raise ConvergenceError(trouble, None)
        outputs = len(assembly.outputs[analysis])
        rows = [np.frombuffer(waves.column(k)) for k in range(1 + outputs)]
        fine = [np.frombuffer(waves.inside(k)) for k in range(1 + outputs)]
        at_rows, at_fine = along.at(rows[0]), along.at(fine[0])
        found: dict[str, list[float]] = {name: [] for name in self.names}
        for k, (name, size) in enumerate(zip(self.task.names, sizes, strict=True)):
            ends = []
            for by in (STEP * size, -STEP * size):
                cards = self.read({**given, name: given[name] + by})[0].measures
                tables = [
                    _table(
                        assembly,
                        analysis,
                        runs[0],
                        [data[0], *(c + by * s for c, s in zip(data[1:], slope.T, strict=True))],
                    )
                    for data, slope in ((rows, at_rows[:, k]), (fine, at_fine[:, k]))
                ]
                for card in cards:
                    card.analysis = "tran"
                ends.append({m.name: m.value for m in measure(cards, tables[0], fine=(tables[1], DEGREE))})
            for measured in self.names:
                found[measured].append((ends[0][measured] - ends[1][measured]) / (2.0 * STEP * size))
        return {name: np.array(row) for name, row in found.items()}


def _table(assembly: Assembly, analysis: Slopes, tran: Tran, data: list[np.ndarray]) -> Any:
    from ..store import Columns
    from ..table import Table

    outputs = assembly.outputs[analysis]
    names, units = ["time", *(o.name for o in outputs)], ["s", *(o.unit for o in outputs)]
    return Table("tran", names, units, Columns([c.tobytes() for c in data]), axis=tran.axis)
