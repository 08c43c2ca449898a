"""Shapes of bodies in space: what is drawn, weighed and touched. All are convex.

    ball(r)  ellipsoid(a,b,c)   about the origin, half-axes a, b, c along x, y, z
    box(w,h,d)                  about the origin; of shapes.py, and with its depth along z a solid
    capsule(l,r)                a rod with round ends: all that is within r of the line from the origin to (l,0,0)
    cylinder(r,h)               about the origin, its axis along z, h long
    hull(x1,y1,z1,..)           the least convex solid that holds these points; of BODY also stl(part.stl[,metres]), of a file
    plane(nx,ny,nz)             through the origin; n points away from what is solid

Inertia by mass about the centre of mass (homogeneous), about principal axes:
    ball 2/5 r^2;  ellipsoid (b^2 + c^2)/5 ..;  box (h^2 + d^2)/12 ..;  cylinder r^2/2 along its axis, r^2/4 + h^2/12 across
    capsule, of a cylinder with mc and two half balls with ms altogether, 1 = mc + ms:
        along   mc r^2/2 + 2/5 ms r^2
        across  mc (r^2/4 + l^2/12) + ms (2/5 r^2 + l^2/4 + 3/8 l r)
"""

from __future__ import annotations

from math import cos, hypot, sin

from . import hulls

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    Vector = tuple[float, ...]

# how many sizes each takes
KINDS: dict[str, tuple[int, int]] = {
    "ball": (1, 1),
    "ellipsoid": (3, 3),
    "capsule": (2, 2),
    "cylinder": (2, 2),
    "plane": (3, 3),
    "hull": (12, 3 * hulls.MOST),
}
# what a hint names
SOLIDS = (
    "box(w,h,d), capsule(l,r), cylinder(r,h), ball(r), ellipsoid(a,b,c), hull(x1,y1,z1,..), plane(nx,ny,nz)"
)
UPRIGHT: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SIGNS = (-1.0, 1.0)


