"""The way of a rope over points and pulleys, in the plane across the pulleys' axis.

A pulley's radius r has a sign: above 0 the rope goes round it counter-clockwise on its way from the first place to the last, so
that the centre is at the left. With n = J t, the tangent turned left, the rope touches the circle about C at C - r n. Between two
circles, d from centre to centre and s = r2 - r1 (a point is a circle of radius 0):

    length l = sqrt(d^2 - s^2),     tangent t = (l d - s J d)/d^2
    on a pulley  r b,               b the angle from the tangent that arrives to the one that leaves; full turns are counted
    wound on a drum at an end       r times the turn of the tangent over the drum since the start

A pulley between points or ends lets the rope go where b would fall below 0: both ways are equally long there, to the third order.
Across the plane a rope on bars goes as a helix, a straight line on the unrolled way: sqrt(l^2 + h^2).
"""

from __future__ import annotations

from math import cos, pi, sin

from .kinematics import is_zero

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Protocol

    from .base import Scalar, Scene

    Flat = tuple[Scalar, Scalar]

    class Watch(Protocol):
        """What is decided on the way: numbers at the start, flags while the machine moves. Places count from 1."""

        def apart(
            self, i: int, j: int, square: Scalar
        ) -> Scalar: ...  # of a free part's length, kept above 0
        def touches(self, k: int, angle: Scalar) -> Scalar: ...  # does the rope lie on this pulley?
        def stays(self, k: int, angle: Scalar) -> None: ...  # it is held on this one
        def turned(self, label: str, sine: Scalar, cosine: Scalar) -> Scalar: ...  # angle, full turns counted


NEAR = 1e-9  # [m] a free part that is shorter has no direction


class AtStart:
    """Numbers where the machine starts: `close`, places between which no free part is; `off`, pulleys that the rope would leave
    and is held on; `turns`, angles by label."""

    def __init__(self, s: Scene) -> None:
        self.b = s.b
        self.close: list[tuple[int, int]] = []
        self.off: list[int] = []
        self.turns: dict[str, float] = {}

    def apart(self, i: int, j: int, square: Scalar) -> Scalar:
        if number(square) > NEAR * NEAR:
            return square
        self.close.append((i, j))
        return 1.0

    def touches(self, k: int, angle: Scalar) -> Scalar:
        return float(number(angle) > 0.0)

    def stays(self, k: int, angle: Scalar) -> None:
        if number(angle) < 0.0:
            self.off.append(k)

    def turned(self, label: str, sine: Scalar, cosine: Scalar) -> Scalar:
        """Round a pulley up to three quarters of a turn."""
        self.turns[label] = number(self.b.call("atan2", -cosine, sine)) + 0.5 * pi
        return self.turns[label]


class Moving:
    """Flags and memories, from what was found at the start. `what`: the card in words."""

    def __init__(self, s: Scene, name: str, what: str, start: AtStart) -> None:
        self.s, self.b, self.name, self.what, self.start = s, s.b, name, what, start

    def apart(self, i: int, j: int, square: Scalar) -> Scalar:
        least = NEAR * NEAR
        if not isinstance(square, float) and square.value is None:
            said = f"places {i} and {j} of {self.what} have come together: no free part is left between them"
            self.s.told(least - square, f"{self.name} close{i}-{j}", said)
            # without an event: stages of a step may be beyond before it is known
            return self.b.select(self.b.call("notless", square, least), square, least)
        return square

    def touches(self, k: int, angle: Scalar) -> Scalar:
        return self.b.flag(self.s.public(angle), None, f"{self.name} touches{k}", -1)

    def stays(self, k: int, angle: Scalar) -> None:
        said = f"{self.what} would leave its pulley at place {k}, beside another one, and is held there"
        self.s.told(-angle, f"{self.name} leaves{k}", said)

    def turned(self, label: str, sine: Scalar, cosine: Scalar) -> Scalar:
        b, first = self.b, self.start.turns[label]
        since = b.memory(f"{self.name} turned{label}")
        c, d = b.call("cos", since), b.call("sin", since)
        # turned back by where it was at the start, then by what came since
        x, y = cosine * cos(first) + sine * sin(first), sine * cos(first) - cosine * sin(first)
        ahead = x * c + y * d
        angle = since + b.call("atan2", y * c - x * d, ahead)
        b.keep(since, self.s.public(angle))
        # taken from where it was at the last event: after 2 rad there is a new one
        b.flag(self.s.public(cos(2.0) - ahead), None, f"{self.name} round{label}", -1)
        return angle + first


