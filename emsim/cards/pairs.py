"""Which convex solids meet each other in space by which rule: pairs of CONTACT but for those with a plane (supports.py).

a ball and any                         nearest.py
a capsule and a capsule, box or hull   capsules.py
hulls and boxes                        facets.py
"""

from __future__ import annotations

from . import capsules, drums, facets, ovals
from .nearest import Body, Target

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import Scene
    from .solids import Solid
    from .supports import Meeting, Part


def kind(solid: Solid) -> str:
    """What it is among the pairs; a thin disc is a cylinder."""
    if solid.half is not None:
        return ("ball", "capsule", "box", "box")[sum(map(bool, solid.half))]
    return "ellipsoid" if solid.semi is not None else "hull" if solid.corners else "cylinder"


def known(a: Solid, b: Solid) -> bool:
    """Is there a rule for these two?"""
    kinds = {kind(a), kind(b)}
    return (
        "ball" in kinds
        or kinds == {"capsule", "cylinder"}
        or ("ellipsoid" in kinds and kinds < {"capsule", "box", "hull", "ellipsoid"} and len(kinds) == 2)
        or kinds <= {"capsule", "box", "hull"}
    )


def ordered(a: Part, b: Part) -> tuple[Part, Part, str, str]:
    order = ("ball", "capsule", "box", "hull", "ellipsoid", "cylinder")
    a, b = sorted((a, b), key=lambda part: order.index(kind(part[2])))
    return a, b, kind(a[2]), kind(b[2])


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which they can touch; none is left out."""
    one, other, first, second = ordered(a, b)
    if first == "ball":
        return Target(s, other).ends(Body(s, one))
    if second == "ellipsoid":
        return ovals.meetings(s, other, one)
    if second == "cylinder":
        return drums.meetings(s, one, other)
    return capsules.meetings(s, one, other) if first == "capsule" else facets.meetings(s, one, other)


def separations(s: Scene, a: Part, b: Part) -> list[Expr]:
    """Of those whose gaps do not say at the start that they are in each other: below 0 they are."""
    one, other, first, second = ordered(a, b)
    if first == "ball" or second in ("capsule", "ellipsoid", "cylinder"):
        return []
    return [(capsules if first == "capsule" else facets).separation(s, one, other)]
