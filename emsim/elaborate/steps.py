"""`.step` and lists of `.temp`: what is changed from run to run, and to which values.

    .step param r list 1k 2k 5k     .step dec param f 1 1k 5     .step temp -40 85 25
    .step v1 0 5 1                  .step npn 2n2222(vaf) 50 100 25

LTspice's and PSpice's spellings. Of several cards the first one runs fastest, as sources do in .dc.
"""

from __future__ import annotations

import math

from ..diagnostics import did_you_mean
from ..expr import ExprError, Node
from .scope import as_float

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from typing import Any

    from ..deck import Dot
    from ..diagnostics import Sink, Span
    from ..elements import Element
    from .flat import FlatDeck
    from .scope import DeckScope

FORMS = (
    ".step param name start stop step, .step param name list a b c, .step dec param name start stop points, "
    ".step temp 0 100 25, .step V1 0 5 1, .step npn 2n2222(vaf) 50 100 25"
)
SPACINGS = ("lin", "dec", "oct")
MOST = 100_000  # runs
END = 1e-9  # of a step: rounding of the last value


class Step:
    """One quantity that is stepped: `kind` is param, temp, model or element, `name` its column's, `key` what it is of a model."""

    __slots__ = ("key", "kind", "name", "span", "unit", "values")

    def __init__(
        self, kind: str, name: str, values: list[float], span: Span, key: str = "", unit: str = ""
    ) -> None:
        self.kind, self.name, self.values, self.span, self.key, self.unit = (
            kind,
            name,
            values,
            span,
            key,
            unit,
        )

    @property
    def column(self) -> str:
        return f"{self.name}({self.key})" if self.key else self.name

    def __repr__(self) -> str:
        return f".step {self.kind} {self.column} {self.values}"


Change = tuple[Step, float]


def points(steps: Sequence[Step]) -> Iterator[list[Change]]:
    """What is changed in each run; the first of the steps runs fastest."""
    if not steps:
        yield []
        return
    *inner, outer = steps
    for value in outer.values:
        for rest in points(inner):
            yield [*rest, (outer, value)]


def stepped_parameter(words: Sequence[Any]) -> tuple[str, Any] | None:
    """Name and first value of a card that steps a parameter: a deck need not have a .param of that name."""
    rest = [w for w in words if w not in (*SPACINGS, "list")]
    known = len(rest) > 2 and rest[0] == "param" and isinstance(rest[1], str) and not isinstance(rest[2], str)
    return (rest[1], rest[2]) if known else None


def read(card: Dot, scope: DeckScope, sink: Sink) -> Step | None:
    """The card's quantity and its values; None after an error (E332). Raises ExprError."""

    def wrong(said: str, hint: str = f"forms: {FORMS}") -> Step | None:
        sink.error("E332", said, card.span, hint)
        return None

    words: list[Any] = list(card.items)
    spacing = next((w for w in words if w in SPACINGS), "lin")
    words = [w for w in words if w not in SPACINGS]
    listed = "list" in words
    words = [w for w in words if w != "list"]
    if not words or not isinstance(words[0], str):
        return wrong(".step does not say what is stepped")
    word, rest = words[0], words[1:]
    if word == "temp":
        step = Step("temp", "temp", [], card.span, unit="C")
    elif word == "param":
        if not rest or not isinstance(rest[0], str):
            return wrong(".step param has no name")
        step, rest = Step("param", rest[0], [], card.span), rest[1:]
    elif rest and isinstance(rest[0], str) and rest[0].endswith(")"):
        model, _, key = rest[0][:-1].partition("(")
        step, rest = Step("model", model, [], card.span, key), rest[1:]
    else:
        step = Step("element", word.partition(":")[0], [], card.span)
    strange = next((w for w in rest if isinstance(w, str)), None)
    if strange is not None:
        return wrong(f"`{strange}` is no number")
    numbers = [as_float(v, scope) if isinstance(v, Node) else float(v) for v in rest]
    if not all(map(math.isfinite, numbers)):
        return wrong(".step has a value that is no finite number")
    if listed:
        step.values = numbers
    elif len(numbers) == 2 and spacing == "lin":
        step.values = _linear(numbers[0], numbers[1], 1.0)
    elif len(numbers) != 3:
        return wrong(f".step takes a start, an end and a step, or a list; there are {len(numbers)} numbers")
    elif spacing == "lin":
        start, stop, by = numbers
        if by == 0 or by * (stop - start) < 0:
            return wrong(f"steps of {by:g} do not lead from {start:g} to {stop:g}")
        step.values = _linear(start, stop, by) if abs(stop - start) < MOST * abs(by) else []
    else:
        start, stop, count = numbers
        if not 0 < start <= stop or count < 1:
            return wrong(
                f"{spacing} takes two ascending positive numbers and how many values, not {start:g} {stop:g} {count:g}"
            )
        ratio = (10.0 if spacing == "dec" else 2.0) ** (1.0 / int(count))
        last = math.floor(math.log(stop / start) / math.log(ratio) + END) + 1
        step.values = [start * ratio**k for k in range(last)] if last < MOST else []
    if not step.values:
        return wrong("the list has no values" if listed else f".step comes to more than {MOST} runs")
    if len(set(step.values)) != len(step.values):
        return wrong("a value stands twice in the list", "each step needs a value of its own")
    return step


