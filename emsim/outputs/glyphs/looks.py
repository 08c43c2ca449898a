"""look= of BODY: a ball, a wheel with spokes, a gear, a wagon on its wheels."""

from __future__ import annotations

import math

from .gear import wheel
from .marks import THIN, moved, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def ball(m: Scene, pen: Pen, s: Shape) -> None:
    at, r = m.place(s["at"]), max(4.0, s["sizes"][0] * m.scale)
    turn = m.poses[int(s["at"][0])].angle
    pen.circle(at, r, "body", "edge", THIN)
    # a seam that tells how it turns
    pen.line(
        [polar(at, r, -turn), polar(at, 0.25 * r, 1.2 - turn), polar(at, r, math.pi - turn)], "edge", 0.7
    )
    pen.arc(at, 0.7 * r, 3.5, 4.4, "panel", 2.5)
    pen.label([at[0] + 0.7 * r, at[1] - 0.7 * r], 4, -4, s["name"], "soft")


def spoked(m: Scene, pen: Pen, s: Shape) -> None:
    at, r = m.place(s["at"]), max(5.0, s["sizes"][0] * m.scale)
    tyre(pen, at, r, -m.poses[int(s["at"][0])].angle)
    pen.label([at[0] + 0.7 * r, at[1] - 0.7 * r], 4, -4, s["name"], "soft")


def tyre(pen: Pen, at: Point, r: float, turn: float) -> None:
    pen.circle(at, r, "panel", "edge", THIN)
    pen.circle(at, 0.92 * r, None, "edge", 0.14 * r / pen.unit)
    for k in range(8):
        pen.line([at, polar(at, 0.86 * r, turn + k * math.pi / 4)], "edge", 0.8)
    pen.circle(at, 0.14 * r, "body", "edge", THIN)


def toothed_body(m: Scene, pen: Pen, s: Shape) -> None:
    at, r = m.place(s["at"]), s["sizes"][0] * m.scale
    wheel(pen, at, r, int(s["sizes"][1]), m.poses[int(s["at"][0])].angle)
    pen.label([at[0] - r, at[1] - 0.8 * r], 0, 0, s["name"], "soft")


def wagon(m: Scene, pen: Pen, s: Shape) -> None:
    """Its wheels roll as far as it goes."""
    w, h = s["sizes"][0] / 2, s["sizes"][1] / 2
    r = 0.7 * h
    pen.polygon(
        [m.place(moved(s["at"], i * w, j * h)) for i, j in [[-1, -1], [1, -1], [1, 1], [-1, 1]]],
        "body",
        "edge",
        THIN,
    )
    for side in [-0.6, 0.6]:
        at = m.place(moved(s["at"], side * w, -h))
        tyre(pen, at, r * m.scale, at[0] / (r * m.scale))
    pen.label(m.place(moved(s["at"], -w, h)), 0, -5, s["name"], "soft")
