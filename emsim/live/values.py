"""Numbers of a deck's own lines that the live page makes sliders of, beside its .param: of `R C L V I` lines the value,
of machine cards every `key=number`. A chosen value stands in the text in place of the deck's, columns to its left unmoved.

Lines within .subckt and .control, and names that a deck has twice, are left out: a name tells one place.
"""

from __future__ import annotations

import re

from ..cards import CARDS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NamedTuple

    class Place(NamedTuple):
        shown: str
        text: str
        line: int  # 1-based, as columns are
        col: int
        end: int

else:
    from collections import namedtuple

    Place = namedtuple("Place", "shown text line col end")

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?:[a-z\u00b0\u00b5\u03bc][\w\u00b0/*^.]*)?"
_ELEMENT = re.compile(rf"\s*([rclvi][^\s=]*)\s+[^\s=]+\s+[^\s=]+\s+(?:dc\s*=?\s*)?({_NUMBER})(?=\s|$)", re.I)
_WORD = re.compile(r"\s*([a-z]+)\s+([^\s=]+)\s", re.I)
_KEY = re.compile(rf"(?<![\w.(,])([a-z]\w*)\s*=\s*({_NUMBER})(?=\s|$)", re.I)
_BLOCKS = {".subckt": ".ends", ".macro": ".eom", ".control": ".endc"}


def places(text: str) -> dict[str, Place]:
    """Name -> place; names are `r1:value`, `sled:m`."""
    found: dict[str, Place | None] = {}
    closing: str | None = None
    for number, line in enumerate(text.split("\n")[1:], 2):
        word = line.split(None, 1)[0].lower() if line.strip() else ""
        if closing is not None:
            closing = None if word == closing else closing
            continue
        if word in (".end", ".endl"):
            break
        closing = _BLOCKS.get(word)
        body = re.split(r"[;$]", line, maxsplit=1)[0]
        card = _WORD.match(body)
        keys = [(m, f"{card[2]}:{m[1]}", f"{card[2]} {m[1]}") for m in _KEY.finditer(body)] if card else []
        if card and card[1].upper() in CARDS and (keys or card[1].isupper()):
            hits = [(m.start(2), m.end(2), name, shown) for m, name, shown in keys]
        elif element := _ELEMENT.match(body):
            hits = [(element.start(2), element.end(2), f"{element[1]}:value", element[1])]
        else:
            continue
        for start, end, name, shown in hits:
            name = name.lower()
            found[name] = None if name in found else Place(shown, line[start:end], number, start + 1, end + 1)
    return {name: place for name, place in found.items() if place is not None}


def altered(text: str, chosen: dict[str, str]) -> str:
    """The text with these values in their places."""
    lines, known = text.split("\n"), places(text)
    # from the right: what is left of a place keeps its columns
    for place, value in sorted(
        ((known[name], value) for name, value in chosen.items() if name in known),
        key=lambda found: (found[0].line, -found[0].col),
    ):
        line = lines[place.line - 1]
        lines[place.line - 1] = line[: place.col - 1] + value + line[place.end - 1 :]
    return "\n".join(lines)
