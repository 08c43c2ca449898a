"""One run of a sweep: a deck that is parsed once a process, read anew with the values of the run, and what is kept of it."""

from __future__ import annotations

from typing import NamedTuple

from ..diagnostics import ConvergenceError, DeckError, Span, deck_error
from ..units import spice_number
from .kept import learn

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any

    from ..analyses import Analysis
    from ..assemble import Assembly
    from ..deck import Deck
    from ..draws import Draws
    from ..elaborate.flat import FlatDeck
    from ..result import Result
    from ..table import Table
    from ..traced import Trace
    from .kept import Kept


class Task(NamedTuple):
    """What every process is told of the sweep."""

    source: str | bytes  # path, or text
    fixed: dict[str, str]  # -D of one value
    names: tuple[str, ...]  # what varies
    signals: tuple[
        str, ...
    ]  # columns and expressions that are kept, on the print grid; ac:vdb(b) is of that analysis
    options: dict[str, Any]
    seed: int


class Point(NamedTuple):
    number: int
    values: tuple[float, ...]  # of `Task.names`
    places: tuple[float, ...] | None  # of the random values; None: the deck's seed draws


class Outcome(NamedTuple):
    """Of one run. `error`: why it failed; nothing is kept of a run that did not get to its end. `warnings`: what else it said.
    A measure that found nothing is nan. `drawn`: the random values, in the order of the deck."""

    number: int
    measures: dict[str, float]
    signals: dict[str, list[float]]
    axis: list[float]
    error: str
    warnings: list[str]
    over: str = ""  # what the axis of the signals is
    drawn: Sequence[float] = ()
    axes: Mapping[
        str, Sequence[Any]
    ] = {}  # of signals of a named analysis: analysis -> (what its axis is, the axis)


