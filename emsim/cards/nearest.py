"""What of a convex solid is next to a place p in space, and how far off: signed distances that are smooth where they can be.

    cylinder, disc of radius R     p - q = the part of p beyond R, and that beyond the ends along its axis
    ellipsoid, ellipse             q = M (M + t)^-1 p,  t the largest root of  q . M^-1 q = 1       M = diag(s_k^2) in its axes
    hull                           next to a flat n: n . p - d;  to an edge, to a corner: |p - q|
t is found by Newton's method for 1 - 1/|M^(1/2) z|, z = (M + t)^-1 p, which is concave and nearly straight (Hebden 1973, as in
the trust regions of More and Sorensen 1983): from a bound below it goes up to the root and never beyond. Its last step alone is
differentiated; with the normal n = z/|z| of the root the distance is n . p - (n . M n)^(1/2), the largest of all n, so that what
t is wrong by counts squared.
Each flat, edge and corner of a hull is next to the places of its own region outside; the least outside of its own is the one.
"""

from __future__ import annotations

from math import hypot

from .hulls import crossed
from .kinematics import add, dot, perpendicular, scale, subtract
from .laws import Edge
from .resisting import turning
from .solids import UPRIGHT
from .supports import Meeting, along, held_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .hulls import Flat, Vector
    from .supports import Part

    Way = Sequence[Scalar]
    Wall = tuple[Sequence[float], float]
    Region = tuple[float, Sequence[float], Sequence[float], list[Wall], set[int]]
    # how far off [m], which way that is, in world axes, and how it is held
    Found = tuple[Expr, Way, Edge | None]


NOTHING = 1e-30  # [m^2] keeps a slope where a middle line is in the other part
PARALLEL = 1e-5  # [rad] edges that lie so have no crossing; their corners touch
POLE = (
    0.36,
    -0.48,
    0.8,
)  # a direction of no axis, against which no normal points: of it turned to the normal slips are measured


class Body:
    """A solid where it is in world axes: its middle, and `corners`, of what has none its middle or the ends of its line."""

    def __init__(self, s: Scene, part: Part) -> None:
        self.s, (self.name, body, self.solid) = s, part
        self.frame = s.frame(body)
        self.radius = self.solid.radius
        self.centre = self.frame.point(_three(self.solid.at)).pos
        self.corners = [self.frame.point(_three(p)).pos for p in self.solid.points()]


class View(Body):
    """A solid seen in axes that move with it: `own`, from its middle, or those of its body."""

    def __init__(self, s: Scene, part: Part, own: bool = False) -> None:
        super().__init__(s, part)
        self.axes = [self.frame.direction(axis) for axis in (self.solid.axes if own else UPRIGHT)]
        self.origin = self.centre if own else self.frame.point((0.0, 0.0, 0.0)).pos

    def turned(self, way: Way) -> list[Expr]:
        """A direction in these axes."""
        return [self.s.b.const(0.0) + dot(axis, way) for axis in self.axes]

    def local(self, p: Way) -> list[Expr]:
        """A place in them."""
        return self.turned(subtract(p, self.origin))

    def world(self, way: Way) -> Way:
        """A direction of these axes in the world's."""
        found: Way = (0.0, 0.0, 0.0)
        for part, axis in zip(way, self.axes, strict=True):
            found = add(found, scale(part, axis))
        return found

    def placed(self, p: Way) -> Way:
        """A place of these axes in the world."""
        return add(self.origin, self.world(p))


