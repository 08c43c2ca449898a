"""Where a cylinder meets a hull or a box in space: gaps and slips of CONTACT between shapes.

    corner p at an end, at the side     gap = |a . (p - c)| - h,  |p - c, across a| - R      a the axis, h half the length
    rim at a flat n                     gap = n . q - d         q the place of the rim that is furthest against n; a rim that lies
                                                                flat has FEET places that are fixed on it, as on a plane
    edge at a rim, at the side          seen along the edge it is a point, the rim an ellipse, the side two lines    nearest.py
    edge along the axis                 that of its places as high as either end
    edge that lies flat on an end       the two places at which it crosses the rim
Each is one of two points of the parts, so none is less than the distance; below 0 it is where one of them is in the other part.
Of edges two at a time touch. No two places take hold at one point: what takes over begins a little after the other has ended.
Where a step would pass what comes and goes between, an event of the whole pair ends it (between.py, by `separation`).
"""

from __future__ import annotations

from functools import partial
from math import cos, pi, sin

from .facets import Faceted
from .kinematics import add, cross, dot, scale, subtract
from .laws import Edge
from .nearest import NOTHING, View, chosen, largest, least, meeting, root
from .solids import SIGNS
from .supports import AWAY, FEET, FLAT, held_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._engine import Expr
    from .base import Scalar, Scene
    from .supports import Meeting, Part

    Way = Sequence[Scalar]
    # the gap, the normal from the block to the cylinder, the place, and above 0 where they are not nearest there
    Near = tuple[Expr, Way, Way, Expr]
    Row = Sequence[Expr | float]


class Drum:
    """A cylinder in other axes: its middle c, its directions, the third along its axis."""

    def __init__(self, s: Scene, part: Part, seen: View) -> None:
        self.s, self.view = s, View(s, part, own=True)
        self.x, self.y, self.k = (seen.turned(axis) for axis in self.view.axes)
        self.c = seen.local(self.view.centre)
        self.r, self.high = self.view.radius, 0.5 * self.view.solid.sizes[1]

    def split(self, d: Way) -> tuple[Expr, Way]:
        """How high along the axis, and the rest across it."""
        z = self.s.b.const(0.0) + dot(self.k, d)
        return z, subtract(d, scale(z, self.k))

    def end(self, side: Scalar) -> Way:
        """The middle of the end that is there, -1 or 1."""
        return add(self.c, scale(side * self.high, self.k))

    def furthest(self, side: Scalar, n: Way) -> tuple[Way, Expr]:
        """Of a rim the place furthest along a unit vector, and how long that is across the axis."""
        _, across = self.split(n)
        size = length(self.s, across)
        return add(self.end(side), scale(self.r / divisor(self.s, size), across)), size

    def reach(self, n: Way) -> Expr:
        lean, across = self.split(n)
        return self.r * length(self.s, across) + self.high * self.s.b.call("abs", lean)

    def foot(self, side: Scalar, number: int) -> Way:
        u, v = (self.r * way(2.0 * pi * number / FEET) for way in (cos, sin))
        return add(self.end(side), add(scale(u, self.x), scale(v, self.y)))

    def seen_along(self, v: Way, p: Way) -> tuple[Expr, Expr, Way, Way, Expr, Expr]:
        """Along a unit vector: the place p on the axis as it is seen and beside it, both directions, how long one along the axis
        is then, and how much that is along v."""
        lean = self.s.b.const(0.0) + dot(self.k, v)
        first = subtract(self.k, scale(lean, v))
        size = length(self.s, first)
        first = scale(1.0 / divisor(self.s, size), first)
        second = cross(v, first)
        d, zero = subtract(p, self.c), self.s.b.const(0.0)
        # along the axis nothing is beside another, as far off as any number
        along = self.s.b.call("notless", 0.5 * FLAT, size)
        x, y = (self.s.b.select(along, self.r, zero + dot(way, d)) for way in (first, second))
        return x, y, first, second, size, lean


def length(s: Scene, v: Way) -> Expr:
    return s.b.call("sqrt", s.b.const(NOTHING) + dot(v, v))


def divisor(s: Scene, e: Expr) -> Expr:
    """What is divided by where it counts; where it is next to nothing no place is, and slopes stay small."""
    return s.b.select(s.b.call("notless", 0.5 * FLAT, e), 1.0, e)


