"""GEAR: q(j1) = ratio * q(j2). `lead=` couples a slide and a pin: q(slide) = lead * q(pin) / (2 pi).

Where one of the joints supplies a coordinate, that coordinate is replaced and no equation is added;
otherwise the relation is a constraint row. `torque(gear)` is what the gear applies on j1.
"""

from __future__ import annotations

from math import pi

from .base import Card, Default, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Probes, Scene


class Gear(Card):
    spec = Spec(
        "GEAR",
        "GEAR name j1 j2 ratio= (or lead=)",
        terminals="first:joint second:joint",
        mark=("ratio", "lead"),
        missing={"backlash": "free play", "k": "stiffness of the teeth"},
        meaning="a gear, belt or screw between the coordinates of two joints",
        laws={"q": "q1 = ratio q2, of angle and travel q = lead/(2 pi) angle"},
        ratio=Default(None, "", "q(j1) / q(j2)"),
        lead=Default(None, "m", "travel of the slide for one turn of the pin"),
    )
    ratio: float | None
    lead: float | None
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
        names = [ref.name for _, _, ref in self.terminals]
        if len(set(names)) == 1:
            sink.error("E237", f"GEAR {self.name} couples {names[0]} to itself", self.span, "name two joints")

    def probes(self, s: Scene) -> Probes:
        return {"torque" if self.first.rotary else "force": lambda: s.reaction(self.name)}

    def glyph(self, draw: Pen) -> None:
        ratio = self.ratio if self.ratio is not None else self.lead
        draw.add(
            "gear", self, first=draw.joint(self.first.name), second=draw.joint(self.second.name), ratio=ratio
        )

    def analogue(self, net: Net) -> None:
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
