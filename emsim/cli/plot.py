"""usage: emsim plot [options] result.raw ["SIGNALS" ...]

Draws signals of a result: a raw file of emsim, ngspice or LTspice, CSV, Parquet or NetCDF. "v(out) i(v1)" gives a panel a
unit over time, "v(out) vs v(in)" one signal over another; expressions as .print takes them. Several arguments are drawn one
below the other. Without -o the plot is text, in the terminal. For a deck: emsim deck.cir --plot "v(out)"."""

from __future__ import annotations

import sys
from os.path import splitext

from ..outputs import READERS, load
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK
from .convert import chosen
from .pictures import WINDOW_OPTIONS, Plots

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [
    Option("-o --output", "picture to write: .png, .svg or .pdf; - is the terminal", "FILE", repeat=True),
    Option("--analysis", "the analysis to draw: op, tran, or its number from 1", "NAME"),
    *WINDOW_OPTIONS,
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if not given.words:
        raise UsageError('emsim plot needs a result: emsim plot deck.raw "v(out)"')
    source, *lists = given.words
    if splitext(source)[1].lower() not in READERS:
        raise UsageError(
            f"{source} is no result, those end in {' '.join(READERS)}; for a deck: emsim {source} --plot "
            + (f'"{lists[0]}"' if lists else '"v(out)"')
        )
    files = given.all("output")
    plots = Plots(given, lists, files or ["-"], "-o")
    result = load(source)
    if not result.plots:
        raise UsageError(f"{source} holds no plot of real numbers")
    if (wanted := given.text("analysis")) is not None:
        result.plots = [chosen(result, wanted, "--analysis")]
    plots.draw(result)
    if plots.files and not given.has("quiet"):
        print(f"{result.main.kind}: {len(result.main)} points -> {', '.join(plots.files)}", file=sys.stderr)
    return OK
