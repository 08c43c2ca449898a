"""CAM: a disc off its centre, red while it presses."""

from __future__ import annotations

from .marks import polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def cam(m: Scene, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["b"]), m.place(s["second"]["a"])
    share, r = abs(m.share(s["effort"])), 18 * pen.unit
    turn = m.poses[int(s["second"]["a"][0])].angle + m.value(s["second"]["q"]) + s["second"]["zero"]
    pen.circle(polar(b, 0.45 * r, -turn), r, None, "force" if share > 0.01 else "edge", 1.5 + 2.5 * share)
    pen.line([a, b], "soft", 1.5, 5)
    pen.label(b, 29, 18, s["name"], "soft")