class Course:
    """What a stretch measures: `length` without what is wound, `tangents` at both ends [rad], None at a point; `lies`: of every
    place, is the rope there?"""

    __slots__ = ("length", "lies", "tangents")

    def __init__(self, length: Scalar, tangents: list[Scalar | None], lies: list[Scalar]) -> None:
        self.length, self.tangents, self.lies = length, tangents, lies


class Stretch:
    """A rope from one place that holds it to the next: `centres` in the plane, `heights` across it, `radii`. At round ends it is
    wound. Its first place is the rope's number `first`, from 1."""

    def __init__(
        self, s: Scene, centres: Sequence[Flat], heights: Sequence[Scalar], radii: Sequence[float], first: int
    ) -> None:
        self.b, self.centres, self.heights, self.radii, self.first = s.b, centres, heights, radii, first
        self.last = len(radii) - 1

    def measure(self, watch: Watch) -> Course:
        last = self.last
        found: list[Scalar] = [1.0 for _ in self.radii]
        parts = [self._free(watch, k, k + 1) for k in range(last)]
        begin, end = parts[0][1], parts[-1][1]
        total, bend, since = self.b.const(0.0), parts[0][0], 0
        for k in range(1, last):
            length, after = parts[k]
            if self.radii[k] == 0.0:
                total, bend, since = total + self._risen(bend, since, k), length, k
                continue
            angle = self._angle(watch, k, parts[k - 1][1], after)
            on_it = abs(self.radii[k]) * angle + length
            if not self._lets_go(k):
                watch.stays(self.first + k, angle)
                bend = bend + on_it
                continue
            found[k] = on = watch.touches(self.first + k, angle)
            straight, way = self._free(watch, k - 1, k + 1)
            # the neighbours are points or ends, so that the bend began before k
            bend = self.b.select(on, bend + on_it, straight)
            if k == 1:
                begin = self._either(on, begin, way)
            if k == last - 1:
                end = self._either(on, end, way)
        total = total + self._risen(bend, since, last)
        tangents: list[Scalar | None] = [None, None]
        for side, (k, t) in enumerate(((0, begin), (last, end))):
            if self.radii[k] != 0.0:
                label = f"{self.first + k}{'in' if side else 'out'}"
                tangents[side] = watch.turned(label, t[1], t[0])
        return Course(total, tangents, found)

    def _lets_go(self, k: int) -> bool:
        """Are both neighbours points, or ends?"""
        return all(j in (0, self.last) or self.radii[j] == 0.0 for j in (k - 1, k + 1))

    def _angle(self, watch: Watch, k: int, before: Flat, after: Flat) -> Scalar:
        """How far the rope lies round a pulley."""
        sine = before[0] * after[1] - before[1] * after[0]
        cosine = before[0] * after[0] + before[1] * after[1]
        return watch.turned(str(self.first + k), sine if self.radii[k] > 0.0 else -sine, cosine)

    def _free(self, watch: Watch, i: int, j: int) -> tuple[Scalar, Flat]:
        """Length and direction, in the plane, of the part between two places; in space where no pulley is about."""
        (ax, ay), (cx, cy) = self.centres[i], self.centres[j]
        dx, dy, step = cx - ax, cy - ay, self.radii[j] - self.radii[i]
        far = dx * dx + dy * dy
        square = far - step * step
        if j == i + 1 and self.radii[i] == self.radii[j] == 0.0:
            rise = self.heights[j] - self.heights[i]
            square = square + rise * rise
        length = self.b.call("sqrt", watch.apart(self.first + i, self.first + j, square))
        if step == 0.0:
            return length, (dx / length, dy / length)
        return length, ((length * dx + step * dy) / far, (length * dy - step * dx) / far)

    def _risen(self, length: Scalar, i: int, j: int) -> Scalar:
        """A way from place i to j that rises across the plane."""
        rise = self.heights[j] - self.heights[i]
        if j == i + 1 or is_zero(rise):
            return length
        return self.b.call("sqrt", length * length + rise * rise)

    def _either(self, on: Scalar, one: Flat, other: Flat) -> Flat:
        return self.b.select(on, one[0], other[0]), self.b.select(on, one[1], other[1])


def number(e: Scalar) -> float:
    """Of what does not move."""
    value = e if isinstance(e, float) else e.value
    assert value is not None
    return value
