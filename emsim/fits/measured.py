"""Measures of a deck at other values of some quantities, with their derivatives by them.

Derivatives are those of `emsim.Deck.gradient`, of one run an analysis. Where there are none (a line, a digital node, two
impacts at one time), they are differences of runs, and `by_runs` says why.
"""

from __future__ import annotations

from typing import NamedTuple

from ..gradients.asked import RELTOL

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import numpy as np

    from ..elaborate.flat import FlatDeck

STEP = 1e-4  # of a quantity


class Task(NamedTuple):
    source: str | bytes
    fixed: dict[str, str]
    names: tuple[str, ...]
    options: dict[str, Any]


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
        self.by_runs: str | None = None  # why derivatives are differences of runs

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

    def slopes(
        self, values: tuple[float, ...], sizes: tuple[float, ...], wanted: frozenset[str] | None = None
    ) -> dict[str, np.ndarray]:
        """Derivatives of the measures by the quantities; of all that are `wanted`. Raises ConvergenceError, DeckError."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        names = [name for name in self.names if wanted is None or name in wanted]
        if self.by_runs is None:
            try:
                return self._gradient(values, names)
            except (ConvergenceError, DeckError) as error:
                first = next((d for d in error.diagnostics if d.severity == "error"), None)
                self.by_runs = str(error) if first is None else first.message
        found: dict[str, list[float]] = {name: [] for name in names}
        for k, size in enumerate(sizes):
            up, down = ({**dict(enumerate(values)), k: values[k] + by * STEP * size} for by in (1.0, -1.0))
            above, below = (self.run(tuple(p.values())) for p in (up, down))
            for name in names:
                found[name].append((above[name] - below[name]) / (2.0 * STEP * size))
        return {name: np.array(row) for name, row in found.items()}

    def _gradient(self, values: tuple[float, ...], names: list[str]) -> dict[str, np.ndarray]:
        from ..gradients import gradient

        given = dict(zip(self.task.names, values, strict=True))
        kinds = {card.name: card.analysis for card in self.flat.measures}
        found: dict[str, np.ndarray] = {}
        for kind in dict.fromkeys(kinds[name] for name in names):
            flat, options = self.read(given)
            own = [name for name in names if kinds[name] == kind]
            one = gradient(flat, own, self.task.names, None, options)
            found |= {name: row for name, row in zip(one.names, one.matrix, strict=True) if name in own}
        return found
