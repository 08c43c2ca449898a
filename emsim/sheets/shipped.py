"""Libraries of other programs that come along (emsim/lib), whose cards stand in the deck itself: it is plain for others too."""

from __future__ import annotations

import os
import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .sheet import Card

FOLDER = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "lib")
NAMES = ("Simulation_SPICE.sp", "opamp.sub")


def cards(path: str) -> list[Card] | None:
    """The cards of the library that a path names by its last part; None where it is none of ours."""
    base = re.split(r"[\\/]", path.strip("\"'"))[-1].lower()
    name = next((n for n in NAMES if n.lower() == base), None)
    if name is None:
        return None
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        lines = [line.strip() for line in file]
    return [[line] for line in lines if line and not line.startswith("*")]
