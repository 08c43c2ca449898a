"""usage: emsim compare [options] deck.cir

Runs the deck here, with ngspice as written, and with ngspice at tight tolerances, and says for every signal
how far the first two are from the third, as maximum and rms in percent of the signal's range, and which
is nearer. Exit code 4 when emsim is further than --tol on any signal, 3 when its own run does not get
through, 5 without ngspice. Edges may come --window early or late (default: a millionth of the run). Nothing
is written beside the deck. A run of ngspice has 300 s, one that a looser run can follow 45 s, and ends with
emsim; with --engine shared it has no limit."""

from __future__ import annotations

import os
import sys
from os.path import splitext

from .. import pipeline
from ..diagnostics import DeckError, Diagnostic, Interrupted, OutsideError, Sink
from .arguments import HELP, JSON, QUIET, Option, UsageError, overrides, parse
from .console import OK, TOLERANCE, check_targets, interrupted, print_json, print_lines, show
from .pictures import FORMATS
from .run import METHOD_OPTIONS, source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..result import Result

OPTIONS = [
    Option("--tol", "allowed maximum deviation, e.g. 0.5% (the default) or 0.005", "X"),
    Option("--window", "time by which an edge may shift", "SECONDS"),
    Option("--plot", "overlay picture to write, e.g. out.png or out.svg", "FILE"),
    Option("--engine", "how ngspice runs: process (default), or shared through PySpice", "NAME"),
    *METHOD_OPTIONS,
    JSON,
    QUIET,
    HELP,
]

PATIENCE = 45.0  # for those that a looser one can follow [s]
TIGHT = (1e-6, 1e-5, 1e-4)  # reltol of the reference run: the first that ngspice gets through


def main(args: Sequence[str]) -> int:
    from ..interop.ngspice import least_step
    from ..interop.spice_deck import elements_left_out
    from ..reports.compare import compare, table_lines

    given = parse(args, OPTIONS)
    deck = given.deck("compare")
    if plot := given.text("plot"):
        _target(plot, deck)
    engine = _engine(given.text("engine") or "process")
    text, folder = _read(deck)
    try:
        ours = pipeline.run(text if deck == "-" else deck, options=overrides(given))
    except Interrupted as stop:
        if given.has("json"):
            print_json(interrupted(), stop.partial.diagnostics)
        elif not given.has("quiet"):
            print("interrupted; nothing is compared", file=sys.stderr)
        return interrupted()
    show(ours.diagnostics, given.has("quiet"))
    if not ours.plots:
        raise DeckError(
            Diagnostic(
                "error", "E350", "there is no analysis to compare", None, "add .tran tstep tstop, or .op"
            )
        )
    if ours.steps:
        hint = "take .step out, and give one value: -D name=value"
        raise OutsideError(Diagnostic("error", "E511", "ngspice knows no .step", None, hint))
    if any(table.energy is not None for table in ours.plots):
        hint = "`emsim analogue` writes a one-dimensional machine as a plain deck: compare that"
        raise OutsideError(Diagnostic("error", "E511", "ngspice knows no bodies and joints", None, hint))
    if left_out := elements_left_out(text, folder):
        said = f"ngspice is handed no {', '.join(left_out[:8])}: what it computed would be another circuit"
        raise OutsideError(Diagnostic("error", "E511", said))
    written, written_failed = _as_written(engine, text, folder)
    tight, reltol = _tight(engine, text, folder, ours, written)
    tolerance, window = given.number("tol") or 0.005, given.number("window")
    found = compare(ours.plots, tight.plots, written.plots if written else (), tolerance, window)
    code = OK if found.passed else TOLERANCE
    if plot:
        _plot(plot, ours, written, tight, [row.name for row in found.rows if row.kind == "tran"])
    if given.has("json"):
        print_json(
            code,
            ours.diagnostics,
            tolerance=found.tolerance,
            window=found.window,
            tight_reltol=reltol,
            signals=[row.as_dict() for row in found.rows],
            unmatched=found.unmatched,
            points={"emsim": len(ours), "ngspice": len(written) if written else None, "tight": len(tight)},
            ngspice_failure=written_failed or None,
            files=[plot] if plot else [],
        )
        return code
    print_lines(table_lines(found))
    if not given.has("quiet"):
        reference = f"ngspice with reltol {reltol:g}, {len(tight)} points"
        print(f"reference: {reference}; window {found.window:.3g} s", file=sys.stderr)
        if least_step(text):
            said = "Y and P lines are approximations in ngspice, and go wrong where its steps are below 1 ps"
            print(said, file=sys.stderr)
        if written_failed:
            print(f"ngspice as written failed: {written_failed}", file=sys.stderr)
        if found.unmatched:
            print(f"not in ngspice's results: {', '.join(found.unmatched)}", file=sys.stderr)
    return code


