"""Outside witnesses: scipy's solve_ivp methods on the deck's own compiled equations.

d/dt Q(x, t) + F(x, t) = 0 with C = dQ/dx reduces to an ODE where it is of index 1 and the null spaces of C do not move
(that of a capacitor between two nodes holds their common voltage, whatever the capacitance). With N and N' bases of the left
and right null space, and U, V of their complements,

    x = V y + N' z,      N^T F(V y + N' z, t) = 0  solved for z by Newton's method,
    (U^T C V) y' = -U^T F                                                                        (1)

A closed loop with its multipliers does not reduce (N^T dF/dx N' is singular), and a deck with a condition that has two
thresholds (a switch with hysteresis) is no ODE. Other conditions, a clamp or a comparison, take the side on which (x, t)
lies: a corner or a jump of the right-hand side, which the integrators must find by their own step control.
The equations are the engine's; the integrators, their error estimates and their interpolants are not. Their CPU time is
that of Python calling the engine once an evaluation: evaluations are what compares.
"""

from __future__ import annotations

from time import thread_time

from .ladder import KINDS
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
NOTHING = 1e-9  # singular values below it, of matrices whose entries are 1 at most, are zero


class NoOde(Exception):
    """The system does not reduce by (1); the text says why."""


class TooLong(Exception):
    """A run over its limit."""


class Reduced:
    """The ODE (1) of a system: state y; counts its evaluations."""

    def __init__(self, system: System) -> None:
        import numpy as np

        if latches := system.latches:
            raise NoOde(f"between its thresholds {latches[0]} holds a state")
        if system.n > LARGEST:
            raise NoOde(f"it has more than {LARGEST} unknowns")
        self.system, self.n = system, system.n
        self.x = system.x0
        c, g = system.dense(self.x)
        # rows and columns of one size, so that 1 pF and 1 kg m^2 are told from nothing alike
        rows = abs(c).max(axis=1)
        rows[rows == 0] = 1.0
        columns = abs(c / rows[:, None]).max(axis=0)
        columns[columns == 0] = 1.0
        u, size, v = np.linalg.svd(c / rows[:, None] / columns)
        rank = int((size > NOTHING).sum())
        if not rank:
            raise NoOde("nothing in it stands under d/dt")
        self.u, self.left = u[:, :rank] / rows[:, None], u[:, rank:] / rows[:, None]
        self.v, self.null = v[:rank].T / columns[:, None], v[rank:].T / columns[:, None]
        block = self.left.T @ g @ self.null
        largest = abs(block).max(axis=1, keepdims=True) if block.size else np.ones(1)
        if block.size and not (largest.min() > 0 and np.linalg.cond(block / largest) < 1e12):
            raise NoOde("its algebraic part does not solve for the algebraic unknowns: index 2")
        self.back = np.linalg.inv(np.hstack([self.v, self.null]))
        self.rank, self.evaluations, self.end = rank, 0, float("inf")

    @property
    def start(self) -> np.ndarray:
        """States at the beginning, shape (rank,)."""
        return (self.back @ self.x)[: self.rank]

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        import numpy as np

        self.evaluations += 1
        if thread_time() > self.end:
            raise TooLong
        _, f, c = self.complete(t, y)
        if self.evaluations % 50 == 1 and (
            abs(self.left.T @ c).max(initial=0.0) > 1e-6
            or abs(c @ self.null).max(initial=0.0) > 1e-6 * abs(c).max()
        ):
            raise NoOde("the null space of its dQ/dx moves")
        return np.linalg.solve(self.u.T @ c @ self.v, -self.u.T @ f)

    def complete(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(x, F, C) at states y; z by Newton's method from where it last was, its matrix renewed when that is slow."""
        import numpy as np

        z = (self.back @ self.x)[self.rank :]
        x = self.v @ y + self.null @ z
        c, g = self.system.dense(x, t)
        f = self.system.F(x, t)
        before = float("inf")
        for _ in range(40 if len(z) else 0):
            step = self.null @ np.linalg.solve(self.left.T @ g @ self.null, -self.left.T @ f)
            x = x + step
            f = self.system.F(x, t)
            size = float((abs(step) / (1e-6 + abs(x))).max())
            if size < 1e-11:
                break
            if size > 0.1 * before:
                c, g = self.system.dense(x, t)
            before = size
        self.x = x
        return x, f, c


def measure(
    problem: Problem, judge: Judge, system: System, methods: Sequence[str] = METHODS,
    tolerances: Sequence[float] = TOLERANCES, limit: float = LIMIT,
    said: Callable[[str], object] = lambda text: None,
) -> list[Series]:  # fmt: skip
    """Every method over the ladder. NoOde where the system does not reduce; ImportError without scipy."""
    from scipy.integrate import solve_ivp  # noqa: F401  (fail early)

    if not _places(problem, system):
        raise NoOde("none of the signals is an unknown")
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
    # absolute tolerances as the engine takes them at this tolerance, the least of the unknowns that a state moves
    unit = abs(f.v) / np.array(problem.tolerances(tolerance))[:, None]
    began = thread_time()
    f.end = began + limit
    why = ""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found = solve_ivp(
                f, (0.0, t.tstop), f.start, method=method, rtol=max(tolerance, 3e-14), atol=1.0 / unit.max(axis=0),
                t_eval=grid, max_step=(t.tstop - t.tstart) / 50,
            )  # fmt: skip
        seconds = thread_time() - began
        if not found.success or found.y.shape[1] != len(grid):
            why = str(found.message)
    except TooLong:
        why = f"over {limit:g} s"
    except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
        why = str(error)
    if why:
        return Point(setting, tolerance, None, thread_time() - began, f.evaluations, reason=why)
    count, f.end = f.evaluations, float("inf")
    with np.errstate(all="ignore"):
        x = np.array([f.complete(time, y)[0] for time, y in zip(grid, found.y.T, strict=True)])
    if not np.isfinite(x).all():
        why = "its algebraic unknowns are not found from its states"
        return Point(setting, tolerance, None, seconds, count, reason=why)
    places, nothing = _places(problem, f.system), np.full(len(grid), np.nan)
    values = np.array([x[:, places[name]] if name in places else nothing for name in problem.signals])
    return Point(setting, tolerance, judge.error(values), seconds, count)


def _places(problem: Problem, system: System) -> dict[str, int]:
    """Signal -> number of the unknown that it is."""
    names = [
        KINDS.get(kind, "{}").format(name) for name, kind in zip(system.names, system.kinds, strict=True)
    ]
    return {name: k for k, name in enumerate(names) if name in problem.signals}
