"""Kinematics of body frames as expressions, folded to what the scene moves.

A rotation is kept as M * Rot(axis, angle). Rotations about a common axis merge into one angle expression,
so sines and cosines are taken of the sum once, and a planar scene never sees a matrix product. Components
that stay constant are floats or constant expressions; products with zeros vanish here or in the graph.
Vectors are lists of three scalars (expressions or floats) in world axes unless said otherwise. Units: m,
rad, s.
"""

from __future__ import annotations

from math import cos, sin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Builder, Expr

    Scalar = Expr | float
    Vector = list[Scalar]
    Matrix = list[list[Scalar]]
    Twist = tuple[Vector, Vector]

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WORLD_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SNAP = 4e-16  # a constant sine or cosine this near to 0 or +-1 is meant to be it


def constant(e: Scalar) -> float | None:
    """The value of a scalar that does not move, else None."""
    return e if isinstance(e, float) else e.value


def is_zero(e: Scalar) -> bool:
    return constant(e) == 0.0


def settle(e: Scalar) -> Scalar:
    """A float where the expression is constant, so that zeros are seen at once."""
    if isinstance(e, float):
        return e
    value = e.value
    return e if value is None else value


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    total: Scalar = 0.0
    for x, y in zip(a, b, strict=True):
        if not (is_zero(x) or is_zero(y)):
            total = total + x * y
    return total


