"""CONTACT: a point or a round part against a line, which bounds a half-plane, or another round part.

Where they meet stands in round.py, what happens there in touch.py. `force` is what the parts press on each other with. With mu=
they rub: `slip` is the speed of P's part along Q's where they touch, `friction` the force on P's part, along t = n x z: to the
right on a floor. Where they can slide in two directions both are lengths of vectors.
"""

from __future__ import annotations

from . import touch
from .base import Spec
from .round import SHAPE, Round
from .touch import Touching

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Pen, Probes, Scene


class Contact(Touching, Round):
    spec = Spec(
        "CONTACT",
        "CONTACT name P Q line=(nx,ny) (or rq=) [r= [axis=]] [e=0]   or with k= [c= or e=] [n=1]   [mu= [mus=]]",
        terminals="p:point q:point",
        mark=("k", "e", "line", "rq"),
        meaning="contact of a point or round part with a line or another round part",
        laws={
            "q": "gap >= 0; after an impact e times the speed before it",
            "V": "with k=: k d^(n+1)/(n+1), d how deep they are in each other",
            "P": "c d'^2, or that which gives back e times the speed; mu N |slip|",
        },
        **SHAPE,
        **touch.LAW,
        **touch.FRICTION,
    )
    k: float | None
    c: float
    e: float | None
    n: float
    mu: float
    mus: float | None

    def check(self, sink: Sink) -> None:
        super().check(sink)
        touch.check(self, self.k, self.c, self.e, sink)
        if self.mus is not None and self.mus < self.mu:
            said = f"mus= of {self.spec.word} {self.name} is {self.mus:g}, less than mu= {self.mu:g}: "
            said += "what slides would be held more than what rests"
            sink.error(
                "E238", said, self.place("mus"), "mus= is for parts that stick to each other, the larger one"
            )

    def prepare(self, s: Scene) -> None:
        self.set_gaps(s, [(1.0, self.name, s.b.const(0.0) + self.meet(s))], "N")
        if not (self.mu or self.mus):
            return
        if slips := self.slipping(s):
            self.set_slip(slips, self.mu, self.mus)
        else:
            said = f"mu= of CONTACT {self.name} has no effect: its parts cannot slide along each other"
            s.sink.note("N233", said, self.place("mu"))

    def probes(self, s: Scene) -> Probes:
        return self.touch_probes(s, "force")

    def glyph(self, draw: Pen) -> None:
        found = self.probes(draw.m)
        effort, mode = found["force"], found["mode"] if self.slips else 0.0
        assert not callable(effort) and not callable(mode)
        channels = (
            draw.channel(f"force({self.name})", "N", effort),
            draw.channel(f"mode({self.name})", "", mode),
        )
        self.sketch(draw, *channels)
