"""What elements may ask: of the circuit that they are part of, of the level of the deck that they stand on, of the words of their
lines; and what they fill in. One import has the types of all."""

from __future__ import annotations

import math

from ..expr import OUTSIDE
from .rows import Rows

__all__ = ["Accounts", "Cards", "Circuit", "Expr", "Level"]

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, Protocol

    from .._engine import Builder, Expr, Values
    from ..deck import Analysis, MachineCard
    from ..diagnostics import Sink, Span
    from ..draws import Draws
    from ..expr import Node, Scope
    from ..opened import Opened
    from .accounts import Accounts
    from .added import Library
    from .base import Element
    from .modules import Module
    from .words import Cards

    class Level(Protocol):
        """The top of the deck, or one use of a subcircuit (elaborate/bind.py)."""

        prefix: str

        @property
        def scope(self) -> Scope: ...

        def node(self, name: str, span: Span | None) -> str: ...

    class Flat(Protocol):
        """The deck on one level (elaborate/flat.py)."""

        sink: Sink
        temp: float
        tnom: float
        analyses: list[Analysis]
        draws: Draws
        elements: list[Element]
        inputs: Opened | None
        machine: list[MachineCard]
        modules: dict[str, Any]
        named: list[str]
        options: dict[str, float | str | bool]

        @property
        def added(self) -> Library: ...


class Circuit(Rows):
    """
    flat      the deck on one level; `sink`, `temp`, `tnom` [C] are its own
    options   resolved options (assemble/options.py)
    elements  element name -> Element
    starting  inductors whose current nothing limits at rest: a run starts with their ic=
    coupled   (branch, branch) of two inductors -> the sum of their coupling coefficients
    """

    def __init__(self, b: Builder, flat: Flat, options: dict[str, Any]) -> None:
        super().__init__(b, flat.sink)
        self.flat, self.options = flat, options
        self.temp, self.tnom = flat.temp, flat.tnom
        self.gmin: float = options["gmin"]
        self.elements: dict[str, Element] = {}
        self.starting: set[str] = set()
        self.series: dict[str, tuple[int, int, float]] = {}  # of diodes: node, inner node, conductance [S]
        self.coupled: dict[tuple[int, int], float] = {}
        self.wound: dict[str, str] = {}  # inductor on a core -> the K line that puts it there
        self.longest_step = math.inf  # that modules allow [s]
        self.given: dict[str, float] = {}  # voltages of nodes at a start with UIC (initial.py)
        self.inputs: dict[str, int] = {}  # of what comes from outside: the engine's number
        self.transferred: dict[str, Expr] = {}  # what a source's transfer function gives
        self.responses: list[tuple[str, Span | None]] = []  # of gains that only small signals know
        # (element, terminal on a joint) -> its node, its effort
        self.shafts: dict[tuple[str, int], tuple[int, int]] = {}
        # models whose parameters have been looked at: by which class, name
        self.checked: set[tuple[type, str]] = set()
        # parameters of .models as modules take them: by module, name, its `type`
        self.values: dict[tuple[Module, str, float | None], Values] = {}

    def compile(
        self, ast: Node, where: Span | None, holds: Callable[[], frozenset[str]] | None = None
    ) -> Expr:
        """Behavioural expression -> graph, with v() i() time temper and the machine's probes. What cannot be
        compiled is reported at its place and becomes 0, so that all of a deck's errors come out at once. Where a condition
        chooses the voltage of one of `holds`, that is what it was: these nodes follow from the expression itself."""
        raise NotImplementedError

    def wave(self, e: Element) -> int:
        """The engine's number of an independent source's waveform."""
        raise NotImplementedError

    def rise(self) -> Expr | None:
        """What independent sources are multiplied by while they are turned on; None where they are on."""
        raise NotImplementedError

    def value_at_start(self, e: Element) -> float:
        """What an independent source has when a run starts; the DC value in a deck that only looks for operating points."""
        raise NotImplementedError

    def initial(self, name: str) -> float:
        """Initial voltage of a node under UIC: what ic= and .ic give it, or 0 [V]."""
        return self.given.get(name, 0.0)

    def element_name(self, name: str, letter: str = "") -> str:
        """An element's flat name from its own or from ngspice's spelling: v.x1.v1 is x1.v1."""
        if name not in self.elements and len(name) > 2 and name[1] == "." and name[2:] in self.elements:
            return name[2:]
        return name

    def input(self, name: str) -> int:
        """The engine's number of a value that comes from outside (flat.inputs)."""
        if name not in self.inputs:
            assert self.flat.inputs is not None
            self.inputs[name] = self.b.input(self.flat.inputs[name])
        return self.inputs[name]

    def by_hand(self, name: str, control: Expr, way: float = 1.0) -> Expr:
        """A switch's control, and what a hand adds to it, `way` upwards or downwards to close it."""
        from ..opened import hand_on

        word = OUTSIDE + hand_on(name)
        if word not in (self.flat.inputs or ()):
            return control
        return control + way * self.b.wave_expr(self.input(word))

    def starts_at_rest(self) -> bool:
        """Does every run start from an operating point? False where there is no run."""
        runs = [a for a in self.flat.analyses if a.kind == "tran"]
        return bool(runs) and all("uic" not in a.flags for a in runs)
