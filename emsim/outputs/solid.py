"""Solids of a spatial scene (glyphs/solids.py) on a film's frame, with a depth for each pixel, as web/solids.js draws them."""

from __future__ import annotations

import math

import numpy as np

from .glyphs.meshes import across, normals
from .glyphs.solids import solids

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .stage import Stage


class Solids:
    """Parts of a stage's scene; `draw` gives RGB and where there is something, of `fine` pixels for one."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.parts = []
        for part in solids(stage.shapes, stage.size, stage.planar):
            faces = part["faces"]
            # fans of triangles: numbers of their points, and of their corners among the corners of all faces
            fans, first = [], 0
            for face in faces:
                fans += [
                    [face[0], face[k], face[k + 1], first, first + k, first + k + 1]
                    for k in range(1, len(face) - 1)
                ]
                first += len(face)
            corners = np.array([[*face[:3], face[3] if len(face) > 3 else face[0]] for face in faces])
            own = normals(part["points"], faces)
            points, edges = np.array(part["points"], float), np.array(part["edges"])
            outwards = np.sign(np.sum(_crossed(points, corners) * [n[0] for n in own], axis=1))
            of_face = np.repeat(np.arange(len(faces)), [len(face) - 2 for face in faces])
            self.parts.append(
                (part, points, corners, outwards, np.column_stack([np.array(fans), of_face]), edges,
                 np.array([n for one in own for n in one]))
            )  # fmt: skip

    def draw(self, fine: int, colour: Callable[[str], tuple[int, int, int]]) -> tuple[Any, Any]:
        stage = self.stage
        shape = (stage.height * fine, stage.width * fine)
        pixels, depth = np.zeros((*shape, 3), np.uint8), np.full(shape, -np.inf)
        right, up, towards = stage.axes
        ink = np.array(colour("edge"), np.uint8)
        for part, points, corners, outwards, fans, edges, normal in self.parts:
            turn = self._turn(part)
            if turn is None:
                continue
            world = turn[0] + points @ turn[1].T
            p = np.column_stack(
                [
                    fine * (stage.width / 2 + (world @ right - stage.middle[0]) * stage.scale),
                    fine * (stage.height / 2 - (world @ up - stage.middle[1]) * stage.scale),
                    world @ towards / stage.size,
                ]
            )
            lit = np.array(colour(part["colour"])), self._lit(normal @ np.linalg.inv(turn[1]))
            front = outwards * (_crossed(world, corners) @ towards) >= 0
            for a, b, c, i, j, k, _ in fans[front[fans[:, 6]]]:
                _triangle(pixels, depth, (p[a], p[b], p[c]), lit[0], lit[1][[i, j, k]])
            for i, j, *_ in edges[front[edges[:, 2]] != front[edges[:, 3]]]:
                _edge(pixels, depth, p[i], p[j], ink)
        return pixels, np.isfinite(depth) | (pixels.sum(axis=2) > 0)

    def _lit(self, normal: Any) -> Any:
        """Of normals (n, 3) the share of their colour that is seen, and of white (n, 2): a sky, a lamp over the left shoulder."""
        right, up, towards = self.stage.axes
        pull = np.array(self.stage.gravity, float)
        above = -pull / np.linalg.norm(pull) if pull.any() else up
        lamp = 0.6 * towards + above - 0.45 * right
        lamp /= np.linalg.norm(lamp)
        halfway = (lamp + towards) / np.linalg.norm(lamp + towards)
        normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
        level = 0.6 + 0.08 * (normal @ above) + 0.42 * np.maximum(0, normal @ lamp)
        return np.column_stack([level, 0.22 * np.maximum(0, normal @ halfway) ** 30])

    def _turn(self, part: dict[str, Any]) -> tuple[Any, Any] | None:
        """Where a part's points are in the world [m]: origin and matrix of its axes; None for a strut without a length."""
        stage = self.stage
        if "at" in part:
            return stage.world(part["at"]), stage.poses[int(part["at"][0])].turn
        start = stage.world(part["from"])
        x = stage.world(part["to"]) - start
        if not np.linalg.norm(x) > 0:
            return None
        y = np.array(across(list(x)))
        z = np.cross(x, y)
        return start, np.column_stack([x, y, z / np.linalg.norm(z)])


def _crossed(points: Any, corners: Any) -> Any:
    """Normals of faces, by two diagonals or two sides of a triangle."""
    a, b, c, d = (points[corners[:, k]] for k in range(4))
    return np.cross(c - a, d - b)


def _triangle(pixels: Any, depth: Any, corners: tuple[Any, Any, Any], colour: Any, lit: Any) -> None:
    a, b, c = corners
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if not abs(area) > 1e-9:
        return
    x0, y0 = (max(0, math.ceil(min(a[k], b[k], c[k]))) for k in (0, 1))
    x1, y1 = (min(depth.shape[1 - k] - 1, math.floor(max(a[k], b[k], c[k]))) for k in (0, 1))
    if x0 > x1 or y0 > y1:
        return
    x, y = np.arange(x0, x1 + 1) - a[0], (np.arange(y0, y1 + 1) - a[1])[:, None]
    u = (x * (c[1] - a[1]) + y * (a[0] - c[0])) / area
    v = (x * (a[1] - b[1]) + y * (b[0] - a[0])) / area
    near = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
    part = depth[y0 : y1 + 1, x0 : x1 + 1]
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (near > part)
    part[inside] = near[inside]
    level, gloss = (
        m[0] + u[inside] * (m[1] - m[0]) + v[inside] * (m[2] - m[0]) for m in (lit[:, 0], lit[:, 1])
    )
    shade = level[:, None] * colour + 255 * gloss[:, None]
    pixels[y0 : y1 + 1, x0 : x1 + 1][inside] = np.minimum(255, shade).astype(np.uint8)


def _edge(pixels: Any, depth: Any, a: Any, b: Any, colour: Any) -> None:
    steps = max(1, int(np.ceil(np.abs(b[:2] - a[:2]).max())))
    x, y, near = (a + np.linspace(0, 1, steps + 1)[:, None] * (b - a)).T
    columns, rows = np.rint(x).astype(int), np.rint(y).astype(int)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        i, j = rows + dy, columns + dx
        inside = (i >= 0) & (i < depth.shape[0]) & (j >= 0) & (j < depth.shape[1])
        i, j, z = i[inside], j[inside], near[inside] + 0.006
        free = z > depth[i, j]
        pixels[i[free], j[free]] = colour
