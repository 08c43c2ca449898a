"""ngspice's points of a chart: a ladder of reltol and of the largest step, on the same deck at the same common times.

Its accuracy has two knobs and neither alone does: reltol bounds the local error that its estimate sees, tmax the step
whatever the estimate says. Every combination is one point; the absolute tolerances follow reltol. Its values between its
steps are read with the interpolation that any result gets here.
"""

from __future__ import annotations

from ..interop.ngspice import NgspiceError
from ..interop.ngspice_time import Bench
from .ladder import SENSELESS
from .work_precision import Point, Series, exponent, front, near

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .ladder import Judge, Problem, Turns

RELTOLS = (1e-3, 1e-4, 1e-5, 1e-6)
# tmax: a 50th of the run, divided by these (in steps of 5 a diode multiplier to 1e-6 seemed to cost 120 ms: it costs 76)
PARTS = (1, 2, 5, 11, 25, 55, 125, 280, 625, 1400, 3125)
LIMIT = 3.0  # wall seconds a run
# A point is timed again if it takes less than so many times what the others would for its error. A first figure is of one
# run, and now and then 90 ms for 51 (a diode multiplier to 2e-6: its neighbours then went for what lies between them).
FIRST, LATER = 3.0, 1.5


def measure(
    problem: Problem, judge: Judge, text: str, folder: str, turns: Turns, rounds: int = 8, limit: float = LIMIT,
    reltols: Sequence[float] = RELTOLS, parts: Sequence[int] = PARTS,
    said: Callable[[str], object] = lambda text: None,
) -> Series:  # fmt: skip
    """All points of one deck, those that count timed between emsim's turns. OutsideError without ngspice."""
    t = problem.transient
    fiftieth = (t.tstop - t.tstart) / 50
    series = Series("ngspice", "ngspice")
    runs: dict[Point, tuple[tuple[float, float, float, float], str]] = {}
    with Bench(text, folder, problem.signals) as bench:
        looser: dict[int, int] = {}  # steps at a tmax, with the reltol before
        for reltol in reltols:
            small = reltol / 1e-3
            options = (
                f"reltol={reltol:g} abstol={1e-12 * small:g} vntol={1e-6 * small:g} chgtol={1e-14 * small:g}"
            )
            steps, stopped = 0, ""
            for part in parts:
                tmax = fiftieth / part
                if 50 * part < steps:
                    continue  # the mean step is that short already
                tran = (t.tstep, t.tstart, t.tstop, tmax)
                setting = f"reltol {exponent(reltol)}, tmax {tmax:.2g}"
                said(f"ngspice {setting}")
                point = Point(setting, None, None, 0.0, reason=stopped)
                series.points.append(point)
                if stopped:
                    continue
                try:
                    table, about = bench.values(tran, options, limit)
                    if table.time[-1] < t.tstop * (1 - 1e-6):
                        raise NgspiceError(f"stopped at {table.time[-1]:.3g} s")
                except NgspiceError as error:
                    point.reason = str(error)
                    if point.reason.startswith("over"):
                        point.seconds = limit
                        stopped = f"not tried: {point.reason} at {tmax:.2g}"
                    continue
                steps = len(table)
                point.error, point.seconds, point.steps = judge.error(problem.values(table)), about, steps
                if not point.error < SENSELESS:
                    point.reason, point.error = f"wrong by {point.error:.1g} times the range", None
                    continue
                runs[point] = tran, options
                if abs(steps - looser.get(part, 0)) < 0.02 * steps:
                    break  # tmax alone decides from here on, and those points are there
                looser[part] = steps
        for number in range(rounds):
            worth = front((p.error or 0.0, p.seconds) for p in runs)
            for point in [p for p in runs if near(p, worth, 1e-3, LATER if number else FIRST)]:
                # a long run is less noisy: two measurements do
                if point.seconds < 0.3 or number < 2:
                    said(f"ngspice {point.setting}, time")
                    seconds = bench.seconds(*runs[point], point.seconds, 10 * limit)
                    point.seconds = min(point.seconds, seconds) if number else seconds
            turns.take()
    return series
