"""SPRING and DAMPER: between two points, along a slide, about a pin. Thicker with their force."""

from __future__ import annotations

import math

from .marks import anchor, coil, framed, middle, piston

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def elastic(m: Scene, pen: Pen, s: Shape) -> None:
    u, springy = pen.unit, s["kind"] == "spring"
    colour, width = (
        "coil" if springy else "ground",
        1.4 + (1.6 * abs(m.share(s["effort"])) if m.arrows else 0.0),
    )
    if "p" in s:
        p, q = m.place(s["p"]), m.place(s["q_"])
        between(pen, p, q, springy, colour, width)
        anchor(m, pen, s["p"])
        anchor(m, pen, s["q_"])
        pen.label(middle(p, q), 10, 0, s["name"], colour)
        return
    a, b = m.place(s["a"]), m.place(s["b"])
    if s["joint"] == "slide":
        # from a wall on the far side of the joint's range, so that it has a length to change
        angle, back, off = m.axis_angle(s), 0.3 * min(m.width, m.height), -11 * u if springy else 11 * u
        wall = framed(a, angle, back if s["ahead"] else -back, off)
        between(pen, wall, framed(b, angle, 0, off), springy, colour, width)
        pen.line([framed(wall, angle, 0, -9 * u), framed(wall, angle, 0, 9 * u)], colour, width)
        pen.label(wall, 6, -10 if springy else 22, s["name"], colour)
    elif s["joint"] == "pin" and math.hypot(a[0] - b[0], a[1] - b[1]) > 20 * u:
        between(pen, a, b, springy, colour, width)
        pen.label([middle(a, b)[0], a[1]], -10, -14, s["name"], colour)
    else:
        around(m, pen, s, b, springy, colour, width)


def between(pen: Pen, start: Point, end: Point, springy: bool, colour: str, width: float) -> None:
    if springy:
        coil(pen, start, end, colour, width)
    else:
        piston(pen, start, end, colour, width)


def around(m: Scene, pen: Pen, s: Shape, at: Point, springy: bool, colour: str, width: float) -> None:
    """A spiral that winds up about a pin, outside of a motor that covers it; half a ring for a damper."""
    u, first = pen.unit, 21 if s["below"] else 6
    if springy:
        end = 4 * math.pi + m.value(s["q"])
        turns = [[k / 80 * end, (first + 10 * k / 80) * u] for k in range(81)]
        pen.line([[at[0] + r * math.cos(t), at[1] - r * math.sin(t)] for t, r in turns], colour, width)
    else:
        pen.arc(at, (first + 5) * u, 0.3, 2.8, colour, width)
    pen.label(at, first + 8, first + 8, s["name"], colour)
