"""Rotations, poses, and what solids weigh: volume, centre and inertia, of meshes too.

Homogeneous solids of density 1 about their centres, m the volume:
    box (half sizes a b c)        m = 8abc,               Jxx = m (b^2 + c^2)/3
    ellipsoid (a b c)             m = 4/3 pi abc,         Jxx = m (b^2 + c^2)/5
    cylinder (r, half length h)   m = 2 pi r^2 h,         Jxx = m (r^2/4 + h^2/3),  Jzz = m r^2/2
    capsule (r, h)                the cylinder and two half balls, each m' = 2/3 pi r^3 with its centre 3r/8 beyond the cylinder:
                                  Jxx += 2 m' (83/320 r^2 + (h + 3r/8)^2),  Jzz += 2 m' 2/5 r^2
    closed mesh                   sums over its triangles of the tetrahedra with the origin, volumes with their signs
                                  (D. Eberly, Polyhedral Mass Properties, 2002; here as second moments C, J = tr(C) I - C)
Parallel axes: J about another point adds m (d.d I - d d^T).
"""

from __future__ import annotations

from math import pi

import numpy as np

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

UNIT = np.eye(3)


def about(axis: Sequence[float] | Array, angle: float) -> Array:
    """The rotation by `angle` [rad] about a unit vector (Rodrigues)."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return UNIT + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


def by_quaternion(q: Sequence[float] | Array) -> Array:
    """Of w x y z, of any length but 0."""
    e = np.asarray(q) / np.linalg.norm(q)
    w, v = e[0], e[1:]
    k = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return UNIT + 2.0 * (w * k + k @ k)


def rotation_vector(r: Array) -> Array:
    """Axis times angle of a rotation, the angle in 0 .. pi."""
    # the quaternion's largest component first: no difference of nearly equal numbers (S. W. Shepperd, 1978)
    four = np.array([1.0 + np.trace(r), *(1.0 + 2.0 * r[k, k] - np.trace(r) for k in range(3))])
    k = int(np.argmax(four))
    skew = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    if k == 0:
        w, v = four[0], skew
    else:
        w, v = skew[k - 1], r[:, k - 1] + r[k - 1, :]
        v[k - 1] = four[k]
    if w < 0.0:
        w, v = -w, -v
    size = float(np.linalg.norm(v))
    return v * (2.0 * np.arctan2(size, w) / size) if size else np.zeros(3)


class Pose:
    """Where a frame is in another one: p + R x."""

    __slots__ = ("p", "r")

    def __init__(self, p: Iterable[float] = (0.0, 0.0, 0.0), r: Array = UNIT) -> None:
        self.p, self.r = np.array([*p], dtype=float), r

    def then(self, inner: Pose) -> Pose:
        return Pose(self.p + self.r @ inner.p, self.r @ inner.r)


class Mass:
    """m [kg], its centre [m] and the tensor about the centre [kg m^2], in the axes of some frame."""

    __slots__ = ("centre", "m", "tensor")

    def __init__(
        self, m: float = 0.0, centre: Iterable[float] = (0.0, 0.0, 0.0), tensor: Array | None = None
    ) -> None:
        self.m, self.centre = m, np.array([*centre], dtype=float)
        self.tensor = np.zeros((3, 3)) if tensor is None else tensor

    def times(self, factor: float) -> Mass:
        return Mass(self.m * factor, self.centre, self.tensor * factor)

    def placed(self, at: Pose) -> Mass:
        """The same in the axes of the frame in which `at` stands."""
        return Mass(self.m, at.p + at.r @ self.centre, at.r @ self.tensor @ at.r.T)

    def moment(self, point: Array) -> Array:
        """The tensor about a point."""
        return self.tensor + self.m * steiner(self.centre - point)


def steiner(d: Array) -> Array:
    return np.asarray(d @ d * UNIT - np.outer(d, d))


def together(parts: Sequence[Mass]) -> Mass:
    """One mass of several in the same axes; a single one is left as it is."""
    if len(parts) == 1:
        return parts[0]
    m = sum(part.m for part in parts)
    centre = sum((part.m * part.centre for part in parts), np.zeros(3)) / m if m else np.zeros(3)
    return Mass(m, centre, sum((part.moment(centre) for part in parts), np.zeros((3, 3))))


# ---- solids of density 1 ------------------------------------------------------------------------------


def box(a: float, b: float, c: float) -> Mass:
    return _diagonal(8.0 * a * b * c, (a, b, c), 3.0)


def ellipsoid(a: float, b: float, c: float) -> Mass:
    return _diagonal(4.0 / 3.0 * pi * a * b * c, (a, b, c), 5.0)


def _diagonal(m: float, halves: Sequence[float], share: float) -> Mass:
    squares = np.square(halves)
    return Mass(m, (0.0, 0.0, 0.0), np.diag(m * (squares.sum() - squares) / share))


def cylinder(r: float, h: float) -> Mass:
    """Along z, of half length h."""
    m = 2.0 * pi * r * r * h
    across = m * (r * r / 4.0 + h * h / 3.0)
    return Mass(m, (0.0, 0.0, 0.0), np.diag([across, across, m * r * r / 2.0]))


def capsule(r: float, h: float) -> Mass:
    """A cylinder with a half ball at each end."""
    middle, half = cylinder(r, h), 2.0 / 3.0 * pi * r**3
    across = 2.0 * half * (83.0 / 320.0 * r * r + (h + 3.0 * r / 8.0) ** 2)
    ends = np.diag([across, across, 4.0 / 5.0 * half * r * r])
    return Mass(middle.m + 2.0 * half, (0.0, 0.0, 0.0), middle.tensor + ends)


def mesh(triangles: Array) -> Mass:
    """Of a closed surface, (n, 3, 3) corners. Raises ValueError where it is not closed or encloses nothing."""
    # from a point amid it: far from the origin nothing is to cancel
    origin = triangles.reshape(-1, 3).mean(axis=0)
    t = triangles - origin
    if not _is_closed(triangles):
        raise ValueError("its surface is not closed: it encloses no volume")
    six = np.einsum("ni,ni->n", t[:, 0], np.cross(t[:, 1], t[:, 2]))
    volume = float(six.sum()) / 6.0
    size = float(np.abs(t).max())
    # 2^-40: far above the rounding of a sum of products of double numbers, far below any solid's share of its box
    if not abs(volume) > 2.0**-40 * size**3:
        raise ValueError("it encloses no volume")
    total = t.sum(axis=1)
    centre = np.einsum("n,ni->i", six, total) / (24.0 * volume)
    # second moments of a tetrahedron with a corner at 0: V/20 (sum of v v^T + s s^T), s the sum of its corners
    second = np.einsum("n,nki,nkj->ij", six, t, t) + np.einsum("n,ni,nj->ij", six, total, total)
    second = second / 120.0 - volume * np.outer(centre, centre)
    # corners in the other order make all signs negative
    sign = 1.0 if volume > 0.0 else -1.0
    return Mass(sign * volume, origin + centre, sign * (np.trace(second) * UNIT - second))


def _is_closed(triangles: Array) -> bool:
    """Does every edge have a partner that runs the other way?"""
    _, at = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    corners = at.reshape(-1, 3)
    corners = corners[
        (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    ]  # a triangle without area closes nothing
    edges = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
    count = int(at.max()) + 1
    forth, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    return bool(np.array_equal(np.sort(forth), np.sort(back)))


def is_possible(tensor: Array) -> tuple[bool, bool]:
    """(could kinetic energy never be negative, could a body of masses have it): eigenvalues not below 0, none above the sum of
    the others; to the rounding of their largest."""
    values = np.linalg.eigvalsh(0.5 * (tensor + tensor.T))
    # 1e-9: files are rounded, and what they round to (a flat plate, a thin rod) lies on the edge
    tiny = 1e-9 * float(np.abs(values).max())
    return bool(values[0] >= -tiny), bool(values[2] <= values[0] + values[1] + tiny)
