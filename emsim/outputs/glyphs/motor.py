"""MOTOR: its ring tells the current, spokes its phases, the arrow its torque or force."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import THIN, effort, polar, rectangle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def motor(m: Scene, pen: Pen, s: Shape) -> None:
    at, share, u = m.place(s["a"]), m.share(s["current"]), pen.unit
    colour, alpha = "force" if share < 0 else "motor", 0.2 + 0.8 * abs(share)
    if s["joint"] == "pin":
        pen.circle(at, 18 * u, "panel", "edge", THIN)
        pen.circle(at, 14.5 * u, None, colour, 5, alpha)
    else:
        pen.polygon(rectangle(at, 0, 18 * u, 14.4 * u), "panel", "edge", THIN)
        corners = rectangle(at, 0, 14.5 * u, 11.6 * u)
        pen.line([*corners, corners[0]], colour, 5, 0, alpha)
    if s["poles"] > 1:
        for k in range(s["poles"]):
            turn = -2 * math.pi * k / s["poles"]
            pen.line([polar(at, 8 * u, turn), polar(at, 12 * u, turn)], colour, 3, 0, alpha)
    pen.write(at[0], at[1], "M", "ink", "mm")
    pen.keep_off(at, 19 * u)
    effort(m, pen, s, at, 26, "motor")
    pen.label(at, 30, 26, f"{s['name']} {written(m.value(s['current']), 'A', 3)}", "motor")
