"""FRICTION: the two shoes of a brake."""

from __future__ import annotations

import math

from .marks import THIN, framed, middle, rectangle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def friction(m: Scene, pen: Pen, s: Shape) -> None:
    if s.get("plates") and m.planar:
        a, b = m.place(s["a"]), m.place(s["b"])
        if math.hypot(a[0] - b[0], a[1] - b[1]) > 40 * pen.unit:
            plates(m, pen, s)
            return
    turns, u, angle = s["joint"] == "pin", pen.unit, m.axis_angle(s)
    at, width = (
        m.place(s["a"] if turns else s["b"]),
        1.6 + (3 * abs(m.share(s["effort"])) if m.arrows else 0.0),
    )
    for side in [-1, 1]:
        if turns:
            pen.arc(at, 11 * u, side * 1.57 - 0.6, side * 1.57 + 0.6, "wiper", width)
        else:
            pen.line([framed(at, angle, k * u, side * 8 * u) for k in [-12, 12]], "wiper", width)
    pen.label(at, 12, -12, s["name"], "wiper")


def plates(m: Scene, pen: Pen, s: Shape) -> None:
    """A clutch between shafts that are drawn beside one another: a disc on each, pressed together while it carries something."""
    a, b, u, share = m.place(s["a"]), m.place(s["b"]), pen.unit, abs(m.share(s["effort"]))
    way = math.atan2(b[1] - a[1], b[0] - a[0])
    at, gap = middle(a, b), (2 if share > 0.001 else 5) * u
    for side in [-1, 1]:
        end = a if side < 0 else b
        pen.line([end, framed(at, way, side * gap, 0)], "edge", 4)
        disc = rectangle(framed(at, way, side * (gap + 3 * u), 0), way, 3 * u, 22 * u)
        pen.polygon(disc, "wiper" if share > 0.001 else "body", "edge", THIN)
        pen.circle(end, 4.5 * u, "panel", "edge", THIN)
    pen.label(at, -10, -30, s["name"], "wiper")
