"""Numbers as films write them; web/data.js has the same."""

from __future__ import annotations

import math

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
UNSCALED = ("", "rad", "rad/s")


def written(value: float, unit: str = "", digits: int = 3) -> str:
    """0.00574 A -> "5.74 mA"; as many characters from frame to frame as the size allows."""
    size = abs(value)
    if size == 0 or unit in UNSCALED or not 1e-12 <= size < 1e12:
        return f"{value:.{digits}g} {unit}".rstrip()
    power = 3 * math.floor(math.log10(size * (1 + 1e-9)) / 3)
    return f"{value * 10.0**-power:.{digits}g} {PREFIXES[power]}{unit}"


def rounded(value: float, digits: int) -> str:
    return f"{value:.{digits}g}"
