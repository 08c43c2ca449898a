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

from ..cards import along
from ..cards.coordinate import OnJointOrPoints
from ..cards.domains import DOMAINS
from ..cards.joints.free import FreeInSpace
from ..cards.kinematics import constant, dot, is_zero, subtract
from ..elements.base import BOLTZMANN, ZERO_CELSIUS
from . import (
    alike,
    closing,
    coordinates,
    equations,
    hands,
    laws,
    loops,
    plausible,
    prescribed,
    probes,
    reactions,
    shafts,
    start,
)
from .loops import Row
from .mechanism import Mechanism
from .scene import FREE, JointState, free_in_space, place
from .sharing import Sharing
from .tree import Edge, Plan, plan

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..cards.base import Card, JointView, Scalar
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from ..cards.kinematics import Frame
    from ..deck import Ref
    from ..diagnostics import Span
    from ..expr import Node
    from .context import Context


INSIDE = 1e-9  # of the machine's size, rad: a gap that is closed by less is closed by rounding
OPENS = 1e-4  # of the machine's size, rad: a row that was left out and is this far from 0 was not redundant; so parts overlap


class Machine(Mechanism):
    """All mechanical cards of a deck and what the compiler makes of them."""

    def __init__(self, ctx: Context) -> None:
        super().__init__(ctx)
        ctx.machine = self  # expressions compiled on the way read it

    # building -------------------------------------------------------------------------------------

    def build(self) -> None:
        """Everything up to the start; allocates all unknowns of the machine."""
        errors = self._errors()
        if self.broken:
            return
        self._graph()
        rows_of = coordinates.drives_and_gears(self)
        if not self.broken and self._errors() == errors:
            reactions.prepare(self)
            coordinates.allocate(self, self.all_coordinates())
            self.in_space = bool(self._out_of_plane())
            self.frames = self._place()
            self._last_row = self._newest()
            prescribed.prescribe(self)
            self._close(*rows_of)
            self._couple()
        if self.broken or self._errors() > errors:
            self.broken = True
            return
        self.kinetic = equations.kinetic(self)
        speeds = [c.u for c in self.motions]
        self.momenta = self.public_all(self.b.grad(self.kinetic, speeds)) if speeds else []
        self.found = start.assemble(self)
        self._check_start()
        self.broken = self._errors() > errors
        if self.broken:
            return
        equations.multipliers(self)
        self._undetermined_reactions()
        laws.allocate(self, [*self.active])
        self._check_gaps()
        self._watch_redundant()
        self._locked_note()
        self._gravity_note()
        plausible.remarks(self)

    def noise(self) -> list[tuple[str, str, list[tuple[int, Expr | float]], Expr | float, float]]:
        """Sources of noise: card, word, rows of F with what 1 of it puts there, power density, exponent of frequency."""
        electrical = [*self.ctx.nodes.values(), *self.ctx.branches.values()]
        rows = [c.speed_row for c in self.motions] + electrical
        factor = 4.0 * BOLTZMANN * (float(self.ctx.temp) + ZERO_CELSIUS)
        found: list[tuple[str, str, list[tuple[int, Expr | float]], Expr | float, float]] = []
        for card in self.active:
            for word, resistance, flow in card.thermal(self):
                slopes = self.b.grad(self.public(flow), [self.b.x(row) for row in rows])
                own = [(row, k) for row, k in zip(rows, slopes, strict=True) if k.value != 0.0]
                found.append((card.name, word, [*own], factor * self.public(resistance), 0.0))
        return found

    def _errors(self) -> int:
        return sum(1 for d in self.sink.diagnostics if d.severity == "error")

    def graph(self) -> Plan:
        """The tree of the joints, and what closes loops."""
        edges = [Edge(key, j.a, j.b, j.card.cut or not j.kind.in_tree) for key, j in self.joints.items()]
        fixed = {name for name, body in self.bodies.items() if body.fixed}
        return plan(list(self.bodies), fixed, edges)

    def _graph(self) -> None:
        why = self._out_of_plane()
        for joint in self.joints.values():
            if joint.kind.in_plane_only:
                if why:
                    joint.kind = FreeInSpace(joint.card)
                joint.card.settle(joint.kind, self.sink)
        self.plan = self.graph()
        if why and self.plan.roots:
            for name in self.plan.roots:
                self.joints[f"{FREE}{name}"] = free_in_space(self.bodies[name], self.sink)
            self.plan = self.graph()
        for name in self.plan.cut:
            self.joints[name].cut = True
        for step in self.plan.steps:
            joint = self.joints[step.joint]
            joint.coordinates = coordinates.of_joint(joint)
        self.roots = {name: coordinates.of_free_body(self.bodies[name]) for name in self.plan.roots}
        for name, body in self.bodies.items():
            extra = [k for k in ("x", "y", "angle", "vx", "vy", "omega", "z", "vz", "rot") if body.given(k)]
            if body.fixed:
                extra = [
                    k
                    for k in extra
                    if k in ("z", "vz", "rot") or (k in ("vx", "vy", "omega") and getattr(body, k) != 0.0)
                ]
            if extra and name not in self.roots and f"{FREE}{name}" not in self.joints:
                why = "it is fixed" if body.fixed else "its joints say where it is"
                self.sink.warning(
                    "W232",
                    f"{extra[0]}= of BODY {name} has no effect: {why}",
                    body.place(extra[0]),
                    hint="leave out fixed=yes, and a joint or nothing holds the body"
                    if body.fixed
                    else "ic= or guess= of the joint sets the start",
                )

    def _out_of_plane(self) -> str:
        """What takes the scene out of the plane, for what is free: a joint, gravity, a start, something that acts so; or ""."""
        for joint in self.joints.values():
            if joint.kind.leaves_plane():
                return f"joint {joint.name} leaves the plane"
        if self.gravity[2]:
            return "gravity has a z component"
        for body in self.bodies.values():
            if body.in_space and not body.fixed:
                return f"body {body.name} starts out of it"
        for name, _, shape in self.parts():
            if shape.leaves_plane:
                return f"{name} has a shape that leaves it"
        for card in self.couplings.values():
            if card.leaves_plane() or any(
                self._height(ref) for _, kind, ref in card.terminals if kind == "point"
            ):
                return f"{card.spec.word} {card.name} acts out of it"
        return ""

    def _height(self, ref: Ref) -> float:
        """z of a place on a card, in its body."""
        local = None if ref.point is None else tuple(float(v) for v in ref.point)
        found = self.locate(ref.name, local)
        return 0.0 if found is None else found[1][2]

    def _place(self) -> dict[str, Frame]:
        frames = place(self.b, self.plan, self.joints, self.roots, self._fixed(), self.in_space)
        self._follow_turns(frames)
        return frames

    def _follow_turns(self, frames: dict[str, Frame]) -> None:
        """Angles of cut joints that are measured by atan2 count full turns by an unknown that follows them:
        q = turned + atan2(angle - turned),  d(turned)/dt = q'   (q does not depend on `turned`, dq/dt is exact)."""
        for name in self.plan.cut:
            joint = self.joints[name]
            near = [self.b.symbol() for _ in joint.kind.coordinates]
            values = joint.measure(self.b, frames[joint.a], frames[joint.b], [*near])
            for k, q in enumerate(values):
                if self.b.depends(q, [near[k]])[0]:
                    label = name if len(values) == 1 else f"{name},{k + 1}"
                    row = self.b.unknown(f"turned({label})", "coordinate", "rad", 0.0)
                    self.turned[name, k] = row

    def _measure(self, joint: JointState) -> list[Expr]:
        """The coordinates of a cut joint."""
        near = joint.kind.near
        for k in range(len(near)):
            if (row := self.turned.get((joint.name, k))) is not None:
                near[k] = self.b.x(row) + joint.kind.zeros[k]
        return joint.measure(self.b, self.frames[joint.a], self.frames[joint.b], near)

    def _integral(self, drive: Drive, joint: JointState) -> Expr | None:
        """The coordinate that a DRIVE of a speed prescribes where the joint supplies none."""
        said = f"DRIVE {drive.name} prescribes the speed of {joint.name}, which closes a loop"
        hint = f"cut another joint of the loop (cut=yes), so that {joint.name} supplies a coordinate"
        self._fail("E245", said, drive.span, hint)
        return None

    def _fixed(self) -> dict[str, tuple[float, float, float]]:
        return {n: (b.x, b.y, b.angle) for n, b in self.bodies.items() if b.fixed}

    def _close(self, drives: list[Drive], gears: list[tuple[Gear, float]]) -> None:
        """Constraint rows of cut joints, and of drives and gears that found no coordinate to replace."""
        differentiated: list[JointState] = []
        for name in self.plan.cut:
            joint = self.joints[name]
            fa, fb = self.frames[joint.a], self.frames[joint.b]
            joint.qs = self._measure(joint)
            speeds = joint.kind.measure_speeds(fa, fb)
            if speeds is None:
                differentiated.append(joint)
            else:
                joint.us = [self.b.const(0.0) + u for u in speeds]
            self._check_measured(joint)
            rows = joint.closure(self.b, fa, fb)
            if joint.kind.unmeasured and (length := constant(rows[0][1])) is not None:
                joint.kind.length, rows = length, []
                if length == 0.0:
                    closing.no_length(self, name)
            stay, folded, gap = loops.sort_out(rows)
            self.folded += folded
            if gap:
                said = f"the loop of joints {', '.join(self.loop_of(name))} cannot close: {gap} are left at {name}"
                hint = "check the points and axes of the joints"
                self._fail("E242", f"{said} whatever moves", joint.card.span, hint)
            for k in stay:
                label, h, unit = rows[k]
                self.rows.append(Row(name, k, label, self.b.const(0.0) + h, unit))
                self.rows[-1].measured = joint.kind.unmeasured
        rates = iter(self.rates([q for joint in differentiated for q in joint.qs]))
        for joint in differentiated:
            joint.us = [next(rates) for _ in joint.qs]
        for group in self.groups:
            owner = group.places[0].of
            for k, h in enumerate(group.norms()):
                self.norms.append(Row(owner, k, "norm", h, ""))
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

    def _check_measured(self, joint: JointState) -> None:
        """A joint that closes a loop and whose coordinates the frames do not tell cannot be held by ic=."""
        for key in ("ic", "guess"):
            if joint.card.given(key) and len(joint.qs) < len(joint.kind.coordinates):
                said = f"{key}= of {joint.name}: the {joint.kind.name} joint closes a loop and has no coordinates there"
                hint = f"cut another joint of the loop (cut=yes), so that {joint.name} supplies coordinates"
                self._fail("E244", said, joint.card.place(key), hint)

    def _couple(self) -> None:
        """Terminals of the couplings become nodes, joints, points; branches are allocated."""
        self.active = [*self.bodies.values(), *self.shapes.values()]
        self.active += [*(j.card for key, j in self.joints.items() if key[:1] != FREE)]
        count = len(self.active)
        for body in self.bodies.values():
            self._check_inertia(body)
        for card in self.couplings.values():
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
                elif kind == "joint":
                    setattr(target, label, along.view(self, *along.found(self.joints, ref.name)))
                elif kind in DOMAINS:
                    setattr(target, label, self.domains.named(kind, ref.name, ref.span))
            self.active.append(card)
        for card in self.active[count:]:
            card.prepare(self)
            self._own_rows(card)
            gain = getattr(card, "imbalance", None)
            power = gain(self) if gain is not None else None
            if power is not None:
                self.imbalances.append((card.name, self.public(power)))
        self.domains.check()
        self.active += [*shafts.couple(self), *hands.couple(self)]

    def _own_rows(self, card: Card) -> None:
        """What a card demands of coordinates, then of speeds."""
        rows = [(*row, False) for row in card.constraints(self)] + [
            (*row, True) for row in card.velocities(self)
        ]
        for k, (label, h, unit, of_speeds) in enumerate(rows):
            self.rows.append(row := Row(card.name, k, label, self.b.const(0.0) + h, unit))
            row.of_speeds, row.measured = of_speeds, card.from_start and not of_speeds

    def _check_inertia(self, body: Body) -> None:
        """One number for j= says nothing about turns that leave the plane."""
        spin = self.frames[body.name].spin()
        if (is_zero(spin[0]) and is_zero(spin[1])) or body.spatial_inertia:
            return
        said = f"body {body.name} turns out of the plane, and its inertia is known about z alone"
        self._fail("E248", said, body.span, "give j=(Jxx,Jyy,Jzz) or shape=")

    def _check_start(self) -> None:
        """Points that coincide where their direction is needed, wipers beyond their ends."""
        for card in self.couplings.values():
            if isinstance(card, OnJointOrPoints) and card.needs_direction():
                d = subtract(card.q.pos, card.p.pos)
                square = self.b.eval([self.public(dot(d, d))], self.found.x, 0.0)[0]
                if square == 0.0:
                    said = f"the two points of {card.spec.word} {card.name} coincide at the start"
                    hint = "start a body elsewhere, or tie them with a joint and put the card on that"
                    self._fail("E257", f"{said}: its force has no direction", card.span, hint)
        for e, lo, hi, name, warn in self.clamps:
            value = self.b.eval([e], self.found.x, 0.0)[0]
            if not lo <= value <= hi:
                hint = "widen range=, or start the joint inside of it"
                self.sink.warning("W234", f"{warn} already at the start", self.span_of(name), hint)

    def _check_gaps(self) -> None:
        """Rigid parts that are in each other where the machine starts; a flag says so of polygons later on (gaps.py)."""
        x = [*self.found.x, *([0.0] * (2 * len(self.rows) + 2 * len(self.laws) + len(self.norms)))]
        solid: list[tuple[Card, Scalar]] = []
        for card in self.couplings.values():
            solid += [(card, apart) for apart in alike.separations(self, card)]
        gaps = [(card, apart, "m") for card, apart in solid] + [
            (card, law.gap, "rad" if law.unit == "N m" else "m")
            for card, law in self.laws
            if law.gap is not None
        ]
        size = closing.size(self, self.found.x)
        found = self.public_all([self.b.const(0.0) + apart for _, apart, _ in gaps])
        values = self.b.eval(found, x, 0.0) if gaps else []
        for (card, _, unit), gap in zip(gaps, values, strict=True):
            if gap < -INSIDE * (1.0 if unit == "rad" else size):
                self._fail(
                    "E258",
                    f"rigid parts of {card.spec.word} {card.name} are {-gap:.6g} {unit} in each other at the start",
                    card.span,
                    f"start {-gap:.6g} {unit} further off (ic= of its joint), or give it a stiffness k=",
                )
        for card, apart in () if self.in_space else solid:
            self.b.flag(self.public(-OPENS * size - apart), None, f"{card.name} overlaps", -1)

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

    @property
    def closures(self) -> list[Expr]:
        """How far every loop is open, by the rows that hold it and those that said nothing new: 0 where it is closed."""
        return [] if self.broken else self.public_all([row.h for row in self.loop_rows])

    @property
    def loop_rows(self) -> list[Row]:
        return [row for row in (*self.rows, *self.found.redundant) if not row.of_speeds]

    def widest(self, gaps: list[float]) -> dict[str, float]:
        """The largest of what `closures` came to, by unit: m, rad."""
        found: dict[str, float] = {}
        for row, wide in zip(self.loop_rows, gaps, strict=True):
            unit = "m" if row.unit == "N" else "rad"
            found[unit] = max(found.get(unit, 0.0), wide)
        return found

    def _watch_redundant(self) -> None:
        """Rows that said nothing new at the start are left out: should they come open later on, the run says so."""
        for row in self.found.redundant:
            h = self.public(row.h)
            if h.value is not None:
                continue
            name = f"{row.owner} opens {row.place + 1}"
            self.b.flag(h * h - self._opens(row), None, name, -1)
            self.openings[name] = row

    def _opens(self, row: Row) -> Expr:
        """The square of what shows that a row was not redundant; of speeds beside the terms that cancel in it."""
        if not row.of_speeds:
            limit = OPENS * (closing.size(self, self.found.x) if row.unit == "N" else 1.0)
            return self.b.const(limit * limit)
        total = self.b.const(0.0)
        for slope, c in zip(self.row_slopes(row), self.motions, strict=True):
            total = total + (OPENS * slope * c.u) * (OPENS * slope * c.u)
        return self.public(total)

    def _locked_note(self) -> None:
        """Joints and gears that leave no motion at all."""
        if self.own and not self.drives and self.found.dof == 0:
            self.sink.note(
                "N231",
                "the machine has no degree of freedom: its joints and gears hold everything where it starts",
                self.span_of(self.rows[-1].owner),
                hint="`emsim check` lists coordinates and constraints",
            )

    def _undetermined_reactions(self) -> None:
        """Reactions that the deck reads and that equilibrium alone does not determine."""
        sharing = Sharing(self) if self.wanted else None
        if sharing is not None and sharing.examine():
            self.open_reactions = sharing.read()
            if self.shares:
                self.sharing = sharing
                sharing.settle()
        self.has_multipliers = True
        if sharing is None or not self.open_reactions or self.shares:
            return  # nothing to say, or said already
        rubs = sharing.rubs()
        also = f"; {', '.join(rubs)}: friction goes with it, so the motion depends on it too" if rubs else ""
        self.sink.warning(
            "W240",
            f"{', '.join(self.open_reactions)}: not unique; joints hold more than there is to hold, and equilibrium alone does "
            "not say how they share the load",
            self.span_of(sharing.rows[sharing.kept].owner),
            f"what is shown is the least of many answers, as joints share that are all equally stiff{also}; in nature stiffness "
            "decides: a SPRING in place of one of them, or leave one out",
        )

    def _gravity_note(self) -> None:
        """Masses that gravity would move, and no .gravity card."""
        if self.ctx.flat.gravity is not None or not self.own:
            return
        qs = [c.q for c in self.places]
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
            for (name, k), row in self.turned.items():
                self.b.c(row, row, 1.0)
                self.b.add_f(row, -self.public(self.joints[name].us[k]))
            reactions.fill_waiting(self)

    # the scene that cards see (cards/base.py: Scene) --------------------------------------------------

    def reaction(self, name: str, place: int = 0) -> Expr:
        return reactions.of_coupling(self, name, place)

    def load(self, joint: JointView) -> Expr | None:
        return reactions.load(self, joint.name)

    # reading --------------------------------------------------------------------------------------

    def probe(self, fn: str, args: list[Node], span: Span | None) -> Expr | None:
        """Expression of a mechanical function, None where it is not mechanical; reports misuse."""
        if self.broken:
            return self.b.const(0.0) if fn in probes.ONLY_MECHANICAL or not args else None
        return probes.probe(self, fn, args, span)

    # reporting ------------------------------------------------------------------------------------

    def report(self) -> dict[str, Any]:
        """Facts for `emsim check`; empty after errors."""
        from .inventory import report

        return {} if self.broken else report(self)

    def default_outputs(self) -> list[str]:
        """Names of what is recorded when nothing is asked for: coordinates, speeds, coupling forces."""
        from .inventory import default_outputs

        return [] if self.broken else default_outputs(self)
