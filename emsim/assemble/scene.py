"""The scene: joints and coordinates as the compiler sees them, and frames along the tree.

A coordinate is one of
    own       an unknown q with its speed u
    given     prescribed by a DRIVE: free symbols stand for q and u until everything is differentiated, then
              the functions of time take their place; so what the drive applies is the equation of that very
              coordinate
    follows   tied to another coordinate by a GEAR: q = ratio * q(other)
A kind of joint whose speeds are no derivatives has coordinates without a speed, then speeds without a coordinate.
A virtual motion (symbols s, ds/dt) is added at a joint whose reaction is asked for; it is 0, and its
equation of motion is the reaction.
"""

from __future__ import annotations

from ..cards.joints.base import AXES
from ..cards.joints.free import FreeInSpace
from ..cards.kinematics import WORLD_AXES, Frame, Moving, ground, subtract
from ..deck import MachineCard, Ref
from .tree import GROUND

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Builder, Expr
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from ..cards.joint import Joint
    from ..cards.joints.base import Coord, JointKind, Passed
    from ..cards.kinematics import Scalar
    from ..diagnostics import Sink
    from .tree import Plan


class Coordinate:
    """One coordinate and its speed; `row` and `speed_row` are unknowns (own), or -1. `rate`: dq/dt, `u` in most cases."""

    __slots__ = (
        "drive", "gear", "held", "held_speed", "of", "q", "q_name", "rate", "rotary", "row", "speed_row", "start",
        "start_speed", "u", "u_name",
    )  # fmt: skip

    def __init__(self, of: str, place: Coord | None, speed: Coord | None) -> None:
        self.of = of  # joint or free body
        self.q_name = f"{place.word}({of})" if place is not None else ""
        self.u_name = f"{speed.word}({of})" if speed is not None else ""
        self.rotary = any(c is not None and c.turns for c in (place, speed))
        self.row = self.speed_row = -1
        self.q: Expr
        self.u: Expr
        self.rate: Expr
        self.drive: Drive | None = None
        self.gear: Gear | None = None
        self.start = self.start_speed = 0.0
        self.held = self.held_speed = False

    @property
    def unit(self) -> str:
        return "rad" if self.rotary else "m"

    def allocate(self, b: Builder) -> None:
        """Make it an own coordinate."""
        if self.q_name:
            self.row = b.unknown(self.q_name, "coordinate", self.unit, self.start)
            self.q = b.x(self.row)
        if self.u_name:
            self.speed_row = b.unknown(self.u_name, "speed", self.unit + "/s", self.start_speed)
            self.u = b.x(self.speed_row)
            if self.q_name:
                self.rate = self.u


class Group:
    """Own coordinates and speeds of a joint with q' = N(q) u."""

    __slots__ = ("b", "kind", "places", "speeds")

    def __init__(self, b: Builder, joint: JointState) -> None:
        self.b = b
        self.kind = joint.kind
        self.places = [c for c in joint.coordinates if c.q_name]
        self.speeds = [c for c in joint.coordinates if c.u_name]
        for c, rate in zip(self.places, self.rates([c.u for c in self.speeds]), strict=True):
            c.rate = rate

    def rates(self, u: list[Expr]) -> list[Expr]:
        """q' of these speeds."""
        return [self.b.const(0.0) + rate for rate in self.kind.rates([c.q for c in self.places], u)]

    def norms(self) -> list[Expr]:
        """Rows that hold the coordinates alone."""
        return [self.b.const(0.0) + h for h in self.kind.norms([c.q for c in self.places])]

    def columns(self) -> list[list[Expr]]:
        """N by columns, one a speed."""
        rows = [self.b.grad(c.rate, [s.u for s in self.speeds]) for c in self.places]
        return [list(column) for column in zip(*rows, strict=True)]


class Virtual:
    """A virtual motion of B against A, or along a geared coordinate: symbols that are 0 in the equations."""

    __slots__ = ("axis", "kind", "rate", "s")

    def __init__(self, b: Builder, kind: str, axis: int = 0) -> None:
        self.kind = kind  # shift, turn or gear
        self.axis = axis
        self.s = b.symbol()
        self.rate = b.symbol()


FREE = "#"  # before a body's name in the table of joints: what stands for a free body in space


