"""Where an ellipsoid meets a hull, a box or a capsule in space: one place of CONTACT, which moves over both.

    next to a flat n     gap = n . c - d - h(n)          h(n)^2 = sum (s_k n.e_k)^2, s_k its half-axes along e_k
    next to an edge      that of the edge, a point, and the ellipse that is seen along it           nearest.py
    next to a corner     that of the corner and the ellipsoid
An ellipsoid is nearest at one place alone, so that one of them is the distance: the one whose foot on the other solid is within
the walls of its region, as those of nearest.py; seen a length out along the normal, for which way that leans counts too.
"""

from __future__ import annotations

from .facets import Faceted
from .kinematics import add, dot, perpendicular, scale, subtract
from .laws import Edge
from .nearest import View, chosen, largest, meeting, on_ellipse, on_shadow, regions
from .supports import held_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Meeting, Part

    Way = Sequence[Scalar]
    # the gap, its normal, and the place of the other solid that is nearest
    Near = tuple[Expr, Way, Way]


class Oval:
    """An ellipsoid A in the axes of B's body."""

    def __init__(self, a: View, b: Faceted) -> None:
        self.s, semi = a.s, a.solid.semi
        assert semi is not None
        self.squares = [half * half for half in semi]
        self.axes = [b.turned(axis) for axis in a.axes]
        self.centre = b.local(a.centre)

    def shadow(self, one: Way, other: Way) -> Expr:
        """An element of its matrix: sum s_k^2 (e_k . one) (e_k . other)."""
        parts = [
            square * dot(axis, one) * dot(axis, other)
            for square, axis in zip(self.squares, self.axes, strict=True)
        ]
        return self.s.b.const(0.0) + parts[0] + parts[1] + parts[2]

    def foot(self, normal: Way) -> Way:
        """Its place that is furthest against a normal."""
        reach, found = self.s.b.call("sqrt", self.shadow(normal, normal)), self.centre
        for square, axis in zip(self.squares, self.axes, strict=True):
            found = subtract(found, scale(square * dot(axis, normal) / reach, axis))  # type: ignore[assignment]
        return found

    def at_flat(self, normal: Way, d: Scalar) -> Near:
        foot = self.foot(normal)
        gap = self.s.b.const(0.0) + dot(normal, foot) - d
        return gap, normal, subtract(foot, scale(gap, normal))

    def at_edge(self, q: Way, way: Way, across: tuple[Way, Way]) -> Near:
        away, (e, f) = subtract(self.centre, q), across
        p = [self.s.b.const(0.0) + dot(e, away), self.s.b.const(0.0) + dot(f, away)]
        gap, (x, y) = on_shadow(self.s, (self.shadow(e, e), self.shadow(e, f), self.shadow(f, f)), p)
        normal = add(scale(x, e), scale(y, f))
        return gap, normal, add(q, scale(dot(way, subtract(self.foot(normal), q)), way))

    def at_corner(self, q: Way) -> Near:
        away = subtract(self.centre, q)
        gap, parts = on_ellipse(
            self.s, self.squares, [self.s.b.const(0.0) + dot(axis, away) for axis in self.axes]
        )
        normal: Way = (0.0, 0.0, 0.0)
        for part, axis in zip(parts, self.axes, strict=True):
            normal = add(normal, scale(part, axis))
        return gap, normal, q


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """The one place at which an ellipsoid, A, can touch a hull, a box or a capsule."""
    one, other = View(s, a, own=True), Faceted(s, b)
    oval, size, label = Oval(one, other), other.solid.size, f"{one.name} {other.name}"
    places = regions(other.places, other.flats, other.edges)
    flats, edges = len(other.flats), len(other.edges)
    rows = [
        [*q, *way, *e, *f]
        for _, q, way, _, _ in places[flats : flats + edges]
        for e, f in [perpendicular(way)]
    ]
    beyond, ranked = [], []
    for k, (_, q, way, walls, _) in enumerate(places):
        if k < flats:
            gap, normal, foot = oval.at_flat(*other.flats[k])
        else:
            gap, normal, foot = (
                oval.at_edge(q, way, perpendicular(way)) if k < flats + edges else oval.at_corner(q)
            )
        out = add(foot, scale(size, normal))
        beyond.append(largest(s, [dot(w, out) - d for w, d in walls]))
        # an ellipsoid behind a flat is not next to it
        ranked.append(largest(s, [beyond[k], -gap]) if k < flats else beyond[k])
    best, name = ranked[0], s.b.const(1.0)
    for n, value in enumerate(ranked[1:], 2):
        more = s.b.call("notless", value, best)
        best, name = s.b.select(more, best, value), s.b.select(more, name, float(n))
    held = held_number(s, oval.centre[0], label)
    number = s.b.select(held, held, name)
    past = chosen(s, number, [(v,) for v in beyond])[0] - other.tiny
    found = oval.at_corner(chosen(s, number - float(flats + edges), other.places))
    row = chosen(s, number - float(flats), rows)
    found = _either(
        s, number - (flats + 0.5 + edges), found, oval.at_edge(row[:3], row[3:6], (row[6:9], row[9:]))
    )
    apart = best
    if flats:
        *normal, d = chosen(s, number, [(*n, d) for n, d in other.flats])
        found = _either(s, number - (flats + 0.5), found, oval.at_flat(normal, d))
        apart = largest(s, [oval.at_flat(*flat)[0] for flat in other.flats])
    gap, normal, foot = found
    # deep in each other no place is nearest
    lost = s.b.call("notless", best, 1e3 * other.tiny)
    gap = s.b.select(lost, apart, gap) - other.radius if flats else gap - other.radius
    stays = s.b.select(s.b.call("notless", 0.0, past), held, name)
    edge = Edge(held, s.b.select(held, stays, name), past)
    place = other.placed(oval.foot(normal))
    return [meeting(one, other, label, gap, other.world(normal), place, edge)]


def _either(s: Scene, above: Expr, one: Near, other: Near) -> Near:
    """The one where a number is above 0, else the other."""
    below = s.b.call("notless", 0.0, above)
    (gap, *ways), (far, *others) = one, other
    first, second = (
        [s.b.select(below, v, w) for v, w in zip(b, a, strict=True)]
        for a, b in zip(ways, others, strict=True)
    )
    return s.b.select(below, far, gap), first, second
