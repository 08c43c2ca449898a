"""weld: B does not move against A. `zero=` turns it about the axis."""

from __future__ import annotations

from .base import Chain
from .rows import aligned, together

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ..kinematics import Frame, Moving, Scalar, Vector
    from .base import Closure, Passed


class Weld(Chain):
    name = "weld"
    meaning = "nothing"
    axis_default = (0.0, 0.0, 1.0)
    drawn = carries = "weld"

    @classmethod
    def motions(cls) -> list[str]:
        return ["turn"]

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        if self.zeros[0]:
            moving.turn(self.axis, sign * self.zeros[0], 0.0)
        return []

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [*together(d), *aligned(fa.rot.then(self.axis, self.zeros[0]), fb)]
