"""What each kind of shape looks like in a film, as web/machine.js draws it in the page. A test holds the two lists together.

A glyph draws a shape of assemble/drawing.py at the stage's instant with a pen of film.py. Layers: 0 bodies, 1 joints and what
is passive, 2 what acts.
"""

from __future__ import annotations

import math

from .stage import moved

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .film import Pen
    from .stage import Point, Stage

    Shape = dict[str, Any]

COLOURS = {
    "back": "#ffffff", "panel": "#f6f7f9", "ink": "#1c2430", "soft": "#667080", "accent": "#0b62c4", "body": "#c9d4e2",
    "edge": "#3d4b5e", "ground": "#66707f", "force": "#c8341f", "coil": "#8a4fb8", "motor": "#0b62c4", "wiper": "#0f7d46",
}  # fmt: skip
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
UNSCALED = ("", "rad", "rad/s")


class Glyph:
    __slots__ = ("draw", "layer")

    def __init__(self, layer: int, draw: Callable[[Stage, Pen, Shape], None]) -> None:
        self.layer, self.draw = layer, draw


def written(value: float, unit: str = "", digits: int = 3) -> str:
    """0.00574 A -> "5.74 mA"; as many characters from frame to frame as the size allows."""
    size = abs(value)
    if size == 0 or unit in UNSCALED or not 1e-12 <= size < 1e12:
        return f"{value:.{digits}g} {unit}".rstrip()
    power = 3 * math.floor(math.log10(size * (1 + 1e-9)) / 3)
    return f"{value * 10.0**-power:.{digits}g} {PREFIXES[power]}{unit}"


