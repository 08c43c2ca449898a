"""`emsim.optimise`: values of quantities with which a deck's measures meet their goals.

Goals alone are least squares of what they are missed by (scipy.optimize.least_squares); with something to be made small or large
they are constraints of it (SLSQP, sequential quadratic programming).
"""

from __future__ import annotations

import math
import os

from ..pipeline import path_or_text
from . import goals as aims
from . import quantities
from .fitted import NEVER, RUNS
from .measured import Measures, Task
from .workers import everywhere as search_everywhere

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    import numpy as np

    from ..source import Source
    from .goals import Goal
    from .quantities import Quantity

    Progress = Callable[[int, float], object]

MET = 1e-6  # the cost of goals that are all but met
FIRST = 1e3  # what a missed goal counts there beside what is made small


class Optimised:
    """`values` name -> value; `measures` of the deck there; `missed`: goals that are not met; `by_runs`: why derivatives were
    differences of runs, where they were."""

    def __init__(self, names: list[str], goals: list[Goal]) -> None:
        self.names, self.goals = names, goals
        self.values: dict[str, float] = {}
        self.measures: dict[str, float] = {}
        self.at_bounds: list[str] = []
        self.runs, self.converged = 0, False
        self.by_runs: str | None = None

    @property
    def missed(self) -> list[Goal]:
        return [goal for goal in self.goals if not goal.met(self.measures[goal.measure])]

    def __repr__(self) -> str:
        return f"<Optimised {', '.join(f'{name}={value:.6g}' for name, value in self.values.items())}>"


