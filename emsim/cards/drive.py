"""DRIVE: prescribed motion of a joint, q(t) or its speed.

The coordinate is replaced by the given function of time, which has neither corners nor jumps: an expression, or SIN
without delay. With qd= the speed is given, of time, of anything
electrical or of joints that are not driven, and the coordinate is its integral. Prescribed motion is no unknown
that qd= could read: for feedback from the driven joint itself use a MOTOR or a TORQUE. `torque(drive)` is what
the drive applies on the joint.
"""

from __future__ import annotations

from .base import Card, Default, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Probes, Scene


class Drive(Card):
    spec = Spec(
        "DRIVE",
        "DRIVE name joint q={..} or qd={..}",
        terminals="joint:joint",
        mark=("q", "qd"),
        meaning="prescribed motion of a joint",
        meant={"": "q={}", "pos": "q={}", "angle": "q={}", "speed": "qd={}", "omega": "qd={}", "w": "qd={}"},
        q=Default(None, "rad or m", "the coordinate, a smooth expression of time", "value"),
        qd=Default(
            None,
            "rad/s or m/s",
            "the speed, corners allowed, an expression that reads no driven motion",
            "value",
        ),
    )
    valued = True
    q: Any
    qd: Any
    joint: JointView

    def check(self, sink: Sink) -> None:
        if self.raw.wave is not None and self.q is None and self.qd is None:
            self.q = self.raw.wave
        if (self.q is None) == (self.qd is None):
            sink.error("E230", f"DRIVE {self.name} needs one of q= and qd=", self.span, self.spec.form)

    def probes(self, s: Scene) -> Probes:
        return {
            "torque" if self.joint.rotary else "force": lambda: s.reaction(self.name),
            "power": lambda: s.reaction(self.name) * self.joint.u,
        }

    def glyph(self, draw: Pen) -> None:
        draw.add("drive", self, **draw.joint(self.joint.name))

    def analogue(self, net: Net) -> None:
        """A voltage source: the speed, or the derivative of the coordinate as a capacitor of 1 F takes it."""
        b, a = net.across(self.joint.name)
        n = self.name.replace(".", "_")
        if self.qd is not None:
            net.voltage(f"s_{n}", self.qd, 1.0)
            net.add(f"Ed_{n} {b} {a} s_{n} 0 1", "prescribed speed")
            return
        net.voltage(f"p_{n}", self.q, 1.0)
        net.add(f"Cd_{n} p_{n} d_{n} 1", "its current is the speed")
        net.add(f"Vd_{n} d_{n} 0 0")
        net.add(f"Hd_{n} {b} {a} Vd_{n} 1", "prescribed motion")
