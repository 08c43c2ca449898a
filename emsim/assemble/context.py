"""The meeting room of circuit and machine: one builder, one table of nodes and branches, one place for errors.

A Context lives from the first node to the compiled system. What it has of the circuit alone, which is what elements see, is
in elements/contract.py; unknowns and expressions are in elements/rows.py; expressions of a deck's text in compiling.py.

Order of events (assemble/__init__.py):
 1. the circuit allocates nodes and branches      4. the machine cards contribute
 2. the machine builds its scene and branches     5. outputs are compiled, then the system
 3. the elements contribute
"""

from __future__ import annotations

from ..diagnostics import Sink
from ..elements.contract import Circuit
from .waves import of_source

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any, TypeVar

    from .._engine import Builder, Expr
    from ..diagnostics import Span
    from ..elaborate.flat import FlatDeck
    from ..elements.base import Element
    from ..expr import Node

    T = TypeVar("T")

DRAWN = 200  # elements of a circuit whose drawing shows currents
LEAST_EXCURSION = 1e-9  # below zero: less is rounding and truncation
# how LTspice turns independent sources on (its help, ".TRAN"): times [s] and factors
STARTUP = (0.0, 0.0, 20e-6, 1.0)
FROZEN = 3  # place of the time at which waveforms are held, in `times`


class Output:
    """One column: its name as users write it, its unit, and the expression; in place of this `ast` where the column follows
    from others once they are there (signals.py)."""

    __slots__ = ("ast", "expr", "name", "unit")

    def __init__(self, name: str, unit: str, expr: Expr | None, ast: Node | None = None) -> None:
        self.name, self.unit, self.expr, self.ast = name, unit, expr, ast

    def __repr__(self) -> str:
        return f"{self.name} [{self.unit}]"


class Context(Circuit):
    """What contributors see.

    machine   the assembled machine, or None; `scale` its size, for the tolerances
    domains   flag name -> (flag, text, place): functions that may leave their domain during a run
    divisors  quotients in expressions, with what they divide by and its place
    poles     expressions with their divisors that read the machine, which knows where it starts
    """

    flat: FlatDeck

    def __init__(self, b: Builder, flat: FlatDeck, options: dict[str, Any]) -> None:
        super().__init__(b, flat, options)
        self.domains: dict[str, tuple[Expr, str, Span | None]] = {}
        self.wholes: dict[str, Expr] = {}  # energy(), loss(), supplied()
        self.summing: set[str] = set()  # those that are being made
        self.divisors: dict[int, tuple[Expr, Expr, Span | None]] = {}
        self.poles: list[tuple[Expr, list[tuple[Expr, Span | None]]]] = []
        self.machine: Any = None
        self.shares = False  # does the machine share loads where equilibrium does not say how? (sharing.py)
        self.scale: Any = None
        # (tstep, tstop) that waveform defaults refer to: of the first .tran, or of the one that runs
        # tstep, tstop, the period of all waveforms; or, behind a 0, the time at which they are held
        self.times: tuple[float, ...] = (1.0, 1.0)
        self.names_own = False  # an analysis has columns that are no signals of the deck: onoise_spectrum
        self.unpacked: list[Any] = []  # FMUs of the deck: their folders are there as long as this is
        self.signals: dict[str, Expr] = {}  # of blocks, as circuit and machine see them: pi.u
        self.saved: dict[str, Output] | None = None  # columns that every analysis records (outputs.py)
        self.is_drawn = flat.is_drawn and 0 < len(flat.elements) + len(flat.machine) <= DRAWN
        self.aside: set[str] = set()  # branches that only the drawing of the circuit reads
        self._waves: dict[str, int] = {}
        self._rise: list[Expr] = []  # what `rise` gives, once it is made

    def wave(self, e: Element) -> int:
        """The engine's number of an independent source's waveform."""
        k = self._waves.get(e.name)
        if k is None and e.name in (self.flat.inputs or ()):
            k = self._waves[e.name] = self.input(e.name)
        if k is None:
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
        runs = any(a.kind == "tran" for a in self.flat.analyses)
        if self.rise() is not None:
            return 0.0
        kind, args, dc = of_source(e, self.times, Sink(), runs)
        return dc if dc is not None and not runs else self.b.wave_at(kind, args, 0.0)

    def rise(self) -> Expr | None:
        """What independent sources are multiplied by where .tran says `startup`, as in LTspice: from 0 at rest to 1 in the
        first 20 us. None where it does not."""
        card = next((a for a in self.flat.analyses if a.kind == "tran" and "startup" in a.flags), None)
        if card is None:
            return None
        if not self._rise:
            others = [a for a in self.flat.analyses if a.kind != "tran" or "startup" not in a.flags]
            if others:
                said = f"`startup` turns the sources off before the run, which .{others[0].kind} of the same deck cannot have"
                hint = "LTspice runs one analysis at a time: put a * before the others"
                self.sink.error("E113", said, card.span, hint, labels=[(others[0].span, "also asked for")])
            self._rise.append(self.b.wave_expr(self.b.wave("pwl", STARTUP, None)))
        return self._rise[0]

    def in_turn(self, contributors: Iterable[T]) -> Iterable[T]:
        """The contributors, one after the other; where a deck is explained (recording.py), whose turn it is is noted."""
        return contributors

    def outside_energy(self, up: Expr) -> Expr:
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
