"""usage: emsim new [options] NAME

Writes NAME.cir, a small deck that runs, to be changed. Templates: circuit (an RC low-pass), linkage (a four-bar turned
by a torque), motor (a DC motor with a flywheel), pendulum (an arm under position control), rectifier (a diode bridge),
spring (a mass on a spring); with parts of the library, .include servo.lib and so on: servo (motor, gear and control on an arm),
gearmotor (by its data sheet, with a winch), relay (with its armature), solenoid (pulls a plunger), voicecoil (shakes a cone),
encoder (counts a wheel's turns), hbridge (turns a motor both ways), inverter (runs a brushless motor), pid (two controllers, one
of them sampled), foc (field-oriented control by blocks of a clock). A lesson's name, such as 04_motor, is a template too
(`emsim lessons`). A file that exists is left alone."""

from __future__ import annotations

from os import listdir
from os.path import abspath, basename, dirname, join

from ..diagnostics import Diagnostic, OutsideError, suggest
from . import lessons
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK, check_folder

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [Option("-t --template", "which template, otherwise circuit", "NAME"), QUIET, HELP]
FOLDER = join(dirname(dirname(abspath(__file__))), "templates")


def templates() -> list[str]:
    return sorted(name.removesuffix(".cir") for name in listdir(FOLDER) if name.endswith(".cir"))


def text_of(chosen: str) -> str:
    if chosen not in templates():
        # its title is the new deck's, behind its name
        return lessons.text_of(f"{chosen}.cir")
    with open(join(FOLDER, chosen + ".cir"), encoding="utf-8") as file:
        return file.read()


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if len(given.words) != 1 or not given.words[0]:
        raise UsageError("emsim new takes one name: emsim new servo --template pendulum")
    chosen = given.text("template") or "circuit"
    if chosen not in templates() and chosen not in lessons.names():
        near = suggest(chosen, [*templates(), *lessons.names()])
        raise UsageError(
            f"there is no template {chosen!r}"
            + (f", did you mean {near}?" if near else f"; there is {', '.join(templates())}")
        )
    path = given.words[0] if "." in basename(given.words[0]) else given.words[0] + ".cir"
    text = text_of(chosen)
    check_folder(path)
    title = basename(path).rpartition(".")[0] or basename(path)
    try:
        with open(path, "x", encoding="utf-8") as file:
            file.write(f"{title}: {text}")
    except FileExistsError:
        raise OutsideError(
            Diagnostic("error", "E507", f"{path} exists already", None, "choose another name")
        ) from None
    if not given.has("quiet"):
        print(f"{path}: {text.partition(chr(10))[0]}\n  emsim {path}\n  emsim view {path}")
    return OK
