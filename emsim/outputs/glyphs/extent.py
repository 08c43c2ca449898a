"""The room that a machine needs: the places of its shapes, with what is about each."""

from __future__ import annotations

import math

from .marks import moved
from .solids import spread
from .transducer import ahead, shut

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Shape

CORNERS = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]


def extents(shapes: list[Shape]) -> list[list[Any]]:
    """[place, how far it reaches in every direction [m], of what is the frame's own and may be cut off 1: a long
    floor, 2: the place of a floor or a rail without ends]"""
    found: list[list[Any]] = []
    for s in shapes:
        first = len(found)
        kind, sizes = s["kind"], s.get("sizes", [0.0])
        if kind == "rod":
            found.append([s["at"], 0.0])
            found.append([moved(s["at"], sizes[0]), 0.0])
        elif kind == "box":
            h = sizes[1] if len(sizes) > 1 else sizes[0]
            for i, j in CORNERS:
                found.append([moved(s["at"], i * sizes[0], j * h), 0.0])
        elif kind == "mesh":
            for x in [0, 1]:
                for y in [0, 1]:
                    for z in [0, 1]:
                        found.append([moved(s["at"], s["box"][x][0], s["box"][y][1], s["box"][z][2]), 0.0])
        elif kind == "solid":
            found.append([s["at"], 0.0, 2] if s["form"] == "plane" else [s["at"], s["reach"]])
        elif kind == "wagon":
            found.append([moved(s["at"], sizes[0] / 2, sizes[1] / 2), 0.0])
            found.append([moved(s["at"], -sizes[0] / 2, -0.85 * sizes[1]), 0.0])
        elif kind in ["disc", "ball", "wheel", "toothed"]:
            found.append([s["at"], sizes[0]])
        else:
            for key in ["at", "a", "b", "p", "q_"]:
                if isinstance(s.get(key), list):
                    endless = (kind == "contact" and key == "q_" and s["along"] is not None) or (
                        kind in ["joint", "friction"] and s["joint"] == "slide" and key == "a"
                    )
                    found.append([s[key], 0.0, 2] if endless and s[key][0] == 0 else [s[key], 0.0])
        if "to" in s:
            for p in s["to"]:
                found.append([p, 0.0])
        about = max(1.5 * s.get("spin", 0.0), s.get("round", 0.0))
        if about:
            found.append([s["at"], about])
        if kind == "gear" and "radii" in s:
            for k in [0, 1]:
                found.append(
                    [s["first" if k == 0 else "second"]["a"], s["radii"][k] * (1 + 2 / s["teeth"][k])]
                )
        if kind == "cam" and "base" in s:
            found.append([s["second"]["a"], s["base"] + max(*s["lift"])])
        if kind == "cam" and "slots" in s:
            a, b = s["first"]["a"], s["second"]["a"]
            for place in [a, b]:
                found.append([place, 0.8 * math.hypot(a[1] - b[1], a[2] - b[2])])
        if kind == "transducer" and s.get("closed") is not None:
            size = ahead(s, shapes)
            for way in [-1, 1]:
                found.append([moved(shut(s), *[way * size[0] * e for e in s["axis"]]), size[1]])
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
        if kind in ["rod", "box", "disc", "polygon"] and s["at"][0] == 0:
            for one in found[first : len(found)]:
                one.append(1)
    return found


def walled(s: Shape) -> bool:
    """Is it tied to a wall that is drawn behind a slide?"""
    return s["kind"] in ["spring", "damper"] and "joint" in s and s["joint"] == "slide"
