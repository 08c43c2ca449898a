"""The scene: joints and coordinates as the compiler sees them, and frames along the tree.

A coordinate is one of
    own       an unknown q with its speed u
    given     prescribed by a DRIVE: free symbols stand for q and u until everything is differentiated, then
              the functions of time take their place; so what the drive applies is the equation of that very
              coordinate
    follows   tied to another coordinate by a GEAR: q = ratio * q(other)
A virtual motion (symbols s, ds/dt) is added at a joint whose reaction is asked for; it is 0, and its
equation of motion is the reaction.
"""

from __future__ import annotations

from ..cards.joint import KINDS
from .kinematics import WORLD_AXES, Frame, Moving, cross, dot, ground, settle, times
from .tree import GROUND

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Builder, Expr
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from ..cards.joint import Joint
    from .kinematics import Scalar, Vector
    from .tree import Plan

AXES = {"x": WORLD_AXES[0], "y": WORLD_AXES[1], "z": WORLD_AXES[2]}
NAMES = {"turn": ("angle", "omega"), "slide": ("pos", "vel"), "x": ("x", "vx"), "y": ("y", "vy")}


class Coordinate:
    """One coordinate and its speed; `row` and `speed_row` are unknowns (own), or -1."""

    __slots__ = (
        "drive",
        "gear",
        "held",
        "held_speed",
        "of",
        "q",
        "q_name",
        "rotary",
        "row",
        "speed_row",
        "start",
        "start_speed",
        "u",
        "u_name",
    )

    def __init__(self, of: str, motion: str, axis: str) -> None:
        self.of = of  # joint or free body
        words = NAMES[axis] if motion == "slide" and axis in ("x", "y") else NAMES[motion]
        self.q_name, self.u_name = (f"{word}({of})" for word in words)
        self.rotary = motion == "turn"
        self.row = self.speed_row = -1
        self.q: Expr
        self.u: Expr
        self.drive: Drive | None = None
        self.gear: Gear | None = None
        self.start = self.start_speed = 0.0
        self.held = self.held_speed = False

    @property
    def unit(self) -> str:
        return "rad" if self.rotary else "m"

    def allocate(self, b: Builder) -> None:
        """Make it an own coordinate."""
        self.row = b.unknown(self.q_name, "coordinate", self.unit, self.start)
        self.speed_row = b.unknown(self.u_name, "speed", self.unit + "/s", self.start_speed)
        self.q, self.u = b.x(self.row), b.x(self.speed_row)


class Virtual:
    """A virtual motion of B against A, or along a geared coordinate: symbols that are 0 in the equations."""

    __slots__ = ("axis", "kind", "rate", "s")

    def __init__(self, b: Builder, kind: str, axis: int = 0) -> None:
        self.kind = kind  # shift, turn or gear
        self.axis = axis
        self.s = b.symbol()
        self.rate = b.symbol()


class JointState:
    """A joint in the scene. `q`, `u`: its one coordinate and speed, B relative to A, also where it is cut."""

    __slots__ = (
        "a",
        "b",
        "card",
        "coordinates",
        "cut",
        "kind",
        "length",
        "name",
        "pa",
        "pb",
        "qs",
        "us",
        "virtuals",
    )

    def __init__(
        self, card: Joint, a: tuple[str, tuple[float, ...]], b: tuple[str, tuple[float, ...]]
    ) -> None:
        self.card = card
        self.name = card.name
        self.kind = card.kind
        self.a, self.pa = a
        self.b, self.pb = b
        self.cut = False
        self.coordinates: list[Coordinate] = []  # empty where the joint is cut
        self.qs: list[Expr] = []
        self.us: list[Expr] = []
        self.virtuals: dict[tuple[str, int], Virtual] = {}
        self.length = card.l  # of a rod

    @property
    def rotary(self) -> bool:
        return self.kind == "pin"

    @property
    def q(self) -> Expr:
        return self.qs[0]

    @property
    def u(self) -> Expr:
        return self.us[0]

    def turns(self, k: int) -> bool:
        """Is its coordinate k an angle?"""
        return KINDS[self.kind][k][0] == "turn"

    def axis_of(self, which: str) -> tuple[float, float, float]:
        return self.card.direction if which == "axis" else AXES[which]


