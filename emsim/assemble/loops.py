"""Closed loops: what a cut joint, a rod, a gear or a drive that finds no coordinate demands of the others.

h(q, t) = 0 for every direction in which the joint cannot move, B relative to A. Rows that fold to the
constant 0 are dropped: in a planar scene these are the out-of-plane ones. The multiplier of a row is the
force in the direction of growing h, so it acts on B from A.
"""

from __future__ import annotations

from .kinematics import WORLD_AXES, Frame, constant, dot, perpendicular, settle, subtract

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Builder, Expr
    from .kinematics import Scalar, Vector
    from .scene import JointState

CLOSED = 1e-12  # a constant closure row below this is zero


class Row:
    """One constraint: h as it stands before symbols are replaced; `row` and `mu_row` are its unknowns."""

    __slots__ = ("h", "label", "mu_row", "owner", "place", "row", "unit")

    def __init__(self, owner: str, place: int, label: str, h: Expr, unit: str) -> None:
        self.owner = owner  # name of the joint, gear or drive
        self.place = place  # which row of the owner
        self.label = label
        self.h = h
        self.unit = unit  # of the multiplier: N or N m
        self.row = self.mu_row = -1


def closure(b: Builder, joint: JointState, fa: Frame, fb: Frame) -> list[tuple[str, Scalar, str]]:
    """All rows of a cut joint: (label, h, unit of the multiplier), always in the same places."""
    d = subtract(fb.point(joint.pb).pos, fa.point(joint.pa).pos)
    kind = joint.kind
    if kind == "pin":
        return [*_together(d), *_axis_kept(fa, fb, joint.card.direction)]
    if kind == "weld":
        return [*_together(d), *_aligned(b, joint, fa, fb)]
    if kind == "slide":
        return [*_across(fa, d, joint.card.direction), *_aligned(b, joint, fa, fb)]
    if kind == "pinslot":
        return [*_across(fa, d, joint.card.direction), *_axis_kept(fa, fb, WORLD_AXES[2])]
    if kind == "planar":
        height = dot(fa.direction(WORLD_AXES[2]), d)
        return [("height", height, "N"), *_axis_kept(fa, fb, WORLD_AXES[2])]
    if kind == "rod":
        square = settle(dot(d, d))
        length = b.call("sqrt", square)
        return [("length", length - (joint.length or 0.0), "N")]
    return []


def _together(d: Vector) -> list[tuple[str, Scalar, str]]:
    return [(axis, e, "N") for axis, e in zip("xyz", d, strict=True)]


def _across(fa: Frame, d: Vector, axis: tuple[float, float, float]) -> list[tuple[str, Scalar, str]]:
    """No displacement across the axis of A."""
    e1, e2 = perpendicular(axis)
    return [(f"across {k}", dot(fa.direction(e), d), "N") for k, e in ((1, e1), (2, e2))]


def _axis_kept(fa: Frame, fb: Frame, axis: tuple[float, float, float]) -> list[tuple[str, Scalar, str]]:
    """The axis, fixed in both bodies, stays common."""
    e1, e2 = perpendicular(axis)
    world = fb.direction(axis)
    # B tilted about -e2 moves the axis along e1, about e1 along e2 ... the sign only names the multiplier
    return [(f"tilt {k}", dot(fa.direction(e), world), "N m") for k, e in ((1, e1), (2, e2))]


def _aligned(b: Builder, joint: JointState, fa: Frame, fb: Frame) -> list[tuple[str, Scalar, str]]:
    """No turn of B against A, about z, x, y. Merged rotations: the angle, so half a turn is no solution."""
    base = fa.rot
    if joint.kind == "weld" and joint.card.zeros[0]:
        base = base.then(joint.card.direction, joint.card.zeros[0])
    about_z = fb.rot.since(base, WORLD_AXES[2])
    if about_z is not None:
        return [("turn z", about_z, "N m"), ("turn x", 0.0, "N m"), ("turn y", 0.0, "N m")]
    m, n = base.matrix(), fb.rot.matrix()

    def along(i: int, j: int) -> Scalar:
        return dot([row[i] for row in m], [row[j] for row in n])

    return [("turn z", along(1, 0), "N m"), ("turn x", along(2, 1), "N m"), ("turn y", along(0, 2), "N m")]


def measure(b: Builder, joint: JointState, fa: Frame, fb: Frame, near: Scalar = 0.0) -> list[Expr]:
    """The coordinates of a cut joint as functions of the others; an angle that did not merge is the one within
    half a turn of `near`, `zero=` counted in."""
    kind, zeros = joint.kind, joint.card.zeros
    d = subtract(fb.point(joint.pb).pos, fa.point(joint.pa).pos)
    if kind == "pin":
        values = [_turned(b, fa, fb, joint.card.direction, near)]
    elif kind == "slide":
        values = [dot(fa.direction(joint.card.direction), d)]
    elif kind == "pinslot":
        values = [dot(fa.direction(joint.card.direction), d), _turned(b, fa, fb, WORLD_AXES[2], near)]
    elif kind in ("planar", "free"):
        values = [dot(fa.direction(WORLD_AXES[k]), d) for k in (0, 1)] + [
            _turned(b, fa, fb, WORLD_AXES[2], near)
        ]
    else:
        values = []
    return [b.const(0.0) + v - zero for v, zero in zip(values, zeros, strict=False)]


def _turned(b: Builder, fa: Frame, fb: Frame, axis: tuple[float, float, float], near: Scalar) -> Scalar:
    """Angle of B against A about a common axis; by atan2, unless they merged."""
    merged = fb.rot.since(fa.rot, axis)
    if merged is not None:
        return merged
    e1, e2 = perpendicular(axis)
    x = fb.direction(e1)
    c, s = dot(fa.direction(e1), x), dot(fa.direction(e2), x)
    if constant(near) == 0.0:
        return b.call("atan2", s, c)
    cn, sn = b.call("cos", near), b.call("sin", near)
    return near + b.call("atan2", s * cn - c * sn, c * cn + s * sn)


def sort_out(rows: list[tuple[str, Scalar, str]]) -> tuple[list[int], int, str]:
    """(places of rows that stay, number that folded to zero, largest constant that is not zero, with its unit)."""
    stay, folded, gap, text = [], 0, 0.0, ""
    for k, (_, h, unit) in enumerate(rows):
        value = constant(h)
        if value is None:
            stay.append(k)
        elif abs(value) < CLOSED:
            folded += 1
        elif abs(value) > gap:
            gap = abs(value)
            text = f"{gap:.3g} {'m' if unit == 'N' else 'rad'}"
    return stay, folded, text
