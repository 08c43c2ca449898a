"""What a run drew: short names for its random values, and a deck of numbers that repeats the run."""

from __future__ import annotations

import re
from collections import Counter

from ..cards import CARDS
from ..diagnostics import deck_error
from ..draws import Tolerance

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from typing import Any

    from ..deck import Deck
    from ..draws import Draws

KEY = re.compile(r"([^\s=(){},;\"']+)\s*=\s*[^=]*$")
TOL = re.compile(r"\btol\s*=\s*(?:\{[^{}]*\}|[^\s,]+)", re.I)


def names(draws: Draws, taken: Iterable[str]) -> list[str]:
    """Of the values in the order in which they are drawn: r1, gain, npn(bf), m1(kt), r1(scale) of a tol=. Several of one name,
    as in a subcircuit that is used twice, are r1, r1:2; what is `taken` otherwise gets a colon behind it too."""
    found: list[str] = []
    used = Counter(dict.fromkeys(taken, 1))
    for call in draws.asked:
        name = f"{call.text.split()[0]}(scale)" if isinstance(call, Tolerance) else _owner(call)
        used[name] += 1
        found.append(name if used[name] == 1 else f"{name}:{used[name]}")
    return found


def _owner(call: Any) -> str:
    """Whose value a call says: the parameter in front of its `=`, the element, or a parameter of a card."""
    span = call.span
    if span is None:
        return str(call.fn)
    first = span.line
    while first > 1 and span.file.text_line(first).lstrip().startswith("+"):
        first -= 1
    words = span.file.text_line(first).lower().split()
    before = "\n".join(span.file.text_line(k) for k in range(first, span.line))
    before += "\n" + span.file.text_line(span.line)[: span.col - 1]
    set_ = KEY.search(before.lower())
    key, head = set_[1] if set_ else "", words[0]
    if head[0] == "." and head != ".model":
        return key or head
    card = words[1] if len(words) > 1 and (head == ".model" or head.upper() in CARDS) else head
    return f"{card}({key})" if key else card


def repeated(deck: Deck, draws: Draws, values: Mapping[str, float], options: Mapping[str, object]) -> str:
    """The text of a deck with numbers in place of what was drawn, `values` of parameters, elements and temp, and `options`.
    Raises DeckError where the text cannot say them: one call that drew several values, a call in another file."""
    text = deck.file.text
    edits: dict[tuple[int, int], str] = {}
    for call, value in zip(draws.asked, draws.drawn, strict=True):
        span, number = call.span, repr(value)
        if span is None or span.file is not deck.file:
            deck_error("E348", f"`{call}` stands in another file, which would have to say its value", span)
        start = deck.file.starts[span.line - 1] + span.col - 1
        if isinstance(call, Tolerance):
            found = TOL.search(text, start)
            assert found is not None, "an element with a tolerance says it"
            place, number = found.span(), f"scale={number}"
        else:
            place = (start, _closed(text, start))
        if edits.setdefault(place, number) != number:
            deck_error(
                "E348", f"`{call}` drew several values, and stands once", span,
                "it is in a subcircuit that is used more than once, or in a function",
            )  # fmt: skip
    behind = len(text)
    # from the end on; a call inside of another one is part of what that comes to
    for (start, end), number in sorted(edits.items(), key=lambda edit: (-edit[0][1], edit[0][0])):
        if end <= behind:
            text, behind = text[:start] + number + text[end:], start
    added = "".join(f".step {_kind(deck, name)}{name} list {value!r}\n" for name, value in values.items())
    added += "".join(f".options {key}={value}\n" for key, value in options.items())
    at = re.search(r"^[ \t]*\.end[ \t]*$", text, re.I | re.M)
    return text[: at.start()] + added + text[at.start() :] if at else text.rstrip("\n") + "\n" + added


def _kind(deck: Deck, name: str) -> str:
    return "param " if name in deck.params else "model " if name.endswith(")") else ""


def _closed(text: str, start: int) -> int:
    """Behind the bracket that closes the call which begins there."""
    at = text.index("(", start)
    depth = 0
    while True:
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
        if not depth:
            return at
