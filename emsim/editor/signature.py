"""What a waveform, a function or a card takes, and which of it is being written."""

from __future__ import annotations

import re

from ..cards import CARDS
from ..deck import Func
from ..elements import LETTERS
from . import words
from .layout import CLOSING, OPENING
from .place import Place, before

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .document import Document


class Signature:
    """`label` as it is written, `parts`: columns of its arguments in it, `active`: which of them is due, -1: none; `text` about
    the whole, `about` about the active one."""

    def __init__(
        self, label: str, parts: list[tuple[int, int]], active: int, text: str, about: str = ""
    ) -> None:
        self.label, self.parts, self.text, self.about = label, parts, text, about
        self.active = active if active < len(parts) else -1


def signature(document: Document, row: int, col: int) -> Signature | None:
    """At a place, row and column from 0; None where nothing is known to stand."""
    place = Place(document.lines, row, col)
    if not place.is_code or place.is_command:
        return None
    text = before(document.lines, row, col)
    if (call := _call(text)) is not None:
        return _of_call(document, row, *call)
    return _of_card(place)


def wave(name: str) -> str | None:
    """The reference of a waveform, as Markdown."""
    if (name := name.upper()) not in words.WAVES:
        return None
    rows = "\n".join(f"| `{arg}` | {unit} | {default} |" for arg, unit, default in words.arguments(name))
    head = "| argument | unit | if left out |\n|---|---|---|\n"
    return f"**{name}** — {words.WAVES[name][0]}\n\n    {words.wave_form(name)}\n\n{head}{rows}"


def _call(text: str) -> tuple[str, int, int] | None:
    """The innermost name with an open bracket: it, commas behind that bracket, and words."""
    stack: list[tuple[str, int]] = []  # name, where its arguments begin
    for k, c in enumerate(text):
        if c in OPENING:
            found = re.search(r"[\w.#$]+$", text[:k]) if c == "(" else None
            stack.append(("" if found is None else found[0].lower(), k + 1))
        elif c in CLOSING and stack:
            stack.pop()
    if not stack or not stack[-1][0]:
        return None
    name, at = stack[-1]
    inner = re.sub(r"[({][^(){}]*[)}]", "x", text[at:])
    return name, inner.count(","), len(re.findall(r"[^\s,]+[\s,]+", inner))


def _of_call(document: Document, row: int, name: str, commas: int, done: int) -> Signature | None:
    if name.upper() in words.WAVES:
        form, rows = words.wave_form(name.upper()), words.arguments(name.upper())
        parts = _parts(form, [arg for arg, _, _ in rows])
        active = done % 2 if name == "pwl" else done
        about = ""
        if active < len(rows):
            arg, unit, default = rows[active]
            about = f"{arg} [{unit}]" + (
                "" if default == "must be given" else f", if left out {default.replace('*', '')}"
            )
        return Signature(form, parts, active, words.WAVES[name.upper()][0], about)
    own = document.find(name, ("func",), document.scope_at(row))
    if own is not None and isinstance(own.card, Func):
        form = f"{name}({', '.join(own.card.args)})"
        return Signature(form, _parts(form, list(own.card.args)), commas, "function of this deck")
    if name in words.PROBES:
        form, unit, meaning = words.PROBES[name]
        return Signature(form, [], -1, f"[{unit}] {meaning}")
    said = words.FUNCTIONS.get(name) or words.OF_RESULTS.get(name)
    if said is None:
        return None
    inner = re.search(r"\((.*?)\)", said[0])
    return Signature(
        said[0], _parts(said[0], re.split(r"[,\s]+", inner[1]) if inner else []), commas, said[1]
    )


def _of_card(place: Place) -> Signature | None:
    """Of a card the words that stand by place; keys have none."""
    if not place.words:
        return None
    if place.is_machine:
        spec = CARDS[place.card.upper()].spec
        form, text = spec.form, spec.meaning
    elif place.card in words.DOTS:
        form, text = words.DOTS[place.card]
    elif (kind := LETTERS.get(place.card[0])) is not None and kind.form:
        form, text = kind.form, kind.what
    else:
        return None
    parts = [(m.start(), m.end()) for m in re.finditer(r"\S+", form)]
    first = next((k for k, (a, b) in enumerate(parts) if "=" in form[a:b] or form[a] in "[("), len(parts))
    return Signature(form, parts[:first], -1 if place.key else len(place.words), text)


def _parts(form: str, names: list[str]) -> list[tuple[int, int]]:
    at, found = form.index("(") + 1 if "(" in form else 0, []
    for name in names:
        start = form.find(name, at)
        if start < 0:
            break
        at = start + len(name)
        found.append((start, at))
    return found
