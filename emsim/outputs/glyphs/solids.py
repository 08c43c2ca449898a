"""Bodies and joints of a spatial scene as solids: points, faces and edges in the axes of a body.

    {"body", "at"}          on a body, points from a place of it
    {"from", "to"}          between two places: x of the points runs from 0 at the one to 1 at the other
    "points" [[x, y, z]]    [m];  "faces" [[i, j, k, ..]] flat or nearly;  "colour" by name
    "edges" [[i, j, f, g, sharp]]   between faces f and g (-1: none): drawn where sharp, or where one of the two is turned away

web/solids.js and solid.py draw them with a depth for each pixel, so that what is hidden is hidden however parts cross.
"""

from __future__ import annotations

import math

from .marks import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Place, Shape

    Vector = list[float]

THICK = 0.016  # of the scene's size: radius of a bar that has no width
ROUND = 40  # sides of what is round
TURNS = 9  # of a spring
WIRE = 14  # points of a turn


def solids(shapes: list[Shape], size: float) -> list[Any]:
    """Those of a scene; `size`: of the room that it needs [m]."""
    found = []
    t = THICK * size
    for s in shapes:
        kind = s["kind"]
        if kind == "rod":
            r = max(t, s["sizes"][1] / 2 if len(s["sizes"]) > 1 else 0.0)
            found.append(solid(s["at"], cylinder([0, 0, 0], [s["sizes"][0], 0, 0], r), "body"))
        elif kind == "box":
            w, h = s["sizes"][0], s["sizes"][1] if len(s["sizes"]) > 1 else s["sizes"][0]
            d = s["sizes"][2] if len(s["sizes"]) > 2 else 0.4 * min(w, h)
            found.append(solid(s["at"], block([w / 2, 0, 0], [0, h / 2, 0], [0, 0, d / 2]), "body"))
        elif kind == "disc":
            wheel_of(found, s["at"], [0, 0, 1], s["sizes"][0], t)
        elif kind == "bones":
            bones_of(found, s, shapes, t)
        elif kind == "joint":
            joint_of(found, s, size, t)
        elif kind == "contact" and s["axis"]:
            wheel_of(found, s["p"], s["axis"], s["r"], t)
        elif kind == "spring" and "p" in s:
            found.append(strut(s["p"], s["q_"], coiled(2.2 * t, 0.4 * t), "coil"))
        elif kind == "damper" and "p" in s:
            found.append(strut(s["p"], s["q_"], cylinder([0, 0, 0], [0.55, 0, 0], 1.5 * t), "ground"))
            found.append(strut(s["p"], s["q_"], cylinder([0.5, 0, 0], [1, 0, 0], 0.6 * t), "ground"))
    return found


def is_solid(planar: bool, s: Shape) -> bool:
    """Is it drawn as a solid, and by no glyph?"""
    bodies = s["kind"] in ["rod", "box", "disc", "bones", "joint"]
    return not planar and (bodies or (s["kind"] in ["spring", "damper"] and "p" in s))


def solid(at: Place, mesh: list[Any], colour: str) -> Any:
    return {"at": at, "points": mesh[0], "faces": mesh[1], "edges": mesh[2], "colour": colour}


def strut(p: Place, q: Place, mesh: list[Any], colour: str) -> Any:
    return {"from": p, "to": q, "points": mesh[0], "faces": mesh[1], "edges": mesh[2], "colour": colour}


def wheel_of(found: list[Any], at: Place, axis: Vector, r: float, t: float, half: float = 0.0) -> None:
    """A disc, with a peg that tells how it turns."""
    half = max(half, 0.8 * t, 0.06 * r)
    found.append(solid(at, cylinder(times(axis, -half), times(axis, half), r), "body"))
    peg = times(across(axis), 0.7 * r)
    far = times(axis, half + 0.1 * r)
    found.append(solid(at, cylinder(plus(peg, times(far, -1)), plus(peg, far), 0.1 * r), "edge"))


