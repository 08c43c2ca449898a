"""CONTACT between shapes: of two bodies, or of all. Where they meet: meeting.py; what happens there: touch.py.

`force` is the sum of all that press, `gap` the smallest of its gaps, `mode` how many places touch.
"""

from __future__ import annotations

from . import touch
from .base import Card
from .meeting import meetings, separation
from .touch import Rigid, Touch, Touching

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Probes, Scene
    from .meeting import Meeting, Part
    from .shapes import Shape


class Between(Touching, Card):
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
        self.touches, self.corners, self.slips = [], [], []
        pairs = self.pairs(s)
        what = f"CONTACT {self.name}"
        if s.in_space:
            said = f"{what} is between shapes, which touch in the plane, and the machine leaves it"
            hint = "in space: CONTACT name P Q line=(nx,ny,nz) or rq=, r= for a ball, axis= for a disc"
            s.sink.error("E240", said, self.span, hint)
            return
        if not pairs:
            said = f"{what} has no effect: no two shapes here belong to bodies that move apart"
            s.sink.error("E240", said, self.span, "shape= of a BODY, or SHAPE name body box(w,h)")
            return
        for a, b in pairs:
            if not self._takes(s, a[2], b[2], what):
                return
            for meeting in meetings(s, a, b):
                self._touch(s, meeting)

    def separations(self, s: Scene) -> list[Expr]:
        """Of all pairs of polygons, for the start: no corner need be inside where two cross."""
        straight = [(a, b) for a, b in self.pairs(s) if not (a[2].radius or b[2].radius)]
        return [separation(s, a, b) for a, b in straight]

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

    def _touch(self, s: Scene, at: Meeting) -> None:
        mu, mus = self.mu, self.mu if self.mus is None else self.mus
        if self.k is None:
            corner = Rigid(at.gap, self.e, "N", at.edge)
            self.corners.append((1.0, corner))
            if mu or mus:
                self.set_one_slip(at.slip, corner, mu, mus)
            return
        one = Touch(s, f"{self.name} {at.label}", at.gap, self.k, self.c, self.e, self.n)
        self.touches.append((1.0, one))
        if mu or mus:
            self.set_one_slip(at.slip, one, mu, mus)

    def probes(self, s: Scene) -> Probes:
        found = self.touch_probes(s, "force")
        gaps = [s.b.const(0.0) + place.gap for _, place in self.places]
        least = gaps[0]
        for gap in gaps[1:]:
            least = s.b.select(s.b.call("notless", gap, least), least, gap)
        found["gap"] = least
        found["mode"] = sum((place.on for _, place in self.places), s.b.const(0.0))
        for word in ("slip", "friction"):
            if len(self.places) > 1:
                found.pop(word, None)
        return found
