"""What FRICTION, STOP, SPRING and DAMPER act on: a coordinate of a joint, or several of its speeds at once.

    hinge      the coordinate of a joint that has one
    c.angle    one coordinate of several, by the word that reads it: pos and angle of a cylinder, angle1 and angle2 of a universal
    b.swing    of a ball: the angle between its axis in A and in B; b.twist: what of the turn is about the axis
    b          of a ball: the angular velocity of B against A, three numbers in the axes of B
    p.slide    of a planar: the velocity along its plane, two numbers
What has several numbers has one law for all: friction of at most F against the direction of the motion (Coulomb's law in the
length of the vector). Swing s and twist t of a turn R with the axis a, without a jump but where B stands upside down against A:
    s = atan2(|Ra x a|, Ra . a),    t = 2 atan2(a . v, e0) of the quaternion (e0, v) of R: R turns by t about a, then swings
"""

from __future__ import annotations

from .joints.ball import matrix
from .kinematics import cross, dot, perpendicular, times
from .laws import Relay, joined
from .touch import NOTHING

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Builder, Expr
    from .base import JointView, Pen, Scalar, Scene
    from .joints.base import JointKind


class Along:
    """One coordinate of a joint, or a vector of its speeds, as cards see it: a JointView. `name` is the joint's."""

    def __init__(self, joint: Any, word: str, q: Expr | None, us: list[Expr]) -> None:
        self.name, self.a, self.pa, self.direction = joint.name, joint.a, joint.pa, joint.direction
        self.kind, self.word, self.rotary, self.us = joint.kind, word, turns(joint.kind, word), us
        if q is not None:
            self.q, self.u = q, us[0]


def words(kind: JointKind, vectors: bool) -> list[str]:
    """What may stand behind the dot: coordinates with a speed of their own, what is measured, and vectors."""
    if kind.in_plane_only:  # it holds nothing
        return []
    own = [] if kind.quasi else [c.word for c in kind.coordinates]
    return [*own, *(c.word for c in kind.measures), *(w for w in kind.vectors if w and vectors)]


def turns(kind: JointKind, word: str) -> bool:
    """Is it an angle, or an angular velocity?"""
    if word in kind.vectors:
        return kind.speeds[kind.vectors[word][0]].turns
    return next(c.turns for c in (*kind.coordinates, *kind.measures) if c.word == word)


def found(joints: dict[str, Any], name: str) -> tuple[Any, str]:
    """The joint that a word of a card names, None without one, and the word of the coordinate behind it."""
    if name in joints:
        return joints[name], ""
    head, _, word = name.rpartition(".")
    return joints.get(head), word


def misfit(kind: JointKind, word: str, along: str) -> bool:
    """Is there no such coordinate, or more than one, for a card with this `along`?"""
    if not word:
        return len(kind.coordinates) != 1 and not (along == "several" and word in kind.vectors)
    return word not in words(kind, along == "several") if along else True


def choice(name: str, kind: JointKind, along: str) -> str | None:
    """A hint: how coordinates of a joint are named."""
    said = [f"{name}.{word}" for word in words(kind, along == "several")] if along else []
    return f"it has several coordinates; name one: {' or '.join(said)}" if said else None


def view(s: Scene, joint: Any, word: str) -> JointView:
    """What a card acts on, where it fits."""
    kind = joint.kind
    if len(kind.coordinates) == 1:
        return joint
    if word in kind.vectors:
        us = [joint.us[k] for k in kind.vectors[word]]
        if kind.quasi and not joint.cut:  # a virtual turn is a motion too
            axes = s.frame(joint.b).rot.matrix()  # type: ignore[attr-defined]
            for (what, k), virtual in joint.virtuals.items():
                if what == "turn":
                    us = [u + part * virtual.rate for u, part in zip(us, axes[k], strict=True)]
        return Along(joint, word, None, us)
    for c, q, u in zip(kind.coordinates, joint.qs, joint.us, strict=False):
        if c.word == word and not kind.quasi:
            return Along(joint, word, q, [u])
    measured = swing_and_twist(s, joint)
    q = next(q for c, q in zip(kind.measures, measured, strict=True) if c.word == word)
    return Along(joint, word, q, [s.rate(q)])


def drawn(draw: Pen, joint: JointView) -> dict[str, Any]:
    """What a shape on it needs, as Pen.joint has it of a joint with one coordinate."""
    found = draw.joint(joint.name)
    if isinstance(joint, Along):
        found["joint"] = found["sort"] = "pin" if joint.rotary else "slide"
        for c, zero in zip(joint.kind.coordinates, joint.kind.zeros, strict=False):
            if c.word == joint.word:
                found["axis"], found["zero"] = list(joint.kind.axis_of(c.along)), zero
                found["q"] = draw.channel(f"{c.word}({joint.name})", c.unit, joint.q)
    return found


def swing_and_twist(s: Scene, joint: Any) -> list[Expr]:
    """Of a ball [rad]."""
    b, axis = s.b, joint.kind.axis
    e = [axis, *perpendicular(axis)]
    if joint.cut or joint.virtuals:
        p, q = ([s.frame(body).direction(x) for x in e] for body in (joint.a, joint.b))
    else:  # the turn is its own
        turn = matrix([c.q for c in joint.coordinates if c.q_name])
        p, q = [[*x] for x in e], [times(turn, x) for x in e]
    over = cross(p[0], q[0])
    swing = b.call(
        "atan2", b.call("sqrt", b.const(NOTHING) + dot(over, over)), b.const(0.0) + dot(p[0], q[0])
    )
    # of the turn in the axes (a, e1, e2): 4 e0 a.v and 4 e0^2
    about = b.const(0.0) + dot(p[2], q[1]) - dot(p[1], q[2])
    trace = b.const(1.0) + dot(p[0], q[0]) + dot(p[1], q[1]) + dot(p[2], q[2])
    return [swing, 2.0 * b.call("atan2", about, trace)]


def rubbing(us: Sequence[Scalar], bound: Scalar, stick: Scalar, unit: str) -> list[Relay]:
    """Friction against one speed, or against the direction of a vector."""
    return joined([Relay(u, bound, stick, unit) for u in us])


def length(b: Builder, parts: Sequence[Scalar]) -> Expr:
    """Of a vector, to be read; the one number that there is."""
    found = b.const(0.0) + parts[0]
    for part in parts[1:]:
        found = b.call("hypot", found, part)
    return found


def size(b: Builder, parts: Sequence[Scalar]) -> Expr:
    """The same with a slope at 0, for equations."""
    if len(parts) == 1:
        return b.const(0.0) + parts[0]
    return b.call("sqrt", b.const(NOTHING) + dot(parts, parts))
