"""The .control section: its commands, one file a family, and what runs them (session.py). COMMANDS is the one list of all."""

from __future__ import annotations

from . import analyse, arrays, assign, change, files, pictures, show, spectra
from .base import Command
from .session import Session

__all__ = ["COMMANDS", "Command", "Session"]

FAMILIES = (analyse, assign, change, show, files, arrays, spectra, pictures)
COMMANDS: dict[str, Command] = {c.word: c for family in FAMILIES for c in family.COMMANDS}
