"""What closure rows and measured coordinates of the kinds are made of: displacements, common axes, alignment.

The sign of a row only names its multiplier, the force in the direction of growing h, which acts on B from A.
"""

from __future__ import annotations

from ..kinematics import WORLD_AXES, constant, cross, dot, perpendicular

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..._engine import Builder
    from ..kinematics import Frame, Rotation, Scalar, Vector
    from .base import Axis, Closure


def together(d: Vector) -> Closure:
    """The two points coincide."""
    return [(axis, e, "N") for axis, e in zip("xyz", d, strict=True)]


def across(fa: Frame, d: Vector, axis: Axis) -> Closure:
    """No displacement across the axis of A."""
    e1, e2 = perpendicular(axis)
    return [(f"across {k}", dot(fa.direction(e), d), "N") for k, e in ((1, e1), (2, e2))]


def axis_kept(fa: Frame, fb: Frame, axis: Axis) -> Closure:
    """The axis, fixed in both bodies, stays common."""
    e1, e2 = perpendicular(axis)
    world = fb.direction(axis)
    return [(f"tilt {k}", dot(fa.direction(e), world), "N m") for k, e in ((1, e1), (2, e2))]


def aligned(base: Rotation, fb: Frame) -> Closure:
    """No turn of B against `base`, about z, x, y. Merged rotations: the angle, so half a turn is no solution."""
    about_z = fb.rot.since(base, WORLD_AXES[2])
    if about_z is not None:
        return [("turn z", about_z, "N m"), ("turn x", 0.0, "N m"), ("turn y", 0.0, "N m")]
    m, n = base.matrix(), fb.rot.matrix()

    def along(i: int, j: int) -> Scalar:
        return dot([row[i] for row in m], [row[j] for row in n])

    return [("turn z", along(1, 0), "N m"), ("turn x", along(2, 1), "N m"), ("turn y", along(0, 2), "N m")]


def angle(b: Builder, c: Scalar, s: Scalar, near: Scalar) -> Scalar:
    """The angle of cosine c and sine s within half a turn of `near`."""
    if constant(near) == 0.0:
        return b.call("atan2", s, c)
    cn, sn = b.call("cos", near), b.call("sin", near)
    return near + b.call("atan2", s * cn - c * sn, c * cn + s * sn)


def turned(b: Builder, fa: Frame, fb: Frame, axis: Axis, near: Scalar) -> Scalar:
    """Angle of B against A about a common axis; full turns are counted where the rotations merged."""
    merged = fb.rot.since(fa.rot, axis)
    if merged is not None:
        return merged
    e1, e2 = perpendicular(axis)
    x = fb.direction(e1)
    return angle(b, dot(fa.direction(e1), x), dot(fa.direction(e2), x), near)


def shifted(fa: Frame, d: Vector, axis: Axis) -> Scalar:
    """Displacement along an axis of A."""
    return dot(fa.direction(axis), d)


def normal(axis: Sequence[float], to: Sequence[float]) -> Axis:
    """axis x to"""
    x, y, z = cross([*axis], [*to])
    return float(x), float(y), float(z)  # type: ignore[arg-type]
