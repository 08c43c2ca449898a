"""GEAR: wheels that mesh, with teeth; a dashed line where its joints do not stand apart."""

from __future__ import annotations

import math

from ..numbers import rounded
from .marks import middle, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def gear(m: Scene, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    if "radii" in s:
        r, q = s["radii"][0] * m.scale, s["radii"][1] * m.scale
        wheel(pen, a, r)
        wheel(pen, b, q)
        if not s["meshed"]:
            # those that turn the same way have one between them
            far, angle = math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(b[1] - a[1], b[0] - a[0])
            wheel(pen, polar(a, (far + r - q) / 2, angle), (far - r - q) / 2)
    else:
        pen.line([a, b], "soft", 1.5, 5)
    pen.label(middle(a, b), -6, 16, f"{s['name']} {rounded(s['ratio'], 4)}", "soft")


def wheel(pen: Pen, at: Point, r: float) -> None:
    u = pen.unit
    pen.circle(at, r, None, "soft", 1.5)
    count = max(8, math.floor(2 * math.pi * r / (9 * u) + 0.5))
    for k in range(count):
        turn = 2 * math.pi * k / count
        pen.line([polar(at, r - 2 * u, turn), polar(at, r + 2 * u, turn)], "soft", 2.5)
