"""What can be given another value, by name: of sweeps, of sensitivities along a transient, of fits.

r         a parameter of the deck (.param)
r1        the value of an element; of a source its DC value
temp      the temperature
npn(vaf)  a parameter of a model of the top level
m1(ke)    a number of an element's line, or of a machine card's
"""

from __future__ import annotations

from ..diagnostics import Sink, Span, deck_error, did_you_mean
from ..draws import Draws
from .altered import VALUES
from .flatten import flatten
from .steps import Step, has_plain_value

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..deck import Deck
    from ..diagnostics import Diagnostic
    from .flat import FlatDeck
    from .steps import Change

KNOWN = "a parameter (.param), the name of an element with a value, temp, model(parameter), or card(parameter) as in m1(ke)"


def step(name: str, deck: Deck, place: Span) -> Step | None:
    """What a name means where it is no parameter."""
    if name in deck.params:
        return None
    of, bracket, key = name.partition("(")
    if bracket:
        return Step("model", of, [], place, key.removesuffix(")"))
    return Step("temp" if name == "temp" else "element", name, [], place)


def with_values(
    deck: Deck,
    given: Mapping[str, float],
    place: Span,
    temp: object = None,
    draws: Draws | None = None,
    changes: Sequence[Change] = (),
    said: Sequence[Diagnostic] = (),
) -> FlatDeck:
    """The deck read with other values of some quantities, on top of its defines. `said`: what was told of its text. Raises
    DeckError."""
    before, sink = deck.defines, deck.sink
    deck.sink = Sink()
    for diagnostic in said:
        deck.sink.add(diagnostic)
    own = [(found, value) for name, value in given.items() if (found := step(name, deck, place)) is not None]
    elsewhere = {found.column for found, _ in own}
    deck.defines = {**before, **{k: v for k, v in given.items() if k not in elsewhere}}
    try:
        return flatten(deck, temp, draws, [*changes, *own])
    finally:
        deck.defines, deck.sink = before, sink


def reread(flat: FlatDeck, given: Mapping[str, float]) -> FlatDeck:
    """A flat deck with other values of some quantities, read again from what it was made from. Raises DeckError."""
    origin = flat.origin
    deck, draws = origin.deck, origin.draws
    before = deck.defines
    deck.defines = origin.defines
    same = None if draws is None else Draws(draws.seed, draws.places, draws.tolerances)
    try:
        return with_values(deck, given, Span(deck.file, 1, 1, 2), origin.temp, same, origin.changes)
    finally:
        deck.defines = before


def value(flat: FlatDeck, name: str, span: Span | None = None) -> float:
    """What a quantity is in a deck. Raises DeckError: E346 for a name that nothing has, E345 for what has no single value."""
    if name in flat.params:
        return flat.params[name]
    if name == "temp":
        return flat.temp
    of, bracket, key = name.partition("(")
    key = key.removesuffix(")")
    element = next((e for e in flat.elements if e.name == of), None)
    card = next((c for c in flat.machine if c.name == of), None)
    model = flat.models.get(of)
    if bracket and (model or element or card):
        params = model.params if model else element.params if element else card.params if card else {}
        found = params.get(key)
        if found is None and element is not None and key in VALUES.get(element.letter, ()):
            found = element.value
        if isinstance(found, (int, float)):
            return float(found)
        numbers = ", ".join(k for k, v in params.items() if isinstance(v, (int, float)) and k != "level")
        hint = f"`{of}` has {numbers}" if numbers else None
        deck_error("E345", f"`{of}` has no number `{key}` on its line", span, hint)
    if element is None:
        said = f"there is no parameter and no element `{name}`"
        deck_error(
            "E346", said, span, did_you_mean(name, [*flat.params, *(e.name for e in flat.elements)], KNOWN)
        )
    if has_plain_value(element):
        plain = (element.extra.get("dc") or 0.0) if "dc" in element.extra else element.value
        return float(plain)
    hint = "make it a parameter: .param x=.. and {x} on the card"
    deck_error("E345", f"`{name}` has no single value that could be changed", element.span, hint)
