"""The deck's transient at other values of some quantities, with its derivatives by them."""

from __future__ import annotations

from typing import NamedTuple

from ..gradients.asked import RELTOL

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    import numpy as np


class Task(NamedTuple):
    """What every process is told of a fit."""

    source: str | bytes  # path, or text
    fixed: dict[str, str]
    names: tuple[str, ...]  # quantities
    signals: tuple[str, ...]
    times: bytes  # of the data, float64
    options: dict[str, Any]
    conditions: tuple[tuple[str, float], ...] = ()  # of the experiment


class Model:
    """A deck that is run at other values. Raises DeckError."""

    def __init__(self, task: Task) -> None:
        import numpy as np

        from .. import pipeline
        from ..build import parse_signals
        from ..diagnostics import Span, deck_error
        from ..elaborate import flatten
        from ..elaborate.quantity import value

        self.task, self.times = task, np.frombuffer(task.times)
        self.deck = pipeline.load(task.source, task.fixed, options=task.options)
        self.said = list(self.deck.sink.diagnostics)
        self.place = Span(self.deck.file, 1, 1, 2)
        self.probes = [probe for text in task.signals for probe in parse_signals(text)]
        self.flat = flatten(self.deck, task.options.get("temp"))
        if self.flat.steps or self.flat.commands:
            what = ".step" if self.flat.steps else ".control"
            deck_error("E437", f"the deck has {what} itself, which says what is run", hint="take it out")
        for name, _ in task.conditions:
            value(self.flat, name)  # raises where nothing has it

    def run(self, values: tuple[float, ...], slopes: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Signals at the data's times, array of (times, signals), and their derivatives, (times, signals, quantities). Raises
        ConvergenceError, DeckError."""
        import numpy as np

        from ..analyses import plan, transients
        from ..analyses.slopes import Slopes, solve, told
        from ..assemble import assemble
        from ..assemble.options import resolve
        from ..diagnostics import ConvergenceError, deck_error
        from ..elaborate.quantity import with_values
        from ..source import NoCollection

        task = self.task
        given = {**dict(task.conditions), **dict(zip(task.names, values, strict=True))}
        options = {**task.options, **({"temp": given["temp"]} if "temp" in given else {})}
        flat = with_values(self.deck, given, self.place, options.get("temp"), said=self.said)
        settings = resolve(flat, options)
        if "reltol" not in options:
            settings["reltol"] = min(settings.get("reltol", RELTOL), RELTOL)
        found = transients(plan(flat, settings.pop("tmax", None)))
        if not found:
            deck_error(
                "E437", "the deck has no .tran: curves over time are fitted", hint="add .tran tstep tstop"
            )
        tran = found[-1]
        if self.times[0] < tran.tstart or self.times[-1] > tran.tstop:
            spans = (self.times[0], self.times[-1]), (tran.tstart, tran.tstop)
            said = ", the deck's run ".join(f"from {a:g} to {b:g} s" for a, b in spans)
            said = f"data go {said}"
            deck_error("E437", said, tran.card.span, "let .tran run as long as the data are")
        analysis = Slopes(tran.card, self.probes, task.names)
        with NoCollection():
            assembly = assemble(flat, settings, tran.times(), analyses=[analysis])
            waves, along = solve(assembly, tran, analysis, task.names if slopes else ())
        if trouble := told(assembly, analysis, tran, waves, task.names):
            raise ConvergenceError(trouble, None)
        y = along.values(self.times)
        return y, np.swapaxes(along.at(self.times), 1, 2) if slopes else np.zeros((*y.shape, 0))
