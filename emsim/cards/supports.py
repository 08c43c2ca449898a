"""Where a convex solid meets a plane: gaps and slips of CONTACT between shapes in space. n is the normal, o a place on the plane.

    corner p of a box or hull    gap = n . (p - o)
    ball, end of a capsule       gap = n . (c - o) - r
    rim of a disc or cylinder    gap = n . (c - o) - r |n - (n.a) a|                  a its axis
    ellipsoid of half-axes s     gap = n . (c - o) - h,   h^2 = sum (s_k n.e_k)^2     e_k its axes
The last two are support functions: of all points of the solid the one at c - dh/dn is nearest, and that of a smooth solid moves
through it, so one place says all. The rim of a disc or cylinder that lies flat on the plane has no nearest point: there FEET
points fixed on it take its place, on which it rests, rocks and strikes.
"""

from __future__ import annotations

from math import cos, pi, sin

from .kinematics import add, cross, dot, perpendicular, scale, subtract
from .laws import Edge
from .resisting import turning
from .round import NOTHING, nonzero

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import BodyView, Scalar, Scene
    from .resisting import Turns
    from .solids import Solid, Vector

    Part = tuple[str, str, Solid]
    # its label, a place of the solid, the way from there to where it is nearest, the gap, how that is held
    Place = tuple[str, Sequence[Scalar], Sequence[Scalar], Scalar, Edge | None]

FEET = 12  # points of a rim on which it rests, a multiple of 2: it falls flat over opposite ones
FLAT = 1e-4  # [rad] below that a rim lies flat: feet are by (1 - cos(pi/FEET)) of that nearer to the middle than it is
AWAY = 1e30  # [m] a gap of what cannot touch


class Meeting:
    """One place of touch: gap [m] and slips [m/s] of A's part along B's, in two directions at right angles, or one; where it is
    held. `turns`: how A's part turns over B's across the normal, in these directions, and about it [rad/s]."""

    __slots__ = ("edge", "gap", "label", "slips", "turns")

    def __init__(
        self,
        label: str,
        gap: Scalar,
        slips: list[Scalar],
        turns: Turns,
        edge: Edge | None = None,
    ) -> None:
        self.label, self.gap, self.slips, self.turns, self.edge = label, gap, slips, turns, edge


class Plane:
    def __init__(self, s: Scene, part: Part) -> None:
        solid = part[2]
        assert solid.normal is not None
        self.frame = s.frame(part[1])
        self.normal = self.frame.direction(solid.normal)
        self.origin = self.frame.point(_place(solid.at)).pos
        self.ways = [self.frame.direction(way) for way in perpendicular(solid.normal)]

    def above(self, p: Sequence[Scalar]) -> Scalar:
        return dot(self.normal, subtract(p, self.origin))


def held_number(s: Scene, size: Expr, label: str) -> Expr:
    """A number that goes with a law's mode; what stands for its condition is never met."""
    return s.b.flag(s.public(-1.0 - size * size), None, f"{label} held", law="kept")


def within(s: Scene, label: str, gap: Expr, past: Expr, which: Expr | float = 1.0) -> tuple[Expr, Edge]:
    """A gap that is one while `past` is not above 0, of the feature `which`, and how that ends."""
    held = held_number(s, gap, label)
    can = s.b.select(s.b.call("notless", 0.0, past), which, 0.0)
    return s.b.select(held, gap, s.b.select(can, gap, AWAY)), Edge(held, can, past)


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a solid can touch a plane, of which one is given."""
    flipped = a[2].normal is not None
    part, plane = (b, Plane(s, a)) if flipped else (a, Plane(s, b))
    name, body, solid = part
    frame = s.frame(body)
    places: list[Place] = []
    if solid.semi is not None:
        places.append((name, *_ellipsoid(s, frame, solid, plane), None))
    elif solid.rims:
        places = _rims(s, frame, part, plane)
    else:
        fall = scale(-solid.radius, plane.normal)
        for k, p in enumerate(map(_place, solid.points()), 1):
            at = frame.point(p).pos
            places.append((f"{name} {k}", at, fall, plane.above(at) - solid.radius, None))
    other = a[0] if flipped else b[0]
    turns = turning(frame.omega, plane.frame.omega, plane.ways, plane.normal)
    return [
        Meeting(f"{label} {other}", gap, along(plane.ways, frame, plane.frame, centre, arm), turns, edge)
        for label, centre, arm, gap, edge in places
    ]


def along(
    ways: Sequence[Sequence[Scalar]],
    a: BodyView,
    b: BodyView,
    centre: Sequence[Scalar],
    arm: Sequence[Scalar],
) -> list[Scalar]:
    """The parts along `ways` of A's velocity over that of B, at a place of A that is `arm` from `centre`."""
    place = add(centre, arm)
    return nonzero(subtract(_velocity(a, place), _velocity(b, place)), ways)


def _velocity(frame: BodyView, place: Sequence[Scalar]) -> Sequence[Scalar]:
    origin = frame.point((0.0, 0.0, 0.0))
    return add(origin.vel, cross(frame.omega, subtract(place, origin.pos)))


def _place(p: Sequence[float]) -> Vector:
    return p[0], p[1], p[2]


def _ellipsoid(
    s: Scene, frame: BodyView, solid: Solid, plane: Plane
) -> tuple[Sequence[Scalar], Sequence[Scalar], Scalar]:
    """Its middle, the way from there to where it is nearest, the gap."""
    assert solid.semi is not None
    axes = [frame.direction(axis) for axis in solid.axes]
    parts = [dot(plane.normal, axis) for axis in axes]
    square: Scalar = 0.0
    for half, part in zip(solid.semi, parts, strict=True):
        square = square + (half * half) * (part * part)
    reach = s.b.call("sqrt", s.b.const(0.0) + square)
    arm: Sequence[Scalar] = (0.0, 0.0, 0.0)
    for half, part, axis in zip(solid.semi, parts, axes, strict=True):
        arm = add(arm, scale(-(half * half) * part / reach, axis))
    centre = frame.point(_place(solid.at)).pos
    return centre, arm, plane.above(centre) - reach


def _rims(s: Scene, frame: BodyView, part: Part, plane: Plane) -> list[Place]:
    name, _, solid = part
    axis = frame.direction(solid.axes[2])
    lean = dot(plane.normal, axis)
    across = subtract(plane.normal, scale(lean, axis))
    size = s.b.call("sqrt", s.b.const(NOTHING) + dot(across, across))
    found: list[Place] = []
    for k, rim in enumerate(map(_place, solid.rims), 1):
        label, centre = f"{name} {k}", frame.point(rim).pos
        gap = plane.above(centre) - solid.radius * size
        found.append(
            (label, centre, scale(-solid.radius / size, across), *within(s, label, gap, FLAT - size))
        )
        for foot in range(FEET):
            c, d = (solid.radius * way(2.0 * pi * foot / FEET) for way in (cos, sin))
            at = [p + c * u + d * v for p, u, v in zip(rim, *solid.axes[:2], strict=True)]
            place, label = frame.point(_place(at)).pos, f"{name} {k},{foot + 1}"
            high = s.b.const(0.0) + plane.above(place)
            found.append((label, place, (0.0, 0.0, 0.0), *within(s, label, high, size - FLAT)))
    return found
