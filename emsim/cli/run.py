"""usage: emsim run [options] deck.cir        (or emsim deck.cir, or - for stdin)

Simulates a deck. All results go to deck.raw in the working directory, .print tables to stdout (or, with --plot, what is
drawn; none with -r, as in ngspice), notes and diagnostics to stderr."""

from __future__ import annotations

import sys
from itertools import pairwise
from os.path import basename, splitext

from .. import pipeline
from ..diagnostics import ConvergenceError, DeckError, Diagnostic, Interrupted, inert
from ..outputs import raw
from ..outputs.beside import can_be_replaced
from ..source import SameFiles
from . import console
from .arguments import DEFINE, HELP, JSON, QUIET, Arguments, Option, UsageError, defines, overrides, parse
from .pictures import FILM_OPTIONS, PLOT_OPTIONS, WINDOW_OPTIONS, Films, Plots, check_window

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..result import Result
    from ..table import Table

    Target = tuple[str, str, dict[str, Any]]

LAST_ROWS = 20  # that are printed of a run which did not reach its end; its files have all
DIALECT = Option("--dialect", "how the deck is read where they differ: ngspice, ltspice, pspice", "NAME")
METHOD_OPTIONS = [
    Option(
        "--method",
        "integration method instead of auto: trap, gear, radau, trbdf2, esdirk, gauss, rk45, dop853",
        "NAME",
    ),
    Option("--reltol", "relative tolerance, instead of .options reltol", "X"),
    Option("--tmax", "largest time step, instead of .tran's", "SECONDS"),
    DIALECT,
    Option("--seed", "of random values: agauss, unif, mc, ..; instead of .options seed", "N"),
]
OPTIONS = [
    Option("-o --output -r", "raw file to write instead of deck.raw; no .print tables then", "FILE"),
    Option("--ascii", "write the raw file as text"),
    Option("--csv", "write a CSV file too; - is stdout, in place of the .print tables", "FILE"),
    Option("--html", "write a page too: waveforms and the moving machine, in one file", "FILE"),
    *PLOT_OPTIONS,
    *FILM_OPTIONS,
    *WINDOW_OPTIONS,
    Option("--energy", "print the energy ledger: supplied, dissipated, stored, by element and card"),
    Option("--no-files", "write no raw file"),
    Option("--pictures", "plot in a .control section draws a picture"),
    *METHOD_OPTIONS,
    DEFINE,
    JSON,
    QUIET,
    Option("-b --batch", "accepted and ignored, as ngspice spells it"),
    HELP,
]

# what writes files of these names
OTHERS = {
    ".csv": "--csv FILE", ".html": "--html FILE", ".gif": "--gif FILE", ".png": "--plot-file FILE", ".svg": "--plot-file FILE",
    ".pdf": "--plot-file FILE", ".parquet": "emsim convert deck.raw FILE", ".nc": "emsim convert deck.raw FILE",
}  # fmt: skip

TOLD = 4  # methods of a run that its summary names


def main(args: Sequence[str]) -> int:
    with SameFiles():
        return _run(parse(args, OPTIONS))


def _run(given: Arguments) -> int:
    deck = given.deck("run")
    files = _targets(given, deck)
    plots = Plots(given, given.all("plot"), given.all("plot-file"), "--plot-file")
    films = Films(given)
    check_window(given, plots, films)
    if plots.terminal and (given.has("json") or given.text("csv") == "-"):
        raise UsageError("--plot without --plot-file draws on stdout, as do --json and --csv -")
    progress = console.Progress() if console.Progress.wanted(given.has("quiet")) else None
    stream = _stream(files)
    code, trouble, source = console.OK, [], source_of(deck)
    try:
        result = pipeline.run(
            source,
            defines=defines(given),
            options=overrides(given),
            progress=progress,
            scene=given.has("html") or bool(films),
            energy=True if given.has("energy") or given.has("html") else None,
            also=plots.signals,
            stream=stream,
            say=None if given.has("json") or given.text("csv") == "-" else Said(progress),
        )
        if result.code is not None:
            code = result.code & 0xFF
        errors = {d.code for d in result.diagnostics if d.severity == "error"}
        if errors:
            # what was computed is written all the same: an analysis that emsim does not have, or a .meas that found nothing
            code = console.TOLERANCE if errors == {"E430"} else console.DECK
    except ConvergenceError as error:
        if error.partial is None:
            raise
        outside = all(d.code >= "E500" for d in error.diagnostics if d.severity == "error")
        code, result, trouble = (
            console.OUTSIDE if outside else console.CONVERGENCE,
            error.partial,
            error.diagnostics,
        )
    except Interrupted as stop:
        code, result = console.interrupted(), stop.partial
    finally:
        if progress:
            progress.clear()
    return _deliver(given, result, files, (plots, films), source, (code, trouble), stream)


