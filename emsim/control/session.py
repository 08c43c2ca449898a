"""A .control section while it runs: the deck as it stands, plots, variables, and what was said.

The session knows no analysis and no file format: it is given what runs analyses of a flat deck, and the commands (the other
files of this folder) do the rest. A command that cannot be carried out is an error with its place, and the section goes on as
under ngspice -b; the exit code tells. What follows from an error, such as vectors of an analysis that failed, is not told again.
"""

from __future__ import annotations

import os
import re
import sys

import numpy as np

from ..analyses import find
from ..build import parse_signals
from ..diagnostics import ConvergenceError, DeckError, Diagnostic, OutsideError, Sink, suggest
from ..elaborate.steps import points
from ..expr import PROBES, ExprError, Scope, evaluate
from ..stepped import joined
from ..syntax import LineError
from . import program, words
from .budget import RUN, WORK, Budget, Spent
from .errors import CommandError, Followed, Jump, Stop
from .plots import CONSTANTS, Plot, Plots, Vector, spelled
from .program import Block, Statement
from .vectors import Evaluator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any

    from ..deck import Analysis, Probe
    from ..elaborate.altered import Altered
    from ..elaborate.flat import FlatDeck
    from ..result import Result, Table
    from ..source import Line
    from .base import Command
    from .stops import Breakpoint, Halted

    Analyse = Callable[[FlatDeck, list[Analysis]], Result]

# what `show` tells of a device's operating point, as far as the device knows it
SHOWN = ("i", "p", "id", "ic", "ib", "vgs", "vds", "gm", "gds", "gmbs", "gpi", "go")
MOST_ALIASES = 20  # names for names
SEED = 1
# variables that ngspice -b sets itself; `oscompiled`: its number of the operating system
SYSTEMS = {"darwin": 7.0, "win32": 1.0, "cygwin": 2.0}
GIVEN = {"batchmode": True, "xspice_enabled": True, "oscompiled": SYSTEMS.get(sys.platform, 6.0)}
# how ngspice orders the analyses of a deck, whatever their order there
ORDER = ("ac", "dc", "op", "tran", "pz", "tf", "disto", "noise", "sens")


def quantities(text: str) -> Iterator[str]:
    """@r1[i], omega(hinge) .. in a command's text."""
    from ..cards.joints import WORDS

    for match in re.finditer(
        r"@[A-Za-z][\w.:]*\[\w+\]|\b([A-Za-z]\w*)\([A-Za-z_][\w.]*(?:\([^()]*\))?\)", text
    ):
        if match[1] is None or (match[1].lower() not in "vi" and match[1].lower() in PROBES | WORDS.keys()):
            yield match[0].lower()


