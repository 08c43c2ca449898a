"""TRANSDUCER: on a slide with a gap its core, coil and armature, or its plates; else turns or plates above its joint. Thick with
the voltage; the arrow of its force."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import THIN, effort, framed, moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .contract import Pen, Place, Point, Scene, Shape


def transducer(m: Scene, pen: Pen, s: Shape) -> None:
    at, u = m.place(s["b"]), pen.unit
    x, y, width = at[0], at[1], 2 + 3 * abs(m.share(s["volts"]))
    if s.get("closed") is not None:
        across_gap(m, pen, s, at, width)
    elif s["form"] == "c":
        for side in [-4 * u, 4 * u]:
            pen.line([[x + side, y - 22 * u], [x + side, y - 8 * u]], "coil", width)
    else:
        for k in [-8, 0, 8]:
            pen.arc([x + k * u, y - 14 * u], 4 * u, math.pi, 2 * math.pi, "coil", width)
    effort(m, pen, s, [x, y - 14 * u], 20, "coil")
    pen.label(at, 12, -20, f"{s['name']} {written(m.value(s['volts']), s.get('of', 'V'), 3)}", "coil")


def across_gap(m: Scene, pen: Pen, s: Shape, at: Point, width: float) -> None:
    """What moves at the joint's place on B, or at the front of B's own shape; what holds still where the gap is closed. The way
    between them is to scale."""
    closed, u = m.place(shut(s)), pen.unit
    # towards the core
    angle = m.axis_angle(s) + (0.0 if s["closed"] > m.value(s["q"]) else math.pi)
    size = ahead(s, m.shapes)
    front, bare = size[0] * m.scale, not size[0] > 0
    f = max(1.0, min(size[1] * m.scale / (18 * u), 3.0)) * u
    face = framed(closed, angle, front, 0)
    if s["form"] == "c":
        for one in [framed(at, angle, front, 0), face]:
            pen.line([framed(one, angle, 0, -18 * f), framed(one, angle, 0, 18 * f)], "coil", width)
        return
    if bare:
        armature = [[-7, -18], [0, -18], [0, 18], [-7, 18]]
        pen.polygon([framed(at, angle, x * f, y * f) for x, y in armature], "soft", "edge", THIN)
    core = [[0, -18], [18, -18], [18, 18], [0, 18], [0, 10], [10, 10], [10, -10], [0, -10]]
    pen.polygon([framed(face, angle, x * f, y * f) for x, y in core], "soft", "edge", THIN)
    for y in [-6, 0, 6]:
        turn = [[8, y - 2], [20, y + 2]]
        pen.line([framed(face, angle, x * f, z * f) for x, z in turn], "coil", width)


def shut(s: Shape) -> Place:
    """Where the joint's place on B is when the gap is closed, on A."""
    reach = s["closed"] + s["zero"]
    return moved(s["a"], *[reach * e for e in s["axis"]])


def ahead(s: Shape, shapes: Sequence[Shape]) -> list[float]:
    """How far the shape of B reaches along the joint's axis and across it [m]; nothing of a body without a shape."""
    found = [0.0, 0.0]
    c, d = abs(s["axis"][0]), abs(s["axis"][1])
    for other in shapes:
        if other["kind"] in ["box", "disc", "ball"] and other["at"][0] == s["b"][0]:
            w = other["sizes"][0] * (0.5 if other["kind"] == "box" else 1.0)
            h = other["sizes"][1] / 2 if other["kind"] == "box" else w
            found = [c * w + d * h, d * w + c * h]
    return found
