"""Mesh files of robots: found beside the file that names them, read, weighed."""

from __future__ import annotations

from os.path import abspath, dirname, isfile, join

from ..readers import stl
from ..source import read_bytes
from . import geometry

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..diagnostics import Sink, Span
    from .geometry import Array, Mass


def find(name: str, beside: str) -> str:
    """The path of a mesh file. `package://robot/meshes/a.stl` is looked for in the folder of the file and those above it, with
    and without the package's name."""
    scheme, mark, rest = name.partition("://")
    if not mark:
        return join(beside, name)
    if scheme == "file":
        return rest
    folder = abspath(beside)
    while True:
        for path in (join(folder, rest), join(folder, rest.partition("/")[2])):
            if isfile(path):
                return path
        if dirname(folder) == folder:
            return join(beside, rest)
        folder = dirname(folder)


def triangles(name: str, beside: str, scale: Sequence[float], place: Span, sink: Sink) -> Array | None:
    """The corners of an STL file [m]; None after E537."""
    path = find(name, beside)
    if not path.lower().endswith(".stl"):
        hint = "write the mesh as STL, or give the body its mass and inertia"
        sink.error("E537", f"of {name} no mass can be computed: only STL meshes are read", place, hint)
        return None
    try:
        return stl.triangles(read_bytes(path, regular=True)) * scale
    except OSError as error:
        sink.error("E537", f"{path}: {error.strerror or error}", place)
    except ValueError as error:
        sink.error("E537", f"{path}: {error}", place)
    return None


def mass(found: Array, name: str, place: Span, sink: Sink) -> Mass | None:
    """Of density 1; None after E537."""
    try:
        return geometry.mesh(found)
    except ValueError as error:
        sink.error("E537", f"{name}: {error}", place, "close it, or give the body its mass and inertia")
        return None
