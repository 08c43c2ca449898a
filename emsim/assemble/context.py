"""The meeting room of circuit and machine: one builder, one table of nodes and branches, one place for error

A Context lives from the first node to the compiled system. Rows and unknowns are the same list: row i of
d/dt Q(x) + F(x, t) = 0 belongs to unknown i, index -1 is ground and every stamp on it is dropped.

Order of events (assemble/__init__.py):
 1. the circuit allocates nodes and branches      4. the machine cards contribute
 2. the machine builds its scene and branches     5. outputs are compiled, then the system
 3. the elements contribute
"""

from __future__ import annotations

import math
from itertools import pairwise

from ..diagnostics import Sink, suggest
from ..expr import OUTSIDE
from ..opened import hand_on

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, TypeVar

    from .._engine import Builder, Expr
    from ..diagnostics import Span
    from ..elaborate.flat import FlatDeck
    from ..elements import Element
    from ..expr import Node
    from .behaviour import Compiler
    from .outputs import Output

    T = TypeVar("T")

GROUND = ("0", "gnd")
DRAWN = 200  # elements of a circuit whose drawing shows currents
SHOWN = 8  # names that a hint lists
ON_THE_NUMBER = 1e-9  # so little below a whole number is that number: rounding
LEAST_EXCURSION = 1e-9  # below zero: less is rounding and truncation


FROZEN = 3  # place of the time at which waveforms are held, in `times`


SMALL_SIGNALS = "small signals"  # the flag that is 1 where the equations are linearised for these


