"""`.pss gfreq tstab node points harmonics [iterations [coefficient]] [uic]`: the periodic steady state of what nothing drives.

An oscillator's period T is not known beforehand. Where a signal s, that of `node`, comes up through a level c, the state
lies on a surface; R(x) is the state at the next return, and the orbit is the x for which R(x) = x: its T is the time of that
return (Poincare's section as the condition of the phase; Aprille and Trick, IEEE Trans. Circuit Theory 19, 1972, 354). The
fixed point is found as that of .ss is, by Anderson's acceleration (ss.py). A return is a transient of nearly a period by the
deck's own method and events, and a short rest whose length is the root of s = c.

`gfreq` [Hz] is a guess, `tstab` [s] the length of the transient before. That transient has the sources as they are written,
and so may be kicked off by one; from its end on they are held.
"""

from __future__ import annotations

import math

from .base import Axis, Computed, Run, recorded, wrong
from .ss import NotPeriodic, Search, not_found
from .tran import Tran

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any, Self

    import numpy as np

    from .._engine import Expr
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..deck import Probe
    from ..diagnostics import Sink
    from .base import Progress

POINTS, HARMONICS = 256, 10  # where the card leaves them out
LAST = 1e6  # periods: the stop time where waveforms leave one out, which no search comes to
WATCHED = 12  # periods of the guess that are looked at behind `tstab`
LONGER, TRIES = 4.0, 6  # so much longer is the next look where nothing returned, and so many there are
FAR = 0.5  # of the largest values: no step of the search goes farther
REST = 0.05  # of a period: its end, whose length is sought
ROOT = 12  # evaluations of the signal at the end of a return at most
SAME = 3e-2  # of their range: states on the section that differ by less are the same one again
ONE = 10.0  # of the tolerance: states so near are one
AT_REST = 1e-3  # of the range that was seen: an orbit so much smaller is a point of rest
FINE = 1e-5  # of the tolerance: how near the level a return ends
STILL = 1e-9  # of their size: equations that differ by less at two times do not read the time
SAMPLES = 4096  # of a period, for its harmonics, at least


