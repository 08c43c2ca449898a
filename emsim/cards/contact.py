"""CONTACT: a point or a round part against a line, which bounds a half-plane, or another round part.

    line=   gap = n . (P - Q) - r           n the normal, fixed in Q's body, pointing to where P may be
    axis=   gap = n . (P - Q) - r s,  s = |n - (n.a) a|   a thin disc of axis a; its rim is nearest at P - r (n - (n.a) a)/s
    rq=     gap = |P - Q| - r - rq          inside a ring of radius -rq:  gap = -rq - r - |P - Q|
What happens where it closes stands in touch.py. `force` is what the parts press on each other with. With mu= they rub: `slip` is
the speed of P's part along Q's where they touch, `friction` the force on P's part, along t = n x z: to the right on a floor.
Where they can slide in two directions both are lengths of vectors.
"""

from __future__ import annotations

from math import hypot

from . import touch
from .base import Card, Default, Spec
from .kinematics import add, cross, dot, is_zero, perpendicular, scale, subtract
from .touch import Touching

NOTHING = 1e-15  # where the normal is -y any pair across it does

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..diagnostics import Sink
    from .base import Pen, PointView, Probes, Scalar, Scene


class Contact(Touching, Card):
    spec = Spec(
        "CONTACT",
        "CONTACT name P Q line=(nx,ny) (or rq=) [r= [axis=]] [e=0]   or with k= [c= or e=] [n=1]   [mu= [mus=]]",
        terminals="p:point q:point",
        mark=("k", "e", "line", "rq"),
        meaning="contact of a point or round part with a line or another round part",
        laws={
            "q": "gap >= 0; after an impact e times the speed before it",
            "V": "with k=: k d^(n+1)/(n+1), d how deep they are in each other",
            "P": "c d'^2, or that which gives back e times the speed; mu N |slip|",
        },
        line=Default(
            None, "", "normal of the line through Q, in the axes of Q's body; it points to P's side", "vector"
        ),
        r=Default(0.0, "m", "radius of the round part about P", least=0.0),
        axis=Default(
            None,
            "",
            "in space: the axis of a thin disc of radius r, in the axes of P's body; (0,0,0), as without it: a ball",
            "vector",
        ),
        rq=Default(
            None, "m", "radius of the round part about Q, 0: a corner; below 0: P is inside of that ring"
        ),
        **touch.LAW,
        **touch.FRICTION,
    )
    line: tuple[float, ...] | None
    r: float
    axis: tuple[float, ...] | None
    rq: float | None
    k: float | None
    c: float
    e: float | None
    n: float
    mu: float
    mus: float | None
    p: PointView
    q: PointView

    def check(self, sink: Sink) -> None:
        what = f"CONTACT {self.name}"
        if (self.line is None) == (self.rq is None):
            said = f"{what} needs one of line=, a straight part, and rq=, a round one"
            sink.error("E230", said, self.span, self.spec.form)
        elif self.line is not None and (len(self.line) not in (2, 3) or not any(self.line)):
            said = f"line= of {what} is a direction such as (0,1)"
            sink.error("E232", said, self.place("line"))
        elif self.rq is not None and self.rq < 0.0 and self.r >= -self.rq:
            said = f"{what}: a round part of r={self.r:g} does not go into a ring of {-self.rq:g}"
            sink.error("E238", said, self.place("rq"))
        if self.axis is not None:
            self._check_axis(what, sink)
        touch.check(self, self.k, self.c, self.e, sink)
        if self.mus is not None and self.mus < self.mu:
            said = f"mus= of {what} is {self.mus:g}, less than mu= {self.mu:g}: what slides would be held more than what rests"
            sink.error(
                "E238", said, self.place("mus"), "mus= is for parts that stick to each other, the larger one"
            )

    def _check_axis(self, what: str, sink: Sink) -> None:
        assert self.axis is not None
        if len(self.axis) != 3:
            sink.error("E232", f"axis= of {what} has three components, such as (0,0,1)", self.place("axis"))
        elif any(self.axis) and self.line is None:
            said = f"{what}: a thin disc (axis=) touches a plane, line=; beside another round part both are balls"
            sink.error("E240", said, self.place("axis"), "leave axis= out, or touch line=(nx,ny,nz)")
        elif any(self.axis) and self.r == 0.0:
            sink.error(
                "E240", f"axis= of {what} is that of a disc, and r= is 0", self.place("axis"), "give r="
            )

    def leaves_plane(self) -> bool:
        tilts = self.axis is not None and any(self.axis[:2])
        return tilts or (self.line is not None and len(self.line) == 3 and bool(self.line[2]))

    def prepare(self, s: Scene) -> None:
        away = subtract(self.p.pos, self.q.pos)
        arm: Sequence[Scalar] | None = None
        if self.line is not None:
            normal = s.body_of(self, "q").direction(unit(self.line))
            gap = dot(away, normal) - self.r
            if self.axis is not None and any(self.axis):
                axis = s.body_of(self, "p").direction(unit(self.axis))
                lean = dot(normal, axis)
                across = subtract(normal, scale(lean, axis))
                # its slope too has a value where the disc lies flat
                size = s.b.call("sqrt", s.b.const(NOTHING) + dot(across, across))
                gap = dot(away, normal) - self.r * size
                arm = scale(-self.r / size, across)
        else:
            assert self.rq is not None
            distance = s.b.call("sqrt", s.b.const(0.0) + dot(away, away))
            gap = distance - self.r - self.rq if self.rq >= 0.0 else -self.rq - self.r - distance
            normal = scale((1.0 if self.rq >= 0.0 else -1.0) / distance, away)
        self.set_gaps(s, [(1.0, self.name, s.b.const(0.0) + gap)], "N")
        if self.mu or self.mus:
            self._rub(s, away, normal, scale(-self.r, normal) if arm is None else arm)

    def _rub(self, s: Scene, away: Sequence[Scalar], normal: Sequence[Scalar], arm: Sequence[Scalar]) -> None:
        """The slip: velocities of both parts where they touch, `arm` from P, of P's part over that of Q's, across the normal."""
        turns = cross(s.body_of(self, "p").omega, arm), cross(s.body_of(self, "q").omega, add(away, arm))
        slip = subtract(add(self.p.vel, turns[0]), add(self.q.vel, turns[1]))
        axis = next((k for k in (2, 1, 0) if is_zero(slip[k]) and is_zero(normal[k])), None)
        ways: Sequence[Sequence[Scalar]]
        if axis is not None:
            ways = [cross(normal, [float(k == axis) for k in range(3)])]
        elif self.line is not None:
            ways = [s.body_of(self, "q").direction(way) for way in perpendicular(unit(self.line))]
        else:
            ways = _across(s, normal)
        slips = [along for way in ways if not is_zero(along := dot(slip, way))]
        if slips:
            self.set_slip(slips, self.mu, self.mus)
        else:
            said = f"mu= of CONTACT {self.name} has no effect: its parts cannot slide along each other"
            s.sink.note("N233", said, self.place("mu"))

    def probes(self, s: Scene) -> Probes:
        return self.touch_probes(s, "force")

    def _along(self) -> list[float] | None:
        """The direction of the line in the xy plane of Q's body."""
        if self.line is None:
            return None
        x, y = self.line[:2]
        size = (x * x + y * y) ** 0.5
        return [-y / size, x / size, 0.0] if size else [1.0, 0.0, 0.0]

    def glyph(self, draw: Pen) -> None:
        found = self.probes(draw.m)
        effort, mode = found["force"], found["mode"] if self.slips else 0.0
        assert not callable(effort) and not callable(mode)
        draw.add(
            "contact", self, p=draw.terminal(self, "p"), q_=draw.terminal(self, "q"), r=self.r, rq=self.rq,
            along=self._along(), unit="N",
            effort=draw.channel(f"force({self.name})", "N", effort), mode=draw.channel(f"mode({self.name})", "", mode),
        )  # fmt: skip


def unit(vector: Sequence[float]) -> tuple[float, ...]:
    """Its direction, of length 1 and three components."""
    size = hypot(*vector)
    return tuple(c / size for c in (*vector, 0.0)[:3])


def _across(s: Scene, normal: Sequence[Scalar]) -> list[Sequence[Scalar]]:
    """Two directions at right angles to a normal that goes anywhere: x and z turned as y is turned to it, the shortest way."""
    beside = 1.0 / (normal[1] + (1.0 + NOTHING))
    found: list[Sequence[Scalar]] = []
    for axis in (0, 2):
        far = normal[axis] * beside
        found.append([float(k == axis) - far * (normal[k] + float(k == 1)) for k in range(3)])
    return found
