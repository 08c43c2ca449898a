"""HYDRAULIC: what a liquid flows through, fills and moves, between nodes of pressure over that of the surroundings, node 0.

    r=                   Q = dp/r                                           laminar
    len= d= mu=          Q = dp pi d^4/(128 mu len)                         a pipe, Hagen and Poiseuille
    area= [cd=] rho=     Q = cd area (2/rho)^(1/2) dp/(dp^2 + plam^2)^(1/4) an orifice or a valve, turbulent; laminar below plam
    ... crack=           the same of max(dp - crack, 0)                     check valve, relief valve
    inertia=             d/dt (inertia Q) = dp                              of the liquid in a pipe, rho len/area
    vol= bulk=           d/dt (vol p/bulk)                                  a volume that is compressed
    tank= rho=           d/dt (tank p/(rho g))                              an open tank of that surface, p at its bottom
    disp= joint          Q = disp u, torque disp dp                         a pump or motor: volume per angle
    vol={V(q)} [bulk=] joint                                                a cylinder, whose chamber is as large as V
    q=                   brought into a, or from a to b     p=              holds a, or a over b, at p
A chamber is one energy. Of its co-energy W' = V (p + p^2/(2 bulk)) the flow is d/dt dW'/dp = V' u + d/dt (V p/bulk), the force
dW'/dq = V' (p + p^2/(2 bulk)), and what it holds V p^2/(2 bulk): the piston gets what the liquid gives, compression included.
What resistances take is heat. Pressures are states: a run begins at ic= (level= of a tank), or at that of the surroundings. The
liquid does not boil: a chamber or pump whose pressure falls below vacuum is told.
"""

from __future__ import annotations

from math import pi, sqrt

from ..base import Card, Default, Own, Spec
from . import DOMAINS, drop, inject

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..._engine import Expr
    from ...deck import MachineCard
    from ...diagnostics import Sink
    from ..base import JointView, Pen, Powers, Probes, Scalar, Scene

LIQUID = DOMAINS["hydraulic"]
PAIR, ONE, MOVED = "a:hydraulic b:hydraulic", "a:hydraulic", "a:hydraulic joint:joint"
# what each has for terminals
FORMS = {
    "r": (PAIR,), "len": (PAIR,), "area": (PAIR,), "inertia": (PAIR,), "vol": (MOVED, f"{PAIR} joint:joint", ONE),
    "tank": (ONE,), "disp": (f"{PAIR} joint:joint",), "q": (ONE, PAIR), "p": (ONE, PAIR),
}  # fmt: skip
RESISTS = ("r", "len", "area")
# parameter -> forms that take it; of some what they need
OF_FORM = {
    "d": ("len",), "mu": ("len",), "cd": ("area",), "plam": ("area",), "rho": ("area", "tank"), "crack": RESISTS,
    "bulk": ("vol",), "ic": ("vol",), "level": ("tank",),
}  # fmt: skip
NEEDS = {"len": ("d", "mu"), "area": ("rho",), "tank": ("rho",)}


