"""Derivatives at an operating point and about it, by the adjoint.

At F(x, p) = 0 an output y(x, p) has, with a = G^-T dy/dx from one transposed solution,

    dy/dp = d/dp [ y(x, p) - a . F(x, p) ] at constant x and a,                                            (1)

and at (G + s C) X = b, with a = (G + s C)^-T dy/dX at each frequency,

    dy/dp = d/dp [ y(X, p) + a . (b - (G + s C) X) ] at constant X and a,                                  (2)

along with the operating point, dx/dp = -G^-1 dF/dp. These derivatives at constant solutions are differences of fourth order of
the equations alone, with other values of one quantity; nothing is solved with those.
"""

from __future__ import annotations

import math

from ..analyses.slopes import STEP, Slopes, others
from .moved import derivative, values

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    import numpy as np

    from .._engine import SmallSignal
    from ..analyses.ac import Ac
    from ..assemble import Assembly, Context, Output
    from ..deck import Measure
    from ..elaborate.flat import FlatDeck
    from ..measures import Measured

HELD = ("coordinate", "speed", "lambda", "mu")  # unknowns of a machine that stands still


class Read(Slopes):
    """What is read at points: by measures, or as it is asked for."""

    def __init__(self, analysis: Any, signals: Sequence[str] = ()) -> None:
        super().__init__(analysis.card, (), ())
        self.reads, self.signals = analysis.word, signals
        self.along = "" if analysis.axis is None else analysis.axis.name

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column, measured
        from ..build import parse_signals

        if not self.signals:
            found = measured(ctx, self.reads, self.along)
        else:
            probes = [probe for text in self.signals for probe in parse_signals(text)]
            found = [column(ctx, probe.text, probe.ast, self.card.span) for probe in probes]
        return [output for output in found if output.expr is not None]


