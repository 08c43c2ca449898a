"""Shapes of bodies in space, of cards/solids.py: {"at" its middle, "form", "sizes", "axes" its own, and of a hull "points" about
the middle and "faces"}."""

from __future__ import annotations

import math

from .meshes import ROUND, across, block, cylinder, plus, ring, sheet, times

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Shape

RINGS = 10  # between the ends of half a ball


def body_mesh(s: Shape, size: float) -> list[Any]:
    """Points [m] from its middle in the axes of the body, faces, edges; `size`: of the room, which a plane fills."""
    form, sizes, axes = s["form"], s["sizes"], s["axes"]
    u, v, w = axes[0], axes[1], axes[2]
    if form == "hull":
        return [s["points"], s["faces"], creased(s["faces"])]
    if form == "box":
        return block(times(u, sizes[0] / 2), times(v, sizes[1] / 2), times(w, sizes[2] / 2))
    if form == "cylinder":
        return cylinder(times(w, -sizes[1] / 2), times(w, sizes[1] / 2), sizes[0])
    if form == "disc":
        return cylinder(times(w, -0.02 * sizes[0]), times(w, 0.02 * sizes[0]), sizes[0])
    if form == "ellipsoid":
        return capped(times(u, sizes[0]), times(v, sizes[1]), times(w, sizes[2]), 0.0)
    if form == "capsule":
        r = sizes[1]
        return capped(times(v, r), times(w, r), times(u, r), sizes[0] / 2 / r)
    if form == "ball":
        return capped(times(u, sizes[0]), times(v, sizes[0]), times(w, sizes[0]), 0.0)
    # a plane, its normal the third axis
    found = block(times(u, size), times(v, size), times(w, 0.01 * size))
    return [[plus(p, times(w, -0.01 * size)) for p in found[0]], found[1], found[2]]


def capped(u: list[float], v: list[float], w: list[float], straight: float) -> list[Any]:
    """An ellipsoid of these half-axes, cut in its middle and drawn out by `straight` times w to either side."""
    rings = []
    for side in [-1, 1]:
        for k in range(RINGS + 1):
            turn = math.pi / 2 * (k / RINGS if side > 0 else k / RINGS - 1)
            # no ring is a point
            turn = max(-1.55, min(1.55, turn))
            c, d = math.cos(turn), math.sin(turn) + side * straight
            if side < 0 or k > 0 or straight > 0:
                rings.append(ring(times(w, d), u, v, c, ROUND))
    return sheet(rings)


def creased(faces: list[list[int]]) -> list[list[int]]:
    """Edges between every two faces that share one."""
    found = []
    for f in range(len(faces)):
        for k in range(3):
            i, j = faces[f][k], faces[f][(k + 1) % 3]
            for g in range(f):
                for n in range(3):
                    if faces[g][n] == j and faces[g][(n + 1) % 3] == i:
                        found.append([i, j, g, f])
    return found


def peg_of(s: Shape) -> list[Any]:
    """A mark that tells how what is round turns: a bar through it, a little longer than it is wide; empty where it needs none."""
    form, sizes, axes = s["form"], s["sizes"], s["axes"]
    if form in ["ball", "cylinder", "disc"]:
        far = 1.03 * sizes[0] if form == "ball" else max(0.52 * sizes[len(sizes) - 1], 0.05 * sizes[0])
        peg = times(across(axes[2]), 0.0 if form == "ball" else 0.7 * sizes[0])
        tip = times(axes[2], far)
        return cylinder(plus(peg, times(tip, -1)), plus(peg, tip), 0.1 * sizes[0])
    return []
