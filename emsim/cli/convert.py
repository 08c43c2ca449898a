"""usage: emsim convert [options] from to

Makes a deck of a schematic: LTspice's .asc, KiCad's .kicad_sch and Qucs-S's .sch become .cir.

Converts results between raw (.raw), CSV (.csv), Parquet (.parquet) and NetCDF (.nc), by the names of the files. Every
number stays the same double. Names and units are kept; CSV needs --units for that, and a raw file knows units by kind of
quantity. CSV and Parquet hold one analysis: the last transient, or what --plot names. Parquet and NetCDF need the
extra `files`: pip install 'emsim[files]'."""

from __future__ import annotations

import sys

from ..diagnostics import Sink, deck_error
from ..outputs import READERS, load, save
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import DECK, OK, same_file, show

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..outcome import Outcome
    from ..table import Table

OPTIONS = [
    Option("--plot", "the analysis to convert: op, tran, or its number from 1", "NAME"),
    Option("--ascii", "write a raw file as text"),
    Option("--units", "write a second line with the units into a CSV file"),
    QUIET,
    HELP,
]
DECKS = (".cir", ".net", ".sp", ".spice", ".ckt")
ONE_TABLE = (".csv", ".parquet")


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if len(given.words) != 2:
        raise UsageError("emsim convert takes two files: emsim convert deck.raw out.csv")
    source, target = given.words
    if same_file(source, target):
        raise UsageError(f"{source} would be written over itself")
    if target.lower().endswith(DECKS):
        return _deck(source, target, given.has("quiet"))
    options: dict[str, Any] = {}
    for key, extension in ("ascii", ".raw"), ("units", ".csv"):
        if given.has(key):
            if not target.lower().endswith(extension):
                raise UsageError(f"--{key} is for {extension} files")
            options[key] = True
    for path in source, target:
        if not path.lower().endswith(tuple(READERS)):
            raise UsageError(f"{path}: the extension says no format; there is {', '.join(READERS)}")
    result = load(source)
    if not result.plots:
        raise UsageError(f"{source} holds no plot of real numbers")
    if (wanted := given.text("plot")) is not None:
        result.plots = [chosen(result, wanted, "--plot")]
    save(result, target, **options)
    if not given.has("quiet"):
        left = len(result.plots) - 1 if target.lower().endswith(ONE_TABLE) else 0
        written = [result.main] if left else result.plots
        print(
            "; ".join(f"{t.kind}: {len(t)} points, {len(t.names)} columns" for t in written) + f" -> {target}"
        )
        if left:
            kinds = ", ".join(t.kind for t in result.plots)
            print(f"{target} holds one analysis, {source} has {kinds}: choose with --plot", file=sys.stderr)
    return OK


def _deck(source: str, target: str, quiet: bool) -> int:
    """Writes the deck of a schematic. Raises DeckError with all that could not be read."""
    from ..build import cannot_read
    from ..outputs.beside import write_text
    from ..sheets import deck, worded
    from ..source import load

    sink = Sink()
    try:
        drawn = deck(load(source), sink)
    except OSError as error:
        raise cannot_read(source, error) from None
    except ValueError:
        drawn = None
    if drawn is None:
        deck_error(
            "E100",
            f"{source} is no schematic of LTspice, KiCad or Qucs-S",
            None,
            "a deck is made of such a file",
        )
    sink.raise_if_errors()
    write_text(target, worded(drawn))
    show(sink.diagnostics, quiet)
    if not quiet:
        print(f"{drawn.text.count(chr(10))} lines -> {target}")
    return _runs(source, target, quiet)


def _runs(source: str, target: str, quiet: bool) -> int:
    """Whether a schematic can run, whose deck was written; what stands in the way is told at its place in the drawing."""
    from ..diagnostics import DeckError
    from ..pipeline import check

    try:
        check(source)
    except DeckError as error:
        show(error.diagnostics, quiet)
        print(f"{target} is written, and does not run as it is", file=sys.stderr)
        return DECK
    return OK


def chosen(result: Outcome, wanted: str, option: str) -> Table:
    """The analysis of a name or a number. Raises UsageError."""
    if wanted.isdigit():
        if not 1 <= int(wanted) <= len(result.plots):
            raise UsageError(f"{option} {wanted}: there are {len(result.plots)}")
        return result.plots[int(wanted) - 1]
    try:
        return result.table(wanted.lower())
    except KeyError as error:
        raise UsageError(f"{option} {wanted}: {error.args[0]}") from None