def mixed(colour: str, share: float, on: str = "back") -> str:
    """A colour, so much of it, on another."""
    parts = [(int(COLOURS[colour][k : k + 2], 16), int(COLOURS[on][k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(share * a + (1 - share) * b):02x}" for a, b in parts)


# ---- bodies -------------------------------------------------------------------------------------


def rod(m: Stage, pen: Pen, s: Shape) -> None:
    length, *wide = s["sizes"]
    a, b = m.place(s["at"]), m.place(moved(s["at"], length))
    width = max(7.0, (wide[0] if wide else 0.0) * m.scale / pen.unit)
    pen.line([a, b], "edge", width + 2.4)
    pen.line([a, b], "body", width)
    pen.label(middle(a, b), 9, -7, s["name"], "soft")


def box(m: Stage, pen: Pen, s: Shape) -> None:
    w, h, d = (*s["sizes"], s["sizes"][0], 0.0)[:3] if len(s["sizes"]) == 1 else (*s["sizes"], 0.0)[:3]
    sides = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    depths = [0.0] if m.planar or not d else [-d / 2, d / 2]
    depths.sort(key=lambda z: m.nearness(moved(s["at"], 0.0, 0.0, z)))
    faces = [[m.place(moved(s["at"], i * w / 2, j * h / 2, z)) for i, j in sides] for z in depths]
    for face in faces:
        pen.polygon(face)
    if len(faces) == 2:
        for a, b in zip(*faces, strict=True):
            pen.line([a, b], "edge", 1.4)
    x, y = m.place(s["at"])
    pen.label((x, y), 8, -8, s["name"], "soft")


def disc(m: Stage, pen: Pen, s: Shape) -> None:
    at, r = s["at"], max(s["sizes"][0], 4 / m.scale)
    turns = [2 * math.pi * k / 72 for k in range(72)]
    pen.polygon([m.place(moved(at, r * math.cos(a), r * math.sin(a))) for a in turns])
    x, y = m.place(at)
    pen.line([(x, y), m.place(moved(at, r))], "edge", 1.4)
    wide = r * m.scale
    if wide > 30 * pen.unit:
        pen.label((x - wide, y - 0.8 * wide), 0, 0, s["name"], "soft")
    else:
        pen.label((x, y), 8, -8, s["name"], "soft")


def bones(m: Stage, pen: Pen, s: Shape) -> None:
    at = s["at"]
    x, y = c = m.place(at)
    if s["spin"]:
        # nothing but an inertia: a wheel with a mark
        r = s["spin"]
        pen.circle(c, r * m.scale)
        pen.line([c, m.place(moved(at, r))], "edge", 1.4)
        pen.label((x - r * m.scale, y - r * m.scale), 0, -5, s["name"], "soft")
    elif all(p[1:] == at[1:] for p in s["to"]):
        # nothing but a mass
        w, h = 16 * pen.unit, 11 * pen.unit
        pen.polygon([(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)])
        pen.label(c, -14, -15, s["name"], "soft")
    else:
        for colour, width in (("edge", 8.4), ("body", 6.0)):
            for p in s["to"]:
                pen.line([c, m.place(p)], colour, width)
        pen.circle(c, 6 * pen.unit)
        pen.label((x, y), 8, -8, s["name"], "soft")


# ---- joints and what is passive -----------------------------------------------------------------


def joint(m: Stage, pen: Pen, s: Shape) -> None:
    kind, u = s["joint"], pen.unit
    if kind == "none":
        return
    xa, ya = a = m.place(s["a"])
    x, y = b = m.place(s["b"])
    if kind == "slide":
        angle = m.axis_angle(s)
        c, d = math.cos(angle), math.sin(angle)
        fixed = s["a"][0] == 0
        # a rail of the frame goes from edge to edge, one on a body to its slider and beyond
        far = 2.0 * (m.width + m.height)
        along = (x - xa) * c + (y - ya) * d
        low, high = (-far, far) if fixed else (min(-40 * u, along - 24 * u), max(40 * u, along + 24 * u))
        ends = [(xa + reach * c, ya + reach * d) for reach in (low, high)]
        pen.line(ends, "ground", 1.5, 0 if fixed else 4)
        corners = ((-7, -4), (7, -4), (7, 4), (-7, 4))
        pen.polygon([(x + u * (i * c - j * d), y + u * (i * d + j * c)) for i, j in corners], "panel")
        return
    if kind == "rod":
        pen.line([a, b], "edge", 3)
    for body, at in ((s["a"][0], a), (s["b"][0], b)):
        if body == 0 and kind == "pin":
            ground(pen, *at, 27 if s["below"] else 15)
    if kind == "weld":
        pen.polygon(
            [(x - 4 * u, y - 4 * u), (x + 4 * u, y - 4 * u), (x + 4 * u, y + 4 * u), (x - 4 * u, y + 4 * u)],
            "panel",
        )
    else:
        pen.circle(b, 4.5 * u, "panel")


def ground(pen: Pen, x: float, y: float, tall: float = 15) -> None:
    u = pen.unit
    foot = y + tall * u
    pen.line([(x, y), (x - 9 * u, foot), (x + 9 * u, foot), (x, y)], "ground", 1.5)
    pen.line([(x - 14 * u, foot), (x + 14 * u, foot)], "ground", 1.5)
    for k in range(-12, 13, 6):
        pen.line([(x + k * u, foot), (x + (k - 4) * u, foot + 5 * u)], "ground", 1.5)


def anchor(m: Stage, pen: Pen, place: Sequence[float]) -> None:
    """What a spring or a damper hangs on."""
    at = m.place(place)
    if place[0] == 0:
        ground(pen, *at, 9)
    pen.circle(at, 3.2 * pen.unit, "panel")


def elastic(m: Stage, pen: Pen, s: Shape) -> None:
    """A spring, or a damper: between two points, along a slide, about a pin."""
    kind, u = s["kind"], pen.unit
    colour, width = "coil" if kind == "spring" else "ground", 1.4 + 1.6 * abs(m.share(s["effort"]))
    if "p" in s:
        p, q = m.place(s["p"]), m.place(s["q_"])
        between(pen, p, q, kind, colour, width)
        anchor(m, pen, s["p"])
        anchor(m, pen, s["q_"])
        pen.label(middle(p, q), 10, 0, s["name"], colour)
        return
    a, b = m.place(s["a"]), m.place(s["b"])
    if s["joint"] == "pin" and math.hypot(a[0] - b[0], a[1] - b[1]) > 20 * u:
        between(pen, a, b, kind, colour, width)
        pen.label((middle(a, b)[0], a[1]), -10, -14, s["name"], colour)
        return
    if s["joint"] == "slide":
        # from a wall on the far side of the joint's range, so that it has a length to change
        angle, back = m.axis_angle(s), 0.3 * min(m.width, m.height)
        c, d, off = math.cos(angle), math.sin(angle), (-11 if kind == "spring" else 11) * u
        wall = (a[0] - back * c - off * d, a[1] - back * d + off * c)
        between(pen, wall, (b[0] - off * d, b[1] + off * c), kind, colour, width)
        pen.line(
            [(wall[0] + 9 * u * d, wall[1] - 9 * u * c), (wall[0] - 9 * u * d, wall[1] + 9 * u * c)],
            colour,
            width,
        )
        pen.label(wall, 6, -10 if kind == "spring" else 22, s["name"], colour)
        return
    if kind == "damper":
        pen.arc(b, 11 * u, 0.3, 2.8, colour, width)
    else:
        end = 4 * math.pi + m.value(s["q"])
        turns = [(k / 80 * end, (6 + 10 * k / 80) * u) for k in range(81)]
        pen.line([(b[0] + r * math.cos(t), b[1] - r * math.sin(t)) for t, r in turns], colour, width)
    pen.label(b, 14, 14, s["name"], colour)


def middle(a: Point, b: Point) -> Point:
    return (a[0] + b[0]) / 2, (a[1] + b[1]) / 2


def between(pen: Pen, start: Point, end: Point, kind: str, colour: str, width: float) -> None:
    """A coil or a piston between two points of the picture."""
    length = math.hypot(end[0] - start[0], end[1] - start[1]) / pen.unit
    angle = math.atan2(end[1] - start[1], end[0] - start[0])
    c, d, u = math.cos(angle), math.sin(angle), pen.unit

    def stroke(*points: Point) -> None:
        pen.line(
            [(start[0] + u * (x * c - y * d), start[1] + u * (x * d + y * c)) for x, y in points],
            colour,
            width,
        )

    if kind == "spring":
        lead, turns = min(10.0, 0.15 * length), 9
        coil = [
            (lead + (length - 2 * lead) * k / (2 * turns), 7.0 if k % 2 == 0 else -7.0)
            for k in range(1, 2 * turns)
        ]
        stroke((0, 0), (lead, 0), *coil, (length - lead, 0), (length, 0))
    else:
        m = 0.5 * length
        stroke((0, 0), (m, 0))
        stroke((m, -6), (m, 6))
        stroke((m - 10, -8), (m + 8, -8), (m + 8, 8), (m - 10, 8))
        stroke((m + 8, 0), (length, 0))


def gear(m: Stage, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    if "radii" in s:
        # wheels that mesh; those that turn the same way have one between them
        r, q = (v * m.scale for v in s["radii"])
        far, angle = math.hypot(b[0] - a[0], b[1] - a[1]), math.atan2(b[1] - a[1], b[0] - a[0])
        wheels = [(a, r), (b, q)]
        if not s["meshed"]:
            way = (far + r - q) / 2
            wheels.append(((a[0] + way * math.cos(angle), a[1] + way * math.sin(angle)), (far - r - q) / 2))
        for at, radius in wheels:
            pen.arc(at, radius, 0.0, 2 * math.pi, "soft", 1.5)
            count = max(8, round(2 * math.pi * radius / (9 * pen.unit)))
            for k in range(count):
                c, d = math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)
                ends = [
                    (at[0] + f * c, at[1] + f * d) for f in (radius - 2 * pen.unit, radius + 2 * pen.unit)
                ]
                pen.line(ends, "soft", 2.5)
    else:
        pen.line([a, b], "soft", 1.5, 5)
    pen.label(middle(a, b), -6, 16, f"{s['name']} {s['ratio']:.4g}", "soft")


def belt(m: Stage, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["a"]), m.place(s["second"]["a"])
    ra, rb = (r * m.scale for r in s["radii"])
    d, way = math.dist(a, b), math.atan2(b[1] - a[1], b[0] - a[0])
    for at, r in ((a, ra), (b, rb)):
        pen.circle(at, r, None, "edge", 1.5)
    wide = math.acos(max(-1.0, min(1.0, (ra + rb if s["cross"] else ra - rb) / (d or 1.0))))
    for turn, tension in zip((-wide, wide), s["tensions"], strict=True):
        share, c, f = abs(m.share(tension)), math.cos(way + turn), math.sin(way + turn)
        far = -rb if s["cross"] else rb
        ends = [(a[0] + ra * c, a[1] + ra * f), (b[0] + far * c, b[1] + far * f)]
        pen.line(ends, "force" if share > 0.01 else "soft", 1.2 + 3 * share, 0 if share > 0 else 5)
    pen.label(middle(a, b), 6, 4, f"{s['name']} {written(m.value(s['effort']), 'N')}", "soft")


def cam(m: Stage, pen: Pen, s: Shape) -> None:
    a, b = m.place(s["first"]["b"]), m.place(s["second"]["a"])
    share, r = abs(m.share(s["effort"])), 18 * pen.unit
    turn = m.poses[int(s["second"]["a"][0])].angle + m.value(s["second"]["q"]) + s["second"]["zero"]
    at = (b[0] + 0.45 * r * math.cos(turn), b[1] - 0.45 * r * math.sin(turn))
    pen.circle(at, r, None, "force" if share > 0.01 else "edge", 1.5 + 2.5 * share)
    pen.line([a, b], "soft", 1.5, 5)
    pen.label(b, 29, 18, s["name"], "soft")


def stop(m: Stage, pen: Pen, s: Shape) -> None:
    x, y = at = m.place(s["a"])
    u, share, angle = pen.unit, abs(m.share(s["effort"])), m.axis_angle(s)
    c, d, colour = math.cos(angle), math.sin(angle), "force" if share > 0.01 else "edge"
    for end in s["ends"]:
        if end is None:
            continue
        if s["joint"] == "pin":
            turn = m.poses[int(s["a"][0])].angle + end + s["zero"]
            ends = [(x + r * u * math.cos(turn), y - r * u * math.sin(turn)) for r in (16, 34)]
        else:
            far = (end + s["zero"]) * m.scale
            ends = [(x + far * c - k * u * d, y + far * d + k * u * c) for k in (14, -14)]
        pen.line(ends, colour, 2.5 + 3 * share)
        at = ends[1]
    pen.label(at, 5, -4, s["name"], "soft")


def contact(m: Stage, pen: Pen, s: Shape) -> None:
    p, q = m.place(s["p"]), m.place(s["q_"])
    share, far = abs(m.share(s["effort"])), 70 * pen.unit / m.scale
    colour, width = "force" if share > 0.01 else "edge", 1.5 + 2.5 * share
    if s["along"]:
        ends = [m.place(moved(s["q_"], *(k * far * v for v in s["along"]))) for k in (-1, 1)]
        pen.line(ends, colour, width)
    for at, r in ((p, s["r"]), (q, s["rq"])):
        if r:
            pen.arc(at, abs(r) * m.scale, 0.0, 2 * math.pi, colour, width)
    pen.label(q, 8, 14, s["name"], "soft")


def friction(m: Stage, pen: Pen, s: Shape) -> None:
    """The two shoes of a brake."""
    turns, u, angle = s["joint"] == "pin", pen.unit, m.axis_angle(s)
    x, y = at = m.place(s["a"] if turns else s["b"])
    c, d, width = math.cos(angle), math.sin(angle), 1.6 + 3 * abs(m.share(s["effort"]))
    for side in (-1, 1):
        if turns:
            pen.arc(at, 11 * u, side * 1.57 - 0.6, side * 1.57 + 0.6, "wiper", width)
        else:
            ends = [(x + u * (k * c - side * 8 * d), y + u * (k * d + side * 8 * c)) for k in (-12, 12)]
            pen.line(ends, "wiper", width)
    pen.label(at, 12, -12, s["name"], "wiper")


# ---- what acts ----------------------------------------------------------------------------------


def effort(m: Stage, pen: Pen, s: Shape, at: Point, r: float, colour: str, name: str = "") -> None:
    """The arrow of a torque, or of a force along a slide."""
    share, u = m.share(s["effort"]), pen.unit
    slides = s.get("joint") == "slide"
    if slides and abs(share) > 0.01:
        angle = m.axis_angle(s)
        tip = (at[0] + 55 * u * share * math.cos(angle), at[1] + 55 * u * share * math.sin(angle))
        pen.arrow(at, tip, colour, 2.2, 8)
    elif not slides and abs(share) >= 0.01:
        # counter-clockwise for a positive share
        start, end = -math.pi / 2, -math.pi / 2 - share * 1.6 * math.pi
        pen.arc(at, r * u, start, end, colour, 2.2)
        tip = (at[0] + r * u * math.cos(end), at[1] + r * u * math.sin(end))
        pen.head(tip, end + (-math.pi / 2 if share > 0 else math.pi / 2), colour, 8)
    if name:
        said = written(m.value(s["effort"]), "N" if slides else "N m")
        pen.label(at, r + 4, r, f"{name} {said}", colour)


def motor(m: Stage, pen: Pen, s: Shape) -> None:
    x, y = at = m.place(s["a"])
    share, u = m.share(s["current"]), pen.unit
    # its ring tells the current
    colour = mixed("force" if share < 0 else "motor", 0.2 + 0.8 * abs(share))
    if s["joint"] == "pin":
        pen.circle(at, 18 * u, "panel")
        pen.circle(at, 14.5 * u, None, colour, 5)
    else:
        for r, edge, width, fill in ((18.0, "edge", 1.4, "panel"), (14.5, colour, 5.0, None)):
            w, h = r * u, 0.8 * r * u
            corners = [(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)]
            if fill:
                pen.polygon(corners, fill, edge, width)
            else:
                pen.line([*corners, corners[0]], edge, width)
    for k in range(s["poles"] if s["poles"] > 1 else 0):  # its phases, as spokes between stator and rotor
        c, d = math.cos(2 * math.pi * k / s["poles"]), math.sin(2 * math.pi * k / s["poles"])
        pen.line([(x + r * u * c, y - r * u * d) for r in (8, 12)], colour, 3)
    pen.write(x, y, "M", "ink", anchor="mm")
    pen.keep_off(at, 19 * u)
    effort(m, pen, s, at, 26, "motor")
    pen.label(at, 30, 26, f"{s['name']} {written(m.value(s['current']), 'A')}", "motor")


def pot(m: Stage, pen: Pen, s: Shape) -> None:
    x, y = at = m.place(s["a"])
    q, u = m.value(s["q"]) + s["zero"], pen.unit
    low, high = sorted(v + s["zero"] for v in s["range"])
    said = f"{s['name']} {written(m.value(s['wiper']), 'V')}"
    if s["joint"] == "pin":
        base, r = m.poses[int(s["a"][0])].angle, (36 + 11 * s["rings"]) * u
        pen.keep_off(at, r)
        pen.arc(at, r, -(base + low), -(base + high), "wiper", 3)
        held = base + min(max(q, low), high)
        start, end = ((x + f * math.cos(held), y - f * math.sin(held)) for f in (r - 16 * u, r))
        pen.arrow(start, end, "wiper", 3, 7)
        pen.label(at, 40, -22, said, "wiper")
        return
    angle = m.axis_angle(s)
    c, d = math.cos(angle), math.sin(angle)

    def on(v: float) -> Point:
        return x + v * m.scale * c - 16 * u * d, y + v * m.scale * d + 16 * u * c

    pen.line([on(low), on(high)], "wiper", 3)
    tip = on(q)
    pen.arrow((tip[0] + 10 * u * d, tip[1] - 10 * u * c), tip, "wiper", 3, 7)
    pen.label(on(high), 6, 4, said, "wiper")


def force(m: Stage, pen: Pen, s: Shape) -> None:
    x, y = m.place(s["at"])
    vector = [m.value(ref) for ref in s["vector"]]
    largest = math.hypot(*(m.top(ref) for ref in s["vector"]))
    size = math.hypot(*vector)
    if not size > 1e-6 * largest:
        return
    dx, dy = m.flat(vector)
    tail = (x - 60 * pen.unit * dx / largest, y + 60 * pen.unit * dy / largest)
    pen.arrow(tail, (x, y), "force", 2.5)
    pen.label(tail, 6, -6, f"{s['name']} {written(size, 'N')}", "force")


def torque(m: Stage, pen: Pen, s: Shape) -> None:
    effort(m, pen, s, m.place(s["a"]), 22, "force", s["name"])


def drive(m: Stage, pen: Pen, s: Shape) -> None:
    at = m.place(s["a"])
    pen.arc(at, 13 * pen.unit, 0.4, 5.6, "accent", 2)
    pen.label(at, 18, 20, f"{s['name']} (prescribed)", "accent")


def transducer(m: Stage, pen: Pen, s: Shape) -> None:
    x, y = m.place(s["b"])
    u, width = pen.unit, 2 + 3 * abs(m.share(s["volts"]))
    if s["form"] == "c":
        for side in (-4 * u, 4 * u):
            pen.line([(x + side, y - 22 * u), (x + side, y - 8 * u)], "coil", width)
    else:
        for k in (-8, 0, 8):
            pen.arc((x + k * u, y - 14 * u), 4 * u, math.pi, 2 * math.pi, "coil", width)
    effort(m, pen, s, (x, y - 14 * u), 20, "coil")
    pen.label((x, y), 12, -20, f"{s['name']} {written(m.value(s['volts']), s.get('of', 'V'))}", "coil")


GLYPHS = {
    "rod": Glyph(0, rod), "box": Glyph(0, box), "disc": Glyph(0, disc), "bones": Glyph(0, bones),
    "joint": Glyph(1, joint), "spring": Glyph(1, elastic), "damper": Glyph(1, elastic), "gear": Glyph(1, gear),
    "belt": Glyph(1, belt), "cam": Glyph(1, cam),
    "stop": Glyph(1, stop), "contact": Glyph(1, contact), "friction": Glyph(1, friction),
    "motor": Glyph(2, motor), "pot": Glyph(2, pot), "force": Glyph(2, force), "torque": Glyph(2, torque),
    "drive": Glyph(2, drive), "transducer": Glyph(2, transducer),
}  # fmt: skip
