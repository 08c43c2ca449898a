"""Which lines are machine cards: the first word is a card's, and the line has what the card is told from an element by."""

from __future__ import annotations

from . import source
from .cards import CARDS
from .syntax import first_word, uncommented

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .cards.base import Card
    from .source import Line

source.HANDED_BACK.extend(CARDS)


def card_class(line: Line) -> type[Card] | None:
    """The class of the machine card that a line is meant as; None where it is SPICE."""
    card = CARDS.get(first_word(line.text).upper())
    return card if card is not None and card.marked(uncommented(line.text)) else None


def is_card_word(word: str) -> bool:
    """Whether a line that begins so may be a machine card."""
    return word.upper() in CARDS


def start_of(line: Line) -> str:
    """From which start of the grammar a line of a deck is read."""
    return "dot" if line.text[0] == "." else "machine_card" if card_class(line) else "element"


def missing_mark(word: str) -> str:
    """Why a line that begins with a card word was read as SPICE, as a hint."""
    card = CARDS[word.upper()]
    return (
        f"a {word.upper()} card needs {card.mark_in_words()}; without it the line is SPICE element {word[0].upper()}\n"
        f"form: {card.spec.form}"
    )
