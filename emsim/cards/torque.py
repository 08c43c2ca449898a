"""TORQUE: a torque on a joint (on B, against A), or on a body from outside. Power: tau * speed."""

from __future__ import annotations

from .base import Card, Default, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import BodyView, JointView, Net, Pen, Powers, Probes, Scalar, Scene


class Torque(Card):
    spec = Spec(
        "TORQUE",
        "TORQUE name (joint or body) tau=value/{expr}/SIN(..)/PULSE(..)/PWL(..)",
        terminals="target:turnable",
        mark=("tau",),
        meaning="a torque on a pin or a body; on a slide it is the force along it",
        meant={"": "tau={}", "t": "tau={}", "m": "tau={}", "torque": "tau={}", "value": "tau={}"},
        tau=Required("N m", "the torque: number, {expression} or waveform", "value"),
        axis=Default((0.0, 0.0, 1.0), "", "axis of the torque on a body, world axes", "vector"),
    )
    valued = True
    tau: Any
    axis: tuple[float, ...]
    joint: JointView | None = None
    body: BodyView | None = None

    def check(self, sink: Sink) -> None:
        length = sum(c * c for c in self.axis) ** 0.5
        if len(self.axis) != 3 or length == 0.0:
            sink.error("E232", f"axis= of TORQUE {self.name} has three components", self.place("axis"))
            return
        self.unit = [c / length for c in self.axis]

    def leaves_plane(self) -> bool:
        return any(self.unit[:2])

    def prepare(self, s: Scene) -> None:
        self.effort: Expr | None = None

    def _effort(self, s: Scene) -> Expr:
        if self.effort is None:
            self.effort = s.compile(self.tau, self.place("tau"))
        return self.effort

    def _speed(self) -> Expr:
        if self.joint is not None:
            return self.joint.u
        assert self.body is not None
        w = self.body.omega
        return self.unit[0] * w[0] + self.unit[1] * w[1] + self.unit[2] * w[2]

    def powers(self, s: Scene) -> Powers:
        return [(self._effort(s), self._speed())]

    def supplied(self, s: Scene) -> Scalar:
        return sum((effort * flow for effort, flow in self.powers(s)), s.b.const(0.0))

    def probes(self, s: Scene) -> Probes:
        effort = self._effort(s)
        word = "force" if self.joint is not None and not self.joint.rotary else "torque"
        return {word: effort, "power": effort * self._speed()}

    def glyph(self, draw: Pen) -> None:
        effort = draw.channel(f"torque({self.name})", "N m", self._effort(draw.m))
        if self.joint is not None:
            draw.add("torque", self, **draw.joint(self.joint.name), effort=effort)
        elif self.body is not None:
            draw.add("torque", self, a=draw.on(self.body.name), axis=self.unit, effort=effort)

    def analogue(self, net: Net) -> None:
        """A current source."""
        if self.joint is not None:
            b, a = net.across(self.joint.name)
        else:
            body = self.terminals[0][2].name
            b, a = net.node(body), "0"
            if not net.turns(body) or self.unit[:2] != [0.0, 0.0]:
                return net.refuse(self, "acts across the body's one motion")
        net.current(f"t_{self.name}", b, a, self.tau, "torque")
