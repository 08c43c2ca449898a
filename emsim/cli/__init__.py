"""The command line: `emsim VERB ...`, one file a verb with its `main(args) -> exit code`; exceptions become exit codes here.

`emsim deck.cir` is `emsim run deck.cir`.
"""

from __future__ import annotations

import gc
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

VERBS = {
    "run": "simulate a deck, write its raw file and .print tables",
    "check": "read a deck and say what it is: unknowns, degrees of freedom, loops, what folded away",
    "view": "simulate a deck and open its page: waveforms and the moving machine on one clock",
    "explain": "the equations of a deck, how a line was read, a card's reference, a message by its code",
    "sweep": "run a deck many times: grids, random values, corners; measures, yield, pictures",
    "draw": "draw the circuit of a deck: SVG or PNG",
    "fit": "find values with which a deck goes through measured curves, and how sure they are",
    "optimise": "find values with which a deck's measures meet their goals",
    "plot": "draw signals of a raw, CSV, Parquet or NetCDF file: a picture, or text in the terminal",
    "compare": "run ngspice on the same deck, as written and at tight tolerances, and compare",
    "fmu": "write the deck as an FMU for co-simulation and model exchange (FMI 3.0 or 2.0)",
    "analogue": "write the electrical equivalent circuit of a one-dimensional machine as an ngspice deck",
    "chart": "run every method over a ladder of tolerances and chart error against time",
    "convert": "results between raw, CSV, Parquet and NetCDF files",
    "new": "write a small deck that runs, from a template",
    "playground": "write a page in which decks are written and run with nothing installed",
    "gallery": "write a folder with a moving picture of every deck, and behind each its page",
    "import": "write a robot of a URDF or MJCF file as a deck",
    "lessons": "copy the lessons, decks and text, and open the first",
    "models": "add public compact models in Verilog-A once, so that decks find them by level",
    "fmt": "lay a deck out: cards and comments in columns, nothing but blanks changed",
    "lsp": "the language server, for editors",
    "completion": "the completion script of bash, zsh or fish",
    "help": "this text, or that of a verb",
    "version": "the version, how the engine computes here, the Python",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command; returns its exit code (see console.py). Never raises, never shows a traceback.

    Without `argv` this is a process of one command, and the process ends here."""
    if argv is not None:
        return _code(list(argv))
    # collections while it imports and parses cost 5 % of such a process, and free nothing
    gc.disable()
    # a stream that was closed (`>&-`) is None
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    from .console import end_gently

    end_gently()
    code = _code(sys.argv[1:])
    _leave(code)
    return code


def _code(args: list[str]) -> int:
    try:
        return _dispatch(args)
    except KeyboardInterrupt:
        from .console import interrupted

        return interrupted()
    except BrokenPipeError:
        return 0
    except Exception as error:
        from .failures import report

        return report(error, args)


def _leave(code: int) -> None:
    """Ends the process without taking the interpreter apart piece by piece, a tenth of a small deck's time. Where
    somebody may depend on that (threads, a profiler, a stream that cannot be flushed) it does nothing."""
    if "threading" in sys.modules or sys.getprofile() is not None or sys.gettrace() is not None:
        return
    import atexit

    try:
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError, AttributeError):
        return
    os._exit(code)


def _dispatch(args: list[str]) -> int:
    if not args:
        from .arguments import UsageError

        raise UsageError("no deck: emsim deck.cir")
    verb, rest = args[0], args[1:]
    if verb in ("-h", "--help"):
        verb = "help"
    elif verb in ("-v", "-V", "--version"):
        verb = "version"
    elif verb not in VERBS:
        verb, rest = "run", args
    if verb not in ("help", "version") and ("-h" in rest or "--help" in rest):
        verb, rest = "help", [verb]
    # only the verb asked for is imported
    return int(__import__(f"{__name__}.{verb}", fromlist=["main"]).main(rest))
