"""BEAM: its bent line, through all nodes and along their tangents."""

from __future__ import annotations

import math

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def beam(m: Scene, pen: Pen, s: Shape) -> None:
    nodes, third = s["nodes"], s["third"]
    line: list[Point] = [m.place(nodes[0])]
    for k in range(len(nodes) - 1):
        p, q = m.place(nodes[k]), m.place(nodes[k + 1])
        c, d = m.place(moved(nodes[k], third)), m.place(moved(nodes[k + 1], -third))
        for j in range(1, 7):
            t = j / 6
            u = 1 - t
            weights = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t]
            x = weights[0] * p[0] + weights[1] * c[0] + weights[2] * d[0] + weights[3] * q[0]
            y = weights[0] * p[1] + weights[1] * c[1] + weights[2] * d[1] + weights[3] * q[1]
            line.append([x, y])
    pen.line(line, "edge", 5)
    pen.line(line, "body", 2.6)
    pen.label(line[math.floor(len(line) / 2)], 6, 14, s["name"], "soft")