class Pss(Tran):
    word = "pss"
    form = ".pss gfreq tstab node [points [harmonics [iterations [coefficient]]]] [uic]"
    meaning = "the periodic steady state of an oscillator: its period, waveforms over one, harmonics"
    plotname = "Time Domain Periodic Steady State Analysis"
    streams = False
    tables = ("pss", "pss harmonics")

    def __init__(
        self, card: Card, guess: float, tstab: float, signal: Probe, points: int, harmonics: int, most: int, uic: bool
    ) -> None:  # fmt: skip
        super().__init__(card, 1.0 / guess / points, 1.0 / guess, 0.0, None, False)
        self.guess, self.tstab, self.signal, self.points = guess, tstab, signal, points
        self.harmonics, self.most, self.from_given = harmonics, most, uic
        self.phases: dict[Any, Output] = {}  # the signal, by the equations that have it

    def times(self) -> tuple[float, ...]:
        return self.tstep, self.tstab + LAST / self.guess

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        from ..build import parse_signals

        words = [a for a in card.args if a != "uic"]
        uic = len(words) < len(card.args) or "uic" in card.flags
        node = words[2] if len(words) > 2 else None
        numbers = [a for k, a in enumerate(words) if k != 2]
        if node is None or any(isinstance(a, str) for a in numbers) or len(numbers) > 6:
            wrong(
                cls, card, sink, ".pss takes a guess of the frequency, a time before the search, and a node"
            )
            return None
        values = [float(a) for a in numbers]
        guess, tstab, points, harmonics, most = [
            *values[:5],
            *(0.0, 0.0, POINTS, HARMONICS, 0.0)[len(values) :],
        ][:5]
        if not all(map(math.isfinite, values)) or guess <= 0 or tstab < 0:
            said = f"the frequency {guess:g} Hz must be positive, the time {tstab:g} s not negative"
            wrong(cls, card, sink, said)
            return None
        if points < 4 or harmonics < 1:
            wrong(cls, card, sink, f"{points:g} points and {harmonics:g} harmonics: 4 and 1 are the fewest")
            return None
        text = f"{node:g}" if isinstance(node, float) else node
        asked = parse_signals(text if "(" in text else f"v({text})", ".pss")
        if len(asked) != 1:
            wrong(cls, card, sink, f".pss takes one signal, there are {len(asked)}")
            return None
        return cls(card, guess, tstab, asked[0], int(points), int(harmonics), int(most), uic)

    def columns(self, ctx: Context) -> list[Output]:
        from ..assemble.outputs import column

        found = column(ctx, self.signal.text, self.signal.ast, self.card.span)
        if found.expr is None:
            wrong(
                type(self), self.card, ctx.sink, f".pss takes a signal, `{self.signal.text}` is made of some"
            )
        self.phases[ctx] = found
        what = (
            "what is on its way in lines" if ctx.delayed else "events of digital nodes" if ctx.digital else ""
        )
        if what:
            said = f".pss does not find this state: {what} are no unknowns"
            ctx.sink.error(
                "E440", said, self.card.span, ".tran over many periods, with tstart near the end, shows it"
            )
        return super().columns(ctx)

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        import numpy as np

        search = Orbit(assembly, self, progress)
        try:
            search.find()
        except NotPeriodic as why:
            return not_found(self, assembly, why)
        own, period = search.assembly, search.period
        self.begin = search.x.tolist(), search.flags
        self.tstop, self.tstep = period, period / self.points
        run = super().run(own, progress)
        run.stats = {
            "period": period, "frequency": 1.0 / period, "returns": search.periods, "multiplier": search.multiplier
        }  # fmt: skip
        # harmonics, of samples that lie evenly
        names, units, exprs = recorded(own, self)
        count = max(SAMPLES, 32 * self.harmonics)
        even = own.system.tran(
            period / count, period, tmax=self.longest(own), outputs=exprs, options_=search.options, drawn=False,
            begin=self.begin,
        )  # fmt: skip
        t = np.frombuffer(even.column(0))
        rows = np.searchsorted(t, np.arange(count) * (period / count) - 1e-9 * period)
        lines = 1 + min(self.harmonics, count // 2 - 1)
        columns = []
        for k in range(len(names)):
            z = np.fft.rfft(np.frombuffer(even.column(1 + k))[rows]) * (2.0 / count)
            z[0] /= 2
            columns.append(np.ascontiguousarray(z[:lines]).tobytes())
        data = Computed([[k / period for k in range(lines)], *columns], [False, *(True for _ in columns)])
        run.beside.append(
            Run(
                self, ["frequency", *names], ["Hz", *units], data, Axis("frequency", "Hz"), kind=self.tables[1],
                plotname="Frequency Domain Periodic Steady State Analysis",
            )
        )  # fmt: skip
        return run


class Orbit(Search):
    """x is the state where the signal comes up through `level`, `period` the time until it does again."""

    ss: Any
    level = 0.0
    period = 0.0
    range = 0.0

    def __init__(self, assembly: Assembly, analysis: Pss, progress: Progress | None) -> None:
        super().__init__(assembly, analysis, progress)  # type: ignore[arg-type]
        self.written, self.period = assembly, 1.0 / analysis.guess
        self.most, self.far = analysis.most or self.most, FAR
        # where the transient before has ended, and how often it went on
        self.found: tuple[list[float], list[float]] | None = None
        self.looks = 0

    @property
    def phase(self) -> Expr:
        expr = self.ss.phases[self.assembly.ctx].expr
        assert expr is not None
        return expr

    def tran(
        self, length: float, rows_from: float, outputs: list[Any], begin: Any = None, uic: bool = False
    ) -> Any:
        ss = self.ss

        def tick(now: float, step: float, steps: int, events: int) -> bool:
            return bool(self.progress and self.progress(0.0, self.period, step, steps, events))

        watch = tick if self.progress else None
        waves = self.system.tran(
            min(self.period / 64.0, length), length, tstart=rows_from, tmax=ss.longest(self.assembly), uic=uic,
            outputs=outputs, options_=self.options, progress=watch, drawn=False, begin=begin,
        )  # fmt: skip
        if waves.status == "failed":
            from .failure import explain

            raise NotPeriodic(explain(self.assembly, ss, waves, []))
        if waves.status != "ok" or waves.state is None:
            raise KeyboardInterrupt
        return waves

    # ---- where the search begins ----

    def find(self) -> None:
        """E440, E441, E442 as NotPeriodic; W440."""
        while True:
            try:
                super().find()
            except NotPeriodic:
                if self.found is None or self.looks >= TRIES:
                    raise
                continue  # what rang there was not the orbit yet: from farther on
            # an orbit, or a point of rest, which returns to itself too?
            waves = self.tran(self.period, 0.0, [self.phase], (self.x.tolist(), self.flags))
            s = memoryview(waves.column(1)).cast("d")
            if max(s) - min(s) > AT_REST * self.range:
                self.shorten(memoryview(waves.column(0)).cast("d"), s)
                return
            if self.looks >= TRIES:
                raise self.at_rest()

    def shorten(self, t: Sequence[float], s: Sequence[float]) -> None:
        """The first return to the same state, where the search began with several periods as one."""
        import numpy as np

        whole, gap = self.period, 0.5 * REST * self.period
        for k in range(1, len(t)):
            if not (s[k - 1] < self.level <= s[k] and gap < t[k] < whole - gap):
                continue
            x, flags = self.tran(t[k] - 0.1 * gap, 0.0, [], (self.x.tolist(), self.flags)).state
            try:
                end, _, rest = self.to_level(x, flags, 0.1 * gap)
            except NotPeriodic:
                continue
            if self.norm(np.where(self.places, 0.0, np.array(end) - self.x)) <= ONE:
                self.period = t[k] - 0.1 * gap + rest
                self.multiplier **= self.period / whole
                return

    def start(self) -> tuple[np.ndarray, list[float]]:
        length = WATCHED / self.ss.guess
        if self.found is None:
            unknowns = [self.written.ctx.b.x(k) for k in range(self.system.n)]
            waves = self.tran(
                self.ss.tstab + length, self.ss.tstab, [self.phase, *unknowns], uic=self.ss.from_given
            )
            self.hold(waves.state, self.ss.tstab + length)
            self.found = waves.state
            if self.looked_at(waves):
                return self.x, self.flags
        while self.looks < TRIES:
            unknowns = [self.assembly.ctx.b.x(j) for j in range(self.system.n)]
            waves = self.tran(length * LONGER**self.looks, 0.0, [self.phase, *unknowns], self.found)
            self.found, self.looks = waves.state, self.looks + 1
            if self.looked_at(waves):
                return self.x, self.flags
        raise self.at_rest()

    def hold(self, state: tuple[list[float], list[float]], at: float) -> None:
        """On with the sources as they are at a time. E440 where the equations go on changing with time."""
        import numpy as np

        from ..assemble import assemble

        before, flat = self.written, self.written.flat
        self.assembly = assemble(
            flat, dict(before.options), (*self.ss.times(), 0.0, at), False, analyses=before.analyses
        )
        self.system = self.assembly.system
        x = state[0]
        for t in (at, at + 0.137 * self.period, at + 0.591 * self.period, at + 3.853 * self.period):
            for name in ("f", "q"):
                a, b = (
                    np.array(getattr(system, name)(x, time))
                    for system, time in ((before.system, t), (self.system, 0.0))
                )
                row = int(np.argmax(np.abs(a - b))) if len(a) else 0
                if len(a) and abs(a[row] - b[row]) > STILL * max(np.abs(a).max(initial=0.0), 1e-12):
                    said = f"the equation of `{self.system.names[row]}` goes on changing with time: something drives this"
                    hint = ".ss tstep period finds the steady state of what sources drive; or a longer tstab, which lets them end"
                    raise NotPeriodic([self.error("E440", said, hint)])

    def looked_at(self, waves: Any) -> bool:
        """Level, period and state from a transient whose signal has returned to the same state at least once; False without."""
        import numpy as np

        t, s = np.frombuffer(waves.column(0)), np.frombuffer(waves.column(1))
        rows = np.array([np.frombuffer(waves.column(2 + k)) for k in range(self.system.n)]).T
        late = t >= t[-1] - 0.6 * (t[-1] - t[0])
        low, high = float(s[late].min()), float(s[late].max())
        noise = self.reltol * max(abs(low), abs(high)) + 1e-12
        if not high - low > 100.0 * noise:
            return False
        level = 0.5 * (low + high)
        up = np.flatnonzero((s[:-1] < level) & (s[1:] >= level) & late[:-1])
        if len(up) < 3:
            return False
        share = (level - s[up]) / (s[up + 1] - s[up])
        times = t[up] + share * (t[up + 1] - t[up])
        states = rows[up] + share[:, None] * (rows[up + 1] - rows[up])
        size = np.ptp(rows[late], axis=0)
        places = self.places & (size > 0)  # may be further on
        size = np.where((size > 0) & ~places & self.states, size, np.inf)
        back = range(1, (len(up) + 1) // 2 + 1)
        apart = [np.abs((states[-1] - states[-1 - m]) / size).max(initial=0.0) for m in back]
        # the fewest crossings after which the state is the same again, or nearly
        m = 1 + next(k for k, a in enumerate(apart) if a <= max(1.5 * min(apart), SAME))
        self.level, self.range, self.period = level, high - low, float(times[-1] - times[-1 - m])
        self.seen = rows[late]
        self.weigh(self.seen)
        # from the end of the transient to the section
        x, flags = waves.state
        length = self.period - (float(t[-1]) - float(times[-1])) % self.period
        self.x, self.flags = np.array(x), flags
        if length > REST * self.period:
            x, flags = self.tran(length - 0.5 * REST * self.period, 0.0, [], (x, flags)).state
            length = 0.5 * REST * self.period
        end, self.flags, _ = self.to_level(x, flags, length)
        self.x = np.array(end)
        return True

    def check_period(self) -> None:
        """Nothing reads the time: `hold` has seen to that."""

    def at_rest(self) -> NotPeriodic:
        text = self.ss.signal.text
        said = (
            f"`{text}` does not oscillate: it comes to rest, or never comes up through the same state twice"
        )
        hint = f"kick it off (.ic, ic= with uic, a PULSE at the start), a longer tstab, a better guess than {self.ss.guess:g} Hz"
        return NotPeriodic([self.error("E442", said, hint)])

    # ---- a return ----

    def passed(self, x: np.ndarray) -> tuple[list[float], list[float]]:
        """R(x), and the conditions there; its time is the `period`."""
        most = (1.0 - REST) * self.period
        late, flags = self.tran(most, 0.0, [], (x.tolist(), self.flags)).state
        self.periods += 1
        end, flags, rest = self.to_level(late, flags, REST * self.period)
        self.period = most + rest
        return end, flags

    def to_level(
        self, x: list[float], flags: list[float], guess: float
    ) -> tuple[list[float], list[float], float]:
        """From a state shortly before the signal comes up through the level to where it does: the state, and the time."""
        before: tuple[float, float] | None = None
        length, close = guess, max(FINE * self.reltol, 1e-13) * self.range
        best: tuple[float, list[float], list[float], float] | None = None
        for _ in range(ROOT):
            waves = self.tran(length, 0.0, [self.phase], (x, flags))
            values = memoryview(waves.column(1)).cast("d")
            away = values[-1] - self.level
            if best is None or abs(away) < best[0]:
                best = abs(away), *waves.state, length
            if abs(away) <= close:
                break
            base = before or (0.0, values[0] - self.level)
            slope = (away - base[1]) / (length - base[0]) if length != base[0] else 0.0
            step = -away / slope if slope > 0.0 else math.copysign(0.5 * length, -away)
            before = length, away
            length = min(max(length + step, 0.05 * length), 4.0 * max(length, guess))
        assert best is not None
        if best[0] > AT_REST * self.range:
            raise self.at_rest()
        return best[1], best[2], best[3]

    def magnified(self, f: np.ndarray) -> float:
        kept = self.period
        found = super().magnified(f)
        self.period = kept
        return found