class Point:
    """An operating point with what is read there, and the same deck with other values of quantities."""

    def __init__(
        self, flat: FlatDeck, settings: dict[str, Any], analysis: Any, signals: Sequence[str] = ()
    ) -> None:
        from ..assemble import assemble
        from ..diagnostics import deck_error
        from ..source import NoCollection

        self.analysis = analysis
        self.read = Read(analysis, signals)
        with NoCollection():
            self.assembly = assemble(flat, settings, (1.0, 1.0), analyses=[analysis, self.read])
        ctx = self.assembly.ctx
        if ctx.delayed or ctx.responses:
            said = "no gradient: lines and gains over frequency are functions of s, whose derivatives are not computed"
            deck_error(
                "E364",
                said,
                analysis.card.span,
                "take them out, or derive along a .tran of circuits in their place",
            )
        self.outputs = self.assembly.outputs[self.read]
        self.exprs: list[Any] = [o.expr for o in self.outputs]
        self.held = [not analysis.static and kind in HELD for kind in self.assembly.system.kinds]
        self.other: dict[str, list[tuple[float, float, Assembly]]] = {}

    def linearised(self, hold: bool, given: Sequence[tuple[int, float]] = ()) -> SmallSignal:
        """The equations about the operating point; `given`: values of sources, by their waves. Raises ConvergenceError."""
        from ..analyses.failure import explain_failure
        from ..diagnostics import ConvergenceError

        system, options = self.assembly.system, self.assembly.options
        linear, failure = system.small_signal(options, self.analysis.static, hold, list(given))
        if linear is None:
            raise ConvergenceError(explain_failure(self.assembly, self.analysis, dict(failure or {})), None)
        return linear

    def besides(self, name: str) -> list[tuple[float, float, Assembly]]:
        from ..diagnostics import deck_error

        if name not in self.other:
            found = others(self.assembly, self.read, name)[1]
            own = self.assembly.system
            if any(o.system.names != own.names or o.system.flag_names != own.flag_names for _, _, o in found):
                said = f"no gradient: the equations with another value of `{name}` are not the same ones"
                deck_error("E364", said, self.analysis.card.span)
            self.other[name] = found
        return self.other[name]

    def shown(self, other: Assembly) -> list[Any]:
        """What is read, of the deck with another value."""
        return [o.expr for o in other.outputs[self.read]]

    def residual(self, linear: SmallSignal, name: str) -> np.ndarray:
        """dF/dp at the point, array (unknowns,); of what stands still, how it does so, with a minus."""
        import numpy as np

        total = np.zeros(self.assembly.system.n)
        for _, weight, other in self.besides(name):
            there = linear.elsewhere(other.system, linear.x, not self.analysis.static)
            own = np.where(self.held, np.negative(np.array(other.system.initial())), np.array(there.residual))
            total += weight * own
        return total

    def slopes(self, linear: SmallSignal, names: Sequence[str]) -> np.ndarray:
        """Equation (1): array (outputs, names). One transposed solution an output."""
        import numpy as np

        adjoint = [[z[0] for z in linear.adjoint((0.0, 0.0), expr)] for expr in self.exprs]
        a = np.array(adjoint).reshape(len(self.exprs), self.assembly.system.n)
        found = np.zeros((len(self.exprs), len(names)))
        for k, name in enumerate(names):
            found[:, k] = -a @ self.residual(linear, name)
            for _, weight, other in self.besides(name):
                there = linear.elsewhere(other.system, linear.x, not self.analysis.static)
                found[:, k] += weight * np.array(there.values(self.shown(other)))
        return found

    def spectra(self, frequencies: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Equation (2): outputs, complex array (outputs, frequencies), and their derivatives (names, outputs, frequencies)."""
        import numpy as np

        from ..analyses.ac import excited
        from ..analyses.pencil import dense

        system, ctx = self.assembly.system, self.assembly.ctx
        still, linear = self.linearised(not self.analysis.static), self.linearised(False)
        s = [(0.0, 2.0 * math.pi * f) for f in frequencies.tolist()]
        sources = excited(ctx)
        columns = linear.respond(s, [*self.exprs, *(ctx.b.x(k) for k in range(system.n))], sources)
        whole = np.array([np.frombuffer(c, complex) for c in columns])
        y, x = whole[: len(self.exprs)], whole[len(self.exprs) :].T
        a = np.array([[[complex(*z) for z in linear.adjoint(p, expr)] for p in s] for expr in self.exprs])
        pairs = [[(z.real, z.imag) for z in row] for row in x.tolist()]
        frozen, found = dense(still)[0], np.zeros((len(names), *y.shape), complex)
        for k, name in enumerate(names):
            move = -np.linalg.solve(frozen, self.residual(still, name))
            for by, weight, other in self.besides(name):
                there = linear.elsewhere(other.system, (np.array(linear.x) + by * move).tolist(), False)
                shown, rows = there.weigh(s, pairs, self.shown(other), excited(other.ctx))
                g, c = dense(there)
                left = _complex(rows) - x @ g.T - np.array([complex(*p) for p in s])[:, None] * (x @ c.T)
                found[k] += weight * (_complex(shown).T + np.einsum("ofn,fn->of", a, left))
        return y, found


def _complex(pairs: Any) -> np.ndarray:
    import numpy as np

    both = np.array(pairs, float)
    found: np.ndarray = both[..., 0] + 1j * both[..., 1]
    return found


def responses(
    flat: FlatDeck,
    settings: dict[str, Any],
    analysis: Ac,
    signals: Sequence[str],
    at: np.ndarray,
    names: Sequence[str],
) -> tuple[np.ndarray, np.ndarray]:
    """Signals over frequency at some of them [Hz], complex, signal by signal, and their derivatives (signals and frequencies,
    names). Raises DeckError, ConvergenceError."""
    import numpy as np

    from ..diagnostics import deck_error

    point = Point(flat, settings, analysis, signals)
    if len(point.outputs) != len(signals):
        said = "no gradient: over frequency there is one of voltages, currents and motions, not of what is made of them"
        deck_error("E364", said, analysis.card.span, "ask for v(out), and go on with the complex numbers")
    y, slopes = point.spectra(np.asarray(at, float), names)
    found = np.moveaxis(slopes, 0, -1).reshape(y.size, len(names))
    return y.ravel(), found


def measured(
    flat: FlatDeck, settings: dict[str, Any], analysis: Any, cards: Sequence[Measure], names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Values of cards of .op, .dc or .ac, and their derivatives (cards, names). Raises DeckError, ConvergenceError."""
    import numpy as np

    from ..elaborate.quantity import reread, value

    flat.measures = list(cards)
    point = Point(flat, settings, analysis)
    axis, y, slopes = _columns(point, names)
    here = _measures(point, cards, axis, y)
    numbers = values(cards, here)
    matrix = np.zeros((len(cards), len(names)))
    for k, name in enumerate(names):
        size = abs(value(flat, name)) or 1.0

        def moved(by: float, k: int = k, name: str = name) -> list[Measured]:
            other = {c.name: c for c in reread(flat, {name: value(flat, name) + by}).measures}
            own = [other.get(card.name, card) for card in cards]
            for card in own:
                card.analysis = analysis.word
            return _measures(point, own, axis, y + by * slopes[k])

        matrix[:, k] = derivative(cards, moved, here, name, STEP * size)
    return numbers, matrix


def _columns(point: Point, names: Sequence[str]) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
    """The axis, what is read along it (outputs, places), and its derivatives (names, outputs, places)."""
    import numpy as np

    from ..analyses.ac import DEGREE, between

    analysis = point.analysis
    if analysis.word == "ac":
        places = np.array(between(analysis.frequencies, 1.0 + 1.0 / DEGREE if analysis.axis.log else 0.0))
        return places, *point.spectra(places, names)
    if analysis.word == "op":
        linear = point.linearised(not analysis.static)
        y = np.array(linear.values(point.exprs)).reshape(-1, 1)
        return None, y, np.moveaxis(point.slopes(linear, names), 1, 0)[..., None]
    (sweep,) = _sweeps(point)
    places = np.array([float(v) for v in sweep.values])
    wave = sweep.wave(point.assembly.ctx)
    rows, slopes = [], []
    for place in places.tolist():
        linear = point.linearised(not analysis.static, [(wave, place)])
        rows.append(linear.values(point.exprs))
        slopes.append(point.slopes(linear, names))
    return places, np.array(rows).T, np.transpose(np.array(slopes), (2, 1, 0))


def _sweeps(point: Point) -> list[Any]:
    """Of .dc: one source."""
    from ..diagnostics import deck_error

    sweeps = point.analysis.sweeps
    if len(sweeps) != 1 or not sweeps[0].is_source(point.assembly.ctx):
        said = "no gradient: of .dc there is one over one source"
        deck_error("E364", said, point.analysis.card.span, "run .op with each value, as a .param")
    found: list[Any] = sweeps
    return found


def _measures(
    point: Point, cards: Sequence[Measure], axis: np.ndarray | None, y: np.ndarray
) -> list[Measured]:
    from ..analyses.ac import DEGREE
    from ..measures import measure
    from ..store import Columns
    from ..table import Table

    analysis = point.analysis
    names, units = [o.name for o in point.outputs], [o.unit for o in point.outputs]
    complex = [bool(analysis.complex)] * len(names)
    data = [row.tobytes() for row in y]
    if axis is None:
        table = Table(analysis.word, names, units, Columns(data, complex=complex), axis=None)
        return measure(cards, table)
    names, units = [analysis.axis.name, *names], [analysis.axis.unit, *units]
    whole = Table(
        analysis.word,
        names,
        units,
        Columns([axis.tobytes(), *data], complex=[False, *complex]),
        axis=analysis.axis,
    )
    return measure(cards, whole, fine=(whole, DEGREE) if analysis.word == "ac" else None)
