"""screw: B turns about an axis and advances along it, lead a turn: one coordinate, the angle.

With k = lead/(2 pi) the displacement is k q, so weight and inertia along the axis act on q with k and k^2.
"""

from __future__ import annotations

from math import pi

from ..base import Default
from .base import Coord, JointKind
from .rows import across, axis_kept, shifted, turned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder
    from ...diagnostics import Sink
    from ..base import Param
    from ..kinematics import Frame, Moving, Scalar, Vector
    from .base import Closure, Passed


class Screw(JointKind):
    name = "screw"
    meaning = "turn about its axis and advance along it, lead a turn"
    axis_default = (0.0, 0.0, 1.0)
    params: ClassVar[dict[str, Param]] = {
        "lead": Default(None, "m", "advance of a screw in one turn; negative: left-handed")
    }
    coordinates = (Coord("angle", "rad", "axis"),)
    speeds = (Coord("omega", "rad/s"),)
    lead: float | None

    def check(self, sink: Sink) -> None:
        if not self.lead:
            said = (
                f"JOINT {self.card.name} needs lead= (the advance of the screw in one turn, m), other than 0"
            )
            hint = "a screw that does not advance is a pin"
            sink.error("E230", said, self.card.place("lead"), hint)
        self.pitch = (self.lead or 1.0) / (2.0 * pi)

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        turn, speed = sign * (q[0] + self.zeros[0]), sign * u[0]
        moving.turn(self.axis, turn, speed)
        moving.slide(self.axis, self.pitch * turn, self.pitch * speed)
        return []

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        advance = shifted(fa, d, self.axis) - self.pitch * turned(b, fa, fb, self.axis, self.near[0])
        return [*across(fa, d, self.axis), *axis_kept(fa, fb, self.axis), ("advance", advance, "N")]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        return [turned(b, fa, fb, self.axis, near[0])]
