"""Where hulls and boxes meet in space: gaps and slips of CONTACT between shapes.

    corner p at a flat of the other        gap = n . p - d       the flat that p is furthest beyond, of those that it can press on
    edges p + s a, q + t b                 gap = n . (p - q)     n along a x b
Edges touch where both s and t are within their ends and n is a normal of both: it turns away from the flats beside each. An edge
can cross the outline of a flat twice: two at a time of the other's touch it. What lies beyond an edge's end cannot touch (AWAY):
as in the plane (meeting.py) a touch that comes there ends, an event, and what has the other part's corner there takes over.
Which flat or edges it is, is asked anew while parts are apart, and held while they touch.
"""

from __future__ import annotations

from .hulls import Hull, crossed
from .kinematics import add, cross, dot, scale, subtract
from .laws import Edge
from .nearest import PARALLEL, View, chosen, largest, meeting
from .supports import AWAY, held_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .hulls import Flat, Vector
    from .solids import Solid
    from .supports import Meeting, Part

    Way = Sequence[Scalar]


def facets(solid: Solid) -> tuple[Sequence[Vector], Sequence[Flat], Sequence[Sequence[int]]]:
    """Corners, flats and edges of a hull or a box; of a capsule's line its ends and itself."""
    if solid.half and not all(solid.half):
        return solid.points(), [], [(0, 1)]
    found = Hull(solid.points()) if solid.half else solid
    return found.corners, found.flats, found.edges


class Faceted(View):
    """A hull or a box, seen in the axes of its body; a capsule's line as one of no flats."""

    def __init__(self, s: Scene, part: Part) -> None:
        super().__init__(s, part)
        self.places, self.flats, self.edges = facets(self.solid)
        self.tiny = 1e-9 * self.solid.size
        # of each edge: where it begins, its direction, its length, and the ways into both flats beside it
        self.sides: list[list[float]] = []
        for a, b, *both in self.edges:
            p, q = self.places[a], self.places[b]
            length = sum((v - u) ** 2 for u, v in zip(p, q, strict=True)) ** 0.5
            way = tuple((v - u) / length for u, v in zip(p, q, strict=True))
            into = [0.0] * 6
            if both:
                left, right = (self.flats[k][0] for k in both)
                into = [*crossed(left, way), *crossed(way, right)]
            self.sides.append([*p, *way, length, *into])


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a hull or a box and one of them can touch."""
    one, other = Faceted(s, a), Faceted(s, b)
    if len(one.edges) > len(other.edges):
        one, other = other, one
    found = [_on_flat(one, other, k) for k in range(len(one.places))]
    found += [_on_flat(other, one, k) for k in range(len(other.places))]
    apart = largest(s, [*_apart(one, other), *_apart(other, one)]) - max(one.tiny, other.tiny)
    for k in range(len(one.edges)):
        found += _crossings(one, other, k, apart)
    return found


def separation(s: Scene, a: Part, b: Part) -> Expr:
    """How far they are apart by a plane; below 0 they are in each other, crossed ones too of which no corner is inside."""
    one, other = Faceted(s, a), Faceted(s, b)
    found = [*_apart(one, other), *_apart(other, one)]
    for k in range(len(one.edges)):
        line, into = _edge(one, other, k)
        for side in other.sides:
            normal, gap, _, _ = line.at(side)
            off = s.b.call("notless", leans(s, normal, side, into), 0.0)
            found.append(s.b.select(off, -AWAY, gap))
    return largest(s, found)


def _edge(a: Faceted, b: Faceted, k: int) -> tuple[Line, Sequence[Way]]:
    """Of A, in the axes of B: its line, and the ways into the flats beside it."""
    side = a.sides[k]
    u, *into = (b.turned(a.world(side[j : j + 3])) for j in (3, 7, 10))
    return Line(b, b.local(a.placed(side[:3])), u, side[6]), into


def leans(s: Scene, normal: Way, side: Sequence[float | Expr], into: Sequence[Way]) -> Expr:
    """By how much a normal leans over a flat of either, at an edge of B and one of A; less than 1e-7 rad are level with it."""
    zero = s.b.const(0.0)
    beside = [zero + dot(normal, side[7:10]), zero + dot(normal, side[10:13])]
    return largest(s, [*beside, *(zero - dot(normal, way) for way in into)]) - 1e-7


def _apart(a: Faceted, b: Faceted) -> list[Expr]:
    """How far A is beyond each flat of B."""
    places = [b.local(a.placed(p)) for p in a.places]
    return [-largest(a.s, [d - dot(n, at) for at in places]) for n, d in b.flats]


def _on_flat(a: Faceted, b: Faceted, k: int) -> Meeting:
    """A corner of A at a flat of B."""
    s, p = a.s, a.placed(a.places[k])
    label, tiny = f"{a.name} {k + 1} {b.name}", max(a.tiny, b.tiny)
    at, inward = b.local(p), b.turned(subtract(a.centre, p))
    best, name = s.b.const(-AWAY), s.b.const(0.0)
    for j, (n, d) in enumerate(b.flats, 1):
        distance = dot(n, at) - d
        # a flat that the corner does not turn to counts where it is beyond alone: then it is off
        faces = s.b.call("notless", s.b.const(0.0) + dot(n, inward), 0.0)
        off = s.b.select(s.b.call("notless", tiny, distance), -AWAY, distance)
        value = s.b.select(faces, distance, off)
        further = s.b.call("notless", value, best)
        name = s.b.select(further, s.b.select(faces, float(j), -float(j)), name)
        best = s.b.select(further, value, best)
    held = held_number(s, at[0], label)
    number = s.b.select(held, held, s.b.call("abs", name))
    *normal, far = chosen(s, number, [(*n, d) for n, d in b.flats])
    gap = dot(normal, at) - far
    past = best - gap - tiny
    presses = s.b.select(s.b.call("notless", name, 0.0), name, 0.0)
    stays = s.b.select(s.b.call("notless", 0.0, past), held, presses)
    edge = Edge(held, s.b.select(held, stays, presses), past)
    return meeting(a, b, label, gap, b.world(normal), p, edge)


class Line:
    """Of A, in the axes of B's body: through `p` along the unit vector `u`, `length` long."""

    def __init__(self, b: Faceted, p: Way, u: Way, length: float) -> None:
        self.s, self.b, self.p, self.u, self.length = b.s, b, p, u, length

    def at(self, side: Sequence[Expr | float]) -> tuple[Way, Expr, Expr, Expr]:
        """At an edge of B: their common normal, which is one of B at its edge, the gap along it, how far where they are nearest
        is past an end, above 0 too where they are parallel, and where that is on the line."""
        s, q, v, length = self.s, side[:3], side[3:6], side[6]
        n = cross(self.u, v)
        square = s.b.const(PARALLEL**4) + dot(n, n)
        away = subtract(self.p, q)
        between, along_u, along_v = dot(self.u, v), dot(self.u, away), dot(v, away)
        first = (between * along_v - along_u) / square
        second = along_v + between * first
        past = largest(s, [-first, first - self.length, -second, second - length])
        apart = s.b.call("notless", square, PARALLEL**2)
        # of both signs that which turns more away from the flats
        into = s.b.const(0.0) + dot(n, add(side[7:10], side[10:13]))
        size = s.b.select(s.b.call("notless", 0.0, into), 1.0, -1.0) / s.b.call("sqrt", square)
        normal = scale(size, n)
        return normal, s.b.const(0.0) + dot(normal, away), s.b.select(apart, past, AWAY), first


