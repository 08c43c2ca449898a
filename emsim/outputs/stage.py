"""The machine at an instant: where every body is, how large every quantity, and where that lies on a picture.

The scene is that of assemble/drawing.py with its channels recorded beside a table's time; web/machine.js does the same in
the page. Spatial scenes are seen in parallel projection from the page's first view, `YAW` and `PITCH` from the z axis.
"""

from __future__ import annotations

import math

import numpy as np

from .glyphs.extent import extents, walled
from .glyphs.mesh import sewn

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..table import Table
    from .glyphs.contract import Place, Point

YAW, PITCH = -0.6, -0.45  # [rad]
MARGIN = 46 / 480  # of the width
SWEPT = 240  # times at which the room is measured that the machine needs


class Pose:
    """Origin [m] and rotation matrix of a body; `angle` about z in a planar scene."""

    __slots__ = ("angle", "origin", "turn")

    def __init__(self, values: Sequence[float], planar: bool) -> None:
        self.angle = 0.0
        if planar:
            x, y, self.angle = values
            c, s = math.cos(self.angle), math.sin(self.angle)
            self.origin, self.turn = np.array([x, y, 0.0]), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        else:
            self.origin, self.turn = np.array(values[:3]), np.reshape(values[3:], (3, 3))


def instants(table: Table) -> np.ndarray:
    """What a film goes along: the time [s], of a machine that swings in its modes the number of the mode; 0 of one that rests."""
    own = None if table.scene is None else table.scene.axis
    if own is not None:
        return np.frombuffer(own)
    return np.zeros(1) if table.axis is None and len(table) == 1 else table.time


