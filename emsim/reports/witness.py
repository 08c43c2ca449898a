"""Outside witnesses: scipy's solve_ivp methods on the deck's own compiled equations.

d/dt Q(x, t) + F(x, t) = 0 reduces to an ODE where it is of index 1: with d the unknowns under d/dt and a the others,

    F_a(d, a, t) = 0  solved for a by Newton's method on dF_a/da,      C_dd d' = -F_d            (1)

A closed loop with its multipliers does not reduce (dF_a/da is singular), and a deck whose conditions hold a state of
their own (switches) is no ODE. The equations are the engine's; the integrators, their error estimates and their
interpolants are not. Their CPU time is that of Python calling the engine once an evaluation: evaluations are what compares.
"""

from __future__ import annotations

from time import thread_time

from .work_precision import Point, Series, exponent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    import numpy as np

    from ..system import System
    from .ladder import Judge, Problem

METHODS = ("RK45", "DOP853", "Radau", "BDF", "LSODA")
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9)
LIMIT = 1.0  # CPU seconds a run
LARGEST = 60  # unknowns: the reduction is dense


class NoOde(Exception):
    """The system does not reduce by (1); the text says why."""


class TooLong(Exception):
    """A run over its limit."""


class Reduced:
    """The ODE (1) of a system: state d of shape (states,); counts its evaluations."""

    def __init__(self, system: System) -> None:
        import numpy as np

        if system.conditions:
            raise NoOde("its conditions hold a state between events")
        if system.n > LARGEST:
            raise NoOde(f"it has more than {LARGEST} unknowns")
        self.system = system
        self.x = system.x0
        self.d = system.differential
        self.a = ~self.d
        self.rows = system.algebraic
        if self.rows.sum() != self.a.sum() or not self.d.any():
            raise NoOde("it has not as many algebraic rows as unknowns")
        c, g = (m.toarray() for m in system.jac(self.x, 0.0))
        block, mass = g[np.ix_(self.rows, self.a)], c[np.ix_(~self.rows, self.d)]
        for matrix in (block, mass):
            rows = abs(matrix).max(axis=1, keepdims=True) if matrix.size else np.ones(1)
            if matrix.size and not (rows.min() > 0 and np.linalg.cond(matrix / rows) < 1e13):
                raise NoOde("its algebraic part does not solve for the algebraic unknowns: index 2")
        self.evaluations = 0
        self.end = float("inf")

    def __call__(self, t: float, d: np.ndarray) -> np.ndarray:
        import numpy as np

        self.evaluations += 1
        if thread_time() > self.end:
            raise TooLong
        x = self.complete(t, d)
        c = self.system.C(x, t).toarray()
        return np.linalg.solve(c[np.ix_(~self.rows, self.d)], -self.system.F(x, t)[~self.rows])

    def complete(self, t: float, d: np.ndarray) -> np.ndarray:
        """All unknowns at states d; the algebraic ones by Newton's method from where they last were."""
        import numpy as np

        x = self.x.copy()
        x[self.d] = d
        if self.a.any():
            for _ in range(30):
                jacobian = self.system.G(x, t).toarray()[np.ix_(self.rows, self.a)]
                step = np.linalg.solve(jacobian, -self.system.F(x, t)[self.rows])
                x[self.a] += step
                if abs(step).max() <= 1e-13 * (1.0 + abs(x[self.a]).max()):
                    break
        self.x = x
        return x


def measure(
    problem: Problem, judge: Judge, system: System, methods: Sequence[str] = METHODS,
    tolerances: Sequence[float] = TOLERANCES, limit: float = LIMIT,
    said: Callable[[str], object] = lambda text: None,
) -> list[Series]:  # fmt: skip
    """Every method over the ladder. NoOde where the system does not reduce; ImportError without scipy."""
    from scipy.integrate import solve_ivp  # noqa: F401  (fail early)

    states = problem.states(problem.assembly)
    if not any(name in states for name in problem.signals):
        raise NoOde("none of the signals is a state")
    Reduced(system)
    out = []
    for method in methods:
        series, stopped = Series(method, "scipy"), ""
        for tolerance in tolerances:
            setting = exponent(tolerance)
            if stopped:
                series.points.append(Point(setting, tolerance, None, 0.0, reason=f"not tried: {stopped}"))
                continue
            said(f"scipy {method} {setting}")
            point = _run(problem, judge, Reduced(system), method, tolerance, limit)
            series.points.append(point)
            if point.reason.startswith("over"):
                stopped = f"{point.reason} at {setting}"
        out.append(series)
    return out


def _run(problem: Problem, judge: Judge, f: Any, method: Any, tolerance: float, limit: float) -> Point:
    import warnings

    import numpy as np
    from scipy.integrate import solve_ivp

    t, grid, setting = problem.transient, problem.grid, exponent(tolerance)
    start = f.x[f.d]
    # absolute tolerances per kind as the engine takes them at this tolerance
    absolute = f.system.tolerances(tolerance)[f.d]
    began = thread_time()
    f.end = began + limit
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = solve_ivp(
                f, (0.0, t.tstop), start, method=method, rtol=max(tolerance, 3e-14), atol=absolute, t_eval=grid,
                max_step=(t.tstop - t.tstart) / 50,
            )  # fmt: skip
    except TooLong:
        return Point(
            setting, tolerance, None, thread_time() - began, f.evaluations, reason=f"over {limit:g} s"
        )
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Point(setting, tolerance, None, thread_time() - began, f.evaluations, reason=str(error))
    seconds = thread_time() - began
    if not found.success or found.y.shape[1] != len(grid):
        return Point(setting, tolerance, None, seconds, f.evaluations, reason=str(found.message))
    states = problem.states(problem.assembly)
    place = {int(k): row for row, k in enumerate(np.flatnonzero(f.d))}
    nothing = np.full(len(grid), np.nan)
    rows = [found.y[place[states[name]]] if name in states else nothing for name in problem.signals]
    return Point(setting, tolerance, judge.error(np.array(rows)), seconds, f.evaluations)
