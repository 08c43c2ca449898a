"""What solids are made of: meshes [points [m], faces, edges], and the normals that they are lit by.

Faces are flat or nearly, seen counter-clockwise from outside. An edge is [i, j, f, g]: between points i and j and faces f and g,
drawn where one of the two is turned away.
"""

from __future__ import annotations

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    Vector = list[float]

ROUND = 40  # sides of what is round
COILS = 9  # turns of a spring
WIRE = 14  # points of a turn


def cylinder(a: Vector, b: Vector, r: float) -> list[Any]:
    """From the middle of one end to that of the other."""
    half = [(b[m] - a[m]) / 2 for m in range(3)]
    u = across(half)
    return prism(
        ring(plus(a, half), u, unit(cross(half, u)), r, ROUND), half, min(0.12 * r, 0.3 * math.hypot(*half))
    )


def block(u: Vector, v: Vector, w: Vector) -> list[Any]:
    """From half its sides."""
    bevel = 0.1 * min(math.hypot(*u), math.hypot(*v), math.hypot(*w))
    e, f = bevel / math.hypot(*u), bevel / math.hypot(*v)
    signs = [
        [1, 1 - f],
        [1 - e, 1],
        [e - 1, 1],
        [-1, 1 - f],
        [-1, f - 1],
        [e - 1, -1],
        [1 - e, -1],
        [1, f - 1],
    ]
    right = cross(u, v)
    turned = right[0] * w[0] + right[1] * w[1] + right[2] * w[2] < 0
    return prism([plus(times(u, i), times(v, j)) for i, j in signs], times(w, -1) if turned else w, bevel)


def prism(outline: list[Vector], half: Vector, bevel: float) -> list[Any]:
    """An outline that its middle sees the whole of, counter-clockwise about `half`, moved by that vector to both sides."""
    n = len(outline)
    middle = [0.0, 0.0, 0.0]
    for p in outline:
        middle = plus(middle, times(p, 1 / n))
    share = max(0.0, 1 - bevel / math.hypot(*half))
    small = []
    for p in outline:
        far = math.hypot(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2])
        small.append([p[m] + (middle[m] - p[m]) * min(bevel / far, 0.5) for m in range(3)])
    mesh = sheet(
        [
            [plus(p, times(half, -1)) for p in small],
            [plus(p, times(half, -share)) for p in outline],
            [plus(p, times(half, share)) for p in outline],
            [plus(p, half) for p in small],
        ]
    )
    for first, way, side in [[0, -1, 0], [3 * n, 1, 2 * n]]:
        centre, cap = len(mesh[0]), len(mesh[1])
        mesh[0].append(plus(middle, times(half, way)))
        for k in range(n):
            i, j = first + k, first + (k + 1) % n
            mesh[1].append([centre, i, j] if way > 0 else [centre, j, i])
            mesh[2].append([i, j, side + k, cap + k])
    return mesh


def tube(outer: list[Vector], inner: list[Vector], half: Vector) -> list[Any]:
    """What lies between two outlines of as many points."""
    back = times(half, -1)
    rings = []
    for loop, way in [(outer, back), (outer, half), (inner, half), (inner, back), (outer, back)]:
        rings.append([plus(p, way) for p in loop])
    return sheet(rings)


def hoop(axis: Vector, r: float, wire: float) -> list[Any]:
    """A ring about an axis."""
    u = across(axis)
    v = cross(axis, u)
    rings = []
    for k in range(ROUND + 1):
        c, d = math.cos(2 * math.pi * k / ROUND), math.sin(2 * math.pi * k / ROUND)
        out = [c * u[m] + d * v[m] for m in range(3)]
        rings.append(ring(times(out, r), out, axis, wire, 8))
    return sheet(rings)


def globe(r: float) -> list[Any]:
    rings = []
    for k in range(13):
        turn = math.pi * (k + 0.02) / 12.04 - math.pi / 2
        rings.append(ring([0, 0, r * math.sin(turn)], [1, 0, 0], [0, 1, 0], r * math.cos(turn), 24))
    return sheet(rings)


def coiled(r: float, wire: float) -> list[Any]:
    """A spring along x from 0 to 1; its radius in metres."""
    rings = []
    n = COILS * WIRE
    for k in range(n + 1):
        turn = 2 * math.pi * k / WIRE
        u, v = [0, math.cos(turn), math.sin(turn)], [0.12 / COILS, 0, 0]
        rings.append(ring([0.06 + 0.88 * k / n, r * u[1], r * u[2]], times(u, wire), v, 1.0, 8))
    return sheet(rings)