def free_in_space(body: Body, sink: Sink) -> JointState:
    """A free body of a spatial scene, as a joint to ground that holds nothing, with the body's start."""
    from ..cards.joint import Joint

    words = [Ref(word, None, body.span) for word in (GROUND, body.name, "free")]
    card = Joint(MachineCard("JOINT", body.name, words, {}, None, body.span, {}), sink)
    card.settle(FreeInSpace(card), sink)
    turned = body.rot if body.rot is not None else (0.0, 0.0, body.angle)
    found = card.kind.start((body.x, body.y, body.z, *turned))
    assert found is not None
    placed = ("x", "y", "z")
    card.search = found
    card.start = [v if body.given(k) else None for k, v in zip(placed, found, strict=False)]
    card.start += [v if body.given("rot") or body.given("angle") else None for v in found[3:]]
    moving = (body.vx, body.vy, body.vz)
    card.speed = [v if body.given(f"v{k}") else None for k, v in zip(placed, moving, strict=True)]
    card.speed += [v if body.given("omega") else None for v in body.spins]
    return JointState(card, (GROUND, (0.0, 0.0, 0.0)), (body.name, (0.0, 0.0, 0.0)))


class Tie:
    """`follower` = factor * leader, by a gear."""

    __slots__ = ("factor", "follower", "gear", "leader", "virtual")

    def __init__(self, gear: Gear, follower: Coordinate, leader: Coordinate, factor: float) -> None:
        self.gear = gear
        self.follower = follower
        self.leader = leader
        self.factor = factor
        self.virtual: Virtual | None = None


class JointState:
    """A joint in the scene. `q`, `u`: its one coordinate and speed, B relative to A, also where it is cut."""

    __slots__ = ("a", "b", "card", "coordinates", "cut", "kind", "name", "pa", "pb", "qs", "us", "virtuals")

    def __init__(
        self, card: Joint, a: tuple[str, tuple[float, ...]], b: tuple[str, tuple[float, ...]]
    ) -> None:
        self.card = card
        self.name = card.name
        self.kind: JointKind = card.kind
        self.a, self.pa = a
        self.b, self.pb = b
        self.cut = False
        self.coordinates: list[Coordinate] = []  # empty where the joint is cut
        self.qs: list[Expr] = []
        self.us: list[Expr] = []
        self.virtuals: dict[tuple[str, int], Virtual] = {}

    @property
    def rotary(self) -> bool:
        """Has it one coordinate, an angle?"""
        return self.single and self.kind.coordinates[0].turns

    @property
    def single(self) -> bool:
        """Has it one coordinate?"""
        return len(self.kind.coordinates) == 1

    @property
    def direction(self) -> tuple[float, ...]:
        return self.card.direction

    @property
    def q(self) -> Expr:
        return self.qs[0]

    @property
    def u(self) -> Expr:
        return self.us[0]

    def closure(self, b: Builder, fa: Frame, fb: Frame) -> list[tuple[str, Scalar, str]]:
        """All rows of a cut joint: (label, h, unit of the multiplier), always in the same places."""
        return self.kind.closure(b, fa, fb, self.gap(fa, fb))

    def measure(self, b: Builder, fa: Frame, fb: Frame, near: list[Scalar] | None = None) -> list[Expr]:
        """The coordinates of a cut joint as functions of the others; an angle that did not merge is the one within half a
        turn of `near`, `zero=` counted in."""
        zeros = self.kind.zeros
        near = [0.0] * len(self.kind.coordinates) if near is None else near
        values = self.kind.measure(b, fa, fb, self.gap(fa, fb), near)
        return [b.const(0.0) + v - zero for v, zero in zip(values, zeros, strict=False)]

    def gap(self, fa: Frame, fb: Frame) -> list[Scalar]:
        """From its point on A to that on B."""
        return subtract(fb.point(self.pb).pos, fa.point(self.pa).pos)


def place(b: Builder, plan: Plan, joints: dict[str, JointState], roots: dict[str, list[Coordinate]],
          fixed: dict[str, tuple[float, float, float]], in_space: bool) -> dict[str, Frame]:  # fmt: skip
    """Frames of all bodies along the tree; fills `qs` and `us` of the tree joints."""
    frames = {GROUND: ground(b, in_space)}
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
    qs = [c.q for c in joint.coordinates if c.q_name]
    us = [c.u for c in joint.coordinates if c.u_name]
    passed = joint.kind.move(moving, qs, us, sign)
    joint.qs, joint.us = qs, us
    if passed:
        measured = [_measured(joint, p, q, u) for p, q, u in zip(passed, qs, us, strict=True)]
        joint.qs, joint.us = [q for q, _ in measured], [u for _, u in measured]


def _measured(joint: JointState, passed: Passed, q: Expr, u: Expr) -> tuple[Expr, Expr]:
    """Coordinate and speed, virtual motion along the axis counted in: a reaction acts across it only.

    The axis turns with A; without (along s)' whole, a rotor on the coordinate would leave a force across the axis.
    """
    for (kind, k), virtual in joint.virtuals.items():
        if (kind == "turn") == passed.turns and kind != "gear":
            along, turning = passed.share(WORLD_AXES[k])
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
