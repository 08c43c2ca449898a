"""STOP: a bar at each end of the range, red where it is hit."""

from __future__ import annotations

from .marks import framed, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def stop(m: Scene, pen: Pen, s: Shape) -> None:
    origin, u, share, angle = m.place(s["a"]), pen.unit, abs(m.share(s["effort"])), m.axis_angle(s)
    colour, at = "force" if share > 0.01 else "edge", origin
    for end in s["ends"]:
        if end is None:
            continue
        if s["joint"] == "pin":
            turn = -(m.poses[int(s["a"][0])].angle + end + s["zero"])
            ends = [polar(origin, 16 * u, turn), polar(origin, 34 * u, turn)]
        else:
            far = (end + s["zero"]) * m.scale
            ends = [framed(origin, angle, far, 14 * u), framed(origin, angle, far, -14 * u)]
        pen.line(ends, colour, 2.5 + 3 * share)
        at = ends[1]
    pen.label(at, 5, -4, s["name"], "soft")
