"""A surface of loose triangles as points that faces share, for pictures and pages."""

from __future__ import annotations

import numpy as np

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray


class Surface:
    """`points` (n, 3) in steps of `step` from `low` (3,), whole numbers; `faces` (m, 3), numbers of points, counter-clockwise as
    seen from outside."""

    __slots__ = ("faces", "low", "points", "step")

    def __init__(
        self, points: NDArray[np.uint16], faces: NDArray[np.int32], low: NDArray[np.float64], step: float
    ) -> None:
        self.points, self.faces, self.low, self.step = points, faces, low, step

    def __reduce__(self) -> tuple[Any, ...]:
        return Surface, (self.points, self.faces, self.low, self.step)

    def scaled(self, factor: float) -> Surface:
        return Surface(self.points, self.faces, self.low * factor, self.step * factor)

    def places(self) -> list[list[float]]:
        """Where the points are."""
        found: list[list[float]] = (self.low + self.step * self.points).tolist()
        return found

    def box(self) -> list[list[float]]:
        """The lowest and the highest coordinates."""
        return [self.low.tolist(), (self.low + self.step * self.points.max(axis=0)).tolist()]


def welded(triangles: NDArray[np.float64]) -> Surface:
    """Corners that are the same number of steps are one point; triangles that are a line or a point then are left out. Corners
    of shape (n, 3, 3), n > 0. Raises ValueError where nothing is left."""
    corners = triangles.reshape(-1, 3)
    low = corners.min(axis=0)
    # three numbers of two bytes are a point; an even number of steps, or rounding would part what lies in the middle
    step = float((corners.max(axis=0) - low).max()) / 65534
    if not step > 0:
        raise ValueError("all its corners are one point")
    whole = np.rint((corners - low) / step).astype(np.uint16)
    points, numbers = np.unique(whole, axis=0, return_inverse=True)
    faces = numbers.reshape(-1, 3).astype(np.int32)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    if not len(faces):
        raise ValueError("all its triangles are lines")
    return Surface(points, faces, low, step)
