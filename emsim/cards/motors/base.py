"""What the machines of MOTOR share: a rotor on a joint, parameters from a .model, windings with one co-energy.

Rotor, with w its speed against the stator (`gear` times the joint's, on a slide with radius= over radius) and w_A the turn of A,
which carries the stator, about the same axis:
    T = j/2 (w + w_A)^2,  power into the machine -b w^2, and friction of at most tc against w
Windings: one scalar W'(i, th) of the independent currents i and the rotor's angle th, resistances r, and gyrators G(i), which are
voltages of windings that turn against the axes they are written in:
    row of a current     d/dt dW'/di + d/di sum r i_ph^2/2 + G w - d/di sum v_ph i_ph = 0
    torque               dW'/dth + sum G i - dV/dth           (V: cogging)
What magnets link at i = 0 is taken out of dW'/di and stands as its rate, their voltage: what is kept is then small where the
current is, and an operating point with a turning rotor shows that voltage. What goes in is what is stored, what heats and what
turns, whatever W' and G are:    v i = d/dt (i dW'/di - W') + r i^2 + torque w.
The unknowns are currents, what is kept is flux linkage: no division by dW'/di^2 where iron saturates.
A phase is what stands between two terminals; its current is a sum of independent ones. In a star without neutral these are the
currents of a and b, and i_c = -i_a - i_b: the star point needs no unknown.
"""

from __future__ import annotations

from math import sqrt

from ...diagnostics import suggest
from ...units import known_unit, machine_number, machine_number_problem, spice_number
from .. import quantities
from ..base import Default, is_number, limit
from ..domains.warmth import WARM, Warm
from ..kinematics import dot, is_zero
from ..laws import Relay

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..._engine import Expr
    from ...deck import MachineCard, Model
    from ...diagnostics import Span
    from ..base import Card, JointView, Pen, Powers, Probes, Resistances, Scalar, Scene
    from ..laws import Law

# of every rotor
SHAFT: dict[str, Any] = {
    "j": Default(
        0.0,
        "kg m^2 (kg)",
        "inertia of the rotor about its axis, on the motor's side of the gear; A carries the stator, "
        "and its mass is that of the motor at rest",
        least=0.0,
    ),
    "b": Default(0.0, "N m s/rad (N s/m)", "viscous friction, on the motor's side", least=0.0),
    "tc": Default(0.0, "N m (N)", "dry friction of brushes and bearing, on the motor's side; at rest it holds", least=0.0),
    "gear": Default(1.0, "", "motor turns per joint turn"),
    "radius": Default(None, "m", "radius of the pulley or pinion on a slide", above=0.0),
    **WARM,
    "model": Default(None, "", "name of the .model that gives any of these", "word"),
}  # fmt: skip


