"""BELT: two wheels and its two sides, thick with their tension, dashed where slack."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import middle, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def belt(m: Scene, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    ra, rb = s["radii"][0] * m.scale, s["radii"][1] * m.scale
    far, way = math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(b[1] - a[1], b[0] - a[0])
    pen.circle(a, ra, None, "edge", 1.5)
    pen.circle(b, rb, None, "edge", 1.5)
    reach = (ra + rb if s["cross"] else ra - rb) / far if far else 0.0
    wide = math.acos(max(-1.0, min(1.0, reach)))
    for turn, tension in [[-wide, s["tensions"][0]], [wide, s["tensions"][1]]]:
        share = abs(m.share(tension))
        ends = [polar(a, ra, way + turn), polar(b, -rb if s["cross"] else rb, way + turn)]
        pen.line(ends, "force" if share > 0.01 else "soft", 1.2 + 3 * share, 0 if share > 0 else 5)
    pen.label(middle(a, b), 6, 4, f"{s['name']} {written(m.value(s['effort']), 'N', 3)}", "soft")
