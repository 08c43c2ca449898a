"""`emsim chart --hard [case or method ...]`: the stability atlas on the terminal and in files."""

from __future__ import annotations

import os
import sys

from .. import pipeline
from .arguments import Arguments, UsageError
from .chart import Tell
from .console import OK, TOLERANCE, print_json, print_lines


def run_hard(given: Arguments) -> int:
    """Exit code 4 when a cell is not what theory, or `auto`, must be."""
    from ..reports import atlas

    if given.has("readme") and given.words:
        raise UsageError("--hard --readme writes the whole table: name no case")
    tell = Tell(given.has("quiet"))
    try:
        rows = atlas.atlas(pipeline.run, given.words, tell)
    finally:
        tell.clear()
    if not rows:
        raise UsageError(f"--hard: no case is called {' or '.join(given.words)}")
    files = [path for key in ("output", "csv") if (path := given.text(key)) and path != "-"]
    for path in files:
        try:
            atlas.write(path, rows, "csv" if path == given.text("csv") else "")
        except ValueError as error:
            raise UsageError(f"-o {path}: {error}") from None
    if given.has("readme"):
        files.append(str(atlas.write_readme(rows)))
    code = OK if all(cell.expected for row in rows for cell in row) else TOLERANCE
    if given.has("json"):
        print_json(code, [], cells=[cell.as_dict() for row in rows for cell in row], files=files)
    elif given.text("csv") == "-":
        print_lines(atlas.csv_lines(rows))
    else:
        print_lines(atlas.table_lines(rows, sys.stdout.isatty() and not os.environ.get("NO_COLOR")))
    return code
