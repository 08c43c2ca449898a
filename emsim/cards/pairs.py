"""Where two of balls, capsules and boxes meet in space: gaps and slips of CONTACT between shapes.

Each is a block of up to three half-lengths with all that is within a radius of it: a ball none, a capsule one, a box three and no
radius. Two blocks are nearest at a corner of one and the other's face, edge or corner, or at an edge of each:
    corner p at a round pair      gap = |p - q| - r      q the place of the other's block next to p, r both radii
    corner p at a face of a box   gap = n . p - d        the face that p is furthest beyond, of those that it can press on
    edges p + s a, q + t b        gap = n . (p - q) - r  n along a x b, where both s and t are within their edges
Every gap is one of two points of the parts, so none is less than the distance, and the least of them is it; with a face on a face
all that carry are among them. What lies beyond an edge's end cannot touch (AWAY): as in the plane (meeting.py) a touch that comes
there ends, an event, and what has the other part's corner there takes over. Which face or edges it is, is asked anew while parts
are apart, and held while they touch.
"""

from __future__ import annotations

from itertools import product

from .kinematics import add, cross, dot, perpendicular, scale, subtract
from .laws import Edge
from .resisting import turning
from .supports import AWAY, Meeting, along, held_number, within

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Part

    Way = Sequence[Scalar]

NOTHING = 1e-30  # [m^2] keeps a slope where a middle line is in the other part
PARALLEL = 1e-5  # [rad] edges that lie so have no crossing; their corners touch
POLE = (
    0.36,
    -0.48,
    0.8,
)  # a direction of no axis, against which no normal points: of it turned to the normal slips are measured


