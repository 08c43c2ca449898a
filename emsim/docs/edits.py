"""Edits of a deck as a lesson proposes them: a block of lines `- old` and `+ new`, or options as on the command line."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Edit:
    changes: tuple[tuple[str, str], ...]  # ("-", old line) and ("+", new line), in order
    options: tuple[str, ...]

    def apply(self, deck: str) -> str:
        """The deck with the lines replaced. ValueError where an old line does not stand there once, blanks aside."""
        lines = deck.splitlines()
        place = len(lines) - 1  # additions alone go before .end
        for sign, text in self.changes:
            if sign == "+":
                lines.insert(place, text)
                place += 1
                continue
            plain = [" ".join(line.split()) for line in lines]
            if plain.count(text) != 1:
                raise ValueError(f"{text!r} stands {plain.count(text)} times in the deck")
            place = plain.index(text)
            del lines[place]
        return "\n".join(lines) + "\n"


def edits(text: str) -> list[Edit]:
    """The edits of a page, in order."""
    out = []
    for block in blocks(text, "edit"):
        lines = [" ".join(line.split()) for line in block.splitlines()]
        changes = [(line[0], line[2:]) for line in lines if line.startswith(("- ", "+ "))]
        rest = " ".join(line for line in lines if not line.startswith(("- ", "+ ")))
        out.append(Edit(tuple(changes), tuple(rest.split())))
    return out


def blocks(text: str, word: str) -> list[str]:
    """What stands in a page's fenced blocks of this kind."""
    return re.findall(rf"^```{word}\n(.*?)^```$", text, re.M | re.S)
