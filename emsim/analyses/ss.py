"""`.ss tstep period [tstab] [uic]`: the periodic steady state of what sources drive with this period.

With P(x) the state a period after x, the state at the start is the x for which P(x) = x: shooting (Aprille and Trick, Proc.
IEEE 60, 1972, 108). Of P no derivative is taken. Most states forget themselves within a period, and the secant equations of
the last periods tell the others: Anderson's acceleration (Walker and Ni, SIAM J. Numer. Anal. 49, 2011, 1715)

    f_k = P(x_k) - x_k,   x_{k+1} = x_k + f_k - (dX + dF) g,   g: |f_k - dF g| least                     (1)

with dX, dF the last differences of x and f. Every period is a transient by the deck's own method and events, more exact than
its reltol. The orbit is then disturbed to learn by how much a period magnifies what is added to it: the error of x is
f/(1 - that), and an orbit that magnifies is one that no transient stays on.

Sources are continued into the past: the period begins at t = 0, with delays as if they had been running for ever. A
coordinate may be further on by what the equations do not see: a turn, or anything where nothing depends on the place.
"""

from __future__ import annotations

import math

from .base import wrong
from .tran import Tran

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Self

    import numpy as np

    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Diagnostic, Sink
    from .base import Progress, Run

MOST = 200  # periods
DEPTH = 40  # secant equations
CLOSER = 0.1  # of the tolerance: how near x has to be
FINER, FINEST = 1e-2, 1e-11  # reltol of the periods, as a part of the deck's, and at least
FAR = 1e6  # of the largest values of the first period: no step goes farther
WORSE = 100.0  # an iterate whose f is so many times the best one's is left
DISTURBED = 100.0  # of the tolerance: how much the orbit is disturbed
MODES, KNOWN = (
    16,
    1e-3,
)  # directions in which it is disturbed at most; until the largest eigenvalue is known so well
UNSTABLE = 1.001
TURN = 2.0 * math.pi
SEEN = 1e-9  # of their size: equations that differ by less are the same


class NotPeriodic(Exception):
    """Why there is no steady state."""

    def __init__(self, found: list[Diagnostic]) -> None:
        super().__init__()
        self.found = found


class Ss(Tran):
    word = "ss"
    form = ".ss tstep period [tstab] [uic]"
    meaning = "the periodic steady state, one period from t = 0; tstab: how long a transient comes before the search [s]"
    plotname = "Periodic Steady State"
    streams = False

    def __init__(self, card: Card, tstep: float, period: float, tstab: float, uic: bool) -> None:
        super().__init__(card, tstep, period, 0.0, None, False)
        self.tstab, self.from_given = tstab, uic

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        words = [a for a in card.args if isinstance(a, str)]
        args = [float(a) for a in card.args if not isinstance(a, str)]
        if any(w != "uic" for w in words) or not 2 <= len(args) <= 3:
            wrong(cls, card, sink, ".ss takes tstep, the period, and a time before the search")
        elif not all(math.isfinite(a) for a in args) or not (args[0] > 0 and args[1] > 0):
            wrong(cls, card, sink, f"tstep {args[0]:g} s and the period {args[1]:g} s must be positive")
        elif len(args) > 2 and args[2] < 0:
            wrong(cls, card, sink, f"tstab is {args[2]:g} s, it must not be negative")
        else:
            uic = "uic" in words or "uic" in card.flags
            return cls(card, min(args[:2]), args[1], args[2] if len(args) > 2 else 0.0, uic)
        return None

    def times(self) -> tuple[float, ...]:
        return self.tstep, self.tstop, self.tstop

    def columns(self, ctx: Context) -> list[Output]:
        if ctx.delayed:
            said = ".ss does not find the state of lines: it is what has been on its way in them"
            ctx.sink.error(
                "E440", said, self.card.span, "put some coils and capacitors in the place of each line"
            )
        if ctx.digital:
            said = ".ss does not find the state of digital nodes: flip-flops and events on their way are no unknowns"
            ctx.sink.error(
                "E440", said, self.card.span, ".tran over many periods, with tstart near the end, shows it"
            )
        return super().columns(ctx)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        search = Search(assembly, self, progress)
        try:
            search.find()
        except NotPeriodic as why:
            return not_found(self, assembly, why)
        self.begin = search.x.tolist(), search.flags
        run = super().run(assembly, progress)
        run.stats = {"periods": search.periods, "multiplier": search.multiplier}
        return run


