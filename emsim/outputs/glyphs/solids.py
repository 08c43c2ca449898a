"""Bodies and joints of a spatial scene as solids: points, faces and edges in the axes of a body.

    {"body", "at"}          on a body, points from a place of it
    {"from", "to"}          between two places: x of the points runs from 0 at the one to 1 at the other
    "points", "faces", "edges" as meshes.py makes them;  "colour" by name

web/lit.js draws them by the graphics card, web/solids.js and solid.py with a depth for each pixel: what is hidden is hidden
however parts cross.
"""

from __future__ import annotations

import math

from .body import body_mesh, peg_of
from .gear import toothed
from .marks import moved
from .meshes import across, block, coiled, cross, cylinder, globe, hoop, plus, prism, thread, times, unit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Place, Shape

    Vector = list[float]

THICK = 0.016  # of the scene's size: radius of a bar that has no width


def solids(shapes: list[Shape], size: float, planar: bool) -> list[Any]:
    """Those of a scene; `size`: of the room that it needs [m]. In a planar one bodies lie on one another in their order, as the
    bars of a linkage do, and joints on the bodies that they join."""
    found: list[Any] = []
    t = THICK * size
    most = 1.0
    for s in shapes:
        most = max(most, topmost(s))
    layer = min(t, 0.3 * size / most)
    for s in shapes:
        first = len(found)
        if not planar:
            solids_of(found, s, shapes, size, t)
        elif s["kind"] == "bones" and (s["hidden"] or s.get("round")):
            # what its gear or its cam draws is none; what touches by a circle is a wheel
            if not s["hidden"]:
                wheel_of(found, s["at"], [0, 0, 1], s["round"], t)
        else:
            solids_of(found, s, shapes, size, t)
        if planar:
            for part in found[first : len(found)]:
                raise_by(part, layer * topmost(s) + (t if s["kind"] == "joint" else 0.0))
    return found


def topmost(s: Shape) -> float:
    """The last of the bodies that it is on."""
    found = 0.0
    for key in ["at", "a", "b", "p", "q_"]:
        if isinstance(s.get(key), list):
            found = max(found, s[key][0])
    return found


def raise_by(part: Any, z: float) -> None:
    if "at" in part:
        part["at"] = moved(part["at"], 0.0, 0.0, z)
    else:
        part["from"], part["to"] = moved(part["from"], 0.0, 0.0, z), moved(part["to"], 0.0, 0.0, z)


def solids_of(found: list[Any], s: Shape, shapes: list[Shape], size: float, t: float) -> None:
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
    elif kind in ["ball", "wheel", "toothed", "wagon"]:
        look_of(found, s, shapes)
    elif kind == "mesh":
        found.append(solid(s["at"], [s["points"], s["faces"], s["edges"]], "body"))
    elif kind == "solid":
        found.append(solid(s["at"], body_mesh(s, size), "ground" if s["form"] == "plane" else "body"))
        peg = peg_of(s)
        if len(peg):
            found.append(solid(s["at"], peg, "edge"))
    elif kind == "polygon":
        plate_of(found, s)
    elif kind == "bones":
        bones_of(found, s, shapes, t)
    elif kind == "joint":
        joint_of(found, s, size, t)
    elif (
        kind == "contact"
        and s["axis"]
        and not any(b["kind"] == "wheel" and b["at"][0] == s["p"][0] for b in shapes)
    ):
        wheel_of(found, s["p"], s["axis"], s["r"], t)
    elif kind == "spring" and "p" in s:
        found.append(strut(s["p"], s["q_"], coiled(2.2 * t, 0.4 * t), "coil"))
    elif kind == "damper" and "p" in s:
        found.append(strut(s["p"], s["q_"], cylinder([0, 0, 0], [0.55, 0, 0], 1.5 * t), "ground"))
        found.append(strut(s["p"], s["q_"], cylinder([0.5, 0, 0], [1, 0, 0], 0.6 * t), "ground"))


