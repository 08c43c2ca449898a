"""What the geoms of an MJCF file weigh: by their mass, or by their density and volume."""

from __future__ import annotations

from os.path import dirname, join

import numpy as np

from . import geometry, meshes
from .geometry import Mass, Pose
from .model import Solid

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from ..diagnostics import Sink, Span
    from .mjcf_words import Filled
    from .xml import Element

# how many sizes each takes, and what makes it of them
SOLIDS: dict[str, tuple[int, Callable[..., Mass]]] = {
    "sphere": (1, lambda r: geometry.ellipsoid(r, r, r)), "capsule": (2, geometry.capsule),
    "cylinder": (2, geometry.cylinder), "ellipsoid": (3, geometry.ellipsoid), "box": (3, geometry.box),
}  # fmt: skip


DRAWN = {"sphere": "ball", "capsule": "rod", "cylinder": "rod", "box": "box"}


class Geom:
    """`frame`: what it stands in, a body or a frame of it; `place`: where its pos= and quat= put it."""

    __slots__ = ("element", "frame", "kind", "place")

    def __init__(self, element: Filled, kind: str, frame: Pose, place: Pose) -> None:
        self.element, self.kind, self.frame, self.place = element, kind, frame, place


class Scale:
    density = 1000.0  # kg/m^3 of geoms that do not say theirs (XMLreference, geom/density)

    def __init__(
        self, root: Element, folder: str, groups: tuple[float, float], assets: dict[str, Filled], sink: Sink
    ) -> None:
        self.beside, self.folder = dirname(root.file.path or ""), folder
        self.groups, self.assets, self.sink = groups, assets, sink

    def weigh(self, geom: Geom) -> Mass | None:
        """In the axes of its body; None where its mass does not count, and after an error."""
        e, sink, (low, high) = geom.element, self.sink, self.groups
        mass, density = e.number("mass", sink, -1.0), e.number("density", sink, self.density)
        for key, value in (("mass", mass), ("density", density)):
            if e.has(key) and value < 0.0:
                sink.error("E536", f"{key} of <geom> is {value:g}; it cannot be below 0", e.place(key))
                return None
        if not low <= e.number("group", sink) <= high or mass == 0.0 or (density == 0.0 and mass < 0.0):
            return None
        if e.flag("shellinertia", sink):
            sink.error("E532", "shellinertia of <geom> is not imported", e.place("shellinertia"))
            return None
        found = self._mesh(geom) if e.has("mesh") else self._solid(geom)
        if found is None:
            return None
        solid, place = found
        if not solid.m:
            sink.error("E533", "size of <geom> leaves no volume", e.place("size"))
            return None
        return solid.times(mass / solid.m if mass >= 0.0 else density).placed(place)

    def _solid(self, geom: Geom) -> tuple[Mass, Pose] | None:
        """Of density 1, and where it is in the body."""
        if geom.kind not in SOLIDS:
            said = f"<geom> of type {geom.kind!r} is not imported"
            self.sink.error("E532", said, geom.element.place("type"))
            return None
        found = self.sizes(geom)
        return None if found is None else (SOLIDS[geom.kind][1](*found[0]), found[1])

    def drawn(self, geom: Geom) -> Solid | None:
        """None of what no card draws, and of what MuJoCo does not show at first: groups above 2."""
        if geom.kind not in DRAWN or geom.element.has("mesh") or geom.element.number("group", self.sink) > 2:
            return None
        found = self.sizes(geom)
        return None if found is None else Solid(DRAWN[geom.kind], *found)

    def sizes(self, geom: Geom) -> tuple[list[float], Pose] | None:
        """As many as its kind has, and where fromto= or pos= put it in the body; None after an error."""
        e, sink, kind, place = geom.element, self.sink, geom.kind, geom.place
        needed = SOLIDS[kind][0]
        size = e.numbers("size", sink)
        if e.has("fromto"):
            ends = np.array(e.numbers("fromto", sink, (), 6))
            way = ends[3:] - ends[:3]
            length = float(np.linalg.norm(way))
            if not length or kind == "sphere":
                sink.error("E533", "fromto of <geom> is of two points, and of no sphere", e.place("fromto"))
                return None
            place = geom.frame.then(Pose(0.5 * (ends[:3] + ends[3:]), _along(way / length)))
            size = [*size[:1] * (needed - 1), 0.5 * length]
        if len(size) < needed or min(size[:needed]) <= 0.0:
            said = f"size of a {kind} is {needed} number{'s' * (needed > 1)} above 0"
            sink.error("E533", said, e.place("size"))
            return None
        return size[:needed], place

    def triangles(self, geom: Geom) -> tuple[geometry.Array, str, Span] | None:
        """Those of its mesh in its own axes, with the file and where that is named; None after an error."""
        e, sink, name = geom.element, self.sink, geom.element.get("mesh")
        if name not in self.assets:
            sink.error("E534", f"there is no <mesh> named {name!r} in <asset>", e.place("mesh"))
            return None
        asset = self.assets[name]
        if geom.kind != "mesh":
            sink.error("E532", f"a {geom.kind} fitted to a mesh is not imported", e.place("mesh"))
            return None
        for key in ("vertex", "refpos", "refquat"):
            if asset.has(key):
                said = f"{key} of <mesh> is not imported"
                sink.error("E532", said, asset.place(key), "give the body an <inertial>")
                return None
        scale = asset.numbers("scale", sink, (1.0, 1.0, 1.0), 3)
        file, at = join(self.folder, asset.required("file", sink)), asset.place("file")
        found = meshes.triangles(file, self.beside, scale, at, sink)
        return None if found is None else (found, file, at)

    def _mesh(self, geom: Geom) -> tuple[Mass, Pose] | None:
        asset = self.assets.get(geom.element.get("mesh"))
        if asset is not None and asset.get("inertia") == "shell":
            said = "a mesh that weighs as a shell is not imported"
            self.sink.error("E532", said, asset.place("inertia"))
            return None
        read = self.triangles(geom)
        found = None if read is None else meshes.mass(*read, self.sink)
        return None if found is None else (found, geom.place)


def _along(z: geometry.Array) -> geometry.Array:
    """A rotation that takes the third axis to z."""
    across = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(z, across), z])
