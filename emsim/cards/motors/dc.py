"""MOTOR, of type dcmotor: a permanent-magnet direct-current machine on a joint.

    d/dt(l i) + r i + ke w - v = 0        w = gear * u, on a slide with radius=: gear * u / radius
    T = j/2 (w + w_A)^2,  power into the machine: kt i w - b w^2, and friction of at most tc, against w
w is the rotor against its stator, which A carries: what turns the winding's voltage and the bearing. The rotor's energy is
that of its whole speed about its axis, A's own turn w_A about that axis counted in, so a wheel on a satellite turns the
satellite back, and the gyroscopic moment of a rotor on an arm follows.
kt and r may be expressions of the motor's own current, of coordinates, temperatures: one kt makes torque and back-EMF alike.
With kt = ke the electrical power ke w i is the mechanical power kt i w; where they differ, (kt - ke) i w
watts appear from nowhere, and `imbalance` says how many.
+ current into the first node turns B counter-clockwise (along +axis).
From a data sheet, w0 = n0 the no-load speed at vnom, i0 the no-load current, istall the starting one:
    r = vnom/istall    kt = (vnom - r i0)/w0    what i0 overcomes: tc = kt i0, or with loss=viscous b = kt i0/w0
so that the no-load point is met exactly. A sheet rounds: where r= or kt= is given beside these, it is taken.
Machines of other types are files beside this one.
"""

from __future__ import annotations

from math import pi

from ...expr import Node
from ..base import Default, Own, Spec
from ..domains.warmth import MAGNETS
from .base import SHAFT, Machine

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..base import Net, Pen, Powers, Probes, Resistances, Scalar, Scene

SHEET = ("vnom", "n0", "i0", "istall")
AGREE = 0.03  # a stall torque that is further from kt istall, in parts of it, is worth a word


