"""planar: B moves against A in the plane z = const."""

from __future__ import annotations

from ..kinematics import WORLD_AXES
from .base import Chain, Coord
from .rows import axis_kept, shifted, turned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder
    from ..kinematics import Frame, Scalar, Vector
    from .base import Closure


class Planar(Chain):
    name = "planar"
    meaning = "slide along x, slide along y, turn about z"
    coordinates = (Coord("x", "m", "x"), Coord("y", "m", "y"), Coord("angle", "rad", "z"))
    speeds = (Coord("vx", "m/s"), Coord("vy", "m/s"), Coord("omega", "rad/s"))
    vectors: ClassVar[dict[str, tuple[int, ...]]] = {"slide": (0, 1)}
    drawn = "none"

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return [("height", shifted(fa, d, WORLD_AXES[2]), "N"), *axis_kept(fa, fb, WORLD_AXES[2])]

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        way = [shifted(fa, d, WORLD_AXES[k]) for k in (0, 1)]
        return [*way, turned(b, fa, fb, WORLD_AXES[2], near[2])]
