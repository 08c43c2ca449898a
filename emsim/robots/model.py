"""A robot as its readers leave it and as the deck is written from it: links that hang on each other, in the file's own frames.

A link without joints is fixed to its parent. A link with several joints moves by one after the other, the parent's side first.
`note` is what the file says and the deck cannot use, because it does not bear on motion.
"""

from __future__ import annotations

from math import inf

import numpy as np

from .geometry import Mass, Pose

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..diagnostics import Span
    from .geometry import Array

KINDS = ("pin", "slide", "ball", "free")


class Joint:
    """`axis` (a unit vector) and `point` in the axes of the link that it moves; angles and travels in rad and m."""

    __slots__ = (
        "armature", "axis", "damping", "effort", "friction", "high", "kind", "low", "name", "note", "point", "ref", "rest",
        "span", "speed", "start", "stiffness", "tied",
    )  # fmt: skip

    def __init__(self, name: str, kind: str, span: Span) -> None:
        self.name, self.kind, self.span = name, kind, span
        self.axis: Array = np.array([0.0, 0.0, 1.0])
        self.point: Array = np.zeros(3)
        self.ref = 0.0  # the coordinate in the configuration in which the links' poses are given
        self.low, self.high = -inf, inf
        self.damping = self.friction = self.armature = self.stiffness = self.rest = 0.0
        self.effort = inf  # what may act on it at most
        self.start: list[float] | None = None  # coordinates at the start, of ball and free as a quaternion
        self.speed: list[float] | None = None
        self.tied = False  # to another one's coordinate
        self.note = ""

    @property
    def turns(self) -> bool:
        return self.kind == "pin"

    @property
    def is_scalar(self) -> bool:
        return self.kind in ("pin", "slide")


class Solid:
    """What is drawn: a box of half sizes, a ball of a radius, a rod along z of radius and half length."""

    __slots__ = ("kind", "pose", "sizes")

    def __init__(self, kind: str, sizes: Sequence[float], pose: Pose) -> None:
        self.kind, self.sizes, self.pose = kind, [*sizes], pose


class Link:
    """`pose` in the frame of its parent, in the configuration in which all joints are at their `ref`. `masses`, `points` (by
    name), `shapes` (in words) and `solids` (to be drawn) in its own axes."""

    __slots__ = (
        "joints",
        "lifted",
        "masses",
        "name",
        "note",
        "parent",
        "points",
        "pose",
        "shapes",
        "solids",
        "span",
    )

    def __init__(self, name: str, span: Span, parent: Link | None = None, pose: Pose | None = None) -> None:
        self.name, self.span, self.parent = name, span, parent
        self.pose = pose or Pose()
        self.joints: list[Joint] = []
        self.masses: list[Mass] = []
        self.points: list[tuple[str, Array]] = []
        self.shapes: list[str] = []
        self.solids: list[Solid] = []
        self.lifted = 0.0  # share of its weight that something carries
        self.note = ""

    @property
    def carrier(self) -> Link | None:
        """The link that moves it: itself, or the next one below that has joints; None for the ground."""
        link: Link | None = self
        while link is not None and not link.joints:
            link = link.parent
        return link

    def world(self) -> Pose:
        """Its pose in the ground's frame, all joints at their `ref`."""
        found, link = self.pose, self.parent
        while link is not None:
            found, link = link.pose.then(found), link.parent
        return found


class Tie:
    """q(follower) = sum of c_k q(leader)^k."""

    __slots__ = ("follower", "leader", "name", "series", "span")

    def __init__(self, name: str, follower: Joint, leader: Joint, series: list[float], span: Span) -> None:
        self.name, self.follower, self.leader, self.series, self.span = name, follower, leader, series, span


class Loop:
    """One more joint between two links, `kind` ball or weld, at a point of the ground's frame in the configuration of `ref`."""

    __slots__ = ("first", "kind", "name", "point", "second", "span")

    def __init__(self, name: str, kind: str, first: Link, second: Link, point: Array, span: Span) -> None:
        self.name, self.kind, self.first, self.second, self.point, self.span = (
            name,
            kind,
            first,
            second,
            point,
            span,
        )


class Actuator:
    """What acts on a sum of coordinates l = sum of coef q, with v its speed and u the input:

        f = (gain . (1, l, v)) u + bias . (1, l, v),    and coef f on every joint
    u is kept in `inputs`, f in `forces`.
    """

    __slots__ = ("bias", "forces", "gain", "input", "inputs", "name", "note", "parts", "span", "start")

    def __init__(self, name: str, parts: list[tuple[Joint, float]], span: Span) -> None:
        self.name, self.parts, self.span = name, parts, span
        self.gain: list[float] = [1.0, 0.0, 0.0]
        self.bias: list[float] = [0.0, 0.0, 0.0]
        self.inputs = self.forces = (-inf, inf)
        self.start = 0.0  # the input at first
        self.input = True  # has it one? else it is a spring or a damper of a tendon
        self.note = ""


class Between:
    """A spring and a damper between two points of links (a tendon of two sites)."""

    __slots__ = ("c", "first", "k", "length", "name", "second", "span")

    def __init__(
        self, name: str, ends: list[tuple[Link, Array]], k: float, c: float, length: float, span: Span
    ) -> None:
        self.name, self.k, self.c, self.length, self.span = name, k, c, length, span
        self.first, self.second = ends


class Touch:
    """A shape that touches: `kind` and `numbers` as the card SHAPE has them, `pose` in the axes of its link."""

    __slots__ = ("kind", "link", "name", "numbers", "pose")

    def __init__(self, name: str, link: Link, kind: str, numbers: Sequence[float], pose: Pose) -> None:
        self.name, self.link, self.kind, self.numbers, self.pose = name, link, kind, [*numbers], pose


class Contact:
    """Of two shapes. `resists`: sliding, by a coefficient; drilling and rolling, by lengths [m]."""

    __slots__ = ("first", "name", "resists", "second")

    def __init__(self, name: str, first: Touch, second: Touch, resists: Sequence[float]) -> None:
        self.name, self.first, self.second, self.resists = name, first, second, [*resists]


class Robot:
    """`links` so that a parent comes before its children."""

    def __init__(self, name: str, source: str, kind: str) -> None:
        self.name, self.source, self.kind = name, source, kind
        self.gravity: list[float] = [0.0, 0.0, -9.81]
        self.links: list[Link] = []
        self.ties: list[Tie] = []
        self.loops: list[Loop] = []
        self.actuators: list[Actuator] = []
        self.springs: list[Between] = []
        self.contacts: list[Contact] = []
        self.notes: list[str] = []  # what the deck cannot use
        self.remarks: list[str] = []  # what the reader of the deck should know

    def joints(self) -> Iterator[Joint]:
        return (joint for link in self.links for joint in link.joints)
