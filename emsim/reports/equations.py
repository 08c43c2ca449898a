"""The equations of a deck as a page to read: unknowns, energies, every row with the cards that its terms come from.

The rows are those of d/dt Q(x, t) + F(x, t) = 0 that a run integrates, in the words of the field: Kirchhoff's current law at a
node, the voltage of a branch, Lagrange's equation of a coordinate, the closing of a loop. What stands on the left minus what
stands on the right is the row's d/dt Q + F, or that times -1.
"""

from __future__ import annotations

from ..analyses import transients
from .algebra import Algebra
from .notation import Layout, Names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from .._engine import Expr
    from ..analyses import Analysis
    from ..assemble import Assembly
    from ..assemble.recording import Recorder, Share
    from .algebra import Atom, Poly

    Shares = dict[tuple[int, bool], list[Share]]

CONSTANT = ("dc", "still")  # kinds of waves in whose place a number stands: a run has begun
WAVE_ARGUMENTS = {
    "delay": "by",
    "pulse": "v1 v2 td tr tf pw per np", "sin": "vo va f td theta phase", "exp": "v1 v2 td1 tau1 td2 tau2",
    "sffm": "vo va fc mdi fs phc phs", "am": "va vo mf fc td phase",
}  # fmt: skip
# what a card's energy or power is to the coordinate that it acts on
ROLES = {
    ("BODY", "V"): "weight of {}", ("BODY", "T"): "inertia of {}: centrifugal, Coriolis", ("SPRING", "V"): "spring {}",
    ("DAMPER", "P"): "damper {}", ("JOINT", "P"): "damping in {}", ("MOTOR", "P"): "motor {}", ("FORCE", "P"): "force {}",
    ("TORQUE", "P"): "torque {}", ("TRANSDUCER", "W"): "transducer {}", ("TRANSDUCER", "P"): "transducer {}",
}  # fmt: skip


class Part:
    """One summand of a row: whose, and whether it stands under d/dt."""

    __slots__ = ("note", "owner", "poly", "quotient", "rate")

    def __init__(
        self, owner: str, poly: Poly, rate: bool = False, quotient: bool = False, note: str = ""
    ) -> None:
        self.owner, self.poly, self.rate, self.quotient, self.note = (
            owner,
            poly,
            rate,
            quotient,
            note or owner,
        )


class Row:
    """One equation: the sum of `left` is the sum of `right`. `sign`: left - right is sign * (d/dt Q + F) of row `index`."""

    __slots__ = ("index", "left", "right", "section", "sign", "title")

    def __init__(
        self, index: int, section: str, title: str, left: list[Part], right: list[Part], sign: float = 1.0
    ) -> None:
        self.index, self.section, self.title, self.sign = index, section, title, sign
        self.left = [p for p in left if p.poly.terms]
        self.right = [p for p in right if p.poly.terms]

    @property
    def owners(self) -> set[str]:
        return {name for part in (*self.left, *self.right) for name in part.owner.split(", ")}


class Energy:
    """One term of an energy [J] or of the heat [W]: T V W P of a card or an element."""

    __slots__ = ("kind", "law", "owner", "poly", "word")

    def __init__(self, kind: str, owner: str, word: str, poly: Poly, law: str = "") -> None:
        self.kind, self.owner, self.word, self.poly, self.law = kind, owner, word, poly, law


def explain(assembly: Assembly, planned: Sequence[Analysis]) -> Explained:
    """The equations of a deck that was prepared with `recording`; the index at its starting point."""
    from .dae_index import MOST, index_of

    found = Explained(assembly)
    if assembly.system.n > MOST:
        return found
    transient = next(iter(transients(planned)), None)
    uic, tstep = (transient.uic, transient.tstep) if transient is not None else (False, 1e-6)
    started, x, _ = assembly.system.start(assembly.options, uic, tstep)
    # without a starting point there is nothing to linearise at
    found.index = index_of(assembly.system, x) if started else None
    return found


CIRCUIT, BRANCHES, MOTION, CLOSURE, OTHERS = "circuit", "branches", "motion", "closure", "others"


SHORTER = (1 << 20, 48, 16, 6)  # terms of a formula that are written, by how much there is to write
LONG = 16  # symbols and numbers of a summand; what repeats in longer ones gets a name