def _read(deck: str) -> tuple[str, str]:
    """Text of the deck and the folder where its relative paths start. OutsideError when it cannot be read."""
    if deck == "-":
        return source_of(deck), os.getcwd()
    from ..sheets import deck as of_schematic
    from ..source import load

    try:
        file = load(deck)
        file = of_schematic(file, Sink()) or file
        return file.text, os.path.dirname(os.path.abspath(deck))
    except ValueError:
        return "", ""  # the own run says that it is no text
    except OSError as error:
        from ..build import cannot_read

        raise cannot_read(deck, error) from None


def _target(path: str, deck: str) -> None:
    """Refuses a picture that cannot be written before ngspice runs for it."""
    if splitext(path)[1].lower() not in FORMATS:
        raise UsageError(f"--plot {path}: pictures are {', '.join(FORMATS)}")
    from ..reports.draw import pyplot

    pyplot()
    check_targets([path], deck)


def _engine(name: str) -> Callable[[str], Result]:
    """The way ngspice is run: a function from deck text to Result."""
    if name == "process":
        from ..interop import ngspice

        ngspice.find()
        return ngspice.run
    if name == "shared":
        from ..interop import pyspice

        return pyspice.run_shared
    raise UsageError(f"--engine {name}: it is process or shared")


def _as_written(engine: Callable[[str], Result], text: str, folder: str) -> tuple[Result | None, str]:
    """ngspice's own run, or None and why it failed: the tight run can still judge emsim."""
    from ..interop import ngspice

    try:
        return engine(ngspice.as_written(text, folder)), ""
    except ngspice.NgspiceError as error:
        return None, str(error)


def _tight(
    engine: Callable[[str], Result], text: str, folder: str, ours: Result, written: Result | None
) -> tuple[Result, float]:
    """The reference run and its reltol. OutsideError when ngspice gets through at none of TIGHT."""
    from ..interop import ngspice

    grid = ours.main.grid if ours.plots else None
    points = max(ngspice.points_for(text), 2 * len(written) if written and written.plots else 0)
    tmax = max((grid[2] - grid[1]) / min(points, 500_000), ngspice.least_step(text)) if grid else 0.0
    said = ""
    for reltol in TIGHT:
        try:
            deck = ngspice.tightened(text, folder, grid, tmax, reltol)
            # a run that is too tight for ngspice may go on for ever with steps of nothing
            patient = engine is not ngspice.run or reltol == TIGHT[-1]
            tstop = grid[2] if grid and len(ours.plots) == 1 else 0.0
            return (engine(deck) if patient else ngspice.run(deck, PATIENCE, tstop)), reltol
        except ngspice.NgspiceError as error:
            said = str(error)
    raise OutsideError(Diagnostic("error", "E511", f"ngspice does not run this deck: {said}"))


def _plot(path: str, ours: Result, written: Result | None, tight: Result, names: list[str]) -> None:
    from ..reports.plot import overlay

    if not names:
        raise DeckError(Diagnostic("error", "E349", "there is no transient signal to draw"))
    # the reference below, emsim on top
    runs = {"ngspice tight": tight.main}
    if written:
        runs["ngspice as written"] = written.main
    runs["emsim"] = ours.main
    overlay(path, runs, names[:12], ours.title)
