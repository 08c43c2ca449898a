"""GEAR: wheels with involute teeth that mesh, a ring about a planet, an idler; a screw, a rope on its wheel, a string."""

from __future__ import annotations

import math

from ..numbers import rounded
from .marks import THIN, framed, middle, polar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Point, Scene, Shape


def gear(m: Scene, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    said = middle(a, b)
    if "teeth" in s:
        for k in [0, 1]:
            toothed_of(m, pen, s, k)
        if s["law"] == "idler":
            far = math.hypot(b[0] - a[0], b[1] - a[1])
            r, q = s["radii"][0] * m.scale, s["radii"][1] * m.scale
            z, own = s["teeth"][0] * (far - r - q) / 2 / r, phase(m, s, 0)
            between = polar(a, (far + r - q) / 2, -line_of(m, s))
            wheel(pen, between, (far - r - q) / 2, round_up(z), meshed(m, s, own, z))
    elif s.get("lead") == "screw":
        screw(m, pen, s)
    elif s.get("lead") == "rope":
        said = hung(m, pen, s)
    elif s.get("lead") == "string":
        said = wound(m, pen, s)
    else:
        pen.line([a, b], "soft", 1.5, 5)
    text = s["name"] if s.get("lead") else f"{s['name']} {rounded(s['ratio'], 4)}"
    pen.label(said, -6, 16, text, "soft")


def round_up(z: float) -> int:
    return max(6, math.floor(z + 0.5))


def line_of(m: Scene, s: Shape) -> float:
    """Direction from the first wheel's middle to the second's [rad], y upwards."""
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    return math.atan2(a[1] - b[1], b[0] - a[0])


def phase(m: Scene, s: Shape, k: int) -> float:
    """Where a tooth of its k-th wheel stands [rad], y upwards: as the body turns, or as it meshes with what is known."""
    if k == s["known"]:
        if s["by"] is not None:
            other, j = m.shapes[s["by"]], s["first" if k == 0 else "second"]
            return phase(m, other, 0 if other["first"]["b"][0] == j["b"][0] else 1)
        j = s["first" if k == 0 else "second"]
        return m.poses[int(j["b"][0])].angle
    own, z, line = phase(m, s, 1 - k), s["teeth"], line_of(m, s)
    turned = z[1 - k] / z[k]
    if s["law"] == "idler":
        return line + turned * (own - line)
    way = line if k == 1 else line + math.pi
    if s["law"] == "inner":
        inward = line if s["radii"][0] > s["radii"][1] else line + math.pi
        return inward + turned * (own - inward)
    return way + math.pi + (math.pi - z[1 - k] * (own - way)) / z[k]


def meshed(m: Scene, s: Shape, own: float, z: float) -> float:
    """A tooth of the idler, where one of the first wheel stands at `own`."""
    line = line_of(m, s)
    return line + math.pi + (math.pi - s["teeth"][0] * (own - line)) / round_up(z)


def toothed_of(m: Scene, pen: Pen, s: Shape, k: int) -> None:
    at, r, z, turn = (
        m.place(s["first" if k == 0 else "second"]["a"]),
        s["radii"][k] * m.scale,
        s["teeth"][k],
        phase(m, s, k),
    )
    if s["law"] == "inner" and s["radii"][k] > s["radii"][1 - k]:
        ring_wheel(pen, at, r, z, turn)
    else:
        wheel(pen, at, r, z, turn)


def wheel(pen: Pen, at: Point, r: float, z: int, turn: float) -> None:
    pen.polygon(toothed(at, r, z, turn), "body", "edge", THIN)
    pen.circle(at, 0.72 * r, None, "edge", 0.7, 0.5)
    for k in range(5):
        pen.circle(polar(at, 0.46 * r, -turn - 0.4 * math.pi * k), 0.13 * r, "panel", "edge", 0.7)


def ring_wheel(pen: Pen, at: Point, r: float, z: int, turn: float) -> None:
    """Teeth inwards: the hole is an outline of teeth, which have no more than their own height below the pitch circle."""
    hole, n = toothed(at, r, z, turn), 8 * z
    rim = [polar(at, r * (1 + 5.5 / z), -turn - 2 * math.pi * k / n) for k in range(n + 1)]
    # one outline, along the rim and back along the hole
    back = [hole[(n - k) % len(hole)] for k in range(n + 1)]
    pen.polygon([*rim, *back], "body", "body", 0.5)
    pen.line(rim, "edge", THIN)
    pen.line([*hole, hole[0]], "edge", THIN)


def toothed(at: Point, r: float, z: int, turn: float) -> list[Point]:
    """Outline of a wheel of z involute teeth on a pitch circle r, a tooth at `turn`; eight points a tooth. With the module
    2 r/z teeth reach one module out and 1.25 in; at a radius R the flank stands off the tooth's middle by
    pi/2z + inv 20deg - inv t, cos t = r cos 20deg / R, inv t = tan t - t."""
    module, found = 2 * r / z, []
    pressed = math.pi / 9  # the 20 degrees at which teeth press on one another
    least = r * math.cos(pressed)
    middle_of = math.pi / (2 * z) + math.tan(pressed) - pressed
    flank = []
    for radius in [r - 1.25 * module, r - 0.4 * module, r + 0.35 * module, r + module]:
        t = math.acos(min(1.0, least / max(radius, least)))
        flank.append([radius, max(middle_of - (math.tan(t) - t), 0.15 / z)])
    for k in range(z):
        tooth = turn + 2 * math.pi * k / z
        for j in range(4):
            found.append(polar(at, flank[j][0], -(tooth - flank[j][1])))
        for j in range(4):
            found.append(polar(at, flank[3 - j][0], -(tooth + flank[3 - j][1])))
    return found


def screw(m: Scene, pen: Pen, s: Shape) -> None:
    """Along its slide, the thread where the turn has it."""
    slides = s["first"]["joint"] == "slide"
    slide, pin = (s["first"], s["second"]) if slides else (s["second"], s["first"])
    at, angle, u = m.place(slide["a"]), m.axis_angle(slide), pen.unit
    far = 0.3 * min(m.width, m.height) + abs(m.value(slide["q"]) * m.scale)
    pitch, r = max(8 * u, abs(s["ratio"]) * m.scale), 6 * u
    low, high = -14 * u, far + 30 * u
    if m.value(slide["q"]) < 0:
        low, high = -high, -low
    pen.polygon(
        [framed(at, angle, x, y) for x, y in [[low, -r], [high, -r], [high, r], [low, r]]],
        "body",
        "edge",
        THIN,
    )
    turns = m.value(pin["q"]) / (2 * math.pi)
    first = low + pitch * (1 - (turns - math.floor(turns)))
    for k in range(int((high - first) / pitch) + 1):
        x = first + k * pitch
        if x + 0.5 * pitch < high:
            pen.line(
                [framed(at, angle, x, -r - 2 * u), framed(at, angle, x + 0.5 * pitch, r + 2 * u)], "edge", 1.6
            )


def hung(m: Scene, pen: Pen, s: Shape) -> Point:
    """A rope that goes from a slider straight to the wheel, and over it; where its name may stand."""
    slides = s["first"]["joint"] == "slide"
    slide, pin = (s["first"], s["second"]) if slides else (s["second"], s["first"])
    at, end, r = m.place(pin["a"]), m.place(slide["b"]), s["r"] * m.scale
    angle = m.axis_angle(slide)
    along = (at[0] - end[0]) * math.cos(angle) + (at[1] - end[1]) * math.sin(angle)
    foot = polar(end, along, angle)
    out = math.atan2(foot[1] - at[1], foot[0] - at[0])
    up = angle if along > 0 else angle + math.pi
    turn = math.sin(up - out)
    pen.line([end, foot], "edge", 2.2)
    pen.arc(at, r, out, out + (math.pi / 2 if turn > 0 else -math.pi / 2), "edge", 2.2)
    return middle(end, foot)


def wound(m: Scene, pen: Pen, s: Shape) -> Point:
    """A string from where the slide begins to the wheel that hangs in it; where its name may stand."""
    slides = s["first"]["joint"] == "slide"
    slide, pin = (s["first"], s["second"]) if slides else (s["second"], s["first"])
    at, r, angle = m.place(pin["a"]), s["r"] * m.scale, m.axis_angle(slide)
    top = m.place(slide["a"])
    pen.circle(at, r, "panel", "edge", THIN)
    pen.line([framed(top, angle, 0, r), framed(at, angle, 0, r)], "edge", 2)
    pen.line([framed(top, angle, 0, r - 9 * pen.unit), framed(top, angle, 0, r + 9 * pen.unit)], "ground", 3)
    return middle(top, at)
