"""What the compiler knows of a machine while it builds it, and what it offers to cards and to its own parts.

The parts (coordinates, closing, start, equations, reactions, probes, ...) are functions of a Mechanism and know nothing of one
another's order; machine.py calls them in turn. The mechanism is the scene `s` that cards see (cards/base.py).
"""

from __future__ import annotations

from ..cards.kinematics import constant, dot, subtract
from ..expr import Node, names
from ..opened import OpenNumber
from . import asked
from .binding import Binding

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Expr
    from ..cards.base import Card, JointView, Own, PointView, Scalar
    from ..cards.kinematics import Frame
    from ..cards.laws import Law
    from ..diagnostics import Span
    from .context import Context
    from .loops import Row, Start
    from .scene import Coordinate, Group, JointState, Tie, Virtual
    from .sharing import Sharing
    from .tree import Plan


class Mechanism(Binding):
    guessed = True  # does guess= have a say in where it starts?

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
        self.groups: list[Group] = []  # of coordinates whose speeds are no derivatives
        self.rows: list[Row] = []
        self.norms: list[Row] = []  # on coordinates alone
        self.turned: dict[
            tuple[str, int], int
        ] = {}  # (joint, coordinate) -> unknown that follows a measured angle
        self.folded = 0
        self.found: Start
        # the equations
        self.in_space = False
        self.kinetic: Expr = self.b.const(0.0)
        self.momenta: list[Expr] = []
        self.laws: list[tuple[Card, Law]] = []  # with modes
        self.efforts: list[tuple[Card, Scalar, Scalar]] = []  # of all powers: effort and flow
        self.momentum: dict[int, tuple[Expr, Expr]] = {}
        self.operations = 0
        # reading
        self.wanted = asked.wanted(ctx.flat)
        self.derivatives: dict[str, int] = {}
        self.waiting: list[tuple[int, Any]] = []
        self.early: list[tuple[int, JointState, str]] = []  # reactions read before there are multipliers
        self.shares = ctx.shares  # do reactions that are not unique get the least of all answers?
        self.sharing: Sharing | None = None
        self.has_multipliers = False
        self.open_reactions: list[str] = []  # that the deck reads and equilibrium does not determine
        self.busy: set[str] = set()
        self.own_symbols: Own | None = None
        self.imbalances: list[tuple[str, Expr]] = []
        self.flag_warnings: dict[str, str] = {}
        self.openings: dict[str, Row] = {}  # flag -> redundant row that has come open
        self.clamps: list[tuple[Expr, float, float, str, str]] = []
        self._waves: dict[int, Expr] = {}  # of the deck's waveforms, by identity
        self._last_row = -1

    def all_coordinates(self) -> list[Coordinate]:
        """All of them in deck order: joints, then free bodies."""
        result = [c for joint in self.joints.values() for c in joint.coordinates]
        return result + [c for cs in self.roots.values() for c in cs]

    def initial_state(self) -> list[float]:
        """All unknowns at the start as the cards say it; electrical ones 0."""
        x = [0.0] * len(self.unknowns_so_far())
        for c in (*self.own, *self.given):
            if c.row >= 0:
                x[c.row] = c.start
            if c.speed_row >= 0:
                x[c.speed_row] = c.start_speed
        for (name, k), row in self.turned.items():
            card = self.joints[name].card
            start = card.start[k]
            x[row] = card.search[k] if start is None else start
        return x

    @property
    def start_is_known(self) -> bool:
        """Do all joints hold at the start, each by rows that say something new?"""
        return False

    # expressions -------------------------------------------------------------------------------------

    def public(self, e: Scalar) -> Expr:
        """`e` with symbols replaced by what they stand for."""
        if isinstance(e, (int, float)):
            return self.b.const(float(e))
        if isinstance(e, OpenNumber):
            e = e.expr
        return self.b.substitute([e], self.pairs)[0] if self.pairs else e

    def public_all(self, es: list[Expr]) -> list[Expr]:
        return self.b.substitute(es, self.pairs) if self.pairs else es

    def own_aware(self, e: Scalar) -> Expr:
        """Raw while a co-energy is compiled (it will be differentiated), else public."""
        return self.b.const(0.0) + e if self.own_symbols is not None else self.public(e)

    @property
    def places(self) -> list[Coordinate]:
        """Own coordinates."""
        return [c for c in self.own if c.row >= 0]

    @property
    def motions(self) -> list[Coordinate]:
        """Own speeds: as many as there are degrees of freedom without loops."""
        return [c for c in self.own if c.speed_row >= 0]

    def rate(self, e: Scalar) -> Expr:
        """de/dt along the motion."""
        return self.b.const(0.0) if isinstance(e, float) else self.rates([e])[0]

    def rates(self, es: list[Expr]) -> list[Expr]:
        """The same of several, in one pass over what they share."""
        seed: list[tuple[Expr, Any]] = [(c.q, c.rate) for c in self.places]
        seed += [(c.q, c.u) for c in self.given]
        seed += [(v.s, v.rate) for v in self.virtuals]
        seed.append((self.b.time(), 1.0))
        return self.b.tangent(es, seed)

    def on_speeds(self, by_place: list[Expr]) -> list[Expr]:
        """N^T of what belongs to the own coordinates, d/dq for instance: what it is for the own speeds."""
        at = {id(c): e for c, e in zip(self.places, by_place, strict=True)}
        result: dict[int, Expr] = {}
        for group in self.groups:
            for speed, column in zip(group.speeds, group.columns(), strict=True):
                parts = (n * at[id(c)] for c, n in zip(group.places, column, strict=True))
                result[id(speed)] = sum(parts, self.b.const(0.0))
        return [result[id(c)] if id(c) in result else at[id(c)] for c in self.motions]

    def along_speeds(self, e: Expr) -> list[Expr]:
        """de/du of de/dt: how `e` changes with each own speed, before symbols are replaced."""
        return self.on_speeds(self.b.grad(e, [c.q for c in self.places]))

    def row_rates(self, rows: list[Row]) -> list[Expr]:
        """What must be 0 of the speeds: dh/dt, or h of a row of speeds."""
        rates = iter(self.rates([row.h for row in rows if not row.of_speeds]))
        return [row.h if row.of_speeds else next(rates) for row in rows]

    def row_slopes(self, row: Row) -> list[Expr]:
        """How that changes with each own speed, before symbols are replaced."""
        return self.b.grad(row.h, [c.u for c in self.motions]) if row.of_speeds else self.along_speeds(row.h)

    # the scene that cards see (cards/base.py: Scene) --------------------------------------------------

    def frame(self, name: str) -> Frame:
        return self.frames[name]

    def joint(self, name: str) -> JointView:
        return self.joints[name]

    def speeds(self, joint: str) -> list[Expr]:
        return self.joints[joint].us

    def reads(self, name: str) -> bool:
        """Does the deck read the effort of this card?"""
        return any((fn, name) in self.wanted for fn in asked.EFFORTS)

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
        speeds = [(c.u_name, c.u) for c in (*self.motions, *self.given)]
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

    def minimum(self, a: Scalar, b: Scalar) -> Expr:
        return self.ctx.min_(self.public(a), self.public(b))

    def maximum(self, a: Scalar, b: Scalar) -> Expr:
        return self.ctx.max_(self.public(a), self.public(b))

    def body_of(self, card: Card, terminal: str) -> Frame:
        """The frame of the body that a point terminal is on."""
        ref = next(ref for name, _, ref in card.terminals if name == terminal)
        found = self.locate(ref.name, None if ref.point is None else tuple(float(v) for v in ref.point))
        assert found is not None
        return self.frames[found[0]]

    def clamp(self, e: Scalar, lo: float, hi: float, name: str, warn: str) -> Expr:
        e = self.public(e)
        if e.value is not None:
            return self.b.const(min(max(e.value, lo), hi))
        self.clamps.append((e, lo, hi, name, warn))
        over, under = self.told(e - hi, f"{name} high", warn), self.told(lo - e, f"{name} low", warn)
        return self.b.select(over, hi, self.b.select(under, lo, e))

    def told(self, e: Scalar, name: str, warn: str) -> Expr:
        """A flag, 1 while e > 0; a run in which it turns 1 says `warn`. `name`: of the card, a blank, a word."""
        self.flag_warnings[name] = warn
        return self.b.flag(self.public(e), None, name, -1)

    def at_start(self, es: Sequence[Scalar]) -> list[float]:
        """Values of expressions of coordinates where the machine starts."""
        x = [*self.found.x, *([0.0] * (2 * len(self.rows) + 2 * len(self.laws) + len(self.norms)))]
        return self.b.eval([self.public(e) for e in es], x, 0.0)

    def reaction(self, name: str, place: int = 0) -> Expr:
        raise NotImplementedError

    def load(self, joint: JointView) -> Expr | None:
        raise NotImplementedError

    # names -------------------------------------------------------------------------------------------

    def all_names(self) -> list[str]:
        return [*self.joints, *self.bodies, *self.couplings]

    def unknowns_so_far(self) -> range:
        """Indices of all unknowns up to the machine's last coordinate."""
        return range(self._last_row + 1)

    def _newest(self) -> int:
        """Index of the newest unknown: electrical ones came before, coordinates are last."""
        rows = [r for c in (*self.own, *self.given) for r in (c.row, c.speed_row)] + [*self.turned.values()]
        return max([*rows, *self.ctx.nodes.values(), *self.ctx.branches.values()], default=-1)

    def loop_of(self, owner: str) -> list[str]:
        """Joints of the loop that a cut joint closes, the joint last; of a gear or drive, its joints."""
        joint = self.joints.get(owner)
        if joint is not None:
            return [*self.plan.loop(joint.a, joint.b), owner]
        if owner in self.bodies:
            return [owner]
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
