"""TRANSDUCER: one energy, both worlds. From the co-energy W' of the card:

    C={C(q)}   W' = C v^2/2       charge dW'/dv = C v         force dW'/dq = v^2/2 dC/dq
    L={L(q)}   W' = L i^2/2       flux linkage dW'/di = L i   force dW'/dq = i^2/2 dL/dq
    W={w}      W' = w(v(name), q) or w(i(name), q), saturation included
    K={k(q)}   v = k u, power k i u into the machine
Of several windings and joints, in parentheses,  W={w(i(name,1), i(name,2), .., angle(j1), ..)}: every winding has a row with
its flux linkage dW'/di_k, every joint the effort dW'/dq_k. What couples windings, and what turns them, is one function.
v is the voltage from n+ to n-, i the current into n+. C-like cards add their charge to the node rows, L-like
ones have a branch row for the flux linkage; an energy that changes by itself, with time or another voltage, would be work
from nowhere, so it is refused (K= stores none, and may); the force comes with dL/dq of the whole machine, so the pair
cannot be inconsistent.
"""

from __future__ import annotations

from math import inf, isfinite

from .base import Card, Default, Own, Spec, is_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..deck import MachineCard, Model
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Powers, Probes, Scalar, Scene


class Transducer(Card):
    spec = Spec(
        "TRANSDUCER",
        "TRANSDUCER name n+ n- joint C={..} or L={..} or K={..} or W={..}, or name (n1+ n1- n2+ n2- ..) (j1 j2 ..) W={..}",
        terminals="plus:node minus:node joint:joint",
        mark=("c", "l", "k", "w"),
        meaning="a capacitance, inductance or coupling that depends on a joint",
        laws={"W": "C(q) v^2/2 or L(q) i^2/2 or w"},
        c=Default(None, "F", "capacitance as a function of the coordinate", "value"),
        l=Default(None, "H", "inductance as a function of the coordinate", "value"),
        k=Default(None, "V s/m or N/A", "coupling: v = k u, force k i", "value"),
        w=Default(None, "J", "co-energy of v(name) or i(name) and the coordinate", "value"),
    )
    grouped = True
    c: Any
    l: Any  # noqa: E741
    k: Any
    w: Any
    plus: int
    minus: int
    joint: JointView

    @classmethod
    def variant(cls, raw: MachineCard, models: dict[str, Model]) -> type[Card]:
        return Windings if raw.groups else cls

    def check(self, sink: Sink) -> None:
        given = [key for key in ("c", "l", "k", "w") if getattr(self, key) is not None]
        if len(given) != 1:
            sink.error(
                "E252", f"TRANSDUCER {self.name} needs exactly one of C= L= K= W=", self.span, self.spec.form
            )
            return
        self.form = given[0]

    def prepare(self, s: Scene) -> None:
        """Compile the energy once, with the card's own voltage, current and coordinate as free symbols."""
        self.voltage, current, self.coordinate = s.b.symbol(), s.b.symbol(), s.b.symbol()
        self.own = Own(self.name, self.voltage, [current], {self.joint.name: self.coordinate})
        value = s.compile_energy(getattr(self, self.form), self.place(self.form), self.own)
        other = "" if self.form == "k" else s.beyond_coordinates(getattr(self, self.form), value)
        if other:
            of = {"c": "", "l": "", "w": f" v({self.name}) or i({self.name}) and"}[self.form]
            s.sink.error(
                "E252",
                f"{self.form.upper()}= of TRANSDUCER {self.name} is a function of{of} the coordinate; {other} "
                "would do work that nothing supplies",
                self.place(self.form),
                f"write it in terms of the position of {self.joint.name}, and let a DRIVE or a source move what moves by itself",
            )
        self.charge_like = self.form == "c"
        if self.form == "w":
            uses_v, uses_i = s.b.depends(value, self.own.electrical)
            if uses_v == uses_i:
                s.sink.error(
                    "E252",
                    f"W= of TRANSDUCER {self.name} is a function of v({self.name}) or of i({self.name})",
                    self.place("w"),
                )
            self.charge_like = uses_v
        self.row = -1 if self.charge_like else s.branch(self.name)
        # the electrical variable of the co-energy, and what stands for it in the equations
        variable = self.voltage if self.charge_like else current
        actual = s.v(self.plus, self.minus) if self.charge_like else s.b.x(self.row)
        energy = s.b.const(0.0)
        if self.form == "w":
            energy = value
        elif self.form != "k":
            energy = 0.5 * value * variable * variable
        conjugate = s.b.grad(energy, [variable])[0]  # charge or flux linkage
        force = s.b.grad(energy, [self.coordinate])[0]
        places = [(variable, actual), (self.coordinate, self.joint.q)]
        # C or L itself; of a co-energy what a small change of v or i sees
        capacity = s.b.grad(conjugate, [variable])[0]
        self.closed = self._closed(s, s.b.substitute([capacity], [(variable, s.b.const(0.0))])[0])
        real = s.b.substitute([value, energy, conjugate, force, capacity], places)
        self.value, self.energy, self.conjugate, self.effort, self.capacity = real
        self.variable = actual

    def coenergy(self, s: Scene) -> Scalar | None:
        return None if self.form == "k" else self.energy

    def powers(self, s: Scene) -> Powers:
        return [(self.value * s.b.x(self.row), self.joint.u)] if self.form == "k" else []

    def stamp(self, s: Scene) -> None:
        if self.charge_like:
            s.add_q(self.plus, self.conjugate)
            s.add_q(self.minus, -self.conjugate)
            return
        i, v = s.b.x(self.row), s.v(self.plus, self.minus)
        s.add_f(self.plus, i)
        s.add_f(self.minus, -i)
        if self.form == "k":
            s.add_f(self.row, self.value * self.joint.u - v)
        else:
            s.add_f(self.row, -v)
            s.add_q(self.row, self.conjugate)

    def probes(self, s: Scene) -> Probes:
        v = s.v(self.plus, self.minus)
        force = self.value * s.b.x(self.row) if self.form == "k" else self.effort

        def i() -> Expr:
            if not self.charge_like:
                return s.b.x(self.row)
            return s.derivative(f"i({self.name})", "A", self.conjugate)

        word = "torque" if self.joint.rotary else "force"
        return {word: force, "i": i, "v": v, "p": lambda: v * i(), "power": force * self.joint.u}

    def stored(self, s: Scene) -> Scalar | None:
        """Energy = (charge v or flux linkage i) - W' [J]."""
        return None if self.form == "k" else self.conjugate * self.variable - self.energy

    def _closed(self, s: Scene, unsaturated: Expr) -> float | None:
        """Where on a slide the gap is closed: of L = L0 + c/(x0 - q), and of C, that is x0 = q + 2 L'/L'' at any q. None where
        that is no one place: such a coupling has no gap."""
        if self.joint.rotary or self.form == "k":
            return None
        first = s.b.grad(unsaturated, [self.coordinate])[0]
        second = s.b.grad(first, [self.coordinate])[0]

        def away(q: float) -> float:
            slope, bend = s.b.eval(s.b.substitute([first, second], [(self.coordinate, s.b.const(q))]), [])
            far = 2 * slope / bend if bend else inf
            return far if isfinite(far) and slope * far > 0 else 0.0

        # one of these is not in the closed gap itself
        start = next((q for q in (0.0, 1e-3, -1e-3) if away(q)), None)
        if start is None:
            return None
        far = away(start)
        places = [q + away(q) for q in (start, start + 0.3 * far, start - 0.5 * far)]
        return places[0] if max(places) - min(places) < 1e-6 * abs(far) else None

    def glyph(self, draw: Pen) -> None:
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        p = self.probes(draw.m)
        effort = p[word]
        assert not callable(effort)
        draw.add(
            "transducer", self, **draw.joint(self.joint.name), form=self.form, unit=unit,
            closed=self.closed, volts=draw.channel(f"v({self.name})", "V", draw.m.v(self.plus, self.minus)),
            effort=draw.channel(f"{word}({self.name})", unit, effort),
        )  # fmt: skip

    def analogue(self, net: Net) -> None:
        """v = k u, force = k i: an ideal transformer, whose ratio may move; the others are energies."""
        if self.form != "k":
            return net.refuse(self, "is an energy that depends on the coordinate; K= is a transformer")
        b, a = net.across(self.joint.name)
        n = self.name.replace(".", "_")
        plus, minus = net.terminal_node(self, "plus"), net.terminal_node(self, "minus")
        net.add(f"Vs_{n} {plus} {n}_1 0", f"i(Vs_{n}) is i({self.name})")
        if is_number(self.k):
            net.add(f"Ek_{n} {n}_1 {minus} {b} {a} {float(self.k)!r}", "v = k u")
            net.add(f"Fk_{n} {a} {b} Vs_{n} {float(self.k)!r}", "force = k i")
            return None
        k = net.expression(self.k)
        net.add(f"Bk_{n} {n}_1 {minus} v='({k})*v({b},{a})'", "v = k u")
        net.add(f"Bf_{n} {a} {b} i='({k})*i(Vs_{n})'", "force = k i")
        return None


