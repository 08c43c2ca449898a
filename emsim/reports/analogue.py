"""The electrical equivalent circuit of a deck's machine, as a plain ngspice deck.

Mobility analogy (Firestone, J. Acoust. Soc. Am. 4 (1933) 249): speed is voltage, force or torque is current.

    mass, inertia   a capacitor to ground         C = m or J          i = C dv/dt   is   F = m dv/dt
    spring          an inductor between bodies    L = 1/k             its current is the force k (q - q0)
    damper          a resistor                    R = 1/c
    gear, lever     an ideal transformer          u1 = n u2, force carried over
    motor           an ideal transformer between the worlds: v = ke omega, torque = kt i
                    (in the impedance analogy, where force is voltage, the same motor is a gyrator)
    coordinate      the charge of a 1 F capacitor fed with the speed: v(q_hinge) is angle(hinge)

Every body of a one-dimensional machine is one node: bodies on pins about one axis, or on slides along one line. What has
more dimensions has no such circuit and is refused by name. The deck starts from emsim's own starting point (`uic`).
"""

from __future__ import annotations

from ..analyses import transients
from ..assemble.scene import FREE
from ..diagnostics import ConvergenceError, DeckError, Diagnostic
from ..expr import SIGNAL, Binary, Call, Cond, Name, Node, Num, Unary, names, to_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..analyses import Analysis
    from ..assemble import Assembly
    from ..assemble.machine import Machine
    from ..assemble.scene import JointState
    from ..cards.base import Card
    from ..deck import Model, Waveform
    from ..elements import Element

GROUND = "0"
PLACES = ("x", "y", "vx", "vy")


def deck(assembly: Assembly, planned: Sequence[Analysis]) -> str:
    """The text of the analogue. DeckError E311 where a card has no one-dimensional analogue."""
    tran = next(iter(transients(planned)), None)
    net = Net(assembly, tran is not None and tran.uic, tran.tstep if tran is not None else 1e-6)
    net.circuit()
    net.machine()
    return net.text(planned)


