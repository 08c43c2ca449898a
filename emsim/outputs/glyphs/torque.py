"""TORQUE: an arrow about the pin."""

from __future__ import annotations

from .marks import effort, of_effort

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def torque(m: Scene, pen: Pen, s: Shape) -> None:
    if m.arrows:
        at = m.place(s["a"])
        effort(m, pen, s, at, 22, "force")
        pen.label(at, 26, 22, f"{s['name']} {of_effort(m, s)}", "force")
