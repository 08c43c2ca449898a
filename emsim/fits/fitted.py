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
from .priors import Priors
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
    experiments   the data of each and the curves fitted to them; `data` and `curves` are those of the first
    """

    def __init__(self, quantities: list[Quantity], experiments: list[tuple[Data, Any]]) -> None:
        self.quantities, self.experiments = quantities, experiments
        self.data, self.curves = experiments[0]
        self.names = [q.name for q in quantities]
        self.values: dict[str, float] = {}
        self.intervals: dict[str, tuple[float, float]] = {}
        self.correlation: Any = None
        self.mixtures: list[Any] = []
        self.at_bounds: list[str] = []
        self.left: dict[str, float] = {}
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
    priors: Mapping[str, object] | None = None,
) -> Fitted:
    """Fits a deck's transient to measured curves.

    source      a path, or the text itself
    data        a CSV file, a mapping of names to values, or a DataFrame: `time` [s], and a column for each signal, named as
                .print names it; nan is no measurement, a column sigma(v(out)) the standard deviation of each value. A list of
                several experiments, each alone or with what was set in it: [("a.csv", {"vin": 5}), ("b.csv", {"temp": 85})]
    vary        what is to be found: ["r", "c=1n..1u", "m1(ke)"], or {"r": None, "c": (1e-9, 1e-6), "k": (0, 1, 0.2)}
    columns     signals of columns that have other names: {"speed": "omega(j1)"}; "" leaves a column out
    sigma       standard deviation of the noise, of all signals or by signal; left out: found from what is left
    everywhere  first look all over the bounds, by differential evolution (`seed`), in `jobs` processes
    priors      what is known before: {"r": (1e3, 50)}, normal with this mean and standard deviation, or "1k+-5%"
    progress    called with (runs, root mean square of what is left in units of sigma); a true value ends the search
    Raises DeckError, ConvergenceError (the run with the start values fails), ValueError, OSError.
    """
    import numpy as np
    from scipy.optimize import least_squares

    asked, tasks, parts = _experiments(
        source, curves.experiments(data, columns), vary, sigma, options, defines
    )
    search = _Search(parts, asked, Priors(priors or {}, asked), progress)
    known_noise = all(bool(part.told.all()) for part in parts)
    places = np.array([q.inner(q.first) for q in asked])
    search.look(places, told=True)  # a start that fails is told as what it is
    if everywhere:
        job = (
            tasks,
            asked,
            [(part.data.values, part.scale) for part in parts],
            search.priors,
        )
        places, runs = search_everywhere(asked, _cost, job, seed, jobs or os.cpu_count() or 1, search.heard)
        search.runs += runs
    low = np.array([q.inner(q.low) if q.low > -math.inf else -math.inf for q in asked])
    high = np.array([q.inner(q.high) if q.high < math.inf else math.inf for q in asked])
    places = np.clip(places, low, high)
    near = END if known_noise else FIRST
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
        changes = [part.weighed(spread) for part, spread in zip(parts, search.spreads(places), strict=True)]
        still = max(changes) < STANDS
        if near == END or search.stopped:
            break
        search.weigh(places)
        near = END if still or again + 2 == WEIGHINGS else FIRST
    return search.told(found, known_noise)


def _experiments(
    source: Source,
    measured: list[Data],
    vary: Mapping[str, object] | Sequence[str] | str,
    sigma: float | Mapping[str, float] | None,
    options: Mapping[str, Any] | None,
    defines: Mapping[str, Any] | None,
) -> tuple[list[Quantity], list[Task], list[_Part]]:
    """What is to be found, from where on, and the deck of each experiment with its data."""
    asked = quantities.read(vary)
    for one in measured:
        if both := next((q.name for q in asked if q.name in one.conditions), None):
            raise ValueError(f"`{both}` is to be found, and is a condition of an experiment")
    tasks = [
        Task(
            path_or_text(source), {k: str(v) for k, v in (defines or {}).items()},
            tuple(q.name for q in asked), tuple(one.names), one.times.tobytes(),
            {key.lower(): value for key, value in (options or {}).items()}, tuple(one.conditions.items()),
        )
        for one in measured
    ]  # fmt: skip
    models = [Model(task) for task in tasks]
    asked = [q.begun(_own(models[0], q)) for q in asked]
    return asked, tasks, [_Part(model, one, sigma) for model, one in zip(models, measured, strict=True)]


def _own(model: Model, q: Quantity) -> float:
    from ..elaborate.quantity import value

    return value(model.flat, q.name)


def _sigmas(sigma: float | Mapping[str, float] | None, names: Sequence[str]) -> np.ndarray | None:
    import numpy as np

    if sigma is None:
        return None
    if not isinstance(sigma, (int, float)):
        if lacking := next((name for name in names if name not in sigma), None):
            raise ValueError(f"sigma has nothing for `{lacking}`")
        found = np.array([float(sigma[name]) for name in names])
    else:
        found = np.full(len(names), float(sigma))
    if not (found > 0.0).all():
        raise ValueError("sigma must be above zero")
    return found


class _Part:
    """One experiment: its deck, its data, and by what these are weighed. `told`: signals whose noise was given."""

    def __init__(self, model: Model, data: Data, sigma: float | Mapping[str, float] | None) -> None:
        import numpy as np

        self.model, self.data = model, data
        self.known = np.isfinite(data.values)
        if not self.known.any():
            raise ValueError("the data have no number")
        stated = np.isfinite(data.errors).any(axis=0)
        given = (
            None
            if stated.all()
            else _sigmas(sigma, [n for n, has in zip(data.names, stated, strict=True) if not has])
        )
        spread = np.nanstd(np.where(self.known.any(axis=0), data.values, 0.0), axis=0)
        self.sigmas = np.where(spread > 0.0, spread, 1.0)
        self.told = stated
        if given is not None:
            self.sigmas[~stated], self.told = given, np.ones(len(data.names), bool)

    @property
    def scale(self) -> np.ndarray:
        """Of each value the standard deviation."""
        import numpy as np

        return np.where(np.isfinite(self.data.errors), self.data.errors, self.sigmas)

    def weighed(self, spread: np.ndarray) -> float:
        """How much weights change by what is left."""
        return max(
            (abs(a / b - 1.0) for a, b, told in zip(spread, self.sigmas, self.told, strict=True) if not told),
            default=0.0,
        )

    def residual(self, y: np.ndarray) -> np.ndarray:
        found: np.ndarray = ((y - self.data.values) / self.scale)[self.known]
        return found

    def slopes(self, slopes: np.ndarray) -> np.ndarray:
        found: np.ndarray = (slopes / self.scale[:, :, None])[self.known]
        return found

    def spread(self, y: np.ndarray) -> np.ndarray:
        """Root mean square of what is left of each signal."""
        import numpy as np

        left = np.where(self.known, y - self.data.values, 0.0)
        count = np.maximum(self.known.sum(axis=0), 1)
        spread = np.sqrt((left**2).sum(axis=0) / count)
        scale = np.abs(np.where(self.known, self.data.values, 0.0)).max(axis=0)
        found: np.ndarray = np.maximum(spread, 1e-12 * np.where(scale > 0.0, scale, 1.0))
        return found


class _Search:
    """Residuals and their derivatives at places, one run of each experiment for both; behind them what is known before."""

    def __init__(
        self, parts: list[_Part], asked: list[Quantity], priors: Priors, progress: Progress | None
    ) -> None:
        self.parts, self.asked, self.priors, self.progress = parts, asked, priors, progress
        self.count = sum(int(part.known.sum()) for part in parts) + len(priors)
        self.runs, self.stopped = 0, False
        self._at: bytes | None = None
        self._found: list[tuple[Any, Any]] | None = None

    def heard(self, cost: float) -> bool:
        if self.progress is not None:
            self.stopped = (
                bool(self.progress(self.runs, math.sqrt(cost / max(self.count, 1)))) or self.stopped
            )
        return self.stopped

    def weigh(self, places: np.ndarray) -> None:
        """Signals whose noise was not given, by what is left of them."""
        for part, spread in zip(self.parts, self.spreads(places), strict=True):
            part.sigmas[~part.told] = spread[~part.told]

    def values(self, places: np.ndarray) -> list[float]:
        return [q.outer(float(p)) for q, p in zip(self.asked, places, strict=True)]

    def look(self, places: np.ndarray, told: bool = False) -> list[tuple[np.ndarray, np.ndarray]] | None:
        """Of each experiment curves and their derivatives by the places; None where a run fails."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        key = np.asarray(places, float).tobytes()
        if key != self._at:
            values = self.values(places)
            chain = np.array([q.slope(v) for q, v in zip(self.asked, values, strict=True)])
            try:
                runs = [part.model.run(tuple(values)) for part in self.parts]
                self._found = [(y, slopes * chain) for y, slopes in runs]
            except (ConvergenceError, DeckError):
                if told:
                    raise
                self._found = None
            self._at, self.runs = key, self.runs + len(self.parts)
            if self._found is not None:
                left = self._residual(self._found, values)
                self.heard(float(left @ left))
        return self._found

    def _residual(self, found: list[tuple[np.ndarray, np.ndarray]], values: Sequence[float]) -> np.ndarray:
        import numpy as np

        parts = [part.residual(y) for part, (y, _) in zip(self.parts, found, strict=True)]
        return np.concatenate((*parts, self.priors.residual(values)))

    def left(self, places: np.ndarray) -> np.ndarray:
        import numpy as np

        found = self.look(places)
        if found is None or self.stopped:
            return np.full(self.count, np.nan if found is None else 0.0)
        return self._residual(found, self.values(places))

    def slopes(self, places: np.ndarray) -> np.ndarray:
        import numpy as np

        found = self.look(places)
        if found is None:
            return np.zeros((self.count, len(self.asked)))
        parts = [part.slopes(slopes) for part, (_, slopes) in zip(self.parts, found, strict=True)]
        return np.concatenate((*parts, self.priors.slopes(self.asked, self.values(places))))

    def spreads(self, places: np.ndarray) -> list[np.ndarray]:
        found = self.look(places)
        assert found is not None
        return [part.spread(y) for part, (y, _) in zip(self.parts, found, strict=True)]

    def told(self, found: Any, known_noise: bool) -> Fitted:
        import numpy as np

        look = self.look(found.x)
        assert look is not None
        fitted = Fitted(self.asked, [(part.data, y) for part, (y, _) in zip(self.parts, look, strict=True)])
        fitted.runs, fitted.converged = self.runs, bool(found.success) and not self.stopped
        # in parts of values: of the start's where one has shrunk to nothing beside it
        values = self.values(found.x)
        left, jacobian = self._residual(look, values), self.slopes(found.x)
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
        fitted.left = self._over_all(found.x)
        return fitted

    def _over_all(self, places: np.ndarray) -> dict[str, float]:
        """Root mean square of what is left of each signal, of all experiments that measured it."""
        sums: dict[str, tuple[float, int]] = {}
        for part, spread in zip(self.parts, self.spreads(places), strict=True):
            for name, rms, count in zip(part.data.names, spread, part.known.sum(axis=0), strict=True):
                total, n = sums.get(name, (0.0, 0))
                sums[name] = total + float(rms) ** 2 * int(count), n + int(count)
        return {name: math.sqrt(total / max(n, 1)) for name, (total, n) in sums.items()}


def _cost(job: tuple[list[Task], list[Quantity], list[tuple[Any, Any]], Priors]) -> Callable[[Any], float]:
    """Sum of squares at a place, in a worker's process."""
    import numpy as np

    from ..diagnostics import ConvergenceError, DeckError

    tasks, asked, parts, priors = job
    models = [Model(task) for task in tasks]
    known = [np.isfinite(data) for data, _ in parts]

    def cost(places: Any) -> float:
        values = tuple(q.outer(float(p)) for q, p in zip(asked, places, strict=True))
        try:
            curves = [model.run(values, slopes=False)[0] for model in models]
        except (ConvergenceError, DeckError):
            return NEVER
        left = [((y - data) / scale)[at] for y, (data, scale), at in zip(curves, parts, known, strict=True)]
        total = sum(float(part @ part) for part in (*left, priors.residual(values)))
        return total if math.isfinite(total) else NEVER

    return cost
