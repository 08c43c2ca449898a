"""usage: emsim import [options] robot.urdf      (or model.xml of MuJoCo, MJCF; or tyre.tir)

Writes a robot as a deck of cards: links with their masses and inertias, joints with their ends, friction and damping,
gears, transmissions and actuators, each actuator as a TORQUE with a voltage source as its input. What does not bear on
motion is named in comments; what does and cannot be said is an error (exit code 1). The base of a URDF is fixed to the
ground unless --free is given. Of a tyre property file (.tir, PAC2002) it writes the .model for TYRE."""

from __future__ import annotations

from .. import robots
from ..diagnostics import Diagnostic, OutsideError, Sink
from ..editor.layout import formatted
from ..outputs.beside import write_text
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK, check_targets, print_lines, show

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [
    Option("-o --output", "deck to write instead of stdout", "FILE"),
    Option("--free", "URDF: the base is not fixed to the ground"),
    Option("--density", "URDF: kg/m^3 of links without <inertial>, by their collision shapes", "NUMBER"),
    Option("--key", "MJCF: start at a <key> of <keyframe>, by its name or its number from 0", "NAME"),
    Option(
        "--contacts",
        "MJCF: a SHAPE for each geom that may touch and a CONTACT for each pair: rigid, with the file's friction",
    ),
    Option("--looks", "with shapes for pictures: massless bodies, welded on"),
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if len(given.words) != 1:
        raise UsageError("emsim import takes one file: emsim import robot.urdf -o robot.cir")
    source, path = given.words[0], given.text("output")
    options = robots.Options(
        given.has("free"),
        given.number("density"),
        given.text("key"),
        given.has("looks"),
        given.has("contacts"),
    )
    sink = Sink()
    if path is not None and path != "-":
        check_targets([path], source)
    try:
        text = formatted(robots.imported(source, options, sink))
    except ValueError as error:
        raise OutsideError(Diagnostic("error", "E500", str(error))) from None
    show(sink.diagnostics, given.has("quiet"))
    if path is not None and path != "-":
        write_text(path, text)
    else:
        print_lines(text.splitlines())
    return OK
