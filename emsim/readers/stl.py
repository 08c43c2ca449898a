"""STL: the triangles of a surface, from the binary form and from the text form.

Binary: 80 bytes that say nothing, a count (uint32), then 50 bytes a triangle: normal, three corners (float32, little-endian),
two bytes more. Text: `solid name`, then `facet normal .. outer loop vertex x y z .. endloop endfacet`, `endsolid`. A binary file
may begin with the word solid too, so the size decides: 84 + 50 count. (3D Systems, StereoLithography Interface Specification,
1988.) Normals are not read: the order of the corners says which side is outside.
"""

from __future__ import annotations

import re

import numpy as np

TYPE_CHECKING = False
if TYPE_CHECKING:
    from numpy.typing import NDArray

HEAD = np.dtype([("text", "S80"), ("count", "<u4")])
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])  # 50 bytes


def triangles(data: bytes) -> NDArray[np.float64]:
    """The corners, of shape (n, 3, 3): triangle, corner, axis; in the file's own unit of length. Raises ValueError, which says
    what is wrong."""
    start, count = HEAD.itemsize, 0
    if len(data) >= start:
        count = int(np.frombuffer(data, HEAD, 1)["count"][0])
        if len(data) == start + FACET.itemsize * count:
            return _sound(np.frombuffer(data, FACET, count, start)["corners"].astype(float))
    if data.lstrip()[:5].lower() == b"solid":
        return _sound(_text(data))
    if len(data) < start:
        raise ValueError("it is no STL file: neither `solid` at its head nor 84 bytes")
    whole = start + FACET.itemsize * count
    raise ValueError(
        f"it is no STL file: of {count} triangles it would have {whole} bytes, it has {len(data)}"
    )


def _text(data: bytes) -> NDArray[np.float64]:
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", data, re.I)
    facets = len(re.findall(rb"endfacet", data, re.I))
    if len(words) != 3 * facets:
        raise ValueError(f"it has {facets} facets and {len(words)} corners; a facet has three")
    try:
        return np.array([[float(v) for v in word] for word in words]).reshape(-1, 3, 3)
    except ValueError:
        raise ValueError("a corner of it is no number") from None


def _sound(found: NDArray[np.float64]) -> NDArray[np.float64]:
    if not len(found):
        raise ValueError("it has no triangle")
    if not np.isfinite(found).all():
        raise ValueError("a corner of it is infinite or no number")
    return found
