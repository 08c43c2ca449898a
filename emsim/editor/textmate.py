"""The colours of decks in editors that read TextMate grammars (VS Code, Sublime Text, GitHub), made from the cards' specs:

    python -m emsim.editor.textmate > emsim/editor/vscode/emsim.tmLanguage.json

A line is coloured as a machine card where it carries its card's mark; a mark on a continuation line is not seen.
"""

from __future__ import annotations

import json

from ..assemble.behaviour import FUNCTIONS
from ..cards import CARDS
from ..cards.joints import ALIASES, KINDS
from .words import DOTS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

WAVES = ("PULSE", "SIN", "EXP", "PWL", "SFFM", "AM", "TRNOISE", "TRRANDOM", "POLY", "TABLE", "VALUE")
NUMBER = r"(?i)(?<![\w.#$])[+-]?(?:\d+\.?\d*|\.\d+)(?:[ed][+-]?\d+)?[a-zµμ%]*(?![\w.])"
KEY = r"(?i)(?<![\w.])([a-z_][\w.]*)\s*(=)(?!=)"


def card_pattern(word: str) -> str:
    """The card word, where the rest of the line holds its mark."""
    kinds = "|".join([*KINDS, *ALIASES])
    marks = rf"(?:[^;]*\s)?(?:{'|'.join(CARDS[word].spec.mark)})\s*=(?!=)"
    terminal = r"[^\s=(){},;\"']+(?:\s*\([^()]*\))?\s+"
    mark = {
        "POINT": r"\s+[^\s=(){},;\"'.]+\.[^\s=(){},;\"']+\s",
        "JOINT": rf"\s+[^\s=(){{}},;\"']+\s+{terminal}{terminal}(?:{kinds})(?:[\s;,]|$)",
        "BODY": rf"\s(?!(?:[^;]*\s)?[vi]\s*=(?!=)){marks}",
    }.get(word, rf"\s{marks}")
    return rf"(?i)^\s*({word})(?={mark})"


def grammar() -> dict[str, Any]:
    """The grammar as VS Code reads it."""
    dots = "|".join(sorted((word[1:] for word in DOTS), key=lambda w: (-len(w), w)))
    functions = "|".join(sorted(FUNCTIONS, key=lambda w: (-len(w), w)))
    cards = [
        {
            "match": card_pattern(word) + r"\s+([^\s=(){},;\"']+)",
            "captures": {"1": {"name": "storage.type.card.emsim"}, "2": {"name": "entity.name.type.emsim"}},
        }
        for word in CARDS
    ]
    return {
        "name": "emsim",
        "scopeName": "source.emsim",
        "patterns": [
            {"match": r"\A.*$", "name": "markup.heading.title.emsim"},
            {
                "begin": r"(?i)^\s*\.control\b",
                "end": r"(?i)^\s*\.endc\b",
                "name": "meta.embedded.control.emsim",
                "beginCaptures": {"0": {"name": "keyword.control.emsim"}},
                "endCaptures": {"0": {"name": "keyword.control.emsim"}},
            },
            {"include": "#comments"},
            {"match": r"^\s*\+", "name": "punctuation.separator.continuation.emsim"},
            {"match": rf"(?i)^\s*\.(?:{dots})\b", "name": "keyword.control.emsim"},
            {"match": r"^\s*\.\S+", "name": "keyword.other.emsim"},
            *cards,
            {
                "match": r"^\s*([A-Za-z][^\s=(){},;\"']*)",
                "captures": {"1": {"name": "entity.name.function.element.emsim"}},
            },
            {"include": "#values"},
        ],
        "repository": {
            "comments": {
                "patterns": [
                    {"match": r"^\s*(?:\*|\$|//).*$", "name": "comment.line.emsim"},
                    {"match": r";.*$", "name": "comment.line.semicolon.emsim"},
                    {"match": r"(?<=[ \t])//.*$", "name": "comment.line.double-slash.emsim"},
                    {"match": r"(?<=[ \t,])\$.*$", "name": "comment.line.dollar.emsim"},
                ]
            },
            "values": {
                "patterns": [
                    {"include": "#comments"},
                    {
                        "match": KEY,
                        "captures": {
                            "1": {"name": "variable.parameter.emsim"},
                            "2": {"name": "keyword.operator.assignment.emsim"},
                        },
                    },
                    {
                        "match": rf"(?i)(?<![\w.])(?:{'|'.join(WAVES)})(?=\s*[({{\s])",
                        "name": "support.type.emsim",
                    },
                    {"match": rf"(?i)(?<![\w.])(?:{functions})(?=\s*\()", "name": "support.function.emsim"},
                    {
                        "match": rf"(?i)(?<=\s)(?:{'|'.join([*KINDS, *ALIASES])})(?=[\s;,]|$)",
                        "name": "storage.modifier.joint.emsim",
                    },
                    {"match": NUMBER, "name": "constant.numeric.emsim"},
                    {"match": r"\*\*|[-+*/^<>!=&|?:]=?", "name": "keyword.operator.emsim"},
                    {"match": r"[{}'\"]", "name": "punctuation.section.expression.emsim"},
                ]
            },
        },
    }


def text() -> str:
    return json.dumps(grammar(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    import sys

    sys.stdout.write(text())