def sign(s: Scene, e: Expr) -> Expr:
    return s.b.select(s.b.call("notless", e, 0.0), 1.0, -1.0)


def on_rim(drum: Drum, lean: Expr, x: Expr, y: Expr) -> tuple[Expr, Expr, Expr]:
    """How far (x, y) is off a rim about the origin, seen along a way that leans so, and the normal there."""
    # next to nothing along the axis where it is seen edge on
    square = drum.r * drum.r
    thin, wide = square * (lean * lean + FLAT**3), square * (1.0 + FLAT**3)

    def by(t: Scalar, v: Way) -> Way:
        return [v[0] / (thin + t), v[1] / (wide + t)]

    gap, (u, w) = root(drum.s, by, lambda v: [thin * v[0], wide * v[1]], [x, y], (thin, wide))
    return gap, drum.s.b.const(0.0) + u, drum.s.b.const(0.0) + w


def least_of(
    s: Scene, label: str, size: Scalar, scores: Sequence[Expr], most: int
) -> list[tuple[Expr, Expr]]:
    """Of features by their scores, AWAY those that are none: the numbers of the least, from 1 on, or of those that are held, and
    which is held."""
    helds = [held_number(s, s.b.const(0.0) + size, f"{label} {k + 1}") for k in range(most)]
    found: list[tuple[Expr, Expr]] = []
    for k, held in enumerate(helds):
        best, name = s.b.const(AWAY), s.b.const(0.0)
        taken = [*(number for number, _ in found), *helds[k + 1 :]]
        for j, score in enumerate(scores, 1):
            less = s.b.call("notless", score, best)
            for other in taken:
                beside = s.b.call("notless", s.b.call("abs", other - float(j)), 0.5)
                less = s.b.select(beside, less, 1.0)
            best, name = s.b.select(less, best, score), s.b.select(less, name, float(j))
        found.append((s.b.select(held, held, name), held))
    return found


def _given(near: Near, _: Expr) -> Near:
    return near


