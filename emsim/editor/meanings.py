"""What any word of the language means: cards, letters, dot cards, waveforms, functions, options, methods; and lists of them.

`emsim help WORD` and `emsim explain WORD` print it. It is read from the tables that the parser, the checks and the editors use.
"""

from __future__ import annotations

from ..cards import CARDS
from ..cards.joints import KINDS
from ..cards.motors import MODELS as MOTORS
from ..dialects import DIALECTS, find
from ..elements import LETTERS
from ..elements.xspice import NAMES, code_model
from ..measures import KINDS as MEASURES
from ..reports import words as references
from . import words

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MODELS = {kind: element.letter.upper() for element in LETTERS.values() for kind in element.model_types}


def lines(word: str) -> list[str]:
    """Everything that the word means, a part each; empty for a word that means nothing."""
    parts = [list(part) for tell in TELLERS if (part := tell(word)) is not None]
    return [line for k, part in enumerate(parts) for line in ([""] if k else []) + part]


def known() -> list[str]:
    """All words that mean something."""
    return [
        *TOPICS, *CARDS, *references.LETTERS, *words.DOTS, *words.WAVES, *words.PROBES, *words.FUNCTIONS,
        *words.OF_RESULTS, *words.OPTIONS, *(d.name for d in DIALECTS), *words.METHODS, *KINDS, *MODELS, *MOTORS,
    ]  # fmt: skip


def _reference(word: str) -> Iterator[str] | None:
    return references.lines(word) if references.is_word(word) else None


def _dot(word: str) -> Iterator[str] | None:
    if (found := words.DOTS.get(word.lower())) is None:
        return None
    form, meaning = found
    more: list[str] = []
    if word.lower() == ".meas":
        more = ["", *references.table([(kind.words[0], kind.meaning, kind.form) for kind in MEASURES])]
    return iter((f"{word.lower()}: {meaning}", "", f"  {form}", *more))


def _wave(word: str) -> Iterator[str] | None:
    name = word.upper()
    if name not in words.WAVES:
        return None
    rows = [("argument", "unit", "if left out"), *words.arguments(name)]
    rows = [(a, b, c.replace("*", "")) for a, b, c in rows]
    head = (f"{name}: waveform, {words.WAVES[name][0]}", "", f"  {words.wave_form(name)}", "")
    return iter((*head, *references.table(rows)))


def _probe(word: str) -> Iterator[str] | None:
    if (found := words.PROBES.get(word.lower())) is None:
        return None
    form, unit, meaning = found
    return iter(
        (f"{form}  [{unit}]", "", f"  {meaning}; in expressions, .print, .save and as a column of a result")
    )


def _function(word: str) -> Iterator[str] | None:
    if (found := words.FUNCTIONS.get(word.lower())) is not None:
        form, meaning = found
        return iter((f"{form}  function of expressions", "", f"  {meaning}"))
    if (found := words.OF_RESULTS.get(word.lower())) is None:
        return None
    form, meaning = found
    return iter((f"{form}  function of results: of .print, .meas, --plot, the page", "", f"  {meaning}"))


def _option(word: str) -> Iterator[str] | None:
    name = word.lower()
    if name not in words.OPTIONS:
        return None
    return iter((f"{name}: option", "", f"  .options {name}=    {words.option(name)}"))


def _method(word: str) -> Iterator[str] | None:
    if (found := words.METHODS.get(word.lower())) is None:
        return None
    order, kind, use = found
    name = word.lower()
    said = f"  {kind}; for {use}"
    return iter(
        (f"{name}: method of order {order}", "", said, f"  .options method={name}, or --method {name}")
    )


def _dialect(word: str) -> Iterator[str] | None:
    if (found := find(word)) is None:
        return None
    head = f"{found.name}: dialect, .options dialect={found.name}, or --dialect {found.name}"
    return iter((head, "", *references.table(list(found.differences))))


def _joint(word: str) -> Iterator[str] | None:
    if (kind := KINDS.get(word.lower())) is None:
        return None
    return iter(
        (f"{word.lower()}: kind of joint", "", f"  {kind.meaning}", f"  JOINT name A B {word.lower()}")
    )


def _code_model(word: str) -> Iterator[str] | None:
    if (name := word.lower()) not in NAMES:
        return None
    kind = code_model(name)
    head = (f"{name}: code model, {kind.what}", "", f"  {kind.form()}; .model model {name}(..)")
    rows = [(key, w.unit or "-", w.told(), w.meaning) for key, w in kind.parameters.items() if w.meaning]
    law = (f"  {kind.law}",) if kind.law else ()
    return iter((*head, *law, "", *references.table(rows)))


def _model(word: str) -> Iterator[str] | None:
    if word.lower() in NAMES or (letter := MODELS.get(word.lower())) is None:
        return None
    return iter((f"{word.lower()}: word of .model, for {letter}; its parameters: emsim help {letter}",))


def _command(word: str) -> Iterator[str] | None:
    """A command of .control."""
    found = words.commands().get(word.lower())
    if found is None:
        return None
    return iter((f"{word.lower()}: command of .control", "", f"  {found[0]}", f"  {found[1]}"))


def _topic(word: str) -> Iterator[str] | None:
    if (found := TOPICS.get(word.lower())) is None:
        return None
    title, rows = found
    return iter((f"{word.lower()}: {title}", "", *references.table(rows())))


TELLERS: tuple[Callable[[str], Iterator[str] | None], ...] = (
    _reference, _dot, _wave, _probe, _function, _option, _method, _dialect, _joint, _code_model, _model, _command, _topic,
)  # fmt: skip

Rows = list[tuple[str, ...]]


def _options() -> Rows:
    return [(name, unit or "-", value, meaning) for name, (unit, value, meaning) in words.OPTIONS.items()]


def _code_models() -> Rows:
    kinds = map(code_model, sorted(NAMES))
    return [(kind.name, kind.what, kind.form()) for kind in kinds]


TOPICS: dict[str, tuple[str, Callable[[], Rows]]] = {
    "cards": ("machine cards", lambda: [(word, card.spec.meaning) for word, card in CARDS.items()]),
    "elements": ("letters of SPICE", lambda: [(kind.letter.upper(), kind.what, kind.form) for kind in LETTERS.values()]),
    "code_models": ("of A lines, by the word of their .model", _code_models),
    "joints": ("kinds of joints", lambda: [(name, kind.meaning) for name, kind in KINDS.items()]),
    "motors": ("types of .model for MOTOR", lambda: [(name, kind.spec.meaning) for name, kind in MOTORS.items()]),
    "dots": ("dot cards", lambda: list(words.DOTS.values())),
    "waveforms": (
        "values that change with time", lambda: [(words.wave_form(name), said) for name, (said, _) in words.WAVES.items()]
    ),
    "probes": ("what reads circuit and machine", lambda: list(words.PROBES.values())),
    "functions": ("of expressions", lambda: list(words.FUNCTIONS.values())),
    "options": ("of .options, with unit, default and meaning", _options),
    "dialects": (
        "how decks are read where they differ; .options dialect=",
        lambda: [(d.name, *row) for d in DIALECTS for row in d.differences],
    ),
    "control": ("commands of a .control section", lambda: list(words.commands().values())),
    "methods": ("with order, kind, use; .options method=", lambda: [(name, *told) for name, told in words.METHODS.items()]),
}  # fmt: skip
