"""Where a convex solid meets a plane: gaps and slips of CONTACT between shapes in space. n is the plane's normal, o a place on it.

    corner p of a box or hull    gap = n . (p - o)
    ball, end of a capsule       gap = n . (c - o) - r
    rim of a disc or cylinder    gap = n . (c - o) - r |n - (n.a) a|                  a its axis
    ellipsoid of half-axes s     gap = n . (c - o) - h,   h^2 = sum (s_k n.e_k)^2     e_k its axes
The last two are support functions: of all points of the solid the one at c - dh/dn is nearest, and that of a smooth solid moves
through it, so one place says all. A cylinder or disc that stands on its flat side has also points fixed on its rim: on them it
rests, and what falls flat strikes with them.
"""

from __future__ import annotations

from math import cos, pi, sin

from .kinematics import add, cross, dot, is_zero, perpendicular, scale, subtract

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .base import BodyView, Scalar, Scene
    from .laws import Edge
    from .solids import Solid, Vector

    Part = tuple[str, str, Solid]

NOTHING = 1e-15  # [of 1] keeps a slope where a rim lies flat on a plane
FEET = 6  # points of a rim on which it rests, a multiple of 2: it passes flat over opposite ones
FLAT = 0.05  # [rad] of a rim on a plane: from there on it rolls on its rim alone, and its feet do not touch
AWAY = 1e30  # [m] a gap of what cannot touch


class Meeting:
    """One place of touch: gap [m] and slips [m/s] of A's part along B's, in two directions at right angles, or one; where it is
    held."""

    __slots__ = ("edge", "gap", "label", "slips")

    def __init__(self, label: str, gap: Scalar, slips: list[Scalar], edge: Edge | None = None) -> None:
        self.label, self.gap, self.slips, self.edge = label, gap, slips, edge


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


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a solid can touch a plane, of which one is given."""
    flipped = a[2].normal is not None
    part, plane = (b, Plane(s, a)) if flipped else (a, Plane(s, b))
    name, body, solid = part
    frame = s.frame(body)
    if solid.semi is not None:
        places = [(f"{name}", *_ellipsoid(s, frame, solid, plane))]
    elif solid.rims:
        places = _rims(s, frame, part, plane)
    else:
        fall = scale(-solid.radius, plane.normal)
        places = [
            (f"{name} {k}", frame.point(p).pos, fall, plane.above(frame.point(p).pos) - solid.radius)
            for k, p in enumerate(map(_place, solid.points()), 1)
        ]
    return [
        Meeting(
            f"{label} {a[0] if flipped else b[0]}", gap, along(plane.ways, frame, plane.frame, centre, arm)
        )
        for label, centre, arm, gap in places
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
    slip = subtract(_velocity(a, place), _velocity(b, place))
    return [part for way in ways if not is_zero(part := dot(slip, way))]


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


def _rims(
    s: Scene, frame: BodyView, part: Part, plane: Plane
) -> list[tuple[str, Sequence[Scalar], Sequence[Scalar], Scalar]]:
    name, _, solid = part
    axis = frame.direction(solid.axes[2])
    lean = dot(plane.normal, axis)
    across = subtract(plane.normal, scale(lean, axis))
    size = s.b.call("sqrt", s.b.const(NOTHING) + dot(across, across))
    rolls = s.b.call("notless", size, FLAT)
    found: list[tuple[str, Sequence[Scalar], Sequence[Scalar], Scalar]] = []
    for k, rim in enumerate(map(_place, solid.rims), 1):
        centre = frame.point(rim).pos
        gap = plane.above(centre) - solid.radius * size
        found.append((f"{name} {k}", centre, scale(-solid.radius / size, across), gap))
        for foot in range(FEET):
            c, d = cos(2.0 * pi * foot / FEET) * solid.radius, sin(2.0 * pi * foot / FEET) * solid.radius
            at = [p + c * u + d * v for p, u, v in zip(rim, *solid.axes[:2], strict=True)]
            place = frame.point(_place(at)).pos
            high = s.b.select(rolls, AWAY, plane.above(place))
            found.append((f"{name} {k},{foot + 1}", place, (0.0, 0.0, 0.0), high))
    return found
