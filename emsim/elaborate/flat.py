"""The deck on one level, as every later stage sees it: names such as `x1.r1`, parameters evaluated, models looked up.
It holds elements, which deck.py knows nothing of."""

from __future__ import annotations

from ..draws import Draws

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Analysis, MachineCard, Measure, Model, Print, Probe
    from ..diagnostics import Sink, Span
    from ..elements import Element
    from ..elements.added import Library
    from ..opened import Opened
    from ..readers.surface import Surface
    from ..source import SourceFile


class FlatDeck:
    """Everything the later stages see of a deck, on one level. Temperatures in degrees Celsius."""

    def __init__(self, title: str, sink: Sink) -> None:
        self.title = title
        self.sink = sink
        self.elements: list[Element] = []
        self.machine: list[MachineCard] = []
        self.clocked: list[MachineCard] = []  # CLOCK, BLOCK, PWM, FMU
        self.models: dict[str, Model] = {}
        self.named: list[str] = []  # every file that was looked for: that of the deck
        self.modules: dict[str, Any] = {}  # of Verilog-A, from files that .hdl names
        self._added: Library | None = None
        self.meshes: dict[str, Surface] = {}  # path -> what it shows, of files that look= names
        self.options: dict[str, float | str | bool] = {}
        self.option_spans: dict[str, Span] = {}
        self.params: dict[str, float] = {}  # of the top level
        self.origin: Any = (
            None  # what it was flattened from (elaborate/quantity.py); None where it was altered since
        )
        self.reads_temper = False  # a parameter does
        self.draws = Draws()  # random values
        self.fmu: dict[str, list[Probe]] = {}  # list of .fmu -> its words
        # what comes from outside while an FMU runs: name of a source or of a card's value -> where nothing is said; None: no FMU
        self.inputs: Opened | None = None
        self.temp = 27.0
        self.tnom = 27.0
        self.gravity: tuple[float, float, float] | None = None
        self.analyses: list[Analysis] = []
        self.ics: list[tuple[str, float, Span]] = []
        self.nodesets: list[tuple[str, float, Span]] = []
        self.saves: list[Probe] = []
        self.probes: list[Probe] = []
        self.probed: list[Probe] = []  # of .probe what is asked of terminals: vd(m1:d:s), p(x1)
        self.prints: list[Print] = []
        self.measures: list[Measure] = []
        self.fours: list[Measure] = []  # .four, a clause a signal
        self.also: list[Probe] = []  # asked for from outside the deck
        self.wanted: list[Probe] = []  # by commands of .control: recorded where the deck has them
        self.commands: list[Any] = []  # lines of its .control sections
        self.commanded: list[Analysis] = []  # of `analyses` those that stand there plainly
        self.steps: list[Any] = []  # elaborate.steps.Step, the one that runs fastest first
        self.uses: list[
            tuple[str, str, dict[str, str]]
        ] = []  # of subcircuits: name, of what, nodes by terminal
        self.views: list[dict[str, Any]] = []
        self.is_drawn = False  # the circuit with its currents: these are recorded then
        self.sources: list[SourceFile] = []

    @property
    def added(self) -> Library:
        """Modules of Verilog-A that the user added once; most decks ask for none."""
        if self._added is None:
            from ..elements.added import Library

            self._added = Library(self.sink)
        return self._added
