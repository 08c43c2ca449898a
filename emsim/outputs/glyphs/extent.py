"""The room that a machine needs: the places of its shapes, with what is about each."""

from __future__ import annotations

from .marks import moved
from .solids import spread

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Shape

CORNERS = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]


def extents(shapes: list[Shape]) -> list[list[Any]]:
    """[place, how far it reaches in every direction [m]]"""
    found = []
    for s in shapes:
        kind, sizes = s["kind"], s.get("sizes", [0.0])
        if kind == "rod":
            found.append([s["at"], 0.0])
            found.append([moved(s["at"], sizes[0]), 0.0])
        elif kind == "box":
            h = sizes[1] if len(sizes) > 1 else sizes[0]
            for i, j in CORNERS:
                found.append([moved(s["at"], i * sizes[0], j * h), 0.0])
        elif kind == "disc":
            found.append([s["at"], sizes[0]])
        else:
            for key in ["at", "a", "b", "p", "q_"]:
                if isinstance(s.get(key), list):
                    found.append([s[key], 0.0])
        if "to" in s:
            for p in s["to"]:
                found.append([p, 0.0])
        if s.get("spin"):
            found.append([s["at"], 1.5 * s["spin"]])
        if kind == "gear" and "radii" in s:
            found.append([s["first"]["a"], s["radii"][0]])
            found.append([s["second"]["a"], s["radii"][1]])
        if kind == "beam":
            for node in s["nodes"]:
                found.append([node, 0.0])
        if kind == "rope":
            for stretch in s["stretches"]:
                for k in range(len(stretch["places"])):
                    found.append([stretch["places"][k], abs(stretch["radii"][k])])
        sides = spread(s, shapes) if kind == "bones" else None
        if sides is not None:
            found.append([s["at"], max(*sides) / 2])
        if kind in ["pot", "stop"] and s["joint"] == "slide":
            # what lies along its axis in A
            for end in s["range"] if kind == "pot" else s["ends"]:
                if end is not None:
                    found.append([moved(s["a"], *[(end + s["zero"]) * e for e in s["axis"]]), 0.0])
    return found


def walled(s: Shape) -> bool:
    """Is it tied to a wall that is drawn behind a slide?"""
    return s["kind"] in ["spring", "damper"] and "joint" in s and s["joint"] == "slide"