def not_found(analysis: Tran, assembly: Assembly, why: NotPeriodic) -> Run:
    """A table without rows, and why."""
    from .base import Computed, Run, recorded

    names, units, _ = recorded(assembly, analysis)
    waves = Computed([()] * (1 + len(names)), status="failed")
    return Run(analysis, ["time", *names], ["s", *units], waves, analysis.axis, trouble=why.found)


class Search:
    """The state x at t = 0, and the conditions there; f is P(x) - x."""

    def __init__(self, assembly: Assembly, analysis: Ss, progress: Progress | None) -> None:
        import numpy as np

        self.assembly, self.system, self.ss, self.progress = assembly, assembly.system, analysis, progress
        self.reltol = float(assembly.options.get("reltol", 1e-3))
        self.options = {**assembly.options, "reltol": max(min(self.reltol, FINER * self.reltol), FINEST)}
        self.states = np.array(self.system.differential_unknowns)
        self.places = np.array([k == "coordinate" for k in self.system.kinds]) & self.states
        self.turning = self.places & np.array([u == "rad" for u in self.system.units])
        self.moves: list[np.ndarray] = []
        self.drifts = np.zeros(self.system.n, dtype=bool)  # coordinates whose place nothing reads
        self.periods, self.multiplier, self.most, self.far = 0, 0.0, MOST, FAR
        self.x, self.flags = np.zeros(self.system.n), [0.0]
        self.weight, self.seen = np.ones(self.system.n), np.zeros((0, self.system.n))

    def find(self) -> None:
        """E440, E441 as NotPeriodic; W440."""
        self.x, self.flags = self.start()
        self.check_period()
        closer = CLOSER
        while True:
            f = self.shoot(closer)
            if not self.states.any():
                return
            self.multiplier = self.magnified(f)
            left = self.norm(f) / max(1.0 - self.multiplier, 1e-12)
            if self.multiplier >= 1.0 or left <= 1.0 or closer < 1e-6:
                break
            closer = 0.5 * closer * min(1.0, self.norm(f)) / left
        if self.multiplier > UNSTABLE:
            said = f"the orbit that .{self.ss.word} has found is not stable: "
            said += f"a period magnifies what disturbs it {self.multiplier:.3g} times"
            hint = "a transient leaves it: see where .tran goes, and whether several periods make one"
            self.assembly.flat.sink.warning("W440", said, self.ss.card.span, hint)

    # ---- a period ----

    def start(self) -> tuple[np.ndarray, list[float]]:
        """Where the search begins: behind `tstab` and a first period, whose largest values say what is small."""
        import numpy as np

        b, n, period = self.assembly.ctx.b, self.system.n, self.ss.tstop
        before = math.ceil(self.ss.tstab / period - 1e-9)
        unknowns = [b.x(k) for k in range(n)]
        waves = self.tran(period * (before + 1), period * before, outputs=unknowns, uic=self.ss.from_given)
        self.seen = np.array([np.frombuffer(waves.column(1 + k)) for k in range(n)]).T
        self.weigh(self.seen)
        x, flags = waves.state or ([], [])
        return np.array(x), flags

    def weigh(self, seen: np.ndarray) -> None:
        """What is small, by the largest values of a course."""
        import numpy as np

        largest: dict[str, float] = {}
        peak = np.abs(seen).max(axis=0)
        for unit, value in zip(self.system.units, peak, strict=True):
            largest[unit] = max(largest.get(unit, 0.0), float(value))
        like = np.array([1e-3 * largest[u] for u in self.system.units])
        least = np.array(self.system.tolerances(self.assembly.options))
        weight = least + self.reltol * np.maximum(peak, like)
        self.weight = np.where(weight > 0.0, weight, np.inf)

    def tran(
        self, length: float, rows_from: float, outputs: list[Any], begin: Any = None, uic: bool = False
    ) -> Any:
        ss = self.ss

        def tick(now: float, step: float, steps: int, events: int) -> bool:
            return bool(self.progress and self.progress(0.0, ss.tstop, step, steps, events))

        watch = tick if self.progress else None
        waves = self.system.tran(
            ss.tstep, length, tstart=rows_from, tmax=ss.tmax, uic=uic, outputs=outputs, options_=self.options, progress=watch,
            drawn=False, begin=begin,
        )  # fmt: skip
        self.periods += round(length / ss.tstop)
        if waves.status == "failed":
            from .failure import explain

            raise NotPeriodic(explain(self.assembly, ss, waves, []))
        if waves.status != "ok" or waves.state is None:
            raise KeyboardInterrupt
        return waves

    def passed(self, x: np.ndarray) -> tuple[list[float], list[float]]:
        """P(x), and the conditions there."""
        end: tuple[list[float], list[float]] = self.tran(
            self.ss.tstop, 0.0, [], (x.tolist(), self.flags)
        ).state
        return end

    def shift(self, x: np.ndarray) -> np.ndarray:
        """P(x) - x, without what coordinates are further on by and the equations do not see."""
        import numpy as np

        end, self.flags = self.passed(x)
        f = np.array(end) - x
        places = np.flatnonzero(self.places)
        turns = np.where(self.turning, TURN * np.round(f / TURN), 0.0)
        for group in (*(places[k : k + 1] for k in range(len(places))), places):
            for way in (f.copy(), turns):
                by = np.zeros_like(f)
                by[group] = way[group]
                # where nothing depends on the place, it does not on one that is far off either
                far = by if way is turns else by / max(float(np.abs(by).max()), 1e-300)
                if by.any() and self.unseen(far):
                    f = f - by
                    turns[group] = 0.0
                    self.drifts[group] |= way is not turns
        return f

    def unseen(self, by: np.ndarray) -> bool:
        """Are the equations the same where coordinates are `by` further on?"""
        import numpy as np

        system = self.system
        for x in self.seen[:: max(1, len(self.seen) // 5)]:
            for a, b in (
                (system.f(x.tolist(), 0.0), system.f((x + by).tolist(), 0.0)),
                (system.jac(x.tolist(), 0.0)[0], system.jac((x + by).tolist(), 0.0)[0]),
            ):
                if np.abs(np.subtract(a, b)).max(initial=0.0) > SEEN * max(1.0, np.abs(a).max(initial=0.0)):
                    return False
        return True

    def check_period(self) -> None:
        """E440 where an expression of time is another one a period later."""
        import numpy as np

        system, period = self.system, self.ss.tstop
        x = self.seen[0].tolist()
        for t in (0.137 * period, 0.591 * period, 0.853 * period):
            for read in (system.f, system.q):
                a, b = np.array(read(x, t)), np.array(read(x, t + period))
                size = np.abs(a).max(initial=0.0)
                row = int(np.argmax(np.abs(a - b))) if len(a) else 0
                if len(a) and abs(a[row] - b[row]) > 1e-6 * max(size, 1e-12):
                    said = (
                        f"the equation of `{system.names[row]}` is another one a period of {period:g} s later"
                    )
                    raise NotPeriodic(
                        [self.error("E440", said, "give the period of everything that reads `time`")]
                    )

    # ---- the search ----

    def norm(self, f: np.ndarray) -> float:
        """In units of the tolerance."""
        import numpy as np

        return float(np.abs(f / self.weight)[self.states].max(initial=0.0))

    def shoot(self, closer: float) -> np.ndarray:
        """(1), until f and the step to the next x are within `closer` of the tolerance, twice."""
        import numpy as np

        xs: list[np.ndarray] = []
        fs: list[np.ndarray] = []
        best: tuple[float, np.ndarray, list[float]] | None = None
        x, near = self.x, 0
        until = self.periods + self.most
        while self.periods < until:
            try:
                f = self.shift(x)
                error = self.norm(f)
            except NotPeriodic:
                if best is None:
                    raise
                error = math.inf
            if best is not None and not error <= WORSE * best[0]:
                # the secants led astray: on from the best one, a period later
                x, self.flags, best = best[1], best[2], None
                xs, fs = [], []
                continue
            if best is None or error < best[0]:
                best = error, x + f, list(self.flags)
            xs, fs = [*xs[-DEPTH:], x], [*fs[-DEPTH:], f]
            step = f
            if len(xs) > 1:
                dx, df = np.diff(xs, axis=0).T, np.diff(fs, axis=0).T
                rows = self.states
                scale = 1.0 / self.weight[rows]
                g = np.linalg.lstsq(df[rows] * scale[:, None], f[rows] * scale, rcond=1e-12)[0]
                step = f - (dx + df) @ g
                if not self.norm(step) * self.reltol <= self.far:
                    step = f  # secants that say nothing
            near = near + 1 if max(error, self.norm(step)) <= closer else 0
            if near >= 2 or not self.states.any():
                self.x, self.moves = x, fs[len(fs) // 2 :]
                return f
            x = x + step
        worst = int(np.argmax(np.abs(f / self.weight) * self.states))
        name, unit = self.system.names[worst], self.system.units[worst]
        said = (
            f"no steady state of this period is found in {self.periods} periods: `{name}` is {abs(f[worst]):.3g} {unit} "
            "from where it began"
        )
        hint = "a longer tstab, a smaller reltol, or several periods as one where it repeats less often than the sources"
        raise NotPeriodic([self.error("E441", said, hint)])

    def magnified(self, f: np.ndarray) -> float:
        """By how much a period magnifies what disturbs the orbit: the largest eigenvalue of dP/dx, by Arnoldi's method."""
        import numpy as np

        flags, counts = list(self.flags), self.states & ~self.drifts
        n = int(counts.sum())
        weight = DISTURBED * self.weight[counts]
        random = np.random.default_rng(1)
        first = random.standard_normal(n)
        if self.assembly.machine is not None and self.assembly.machine.closures:
            # closed loops let few directions be: such as the search has taken
            moves = [m[counts] / weight for m in self.moves]
            first = sum(
                (random.standard_normal() * m / (np.linalg.norm(m) or 1.0) for m in moves), np.zeros(n)
            )
        basis, h = [first / (np.linalg.norm(first) or 1.0)] if n else [], np.zeros((MODES + 1, MODES))
        found = 0.0
        for m in range(min(MODES, n)):
            by = np.zeros(self.system.n)
            by[counts] = basis[m] * weight
            v = (self.shift(self.x + by) + by - f)[counts] / weight
            for _ in range(2):
                for k, u in enumerate(basis):
                    h[k, m] += (part := u @ v)
                    v = v - part * u
            h[m + 1, m] = np.linalg.norm(v)
            values, vectors = np.linalg.eig(h[: m + 1, : m + 1])
            k = int(np.argmax(np.abs(values)))
            found = float(abs(values[k]))
            if h[m + 1, m] * abs(vectors[m, k]) <= KNOWN * max(found, 0.1):
                break
            basis.append(v / h[m + 1, m])
        self.flags = flags
        return found

    def error(self, code: str, said: str, hint: str) -> Diagnostic:
        from ..diagnostics import Diagnostic

        return Diagnostic("error", code, said, self.ss.card.span, hint)
