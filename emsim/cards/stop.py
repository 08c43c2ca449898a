"""STOP: ends of a joint's travel, at min= and max= of its coordinate.

Gaps q - min and max - q; what happens where one closes stands in touch.py. `force` (`torque` on a pin) is on the
coordinate: the lower end pushes up it. `mode` is -1 at the lower end, 1 at the upper one.
"""

from __future__ import annotations

from . import touch
from .along import drawn
from .base import Card, Default, Spec
from .touch import Touching

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import JointView, Pen, Probes, Scalar, Scene


class Stop(Touching, Card):
    spec = Spec(
        "STOP",
        "STOP name joint [min=] [max=] [e=0]   or with k= [c= or e=] [n=1]",
        terminals="joint:joint",
        mark=("min", "max"),
        meaning="ends of a joint's travel",
        meant={
            "lo": "min={}",
            "low": "min={}",
            "lower": "min={}",
            "hi": "max={}",
            "high": "max={}",
            "upper": "max={}",
        },
        laws={
            "q": "min <= q <= max; after an impact e times the speed before it",
            "V": "with k=: k d^(n+1)/(n+1), d how far beyond an end",
            "P": "c d'^2, or that which gives back e times the speed",
        },
        min=Default(None, "m or rad", "lower end"),
        max=Default(None, "m or rad", "upper end"),
        **touch.LAW,
    )
    min: float | None
    max: float | None
    k: float | None
    c: float
    e: float | None
    n: float
    joint: JointView
    acts_on = "one"

    def check(self, sink: Sink) -> None:
        what = f"STOP {self.name}"
        if self.min is None and self.max is None:
            sink.error("E230", f"{what} needs min= or max=", self.span, self.spec.form)
        elif self.min is not None and self.max is not None and self.min >= self.max:
            said = f"min= of {what} is {self.min:g} and max= {self.max:g}: nothing is left between them"
            sink.error("E238", said, self.place("max"), "min= is the lower end of the coordinate")
        touch.check(self, self.k, self.c, self.e, sink)

    def prepare(self, s: Scene) -> None:
        q = self.joint.q
        ends = [(1.0, "min", self.min), (-1.0, "max", self.max)]
        gaps: list[tuple[float, str, Scalar]] = [
            (sign, f"{self.name} {end}", sign * (q - at)) for sign, end, at in ends if at is not None
        ]
        self.set_gaps(s, gaps, "N m" if self.joint.rotary else "N")

    def probes(self, s: Scene) -> Probes:
        found = self.touch_probes(s, "torque" if self.joint.rotary else "force")
        found["mode"] = -found["mode"]  # type: ignore[operator]
        return found

    def glyph(self, draw: Pen) -> None:
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        effort = self.probes(draw.m)[word]
        assert not callable(effort)
        draw.add(
            "stop", self, **drawn(draw, self.joint), ends=[self.min, self.max], unit=unit,
            effort=draw.channel(f"{word}({self.name})", unit, effort),
        )  # fmt: skip
