"""What may be typed at a place: cards, parameters that are not given yet, names that fit, functions, options."""

from __future__ import annotations

from ..cards import CARDS
from ..cards.joints import ALIASES
from ..cards.joints import KINDS as JOINT_KINDS
from ..cards.motors import MODELS as MOTORS
from ..elements import LETTERS, MODEL_TYPES
from . import words
from .hover import about
from .place import Place

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .document import Document

OF_RESULTS = (".print", ".meas", ".measure", ".four")  # cards that read results
NAMES = frozenset(("node", "joint", "body", "point", "card", "element", "model", "subckt", "param", "func"))


class Item:
    """kind: card, dot, key, word, function, option, or a kind of Symbol; `insert` is what is typed."""

    __slots__ = ("detail", "insert", "kind", "label", "text")

    def __init__(self, kind: str, label: str, detail: str = "", text: str = "", insert: str = "") -> None:
        self.kind, self.label, self.detail, self.text, self.insert = (
            kind,
            label,
            detail,
            text,
            insert or label,
        )


def complete(document: Document, row: int, col: int) -> list[Item]:
    """Row and column from 0; the editor itself drops what does not begin like the word."""
    place = Place(document.lines, row, col)
    if not place.is_code:
        return []
    found: dict[str, Item] = {}
    for kind in place.expects():
        for item in _items(document, place, kind, row):
            found.setdefault(item.label, item)
    return list(found.values())


def _items(document: Document, place: Place, kind: str, row: int) -> Iterator[Item]:
    scope = document.scope_at(row)
    if kind == "card":
        if place.words:
            yield from _named(document, ("card",), scope)
            return
        for word, card in CARDS.items():
            yield Item("card", word, card.spec.form, card.spec.meaning)
        for word, (form, meaning) in words.DOTS.items():
            yield Item("dot", word, form, meaning)
        return
    if kind == "command":
        for word, (form, meaning) in words.commands().items():
            yield Item("word", word, form, meaning)
        yield Item("dot", ".endc", "the end of the section")
        return
    if kind == "vector":
        if place.call:
            yield from _named(document, ("node", "element"), scope)
            return
        for name in words.control_functions():
            yield Item("function", name, "of vectors", "", name + "(")
        yield Item("function", "v", "v(node)", "the voltage of a node", "v(")
        yield Item("function", "i", "i(element)", "the current of an element", "i(")
        yield from _named(document, ("node", "element", "model", "param"), scope)
        return
    if kind == "node" and place.call:
        yield from _named(document, ("node",), scope)
        return
    if kind in NAMES:
        yield from _named(document, (kind,), scope)
    if kind in ("node", "body", "point") and not place.call:
        yield Item(kind, "0", "ground")
    if kind == "kind":
        for name in [*JOINT_KINDS, *ALIASES]:
            yield Item("word", name, "kind of joint")
    elif kind == "key":
        yield from _keys(place)
    elif kind == "word" and place.key:
        param = CARDS[place.card.upper()].spec.params.get(place.key)
        options = () if param is None else ("yes", "no") if param.kind == "flag" else param.words
        for name in options:
            yield Item("word", name)
    elif kind == "probe":
        if place.card in (".meas", ".measure") and not place.call:
            for name, (form, meaning) in words.MEASURES.items():
                yield Item("word", name, form, meaning)
        for name, (form, unit, meaning) in words.PROBES.items():
            yield Item("function", name, f"{form} [{unit}]", meaning, name + "(")
        results = words.OF_RESULTS if place.card in OF_RESULTS else {}
        for name, (form, meaning) in {**words.FUNCTIONS, **results}.items():
            yield Item("function", name, form, meaning, name + "(")
    elif kind == "option":
        yield from _options(place)
    elif kind == "of_model":
        yield from _model(place)


def _named(document: Document, kinds: tuple[str, ...], scope: tuple[str, ...]) -> Iterator[Item]:
    for symbol in document.visible(kinds, scope):
        text = about(document, symbol)
        yield Item(symbol.kind, symbol.name, text.partition("\n")[0].replace("**", ""), text)


def _keys(place: Place) -> Iterator[Item]:
    """Parameters of the card; the editor sees those already given and the user their double."""
    if place.is_machine:
        for key, param in CARDS[place.card.upper()].spec.params.items():
            default = (
                "required" if param.required else "" if param.default is None else f"default {param.default}"
            )
            yield Item("key", key, f"[{param.unit}] {default}".strip(), param.meaning, key + "=")
        return
    kind = LETTERS.get(place.card[:1])
    if kind is None or not kind.supported:
        return
    for key, word in kind.instance.items():
        unit = f"[{word.unit}] " if word.unit else ""
        yield Item("key", key, f"{unit}of {kind.what}", word.meaning, key + "=")


def _options(place: Place) -> Iterator[Item]:
    from ..assemble.options import FORMULATIONS, METHODS
    from ..dialects import DIALECTS

    named = {"method": METHODS, "formulation": FORMULATIONS, "dialect": [d.name for d in DIALECTS]}
    if place.key in named:
        for name in named[place.key]:
            yield Item("word", name)
        return
    for name in words.OPTIONS:
        yield Item("option", name, words.option(name), "", name + "=")


def _model(place: Place) -> Iterator[Item]:
    if len(place.words) == 2 and not place.call:
        for name in [*MODEL_TYPES, *MOTORS]:
            yield Item("word", name, "type of model")
        return
    kind = place.words[2] if len(place.words) > 2 else place.call
    if kind in MOTORS:
        for key, param in MOTORS[kind].spec.params.items():
            if key != "model":
                yield Item("key", key, f"[{param.unit}]", param.meaning, key + "=")
    elif kind in MODEL_TYPES:
        for (key, *_), unit, default, meaning in MODEL_TYPES[kind].model_table(kind):
            shown = "" if default != default else f"default {default:g}"
            yield Item("key", key, f"[{unit}] {shown}".strip(), meaning, key + "=")
