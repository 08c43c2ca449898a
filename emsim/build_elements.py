"""Lines of elements: the class of a letter reads them (elements/)."""

from __future__ import annotations

from .build_expr import node_name
from .elements import LETTERS, Element
from .elements.base import NOTHING
from .elements.words import Cards
from .source import SourceFile

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .deck import Instance
    from .source import Line

_new = object.__new__


def form(letter: str) -> str:
    """The form of a card, for a hint."""
    from .mistakes import FORMS

    return "form: " + FORMS.get(letter, letter)


class ElementCards(Cards):
    """Elements: a class each says what the words of its lines mean (elements/)."""

    file: SourceFile
    body: list[Any]

    def element(self, rule: str, ch: list[Any], line: Line) -> Element | Instance:
        e = LETTERS[ch[0][0].lower()].of_line(self, rule, ch, line)
        if e.params and isinstance(e, Element) and e.letter in "bclv":
            from .elements.parasitics import taken_out

            self.body += taken_out(e)
        return e

    def plain(self, name: str, nodes: list[str], last: str, value: float | None, place: int) -> Element:
        """A card that is nothing but words, the most frequent of all: without a tree; its spans are made when somebody
        asks for them."""
        kind = LETTERS[name[0]]
        e = _new(kind)
        e.name = name
        e.nodes = nodes if "gnd" not in nodes else [node_name(node) for node in nodes]
        e.file, e.place, e.is_plain = self.file, place, True
        e.value, e.params, e.wave, e.extra, e.model_name, e.model = value, NOTHING, None, NOTHING, None, None
        if value is None:
            e.model_name = last
        elif kind.has_word:
            e.take_words_alone()
        return e