def place(b: Builder, plan: Plan, joints: dict[str, JointState], roots: dict[str, list[Coordinate]],
          fixed: dict[str, tuple[float, float, float]]) -> dict[str, Frame]:  # fmt: skip
    """Frames of all bodies along the tree; fills `qs` and `us` of the tree joints."""
    frames = {GROUND: ground(b)}
    origin = (0.0, 0.0, 0.0)
    for body, (x0, y0, turned) in fixed.items():
        moving = Moving(frames[GROUND], (x0, y0, 0.0))
        moving.turn(AXES["z"], turned, 0.0)
        frames[body] = moving.frame(body, origin)
    for body, (x, y, angle) in roots.items():
        moving = Moving(frames[GROUND], origin)
        moving.slide(AXES["x"], x.q, x.u)
        moving.slide(AXES["y"], y.q, y.u)
        moving.turn(AXES["z"], angle.q, angle.u)
        frames[body] = moving.frame(body, origin)
    for step in plan.steps:
        joint = joints[step.joint]
        near, far = (joint.pb, joint.pa) if step.backward else (joint.pa, joint.pb)
        moving = Moving(frames[step.parent], near)
        if step.backward:
            _carry_virtual(moving, joint, -1.0)
            _carry(moving, joint, -1.0)
        else:
            _carry(moving, joint, 1.0)
            _carry_virtual(moving, joint, 1.0)
        frames[step.child] = moving.frame(step.child, far)
    return frames


def _carry(moving: Moving, joint: JointState, sign: float) -> None:
    """The joint's own motions, forwards or backwards, and what they measure."""
    motions = list(zip(KINDS[joint.kind], joint.coordinates, joint.card.zeros, strict=False))
    if not motions and joint.card.zeros[0]:  # a weld may be turned
        moving.turn(joint.card.direction, sign * joint.card.zeros[0], 0.0)
    measured = []
    for (motion, which), coordinate, zero in motions if sign > 0 else motions[::-1]:
        axis = joint.axis_of(which)
        q: Scalar = sign * (coordinate.q + zero)
        u: Scalar = sign * coordinate.u
        world = times(moving.rot.matrix(), axis)
        measured.append((coordinate, *_measured(joint, motion, world, moving.omega, coordinate)))
        (moving.turn if motion == "turn" else moving.slide)(axis, q, u)
    measured = measured if sign > 0 else measured[::-1]
    joint.qs, joint.us = [m[1] for m in measured], [m[2] for m in measured]


def _measured(
    joint: JointState, motion: str, world: Vector, omega: Vector, c: Coordinate
) -> tuple[Expr, Expr]:
    """Coordinate and speed, virtual motion along the axis counted in: a reaction acts across it only.

    The axis turns with A; without (along s)' whole, a rotor on the coordinate would leave a force across the axis.
    """
    q, u = c.q, c.u
    for (kind, k), virtual in joint.virtuals.items():
        if (kind == "turn") == (motion == "turn") and kind != "gear":
            along = settle(dot(world, WORLD_AXES[k]))
            turning = settle(dot(cross(omega, world), WORLD_AXES[k]))
            q, u = q + along * virtual.s, u + along * virtual.rate + turning * virtual.s
    return q, u


def _carry_virtual(moving: Moving, joint: JointState, sign: float) -> None:
    for (kind, k), virtual in joint.virtuals.items():
        if kind != "gear":
            carry = moving.shift_world if kind == "shift" else moving.turn_world
            carry(WORLD_AXES[k], sign * virtual.s, sign * virtual.rate)


def displaced(frame: Frame, at: tuple[float, ...], virtual: Virtual) -> Frame:
    """A body moved virtually against a cut joint."""
    moving = Moving(frame, at)
    axis = WORLD_AXES[virtual.axis]
    (moving.shift_world if virtual.kind == "shift" else moving.turn_world)(axis, virtual.s, virtual.rate)
    return moving.frame(frame.name, at)


def leaves_plane(joint: JointState) -> bool:
    """Does a joint's axis leave the plane?"""
    x, y, z = joint.card.direction
    return (joint.kind == "pin" and bool(x or y)) or (joint.kind in ("slide", "pinslot") and bool(z))
