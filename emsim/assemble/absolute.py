"""Maximal coordinates: every moving body has its own, every joint is constraint rows (`.options
formulation=absolute`).

The default for long chains and loops (tree.Plan.is_deep), the cross-check of joint coordinates, and the price of modelling
more than the scene needs: a four-bar has one freedom, three joint coordinates with two rows, or nine coordinates of its bodies
with eight rows.

A body's coordinates are those of its centre of mass, so its mass matrix is constant, and
    planar scene    x, y and the angle
    in space        x, y, z and Euler parameters e0..e3, a unit quaternion, with the row e.e - 1 = 0:
                    R = (2 e0^2 - 1) I + 2 e e^T + 2 e0 [e]x,   omega = 2 (e0 e' - e0' e + e x e') in world axes,
                    2 (e0 e' - e0' e - e x e') in the body's (Nikravesh, Computer-Aided Analysis of Mechanical
                    Systems, 1988, ch. 6). Off the unit sphere these are one of many continuations; the row's
                    multiplier takes what they differ by.
A joint's coordinate is measured from its bodies (loops.measure). In a planar scene an angle is a difference of
coordinates, so it counts full turns. In space it is an atan2, made to count them by an unknown that follows it:
    q = turned + atan2(angle - turned),  d(turned)/dt = omega        (q does not depend on `turned`, dq/dt is exact)
A DRIVE or a GEAR is a row; a DRIVE of a speed has the integral of that speed as a coordinate, and the row says
that the joint is there.

The start is that of joint coordinates, which the same deck is assembled to first: ic= and guess= are said of
joints, and both formulations must set out from one place. So what is wrong with a scene is said in its words.
"""

from __future__ import annotations

from ..cards.joints.ball import Ball
from ..cards.joints.base import AXES, Coord
from ..cards.kinematics import Frame, Moving, Rotation, add, cross, ground, scale, subtract
from ..diagnostics import Sink
from . import reactions
from .asked import MOMENTS
from .loops import Row
from .machine import Machine
from .scene import FREE, Coordinate
from .tree import GROUND, Plan

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Builder, Expr
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.kinematics import Scalar, Vector
    from .context import Context
    from .scene import JointState

ORIGIN = (0.0, 0.0, 0.0)


