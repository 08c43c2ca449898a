"""BODY shape=rod: a bar with round ends."""

from __future__ import annotations

from .marks import bar, middle, moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def rod(m: Scene, pen: Pen, s: Shape) -> None:
    sizes = s["sizes"]
    a, b = m.place(s["at"]), m.place(moved(s["at"], sizes[0]))
    wide = sizes[1] if len(sizes) > 1 else 0.0
    bar(pen, [a, b], max(7.0, wide * m.scale / pen.unit))
    pen.label(middle(a, b), 9, -7, s["name"], "soft")