class Explained:
    """A deck's equations, ready to be written.

    rows, energies       what to write: of all cards, or of those named in `only`; at most MOST_ROWS of each, `left_out` says
                         how many more there are
    unknowns             (name, unit, meaning) of all that are written
    conditions, sources  (name, Poly that is above 0, Poly below 0 of its end or None, remark); (name, text)
    folded               sentences: what the deck says and the equations do not hold, and why
    index, freedom       of the DAE; of the machine; None where there is none or it was not computed
    """

    MOST_ROWS = 120
    MOST_WEIGHT = 4000

    def __init__(self, assembly: Assembly, only: set[str] | None = None) -> None:
        ctx, system = assembly.ctx, assembly.system
        self.ctx, self.system, self.machine = ctx, system, assembly.machine
        self.title = assembly.flat.title
        self.recorder: Recorder = ctx.b  # type: ignore[assignment]
        constants = {k: args[0] for k, (kind, args, _) in enumerate(self.recorder.waves) if kind in CONSTANT}
        self.algebra = Algebra(system.flags, constants)
        self.names = Names(system.names, system.kinds, self._wave_names(), system.flag_names)
        self.layout = Layout(self.names)
        self.size, self.left_out = system.n, 0
        self.only = only
        shares = self._shares()
        self.rows = self._rows(shares)
        self.left_out = max(0, self.size - len(self.rows))
        self.energies = [*self._machine_energies(), *self._circuit_energies(assembly)]
        self.unknowns = [
            (self.names.unknown(i), system.units[i], self._meaning(i))
            for i in range(min(self.size, self.MOST_ROWS))
        ]
        self.conditions = self._conditions()
        self.sources = self._sources()
        self.devices = self.recorder.devices[: self.MOST_ROWS]
        self.named = self._name_long()
        self.folded = folded(self)
        self.freedom: int | None = self.machine.found.dof if self.machine is not None else None
        self.index: int | None = None

    # names -----------------------------------------------------------------------------------------

    def _wave_names(self) -> dict[int, str]:
        found = {k: name for name, k in self.ctx._waves.items()}
        if self.machine is not None:
            for card in self.machine.active:
                for value in (card.raw.wave, *card.raw.params.values()):
                    wave = self.machine._waves.get(id(value))
                    if wave is not None:
                        found.setdefault(int(wave.node[1]), card.name)
        for k, (_, _, owner) in enumerate(self.recorder.waves):
            found.setdefault(k, owner or f"source{k + 1}")
        return found

    def _meaning(self, i: int) -> str:
        name, kind = self.names.names[i], self.names.kinds[i]
        if kind == "node":
            owner, inner, _ = name.partition("#")
            # a deck's own node may be called n#1
            return (
                f"voltage inside of {owner}"
                if inner and self.what(owner) != owner
                else f"voltage of node {name}"
            )
        if kind == "branch":
            return f"current through {self.what(name)}"
        word, _, rest = name.partition("(")
        of = rest.rstrip(")")
        if kind == "lambda":
            return f"reaction that keeps {self._closing(of)}"
        if kind == "mu":
            return f"correction that keeps {self._closing(of)}; zero in exact arithmetic"
        if kind == "coordinate" and rest:
            return {"angle": "angle of", "pos": "displacement along"}.get(word, f"{word} of") + f" {of}"
        if kind == "speed":
            return {"omega": "angular velocity of", "vel": "velocity along"}.get(
                word, f"velocity {word[1:]} of"
            ) + f" {of}"
        if kind == "derivative":
            return (
                f"{self.names.unknown(i)}, a rate of change that the deck reads"
                if rest
                else "a rate of change"
            )
        return "an integral over time"

    def _closing(self, owner_and_place: str) -> str:
        owner = owner_and_place.rpartition(",")[0]
        return f"{owner} closed" if owner in self.machine.joints else f"{self.what(owner)} true"

    def what(self, name: str) -> str:
        """`resistor r1`, `MOTOR m1`"""
        element = self.ctx.elements.get(name)
        if element is not None:
            return f"{element.what} {name}"
        if self.machine is not None:
            for card in self.machine.active:
                if card.name == name:
                    return f"{card.spec.word} {name}"
        return name

    # rows ------------------------------------------------------------------------------------------

    def _shares(self) -> Shares:
        found: Shares = {}
        for share in self.recorder.shares:
            found.setdefault((share.row, share.rate), []).append(share)
        return found

    def _poly(self, share: Share) -> Poly:
        if isinstance(share.what, list):
            return self.algebra.sum((factor, self.algebra.x(k)) for factor, k in share.what)
        return self.algebra.of(share.what)

    def _parts(self, shares: Iterable[Share], rate: bool = False) -> list[Part]:
        """Summands by owner: the contributions of each are one sum."""
        by_owner: dict[str, list[Share]] = {}
        for share in shares:
            by_owner.setdefault(share.owner, []).append(share)
        return [
            Part(owner, self.algebra.sum((1.0, self._poly(s)) for s in mine), rate, mine[0].quotient)
            for owner, mine in by_owner.items()
        ]

    def _rows(self, shares: Shares) -> list[Row]:
        m = self.machine
        special: dict[int, Row] = {}
        if m is not None:
            for row in self._motion():
                special[row.index] = row
            for row in self._closure():
                special[row.index] = row
        found: list[Row] = []
        wanted: Iterable[int] = range(self.size)
        if self.only is not None:
            touched = {row for (row, _), mine in shares.items() if any(s.owner in self.only for s in mine)}
            mine = [d for d in self.recorder.devices if d.name in self.only]
            touched |= {k for d in mine for p, n, _ in d.branches for k in (p, n) if k >= 0}
            touched |= {i for i, row in special.items() if row.owners & self.only}
            wanted = sorted(touched)
        for i in wanted:
            if len(found) >= self.MOST_ROWS:
                break
            if i in special:
                found.append(special[i])
                continue
            charges = self._parts(shares.get((i, True), ()), True)
            flows = self._parts(shares.get((i, False), ()))
            kind = self.names.kinds[i]
            if kind == "node":
                found.append(self._node(i, charges, flows))
            elif kind == "branch":
                found.append(self._branch(i, charges, flows))
            else:
                right = [
                    Part(p.owner, self.algebra.scale(-1.0, p.poly), False, p.quotient, p.note) for p in flows
                ]
                section = MOTION if kind in ("coordinate", "speed") and m is not None else OTHERS
                found.append(Row(i, section, f"definition of {self.names.unknown(i)}", charges, right))
        order = (CIRCUIT, BRANCHES, MOTION, CLOSURE, OTHERS)
        return sorted(found, key=lambda row: order.index(row.section))

    def _node(self, i: int, charges: list[Part], flows: list[Part]) -> Row:
        """The currents that leave a node add up to zero."""
        a = self.algebra
        for d in self.recorder.devices:
            for branch, (p, n, stores) in enumerate(d.branches):
                if i in (p, n) and p != n:
                    sign, name = 1.0 if i == p else -1.0, f"{d.number(branch)}_{d.name}"
                    flows.append(Part(d.name, a.scale(sign, a.atom("device", 0, (), f"i{name}"))))
                    if stores:
                        charges.append(Part(d.name, a.scale(sign, a.atom("device", 0, (), f"q{name}")), True))
        return Row(i, CIRCUIT, f"node {self.names.names[i]}", [*flows, *charges], [])

    def _branch(self, i: int, charges: list[Part], flows: list[Part]) -> Row:
        """v+ - v- = value for what holds a voltage; otherwise flux and drops on the left, node voltages on the right."""
        name, a = self.names.names[i], self.algebra
        element = self.ctx.elements.get(name)
        title = self.what(name)
        if element is not None and element.holds_voltage and not charges:
            ends = a.zero
            for node, sign in zip(element.nodes[:2], (1.0, -1.0), strict=False):
                k = self.ctx.node(node)
                ends = a.sum(((1.0, ends), (sign, a.x(k)))) if k >= 0 else ends
            rest = a.sum([(1.0, ends), *((-1.0, p.poly) for p in flows)])
            return Row(i, BRANCHES, title, [Part(name, ends)], [Part(name, rest)])
        left, right = list(charges), []
        for part in flows:
            terms = part.poly.terms
            volts = a.poly(
                {m: c for m, c in terms.items() if len(m) == 1 and m[0][1] == 1 and self._is_node(m[0][0])}
            )
            left.append(Part(part.owner, a.sub(part.poly, volts), False, part.quotient))
            right.append(Part(part.owner, a.scale(-1.0, volts)))
        if not any(p.poly.terms for p in left):
            return Row(i, BRANCHES, title, right, left, -1.0)
        return Row(i, BRANCHES, title, left, right)

    def _is_node(self, atom: Any) -> bool:
        return atom.kind == "x" and self.names.kinds[atom.number] == "node"

    def _motion(self) -> Iterable[Row]:
        """d/dt dL/du = dL/dq + what power brings + what loops hold; and d/dt q = u."""
        m, a, b = self.machine, self.algebra, self.machine.b
        own = m.motions
        us = [b.x(c.speed_row) for c in own]
        momenta: list[list[Part]] = [[] for _ in own]
        forces: list[list[Part]] = [[] for _ in own]

        def spread(
            expr: Any,
            to: list[Expr] | None,  # None: own coordinates, as what it is for the own speeds
            into: list[list[Part]],
            factor: Any,
            card: Any,
            role: str,
            rate: bool = False,
        ) -> None:
            if expr is None or isinstance(expr, (int, float)):
                return
            slopes = m.along_speeds(expr) if to is None else b.grad(expr, to)
            for k, poly in enumerate(map(a.of, m.public_all([factor * d for d in slopes]))):
                if poly.terms:
                    note = ROLES.get((card.spec.word, role), f"{card.spec.word} {{}}").format(card.name)
                    into[k].append(Part(card.name, poly, rate, False, note))

        for card in m.active:
            kinetic, potential, coenergy = card.kinetic(m), card.potential(m), card.coenergy(m)
            spread(kinetic, us, momenta, 1.0, card, "T", True)
            spread(coenergy, us, momenta, 1.0, card, "W", True)
            spread(kinetic, None, forces, 1.0, card, "T")
            spread(potential, None, forces, -1.0, card, "V")
            spread(coenergy, None, forces, 1.0, card, "W")
        for card, effort, flow in m.efforts:
            spread(flow, us, forces, effort, card, "P")
        drift: list[list[Part]] = [[] for _ in own]
        for row, rate in zip(m.rows, m.row_rates(m.rows), strict=True):
            entered = [(b.grad(rate, us), row.row, forces, "reaction of")]
            if not row.of_speeds:
                entered.append((m.along_speeds(row.h), row.mu_row, drift, "correction for"))
            for slopes, unknown, into, word in entered:
                for k, poly in enumerate(map(a.of, m.public_all([b.x(unknown) * d for d in slopes]))):
                    if poly.terms:
                        into[k].append(Part(row.owner, poly, False, False, f"{word} {row.owner}"))
        for group in m.groups:
            at = [own.index(c) for c in group.speeds]
            p = [m.momenta[k] for k in at]
            for k, e in zip(at, group.kind.gyration([c.u for c in group.speeds], p), strict=True):
                poly = a.of(m.public(-1.0 * e))
                forces[k].append(Part(own[k].of, poly, False, False, f"axes of {own[k].of} turn"))
            for c in group.places:
                held = [b.x(row.mu_row) * b.grad(row.h, [c.q])[0] for row in m.norms]
                right = [Part(c.of, a.of(e)) for e in (c.rate, *(-1.0 * e for e in held)) if e.value != 0.0]
                yield Row(c.row, MOTION, f"definition of {c.q_name}", [Part(c.of, a.x(c.row), True)], right)
        for k, c in enumerate(own[: self.MOST_ROWS]):
            turned = [Part(p.owner, a.scale(-1.0, p.poly), False, False, p.note) for p in drift[k]]
            if c.row >= 0:
                rate = Part(c.of, a.x(c.row), True)
                right = [Part(c.of, a.x(c.speed_row)), *turned]
                yield Row(c.row, MOTION, f"definition of {c.u_name}", [rate], right)
            total = a.sum((1.0, p.poly) for p in momenta[k])
            whose = ", ".join(dict.fromkeys(p.owner for p in momenta[k]))
            left = [Part(whose, total, True, False, f"inertia of {whose}")]
            yield Row(
                c.speed_row, MOTION, f"motion of {c.of}, {c.q_name or c.u_name}", left, _merged(a, forces[k])
            )

    def _closure(self) -> Iterable[Row]:
        m, a = self.machine, self.algebra
        for row in m.norms:
            title = f"coordinates of {row.owner} have length 1"
            yield Row(row.mu_row, CLOSURE, title, [Part(row.owner, a.of(m.public(row.h)))], [])
        for row in m.rows:
            rate, gap = m.public_all([*m.row_rates([row]), row.h])
            label = {"x": "along x", "y": "along y", "z": "along z"}.get(row.label, row.label)
            if not row.of_speeds:
                title = f"{row.owner} closes, {label}"
                yield Row(row.mu_row, CLOSURE, title, [Part(row.owner, a.of(gap))], [])
            title = (
                f"speeds at {row.owner}, {label}" if row.of_speeds else f"{row.owner} stays closed, {label}"
            )
            yield Row(row.row, CLOSURE, title, [Part(row.owner, a.of(rate))], [])

    # energies --------------------------------------------------------------------------------------

    def _machine_energies(self) -> list[Energy]:
        m, a = self.machine, self.algebra
        found: list[Energy] = []
        if m is None:
            return found
        for kind, verb in (("T", "kinetic"), ("V", "potential"), ("W", "coenergy"), ("P", "losses")):
            for card in m.active:
                value = getattr(card, verb)(m) if self.only is None or card.name in self.only else None
                if value is None or len(found) > self.MOST_ROWS:
                    continue
                poly = a.of(m.public(value))
                if poly.value is None:
                    found.append(Energy(kind, card.name, card.spec.word, poly, card.spec.laws.get(kind, "")))
        return found

    def _circuit_energies(self, assembly: Assembly) -> list[Energy]:
        laws = {"C": "C v^2/2", "L": "L i^2/2", "K": "M i1 i2", "R": "v^2/R"}
        found: list[Energy] = []
        for entry in assembly.accounts.entries if assembly.accounts is not None else ():
            if self.only is not None and entry.name not in self.only:
                continue
            if (
                entry.word in ("C", "L", "K", "R", "S", "W")
                and entry.kind in ("stored", "dissipated")
                and len(found) < self.MOST_ROWS
            ):
                kind = "W" if entry.kind == "stored" else "P"
                found.append(
                    Energy(
                        kind, entry.name, entry.word, self.algebra.of(entry.expr), laws.get(entry.word, "")
                    )
                )
        return sorted(found, key=lambda e: e.kind)

    def _name_long(self) -> list[tuple[str, Atom]]:
        """s_1, s_2, .. for what repeats in summands that are too long to read; innermost first."""
        counts: dict[Atom, int] = {}

        def count(p: Poly) -> None:
            for monomial in p.terms:
                for atom, _ in monomial:
                    counts[atom] = counts.get(atom, 0) + 1
                    if counts[atom] == 1:
                        for arg in atom.args:
                            count(arg)

        weights: dict[Atom, int] = {}
        for row in self.rows:
            parts = [*row.left, *row.right]
            if any(self._weight(p.poly, weights) > LONG for p in parts):
                for part in parts:
                    count(part.poly)
        repeated = sorted(
            (a for a, n in counts.items() if n > 1 and a.args and not a.trig), key=lambda a: a.order
        )
        weights.clear()
        for atom in repeated:
            # what has been named already makes others short
            if sum(self._weight(p, weights) for p in atom.args) > LONG // 4:
                self.names.named[atom] = f"s_{len(self.names.named) + 1}"
                weights[atom] = 1
        self._trim(weights)
        return [(name, atom) for atom, name in self.names.named.items()]

    def _trim(self, weights: dict[Atom, int]) -> None:
        """No more symbols than MOST_WEIGHT: long formulas lose their ends first, then rows and energies are left out."""
        for name in ("rows", "energies"):
            items = getattr(self, name)
            sizes = [
                [
                    self._weight(p, weights)
                    for p in ([e.poly] if isinstance(e, Energy) else [p.poly for p in (*e.left, *e.right)])
                ]
                for e in items
            ]
            for most in SHORTER:
                self.layout.most = min(self.layout.most, most)
                if sum(min(n, 2 * most) for mine in sizes for n in mine) <= self.MOST_WEIGHT:
                    break
            total = 0
            for k, mine in enumerate(sizes):
                total += sum(min(n, 2 * self.layout.most) for n in mine)
                if total > self.MOST_WEIGHT and k:
                    del items[k:]
                    break
        self.left_out = self.size - len(self.rows)

    def _weight(self, p: Poly, known: dict[Atom, int]) -> int:
        """Symbols and numbers of a sum when it is written out; `known` are those of atoms."""
        total = 0
        for monomial, c in p.terms.items():
            total += abs(c) != 1.0
            for atom, _ in monomial:
                if atom not in known:
                    known[atom] = 1 + sum(self._weight(a, known) for a in atom.args)
                total += known[atom]
        return total

    # the rest --------------------------------------------------------------------------------------

    def _conditions(self) -> list[tuple[str, Poly, Poly | None, str]]:
        found = []
        warnings = getattr(self.machine, "flag_warnings", {})
        for k, (name, up, down) in enumerate(self.system.flags[: self.MOST_ROWS]):
            remark = warnings.get(name, "") or (self.what(name) if name in self.ctx.elements else "")
            if name in self.ctx.domains:
                remark = self.ctx.domains[name][1]
            below = None if up.id == down.id else self.algebra.of(down)
            found.append((f"c{k + 1}", self.algebra.of(up), below, remark))
        return found

    def _sources(self) -> list[tuple[str, str]]:
        found = []
        for k, (kind, args, _) in enumerate(self.recorder.waves[: self.MOST_ROWS]):
            if kind in CONSTANT:
                continue
            words = WAVE_ARGUMENTS.get(kind, "").split()
            shown = [f"{w}={v:g}" for w, v in zip(words, args, strict=False)] or [f"{v:g}" for v in args[:24]]
            more = " .." if not words and len(args) > 24 else ""
            found.append((f"{self.names.waves[k]}(t)", f"{kind.upper()}({' '.join(shown)}{more})"))
        return found


