"""pin: B turns against A about a common axis."""

from __future__ import annotations

from .base import Chain, Coord
from .rows import axis_kept, together, turned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ..kinematics import Frame, Scalar, Vector
    from .base import Closure


class Pin(Chain):
    name = "pin"
    aliases = ("revolute",)
    meaning = "turn about its axis"
    axis_default = (0.0, 0.0, 1.0)
    coordinates = (Coord("angle", "rad", "axis"),)
    speeds = (Coord("omega", "rad/s"),)
    carries = "turn"

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*together(d), *axis_kept(fa, fb, self.axis)]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        return [turned(b, fa, fb, self.axis, near[0])]
