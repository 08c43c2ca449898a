"""MAGNETIC: what flux goes through, and what drives it, between nodes of magnetomotive force.

A branch from a to b has one co-energy W'(F, q), of F = mmf(a) - mmf(b) and, with a joint, of its coordinate:
    flux dW'/dF,   force or torque dW'/dq,   energy held F dW'/dF - W'
    r=                     F^2/(2 r)                                            a reluctance, with a joint r={R(q)}
    gap= area=             mu0 area F^2/(2 gap)                                 air, with a joint gap={g(q)}
    len= area= mur=        mu0 mur area F^2/(2 len)                             iron
    ... bsat=              area len (mu0 H^2/2 + bsat h ((1 + (H/h)^2)^(1/2) - 1)),  H = F/len,  h = bsat/((mur - 1) mu0)
    ... br=                ... + br area F                                      a permanent magnet, magnetised towards b
so B is mu0 H + bsat (H/h)/(1 + (H/h)^2)^(1/2): mur mu0 H where it is small, and never more than bsat of its own. One curve,
without memory; a core with hysteresis (Jiles and Atherton) is K with a .model CORE.
    turns=                 F = turns i,   v = turns d(flux)/dt                  a winding, whose flux leaves it at a
    mmf=                   F = mmf                                              a source
With + current into n+ a winding drives flux out of a, round the magnetic circuit and into b. What goes in at its terminals, v i,
is F d(flux)/dt: nothing is lost.
"""

from __future__ import annotations

from math import pi

from ..base import Card, Default, Own, Spec, is_number
from . import DOMAINS, drop, inject

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..._engine import Expr
    from ...diagnostics import Sink
    from ..base import JointView, Pen, Probes, Scalar, Scene

MAGNETIC = DOMAINS["magnetic"]
FORMS = ("r", "gap", "len", "turns", "mmf")
OF_FORM = {"area": ("gap", "len"), "mur": ("len",), "bsat": ("len",), "br": ("len",)}


