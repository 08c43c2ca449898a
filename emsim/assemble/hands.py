"""What hands do to a deck that a page shows: a body is held at a point of it, a switch is turned against its control.

    F = on (k (P0 - P) - c dP/dt)     a spring from the pointer P0 to the point P of one body, and what damps it

All of it comes from outside (`flat.inputs`), and is 0 where no hand is. A start is moved by coordinates, `movable`.
"""

from __future__ import annotations

from ..cards.base import Card, Spec
from ..cards.kinematics import add, cross, times
from ..expr import OUTSIDE
from ..opened import hand_on as on

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from ..cards.base import Powers, Scene
    from ..cards.kinematics import Frame
    from ..elaborate.flat import FlatDeck
    from .mechanism import Mechanism
    from .scene import Coordinate

POINTER = tuple(f"hand {word}" for word in ("x", "y", "z", "px", "py", "pz", "k", "c"))


def wanted(flat: FlatDeck) -> list[str]:
    """The inputs of a deck's hands."""
    bodies = [card.name for card in flat.machine if card.kind == "BODY"]
    switches = [e.name for e in flat.elements if e.letter in "sw"]
    return [*(POINTER if bodies else ()), *map(on, [*bodies, *switches])]


class Hand(Card):
    """A hand on one body."""

    spec = Spec("HAND", "", "", (), "a hand on a body")

    def __init__(self, m: Mechanism, body: Card, frame: Frame) -> None:
        self.name, self.span, self.terminals, self.ok = body.name, body.span, [], True
        self.frame, self.m = frame, m

    def powers(self, s: Scene) -> Powers:
        m = self.m
        values = [m.b.wave_expr(m.ctx.input(OUTSIDE + word)) for word in (*POINTER, on(self.name))]
        pointer, local, (k, c, held) = values[:3], values[3:6], values[6:]
        axes = range(3 if m.in_space else 2)
        arm: Any = [local[i] - self.frame.ref[i] if i in axes else 0.0 for i in range(3)]
        arm = times(self.frame.rot.matrix(), arm)
        at, speed = add(self.frame.org, arm), add(self.frame.vel, cross(self.frame.omega, arm))
        return [(held * (k * (pointer[i] - at[i]) - c * speed[i]), speed[i]) for i in axes]


def couple(m: Mechanism) -> list[Card]:
    """A hand for each body that can move, where hands are asked for."""
    asked: Mapping[str, float] = m.ctx.flat.inputs or {}
    bodies = [body for name, body in m.bodies.items() if OUTSIDE + on(name) in asked and not body.fixed]
    return [Hand(m, body, m.frames[body.name]) for body in bodies]


def mass(m: Mechanism) -> float:
    """What a hand has to move, about [kg]: all masses, and inertias at the arm of the largest length."""
    arm = m.ctx.scale.length or 1.0
    parts = [v for b in m.bodies.values() if not b.fixed for v in (b.m, b.inertia[2] / (arm * arm))]
    return sum(getattr(v, "start", v) for v in parts) or 1.0


def movable(m: Mechanism) -> tuple[list[Coordinate], dict[str, list[int]]]:
    """Coordinates that can be held elsewhere at the start or give way, and of each body those by which it is moved: of the
    nearest joint towards the ground that has any. Displacements where there are any: who takes hold of a free body does not
    turn it."""
    places = m.places
    found = {name: _of_body(m, name) for name, body in m.bodies.items() if not body.fixed}
    # a coordinate whose speed is prescribed gives no way
    return places, {name: [places.index(c) for c in own if c in places] for name, own in found.items()}


def _of_body(m: Mechanism, body: str) -> Sequence[Coordinate]:
    while True:
        step = m.plan.above.get(body)
        joint = None if step is None else m.joints[step.joint]
        of = m.roots.get(body, []) if joint is None else joint.coordinates
        own = [c for c in of if c.row >= 0 and c.q_name]
        slides = [c for c in own if not c.rotary]
        if slides:
            return slides
        if own:
            return [] if joint is not None and joint.kind.quasi else own
        if step is None:
            return []
        body = step.parent
