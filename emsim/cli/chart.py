"""usage: emsim chart [options] deck.cir        (or --hard [case or method ...])

Runs every method over a ladder of tolerances and charts error against CPU time and against evaluations.
Error is the largest difference from a converged reference over the compared signals and common times, in
parts of each signal's range; the reference is radau at its tightest, confirmed by a second method. scipy's methods run
on the same compiled equations where these reduce to an ODE, ngspice where the deck is plain SPICE. Every run has a time
limit; what does not get through is listed with the reason. Exit code 3 without a converged reference, 5 when a picture
is asked for and matplotlib is missing.

--hard runs the stability atlas, the decks in netlists/hard/ on which methods are known to fail, under every method: ok,
damped, rings, drifts, explodes or stops, with the number. Words after it keep the cases and methods that they name; -o
takes .md too. Exit code 4 when a cell is not what theory says, or `auto` is not ok."""

from __future__ import annotations

import os
import sys
from os.path import abspath, basename, dirname, splitext

from .. import pipeline
from ..diagnostics import OutsideError
from ..outputs.beside import write_text
from .arguments import DEFINE, HELP, JSON, QUIET, Arguments, Option, UsageError, defines, number, parse
from .console import OK, check_targets, print_json, print_lines
from .pictures import FORMATS
from .run import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from ..reports.ladder import Judge, Problem, Turns
    from ..reports.work_precision import Chart, Series

OF_LADDER = [
    Option("--csv", "every point as CSV; - is stdout, in place of the table", "FILE"),
    Option("--methods", "methods to run, instead of all", "A,B,..."),
    Option("--tolerances", "the ladder, instead of 1e-2,1e-3,...,1e-9", "X,Y,..."),
    Option("--limit", "CPU seconds a run may take, instead of 60 times the best at its tolerance", "SECONDS"),
    Option("--rounds", "runs of each point for the median of its time, 5", "N"),
    Option(
        "--budget", "seconds to spend on these repetitions, and on turns of what is compared, 10", "SECONDS"
    ),
    Option("--alone", "neither scipy nor ngspice"),
]
OPTIONS = [
    Option("-o --output", "picture to write, .png .svg or .pdf; none without it", "FILE"),
    *OF_LADDER,
    Option("--signals", "columns to compare, instead of the states; ; between names that hold commas", "A,B,..."),
    Option("--times", "number of common times, 50", "N"),
    Option("--hard", "the stability atlas: hard cases under every method; -o takes .md too"),
    Option("--readme", "of --hard: write the table into netlists/hard/README.md"),
    Option("--points", "list every run"),
    DEFINE,
    JSON,
    QUIET,
    HELP,
]  # fmt: skip


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if given.has("hard"):
        from .chart_hard import run_hard

        return run_hard(given)
    if given.has("readme"):
        raise UsageError("--readme goes with --hard")
    deck = given.deck("chart")
    _targets(given, deck)
    chosen = settings(given)
    tell = Tell(given.has("quiet"))
    try:
        if deck == "-":
            chart = measured(source_of(deck), "stdin", chosen, tell)
        else:
            chart = measured(deck, splitext(basename(deck))[0], chosen, tell)
    finally:
        tell.clear()
    files = deliver([chart], given)
    if path := given.text("output"):
        from ..reports.draw import one

        one(path, chart)
        files.append(path)
    if given.has("json"):
        print_json(OK, [], chart=chart.as_dict(), files=files)
    elif given.text("csv") != "-":
        from ..reports.chart import lines

        print_lines(lines(chart, given.has("points")))
    return OK


class Settings:
    """How a deck is to be charted.

    reference   CPU seconds for the reference, and as many for what confirms it
    own         keyword arguments of ladder.measure; scipy, ngspice: of theirs, None to leave them out
    even        the run ends at a common time, as other engines must
    others      measures other programs on the same problem: (problem, judge, tell, turn) -> series and notes
    """

    __slots__ = (
        "defines", "even", "methods", "ngspice", "others", "own", "reference", "scipy", "signals", "stop", "times",
    )  # fmt: skip

    def __init__(self, methods: Sequence[str]) -> None:
        self.methods = list(methods)
        self.reference = 8.0
        self.own: dict[str, Any] = {}
        self.scipy: dict[str, Any] | None = {}
        self.ngspice: dict[str, Any] | None = {}
        self.signals: list[str] | None = None
        self.stop: float | None = None
        self.times: int | None = None
        self.even = False
        self.others: Callable[..., tuple[list[Series], list[str]]] | None = None
        self.defines: dict[str, str] = {}


def settings(given: Arguments) -> Settings:
    """What the command line asks."""
    out = Settings(_methods(given))
    out.defines, out.signals = defines(given), _names(given.text("signals"))
    if given.has("times"):
        out.times = _count(given, "times")
    if tolerances := _tolerances(given):
        out.own["tolerances"] = tolerances
    if given.has("rounds"):
        out.own["rounds"] = _count(given, "rounds")
    for key in ("limit", "budget"):
        if (value := given.number(key)) is not None:
            out.own[key] = value
    if given.has("alone"):
        out.scipy = out.ngspice = None
    return out


