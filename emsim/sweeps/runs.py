"""One run of a sweep: a deck that is parsed once a process, read anew with the values of the run, and what is kept of it."""

from __future__ import annotations

from typing import NamedTuple

from ..diagnostics import ConvergenceError, DeckError, Sink, Span, deck_error, suggest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from ..deck import Deck, FlatDeck
    from ..draws import Draws
    from ..elaborate.steps import Step
    from ..result import Result


class Task(NamedTuple):
    """What every process is told of the sweep."""

    source: str  # path, or text
    fixed: dict[str, str]  # -D of one value
    names: tuple[str, ...]  # what varies
    signals: tuple[str, ...]  # columns and expressions that are kept, on the print grid
    options: dict[str, Any]
    seed: int


class Point(NamedTuple):
    number: int
    values: tuple[float, ...]  # of `Task.names`
    places: tuple[float, ...] | None  # of the random values; None: the deck's seed draws


class Outcome(NamedTuple):
    """Of one run. `error`: why it failed; nothing is kept of a run that did not get to its end. `warnings`: what else it said.
    A measure that found nothing is nan."""

    number: int
    measures: dict[str, float]
    signals: dict[str, list[float]]
    axis: list[float]
    error: str
    warnings: list[str]
    over: str = ""  # what the axis of the signals is


class Runner:
    """The runs of a process. Raises DeckError where the deck itself is wrong."""

    def __init__(self, task: Task) -> None:
        from ..build import parse_signals
        from ..build import read as build
        from ..source import NoCollection

        self.task = task
        with NoCollection():
            probes = [p for text in task.signals for p in parse_signals(text)]
            self.deck: Deck = build(task.source, dict(task.fixed), probes)
        self.place = Span(self.deck.file, 1, 1, 2)  # of what -D steps: there is no card
        self.parsed = list(self.deck.sink.diagnostics)
        self.columns = [p.text.strip().lower() for p in probes]

    def flat(self, point: Point) -> FlatDeck:
        """The deck with the values of a run."""
        from ..draws import Draws

        draws = Draws(self.task.seed + point.number, point.places) if point.places is not None else None
        if draws is None and "seed" in self.task.options:
            draws = Draws(int(self.task.options["seed"]))
        return self.read(dict(zip(self.task.names, point.values, strict=True)), draws)

    def read(self, given: dict[str, float], draws: Draws | None = None) -> FlatDeck:
        """The deck with other values of some names. Raises DeckError."""
        from ..elaborate import flatten

        temp = self.task.options.get("temp")
        if not self.deck.params:  # the names of its parameters are known behind a first reading
            self.deck.defines = {**self.task.fixed}
            flatten(self.deck, temp)
        self.deck.sink = Sink()
        for said in self.parsed:
            self.deck.sink.add(said)
        changes = [(step, value) for name, value in given.items() if (step := self.step(name)) is not None]
        elsewhere = {step.column for step, _ in changes}
        self.deck.defines = {**self.task.fixed, **{k: v for k, v in given.items() if k not in elsewhere}}
        return flatten(self.deck, temp, draws, changes)

    def step(self, name: str) -> Step | None:
        """What a name means where it is no parameter: the temperature, a model's parameter as in dd(is), an element."""
        from ..elaborate.steps import Step

        if name in self.deck.params:
            return None
        model, bracket, key = name.partition("(")
        if bracket:
            return Step("model", model, [], self.place, key.removesuffix(")"))
        return Step("temp" if name == "temp" else "element", name, [], self.place)

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
        for name in names:
            step = self.step(name)
            if step is not None and step.kind == "element":
                changeable(flat, name)

    def draws(self) -> list[str]:
        """The deck's random values, in words."""
        return self.read({}).draws.labels()

    def run(self, point: Point) -> Outcome:
        from .. import pipeline

        try:
            flat = self.flat(point)
            given = zip(self.task.names, point.values, strict=True)
            options = {**self.task.options, **{name: value for name, value in given if name == "temp"}}
            assembly, planned = pipeline.prepare(flat, options, False)
            result = pipeline.deliver(assembly, pipeline.solve(assembly, planned))
            axis, signals = self.signals(result)
        except ConvergenceError as error:
            return Outcome(point.number, {}, {}, [], _first(error.diagnostics), [])
        except DeckError as error:
            return Outcome(point.number, {}, {}, [], _first(error.diagnostics), [])
        measures = {name: float(value) for name, value in self.measures(result).items()}
        over = result.main.axis.name if signals and result.main.axis is not None else ""
        return Outcome(point.number, measures, signals, axis, "", _warnings(result), over)

    def measures(self, result: Result) -> dict[str, Any]:
        """What .meas found; of a deck without, the last values of what it prints."""
        if result.measured:
            return {m.name: m.value for m in result.measured if m.step == 0}
        found: dict[str, Any] = {}
        for kind, columns in result.prints:
            table = result.table(kind)
            for name in columns:
                values = table[name]
                if len(values) and not table.is_complex(name):
                    found[name] = values[-1]
        return found

    def signals(self, result: Result) -> tuple[list[float], dict[str, list[float]]]:
        """The signals that are kept: of a transient on the deck's print grid, which all runs share, else at all rows."""
        if not self.columns:
            return [], {}
        from ..outputs.text import print_grid

        table = result.main
        if strange := next((name for name in self.columns if table.is_complex(name)), None):
            deck_error(
                "E348",
                f"`{strange}` is complex, and a sweep keeps real signals",
                hint=f"mag({strange}), db({strange}) or ph({strange})",
            )
        axis = print_grid(table) or [float(v) for v in table.floats(0)]
        return axis, {name: [float(v) for v in table.at(name, axis)] for name in self.columns}


def changeable(flat: FlatDeck, name: str) -> None:
    """Raises DeckError for a name that is no element, or one without a single value."""
    from ..elaborate.steps import has_plain_value

    element = next((e for e in flat.elements if e.name == name), None)
    if element is None:
        near = suggest(name, [*flat.params, *(e.name for e in flat.elements)])
        known = "a parameter (.param), the name of an element with a value, temp, or model(parameter)"
        deck_error(
            "E346",
            f"there is no parameter and no element `{name}`",
            hint=f"did you mean `{near}`?" if near else known,
        )
    if not has_plain_value(element):
        hint = "make it a parameter: .param x=.. and {x} on the card"
        deck_error("E345", f"`{name}` has no single value that a sweep could change", element.span, hint)


def _first(diagnostics: Sequence[Any]) -> str:
    found = next((d for d in diagnostics if d.severity == "error"), diagnostics[0] if diagnostics else None)
    return "failed" if found is None else f"{found.code}: {found.message}"


def _warnings(result: Result) -> list[str]:
    """The warnings of a run, but for measures that found nothing."""
    told = (f"{d.code}: {d.message}" for d in result.diagnostics if d.severity == "warning")
    return list(dict.fromkeys(told))