def _merged(a: Algebra, parts: list[Part]) -> list[Part]:
    found: dict[str, Part] = {}
    for part in parts:
        before = found.get(part.note)
        poly = part.poly if before is None else a.add(before.poly, part.poly)
        found[part.note] = Part(part.owner, poly, part.rate, part.quotient, part.note)
    return list(found.values())


def folded(x: Explained) -> list[str]:
    """What the deck says and the equations need not: sentences."""
    said: list[str] = []
    m, recorder = x.machine, x.recorder
    constant = [x.names.waves[k] for k, (kind, _, _) in enumerate(recorder.waves) if kind == "dc"]
    if constant:
        said.append(f"{_list(constant)}: constant, so a number stands in the equations")
    if m is None:
        return said
    if not any(j.kind.leaves_plane() for j in m.joints.values()):
        said.append("no joint leaves the plane: z and turns about x and y do not appear")
    if m.folded:
        said.append(
            f"{m.folded} closure rows that nothing in the scene can break (a loop in the plane stays in the plane)"
        )
    if x.ctx.flat.gravity is None:
        said.append("there is no .gravity card: bodies have no weight")
    for joint in m.joints.values():
        if not joint.cut and not joint.kind.coordinates:
            said.append(f"{joint.name} is a weld: {joint.b} moves with {joint.a} and needs no coordinate")
    for tie in m.ties.values():
        said.append(
            f"{tie.follower.q_name} = {tie.factor:g} * {tie.leader.q_name} by GEAR {tie.gear.name}: one coordinate for both"
        )
    for c in m.given:
        if c.drive is not None:
            said.append(
                f"{c.q_name} is prescribed by DRIVE {c.drive.name}: a function of time in place of an unknown"
            )
    for body in m.bodies.values():
        if body.fixed:
            said.append(f"{body.name} is fixed: part of the ground")
    if m.found.redundant:
        said.append(
            "redundant: "
            + _list([f"{row.owner} {row.label}" for row in m.found.redundant])
            + " say what other rows say already"
        )
    return said


def _list(words: list[str], most: int = 8) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")
