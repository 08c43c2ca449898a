"""A .control section while it runs: the deck as it stands, plots, variables, and what was said.

The session knows no analysis and no file format: it is given what runs analyses of a flat deck, and the commands (the other
files of this folder) do the rest. A command that cannot be carried out is an error with its place, and the section goes on as
under ngspice -b; the exit code tells. What follows from an error, such as vectors of an analysis that failed, is not told again.
"""

from __future__ import annotations

import os
import sys

import numpy as np

from ..analyses import find
from ..diagnostics import ConvergenceError, DeckError, Diagnostic, OutsideError, Sink
from ..draws import SEED
from ..elaborate.steps import points
from ..expr import ExprError
from ..stepped import joined
from ..syntax import LineError
from . import words
from .budget import RUN, WORK, Budget
from .errors import CommandError, Followed, Stop
from .plots import Plot, Plots, Vector, table_of
from .program import Statement
from .vectors import Evaluator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from ..deck import Analysis
    from ..elaborate.altered import Altered
    from ..elaborate.flat import FlatDeck
    from ..result import Result
    from ..source import Line
    from ..table import Table
    from .stops import Breakpoint, Halted

    Analyse = Callable[[FlatDeck, list[Analysis]], Result]

# what `show` tells of a device's operating point, as far as the device knows it
SHOWN = ("i", "p", "id", "ic", "ib", "vgs", "vds", "gm", "gds", "gmbs", "gpi", "go")
# variables that ngspice -b sets itself; `oscompiled`: its number of the operating system
SYSTEMS = {"darwin": 7.0, "win32": 1.0, "cygwin": 2.0}
GIVEN = {"batchmode": True, "xspice_enabled": True, "oscompiled": SYSTEMS.get(sys.platform, 6.0)}
# how ngspice orders the analyses of a deck, whatever their order there
ORDER = ("ac", "dc", "op", "tran", "pz", "tf", "disto", "noise", "sens")