class Block:
    """A solid of half-lengths where it is: axes with a length, in world axes, and that length [m]."""

    def __init__(self, s: Scene, part: Part) -> None:
        name, body, solid = part
        assert solid.half is not None
        self.s, self.name, self.solid, self.radius = s, name, solid, solid.radius
        self.frame = s.frame(body)
        self.centre = self.frame.point((solid.at[0], solid.at[1], solid.at[2])).pos
        self.ways = [
            (self.frame.direction(axis), half)
            for axis, half in zip(solid.axes, solid.half, strict=True)
            if half
        ]
        self.corners = [self.frame.point((p[0], p[1], p[2])).pos for p in solid.points()]

    def place(self, p: Way) -> list[Expr]:
        """Of a place along each of its axes."""
        away = subtract(p, self.centre)
        return [self.s.b.const(0.0) + dot(way, away) for way, _ in self.ways]


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which two blocks can touch; none is left out."""
    one, other = Block(s, a), Block(s, b)
    if len(one.ways) > len(other.ways):
        one, other = other, one
    found = []
    if one.radius + other.radius:
        found += [_near(one, other, k, inside=False) for k in range(len(one.corners))]
        if one.ways:
            found += [_near(other, one, k, inside=True) for k in range(len(other.corners))]
    else:
        found += [_on_face(one, other, k) for k in range(len(one.corners))]
        found += [_on_face(other, one, k) for k in range(len(other.corners))]
    apart = s.b.const(-AWAY) if one.radius + other.radius else _apart(one, other)
    for i, j in product(range(len(one.ways)), range(len(other.ways))):
        found += _edges(one, other, i, j, apart)
    return found


def _apart(a: Block, b: Block, along_ways: Sequence[Way] = ()) -> Expr:
    """How far two blocks without their radii are apart by planes across their axes and across `along_ways`; below 0 none lies
    between them."""
    s = a.s
    away = subtract(a.centre, b.centre)
    best = s.b.const(-AWAY)
    for way in (*(way for way, _ in (*a.ways, *b.ways)), *along_ways):
        apart = s.b.call("abs", s.b.const(0.0) + dot(way, away))
        for other, half in (*a.ways, *b.ways):
            apart = apart - half * s.b.call("abs", s.b.const(0.0) + dot(way, other))
        best = s.b.select(s.b.call("notless", apart, best), apart, best)
    return best


def separation(s: Scene, a: Part, b: Part) -> Expr:
    """Below 0 where a box and another block are in each other, crossed ones too of which no corner is inside (separating axes);
    without their radii."""
    one, other = Block(s, a), Block(s, b)
    across = [
        Crossing(one, other, i, j).normal for i, j in product(range(len(one.ways)), range(len(other.ways)))
    ]
    return _apart(one, other, across)


def meeting(
    a: Block, b: Block, label: str, gap: Expr, normal: Way, place: Way, edge: Edge | None
) -> Meeting:
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


def _near(a: Block, b: Block, k: int, inside: bool) -> Meeting:
    """A corner of A and what of B's block is next to it; `inside`: between the ends of B's one line alone."""
    s, p = a.s, a.corners[k]
    label = f"{a.name} {k + 1} {b.name}"
    away = subtract(p, b.centre)
    past: Expr | None = None
    for j, ((way, half), u) in enumerate(zip(b.ways, b.place(p), strict=True)):
        if inside:
            past, next_to = s.b.call("abs", u) - half, u
        else:
            over = s.b.flag(s.public(u - half), None, f"{label} over {j + 1}", -1)
            under = s.b.flag(s.public(-half - u), None, f"{label} under {j + 1}", -1)
            next_to = s.b.select(over, half, s.b.select(under, -half, u))
        away = subtract(away, scale(next_to, way))
    distance = s.b.call("sqrt", s.b.const(NOTHING) + dot(away, away))
    normal = scale(1.0 / distance, away)
    gap, edge = distance - (a.radius + b.radius), None
    if past is not None:
        gap, edge = within(s, label, gap, past)
    return meeting(a, b, label, gap, normal, add(p, scale(-a.radius, normal)), edge)


def _not_less(s: Scene, one: Scalar, other: Scalar) -> Expr:
    """1 or 0, without an event."""
    return s.b.select(s.b.call("notless", one, other), 1.0, 0.0)


def _chosen(s: Scene, number: Expr, values: Sequence[float]) -> Expr:
    """The number-th of the values, from 1 on."""
    found = s.b.const(values[-1])
    for k in range(len(values) - 1, 0, -1):
        found = s.b.select(number - float(k), found, values[k - 1])
    return found


def _on_face(a: Block, b: Block, k: int) -> Meeting:
    """A corner of A at a face of B: 1, 2 along its first axis and against it, and so on."""
    s, p = a.s, a.corners[k]
    label, tiny = f"{a.name} {k + 1} {b.name}", 1e-9 * max(a.solid.size, b.solid.size)
    at = b.place(p)
    inward = [dot(way, subtract(a.centre, p)) for way, _ in b.ways]
    best, name = s.b.const(-AWAY), s.b.const(0.0)
    for j, (u, into, (_, half)) in enumerate(zip(at, inward, b.ways, strict=True)):
        for side in (1.0, -1.0):
            place, distance = 2.0 * j + (1.5 - 0.5 * side), side * u - half
            # a face that the corner does not turn to counts where it is beyond alone: then it is off
            faces = s.b.call("notless", side * into, 0.0)
            off = s.b.select(s.b.call("notless", tiny, distance), -AWAY, distance)
            value = s.b.select(faces, distance, off)
            further = s.b.call("notless", value, best)
            name = s.b.select(further, s.b.select(faces, place, -place), name)
            best = s.b.select(further, value, best)
    held = held_number(s, at[0], label)
    number = s.b.select(held, held, s.b.call("abs", name))
    sides = [
        _chosen(s, number, [side * float(i == j) for i in range(3) for side in (1.0, -1.0)]) for j in range(3)
    ]
    far = _chosen(s, number, [half for _, half in b.ways for _ in range(2)])
    gap = sum((side * u for side, u in zip(sides, at, strict=True)), s.b.const(0.0)) - far
    past = best - gap - tiny
    presses = s.b.select(s.b.call("notless", name, 0.0), name, 0.0)
    stays = s.b.select(s.b.call("notless", 0.0, past), held, presses)
    edge = Edge(held, s.b.select(held, stays, presses), past)
    normal: Way = (0.0, 0.0, 0.0)
    for part, (way, _) in zip(sides, b.ways, strict=True):
        normal = add(normal, scale(part, way))
    return meeting(a, b, label, gap, normal, p, edge)


class Crossing:
    """Edges of A along its axis i and of B along its axis j: their common normal, and where they are nearest."""

    def __init__(self, a: Block, b: Block, i: int, j: int) -> None:
        self.a, self.b, self.i, self.j = a, b, i, j
        self.ends = a.ways[i][1], b.ways[j][1]
        self.u, self.v = a.ways[i][0], b.ways[j][0]
        s = a.s
        normal = cross(self.u, self.v)
        self.square = s.b.const(PARALLEL**4) + dot(normal, normal)
        self.normal = scale(1.0 / s.b.call("sqrt", self.square), normal)
        self.between = dot(self.u, self.v)

    def beyond(self, p: Way, q: Way) -> tuple[Expr, Way]:
        """Of edges through p and q: how far where they are nearest is past an end, above 0 too where they are parallel; and where
        that is on A."""
        s = self.a.s
        away = subtract(p, q)
        along_u, along_v = dot(away, self.u), dot(away, self.v)
        first = (self.between * along_v - along_u) / self.square
        second = along_v + self.between * first
        past = s.b.call("abs", s.b.const(0.0) + first) - self.ends[0]
        other = s.b.call("abs", s.b.const(0.0) + second) - self.ends[1]
        past = s.b.select(s.b.call("notless", past, other), past, other)
        apart = s.b.call("notless", self.square, PARALLEL**2)
        return s.b.select(apart, past, AWAY), add(p, scale(first, self.u))


def _edges(a: Block, b: Block, i: int, j: int, apart: Expr) -> list[Meeting]:
    """Edges of A along its axis i at those of B along its axis j."""
    crossing = Crossing(a, b, i, j)
    if not a.radius + b.radius:
        return [_sharp(crossing, apart, k, m) for k, m in product(range(2), range(2))]
    others = [k for k in range(len(b.ways)) if k != j]
    found = []
    for n, sides in enumerate(product((-1.0, 1.0), repeat=len(others)), 1):
        q = b.centre
        for side, k in zip(sides, others, strict=True):
            q = add(q, scale(side * b.ways[k][1], b.ways[k][0]))
        found.append(_round(crossing, q, f"{a.name} {b.name} {j + 1},{n}"))
    return found


def _round(crossing: Crossing, q: Way, label: str) -> Meeting:
    """A's middle line at one edge of B, through q."""
    a, b, s = crossing.a, crossing.b, crossing.a.s
    past, place = crossing.beyond(a.centre, q)
    signed = s.b.const(0.0) + dot(crossing.normal, subtract(a.centre, q))
    side = s.b.select(s.b.call("notless", signed, 0.0), 1.0, -1.0)
    normal = scale(side, crossing.normal)
    gap, edge = within(s, label, side * signed - (a.radius + b.radius), past)
    return meeting(a, b, label, gap, normal, add(place, scale(-a.radius, normal)), edge)


