"""The convex hull of points in space, with its volume and inertia.

Points are added one at a time to a closed surface of triangles: those that a point is in front of go, and a fan from their
outline to the point takes their place (Clarkson and Shor 1989, by search in place of the conflict graph). Inertia by tetrahedra
from the middle: with corners p, q, r and c = p . (q x r), volume c/6 and
    integral x_i x_j = c/120 ((p + q + r)_i (p + q + r)_j + p_i p_j + q_i q_j + r_i r_j)
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    Vector = tuple[float, ...]
    Face = tuple[int, int, int]
    Flat = tuple[Vector, float]
    Side = tuple[int, int, int, int]

MOST = 100  # corners: each is a place of touch with unknowns of its own
FLAT = 1e-9  # of the largest extent: a point that stands out by less is no corner


class Hull:
    """`corners` [m], `faces` of three numbers of corners, counter-clockwise from outside; `volume` [m^3], `centre` [m] and
    `inertia` Jxx Jyy Jzz Jxy Jxz Jyz by mass [m^2] about it. Triangles that lie in one plane are one of `flats`: their normal n
    [1] and d [m], n . p = d on them. `edges` are where two such meet: two corners and the flats left and right of the way from
    one to the other, seen from outside. ValueError where the points lie in one plane."""

    def __init__(self, points: Sequence[Sequence[float]]) -> None:
        found = [*dict.fromkeys(tuple(float(v) for v in p) for p in points)]
        low = [min(axis) for axis in zip(*found, strict=True)]
        self.flat = FLAT * max(
            max(axis) - least for axis, least in zip(zip(*found, strict=True), low, strict=True)
        )
        faces = self._first(found)
        for k in range(len(found)):
            faces = self._with(found, faces, k)
        used = sorted({k for face in faces for k in face})
        place = {k: n for n, k in enumerate(used)}
        self.corners: list[Vector] = [found[k] for k in used]
        self.faces: list[Face] = [(place[a], place[b], place[c]) for a, b, c in faces]
        self._weigh()
        self._unfold()

    def _first(self, points: list[Vector]) -> list[Face]:
        """A tetrahedron of points that are far apart."""
        a = min(range(len(points)), key=lambda k: points[k])
        b = max(range(len(points)), key=lambda k: _square(_less(points[k], points[a])))
        side = _less(points[b], points[a])
        c = max(range(len(points)), key=lambda k: _square(crossed(side, _less(points[k], points[a]))))
        normal = crossed(side, _less(points[c], points[a]))
        size = _square(normal) ** 0.5
        d = max(range(len(points)), key=lambda k: abs(_dot(normal, _less(points[k], points[a]))))
        high = _dot(normal, _less(points[d], points[a]))
        if not size or abs(high) <= self.flat * size:
            raise ValueError("its points lie in one plane")
        if high > 0.0:
            b, c = c, b
        return [(a, b, c), (a, c, d), (c, b, d), (b, a, d)]

    def _with(self, points: list[Vector], faces: list[Face], k: int) -> list[Face]:
        """The hull with one point more."""
        seen = [face for face in faces if self._above(points, face, points[k])]
        if not seen:
            return faces
        sides = {(face[j], face[(j + 1) % 3]) for face in seen for j in range(3)}
        rim = [(p, q) for p, q in sides if (q, p) not in sides]
        gone = set(seen)
        return [face for face in faces if face not in gone] + [(p, q, k) for p, q in rim]

    def _unfold(self) -> None:
        """Flats and edges."""
        at = {(face[j], face[(j + 1) % 3]): n for n, face in enumerate(self.faces) for j in range(3)}
        flat = [*range(len(self.faces))]
        areas = []
        for face in self.faces:
            p, q, r = (self.corners[k] for k in face)
            areas.append(crossed(_less(q, p), _less(r, p)))
        for (a, b), n in at.items():
            m = at[b, a]
            beyond = next(c for c in self.faces[m] if c not in (a, b))
            high = _dot(areas[n], _less(self.corners[beyond], self.corners[a]))
            if abs(high) <= self.flat * _square(areas[n]) ** 0.5 and flat[n] != flat[m]:
                flat = [flat[n] if k == flat[m] else k for k in flat]
        numbers = {k: n for n, k in enumerate(dict.fromkeys(flat))}
        self.flats: list[Flat] = []
        for k in numbers:
            whole = [
                sum(c) for c in zip(*(a for a, m in zip(areas, flat, strict=True) if m == k), strict=True)
            ]
            way = tuple(c / _square(whole) ** 0.5 for c in whole)
            self.flats.append((way, _dot(way, self.corners[self.faces[k][0]])))
        self.edges: list[Side] = [
            (a, b, numbers[flat[n]], numbers[flat[at[b, a]]])
            for (a, b), n in at.items()
            if a < b and flat[n] != flat[at[b, a]]
        ]

    def _above(self, points: list[Vector], face: Face, p: Vector) -> bool:
        a, b, c = (points[k] for k in face)
        normal = crossed(_less(b, a), _less(c, a))
        return _dot(normal, _less(p, a)) > self.flat * _square(normal) ** 0.5

    def _weigh(self) -> None:
        count = len(self.corners)
        middle = tuple(sum(axis) / count for axis in zip(*self.corners, strict=True))
        total, first, second = 0.0, [0.0] * 3, [[0.0] * 3 for _ in range(3)]
        for face in self.faces:
            p, q, r = (_less(self.corners[k], middle) for k in face)
            c = _dot(p, crossed(q, r))
            total += c / 6.0
            for i in range(3):
                si = p[i] + q[i] + r[i]
                first[i] += c * si / 24.0
                for j in range(3):
                    sj = p[j] + q[j] + r[j]
                    second[i][j] += c * (si * sj + p[i] * p[j] + q[i] * q[j] + r[i] * r[j]) / 120.0
        off = [v / total for v in first]
        s = [[second[i][j] / total - off[i] * off[j] for j in range(3)] for i in range(3)]
        self.volume = total
        self.centre = tuple(a + b for a, b in zip(middle, off, strict=True))
        self.inertia = (
            s[1][1] + s[2][2], s[0][0] + s[2][2], s[0][0] + s[1][1], -s[0][1], -s[0][2], -s[1][2],
        )  # fmt: skip


def _less(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def crossed(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _square(a: Sequence[float]) -> float:
    return _dot(a, a)
