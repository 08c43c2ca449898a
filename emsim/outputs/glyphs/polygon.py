"""BODY shape=polygon and SHAPE: an outline through its corners, in the plane."""

from __future__ import annotations

from .marks import THIN

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def polygon(m: Scene, pen: Pen, s: Shape) -> None:
    pen.polygon([m.place(p) for p in s["to"]], "body", "edge", THIN)
    pen.label(m.place(s["at"]), 8, -8, s["name"], "soft")
