"""POT: its track about the pin or along the slide, its wiper an arrow."""

from __future__ import annotations

from ..numbers import written
from .marks import arrow, framed, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def pot(m: Scene, pen: Pen, s: Shape) -> None:
    at, q, u = m.place(s["a"]), m.value(s["q"]) + s["zero"], pen.unit
    low, high = min(*s["range"]) + s["zero"], max(*s["range"]) + s["zero"]
    said = f"{s['name']} {written(m.value(s['wiper']), 'V', 3)}"
    if s["joint"] == "pin":
        base, r = m.poses[int(s["a"][0])].angle, (36 + 11 * s["rings"]) * u
        pen.keep_off(at, r)
        pen.arc(at, r, -(base + low), -(base + high), "wiper", 3)
        held = -(base + min(max(q, low), high))
        arrow(pen, polar(at, r - 16 * u, held), polar(at, r, held), "wiper", 3, 7)
        pen.label([at[0] + r, at[1]], 4, -22, said, "wiper")
        return
    angle = m.axis_angle(s)
    pen.line([framed(at, angle, v * m.scale, 16 * u) for v in [low, high]], "wiper", 3)
    tip = framed(at, angle, q * m.scale, 16 * u)
    arrow(pen, framed(tip, angle, 0, -10 * u), tip, "wiper", 3, 7)
    pen.label(framed(at, angle, high * m.scale, 16 * u), 6, 4, said, "wiper")
