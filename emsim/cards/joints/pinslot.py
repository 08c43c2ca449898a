"""pinslot: B turns about z and is displaced against A along an axis in the plane."""

from __future__ import annotations

from ..kinematics import WORLD_AXES
from .base import Chain, Coord
from .rows import across, axis_kept, shifted, turned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ...diagnostics import Sink
    from ..kinematics import Frame, Scalar, Vector
    from .base import Closure


class Pinslot(Chain):
    name = "pinslot"
    meaning = "slide along its axis, turn about z"
    axis_default = (1.0, 0.0, 0.0)
    coordinates = (Coord("pos", "m", "axis"), Coord("angle", "rad", "z"))
    speeds = (Coord("vel", "m/s"), Coord("omega", "rad/s"))
    main = 0
    drawn = "slide"

    def check(self, sink: Sink) -> None:
        if self.axis[2] != 0.0:
            card = self.card
            sink.error(
                "E232", f"axis= of a pinslot (JOINT {card.name}) lies in the plane", card.place("axis")
            )

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*across(fa, d, self.axis), *axis_kept(fa, fb, WORLD_AXES[2])]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        return [shifted(fa, d, self.axis), turned(b, fa, fb, WORLD_AXES[2], near[1])]
