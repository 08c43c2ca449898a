"""BODY without a shape: bars to all that is fastened to it; a wheel where it is an inertia alone, a block where it is a mass."""

from __future__ import annotations

from .marks import THIN, moved, rectangle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def bones(m: Scene, pen: Pen, s: Shape) -> None:
    at, u = m.place(s["at"]), pen.unit
    if s["hidden"]:
        pen.label(at, -14, -15, s["name"], "soft")
        return
    if s["spin"] or s.get("round"):
        r = max(s["spin"], s.get("round", 0.0)) * m.scale
        pen.circle(at, r, "body", "edge", THIN)
        pen.line([at, m.place(moved(s["at"], max(s["spin"], s.get("round", 0.0))))], "edge", THIN)
        pen.label([at[0] - r, at[1] - r], 0, -5, s["name"], "soft")
        return
    others = [p for p in s["to"] if p[1] != s["at"][1] or p[2] != s["at"][2] or p[3] != s["at"][3]]
    if len(others) == 0 and s.get("round") == 0:
        # it touches by its middle alone
        pen.circle(at, 8 * u, "body", "edge", THIN)
        pen.label(at, 12, -12, s["name"], "soft")
        return
    if len(others) == 0:
        pen.polygon(rectangle(at, 0, 16 * u, 11 * u), "body", "edge", THIN)
        pen.label(at, -14, -15, s["name"], "soft")
        return
    for p in others:
        pen.line([at, m.place(p)], "edge", 8.4)
    for p in others:
        pen.line([at, m.place(p)], "body", 6.0)
    pen.circle(at, 6 * u, "body", "edge", THIN)
    pen.label(at, 8, -8, s["name"], "soft")
