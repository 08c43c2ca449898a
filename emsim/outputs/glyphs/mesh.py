"""look=stl(file) of BODY: a surface of triangles. In a planar scene its outline, as seen along z."""

from __future__ import annotations

import math

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Pen, Scene, Shape


def mesh(m: Scene, pen: Pen, s: Shape) -> None:
    loops = []
    for loop in s["loops"]:
        loops.append([m.place(moved(s["at"], s["points"][k][0], s["points"][k][1], 0.0)) for k in loop])
    pen.area(loops, "body", "edge", 1.0)
    pen.label(m.place(s["at"]), 8, -8, s["name"], "soft")


def sewn(points: list[list[float]], faces: list[list[int]]) -> Any:
    """Of a surface of triangles: "edges" as meshes.py has them, between every two faces, and "loops", the numbers of the points
    about what is seen of it along z.

    Loops are the border of all faces that look towards the eye: how often they wind about a place is how many of these lie
    there, so what they wind about is the picture of a closed surface.
    """
    about: list[list[list[int]]] = [[] for _ in points]
    border: list[list[int]] = [[] for _ in points]
    edges = []
    for f in range(len(faces)):
        face = faces[f]
        a, b, c = points[face[0]], points[face[1]], points[face[2]]
        u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
        up = u[0] * v[1] - u[1] * v[0]
        # rounding aside, a face at right angles is not seen
        seen = up > 1e-6 * math.hypot(up, u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2])
        for k in range(3):
            i, j = face[k], face[(k + 1) % 3]
            for one in about[j]:
                if one[0] == i:
                    edges.append([i, j, one[1], f])
            about[i].append([j, f])
            if seen:
                # what two faces have in common is no border
                back = [n for n in range(len(border[j])) if border[j][n] == i]
                if len(back):
                    border[j] = [border[j][n] for n in range(len(border[j])) if n != back[0]]
                else:
                    border[i].append(j)
    return {"edges": edges, "loops": chained(border)}


def chained(border: list[list[int]]) -> list[list[int]]:
    """Loops of steps from point to point; from every point as many steps go out as come in."""
    at = [0 for _ in border]
    loops = []
    for start in range(len(border)):
        while at[start] < len(border[start]):
            loop, here = [start], start
            while True:
                following = border[here][at[here]]
                at[here] = at[here] + 1
                if following == start:
                    break
                loop.append(following)
                here = following
            loops.append(loop)
    return loops
