"""Assembly: flat deck -> equation (1), compiled, and the columns that each analysis is to give."""

from __future__ import annotations

from .context import Context
from .outputs import Output, select

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import System
    from ..deck import FlatDeck
    from .accounts import Accounts
    from .drawing import Drawing
    from .machine import Machine

__all__ = ["Assembly", "Context", "Output", "assemble"]


class Assembly:
    """A compiled deck. `outputs` maps an analysis kind ("op", "tran") to its columns, without the time."""

    __slots__ = ("accounts", "ctx", "drawn", "flat", "options", "outputs", "prints", "system")

    def __init__(
        self,
        ctx: Context,
        system: System,
        outputs: dict[str, list[Output]],
        prints: list[tuple[str, list[str]]],
        accounts: Accounts | None = None,
    ) -> None:
        self.ctx, self.system, self.outputs, self.prints = ctx, system, outputs, prints
        self.flat: FlatDeck = ctx.flat
        self.options: dict[str, Any] = ctx.options
        self.drawn: Drawing | None = None
        self.accounts = accounts

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
    times: tuple[float, float],
    energy: bool = False,
    context: type[Context] = Context,
) -> Assembly:
    """Circuit and machine in one system. `times` (tstep, tstop) [s] fill in waveform defaults; `context` is Recording where
    the deck is to be explained.

    Raises DeckError with everything that is wrong with the deck.
    """
    from .._engine import Builder
    from . import circuit, topology
    from .scale import scale

    ctx = context(Builder(), flat, options)
    ctx.times = times

    # unknowns first, so that every expression can name every node and branch
    circuit.allocate(ctx)
    if flat.machine:
        ctx.machine = _machine(ctx)
        ctx.machine.build()
    flat.sink.raise_if_errors()
    if ctx.machine is not None:
        size = ctx.scale = scale(ctx.machine)
        options.update(length=size.length, mass=size.mass)

    # then everything adds to Q and F
    topology.check(ctx)
    circuit.contribute(ctx)
    if ctx.machine is not None:
        ctx.machine.contribute()
        ctx.machine.check_poles()

    outputs, prints = select(ctx)
    flat.sink.raise_if_errors()
    book = None
    if energy:
        from .accounts import accounts

        book = accounts(ctx)
    return Assembly(ctx, ctx.b.compile(), outputs, prints, book)


def _machine(ctx: Context) -> Machine:
    """The machine in the coordinates that the options ask for."""
    if ctx.options["formulation"] == "absolute":
        from .absolute import Absolute

        return Absolute(ctx)
    from .machine import Machine

    return Machine(ctx)
