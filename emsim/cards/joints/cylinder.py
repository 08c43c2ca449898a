"""cylinder: B turns about an axis and is displaced along it."""

from __future__ import annotations

from .base import Chain, Coord
from .rows import across, axis_kept, shifted, turned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ..kinematics import Frame, Scalar, Vector
    from .base import Closure


class Cylinder(Chain):
    name = "cylinder"
    meaning = "slide along its axis, turn about it"
    axis_default = (0.0, 0.0, 1.0)
    coordinates = (Coord("pos", "m", "axis"), Coord("angle", "rad", "axis"))
    speeds = (Coord("vel", "m/s"), Coord("omega", "rad/s"))
    drawn = "slide"

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*across(fa, d, self.axis), *axis_kept(fa, fb, self.axis)]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        return [shifted(fa, d, self.axis), turned(b, fa, fb, self.axis, near[1])]
