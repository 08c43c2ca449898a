"""JOINT: a pin's ring with the frame's mark, a slide on its rail, a rod, a square where two bodies are one."""

from __future__ import annotations

import math

from .marks import THIN, ground, polar, rectangle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def joint(m: Scene, pen: Pen, s: Shape) -> None:
    kind, u = s["joint"], pen.unit
    if kind == "none":
        return
    a, b = m.place(s["a"]), m.place(s["b"])
    if kind == "slide":
        slide(m, pen, s, a, b)
        return
    if kind == "rod":
        pen.line([a, b], "edge", 3)
    if kind == "pin":
        tall = 27 if s["below"] else 15
        if s["a"][0] == 0:
            ground(pen, a, tall)
        if s["b"][0] == 0:
            ground(pen, b, tall)
    if kind == "weld":
        pen.polygon(rectangle(b, 0, 4 * u, 4 * u), "panel", "edge", THIN)
    else:
        pen.circle(b, 4.5 * u, "panel", "edge", THIN)


def slide(m: Scene, pen: Pen, s: Shape, a: Point, b: Point) -> None:
    """A rail of the frame goes from edge to edge, one on a body to its slider and beyond."""
    angle, u, fixed = m.axis_angle(s), pen.unit, s["a"][0] == 0
    along = (b[0] - a[0]) * math.cos(angle) + (b[1] - a[1]) * math.sin(angle)
    low, high = min(-40 * u, along - 24 * u), max(40 * u, along + 24 * u)
    if fixed:
        high = 2.0 * (m.width + m.height)
        low = -high
    pen.line([polar(a, low, angle), polar(a, high, angle)], "ground", 1.5, 0 if fixed else 4)
    pen.polygon(rectangle(b, angle, 7 * u, 4 * u), "panel", "edge", THIN)
