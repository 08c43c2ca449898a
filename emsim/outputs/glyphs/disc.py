"""BODY shape=disc: a wheel with a mark that tells its angle."""

from __future__ import annotations

from .marks import THIN, moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def disc(m: Scene, pen: Pen, s: Shape) -> None:
    at, r = m.place(s["at"]), max(4.0, s["sizes"][0] * m.scale)
    pen.circle(at, r, "body", "edge", THIN)
    pen.line([at, m.place(moved(s["at"], s["sizes"][0]))], "edge", THIN)
    if r > 30 * pen.unit:
        pen.label([at[0] - r, at[1] - 0.8 * r], 0, 0, s["name"], "soft")
    else:
        pen.label(at, 8, -8, s["name"], "soft")