class Absolute(Machine):
    """The machine in maximal coordinates; `like` is the same in joint coordinates, assembled to its start."""

    guessed = False  # (that one has listened to them)

    def __init__(self, ctx: Context) -> None:
        self.like = _in_joint_coordinates(ctx)
        super().__init__(ctx)
        self.integrals: dict[str, Coordinate] = {}  # drive -> integral of the speed it prescribes
        self.broken = self.broken or self.like.broken
        self.shares = self.shares or bool(self.like.open_reactions)

    def build(self) -> None:
        if self.broken:
            return
        # everything but errors has been said in the words of joint coordinates
        loud, self.sink = self.sink, Sink()
        super().build()
        quiet, self.sink = self.sink, loud
        for diagnostic in quiet.diagnostics:
            if diagnostic.severity == "error":
                self.sink.add(diagnostic)
        if not self.broken:
            self.found.moved = self.like.found.moved

    # what is different from joint coordinates ---------------------------------------------------------

    def _graph(self) -> None:
        """Every body is free, every joint is cut."""
        moving = [name for name, body in self.bodies.items() if not body.fixed]
        self.plan = Plan(moving, [], list(self.joints))
        for joint in self.joints.values():
            joint.cut = True
            if joint.kind.in_plane_only:
                joint.kind = type(self.like.joints[joint.name].kind)(joint.card)
                joint.card.settle(joint.kind, self.sink)
            joint.kind.length = self.like.joints[joint.name].kind.length
        # what acts across the plane is shared too
        across = self.shares and reactions.OUT_OF_PLANE[0] in reactions.words(self.like)
        self.planar = _is_planar(self.like, moving) and not across
        self.poses = _poses(self.like, moving)
        coordinates = _planar if self.planar else _spatial
        self.roots = {name: coordinates(self.like, self.bodies[name], self.poses[name]) for name in moving}
        for drive in self.drives:
            if drive.qd is not None:
                joint = self.joints[drive.terminals[0][2].name]
                c = self.integrals[drive.name] = Coordinate(
                    joint.name, joint.kind.coordinates[0], joint.kind.speeds[0]
                )
                c.drive, c.start = drive, _value(self.like, self.like.joints[joint.name].q)

    def _check_measured(self, joint: JointState) -> None:
        """The start is that of joint coordinates."""

    def _check_inertia(self, body: Body) -> None:
        """The same: where joints keep a body in the plane, what it lacks about other axes is not missed."""

    def _locked_note(self) -> None:
        """Said already."""

    def _gravity_note(self) -> None:
        """Said already."""

    def all_coordinates(self) -> list[Coordinate]:
        return [*super().all_coordinates(), *self.integrals.values()]

    def _place(self) -> dict[str, Frame]:
        frames = {GROUND: ground(self.b)}
        for name, (x, y, angle) in self._fixed().items():
            moving = Moving(frames[GROUND], (x, y, 0.0))
            moving.turn(AXES["z"], angle, 0.0)
            frames[name] = moving.frame(name, ORIGIN)
        place = self._place_planar if self.planar else self._place_spatial
        for name, cs in self.roots.items():
            frames[name] = place(self.bodies[name], cs)
        if not self.planar:
            self._follow_turns(frames)
        return frames

    def _place_planar(self, body: Body, cs: list[Coordinate]) -> Frame:
        (x, y), angle = cs[:2], cs[2] if len(cs) > 2 else None
        pose = self.poses[body.name]
        moving = Moving(ground(self.b), (0.0, 0.0, pose.centre[2]))
        moving.slide(AXES["x"], x.q, x.u)
        moving.slide(AXES["y"], y.q, y.u)
        if angle is not None:
            moving.turn(AXES["z"], angle.q, angle.u)
        else:
            moving.turn(AXES["z"], pose.angle, 0.0)
        return moving.frame(body.name, body.centre)

    def _place_spatial(self, body: Body, cs: list[Coordinate]) -> Frame:
        qs, us = [c.q for c in cs], [c.u for c in cs]
        e0, e, v0, v = qs[3], [*qs[4:]], us[3], [*us[4:]]
        along = subtract(scale(e0, v), scale(v0, e))
        swept = cross(e, v)
        return Frame(
            body.name,
            Rotation(self.b, _matrix(e0, e)),
            body.centre,
            [*qs[:3]],
            [*us[:3]],
            scale(2.0, add(along, swept)),
            scale(2.0, subtract(along, swept)),
        )

    def _close(self, drives: list[Drive], gears: Any) -> None:
        # first, so that a redundant row is one of a joint
        if not self.planar:
            for name, cs in self.roots.items():
                square = sum((c.q * c.q for c in cs[3:]), self.b.const(-1.0))
                self.rows.append(Row(name, 0, "norm", square, ""))
        super()._close(drives, gears)

    def _integral(self, drive: Drive, joint: JointState) -> Expr | None:
        return self.integrals[drive.name].q

    @property
    def start_is_known(self) -> bool:
        """Joint coordinates have been asked; joints of a tree hold where they are put, and none repeats another. Where loops are
        closed too, no row repeats others if there are as many as take away what joint coordinates have no freedom for. Then what
        is left to a search is rounding, at a cost that grows with the cube of the number of rows: long loops do without."""
        found, plan = self.like.found, self.like.plan
        if not plan.is_deep:
            return not plan.cut and not self.like.rows and not found.redundant
        if found.singular or any(row.measured for row in self.rows):
            return False
        return len(self.motions) - len(self.rows) == found.dof

    def initial_state(self) -> list[float]:
        x = super().initial_state()
        for (name, k), row in self.turned.items():
            x[row] = _value(self.like, self.like.joints[name].qs[k])
        return x

    # reporting ----------------------------------------------------------------------------------------

    def loop_of(self, owner: str) -> list[str]:
        return [owner] if owner in self.bodies else super().loop_of(owner)

    def default_outputs(self) -> list[str]:
        parts = [
            (j.name, *part)
            for j in self.joints.values()
            for part in ((j.kind.coordinates, j.qs), (j.kind.speeds, j.us))
        ]
        unmeasured = {
            f"{c.word}({name})" for name, words, known in parts for c in words if len(known) < len(words)
        }
        # quaternions and body rates of free bodies are those of joints, and here there are none
        free = [j.name for key, j in self.like.joints.items() if key[:1] == FREE]
        unmeasured |= {f"{c.word}({name})" for name in free for c in (*Ball.coordinates, *Ball.speeds)}
        return [name for name in self.like.default_outputs() if name not in unmeasured]

    def report(self) -> dict[str, Any]:
        facts = super().report()
        if facts:
            facts["loops"] = [self.like.loop_of(name) for name in self.like.plan.cut]
            for joint in facts["joints"]:
                joint["role"] = "rows"
        return facts


def _in_joint_coordinates(ctx: Context) -> Machine:
    """The same deck's machine in joint coordinates, built to its start in a builder of its own."""
    from . import circuit
    from .compiling import Compiling

    builder: type[Builder] = type(ctx.b)
    other = Compiling(builder(), ctx.flat, ctx.options)
    other.times = ctx.times
    circuit.allocate(other)
    like = Machine(other)
    like.build()
    return like


def _is_planar(like: Machine, bodies: list[str]) -> bool:
    """Does every body turn about z alone and keep its height?"""
    frames = [like.frames[name] for name in bodies]
    heights = [like.public(frame.org[2]).value for frame in frames]
    return all(
        frame.rot.about_z() is not None and height is not None
        for frame, height in zip(frames, heights, strict=True)
    )


def _value(like: Machine, e: Any) -> float:
    """A scalar of the machine in joint coordinates, at its start."""
    return like.b.eval([like.public(e)], like.found.x, 0.0)[0]


