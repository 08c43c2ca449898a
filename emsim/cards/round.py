"""Where a point or round part about P meets a line or plane through Q, or a round part about Q: what CONTACT and ROLL share.

line=   gap = n . (P - Q) - r           n the normal, fixed in Q's body, pointing to where P may be
axis=   gap = n . (P - Q) - r s,  s = |n - (n.a) a|   a thin disc of axis a; its rim is nearest at P - r (n - (n.a) a)/s
rq=     gap = |P - Q| - r - rq          inside a ring of radius -rq:  gap = -rq - r - |P - Q|
"""

from __future__ import annotations

from math import hypot

from .base import Card, Default
from .kinematics import add, cross, dot, is_zero, perpendicular, scale, subtract

NOTHING = 1e-15  # where the normal is -y any pair across it does

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..diagnostics import Sink
    from .base import Pen, PointView, Scalar, Scene

SHAPE: dict[str, Any] = {
    "line": Default(
        None, "", "normal of the line through Q, in the axes of Q's body; it points to P's side", "vector"
    ),
    "r": Default(0.0, "m", "radius of the round part about P", least=0.0),
    "axis": Default(
        None,
        "",
        "in space: the axis of a thin disc of radius r, in the axes of P's body; (0,0,0), as without it: a ball",
        "vector",
    ),
    "rq": Default(
        None, "m", "radius of the round part about Q, 0: a corner; below 0: P is inside of that ring"
    ),
}


class Round(Card):
    line: tuple[float, ...] | None
    r: float
    axis: tuple[float, ...] | None
    rq: float | None
    p: PointView
    q: PointView

    def check(self, sink: Sink) -> None:
        what = f"{self.spec.word} {self.name}"
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

    def meet(self, s: Scene) -> Scalar:
        """The gap; sets its normal and the arm from P to where the parts are nearest."""
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
        self.away, self.normal = away, normal
        self.arm = scale(-self.r, normal) if arm is None else arm
        return gap

    def slipping(self, s: Scene) -> list[Scalar]:
        """The slip: velocities of both parts where they touch, of P's part over that of Q's, across the normal."""
        away, normal, arm = self.away, self.normal, self.arm
        turns = cross(s.body_of(self, "p").omega, arm), cross(s.body_of(self, "q").omega, add(away, arm))
        slip = subtract(add(self.p.vel, turns[0]), add(self.q.vel, turns[1]))
        axis = next((k for k in (2, 1, 0) if is_zero(slip[k]) and is_zero(normal[k])), None)
        if axis is not None:
            return nonzero(slip, [cross(normal, [float(k == axis) for k in range(3)])])
        return nonzero(slip, self.ways(s))

    def ways(self, s: Scene) -> Sequence[Sequence[Scalar]]:
        """Two directions at right angles, across the normal."""
        if self.line is not None:
            return [s.body_of(self, "q").direction(way) for way in perpendicular(unit(self.line))]
        # x and z turned as y is turned to the normal, the shortest way
        normal, beside = self.normal, 1.0 / (self.normal[1] + (1.0 + NOTHING))
        found: list[Sequence[Scalar]] = []
        for axis in (0, 2):
            far = normal[axis] * beside
            found.append([float(k == axis) - far * (normal[k] + float(k == 1)) for k in range(3)])
        return found

    def sketch(self, draw: Pen, effort: str | float = 0.0, mode: str | float = 0.0) -> None:
        disc = list(unit(self.axis)) if self.axis is not None and any(self.axis) else None
        draw.add(
            "contact", self, p=draw.terminal(self, "p"), q_=draw.terminal(self, "q"), r=self.r, rq=self.rq, axis=disc,
            along=self.along(), unit="N", effort=effort, mode=mode,
        )  # fmt: skip

    def along(self) -> list[float] | None:
        """The direction of the line in the xy plane of Q's body."""
        if self.line is None:
            return None
        x, y = self.line[:2]
        size = (x * x + y * y) ** 0.5
        return [-y / size, x / size, 0.0] if size else [1.0, 0.0, 0.0]


def unit(vector: Sequence[float]) -> tuple[float, ...]:
    """Its direction, of length 1 and three components."""
    size = hypot(*vector)
    return tuple(c / size for c in (*vector, 0.0)[:3])


def nonzero(velocity: Sequence[Scalar], ways: Sequence[Sequence[Scalar]]) -> list[Scalar]:
    """Its parts along the ways, without those that are none."""
    return [part for way in ways if not is_zero(part := dot(velocity, way))]
