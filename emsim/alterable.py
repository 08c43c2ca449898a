"""`emsim.Deck`: a deck that is read once, altered, and run as often as one likes.

    deck = emsim.Deck("filter.cir")
    for r in (1e3, 2e3, 5e3):
        deck.alter("r1", r)
        print(deck.run(["ac dec 20 1 1meg"]).at("db(v(out))", 1e3))

What is altered acts on the elements themselves: the text is not read again, and only a changed .param has its expressions
evaluated anew. It is what `alter`, `altermod`, `alterparam` and `reset` of a .control section do.
"""

from __future__ import annotations

from . import pipeline
from .diagnostics import DeckError, Diagnostic, Sink, Span
from .elaborate.altered import Altered
from .expr import ExprError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from typing import Any

    from .deck import Analysis
    from .gradients import Gradient
    from .result import Result
    from .source import Source


class Deck:
    """A deck, as `emsim.run` takes it, that can be altered between runs. Its .control section is left alone.

    defines   parameters that stand above the deck's .param
    options   .options that stand above the deck's own
    Raises DeckError, also where something is altered that the deck does not have.
    """

    @pipeline.explained
    def __init__(
        self,
        source: Source,
        defines: Mapping[str, Any] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self._options = {key.lower(): value for key, value in (options or {}).items()}
        deck = pipeline.load(source, defines, options=self._options)
        flat = pipeline.flatten(deck, self._options)
        self._altered = Altered(deck, flat, self._options.get("temp"), self._options.get("seed"))

    def __repr__(self) -> str:
        return f"<Deck {self.title!r}>"

    @property
    def title(self) -> str:
        return self._altered.title

    # ---- what is altered ----

    def alter(self, device: str, value: float | Sequence[float], parameter: str | None = None) -> None:
        """The value of an element, or a parameter of it or of a machine card: alter("r1", 2e3), alter("v1", [0, 5], "sin")."""
        self._told(lambda: self._altered.alter(device, parameter, value))

    def alter_model(self, model: str, parameter: str, value: float) -> None:
        """A parameter of a .model."""
        self._told(lambda: self._altered.alter_model(model, parameter, value))

    def alter_parameter(self, name: str, value: float, subckt: str | None = None) -> None:
        """A .param of the deck, or a parameter of a .subckt."""
        self._told(lambda: self._altered.alter_parameter(name, value, subckt))

    def set_option(self, name: str, value: float | str) -> None:
        """An option for the runs that follow."""
        self._altered.set_option(name, value)

    def reset(self) -> None:
        """The deck as it was written, with altered parameters and new random values."""
        self._altered.reset()

    def value(self, device: str, parameter: str) -> float | list[float] | None:
        """The value of @device[parameter] or @model[parameter] as the deck stands; None for what it does not state."""
        return self._altered.value(device.lower(), parameter.lower())

    def parameters(self) -> dict[str, float]:
        """The .param of the top level with their values."""
        return dict(self._altered.flat().params)

    @staticmethod
    def _told(change: Callable[[], None]) -> None:
        try:
            change()
        except ExprError as error:
            raise DeckError(Diagnostic("error", error.code, error.message, error.span, error.hint)) from None

    # ---- runs ----

    @pipeline.explained
    def run(
        self, analyses: str | Iterable[str] | None = None, energy: bool | None = None, scene: bool = False
    ) -> Result:
        """Runs analyses, written as dot cards with or without the dot ("tran 1u 1m", ".op"); left out: the deck's own.

        `energy` and `scene` as in `emsim.run`. Raises DeckError, ConvergenceError (with the partial Result)."""
        flat = self._altered.flat()
        flat.sink = Sink()
        asked = (analyses,) if isinstance(analyses, str) else analyses
        flat.analyses = (
            list(self._altered.analyses()) if asked is None else [self._card(text) for text in asked]
        )
        wanted = bool(flat.machine) if energy is None else energy
        assembly, planned = pipeline.prepare(flat, self._options, wanted)
        return pipeline.deliver(assembly, pipeline.solve(assembly, planned, scene=scene))

    @pipeline.explained
    def gradient(
        self,
        of: Sequence[str] | str | None = None,
        by: Sequence[str] | str | None = None,
        at: Sequence[float] | float | None = None,
        analysis: str | None = None,
    ) -> Gradient:
        """Values and derivatives, events included: of measures of .tran, .op, .dc or .ac, by quantities.

        of        names of the deck's .meas, all of them where it is left out; or signals, with `at`: times [s] of .tran,
                  frequencies [Hz] of .ac (complex numbers), values of what .dc sweeps; of .op without it
        by        a .param, an element's value, npn(vaf), m1(ke), temp; every .param where it is left out
        analysis  in place of the deck's own, as `run` takes it
        Raises DeckError: E443 for a measure that has no derivative, E364 for what none is computed of; ConvergenceError (E423)
        where derivatives end at an event."""
        from .gradients import gradient

        flat = self._altered.flat()
        flat.sink, measures = Sink(), flat.measures
        flat.analyses = list(self._altered.analyses()) if analysis is None else [self._card(analysis)]
        try:
            return gradient(flat, of, by, at, self._options)
        finally:
            flat.measures = measures

    def _card(self, text: str) -> Analysis:
        from .build import command_card
        from .deck import Analysis
        from .elaborate.scope import as_float
        from .expr import Node, Scope
        from .source import Line, SourceFile
        from .syntax import LineError

        text = text.strip().removeprefix(".")
        line = Line(SourceFile("<analysis>", text), 1, 1, 0, len(text))
        try:
            card = command_card(text, line, 0, Span(line.file, 1, 1, len(text) + 1))
        except LineError as error:
            raise DeckError(error.diagnostic) from None
        if not isinstance(card, Analysis):
            raise DeckError(
                Diagnostic(
                    "error", "E305", f"`{text}` is no analysis", line.whole, "tran 1u 1m, for instance"
                )
            )
        scope = Scope(self._altered.flat().params)
        card.args = [as_float(a, scope) if isinstance(a, Node) else a for a in card.args]
        return card
