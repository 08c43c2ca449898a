"""KNIFE: a blade, skate or narrow wheel at a point: it goes along its edge, and not across.

    (v(P) - v(Q's part there)) . a = 0,  a = n x d, of length 1      d the edge, fixed in P's body, n the normal of the ice
A row of speeds, which no position is behind; its multiplier `force` acts on P's part along a, to the left of the edge, and does
no work.
"""

from __future__ import annotations

from .base import Card, Default, Required, Spec
from .kinematics import cross, dot, is_zero, scale, subtract
from .round import unit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Pen, PointView, Probes, Scalar, Scene


class Knife(Card):
    spec = Spec(
        "KNIFE",
        "KNIFE name P Q along=(dx,dy) [normal=(0,0,1)]",
        terminals="p:point q:point",
        mark=("along",),
        meaning="a blade, skate or narrow wheel, which goes along its edge and not across",
        meant={"": "along={}", "dir": "along={}", "axis": "along={}", "edge": "along={}"},
        laws={"q": "the velocity of P across the edge is that of Q's part there"},
        along=Required("", "direction of the edge, in the axes of P's body", "vector"),
        normal=Default((0.0, 0.0, 1.0), "", "normal of the ice, in the axes of Q's body", "vector"),
    )
    along: tuple[float, ...]
    normal: tuple[float, ...]
    p: PointView
    q: PointView

    def check(self, sink: Sink) -> None:
        for key, sizes in (("along", (2, 3)), ("normal", (3,))):
            given = getattr(self, key)
            if len(given) not in sizes or not any(given):
                said = f"{key}= of KNIFE {self.name} is a direction such as {'(1,0)' if key == 'along' else '(0,0,1)'}"
                sink.error("E232", said, self.place(key))

    def leaves_plane(self) -> bool:
        return any((*self.along, 0.0)[2:3]) or any(self.normal[:2])

    def prepare(self, s: Scene) -> None:
        self.across: Scalar = 0.0
        n = s.body_of(self, "q").direction(unit(self.normal))
        a = cross(n, s.body_of(self, "p").direction(unit(self.along)))
        if all(map(is_zero, a)):
            said = f"the edge along= of KNIFE {self.name} stands upright on its ice"
            s.sink.error("E232", said, self.place("along"), "normal= is the normal of the ice")
            return
        if self.leaves_plane():
            a = scale(1.0 / s.b.call("sqrt", s.b.const(0.0) + dot(a, a)), a)
        away = subtract(self.p.pos, self.q.pos)
        speed = subtract(subtract(self.p.vel, self.q.vel), cross(s.body_of(self, "q").omega, away))
        self.across = dot(speed, a)
        if is_zero(self.across):
            said = f"KNIFE {self.name} has no effect: its point cannot move across the edge"
            s.sink.note("N233", said, self.span)

    def velocities(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return [] if is_zero(self.across) else [("across", self.across, "N")]

    def probes(self, s: Scene) -> Probes:
        return {"force": lambda: s.reaction(self.name)}

    def glyph(self, draw: Pen) -> None:
        """The edge, on P's body."""
        at = draw.terminal(self, "p")
        draw.add("knife", self, at=at, along=list(unit(self.along)))
