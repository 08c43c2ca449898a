"""ball: B turns against A about a point.

Orientation of B in A: a quaternion e = (e0, v) with R = I + s (e0 [v]x + [v]x [v]x), s = 2/(e.e). That is a rotation whatever
the length of e, so what an integrator leaves of e.e - 1 turns nothing. Speeds: the angular velocity w of B against A in the axes
of B,
    e' = N w:    e0' = -v.w/2,    v' = (e0 w + v x w)/2
and, as w is no derivative of coordinates, for p = dL/dw
    p' + w x p = N^T dL/de + powers + loops        (Hamel; P.C. Mitiguy, T.R. Kane, Int. J. Robotics Research 15 (1996) 522)
There is no pose in which the coordinates fail, as angles do.
"""

from __future__ import annotations

from math import cos, hypot, sin

from ..kinematics import add, cross, dot, scale, subtract, transposed_times
from .base import Coord, JointKind
from .rows import together

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder, Expr
    from ..kinematics import Frame, Matrix, Moving, Scalar, Vector
    from .base import Axis, Closure, Passed


class Ball(JointKind):
    name = "ball"
    meaning = "turn about its point in any direction"
    coordinates = tuple(Coord(f"e{k}", "rad") for k in range(4))
    speeds = tuple(Coord(f"w{k}", "rad/s") for k in "xyz")
    measures: ClassVar[tuple[Coord, ...]] = (Coord("swing", "rad"), Coord("twist", "rad"))
    vectors: ClassVar[dict[str, tuple[int, ...]]] = {"": (0, 1, 2)}
    axis_default: ClassVar[Axis | None] = (0.0, 0.0, 1.0)  # from which swing and twist are told
    quasi = True
    has_zero = False

    @classmethod
    def motions(cls) -> list[str]:
        return ["turn"] * 3

    def start(self, values: Sequence[float]) -> list[float] | None:
        """From a rotation vector: its direction is the axis, its length the angle [rad]."""
        if len(values) != 3:
            return [1.0, 0.0, 0.0, 0.0] if not any(values) else None
        half = 0.5 * hypot(*values)
        share = 0.5 * (sin(half) / half if half else 1.0)
        return [cos(half), *(share * v for v in values)]

    def rates(self, q: Sequence[Expr], u: Sequence[Expr]) -> list[Scalar]:
        e0, *v = q
        turned = add(scale(e0, u), cross(v, u))
        return [-0.5 * dot(v, u), *(0.5 * t for t in turned)]

    def gyration(self, u: Sequence[Expr], p: Sequence[Expr]) -> list[Scalar]:
        return cross(u, p)

    def norms(self, q: Sequence[Expr]) -> list[Scalar]:
        return [dot(q, q) - 1.0]

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        moving.orient(matrix(q), [*u], sign)
        return []

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        return together(d)

    def measure_speeds(self, fa: Frame, fb: Frame) -> list[Scalar]:
        return transposed_times(fb.rot.matrix(), subtract(fb.omega, fa.omega))


def matrix(e: Sequence[Scalar]) -> Matrix:
    e0, x, y, z = e
    s = 2.0 / dot(e, e)
    sx, sy, sz = s * x, s * y, s * z
    xx, yy, zz, xy, xz, yz = sx * x, sy * y, sz * z, sx * y, sx * z, sy * z
    ex, ey, ez = sx * e0, sy * e0, sz * e0
    return [
        [1.0 - (yy + zz), xy - ez, xz + ey],
        [xy + ez, 1.0 - (xx + zz), yz - ex],
        [xz - ey, yz + ex, 1.0 - (xx + yy)],
    ]
