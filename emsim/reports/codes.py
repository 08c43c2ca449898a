"""The catalogue of messages: what `emsim explain E203` tells, read from the Markdown files of emsim/messages/.

One file a family of codes. Every entry has this form; the test of the catalogue runs all of its decks:

    ## E203 Title in physics words

    What it means.

    ```spice                    the deck that gives the message, deck.cir; `spice parts.inc` is a file beside it
    ```sh                       the command, where it is not `emsim deck.cir`

    What to do.

    ```spice fixed              the same deck, mended; `spice fixed parts.inc`, `sh fixed` likewise

Exit codes have entries too, `## exit 3 ...`. No message is written here: it is made by running the deck.
"""

from __future__ import annotations

import re
from os.path import abspath, dirname, join
from typing import NamedTuple

FOLDER = join(dirname(dirname(abspath(__file__))), "messages")
# the files, in the order in which a deck meets them
FAMILIES = (
    "reading", "control", "names", "machine", "motors", "circuit", "clocked", "lines", "code_models", "running",
    "steady", "results", "sweeps", "drawing", "searching", "fmu", "robots", "outside", "exit_codes",
)  # fmt: skip
COMMAND = "emsim deck.cir"
_HEAD = re.compile(r"## ([EWN]\d{3}|exit \d+) (.+)")
_FENCE = re.compile(r"```(\w*) *(.*)")


class Entry(NamedTuple):
    """One code. `example` and `fixed` are files by name, beside the commands that run them; both commands are empty where
    no deck of the user's gives the message, `fixed_command` where there is nothing to mend."""

    code: str
    title: str
    family: str
    meaning: str
    example: dict[str, str]
    command: str
    remedy: str
    fixed: dict[str, str]
    fixed_command: str


def catalogue() -> dict[str, Entry]:
    """All entries by code (`E203`, `exit 3`), in the order of the files. Raises ValueError for a file out of form."""
    found: dict[str, Entry] = {}
    for name in FAMILIES:
        with open(join(FOLDER, name + ".md"), encoding="utf-8") as file:
            for entry in entries(file.read()):
                if entry.code in found:
                    raise ValueError(f"{name}: {entry.code} has two entries")
                found[entry.code] = entry
    return found


def entries(text: str) -> list[Entry]:
    """The entries of one file."""
    head, *parts = re.split(r"^(?=## )", text, flags=re.M)
    family = head.partition("\n")[0].removeprefix("# ").strip()
    return [_entry(family, part.split("\n")) for part in parts]


def _entry(family: str, lines: list[str]) -> Entry:
    head = _HEAD.fullmatch(lines[0])
    if head is None:
        raise ValueError(f"not a heading of an entry: {lines[0]}")
    prose: list[list[str]] = [[], []]  # before and behind the first deck
    decks: list[dict[str, str]] = [{}, {}]
    commands = ["", ""]
    at = 1
    while at < len(lines):
        fence = _FENCE.fullmatch(lines[at])
        if fence is None:
            prose[bool(decks[0] or commands[0])].append(lines[at])
            at += 1
            continue
        end = lines.index("```", at + 1)
        body = "\n".join(lines[at + 1 : end])
        words = fence[2].split()
        fixed = "fixed" in words
        if fence[1] == "sh":
            commands[fixed] = body
        elif fence[1] == "spice":
            name = next((word for word in words if word != "fixed"), "deck.cir")
            decks[fixed][name] = body + "\n"
        else:
            raise ValueError(f"{head[1]}: a block of {fence[1] or 'nothing'}")
        at = end + 1
    meaning, remedy = ("\n".join(part).strip() for part in prose)
    command = commands[0] or (COMMAND if decks[0] else "")
    if not command:  # no deck: the last paragraph is the remedy
        meaning, _, remedy = meaning.rpartition("\n\n")
    fixed_command = commands[1] or (command if decks[1] else "")
    return Entry(head[1], head[2], family, meaning, decks[0], command, remedy, decks[1], fixed_command)
