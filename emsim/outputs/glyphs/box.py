"""BODY shape=box: its outline in the plane."""

from __future__ import annotations

from .marks import THIN, moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def box(m: Scene, pen: Pen, s: Shape) -> None:
    sizes = s["sizes"]
    w, h = sizes[0] / 2, (sizes[1] if len(sizes) > 1 else sizes[0]) / 2
    corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    pen.polygon([m.place(moved(s["at"], i * w, j * h)) for i, j in corners], "body", "edge", THIN)
    pen.label(m.place(s["at"]), 8, -8, s["name"], "soft")