def optimise(
    source: Source,
    vary: Mapping[str, object] | Sequence[str] | str,
    goals: Sequence[str] | str = (),
    minimise: str | None = None,
    maximise: str | None = None,
    options: Mapping[str, Any] | None = None,
    everywhere: bool = False,
    seed: int = 1,
    jobs: int | None = 1,
    defines: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Optimised:
    """Finds values with which measures (.meas) are what they are to be.

    source      a path, or the text itself
    vary        what is to be found, as `emsim.fit` has it
    goals       "rise=1m", "vmax<1.2": all are to be met
    minimise    a measure that is to be as small as it can be then; or maximise
    everywhere  first look all over the bounds, by differential evolution (`seed`), in `jobs` processes
    progress    called with (runs, cost); a true value ends the search
    Raises DeckError, ConvergenceError (the run with the start values fails), ValueError.
    """
    import numpy as np

    from ..diagnostics import deck_error, did_you_mean

    asked = quantities.read(vary)
    wanted = [aims.read(text) for text in ((goals,) if isinstance(goals, str) else goals)]
    if minimise is not None and maximise is not None:
        raise ValueError("minimise and maximise exclude each other")
    aim = (minimise or maximise or "").lower()
    if not wanted and not aim:
        raise ValueError("there is no goal: goals=['vmax<1.2'], or minimise='power'")
    task = Task(
        path_or_text(source), {k: str(v) for k, v in (defines or {}).items()},
        tuple(q.name for q in asked), {key.lower(): value for key, value in (options or {}).items()},
    )  # fmt: skip
    deck = Measures(task)
    for name in (*(goal.measure for goal in wanted), *([aim] if aim else [])):
        if name not in deck.names:
            hint = did_you_mean(name, deck.names, "there are " + ", ".join(deck.names))
            deck_error("E438", f"the deck has no .meas `{name}`", hint=hint)
    from ..elaborate.quantity import value

    asked = [q.begun(value(deck.flat, q.name)) for q in asked]
    search = _Search(deck, asked, wanted, aim, -1.0 if maximise else 1.0, progress)
    places = np.array([q.inner(q.first) for q in asked])
    search.measures(places, told=True)
    if everywhere:
        job = (task, asked, wanted, aim, search.sign)
        places, runs = search_everywhere(
            asked,
            _cost,
            job,
            seed,
            jobs or os.cpu_count() or 1,
            lambda cost: search.stopped or (not aim and cost < MET),
        )
        search.runs += runs
    return search.solve(places)


class _Search:
    def __init__(
        self,
        deck: Measures,
        asked: list[Quantity],
        goals: list[Goal],
        aim: str,
        sign: float,
        progress: Progress | None,
    ) -> None:
        self.deck, self.asked, self.goals, self.aim, self.sign, self.progress = (
            deck,
            asked,
            goals,
            aim,
            sign,
            progress,
        )
        self.runs, self.stopped, self.size = 0, False, 1.0
        self.wanted = frozenset((*(goal.measure for goal in goals), *([aim] if aim else [])))
        self._measures: dict[bytes, dict[str, float] | None] = {}
        self._slopes: dict[bytes, dict[str, np.ndarray]] = {}

    def values(self, places: Any) -> tuple[float, ...]:
        return tuple(q.outer(float(p)) for q, p in zip(self.asked, places, strict=True))

    def measures(self, places: Any, told: bool = False) -> dict[str, float] | None:
        """None where the run fails."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        key = np.asarray(places, float).tobytes()
        if key not in self._measures:
            try:
                self._measures[key] = self.deck.run(self.values(places))
            except (ConvergenceError, DeckError):
                if told:
                    raise
                self._measures[key] = None
            self.runs += 1
            if self.progress is not None:
                self.stopped = (
                    bool(self.progress(self.runs, float(np.linalg.norm(self.left(places))))) or self.stopped
                )
        return self._measures[key]

    def slopes(self, places: Any) -> dict[str, np.ndarray]:
        """Derivatives of the measures by the places."""
        import numpy as np

        from ..diagnostics import ConvergenceError, DeckError

        key = np.asarray(places, float).tobytes()
        if key not in self._slopes:
            values = self.values(places)
            chain = np.array([q.slope(v) for q, v in zip(self.asked, values, strict=True)])
            try:
                sizes = tuple(abs(v) or q.size for q, v in zip(self.asked, values, strict=True))
                found = self.deck.slopes(values, sizes, self.wanted)
            except (ConvergenceError, DeckError):
                found = {name: np.zeros(len(self.asked)) for name in self.wanted}
            self._slopes = {key: {name: np.nan_to_num(row) * chain for name, row in found.items()}}
        return self._slopes[key]

    def left(self, places: Any) -> np.ndarray:
        import numpy as np

        found = self.measures(places)
        if found is None or self.stopped:
            return np.full(len(self.goals), np.nan if found is None else 0.0)
        return np.array([goal.missed(found[goal.measure]) for goal in self.goals])

    def jacobian(self, places: Any) -> np.ndarray:
        import numpy as np

        slopes, left = self.slopes(places), self.left(places)
        rows = [
            slopes[goal.measure] / goal.size * (off != 0.0)
            for goal, off in zip(self.goals, left, strict=True)
        ]
        return np.array(rows)

    def solve(self, places: np.ndarray) -> Optimised:
        import numpy as np
        import scipy.optimize as optimize

        least_squares: Any = optimize.least_squares
        minimize: Any = optimize.minimize
        low = np.array([q.inner(q.low) if q.low > -math.inf else -math.inf for q in self.asked])
        high = np.array([q.inner(q.high) if q.high < math.inf else math.inf for q in self.asked])
        places = np.clip(places, low, high)
        if not self.aim:
            found = least_squares(
                self.left, places, self.jacobian, bounds=(low, high), x_scale=1.0, method="trf", max_nfev=RUNS, xtol=1e-10,
                ftol=1e-12, gtol=1e-12,
            )  # fmt: skip
        else:
            first = self.measures(places)
            assert first is not None
            self.size = abs(first[self.aim]) or 1.0
            found = minimize(
                self.cost, places, jac=self.gradient, method="SLSQP", bounds=list(zip(low, high, strict=True)),
                constraints=[self.constraint(goal) for goal in self.goals], options={"maxiter": RUNS, "ftol": 1e-9},
            )  # fmt: skip
        return self.told(found.x, bool(found.success), low, high)

    def cost(self, places: Any) -> float:
        found = self.measures(places)
        return math.nan if found is None else self.sign * found[self.aim] / self.size

    def gradient(self, places: Any) -> np.ndarray:
        return self.sign * self.slopes(places)[self.aim] / self.size

    def constraint(self, goal: Goal) -> dict[str, Any]:
        """As SLSQP has it: above zero, or zero."""
        sign = -1.0 if goal.operator == "<" else 1.0

        def off(places: Any) -> float:
            found = self.measures(places)
            return math.nan if found is None else sign * (found[goal.measure] - goal.bound) / goal.size

        def slope(places: Any) -> np.ndarray:
            return sign * self.slopes(places)[goal.measure] / goal.size

        return {"type": "eq" if goal.operator == "=" else "ineq", "fun": off, "jac": slope}

    def told(self, places: np.ndarray, converged: bool, low: np.ndarray, high: np.ndarray) -> Optimised:
        import numpy as np

        found = Optimised([q.name for q in self.asked], self.goals)
        found.values = dict(zip(found.names, self.values(places), strict=True))
        found.measures = self.measures(places, told=True) or {}
        found.runs, found.converged = self.runs, converged and not self.stopped
        found.by_runs = self.deck.by_runs
        near = np.isclose(places, low, rtol=0.0, atol=1e-6) | np.isclose(places, high, rtol=0.0, atol=1e-6)
        found.at_bounds = [name for name, at in zip(found.names, near, strict=True) if at]
        return found


def _cost(job: tuple[Task, list[Quantity], list[Goal], str, float]) -> Callable[[Any], float]:
    """What the goals are missed by, and behind them what is made small, in a worker's process."""
    import numpy as np

    task, asked, goals, aim, sign = job
    search = _Search(Measures(task), asked, goals, aim, sign, None)

    def cost(places: Any) -> float:
        found = search.measures(places)
        search._measures.clear()
        if found is None:
            return NEVER
        off = np.array([goal.missed(found[goal.measure]) for goal in goals])
        total = FIRST * float(off @ off) + (sign * found[aim] if aim else 0.0)
        return total if math.isfinite(total) else NEVER

    return cost
