"""What of a .control section is known before it runs: analyses that stand there plainly, outside of blocks and without variables,
and options that are set before the first of them.

The section itself is carried out by control/; this is for whoever has to know a deck's analyses and does not run it: `check`,
`explain`, charts, editors.
"""

from __future__ import annotations

from .parsed import parse_line
from .source import Line
from .syntax import LineError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

ANALYSES = frozenset("tran op dc ac noise tf pz sens disto sp ss pss".split())
BLOCKS = frozenset("foreach while dowhile repeat if begin".split())
ENDS = ("end", "endif", "endwhile", "enddowhile", "endrepeat", "endforeach")
# simulator options among the variables that `set` can set
OPTIONS = frozenset(
    """reltol abstol vntol chgtol trtol gmin itl1 itl2 itl4 maxord method temp tnom rshunt gshunt cshunt""".split()
)


def foreseen(lines: list[Line], convert: Callable[[str, list[Any], Line], Any]) -> list[Any]:
    """The cards that plain commands come to. What cannot be read is left to the section's run, which tells."""
    cards: list[Any] = []
    depth, ran = 0, False
    for line in lines:
        for _, text in commands(line.text):
            word, rest = [*text.split(None, 1), ""][:2]
            word = word.lower()
            if word in ("quit", "exit", "bye") and not depth:
                return cards
            depth += (word in BLOCKS) - (word in ENDS)
            if word in ("osdi", "pre_osdi"):
                from .deck import Dot

                cards += [Dot("hdl", path.strip("\"'"), line.whole) for path in rest.split()]
                continue
            is_analysis = word in ANALYSES
            is_option = word in ("option", "options") or (
                word == "set" and rest.partition("=")[0].strip().lower() in OPTIONS
            )
            ran = ran or is_analysis or word == "run"
            if depth > 0 or "$" in text or not (is_analysis or (is_option and rest and not ran)):
                continue
            given = Line(line.file, line.number, line.col, line.start, line.end)
            given.text, given.single = "." + text if is_analysis else text, True
            try:
                rule, children = parse_line(given, "dot" if is_analysis else "command")
                card = convert(rule, children, given)
            except LineError:
                continue
            if card is not None:
                cards.append(card)
    return cards


def commands(text: str) -> Iterator[tuple[int, str]]:
    """(place, text) of the command of a logical line: `+` goes on with the line above; `;`, `//` and ` $ ` begin a comment."""
    if "\n" in text:
        text = " ".join(
            part.strip().removeprefix("+") if k else part for k, part in enumerate(text.split("\n"))
        )
    end = comment(text)
    lead = len(text) - len(text.lstrip())
    text = text[:end].strip()
    if text and text[0] not in "*#$":
        yield lead, text


def comment(text: str) -> int:
    """Where a comment begins in a line of .control, or its end."""
    quoted = ""
    for at, c in enumerate(text):
        if quoted:
            quoted = "" if c == quoted else quoted
        elif c in "\"'":
            quoted = c
        elif (
            c == ";"
            or (text[at : at + 2] == "//" and text[at - 1 : at] in ("", " ", "\t"))
            or (text[at : at + 2] in ("$ ", "$") and text[at - 1 : at] in ("", " ", "\t"))
        ):
            return at
    return len(text)
