"""Colours of decks on the site: a Pygments lexer for the language `spice`, with the cards' own words."""

from __future__ import annotations

import re
from typing import ClassVar

from pygments.lexer import RegexLexer, bygroups
from pygments.lexers import LEXERS
from pygments.token import Comment, Generic, Keyword, Name, Number, Operator, String, Text

from emsim.cards import CARDS
from emsim.editor.textmate import card_pattern

__all__ = ["DeckLexer", "EditLexer"]


class DeckLexer(RegexLexer):
    """Lines as emsim reads them. What ends with .end is a whole deck, whose first line is its title."""

    name = "Deck"
    flags = re.MULTILINE | re.IGNORECASE
    tokens: ClassVar = {
        "root": [
            (r"\A.*$(?=[\s\S]*^\.end\s*$)", Generic.Subheading),
            (r"^\s*\*.*$", Comment.Single),
            (r"^\s*\.[a-z]+", Keyword),
            # a card is one where it carries its mark
            *((card_pattern(word).replace("(?i)", ""), Name.Class) for word in CARDS),
            (r"^\s*\+", Operator),
            (r"^\s*[RCLVIEFGHBKDSWXQMJ][\w.#]*(?=\s+[^\s=]+\s)", Name.Function),
            (r"(?:;|\$ ).*$", Comment.Single),
            (r"([a-z_][\w.]*)(\s*)(=)(?!=)", bygroups(Name.Attribute, Text, Operator)),
            (r"\b(?:pulse|sin|exp|pwl|sffm|am)\b(?=\s*\()", Name.Builtin),
            (r"[a-z_][\w.]*(?=\()", Name.Builtin),
            (r"(?<![\w.#$])[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?[a-zµμ%]*(?![\w.])", Number),
            (r'"[^"\n]*"', String),
            (r"[^\S\n]+|\n", Text),
            (r"[\w.#]+|.", Text),
        ]
    }


class EditLexer(RegexLexer):
    """Lines to take out (-) and to put in (+) of a deck, as the lessons show edits; -D is an option."""

    name = "Edit"
    tokens: ClassVar = {
        "root": [
            (r"^\+ .*\n?", Generic.Inserted),
            (r"^- .*\n?", Generic.Deleted),
            (r".*\n", Text),
            (r".+", Text),
        ]
    }


def register() -> None:
    """Pygments knows another language called Spice; here `spice` is a deck."""
    LEXERS.pop("SpiceLexer", None)
    LEXERS["DeckLexer"] = (__name__, "Deck", ("spice",), ("*.cir",), ())
    LEXERS["EditLexer"] = (__name__, "Edit", ("edit",), (), ())
