"""Values as drawings write them: 4.7 k\u03a9, SIN 10 V 50 Hz."""

from __future__ import annotations

import re

from ..expr import Node

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Waveform

PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "\u00b5", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
UNITS = {"Ohm": "\u03a9"}


LINE, LINES = 18, 3  # letters of a line of a label, and lines of one text


def tidy(text: str) -> str:
    """An expression without the brackets about it all, numbers not longer than a drawing needs."""
    text = re.sub(r"\d+\.\d{5,}(e[-+]?\d+)?", lambda found: f"{float(found[0]):.4g}", text)
    if text.startswith("(") and text.endswith(")"):
        depth = 0
        for k, letter in enumerate(text):
            depth += (letter == "(") - (letter == ")")
            if not depth:
                return text[1:-1] if k == len(text) - 1 else text
    return text


def broken(text: str) -> list[str]:
    """A label's text in lines, broken behind operators and commas; nothing of it is left out."""
    lines, line = [], ""
    for piece in re.findall(r"[^-+*/,?:<>=&| ]*(?:[-+*/,?:<>=&| ]+|$)", text):
        if line and len(line) + len(piece.rstrip()) > LINE:
            lines.append(line.rstrip())
            line = ""
        line += piece
    return [line for line in (*lines, line.rstrip()) if line]


def listed(items: list[str]) -> list[str]:
    """Things with colons between, in lines that break at these alone."""
    lines = [items[0]]
    for item in items[1:]:
        if len(lines[-1]) + len(item) > LINE + 2:
            lines[-1] += " :"
            lines.append(item)
        else:
            lines[-1] += f" : {item}"
    return lines


def fits(lines: list[str]) -> bool:
    """Is that short enough for a label?"""
    return len(lines) <= LINES and all(len(line) <= LINE + 6 for line in lines)


def wrapped(text: str) -> list[str]:
    """... and what is too long is cut."""
    lines = broken(text)
    if not fits(lines):
        lines = [line if len(line) <= LINE + 6 else line[: LINE + 5] + "\u2026" for line in lines]
        lines = lines if len(lines) <= LINES else [*lines[: LINES - 1], lines[LINES - 1][:LINE] + "\u2026"]
    return lines


def short(value: Any) -> str:
    """A number with a prefix of SI, three digits or four."""
    return quantity(value, "").replace(" ", "")


def quantity(value: Any, unit: str) -> str:
    if isinstance(value, Node):
        return repr(value)[:18]
    if not isinstance(value, (int, float)):
        return ""
    unit = UNITS.get(unit, unit)
    size = abs(value)
    if size == 0 or not 1e-18 < size < 1e18:
        return f"{value:.4g} {unit}".rstrip()
    power = 0
    while size * 10.0**-power >= 999.95 and power < 12:
        power += 3
    while size * 10.0**-power < 0.99995 and power > -15:
        power -= 3
    return f"{value * 10.0**-power:.4g} {PREFIXES[power]}{unit}".rstrip()


def waveform(wave: Waveform, unit: str) -> str:
    """What a waveform does, in few words."""
    args = [a if isinstance(a, (int, float)) else None for a in wave.args]
    kind = wave.kind.upper()

    def at(k: int) -> float | None:
        return args[k] if k < len(args) else None

    if kind == "SIN" and at(1) is not None:
        parts = [f"{quantity(at(0), unit)} +" if at(0) else "", quantity(at(1), unit), quantity(at(2), "Hz")]
        return " ".join(p for p in parts if p)
    if kind == "PULSE" and at(1) is not None:
        low, high = short(at(0)), quantity(at(1), unit)
        period = at(6)
        rate = quantity(1 / period, "Hz") if period and period > 0 and period < 1 else ""
        return f"{low}\u2026{high} {rate}".rstrip()
    if kind == "EXP" and at(1) is not None:
        return f"EXP {short(at(0))}\u2026{quantity(at(1), unit)}"
    return kind
