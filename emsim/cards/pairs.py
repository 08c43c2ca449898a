"""Which convex solids meet each other in space by which rule: pairs of CONTACT but for those with a plane (supports.py).

a ball and any                         nearest.py
a cylinder and a box or hull           cans.py
a capsule and a capsule, box or hull   capsules.py
hulls and boxes                        facets.py
"""

from __future__ import annotations

from . import cans, capsules, drums, eggs, facets, ovals
from .nearest import Body, Target, least

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


def unknown(a: str, one: Solid, b: str, other: Solid) -> tuple[str, str] | None:
    """Of two named solids for which there is no rule: what they touch, and what could be in their place."""
    kinds = {kind(one), kind(other)}
    if kinds & {"ball", "capsule"}:
        return None
    for name, solid in ((a, one), (b, other)):
        hint = f"SHAPE {name}2 {name} hull(x1,y1,z1,..), capsule(l,r) or ball(r) in its place"
        if solid.kind == "cylinder" and not kinds & {"box", "hull"}:
            return "cylinder(..) touches planes, balls, capsules, boxes and hulls", hint
        if solid.kind == "disc":
            return (
                "disc(..) touches planes, balls and capsules",
                "cylinder(r,h) as thick as it is, where the other is a box or a hull",
            )
        if kinds == {"ellipsoid"} and solid.semi and max(solid.semi) > 10.0 * min(solid.semi):
            return "of two ellipsoids half-axes go up to 10 to 1", hint
    return None


def ordered(a: Part, b: Part) -> tuple[Part, Part, str, str]:
    order = ("ball", "capsule", "box", "hull", "ellipsoid", "cylinder")
    a, b = sorted((a, b), key=lambda part: order.index(kind(part[2])))
    return a, b, kind(a[2]), kind(b[2])


def meetings(s: Scene, a: Part, b: Part) -> list[Meeting]:
    """All places at which they can touch; none is left out."""
    one, other, first, second = ordered(a, b)
    if first == "ball":
        return Target(s, other).ends(Body(s, one))
    if first == second == "ellipsoid":
        return eggs.meetings(s, one, other)
    if second == "ellipsoid":
        return ovals.meetings(s, other, one)
    if second == "cylinder" and first in ("box", "hull"):
        return cans.meetings(s, other, one)
    if second == "cylinder":
        return drums.meetings(s, one, other)
    return capsules.meetings(s, one, other) if first == "capsule" else facets.meetings(s, one, other)


def separations(s: Scene, a: Part, b: Part) -> list[Expr]:
    """Of those whose gaps do not say at the start that they are in each other: below 0 they are."""
    one, other, first, second = ordered(a, b)
    if second == "cylinder" and first in ("box", "hull"):
        return [cans.separation(s, other, one)]
    if first == "ball" or second in ("capsule", "ellipsoid", "cylinder"):
        return []
    return [(capsules if first == "capsule" else facets).separation(s, one, other)]


def watch(s: Scene, name: str, a: Part, b: Part, meetings: list[Meeting]) -> None:
    """Of a card by its name: of parts whose places of touch come and go before they touch, so that a step could pass what is
    between. An event where they come into each other, at which the places there are asked; deeper the run ends (gaps.py)."""
    _, _, first, second = ordered(a, b)
    if second != "cylinder" or first not in ("box", "hull"):
        return
    apart, size = least(s, separations(s, a, b)), max(a[2].size, b[2].size)
    nearest = least(s, [apart, *(meeting.gap for meeting in meetings)])
    for depth, gap, what in ((1e-8, nearest, f"{a[0]} {b[0]} meet"), (1e-4, apart, "overlaps")):
        # by an angle: how well it is known does not hang on what is far
        into = s.public(0.0 - s.b.call("atan", gap / size))
        s.b.flag(into - depth, into - 0.5 * depth, f"{name} {what}", -1)
