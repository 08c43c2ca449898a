"""HEAT: what carries, keeps and brings heat between nodes of temperature. `0` is the surroundings, at the deck's temperature.

    r=    (Ta - Tb)/r                       conduction            c=    d/dt (c T)            heat capacity of node a
    h=    h area (Ta - Tb)                  convection            p=    heat brought into a   a source
    eps=  eps sigma area (Ta^4 - Tb^4)      radiation             t=    holds a at t          a thermostat
    of=   what an element or card turns into heat goes into a, and is no loss of it any more
Heat is a power by itself: nothing is lost on its way. What goes into the surroundings, or into what holds a temperature, has left
the deck; that is what the balance of energy counts as dissipated. What a node holds is c times its temperature over that of the
surroundings. A temperature is a state, as positions are: a run begins at ic= of the heat capacity, or that of the surroundings,
and .op looks for the balance of heat.
"""

from __future__ import annotations

from ..base import Card, Default, Spec
from . import DOMAINS, drop, inject, level

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..._engine import Expr
    from ...diagnostics import Sink
    from ..base import Pen, Probes, Scalar, Scene

HEAT = DOMAINS["heat"]
FORMS = ("r", "h", "eps", "c", "p", "t", "of")
BETWEEN = ("r", "h", "eps")  # two nodes; the others have one


class Heat(Card):
    spec = Spec(
        "HEAT",
        "HEAT name a b r= (or h= area=, or eps= area=), or HEAT name a c= [ic=] (or p=, t=, of=)",
        terminals="a:heat b:heat | a:heat",
        mark=FORMS,
        meaning="a way for heat, a heat capacity, a source of heat, a held temperature, or the heat of something",
        meant={"g": "r={}", "rth": "r={}", "cth": "c={}"},
        laws={
            "f": "r=: (Ta - Tb)/r; h=: h area (Ta - Tb); eps=: eps sigma area (Ta^4 - Tb^4)",
            "Q": "c=: d/dt (c T)",
        },
        r=Default(None, "K/W", "thermal resistance from a to b: number or {expression}", "value"),
        h=Default(None, "W/(m^2 K)", "coefficient of convection: number or {expression}", "value"),
        eps=Default(None, "", "emissivity of a surface that radiates, 0 to 1", least=0.0),
        area=Default(None, "m^2", "of the surface, with h= and eps=", above=0.0),
        c=Default(None, "J/K", "heat capacity", above=0.0),
        ic=Default(None, "K", "temperature at the start, with c=", above=0.0),
        p=Default(None, "W", "heat brought into a: number, {expression} or waveform", "value"),
        t=Default(None, "K", "temperature at which a is held: number, {expression} or waveform", "value"),
        of=Default(None, "", "element or card whose heat goes into a", "owner"),
    )
    r: Any
    h: Any
    eps: float | None
    area: float | None
    c: float | None
    ic: float | None
    p: Any
    t: Any
    of: str | None
    a: int
    b: int = -1

    def check(self, sink: Sink) -> None:
        given = [key for key in FORMS if getattr(self, key) is not None]
        what = f"HEAT {self.name}"
        if len(given) != 1:
            sink.error(
                "E252", f"{what} needs exactly one of r= h= eps= c= p= t= of=", self.span, self.spec.form
            )
            return
        self.form = given[0]
        nodes = 2 if self.form in BETWEEN else 1
        if len(self.terminals) != nodes:
            said = f"{what} with {self.form}= has {'two nodes' if nodes == 2 else 'one node'}"
            sink.error("E233", said, self.span, self.spec.form)
        if (self.area is None) == (self.form in ("h", "eps")):
            said = f"{what} {'needs' if self.area is None else 'does not take'} area= with {self.form}="
            sink.error("E230" if self.area is None else "E231", said, self.place("area"), self.spec.form)
        if self.ic is not None and self.form != "c":
            sink.error("E231", f"{what} takes ic= with c= alone", self.place("ic"), self.spec.form)

    def prepare(self, s: Scene) -> None:
        if self.form not in BETWEEN and self.a < 0:
            said = f"HEAT {self.name} is on 0, the surroundings, whose temperature nothing changes"
            s.sink.error("E257", said, self.span, "name a node of its own")
        if self.form == "of":
            s.domains.warm(str(self.of), self, self.place("of"))
        self.row = s.b.unknown(f"heat({self.name})", "branch", "W", 0.0) if self.form == "t" else -1

    def joins(self, s: Scene) -> list[tuple[int, int]]:
        """Nodes between which heat goes at rest."""
        return [(self.a, self.b)] if self.form in (*BETWEEN, "t") else []

    def starts(self, s: Scene) -> tuple[int, float | None] | None:
        """A node whose temperature a run begins with, and what its unknown is there; None: that of the surroundings."""
        if self.form != "c":
            return None
        return self.a, None if self.ic is None else self.ic - s.domains.surroundings

    def _value(self, s: Scene) -> Expr:
        return s.compile(getattr(self, self.form), self.place(self.form))

    def _heat(self, s: Scene) -> Expr:
        """From a to b [W]; of one node, out of it."""
        if self.form == "t":
            return s.b.x(self.row)
        if self.form == "c":
            assert self.c is not None
            return s.derivative(f"heat({self.name})", "W", self.c * s.b.x(self.a))
        if self.form == "of":
            return -s.domains.heat_of(str(self.of))
        if self.form == "eps":
            assert self.eps is not None and self.area is not None
            sigma = 5.670374419e-8  # Stefan and Boltzmann [W/(m^2 K^4)], CODATA 2018: exact, of k, h and c
            a, b = level(s, HEAT, self.a), level(s, HEAT, self.b)
            return (self.eps * self.area * sigma) * (a * a * a * a - b * b * b * b)
        if self.form == "p":
            return -self._value(s)
        over = drop(s, HEAT, self.a, self.b)
        return over / self._value(s) if self.form == "r" else (self.area or 0.0) * self._value(s) * over

    def stamp(self, s: Scene) -> None:
        if self.form == "c":
            assert self.c is not None
            s.add_q(self.a, self.c * s.b.x(self.a))
            return
        inject(s, HEAT, self.a, self.b, self._heat(s))
        if self.form == "t":
            s.add_f(self.row, level(s, HEAT, self.a) - self._value(s))

    def probes(self, s: Scene) -> Probes:
        return {"heat": lambda: self._heat(s)}

    def losses(self, s: Scene) -> Scalar | None:
        """What leaves the deck: into the surroundings, or what holds a temperature."""
        if self.form == "t":
            return self._heat(s)
        if self.form not in BETWEEN or (self.a >= 0 and self.b >= 0) or self.a == self.b:
            return None
        return self._heat(s) if self.b < 0 else -self._heat(s)

    def supplied(self, s: Scene) -> Scalar | None:
        return self._value(s) if self.form == "p" else None

    def stored(self, s: Scene) -> Scalar | None:
        return None if self.c is None else self.c * s.b.x(self.a)

    def glyph(self, draw: Pen) -> None:
        """It is nowhere in the mechanism."""
