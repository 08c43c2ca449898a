"""CONTACT: the surfaces that may touch, red while they press, of the colour of brakes while they rub."""

from __future__ import annotations

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def contact(m: Scene, pen: Pen, s: Shape) -> None:
    p, q = m.place(s["p"]), m.place(s["q_"])
    share, far = abs(m.share(s["effort"])), 70 * pen.unit / m.scale
    slides = abs(m.value(s["mode"])) > 1.5  # with friction
    colour, width = "wiper" if slides else "force" if share > 0.01 else "edge", 1.5 + 2.5 * share
    if s["along"]:
        ends = [m.place(moved(s["q_"], *[k * far * v for v in s["along"]])) for k in [-1, 1]]
        dx, dy = ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]
        # a line without ends is drawn where P is
        gone = ((p[0] - q[0]) * dx + (p[1] - q[1]) * dy) / (dx * dx + dy * dy) if m.planar else 0
        pen.line([[x + gone * dx, y + gone * dy] for x, y in ends], colour, width)
    for at, r in [[p, s["r"]], [q, s["rq"]]]:
        # a thin disc in space is a solid
        if r and (m.planar or not s["axis"]):
            pen.circle(at, abs(r) * m.scale, None, colour, width)
    pen.label(q, 8, 14, s["name"], "soft")
