"""ROLL: a wheel, disc or ball that rolls without slip on a line or plane, or on another round part. Where they meet: round.py.

    gap = 0                 as closed loops are held; left out where joints keep it. `force` presses the parts on each other
    slip(q) . u = 0         a row of speeds, two in space; its multiplier is `friction`, the force on P's part, which does no work
In the plane friction points along t = n x z, to the right on a floor, as that of CONTACT; in space `friction` is its size, and
friction(roll,1), friction(roll,2) the parts along two directions at right angles. Nothing limits either force: ROLL neither lifts
off nor slips, CONTACT with mu= does both.
"""

from __future__ import annotations

from math import isclose

from .base import Spec
from .kinematics import constant
from .round import SHAPE, Round

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Pen, Probes, Scalar, Scene


class Roll(Round):
    spec = Spec(
        "ROLL",
        "ROLL name P Q r= line=(nx,ny) (or rq=) [axis=]",
        terminals="p:point q:point",
        mark=("line", "rq"),
        meaning="a wheel, disc or ball that rolls without slip on a line, a plane or another round part",
        laws={"q": "gap = 0, and the slip where the parts touch is 0"},
        **SHAPE,
    )

    def check(self, sink: Sink) -> None:
        super().check(sink)
        if self.r == 0.0:
            said = f"ROLL {self.name} has no radius r=: what rolls is round"
            sink.error(
                "E230", said, self.span, "a point that neither slides nor lifts off is a JOINT pin or ball"
            )

    def prepare(self, s: Scene) -> None:
        gap = self.meet(s)
        fixed = constant(gap)
        self.gap = gap if fixed is None else None
        if fixed is not None and not isclose(fixed + self.r, self.r):
            said = (
                f"the parts of ROLL {self.name} do not touch: {fixed:.6g} m are between them whatever moves"
            )
            s.sink.error("E242", said, self.span, "check r=, the places of P and Q and the normal line=")
        self.slips = self.slipping(s)
        if not self.slips:
            said = f"ROLL {self.name} has no effect: its parts cannot slide along each other"
            s.sink.note("N233", said, self.span)

    def constraints(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return [] if self.gap is None else [("gap", self.gap, "N")]

    def velocities(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return [("slip", slip, "N") for slip in self.slips]

    def probes(self, s: Scene) -> Probes:
        first = int(self.gap is not None)
        found: Probes = {} if self.gap is None else {"force": lambda: s.reaction(self.name)}
        for k in range(len(self.slips)):
            found[f"friction,{k + 1}"] = lambda k=k: s.reaction(self.name, first + k)  # type: ignore[misc]
        if len(self.slips) == 1:
            found["friction"] = lambda: s.reaction(self.name, first)
        elif self.slips:
            found["friction"] = lambda: s.b.call("hypot", *(s.reaction(self.name, first + k) for k in (0, 1)))
        return found

    def glyph(self, draw: Pen) -> None:
        self.sketch(draw)
