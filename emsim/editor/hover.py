"""What an editor shows about the word under the cursor, as Markdown: cards and parameters from their specs, names with what
they stand for and their values, numbers as they are read."""

from __future__ import annotations

from ..cards import CARDS
from ..cards.motors import MODELS as MOTORS
from ..deck import Func, Instance, MachineCard, Model, Param, Ref, Subckt
from ..elements import LETTERS, MODEL_TYPES, Element
from ..expr import Node, Num
from ..reports.words import default as says_default
from ..reports.words import limits
from ..units import machine_number, spice_number
from . import words
from .place import Place
from .signature import signature, wave

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..cards.base import Param as CardParam
    from ..cards.base import Spec
    from .document import Document, Symbol

ANYTHING = ("param", "func", "joint", "body", "point", "card", "element", "node", "model", "subckt")
MECHANICAL = ("joint", "body", "point", "card")


def hover(document: Document, row: int, col: int) -> str | None:
    """Markdown, or None where nothing can be said. Row and column from 0."""
    place = Place(document.lines, row, col)
    if not place.is_code or not place.word:
        return None
    if place.is_command and not place.words:
        form, meaning = words.commands().get(place.word.lower(), ("", ""))
        return f"**{place.word.lower()}** — {meaning}\n\n    {form}" if form else None
    if not place.words and not place.key:
        return _first_word(document, place, row)
    if place.is_machine and place.is_key and not place.inside:
        spec = CARDS[place.card.upper()].spec
        param = spec.params.get(place.word.lower())
        if param is not None:
            return _param(spec, place.word.lower(), param)
    if place.card == ".model" and len(place.words) > 1 and place.is_key and (said := _model_key(place)):
        return said
    if place.card in (".options", ".option", ".opt") and place.word.lower() in words.OPTIONS:
        return f"**{place.word.lower()}** — {words.option(place.word.lower())}"
    if place.card in (".meas", ".measure") and not place.call and place.word.lower() in words.MEASURES:
        form, meaning = words.MEASURES[place.word.lower()]
        return f"**{place.word.lower()}** — {meaning}\n\n    {form}"
    if place.is_call and (said := _function(place.name.lower())):
        return said
    symbol = symbol_at(document, place, row)
    if symbol is not None:
        return about(document, symbol)
    said = _number(place)
    if (
        said is not None
        and place.call.upper() in words.WAVES
        and (due := signature(document, row, place.start))
    ):
        return f"{said}\n\n{due.about}" if due.about else said
    return said


def symbol_at(document: Document, place: Place, row: int) -> Symbol | None:
    """What a name at a place stands for: first what the card expects there, then anything."""
    scope = document.scope_at(row)
    expected = tuple(kind for kind in place.expects() if kind in ANYTHING)
    if place.card == ".subckt":
        expected = ("subckt",) if len(place.words) == 1 else expected
    elif place.card == ".model":
        expected = ("model",) if len(place.words) == 1 else expected
    elif place.is_machine and len(place.words) == 1:
        expected = MECHANICAL
    for word in dict.fromkeys((place.word, place.name)):
        name = word.lower().partition("(")[0]
        kinds = (*expected, *(ANYTHING if not expected or place.inside else ()))
        found = document.find(name, kinds, scope)
        if found is None and ("point" in expected or "body" in expected or place.inside):
            # arm.com, or a point that no card names: the body
            found = document.find(name.partition(".")[0], ("body",), scope)
        if found is not None:
            return found
    return None


def definition(document: Document, row: int, col: int) -> Symbol | None:
    """Where the name under the cursor is given; of a node, where it is first used."""
    place = Place(document.lines, row, col)
    if not place.is_code or not place.word or place.is_call:
        return None
    if not place.words:
        return (
            None
            if place.is_machine or place.card[:1] == "."
            else document.find(place.word, ("element",), document.scope_at(row))
        )
    return None if place.is_key and not place.inside else symbol_at(document, place, row)


# ---- cards --------------------------------------------------------------------------------------


def _first_word(document: Document, place: Place, row: int) -> str | None:
    word = place.word.lower()
    if place.is_machine:
        return card_text(word)
    if word[:1] == ".":
        form, meaning = words.DOTS.get(word, ("", ""))
        return f"**{word}** — {meaning}\n\n    {form}" if form else None
    symbol = document.find(word, ("element",), document.scope_at(row))
    return about(document, symbol) if symbol is not None else element_text(word[0])


def card_text(word: str) -> str:
    """The reference of a machine card, from its spec."""
    spec = CARDS[word.upper()].spec
    rows = "\n".join(
        f"| `{key}` | {param.unit or '-'} | {says_default(param)} | {param.meaning} |"
        for key, param in spec.params.items()
    )
    head = "| parameter | unit | default | meaning |\n|---|---|---|---|\n"
    return f"**{spec.word}** — {spec.meaning}\n\n    {spec.form}\n\n" + (head + rows if rows else "")


def element_text(letter: str) -> str | None:
    """What an element is and how it is written."""
    kind = LETTERS.get(letter)
    if kind is None:
        return None
    later = "" if kind.supported else ", not supported yet"
    return f"**{letter.upper()}** — {kind.what}{later}" + (f"\n\n    {kind.form}" if kind.form else "")


def _param(spec: Spec, key: str, param: CardParam) -> str:
    unit = f" [{param.unit}]" if param.unit else ""
    default = (
        "required"
        if param.required
        else f"default {says_default(param)}"
        if param.default is not None
        else ""
    )
    facts = "; ".join(filter(None, [default, *limits(param)]))
    return f"**{spec.word} {key}=**{unit} — {param.meaning}" + (f"\n\n{facts}" if facts else "")


