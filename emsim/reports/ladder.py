"""One deck, run by every method over a ladder of tolerances and read at common times.

Common times: `times` of them, equally spaced from the start of the output to the end. A deck with sources or conditions
gets a spacing that is no round part of the run, so that no common time falls onto an edge, where a run that is right
but 1e-12 s late would be wrong by the whole jump. A method with dense output records these times itself, with its own
polynomial; the steps of one without (its record then has no row at that time) are read with the result's own
interpolation, as any reader of that result would.

Error of a run: largest |difference from the reference| over signals and common times, each in parts of the signal's
range over the reference (at least 1e-3 of its size and 1e-6 of the largest of its unit). Signals: unless named, what stands
under d/dt among the deck's columns, as the rest follows from it.

Absolute tolerances that the deck gives are left out: they follow the ladder. The largest step is the deck's tmax or, as in
any run, the method's own: trap and gear heed the print grid, which is a fiftieth of the run here.

Time is thread CPU time of the engine's transient, operating point included, compiling not; the median of rounds in
which the runs of all methods take turns. A short run is timed after a few of the same that are not: who happens to run
after another method finds the caches full of that one's code and branches foretold for it, which cost `auto`, the first of
every round, up to 1.8 times behind none of its own, 1.2 behind one. The points that are compared are then timed again, with
each other and with other programs (`Turns`).

A run that takes longer than its limit is stopped by the progress callback and charted as a failure; tighter tolerances of
that method are then not tried.
"""

from __future__ import annotations

from statistics import median
from time import perf_counter, thread_time

from ..analyses import transients
from ..diagnostics import DeckError, Diagnostic, DiagnosticError, did_you_mean
from ..table import Table
from .work_precision import Point, Series, exponent, front, near

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    import numpy as np

    from ..analyses import Analysis
    from ..assemble import Assembly

    Prepare = Callable[[dict[str, Any]], tuple[Assembly, Sequence[Analysis]]]

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
TIMES = 50
ROUNDS, BUDGET = 5, 10.0  # runs of a point, within so many seconds for all
GOLDEN = 0.381966
# options that the ladder sets: every tolerance, electrical or not
FOLLOW = (
    "reltol", "vntol", "abstol", "chgtol", "flxtol", "lentol", "angtol", "veltol", "spintol", "forcetol", "torquetol",
)  # fmt: skip
FACTOR, FLOOR, LIMIT = (
    60.0,
    0.1,
    5.0,
)  # limit of a run: so many times the best at its tolerance, within these [s]
SHORT, TURNS = 0.01, 10  # runs up to so long [s] make a turn; turns for each round of the ladder
WARMED, WARMING = 5e-3, 3  # shorter runs [s] are run before they are timed, so often or for so long
SENSELESS = 5.0  # an error beyond it is no point of a front
MAXIMAL = ("auto", "radau")  # the first there is shows the price of modelling more than the scene needs
KINDS = {"node": "v({})", "branch": "i({})"}