class Magnetic(Card):
    spec = Spec(
        "MAGNETIC",
        "MAGNETIC name a b [joint] r= (or gap= area=), or a b len= area= mur= [bsat= or br=], or a b n+ n- turns=, or a b mmf=",
        terminals="a:magnetic b:magnetic | a:magnetic b:magnetic joint:joint | a:magnetic b:magnetic plus:node minus:node",
        mark=FORMS,
        meaning="a reluctance, an air gap, iron, a magnet, a winding, or a source of magnetomotive force",
        meant={"n": "turns={}", "l": "len={}", "length": "len={}", "reluctance": "r={}"},
        laws={
            "W": "F^2/(2 r), F = mmf(a) - mmf(b); with a joint it pulls by dW'/dq",
            "f": "turns=: F = turns i, v = turns dflux/dt",
        },
        r=Default(None, "A/Wb", "reluctance; with a joint of its coordinate", "value"),
        gap=Default(None, "m", "length of an air gap; with a joint of its coordinate", "value"),
        len=Default(None, "m", "length of the way through iron or magnet", above=0.0),
        area=Default(None, "m^2", "cross-section, with gap= and len=", above=0.0),
        mur=Default(None, "", "relative permeability, with len=", least=1.0),
        bsat=Default(None, "T", "what iron adds to the flux density when it is saturated", above=0.0),
        br=Default(None, "T", "remanence of a permanent magnet"),
        turns=Default(None, "", "of a winding between n+ and n-", above=0.0),
        mmf=Default(None, "A", "magnetomotive force from a to b: number, {expression} or waveform", "value"),
    )  # fmt: skip
    r: Any
    gap: Any
    len: float | None
    area: float | None
    mur: float | None
    bsat: float | None
    br: float | None
    turns: float | None
    mmf: Any
    a: int
    b: int
    plus: int = -1
    minus: int = -1
    joint: JointView | None = None
    limits = "a STOP on the joint ends its way before the gap is closed"

    def check(self, sink: Sink) -> None:
        given = [key for key in FORMS if getattr(self, key) is not None]
        what = f"MAGNETIC {self.name}"
        if len(given) != 1:
            sink.error(
                "E252", f"{what} needs exactly one of r= gap= len= turns= mmf=", self.span, self.spec.form
            )
            return
        self.form = given[0]
        last = self.terminals[-1][0] if self.terminals else ""
        wanted = "minus" if self.form == "turns" else "b"
        if last != wanted and not (last == "joint" and self.form in ("r", "gap")):
            words = {
                "turns": "two nodes of its own and two of the circuit",
                "r": "two nodes, and a joint if it moves",
            }
            said = f"{what} with {self.form}= has {words.get('r' if self.form == 'gap' else self.form, 'two nodes')}"
            sink.error("E233", said, self.span, self.spec.form)
        for key, forms in OF_FORM.items():
            if getattr(self, key) is not None and self.form not in forms:
                sink.error(
                    "E231", f"{what} does not take {key}= with {self.form}=", self.place(key), self.spec.form
                )
        needed = {"gap": ("area",), "len": ("area", "mur")}.get(self.form, ())
        for key in needed:
            if getattr(self, key) is None:
                sink.error("E230", f"{what} needs {key}= with {self.form}=", self.span, self.spec.form)
        if self.bsat is not None and (self.br is not None or self.mur == 1.0):
            beside = (
                "br=: iron saturates, a magnet keeps its line" if self.br else "mur=1: nothing to saturate"
            )
            said = f"{what} has bsat= and {beside}"
            sink.error("E231", said, self.place("bsat"), "leave one of them out")

    def prepare(self, s: Scene) -> None:
        self.across = drop(s, MAGNETIC, self.a, self.b)
        self.row = self.through = -1
        if self.form in ("turns", "mmf"):
            self.through = s.b.unknown(f"flux({self.name})", "branch", "Wb", 0.0)
            self.flux, self.energy = s.b.x(self.through), s.b.const(0.0)
            if self.form == "turns":
                self.row = s.branch(self.name)
            return
        force, q = s.b.symbol(), s.b.symbol()
        self.own_rules(s, q)
        energy = self._coenergy(s, force)
        flux = s.b.grad(energy, [force])[0]
        effort = s.b.grad(energy, [q])[0]
        places = [(force, self.across)]
        if self.joint is not None:
            places.append((q, self.joint.q))
        self.energy, self.flux, self.effort = s.b.substitute([energy, flux, effort], places)

    def own_rules(self, s: Scene, q: Expr) -> None:
        """Compiles r= or gap=, of the joint's coordinate alone; a gap says when it has closed."""
        self.way: Scalar = self.len or 0.0
        if self.form == "len":
            return
        value, at = getattr(self, self.form), self.place(self.form)
        own = Own(self.name, None, [], {} if self.joint is None else {self.joint.name: q})
        way = s.compile_energy(value, at, own)
        other = s.beyond_coordinates(value, way)
        joints = [] if self.joint is None else [(q, self.joint.q)]
        real = s.public(s.b.substitute([way], joints)[0])
        if not is_number(value) and (self.joint is None or other):
            what = f"{self.form}= of MAGNETIC {self.name}"
            said = f"{what} is a function of its joint; {other} would do work that nothing supplies"
            if self.joint is None:
                said = f"{what} is a number; what changes it would do work that nothing supplies"
            s.sink.error(
                "E252", said, at, "name the joint on the card: MAGNETIC name a b joint gap={pos(joint)} area="
            )
        elif real.value is not None and real.value <= 0.0:
            s.sink.error("E238", f"{self.form}= of MAGNETIC {self.name} must be greater than 0", at)
        elif real.value is None:
            s.told(
                -real, f"{self.name} closed", f"{self.form}= of MAGNETIC {self.name} has fallen to 0 or below"
            )
        self.way = way

    def _coenergy(self, s: Scene, force: Expr) -> Expr:
        """W' [J] of the magnetomotive force [A]."""
        square = 0.5 * force * force
        if self.form == "r":
            return square / self.way
        mu0 = 4e-7 * pi  # [H/m]
        area = self.area or 0.0
        if self.form == "gap":
            return mu0 * area * square / self.way
        assert self.len is not None and self.mur is not None
        if self.bsat is None:
            return (mu0 * self.mur * area / self.len) * square + (self.br or 0.0) * area * force
        knee = self.bsat / ((self.mur - 1.0) * mu0)  # [A/m]
        bent = s.b.call("sqrt", 1.0 + (force / (knee * self.len)) * (force / (knee * self.len))) - 1.0
        return (mu0 * area / self.len) * square + (area * self.len * self.bsat * knee) * bent

    def joins(self, s: Scene) -> list[tuple[int, int]]:
        """Nodes between which flux goes, or a force is given."""
        return [(self.a, self.b)]

    def starts(self, s: Scene) -> None:
        return None

    @property
    def magnetises(self) -> bool:
        """Is there a flux without a current?"""
        return bool(self.br) or self.form == "mmf"

    def coenergy(self, s: Scene) -> Scalar | None:
        return None if self.form in ("turns", "mmf") else self.energy

    def stamp(self, s: Scene) -> None:
        inject(s, MAGNETIC, self.a, self.b, -self.flux if self.form == "turns" else self.flux)
        if self.form == "mmf":
            s.add_f(self.through, self.across - s.compile(self.mmf, self.place("mmf")))
        if self.form != "turns":
            return
        assert self.turns is not None
        i = s.b.x(self.row)
        s.add_f(self.plus, i)
        s.add_f(self.minus, -i)
        s.add_f(self.through, self.across - self.turns * i)
        s.add_q(self.row, self.turns * self.flux)
        s.add_f(self.row, -s.v(self.plus, self.minus))

    def probes(self, s: Scene) -> Probes:
        found: Probes = {"flux": self.flux}
        if self.form == "turns":
            i, v = s.b.x(self.row), s.v(self.plus, self.minus)
            found.update(i=i, v=v, p=v * i)
        if self.joint is not None:
            found["torque" if self.joint.rotary else "force"] = self.effort
            found["power"] = self.effort * self.joint.u
        return found

    def stored(self, s: Scene) -> Scalar | None:
        return None if self.form in ("turns", "mmf") else self.across * self.flux - self.energy

    def supplied(self, s: Scene) -> Scalar | None:
        """A source gives -F d(flux)/dt."""
        return (
            -self.across * s.derivative(f"flux({self.name})'", "V", self.flux) if self.form == "mmf" else None
        )

    def glyph(self, draw: Pen) -> None:
        if self.joint is None:
            return
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        draw.add(
            "transducer", self, **draw.joint(self.joint.name), form="w", of="Wb", unit=unit,
            volts=draw.channel(f"flux({self.name})", "Wb", self.flux),
            effort=draw.channel(f"{word}({self.name})", unit, self.effort),
        )  # fmt: skip
