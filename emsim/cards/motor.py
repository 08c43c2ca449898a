"""MOTOR: a permanent-magnet direct-current machine on a joint.

    d/dt(l i) + r i + ke w - v = 0        w = gear * u, on a slide with radius=: gear * u / radius
    T = j/2 (w + w_A)^2,  power into the machine: kt i w - b w^2, and friction of at most tc, against w
w is the rotor against its stator, which A carries: what turns the winding's voltage and the bearing. The rotor's energy is
that of its whole speed about its axis, A's own turn w_A about that axis counted in, so a wheel on a satellite turns the
satellite back, and the gyroscopic moment of a rotor on an arm follows.
With kt = ke the electrical power ke w i is the mechanical power kt i w; where they differ, (kt - ke) i w
watts appear from nowhere, and `imbalance` says how many.
+ current into the first node turns B counter-clockwise (along +axis).
"""

from __future__ import annotations

from math import pi

from ..diagnostics import suggest
from ..units import known_unit, machine_number, machine_number_problem, spice_number
from . import quantities
from .base import LEAVE_OUT, Card, Default, Spec, is_number, limit
from .kinematics import dot, is_zero
from .laws import Relay

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from ..diagnostics import Span
    from .base import JointView, Net, Pen, Powers, Probes, Resistances, Scalar, Scene
    from .laws import Law

MODEL_TYPES = ("dcmotor",)


