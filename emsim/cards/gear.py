"""GEAR: q(j1) = ratio * q(j2). `lead=` couples a slide and a pin: q(slide) = lead * q(pin) / (2 pi).

Where one of the joints supplies a coordinate, that coordinate is replaced and no equation is added;
otherwise the relation is a constraint row. `torque(gear)` is what the gear applies on j1.
eta= puts friction into the mesh, (1/eta - 1) times the load |lambda| that it carries, against the motion of j1: a law with modes
(laws.py), so it sticks. Where j1 drives, eta of its power arrives at j2; where j2 drives, 2 - 1/eta of it arrives at j1, and with
eta at 1/2 or below nothing does: the gear locks itself. A row then, whose multiplier is the load.
With backlash= both keep theirs, and the flanks touch at either end of the play (touch.py): gaps backlash/2 -+ d,
d = q(j1) - ratio q(j2).
"""

from __future__ import annotations

from math import pi

from ..opened import as_read
from . import touch
from .base import Card, Default, Spec
from .laws import Relay
from .touch import Touching

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Probes, Scalar, Scene
    from .laws import Law


class Gear(Touching, Card):
    spec = Spec(
        "GEAR",
        "GEAR name j1 j2 ratio= (or lead=) [eta=] [backlash= with e= or k= [c= or e=] [n=1]]",
        terminals="first:joint second:joint",
        mark=("ratio", "lead"),
        meaning="a gear, belt or screw between the coordinates of two joints",
        meant={"": "ratio={}", "n": "ratio={}", "i": "ratio={}", "gear": "ratio={}"},
        laws={
            "q": "q1 = ratio q2, of angle and travel q = lead/(2 pi) angle; with play |q1 - ratio q2| <= backlash/2",
            "V": "with k=: k d^(n+1)/(n+1), d how far beyond the play",
            "P": "with eta=: (1/eta - 1) |load u1|; with k=: c d'^2, or that which gives back e times the speed",
        },
        ratio=Default(None, "", "q(j1) / q(j2)"),
        lead=Default(None, "m", "travel of the slide for one turn of the pin"),
        eta=Default(
            None,
            "",
            "share of the power that arrives at j2 where j1 drives; 2 - 1/eta the other way, nothing from 1/2 down",
            above=0.0,
        ),
        backlash=Default(None, "rad or m", "play, measured at j1 from flank to flank", least=0.0),
        **touch.LAW,
    )
    beyond = "\nRATIO ties three joints and more: coef=(1,1,-2) of a differential"
    ratio: float | None
    lead: float | None
    eta: float | None
    backlash: float | None
    k: float | None
    c: float
    e: float | None
    n: float
    first: JointView
    second: JointView

    def check(self, sink: Sink) -> None:
        if (self.ratio is None) == (self.lead is None):
            sink.error("E230", f"GEAR {self.name} needs one of ratio= and lead=", self.span, self.spec.form)
        for key in ("ratio", "lead"):
            if getattr(self, key) == 0.0:
                sink.error(
                    "E238", f"{key}= of GEAR {self.name} cannot be 0", self.place(key), "DRIVE holds a joint"
                )
        touch.check(self, self.k, self.c, self.e, sink)
        given = next((key for key in ("k", "e") if self.given(key)), None)
        if self.backlash is None and given is not None:
            said = f"{given}= of GEAR {self.name} belongs to backlash=: without play the teeth are one"
            sink.error("E240", said, self.place(given), "give backlash=, or leave it out")
        elif self.backlash is not None and given is None:
            said = f"GEAR {self.name} with backlash= needs e= (rigid teeth) or k= (elastic ones): how the flanks meet"
            sink.error("E230", said, self.place("backlash"), self.spec.form)
        if self.eta is not None and self.eta > 1.0:
            said = f"eta= of GEAR {self.name} is {self.eta:g}: more would arrive than was put in"
            sink.error("E238", said, self.place("eta"), "a gear with 5 % of losses has eta=0.95")
        elif self.eta is not None and self.backlash is not None:
            said = f"GEAR {self.name} has both eta= and backlash="
            sink.error(
                "E240", said, self.place("eta"), "with play, a FRICTION on one of the joints takes its share"
            )
        names = [ref.name for _, _, ref in self.terminals]
        if len(set(names)) == 1:
            sink.error("E237", f"GEAR {self.name} couples {names[0]} to itself", self.span, "name two joints")

    def prepare(self, s: Scene) -> None:
        gaps: list[tuple[float, str, Scalar]] = []
        if self.backlash is not None:
            apart = self.first.q - self._factor(s) * self.second.q
            half = 0.5 * self.backlash
            gaps = [(1.0, f"{self.name} low", half + apart), (-1.0, f"{self.name} high", half - apart)]
        self.set_gaps(s, gaps, "N m" if self.first.rotary else "N")

    @property
    def rubs(self) -> bool:
        """Is the load of the mesh an unknown that friction depends on?"""
        return self.eta is not None and self.eta < 1.0

    def laws(self, s: Scene) -> list[Law]:
        if not self.rubs:
            return super().laws(s)
        assert self.eta is not None
        bound = (1.0 / self.eta - 1.0) * s.abs(s.reaction(self.name))
        self.mesh = Relay(self.first.u, bound, bound, "N m" if self.first.rotary else "N")
        return [self.mesh]

    def losses(self, s: Scene) -> Scalar | None:
        return -(self.mesh.effort * self.first.u) if self.rubs else super().losses(s)

    def _factor(self, s: Scene) -> float:
        """q(j1) / q(j2)"""
        if self.lead is None:
            assert self.ratio is not None
            return self.ratio
        if self.first.rotary == self.second.rotary:
            s.sink.error("E240", f"lead= of GEAR {self.name} couples a slide and a pin", self.place("lead"))
        per_radian = self.lead / (2.0 * pi)
        return 1.0 / per_radian if self.first.rotary else per_radian

    def probes(self, s: Scene) -> Probes:
        if self.backlash is not None:
            return self.touch_probes(s, "torque" if self.first.rotary else "force")
        word = "torque" if self.first.rotary else "force"
        if self.rubs:
            return {word: s.reaction(self.name) + self.mesh.effort, "mode": self.mesh.mode}
        return {word: lambda: s.reaction(self.name)}

    def glyph(self, draw: Pen) -> None:
        ratio = self.ratio if self.ratio is not None else as_read(self.lead)
        draw.add(
            "gear", self, first=draw.joint(self.first.name), second=draw.joint(self.second.name), ratio=ratio
        )

    def analogue(self, net: Net) -> None:
        if self.backlash is not None or self.rubs:
            return net.refuse(
                self, "has play" if self.backlash is not None else "rubs, and no element of a circuit does"
            )
        """An ideal transformer: u1 = factor u2, and the force carried over the other way."""
        b1, a1 = net.across(self.first.name)
        b2, a2 = net.across(self.second.name)
        factor = self.ratio
        if factor is None:
            assert self.lead is not None
            per_radian = self.lead / (2.0 * pi)
            factor = 1.0 / per_radian if self.first.rotary else per_radian
        n = self.name.replace(".", "_")
        # the smallest of resistances keeps gears that close a loop of transformers solvable
        net.add(f"Vs_{n} {b1} {n}_1 0", f"i(Vs_{n}) is what {self.first.name} gives")
        net.add(f"Eg_{n} {n}_1 {a1} {b2} {a2} {factor!r}", "transformer")
        net.add(f"Fg_{n} {b2} {a2} Vs_{n} {-factor!r}")
