"""MOTOR of type induction: a three-phase asynchronous machine with a short-circuited rotor.

    W' = 1.5 (lss |i_s|^2/2 + lsr |i_r|^2/2 + lm |i_s + i_r|^2/2) + 1.5 l0 i0^2          ls = lm + lss, lr = lm + lsr
    d psi_s = v - rs i_s,      d psi_r = -rr i_r + j p w psi_r,       psi_s = ls i_s + lm i_r,   psi_r = lm i_s + lr i_r
    torque = 1.5 p Im(psi_s* i_s)
i_s, i_r: space vectors, as long as the amplitude of a phase, in axes of the stator; the rotor's windings turn against these: that
is a gyrator and takes no energy. At constant speed and frequency w_s = 2 pi f the torque has its largest value at a slip
s_k = rr'/x_k, and T = 2 T_k/(s/s_k + s_k/s) where rs is 0 (M. Kloss, Archiv fuer Elektrotechnik 5 (1916) 59).
With isat= what both have in common saturates: lm (i_s + i_r)/S in place of lm (i_s + i_r), S^2 = 1 + |i_s + i_r|^2/isat^2.
All of the rotor is referred to the stator. Phases in a star; i0 flows where its point is wired as a fourth node.
"""

from __future__ import annotations

from ..base import Default, Spec
from ..domains.iron import saturates
from .base import SHAFT, Phase, Windings, clarke, star
from .pmsm import zero_sequence

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Expr
    from ..base import Scalar, Scene


class Induction(Windings):
    of_type = "induction"
    needs = ("p", "rr", "lm", "lss", "lsr")
    spec = Spec(
        "MOTOR",
        "MOTOR name a b c [n] joint model=m   with .model m induction p= rs= rr= lm= lss= lsr= [l0=] [j=] ..",
        terminals="na:node nb:node nc:node joint:joint | na:node nb:node nc:node nn:node joint:joint",
        mark=("model",),
        meaning="a three-phase induction machine with a short-circuited rotor",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u",
            "W": "1.5 (lss |is|^2/2 + lsr |ir|^2/2 + lm |is + ir|^2/2)",
            "P": "1.5 (rs |is|^2 + rr |ir|^2) + b w^2 + tc |w|",
            "i": "dpsi_s/dt + rs is = v, dpsi_r/dt + rr ir = j p w psi_r, torque 1.5 p Im(psi_s* is)",
        },
        p=Default(None, "", "pairs of poles", above=0.0),
        rs=Default(0.0, "Ohm", "resistance of a phase of the stator", least=0.0),
        rr=Default(None, "Ohm", "resistance of the rotor, referred to the stator", least=0.0),
        lm=Default(None, "H", "main inductance: what stator and rotor have in common", above=0.0),
        lss=Default(None, "H", "leakage inductance of the stator", above=0.0),
        lsr=Default(None, "H", "leakage inductance of the rotor, referred to the stator", above=0.0),
        isat=Default(None, "A", "magnetising current at which lm has fallen to 0.71 of itself: iron saturates", above=0.0),
        l0=Default(None, "H", "inductance to currents that flow through the star point; lss unless given", least=0.0),
        **SHAFT,
    )  # fmt: skip
    p: float
    rs: float
    rr: float
    lm: float
    lss: float
    lsr: float
    isat: float | None
    l0: float | None
    na: int
    nb: int
    nc: int
    nn: int | None = None

    def phases(self) -> list[Phase]:
        """Those of the stator, then the rotor's two axes."""
        stator = star(self.na, self.nb, self.nc, self.nn, self.rs)
        for part in stator:
            part.shares = (*part.shares, 0, 0)
        count = len(stator[0].shares) - 2
        none = (0,) * count
        return [*stator, *(Phase(-1, -1, 1.5 * self.rr, (*none, *axis)) for axis in ((1, 0), (0, 1)))]

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        alpha, beta = clarke(phases[:3])
        x, y = i[-2:]
        both = (alpha + x, beta + y)
        energy = (0.75 * self.lss) * (alpha * alpha + beta * beta) + (0.75 * self.lsr) * (x * x + y * y)
        energy = energy + (1.5 * self.lm) * saturates(s, both[0] * both[0] + both[1] * both[1], self.isat)
        if len(i) == 4:
            return energy
        return energy + zero_sequence(self.lss if self.l0 is None else self.l0, phases[:3])

    def gyrators(self, s: Scene, i: list[Expr], flux: list[Expr]) -> list[Scalar]:
        none: list[Scalar] = [0.0] * (len(i) - 2)
        return [*none, self.p * flux[-1], -self.p * flux[-2]]
