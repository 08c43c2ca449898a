"""Where a capsule meets a cylinder or a thin disc in space: gaps and slips of CONTACT between shapes.

    end p of its line        gap = |p - q| - r                  q what is next to p (nearest.py), r the capsule's radius
    its line at the side     gap = |n . (p - c)| - R - r        n across it and the axis, where they are nearest within all ends
    its line at a rim        the rim is an ellipse where one looks along the line, and that a point        nearest.py
    a line that lies flat    gap = |a . (p - c)| - r            a the axis; the two places p at which it crosses the rim
Every gap is one of two points of the parts, so none is less than the distance, and the least of them is it.
"""

from __future__ import annotations

from .kinematics import add, dot, scale
from .nearest import NOTHING, PARALLEL, Target, View, largest, meeting, root
from .supports import FLAT, Meeting, within

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Part

    Way = Sequence[Scalar]


class Lying:
    """A capsule A and a cylinder B in the axes of A, its line along the first: the direction k of B's axis, its middle c."""

    def __init__(self, s: Scene, a: Part, b: Part) -> None:
        self.s, self.a, self.b = s, View(s, a, own=True), View(s, b, own=True)
        self.half, self.r, self.big = 0.5 * self.a.solid.sizes[0], self.a.radius, self.b.radius
        self.k = self.a.turned(self.b.axes[2])
        self.c = self.a.local(self.b.centre)

    def touch(self, label: str, far: Expr, normal: Way, along: Expr, past: Sequence[Scalar]) -> Meeting:
        """The line, `along` from its middle, is `far` off along a normal to it, and only where none of `past` is above 0."""
        s = self.s
        past = [*past, s.b.call("abs", along) - self.half]
        gap, edge = within(s, f"{self.a.name} {self.b.name} {label}", far - self.r, largest(s, past))
        place = add(self.a.placed([along, 0.0, 0.0]), self.a.world(scale(-self.r, normal)))
        return meeting(
            self.a, self.b, f"{self.a.name} {self.b.name} {label}", gap, self.a.world(normal), place, edge
        )

    def at_side(self) -> Meeting:
        """n = (0, kz, -ky) is across both."""
        s, (kx, ky, kz), (cx, cy, cz) = self.s, self.k, self.c
        square = ky * ky + kz * kz + PARALLEL**4
        size = s.b.call("sqrt", square)
        off = (ky * cz - kz * cy) / size
        sign = s.b.select(s.b.call("notless", off, 0.0), 1.0, -1.0) / size
        # where they are nearest: on the axis so far from its middle, and on the line
        up = -(ky * cy + kz * cz) / square
        high = s.b.call("abs", up) - 0.5 * self.b.solid.sizes[1]
        normal = [s.b.const(0.0), sign * kz, -sign * ky]
        return self.touch(
            "side", s.b.call("abs", off) - self.big, normal, cx + kx * up, [high, PARALLEL**2 - square]
        )

    def at_rim(self, number: int, up: float) -> list[Meeting]:
        """One whose middle is `up` along the axis."""
        s, k, big = self.s, self.k, self.big
        kx, ky, kz = k
        c = [a + up * b for a, b in zip(self.c, k, strict=True)]
        square = big * big
        lean = s.b.call("abs", kx)
        # how near the line comes to the axis, seen along that, and how far it is above the rim, where it lies flat
        along = -dot(c, k)
        flat_c = [-(a + along * b) for a, b in zip(c, k, strict=True)]
        one = 1.0 - kx * kx
        middle = -flat_c[0]
        least = square * one - (dot(flat_c, flat_c) * one - middle * middle)
        # above 0 where it lies flat over the rim
        lies = -largest(s, [lean - FLAT, -least])
        # its half-axes are R across the axis as it is seen, and R |kx| along that, next to nothing where it lies flat
        width = square * FLAT**3
        thin, wide = square * kx * kx + width, square + width

        def times(v: Way) -> Way:
            seen = ky * v[0] + kz * v[1]
            return [wide * v[0] - square * seen * ky, wide * v[1] - square * seen * kz]

        def by(t: Scalar, v: Way) -> Way:
            more = square * (ky * v[0] + kz * v[1]) / (thin + t)
            return [(v[0] + more * ky) / (wide + t), (v[1] + more * kz) / (wide + t)]

        far, (y, z) = root(s, by, times, [-c[1], -c[2]], (thin, wide))
        over = ky * y + kz * z
        out = (kx, ky - over * y, kz - over * z)
        reach = s.b.call("sqrt", NOTHING + dot(out, out))
        found = [
            self.touch(f"rim {number}", far, [s.b.const(0.0), y, z], c[0] - big * kx * over / reach, [lies])
        ]
        half = s.b.call("sqrt", largest(s, [least, NOTHING]))
        for side in (-1.0, 1.0):
            at = (middle + side * half) / largest(s, [one, FLAT])
            high = along + kx * at
            sign = s.b.select(s.b.call("notless", high, 0.0), 1.0, -1.0)
            label = f"rim {number} {'out' if side > 0.0 else 'in'}"
            found.append(self.touch(label, sign * high, scale(sign, k), at, [-lies]))
        return found


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a capsule, A, can touch a cylinder or a disc; none is left out."""
    lying = Lying(s, a, b)
    found = Target(s, b).ends(lying.a)
    if lying.b.solid.kind == "cylinder":
        found.append(lying.at_side())
    rims = (
        [(up, k) for k, up in enumerate((-0.5, 0.5), 1)] if lying.b.solid.kind == "cylinder" else [(0.0, 1)]
    )
    for up, k in rims:
        found += lying.at_rim(k, up * lying.b.solid.sizes[-1])
    return found