def bones_of(found: list[Any], s: Shape, shapes: list[Shape], t: float) -> None:
    """Bars to what is fastened, and what its inertia is like. An inertia about a shaft alone is a wheel, or a ring about what it
    carries."""
    at = s["at"]
    if s["spin"]:
        shaft_of(found, s, shapes, t)
        return
    others = 0
    for p in s["to"]:
        arm = [p[1] - at[1], p[2] - at[2], p[3] - at[3]]
        if math.hypot(*arm) > 1e-9:
            others += 1
            found.append(solid(at, cylinder([0, 0, 0], arm, t), "body"))
    sizes = spread(s, shapes)
    axes: Any = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    if sizes is not None and others < 2:
        # a disc where two of its moments are one, else a block
        w, h, d = sizes
        for k in range(3):
            one, other = sizes[(k + 1) % 3], sizes[(k + 2) % 3]
            if abs(one - other) < 0.02 * one:
                wheel_of(found, at, axes[k], one / math.sqrt(3), t, sizes[k] / 2)
                return
        found.append(solid(at, block([w / 2, 0, 0], [0, h / 2, 0], [0, 0, d / 2]), "body"))
    elif others:
        found.append(solid(at, ball(1.9 * t), "body"))
    else:
        found.append(solid(at, block([2.5 * t, 0, 0], [0, 2.5 * t, 0], [0, 0, 2.5 * t]), "body"))


def spread(s: Shape, shapes: list[Shape]) -> Any:
    """Sides of the block that has the body's mass and moments [m]; a cylinder's are its length and sqrt(3) times its radius. None
    where that says nothing of its looks: beside its joints it would be larger than what lies between them."""
    if s.get("inertia") is None:
        return None
    m, jx, jy, jz = s["inertia"]
    squares = [6 * (jy + jz - jx) / m, 6 * (jz + jx - jy) / m, 6 * (jx + jy - jz) / m]
    largest = max(*squares)
    if not largest > 0 or min(*squares) < -0.01 * largest:
        return None
    sides = [math.sqrt(max(v, 1e-3 * largest)) for v in squares]
    room = 0.0
    for p in s["to"]:
        room = max(room, math.hypot(p[1] - s["at"][1], p[2] - s["at"][2], p[3] - s["at"][3]))
    held = any(
        j["kind"] == "joint" and j["joint"] != "none" and (j["a"][0] == s["at"][0] or j["b"][0] == s["at"][0])
        for j in shapes
    )
    return None if held and max(*sides) > 2 * room else sides


def shaft_of(found: list[Any], s: Shape, shapes: list[Shape], t: float) -> None:
    at, carried = s["at"], 0
    own: Any = [0.0, 0.0, 1.0]
    for j in shapes:
        if j["kind"] == "joint" and j["b"][0] == at[0] and j["sort"] == "pin":
            own = j["axis"]
    body, normal = at[0], own
    # what hangs in it, and in that
    for step in range(4):
        following = body
        for j in shapes:
            if j["kind"] == "joint" and j["a"][0] == body and body != 0 and j["sort"] == "pin":
                following = j["b"][0]
                if step == 0:
                    normal = cross(own, j["axis"])
        if following == body:
            break
        carried += 1
        body = following
    if carried == 0 or math.hypot(*normal) < 0.3:
        # shafts that meet in a point are drawn to either side of it
        side = aside(at[0], shapes)
        off = times(own, side * s["spin"])
        wheel_of(found, moved(at, off[0], off[1], off[2]), own, s["spin"], t)
        if side:
            found.append(solid(at, cylinder([0, 0, 0], off, 0.8 * t), "edge"))
    else:
        found.append(solid(at, hoop(unit(normal), s["spin"] * (1.06 + 0.22 * carried), t), "body"))


