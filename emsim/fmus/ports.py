"""What comes from outside: sources, plain R, L, C and parameters (.param) by name, and numbers or waveforms of machine cards,
`load(tau)`, or `load` where there is but one. Parameters are left open when the deck is read; the rest is put in place of what
the flat deck has."""

from __future__ import annotations

import copy

from ..build import parse_signals
from ..cards import CARDS
from ..deck import Probe, Waveform
from ..diagnostics import Sink, Span, deck_error, suggest
from ..expr import OUTSIDE, Name, Num
from ..opened import Opened
from ..source import SourceFile

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..deck import MachineCard
    from ..elaborate.flat import FlatDeck
    from ..elements import Element

# list of .fmu -> causality and variability, in the words of FMI
WAYS = {"in": ("input", "continuous"), "param": ("parameter", "fixed"), "tune": ("parameter", "tunable")}
UNITS = {"v": "V", "i": "A"}
PASSIVE = ("r", "l", "c")


class Port:
    """One value from outside: `name` as it is asked for, its unit, what it is where nothing is said, what it is of the deck, and
    `way` by which it comes."""

    __slots__ = ("name", "place", "says", "start", "unit", "way")

    def __init__(self, name: str, unit: str, start: float, says: str, place: Span, way: str) -> None:
        self.name, self.unit, self.start, self.says = name, unit, start, says
        self.place, self.way = place, way


def given(texts: str | Sequence[str], is_out: bool) -> list[Probe]:
    """Words from the command line, or from a call."""
    found: list[Probe] = []
    for text in (texts,) if isinstance(texts, str) else texts:
        if is_out:
            found += parse_signals(text)
            continue
        file = SourceFile("--in", text)
        for word in text.replace(",", " ").split():
            at = text.index(word)
            span = Span(file, 1, at + 1, at + len(word) + 1)
            found.append(Probe(word.lower(), Name(word.lower(), span), span))
    return found


def opened(flat: FlatDeck) -> dict[str, float]:
    """Parameters of the deck (.param) that the lists name, with their values: those of a deck that was read without lists."""
    others = {e.name for e in flat.elements} | {c.name for c in flat.machine}
    words = [probe.text for key in WAYS for probe in flat.fmu.get(key, ())]
    return {word: flat.params[word] for word in words if word in flat.params and word not in others}


def take(flat: FlatDeck, params: Mapping[str, float]) -> list[Port]:
    """The values that the lists name; from here on they come from outside. `params`: of the deck's parameters the values where
    nothing is said. Raises DeckError (E381)."""
    flat.inputs, found = Opened({OUTSIDE + name: value for name, value in params.items()}), []
    for key in WAYS:
        for probe in flat.fmu.get(key, ()):
            if probe.text in params:
                value, says = params[probe.text], f".param {probe.text}"
                found.append(Port(probe.text, "", value, says, probe.span, key))
            else:
                found.append(_port(flat, probe, key))
    return found


def _port(flat: FlatDeck, probe: Probe, way: str) -> Port:
    assert flat.inputs is not None
    word = probe.text
    of, bracket, key = word.partition("(")
    key = key.removesuffix(")")
    source = next((e for e in flat.elements if e.name == of), None)
    if source is not None and not bracket and source.letter in UNITS:
        start = flat.inputs[of] = _start_of(flat, source)
        says = f"{source.what} {of}"
        return Port(word, UNITS[source.letter], start, says, probe.span, way)
    card = next((c for c in flat.machine if c.name == of), None)
    if card is not None:
        return _of_card(flat, card, key, probe, way)
    if source is not None and not bracket and _is_plain(source):
        start = flat.inputs[OUTSIDE + of] = float(source.value)
        behaves = copy.copy(source)
        behaves.value = Name(OUTSIDE + of, probe.span)
        flat.elements[flat.elements.index(source)] = behaves
        return Port(word, source.unit, start, f"{source.what} {of}", probe.span, way)
    if source is not None:
        said = f"`{word}` cannot come from outside: V, I, plain R, L, C, parameters, numbers and waveforms of machine cards can"
        deck_error("E381", said, probe.span, f"{word} is a {source.what}")
    sources = [e.name for e in flat.elements if e.letter in UNITS]
    near = suggest(of, [*sources, *(c.name for c in flat.machine)])
    hint = f"did you mean `{near}`?" if near else f"there are {', '.join(sources[:8]) or 'no sources'}"
    deck_error("E381", f"the deck has no source and no card `{word}`", probe.span, hint)