class Problem:
    """A deck made ready: `run(method, tolerance)` gives a table with a row at (or points around) every common time.

    prepare   options -> (assembly, planned analyses); called once for every method and formulation
    signals   names of columns, None for the states
    stop      end of the run [s], None for the deck's own
    even      the run ends at the last of the equally spaced times: other engines count steps from one to the next
    """

    def __init__(
        self,
        prepare: Prepare,
        signals: Sequence[str] | None = None,
        times: int = TIMES,
        stop: float | None = None,
        even: bool = False,
    ) -> None:
        self.prepare = prepare
        self._ready: dict[tuple[str, str], Assembly] = {}
        assembly, planned = prepare({})
        found = transients(planned)
        if not found:
            hint = "add .tran tstep tstop"
            raise DeckError(
                Diagnostic("error", "E350", "there is no transient analysis to chart", None, hint)
            )
        self.transient = found[-1]
        if stop is not None:
            self.transient.tstop = stop
        self.assembly, self.flat = assembly, assembly.flat
        self.title: str = assembly.flat.title
        self.plain = not assembly.flat.machine
        self.units = {o.name: o.unit for o in assembly.columns("tran")}
        self.signals = self._chosen(signals)
        self.count = times
        t = self.transient
        span = t.tstop - t.tstart
        odd = not self.plain and not assembly.flat.elements and not assembly.system.flag_names
        self.spacing: float = span / (times if odd else times + GOLDEN)
        if even:
            t.tstop = t.tstart + self.spacing * times

    def _chosen(self, signals: Sequence[str] | None) -> list[str]:
        columns = list(self.units)
        if signals:
            plain = {"".join(name.split()).lower(): name for name in columns}
            for name in signals:
                if name not in plain:
                    hint = did_you_mean(name, columns, f"there are {', '.join(columns[:20])}", "{}")
                    raise DeckError(Diagnostic("error", "E351", f"no column {name} in this deck", None, hint))
            return [plain[name] for name in signals]
        states = self.states(self.assembly)
        return [name for name in columns if name in states] or columns

    @staticmethod
    def states(assembly: Assembly) -> dict[str, int]:
        """Columns that are unknowns under d/dt, and the unknown's number."""
        s = assembly.system
        under = s.differential_unknowns
        names = [KINDS.get(kind, "{}").format(name) for name, kind in zip(s.names, s.kinds, strict=True)]
        return {name: k for k, name in enumerate(names) if under[k]}

    @property
    def grid(self) -> np.ndarray:
        """The common times [s]."""
        import numpy as np

        t = self.transient
        grid = t.tstart + self.spacing * np.arange(1, self.count + 1)
        return np.append(grid[grid < t.tstop * (1 - 1e-12)], t.tstop)

    def ready(self, method: str, formulation: str = "") -> Assembly:
        """The deck compiled for a method. Raises DeckError where it does not compile."""
        key = (method, formulation)
        if key not in self._ready:
            options = {"method": method} | ({"formulation": formulation} if formulation else {})
            self._ready[key] = self.prepare(options)[0]
        return self._ready[key]

    def run(
        self, method: str, tolerance: float, limit: float = 60.0, formulation: str = ""
    ) -> tuple[Table | None, dict[str, Any], str]:
        """(table, statistics, "") of a run that got through, (None, statistics, reason) of one that did not."""
        assembly = self.ready(method, formulation)
        options = _at(assembly, tolerance)
        exprs = {o.name: o.expr for o in assembly.columns("tran") if o.expr is not None}
        names = [name for name in self.signals if name in exprs]
        t = self.transient
        began = thread_time()

        late = False

        def over(*_: object) -> bool:
            nonlocal late
            late = thread_time() - began > limit
            return late

        waves = assembly.system.tran(
            self.spacing, t.tstop, tstart=t.tstart, tmax=t.tmax, uic=t.uic, outputs=[exprs[n] for n in names],
            options_=options, progress=over, drawn=False,
        )  # fmt: skip
        stats = dict(waves.stats)
        if waves.status == "ok":
            units = [self.units[name] for name in names]
            return Table("tran", ["time", *names], ["s", *units], waves), stats, ""
        if waves.status == "interrupted":
            if not late:
                raise KeyboardInterrupt
            return None, stats, f"over {limit:.2g} s"
        failure = dict(waves.failure or {})
        kind, at = str(failure.get("kind", "failed")), float(failure.get("t") or 0.0)
        if kind == "unfit":
            return None, stats, f"unfit: {failure.get('why', '')}".rstrip(": ")
        return None, stats, f"{kind} at {at:.3g} s"

    def tolerances(self, tolerance: float) -> list[float]:
        """Absolute tolerance of every unknown, as a run at this tolerance takes it."""
        return self.assembly.system.tolerances(_at(self.assembly, tolerance))

    def values(self, table: Table) -> np.ndarray:
        """Shape (signals, common times): recorded rows where they are, else interpolated."""
        import numpy as np

        grid, time = self.grid, table.time
        right = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
        rows = np.where(abs(time[right - 1] - grid) < abs(time[right] - grid), right - 1, right)
        hit = abs(time[rows] - grid) <= 1e-9 * self.spacing
        inside = np.clip(grid, time[0], time[-1])
        missing = np.full(len(grid), np.nan)
        return np.array(
            [
                np.where(hit, table[name][rows], table.at(name, inside)) if name in table else missing
                for name in self.signals
            ]
        )


