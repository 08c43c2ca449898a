"""MOTOR of type stepper: a hybrid stepping motor, two phases, nr teeth on the rotor.

    W' = l (ia^2 + ib^2)/2 + km/nr (ia cos(nr th) + ib sin(nr th))        cogging V = -td/(4 nr) cos(4 nr th)
    l dia + r ia - km w sin(nr th) = va,     l dib + r ib + km w cos(nr th) = vb
    torque = km (ib cos(nr th) - ia sin(nr th)) - td sin(4 nr th)
With isat= iron saturates, in each phase by current and magnets together: W' = l isat^2 (S - 1) of both, S^2 = 1 + (x/isat)^2,
with xa = ia + im cos(nr th), xb = ib + im sin(nr th), im = km/(nr l): what is linear in x/isat is the above.
Current in a alone holds th = 0, in b alone th = 90 deg/nr, one full step further.
"""

from __future__ import annotations

from math import pi, sqrt

from ..base import Default, Spec
from ..domains.iron import saturates
from ..domains.warmth import MAGNETS
from .base import SHAFT, Phase, Windings

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Expr
    from ..base import Scalar, Scene


class Stepper(Windings):
    of_type = "stepper"
    needs = ("nr", "km", "l")
    spec = Spec(
        "MOTOR",
        "MOTOR name a+ a- b+ b- joint model=m   with .model m stepper l= r= nr= (or step=) km= (or hold= inom=) [td=] [j=] ..",
        terminals="ap:node am:node bp:node bm:node joint:joint",
        mark=("model",),
        meaning="a hybrid stepping motor with two phases",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u",
            "V": "-td/(4 nr) cos(4 nr th)",
            "W": "l (ia^2 + ib^2)/2 + km/nr (ia cos(nr th) + ib sin(nr th))",
            "P": "r (ia^2 + ib^2) + b w^2 + tc |w|",
            "i": "torque km (ib cos(nr th) - ia sin(nr th)) - td sin(4 nr th)",
        },
        nr=Default(None, "", "teeth of the rotor: 50 for 1.8 degrees a step", above=0.0),
        step=Default(None, "rad", "in place of nr: a full step, 1.8deg for instance", above=0.0),
        km=Default(None, "N m/A", "torque per ampere of one phase"),
        hold=Default(None, "N m", "in place of km: holding torque with inom in both phases, sqrt(2) km inom", above=0.0),
        inom=Default(None, "A", "nominal current of a phase, beside hold=", above=0.0),
        r=Default(0.0, "Ohm", "resistance of a phase", least=0.0),
        l=Default(None, "H", "inductance of a phase", above=0.0),
        isat=Default(None, "A", "current, km/(nr l) of the magnets included, at which a phase has 0.71 of its flux", above=0.0),
        td=Default(0.0, "N m", "detent torque, amplitude", least=0.0),
        **MAGNETS,
        **SHAFT,
    )  # fmt: skip
    nr: float
    step: float | None
    km: float
    hold: float | None
    inom: float | None
    r: float
    l: float  # noqa: E741
    isat: float | None
    td: float
    ap: int
    am: int
    bp: int
    bm: int

    def _read_model(self, s: Scene) -> None:
        if self.model is not None:
            self._from_model(s)
        self.either(s, "nr", "step", "a step is 90 degrees by nr")
        self.either(s, "km", "hold", "hold is sqrt(2) km inom")
        if self.step is not None:
            self.nr = 0.5 * pi / self.step
        if (self.hold is None) != (self.inom is None):
            said = f"MOTOR {self.name} has {'inom=' if self.hold is None else 'hold='} alone"
            s.sink.error("E230", said, self.span, "hold= is the torque at inom=: give both, or km=")
            self.km = 1.0
        elif self.hold is not None and self.inom is not None:
            self.km = self.hold / (sqrt(2.0) * self.inom)
        if self.isat is not None and self.tcm:
            said = f"MOTOR {self.name} has isat= and tcm=: its iron is saturated by magnets of one strength"
            s.sink.error("E231", said, self.span, "leave one of them out")
        self._ask(s)

    def phases(self) -> list[Phase]:
        return [Phase(self.ap, self.am, self.r, (1, 0)), Phase(self.bp, self.bm, self.r, (0, 1))]

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        c, d = s.b.call("cos", self.nr * th), s.b.call("sin", self.nr * th)
        if self.isat is None:
            return (0.5 * self.l) * (i[0] * i[0] + i[1] * i[1]) + (self.km / self.nr) * (i[0] * c + i[1] * d)
        magnets = self.km / (self.nr * self.l)  # as a current of the phase [A]
        one, other = i[0] + magnets * c, i[1] + magnets * d
        both = saturates(s, one * one, self.isat) + saturates(s, other * other, self.isat)
        return s.b.const(0.0) + self.l * both

    def cogging(self, s: Scene, th: Expr) -> Scalar | None:
        return (-self.td / (4.0 * self.nr)) * s.b.call("cos", (4.0 * self.nr) * th) if self.td else None