class Motor(Machine):
    of_type = "dcmotor"
    spec = Spec(
        "MOTOR",
        "MOTOR name n+ n- joint kt= (or ke=, kv=) [r=] [l=] [j=] [b=] [tc=] [gear=] [radius=] or model=name of type dcmotor",
        terminals="plus:node minus:node joint:joint",
        mark=("kt", "ke", "kv", "vnom", "model"),
        meaning="a direct-current motor, or a voice coil on a slide",
        meant={"k": "kt={}", "km": "kt={}", "": "kt={}"},
        laws={
            "T": "j (w + w_A)^2/2, w = gear u, w_A: A's own speed about the axis",
            "P": "r i^2 + b w^2 + tc |w|",
            "i": "l di/dt + r i + ke w = v, torque kt i, w = gear u",
        },
        kt=Default(
            None, "N m/A (N/A on a slide without radius)", "torque per ampere; equals ke unless given", "formula"
        ),
        ke=Default(None, "V s/rad (V s/m)", "back-EMF per speed; equals kt unless given"),
        r=Default(0.0, "Ohm", "resistance of the winding", "formula", least=0.0),
        l=Default(0.0, "H", "inductance of the winding", least=0.0),
        kv=Default(None, "rpm/V", "turns per volt, in place of kt: kt = 60/(2 pi kv)", above=0.0),
        vnom=Default(None, "V", "data sheet: nominal voltage; with n0= i0= istall= it says kt, r and tc", above=0.0),
        n0=Default(None, "rad/s", "data sheet: speed without load at vnom, 12300rpm for instance", above=0.0),
        i0=Default(None, "A", "data sheet: current without load at vnom", least=0.0),
        istall=Default(None, "A", "data sheet: current at standstill at vnom", above=0.0),
        tstall=Default(None, "N m", "data sheet: torque at standstill, compared with kt istall", above=0.0),
        loss=Default("coulomb", "", "data sheet: what i0 overcomes, dry or viscous", "word", words=("coulomb", "viscous")),
        **MAGNETS,
        **SHAFT,
    )  # fmt: skip
    kt: Any
    ke: float | None
    kv: float | None
    r: Any
    l: float  # noqa: E741
    vnom: float | None
    n0: float | None
    i0: float | None
    istall: float | None
    tstall: float | None
    loss: str
    plus: int
    minus: int

    def prepare(self, s: Scene) -> None:
        self.changes: list[str] = []
        super().prepare(s)
        if self.kv is not None:
            self._from_kv(s)
        if any(self.said(s, key) for key in (*SHEET, "tstall", "loss")):
            self._from_sheet(s)
        if self.kt is None and self.ke is None:
            if s.models.get(self.model or "") is not None or self.model is None:
                s.sink.error(
                    "E230", f"MOTOR {self.name} needs kt= (torque per ampere)", self.span, self.spec.form
                )
            self.kt = self.ke = 0.0
        self.row = s.branch(self.name)
        self._formulas(s)
        self.torque_constant: Any = self.ke if self.kt is None else self.kt
        self.emf_constant: Any = self.kt if self.ke is None else self.ke

    def _formulas(self, s: Scene) -> None:
        """kt= and r= that change, by the motor's own current too."""
        own = Own(self.name, None, [s.b.x(self.row)], {})
        for key in ("kt", "r"):
            value = getattr(self, key)
            if isinstance(value, Node):
                setattr(self, key, s.compile_energy(value, self.place(key), own))
                self.changes.append(key)
        if "kt" in self.changes and self.ke is not None:
            said = f"MOTOR {self.name} has kt= by an expression and ke=: what one makes and the other takes would differ"
            s.sink.error("E231", said, self.place("ke"), "leave ke= out: one kt makes torque and back-EMF")
            self.ke = None
        if "r" in self.changes:
            s.told(
                -self.r,
                f"{self.name} source",
                f"r= of MOTOR {self.name} is below 0, which makes a source of it",
            )

    def _from_kv(self, s: Scene) -> None:
        """Volts per rad/s from turns per minute and volt."""
        assert self.kv is not None
        if self.kt is not None or self.ke is not None:
            said, where = "kv= beside kt= or ke=: each says it all", self.place("kv")
            s.sink.error("E231", f"MOTOR {self.name} does not take {said}", where, "leave one of them out")
        elif not self.joint.rotary and self.radius is None:
            said = f"kv= of MOTOR {self.name} is of a shaft that turns; {self.joint.name} slides"
            s.sink.error("E240", said, self.place("kv"), "give radius=, or kt= in N/A")
        self.kt = 60.0 / (2.0 * pi * self.kv)

    def _from_sheet(self, s: Scene) -> None:
        """r, kt and friction of a data sheet."""
        if any(isinstance(getattr(self, key), Node) for key in ("kt", "r")):
            said = f"MOTOR {self.name} has a data sheet, and kt= or r= by an expression"
            s.sink.error("E231", said, self.span, "give kt= and r=, or numbers for both")
            self.kt, self.r = 1.0, 1.0
        missing = [f"{key}=" for key in SHEET if getattr(self, key) is None]
        if missing:
            said = f"MOTOR {self.name} has part of a data sheet; missing: {', '.join(missing)}"
            s.sink.error("E230", said, self.span, "vnom= n0= i0= istall= together say kt, r and friction")
            return
        assert (
            self.vnom is not None and self.n0 is not None and self.i0 is not None and self.istall is not None
        )
        if not self.joint.rotary and self.radius is None:
            said = f"n0= of MOTOR {self.name} is of a shaft that turns; {self.joint.name} slides"
            s.sink.error("E240", said, self.span, "give radius=, or kt= in N/A")
        if not self.said(s, "r"):
            self.r = self.vnom / self.istall
        emf = self.vnom - self.r * self.i0
        if emf <= 0.0:
            said = (
                f"data sheet of MOTOR {self.name}: at i0 = {self.i0:g} A the winding's {self.r:g} Ohm take "
                f"{self.r * self.i0:g} V, and vnom is {self.vnom:g} V: nothing is left to turn against"
            )
            s.sink.error("E238", said, self.span, "i0= is the current without load, a small part of istall=")
            return
        if self.kt is None and self.ke is None:
            self.kt = emf / self.n0
        kt = self.kt if self.kt is not None else self.ke or 0.0
        if self.loss == "viscous" and not self.said(s, "b"):
            self.b = kt * self.i0 / self.n0
        elif self.loss == "coulomb" and not self.said(s, "tc"):
            self.tc = kt * self.i0
        if self.tstall is not None and abs(kt * self.istall - self.tstall) > AGREE * self.tstall:
            off = 100.0 * (kt * self.istall / self.tstall - 1.0)
            s.sink.warning(
                "W242",
                f"data sheet of MOTOR {self.name}: kt istall is {kt * self.istall:.4g} N m, {abs(off):.1f} % "
                f"{'above' if off > 0 else 'below'} tstall = {self.tstall:g} N m",
                self.span,
                f"it is computed with kt = {kt:.6g} N m/A, r = {self.r:.6g} Ohm; kt= and r= of the sheet win if given",
            )

    def derived(self) -> list[tuple[str, float, str, str]]:
        """What a data sheet came to: (parameter, value, unit, meaning)."""
        if self.vnom is None:
            return []
        found = [
            ("kt", self.torque_constant, "N m/A", "torque per ampere"),
            ("r", self.r, "Ohm", "resistance of the winding"),
        ]
        loss = (
            ("b", self.b, "N m s/rad", "viscous friction")
            if self.loss == "viscous"
            else ("tc", self.tc, "N m", "dry friction")
        )
        return [*found, loss]

    def powers(self, s: Scene) -> Powers:
        i, w = s.b.x(self.row), self._speed()
        result: Powers = [(self.weak * self.torque_constant * i, w)]
        if self.b:
            result.append((-self.b * w, w))
        return result

    def stamp(self, s: Scene) -> None:
        i = s.b.x(self.row)
        s.add_f(self.plus, i)
        s.add_f(self.minus, -i)
        turned = self.weak * self.emf_constant * self._speed()
        s.add_f(self.row, self.hot * self.r * i + turned - s.v(self.plus, self.minus))
        s.add_q(self.row, self.l * i)
        self.give_heat(s)

    def thermal(self, s: Scene) -> Resistances:
        return [("", self.hot * self.r, s.b.x(self.row))] if "r" in self.changes or self.r else []

    def supplied(self, s: Scene) -> Scalar | None:
        """Nothing, where kt and ke are one number."""
        return self.imbalance(s)

    def imbalance(self, s: Scene) -> Scalar | None:
        """Power that appears from nowhere [W]."""
        gain = 0.0 if self.kt is None or self.ke is None else self.torque_constant - self.emf_constant
        return self.weak * gain * s.b.x(self.row) * self._speed() if gain else None

    def _effort(self, s: Scene) -> Scalar:
        """On the joint, what the bearing takes left out: times its speed it is the power brought in."""
        return self._lever() * (self.weak * self.torque_constant * s.b.x(self.row) + self.drag())

    def probes(self, s: Scene) -> Probes:
        i, v = s.b.x(self.row), s.v(self.plus, self.minus)
        found: Probes = {
            self.effort_word()[0]: self._effort(s),
            "i": i,
            "v": v,
            "p": v * i,
        }
        if self.dry is not None:
            found["mode"] = self.dry.mode
        return found

    def losses(self, s: Scene) -> Scalar | None:
        i = s.b.x(self.row)
        return self.hot * self.r * i * i + self.friction()

    def stored(self, s: Scene) -> Scalar | None:
        i = s.b.x(self.row)
        return 0.5 * self.l * i * i if self.l else None

    def glyph(self, draw: Pen) -> None:
        word, unit = self.effort_word()
        i = draw.m.b.x(self.row)
        draw.add(
            "motor", self, **draw.joint(self.joint.name), unit=unit, model=self.of_type, poles=1,
            current=draw.channel(f"i({self.name})", "A", i),
            effort=draw.channel(f"{word}({self.name})", unit, self._effort(draw.m)),
        )  # fmt: skip

    def analogue(self, net: Net) -> None:
        """Winding, and an ideal transformer between the worlds: v = ke w, torque = kt i."""
        if self.changes:
            return net.refuse(self, f"has {self.changes[0]}= by an expression")
        if self.heat is not None or self.magnets is not None:
            return net.refuse(self, "gives its heat to a node of another domain")
        if self.tc:
            return net.refuse(self, "has dry friction (tc=), and no element of a circuit has")
        b, a = net.across(self.joint.name)
        n, gain = self.name.replace(".", "_"), self._lever()
        plus, minus = net.terminal_node(self, "plus"), net.terminal_node(self, "minus")
        net.add(f"Vs_{n} {plus} {n}_1 0", f"i(Vs_{n}) is i({self.name})")
        net.add(f"Rw_{n} {n}_1 {n}_2 {max(self.r, 1e-9)!r}", "winding")
        emf = f"{n}_2"
        if self.l:
            net.add(f"Lw_{n} {n}_2 {n}_3 {self.l!r} ic={net.initial_current(self.name)!r}")
            emf = f"{n}_3"
        net.add(f"Ee_{n} {emf} {minus} {b} {a} {self.emf_constant * gain!r}", "back-EMF: ke times speed")
        net.add(f"Ft_{n} {a} {b} Vs_{n} {self.torque_constant * gain!r}", "torque: kt times current")
        if self.j and (a == "0" or self.radius is not None):  # on a slide nothing turns but the pinion
            net.add(f"Cj_{n} {b} {a} {self.j * gain * gain!r}", "rotor")
        elif self.j and gain == 1.0:
            net.add(f"Cj_{n} {b} 0 {self.j!r}", "rotor")
        elif self.j:  # its whole speed is (1 - gear) of A's and gear of B's: two ideal transformers
            net.add(f"Ea_{n} {n}_a 0 {a} 0 {1.0 - gain!r}", "rotor: carried by the stator")
            net.add(f"Eb_{n} {n}_b {n}_a {b} 0 {gain!r}", "rotor: geared")
            net.add(f"Vj_{n} {n}_b {n}_j 0")
            net.add(f"Cj_{n} {n}_j 0 {self.j!r}", "rotor")
            net.add(f"Fa_{n} {a} 0 Vj_{n} {1.0 - gain!r}")
            net.add(f"Fb_{n} {b} 0 Vj_{n} {gain!r}")
        if self.b:
            net.add(f"Rb_{n} {b} {a} {1.0 / (self.b * gain * gain)!r}", "bearing")