class Windings(Card):
    """TRANSDUCER of several windings and joints."""

    spec = Transducer.spec
    w: Any

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        """As many nodes as the first parentheses have, as many joints as the second."""
        nodes, joints = (*raw.groups, 0)[:2]
        return [[*((f"n{k}", "node") for k in range(nodes)), *((f"j{k}", "joint") for k in range(joints))]]

    def check(self, sink: Sink) -> None:
        what = f"TRANSDUCER {self.name}"
        if len(self.raw.groups) != 2 or not all(self.raw.groups) or self.raw.groups[0] % 2:
            said = f"{what} takes pairs of nodes in its first parentheses and joints in its second"
            sink.error("E233", said, self.span, self.spec.form)
        elif self.w is None or any(self.given(key) for key in "clk"):
            sink.error(
                "E252", f"{what} of several windings needs W=, and no C= L= K=", self.span, self.spec.form
            )

    def prepare(self, s: Scene) -> None:
        windings, joints = self.raw.groups[0] // 2, self.raw.groups[1]
        self.ends: list[tuple[int, int]] = [
            (getattr(self, f"n{2 * k}"), getattr(self, f"n{2 * k + 1}")) for k in range(windings)
        ]
        self.joints: list[JointView] = [getattr(self, f"j{k}") for k in range(joints)]
        if len({joint.name for joint in self.joints}) < joints:
            said = f"TRANSDUCER {self.name} names a joint twice"
            s.sink.error("E237", said, self.span, "each joint once: its energy is one function of it")
        currents = [s.b.symbol() for _ in self.ends]
        coordinates = {joint.name: s.b.symbol() for joint in self.joints}
        energy = s.compile_energy(self.w, self.place("w"), Own(self.name, None, currents, coordinates))
        other = s.beyond_coordinates(self.w, energy)
        if other:
            said = f"W= of TRANSDUCER {self.name} is of its currents and coordinates; {other} would do work that nothing supplies"
            hint = "write it in terms of i(name,k) and the joints named on the card"
            s.sink.error("E252", said, self.place("w"), hint)
        for k, used in enumerate(s.b.depends(energy, currents)):
            if not used:
                said = f"W= of TRANSDUCER {self.name} does not depend on i({self.name},{k + 1}): that winding is a short circuit"
                s.sink.error(
                    "E252", said, self.place("w"), "leave its nodes out, or write its part of the energy"
                )
        self.rows = [s.branch(f"{self.name},{k + 1}") for k in range(windings)]
        self.i = [s.b.x(row) for row in self.rows]
        flux = s.b.grad(energy, currents)
        efforts = s.b.grad(energy, [coordinates[joint.name] for joint in self.joints])
        places = [*zip(currents, self.i, strict=True), *((coordinates[j.name], j.q) for j in self.joints)]
        real = s.b.substitute([energy, *flux, *efforts], places)
        self.energy, self.flux, self.efforts = real[0], real[1 : 1 + windings], real[1 + windings :]

    def coenergy(self, s: Scene) -> Scalar | None:
        return self.energy

    def stamp(self, s: Scene) -> None:
        for (plus, minus), row, i, flux in zip(self.ends, self.rows, self.i, self.flux, strict=True):
            s.add_f(plus, i)
            s.add_f(minus, -i)
            s.add_f(row, -s.v(plus, minus))
            s.add_q(row, flux)

    def probes(self, s: Scene) -> Probes:
        """i of every winding; the effort on every joint, torque(name,2) that on the second."""
        turned = s.b.const(0.0)
        power = sum((s.v(*ends) * i for ends, i in zip(self.ends, self.i, strict=True)), turned)
        found: Probes = {f"i,{k + 1}": i for k, i in enumerate(self.i)}
        for k, (joint, effort) in enumerate(zip(self.joints, self.efforts, strict=True)):
            part = f",{k + 1}" if len(self.joints) > 1 else ""
            found[f"{'torque' if joint.rotary else 'force'}{part}"] = effort
            turned = turned + effort * joint.u
        return {**found, "p": power, "power": turned}

    def stored(self, s: Scene) -> Scalar | None:
        return sum((flux * i for flux, i in zip(self.flux, self.i, strict=True)), -self.energy)

    def glyph(self, draw: Pen) -> None:
        for joint, effort in zip(self.joints, self.efforts, strict=True):
            word, unit = ("torque", "N m") if joint.rotary else ("force", "N")
            draw.add(
                "transducer", self, **draw.joint(joint.name), form="w", of="A", unit=unit,
                volts=draw.channel(f"i({self.name},1)", "A", self.i[0]),
                effort=draw.channel(f"{word}({self.name}) {joint.name}", unit, effort),
            )  # fmt: skip
