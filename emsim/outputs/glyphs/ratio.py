"""RATIO: a dashed line through the joints whose coordinates it ties."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def ratio(m: Scene, pen: Pen, s: Shape) -> None:
    places = [m.place(joint["a"]) for joint in s["joints"]]
    pen.line(places, "soft", 1.5, 5)
    pen.label(places[0], 8, 30, s["name"], "soft")