class Said:
    """What a .control section prints, on stdout as it comes."""

    def __init__(self, progress: console.Progress | None) -> None:
        self.progress = progress

    def __call__(self, text: str) -> None:
        if self.progress:
            self.progress.clear()
        sys.stdout.write(inert(text))


def _stream(targets: Sequence[Target]) -> raw.Stream | None:
    """The raw file, to be written while the run goes on; not where it is to be text, or no file."""
    for kind, path, options in targets:
        if kind == "raw" and not options["ascii"] and can_be_replaced(path):
            return raw.Stream(path)
    return None


def source_of(deck: str) -> str:
    """What the pipeline takes for a deck argument: its path, or for `-` the text on stdin."""
    return console.stdin_text() + "\n" if deck == "-" else deck


def page_sheets(source: str, given: Arguments) -> list[tuple[str, str, str]]:
    """The sheets of a run's page beside those that the run itself fills: the equations."""
    from ..reports import explained

    return explained.sheets(pipeline.explain(source, defines(given), overrides(given)))


def page_engine(source: str, result: Result, given: Arguments) -> dict[str, Any] | None:
    """What its page computes with."""
    from ..fmus import page

    return page.engine(source, result, defines(given), overrides(given))


def _targets(given: Arguments, deck: str) -> list[Target]:
    """(format, path, writer options) of every file to write. Refuses to write over the deck."""
    targets: list[Target] = []
    if not given.has("no-files"):
        stem = "stdin" if deck == "-" else splitext(basename(deck))[0]
        if (name := given.text("output") or f"{stem}.raw") == "-":
            raise UsageError("-o needs the name of a file; --csv - writes to stdout")
        if (other := OTHERS.get(splitext(name)[1].lower())) is not None:
            raise UsageError(f"-o is the raw file, {name} is not one by its name: {other}")
        targets.append(("raw", name, {"ascii": given.has("ascii")}))
    elif given.has("output"):
        raise UsageError("--no-files and -o contradict each other")
    if (path := given.text("csv")) is not None:
        if path == "-" and given.has("json"):
            raise UsageError("--csv - and --json both want stdout")
        targets.append(("csv", path, {}))
    if (path := given.text("html")) is not None:
        if path == "-":
            raise UsageError("--html needs the name of a file")
        targets.append(("html", path, {}))
    console.check_targets([path for _, path, _ in targets if path != "-"], deck)
    return targets


def _deliver(
    given: Arguments,
    result: Result,
    targets: Sequence[Target],
    drawings: tuple[Plots, Films],
    source: str,
    ended: tuple[int, Sequence[Diagnostic]],
    stream: raw.Stream | None,
) -> int:
    """Files first, so that nothing that happens to the terminal can lose them; then tables and messages. A file that
    cannot be written loses none of the others. `ended`: the code so far, and what is to be said."""
    written, failed = _written(given, result, targets, source, stream)
    code, trouble = ended
    said, code = list(trouble), code or (console.OUTSIDE if failed else console.OK)
    said += failed
    for drawing in drawings:
        try:
            if drawing and any(len(table) for table in result.plots):
                drawing.draw(result)
                written += drawing.files
        except DeckError as error:
            # what cannot be drawn is said with the rest
            code, said = code or console.DECK, [*said, *error.diagnostics]
        except OSError as error:
            code, said = code or console.OUTSIDE, [*said, console.unwritten(", ".join(drawing.files), error)]
    if result.files:
        from ..outputs.written import remember

        for path in written:  # the section of the next run may write them over
            remember(path)
    diagnostics = [*result.diagnostics, *(d for d in said if d not in result.diagnostics)]
    if not given.has("json") and given.text("csv") != "-":
        in_file = given.text("output") in written
        _print_tables(result, not drawings[0].terminal and not in_file, given.has("energy"))
    # where nothing ran the note is all that says why there is no file
    console.show(diagnostics, given.has("quiet") and bool(result.plots))
    if given.has("json"):
        _print_json(code, diagnostics, written, result)
    elif result.plots and not given.has("quiet"):
        print(_summary(result, written), file=sys.stderr)
        console.point(said)
    return code


