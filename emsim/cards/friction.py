"""FRICTION: Coulomb friction with stiction on a joint, a clutch or a brake where fc= is an expression.

    effort = -F(u) sgn(u),  F(u) = fc + (fs - fc) exp(-(u/vs)^2);  at rest anything up to fs
    and -b u
`model=smooth` writes fc tanh(u/vs) in its place: what should stick creeps then.
"""

from __future__ import annotations

from .base import Card, Default, Required, Spec, is_number
from .laws import Relay

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Powers, Probes, Resistances, Scalar, Scene
    from .laws import Law


class Friction(Card):
    spec = Spec(
        "FRICTION",
        "FRICTION name joint fc=value/{expr} [fs=] [vs=] [b=] [model=smooth]",
        terminals="joint:joint",
        mark=("fc",),
        meaning="Coulomb friction with stiction; a clutch or a brake where fc= is an expression",
        missing={"mu": "friction by the joint's own normal force", "mus": "friction by the joint's own normal force"},
        laws={"P": "F |u| + b u^2, F = fc + (fs - fc) exp(-(u/vs)^2)"},
        fc=Required("N or N m", "friction while sliding: number, {expression} or waveform", "value"),
        fs=Default(None, "N or N m", "friction that must be overcome to start; fc unless given", least=0.0),
        vs=Default(
            None, "m/s or rad/s", "speed over which fs falls to fc, at once unless given; of model=smooth", above=0.0
        ),
        b=Default(0.0, "N s/m or N m s/rad", "viscous part", least=0.0),
        model=Default("exact", "", "smooth: fc tanh(u/vs), which sticks nowhere", "word", words=("exact", "smooth")),
    )  # fmt: skip
    fc: Any
    fs: float | None
    vs: float | None
    b: float
    model: str
    joint: JointView
    law: Relay | None = None

    def check(self, sink: Sink) -> None:
        what = f"FRICTION {self.name}"
        if is_number(self.fc) and self.fc < 0.0:
            said = f"fc= of {what} is {self.fc:g}; friction cannot be below 0"
            sink.error("E238", said, self.place("fc"))
        elif is_number(self.fc) and self.fs is not None and self.fs < self.fc:
            said = f"fs= of {what} is {self.fs:g}, less than fc= {self.fc:g}: what slides would be held more than what rests"
            sink.error(
                "E238", said, self.place("fs"), "fs= is the friction that must be overcome, the larger one"
            )
        if self.model == "smooth":
            if self.vs is None:
                said = f"{what} needs vs= for model=smooth: the speed over which the force is smoothed"
                sink.error("E230", said, self.place("model"))
            if self.fs is not None:
                said = f"fs= of {what} does not fit model=smooth, which sticks nowhere"
                sink.error("E240", said, self.place("fs"), "leave one of them out")
        elif self.vs is not None and self.fs is None:
            said = (
                f"vs= of {what} has no effect: it says over which speed fs= falls to fc=, and there is no fs="
            )
            hint = "friction sticks and slides exactly, nothing is smoothed; model=smooth would"
            sink.note("N232", said, self.place("vs"), hint)

    def prepare(self, s: Scene) -> None:
        sliding: Expr = s.compile(self.fc, self.place("fc"))
        if sliding.value is None:
            sliding = s.maximum(sliding, 0.0)  # a clutch presses or does not
        self.sliding = sliding
        if self.model == "smooth":
            return
        u = self.joint.u
        stick = sliding if self.fs is None else s.maximum(s.b.const(self.fs), sliding)
        bound: Scalar = sliding
        if self.vs is not None:
            bound = sliding + (stick - sliding) * s.b.call("exp", -(u / self.vs) * (u / self.vs))
        self.law = Relay(u, bound, stick, "N m" if self.joint.rotary else "N")

    def laws(self, s: Scene) -> list[Law]:
        return [] if self.law is None else [self.law]

    def powers(self, s: Scene) -> Powers:
        u = self.joint.u
        result: Powers = [(-self.b * u, u)] if self.b else []
        if self.law is None:
            result.append((self._smooth(s), u))
        return result

    def _smooth(self, s: Scene) -> Expr:
        assert self.vs is not None
        return -self.sliding * s.b.call("tanh", self.joint.u / self.vs)

    def _effort(self, s: Scene) -> Expr:
        dry = self._smooth(s) if self.law is None else self.law.effort
        return dry - self.b * self.joint.u if self.b else dry

    def probes(self, s: Scene) -> Probes:
        effort, u = self._effort(s), self.joint.u
        found: Probes = {"torque" if self.joint.rotary else "force": effort, "slip": u, "power": effort * u}
        if self.law is not None:
            found["mode"] = self.law.mode
        return found

    def losses(self, s: Scene) -> Scalar | None:
        return -(self._effort(s) * self.joint.u)

    def thermal(self, s: Scene) -> Resistances:
        return [("", self.b, self.joint.u)] if self.b else []

    def glyph(self, draw: Pen) -> None:
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        effort = draw.channel(f"{word}({self.name})", unit, self._effort(draw.m))
        draw.add("friction", self, **draw.joint(self.joint.name), effort=effort, unit=unit)

    def analogue(self, net: Net) -> None:
        net.refuse(self, "has modes, and no element of a circuit has")
