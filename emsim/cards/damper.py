"""DAMPER: viscous, on a joint or between two points. Force -c u - c2 |u| u along the coordinate."""

from __future__ import annotations

from .base import Default, Required, Spec
from .coordinate import OnJointOrPoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import Net, Pen, Powers, Probes, Resistances, Scalar, Scene


class Damper(OnJointOrPoints):
    spec = Spec(
        "DAMPER",
        "DAMPER name (joint or P Q) c= [c2=] [noisy=yes]",
        terminals="joint:joint | p:point q:point",
        mark=("c",),
        meaning="a viscous damper, with a quadratic part for fluids",
        meant={"": "c={}", "d": "c={}", "b": "c={}", "damp": "c={}"},
        laws={"P": "c u^2 + c2 |u| u^2"},
        c=Required("N s/m or N m s/rad", "damping", least=0.0),
        c2=Default(0.0, "N s^2/m^2 or N m s^2/rad^2", "quadratic damping", least=0.0),
        noisy=Default(False, "", "its thermal noise counts in .noise", "flag"),
    )
    c: float
    c2: float
    noisy: bool

    def _effort(self, s: Scene) -> tuple[Expr, Expr]:
        _, u = self.coordinate(s)
        effort = -self.c * u
        if self.c2:
            effort = effort - self.c2 * u * s.abs(u)
        return effort, u

    def powers(self, s: Scene) -> Powers:
        return [self._effort(s)]

    def probes(self, s: Scene) -> Probes:
        effort, u = self._effort(s)
        return {self.effort_name(): effort, "power": effort * u}

    def losses(self, s: Scene) -> Scalar | None:
        effort, u = self._effort(s)
        return -(effort * u)

    def thermal(self, s: Scene) -> Resistances:
        if not self.noisy:
            return []
        _, u = self.coordinate(s)
        return [("", self.c + 2.0 * self.c2 * s.abs(u) if self.c2 else self.c, u)]

    def glyph(self, draw: Pen) -> None:
        self.glyph_between(draw, "damper")

    def analogue(self, net: Net) -> None:
        """A resistor of 1/c."""
        if self.joint is None:
            return net.refuse(self, "lies between two points; put it on the joint")
        b, a = net.across(self.joint.name)
        n = self.name.replace(".", "_")
        if self.c:
            net.add(f"Rc_{n} {b} {a} {1.0 / self.c!r}", "damper")
        if self.c2:
            net.add(f"Bc_{n} {b} {a} i='{self.c2!r}*v({b},{a})*abs(v({b},{a}))'", "quadratic damper")
