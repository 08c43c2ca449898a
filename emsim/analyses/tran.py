"""`.tran tstep tstop [tstart [tmax]] [uic] [startup]`: the time course from the operating point or from initial values, or from
rest with independent sources that rise in 20 us.

tstep is the print grid and the default of waveform times. The largest internal step is tmax or, as in
ngspice, the smaller of tstep and (tstop - tstart)/50, for methods that have no dense output of their own;
for the others (tstop - tstart)/10 and, where the equations are not linear, an eighth of a source's period.
Before tstart, a hundred-thousandth of the run where that is longer.
"""

from __future__ import annotations

import math

from ..diagnostics import Fix, Span
from .base import Analysis, Axis, Run, channels, derived, recorded, wrong

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Self

    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Sink
    from ..expr import Node
    from .base import Progress


SAME = 1e-12  # of their size: charges that differ by less are the same
DEGREE = 8  # of the polynomials within steps: no method's dense output has a higher one


class Left:
    """What a halted transient left at t [s], by names: unknowns, conditions, and what is stored in each row (Q)."""

    def __init__(
        self, t: float, x: dict[str, float], flags: dict[tuple[str, int], float], q: dict[str, float]
    ) -> None:
        self.t, self.x, self.flags, self.q = t, x, flags, q


class Leg:
    """A part of a transient, on a card that is to be halted or that goes on.

    begin   what the part before left; None at the start of the run
    until   the time at which it is halted [s]; None: the end of the run
    halts   (name, expression, both): it is halted when the expression rises above 0, or passes it either way
    left    what it left, when it has run
    """

    def __init__(
        self,
        begin: Left | None = None,
        until: float | None = None,
        halts: Sequence[tuple[str, Node, bool]] = (),
    ) -> None:
        self.begin, self.until, self.halts = begin, until, halts
        self.left: Left | None = None


