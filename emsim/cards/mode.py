"""MODE: a body's frame carries a vibration of its shape, x + phi(x) q: floating frame, modal coordinate, small deformations.

It stands for a coordinate q, pos(name.q). With the velocity v of the body's origin, vc of its centre of mass at q = 0 and its
angular velocity w, M its mass, in body axes,

    T        sum (m u^2/2 + (p.v + h.w) u) + vc.s + (s^2/2 + s.sum p u)/M      u = q',  s = w x sum p q
    V        m (2 pi f)^2 q^2/2 - g.p q
    losses   2 zeta m 2 pi f u^2
with p = int phi dm, h = int x x phi dm: sum p q/M moves the centre of mass, and with it M |vc + (s + sum p u)/M|^2/2 is whole, so
that T stays above 0. How the inertia about it changes with q, and what pulls along it stiffen, is left out. A. A. Shabana,
Dynamics of multibody systems, 5.
"""

from __future__ import annotations

from math import pi

from ..deck import MachineCard, Ref
from .base import Card, Default, Required, Spec
from .kinematics import add, cross, dot, scale

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .base import PointView, Powers, Resistances, Scalar, Scene
    from .kinematics import Vector


class Mode(Card):
    spec = Spec(
        "MODE",
        "MODE name body f= [m=1] [zeta= [noisy=yes]] p=(px,py[,pz]) h=hz/(hx,hy,hz) [ic=(q[,u])]",
        terminals="at:point",
        mark=("f",),
        meaning="a mode of vibration of a body, by its frequency; FLANGE is a place that moves with it",
        laws={"T": "m u^2/2 + u (p.v + h.w) + ..", "V": "m (2 pi f)^2 q^2/2", "P": "2 zeta m (2 pi f) u^2"},
        f=Required("Hz", "its frequency while the body's frame stands still", above=0.0),
        m=Default(1.0, "kg", "modal mass", above=0.0),
        zeta=Default(0.0, "", "damping ratio", least=0.0),
        noisy=Default(False, "", "its thermal noise counts in .noise", "flag"),
        p=Required("kg", "integral of the shape over the mass, body axes", "vector"),
        h=Required(
            "kg m", "integral of x cross the shape over the mass: about z, or three components", "vector"
        ),
        ic=Default(None, "m", "coordinate and speed at the start", "vector"),
    )
    f: float
    m: float
    zeta: float
    noisy: bool
    at: PointView
    p: tuple[float, ...]
    h: tuple[float, ...]
    ic: tuple[float, ...] | None

    @classmethod
    def stands_for(cls, raw: MachineCard) -> list[MachineCard]:
        """A slide between the ground and a body without mass: its coordinate is that of the mode."""
        part = f"{raw.name}.x"
        params: dict[str, Any] = {"axis": (1.0, 0.0)}
        if "ic" in raw.params:
            params["ic"] = raw.params["ic"]
        words = [Ref(word, None, raw.span) for word in ("0", part, "slide")]
        return [
            MachineCard("BODY", part, [], {"m": 0.0, "j": (0.0, 0.0, 0.0)}, None, raw.span, {}),
            MachineCard("JOINT", f"{raw.name}.q", words, params, None, raw.span, raw.param_spans),
        ]

    def check(self, sink: Sink) -> None:
        for key, sizes in (("p", (2, 3)), ("h", (1, 3))):
            if len(getattr(self, key)) not in sizes:
                said = f"{key}= of MODE {self.name} has {sizes[0]} or {sizes[1]} components"
                sink.error(
                    "E232", said, self.place(key), "0 where the shape moves the body's frame by nothing"
                )
        self.push = [*self.p, 0.0][:3]
        self.turn = [*self.h] if len(self.h) == 3 else [0.0, 0.0, *self.h][:3]

    def leaves_plane(self) -> bool:
        return bool(self.push[2]) or any(self.turn[:2])

    def prepare(self, s: Scene) -> None:
        self.frame = s.body_of(self, "at")
        self.rate = 2.0 * pi * self.f
        self.joint = s.joint(f"{self.name}.q")
        self.body = s.bodies.get(self.frame.name)
        if self.frame.name != self._on or self.terminals[0][2].point is not None:
            said = f"MODE {self.name} is one of a body, without a place: p= and h= are about its origin"
            s.sink.error("E240", said, self.span, f"MODE {self.name} {self.frame.name} ..")
        modes = [
            c for c in s.couplings.values() if isinstance(c, Mode) and c.terminals[0][2].name == self._on
        ]
        self.group = modes if modes[0] is self else []  # the first speaks for all of its body
        if self.group and self.body is not None and not self.body.fixed and not self._is_possible(self.body):
            said = f"the modes of {self._on} take more mass with them than it has: p= and h= do not fit its m= and j="
            hint = "the mass that takes part in a mode along an axis is p^2/m=, its sum over all modes at most the body's"
            s.sink.error("E238", said, self.place("p"), hint)

    @property
    def _on(self) -> str:
        return self.terminals[0][2].name

    def _is_possible(self, body: Any) -> bool:
        """Is the mass matrix of the body's frame and its modes without a negative pivot? About the body's origin."""
        (x, y, z), (a, b, c, d, e, f), m = body.centre, body.inertia, float(body.m)
        arm = [[0.0, m * z, -m * y], [-m * z, 0.0, m * x], [m * y, -m * x, 0.0]]
        turn = [
            [a + m * (y * y + z * z), d - m * x * y, e - m * x * z],
            [d - m * x * y, b + m * (x * x + z * z), f - m * y * z],
            [e - m * x * z, f - m * y * z, c + m * (x * x + y * y)],
        ]
        rows = [[m * (i == k) for k in range(3)] + arm[i] for i in range(3)]
        rows += [[arm[k][i] for k in range(3)] + turn[i] for i in range(3)]
        flows = [[float(v) for v in (*one.push, *one.turn)] for one in self.group]
        rows = [row + [flow[i] for flow in flows] for i, row in enumerate(rows)]
        for k, (one, flow) in enumerate(zip(self.group, flows, strict=True)):
            rows.append([*flow, *(float(one.m) * (k == j) for j in range(len(flows)))])
        least = 1e-9 * max(abs(float(v)) for row in rows for v in row)
        for k, row in enumerate(rows):
            if abs(row[k]) <= least:
                if any(abs(v) > least for v in row[k:]):
                    return False
                continue
            if row[k] < 0.0:
                return False
            for below in rows[k + 1 :]:
                share = below[k] / row[k]
                below[:] = [v - share * w for v, w in zip(below, row, strict=True)]
        return True

    def kinetic(self, s: Scene) -> Scalar | None:
        total = s.b.const(0.0)
        w, body = self.frame.omega, self.body
        still = body is None or body.fixed
        pushed: Vector = [0.0, 0.0, 0.0]
        swung: Vector = [0.0, 0.0, 0.0]
        for one in self.group:
            u, way = one.joint.u, self.frame.direction(one.push)
            total = total + 0.5 * one.m * u * u
            if not still:
                total = total + u * (dot(one.at.vel, way) + dot(w, self.frame.direction(one.turn)))
                pushed, swung = add(pushed, scale(u, way)), add(swung, scale(one.joint.q, cross(w, way)))
        if self.group and body is not None and not body.fixed and body.m:
            centre = self.frame.point(body.centre).vel
            total = total + dot(centre, swung) + (0.5 * dot(swung, swung) + dot(pushed, swung)) / body.m
        return total

    def potential(self, s: Scene) -> Scalar | None:
        q, way = self.joint.q, self.frame.direction(self.push)
        return 0.5 * self.m * self.rate * self.rate * q * q - q * dot(s.gravity, way)

    def _damped(self) -> Resistances:
        return [("", 2.0 * self.zeta * self.m * self.rate, self.joint.u)] if self.zeta else []

    def powers(self, s: Scene) -> Powers:
        return [(-r * u, u) for _, r, u in self._damped()]

    def losses(self, s: Scene) -> Scalar | None:
        return sum((r * u * u for _, r, u in self._damped()), s.b.const(0.0)) if self.zeta else None

    def thermal(self, s: Scene) -> Resistances:
        return self._damped() if self.noisy else []