def _at(assembly: Assembly, tolerance: float) -> dict[str, Any]:
    """The deck's options at a tolerance of the ladder."""
    return {k: v for k, v in assembly.options.items() if k not in FOLLOW} | {"reltol": tolerance}


def maximal(problem: Problem) -> list[str]:
    """Methods to run on the deck in maximal coordinates; none where there is no machine or no such formulation."""
    from ..assemble.options import METHODS

    if problem.plain:
        return []
    methods = [m for m in MAXIMAL if m in METHODS]
    try:
        assembly = problem.ready(methods[0], "absolute")
    except DiagnosticError:
        return []
    said = assembly.flat.sink.diagnostics
    return [] if any("formulation" in d.message for d in said) else methods[:1]


class Judge:
    """The reference's values at the common times, and the distance of others from them."""

    def __init__(self, problem: Problem, reference: np.ndarray) -> None:
        import numpy as np

        self.reference = reference
        reach, size = np.ptp(reference, axis=1), abs(reference).max(axis=1)
        units = [problem.units[name] for name in problem.signals]
        largest = np.array(
            [max(max(reach[k], size[k]) for k, u in enumerate(units) if u == unit) for unit in units]
        )
        self.scale = np.maximum.reduce([reach, 1e-3 * size, 1e-6 * largest, np.full(len(units), 1e-15)])

    def error(self, values: np.ndarray) -> float:
        """Largest difference in parts of each signal's range; signals that the run does not have are left out."""
        import numpy as np

        off = abs(values - self.reference) / self.scale[:, None]
        return float(np.nanmax(off)) if not np.isnan(off).all() else float("inf")


class Task:
    """One method's way down the ladder; `times` of every point that got through, for the median."""

    def __init__(self, name: str, method: str, formulation: str = "") -> None:
        self.name, self.method, self.formulation = name, method, formulation
        self.stopped = ""
        self.times: dict[float, list[float]] = {}
        self.points: dict[float, Point] = {}


def measure(
    problem: Problem,
    judge: Judge,
    methods: Sequence[str],
    tolerances: Sequence[float] = TOLERANCES,
    limit: float | None = None,
    most: float = LIMIT,
    rounds: int = ROUNDS,
    budget: float = BUDGET,
    formulation: str = "",
    group: str = "emsim",
    said: Callable[[str], object] = lambda text: None,
) -> list[Series]:
    """Every method over the ladder: one judged round, then rounds for the median of times within `budget` [s]."""
    label = f"{formulation} " if formulation else ""
    tasks = [Task(label + method, method, formulation) for method in methods]
    for tolerance in sorted(tolerances, reverse=True):
        fastest = float("inf")
        for task in tasks:
            allowed = limit or min(max(FACTOR * fastest, FLOOR), most)
            said(f"{task.name} {exponent(tolerance)}")
            _judged(problem, judge, task, tolerance, allowed)
            if task.points[tolerance].good:
                fastest = min(fastest, task.points[tolerance].seconds)
    _repeat(problem, tasks, rounds, budget, said)
    return [Series(t.name, group, list(t.points.values())) for t in tasks]


def _judged(problem: Problem, judge: Judge, task: Task, tolerance: float, limit: float) -> None:
    setting = exponent(tolerance)
    if task.stopped:
        task.points[tolerance] = Point(setting, tolerance, None, 0.0, reason=task.stopped)
        return
    try:
        table, stats, reason = problem.run(task.method, tolerance, limit, task.formulation)
    except DiagnosticError as refused:
        task.stopped = f"refused: {refused.diagnostics[-1].message}"
        task.points[tolerance] = Point(setting, tolerance, None, 0.0, reason=task.stopped)
        return
    error = judge.error(problem.values(table)) if table is not None else None
    if error is not None and not error < SENSELESS:
        error, reason = None, f"wrong by {error:.1g} times the range"
    seconds = float(stats["solve_time"])
    task.points[tolerance] = Point(
        setting, tolerance, error, seconds, stats["evaluations"], stats["steps"], reason
    )
    if table is not None:
        task.times[tolerance] = [seconds]
    elif reason.startswith("over"):
        task.stopped = f"not tried: {reason} at {setting}"
    elif reason.startswith("unfit"):
        task.stopped = reason


