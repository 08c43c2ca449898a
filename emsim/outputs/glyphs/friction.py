"""FRICTION: the two shoes of a brake."""

from __future__ import annotations

from .marks import framed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def friction(m: Scene, pen: Pen, s: Shape) -> None:
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
