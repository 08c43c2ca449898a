"""LATCH: two bodies, or a joint's coordinate, that are held as they stand: from the start, or from where a condition catches
them; until a condition lets them go, or what holds breaks.

    held         w = 0: the speed of the coordinate; or of Q against P's part (hold=point), with their turning (hold=weld); or
                 of their distance (hold=distance)
    let go       no force
Rows of speeds, which no position is behind: what is caught stays where it was caught. A state machine, the same whatever the
order of events: broken stays broken; while release= is true it is let go; else catch= holds it, and what is held stays so. It
breaks where the size of the force is above force=, or of the torque above torque=. What is caught while it moves takes the
impulse of a plastic impact, whose energy is booked; what is let go or breaks keeps its momenta. Modes and impulses:
engine/dae/src/modes/bonds.rs.
"""

from __future__ import annotations

from .along import drawn, length
from .base import Default, Spec
from .coordinate import OnJointOrPoints
from .kinematics import WORLD_AXES, cross, subtract
from .laws import Inequality
from .round import nonzero

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Pen, Probes, Scalar, Scene
    from .laws import Law


class Bond(Inequality):
    """A row of a latch. `catch`, `release`: flags; `limits`: efforts whose length breaks it above a number."""

    __slots__ = ("catch", "held", "limits", "release")

    def __init__(self, flow: Scalar, unit: str, held: bool, catch: Scalar, release: Scalar) -> None:
        super().__init__("bond", flow, 0.0, release, None, 0.0, unit)
        self.held, self.catch, self.release = held, catch, release
        self.limits: list[tuple[Sequence[Law], float]] = []

    @property
    def broken(self) -> Expr:
        return self.flags[4]


class Latch(OnJointOrPoints):
    spec = Spec(
        "LATCH",
        "LATCH name (joint or P Q) held=yes and/or catch={condition} [release={condition}] [hold=weld] [force=] [torque=]",
        terminals="joint:joint | p:point q:point",
        mark=("held", "catch"),
        meaning="holds two bodies or a coordinate as they stand, until it is let go or breaks; catches what moves",
        meant={"break": "force={}", "when": "catch={}", "until": "release={}"},
        laws={"q": "held: no motion; caught by a plastic impact"},
        held=Default(False, "", "does it hold from the start?", "flag"),
        catch=Default(None, "", "where this is true (above 0) it holds what it finds", "value"),
        release=Default(None, "", "while this is true (above 0) it is let go", "value"),
        hold=Default(
            "weld", "", "between points: what it holds", "word", words=("weld", "point", "distance")
        ),
        force=Default(None, "N", "it breaks above this force, for ever", above=0.0),
        torque=Default(None, "N m", "it breaks above this torque, for ever", above=0.0),
    )
    held: bool
    catch: Any
    release: Any
    hold: str
    force: float | None
    torque: float | None

    def check(self, sink: Sink) -> None:
        what = f"LATCH {self.name}"
        if not self.held and self.catch is None:
            said = f"{what} never holds: it needs held=yes or catch="
            sink.error("E230", said, self.span, self.spec.form)
        if len(self.terminals) == 1 and self.given("hold"):
            sink.error("E240", f"hold= of {what} is for two points", self.place("hold"))

    def needs_direction(self) -> bool:
        return self.joint is None and self.hold == "distance"

    def _motions(self, s: Scene) -> tuple[list[Scalar], list[Scalar]]:
        """Velocities and angular velocities that it holds."""
        if self.joint is not None:
            return ([], [self.joint.u]) if self.joint.rotary else ([self.joint.u], [])
        if self.hold == "distance":
            return [s.distance(self.p, self.q)[1]], []
        a, b = s.body_of(self, "p"), s.body_of(self, "q")
        away = subtract(self.q.pos, self.p.pos)
        moves = subtract(subtract(self.q.vel, self.p.vel), cross(a.omega, away))
        turns = subtract(b.omega, a.omega) if self.hold == "weld" else []
        return nonzero(moves, WORLD_AXES), nonzero(turns, WORLD_AXES) if turns else []

    def prepare(self, s: Scene) -> None:
        moves, turns = self._motions(s)
        for key, found in (("force", moves), ("torque", turns)):
            if getattr(self, key) is not None and not found:
                said = f"{key}= of LATCH {self.name}: what it holds takes no {key}"
                s.sink.error("E240", said, self.place(key), "leave it out")
        if not moves and not turns:
            said = f"LATCH {self.name} has no effect: its parts cannot move against each other"
            s.sink.note("N233", said, self.span)
        catch, release = (self._condition(s, key) for key in ("catch", "release"))
        self.forces = [Bond(w, "N", self.held, catch, release) for w in moves]
        self.torques = [Bond(w, "N m", self.held, catch, release) for w in turns]
        self.bonds = [*self.forces, *self.torques]
        limits = [(self.forces, self.force), (self.torques, self.torque)]
        for bond in self.bonds:
            bond.limits = [(rows, most) for rows, most in limits if most is not None]

    def _condition(self, s: Scene, key: str) -> Scalar:
        value = getattr(self, key)
        if value is None:
            return 0.0
        return s.b.flag(s.public(s.compile(value, self.place(key))), None, f"LATCH {self.name} {key}", -1)

    def laws(self, s: Scene) -> list[Law]:
        return [*self.bonds]

    def taken(self, s: Scene) -> Scalar:
        """Kinetic energy that catching has taken so far [J]."""
        return sum((bond.lost for bond in self.bonds), s.b.const(0.0))

    def probes(self, s: Scene) -> Probes:
        """force(card), torque(card): on Q's part, of several rows their length; mode: 1 holds, 0 let go, -1 broken."""
        found: Probes = {}
        for word, bonds in (("force", self.forces), ("torque", self.torques)):
            if bonds:
                efforts = [bond.effort for bond in bonds]
                found[word] = s.b.select(bonds[0].closed, length(s.b, efforts), 0.0)
        if self.bonds:
            first = self.bonds[0]
            found.update({"mode": first.closed - first.broken, "hits": first.hits})
        if len(self.bonds) == 1:
            found["impulse"] = self.bonds[0].impulse
        return found

    def glyph(self, draw: Pen) -> None:
        if not self.bonds:
            return
        holds = draw.channel(f"mode({self.name})", "", self.bonds[0].closed - self.bonds[0].broken)
        if self.joint is not None:
            found = drawn(draw, self.joint)
            ends = [found["a"], found["b"]]
        else:
            ends = [draw.terminal(self, "p"), draw.terminal(self, "q")]
        draw.add("latch", self, p=ends[0], q_=ends[1], mode=holds, bar=self.hold == "distance")