def _function(name: str) -> str | None:
    if (said := wave(name)) is not None:
        return said
    if name in words.PROBES:
        form, unit, meaning = words.PROBES[name]
        return f"**{form}** [{unit}] — {meaning}"
    if name in words.FUNCTIONS or name in words.OF_RESULTS:
        form, meaning = words.FUNCTIONS.get(name) or words.OF_RESULTS[name]
        return f"**{form}** — {meaning}"
    return None


def _model_key(place: Place) -> str | None:
    """A parameter of an element's .model, of a motor's."""
    kind, key = (place.words[2] if len(place.words) > 2 else place.call), place.word.lower()
    if kind in MODEL_TYPES:
        for names, unit, default, meaning in MODEL_TYPES[kind].model_table(kind):
            if key in names:
                shown = "" if default != default else f"\n\ndefault {default:g}"
                return f"**{key}=**" + (f" [{unit}]" if unit else "") + f" — {meaning}{shown}"
    if kind in MOTORS and key in MOTORS[kind].spec.params:
        return _param(MOTORS[kind].spec, key, MOTORS[kind].spec.params[key])
    return None


def _number(place: Place) -> str | None:
    """A number as it is read: SI on machine cards, SPICE's rule elsewhere."""
    value = machine_number(place.word) if place.is_machine else spice_number(place.word)
    if value is None:
        return None
    unit = ""
    if place.is_machine and place.key:
        param = CARDS[place.card.upper()].spec.params.get(place.key)
        unit = param.unit if param is not None else ""
    return f"`{place.word}` is {value:.12g}" + (f" {unit}" if unit else "")


# ---- names --------------------------------------------------------------------------------------


def about(document: Document, symbol: Symbol) -> str:
    """What a name stands for, and its value at the start where there is one."""
    card, name = symbol.card, symbol.name
    inner = f" of subcircuit {symbol.scope[-1]}" if symbol.scope else ""
    if isinstance(card, Param):
        value = None if symbol.scope else document.param(name)
        written = _source(card.value)
        text = f"**{name}** — parameter{inner} = {written}"
        return text if value is None or written == f"{value:.12g}" else f"{text}\n\n= {value:.12g}"
    if isinstance(card, Func):
        return f"**{name}({', '.join(card.args)})** — function = {_source(card.body)}"
    if isinstance(card, Model):
        params = " ".join(f"{key}={_source(value)}" for key, value in card.params.items())
        return f"**{name}** — .model {card.type} {params}".rstrip()
    if isinstance(card, Subckt):
        params = " ".join(f"{key}={_source(value)}" for key, value in card.params.items())
        return f"**{name}** — subcircuit\n\n    .subckt {name} {' '.join(card.ports)} {params}".rstrip()
    if symbol.kind == "node":
        return (
            f"**{name}** — "
            + ("ground" if name == "0" else f"node{inner}")
            + _values(document, symbol, [f"v({name})"])
        )
    if isinstance(card, MachineCard):
        return _machine(document, symbol, card)
    return _element(document, symbol, card, inner)


def _machine(document: Document, symbol: Symbol, card: MachineCard) -> str:
    spec = CARDS[card.kind].spec
    lines = [f"**{symbol.name}** — {card.kind}: {spec.meaning}"]
    if card.args:
        lines.append("terminals: " + " ".join(_source(ref) for ref in card.args))
    for key, value in card.params.items():
        param = spec.params.get(key)
        unit = (
            f" {param.unit}"
            if param is not None and param.unit and param.kind in ("number", "formula", "vector")
            else ""
        )
        lines.append(
            f"`{key}` = {_source(value)}{unit}" + (f" ({param.meaning})" if param is not None else "")
        )
    calls = [f"{fn}({symbol.name})" for fn in ("angle", "omega", "pos", "vel", "i")]
    return "\n\n".join(lines) + _values(document, symbol, [*calls, symbol.name])


def _element(document: Document, symbol: Symbol, card: Element | Instance, inner: str) -> str:
    if isinstance(card, Instance):
        return f"**{symbol.name}** — subcircuit {card.of.name}{inner}, between " + " ".join(
            map(_source, card.refs)
        )
    text = f"**{symbol.name}** — {card.what}{inner}, between {' '.join(card.nodes)}"
    if card.model_name:
        text += f", model {card.model_name}"
    if card.value is not None:
        unit = f" {card.unit}" if card.unit else ""
        value, written = None, _source(card.value)
        if document.flat is not None and not symbol.scope:
            flat = next((e for e in document.flat.elements if e.name == symbol.name), None)
            value = flat.value if flat is not None and isinstance(flat.value, float) else None
        text += f"\n\nvalue {written}" if value is None else f"\n\nvalue {value:.12g}{unit}"
    return text + _values(document, symbol, [f"i({symbol.name})"])


def _values(document: Document, symbol: Symbol, columns: list[str]) -> str:
    """Values at the start; inside a subcircuit a name has as many as there are uses."""
    if symbol.scope or symbol.name == "0":
        return ""
    found = [(column, document.at_start(column)) for column in columns]
    lines = [
        f"at the start: {column} = {pair[0]:.6g} {pair[1]}".rstrip()
        for column, pair in found
        if pair is not None
    ]
    return "".join("\n\n" + line for line in lines)


def _source(value: Any) -> str:
    """A value as it is written; an expression in the user's own letters."""
    if isinstance(value, Ref):
        point = "" if value.point is None else "(" + ",".join(map(_source, value.point)) + ")"
        return value.name + point
    if isinstance(value, tuple):
        return "(" + ",".join(map(_source, value)) + ")"
    if isinstance(value, (float, Num)):
        return f"{float(value if isinstance(value, float) else value.value):.12g}"
    if isinstance(value, Node):
        return f"{{{value}}}"
    return str(value)
