"""MOTOR of type pmsm: a synchronous machine with magnets on its rotor, surface or interior ones.

    W' = 1.5 (ld id^2/2 + lq iq^2/2 + psi id) + 1.5 l0 i0^2
    id = 2/3 sum i_k cos(p th - k 120 deg),  iq = -2/3 sum i_k sin(p th - k 120 deg),  i0 = sum i_k/3
from which Park's equations follow, w the rotor's speed and p its pairs of poles:
    vd = rs id + ld did - p w lq iq,   vq = rs iq + lq diq + p w (ld id + psi),   torque = 1.5 p (psi iq + (ld - lq) id iq)
With isat= iron saturates by both currents: ld id^2/2 + lq iq^2/2 becomes ld isat^2 (S - 1), S^2 = 1 + (id^2 + lq/ld iq^2)/isat^2:
    psi_d = psi + ld id/S,   psi_q = lq iq/S,   torque = 1.5 p (psi_d iq - psi_q id)
d is where the magnets point; at joint coordinate 0 that is the axis of phase a. Phases a, b, c in a star; i0 flows where its
point is wired as a fourth node. psi is the flux linkage of a phase, its amplitude: its voltage without current is psi p w.
"""

from __future__ import annotations

from math import pi, sqrt

from ..base import Default, Spec
from ..domains.iron import saturates
from ..domains.warmth import MAGNETS
from .base import SHAFT, Phase, Windings, clarke, star

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Expr
    from ..base import Probes, Scene

PER_KRPM = 1000.0 * 2.0 * pi / 60.0  # [rad/s]


class Pmsm(Windings):
    of_type = "pmsm"
    needs = ("p", "ld", "psi")
    spec = Spec(
        "MOTOR",
        "MOTOR name a b c [n] joint model=m   with .model m pmsm p= ld= [lq=] psi= (or ke=) [rs=] [l0=] [j=] ..",
        terminals="na:node nb:node nc:node joint:joint | na:node nb:node nc:node nn:node joint:joint",
        mark=("model",),
        meaning="a three-phase synchronous machine with permanent magnets",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u",
            "W": "1.5 (ld id^2/2 + lq iq^2/2 + psi id)",
            "P": "rs (ia^2 + ib^2 + ic^2) + b w^2 + tc |w|",
            "i": "torque 1.5 p (psi iq + (ld - lq) id iq)",
        },
        p=Default(None, "", "pairs of poles", above=0.0),
        rs=Default(0.0, "Ohm", "resistance of a phase", least=0.0),
        ld=Default(None, "H", "inductance along the magnets", above=0.0),
        lq=Default(None, "H", "inductance across them; ld unless given", above=0.0),
        psi=Default(None, "V s", "flux linkage of a phase by the magnets, amplitude"),
        ke=Default(None, "V", "in place of psi: volts rms from line to line at 1000 rpm"),
        isat=Default(None, "A", "current along the magnets at which ld has fallen to 0.71 of itself: iron saturates", above=0.0),
        l0=Default(None, "H", "inductance to currents that flow through the star point; ld unless given", least=0.0),
        **MAGNETS,
        **SHAFT,
    )  # fmt: skip
    p: float
    rs: float
    ld: float
    lq: float | None
    psi: float
    ke: float | None
    isat: float | None
    l0: float | None
    na: int
    nb: int
    nc: int
    nn: int | None = None

    def _read_model(self, s: Scene) -> None:
        if self.model is not None:
            self._from_model(s)
        self.either(s, "psi", "ke", "each says how strong the magnets are")
        if self.ke is not None and self.p is not None:
            self.psi = self.ke * sqrt(2.0 / 3.0) / (PER_KRPM * self.p)
        self._ask(s)

    def phases(self) -> list[Phase]:
        return star(self.na, self.nb, self.nc, self.nn, self.rs)

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        self.id, self.iq = self._park(s, phases, th)
        lq = self.ld if self.lq is None else self.lq
        if lq == self.ld:
            alpha, beta = clarke(phases)
            square = alpha * alpha + beta * beta
        else:
            square = self.id * self.id + (lq / self.ld) * self.iq * self.iq
        energy = 1.5 * (self.ld * saturates(s, square, self.isat) + self.psi * self.id)
        return (
            energy if len(i) == 2 else energy + zero_sequence(self.ld if self.l0 is None else self.l0, phases)
        )

    def _park(self, s: Scene, phases: list[Expr], th: Expr) -> tuple[Expr, Expr]:
        alpha, beta = clarke(phases)
        c, d = s.b.call("cos", self.p * th), s.b.call("sin", self.p * th)
        return alpha * c + beta * d, beta * c - alpha * d

    def probes(self, s: Scene) -> Probes:
        direct, across = self._park(s, self.currents, self.angle)
        return {**super().probes(s), "id": direct, "iq": across}


def zero_sequence(l0: float, phases: list[Expr]) -> Expr:
    """Co-energy of what flows through the star point."""
    i0 = (phases[0] + phases[1] + phases[2]) * (1.0 / 3.0)
    return (1.5 * l0) * i0 * i0