class Target(View):
    """A solid to which places are near; seen in its own axes, a hull in those of its body."""

    def __init__(self, s: Scene, part: Part) -> None:
        super().__init__(s, part, not part[2].flats)

    def near(self, p: Way, label: str) -> Found:
        """Of a place in world axes."""
        if self.solid.semi is not None:
            gap, normal = on_ellipse(self.s, [half * half for half in self.solid.semi], self.local(p))
            return gap, self.world(normal), None
        if self.solid.half is not None:
            return self._block(p, label)
        return self._hull(p, label) if self.solid.flats else self._cylinder(p, label)

    def ends(self, a: Body) -> list[Meeting]:
        """Corners of a block with a radius at what is next to them."""
        found = []
        for k, p in enumerate(a.corners, 1):
            label = f"{a.name} {k} {self.name}"
            gap, normal, edge = self.near(p, label)
            place = add(p, scale(-a.radius, normal))
            found.append(meeting(a, self, label, gap - a.radius, normal, place, edge))
        return found

    def _beyond(self, u: Expr, half: float, label: str) -> Expr:
        """How far a place along an axis is beyond an end, 0 between them; these are events."""
        if not half:
            return u
        over = self.s.b.flag(self.s.public(u - half), None, f"{label} over", -1)
        under = self.s.b.flag(self.s.public(-half - u), None, f"{label} under", -1)
        return self.s.b.select(over, u - half, self.s.b.select(under, u + half, 0.0))

    def _off(self, away: Way, less: float = 0.0) -> Found:
        distance = self.s.b.call("sqrt", self.s.b.const(NOTHING) + dot(away, away))
        return distance - less, self.world(scale(1.0 / distance, away)), None

    def _block(self, p: Way, label: str) -> Found:
        """Next to what is within half-lengths: to the middle of a ball, the line of a capsule, a box."""
        half = self.solid.half or ()
        away = [
            self._beyond(u, h, f"{label} {k}")
            for k, (u, h) in enumerate(zip(self.local(p), half, strict=True), 1)
        ]
        return self._off(away, self.solid.radius)

    def _cylinder(self, p: Way, label: str) -> Found:
        """Next to its side, its ends, its rims; inside of it nothing is."""
        s, (x, y, z), r = self.s, self.local(p), self.solid.radius
        square = x * x + y * y
        out = s.b.flag(s.public(square - r * r), None, f"{label} out", -1)
        share = s.b.select(out, 1.0 - r / s.b.call("sqrt", square + NOTHING), 0.0)
        half = 0.5 * self.solid.sizes[1] if len(self.solid.rims) > 1 else 0.0
        return self._off([share * x, share * y, self._beyond(z, half, label)])

    def _hull(self, p: Way, label: str) -> Found:
        """Flats, then edges, then corners, by their numbers from 1 on."""
        s, solid = self.s, self.solid
        at = self.local(p)
        places = regions(solid.corners, solid.flats, solid.edges)
        above = [dot(n, at) - d for n, d in solid.flats]
        beyond = []
        for *_, walls, flats in places:
            under = -largest(s, [above[k] for k in flats])
            beyond.append(largest(s, [under, *(dot(w, at) - d for w, d in walls)]))
        best, name = beyond[0], s.b.const(1.0)
        for k, value in enumerate(beyond[1:], 2):
            more = s.b.call("notless", value, best)
            best, name = s.b.select(more, best, value), s.b.select(more, name, float(k))
        held = held_number(s, at[0], label)
        number = s.b.select(held, held, name)
        kind, *values = chosen(s, number, [(kind, *a, *w) for kind, a, w, _, _ in places])
        place, way = values[:3], values[3:]
        past = chosen(s, number, [(b,) for b in beyond])[0] - 1e-9 * solid.size
        off = subtract(at, place)
        along = dot(way, off)
        # of a flat all that is along its normal, of an edge all that is not along it, of a corner all
        across = subtract(off, scale(along, way))
        distance = s.b.call("sqrt", s.b.const(NOTHING) + dot(across, across))
        gap = s.b.select(kind, distance, along)
        normal = [s.b.select(kind, a / distance, w) for a, w in zip(across, way, strict=True)]
        stays = s.b.select(s.b.call("notless", 0.0, past), held, name)
        edge = Edge(held, s.b.select(held, stays, name), past)
        return gap, self.world(normal), edge


def meeting(a: Body, b: Body, label: str, gap: Expr, normal: Way, place: Way, edge: Edge | None) -> Meeting:
    """`place`: where A's part is touched."""
    ways = across(a.s, normal)
    slips = along(ways, a.frame, b.frame, place, (0.0, 0.0, 0.0))
    return Meeting(label, gap, slips, turning(a.frame.omega, b.frame.omega, ways, normal), edge)


def across(s: Scene, normal: Way) -> list[Way]:
    """Two directions at right angles to a normal: those across POLE, turned as that is to the normal, the shortest way."""
    beside = 1.0 / (s.b.const(1.0) + dot(normal, POLE))
    found: list[Way] = []
    for way in perpendicular(POLE):
        found.append(subtract(way, scale(dot(normal, way) * beside, add(normal, POLE))))
    return found


def _three(p: Sequence[float]) -> tuple[float, float, float]:
    return p[0], p[1], p[2]


def regions(corners: Sequence[Vector], flats: Sequence[Flat], edges: Sequence[Sequence[int]]) -> list[Region]:
    """Of each flat, edge and corner: 0 a flat or 1, a place on it, a normal or a direction or nothing, walls w . p = d that bound
    what is next to it, and its flats, above one of which that is."""
    walls: list[list[Wall]] = [[] for _ in range(len(flats) + len(edges) + len(corners))]
    sides: list[set[int]] = [set() for _ in corners]
    found: list[Region] = [(0.0, [c * d for c in n], n, walls[k], {k}) for k, (n, d) in enumerate(flats)]
    for k, (a, b, *both) in enumerate(edges, len(flats)):
        p, q = corners[a], corners[b]
        size = hypot(*(v - u for u, v in zip(p, q, strict=True)))
        way = tuple((v - u) / size for u, v in zip(p, q, strict=True))
        found.append((1.0, p, way, walls[k], set(both)))
        for flat, side in zip(both, (1.0, -1.0), strict=bool(both)):
            # out of the flat, across the edge
            out = [side * c for c in crossed(way, flats[flat][0])]
            _wall(walls[flat], walls[k], out, p)
        back = [-c for c in way]
        for n, corner, at in ((way, b, q), (back, a, p)):
            _wall(walls[k], walls[len(flats) + len(edges) + corner], n, at)
            sides[corner] |= set(both)
    places = zip(corners, walls[len(flats) + len(edges) :], sides, strict=True)
    return [*found, *((1.0, p, (0.0, 0.0, 0.0), wall, side) for p, wall, side in places)]


