"""Machine cards: generic reading of names, points, key=value, waveforms; their meaning is in cards/."""

from __future__ import annotations

from .build_expr import braces_around, error_at, extent, machine_value, node_name, parts
from .cards import CARDS
from .deck import MachineCard, Ref, Waveform
from .expr import Node
from .source import Line
from .units import UNITS, split_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

WAVES = frozenset(("pulse", "sin", "exp", "pwl", "sffm", "am"))


def _wave(item: Any, line: Line) -> Waveform:
    """A waveform written as a call, e.g. PULSE(0 2 3 1m 1m 50m 100)."""
    children = parts(item[1][1][1])
    args = [machine_value(c, line) for c in children]
    for child, value in zip(children, args, strict=True):
        if not isinstance(value, float | Node):
            around = item if child == "time" else child  # a sine of the time, or the level of a waveform
            raise error_at("E116", f"`{item[1][0]}` takes numbers", line, child, braces_around(around, line))
    return Waveform(str(item[1][0].lower()), args, {}, line.span_at(*extent(item)))


def machine_card(ch: list[Any], line: Line) -> MachineCard:
    """A line by the one rule of mechanics.lark that is a card."""
    kind = str(ch[0]).upper()
    card = MachineCard(kind, str(ch[1].lower()), [], {}, None, line.span(ch[0]), {}, line)
    for item in ch[2:]:
        rule = item[0] if item.__class__ is tuple else ""
        if rule in ("setting", "driven"):
            _setting(card, item, line)
        elif rule == "call_value" and item[1][0].lower() in WAVES:
            _positional(card, _wave(item, line), item, line)
        elif rule == "call_value":
            point = tuple(machine_value(c, line) for c in parts(item[1][1][1]))
            _note_units(card, "", item, line)
            card.args.append(Ref(node_name(item[1][0]), point, line.span_at(*extent(item))))
        elif rule == "tuple":
            _group(card, item, line)
        elif rule == "braced" or (not rule and _is_value(card, item)):
            _positional(card, machine_value(item, line), item, line)
        else:
            card.args.append(Ref(node_name(item), None, line.span(item)))
    if kind == "POINT":
        _point(card, line, ch[1])
    return card


def _group(card: MachineCard, item: Any, line: Line) -> None:
    """Names in parentheses behind the card's own: the nodes of several windings, several joints."""
    if not CARDS[card.kind].grouped:
        raise error_at("E102", "`(` does not fit here", line, item, CARDS[card.kind].spec.form)
    names = parts(item[1])
    for name in names:
        if name.__class__ is tuple:
            raise error_at(
                "E102", "names of nodes or joints stand here", line, name, CARDS[card.kind].spec.form
            )
        card.args.append(Ref(node_name(name), None, line.span(name)))
    card.groups = (*card.groups, len(names))


def _is_value(card: MachineCard, word: Any) -> bool:
    """Whether a positional word is a value: 0 may be ground and nodes may have numbers for names."""
    if split_number(word) is None:
        return False
    return card.kind == "POINT" or bool(card.params) or (CARDS[card.kind].valued and bool(card.args))


def _setting(card: MachineCard, item: Any, line: Line) -> None:
    key_leaf, value_tree = item[1]
    key = _key(key_leaf, line) if key_leaf.__class__ is tuple else str(key_leaf.lower())
    if key in card.param_spans:
        raise error_at("E117", f"`{key}` is given twice", line, key_leaf)
    card.param_spans[key] = line.span_at(*extent(item))
    _note_units(card, key, value_tree, line)
    if value_tree.__class__ is tuple and value_tree[0] == "call_value" and value_tree[1][0].lower() in WAVES:
        wave = _wave(value_tree, line)
        if key in ("tau", "value") and card.wave is None:
            card.wave = wave
        else:
            card.params[key] = wave  # type: ignore[assignment]
    else:
        so_far = len(line.file.remarks)
        card.params[key] = machine_value(value_tree, line)
        param = CARDS[card.kind].spec.params.get(key)
        if param is not None and param.unit == "Pa":  # of which there are giga, and no grams
            line.file.remarks[so_far:] = [r for r in line.file.remarks[so_far:] if r.code != "W112"]


def _key(call: Any, line: Line) -> str:
    """What `v(a,b)={..}` of a BLOCK sets."""
    words = parts(call[1][1][1])
    if call[1][0].lower() != "v" or len(words) not in (1, 2) or any(w.__class__ is tuple for w in words):
        said = "a voltage can be set so, v(node)= or v(n+,n-)=, and nothing else"
        raise error_at("E102", said, line, call, "BLOCK name clock= v(out)={expression}")
    return f"v({','.join(node_name(w) for w in words)})"


def _positional(card: MachineCard, value: Any, item: Any, line: Line) -> None:
    span = line.span_at(*extent(item))
    _note_units(card, "at" if card.kind == "POINT" else "value", item, line)
    if card.kind == "POINT":
        at = card.params.setdefault("at", ())
        assert isinstance(at, tuple)
        card.params["at"] = (*at, value)
        card.param_spans.setdefault("at", span)
    elif "value" in card.params or card.wave is not None:
        raise error_at(
            "E117",
            f"{card.kind} has a second value here",
            line,
            item,
            CARDS[card.kind].spec.form,
        )
    elif isinstance(value, Waveform):
        card.wave = value
        card.param_spans["value"] = span
    else:
        card.params["value"] = value
        card.param_spans["value"] = span


def _note_units(card: MachineCard, key: str, item: Any, line: Line) -> None:
    """Keeps which units the numbers of an item carry, for cards/quantities.py. A number inside a calculation says
    nothing about the unit of the whole."""
    rule, numbers, wave = (item[0] if item.__class__ is tuple else ""), [item], ""
    if rule == "tuple":
        numbers = parts(item[1])
    elif rule == "call_value":
        numbers = parts(item[1][1][1])
        wave = str(item[1][0].lower()) if item[1][0].lower() in WAVES else ""
    for k, number in enumerate(numbers):
        while number.__class__ is tuple and number[0] in ("braced", "group", "quoted", "unary"):
            number = number[1][1]
        if number.__class__ is tuple or (split := split_number(number)) is None:
            continue
        if (unit := split[1].lower()) in UNITS:
            card.units.append((key, wave, k, unit, line.span(number)))


def _point(card: MachineCard, line: Line, name: Any) -> None:
    at = card.params.get("at", ())
    assert isinstance(at, tuple)
    if card.args or len(at) not in (2, 3):
        raise error_at("E109", "POINT needs x and y, in space z too", line, name, CARDS["POINT"].spec.form)