class Cans:
    """A cylinder A and a hull or a box B in the axes of B's body."""

    def __init__(self, s: Scene, a: Part, b: Part) -> None:
        self.s, self.block = s, Faceted(s, b)
        self.drum = Drum(s, a, self.block)
        self.middle = self.block.solid.at
        self.tiny = max(self.block.tiny, 1e-9 * self.drum.view.solid.size)
        self.names = f"{self.drum.view.name} {{}} {self.block.name}"
        self.best, self.flat = self._best_flat()

    def _best_flat(self) -> tuple[Expr, Expr]:
        """How far they are apart by a flat, and which."""
        best, name = self.s.b.const(-AWAY), self.s.b.const(1.0)
        for j, (n, d) in enumerate(self.block.flats, 1):
            apart = dot(n, self.drum.c) - d - self.drum.reach(n)
            more = self.s.b.call("notless", best, apart)
            best, name = self.s.b.select(more, best, apart), self.s.b.select(more, name, float(j))
        return best, name

    def meet(self, label: str, gap: Expr, normal: Way, place: Way, edge: Edge) -> Meeting:
        seen = self.block
        return meeting(self.drum.view, seen, label, gap, seen.world(normal), seen.placed(place), edge)

    def place(self, label: str, which: Expr | float, at: Callable[[Expr], Near]) -> Meeting:
        """One place, of a feature by its number, that is one while it is not past its end."""
        label = self.names.format(label)
        held = held_number(self.s, self.drum.c[0], label)
        number = self.s.b.select(held, held, which)
        gap, normal, place, past = at(number)
        # it begins a little after where it ends, so that it does not take over from what touches at the same place
        least = self.s.b.select(held, 0.0, -2.0 * self.tiny)
        can = self.s.b.select(self.s.b.call("notless", least, past), number, 0.0)
        shown = self.s.b.select(held, gap, self.s.b.select(can, gap, AWAY))
        return self.meet(label, shown, normal, place, Edge(held, can, past))

    def outside(self, p: Way, but: Expr | float = 0.0) -> Expr:
        """How far a place is beyond the flats of B, but one by its number; below 0 in it."""
        s, found = self.s, []
        for j, (n, d) in enumerate(self.block.flats, 1):
            if but == j:
                continue
            own = s.b.call("notless", s.b.call("abs", s.b.const(float(j)) - but), 0.5)
            found.append(s.b.select(own, dot(n, p) - d, -AWAY))
        return largest(s, found)

    def at_corner(self, k: int) -> Meeting:
        """Of B: at the upper end, the lower end, the side."""
        s, drum, p = self.s, self.drum, self.block.places[k]
        z, across = drum.split(subtract(p, drum.c))
        far = length(s, across)
        out, inward = scale(1.0 / far, across), subtract(self.middle, p)
        turned, beside = s.b.const(0.0) + dot(drum.k, inward), far - drum.r
        label = self.names.format(f"corner {k + 1}")
        held = held_number(s, z, label)
        # it begins a little after an edge of it, or where that crosses the rim, has ended
        begins = s.b.select(held, 0.0, 2.0 * self.tiny)
        inner = s.b.call("notless", -begins, beside - self.tiny)
        turned = s.b.select(inner, turned, 0.0)
        rows: list[tuple[Expr, Way, Expr]]
        rows = [(z - drum.high, drum.k, turned), (-z - drum.high, scale(-1.0, drum.k), -turned)]
        rows.append((beside, out, s.b.const(0.0) + dot(out, inward)))
        presses: list[Scalar] = [1.0, 1.0, self.parting(k, out) - 2.0 * begins / drum.r]
        best, name = s.b.const(-AWAY), s.b.const(0.0)
        for j, ((distance, _, into), can) in enumerate(zip(rows, presses, strict=True), 1):
            # what the corner does not turn to counts where it is beyond alone: then it is off
            faces = s.b.call("notless", into, 0.0)
            off = s.b.select(s.b.call("notless", self.tiny, distance), -AWAY, distance)
            value = s.b.select(faces, distance, off)
            further = s.b.call("notless", value, best)
            number = s.b.select(least(s, [faces, s.b.call("notless", can, 0.0)]), float(j), -float(j))
            best, name = s.b.select(further, value, best), s.b.select(further, number, name)
        number = s.b.select(held, held, s.b.call("abs", name))
        gap, *normal = chosen(s, number, [(d, *n) for d, n, _ in rows])
        past = best - gap - self.tiny
        past = s.b.select(s.b.call("notless", held, 2.5), largest(s, [past, -self.parting(k, out)]), past)
        over = s.b.call("abs", z) - drum.high
        apart = s.b.call("sqrt", NOTHING + over * over + beside * beside)
        apart = s.b.select(s.b.call("notless", 0.0, least(s, [over, beside])), gap, apart)
        opens = s.b.select(s.b.call("notless", name, 0.0), name, 0.0)
        # what an edge is about to hold touches nothing
        apart = s.b.select(opens, apart, s.b.select(s.b.call("notless", apart, self.tiny), apart, AWAY))
        stays = s.b.select(s.b.call("notless", 0.0, past), held, opens)
        edge = Edge(held, s.b.select(held, stays, opens), past)
        return self.meet(label, s.b.select(held, gap, apart), scale(-1.0, normal), p, edge)

    def parting(self, k: int, out: Way) -> Expr:
        """How far the edges of a corner turn from the side there; one along the axis is as far from it as the corner."""
        s, found = self.s, []
        for (a, b, *_), side in zip(self.block.edges, self.block.sides, strict=True):
            if k in (a, b):
                way = side[3:6] if k == a else [-c for c in side[3:6]]
                _, flat = self.drum.split(way)
                level = s.b.call("notless", FLAT, length(s, flat))
                found.append(s.b.select(level, 1.0, s.b.const(0.0) + dot(out, way)))
        return least(s, found)

    def at_flat(self, number: Expr, q: Callable[[Expr, Way], tuple[Way, Expr]]) -> Near:
        """Of a flat, and a place of the cylinder that q finds for how the axis leans on its normal, with a condition."""
        s = self.s
        *n, d = chosen(s, number, [(*n, d) for n, d in self.block.flats])
        p, past = q(s.b.const(0.0) + dot(self.drum.k, n), n)
        gap = s.b.const(0.0) + dot(n, p) - d
        # what of the flat is next to it, or itself below, is in B
        at = subtract(p, scale(largest(s, [gap, 0.0]), n))
        return gap, n, p, largest(s, [self.outside(at, number) - self.tiny, past])

    def rim(self, side: float) -> Meeting:
        def lowest(_: Expr, n: Way) -> tuple[Way, Expr]:
            p, size = self.drum.furthest(side, scale(-1.0, n))
            return p, FLAT - size

        return self.place(f"rim {side:g}", self.flat, lambda number: self.at_flat(number, lowest))

    def foot(self, k: int) -> Meeting:
        """Of the rim that is below, where that lies flat."""

        def fixed(lean: Expr, n: Way) -> tuple[Way, Expr]:
            _, size = self.drum.furthest(1.0, n)
            return self.drum.foot(-sign(self.s, lean), k), size - FLAT

        return self.place(f"foot {k + 1}", self.flat, lambda number: self.at_flat(number, fixed))

    def lying(self, k: int) -> list[Meeting]:
        """Of an edge of B on an end: where it crosses the rim."""
        s, drum, side = self.s, self.drum, self.block.sides[k]
        q, v, size = side[:3], side[3:6], side[6]
        high, d = drum.split(subtract(q, drum.c))
        lean, flat = drum.split(v)
        one = divisor(s, s.b.const(0.0) + dot(flat, flat))
        middle = -dot(flat, d) / one
        low = add(d, scale(middle, flat))
        square = (drum.r * drum.r - dot(low, low)) / one
        half = s.b.call("sqrt", largest(s, [square, NOTHING]))
        up = sign(s, high + middle * lean)
        turned = up * dot(drum.k, add(side[7:10], side[10:13]))
        flat_on = largest(s, [s.b.call("abs", lean) - FLAT, -square, 1e-7 - turned])
        found = []
        for which in (-1.0, 1.0):
            t = middle + which * half
            near: Near = (
                up * (high + lean * t) - drum.high,
                scale(-up, drum.k),
                add(q, scale(t, v)),
                largest(s, [flat_on, -t - self.tiny, t - size - self.tiny]),
            )
            label = f"edge {k + 1} {'out' if which > 0.0 else 'in'}"
            found.append(self.place(label, 1.0, partial(_given, near)))
        return found

    def at_edge(self, side: Row, held: Expr | float, label: str = "") -> Near:
        """An edge of B at a rim or at the side, held or not; with a label what it is at is an event."""
        s, drum = self.s, self.drum
        q, v, size = side[:3], side[3:6], side[6]
        x, y, first, second, across, lean = drum.seen_along(v, q)
        beyond = s.b.call("abs", x) - drum.high * across
        before, beside = sign(s, x), sign(s, y)
        over = s.b.call("notless", beyond, 0.0)
        if label:
            over = s.b.flag(s.public(beyond), None, f"{label} over", -1)
        far, u, w = on_rim(drum, lean, s.b.select(over, beyond, 0.0), y)
        gap = s.b.select(over, far, beside * y - drum.r)
        out = add(scale(s.b.select(over, before * u, 0.0), first), scale(s.b.select(over, w, beside), second))
        at, _ = drum.furthest(before, out)
        up = x / divisor(s, across)
        beside_at = add(drum.c, scale(up, drum.k))
        at = [s.b.select(over, a, b) for a, b in zip(at, beside_at, strict=True)]
        t = s.b.const(0.0) + dot(v, subtract(at, q))
        place = add(q, scale(t, v))
        z, rest = drum.split(subtract(place, drum.c))
        # what is in the side by less than in the end
        end = s.b.call("abs", z) - drum.high
        inside = largest(s, [s.b.select(over, end, end - gap), length(s, rest) - drum.r])
        lies = s.b.select(over, least(s, [FLAT - s.b.call("abs", lean), drum.r - s.b.call("abs", y)]), -1.0)
        leans = largest(s, [-dot(out, side[7:10]), -dot(out, side[10:13])])
        # level with a flat the side lies on it, and the rim's place on that is about to take over
        leans -= s.b.select(over, s.b.select(held, 0.0, -4.0 * self.tiny / drum.r), 1e-7)
        ends = s.b.select(held, self.tiny, -2.0 * self.tiny)
        past = [
            -t - ends,
            t - size - ends,
            leans,
            least(s, [-gap, inside]) - self.tiny,
            lies,
            FLAT - across,
        ]
        return gap, scale(-1.0, out), place, largest(s, past)

    def edges(self) -> list[Meeting]:
        """The two edges that are nearest to a rim or the side."""
        rows = self.block.sides
        return self.two("edge", 2, lambda row, held, label: self.at_edge(row, held, label), rows)

    def two(
        self, what: str, most: int, at: Callable[[Row, Expr | float, str], Near], rows: Sequence[Row]
    ) -> list[Meeting]:
        """Of edges those that are nearest, or that are held."""
        s, whole = self.s, self.names.format(what)
        free, found = [at(row, 0.0, "") for row in rows], []
        scores = [s.b.select(s.b.call("notless", 0.0, past), gap, AWAY) for gap, _, _, past in free]
        for n, (number, held) in enumerate(least_of(s, whole, self.drum.c[0], scores, most), 1):
            label = f"{whole} {n}"
            gap, normal, place, past = at(chosen(s, number, rows), held, label)
            can = s.b.select(s.b.call("notless", 0.0, past), number, 0.0)
            shown = s.b.select(held, gap, s.b.select(can, gap, AWAY))
            found.append(self.meet(label, shown, normal, place, Edge(held, can, past)))
        return found

    def along(self, end: float) -> list[Meeting]:
        """An edge of B along the axis, as high as an end."""
        s, drum, rows = self.s, self.drum, self.block.sides

        def at(side: Row) -> Near:
            q, v, size = side[:3], side[3:6], side[6]
            high, d = drum.split(subtract(q, drum.end(end)))
            lean, flat = drum.split(v)
            t = -high * lean / divisor(s, lean * lean)
            away = add(d, scale(t, flat))
            far = length(s, away)
            out = scale(1.0 / far, away)
            past: list[Scalar] = [length(s, flat) - FLAT, -t - self.tiny, t - size - self.tiny]
            past += [-dot(out, side[j : j + 3]) - 1e-7 for j in (7, 10)]
            return far - drum.r, scale(-1.0, out), add(q, scale(t, v)), largest(s, past)

        return self.two(f"along {end:g}", 1, lambda row, held, label: at(row), rows)

    def cut_off(self, side: float) -> Expr:
        """How far an end is from B: of its middle, and of the middles of chords in flats."""
        s, drum = self.s, self.drum
        middle = drum.end(side)
        found = [self.outside(middle)]
        for j, (n, d) in enumerate(self.block.flats, 1):
            _, across = drum.split(n)
            over = dot(n, middle) - d
            square = s.b.const(NOTHING) + dot(across, across)
            far = s.b.call("abs", over) - drum.r * s.b.call("sqrt", square)
            at = subtract(middle, scale(over / square, across))
            found.append(largest(s, [far, self.outside(at, float(j))]))
        return least(s, found)

    def pierced(self, side: Row) -> Expr:
        """How far from the cylinder is what of an edge is as high as it, or the middle of what is in it."""
        s, drum = self.s, self.drum
        q, v, size = side[:3], side[3:6], side[6]
        z, d = drum.split(subtract(q, drum.c))
        lean, flat = drum.split(v)
        square = s.b.const(NOTHING) + dot(flat, flat)
        middle = -dot(flat, d) / square
        low = add(d, scale(middle, flat))
        half = s.b.call("sqrt", largest(s, [(drum.r * drum.r - dot(low, low)) / square, 0.0]))
        turned = lean + sign(s, lean) * NOTHING
        ends = [(end - z) / turned for end in (-drum.high, drum.high)]
        first = largest(s, [0.0, middle - half, least(s, ends)])
        last = least(s, [size, middle + half, largest(s, ends)])
        t = 0.5 * (first + last)
        beside = length(s, add(d, scale(t, flat))) - drum.r
        inside = largest(s, [s.b.call("abs", z + t * lean) - drum.high, beside])
        return s.b.select(s.b.call("notless", last, first), inside, AWAY)


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which a cylinder, A, can touch a hull or a box."""
    cans = Cans(s, a, b)
    found = [cans.at_corner(k) for k in range(len(cans.block.places))]
    found += [cans.rim(side) for side in SIGNS]
    found += [cans.foot(k) for k in range(FEET)]
    for k in range(len(cans.block.sides)):
        found += cans.lying(k)
    found += cans.edges()
    for side in SIGNS:
        found += cans.along(side)
    return found


def separation(s: Scene, a: Part, b: Part) -> Expr:
    """Below 0 they are in each other: an edge is in the cylinder, or an end of that in the block, where no edge is its middle or
    that of what a flat cuts off from it. By how much there."""
    cans = Cans(s, a, b)
    return least(s, [*(cans.cut_off(side) for side in SIGNS), *map(cans.pierced, cans.block.sides)])