def cross(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    return [
        dot((a[1], a[2]), (b[2], -b[1])),
        dot((a[2], a[0]), (b[0], -b[2])),
        dot((a[0], a[1]), (b[1], -b[0])),
    ]


def add(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    return [x + y for x, y in zip(a, b, strict=True)]


def subtract(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def scale(s: Scalar, a: Sequence[Scalar]) -> Vector:
    return [0.0 if is_zero(x) else s * x for x in a]


def times(m: Sequence[Sequence[Scalar]], a: Sequence[Scalar]) -> Vector:
    """M a"""
    return [dot(row, a) for row in m]


def transposed_times(m: Sequence[Sequence[Scalar]], a: Sequence[Scalar]) -> Vector:
    """M^T a"""
    return [dot([row[i] for row in m], a) for i in range(3)]


def product(m: Sequence[Sequence[Scalar]], n: Sequence[Sequence[Scalar]]) -> Matrix:
    columns = [[row[j] for row in n] for j in range(3)]
    return [[settle(dot(row, column)) for column in columns] for row in m]


def snapped(value: float) -> float:
    """Removes the rounding of constant sines and cosines, so that right angles fold."""
    for exact in (0.0, 1.0, -1.0):
        if abs(value - exact) < SNAP:
            return exact
    return value


def perpendicular(axis: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Two unit vectors e1, e2 with e1 x e2 = axis; along world axes where that is possible."""
    x, y, z = axis
    if z == 0.0 and (x or y):  # in the plane: the in-plane normal, then z
        first: tuple[float, ...] = (-y, x, 0.0)
        second: tuple[float, ...] = (0.0, 0.0, 1.0)
        return first, second
    if (abs(x) <= abs(y) and abs(x) <= abs(z)) or (x == 0.0 and y == 0.0):
        seed = (1.0, 0.0, 0.0)
    else:
        seed = (0.0, 1.0, 0.0) if abs(y) <= abs(z) else (0.0, 0.0, 1.0)
    along = sum(a * b for a, b in zip(seed, axis, strict=True))
    rest = [a - along * b for a, b in zip(seed, axis, strict=True)]
    length = sum(c * c for c in rest) ** 0.5
    e1 = tuple(snapped(c / length) for c in rest)
    e2 = (
        y * e1[2] - z * e1[1],
        z * e1[0] - x * e1[2],
        x * e1[1] - y * e1[0],
    )
    return e1, tuple(snapped(c) for c in e2)


class Rotation:
    """Orientation M * Rot(axis, angle); M is None for the identity. `angle` in rad."""

    __slots__ = ("_matrix", "angle", "axis", "b", "m")

    def __init__(
        self,
        b: Builder,
        m: Matrix | None = None,
        axis: tuple[float, float, float] | None = None,
        angle: Scalar = 0.0,
    ) -> None:
        self.b = b
        self.m = m
        self.axis = axis
        self.angle = angle
        self._matrix: Matrix | None = None

    def then(self, axis: tuple[float, float, float], q: Scalar) -> Rotation:
        """This orientation followed by a turn of `q` about `axis` of the turned frame."""
        if is_zero(q):
            return self
        if self.axis is None:
            return Rotation(self.b, self.m, axis, q)
        if axis == self.axis:
            return Rotation(self.b, self.m, axis, self.angle + q)
        if axis == tuple(-c for c in self.axis):
            return Rotation(self.b, self.m, self.axis, self.angle - q)
        return Rotation(self.b, self.matrix(), axis, q)

    def before(self, axis: tuple[float, float, float], q: Scalar) -> Rotation:
        """This orientation turned by `q` about a world axis."""
        if self.m is None and (self.axis is None or self.axis == axis):
            return self.then(axis, q)
        turned = Rotation(self.b, None, axis, q).matrix()
        m = turned if self.m is None else product(turned, self.m)
        return Rotation(self.b, m, self.axis, self.angle)

    def matrix(self) -> Matrix:
        """Rodrigues' formula: R = a a^T + cos (I - a a^T) + sin [a]x, times M from the left."""
        if self._matrix is None:
            self._matrix = self._build()
        return self._matrix

    def _build(self) -> Matrix:
        if self.axis is None:
            return [list(row) for row in (self.m or IDENTITY)]
        a, angle = self.axis, constant(self.angle)
        c: Scalar
        s: Scalar
        if angle is not None:
            c, s = snapped(cos(angle)), snapped(sin(angle))
        else:
            c, s = self.b.call("cos", self.angle), self.b.call("sin", self.angle)
        skew = ((0.0, -a[2], a[1]), (a[2], 0.0, -a[0]), (-a[1], a[0], 0.0))
        r: Matrix = []
        for i in range(3):
            row: Vector = []
            for j in range(3):
                outer = a[i] * a[j]
                entry: Scalar = outer
                if (rest := (1.0 if i == j else 0.0) - outer) != 0.0:
                    entry = entry + c * rest
                if skew[i][j] != 0.0:
                    entry = entry + s * skew[i][j]
                row.append(settle(entry))
            r.append(row)
        return r if self.m is None else product(self.m, r)

    def about_z(self) -> Scalar | None:
        """The angle from world x to body x where only z turns, else None."""
        if self.m is not None:
            return None
        if self.axis is None:
            return 0.0
        if self.axis == (0.0, 0.0, 1.0):
            return self.angle
        return -self.angle if self.axis == (0.0, 0.0, -1.0) else None

    def since(self, other: Rotation, axis: tuple[float, float, float]) -> Scalar | None:
        """The turn about `axis` that leads from `other` to this, full turns counted; None if not merged."""
        angles: list[Scalar] = []
        for r in (self, other):
            if r.axis is None:
                angles.append(0.0)
            elif r.axis == axis:
                angles.append(r.angle)
            elif r.axis == tuple(-c for c in axis):
                angles.append(-r.angle)
            else:
                return None
        same = self.m is other.m or (self.m is not None and other.m is not None and _equal(self.m, other.m))
        return angles[0] - angles[1] if same else None


def _equal(m: Matrix, n: Matrix) -> bool:
    """Are two constant matrices the same?"""
    for i in range(3):
        for j in range(3):
            a, b = constant(m[i][j]), constant(n[i][j])
            if a is None or b is None or abs(a - b) > SNAP:
                return False
    return True


class PointState:
    """Position [m] and velocity [m/s] of a point."""

    __slots__ = ("pos", "vel")

    def __init__(self, pos: Vector, vel: Vector) -> None:
        self.pos = pos
        self.vel = vel


class Frame:
    """A rigid frame: orientation, a reference point `ref` in its own axes that stands at `org` with velocity
    `vel`.

    The reference is the joint through which the body was reached, so points at the joint cost nothing. `own` is the
    angular velocity in the frame's axes where it is known without turning it back. `twist` is that and the velocity of the
    reference, both carried down the tree in the frames' own axes; kinetic energies read it where `in_own_axes` says so.
    """

    __slots__ = ("_points", "in_own_axes", "name", "omega", "org", "own", "ref", "rot", "twist", "vel")

    def __init__(
        self,
        name: str,
        rot: Rotation,
        ref: tuple[float, ...],
        org: Vector,
        vel: Vector,
        omega: Vector,
        own: Vector | None = None,
        twist: Twist | None = None,
    ) -> None:
        self.name = name
        self.rot = rot
        self.ref = ref
        self.org = org
        self.vel = vel
        self.omega = omega
        self.own = own
        self.twist, self.in_own_axes = twist, False
        self._points: dict[tuple[float, ...], PointState] = {}

    def point(self, local: tuple[float, ...]) -> PointState:
        """A point given in the frame's own axes [m]."""
        state = self._points.get(local)
        if state is None:
            arm = [a - b for a, b in zip(local, self.ref, strict=True)]
            if not any(arm):
                state = PointState(self.org, self.vel)
            else:
                r = times(self.rot.matrix(), arm)
                state = PointState(add(self.org, r), add(self.vel, cross(self.omega, r)))
            self._points[local] = state
        return state

    def speed_squared(self, local: tuple[float, ...]) -> Scalar:
        """Of a point, (v + R c)^2 with c = w x arm in the frame's own axes where w is known there: R^T R never appears."""
        arm = [a - b for a, b in zip(local, self.ref, strict=True)]
        if self.in_own_axes and self.twist is not None:
            w, v = self.twist
            v = add(v, cross(w, arm)) if any(arm) else v
            return dot(v, v) + 0.0
        if self.own is None or not any(arm):
            v = self.point(local).vel
            return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        across = cross(self.own, arm)
        return (
            dot(self.vel, self.vel)
            + 2.0 * dot(self.vel, times(self.rot.matrix(), across))
            + dot(across, across)
        )

    def direction(self, local: Sequence[float]) -> Vector:
        """A direction of the frame in world axes."""
        return times(self.rot.matrix(), local)

    def angle(self) -> Scalar | None:
        """From world x to its x about z, full turns counted; None where it turns about other axes too [rad]."""
        return self.rot.about_z()

    def spin(self) -> Vector:
        """Angular velocity in the frame's own axes [rad/s]."""
        if self.in_own_axes and self.twist is not None:
            return self.twist[0]
        if self.own is not None:
            return self.own
        if self.rot.m is None and (self.rot.axis is None or self._about_own_axis()):
            return self.omega
        return transposed_times(self.rot.matrix(), self.omega)

    def _about_own_axis(self) -> bool:
        """Is the angular velocity along the one axis the frame turns about? Then both axes see it alike."""
        assert self.rot.axis is not None
        zero = [is_zero(w) for w in self.omega]
        return all(z or a != 0.0 for z, a in zip(zero, self.rot.axis, strict=True)) and sum(zero) >= 2


class Moving:
    """A frame on its way from one body to the next, carried by elementary motions at a joint point."""

    __slots__ = ("b", "omega", "org", "own", "rot", "twist", "vel")

    def __init__(self, frame: Frame, at: tuple[float, ...]) -> None:
        point = frame.point(at)
        self.b = frame.rot.b
        self.rot = frame.rot
        self.org = point.pos
        self.vel = point.vel
        self.omega = frame.omega
        self.own = frame.own
        self.twist = frame.twist
        arm = [a - b for a, b in zip(at, frame.ref, strict=True)]
        if self.twist is not None and any(arm):
            w, v = self.twist
            self.twist = w, add(v, cross(w, arm))

    def turn(self, axis: tuple[float, float, float], q: Scalar, u: Scalar) -> None:
        """Turn about an axis of the present frame."""
        world = times(self.rot.matrix(), axis)
        self.rot = self.rot.then(axis, q)
        self.omega = add(self.omega, scale(u, world))
        if self.own is not None:
            turned = transposed_times(Rotation(self.b, None, axis, q).matrix(), self.own)
            self.own = add(turned, scale(u, axis))
        if self.twist is not None:
            turn = Rotation(self.b, None, axis, q).matrix()
            w, v = (transposed_times(turn, part) for part in self.twist)
            self.twist = add(w, scale(u, axis)), v

    def orient(self, r: Matrix, w: Vector, sign: float) -> None:
        """Turn by the rotation r of B in A, w the angular velocity against A in the axes of B: from A to B, or with
        sign -1 from B to A."""
        still = all(map(is_zero, self.omega))
        twist = self.twist
        before = [0.0] * 3 if still else self.own or transposed_times(self.rot.matrix(), self.omega)
        if sign > 0:
            self.rot = Rotation(self.b, product(self.rot.matrix(), r))
            self.own = add(transposed_times(r, before), w)
            self.twist = twist and (add(transposed_times(r, twist[0]), w), transposed_times(r, twist[1]))
        else:
            self.rot = Rotation(
                self.b, product(self.rot.matrix(), [list(row) for row in zip(*r, strict=True)])
            )
            self.own = times(r, subtract(before, w))
            self.twist = twist and (times(r, subtract(twist[0], w)), times(r, twist[1]))
        self.omega = times(self.rot.matrix(), self.own)

    def slide(self, axis: tuple[float, float, float], q: Scalar, u: Scalar) -> None:
        """Shift along an axis of the present frame."""
        world = times(self.rot.matrix(), axis)
        way = scale(q, world)
        self.org = add(self.org, way)
        self.vel = add(add(self.vel, scale(u, world)), cross(self.omega, way))
        if self.twist is not None:
            w, v = self.twist
            self.twist = w, add(add(v, scale(u, axis)), cross(w, scale(q, axis)))

    def shift_world(self, axis: tuple[float, float, float], s: Scalar, rate: Scalar) -> None:
        """A virtual shift along a world axis."""
        self.org = add(self.org, scale(s, axis))
        self.vel = add(self.vel, scale(rate, axis))
        self.twist = None

    def turn_world(self, axis: tuple[float, float, float], s: Scalar, rate: Scalar) -> None:
        """A virtual turn about a world axis through the joint point; it turns the angular velocity too."""
        self.rot = self.rot.before(axis, s)
        carried = times(Rotation(self.b, None, axis, s).matrix(), self.omega)
        self.omega = add(carried, scale(rate, axis))
        self.own = self.twist = None

    def frame(self, name: str, ref: tuple[float, ...]) -> Frame:
        """The body whose point `ref` stands here."""
        return Frame(name, self.rot, ref, self.org, self.vel, self.omega, self.own, self.twist)


def ground(b: Builder, in_space: bool = False) -> Frame:
    """`in_space`: velocities are carried down the tree in the bodies' own axes too."""
    zero: Vector = [0.0, 0.0, 0.0]
    twist = (zero, zero) if in_space else None
    return Frame("0", Rotation(b), (0.0, 0.0, 0.0), zero, zero, zero, None, twist)