class Motor(Card):
    spec = Spec(
        "MOTOR",
        "MOTOR name n+ n- joint kt= (or ke=, kv=) [r=] [l=] [j=] [b=] [tc=] [gear=] [radius=] or model=name",
        terminals="plus:node minus:node joint:joint",
        mark=("kt", "ke", "kv", "model"),
        meaning="a direct-current motor, or a voice coil on a slide",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u, w_A: A's own speed about the axis",
            "P": "r i^2 + b w^2 + tc |w|",
            "i": "l di/dt + r i + ke w = v, torque kt i, w = gear u",
        },
        kt=Default(
            None, "N m/A (N/A on a slide without radius)", "torque per ampere; equals ke unless given"
        ),
        ke=Default(None, "V s/rad (V s/m)", "back-EMF per speed; equals kt unless given"),
        r=Default(0.0, "Ohm", "resistance of the winding", least=0.0),
        l=Default(0.0, "H", "inductance of the winding", least=0.0),
        kv=Default(None, "rpm/V", "turns per volt, in place of kt: kt = 60/(2 pi kv)", above=0.0),
        j=Default(
            0.0,
            "kg m^2 (kg)",
            "inertia of the rotor about its axis, on the motor's side of the gear; A carries the stator, "
            "and its mass is that of the motor at rest",
            least=0.0,
        ),
        b=Default(0.0, "N m s/rad (N s/m)", "viscous friction, on the motor's side", least=0.0),
        tc=Default(
            0.0,
            "N m (N)",
            "dry friction of brushes and bearing, on the motor's side; at rest it holds",
            least=0.0,
        ),
        gear=Default(1.0, "", "motor turns per joint turn"),
        radius=Default(None, "m", "radius of the pulley or pinion on a slide", above=0.0),
        model=Default(None, "", "name of a .model of type dcmotor that gives any of these", "word"),
    )
    kt: float | None
    ke: float | None
    kv: float | None
    r: float
    l: float  # noqa: E741
    j: float
    b: float
    tc: float
    gear: float
    radius: float | None
    model: str | None
    plus: int
    minus: int
    joint: JointView
    dry: Relay | None = None  # tc=

    def prepare(self, s: Scene) -> None:
        if self.model is not None and not self._from_model(s):
            self.kt = self.ke = 0.0
        if self.gear == 0.0:
            s.sink.error(
                "E238",
                f"gear= of MOTOR {self.name} cannot be 0: the motor would turn nothing",
                self.place("gear"),
            )
        if self.kv is not None:
            self._from_kv(s)
        if self.kt is None and self.ke is None:
            s.sink.error(
                "E230", f"MOTOR {self.name} needs kt= (torque per ampere)", self.span, self.spec.form
            )
            self.kt = self.ke = 0.0
        self.torque_constant = float(self.kt if self.kt is not None else self.ke or 0.0)
        self.emf_constant = float(self.ke if self.ke is not None else self.kt or 0.0)
        if self.radius is not None and self.joint.rotary:
            s.sink.error(
                "E240",
                f"radius= of MOTOR {self.name} is for a slide; {self.joint.name} is a pin",
                self.place("radius"),
            )
        self.axis = self._rotor_axis()
        self.row = s.branch(self.name)
        on_turning = any(not is_zero(w) for w in s.frame(self.joint.a).spin())
        if self.j and on_turning and not any(self.axis):
            s.sink.error(
                "E240",
                f"MOTOR {self.name} rides on {self.joint.a}, which turns, and the axis of its rotor is not known: "
                f"{self.joint.name} slides out of the xy plane of {self.joint.a}",
                self.place("j"),
                "leave out j= and make the rotor a BODY on a pin, tied to the slide by a GEAR",
            )

    def _rotor_axis(self) -> tuple[float, ...]:
        """In the axes of A, where the rotor's speed is positive: the joint's; of a pinion on a slide z, across the slide."""
        along = self.joint.direction
        if self.radius is None:
            return along
        return (0.0, 0.0, 0.0) if along[2] else (0.0, 0.0, 1.0)

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

    def _from_model(self, s: Scene) -> bool:
        """Take what the card leaves out from its .model; False when there is none."""
        model = s.models.get(self.model or "")
        if model is None or model.type not in MODEL_TYPES:
            what = (
                "no .model" if model is None else f".model {self.model} is of type {model.type}; no dcmotor"
            )
            near = suggest(self.model or "", [name for name, m in s.models.items() if m.type in MODEL_TYPES])
            s.sink.error(
                "E253",
                f"MOTOR {self.name}: {what} named {self.model}",
                self.place("model"),
                f"did you mean {near}?" if near else f".model {self.model} dcmotor kt=.. r=.. makes it",
            )
            return False
        for key, value in model.params.items():
            where = model.param_spans.get(key, model.span)
            if key in self.spec.missing:
                said = f"{key}= of .model {model.name} ({self.spec.missing[key]}) is not supported yet"
                s.sink.error("E254", said, where, LEAVE_OUT)
            elif key not in self.spec.params or key == "model":
                near = suggest(key, self.spec.params)
                s.sink.error(
                    "E231",
                    f".model {model.name} dcmotor does not take {key}=",
                    model.span,
                    f"did you mean {near}=?" if near else f"the form is: {self.spec.form}",
                )
            elif not is_number(value):
                s.sink.error("E232", f"{key}= of .model {model.name} is not a number", model.span)
            elif not self.given(key):
                number = self._checked(s, key, float(value), model.param_spans.get(key))
                setattr(self, key, number)
                limit(self.spec.params[key], key, number, f".model {model.name}", where, s.sink)
        return True

    def _checked(self, s: Scene, key: str, value: float, at: Span | None) -> float:
        """A number of the .model by the rule of machine cards: `value` is SPICE's reading, which ignores units and takes 5kg for
        5 kilo. A unit that both readings understand, 0.3mH, is fine."""
        text = "" if at is None else at.text.partition("=")[2].strip()
        if at is None or spice_number(text) is None:
            return value  # a calculation
        number = machine_number(text)
        if number is None:
            meant = known_unit(text)
            if meant is None or abs(meant - value) > 1e-12 * abs(value):
                said, hint = machine_number_problem(text)
                s.sink.error("E111", said, at, hint)
            return value
        quantities.number_fits(self, key, text, self._motions(), at, s.sink)
        return number

    def _motions(self) -> Sequence[str]:
        return ("turn",) if self.joint.rotary else ("slide",)

    def _speed(self) -> Expr:
        """Speed of the rotor [rad/s]; of the coil [m/s] on a slide without radius."""
        w = self.gear * self.joint.u
        return w if self.radius is None else w * (1.0 / self.radius)

    def _lever(self) -> float:
        return self.gear if self.radius is None else self.gear / self.radius

    def _carried(self, s: Scene) -> Scalar:
        """Speed of the stator: A's turn about the rotor's axis, or its way along that of a coil."""
        carrier = s.frame(self.joint.a)
        if self.joint.rotary or self.radius is not None:
            return dot(carrier.spin(), self.axis)
        return dot(carrier.point(self.joint.pa).vel, carrier.direction(self.axis))

    def kinetic(self, s: Scene) -> Scalar | None:
        if not self.j:
            return None
        w = self._speed() + self._carried(s)
        return 0.5 * self.j * w * w

    def laws(self, s: Scene) -> list[Law]:
        if not self.tc:
            return []
        turns = self.joint.rotary or self.radius is not None
        self.dry = Relay(self._speed(), self.tc, self.tc, "N m" if turns else "N")
        return [self.dry]

    def powers(self, s: Scene) -> Powers:
        i, w = s.b.x(self.row), self._speed()
        result: Powers = [(self.torque_constant * i, w)]
        if self.b:
            result.append((-self.b * w, w))
        return result

    def stamp(self, s: Scene) -> None:
        i = s.b.x(self.row)
        s.add_f(self.plus, i)
        s.add_f(self.minus, -i)
        s.add_f(self.row, self.r * i + self.emf_constant * self._speed() - s.v(self.plus, self.minus))
        s.add_q(self.row, self.l * i)

    def thermal(self, s: Scene) -> Resistances:
        return [("", self.r, s.b.x(self.row))] if self.r else []

    def supplied(self, s: Scene) -> Scalar | None:
        """Nothing, where kt and ke are one number."""
        return self.imbalance(s)

    def imbalance(self, s: Scene) -> Scalar | None:
        """Power that appears from nowhere [W]."""
        gain = self.torque_constant - self.emf_constant
        return gain * s.b.x(self.row) * self._speed() if gain else None

    def _effort(self, s: Scene) -> Scalar:
        """On the joint, what the bearing takes left out: times its speed it is the power brought in."""
        dry = 0.0 if self.dry is None else self.dry.effort
        return self._lever() * (self.torque_constant * s.b.x(self.row) - self.b * self._speed() + dry)

    def probes(self, s: Scene) -> Probes:
        i, v = s.b.x(self.row), s.v(self.plus, self.minus)
        found: Probes = {
            "torque" if self.joint.rotary else "force": self._effort(s),
            "i": i,
            "v": v,
            "p": v * i,
        }
        if self.dry is not None:
            found["mode"] = self.dry.mode
        return found

    def losses(self, s: Scene) -> Scalar | None:
        i, w = s.b.x(self.row), self._speed()
        heat = self.r * i * i + self.b * w * w
        return heat if self.dry is None else heat - self.dry.effort * w

    def stored(self, s: Scene) -> Scalar | None:
        i = s.b.x(self.row)
        return 0.5 * self.l * i * i if self.l else None

    def glyph(self, draw: Pen) -> None:
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        i = draw.m.b.x(self.row)
        draw.add(
            "motor", self, **draw.joint(self.joint.name), unit=unit,
            current=draw.channel(f"i({self.name})", "A", i),
            effort=draw.channel(f"{word}({self.name})", unit, self._effort(draw.m)),
        )  # fmt: skip

    def analogue(self, net: Net) -> None:
        """Winding, and an ideal transformer between the worlds: v = ke w, torque = kt i."""
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