class Machine(Warm):
    """A rotor on a joint; its parameters stand on the card or in a .model of type `type`."""

    of_type = ""
    needs: tuple[str, ...] = ()  # parameters without which it is none, on the card or in the .model
    j: float
    b: float
    tc: float
    gear: float
    radius: float | None
    model: str | None
    joint: JointView
    dry: Relay | None = None  # tc=

    @classmethod
    def variant(cls, raw: MachineCard, models: dict[str, Model]) -> type[Card]:
        """The class of a MOTOR: by the type of its .model."""
        from . import MODELS

        model = models.get(str(raw.params.get("model", "")))
        return cls if model is None else MODELS.get(model.type, cls)

    def prepare(self, s: Scene) -> None:
        self._read_model(s)
        self.warm_up(s)
        if self.gear == 0.0:
            said = f"gear= of MOTOR {self.name} cannot be 0: the motor would turn nothing"
            s.sink.error("E238", said, self.place("gear"))
        if self.radius is not None and self.joint.rotary:
            said = f"radius= of MOTOR {self.name} is for a slide; {self.joint.name} is a pin"
            s.sink.error("E240", said, self.place("radius"))
        self.axis = self._rotor_axis()
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

    # parameters ---------------------------------------------------------------------------------------

    def _read_model(self, s: Scene) -> None:
        """Take what the card leaves out from its .model; what is needed and given nowhere becomes 1 after its message."""
        if self.model is not None:
            self._from_model(s)
        self._ask(s)

    def _ask(self, s: Scene) -> None:
        for key in self.needs:
            if getattr(self, key) is None:
                p = self.spec.params[key]
                where = f", in .model {self.model}" if self.model else ""
                s.sink.error(
                    "E230", f"MOTOR {self.name} needs {key}= ({p.meaning}, {p.unit}){where}", self.span, self.spec.form
                )  # fmt: skip
                setattr(self, key, 1.0)

    def said(self, s: Scene, key: str) -> bool:
        """Was the parameter written, on the card or in its .model?"""
        model = s.models.get(self.model or "")
        return self.given(key) or (model is not None and key in model.params)

    def _from_model(self, s: Scene) -> None:
        from . import MODELS

        model = s.models.get(self.model or "")
        if model is None or model.type not in MODELS:
            types = ", ".join(MODELS)
            what = "no .model" if model is None else f".model {self.model} is of type {model.type}; no motor"
            near = suggest(self.model or "", [name for name, m in s.models.items() if m.type in MODELS])
            s.sink.error(
                "E253",
                f"MOTOR {self.name}: {what} named {self.model}",
                self.place("model"),
                f"did you mean {near}?"
                if near
                else f".model {self.model} dcmotor kt=.. r=.. makes it; types are: {types}",
            )
            for key in self.needs:
                setattr(self, key, 1.0)
            return
        for key, value in model.params.items():
            where = model.param_spans.get(key, model.span)
            param = self.spec.params.get(key)
            if param is None or key == "model" or param.kind == "heat":
                near = suggest(key, self.spec.params)
                s.sink.error(
                    "E231",
                    f".model {model.name} {model.type} does not take {key}=",
                    where,
                    f"did you mean {near}=?"
                    if near
                    else f"it takes: {', '.join(k for k in self.spec.params if k != 'model')}",
                )
            elif param.kind == "word":
                if str(value) not in param.words:
                    said = f"{key}= of .model {model.name} is one of: {', '.join(param.words)}"
                    s.sink.error("E232", said, where)
                elif not self.given(key):
                    setattr(self, key, str(value))
            elif not is_number(value):
                s.sink.error("E232", f"{key}= of .model {model.name} is not a number", where)
            elif not self.given(key):
                number = self._checked(s, key, float(value), model.param_spans.get(key))
                setattr(self, key, number)
                limit(param, key, number, f".model {model.name}", where, s.sink)

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
                said, hint, _ = machine_number_problem(text)
                s.sink.error("E111", said, at, hint)
            return value
        quantities.number_fits(self, key, text, self._motions(), at, s.sink)
        return number

    def _motions(self) -> Sequence[str]:
        return ("turn",) if self.joint.rotary else ("slide",)

    def either(self, s: Scene, one: str, other: str, why: str) -> None:
        """An error where both are written: each says it all."""
        if self.said(s, one) and self.said(s, other):
            at = self.place(other if self.given(other) else one)
            s.sink.error(
                "E231", f"MOTOR {self.name} has {one}= and {other}=: {why}", at, "leave one of them out"
            )

    # the rotor ----------------------------------------------------------------------------------------

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

    def drag(self) -> Scalar:
        """Torque of bearing and brushes."""
        dry: Scalar = 0.0 if self.dry is None else self.dry.effort
        return dry - self.b * self._speed() if self.b else dry

    def friction(self) -> Scalar:
        """What bearing and brushes heat [W]."""
        w = self._speed()
        heat = self.b * w * w
        return heat if self.dry is None else heat - self.dry.effort * w

    def effort_word(self) -> tuple[str, str]:
        return ("torque", "N m") if self.joint.rotary else ("force", "N")


