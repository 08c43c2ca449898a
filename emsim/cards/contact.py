"""CONTACT: a point or a round part against a line, which bounds a half-plane, or another round part; or shapes (between.py).

Where they meet stands in round.py, what happens there in touch.py. `force` is what the parts press on each other with. With mu=
they rub: `slip` is the speed of P's part along Q's where they touch, `friction` the force on P's part, along t = n x z: to the
right on a floor. Where they can slide in two directions both are lengths of vectors. With rolling= and drilling= they also resist
turning over each other: `rolling` and `drilling` are those moments on P's part.
"""

from __future__ import annotations

from . import touch
from .base import Spec
from .between import Between
from .resisting import TURNING, Turning, of_round
from .round import SHAPE, Round

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import MachineCard, Model
    from ..diagnostics import Sink
    from .base import Card, Pen, Probes, Scene


class Contact(Turning, Round):
    spec = Spec(
        "CONTACT",
        "CONTACT name P Q line=(nx,ny) (or rq=) [r= [axis=]] [e=0]   or with k= [c= or e=] [n=1]   [mu= [mus=]] "
        "[rolling=] [drilling=]   or between shapes: CONTACT name A B (or: all) [e=] [mu= [mus=]] ..",
        terminals="p:point q:point",
        mark=("k", "e", "line", "rq", "mu", "rolling", "drilling"),
        meaning="contact of a point or round part with a line or another round part",
        laws={
            "q": "gap >= 0; after an impact e times the speed before it",
            "V": "with k=: k d^(n+1)/(n+1), d how deep they are in each other",
            "P": "c d'^2, or that which gives back e times the speed; mu N |slip|, rolling N |turning|",
        },
        **SHAPE,
        **touch.LAW,
        **touch.FRICTION,
        **TURNING,
    )
    k: float | None
    c: float
    e: float | None
    n: float
    mu: float
    mus: float | None

    @classmethod
    def variant(cls, raw: MachineCard, models: dict[str, Model]) -> type[Card]:
        """Names of bodies or of SHAPE, and nothing that says where the parts are round or straight: shapes."""
        plain = all(ref.point is None and "." not in ref.name for ref in raw.args)
        return Shapes if plain and not raw.params.keys() & SHAPE.keys() else cls

    def check(self, sink: Sink) -> None:
        super().check(sink)
        touch.check(self, self.k, self.c, self.e, sink)
        touch.check_friction(self, self.mu, self.mus, sink)

    def prepare(self, s: Scene) -> None:
        self.set_gaps(s, [(1.0, self.name, s.b.const(0.0) + self.meet(s))], "N")
        place = self.places[0][1]
        if self.mu or self.mus:
            self.set_slips(self.slipping(s), place, self.mu, self.mus)
        if self.rolling or self.drilling:
            self.set_turns(of_round(self, s), place)
        self.tell_idle(s, {"mu": self.slips, **self.turns})

    def probes(self, s: Scene) -> Probes:
        return {**self.touch_probes(s, "force"), **self.turn_probes(s)}

    def glyph(self, draw: Pen) -> None:
        found = self.probes(draw.m)
        effort, mode = found["force"], found["mode"] if self.slips else 0.0
        assert not callable(effort) and not callable(mode)
        presses = draw.channel(f"force({self.name})", "N", effort)
        self.sketch(draw, presses, draw.channel(f"mode({self.name})", "", mode))


class Shapes(Between):
    spec = Contact.spec

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        return [[("all", "every")]] if len(raw.args) == 1 else [[("a", "part"), ("b", "part")]]
