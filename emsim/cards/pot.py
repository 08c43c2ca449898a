"""POT: a potentiometer whose wiper a joint moves.

    a = (q - q_bottom) / (q_top - q_bottom), range=(q_bottom, q_top), held where t is within [rw/r, 1 - rw/r]
    wiper to bottom: r*t(a)      top to wiper: r*(1 - t(a))
so the wiper reaches `top` at the upper end of the range and its voltage rises with the coordinate. Tapers:
    lin   t = a
    log   t = (81^a - 1)/80, the audio taper: a tenth of the resistance at half the way
The wiper never reaches 0 Ohm: rw is what is left at the ends, so a log taper stops where t, not a, is rw/r away
from them. Beyond the ends it stays there, with a warning.
"""

from __future__ import annotations

from math import log

from .base import Card, Default, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Probes, Resistances, Scalar, Scene

LOG_BASE = 81.0


class Pot(Card):
    spec = Spec(
        "POT",
        "POT name top wiper bottom joint r= range=(a,b) [taper=lin/log] [rw=]",
        terminals="top:node wiper:node bottom:node joint:joint",
        mark=("range",),
        meaning="a potentiometer on a pin or a slide",
        laws={
            "P": "v^2/R of both parts",
            "i": "top to wiper r (1 - a), wiper to bottom r a, a the share of the way",
        },
        r=Required("Ohm", "resistance from top to bottom", above=0.0),
        range=Required("rad or m", "coordinates where the wiper is at bottom and at top", "vector"),
        taper=Default("lin", "", "how resistance follows the way", "word", words=("lin", "log")),
        rw=Default(None, "Ohm", "resistance left at the ends; r/1e6", above=0.0),
    )
    r: float
    range: tuple[float, ...]
    taper: str
    rw: float | None
    top: int
    wiper: int
    bottom: int
    joint: JointView

    def check(self, sink: Sink) -> None:
        if len(self.range) != 2 or self.range[0] == self.range[1]:
            sink.error(
                "E232", f"range= of POT {self.name} is two different coordinates (a,b)", self.place("range")
            )
        if self.rw is None:
            self.rw = self.r * 1e-6
        if self.rw >= 0.5 * self.r:
            sink.error("E238", f"rw= of POT {self.name} is half of r= or more", self.place("rw"))

    def _conductances(self, s: Scene) -> tuple[Expr, Expr]:
        """Top to wiper, wiper to bottom [S]."""
        first, last = self.range
        way = (self.joint.q - first) * (1.0 / (last - first))
        assert self.rw is not None
        rest = self.rw / self.r
        low, high = rest, 1.0 - rest
        if self.taper == "log":  # the ends in terms of the way
            low, high = (log(1.0 + t * (LOG_BASE - 1.0)) / log(LOG_BASE) for t in (low, high))
        where = s.clamp(way, low, high, self.name, f"the wiper of POT {self.name} is at its end")
        if self.taper == "log":
            where = (s.b.call("exp", log(LOG_BASE) * where) - 1.0) * (1.0 / (LOG_BASE - 1.0))
        return 1.0 / (self.r * (1.0 - where)), 1.0 / (self.r * where)

    def prepare(self, s: Scene) -> None:
        self.upper, self.lower = self._conductances(s)

    def stamp(self, s: Scene) -> None:
        up = self.upper * s.v(self.top, self.wiper)
        down = self.lower * s.v(self.wiper, self.bottom)
        s.add_f(self.top, up)
        s.add_f(self.wiper, down - up)
        s.add_f(self.bottom, -down)

    def node_currents(self, s: Scene) -> tuple[Expr, ...]:
        up, down = self.upper * s.v(self.top, self.wiper), self.lower * s.v(self.wiper, self.bottom)
        return up, down - up, -down

    def _heat(self, s: Scene) -> Expr:
        over, under = s.v(self.top, self.wiper), s.v(self.wiper, self.bottom)
        return self.upper * over * over + self.lower * under * under

    def probes(self, s: Scene) -> Probes:
        current = self.upper * s.v(self.top, self.wiper)
        return {"i": current, "v": s.v(self.top, self.bottom), "p": self._heat(s)}

    def losses(self, s: Scene) -> Scalar | None:
        return self._heat(s)

    def thermal(self, s: Scene) -> Resistances:
        upper, lower = s.v(self.top, self.wiper), s.v(self.wiper, self.bottom)
        return [("upper", self.upper, upper), ("lower", self.lower, lower)]

    def glyph(self, draw: Pen) -> None:
        volts = draw.m.v(self.wiper, -1)
        wiper = draw.channel(f"wiper({self.name})", "V", volts)
        draw.add("pot", self, **draw.joint(self.joint.name), range=list(self.range), wiper=wiper)

    def analogue(self, net: Net) -> None:
        """A divider whose ratio a coordinate sets."""
        first, last = self.range
        n, q = self.name.replace(".", "_"), net.coordinate(self.joint.name)
        top, wiper, bottom = (net.terminal_node(self, label) for label in ("top", "wiper", "bottom"))
        assert self.rw is not None
        way = f"({q}-({first!r}))/({last - first!r})"
        share = f"(exp({log(LOG_BASE)!r}*{way})-1)/{LOG_BASE - 1.0!r}" if self.taper == "log" else way
        rest = self.rw / self.r
        share = f"min(max({share},{rest!r}),{1.0 - rest!r})"
        net.add(f"Bu_{n} {top} {wiper} i='v({top},{wiper})/({self.r!r}*(1-{share}))'", "top to wiper")
        net.add(f"Bd_{n} {wiper} {bottom} i='v({wiper},{bottom})/({self.r!r}*{share})'", "wiper to bottom")
