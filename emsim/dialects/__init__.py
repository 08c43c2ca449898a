"""Dialects: how decks of ngspice, LTspice and PSpice read what they share, one file each (base.py says what may differ).

A deck that names none is read as ngspice reads it, and refused where another reading would give another circuit in silence.
"""

from __future__ import annotations

from ..diagnostics import suggest
from .base import Dialect
from .ltspice import LTspice
from .ngspice import Ngspice
from .pspice import PSpice

__all__ = ["DIALECTS", "Dialect", "find", "unknown"]

DIALECTS: tuple[Dialect, ...] = (Ngspice(), LTspice(), PSpice())


def find(name: str) -> Dialect | None:
    """The dialect of that name."""
    return next((d for d in DIALECTS if d.name == name.lower()), None)


def unknown(name: str) -> tuple[str, str]:
    """Message and hint where there is no such dialect."""
    known = [d.name for d in DIALECTS]
    near = suggest(name.lower(), known)
    return (
        f"there is no dialect `{name}`",
        f"did you mean {near}?" if near else f"there are {', '.join(known)}",
    )
