"""`emsim chart --hard [case or method ...]`: the stability atlas on the terminal and in files."""

from __future__ import annotations

import os
import sys
from os.path import splitext

from .. import pipeline
from .arguments import Arguments, UsageError
from .chart import Tell
from .console import OK, TOLERANCE, check_targets, print_json, print_lines
from .pictures import FORMATS


def run_hard(given: Arguments) -> int:
    """Exit code 4 when a cell is not what theory, or `auto`, must be."""
    from ..reports import atlas

    if given.has("readme") and given.words:
        raise UsageError("--hard --readme writes the whole table: name no case")
    if strange := atlas.strangers(given.words):
        cases = "; ".join(case.name for case in atlas.CASES)
        raise UsageError(f"--hard: no case or method is called {' or '.join(strange)}; the cases are {cases}")
    files = [path for key in ("output", "csv") if (path := given.text(key)) and path != "-"]
    for path in files:
        if path != given.text("csv") and splitext(path)[1].lower() not in (*FORMATS, ".csv", ".md"):
            raise UsageError(f"-o {path}: the table goes to {', '.join(FORMATS)}, .csv or .md")
    check_targets(files)
    tell = Tell(given.has("quiet"))
    try:
        rows = atlas.atlas(pipeline.run, given.words, tell)
    finally:
        tell.clear()
    for path in files:
        atlas.write(path, rows, "csv" if path == given.text("csv") else "")
    if given.has("readme"):
        files.append(str(atlas.write_readme(rows)))
    code = OK if all(cell.expected for row in rows for cell in row) else TOLERANCE
    if given.has("json"):
        print_json(code, [], cells=[cell.as_dict() for row in rows for cell in row], files=files)
    elif given.text("csv") == "-":
        print_lines(atlas.csv_lines(rows))
    else:
        print_lines(
            atlas.table_lines(rows, sys.stdout.isatty() and not os.environ.get("NO_COLOR")), painted=True
        )
    return code
