"""Short ways from text to deck for the tests of the front end."""

from __future__ import annotations

from emsim.build import read
from emsim.deck import MachineCard
from emsim.diagnostics import DeckError, Diagnostic
from emsim.elaborate import flatten
from emsim.elaborate.flat import FlatDeck
from emsim.elements import Element


def flat(cards: str, **defines: object) -> FlatDeck:
    """The flat deck of cards under a title line."""
    return flatten(read("title\n" + cards + "\n", defines))


def element(cards: str, name: str | None = None) -> Element:
    """The element of that name, or the first one."""
    elements = flat(cards).elements
    return elements[0] if name is None else next(e for e in elements if e.name == name)


def machine(card: str) -> MachineCard:
    """The only machine card of the text."""
    (only,) = flat(card).machine
    return only


def said(cards: str) -> list[Diagnostic]:
    """Every diagnostic, whether the deck is right or wrong."""
    try:
        return flat(cards).sink.diagnostics
    except DeckError as error:
        return error.diagnostics


def codes(cards: str) -> list[str]:
    return [d.code for d in said(cards)]
