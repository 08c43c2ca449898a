"""`emsim help [VERB | WORD]`, and every verb's `--help`. A word of the language: what it means, as `emsim explain` says it."""

from __future__ import annotations

from . import VERBS
from .arguments import Option, UsageError, describe

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

EXIT_CODES = """\
exit codes: 0 ok, 1 deck wrong, 2 command line wrong, 3 no convergence (partial results kept),
            4 comparison over its tolerance, 5 outside world (file, ngspice missing),
            70 an error inside emsim,
            130 interrupted, 143 ended by SIGTERM, 129 by SIGHUP (partial results kept)"""


def main(args: Sequence[str]) -> int:
    if len(args) > 1:
        raise UsageError("help takes one verb or one word of the language")
    if args and args[0] not in VERBS and (lines := meaning(args[0])):
        print("\n".join(lines))
    else:
        print(verb_help(args[0]) if args else overview())
    return 0


def meaning(word: str) -> list[str]:
    """What a word of the language means; empty where it is none."""
    from ..editor import meanings

    return meanings.lines(word)


def overview() -> str:
    width = max(map(len, VERBS)) + 2
    verbs = "\n".join(f"  {verb:<{width}}{text}" for verb, text in VERBS.items())
    return (
        "emsim simulates SPICE decks that may hold machines: bodies, joints, motors.\n\n"
        "usage: emsim deck.cir             the same as emsim run deck.cir\n"
        "       emsim VERB [options] ...\n\n"
        f"verbs:\n{verbs}\n\n`emsim help VERB` lists the options of a verb.\n"
        "`emsim help WORD` says what a word of a deck means: SPRING, .tran, PULSE, omega, reltol; or lists cards, elements,\n"
        f"joints, dots, waveforms, probes, functions, options, methods, dialects, control (its commands).\n\n{EXIT_CODES}"
    )


def verb_help(verb: str) -> str:
    if verb in ("help", "version"):
        return f"emsim {verb}: {VERBS[verb]}"
    if verb in VERBS:
        from importlib import import_module

        module = import_module("." + verb, __package__)
        options: Sequence[Option] = module.OPTIONS
        text = module.__doc__
    else:
        from ..diagnostics import suggest
        from ..editor import meanings

        near = suggest(verb, [*VERBS, *meanings.known()])
        raise UsageError(
            f"no verb and no word of the language {verb!r}" + (f", did you mean {near}?" if near else "")
        )
    return f"{(text or '').strip()}\n\noptions:\n{describe(options)}"
