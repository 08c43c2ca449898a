"""CONTACT: the surfaces that may touch, red while they press, of the colour of brakes while they rub."""

from __future__ import annotations

import math

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def contact(m: Scene, pen: Pen, s: Shape) -> None:
    p, q = m.place(s["p"]), m.place(s["q_"])
    share, far = abs(m.share(s["effort"])), 70 * pen.unit / m.scale
    slides = abs(m.value(s["mode"])) > 1.5  # with friction
    colour, width = "wiper" if slides else "force" if share > 0.01 else "edge", 1.5 + 2.5 * share
    if s["along"] and s["q_"][0] == 0 and m.planar:
        floor(m, pen, q, s["along"])
    if s["along"]:
        ends = [m.place(moved(s["q_"], *[k * far * v for v in s["along"]])) for k in [-1, 1]]
        dx, dy = ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]
        # a line without ends is drawn where P is
        gone = ((p[0] - q[0]) * dx + (p[1] - q[1]) * dy) / (dx * dx + dy * dy)
        pen.line([[x + gone * dx, y + gone * dy] for x, y in ends], colour, width)
    for at, r in [[p, s["r"]], [q, s["rq"]]]:
        # a thin disc in space is a solid
        if r and (m.planar or not s["axis"]):
            pen.circle(at, abs(r) * m.scale, None, colour, width)
    pen.label(q, 8, 14, s["name"], "soft")


def floor(m: Scene, pen: Pen, q: Point, along: list[float]) -> None:
    """The frame's line from edge to edge, hatched on the side where nothing goes."""
    u, reach = pen.unit, (m.width + m.height) / 2
    dx, dy = along[0], -along[1]
    middle_of = (m.width / 2 - q[0]) * dx + (m.height / 2 - q[1]) * dy
    first = math.floor((middle_of - reach) / (14 * u))
    for k in range(int(2 * reach / (14 * u)) + 1):
        x = (first + k) * 14 * u
        at = [q[0] + x * dx, q[1] + x * dy]
        pen.line([at, [at[0] - (5 * dx + 7 * dy) * u, at[1] + (7 * dx - 5 * dy) * u]], "ground", 0.8)
    low, high = middle_of - reach, middle_of + reach
    pen.line([[q[0] + low * dx, q[1] + low * dy], [q[0] + high * dx, q[1] + high * dy]], "ground", 1.5)