class Hydraulic(Card):
    spec = Spec(
        "HYDRAULIC",
        "HYDRAULIC name a b r= (or len= d= mu=, or area= rho=, or inertia=) [crack=], or a [b] joint vol={..} (or disp=), "
        "or a vol= bulk= (or tank= rho=, p=, q=)",
        terminals="a:hydraulic b:hydraulic | a:hydraulic joint:joint | a:hydraulic b:hydraulic joint:joint | a:hydraulic",
        mark=tuple(FORMS),
        meaning="a pipe, an orifice or valve, a volume, a tank, a pump, a cylinder, or a source of flow or pressure",
        meant={"c": "vol={}", "v": "vol={}", "diameter": "d={}", "opening": "area={}"},
        laws={
            "f": "r=: (pa - pb)/r; area=: cd area sqrt(2/rho) dp/(dp^2 + plam^2)^(1/4)",
            "W": "vol=: V (p + p^2/(2 bulk)); disp=: flow disp u, torque disp dp",
            "P": "flow dp",
        },
        r=Default(None, "Pa s/m^3", "resistance", above=0.0),
        len=Default(None, "m", "length of a pipe", above=0.0),
        d=Default(None, "m", "its bore", above=0.0),
        mu=Default(None, "Pa s", "viscosity", above=0.0),
        area=Default(None, "m^2", "opening of an orifice: number or {expression}; below 0 it is closed", "value"),
        cd=Default(0.6, "", "coefficient of discharge", above=0.0),
        rho=Default(None, "kg/m^3", "density", above=0.0),
        plam=Default(100.0, "Pa", "below about this an orifice is laminar", above=0.0),
        crack=Default(None, "Pa", "flow goes from a to b alone, beyond this drop of pressure"),
        inertia=Default(None, "kg/m^4", "of the liquid in a pipe, rho len/area", above=0.0),
        vol=Default(None, "m^3", "volume of a chamber; with a joint of its coordinate", "value"),
        bulk=Default(None, "Pa", "bulk modulus, with vol=; without it the liquid is incompressible", above=0.0),
        tank=Default(None, "m^2", "surface of an open tank", above=0.0),
        ic=Default(None, "Pa", "pressure at the start, with vol= and bulk="),
        level=Default(None, "m", "height of the liquid at the start, with tank=", least=0.0),
        disp=Default(None, "m^3/rad (m^2)", "volume from a to b per angle of the joint"),
        q=Default(None, "m^3/s", "flow brought into a, or from a to b: number, {expression} or waveform", "value"),
        p=Default(None, "Pa", "pressure at which a is held: number, {expression} or waveform", "value"),
    )  # fmt: skip
    r: float | None
    len: float | None
    d: float
    mu: float
    area: Any
    cd: float
    rho: float
    plam: float
    crack: float | None
    inertia: float | None
    vol: Any
    bulk: float | None
    tank: float | None
    ic: float | None
    level: float | None
    disp: float | None
    q: Any
    p: Any
    a: int
    b: int = -1
    joint: JointView | None = None
    limits = (
        "a liquid boils there, which is not computed: more pressure at rest, or a check valve from a tank"
    )

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        """What its words may be, by what it is."""
        said = next((form for form in FORMS if form in raw.params), "")
        texts = FORMS.get(said, (ONE, PAIR, MOVED))
        return [[(w.partition(":")[0], w.partition(":")[2]) for w in text.split()] for text in texts]

    def check(self, sink: Sink) -> None:
        given = [key for key in FORMS if getattr(self, key) is not None]
        what = f"HYDRAULIC {self.name}"
        if len(given) != 1:
            said = f"{what} needs exactly one of {' '.join(f'{key}=' for key in FORMS)}"
            sink.error("E252", said, self.span, self.spec.form)
            return
        self.form = given[0]
        moves = self.terminals[-1][0] == "joint"
        if self.form == "vol" and self.bulk is not None and len(self.terminals) == 3:
            said = f"{what} with bulk= is between one node and the surroundings"
            sink.error("E233", said, self.place("bulk"), self.spec.form)
        for key, forms in OF_FORM.items():
            if self.given(key) and self.form not in forms:
                sink.error(
                    "E231", f"{what} does not take {key}= with {self.form}=", self.place(key), self.spec.form
                )
        needed = NEEDS.get(self.form, ()) if self.form != "vol" or moves else ("bulk",)
        for key in needed:
            if getattr(self, key) is None:
                sink.error("E230", f"{what} needs {key}= with {self.form}=", self.span, self.spec.form)
        if self.ic is not None and self.bulk is None:
            sink.error("E231", f"{what} takes ic= with bulk= alone", self.place("ic"), self.spec.form)

    def prepare(self, s: Scene) -> None:
        self.dp = drop(s, LIQUID, self.a, self.b)
        self.row, self.energy = -1, s.b.const(0.0)
        if self.form in ("p", "inertia"):
            self.row = s.b.unknown(f"flow({self.name})", "branch", "m^3/s", 0.0)
        if self.form == "inertia":
            s.b.start_current(self.row, 0.0)
        if self.form in ("tank", "vol") and self.a < 0:
            said = f"HYDRAULIC {self.name} is on 0, the surroundings, whose pressure nothing changes"
            s.sink.error("E257", said, self.span, "name a node of its own")
        if self.form == "tank":
            weight = sqrt(sum(g * g for g in s.gravity))
            if not weight:
                said = f"HYDRAULIC {self.name} is a tank, and nothing weighs anything without .gravity"
                s.sink.error("E230", said, self.span, ".gravity 9.81")
            self.capacity: Scalar = (self.tank or 0.0) / ((self.rho or 1.0) * (weight or 1.0))
            s.told(
                -self.dp - self.plam, f"{self.name} empty", f"the tank {self.name} is empty, and gives more"
            )
        elif self.form == "vol":
            self._chamber(s)
        if self.form in ("vol", "disp"):
            for row in (self.a, self.b):
                vacuum = -drop(s, LIQUID, row, -1) - 101325.0  # the surroundings, a standard atmosphere [Pa]
                if row >= 0:
                    s.told(
                        vacuum,
                        f"{self.name} vacuum{row}",
                        f"a pressure at HYDRAULIC {self.name} is below vacuum",
                    )

    def _chamber(self, s: Scene) -> None:
        """Volume, how it changes, and the co-energy."""
        q, b = s.b.symbol(), s.b
        own = Own(self.name, None, [], {} if self.joint is None else {self.joint.name: q})
        volume = s.compile_energy(self.vol, self.place("vol"), own)
        other = s.beyond_coordinates(self.vol, volume)
        slope = b.grad(volume, [q])[0]
        if other or (self.joint is None and volume.value is None):
            said = f"vol= of HYDRAULIC {self.name} is a number, or a function of its joint; "
            said += f"{other or 'what changes it'} would do work that nothing supplies"
            s.sink.error(
                "E252", said, self.place("vol"), "name the joint on the card: HYDRAULIC name a joint vol={..}"
            )
        if self.joint is not None:
            volume, slope = b.substitute([volume, slope], [(q, self.joint.q)])
        real = s.public(volume)
        if real.value is not None and real.value <= 0.0:
            s.sink.error("E238", f"vol= of HYDRAULIC {self.name} must be greater than 0", self.place("vol"))
        elif self.bulk is not None and real.value is None:
            s.told(-real, f"{self.name} closed", f"vol= of HYDRAULIC {self.name} has fallen to 0 or below")
        self.slope = slope
        self.capacity = 0.0 if self.bulk is None else volume / self.bulk
        self.effort = slope * (
            self.dp if self.bulk is None else self.dp + (0.5 / self.bulk) * self.dp * self.dp
        )
        if self.joint is not None:
            self.energy = volume * self.dp + 0.5 * self.capacity * self.dp * self.dp

    def joins(self, s: Scene) -> list[tuple[int, int]]:
        """Nodes between which liquid flows at rest, or pressure is given."""
        return [(self.a, self.b)] if self.form in (*RESISTS, "inertia", "p") else []

    def starts(self, s: Scene) -> tuple[int, float | None] | None:
        """A node whose pressure a run begins with, and what its unknown is there."""
        if self.form == "tank":
            weight = sqrt(sum(g * g for g in s.gravity))
            return self.a, None if self.level is None else self.rho * weight * self.level / LIQUID.size
        if self.form == "vol" and self.bulk is not None:
            return self.a, None if self.ic is None else self.ic / LIQUID.size
        return None

    def _value(self, s: Scene) -> Expr:
        return s.compile(getattr(self, self.form), self.place(self.form))

    def _flow(self, s: Scene) -> Scalar:
        """From a to b [m^3/s], without what is stored."""
        if self.row >= 0:
            return s.b.x(self.row)
        if self.form == "q":
            return self._value(s) if self.b >= 0 else -self._value(s)
        if self.form in ("disp", "vol"):
            swept: Scalar = (self.disp or 0.0) if self.form == "disp" else self.slope
            return 0.0 if self.joint is None else swept * self.joint.u
        if self.form == "tank":
            return 0.0
        dp = self.dp if self.crack is None else s.maximum(self.dp - self.crack, 0.0)
        if self.form == "r":
            return dp * (1.0 / (self.r or 1.0))
        if self.form == "len":
            return dp * (pi * self.d**4 / (128.0 * self.mu * (self.len or 1.0)))
        opening = s.maximum(self._value(s), 0.0)
        root = s.b.call("sqrt", s.b.call("sqrt", dp * dp + self.plam * self.plam))
        return (self.cd * sqrt(2.0 / self.rho)) * opening * dp / root

    def coenergy(self, s: Scene) -> Scalar | None:
        return self.energy if self.form == "vol" and self.joint is not None else None

    def powers(self, s: Scene) -> Powers:
        if self.form != "disp" or self.joint is None:
            return []
        return [(self._effort(), self.joint.u)]

    def stamp(self, s: Scene) -> None:
        inject(s, LIQUID, self.a, self.b, self._flow(s))
        if self.form in ("tank", "vol"):
            s.add_q(self.a, LIQUID.size * self.capacity * self.dp)
        elif self.form == "p":
            s.add_f(self.row, (self.dp - self._value(s)) * (1.0 / LIQUID.size))
        elif self.form == "inertia":
            s.add_q(self.row, (self.inertia or 0.0) / LIQUID.size * s.b.x(self.row))
            s.add_f(self.row, self.dp * (-1.0 / LIQUID.size))

    def _effort(self) -> Expr:
        """On the joint."""
        return self.effort if self.form == "vol" else (self.disp or 0.0) * self.dp

    def probes(self, s: Scene) -> Probes:
        found: Probes = {"flow": s.b.const(0.0) + self._flow(s)}
        if self.form == "tank":
            found["length"] = self.dp * ((self.capacity) / (self.tank or 1.0))
        if self.joint is not None:
            effort = self._effort()
            found["torque" if self.joint.rotary else "force"] = effort
            found["power"] = effort * self.joint.u
        return found

    def losses(self, s: Scene) -> Scalar | None:
        return self._flow(s) * self.dp if self.form in RESISTS else None

    def stored(self, s: Scene) -> Scalar | None:
        if self.form == "inertia":
            return 0.5 * (self.inertia or 0.0) * s.b.x(self.row) * s.b.x(self.row)
        return 0.5 * self.capacity * self.dp * self.dp if self.form in ("tank", "vol") else None

    def supplied(self, s: Scene) -> Scalar | None:
        return -(self._flow(s) * self.dp) if self.form in ("p", "q") else None

    def glyph(self, draw: Pen) -> None:
        if self.joint is None:
            return
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        draw.add(
            "transducer", self, **draw.joint(self.joint.name), form="c", of="Pa", unit=unit,
            volts=draw.channel(f"pressure({self.name})", "Pa", self.dp),
            effort=draw.channel(f"{word}({self.name})", unit, self._effort()),
        )  # fmt: skip
