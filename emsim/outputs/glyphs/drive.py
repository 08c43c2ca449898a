"""A prescribed motion: an open ring about its joint, arrows to either side on a slide."""

from __future__ import annotations

from .marks import arrow, framed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def drive(m: Scene, pen: Pen, s: Shape) -> None:
    at, u = m.place(s["a"]), pen.unit
    if s["joint"] == "slide":
        at, angle = m.place(s["b"]), m.axis_angle(s)
        for side in [-1, 1]:
            arrow(
                pen, framed(at, angle, side * 12 * u, 0), framed(at, angle, side * 30 * u, 0), "accent", 2, 7
            )
    else:
        pen.arc(at, 13 * u, 0.4, 5.6, "accent", 2)
    pen.label(at, 18, 20, f"{s['name']} (prescribed)", "accent")
