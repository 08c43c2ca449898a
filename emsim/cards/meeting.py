"""Where two convex shapes meet, in the plane: gaps, the edges they are to, and slips, for CONTACT between shapes.

Two polygons touch where a corner of one is at an edge of the other, so each corner of each is one place of touch. With (u, v) a
corner of A in the axes of B and s_i = n_i . (u, v) - d_i its distances to the lines of B's edges:
    gap = max s_i     0 on the outline of B, below 0 inside, exact there; away from B's corners the distance
Edges that the corner does not face (n_i . m <= 0, m along its bisector into A) cannot press on it: where it is beyond one by
more than next to nothing it is off, else they count for nothing. That tells boxes of one width, on each other, from boxes side
by side.
A disc has one place, gap = |c - nearest point| - r, at an edge or, where the foot of c is beyond its end, at a corner of B.

Which edge it is, is asked anew at every point while the parts are apart, and held while they touch: equations are smooth then.
Where a corner passes the end of the edge the touch ends, an event; where the other part has a corner there, that one has come to
the end of the first one's edge at the same time, and takes over. A disc touches on: its gap is smooth there but for the
second derivative, and at that event its place is asked anew.
"""

from __future__ import annotations

from math import hypot

from .kinematics import dot, subtract
from .laws import Edge
from .nearest import chosen, largest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .shapes import Pair, Shape

    Part = tuple[str, str, Shape]


class Meeting:
    """One place of touch: gap [m], slip(s) [m/s] of A's part along B's with t = n x z, n from B to A; where it is held."""

    __slots__ = ("edge", "gap", "label", "slip")

    def __init__(self, label: str, gap: Expr, slip: Expr, edge: Edge | None = None) -> None:
        self.label, self.gap, self.slip, self.edge = label, gap, slip, edge


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which two shapes can touch; none is left out."""
    if a[2].radius and b[2].radius:
        return [_discs(s, a, b)]
    if b[2].radius:
        a, b = b, a
    if a[2].radius:
        return [_disc_on(s, a, b)]
    return [*_corners(s, a, b), *_corners(s, b, a)]


class View:
    """The axes of B, and edges of its shape: outward normals n, with n . p = d on them, from their first corner over `length`."""

    def __init__(self, s: Scene, b: Part) -> None:
        frame = s.frame(b[1])
        self.s, self.omega = s, frame.omega[2]
        self.x, self.y = frame.direction((1.0, 0.0, 0.0)), frame.direction((0.0, 1.0, 0.0))
        self.origin = frame.point((0.0, 0.0, 0.0)).pos
        edges = b[2].edges()
        self.corners = b[2].corners
        self.lengths = [hypot(q[0] - p[0], q[1] - p[1]) for p, q in edges]
        self.normals: list[Pair] = [
            ((q[1] - p[1]) / size, (p[0] - q[0]) / size)
            for (p, q), size in zip(edges, self.lengths, strict=True)
        ]
        self.offsets = [n[0] * p[0] + n[1] * p[1] for n, (p, _) in zip(self.normals, edges, strict=True)]

    def place(self, pos: Sequence[Scalar]) -> tuple[Expr, Expr]:
        """(u, v) of a place."""
        away = subtract(pos, self.origin)
        zero = self.s.b.const(0.0)
        return zero + dot(away, self.x), zero + dot(away, self.y)

    def turned(self, way: Sequence[Scalar]) -> tuple[Expr, Expr]:
        zero = self.s.b.const(0.0)
        return zero + dot(way, self.x), zero + dot(way, self.y)

    def distances(self, u: Expr, v: Expr) -> list[Expr]:
        return [n[0] * u + n[1] * v - d for n, d in zip(self.normals, self.offsets, strict=True)]


def _largest(s: Scene, values: Sequence[Expr], names: Sequence[Expr]) -> tuple[Expr, Expr]:
    """The largest value and its name, without an event."""
    best, name = values[0], names[0]
    for value, other in zip(values[1:], names[1:], strict=True):
        beyond = s.b.call("notless", value, best)
        best, name = s.b.select(beyond, value, best), s.b.select(beyond, other, name)
    return best, name


def _corners(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """Corners of A at edges of B."""
    view, frame = View(s, b), s.frame(a[1])
    count, tiny = len(view.normals), max(a[2].tiny, b[2].tiny)
    found = []
    corners = a[2].corners
    for k, at in enumerate(corners):
        u, v = view.place(frame.point((*at, 0.0)).pos)
        inward = view.turned(frame.direction((*_bisector(corners, k), 0.0)))
        reach, names = [], []
        for j, (n, distance) in enumerate(zip(view.normals, view.distances(u, v), strict=True), 1):
            faces = s.b.call("notless", n[0] * inward[0] + n[1] * inward[1], 0.0)
            off = s.b.select(s.b.call("notless", tiny, distance), -1e30, distance)  # none
            reach.append(s.b.select(faces, distance, off))
            names.append(s.b.select(faces, float(j), -float(j)))
        label = f"{a[0]} {k + 1} {b[0]}"
        best, name = _largest(s, reach, names)
        held = _held(s, u, v, label)
        number = s.b.select(held, held, s.b.call("abs", name))
        nx, ny, d = chosen(s, number, [(*n, c) for n, c in zip(view.normals, view.offsets, strict=True)])
        gap = nx * u + ny * v - d
        past = best - gap - tiny
        presses = s.b.select(s.b.call("notless", name, 0.0), name, 0.0)
        stays = s.b.select(s.b.call("notless", 0.0, past), held, presses)
        edge = Edge(held, s.b.select(held, stays, presses), past)
        slip = ny * s.rate(u) - nx * s.rate(v)
        found.append(Meeting(label, gap, slip, edge if count else None))
    return found


def _held(s: Scene, u: Expr, v: Expr, label: str) -> Expr:
    """A number that goes with a law's mode; what stands for its condition is never met."""
    return s.b.flag(s.public(-1.0 - u * u - v * v), None, f"{label} edge", law="kept")


