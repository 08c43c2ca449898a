"""`emsim.fit`: values of quantities that let a deck's curves go through measured ones.

Least squares of what is left, (curve - data)/sigma, by scipy.optimize.least_squares (trust region within bounds) with the exact
derivatives that the run has beside it (analyses/slopes.py). Where the noise of signals is not given, each signal is first
weighed by the spread of its data, then by what was left of it, until the weights stand: for normal noise that is the likeliest
answer.
"""

from __future__ import annotations

import math
import os

from ..pipeline import path_or_text
from . import data as curves
from . import quantities
from .certainty import LEVEL, Certainty
from .model import Model, Task
from .workers import everywhere as search_everywhere

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    import numpy as np

    from ..source import Source
    from .data import Data
    from .quantities import Quantity

    Progress = Callable[[int, float], object]

WEIGHINGS = 4  # at most
STANDS = 0.1  # weights that change by less
FIRST, END = 1e-4, 1e-8  # how near the least squares are to be found, while weights are, and at last
RUNS = 200  # of one search, at most
LEAST = 1e-3  # of its start: what is smaller is known in parts of that
# what holds places that the data do not tell: known before to so many times e, or to so much of what the data tell
PRIOR, NOTHING = 0.1, 1e-7
NEVER = 1e12  # the cost of a run that failed, in a search over all of the bounds


class Fitted:
    """What was found.

    values        name -> value
    intervals     name -> (low, high) that holds the true value with probability `level`; infinite where the data do not tell
    correlation   array, in the order of `names`
    mixtures      what the data cannot tell apart (certainty.Mixture)
    at_bounds     names whose value is one of its bounds: their intervals are not known
    left          signal -> root mean square of curve - data
    """

    def __init__(self, quantities: list[Quantity], data: Data) -> None:
        self.quantities, self.data = quantities, data
        self.names = [q.name for q in quantities]
        self.values: dict[str, float] = {}
        self.intervals: dict[str, tuple[float, float]] = {}
        self.correlation: Any = None
        self.mixtures: list[Any] = []
        self.at_bounds: list[str] = []
        self.left: dict[str, float] = {}
        self.curves: Any = None
        self.runs, self.converged, self.level = 0, False, LEVEL

    def __repr__(self) -> str:
        return f"<Fitted {', '.join(f'{name}={value:.6g}' for name, value in self.values.items())}>"

    def correlated(self, least: float = 0.95) -> list[tuple[str, str, float]]:
        """Pairs of quantities that are known together only."""
        pairs = [(i, j) for i in range(len(self.names)) for j in range(i)]
        found = [(self.names[j], self.names[i], float(self.correlation[i, j])) for i, j in pairs]
        return sorted((f for f in found if abs(f[2]) >= least), key=lambda f: -abs(f[2]))