def _is_plain(e: Element) -> bool:
    """An R, L or C with a number and nothing else: an expression can stand in its place."""
    plain = e.letter in PASSIVE and isinstance(e.value, (int, float))
    return plain and e.may_behave and not e.params and e.model is None


def _start_of(flat: FlatDeck, source: Element) -> float:
    from .._engine import Builder
    from ..assemble.waves import of_source

    kind, args, _ = of_source(source, _times(flat), Sink())
    return Builder.wave_at(kind, args, 0.0)


def _times(flat: FlatDeck) -> tuple[float, float]:
    card = next(a for a in flat.analyses if a.kind == "tran")
    numbers = [float(a) for a in card.args if not isinstance(a, str)]
    return numbers[0], numbers[1]


def _of_card(flat: FlatDeck, card: MachineCard, key: str, probe: Probe, way: str) -> Port:
    assert flat.inputs is not None
    spec = CARDS[card.kind].variant(card, flat.models).spec
    able = [k for k, p in spec.params.items() if p.kind == "value"]
    written = [k for k in able if k in card.params]
    by_wave = ""
    if card.wave is not None:  # as the card's own reading has it (cards/base.py)
        by_wave = next(
            (k for k in able if k not in card.params and (k in ("value", "tau") or spec.params[k].required)),
            able[0],
        )
        written.append(by_wave)
    if not key and len(written) == 1:
        key = written[0]
    numbers = [
        k
        for k, p in spec.params.items()
        if p.kind in ("number", "formula") and isinstance(card.params.get(k), float)
    ]
    if key not in written and not (key in numbers and way != "in"):
        names = ", ".join(f"{card.name}({k})" for k in written)
        said = (
            f"{card.kind} {card.name} has no value `{key}`"
            if key
            else f"which value of {card.kind} {card.name} comes from outside?"
        )
        if not written:
            said = f"{card.kind} {card.name} has no value that could come from outside"
        deck_error("E381", said, probe.span, f"there is {names}" if names else f"the form is: {spec.form}")
    value = card.wave if key == by_wave else card.params[key]
    start = _number(flat, value)
    if start is None:
        said = f"`{key}` of {card.kind} {card.name} is an expression: what comes from outside stands for a number or a waveform"
        deck_error("E381", said, probe.span, "let the expression read a source, v(x), and drive that one")
    if key == by_wave:
        card.wave = None
    name = OUTSIDE + probe.text
    card.params[key] = Name(name, probe.span)
    flat.inputs[name] = start
    unit = spec.params[key].unit
    if card.kind == "TORQUE" and _slides(flat, card):
        unit = "N"
    return Port(
        probe.text,
        "" if " or " in unit else unit,
        start,
        f"{key} of {card.kind} {card.name}",
        probe.span,
        way,
    )


def _slides(flat: FlatDeck, card: MachineCard) -> bool:
    on = next((c for c in flat.machine if c.kind == "JOINT" and c.name == card.args[0].name), None)
    return on is not None and any(ref.name == "slide" for ref in on.args)


def _number(flat: FlatDeck, value: object) -> float | None:
    if isinstance(value, Waveform):
        from .._engine import Builder
        from ..assemble.waves import resolve

        kind, args = resolve(value, _times(flat), Sink())
        return Builder.wave_at(kind, args, 0.0)
    if isinstance(value, Num):
        return value.value
    return float(value) if isinstance(value, (int, float)) else None
