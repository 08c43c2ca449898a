"""universal (Cardan, Hooke): two turns, about an axis of A and about an axis of B that stays normal to it.

Both axes, a1 (`axis=`) and a2 (`axis2=`), are given at coordinates 0, where the frames are aligned.
"""

from __future__ import annotations

from ..base import Default
from ..kinematics import dot, perpendicular
from .base import Chain, Coord, unit_vector
from .rows import angle, normal, together

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder
    from ...diagnostics import Sink
    from ..base import Param
    from ..kinematics import Frame, Scalar, Vector
    from .base import Axis, Closure

SQUARE = 1e-9  # cosine of the angle between the two axes


class Universal(Chain):
    name = "universal"
    meaning = "turn about its axis in A, turn about its second axis in B"
    axis_default = (1.0, 0.0, 0.0)
    params: ClassVar[dict[str, Param]] = {
        "axis2": Default(None, "", "the second axis of a universal, normal to the first", "vector")
    }
    coordinates = (Coord("angle1", "rad", "axis"), Coord("angle2", "rad", "axis2"))
    axis2: tuple[float, ...] | None
    speeds = (Coord("omega1", "rad/s"), Coord("omega2", "rad/s"))

    def check(self, sink: Sink) -> None:
        card = self.card
        if self.axis2 is None:
            self.second = perpendicular(self.axis)[0]
            return
        self.second = unit_vector(card, "axis2", self.axis2, sink)
        if abs(dot(self.axis, self.second)) > SQUARE:  # type: ignore[arg-type]
            sink.error(
                "E232",
                f"axis2= of JOINT {card.name} is not normal to its axis=",
                card.place("axis2"),
                "the two axes of a universal meet at right angles",
            )

    def axis_of(self, along: str) -> Axis:
        return self.second if along == "axis2" else self.axis  # type: ignore[return-value]

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*together(d), ("square", dot(fa.direction(self.axis), fb.direction(self.second)), "N m")]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        a1, a2, n = self.axis, self.second, normal(self.axis, self.second)
        first, second = fa.direction(a1), fb.direction(a2)  # each is fixed in the cross too
        return [
            angle(b, dot(fa.direction(a2), second), dot(fa.direction(n), second), near[0]),
            angle(b, dot(fb.direction(a1), first), dot(fb.direction(n), first), near[1]),
        ]