def _sharp(crossing: Crossing, apart: Expr, first: int, second: int) -> Meeting:
    """An edge of box A at one of box B: of each the one that is furthest out along the normal, or, `first` and `second`, that
    beside it across the face that is turned more to the other. Which they are is a number of five bits, the normal's side first.
    What is deeper than planes of faces are `apart` lies one beside the other, and does not touch."""
    a, b, s = crossing.a, crossing.b, crossing.a.s
    n = crossing.normal
    label = f"{a.name} {crossing.i + 1} {b.name} {crossing.j + 1} {first}{second}"
    out = _not_less(s, s.b.const(0.0) + dot(n, subtract(a.centre, b.centre)), 0.0)
    toward = 2.0 * out - 1.0
    seen = [out, *_outer(a, crossing.i, n, -toward, first), *_outer(b, crossing.j, n, toward, second)]
    now = 1.0 + sum((2.0**k * bit for k, bit in enumerate(seen)), s.b.const(0.0))
    held = held_number(s, b.place(a.centre)[0], label)
    rest = s.b.select(held, held, now) - 1.0
    bits: list[Expr] = []
    for k in reversed(range(5)):
        bit = _not_less(s, rest, 2.0**k - 0.5)
        rest = rest - 2.0**k * bit
        bits.insert(0, 2.0 * bit - 1.0)
    p, q = _middle(a, crossing.i, bits[1:3]), _middle(b, crossing.j, bits[3:5])
    past, place = crossing.beyond(p, q)
    normal = scale(bits[0], n)
    gap = s.b.const(0.0) + dot(normal, subtract(p, q))
    near = s.b.call("notless", gap, apart - 1e-9 * max(a.solid.size, b.solid.size))
    opens = s.b.select(s.b.call("notless", 0.0, past), s.b.select(near, now, 0.0), 0.0)
    stays = s.b.select(s.b.call("notless", 0.0, past), held, 0.0)
    can = s.b.select(held, stays, opens)
    shown = s.b.select(held, gap, s.b.select(can, gap, AWAY))
    return meeting(a, b, label, shown, normal, place, Edge(held, can, past))


def _outer(block: Block, along_axis: int, n: Way, toward: Expr, flipped: int) -> list[Expr]:
    """On which sides of the two other axes the edge is, 1 or 0."""
    s = block.s
    parts = [toward * dot(n, way) for k, (way, _) in enumerate(block.ways) if k != along_axis]
    bits = [_not_less(s, part, 0.0) for part in parts]
    if not flipped:
        return bits
    more = s.b.call("notless", s.b.call("abs", parts[0]), s.b.call("abs", parts[1]))
    return [s.b.select(more, bits[0], 1.0 - bits[0]), s.b.select(more, 1.0 - bits[1], bits[1])]


def _middle(block: Block, along_axis: int, sides: Sequence[Expr]) -> Way:
    """Of an edge."""
    found = block.centre
    others = [way for k, way in enumerate(block.ways) if k != along_axis]
    for side, (way, half) in zip(sides, others, strict=True):
        found = add(found, scale(side * half, way))
    return found
