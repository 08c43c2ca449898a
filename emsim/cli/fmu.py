"""usage: emsim fmu [options] deck.cir

Writes the deck as an FMU, which other simulators load: deck.fmu. It is for co-simulation, and for model exchange too where
its equations are an explicit ODE. What it takes and gives stands in the deck,

  .fmu in=v1,load param=v2 tune=r1 out=v(out),angle(arm)

or is said here. Inputs are sources (V, I), plain R, L, C, parameters (.param), and numbers and waveforms of machine cards:
load, or load(tau). Parameters of the FMU are the same, held while it runs, or set between its steps too (tune). The FMU needs
neither emsim nor Python. It is for the platform at hand, or for those of --library."""

from __future__ import annotations

import os

from ..diagnostics import Diagnostic
from . import arguments
from .console import OK, check_targets, print_json, print_lines, show
from .run import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..fmus import Exported

OPTIONS = [
    arguments.Option("-o --output", "the FMU, instead of deck.fmu", "FILE"),
    arguments.Option("--fmi", "version of FMI: 3, or 2", "N"),
    arguments.Option("--kind", "cosim, model (exchange), or both", "KIND"),
    arguments.Option(
        "--in", "sources and values that are inputs, besides those of .fmu", "NAMES", repeat=True
    ),
    arguments.Option("--out", "signals that are outputs, as .print takes them", "SIGNALS", repeat=True),
    arguments.Option("--param", "sources and values that are parameters", "NAMES", repeat=True),
    arguments.Option("--tune", "parameters that are set between steps too", "NAMES", repeat=True),
    arguments.Option(
        "--library",
        "a library for a platform, instead of this one's; several for several",
        "FILE",
        repeat=True,
    ),
    arguments.DEFINE,
    arguments.METHOD,
    arguments.RELTOL,
    arguments.JSON,
    arguments.QUIET,
    arguments.HELP,
]


def main(args: Sequence[str]) -> int:
    from ..fmus import export

    given = arguments.parse(args, OPTIONS)
    deck = given.deck("fmu")
    path = (
        given.text("output")
        or f"{os.path.splitext(os.path.basename(deck))[0] if deck != '-' else 'model'}.fmu"
    )
    check_targets([path], deck)
    made = export(
        source_of(deck), path, _version(given), given.all("in"), given.all("out"), given.all("param"), given.all("tune"),
        arguments.defines(given), arguments.overrides(given), given.all("library"), _kind(given),
    )  # fmt: skip
    if given.has("json"):
        keys = ("name", "causality", "variability", "unit", "start")
        variables = [{key: getattr(v, key) for key in keys} for v in made.variables]
        print_json(
            OK, made.diagnostics, fmu=path, fmi=made.version, kinds=list(made.kinds), variables=variables
        )
        return OK
    show([d for d in made.diagnostics if isinstance(d, Diagnostic)], given.has("quiet"))
    if not given.has("quiet"):
        print_lines(_told(made))
    return OK


def _version(given: arguments.Arguments) -> int:
    text = given.text("fmi") or "3"
    if text not in ("2", "3", "2.0", "3.0"):
        raise arguments.UsageError(f"--fmi {text}: there are 2 and 3")
    return int(text[0])


def _kind(given: arguments.Arguments) -> str:
    from ..fmus.export import KINDS

    kind = given.text("kind") or "both"
    if kind not in KINDS:
        raise arguments.UsageError(f"--kind {kind}: there are {', '.join(KINDS)}")
    return kind


def _told(made: Exported) -> list[str]:
    words = {"cosim": "co-simulation", "model": "model exchange"}
    kinds = " and ".join(words[kind] for kind in ("cosim", "model") if kind in made.kinds)
    lines = [f"{made.path}: {kinds}, FMI {made.version}.0"]
    for causality, word in (("input", "inputs"), ("parameter", "parameters"), ("output", "outputs")):
        if found := made.of(causality):
            lines.append(
                f"  {word:<12}" + ", ".join(f"{v.name} [{v.unit}]" if v.unit else v.name for v in found)
            )
    return lines