def thread(axis: Vector, r: float, lead: float, length: float) -> list[Any]:
    """The ridge that winds about a screw from its middle to both sides; to the right for a positive lead."""
    u = across(axis)
    v = cross(axis, u)
    turns = max(1, min(60, math.floor(length / abs(lead))))
    deep, wide = min(0.25 * r, 0.35 * abs(lead)), 0.22 * abs(lead)
    rings = []
    for k in range(24 * turns + 1):
        turn = 2 * math.pi * (k / 24 - turns / 2)
        out = [math.cos(turn) * u[m] + math.sin(turn) * v[m] for m in range(3)]
        at = plus(times(axis, lead * turn / (2 * math.pi)), times(out, r))
        profile = [[-deep, -1.4], [-deep, 1.4], [deep, 0.5], [deep, -0.5]]
        if lead < 0:
            profile = [profile[3], profile[2], profile[1], profile[0]]
        rings.append([plus(at, plus(times(out, e), times(axis, f * wide))) for e, f in profile])
    return sheet(rings)


def ring(at: Vector, u: Vector, v: Vector, r: float, n: int) -> list[Vector]:
    found = []
    for k in range(n):
        c, d = r * math.cos(2 * math.pi * k / n), r * math.sin(2 * math.pi * k / n)
        found.append([at[m] + c * u[m] + d * v[m] for m in range(3)])
    return found


def sheet(rings: list[list[Vector]]) -> list[Any]:
    """The surface from ring to ring, closed about."""
    n, count = len(rings[0]), len(rings) - 1
    points, faces, edges = [], [], []
    for one in rings:
        for p in one:
            points.append(p)
    for i in range(count):
        for k in range(n):
            after = (k + 1) % n
            faces.append([i * n + k, i * n + after, (i + 1) * n + after, (i + 1) * n + k])
            # along, between this face and the one before; about, between this one and the next ring's
            edges.append([i * n + k, (i + 1) * n + k, i * n + k, i * n + (k + n - 1) % n])
            if i + 1 < count:
                edges.append([(i + 1) * n + k, (i + 1) * n + after, i * n + k, (i + 1) * n + k])
    return [points, faces, edges]


def normals(points: list[Vector], faces: list[list[int]]) -> list[list[Vector]]:
    """Unit vectors outwards, of every corner of every face: the mean, by area, over the faces that are one surface there."""
    about: list[list[int]] = [[] for _ in points]
    own, whole = [], 0.0
    for f in range(len(faces)):
        face = faces[f]
        a, b, c, d = (
            points[face[0]],
            points[face[1]],
            points[face[2]],
            points[face[3 if len(face) > 3 else 0]],
        )
        n = cross([c[m] - a[m] for m in range(3)], [d[m] - b[m] for m in range(3)])
        own.append(n)
        whole += n[0] * a[0] + n[1] * a[1] + n[2] * a[2]
        for k in face:
            about[k].append(f)
    way = -1 if whole < 0 else 1
    found = []
    for f in range(len(faces)):
        n = own[f]
        corners = []
        for k in faces[f]:
            total = [0.0, 0.0, 0.0]
            for g in about[k]:
                # up to 49 degrees faces are one surface: the 45 of eight sides are
                o = own[g]
                if n[0] * o[0] + n[1] * o[1] + n[2] * o[2] > 0.65 * math.hypot(*n) * math.hypot(*o):
                    total = plus(total, o)
            size = math.hypot(*total)
            corners.append(times(total, way / size) if size > 0 else [0.0, 0.0, 0.0])
        found.append(corners)
    return found


# ---- vectors ----


def times(a: Vector, f: float) -> Vector:
    return [f * a[0], f * a[1], f * a[2]]


def plus(a: Vector, b: Vector) -> Vector:
    return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a: Vector) -> Vector:
    return times(a, 1.0 / math.hypot(*a))


def across(a: Vector) -> Vector:
    """A unit vector at right angles."""
    flat = abs(a[2]) > 0.9 * math.hypot(*a)
    return unit(cross(a, [1.0, 0.0, 0.0] if flat else [0.0, 0.0, 1.0]))