def separation(s: Scene, a: Part, b: Part) -> Expr:
    """How far two polygons are apart by the line of one of their edges; below 0 they are in each other, crossed ones too."""
    widest = []
    for one, other in ((a, b), (b, a)):
        view, frame = View(s, other), s.frame(one[1])
        places = [view.place(frame.point((*at, 0.0)).pos) for at in one[2].corners]
        for beyond in zip(*(view.distances(u, v) for u, v in places), strict=True):
            behind, _ = _largest(s, [-e for e in beyond], beyond)
            widest.append(-behind)
    return _largest(s, widest, widest)[0]


def _bisector(corners: list[Pair], k: int) -> Pair:
    """From a corner into its shape."""
    x, y = corners[k]
    found = [0.0, 0.0]
    for p, q in (corners[k - 1], corners[(k + 1) % len(corners)]):
        size = hypot(p - x, q - y)
        found = [found[0] + (p - x) / size, found[1] + (q - y) / size]
    size = hypot(*found)
    return found[0] / size, found[1] / size


def _disc_on(s: Scene, a: Part, b: Part) -> Meeting:
    """A disc at edges and corners of B: 1..N are edges, N+1..2N the corners at which they begin."""
    view, frame, r = View(s, b), s.frame(a[1]), a[2].radius
    u, v = view.place(frame.point((*a[2].centre, 0.0)).pos)
    count, tiny = len(view.normals), max(a[2].tiny, b[2].tiny)
    names, edges, ends = [], [], []
    for j, (n, corner, length) in enumerate(zip(view.normals, view.corners, view.lengths, strict=True)):
        begin, end = count + 1.0 + j, count + 1.0 + (j + 1) % count
        along = n[0] * (v - corner[1]) - n[1] * (u - corner[0])
        on = s.b.select(s.b.call("notless", length, along), j + 1.0, end)
        names.append(s.b.select(s.b.call("notless", along, 0.0), on, begin))
        edges.append((largest(s, [-along, along - length]), *n, view.offsets[j], 0.0, 0.0))
        ends.append((along, length - along))
    corners = [
        (largest(s, [ends[j][0], ends[j - 1][1]]), 0.0, 0.0, 0.0, *p) for j, p in enumerate(view.corners)
    ]
    _, name = _largest(s, view.distances(u, v), names)
    label = f"{a[0]} {b[0]}"
    held, last = _held(s, u, v, label), s.b.memory(f"{label} place")
    s.b.keep(last, s.public(name))
    # (round: no slope goes by how much the number is)
    number = s.b.select(held * last, s.b.call("round", last), name)
    past, nx, ny, d, to_x, to_y = chosen(s, number, [*edges, *corners])
    at_corner = s.b.call("notless", number, count + 0.5)
    # turns where the place does, and a little beyond, so that its name is another: the normal has turned by that over r then
    past -= 0.01 * tiny
    turns = s.b.select(held, s.b.select(at_corner, -past, past), -1.0)
    s.b.flag(s.public(turns), None, f"{label} at a corner", -1)
    across = s.b.call("hypot", u - to_x, v - to_y)
    gap = s.b.select(at_corner, across, nx * u + ny * v - d) - r
    across_x = s.b.select(at_corner, (u - to_x) / across, nx)
    across_y = s.b.select(at_corner, (v - to_y) / across, ny)
    slip = across_y * s.rate(u) - across_x * s.rate(v) + r * (frame.omega[2] - view.omega)
    return Meeting(label, gap, slip, Edge(held, s.b.const(1.0), s.b.const(-1.0)))


def _discs(s: Scene, a: Part, b: Part) -> Meeting:
    one, other = (s.frame(part[1]).point((*part[2].centre, 0.0)) for part in (a, b))
    away, moving = subtract(one.pos, other.pos), subtract(one.vel, other.vel)
    distance = s.b.call("hypot", s.b.const(0.0) + away[0], away[1])
    nx, ny = away[0] / distance, away[1] / distance
    rim = a[2].radius * s.frame(a[1]).omega[2] + b[2].radius * s.frame(b[1]).omega[2]
    slip = ny * moving[0] - nx * moving[1] + rim
    return Meeting(f"{a[0]} {b[0]}", distance - (a[2].radius + b[2].radius), slip)