class Phase:
    """Between two nodes, -1 for ground or a star point: its resistance, and its current as shares of the independent ones."""

    __slots__ = ("minus", "plus", "r", "shares")

    def __init__(self, plus: int, minus: int, r: float, shares: Sequence[float]) -> None:
        self.plus, self.minus, self.r, self.shares = plus, minus, r, shares

    def current(self, i: Sequence[Expr]) -> Expr:
        terms = [x if k == 1.0 else k * x for k, x in zip(self.shares, i, strict=True) if k]
        return sum(terms[1:], terms[0])


def star(a: int, b: int, c: int, n: int | None, r: float) -> list[Phase]:
    """Three phases; `n` is the node of the star point, None where nothing is connected to it."""
    if n is None:
        return [Phase(a, -1, r, (1, 0)), Phase(b, -1, r, (0, 1)), Phase(c, -1, r, (-1, -1))]
    return [Phase(a, n, r, (1, 0, 0)), Phase(b, n, r, (0, 1, 0)), Phase(c, n, r, (0, 0, 1))]


def clarke(i: Sequence[Expr]) -> tuple[Expr, Expr]:
    """Space vector of three phase currents, as long as their amplitude."""
    a, b, c = i
    return (2.0 * a - b - c) * (1.0 / 3.0), (b - c) * (1.0 / sqrt(3.0))


