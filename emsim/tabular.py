"""Tables of numbers as HTML, for notebooks, and numbers in units that are short."""

from __future__ import annotations

import math
from html import escape

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .table import Table

PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
UNSCALED = ("", "rad", "deg", "rpm", "C", "dB")
LISTED = 12  # signals that are listed at once; the rest is unfolded
STYLE = "font-variant-numeric: tabular-nums; border-collapse: collapse;"


def prefixed(unit: str, largest: float) -> tuple[float, str]:
    """(factor, unit) by which numbers of up to this size are short: 0.02 A -> (1000, "mA")."""
    if unit in UNSCALED or unit.startswith(("rad", "deg")) or not 0 < largest < math.inf:
        return 1.0, unit
    power = 3 * math.floor(math.log10(largest * 1.0000001) / 3)
    power = min(max(power, -15), 0 if unit == "s" else 9)
    return 10.0**-power, PREFIXES[power] + unit


def table(t: Table) -> str:
    """One line a signal: smallest, largest and last value; of a single point its value."""
    import numpy as np

    points = "1 point" if len(t) == 1 else f"{len(t)} points"
    head = f"{escape(t.plotname)}: {points}" + ("" if t.status == "ok" else f" <b>({t.status})</b>")
    if not len(t):
        return f"<div>{head}</div>"
    rows = []
    for name, unit in zip(t.names, t.units, strict=True):
        column = t.column(name)
        if column.dtype.kind == "c":
            name, column = f"|{name}|", np.abs(column)
        values = [column[-1]] if len(t) == 1 else [np.min(column), np.max(column), column[-1]]
        largest = max((abs(v) for v in values if np.isfinite(v)), default=0.0)
        factor, unit = prefixed(unit, largest)
        # rounding noise is nothing
        rows.append(
            [name, *(f"{factor * v if not abs(v) < 1e-9 * largest else 0.0:.5g}" for v in values), unit]
        )
    titles = ["signal", "value" if len(t) == 1 else "min", *(() if len(t) == 1 else ("max", "last")), "unit"]
    shown = _rows(titles, rows[:LISTED])
    if len(rows) > LISTED:
        shown += (
            f"<details><summary>{len(rows) - LISTED} more</summary>{_rows(titles, rows[LISTED:])}</details>"
        )
    return f"<div>{head}</div>{shown}"


def unknowns(
    names: Sequence[str], kinds: Sequence[str], units: Sequence[str], algebraic: Iterable[bool]
) -> str:
    """The equations of a deck: one line an unknown and its row."""
    rows = [
        [name, kind, unit, "F = 0" if plain else "dQ/dt + F = 0"]
        for name, kind, unit, plain in zip(names, kinds, units, algebraic, strict=True)
    ]
    shown = _rows(["unknown", "kind", "unit", "row"], rows[:LISTED])
    if len(rows) > LISTED:
        more = _rows(["unknown", "kind", "unit", "row"], rows[LISTED:])
        shown += f"<details><summary>{len(rows) - LISTED} more</summary>{more}</details>"
    return f"<div><b>{len(rows)} equations</b> d/dt Q(x, t) + F(x, t) = 0</div>{shown}"


def _rows(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; what begins with a letter stands at the left, numbers at the right."""

    def cells(tag: str, row: Sequence[str]) -> str:
        number = [text[:1] in "-0123456789" for text in (rows or [titles])[0]]
        return "".join(
            f'<{tag} style="text-align: {"right" if number[k] and k else "left"}; padding: 0 0.8em 0 0">{escape(text)}</{tag}>'
            for k, text in enumerate(row)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<table style="{STYLE}"><thead><tr>{cells("th", titles)}</tr></thead><tbody>{body}</tbody></table>'
    )
