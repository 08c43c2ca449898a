"""MOTOR of type dcwound: a direct-current machine whose field is a winding of its own.

    W' = (la + ls) ia^2/2 + lf if^2/2        the brushes are a gyrator: G = laf if + lafs ia
    (la + ls) dia + (ra + rs) ia + G w = va,    lf dif + rf if = vf,    torque = G ia
Armature from a to b, field from f to g. Separately excited: f and g on a source of their own; shunt: on a and b; series,
and universal where the source alternates: g on a, so that one current flows through both. ls rs lafs are a series field in the
armature's circuit: compound.
"""

from __future__ import annotations

from ..base import Default, Spec
from .base import SHAFT, Phase, Windings

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Expr
    from ..base import Scalar, Scene


class Wound(Windings):
    of_type = "dcwound"
    needs = ("laf",)
    spec = Spec(
        "MOTOR",
        "MOTOR name a b f g joint model=m   with .model m dcwound laf= [ra=] [la=] [rf=] [lf=] [j=] ..",
        terminals="a:node b_:node f:node g:node joint:joint",
        mark=("model",),
        meaning="a direct-current machine with a field winding: separately excited, shunt, series, universal",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u",
            "W": "(la + ls) ia^2/2 + lf if^2/2",
            "P": "(ra + rs) ia^2 + rf if^2 + b w^2 + tc |w|",
            "i": "la dia/dt + ra ia + laf if w = va, lf dif/dt + rf if = vf, torque laf if ia",
        },
        ra=Default(0.0, "Ohm", "resistance of the armature", least=0.0),
        la=Default(0.0, "H", "inductance of the armature", least=0.0),
        rf=Default(0.0, "Ohm", "resistance of the field", least=0.0),
        lf=Default(0.0, "H", "inductance of the field", least=0.0),
        laf=Default(None, "H", "armature volts per field ampere and rad/s"),
        rs=Default(0.0, "Ohm", "resistance of a series field", least=0.0),
        ls=Default(0.0, "H", "inductance of a series field", least=0.0),
        lafs=Default(0.0, "H", "armature volts per armature ampere and rad/s, by the series field"),
        **SHAFT,
    )
    ra: float
    la: float
    rf: float
    lf: float
    laf: float
    rs: float
    ls: float
    lafs: float
    a: int
    b_: int
    f: int
    g: int

    def phases(self) -> list[Phase]:
        armature = Phase(self.a, self.b_, self.ra + self.rs, (1, 0))
        return [armature, Phase(self.f, self.g, self.rf, (0, 1))]

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        return (0.5 * (self.la + self.ls)) * i[0] * i[0] + (0.5 * self.lf) * i[1] * i[1]

    def gyrators(self, s: Scene, i: list[Expr], flux: list[Expr]) -> list[Scalar]:
        field = self.laf * i[1]
        return [field + self.lafs * i[0] if self.lafs else field]
