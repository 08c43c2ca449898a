"""The machine of a deck: cards -> graph -> coordinates -> frames -> loops -> rows of equation (1).

Life cycle:
    m = Machine(ctx)      binds the cards to their specifications
    m.build()             tree, coordinates, frames, loops, branches, start; the circuit's nodes and branches
                          are known, no element has contributed yet
    m.contribute()        energies, powers, loops -> rows; after the elements
    m.probe(fn, args, span)   any time, from Context.compile
    m.default_outputs()   names of what is recorded when nothing is asked for
    m.report()            facts for `emsim check`
Errors are reported to ctx.sink; after an error `broken` is set, probes answer 0 and contribute() does
nothing. `imbalances` [(name, power Expr)] are powers that appear from nowhere; `flag_warnings` {flag name:
text} are said when such a flag turns 1 during a run. The machine is the scene `s` that cards see
(cards/base.py).
"""

from __future__ import annotations

from math import isfinite

from ..cards.coordinate import OnJointOrPoints
from ..expr import Node, names
from . import closing, coordinates, equations, loops, prescribed, probes, reactions, start
from .binding import Binding
from .kinematics import constant, dot, is_zero, subtract
from .loops import Row
from .scene import JointState, leaves_plane, place
from .tree import Edge, plan

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..cards.base import Card, Own, PointView, Scalar
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from ..diagnostics import Span
    from .context import Context
    from .coordinates import Tie
    from .kinematics import Frame
    from .scene import Coordinate, Virtual
    from .start import Start
    from .tree import Plan


