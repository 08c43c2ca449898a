"""The command line: `emsim VERB ...`, one file a verb, and the one place where exceptions become exit codes.

`emsim deck.cir` is `emsim run deck.cir`.
"""

from __future__ import annotations

import gc
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

VERBS = {
    "run": "simulate a deck, write its raw file and .print tables",
    "check": "read a deck and say what it is: unknowns, degrees of freedom, loops, what folded away",
    "view": "simulate a deck and open its page: waveforms and the moving machine on one clock",
    "compare": "run ngspice on the same deck, as written and at tight tolerances, and compare",
    "analogue": "write the electrical equivalent circuit of a one-dimensional machine as an ngspice deck",
    "chart": "run every method over a ladder of tolerances and chart error against time",
    "help": "this text, or that of a verb",
    "version": "the version",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code (see console.py). Never raises, never shows a traceback."""
    args = list(sys.argv[1:] if argv is None else argv)
    if argv is None:
        gc.disable()  # a process of one command: collections while it imports and parses cost 5 % and free nothing
    try:
        return _dispatch(args)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        return 0
    except Exception as error:
        from .failures import report

        return report(error, args)


def _dispatch(args: list[str]) -> int:
    if not args:
        from .arguments import UsageError

        raise UsageError("no deck: emsim deck.cir")
    verb, rest = args[0], args[1:]
    if verb in ("-h", "--help"):
        verb = "help"
    elif verb in ("-v", "--version"):
        verb = "version"
    elif verb not in VERBS:
        verb, rest = "run", args
    if verb not in ("help", "version") and ("-h" in rest or "--help" in rest):
        verb, rest = "help", [verb]
    # written out, so that a reader and a type checker can follow; only the verb asked for is imported
    if verb == "run":
        from .run import main as verb_main
    elif verb == "check":
        from .check import main as verb_main
    elif verb == "view":
        from .view import main as verb_main
    elif verb == "compare":
        from .compare import main as verb_main
    elif verb == "analogue":
        from .analogue import main as verb_main
    elif verb == "chart":
        from .chart import main as verb_main
    elif verb == "version":
        from .version import main as verb_main
    else:
        from .help import main as verb_main
    return verb_main(rest)