class Context:
    """What contributors see.

    b         the engine's builder
    flat      the deck on one level; `sink`, `temp`, `tnom` [C] are its own
    options   resolved options (assemble/options.py)
    nodes     node name -> unknown (ground left out); `branches` element or coupling name -> current unknown
    elements  element name -> Element
    machine   the assembled machine, or None; `scale` its size, for the tolerances
    conditions  number of a flag -> place of the expression that it belongs to
    domains   flag name -> (flag, text, place): functions that may leave their domain during a run
    divisors  quotients in expressions, with what they divide by and its place
    poles     expressions with their divisors that read the machine, which knows where it starts
    starting  inductors whose current nothing limits at rest: a run starts with their ic=
    coupled   (branch, branch) of two inductors -> the sum of their coupling coefficients
    """

    def __init__(self, b: Builder, flat: FlatDeck, options: dict[str, Any]) -> None:
        self.b, self.flat, self.options = b, flat, options
        self.sink: Sink = flat.sink
        self.temp, self.tnom = flat.temp, flat.tnom
        self.gmin: float = options["gmin"]
        self.nodes: dict[str, int] = {}
        self.branches: dict[str, int] = {}
        self.elements: dict[str, Element] = {}
        self.flags: dict[str, Expr] = {}
        self.starting: set[str] = set()
        self.conditions: dict[int, Span | None] = {}
        self.series: dict[str, tuple[int, int, float]] = {}  # of diodes: node, inner node, conductance [S]
        self.domains: dict[str, tuple[Expr, str, Span | None]] = {}
        self.wholes: dict[str, Expr] = {}  # energy(), loss(), supplied()
        self.summing: set[str] = set()  # those that are being made
        self.divisors: dict[int, tuple[Expr, Expr, Span | None]] = {}
        self.poles: list[tuple[Expr, list[tuple[Expr, Span | None]]]] = []
        self.coupled: dict[tuple[int, int], float] = {}
        self.wound: dict[str, str] = {}  # inductor on a core -> the K line that puts it there
        self.machine: Any = None
        self.shares = False  # does the machine share loads where equilibrium does not say how? (sharing.py)
        self.scale: Any = None
        # (tstep, tstop) that waveform defaults refer to: of the first .tran, or of the one that runs
        # tstep, tstop, the period of all waveforms; or, behind a 0, the time at which they are held
        self.times: tuple[float, ...] = (1.0, 1.0)
        self.names_own = False  # an analysis has columns that are no signals of the deck: onoise_spectrum
        self.longest_step = math.inf  # that modules allow [s]
        self.ics: dict[str, float] = {}
        self.given: dict[str, float] = {}  # voltages of nodes at a start with UIC (initial.py)
        # name of a digital node -> its number, its level as an expression: 0, 1, 1/2 where it is undefined
        self.digital: dict[str, tuple[int, Expr]] = {}
        self.signals: dict[str, Expr] = {}  # of blocks, as circuit and machine see them: pi.u
        self.saved: dict[str, Output] | None = None  # columns that every analysis records (outputs.py)
        self.is_drawn = flat.is_drawn and 0 < len(flat.elements) + len(flat.machine) <= DRAWN
        self.aside: set[str] = set()  # branches that only the drawing of the circuit reads
        self._waves: dict[str, int] = {}
        self.inputs: dict[str, int] = {}  # of what comes from outside: the engine's number
        self.still: Expr | None = None  # 1 at the DC point, 0 in a run
        self.delayed: list[int] = []  # unknowns that read what was a time ago
        self.transferred: dict[str, Expr] = {}  # what a source's transfer function gives
        self.responses: list[tuple[str, Span | None]] = []  # of gains that only small signals know
        self._ddts: dict[int, int] = {}
        self.shafts: dict[
            tuple[str, int], tuple[int, int]
        ] = {}  # (element, terminal on a joint) -> its node, its effort
        self.checked: set[tuple[type, str]] = (
            set()
        )  # models whose parameters have been looked at: by which class, name
        self._remarked: set[str] = set()
        self._compiler: Compiler | None = None

    # unknowns ------------------------------------------------------------------------------------

    def node(self, name: str) -> int:
        """Unknown of a node, made at its first mention; -1 for ground."""
        if name in GROUND:
            return -1
        index = self.nodes.get(name)
        if index is None:
            index = self.nodes[name] = self.b.unknown(name, "node", "V", self.ics.get(name, 0.0))
        return index

    def inner_node(self, name: str) -> int:
        """A node of an element's own; it is no output and nobody else can name it."""
        return self.b.unknown(name, "node", "V", 0.0)

    def digital_node(self, name: str) -> tuple[int, Expr]:
        """A digital node (its number, its level), made at its first mention."""
        if name not in self.digital:
            number, wave = self.b.digital_node(name)
            self.digital[name] = (number, self.b.wave_expr(wave))
        return self.digital[name]

    def initial(self, name: str) -> float:
        """Initial voltage of a node under UIC: what ic= and .ic give it, or 0 [V]."""
        return self.given.get(name, 0.0)

    def new_branch(self, name: str, initial: float = 0.0) -> int:
        """A current unknown; `initial` counts under UIC."""
        index = self.branches[name] = self.b.unknown(name, "branch", "A", initial)
        return index

    def branch(self, name: str) -> int | None:
        """Current unknown of a voltage-defined element or of a coupling; None where there is none."""
        return self.branches.get(name)

    def v(self, p: str, n: str | None = None) -> Expr:
        """Voltage of node p, against n when given [V]; of a digital node its level."""
        value = self._voltage(p)
        return value if n is None or n in GROUND else value - self._voltage(n)

    def _voltage(self, name: str) -> Expr:
        if name in self.digital and name not in self.nodes:
            return self.digital[name][1]
        index = self.node(name)
        return self.b.x(index) if index >= 0 else self.b.const(0.0)

    def element_name(self, name: str, letter: str = "") -> str:
        """An element's flat name from its own or from ngspice's spelling: v.x1.v1 is x1.v1."""
        if name not in self.elements and len(name) > 2 and name[1] == "." and name[2:] in self.elements:
            return name[2:]
        return name

    def ddt(self, e: Expr, name: str) -> Expr:
        """Time derivative of e, an unknown d of its own with the row d/dt e - d = 0; zero at the DC point."""
        if e.value is not None:
            return self.b.const(0.0)
        index = self._ddts.get(e.id)
        if index is None:
            index = self._ddts[e.id] = self.b.unknown(name, "derivative", "", 0.0)
            self.b.add_q(index, e)
            self.b.g(index, index, -1.0)
        return self.b.x(index)

    def idt(self, e: Expr, start: float, name: str) -> Expr:
        """Time integral of e from `start`, a state that the DC point holds."""
        index = self.b.unknown(name, "coordinate", "", start)
        self.b.c(index, index, 1.0)
        self.b.add_f(index, -e)
        return self.b.x(index)

    def delay(self, e: Expr, td: float, name: str, initial: float = 0.0) -> Expr:
        """What e was `td` [s] ago, a current unknown of its own; at the DC point e itself, before a start from given values
        `initial`. Runs keep what was, small signals turn its phase (engine/src/system/delays.rs)."""
        b = self.b
        index = b.unknown(name, "branch", "A", initial)
        past = b.wave_expr(b.delay(index, e, td, initial))
        still = self.standstill()
        b.add_f(index, b.x(index) - still * e - (1.0 - still) * past)
        self.delayed.append(index)
        return b.x(index)

    def input(self, name: str) -> int:
        """The engine's number of a value that comes from outside (flat.inputs)."""
        if name not in self.inputs:
            assert self.flat.inputs is not None
            self.inputs[name] = self.b.input(self.flat.inputs[name])
        return self.inputs[name]

    def by_hand(self, name: str, control: Expr, way: float = 1.0) -> Expr:
        """A switch's control, and what a hand adds to it, `way` upwards or downwards to close it."""
        word = OUTSIDE + hand_on(name)
        if word not in (self.flat.inputs or ()):
            return control
        return control + way * self.b.wave_expr(self.input(word))

    def standstill(self) -> Expr:
        """1 at operating points and in small signals, 0 in a run."""
        if self.still is None:
            self.still = self.b.wave_expr(self.b.still())
        return self.still

    def wave(self, e: Element) -> int:
        """The engine's number of an independent source's waveform."""
        k = self._waves.get(e.name)
        if k is None and e.name in (self.flat.inputs or ()):
            k = self._waves[e.name] = self.input(e.name)
        if k is None:
            from .waves import of_source

            runs = any(a.kind in ("tran", "ss", "pss") for a in self.flat.analyses)
            kind, args, dc = of_source(e, self.times, self.sink, runs)
            try:
                if len(self.times) > FROZEN:
                    kind, args, dc = "dc", [self.b.wave_at(kind, args, self.times[FROZEN])], None
                k = self.b.wave(kind, args, dc)
            except ValueError as trouble:
                self.sink.error("E292", f"{e.name}: {trouble}", e.wave.span if e.wave else e.span)
                k = self.b.wave("dc", [0.0], None)
            self._waves[e.name] = k
        return k

    def value_at_start(self, e: Element) -> float:
        """What an independent source has when a run starts; the DC value in a deck that only looks for operating points."""
        from .waves import of_source

        runs = any(a.kind == "tran" for a in self.flat.analyses)
        kind, args, dc = of_source(e, self.times, Sink(), runs)
        return dc if dc is not None and not runs else self.b.wave_at(kind, args, 0.0)

    def starts_at_rest(self) -> bool:
        """Does every run start from an operating point? False where there is no run."""
        runs = [a for a in self.flat.analyses if a.kind == "tran"]
        return bool(runs) and all("uic" not in a.flags for a in runs)

    def in_turn(self, contributors: Iterable[T]) -> Iterable[T]:
        """The contributors, one after the other; where a deck is explained (recording.py), whose turn it is is noted."""
        return contributors

    # expressions ---------------------------------------------------------------------------------

    def compile(
        self, ast: Node, where: Span | None, holds: Callable[[], frozenset[str]] | None = None
    ) -> Expr:
        """Behavioural expression -> graph, with v() i() time temper and the machine's probes. What cannot be
        compiled is reported at its place and becomes 0, so that all of a deck's errors come out at once. Where a condition
        chooses the voltage of one of `holds`, that is what it was: these nodes follow from the expression itself."""
        if self._compiler is None:
            from .behaviour import Compiler

            self._compiler = Compiler(self)
        return self._compiler.compile(ast, where, holds)

    def abs_(self, e: Expr) -> Expr:
        """|e|, its kink a held flag."""
        if e.value is not None:
            return self.b.const(abs(e.value))
        return self.b.select(self.kink(e), e, -e)

    def min_(self, a: Expr, b: Expr) -> Expr:
        if a.value is not None and b.value is not None:
            return a if a.value <= b.value else b
        return self.b.select(self.kink(a - b), b, a)

    def max_(self, a: Expr, b: Expr) -> Expr:
        if a.value is not None and b.value is not None:
            return a if a.value >= b.value else b
        return self.b.select(self.kink(a - b), a, b)

    def clamp(self, e: Expr, lo: float | Expr, hi: float | Expr) -> Expr:
        low = self.b.const(lo) if isinstance(lo, (int, float)) else lo
        high = self.b.const(hi) if isinstance(hi, (int, float)) else hi
        return self.min_(self.max_(e, low), high)

    def floor_(self, e: Expr, halves_to_even: bool = False) -> Expr:
        """The whole number n below e, its jumps held flags; halves_to_even: e is a half above what is rounded.

        Two flags tell n modulo 4, and one of them flips from each whole number to the next. Given this remainder r, the
        nearest r + 4 k to e - 1/2 stays n while a step runs on past n + 1, until its flag flips at the located event.
        """
        b = self.b
        turn = math.pi / 2
        angle = turn * (e - 4.0 * b.call("floor", 0.25 * e))
        past = turn * ON_THE_NUMBER
        half = self.flag(b.call("sin", angle + past))
        outer = self.flag(b.call("cos", angle - past if halves_to_even else angle + past))
        zero, one, two, three = map(b.const, (0.0, 1.0, 2.0, 3.0))
        r = b.select(half, b.select(outer, zero, one), b.select(outer, three, two))
        return r + 4.0 * b.call("round", 0.25 * (e - 0.5 - r))

    def flag(self, up: Expr, name: str = "") -> Expr:
        """1 while up > 0, else 0; changes only at located events. Constants fold. One flag per expression. Of flags and
        constants alone no event is needed: their comparison is 0 or 1 at once."""
        return self._flag(up, name, "")

    def kink(self, up: Expr) -> Expr:
        """The same where both sides agree at zero, so that nothing happens while `up` stays there."""
        return self._flag(up, "", "stays")

    def small_signals(self) -> Expr:
        """0, and 1 where the equations are linearised for small signals."""
        found = self.flags.get(SMALL_SIGNALS)
        if found is None:
            zero = self.b.const(0.0)
            found = self.flags[SMALL_SIGNALS] = self.b.flag(zero, None, SMALL_SIGNALS, 0, 0, law="kept")
        return found

    def memory(self, node: str) -> Expr:
        """Voltage of a node as it was before the last event [V]."""
        key = f"memory {node}"
        found = self.flags.get(key)
        if found is None:
            found = self.flags[key] = self.b.flag(self.v(node), None, key, law="memory")
        return found

    def _flag(self, up: Expr, name: str, law: str) -> Expr:
        if up.value is None:
            up = self._outside_energy(up)
        if up.value is not None:
            return self.b.const(1.0 if up.value > 0 else 0.0)
        if self.b.is_logic(up):
            sign = self.b.call("sgn", up)
            return 0.5 * (sign * sign + sign)
        key = f"#{up.id} {law}"
        found = self.flags.get(key)
        if found is None:
            found = self.flags[key] = self.b.flag(up, None, name, -1, law=law)
            self.conditions.setdefault(int(found.node[1]), self._compiler.where if self._compiler else None)
        return found

    def _outside_energy(self, up: Expr) -> Expr:
        """A condition inside a TRANSDUCER's energy speaks of free symbols; the flag needs the real coordinate."""
        own = getattr(self.machine, "own_symbols", None)
        if own is None:
            return up
        joints = self.machine.joints
        real = [(symbol, joints[name].q) for name, symbol in own.coordinates.items()]
        up = self.machine.public(self.b.substitute([up], real)[0])
        if any(self.b.depends(up, own.electrical)):
            card = self.machine.couplings.get(own.card)
            self.sink.error(
                "E308", f"a condition in the energy of {own.card} depends on its own voltage or current",
                card.span if card is not None else None, hint="conditions may depend on the joint's coordinate",
            )  # fmt: skip
            return self.b.const(0.0)
        return up

    def watch(self, e: Expr, text: str, where: Span | None) -> None:
        """Remember to say `text` when e falls below zero during a run."""
        name = f"domain {e.id}"
        in_energy = getattr(self.machine, "own_symbols", None) is not None
        if e.value is None and name not in self.domains and not in_energy:
            self.domains[name] = (self.b.flag(-e - LEAST_EXCURSION, None, name, -1), text, where)

    def divided(self, quotient: Expr, by: Expr, where: Span | None) -> None:
        """Remember to say so when `by` is zero at the operating point and the quotient is not."""
        if quotient.value is None and getattr(self.machine, "own_symbols", None) is None:
            self.divisors.setdefault(quotient.id, (quotient, by, where))

    def divided_by_motion(self, whole: Expr, divisors: list[tuple[Expr, Span | None]]) -> None:
        """Remember an expression that divides by something of the machine; in an energy its own voltage or current is 1."""
        own = getattr(self.machine, "own_symbols", None)
        if own is not None:
            places = [
                *((symbol, self.machine.joints[name].q) for name, symbol in own.coordinates.items()),
                *((symbol, self.b.const(1.0)) for symbol in own.electrical),
            ]
            es = self.b.substitute([whole, *(e for e, _ in divisors)], places)
            whole, divisors = es[0], [(e, at) for e, (_, at) in zip(es[1:], divisors, strict=True)]
        self.poles.append((whole, divisors))

    def table(
        self,
        x: Expr,
        points: Sequence[tuple[float, float]],
        clamped: bool,
        where: Span | None,
        rounding: float = 0.0,
        share: bool = True,
    ) -> Expr:
        """Piecewise linear y(x); beyond the ends constant if `clamped`, else along the last segments.

        `rounding` r turns the corner at x_k into the parabola that joins its two lines smoothly at x_k - d
        and x_k + d, with d = r times the shorter segment beside it, or d = r but for half of that (not `share`).
        """
        if len(points) < 2 or any(a[0] >= b[0] for a, b in pairwise(points)):
            self.sink.error(
                "E286", "the abscissas of a table must ascend, and there must be two points at least", where
            )
            return self.b.const(0.0)
        slopes = [(y1 - y0) / (x1 - x0) for (x0, y0), (x1, y1) in pairwise(points)]
        widths = [x1 - x0 for (x0, _), (x1, _) in pairwise(points)]
        corners = list(points[1:-1])
        if clamped:
            slopes, widths, corners = [0.0, *slopes, 0.0], [float("inf"), *widths, float("inf")], list(points)

        # pieces y = y0 + m (x - x0) + a (x - x0)^2 and the places where one follows the other
        def line(x0: float, y0: float, m: float) -> Expr:
            return (y0 - m * x0) + m * x if m else self.b.const(y0)

        pieces, bounds = [line(*corners[0], slopes[0]) if corners else line(*points[0], slopes[0])], []
        for (xk, yk), before, after, left, right in zip(
            corners, slopes, slopes[1:], widths, widths[1:], strict=False
        ):
            d = rounding * min(left, right) if share else min(rounding, 0.5 * min(left, right))
            if d > 0.0 and before != after:
                s = x - (xk - d)
                pieces.append((yk - before * d) + before * s + ((after - before) / (4.0 * d)) * (s * s))
                bounds += [xk - d, xk + d]
            else:
                bounds.append(xk)
            pieces.append(line(xk, yk, after))

        def pick(lo: int, hi: int) -> Expr:
            # a balanced tree over the pieces: one flag a bound
            if hi - lo == 1:
                return pieces[lo]
            mid = (lo + hi) // 2
            return self.b.select(self.kink(x - bounds[mid - 1]), pick(mid, hi), pick(lo, mid))

        return pick(0, len(pieces))

    def remark(self, code: str, message: str, span: Span | None, hint: str | None = None) -> None:
        """A warning that is said once, however many elements give rise to it."""
        if message not in self._remarked:
            self._remarked.add(message)
            self.sink.warning(code, message, span, hint=hint)

    # errors --------------------------------------------------------------------------------------

    def unknown(
        self,
        code: str,
        message: str,
        word: str,
        candidates: Iterable[str],
        span: Span | None,
        more: str = "",
    ) -> None:
        """An error about a name; the hint is the nearest one that exists, or else `more` and what there is."""
        known = list(dict.fromkeys(name for name in candidates if "#" not in name))
        near = suggest(word, known)
        some = ", ".join(f"`{name}`" for name in known[:SHOWN]) + (", ..." if len(known) > SHOWN else "")
        parts = (
            [f"did you mean `{near}`?"]
            if near
            else [part for part in (more, some and f"there are {some}") if part]
        )
        self.sink.error(code, message, span, hint="; ".join(parts) or None)
