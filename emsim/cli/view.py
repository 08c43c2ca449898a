"""usage: emsim view [options] deck.cir

Simulates a deck, writes one self-contained HTML page and opens it: waveforms with cursors, and the moving machine
beside them on one clock. Nothing is fetched from anywhere; the page can be sent to others as it is.

With --live the page stays open while the deck is edited: it shows every saved version, its .param as sliders, its mistakes
at their lines. It comes from a server on this machine's loopback address; Ctrl-C ends it, with exit code 0."""

from __future__ import annotations

import sys
from os.path import abspath, basename, join, splitext

from .. import pipeline
from ..diagnostics import ConvergenceError, Interrupted
from ..outputs import html
from ..source import SameFiles
from .arguments import DEFINE, HELP, QUIET, Arguments, Option, UsageError, defines, overrides, parse
from .console import CONVERGENCE, OK, OUTSIDE, Progress, check_targets, interrupted, point, show
from .run import METHOD_OPTIONS, page_engine, page_sheets, source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [
    Option(
        "-o --output", "where to write the page; otherwise a folder of its own among temporary files", "FILE"
    ),
    Option("--no-open", "write the page, do not open it"),
    Option("--live", "watch the deck and its included files: run and show every saved version"),
    Option("--port", "with --live: the port to listen on; otherwise a free one", "N"),
    *METHOD_OPTIONS,
    DEFINE,
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if given.has("live"):
        from .live import serve

        return serve(given)
    if given.has("port"):
        raise UsageError("--port is for --live")
    with SameFiles():
        return _view(given)


def _view(given: Arguments) -> int:
    deck = given.deck("view")
    if path := given.text("output"):
        if path == "-":
            raise UsageError("-o needs the name of a file")
        check_targets([path], deck)
    source, code, trouble = source_of(deck), OK, []
    progress = Progress() if Progress.wanted(given.has("quiet")) else None
    try:
        result = pipeline.run(
            source,
            defines=defines(given),
            options=overrides(given),
            progress=progress,
            scene=True,
            energy=True,
        )
    except ConvergenceError as error:
        if error.partial is None:
            raise
        outside = all(d.code >= "E500" for d in error.diagnostics if d.severity == "error")
        code, result, trouble = OUTSIDE if outside else CONVERGENCE, error.partial, error.diagnostics
    except Interrupted as stop:
        code, result = interrupted(), stop.partial
    finally:
        if progress:
            progress.clear()
    show(result.diagnostics, given.has("quiet"))
    if not given.has("quiet"):
        point(trouble)
    if not any(len(table) for table in result.plots):
        return code
    path = abspath(given.text("output") or _place(deck))
    html.write(path, result, sheets=page_sheets(source, given), engine=page_engine(source, result, given))
    if not given.has("quiet"):
        print(f"page: {path}", file=sys.stderr)
    if not given.has("no-open"):
        import webbrowser

        webbrowser.open("file://" + path)
    return code


def _place(deck: str) -> str:
    """A file of its own, whose folder only the user can read."""
    from tempfile import mkdtemp

    stem = "stdin" if deck == "-" else splitext(basename(deck))[0]
    return join(mkdtemp(prefix="emsim-"), f"{stem}.html")