def joint_of(found: list[Any], s: Shape, size: float, t: float) -> None:
    axis, sort, fixed = s["axis"], s["sort"], s["a"][0] == 0
    colour = "ground" if fixed else "edge"
    if s["joint"] == "none":
        return
    if s["joint"] == "slide":
        far = size if fixed else 6 * t
        rail = 0.5 * t
        found.append(solid(s["a"], cylinder(times(axis, -far), times(axis, far), rail), colour))
        u = across(axis)
        v = cross(axis, u)
        found.append(solid(s["b"], block(times(axis, 3 * t), times(u, 1.7 * t), times(v, 1.7 * t)), "panel"))
    elif s["joint"] == "rod":
        found.append(strut(s["a"], s["b"], cylinder([0, 0, 0], [1, 0, 0], 0.7 * t), "edge"))
    elif s["joint"] == "weld":
        found.append(solid(s["b"], block([1.2 * t, 0, 0], [0, 1.2 * t, 0], [0, 0, 1.2 * t]), colour))
    elif sort == "ball" or sort == "universal":
        found.append(solid(s["b"], ball(1.9 * t), colour))
    else:
        found.append(solid(s["a"], cylinder(times(axis, -2.6 * t), times(axis, 2.6 * t), 1.5 * t), colour))


def aside(body: float, shapes: list[Shape]) -> int:
    """0 of a wheel that hangs alone where it hangs; of several -1, 1, -1, ..."""
    wheels = [b["at"][0] for b in shapes if b["kind"] == "bones" and b["spin"]]
    pins = [j for j in shapes if j["kind"] == "joint" and j["sort"] == "pin" and j["b"][0] in [*wheels]]
    for own in pins:
        if own["b"][0] == body:
            hung = [j["b"][0] for j in pins if j["a"][0] == own["a"][0]]
            for k in range(len(hung)):
                if hung[k] == body and len(hung) > 1:
                    return 1 if k % 2 else -1
    return 0


# ---- meshes: [points, faces, edges] ----


def cylinder(a: Vector, b: Vector, r: float) -> list[Any]:
    """From the middle of one end to that of the other."""
    along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
    u = across(along)
    v = unit(cross(along, u))
    rings = [ring(a, u, v, r, ROUND), ring(b, u, v, r, ROUND)]
    mesh = sheet(rings)
    n, last = ROUND, len(mesh[1])
    mesh[1].append(list(range(n)))
    mesh[1].append([n + k for k in range(n)])
    for k in range(n):
        mesh[2].append([k, (k + 1) % n, k, last, 1])
        mesh[2].append([n + k, n + (k + 1) % n, k, last + 1, 1])
    return mesh


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


def ball(r: float) -> list[Any]:
    rings = []
    for k in range(9):
        turn = math.pi * (k + 0.02) / 8.04 - math.pi / 2
        rings.append(ring([0, 0, r * math.sin(turn)], [1, 0, 0], [0, 1, 0], r * math.cos(turn), 16))
    return sheet(rings)


def coiled(r: float, wire: float) -> list[Any]:
    """A spring along x from 0 to 1; its radius in metres."""
    rings = []
    n = TURNS * WIRE
    for k in range(n + 1):
        turn = 2 * math.pi * k / WIRE
        u, v = [0, math.cos(turn), math.sin(turn)], [0.12 / TURNS, 0, 0]
        rings.append(ring([0.06 + 0.88 * k / n, r * u[1], r * u[2]], times(u, wire), v, 1.0, 6))
    return sheet(rings)


def block(u: Vector, v: Vector, w: Vector) -> list[Any]:
    """From half its sides."""
    points = []
    for i in [-1, 1]:
        for j in [-1, 1]:
            for k in [-1, 1]:
                points.append([i * u[m] + j * v[m] + k * w[m] for m in range(3)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    edges = [[0, 1], [0, 2], [0, 4], [1, 3], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 6], [5, 7], [6, 7]]
    return [points, faces, [[i, j, -1, -1, 1] for i, j in edges]]


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
            edges.append([i * n + k, (i + 1) * n + k, i * n + k, i * n + (k + n - 1) % n, 0])
            if i + 1 < count:
                edges.append([(i + 1) * n + k, (i + 1) * n + after, i * n + k, (i + 1) * n + k, 0])
    return [points, faces, edges]


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