def _linear(start: float, stop: float, by: float) -> list[float]:
    return [start + k * by for k in range(math.floor((stop - start) / by + END) + 1)]


def check(steps: Sequence[Step], sink: Sink) -> None:
    """E332 where the runs are too many, or a quantity is stepped twice."""
    if math.prod(len(s.values) for s in steps) > MOST:
        sink.error("E332", f"the .step cards come to more than {MOST} runs together", steps[-1].span)
    for k, step in enumerate(steps):
        if any(step.column == other.column for other in steps[:k]):
            sink.error("E332", f"`{step.column}` is stepped twice", step.span)


def change_models(scope: DeckScope, changes: Iterable[Change]) -> None:
    """Models of the top level with a parameter of a step."""
    from copy import copy

    for step, value in changes:
        model = scope.models.get(step.name) if step.kind == "model" else None
        if model is not None:
            changed = copy(model)
            changed.params = {**model.params, step.key: value}
            scope.models[step.name] = changed


def change_elements(flat: FlatDeck, changes: Iterable[Change], models: Mapping[str, Any]) -> None:
    """Elements with the value of a step: resistances and the like, DC values of sources; words of their lines and of machine
    cards', as in m1(ke)."""
    for step, value in changes:
        if step.kind == "model" and step.name not in models:
            _change_word(flat, step, value, models)
        if step.kind != "element":
            continue
        at = next((k for k, e in enumerate(flat.elements) if e.name == step.name), None)
        e = None if at is None else _with_value(flat.elements[at], value)
        if at is None:
            names = [x.name for x in flat.elements]
            hint = did_you_mean(step.name, names, "`.step param name ...` steps a parameter")
            flat.sink.error(
                "E332", f".step names `{step.name}`, which is no element of this deck", step.span, hint
            )
        elif e is None:
            said = f"`{step.name}` has no plain value that could be stepped"
            flat.sink.error(
                "E332",
                said,
                step.span,
                "give it a parameter as its value, and step that: .step param name ...",
            )
        else:
            flat.elements[at], step.unit = e, e.unit


def _change_word(flat: FlatDeck, step: Step, value: float, models: Mapping[str, Any]) -> None:
    """An element or a machine card with another number on its line."""
    from .altered import altered_card, altered_element

    elements = [k for k, e in enumerate(flat.elements) if e.name == step.name]
    cards = [k for k, card in enumerate(flat.machine) if card.name == step.name]
    if not (elements or cards):
        said = f"no .model, no element and no machine card is called `{step.name}`"
        flat.sink.error("E332", said, step.span, did_you_mean(step.name, models))
    try:
        for k in elements:
            flat.elements[k] = altered_element(flat.elements[k], step.key, value)
        for k in cards:
            flat.machine[k] = altered_card(flat.machine[k], step.key, value)
    except ExprError as error:
        flat.sink.error("E332", error.message, step.span, error.hint, fixes=error.fixes)


def _with_value(element: Element, value: float) -> Element | None:
    """A copy with another value; None where it has no plain one."""
    from copy import copy

    if not has_plain_value(element):
        return None
    changed = copy(element)
    if "dc" in element.extra:
        changed.extra, changed.value = {**element.extra, "dc": value}, None
    else:
        changed.value = value
    return changed


def has_plain_value(element: Element) -> bool:
    """Is its value one number that steps and sweeps can change: no expression, no waveform?"""
    return element.wave is None if "dc" in element.extra else isinstance(element.value, (int, float))
