"""Assembly: flat deck -> equation (1), compiled, and the columns that each analysis is to give."""

from __future__ import annotations

from .compiling import Compiling
from .context import Context, Output
from .outputs import printed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, ClassVar, Protocol

    from .._engine import Builder, System
    from ..elaborate.flat import FlatDeck
    from .accounts import Accounts
    from .clocked import Clocks
    from .drawing import Drawing
    from .flows import Flows
    from .machine import Machine

    class Analysis(Protocol):
        """What is asked of an analysis (analyses/base.py) before the equations are compiled."""

        @property
        def word(self) -> str: ...

        has_responses: ClassVar[bool]
        names_itself: ClassVar[bool]
        tables: ClassVar[tuple[str, ...]]
        shown: ClassVar[tuple[str, ...]]

        def columns(self, ctx: Context) -> list[Output]: ...


__all__ = ["Assembly", "Compiling", "Context", "Output", "assemble"]


class Assembly:
    """A compiled deck. `outputs` maps each of the `analyses` to its columns, without the axis."""

    def __init__(
        self,
        ctx: Context,
        system: System,
        outputs: dict[Analysis, list[Output]],
        prints: list[tuple[str, list[str]]],
        accounts: Accounts | None = None,
        analyses: Sequence[Analysis] = (),
    ) -> None:
        self.analyses = analyses
        self.ctx, self.system, self.outputs, self.prints = ctx, system, outputs, prints
        self.flat: FlatDeck = ctx.flat
        self.options: dict[str, Any] = ctx.options
        self.drawn: Drawing | None = None
        self.accounts = accounts
        self.flows: Flows | None = None  # of a circuit that is drawn
        self.measured_by: dict[Analysis, list[Output]] = {}

    def measured(self, analysis: Analysis) -> list[Output]:
        """The quantities that the .meas and .four cards of an analysis read."""
        from .outputs import measured

        if analysis not in self.measured_by:
            axis = getattr(analysis, "axis", None)
            self.measured_by[analysis] = measured(self.ctx, analysis.word, axis.name if axis else "")
        return self.measured_by[analysis]

    def noted(self) -> Assembly:
        """The same, with the equations as they were before they were compiled."""
        return assemble(self.flat, self.options, self.ctx.times, analyses=self.analyses, noted=True)

    def columns(self, word: str) -> list[Output]:
        """Of the last analysis of that name, such as "tran"."""
        return next((o for a, o in reversed(self.outputs.items()) if a.word == word), [])

    @property
    def machine(self) -> Any:
        return self.ctx.machine

    def drawing(self) -> Drawing | None:
        """The machine as its cards draw it, or None where there is no machine."""
        if self.drawn is None and self.machine is not None:
            from .drawing import draw

            self.drawn = draw(self.machine)
        return self.drawn


def assemble(
    flat: FlatDeck,
    options: dict[str, Any],
    times: tuple[float, ...],
    energy: bool = False,
    context: Callable[[Builder, FlatDeck, dict[str, Any]], Context] = Compiling,
    analyses: Sequence[Analysis] = (),
    noted: bool = False,
) -> Assembly:
    """Circuit and machine in one system. `times` (tstep, tstop) [s] fill in waveform defaults, a period behind them is that of
    all; `context` is Recording where the deck is to be explained, one with its builder in sweeps (numbered.py); `analyses` are
    those whose columns are compiled; `noted`: the system keeps its equations as they were before they were compiled.

    Raises DeckError with everything that is wrong with the deck.
    """
    from . import circuit, topology

    ctx, clocks = _unknowns(flat, options, times, context, noted=noted)
    if ctx.machine is not None and ctx.machine.open_reactions and not ctx.machine.shares:
        ctx, clocks = _unknowns(flat, options, times, context, shares=True, noted=noted)
    if ctx.machine is not None:
        from .scale import scale

        size = ctx.scale = scale(ctx.machine)
        options.update(length=size.length, mass=size.mass)

    # then everything adds to Q and F
    topology.check(ctx)
    circuit.contribute(ctx)
    if ctx.machine is not None:
        ctx.machine.contribute()
        ctx.machine.check_poles()
    if clocks is not None:
        clocks.contribute(ctx)
        clocks.tell(ctx, analyses)

    ctx.names_own = any(a.names_itself for a in analyses)
    for name, where in ctx.responses:
        for word in [a.word for a in analyses if not a.has_responses]:
            flat.sink.error(
                "E298", f"`{name}`: its gain is known at each frequency alone, and .{word} needs it in time", where,
                "a rational function of s, which may have exp(-s*td), runs in time too; R, L and C do as well",
            )  # fmt: skip
    outputs = {a: a.columns(ctx) for a in analyses}
    prints = printed(ctx, {a.word: o for a, o in outputs.items() if not a.names_itself})
    flat.sink.raise_if_errors()
    book = None
    if energy:
        from .accounts import accounts

        book = accounts(ctx)
    flows = None
    if ctx.is_drawn:
        from .flows import Flows

        flows = Flows(ctx, {ctx.element_name(s.name) for a in analyses for s in getattr(a, "sweeps", ())})
    found = Assembly(ctx, ctx.b.compile(), outputs, prints, book, analyses)
    found.flows = flows
    return found


def _unknowns(
    flat: FlatDeck,
    options: dict[str, Any],
    times: tuple[float, ...],
    context: Callable[[Builder, FlatDeck, dict[str, Any]], Context],
    shares: bool = False,
    noted: bool = False,
) -> tuple[Context, Clocks | None]:
    """Circuit and machine with all their unknowns, so that every expression can name every node and branch. `shares`:
    loads are shared where equilibrium does not say how (sharing.py)."""
    from .._engine import Builder
    from . import circuit

    ctx = context(Builder(), flat, options)
    ctx.times, ctx.shares = times, shares
    if noted or flat.inputs is not None:
        ctx.b.note_places()
    clocks = None
    if flat.clocked:
        from .clocked import Clocks

        clocks = Clocks(ctx)
    circuit.allocate(ctx)
    if flat.machine:
        ctx.machine = _machine(ctx)
        ctx.machine.build()
    flat.sink.raise_if_errors()
    return ctx, clocks


def _machine(ctx: Context) -> Machine:
    """The machine in the coordinates that the options ask for."""
    from .machine import Machine

    machine = None
    if ctx.options["formulation"] == "auto":
        machine = Machine(ctx)
        deep = not machine.broken and machine.graph().is_deep
        ctx.options["formulation"] = "absolute" if deep else "joint"
    if ctx.options["formulation"] == "absolute":
        from .absolute import Absolute

        return Absolute(ctx)
    return machine or Machine(ctx)
