"""CONTACT between shapes: of two bodies, or of all. Where they meet: meeting.py; what happens there: touch.py.

`force` is the sum of all that press, `gap` the smallest of its gaps, `mode` how many places touch.
"""

from __future__ import annotations

from . import pairs, supports, touch
from .base import Card
from .meeting import meetings, separation
from .resisting import Turning, turning
from .solids import SOLIDS
from .supports import Meeting
from .touch import Rigid, Touch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Probes, Scene
    from .meeting import Part
    from .shapes import Shape


class Between(Turning, Card):
    """The spec is that of CONTACT (contact.py), whose rules between k=, c=, e=, mu= hold."""

    k: float | None
    c: float
    e: float | None
    n: float
    mu: float
    mus: float | None

    def check(self, sink: Sink) -> None:
        touch.check(self, self.k, self.c, self.e, sink)
        touch.check_friction(self, self.mu, self.mus, sink)

    def pairs(self, s: Scene) -> list[tuple[Part, Part]]:
        """Which shapes may touch: of `all` those of bodies that no joint joins, one of which can move."""
        names = [ref.name for _, _, ref in self.terminals]
        every = len(names) == 1
        first = s.parts(None if every else names[0])
        second = first if every else s.parts(names[1])
        found = []
        for j, a in enumerate(first):
            for b in first[j + 1 :] if every else second:
                apart = a[1] != b[1] and not (s.is_still(a[1]) and s.is_still(b[1]))
                if apart and not (every and s.joined(a[1], b[1])):
                    found.append((a, b))
        return found

    def prepare(self, s: Scene) -> None:
        self.set_gaps(s, [], "N")
        pairs = self.pairs(s)
        what = f"CONTACT {self.name}"
        if not pairs:
            said = f"{what} has no effect: no two shapes here belong to bodies that move apart"
            s.sink.error("E240", said, self.span, "shape= of a BODY, or SHAPE name body box(w,h)")
            return
        for a, b in pairs:
            if s.in_space:
                self._in_space(s, a, b, what)
            elif not self._takes(s, a[2], b[2], what):
                return
            else:
                turns = turning(s.frame(a[1]).omega, s.frame(b[1]).omega, [], (0.0, 0.0, 0.0))
                flat = [Meeting(one.label, one.gap, [one.slip], turns, one.edge) for one in meetings(s, a, b)]
                self._touch(s, a, b, flat)
        self.tell_idle(s, self.turns)

    def _in_space(self, s: Scene, a: Part, b: Part, what: str) -> None:
        if wrong := self._refused(a, b):
            said, hint = wrong
            s.sink.error("E240", f"{what}: {said}", self.span, hint)
            return
        assert a[2].solid is not None and b[2].solid is not None
        one, other = (*a[:2], a[2].solid), (*b[:2], b[2].solid)
        found = supports if one[2].normal or other[2].normal else pairs
        self._touch(s, a, b, places := found.meetings(s, one, other))
        if found is pairs:
            pairs.watch(s, self.name, one, other, places)

    def _refused(self, a: Part, b: Part) -> tuple[str, str] | None:
        """Why no two such shapes touch in space, and what does."""
        for name, _, shape in (a, b):
            if shape.solid is None:
                said = f"{shape.kind}(..) of {name} has no depth along z, and the machine leaves the plane"
                return said, f"in space: {SOLIDS}"
        one, other = a[2].solid, b[2].solid
        assert one is not None and other is not None
        named = f"{one.kind}(..) of {a[0]} and {other.kind}(..) of {b[0]}"
        if one.normal and other.normal:
            return f"{named} bound half-spaces, which are in each other", "leave one of them out"
        if one.normal or other.normal:
            return None
        if wrong := pairs.unknown(a[0], one, b[0], other):
            return f"{named} do not touch each other: {wrong[0]}", wrong[1]
        if self.k is not None and "ball" not in (pairs.kind(one), pairs.kind(other)):
            said = f"{named} have no elastic law k=: of corners and edges alone rigid ones have"
            return said, "leave k= out: rigid parts, e= gives back a share"
        return None

    def separations(self, s: Scene) -> list[Expr]:
        """Of all pairs of polygons: no corner need be inside where two cross. Corner to corner they do not touch."""
        if s.in_space:
            return self._separations_in_space(s)
        return [separation(s, a, b) for a, b in self.pairs(s) if not (a[2].radius or b[2].radius)]

    def _separations_in_space(self, s: Scene) -> list[Expr]:
        found: list[Expr] = []
        for a, b in self.pairs(s):
            one, other = a[2].solid, b[2].solid
            if one and other and not (one.normal or other.normal) and not pairs.unknown("", one, "", other):
                found += pairs.separations(s, (*a[:2], one), (*b[:2], other))
        return found

    def _takes(self, s: Scene, a: Shape, b: Shape, what: str) -> bool:
        """Is the pair one that is known, as stiff as it is?"""
        round_one = bool(a.radius or b.radius)
        if self.k is not None and not round_one:
            said = f"k= of {what}: corners at edges have no elastic law, only discs have"
            s.sink.error("E240", said, self.place("k"), "leave k= out: rigid parts, e= gives back a share")
            return False
        for shape in (a, b):
            if shape.kind in ("rod", "box") and not all([*shape.sizes, 0.0][:2]):
                named = f"{shape.kind}({shape.sizes[0]:g}"
                said = f"{what}: {named}) has no thickness that corners and discs could lie on"
                s.sink.error("E240", said, self.span, f"give it one: {named},w)")
                return False
        return True

    def _touch(self, s: Scene, a: Part, b: Part, meetings: list[Meeting]) -> None:
        self.check_places(s, a, b, len(meetings))
        for meeting in meetings:
            gap = s.b.const(0.0) + meeting.gap
            place: Rigid | Touch
            if self.k is None:
                place = Rigid(gap, self.e, "N", meeting.edge)
                place.law.pair = meetings[0]
                self.corners.append((1.0, place))
            else:
                place = Touch(s, f"{self.name} {meeting.label}", gap, self.k, self.c, self.e, self.n)
                self.touches.append((1.0, place))
            self.set_slips(meeting.slips, place, self.mu, self.mus)
            self.set_turns(meeting.turns, place)

    def probes(self, s: Scene) -> Probes:
        found = {**self.touch_probes(s, "force"), **self.turn_probes(s)}
        gaps = [s.b.const(0.0) + getattr(place, "law", place).gap for _, place in self.places]
        least = gaps[0]
        for gap in gaps[1:]:
            least = s.b.select(s.b.call("notless", gap, least), least, gap)
        found["gap"] = least
        found["mode"] = sum((place.on for _, place in self.places), s.b.const(0.0))
        for word in ("slip", "friction", "rolling", "drilling"):
            if len(self.places) > 1:
                found.pop(word, None)
        return found