class Net:
    """Lines of the analogue; cards add theirs in `analogue(net)`. Nodes of the machine: w_BODY (a turn) and
    u_BODY (a slide) carry speeds, q_JOINT the coordinates."""

    def __init__(self, assembly: Assembly, uic: bool, tstep: float) -> None:
        self.assembly = assembly
        self.flat = assembly.flat
        found, self.x, why = assembly.system.start(assembly.options, uic, tstep)
        if not found:
            from ..analyses.failure import explain_failure

            raise ConvergenceError(explain_failure(assembly, None, why or {}))
        # what the start's Newton left of a zero is no initial value
        self.x = [0.0 if abs(value) < 1e-15 else value for value in self.x]
        self.lines: list[str] = []
        self.initial: dict[str, float] = {}
        self.guide: list[tuple[str, str]] = []
        self.coordinates: set[str] = set()
        self.m: Machine | None = assembly.machine
        self.bodies: dict[str, str] = {GROUND: GROUND}
        if self.m is not None:
            for name, body in self.m.bodies.items():
                if body.fixed:
                    self.bodies[name] = GROUND
            for joint in self._outward():
                self._place(joint)

    # what cards ask for -----------------------------------------------------------------------------------

    def add(self, line: str, why: str = "") -> None:
        self.lines.append(f"{line:<54} ; {why}" if why else line)

    def across(self, joint: str) -> tuple[str, str]:
        """The nodes of B and A of a joint: its speed is v(B) - v(A)."""
        j = self._joint(joint)
        return self.bodies[j.b], self.bodies[j.a]

    def coordinate(self, joint: str) -> str:
        """The voltage that is a joint's coordinate, as text; its node is made when first asked for."""
        if joint not in self.coordinates:
            self.coordinates.add(joint)
            b, a = self.across(joint)
            word, unit = ("angle", "rad") if self._joint(joint).rotary else ("pos", "m")
            self.add(
                f"Cq_{plain(joint)} q_{plain(joint)} 0 1", f"{word}({joint}) is the integral of its speed"
            )
            self.add(f"Gq_{plain(joint)} 0 q_{plain(joint)} {b} {a} 1")
            self.initial[f"q_{plain(joint)}"] = self.value(joint)[0]
            self.guide.append((f"v(q_{plain(joint)})", f"{word}({joint}) [{unit}]"))
        return f"v(q_{plain(joint)})"

    def value(self, joint: str) -> tuple[float, float]:
        """Coordinate and speed of a joint at the start."""
        j, m = self._joint(joint), self.m
        assert m is not None
        q, u = self.assembly.system.values([m.public(j.q), m.public(j.u)], self.x, 0.0)
        return q, u

    def attitude(self, body: str) -> str:
        """The angle of a body from world x, as text."""
        assert self.m is not None
        step = next((s for s in self.m.plan.steps if s.child == body), None)
        if step is None:
            return (
                repr(float(self.m.bodies[body].angle))
                if body in self.m.bodies and self.m.bodies[body].angle
                else "0"
            )
        j = self.m.joints[step.joint]
        sign = -1.0 if j.card.direction[2] < 0.0 else 1.0
        own = f"{self.coordinate(j.name)}+({j.card.zeros[0]!r})" if j.rotary else "0"
        base = self.attitude(step.parent)
        return (f"{base}+" if base != "0" else "") + (own if sign > 0 else f"-({own})")

    def node(self, body: str) -> str:
        """The node of a body's speed."""
        return self.bodies[body]

    def terminal_node(self, card: Card, label: str) -> str:
        """The electrical node that a terminal of a card names."""
        return plain(next(ref.name for name, _, ref in card.terminals if name == label))

    def located(self, card: Card, label: str) -> tuple[str, tuple[float, ...]]:
        """(body, point) that a point terminal names."""
        assert self.m is not None
        ref = next(ref for name, _, ref in card.terminals if name == label)
        found = self.m.locate(ref.name, None if ref.point is None else tuple(float(v) for v in ref.point))
        assert found is not None
        return found

    def initial_current(self, name: str) -> float:
        row = self.assembly.ctx.branches.get(name, -1)
        return self.x[row] if row >= 0 else 0.0

    @property
    def gravity(self) -> tuple[float, float, float]:
        return self.m.gravity if self.m is not None else (0.0, 0.0, 0.0)

    def lever(self, body: str, point: tuple[float, ...]) -> tuple[float, float]:
        """A point of a pinned body from its axis, body axes."""
        assert self.m is not None
        step = next(s for s in self.m.plan.steps if s.child == body)
        j = self.m.joints[step.joint]
        at = j.pa if step.backward else j.pb
        return point[0] - at[0], point[1] - at[1]

    def voltage(self, node: str, value: Any, factor: float) -> None:
        """A node held at factor times a number, expression or waveform."""
        if isinstance(value, Node):
            self.add(f"B{node} {node} 0 v='{factor!r}*({self.expression(value)})'")
        elif factor == 1.0:
            self.add(f"V{node} {node} 0 {source(value)}")
        else:
            self.add(f"V{node} {node}_1 0 {source(value)}")
            self.add(f"E{node} {node} 0 {node}_1 0 {factor!r}")

    def current(
        self, name: str, into: str, out_of: str, value: Any, why: str = "", factor: float = 1.0
    ) -> None:
        """A source of factor times a number, expression or waveform, from one node into the other."""
        name = plain(name)
        if isinstance(value, Node):
            self.add(f"B{name} {out_of} {into} i='{factor!r}*({self.expression(value)})'", why)
        elif factor == 1.0:
            self.add(f"I{name} {out_of} {into} {source(value)}", why)
        else:
            self.voltage(f"n_{name}", value, 1.0)
            self.add(f"G{name} {out_of} {into} n_{name} 0 {factor!r}", why)

    def turns(self, body: str) -> bool:
        """Is the body's node an angular speed?"""
        return self.bodies[body].startswith("w_")

    def direction(self, body: str) -> tuple[float, float, float]:
        """World direction of a sliding body's speed."""
        assert self.m is not None
        step = next(s for s in self.m.plan.steps if s.child == body)
        x, y, z = self.m.joints[step.joint].card.direction
        return x, y, z

    def moment(self, body: str, point: tuple[float, ...], fx: str, fy: str) -> str:
        """Torque of a force at a point of a pinned body about its axis, as text."""
        assert self.m is not None
        rx, ry = self.lever(body, point)
        step = next(s for s in self.m.plan.steps if s.child == body)
        j = self.m.joints[step.joint]
        angle = self.attitude(body)
        sign = -1.0 if j.card.direction[2] < 0.0 else 1.0
        x = [term for term in (_term(rx, f"cos({angle})"), _term(-ry, f"sin({angle})")) if term]
        y = [term for term in (_term(rx, f"sin({angle})"), _term(ry, f"cos({angle})")) if term]
        parts = [f"({'+'.join(x)})*({fy})"] if x and fy != "0" else []
        parts += [f"-({'+'.join(y)})*({fx})"] if y and fx != "0" else []
        return f"{sign:g}*({''.join(parts) or '0'})"

    def expression(self, ast: Node) -> str:
        """An expression with what it reads of the machine replaced by voltages and currents."""
        for name in names(ast):
            if name.startswith(SIGNAL):
                said = f"`{name.removeprefix(SIGNAL)}` is a signal of a BLOCK, which no circuit has"
                raise DeckError(
                    Diagnostic("error", "E311", said, ast.span, "compare the circuit without its controller")
                )
        return to_text(self._translate(ast))

    def refuse(self, card: Card, why: str = "has no counterpart in a circuit") -> None:
        said = f"{card.spec.word} {card.name} {why}"
        hint = (
            "an analogue exists for machines of one dimension: rotors, gears, springs, dampers, motors, pots"
        )
        raise DeckError(Diagnostic("error", "E311", said, card.span, hint))

    # the deck ---------------------------------------------------------------------------------------------

    def machine(self) -> None:
        if self.m is None:
            return
        self.add("*")
        self.add("* ---- the machine: speed is voltage, force and torque are currents")
        for card in self.m.active:
            card.analogue(self)
        # everything that the deck reads or prints shall be there to be looked at
        for name, joint in self.m.joints.items():
            if len(joint.qs) == 1:
                self.coordinate(name)

    def circuit(self) -> None:
        """The electrical elements, flat, parameters evaluated."""
        for element in self.assembly.ctx.elements.values():
            self.add(element.analogue(self))
        models = [e.model_for_ngspice for e in self.flat.elements]
        for model in {m.name: m for m in models if m is not None}.values():
            self.add(_model(model))

    def text(self, planned: Sequence[Analysis]) -> str:
        out = [f"{self.flat.title} (electrical analogue)"]
        out += ["* Speed is voltage, force and torque are currents. Read in this deck:"]
        out += [f"*   {name:<20} is {what}" for name, what in self.guide]
        out += self.lines
        for node in self.assembly.ctx.nodes:
            self.initial.setdefault(plain(node), self._node(node))
        entries = [f"v({node})={value!r}" for node, value in self.initial.items()]
        out += ["*", "* ---- the start is emsim's"]
        out += [".ic " + " ".join(entries[k : k + 3]) for k in range(0, len(entries), 3)]
        for t in transients(planned):
            tmax = t.tmax or min(t.tstep, (t.tstop - t.tstart) / 1000)
            out.append(f".tran {t.tstep!r} {t.tstop!r} {t.tstart!r} {tmax!r} uic")
        return "\n".join([*out, ".end", ""])

    def _node(self, node: str) -> float:
        row = self.assembly.ctx.nodes[node]
        return self.x[row] if row >= 0 else 0.0

    # bodies and joints ------------------------------------------------------------------------------------

    def _outward(self) -> list[JointState]:
        """Tree joints from ground on."""
        assert self.m is not None
        if self.m.plan.cut:
            self.refuse(
                self.m.joints[self.m.plan.cut[0]].card, "closes a loop: the machine is not one-dimensional"
            )
        for name, body in self.m.bodies.items():
            if name in self.m.roots or f"{FREE}{name}" in self.m.joints:
                self.refuse(body, "is free: it has more than one coordinate")
        return [self.m.joints[step.joint] for step in self.m.plan.steps]

    def _place(self, j: JointState) -> None:
        """The node of the body that a joint carries."""
        assert self.m is not None
        step = next(s for s in self.m.plan.steps if s.joint == j.name)
        parent, child = step.parent, step.child
        if j.kind.carries == "weld":
            self.bodies[child] = self.bodies[parent]
            return
        if not j.kind.carries:
            self.refuse(j.card, f"is a {j.kind.name}; pins and slides have one coordinate")
        kind = "w_" if j.rotary else "u_"
        if self.bodies[parent] != GROUND:
            above = next(s for s in self.m.plan.steps if s.child == parent)
            axis = self.m.joints[above.joint].card.direction
            far = (j.pa if not step.backward else j.pb) if j.rotary else ()
            near = self.m.joints[above.joint].pa if above.backward else self.m.joints[above.joint].pb
            if not self.bodies[parent].startswith(kind) or axis != j.card.direction or (far and far != near):
                self.refuse(j.card, f"moves on {parent} in another direction, or about another axis")
        self.bodies[child] = kind + plain(child)
        own = self.value(j.name)[1] * (-1.0 if step.backward else 1.0)
        self.initial[self.bodies[child]] = self.initial.get(self.bodies[parent], 0.0) + own
        unit = "rad/s" if j.rotary else "m/s"
        self.guide.append((f"v({self.bodies[child]})", f"the speed of {child} [{unit}]"))

    def _joint(self, name: str) -> JointState:
        assert self.m is not None
        return self.m.joints[name]

    # expressions ------------------------------------------------------------------------------------------

    def _translate(self, node: Any) -> Any:
        if isinstance(node, Call):
            return self._call(node)
        if isinstance(node, Binary):
            return Binary(node.op, self._translate(node.a), self._translate(node.b))
        if isinstance(node, Unary):
            return Unary(node.op, self._translate(node.a))
        if isinstance(node, Cond):
            return Cond(self._translate(node.c), self._translate(node.a), self._translate(node.b))
        if isinstance(node, Name) and node.id == "pi":
            return Num(3.141592653589793)
        return node

    def _call(self, call: Call) -> Node:
        """angle(j) pos(j) -> v(q_j); omega(j) vel(j) -> v(B) - v(A); the rest stays."""
        name = call.args[0].id if len(call.args) == 1 and isinstance(call.args[0], Name) else ""
        joints = self.m.joints if self.m is not None else {}
        couplings = self.m.couplings if self.m is not None else {}
        if call.fn in ("angle", "pos") and name in joints:
            self.coordinate(name)
            return Call("v", [Name(f"q_{plain(name)}")])
        if call.fn in ("omega", "vel") and name in joints:
            b, a = self.across(name)
            return Binary("-", _volts(b), _volts(a))
        if call.fn in PLACES and (place := self._place_of(call)) is not None:
            return place
        if call.fn in ("deg", "rpm"):
            factor = 57.29577951308232 if call.fn == "deg" else 9.549296585513721
            return Binary("*", Num(factor), self._translate(call.args[0]))
        if call.fn == "i" and name in couplings:
            return Call("i", [Name(f"vs_{plain(name)}")])
        if call.fn in ("i", "v") and name in self.assembly.ctx.elements:
            return Call(call.fn, [Name(self.name_of(name))])
        if self.m is not None and name and (name in joints or name in couplings or name in self.m.bodies):
            raise DeckError(
                Diagnostic(
                    "error",
                    "E311",
                    f"{call.fn}({name}) has no counterpart in the analogue",
                    call.span,
                    "there are angle pos omega vel of joints and i of motors",
                )
            )
        if call.fn == "v":
            return Call("v", [Name(plain(to_text(a))) for a in call.args])
        return Call(call.fn, [self._translate(a) for a in call.args])

    def _place_of(self, call: Call) -> Node | None:
        """x y of a point, and vx vy, on a body that turns or slides; None where the name is no point."""
        m = self.m
        arg = call.args[0] if len(call.args) == 1 else None
        if m is None or arg is None:
            return None
        name = arg.fn if isinstance(arg, Call) else to_text(arg)
        local = tuple(a.value for a in arg.args if isinstance(a, Num)) if isinstance(arg, Call) else None
        found = m.locate(name, local)
        if found is None:
            return None
        body, point = found
        axis = 0 if call.fn.endswith("x") else 1
        rate = call.fn.startswith("v")
        if self.bodies[body] == GROUND:
            return Num(0.0) if rate else Num(m.frames[body].point(point).pos[axis])  # type: ignore[arg-type]
        speed = _volts(self.bodies[body])
        if not self.turns(body):
            along = self.direction(body)[axis]
            if rate:
                return Binary("*", Num(along), speed)
            terms, base, at = [], body, list(point)
            while base != GROUND and self.bodies[base] != GROUND:
                step = next(s for s in m.plan.steps if s.child == base)
                j, sign = m.joints[step.joint], -1.0 if step.backward else 1.0
                near, far = (j.pb, j.pa) if step.backward else (j.pa, j.pb)
                self.coordinate(j.name)
                moved = Binary("+", Name(f"v(q_{plain(j.name)})"), Num(j.card.zeros[0]))
                terms.append(Binary("*", Num(sign * j.card.direction[axis]), moved))
                at = [p - f + n for p, f, n in zip(at, far, near, strict=True)]
                base = step.parent
            total: Node = Num(at[axis])
            for term in terms:
                total = Binary("+", total, term)
            return total
        rx, ry = self.lever(body, point)
        angle = Name(f"({self.attitude(body)})")
        step = next(s for s in m.plan.steps if s.child == body)
        j = m.joints[step.joint]
        pivot = m.frames[body].point(j.pa if step.backward else j.pb).pos[axis]
        turn = {"x": (rx, -ry), "y": (ry, rx), "vx": (-ry, -rx), "vy": (rx, -ry)}[call.fn]
        arm = Binary(
            "+",
            Binary("*", Num(turn[0]), Call("cos", [angle])),
            Binary("*", Num(turn[1]), Call("sin", [angle])),
        )
        if rate:
            sign = -1.0 if j.card.direction[2] < 0.0 else 1.0
            return Binary("*", Binary("*", Num(sign), speed), arm)
        return Binary("+", Num(float(pivot)), arm)  # type: ignore[arg-type]

    # elements: what their `analogue` asks for ------------------------------------------------------------

    def name_of(self, name: str) -> str:
        """ngspice's name of an element: it begins with the letter."""
        e = self.assembly.ctx.elements[name]
        name = plain(e.name)
        return name if name[:1].lower() == e.letter else f"{e.letter.upper()}{name}"

    def head(self, e: Element) -> str:
        """Name and nodes."""
        return " ".join([self.name_of(e.name), *map(plain, e.nodes)])

    def plain(self, node: str) -> str:
        return plain(node)

    def parameters(self, e: Element) -> str:
        return "".join(f" {k}={_number(v)}" for k, v in e.params.items() if k not in ("ic", "off"))

    def wave(self, w: Waveform) -> str:
        return wave(w)


def _term(factor: float, text: str) -> str:
    return f"({factor!r})*{text}" if factor else ""


def plain(name: str) -> str:
    """x1.arm -> x1_arm"""
    return name.replace(".", "_")


def _volts(node: str) -> Node:
    return Num(0.0) if node == GROUND else Call("v", [Name(node)])


def _number(value: Any) -> str:
    return f"({','.join(map(repr, value))})" if isinstance(value, (tuple, list)) else repr(value)


def _row(value: Any) -> str:
    """A parameter of a .model, where brackets are read as nothing: a matrix of coupled lines is a row of numbers."""
    return " ".join(map(repr, value)) if isinstance(value, list) else _number(value)


def source(value: Any) -> str:
    """A number or waveform as ngspice writes it in a source."""
    return wave(value) if hasattr(value, "kind") else repr(float(value))


def wave(w: Waveform) -> str:
    """PULSE(..), SIN(..), ... as ngspice reads them."""
    params = "".join(f" {key}={float(value)!r}" for key, value in w.params.items())
    return f"{w.kind}({' '.join(repr(float(a)) for a in w.args)}){params}"


def _model(model: Model) -> str:
    return f".model {model.name} {model.type}({' '.join(f'{k}={_row(v)}' for k, v in model.params.items())})"
