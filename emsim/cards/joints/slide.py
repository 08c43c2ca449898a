"""slide: B is displaced against A along an axis, without turning."""

from __future__ import annotations

from .base import Chain, Coord
from .rows import across, aligned, shifted

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ..kinematics import Frame, Scalar, Vector
    from .base import Closure


class Slide(Chain):
    name = "slide"
    aliases = ("prismatic",)
    meaning = "slide along its axis"
    axis_default = (1.0, 0.0, 0.0)
    coordinates = (Coord("pos", "m", "axis"),)
    speeds = (Coord("vel", "m/s"),)
    drawn = carries = "slide"

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*across(fa, d, self.axis), *aligned(fa.rot, fb)]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        return [shifted(fa, d, self.axis)]
