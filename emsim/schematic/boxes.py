"""Boxes of subcircuits: on which side a terminal stands, and which of them are operational amplifiers."""

from __future__ import annotations

import re

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

# names of terminals of operational amplifiers
PLUS = ("inp", "in+", "p", "ip", "vip", "plus", "np", "nip", "noninv", "inpos", "+")
MINUS = ("inm", "inn", "in-", "n", "im", "vin", "minus", "nn", "inv", "inneg", "-")
OUT = ("out", "o", "vout", "y")
ABOVE, BELOW = ("vcc", "vdd", "v+", "vp", "vs+", "vpos"), ("vee", "vss", "v-", "vn", "vs-", "vneg")


def gives(port: str) -> bool:
    """Is it a terminal that a signal comes out of?"""
    return port.lower() in OUT or port.lower().startswith(("out", "q"))


def sides(ports: Iterable[str]) -> tuple[list[str], list[str], list[str], list[str]]:
    """Terminals left, right, above and below."""
    left: list[str] = []
    right: list[str] = []
    above: list[str] = []
    below: list[str] = []
    for port in ports:
        low = port.lower()
        side = above if low in ABOVE else below if low in BELOW else right if gives(port) else left
        side.append(port)
    if not right and len(left) > 1:
        half = (len(left) + 1) // 2
        left, right = left[:half], left[half:]
    return left, right, above, below


# names of vendors' operational amplifiers, whose macromodels number their terminals +, -, supply above, supply below, output
VENDORS = re.compile(
    r"(ua|lm|tl|tlc|tlv|op|opa|ad|ada|lt|ltc|ne|mc|mcp|lf|max|ths|lmv|lmh|lmc)\d{2,5}[a-z]{0,4}([_/.-]\w+)?",
    re.I,
)


def amplifier(ports: dict[str, str], of: str) -> tuple[list[str], bool] | None:
    """Terminals +, -, out (, supplies) of a use of subcircuit `of`, where they have such names; are there supplies?"""
    if len(ports) == 5 and all(port.isdigit() for port in ports) and VENDORS.fullmatch(of):
        plus, minus, above_, below_, out = ports
        return [plus, minus, out, above_, below_], True
    low = {port.lower(): port for port in ports}
    roles: list[str] = []
    for names in (PLUS, MINUS, OUT):
        port = next((p for p in names if p in low), None)
        if port is None:
            return None
        roles.append(low.pop(port))
    above, below = next((p for p in ABOVE if p in low), None), next((p for p in BELOW if p in low), None)
    if not low:
        return roles, False
    if len(low) == 2 and above and below:
        return [*roles, low[above], low[below]], True
    return None
