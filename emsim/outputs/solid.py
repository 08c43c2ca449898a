"""Solids of a spatial scene (glyphs/solids.py) on a film's frame, with a depth for each pixel, as web/solids.js draws them."""

from __future__ import annotations

import numpy as np

from .glyphs.solids import across, solids

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .stage import Stage

BIAS, DARKEST = (
    0.006,
    0.5,
)  # of the scene's size towards the eye; of a face that is turned away from the light


class Solids:
    """Parts of a stage's scene; `draw` gives RGB and where there is something, of `fine` pixels for one."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.parts = []
        for part in solids(stage.shapes, stage.size):
            faces = [np.array(face) for face in part["faces"]]
            # fans of triangles, with the face that each is of
            fans = [
                (f, face[0], face[k], face[k + 1])
                for f, face in enumerate(faces)
                for k in range(1, len(face) - 1)
            ]
            corners = np.array(
                [[face[0], face[1], face[2], face[3] if len(face) > 3 else face[0]] for face in faces]
            )
            self.parts.append(
                (part, np.array(part["points"], float), corners, np.array(fans), np.array(part["edges"]))
            )

    def draw(self, fine: int, colour: Callable[[str], tuple[int, int, int]]) -> tuple[Any, Any]:
        stage = self.stage
        shape = (stage.height * fine, stage.width * fine)
        pixels, depth = np.zeros((*shape, 3), np.uint8), np.full(shape, -np.inf)
        right, up, towards = stage.axes
        light = towards + 0.7 * up - 0.5 * right
        light = light / np.linalg.norm(light)
        ink = np.array(colour("edge"), np.uint8)
        for part, points, corners, fans, edges in self.parts:
            world = self._placed(part, points)
            if world is None:
                continue
            p = np.column_stack(
                [
                    fine * (stage.width / 2 + (world @ right - stage.middle[0]) * stage.scale),
                    fine * (stage.height / 2 - (world @ up - stage.middle[1]) * stage.scale),
                    world @ towards / stage.size,
                ]
            )
            normal = np.cross(
                world[corners[:, 2]] - world[corners[:, 0]], world[corners[:, 3]] - world[corners[:, 1]]
            )
            front = np.where(normal @ towards >= 0, 1, -1)
            size = np.linalg.norm(normal, axis=1)
            lit = np.maximum(0, front * (normal @ light) / np.where(size > 0, size, 1))
            shades = np.minimum(
                255, np.array(colour(part["colour"])) * (DARKEST + (1.06 - DARKEST) * lit)[:, None]
            )
            for f, a, b, c in fans:
                _triangle(pixels, depth, p[a], p[b], p[c], shades[f].astype(np.uint8))
            seen = (edges[:, 4] > 0) | (front[edges[:, 2]] != front[edges[:, 3]])
            for i, j, *_ in edges[seen]:
                _edge(pixels, depth, p[i], p[j], ink)
        return pixels, np.isfinite(depth) | (pixels.sum(axis=2) > 0)

    def _placed(self, part: dict[str, Any], points: Any) -> Any:
        """Points in the world (n, 3), m; None for a strut without a length."""
        stage = self.stage
        if "at" in part:
            return stage.world(part["at"]) + points @ stage.poses[int(part["at"][0])].turn.T
        start = stage.world(part["from"])
        x = stage.world(part["to"]) - start
        if not np.linalg.norm(x) > 0:
            return None
        y = np.array(across(list(x)))
        z = np.cross(x, y)
        return start + points @ np.array([x, y, z / np.linalg.norm(z)])


def _triangle(pixels: Any, depth: Any, a: Any, b: Any, c: Any, colour: Any) -> None:
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if not abs(area) > 1e-9:
        return
    corners = np.array([a, b, c])
    x0, y0 = np.maximum(np.ceil(corners[:, :2].min(axis=0)), 0).astype(int)
    x1, y1 = np.minimum(
        np.floor(corners[:, :2].max(axis=0)), (depth.shape[1] - 1, depth.shape[0] - 1)
    ).astype(int)
    if x0 > x1 or y0 > y1:
        return
    x, y = np.arange(x0, x1 + 1) - a[0], (np.arange(y0, y1 + 1) - a[1])[:, None]
    u = (x * (c[1] - a[1]) + y * (a[0] - c[0])) / area
    v = (x * (a[1] - b[1]) + y * (b[0] - a[0])) / area
    near = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
    part = depth[y0 : y1 + 1, x0 : x1 + 1]
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (near > part)
    part[inside] = near[inside]
    pixels[y0 : y1 + 1, x0 : x1 + 1][inside] = colour


def _edge(pixels: Any, depth: Any, a: Any, b: Any, colour: Any) -> None:
    steps = max(1, int(np.ceil(np.abs(b[:2] - a[:2]).max())))
    x, y, near = (a + np.linspace(0, 1, steps + 1)[:, None] * (b - a)).T
    columns, rows = np.rint(x).astype(int), np.rint(y).astype(int)
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        i, j = rows + dy, columns + dx
        inside = (i >= 0) & (i < depth.shape[0]) & (j >= 0) & (j < depth.shape[1])
        i, j, z = i[inside], j[inside], near[inside] + BIAS
        free = z > depth[i, j]
        pixels[i[free], j[free]] = colour