def plate_of(found: list[Any], s: Shape) -> None:
    """A polygon with a thickness, its corners counter-clockwise."""
    corners = [[p[1] - s["at"][1], p[2] - s["at"][2], 0.0] for p in s["to"]]
    w = max(*[p[0] for p in corners]) - min(*[p[0] for p in corners])
    h = max(*[p[1] for p in corners]) - min(*[p[1] for p in corners])
    found.append(solid(s["at"], prism(corners, [0.0, 0.0, 0.2 * min(w, h)], 0.02 * min(w, h)), "body"))


def is_solid(s: Shape) -> bool:
    """Is it drawn as a solid, and by no glyph?"""
    if s["kind"] in ["spring", "damper"]:
        return "p" in s
    return s["kind"] in [
        "rod", "box", "disc", "polygon", "bones", "joint", "ball", "wheel", "toothed", "wagon", "mesh", "solid",
    ]  # fmt: skip


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
        found.append(solid(at, globe(1.9 * t), "body"))
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


def look_of(found: list[Any], s: Shape, shapes: list[Shape]) -> None:
    """What look= says, its axis that of the pin on which it turns, else z."""
    at, r, axis = s["at"], s["sizes"][0], [0.0, 0.0, 1.0]
    for j in shapes:
        if j["kind"] == "joint" and j["sort"] == "pin" and j["b"][0] == at[0]:
            axis = unit(j["axis"])
    if s["kind"] == "ball":
        found.append(solid(at, globe(r), "body"))
        found.append(solid(at, hoop([0, 1, 0], 0.995 * r, 0.03 * r), "soft"))
        found.append(solid(at, hoop([1, 0, 0], 0.995 * r, 0.03 * r), "soft"))
    elif s["kind"] == "wheel":
        tyre_of(found, at, axis, r)
    elif s["kind"] == "toothed":
        u = across(axis)
        flat = toothed([0.0, 0.0], r, int(s["sizes"][1]), 0.0)
        v = cross(axis, u)
        # y of an outline points down
        outline = [plus(times(u, p[0]), times(v, -p[1])) for p in flat]
        found.append(solid(at, prism(outline, times(axis, 0.12 * r), 0.01 * r), "body"))
        found.append(solid(at, cylinder(times(axis, -0.2 * r), times(axis, 0.2 * r), 0.25 * r), "soft"))
    else:
        w, h = r / 2, s["sizes"][1] / 2
        found.append(solid(at, block([w, 0, 0], [0, h, 0], [0, 0, 0.6 * w]), "body"))
        for x in [-0.6, 0.6]:
            for z in [-0.6, 0.6]:
                tyre_of(found, moved(at, x * w, -h, z * w), [0.0, 0.0, 1.0], 0.7 * h)


def tyre_of(found: list[Any], at: Place, axis: Vector, r: float) -> None:
    """A tyre, its spokes and its hub."""
    u = across(axis)
    v = cross(axis, u)
    found.append(solid(at, hoop(axis, 0.93 * r, 0.07 * r), "soft"))
    for k in range(8):
        c, d = math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)
        end = [0.9 * r * (c * u[i] + d * v[i]) for i in range(3)]
        found.append(solid(at, cylinder([0.0, 0.0, 0.0], end, 0.018 * r), "edge"))
    found.append(solid(at, cylinder(times(axis, -0.14 * r), times(axis, 0.14 * r), 0.11 * r), "body"))


def joint_of(found: list[Any], s: Shape, size: float, t: float) -> None:
    axis, sort, fixed = s["axis"], s["sort"], s["a"][0] == 0
    colour = "ground" if fixed else "soft"
    if s["joint"] == "none":
        return
    if sort == "screw":
        reach = size if fixed else 12 * t
        found.append(solid(s["a"], cylinder(times(axis, -reach), times(axis, reach), 1.3 * t), "soft"))
        # less than eight turns would not be seen as a thread
        lead = max(-reach / 4, min(s["lead"], reach / 4))
        found.append(solid(s["a"], thread(axis, 1.3 * t, lead, 2 * reach), "soft"))
        found.append(solid(s["b"], cylinder(times(axis, -2 * t), times(axis, 2 * t), 2.6 * t), "body"))
    elif s["joint"] == "slide":
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
        found.append(solid(s["b"], globe(1.9 * t), colour))
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
