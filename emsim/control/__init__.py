"""The .control section: its commands, one file a family, and what runs them (section.py). COMMANDS is the one list of all."""

from __future__ import annotations

from . import (
    analyse,
    arrays,
    assign,
    change,
    digital,
    files,
    measures,
    pictures,
    program,
    show,
    spectra,
    stops,
)
from .base import Command
from .section import Section

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from ..source import Line

__all__ = ["COMMANDS", "Command", "Section", "check"]

FAMILIES = (analyse, assign, change, show, files, arrays, spectra, measures, pictures, digital, stops)


def check(lines: list[Line], sink: Sink) -> None:
    """What is wrong with commands before any is carried out: words that are none, blocks that do not close, expressions that
    cannot be read."""
    program.check(program.program(lines, sink), sink, COMMANDS)


COMMANDS: dict[str, Command] = {c.word: c for family in FAMILIES for c in family.COMMANDS}
