"""free: coordinates of B against A, and nothing that holds it: x, y and an angle in a planar scene, in space

    x y z  along the axes of A, vx vy vz their derivatives
    e      the orientation as a quaternion, wx wy wz the angular velocity in the axes of B (see ball.py)
ic= and guess= of the latter are x, y, z and a rotation vector, then the six speeds.
"""

from __future__ import annotations

from ..kinematics import cross
from .ball import Ball
from .base import Coord
from .planar import Planar

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder, Expr
    from ..kinematics import Frame, Moving, Scalar, Vector
    from .base import Closure, Passed

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Free(Planar):
    name = "free"
    in_plane_only = True
    vectors: ClassVar[dict[str, tuple[int, ...]]] = {}

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return []


class FreeInSpace(Ball):
    """What becomes of `free` where something leaves the plane."""

    name = "free"
    meaning = "slide along x, y, z, turn in any direction"
    coordinates = (*(Coord(axis, "m", axis) for axis in "xyz"), *Ball.coordinates)
    speeds = (*(Coord(f"v{axis}", "m/s") for axis in "xyz"), *Ball.speeds)
    measures = ()
    vectors: ClassVar[dict[str, tuple[int, ...]]] = {}
    axis_default = None
    drawn = "none"

    @classmethod
    def motions(cls) -> list[str]:
        return ["slide"] * 3 + ["turn"] * 3

    def start(self, values: Sequence[float]) -> list[float] | None:
        """x, y, z and a rotation vector; or as in the plane, x, y and the angle."""
        if len(values) == 3:
            values = (values[0], values[1], 0.0, 0.0, 0.0, values[2])
        turned = super().start(values[3:]) if len(values) == 6 else None
        return None if turned is None else [*values[:3], *turned]

    def rates(self, q: Sequence[Expr], u: Sequence[Expr]) -> list[Scalar]:
        return [*u[:3], *super().rates(q[3:], u[3:])]

    def gyration(self, u: Sequence[Expr], p: Sequence[Expr]) -> list[Scalar]:
        return [0.0, 0.0, 0.0, *cross([*u[3:]], [*p[3:]])]

    def norms(self, q: Sequence[Expr]) -> list[Scalar]:
        return super().norms(q[3:])

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        steps = [
            (axis, sign * way, sign * speed) for axis, way, speed in zip(AXES, q[:3], u[:3], strict=True)
        ]
        if sign < 0:
            super().move(moving, q[3:], u[3:], sign)
        for axis, way, speed in steps:
            moving.slide(axis, way, speed)
        if sign > 0:
            super().move(moving, q[3:], u[3:], sign)
        return []

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return []

    def measure_speeds(self, fa: Frame, fb: Frame) -> list[Scalar]:
        return []
