"""Which convex solids meet each other in space by which rule: pairs of CONTACT but for those with a plane (supports.py) and of balls,
capsules and boxes alone (pairs.py).

    a ball and any, the ends of a capsule    nearest.py
    hulls, boxes, a capsule and a hull       facets.py
"""

from __future__ import annotations

from . import facets, pairs
from .nearest import Target
from .pairs import Block

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import Scene
    from .solids import Solid
    from .supports import Meeting, Part

BLOCKS = {"ball", "capsule", "box"}


def kind(solid: Solid) -> str:
    """What it is among the pairs; a thin disc is a cylinder."""
    if solid.half is not None:
        return ("ball", "capsule", "box", "box")[sum(map(bool, solid.half))]
    return "ellipsoid" if solid.semi is not None else "hull" if solid.corners else "cylinder"


def known(a: Solid, b: Solid) -> bool:
    """Is there a rule for these two?"""
    kinds = {kind(a), kind(b)}
    return "ball" in kinds or kinds <= {"box", "hull", "capsule"}


def _sorted(a: Part, b: Part) -> tuple[Part, Part, str, str]:
    order = ("ball", "capsule", "box", "hull", "ellipsoid", "cylinder")
    a, b = sorted((a, b), key=lambda part: order.index(kind(part[2])))
    return a, b, kind(a[2]), kind(b[2])


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which they can touch; none is left out."""
    one, other, first, second = _sorted(a, b)
    if {first, second} <= BLOCKS:
        return pairs.meetings(s, a, b)
    if first == "ball":
        return Target(s, other).ends(Block(s, one))
    return facets.of_capsule(s, one, other) if first == "capsule" else facets.meetings(s, a, b)


def separations(s: Scene, a: Part, b: Part) -> list[Expr]:
    """Of those whose gaps do not say at the start that they are in each other: below 0 they are."""
    one, other, first, second = _sorted(a, b)
    if first == "ball":
        return []
    if "hull" in (first, second):
        return [facets.within_hull(s, one, other) if first == "capsule" else facets.separation(s, a, b)]
    return [pairs.separation(s, a, b)] if "box" in (first, second) else []