def _coordinate(of: str, name: str, speed: str, unit: str, start: float, start_speed: float) -> Coordinate:
    c = Coordinate(of, Coord("", unit), Coord("", unit))
    c.q_name, c.u_name = name, speed
    c.start, c.start_speed = start, start_speed
    return c


class Pose:
    """Where a body starts and how it moves, as numbers: its centre of mass, its turn about z or as a matrix, in world axes."""

    __slots__ = ("angle", "centre", "omega", "rotation", "velocity")

    def __init__(self, values: list[float]) -> None:
        self.centre, self.velocity, self.omega = values[:3], values[3:6], values[6:9]
        self.rotation = [values[9:12], values[12:15], values[15:18]]
        self.angle = values[18]


def _poses(like: Machine, bodies: list[str]) -> dict[str, Pose]:
    """Of all bodies in one evaluation: each is an expression of every joint below it."""
    asked: list[Scalar] = []
    for name in bodies:
        frame = like.frames[name]
        centre = frame.point(like.bodies[name].centre)
        angle = frame.rot.about_z()
        turns = [v for row in frame.rot.matrix() for v in row]
        asked += [*centre.pos, *centre.vel, *frame.omega, *turns, 0.0 if angle is None else angle]
    values = like.b.eval(like.public_all([like.b.const(0.0) + e for e in asked]), like.found.x, 0.0)
    each = len(values) // max(1, len(bodies))
    return {name: Pose(values[k * each : (k + 1) * each]) for k, name in enumerate(bodies)}


def _centre(body: Body, pose: Pose, axes: str) -> list[Coordinate]:
    """x y z of the centre of mass."""
    name = f"{body.name}.com" if any(body.centre) else body.name
    return [
        _coordinate(body.name, f"{axis}({name})", f"v{axis}({name})", "m", p, v)
        for axis, p, v in zip(axes, pose.centre, pose.velocity, strict=False)
    ]


def _planar(like: Machine, body: Body, pose: Pose) -> list[Coordinate]:
    name, about = body.name, like.frames[body.name].rot.about_z()
    assert about is not None  # planar
    moment_is_read = like.open_reactions or _moment_is_read(like, name)
    if not body.inertia[2] and like.public(about).value is not None and not moment_is_read:
        # it only slides, and a turn without inertia would be no explicit equation
        return _centre(body, pose, "xy")
    turn = _coordinate(name, f"angle({name})", f"omega({name})", "rad", pose.angle, pose.omega[2])
    return [*_centre(body, pose, "xy"), turn]


def _moment_is_read(like: Machine, body: str) -> bool:
    """Does the deck read what keeps the body from turning? That is the multiplier of a row about its angle."""
    read = {name for fn, name in like.wanted if fn in MOMENTS}
    return any(joint.name in read and body in (joint.a, joint.b) for joint in like.joints.values())


def _spatial(like: Machine, body: Body, pose: Pose) -> list[Coordinate]:
    name, e = body.name, _quaternion(pose.rotation)
    wx, wy, wz = pose.omega
    # e' = omega * e / 2 in quaternions, omega in world axes
    v = (
        -wx * e[1] - wy * e[2] - wz * e[3],
        wx * e[0] + wy * e[3] - wz * e[2],
        -wx * e[3] + wy * e[0] + wz * e[1],
        wx * e[2] - wy * e[1] + wz * e[0],
    )
    turn = [_coordinate(name, f"e{k}({name})", f"de{k}({name})", "rad", e[k], 0.5 * v[k]) for k in range(4)]
    return [*_centre(body, pose, "xyz"), *turn]


def _matrix(e0: Expr, e: list[Expr]) -> list[Vector]:
    """R = (2 e0^2 - 1) I + 2 e e^T + 2 e0 [e]x"""
    x, y, z = e
    diagonal = 2.0 * e0 * e0 - 1.0
    return [
        [diagonal + 2.0 * x * x, 2.0 * (x * y - e0 * z), 2.0 * (x * z + e0 * y)],
        [2.0 * (x * y + e0 * z), diagonal + 2.0 * y * y, 2.0 * (y * z - e0 * x)],
        [2.0 * (x * z - e0 * y), 2.0 * (y * z + e0 * x), diagonal + 2.0 * z * z],
    ]


def _quaternion(r: list[list[float]]) -> list[float]:
    """Unit quaternion of a rotation matrix, by its largest component (Shepperd, J. Guidance 1, 1978)."""
    trace = r[0][0] + r[1][1] + r[2][2]
    squares = [1.0 + trace] + [1.0 + 2.0 * r[k][k] - trace for k in range(3)]
    k = max(range(4), key=squares.__getitem__)
    skew = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    if k == 0:
        found = [squares[0], *skew]
    else:
        i = k - 1
        found = [skew[i], *(r[i][j] + r[j][i] if j != i else squares[k] for j in range(3))]
    length = sum(v * v for v in found) ** 0.5
    return [v / length for v in found]