class Solid:
    """Where a shape is in its body: `at` its middle [m], `axes` its own in those of the body. One of
    `half`     three half-lengths [m], with what is within `radius` of them: a ball, a capsule, a box
    `corners`  of a hull, in the axes of the body [m], with its `faces`, `flats` and `edges` (hulls.py)
    `rims`     middles of the rims of a cylinder, one of a thin disc, with `radius`; its axis is the third
    `semi`     three half-axes of an ellipsoid [m]
    `normal`   of a plane, in the axes of the body
    `inertia` Jxx Jyy Jzz Jxy Jxz Jyz by mass [m^2] about the middle.
    """

    def __init__(self, kind: str, sizes: Sequence[float]) -> None:
        self.kind, self.sizes, self.radius = kind, sizes, 0.0
        self.at: Vector = (0.0, 0.0, 0.0)
        self.axes = UPRIGHT
        self.half: Vector | None = None
        self.semi: Vector | None = None
        self.normal: Vector | None = None
        self.corners: list[Vector] = []
        self.faces: list[tuple[int, int, int]] = []
        self.flats: list[hulls.Flat] = []
        self.edges: list[hulls.Side] = []
        self.rims: list[Vector] = []
        self.inertia: Vector = (0.0,) * 6
        getattr(self, f"_{kind}")(*sizes)

    def _ball(self, r: float) -> None:
        self.half, self.radius = (0.0, 0.0, 0.0), r
        self.inertia = (0.4 * r * r,) * 3 + (0.0,) * 3

    def _ellipsoid(self, a: float, b: float, c: float) -> None:
        self.semi = (a, b, c)
        self.inertia = ((b * b + c * c) / 5.0, (a * a + c * c) / 5.0, (a * a + b * b) / 5.0, 0.0, 0.0, 0.0)

    def _box(self, w: float, h: float, d: float) -> None:
        self.half = (0.5 * w, 0.5 * h, 0.5 * d)
        self.inertia = (
            (h * h + d * d) / 12.0,
            (w * w + d * d) / 12.0,
            (w * w + h * h) / 12.0,
            0.0,
            0.0,
            0.0,
        )

    def _capsule(self, length: float, r: float) -> None:
        self.at, self.half, self.radius = (0.5 * length, 0.0, 0.0), (0.5 * length, 0.0, 0.0), r
        straight = length / (length + 4.0 / 3.0 * r)
        ends = 1.0 - straight
        along = straight * r * r / 2.0 + ends * 0.4 * r * r
        across = straight * (r * r / 4.0 + length * length / 12.0)
        across += ends * (0.4 * r * r + length * length / 4.0 + 3.0 / 8.0 * length * r)
        self.inertia = (along, across, across, 0.0, 0.0, 0.0)

    def _cylinder(self, r: float, h: float) -> None:
        self.radius, self.rims = r, [(0.0, 0.0, side * 0.5 * h) for side in SIGNS]
        across = r * r / 4.0 + h * h / 12.0
        self.inertia = (across, across, r * r / 2.0, 0.0, 0.0, 0.0)

    def _disc(self, r: float) -> None:
        self.radius, self.rims = r, [(0.0, 0.0, 0.0)]
        self.inertia = (r * r / 4.0, r * r / 4.0, r * r / 2.0, 0.0, 0.0, 0.0)

    def _plane(self, *normal: float) -> None:
        size = hypot(*normal)
        self.normal = tuple(c / size for c in normal)

    def _hull(self, *numbers: float) -> None:
        found = hulls.Hull([numbers[k : k + 3] for k in range(0, len(numbers), 3)])
        self.corners, self.faces = found.corners, found.faces
        self.flats, self.edges = found.flats, found.edges
        self.at, self.inertia = found.centre, found.inertia

    def placed(self, at: Sequence[float], turn: Sequence[Vector]) -> None:
        """Turned by the matrix `turn`, rows, about the origin of its body, then moved."""

        def turned(v: Sequence[float]) -> Vector:
            return tuple(sum(a * b for a, b in zip(row, v, strict=True)) for row in turn)

        def moved(v: Sequence[float]) -> Vector:
            return tuple(a + b for a, b in zip(at, turned(v), strict=True))

        self.at, self.axes = moved(self.at), tuple(map(turned, self.axes))
        self.corners, self.rims = [*map(moved, self.corners)], [*map(moved, self.rims)]
        self.normal = self.normal and turned(self.normal)
        flats = [(turned(n), d) for n, d in self.flats]
        self.flats = [(n, d + sum(a * b for a, b in zip(n, at, strict=True))) for n, d in flats]

    @property
    def size(self) -> float:
        """The largest distance from its middle [m]."""
        if self.corners:
            return max(hypot(*(a - b for a, b in zip(p, self.at, strict=True))) for p in self.corners)
        if self.rims:
            return max(
                hypot(self.radius, *(a - b for a, b in zip(p, self.at, strict=True))) for p in self.rims
            )
        return self.radius + hypot(*(self.half or ())) + max(self.semi or (0.0,))

    def points(self) -> list[Vector]:
        """Corners of a hull or of half-lengths, in the axes of the body; of what has no length the middle alone."""
        if self.corners or self.half is None:
            return self.corners
        found = [self.at]
        for axis, half in zip(self.axes, self.half, strict=True):
            if half:
                found = [
                    tuple(a + side * half * b for a, b in zip(p, axis, strict=True))
                    for p in found
                    for side in SIGNS
                ]
        return found


def turn(rot: Sequence[float]) -> tuple[Vector, ...]:
    """The matrix of a rotation vector [rad], rows (Rodrigues)."""
    angle = hypot(*rot)
    if not angle:
        return UPRIGHT
    x, y, z = (c / angle for c in rot)
    c, s = cos(angle), sin(angle)
    k = 1.0 - c
    return (
        (c + k * x * x, k * x * y - s * z, k * x * z + s * y),
        (k * x * y + s * z, c + k * y * y, k * y * z - s * x),
        (k * x * z - s * y, k * y * z + s * x, c + k * z * z),
    )
