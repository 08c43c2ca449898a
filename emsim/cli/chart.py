"""usage: emsim chart [options] deck.cir

Runs every method over a ladder of tolerances and charts error against CPU time and against evaluations.
Error is the largest difference from a converged reference over the compared signals and common times, in
parts of each signal's range; the reference is radau at its tightest, confirmed by a second method. scipy's methods run
on the same compiled equations where these reduce to an ODE, ngspice where the deck is plain SPICE. Every run has a time
limit; what does not get through is listed with the reason. Exit code 3 without a converged reference, 5 when a picture
is asked for and matplotlib is missing."""

from __future__ import annotations

import os
import sys
from os.path import abspath, basename, dirname, isdir, splitext

from .. import pipeline
from ..diagnostics import Diagnostic, OutsideError
from .arguments import DEFINE, HELP, JSON, QUIET, Arguments, Option, UsageError, defines, number, parse
from .console import OK, print_json, print_lines
from .run import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..reports.ladder import Judge, Problem
    from ..reports.work_precision import Chart

OPTIONS = [
    Option("-o --output", "picture to write, .png .svg or .pdf; none without it", "FILE"),
    Option("--csv", "every point as CSV; - is stdout, in place of the table", "FILE"),
    Option("--methods", "methods to run, instead of all", "A,B,..."),
    Option("--tolerances", "the ladder, instead of 1e-2,1e-3,...,1e-9", "X,Y,..."),
    Option("--signals", "columns to compare, instead of the states; ; between names that hold commas", "A,B,..."),
    Option("--times", "number of common times, 50", "N"),
    Option("--limit", "CPU seconds a run may take, instead of 60 times the best at its tolerance", "SECONDS"),
    Option("--rounds", "runs of each point for the median of its time, 5", "N"),
    Option("--budget", "seconds to spend on these repetitions, 10", "SECONDS"),
    Option("--alone", "neither scipy nor ngspice"),
    Option("--points", "list every run"),
    DEFINE,
    JSON,
    QUIET,
    HELP,
]  # fmt: skip


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    deck = given.deck("chart")
    tell = Tell(given.has("quiet"))
    try:
        chart = measured(deck, given, tell)
    finally:
        tell.clear()
    files = deliver([chart], given)
    if given.has("json"):
        print_json(OK, [], chart=chart.as_dict(), files=files)
    elif given.text("csv") != "-":
        from ..reports.chart import lines

        print_lines(lines(chart, given.has("points")))
    return OK


def measured(deck: str, given: Arguments, tell: Tell) -> Chart:
    """The chart of one deck, as the command line asks."""
    from ..reports import ladder, reference
    from ..reports.work_precision import Chart

    source, params = source_of(deck), defines(given)

    def prepare(options: dict[str, Any]) -> Any:
        return pipeline.prepare(pipeline.read(source, params), options)

    methods = _methods(given)
    problem = ladder.Problem(prepare, _names(given.text("signals")), _count(given, "times", ladder.TIMES))
    found = reference.find(problem, known_methods(), said=tell)
    name = "stdin" if deck == "-" else splitext(basename(deck))[0]
    chart = Chart(name, problem.title, problem.signals, len(problem.grid))
    chart.reference, chart.distance = found.text, found.distance
    chart.series = ladder.measure(
        problem, found.judge, methods, _tolerances(given) or ladder.TOLERANCES, given.number("limit"),
        _count(given, "rounds", 5), given.number("budget") or 10.0, said=tell,
    )  # fmt: skip
    if not given.has("alone"):
        _scipy(chart, problem, found.judge, source, params, tell)
        _ngspice(chart, problem, found.judge, deck, source, params, tell)
    return chart


def _scipy(
    chart: Chart, problem: Problem, judge: Judge, source: str, params: dict[str, str], tell: Tell
) -> None:
    from ..reports import witness

    try:
        system = pipeline.compile(source, defines=params)
        chart.series += witness.measure(problem, judge, system, said=tell)
    except witness.NoOde as why:
        chart.notes.append(f"no scipy witness: {why}")
    except ImportError:
        chart.notes.append("no scipy witness: pip install 'emsim[scipy]'")


def _ngspice(
    chart: Chart, problem: Problem, judge: Judge, deck: str, source: str, params: dict[str, str], tell: Tell
) -> None:
    if not problem.plain:
        return
    from ..reports import spice

    if params:
        chart.notes.append("no ngspice: it does not know -D")
        return
    try:
        text, folder = (source, os.getcwd()) if deck == "-" else (_text(deck), dirname(abspath(deck)))
        chart.series.append(spice.measure(problem, judge, text, folder, said=tell))
    except OutsideError as error:
        chart.notes.append(f"no ngspice: {error.diagnostics[0].message}")


def _text(deck: str) -> str:
    with open(deck, encoding="utf-8", errors="replace") as file:
        return file.read()


def deliver(charts: Sequence[Chart], given: Arguments) -> list[str]:
    """The files asked for; their names."""
    from ..reports.chart import csv_lines

    files = []
    if path := given.text("output"):
        from ..reports.draw import one

        _folder(path)
        try:
            one(path, charts[0])
        except ValueError as error:
            raise UsageError(f"-o {path}: {error}") from None
        files.append(path)
    if path := given.text("csv"):
        if path == "-":
            print_lines(csv_lines(charts))
        else:
            _folder(path)
            with open(path, "w", encoding="utf-8") as file:
                file.write("\n".join(csv_lines(charts)) + "\n")
            files.append(path)
    return files


def known_methods() -> list[str]:
    """Every method there is, from the one list of them."""
    from ..assemble.options import METHODS, SPELLINGS

    return list(dict.fromkeys([*METHODS, *SPELLINGS.values()]))


def _methods(given: Arguments) -> list[str]:
    from ..assemble.options import METHODS, SPELLINGS
    from ..diagnostics import suggest

    asked = _list(given.text("methods"))
    for method in asked:
        if method not in SPELLINGS and method not in METHODS:
            near = suggest(method, SPELLINGS)
            hint = f"did you mean {near}?" if near else f"there are {', '.join(METHODS)}"
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


def _count(given: Arguments, key: str, default: int) -> int:
    value = given.number(key)
    if value is not None and (value != int(value) or value > 10_000):
        raise UsageError(f"--{key}: {given.text(key)!r} is not a whole number up to 10000")
    return default if value is None else int(value)


def _folder(path: str) -> None:
    if not isdir(dirname(abspath(path))):
        raise OutsideError(Diagnostic("error", "E503", f"there is no folder {dirname(path)} for {path}"))


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