def two_nearest(
    s: Scene, label: str, size: Scalar, scores: Sequence[Expr], pasts: Sequence[Expr]
) -> list[tuple[Expr, Edge, Expr]]:
    """Of features by their scores, AWAY those that are none: the least two, or those that are held. Of each its number from 1 on,
    how that is held, and whether it can be touched."""
    helds = [held_number(s, s.b.const(0.0) + size, f"{label} {k}") for k in (1, 2)]
    other, found = helds[1], []
    for held in helds:
        best, name = s.b.const(AWAY), s.b.const(1.0)
        for j, score in enumerate(scores, 1):
            beside = s.b.call("notless", s.b.call("abs", other - float(j)), 0.5)
            less = s.b.select(beside, s.b.call("notless", score, best), 1.0)
            best, name = s.b.select(less, best, score), s.b.select(less, name, float(j))
        number = s.b.select(held, held, name)
        past = chosen(s, number, [(p,) for p in pasts])[0]
        opens = s.b.select(s.b.call("notless", best, AWAY), 0.0, name)
        stays = s.b.select(s.b.call("notless", 0.0, past), held, 0.0)
        can = s.b.select(held, stays, opens)
        found.append((number, Edge(held, can, past), s.b.select(held, 1.0, can)))
        other = s.b.select(held, held, opens)
    return found


def _crossings(a: Faceted, b: Faceted, k: int, apart: Expr) -> list[Meeting]:
    """An edge of A at two of B's. What is deeper than flats are `apart` lies one beside the other, and does not touch."""
    s, label = a.s, f"{a.name} {k + 1} edge {b.name}"
    line, into = _edge(a, b, k)
    scores, pasts = [], []
    for other in b.sides:
        normal, gap, past, _ = line.at(other)
        off = largest(s, [past, leans(s, normal, other, into), apart - gap])
        scores.append(s.b.select(s.b.call("notless", 0.0, off), -gap, AWAY))
        pasts.append(past)
    found = []
    for n, (number, edge, can) in enumerate(two_nearest(s, label, line.p[0], scores, pasts), 1):
        normal, gap, _, first = line.at(chosen(s, number, b.sides))
        place = b.placed(add(line.p, scale(first, line.u)))
        shown = s.b.select(can, gap, AWAY)
        found.append(meeting(a, b, f"{label} {n}", shown, b.world(normal), place, edge))
    return found