def _repeat(
    problem: Problem, tasks: Sequence[Task], rounds: int, budget: float, said: Callable[[str], object]
) -> None:
    """The same runs again, in turns, until there are `rounds` of each or the budget is spent; then medians. Each round
    begins with another method: what runs behind a long run finds the machine's caches full of it."""
    end = perf_counter() + budget
    for number in range(1, rounds):
        first = number % len(tasks)
        for task in (*tasks[first:], *tasks[:first]):
            for tolerance, times in task.times.items():
                # what is left must do for everybody: long runs are repeated less, they are less noisy too
                if len(times) > number or times[0] > 0.02 * budget or perf_counter() > end:
                    continue
                said(f"{task.name} {exponent(tolerance)}, round {number + 1}")
                times.append(_timed(problem, task.method, tolerance, times[0], task.formulation))
    for task in tasks:
        for tolerance, times in task.times.items():
            task.points[tolerance].seconds = median(times)


class Turns:
    """The points of `auto` and those near emsim's front, timed again in turns, and in parts of what a turn takes: neighbours
    make a shared machine up to 1.7 times slower for seconds at a time, and two figures of different seconds are no ratio.
    A turn runs the short points, one after the other; what takes longer is timed between two turns, in parts of these. Times are
    medians of parts, times what the shortest turn took. (Another program is not timed in parts: neighbours slow it less, the less
    its instructions overlap. It runs between turns, and its shortest time counts.)"""

    def __init__(self, problem: Problem, series: Sequence[Series]) -> None:
        self.problem = problem
        own = [s for s in series if s.group == "emsim"]
        worth = front((p.error or 0.0, p.seconds) for s in own for p in s.good)
        compared = [(s.name, p) for s in own for p in s.good if s.name == "auto" or near(p, worth)]
        least = min((p.seconds for _, p in compared), default=0.0)
        self.short = [(m, p) for m, p in compared if p.seconds <= max(SHORT, least)]
        self.long = [(m, p) for m, p in compared if p.seconds > max(SHORT, least)]
        self.turns: list[list[float]] = []  # seconds of every short point
        self.parts: dict[Point, list[float]] = {}  # of the long ones, in turns

    def take(self) -> float:
        """One turn; its seconds."""
        self.turns.append([self._timed(method, point) for method, point in self.short])
        return sum(self.turns[-1])

    def spend(self, rounds: int, budget: float) -> None:
        """As many turns as the budget [s] has room for, at most TURNS for each of the ladder's rounds after the first; what
        is long is timed once for each of these rounds."""
        if not self.short:
            return
        end = perf_counter() + budget
        for number in range(TURNS * (rounds - 1)):
            if number < rounds or perf_counter() < end:
                self.take()
        for _ in range(rounds - 1):
            for method, point in self.long:
                before, seconds = sum(self.turns[-1]), self._timed(method, point)
                self.parts.setdefault(point, []).append(2 * seconds / (before + self.take()))

    def settle(self) -> None:
        """What the turns say takes the place of what was measured before."""
        if not self.short or not self.turns:
            return
        pace = min(sum(turn) for turn in self.turns)
        for k, (_, point) in enumerate(self.short):
            point.seconds = pace * median(turn[k] / sum(turn) for turn in self.turns)
        for point, parts in self.parts.items():
            point.seconds = pace * median(parts)

    def _timed(self, method: str, point: Point) -> float:
        return _timed(self.problem, method, point.tolerance or 0.0, point.seconds)


def _timed(problem: Problem, method: str, tolerance: float, about: float, formulation: str = "") -> float:
    """Seconds of a run that takes about so long; a short one behind some of the same that are not timed."""
    for _ in range(min(WARMING, int(WARMED / about) if about > 0 else WARMING)):
        problem.run(method, tolerance, formulation=formulation)
    return float(problem.run(method, tolerance, formulation=formulation)[1]["solve_time"])
