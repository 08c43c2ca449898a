"""CAM: a follower that rides on a profile, q(follower) = f(q(cam)), lift={f} an expression of the cam's own coordinate.

    grooved (as it stands)   h = q - f(q_cam) = 0: a row; its multiplier is the force on the follower
    with e= or k=            gap q - f(q_cam) >= 0, which opens where the follower lifts off (touch.py)
The cam works on the follower and the follower on the cam with f' times the force: no energy is lost but in impacts and c=.
"""

from __future__ import annotations

from math import pi

from ..expr import Call, ExprError, Node, Num, Scope, evaluate, rewritten
from . import touch
from .base import Card, Own, Required, Spec
from .touch import Touching

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .base import JointView, Pen, Probes, Scalar, Scene


class Cam(Touching, Card):
    spec = Spec(
        "CAM",
        "CAM name follower cam lift={expression of the cam's coordinate}   or with e= or k= [c= or e=] [n=1]: it can lift off",
        terminals="follower:joint cam:joint",
        mark=("lift",),
        meaning="a cam and its follower: the follower's coordinate is a function of the cam's",
        laws={
            "q": "q = f(q_cam); one-sided q >= f(q_cam)",
            "V": "with k=: k d^(n+1)/(n+1), d how far the follower is pressed in",
            "P": "c d'^2, or that which gives back e times the speed",
        },
        lift=Required(
            "m or rad",
            "the follower's coordinate as an expression of the cam's: {5m*(1-cos(angle(cam)))}",
            "value",
        ),
        **touch.LAW,
    )
    lift: Any
    k: float | None
    c: float
    e: float | None
    n: float
    follower: JointView
    cam: JointView

    def check(self, sink: Sink) -> None:
        names = [ref.name for _, _, ref in self.terminals]
        if len(set(names)) == 1:
            sink.error("E237", f"CAM {self.name} lifts {names[0]} by itself", self.span, "name two joints")
        touch.check(self, self.k, self.c, self.e, sink)
        if not isinstance(self.lift, Node):
            said = f"lift= of CAM {self.name} does not depend on its cam: the follower would stand still"
            sink.error(
                "E252",
                said,
                self.place("lift"),
                f"write it of the coordinate, lift={{2m*sin(angle({names[1]}))}}; DRIVE holds a joint",
            )

    def prepare(self, s: Scene) -> None:
        at = s.b.symbol()
        profile = s.compile_energy(
            self.lift, self.place("lift"), Own(self.name, None, [], {self.cam.name: at})
        )
        other = s.beyond_coordinates(self.lift, profile) or self._elsewhere(s, profile)
        if other:
            said = f"lift= of CAM {self.name} reads {other}: a profile is a function of {self.cam.name} alone"
            s.sink.error(
                "E252", said, self.place("lift"), "what changes by itself is a DRIVE, a MOTOR or a second CAM"
            )
        elif not s.b.depends(profile, [at])[0]:
            said = (
                f"lift= of CAM {self.name} does not depend on {self.cam.name}: the follower would stand still"
            )
            s.sink.error(
                "E252",
                said,
                self.place("lift"),
                f"write it of the coordinate, lift={{2m*sin(angle({self.cam.name}))}}",
            )
        self.profile = s.b.substitute([profile], [(at, self.cam.q)])[0]
        self.gap = self.follower.q - self.profile
        self.grooved = self.k is None and self.e is None
        self.unit = "N m" if self.follower.rotary else "N"
        self.set_gaps(s, [] if self.grooved else [(1.0, self.name, self.gap)], self.unit)

    def _elsewhere(self, s: Scene, profile: Any) -> str:
        """Another joint's coordinate in the profile."""
        places = [(c.q_name, c.q) for c in s.all_coordinates() if c.q_name]  # type: ignore[attr-defined]
        read = s.b.depends(profile, [q for _, q in places])
        return next((name for (name, _), found in zip(places, read, strict=True) if found), "")

    def constraints(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return [("profile", self.gap, self.unit)] if self.grooved else []

    def probes(self, s: Scene) -> Probes:
        word = "torque" if self.follower.rotary else "force"
        if self.grooved:
            return {word: lambda: s.reaction(self.name)}
        return self.touch_probes(s, word)

    def _turn(self) -> list[float]:
        """The lift at every third degree of a turn and at its end, to be drawn; none of what is no function of numbers alone."""

        def at(angle: float) -> Node:
            return rewritten(
                self.lift, lambda n: Num(angle) if isinstance(n, Call) and n.fn == "angle" else None
            )

        try:
            return [evaluate(at(pi * k / 60), Scope()) for k in range(121)]
        except ExprError:
            return []

    def glyph(self, draw: Pen) -> None:
        word = "torque" if self.follower.rotary else "force"
        effort: Any = 0.0 if self.grooved else self.probes(draw.m)[word]
        draw.add(
            "cam", self, lift=self._turn() if self.cam.rotary else [],
            first=draw.joint(self.follower.name), second=draw.joint(self.cam.name), unit=self.unit,
            effort=draw.channel(f"{word}({self.name})", self.unit, effort),
        )  # fmt: skip
