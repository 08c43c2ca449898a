"""A prescribed motion: an open ring about its joint."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def drive(m: Scene, pen: Pen, s: Shape) -> None:
    at = m.place(s["a"])
    pen.arc(at, 13 * pen.unit, 0.4, 5.6, "accent", 2)
    pen.label(at, 18, 20, f"{s['name']} (prescribed)", "accent")
