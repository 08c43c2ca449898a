"""usage: emsim draw [options] deck.cir

Draws the circuit of a deck: sources left, ground below, the signal from left to right, subcircuits as boxes. Nothing is
simulated. Comments of the deck may say where parts go: `*@ place R1 right of Q1`, left of, above, below."""

from __future__ import annotations

import sys
from os.path import splitext

from .. import pipeline
from ..diagnostics import deck_error
from ..outputs.beside import write_text
from .arguments import DEFINE, HELP, QUIET, Option, UsageError, defines, overrides, parse
from .console import OK, check_targets, print_lines, show
from .run import DIALECT, source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

LOOKS = ("iec", "ansi")
OPTIONS = [
    Option("-o --output", "file to write: .svg or .png; otherwise SVG to stdout", "FILE"),
    Option("--symbols", "iec (IEC 60617) or ansi (IEEE 315); otherwise ansi", "LOOK"),
    Option("--dark", "for a dark page"),
    Option("--inside", "the inside of this use of a subcircuit: x1, x1.x2", "NAME"),
    DIALECT,
    DEFINE,
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    source, path = given.deck("draw"), given.text("output")
    look = (given.text("symbols") or "ansi").lower()
    if look not in LOOKS:
        raise UsageError(f"--symbols {look}: symbols are {' or '.join(LOOKS)}")
    extension = splitext(path)[1].lower() if path is not None and path != "-" else ".svg"
    if extension not in (".svg", ".png"):
        raise UsageError(f"{path}: a circuit is drawn as .svg or .png")
    if path is not None and path != "-":
        check_targets([path], source)
    if extension == ".png":
        from ..outputs import schematic  # Pillow may be missing
    from ..schematic.picture import draw

    flat = pipeline.read(source_of(source), defines(given), options=overrides(given, []))
    picture = draw(flat, look, (given.text("inside") or "").lower(), flat.sink)
    show(flat.sink.diagnostics, given.has("quiet"))
    if picture is None:
        deck_error("E373", "the deck has no circuit to draw", hint="the machine is drawn by --frame FILE")
    if picture.note() and not given.has("quiet"):
        print(f"note: {picture.note()}", file=sys.stderr)
    if extension == ".png":
        assert path is not None
        schematic.png(path, picture.data, given.has("dark"))
        return OK
    from ..schematic.svg import svg

    text = svg(picture.data, given.has("dark"), flat.title)
    if path is not None and path != "-":
        write_text(path, text)
    else:
        print_lines(text.splitlines())
    return OK
