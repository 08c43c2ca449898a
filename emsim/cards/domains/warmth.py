"""Machines that their losses warm. With heat= what winding, bearing and brushes lose goes into a node of heat; resistances and,
of magnets, what they link follow its temperature T. Slowly: dT/dt induces nothing.

    r (1 + tc1 (T - tref))      magnets' flux (1 + tcm (T - tref)), in the torque and the back-EMF alike
"""

from __future__ import annotations

from ..base import Card, Default
from . import DOMAINS, level

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..base import Scalar, Scene

WARM: dict[str, Any] = {
    "heat": Default(None, "", "node of heat that its losses warm; what is tc1= and tcm= follows its temperature", "heat"),
    "tc1": Default(0.0, "1/K", "by how much a part of itself the resistance rises, copper 3.93m"),
    "tref": Default(None, "K", "temperature that the numbers are for; .options tnom", above=0.0),
}  # fmt: skip
# of those with magnets
MAGNETS: dict[str, Any] = {
    "tcm": Default(0.0, "1/K", "by how much a part of itself the magnets' flux rises, below 0: NdFeB -1.1m, ferrite -2m"),
    "magnets": Default(None, "", "node of heat that is as warm as the magnets; heat= unless given", "heat"),
}  # fmt: skip


class Warm(Card):
    heat: str | None
    tc1: float
    tref: float | None
    tcm = 0.0
    magnets: str | None = None

    def warm_up(self, s: Scene) -> None:
        """What follows the temperature of its nodes: factors of resistances and magnets, 1 where there is none."""
        self.warmth = -1
        self.hot: Scalar = 1.0
        self.weak: Scalar = 1.0
        reference = s.domains.nominal if self.tref is None else self.tref
        if self.heat is not None:
            self.warmth = s.domains.named("heat", self.heat, self.place("heat"))
            s.domains.warm(self.name, self, self.place("heat"))
        for key, node, word in (("tc1", self.heat, "hot"), ("tcm", self.magnets or self.heat, "weak")):
            coefficient = getattr(self, key)
            if not coefficient:
                continue
            if node is None:
                said = (
                    f"{key}= of MOTOR {self.name} is by temperature, and no node of heat says how warm it is"
                )
                s.sink.error(
                    "E230", said, self.place(key), "heat=node, and HEAT cards that lead its heat away"
                )
                continue
            row = s.domains.named("heat", node, self.place("heat" if node == self.heat else "magnets"))
            setattr(self, word, 1.0 + coefficient * (level(s, DOMAINS["heat"], row) - reference))

    def give_heat(self, s: Scene) -> None:
        """Into the node of heat."""
        if self.warmth >= 0:
            s.add_f(self.warmth, -s.domains.heat_of(self.name))