class Session:
    def __init__(
        self,
        deck: Altered,
        analyse: Analyse,
        out: Callable[[str], object],
        sources: Sequence[str] = (),
        most: int = WORK,
    ) -> None:
        from . import COMMANDS

        self.deck, self._analyse, self._out = deck, analyse, out
        self.commands = COMMANDS
        self.sink = Sink()
        self.trouble: list[Diagnostic] = []  # of analyses that did not converge
        self.plots = Plots()
        self.variables: dict[str, Any] = {}
        self.aliases: dict[str, str] = {}
        self.functions: dict[tuple[str, int], tuple[list[str], Any, str]] = {}
        self.seed(SEED)
        self.files: list[str] = []  # that were written
        self.folder = ""  # where they are, by `cd`
        self.pictures = 0
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

    # ---- the section as a whole ----

    def run(self, lines: list[Line]) -> None:
        body = self.read(lines)
        if body is None:
            return
        self.deck.wanted += self.wanted(body)
        scope = Scope(dict(self.deck.flat().params))
        for name, value in self.deck.deck.shared:
            if name not in CONSTANTS:
                scope.values[name] = evaluate(value, scope)
                self.plots.const.add(Vector(name, np.array([scope.values[name]]), "", self.plots.const))
        self.carry_out(body)

    def wanted(self, body: program.Body) -> list[Probe]:
        """What runs have to record besides what they record anyhow: currents of devices, quantities of the machine."""
        found: dict[str, Probe] = {}
        for s in program.every(body):
            command = self.commands.get(s.word)
            if command is not None and not command.records:
                continue
            shown = s.rest.partition(":")[0].split() if s.word == "show" else ()
            for text in (*quantities(s.rest), *(f"@{name}[{key}]" for name in shown for key in SHOWN)):
                if text not in found and self.is_quantity(text):
                    for probe in parse_signals(text):
                        probe.span = s.span
                        found[text] = probe
        return list(found.values())

    def is_quantity(self, text: str) -> bool:
        """length(x) is the length of a ROPE x, pos(x) the place of a slide; of any other x they are functions of a vector."""
        from ..assemble.terminals import MECHANICAL
        from .functions import EACH, WHOLE

        word, _, rest = text.partition("(")
        of_vectors = word in MECHANICAL and (word in EACH or word in WHOLE)
        return not of_vectors or rest[:-1].split(",")[0] in {c.name.lower() for c in self.deck.flat().machine}

    def carry_out(self, body: program.Body) -> None:
        """A section from its first command to its end, and the deck's own analyses where it has not run them and the deck asks
        for tables, as under ngspice -b; or where nothing else would have run."""
        try:
            try:
                self.body(body)
            except Jump as jump:
                what = (
                    f"no label `{jump.label}` is in reach"
                    if jump.label
                    else f"`{jump.kind}` stands in no loop"
                )
                self.report(CommandError("E160", what))
            if not (self.quit or self.has_run) and (self.deck.flat().prints or len(self.plots.all) == 1):
                try:
                    self.run_deck()
                except CommandError as error:
                    self.report(error)
        except Stop:
            pass
        except Spent as spent:
            now = None if self._now is None else self._now.span
            self.sink.error("E165", str(spent), now, "a loop whose condition never ends? break leaves it")

    def read(self, lines: list[Line]) -> program.Body | None:
        """The program of lines; None where its blocks do not fit together: then nothing of it is carried out."""
        before = self.sink.error_count
        body = program.program(lines, self.sink)
        if self.sink.error_count > before:
            return None
        program.check(body, self.sink, self.commands)
        return body

    def body(self, body: program.Body) -> None:
        at = 0
        while at < len(body):
            try:
                one = body[at]
                if isinstance(one, Block):
                    self.block(one)
                else:
                    self.statement(one)
            except Jump as jump:
                if jump.kind != "goto":
                    raise
                at = self.label(body, jump)
            at += 1

    def label(self, body: program.Body, jump: Jump) -> int:
        for at, one in enumerate(body):
            if isinstance(one, Statement) and one.word == "label" and one.rest.lower() == jump.label:
                return at
        raise jump

    def count(self, statement: Statement, worth: int = 1) -> None:
        self._now = statement
        self.budget.do(worth)

    def named(self, s: Statement) -> Statement:
        """The command that a name of `alias` stands for."""
        for _ in range(MOST_ALIASES):
            if s.word not in self.aliases or s.word in program.FLOW:
                return s
            s = Statement(s.line, s.at, f"{self.aliases[s.word]} {s.rest}")
        raise CommandError("E160", f"`{s.word}` stands for itself", "unalias takes a name away")

    def statement(self, s: Statement) -> None:
        self.count(s)
        try:
            s = self.named(s)
            if s.word in program.BLOCKS:
                raise CommandError("E160", f"an alias cannot begin a block: `{s.word}`")
            if s.word in ("break", "continue"):
                from .numbers import whole

                raise Jump(s.word, max(1, whole(s.rest, "the number of loops")) if s.rest else 1)
            if s.word == "goto":
                raise Jump("goto", label=words.substituted(self, s.rest).lower())
            if s.word == "label":
                return
            command = self.commands.get(s.word)
            if command is None:
                self.sink.add(program.unknown(s, suggest(s.word, self.commands)))
                return
            text = s.rest if command.raw else words.substituted(self, s.rest)
            found = words.redirected(text) if command.shows else None
            if found is None:
                command.run(self, text, s)
            else:
                self.into_file(command, found, s)
        except (CommandError, ExprError, LineError, DeckError) as error:
            self.report(error)
        except RecursionError:
            self.report(CommandError("E165", f"what `{s.word}` is given nests too deeply"))

    def into_file(self, command: Command, found: tuple[str, str, bool], s: Statement) -> None:
        """What a command says, into a file."""
        from .files import put, target

        text, name, behind = found
        path = target(self, words.substituted(self, name))
        said: list[str] = []
        out, self._out = self._out, said.append
        try:
            command.run(self, text, s)
        finally:
            self._out = out
        put(self, path, "".join(said), behind)

    def block(self, block: Block) -> None:
        head = block.head
        self.count(head)
        try:
            with self.budget.within(f"`{head.word}`"):
                getattr(self, "on_" + head.word)(block)
        except (CommandError, ExprError, LineError, DeckError) as error:
            self._now = head
            self.report(error)
        except RecursionError:
            self._now = head
            self.report(CommandError("E165", f"what `{head.word}` is given nests too deeply"))

    # ---- blocks ----

    def truth(self, s: Statement, text: str | None = None) -> bool:
        text = words.substituted(self, s.rest if text is None else text)
        found = self.vectors(text, s)
        if len(found) != 1:
            raise CommandError("E161", f"`{s.word}` needs a condition")
        return Evaluator.truth(found[0])

    def on_if(self, block: Block) -> None:
        for head, body in block.branches:
            if head.word != "else":
                self._now = head
                try:
                    if not self.truth(head):
                        continue
                except (CommandError, ExprError, LineError) as error:
                    self.report(error)  # and counts as false, as in ngspice
                    continue
            self.body(body)
            return

    def round(self, body: program.Body, head: Statement) -> bool:
        """One round of a loop; False where it is left."""
        self.count(head)
        try:
            self.body(body)
        except Jump as jump:
            if jump.kind == "goto":
                raise
            if jump.count > 1:
                raise Jump(jump.kind, jump.count - 1) from None
            return jump.kind == "continue"
        return True

    def on_while(self, block: Block) -> None:
        while self.truth(block.head):
            if not self.round(block.branches[0][1], block.head):
                return
            self._now = block.head

    def on_dowhile(self, block: Block) -> None:
        while self.round(block.branches[0][1], block.head):
            self._now = block.head
            if not self.truth(block.head):
                return

    def on_repeat(self, block: Block) -> None:
        text = words.substituted(self, block.head.rest)
        times = self.vectors(text, block.head)[0].values[0].real if text else float("inf")
        done = 0
        while done < times:
            if not self.round(block.branches[0][1], block.head):
                return
            done += 1

    def on_foreach(self, block: Block) -> None:
        name, _, rest = block.head.rest.partition(" ")
        if not name:
            raise CommandError(
                "E161", "foreach needs the name of a variable", "form: " + program.FLOW["foreach"][0]
            )
        listed = words.split(words.substituted(self, rest))
        if listed and listed[0] == "(" and listed[-1] == ")":
            listed = listed[1:-1]
        for word in listed:
            self.variables[name.lower()] = self.parsed(word)
            if not self.round(block.branches[0][1], block.head):
                return

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