class Machine(Binding):
    """All mechanical cards of a deck and what the compiler makes of them."""

    def __init__(self, ctx: Context) -> None:
        super().__init__(ctx)
        self.active: list[Card] = []  # everything that contributes
        # the scene
        self.plan: Plan
        self.roots: dict[str, list[Coordinate]] = {}
        self.own: list[Coordinate] = []
        self.given: list[Coordinate] = []
        self.jumping: set[str] = set()  # drives whose speed jumps
        self.ties: dict[int, Tie] = {}
        self.virtuals: list[Virtual] = []
        self.pairs: list[tuple[Expr, Expr]] = []  # symbols and what they stand for
        self.frames: dict[str, Frame] = {}
        self.rows: list[Row] = []
        self.folded = 0
        self.found: Start
        # the equations
        self.kinetic: Expr = self.b.const(0.0)
        self.momenta: list[Expr] = []
        self.efforts: list[tuple[Card, Scalar, Scalar]] = []  # of all powers: effort and flow
        self.momentum: dict[int, tuple[Expr, Expr]] = {}
        self.operations = 0
        # reading
        self.wanted = reactions.wanted(ctx.flat)
        self.derivatives: dict[str, int] = {}
        self.waiting: list[tuple[int, Any]] = []
        self.busy: set[str] = set()
        self.own_symbols: Own | None = None
        self.imbalances: list[tuple[str, Expr]] = []
        self.flag_warnings: dict[str, str] = {}
        self.clamps: list[tuple[Expr, float, float, str, str]] = []
        self._waves: dict[int, Expr] = {}  # of the deck's waveforms, by identity
        self._last_row = -1
        ctx.machine = self  # expressions compiled on the way read it

    # building -------------------------------------------------------------------------------------

    def build(self) -> None:
        """Everything up to the start; allocates all unknowns of the machine."""
        errors = self._errors()
        if self.broken:
            return
        self._graph()
        self._check_space()
        rows_of = coordinates.drives_and_gears(self)
        if not self.broken and self._errors() == errors:
            reactions.prepare(self)
            coordinates.allocate(self, self.all_coordinates())
            self.frames = self._place()
            self._last_row = self._newest()
            prescribed.prescribe(self)
            self._close(*rows_of)
            self._couple()
        if self.broken or self._errors() > errors:
            self.broken = True
            return
        self.kinetic = equations.kinetic(self)
        speeds = [self.b.x(c.speed_row) for c in self.own]
        self.momenta = self.public_all(self.b.grad(self.kinetic, speeds)) if speeds else []
        self.found = start.assemble(self)
        self._check_start()
        self.broken = self._errors() > errors
        if self.broken:
            return
        for row in self.rows:
            label = f"{row.owner},{row.place + 1}"
            row.row = self.b.unknown(f"lambda({label})", "lambda", row.unit, 0.0)
            row.mu_row = self.b.unknown(f"mu({label})", "mu", "", 0.0)
        self._locked_note()
        self._gravity_note()

    def _errors(self) -> int:
        return sum(1 for d in self.sink.diagnostics if d.severity == "error")

    def _graph(self) -> None:
        edges = [Edge(j.name, j.a, j.b, j.card.cut or j.kind == "rod") for j in self.joints.values()]
        fixed = {name for name, body in self.bodies.items() if body.fixed}
        self.plan = plan(list(self.bodies), fixed, edges)
        for name in self.plan.cut:
            self.joints[name].cut = True
        for step in self.plan.steps:
            joint = self.joints[step.joint]
            joint.coordinates = coordinates.of_joint(joint)
        self.roots = {name: coordinates.of_free_body(self.bodies[name]) for name in self.plan.roots}
        for name, body in self.bodies.items():
            extra = [k for k in ("x", "y", "angle", "vx", "vy", "omega") if body.given(k)]
            if body.fixed:
                extra = [k for k in extra if k in ("vx", "vy", "omega") and getattr(body, k) != 0.0]
            if extra and name not in self.roots:
                why = "it is fixed" if body.fixed else "its joints say where it is"
                self.sink.warning(
                    "W232",
                    f"{extra[0]}= of BODY {name} has no effect: {why}",
                    body.place(extra[0]),
                    hint="leave out fixed=yes, and a joint or nothing holds the body"
                    if body.fixed
                    else "ic= or guess= of the joint sets the start",
                )

    def _check_space(self) -> None:
        """Free bodies and one-number inertias are for planar scenes."""
        out = next((j for j in self.joints.values() if leaves_plane(j)), None)
        if out is None and not self.gravity[2]:
            return
        why = f"joint {out.name} leaves the plane" if out is not None else "gravity has a z component"
        for name in self.roots:
            self._fail(
                "E247",
                f"body {name} is free and {why}: free bodies in space are not supported yet",
                self.bodies[name].span,
                "tie it to ground through joints",
            )
        for joint in self.joints.values():
            if joint.kind == "free":
                self._fail(
                    "E247", f"free joint {joint.name} in space is not supported yet ({why})", joint.card.span
                )

    def all_coordinates(self) -> list[Coordinate]:
        """All of them in deck order: joints, then free bodies."""
        result = [c for joint in self.joints.values() for c in joint.coordinates]
        return result + [c for cs in self.roots.values() for c in cs]

    def _place(self) -> dict[str, Frame]:
        return place(self.b, self.plan, self.joints, self.roots, self._fixed())

    def _measure(self, joint: JointState) -> list[Expr]:
        """The coordinates of a cut joint."""
        return loops.measure(self.b, joint, self.frames[joint.a], self.frames[joint.b])

    def _integral(self, drive: Drive, joint: JointState) -> Expr | None:
        """The coordinate that a DRIVE of a speed prescribes where the joint supplies none."""
        self._fail(
            "E245",
            f"DRIVE {drive.name} prescribes the speed of {joint.name}, which closes a loop",
            drive.span,
            f"cut another joint of the loop (cut=yes), so that {joint.name} supplies a coordinate",
        )
        return None

    def initial_state(self) -> list[float]:
        """All unknowns at the start as the cards say it; electrical ones 0."""
        x = [0.0] * len(self.unknowns_so_far())
        for c in (*self.own, *self.given):
            if c.row >= 0:
                x[c.row] = c.start
            if c.speed_row >= 0:
                x[c.speed_row] = c.start_speed
        return x

    def _fixed(self) -> dict[str, tuple[float, float, float]]:
        return {n: (b.x, b.y, b.angle) for n, b in self.bodies.items() if b.fixed}

    def _close(self, drives: list[Drive], gears: list[tuple[Gear, float]]) -> None:
        """Constraint rows of cut joints, and of drives and gears that found no coordinate to replace."""
        for name in self.plan.cut:
            joint = self.joints[name]
            fa, fb = self.frames[joint.a], self.frames[joint.b]
            joint.qs = self._measure(joint)
            joint.us = [self.rate(q) for q in joint.qs]
            rows = loops.closure(self.b, joint, fa, fb)
            if self.is_unmeasured(name) and (length := constant(rows[0][1])) is not None:
                joint.length, rows = length, []
                if length == 0.0:
                    closing.no_length(self, name)
            stay, folded, gap = loops.sort_out(rows)
            self.folded += folded
            if gap:
                self._fail(
                    "E242",
                    f"the loop of joints {', '.join(self.loop_of(name))} cannot close: "
                    f"{gap} are left at {name} whatever moves",
                    joint.card.span,
                    "check the points and axes of the joints",
                )
            for k in stay:
                label, h, unit = rows[k]
                self.rows.append(Row(name, k, label, self.b.const(0.0) + h, unit))
        for drive in drives:
            joint = self.joints[drive.terminals[0][2].name]
            if drive.qd is None:
                q: Expr | None = prescribed.function_of_time(self, drive)[0]
            else:
                q = self._integral(drive, joint)
            if q is None:
                continue
            self.rows.append(Row(drive.name, 0, "drive", joint.q - q, "N m" if joint.rotary else "N"))
        for gear, factor in gears:
            j1, j2 = (self.joints[ref.name] for _, _, ref in gear.terminals)
            self.rows.append(Row(gear.name, 0, "gear", j1.q - factor * j2.q, "N m" if j1.rotary else "N"))

    def is_unmeasured(self, owner: str) -> bool:
        """Is this a rod whose length follows from the start? Its row lacks that length until it is known."""
        joint = self.joints.get(owner)
        return joint is not None and joint.kind == "rod" and joint.length is None

    def _couple(self) -> None:
        """Terminals of the couplings become nodes, joints, points; branches are allocated."""
        self.active = [*self.bodies.values(), *(j.card for j in self.joints.values())]
        for body in self.bodies.values():
            self._check_inertia(body)
        for card in self.couplings.values():
            if not card.supported:
                continue
            target: Any = card
            for label, kind, ref in card.terminals:
                if kind == "node":
                    setattr(target, label, self.ctx.node(ref.name))
                elif kind == "point":
                    found = self._locate_ref(ref, card.name)
                    assert found is not None
                    setattr(target, label, self.frames[found[0]].point(found[1]))
                elif kind == "turnable":
                    on_joint = ref.name in self.joints
                    target.joint = self.joints[ref.name] if on_joint else None
                    target.body = None if on_joint else self.frames[ref.name]
                else:
                    setattr(target, label, self.joints[ref.name])
            self.active.append(card)
        for card in self.active[len(self.bodies) + len(self.joints) :]:
            card.prepare(self)
            gain = getattr(card, "imbalance", None)
            power = gain(self) if gain is not None else None
            if power is not None:
                self.imbalances.append((card.name, self.public(power)))

    def _check_inertia(self, body: Body) -> None:
        """One number for j= says nothing about turns that leave the plane."""
        spin = self.frames[body.name].spin()
        if (is_zero(spin[0]) and is_zero(spin[1])) or body.spatial_inertia:
            return
        self._fail(
            "E248",
            f"body {body.name} turns out of the plane, and its inertia is known about z alone",
            body.span,
            "give j=(Jxx,Jyy,Jzz) or shape=",
        )

    def _check_start(self) -> None:
        """Points that coincide where their direction is needed, wipers beyond their ends."""
        for card in self.couplings.values():
            if isinstance(card, OnJointOrPoints) and card.needs_direction():
                d = subtract(card.q.pos, card.p.pos)
                square = self.b.eval([self.public(dot(d, d))], self.found.x, 0.0)[0]
                if square == 0.0:
                    self._fail(
                        "E257",
                        f"the two points of {card.spec.word} {card.name} coincide at the start: "
                        "its force has no direction",
                        card.span,
                        "start a body elsewhere, or tie them with a joint and put the card on that",
                    )
        for e, lo, hi, name, warn in self.clamps:
            value = self.b.eval([e], self.found.x, 0.0)[0]
            if not lo <= value <= hi:
                self.sink.warning(
                    "W234",
                    f"{warn} already at the start",
                    self.span_of(name),
                    "widen range=, or start the joint inside of it",
                )

    def check_poles(self) -> None:
        """Divisions by something that is zero where the machine starts, once all expressions are known."""
        if self.broken:
            return
        electrical = [self.b.x(k) for k in (*self.ctx.nodes.values(), *self.ctx.branches.values())]
        for whole, divisors in self.ctx.poles:
            if isfinite(self.b.eval([self.public(whole)], self.found.x, 0.0)[0]):
                continue
            for e, span in divisors:
                by = self.public(e)
                if not any(self.b.depends(by, electrical)) and self.b.eval([by], self.found.x, 0.0)[0] == 0.0:
                    self._fail(
                        "E283",
                        f"division by zero at the start, where `{span.text if span else 'the divisor'}` is 0",
                        span,
                        "start the joint elsewhere (ic=), or add to the divisor what is left there, a gap for instance",
                    )

    def _locked_note(self) -> None:
        """Joints and gears that leave no motion at all."""
        if self.own and not self.drives and self.found.dof == 0:
            self.sink.note(
                "N231",
                "the machine has no degree of freedom: its joints and gears hold everything where it starts",
                self.span_of(self.rows[-1].owner),
                hint="`emsim check` lists coordinates and constraints",
            )

    def _gravity_note(self) -> None:
        """Masses that gravity would move, and no .gravity card."""
        if self.ctx.flat.gravity is not None or not self.own:
            return
        qs = [self.b.x(c.row) for c in self.own]
        for name, body in self.bodies.items():
            height = self.b.const(0.0) + self.frames[name].point(body.centre).pos[1]
            if body.m and any(self.b.depends(height, qs)):
                self.sink.note(
                    "N230",
                    f"there is no .gravity card, so body {name} and the rest weigh nothing",
                    body.span,
                    hint=".gravity 9.81 pulls along -y",
                )
                return

    # equations ------------------------------------------------------------------------------------

    def contribute(self) -> None:
        """Rows of the machine and of its couplings' electrical side."""
        if not self.broken:
            equations.contribute(self)
            reactions.fill_waiting(self)

    def public(self, e: Scalar) -> Expr:
        """`e` with symbols replaced by what they stand for."""
        if isinstance(e, (int, float)):
            return self.b.const(float(e))
        return self.b.substitute([e], self.pairs)[0] if self.pairs else e

    def public_all(self, es: list[Expr]) -> list[Expr]:
        return self.b.substitute(es, self.pairs) if self.pairs else es

    def own_aware(self, e: Scalar) -> Expr:
        """Raw while a co-energy is compiled (it will be differentiated), else public."""
        return self.b.const(0.0) + e if self.own_symbols is not None else self.public(e)

    def rate(self, e: Expr) -> Expr:
        """de/dt along the motion."""
        seed: list[tuple[Expr, Any]] = [(self.b.x(c.row), self.b.x(c.speed_row)) for c in self.own]
        seed += [(c.q, c.u) for c in self.given]
        seed += [(v.s, v.rate) for v in self.virtuals]
        seed.append((self.b.time(), 1.0))
        return self.b.tangent([e], seed)[0]

    # the scene that cards see (cards/base.py: Scene) --------------------------------------------------

    def frame(self, name: str) -> Frame:
        return self.frames[name]

    def speeds(self, joint: str) -> list[Expr]:
        return self.joints[joint].us

    def reads(self, name: str) -> bool:
        """Does the deck read the effort of this card?"""
        return any((fn, name) in self.wanted for fn in reactions.EFFORTS)

    def compile(self, value: Any, span: Span) -> Expr:
        if isinstance(value, (int, float)):
            return self.b.const(float(value))
        if hasattr(value, "kind"):  # a waveform
            from .waves import resolve

            wave = self._waves.get(id(value))
            if wave is None:
                kind, args = resolve(value, self.ctx.times, self.sink)
                wave = self._waves[id(value)] = self.b.wave_expr(self.b.wave(kind, args))
            return wave
        return self.ctx.compile(value, span)

    def compile_energy(self, value: Any, span: Span, own: Own) -> Expr:
        self.own_symbols = own
        try:
            return self.compile(value, span)
        finally:
            self.own_symbols = None

    def beyond_coordinates(self, value: Any, e: Expr) -> str:
        """Something that an energy depends on and that is no coordinate, in the deck's words; "" where nothing is."""
        if hasattr(value, "kind") or (isinstance(value, Node) and "time" in names(value)):
            return "time"
        speeds = [(c.u_name, c.u) for c in (*self.own, *self.given)]
        nodes = [(f"v({name})", self.b.x(row)) for name, row in self.ctx.nodes.items()]
        branches = [(f"i({name})", self.b.x(row)) for name, row in self.ctx.branches.items()]
        found = [*speeds, *nodes, *branches]
        reads = self.b.depends(e, [x for _, x in found])
        return next((name for (name, _), read in zip(found, reads, strict=True) if read), "")

    def add_f(self, row: int, e: Scalar) -> None:
        self.b.add_f(row, self.public(e))

    def add_q(self, row: int, e: Scalar) -> None:
        if constant(e) != 0.0:
            self.b.add_q(row, self.public(e))

    def v(self, plus: int, minus: int) -> Expr:
        high = self.b.x(plus) if plus >= 0 else self.b.const(0.0)
        return high - self.b.x(minus) if minus >= 0 else high

    def branch(self, name: str) -> int:
        return self.ctx.new_branch(name)

    def derivative(self, name: str, unit: str, of: Expr) -> Expr:
        index = self.derivatives.get(name)
        if index is None:
            of = self.public(of)
            known = self.time_derivative(of)
            if known is not None:
                return known
            index = self.derivatives[name] = self.b.unknown(name, "derivative", unit, 0.0)
            self.b.add_q(index, of)
            self.b.g(index, index, -1.0)
        return self.b.x(index)

    def time_derivative(self, e: Expr) -> Expr | None:
        """de/dt where `e` is an expression of time alone, as prescribed motion is; None where it depends on
        an unknown or on a waveform, which has corners. Flags are constant between events."""
        held = [(flag, 1.0) for flag in self.ctx.flags.values()]
        if self.b.substitute([e], [(self.b.time(), 0.5), *held])[0].value is None:
            return None
        return self.b.tangent([e], [(self.b.time(), 1.0)])[0]

    def distance(self, p: PointView, q: PointView) -> tuple[Expr, Expr]:
        d, dv = subtract(q.pos, p.pos), subtract(q.vel, p.vel)
        length = self.b.call("sqrt", dot(d, d))
        return length, (self.b.const(0.0) + dot(d, dv)) / length

    def abs(self, e: Scalar) -> Expr:
        return self.ctx.abs_(self.public(e))

    def clamp(self, e: Scalar, lo: float, hi: float, name: str, warn: str) -> Expr:
        e = self.public(e)
        if e.value is not None:
            return self.b.const(min(max(e.value, lo), hi))
        self.clamps.append((e, lo, hi, name, warn))
        self.flag_warnings[f"{name} high"] = self.flag_warnings[f"{name} low"] = warn
        over = self.b.flag(e - hi, None, f"{name} high", -1)
        under = self.b.flag(lo - e, None, f"{name} low", -1)
        return self.b.select(over, hi, self.b.select(under, lo, e))

    def reaction(self, name: str) -> Expr:
        return reactions.of_coupling(self, name)

    # reading --------------------------------------------------------------------------------------

    def probe(self, fn: str, args: list[Node], span: Span | None) -> Expr | None:
        """Expression of a mechanical function, None where it is not mechanical; reports misuse."""
        if self.broken:
            return self.b.const(0.0) if fn in probes.ONLY_MECHANICAL or not args else None
        return probes.probe(self, fn, args, span)

    def all_names(self) -> list[str]:
        return [*self.joints, *self.bodies, *self.couplings]

    # reporting ------------------------------------------------------------------------------------

    def unknowns_so_far(self) -> range:
        """Indices of all unknowns up to the machine's last coordinate."""
        return range(self._last_row + 1)

    def _newest(self) -> int:
        """Index of the newest unknown: electrical ones came before, coordinates are last."""
        rows = [r for c in (*self.own, *self.given) for r in (c.row, c.speed_row)]
        return max([*rows, *self.ctx.nodes.values(), *self.ctx.branches.values()], default=-1)

    def loop_of(self, owner: str) -> list[str]:
        """Joints of the loop that a cut joint closes, the joint last; of a gear or drive, its joints."""
        joint = self.joints.get(owner)
        if joint is not None:
            return [*self.plan.loop(joint.a, joint.b), owner]
        return [ref.name for _, _, ref in self.couplings[owner].terminals]

    def moved_by(self, c: Coordinate) -> str:
        """The body that a coordinate moves first."""
        for step in self.plan.steps:
            if step.joint == c.of:
                return step.child
        return c.of

    def span_of(self, name: str) -> Span | None:
        if name in self.joints:
            return self.joints[name].card.span
        card: Card | None = self.bodies.get(name) or self.couplings.get(name)
        return card.span if card is not None else None

    def report(self) -> dict[str, Any]:
        """Facts for `emsim check`; empty after errors."""
        from .inventory import report

        return {} if self.broken else report(self)

    def default_outputs(self) -> list[str]:
        """Names of what is recorded when nothing is asked for: coordinates, speeds, coupling forces."""
        from .inventory import default_outputs

        return [] if self.broken else default_outputs(self)