class Session:
    def __init__(
        self,
        deck: Altered,
        analyse: Analyse,
        out: Callable[[str], object],
        sources: Sequence[str] = (),
        most: int = WORK,
    ) -> None:
        self.deck, self._analyse, self._out = deck, analyse, out
        self.sink = Sink()
        self.trouble: list[Diagnostic] = []  # of analyses that did not converge
        self.plots = Plots()
        self.variables: dict[str, Any] = {}
        self.aliases: dict[str, str] = {}
        self.functions: dict[tuple[str, int], tuple[list[str], Any, str]] = {}
        self.seed(SEED)
        self.files: list[str] = []  # that were written
        self.folder = ""  # where they are, by `cd`
        self.pictures, self.draws = 0, False
        name = os.path.basename(deck.deck.file.path or "deck")
        self.stem = os.path.splitext(name)[0] or "deck"
        self.own = [os.path.realpath(p) for p in sources]  # the deck's, not to be written over
        self.has_run = self.quit = self.interrupted = False
        self.code: int | None = None  # of quit
        self.prints: list[tuple[str, list[str]]] = []
        self.measured: list[Any] = []  # what .meas found in the last run of the deck's own analyses
        self._result: Result | None = None
        self.steps: list[dict[str, float]] = []  # values of the deck's .step in each run of the last analysis
        self.measured_there: list[Any] = []  # what .meas found in each of them
        self.last_run: list[Table] = []  # of the deck's own analyses
        self.breakpoints: list[Breakpoint] = []  # of `stop`
        self.halted: Halted | None = None  # the transient that one of them has halted
        self.budget = Budget(most)
        self._now: Statement | None = None
        self._trees: dict[tuple[str, str], Any] = {}

    def count(self, statement: Statement, worth: int = 1) -> None:
        self._now = statement
        self.budget.do(worth)

    def source(self, lines: list[Line], what: str) -> None:
        """Carries out lines of another file, called `what` where they take too long (section.py)."""
        raise NotImplementedError

    # ---- what commands ask for ----

    def tree(self, text: str, start: str, s: Statement | None = None) -> Any:
        key = text, start
        found = self._trees.get(key)
        if found is None:
            s = s or self._now
            assert s is not None
            found = s.tree(text, start)
            if len(self._trees) > 5000:
                self._trees.clear()
            self._trees[key] = found
        return found

    def vectors(self, text: str, s: Statement | None = None, lenient: bool = False) -> list[Vector]:
        """The vectors of a list of expressions, each named by its text. `lenient`: what is wrong with one is told, and the
        others are given."""
        text = words.without_braces(text)
        tree = self.tree(text, "vectors", s)
        if not tree[1]:
            raise CommandError("E161", "no vector is named")
        evaluator, found = Evaluator(self, text), []
        for item in tree[1]:
            try:
                found += evaluator.named(item)
            except CommandError as error:
                if not lenient:
                    raise
                self.report(error)
        if not found and not lenient:
            raise CommandError("E162", f"`{text.strip()}` is no vector here")
        return found

    def numbers(self, text: str, count: int = 0) -> list[float]:
        """Real numbers, one for each expression of a list; E161 where there are not `count`, or not one."""
        found = []
        for v in self.vectors(text):
            if len(v) != 1:
                raise CommandError("E161", f"`{v.name}` is no single number")
            found.append(float(v.values[0].real))
        if len(found) != count if count else not found:
            wanted = "a number is" if count < 2 else f"{count} numbers are"
            raise CommandError("E161", f"{wanted} needed here, `{text}` comes to {len(found)}")
        return found

    def vector(self, name: str) -> Vector:
        """A vector by its name; of a device its parameter or current: @r1[resistance]."""
        found = self.plots.known(name)
        if found is None and name.startswith("@"):
            device, _, parameter = name[1:].rstrip("]").partition("[")
            value = self.deck.value(device.lower(), parameter.lower())
            if value is not None:
                return Vector(name, np.atleast_1d(np.asarray(value, dtype=float)), "", self.plots.current)
        if found is None:
            raise self.plots.missing(name)
        return found

    def integer(self, name: str, default: int) -> int:
        value = self.variables.get(name)
        return int(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else default

    @property
    def digits(self) -> int:
        from .numbers import DIGITS, MOST_DIGITS

        given = self.integer("numdgt", DIGITS)
        return min(given, MOST_DIGITS + 1) if given > 1 else DIGITS

    def variable(self, name: str) -> Any:
        """A variable: what `set` has set, or what the session knows of itself."""
        key, current = name.lower(), self.plots.current
        own = {
            "curplot": current.name, "curplotname": current.plotname, "curplottitle": current.title,
            "curplotdate": current.date, "plots": [p.name for p in self.plots],
            "inputdir": os.path.dirname(os.path.abspath(self.deck.deck.file.path or "deck")),
        }  # fmt: skip
        if key in own:
            return own[key]
        return self.variables.get(key, GIVEN.get(key))

    @staticmethod
    def parsed(word: str) -> Any:
        """A word as a variable holds it: a number where it is one."""
        try:
            return (
                float(word)
                if word[-1:] not in "_xX" and not word.lower().startswith(("inf", "nan"))
                else word
            )
        except ValueError:
            return word

    def seed(self, value: int) -> None:
        self.random = np.random.default_rng(abs(value))

    def say(self, text: str, end: str = "\n") -> None:
        self.budget.make(len(text) + 1)
        self._out(text + end)

    def warn(self, said: str, hint: str | None = None) -> None:
        self._once("warning", "W160", said, hint)

    def note(self, said: str, hint: str | None = None) -> None:
        self._once("note", "N160", said, hint)

    def _once(self, severity: Any, code: str, said: str, hint: str | None) -> None:
        span = None if self._now is None else self._now.span
        self.sink.add(Diagnostic(severity, code, said, span, hint))

    def report(self, error: Exception) -> None:
        span = None if self._now is None else self._now.span
        if isinstance(error, Followed) and (self.sink.has_errors or self.trouble):
            return
        if isinstance(error, (CommandError, ExprError)):
            self.sink.add(Diagnostic("error", error.code, error.message, error.span or span, error.hint))
        elif isinstance(error, LineError):
            self.sink.add(error.diagnostic)
        elif isinstance(error, (DeckError, OutsideError)):
            for d in error.diagnostics:
                self.sink.add(d)

    # ---- analyses ----

    def compute(self, cards: list[Analysis]) -> list[Table]:
        """Runs analyses of the deck as it stands, with .step for each of its values; their tables become plots, the last one
        the current one. What fails leaves a plot without vectors, so that nobody takes those of an earlier run for its own."""
        try:
            steps = self.deck.flat().steps
        except DeckError:
            steps = []  # told where it is run
        if not steps:
            return self._compute(cards)
        if self.breakpoints and any(c.kind == "tran" for c in cards):
            raise CommandError("E163", "breakpoints halt no runs of .step", "delete all, or take .step away")
        tables: list[Table] = []
        families: dict[int, list[Plot]] = {}
        trouble = len(self.trouble)
        self.steps, self.measured_there = [], []
        try:
            for changes in points(steps):
                before = set(map(id, self.plots))
                self.deck.step(changes)
                self._result = None
                found = self._compute(cards)
                done: Result | None = self._result
                for k, plot in enumerate([p for p in self.plots if id(p) not in before]):
                    plot.of_step(changes, families.setdefault(k, []))
                for one in () if done is None else done.measured:
                    one.step = len(self.steps)
                    self.measured_there.append(one)
                self.steps.append({step.column: value for step, value in changes})
                tables += found
                if len(self.trouble) > trouble or not found:
                    break
        finally:
            self.deck.step([])
        last = self.plots.current
        if len(last.family) > 1:
            what = ", ".join(s.column for s in steps)
            said = f".step: {last.family[0].name} to {last.name} are the runs over {what}; commands read {last.name}, the last"
            self.note(said, "meas measures every one; setplot, or tran1.v(out), reads another")
        return tables

    def _compute(self, cards: list[Analysis]) -> list[Table]:
        """One run."""
        from .stops import leg, on_its_way

        transients = [c for c in cards if c.kind == "tran"]
        for card in transients:
            card.leg = leg(self)
        tables = self._tables(cards)
        for table in tables:
            if len(table):
                kind = table.kind.rpartition(" ")[2]  # integrated noise is noise2
                kind = "pss" if kind == "harmonics" else kind
                plot = self.plots.new(kind, self.deck.title, table.plotname, table)
                plot.beside = {p.text for p in self.deck.wanted}
                plot.beside |= set(table.steps)  # what outer sources were
                if kind == "tran":
                    on_its_way(self, transients[0], plot)
        done = {t.kind for t in tables if len(t)}
        self._without([c for c in cards if done.isdisjoint((c.kind, *getattr(find(c.kind), "tables", ())))])
        self._interrupted(tables)
        return tables

    def _interrupted(self, tables: list[Table]) -> None:
        if any(t.status == "interrupted" for t in tables):
            self.interrupted = True
            raise Stop

    def extend(self, card: Analysis, plot: Plot) -> None:
        """A halted transient goes on, in its plot."""
        from .stops import on_its_way

        tables = self._tables([card])
        for table in tables:
            plot.extend(table)
            self.plots.current = plot
        on_its_way(self, card, plot)
        self._interrupted(tables)

    def _tables(self, cards: list[Analysis]) -> list[Table]:
        """What analyses of the deck as it stands give; what went wrong is reported."""
        if self._now is not None:
            self.count(self._now, RUN * len(cards))
        try:
            flat = self.deck.flat()
        except DeckError as error:
            self.report(error)
            return []
        flat.sink, flat.steps = Sink(), []
        asked = flat.measures, flat.fours
        if any(c.leg is not None for c in cards) and any(asked):
            # of a part of a run they would be numbers of that part
            flat.measures, flat.fours = [], []
            self.note(
                "no .meas and no .four of a transient that is halted",
                "meas and fourier measure what is there",
            )
        try:
            result = self._analyse(flat, cards)
        except ConvergenceError as error:
            self.trouble += [d for d in error.diagnostics if d not in self.trouble]
            partial = error.partial
            tables = [] if partial is None else list(partial.plots)
            for d in () if partial is None else partial.diagnostics:
                if d not in error.diagnostics:
                    self.sink.add(d)
        except DeckError as error:
            self.report(error)
            return []
        else:
            tables = list(result.plots)
            for d in result.diagnostics:
                self.sink.add(d)
            self._result = result
        finally:
            flat.measures, flat.fours = asked
        return tables

    def _without(self, cards: Sequence[Analysis]) -> None:
        for card in cards:
            self.plots.new(card.kind, self.deck.title, card.kind).failed = True

    def run_deck(self) -> None:
        """The analyses of the deck's own dot cards, in ngspice's order."""
        own = [c for c in self.deck.analyses() if c.kind not in ("meas", "four")]
        own.sort(key=lambda c: ORDER.index(c.kind) if c.kind in ORDER else len(ORDER))
        self.has_run = True
        if own:
            self._result = None
            self.last_run = self.compute(own)
            if self._result is not None:
                self.prints = self._result.prints
                self.measured = self.measured_there if self.steps else self._result.measured

    # ---- what is left at the end ----

    def tables(self) -> list[Table]:
        """The plots as tables of a result, the current one last; what commands added among them where it has their length."""

        const, current = self.plots.const, self.plots.current
        found: list[Table] = []
        for plot in sorted((p for p in self.plots if p is not const), key=lambda p: p is current):
            tables = [
                t for p in plot.family or [plot] if p in self.plots.all and (t := table_of(p)) is not None
            ]
            if len(plot.family) > 1 and tables:
                # one table of a family, where its last plot stands
                if plot is not plot.family[-1]:
                    continue
                changes = [p.changes for p in plot.family if p in self.plots.all and table_of(p) is not None]
                steps = [step for step, _ in changes[0]]
                tables = [joined(tables, steps, [[value for _, value in own] for own in changes])]
            found += tables
        return found