def table_of(plot: Plot) -> Table | None:
    """A plot as a table, with what commands added where it is as long as the rest, else aside of it; None where there are no
    numbers."""
    from ..result import Columns, Table

    own = plot.table
    listed = list(plot.vectors.values())
    if plot.scale is not None and plot.has_scale:
        listed = [plot.scale, *(v for v in listed if v is not plot.scale)]
    rows = len(own) if own is not None else len(listed[0]) if listed else 0
    if not rows:
        return None
    aside = {v.key: v.values for v in listed if len(v) != rows or v.dims}
    listed = [v for v in listed if len(v) == rows and not v.dims]
    theirs = () if own is None else {spelled(name).lower() for name in own.names}
    if own is not None and all(v.key in theirs for v in listed):
        own.aside = aside
        return own
    store = Columns((v.values.tobytes() for v in listed), complex=[v.is_complex for v in listed])
    names, units = [column_name(v, plot) for v in listed], [v.unit for v in listed]
    axis = own.axis if own is not None else plot.has_scale
    made = Table(plot.kind, names, units, store, title=plot.title, axis=axis, plotname=plot.plotname)
    made.aside = aside
    if own is not None:
        made.stats, made.grid, made.status = own.stats, own.grid, own.status
    return made


def column_name(v: Vector, plot: Plot) -> str:
    """The name of a vector in tables and files: v(out) for `out`, i(v1) for `v1#branch`."""
    own = plot.table
    if own is not None:
        for name in own.names:
            if spelled(name).lower() == v.key:
                return name
    if v.key.endswith("#branch"):
        return f"i({v.key[:-7]})"
    if (
        v.unit == "V"
        and not v.derived
        and v is not plot.scale
        and v.key.replace("_", "").replace(".", "").isalnum()
    ):
        return f"v({v.key})"
    return v.name
