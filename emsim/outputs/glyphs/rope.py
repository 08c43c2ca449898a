"""ROPE: straight parts and what lies on its pulleys, thick with tension, dashed where slack; the pulleys as circles."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import middle, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def rope(m: Scene, pen: Pen, s: Shape) -> None:
    for stretch in s["stretches"]:
        share = abs(m.share(stretch["tension"]))
        colour, width = ("force", 1.2 + 2.4 * share) if share > 0.001 else ("edge", 1.2)
        at = [m.place(place) for place in stretch["places"]]
        # on the picture y points down: what goes round counter-clockwise has its centre at the other side
        radii = [(r * m.scale if m.planar else 0.0) for r in stretch["radii"]]
        kept = [k for k in range(len(at)) if m.value(stretch["lies"][k]) > 0.5]
        if m.planar:
            for k in range(len(at)):
                if radii[k] != 0:
                    pen.circle(at[k], abs(radii[k]), None, "edge", 1.5)
        arrived = 0.0
        for j in range(len(kept) - 1):
            i, k = kept[j], kept[j + 1]
            way = _way(at[i], radii[i], at[k], radii[k])
            ends = [polar(at[i], radii[i], way + math.pi / 2), polar(at[k], radii[k], way + math.pi / 2)]
            if j > 0 and radii[i] != 0:
                _round(pen, at[i], radii[i], [arrived, way], colour, width)
            pen.line(ends, colour, width, 0 if share > 0 else 5)
            arrived = way
        middle_of = middle(at[0], at[1])
        pen.label(middle_of, 8, 4, f"{s['name']} {written(m.value(stretch['tension']), 'N', 3)}", "soft")


def _way(a: Point, ra: float, b: Point, rb: float) -> float:
    """The direction of the common tangent of two circles, on the picture."""
    far = math.hypot(b[0] - a[0], b[1] - a[1])
    lean = max(-1.0, min(1.0, (rb - ra) / far)) if far > 0 else 0.0
    return math.atan2(b[1] - a[1], b[0] - a[0]) + math.asin(lean)


def _round(pen: Pen, at: Point, r: float, ways: list[float], colour: str, width: float) -> None:
    """The part on a pulley, from the direction that arrives to the one that leaves."""
    turn = ways[0] - ways[1] if r > 0 else ways[1] - ways[0]
    turn = turn - 2 * math.pi * math.floor(turn / (2 * math.pi))
    if turn > 1.75 * math.pi:
        return
    start = ways[0] + math.pi / 2 if r > 0 else ways[0] - math.pi / 2
    pen.arc(at, abs(r), start, start - turn if r > 0 else start + turn, colour, width)
