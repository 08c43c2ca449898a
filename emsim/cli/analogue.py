"""usage: emsim analogue [options] deck.cir

Writes the electrical equivalent circuit of a one-dimensional machine (rotors, gears, springs, dampers, motors, pots) as
a plain ngspice deck that gives the same waveforms: speed is voltage, force and torque are currents, mass is a
capacitor, a spring an inductor. The deck's circuit is in it. Exit code 1 where a card has no such counterpart."""

from __future__ import annotations

from .. import pipeline
from ..outputs.beside import write_text
from ..reports import analogue
from .arguments import DEFINE, HELP, QUIET, Option, defines, parse
from .console import OK, check_targets, print_lines, show
from .run import source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [Option("-o --output", "file to write instead of stdout", "FILE"), DEFINE, QUIET, HELP]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    source, path = given.deck("analogue"), given.text("output")
    if path is not None and path != "-":
        check_targets([path], source)
    flat = pipeline.read(source_of(source), defines(given))
    assembly, planned = pipeline.prepare(flat)
    text = analogue.deck(assembly, planned)
    show(flat.sink.diagnostics, given.has("quiet"))
    if path is not None and path != "-":
        write_text(path, text)
    else:
        print_lines(text.splitlines())
    return OK