class Windings(Machine):
    """A machine that a co-energy describes. A kind says `phases`, `coenergy_of`, and where it has them gyrators and cogging."""

    def phases(self) -> list[Phase]:
        raise NotImplementedError

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        """W' [J] of the independent currents, or those of the phases, and the rotor's angle."""
        raise NotImplementedError

    def gyrators(self, s: Scene, i: list[Expr], flux: list[Expr]) -> list[Scalar]:
        """G of every independent current: volts per speed of the rotor."""
        return []

    def cogging(self, s: Scene, th: Expr) -> Scalar | None:
        """Potential energy [J] of rotor and stator without current."""
        return None

    def prepare(self, s: Scene) -> None:
        super().prepare(s)
        b = s.b
        self.parts = self.phases()
        # currents of windings without terminals are nobody's business
        inner = [not (part.plus >= 0 or part.minus >= 0) for part in self.parts]
        count = len(self.parts[0].shares)
        hidden = [all(inner[n] for n, part in enumerate(self.parts) if part.shares[k]) for k in range(count)]
        self.rows = [
            b.unknown(f"{self.name}#{k + 1}", "branch", "A", 0.0)
            if hidden[k]
            else s.branch(f"{self.name},{k + 1}")
            for k in range(count)
        ]
        self.i = [b.x(row) for row in self.rows]
        self.currents = [part.current(self.i) for part in self.parts]
        self.angle = self._lever() * self.joint.q
        th = b.symbol()
        energy = b.const(0.0) + self.coenergy_of(s, self.i, self.currents, th)
        flux = b.grad(energy, self.i)
        magnets = b.substitute(flux, [(i, 0.0) for i in self.i])
        flux = [whole - own if own.value != 0.0 else whole for whole, own in zip(flux, magnets, strict=True)]
        weaker = self.weak - 1.0
        energy = energy + sum(
            (weaker * own * i for own, i in zip(magnets, self.i, strict=True)), b.const(0.0)
        )
        magnets = [self.weak * own for own in magnets]
        induced = [b.grad(own, [th])[0] for own in magnets]
        resting = self.cogging(s, th)
        turning = b.grad(energy if resting is None else energy - resting, [th])[0]
        zero = b.const(0.0)
        linked = sum((own * i for own, i in zip(magnets, self.i, strict=True)), zero)
        quiet = zero if resting is None else zero + resting
        found = b.substitute([energy, energy - linked, quiet, turning, *flux, *induced], [(th, self.angle)])
        self.energy, self.own_energy, self.resting, self.turning = found[:4]
        self.flux, self.induced = found[4 : 4 + len(self.i)], found[4 + len(self.i) :]
        self.volts = self.gyrators(s, self.i, self.flux)
        for g, i in zip(self.volts, self.i, strict=False):
            self.turning = self.turning + g * i

    def coenergy(self, s: Scene) -> Scalar | None:
        return self.energy

    def potential(self, s: Scene) -> Scalar | None:
        return None if self.resting.value == 0.0 else self.resting

    def _gyrated(self, s: Scene) -> Scalar:
        return sum((g * i for g, i in zip(self.volts, self.i, strict=False)), 0.0)

    def powers(self, s: Scene) -> Powers:
        w = self._speed()
        result: Powers = [(self._gyrated(s), w)] if self.volts else []
        if self.b:
            result.append((-self.b * w, w))
        return result

    def stamp(self, s: Scene) -> None:
        for part, i in zip(self.parts, self.currents, strict=True):
            s.add_f(part.plus, i)
            s.add_f(part.minus, -i)
            across = self.hot * part.r * i - s.v(part.plus, part.minus)
            for row, share in zip(self.rows, part.shares, strict=True):
                if share:
                    s.add_f(row, share * across)
        for row, flux in zip(self.rows, self.flux, strict=True):
            s.add_q(row, flux)
        for row, g in (*zip(self.rows, self.volts, strict=False), *zip(self.rows, self.induced, strict=True)):
            s.add_f(row, g * self._speed())
        self.give_heat(s)

    def thermal(self, s: Scene) -> Resistances:
        return [
            (f"r{k + 1}", self.hot * p.r, i)
            for k, (p, i) in enumerate(zip(self.parts, self.currents, strict=True))
            if p.r
        ]

    def input_power(self, s: Scene) -> Expr:
        """What the terminals bring in [W]."""
        pairs = zip(self.parts, self.currents, strict=True)
        return sum((s.v(part.plus, part.minus) * i for part, i in pairs), s.b.const(0.0))

    def probes(self, s: Scene) -> Probes:
        """i of every phase by its number."""
        effort = self._lever() * (self.turning + self.drag())
        found: Probes = {
            self.effort_word()[0]: effort,
            "p": self.input_power(s),
            "power": effort * self.joint.u,
        }
        outer = [
            i for part, i in zip(self.parts, self.currents, strict=True) if part.plus >= 0 or part.minus >= 0
        ]
        found.update({f"i,{k + 1}": i for k, i in enumerate(outer)})
        if self.dry is not None:
            found["mode"] = self.dry.mode
        return found

    def losses(self, s: Scene) -> Scalar | None:
        heat = s.b.const(0.0) + self.friction()
        for part, i in zip(self.parts, self.currents, strict=True):
            if part.r:
                heat = heat + self.hot * part.r * i * i
        return heat

    def stored(self, s: Scene) -> Scalar | None:
        """i dW'/di - W' [J]: nothing for a magnet, whose co-energy is linear in the current."""
        return sum((flux * i for flux, i in zip(self.flux, self.i, strict=True)), -self.own_energy)

    def glyph(self, draw: Pen) -> None:
        """The current is the length of what all phases make, in proportion to one of them."""
        b = draw.m.b
        square = sum((i * i for i in self.currents), b.const(0.0))
        word, unit = self.effort_word()
        shapes: dict[str, Any] = draw.joint(self.joint.name)
        effort = self.probes(draw.m)[word]
        assert not callable(effort)
        draw.add(
            "motor", self, **shapes, unit=unit, model=self.of_type, poles=len(self.parts),
            current=draw.channel(f"|i|({self.name})", "A", b.call("sqrt", square * (2.0 / len(self.parts)))),
            effort=draw.channel(f"{word}({self.name})", unit, effort),
        )  # fmt: skip