def fit(
    source: Source,
    data: Any,
    vary: Mapping[str, object] | Sequence[str] | str,
    columns: Mapping[str, str] | None = None,
    sigma: float | Mapping[str, float] | None = None,
    options: Mapping[str, Any] | None = None,
    everywhere: bool = False,
    seed: int = 1,
    jobs: int | None = 1,
    defines: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Fitted:
    """Fits a deck's transient to measured curves.

    source      a path, or the text itself
    data        a CSV file, a mapping of names to values, or a DataFrame: `time` [s], and a column for each signal, named as
                .print names it; nan is no measurement
    vary        what is to be found: ["r", "c=1n..1u", "m1(ke)"], or {"r": None, "c": (1e-9, 1e-6), "k": (0, 1, 0.2)}
    columns     signals of columns that have other names: {"speed": "omega(j1)"}; "" leaves a column out
    sigma       standard deviation of the noise, of all signals or by signal; left out: found from what is left
    everywhere  first look all over the bounds, by differential evolution (`seed`), in `jobs` processes
    progress    called with (runs, root mean square of what is left in units of sigma); a true value ends the search
    Raises DeckError, ConvergenceError (the run with the start values fails), ValueError, OSError.
    """
    import numpy as np
    from scipy.optimize import least_squares

    measured = curves.read(data, columns)
    asked = quantities.read(vary)
    task = Task(
        path_or_text(source), {k: str(v) for k, v in (defines or {}).items()},
        tuple(q.name for q in asked), tuple(measured.names), measured.times.tobytes(),
        {key.lower(): value for key, value in (options or {}).items()},
    )  # fmt: skip
    model = Model(task)
    asked = [q.begun(_own(model, q)) for q in asked]
    search = _Search(model, asked, measured, progress)
    given = _sigmas(sigma, measured)
    search.weigh(given if given is not None else _spreads(measured))
    places = np.array([q.inner(q.first) for q in asked])
    search.look(places, told=True)  # a start that fails is told as what it is
    if everywhere:
        job = (task, asked, measured.values.tobytes(), search.sigmas.tobytes())
        places, runs = search_everywhere(asked, _cost, job, seed, jobs or os.cpu_count() or 1, search.heard)
        search.runs += runs
    low = np.array([q.inner(q.low) if q.low > -math.inf else -math.inf for q in asked])
    high = np.array([q.inner(q.high) if q.high < math.inf else math.inf for q in asked])
    places = np.clip(places, low, high)
    near = END if given is not None else FIRST
    for again in range(WEIGHINGS):
        hold = PRIOR + NOTHING * float(np.linalg.norm(search.slopes(places), 2))
        first = places

        def left(x: np.ndarray, hold: float = hold, first: np.ndarray = first) -> np.ndarray:
            return np.concatenate((search.left(x), hold * (x - first)))

        def slopes(x: np.ndarray, hold: float = hold) -> np.ndarray:
            return np.concatenate((search.slopes(x), hold * np.eye(len(x))))

        found = least_squares(
            left, places, slopes, bounds=(low, high), x_scale="jac", method="trf", max_nfev=RUNS,
            ftol=near, xtol=near, gtol=1e-12,
        )  # fmt: skip
        places = found.x
        before, after = search.sigmas, search.spread(places)
        still = bool(np.all(np.abs(after / before - 1.0) < STANDS))
        if near == END or search.stopped:
            break
        search.weigh(after)
        near = END if still or again + 2 == WEIGHINGS else FIRST
    return search.told(found, given is not None)


def _own(model: Model, q: Quantity) -> float:
    from ..elaborate.quantity import value

    return value(model.flat, q.name)


def _sigmas(sigma: float | Mapping[str, float] | None, data: Data) -> np.ndarray | None:
    import numpy as np

    if sigma is None:
        return None
    if not isinstance(sigma, (int, float)):
        if lacking := next((name for name in data.names if name not in sigma), None):
            raise ValueError(f"sigma has nothing for `{lacking}`")
        found = np.array([float(sigma[name]) for name in data.names])
    else:
        found = np.full(len(data.names), float(sigma))
    if not (found > 0.0).all():
        raise ValueError("sigma must be above zero")
    return found


def _spreads(data: Data) -> np.ndarray:
    import numpy as np

    spread = np.nanstd(data.values, axis=0)
    return np.where(spread > 0.0, spread, 1.0)


class _Search:
    """Residuals and their derivatives at places, one run for both."""

    def __init__(self, model: Model, asked: list[Quantity], data: Data, progress: Progress | None) -> None:
        import numpy as np

        self.model, self.asked, self.data, self.progress = model, asked, data, progress
        self.known = np.isfinite(data.values)
        if not self.known.any():
            raise ValueError("the data have no number")
        self.sigmas = np.ones(len(data.names))
        self.runs, self.stopped = 0, False
        self._at: bytes | None = None
        self._found: tuple[Any, Any] | None = None

    def heard(self, cost: float) -> bool:
        if self.progress is not None:
            left = math.sqrt(cost / max(int(self.known.sum()), 1))
            self.stopped = bool(self.progress(self.runs, left)) or self.stopped
        return self.stopped

    def weigh(self, sigmas: np.ndarray) -> None:
        self.sigmas = sigmas

    def look(self, places: np.ndarray, told: bool = False) -> tuple[np.ndarray, np.ndarray] | None:
        """Curves and their derivatives by the places; None where the run fails."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        key = np.asarray(places, float).tobytes()
        if key != self._at:
            values = [q.outer(float(p)) for q, p in zip(self.asked, places, strict=True)]
            try:
                y, slopes = self.model.run(tuple(values))
                chain = np.array([q.slope(v) for q, v in zip(self.asked, values, strict=True)])
                self._found = y, slopes * chain
            except (ConvergenceError, DeckError):
                if told:
                    raise
                self._found = None
            self._at, self.runs = key, self.runs + 1
            if self.progress is not None and self._found is not None:
                left = self._residual(self._found[0])
                self.stopped = (
                    bool(self.progress(self.runs, float(np.sqrt(np.mean(left**2))))) or self.stopped
                )
        return self._found

    def _residual(self, y: np.ndarray) -> np.ndarray:
        return ((y - self.data.values) / self.sigmas)[self.known]

    def left(self, places: np.ndarray) -> np.ndarray:
        import numpy as np

        found = self.look(places)
        if found is None or self.stopped:
            return np.full(int(self.known.sum()), np.nan if found is None else 0.0)
        return self._residual(found[0])

    def slopes(self, places: np.ndarray) -> np.ndarray:
        import numpy as np

        found = self.look(places)
        if found is None:
            return np.zeros((int(self.known.sum()), len(self.asked)))
        return (found[1] / self.sigmas[:, None])[self.known]

    def spread(self, places: np.ndarray) -> np.ndarray:
        """Root mean square of what is left of each signal."""
        import numpy as np

        found = self.look(places)
        assert found is not None
        left = np.where(self.known, found[0] - self.data.values, 0.0)
        count = np.maximum(self.known.sum(axis=0), 1)
        spread = np.sqrt((left**2).sum(axis=0) / count)
        scale = np.abs(np.where(self.known, self.data.values, 0.0)).max(axis=0)
        return np.maximum(spread, 1e-12 * np.where(scale > 0.0, scale, 1.0))

    def told(self, found: Any, known_noise: bool) -> Fitted:
        import numpy as np

        look = self.look(found.x)
        assert look is not None
        fitted = Fitted(self.asked, self.data)
        fitted.runs, fitted.converged = self.runs, bool(found.success) and not self.stopped
        fitted.curves = look[0]
        left, jacobian = self._residual(look[0]), self.slopes(found.x)
        # in parts of values: of the start's where one has shrunk to nothing beside it
        values = [q.outer(float(place)) for q, place in zip(self.asked, found.x, strict=True)]
        sizes = np.array([max(abs(v), LEAST * q.size) for q, v in zip(self.asked, values, strict=True)])
        jacobian = jacobian / np.array([q.slope(v) for q, v in zip(self.asked, values, strict=True)]) * sizes
        free = np.flatnonzero(np.asarray(found.active_mask) == 0)
        freedom = len(left) - len(free)
        names = [self.asked[k].name for k in free]
        sure = Certainty(names, jacobian[:, free], left, freedom, 1.0 if known_noise else None)
        n = len(self.asked)
        fitted.correlation = np.eye(n)
        fitted.correlation[np.ix_(free, free)] = sure.correlation
        reach = np.full(n, np.inf)
        reach[free] = sure.reach()
        fitted.mixtures = sure.mixtures
        for k, (q, value) in enumerate(zip(self.asked, values, strict=True)):
            fitted.values[q.name] = value
            around = value - reach[k] * sizes[k], value + reach[k] * sizes[k]
            fitted.intervals[q.name] = (
                max(float(around[0]), 0.0) if q.by_ratio else float(around[0]),
                float(around[1]),
            )
            if k not in free:
                fitted.at_bounds.append(q.name)
        spread = self.spread(found.x)
        fitted.left = {name: float(s) for name, s in zip(self.data.names, spread, strict=True)}
        return fitted


def _cost(job: tuple[Task, list[Quantity], bytes, bytes]) -> Callable[[Any], float]:
    """Sum of squares at a place, in a worker's process."""
    import numpy as np

    from ..diagnostics import ConvergenceError, DeckError

    task, asked, values, sigmas = job
    model = Model(task)
    weights = np.frombuffer(sigmas)
    data = np.frombuffer(values).reshape(-1, len(weights))
    known = np.isfinite(data)

    def cost(places: Any) -> float:
        try:
            y, _ = model.run(
                tuple(q.outer(float(p)) for q, p in zip(asked, places, strict=True)), slopes=False
            )
        except (ConvergenceError, DeckError):
            return NEVER
        left = ((y - data) / weights)[known]
        total = float(left @ left)
        return total if math.isfinite(total) else NEVER

    return cost