class Tran(Analysis):
    """Arguments of the card [s]; `tmax` is None when it is not given."""

    word = "tran"
    asks_as = "tran"
    form = ".tran tstep tstop [tstart [tmax]] [uic] [startup]"
    meaning = "the time course from the operating point, or from initial values"
    plotname = "Transient Analysis"
    axis = Axis("time", "s")
    in_time = True
    streams = True
    draws = ("machine", "circuit")
    begin: tuple[list[float], list[float]] | None = None  # unknowns and conditions that it goes on from

    def __init__(
        self, card: Card, tstep: float, tstop: float, tstart: float, tmax: float | None, uic: bool
    ) -> None:
        self.card = card
        self.tstep, self.tstop, self.tstart, self.tmax, self.uic = tstep, tstop, tstart, tmax, uic
        self.leg: Leg | None = card.leg
        self.flags: list[tuple[int, bool]] = []  # those that halt it

    @classmethod
    def read(cls, card: Card, sink: Sink) -> Self | None:
        """Checks the card by ngspice's rules."""
        words = [a for a in card.args if isinstance(a, str)]
        uic = "uic" in card.flags or "uic" in words
        strange = [w for w in words if w != "uic"]
        args = [float(a) for a in card.args if not isinstance(a, str)]
        if strange:
            wrong(cls, card, sink, f".tran does not know `{strange[0]}`")
            return None
        if len(args) < 2:
            there = "is one number" if args else "is no number"
            wrong(cls, card, sink, f".tran needs tstep and tstop, there {there}")
            return None
        if len(args) > 4:
            wrong(cls, card, sink, f".tran takes four numbers at most, there are {len(args)}")
            return None
        if any(a != a or a in (float("inf"), float("-inf")) for a in args):
            wrong(cls, card, sink, ".tran has an argument that is no finite number")
            return None
        tstep, tstop = args[:2]
        tstart = args[2] if len(args) > 2 else 0.0
        largest = args[3] if len(args) > 3 and args[3] > 0 else None
        if tstop <= 0:
            wrong(cls, card, sink, f"tstop is {tstop:g} s, it must be positive")
        elif tstep <= 0:
            better = f".tran {tstop / 1000:g} {tstop:g} makes 1000 points"
            wrong(cls, card, sink, f"tstep is {tstep:g} s, it must be positive: {better}")
        elif not 0 <= tstart < tstop:
            wrong(cls, card, sink, f"tstart is {tstart:g} s, it must lie between 0 and tstop = {tstop:g} s")
        elif len(args) > 3 and args[3] < 0:
            wrong(cls, card, sink, f"tmax is {args[3]:g} s, it must be positive")
        else:
            if tstep > tstop:
                cls._other_way_round(card, tstep, tstop, sink)
            return cls(card, tstep, tstop, tstart, largest, uic)
        return None

    @staticmethod
    def _other_way_round(card: Card, tstep: float, tstop: float, sink: Sink) -> None:
        """W307: the step comes first on a .tran."""
        import re

        said = f"the step of {tstep:g} s is longer than the run of {tstop:g} s: the step stands first"
        words = re.match(r"(\s*\.tran\s+)([^\s{}'\"]+)(\s+)([^\s{}'\"]+)", card.span.text, re.I)
        fixes = []
        if words is not None:
            col = card.span.col + words.start(2)
            place = Span(card.span.file, card.span.line, col, card.span.col + words.end(4))
            fixes = [Fix(place, f"{words[4]}{words[3]}{words[2]}", f"write `.tran {words[4]} {words[2]}`")]
        hint = None if fixes else "form: .tran tstep tstop"
        sink.warning("W307", said, card.span, hint, fixes=fixes)

    def times(self) -> tuple[float, ...]:
        return self.tstep, self.tstop

    def rows(self) -> tuple[float, int, str]:
        hint = f"a larger step, .tran {self.tstop / 1e4:.1g} {self.tstop:g}: steps between rows are as short as they need be"
        return (self.tstop - self.tstart) / self.tstep, 0, hint

    def columns(self, ctx: Context) -> list[Output]:
        method = str(ctx.options.get("method"))
        if ctx.delayed and method.startswith("gauss"):
            # steps of one length do not end where an edge comes out of a line, and nothing damps what is missed there
            said = f"method {method} cannot do this deck: it reads what was a time ago"
            hint = "try: .options method=radau, or none at all: emsim then chooses by itself"
            ctx.sink.error("E413", said, self.card.span, hint)
        if self.leg is not None:
            self._halted(ctx, method)
        return super().columns(ctx)

    def _halted(self, ctx: Context, method: str) -> None:
        """The flags that halt it."""
        assert self.leg is not None
        what = (
            "lines"
            if ctx.delayed
            else "digital nodes"
            if ctx.digital
            else "clocks"
            if ctx.flat.clocked
            else ""
        )
        if what or method == "multirate":
            said = f"a transient of {what} cannot be halted: what is on its way in them is no unknown"
            if not what:
                said = "method multirate cannot halt a transient: its two parts are at different times"
            ctx.sink.error("E163", said, self.card.span, "leave out stop, step and resume")
            return
        self.flags = []
        for name, tree, both in self.leg.halts:
            flag = ctx.b.flag(ctx.compile(tree, self.card.span), None, name)
            word, number, _ = flag.node
            if word == "flag":
                self.flags.append((int(number), both))

    def _begin(self, assembly: Assembly) -> tuple[tuple[list[float], list[float]], list[float] | None]:
        """Unknowns, conditions and charges that it goes on from. Raises DeckError where the equations have states of which the
        part before knew nothing."""
        assert self.leg is not None and self.leg.begin is not None
        system, left = assembly.system, self.leg.begin
        new = [
            n
            for n, state in zip(system.names, system.differential_unknowns, strict=True)
            if state and n not in left.x
        ]
        if new:
            from ..diagnostics import DeckError, Diagnostic

            said = f"the run cannot go on: `{new[0]}` is a state that it did not have before"
            raise DeckError([Diagnostic("error", "E163", said, self.card.span, "run it anew: tran ..")])
        x = [left.x.get(n, start) for n, start in zip(system.names, system.initial(), strict=True)]
        flags = [left.flags.get(key, 0.0) for key in _counted(system.flag_names)]
        for k, _ in self.flags:
            flags[k] = system.values([system.flags[k][1]], x, left.t)[0] > 0.0
        there = system.q(x, left.t)
        q = [left.q.get(n, own) for n, own in zip(system.names, there, strict=True)]
        moved = any(abs(a - b) > SAME * max(abs(a), abs(b)) for a, b in zip(q, there, strict=True))
        return (x, [float(v) for v in flags]), q if moved else None

    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run:
        """Every accepted point from tstart on; the first column is the time, the channels of a drawing come last. Energy
        accounts are kept where the assembly has them, over time where it is drawn."""
        inside = self.inside(assembly)
        paces = [] if inside else self.paces(assembly)  # measurements too go along with one run
        if paces:
            assembly = assembly.noted()
        names, units, exprs = recorded(assembly, self)

        def tick(now: float, step: float, steps: int, events: int) -> bool:
            return bool(progress and progress(now, self.tstop, step, steps, events))

        watch = tick if progress else None
        drawn, book = assembly.drawn, assembly.accounts
        exprs = [*exprs, *channels(assembly, self)]
        kept = None
        impulsive: list[int] = []
        if book is not None:
            powers, energies, impulsive = book.expressions()
            kept = (powers, energies, drawn is not None)
        begin, leg, charges = self.begin, self.leg, None
        if leg is not None and leg.begin is not None:
            begin, charges = self._begin(assembly)
        start = 0.0 if leg is None or leg.begin is None else leg.begin.t
        until = self.tstop if leg is None or leg.until is None else min(leg.until, self.tstop)
        waves = assembly.system.tran(
            self.tstep,
            self.tstop,
            tstart=self.tstart,
            tmax=self.longest(assembly),
            uic=self.uic and start == 0.0,
            outputs=exprs,
            options_=assembly.options,
            progress=watch,
            accounts=kept,
            stream=self.into,
            inside=([o.expr for o in inside if o.expr is not None], DEGREE) if inside else None,
            closures=assembly.machine.closures if assembly.machine is not None else (),
            begin=begin,
            impulsive=impulsive,
            apart=paces,
            leg=None if leg is None else (start, until, charges),
            halts=self.flags,
        )
        if leg is not None and waves.state is not None:
            system, (x, flags) = assembly.system, waves.state
            q = system.q(x, waves.ended)
            leg.left = Left(
                waves.ended,
                dict(zip(system.names, x, strict=True)),
                dict(zip(_counted(system.flag_names), flags, strict=True)),
                dict(zip(system.names, q, strict=True)),
            )
        trouble = []
        if waves.status == "failed":
            from .failure import explain

            trouble = explain(assembly, self, waves, names)
        if assembly.machine is not None:
            from .gaps import closed

            gap = closed(assembly, waves, names)
            trouble = [gap] if gap is not None else trouble
        return Run(
            self, ["time", *names], ["s", *units], waves, self.axis, derived=derived(assembly, self),
            grid=(self.tstep, self.tstop, self.tstart), trouble=trouble, uic=self.uic, inside=(inside, DEGREE),
        )  # fmt: skip

    def paces(self, assembly: Assembly) -> list[list[int]]:
        """Unknowns of circuits that nothing ties to each other and that gain from steps of their own. None where more than rows
        is asked for: accounts go along with the steps of one run, and so do a run that goes on and one that may be halted."""
        alone = (
            self.begin is None and self.leg is None and assembly.accounts is None and assembly.drawn is None
        )
        if not alone or assembly.options["method"] == "multirate" or "fixed_step" in assembly.options:
            return []
        return assembly.system.paces(self.tstop)

    def longest(self, assembly: Assembly) -> float | None:
        """The longest step that the card and the modules of the deck allow [s]."""
        bound = min(assembly.ctx.longest_step, math.inf if self.tmax is None else self.tmax)
        return None if math.isinf(bound) else bound

    def inside(self, assembly: Assembly) -> list[Output]:
        """What measurements read, to be kept within the steps: all but what rows compute anew because the method knows it less
        well than the state."""
        asked = [(o, o.expr) for o in assembly.measured(self) if o.expr is not None]
        lags = assembly.system.lags([expr for _, expr in asked]) if asked else []
        return [o for (o, _), late in zip(asked, lags, strict=True) if not late]

    def text(self) -> str:
        words = [f"{self.tstep:g}", f"{self.tstop:g}"]
        if self.tstart or self.tmax is not None:
            words.append(f"{self.tstart:g}")
        if self.tmax is not None:
            words.append(f"{self.tmax:g}")
        return ".tran " + " ".join(words) + (" uic" if self.uic else "")


def _counted(names: list[str]) -> list[tuple[str, int]]:
    """Each name with how often it came before: several flags may have one."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        found.append((name, seen.get(name, 0)))
        seen[name] = seen.get(name, 0) + 1
    return found
