"""Columns of a page that would be too large: in each the rows that straight lines between them cannot stand for.

A column is kept within `share` of its range: between kept rows no row is farther than that from the line (swinging door,
Bristol 1990: the lines that pass all rows since the last kept one within the tolerance make a wedge, and a row outside of it
closes it). Its largest and smallest rows, first and last of each course and rows beside one that is not finite stay.
"""

from __future__ import annotations

from array import array
from math import inf, isfinite

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

SHARES = (1e-5, 1e-4, 3e-4, 1e-3, 3e-3)  # of a curve's range: how far a thinned one is off at most
LINES = (
    0.75  # of that by lines, passes over passes together; the rest by numbers that are rounded to half of it
)
PARTS = (6000, 3000, 1500)  # of the axis
TICKS = 2**30  # of the axis: its places are whole numbers of its span / TICKS


def kept_rows(
    x: Sequence[float], y: Sequence[float], tolerance: float, rows: Sequence[int], fixed: Iterable[int]
) -> list[int]:
    """Those of `rows` (ascending) that are needed. `fixed`: rows that stay, where courses begin and end."""
    if not rows:
        return []
    highest, lowest = max(rows, key=y.__getitem__), min(rows, key=y.__getitem__)
    stays = {rows[0], rows[-1], highest, lowest, *fixed}
    found = [rows[0]]
    last = before = rows[0]
    x0, y0, low, high = x[last], y[last], -inf, inf
    for k in rows[1:]:
        dx, dy = x[k] - x0, y[k] - y0
        slope = dy / dx if dx > 0 else inf
        if not low <= slope <= high and before != last:
            # the row before closes the wedge, and another begins there
            found.append(before)
            last, x0, y0, low, high = before, x[before], y[before], -inf, inf
            dx, dy = x[k] - x0, y[k] - y0
        if k in stays or not dx > 0 or not isfinite(dy):
            found.append(k)
            last, x0, y0, low, high = k, x[k], y[k], -inf, inf
        else:
            low, high = max(low, (dy - tolerance) / dx), min(high, (dy + tolerance) / dx)
        before = k
    return found


def span_of(values: Sequence[float]) -> float:
    """The range of what a scale shows."""
    import numpy as np

    from .panels import off_scale

    y = np.asarray(values, float)
    seen = y[~off_scale(y)]
    return float(np.ptp(seen)) if seen.size else 0.0


def extreme_rows(
    x: Sequence[float], y: Sequence[float], parts: int, rows: Sequence[int], fixed: Iterable[int]
) -> list[int]:
    """Of each of so many equal parts of the axis the first row, the lowest, the highest and the last."""
    found, first, last = set(fixed), min(x), max(x)
    held: dict[int, list[int]] = {}
    for row in rows:
        held.setdefault(int(parts * (x[row] - first) / (last - first)), []).append(row)
    for own in held.values():
        found |= {own[0], min(own, key=y.__getitem__), max(own, key=y.__getitem__), own[-1]}
    return sorted(found)


def thinned(
    x: Sequence[float], columns: Sequence[Sequence[float]], starts: Sequence[int], most: float
) -> dict[str, Any] | None:
    """What stands in the page for a run in at most about so many characters: `axis` and `packed` columns over those of its
    `rows` that any column keeps, within the finest of SHARES that will do (`thinned`). Where none does, `parts`: columns
    that are still too long keep the extremes of so many parts of the axis (`extremes` in them), which are no more their
    course. `starts`: first rows of courses after the first. None where the axis is no number."""
    fixed = [row for first in starts for row in (first - 1, first)]
    if not all(map(isfinite, x)) or not max(x) > min(x):
        return None
    spans = [span_of(c) for c in columns]
    kept: list[Sequence[int]] = [range(len(x))] * len(columns)
    coarse: set[int] = set()
    spent = 0.0
    for share, parts in [*((share, 0) for share in SHARES), *((SHARES[-1], parts) for parts in PARTS)]:
        if parts:
            coarse |= {k for k, own in enumerate(kept) if len(own) > 4 * parts}
            kept = [
                extreme_rows(x, c, parts, own, fixed) if k in coarse else own
                for k, (c, own) in enumerate(zip(columns, kept, strict=True))
            ]
        else:
            kept = [
                kept_rows(x, c, (share - spent) * LINES * span, own, fixed)
                for c, span, own in zip(columns, spans, kept, strict=True)
            ]
            spent = share
        rows = sorted(set().union(*kept))
        place = {row: k for k, row in enumerate(rows)}
        axis = _whole([x[r] for r in rows], (max(x) - min(x)) / TICKS, steps=True)
        packed = [
            _column(c, [place[r] for r in own], own, share * span / 2)
            for c, span, own in zip(columns, spans, kept, strict=True)
        ]
        if sum(map(size, (axis, *packed))) <= most:
            break
    for k in coarse:
        packed[k]["extremes"] = True
    return {
        "axis": axis, "packed": packed, "rows": len(rows), "thinned": share, "parts": parts,
        "blocks": [place[first] for first in starts],
    }  # fmt: skip


def size(packed: str | dict[str, Any]) -> int:
    """Characters of it in the page."""
    return (
        len(packed) if isinstance(packed, str) else sum(len(v) for v in packed.values() if isinstance(v, str))
    )


def _column(
    values: Sequence[float], places: Sequence[int], rows: Sequence[int], step: float
) -> dict[str, Any]:
    from .html import pack, single

    own = [values[r] for r in rows]
    at = pack(array("i", (b - a for a, b in zip((0, *places), places, strict=False))))
    if step > 0 and all(map(isfinite, own)) and max(own) - min(own) < 2**31 * step:
        return {"at": at, "count": len(own), **_whole(own, step)}
    return {"at": at, "count": len(own), "packed": pack(single(own))}


def _whole(values: Sequence[float], step: float, steps: bool = False) -> dict[str, Any]:
    """Numbers as whole multiples of `step` above the least; with `steps` each as its distance from the one before."""
    from .html import pack

    low = min(values)
    counts = [round((v - low) / step) if step else 0 for v in values]
    if steps:
        counts = [b - a for a, b in zip((0, *counts), counts, strict=False)]
    return {"low": low, "step": step, "sums": steps, "packed": pack(array("i", counts)), "count": len(values)}
