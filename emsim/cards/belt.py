"""BELT: two elastic strands between two pulleys; neither can push.

    s = r1 q1 - r2 q2 (crossed: + r2 q2) is how far the first strand is longer than at q = 0, the second one shorter
    tension of a strand   F = max(0, f0 +- k s),  and +- c s' while it is taut, never below 0
    V = F^2/(2 k) of each,  torque on j1: -r1 (F1 - F2), on j2: +-r2 (F1 - F2)
With f0= both are taut until the load exceeds what was put in: up to there the belt is a spring of 2 k.
"""

from __future__ import annotations

from .base import Card, Default, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import JointView, Pen, Powers, Probes, Resistances, Scalar, Scene


class Belt(Card):
    spec = Spec(
        "BELT",
        "BELT name j1 j2 r1= r2= k= [c=] [f0=] [cross=yes]",
        terminals="first:joint second:joint",
        mark=("r1",),
        meaning="an elastic belt between two pulleys; without elasticity it is a GEAR",
        laws={
            "V": "F^2/(2 k) of each strand, F = max(0, f0 +- k (r1 q1 - r2 q2))",
            "P": "c s'^2 of each strand that is taut",
        },
        r1=Required("m", "radius of the pulley on the first joint", above=0.0),
        r2=Required("m", "radius of the pulley on the second joint", above=0.0),
        k=Required("N/m", "stiffness of a strand", above=0.0),
        c=Default(0.0, "N s/m", "damping of a strand while it is taut", least=0.0),
        f0=Default(0.0, "N", "tension of both strands at q = 0", least=0.0),
        cross=Default(False, "", "crossed: the pulleys turn against each other", "flag"),
    )
    r1: float
    r2: float
    k: float
    c: float
    f0: float
    cross: bool
    first: JointView
    second: JointView

    def check(self, sink: Sink) -> None:
        names = [ref.name for _, _, ref in self.terminals]
        if len(set(names)) == 1:
            sink.error("E237", f"BELT {self.name} runs from {names[0]} to itself", self.span, "name two pins")

    def prepare(self, s: Scene) -> None:
        for joint in (self.first, self.second):
            if not joint.rotary:
                said = f"BELT {self.name} runs over pulleys on pins; {joint.name} is a slide"
                s.sink.error(
                    "E241", said, self.span, "a rack or a rope that pulls a slide is a GEAR with lead="
                )
        r2 = -self.r2 if self.cross else self.r2
        apart = self.r1 * self.first.q - r2 * self.second.q
        self.rate = self.r1 * self.first.u - r2 * self.second.u
        self.strands: list[
            tuple[float, Expr, Expr]
        ] = []  # which way it is stretched, elastic part, damped part
        self.taut: list[Expr] = []
        for sign, name in ((1.0, "tight"), (-1.0, "slack")):
            pull = self.f0 + (sign * self.k) * apart
            taut = s.b.flag(s.public(pull), None, f"{self.name} {name}", -1, law="stays")
            self.taut.append(taut)
            elastic, damped = s.b.select(taut, pull, 0.0), s.b.const(0.0)
            if self.c:
                damped = s.b.select(taut, s.maximum((sign * self.c) * self.rate, -pull), 0.0)
            self.strands.append((sign, elastic, damped))

    def potential(self, s: Scene) -> Scalar | None:
        (_, one, _), (_, two, _) = self.strands
        return (one * one + two * two) * (0.5 / self.k)

    def powers(self, s: Scene) -> Powers:
        return [(-sign * damped, self.rate) for sign, _, damped in self.strands if damped.value != 0.0]

    def losses(self, s: Scene) -> Scalar | None:
        if not self.c:
            return None
        (_, _, one), (_, _, two) = self.strands
        return (one - two) * self.rate

    def thermal(self, s: Scene) -> Resistances:
        return (
            [(f"strand {k + 1}", self.c * taut, self.rate) for k, taut in enumerate(self.taut)]
            if self.c
            else []
        )

    def tension(self) -> list[Expr]:
        return [elastic + damped for _, elastic, damped in self.strands]

    def probes(self, s: Scene) -> Probes:
        """force: what the belt carries over, the difference of the strands' tensions, force(belt,1) and force(belt,2)."""
        one, two = self.tension()
        return {"force": one - two, "force,1": one, "force,2": two}

    def glyph(self, draw: Pen) -> None:
        one, two = self.tension()
        draw.add(
            "belt", self, first=draw.joint(self.first.name), second=draw.joint(self.second.name), radii=[self.r1, self.r2],
            cross=self.cross, unit="N", effort=draw.channel(f"force({self.name})", "N", one - two),
            tensions=[draw.channel(f"force({self.name},{k + 1})", "N", f) for k, f in enumerate((one, two))],
        )  # fmt: skip
