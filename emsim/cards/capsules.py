"""Where a capsule meets a hull, a box or a capsule in space: gaps and slips of CONTACT between shapes.

    end p of its line             gap = |p - q| - r              q what is next to p (nearest.py), r the radii
    line p + s a, a corner q      gap = |p + s a - q| - r        the place of the line that is next to q
    lines p + s a, q + t b        gap = |n . (p - q)| - r        n along a x b, where both s and t are within their ends
Every gap is one of two points of the parts, so none is less than the distance, and the least of them is it. Of corners and of
edges two at a time touch the line (facets.py).
"""

from __future__ import annotations

from .facets import Faceted, Line, leans, two_nearest
from .kinematics import add, dot, scale, subtract
from .nearest import NOTHING, Body, Target, chosen, largest, meeting
from .supports import AWAY

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Meeting, Part

    Way = Sequence[Scalar]


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a capsule can touch a hull, a box or a capsule: its ends, then what its line is nearest to."""
    one, other = Body(s, a), Faceted(s, b)
    return [*Target(s, b).ends(one), *_at_corners(one, other), *_at_edges(one, other)]


def _middle(a: Body, b: Faceted) -> Line:
    """A capsule's, in the axes of B."""
    return Line(b, b.local(a.corners[0]), b.turned(a.frame.direction(a.solid.axes[0])), a.solid.sizes[0])


def _at_corners(a: Body, b: Faceted) -> list[Meeting]:
    """A capsule's line at two corners of B."""
    s, line, label = a.s, _middle(a, b), f"{a.name} {b.name} corner"

    def off(corner: Sequence[Expr | float]) -> tuple[Way, Expr, Expr]:
        """From a corner to what of the line is next to it, how far, and how far that is past an end."""
        away = subtract(line.p, corner)
        along = -dot(line.u, away)
        away = add(away, scale(along, line.u))
        return (
            away,
            s.b.call("sqrt", s.b.const(NOTHING) + dot(away, away)),
            largest(s, [-along, along - line.length]),
        )

    every = [off(corner) for corner in b.places]
    scores = [s.b.select(s.b.call("notless", 0.0, past), far, AWAY) for _, far, past in every]
    found = []
    for n, (number, edge, can) in enumerate(
        two_nearest(s, label, line.p[0], scores, [past for *_, past in every]), 1
    ):
        corner = chosen(s, number, b.places)
        away, far, _ = off(corner)
        normal = b.world(scale(1.0 / far, away))
        place = add(b.placed(add(corner, away)), scale(-a.radius, normal))
        found.append(
            meeting(
                a, b, f"{label} {n}", s.b.select(can, far - a.radius - b.radius, AWAY), normal, place, edge
            )
        )
    return found


def _at_edges(a: Body, b: Faceted) -> list[Meeting]:
    """A capsule's line at two edges of B."""
    s, line, label = a.s, _middle(a, b), f"{a.name} {b.name} edge"
    every = [line.at(side) for side in b.sides]
    scores = [
        s.b.select(s.b.call("notless", 0.0, past), s.b.call("abs", gap), AWAY) for _, gap, past, _ in every
    ]
    found = []
    nearest = two_nearest(s, label, line.p[0], scores, [past for _, _, past, _ in every])
    for n, (number, edge, can) in enumerate(nearest[: len(every)], 1):
        normal, gap, _, first = line.at(chosen(s, number, b.sides))
        sign = s.b.select(s.b.call("notless", gap, 0.0), 1.0, -1.0)
        way = b.world(scale(sign, normal))
        place = add(b.placed(add(line.p, scale(first, line.u))), scale(-a.radius, way))
        shown = s.b.select(can, sign * gap - a.radius - b.radius, AWAY)
        found.append(meeting(a, b, f"{label} {n}", shown, way, place, edge))
    return found


def separation(s: Scene, a: Part, b: Part) -> Expr:
    """How far a capsule's line is beyond a hull, by a plane; below 0 it is in it."""
    one, other = Body(s, a), Faceted(s, b)
    line, places = _middle(one, other), [other.local(p) for p in one.corners]
    found = [-largest(s, [d - dot(n, at) for at in places]) for n, d in other.flats]
    for side in other.sides:
        normal, gap, _, _ = line.at(side)
        found.append(s.b.select(s.b.call("notless", leans(s, normal, side, []), 0.0), -AWAY, gap))
    return largest(s, found)