def _meshed(shape: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
    """A shape, with the points and faces of its surface."""
    if "mesh" not in shape:
        return shape
    surface = data["meshes"][shape["mesh"]]
    points, faces = surface.places(), surface.faces.tolist()
    return {**shape, "points": points, "faces": faces, **sewn(points, faces)}


class Stage:
    """Shapes and camera. `at(t)` sets the instant; then `value`, `share`, `world` and `place` speak of it.

    shapes, points, view, gravity   as the scene has them; arrows: forces and torques are shown
    width, height                   of the picture [px]; scale [px/m]; size: the larger side of the machine's room [m]
    """

    def __init__(self, table: Table, width: int) -> None:
        assert table.scene is not None
        data: dict[str, Any] = table.scene.data
        self.shapes: list[dict[str, Any]] = [_meshed(s, data) for s in data["shapes"]]
        self.points: dict[str, Place] = {p["name"]: p["at"] for p in data["points"]}
        self.view: dict[str, Any] = data["view"]
        self.arrows = True
        self.gravity, self.planar, self._bodies = data["gravity"], data["planar"], data["bodies"]
        # .view solid=yes: bodies in the plane have thickness and light
        self.solid = not self.planar or self.view.get("solid") == "yes"
        self.time = instants(table)
        waves = table.scene.waves
        self._columns = [np.frombuffer(waves.column(k)) for k in range(waves.columns)]
        self.largest = [float(np.max(np.abs(c), where=np.isfinite(c), initial=0.0)) for c in self._columns]
        # rounding beside the largest of a unit is nothing: a force beside the forces of the others
        units, tops = np.array([c["unit"] for c in data["channels"]]), np.array(self.largest)
        self._noise = [1e-9 * float(tops[units == unit].max()) for unit in units]
        self.values: list[float] = []
        self.poses: list[Pose] = []
        self.at(float(self.time[0]))
        self.follow, self.room = False, 0.0
        self.box = self._measure()
        self.size = max(self.box[2] - self.box[0], self.box[3] - self.box[1]) or 1e-3
        self._fit(width)
        if self.follow:
            self.size = self.room

    # the instant -------------------------------------------------------------------------------------

    def at(self, t: float) -> None:
        values = [float(np.interp(t, self.time, c)) for c in self._columns]
        self.values = [0.0 if abs(v) < noise else v for v, noise in zip(values, self._noise, strict=True)]
        self.poses = [Pose([self.value(ref) for ref in body["at"]], self.planar) for body in self._bodies]

    def value(self, ref: str | float) -> float:
        """A channel "#k", or the number itself."""
        return self.values[int(ref[1:])] if isinstance(ref, str) else ref

    def share(self, ref: str | float) -> float:
        """The value in parts of its largest size over the run, -1 .. 1."""
        return self.value(ref) / (self.top(ref) or 1.0) if isinstance(ref, str) else float(np.sign(ref))

    def top(self, ref: str | float) -> float:
        return self.largest[int(ref[1:])] if isinstance(ref, str) else abs(ref)

    # from bodies to the picture ----------------------------------------------------------------------

    def world(self, place: Place) -> np.ndarray:
        """Shape (3,), m."""
        pose = self.poses[int(place[0])]
        return np.asarray(pose.origin + pose.turn @ np.asarray(place[1:4], dtype=float))

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The picture's in the world: to the right, upwards, towards the eye. What gravity pulls down is below: y is up, or z."""
        if self.planar:
            return np.eye(3)[0], np.eye(3)[1], np.eye(3)[2]
        cy, sy, cp, sp = math.cos(YAW), math.sin(YAW), math.cos(PITCH), math.sin(PITCH)
        turn = np.array([[cy, 0, sy], [-sp * sy, cp, sp * cy], [-cp * sy, -sp, cp * cy]])
        if abs(self.gravity[2]) > math.hypot(self.gravity[0], self.gravity[1]):
            turn = np.column_stack([turn[:, 0], -turn[:, 2], turn[:, 1]])
        return turn[0], turn[1], turn[2]

    def flat(self, p: Sequence[float] | np.ndarray) -> tuple[float, float]:
        """World metres on the picture's plane, y upwards."""
        right, up, _ = self.axes
        return float(right @ np.asarray(p)), float(up @ np.asarray(p))

    def nearness(self, place: Place) -> float:
        """How near to the eye a place lies [m]."""
        return float(self.axes[2] @ self.world(place))

    def screen(self, p: np.ndarray) -> Point:
        x, y = self.flat(p)
        return (
            self.width / 2 + (x - self.middle[0]) * self.scale,
            self.height / 2 - (y - self.middle[1]) * self.scale,
        )

    def place(self, place: Place) -> Point:
        return self.screen(self.world(place))

    def axis_angle(self, shape: dict[str, Any]) -> float:
        """Direction of a joint's axis on the picture [rad], y downwards."""
        origin = self.world(shape["a"])
        along = self.poses[int(shape["a"][0])].turn @ np.asarray(shape["axis"], dtype=float)
        (x0, y0), (x1, y1) = self.screen(origin), self.screen(origin + 0.1 * self.size * along)
        return math.atan2(y1 - y0, x1 - x0)

    def course(self, place: Place, times: Sequence[float]) -> list[Point]:
        """Where a place is at the times; the instant stays what it was."""
        body = self._bodies[int(place[0])]["at"]
        columns = [
            np.interp(times, self.time, self._columns[int(r[1:])])
            if isinstance(r, str)
            else np.full(len(times), r)
            for r in body
        ]
        local = np.asarray(place[1:4], dtype=float)
        poses = (Pose(values, self.planar) for values in zip(*columns, strict=True))
        return [self.screen(pose.origin + pose.turn @ local) for pose in poses]

    # the room ----------------------------------------------------------------------------------------

    def _measure(self) -> tuple[float, float, float, float]:
        """The box that the machine sweeps [m]: left, bottom, right, top."""
        corners: list[Point] = []
        largest = [0.0, 0.0]
        reach = extents(self.shapes)
        for t in self.time[:: max(1, len(self.time) // SWEPT)]:
            self.at(float(t))
            corners += self._corners([one for one in reach if len(one) < 3])
            now = self._corners([one for one in reach if len(one) < 3 or one[2] == 1])
            for k in (0, 1) if now else ():
                largest[k] = max(largest[k], max(p[k] for p in now) - min(p[k] for p in now))
        self.at(float(self.time[0]))
        cut = self._corners([one for one in reach if len(one) > 2])
        corners = corners or cut
        if not corners:
            return -1.0, -1.0, 1.0, 1.0
        xs, ys = zip(*corners, strict=True)
        room = 0.4 * max(max(xs) - min(xs), max(ys) - min(ys))
        # of what stands still and goes on, as much as stands beside the rest
        xs += tuple(min(max(x, min(xs) - room), max(xs) + room) for x, _ in cut)
        ys += tuple(min(max(y, min(ys) - room), max(ys) + room) for _, y in cut)
        # what ties a slide to its wall is drawn from behind the joint
        far = 0.25 * max(max(xs) - min(xs), max(ys) - min(ys))
        for s in self.shapes:
            if walled(s) and far > 0:
                along = self.poses[int(s["a"][0])].turn @ np.asarray(s["axis"], dtype=float)
                x, y = self.flat(self.world(s["a"]) + (far if s["ahead"] else -far) * along)
                xs, ys = (*xs, x), (*ys, y)
        whole = max(max(xs) - min(xs), max(ys) - min(ys))
        # what would be lost in the room that it crosses: the camera goes with it
        self.follow = 0.0 < max(largest) < 0.15 * whole
        self.room = 2.5 * max(largest)
        return min(xs), min(ys), max(xs), max(ys)

    def _corners(self, reach: list[list[Any]]) -> list[Point]:
        found: list[Point] = []
        for place, about, *_ in reach:
            x, y = self.flat(self.world(place))
            if math.isfinite(x + y):
                found += [(x - about, y - about), (x + about, y + about)]
        return found

    def seen(self) -> None:
        """A camera that follows looks at where the machine is now."""
        if self.follow and (now := self._corners([one for one in extents(self.shapes) if len(one) < 3])):
            xs, ys = zip(*now, strict=True)
            self.middle = ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2)

    def _fit(self, width: int) -> None:
        left, bottom, right, top = self.box
        w, h = max(right - left, 0.25 * self.size), max(top - bottom, 0.25 * self.size)
        if self.follow:
            w = h = self.room
        self.width, margin = width, MARGIN * width
        self.height = 2 * round((width * min(max(h / w, 0.45), 1.15) + 0.65 * margin) / 2)
        self.middle = ((left + right) / 2, (bottom + top) / 2)
        wanted = float(self.view.get("scale", 1.0)) or 1.0
        self.scale = min((self.width - 2 * margin) / w, (self.height - 2 * margin) / h) * wanted
