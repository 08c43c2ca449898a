"""Short ways from deck text to what the circuit tests look at."""

from __future__ import annotations

import emsim
from emsim.diagnostics import Diagnostic, DiagnosticError


def deck(*lines: str) -> str:
    return "\n".join(("test deck", *lines, ".end", ""))


def operating_point(*lines: str) -> emsim.Table:
    """The .op table of a deck given by its lines."""
    return emsim.run(deck(*lines, ".op")).table("op")


def value(name: str, *lines: str) -> float:
    """One column at the operating point."""
    return float(operating_point(*lines)[name][0])


def problems(*lines: str) -> list[Diagnostic]:
    """Diagnostics of a deck that is wrong."""
    try:
        emsim.run(deck(*lines))
    except DiagnosticError as error:
        return error.diagnostics
    raise AssertionError("the deck was accepted")


def codes(*lines: str) -> list[str]:
    """Codes of the errors of a deck that is wrong."""
    return [d.code for d in problems(*lines) if d.severity == "error"]


def remarks(*lines: str) -> list[Diagnostic]:
    """Warnings and notes of a deck that runs."""
    return emsim.run(deck(*lines)).diagnostics