class Runner:
    """The runs of a process. Raises DeckError where the deck itself is wrong."""

    def __init__(self, task: Task) -> None:
        from ..build import parse_signals
        from ..build import read as build
        from ..elaborate import flatten
        from ..source import NoCollection

        self.task = task
        self.fixed = {
            name: float(v) for name, text in task.fixed.items() if (v := spice_number(text)) is not None
        }
        words = {name: text for name, text in task.fixed.items() if name not in self.fixed}
        with NoCollection():
            self.signal_names: list[tuple[str, str]] = []  # analysis or "", column
            probes = []
            for text in task.signals:
                kind, of = analysis_of(text)
                found = parse_signals(of)
                probes += found
                self.signal_names += [(kind, p.text.strip().lower()) for p in found]
            self.deck: Deck = build(task.source, words, probes, task.options.get("dialect"))
        # the names of its parameters are known behind a first reading
        self.exist(flatten(self.deck, task.options.get("temp")), self.fixed)
        self.place = Span(self.deck.file, 1, 1, 2)  # of what -D steps: there is no card
        self.parsed = list(self.deck.sink.diagnostics)
        self.runs = 0
        self.kept: Kept | None = None

    def drawing(self, point: Point) -> Draws | None:
        """What draws the random values of a run; None: the deck's seed."""
        from ..draws import Draws

        if point.places is not None:
            return Draws(self.task.seed + point.number, point.places, tolerances=True)
        return Draws(int(self.task.options["seed"])) if "seed" in self.task.options else None

    def flat(self, point: Point, draws: Draws | None) -> FlatDeck:
        """The deck with the values of a run."""
        return self.read(dict(zip(self.task.names, point.values, strict=True)), draws)

    def read(self, given: dict[str, float], draws: Draws | None = None) -> FlatDeck:
        """The deck with other values of some names. Raises DeckError."""
        from ..elaborate.quantity import with_values

        return with_values(
            self.deck,
            {**self.fixed, **given},
            self.place,
            self.task.options.get("temp"),
            draws,
            said=self.parsed,
        )

    def check(self, names: Iterable[str]) -> None:
        """Raises DeckError for a name that nothing has, and for a deck that says itself what is run."""
        flat = self.read({})
        if flat.steps or flat.commands:
            what, at = (".step", flat.steps[0].span) if flat.steps else (".control", None)
            deck_error(
                "E348",
                f"the deck has {what} itself, which says what is run",
                at,
                "take it out, and give its values by -D",
            )
        self.exist(flat, names)

    def exist(self, flat: FlatDeck, names: Iterable[str]) -> None:
        """Raises DeckError for a name that nothing has."""
        from ..elaborate.quantity import value

        for name in names:
            if name.partition("(")[0] not in flat.models and name not in self.deck.params:
                value(flat, name)

    def draws(self) -> Draws:
        """The deck's random values."""
        from ..draws import Draws

        return self.read({}, Draws(tolerances=True)).draws

    def run(self, point: Point) -> Outcome:
        """A run; by the equations of the runs before where these differ in numbers alone (kept.py)."""
        self.runs += 1
        if self.runs == 2:  # (a run that stays alone needs no equations for others)
            self.kept = learn(self, point)
        found = self.kept.run(point) if self.kept is not None else None
        return found or self.alone(point)

    def alone(self, point: Point) -> Outcome:
        """A run of its own."""
        draws = self.drawing(point)
        try:
            flat = self.flat(point, draws)
            given = zip(self.task.names, point.values, strict=True)
            options = {**self.task.options, **{name: value for name, value in given if name == "temp"}}
            result = self.solved(*self.prepared(flat, options))
            signals = self.signals(result)
        except (ConvergenceError, DeckError) as error:
            drawn = [] if draws is None else draws.drawn
            return Outcome(point.number, {}, {}, [], _first(error.diagnostics), [], drawn=drawn)
        return self.outcome(point, result, signals, flat.draws.drawn)

    def prepared(
        self, flat: FlatDeck, options: dict[str, Any], trace: Trace | None = None
    ) -> tuple[Assembly, list[Analysis]]:
        from .. import pipeline

        return pipeline.prepare(flat, options, False, trace=trace)

    def solved(self, assembly: Assembly, planned: list[Analysis]) -> Result:
        from .. import pipeline

        return pipeline.deliver(assembly, pipeline.solve(assembly, planned))

    def outcome(self, point: Point, result: Result, signals: Signals, drawn: list[float]) -> Outcome:
        """What is kept of a run that got to its end."""
        measures = {name: float(value) for name, value in self.measures(result).items()}
        said = _warnings(result)
        return Outcome(
            point.number, measures, signals.columns, signals.axis, "", said, signals.over, drawn, signals.axes
        )

    def measures(self, result: Result) -> dict[str, Any]:
        """What .meas found; of a deck without, the last values of what it prints."""
        if result.measured:
            return {m.name: m.value for m in result.measured if m.step == 0}
        found: dict[str, Any] = {}
        for kind, columns in result.prints:
            table = result.table(kind)
            for name in table.signals if "all" in columns else columns:
                values = table[name]
                if len(values) and not table.is_complex(name):
                    found[name] = values[-1]
        return found

    def signals(self, result: Result) -> Signals:
        """The signals that are kept: of a transient on the deck's print grid, which all runs share, else at all rows."""
        found: dict[str, list[float]] = {}
        over, axis = "", list[float]()
        axes: dict[str, Sequence[Any]] = {}
        for kind in dict.fromkeys(kind for kind, _ in self.signal_names):
            if kind and kind not in {p.kind for p in result.plots}:
                there = ", ".join(p.kind for p in result.plots)
                deck_error(
                    "E348",
                    f"no analysis `{kind}` ran, whose signals are to be kept",
                    hint=f"there is {there}",
                )
            table = result.table(kind) if kind else result.main
            places, columns = _columns(table, [name for of, name in self.signal_names if of == kind])
            found.update({f"{kind}:{name}" if kind else name: values for name, values in columns.items()})
            if kind:
                axes[kind] = [table.axis.name if table.axis is not None else "", places]
            else:
                over, axis = table.axis.name if table.axis is not None else "", places
        return Signals(found, axis, over, axes)


class Signals(NamedTuple):
    """As Outcome has them."""

    columns: dict[str, list[float]]
    axis: list[float]
    over: str
    axes: dict[str, Sequence[Any]]


def analysis_of(text: str) -> tuple[str, str]:
    """The analysis in front of a signal and the rest: ("ac", "vdb(b)") of ac:vdb(b); "" where there is none."""
    kind, colon, of = text.partition(":")
    return (kind.strip().lower(), of) if colon and kind.strip().isalpha() else ("", text)


def _columns(table: Table, names: list[str]) -> tuple[list[float], dict[str, list[float]]]:
    """Where signals of a table are kept, and their values there."""
    from ..outputs.text import print_grid

    if strange := next((name for name in names if table.is_complex(name)), None):
        deck_error(
            "E348",
            f"`{strange}` is complex, and a sweep keeps real signals",
            hint=f"mag({strange}), db({strange}) or ph({strange})",
        )
    if not table.axis:  # a point: one value a run
        return [0.0], {name: [float(table[name][-1])] for name in names}
    axis = print_grid(table) or [float(v) for v in table.floats(0)]
    return axis, {name: [float(v) for v in table.at(name, axis)] for name in names}


def _first(diagnostics: Sequence[Any]) -> str:
    found = next((d for d in diagnostics if d.severity == "error"), diagnostics[0] if diagnostics else None)
    return "failed" if found is None else f"{found.code}: {found.message}"


def _warnings(result: Result) -> list[str]:
    """The warnings of a run, but for measures that found nothing."""
    told = (f"{d.code}: {d.message}" for d in result.diagnostics if d.severity == "warning")
    return list(dict.fromkeys(told))