def _written(
    given: Arguments, result: Result, targets: Sequence[Target], source: str, stream: raw.Stream | None
) -> tuple[list[str], list[Diagnostic]]:
    """Files that were written, and what is to be said of those that could not be. CSV on stdout is no file."""
    written: list[str] = []
    failed: list[Diagnostic] = []
    for kind, path, options in targets if any(len(table) for table in result.plots) else ():
        if path == "-":
            from ..outputs import csv

            console.print_lines(csv.lines(result.main))
            continue
        try:
            if kind == "raw":
                raw.write(path, result, stream=stream, **options)
            elif kind == "html":
                from ..outputs import html

                engine = page_engine(source, result, given)
                html.write(path, result, sheets=page_sheets(source, given), engine=engine)
            else:
                from ..outputs import csv

                csv.write(path, result)
            written.append(path)
        except OSError as error:
            failed.append(console.unwritten(path, error))
    return written, failed


def _print_tables(result: Result, prints: bool, energy: bool) -> None:
    """.print, .meas, .four and the balance of energy, on stdout."""
    if not (result.prints or result.measured or result.spectra or energy):
        return
    from ..outputs import text

    if result.prints and prints:
        console.print_lines(text.lines(result, unfinished=LAST_ROWS))
    if result.measured:
        console.print_lines(text.measured(result))
    if result.spectra:
        console.print_lines(text.harmonics(result))
    for table in result.plots if energy else ():
        steps = table.step_values() if table.is_stepped else [{}]
        for values, course in zip(steps, table.courses() if table.is_stepped else [table], strict=True):
            if course.energy is not None:
                console.print_lines(["", *([text.said(values)] if values else []), *course.energy.table()])


def _print_json(code: int, diagnostics: Sequence[Diagnostic], files: Sequence[str], result: Result) -> None:
    console.print_json(
        code,
        diagnostics,
        files=files,
        analyses=[
            {
                "kind": p.kind,
                "points": len(p),
                "signals": p.names,
                "units": p.units,
                "status": p.status,
                "steps": p.steps,
            }
            for p in result.plots
        ],
        statistics={p.kind: p.stats for p in result.plots},
        steps=result.steps,
        fourier=[s.to_dict() for s in result.spectra],
        measures=[m.to_dict() for m in result.measured],
        energy={p.kind: p.energy.to_dict() for p in result.plots if p.energy is not None},
    )


def _chosen(table: Table) -> str:
    """Which methods `auto` took: `, auto: dop853 to 1.2s, then radau`; nothing where a method was asked for."""
    used = [u for u in table.stats.get("methods", ()) if u[2] != "asked for"]
    if not used:
        return ""
    parts = [used[0][1]]
    for (_, before, _), (t, method, _) in pairwise(used[:TOLD]):
        parts[-1] = f"{before} to {console.engineering(t)}s"
        parts.append(f"then {method}")
    more = f" and {len(used) - TOLD} more changes" if len(used) > TOLD else ""
    return f", auto: {', '.join(parts)}{more}"


def _closed(table: Table) -> str:
    """How far the loops of the machine were open in the worst row: `, loops closed to 2e-12 m`."""
    found = table.stats.get("open")
    return (
        f", loops closed to {' and '.join(f'{wide:.1g} {unit}' for unit, wide in found.items())}"
        if found
        else ""
    )


def _summary(result: Result, written: Sequence[str]) -> str:
    """One line for the analyses and the files: `tran: 3104 points in 12.1ms -> deck.raw`; one for the energy."""
    lines = []
    for table in result.plots:
        seconds = table.stats.get("seconds")
        spent = f" in {console.engineering(seconds)}s" if isinstance(seconds, float) else ""
        points = "1 point" if len(table) == 1 else f"{len(table)} points"
        end = "" if table.status == "ok" else f" ({table.status})"
        if table.is_stepped:
            points += f" in {len(table.courses())} steps"
        lines.append(f"{table.kind}: {points}{spent}{_chosen(table)}{_closed(table)}{end}")
    ledgers = [table.energy.summary() for table in result.plots if table.energy is not None]
    return "\n".join(["; ".join(lines) + (f" -> {', '.join(written)}" if written else ""), *ledgers])
