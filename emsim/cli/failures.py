"""From an exception to a message and an exit code. Imported only when something went wrong."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from ..diagnostics import (
    REPORT,
    ConvergenceError,
    Diagnostic,
    DiagnosticError,
    InternalError,
    OutsideError,
    not_installed,
)
from .arguments import UsageError
from .console import CONVERGENCE, DECK, INTERNAL, OUTSIDE, USAGE, point, print_json, show

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

COMMAND_LINE = ("--plot", "signals")  # what messages call texts that stood there


def report(error: Exception, args: Sequence[str]) -> int:
    """Says what went wrong, on stderr and as JSON where that was asked for; returns the exit code, also where both
    streams are full or gone."""
    code, diagnostics = explain(error)
    with suppress(OSError):
        if code == USAGE and isinstance(error, UsageError):
            print(f"emsim: {error}\nemsim: `emsim help` lists verbs and options", file=sys.stderr)
        else:
            show(diagnostics, quiet := "--quiet" in args or "-q" in args)
            if not quiet and "--json" not in args:
                point(diagnostics)
        if "--json" in args:
            print_json(code, diagnostics)
    if code == INTERNAL and os.environ.get("EMSIM_TRACEBACK"):
        import traceback

        traceback.print_exception(error)
    return code


def explain(error: Exception) -> tuple[int, list[Diagnostic]]:
    """Exit code and diagnostics of an exception. What no stage has explained is E499 internal error."""
    if isinstance(error, UsageError):
        return USAGE, [Diagnostic("error", "E520", str(error))]
    if isinstance(error, DiagnosticError):
        codes = {ConvergenceError: CONVERGENCE, OutsideError: OUTSIDE, InternalError: INTERNAL}
        wrong = [d.span for d in error.diagnostics if d.severity == "error"]
        if wrong and all(span is not None and span.file.name in COMMAND_LINE for span in wrong):
            return USAGE, error.diagnostics
        return codes.get(type(error), DECK), error.diagnostics
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return OUTSIDE, [Diagnostic("error", "E500", f"{where}{error.strerror or error}")]
    if isinstance(error, MemoryError):
        return OUTSIDE, [
            Diagnostic("error", "E509", "out of memory", None, "record less: .save, a larger step on .tran")
        ]
    if (missing := not_installed(error)) is not None:
        return OUTSIDE, [missing]
    if isinstance(error, ImportError) and str(error).startswith("EMSIM_CODE"):
        return USAGE, [
            Diagnostic("error", "E520", str(error), None, "EMSIM_CODE=native, or no such variable at all")
        ]
    message = f"internal error: {type(error).__name__}: {error}"
    return INTERNAL, [Diagnostic("error", "E499", message, None, REPORT + "; EMSIM_TRACEBACK=1 shows where")]
