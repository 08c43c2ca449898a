"""Derivatives of measures along a transient.

Signals have derivatives at each time, and jumps at times that have derivatives themselves. So both are moved: of the times t
of the steps' points it is t + e theta(t), of a signal y + e (s + dy/dt theta), with theta straight between events and there
dtau/dp, 0 at both ends of the run. A jump stays between the same two points, and all that is measured follows: crossings
within it, areas on both sides of it, peaks at it.
"""

from __future__ import annotations

from ..analyses.slopes import DEGREE, STEP, Slopes, solve, told
from .moved import at_one_instant, derivative, values

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    import numpy as np

    from ..analyses import Tran
    from ..analyses.slopes import Along
    from ..assemble import Assembly, Context, Output
    from ..deck import Measure
    from ..diagnostics import Diagnostic
    from ..elaborate.flat import FlatDeck
    from ..measures import Measured


class Read(Slopes):
    """What the measures of a transient read, and its derivatives."""

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import measured

        return [output for output in measured(ctx, "tran", "time") if output.expr is not None]


def along(
    flat: FlatDeck, settings: dict[str, Any], tran: Tran, cards: Sequence[Measure], names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, list[Diagnostic]]:
    """Values of the cards, their derivatives, array (cards, names), and what is to be said. Raises DeckError,
    ConvergenceError."""
    import numpy as np

    from ..assemble import assemble
    from ..diagnostics import ConvergenceError, Sink
    from ..elaborate.quantity import reread, value
    from ..measures import check
    from ..source import NoCollection

    flat.measures = list(cards)
    check(flat.measures, Sink())
    analysis = Read(tran.card, (), names)
    with NoCollection():
        assembly = assemble(flat, settings, tran.times(), analyses=[analysis])
        waves, slopes = solve(assembly, tran, analysis, names)
    if trouble := told(assembly, analysis, tran, waves, names):
        raise ConvergenceError(trouble, None)
    course = Course(assembly, analysis, tran, slopes)
    here = course.measures(cards)
    numbers = values(cards, here)
    matrix, remarks = np.zeros((len(cards), len(names))), []

    def with_(name: str, by: float) -> list[Measure]:
        """The cards with another value of a quantity that they may read themselves."""
        other = {c.name: c for c in reread(flat, {name: value(flat, name) + by}).measures}
        return [_named(other.get(card.name, card), card) for card in cards]

    for k, name in enumerate(names):
        size = abs(value(flat, name)) or 1.0
        step, crowded = course.direction(k, STEP * size)
        if crowded is not None:
            remarks.append(at_one_instant(name, crowded))
        fixed = repr(with_(name, step)) == repr(list(cards))

        def moved(by: float, k: int = k, name: str = name, fixed: bool = fixed) -> list[Measured]:
            return course.measures(cards if fixed else with_(name, by), k, by)

        matrix[:, k] = derivative(cards, moved, here, name, step)
    return numbers, matrix, remarks


def _named(card: Measure, like: Measure) -> Measure:
    card.analysis = like.analysis
    return card


class Course:
    """The signals of a run at Chebyshev's points of its steps, and the directions in which they move."""

    def __init__(self, assembly: Assembly, analysis: Slopes, tran: Tran, slopes: Along) -> None:
        import numpy as np

        from ..measures.curve import slopes as slope_matrix

        outputs = assembly.outputs[analysis]
        self.names, self.units = ["time", *(o.name for o in outputs)], ["s", *(o.unit for o in outputs)]
        self.tran, self.slopes = tran, slopes
        waves = slopes.waves
        columns = [np.frombuffer(waves.inside(k)) for k in range(len(self.names))]
        self.t = columns[0].reshape(-1, DEGREE + 1)
        self.y = np.stack(columns[1:]).reshape(len(outputs), *self.t.shape)
        width = (self.t[:, -1] - self.t[:, 0])[:, None]
        self.rates = (self.y @ slope_matrix(DEGREE).T) / np.where(width > 0.0, width, np.inf)
        self.s = slopes.raw(self.t)
        self.theta = np.zeros_like(self.t)
        self.k: int | None = None

    def direction(self, k: int, step: float) -> tuple[float, float | None]:
        """Chooses a quantity; how far it may go, and the time of events that are all but at one instant."""
        import numpy as np

        self.k = k
        nodes, moves = self.slopes.nodes(k)
        begin, end = self.t[0, 0], self.t[-1, -1]
        inner = (nodes > begin) & (nodes < end)
        nodes = np.concatenate(([begin], nodes[inner], [end]))
        moves = np.concatenate(([0.0], moves[inner], [0.0]))
        self.theta = np.interp(self.t, nodes, moves)
        lengths, change = np.diff(nodes), np.abs(np.diff(moves))
        same = change <= 1e-9 * np.abs(moves).max(initial=0.0)
        steep = np.where(same, 0.0, change / np.where(lengths > 0.0, lengths, 1e-300))
        most = float(steep.max(initial=0.0))
        # no stretch becomes shorter or longer by more than a tenth of itself
        if step * most <= 0.1:
            return step, None
        # where that takes so little, rounding is all that is seen
        least = 1e-4 * step
        if least * most <= 0.1:
            return 0.1 / most, None
        return least, float(nodes[int(np.argmax(steep))])

    def measures(self, cards: Sequence[Measure], k: int | None = None, by: float = 0.0) -> list[Measured]:
        """What the cards find in the signals, moved by so much of a quantity."""
        from ..measures import measure
        from ..store import Columns
        from ..table import Table

        t, y = self.t, self.y
        if k is not None:
            moved = self.s[k, :-1] + self.rates * (self.theta - self.s[k, -1])
            t, y = t + by * self.theta, y + by * moved
        fine = [t, *y]
        ends = [column[:, (0, -1)].ravel() for column in fine]
        start = max(self.tran.tstart, float(self.t[0, 0]))
        ends[0] = ends[0].clip(start, None)
        tables = [
            Table("tran", self.names, self.units, Columns([c.tobytes() for c in data]), axis=self.tran.axis)
            for data in (ends, fine)
        ]
        return measure(cards, tables[0], fine=(tables[1], DEGREE))
