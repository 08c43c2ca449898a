"""What changes the deck for the runs that follow: alter, altermod, alterparam, reset."""

from __future__ import annotations

import re

from . import words
from .base import Command
from .errors import CommandError, usage

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .program import Statement
    from .session import Session

ALTER = "alter device [parameter] = value, alter @device[parameter] = value, .. = [ numbers ]"
ALTERMOD = "altermod model parameter = value, altermod @model[parameter] = value"
ALTERPARAM = "alterparam name = value, alterparam subcircuit name = value"


def _sides(text: str, form: str) -> tuple[list[str], str]:
    """What is named, and the value: behind `=`, or the last word."""
    left, equals, right = text.partition("=")
    if not equals:
        found = re.match(r"(.*?)\s+(\[.*\]|\S+)\s*$", text, re.S)
        if found is None:
            usage(form, "there is no value")
        left, right = found[1], found[2]
    named = words.split(left, braces=False)
    if not named or not right.strip():
        usage(form, "there is no value" if named else "nothing is named")
    return named, right.strip()


def _values(s: Session, text: str) -> float | list[float]:
    """A number, or a list in brackets; expressions of vectors too."""
    if text[0] == "[" and text[-1] == "]":
        return s.numbers(text[1:-1].replace(",", " "))
    found = s.numbers(text)
    if len(found) != 1:
        raise CommandError("E161", f"one value is needed, there are {len(found)}", f"form: {ALTER}")
    return found[0]


def _at(word: str) -> tuple[str, str] | None:
    found = re.fullmatch(r"@([^\[\]]+)\[([^\[\]]+)\]", word)
    return (found[1], found[2]) if found else None


def alter(s: Session, text: str, at: Statement) -> None:
    named, right = _sides(text, ALTER)
    device, parameter = named[0], named[1] if len(named) > 1 else None
    if (pair := _at(named[0])) is not None:
        device, parameter = pair
    if len(named) > 2:
        usage(ALTER, f"`{named[2]}` does not fit")
    s.deck.alter(device.lstrip("@"), parameter, _values(s, right))


def altermod(s: Session, text: str, at: Statement) -> None:
    named, right = _sides(text, ALTERMOD)
    value = s.numbers(right)[0]
    if (pair := _at(named[0])) is not None:
        s.deck.alter_model(pair[0], pair[1], value)
        return
    if len(named) < 2:
        usage(ALTERMOD, "a model and its parameter are needed")
    for model in named[:-1]:
        s.deck.alter_model(model, named[-1], value)


def alterparam(s: Session, text: str, at: Statement) -> None:
    named, right = _sides(text, ALTERPARAM)
    if len(named) > 2:
        usage(ALTERPARAM, f"`{named[2]}` does not fit")
    s.deck.alter_parameter(named[-1], s.numbers(right)[0], named[0] if len(named) == 2 else None)


def reset(s: Session, text: str, at: Statement) -> None:
    s.deck.reset()


def mc_source(s: Session, text: str, at: Statement) -> None:
    s.deck.reread()


def setcirc(s: Session, text: str, at: Statement) -> None:
    s.say(f"List of circuits loaded:\n\nCurrent\t1\t{s.deck.title}")


def remcirc(s: Session, text: str, at: Statement) -> None:
    s.note(f"`{at.word}`: the deck is the one circuit, and stays")


COMMANDS = (
    Command("alter", ALTER, "changes an element for the runs that follow", alter),
    Command("altermod", ALTERMOD, "changes a model for the runs that follow", altermod),
    Command("alterparam", ALTERPARAM, "changes a .param for the runs that follow", alterparam),
    Command("reset", "reset", "the deck as it was written, altered parameters apart", reset),
    Command("mc_source", "mc_source", "the deck as it was written, with new random values", mc_source),
    Command("remcirc", "remcirc", "passed over: the deck is the one circuit", remcirc),
    Command("setcirc", "setcirc", "the one circuit that there is", setcirc),
)
