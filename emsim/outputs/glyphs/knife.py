"""KNIFE: its edge."""

from __future__ import annotations

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def knife(m: Scene, pen: Pen, s: Shape) -> None:
    far = 18 * pen.unit / m.scale
    pen.line([m.place(moved(s["at"], *[k * far * v for v in s["along"]])) for k in [-1, 1]], "edge", 4)
    pen.label(m.place(s["at"]), 8, 14, s["name"], "soft")
