"""SPRING: linear, on a joint or between two points. V = k/2 (q - q0)^2 + f0 q.

Between points q is their distance and q0 is called l0. `force` is what the spring applies along its
coordinate: -k (q - q0) - f0; between points a positive force pushes them apart.
"""

from __future__ import annotations

from .base import Default, Required, Spec
from .coordinate import OnJointOrPoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Net, Pen, Probes, Scalar, Scene


class Spring(OnJointOrPoints):
    spec = Spec(
        "SPRING",
        "SPRING name (joint or P Q) k= [q0= / l0=] [f0=]",
        terminals="joint:joint | p:point q:point",
        mark=("k",),
        meaning="a linear spring",
        meant={"": "k={}", "c": "k={}", "rate": "k={}", "stiffness": "k={}"},
        laws={"V": "k (q - q0)^2/2 + f0 q"},
        k=Required("N/m or N m/rad", "stiffness", least=0.0),
        q0=Default(0.0, "m or rad", "coordinate of rest, on a joint"),
        l0=Default(0.0, "m", "length of rest, between points", least=0.0),
        f0=Default(0.0, "N or N m", "preload: the force at rest, against the coordinate"),
    )
    k: float
    q0: float
    l0: float
    f0: float

    def check(self, sink: Sink) -> None:
        on_joint = len(self.terminals) == 1
        wrong = "l0" if on_joint else "q0"
        if self.given(wrong):
            right = "q0= is for a joint" if on_joint else "l0= is for two points"
            sink.error("E240", f"SPRING {self.name}: {wrong}= does not fit here; {right}", self.place(wrong))
        self.rest = self.q0 if on_joint else self.l0

    def needs_direction(self) -> bool:
        return self.joint is None and not (self.rest == 0.0 and self.f0 == 0.0)

    def potential(self, s: Scene) -> Scalar | None:
        if self.joint is None and not self.needs_direction():
            # k/2 |P - Q|^2 needs no root, and stays smooth where the points meet
            d = [a - b for a, b in zip(self.q.pos, self.p.pos, strict=True)]
            return 0.5 * self.k * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        q, _ = self.coordinate(s)
        return 0.5 * self.k * (q - self.rest) * (q - self.rest) + self.f0 * q

    def probes(self, s: Scene) -> Probes:
        q, u = self.coordinate(s)
        effort = -self.k * (q - self.rest) - self.f0
        return {self.effort_name(): effort, "power": effort * u}

    def glyph(self, draw: Pen) -> None:
        self.glyph_between(draw, "spring")

    def analogue(self, net: Net) -> None:
        """An inductor of 1/k: its current is the force."""
        if self.joint is None:
            return net.refuse(self, "lies between two points; put it on the joint")
        b, a = net.across(self.joint.name)
        n = self.name.replace(".", "_")
        if self.k:
            force = self.k * (net.value(self.joint.name)[0] - self.rest)
            net.add(f"Lk_{n} {b} {a} {1.0 / self.k!r} ic={force!r}", "spring")
        if self.f0:
            net.add(f"If_{n} {b} {a} {self.f0!r}", "preload")
