"""LATCH: a hook and an eye, closed while it holds; a bar between them where it holds their distance."""

from __future__ import annotations

from .marks import middle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def latch(m: Scene, pen: Pen, s: Shape) -> None:
    p, q, u, holds = m.place(s["p"]), m.place(s["q_"]), pen.unit, m.value(s["mode"]) > 0.5
    colour = "force" if holds else "soft"
    if s["bar"]:
        if holds:
            pen.line([p, q], colour, 2)
        pen.circle(p, 3 * u, "panel", colour, 2)
        pen.circle(q, 3 * u, "panel", colour, 2)
    else:
        pen.arc(p, 8 * u, -2.6 if holds else -1.2, 2.6 if holds else 1.2, colour, 3)
        pen.circle(q, 4 * u, "panel", colour, 2)
    pen.label(middle(p, q), 8, 16, s["name"], colour)