def _wall(here: list[Wall], there: list[Wall], n: Sequence[float], at: Sequence[float]) -> None:
    """Between two regions; n points from the first to the other."""
    d = sum(a * b for a, b in zip(n, at, strict=True))
    here.append((n, d))
    there.append(([-c for c in n], -d))


def on_ellipse(s: Scene, squares: Sequence[float], p: Sequence[Expr]) -> tuple[Expr, Way]:
    """How far p is off an ellipsoid of these squares of half-axes [m^2], in its axes; below 0 inside of it, true near its
    surface. And the normal there."""

    def by(t: Scalar, v: Way) -> Way:
        return [c / (square + t) for square, c in zip(squares, v, strict=True)]

    def times(v: Way) -> Way:
        return [square * c for square, c in zip(squares, v, strict=True)]

    return root(s, by, times, p, (min(squares), max(squares)))


def on_shadow(s: Scene, m: tuple[Expr, Expr, Expr], p: Sequence[Expr]) -> tuple[Expr, Way]:
    """The same of an ellipse in its plane; `m`: the elements xx, xy, yy of its matrix [m^2]."""
    xx, xy, yy = m
    middle, apart = 0.5 * (xx + yy), 0.5 * (xx - yy)
    spread = s.b.call("sqrt", NOTHING * NOTHING + apart * apart + xy * xy)

    def by(t: Scalar, v: Way) -> Way:
        x, y = xx + t, yy + t
        whole = x * y - xy * xy
        return [(y * v[0] - xy * v[1]) / whole, (x * v[1] - xy * v[0]) / whole]

    def times(v: Way) -> Way:
        return [xx * v[0] + xy * v[1], xy * v[0] + yy * v[1]]

    return root(s, by, times, p, (middle - spread, middle + spread))


def root(
    s: Scene,
    by: Callable[[Scalar, Way], Way],
    times: Callable[[Way], Way],
    p: Sequence[Expr],
    squares: tuple[Scalar, Scalar],
) -> tuple[Expr, Way]:
    """`by`: (M + t)^-1 v, `times`: M v; `squares`: the least and the largest of M."""
    floor = s.b.const(0.0) - 0.5 * squares[0]

    def step(t: Expr) -> Expr:
        z = by(t, p)
        mz = times(z)
        square = s.b.const(NOTHING * NOTHING) + dot(z, mz)
        slope = NOTHING * NOTHING + dot(by(t, z), mz)
        return t + square * (s.b.call("sqrt", square) - 1.0) / slope

    t = s.b.call("sqrt", s.b.const(0.0) + dot(p, times(p))) - squares[1]
    t = largest(s, [t, floor])
    # to rounding for half-axes up to 100 to 1 and places up to 50 of them off
    for _ in range(12):
        t = largest(s, [step(t), floor])
    # a number without a slope, from which one step goes all the way
    grain = 1e-12 * squares[0]
    t = step(s.b.call("round", t / grain) * grain)
    z = by(t, p)
    size = s.b.call("sqrt", s.b.const(NOTHING * NOTHING) + dot(z, z))
    normal = scale(1.0 / size, z)
    reach = s.b.call("sqrt", s.b.const(NOTHING * NOTHING) + dot(normal, times(normal)))
    return dot(normal, p) - reach, normal


def largest(s: Scene, values: Sequence[Scalar]) -> Expr:
    """Without an event."""
    best = s.b.const(0.0) + values[0]
    for value in values[1:]:
        best = s.b.select(s.b.call("notless", value, best), value, best)
    return best


def least(s: Scene, values: Sequence[Scalar]) -> Expr:
    """Without an event."""
    zero = s.b.const(0.0)
    return -largest(s, [zero - v for v in values])


def chosen(s: Scene, number: Expr, rows: Sequence[Sequence[Scalar]]) -> list[Expr]:
    """The number-th of the rows, from 1 on."""
    found = [s.b.const(0.0) + v for v in rows[-1]]
    for k in range(len(rows) - 1, 0, -1):
        before = s.b.call("notless", float(k), number)
        found = [s.b.select(before, v, w) for v, w in zip(rows[k - 1], found, strict=True)]
    return found
