"""What several glyphs are made of."""

from __future__ import annotations

import math

from ..numbers import written

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Place, Point, Scene, Shape

THIN = 1.4  # px, of outlines


def moved(place: Place, dx: float, dy: float = 0.0, dz: float = 0.0) -> Place:
    """A place beside another on the same body."""
    return [place[0], place[1] + dx, place[2] + dy, place[3] + dz]


def middle(a: Point, b: Point) -> Point:
    return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]


def polar(at: Point, r: float, angle: float) -> Point:
    return [at[0] + r * math.cos(angle), at[1] + r * math.sin(angle)]


def framed(at: Point, angle: float, x: float, y: float) -> Point:
    """A point of a frame that stands at this angle."""
    c, d = math.cos(angle), math.sin(angle)
    return [at[0] + x * c - y * d, at[1] + x * d + y * c]


def rectangle(at: Point, angle: float, w: float, h: float) -> list[Point]:
    """Corners, from half its width and height."""
    return [framed(at, angle, i * w, j * h) for i, j in [[-1, -1], [1, -1], [1, 1], [-1, 1]]]


def bar(pen: Pen, ends: list[Point], width: float) -> None:
    """A rod with its outline."""
    pen.line(ends, "edge", width + 2.4)
    pen.line(ends, "body", width)


def arrow(pen: Pen, start: Point, end: Point, colour: str, width: float, head: float) -> None:
    pen.line([start, end], colour, width)
    pen.head(end, math.atan2(end[1] - start[1], end[0] - start[0]), colour, head)


def ground(pen: Pen, at: Point, tall: float) -> None:
    """The frame's mark below a point."""
    u, x, y = pen.unit, at[0], at[1]
    foot = y + tall * u
    pen.line([[x, y], [x - 9 * u, foot], [x + 9 * u, foot], [x, y]], "ground", 1.5)
    pen.line([[x - 14 * u, foot], [x + 14 * u, foot]], "ground", 1.5)
    for k in range(5):
        left = x + (6 * k - 12) * u
        pen.line([[left, foot], [left - 4 * u, foot + 5 * u]], "ground", 1.5)


def anchor(m: Scene, pen: Pen, place: Place) -> None:
    """What a spring or a damper hangs on."""
    at = m.place(place)
    if place[0] == 0:
        ground(pen, at, 9)
    pen.circle(at, 3.2 * pen.unit, "panel", "edge", THIN)


def coil(pen: Pen, start: Point, end: Point, colour: str, width: float) -> None:
    """A spring between two points."""
    u, angle = pen.unit, math.atan2(end[1] - start[1], end[0] - start[0])
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    lead = min(10 * u, 0.15 * length)
    points = [start, framed(start, angle, lead, 0)]
    for k in range(1, 18):
        points.append(framed(start, angle, lead + (length - 2 * lead) * k / 18, -7 * u if k % 2 else 7 * u))
    points.append(framed(start, angle, length - lead, 0))
    pen.line([*points, end], colour, width)


def piston(pen: Pen, start: Point, end: Point, colour: str, width: float) -> None:
    """A damper between two points."""
    u, angle = pen.unit, math.atan2(end[1] - start[1], end[0] - start[0])
    half = 0.5 * math.hypot(end[0] - start[0], end[1] - start[1])

    def stroke(points: list[Point]) -> None:
        pen.line([framed(start, angle, half + x * u, y * u) for x, y in points], colour, width)

    pen.line([start, framed(start, angle, half, 0)], colour, width)
    stroke([[0, -6], [0, 6]])
    stroke([[-10, -8], [8, -8], [8, 8], [-10, 8]])
    pen.line([framed(start, angle, half + 8 * u, 0), end], colour, width)


def effort(m: Scene, pen: Pen, s: Shape, at: Point, r: float, colour: str) -> None:
    """The arrow of a torque about a pin, or of a force along a slide."""
    share, u = m.share(s["effort"]), pen.unit
    if not m.arrows or abs(share) < 0.01:
        return
    if s.get("joint") == "slide":
        arrow(pen, at, polar(at, 55 * u * share, m.axis_angle(s)), colour, 2.2, 8)
        return
    # counter-clockwise for a positive share
    start = -math.pi / 2
    end = start - share * 1.6 * math.pi
    pen.arc(at, r * u, start, end, colour, 2.2)
    pen.head(polar(at, r * u, end), end - math.pi / 2 if share > 0 else end + math.pi / 2, colour, 8)


def of_effort(m: Scene, s: Shape) -> str:
    """Its size with its unit."""
    return written(m.value(s["effort"]), "N" if s.get("joint") == "slide" else "N m", 3)
