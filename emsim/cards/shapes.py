"""Shapes of bodies, in the plane: what is drawn, weighed and touched. All are convex; corners run counter-clockwise.

    rod(l[,w])           along +x from the origin; without w it has no thickness, and nothing touches it
    box(w,h[,d])         about the origin; d along z
    polygon(x1,y1,..)    through these corners
    disc(r)              about the origin
and those of solids.py, which a machine has that leaves the plane: there boxes with d and discs are such too.

Inertia by mass about the centre of mass, for a polygon by triangles 0, p, q of area c/2, c = p x q:
    integral x^2 = c (xp^2 + xp xq + xq^2)/12,  integral x y = c (2 xp yp + xp yq + xq yp + 2 xq yq)/24
"""

from __future__ import annotations

from math import cos, hypot, sin

from ..diagnostics import suggest
from . import solids
from .base import is_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink, Span

    Pair = tuple[float, float]

# how many sizes each takes
KINDS: dict[str, tuple[int, int]] = {
    "rod": (1, 2),
    "box": (2, 3),
    "disc": (1, 1),
    "polygon": (6, 1000),
    **solids.KINDS,
}


class Shape:
    """`corners` [m] in the axes of the body, none of a disc; `inertia` Jxx Jyy Jzz Jxy Jxz Jyz by mass [m^2] about `centre`.
    `solid`: what it is in space, None of what has no depth; `leaves_plane`: is it that alone?"""

    __slots__ = ("centre", "corners", "inertia", "kind", "leaves_plane", "radius", "sizes", "solid")

    def __init__(self, kind: str, sizes: list[float]) -> None:
        self.kind, self.sizes, self.radius = kind, sizes, 0.0
        self.corners: list[Pair] = []
        self.centre: tuple[float, ...] = (0.0, 0.0)
        self.inertia: tuple[float, ...]
        self.leaves_plane = kind in solids.KINDS
        deep = kind == "disc" or (kind == "box" and len(sizes) == 3 and min(sizes) > 0.0)
        self.solid = solids.Solid(kind, sizes) if self.leaves_plane or deep else None
        if self.leaves_plane:
            assert self.solid is not None
            self.centre, self.inertia = self.solid.at, self.solid.inertia
            return
        a, b = sizes[0], sizes[1] if len(sizes) > 1 else 0.0
        if kind == "disc":
            self.radius = a
            self.inertia = (a * a / 4.0, a * a / 4.0, a * a / 2.0, 0.0)
        elif kind == "polygon":
            self.corners = [*zip(sizes[::2], sizes[1::2], strict=True)]
            self._weigh()
        else:
            x = 0.0 if kind == "rod" else -0.5 * a
            self.centre = (x + 0.5 * a, 0.0)
            self.corners = [(x, -0.5 * b), (x + a, -0.5 * b), (x + a, 0.5 * b), (x, 0.5 * b)]
            jx, jy = b * b / 12.0, a * a / 12.0
            self.inertia = (jx, jy, jx + jy, 0.0) if self.solid is None else self.solid.inertia

    def _weigh(self) -> None:
        """Centre and inertia of a polygon; its corners counter-clockwise."""
        if self.area() < 0.0:
            self.corners.reverse()
        x0, y0 = self.corners[0]
        area = x = y = xx = yy = xy = 0.0
        for (xp, yp), (xq, yq) in self.edges():
            xp, yp, xq, yq = xp - x0, yp - y0, xq - x0, yq - y0
            c = xp * yq - xq * yp
            area += c / 2.0
            x, y = x + c * (xp + xq) / 6.0, y + c * (yp + yq) / 6.0
            xx += c * (xp * xp + xp * xq + xq * xq) / 12.0
            yy += c * (yp * yp + yp * yq + yq * yq) / 12.0
            xy += c * (2.0 * xp * yp + xp * yq + xq * yp + 2.0 * xq * yq) / 24.0
        if area:
            x, y = x / area, y / area
            jx, jy = yy / area - y * y, xx / area - x * x
            self.centre, self.inertia = (x0 + x, y0 + y), (jx, jy, jx + jy, x * y - xy / area)

    def edges(self) -> list[tuple[Pair, Pair]]:
        return [*zip(self.corners, [*self.corners[1:], *self.corners[:1]], strict=True)]

    def area(self) -> float:
        """[m^2], below 0 where corners run clockwise."""
        return sum(p[0] * q[1] - q[0] * p[1] for p, q in self.edges()) / 2.0

    @property
    def size(self) -> float:
        """The largest distance from its centre [m]."""
        x, y = self.centre[:2]
        return max((hypot(p - x, q - y) for p, q in self.corners), default=self.radius)

    @property
    def tiny(self) -> float:
        """What nobody sees of it, and is more than rounding [m]: corners stand out by more, touches reach so far beyond edges."""
        return 1e-9 * self.size

    def is_convex(self) -> bool:
        n, least = len(self.corners), self.tiny * self.size
        around = [*self.corners, *self.corners[:2]]
        turns = [
            (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
            for a, b, c in (around[k : k + 3] for k in range(n))
        ]
        # a star that goes round twice turns left everywhere too
        fan = [
            (b[0] - around[0][0]) * (c[1] - around[0][1]) - (b[1] - around[0][1]) * (c[0] - around[0][0])
            for b, c in (around[k : k + 2] for k in range(1, n - 1))
        ]
        return all(turn > least for turn in turns) and all(c > 0.0 for c in fan)

    def placed(self, at: tuple[float, ...], angle: float, rot: tuple[float, ...] | None = None) -> Shape:
        """Turned by `angle` [rad] about z, or by the rotation vector `rot` [rad], about the origin, then moved."""
        c, s = cos(angle), sin(angle)
        found = Shape(self.kind, self.sizes)
        found.corners = [(at[0] + c * x - s * y, at[1] + s * x + c * y) for x, y in found.corners]
        x, y = self.centre[:2]
        found.centre = (at[0] + c * x - s * y, at[1] + s * x + c * y)
        if found.solid is not None:
            found.solid.placed((*at, 0.0)[:3], solids.turn((0.0, 0.0, angle) if rot is None else rot))
        found.leaves_plane |= rot is not None or any(at[2:])
        return found


FORM = (
    "rod(l), box(w,h[,d]), disc(r), polygon(x1,y1,..), or in space ball(r), capsule(l,r), cylinder(r,h), "
    "ellipsoid(a,b,c), hull(x1,y1,z1,..) or plane(nx,ny,nz)"
)


def read(value: Any, what: str, place: Span, sink: Sink) -> Shape | None:
    """What `box(1,2)` is, a call or a word with numbers; None after an error."""
    name = getattr(value, "fn", None) or getattr(value, "name", None)
    args = getattr(value, "args", None) or getattr(value, "point", None) or ()
    numbers = [getattr(a, "value", a) for a in args]
    if name not in KINDS:
        near = suggest(name, KINDS) if name else None
        said = f"shape= of {what}" if what.startswith("BODY") else f"the shape of {what}"
        sink.error(
            "E232",
            f"{said} is {FORM}" + (f"; there is no `{name}`" if name else ""),
            place,
            f"did you mean {near}(..)?" if near else "of another shape give m=, j= and com=",
        )
        return None
    said, hint = _wrong(name, numbers), None
    if not said:
        shape = _made(name, numbers)
        if not isinstance(shape, str):
            return shape
        said = shape
        if name == "polygon":
            hint = "put it together of convex ones: SHAPE name body polygon(..)"
    sink.error("E232", said.replace("(..)", f"(..) of {what}", 1), place, hint)
    return None


def _wrong(name: str, numbers: list[Any]) -> str:
    """What is wrong with its numbers, or ""."""
    low, high = KINDS[name]
    finite = all(is_number(v) and abs(v) < float("inf") for v in numbers)
    if name == "polygon":
        if not finite or len(numbers) < low or len(numbers) % 2:
            return "polygon(..) takes the x and y of three corners or more, in metres"
    elif name == "hull":
        if not finite or not low <= len(numbers) <= high or len(numbers) % 3:
            return f"hull(..) takes the x, y and z of 4 to {high // 3} corners, in metres"
    elif name == "plane":
        if not finite or len(numbers) != low or not any(numbers):
            return "plane(..) takes the three components of its normal, such as plane(0,1,0)"
    elif not low <= len(numbers) <= high or not finite or numbers[0] <= 0.0 or min(numbers) < 0.0:
        many = f"{low} to {high} sizes" if low != high else f"{low} size" + "s" * (low > 1)
        return f"{name}(..) takes {many} in metres, greater than zero"
    elif name in solids.KINDS and min(numbers) <= 0.0:
        return f"{name}(..) takes sizes in metres, greater than zero"
    return ""


def _made(name: str, numbers: list[float]) -> Shape | str:
    """The shape, or what is wrong with it."""
    try:
        shape = Shape(name, numbers)
    except ValueError as error:
        return f"hull(..) has no inside: {error}"
    if name == "polygon" and not shape.is_convex():
        return "polygon(..) is not convex, or has corners that are none"
    return shape
