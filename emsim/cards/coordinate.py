"""What SPRING and DAMPER share: a coordinate that is a joint's, or the distance of two points."""

from __future__ import annotations

from .along import drawn
from .base import Card

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import JointView, Pen, PointView, Scene


class OnJointOrPoints(Card):
    """A card whose coordinate is that of a joint, or the distance of two points."""

    acts_on = "one"
    joint: JointView | None = None
    p: PointView
    q: PointView

    def coordinate(self, s: Scene) -> tuple[Expr, Expr]:
        """(coordinate, speed)"""
        if self.joint is not None:
            return self.joint.q, self.joint.u
        return s.distance(self.p, self.q)

    def needs_direction(self) -> bool:
        """Does the force need the line from p to q? Then they must not coincide."""
        return self.joint is None

    def effort_name(self) -> str:
        return "torque" if self.joint is not None and self.joint.rotary else "force"

    def glyph_between(self, draw: Pen, kind: str) -> None:
        """A shape on the joint, or from point to point; with the force it applies."""
        word = self.effort_name()
        effort = self.probes(draw.m)[word]
        assert not callable(effort)
        unit = "N m" if word == "torque" else "N"
        carried = {"effort": draw.channel(f"{word}({self.name})", unit, effort), "unit": unit}
        if self.joint is not None:
            draw.add(kind, self, **drawn(draw, self.joint), **carried)
        else:
            draw.add(kind, self, p=draw.terminal(self, "p"), q_=draw.terminal(self, "q"), **carried)
