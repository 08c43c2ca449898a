"""FREEWHEEL: a joint that turns one way. 0 <= dir u, 0 <= effort, one of them is 0: it runs freely forwards and holds against
what would turn it back. The ideal diode of a machine."""

from __future__ import annotations

from .base import Card, Default, Spec
from .laws import OneWay

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Probes, Scalar, Scene
    from .laws import Law


class Freewheel(Card):
    spec = Spec(
        "FREEWHEEL",
        "FREEWHEEL name joint dir=1 (or -1)",
        terminals="joint:joint",
        mark=("dir",),
        meaning="a joint that turns one way: a ratchet, a sprag clutch",
        meant={"": "dir={}"},
        laws={"q": "dir u >= 0"},
        dir=Default(1.0, "", "1 where the coordinate may grow, -1 where it may fall"),
    )
    dir: float
    joint: JointView

    def check(self, sink: Sink) -> None:
        if self.dir not in (1.0, -1.0):
            said = f"dir= of FREEWHEEL {self.name} is {self.dir:g}; it is 1 or -1"
            sink.error(
                "E238", said, self.place("dir"), "1 where the coordinate may grow, -1 where it may fall"
            )

    def prepare(self, s: Scene) -> None:
        self.law = OneWay(self.dir * self.joint.u, "N m" if self.joint.rotary else "N")

    def laws(self, s: Scene) -> list[Law]:
        return [self.law]

    def taken(self, s: Scene) -> Scalar:
        """Kinetic energy that impacts have taken so far [J]."""
        return self.law.lost

    def _word(self) -> tuple[str, str]:
        return ("torque", "N m") if self.joint.rotary else ("force", "N")

    def probes(self, s: Scene) -> Probes:
        return {
            self._word()[0]: self.dir * self.law.effort,
            "mode": self.law.closed,
            "slip": self.joint.u,
            "hits": self.law.hits,
            "impulse": self.dir * self.law.impulse,
        }

    def glyph(self, draw: Pen) -> None:
        word, unit = self._word()
        effort = draw.channel(f"{word}({self.name})", unit, self.dir * self.law.effort)
        draw.add("friction", self, **draw.joint(self.joint.name), effort=effort, unit=unit)

    def analogue(self, net: Net) -> None:
        net.refuse(self, "has modes; an ideal diode is its counterpart")