def measured(source: str, name: str, chosen: Settings, tell: Callable[[str], object]) -> Chart:
    """The chart of one deck: a path, or its text."""
    from ..reports import ladder, reference
    from ..reports.work_precision import Chart

    def prepare(options: dict[str, Any]) -> Any:
        return pipeline.prepare(pipeline.read(source, chosen.defines), options)

    problem = ladder.Problem(prepare, chosen.signals, chosen.times or ladder.TIMES, chosen.stop, chosen.even)
    found = reference.find(problem, known_methods(), chosen.reference, tell)
    chart = Chart(name, problem.title, problem.signals, len(problem.grid))
    chart.reference, chart.distance, chart.confirmed = found.text, found.distance, found.confirmed
    if problem.states(problem.assembly).keys().isdisjoint(problem.signals):
        # what is left says little of a method: sources are right under every one
        left = ", ".join(problem.signals[:6])
        chart.notes.append(
            f"compared is {left}, and none of it stands under d/dt: name states by .save or --signals"
        )
    chart.series = ladder.measure(problem, found.judge, chosen.methods, **chosen.own, said=tell)
    absolute = ladder.maximal(problem)
    if absolute:
        chart.series += ladder.measure(
            problem, found.judge, absolute, **chosen.own, formulation="absolute", group="absolute", said=tell
        )
    if chosen.scipy is not None:
        _scipy(chart, problem, found.judge, source, chosen, tell)
    turns = ladder.Turns(problem, chart.series)
    turns.spend(chosen.own.get("rounds", ladder.ROUNDS), chosen.own.get("budget", ladder.BUDGET))
    if chosen.ngspice is not None and problem.plain:
        _ngspice(chart, problem, found.judge, source, chosen, tell, turns)
    if chosen.others is not None:
        series, notes = chosen.others(problem, found.judge, tell, turns.take)
        chart.series += series
        chart.notes += notes
    turns.settle()
    return chart


def _scipy(
    chart: Chart, problem: Problem, judge: Judge, source: str, chosen: Settings, tell: Callable[[str], object]
) -> None:
    from ..reports import witness

    try:
        system = pipeline.compile(source, defines=chosen.defines)
        chart.series += witness.measure(problem, judge, system, **(chosen.scipy or {}), said=tell)
    except witness.NoOde as why:
        chart.notes.append(f"no scipy witness: {why}")
    except ImportError:
        chart.notes.append("no scipy witness: pip install 'emsim[scipy]'")


def _ngspice(
    chart: Chart, problem: Problem, judge: Judge, source: str, chosen: Settings, tell: Callable[[str], object],
    turns: Turns,
) -> None:  # fmt: skip
    from ..reports import spice
    from ..source import load

    if chosen.defines:
        chart.notes.append("no ngspice: it does not know -D")
        return
    try:
        text, folder = (
            (source, os.getcwd()) if "\n" in source else (load(source).text, dirname(abspath(source)))
        )
        chart.series.append(
            spice.measure(problem, judge, text, folder, turns, **(chosen.ngspice or {}), said=tell)
        )
    except OutsideError as error:
        chart.notes.append(f"no ngspice: {error.diagnostics[0].message}")


def deliver(charts: Sequence[Chart], given: Arguments) -> list[str]:
    """The CSV file asked for; its name."""
    from ..reports.chart import csv_lines

    path = given.text("csv")
    if path is None:
        return []
    if path == "-":
        print_lines(csv_lines(charts))
        return []
    write_text(path, "\n".join(csv_lines(charts)) + "\n")
    return [path]


def _targets(given: Arguments, deck: str) -> None:
    """Refuses files that cannot be written, before minutes go into what they should hold."""
    check_targets([path for key in ("output", "csv") if (path := given.text(key)) and path != "-"], deck)
    if path := given.text("output"):
        if splitext(path)[1].lower() not in FORMATS:
            raise UsageError(f"-o {path}: pictures are {', '.join(FORMATS)}")
        from ..reports.draw import pyplot

        pyplot()


def known_methods() -> list[str]:
    """Every method there is, from the one list of them."""
    from ..assemble.options import METHODS, SPELLINGS

    return list(dict.fromkeys([*METHODS, *SPELLINGS.values()]))


def _methods(given: Arguments) -> list[str]:
    from ..assemble.options import METHODS, SPELLINGS
    from ..diagnostics import did_you_mean

    asked = _list(given.text("methods"))
    for method in asked:
        if method not in SPELLINGS and method not in METHODS:
            hint = did_you_mean(method, SPELLINGS, f"there are {', '.join(METHODS)}", "{}")
            raise UsageError(f"--methods: there is no method {method!r}, {hint}")
    return list(dict.fromkeys(asked)) or list(METHODS)


def _tolerances(given: Arguments) -> tuple[float, ...]:
    out = []
    for text in _list(given.text("tolerances")):
        value = number(text)
        if value is None or not 1e-14 <= value < 1:
            raise UsageError(f"--tolerances: {text!r} is not a number from 1e-14 to below 1")
        out.append(value)
    return tuple(dict.fromkeys(out))


def _names(text: str | None) -> list[str] | None:
    """`v(a),v(b)`; with a `;` anywhere, that alone separates."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(";" if ";" in text else ",") if name.strip()]
    if not names:
        raise UsageError("--signals needs names of columns")
    return names


def _list(text: str | None) -> list[str]:
    return [word.strip().lower() for word in (text or "").split(",") if word.strip()]


def _count(given: Arguments, key: str) -> int:
    value = given.number(key) or 0.0
    if value != int(value) or value > 10_000:
        raise UsageError(f"--{key}: {given.text(key)!r} is not a whole number up to 10000")
    return int(value)


class Tell:
    """What is being run, on one line of stderr when that is a terminal."""

    def __init__(self, quiet: bool) -> None:
        self.on, self.width = not quiet and sys.stderr.isatty(), 0

    def __call__(self, text: str) -> None:
        if self.on:
            sys.stderr.write("\r" + text.ljust(self.width))
            sys.stderr.flush()
            self.width = len(text)

    def clear(self) -> None:
        self("") if self.width else None
        if self.on:
            sys.stderr.write("\r")
